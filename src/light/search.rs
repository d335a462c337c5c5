//! Searches in cumulative tables: which cell a number falls into, and where inside.
//!
//! A table holds the starts of its cells; the first is 0 and the end is 1 (or [`UNITS`]) and not stored. A cell without
//! probability starts where the next one does, so no number falls into it.

use crate::numeric::{ONE_MINUS_EPSILON, min};

/// The end of a table in 16 bits. 65536 would not fit the start of a last cell without probability.
pub const UNITS: f32 = 65535.0;

/// Tables above this length are halved before their starts are counted; found by timing 16k maps.
const WINDOW: usize = 16;

/// A cell of a table.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Its number.
    pub index: usize,
    /// Where it starts, in [0, 1].
    pub start: f32,
    /// Its probability.
    pub width: f32,
    /// The position inside, in [0, 1 - 2^-24].
    pub rest: f32,
}

/// The position of `u` in a cell.
#[inline(always)]
fn inside(u: f32, start: f32, width: f32) -> f32 {
    min((u - start) / width, ONE_MINUS_EPSILON)
}

/// The cell of a table of f32 starts that holds `u` in [0, 1).
#[inline(always)]
pub fn find(starts: &[f32], u: f32) -> Found {
    let mut base = 0;
    let mut window = starts;
    while window.len() > WINDOW {
        let (low, high) = window.split_at(window.len() / 2);
        match high.first() {
            Some(&start) if start <= u => {
                base += low.len();
                window = high;
            }
            _ => window = low,
        }
    }
    let index = base + count(window.iter().map(|&start| start <= u)).saturating_sub(1);
    let (start, width) = cell(starts, index);
    Found { index, start, width, rest: inside(u, start, width) }
}

/// Start and probability of a cell of a table of f32 starts.
#[inline(always)]
pub fn cell(starts: &[f32], index: usize) -> (f32, f32) {
    let start = starts.get(index).copied().unwrap_or(1.0);
    (start, starts.get(index + 1).copied().unwrap_or(1.0) - start)
}

/// The cell of a table of 16-bit starts, without the first, that holds `u` in [0, 1); `start` and `width` in units.
#[inline(always)]
pub fn find16(inner: &[u16], u: f32) -> Found {
    let t = u * UNITS;
    let key = t as i32 as u16;
    let index = match <&[u16; 15]>::try_from(inner) {
        Ok(full) => usize::from(full.iter().fold(0u16, |n, &start| n + u16::from(start <= key))),
        Err(_) => inner.iter().fold(0, |n, &start| n + usize::from(start <= key)),
    };
    let (start, width) = cell16(inner, index);
    Found { index, start, width, rest: inside(t, start, width) }
}

/// Start and probability of a cell of a table of 16-bit starts without the first, in units.
#[inline(always)]
pub fn cell16(inner: &[u16], index: usize) -> (f32, f32) {
    let start = if index == 0 { 0.0 } else { inner.get(index - 1).map_or(UNITS, |&s| f32::from(s)) };
    let end = inner.get(index).map_or(UNITS, |&s| f32::from(s));
    (start, end - start)
}

#[inline(always)]
fn count(holds: impl Iterator<Item = bool>) -> usize {
    holds.fold(0, |n, holds| n + usize::from(holds))
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
