//! Memory of objects that say in a header how long they are: to write them, to open them, and behind a handle.

use crate::ffi::{Checked, Failure, WIS_ALIGNMENT, borrow, check_block, slice_mut};
use crate::status::Status;
use bytemuck::Pod;
use core::ffi::c_void;

/// The first bytes of a block, to write.
///
/// # Safety
/// The block is null or as long as stated, and nobody else uses it meanwhile.
pub(crate) unsafe fn block_mut<'a>(
    start: *mut c_void,
    bytes: usize,
    needed: usize,
    argument: u32,
) -> Checked<&'a mut [u8]> {
    check_block(start.cast(), bytes, needed, argument)?;
    // SAFETY: as long as that, by the check and this function's contract.
    unsafe { slice_mut(start.cast(), needed, argument) }
}

/// The bytes of an object in a block, which are arguments 1 and 2, from what it begins with: its length is told by its header.
///
/// # Safety
/// The block is null or as long as stated, and nobody writes it meanwhile.
pub(crate) unsafe fn stored<'a, H: Pod>(
    start: *const c_void,
    bytes: usize,
    length: impl FnOnce(&H) -> Option<usize>,
) -> Checked<&'a [u8]> {
    check_block(start.cast(), bytes, size_of::<H>(), 1)?;
    // SAFETY: not null, aligned and long enough, by the check and this function's contract.
    let length = length(unsafe { &*start.cast::<H>() }).ok_or(Failure::new(Status::Corrupt, 1))?;
    check_block(start.cast(), bytes, length, 1)?;
    // SAFETY: as above.
    Ok(unsafe { core::slice::from_raw_parts(start.cast(), length) })
}

/// The bytes of the object that a handle points to.
///
/// # Safety
/// The handle is null or points to an object that this version built or opened.
#[inline(always)]
pub(crate) unsafe fn handle<'a, H: Pod>(
    start: *const u8,
    length: impl FnOnce(&H) -> Option<usize>,
    argument: u32,
) -> Checked<&'a [u8]> {
    // SAFETY: the caller's contract; an object of another kind has a header too.
    let header = unsafe { borrow(start.cast::<H>(), argument)? };
    if start.addr() % WIS_ALIGNMENT != 0 {
        return Err(Failure::new(Status::Misaligned, argument));
    }
    let length = length(header).ok_or(Failure::new(Status::Mismatch, argument))?;
    // SAFETY: an object of this version is as long as its header says.
    Ok(unsafe { core::slice::from_raw_parts(start, length) })
}
