//! The boundary of `wis_wavelets.h`.

pub mod table;
pub mod tree;
pub mod triple;
pub mod visibility;

use crate::ffi::{Checked, require_none, slice};

/// A list of wavelets, of which `disorder` finds the first that is out of order.
///
/// # Safety
/// The pointer is null or points to `count` elements.
unsafe fn ordered<'a, W>(
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
