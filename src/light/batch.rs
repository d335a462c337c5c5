//! Densities over world directions, in batches: a register of directions at a time, and one at a time of few, with the same bits.

use crate::sample::Sample;
use crate::simd::{Compute, Level, Num, compute};
use crate::sphere::Frame;

/// What can be sampled and queried. Written once for any width.
pub trait Density {
    /// World directions for numbers in [0, 1)^2, and their densities; 0: no sample.
    fn sample<F: Num>(&self, frame: &Frame, u: [F; 2]) -> ([F; 3], F);
    /// Densities of world directions; 0 for those that are not of unit length.
    fn pdf<F: Num>(&self, frame: &Frame, wi: [F; 3]) -> F;

    /// As [`Density::sample`], for all `u`, as many as there is room for.
    #[inline(always)]
    fn samples<F: Num>(&self, frame: &Frame, u: &[[f32; 2]], out: &mut [Sample]) {
        for (u, out) in u.chunks(F::WIDTH).zip(out.chunks_mut(F::WIDTH)) {
            let (wi, pdf) = self.sample::<F>(frame, columns(u));
            write_lanes(wi, pdf, |lane, sample| {
                if let Some(out) = out.get_mut(lane) {
                    *out = sample;
                }
            });
        }
    }
}

/// Hands out lanes as samples.
#[inline(always)]
pub(crate) fn write_lanes<F: Num>([x, y, z]: [F; 3], pdf: F, mut write: impl FnMut(usize, Sample)) {
    let (x, y, z, pdf) = (x.store(), y.store(), z.store(), pdf.store());
    let lanes = x.as_ref().iter().zip(y.as_ref()).zip(z.as_ref()).zip(pdf.as_ref());
    for (lane, (((&x, &y), &z), &pdf)) in lanes.enumerate() {
        write(lane, Sample { wi: [x, y, z], pdf });
    }
}

/// Rows of numbers side by side in lanes; lanes without a row hold zeros.
#[inline(always)]
fn columns<F: Num, const N: usize>(rows: &[[f32; N]]) -> [F; N] {
    let mut columns = [F::splat(0.0); N];
    for (k, column) in columns.iter_mut().enumerate() {
        let mut lanes = F::floats();
        for (out, row) in lanes.as_mut().iter_mut().zip(rows) {
            *out = row[k];
        }
        *column = F::load(lanes);
    }
    columns
}

/// So many directions together cost less in lanes than one by one.
pub const FEWEST: usize = 3;

/// A sample for numbers in [0, 1)^2.
#[inline(never)]
pub fn sample<D: Density>(density: &D, frame: &Frame, u: [f32; 2]) -> Sample {
    let (wi, pdf) = density.sample::<f32>(frame, u);
    Sample { wi, pdf }
}

/// The density of a direction.
#[inline(never)]
pub fn pdf<D: Density>(density: &D, frame: &Frame, wi: [f32; 3]) -> f32 {
    density.pdf::<f32>(frame, wi)
}

/// Samples for all `u`, as many as there is room for. Inlined: of a level that is known no other is compiled.
#[inline(always)]
pub fn samples<D: Density>(level: Level, density: &D, frame: &Frame, u: &[[f32; 2]], out: &mut [Sample]) {
    if u.len() >= FEWEST {
        return compute(level, Samples { density, frame, u, out });
    }
    for (u, out) in u.iter().zip(out) {
        *out = sample(density, frame, *u);
    }
}

/// Densities of all `wi`, as many as there is room for.
#[inline(always)]
pub fn pdfs<D: Density>(level: Level, density: &D, frame: &Frame, wi: &[[f32; 3]], out: &mut [f32]) {
    if wi.len() >= FEWEST {
        return compute(level, Pdfs { density, frame, wi, out });
    }
    for (wi, out) in wi.iter().zip(out) {
        *out = pdf(density, frame, *wi);
    }
}

struct Samples<'a, D> {
    density: &'a D,
    frame: &'a Frame,
    u: &'a [[f32; 2]],
    out: &'a mut [Sample],
}

impl<D: Density> Compute for Samples<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<F: Num>(self) {
        self.density.samples::<F>(self.frame, self.u, self.out);
    }
}

struct Pdfs<'a, D> {
    density: &'a D,
    frame: &'a Frame,
    wi: &'a [[f32; 3]],
    out: &'a mut [f32],
}

impl<D: Density> Compute for Pdfs<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<F: Num>(self) {
        for (wi, out) in self.wi.chunks(F::WIDTH).zip(self.out.chunks_mut(F::WIDTH)) {
            let pdf = self.density.pdf::<F>(self.frame, columns(wi)).store();
            out.iter_mut().zip(pdf.as_ref()).for_each(|(out, &pdf)| *out = pdf);
        }
    }
}
