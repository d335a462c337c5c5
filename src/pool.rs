//! The pooled resampler: picks from candidates of any densities in proportion to the client's weights.
//!
//! Resampled importance sampling (Talbot et al. 2005) draws each pick from candidates of its own and loses the
//! stratification of the points. Here all candidates of a pixel stand along the Morton curve of the octahedron, and
//! picks are systematic: threshold (j + u) / n of the sum of weights, for one u. Neighbours on the curve are
//! neighbours on the sphere, so picks are spread as the product is.

use crate::simd::{LANES, Lanes};
use crate::wide::vector::V3;

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
/// Up to so many keys insertion is faster than counting digits.
const FEW: usize = 24;

/// The places of eight directions on the curve; they need not be of unit length.
#[inline(always)]
pub fn places<F: Lanes>(wi: V3<F>) -> [u32; LANES] {
    let (zero, one, half) = (F::splat(0.0), F::splat(1.0), F::splat(0.5));
    let [x, y, z] = wi;
    let norm = (x.abs() + y.abs() + z.abs()).max(F::splat(f32::MIN_POSITIVE));
    let (x, y) = (x / norm, y / norm);
    let south = z.lt(zero);
    let folded_x = F::select(south, (one - y.abs()).copysign(x), x);
    let folded_y = F::select(south, (one - x.abs()).copysign(y), y);
    let scale = F::splat(0.5 * CELLS);
    let (column, row) = ((folded_x + one) * scale, (folded_y + one) * scale);
    let last = F::splat(CELLS - 1.0) + half;
    // A NaN takes the second operand, 0.
    let (columns, rows) = (column.max(zero).min(last).to_array(), row.max(zero).min(last).to_array());
    let mut places = [0; LANES];
    for ((place, column), row) in places.iter_mut().zip(columns).zip(rows) {
        *place = 2 * spread(row as u32) + spread(column as u32);
    }
    places
}

/// Bit i of a byte as bit 2 i.
fn spread(bits: u32) -> u32 {
    let bits = (bits | bits << 4) & 0x0f0f;
    let bits = (bits | bits << 2) & 0x3333;
    (bits | bits << 1) & 0x5555
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
        insert(keys);
        return;
    }
    distribute(keys, spare, 32);
    distribute(spare, keys, 32 + DIGIT_BITS);
}

fn insert(keys: &mut [Key]) {
    for end in 1..keys.len() {
        let mut place = end;
        while let Some(&[low, high]) = place.checked_sub(1).and_then(|low| keys.get(low..=place)?.first_chunk::<2>()) {
            if low <= high {
                break;
            }
            keys.swap(place - 1, place);
            place -= 1;
        }
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

/// Picks `count` times from sorted keys, in the order of the curve; hands each picked candidate to `emit` once.
/// Returns the sum of the weights. Each candidate is picked `count weight / sum` times in expectation over u in [0, 1).
pub fn pick(keys: &[Key], weight: impl Fn(u32) -> f32, count: u32, u: f32, mut emit: impl FnMut(Pick)) -> f64 {
    let sum: f64 = keys.iter().map(|&key| f64::from(weight(candidate(key)))).sum();
    if !(sum > 0.0) {
        return 0.0;
    }
    let (n, u) = (f64::from(count), f64::from(u));
    let (mut passed, mut taken) = (0.0, 0);
    for &key in keys {
        passed += f64::from(weight(candidate(key)));
        // The thresholds (j + u) / n below the part that has passed; at the end it is exactly 1.
        let reached = libm::ceil(passed / sum * n - u) as u32;
        if reached > taken {
            emit(Pick { candidate: candidate(key), multiplicity: reached - taken });
            taken = reached;
        }
    }
    sum
}
