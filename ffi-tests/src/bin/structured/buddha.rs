//! A glossy buddha in Grace cathedral (Figs. 1 and 6).

use crate::phong::Phong;
use crate::{EQUAL, MEGAPIXELS, Map, Measured, every, strata_lights, table};
use anyhow::Result;
use glam::Vec3;
use std::fmt::Write;
use wis_ffi_tests::client::raw;
use wis_ffi_tests::data;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::paper::{Paper, VISIBLE, Verdict, columns};
use wis_ffi_tests::scene::{Scene, ShadingPoint, Stage, View};
use wis_ffi_tests::structured::{How, Raster, Source, steps, truth};

static PHONG: Phong = Phong { exponent: 50 };
/// Columns and rows of pixels from one measured point to the next.
const STEP: u32 = 3;
/// Shares of the mean of the picture: a light that may add as much is traced, the others are picked at such steps.
const STEPS: [f32; 5] = [0.05, 0.1, 0.2, 0.3, 0.5];
/// The first row of picked lights in the table.
const FIRST: usize = 18;
/// Places of a stratum whose BRDFs are averaged.
const PLACES: usize = 16;
/// How many times as fast several times is.
const SEVERAL: f64 = 2.0;
/// Rays a point that the paper needs with sorting.
const RAYS: f64 = 4.7;

/// Where the camera looks, and how near it is in place of at a whole scene's distance: the upper half fills the picture.
const TARGET: Vec3 = Vec3::new(0.0, 0.0, 0.72);
const NEAR: f32 = 0.45;

/// The buddha without its ground, which is not in the paper's picture but hides what is below.
fn alone() -> Result<Scene> {
    let stage = Stage::outdoors(data::mesh("buddha.obj")?).close_up(TARGET, NEAR);
    let mut scene = Scene::of("buddha, close up", &stage, View::Image(1))?;
    scene.points.retain(|point| !point.is_ground());
    Ok(scene)
}

/// The mean share of samples of a map that lie where the lobe is above half of its peak.
fn share_in_the_lobe(map: &Map, scene: &Scene) -> f64 {
    const POINTS: usize = 64;
    let least = 0.5f32.powf(1.0 / PHONG.exponent as f32);
    let texels: Vec<_> = map.light.quadrature(1).zip(map.light.luminance()).collect();
    let weight = |((_, area), radiance): &((Vec3, f64), &f32)| area * f64::from(**radiance);
    let whole: f64 = texels.iter().map(weight).sum();
    let inside = |point: &ShadingPoint| {
        let reflected = 2.0 * point.normal.dot(point.wo) * point.normal - point.wo;
        texels.iter().filter(|((wi, _), _)| wi.dot(reflected) > least).map(weight).sum::<f64>()
    };
    let points = scene.points.iter().step_by((scene.points.len() / POINTS).max(1));
    let shares: Vec<f64> = points.map(|point| inside(point) / whole).collect();
    shares.iter().sum::<f64>() / shares.len() as f64
}

/// Writes the section.
pub fn write(page: &mut Paper, map: &Map) -> Result<()> {
    page.heading("A glossy buddha in Grace cathedral (Figs. 1 and 6)")?;
    let material = Material::called_back(&PHONG);
    let scene = alone()?;
    let none = vec![0.0; scene.points.len()];
    let thin = every(STEP, scene, &none).0;
    let thinned = truth(&thin, &map.light, &material)?;
    let level = Some(thinned.iter().sum::<f64>() / thinned.len() as f64);
    let raster = Raster::new(&map.light);
    let lights =
        [1, 10, 100, 300, 1000].into_iter().map(|count| strata_lights(map, count)).collect::<Result<Vec<_>>>()?;
    let l300 = &lights[3];
    let importance = [1, 10, 100, 300, 1000, 3000];
    let name = |n: usize| format!("stratified importance, {n}");
    let mut rows = Vec::from(importance.map(|n| (name(n), How::Importance(&raster, n))));
    rows.extend([300, 1000].map(|n| (format!("BRDF, {n}"), How::Brdf(&map.light, n))));
    rows.extend([30, 100, 300, 1000].map(|n| (format!("MIS of both, {n}"), How::Mis(&raster, n))));
    let strata = lights.iter().map(|lights| (format!("structured, {}", lights.count), How::Lights(lights)));
    rows.extend(strata);
    let source = Source::new(&map.light);
    let jitter = source.jitter(&source.strata(300)?, raw::WIS_JITTER_ENERGY)?;
    rows.push(("structured, 300, the BRDF's mean over 16 places".into(), How::Spread(l300, &jitter, PLACES)));
    rows.extend(STEPS.map(|step| (format!("structured, 300, picked at {step}"), How::Picked(l300, step, level))));
    let name = |step: f32| format!("the same at {step}, with a control variate");
    rows.extend(STEPS.map(|step| (name(step), How::Controlled(l300, step, level))));
    let m = table(page, &thin, &material, &thinned, &rows)?;
    let [evaluate, order] = steps(&thin, &material, l300)?;
    let picked = &m[FIRST + 1];
    writeln!(page.text)?;
    columns(&mut page.text, 1, "step, 300 lights | us a point")?;
    writeln!(
        page.text,
        "| what each may add | {evaluate:.2} |\n| their order, which picks do without | {order:.2} |\n\
         | {:.0} rays to all lights above the horizon | {:.2} |\n| picks at {} and their {:.0} rays | {:.2} |",
        m[15].rays,
        m[15].us - evaluate,
        STEPS[1],
        picked.rays,
        picked.us - evaluate
    )?;
    claims(page, &m, share_in_the_lobe(map, &thin));
    Ok(())
}

/// A cause, where the numbers of the run show it.
fn cause(is_shown: bool, words: String) -> String {
    if is_shown { words } else { String::new() }
}

fn claims(page: &mut Paper, m: &[Measured], in_the_lobe: f64) {
    let error = |i: usize| m[i].error;
    page.claim(
        "a glossy buddha takes",
        Verdict::Refuted.unless(error(15) <= EQUAL * error(5)),
        &[&error(15), &error(3), &error(4), &error(5), &PLACES, &error(17), &error(16)],
    );
    let lobe =
        format!("{:.1} % of the samples of this map lie where the lobe is above half of its peak", 100.0 * in_the_lobe);
    let verdict = Verdict::Refuted.unless(error(7) > error(4));
    page.claim("sampling the BRDF is", verdict, &[&error(7), &error(4), &cause(in_the_lobe < 0.5, lobe)]);
    mis(page, m);
    sorting(page, m);
}

fn mis(page: &mut Paper, m: &[Measured]) {
    let error = |i: usize| m[i].error;
    let at = |i: usize| m[i].us * MEGAPIXELS;
    let parts = format!(
        "the paper concludes it from both parts being worse; here the BRDF alone has {:.3} with 300, and MIS lies between its parts",
        error(6)
    );
    let cause = cause(error(6) < error(15) && (error(6)..=error(3)).contains(&error(10)), parts);
    let verdict = Verdict::Refuted.unless(error(10) >= error(15) && error(11) >= error(16));
    page.claim("MIS of map and", verdict, &[&error(10), &error(15), &error(11), &error(16), &at(10), &at(15), &cause]);
}

fn sorting(page: &mut Paper, m: &[Measured]) {
    let at = |i: usize| m[i].us * MEGAPIXELS;
    // Picks, then those with a control variate.
    let rows = FIRST..FIRST + 2 * STEPS.len();
    let alike = |i: &usize| m[*i].displayed <= m[15].displayed + VISIBLE;
    let equal = |i: &usize| m[*i].error <= EQUAL * m[15].error;
    let fewest = |is: &dyn Fn(&usize) -> bool| {
        let enough = rows.clone().filter(is).map(|i| m[i].rays).fold(m[15].rays, f64::min);
        format!("{enough:.1}")
    };
    let few = rows.clone().filter(|&i| m[i].rays <= RAYS);
    let paired = few.min_by(|&a, &b| m[a].displayed.total_cmp(&m[b].displayed)).unwrap_or(rows.end - 1);
    let gains = rows.clone().take(STEPS.len()).map(|i| (m[i].displayed - m[i + STEPS.len()].displayed).abs());
    let (own, all, white) = (&m[paired], &m[15], |i: usize| 100.0 * m[i].displayed);
    let most = 100.0 * gains.fold(0.0, f64::max);
    let fewest = [fewest(&equal), fewest(&alike)];
    page.claim(
        "sorting needs 4.7 rays",
        Verdict::Refuted.unless(own.rays <= RAYS && alike(&paired)),
        &[&own.rays, &white(paired), &white(15), &all.rays, &own.error, &all.error, &fewest[0], &fewest[1], &most],
    );
    let best = rows.filter(alike).min_by(|&a, &b| m[a].us.total_cmp(&m[b].us));
    page.claim(
        "sorting makes the buddha",
        best.is_some_and(|i| at(i) * SEVERAL <= at(15)),
        &[&at(15), &best.map_or("not reached".into(), |i| format!("{:.1} s", at(i))), &at(3)],
    );
}
