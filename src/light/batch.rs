//! Densities over world directions, in batches: four directions at a time, and one at a time of few, with the same bits. Wider
//! registers would gain a few per cent for twice the code: three quarters of a walk are searches, lane by lane.

use crate::sample::Sample;
use crate::simd::{Four, Num};
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
        each_register(u, out, |u| self.sample::<F>(frame, u));
    }

    /// As [`Density::pdf`], for all `wi`, as many as there is room for.
    #[inline(always)]
    fn pdfs<F: Num>(&self, frame: &Frame, wi: &[[f32; 3]], out: &mut [f32]) {
        for (wi, out) in wi.chunks(F::WIDTH).zip(out.chunks_mut(F::WIDTH)) {
            let pdf = self.pdf::<F>(frame, columns(wi)).store();
            for (out, &pdf) in out.iter_mut().zip(pdf.as_ref()) {
                *out = pdf;
            }
        }
    }
}

/// Draws for all `u`, as many as there is room for, a register of them at a time.
#[inline(always)]
pub fn each_register<F: Num>(u: &[[f32; 2]], out: &mut [Sample], sample: impl Fn([F; 2]) -> ([F; 3], F)) {
    for (u, out) in u.chunks(F::WIDTH).zip(out.chunks_mut(F::WIDTH)) {
        let (wi, pdf) = sample(columns(u));
        write_lanes(wi, pdf, out);
    }
}

/// Writes lanes as samples, as many as there is room for.
#[inline(always)]
pub(super) fn write_lanes<F: Num>([x, y, z]: [F; 3], pdf: F, out: &mut [Sample]) {
    let (x, y, z, pdf) = (x.store(), y.store(), z.store(), pdf.store());
    let lanes = x.as_ref().iter().zip(y.as_ref()).zip(z.as_ref()).zip(pdf.as_ref());
    for (out, (((&x, &y), &z), &pdf)) in out.iter_mut().zip(lanes) {
        *out = Sample { wi: [x, y, z], pdf };
    }
}

/// Rows of numbers side by side in lanes; lanes without a row hold zeros.
#[inline(always)]
pub(super) fn columns<F: Num, const N: usize>(rows: &[[f32; N]]) -> [F; N] {
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

/// Samples for all `u`, as many as there is room for.
#[inline(never)]
pub fn samples<D: Density>(density: &D, frame: &Frame, u: &[[f32; 2]], out: &mut [Sample]) {
    if u.len() < FEWEST {
        for (u, out) in u.iter().zip(out) {
            *out = sample(density, frame, *u);
        }
    } else {
        density.samples::<Four>(frame, u, out);
    }
}

/// Densities of all `wi`, as many as there is room for.
#[inline(never)]
pub fn pdfs<D: Density>(density: &D, frame: &Frame, wi: &[[f32; 3]], out: &mut [f32]) {
    if wi.len() < FEWEST {
        for (wi, out) in wi.iter().zip(out) {
            *out = pdf(density, frame, *wi);
        }
    } else {
        density.pdfs::<Four>(frame, wi, out);
    }
}
