//! Directions in world space from what was drawn in the tables, and the light alone as a density.
//!
//! The pdf is one function of the f32 world direction; a sample's pdf is that function at the direction it returns. Where
//! rounding carried a direction out of its patch, the position moves towards the patch's middle until the direction is inside.

use super::batch::{Density, columns, write_lanes};
use super::chart::Place;
use super::tables::{Drawn, Light, Located};
pub use super::walk::clamp_u;
use super::walk::{Floats, TOGETHER, Walk, floats, put, set, within};
use crate::numeric::{self, ONE_MINUS_EPSILON};
use crate::sample::Sample;
use crate::simd::{Num, prefetch};
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

/// The numbers of a lane.
#[inline(always)]
pub(crate) fn of_lane<F: Num>(u: [F; 2], lane: usize) -> [f32; 2] {
    u.map(|u| u.store().as_ref().get(lane).copied().unwrap_or(0.5))
}

impl Light<'_> {
    /// World directions of drawn places, where those directions are in the tables, and the bits of the lanes in which rounding carried
    /// them out of their patches: those have to be settled.
    #[inline(always)]
    pub fn to_world<F: Num>(&self, frame: &Frame, drawn: &Drawn<F>) -> ([F; 3], Located<F>, u32) {
        let (world, position, density, strayed) =
            if F::WIDTH == 1 { self.in_world_apart(frame, drawn) } else { self.in_world_here(frame, drawn) };
        (world, Located { patch: drawn.patch, position, density }, strayed)
    }

    /// One by one many need it.
    #[inline(never)]
    fn in_world_apart<F: Num>(&self, frame: &Frame, drawn: &Drawn<F>) -> ([F; 3], [F; 2], F, u32) {
        self.in_world_here(frame, drawn)
    }

    /// The directions, their positions in the patches, their densities there, and the bits of those that strayed.
    #[inline(always)]
    fn in_world_here<F: Num>(&self, frame: &Frame, drawn: &Drawn<F>) -> ([F; 3], [F; 2], F, u32) {
        let world = frame.to_world(self.direction_of(drawn));
        let (Located { position, density, .. }, strayed) = self.relocate(frame.to_map(unit(world).0), drawn);
        (world, position, density, F::bits(strayed))
    }

    /// The sample of `u`, settled.
    #[cold]
    #[inline(never)]
    fn settled(&self, frame: &Frame, u: [f32; 2]) -> Sample {
        let (cell, numbers) = self.cell_at(&self.tops, u.map(clamp_u));
        let (wi, located) = self.settle(frame, cell as u32, numbers);
        Sample { wi, pdf: self.alone(&located) }
    }

    /// What the numbers of a cell lead to, moved until it is found where it was drawn.
    #[inline(never)]
    pub(crate) fn settle(&self, frame: &Frame, cell: u32, numbers: [f32; 2]) -> ([f32; 3], Located<f32>) {
        let drawn = self.sample_in::<f32>([cell], numbers);
        let mut step = FIRST_STEP;
        loop {
            let position = drawn.position.map(|x| x + (0.5 - x) * step);
            let (world, located, strayed) = self.to_world(frame, &Drawn { position, ..drawn });
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
    fn draw_alone<F: Num>(&self, u: [F; 2]) -> Drawn<F> {
        let (mut cells, mut numbers) = (F::ints(), u.map(|u| clamp_u(u).store()));
        let [across, down] = &mut numbers;
        for ((cell, w), v) in cells.as_mut().iter_mut().zip(across.as_mut()).zip(down.as_mut()) {
            let found = self.cell_at(&self.tops, [*w, *v]);
            prefetch(self.cells, found.0);
            *cell = found.0 as u32;
            [*w, *v] = found.1;
        }
        self.sample_in(cells, numbers.map(F::load))
    }

    /// World directions and their densities of the lanes of a walk from `first` on; and the bits of those that have to be settled.
    #[inline(never)]
    fn ended<F: Num>(
        &self,
        frame: &Frame,
        walk: &Walk<'_, TOGETHER>,
        numbers: &[Floats<TOGETHER>; 2],
        first: usize,
    ) -> ([F; 3], F, u32) {
        let (world, located, strayed) = self.to_world(frame, &walk.drawn::<F>(self, numbers, None, first));
        (world, self.alone(&located), strayed)
    }

    /// Replaces the pdfs of the lanes of which the bits are set.
    #[cold]
    #[inline(never)]
    fn pdfs_one_by_one(&self, frame: &Frame, wi: &[[f32; 3]], out: &mut [f32], lanes: u32) {
        for (_, (&wi, out)) in wi.iter().zip(out).enumerate().filter(|(lane, _)| (lanes >> lane) & 1 != 0) {
            *out = self.pdf::<f32>(frame, wi);
        }
    }

    /// Densities of directions of map space of unit length in the light.
    #[inline(never)]
    pub fn density<F: Num>(&self, d: [F; 3]) -> F {
        self.alone(&self.locate_here(d, false, true))
    }

    /// World directions of unit length in map space; in place of others, some that are.
    #[inline(always)]
    pub(crate) fn valid<F: Num>(&self, frame: &Frame, wi: [F; 3]) -> ([F; 3], F::Mask) {
        let ([x, y, z], valid) = unit(wi);
        (frame.to_map([F::only(valid, x), F::only(valid, y), F::select(valid, z, F::splat(1.0))]), valid)
    }

    /// The density in the light of what was located.
    #[inline(always)]
    pub(crate) fn alone<F: Num>(&self, located: &Located<F>) -> F {
        located.patch.light * located.density
    }

    /// The `u` that leads to a world direction of unit length: into the same patch, and there within 2^-22 of `u` over the
    /// patch's share of `u`, along each axis. The direction is normalised as [`Density::pdf`] does it, or rounding would part them.
    pub fn invert(&self, frame: &Frame, wi: [f32; 3]) -> Inverted {
        let (map, _) = self.valid(frame, wi);
        let located = self.locate::<f32>(map, true);
        if !(self.alone(&located) > 0.0) {
            return Inverted::Zero;
        }
        let [cell] = located.patch.cell;
        let range = self.cell_range(cell as usize);
        let outer =
            |numbers: [f32; 2]| [0, 1].map(|k: usize| (range[k].0 + numbers[k] * range[k].1).min(ONE_MINUS_EPSILON));
        let leads = |u: &[f32; 2]| located.is_in_patch_of(&self.draw_alone::<f32>(*u));
        inward(located.numbers(), located.middle(), outer, leads)
    }
}

impl Density for Light<'_> {
    #[inline(always)]
    fn sample<F: Num>(&self, frame: &Frame, u: [F; 2]) -> ([F; 3], F) {
        let (mut world, located, strayed) = self.to_world(frame, &self.draw_alone(u));
        let mut pdf = self.alone(&located);
        settle_lanes(strayed, &mut world, &mut pdf, |lane| self.settled(frame, of_lane(u, lane)));
        (world, pdf)
    }

    // Walks go on side by side.
    #[inline(always)]
    fn samples<F: Num>(&self, frame: &Frame, u: &[[f32; 2]], out: &mut [Sample]) {
        let (mut walk, mut numbers) = (Walk::<TOGETHER>::new(), [[0.5; TOGETHER]; 2]);
        for (u, out) in u.chunks(TOGETHER).zip(out.chunks_mut(TOGETHER)) {
            let count = u.len().next_multiple_of(F::WIDTH);
            walk.begin(self, u, &mut numbers, count);
            walk.down(self, &mut numbers, None, count);
            for (group, (u, out)) in u.chunks(F::WIDTH).zip(out.chunks_mut(F::WIDTH)).enumerate() {
                let (mut world, mut pdf, strayed) = self.ended::<F>(frame, &walk, &numbers, group * F::WIDTH);
                let of = |lane: usize| self.settled(frame, u.get(lane).copied().unwrap_or_default());
                settle_lanes(strayed, &mut world, &mut pdf, of);
                write_lanes(world, pdf, out);
            }
        }
    }

    #[inline(always)]
    fn pdf<F: Num>(&self, frame: &Frame, wi: [F; 3]) -> F {
        let (map, valid) = self.valid(frame, wi);
        F::only(valid, self.density(map))
    }

    // Walks go on side by side.
    #[inline(always)]
    fn pdfs<F: Num>(&self, frame: &Frame, wi: &[[f32; 3]], out: &mut [f32]) {
        let mut walk = Walk::<TOGETHER>::new();
        // Of each lane: the position, the solid angle, and whether it is of unit length.
        let mut places = [[0.5; TOGETHER]; 4];
        for (wi, out) in wi.chunks(TOGETHER).zip(out.chunks_mut(TOGETHER)) {
            for (group, wi) in wi.chunks(F::WIDTH).enumerate() {
                let first = group * F::WIDTH;
                let (map, valid) = self.valid(frame, columns::<F, 3>(wi));
                let place = self.chart.place(map);
                let [columns, rows] = self.chart.axes;
                let at = [columns.patch(place.position[0]), rows.patch(place.position[1])];
                walk.put_places::<F>(first, place.face.truncate(), at);
                let valid = F::only(valid, F::splat(1.0));
                let numbers = [place.position[0], place.position[1], place.solid_angle, valid];
                for (out, number) in places.iter_mut().zip(numbers) {
                    put(out, first, number.store().as_ref());
                }
            }
            walk.at(self, None, wi.len().next_multiple_of(F::WIDTH));
            for (group, out) in out.chunks_mut(F::WIDTH).enumerate() {
                let first = group * F::WIDTH;
                let patch = walk.patches::<F>(self, None, first);
                let [column, row, solid_angle, valid] = &places;
                let place = Place {
                    face: F::splat(0.0),
                    position: [floats::<F, TOGETHER>(column, first), floats::<F, TOGETHER>(row, first)],
                    solid_angle: floats::<F, TOGETHER>(solid_angle, first),
                };
                let valid = F::splat(0.0).lt(floats::<F, TOGETHER>(valid, first));
                let located = within(&patch, &place);
                let pdf = F::only(valid, self.alone(&located)).store();
                for (out, &pdf) in out.iter_mut().zip(pdf.as_ref()) {
                    *out = pdf;
                }
                let dark = F::bits(F::and(valid, self.dark_at_border(&located, &place)));
                if dark != 0 {
                    self.pdfs_one_by_one(frame, wi.get(first..).unwrap_or(&[]), out, dark);
                }
            }
        }
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
