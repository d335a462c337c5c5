//! Many shading points in one call: a wave of hits, a tile of pixels.

use crate::ffi::wavelets::environment::{Environment, view};
use crate::ffi::wavelets::level;
use crate::ffi::wavelets::product::{Material, Opened, Product, ProductConfig, prepare, read_config};
use crate::ffi::{Checked, Diagnostic, ExclusiveBlock, Failure, Strided, StridedMut, answer, sized, slice, slice_mut};
use crate::simd::{LANES, Level};
use crate::status::Status;
use crate::wavelets::descent::{self, Sample};
use crate::wavelets::environment as kernel;
use crate::wavelets::lobe::Lobes;
use crate::wavelets::product::Group;
use crate::wavelets::query::Query;
use crate::wavelets::reuse::Reuse;
use crate::wavelets::wide::{GROUPS, InLanes, TOGETHER};
use core::ffi::c_void;
use core::ptr::null_mut;

/// Prepares `count` products in one block of `count` times the bytes that wis_wavelet_product_size gives; `product` receives
/// their handles. Each has the bytes of wis_wavelet_product_prepare. On failure, products before the query at fault, whose number
/// stands in the diagnostic's `y`, are whole.
///
/// # Safety
/// Pointers are null or point to `count` elements, to a block as long as stated that nobody else uses, or to what the
/// header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_products_prepare(
    environment: *const Environment,
    count: usize,
    query: *const Query,
    config: *const ProductConfig,
    memory: *mut c_void,
    bytes: usize,
    product: *mut *const Product,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract; block and handles of a point are not those of another, and the block holds all.
        unsafe {
            let environment = view(environment, 1)?;
            let settings = read_config(config, 4)?;
            if count == 0 {
                return Ok(());
            }
            let overflow = Failure::new(Status::Overflow, 2);
            let each = settings.bytes().ok_or(overflow)?;
            let needed = each.checked_mul(count).filter(|bytes| *bytes <= isize::MAX as usize).ok_or(overflow)?;
            let block = ExclusiveBlock::new(memory.cast(), bytes, needed, 5)?;
            let handles = slice_mut(product, count, 7)?;
            for (number, handle) in handles.iter_mut().enumerate() {
                let at = |failure: Failure| failure.in_row(3, number);
                // One at a time: after a struct of another size nothing stands where it ought to.
                let query = sized(query.wrapping_add(number), 3).map_err(at)?;
                let mut lobes = Lobes::new(query, None).map_err(|fault| at(Failure::fault(fault, 3)))?;
                lobes.widen(Reuse::new(settings.reuse_cone));
                let place = block.start().add(number * each).cast();
                prepare(&environment, *query, Material::Lobes(lobes), (&settings, 4), (place, each), handle)?;
            }
        }
        Ok(())
    })
}

/// One sample of each of `count` products: the bits of as many calls of wis_wavelet_product_sample, in a quarter of the time.
/// Strides are in bytes from one element to the next; 0: packed.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_products_sample(
    environment: *const Environment,
    count: usize,
    product: *const *const Product,
    u: *const f32,
    u_stride: usize,
    wi: *mut f32,
    wi_stride: usize,
    pdf: *mut f32,
    pdf_stride: usize,
) -> Status {
    // SAFETY: the caller's contract.
    unsafe {
        wis_wavelet_products_sample_lanes(
            environment,
            Level::BASELINE.code(),
            count,
            product,
            u,
            u_stride,
            wi,
            wi_stride,
            pdf,
            pdf_stride,
        )
    }
}

/// As wis_wavelet_products_sample, with the instructions of a `cpu_level` (wis_cpu_detect): the same bits.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_products_sample_lanes(
    environment: *const Environment,
    cpu_level: u32,
    count: usize,
    product: *const *const Product,
    u: *const f32,
    u_stride: usize,
    wi: *mut f32,
    wi_stride: usize,
    pdf: *mut f32,
    pdf_stride: usize,
) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract; indices stay below `count`.
        unsafe {
            let level = level(cpu_level, 2)?;
            let u = Strided::<2>::new(u, u_stride, count, 5)?;
            let wi = StridedMut::<3>::new(wi, wi_stride, count, 7)?;
            let pdf = StridedMut::<1>::new(pdf, pdf_stride, count, 9)?;
            for_each_group(view(environment, 1)?, count, product, |first, points| {
                let (mut here, mut samples) = ([[0.5; 2]; TOGETHER], [Sample::default(); TOGETHER]);
                let here = here.get_mut(..points.count).unwrap_or_default();
                for (i, u_here) in here.iter_mut().enumerate() {
                    *u_here = u.read(first + i);
                }
                points.sample(level, here, &mut samples);
                for (i, sample) in samples.iter().enumerate().take(here.len()) {
                    wi.write(first + i, sample.wi);
                    pdf.write(first + i, [sample.pdf]);
                }
            })
        }
    })
}

/// The pdf of one direction for each of `count` products: the bits of as many calls of wis_wavelet_product_pdf; 0 for a direction
/// that is not of unit length. Strides as above.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_products_pdf(
    environment: *const Environment,
    count: usize,
    product: *const *const Product,
    wi: *const f32,
    wi_stride: usize,
    pdf: *mut f32,
    pdf_stride: usize,
) -> Status {
    // SAFETY: the caller's contract.
    unsafe {
        wis_wavelet_products_pdf_lanes(
            environment,
            Level::BASELINE.code(),
            count,
            product,
            wi,
            wi_stride,
            pdf,
            pdf_stride,
        )
    }
}

/// As wis_wavelet_products_pdf, with the instructions of a `cpu_level` (wis_cpu_detect): the same bits.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_products_pdf_lanes(
    environment: *const Environment,
    cpu_level: u32,
    count: usize,
    product: *const *const Product,
    wi: *const f32,
    wi_stride: usize,
    pdf: *mut f32,
    pdf_stride: usize,
) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract; indices stay below `count`.
        unsafe {
            let level = level(cpu_level, 2)?;
            let wi = Strided::<3>::new(wi, wi_stride, count, 5)?;
            let pdf = StridedMut::<1>::new(pdf, pdf_stride, count, 7)?;
            for_each_group(view(environment, 1)?, count, product, |first, points| {
                let (mut here, mut values) = ([[0.0; 3]; TOGETHER], [0.0; TOGETHER]);
                let here = here.get_mut(..points.count).unwrap_or_default();
                for (i, wi_here) in here.iter_mut().enumerate() {
                    *wi_here = wi.read(first + i);
                }
                points.pdf(level, here, &mut values);
                for (i, value) in values.iter().enumerate().take(here.len()) {
                    pdf.write(first + i, [*value]);
                }
            })
        }
    })
}

/// Opens as many products at a time as are sampled together and hands them over with the number of the first.
///
/// # Safety
/// The pointer is null or points to `count` handles, each null or of a product.
#[inline(always)]
unsafe fn for_each_group<'a>(
    environment: kernel::Environment<'a>,
    count: usize,
    product: *const *const Product,
    mut run: impl FnMut(usize, &Points<'a>),
) -> Checked<()> {
    if count == 0 {
        return Ok(());
    }
    // SAFETY: the caller's contract.
    let handles = unsafe { slice(product, count, 4)? };
    for (group, handles) in handles.chunks(TOGETHER).enumerate() {
        let &[first, ..] = handles else { break };
        // SAFETY: the caller's contract.
        let first = unsafe { Opened::of(environment, first, 4)? };
        let mut points = Points { opened: [first; TOGETHER], count: handles.len(), one_frame: true };
        for (slot, &handle) in points.opened.iter_mut().zip(handles) {
            // SAFETY: the caller's contract.
            *slot = unsafe { Opened::of(environment, handle, 4)? };
            points.one_frame &= slot.frame == first.frame;
        }
        run(group * TOGETHER, &points);
    }
    Ok(())
}

/// Products that are sampled together; what is left of the room repeats the first.
struct Points<'a> {
    opened: [Opened<'a>; TOGETHER],
    count: usize,
    /// Whether the map is turned the same way for all.
    one_frame: bool,
}

impl<'a> Points<'a> {
    fn groups<'p>(&'p self) -> [Group<'p, 'a>; GROUPS] {
        let (low, high) = self.opened.split_at(LANES);
        [low, high].map(|opened| {
            let mut products = [&self.opened[0].cells; LANES];
            for (slot, opened) in products.iter_mut().zip(opened) {
                *slot = &opened.cells;
            }
            Group(products)
        })
    }

    #[inline(always)]
    fn sample(&self, level: Level, u: &[[f32; 2]], samples: &mut [Sample]) {
        if self.one_frame {
            let groups = self.groups();
            return groups.each_ref().sample_all(level, &self.opened[0].frame, u, samples);
        }
        for ((sample, point), u) in samples.iter_mut().zip(&self.opened).zip(u) {
            *sample = descent::sample(&point.cells, &point.frame, *u);
        }
    }

    #[inline(always)]
    fn pdf(&self, level: Level, wi: &[[f32; 3]], values: &mut [f32]) {
        if self.one_frame {
            let groups = self.groups();
            return groups.each_ref().pdf_all(level, &self.opened[0].frame, wi, values);
        }
        for ((value, point), wi) in values.iter_mut().zip(&self.opened).zip(wi) {
            *value = descent::pdf(&point.cells, &point.frame, *wi).unwrap_or(0.0);
        }
    }
}
