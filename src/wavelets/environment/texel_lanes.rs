//! The distribution of [`super::texels`] in eight lanes, bit for bit.
//!
//! Texels are looked up one by one, but all rows of a call before the first column: look-ups wait for far caches, and
//! then do not wait for one another. Directions are computed side by side.

use super::inverse::{self, Inverse};
use super::shape::Shape;
use super::texels::TexelMap;
use crate::simd::{LANES, Lanes};
use crate::sphere::Frame;
use crate::sphere::vector::V3;
use crate::sphere::wide as lanes;
use crate::wavelets::descent::{ONE_MINUS_EPSILON, Sample};
use crate::wavelets::wide::{self, InLanes, TOGETHER, columns, first_lanes};

impl<S: Shape> InLanes for &TexelMap<'_, S> {
    #[inline(always)]
    fn sample_lanes<F: Lanes>(self, frame: &Frame, u: &[[f32; 2]], samples: &mut [Sample]) {
        if !self.is_positive() {
            return samples.fill(Sample::default());
        }
        let mut found = [Found::default(); TOGETHER / LANES];
        for (found, u) in found.iter_mut().zip(u.chunks(LANES)) {
            found.find::<F>(&self.inverse, u);
        }
        for ((found, u), samples) in found.iter().zip(u.chunks(LANES)).zip(samples.chunks_mut(LANES)) {
            self.directions::<F>(frame, found, u.len(), samples);
        }
    }

    #[inline(always)]
    fn pdf_lanes<F: Lanes>(self, frame: &Frame, wi: &[[f32; 3]], values: &mut [f32]) {
        if !self.is_positive() {
            return values.fill(0.0);
        }
        for (wi, values) in wi.chunks(LANES).zip(values.chunks_mut(LANES)) {
            let [x, y, z] = columns(wi, [0.0; 3]);
            let world = [F::from_array(x), F::from_array(y), F::from_array(z)];
            let (texels, stretch, unit) = self.look_up_lanes::<F>(frame, world);
            let mut widths = [0; LANES];
            for (i, width) in widths.iter_mut().enumerate() {
                *width = self.inverse.column(texels[0][i & 7], texels[1][i & 7]).width;
            }
            let [_, _, density, _] = F::gather(self.rows, F::index(texels[0]));
            let mut pdf = density * F::from_index(F::index(widths));
            if !S::CONSTANT {
                pdf = pdf * stretch;
            }
            let pdf = F::only(unit, pdf).to_array();
            values.iter_mut().zip(pdf).for_each(|(value, pdf)| *value = pdf);
        }
    }
}

impl<S: Shape> TexelMap<'_, S> {
    /// The samples in texels.
    #[inline(always)]
    fn directions<F: Lanes>(&self, frame: &Frame, found: &Found, count: usize, samples: &mut [Sample]) {
        let row = F::gather(self.rows, F::index(found.row));
        let inside = [found.inside::<F>(0), found.inside::<F>(1)];
        let (column, columns) = (F::from_index(F::index(found.column)), inverse::number(self.inverse.size()[1]));
        let world = lanes::to_world(frame, S::direction_lanes(row, column, columns, inside));
        let mut pdf = row[2] * F::from_index(F::index(found.width[1]));
        let sound = if S::CONSTANT {
            // Farther than a border from the edges.
            let (down, along, one) = (F::splat(self.border()), row[3], F::splat(1.0));
            let low = F::and(down.le(inside[0]), along.le(inside[1]));
            F::bits(F::and(low, F::and(inside[0].le(one - down), inside[1].le(one - along))))
        } else {
            let (back, stretch, unit) = self.look_up_lanes::<F>(frame, world);
            pdf = pdf * stretch;
            let same = (0..LANES).rev().fold(0, |bits, i| {
                bits << 1 | u32::from(back[0][i] == found.row[i]) & u32::from(back[1][i] == found.column[i])
            });
            same & F::bits(unit)
        };
        let rows = F::rows([world[0], world[1], world[2], pdf]);
        for (sample, [x, y, z, pdf]) in samples.iter_mut().zip(rows) {
            *sample = Sample { wi: [x, y, z], pdf };
        }
        let unsound = first_lanes(count) & !sound;
        if unsound != 0 {
            let inside = [inside[0].to_array(), inside[1].to_array()];
            for (i, sample) in samples.iter_mut().enumerate().filter(|(i, _)| unsound >> i & 1 == 1) {
                let i = i & (LANES - 1);
                *sample = self.settle(frame, [found.row[i], found.column[i]], [inside[0][i], inside[1][i]]);
            }
        }
    }

    /// The texels of world directions, as [`Shape::texel_lanes`], and which directions are of unit length.
    #[inline(always)]
    fn look_up_lanes<F: Lanes>(&self, frame: &Frame, world: V3<F>) -> ([[u32; LANES]; 2], F, F::Mask) {
        let (v, unit) = lanes::unit(world);
        let (texels, stretch) = S::texel_lanes(self.inverse.size(), lanes::to_map(frame, v));
        (texels, stretch, unit)
    }
}

/// The texels of eight samples, and where in them.
#[derive(Clone, Copy, Default)]
struct Found {
    row: [u32; LANES],
    column: [u32; LANES],
    /// Of row and column: how far behind its start, and its width.
    offset: [[u32; LANES]; 2],
    width: [[u32; LANES]; 2],
}

impl Found {
    /// Finds at most eight; other lanes are those of u = 1/2.
    #[inline(always)]
    fn find<F: Lanes>(&mut self, inverse: &Inverse, u: &[[f32; 2]]) {
        let [down, along] = columns(u, [0.5; 2]);
        let down = inverse::positions(wide::clamp(F::from_array(down)));
        let along = inverse::positions(wide::clamp(F::from_array(along)));
        for (i, position) in down.into_iter().enumerate() {
            let row = inverse.find_row(position);
            self.row[i] = row.cell;
            (self.offset[0][i], self.width[0][i]) = (position.wrapping_sub(row.start), row.width);
        }
        for (i, position) in along.into_iter().enumerate() {
            let column = inverse.find_column(self.row[i], position);
            self.column[i] = column.cell;
            (self.offset[1][i], self.width[1][i]) = (position.wrapping_sub(column.start), column.width);
        }
    }

    /// As [`super::inverse::Span::inside`], of rows (0) or columns (1).
    #[inline(always)]
    fn inside<F: Lanes>(&self, axis: usize) -> F {
        let offset = F::from_index(F::index(self.offset[axis & 1]));
        let width = F::from_index(F::index(self.width[axis & 1]));
        (offset / width).min(F::splat(ONE_MINUS_EPSILON))
    }
}
