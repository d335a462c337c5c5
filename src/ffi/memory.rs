//! The client's memory: arrays; and objects that say in a header how long they are, to write, to open, and behind a handle. Blocks in
//! which threads work together are [`crate::blob::Shared`].

use super::{Checked, WIS_ALIGNMENT, borrow, pointer};
use crate::blob::{Magic, check_block};
use crate::status::{Error, Status};
use core::ffi::c_void;
use core::slice as parts;

/// Borrows `count` elements to write.
///
/// # Safety
/// `start` is null or points to `count` elements that nobody else uses meanwhile.
pub(crate) unsafe fn slice_mut<'a, T>(start: *mut T, count: usize, argument: u32) -> Checked<&'a mut [T]> {
    // Where nothing is read, any pointer does.
    if count == 0 && pointer(start, argument).is_err() {
        return Ok(&mut []);
    }
    pointer(start, argument)?;
    check_bytes::<T>(count, argument)?;
    // SAFETY: not null, aligned, of a length that an object can have; the rest is the caller's contract.
    Ok(unsafe { parts::from_raw_parts_mut(start, count) })
}

/// Borrows `count` elements to read.
///
/// # Safety
/// `start` is null or points to `count` elements that nobody writes meanwhile.
pub(crate) unsafe fn slice<'a, T>(start: *const T, count: usize, argument: u32) -> Checked<&'a [T]> {
    pointer(start, argument)?;
    check_bytes::<T>(count, argument)?;
    // SAFETY: not null, aligned, of a length that an object can have; the rest is the caller's contract.
    Ok(unsafe { parts::from_raw_parts(start, count) })
}

fn check_bytes<T>(count: usize, argument: u32) -> Checked<()> {
    match count.checked_mul(size_of::<T>()) {
        Some(bytes) if bytes <= isize::MAX as usize => Ok(()),
        _ => Err(Error::new(Status::Overflow, argument)),
    }
}

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

/// The bytes of an object in a block, which is this argument and the next, from what it begins with: its length is told by its header.
/// `none`: the status of bytes that hold no such object. The magic number comes first, because another version may be shorter.
///
/// # Safety
/// The block is null or as long as stated, and nobody writes it meanwhile.
pub(crate) unsafe fn stored_or<'a, H: Magic>(
    none: Status,
    start: *const c_void,
    bytes: usize,
    argument: u32,
    length: impl FnOnce(&H) -> Option<usize>,
) -> Checked<&'a [u8]> {
    check_block(start.cast(), bytes, 0, argument)?;
    // SAFETY: not null, aligned and long enough, by the checks and this function's contract.
    if bytes >= size_of::<u64>() && unsafe { start.cast::<u64>().read() } != H::MAGIC {
        return Err(Error::new(none, argument).of(c"magic"));
    }
    check_block(start.cast(), bytes, size_of::<H>(), argument)?;
    // SAFETY: not null, aligned and long enough, by the check and this function's contract.
    let length = length(unsafe { &*start.cast::<H>() }).ok_or(Error::new(none, argument))?;
    check_block(start.cast(), bytes, length, argument)?;
    // SAFETY: as above.
    Ok(unsafe { parts::from_raw_parts(start.cast(), length) })
}

/// What an object begins with that a handle points to.
///
/// # Safety
/// The handle is null or points to an object; one of another kind has a header, too.
#[inline(always)]
pub(crate) unsafe fn header<'a, H>(start: *const u8, argument: u32) -> Checked<&'a H> {
    // SAFETY: the caller's contract.
    let header = unsafe { borrow(start.cast::<H>(), argument)? };
    if start.addr() % WIS_ALIGNMENT == 0 { Ok(header) } else { Err(Error::new(Status::Misaligned, argument)) }
}

/// The bytes of the object that a handle points to.
///
/// # Safety
/// The handle is null or points to an object that this version built or opened.
#[inline(always)]
pub(crate) unsafe fn handle<'a, H>(
    start: *const u8,
    length: impl FnOnce(&H) -> Option<usize>,
    argument: u32,
) -> Checked<&'a [u8]> {
    // SAFETY: the caller's contract.
    let length = length(unsafe { header(start, argument)? }).ok_or(Error::new(Status::Mismatch, argument))?;
    // SAFETY: an object of this version is as long as its header says.
    Ok(unsafe { parts::from_raw_parts(start, length) })
}
