//! What the renderer knows of a measured BRDF, whatever file it came from: luminance, in a frame whose normal is +z.

use crate::cornell::Scattered;
use crate::rgl::Measured;
use crate::tabulated::Tabulated;
use anyhow::{Result, bail};
use glam::DVec3;
use std::fmt::Debug;
use std::path::Path;

/// A measured BRDF that can be sampled.
pub trait Reflectance: Debug + Sync {
    fn name(&self) -> &str;
    /// About the roughness alpha of a GGX lobe of this width.
    fn roughness(&self) -> f64;
    /// BRDF x cosine of `wi`; 0 unless both directions are above the surface.
    fn eval(&self, wo: DVec3, wi: DVec3) -> f64;
    /// A direction about in proportion to [`Reflectance::eval`]; below the surface where there is none.
    fn sample(&self, wo: DVec3, u: [f64; 2]) -> DVec3;
    /// The pdf of [`Reflectance::sample`].
    fn pdf(&self, wo: DVec3, wi: DVec3) -> f64;
    /// [`Reflectance::eval`] and [`Reflectance::pdf`].
    fn eval_pdf(&self, wo: DVec3, wi: DVec3) -> (f64, f64) {
        (self.eval(wo, wi), self.pdf(wo, wi))
    }
}

impl Reflectance for Measured {
    fn name(&self) -> &str {
        &self.name
    }

    fn roughness(&self) -> f64 {
        Measured::roughness(self)
    }

    fn eval(&self, wo: DVec3, wi: DVec3) -> f64 {
        Measured::eval(self, wo, wi)
    }

    fn sample(&self, wo: DVec3, u: [f64; 2]) -> DVec3 {
        Measured::sample(self, wo, u).0
    }

    fn pdf(&self, wo: DVec3, wi: DVec3) -> f64 {
        Measured::pdf(self, wo, wi)
    }

    fn eval_pdf(&self, wo: DVec3, wi: DVec3) -> (f64, f64) {
        Measured::eval_pdf(self, wo, wi)
    }
}

/// Reads a measured BRDF, which is kept until the program ends: `.bsdf` of the RGL database, `.brdf` of Cornell.
///
/// # Errors
/// The file cannot be read, or is of another kind.
pub fn load(path: &Path) -> Result<&'static dyn Reflectance> {
    Ok(match path.extension().and_then(|extension| extension.to_str()) {
        Some("bsdf") => Box::leak(Box::new(Measured::load(path)?)),
        Some("brdf") => Box::leak(Box::new(Tabulated::new(&Scattered::load(path)?))),
        _ => bail!("{}: neither .bsdf nor .brdf", path.display()),
    })
}

/// Whether a name is that of a file that [`load`] reads.
pub fn is_file(name: &str) -> bool {
    name.ends_with(".bsdf") || name.ends_with(".brdf")
}
