//! Trees: building, pruning to a budget, and what makes stored bytes invalid.

use crate::stored;
use crate::stored::{Random, Stored, cases, doubles, integer};
use wis::status::Status;
use wis::wavelets::tree::{self, Link, Tree};
use wis::wavelets::{morton, prune};

/// The cell whose Morton code is `code`.
fn decode<const N: usize>(code: u64, depth: u32) -> [u32; N] {
    let mut t = [0; N];
    let mut code = code;
    for bit in 0..depth {
        for t in t.iter_mut().rev() {
            *t |= ((code & 1) as u32).wrapping_shl(bit);
            code >>= 1;
        }
    }
    t
}

/// The average over a square of a C-order image: the naive way.
fn naive_average<const N: usize>(pixels: &[f32], depth: u32, level: u32, t: [u32; N]) -> f64 {
    let inside = |i: usize| {
        let cell = morton::c_order_cell::<N>(i, depth);
        (0..N).all(|axis| cell[axis] >> (depth - level) == t[axis])
    };
    let values: Vec<f64> = (0..pixels.len()).filter(|&i| inside(i)).map(|i| f64::from(pixels[i])).collect();
    values.iter().sum::<f64>() / values.len() as f64
}

fn check_averages<const N: usize, const C: usize>(depth: u32) {
    let pixels = Random(7).image(1 << (N as u32 * depth));
    let stored = Stored::<C>::complete::<N>(depth, &pixels);
    let scale = 2f64.powi(stored.exponent);
    for level in 0..depth {
        let first = tree::complete_len(C, level).unwrap();
        for m in 0..1u32 << (N as u32 * level) {
            for c in 0..C as u32 {
                let t = decode::<N>(u64::from(m * C as u32 + c), level + 1);
                let expected = naive_average(&pixels, depth, level + 1, t);
                let value = f64::from(stored.squares[first + m as usize][c as usize]) * scale;
                assert!((value - expected).abs() <= expected * stored::EPS, "{value} {expected}");
            }
        }
    }
    assert!((1.0..=2.0).contains(&stored.average));
}

#[test]
fn a_complete_tree_holds_the_averages() {
    check_averages::<1, 2>(5);
    check_averages::<2, 4>(3);
    check_averages::<3, 8>(2);
    check_averages::<4, 16>(2);
}

#[test]
fn morton_codes_invert() {
    let mut random = Random(1);
    for _ in 0..1000 {
        let t = std::array::from_fn::<u32, 3, _>(|_| (random.bits() >> 52) as u32);
        assert_eq!(decode::<3>(morton::encode(t, 12), 12), t);
    }
    assert_eq!(morton::encode([1, 0], 1), 2);
}

#[test]
fn complete_lengths() {
    assert_eq!(tree::complete_len(4, 0), Some(0));
    assert_eq!(tree::complete_len(4, 2), Some(5));
    assert_eq!(tree::complete_len(4, 12), Some(5_592_405));
    assert_eq!(tree::complete_len(16, 8), Some(286_331_153));
    assert_eq!(tree::complete_len(16, 9), None);
    assert_eq!(tree::complete_len(2, 13), None);
}

#[test]
fn normalising_is_exact_and_keeps_faint_texels() {
    let mut values = [3.0, 0.0, -0.0, 5.0];
    assert_eq!(tree::normalise(&mut values), 1);
    assert_eq!(values, [1.5, 0.0, 0.0, 2.5]);
    assert!(values[2].is_sign_positive());
    let mut faint = [f32::MAX, f32::MIN_POSITIVE / 8.0];
    tree::normalise(&mut faint);
    assert!(faint[1] > 0.0 && faint[0] / faint[1] < 4e19);
    let mut black = [0.0, -0.0];
    assert_eq!(tree::normalise(&mut black), 0);
}

#[test]
fn budget_zero_drops_constant_squares_only() {
    for seed in 0..20 {
        let pixels = Random(seed).blocky::<2>(5);
        let complete = Stored::<4>::complete::<2>(5, &pixels);
        let (sparse, pruning) = complete.pruned(0.0);
        assert_eq!(pruning.error, 0.0);
        assert!(sparse.squares.len() < complete.squares.len());
        assert_eq!(sparse.pixels::<2>(), complete.pixels::<2>());
        let parent =
            |s: usize, link: &Link| link.mask == 0 && sparse.squares[s].iter().all(|v| *v == sparse.squares[s][0]);
        assert!(!sparse.links.iter().enumerate().any(|(s, link)| parent(s, link)), "a constant square was kept");
    }
}

#[test]
fn the_faintest_difference_survives_budget_zero() {
    let mut pixels = vec![1.0; 4096];
    pixels[1234] = 1.0 + f32::EPSILON;
    let complete = Stored::<4>::complete::<2>(6, &pixels);
    let (sparse, pruning) = complete.pruned(0.0);
    assert_eq!(pruning.squares, 6);
    assert_eq!(sparse.pixels::<2>(), complete.pixels::<2>());
}

/// E[w^2] / total^2 - 1 of an estimate of the total that samples the stored density.
fn added_variance<const C: usize, const N: usize>(complete: &Stored<C>, stored: &Stored<C>) -> f64 {
    let (exact, kept) = (complete.pixels::<N>(), stored.pixels::<N>());
    let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / exact.len() as f64;
    let average = mean(&mut exact.iter().copied());
    let ratio = exact.iter().zip(&kept).map(|(e, k)| if *e > 0.0 { e * e / k } else { 0.0 });
    mean(&mut ratio.into_iter()) / average - 1.0
}

#[test]
fn pruning_adds_the_promised_variance() {
    for seed in 0..10 {
        let complete = Stored::<4>::complete::<2>(5, &Random(seed).image(1024));
        let mut fewer = u32::MAX;
        for budget in [1e-3, 1e-2, 0.1, 1.0, 1e9] {
            let (sparse, pruning) = complete.pruned(budget);
            let measured = added_variance::<4, 2>(&complete, &sparse);
            assert!(pruning.error <= budget && pruning.squares <= fewer);
            assert!((measured - pruning.error).abs() <= 1e-6 * (1.0 + measured), "{measured} {}", pruning.error);
            fewer = pruning.squares;
        }
        assert_eq!(fewer, 0);
    }
}

/// Every rooted set of whole squares of a tree of two levels, the naive way: no smaller one has as little error.
#[test]
fn no_smaller_tree_is_as_good() {
    for seed in 0..50 {
        let complete = Stored::<4>::complete::<2>(2, &Random(seed).image(16));
        let (_, pruning) = complete.pruned(0.2);
        for kept in 0u32..16 {
            let links: Vec<Link> = std::iter::once(Link { first: 1, mask: kept })
                .chain((0..kept.count_ones()).map(|_| Link::default()))
                .collect();
            let squares = std::iter::once(complete.squares[0])
                .chain((0..4).filter(|c| kept >> c & 1 == 1).map(|c| complete.squares[1 + c]))
                .collect();
            let other = Stored { squares, links, ..complete.clone() };
            let smaller = (other.squares.len() as u32) < pruning.squares;
            assert!(!smaller || added_variance::<4, 2>(&complete, &other) > pruning.error - 1e-6);
        }
    }
}

/// A bright spot in a dark square beside bright ones: collapsing that square costs more than collapsing the whole,
/// so a threshold on the costs would keep an orphan.
#[test]
fn costs_are_not_monotone_along_a_path() {
    let mut pixels = [[1.0f32; 4]; 4];
    pixels[0][..2].copy_from_slice(&[2.0, 0.0]);
    pixels[1][..2].copy_from_slice(&[0.0, 0.0]);
    let complete = Stored::<4>::complete::<2>(2, pixels.as_flattened());
    let constant = Stored { squares: vec![], links: vec![], ..complete.clone() };
    let root_only =
        Stored { squares: complete.squares[..1].to_vec(), links: vec![Link::default()], ..complete.clone() };
    let (whole, child) = (added_variance::<4, 2>(&complete, &constant), added_variance::<4, 2>(&complete, &root_only));
    assert!(whole < 0.31 && child > 0.42);
    assert_eq!(complete.pruned(0.35).1.squares, 0);
    assert_eq!(complete.pruned(0.3).1, prune::Pruning { squares: 2, error: 0.0 });
}

/// A rooted set of whole squares never gives a negative value, nor 0 where the function is not.
#[test]
fn truncation_of_whole_squares_keeps_the_sign() {
    for case in cases("estimator.json") {
        let depth = integer(&case["L"]);
        let stored = truncated(&Stored::complete::<2>(depth, &stored::floats(&case["f"])), &case["keep_squares"]);
        let rebuilt = stored.pixels::<2>();
        for ((h, expected), f) in rebuilt.iter().zip(doubles(&case["H"])).zip(doubles(&case["f"])) {
            assert!((h - expected).abs() <= 2.0 * stored::EPS * expected, "{h} {expected}");
            assert!(*h > 0.0 || f == 0.0);
        }
    }
}

/// Keeps those squares `[level, i, j]` of a complete tree whose ancestors are kept too.
fn truncated(complete: &Stored<4>, keep: &serde_json::Value) -> Stored<4> {
    let number = |row: &serde_json::Value| {
        let [level, i, j] = std::array::from_fn(|k| integer(&row[k]));
        tree::complete_len(4, level).unwrap() as usize + morton::encode([i, j], level) as usize
    };
    let mut savings = vec![-1.0; complete.squares.len()];
    let mut rooted = 0;
    for square in keep.as_array().unwrap().iter().map(number) {
        let kept = square == 0 || savings[(square - 1) / 4] > 0.0;
        savings[square] = if kept { 1.0 } else { -1.0 };
        rooted += usize::from(kept);
    }
    complete.keep(&savings, rooted)
}

/// Clarberg et al. 2005, Eq. 8 and 11: expectations of the two estimators when the truncated map is sampled.
#[test]
fn estimators_have_the_expected_values() {
    for case in cases("estimator.json") {
        let depth = integer(&case["L"]);
        let stored = truncated(&Stored::complete::<2>(depth, &stored::floats(&case["f"])), &case["keep_squares"]);
        let tree = stored.tree();
        let integral = f64::from(stored.average) * 2f64.powi(stored.exponent);
        let (mut eq8, mut eq11) = (0.0, 0.0);
        let area = 1.0 / (1u32 << (2 * depth)) as f64;
        let terms = doubles(&case["f"]).into_iter().zip(doubles(&case["visible"]));
        for ((f, visible), centre) in terms.zip(stored::centres::<2>(depth)) {
            let pdf = f64::from(wis::wavelets::warp::pdf(&tree, centre));
            eq8 += if pdf > 0.0 { area * pdf * (f * visible / pdf) } else { 0.0 };
            eq11 += area * pdf * integral * visible;
        }
        assert!((eq8 - stored::number(&case["expectation_eq8"])).abs() < 1e-7);
        assert!((eq8 - stored::number(&case["truth"])).abs() < 1e-7);
        assert!((eq11 - stored::number(&case["expectation_eq11"])).abs() < 1e-6 * eq11);
    }
}

#[test]
fn invalid_storage_is_rejected() {
    let square = [[1.0f32; 4]; 6];
    assert_eq!(Tree::complete(2, 1.0, &square).err(), Some(Status::InvalidArgument));
    assert_eq!(Tree::complete(13, 1.0, &square).err(), Some(Status::InvalidArgument));
    for bad in [f32::NAN, f32::INFINITY, -1.0, 2e36] {
        assert_eq!(Tree::complete(1, 1.0, &[[1.0, bad, 1.0, 1.0]]).err(), Some(Status::Corrupt));
        assert_eq!(Tree::complete(1, bad, &[[1.0; 4]]).err(), Some(Status::Corrupt));
    }
    let link = |first, mask| Link { first, mask };
    let valid = [link(1, 5), link(0, 0), link(3, 8), link(0, 0)];
    assert!(Tree::sparse(3, 1.0, &square[..4], &valid).is_ok());
    let wrong = [
        (3, vec![link(0, 5), link(0, 0), link(0, 0)]),
        (3, vec![link(1, 16), link(0, 0)]),
        (3, vec![link(1, 1)]),
        (3, vec![link(1, 1), link(1, 1)]),
        (3, vec![link(1, 3), link(3, 1), link(3, 1), link(0, 0)]),
        (3, vec![link(0, 0), link(0, 0)]),
        (1, vec![link(1, 1), link(0, 0)]),
        (0, vec![link(0, 0)]),
    ];
    for (depth, links) in wrong {
        assert_eq!(Tree::sparse(depth, 1.0, &square[..links.len()], &links).err(), Some(Status::Corrupt));
    }
    assert_eq!(Tree::sparse(3, 1.0, &square, &[]).err(), Some(Status::Corrupt));
    assert!(Tree::<4>::sparse(3, 1.0, &[], &[]).is_ok());
}

#[test]
fn planning_needs_matching_storage() {
    let stored = Stored::<4>::complete::<2>(2, &Random(3).image(16));
    let tree = stored.tree();
    assert_eq!(prune::plan(&tree, 0.1, &mut [0.0; 4]), Err(Status::InvalidArgument));
    assert_eq!(prune::plan(&tree, f64::NAN, &mut [0.0; 5]), Err(Status::InvalidArgument));
    let mut savings = [0.0; 5];
    let kept = prune::plan(&tree, 0.0, &mut savings).unwrap().squares as usize;
    for wrong in [0, kept - 1, kept + 1] {
        let (mut squares, mut links) = (vec![[0.0; 4]; wrong], vec![Link::default(); wrong]);
        assert_eq!(prune::write(&tree, &savings, &mut squares, &mut links), Err(Status::InvalidArgument));
    }
}
