//! Sample, pdf and invert in C: one call each, for a light or a product, for one direction or many.

use crate::ffi::strided::{Strided, StridedMut, in_batches, invert_each};
use crate::ffi::wavelets::environment::{Environment, view};
use crate::ffi::wavelets::product::{Product, prepared};
use crate::ffi::{Checked, answer, frame, slice_mut};
use crate::sample::Sample;
use crate::sphere::Frame;
use crate::status::Status;
use crate::wavelets::descent::invert;
use crate::wavelets::environment::Light;
use crate::wavelets::sampler::Prepared;
use crate::wavelets::wide::{pdfs, samples};
use bytemuck::cast_slice_mut;
use core::ptr::null_mut;

/// What a call works on.
enum Asked<'a> {
    Light(Light<'a>, Frame),
    Product(Prepared<'a>),
}

/// # Safety
/// Pointers are null or point to what the header says.
#[inline(always)]
unsafe fn asked<'a>(
    environment: *const Environment,
    product: *const Product,
    world_from_map: *const [f32; 9],
) -> Checked<Asked<'a>> {
    // SAFETY: the caller's contract.
    unsafe {
        let light = view(environment, 1)?;
        let frame = frame(world_from_map, 3)?;
        if product.is_null() {
            Ok(Asked::Light(Light(light.light()), frame))
        } else {
            Ok(Asked::Product(prepared(light, product, 2)?))
        }
    }
}

/// Draws `count` directions in proportion to a product, or, if `product` is null, to the light.
///
/// `world_from_map`: of the light alone; null is the identity. A product has its own, and this one then does not count. `u`: two
/// numbers each. `drawn`: directions and their pdfs, which are above 0 and the very bits that wis_wavelet_pdf answers for that
/// direction; pdf 0 if there is nothing to sample. Strides in bytes, 0: packed. Costs 40 to 80 ns each in batches of 16, 100
/// to 200 ns alone. Work: count x (log squares + log cells).
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_sample(
    environment: *const Environment,
    product: *const Product,
    world_from_map: *const [f32; 9],
    count: usize,
    u: *const f32,
    u_stride: usize,
    drawn: *mut Sample,
    drawn_stride: usize,
) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let asked = asked(environment, product, world_from_map)?;
        let u = Strided::<2>::new(u, u_stride, count, 5)?;
        let out = StridedMut::<4>::new(drawn.cast(), drawn_stride, count, 7)?;
        in_batches(&u, &out, count, |u, out| match &asked {
            Asked::Light(light, frame) => samples(light, frame, u, cast_slice_mut(out)),
            Asked::Product(product) => samples(&product.cells, &product.frame, u, cast_slice_mut(out)),
        });
        Ok(())
    })
}

/// The pdf of `count` directions in a product, or, if `product` is null, in the light, per steradian: above 0 wherever
/// radiance x BRDF x cosine is, and 0 for directions that are not of unit length. `world_from_map` and strides as in
/// wis_wavelet_sample. Costs 20 to 50 ns each in batches of 16. Work: count x (log squares + log cells).
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_pdf(
    environment: *const Environment,
    product: *const Product,
    world_from_map: *const [f32; 9],
    count: usize,
    wi: *const f32,
    wi_stride: usize,
    pdf: *mut f32,
    pdf_stride: usize,
) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let asked = asked(environment, product, world_from_map)?;
        let wi = Strided::<3>::new(wi, wi_stride, count, 5)?;
        let pdf = StridedMut::<1>::new(pdf, pdf_stride, count, 7)?;
        in_batches(&wi, &pdf, count, |wi, pdf| match &asked {
            Asked::Light(light, frame) => pdfs(light, frame, wi, pdf.as_flattened_mut()),
            Asked::Product(product) => pdfs(&product.cells, &product.frame, wi, pdf.as_flattened_mut()),
        });
        Ok(())
    })
}

/// The `u` that leads to each of `count` directions. `status`: WIS_OK, WIS_ZERO_DENSITY where no u leads there, or
/// WIS_INVALID_TRANSFORM for a direction that is not of unit length, each as a byte; where it is not WIS_OK, u is not written.
/// `world_from_map` and strides as in wis_wavelet_sample; statuses stand close together.
/// Work: count x (log squares + log cells).
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_invert(
    environment: *const Environment,
    product: *const Product,
    world_from_map: *const [f32; 9],
    count: usize,
    wi: *const f32,
    wi_stride: usize,
    u: *mut f32,
    u_stride: usize,
    status: *mut u8,
) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let asked = asked(environment, product, world_from_map)?;
        let wi = Strided::<3>::new(wi, wi_stride, count, 5)?;
        let u = StridedMut::<2>::new(u, u_stride, count, 7)?;
        let statuses = slice_mut(status, count, 9)?;
        invert_each(&wi, &u, statuses, &|wi| match &asked {
            Asked::Light(light, frame) => invert(light, frame, wi),
            Asked::Product(product) => invert(&product.cells, &product.frame, wi),
        });
        Ok(())
    })
}
