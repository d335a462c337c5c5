//! Isotropic BRDFs of the RGL material database: the tensor files, evaluation, sampling and pdf.
//!
//! Dupuy and Jakob 2018, "An Adaptive Parameterization for Efficient Material Acquisition and Rendering". A grid of the
//! visible normals of each elevation turns the unit square into half vectors; what is left of the BRDF is smooth in that
//! square. Everything here is luminance, or another sum of the channels.

use crate::grid::{Grid, Slices};
use crate::lanes::{F8, V8, sin_cos_turn};
use crate::reflectance::{Reflectance, View};
use crate::warp::Warp;
use anyhow::{Context, Result, bail, ensure};
use glam::DVec3;
use std::collections::HashMap;
use std::f32::consts::{FRAC_PI_2, PI, TAU};
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

/// A weighted sum of red, green and blue, whose slices of so many nodes follow each other.
fn weighed(rgb: &[f32], nodes: usize, weights: [f64; 3]) -> impl Iterator<Item = f32> {
    rgb.chunks_exact(3 * nodes).flat_map(move |slice| {
        let channel = move |c: usize, i: usize| weights[c] * f64::from(slice[c * nodes + i]);
        (0..nodes).map(move |i| (0..3).map(|c| channel(c, i)).sum::<f64>() as f32)
    })
}

/// A measured BRDF; directions are in the frame of the surface, z along the normal.
pub struct Measured {
    pub name: String,
    /// Elevations of the slices.
    theta: Vec<f32>,
    /// The distribution of normals, and the area of microfacets that a direction sees.
    normals: Grid,
    vndf: Warp,
    luminance: Warp,
    /// The density of `luminance`, and the luminance of what is left of the BRDF.
    reflected: Grid,
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
        let theta = field("theta_i")?.values.clone();
        if field("phi_i")?.shape != [1] {
            bail!("{}: not isotropic", path.display());
        }
        let grid = |name: &str, slices: usize| -> Result<([usize; 2], Vec<f64>)> {
            let tensor = field(name)?;
            let &[.., rows, columns] = tensor.shape.as_slice() else { bail!("{name}: no grid") };
            ensure!(tensor.values.len() == slices * rows * columns, "{name}: another shape");
            Ok(([columns, rows], tensor.values.iter().map(|&v| f64::from(v)).collect()))
        };
        let ((size, ndf), (same, sigma)) = (grid("ndf", 1)?, grid("sigma", 1)?);
        ensure!(size == same, "sigma: another shape than ndf");
        let normals = ndf.iter().zip(sigma).map(|(&ndf, sigma)| [ndf as f32, sigma as f32]);
        let ((visible_size, visible), (luminance_size, luminance)) =
            (grid("vndf", theta.len())?, grid("luminance", theta.len())?);
        let [columns, rows] = luminance_size;
        let rgb = field("rgb")?;
        ensure!(rgb.shape.ends_with(&[theta.len(), 3, rows, columns]), "rgb: another shape than luminance");
        let value = weighed(&rgb.values, rows * columns, weights);
        let luminance = Warp::new(luminance_size, &luminance);
        let reflected = luminance.densities().zip(value).map(|(density, value)| [density, value]).collect();
        Ok(Measured {
            name: path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned()),
            theta,
            normals: Grid::new(size, normals.collect()),
            vndf: Warp::new(visible_size, &visible),
            reflected: Grid::new(luminance_size, reflected),
            luminance,
            jacobian: tensors.contains_key("jacobian"),
        })
    }

    /// Directions about in proportion to the value, and their pdfs; a pdf is 0 where there is none.
    #[inline]
    fn draw(&self, view: &View, u: [F8; 2], used: usize) -> (V8, F8) {
        let (sample, chosen) = self.luminance.sample(view.slices, u, used);
        let (at, visible) = self.vndf.sample(view.slices, sample, used);
        let (sine, cosine) = (at[0] * at[0] * F8::splat(FRAC_PI_2)).sin_cos();
        // The place of azimuth 0 is in the middle.
        let (sin, cos) = sin_cos_turn(at[1]);
        let m = V8::new(-sine * cos, -sine * sin, cosine);
        let (wo, towards) = (view.faced(), m.dot(view.faced()));
        let wi = m.scale(towards * F8::splat(2.0)).minus(wo);
        (view.back(wi), view.above(wi.z) & (chosen * visible / Place { at, sine, towards }.stretch()))
    }
}

impl Reflectance for Measured {
    fn name(&self) -> &str {
        &self.name
    }

    /// From where the distribution of normals has fallen to half.
    fn roughness(&self) -> f64 {
        let at = |theta: f32| {
            let place = [theta_to_unit(theta), 0.5].map(F8::splat);
            self.normals.eval(Slices::default(), place, 1)[0].as_array_ref()[0]
        };
        let half = (1..900).map(|i| i as f32 * FRAC_PI_2 / 900.0).find(|&theta| at(theta) < 0.5 * at(0.0));
        f64::from(half.unwrap_or(FRAC_PI_2)) / 0.64
    }

    fn view(&self, wo: DVec3) -> View {
        let mut view = View::new(wo);
        let theta = view.elevation;
        let turn = (view.azimuth + PI) / TAU;
        let place = [F8::splat(theta_to_unit(theta)), F8::splat(turn)];
        let sigma = self.normals.eval(Slices::default(), place, 1)[1].as_array_ref()[0];
        view.slices = Slices::about(&self.theta, theta);
        view.scale = if self.jacobian { 0.25 / sigma } else { 1.0 };
        view
    }

    fn eval_lanes(&self, view: &View, wi: V8, used: usize) -> (F8, F8) {
        let (above, place) = (view.above(wi.z), half(view, wi));
        let (sample, visible) = self.vndf.invert(view.slices, place.at, used);
        let [density, value] = self.reflected.eval(view.slices, sample, used);
        let pdf = density * visible / place.stretch();
        let value = value.fast_max(F8::ZERO) * F8::splat(view.scale);
        let value = if self.jacobian { value * self.normals.eval(Slices::default(), place.at, used)[0] } else { value };
        (above & value, above & pdf)
    }

    fn sample_lanes(&self, view: &View, u: [F8; 2], used: usize) -> V8 {
        self.draw(view, u, used).0
    }
}

/// A half vector.
struct Place {
    /// As a point of the unit square: elevation and azimuth.
    at: [F8; 2],
    /// Its sine to the normal, and its cosine to the viewer.
    sine: F8,
    towards: F8,
}

/// The half vector of directions and that to the viewer.
#[inline]
fn half(view: &View, wi: V8) -> Place {
    let h = view.facing(wi).plus(view.faced());
    let (across, length) = ((h.x * h.x + h.y * h.y).sqrt(), h.length());
    // Of unit vectors the half vector has this length twice as its cosine. An arc tangent is precise near the normal.
    let theta = across.atan2(h.z);
    let turn = h.y.atan2(h.x) * F8::splat(TAU.recip());
    Place {
        at: [(theta * F8::splat(FRAC_PI_2.recip())).sqrt(), turn + F8::splat(0.5)],
        sine: across / length,
        towards: length * F8::splat(0.5),
    }
}

impl Place {
    /// Solid angle of the incident direction per area of the unit square.
    #[inline]
    fn stretch(&self) -> F8 {
        let of_half = F8::splat(2.0 * PI * PI) * self.at[0] * self.sine;
        of_half.fast_max(F8::splat(SMALLEST_STRETCH)) * F8::splat(4.0) * self.towards
    }
}

/// Keeps pdfs finite where the half vector is the normal.
const SMALLEST_STRETCH: f32 = 1e-6;

fn theta_to_unit(theta: f32) -> f32 {
    (theta / FRAC_PI_2).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::LANES;
    use glam::dvec3;
    use wide::CmpGt;

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

    fn direction(theta: f64) -> DVec3 {
        dvec3(theta.sin() * 0.8, theta.sin() * 0.6, theta.cos())
    }

    /// Points of the unit square, eight by eight.
    fn points(count: usize) -> Vec<[F8; 2]> {
        let u = crate::points::of(3, count);
        let lanes = |eight: &[[f32; 2]]| [0, 1].map(|k| F8::new(std::array::from_fn(|i| eight[i][k])));
        u.chunks_exact(LANES).map(lanes).collect()
    }

    fn sum(lanes: F8) -> f64 {
        lanes.to_array().into_iter().map(f64::from).sum()
    }

    /// Uniform on the hemisphere.
    fn uniform(u: [F8; 2]) -> V8 {
        let ((sin, cos), radius) = (sin_cos_turn(u[1]), (F8::ONE - u[0] * u[0]).sqrt());
        V8::new(radius * cos, radius * sin, u[0])
    }

    /// Real materials reflect no more than they receive, sample what they evaluate, and have pdfs that integrate to what
    /// lies above the surface.
    #[test]
    fn measured_materials_are_sampled_as_they_reflect() {
        const COUNT: usize = 1 << 16;
        for material in materials() {
            for theta in [0.0, 0.05, 0.6, 1.2f64] {
                let view = material.view(direction(theta));
                let (mut albedo, mut flat, mut above, mut density) = (0.0, 0.0, 0.0, 0.0);
                for u in points(COUNT) {
                    let (wi, drawn) = material.draw(&view, u, LANES);
                    let (value, pdf) = material.eval_lanes(&view, wi, LANES);
                    let is_drawn = drawn.cmp_gt(F8::ZERO);
                    albedo += sum(is_drawn & (value / pdf));
                    above += sum(is_drawn & F8::ONE);
                    let (value, pdf) = material.eval_lanes(&view, uniform(u), LANES);
                    flat += sum(value * F8::splat(TAU));
                    density += sum(pdf * F8::splat(TAU));
                }
                let [albedo, flat, above, density] = [albedo, flat, above, density].map(|sum| sum / COUNT as f64);
                println!("{} {theta}: {albedo:.4} {flat:.4}, pdf {density:.3} of {above:.3}", material.name);
                assert!((0.01..1.05).contains(&albedo), "{}: {albedo}", material.name);
                assert!((albedo / flat - 1.0).abs() < 0.03, "{}: {albedo} {flat}", material.name);
                assert!((density - above).abs() < 0.03, "{}: {density} {above}", material.name);
            }
        }
    }

    /// Errors of a ratio that should be 1.
    struct Errors(Vec<f64>);

    impl Errors {
        /// What so large a share does not exceed.
        fn quantile(&mut self, share: f64) -> f64 {
            self.0.sort_by(f64::total_cmp);
            self.0[((self.0.len() - 1) as f64 * share) as usize]
        }

        fn assert(&mut self, what: &str, [most, all]: [f64; 2]) {
            let found = [self.quantile(MOST), self.quantile(1.0)];
            println!("{what}: {:.1e} {:.1e}", found[0], found[1]);
            assert!(found[0] < most && found[1] < all, "{what}: {found:?}");
        }
    }

    /// The share of directions for which the stricter bound holds: pdfs are steep near the normal of narrow lobes, and
    /// grazing half vectors are small differences.
    const MOST: f64 = 0.95;

    #[test]
    fn samples_have_the_pdf_that_is_evaluated() {
        for material in materials() {
            for (theta, bounds) in [(0.0, [1e-5, 1e-3]), (0.6, [1e-5, 1e-3]), (1.2, [5e-5, 5e-3]), (1.5, [2e-4, 2e-2])]
            {
                let (view, mut errors) = (material.view(direction(theta)), Errors(Vec::new()));
                for u in points(1 << 16) {
                    let (wi, drawn) = material.draw(&view, u, LANES);
                    let (_, pdf) = material.eval_lanes(&view, wi, LANES);
                    let pairs = pdf.to_array().into_iter().zip(drawn.to_array()).filter(|pair| pair.1 > 0.0);
                    errors.0.extend(pairs.map(|(pdf, drawn)| f64::from((pdf / drawn - 1.0).abs())));
                }
                errors.assert(&format!("{} {theta}", material.name), bounds);
            }
        }
    }

    /// A grid of one view, and its integrals as sums over all patches, in double precision.
    struct Naive {
        size: [usize; 2],
        nodes: Vec<f64>,
    }

    impl Naive {
        /// One of both functions of a grid, linear between the slices about a parameter.
        fn new(grid: &Grid, which: usize, parameters: &[f32], parameter: f64) -> Naive {
            let size = grid.patches().map(|patches| patches as usize + 1);
            let slices: Vec<_> = grid.nodes().all().chunks_exact(size[0] * size[1]).collect();
            let parameters: Vec<f64> = parameters.iter().copied().map(f64::from).collect();
            let below = (1..slices.len().max(2) - 1).take_while(|&k| parameters[k] <= parameter).last().unwrap_or(0);
            let above = (below + 1).min(slices.len() - 1);
            let span = (parameters[above] - parameters[below]).max(f64::MIN_POSITIVE);
            let weight = ((parameter - parameters[below]) / span).clamp(0.0, 1.0);
            let both = slices[below].iter().zip(slices[above]);
            let blend =
                |(a, b): (&[f32; 2], &[f32; 2])| (1.0 - weight) * f64::from(a[which]) + weight * f64::from(b[which]);
            Naive { size, nodes: both.map(blend).collect() }
        }

        fn eval(&self, at: [f64; 2]) -> f64 {
            let scaled = [0, 1].map(|k| at[k].clamp(0.0, 1.0) * (self.size[k] - 1) as f64);
            let cell = [0, 1].map(|k| (scaled[k] as usize).min(self.size[k] - 2));
            let [x, y] = [0, 1].map(|k| scaled[k] - cell[k] as f64);
            let node = |dx: usize, dy: usize| self.nodes[(cell[1] + dy) * self.size[0] + cell[0] + dx];
            (1.0 - y) * ((1.0 - x) * node(0, 0) + x * node(1, 0)) + y * ((1.0 - x) * node(0, 1) + x * node(1, 1))
        }

        /// The shares of what is before a point: of its row, and of all rows; and the density there.
        fn invert(&self, at: [f64; 2]) -> ([f64; 2], f64) {
            let along = |end: f64, y: f64| integral(self.size[0] - 1, end, |x| self.eval([x, y]));
            let down = |end: f64| integral(self.size[1] - 1, end, |y| along(1.0, y));
            let all = down(1.0);
            ([along(at[0], at[1]) / along(1.0, at[1]), down(at[1]) / all], self.eval(at) / all)
        }
    }

    /// From 0 to an end, of a function that is linear within each of equal parts of [0, 1].
    fn integral(parts: usize, end: f64, function: impl Fn(f64) -> f64) -> f64 {
        let bounds = |k: usize| [k, k + 1].map(|k| (k as f64 / parts as f64).min(end));
        (0..parts).map(bounds).map(|[a, b]| 0.5 * (function(a) + function(b)) * (b - a)).sum()
    }

    /// Value and pdf in double precision.
    struct Exact {
        wo: DVec3,
        vndf: Naive,
        luminance: Naive,
        value: Naive,
        ndf: Naive,
        sigma: f64,
    }

    impl Exact {
        fn new(material: &Measured, wo: DVec3) -> Exact {
            let (place, theta) = (place(wo, 0.0), wo.z.acos());
            let at = |grid: &Grid, which: usize| Naive::new(grid, which, &material.theta, theta);
            Exact {
                wo,
                vndf: at(material.vndf.nodes(), 0),
                luminance: at(material.luminance.nodes(), 0),
                value: at(&material.reflected, 1),
                ndf: at(&material.normals, 0),
                sigma: at(&material.normals, 1).eval(place),
            }
        }

        fn eval(&self, wi: DVec3) -> [f64; 2] {
            use std::f64::consts::PI;
            let m = (self.wo + wi).normalize();
            let at = place(m, self.wo.y.atan2(self.wo.x));
            let (sample, visible) = self.vndf.invert(at);
            let stretch = 2.0 * PI * PI * at[0] * m.x.hypot(m.y) * 4.0 * m.dot(self.wo);
            let value = self.value.eval(sample) * self.ndf.eval(at) / (4.0 * self.sigma);
            [value, self.luminance.invert(sample).1 * visible / stretch]
        }
    }

    /// A direction as a point of the unit square.
    fn place(d: DVec3, azimuth: f64) -> [f64; 2] {
        use std::f64::consts::{FRAC_PI_2, PI, TAU};
        let turn = (d.y.atan2(d.x) - azimuth + PI) / TAU;
        [(d.x.hypot(d.y).atan2(d.z) / FRAC_PI_2).sqrt(), turn - turn.floor()]
    }

    #[test]
    fn lanes_are_nearly_as_accurate_as_double_precision() {
        for material in materials() {
            for (theta, bounds) in [(0.0, [1e-5, 1e-4]), (0.6, [1e-5, 1e-4]), (1.2, [5e-5, 1e-4]), (1.5, [2e-4, 5e-3])]
            {
                let (view, exact) = (material.view(direction(theta)), Exact::new(&material, direction(theta)));
                let mut errors = [Errors(Vec::new()), Errors(Vec::new())];
                for wi in points(64).into_iter().flat_map(|u| [material.sample_lanes(&view, u, LANES), uniform(u)]) {
                    let (value, pdf) = material.eval_lanes(&view, wi, LANES);
                    for i in (0..LANES).filter(|&i| wi.get(i).z > 0.0) {
                        let expected = exact.eval(wi.get(i).as_dvec3());
                        for ((errors, found), expected) in errors.iter_mut().zip([value, pdf]).zip(expected) {
                            let found = f64::from(found.as_array_ref()[i]);
                            errors.0.push(if expected > 0.0 { (found / expected - 1.0).abs() } else { found });
                        }
                    }
                }
                for (errors, what) in errors.iter_mut().zip(["value", "pdf"]) {
                    errors.assert(&format!("{what} of {} {theta}", material.name), bounds);
                }
            }
        }
    }
}
