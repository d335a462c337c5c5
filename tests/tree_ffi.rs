//! Trees and point sets through the C boundary are those of the kernel. What each wrong argument answers: tests/arguments.

use crate::stored::{Random, Stored};
use crate::support::{BuiltTree, pixel_config as config};
use std::ptr::null_mut;
use wis::ffi::points::*;
use wis::ffi::wavelets::tree::*;
use wis::status::Status;
use wis::wavelets::combine;
use wis::wavelets::warp;

fn sample<const N: usize>(tree: &BuiltTree, u: [f32; N]) -> ([f32; N], f32) {
    let (mut point, mut pdf) = ([f32::NAN; N], f32::NAN);
    let status = unsafe { wis_tree_sample(tree.handle, u.as_ptr(), point.as_mut_ptr(), &mut pdf) };
    assert_eq!(status, Status::Ok);
    (point, pdf)
}

fn check_forwarding<const N: usize, const C: usize>(depth: u32) {
    let pixels = Random(depth.into()).image(1 << (N as u32 * depth));
    let expected = Stored::<C>::complete::<N>(depth, &pixels).pruned(0.01).0;
    let built = BuiltTree::new(&config(N as u32, depth, 0.01, &pixels)).unwrap();
    assert_eq!(built.info.squares as usize, expected.squares.len());
    let mean = pixels.iter().map(|&x| f64::from(x)).sum::<f64>() / pixels.len() as f64;
    assert!((built.info.average / mean - 1.0).abs() < 1e-12);
    let mut random = Random(1);
    let input: Vec<[f32; N]> = (0..200).map(|_| random.point()).collect();
    for &u in &input {
        let expected = warp::sample(&expected.tree(), u).unwrap();
        assert_eq!(sample(&built, u), (expected.point, expected.pdf));
        let (mut pdf, mut back) = (0.0, [0.0; N]);
        unsafe {
            assert_eq!(wis_tree_pdf(built.handle, expected.point.as_ptr(), &mut pdf), Status::Ok);
            assert_eq!(wis_tree_invert(built.handle, expected.point.as_ptr(), back.as_mut_ptr()), Status::Ok);
        }
        assert_eq!(pdf.to_bits(), expected.pdf.to_bits());
        assert!((0..N).all(|axis| (back[axis] - u[axis]).abs() < 1e-4));
    }
    let (mut batch, mut index) = (input.clone(), (0..200).collect::<Vec<u32>>());
    let points = batch.as_flattened_mut().as_mut_ptr();
    assert_eq!(unsafe { wis_warp_in_place(built.handle, points, index.as_mut_ptr(), 200, null_mut()) }, Status::Ok);
    for (point, i) in batch.iter().zip(index) {
        assert_eq!(*point, sample(&built, input[i as usize]).0);
    }
}

#[test]
fn calls_forward_to_the_kernel() {
    check_forwarding::<2, 4>(5);
    check_forwarding::<4, 16>(2);
}

#[test]
fn the_same_image_gives_the_same_bytes() {
    let pixels = Random(3).image(256);
    let config = config(2, 4, 0.05, &pixels);
    let (a, b) = (BuiltTree::new(&config).unwrap(), BuiltTree::new(&config).unwrap());
    let [a, b] = [a, b].map(|tree| (tree.memory.bytes()[..tree.info.bytes as usize].to_vec(), tree.info));
    assert_eq!(a.0, b.0);
    assert!(a.1.content_id != 0 && a.1.content_id.to_ne_bytes() == a.0[16..24]);
}

#[test]
fn degenerate_images() {
    let single = BuiltTree::new(&config(4, 0, 0.0, &[2.5])).unwrap();
    assert_eq!((single.info.squares, single.info.average), (0, 2.5));
    assert_eq!(sample(&single, [0.25, 0.5, 0.0, 0.75]), ([0.25, 0.5, 0.0, 0.75], 1.0));
    let black = BuiltTree::new(&config(2, 3, 0.0, &[0.0; 64])).unwrap();
    assert_eq!(sample(&black, [0.25, 0.5]), ([0.0; 2], 0.0));
    let mut u = [7.0; 2];
    unsafe {
        assert_eq!(wis_tree_invert(black.handle, [0.5f32; 2].as_ptr(), u.as_mut_ptr()), Status::ZeroDensity);
        assert_eq!(wis_warp_in_place(black.handle, u.as_mut_ptr(), &mut 0, 1, null_mut()), Status::ZeroDensity);
    }
    assert_eq!(u, [7.0; 2]);
}

#[test]
fn products_of_trees_integrate() {
    let (e, f) = (Random(1).image(256), Random(2).image(16));
    let (a, b) = (BuiltTree::new(&config(4, 2, 0.0, &e)).unwrap(), BuiltTree::new(&config(2, 2, 0.0, &f)).unwrap());
    let mut integral = 0.0;
    assert_eq!(unsafe { wis_tree_product_integral(a.handle, b.handle, &mut integral) }, Status::Ok);
    let expected = e.iter().enumerate().map(|(i, &e)| f64::from(e) * f64::from(f[i / 16])).sum::<f64>() / 256.0;
    assert!((integral / expected - 1.0).abs() < 1e-12);
    let (stored_e, stored_f) = (Stored::<16>::complete::<4>(2, &e), Stored::<4>::complete::<2>(2, &f));
    let scale = 2f64.powi(stored_e.exponent + stored_f.exponent);
    assert_eq!(combine::integral(&stored_e.tree(), &stored_f.tree()) * scale, integral);
    let status = unsafe { wis_tree_product_integral(b.handle, a.handle, &mut integral) };
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
    assert_eq!(unsafe { wis_points_sobol(0, u32::MAX, 1, start, 0) }, Status::Ok);
    assert_eq!(packed[0], wis::points::sobol(0, u32::MAX));
}
