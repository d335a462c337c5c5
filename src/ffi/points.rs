//! Point sets in C.

use super::strided::StridedMut;
use super::{Checked, answer, require};
use crate::points;
use crate::status::Status;
use core::ptr::null_mut;

/// A seed for a pixel in a pass; seeds of neighbours and of passes are decorrelated. Work: constant.
#[unsafe(no_mangle)]
pub extern "C" fn wis_pixel_seed(x: u32, y: u32, pass: u32) -> u32 {
    points::pixel_seed(x, y, pass)
}

/// Points `first` to `first + count - 1` of the Hammersley set of `total` points in the unit square; WIS_INVALID_ARGUMENT if
/// those are more than `total`. No coordinate is exactly 0 or 1. `stride` in bytes from one point to the next; 0: packed.
/// Work: count.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_points_hammersley(
    first: u32,
    count: u32,
    total: u32,
    out: *mut f32,
    stride: usize,
) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        require(first.checked_add(count).is_some_and(|end| end <= total), Status::InvalidArgument, 2)?;
        write_points(first, count as usize, out, stride, |index| points::hammersley(index, total))
    })
}

/// Points `first` to `first + count - 1` (at most 2^32 - 1, else WIS_OVERFLOW) of an Owen-scrambled Sobol
/// (0,2)-sequence: each aligned block of 2^k points has one in every elementary interval of area 2^-k. Sequences of
/// different seeds are independent. No coordinate is exactly 0 or 1. `stride` in bytes from one point to the next; 0:
/// packed. Work: count.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_points_sobol(seed: u32, first: u32, count: usize, out: *mut f32, stride: usize) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        require(count as u64 <= u64::from(u32::MAX - first) + 1, Status::Overflow, 3)?;
        write_points(first, count, out, stride, |index| points::sobol(seed, index))
    })
}

/// # Safety
/// `out` is null or points to `count` elements.
unsafe fn write_points(
    first: u32,
    count: usize,
    out: *mut f32,
    stride: usize,
    point: impl Fn(u32) -> [f32; 2],
) -> Checked<()> {
    let out = StridedMut::<2>::new(out, stride, count, 4)?;
    for index in 0..count {
        // SAFETY: the caller's contract; the index is below the count.
        unsafe { out.write(index, point(first.wrapping_add(index as u32))) };
    }
    Ok(())
}
