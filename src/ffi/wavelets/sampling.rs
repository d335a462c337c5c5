//! Sample, pdf and invert in C: one call each, for a light or a product, for one direction or many.

use crate::ffi::wavelets::environment::{Environment, view};
use crate::ffi::wavelets::product::{Product, prepared};
use crate::ffi::{Checked, Strided, StridedMut, answer, frame, slice_mut};
use crate::sample::Sample;
use crate::simd::Native;
use crate::sphere::Frame;
use crate::status::Status;
use crate::wavelets::descent::{self, Density};
use crate::wavelets::environment::Light;
use crate::wavelets::sampler::Prepared;
use crate::wavelets::wide::{self, TOGETHER, WideDensity};
use core::ptr::null_mut;

/// So many directions together cost less in lanes than one by one.
const FEWEST: usize = 3;

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
    answer(null_mut(), || {
        // SAFETY: the caller's contract; indices stay below `count`.
        unsafe {
            let asked = asked(environment, product, world_from_map)?;
            let u = Strided::<2>::new(u, u_stride, count, 5)?;
            let out = StridedMut::<4>::new(drawn.cast(), drawn_stride, count, 7)?;
            match &asked {
                Asked::Light(light, frame) => sample_all(light, frame, count, &u, &out),
                Asked::Product(product) => sample_all(&product.cells, &product.frame, count, &u, &out),
            }
        }
        Ok(())
    })
}

/// # Safety
/// The arrays hold `count` elements.
unsafe fn sample_all<D: WideDensity>(density: &D, frame: &Frame, count: usize, u: &Strided<2>, out: &StridedMut<4>) {
    let write = |index: usize, Sample { wi: [x, y, z], pdf }: Sample| {
        // SAFETY: the index is below the count.
        unsafe { out.write(index, [x, y, z, pdf]) };
    };
    for first in (0..count).step_by(TOGETHER) {
        let here = (count - first).min(TOGETHER);
        if here < FEWEST {
            for index in first..first + here {
                // SAFETY: the index is below the count.
                write(index, descent::sample(density, frame, unsafe { u.read(index) }));
            }
            continue;
        }
        let (mut numbers, mut samples) = ([[0.5; 2]; TOGETHER], [Sample::default(); TOGETHER]);
        let numbers = numbers.get_mut(..here).unwrap_or_default();
        for (i, number) in numbers.iter_mut().enumerate() {
            // SAFETY: the index is below the count.
            *number = unsafe { u.read(first + i) };
        }
        wide::sample::<Native, D>(density, frame, numbers, &mut samples);
        samples.iter().take(here).enumerate().for_each(|(i, sample)| write(first + i, *sample));
    }
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
    answer(null_mut(), || {
        // SAFETY: the caller's contract; indices stay below `count`.
        unsafe {
            let asked = asked(environment, product, world_from_map)?;
            let wi = Strided::<3>::new(wi, wi_stride, count, 5)?;
            let pdf = StridedMut::<1>::new(pdf, pdf_stride, count, 7)?;
            match &asked {
                Asked::Light(light, frame) => pdf_all(light, frame, count, &wi, &pdf),
                Asked::Product(product) => pdf_all(&product.cells, &product.frame, count, &wi, &pdf),
            }
        }
        Ok(())
    })
}

/// # Safety
/// The arrays hold `count` elements.
unsafe fn pdf_all<D: WideDensity>(density: &D, frame: &Frame, count: usize, wi: &Strided<3>, pdf: &StridedMut<1>) {
    for first in (0..count).step_by(TOGETHER) {
        let here = (count - first).min(TOGETHER);
        if here < FEWEST {
            for index in first..first + here {
                // SAFETY: the index is below the count.
                unsafe { pdf.write(index, [descent::pdf(density, frame, wi.read(index)).unwrap_or(0.0)]) };
            }
            continue;
        }
        let (mut directions, mut values) = ([[0.0; 3]; TOGETHER], [0.0; TOGETHER]);
        let directions = directions.get_mut(..here).unwrap_or_default();
        for (i, direction) in directions.iter_mut().enumerate() {
            // SAFETY: the index is below the count.
            *direction = unsafe { wi.read(first + i) };
        }
        wide::pdf::<Native, D>(density, frame, directions, &mut values);
        for (i, value) in values.iter().take(here).enumerate() {
            // SAFETY: the index is below the count.
            unsafe { pdf.write(first + i, [*value]) };
        }
    }
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
    answer(null_mut(), || {
        // SAFETY: the caller's contract; indices stay below `count`.
        unsafe {
            let asked = asked(environment, product, world_from_map)?;
            let wi = Strided::<3>::new(wi, wi_stride, count, 5)?;
            let u = StridedMut::<2>::new(u, u_stride, count, 7)?;
            let statuses = slice_mut(status, count, 9)?;
            match &asked {
                Asked::Light(light, frame) => invert_all(light, frame, &wi, &u, statuses),
                Asked::Product(product) => invert_all(&product.cells, &product.frame, &wi, &u, statuses),
            }
        }
        Ok(())
    })
}

/// # Safety
/// The arrays hold an element for each status.
unsafe fn invert_all<D: Density>(density: &D, frame: &Frame, wi: &Strided<3>, u: &StridedMut<2>, statuses: &mut [u8]) {
    for (index, status) in statuses.iter_mut().enumerate() {
        // SAFETY: the index is below the count.
        let found = unsafe { descent::invert(density, frame, wi.read(index)) };
        *status = match found {
            Ok(numbers) => {
                // SAFETY: as above.
                unsafe { u.write(index, numbers) };
                Status::Ok as u8
            }
            Err(status) => status as u8,
        };
    }
}
