//! Files of measured BRDFs.

use crate::cornell::Scattered;
use crate::reflectance::Reflectance;
use crate::rgl::Measured;
use crate::tabulated::Tabulated;
use anyhow::{Result, bail};
use std::path::Path;

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
