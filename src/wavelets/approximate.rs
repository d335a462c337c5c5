//! Non-linear approximation of trees: the largest wavelets by their number, by a threshold, or by an error.
//!
//! What is compared are orthonormal coefficients; what is written are details in value space (Clarberg et al. 2005,
//! Section 4.1; Ng et al. 2004, Section 5.3). Floats that are not negative are ordered as their bits, so that a bisection of
//! 33 visits of each square finds the smallest coefficient that is kept, without memory.

use crate::numeric::{exp2i, is_float, times_power};
use crate::status::{Result, Status};
use crate::wavelets::morton::MAX_DEPTH;
use crate::wavelets::tree::Tree;
use crate::wavelets::triple::{Square, WAITING, Wavelets, analyse, shift};

/// The size of an orthonormal coefficient.
fn size(detail: f64, level: u32) -> f32 {
    (detail.abs() * exp2i(-(level as i32))) as f32
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

/// Keeps the `keep` wavelets of a tree with the largest orthonormal coefficients; of equal ones the first in depth-first
/// order. Writes the squares that have any to `out`, in order, and answers how many
/// there are: at most `keep`, and no more than there is room for. Details are multiplied by `2^exponent`.
///
/// # Errors
/// [`Status::Overflow`] if one of them is no float then.
pub fn select(tree: &Tree<4>, keep: u32, exponent: i32, out: &mut [Wavelets]) -> Result<usize> {
    let reached = |threshold: u32| {
        let mut count = 0u64;
        each_size(tree, |size| count += u64::from(size > 0.0 && size.to_bits() >= threshold));
        count
    };
    // Of those that just reach it, so many are kept.
    let (low, mut ties) = threshold(keep, reached);
    let mut written = Written { out, used: 0, exponent, fits: true };
    each_square(tree, &mut |level, position, square| {
        let mut kept = [0.0; 4];
        for (slot, d) in kept.iter_mut().zip(square).skip(1) {
            let bits = size(*d, level).to_bits();
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
    fn push(&mut self, (position, level): (u32, u32), &[_, a, b, c]: &Square) {
        let details = [a, b, c].map(|d| times_power(d, self.exponent));
        self.fits &= details.iter().all(|d| is_float(*d));
        if let Some(slot) = self.out.get_mut(self.used) {
            *slot = Wavelets { position, level, detail: details.map(|d| d as f32) };
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
pub fn select_squares(tree: &Tree<4>, keep: u32, exponent: i32, out: &mut [Wavelets]) -> Result<usize> {
    let norm = |level: u32, square: &Square| {
        let squares = square.iter().skip(1).map(|d| d * d).sum();
        size(libm::sqrt(squares), level).to_bits()
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
#[inline(never)]
fn each_square(tree: &Tree<4>, each: &mut dyn FnMut(u32, u32, &Square)) {
    let mut waiting = [(0u32, 0u32, 0u32); WAITING];
    let mut count = 0usize;
    let mut next = tree.root_square().map(|square| (square, 0, 0));
    while let Some((square, level, position)) = next {
        each(level, position, &analyse(tree.children(square).map(f64::from)));
        for c in (0..4).rev() {
            let child = tree.child_square(square, c).filter(|_| level + 1 < MAX_DEPTH);
            if let (Some(child), Some(slot)) = (child, waiting.get_mut(count)) {
                *slot = (child, level + 1, position | c << shift(level + 1));
                count += 1;
            }
        }
        count = count.wrapping_sub(1);
        next = waiting.get(count).copied();
    }
}
