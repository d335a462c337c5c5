//! Scalings of the light, threads, addresses and copies change no bit.

use super::bits;
use crate::support::scenes::grid;
use crate::support::vector::single;
use crate::support::{Environment, Map, Memory, Product, Random, build, build_over, product_config};
use wis::ffi::wavelets::environment::{
    EnvironmentConfig, WIS_STORAGE_SPARSE, WIS_WAVELET_LIGHT_NEAREST, WIS_WAVELET_LIGHT_RGB,
};
use wis::ffi::wavelets::product::ProductConfig;

/// A map in colour whose texels all stay normal when it is scaled by 2^-100 to 2^100.
pub fn colourful() -> Map {
    let mut random = Random(73);
    let mut map = Map::latlong(96, 48, |_, _| 0.0);
    map.channels = 3;
    let texel = |random: &mut Random| if random.f32() < 0.2 { 0.0 } else { random.f32().powi(8) * 2e4 + 1e-3 };
    map.pixels = (0..96 * 48 * 3).map(|_| texel(&mut random)).collect();
    map
}

/// Scaling the map by a power of two scales the integrals exactly and changes no bit of directions and pdfs.
#[test]
fn scaling_the_light_scales_only_the_integrals() {
    let map = colourful();
    let flags = WIS_WAVELET_LIGHT_RGB | WIS_WAVELET_LIGHT_NEAREST;
    // Cells of 64, and those that are divided further where light varies.
    for (resolution, k) in [64, 0].into_iter().flat_map(|r| [-100, -33, -1, 1, 7, 100].map(|k| (r, k))) {
        let environment = map.build(resolution, flags);
        let factor = 2f64.powi(k);
        let mut scaled = map.clone();
        scaled.pixels.iter_mut().for_each(|p| *p *= factor as f32);
        let scaled = scaled.build(resolution, flags);
        assert_eq!(scaled.info.power, environment.info.power * factor);
        let mut random = Random(79);
        for point in grid(&map) {
            let [a, b] = [&environment, &scaled].map(|e| point.prepare(e));
            assert_eq!(b.estimate(), a.estimate() * factor);
            assert_eq!(b.estimate_rgb(), a.estimate_rgb().map(|c| c * factor));
            for _ in 0..300 {
                let (u, wi) = ([random.f32(), random.f32()], single(random.direction()));
                assert_eq!(bits(a.sample(u)), bits(b.sample(u)));
                assert_eq!(a.pdf(wi).to_bits(), b.pdf(wi).to_bits());
                let [a, b] = [&environment, &scaled].map(|e| bits(e.sample(Some(&point.world_from_map), u)));
                assert_eq!(a, b);
            }
        }
    }
}

/// Environments in both storages, with all their parts and with luminance only.
fn configurations(map: &Map) -> Vec<EnvironmentConfig> {
    let pyramid = map.config(64, WIS_WAVELET_LIGHT_RGB);
    let sparse = |error_budget| EnvironmentConfig { storage: WIS_STORAGE_SPARSE, error_budget, ..pyramid };
    let natural = EnvironmentConfig { resolution: 0, flags: pyramid.flags | WIS_WAVELET_LIGHT_NEAREST, ..pyramid };
    let all = [pyramid, natural].into_iter().chain([0.0, 0.001, 0.003, 0.01, 0.03, 0.1].map(sparse));
    all.flat_map(|config| [config, EnvironmentConfig { flags: 0, ..config }]).collect()
}

/// The bytes of an environment are those of its configuration, not of what stood in the memory before.
#[test]
fn builds_of_an_environment_are_the_same_bytes() {
    let map = colourful();
    for config in configurations(&map) {
        let environment = build(&config).unwrap();
        assert!(environment.bytes() == build_over(&config, 0).unwrap().bytes(), "bytes are not written: {config:?}");
    }
}

/// The bytes of a product do not depend on where it is, nor on what stood there before.
#[test]
fn products_are_the_same_bytes_anywhere() {
    let map = colourful();
    let environment = map.build(64, 0);
    for point in grid(&map) {
        let config = ProductConfig { world_from_map: point.world_from_map.as_ptr(), ..product_config() };
        let product = environment.prepare(&point.query, &config);
        let elsewhere = environment.prepare_over(&point.query, &config, 0);
        assert_ne!(product.handle, elsewhere.handle);
        assert!(product.bytes() == elsewhere.bytes(), "{}", point.name);
    }
}

/// Copies of an environment and of a product do what the originals do.
#[test]
fn copies_give_the_same_results() {
    let map = colourful();
    for config in configurations(&map).into_iter().step_by(2) {
        let environment = build(&config).unwrap();
        let copy = Environment::open(environment.bytes());
        assert_eq!(environment.info.content_id, copy.info.content_id);
        let mut random = Random(83);
        for point in grid(&map) {
            let product = point.prepare(&environment);
            assert!(product.bytes() == point.prepare(&copy).bytes(), "{}", point.name);
            let mut memory = Memory::copy(product.bytes());
            let handle = memory.pointer().cast_const().cast();
            let moved = Product { environment: &copy, memory, handle };
            for _ in 0..200 {
                let u = [random.f32(), random.f32()];
                let sample = product.sample(u);
                assert_eq!(bits(sample), bits(moved.sample(u)));
                assert_eq!(sample.pdf.to_bits(), moved.pdf(sample.wi).to_bits());
                assert_eq!(product.invert(sample.wi), moved.invert(sample.wi));
                let [a, b] = [&environment, &copy].map(|e| bits(e.sample(Some(&point.world_from_map), u)));
                assert_eq!(a, b);
            }
            assert_eq!(product.estimate(), moved.estimate());
            assert_eq!(product.estimate_rgb(), moved.estimate_rgb());
        }
    }
}
