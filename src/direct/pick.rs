//! Systematic picks: of all candidates as many as there are rays, each as often as its share of the weights says. But of several rays an
//! eighth, at least one, goes to the candidates that bring something and less than the mean.
//!
//! Where the brightest light is blocked, only those bring anything. Each of the two sets is picked from by itself, so that the sum is exact
//! where nothing is blocked, however the rays are shared out: stratified sampling with a least allocation.

use super::candidates::{Candidates, FLOOR};

/// Sums of weights from here on are too close to the end of f32 to work with: every candidate that counts is then as good as another.
const LARGEST: f32 = f32::MAX / 4.0;
/// From so many rays on some are kept for faint candidates.
const SEVERAL: usize = 4;
/// One of so many rays.
const KEPT: usize = 8;

/// Picks from the candidates of a set.
#[derive(Clone, Copy, Default)]
struct Picks {
    /// The sum of the weights of one ray.
    step: f32,
    /// Rays, and how many are taken.
    rays: usize,
    taken: usize,
    /// The sum of the weights before the candidate.
    before: f32,
    /// The last candidate takes what rounding leaves.
    last: Option<usize>,
}

impl Picks {
    /// How many rays candidate `i` gets.
    #[inline(always)]
    fn take(&mut self, i: usize, weight: f32, u: f32) -> usize {
        let end = if self.last == Some(i) { f32::INFINITY } else { self.before + weight };
        self.before = end;
        let first = self.taken;
        while self.taken < self.rays && (self.taken as f32 + u) * self.step < end {
            self.taken += 1;
        }
        self.taken - first
    }
}

/// Picks `rays` candidates, merged where one is picked more than once, and hands their number, direction and weight to `put`.
/// Answers how many there are: none if no candidate counts.
#[inline(always)]
pub fn pick(candidates: &mut Candidates<'_>, rays: usize, u: f32, mut put: impl FnMut(usize, [f32; 3], f32)) -> usize {
    let Candidates { x, y, z, density, weight } = candidates;
    let sum: f32 = weight.iter().sum();
    // Without any target every candidate that counts is as good as another.
    let (scale, least) = if sum > 0.0 && sum < LARGEST { (1.0, FLOOR * sum / weight.len() as f32) } else { (0.0, 1.0) };
    let (mut totals, mut last) = ([0.0; 2], [None; 2]);
    let mean = sum * scale / weight.len() as f32;
    let is_faint = |weight: f32| least < weight && weight <= mean;
    for (i, (weight, density)) in weight.iter_mut().zip(density.iter()).enumerate() {
        *weight = if *density < f32::INFINITY { *weight * scale + least } else { 0.0 };
        let set = usize::from(is_faint(*weight));
        totals[set] += *weight;
        if *weight > 0.0 {
            last[set] = Some(i);
        }
    }
    let total = totals[0] + totals[1];
    let kept = (rays / KEPT).max(1);
    let splits = rays >= SEVERAL && totals[1] > 0.0 && totals[1] * (rays as f32) < total * kept as f32;
    let mut sets = if splits {
        [0, 1].map(|set: usize| {
            let rays = if set == 0 { rays - kept } else { kept };
            Picks { step: totals[set] / rays as f32, rays, last: last[set], ..Picks::default() }
        })
    } else {
        [Picks { step: total / rays as f32, rays, last: last[0].max(last[1]), ..Picks::default() }, Picks::default()]
    };
    let mut written = 0;
    let columns = x.iter().zip(y.iter()).zip(z.iter()).zip(density.iter()).zip(weight.iter());
    for (i, ((((x, y), z), density), &w)) in columns.enumerate() {
        if !(w > 0.0) {
            continue;
        }
        let set = &mut sets[usize::from(splits && is_faint(w))];
        let times = set.take(i, w, u);
        if times > 0 {
            put(written, [*x, *y, *z], (times as f32 * set.step / (w * density)).min(f32::MAX));
            written += 1;
        }
        if sets[0].taken + sets[1].taken == rays {
            break;
        }
    }
    written
}
