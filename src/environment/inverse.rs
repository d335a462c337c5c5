//! The cell of a grid for a pair of random numbers: first the row (axis 1), then the column in it, by the inverses of
//! cumulative distributions. A guide table (Chen and Asau 1974, "On Generating Random Variates from an Empirical
//! Distribution") finds each in constant time, and the density of a cell is two subtractions: no walk from the root.
//!
//! Positions are whole numbers of 2^-30, so the probability of a cell is exact, and is what it is sampled with.

use crate::numeric::{ContentHash, ONE_MINUS_EPSILON, exp2i, min};
use crate::simd::Lanes;

/// Positions in [0, 1) are multiples of 1 / WHOLE.
const WHOLE: u32 = 1 << BITS;
const BITS: u32 = 30;

/// No cell that has weight is narrower: every one is reached by some u of 24 bits (rule 12).
const LEAST: u32 = 1 << (BITS - 24);

/// Cells that are passed without a branch: a slot holds two bounds on average.
const STEPS: usize = 3;

/// Distributions over the cells of a square: number 0 over its rows, number 1 + i over the columns of row i.
#[derive(Clone, Copy, Debug)]
pub struct Inverse<'a> {
    depth: u32,
    /// Where each cell of each distribution begins, and then where the last ends.
    starts: &'a [u32],
    /// The cell in which each slot of each distribution begins; slots are as wide as each other.
    guides: &'a [u16],
}

/// A cell of a distribution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Span {
    /// The number of the cell.
    pub cell: u32,
    /// Where it begins.
    pub start: u32,
    /// How wide it is: its probability.
    pub width: u32,
}

impl Span {
    /// The place inside the cell of a position in it, in [0, 1).
    #[inline(always)]
    pub fn inside(&self, position: u32) -> f32 {
        min(position.wrapping_sub(self.start) as f32 / self.width as f32, ONE_MINUS_EPSILON)
    }

    /// The inverse of [`Span::inside`] in [0, 1).
    pub fn undo(&self, inside: f32) -> f32 {
        let position = f64::from(self.start) + f64::from(inside) * f64::from(self.width);
        min((position * exp2i(-(BITS as i32))) as f32, ONE_MINUS_EPSILON)
    }
}

/// The position of a number in [0, 1).
#[inline(always)]
pub fn position(u: f32) -> u32 {
    (u * WHOLE as f32) as u32
}

/// As [`position`], in eight lanes.
#[inline(always)]
pub fn positions<F: Lanes>(u: F) -> F::Index {
    (u * F::splat(WHOLE as f32)).truncate()
}

impl<'a> Inverse<'a> {
    /// The lengths of `starts` and `guides` for 2^depth x 2^depth cells, depth at most 12.
    #[inline(always)]
    pub fn lengths(depth: u32) -> [u64; 2] {
        let (stride, slots) = (stride(depth) as u64, slots(depth) as u64);
        [(stride * stride).next_multiple_of(4), (stride * slots).next_multiple_of(8)]
    }

    /// Makes the distributions from the weights of cells, which are finite and not negative; returns their sum.
    pub fn fill(depth: u32, starts: &mut [u32], guides: &mut [u16], weight: impl Fn([u32; 2]) -> f64) -> f64 {
        let (stride, slots) = (stride(depth), slots(depth));
        let (rows, columns) = starts.split_at_mut_checked(stride).unwrap_or_default();
        let (of_rows, of_columns) = guides.split_at_mut_checked(slots).unwrap_or_default();
        // The bytes of an environment must not depend on what was in the block.
        columns.iter_mut().skip((stride - 1) * stride).for_each(|rest| *rest = 0);
        of_columns.iter_mut().skip((stride - 1) * slots).for_each(|rest| *rest = 0);
        let distributions = columns.chunks_exact_mut(stride).zip(of_columns.chunks_exact_mut(slots));
        for ((i, row), (starts, guides)) in (0..).zip(rows.iter_mut()).zip(distributions) {
            starts.iter_mut().zip(0..).take(stride - 1).for_each(|(slot, j)| *slot = (weight([i, j]) as f32).to_bits());
            *row = (accumulate(starts) as f32).to_bits();
            guide(starts, guides);
        }
        let sum = accumulate(rows);
        guide(rows, of_rows);
        sum
    }

    /// A view of what [`Inverse::fill`] wrote. Other numbers give meaningless cells, but never a panic.
    pub fn trusted(depth: u32, starts: &'a [u32], guides: &'a [u16]) -> Self {
        Inverse { depth, starts, guides }
    }

    /// Whether these are distributions as [`Inverse::fill`] writes them.
    pub fn is_sound(&self) -> bool {
        let (stride, slots) = (stride(self.depth), slots(self.depth));
        let sound = |(starts, guides): (&[u32], &[u16])| {
            let ascends = starts.iter().zip(starts.iter().skip(1)).all(|(a, b)| a <= b);
            let whole = starts.first() == Some(&0) && starts.last() == Some(&WHOLE);
            let guided = guides.iter().zip(guides_to(starts, slots)).all(|(guide, cell)| usize::from(*guide) == cell);
            ascends && whole && guided
        };
        let mut all = self.starts.chunks_exact(stride).zip(self.guides.chunks_exact(slots)).take(stride);
        Self::lengths(self.depth) == [self.starts.len(), self.guides.len()].map(|len| len as u64) && all.all(sound)
    }

    /// Adds every number to a hash.
    pub fn add_to(&self, hash: &mut ContentHash) {
        self.starts.iter().for_each(|start| hash.add(u64::from(*start)));
        self.guides.iter().for_each(|guide| hash.add(u64::from(*guide)));
    }

    /// There are 2^depth cells along each axis.
    pub fn depth(&self) -> u32 {
        self.depth
    }

    /// The cell at a position.
    #[inline(always)]
    pub fn find(&self, distribution: u32, position: u32) -> Span {
        let slots = slots(self.depth);
        let slot = (position >> (BITS - slots.trailing_zeros())) as usize;
        let guide = self.guides.get(distribution as usize * slots + slot).copied().unwrap_or(0);
        let first = self.first(distribution);
        let mut at = first + usize::from(guide);
        let passed = |at: usize| self.starts.get(at + 1).is_some_and(|start| *start <= position);
        for _ in 0..STEPS {
            at += usize::from(passed(at));
        }
        while passed(at) {
            at += 1;
        }
        self.at(first, at)
    }

    /// A cell by its number.
    #[inline(always)]
    pub fn span(&self, distribution: u32, cell: u32) -> Span {
        let first = self.first(distribution);
        self.at(first, first + cell as usize)
    }

    #[inline(always)]
    fn at(&self, first: usize, at: usize) -> Span {
        let start = self.starts.get(at).copied().unwrap_or(WHOLE);
        let end = self.starts.get(at + 1).copied().unwrap_or(WHOLE);
        Span { cell: (at - first) as u32, start, width: end.wrapping_sub(start) }
    }

    /// Where the starts of a distribution begin.
    #[inline(always)]
    fn first(&self, distribution: u32) -> usize {
        distribution as usize * stride(self.depth)
    }

    /// By what the product of the widths of a row and a column is multiplied for the density in the cell: for each of both.
    #[inline(always)]
    pub fn scale(&self) -> f32 {
        crate::numeric::inverse_power(BITS.wrapping_sub(self.depth))
    }
}

/// Starts of a distribution.
#[inline(always)]
fn stride(depth: u32) -> usize {
    (1 << (depth & 31)) + 1
}

/// Slots of a guide: a power of two.
#[inline(always)]
fn slots(depth: u32) -> usize {
    1 << (depth.saturating_sub(1) & 31)
}

/// Turns the weights of a distribution, of which it gets the bits, into the starts of its cells; the last number
/// becomes the end. Returns the sum of the weights.
fn accumulate(starts: &mut [u32]) -> f64 {
    let Some((end, starts)) = starts.split_last_mut() else { return 0.0 };
    *end = WHOLE;
    let weight = |bits: &u32| f64::from(f32::from_bits(*bits));
    let sum: f64 = starts.iter().map(weight).sum();
    let least = sum * f64::from(LEAST) / f64::from(WHOLE);
    let raised = |bits: &u32| if weight(bits) > 0.0 { weight(bits).max(least) } else { 0.0 };
    let scale = f64::from(WHOLE) / starts.iter().map(raised).sum::<f64>();
    let mut cells_left = starts.iter().filter(|bits| weight(bits) > 0.0).count() as u32;
    let (mut passed, mut start) = (0.0, 0);
    for slot in starts {
        let raised = raised(slot);
        *slot = start;
        if raised > 0.0 {
            passed += raised;
            cells_left -= 1;
            // Each cell gets its room, whatever rounding says.
            let most = WHOLE - cells_left * LEAST;
            start = ((passed * scale + 0.5) as u32).max(start + LEAST).min(most);
        }
    }
    sum
}

fn guide(starts: &[u32], guides: &mut [u16]) {
    let slots = guides.len();
    guides.iter_mut().zip(guides_to(starts, slots)).for_each(|(guide, cell)| *guide = cell as u16);
}

/// The cell in which each slot begins: the last that begins no later.
fn guides_to(starts: &[u32], slots: usize) -> impl Iterator<Item = usize> {
    let width = (WHOLE as usize) / slots.max(1);
    let mut cell = 0;
    (0..slots).map(move |slot| {
        while starts.get(cell + 1).is_some_and(|start| *start as usize <= slot * width) {
            cell += 1;
        }
        cell
    })
}
