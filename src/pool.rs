//! The pooled resampler: picks from candidates of any densities in proportion to the client's weights.
//!
//! Resampled importance sampling (Talbot et al. 2005) draws each pick from candidates of its own and loses the
//! stratification of the points. Here all candidates of a pixel stand along the Morton curve of the octahedron, and
//! picks are systematic: threshold (j + u) / n of the sum of weights, for one u. Neighbours on the curve are
//! neighbours on the sphere, so picks are spread as the product is.

use crate::simd::{LANES, Lanes};
use crate::sphere::vector::V3;

/// A candidate and how often it was picked.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pick {
    /// The number of the candidate, from 0.
    pub candidate: u32,
    /// How many of the picks it stands for, at least 1.
    pub multiplicity: u32,
}

/// A candidate on the curve: its place, then its number.
pub type Key = u64;

/// Cells of the octahedral square along an axis; two digits of a byte make a place.
const CELLS: f32 = 256.0;
const DIGIT_BITS: u32 = 8;
const DIGITS: usize = 1 << DIGIT_BITS;
/// Up to so many keys it is faster to count the smaller ones of each than to count digits.
const FEW: usize = 32;

/// The places of eight directions on the curve; they need not be of unit length.
#[inline(always)]
pub fn places<F: Lanes>(wi: V3<F>) -> [u32; LANES] {
    let (zero, one) = (F::splat(0.0), F::splat(1.0));
    let [x, y, z] = wi;
    let norm = (x.abs() + y.abs() + z.abs()).max(F::splat(f32::MIN_POSITIVE));
    let (x, y) = (x / norm, y / norm);
    let south = z.lt(zero);
    let folded_x = F::select(south, (one - y.abs()).copysign(x), x);
    let folded_y = F::select(south, (one - x.abs()).copysign(y), y);
    let (columns, rows) = (cells(folded_x).to_array(), cells(folded_y).to_array());
    let mut places = [0; LANES];
    for ((place, column), row) in places.iter_mut().zip(columns).zip(rows) {
        *place = 2 * spread(row.to_bits()) + spread(column.to_bits());
    }
    places
}

/// The cells along an axis of coordinates in [-1, 1], in the lowest bits of a number: so large a number has no room for
/// fractions, and the cell is what half a cell less is rounded to. A NaN becomes cell 0.
#[inline(always)]
fn cells<F: Lanes>(coordinate: F) -> F {
    const WHOLE: f32 = 8_388_608.0;
    let cell = (coordinate + F::splat(1.0)) * F::splat(0.5 * CELLS) - F::splat(0.5);
    cell.max(F::splat(0.0)).min(F::splat(CELLS - 1.0)) + F::splat(WHOLE)
}

/// Bit i of the lowest byte as bit 2 i.
fn spread(bits: u32) -> u32 {
    const SPREAD: [u16; 256] = {
        let mut spread = [0; 256];
        let mut byte = 0;
        while byte < 256 {
            let bits = (byte | byte << 4) & 0x0f0f;
            let bits = (bits | bits << 2) & 0x3333;
            spread[byte] = ((bits | bits << 1) & 0x5555) as u16;
            byte += 1;
        }
        spread
    };
    u32::from(SPREAD[(bits & 0xff) as usize])
}

/// The key of a candidate.
pub fn key(place: u32, candidate: u32) -> Key {
    Key::from(place) << 32 | Key::from(candidate)
}

fn candidate(key: Key) -> u32 {
    key as u32
}

/// Sorts keys, whose candidates ascend; `spare` is as long.
pub fn sort(keys: &mut [Key], spare: &mut [Key]) {
    if keys.len() <= FEW {
        rank(keys, spare);
        return;
    }
    distribute(keys, spare, 32);
    distribute(spare, keys, 32 + DIGIT_BITS);
}

/// Sorts few keys by the number of smaller ones, without a branch that could be mispredicted.
fn rank(keys: &mut [Key], spare: &mut [Key]) {
    // Place, then number: as the keys, in less room. What is left of it is larger than all.
    let mut small = [i32::MAX; FEW];
    for ((number, slot), &key) in (0i32..).zip(&mut small).zip(keys.iter()) {
        *slot = ((key >> 32) as i32 & 0xffff) << 8 | number;
    }
    let small = small.get(..keys.len().next_multiple_of(LANES)).unwrap_or_default();
    for (own, &key) in small.iter().zip(keys.iter()) {
        let smaller = small.iter().map(|other| i32::from(other < own)).sum::<i32>();
        if let Some(slot) = spare.get_mut(smaller as usize) {
            *slot = key;
        }
    }
    for (key, sorted) in keys.iter_mut().zip(spare) {
        *key = *sorted;
    }
}

/// Writes keys in the order of a digit, equal ones in the order in which they stand.
fn distribute(from: &[Key], to: &mut [Key], shift: u32) {
    let digit = |key: Key| (key >> shift) as usize & (DIGITS - 1);
    let mut ends = [0u32; DIGITS];
    for &key in from {
        ends[digit(key)] += 1;
    }
    let mut sum = 0;
    for end in &mut ends {
        let count = *end;
        *end = sum;
        sum += count;
    }
    for &key in from {
        let place = &mut ends[digit(key)];
        if let Some(slot) = to.get_mut(*place as usize) {
            *slot = key;
        }
        *place += 1;
    }
}

/// Picks `count` times from sorted keys whose weights have a `sum` above 0, in the order of the curve; hands each picked
/// candidate to `emit` once. Each candidate is picked `count weight / sum` times in expectation over u in [0, 1).
pub fn pick(keys: &[Key], weight: impl Fn(u32) -> f32, sum: f64, (count, u): (u32, f32), mut emit: impl FnMut(Pick)) {
    let (n, u) = (f64::from(count), f64::from(u));
    let (per_pick, picks) = (sum / n, n / sum);
    let (mut passed, mut taken, mut last) = (0.0, 0, 0);
    // The next threshold (j + u) sum / n.
    let mut threshold = u * per_pick;
    for &key in keys {
        passed += f64::from(weight(candidate(key)));
        if passed > threshold && taken < count {
            let reached = whole_above(passed * picks - u).max(taken + 1).min(count);
            emit(Pick { candidate: candidate(key), multiplicity: reached - taken });
            taken = reached;
            threshold = (f64::from(taken) + u) * per_pick;
        }
        last = candidate(key);
    }
    // Weights in another order have another sum, in the last of its digits.
    if taken < count {
        emit(Pick { candidate: last, multiplicity: count - taken });
    }
}

/// The least whole number that is not below `x`, for `x` from -1 to 2^32.
fn whole_above(x: f64) -> u32 {
    let below = x as u32;
    below.saturating_add(u32::from(x > f64::from(below)))
}
