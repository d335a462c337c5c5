//! The Haar transform against its vectors, its inverse and its norm.

use crate::stored;
use crate::stored::{Random, cases, doubles, integer, number};
use wis::status::Status;
use wis::wavelets::haar;

fn coefficient_index<const N: usize>(depth: u32, level: u32, t: [u32; N], f: usize) -> usize {
    let slot = |axis: usize| (2 * t[axis] + ((f >> (N - 1 - axis)) & 1) as u32) << (depth - 1 - level);
    stored::pixel_index::<N>(std::array::from_fn(slot), depth)
}

fn check_case<const N: usize, const C: usize>(case: &serde_json::Value) {
    let depth = integer(&case["L"]);
    let pixels = doubles(&case["pixels"]);
    let mut values = pixels.clone();
    haar::forward::<N, C>(depth, &mut values).unwrap();
    assert!((values[0] - number(&case["scale"])).abs() < 1e-12);
    for level in 0..depth {
        for (i, expected) in doubles(&case["det"][level as usize]).into_iter().enumerate().filter(|(i, _)| i % C != 0) {
            let t = wis::wavelets::morton::c_order_cell::<N>(i / C, level);
            let value = values[coefficient_index(depth, level, t, i % C)];
            assert!((value - expected).abs() < 1e-12, "n {N} level {level} entry {i}: {value} {expected}");
        }
    }
    haar::inverse::<N, C>(depth, &mut values).unwrap();
    assert!(values.iter().zip(&pixels).all(|(a, b)| (a - b).abs() < 1e-12));
}

#[test]
fn coefficients_are_those_of_the_vectors() {
    for case in cases("haar.json") {
        match integer(&case["n"]) {
            1 => check_case::<1, 2>(&case),
            2 => check_case::<2, 4>(&case),
            3 => check_case::<3, 8>(&case),
            4 => check_case::<4, 16>(&case),
            n => panic!("{n} axes"),
        }
    }
}

fn check_norm<const N: usize, const C: usize>(depth: u32) {
    let mut random = Random(u64::from(depth));
    let pixels: Vec<f64> = (0..1 << (N as u32 * depth)).map(|_| f64::from(random.unit()) - 0.5).collect();
    let mut values = pixels.clone();
    haar::forward::<N, C>(depth, &mut values).unwrap();
    let square = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>();
    let mean_square = square(&pixels) / pixels.len() as f64;
    assert!((square(&values) / mean_square - 1.0).abs() < 1e-13, "Parseval, n = {N}");
    haar::inverse::<N, C>(depth, &mut values).unwrap();
    assert!(values.iter().zip(&pixels).all(|(a, b)| (a - b).abs() < 1e-14));
}

#[test]
fn the_transform_is_orthonormal_and_inverts() {
    (0..=12).for_each(check_norm::<1, 2>);
    (0..=8).for_each(check_norm::<2, 4>);
    (0..=5).for_each(check_norm::<3, 8>);
    (0..=4).for_each(check_norm::<4, 16>);
}

#[test]
fn value_space_details_rebuild_the_children() {
    let children = [3.0, 0.0, 5.0, 8.0];
    let details = haar::analyse(children);
    assert_eq!(details, [4.0, 0.0, -2.5, 1.5]);
    assert_eq!(haar::synthesise(details), children);
}

/// Free thresholding makes negative texels; whole rooted squares do not (tests/tree.rs).
#[test]
fn dropping_single_coefficients_makes_negative_texels() {
    let cases = stored::vectors("hard.json")["negative_reconstruction"].as_array().unwrap().clone();
    for case in cases {
        let mut values = doubles(&case["image"]);
        let depth = values.len().ilog2() / 2;
        haar::forward::<2, 4>(depth, &mut values).unwrap();
        for dropped in case["dropped"].as_array().unwrap() {
            let [level, i, j, f] = std::array::from_fn(|k| integer(&dropped[k]));
            values[coefficient_index(depth, level, [i, j], f as usize)] = 0.0;
        }
        haar::inverse::<2, 4>(depth, &mut values).unwrap();
        assert_eq!(values, doubles(&case["reconstruction"]));
        assert!(values.iter().any(|&v| v < 0.0));
    }
}

#[test]
fn wrong_lengths_are_rejected() {
    assert_eq!(haar::forward::<2, 4>(2, &mut [0.0; 15]), Err(Status::InvalidArgument));
    assert_eq!(haar::inverse::<2, 4>(13, &mut [0.0; 16]), Err(Status::InvalidArgument));
    assert_eq!(haar::forward::<4, 16>(u32::MAX, &mut [0.0; 16]), Err(Status::InvalidArgument));
}
