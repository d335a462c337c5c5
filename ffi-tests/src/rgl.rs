//! Isotropic BRDFs of the RGL material database: the tensor files, evaluation, sampling and pdf.
//!
//! Dupuy and Jakob 2018, "An Adaptive Parameterization for Efficient Material Acquisition and Rendering". A grid of the
//! visible normals of each elevation turns the unit square into half vectors; what is left of the BRDF is smooth in that
//! square. Everything here is luminance, or another sum of the channels.

use crate::grid::Grid;
use anyhow::{Context, Result, bail, ensure};
use glam::{DVec3, dvec3};
use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::path::Path;

/// A field of a tensor file: its shape and its numbers, if they are 32-bit floats.
struct Tensor {
    shape: Vec<usize>,
    values: Vec<f32>,
}

/// Reads the fields of a tensor file.
///
/// # Errors
/// The file cannot be read, or is no tensor file.
fn read(path: &Path) -> Result<HashMap<String, Tensor>> {
    const FLOAT32: u8 = 10;
    let bytes = std::fs::read(path).with_context(|| format!("{}", path.display()))?;
    let mut at = 0;
    let mut take = |count: usize| {
        let part = bytes.get(at..at + count).context("the file ends early")?;
        at += count;
        Ok::<&[u8], anyhow::Error>(part)
    };
    ensure!(take(14)? == b"tensor_file\0\x01\x00", "not a tensor file of version 1.0");
    let number = |part: &[u8]| part.iter().rev().fold(0usize, |n, byte| n << 8 | usize::from(*byte));
    let fields = number(take(4)?);
    let mut tensors = HashMap::new();
    for _ in 0..fields {
        let length = number(take(2)?);
        let name = String::from_utf8(take(length)?.to_vec())?;
        let dimensions = number(take(2)?);
        let kind = take(1)?[0];
        let offset = number(take(8)?);
        let shape = (0..dimensions).map(|_| Ok(number(take(8)?))).collect::<Result<Vec<usize>>>()?;
        let mut values = Vec::new();
        if kind == FLOAT32 {
            let count: usize = shape.iter().product();
            let part = bytes.get(offset..offset + 4 * count).context("a field ends early")?;
            values.extend(part.chunks_exact(4).map(|four| f32::from_le_bytes([four[0], four[1], four[2], four[3]])));
        }
        tensors.insert(name, Tensor { shape, values });
    }
    Ok(tensors)
}

/// A measured BRDF; directions are in the frame of the surface, z along the normal.
pub struct Measured {
    pub name: String,
    ndf: Grid,
    sigma: Grid,
    vndf: Grid,
    luminance: Grid,
    /// The luminance of what is left of the BRDF.
    value: Grid,
    jacobian: bool,
}

impl std::fmt::Debug for Measured {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "Measured({})", self.name)
    }
}

impl Measured {
    /// Reads an isotropic RGB material.
    ///
    /// # Errors
    /// The file cannot be read, or is another kind of material.
    pub fn load(path: &Path) -> Result<Measured> {
        Measured::load_weighed(path, [0.2126, 0.7152, 0.0722])
    }

    /// The same with weights of red, green and blue in place of those of luminance.
    ///
    /// # Errors
    /// The file cannot be read, or is another kind of material.
    pub fn load_weighed(path: &Path, weights: [f64; 3]) -> Result<Measured> {
        let tensors = read(path)?;
        let field = |name: &str| tensors.get(name).with_context(|| format!("{}: no field {name}", path.display()));
        let theta: Vec<f64> = field("theta_i")?.values.iter().map(|&t| f64::from(t)).collect();
        if field("phi_i")?.shape != [1] {
            bail!("{}: not isotropic", path.display());
        }
        let grid = |name: &str, parameters: &[f64], normalised: bool| -> Result<Grid> {
            let tensor = field(name)?;
            let &[.., rows, columns] = tensor.shape.as_slice() else { bail!("{name}: no grid") };
            let values: Vec<f64> = tensor.values.iter().map(|&v| f64::from(v)).collect();
            ensure!(values.len() == parameters.len() * rows * columns, "{name}: another shape");
            Ok(Grid::new([columns, rows], parameters.to_vec(), values, normalised))
        };
        let rgb = field("rgb")?;
        let &[.., 3, rows, columns] = rgb.shape.as_slice() else { bail!("{}: no RGB", path.display()) };
        let cells = rows * columns;
        let mut value = Vec::with_capacity(theta.len() * cells);
        for slice in rgb.values.chunks_exact(3 * cells) {
            let channel = |c: usize, i: usize| f64::from(slice[c * cells + i]);
            value.extend((0..cells).map(|i| (0..3).map(|c| weights[c] * channel(c, i)).sum::<f64>()));
        }
        Ok(Measured {
            name: path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned()),
            ndf: grid("ndf", &[0.0], false)?,
            sigma: grid("sigma", &[0.0], false)?,
            vndf: grid("vndf", &theta, true)?,
            luminance: grid("luminance", &theta, true)?,
            value: Grid::new([columns, rows], theta.clone(), value, false),
            jacobian: tensors.contains_key("jacobian"),
        })
    }

    /// About the roughness alpha of a GGX lobe of this width: from where the distribution of normals has fallen to half.
    pub fn roughness(&self) -> f64 {
        let at = |theta: f64| self.ndf.eval(0.0, [theta_to_unit(theta), 0.5]);
        let peak = at(0.0);
        let half = (1..900).map(|i| f64::from(i) * FRAC_PI_2 / 900.0).find(|&theta| at(theta) < 0.5 * peak);
        half.unwrap_or(FRAC_PI_2) / 0.64
    }

    /// BRDF x cosine of `wo`; 0 unless both directions are above the surface.
    pub fn eval(&self, wi: DVec3, wo: DVec3) -> f64 {
        let Some((theta, at, _)) = half(wi, wo) else { return 0.0 };
        let (sample, _) = self.vndf.invert(theta, at);
        self.reflected(wi, theta, at, sample)
    }

    /// [`Measured::eval`] and [`Measured::pdf`], whose half vector and place in the square are the same.
    pub fn eval_pdf(&self, wi: DVec3, wo: DVec3) -> (f64, f64) {
        let Some((theta, at, m)) = half(wi, wo) else { return (0.0, 0.0) };
        let (sample, visible) = self.vndf.invert(theta, at);
        let pdf = self.luminance.density(theta, sample) * visible / stretch(at, elevation(m), m.dot(wi));
        (self.reflected(wi, theta, at, sample), pdf)
    }

    /// The value for a half vector at a place of the square, and at `sample` of that of visible normals.
    fn reflected(&self, wi: DVec3, theta: f64, at: [f64; 2], sample: [f64; 2]) -> f64 {
        let value = self.value.eval(theta, sample).max(0.0);
        if !self.jacobian {
            return value;
        }
        let sigma = self.sigma.eval(0.0, [theta_to_unit(theta), azimuth_to_unit(wi)]);
        value * self.ndf.eval(0.0, at) / (4.0 * sigma)
    }

    /// A direction about in proportion to [`Measured::eval`], and its pdf; the pdf is 0 if there is none.
    pub fn sample(&self, wi: DVec3, u: [f64; 2]) -> (DVec3, f64) {
        if wi.z <= 0.0 {
            return (DVec3::Z, 0.0);
        }
        let theta = elevation(wi);
        let (sample, chosen) = self.luminance.sample(theta, u);
        let (at, visible) = self.vndf.sample(theta, sample);
        let (theta_m, phi_m) = (at[0] * at[0] * FRAC_PI_2, (2.0 * at[1] - 1.0) * PI + wi.y.atan2(wi.x));
        let (sin, cos) = theta_m.sin_cos();
        let m = dvec3(sin * phi_m.cos(), sin * phi_m.sin(), cos);
        let wo = m * (2.0 * m.dot(wi)) - wi;
        if wo.z <= 0.0 {
            return (wo, 0.0);
        }
        (wo, chosen * visible / stretch(at, theta_m, m.dot(wi)))
    }

    /// The pdf of [`Measured::sample`].
    pub fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        let Some((theta, at, m)) = half(wi, wo) else { return 0.0 };
        let (sample, visible) = self.vndf.invert(theta, at);
        self.luminance.density(theta, sample) * visible / stretch(at, elevation(m), m.dot(wi))
    }
}

/// The elevation of `wi`, the half vector as a point of the unit square, and the half vector.
fn half(wi: DVec3, wo: DVec3) -> Option<(f64, [f64; 2], DVec3)> {
    if wi.z <= 0.0 || wo.z <= 0.0 {
        return None;
    }
    let m = (wi + wo).normalize();
    let turned = (m.y.atan2(m.x) - wi.y.atan2(wi.x) + PI) / TAU;
    Some((elevation(wi), [theta_to_unit(elevation(m)), turned - turned.floor()], m))
}

/// Solid angle of the outgoing direction per area of the unit square of half vectors.
fn stretch(at: [f64; 2], theta_m: f64, cosine: f64) -> f64 {
    (2.0 * PI * PI * at[0] * theta_m.sin()).max(1e-6) * 4.0 * cosine
}

/// The angle to the normal, precise near it.
fn elevation(d: DVec3) -> f64 {
    2.0 * (0.5 * (d.x * d.x + d.y * d.y + (d.z - 1.0).powi(2)).sqrt()).min(1.0).asin()
}

fn theta_to_unit(theta: f64) -> f64 {
    (theta / FRAC_PI_2).sqrt()
}

fn azimuth_to_unit(d: DVec3) -> f64 {
    (d.y.atan2(d.x) + PI) / TAU
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client;

    fn materials() -> Vec<Measured> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/brdfs");
        let Ok(files) = std::fs::read_dir(&folder) else {
            println!("left out: no measured BRDFs in {}", folder.display());
            return Vec::new();
        };
        let mut files: Vec<_> =
            files.flatten().map(|f| f.path()).filter(|f| f.extension().is_some_and(|e| e == "bsdf")).collect();
        files.sort();
        files.iter().map(|file| Measured::load(file).unwrap()).collect()
    }

    /// Real materials reflect no more than they receive, sample what they evaluate, and have pdfs that integrate to what
    /// lies above the surface.
    #[test]
    fn measured_materials_are_sampled_as_they_reflect() {
        for material in materials() {
            for theta in [0.05, 0.6, 1.2f64] {
                let wi = dvec3(theta.sin() * 0.8, theta.sin() * 0.6, theta.cos());
                let mut u = vec![[0.0; 2]; 1 << 16];
                client::sobol(3, 0, &mut u).unwrap();
                let (mut albedo, mut uniform, mut above, mut density) = (0.0, 0.0, 0.0, 0.0);
                for u in &u {
                    let u = u.map(f64::from);
                    let (wo, pdf) = material.sample(wi, u);
                    if pdf > 0.0 {
                        assert!(
                            (material.pdf(wi, wo) / pdf - 1.0).abs() < 1e-3,
                            "{}: {pdf} {}",
                            material.name,
                            material.pdf(wi, wo)
                        );
                        albedo += material.eval(wi, wo) / pdf;
                        above += 1.0;
                    }
                    let radius = (1.0 - u[0] * u[0]).sqrt();
                    let flat = dvec3(radius * (TAU * u[1]).cos(), radius * (TAU * u[1]).sin(), u[0]);
                    uniform += material.eval(wi, flat) * TAU;
                    density += material.pdf(wi, flat) * TAU;
                    assert_eq!(material.eval_pdf(wi, flat), (material.eval(wi, flat), material.pdf(wi, flat)));
                }
                let count = u.len() as f64;
                let [albedo, uniform, above, density] = [albedo, uniform, above, density].map(|sum| sum / count);
                println!("{} {theta}: {albedo:.4} {uniform:.4}, pdf {density:.3} of {above:.3}", material.name);
                assert!((0.01..1.05).contains(&albedo), "{}: {albedo}", material.name);
                assert!((albedo / uniform - 1.0).abs() < 0.03, "{}: {albedo} {uniform}", material.name);
                assert!((density - above).abs() < 0.03, "{}: {density} {above}", material.name);
            }
        }
    }
}
