//! Visibility in 8 bits, in C.

use crate::ffi::memory::{block_mut, handle, stored_or};
use crate::ffi::wavelets::tree::{Tree, integral_of, square_tree};
use crate::ffi::wavelets::triple::sublinear;
use crate::ffi::{Checked, Diagnostic, MemorySize, answer, out, put, put_size};
use crate::numeric::exp2i;
use crate::status::{Error, Status};
use crate::wavelets::triple::Wavelets;
use crate::wavelets::visibility::{self as kernel, Header};
use core::ffi::c_void;
use core::ptr::null_mut;

/// A map of visibility in 8 bits: bytes in your memory without pointers, so it may be copied (to any block aligned to
/// WIS_ALIGNMENT), saved and mapped. A third of the tree that it was made of. Constant; any number of threads may use it at
/// once. Nothing to free.
#[allow(missing_debug_implementations)]
pub struct Visibility {
    _opaque: [u8; 0],
}

/// The memory that wis_visibility_init needs: exactly the bytes that are to be saved. WIS_INVALID_ARGUMENT for a tree of
/// other than two axes. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_visibility_size(
    tree: *const Tree,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let (tree, _) = square_tree(tree, 1)?;
        put_size(size, 2, kernel::size(&tree).ok_or(Error::new(Status::Overflow, 1)))
    })
}

/// Stores a tree of two dimensions whose values are 0 (occluded) to 1 (visible) in 8 bits: exactly if they are 0 or 1, up
/// to 1/510 in the averages of larger squares (Ng et al. 2004, Section 7.1.1). WIS_INVALID_ARGUMENT for values above 1.
/// Work: squares.
///
/// # Safety
/// Pointers are null or point to what the header says; nobody else uses the block.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_visibility_init(
    tree: *const Tree,
    memory: *mut c_void,
    bytes: usize,
    visibility: *mut *const Visibility,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let (tree, exponent) = square_tree(tree, 1)?;
        let size = kernel::size(&tree).ok_or(Error::new(Status::Overflow, 1))?;
        let block = block_mut(memory, bytes, size.bytes, 2)?;
        let target = out(visibility, 4)?;
        kernel::compress_in(&tree, exp2i(exponent), block).map_err(|status| Error::new(status, 1))?;
        target.write(memory.cast_const().cast());
        Ok(())
    })
}

/// Checks bytes that wis_visibility_init wrote (copied, or mapped from a file) and gives them as a map of visibility.
/// WIS_CORRUPT if a byte was changed; with the field `magic` in the diagnostic if another version of wis wrote them. Reads
/// all of them once. Work: bytes.
///
/// # Safety
/// Pointers are null or point to what the header says; the bytes do not change while the map is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_visibility_open(
    memory: *const c_void,
    bytes: usize,
    visibility: *mut *const Visibility,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let target = out(visibility, 3)?;
        kernel::Visibility::open(stored_or(Status::Corrupt, memory, bytes, 1, Header::length)?)
            .map_err(|status| Error::new(status, 1))?;
        target.write(memory.cast());
        Ok(())
    })
}

/// As wis_triple_sublinear, for visibility in 8 bits. Work: brdf_count + light_count.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_visibility_integral(
    brdf_average: f64,
    brdf_count: u32,
    brdf: *const Wavelets,
    light_count: u32,
    kept_light: *const Wavelets,
    light: *const Tree,
    visibility: *const Visibility,
    integral: *mut f64,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let visible = view(visibility, 7)?;
        let lists = (brdf_average, (brdf, brdf_count), (kept_light, light_count));
        sublinear(lists, light, (&visible, 0), integral)
    })
}

/// The integral over the unit square of a tree of two dimensions as it is seen through a map of visibility (a double
/// product). Nothing is dropped: exact but for rounding where visibility is 0 or 1. At least 0; WIS_OVERFLOW if it is
/// beyond a double. If many vertices share a BRDF, as all that have one normal or one reflected direction, multiply it
/// by the light once for a frame: this is then faster for each vertex than wis_visibility_integral, and no
/// approximation. Work: squares.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_visibility_product_integral(
    tree: *const Tree,
    visibility: *const Visibility,
    integral: *mut f64,
) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let (tree, exponent) = square_tree(tree, 1)?;
        let visible = view(visibility, 2)?;
        put(integral, 3, integral_of(visible.product_integral(&tree), &[exponent], 3))
    })
}

/// # Safety
/// The handle is null or points to a map that this version wrote or opened.
unsafe fn view<'a>(visibility: *const Visibility, argument: u32) -> Checked<kernel::Visibility<'a>> {
    // SAFETY: the caller's contract.
    let bytes = unsafe { handle(visibility.cast(), Header::length, argument)? };
    kernel::Visibility::view(bytes).ok_or(Error::new(Status::Mismatch, argument))
}
