//! The visibility prior: a factor that leaves the pdf exact and the estimate unbiased, and lowers the variance in shadow.

use crate::support::maps::{Filter, sky, sun};
use crate::support::scenes::{ShadingPoint, grid, lobes};
use crate::support::statistics::Mean;
use crate::support::vector::unit;
use crate::support::{Environment, Random, product_config, query};
use std::ptr::null;
use wis::ffi::prior::{wis_prior_add, wis_prior_count, wis_prior_halve, wis_prior_weights};
use wis::ffi::wavelets::product::ProductConfig;
use wis::prior::{Prior, WIS_PRIOR_CELLS};
use wis::status::Status;

const NONE: Prior =
    Prior { size: size_of::<Prior>() as u32, reserved: 0, visible: [0; WIS_PRIOR_CELLS], traced: [0; WIS_PRIOR_CELLS] };

fn count(prior: &mut Prior, matrix: Option<&[f32; 9]>, wi: &[[f32; 3]], visible: &[u8]) {
    let matrix = matrix.map_or(null(), |m| m as *const _);
    // SAFETY: the arrays are of one length.
    let status = unsafe { wis_prior_count(prior, matrix, wi.len(), wi.as_flattened().as_ptr(), 0, visible.as_ptr()) };
    assert_eq!(status, Status::Ok);
}

fn weights(prior: &Prior, wi: &[[f32; 3]]) -> Vec<f32> {
    let mut weight = vec![-1.0; wi.len()];
    // SAFETY: the arrays are of one length.
    let status =
        unsafe { wis_prior_weights(prior, null(), wi.len(), wi.as_flattened().as_ptr(), 0, weight.as_mut_ptr(), 0) };
    assert_eq!(status, Status::Ok);
    weight
}

/// A wall that hides what lies on one side of it, seen from about everywhere alike.
fn is_visible(wi: [f32; 3]) -> bool {
    0.8 * wi[0] + 0.6 * wi[2] > 0.1
}

/// What so many rays in random directions learn of the wall.
fn learned(rays: u32, matrix: Option<&[f32; 9]>) -> Prior {
    let mut random = Random(3);
    let wi: Vec<[f32; 3]> = (0..rays).map(|_| random.direction().map(|c| c as f32)).collect();
    let visible: Vec<u8> = wi.iter().map(|&wi| u8::from(is_visible(wi))).collect();
    let mut prior = NONE;
    count(&mut prior, matrix, &wi, &visible);
    prior
}

#[test]
fn counts_are_counts() {
    let wi = [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.6, 0.0, -0.8], [0.0, 0.0, 0.0]];
    let mut prior = NONE;
    count(&mut prior, None, &wi, &[1, 0, 0, 1]);
    assert_eq!((prior.traced.iter().sum::<u32>(), prior.visible.iter().sum::<u32>()), (3, 1));
    // v = (1 + 2/3) / (2 + 2) and (0 + 2/3) / (1 + 2); unseen cells have the mean, 1/3.
    let g = |v: f64| (0.5 * ((v * (1.0 - v)).sqrt() + v)).max(0.1);
    let expected = [g(5.0 / 12.0), g(2.0 / 9.0), g(1.0 / 3.0)];
    for (weight, expected) in weights(&prior, &[wi[0], wi[2], [1.0, 0.0, 0.0]]).into_iter().zip(expected) {
        assert!((f64::from(weight) - expected).abs() < 1e-6, "{weight} {expected}");
    }
    let mut twice = prior;
    // SAFETY: two different priors.
    unsafe {
        assert_eq!(wis_prior_add(&mut twice, &prior), Status::Ok);
        assert_eq!(twice.traced, prior.traced.map(|n| 2 * n));
        assert_eq!(wis_prior_halve(&mut twice), Status::Ok);
        assert_eq!(twice, prior);
        // Full counts stay, and never lose the order of visible and traced.
        let full = Prior { visible: [7; WIS_PRIOR_CELLS], traced: [u32::MAX; WIS_PRIOR_CELLS], ..NONE };
        let mut sum = full;
        assert_eq!(wis_prior_add(&mut sum, &prior), Status::Ok);
        assert!(sum.visible.iter().zip(&sum.traced).all(|(visible, traced)| visible <= traced));
        let mut unsound = Prior { visible: [1; WIS_PRIOR_CELLS], ..NONE };
        assert_eq!(wis_prior_halve(&mut unsound), Status::InvalidArgument);
    }
}

/// However many rays a cell has blocked, it keeps a tenth: other pixels see other things.
#[test]
fn what_was_never_seen_keeps_a_tenth() {
    let (dark, bright) = ([0.0, 0.0, 1.0], [0.0, 0.0, -1.0]);
    let mut prior = NONE;
    for (wi, visible) in [(dark, 0), (bright, 1)] {
        count(&mut prior, None, &[wi; 10_000], &[visible; 10_000]);
    }
    let [hidden, seen] = weights(&prior, &[dark, bright])[..] else { panic!("two weights") };
    assert!(hidden == 0.1 && (0.5..0.52).contains(&seen), "{hidden} {seen}");
}

/// Counting in parts and adding them up gives the same numbers in any order.
#[test]
fn parts_add_up() {
    let whole = learned(1000, None);
    let mut random = Random(3);
    let wi: Vec<[f32; 3]> = (0..1000).map(|_| random.direction().map(|c| c as f32)).collect();
    let visible: Vec<u8> = wi.iter().map(|&wi| u8::from(is_visible(wi))).collect();
    let mut sum = NONE;
    for part in (0..1000).step_by(77).rev() {
        let end = (part + 77).min(1000);
        let mut own = NONE;
        count(&mut own, None, &wi[part..end], &visible[part..end]);
        // SAFETY: two different priors.
        assert_eq!(unsafe { wis_prior_add(&mut sum, &own) }, Status::Ok);
    }
    assert_eq!(sum, whole);
}

fn with(prior: &Prior, point: &ShadingPoint) -> ProductConfig {
    ProductConfig { world_from_map: point.world_from_map.as_ptr(), prior, ..product_config() }
}

/// A prior that knows nothing changes no bit: all its factors are 1/2.
#[test]
fn an_empty_prior_changes_nothing() {
    let map = sky(64, 32);
    let environment = map.build(0, 0);
    for point in grid(&map) {
        let own = environment.prepare(&point.query, &with(&NONE, &point));
        let plain = point.prepare(&environment);
        let mut random = Random(5);
        assert_eq!(own.estimate(), plain.estimate());
        for _ in 0..50 {
            let u = [random.f32(), random.f32()];
            assert_eq!(own.sample(u), plain.sample(u), "{}", point.name);
        }
    }
}

/// The pdf is that of the sample, and its inverse leads back; what is dark to the prior stays reachable.
#[test]
fn pdfs_stay_exact() {
    for map in [sky(64, 32), sun(128, 64)] {
        let environment = map.build(0, 0);
        for point in grid(&map) {
            let prior = learned(500, Some(&point.world_from_map));
            let (own, plain) = (environment.prepare(&point.query, &with(&prior, &point)), point.prepare(&environment));
            assert_eq!(own.estimate(), plain.estimate());
            let mut random = Random(7);
            for _ in 0..200 {
                let sample = own.sample([random.f32(), random.f32()]);
                assert!(sample.pdf > 0.0 && own.pdf(sample.wi) == sample.pdf);
                let other = plain.sample([random.f32(), random.f32()]);
                // Factors are between 0.1 and 0.61, and so is their mean.
                let ratio = own.pdf(other.wi) / other.pdf;
                assert!((0.1 / 0.61..=6.1).contains(&ratio), "{ratio}");
            }
        }
    }
}

/// The mean and the variance of an estimate of the light that comes past the wall.
fn estimate(
    environment: &Environment,
    point: &ShadingPoint,
    config: &ProductConfig,
    radiance: &dyn Fn([f32; 3]) -> f64,
) -> Mean {
    let product = environment.prepare(&point.query, config);
    let (mut random, mut mean) = (Random(11), Mean::default());
    for _ in 0..40_000 {
        let sample = product.sample([random.f32(), random.f32()]);
        let seen = if is_visible(sample.wi) { radiance(sample.wi) / f64::from(sample.pdf) } else { 0.0 };
        mean.add(seen);
    }
    mean
}

/// Each point at |z| < 5, and all of them together: the pooled test finds a fault of 2 % with power .99 (asserted).
#[test]
fn shadowed_estimates_are_unbiased_and_better() {
    const SIGMAS: f64 = 5.0;
    const POWER_99: f64 = 2.33;
    let map = sky(64, 32);
    let environment = map.build(0, 0);
    let (mut gain, mut points, mut difference, mut variance) = (0.0, 0.0, 0.0, 0.0);
    for point in grid(&map) {
        let scene = point.scene(&map, Filter::Nearest);
        let radiance = |wi: [f32; 3]| scene.integrand(unit(wi.map(f64::from)));
        let prior = learned(2000, Some(&point.world_from_map));
        let own = estimate(&environment, &point, &with(&prior, &point), &radiance);
        let plain = ProductConfig { prior: null(), ..with(&prior, &point) };
        let plain = estimate(&environment, &point, &plain, &radiance);
        // Where next to nothing is seen there is next to nothing to compare.
        if plain.standard_error() > 0.05 * plain.mean || own.standard_error() <= 0.0 {
            continue;
        }
        let error = (own.standard_error().powi(2) + plain.standard_error().powi(2)).sqrt() / plain.mean;
        let relative = own.mean / plain.mean - 1.0;
        assert!(relative.abs() < SIGMAS * error, "{}: {} {}", point.name, own.mean, plain.mean);
        gain += 2.0 * (plain.standard_error() / own.standard_error()).ln();
        (points, difference, variance) = (points + 1.0, difference + relative, variance + error * error);
    }
    let (difference, error) = (difference / points, f64::sqrt(variance) / points);
    let gain = f64::exp(gain / points);
    println!("{points} points: off by {difference:.5} +- {error:.5}; the prior lowers the variance {gain:.2} times");
    assert!(difference.abs() < SIGMAS * error && (SIGMAS + POWER_99) * error < 0.02);
    assert!(gain > 1.1, "{gain}");
}

/// The factor is part of what the bytes depend on, and nothing else is.
#[test]
fn the_same_prior_gives_the_same_product() {
    let environment = sky(64, 32).build(0, 0);
    let prior = learned(300, None);
    let config = ProductConfig { prior: &prior, ..product_config() };
    let [_, (_, lobes), ..] = lobes();
    let query = query([0.0, 0.0, 1.0], [0.6, 0.0, 0.8], &lobes);
    let (a, b) = (environment.prepare(&query, &config), environment.prepare(&query, &config));
    assert_eq!(a.bytes(), b.bytes());
}
