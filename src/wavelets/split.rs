//! The one split rule: how two masses divide a coordinate, and how the splits of a square lead to its children.
//!
//! Clarberg et al. 2005, "Wavelet Importance Sampling", Section 4.2. Sample, pdf and invert of the whole library
//! decide by it, so that they agree to the bit.

use crate::numeric::min;
pub use crate::numeric::{ONE_MINUS_EPSILON, clamp_u};

/// No side that has mass is less probable than this, or a 24-bit u of 0 would enter it too often: the clamp
/// makes the probability of such a side the one that it is really sampled with.
pub(crate) const SMALLEST_SPLIT: f32 = 1.0 / 16_777_216.0;

/// The probabilities of the two halves of a split.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Split {
    lower: f32,
}

impl Split {
    /// Splits by two masses, each in [0, 2^120]. Both positive: the lower half has the probability
    /// lower / (lower + upper), clamped to [2^-24, 1 - 2^-24]; one of them 0: exactly 0 or 1; both 0: 1/2.
    #[inline(always)]
    pub fn new(lower: f32, upper: f32) -> Split {
        let ratio = lower / (lower + upper);
        let ordinary = (SMALLEST_SPLIT..=ONE_MINUS_EPSILON).contains(&ratio);
        Split { lower: if ordinary { ratio } else { extreme(lower, upper) } }
    }

    /// The side that `u` in [0, 1 - 2^-24] falls into, 0 = lower and 1 = upper, and its position inside that
    /// side, again in [0, 1 - 2^-24]. A side of probability 0 is never entered.
    #[inline(always)]
    pub fn take(self, u: f32) -> (u32, f32) {
        let side = self.lower.to_bits().wrapping_sub(u.to_bits()).wrapping_sub(1) >> 31;
        let offset = u - unit(side) * self.lower;
        (side, min(offset / self.probability(side), ONE_MINUS_EPSILON))
    }

    /// The factor by which the split multiplies the density on a side: twice its probability.
    #[inline(always)]
    pub fn density(self, side: u32) -> f32 {
        2.0 * self.probability(side)
    }

    /// The inverse of [`Split::take`] on a side of positive probability.
    #[inline(always)]
    pub fn undo(self, side: u32, u: f32) -> f32 {
        min(unit(side) * self.lower + u * self.probability(side), ONE_MINUS_EPSILON)
    }

    /// p or 1 - p, exactly.
    #[inline(always)]
    fn probability(self, side: u32) -> f32 {
        (unit(side) - self.lower).abs()
    }
}

/// The probability of the lower of two masses whose ratio is outside the clamp or is none.
#[cold]
fn extreme(lower: f32, upper: f32) -> f32 {
    match (lower > 0.0, upper > 0.0) {
        (true, true) if lower < upper => SMALLEST_SPLIT,
        (true, true) => ONE_MINUS_EPSILON,
        (true, false) => 1.0,
        (false, true) => 0.0,
        (false, false) => 0.5,
    }
}

/// 0.0 or 1.0 for a side. Like the comparison in [`Split::take`], which is exact because numbers that are not
/// negative are ordered as their bits, it leaves the compiler no branch: half of them would be mispredicted.
#[inline(always)]
fn unit(side: u32) -> f32 {
    f32::from_bits(side.wrapping_mul(1.0f32.to_bits()))
}

/// The splits of a square as a heap: node 1 splits axis 1, and the sides of node `i` are nodes `2 i` and `2 i + 1`,
/// down to child `c`, which is node `C + c`.
#[derive(Clone, Copy)]
pub(crate) struct Splits<const C: usize> {
    heap: [Split; MAX_CHILDREN],
}

const MAX_CHILDREN: usize = 16;

impl<const C: usize> Splits<C> {
    /// All splits at once: their divisions do not wait for one another. Pairwise sums keep equal children at 1/2.
    #[inline(always)]
    pub(crate) fn new(children: [f32; C]) -> Self {
        const { assert!(C <= MAX_CHILDREN) };
        let mut mass = [0.0; 2 * MAX_CHILDREN];
        for (c, child) in children.into_iter().enumerate() {
            mass[C + c] = child;
        }
        let mut heap = [Split { lower: 0.5 }; MAX_CHILDREN];
        for node in (1..C).rev() {
            let (lower, upper) = (mass[2 * node], mass[2 * node + 1]);
            mass[node] = lower + upper;
            heap[node] = Split::new(lower, upper);
        }
        Splits { heap }
    }

    /// Sends `u` into a child and multiplies the density by the factor of each split.
    #[inline(always)]
    pub(crate) fn take<const N: usize>(&self, u: &mut [f32; N], density: &mut f32) -> u32 {
        let mut node = 1;
        for u in u {
            let split = self.at(node);
            let (side, inside) = split.take(*u);
            *u = inside;
            multiply(density, split.density(side));
            node = 2 * node + side as usize;
        }
        (node & (C - 1)) as u32
    }

    /// Multiplies the density by the factors of the splits that lead to `child`: the bits of [`Splits::take`].
    #[inline(always)]
    pub(crate) fn multiply_density<const N: usize>(&self, child: u32, density: &mut f32) {
        for axis in 0..N {
            let (split, side) = self.step::<N>(child, axis);
            multiply(density, split.density(side));
        }
    }

    /// The inverse of [`Splits::take`] for a child of positive mass.
    #[inline(always)]
    pub(crate) fn undo<const N: usize>(&self, child: u32, u: &mut [f32; N]) {
        for (axis, u) in u.iter_mut().enumerate() {
            let (split, side) = self.step::<N>(child, axis);
            *u = split.undo(side, *u);
        }
    }

    /// The split at heap node `node`.
    #[inline(always)]
    pub(crate) fn at(&self, node: usize) -> Split {
        self.heap[node & (MAX_CHILDREN - 1)]
    }

    /// The split of `axis` on the way to `child`, and the side of the child.
    #[inline(always)]
    fn step<const N: usize>(&self, child: u32, axis: usize) -> (Split, u32) {
        let below = (N - axis) as u32;
        let node = (C + child as usize) >> below;
        (self.at(node), (child >> (below - 1)) & 1)
    }
}

/// Multiplies a density by the factor of one split. A chain of improbable splits must not underflow to 0: what
/// can be sampled has a positive pdf.
#[inline(always)]
fn multiply(density: &mut f32, factor: f32) {
    let product = *density * factor;
    let reachable = *density > 0.0 && factor > 0.0;
    *density = if reachable && product < f32::MIN_POSITIVE { f32::MIN_POSITIVE } else { product };
}
