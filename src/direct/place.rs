//! The numbers of a set of candidates, in the order of the candidates: systematic picks are then spread over directions (rule 39).

use super::group::Group;
use super::joint::{Points, Set};
use crate::points::sobol_points;
use crate::simd::{GROUP, Num, Whole};

/// The place of a candidate's pair of numbers among those that groups have room for: two and a half times as many as candidates.
#[inline(always)]
fn pair_of<W: Whole>(slot: W) -> W {
    const { assert!(2 * size_of::<Group>() == 5 * GROUP * size_of::<[f32; 2]>()) };
    let before = slot & W::splat(!(GROUP as u32 - 1));
    slot + before + before.shr::<1>()
}

/// Bit i of a number below 2^16 as bit 2 i.
#[inline(always)]
fn spread<W: Whole>(x: W) -> W {
    let x = (x | x.shl::<8>()) & W::splat(0x00ff_00ff);
    let x = (x | x.shl::<4>()) & W::splat(0x0f0f_0f0f);
    let x = (x | x.shl::<2>()) & W::splat(0x3333_3333);
    (x | x.shl::<1>()) & W::splat(0x5555_5555)
}

/// The bits of two numbers by turns, those of the first one lower.
#[inline(always)]
fn morton<W: Whole>(low: W, high: W) -> W {
    spread(low) | spread(high).shl::<1>()
}

/// Writes the numbers of sets in the order of their candidates: a (0, 2)-net has one point in each box of that order.
#[inline(always)]
pub fn place<F: Num, const SETS: usize>(points: &Points, sets: [(Set, &mut [Group]); SETS]) {
    for (set, out) in sets {
        place_set::<F>(points, set, out);
    }
}

/// The numbers of one set.
#[inline(always)]
fn place_set<F: Num>(points: &Points, set: Set, out: &mut [Group]) {
    let count = GROUP * out.len();
    let (seed, first) = points.set(set, count);
    let pairs = bytemuck::cast_slice_mut(out);
    let bits = count.trailing_zeros();
    let power = |bits: u32| (1u32 << (bits & 31)) as f32;
    let (all, columns, rows) = (power(bits), power(bits.div_ceil(2)), power(bits / 2));
    for group in (0..count as u32).step_by(F::WIDTH) {
        let [x, y] = sobol_points::<F>(seed, F::Whole::splat(first.wrapping_add(group)) + F::counted());
        let slot = if matches!(set, Set::Light) {
            (x * all).to_whole()
        } else {
            let (column, row) = ((x * columns).to_whole(), (y * rows).to_whole());
            // With an odd number of bits the first one is of the first number.
            if columns == rows { morton(row, column) } else { morton(column, row) }
        };
        F::scatter([x, y], pairs, pair_of(slot));
    }
}
