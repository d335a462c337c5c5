//! Densities over world directions, in batches: eight directions at a time, and one at a time for the rest, with the same bits.

use super::tables::Light;
use crate::numeric::{ONE_MINUS_EPSILON, max, min};
use crate::simd::{Kernel, LANES, Lanes, Level, Num, run};
use crate::sphere::Frame;

/// What can be sampled and queried. Written once for any width.
pub trait Density {
    /// World directions for numbers in [0, 1)^2, and their densities; 0: no sample.
    fn sample<F: Num>(&self, frame: &Frame, u: [F; 2]) -> ([F; 3], F);
    /// Densities of world directions; 0 for those that are not of unit length.
    fn pdf<F: Num>(&self, frame: &Frame, wi: [F; 3]) -> F;
}

impl Density for Light<'_> {
    #[inline(always)]
    fn sample<F: Num>(&self, frame: &Frame, u: [F; 2]) -> ([F; 3], F) {
        Light::sample(self, frame, u)
    }

    #[inline(always)]
    fn pdf<F: Num>(&self, frame: &Frame, wi: [F; 3]) -> F {
        Light::pdf(self, frame, wi)
    }
}

/// So many directions together cost less in lanes than one by one.
const FEWEST: usize = 3;

/// A direction and its density.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drawn {
    /// Unit length, world space.
    pub wi: [f32; 3],
    /// Per steradian; 0: no sample.
    pub pdf: f32,
}

/// Samples for all `u`, as many as there is room for.
pub fn samples<D: Density>(level: Level, density: &D, frame: &Frame, u: &[[f32; 2]], out: &mut [Drawn]) {
    for (u, out) in u.chunks(LANES).zip(out.chunks_mut(LANES)) {
        if u.len() < FEWEST {
            for (u, out) in u.iter().zip(out) {
                let (wi, pdf) = density.sample::<f32>(frame, *u);
                *out = Drawn { wi, pdf };
            }
        } else {
            run(level, Samples { density, frame, u, out });
        }
    }
}

/// Densities of all `wi`, as many as there is room for.
pub fn pdfs<D: Density>(level: Level, density: &D, frame: &Frame, wi: &[[f32; 3]], out: &mut [f32]) {
    for (wi, out) in wi.chunks(LANES).zip(out.chunks_mut(LANES)) {
        if wi.len() < FEWEST {
            for (wi, out) in wi.iter().zip(out) {
                *out = density.pdf::<f32>(frame, *wi);
            }
        } else {
            run(level, Pdfs { density, frame, wi, out });
        }
    }
}

struct Samples<'a, D> {
    density: &'a D,
    frame: &'a Frame,
    u: &'a [[f32; 2]],
    out: &'a mut [Drawn],
}

impl<D: Density> Kernel for Samples<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<F: Lanes>(self) {
        let mut points = [[0.5f32; LANES]; 2];
        for (lane, u) in self.u.iter().take(LANES).enumerate() {
            points[0][lane] = u[0];
            points[1][lane] = u[1];
        }
        let u = [<F as Num>::load(points[0]), <F as Num>::load(points[1])];
        let (wi, pdf) = self.density.sample::<F>(self.frame, u);
        let (x, y, z, pdf) = (Num::store(wi[0]), Num::store(wi[1]), Num::store(wi[2]), Num::store(pdf));
        for (lane, out) in self.out.iter_mut().take(LANES).enumerate() {
            *out = Drawn { wi: [x[lane], y[lane], z[lane]], pdf: pdf[lane] };
        }
    }
}

struct Pdfs<'a, D> {
    density: &'a D,
    frame: &'a Frame,
    wi: &'a [[f32; 3]],
    out: &'a mut [f32],
}

impl<D: Density> Kernel for Pdfs<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<F: Lanes>(self) {
        let mut columns = [[0.0f32; LANES]; 3];
        for (lane, wi) in self.wi.iter().take(LANES).enumerate() {
            columns[0][lane] = wi[0];
            columns[1][lane] = wi[1];
            columns[2][lane] = wi[2];
        }
        let wi = [<F as Num>::load(columns[0]), <F as Num>::load(columns[1]), <F as Num>::load(columns[2])];
        let pdf = Num::store(self.density.pdf::<F>(self.frame, wi));
        for (out, pdf) in self.out.iter_mut().zip(pdf) {
            *out = pdf;
        }
    }
}

/// A number of the client's moved into [0, 1 - 2^-24]; NaN counts as 1/2.
pub fn clamp_number(u: f32) -> f32 {
    if u.is_nan() { 0.5 } else { min(max(u, 0.0), ONE_MINUS_EPSILON) }
}
