//! What a size query answers is enough, to the byte, for every configuration.

use super::block::Block;
use super::call::Call;
use super::objects::function;
use super::pointers::configurations;
use super::scene::{Scene, numbers};
use wis::ffi::MemorySize;
use wis::ffi::wavelets::tree::*;

/// What the size query of a call's configuration answers.
fn size<T: Copy>(scene: &Scene, query: &str, edit: impl Fn(&mut T)) -> MemorySize {
    let mut call = Call::valid(scene, function(query));
    call.edit("config", edit);
    call.succeeds("size");
    let size: MemorySize = call.read("size");
    assert_eq!(size.align, wis::ffi::WIS_ALIGNMENT);
    size
}

/// Builds in blocks of exactly the sizes that were answered.
fn build<T: Copy>(scene: &Scene, init: &str, size: MemorySize, edit: impl Fn(&mut T)) {
    let init = function(init);
    let mut call = Call::valid(scene, init);
    call.edit("config", edit);
    call.give("memory", Block::unwritten(size.bytes));
    call.set("bytes", size.bytes);
    if init.has("scratch") {
        call.give("scratch", Block::unwritten(size.scratch_bytes));
        call.set("scratch_bytes", size.scratch_bytes);
    }
    call.succeeds("exact blocks");
}

#[test]
fn trees() {
    let scene = Scene::new();
    for (dimensions, depth) in [(2, 0), (4, 0), (2, 3), (4, 2), (2, 1)] {
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

/// The bytes of an object do not depend on what was in its memory, or in the scratch block.
#[test]
fn bytes_do_not_depend_on_the_memory() {
    let scene = Scene::new();
    for init in ["wis_environment_init", "wis_tree_init"].map(function) {
        for config in configurations(&scene, init) {
            let [zeros, ones] = [0, 0xff].map(|filling| {
                let mut call = Call::valid(&scene, init);
                config.iter().for_each(|config| call.give("config", Block::new(config, 0)));
                for (block, bytes) in [("memory", "bytes"), ("scratch", "scratch_bytes")] {
                    call.give(block, Block::new(&vec![filling; call.number(bytes)], 0));
                }
                call.succeeds("any memory");
                call.bytes("memory").to_vec()
            });
            // Every kind of object stores its length behind its first eight bytes.
            let length = u64::from_ne_bytes(zeros[8..16].try_into().unwrap()) as usize;
            let differing: Vec<usize> = (0..length).filter(|&place| zeros[place] != ones[place]).collect();
            assert!(differing.is_empty(), "{}: bytes {differing:?}", init.name);
        }
    }
}
