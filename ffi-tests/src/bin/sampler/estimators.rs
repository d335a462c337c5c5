//! Estimators that use the integral that a product states, beside the unbiased one. A quarter of the sphere is blocked at each point.

use crate::own::Own;
use glam::Vec3;
use wide::CmpLt;
use wis_ffi_tests::client::{Result, sobol};
use wis_ffi_tests::lanes::{F8, LANES, V8};
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::{Bsdf, Material};
use wis_ffi_tests::scene::ShadingPoint;

pub const NAMES: [&str; 3] = ["unbiased", "ratio", "biased"];
/// Samples of an estimate.
pub const COUNTS: [usize; 3] = [4, 16, 64];
const MOST: usize = COUNTS[COUNTS.len() - 1];
/// Estimates of each point with each number.
const PASSES: usize = 4;
/// Points of a light and a material: each has references of its own over all texels.
pub const POINTS: usize = 120;
/// Directions about an axis whose cosine is larger are blocked.
const BLOCKED: f32 = 0.5;

/// Roots of mean squared errors over the mean of all points.
#[derive(Clone, Copy, Debug, Default)]
pub struct Figures {
    /// Of the integral, where nothing is blocked.
    pub integral: f64,
    /// By number of samples and estimator.
    pub errors: [[f64; NAMES.len()]; COUNTS.len()],
}

/// The figures of materials under a light.
pub fn figures(light: &Light, materials: &[Material], points: &[ShadingPoint]) -> Result<Vec<Figures>> {
    let texels = texels(light);
    materials.iter().map(|material| of_material(light, material, points, &texels)).collect()
}

fn of_material(light: &Light, material: &Material, points: &[ShadingPoint], texels: &[(V8, F8)]) -> Result<Figures> {
    let mut own = Own::new(light, material)?;
    let mut sums = Figures::default();
    let mut means = [0.0; 2];
    for (number, point) in (0..).zip(points) {
        let (bsdf, axis) = (Bsdf::new(material, point), axis(number)?);
        let truth = reflected(&bsdf, axis, texels);
        own.prepare(material, point)?;
        let stated = own.integral()?;
        sums.integral += (stated - truth[0]).powi(2);
        (0..2).for_each(|i| means[i] += truth[i]);
        for pass in 0..PASSES as u32 {
            let mut u = [[0.0; 2]; MOST];
            sobol(number * PASSES as u32 + pass, 0, &mut u)?;
            let samples: Vec<[f64; 2]> = own
                .sample(&u)?
                .iter()
                .map(|drawn| {
                    let wi = Vec3::from_array(drawn.wi);
                    let value = f64::from(bsdf.eval_one(wi).0) * f64::from(light.radiance(wi)) / f64::from(drawn.pdf);
                    [if drawn.pdf > 0.0 { value } else { 0.0 }, if wi.dot(axis) > BLOCKED { 0.0 } else { 1.0 }]
                })
                .collect();
            for (count, errors) in COUNTS.iter().zip(&mut sums.errors) {
                let estimates = estimates(stated, &samples[..*count]);
                errors.iter_mut().zip(estimates).for_each(|(sum, estimate)| *sum += (estimate - truth[1]).powi(2));
            }
        }
    }
    let count = points.len() as f64;
    let over = |sum: f64, of: f64, mean: f64| (sum / of).sqrt() / (mean / count);
    let errors = sums.errors.map(|errors| errors.map(|sum| over(sum, count * PASSES as f64, means[1])));
    Ok(Figures { integral: over(sums.integral, count, means[0]), errors })
}

/// The estimates by samples, each of which is f L / p and the visibility.
fn estimates(integral: f64, samples: &[[f64; 2]]) -> [f64; NAMES.len()] {
    let count = samples.len() as f64;
    let sum = |of: fn(&[f64; 2]) -> f64| samples.iter().map(of).sum::<f64>();
    let (visible, all) = (sum(|[value, seen]| value * seen), sum(|[value, _]| *value));
    [visible / count, if all > 0.0 { integral * visible / all } else { 0.0 }, integral * sum(|[_, seen]| *seen) / count]
}

/// What blocks the light at a point.
fn axis(number: u32) -> Result<Vec3> {
    let mut u = [[0.0; 2]];
    sobol(91, number, &mut u)?;
    let (z, phi) = (1.0 - 2.0 * u[0][0], std::f32::consts::TAU * u[0][1]);
    let r = (1.0 - z * z).max(0.0).sqrt();
    Ok(Vec3::new(r * phi.cos(), r * phi.sin(), z))
}

/// Directions and the light from about them, eight side by side.
fn texels(light: &Light) -> Vec<(V8, F8)> {
    let all: Vec<(Vec3, f32)> =
        light.quadrature(1).map(|(wi, area)| (wi, (area * f64::from(light.radiance(wi))) as f32)).collect();
    let at = |eight: &[(Vec3, f32)], k: usize| eight.get(k).copied().unwrap_or((Vec3::Z, 0.0));
    let lanes = |eight: &[(Vec3, f32)]| {
        let directions = V8::each(std::array::from_fn(|k| at(eight, k).0));
        (directions, F8::new(std::array::from_fn(|k| at(eight, k).1)))
    };
    all.chunks(LANES).map(lanes).collect()
}

/// The reflected light of a point: all, and what is not blocked.
fn reflected(bsdf: &Bsdf, axis: Vec3, texels: &[(V8, F8)]) -> [f64; 2] {
    let (axis, blocked) = (V8::splat(axis), F8::splat(BLOCKED));
    let mut sums = [0.0; 2];
    for row in texels.chunks(64) {
        let mut of_row = [F8::ZERO; 2];
        for (wi, light) in row {
            let value = bsdf.eval(*wi, LANES).0 * *light;
            let seen = blocked.cmp_lt(wi.dot(axis)).blend(F8::ZERO, value);
            of_row = [of_row[0] + value, of_row[1] + seen];
        }
        let sum = |lanes: F8| lanes.as_array_ref().iter().map(|&lane| f64::from(lane)).sum::<f64>();
        (0..2).for_each(|i| sums[i] += sum(of_row[i]));
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_estimator_is_its_formula() {
        let samples = [[4.0, 1.0], [2.0, 0.0], [6.0, 1.0], [0.0, 1.0]];
        assert_eq!(estimates(10.0, &samples), [2.5, 10.0 * 10.0 / 12.0, 7.5]);
        assert_eq!(estimates(10.0, &[[0.0, 1.0]]), [0.0, 0.0, 10.0]);
    }

    /// Under a white sky Lambert reflects 0.7 of it and the integral is exact. What is blocked varies from point to point.
    #[test]
    fn the_integral_of_a_white_sky_is_exact() {
        let light = Light::latlong("white", 64, 32, vec![1.0; 64 * 32]).bilinear();
        let points = wis_ffi_tests::products::points(20).unwrap();
        let [lambert] = figures(&light, &[Material::lambert()], &points).unwrap()[..] else { panic!() };
        assert!(lambert.integral < 0.02, "{lambert:?}");
        let [_, _, many] = lambert.errors;
        assert!(many.iter().all(|error| *error > 0.0 && *error < 0.1), "{lambert:?}");
    }
}
