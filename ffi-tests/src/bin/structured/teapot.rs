//! A teapot in Galileo's tomb (Figs. 5 and 7).

use crate::maps::ROUNDS;
use crate::{EQUAL, MEGAPIXELS, Map, Measured, compare, every, strata_lights, table};
use anyhow::Result;
use std::fmt::Write;
use wis_ffi_tests::client::raw;
use wis_ffi_tests::data;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::medians::{Cut, cut};
use wis_ffi_tests::paper::{Paper, VISIBLE, Verdict, columns};
use wis_ffi_tests::scene::{Scene, View};
use wis_ffi_tests::structured::{How, Lights, Raster, Source, Start, clustered, picture, truth};

/// Columns and rows of pixels from one point of the pictures to the next, and of the table.
const FINE: u32 = 2;
const STEP: u32 = 6;
/// Shares of what could arrive: a light that may add as much is traced, the others are picked at such steps.
const STEPS: [f32; 4] = [0.005, 0.01, 0.015, 0.02];
/// Of sorted lights: the share of the whole that the rest may have, and how many of the rest are drawn.
const SORTED: (f32, usize) = (0.5, 4);
/// The first row of picked lights in the table; the last row is that of sorted ones.
const FIRST: usize = 16;
/// Lights of the comparison of four ways to cut a map; the other number of it is that of the pictures.
const FEWER: u32 = 64;
/// How much times may differ that are nearly the same.
const NEARLY: f64 = 0.1;
/// The share of the shadow rays that sorting saves in the paper.
const SAVED: f64 = 0.75;

/// Writes both sections.
pub fn write(page: &mut Paper, map: &Map) -> Result<()> {
    let scene = data::scene("teapot.obj", View::Image(FINE))?;
    let material = Material::lambert();
    let whole = truth(&scene, &map.light, &material)?;
    let thinned = every(STEP, data::scene("teapot.obj", View::Image(FINE))?, &whole);
    lights(page, map, (&scene, &whole), (&thinned.0, &thinned.1), &material)?;
    jitter(page, map, (&scene, &whole), (&thinned.0, &thinned.1), &material)
}

/// A scene and its picture without noise.
type Known<'a> = (&'a Scene, &'a [f64]);

fn lights(page: &mut Paper, map: &Map, whole: Known, thinned: Known, material: &Material) -> Result<()> {
    page.heading("A teapot in Galileo's tomb (Fig. 5)")?;
    let raster = Raster::new(&map.light);
    let (l100, l300) = (strata_lights(map, 100)?, strata_lights(map, 300)?);
    let kmeans = |count: usize, rounds: usize, start: Start| -> Lights {
        clustered(&map.light, count, rounds, start).tinted(&map.light, &map.colours)
    };
    let (k300, k3000) = (kmeans(300, ROUNDS, Start::Weight), kmeans(3000, 2, Start::Weight));
    let (even300, even3000) = (kmeans(300, ROUNDS, Start::Area), kmeans(3000, 3, Start::Area));
    let named = |name: &str, how| (name.to_string(), how);
    let mut rows = vec![
        named("uniform stratified, 300", How::Uniform(&map.light, 300)),
        named("stratified importance, 300", How::Importance(&raster, 300)),
        named("stratified importance, 3000", How::Importance(&raster, 3000)),
        named("k-means from an even start, 300", How::Lights(&even300)),
        named("k-means from an even start, 3000", How::Lights(&even3000)),
        named("k-means from a start by weight, 300", How::Lights(&k300)),
        named("k-means from a start by weight, 3000", How::Lights(&k3000)),
        named("structured, 100", How::Lights(&l100)),
        named("structured, 300", How::Lights(&l300)),
        named("structured, 300, one by one", How::OneByOne(&l300)),
    ];
    let cuts = [(64, Cut::Median), (300, Cut::Median), (64, Cut::Variance), (300, Cut::Variance)];
    let cuts = cuts.map(|(count, rule)| cut(&map.light, count, rule));
    let (l64, k64) = (strata_lights(map, FEWER)?, kmeans(FEWER as usize, ROUNDS, Start::Weight));
    let others = ["median cut, 64", "median cut, 300", "variance minimisation, 64", "variance minimisation, 300"];
    rows.push(named("structured, 64", How::Lights(&l64)));
    rows.push(named("k-means from a start by weight, 64", How::Lights(&k64)));
    rows.extend(others.iter().zip(&cuts).map(|(name, lights)| named(name, How::Lights(lights))));
    rows.extend(STEPS.map(|step| (format!("structured, 300, picked at {step}"), How::Picked(&l300, step, None))));
    rows.push(named("structured, 300, sorted to 0.5", How::Sorted(&l300, SORTED.0, SORTED.1)));
    let m = table(page, thinned.0, material, thinned.1, &rows)?;
    let shown = [
        ("uniform, 300", How::Uniform(&map.light, 300)),
        ("importance, 300", How::Importance(&raster, 300)),
        ("even k-means, 300", How::Lights(&even300)),
        ("even k-means, 3000", How::Lights(&even3000)),
        ("structured, 100", How::Lights(&l100)),
        ("structured, 300", How::Lights(&l300)),
    ];
    let values = compare(page, "teapot.png", (whole.0, material), whole.1, map, &shown)?;
    claims(page, &m);
    let [few, strata] = [2, 5].map(|i| Parts::of(whole.0, whole.1, &values[i]).bands);
    page.claim("300 lights of k-means", few >= 1.5 * strata, &[&few, &strata]);
    Ok(())
}

fn claims(page: &mut Paper, m: &[Measured]) {
    let pair = |a: usize, b: usize| format!("error {:.4} against {:.4}", m[a].error, m[b].error);
    let at = |i: usize| m[i].us * MEGAPIXELS;
    page.claim("300 lights are as", m[8].error <= EQUAL * m[2].error, &[&pair(8, 2)]);
    page.claim("100 lights look convincing,", m[7].error * 2.0 <= m[1].error, &[&pair(7, 1)]);
    page.claim("uniform stratified sampling is", m[0].error >= 2.0 * m[1].error, &[&pair(0, 1)]);
    let is_caught = |few: usize, many: usize| m[many].error >= m[few].error / 1.5;
    page.claim(
        "3000 lights of k-means",
        Verdict::Untested.unless(is_caught(3, 4)),
        &[&m[3].error, &m[4].error, &m[5].error, &m[6].error],
    );
    page.claim("structured sampling is faster", m[9].us < m[1].us, &[&at(8), &at(9), &at(1)]);
    sorting(page, m);
}

fn sorting(page: &mut Paper, m: &[Measured]) {
    let at = |i: usize| m[i].us * MEGAPIXELS;
    let (last, sorted) = (FIRST + STEPS.len() - 1, FIRST + STEPS.len());
    let saved = |i: usize| 1.0 - m[i].rays / m[8].rays;
    let enough = (FIRST..=last).find(|&i| saved(i) >= SAVED).unwrap_or(last);
    let (few, all, percent) = (&m[enough], &m[8], |i: usize| 100.0 * saved(i));
    page.claim(
        "sorting saves three quarters",
        saved(enough) >= SAVED && few.displayed <= VISIBLE,
        &[&percent(enough), &(100.0 * few.displayed), &(100.0 * all.displayed), &few.error, &all.error],
    );
    let slower = m[sorted].us / m[8].us;
    page.claim(
        "sorting does not save",
        Verdict::Refuted.unless((slower - 1.0).abs() <= NEARLY),
        &[&at(8), &at(sorted), &percent(sorted), &at(enough), &percent(enough), &slower],
    );
}

/// What an error consists of, over the mean: the part that neighbouring pixels share, which is seen as bands or as a tint,
/// and the rest, which is seen as noise. The squares add up to that of the error.
struct Parts {
    bands: f64,
    noise: f64,
}

impl Parts {
    /// By the correlation of the errors of horizontal neighbours.
    fn of(scene: &Scene, truth: &[f64], values: &[f64]) -> Parts {
        let errors: Vec<f64> = values.iter().zip(truth).map(|(v, t)| v - t).collect();
        let mean = truth.iter().sum::<f64>() / truth.len() as f64;
        let square = errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64;
        let pairs = scene.points.windows(2).zip(errors.windows(2));
        let beside = pairs.filter(|(p, _)| p[0].pixel[0] + FINE == p[1].pixel[0] && p[0].pixel[1] == p[1].pixel[1]);
        let (sum, squares) = beside.fold((0.0, f64::MIN_POSITIVE), |(sum, squares), (_, e)| {
            (sum + e[0] * e[1], squares + 0.5 * (e[0] * e[0] + e[1] * e[1]))
        });
        let shared = square * (sum / squares).clamp(0.0, 1.0);
        Parts { bands: shared.sqrt() / mean, noise: (square - shared).sqrt() / mean }
    }
}

fn jitter(page: &mut Paper, map: &Map, whole: Known, thinned: Known, material: &Material) -> Result<()> {
    page.heading("Jitter (Fig. 7)")?;
    let source = Source::new(&map.light);
    let (l50, strata) = (strata_lights(map, 50)?, source.strata(50)?);
    let uniform = source.jitter(&strata, raw::WIS_JITTER_UNIFORM)?;
    let energy = source.jitter(&strata, raw::WIS_JITTER_ENERGY)?;
    let rows = [
        ("50 lights", How::Lights(&l50)),
        ("50, uniform jitter", How::Jittered(&l50, &uniform)),
        ("50, jitter by energy", How::Jittered(&l50, &energy)),
    ];
    table(page, thinned.0, material, thinned.1, &rows)?;
    let pictures = rows.iter().map(|(_, how)| Ok(picture(whole.0, material, how, 0)?.values));
    let values = pictures.collect::<Result<Vec<_>>>()?;
    let parts: Vec<Parts> = values.iter().map(|values| Parts::of(whole.0, whole.1, values)).collect();
    writeln!(page.text)?;
    columns(&mut page.text, 1, "method | shared by neighbours: bands | the rest: noise")?;
    for ((name, _), Parts { bands, noise }) in rows.iter().zip(&parts) {
        writeln!(page.text, "| {name} | {bands:.4} | {noise:.4} |")?;
    }
    let is_traded = |i: usize| parts[i].bands <= FADED * parts[0].bands && parts[i].noise > parts[0].noise;
    let part = |i: usize| format!("bands {:.4} and noise {:.4}", parts[i].bands, parts[i].noise);
    // Uniform places are biased where the light varies inside a stratum, and neighbours share that bias.
    page.claim("jitter trades bands for", is_traded(2), &[&part(0), &part(1), &part(2)]);
    Ok(())
}

/// The share of the bands that may be left where they are traded.
const FADED: f64 = 0.5;

#[cfg(test)]
mod tests {
    use super::*;

    /// Stripes of 64 columns are bands; what changes from pixel to pixel is noise.
    #[test]
    fn bands_are_told_from_noise() {
        let scene = Scene::procedural(View::Image(FINE)).unwrap();
        let truth = vec![1.0; scene.points.len()];
        let with = |error: &dyn Fn([u32; 2]) -> f64| {
            let values: Vec<f64> = scene.points.iter().map(|point| 1.0 + error(point.pixel)).collect();
            Parts::of(&scene, &truth, &values)
        };
        let striped = with(&|[x, _]| if x / 64 % 2 == 0 { 0.1 } else { -0.1 });
        assert!(striped.bands > 0.095 && striped.noise < 0.03, "{} {}", striped.bands, striped.noise);
        let hash =
            |[x, y]: [u32; 2]| (x.wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0xc2b2_ae35);
        let noisy = with(&|pixel| if hash(pixel) >> 31 == 0 { 0.1 } else { -0.1 });
        assert!(noisy.noise > 0.09 && noisy.bands < 0.04, "{} {}", noisy.bands, noisy.noise);
    }
}
