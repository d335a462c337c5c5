//! Isotropic BRDFs of the RGL material database: the tensor files, evaluation, sampling and pdf.
//!
//! Dupuy and Jakob 2018, "An Adaptive Parameterization for Efficient Material Acquisition and Rendering". A grid of the
//! visible normals of each elevation turns the unit square into half vectors; what is left of the BRDF is smooth in that
//! square. Everything here is luminance.

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

/// Grids over the unit square, one for each of some parameters, bilinear inside and linear between the parameters.
struct Grid {
    /// Columns (first coordinate) and rows.
    size: [usize; 2],
    parameters: Vec<f64>,
    /// Slice by slice, row by row.
    values: Vec<f64>,
    /// For each row: the integral up to each column, in units of columns; for each slice: that of rows.
    along: Vec<f64>,
    rows: Vec<f64>,
}

impl Grid {
    /// Normalised grids are densities: their integral over the square is 1.
    fn new(size: [usize; 2], parameters: Vec<f64>, mut values: Vec<f64>, normalised: bool) -> Grid {
        let [columns, count] = size;
        let (mut along, mut rows) = (vec![0.0; values.len()], vec![0.0; values.len() / columns]);
        for slice in 0..parameters.len() {
            let first = slice * columns * count;
            for row in 0..count {
                let start = first + row * columns;
                for x in 1..columns {
                    along[start + x] = along[start + x - 1] + 0.5 * (values[start + x - 1] + values[start + x]);
                }
            }
            let end = |row: usize| along[first + (row + 1) * columns - 1];
            for row in 1..count {
                rows[slice * count + row] = rows[slice * count + row - 1] + 0.5 * (end(row - 1) + end(row));
            }
            let total = rows[(slice + 1) * count - 1];
            if normalised && total > 0.0 {
                // In units of columns and rows: a patch has the area 1.
                values[first..first + columns * count].iter_mut().for_each(|v| *v /= total);
                along[first..first + columns * count].iter_mut().for_each(|v| *v /= total);
                rows[slice * count..(slice + 1) * count].iter_mut().for_each(|v| *v /= total);
            }
        }
        Grid { size, parameters, values, along, rows }
    }

    /// Patches in the square.
    fn patches(&self) -> f64 {
        ((self.size[0] - 1) * (self.size[1] - 1)) as f64
    }

    /// The two slices about a parameter, and the weight of the second.
    fn slices(&self, parameter: f64) -> ([usize; 2], f64) {
        let last = self.parameters.len() - 1;
        let above = self.parameters.partition_point(|&p| p <= parameter).clamp(1, last.max(1)).min(last);
        let below = above.saturating_sub(1);
        let [low, high] = [self.parameters[below], self.parameters[above]];
        let weight = if high > low { ((parameter - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 };
        ([below, above], weight)
    }

    fn blend(&self, table: &[f64], slices: ([usize; 2], f64), stride: usize, offset: usize) -> f64 {
        let ([a, b], weight) = slices;
        (1.0 - weight) * table[a * stride + offset] + weight * table[b * stride + offset]
    }

    /// The corners (x0 y0), (x1 y0), (x0 y1), (x1 y1) of the patch that contains a point, and where it lies in it.
    fn patch(&self, slices: ([usize; 2], f64), at: [f64; 2]) -> ([f64; 4], [usize; 2], [f64; 2]) {
        let scaled = [0, 1].map(|k| at[k].clamp(0.0, 1.0) * (self.size[k] - 1) as f64);
        let cell = [0, 1].map(|k| (scaled[k] as usize).min(self.size[k] - 2));
        let stride = self.size[0] * self.size[1];
        let corner = |dx: usize, dy: usize| {
            self.blend(&self.values, slices, stride, (cell[1] + dy) * self.size[0] + cell[0] + dx)
        };
        let corners = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
        (corners, cell, [0, 1].map(|k| scaled[k] - cell[k] as f64))
    }

    /// The value at a point; of a normalised grid the density.
    fn eval(&self, parameter: f64, at: [f64; 2]) -> f64 {
        let ([v00, v10, v01, v11], _, [x, y]) = self.patch(self.slices(parameter), at);
        (1.0 - y) * ((1.0 - x) * v00 + x * v10) + y * ((1.0 - x) * v01 + x * v11)
    }

    /// The density at a point.
    fn density(&self, parameter: f64, at: [f64; 2]) -> f64 {
        self.eval(parameter, at) * self.patches()
    }

    /// The point that the density puts at `u`, and the density there: rows first.
    fn sample(&self, parameter: f64, u: [f64; 2]) -> ([f64; 2], f64) {
        let slices = self.slices(parameter);
        let [columns, count] = self.size;
        let row_sum = |row: usize| self.blend(&self.rows, slices, count, row);
        let total = row_sum(count - 1);
        let target = u[1] * total;
        let row = last_below(count - 1, |row| row_sum(row) <= target);
        let sum = |row: usize, x: usize| self.blend(&self.along, slices, columns * count, row * columns + x);
        let ends = [sum(row, columns - 1), sum(row + 1, columns - 1)];
        let y = inverse_linear(ends, target - row_sum(row));
        let between = |x: usize| (1.0 - y) * sum(row, x) + y * sum(row + 1, x);
        let target = u[0] * between(columns - 1);
        let column = last_below(columns - 1, |x| between(x) <= target);
        let value = |x: usize| {
            let at = |row: usize| self.blend(&self.values, slices, columns * count, row * columns + x);
            (1.0 - y) * at(row) + y * at(row + 1)
        };
        let (left, right) = (value(column), value(column + 1));
        let x = inverse_linear([left, right], target - between(column));
        let density = ((1.0 - x) * left + x * right) * self.patches();
        ([(column as f64 + x) / (columns - 1) as f64, (row as f64 + y) / (count - 1) as f64], density)
    }

    /// The `u` of [`Grid::sample`] for a point, and the density there.
    fn invert(&self, parameter: f64, at: [f64; 2]) -> ([f64; 2], f64) {
        let slices = self.slices(parameter);
        let [columns, count] = self.size;
        let ([v00, v10, v01, v11], [column, row], [x, y]) = self.patch(slices, at);
        let (left, right) = ((1.0 - y) * v00 + y * v01, (1.0 - y) * v10 + y * v11);
        let density = ((1.0 - x) * left + x * right) * self.patches();
        let sum = |row: usize, x: usize| self.blend(&self.along, slices, columns * count, row * columns + x);
        let between = |x: usize| (1.0 - y) * sum(row, x) + y * sum(row + 1, x);
        let along = between(column) + x * (left + 0.5 * x * (right - left));
        let ends = [sum(row, columns - 1), sum(row + 1, columns - 1)];
        let row_sum = |row: usize| self.blend(&self.rows, slices, count, row);
        let down = row_sum(row) + y * (ends[0] + 0.5 * y * (ends[1] - ends[0]));
        let ratio = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 0.0 };
        ([ratio(along, between(columns - 1)), ratio(down, row_sum(count - 1))], density)
    }
}

/// The last index below `count` for which a monotone condition holds; 0 if none does.
fn last_below(count: usize, holds: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high) = (0, count);
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if holds(middle) { low = middle } else { high = middle }
    }
    low
}

/// Where the integral of the linear function from `a` to `b` over [0, x] reaches a target.
fn inverse_linear([a, b]: [f64; 2], target: f64) -> f64 {
    let root = (a * a + 2.0 * target * (b - a)).max(0.0).sqrt();
    let x = if a + root > 0.0 { 2.0 * target / (a + root) } else { 0.0 };
    x.clamp(0.0, 1.0)
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
            value.extend((0..cells).map(|i| 0.2126 * channel(0, i) + 0.7152 * channel(1, i) + 0.0722 * channel(2, i)));
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

    /// A grid that is made here: sample and invert are inverse to each other, and the density integrates to 1.
    #[test]
    fn grids_are_densities() {
        let values: Vec<f64> = (0..2 * 5 * 4).map(|i| 0.1 + f64::from(i * i % 13)).collect();
        let grid = Grid::new([5, 4], vec![0.0, 1.0], values, true);
        for parameter in [0.0, 0.3, 1.0, 2.0] {
            let mut sum = 0.0;
            for i in 0..400 * 400 {
                let at = [(f64::from(i % 400) + 0.5) / 400.0, (f64::from(i / 400) + 0.5) / 400.0];
                sum += grid.density(parameter, at) / 160_000.0;
            }
            assert!((sum - 1.0).abs() < 1e-3, "{sum}");
            for i in 0..100 {
                let u = [(f64::from(i) + 0.5) / 100.0, (f64::from(i * 37 % 100) + 0.5) / 100.0];
                let (at, density) = grid.sample(parameter, u);
                let (back, same) = grid.invert(parameter, at);
                assert!((back[0] - u[0]).abs() + (back[1] - u[1]).abs() < 1e-9, "{u:?} {back:?}");
                assert!(
                    (density / same - 1.0).abs() < 1e-9 && (density / grid.density(parameter, at) - 1.0).abs() < 1e-9
                );
            }
        }
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
