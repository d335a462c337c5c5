//! Inversion leads back to the random numbers that a sample came from (rule 14 of the design).

use super::corners::CELLS;
use super::maps;
use crate::support::Random;
use crate::support::scenes::{ShadingPoint, grid};
use wis::ffi::wavelets::environment::WIS_WAVELET_LIGHT_EXACT_ZERO;
use wis::sphere::direction_f64;

/// The density of one coordinate of u at a point of the square, between two points about the middle of the finest
/// cell that the library has.
fn conditional_density(s: [f32; 2], axis: usize, invert: impl Fn([f32; 2]) -> Option<[f32; 2]>) -> f64 {
    let first = (s[axis] * CELLS as f32).floor();
    let at = |offset: f32| {
        let mut point = s;
        point[axis] = (first + offset) / CELLS as f32;
        f64::from(invert(point).expect("the density is positive")[axis])
    };
    (at(0.75) - at(0.25)).abs() * 2.0 * f64::from(CELLS)
}

/// Inversion leads back within 2^-20 of the conditional density and 16 roundings. (Rule 14 of the design allows
/// these 16 divided by the probability of the texel.)
fn check_inversion(
    u: [f32; 2],
    wi: [f32; 3],
    point: &ShadingPoint,
    invert: impl Fn([f32; 3]) -> Option<[f32; 2]> + Copy,
) {
    let back = invert(wi).expect("the density of a sample is positive");
    let invert_square = |s: [f32; 2]| invert(point.world(direction_f64(s.map(f64::from))));
    for axis in 0..2 {
        let density = conditional_density(point.square(wi), axis, invert_square);
        let (error, allowed) = (f64::from((back[axis] - u[axis]).abs()), density / 1_048_576.0 + 16.0 / 16_777_216.0);
        assert!(error <= allowed, "{u:?} {back:?} along axis {axis}, density {density}");
    }
}

#[test]
fn inversion_leads_back() {
    for map in maps() {
        let environment = map.build(64, WIS_WAVELET_LIGHT_EXACT_ZERO);
        let mut random = Random(67);
        for point in grid(&map) {
            let (product, matrix) = (point.prepare(&environment), Some(&point.world_from_map));
            for _ in 0..1000 {
                let u = [random.f32(), random.f32()];
                check_inversion(u, product.sample(u).wi, &point, |wi| product.invert(wi));
                let wi = environment.sample(matrix, u).wi;
                check_inversion(u, wi, &point, |wi| environment.invert(matrix, wi));
            }
        }
    }
}
