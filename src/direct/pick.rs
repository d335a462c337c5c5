//! Systematic picks: of all candidates as many as there are rays, each as often as its share of the weights says.

use super::Ray;
use super::candidates::Candidates;
use super::joint::Points;
use crate::simd::{Compute, Four, Num};
use crate::sphere::Frame;
use glam::Vec3;

/// The share of the mean weight that every candidate has at least, so that a client whose BRDF or radiance is another than the
/// library's meets no huge weight.
pub const FLOOR: f32 = 0.05;
/// Sums of weights from here on are too close to the end of f32 to work with: every candidate that counts is then as good as another.
const LARGEST: f32 = f32::MAX / 4.0;

/// Picks as many candidates as there is room for rays, merged where one is picked more than once, and writes a ray for each.
pub struct Pick<'a, 'b> {
    /// The candidates.
    pub candidates: &'a mut Candidates<'b>,
    /// From map space to the world.
    pub frame: &'a Frame,
    /// The random numbers of the hit.
    pub points: Points,
    /// How many candidates a set has.
    pub count: usize,
    /// The rays.
    pub out: &'a mut [Ray],
}

impl Compute for Pick<'_, '_> {
    type Output = usize;

    /// How many rays there are.
    #[inline(always)]
    fn run<F: Num>(self) -> usize {
        let Pick { candidates, frame, points, count, out } = self;
        pick(candidates, out.len(), points.pick::<F>(count), |ray, direction, weight| {
            if let Some(out) = out.get_mut(ray) {
                *out = Ray { wi: frame.to_world(Vec3::from_array(direction)).to_array(), weight };
            }
        })
    }
}

/// Picks `rays` candidates, merged where one is picked more than once, and hands their number, direction and weight to `put`.
/// Answers how many there are: none if no candidate counts.
#[inline(always)]
pub fn pick(candidates: &mut Candidates<'_>, rays: usize, u: f32, mut put: impl FnMut(usize, [f32; 3], f32)) -> usize {
    let Candidates { direction, density, weight } = candidates;
    let total = sum_up(weight, density);
    if !(total > 0.0) {
        return 0;
    }
    let step = total / rays as f32;
    let threshold = |taken: usize| (taken as f32 + u) * step;
    let (mut from, mut taken, mut written) = (0, 0, 0);
    while taken < rays {
        let index = first_above(weight, from, threshold(taken)).unwrap_or_else(|| last_picked(weight));
        let of = |column: &[f32], index: usize| column.get(index).copied().unwrap_or(0.0);
        let (before, end) = (of(weight, index.wrapping_sub(1)), of(weight, index));
        let first = taken;
        taken += 1;
        // The last one takes what rounding leaves.
        while taken < rays && (threshold(taken) < end || end == total) {
            taken += 1;
        }
        let density = (end - before) * of(density, index);
        let [x, y, z] = direction;
        let weight = ((taken - first) as f32 * step / density).min(f32::MAX);
        put(written, [of(x, index), of(y, index), of(z, index)], weight);
        written += 1;
        from = index;
    }
    written
}

/// Turns weights into their sums up to each, after adding the least weight of those that count. Answers the sum of all.
#[inline(always)]
fn sum_up(weight: &mut [f32], density: &[f32]) -> f32 {
    let mut sums = Four::splat(0.0);
    for four in weight.chunks_exact(Four::WIDTH) {
        sums = sums + Four::read(four);
    }
    let [a, b, c, d] = sums.store();
    let sum = (a + b) + (c + d);
    // Without any target every candidate that counts is as good as another.
    let (scale, least) = if sum > 0.0 && sum < LARGEST { (1.0, FLOOR * sum / weight.len() as f32) } else { (0.0, 1.0) };
    let mut total = 0.0;
    for (weight, density) in weight.chunks_exact_mut(Four::WIDTH).zip(density.chunks_exact(Four::WIDTH)) {
        let counts = Four::read(density).lt(Four::splat(f32::INFINITY));
        let sums = Four::only(counts, Four::read(weight) * scale + least).sums() + total;
        sums.write(weight, 0);
        [.., total] = sums.store();
    }
    total
}

/// The first of ascending sums that is above a threshold, from an index on before which none is.
#[inline(always)]
fn first_above(sums: &[f32], from: usize, threshold: f32) -> Option<usize> {
    let begin = from - from % Four::WIDTH;
    for (at, four) in (begin..).step_by(Four::WIDTH).zip(sums.get(begin..)?.chunks_exact(Four::WIDTH)) {
        let above = Four::bits(Four::splat(threshold).lt(Four::read(four)));
        if above != 0 {
            return Some(at + above.trailing_zeros() as usize);
        }
    }
    None
}

/// The last candidate with a weight, where rounding carried a threshold to the sum of all.
#[cold]
fn last_picked(sums: &[f32]) -> usize {
    let total = sums.last().copied().unwrap_or(0.0);
    sums.iter().position(|&sum| sum == total).unwrap_or(0)
}
