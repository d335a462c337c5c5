//! Non-linear approximation of trees: the largest wavelets by their number, by a threshold, or by an error.
//!
//! What is compared are orthonormal coefficients; what is written are details in value space (Clarberg et al. 2005,
//! Section 4.1; Ng et al. 2004, Section 5.3). Floats that are not negative are ordered as their bits, so that a bisection of
//! 33 visits of each square finds the smallest coefficient that is kept, without memory.

use crate::numeric::{exp2i, is_float, max, times_power};
use crate::status::{Result, Status};
use crate::wavelets::morton::MAX_DEPTH;
use crate::wavelets::tree::Tree;
use crate::wavelets::triple::{Square, Wavelets, analyse, shift};

/// The size of an orthonormal coefficient.
fn size(detail: f64, level: u32) -> f32 {
    (detail.abs() * exp2i(-(level as i32))) as f32
}

/// The largest size, as bits, at which a condition holds that holds at 0 and at no size above some.
fn largest(holds: impl Fn(u32) -> bool) -> u32 {
    let (mut low, mut high) = (0u32, f32::INFINITY.to_bits());
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        (low, high) = if holds(middle) { (middle, high) } else { (low, middle) };
    }
    low
}

/// What is kept of a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Of {
    /// Single wavelets.
    Wavelets,
    /// Whole squares, by the sum of squares of their coefficients: Ng et al. 2004, Section 7.2, picks the light's so.
    Squares,
}

impl Of {
    /// The sizes that count of a square, as bits.
    fn sizes(self, level: u32, square: &Square) -> [u32; 3] {
        let [_, a, b, c] = *square;
        let sizes = match self {
            Of::Wavelets => [a, b, c],
            Of::Squares => [libm::sqrt(square.iter().skip(1).map(|d| d * d).sum()), 0.0, 0.0],
        };
        sizes.map(|d| size(d, level).to_bits())
    }
}

/// Keeps the `keep` wavelets of a tree with the largest orthonormal coefficients, or the largest whole squares; of equal ones the first in
/// depth-first order. Writes the squares that have any to `out`, in order, and answers how many
/// there are: at most `keep`, and no more than there is room for. Details are multiplied by `2^exponent`.
///
/// # Errors
/// [`Status::Overflow`] if one of them is no float then.
pub fn select(tree: &Tree<4>, of: Of, keep: u32, exponent: i32, out: &mut [Wavelets]) -> Result<usize> {
    let reached = |threshold: u32| {
        let mut count = 0u64;
        each_square(tree, &mut |level, _, square| {
            let reach = |bits: &u32| *bits > 0 && *bits >= threshold;
            count += of.sizes(level, square).iter().filter(|bits| reach(bits)).count() as u64;
        });
        count
    };
    let low = largest(|size| reached(size) >= u64::from(keep));
    // Of those that just reach it, so many are kept.
    let mut ties = u64::from(keep).saturating_sub(reached(low + 1));
    let (mut used, mut fits) = (0, true);
    each_square(tree, &mut |level, position, square| {
        let kept = of.sizes(level, square).map(|bits| {
            let tied = bits == low && bits > 0 && ties > 0;
            ties -= u64::from(tied);
            tied || bits > low
        });
        let kept = if of == Of::Squares { [kept[0]; 3] } else { kept };
        if kept.contains(&true) {
            let details = [0, 1, 2].map(|k: usize| if kept[k] { times_power(square[k + 1], exponent) } else { 0.0 });
            fits &= details.iter().all(|d| is_float(*d));
            if let Some(slot) = out.get_mut(used) {
                *slot = Wavelets { position, level, detail: details.map(|d| d as f32) };
                used += 1;
            }
        }
    });
    if fits { Ok(used) } else { Err(Status::Overflow) }
}

/// The fewest of a tree's largest wavelets that leave a relative L2 error of at most `error`.
pub fn terms(tree: &Tree<4>, error: f64) -> u32 {
    let mean = f64::from(tree.average()) * f64::from(tree.average());
    // How many reach a size, and the energy of all others and of all.
    let above = |threshold: u32| {
        let (mut count, mut kept, mut all) = (0u32, 0.0f64, mean);
        each_size(tree, |size| {
            let energy = f64::from(size) * f64::from(size);
            all += energy;
            if size > 0.0 && size.to_bits() >= threshold {
                (count, kept) = (count + 1, kept + energy);
            }
        });
        (count, max(all - mean - kept, 0.0), all)
    };
    let (_, _, all) = above(0);
    let allowed = error * error * all;
    let low = largest(|size| above(size).1 <= allowed);
    let (count, lost, _) = above(low);
    // Of those that are just as large as the last one some may still go.
    let each = f64::from(f32::from_bits(low)) * f64::from(f32::from_bits(low));
    let ties = count - above(low + 1).0;
    let spare = if each > 0.0 { (max(allowed - lost, 0.0) / each) as u32 } else { 0 };
    count - spare.min(ties)
}

/// How many of a tree's wavelets have an orthonormal coefficient of at least `threshold`, in the units of the input, of
/// which stored values are `2^-exponent`.
pub fn at_least(tree: &Tree<4>, threshold: f64, exponent: i32) -> u32 {
    let mut count = 0;
    each_size(tree, |size| count += u32::from(size > 0.0 && times_power(size.into(), exponent) >= threshold));
    count
}

/// Calls `each` with the size of every orthonormal coefficient of a tree's wavelets.
fn each_size(tree: &Tree<4>, mut each: impl FnMut(f32)) {
    each_square(tree, &mut |level, _, square| square.iter().skip(1).for_each(|d| each(size(*d, level))));
}

/// Calls `each(level, position, function)` with every square of a tree, depth first. One copy for all callers.
fn each_square(tree: &Tree<4>, each: &mut dyn FnMut(u32, u32, &Square)) {
    each_below(tree, (tree.root_square(), 0, 0), each);
}

/// The same with a square of this level and position, if there is one, and those inside it. Recursion ends at the finest level.
fn each_below(
    tree: &Tree<4>,
    (square, level, position): (Option<u32>, u32, u32),
    each: &mut dyn FnMut(u32, u32, &Square),
) {
    let Some(square) = square.filter(|_| level < MAX_DEPTH) else { return };
    each(level, position, &analyse(tree.children(square).map(f64::from)));
    for c in 0..4 {
        each_below(tree, (tree.child_square(square, c), level + 1, position | c << shift(level + 1)), each);
    }
}
