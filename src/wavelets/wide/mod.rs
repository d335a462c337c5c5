//! Sample and pdf of eight directions side by side: the walk of [`crate::wavelets::descent`], bit for bit.
//!
//! Descending one path is a chain of mispredicted branches; eight paths without branches take little longer than one.
//! A lane that needs more than the straight way (a point that rounding carried over the border of its cell, a damaged
//! tree) is left to the scalar walk, so the two can only agree.

mod split;

use crate::sphere::{Frame, SPHERE};
use crate::wavelets::descent::{self, Density, Sample};
use crate::wavelets::lanes::sphere as wide;
use crate::wavelets::lanes::{LANES, Lanes, Native};
pub use split::ALL;
use split::{quad_density, take_quad};

/// What decides where eight walks go.
pub trait Walker<F: Lanes> {
    /// Given the lanes that still walk, as bits, and the masses of the four children, the sides that the lanes take
    /// along both axes; what it answers for other lanes does not matter.
    fn choose(&mut self, walks: u32, masses: [F; 4]) -> [F::Mask; 2];
}

/// Groups of eight lanes that walk together. One group waits for most of its time: for a quotient, for a square from a far
/// cache. Two groups wait for each other's.
pub const GROUPS: usize = 2;

/// Samples or directions of one call.
pub const TOGETHER: usize = GROUPS * LANES;

/// A density that eight lanes can walk at once.
pub trait WideDensity: Density {
    /// The lanes of `walks` (bits, for each group) walk from the whole square to cells. Returns the corners of the cells
    /// as [`Density::walk`] does, and the lanes that failed as bits.
    fn walk_wide<F: Lanes>(
        &self,
        walks: [u32; GROUPS],
        walkers: &mut [impl Walker<F>; GROUPS],
    ) -> [([F; 4], u32); GROUPS];
}

/// Walks where random numbers lead.
#[derive(Clone, Copy)]
struct Sampling<F> {
    /// Where in the cell.
    inside: [F; 2],
    /// Which cell, and how wide it is.
    index: [F; 2],
    width: F,
    product: F,
}

impl<F: Lanes> Walker<F> for Sampling<F> {
    #[inline(always)]
    fn choose(&mut self, walks: u32, masses: [F; 4]) -> [F::Mask; 2] {
        let (sides, inside, factor) = take_quad(masses, self.inside);
        let [i, j] = self.index;
        let next = Sampling {
            inside,
            index: [i + i + F::unit(sides[0]), j + j + F::unit(sides[1])],
            width: F::splat(0.5) * self.width,
            product: self.product * factor,
        };
        *self = if walks == ALL { next } else { self.and_where(F::mask(walks), next) };
        sides
    }
}

impl<F: Lanes> Sampling<F> {
    /// `next` where the mask is set.
    #[inline(always)]
    fn and_where(&self, mask: F::Mask, next: Self) -> Self {
        let select = |a: [F; 2], b: [F; 2]| [F::select(mask, a[0], b[0]), F::select(mask, a[1], b[1])];
        Sampling {
            inside: select(next.inside, self.inside),
            index: select(next.index, self.index),
            width: F::select(mask, next.width, self.width),
            product: F::select(mask, next.product, self.product),
        }
    }
}

/// Walks to points of the square.
#[derive(Clone, Copy)]
struct Locating<F> {
    /// The place inside the cell.
    rest: [F; 2],
    product: F,
}

impl<F: Lanes> Walker<F> for Locating<F> {
    #[inline(always)]
    fn choose(&mut self, walks: u32, masses: [F; 4]) -> [F::Mask; 2] {
        // Doubling and taking away what is above 1 are exact: the next binary digit of each coordinate.
        let one = F::splat(1.0);
        let doubled = [self.rest[0] + self.rest[0], self.rest[1] + self.rest[1]];
        let sides = [one.le(doubled[0]), one.le(doubled[1])];
        let rest = [doubled[0] - F::unit(sides[0]), doubled[1] - F::unit(sides[1])];
        let product = self.product * quad_density(masses, sides);
        if walks == ALL {
            *self = Locating { rest, product };
        } else {
            let mask = F::mask(walks);
            self.rest = [F::select(mask, rest[0], self.rest[0]), F::select(mask, rest[1], self.rest[1])];
            self.product = F::select(mask, product, self.product);
        }
        sides
    }
}

/// So many directions together cost less in lanes than one by one.
const FEWEST: usize = 3;

/// A sample for each of all `u`, as many as there is room for.
#[inline(never)]
pub fn samples<D: WideDensity>(density: &D, frame: &Frame, u: &[[f32; 2]], out: &mut [Sample]) {
    for (u, out) in u.chunks(TOGETHER).zip(out.chunks_mut(TOGETHER)) {
        if u.len() < FEWEST {
            u.iter().zip(out).for_each(|(u, out)| *out = descent::sample(density, frame, *u));
        } else {
            sample::<Native, D>(density, frame, u, out);
        }
    }
}

/// The pdf of all `wi`, as many as there is room for; 0 for a direction that is not of unit length.
#[inline(never)]
pub fn pdfs<D: WideDensity>(density: &D, frame: &Frame, wi: &[[f32; 3]], out: &mut [f32]) {
    for (wi, out) in wi.chunks(TOGETHER).zip(out.chunks_mut(TOGETHER)) {
        if wi.len() < FEWEST {
            wi.iter().zip(out).for_each(|(wi, out)| *out = descent::pdf(density, frame, *wi).unwrap_or(0.0));
        } else {
            pdf::<Native, D>(density, frame, wi, out);
        }
    }
}

/// As many times [`descent::sample`] as there are `u`, at most [`TOGETHER`].
#[inline(always)]
pub fn sample<F: Lanes, D: WideDensity>(density: &D, frame: &Frame, u: &[[f32; 2]], samples: &mut [Sample]) {
    let (zero, one) = (F::splat(0.0), F::splat(1.0));
    let start = Sampling { inside: [zero; 2], index: [zero; 2], width: one, product: one };
    let (mut walkers, mut walks) = ([start; GROUPS], [0; GROUPS]);
    for ((walker, walks), u) in walkers.iter_mut().zip(&mut walks).zip(u.chunks(LANES)) {
        let [x, y] = columns(u, [0.5; 2]);
        walker.inside = [clamp(F::from_array(x)), clamp(F::from_array(y))];
        *walks = if density.is_positive() { first_lanes(u.len()) } else { 0 };
    }
    let cells = density.walk_wide(walks, &mut walkers);
    let parts = u.chunks(LANES).zip(samples.chunks_mut(LANES));
    for (((u, samples), (corners, failed)), (walker, walks)) in parts.zip(cells).zip(walkers.iter().zip(walks)) {
        let sound = walker.finish(frame, corners, samples) & walks & !failed;
        let unsound = first_lanes(u.len()) & !sound;
        if unsound != 0 {
            for (_, (sample, &u)) in samples.iter_mut().zip(u).enumerate().filter(|(i, _)| unsound >> i & 1 == 1) {
                *sample = descent::sample(density, frame, u);
            }
        }
    }
}

impl<F: Lanes> Sampling<F> {
    /// Samples cells with these corners, and tells in which lanes the direction is of that cell. One copy for all densities.
    #[inline(never)]
    fn finish(&self, frame: &Frame, corners: [F; 4], samples: &mut [Sample]) -> u32 {
        let Sampling { inside, index, width, product } = *self;
        let place = sample_bilinear(corners, inside);
        let s = [place_in_cell(index[0], place[0], width), place_in_cell(index[1], place[1], width)];
        let world = wide::to_world(frame, wide::direction(s));
        let (back, unit) = wide::to_square(frame, world);
        let offset = [back[0] / width, back[1] / width];
        let within = [within(index[0], offset[0]), within(index[1], offset[1])];
        let value = product * bilinear_density(corners, [offset[0] - index[0], offset[1] - index[1]]);
        let rows = F::rows([world[0], world[1], world[2], per_solid_angle(value)]);
        for (sample, [x, y, z, pdf]) in samples.iter_mut().zip(rows) {
            *sample = Sample { wi: [x, y, z], pdf };
        }
        F::bits(F::and(F::and(within[0], within[1]), unit))
    }
}

/// As many times [`descent::pdf`] as there are `wi`, at most [`TOGETHER`]; 0 for a direction that is not of unit length.
#[inline(always)]
pub fn pdf<F: Lanes, D: WideDensity>(density: &D, frame: &Frame, wi: &[[f32; 3]], values: &mut [f32]) {
    let start = Locating { rest: [F::splat(0.0); 2], product: F::splat(1.0) };
    let (mut walkers, mut walks, mut units) = ([start; GROUPS], [0; GROUPS], [0; GROUPS]);
    let parts = walkers.iter_mut().zip(walks.iter_mut().zip(&mut units));
    for ((walker, (walks, units)), wi) in parts.zip(wi.chunks(LANES)) {
        *units = walker.begin(frame, wi);
        *walks = if density.is_positive() { first_lanes(wi.len()) } else { 0 };
    }
    let cells = density.walk_wide(walks, &mut walkers);
    let parts = wi.chunks(LANES).zip(values.chunks_mut(LANES)).zip(cells);
    for (((wi, values), (corners, failed)), ((walker, walks), units)) in parts.zip(walkers.iter().zip(walks).zip(units))
    {
        walker.finish(corners, units, values);
        let unsound = first_lanes(wi.len()) & !(walks & !failed);
        if unsound != 0 {
            for (_, (value, &wi)) in values.iter_mut().zip(wi).enumerate().filter(|(i, _)| unsound >> i & 1 == 1) {
                *value = descent::pdf(density, frame, wi).unwrap_or(0.0);
            }
        }
    }
}

impl<F: Lanes> Locating<F> {
    /// Begins at the points of the square for directions, and tells which of them are of unit length. One copy for all
    /// densities.
    #[inline(never)]
    fn begin(&mut self, frame: &Frame, wi: &[[f32; 3]]) -> u32 {
        let [x, y, z] = columns(wi, [0.0; 3]);
        let (rest, unit) = wide::to_square(frame, [F::from_array(x), F::from_array(y), F::from_array(z)]);
        self.rest = rest;
        F::bits(unit)
    }

    /// Writes the pdfs in cells with these corners; 0 in lanes of no unit length.
    fn finish(&self, corners: [F; 4], units: u32, values: &mut [f32]) {
        let (zero, Locating { rest, product }) = (F::splat(0.0), *self);
        let value = F::select(zero.lt(product), product * bilinear_density(corners, rest), zero);
        let pdf = F::only(F::mask(units), per_solid_angle(value)).to_array();
        values.iter_mut().zip(pdf).for_each(|(value, pdf)| *value = pdf);
    }
}

/// The columns of at most eight rows; lanes without a row get those of `rest`.
#[inline(always)]
pub(crate) fn columns<const N: usize>(rows: &[[f32; N]], rest: [f32; N]) -> [[f32; LANES]; N] {
    let mut columns = rest.map(|x| [x; LANES]);
    for (i, row) in rows.iter().enumerate() {
        for (column, x) in columns.iter_mut().zip(row) {
            column[i & 7] = *x;
        }
    }
    columns
}

/// The bits of the first lanes.
#[inline(always)]
pub(crate) fn first_lanes(count: usize) -> u32 {
    if count < LANES { (1 << count) - 1 } else { ALL }
}

/// As [`descent::clamp`].
#[inline(always)]
pub(crate) fn clamp<F: Lanes>(u: F) -> F {
    let number = F::select(u.le(u), u, F::splat(0.5));
    number.max(F::splat(0.0)).min(F::splat(descent::ONE_MINUS_EPSILON))
}

/// Whether a coordinate in units of cells lies in a cell.
#[inline(always)]
fn within<F: Lanes>(index: F, offset: F) -> F::Mask {
    F::and(index.le(offset), offset.lt(index + F::splat(1.0)))
}

/// The point at `inside` of cell `index`, which is `width` wide; never outside the cell.
#[inline(always)]
fn place_in_cell<F: Lanes>(index: F, inside: F, width: F) -> F {
    let end = ((index + F::splat(1.0)) * width).before();
    ((index + inside) * width).max(index * width).min(end)
}

#[inline(always)]
fn sample_bilinear<F: Lanes>(corners: [F; 4], u: [F; 2]) -> [F; 2] {
    let [c00, c01, c10, c11] = corners;
    let x = sample_linear(c00 + c01, c10 + c11, u[0]);
    let y = sample_linear(lerp(x, c00, c10), lerp(x, c01, c11), u[1]);
    [x, y]
}

#[inline(always)]
fn bilinear_density<F: Lanes>(corners: [F; 4], x: [F; 2]) -> F {
    let [c00, c01, c10, c11] = corners;
    let sum = (c00 + c01) + (c10 + c11);
    let density = F::splat(4.0) * lerp(x[1], lerp(x[0], c00, c10), lerp(x[0], c01, c11)) / sum;
    F::select(F::splat(0.0).lt(sum), density, F::splat(1.0))
}

#[inline(always)]
fn sample_linear<F: Lanes>(a: F, b: F, u: F) -> F {
    let denominator = a + lerp(u, a * a, b * b).sqrt();
    let x = F::select(F::splat(0.0).lt(denominator), u * (a + b) / denominator, u);
    x.min(F::splat(descent::ONE_MINUS_EPSILON))
}

#[inline(always)]
pub(crate) fn lerp<F: Lanes>(t: F, a: F, b: F) -> F {
    (F::splat(1.0) - t) * a + t * b
}

#[inline(always)]
fn per_solid_angle<F: Lanes>(density: F) -> F {
    let zero = F::splat(0.0);
    F::select(zero.lt(density), (density / F::splat(SPHERE)).max(F::splat(f32::MIN_POSITIVE)), zero)
}
