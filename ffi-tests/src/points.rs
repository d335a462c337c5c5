//! The library's Owen-scrambled Sobol points, eight at once, as a renderer with vectors of its own would make them.

use crate::lanes::LANES;
use wide::u32x8;

/// Numbers `first..` of the sequence of a seed: the same bits as `wis_points_sobol`.
pub fn sobol(seed: u32, first: u32, points: &mut [[f32; 2]]) {
    let seeds = [0, 0x5851_f42d, 0x1405_7b7e].map(|dimension| u32x8::splat(mix(seed ^ dimension)));
    for (block, points) in points.chunks_mut(LANES).enumerate() {
        let start = first.wrapping_add((block * LANES) as u32);
        let index = u32x8::new(std::array::from_fn(|i| start.wrapping_add(i as u32)));
        let order = reversed(permuted(reversed(index), seeds[0]));
        let x = centred(reversed(permuted(order, seeds[1])));
        let y = centred(reversed(permuted(pascal(order), seeds[2])));
        for (i, point) in points.iter_mut().enumerate() {
            *point = [x[i], y[i]];
        }
    }
}

/// The first so many of a seed.
pub fn of(seed: u32, count: usize) -> Vec<[f32; 2]> {
    let mut points = vec![[0.0; 2]; count];
    sobol(seed, 0, &mut points);
    points
}

#[inline]
fn reversed(bits: u32x8) -> u32x8 {
    let swap = |bits: u32x8, by: u32, mask: u32| {
        let mask = u32x8::splat(mask);
        ((bits >> by) & mask) | ((bits & mask) << by)
    };
    let bytes = swap(swap(swap(bits, 1, 0x5555_5555), 2, 0x3333_3333), 4, 0x0f0f_0f0f);
    let halves = swap(bytes, 8, 0x00ff_00ff);
    (halves >> 16_u32) | (halves << 16_u32)
}

#[inline]
fn pascal(index: u32x8) -> u32x8 {
    [(1, 0x5555_5555_u32), (2, 0x3333_3333), (4, 0x0f0f_0f0f), (8, 0x00ff_00ff), (16, 0x0000_ffff)]
        .into_iter()
        .fold(index, |digits, (shift, kept)| digits ^ ((digits >> shift) & u32x8::splat(kept)))
}

#[inline]
fn permuted(x: u32x8, seed: u32x8) -> u32x8 {
    [0x6c50_b47c_u32, 0xb82f_1e52, 0xc7af_e638, 0x8d22_f6e6]
        .into_iter()
        .fold(x + seed, |x, even| x ^ (x * u32x8::splat(even)))
}

fn mix(x: u32) -> u32 {
    let x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    let x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

#[inline]
fn centred(fraction: u32x8) -> [f32; LANES] {
    (fraction >> 9_u32).to_array().map(|cell| (2 * cell + 1) as i32 as f32 * (1.0 / 16_777_216.0))
}

#[cfg(test)]
mod tests {
    use crate::client::{check, raw};

    #[test]
    fn the_library_answers_the_same_points() {
        let (mut ours, mut theirs) = ([[0.0; 2]; 77], [[0.0; 2]; 77]);
        for (seed, first) in [(1, 0), (0xdead_beef, 5), (7, u32::MAX - 76)] {
            super::sobol(seed, first, &mut ours);
            // SAFETY: the array holds that many points.
            check(unsafe { raw::wis_points_sobol(seed, first, theirs.len(), theirs.as_mut_ptr().cast(), 0) }).unwrap();
            assert_eq!(ours, theirs);
        }
    }
}
