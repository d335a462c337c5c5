//! Version 0.2 and the current one side by side.

use anyhow::{Context, Result};
use wis_ffi_tests::client;
use wis_ffi_tests::earlier;
use wis_ffi_tests::environment;
use wis_ffi_tests::hardcases::brdf::Lobe;
use wis_ffi_tests::light::Light;

/// A light as both build it.
pub struct Lit {
    pub light: Light,
    pub is_judged: bool,
    pub new: environment::Environment,
    pub old: earlier::Environment,
}

impl Lit {
    /// # Errors
    /// Those of the library; version 0.2 is not there.
    pub fn new(light: Light, is_judged: bool) -> Result<Lit> {
        let light = light.bilinear();
        let new = light.tables(0, 0.0)?;
        let old =
            light.mapped(0, 0.0, earlier::Environment::new)?.context("version 0.2, which scripts/earlier.sh builds")?;
        Ok(Lit { light, is_judged, new, old })
    }
}

/// Both samplers for a material.
pub struct Both {
    pub new: environment::Sampler,
    pub old: earlier::Sampler,
    pub material: client::raw::wis_material,
}

impl Both {
    /// For so many rays of so many candidates; 0: the library's choice.
    ///
    /// # Errors
    /// Those of the library.
    pub fn new(lobes: &[Lobe], rays: usize, candidates: usize) -> Result<Both> {
        let shapes: Vec<_> = lobes.iter().map(Lobe::shape).collect();
        let old = earlier::Sampler::new(rays, candidates, 1, &shapes)?.context("version 0.2")?;
        let (new, material) = (environment::Sampler::new(rays, candidates, 1)?, environment::material(&shapes)?);
        Ok(Both { new, old, material })
    }
}

/// A ratio with its bootstrap interval of 95 %.
pub fn printed([ratio, low, high]: [f64; 3]) -> String {
    format!("{ratio:.2} [{low:.2}, {high:.2}]")
}
