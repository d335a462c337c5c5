//! Products of two stored trees: exact averages against vectors and against the naive product of the pixels.

use crate::stored;
use crate::stored::{EPS, Random, Stored, array, bits, cases, doubles, floats, integer, number};
use wis::status::Status;
use wis::wavelets::inner::{self, Product};
use wis::wavelets::warp::{self, ONE_MINUS_EPSILON};
use wis::wavelets::{morton, tree};

/// The product of E (`N` axes) with F on its first axes, pixel by pixel: the naive way.
fn naive_product<const N: usize, const K: usize>(depth: u32, e: &[f64], f: &[f64]) -> Vec<f64> {
    let below = depth * (N - K) as u32;
    e.iter().enumerate().map(|(i, e)| e * f[i >> below]).collect()
}

/// The factor that normalising both trees took out.
fn scale<const C: usize, const M: usize>(e: &Stored<C>, f: &Stored<M>) -> f64 {
    2f64.powi(e.exponent) * 2f64.powi(f.exponent)
}

/// The averages of the product of two images on every square of E, in heap order.
fn product_averages<const N: usize, const C: usize, const K: usize, const M: usize>(
    depth: u32,
    e: &[f32],
    f: &[f32],
) -> Vec<f64> {
    let (e, f) = (Stored::<C>::complete::<N>(depth, e), Stored::<M>::complete::<K>(depth, f));
    let mut averages = vec![0.0; e.squares.len()];
    let total = Product::new(e.tree(), f.tree(), &mut averages).unwrap().average();
    assert_eq!(inner::integral(&e.tree(), &f.tree()), total);
    assert_eq!(averages[0], total);
    averages.iter().map(|average| average * scale(&e, &f)).collect()
}

/// Trees hold no negative values, so images that have some are split into two; products are bilinear.
fn check_averages<const N: usize, const C: usize, const K: usize, const M: usize>(case: &serde_json::Value) {
    let depth = integer(&case["L"]);
    let part = |image: &str, sign: f32| floats(&case[image]).iter().map(|x| (sign * x).max(0.0)).collect::<Vec<_>>();
    let first = |level| tree::complete_len::<C>(level).unwrap() as usize;
    let (mut signed, mut absolute) = (vec![0.0; first(depth)], vec![0.0; first(depth)]);
    for (e_sign, f_sign) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        let averages = product_averages::<N, C, K, M>(depth, &part("E", e_sign), &part("F", f_sign));
        for (square, average) in averages.into_iter().enumerate() {
            signed[square] += f64::from(e_sign * f_sign) * average;
            absolute[square] += average;
        }
    }
    for level in 0..depth {
        for (i, expected) in doubles(&case["averages"][level as usize]).into_iter().enumerate() {
            let code = morton::encode(morton::c_order_cell::<N>(i, level), level) as usize;
            let error = (signed[first(level) + code] - expected).abs();
            assert!(error <= 3.0 * EPS * absolute[first(level) + code], "level {level} square {i}: {error}");
        }
    }
}

#[test]
fn averages_are_those_of_the_vectors() {
    for case in cases("product.json") {
        match (integer(&case["n"]), integer(&case["m"])) {
            (1, 1) => check_averages::<1, 2, 1, 2>(&case),
            (2, 1) => check_averages::<2, 4, 1, 2>(&case),
            (2, 2) => check_averages::<2, 4, 2, 4>(&case),
            (3, 2) => check_averages::<3, 8, 2, 4>(&case),
            (3, 3) => check_averages::<3, 8, 3, 8>(&case),
            (4, 2) => check_averages::<4, 16, 2, 4>(&case),
            (4, 4) => check_averages::<4, 16, 4, 16>(&case),
            axes => panic!("{axes:?}"),
        }
    }
}

fn check_points<const N: usize, const C: usize, const K: usize, const M: usize>(case: &serde_json::Value) {
    let depth = integer(&case["L"]);
    let e = Stored::<C>::complete::<N>(depth, &floats(&case["E"]));
    let f = Stored::<M>::complete::<K>(depth, &floats(&case["F"]));
    let mut averages = vec![0.0; e.squares.len()];
    let product = Product::new(e.tree(), f.tree(), &mut averages).unwrap();
    let integral = number(&case["integral"]);
    assert!((product.average() * scale(&e, &f) / integral - 1.0).abs() < 1e-14);
    for point in case["points"].as_array().unwrap() {
        let u = array::<N>(&doubles(&point["x"])).map(|x| (x / 16_777_216.0) as f32);
        let sampled = warp::sample(&product, u).unwrap();
        let cell = stored::pixel_of(sampled.point, depth);
        if number(&point["margin"]) <= 1.0 / 1_048_576.0 {
            continue;
        }
        let axis_prob: [f64; N] = array(&doubles(&point["axis_prob"]));
        for axis in 0..N {
            assert_eq!(f64::from(cell[axis]), doubles(&point["cell"])[axis]);
            let cells = f64::from(1u32 << depth);
            let error =
                f64::from(sampled.point[axis]) * cells - f64::from(cell[axis]) - doubles(&point["offset"])[axis];
            assert!(error.abs() <= 16.0 * EPS / axis_prob[axis] + EPS * cells, "{point} {error}");
        }
        let least = axis_prob.iter().copied().fold(1.0, f64::min);
        let bound = (4.0 * N as f64 * f64::from(depth) + N as f64 / least) * EPS;
        assert!((f64::from(sampled.pdf) / number(&point["pdf"]) - 1.0).abs() <= bound);
    }
}

#[test]
fn points_of_the_product_are_those_of_the_vectors() {
    for case in cases("warp_product.json") {
        match (integer(&case["n"]), integer(&case["m"])) {
            (1, 1) => check_points::<1, 2, 1, 2>(&case),
            (2, 1) => check_points::<2, 4, 1, 2>(&case),
            (2, 2) => check_points::<2, 4, 2, 4>(&case),
            (3, 2) => check_points::<3, 8, 2, 4>(&case),
            (4, 2) => check_points::<4, 16, 2, 4>(&case),
            axes => panic!("{axes:?}"),
        }
    }
}

/// The product as one complete tree of its pixels.
fn naive_tree<const N: usize, const C: usize, const K: usize>(depth: u32, e: &[f64], f: &[f64]) -> Stored<C> {
    let pixels: Vec<f32> = naive_product::<N, K>(depth, e, f).iter().map(|&x| x as f32).collect();
    Stored::complete::<N>(depth, &pixels)
}

fn check_laws<const N: usize, const C: usize, const K: usize, const M: usize>(depth: u32, budgets: [f64; 2]) {
    for seed in 0..6 {
        let mut random = Random(seed);
        let e = Stored::<C>::complete::<N>(depth, &random.blocky::<N>(depth)).pruned(budgets[0]).0;
        let f = Stored::<M>::complete::<K>(depth, &random.blocky::<K>(depth)).pruned(budgets[1]).0;
        let naive = naive_tree::<N, C, K>(depth, &e.pixels::<N>(), &f.pixels::<K>());
        let mut averages = vec![0.0; e.squares.len()];
        let product = Product::new(e.tree(), f.tree(), &mut averages).unwrap();
        let mean: f64 = naive.pixels::<N>().iter().sum::<f64>() / (1u64 << (N as u32 * depth)) as f64;
        assert!((product.average() * scale(&e, &f) - mean).abs() <= 2.0 * EPS * mean);
        let mut total = 0.0;
        for y in stored::centres::<N>(depth) {
            let (pdf, expected) = (f64::from(warp::pdf(&product, y)), f64::from(warp::pdf(&naive.tree(), y)));
            assert_eq!(pdf > 0.0, expected > 0.0);
            total += pdf;
        }
        if mean == 0.0 {
            assert!(warp::sample(&product, [0.5; N]).is_none());
            continue;
        }
        assert!((total / (1u64 << (N as u32 * depth)) as f64 - 1.0).abs() < 1e-6);
        for _ in 0..500 {
            let u = random.point::<N>();
            let sampled = warp::sample(&product, u).unwrap();
            assert!(warp::pdf(&naive.tree(), sampled.point) > 0.0);
            assert_eq!(warp::pdf(&product, sampled.point).to_bits(), sampled.pdf.to_bits());
            let back = warp::invert(&product, sampled.point).unwrap();
            let bound = EPS * (16.0 + f64::from(1u32 << depth));
            assert!((0..N).all(|axis| (f64::from(back[axis]) - f64::from(u[axis])).abs() <= bound));
        }
    }
}

#[test]
fn products_of_sparse_trees_are_exact() {
    for budgets in [[0.0, 0.0], [0.1, 0.0], [0.0, 0.3], [1e9, 0.0], [0.0, 1e9]] {
        check_laws::<1, 2, 1, 2>(6, budgets);
        check_laws::<2, 4, 2, 4>(4, budgets);
        check_laws::<2, 4, 1, 2>(4, budgets);
        check_laws::<3, 8, 2, 4>(3, budgets);
        check_laws::<4, 16, 2, 4>(2, budgets);
    }
}

#[test]
fn batches_of_a_product_equal_single_samples() {
    let e = Stored::<4>::complete::<2>(5, &Random(1).image(1024)).pruned(0.02).0;
    let f = Stored::<4>::complete::<2>(5, &Random(2).image(1024)).pruned(0.1).0;
    let mut averages = vec![0.0; e.squares.len()];
    let product = Product::new(e.tree(), f.tree(), &mut averages).unwrap();
    let input: Vec<[f32; 2]> = (0..1000).map(|i| wis::points::hammersley(i, 1000)).collect();
    let (mut batch, mut index) = (input.clone(), (0..1000).collect::<Vec<u32>>());
    warp::warp_in_place(&product, &mut batch, &mut index).unwrap();
    for (point, i) in batch.iter().zip(index) {
        assert_eq!(bits(*point), bits(warp::sample(&product, input[i as usize]).unwrap().point));
    }
}

#[test]
fn complementary_checkerboards_have_no_product() {
    let board = |parity: u16| (0..64u16).map(|i| f32::from((i / 8 + i % 8 + parity) % 2)).collect::<Vec<_>>();
    let e = Stored::<4>::complete::<2>(3, &board(0));
    let f = Stored::<4>::complete::<2>(3, &board(1));
    let mut averages = vec![0.0; e.squares.len()];
    let product = Product::new(e.tree(), f.tree(), &mut averages).unwrap();
    assert_eq!(product.average(), 0.0);
    assert_eq!(warp::sample(&product, [0.5; 2]), None);
    assert_eq!(warp::pdf(&product, [0.1; 2]), 0.0);
    assert_eq!(warp::invert(&product, [0.1; 2]), Err(Status::ZeroDensity));
}

#[test]
fn extreme_ranges_neither_overflow_nor_underflow() {
    let mut random = Random(3);
    let image = |random: &mut Random| (0..64).map(|_| 10f32.powf(60.0 * random.unit() - 30.0)).collect::<Vec<_>>();
    let e = Stored::<4>::complete::<2>(3, &image(&mut random));
    let f = Stored::<4>::complete::<2>(3, &image(&mut random));
    let mut averages = vec![0.0; e.squares.len()];
    let product = Product::new(e.tree(), f.tree(), &mut averages).unwrap();
    for u in [[0.0; 2], [ONE_MINUS_EPSILON; 2], [0.5; 2], [0.0, ONE_MINUS_EPSILON]] {
        let sampled = warp::sample(&product, u).unwrap();
        assert!(sampled.pdf > 0.0 && sampled.pdf.is_finite());
        assert_eq!(warp::pdf(&product, sampled.point).to_bits(), sampled.pdf.to_bits());
    }
    for y in stored::centres::<2>(3) {
        assert!(warp::pdf(&product, y) > 0.0);
    }
}

#[test]
fn averages_need_one_entry_per_square() {
    let e = Stored::<4>::complete::<2>(2, &Random(4).image(16));
    assert_eq!(Product::new(e.tree(), e.tree(), &mut [0.0; 4]).err(), Some(Status::InvalidArgument));
}
