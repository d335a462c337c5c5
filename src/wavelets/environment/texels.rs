//! A distribution over the texels of a map: exact where the light is, and found without a walk.
//!
//! What a product multiplies must be a tree; the compensated distribution is only ever sampled, so it keeps the texels
//! as they are: a row and a column by table, then a direction. The pdf of a direction is a look-up of its texel. Sample
//! and pdf agree to the bit, since both multiply the same numbers.

use super::inverse::{self, Inverse, Span};
use super::shape::{RowNumbers, Shape, Texel};
use crate::numeric::{ContentHash, max, min};
use crate::sphere::{Frame, unit};
use crate::status::{Result, Status};
use crate::wavelets::descent::{ONE_MINUS_EPSILON, Sample, Sampled, clamp};
use core::marker::PhantomData;

/// A distribution over the texels of a map.
#[derive(Clone, Copy, Debug)]
pub struct TexelMap<'a, S> {
    /// The mean of the values over the sphere; 0 if there is nothing to sample.
    average: f32,
    pub(super) inverse: Inverse<'a>,
    pub(super) rows: &'a [RowNumbers],
    shape: PhantomData<S>,
}

impl<'a, S: Shape> TexelMap<'a, S> {
    /// A view of what [`TexelMap::fill`] wrote. Other numbers give meaningless directions, but never a panic.
    #[inline(always)]
    pub fn trusted(average: f32, inverse: Inverse<'a>, rows: &'a [RowNumbers]) -> Self {
        TexelMap { average, inverse, rows, shape: PhantomData }
    }

    /// Makes the distribution from the values of texels; returns their mean over the sphere.
    pub fn fill(
        size: Texel,
        (starts, guides, rows): (&mut [u32], &mut [u16], &mut [RowNumbers]),
        value: impl Fn(Texel) -> f64,
    ) -> f64 {
        let mean = Inverse::fill(size, starts, guides, |texel| value(texel) * S::share(size, texel));
        let inverse = Inverse::trusted(size, starts, guides);
        (0..).zip(rows).for_each(|(row, numbers)| *numbers = S::numbers(&inverse, row));
        mean
    }

    /// Whether this is what [`TexelMap::fill`] writes.
    pub fn is_sound(&self) -> bool {
        let same = |(row, numbers): (u32, &RowNumbers)| {
            S::numbers(&self.inverse, row).map(f32::to_bits) == numbers.map(f32::to_bits)
        };
        let [rows, _] = self.inverse.size();
        self.inverse.is_sound() && self.rows.len() == rows as usize && (0..).zip(self.rows).all(same)
    }

    /// Adds every number to a hash.
    pub fn add_to(&self, hash: &mut ContentHash) {
        self.inverse.add_to(hash);
        self.rows.iter().for_each(|numbers| hash.add_floats(numbers));
    }

    /// Whether there is anything to sample.
    pub(super) fn is_positive(&self) -> bool {
        self.average > 0.0
    }

    /// Points nearer than this to the upper or lower border of a texel may come out in its neighbour.
    #[inline(always)]
    pub(super) fn border(&self) -> f32 {
        let [rows, _] = self.inverse.size();
        S::BORDER as f32 * inverse::number(rows)
    }

    #[inline(always)]
    fn row(&self, row: u32) -> RowNumbers {
        self.rows.get(row as usize).copied().unwrap_or_default()
    }

    #[inline(always)]
    fn direction(&self, [row, column]: Texel, inside: [f32; 2]) -> glam::Vec3 {
        let [_, columns] = self.inverse.size();
        S::direction(self.row(row), inverse::number(column), inverse::number(columns), inside)
    }

    /// The pdf in a column of a row; `stretch` as [`Shape::texel`] gives it.
    #[inline(always)]
    fn density(&self, row: u32, column: Span, stretch: f32) -> f32 {
        self.row(row)[2] * inverse::number(column.width) * stretch
    }

    /// The texel of a world direction of unit length, and the pdf there.
    #[inline(always)]
    fn look_up(&self, frame: &Frame, world: glam::Vec3) -> (Texel, f32) {
        let (texel, stretch) = S::texel(self.inverse.size(), frame.to_map(world));
        (texel, self.density(texel[0], self.inverse.column(texel[0], texel[1]), stretch))
    }

    /// A sample that rounding may carry out of its texel: it then moves towards the centre, a little at first.
    #[inline(never)]
    pub(super) fn settle(&self, frame: &Frame, texel: Texel, inside: [f32; 2]) -> Sample {
        // Any step above 0 comes to an end.
        let (mut inside, mut step) = (inside, max(self.border(), f32::EPSILON));
        loop {
            let world = frame.to_world(self.direction(texel, inside));
            let (back, pdf) = unit(world.to_array()).map_or((texel, 0.0), |world| self.look_up(frame, world));
            if back == texel || !(step <= 1.0) {
                return Sample { wi: world.to_array(), pdf };
            }
            inside = inside.map(|c| c + min(max(0.5 - c, -step), step));
            step *= 2.0;
        }
    }
}

impl<S: Shape> Sampled for TexelMap<'_, S> {
    #[inline]
    fn sample(&self, frame: &Frame, u: [f32; 2]) -> Sample {
        if !self.is_positive() {
            return Sample::default();
        }
        let positions = clamp(u).map(inverse::position);
        let row = self.inverse.find_row(positions[0]);
        let column = self.inverse.find_column(row.cell, positions[1]);
        let inside = [row.inside(positions[0]), column.inside(positions[1])];
        let [.., border] = self.row(row.cell);
        let near = |c: f32, border: f32| c < border || 1.0 - border < c;
        if !S::CONSTANT || near(inside[0], self.border()) || near(inside[1], border) {
            return self.settle(frame, [row.cell, column.cell], inside);
        }
        let world = frame.to_world(self.direction([row.cell, column.cell], inside));
        Sample { wi: world.to_array(), pdf: self.density(row.cell, column, 1.0) }
    }

    #[inline]
    fn pdf(&self, frame: &Frame, wi: [f32; 3]) -> Result<f32> {
        let world = unit(wi).ok_or(Status::InvalidTransform)?;
        let (_, pdf) = self.look_up(frame, world);
        Ok(if self.is_positive() { pdf } else { 0.0 })
    }

    fn invert(&self, frame: &Frame, wi: [f32; 3]) -> Result<[f32; 2]> {
        let world = unit(wi).ok_or(Status::InvalidTransform)?;
        let (texel, pdf) = self.look_up(frame, world);
        if !(self.is_positive() && pdf > 0.0) {
            return Err(Status::ZeroDensity);
        }
        let inside = S::inside(self.row(texel[0]), self.inverse.size(), texel, frame.to_map(world));
        let [a, b] = inside.map(|c| min(max(c, 0.0), ONE_MINUS_EPSILON));
        Ok([self.inverse.row(texel[0]).undo(a), self.inverse.column(texel[0], texel[1]).undo(b)])
    }
}
