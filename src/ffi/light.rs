//! The environment in C.

use super::{Checked, Failure, WIS_ALIGNMENT, borrow};
use crate::light::environment::{Environment, Header};
use crate::status::Status;

/// An environment map as a distribution of directions. It stands in your memory and holds no pointers: it may be copied (to any
/// block aligned to WIS_ALIGNMENT), saved and mapped. Constant once built, but for wis_environment_turn; any number of threads
/// may use it at once. Nothing to free.
#[allow(missing_debug_implementations)]
pub struct EnvironmentObject {
    _opaque: [u8; 0],
}

/// The environment behind a pointer.
///
/// # Safety
/// The pointer is null or points to an environment that this version built or opened, or to the first bytes of another object
/// as long as its header; nobody writes it while the result lives.
#[inline(always)]
pub(super) unsafe fn environment<'a>(pointer: *const EnvironmentObject, argument: u32) -> Checked<Environment<'a>> {
    // SAFETY: the caller's contract.
    let header = unsafe { borrow(pointer.cast::<Header>(), argument)? };
    if pointer.addr() % WIS_ALIGNMENT != 0 {
        return Err(Failure::new(Status::Misaligned, argument));
    }
    let mismatch = Failure::new(Status::Mismatch, argument);
    let bytes = header.length().ok_or(mismatch)?;
    // SAFETY: an environment of this version is as long as its header says.
    let bytes = unsafe { core::slice::from_raw_parts(pointer.cast::<u8>(), bytes) };
    Environment::view(bytes).ok_or(mismatch)
}
