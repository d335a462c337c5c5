//! Directions in world space from what was drawn in the tables, and the light alone as a density.
//!
//! The pdf is one function of the f32 world direction; a sample's pdf is that function at the direction it returns. Where
//! rounding carried a direction out of its patch, the position moves towards the patch's middle until the direction is inside.

use super::tables::{Drawn, Light, Located, at, int_at, set};
use crate::numeric::ONE_MINUS_EPSILON;
use crate::simd::Num;
use crate::sphere::Frame;
use glam::Vec3;

/// The first step towards the middle of a patch, as a share of the way; it doubles until it is all of it.
const FIRST_STEP: f32 = 1.0 / (1 << 22) as f32;

/// Directions of map space in world space.
#[inline(always)]
pub fn to_world<F: Num>(frame: &Frame, [x, y, z]: [F; 3]) -> [F; 3] {
    let [a, b, c, d, e, f, g, h, i] = frame.to_array();
    [dot(a, d, g, [x, y, z]), dot(b, e, h, [x, y, z]), dot(c, f, i, [x, y, z])]
}

/// Directions of world space in map space.
#[inline(always)]
pub fn to_map<F: Num>(frame: &Frame, [x, y, z]: [F; 3]) -> [F; 3] {
    let [a, b, c, d, e, f, g, h, i] = frame.to_array();
    [dot(a, b, c, [x, y, z]), dot(d, e, f, [x, y, z]), dot(g, h, i, [x, y, z])]
}

#[inline(always)]
fn dot<F: Num>(a: f32, b: f32, c: f32, [x, y, z]: [F; 3]) -> F {
    F::splat(a) * x + F::splat(b) * y + F::splat(c) * z
}

/// Directions normalised, and which of them are of unit length, within 1e-3 of the square; others mean nothing.
#[inline(always)]
pub fn unit<F: Num>([x, y, z]: [F; 3]) -> ([F; 3], F::Mask) {
    let squared = x * x + y * y + z * z;
    let unit = (squared - F::splat(1.0)).abs().lt(F::splat(1e-3));
    let scale = F::splat(1.0) / squared.sqrt();
    ([x * scale, y * scale, z * scale], unit)
}

/// Numbers moved into [0, 1 - 2^-24]; NaN counts as 1/2.
#[inline(always)]
pub fn clamp_u<F: Num>(u: F) -> F {
    // Only a NaN is neither below nor above 1/2.
    let number = F::or(u.le(F::splat(0.5)), F::splat(0.5).le(u));
    F::select(number, u.max(F::splat(0.0)).min(F::splat(ONE_MINUS_EPSILON)), F::splat(0.5))
}

impl Light<'_> {
    /// World directions of drawn places, and where those directions are in the tables.
    #[inline(always)]
    pub fn to_world<F: Num>(&self, frame: &Frame, drawn: &Drawn<F>) -> ([F; 3], Located<F>) {
        let mut world = to_world(frame, self.direction_of(drawn));
        let (mut located, strayed) = self.relocate(to_map(frame, unit(world).0), drawn);
        let mut strayed = F::bits(strayed);
        while strayed != 0 {
            let lane = strayed.trailing_zeros() as usize;
            strayed &= strayed - 1;
            let numbers = [at::<F>(&drawn.numbers[0], lane), at::<F>(&drawn.numbers[1], lane)];
            let (direction, found) = self.settle(frame, int_at::<F>(&drawn.patch.cell, lane), numbers);
            for (axis, x) in world.iter_mut().zip(direction) {
                set(axis, lane, x);
            }
            located.set(lane, &found);
        }
        (world, located)
    }

    /// What the numbers of a cell lead to, moved until it is found where it was drawn.
    #[cold]
    #[inline(never)]
    fn settle(&self, frame: &Frame, cell: u32, numbers: [f32; 2]) -> ([f32; 3], Located<f32>) {
        let drawn = self.sample_in::<f32>([cell], numbers);
        let mut step = FIRST_STEP;
        loop {
            let position = drawn.position.map(|x| x + (0.5 - x) * step);
            let world = to_world(frame, self.direction_of(&Drawn { position, ..drawn }));
            let map = to_map(frame, unit(world).0);
            let (located, strayed) = self.relocate(map, &drawn);
            if !strayed {
                return (world, located);
            }
            if step >= 1.0 {
                // A patch smaller than what an f32 direction can tell apart.
                return (world, self.locate(map, true));
            }
            step *= 2.0;
        }
    }

    /// World directions distributed as the light, and their densities; 0 if the light is black.
    #[inline(always)]
    pub fn sample<F: Num>(&self, frame: &Frame, u: [F; 2]) -> ([F; 3], F) {
        let (cells, numbers) = self.cells_at::<F>([clamp_u(u[0]), clamp_u(u[1])]);
        let drawn = self.draw::<F>(cells, numbers);
        let (world, located) = self.to_world(frame, &drawn);
        (world, self.alone(&located))
    }

    /// Directions of map space distributed as the light, and their densities: for candidates, which need no pdf of an f32 world
    /// direction.
    #[inline(always)]
    pub fn candidates<F: Num>(&self, u: [F; 2]) -> ([F; 3], F) {
        let (cells, numbers) = self.cells_at::<F>([clamp_u(u[0]), clamp_u(u[1])]);
        let drawn = self.draw::<F>(cells, numbers);
        let direction = self.direction_of(&drawn);
        (direction, self.alone(&self.drawn_at(direction, &drawn)))
    }

    /// Densities of directions of map space of unit length in the light.
    #[inline(always)]
    pub fn density<F: Num>(&self, d: [F; 3]) -> F {
        self.alone(&self.locate(d, false))
    }

    /// Densities of world directions in the light; 0 for those that are not of unit length.
    #[inline(always)]
    pub fn pdf<F: Num>(&self, frame: &Frame, wi: [F; 3]) -> F {
        let (world, valid) = unit(wi);
        let [x, y, z] = world;
        let world = [F::only(valid, x), F::only(valid, y), F::select(valid, z, F::splat(1.0))];
        F::only(valid, self.alone(&self.locate(to_map(frame, world), false)))
    }

    /// The density in the light of what was located.
    #[inline(always)]
    fn alone<F: Num>(&self, located: &Located<F>) -> F {
        let cells = located.patch.cell;
        let mut probability = F::floats();
        for (out, &cell) in probability.as_mut().iter_mut().zip(cells.as_ref()) {
            *out = self.cells.get(cell as usize).map_or(0.0, |c| c.probability);
        }
        F::load(probability) * located.density
    }

    /// The `u` that leads to a world direction of unit length, and whether it does: `None` if its density is 0.
    pub fn invert(&self, frame: &Frame, wi: Vec3) -> Option<[f32; 2]> {
        let located = self.locate::<f32>(to_map(frame, wi.to_array()), true);
        if !(self.alone(&located) > 0.0) {
            return None;
        }
        let numbers = located.numbers(self);
        let [cell] = located.patch.cell;
        let range = self.cell_range(cell as usize);
        Some([0, 1].map(|k: usize| (range[k].0 + numbers[k] * range[k].1).min(ONE_MINUS_EPSILON)))
    }
}
