//! Sample, pdf and invert of a density, as the calls on an environment and on a product share them. `argument` is
//! the position of the first pointer of each.

use crate::ffi::{Checked, Failure, Strided, StridedMut, borrow, out};
use crate::simd::Level;
use crate::sphere::Frame;
use crate::wavelets::descent::{Sample, Sampled};
use crate::wavelets::wide::{SampledWide, TOGETHER};

/// So many calls together cost less in lanes than one by one.
const FEWEST: usize = 3;

/// One sample: u, then the sample.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[inline(always)]
pub(super) unsafe fn sample<D: Sampled>(
    (density, frame): (&D, &Frame),
    u: *const [f32; 2],
    sample: *mut Sample,
    argument: u32,
) -> Checked<()> {
    // SAFETY: the caller's contract; `out` checked the pointer that is written.
    unsafe {
        let u = *borrow(u, argument)?;
        out(sample, argument + 1)?.write(density.sample(frame, u));
    }
    Ok(())
}

/// `count` samples: u, wi and pdf, each with its stride.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[inline(always)]
pub(super) unsafe fn sample_n<D: SampledWide>(
    (density, frame): (&D, &Frame),
    level: Level,
    count: usize,
    u: (*const f32, usize),
    wi: (*mut f32, usize),
    pdf: (*mut f32, usize),
    argument: u32,
) -> Checked<()> {
    let u = Strided::<2>::new(u.0, u.1, count, argument)?;
    let wi = StridedMut::<3>::new(wi.0, wi.1, count, argument + 2)?;
    let pdf = StridedMut::<1>::new(pdf.0, pdf.1, count, argument + 4)?;
    for first in (0..count).step_by(TOGETHER) {
        let here = (count - first).min(TOGETHER);
        let (mut points, mut samples) = ([[0.5; 2]; TOGETHER], [Sample::default(); TOGETHER]);
        let (points, samples) =
            (points.get_mut(..here).unwrap_or_default(), samples.get_mut(..here).unwrap_or_default());
        for (i, point) in points.iter_mut().enumerate() {
            // SAFETY: the caller's contract; the index is below the count.
            *point = unsafe { u.read(first + i) };
        }
        if here < FEWEST {
            for (lane, (sample, point)) in samples.iter_mut().zip(points.iter()).enumerate() {
                *sample = density.one(lane).sample(frame, *point);
            }
        } else {
            density.samples(level, frame, points, samples);
        }
        for (i, sample) in samples.iter().enumerate() {
            // SAFETY: as above.
            unsafe {
                wi.write(first + i, sample.wi);
                pdf.write(first + i, [sample.pdf]);
            }
        }
    }
    Ok(())
}

/// One pdf: wi, then the pdf.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[inline(always)]
pub(super) unsafe fn pdf<D: Sampled>(
    (density, frame): (&D, &Frame),
    wi: *const [f32; 3],
    pdf: *mut f32,
    argument: u32,
) -> Checked<()> {
    // SAFETY: the caller's contract; `out` checked the pointer that is written.
    unsafe {
        let wi = *borrow(wi, argument)?;
        let target = out(pdf, argument + 1)?;
        target.write(density.pdf(frame, wi).map_err(|status| Failure::new(status, argument))?);
    }
    Ok(())
}

/// `count` pdfs: wi and pdf, each with its stride. A direction that is not of unit length gets 0.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[inline(always)]
pub(super) unsafe fn pdf_n<D: SampledWide>(
    (density, frame): (&D, &Frame),
    level: Level,
    count: usize,
    wi: (*const f32, usize),
    pdf: (*mut f32, usize),
    argument: u32,
) -> Checked<()> {
    let wi = Strided::<3>::new(wi.0, wi.1, count, argument)?;
    let pdf = StridedMut::<1>::new(pdf.0, pdf.1, count, argument + 2)?;
    for first in (0..count).step_by(TOGETHER) {
        let here = (count - first).min(TOGETHER);
        let (mut directions, mut values) = ([[0.0; 3]; TOGETHER], [0.0; TOGETHER]);
        let (directions, values) =
            (directions.get_mut(..here).unwrap_or_default(), values.get_mut(..here).unwrap_or_default());
        for (i, direction) in directions.iter_mut().enumerate() {
            // SAFETY: the caller's contract; the index is below the count.
            *direction = unsafe { wi.read(first + i) };
        }
        if here < FEWEST {
            for (lane, (value, direction)) in values.iter_mut().zip(directions.iter()).enumerate() {
                *value = density.one(lane).pdf(frame, *direction).unwrap_or(0.0);
            }
        } else {
            density.pdfs(level, frame, directions, values);
        }
        for (i, value) in values.iter().enumerate() {
            // SAFETY: as above.
            unsafe { pdf.write(first + i, [*value]) };
        }
    }
    Ok(())
}

/// The u of a direction: wi, then u.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[inline(always)]
pub(super) unsafe fn invert<D: Sampled>(
    (density, frame): (&D, &Frame),
    wi: *const [f32; 3],
    u: *mut [f32; 2],
    argument: u32,
) -> Checked<()> {
    // SAFETY: the caller's contract; `out` checked the pointer that is written.
    unsafe {
        let wi = *borrow(wi, argument)?;
        let target = out(u, argument + 1)?;
        target.write(density.invert(frame, wi).map_err(|status| Failure::new(status, argument))?);
    }
    Ok(())
}
