//! Trees as stored bytes.

use super::{BYTES, CONTENT_ID, Kind, NO_AMOUNTS, NO_LINKS, assert_refuses, long, word};
use crate::arguments::block::{Block, SENTINEL, plain};
use std::ptr::{dangling, null, null_mut};
use wis::ffi::wavelets::tree::*;
use wis::ffi::{Diagnostic, MemorySize};
use wis::status::Status;

pub const KIND: Kind = Kind { name: "wis_tree", objects, open, exercise, header: SQUARES, memory: 1 };

const MEAN: usize = 24;
const ERROR: usize = 32;
const DIMENSIONS: usize = 40;
const DEPTH: usize = 44;
const COUNT: usize = 48;
const EXPONENT: usize = 52;
const AVERAGE: usize = 56;
const RESERVED: usize = 60;
const SQUARES: usize = 64;

fn objects() -> Vec<Vec<u8>> {
    let varied = |i: usize| (i * i % 17) as f32;
    let mut objects = Vec::new();
    for (dimensions, depth, budget) in [(2, 2, 0.05), (2, 3, 0.0), (4, 2, 0.1), (4, 1, 0.0), (2, 0, 0.0)] {
        objects.push(object(dimensions, depth, budget, varied));
    }
    objects.extend([0.0, 1e-45, f32::MAX].map(|value| object(2, 2, 0.0, |_| value)));
    objects
}

pub fn object(dimensions: u32, depth: u32, error_budget: f32, pixel: impl Fn(usize) -> f32) -> Vec<u8> {
    let pixels: Vec<f32> = (0..1 << (dimensions * depth)).map(pixel).collect();
    let config = plain(|config: &mut TreeConfig| {
        config.size = size_of::<TreeConfig>() as u32;
        (config.dimensions, config.depth, config.error_budget) = (dimensions, depth, error_budget);
        config.pixels = pixels.as_ptr();
    });
    let config = Block::new(&config, 0);
    let config = config.pointer().cast_const().cast();
    let mut size = MemorySize::default();
    let mut info = TreeInfo { size: size_of::<TreeInfo>() as u32, ..TreeInfo::default() };
    let mut handle = null();
    // SAFETY: all pointers are valid.
    unsafe {
        assert_eq!(wis_tree_size(config, &mut size, null_mut()), Status::Ok);
        let (memory, scratch) = (Block::unwritten(size.bytes), Block::unwritten(size.scratch_bytes));
        let (place, work) = (memory.pointer().cast(), scratch.pointer().cast());
        let (bytes, scratch_bytes) = (size.bytes, size.scratch_bytes);
        let status = wis_tree_init(config, place, bytes, work, scratch_bytes, &mut handle, &mut info, null_mut());
        assert_eq!(status, Status::Ok);
        memory[..info.bytes as usize].to_vec()
    }
}

fn open(block: &Block, bytes: usize) -> (Status, Diagnostic) {
    let untouched = dangling::<Tree>();
    let mut handle = untouched;
    let size = size_of::<TreeInfo>() as u32;
    let mut info = TreeInfo { size, content_id: SENTINEL.into(), ..TreeInfo::default() };
    let mut diagnostic = Diagnostic::default();
    // SAFETY: all pointers are valid; the tests claim more bytes only for blocks that hold a whole object.
    let status = unsafe { wis_tree_open(block.pointer().cast(), bytes, &mut handle, &mut info, &mut diagnostic) };
    let is_written = [handle != untouched, info.content_id != u64::from(SENTINEL)];
    assert_eq!(is_written, [status == Status::Ok; 2]);
    assert!(status != Status::Ok || info.content_id == long(block, CONTENT_ID));
    assert!(status != Status::Ok || handle == block.pointer().cast_const().cast());
    (status, diagnostic)
}

/// Where the links stand; `None` if that is beyond memory.
fn links(bytes: &[u8]) -> Option<usize> {
    let children = 1usize.checked_shl(word(bytes, DIMENSIONS))?;
    children.checked_mul(4)?.checked_mul(word(bytes, COUNT) as usize)?.checked_add(SQUARES)
}

/// Samples the tree, multiplies it by itself and warps points.
fn exercise(block: &Block) {
    let handle = block.pointer().cast_const().cast::<Tree>();
    let mut integral = 0.0;
    // SAFETY: the handle was opened; there is room for four axes.
    unsafe {
        assert_eq!(wis_tree_product_integral(handle, handle, &mut integral), Status::Ok);
        for u in [[0.0f32; 4], [0.5; 4], [0.99; 4], [0.1, 0.9, 0.4, 0.6]] {
            let (mut point, mut pdf, mut back, mut again) = ([0.0f32; 4], 0.0, [0.0f32; 4], 0.0);
            assert_eq!(wis_tree_sample(handle, u.as_ptr(), point.as_mut_ptr(), &mut pdf), Status::Ok);
            assert_eq!(wis_tree_pdf(handle, point.as_ptr(), &mut again), Status::Ok);
            assert_eq!(pdf.to_bits(), again.to_bits());
            let status = wis_tree_invert(handle, point.as_ptr(), back.as_mut_ptr());
            assert!(matches!(status, Status::Ok | Status::ZeroDensity));
        }
        let mut points: [f32; 32] = std::array::from_fn(|i| i as f32 / 32.0);
        let mut index = [0, 1, 2, 3, 4, 5, 6, 7];
        let status = wis_warp_in_place(handle, points.as_mut_ptr(), index.as_mut_ptr(), index.len(), null_mut());
        assert!(matches!(status, Status::Ok | Status::ZeroDensity));
    }
}

fn sparse() -> Vec<u8> {
    object(2, 3, 0.0, |i| 0.1 + (i * i % 17) as f32)
}

/// Numbers that cannot be, wherever they stand.
#[test]
fn amounts() {
    for object in [sparse(), object(2, 3, 1e30, |i| 1.0 + i as f32)] {
        for no_amount in NO_AMOUNTS {
            for offset in [MEAN, ERROR] {
                assert_refuses(&KIND, &object, offset, &no_amount.to_ne_bytes(), "mean or error");
            }
            for offset in [AVERAGE].into_iter().chain((SQUARES..links(&object).unwrap()).step_by(4)) {
                assert_refuses(&KIND, &object, offset, &(no_amount as f32).to_ne_bytes(), "average");
            }
        }
    }
}

#[test]
fn headers() {
    let object = sparse();
    for (offset, numbers) in [
        (DIMENSIONS, &[0, 1, 3, 4, 5, 32, u32::MAX][..]),
        (DEPTH, &[0, 1, 13, 32, u32::MAX]),
        (COUNT, &[0, 1, 4, 6, 1_000_000, 1 << 31, u32::MAX]),
        (RESERVED, &[1, u32::MAX]),
        (BYTES, &[0, 63, 64, 1_000_000, u32::MAX]),
        (0, &[0, 1, u32::MAX]),
    ] {
        for number in numbers {
            assert_refuses(&KIND, &object, offset, &number.to_ne_bytes(), &format!("{offset}: {number}"));
        }
    }
}

/// Exponents that no tree of such a mean has, up to those beyond a double.
#[test]
fn exponents() {
    for object in [sparse(), object(2, 0, 0.0, |_| 3.0), object(2, 2, 0.0, |_| 0.0)] {
        let own = word(&object, EXPONENT) as i32;
        for exponent in [own + 1, own - 1, -1023, -1075, 1024, 5000, i32::MAX, i32::MIN] {
            // A black tree is black at any power of two.
            if word(&object, AVERAGE) != 0 || !(-1022..=1023).contains(&exponent) {
                assert_refuses(&KIND, &object, EXPONENT, &exponent.to_ne_bytes(), &format!("exponent {exponent}"));
            }
        }
    }
}

#[test]
fn links_that_are_no_tree() {
    let object = sparse();
    let start = links(&object).unwrap();
    for (offset, value, context) in NO_LINKS {
        assert_refuses(&KIND, &object, start + offset, &value.to_ne_bytes(), context);
    }
    let squares = word(&object, COUNT);
    for square in (0..squares).filter(|square| word(&object, start + 8 * *square as usize + 4) != 0) {
        for target in [0, square, squares, squares - 1] {
            let offset = start + 8 * square as usize;
            if word(&object, offset) != target {
                assert_refuses(&KIND, &object, offset, &target.to_ne_bytes(), &format!("{square} to {target}"));
            }
        }
    }
}
