//! The pooled resampler: picks from candidates of any densities in proportion to the client's weights.
//!
//! Resampled importance sampling (Talbot et al. 2005) draws each pick from candidates of its own and loses the
//! stratification of the points. Here all candidates of a pixel stand along the Morton curve of the octahedron, and
//! picks are systematic: threshold (j + u) / n of the sum of weights, for one u. Neighbours on the curve are
//! neighbours on the sphere, so picks are spread as the product is.

use crate::blob::ALIGNMENT;
use crate::numeric::clamp_u;
use crate::simd::{Four, GROUP, Num};

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

/// The places of directions on the curve; they need not be of unit length.
#[inline(always)]
pub fn places<F: Num>([x, y, z]: [F; 3]) -> F::Ints {
    let (zero, one) = (F::splat(0.0), F::splat(1.0));
    let norm = (x.abs() + y.abs() + z.abs()).max(F::splat(f32::MIN_POSITIVE));
    let (x, y) = (x / norm, y / norm);
    let south = z.lt(zero);
    let folded_x = F::select(south, (one - y.abs()).copysign(x), x);
    let folded_y = F::select(south, (one - x.abs()).copysign(y), y);
    let (columns, rows) = (cells(folded_x).store(), cells(folded_y).store());
    let mut places = F::ints();
    for ((place, column), row) in places.as_mut().iter_mut().zip(columns.as_ref()).zip(rows.as_ref()) {
        *place = 2 * spread(row.to_bits()) + spread(column.to_bits());
    }
    places
}

/// The cells along an axis of coordinates in [-1, 1], in the lowest bits of a number: so large a number has no room for
/// fractions, and the cell is what half a cell less is rounded to. A NaN becomes cell 0.
#[inline(always)]
fn cells<F: Num>(coordinate: F) -> F {
    const WHOLE: f32 = 8_388_608.0;
    let cell = (coordinate + 1.0) * (0.5 * CELLS) - 0.5;
    cell.max(F::splat(0.0)).min(F::splat(CELLS - 1.0)) + WHOLE
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
    let small = small.get(..keys.len().next_multiple_of(GROUP)).unwrap_or_default();
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

/// The most candidates of one pool.
pub const MAX_CANDIDATES: usize = 1 << 24;

/// The bytes that [`resample`] works in; `None` for more than [`MAX_CANDIDATES`].
pub fn scratch_bytes(count: usize) -> Option<usize> {
    if count > MAX_CANDIDATES { None } else { (2 * count * size_of::<Key>()).checked_next_multiple_of(ALIGNMENT) }
}

/// Picks among candidates in proportion to their weights, finite and not negative, with one more random number for all. Writes
/// at most as many as there is room for; answers how many there are, and the sum of the weights. `scratch`: two keys for each
/// candidate.
///
/// # Errors
/// The number of a candidate whose weight is out of range.
#[inline(always)]
pub fn resample(
    count: usize,
    wi: impl Fn(usize) -> [f32; 3],
    weight: impl Fn(usize) -> f32,
    u: f32,
    scratch: &mut [Key],
    chosen: &mut [Pick],
) -> Result<(u32, f64), usize> {
    let (keys, spare) = scratch.split_at_mut_checked(count).unwrap_or_default();
    let picks = chosen.len() as u32;
    // A single pick has no others that it could be spread among.
    let spread = picks > 1;
    let (used, sum) = gather(count, wi, &weight, keys, spread)?;
    let (keys, spare) = (keys.get_mut(..used).unwrap_or(&mut []), spare.get_mut(..used).unwrap_or(&mut []));
    if spread {
        sort(keys, spare);
    }
    let mut written = 0u32;
    let emit = |pick| {
        if let Some(slot) = chosen.get_mut(written as usize) {
            *slot = pick;
            written += 1;
        }
    };
    if sum > 0.0 {
        pick(keys, |i| weight(i as usize), sum, (picks, clamp_u(u)), emit);
    }
    Ok((written, sum))
}

/// Writes the keys of the candidates that can be picked, in the order in which they came, with their places on the curve
/// if picks are to be `spread` along it; answers how many there are, and the sum of their weights.
#[inline(always)]
fn gather(
    count: usize,
    wi: impl Fn(usize) -> [f32; 3],
    weight: impl Fn(usize) -> f32,
    keys: &mut [Key],
    spread: bool,
) -> Result<(usize, f64), usize> {
    let (mut used, mut sum) = (0, 0.0);
    for first in (0..count).step_by(Four::WIDTH) {
        let here = (count - first).min(Four::WIDTH);
        let places = if spread { places_of(here, |i| wi(first + i)) } else { Four::ints() };
        for (i, place) in places.into_iter().enumerate().take(here) {
            let weight = weight(first + i);
            if !(0.0..=f32::MAX).contains(&weight) {
                return Err(first + i);
            }
            // Every key is written, and its place only kept if it can be picked: there is nothing to predict.
            if let Some(slot) = keys.get_mut(used) {
                *slot = key(place, (first + i) as u32);
            }
            used += usize::from(weight > 0.0);
            sum += f64::from(weight);
        }
    }
    Ok((used, sum))
}

/// The places on the curve of at most four directions.
#[inline(always)]
fn places_of(count: usize, wi: impl Fn(usize) -> [f32; 3]) -> [u32; Four::WIDTH] {
    let mut axes = [Four::floats(); 3];
    for i in 0..count {
        for (axis, component) in axes.iter_mut().zip(wi(i)) {
            axis[i & (Four::WIDTH - 1)] = component;
        }
    }
    places(axes.map(Four::load))
}
