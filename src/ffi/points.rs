//! Point sets in C.

use super::strided::StridedMut;
use super::{answer, require};
use crate::points;
use crate::status::Status;
use core::ptr::null_mut;

/// Points `first` to `first + count - 1` (at most 2^32 - 1, else WIS_OVERFLOW) of an Owen-scrambled Sobol
/// (0,2)-sequence: each aligned block of 2^k points has one in every elementary interval of area 2^-k. Sequences of
/// different seeds are independent, also of numbers in a row: any that tells pixels and passes apart. No coordinate is exactly 0 or 1.
/// `stride` in bytes from one point to the next; 0: packed. Work: count.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_points_sobol(seed: u32, first: u32, count: usize, out: *mut f32, stride: usize) -> Status {
    // SAFETY: the caller's contract; indices are below the count.
    answer(null_mut(), || unsafe {
        require(count as u64 <= u64::from(u32::MAX - first) + 1, Status::Overflow, 3)?;
        let out = StridedMut::<2>::new(out, stride, count, 4)?;
        (0..count).for_each(|index| out.write(index, points::sobol(seed, first.wrapping_add(index as u32))));
        Ok(())
    })
}
