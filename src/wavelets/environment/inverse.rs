//! The texel of a map for a pair of random numbers: first the row, then the column in it, by the inverses of cumulative
//! distributions. A guide table (Chen and Asau 1974, "On Generating Random Variates from an Empirical Distribution")
//! finds each in constant time, and the probability of a texel is a subtraction: no walk from a root.
//!
//! Positions are whole numbers of 2^-30, so the probability of a texel is exact, and is what it is sampled with.

use crate::numeric::{ContentHash, ONE_MINUS_EPSILON, min};
use crate::simd::{LANES, Lanes};

/// Positions in [0, 1) are multiples of 1 / WHOLE.
const WHOLE: u32 = 1 << BITS;
const BITS: u32 = 30;

/// No cell that has weight is narrower: every one is reached by some u of 24 bits (rule 12).
const LEAST: u32 = 1 << (BITS - 24);

/// Cells that are passed without a branch: a slot holds one bound on average.
const STEPS: usize = 2;

/// The most rows or columns: they can be counted in 16 bits.
pub const MOST_CELLS: u32 = (1 << 16) - 1;

/// Distributions over the texels of a map: number 0 over its rows, number 1 + i over the columns of row i.
#[derive(Clone, Copy, Debug)]
pub struct Inverse<'a> {
    rows: u32,
    columns: u32,
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
        min(number(position.wrapping_sub(self.start)) / number(self.width), ONE_MINUS_EPSILON)
    }

    /// The inverse of [`Span::inside`] in [0, 1): a number that leads to this cell.
    pub fn undo(&self, inside: f32) -> f32 {
        let exact = f64::from(self.start) + f64::from(inside) * f64::from(self.width);
        let u = min((exact * UNIT) as f32, ONE_MINUS_EPSILON);
        // The narrowest cells hold but one number, to which rounding may not lead.
        if position(u) < self.start {
            f32::from_bits(u.to_bits() + 1)
        } else if position(u) >= self.start.saturating_add(self.width) {
            f32::from_bits(u.to_bits().saturating_sub(1))
        } else {
            u
        }
    }
}

/// A whole number below 2^31 as a number: signed ones are what lanes convert.
#[inline(always)]
pub fn number(whole: u32) -> f32 {
    whole as i32 as f32
}

/// The position of a number in [0, 1).
#[inline(always)]
pub fn position(u: f32) -> u32 {
    (u * WHOLE as f32) as u32
}

/// As [`position`], in eight lanes.
#[inline(always)]
pub fn positions<F: Lanes>(u: F) -> [u32; LANES] {
    F::numbers((u * F::splat(WHOLE as f32)).truncate())
}

impl<'a> Inverse<'a> {
    /// The lengths of `starts` and `guides` for so many rows and columns, at most [`MOST_CELLS`] each.
    #[inline(always)]
    pub fn lengths([rows, columns]: [u32; 2]) -> [u64; 2] {
        let starts = stride(rows) as u64 + u64::from(rows) * stride(columns) as u64;
        let guides = slots(rows) as u64 + u64::from(rows) * slots(columns) as u64;
        [(starts + 3) & !3, (guides + 7) & !7]
    }

    /// Makes the distributions from the weights of texels (row, column), which are finite and not negative; returns their
    /// sum. The slices are as long as [`Inverse::lengths`] tells.
    pub fn fill(
        [rows, columns]: [u32; 2],
        starts: &mut [u32],
        guides: &mut [u16],
        weight: impl Fn([u32; 2]) -> f64,
    ) -> f64 {
        // The bytes of an environment must not depend on what was in the block.
        starts.iter_mut().rev().take(4).for_each(|rest| *rest = 0);
        guides.iter_mut().rev().take(8).for_each(|rest| *rest = 0);
        let (of_rows, of_columns) = starts.split_at_mut_checked(stride(rows)).unwrap_or_default();
        let (row_guides, column_guides) = guides.split_at_mut_checked(slots(rows)).unwrap_or_default();
        let each = of_columns.chunks_exact_mut(stride(columns)).zip(column_guides.chunks_exact_mut(slots(columns)));
        for ((i, row), (starts, guides)) in (0..rows).zip(of_rows.iter_mut()).zip(each) {
            let cells = starts.iter_mut().zip(0..columns);
            cells.for_each(|(slot, j)| *slot = (weight([i, j]) as f32).to_bits());
            *row = (accumulate(starts) as f32).to_bits();
            guide(starts, guides);
        }
        let sum = accumulate(of_rows);
        guide(of_rows, row_guides);
        sum
    }

    /// A view of what [`Inverse::fill`] wrote. Other numbers give meaningless cells, but never a panic.
    #[inline(always)]
    pub fn trusted([rows, columns]: [u32; 2], starts: &'a [u32], guides: &'a [u16]) -> Self {
        Inverse { rows, columns, starts, guides }
    }

    /// Whether these are distributions as [`Inverse::fill`] writes them.
    pub fn is_sound(&self) -> bool {
        let sound = |starts: &[u32], guides: &[u16]| {
            let ascends = starts.iter().zip(starts.iter().skip(1)).all(|(a, b)| a <= b);
            let whole = starts.first() == Some(&0) && starts.last() == Some(&WHOLE);
            let guided = guides.iter().zip(guides_to(starts, guides.len())).all(|(g, cell)| usize::from(*g) == cell);
            ascends && whole && guided
        };
        let lengths = [self.starts.len(), self.guides.len()].map(|len| len as u64);
        if lengths != Self::lengths([self.rows, self.columns]) {
            return false;
        }
        let (of_rows, starts) = self.starts.split_at_checked(stride(self.rows)).unwrap_or_default();
        let (row_guides, guides) = self.guides.split_at_checked(slots(self.rows)).unwrap_or_default();
        let starts = starts.chunks_exact(stride(self.columns));
        let mut each = starts.zip(guides.chunks_exact(slots(self.columns))).take(self.rows as usize);
        sound(of_rows, row_guides) && each.all(|(starts, guides)| sound(starts, guides)) && self.ends_in_zeros()
    }

    /// Whether what fills up the last words is 0.
    fn ends_in_zeros(&self) -> bool {
        let (rows, columns) = (self.rows as usize, self.columns as usize);
        let used = [stride(self.rows) + rows * (columns + 1), slots(self.rows) + rows * slots(self.columns)];
        let starts = self.starts.iter().skip(used[0]).all(|start| *start == 0);
        starts && self.guides.iter().skip(used[1]).all(|guide| *guide == 0)
    }

    /// Adds every number to a hash.
    pub fn add_to(&self, hash: &mut ContentHash) {
        for pair in self.starts.chunks(2) {
            hash.add(pair.iter().fold(0, |word, start| word << 32 | u64::from(*start)));
        }
        for four in self.guides.chunks(4) {
            hash.add(four.iter().fold(0, |word, guide| word << 16 | u64::from(*guide)));
        }
    }

    /// Rows and columns.
    #[inline(always)]
    pub fn size(&self) -> [u32; 2] {
        [self.rows, self.columns]
    }

    /// The row at a position.
    #[inline(always)]
    pub fn find_row(&self, position: u32) -> Span {
        self.find(position, self.rows, (0, 0))
    }

    /// The column at a position in a row.
    #[inline(always)]
    pub fn find_column(&self, row: u32, position: u32) -> Span {
        let guides = slots(self.rows) + row as usize * slots(self.columns);
        self.find(position, self.columns, (self.first_column(row), guides))
    }

    #[inline(always)]
    fn find(&self, position: u32, cells: u32, (starts, guides): (usize, usize)) -> Span {
        let slot = (position >> (BITS - slots(cells).trailing_zeros())) as usize;
        let mut at = starts + usize::from(self.guides.get(guides + slot).copied().unwrap_or(0));
        let passed = |at: usize| self.starts.get(at + 1).is_some_and(|start| *start <= position);
        for _ in 0..STEPS {
            at += usize::from(passed(at));
        }
        while passed(at) {
            at += 1;
        }
        self.at(starts, at)
    }

    /// A row by its number.
    #[inline(always)]
    pub fn row(&self, row: u32) -> Span {
        self.at(0, row as usize)
    }

    /// A column of a row.
    #[inline(always)]
    pub fn column(&self, row: u32, column: u32) -> Span {
        let first = self.first_column(row);
        self.at(first, first + column as usize)
    }

    #[inline(always)]
    fn at(&self, first: usize, at: usize) -> Span {
        let start = self.starts.get(at).copied().unwrap_or(WHOLE);
        let end = self.starts.get(at + 1).copied().unwrap_or(WHOLE);
        Span { cell: at.wrapping_sub(first) as u32, start, width: end.wrapping_sub(start) }
    }

    /// Where the starts of the columns of a row begin.
    #[inline(always)]
    fn first_column(&self, row: u32) -> usize {
        stride(self.rows) + row as usize * stride(self.columns)
    }
}

/// The probability of a cell of width 1.
pub const UNIT: f64 = 1.0 / WHOLE as f64;

/// Starts of a distribution.
#[inline(always)]
fn stride(cells: u32) -> usize {
    cells as usize + 1
}

/// Slots of a guide: a power of two, at least as many as cells.
#[inline(always)]
fn slots(cells: u32) -> usize {
    1 << (u32::BITS - cells.saturating_sub(1).leading_zeros()).min(u16::BITS)
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
