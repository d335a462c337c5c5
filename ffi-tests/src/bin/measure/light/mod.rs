//! The light of wis_environment beside a table as pbrt builds it. With --quick it measures little, writes the page, and fails if a goal
//! is missed by far.

mod fit;
mod page;
mod size;

use self::page::{Fits, Results};
use crate::speed::{self, Speed};
use anyhow::{Result, ensure};
use std::path::Path;
use wis_ffi_tests::client::Density;
use wis_ffi_tests::data;
use wis_ffi_tests::environment;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::piecewise::Piecewise;

/// Measures and writes the page.
///
/// # Errors
/// Those of the library and of files; with --quick, goals that are missed by far.
pub fn run(file: &Path, quick: bool) -> Result<()> {
    let (lights, points) = if quick { (quick_lights(), 1 << 17) } else { (lights()?, 1 << 20) };
    let fits = fits(&lights, points)?;
    let timed = if quick { Light::room(512) } else { data::light("venice_sunset_1k.hdr")? };
    let rounds = if quick { 24 } else { 100 };
    let speeds = [timed.clone().bilinear(), timed.clone()].map(|light| speeds(&light, rounds));
    let [bilinear, nearest] = speeds;
    let widths: Vec<usize> = (6..=if quick { 10 } else { 14 }).map(|k| 1 << k).collect();
    let sizes = size::sizes(&widths)?;
    let room = if quick { Light::room(256) } else { Light::room(1024) };
    let smooth = [Light::sky(1024), room].map(Light::bilinear);
    let steps: &[f32] = if quick { &[0.01] } else { &[0.0, 0.003, 0.01, 0.03, 0.1] };
    let budgets = size::budgets(&smooth, steps, points / 4)?;
    let speeds = [bilinear?, nearest?];
    let timed = timed.name;
    let results = Results { quick, fits, speeds, timed, sizes, budgets };
    page::page(&results)?.write(file)?;
    if quick { check(&results) } else { Ok(()) }
}

/// What even few samples on a busy machine must show.
fn check(results: &Results) -> Result<()> {
    for fits in &results.fits {
        let (deviation, maximum) = (fits.each[0].deviation(), fits.each[0].maximum);
        let total = fits.each[0].total;
        // Few directions meet a sun of a texel.
        let is_even = !fits.light.starts_with("sun");
        ensure!(!is_even || (total - 1.0).abs() < 0.01, "{}: the pdf integrates to {total}", fits.light);
        ensure!(deviation < 0.03 && maximum < 1.2, "{}: deviation {deviation}, largest {maximum}", fits.light);
    }
    let [own, table] = [0, 1].map(|i| results.speeds[0][i].cold[0]);
    ensure!(own < 3.0 * table, "a cold sample in 64 takes {own} ns, of pbrt's table {table} ns");
    for size in results.sizes.iter().filter(|size| size.width == 1024) {
        ensure!(size.bytes <= 4_500_000, "a 1k map takes {} bytes", size.bytes);
    }
    for budget in results.budgets.iter().filter(|budget| budget.light == "sky") {
        ensure!(budget.bytes <= 40_960, "a smooth sky takes {} bytes", budget.bytes);
    }
    Ok(())
}

/// Every map that is there, and those of the project's own.
fn lights() -> Result<Vec<Light>> {
    let files = data::files("envmaps");
    let mut lights = files.iter().map(|file| Light::load(file)).collect::<Result<Vec<_>>>()?;
    lights.extend([Light::room(1024), Light::field(1024)]);
    lights.extend(suns(512));
    Ok(lights)
}

fn quick_lights() -> Vec<Light> {
    let mut lights = suns(256);
    lights.push(Light::room(256));
    lights
}

/// Unclipped suns of one and of four texels at the horizon, at the zenith and on the seam.
fn suns(width: usize) -> Vec<Light> {
    let places = [("horizon", [width / 3, width / 4]), ("zenith", [width / 5, 0]), ("seam", [width - 1, width / 6])];
    let sun = |(name, at), side| Light::unclipped(&format!("sun of {} at the {name}", side * side), width, side, at);
    places.into_iter().flat_map(|place| [1, 2].map(|side| sun(place, side))).collect()
}

/// Fits for clients who interpolate and for those who do not.
fn fits(lights: &[Light], points: usize) -> Result<Vec<Fits>> {
    let mut fits = Vec::new();
    for light in lights {
        for light in [light.clone().bilinear(), light.clone()] {
            let bilinear = light.is_bilinear();
            eprintln!("{}, {}", light.name, if bilinear { "bilinear" } else { "nearest" });
            let each = with_densities(&light, |densities| fit::fit(&light, densities, points))?;
            fits.push(Fits { light: light.name.clone(), bilinear, each });
        }
    }
    Ok(fits)
}

fn speeds(light: &Light, rounds: usize) -> Result<Vec<Speed>> {
    with_densities(light, |densities| speed::speed(densities, rounds))
}

/// Hands out the light by wis and pbrt's table.
fn with_densities<T>(light: &Light, run: impl FnOnce(&[&dyn Density]) -> Result<T>) -> Result<T> {
    let (tables, piecewise) = (light.tables(0, 0.0)?, Piecewise::new(light));
    let own = environment::Light::new(&tables)?;
    run(&[&own, &piecewise])
}
