//! Sample, pdf and invert in C: one call each, for the light or a product, for one direction or many.

use super::light::{EnvironmentObject, exact, tables};
use super::product::{ProductObject, product};
use super::sampler::{SamplerObject, with_level};
use super::slice_mut;
use super::strided::{Strided, StridedMut, in_batches, invert_each};
use crate::light::batch::{pdfs, samples};
use crate::product::density::Shaded;
use crate::sample::Sample;
use crate::sphere::unit;
use crate::status::Status;
use bytemuck::cast_slice_mut;

/// Draws `count` directions in proportion to a product, or, if `product` is null, to the light. `u`: two numbers in [0, 1) each. `drawn`:
/// unit directions in world space, and their pdfs per steradian: above 0, and the very bits that wis_pdf answers for that direction; 0 if
/// the light is black. In batches of 8 and more a third of the cost alone, or less. WIS_MISMATCH for a product of another environment,
/// WIS_NOT_BUILT for one with WIS_ENVIRONMENT_RAYS_ONLY.
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
        with_level(sampler, |level, kept| {
            let environment = exact(environment, 2)?;
            let u = Strided::<2>::new(u, u_stride, count, 5)?;
            let out = StridedMut::<4>::new(drawn.cast(), drawn_stride, count, 7)?;
            let (light, frame) = (tables(kept, &environment), environment.frame());
            if product.is_null() {
                in_batches(&u, &out, count, |u, out| samples(level, light, &frame, u, cast_slice_mut(out)));
                return Ok(());
            }
            let product = self::product(product, &environment, 3)?;
            // A black product has no cell to search: that leads to no direction.
            if product.header.scale == 0.0 {
                (0..count).for_each(|i| out.write(i, [0.0, 0.0, 1.0, 0.0]));
                return Ok(());
            }
            let shaded = Shaded::new(light, product);
            in_batches(&u, &out, count, |u, out| samples(level, &shaded, &frame, u, cast_slice_mut(out)));
            Ok(())
        })
    }
}

/// The pdf of `count` directions in a product, or, if `product` is null, in the light, per steradian; 0 for those that are not of unit
/// length within 1e-3. Batches and WIS_NOT_BUILT as in wis_sample. Work: count x (lobes + log texels).
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
        with_level(sampler, |level, kept| {
            let environment = exact(environment, 2)?;
            let wi = Strided::<3>::new(wi, wi_stride, count, 5)?;
            let pdf = StridedMut::<1>::new(pdf, pdf_stride, count, 7)?;
            let (light, frame) = (tables(kept, &environment), environment.frame());
            if product.is_null() {
                in_batches(&wi, &pdf, count, |wi, pdf| pdfs(level, light, &frame, wi, pdf.as_flattened_mut()));
                return Ok(());
            }
            let shaded = Shaded::new(light, self::product(product, &environment, 3)?);
            in_batches(&wi, &pdf, count, |wi, pdf| pdfs(level, &shaded, &frame, wi, pdf.as_flattened_mut()));
            Ok(())
        })
    }
}

/// The `u` that leads to each of `count` directions: into its part of the tables, and there as near as 24 bits of u come. `status`:
/// WIS_OK; WIS_ZERO_DENSITY where no u leads there; WIS_UNREACHABLE where the density is above 0 but no u of 24 bits leads there (with a
/// product: or narrow lobes alone do); WIS_INVALID_TRANSFORM for a direction that is not of unit length within 1e-3. A byte each; u is
/// written where it is WIS_OK. WIS_NOT_BUILT as in wis_sample. Strides as in wis_sample; statuses are packed. Work: count x (lobes + log texels).
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
        with_level(sampler, |_, kept| {
            let environment = exact(environment, 2)?;
            let (light, frame) = (tables(kept, &environment), environment.frame());
            let product = if product.is_null() { None } else { Some(self::product(product, &environment, 3)?) };
            let shaded = product.map(|product| Shaded::new(light, product));
            let wi = Strided::<3>::new(wi, wi_stride, count, 5)?;
            let u = StridedMut::<2>::new(u, u_stride, count, 7)?;
            let statuses = slice_mut(status, count, 9)?;
            invert_each(&wi, &u, statuses, &|wi| {
                unit(wi).ok_or(Status::InvalidTransform)?;
                let found = match &shaded {
                    Some(shaded) => shaded.invert(&frame, wi),
                    None => light.invert(&frame, wi),
                };
                found.numbers()
            });
            Ok(())
        })
    }
}
