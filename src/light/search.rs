//! Searches in cumulative tables: which cell a number falls into, and where inside.
//!
//! A table of f32 holds the starts of its cells, of which the first is 0, and its end, 1. A table of 16-bit numbers leaves out
//! the first start, and the end, [`UNITS`]. A cell without probability starts where the next one does, so no number falls into
//! it.
//!
//! Searches read a whole window, beyond the end of a short table, and count without a branch: behind the last table stands a
//! window of anything.

use crate::numeric::ONE_MINUS_EPSILON;
use crate::simd::{Num, Table, WINDOW, rank, rank16};

/// The end of a table in 16 bits. 65536 would not fit the start of a last cell without probability.
pub const UNITS: f32 = 65535.0;

/// A cell of a table: its number, its start and its end.
pub type Found<T> = (usize, [T; 2]);

/// The position in a cell of the number that fell into it, in [0, 1 - 2^-24].
#[inline(always)]
pub fn inside<F: Num>(number: F, start: F, width: F) -> F {
    ((number - start) / width).min(F::splat(ONE_MINUS_EPSILON))
}

/// The cell that holds `u` in [0, 1) of the table of `count` cells that begins at `first`.
#[inline(always)]
pub fn find(tables: &Table<'_, f32>, first: usize, count: usize, u: f32) -> Found<f32> {
    let (mut before, mut rest) = (first, count);
    while rest > WINDOW {
        let half = rest / 2;
        let [end, ..] = *tables.window(before + half);
        before += half * usize::from(end <= u);
        rest -= half;
    }
    let index = before + rank(tables.window(before + 1), u);
    let [start, end, ..] = *tables.window(index);
    (index - first, [start, end])
}

/// Start and end of a cell of the table that begins at `first`.
#[inline(always)]
pub fn cell(tables: &Table<'_, f32>, first: usize, index: usize) -> [f32; 2] {
    let [start, end, ..] = *tables.window(first + index);
    [start, end]
}

/// As [`cell`], of a table that is being written.
pub fn stored_cell(table: &[f32], index: usize) -> [f32; 2] {
    let found = table.get(index..).and_then(|rest| rest.first_chunk::<2>());
    found.copied().unwrap_or([0.0, 1.0])
}

/// The cell that holds the unit `key` of the 16-bit table of `count` cells, at most a window, that begins at `first`.
#[inline(always)]
pub fn find16(tables: &Table<'_, u16>, first: usize, count: usize, key: u32) -> Found<u32> {
    let window = tables.window(first);
    let index = rank16(window, key as u16, count.wrapping_sub(1));
    (index, range16(window, count, index))
}

/// Start and end of a cell of the 16-bit table of `count` cells that begins at `first`, in units.
#[inline(always)]
pub fn cell16(tables: &Table<'_, u16>, first: usize, count: usize, index: usize) -> [u32; 2] {
    range16(tables.window(first), count, index)
}

#[inline(always)]
fn range16(window: &[u16; WINDOW], count: usize, index: usize) -> [u32; 2] {
    // Both are read whatever the index is, so that there is nothing to predict.
    let before = u32::from(window[index.wrapping_sub(1) % WINDOW]);
    let end = u32::from(window[index % WINDOW]);
    [if index == 0 { 0 } else { before }, if index + 1 < count { end } else { UNITS as u32 }]
}

/// Writes a table of f32 for the masses of its cells, and answers their sum.
pub fn write_table(masses: impl Iterator<Item = f64> + Clone, table: &mut [f32]) -> f64 {
    /// A probability is a whole number of these, so that differences of starts are exact.
    const SCALE: u32 = 1 << 24;
    if let Some(end) = table.last_mut() {
        *end = 1.0;
    }
    write_starts(masses, SCALE, &mut |i, units| {
        if let Some(out) = table.get_mut(i) {
            *out = units as f32 * (1.0 / SCALE as f32);
        }
    })
}

/// Writes the starts of a table of `scale` units for the masses of its cells, and answers their sum. A cell with mass has at
/// least one unit and nowhere less than its share, but for the table's length in `scale`.
pub fn write_starts(masses: impl Iterator<Item = f64> + Clone, scale: u32, write: &mut dyn FnMut(usize, u32)) -> f64 {
    let total: f64 = masses.clone().sum();
    let lit = masses.clone().filter(|&m| m > 0.0).count() as u32;
    let share = if total > 0.0 { f64::from(scale - lit.min(scale)) / total } else { 0.0 };
    // Each share is rounded up; what that leaves is divided in proportion.
    let units = |mass: f64| if mass > 0.0 { (mass * share) as u32 + 1 } else { 0 };
    let used: u32 = masses.clone().map(units).sum();
    let left = if total > 0.0 { f64::from(scale.saturating_sub(used)) / total } else { 0.0 };
    let (mut sum, mut before) = (0.0, 0);
    for (index, mass) in masses.enumerate() {
        write(index, (sum * left) as u32 + before);
        sum += mass;
        before += units(mass);
    }
    total
}
