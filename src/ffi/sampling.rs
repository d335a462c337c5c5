//! Sample, pdf and invert in C: one call each, for the light or a product, for one direction or many.

use super::light::{EnvironmentObject, environment as view};
use super::product::{ProductObject, shaded};
use super::sampler::{SamplerObject, with_level};
use super::{Strided, StridedMut, packed};
use crate::light::batch::{Density, Drawn, FEWEST, pdf, pdfs, sample, samples};
use crate::light::density::Inverted;
use crate::numeric::clamp_u;
use crate::sample::Sample;
use crate::simd::Level;
use crate::sphere::{Frame, unit};
use crate::status::Status;

/// So many directions are copied together: as many as walk together through the tables.
const TOGETHER: usize = 32;

/// Draws `count` directions in proportion to a product, or, if `product` is null, to the light.
///
/// `u`: two numbers in [0, 1) each; others are moved there, NaN counts as 1/2. `drawn`: directions of unit length in world space, and
/// their pdfs per steradian: above 0, and the very bits that wis_pdf answers for that direction; 0 if the light is black. Strides
/// are the bytes from one element to the next; 0: packed. WIS_MISMATCH for a product of another environment. About 40 ns each in
/// batches of 8 and more; with a product about 80 ns in batches of 64, 90 ns to 140 ns in batches of 8, and 400 ns alone.
/// Work: count x (lobes + log texels).
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_sample(
    sampler: *mut SamplerObject,
    environment: *const EnvironmentObject,
    product: *const ProductObject,
    count: usize,
    u: *const f32,
    u_stride: usize,
    drawn: *mut Sample,
    drawn_stride: usize,
) -> Status {
    // SAFETY: the caller's contract, also for what stands inside.
    unsafe {
        with_level(sampler, |level| {
            let environment = view(environment, 2)?;
            let u = Strided::<2>::new(u, u_stride, count, 5)?;
            let out = StridedMut::<4>::new(drawn.cast(), drawn_stride, count, 7)?;
            if product.is_null() {
                sample_all(level, &environment.light(), &environment.frame(), count, &u, &out);
            } else if let Some(shaded) = shaded(product, &environment, 3)? {
                if shaded.product.header.scale == 0.0 {
                    // A black product has no cell to search: that leads to no direction.
                    (0..count).for_each(|i| out.write(i, [0.0, 0.0, 1.0, 0.0]));
                    return Ok(());
                }
                sample_all(level, &shaded, &environment.frame(), count, &u, &out);
            }
            Ok(())
        })
    }
}

/// # Safety
/// The arrays hold `count` elements.
#[inline(always)]
unsafe fn sample_all<D: Density>(
    level: Level,
    density: &D,
    frame: &Frame,
    count: usize,
    u: &Strided<2>,
    out: &StridedMut<4>,
) {
    if count < FEWEST {
        for i in 0..count {
            // SAFETY: the index is below the count.
            unsafe {
                let Drawn { wi: [x, y, z], pdf } = sample(density, frame, u.read(i));
                out.write(i, [x, y, z, pdf]);
            }
        }
        return;
    }
    // SAFETY: the caller's contract.
    if let Some((u, out)) = unsafe { packed(u, out, count) } {
        return samples(level, density, frame, u, bytemuck::cast_slice_mut(out));
    }
    let (mut numbers, mut drawn) = ([[0.0; 2]; TOGETHER], [Drawn::default(); TOGETHER]);
    for first in (0..count).step_by(TOGETHER) {
        let here = (count - first).min(TOGETHER);
        let (numbers, drawn) = (numbers.get_mut(..here).unwrap_or_default(), drawn.get_mut(..here).unwrap_or_default());
        for (i, number) in numbers.iter_mut().enumerate() {
            // SAFETY: the index is below the count.
            *number = unsafe { u.read(first + i) };
        }
        samples(level, density, frame, numbers, drawn);
        for (i, drawn) in drawn.iter().enumerate() {
            let [x, y, z] = drawn.wi;
            // SAFETY: the index is below the count.
            unsafe { out.write(first + i, [x, y, z, drawn.pdf]) };
        }
    }
}

/// The pdf of `count` directions in a product, or, if `product` is null, in the light, per steradian; 0 for those that are not of unit
/// length within 1e-3. Strides as in wis_sample. About 15 ns each in batches of 8 and more, with a product 30 ns.
/// Work: count x (lobes + log texels).
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_pdf(
    sampler: *mut SamplerObject,
    environment: *const EnvironmentObject,
    product: *const ProductObject,
    count: usize,
    wi: *const f32,
    wi_stride: usize,
    pdf: *mut f32,
    pdf_stride: usize,
) -> Status {
    // SAFETY: the caller's contract, also for what stands inside.
    unsafe {
        with_level(sampler, |level| {
            let environment = view(environment, 2)?;
            let wi = Strided::<3>::new(wi, wi_stride, count, 5)?;
            let pdf = StridedMut::<1>::new(pdf, pdf_stride, count, 7)?;
            if product.is_null() {
                pdf_all(level, &environment.light(), &environment.frame(), count, &wi, &pdf);
            } else if let Some(shaded) = shaded(product, &environment, 3)? {
                pdf_all(level, &shaded, &environment.frame(), count, &wi, &pdf);
            }
            Ok(())
        })
    }
}

/// # Safety
/// The arrays hold `count` elements.
#[inline(always)]
unsafe fn pdf_all<D: Density>(
    level: Level,
    density: &D,
    frame: &Frame,
    count: usize,
    wi: &Strided<3>,
    out: &StridedMut<1>,
) {
    if count < FEWEST {
        for i in 0..count {
            // SAFETY: the index is below the count.
            unsafe { out.write(i, [pdf(density, frame, wi.read(i))]) };
        }
        return;
    }
    // SAFETY: the caller's contract.
    if let Some((wi, out)) = unsafe { packed(wi, out, count) } {
        return pdfs(level, density, frame, wi, out.as_flattened_mut());
    }
    let (mut directions, mut densities) = ([[0.0; 3]; TOGETHER], [0.0; TOGETHER]);
    for first in (0..count).step_by(TOGETHER) {
        let here = (count - first).min(TOGETHER);
        let directions = directions.get_mut(..here).unwrap_or_default();
        for (i, direction) in directions.iter_mut().enumerate() {
            // SAFETY: the index is below the count.
            *direction = unsafe { wi.read(first + i) };
        }
        pdfs(level, density, frame, directions, &mut densities);
        for (i, &density) in densities.iter().take(here).enumerate() {
            // SAFETY: the index is below the count.
            unsafe { out.write(first + i, [density]) };
        }
    }
}

/// The `u` that leads to each of `count` directions. `status`: WIS_OK, WIS_ZERO_DENSITY where no u leads there,
/// WIS_UNREACHABLE where the density is above 0 but no u of 24 bits leads there (with a product: or narrow lobes alone do), or
/// WIS_INVALID_TRANSFORM for a direction that is not of unit length within 1e-3, each as a byte; where it is not WIS_OK, u is not
/// written. Strides as in wis_sample; statuses stand close together. Work: count x (lobes + log texels).
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_invert(
    sampler: *mut SamplerObject,
    environment: *const EnvironmentObject,
    product: *const ProductObject,
    count: usize,
    wi: *const f32,
    wi_stride: usize,
    u: *mut f32,
    u_stride: usize,
    status: *mut u8,
) -> Status {
    // SAFETY: the caller's contract, also for what stands inside.
    unsafe {
        with_level(sampler, |_| {
            let environment = view(environment, 2)?;
            let shaded = shaded(product, &environment, 3)?;
            let wi = Strided::<3>::new(wi, wi_stride, count, 5)?;
            let u = StridedMut::<2>::new(u, u_stride, count, 7)?;
            let statuses = super::slice_mut(status, count, 9)?;
            let (light, frame) = (environment.light(), environment.frame());
            let invert = |direction| match &shaded {
                Some(shaded) => shaded.invert(&frame, direction),
                None => light.invert(&frame, direction),
            };
            for (i, status) in statuses.iter_mut().enumerate() {
                let found = match unit(wi.read(i)) {
                    None => Err(Status::InvalidTransform),
                    Some(direction) => match invert(direction) {
                        Inverted::To(u) => Ok(u),
                        Inverted::Unreachable => Err(Status::Unreachable),
                        Inverted::Zero => Err(Status::ZeroDensity),
                    },
                };
                *status = match found {
                    Ok(numbers) => {
                        u.write(i, numbers.map(clamp_u));
                        Status::Ok as u8
                    }
                    Err(status) => status as u8,
                };
            }
            Ok(())
        })
    }
}
