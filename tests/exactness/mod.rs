//! The same bits: a sample's pdf is pdf(wi), batches are single calls, and neither scale, address, thread nor host
//! matter; and inversion leads back.

mod batches;
#[cfg(target_arch = "x86_64")]
mod control_word;
mod corners;
mod determinism;
mod inversion;
mod numbers;
mod platform;

use crate::support::maps::{checker, horizon, one_texel, sky, sun};
use crate::support::scenes::grid;
use crate::support::{Map, Random};
use wis::ffi::wavelets::environment::{WIS_WAVELET_LIGHT_EXACT_ZERO, WIS_WAVELET_LIGHT_NEAREST};
use wis::wavelets::descent::Sample;

/// Smooth, sharp and sparse light.
fn maps() -> [Map; 5] {
    [sky(64, 32), sun(512, 256), one_texel(20, 9), checker(64, 32), horizon()]
}

fn bits(sample: Sample) -> [u32; 4] {
    let [x, y, z] = sample.wi;
    [x, y, z, sample.pdf].map(f32::to_bits)
}

/// A sample has a positive finite pdf, which is pdf(wi) to the bit.
fn check(sample: Sample, pdf: f32) {
    assert!(sample.pdf > 0.0 && sample.pdf.is_finite(), "{sample:?}");
    assert_eq!(sample.pdf.to_bits(), pdf.to_bits(), "{sample:?} {pdf}");
}

#[test]
fn a_sample_carries_the_pdf_of_its_direction() {
    for map in maps() {
        // Of a resolution that is left to the library, cells go on below.
        let exact = WIS_WAVELET_LIGHT_EXACT_ZERO | WIS_WAVELET_LIGHT_NEAREST;
        for (flags, resolution) in [(0, 128), (exact, 128), (exact, 0)] {
            let environment = map.build(resolution, flags);
            let mut random = Random(43);
            for point in grid(&map) {
                let product = point.prepare(&environment);
                for _ in 0..5000 {
                    let u = [random.f32(), random.f32()];
                    let sample = product.sample(u);
                    if product.estimate() > 0.0 {
                        check(sample, product.pdf(sample.wi));
                    }
                    let sample = environment.sample(Some(&point.world_from_map), u);
                    check(sample, environment.pdf(Some(&point.world_from_map), sample.wi));
                }
            }
        }
    }
}
