//! The distribution of [`super::latlong`] in eight lanes, bit for bit.
//!
//! Texels are looked up one by one, but all rows of a call before the first column: look-ups wait for far caches, and
//! then do not wait for one another. Directions are computed side by side.

use super::inverse::{self, Inverse};
use super::latlong::LatLong;
use crate::descent::{ONE_MINUS_EPSILON, Sample};
use crate::simd::{self, Kernel, LANES, Lanes};
use crate::sphere::Frame;
use crate::wide::sphere as lanes;
use crate::wide::vector::V3;
use crate::wide::{self, TOGETHER, columns, first_lanes};

impl LatLong<'_> {
    /// As many samples as there are `u`, at most [`TOGETHER`], on the lanes of a level.
    #[inline(never)]
    pub fn sample_all(&self, level: u32, frame: &Frame, u: &[[f32; 2]], samples: &mut [Sample]) {
        simd::run(level, Samples { map: self, frame, u, samples });
    }

    /// As many pdfs as there are directions, at most [`TOGETHER`]; 0 for one that is not of unit length.
    #[inline(never)]
    pub fn pdf_all(&self, level: u32, frame: &Frame, wi: &[[f32; 3]], values: &mut [f32]) {
        simd::run(level, Pdfs { map: self, frame, wi, values });
    }

    /// As [`Sampled::sample`], lane by lane.
    #[inline(always)]
    pub fn sample_lanes<F: Lanes>(&self, frame: &Frame, u: &[[f32; 2]], samples: &mut [Sample]) {
        if !self.is_positive() {
            return samples.fill(Sample::default());
        }
        let mut texels = [Texels::default(); TOGETHER / LANES];
        for (texels, u) in texels.iter_mut().zip(u.chunks(LANES)) {
            texels.find::<F>(&self.inverse, u);
        }
        for ((texels, u), samples) in texels.iter().zip(u.chunks(LANES)).zip(samples.chunks_mut(LANES)) {
            self.directions::<F>(frame, texels, u.len(), samples);
        }
    }

    /// The samples in texels.
    #[inline(always)]
    fn directions<F: Lanes>(&self, frame: &Frame, texels: &Texels, count: usize, samples: &mut [Sample]) {
        let one = F::splat(1.0);
        let [near, extent, density, border] = F::gather(self.rows, F::index(texels.row));
        let inside = [texels.inside::<F>(0), texels.inside::<F>(1)];
        let world = lanes::to_world(frame, self.direction_lanes(texels, [near, extent], inside));
        let pdf = density * F::from_index(F::index(texels.width[1]));
        let rows = F::rows([world[0], world[1], world[2], pdf]);
        for (sample, [x, y, z, pdf]) in samples.iter_mut().zip(rows) {
            *sample = Sample { wi: [x, y, z], pdf };
        }
        // Within a border of the edges.
        let middle = |c: F, border: F| F::and(border.le(c), c.le(one - border));
        let sound = F::and(middle(inside[0], F::splat(self.border())), middle(inside[1], border));
        let unsound = first_lanes(count) & !F::bits(sound);
        if unsound != 0 {
            let inside = inside.map(F::to_array);
            for (i, sample) in samples.iter_mut().enumerate().filter(|(i, _)| unsound >> i & 1 == 1) {
                let i = i & (LANES - 1);
                *sample = self.settle(frame, [texels.row[i], texels.column[i]], [inside[0][i], inside[1][i]]);
            }
        }
    }

    /// As [`LatLong::direction`].
    #[inline(always)]
    fn direction_lanes<F: Lanes>(&self, texels: &Texels, [near, extent]: [F; 2], [a, b]: [F; 2]) -> V3<F> {
        let (zero, half, one, two) = (F::splat(0.0), F::splat(0.5), F::splat(1.0), F::splat(2.0));
        let three = F::splat(3.0);
        let south = extent.lt(zero);
        let height = near + F::select(south, one - a, a) * extent.abs();
        let across = (height * (two - height)).max(zero).sqrt();
        let z = F::select(south, height - one, one - height);
        let [_, columns] = self.inverse.size();
        let column = F::from_index(F::index(texels.column));
        let turned = (column + b) * F::splat(4.0 / inverse::number(columns));
        let rest = turned - (F::unit(one.le(turned)) + F::unit(two.le(turned)) + F::unit(three.le(turned)));
        let (minor, major) = lanes::sin_cos_turns(rest.min(one - rest).max(zero));
        let swapped = half.lt(rest);
        let (cos, sin) = (F::select(swapped, minor, major), F::select(swapped, major, minor));
        let odd = F::or(F::and(one.le(turned), turned.lt(two)), three.le(turned));
        let (x, y) = (across * F::select(odd, sin, cos), across * F::select(odd, cos, sin));
        let west = F::and(one.le(turned), turned.lt(three));
        [F::select(west, zero - x, x), F::select(two.le(turned), zero - y, y), z]
    }

    /// As [`Sampled::pdf`], lane by lane.
    #[inline(always)]
    pub fn pdf_lanes<F: Lanes>(&self, frame: &Frame, wi: &[[f32; 3]], values: &mut [f32]) {
        if !self.is_positive() {
            return values.fill(0.0);
        }
        for (wi, values) in wi.chunks(LANES).zip(values.chunks_mut(LANES)) {
            let [x, y, z] = columns(wi, [0.0; 3]);
            let (texels, unit) = self.texels::<F>(frame, [F::from_array(x), F::from_array(y), F::from_array(z)]);
            let mut widths = [0; LANES];
            for i in 0..LANES {
                widths[i] = self.inverse.column(texels[0][i], texels[1][i]).width;
            }
            let [_, _, density, _] = F::gather(self.rows, F::index(texels[0]));
            let pdf = F::only(unit, density * F::from_index(F::index(widths))).to_array();
            values.iter_mut().zip(pdf).for_each(|(value, pdf)| *value = pdf);
        }
    }

    /// The texels of world directions, as [`LatLong::texel`], and which directions are of unit length.
    #[inline(always)]
    fn texels<F: Lanes>(&self, frame: &Frame, world: V3<F>) -> ([[u32; LANES]; 2], F::Mask) {
        let (zero, one, two, four) = (F::splat(0.0), F::splat(1.0), F::splat(2.0), F::splat(4.0));
        let [rows, columns] = self.inverse.size();
        let (v, unit) = lanes::unit(world);
        let [x, y, z] = lanes::to_map(frame, v);
        let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
        let polar = lanes::atan_turns((ax * ax + ay * ay).sqrt() / (one + az));
        let down = F::select(z.lt(zero), one - polar, polar) * F::splat(inverse::number(rows));
        let eighth = lanes::atan_turns(ax.min(ay) / ax.max(ay).max(F::splat(f32::MIN_POSITIVE)));
        let quarter = F::select(ax.lt(ay), one - eighth, eighth);
        let half = F::select(x.lt(zero), two - quarter, quarter);
        let along = F::select(y.lt(zero), four - half, half) * F::splat(inverse::number(columns) * 0.25);
        ([cells(down, rows), cells(along, columns)], unit)
    }
}

/// The cells of coordinates, not beyond the last of so many.
#[inline(always)]
fn cells<F: Lanes>(coordinate: F, count: u32) -> [u32; LANES] {
    let last = F::splat(inverse::number(count.wrapping_sub(1)));
    F::numbers(coordinate.max(F::splat(0.0)).min(last).truncate())
}

struct Samples<'s, 'a> {
    map: &'s LatLong<'a>,
    frame: &'s Frame,
    u: &'s [[f32; 2]],
    samples: &'s mut [Sample],
}

impl Kernel for Samples<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<F: Lanes>(self) {
        self.map.sample_lanes::<F>(self.frame, self.u, self.samples);
    }
}

struct Pdfs<'s, 'a> {
    map: &'s LatLong<'a>,
    frame: &'s Frame,
    wi: &'s [[f32; 3]],
    values: &'s mut [f32],
}

impl Kernel for Pdfs<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<F: Lanes>(self) {
        self.map.pdf_lanes::<F>(self.frame, self.wi, self.values);
    }
}

/// The texels of eight samples, and where in them.
#[derive(Clone, Copy, Default)]
struct Texels {
    row: [u32; LANES],
    column: [u32; LANES],
    /// Of row and column: how far behind its start, and its width.
    offset: [[u32; LANES]; 2],
    width: [[u32; LANES]; 2],
}

impl Texels {
    /// Finds at most eight; other lanes are those of u = 1/2. All rows before the first column: look-ups then do not wait
    /// for one another.
    #[inline(always)]
    fn find<F: Lanes>(&mut self, inverse: &Inverse, u: &[[f32; 2]]) {
        let positions = columns(u, [0.5; 2]).map(|u| inverse::positions(wide::clamp(F::from_array(u))));
        for (i, position) in positions[0].into_iter().enumerate() {
            let row = inverse.find_row(position);
            self.row[i] = row.cell;
            (self.offset[0][i], self.width[0][i]) = (position.wrapping_sub(row.start), row.width);
        }
        for (i, position) in positions[1].into_iter().enumerate() {
            let column = inverse.find_column(self.row[i], position);
            self.column[i] = column.cell;
            (self.offset[1][i], self.width[1][i]) = (position.wrapping_sub(column.start), column.width);
        }
    }

    /// As [`Span::inside`], of rows (0) or columns (1).
    #[inline(always)]
    fn inside<F: Lanes>(&self, axis: usize) -> F {
        let numbers = |whole: &[[u32; LANES]; 2]| F::from_index(F::index(whole[axis & 1]));
        (numbers(&self.offset) / numbers(&self.width)).min(F::splat(ONE_MINUS_EPSILON))
    }
}
