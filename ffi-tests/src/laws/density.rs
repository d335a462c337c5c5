//! Samples against pdfs through the C ABI of the release library: frequencies (chi-square), inversion
//! (Kolmogorov-Smirnov), and the integral of the pdf. Holm-corrected to a significance of 0.001 for all tests together.
//!
//! Frequencies: 400 000 samples in up to 256 bins find a pdf whose bins are off by 2 % (root mean square) with power
//! .99. Inversion: 40 000 directions find a shift of the distribution of u by .014, half of which a density that is
//! tilted by 2 % over the square makes at its middle. Integral: to 0.2 %.

use crate::client::Density;
use crate::environment;
use crate::light::{Light, octahedral_direction};
use crate::material::Material;
use crate::points;
use crate::product::Rotations;
use crate::scene::ShadingPoint;
use crate::statistics::{chi_square, holm, kolmogorov_smirnov, splitmix};
use glam::Vec3;
use std::f32::consts::PI;

const SIGNIFICANCE: f64 = 1e-3;
/// Bins along an axis of the octahedral square.
const BINS: usize = 16;

fn point() -> ShadingPoint {
    let normal = Vec3::new(0.3, 0.2, 0.93).normalize();
    ShadingPoint { pixel: [5, 9], hit: 0, origin: Vec3::ZERO, normal, wo: Vec3::new(-0.5, 0.3, 0.8).normalize() }
}

/// Independent numbers (SplitMix64), which the tests' distributions assume.
fn independent(mut state: u64, count: usize) -> Vec<[f32; 2]> {
    let mut next = || (splitmix(&mut state) >> 40) as f32 / (1 << 24) as f32;
    (0..count).map(|_| [next(), next()]).collect()
}

/// Bins of a partition that the library does not know: the octahedron seen flat, not of equal areas.
fn bin(wi: Vec3) -> usize {
    let norm = wi.x.abs() + wi.y.abs() + wi.z.abs();
    let fold = |a: f32, b: f32| (1.0 - b.abs()).copysign(a);
    let [x, y] = [wi.x / norm, wi.y / norm];
    let [x, y] = if wi.z < 0.0 { [fold(x, y), fold(y, x)] } else { [x, y] };
    let cell = |c: f32| (((c * 0.5 + 0.5) * BINS as f32) as usize).min(BINS - 1);
    cell(y) * BINS + cell(x)
}

/// p-values of frequencies and inversion along both axes, and the integral of the pdf.
fn judge(density: &impl Density) -> ([f64; 3], f64) {
    let mut mass = vec![0.0; BINS * BINS];
    let grid = points::of(11, 1 << 21);
    for u in &grid {
        let wi = octahedral_direction(u[0], u[1]);
        mass[bin(wi)] += f64::from(density.pdf(wi.to_array()).unwrap()) * 4.0 * f64::from(PI) / grid.len() as f64;
    }
    let mut counts = vec![0; BINS * BINS];
    for u in independent(1, 400_000) {
        counts[bin(Vec3::from_array(density.sample(u).unwrap().wi))] += 1;
    }
    ([chi_square(&counts, &mass), inversion(density, 0), inversion(density, 1)], mass.iter().sum::<f64>())
}

/// Directions that are accepted by their pdf, not sampled, must invert to even numbers.
fn inversion(density: &impl Density, axis: usize) -> f64 {
    let trials = independent(2, 1 << 22);
    let largest = 1.2
        * points::of(3, 1 << 16)
            .iter()
            .fold(0.0_f32, |largest, u| largest.max(density.pdf(octahedral_direction(u[0], u[1]).to_array()).unwrap()));
    let accepted = trials.chunks_exact(2).filter_map(|pair| {
        let wi = octahedral_direction(pair[0][0], pair[0][1]).to_array();
        (pair[1][0] * largest < density.pdf(wi).unwrap()).then_some(wi)
    });
    let u: Vec<f64> = accepted.take(40_000).map(|wi| f64::from(density.invert(wi).unwrap()[axis])).collect();
    assert!(u.len() == 40_000, "only {} directions were accepted", u.len());
    kolmogorov_smirnov(u)
}

#[test]
fn samples_follow_their_pdfs() {
    let light = Light::windows(64);
    let rotations = Rotations::new(light.tables(0, 0.0).unwrap()).unwrap();
    let (mut names, mut p_values) = (Vec::new(), Vec::new());
    let mut add = |name: &str, (found, integral): ([f64; 3], f64)| {
        assert!((integral - 1.0).abs() < 2e-3, "{name}: the pdf integrates to {integral}");
        for (test, p) in ["frequencies", "inversion of u[0]", "inversion of u[1]"].into_iter().zip(found) {
            names.push(format!("{name}, {test}"));
            p_values.push(p);
        }
    };
    add("light", judge(&environment::Light::new(&rotations.environment).unwrap()));
    for material in [Material::lambert(), Material::ggx(0.5), Material::mix(0.4)] {
        let product = material.prepare(&rotations, &point()).unwrap();
        add(&material.name, judge(&product));
    }
    for (name, rejected) in names.iter().zip(holm(&p_values, SIGNIFICANCE)) {
        assert!(!rejected, "{name}: {p_values:?}");
    }
}
