//! Products and weighted sums of trees in C.

use super::{Tree, TreeInfo, refused, view};
use crate::ffi::memory::block_mut;
use crate::ffi::wavelets::memory::{Results, room_mut};
use crate::ffi::{Checked, Diagnostic, Failure, MemorySize, answer, put_size, require, require_all, slice};
use crate::status::Status;
use crate::wavelets::combine::{MAX_FACTORS, WIS_MAX_BLEND, add_in, multiply_in, product_size, sum_size};
use crate::wavelets::stored::{Refused, Stored};
use core::ffi::c_void;
use core::ptr::null;

/// The memory that wis_tree_multiply needs for these trees at most; `g` may be null. If all trees have the same axes the
/// size is exact, and costs one visit of each square of the product. Otherwise it is an upper bound, and costs one visit of
/// each square of the trees. WIS_OVERFLOW if there may be more than 2^32 - 2 squares.
/// Work: squares of the trees and of the product.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_multiply_size(
    e: *const Tree,
    f: *const Tree,
    g: *const Tree,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let (trees, count) = factors(e, f, g)?;
        let trees = trees.get(..count).unwrap_or(&[]);
        put_size(size, 4, product_size(trees).ok_or(Failure::new(Status::Overflow, 2)))
    })
}

/// Multiplies two or three trees into a tree: sampled, saved and multiplied like any other. `f` and `g` (null: 1) have the
/// first axes of `e`, at most as many, and are constant along the rest. The averages are exact but for rounding (Clarberg
/// et al. 2005, Section 4.3; with light, BRDF x cosine and visibility as factors the triple product of Ng et al. 2004).
/// `error` in `info`, which may be null, is 0: what was dropped from the factors is not counted. WIS_INVALID_ARGUMENT if `f` or
/// `g` has more axes than `e`; WIS_OVERFLOW if the average is above 0 and below 2^-1022, or beyond a double.
///
/// Blocks may be longer than wis_tree_multiply_size says, and serve for many products. They may be shorter, too: the call
/// answers WIS_MEMORY_TOO_SMALL as soon as the product exceeds the scratch block, or at the end if it exceeds the other one.
/// The diagnostic then tells enough bytes, of the scratch block as wis_tree_multiply_size does. The bytes in use stand in
/// `info`. Work: squares of the trees and of the product.
///
/// # Safety
/// Pointers are null or point to what the header says; blocks are as long as stated and nobody else uses them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_multiply(
    e: *const Tree,
    f: *const Tree,
    g: *const Tree,
    memory: *mut c_void,
    bytes: usize,
    scratch: *mut c_void,
    scratch_bytes: usize,
    tree: *mut *const Tree,
    info: *mut TreeInfo,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let (trees, count) = factors(e, f, g)?;
        let results = Results::new((tree, 8), (info, 9))?;
        let scratch = block_mut(scratch, scratch_bytes, scratch_bytes, 6)?;
        let block = room_mut(memory, bytes, usize::MAX, 4)?;
        let built = multiply_in(trees.get(..count).unwrap_or(&[]), block, scratch);
        results.publish(memory, built.map_err(failure)?.info())
    })
}

/// Why trees were not combined.
fn failure(why: Refused) -> Failure {
    match why {
        Refused::Squares => Failure::new(Status::Overflow, 2),
        _ => refused(why, [1, 4, 6]),
    }
}

/// Two or three trees, and how many they are.
///
/// # Safety
/// The handles are null or point to trees of this version.
unsafe fn factors<'a>(e: *const Tree, f: *const Tree, g: *const Tree) -> Checked<([Stored<'a>; MAX_FACTORS], usize)> {
    // SAFETY: the caller's contract.
    unsafe {
        let e = view(e, 1)?;
        let factor = |handle, argument| {
            let fits = |factor: &Stored| factor.tree.axes() <= e.tree.axes();
            view(handle, argument)
                .and_then(|factor| Some(factor).filter(fits).ok_or(Failure::new(Status::InvalidArgument, argument)))
        };
        let f = factor(f, 2)?;
        if g.is_null() { Ok(([e, f, f], 2)) } else { Ok(([e, f, factor(g, 3)?], 3)) }
    }
}

/// The memory that wis_tree_blend needs for these trees, at most. Costs one visit of each square of the sum.
/// Work: squares of all trees.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_blend_size(
    tree_count: u32,
    trees: *const *const Tree,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let (trees, count) = terms(tree_count, trees)?;
        let trees = trees.get(..count).unwrap_or(&[]);
        put_size(size, 3, sum_size(trees).ok_or(Failure::new(Status::Overflow, 2)))
    })
}

/// The weighted sum of 1 to WIS_MAX_BLEND trees of the same axes as a tree: what stands between tabulated functions, exactly
/// (Clarberg et al. 2005, Section 5.2: coefficients interpolate one by one). `weight`: finite, 0 or more. The product
/// (wis_tree_multiply) of two such sums is the bilinear blend of the products of all pairs. WIS_INVALID_ARGUMENT for another
/// number of trees, trees of different axes, or a weight out of range: `y` in the diagnostic is the number of the tree or the
/// weight. WIS_OVERFLOW as wis_tree_multiply.
///
/// Blocks may be longer than wis_tree_blend_size says; one that is too short fails with WIS_MEMORY_TOO_SMALL. The bytes in use
/// stand in `info`, which may be null; its `error` is 0. Work: squares of all trees.
///
/// # Safety
/// Pointers are null or point to what the header says; blocks are as long as stated and nobody else uses them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_blend(
    tree_count: u32,
    trees: *const *const Tree,
    weight: *const f64,
    memory: *mut c_void,
    bytes: usize,
    scratch: *mut c_void,
    scratch_bytes: usize,
    tree: *mut *const Tree,
    info: *mut TreeInfo,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let (trees, count) = terms(tree_count, trees)?;
        let weights = slice(weight, count, 3)?;
        require_all(weights, 3, |weight| (0.0..=f64::MAX).contains(weight))?;
        let results = Results::new((tree, 8), (info, 9))?;
        let scratch = block_mut(scratch, scratch_bytes, scratch_bytes, 6)?;
        let block = room_mut(memory, bytes, usize::MAX, 4)?;
        let built = add_in(trees.get(..count).unwrap_or(&[]), weights, block, scratch);
        results.publish(memory, built.map_err(failure)?.info())
    })
}

/// Trees that are added up, and how many they are.
///
/// # Safety
/// The pointer is null or points to `count` handles, which are null or point to trees of this version.
unsafe fn terms<'a>(count: u32, trees: *const *const Tree) -> Checked<([Stored<'a>; WIS_MAX_BLEND], usize)> {
    require((1..=WIS_MAX_BLEND as u32).contains(&count), Status::InvalidArgument, 1)?;
    // SAFETY: the caller's contract.
    unsafe {
        let handles = slice(trees, count as usize, 2)?;
        let read = |k: usize, handle| view(handle, 2).map_err(|at| at.in_row(2, k));
        let first = read(0, handles.first().copied().unwrap_or(null()))?;
        let mut terms = [first; WIS_MAX_BLEND];
        for ((k, &handle), term) in handles.iter().enumerate().zip(&mut terms) {
            *term = read(k, handle)?;
            if term.tree.axes() != first.tree.axes() {
                return Err(Failure::new(Status::InvalidArgument, 2).in_row(2, k));
            }
        }
        Ok((terms, handles.len()))
    }
}
