//! Searches in cumulative tables: which cell a number falls into, and where inside.
//!
//! A table of f32 holds the starts of its cells, of which the first is 0, and its end, 1. A table of 16-bit words leaves out the
//! first start, and the end, [`UNITS`]. A cell without probability starts where the next one does, so no number falls into it.
//!
//! Words are spaced evenly or, in blocks where one patch outshines the others by far, ever closer towards both ends of the
//! table: what stands beside a sun of 1e5 times its light would otherwise get several times its share.
//!
//! Searches read a whole window, beyond the end of a short table, and count without a branch: behind the last table stands a
//! window of anything.

use crate::blob::Table;
use crate::numeric::ONE_MINUS_EPSILON;
use crate::simd::{Num, WINDOW, rank, rank16};

/// The end of a table in 16 bits, in units: a word of evenly spaced starts is 32 of them.
pub const UNITS: f32 = (LAST_WORD << EVEN) as f32;
/// The end of a table as a word. 65536 would not fit the start of a last cell without probability.
pub const LAST_WORD: u32 = 65535;
/// log2 of the units of an evenly spaced word.
const EVEN: u32 = 5;
/// log2 of the words at each end of a table that are one unit apart where words are not spaced evenly; behind them, as many are
/// two units apart, then four, and in the middle 128.
const FINEST: u32 = 12;
/// These floats reach to a 2^WIDER-th below half of the units.
const WIDER: u32 = 8;

/// The start that a word stands for, in units.
#[inline(always)]
pub fn start16(word: u32, to_ends: bool) -> u32 {
    if !to_ends {
        return word << EVEN;
    }
    let from_end = word.min(LAST_WORD.wrapping_sub(word));
    // A small float: three bits of exponent behind the denormal one.
    let float = from_end + (1 << FINEST);
    let exponent = (float >> FINEST).wrapping_sub(1) & 31;
    let units = (((1 << FINEST) | float & ((1 << FINEST) - 1)) << exponent).wrapping_sub(1 << FINEST);
    // A little wider, so that the words of both ends meet in the middle.
    let units = units + (units >> WIDER);
    if word <= LAST_WORD / 2 { units } else { UNITS as u32 - units }
}

/// The largest word whose start is not above a number of units.
#[inline(always)]
pub fn word16(units: u32, to_ends: bool) -> u32 {
    if !to_ends {
        return units >> EVEN;
    }
    let below = |units: u32| {
        let (whole, part) = (units / ((1 << WIDER) + 1), units % ((1 << WIDER) + 1));
        let float = (whole << WIDER) + part.min((1 << WIDER) - 1) + (1 << FINEST);
        let exponent = (31 - FINEST).wrapping_sub(float.leading_zeros()) & 31;
        ((exponent << FINEST) + (float >> exponent)).wrapping_sub(1 << FINEST)
    };
    let end = UNITS as u32;
    if units < end / 2 {
        below(units).min(LAST_WORD / 2)
    } else {
        // From the other end the smallest one that is not below.
        LAST_WORD - (below((end - units).wrapping_sub(1) & 0x3f_ffff) + 1).min(LAST_WORD.div_ceil(2))
    }
}

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

/// The cell that holds a number of units of the 16-bit table of `count` cells, at most a window, that begins at `first`.
#[inline(always)]
pub fn find16(tables: &Table<'_, u16>, first: usize, count: usize, units: u32, to_ends: bool) -> Found<u32> {
    let window = tables.window(first);
    if to_ends { found_to_ends(window, count, units) } else { found16(window, count, units, false) }
}

/// Few blocks are such.
#[inline(never)]
fn found_to_ends(window: &[u16; WINDOW], count: usize, units: u32) -> Found<u32> {
    found16(window, count, units, true)
}

#[inline(always)]
fn found16(window: &[u16; WINDOW], count: usize, units: u32, to_ends: bool) -> Found<u32> {
    let index = rank16(window, word16(units, to_ends) as u16, count.wrapping_sub(1));
    (index, range16(window, count, index, to_ends))
}

/// Start and end of a cell of the 16-bit table of `count` cells that begins at `first`, in units.
#[inline(always)]
pub fn cell16(tables: &Table<'_, u16>, first: usize, count: usize, index: usize, to_ends: bool) -> [u32; 2] {
    let window = tables.window(first);
    if to_ends { range_to_ends(window, count, index) } else { range16(window, count, index, false) }
}

/// Few blocks are such.
#[inline(never)]
fn range_to_ends(window: &[u16; WINDOW], count: usize, index: usize) -> [u32; 2] {
    range16(window, count, index, true)
}

#[inline(always)]
fn range16(window: &[u16; WINDOW], count: usize, index: usize, to_ends: bool) -> [u32; 2] {
    // Both are read whatever the index is, so that there is nothing to predict.
    let before = start16(window[index.wrapping_sub(1) % WINDOW].into(), to_ends);
    let end = start16(window[index % WINDOW].into(), to_ends);
    [if index == 0 { 0 } else { before }, if index + 1 < count { end } else { UNITS as u32 }]
}

/// The starts of a 16-bit table as words; the first, which is not stored, is 0.
pub type Words = [u16; WINDOW];

/// A cell has at least its share of the table but for this part of it.
pub const LITTLE: f64 = 1.0 / 256.0;

/// The words for the masses of at most a window of cells. A cell with mass has a word of its own, and at least its share but for
/// [`LITTLE`]; where words are not spaced evenly, the cell in the middle takes what the others leave.
pub fn words16(masses: &[f64], to_ends: bool) -> Words {
    let mut words = [0; WINDOW];
    if !to_ends {
        write_starts(masses.iter().copied(), LAST_WORD, &mut |i, word| {
            if let Some(out) = words.get_mut(i) {
                *out = word as u16;
            }
        });
        return words;
    }
    let total: f64 = masses.iter().sum();
    let share = if total > 0.0 { f64::from(UNITS) / total } else { 0.0 };
    // From an end: the word behind the cells so far, and how much more than theirs they have.
    let behind = |(word, surplus): (u32, f64), mass: f64| {
        if !(mass > 0.0) {
            return (word, surplus);
        }
        let (start, units) = (start16(word, true), mass * share);
        let last = LAST_WORD / 2;
        let wanted = (start + units as u32).min(UNITS as u32 / 2);
        let (less, more) = (word16(wanted, true).min(last), (word16(wanted, true) + 1).min(last));
        let given = |word: u32| f64::from(start16(word, true)) - f64::from(start);
        // A little less than its share only where that makes up for what others have more.
        let enough = given(less) >= units || surplus > 0.0 && given(less) >= (1.0 - LITTLE) * units;
        let next = if enough && less > word { less } else { more };
        (next, surplus + given(next) - units)
    };
    // The cell in the middle takes what the others leave.
    let mut sum = 0.0;
    let middle = masses.iter().position(|&mass| {
        sum += mass;
        2.0 * sum > total
    });
    let middle = middle.unwrap_or(0);
    let mut so_far = (0, 0.0);
    for (&mass, out) in masses.iter().zip(words.iter_mut().skip(1)).take(middle) {
        so_far = behind(so_far, mass);
        *out = so_far.0 as u16;
    }
    let mut so_far = (0, 0.0);
    for (&mass, out) in masses.iter().zip(words.iter_mut()).skip(middle + 1).rev() {
        so_far = behind(so_far, mass);
        *out = (LAST_WORD - so_far.0) as u16;
    }
    words
}

/// The relative variance of mass / probability in a table of words: what a density proportional to the masses loses by it.
pub fn variance16(masses: &[f64], words: &Words, to_ends: bool) -> f64 {
    let total: f64 = masses.iter().sum();
    if !(total > 0.0) {
        return 0.0;
    }
    let share = 1.0 / total;
    let ends =
        words.iter().copied().skip(1).take(masses.len().saturating_sub(1)).map(|word| start16(word.into(), to_ends));
    let (mut start, mut sum) = (0, 0.0);
    for (mass, end) in masses.iter().zip(ends.chain([UNITS as u32])) {
        let probability = f64::from(end.saturating_sub(start)) * (1.0 / f64::from(UNITS));
        let missing = mass * share - probability;
        if missing != 0.0 {
            sum += missing * missing / probability;
        }
        start = end;
    }
    sum
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
        // Rounding must leave nothing to cells without mass behind the last one with some.
        let start = if total > 0.0 && sum >= total { scale } else { (sum * left) as u32 + before };
        write(index, start);
        sum += mass;
        before += units(mass);
    }
    total
}
