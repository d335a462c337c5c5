//! The C boundary: checks, casts and forwards. With the vector module and `blob` it is the only place with `unsafe`.
//!
//! Every pointer that comes in is checked for null and alignment, every size and selector for its range; what
//! cannot be checked (that a block is as long as the caller says) is the contract that the header states.

#[cfg(feature = "checks")]
pub mod check;
pub mod direct;
pub mod light;
#[cfg(feature = "lights")]
pub mod lights;
pub mod material;
mod memory;
pub mod points;
#[cfg(feature = "products")]
pub mod product;
pub mod sampler;
#[cfg(feature = "products")]
pub mod sampling;
// Without products nothing is sampled in batches.
#[cfg_attr(not(feature = "products"), allow(dead_code))]
mod strided;
pub mod visibility;
pub mod wave;
#[cfg(feature = "wavelets")]
pub mod wavelets;

mod control;

use crate::blob::Size;
pub(crate) use crate::blob::check_block;
use crate::status::{Error, Status};
use control::FloatControl;
use core::ffi::{CStr, c_char};
pub(crate) use memory::{slice, slice_mut};

/// The version of the library and of every stored object: major * 65536 + minor * 256 + patch.
pub const WIS_VERSION: u32 = 0x000300;
/// The alignment of every block of memory, in bytes: that of malloc on 64-bit platforms.
pub const WIS_ALIGNMENT: usize = 16;

/// How much memory an object needs. Both blocks are yours: allocate them as you like.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct MemorySize {
    /// Bytes of the object.
    pub bytes: usize,
    /// Alignment of both blocks, in bytes.
    pub align: usize,
    /// Bytes that only the build needs; may be freed afterwards. 0: none.
    pub scratch_bytes: usize,
}

/// Where the fault is. Written only if a call fails, and only if you give one.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Diagnostic {
    /// The position of the argument at fault, 1 = first; 0: none in particular.
    pub argument: u32,
    /// WIS_INVALID_TEXEL: the column of the texel, 0 = first. Array of arrays: the number of the element in the inner one.
    pub x: u32,
    /// The row of the texel, or the number of the element at fault in an array, 0 = first. 0 where the argument is neither.
    pub y: u32,
    /// Always 0.
    pub reserved: u32,
    /// WIS_MEMORY_TOO_SMALL: the bytes that are needed.
    pub bytes_needed: u64,
    /// The field at fault, as `normal`: a static string, or null. `magic`: stored bytes are of another version.
    pub field: *const c_char,
}

impl Default for Diagnostic {
    fn default() -> Diagnostic {
        Diagnostic { argument: 0, x: 0, y: 0, reserved: 0, bytes_needed: 0, field: core::ptr::null() }
    }
}

impl From<Error> for Diagnostic {
    fn from(Error { argument, field, x, y, bytes, .. }: Error) -> Diagnostic {
        let field = field.map_or(core::ptr::null(), CStr::as_ptr);
        Diagnostic { argument, x, y, reserved: 0, bytes_needed: bytes as u64, field }
    }
}

/// A sentence for a log; a static string, also for a value that is not a status. Work: constant.
#[unsafe(no_mangle)]
pub extern "C" fn wis_status_string(status: u32) -> *const c_char {
    let text: &CStr = Status::from_code(status).map_or(c"unknown status", Status::message);
    text.as_ptr()
}

/// WIS_VERSION of the library that is linked. Work: constant.
#[unsafe(no_mangle)]
pub extern "C" fn wis_version() -> u32 {
    WIS_VERSION
}

pub(crate) type Checked<T> = core::result::Result<T, Error>;

/// Runs the body of an entry point that computes: under the default floating-point control word, with its failure
/// written to the caller's diagnostic, if any.
#[inline(always)]
pub(crate) fn answer(diagnostic: *mut Diagnostic, body: impl FnOnce() -> Checked<()>) -> Status {
    if !diagnostic.is_null() && !diagnostic.is_aligned() {
        return Status::Misaligned;
    }
    let control = FloatControl::set_default();
    let result = body();
    drop(control);
    match result {
        Ok(()) => Status::Ok,
        Err(error) => {
            if !diagnostic.is_null() {
                // SAFETY: not null, and checked to be aligned; the caller gives a diagnostic or null.
                unsafe { diagnostic.write(error.into()) };
            }
            error.status
        }
    }
}

/// Checks that an argument is what it must be.
pub(crate) fn require(holds: bool, status: Status, argument: u32) -> Checked<()> {
    if holds { Ok(()) } else { Err(Error::new(status, argument)) }
}

/// Checks that each element of the array that an argument points to is in its range.
#[cfg(any(feature = "lights", feature = "wavelets"))]
pub(crate) fn require_all<T>(elements: &[T], argument: u32, holds: impl Fn(&T) -> bool) -> Checked<()> {
    require_none(elements.iter().position(|element| !holds(element)), argument)
}

/// Refuses the element at fault, if there is one, of the array that an argument points to.
#[cfg(any(feature = "lights", feature = "wavelets"))]
pub(crate) fn require_none(at_fault: Option<usize>, argument: u32) -> Checked<()> {
    let refuse = |row| Err(Error::new(Status::InvalidArgument, argument).in_row(row));
    at_fault.map_or(Ok(()), refuse)
}

/// Checks a pointer that must not be null.
#[inline(always)]
pub(crate) fn pointer<T>(pointer: *const T, argument: u32) -> Checked<*const T> {
    if pointer.is_null() {
        Err(Error::new(Status::NullPointer, argument))
    } else if !pointer.is_aligned() {
        Err(Error::new(Status::Misaligned, argument))
    } else {
        Ok(pointer)
    }
}

/// Checks a pointer to a result.
#[inline(always)]
pub(crate) fn out<T>(target: *mut T, argument: u32) -> Checked<*mut T> {
    pointer(target, argument).map(|_| target)
}

/// Writes a result, if there is one; the pointer to it is checked first.
///
/// # Safety
/// The pointer is null or points to what the header says.
#[inline(always)]
pub(crate) unsafe fn put<T>(target: *mut T, argument: u32, value: Checked<T>) -> Checked<()> {
    let target = out(target, argument)?;
    // SAFETY: not null and aligned; the rest is the caller's contract.
    unsafe { target.write(value?) };
    Ok(())
}

/// Answers a size query.
///
/// # Safety
/// As [`put`].
pub(crate) unsafe fn put_size(target: *mut MemorySize, argument: u32, needed: Checked<Size>) -> Checked<()> {
    let needed =
        needed.map(|Size { bytes, scratch }| MemorySize { bytes, align: WIS_ALIGNMENT, scratch_bytes: scratch });
    // SAFETY: the caller's contract.
    unsafe { put(target, argument, needed) }
}

/// Borrows what a pointer points to.
///
/// # Safety
/// If not null and aligned, the pointer is valid for reads of a `T` for as long as the result is used.
#[inline(always)]
pub(crate) unsafe fn borrow<'a, T>(source: *const T, argument: u32) -> Checked<&'a T> {
    let source = pointer(source, argument)?;
    // SAFETY: not null, aligned, and valid by this function's contract.
    Ok(unsafe { &*source })
}

/// Borrows a struct that begins with its size.
///
/// # Safety
/// As [`borrow`], but if the first field is another size only that field need be readable.
pub(crate) unsafe fn sized<'a, T>(source: *const T, argument: u32) -> Checked<&'a T> {
    let source = pointer(source, argument)?;
    // SAFETY: not null, aligned for T and so for its first field, which is a u32 in each of these structs.
    let size = unsafe { source.cast::<u32>().read() };
    if size as usize != size_of::<T>() {
        return Err(Error::new(Status::InvalidStructSize, argument).of(c"size"));
    }
    // SAFETY: the caller states that the struct is this long.
    Ok(unsafe { &*source })
}

/// The orthonormal frame of a row-major 3x3 `world_from_map`; null is the identity.
///
/// # Safety
/// The pointer is null or valid for reads of nine floats.
pub(crate) unsafe fn frame(world_from_map: *const [f32; 9], argument: u32) -> Checked<crate::sphere::Frame> {
    if world_from_map.is_null() {
        return Ok(crate::sphere::Frame::IDENTITY);
    }
    // SAFETY: not null; the caller states that nine floats follow.
    let rows = unsafe { borrow(world_from_map, argument)? };
    crate::sphere::Frame::new(rows).ok_or(Error::new(Status::InvalidTransform, argument))
}
