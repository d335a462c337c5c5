//! A glossy buddha in Grace cathedral (Figs. 1 and 6).

use crate::phong::Phong;
use crate::{EQUAL, MEGAPIXELS, Map, Measured, compare, every, is_ground, strata_lights, table};
use anyhow::Result;
use glam::Vec3;
use std::fmt::Write;
use wis_ffi_tests::data;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::paper::Paper;
use wis_ffi_tests::scene::{Scene, ShadingPoint, Stage, View};
use wis_ffi_tests::structured::{How, Raster, truth};

static PHONG: Phong = Phong { exponent: 50 };
/// Few random lights of the rest, when lights are sorted.
const FEW: usize = 2;
/// Columns and rows of pixels from one measured point to the next.
const STEP: u32 = 2;
/// Shares of the whole that the rest of sorted lights may have.
const SORTED: [f32; 6] = [0.01, 0.05, 0.1, 0.2, 0.4, 0.6];
/// The first row of sorted lights in the table.
const FIRST: usize = 17;
/// Rays a point that the paper needs with sorting.
const RAYS: f64 = 4.7;

/// Where the camera looks, and how near it is in place of at a whole scene's distance: the upper half fills the picture.
const TARGET: Vec3 = Vec3::new(0.0, 0.0, 0.72);
const NEAR: f32 = 0.45;

/// The buddha without its ground, which is not in the paper's picture but hides what is below.
fn alone() -> Result<Scene> {
    let stage = Stage::outdoors(data::mesh("buddha.obj")?).close_up(TARGET, NEAR);
    let mut scene = Scene::of("buddha, close up", &stage, View::Image(1))?;
    scene.points.retain(|point| !is_ground(point));
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
    writeln!(page.text, "\n## A glossy buddha in Grace cathedral (Figs. 1 and 6)\n\n{TEXT}")?;
    let (scene, material) = (alone()?, Material::called_back(&PHONG));
    let whole = truth(&scene, &map.light, &material)?;
    let (thin, thinned) = every(STEP, alone()?, &whole);
    let raster = Raster::new(&map.light);
    let lights = [1, 10, 100, 300, 1000].map(|count| strata_lights(map, count));
    let [l1, l10, l100, l300, l1000] = lights;
    let (l1, l10, l100, l300, l1000) = (l1?, l10?, l100?, l300?, l1000?);
    let mut rows = vec![
        ("stratified importance, 1", How::Importance(&raster, 1)),
        ("stratified importance, 10", How::Importance(&raster, 10)),
        ("stratified importance, 100", How::Importance(&raster, 100)),
        ("stratified importance, 300", How::Importance(&raster, 300)),
        ("stratified importance, 1000", How::Importance(&raster, 1000)),
        ("stratified importance, 3000", How::Importance(&raster, 3000)),
        ("BRDF, 300", How::Brdf(&map.light, 300)),
        ("BRDF, 1000", How::Brdf(&map.light, 1000)),
        ("MIS of both, 30", How::Mis(&raster, 30)),
        ("MIS of both, 100", How::Mis(&raster, 100)),
        ("MIS of both, 300", How::Mis(&raster, 300)),
        ("MIS of both, 1000", How::Mis(&raster, 1000)),
        ("structured, 1", How::Lights(&l1)),
        ("structured, 10", How::Lights(&l10)),
        ("structured, 100", How::Lights(&l100)),
        ("structured, 300", How::Lights(&l300)),
        ("structured, 1000", How::Lights(&l1000)),
    ];
    let names = SORTED.map(|threshold| format!("structured 300, sorted to {threshold}"));
    rows.extend(names.iter().zip(SORTED).map(|(name, threshold)| (name.as_str(), How::Sorted(&l300, threshold, FEW))));
    let m = table(page, &thin, &material, &thinned, &rows)?;
    let shown = [
        ("importance, 300", How::Importance(&raster, 300)),
        ("importance, 3000", How::Importance(&raster, 3000)),
        ("BRDF, 300", How::Brdf(&map.light, 300)),
        ("MIS, 300", How::Mis(&raster, 300)),
        ("structured, 100", How::Lights(&l100)),
        ("structured, 300", How::Lights(&l300)),
        ("sorted to 0.2", How::Sorted(&l300, 0.2, FEW)),
    ];
    compare(page, "buddha.png", (&scene, &material), &whole, map, &shown)?;
    claims(page, &m, share_in_the_lobe(map, &thin));
    Ok(())
}

/// A cause, where the numbers of the run show it.
fn cause(is_shown: bool, words: String) -> String {
    if is_shown { words } else { String::new() }
}

fn claims(page: &mut Paper, m: &[Measured], in_the_lobe: f64) {
    let error = |i: usize| m[i].error;
    page.claims.add(
        "a glossy buddha takes ten times fewer samples (Figs. 1 and 6)",
        "300 lights against 3000 samples",
        format!(
            "error {:.3} with 300 lights; importance sampling {:.3} with 300, {:.3} with 1000, {:.3} with 3000",
            error(15),
            error(3),
            error(4),
            error(5)
        ),
        error(15) <= EQUAL * error(5),
        &cause(
            error(16) < error(15),
            format!(
                "lights are deterministic, so that their error is bias; with 1000 lights it falls to {:.3}",
                error(16)
            ),
        ),
    );
    page.claims.add(
        "sampling the BRDF is worse than sampling the map",
        "\"even more noisy\" with 1000 samples",
        format!("BRDF {:.3}, map {:.3}", error(7), error(4)),
        error(7) > error(4),
        &cause(
            in_the_lobe < 0.5,
            format!(
                "{:.1} % of the samples of this map lie where the lobe is above half of its peak",
                100.0 * in_the_lobe
            ),
        ),
    );
    mis(page, m);
    sorting(page, m);
}

fn mis(page: &mut Paper, m: &[Measured]) {
    let error = |i: usize| m[i].error;
    let at = |i: usize| m[i].us * MEGAPIXELS;
    page.claims.add(
        "MIS of map and BRDF cannot be better than structured sampling",
        "\"cannot perform better\", not measured",
        format!(
            "300 samples: MIS {:.3}, structured {:.3}; at 1000 {:.3} and {:.3}; {:.1} s and {:.1} s with 300",
            error(10),
            error(15),
            error(11),
            error(16),
            at(10),
            at(15)
        ),
        error(10) >= error(15) && error(11) >= error(16),
        &cause(
            error(6) < error(15) && (error(6)..=error(3)).contains(&error(10)),
            format!(
                "the paper concludes it from both parts being worse; here the BRDF alone has {:.3} with 300, and MIS lies between its parts",
                error(6)
            ),
        ),
    );
}

fn sorting(page: &mut Paper, m: &[Measured]) {
    let error = |i: usize| m[i].error;
    let at = |i: usize| m[i].us * MEGAPIXELS;
    let last = FIRST + SORTED.len() - 1;
    let paired = (FIRST..=last).find(|&i| m[i].rays <= RAYS).unwrap_or(last);
    page.claims.add(
        "sorting needs 4.7 rays a point in place of 300 at the same quality",
        "4.7 of 300",
        format!(
            "{:.1} rays: error {:.3} in place of {:.3} with {:.0} rays; {:.1} rays: {:.3}",
            m[paired].rays,
            error(paired),
            error(15),
            m[15].rays,
            m[FIRST + 1].rays,
            error(FIRST + 1)
        ),
        m[paired].rays <= RAYS && error(paired) <= EQUAL * error(15),
        &format!(
            "so few rays leave up to {:.0} % of what could arrive to {FEW} random lights",
            100.0 * SORTED[paired - FIRST]
        ),
    );
    // Sorted rows differ in their rays: a line through the first and the last tells what remains without any.
    let ray = (m[FIRST].us - m[last].us) / (m[FIRST].rays - m[last].rays).max(f64::MIN_POSITIVE);
    let fixed = m[last].us - ray * m[last].rays;
    let best = (FIRST..=last).filter(|&i| error(i) <= EQUAL * error(15)).min_by(|&a, &b| m[a].us.total_cmp(&m[b].us));
    page.claims.add(
        "sorting makes the buddha several times as fast",
        "55 s, sorted 12 s; importance sampling 83 s",
        format!(
            "{:.1} s; sorted at the same error {}, to 0.4 {:.1} s; importance sampling {:.1} s",
            at(15),
            best.map_or("not reached".into(), |i| format!("{:.1} s", at(i))),
            at(FIRST + 4),
            at(3)
        ),
        best.is_some_and(|i| at(i) * 2.0 <= at(15)),
        &cause(
            3.0 * fixed > m[15].us,
            format!(
                "to evaluate and to order 300 lights takes {fixed:.1} us a point before the first ray; without sorting all takes {:.1} us",
                m[15].us
            ),
        ),
    );
}

const TEXT: &str = "The paper's material: grey Phong of exponent 50, (n + 2) / (2 pi) cos^n. Its evaluation is scalar here, in double
precision. Errors are of the buddha alone, close up. *MIS*: half of the samples of the map, stratified, half of the BRDF; balance
heuristic. *Sorted*: what a light may add is what it adds to a point that sees it. Lights are traced in that order, the largest
first, until the rest may add less than a share of the whole. Two lights of the rest, drawn in proportion to what they may add,
estimate how much of the rest is seen.
";
