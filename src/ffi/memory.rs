//! Memory of objects that say in a header how long they are: to write them, to open them, and behind a handle.

use super::{Checked, Failure, WIS_ALIGNMENT, borrow, check_block, check_bytes, out, sized};
use crate::status::Status;
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
    check_bytes::<u8>(needed, argument)?;
    // SAFETY: aligned, also if nothing is needed, and as long as that, by the checks and this function's contract.
    Ok(unsafe { core::slice::from_raw_parts_mut(start.cast(), needed) })
}

/// A whole block, to write what turns out how long it is: at most so many bytes.
///
/// # Safety
/// As [`block_mut`].
pub(crate) unsafe fn room_mut<'a>(
    start: *mut c_void,
    bytes: usize,
    most: usize,
    argument: u32,
) -> Checked<&'a mut [u8]> {
    // SAFETY: the caller's contract.
    unsafe { block_mut(start, bytes, bytes.min(most).min(isize::MAX as usize), argument) }
}

/// The bytes of an object in a block, which are arguments 1 and 2, from what it begins with: its length is told by its header.
///
/// # Safety
/// The block is null or as long as stated, and nobody writes it meanwhile.
pub(crate) unsafe fn stored<'a, H>(
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
pub(crate) unsafe fn handle<'a, H>(
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

/// Where a build or an opening puts its results: the handle, and, if it is not null, what was built.
pub(crate) struct Results<H, I> {
    handle: *mut *const H,
    info: *mut I,
}

impl<H, I> Results<H, I> {
    /// Checks the pointers, each with its argument.
    ///
    /// # Safety
    /// They are null or point to what the header says.
    pub(crate) unsafe fn new((handle, at): (*mut *const H, u32), (info, info_at): (*mut I, u32)) -> Checked<Self> {
        out(handle, at)?;
        if !info.is_null() {
            // SAFETY: the caller's contract.
            unsafe { sized(info.cast_const(), info_at)? };
        }
        Ok(Results { handle, info })
    }

    /// Writes the results of an object that begins at `memory`.
    ///
    /// # Safety
    /// The pointers are still valid.
    pub(crate) unsafe fn publish(self, memory: *const c_void, info: I) -> Checked<()> {
        // SAFETY: checked before; info may be null.
        unsafe {
            self.handle.write(memory.cast());
            if !self.info.is_null() {
                self.info.write(info);
            }
        }
        Ok(())
    }
}
