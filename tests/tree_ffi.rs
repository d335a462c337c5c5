//! Trees and point sets through the C boundary: results, and what each wrong argument answers.

use crate::stored::{Random, Stored};
use crate::support::pixel_config as config;
use std::ffi::c_void;
use std::ptr::{null, null_mut};
use wis::ffi::points::*;
use wis::ffi::wavelets::tree::*;
use wis::ffi::{Diagnostic, MemorySize};
use wis::status::Status;
use wis::wavelets::inner;
use wis::wavelets::warp;

/// Memory as a client gives it: aligned to 16 bytes, not zero.
struct Memory(Vec<u128>);

impl Memory {
    fn new(bytes: usize) -> Memory {
        Memory(vec![u128::from_ne_bytes([0xa5; 16]); bytes.div_ceil(16)])
    }

    fn start(&mut self) -> *mut c_void {
        self.0.as_mut_ptr().cast()
    }
}

fn size(config: &TreeConfig) -> MemorySize {
    let mut size = MemorySize::default();
    assert_eq!(unsafe { wis_tree_size(config, &mut size, null_mut()) }, Status::Ok);
    size
}

struct Built {
    memory: Memory,
    info: TreeInfo,
}

impl Built {
    fn new(config: &TreeConfig) -> Built {
        let size = size(config);
        let (mut memory, mut scratch) = (Memory::new(size.bytes), Memory::new(size.scratch_bytes + 16));
        let mut tree = null();
        let mut info = TreeInfo { size: size_of::<TreeInfo>() as u32, ..TreeInfo::default() };
        let (start, work) = (memory.start(), scratch.start());
        let status = unsafe {
            wis_tree_init(config, start, size.bytes, work, size.scratch_bytes, &mut tree, &mut info, null_mut())
        };
        assert_eq!((status, tree.cast()), (Status::Ok, start.cast_const()));
        assert!(info.bytes as usize <= size.bytes);
        Built { memory, info }
    }

    fn tree(&mut self) -> *const Tree {
        self.memory.start().cast_const().cast()
    }

    fn bytes(&mut self) -> Vec<u8> {
        unsafe { std::slice::from_raw_parts(self.memory.start().cast::<u8>(), self.info.bytes as usize) }.to_vec()
    }

    fn sample<const N: usize>(&mut self, u: [f32; N]) -> ([f32; N], f32) {
        let (mut point, mut pdf) = ([f32::NAN; N], f32::NAN);
        let status = unsafe { wis_tree_sample(self.tree(), u.as_ptr(), point.as_mut_ptr(), &mut pdf) };
        assert_eq!(status, Status::Ok);
        (point, pdf)
    }
}

fn check_forwarding<const N: usize, const C: usize>(depth: u32) {
    let pixels = Random(depth.into()).image(1 << (N as u32 * depth));
    let expected = Stored::<C>::complete::<N>(depth, &pixels).pruned(0.01).0;
    let mut built = Built::new(&config(N as u32, depth, 0.01, &pixels));
    assert_eq!(built.info.squares as usize, expected.squares.len());
    let mean = pixels.iter().map(|&x| f64::from(x)).sum::<f64>() / pixels.len() as f64;
    assert!((built.info.average / mean - 1.0).abs() < 1e-12);
    let mut random = Random(1);
    let input: Vec<[f32; N]> = (0..200).map(|_| random.point()).collect();
    for &u in &input {
        let expected = warp::sample(&expected.tree(), u).unwrap();
        assert_eq!(built.sample(u), (expected.point, expected.pdf));
        let (mut pdf, mut back) = (0.0, [0.0; N]);
        unsafe {
            assert_eq!(wis_tree_pdf(built.tree(), expected.point.as_ptr(), &mut pdf), Status::Ok);
            assert_eq!(wis_tree_invert(built.tree(), expected.point.as_ptr(), back.as_mut_ptr()), Status::Ok);
        }
        assert_eq!(pdf.to_bits(), expected.pdf.to_bits());
        assert!((0..N).all(|axis| (back[axis] - u[axis]).abs() < 1e-4));
    }
    let (mut batch, mut index) = (input.clone(), (0..200).collect::<Vec<u32>>());
    let points = batch.as_flattened_mut().as_mut_ptr();
    assert_eq!(unsafe { wis_warp_in_place(built.tree(), points, index.as_mut_ptr(), 200, null_mut()) }, Status::Ok);
    for (point, i) in batch.iter().zip(index) {
        assert_eq!(*point, built.sample(input[i as usize]).0);
    }
}

#[test]
fn calls_forward_to_the_kernel() {
    check_forwarding::<1, 2>(8);
    check_forwarding::<2, 4>(5);
    check_forwarding::<3, 8>(3);
    check_forwarding::<4, 16>(2);
}

#[test]
fn the_same_image_gives_the_same_bytes() {
    let pixels = Random(3).image(256);
    let config = config(2, 4, 0.05, &pixels);
    let (mut a, mut b) = (Built::new(&config), Built::new(&config));
    assert_eq!(a.bytes(), b.bytes());
    assert_ne!(a.info.content_id, 0);
}

#[test]
fn degenerate_images() {
    let mut single = Built::new(&config(3, 0, 0.0, &[2.5]));
    assert_eq!((single.info.squares, single.info.average), (0, 2.5));
    assert_eq!(single.sample([0.25, 0.5, 0.0]), ([0.25, 0.5, 0.0], 1.0));
    let mut black = Built::new(&config(2, 3, 0.0, &[0.0; 64]));
    assert_eq!(black.sample([0.25, 0.5]), ([0.0; 2], 0.0));
    let mut u = [7.0; 2];
    unsafe {
        assert_eq!(wis_tree_invert(black.tree(), [0.5f32; 2].as_ptr(), u.as_mut_ptr()), Status::ZeroDensity);
        assert_eq!(wis_warp_in_place(black.tree(), u.as_mut_ptr(), &mut 0, 1, null_mut()), Status::ZeroDensity);
    }
    assert_eq!(u, [7.0; 2]);
}

#[test]
fn stored_bytes_open_anywhere_and_changed_bytes_do_not() {
    let pixels = Random(5).image(256);
    let mut built = Built::new(&config(2, 4, 0.01, &pixels));
    let bytes = built.bytes();
    let open = |bytes: &[u8], length: usize| {
        let mut copy = Memory::new(bytes.len());
        let start = copy.start();
        unsafe { start.cast::<u8>().copy_from(bytes.as_ptr(), bytes.len()) };
        let (mut tree, mut info) = (null(), TreeInfo { size: size_of::<TreeInfo>() as u32, ..TreeInfo::default() });
        let status = unsafe { wis_tree_open(start, length, &mut tree, &mut info, null_mut()) };
        assert_eq!(tree.is_null(), status != Status::Ok);
        (status, info.content_id)
    };
    assert_eq!(open(&bytes, bytes.len()), (Status::Ok, built.info.content_id));
    assert_eq!(open(&bytes, bytes.len() - 1).0, Status::MemoryTooSmall);
    assert_eq!(open(&bytes, 10).0, Status::MemoryTooSmall);
    let mut random = Random(6);
    for byte in (0..64).chain((64..bytes.len()).step_by(7)) {
        let mut changed = bytes.clone();
        changed[byte] ^= 1 << (random.bits() % 8);
        let reserved = (60..64).contains(&byte);
        let status = open(&changed, bytes.len()).0;
        assert!(reserved || matches!(status, Status::Corrupt | Status::MemoryTooSmall), "byte {byte}: {status:?}");
    }
}

#[test]
fn wrong_configurations_name_their_fault() {
    let pixels = [1.0f32; 16];
    let good = config(2, 2, 0.0, &pixels);
    let answer = |config: *const TreeConfig| {
        let (mut memory, mut scratch, mut tree) = (Memory::new(4096), Memory::new(4096), null());
        let mut diagnostic = Diagnostic::default();
        let (start, work) = (memory.start(), scratch.start());
        let status = unsafe { wis_tree_init(config, start, 4096, work, 4096, &mut tree, null_mut(), &mut diagnostic) };
        assert_eq!(tree.is_null(), status != Status::Ok);
        (status, diagnostic.argument, diagnostic.x, diagnostic.y)
    };
    assert_eq!(answer(&good), (Status::Ok, 0, 0, 0));
    assert_eq!(answer(null()), (Status::NullPointer, 1, 0, 0));
    assert_eq!(answer(&TreeConfig { size: 8, ..good }), (Status::InvalidStructSize, 1, 0, 0));
    for source in [6, u32::MAX] {
        assert_eq!(answer(&TreeConfig { source, ..good }), (Status::InvalidArgument, 1, 0, 0));
    }
    for dimensions in [0, 5, u32::MAX] {
        assert_eq!(answer(&TreeConfig { dimensions, ..good }), (Status::InvalidArgument, 1, 0, 0));
    }
    assert_eq!(answer(&TreeConfig { depth: 13, ..good }), (Status::InvalidArgument, 1, 0, 0));
    assert_eq!(answer(&TreeConfig { dimensions: 4, depth: 12, ..good }), (Status::Overflow, 1, 0, 0));
    for error_budget in [-0.1, f32::NAN] {
        assert_eq!(answer(&TreeConfig { error_budget, ..good }), (Status::InvalidArgument, 1, 0, 0));
    }
    assert_eq!(answer(&TreeConfig { pixels: null(), ..good }), (Status::NullPointer, 1, 0, 0));
    let misaligned = pixels.as_ptr().wrapping_byte_add(2);
    assert_eq!(answer(&TreeConfig { pixels: misaligned, ..good }), (Status::Misaligned, 1, 0, 0));
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0] {
        let mut pixels = pixels;
        pixels[6] = bad;
        assert_eq!(answer(&config(2, 2, 0.0, &pixels)), (Status::InvalidTexel, 1, 2, 1));
    }
}

#[test]
fn wrong_memory_names_its_fault() {
    let pixels = Random(7).image(16);
    let config = config(2, 2, 0.0, &pixels);
    let needed = size(&config);
    let (mut memory, mut scratch) = (Memory::new(4096), Memory::new(4096));
    let (start, work) = (memory.start(), scratch.start());
    let mut tree = null();
    let mut diagnostic = Diagnostic::default();
    let mut short_info = TreeInfo { size: 4, ..TreeInfo::default() };
    let mut init = |start: *mut c_void, bytes, work: *mut c_void, scratch_bytes, info: *mut TreeInfo| {
        let status =
            unsafe { wis_tree_init(&config, start, bytes, work, scratch_bytes, &mut tree, info, &mut diagnostic) };
        assert!(tree.is_null());
        (status, diagnostic.argument, diagnostic.bytes_needed)
    };
    let (bytes, scratch_bytes) = (needed.bytes, needed.scratch_bytes);
    assert_eq!(init(null_mut(), bytes, work, scratch_bytes, null_mut()).0, Status::NullPointer);
    assert_eq!(init(start, bytes, null_mut(), scratch_bytes, null_mut()).0, Status::NullPointer);
    assert_eq!(init(start.wrapping_byte_add(8), bytes, work, scratch_bytes, null_mut()).0, Status::Misaligned);
    let short = init(start, bytes - 1, work, scratch_bytes, null_mut());
    assert_eq!(short, (Status::MemoryTooSmall, 2, bytes as u64));
    let short = init(start, bytes, work, scratch_bytes - 1, null_mut());
    assert_eq!(short, (Status::MemoryTooSmall, 4, scratch_bytes as u64));
    assert_eq!(init(start, bytes, work, scratch_bytes, &mut short_info).0, Status::InvalidStructSize);
    let status =
        unsafe { wis_tree_init(&config, start, bytes, work, scratch_bytes, null_mut(), null_mut(), null_mut()) };
    assert_eq!(status, Status::NullPointer);
}

#[test]
fn queries_check_their_pointers() {
    let pixels = Random(9).image(16);
    let mut built = Built::new(&config(2, 2, 0.0, &pixels));
    let tree = built.tree();
    let (u, mut point, mut pdf) = ([0.5f32; 3], [3.0f32; 3], 3.0f32);
    let odd = u.as_ptr().wrapping_byte_add(1);
    unsafe {
        assert_eq!(wis_tree_sample(null(), u.as_ptr(), point.as_mut_ptr(), &mut pdf), Status::NullPointer);
        assert_eq!(wis_tree_sample(tree, null(), point.as_mut_ptr(), &mut pdf), Status::NullPointer);
        assert_eq!(wis_tree_sample(tree, odd, point.as_mut_ptr(), &mut pdf), Status::Misaligned);
        assert_eq!(wis_tree_sample(tree, u.as_ptr(), null_mut(), &mut pdf), Status::NullPointer);
        assert_eq!(wis_tree_sample(tree, u.as_ptr(), point.as_mut_ptr(), null_mut()), Status::NullPointer);
        assert_eq!(wis_tree_pdf(tree, odd, &mut pdf), Status::Misaligned);
        assert_eq!(wis_tree_pdf(tree, u.as_ptr(), null_mut()), Status::NullPointer);
        assert_eq!(wis_tree_invert(tree, null(), point.as_mut_ptr()), Status::NullPointer);
        assert_eq!(wis_warp_in_place(tree, null_mut(), null_mut(), 0, null_mut()), Status::Ok);
        assert_eq!(wis_warp_in_place(tree, null_mut(), null_mut(), 1, null_mut()), Status::NullPointer);
        assert_eq!(wis_warp_in_place(tree, point.as_mut_ptr(), null_mut(), 1, null_mut()), Status::NullPointer);
        assert_eq!(wis_warp_in_place(tree, point.as_mut_ptr(), &mut 0, usize::MAX, null_mut()), Status::Overflow);
        assert_eq!(wis_tree_product_integral(tree, null(), null_mut()), Status::NullPointer);
    }
    assert_eq!((point, pdf), ([3.0; 3], 3.0));
    let mut other = Memory::new(64);
    assert_eq!(unsafe { wis_tree_pdf(other.start().cast(), u.as_ptr(), &mut pdf) }, Status::Mismatch);
}

#[test]
fn products_of_trees_integrate() {
    let (e, f) = (Random(1).image(256), Random(2).image(16));
    let (mut a, mut b) = (Built::new(&config(2, 4, 0.0, &e)), Built::new(&config(1, 4, 0.0, &f)));
    let mut integral = 0.0;
    assert_eq!(unsafe { wis_tree_product_integral(a.tree(), b.tree(), &mut integral) }, Status::Ok);
    let expected = e.iter().enumerate().map(|(i, &e)| f64::from(e) * f64::from(f[i / 16])).sum::<f64>() / 256.0;
    assert!((integral / expected - 1.0).abs() < 1e-12);
    let (stored_e, stored_f) = (Stored::<4>::complete::<2>(4, &e), Stored::<2>::complete::<1>(4, &f));
    let scale = 2f64.powi(stored_e.exponent + stored_f.exponent);
    assert_eq!(inner::integral(&stored_e.tree(), &stored_f.tree()) * scale, integral);
    let status = unsafe { wis_tree_product_integral(b.tree(), a.tree(), &mut integral) };
    assert_eq!(status, Status::InvalidArgument);
}

#[test]
fn point_sets_come_at_any_stride() {
    let mut packed = [[0.0f32; 2]; 8];
    let mut spread = [[9.0f32; 3]; 8];
    unsafe {
        assert_eq!(wis_points_sobol(7, 100, 8, packed.as_flattened_mut().as_mut_ptr(), 0), Status::Ok);
        assert_eq!(wis_points_sobol(7, 100, 8, spread.as_flattened_mut().as_mut_ptr(), 12), Status::Ok);
    }
    for (i, (a, b)) in (100..).zip(packed.iter().zip(spread)) {
        assert_eq!((*a, b), (wis::points::sobol(7, i), [a[0], a[1], 9.0]));
    }
    let start = packed.as_flattened_mut().as_mut_ptr();
    unsafe {
        assert_eq!(wis_points_hammersley(2, 3, 5, start, 0), Status::Ok);
        assert_eq!(wis_points_hammersley(3, 3, 5, start, 0), Status::InvalidArgument);
        assert_eq!(wis_points_hammersley(u32::MAX, 2, u32::MAX, start, 0), Status::InvalidArgument);
        assert_eq!(wis_points_hammersley(0, 1, 5, null_mut(), 0), Status::NullPointer);
        assert_eq!(wis_points_sobol(0, 0, 1, start.wrapping_byte_add(2), 0), Status::Misaligned);
        assert_eq!(wis_points_sobol(0, 0, 2, start, 4), Status::InvalidArgument);
        assert_eq!(wis_points_sobol(0, 0, 2, start, 9), Status::Misaligned);
        assert_eq!(wis_points_sobol(0, u32::MAX, 1, start, 0), Status::Ok);
        assert_eq!(wis_points_sobol(0, u32::MAX, 2, start, 0), Status::Overflow);
        assert_eq!(wis_points_sobol(0, 0, 0, null_mut(), 0), Status::Ok);
    }
    assert_eq!(packed[0], wis::points::sobol(0, u32::MAX));
    assert_eq!(wis_pixel_seed(1, 2, 3), wis::points::pixel_seed(1, 2, 3));
}
