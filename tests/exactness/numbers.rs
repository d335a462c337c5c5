//! Random numbers at both ends, out of range, and at the splits; and what there is to say when there is no sample.

use super::{bits, check, maps};
use crate::support::maps::sky;
use crate::support::scenes::grid;
use crate::support::{Map, Random, ggx, lambert, product_config, query};
use wis::ffi::wavelets::environment::WIS_WAVELET_LIGHT_EXACT_ZERO;

/// A point of the square and its nearest neighbours of 24 bits.
pub fn neighbours(u: [f32; 2]) -> impl Iterator<Item = [f32; 2]> {
    let around = |u: f32| [-2.0, -1.0, 0.0, 1.0, 2.0].map(|step: f32| u + step / 16_777_216.0);
    around(u[0]).into_iter().flat_map(move |x| around(u[1]).map(|y| [x, y]))
}

/// u at both ends, out of range and not a number.
const SPECIAL: [f32; 12] = [
    0.0,
    f32::from_bits(1),
    f32::MIN_POSITIVE,
    0.5,
    1.0 - f32::EPSILON / 2.0,
    1.0,
    f32::NAN,
    -0.0,
    -1.0,
    2.0,
    f32::INFINITY,
    f32::NEG_INFINITY,
];

fn specials() -> impl Iterator<Item = [f32; 2]> {
    SPECIAL.into_iter().flat_map(|x| SPECIAL.map(|y| [x, y]))
}

/// The u about each split of one axis that separates two random points, for the other coordinate fixed.
fn splits(random: &mut Random, axis: usize, place: impl Fn([f32; 2]) -> [f32; 2]) -> Vec<[f32; 2]> {
    let mut u = [random.f32(), random.f32()];
    let mut at = |value: f32| {
        u[axis] = value;
        (place(u)[axis], u)
    };
    let mut found = Vec::new();
    for level in 1..=12 {
        let cell = |s: f32| (s * (1u32 << level) as f32) as u32;
        let (mut low, mut high) = (0u32, 1 << 24);
        let value = |k: u32| k as f32 / 16_777_216.0;
        let border = cell(at(random.f32()).0);
        while high - low > 1 {
            let middle = (low + high) / 2;
            if cell(at(value(middle)).0) < border { low = middle } else { high = middle }
        }
        found.extend([low, high].map(|k| at(value(k)).1));
    }
    found
}

/// Where black stays black, the u at every split and at both ends lead to light.
#[test]
fn special_numbers_give_samples() {
    let mut random = Random(61);
    for map in maps() {
        let environment = map.build(128, WIS_WAVELET_LIGHT_EXACT_ZERO);
        for point in grid(&map) {
            let product = point.prepare(&environment);
            assert!(product.estimate() > 0.0);
            let place = |u| point.square(product.sample(u).wi);
            let split = (0..20).flat_map(|k| splits(&mut random, k % 2, place)).flat_map(neighbours);
            for u in specials().chain(split) {
                let sample = product.sample(u);
                check(sample, product.pdf(sample.wi));
                let sample = environment.sample(Some(&point.world_from_map), u);
                check(sample, environment.pdf(Some(&point.world_from_map), sample.wi));
            }
        }
    }
}

/// Numbers out of range count as the nearest in range, NaN as 1/2.
#[test]
fn numbers_out_of_range_are_moved_there() {
    let moved = |u: f32| if u.is_nan() { 0.5 } else { u.clamp(0.0, 1.0 - f32::EPSILON / 2.0) };
    let environment = sky(64, 32).build(64, 0);
    let product = environment.prepare(&query([0.0, 0.0, 1.0], [0.0, 0.6, 0.8], &[lambert(1.0)]), &product_config());
    for u in specials() {
        assert_eq!(bits(product.sample(u)), bits(product.sample(u.map(moved))), "{u:?}");
        let light = |u| bits(environment.sample(None, u));
        assert_eq!(light(u), light(u.map(moved)), "{u:?}");
    }
}

/// Light that no lobe reflects, and a query without lobes, give no samples but pdf 0 everywhere.
#[test]
fn nothing_to_sample_is_pdf_0() {
    let light = sky(64, 32).build(16, 0);
    let black = Map::latlong(8, 4, |_, _| 0.0).build(16, 0);
    let lambert = query([0.0, 0.0, 1.0], [0.0, 0.6, 0.8], &[lambert(1.0)]);
    let no_lobe = query([0.0, 0.0, 1.0], [0.0, 0.6, 0.8], &[]);
    let from_below = query([0.0, 0.0, 1.0], [0.0, 0.6, -0.8], &[ggx(0.5)]);
    for (environment, query) in [(&black, &lambert), (&light, &no_lobe), (&light, &from_below)] {
        let product = environment.prepare(query, &product_config());
        assert_eq!(product.estimate(), 0.0);
        for u in specials() {
            assert_eq!(product.sample(u).pdf, 0.0);
        }
        assert_eq!(product.pdf([0.0, 0.0, 1.0]), 0.0);
        assert_eq!(product.invert([0.0, 0.0, 1.0]), None);
    }
    assert_eq!(black.sample(None, [0.3, 0.7]).pdf, 0.0);
    assert_eq!(black.invert(None, [0.0, 0.0, 1.0]), None);
}
