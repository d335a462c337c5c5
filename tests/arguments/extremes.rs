//! Lobes and light at the ends of their documented ranges: estimates and pdfs stay finite, and what is lit can be
//! sampled.

use crate::support::{Environment, Map, Product, Random, normalise, product_config, query};
use std::ptr::null;
use wis::ffi::wavelets::environment::WIS_WAVELET_LIGHT_RGB;
use wis::ffi::wavelets::product::{ProductConfig, wis_wavelet_product_estimate_rgb, wis_wavelet_query_eval};
use wis::status::Status;
use wis::wavelets::query::*;

const WEIGHTS: [f32; 10] = [0.0, 1e-45, 1e-40, 1e-38, 1e-30, 1.0, 1e10, 1e30, 1e38, f32::MAX];
const ALPHAS: [f32; 8] = [1e-5, 1e-4, 1e-3, 0.01, 0.1, 0.5, 1.0, 16.0];
const EXPONENTS: [f32; 7] = [0.0, 0.5, 1.0, 10.0, 100.0, 1e4, 1e7];
const REFLECTANCES: [f32; 4] = [0.0, 1e-30, 0.04, 1.0];

fn pick<T: Copy>(random: &mut Random, values: &[T]) -> T {
    values[random.bits() as usize % values.len()]
}

fn lobe(random: &mut Random) -> Lobe {
    let weight = [0; 3].map(|_| pick(random, &WEIGHTS));
    match random.bits() % 3 {
        0 => Lobe { kind: WIS_WAVELET_LOBE_LAMBERT, weight, ..Lobe::default() },
        1 => Lobe { kind: WIS_WAVELET_LOBE_PHONG, weight, a: pick(random, &EXPONENTS), ..Lobe::default() },
        _ => {
            let f0 = [0; 3].map(|_| pick(random, &REFLECTANCES));
            Lobe { kind: WIS_WAVELET_LOBE_GGX, weight, f0, a: pick(random, &ALPHAS), b: pick(random, &ALPHAS) }
        }
    }
}

/// Up to four lobes, in any direction.
fn any_query(random: &mut Random) -> Query {
    let lobes: Vec<Lobe> = (0..1 + random.bits() % 4).map(|_| lobe(random)).collect();
    let normal = normalise(random.direction());
    let wo = if random.bits() % 4 == 0 { normal } else { normalise(random.direction()) };
    let tangent = normalise(random.direction());
    let flags = pick(random, &[0, WIS_WAVELET_QUERY_WHOLE_SPHERE, WIS_WAVELET_QUERY_COSINE_INCLUDED, 3]);
    Query { tangent, flags, ..query(normal, wo, &lobes) }
}

fn environments() -> Vec<Environment> {
    let maps = [
        Map::latlong(8, 4, |_, _| 1.0),
        Map::latlong(8, 4, |x, y| if (x, y) == (3, 1) { 1e30 } else { 1e-30 }),
        Map::latlong(8, 4, |x, _| if x == 3 { f32::MAX } else { 0.0 }),
        Map::latlong(8, 4, |x, y| 1e-45 * ((x + y) % 3) as f32),
    ];
    let built = maps.iter().flat_map(|map| [map.build(16, WIS_WAVELET_LIGHT_RGB), map.build(1, 0)]);
    built.collect()
}

#[test]
fn queries_at_the_ends_of_their_ranges() {
    let environments = environments();
    for seed in 0..5000 {
        let mut random = Random(seed);
        let query = any_query(&mut random);
        let environment = &environments[random.bits() as usize % environments.len()];
        let config = ProductConfig { max_squares: pick(&mut random, &[0, 1, 5, 40]), ..product_config() };
        let product = environment.prepare(&query, &config);
        assert!((0.0..=f64::MAX).contains(&product.estimate()), "seed {seed}: {}", product.estimate());
        for _ in 0..4 {
            check_sample(&product, pick(&mut random, &[0.0, 0.3, 0.9, 1.0]), seed);
            check_direction(&product, &query, normalise(random.direction()), seed);
        }
        check_rgb(&product, seed);
    }
}

fn check_sample(product: &Product, u: f32, seed: u64) {
    let sample = product.sample([u, 1.0 - u]);
    assert!((0.0..=f32::MAX).contains(&sample.pdf), "seed {seed}: {sample:?}");
    assert_eq!(sample.pdf > 0.0, product.estimate() > 0.0, "seed {seed}: {sample:?}");
    if sample.pdf > 0.0 {
        assert_eq!(product.pdf(sample.wi).to_bits(), sample.pdf.to_bits(), "seed {seed}");
        let u = product.invert(sample.wi).unwrap();
        assert!(u.iter().all(|u| (0.0..1.0).contains(u)), "seed {seed}: {u:?}");
    }
}

/// The maps have no texel of density 0. Values that are not normal numbers may vanish in a sum of lobes.
fn check_direction(product: &Product, query: &Query, wi: [f32; 3], seed: u64) {
    let mut f_cos = [f32::NAN; 3];
    // SAFETY: all pointers are valid.
    let status = unsafe { wis_wavelet_query_eval(query, null(), 1, wi.as_ptr(), 0, f_cos.as_mut_ptr(), 0) };
    assert_eq!(status, Status::Ok);
    assert!(f_cos.iter().all(|f| (0.0..=f32::MAX).contains(f)), "seed {seed}: {f_cos:?}");
    assert!(f_cos[1] < f32::MIN_POSITIVE || product.pdf(wi) > 0.0, "seed {seed}: {wi:?}");
}

fn check_rgb(product: &Product, seed: u64) {
    let mut rgb = [-1.0; 3];
    // SAFETY: all pointers are valid.
    let status =
        unsafe { wis_wavelet_product_estimate_rgb(product.environment.handle, product.handle, null(), &mut rgb) };
    let is_built = product.environment.info.flags & WIS_WAVELET_LIGHT_RGB != 0;
    assert_eq!(status == Status::Ok, is_built);
    assert!(!is_built || rgb.iter().all(|channel| (0.0..=f64::MAX).contains(channel)), "seed {seed}: {rgb:?}");
}
