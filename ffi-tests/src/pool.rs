//! Pooled resampling: all candidates of a pixel along the Morton curve of the octahedron, picked systematically.

use crate::batch::Batch;
use crate::lanes::{F8, LANES, V8};
use glam::Vec3;
use wide::{CmpLt, i32x8};

/// A direction to trace and what it adds to the estimate if it is not blocked.
#[derive(Clone, Copy, Debug)]
pub struct Pick {
    pub wi: Vec3,
    pub contribution: f32,
}

/// Candidates along the curve.
#[derive(Default)]
pub struct Curve {
    /// Place on the Morton curve, then number.
    ordered: Vec<u32>,
}

/// A number fits below the place on the curve.
const NUMBER_BITS: u32 = 14;
/// Levels of the octahedral square in a place.
const LEVELS: u32 = 9;

impl Curve {
    /// Systematic picks along the curve from a batch of weighed samples.
    pub fn pick(&mut self, batch: &Batch, n: usize, offset: f32, picks: &mut Vec<Pick>) {
        self.order(batch);
        let number = |key: u32| (key & ((1 << NUMBER_BITS) - 1)) as usize;
        let sum: f32 = self.ordered.iter().map(|&key| batch.reflected(number(key))).sum();
        let (mut passed, mut taken) = (0.0, 0);
        let scale = n as f32 / sum;
        for &key in &self.ordered {
            let c = number(key);
            passed += batch.reflected(c);
            let up_to = ((passed * scale - offset).ceil().max(0.0) as usize).min(n);
            if up_to > taken {
                let contribution = sum / n as f32 * (up_to - taken) as f32;
                picks.push(Pick { wi: batch.wi().get(c), contribution });
                taken = up_to;
            }
        }
    }

    /// Those that can be picked, along the Morton curve.
    fn order(&mut self, batch: &Batch) {
        assert!(batch.len() < 1 << NUMBER_BITS);
        self.ordered.clear();
        for first in (0..batch.len()).step_by(LANES) {
            let places = octahedral_morton(batch.wi().load(first));
            let lanes = places.into_iter().zip(first..batch.len());
            let kept = lanes.filter(|&(_, i)| batch.reflected(i) > 0.0);
            self.ordered.extend(kept.map(|(place, i)| (place as u32) << NUMBER_BITS | i as u32));
        }
        self.ordered.sort_unstable();
    }
}

/// The Morton codes of directions on the octahedral square.
#[inline]
fn octahedral_morton(d: V8) -> [i32; LANES] {
    let norm = d.x.abs() + d.y.abs() + d.z.abs();
    let (x, y) = (d.x / norm, d.y / norm);
    let fold = |a: F8, b: F8| (F8::ONE - b.abs()).copysign(a);
    let south = d.z.cmp_lt(F8::ZERO);
    let (x, y) = (south.blend(fold(x, y), x), south.blend(fold(y, x), y));
    let side = (1 << LEVELS) as f32;
    let cell = |c: F8| ((c * F8::HALF + F8::HALF) * F8::splat(side)).fast_trunc_int();
    let clamped = |c: i32x8| c.max(i32x8::splat(0)).min(i32x8::splat(side as i32 - 1));
    let [x, y] = [x, y].map(|c| spread(clamped(cell(c))));
    (x | (y << 1_i32)).to_array()
}

/// Moves bit i to bit 2 i.
#[inline]
fn spread(bits: i32x8) -> i32x8 {
    let step = |bits: i32x8, by: i32, mask: i32| (bits | (bits << by)) & i32x8::splat(mask);
    step(step(step(step(bits, 8, 0x00ff_00ff), 4, 0x0f0f_0f0f), 2, 0x3333_3333), 1, 0x5555_5555)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_on_the_curve_are_neighbours_on_the_sphere() {
        let place = |d: Vec3| octahedral_morton(V8::splat(d))[0];
        assert_eq!(spread(i32x8::splat(0b1011)).to_array()[0], 0b100_0101);
        assert_ne!(place(Vec3::Z), place(Vec3::NEG_Z));
        let near = Vec3::new(0.3, 0.4, 0.5).normalize();
        assert_eq!(place(near), place((near + Vec3::splat(1e-6)).normalize()));
    }
}
