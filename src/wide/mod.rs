//! Sample and pdf of eight directions side by side: the walk of [`crate::descent`], bit for bit.
//!
//! Descending one path is a chain of mispredicted branches; eight paths without branches take little longer than one.
//! A lane that needs more than the straight way (a point that rounding carried over the border of its cell, a damaged
//! tree) is left to the scalar walk, so the two can only agree.

pub(crate) mod sphere;
mod split;
pub mod vector;

use crate::descent::{self, Density, Sample};
use crate::simd::{LANES, Lanes, Native};
use crate::sphere::{Frame, SPHERE};
use split::{quad_density, take_quad};
use vector::to_arrays;

/// Every lane.
pub const ALL: u32 = (1 << LANES) - 1;

/// What decides where eight walks go.
pub trait Walker<F: Lanes> {
    /// Given the lanes that still walk and the masses of the four children, the sides that the lanes take along both
    /// axes; what it answers for other lanes does not matter.
    fn choose(&mut self, walks: F::Mask, masses: [F; 4]) -> [F::Mask; 2];
}

/// Densities that eight lanes can walk at once: one for all, or one for each.
pub trait WideDensity {
    /// What a lane walks.
    type One: Density;
    /// The density of a lane.
    fn one(&self, lane: usize) -> &Self::One;
    /// The lanes that have something to sample, as bits.
    fn positive(&self) -> u32;
    /// Walks from the whole square to eight cells. Returns the corners of the cells as [`Density::walk`] does, and the
    /// lanes that failed as bits.
    fn walk_wide<F: Lanes>(&self, walker: &mut impl Walker<F>) -> ([F; 4], u32);

    /// A sample in each lane. One function for all callers, since it is large.
    #[inline(never)]
    fn sample_all(&self, frame: &Frame, u: [[f32; 2]; LANES]) -> [Sample; LANES]
    where
        Self: Sized,
    {
        sample::<Native, Self>(self, frame, u)
    }

    /// The pdf of a direction in each lane; 0 for one that is not of unit length.
    #[inline(never)]
    fn pdf_all(&self, frame: &Frame, wi: [[f32; 3]; LANES]) -> [f32; LANES]
    where
        Self: Sized,
    {
        pdf::<Native, Self>(self, frame, wi)
    }
}

/// Walks where random numbers lead.
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
    fn choose(&mut self, walks: F::Mask, masses: [F; 4]) -> [F::Mask; 2] {
        let (sides, inside, factor) = take_quad(masses, self.inside);
        for axis in [0, 1] {
            let index = self.index[axis];
            self.inside[axis] = F::select(walks, inside[axis], self.inside[axis]);
            self.index[axis] = F::select(walks, index + index + F::unit(sides[axis]), index);
        }
        self.width = F::select(walks, F::splat(0.5) * self.width, self.width);
        self.product = F::select(walks, self.product * factor, self.product);
        sides
    }
}

/// Walks to points of the square.
struct Locating<F> {
    /// The place inside the cell.
    rest: [F; 2],
    product: F,
}

impl<F: Lanes> Walker<F> for Locating<F> {
    #[inline(always)]
    fn choose(&mut self, walks: F::Mask, masses: [F; 4]) -> [F::Mask; 2] {
        // Doubling and taking away what is above 1 are exact: the next binary digit of each coordinate.
        let one = F::splat(1.0);
        let doubled = [self.rest[0] + self.rest[0], self.rest[1] + self.rest[1]];
        let sides = [one.le(doubled[0]), one.le(doubled[1])];
        for axis in [0, 1] {
            self.rest[axis] = F::select(walks, doubled[axis] - F::unit(sides[axis]), self.rest[axis]);
        }
        self.product = F::select(walks, self.product * quad_density(masses, sides), self.product);
        sides
    }
}

/// Eight times [`descent::sample`].
#[inline(always)]
pub fn sample<F: Lanes, D: WideDensity>(density: &D, frame: &Frame, u: [[f32; 2]; LANES]) -> [Sample; LANES] {
    let positive = density.positive();
    if positive == 0 {
        return [Sample::default(); LANES];
    }
    let clamped = u.map(descent::clamp);
    let (zero, one) = (F::splat(0.0), F::splat(1.0));
    let inside = [F::from_array(clamped.map(|u| u[0])), F::from_array(clamped.map(|u| u[1]))];
    let mut sampling = Sampling { inside, index: [zero; 2], width: one, product: one };
    let (corners, failed) = density.walk_wide(&mut sampling);
    let Sampling { inside, index, width, product } = sampling;
    let place = sample_bilinear(corners, inside);
    let s = [place_in_cell(index[0], place[0], width), place_in_cell(index[1], place[1], width)];
    let world = sphere::to_world(frame, sphere::direction(s));
    let (back, unit) = sphere::to_square(frame, world);
    let offset = [back[0] / width, back[1] / width];
    let within = [within(index[0], offset[0]), within(index[1], offset[1])];
    let value = product * bilinear_density(corners, [offset[0] - index[0], offset[1] - index[1]]);
    let sound = F::bits(F::and(F::and(within[0], within[1]), unit)) & positive & !failed;
    let (pdf, [x, y, z]) = (per_solid_angle(value).to_array(), to_arrays(world));
    let mut samples = [Sample::default(); LANES];
    for (i, (sample, u)) in samples.iter_mut().zip(u).enumerate() {
        *sample = if sound >> i & 1 == 1 {
            Sample { wi: [x[i & 7], y[i & 7], z[i & 7]], pdf: pdf[i & 7] }
        } else {
            descent::sample(density.one(i), frame, u)
        };
    }
    samples
}

/// Eight times [`descent::pdf`]; 0 for a direction that is not of unit length.
#[inline(always)]
pub fn pdf<F: Lanes, D: WideDensity>(density: &D, frame: &Frame, wi: [[f32; 3]; LANES]) -> [f32; LANES] {
    let positive = density.positive();
    if positive == 0 {
        return [0.0; LANES];
    }
    let world = [F::from_array(wi.map(|w| w[0])), F::from_array(wi.map(|w| w[1])), F::from_array(wi.map(|w| w[2]))];
    let (rest, unit) = sphere::to_square(frame, world);
    let mut locating = Locating { rest, product: F::splat(1.0) };
    let (corners, failed) = density.walk_wide(&mut locating);
    let failed = failed | (ALL & !positive);
    let Locating { rest, product } = locating;
    let zero = F::splat(0.0);
    let value = F::select(zero.lt(product), product * bilinear_density(corners, rest), zero);
    let mut pdf = F::select(unit, per_solid_angle(value), zero).to_array();
    if failed != 0 {
        for (i, (pdf, wi)) in pdf.iter_mut().zip(wi).enumerate() {
            if failed >> i & 1 == 1 {
                *pdf = descent::pdf(density.one(i), frame, wi).unwrap_or(0.0);
            }
        }
    }
    pdf
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
