//! The split rule of [`crate::wavelets::split`] in eight lanes, bit for bit.

use crate::numeric::ONE_MINUS_EPSILON;
use crate::wavelets::lanes::{LANES, Lanes};
use crate::wavelets::split::SMALLEST_SPLIT;

/// Every lane.
pub const ALL: u32 = (1 << LANES) - 1;

/// The probabilities of the lower sides of splits by two masses.
#[inline(always)]
fn lower_side<F: Lanes>(lower: F, upper: F) -> F {
    let (zero, smallest, largest) = (F::splat(0.0), F::splat(SMALLEST_SPLIT), F::splat(ONE_MINUS_EPSILON));
    let ratio = lower / (lower + upper);
    let ordinary = F::and(smallest.le(ratio), ratio.le(largest));
    if F::bits(ordinary) == ALL {
        return ratio;
    }
    let (has_lower, has_upper) = (zero.lt(lower), zero.lt(upper));
    let both = F::select(lower.lt(upper), smallest, largest);
    let only_lower = F::select(has_lower, F::splat(1.0), F::splat(0.5));
    let extreme = F::select(has_upper, F::select(has_lower, both, zero), only_lower);
    F::select(ordinary, ratio, extreme)
}

/// The probability of a side.
#[inline(always)]
fn probability<F: Lanes>(lower: F, side: F::Mask) -> F {
    (F::unit(side) - lower).abs()
}

/// The side that `u` falls into, its position inside that side, and the side's probability.
#[inline(always)]
fn take<F: Lanes>(lower: F, u: F) -> (F::Mask, F, F) {
    let side = lower.le(u);
    let offset = u - F::only(side, lower);
    let probability = probability(lower, side);
    (side, (offset / probability).min(F::splat(ONE_MINUS_EPSILON)), probability)
}

/// The factor by which a side of this probability multiplies the density.
#[inline(always)]
fn twice<F: Lanes>(probability: F) -> F {
    probability + probability
}

/// Sends points of squares into their children: the sides along both axes, the points inside, and the factor of the
/// density.
#[inline(always)]
pub fn take_quad<F: Lanes>(masses: [F; 4], u: [F; 2]) -> ([F::Mask; 2], [F; 2], F) {
    let [m0, m1, m2, m3] = masses;
    let first = lower_side(m0 + m1, m2 + m3);
    let (b1, v, p) = take(first, u[0]);
    let second = lower_side(F::select(b1, m2, m0), F::select(b1, m3, m1));
    let (b2, w, q) = take(second, u[1]);
    ([b1, b2], [v, w], twice(p) * twice(q))
}

/// The factor by which the two splits that lead to a child multiply the density.
#[inline(always)]
pub fn quad_density<F: Lanes>(masses: [F; 4], [b1, b2]: [F::Mask; 2]) -> F {
    let [m0, m1, m2, m3] = masses;
    let first = lower_side(m0 + m1, m2 + m3);
    let second = lower_side(F::select(b1, m2, m0), F::select(b1, m3, m1));
    twice(probability(first, b1)) * twice(probability(second, b2))
}
