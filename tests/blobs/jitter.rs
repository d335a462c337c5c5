//! Tables of places inside strata as stored bytes.

use super::{Kind, assert_refuses, word};
use crate::arguments::block::Block;
use crate::support::light_config;
use std::ptr::{dangling, null, null_mut};
use wis::ffi::light::WIS_LAYOUT_LATLONG;
use wis::ffi::lights::*;
use wis::ffi::{Diagnostic, MemorySize};
use wis::sample::Sample;
use wis::status::Status;

pub const KIND: Kind = Kind { name: "wis_jitter", objects, open, exercise, header: HEADER, memory: 1 };

const COLUMNS: usize = 24;
const LIGHTS: usize = 32;
const FRAME: usize = 36;
/// With what fills it up to whole pieces of 16 bytes.
const ARRAYS: usize = 80;
const HEADER: usize = 72;

/// Both distributions, an empty stratum, one stratum, a map of one texel.
fn objects() -> Vec<Vec<u8>> {
    vec![
        object([6, 4], 3, WIS_JITTER_ENERGY, |texel| texel as u32 % 3),
        object([6, 4], 4, WIS_JITTER_UNIFORM, |texel| texel as u32 / 8),
        object([5, 3], 1, WIS_JITTER_ENERGY, |_| 0),
        object([1, 1], 1, WIS_JITTER_UNIFORM, |_| 0),
    ]
}

fn object(size: [u32; 2], lights: u32, distribution: u32, stratum: impl Fn(usize) -> u32) -> Vec<u8> {
    let texels = (size[0] * size[1]) as usize;
    let pixels: Vec<f32> = (0..texels).map(|k| (k * k % 7) as f32).collect();
    let labels: Vec<u32> = (0..texels).map(stratum).collect();
    let (map, mut need, mut handle) = (light_config(WIS_LAYOUT_LATLONG, size, &pixels), MemorySize::default(), null());
    let size = size_of::<JitterConfig>() as u32;
    let config = JitterConfig { size, light_count: lights, distribution, reserved: 0, label: labels.as_ptr() };
    // SAFETY: the configuration describes the pixels, there is a label for each texel, and the blocks are as long as stated.
    unsafe {
        assert_eq!(wis_jitter_size(&map, &config, &mut need, null_mut()), Status::Ok);
        let (memory, scratch) = (Block::unwritten(need.bytes), Block::unwritten(need.scratch_bytes));
        let (place, work) = (memory.pointer().cast(), scratch.pointer().cast());
        let (bytes, work_bytes, none) = (need.bytes, need.scratch_bytes, null_mut());
        let status = wis_jitter_init(&map, &config, place, bytes, work, work_bytes, &mut handle, none);
        assert_eq!(status, Status::Ok);
        memory.to_vec()
    }
}

fn open(block: &Block, bytes: usize) -> (Status, Diagnostic) {
    let untouched = dangling::<Jitter>();
    let (mut handle, mut diagnostic) = (untouched, Diagnostic::default());
    // SAFETY: all pointers are valid; the tests claim more bytes only for blocks that hold a whole object.
    let status = unsafe { wis_jitter_open(block.pointer().cast(), bytes, &mut handle, &mut diagnostic) };
    let expected = if status == Status::Ok { block.pointer().cast_const().cast() } else { untouched };
    assert_eq!(handle, expected);
    (status, diagnostic)
}

/// Draws from each stratum, and asks for the pdf of what was drawn.
fn exercise(block: &Block) {
    let handle = block.pointer().cast_const().cast();
    for light in 0..word(block, LIGHTS).min(64) {
        for u in [[0.0, 0.0], [0.3, 0.7], [0.999, 0.999]] {
            let (mut sample, mut pdf) = (Sample::default(), f32::NAN);
            // SAFETY: the handle was opened.
            unsafe {
                assert_eq!(wis_jitter_sample(handle, light, &u, &mut sample), Status::Ok);
                if sample.pdf > 0.0 {
                    assert_eq!(wis_jitter_pdf(handle, light, &sample.wi, &mut pdf), Status::Ok);
                    assert!(pdf.is_finite() && pdf >= 0.0, "{pdf}");
                }
            }
            assert!(sample.wi.iter().chain([&sample.pdf]).all(|x| x.is_finite()), "{sample:?}");
        }
    }
}

/// Texels that are missing, twice there or out of range, sums that do not ascend to 1, and frames that are no rotation.
#[test]
fn tables_that_are_no_strata() {
    let object = object([6, 4], 3, WIS_JITTER_ENERGY, |texel| texel as u32 % 3);
    let starts = ARRAYS;
    let order = starts + 16;
    let rank = order + 4 * 24;
    let sums = rank + 4 * 24;
    assert_eq!(object.len(), sums + 8 * 24);
    let refuses = |place, value: &[u8], what: &str| assert_refuses(&KIND, &object, place, value, what);
    for value in [0u32, 7, 9, 24, u32::MAX] {
        refuses(starts + 4, &value.to_ne_bytes(), "a start");
        refuses(order + 4, &value.to_ne_bytes(), "a texel");
        refuses(rank, &value.wrapping_add(3).to_ne_bytes(), "a place");
    }
    for value in [f64::NAN, f64::INFINITY, -0.5, 2.0] {
        refuses(sums, &value.to_ne_bytes(), "the first sum");
        refuses(sums + 8 * 7, &value.to_ne_bytes(), "the last sum");
    }
    for value in [f32::NAN, 0.5, 2.0] {
        refuses(FRAME, &value.to_ne_bytes(), "the frame");
    }
    for value in [0u32, 5, 32769, u32::MAX] {
        refuses(COLUMNS, &value.to_ne_bytes(), "columns");
    }
}
