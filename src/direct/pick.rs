//! Systematic picks: of all candidates as many as there are rays, each as often as its share of the weights says.

use super::candidates::{Candidates, FLOOR};

/// Sums of weights from here on are too close to the end of f32 to work with: every candidate that counts is then as good as another.
const LARGEST: f32 = f32::MAX / 4.0;

/// Picks `rays` candidates, merged where one is picked more than once, and hands their number, direction and weight to `put`.
/// Answers how many there are: none if no candidate counts.
#[inline(always)]
pub fn pick(candidates: &mut Candidates<'_>, rays: usize, u: f32, mut put: impl FnMut(usize, [f32; 3], f32)) -> usize {
    let Candidates { x, y, z, density, weight } = candidates;
    let sum: f32 = weight.iter().sum();
    // Without any target every candidate that counts is as good as another.
    let (scale, least) = if sum > 0.0 && sum < LARGEST { (1.0, FLOOR * sum / weight.len() as f32) } else { (0.0, 1.0) };
    let (mut total, mut last) = (0.0, None);
    for (i, (weight, density)) in weight.iter_mut().zip(density.iter()).enumerate() {
        *weight = if *density < f32::INFINITY { *weight * scale + least } else { 0.0 };
        total += *weight;
        if *weight > 0.0 {
            // The last candidate takes what rounding leaves.
            last = Some(i);
        }
    }
    let Some(last) = last else { return 0 };
    let step = total / rays as f32;
    let mut next = u * step;
    let (mut before, mut taken) = (0.0f32, 0);
    let mut written = 0;
    let columns = x.iter().zip(y.iter()).zip(z.iter()).zip(density.iter()).zip(weight.iter());
    for (i, ((((x, y), z), density), &w)) in columns.enumerate() {
        let end = if i == last { f32::INFINITY } else { before + w };
        before = end;
        if !(w > 0.0) {
            continue;
        }
        let mut times = 0;
        while next < end && taken < rays {
            times += 1;
            taken += 1;
            next = (taken as f32 + u) * step;
        }
        if times > 0 {
            put(written, [*x, *y, *z], (times as f32 * step / (w * density)).min(f32::MAX));
            written += 1;
        }
        if taken == rays {
            break;
        }
    }
    written
}
