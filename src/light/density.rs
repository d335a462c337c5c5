//! Directions in world space from what was drawn in the tables, and the light alone as a density.
//!
//! The pdf is one function of the f32 world direction; a sample's pdf is that function at the direction it returns. Where
//! rounding carried a direction out of its patch, the position moves towards the patch's middle until the direction is inside.

use super::batch::Density;
use super::tables::{Light, Located};
pub use super::walk::clamp_u;
pub(crate) use super::walk::lane_of;
use super::walk::set;
use crate::numeric::{self, ONE_MINUS_EPSILON};
use crate::sample::Sample;
use crate::simd::{Apart, Num, prefetch};
use crate::sphere::{Frame, UNIT};
use crate::status::{Result, Status};

/// The first step towards the middle of a patch, as a share of the way; it doubles until it is all of it.
const FIRST_STEP: f32 = 1.0 / (1 << 22) as f32;

/// Directions normalised, and which of them are of unit length, within 1e-3; others mean nothing.
#[inline(always)]
pub fn unit<F: Num>([x, y, z]: [F; 3]) -> ([F; 3], F::Mask) {
    let squared = x * x + y * y + z * z;
    let from_one = squared - F::splat(1.0);
    let unit = from_one.abs().lt(F::splat(UNIT));
    // The series of the reciprocal root about 1: within 3e-9 of it.
    let scale = F::splat(1.5) - F::splat(0.5) * squared + F::splat(0.375) * from_one * from_one;
    ([x * scale, y * scale, z * scale], unit)
}

/// Replaces the samples of the lanes of which the bits are set.
#[inline(always)]
pub(crate) fn settle_lanes<F: Num>(mut lanes: u32, world: &mut [F; 3], pdf: &mut F, settled: impl Fn(usize) -> Sample) {
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize;
        lanes &= lanes - 1;
        let drawn = settled(lane);
        for (axis, x) in world.iter_mut().zip(drawn.wi) {
            set(axis, lane, x);
        }
        set(pdf, lane, drawn.pdf);
    }
}

impl Light<'_> {
    /// World directions that numbers of cells lead to, where those directions are in the tables (`numbered`: with their own numbers), and the bits
    /// of the lanes in which rounding carried them out of their patches: those have to be settled.
    #[inline(always)]
    pub fn lead<F: Num>(
        &self,
        frame: &Frame,
        cells: F::Ints,
        numbers: [F; 2],
        numbered: bool,
    ) -> ([F; 3], Located<F>, u32) {
        F::apart(Lead { light: self, frame, cells, numbers, numbered, step: 0.0 })
    }

    /// The sample of `u`, settled.
    #[cold]
    #[inline(never)]
    fn settled(&self, frame: &Frame, u: [f32; 2]) -> Sample {
        let ([cell], numbers) = self.cells_of::<f32>(u);
        let (wi, located) = self.settle(frame, cell, numbers);
        Sample { wi, pdf: located.alone }
    }

    /// What the numbers of a cell lead to, moved until it is found where it was drawn.
    #[inline(never)]
    pub(crate) fn settle(&self, frame: &Frame, cell: u32, numbers: [f32; 2]) -> ([f32; 3], Located<f32>) {
        let mut step = FIRST_STEP;
        loop {
            let (world, located, strayed) =
                f32::apart(Lead { light: self, frame, cells: [cell], numbers, numbered: true, step });
            if strayed == 0 {
                return (world, located);
            }
            if step >= 1.0 {
                // A patch smaller than what an f32 direction can tell apart.
                return (world, self.locate(frame.to_map(unit(world).0), true));
            }
            step *= 2.0;
        }
    }

    #[inline(always)]
    fn cells_of<F: Num>(&self, u: [F; 2]) -> (F::Ints, [F; 2]) {
        let (mut cells, mut numbers) = (F::ints(), [clamp_u(u[0]).store(), clamp_u(u[1]).store()]);
        let [across, down] = &mut numbers;
        for ((cell, w), v) in cells.as_mut().iter_mut().zip(across.as_mut()).zip(down.as_mut()) {
            let found = self.cell_at(&self.tops, [*w, *v]);
            prefetch(self.cells, found.0);
            *cell = found.0 as u32;
            [*w, *v] = found.1;
        }
        (cells, [F::load(numbers[0]), F::load(numbers[1])])
    }

    /// World directions of unit length in map space; in place of others, some that are.
    #[inline(always)]
    pub(crate) fn valid<F: Num>(&self, frame: &Frame, wi: [F; 3]) -> ([F; 3], F::Mask) {
        let ([x, y, z], valid) = unit(wi);
        (frame.to_map([F::only(valid, x), F::only(valid, y), F::select(valid, z, F::splat(1.0))]), valid)
    }

    /// The `u` that leads to a world direction of unit length: into the same patch, and there within 2^-22 of `u` over the
    /// patch's share of `u`, along each axis. The direction is normalised as [`Density::pdf`] does it, or rounding would part them.
    pub fn invert(&self, frame: &Frame, wi: [f32; 3]) -> Inverted {
        let (map, _) = self.valid(frame, wi);
        let located = self.locate::<f32>(map, true);
        if !(located.alone > 0.0) {
            return Inverted::Zero;
        }
        let [cell] = located.cell;
        let range = self.cell_range(cell as usize);
        let outer =
            |numbers: [f32; 2]| [0, 1].map(|k: usize| (range[k].0 + numbers[k] * range[k].1).min(ONE_MINUS_EPSILON));
        let leads = |u: &[f32; 2]| {
            let (cell, numbers) = self.cells_of::<f32>(*u);
            located.is_in_patch_of(&self.lead::<f32>(frame, cell, numbers, false).1)
        };
        inward(located.numbers, located.middle(), outer, leads)
    }
}

impl Density for Light<'_> {
    #[inline(always)]
    fn sample<F: Num>(&self, frame: &Frame, u: [F; 2]) -> ([F; 3], F) {
        let (cells, numbers) = self.cells_of(u);
        let (mut world, Located { alone: mut pdf, .. }, strayed) = self.lead(frame, cells, numbers, false);
        settle_lanes(strayed, &mut world, &mut pdf, |lane| self.settled(frame, lane_of(u, lane)));
        (world, pdf)
    }

    #[inline(always)]
    fn pdf<F: Num>(&self, frame: &Frame, wi: [F; 3]) -> F {
        let (map, valid) = self.valid(frame, wi);
        F::only(valid, self.locate(map, false).alone)
    }
}

/// [`Light::lead`].
struct Lead<'a, F: Num> {
    light: &'a Light<'a>,
    frame: &'a Frame,
    cells: F::Ints,
    numbers: [F; 2],
    numbered: bool,
    /// How far positions move towards the middle of their patches, as a share of the way.
    step: f32,
}

impl<F: Num> Apart<F> for Lead<'_, F> {
    type Output = ([F; 3], Located<F>, u32);

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Lead { light, frame, cells, numbers, numbered, step } = self;
        let mut drawn = light.sample_in::<F>(cells, numbers);
        if step > 0.0 {
            let moved = |x: F| x + (F::splat(0.5) - x) * step;
            drawn.position = [moved(drawn.position[0]), moved(drawn.position[1])];
        }
        let world = frame.to_world(light.direction_of(&drawn));
        let (located, strayed) = light.relocate(frame.to_map(unit(world).0), &drawn);
        (world, located.located(numbered), F::bits(strayed))
    }
}

/// Of numbers in a cell, from the exact ones to those of the patch's middle in steps that double, the first whose `u` leads into the patch:
/// at its border and where it is narrow, the exact ones may round into the next one.
pub(crate) fn inward(
    exact: [f32; 2],
    middle: [f32; 2],
    outer: impl Fn([f32; 2]) -> [f32; 2],
    leads: impl Fn(&[f32; 2]) -> bool,
) -> Inverted {
    let mut step = 0.0;
    loop {
        let u = outer([0, 1].map(|k: usize| exact[k] * (1.0 - step) + middle[k] * step));
        if leads(&u) {
            return Inverted::To(u);
        }
        if step >= 1.0 {
            return Inverted::Unreachable;
        }
        step = (2.0 * step).max(FIRST_STEP);
    }
}

/// What leads to a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Inverted {
    /// This `u`.
    To([f32; 2]),
    /// The density is above 0, but no `u` of 24 bits leads into the direction's patch: its share of `u` is too small.
    Unreachable,
    /// Nothing: the density is 0.
    Zero,
}

impl Inverted {
    /// The numbers that lead there, as sampling takes them.
    ///
    /// # Errors
    /// [`Status::Unreachable`], [`Status::ZeroDensity`].
    pub fn numbers(self) -> Result<[f32; 2]> {
        match self {
            Inverted::To(u) => Ok(u.map(numeric::clamp_u)),
            Inverted::Unreachable => Err(Status::Unreachable),
            Inverted::Zero => Err(Status::ZeroDensity),
        }
    }
}
