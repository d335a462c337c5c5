//! Non-linear approximation of trees: the largest wavelets by their number, by a threshold, or by an error.
//!
//! What is compared are orthonormal coefficients; what is written are details in value space (Clarberg et al. 2005,
//! Section 4.1; Ng et al. 2004, Section 5.3). Floats that are not negative are ordered as their bits, so that a bisection of
//! 33 visits of each square finds the smallest coefficient that is kept, without memory.

use crate::numeric::{exp2i, is_float, times_power};
use crate::status::{Result, Status};
use crate::wavelets::morton::MAX_DEPTH;
use crate::wavelets::stored::AnyTree;
use crate::wavelets::triple::Wavelets;

/// The averages of a square and its details, as many as it has children.
type Square = [f64; 16];

/// The size of an orthonormal coefficient of a function of so many axes.
fn size(axes: u32, detail: f64, level: u32) -> f32 {
    let halves = axes * level;
    let odd = if halves & 1 == 1 { core::f64::consts::FRAC_1_SQRT_2 } else { 1.0 };
    (detail.abs() * exp2i(-((halves >> 1) as i32)) * odd) as f32
}

/// The largest size, as bits, that at least `keep` reach, and how many of those that just reach it are kept.
fn threshold(keep: u32, reached: impl Fn(u32) -> u64) -> (u32, u64) {
    let (mut low, mut high) = (0u32, f32::INFINITY.to_bits());
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        (low, high) = if reached(middle) >= u64::from(keep) { (middle, high) } else { (low, middle) };
    }
    (low, u64::from(keep).saturating_sub(reached(low + 1)))
}

/// Keeps the `keep` wavelets of a tree of two axes with the largest orthonormal coefficients; of equal ones the first in depth-first
/// order. Writes the squares that have any to `out`, in order, and answers how many
/// there are: at most `keep`, and no more than there is room for. Details are multiplied by `2^exponent`.
///
/// # Errors
/// [`Status::Overflow`] if one of them is no float then.
pub fn select(tree: &AnyTree, keep: u32, exponent: i32, out: &mut [Wavelets]) -> Result<usize> {
    let reached = |threshold: u32| {
        let mut count = 0u64;
        each_size(tree, |size| count += u64::from(size > 0.0 && size.to_bits() >= threshold));
        count
    };
    // Of those that just reach it, so many are kept.
    let (low, mut ties) = threshold(keep, reached);
    let axes = tree.axes();
    let mut written = Written { out, used: 0, exponent, fits: true };
    each_square(tree, &mut |level, position, square| {
        let mut kept = [0.0; 16];
        for (slot, d) in kept.iter_mut().zip(square).take(1 << axes).skip(1) {
            let bits = size(axes, *d, level).to_bits();
            let tied = bits == low && ties > 0;
            if bits > 0 && (bits > low || tied) {
                ties -= u64::from(bits == low);
                *slot = *d;
            }
        }
        if kept.iter().any(|d| *d != 0.0) {
            written.push((position, level), &kept);
        }
    });
    written.finish()
}

/// A list that is being written.
struct Written<'o> {
    out: &'o mut [Wavelets],
    used: usize,
    exponent: i32,
    fits: bool,
}

impl Written<'_> {
    fn push(&mut self, (position, level): (u64, u32), &[_, a, b, c, ..]: &Square) {
        let details = [a, b, c].map(|d| times_power(d, self.exponent));
        self.fits &= details.iter().all(|d| is_float(*d));
        if let Some(slot) = self.out.get_mut(self.used) {
            *slot = Wavelets { position: position as u32, level, detail: details.map(|d| d as f32) };
            self.used += 1;
        }
    }

    fn finish(self) -> Result<usize> {
        if self.fits { Ok(self.used) } else { Err(Status::Overflow) }
    }
}

/// As [`select`], for whole squares: the `keep` whose coefficients have the largest sum of squares, with all that they have
/// (Ng et al. 2004, Section 7.2, picks the light's squares so).
///
/// # Errors
/// As [`select`].
pub fn select_squares(tree: &AnyTree, keep: u32, exponent: i32, out: &mut [Wavelets]) -> Result<usize> {
    let axes = tree.axes();
    let norm = |level: u32, square: &Square| {
        let squares = square.iter().take(1 << axes).skip(1).map(|d| d * d).sum();
        size(axes, libm::sqrt(squares), level).to_bits()
    };
    let reached = |threshold: u32| {
        let mut count = 0u64;
        each_square(tree, &mut |level, _, square| {
            let bits = norm(level, square);
            count += u64::from(bits > 0 && bits >= threshold);
        });
        count
    };
    let (low, mut ties) = threshold(keep, reached);
    let mut written = Written { out, used: 0, exponent, fits: true };
    each_square(tree, &mut |level, position, square| {
        let bits = norm(level, square);
        let tied = bits == low && ties > 0;
        if bits == 0 || !(bits > low || tied) {
            return;
        }
        ties -= u64::from(bits == low);
        written.push((position, level), square);
    });
    written.finish()
}

/// The fewest of a tree's largest wavelets that leave a relative L2 error of at most `error`.
pub fn terms(tree: &AnyTree, error: f64) -> u32 {
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
        (count, not_negative(all - mean - kept), all)
    };
    let (_, _, all) = above(0);
    let allowed = error * error * all;
    let (mut low, mut high) = (0u32, f32::INFINITY.to_bits());
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        (low, high) = if above(middle).1 <= allowed { (middle, high) } else { (low, middle) };
    }
    let (count, lost, _) = above(low);
    // Of those that are just as large as the last one some may still go.
    let each = f64::from(f32::from_bits(low)) * f64::from(f32::from_bits(low));
    let ties = count - above(high).0;
    let spare = if each > 0.0 { (not_negative(allowed - lost) / each) as u32 } else { 0 };
    count - spare.min(ties)
}

fn not_negative(x: f64) -> f64 {
    if x > 0.0 { x } else { 0.0 }
}

/// How many of a tree's wavelets have an orthonormal coefficient of at least `threshold`, in the units of the input, of
/// which stored values are `2^-exponent`.
pub fn at_least(tree: &AnyTree, threshold: f64, exponent: i32) -> u32 {
    let mut count = 0;
    each_size(tree, |size| count += u32::from(size > 0.0 && times_power(size.into(), exponent) >= threshold));
    count
}

/// Bits of a position below those of a level.
fn shift(axes: u32, level: u32) -> u32 {
    axes * MAX_DEPTH.saturating_sub(level)
}

/// Sums over c of (-1)^popcount(f & c) value(c), for every f below 2^axes: but for a factor 2^axes, details from averages.
#[inline(never)]
fn transform(values: &mut Square, axes: u32) {
    for axis in 0..axes.min(4) {
        for c in (0..1usize << axes.min(4)).filter(|c| c >> axis & 1 == 0) {
            let (low, high) = (values[c & 15], values[(c | 1 << axis) & 15]);
            (values[c & 15], values[(c | 1 << axis) & 15]) = (low + high, low - high);
        }
    }
}

/// Calls `each` with the size of every orthonormal coefficient of a tree's wavelets.
fn each_size(tree: &AnyTree, mut each: impl FnMut(f32)) {
    let axes = tree.axes();
    each_square(tree, &mut |level, _, square| {
        square.iter().take(1 << axes).skip(1).for_each(|d| each(size(axes, *d, level)));
    });
}

/// Calls `each(level, position, function)` with every square of a tree, depth first. One copy for all callers.
#[inline(never)]
fn each_square(tree: &AnyTree, each: &mut dyn FnMut(u32, u64, &Square)) {
    // All but one of the children of each level wait.
    const WAITING: usize = 15 * MAX_DEPTH as usize + 16;
    let (axes, share) = (tree.axes(), 1.0 / f64::from(1u32 << tree.axes()));
    let mut waiting = [(0u32, 0u32, 0u64); WAITING];
    let mut count = 0usize;
    let mut next = tree.root_square().map(|square| (square, 0, 0));
    while let Some((square, level, position)) = next {
        let mut function = [0.0; 16];
        for (value, child) in function.iter_mut().zip(tree.children(square)) {
            *value = f64::from(*child) * share;
        }
        transform(&mut function, axes);
        each(level, position, &function);
        for c in (0..1u32 << axes).rev() {
            let child = tree.child_square(square, c).filter(|_| level + 1 < MAX_DEPTH);
            if let (Some(child), Some(slot)) = (child, waiting.get_mut(count)) {
                *slot = (child, level + 1, position | u64::from(c) << shift(axes, level + 1));
                count += 1;
            }
        }
        count = count.wrapping_sub(1);
        next = waiting.get(count).copied();
    }
}
