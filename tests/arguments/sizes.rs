//! What a size query answers is enough, to the byte, for every configuration.

use super::block::Block;
use super::call::Call;
use super::objects::function;
use super::scene::{Scene, numbers};
use wis::ffi::MemorySize;
use wis::ffi::wavelets::environment::*;
use wis::ffi::wavelets::product::*;
use wis::ffi::wavelets::tree::*;
use wis::status::Status;

/// What the size query of a call's configuration answers.
fn size<T: Copy>(scene: &Scene, query: &str, edit: impl Fn(&mut T)) -> MemorySize {
    let query = function(query);
    let mut call = Call::valid(scene, &query);
    call.edit("config", edit);
    call.succeeds("size");
    let mut size = MemorySize::default();
    call.edit("size", |answered: &mut MemorySize| size = *answered);
    assert_eq!(size.align, wis::ffi::WIS_ALIGNMENT);
    size
}

/// Builds in blocks of exactly the sizes that were answered.
fn build<T: Copy>(scene: &Scene, init: &str, size: MemorySize, edit: impl Fn(&mut T)) {
    let init = function(init);
    let mut call = Call::valid(scene, &init);
    call.edit("config", edit);
    call.give("memory", Block::unwritten(size.bytes));
    call.set("bytes", size.bytes);
    if init.parameter("scratch").is_some() {
        call.give("scratch", Block::unwritten(size.scratch_bytes));
        call.set("scratch_bytes", size.scratch_bytes);
    }
    call.succeeds("exact blocks");
}

const ALL: u32 = WIS_WAVELET_LIGHT_SANITISE | WIS_WAVELET_LIGHT_RGB;

#[test]
fn environments() {
    let scene = Scene::new();
    let pixels = [0x3c00u16; 16 * 16 * 4];
    let layouts = [
        (WIS_LAYOUT_LATLONG, 1, 1),
        (WIS_LAYOUT_LATLONG, 7, 2),
        (WIS_LAYOUT_CUBE, 1, 6),
        (WIS_LAYOUT_CUBE, 3, 18),
        (WIS_LAYOUT_OCTAHEDRAL, 5, 5),
    ];
    for (layout, width, height) in layouts {
        for (storage, flags, resolution) in [
            (WIS_STORAGE_PYRAMID, 0, 0),
            (WIS_STORAGE_PYRAMID, ALL, 1),
            (WIS_STORAGE_PYRAMID, 0, 2),
            (WIS_STORAGE_SPARSE, WIS_WAVELET_LIGHT_RGB, 8),
            (WIS_STORAGE_SPARSE, ALL, 4),
            (WIS_STORAGE_SPARSE, 0, 1),
        ] {
            for channels in [1, 3, 4] {
                // The last row ends where a memory checker looks.
                let pixels = &pixels[..(width * height * channels) as usize];
                let block = Block::new(&numbers(pixels), 0);
                let edit = |c: &mut EnvironmentConfig| {
                    (c.layout, c.width, c.height) = (layout, width, height);
                    (c.storage, c.flags, c.resolution) = (storage, flags, resolution);
                    (c.channels, c.format) = (channels, WIS_FORMAT_F16);
                    c.pixels = block.pointer().cast();
                };
                let size = size(&scene, "wis_wavelet_light_size", edit);
                build(&scene, "wis_wavelet_light_init", size, edit);
            }
        }
    }
}

/// Configurations that only a size query can try here.
#[test]
fn large_environments() {
    let scene = Scene::new();
    let accepted: [fn(&mut EnvironmentConfig); 4] = [
        |c| c.resolution = 4096,
        |c| (c.width, c.height, c.resolution) = (u32::MAX, 1, 0),
        |c| (c.width, c.height, c.row_stride) = (1, u32::MAX, 12),
        |c| c.error_budget = -0.0,
    ];
    let bytes = accepted.map(|edit| size(&scene, "wis_wavelet_light_size", edit).bytes);
    // Luminance takes 16 bytes a square, links 8, RGB 48.
    let squares = (4usize.pow(12) - 1) / 3;
    assert!(bytes[0].abs_diff(squares * 72) < 256, "{bytes:?}");
}

#[test]
fn products() {
    let scene = Scene::new();
    for (squares, evaluations) in [(0, 0), (1, 0), (2, 1), (4, 100), (5, 18), (6, u32::MAX), (4096, u32::MAX)] {
        let edit = |c: &mut ProductConfig| (c.max_squares, c.max_evaluations) = (squares, evaluations);
        let size = size(&scene, "wis_wavelet_product_size", edit);
        assert_eq!(size.scratch_bytes, 0);
        // Three queries.
        let size = MemorySize { bytes: 3 * size.bytes, ..size };
        build(&scene, "wis_wavelet_product_prepare", size, edit);
        build(&scene, "wis_wavelet_product_prepare", size, |c: &mut ProductConfig| {
            edit(c);
            c.callback = scene.callback.pointer().cast_const().cast();
        });
    }
}

#[test]
fn trees() {
    let scene = Scene::new();
    for (dimensions, depth) in [(1, 0), (4, 0), (1, 5), (2, 3), (3, 2), (4, 2), (1, 1)] {
        let count = 1u32 << (dimensions * depth);
        let pixels: Vec<f32> = (0..count).map(|i| (i % 5) as f32).collect();
        let block = Block::new(&numbers(&pixels), 0);
        let edit = |c: &mut TreeConfig| {
            (c.dimensions, c.depth) = (dimensions, depth);
            c.pixels = block.pointer().cast();
        };
        let size = size(&scene, "wis_tree_size", edit);
        build(&scene, "wis_tree_init", size, edit);
    }
}

/// One byte less than a pyramid's size is too short.
#[test]
fn pyramids_are_measured_exactly() {
    let scene = Scene::new();
    let init = function("wis_wavelet_light_init");
    let pyramid = |c: &mut EnvironmentConfig| c.storage = WIS_STORAGE_PYRAMID;
    let size = size(&scene, "wis_wavelet_light_size", pyramid);
    let mut call = Call::valid(&scene, &init);
    call.edit("config", pyramid);
    call.set("bytes", size.bytes - 1);
    let diagnostic = call.fails("a byte less", Status::MemoryTooSmall, "memory");
    assert_eq!(diagnostic.bytes_needed, size.bytes as u64);
}

/// The bytes of an object do not depend on what was in its memory, or in the scratch block.
#[test]
fn bytes_do_not_depend_on_the_memory() {
    let scene = Scene::new();
    for name in ["wis_wavelet_light_init", "wis_environment_init", "wis_tree_init", "wis_wavelet_product_prepare"] {
        let init = function(name);
        let [zeros, ones] = [0, 0xff].map(|filling| {
            let mut call = Call::valid(&scene, &init);
            for (block, bytes) in [("memory", "bytes"), ("scratch", "scratch_bytes")] {
                if init.parameter(block).is_some() {
                    call.give(block, Block::new(&vec![filling; call.number(bytes)], 0));
                }
            }
            call.succeeds("any memory");
            call.bytes("memory").to_vec()
        });
        // Every kind of object stores its length behind its first eight bytes.
        let length = u64::from_ne_bytes(zeros[8..16].try_into().unwrap()) as usize;
        let differing: Vec<usize> = (0..length).filter(|&place| zeros[place] != ones[place]).collect();
        assert!(differing.is_empty(), "{name}: bytes {differing:?}");
    }
}
