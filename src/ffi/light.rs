//! The environment in C.

mod build;
mod config;
mod shared;

pub use config::*;
pub use shared::*;

use super::memory::{handle, stored_or};
use super::{Checked, Diagnostic, MemorySize, answer, frame, out, put, put_size, sized};
use crate::light::environment::{Environment, Header};
#[cfg(feature = "products")]
use crate::light::tables::Light;
use crate::status::{Error, Status};
use build::Build;
use core::ffi::c_void;
#[cfg(feature = "products")]
use core::mem::MaybeUninit;
use core::ptr::null_mut;

/// An environment map as a distribution of directions: bytes in your memory without pointers, so it may be copied (to any block
/// aligned to WIS_ALIGNMENT), saved and mapped. Constant once built, but for wis_environment_turn; any number of threads may
/// use it at once.
#[allow(missing_debug_implementations)]
pub struct EnvironmentObject {
    _opaque: [u8; 0],
}

/// The environment behind a pointer.
///
/// # Safety
/// The pointer is null or points to an environment that this version built or opened, or to memory as long as its header;
/// nobody writes it while the result lives.
#[inline(always)]
pub(super) unsafe fn environment<'a>(pointer: *const EnvironmentObject, argument: u32) -> Checked<Environment<'a>> {
    // SAFETY: the caller's contract.
    let bytes = unsafe { handle(pointer.cast(), Header::length, argument)? };
    Environment::view(bytes).ok_or(Error::new(Status::Mismatch, argument))
}

/// The exact tables of the environment that a sampler read last, with its bytes and its content id; the bytes are null if there are none.
#[cfg(feature = "products")]
#[repr(C)]
pub(super) struct Tables {
    bytes: *const [u8],
    content_id: u64,
    light: MaybeUninit<Light<'static>>,
}

/// The exact tables of an environment. Cutting them takes a tenth of a call for one direction, so a sampler keeps them: what has the same
/// bytes and content id has the same parts. What only shares the content id on purpose has them inside its bytes.
///
/// # Safety
/// The environment lives for as long as the result is used.
#[cfg(feature = "products")]
#[inline(always)]
pub(super) unsafe fn tables<'a>(kept: &'a mut Tables, environment: &Environment<'static>) -> &'a Light<'a> {
    let (bytes, id) = (core::ptr::from_ref(environment.as_bytes()), environment.header().content_id);
    if !core::ptr::eq(kept.bytes, bytes) || kept.content_id != id {
        kept.light.write(environment.tables());
        (kept.bytes, kept.content_id) = (bytes, id);
    }
    // SAFETY: it was written with the bytes, which are those of an object.
    unsafe { kept.light.assume_init_ref() }
}

/// As [`environment`]; it has the exact tables.
///
/// # Safety
/// As [`environment`].
#[cfg(any(feature = "products", feature = "checks"))]
#[inline(always)]
pub(super) unsafe fn exact<'a>(pointer: *const EnvironmentObject, argument: u32) -> Checked<Environment<'a>> {
    // SAFETY: the caller's contract.
    let environment = unsafe { environment(pointer, argument)? };
    let built = environment.exact().map(|_| environment);
    built.map_err(|status| Error::new(status, argument).of(c"flags"))
}

/// Measures the memory of a build: bytes of the environment, at most, and bytes of scratch memory. What was built says how many of them
/// it uses. A map of 1024 x 512 needs 4.5 MB (WIS_FILTER_NEAREST: 3.3 MB), of which 3.5 to 4.5 are used, and 2.4 MB of scratch. Reads no pixels.
/// Costs 15 us. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_size(
    config: *const LightConfig,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let (request, _) = read_config(config)?;
        put_size(size, 2, request.plan.size().map_err(|status| Error::new(status, 1)))
    })
}

/// Builds an environment on one thread. `memory`: where the environment goes; a multiple of 64 as its address makes look-ups
/// from cold caches cheaper. `scratch`: may be freed afterwards. `environment` receives the handle, which is the address of
/// `memory`. WIS_INVALID_TEXEL: the diagnostic names column and row. WIS_MEMORY_TOO_SMALL: the diagnostic tells the bytes that
/// are needed; an error budget needs fewer than wis_environment_size says. A map of 1024 x 512 RGB floats costs 15 to 90 ms,
/// a budget 0.2 to 0.4 s more. Work: texels.
///
/// # Safety
/// Pointers are null or point to what the header says; blocks are as long as stated and nobody else uses them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_init(
    config: *const LightConfig,
    memory: *mut c_void,
    bytes: usize,
    scratch: *mut c_void,
    scratch_bytes: usize,
    environment: *mut *const EnvironmentObject,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract; this call does all passes, one after the other.
    answer(diagnostic, || unsafe {
        let (request, rows) = read_config(config)?;
        // How long the block must be is known only when grids are chosen.
        super::check_block(memory.cast(), bytes, 0, 2)?;
        let handle = out(environment, 6)?;
        Build::begin(&request, scratch, scratch_bytes, 4)?.run_all(&|y| rows.row(y), memory, bytes)?;
        handle.write(memory.cast_const().cast());
        Ok(())
    })
}

/// Opens bytes that an earlier build wrote: copied, or mapped from a file. `bytes`: as many as wis_environment_info says, or more.
/// `environment` receives the handle, which is the address of `memory`. WIS_CORRUPT if a byte was changed; with the field `magic` in
/// the diagnostic if another version of wis wrote them. Reads all bytes once: 1 ms for a map of 1024 x 512. Work: bytes.
///
/// # Safety
/// Pointers are null or point to what the header says; the bytes do not change while the environment is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_open(
    memory: *const c_void,
    bytes: usize,
    environment: *mut *const EnvironmentObject,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let handle = out(environment, 3)?;
        let opened = Environment::open(stored_or(Status::Corrupt, memory, bytes, 1, Header::length)?);
        opened.map_err(|status| Error::new(status, 1))?;
        handle.write(memory.cast());
        Ok(())
    })
}

/// Describes an environment. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_describe(
    environment: *const EnvironmentObject,
    info: *mut LightInfo,
) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let environment = self::environment(environment, 1)?;
        sized(info.cast_const(), 2)?;
        put(info, 2, Ok(LightInfo::of(&environment)))
    })
}

/// Checks a configuration, which is argument 1.
///
/// # Safety
/// The pointer is null or points to what the header says.
pub(in crate::ffi) unsafe fn read_config<'a>(config: *const LightConfig) -> Checked<(Request, PixelRows<'a>)> {
    // SAFETY: the caller's contract.
    let c = unsafe { sized(config, 1)? };
    let mut request = Request::new(c).map_err(|error| error.instead(1))?;
    let rows = PixelRows::new(c, &request)?;
    // SAFETY: the caller's contract: null or nine floats.
    request.frame = unsafe { frame(c.world_from_map.cast(), 1) }.map_err(|at| at.of(c"world_from_map"))?;
    Ok((request, rows))
}
