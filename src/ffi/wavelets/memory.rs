//! Blocks in which trees and environments are built and opened, and where their handles go.

use crate::ffi::memory::block_mut;
use crate::ffi::{Checked, out, require_none, sized, slice};
use core::ffi::c_void;

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

/// A list of wavelets, of which `disorder` finds the first that is out of order.
///
/// # Safety
/// The pointer is null or points to `count` elements.
pub(crate) unsafe fn ordered<'a, W>(
    pointer: *const W,
    count: u32,
    argument: u32,
    disorder: impl FnOnce(&[W]) -> Option<usize>,
) -> Checked<&'a [W]> {
    // Where nothing is read, any pointer does.
    if count == 0 {
        return Ok(&[]);
    }
    // SAFETY: the caller's contract.
    let list = unsafe { slice(pointer, count as usize, argument)? };
    require_none(disorder(list), argument).map(|()| list)
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
