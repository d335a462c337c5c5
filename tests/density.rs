//! Samples against densities: frequencies, integrals, and estimates without bias.
//!
//! Each family of tests rejects a right sampler with a chance of 1e-4 (`FAMILY_SIGNIFICANCE`), corrected for the
//! number of its tests. Each test finds a fault of 2 % (`LARGEST_MISSED`) with a chance of .99 (`POWER`): it prints the
//! smallest fault that it finds, and a larger one than that fails.

use crate::support::maps::{Filter, HDR_MAPS, hdr_maps, one_texel, sky, sun};
use crate::support::partition::Cell;
use crate::support::scenes::{GRID, ShadingPoint, grid, matrices};
use crate::support::statistics::{
    LARGEST_MISSED, Mean, chi_square, chi_square_smallest_fault, corrected, kolmogorov_smirnov,
};
use crate::support::vector::{single, unit};
use crate::support::*;
use wis::ffi::wavelets::environment::WIS_WAVELET_LIGHT_NEAREST;
use wis::wavelets::query::{
    Lobe, Query, WIS_WAVELET_LOBE_PHONG, WIS_WAVELET_QUERY_COSINE_INCLUDED, WIS_WAVELET_QUERY_WHOLE_SPHERE,
};

/// Maps that the families of tests cover.
const MAPS: usize = 2 + HDR_MAPS;

/// Counts samples in cells of the square of similar probability, and compares with the integral of the pdf over
/// each. The pdf must integrate to 1 within `exactness`. Returns the p-value. A fault is the root mean square of the
/// relative errors of the bins' probabilities.
fn frequencies(
    point: &ShadingPoint,
    (level, exactness): (u32, f64),
    mut sample: impl FnMut([f32; 2]) -> [f32; 3],
    pdf: impl Fn([f32; 3]) -> f32,
) -> f64 {
    const SAMPLES: usize = 400_000;
    const TESTS: usize = MAPS * GRID;
    let mut cells = Cell::integrate(level, &|map| f64::from(pdf(point.world(map))));
    assert!((cells.mass - 1.0).abs() < exactness, "the pdf integrates to {}", cells.mass);
    let expected: Vec<f64> = cells.join(1.0 / 32.0).iter().map(|mass| mass * SAMPLES as f64).collect();
    let mut observed = vec![0; expected.len()];
    let mut random = Random(level.into());
    for _ in 0..SAMPLES {
        observed[cells.find(point.square(sample([random.f32(), random.f32()])))] += 1;
    }
    let test = chi_square(&observed, &expected);
    let fault = chi_square_smallest_fault(test.degrees, SAMPLES as f64, corrected(TESTS));
    assert!(fault <= LARGEST_MISSED, "only a fault of {fault} is found");
    println!("{}: p = {:.3}, finds {:.2} %", point.name, test.p_value, 100.0 * fault);
    assert!(test.p_value > corrected(TESTS), "chi-square {} of {} degrees", test.statistic, test.degrees);
    test.p_value
}

/// The chi-square test on the grid under one map.
fn frequencies_match_the_pdf(name: &str, map: &Map, resolution: u32) {
    let environment = map.build(resolution, 0);
    let least = grid(map).iter().fold(1.0, |least: f64, point| {
        let product = point.prepare(&environment);
        let level = resolution.ilog2();
        least.min(frequencies(point, (level, 1e-5), |u| product.sample(u).wi, |wi| product.pdf(wi)))
    });
    println!(
        "{name}: the smallest p of {GRID} chi-square tests is {least:.1e}, {:.1e} is rejected",
        corrected(MAPS * GRID)
    );
}

#[test]
fn frequencies_match_the_pdf_under_a_sun() {
    frequencies_match_the_pdf("sun", &sun(1024, 512), 128);
}

#[test]
fn frequencies_match_the_pdf_under_one_texel() {
    frequencies_match_the_pdf("one texel", &one_texel(20, 9), 64);
}

#[test]
fn frequencies_match_the_pdf_under_hdr_maps() {
    for (name, map) in hdr_maps() {
        frequencies_match_the_pdf(name, &map, 128);
    }
}

#[test]
fn frequencies_match_the_pdf_of_the_light_alone() {
    let [sky, lone] = [sky(64, 32), one_texel(20, 9)];
    // Without filter and of a resolution that is left to the library, cells go on below.
    for (map, resolution) in [(sky.clone(), 128), (sun(1024, 512), 128), (lone.clone(), 128), (sky, 0), (lone, 0)] {
        let nearest = if resolution == 0 { WIS_WAVELET_LIGHT_NEAREST } else { 0 };
        let environment = map.build(resolution, nearest);
        for point in grid(&map).iter().take(2) {
            let matrix = Some(&point.world_from_map);
            let sample = |u| environment.sample(matrix, u).wi;
            frequencies(point, (7, 1e-5), sample, |wi| environment.pdf(matrix, wi));
        }
    }
}

/// Directions drawn by rejection from pdf(wi) alone, inverted: both coordinates must be uniform
/// (Kolmogorov-Smirnov, which with 33000 samples finds a distribution function that is 2 % off).
#[test]
fn inverted_directions_are_uniform() {
    let environment = sky(64, 32).build(64, 0);
    let tests = 2 * 3;
    for lobes in [vec![lambert(1.0)], vec![ggx(0.5)], vec![lambert(0.5), ggx(0.3)]] {
        let query = query(normalise([0.2, -0.3, 1.0]), normalise([-0.5, 0.2, 0.8]), &lobes);
        let product = environment.prepare(&query, &product_config());
        let mut random = Random(29);
        let largest = (0..100_000).map(|_| product.pdf(single(random.direction()))).fold(0.0, f32::max) * 1.3;
        let mut u = [Vec::new(), Vec::new()];
        while u[0].len() < 33_000 {
            let wi = single(random.direction());
            let pdf = product.pdf(wi);
            assert!(pdf <= largest);
            if random.f32() * largest < pdf {
                let inverted = product.invert(wi).expect("the pdf is above 0");
                u.iter_mut().zip(inverted).for_each(|(all, u)| all.push(f64::from(u)));
            }
        }
        for u in &mut u {
            let p = kolmogorov_smirnov(u);
            assert!(p > corrected(tests), "p {p}");
        }
    }
}

/// The z-test of the mean of radiance x BRDF x cosine / pdf against brute-force quadrature, with as many samples as
/// find a fault of 2 % of the mean by the variance of a run before. Returns the p-value.
fn bias(environment: &Environment, map: &Map, filter: Filter, point: &ShadingPoint, tests: usize) -> f64 {
    const MOST: f64 = 2e7;
    let product = point.prepare(environment);
    let scene = point.scene(map, filter);
    let reference = scene.integral(1.0);
    let mut random = Random(97);
    let mut mean_of = |samples: f64| {
        let mut mean = Mean::default();
        while mean.count < samples {
            let sample = product.sample([random.f32(), random.f32()]);
            mean.add(scene.integrand(unit(sample.wi.map(f64::from))) / f64::from(sample.pdf));
        }
        mean
    };
    let mut mean = mean_of(2e4);
    while mean.smallest_fault(corrected(tests)) > LARGEST_MISSED {
        let needed = 1.2 * mean.samples_needed(corrected(tests));
        assert!(needed < MOST, "{filter:?}, {}: the variance is too large for {MOST} samples", point.name);
        mean = mean_of(needed);
    }
    let p = mean.p_value(reference, 1e-4 * reference);
    let (off, fault) = (100.0 * (mean.mean / reference - 1.0), 100.0 * mean.smallest_fault(corrected(tests)));
    println!("{filter:?}, {}: {off:+.2} %, p = {p:.3}, finds {fault:.2} %", point.name);
    assert!(p > corrected(tests), "{filter:?}, {}: {} instead of {reference}", point.name, mean.mean);
    p
}

fn estimates_have_no_bias(name: &str, map: &Map) {
    const TESTS: usize = 2 * MAPS * GRID;
    let grid = grid(map);
    for (filter, flags) in [(Filter::Nearest, WIS_WAVELET_LIGHT_NEAREST), (Filter::Bilinear, 0)] {
        let environment = map.build(0, flags);
        let least = grid.iter().map(|point| bias(&environment, map, filter, point, TESTS)).fold(1.0, f64::min);
        println!(
            "{name}, {filter:?}: the smallest p of {GRID} z-tests is {least:.1e}, {:.1e} is rejected",
            corrected(TESTS)
        );
    }
}

#[test]
fn estimates_have_no_bias_under_a_sun() {
    estimates_have_no_bias("sun", &sun(512, 256));
}

#[test]
fn estimates_have_no_bias_under_one_texel() {
    estimates_have_no_bias("one texel", &one_texel(20, 9));
}

#[test]
fn estimates_have_no_bias_under_hdr_maps() {
    for (name, map) in hdr_maps() {
        estimates_have_no_bias(name, &map);
    }
}

/// Anisotropic GGX, Phong, both sides of a surface, and values that contain the cosine.
fn further_points() -> Vec<ShadingPoint> {
    let brushed = Lobe { b: 0.08, ..ggx(0.4) };
    let phong = |a| Lobe { kind: WIS_WAVELET_LOBE_PHONG, weight: [0.7, 0.6, 0.5], a, ..Lobe::default() };
    let (normal, wo) = (unit([0.2, -0.3, 1.0]), unit([-0.7, 0.1, 0.5]));
    let with =
        |lobes: &[Lobe], flags| Query { tangent: [1.0, 0.4, 0.1], flags, ..query(single(normal), single(wo), lobes) };
    let points = [
        ("brushed", with(&[brushed], 0)),
        ("Phong 3", with(&[phong(3.0)], 0)),
        ("Phong 60", with(&[phong(60.0), lambert(0.2)], 0)),
        ("both sides", with(&[lambert(0.7), ggx(0.3)], WIS_WAVELET_QUERY_WHOLE_SPHERE)),
        ("cosine contained", with(&[lambert(0.7), phong(20.0)], WIS_WAVELET_QUERY_COSINE_INCLUDED)),
    ];
    points.map(|(name, query)| ShadingPoint { name: name.into(), query, world_from_map: matrices()[1] }).into()
}

#[test]
fn estimates_have_no_bias_for_other_lobes() {
    for map in [sky(64, 32), sun(256, 128)] {
        let environment = map.build(0, 0);
        for point in further_points() {
            bias(&environment, &map, Filter::Bilinear, &point, 10);
        }
    }
}

/// The reference converges by itself: dividing its cells twice as finely changes less than 1e-4.
#[test]
fn the_reference_converges() {
    for map in [sun(256, 128), one_texel(20, 9)] {
        for point in grid(&map).into_iter().chain(further_points()) {
            for filter in [Filter::Nearest, Filter::Bilinear] {
                let scene = point.scene(&map, filter);
                let (coarse, fine) = (scene.integral(1.0), scene.integral(2.0));
                assert!((coarse - fine).abs() <= 1e-4 * fine, "{}, {filter:?}: {coarse} {fine}", point.name);
            }
        }
    }
}
