//! The warp: exact vectors, the laws of sample, pdf and invert, and the batch against one point at a time.

use crate::stored;
use crate::stored::{EPS, Random, Stored, array, bits, cases, doubles, floats, integer, number};
use wis::status::Status;
use wis::wavelets::prune;
use wis::wavelets::tree::Tree;
use wis::wavelets::warp::{self, ONE_MINUS_EPSILON, Sample};

fn sample<const C: usize, const N: usize>(tree: &Tree<C>, u: [f32; N]) -> Sample<N> {
    warp::sample(tree, u).unwrap()
}

/// Corners and centres of the unit square, as math.md asks for: both ends of each coordinate.
fn edge_points<const N: usize>() -> Vec<[f32; N]> {
    let ends = [0.0, ONE_MINUS_EPSILON, 0.5, f32::from_bits(1), 1.0 / 16_777_216.0];
    let count = ends.len().pow(N as u32);
    (0..count).map(|i| std::array::from_fn(|axis| ends[i / ends.len().pow(axis as u32) % ends.len()])).collect()
}

fn points<const N: usize>(seed: u64, count: usize) -> Vec<[f32; N]> {
    let mut random = Random(seed);
    edge_points().into_iter().chain((0..count).map(|_| random.point())).collect()
}

fn check_vectors<const N: usize, const C: usize>(case: &serde_json::Value) {
    let depth = integer(&case["L"]);
    let stored = Stored::<C>::complete::<N>(depth, &floats(&case["image"]));
    for point in case["points"].as_array().unwrap() {
        let u = array::<N>(&doubles(&point["x"])).map(|x| (x / 16_777_216.0) as f32);
        let Sample { point: y, pdf } = sample(&stored.tree(), u);
        let cell = stored::pixel_of(y, depth);
        let expected: [f64; N] = array(&doubles(&point["cell"]));
        assert!(y.iter().all(|y| (0.0..1.0).contains(y)));
        assert!(stored.pixels::<N>()[stored::pixel_index(cell, depth)] > 0.0);
        if number(&point["margin"]) <= 1.0 / 1_048_576.0 {
            continue;
        }
        let axis_prob: [f64; N] = array(&doubles(&point["axis_prob"]));
        for axis in 0..N {
            assert_eq!(f64::from(cell[axis]), expected[axis], "{point}");
            let cells = f64::from(1u32 << depth);
            let offset = f64::from(y[axis]) * cells - f64::from(cell[axis]);
            let error = (offset - doubles(&point["offset"])[axis]).abs();
            assert!(error <= 16.0 * EPS / axis_prob[axis] + EPS * cells, "{point} {error}");
        }
        let least = axis_prob.iter().copied().fold(1.0, f64::min);
        let bound = (4.0 * N as f64 * f64::from(depth) + N as f64 / least) * EPS;
        let relative = (f64::from(pdf) / number(&point["pdf"]) - 1.0).abs();
        assert!(relative <= bound, "{point} {relative} {bound}");
    }
}

#[test]
fn points_are_those_of_the_vectors() {
    for case in cases("warp.json") {
        match integer(&case["n"]) {
            1 => check_vectors::<1, 2>(&case),
            2 => check_vectors::<2, 4>(&case),
            3 => check_vectors::<3, 8>(&case),
            4 => check_vectors::<4, 16>(&case),
            n => panic!("{n} axes"),
        }
    }
}

fn check_laws<const N: usize, const C: usize>(depth: u32, stored: &Stored<C>, seed: u64) {
    let tree = stored.tree();
    for u in points::<N>(seed, 2000) {
        let sampled = sample(&tree, u);
        let t = stored::pixel_of(sampled.point, depth);
        assert!(stored::value_at(&tree, t) > 0.0, "a cell of zero mass was entered");
        assert!(sampled.pdf > 0.0 && sampled.pdf.is_finite());
        assert_eq!(warp::pdf(&tree, sampled.point).to_bits(), sampled.pdf.to_bits());
        let back = warp::invert(&tree, sampled.point).unwrap();
        let probability = axis_probabilities::<C, N>(&tree, t);
        for axis in 0..N {
            let error = (f64::from(back[axis]) - f64::from(u[axis])).abs();
            let bound = EPS * (16.0 + f64::from(1u32 << depth) * probability[axis]);
            assert!(error <= bound, "u {u:?} back {back:?} error {error} bound {bound}");
            assert!((0.0..1.0).contains(&back[axis]));
        }
    }
}

/// The product of the split probabilities of each axis on the way to the finest cell `t`, in `f64`.
fn axis_probabilities<const C: usize, const N: usize>(tree: &Tree<C>, t: [u32; N]) -> [f64; N] {
    let mut probability = [1.0; N];
    let mut square = tree.root_square();
    for bit in (0..tree.depth()).rev() {
        let Some(here) = square else {
            return probability.map(|p| p / f64::from(1u32 << (bit + 1)));
        };
        let c = t.iter().fold(0, |c, t| 2 * c + ((t >> bit) & 1)) as usize;
        let mass = |axes: usize| {
            let inside = |other: &usize| other >> (N - axes) == c >> (N - axes);
            (0..C).filter(inside).map(|c| f64::from(tree.children(here)[c])).sum::<f64>()
        };
        for (axis, probability) in probability.iter_mut().enumerate() {
            *probability *= mass(axis + 1) / mass(axis);
        }
        square = tree.child_square(here, c as u32);
    }
    probability
}

fn check_laws_of_images<const N: usize, const C: usize>(depth: u32) {
    for seed in 0..4 {
        let image = Random(seed).image(1 << (N as u32 * depth));
        let complete = Stored::<C>::complete::<N>(depth, &image);
        check_laws::<N, C>(depth, &complete, seed);
        check_laws::<N, C>(depth, &complete.pruned(0.05).0, seed);
    }
}

#[test]
fn sample_pdf_and_invert_agree() {
    check_laws_of_images::<1, 2>(10);
    check_laws_of_images::<2, 4>(6);
    check_laws_of_images::<3, 8>(4);
    check_laws_of_images::<4, 16>(3);
}

fn check_batch<const N: usize, const C: usize>(depth: u32) {
    for (seed, budget) in [(1, 0.0), (2, 0.1), (3, 1e9)] {
        let stored = Stored::<C>::complete::<N>(depth, &Random(seed).image(1 << (N as u32 * depth))).pruned(budget).0;
        let input = points::<N>(seed, 3000);
        let mut batch = input.clone();
        let mut index: Vec<u32> = (0..batch.len() as u32).collect();
        warp::warp_in_place(&stored.tree(), &mut batch, &mut index).unwrap();
        for (point, i) in batch.iter().zip(&index) {
            assert_eq!(bits(*point), bits(sample(&stored.tree(), input[*i as usize]).point));
        }
        index.sort_unstable();
        assert!(index.into_iter().eq(0..batch.len() as u32));
    }
}

#[test]
fn a_batch_gives_the_points_of_single_samples() {
    check_batch::<1, 2>(9);
    check_batch::<2, 4>(5);
    check_batch::<3, 8>(3);
    check_batch::<4, 16>(2);
}

#[test]
fn a_batch_needs_an_index_for_each_point() {
    let stored = Stored::<4>::complete::<2>(1, &[1.0; 4]);
    let mut batch = [[0.25; 2]; 3];
    assert_eq!(warp::warp_in_place(&stored.tree(), &mut batch, &mut [0; 2]), Err(Status::InvalidArgument));
    let black = Stored::<4>::complete::<2>(1, &[0.0; 4]);
    assert_eq!(warp::warp_in_place(&black.tree(), &mut batch, &mut [0; 3]), Err(Status::ZeroDensity));
    assert_eq!(batch, [[0.25; 2]; 3]);
}

#[test]
fn lossless_pruning_changes_no_bit() {
    for seed in 0..20 {
        let complete = Stored::<4>::complete::<2>(6, &Random(seed).blocky::<2>(6));
        let sparse = complete.pruned(0.0).0;
        if complete.average == 0.0 {
            continue;
        }
        for u in points::<2>(seed, 2000) {
            let (a, b) = (sample(&complete.tree(), u), sample(&sparse.tree(), u));
            assert_eq!((bits(a.point), a.pdf.to_bits()), (bits(b.point), b.pdf.to_bits()));
            assert_eq!(
                warp::invert(&complete.tree(), a.point).map(bits),
                warp::invert(&sparse.tree(), a.point).map(bits)
            );
        }
    }
}

#[test]
fn scaling_by_powers_of_two_changes_no_bit() {
    let image = Random(5).image(1024);
    let stored = Stored::<4>::complete::<2>(5, &image);
    for exponent in [-100, -3, 1, 90] {
        let scaled: Vec<f32> = image.iter().map(|x| x * 2f32.powi(exponent)).collect();
        let other = Stored::<4>::complete::<2>(5, &scaled);
        assert_eq!(other.exponent, stored.exponent + exponent);
        assert_eq!((&other.squares, other.average), (&stored.squares, stored.average));
        let (a, b) = (other.pruned(0.01), stored.pruned(0.01));
        assert_eq!((a.0.squares, a.0.links, a.1), (b.0.squares, b.0.links, b.1));
    }
}

#[test]
fn the_density_integrates_to_one() {
    for budget in [0.0, 0.1] {
        let stored = Stored::<4>::complete::<2>(5, &Random(9).image(1024)).pruned(budget).0;
        let sum: f64 = stored::centres::<2>(5).map(|y| f64::from(warp::pdf(&stored.tree(), y))).sum();
        assert!((sum / 1024.0 - 1.0).abs() < 1e-6);
    }
}

/// Counts in the cells against the pdf: chi-square at the significance 1e-6. With 2^20 points and 255 degrees of
/// freedom it finds, with power .99, a fault that changes every other cell by 1.4 %.
#[test]
fn frequencies_follow_the_pdf() {
    use statrs::distribution::{ChiSquared, ContinuousCDF};
    let stored =
        Stored::<4>::complete::<2>(4, &Random(11).image(256).iter().map(|x| x.min(8.0) + 0.5).collect::<Vec<_>>());
    let mut counts = [0.0; 256];
    let mut random = Random(12);
    let total = 1 << 20;
    for _ in 0..total {
        counts[stored::pixel_index(stored::pixel_of(sample(&stored.tree(), random.point::<2>()).point, 4), 4)] += 1.0;
    }
    let expected = stored::centres::<2>(4).map(|y| f64::from(warp::pdf(&stored.tree(), y)) * f64::from(total) / 256.0);
    let statistic: f64 = expected.zip(counts).map(|(e, n)| (n - e) * (n - e) / e).sum();
    assert!(ChiSquared::new(255.0).unwrap().cdf(statistic) < 1.0 - 1e-6, "chi-square {statistic}");
}

/// A net stays well spread: every cell of 2^k equal masses gets its share within the discrepancy of the set.
#[test]
fn well_spread_points_stay_well_spread() {
    let stored = Stored::<4>::complete::<2>(5, &Random(13).image(1024));
    let cells = |points: &mut dyn Iterator<Item = [f32; 2]>| {
        let mut counts = [0.0; 16];
        points
            .for_each(|u| counts[stored::pixel_index(stored::pixel_of(sample(&stored.tree(), u).point, 2), 2)] += 1.0);
        counts
    };
    let mass: Vec<f64> = stored::centres::<2>(5).map(|y| f64::from(warp::pdf(&stored.tree(), y)) / 1024.0).collect();
    let mut share = [0.0; 16];
    mass.iter().enumerate().for_each(|(i, m)| share[(i / 32 / 8) * 4 + i % 32 / 8] += m);
    let counts = cells(&mut (0..1024).map(|i| wis::points::sobol(1, i)));
    let worst = counts.iter().zip(share).map(|(n, m)| (n / 1024.0 - m).abs()).fold(0.0, f64::max);
    assert!(worst < 0.012, "{worst}");
}

#[test]
fn coordinates_stay_in_their_cell() {
    for depth in 0..=12 {
        for t in [0, 1, (1u32 << depth) - 1] {
            for u in [0.0, f32::from_bits(1), 0.5, ONE_MINUS_EPSILON] {
                let y = warp::place(t.min((1 << depth) - 1), u, depth);
                assert_eq!(warp::locate(y, depth).0, t.min((1 << depth) - 1));
                assert!((0.0..1.0).contains(&y));
            }
        }
    }
}

#[test]
fn pruned_trees_keep_every_lit_texel_reachable() {
    let image = Random(23).image(4096);
    let stored = Stored::<4>::complete::<2>(6, &image);
    let mut savings = vec![0.0; stored.squares.len()];
    prune::plan(&stored.tree(), 0.5, &mut savings).unwrap();
    let pruned = stored.pruned(0.5).0;
    for (pixel, centre) in image.iter().zip(stored::centres::<2>(6)) {
        assert!(*pixel == 0.0 || warp::pdf(&pruned.tree(), centre) > 0.0);
    }
}
