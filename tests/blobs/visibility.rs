//! Visibility in 8 bits as stored bytes.

use super::{Kind, assert_refuses, put, tree, word};
use crate::arguments::block::Block;
use std::ptr::{dangling, null, null_mut};
use wis::ffi::wavelets::tree::Tree;
use wis::ffi::wavelets::visibility::*;
use wis::ffi::{Diagnostic, MemorySize};
use wis::status::Status;
use wis::wavelets::triple::Wavelets;

pub const KIND: Kind = Kind { name: "wis_visibility", objects, open, exercise, header: NODES, memory: 1 };

const COUNT: usize = 8;
const AVERAGE: usize = 12;
const NODES: usize = 24;
const NODE: usize = 8;

/// Bits, shares, and maps that are even.
fn objects() -> Vec<Vec<u8>> {
    let share = |i: usize| (i * i % 17) as f32 / 17.0;
    vec![
        object(3, |i| f32::from(i * i % 17 > 7)),
        object(2, share),
        object(5, share),
        object(2, |_| 0.0),
        object(0, |_| 1.0),
    ]
}

fn object(depth: u32, pixel: impl Fn(usize) -> f32) -> Vec<u8> {
    let tree = Block::new(&tree::object(2, depth, 0.0, pixel), 0);
    let (mut size, mut handle) = (MemorySize::default(), null());
    // SAFETY: the block holds a tree, and the memory is as long as stated.
    unsafe {
        let tree = tree.pointer().cast_const().cast();
        assert_eq!(wis_visibility_size(tree, &mut size, null_mut()), Status::Ok);
        let memory = Block::unwritten(size.bytes);
        let status = wis_visibility_init(tree, memory.pointer().cast(), size.bytes, &mut handle, null_mut());
        assert_eq!(status, Status::Ok);
        memory.to_vec()
    }
}

fn open(block: &Block, bytes: usize) -> (Status, Diagnostic) {
    let untouched = dangling::<Visibility>();
    let (mut handle, mut diagnostic) = (untouched, Diagnostic::default());
    // SAFETY: all pointers are valid; the tests claim more bytes only for blocks that hold a whole object.
    let status = unsafe { wis_visibility_open(block.pointer().cast(), bytes, &mut handle, &mut diagnostic) };
    let expected = if status == Status::Ok { block.pointer().cast_const().cast() } else { untouched };
    assert_eq!(handle, expected);
    (status, diagnostic)
}

/// Integrates a tree that is seen through the map: with all of it, and with the average of the BRDF only.
fn exercise(block: &Block) {
    let tree = Block::new(&tree::object(2, 3, 0.0, |i| 1.0 + (i % 5) as f32), 0);
    let (handle, seen) = (block.pointer().cast_const().cast(), tree.pointer().cast_const().cast::<Tree>());
    let (none, mut integral) = (dangling::<Wavelets>(), f64::NAN);
    // SAFETY: the handles were opened or built, and the lists are empty.
    unsafe {
        assert_eq!(wis_visibility_product_integral(seen, handle, &mut integral), Status::Ok);
        assert!((0.0..=5.0).contains(&integral), "{integral}");
        let status = wis_visibility_integral(0.5, 0, none, 0, none, seen, handle, &mut integral, null_mut());
        assert_eq!(status, Status::Ok);
        assert!((0.0..=5.0).contains(&integral), "{integral}");
    }
}

/// Averages that are no share.
#[test]
fn averages() {
    for average in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 1.001] {
        assert_refuses(&KIND, &object(3, |i| i as f32 / 64.0), AVERAGE, &average.to_ne_bytes(), "average");
    }
}

/// Children that lead back, beyond the end, or leave some out.
#[test]
fn nodes_that_are_no_tree() {
    let object = object(3, |i| (i * i % 17) as f32 / 17.0);
    let count = word(&object, COUNT);
    assert!(count > 5);
    for node in 0..count as usize {
        let below = NODES + NODE * node + 4;
        for value in [0, 15, count << 4 | 15, 1 << 4 | 1, 5 << 4 | 15, 0xffff_fff0, u32::MAX] {
            if word(&object, below) != value {
                assert_refuses(&KIND, &object, below, &value.to_ne_bytes(), &format!("node {node}: {value:x}"));
            }
        }
    }
}

/// Every share of a child is a valid one: only the checksum tells that it was changed.
#[test]
fn shares_are_guarded_by_the_checksum() {
    let object = object(3, |i| (i * i % 17) as f32 / 17.0);
    let mut changed = object.clone();
    put(&mut changed, NODES, &[object[NODES] ^ 1]);
    assert_eq!(KIND.open(&changed), Status::Corrupt);
    assert_eq!(KIND.open_sealed(&changed), Status::Ok);
}
