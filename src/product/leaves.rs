//! Leaves: F as a bilinear function of the light's numbers, from values at directions, and in 16 bits.

use super::stored::Leaves;
use crate::light::guide::{Column, Guide, Short, read};
use crate::light::tables::{decode_wide, encode_wide};
use crate::simd::{LANES, Lanes, Num};

/// No leaf that counts is darker than this share of the brightest value about it.
pub const FLOOR: f32 = 0.05;

/// The values of F at the corners (w, v) = (0, 0), (1, 0), (0, 1), (1, 1) of eight leaves.
pub type Corners<F> = [F; 4];

/// The values at the corners of eight cells, from those of all corners: the light's four directions.
#[inline(always)]
pub fn corner_values<F: Lanes>(guide: &Guide<'_>, values: &[f32], first: usize) -> Corners<F> {
    let (a, below) = guide.corner_of(first);
    if guide.row_length() % LANES == 0 {
        let read = |further: usize| <F as Num>::read(values.get(a + further..).unwrap_or(&[]));
        return [read(0), read(1), read(below), read(below + 1)];
    }
    // Rows have four cells, so that each half of the lanes lies in one.
    let (b, _) = guide.corner_of(first + LANES / 2);
    let read = |further: usize| {
        let half = |at: usize| values.get(at + further..).and_then(|rest| rest.first_chunk::<4>()).unwrap_or(&[0.0; 4]);
        let ([p, q, r, s], [t, u, v, w]) = (*half(a), *half(b));
        <F as Num>::load([p, q, r, s, t, u, v, w])
    };
    [read(0), read(1), read(below), read(below + 1)]
}

/// Where the light of the quadrants of cells is, eight cells by eight: positions across and down.
pub type Quadrants<'a> = [[&'a [[Short; LANES]]; 2]; 4];

/// Those of all cells.
#[inline(always)]
pub fn quadrants<'a>(guide: &Guide<'a>) -> Quadrants<'a> {
    [0, 1, 2, 3].map(|quadrant| [guide.groups(Column::Across, quadrant), guide.groups(Column::Down, quadrant)])
}

/// F over the numbers of eight cells: interpolated to where the light of each quadrant is, and extrapolated to the corners.
#[inline(always)]
pub fn tilted<F: Lanes>(quadrants: &Quadrants<'_>, corners: &Corners<F>, group: usize) -> Corners<F> {
    let [a, b, c, d] = *corners;
    let mut at = [a; 4];
    for ([across, down], out) in quadrants.iter().zip(&mut at) {
        let (across, down) = (shorts_of::<F>(across, group), shorts_of::<F>(down, group));
        let (top, bottom) = (a + (b - a) * across, c + (d - c) * across);
        *out = top + (bottom - top) * down;
    }
    extrapolated(at)
}

/// Eight of the numbers of all cells.
#[inline(always)]
pub fn group_of<F: Lanes>(groups: &[[f32; LANES]], group: usize) -> F {
    <F as Num>::load(groups.get(group).copied().unwrap_or([0.0; LANES]))
}

/// Eight of the short numbers of all cells.
#[inline(always)]
pub fn shorts_of<F: Lanes>(groups: &[[Short; LANES]], group: usize) -> F {
    read(groups.get(group).unwrap_or(&[0; LANES]))
}

/// The corners of a bilinear function from its values at the middles of the quadrants.
#[inline(always)]
fn extrapolated<F: Lanes>([a, b, c, d]: Corners<F>) -> Corners<F> {
    let half = <F as Num>::splat(0.5);
    let apart = |low: F, high: F| {
        let step = half * (high - low);
        [low - step, high + step]
    };
    let ([a, b], [c, d]) = (apart(a, b), apart(c, d));
    let ([a, c], [b, d]) = (apart(a, c), apart(b, d));
    [a, b, c, d]
}

/// The largest of four.
#[inline(always)]
pub fn largest<F: Num>([a, b, c, d]: [F; 4]) -> F {
    a.max(b).max(c.max(d))
}

/// Leaves in 16 bits, and the mean of what is stored.
#[inline(always)]
pub fn store<F: Lanes>(corners: &Corners<F>, out: &mut Leaves) -> F {
    let mut sum = <F as Num>::splat(0.0);
    for (corner, words) in corners.iter().zip(out) {
        // Loops of their own, so that each becomes a few vector instructions.
        let (mut wide, mut stored) = ([0u32; LANES], [0.0; LANES]);
        for (word, value) in wide.iter_mut().zip(Num::store(*corner)) {
            *word = encode_wide(value);
        }
        for (kept, &word) in stored.iter_mut().zip(&wide) {
            *kept = decode_wide(word);
        }
        for (out, &word) in words.iter_mut().zip(&wide) {
            *out = word as u16;
        }
        let zero = <F as Num>::splat(0.0);
        sum = sum + <F as Num>::only(Num::lt(zero, *corner), <F as Num>::load(stored));
    }
    sum * <F as Num>::splat(0.25)
}

/// The mean of a leaf in 16 bits, with the bits that [`store`] answers.
pub fn mean(words: [u16; 4]) -> f32 {
    let value = |word: u16| if word == 0 { 0.0 } else { decode_wide(word.into()) };
    words.into_iter().fold(0.0, |sum, word| sum + value(word)) * 0.25
}
