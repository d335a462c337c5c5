//! The split rule: which side a point takes, and the way back.

use crate::stored::Random;
use wis::wavelets::split::{ONE_MINUS_EPSILON, Split, clamp_u};
use wis::wavelets::tree::Tree;
use wis::wavelets::warp;

#[test]
fn a_side_without_mass_is_never_entered() {
    for (lower, upper, side) in [(0.0, 1.0, 1), (1.0, 0.0, 0), (0.0, f32::from_bits(1), 1), (f32::from_bits(1), 0.0, 0)]
    {
        let split = Split::new(lower, upper);
        for u in [0.0, f32::from_bits(1), 0.5, ONE_MINUS_EPSILON] {
            assert_eq!(split.take(u), (side, u));
            assert_eq!(split.undo(side, u), u);
        }
        assert_eq!((split.density(side), split.density(1 - side)), (2.0, 0.0));
    }
}

#[test]
fn improbable_sides_keep_a_probability() {
    for (lower, upper) in [(1e-30, 1.0), (1.0, 1e-30), (f32::MIN_POSITIVE, 1e36), (1e36, f32::from_bits(1))] {
        let split = Split::new(lower, upper);
        assert!(split.density(0) >= 2.0 / 16_777_216.0 && split.density(1) >= 2.0 / 16_777_216.0);
        assert_eq!((split.take(0.0).0, split.take(ONE_MINUS_EPSILON).0), (0, 1));
    }
    assert_eq!(Split::new(0.0, 0.0), Split::new(3.0, 3.0));
}

/// The clamp is at 2^-24 on either side, and what lies inside of it keeps its own probability.
#[test]
fn probabilities_are_clamped_to_the_step_of_u() {
    const STEP: f32 = 1.0 / 16_777_216.0;
    for lower in [1e-30, 0.5 * STEP, STEP, 2.0 * STEP, 3.0 * STEP, 1e-4] {
        let probability = f32::max(lower / (lower + 1.0), STEP);
        assert_eq!(Split::new(lower, 1.0).density(0), 2.0 * probability, "{lower} of 1");
    }
    // Near 1 floats are 2^-24 apart, so only the clamped end is exact.
    assert_eq!(Split::new(1.0, 1e-30).density(1), 2.0 * STEP);
    assert_eq!(Split::new(1.0, 2.0 * STEP).density(1), 4.0 * STEP);
}

#[test]
fn undoing_a_split_stays_on_its_side() {
    let mut random = Random(17);
    for _ in 0..100_000 {
        let split = Split::new(random.texel(), random.texel());
        let u = if random.unit() < 0.1 { ONE_MINUS_EPSILON } else { random.unit() };
        for side in [0, 1] {
            if split.density(side) > 0.0 {
                let outer = split.undo(side, u);
                assert!((0.0..1.0).contains(&outer));
                assert_eq!(split.take(outer).0, side);
            }
        }
    }
}

#[test]
fn axis_one_splits_first() {
    let squares = [[1.0, 2.0, 0.0, 5.0]];
    let tree = Tree::<4>::complete(1, 2.0, &squares).unwrap();
    let sampled = warp::sample(&tree, [0.25, 0.5]).unwrap();
    assert_eq!(sampled.point, [0.5 * (0.25 / 0.375), 0.5 + 0.5 * ((0.5 - 1.0 / 3.0) / (1.0 - 1.0 / 3.0))]);
    assert_eq!(sampled.pdf, 4.0 * 0.375 * (1.0 - 1.0 / 3.0));
}

#[test]
fn u_outside_the_unit_interval_is_clamped() {
    for (u, clamped) in [
        (f32::NAN, 0.5),
        (-1.0, 0.0),
        (-0.0, 0.0),
        (1.0, ONE_MINUS_EPSILON),
        (f32::INFINITY, ONE_MINUS_EPSILON),
        (f32::NEG_INFINITY, 0.0),
        (0.25, 0.25),
    ] {
        assert_eq!(clamp_u(u).to_bits(), f32::to_bits(clamped));
    }
}
