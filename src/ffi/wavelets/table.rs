//! Tabulated BRDFs in C: which directions a slice needs, what a table means, and products of it.

use crate::ffi::strided::StridedMut;
use crate::ffi::wavelets::tree::{Tree, square_tree};
use crate::ffi::{Checked, answer, borrow, out, pointer, require, sized, slice};
use crate::numeric::exp2i;
use crate::sphere::unit;
use crate::status::{Error, Status};
use crate::wavelets::lobe::Lobes;
use crate::wavelets::query::{Query, WIS_WAVELET_QUERY_WHOLE_SPHERE};
use crate::wavelets::table::{self as kernel, Between, Slice, WIS_MAX_SLICES};
use crate::wavelets::tree::MAX_DEPTH;
use core::ptr::null_mut;
use glam::Vec3;

/// An isotropic BRDF x cosine as trees that you built and that stay yours: slice k is its luminance for the view whose
/// angle to the normal is `(k + 1/2) / slice_count` of a right angle, over the octahedral square about the mirror
/// direction (wis_wavelet_table_directions). Other views blend the two slices beside them (Clarberg et al. 2005, Section 5).
/// Directions are sampled by luminance; colours, if there are any, are what wis_wavelet_query_eval tells.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Table {
    /// sizeof(wis_wavelet_table).
    pub size: u32,
    /// Slices, 1 to WIS_MAX_SLICES; the paper has 16 and 32.
    pub slice_count: u32,
    /// The slices, trees of two axes (else WIS_INVALID_ARGUMENT) whose averages are floats (else WIS_OVERFLOW). Null for a
    /// slice that was not built: the other one beside the view then stands in, and without both the answer is WIS_NOT_BUILT.
    pub slice: *const *const Tree,
    /// As `slice`, red, green and blue; three nulls: the table is grey, as its luminance says.
    pub colour: [*const *const Tree; 3],
}

/// The directions at which a slice is to be evaluated: `wo`, three numbers, and 4^depth `wi`, in the order of the pixels
/// of wis_tree_config, in a frame whose normal is +z and in which wo has y = 0. `offset`: two numbers, where in each
/// pixel, 1/2 for its centre. Average several places, and choose pixels (2 / 2^depth radians wide at the mirror direction) that
/// are finer than the lobe: samples are as uneven as the lobe is inside a pixel. wi below the surface are given too. The stride is in bytes; 0: packed.
/// Work: 4^depth.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_table_directions(
    slice: u32,
    slice_count: u32,
    depth: u32,
    offset: *const [f32; 2],
    wo: *mut [f32; 3],
    wi: *mut f32,
    wi_stride: usize,
) -> Status {
    // SAFETY: the caller's contract; indices stay below the count.
    answer(null_mut(), || unsafe {
        require((1..=WIS_MAX_SLICES).contains(&slice_count), Status::InvalidArgument, 2)?;
        require(slice < slice_count, Status::InvalidArgument, 1)?;
        require(depth <= MAX_DEPTH, Status::InvalidArgument, 3)?;
        let offset = *borrow(offset, 4)?;
        require(offset.iter().all(|x| (0.0..=1.0).contains(x)), Status::InvalidArgument, 4)?;
        let target = out(wo, 5)?;
        let count = 1 << (2 * depth);
        let wi = StridedMut::<3>::new(wi, wi_stride, count, 6)?;
        let wo = kernel::view(slice, slice_count);
        target.write(wo.to_array());
        for index in 0..count {
            wi.write(index, kernel::light_of_pixel(wo, depth, index, offset).to_array());
        }
        Ok(())
    })
}

/// The lobes of a query.
pub(super) struct Tabulated<'a> {
    pub(super) lobes: Lobes<'a>,
    /// The table as its lobes see it, and the slices beside the view.
    seen: kernel::Table<'a>,
    beside: Option<(&'a Table, Between, u32)>,
}

impl<'a> Tabulated<'a> {
    /// The lobes, and the table's channels as they see them.
    ///
    /// # Safety
    /// As [`lobes_of`].
    pub(super) unsafe fn coloured(&self) -> Checked<(Lobes<'a>, [kernel::Table<'a>; 3])> {
        let mut channels = [self.lobes.seen(self.seen); 3];
        if let Some((table, between, argument)) = self.beside {
            if table.colour.iter().any(|channel| !channel.is_null()) {
                for (channel, trees) in channels.iter_mut().zip(table.colour) {
                    let of_colour = |at: Error| at.of(c"table.colour");
                    // SAFETY: the caller's contract.
                    let blended = unsafe {
                        let trees = slice(trees, table.slice_count as usize, argument).map_err(of_colour)?;
                        blend(trees, between, argument).map_err(of_colour)?
                    };
                    *channel = self.lobes.seen(blended);
                }
            }
        }
        Ok((self.lobes, channels))
    }
}

/// The lobes of a query, and of a table, which may be null, the two slices beside its view; each with its argument.
///
/// # Safety
/// The pointer is null or points to what the header says.
pub(super) unsafe fn lobes_of<'a>(
    (query, query_argument): (&'a Query, u32),
    (table, argument): (*const Table, u32),
) -> Checked<Tabulated<'a>> {
    let of_query = |error: Error| error.instead(query_argument);
    if table.is_null() {
        let lobes = Lobes::new(query, None).map_err(of_query)?;
        return Ok(Tabulated { lobes, seen: kernel::Table::NOTHING, beside: None });
    }
    // SAFETY: the caller's contract.
    unsafe {
        let table = sized(table, argument).map_err(|at| at.of(c"table"))?;
        if !(1..=WIS_MAX_SLICES).contains(&table.slice_count) {
            return Err(Error::range(c"table.slice_count").instead(argument));
        }
        let of_slice = |at: Error| at.of(c"table.slice");
        let trees = slice(table.slice, table.slice_count as usize, argument).map_err(of_slice)?;
        let direction = |v, field| unit(v).ok_or(of_query(Error::transform(field)));
        let (normal, wo): (Vec3, Vec3) = (direction(query.normal, c"normal")?, direction(query.wo, c"wo")?);
        let cosine = normal.dot(wo);
        let above = if query.flags & WIS_WAVELET_QUERY_WHOLE_SPHERE != 0 { cosine.abs() } else { cosine };
        let between = Between::new(above, table.slice_count);
        let seen = blend(trees, between, argument).map_err(of_slice)?;
        let lobes = Lobes::new(query, Some(seen)).map_err(of_query)?;
        Ok(Tabulated { lobes, seen, beside: Some((table, between, argument)) })
    }
}

/// The two slices beside a view; one that was not built is stood in for by the other.
///
/// # Safety
/// The handles are null or point to trees of this version.
unsafe fn blend<'a>(trees: &[*const Tree], between: Between, argument: u32) -> Checked<kernel::Table<'a>> {
    let [low, high] = between.slices.map(|slice| trees.get(slice as usize).copied().unwrap_or(core::ptr::null()));
    let low = if low.is_null() { high } else { low };
    let high = if high.is_null() { low } else { high };
    pointer(low, argument).map_err(|_| Error::new(Status::NotBuilt, argument))?;
    // SAFETY: the caller's contract.
    let slices = unsafe { [read(low, argument)?, read(high, argument)?] };
    Ok(kernel::Table::new(slices, between.share))
}

/// # Safety
/// The handle points to a tree of this version.
unsafe fn read<'a>(tree: *const Tree, argument: u32) -> Checked<Slice<'a>> {
    // SAFETY: the caller's contract.
    let (tree, exponent) = unsafe { square_tree(tree, argument)? };
    // Its average is a float; one that is smaller than any counts as the smallest.
    if exponent > 127 {
        return Err(Error::new(Status::Overflow, argument));
    }
    Ok(Slice { tree, scale: exp2i(exponent.max(-126)) as f32 })
}
