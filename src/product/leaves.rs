//! Leaves: F as a bilinear function of the light's numbers, from values at directions, and in 16 bits.

use super::stored::Leaves;
use crate::light::guide::{Column, Guide, Short, read};
use crate::light::tables::{decode_wide, encode_wide};
use crate::simd::{GROUP, Num};

/// No leaf that counts is darker than this share of the brightest value about it.
pub const FLOOR: f32 = 0.05;

/// The values of F at the corners (w, v) = (0, 0), (1, 0), (0, 1), (1, 1) of leaves.
pub type Corners<F> = [F; 4];

/// The values at the corners of the cells from `first` on, from those of all corners: the light's four directions.
#[inline(always)]
pub fn corner_values<F: Num>(guide: &Guide<'_>, values: &[f32], first: usize) -> Corners<F> {
    let (a, below) = guide.corner_of(first);
    if guide.row_length() % F::WIDTH == 0 {
        let read = |further: usize| F::at(values, a + further);
        return [read(0), read(1), read(below), read(below + 1)];
    }
    // Rows have four cells, so that each half of the lanes lies in one.
    let (b, _) = guide.corner_of(first + F::WIDTH / 2);
    let read = |further: usize| {
        let mut lanes = F::floats();
        for (half, at) in lanes.as_mut().chunks_exact_mut(4).zip([a, b]) {
            half.copy_from_slice(
                values.get(at + further..).and_then(|rest| rest.first_chunk::<4>()).unwrap_or(&[0.0; 4]),
            );
        }
        F::load(lanes)
    };
    [read(0), read(1), read(below), read(below + 1)]
}

/// Where the light of the quadrants of cells is, in groups of cells: positions across and down.
pub type Quadrants<'a> = [[&'a [[Short; GROUP]]; 2]; 4];

/// Those of all cells.
#[inline(always)]
pub fn quadrants<'a>(guide: &Guide<'a>) -> Quadrants<'a> {
    [0, 1, 2, 3].map(|quadrant| [guide.groups(Column::Across, quadrant), guide.groups(Column::Down, quadrant)])
}

/// F over the numbers of the cells from place `first` of a group on: interpolated to where the light of each quadrant is, and extrapolated to the corners.
#[inline(always)]
pub fn tilted<F: Num>(quadrants: &Quadrants<'_>, corners: &Corners<F>, group: usize, first: usize) -> Corners<F> {
    let [a, b, c, d] = *corners;
    let mut at = [a; 4];
    for ([across, down], out) in quadrants.iter().zip(&mut at) {
        let (across, down) = (shorts_of::<F>(across, group, first), shorts_of::<F>(down, group, first));
        let (top, bottom) = (a + (b - a) * across, c + (d - c) * across);
        *out = top + (bottom - top) * down;
    }
    extrapolated(at)
}

/// Numbers of the cells from place `first` of a group on.
#[inline(always)]
pub fn group_of<F: Num>(groups: &[[f32; GROUP]], group: usize, first: usize) -> F {
    F::at(groups.get(group).unwrap_or(&[0.0; GROUP]), first)
}

/// Short numbers of the cells from place `first` of a group on.
#[inline(always)]
pub fn shorts_of<F: Num>(groups: &[[Short; GROUP]], group: usize, first: usize) -> F {
    read(groups.get(group).unwrap_or(&[0; GROUP]).get(first..).unwrap_or(&[]))
}

/// The corners of a bilinear function from its values at the middles of the quadrants.
#[inline(always)]
fn extrapolated<F: Num>([a, b, c, d]: Corners<F>) -> Corners<F> {
    let half = F::splat(0.5);
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

/// Leaves in 16 bits from place `first` of a group on, and the mean of what is stored.
#[inline(always)]
pub fn store<F: Num>(corners: &Corners<F>, out: &mut Leaves, first: usize) -> F {
    let mut sum = F::splat(0.0);
    for (corner, words) in corners.iter().zip(out) {
        // Loops of their own, so that each becomes a few vector instructions.
        let (mut wide, mut stored) = (F::ints(), F::floats());
        for (word, &value) in wide.as_mut().iter_mut().zip(corner.store().as_ref()) {
            *word = encode_wide(value);
        }
        for (kept, &word) in stored.as_mut().iter_mut().zip(wide.as_ref()) {
            *kept = decode_wide(word);
        }
        for (out, &word) in words.get_mut(first..).unwrap_or_default().iter_mut().zip(wide.as_ref()) {
            *out = word as u16;
        }
        let zero = F::splat(0.0);
        sum = sum + F::only(zero.lt(*corner), F::load(stored));
    }
    sum * 0.25
}

/// The mean of a leaf in 16 bits, with the bits that [`store`] answers.
pub fn mean(words: [u16; 4]) -> f32 {
    let value = |word: u16| if word == 0 { 0.0 } else { decode_wide(word.into()) };
    words.into_iter().fold(0.0, |sum, word| sum + value(word)) * 0.25
}
