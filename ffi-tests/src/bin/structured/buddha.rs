//! A glossy buddha in Grace cathedral (Figs. 1 and 6).

use crate::phong::Phong;
use crate::{EQUAL, MEGAPIXELS, Map, Measured, compare, every, is_ground, strata_lights, table};
use anyhow::Result;
use std::fmt::Write;
use wis_ffi_tests::data;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::paper::Paper;
use wis_ffi_tests::scene::{Scene, View};
use wis_ffi_tests::structured::{How, Raster, truth};

static PHONG: Phong = Phong { exponent: 50 };
/// Few random lights of the rest, when lights are sorted.
const FEW: usize = 2;
/// Columns and rows of pixels from one measured point to the next.
const STEP: u32 = 2;
/// Rays a point that the paper needs with sorting.
const RAYS: f64 = 4.7;

/// The buddha without its ground, which is not in the paper's picture but hides what is below.
fn alone() -> Result<Scene> {
    let mut scene = data::scene("buddha.obj", View::Image(1))?;
    scene.points.retain(|point| !is_ground(point));
    Ok(scene)
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
    let rows = [
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
        ("structured 300, sorted to 0.01", How::Sorted(&l300, 0.01, FEW)),
        ("structured 300, sorted to 0.05", How::Sorted(&l300, 0.05, FEW)),
        ("structured 300, sorted to 0.1", How::Sorted(&l300, 0.1, FEW)),
        ("structured 300, sorted to 0.2", How::Sorted(&l300, 0.2, FEW)),
        ("structured 300, sorted to 0.4", How::Sorted(&l300, 0.4, FEW)),
        ("structured 300, sorted to 0.6", How::Sorted(&l300, 0.6, FEW)),
    ];
    let m = table(page, &thin, &material, &thinned, &rows)?;
    let shown = [
        ("importance, 300", How::Importance(&raster, 300)),
        ("BRDF, 300", How::Brdf(&map.light, 300)),
        ("MIS, 300", How::Mis(&raster, 300)),
        ("structured, 100", How::Lights(&l100)),
        ("structured, 300", How::Lights(&l300)),
        ("sorted to 0.2", How::Sorted(&l300, 0.2, FEW)),
    ];
    compare(page, "buddha.png", (&scene, &material), &whole, map, &shown)?;
    claims(page, &m);
    Ok(())
}

fn claims(page: &mut Paper, m: &[Measured]) {
    let error = |i: usize| m[i].error;
    let at = |i: usize| m[i].us * MEGAPIXELS;
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
        "a light of a stratum is wider than what it stands for in this lobe: the error is bias, and falls with the strata (1000 in the table)",
    );
    page.claims.add(
        "sampling the BRDF is worse than sampling the map",
        "\"even more noisy\" with 1000 samples",
        format!("BRDF {:.3}, map {:.3}", error(7), error(4)),
        error(7) > error(4),
        "the lamps of this map are wide enough for samples of the lobe to meet them, while most samples of the map lie outside the lobe",
    );
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
        error(10) >= error(15),
        "the paper concludes it from both parts being worse; here the BRDF alone is better than structured sampling, and MIS lies between its parts",
    );
    let paired = (17..=22).find(|&i| m[i].rays <= RAYS).unwrap_or(22);
    page.claims.add(
        "sorting needs 4.7 rays a point in place of 300 at the same quality",
        "4.7 of 300",
        format!(
            "{:.1} rays: error {:.3} in place of {:.3} with {:.0} rays; {:.1} rays: {:.3}",
            m[paired].rays,
            error(paired),
            error(15),
            m[15].rays,
            m[18].rays,
            error(18)
        ),
        m[paired].rays <= RAYS && error(paired) <= EQUAL * error(15),
        "so few rays leave most of what could arrive to two random lights: the table has every threshold",
    );
    page.claims.add(
        "sorting makes the buddha several times as fast",
        "55 s, sorted 12 s; importance sampling 83 s",
        format!(
            "{:.1} s, sorted to 0.2 {:.1} s, to 0.4 {:.1} s; importance sampling {:.1} s",
            at(15),
            at(20),
            at(21),
            at(3)
        ),
        at(20) * 2.0 <= at(15),
        "a ray costs about as much here as evaluating and ordering a light",
    );
}

const TEXT: &str = "The paper's material: grey Phong of exponent 50, (n + 2) / (2 pi) cos^n. Its evaluation is scalar here, in double
precision. Errors are of the buddha alone. *MIS*: half of the samples of the map, stratified, half of the BRDF, balance heuristic.
Sorted: lights by what they may add, until the rest is below a share of the whole; two of the rest, drawn by what they may add,
tell how much of it is seen.
";
