//! Many shading points in one call: a wave of hits, a tile of pixels.

use super::environment::{Environment, view};
use super::product::{Opened, Product, ProductConfig, prepare_with, read_config};
use super::{Block, Checked, Diagnostic, Failure, Strided, answer, sized, slice, slice_mut};
use crate::descent::{self, Sample};
use crate::environment as kernel;
use crate::lobe::Lobes;
use crate::product::Group;
use crate::query::Query;
use crate::reuse::Reuse;
use crate::simd::LANES;
use crate::status::Status;
use crate::wide::WideDensity;
use core::ffi::c_void;
use core::ptr::null_mut;

/// Prepares `count` products in one block of `count` times the bytes that wis_product_size gives; `product` receives
/// their handles. Each has the bytes of wis_product_prepare. On failure, products before the query at fault, whose number
/// stands in the diagnostic's `y`, are whole.
///
/// # Safety
/// Pointers are null or point to `count` elements, to a block as long as stated that nobody else uses, or to what the
/// header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_products_prepare(
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
        // SAFETY: the caller's contract; block and handles of a point are not those of another.
        unsafe {
            let environment = view(environment, 1)?;
            let settings = read_config(config, 4)?;
            if count == 0 {
                return Ok(());
            }
            let overflow = Failure::new(Status::Overflow, 2);
            let each = settings.bytes().ok_or(overflow)?;
            let needed = each.checked_mul(count).filter(|bytes| *bytes <= isize::MAX as usize).ok_or(overflow)?;
            let block = Block::new(memory.cast(), bytes, needed, 5)?;
            let handles = slice_mut(product, count, 7)?;
            for (number, handle) in handles.iter_mut().enumerate() {
                let at = |failure: Failure| failure.in_row(3, number);
                // One at a time: after a struct of another size nothing stands where it ought to.
                let query = sized(query.wrapping_add(number), 3).map_err(at)?;
                let lobes = Lobes::new(query, None).map_err(|status| at(status.into()))?;
                let mut lobes = lobes.widened(Reuse::new(settings.reuse_cone));
                let place = block.slice::<u8>(0, number * each, each).as_mut_ptr().cast();
                prepare_with(&environment, *query, &mut lobes, (&settings, 4), (place, each), handle)?;
            }
        }
        Ok(())
    })
}

/// One sample of each of `count` products: the bits of as many calls of wis_product_sample, in a third of the time.
/// Strides are in bytes from one element to the next; 0: packed.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_products_sample(
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
    answer(null_mut(), || {
        // SAFETY: the caller's contract; indices stay below `count`.
        unsafe {
            let u = Strided::<2>::new(u, u_stride, count, 4)?;
            let wi = Strided::<3>::new(wi, wi_stride, count, 6)?;
            let pdf = Strided::<1>::new(pdf, pdf_stride, count, 8)?;
            for_each_group(view(environment, 1)?, count, product, |first, points| {
                let mut here = [[0.5; 2]; LANES];
                here.iter_mut()
                    .enumerate()
                    .take(points.count)
                    .for_each(|(lane, u_here)| *u_here = u.read(first + lane));
                for (lane, sample) in points.sample(here).into_iter().enumerate().take(points.count) {
                    wi.write(first + lane, sample.wi);
                    pdf.write(first + lane, [sample.pdf]);
                }
            })
        }
    })
}

/// The pdf of one direction for each of `count` products: the bits of as many calls of wis_product_pdf; 0 for a direction
/// that is not of unit length. Strides as above.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_products_pdf(
    environment: *const Environment,
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
            let wi = Strided::<3>::new(wi, wi_stride, count, 4)?;
            let pdf = Strided::<1>::new(pdf, pdf_stride, count, 6)?;
            for_each_group(view(environment, 1)?, count, product, |first, points| {
                let mut here = [[0.0; 3]; LANES];
                here.iter_mut()
                    .enumerate()
                    .take(points.count)
                    .for_each(|(lane, wi_here)| *wi_here = wi.read(first + lane));
                for (lane, value) in points.pdf(here).into_iter().enumerate().take(points.count) {
                    pdf.write(first + lane, [value]);
                }
            })
        }
    })
}

/// Opens eight products at a time and hands them over with the number of the first.
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
    let handles = unsafe { slice(product, count, 3)? };
    for (group, handles) in handles.chunks(LANES).enumerate() {
        let &[first, ..] = handles else { break };
        // SAFETY: the caller's contract.
        let first = unsafe { Opened::of(environment, first, 3)? };
        let mut points = Points { opened: [first; LANES], count: handles.len(), one_frame: true };
        for (slot, &handle) in points.opened.iter_mut().zip(handles) {
            // SAFETY: the caller's contract.
            *slot = unsafe { Opened::of(environment, handle, 3)? };
            points.one_frame &= slot.frame == first.frame;
        }
        run(group * LANES, &points);
    }
    Ok(())
}

/// Up to eight products; what is left of the eight repeats the first.
struct Points<'a> {
    opened: [Opened<'a>; LANES],
    count: usize,
    /// Whether the map is turned the same way for all.
    one_frame: bool,
}

impl<'a> Points<'a> {
    fn group<'p>(&'p self) -> Group<'p, 'a> {
        let [a, b, c, d, e, f, g, h] = &self.opened;
        Group([&a.cells, &b.cells, &c.cells, &d.cells, &e.cells, &f.cells, &g.cells, &h.cells])
    }

    #[inline(always)]
    fn sample(&self, u: [[f32; 2]; LANES]) -> [Sample; LANES] {
        if self.one_frame {
            return self.group().sample_all(&self.opened[0].frame, u);
        }
        let mut samples = [Sample::default(); LANES];
        for ((sample, point), u) in samples.iter_mut().zip(&self.opened).zip(u) {
            *sample = descent::sample(&point.cells, &point.frame, u);
        }
        samples
    }

    #[inline(always)]
    fn pdf(&self, wi: [[f32; 3]; LANES]) -> [f32; LANES] {
        if self.one_frame {
            return self.group().pdf_all(&self.opened[0].frame, wi);
        }
        let mut values = [0.0; LANES];
        for ((value, point), wi) in values.iter_mut().zip(&self.opened).zip(wi) {
            *value = descent::pdf(&point.cells, &point.frame, wi).unwrap_or(0.0);
        }
        values
    }
}
