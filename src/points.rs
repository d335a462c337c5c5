//! Point sets in the unit square: Hammersley and the Owen-scrambled Sobol (0,2)-sequence.
//!
//! The scrambling hashes the digits as Burley 2020, "Practical Hash-based Owen Scrambling", does: a permutation in
//! which each bit depends on lower ones only (Laine and Karras 2011), applied to the reversed digits, is a nested
//! uniform scramble. The index is shuffled in the same way, so that the point pairs of several seeds are
//! independent; every aligned block of 2^k indices stays a (0,2)-net.
//!
//! Coordinates are (k + 1/2) 2^-23, the centres of 2^23 cells: exact in `f32`, and never 0 or 1. A u of exactly 0
//! would take the lower side of every split, however improbable.

use crate::numeric::{ONE_MINUS_EPSILON, min};
use crate::simd::{Num, Whole};

/// A seed for a pixel in a pass: neighbours and passes are decorrelated.
#[inline]
pub fn pixel_seed(x: u32, y: u32, pass: u32) -> u32 {
    mix(x ^ mix(y ^ mix(pass)))
}

/// A seed for a further pair of dimensions of the points with `seed`; `dimension` 0 is the first further pair.
#[inline]
pub fn dimension_seed(seed: u32, dimension: u32) -> u32 {
    mix(seed ^ mix(dimension.wrapping_add(STEP)))
}

/// The step of Weyl's sequence: 2^32 over the golden ratio.
const STEP: u32 = 0x9e37_79b9;

/// The seeds with these numbers of those that come of one seed which is a hash itself: Weyl's sequence, mixed.
#[inline(always)]
pub(crate) fn further_seeds<W: Whole>(seed: u32, numbers: W) -> W {
    mixed(W::splat(seed) + numbers * W::splat(STEP))
}

/// Point `index` of the Hammersley set of `total` points: ((index + 1/2) / total, radical inverse in base 2).
/// A total of 0 counts as 1.
#[inline]
pub fn hammersley(index: u32, total: u32) -> [f32; 2] {
    let x = (f64::from(index) + 0.5) / f64::from(total.max(1));
    [min(x as f32, ONE_MINUS_EPSILON), centred(index.reverse_bits())]
}

/// Point `index` of the Owen-scrambled Sobol (0,2)-sequence of a seed. Any index, in any order.
#[inline]
pub fn sobol(seed: u32, index: u32) -> [f32; 2] {
    let [order] = <f32 as Num>::ints_of(shuffled(<f32 as Num>::whole([index]), mix(seed)));
    sobol_in_order(seed, order)
}

/// Point `order` of the Owen-scrambled Sobol sequence of a seed, whose order is not shuffled.
#[inline(always)]
pub(crate) fn sobol_in_order(seed: u32, order: u32) -> [f32; 2] {
    let [x, y] = sobol_fractions([0x5851_f42d, 0x1405_7b7e].map(|of| mix(seed ^ of)), <f32 as Num>::whole([order]));
    [centres(x), centres(y)]
}

/// The points with these numbers of the Sobol sequence, scrambled by the seeds of its coordinates: fractions of 32 bits.
#[inline(always)]
pub(crate) fn sobol_fractions<W: Whole>([x, y]: [u32; 2], order: W) -> [W; 2] {
    [permuted(order, x).reverse_bits(), permuted(pascal(order), y).reverse_bits()]
}

/// The centres of the cells of 2^-23 that hold fractions of 32 bits.
#[inline(always)]
pub(crate) fn centres<F: Num>(fraction: F::Whole) -> F {
    F::of_whole(fraction.shr::<9>().shl::<1>() + F::Whole::splat(1)) * (1.0 / 16_777_216.0)
}

/// The digits of the second Sobol coordinate, least significant first: digit j is the parity of the digits i of
/// the index with binomial(i, j) odd, which are the i that contain the bits of j (Lucas).
#[inline(always)]
fn pascal<W: Whole>(index: W) -> W {
    let digits = index ^ (index.shr::<1>() & W::splat(0x5555_5555));
    let digits = digits ^ (digits.shr::<2>() & W::splat(0x3333_3333));
    let digits = digits ^ (digits.shr::<4>() & W::splat(0x0f0f_0f0f));
    let digits = digits ^ (digits.shr::<8>() & W::splat(0x00ff_00ff));
    digits ^ (digits.shr::<16>() & W::splat(0x0000_ffff))
}

/// The third Sobol coordinate of an index, its digits least significant first: the sequence of the primitive polynomial
/// x^2 + x + 1 with the initial numbers 1 and 3 (Joe and Kuo 2008, "Constructing Sobol sequences with better two-dimensional
/// projections"). Four digits of the index at a time.
#[inline(always)]
pub(crate) fn third_sobol(index: u32) -> u32 {
    const PARTS: [[u32; 16]; 8] = {
        let mut v = [0u32; 32];
        (v[0], v[1]) = (1 << 31, 3 << 30);
        let mut k = 2;
        while k < 32 {
            v[k] = v[k - 1] ^ v[k - 2] ^ (v[k - 2] >> 2);
            k += 1;
        }
        let mut parts = [[0; 16]; 8];
        let mut i = 0usize;
        while i < 8 * 16 {
            // The one without its highest digit, and that.
            let (part, digits) = (i / 16, i % 16);
            if let Some(highest) = digits.checked_ilog2() {
                let highest = highest as usize;
                parts[part][digits] = parts[part][digits ^ 1 << highest] ^ v[4 * part + highest].reverse_bits();
            }
            i += 1;
        }
        parts
    };
    PARTS.iter().enumerate().fold(0, |sum, (part, of)| sum ^ of[(index >> (4 * part) & 15) as usize])
}

/// A permutation in which each bit depends on itself and lower bits: Burley 2020, Section 3 (constants from there).
#[inline(always)]
pub(crate) fn permuted<W: Whole>(x: W, seed: u32) -> W {
    let x = x + W::splat(seed);
    // Without a closure: that would be compiled for the baseline's instructions.
    let x = x ^ (x * W::splat(0x6c50_b47c));
    let x = x ^ (x * W::splat(0xb82f_1e52));
    let x = x ^ (x * W::splat(0xc7af_e638));
    x ^ (x * W::splat(0x8d22_f6e6))
}

/// A permutation in which each bit depends on itself and higher bits: a nested uniform scramble.
#[inline(always)]
pub(crate) fn shuffled<W: Whole>(x: W, seed: u32) -> W {
    permuted(x.reverse_bits(), seed).reverse_bits()
}

/// An integer hash with nearly ideal avalanche (Wellons 2018, "lowbias32").
#[inline(always)]
fn mixed<W: Whole>(x: W) -> W {
    let x = (x ^ x.shr::<16>()) * W::splat(0x7feb_352d);
    let x = (x ^ x.shr::<15>()) * W::splat(0x846c_a68b);
    x ^ x.shr::<16>()
}

/// The hash of one number.
fn mix(x: u32) -> u32 {
    let [mixed] = <f32 as Num>::ints_of(mixed(<f32 as Num>::whole([x])));
    mixed
}

/// The centre of the cell of 2^-23 that holds a fraction of 32 bits.
#[inline(always)]
pub(crate) fn centred(fraction: u32) -> f32 {
    (2 * (fraction >> 9) + 1) as f32 * (1.0 / 16_777_216.0)
}
