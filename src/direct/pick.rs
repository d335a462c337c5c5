//! Systematic picks: of all candidates as many as there are rays, each as often as its share of the weights says.

use super::candidates::{Candidates, FLOOR};

/// Picks `rays` candidates, merged where one is picked more than once, and hands their number, direction and weight to `put`.
/// Answers how many there are: none if no candidate counts.
#[inline(always)]
pub fn pick(candidates: &Candidates<'_>, rays: usize, u: f32, mut put: impl FnMut(usize, [f32; 3], f32)) -> usize {
    let Candidates { x, y, z, density, weight } = candidates;
    let count = weight.len();
    let sum: f32 = weight.iter().sum();
    let counted = density.iter().filter(|d| **d < f32::INFINITY).count();
    if counted == 0 || count == 0 {
        return 0;
    }
    // Without any target every candidate that counts is as good as another.
    let scale = if sum > 0.0 && sum < f32::INFINITY { 1.0 } else { 0.0 };
    let least = if scale > 0.0 { FLOOR * sum / count as f32 } else { 1.0 };
    let of = |i: usize| {
        let d = density.get(i).copied().unwrap_or(f32::INFINITY);
        if d < f32::INFINITY { weight.get(i).copied().unwrap_or(0.0) * scale + least } else { 0.0 }
    };
    let total: f32 = (0..count).map(of).sum();
    let step = total / rays as f32;
    let mut next = u * step;
    let (mut before, mut taken) = (0.0f32, 0);
    let mut written = 0;
    // The last candidate takes what rounding leaves.
    let last = (0..count).rev().find(|&i| of(i) > 0.0);
    for i in 0..count {
        let w = of(i);
        if !(w > 0.0) {
            continue;
        }
        let end = if Some(i) == last { f32::INFINITY } else { before + w };
        let mut times = 0;
        while next < end && taken < rays {
            times += 1;
            taken += 1;
            next = (taken as f32 + u) * step;
        }
        before = end;
        if times > 0 {
            let at = |v: &[f32]| v.get(i).copied().unwrap_or(0.0);
            put(written, [at(x), at(y), at(z)], times as f32 * step / (w * at(density)));
            written += 1;
        }
    }
    written
}
