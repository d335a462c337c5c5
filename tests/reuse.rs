//! A product that serves several hits: the pdf is above 0 wherever any of them reflects light, estimates have no bias,
//! and hits that it does not cover are told so.

use crate::support::{Map, Product, Random, eval, ggx, lambert, normalise, product_config, query};
use std::ptr::null_mut;
use wis::ffi::wavelets::product::{
    ProductConfig, wis_wavelet_product_covers, wis_wavelet_product_prepare, wis_wavelet_product_size,
};
use wis::status::Status;
use wis::wavelets::query::{Lobe, Query};

const CONE: f32 = 0.25;

fn map() -> Map {
    Map::latlong(64, 32, |x, y| if x == 20 && y == 9 { 400.0 } else { 0.3 + f64::from((x + 2 * y) % 5) as f32 })
}

/// Normals up to an angle from +z turned by a fixed matrix, and the first is the middle.
fn normals(cone: f64, count: usize) -> Vec<[f32; 3]> {
    let mut random = Random(3);
    let mut normals = vec![normalise([0.3, -0.4, 0.8])];
    let [x, y, z] = normals[0].map(f64::from);
    while normals.len() < count {
        let d = random.direction();
        let across = [y * d[2] - z * d[1], z * d[0] - x * d[2], x * d[1] - y * d[0]];
        let length = across.iter().map(|c| c * c).sum::<f64>().sqrt();
        let angle = if normals.len() % 2 == 0 { cone } else { cone * random.f64() };
        let tilt = angle.tan() / length;
        normals.push(normalise([x + across[0] * tilt, y + across[1] * tilt, z + across[2] * tilt]));
    }
    normals
}

fn lobes() -> [Vec<Lobe>; 3] {
    [vec![lambert(0.8)], vec![ggx(0.4)], vec![lambert(0.5), ggx(0.2)]]
}

fn covers(product: &Product, query: &Query) -> u32 {
    let mut covers = 7;
    // SAFETY: all pointers are to live values.
    let status = unsafe { wis_wavelet_product_covers(product.environment.handle, product.handle, query, &mut covers) };
    assert_eq!(status, Status::Ok);
    covers
}

#[test]
fn the_pdf_is_positive_for_every_normal_of_the_cone() {
    let environment = map().build(0, 0);
    let wo = normalise([0.5, -0.3, 0.7]);
    let config = ProductConfig { reuse_cone: CONE, ..product_config() };
    let mut random = Random(8);
    for lobes in lobes() {
        let normals = normals(f64::from(CONE) * 0.999, 40);
        let product = environment.prepare(&query(normals[0], wo, &lobes), &config);
        for normal in normals {
            let hit = query(normal, wo, &lobes);
            assert_eq!(covers(&product, &hit), 1);
            for i in 0..400 {
                let d = random.direction();
                // Half of the directions lie within 1e-3 of the hit's horizon.
                let n = normal.map(f64::from);
                let height = d[0] * n[0] + d[1] * n[1] + d[2] * n[2];
                let lift = if i % 2 == 0 { 1e-3 * random.f64() - height } else { 0.0 };
                let wi = normalise([d[0] + lift * n[0], d[1] + lift * n[1], d[2] + lift * n[2]]);
                if eval(&hit, wi)[0] > 0.0 {
                    assert!(product.pdf(wi) > 0.0, "normal {normal:?}, wi {wi:?}");
                }
            }
        }
    }
}

/// Estimates for other normals against sums over a fine grid; 3.9 standard errors are passed by chance once in 10^4.
/// The standard error is at most half a percent, so that a bias of 3 % is found with power .99.
#[test]
fn estimates_of_other_hits_have_no_bias() {
    let environment = map().build(0, 0);
    let wo = normalise([0.5, -0.3, 0.7]);
    let config = ProductConfig { reuse_cone: CONE, ..product_config() };
    let light = |wi: [f32; 3]| f64::from(wi[2] + 1.5);
    for lobes in lobes() {
        let normals = normals(f64::from(CONE) * 0.999, 5);
        let product = environment.prepare(&query(normals[0], wo, &lobes), &config);
        for normal in normals {
            let hit = query(normal, wo, &lobes);
            let value = |wi: [f32; 3]| f64::from(eval(&hit, wi)[0]) * light(wi);
            let cells = 2000;
            let expected: f64 = (0..cells)
                .flat_map(|i| (0..cells).map(move |j| (i, j)))
                .map(|(i, j)| {
                    let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(cells);
                    let phi = std::f64::consts::TAU * (f64::from(j) + 0.5) / f64::from(cells);
                    let r = (1.0 - z * z).sqrt();
                    value(normalise([r * phi.cos(), r * phi.sin(), z]))
                })
                .sum::<f64>()
                * 4.0
                * std::f64::consts::PI
                / f64::from(cells * cells);
            let mut random = Random(17);
            let (mut sum, mut squares, samples) = (0.0, 0.0, 200_000);
            for _ in 0..samples {
                let sample = product.sample([random.f32(), random.f32()]);
                let weight = value(sample.wi) / f64::from(sample.pdf);
                (sum, squares) = (sum + weight, squares + weight * weight);
            }
            let mean = sum / f64::from(samples);
            let error = ((squares / f64::from(samples) - mean * mean) / f64::from(samples)).sqrt();
            assert!(error < 0.005 * expected, "{error} of {expected}");
            assert!((mean - expected).abs() < 3.9 * error, "{mean} for {expected}, {error}");
        }
    }
}

#[test]
fn hits_outside_the_cone_or_with_other_lobes_are_not_covered() {
    let environment = map().build(0, 0);
    let (normal, wo) = (normalise([0.3, -0.4, 0.8]), normalise([0.5, -0.3, 0.7]));
    let config = ProductConfig { reuse_cone: CONE, ..product_config() };
    let prepared = query(normal, wo, &[lambert(0.8), ggx(0.2)]);
    let product = environment.prepare(&prepared, &config);
    assert_eq!(covers(&product, &prepared), 1);
    assert_eq!(covers(&product, &Query { wo: normalise([0.1, 0.2, 0.9]), ..prepared }), 1);
    for other in [
        Query { normal: normals(f64::from(CONE) * 1.001, 3)[2], ..prepared },
        Query { flags: 1, ..prepared },
        query(normal, wo, &[lambert(0.8)]),
        query(normal, wo, &[lambert(0.8), ggx(0.2001)]),
    ] {
        assert_eq!(covers(&product, &other), 0);
    }
    let alone = environment.prepare(&prepared, &product_config());
    assert_eq!(covers(&alone, &prepared), 1);
    assert_eq!(covers(&alone, &Query { normal: normals(0.01, 3)[2], ..prepared }), 0);
}

#[test]
fn a_cone_out_of_range_is_refused() {
    let environment = map().build(0, 0);
    let prepared = query([0.0, 0.0, 1.0], [0.0, 0.0, 1.0], &[lambert(0.8)]);
    for reuse_cone in [-0.1, 1.6, f32::NAN, f32::INFINITY] {
        let config = ProductConfig { reuse_cone, ..product_config() };
        let mut size = wis::ffi::MemorySize::default();
        // SAFETY: all pointers are null or to live values.
        let statuses = unsafe {
            [
                wis_wavelet_product_size(&config, &mut size, null_mut()),
                wis_wavelet_product_prepare(
                    environment.handle,
                    &prepared,
                    &config,
                    null_mut(),
                    0,
                    null_mut(),
                    null_mut(),
                ),
            ]
        };
        assert_eq!(statuses, [Status::InvalidArgument; 2]);
    }
}
