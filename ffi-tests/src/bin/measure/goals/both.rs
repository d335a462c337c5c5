//! Version 0.2 and the current one side by side.

use anyhow::{Context, Result};
use wis_ffi_tests::client;
use wis_ffi_tests::earlier;
use wis_ffi_tests::environment::{CURRENT, Environment, Sampler, Version, material_by};
use wis_ffi_tests::hardcases::brdf::Lobe;
use wis_ffi_tests::light::Light;

/// Version 0.2, then the current one.
fn versions() -> Result<[&'static Version; 2]> {
    Ok([
        earlier::version().context("version 0.2 is not there: scripts/earlier.sh builds it from the history")?,
        &CURRENT,
    ])
}

/// A light as both build it.
pub struct Lit {
    pub light: Light,
    pub is_judged: bool,
    pub each: [Environment; 2],
}

impl Lit {
    /// # Errors
    /// Those of the library; version 0.2 is not there.
    pub fn new(light: Light, is_judged: bool) -> Result<Lit> {
        let light = light.bilinear();
        let [old, new] = versions()?.map(|version| light.mapped(0, 0.0, |map| Environment::by(version, map)));
        Ok(Lit { each: [old?, new?], light, is_judged })
    }
}

/// A sampler of each for a material, which each has made.
pub type Both = [(Sampler, client::raw::wis_material); 2];

/// For so many rays of so many candidates; 0: the library's choice.
///
/// # Errors
/// Those of the library.
pub fn both(lobes: &[Lobe], rays: usize, candidates: usize) -> Result<Both> {
    let shapes: Vec<_> = lobes.iter().map(Lobe::shape).collect();
    let of = |version| anyhow::Ok((Sampler::by(version, rays, candidates, 1)?, material_by(version, &shapes)?));
    let [old, new] = versions()?.map(of);
    Ok([old?, new?])
}

/// A ratio with its bootstrap interval of 95 %.
pub fn printed([ratio, low, high]: [f64; 3]) -> String {
    format!("{ratio:.2} [{low:.2}, {high:.2}]")
}
