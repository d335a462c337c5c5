//! Wavelet trees of any function on the unit cube of two or four axes, in C.

pub use crate::wavelets::stored::TreeInfo;

use crate::ffi::memory::{handle, stored_or};
use crate::ffi::wavelets::memory::Results;
use crate::ffi::{Checked, Diagnostic, answer, out, put, slice, slice_mut};
use crate::status::{Error, Status};
use crate::wavelets::stored::{AnyTree, Header, Stored, in_units};
use crate::wavelets::tree as kernel;
use core::ffi::c_void;
use core::ptr::null_mut;

mod build;

pub use build::*;

/// The tree of a function: bytes in your memory without pointers, so it may be copied (to any block aligned to
/// WIS_ALIGNMENT), saved and mapped. Constant once built; any number of threads may use it at once. Nothing to free.
#[allow(missing_debug_implementations)]
pub struct Tree {
    _opaque: [u8; 0],
}

/// Checks bytes that an earlier build wrote (copied, or mapped from a file) and gives them as a tree. WIS_CORRUPT if a byte
/// was changed; with the field `magic` in the diagnostic if another version of wis wrote them. Reads all of them once. `info`
/// may be null. Work: bytes.
///
/// # Safety
/// Pointers are null or point to what the header says; the bytes do not change while the tree is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_open(
    memory: *const c_void,
    bytes: usize,
    tree: *mut *const Tree,
    info: *mut TreeInfo,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let results = Results::new((tree, 3), (info, 4))?;
        let opened = Stored::open(stored_or(Status::Corrupt, memory, bytes, 1, Header::checked_length)?);
        results.publish(memory, opened.map_err(|status| Error::new(status, 1))?.header.info())
    })
}

/// The integral over the unit cube of the product of the stored functions. `f` has the first axes of `e`, at most as
/// many (else WIS_INVALID_ARGUMENT), and is constant along the rest. At least 0; WIS_OVERFLOW if it is beyond a double.
/// Costs one visit of each square that both trees keep. Work: squares.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_product_integral(e: *const Tree, f: *const Tree, integral: *mut f64) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let (e, f) = (view(e, 1)?, view(f, 2)?);
        let product = e.tree.product_integral(&f.tree).ok_or(Error::new(Status::InvalidArgument, 2));
        put(integral, 3, product.and_then(|sum| integral_of(sum, &[e.header.exponent, f.header.exponent], 3)))
    })
}

/// Samples a point of the unit cube in proportion to the function. `u`: n numbers in [0, 1) (others are moved there,
/// NaN counts as 1/2); `point`: n numbers; `pdf`: the density there with respect to the cube. A tree that is 0
/// everywhere gives pdf 0. Work: depth.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_sample(tree: *const Tree, u: *const f32, point: *mut f32, pdf: *mut f32) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let tree = view(tree, 1)?.tree;
        let axes = tree.axes() as usize;
        let (u, point) = (slice(u, axes, 2)?, slice_mut(point, axes, 3)?);
        out(pdf, 4)?.write(tree.sample(u, point));
        Ok(())
    })
}

/// The density at any point (coordinates are moved into [0, 1)): the very bits that a sample came with. Work: depth.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_pdf(tree: *const Tree, point: *const f32, pdf: *mut f32) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let tree = view(tree, 1)?.tree;
        let point = slice(point, tree.axes() as usize, 2)?;
        out(pdf, 3)?.write(tree.pdf(point));
        Ok(())
    })
}

/// The `u` that leads to a point. WIS_ZERO_DENSITY if none does. Work: depth.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_invert(tree: *const Tree, point: *const f32, u: *mut f32) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let tree = view(tree, 1)?.tree;
        let axes = tree.axes() as usize;
        let (point, u) = (slice(point, axes, 2)?, slice_mut(u, axes, 3)?);
        tree.invert(point, u).map_err(|status| Error::new(status, 2))
    })
}

/// Warps `count` points (n packed numbers each) in place; afterwards points of one cell stand together. The points
/// and `index` (your numbers of the points) are permuted alike; as a set, the points are those of wis_tree_sample to
/// the bit.
/// WIS_ZERO_DENSITY if the tree is 0 everywhere. Work: count x depth.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_warp_in_place(
    tree: *const Tree,
    points: *mut f32,
    index: *mut u32,
    count: usize,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let tree = view(tree, 1)?.tree;
        let numbers = count.checked_mul(tree.axes() as usize).filter(|n| *n <= isize::MAX as usize / size_of::<f32>());
        let numbers = numbers.ok_or(Error::new(Status::Overflow, 4))?;
        let (points, index) = (slice_mut(points, numbers, 2)?, slice_mut(index, count, 3)?);
        tree.warp_in_place(points, index).map_err(|status| Error::new(status, 1))
    })
}

/// The tree behind a handle.
///
/// # Safety
/// The handle is null or points to a tree that this version built or opened.
#[inline(always)]
pub(super) unsafe fn view<'a>(tree: *const Tree, argument: u32) -> Checked<Stored<'a>> {
    // SAFETY: the caller's contract.
    let bytes = unsafe { handle(tree.cast(), Header::length, argument)? };
    Stored::view(bytes).ok_or(Error::new(Status::Mismatch, argument))
}

/// A tree of two dimensions, and the exponent of the power of two that its stored values are to be multiplied by.
///
/// # Safety
/// As [`view`].
pub(super) unsafe fn square_tree<'a>(tree: *const Tree, argument: u32) -> Checked<(kernel::Tree<'a, 4>, i32)> {
    // SAFETY: the caller's contract.
    match unsafe { view(tree, argument)? } {
        Stored { tree: AnyTree::Square(tree), header } => Ok((tree, header.exponent)),
        _ => Err(Error::new(Status::InvalidArgument, argument)),
    }
}

/// An integral in the units of the input.
pub(super) fn integral_of(stored: f64, exponents: &[i32], argument: u32) -> Checked<f64> {
    in_units(stored, exponents).ok_or(Error::new(Status::Overflow, argument))
}
