//! The Haar transform in C.

use crate::ffi::wavelets::check_grid;
use crate::ffi::{Checked, Diagnostic, Failure, answer, require, slice_mut};
use crate::status::Status;
use crate::wavelets::{haar, morton};

/// Replaces an image by its orthonormal non-standard Haar coefficients, in place. `values`: `count` = 2^(n depth)
/// numbers, C order (axis 1 slowest), at most 1e290 in size; `dimensions` n = 1 to 4, `depth` at most 12. The
/// coefficient of level l, translation t and wavelet f = (f1 .. fn) replaces the pixel at coordinates (2 t_q + f_q)
/// 2^(depth - 1 - l), the scaling coefficient the pixel at the origin. WIS_INVALID_ARGUMENT for anything out of these
/// ranges. Work: count.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_haar_forward(
    dimensions: u32,
    depth: u32,
    count: usize,
    values: *mut f64,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        haar::forward_any(dimensions, depth, grid(dimensions, depth, count, values)?).map_err(Failure::from)
    })
}

/// Replaces the coefficients of wis_haar_forward by the image, in place, with the same arguments and statuses. Work: count.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_haar_inverse(
    dimensions: u32,
    depth: u32,
    count: usize,
    values: *mut f64,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        haar::inverse_any(dimensions, depth, grid(dimensions, depth, count, values)?).map_err(Failure::from)
    })
}

/// The largest number that is transformed.
const LARGEST: f64 = 1e290;

/// The numbers of a grid.
///
/// # Safety
/// `values` is null or points to `count` elements.
unsafe fn grid<'a>(dimensions: u32, depth: u32, count: usize, values: *mut f64) -> Checked<&'a mut [f64]> {
    check_grid(dimensions, depth)?;
    require(morton::cells(dimensions, depth) == Some(count), Status::InvalidArgument, 3)?;
    // SAFETY: the caller's contract.
    let values = unsafe { slice_mut(values, count, 4)? };
    // Sums over all levels, of coefficients of up to 2^22 in value space, stay finite.
    match values.iter().position(|value| !(-LARGEST..=LARGEST).contains(value)) {
        Some(wrong) => Err(Failure::new(Status::InvalidArgument, 4).in_row(4, wrong)),
        None => Ok(values),
    }
}
