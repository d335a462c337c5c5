//! Searches in cumulative tables: which cell a number falls into, and where inside.
//!
//! A table holds the starts of its cells. Its end, 1 (or [`UNITS`]), is not stored, and 16-bit tables leave out the first
//! start, too, which is 0. A cell without probability starts where the next one does, so no number falls into it.
//!
//! Searches read a whole window, beyond the end of a short table, and count starts without a branch: what follows a section
//! of tables is padded by a window.

use crate::numeric::ONE_MINUS_EPSILON;
use crate::simd::{Num, rank, rank16};

/// The end of a table in 16 bits. 65536 would not fit the start of a last cell without probability.
pub const UNITS: f32 = 65535.0;

/// Elements that a search reads at once.
pub const WINDOW: usize = 16;

/// A cell of a table.
#[derive(Clone, Copy, Debug, Default)]
pub struct Found {
    /// Its number.
    pub index: usize,
    /// Where it starts: in [0, 1], or in units.
    pub start: f32,
    /// Its probability, or units.
    pub width: f32,
}

/// The position in a cell of the number that fell into it, in [0, 1 - 2^-24].
#[inline(always)]
pub fn inside<F: Num>(number: F, start: F, width: F) -> F {
    ((number - start) / width).min(F::splat(ONE_MINUS_EPSILON))
}

/// The cell that holds `u` in [0, 1) of the table of `count` starts that begins at `first`.
#[inline(always)]
pub fn find(tables: &[f32], first: usize, count: usize, u: f32) -> Found {
    let (mut base, mut rest) = (first, count);
    while rest > WINDOW {
        let half = rest / 2;
        base += if at(tables, base + half) <= u { half } else { 0 };
        rest -= half;
    }
    let window = tables.get(base..).and_then(|window| window.first_chunk::<WINDOW>());
    let index = base - first + window.map_or(1, |window| rank(window, u, rest)).saturating_sub(1);
    let (start, width) = cell(tables, first, count, index);
    Found { index, start, width }
}

/// Start and probability of a cell of the table of `count` starts that begins at `first`.
#[inline(always)]
pub fn cell(tables: &[f32], first: usize, count: usize, index: usize) -> (f32, f32) {
    let start = at(tables, first + index);
    let end = if index + 1 < count { at(tables, first + index + 1) } else { 1.0 };
    (start, end - start)
}

#[inline(always)]
fn at(tables: &[f32], index: usize) -> f32 {
    tables.get(index).copied().unwrap_or(1.0)
}

/// The cell that holds the unit `key` of the 16-bit table of `count` cells that begins at `first`; in units.
#[inline(always)]
pub fn find16(tables: &[u16], first: usize, count: usize, key: u16) -> Found {
    let window = tables.get(first..).and_then(|window| window.first_chunk::<WINDOW>());
    let index = window.map_or(0, |window| rank16(window, key, count.saturating_sub(1)));
    let (start, width) = cell16(tables, first, count, index);
    Found { index, start, width }
}

/// Start and width of a cell of the 16-bit table of `count` cells that begins at `first`, in units.
#[inline(always)]
pub fn cell16(tables: &[u16], first: usize, count: usize, index: usize) -> (f32, f32) {
    let at = |i: usize| tables.get(i).map_or(0.0, |&start| f32::from(start));
    let start = if index == 0 { 0.0 } else { at((first + index).wrapping_sub(1)) };
    let end = if index + 1 < count { at(first + index) } else { UNITS };
    (start, end - start)
}

/// Writes the starts of a table of `scale` units for the masses of its cells, and answers their sum. A cell with mass has at
/// least one unit; its probability is at most two units above its share, and below it by the table's length in units of
/// itself at most.
pub fn write_starts(masses: impl Iterator<Item = f64> + Clone, scale: u32, write: &mut dyn FnMut(usize, u32)) -> f64 {
    let total: f64 = masses.clone().sum();
    let lit = masses.clone().filter(|&m| m > 0.0).count() as u32;
    let share = if total > 0.0 { f64::from(scale - lit.min(scale)) / total } else { 0.0 };
    let (mut sum, mut before) = (0.0, 0);
    for (index, mass) in masses.enumerate() {
        write(index, (sum * share) as u32 + before);
        sum += mass;
        before += u32::from(mass > 0.0);
    }
    total
}
