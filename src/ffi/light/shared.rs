//! Environments in C beyond the first need: builds that threads share, and turning.

use super::build::Build;
use super::{EnvironmentObject, LightConfig, read_config};
use crate::ffi::memory::stored_or;
use crate::ffi::{Diagnostic, answer, frame, out, slice_mut};
use crate::light::build::PASSES;
use crate::light::environment::{Header, turn};
use crate::status::{Error, Status};
use core::ffi::c_void;

/// Begins a build that threads share. `items` receives the number of items of each of WIS_ENVIRONMENT_PASSES passes. Hand all items of
/// a pass to wis_environment_run, in any portions, on any threads, before those of the next pass; then call wis_environment_finish. The
/// bytes are those of wis_environment_init. Work: rows.
///
/// # Safety
/// Pointers are null or point to what the header says; `items` to WIS_ENVIRONMENT_PASSES numbers; nobody else uses the scratch block.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_begin(
    config: *const LightConfig,
    scratch: *mut c_void,
    scratch_bytes: usize,
    items: *mut [u32; 6],
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let (request, _) = read_config(config)?;
        let target = out(items, 4)?;
        target.write(Build::begin(&request, scratch, scratch_bytes, 2)?.items());
        Ok(())
    })
}

/// Works on `count` items of a pass, from item `first` on. Threads may call this at once for different items. `config`: that of
/// wis_environment_begin. `memory`: used from pass 2 on, null before; the same block in all calls from then on and in
/// wis_environment_finish. If it is too short, the diagnostic tells the bytes that are needed, and pass 2 may be run again.
/// `pass`: 0 to WIS_ENVIRONMENT_PASSES - 1. WIS_MISMATCH if an earlier pass is not done. Work: texels of the items.
///
/// # Safety
/// Pointers are null or point to what the header says; no other thread works on the same items.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_run(
    config: *const LightConfig,
    memory: *mut c_void,
    bytes: usize,
    scratch: *mut c_void,
    scratch_bytes: usize,
    pass: u32,
    first: u32,
    count: u32,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let (request, rows) = read_config(config)?;
        let invalid = |argument| Error::new(Status::InvalidArgument, argument);
        let build = Build::go_on(&request, scratch, scratch_bytes, 4)?;
        let pass = pass as usize;
        let available = build.items().get(pass).copied().ok_or(invalid(6))?;
        let left = available.checked_sub(first).ok_or(invalid(7))?;
        if count > left {
            return Err(invalid(8));
        }
        build.require_before(pass)?;
        build.run(&|y| rows.row(y), (memory, bytes), pass, first..first + count)
    })
}

/// Ends a build whose passes are done (WIS_MISMATCH before). `memory`: that of pass 2. `environment` receives the handle. Work: texels.
///
/// # Safety
/// As wis_environment_init; no thread is still at work on the build.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_finish(
    config: *const LightConfig,
    memory: *mut c_void,
    bytes: usize,
    scratch: *mut c_void,
    scratch_bytes: usize,
    environment: *mut *const EnvironmentObject,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let (request, _) = read_config(config)?;
        let handle = out(environment, 6)?;
        let build = Build::go_on(&request, scratch, scratch_bytes, 4)?;
        build.require_before(PASSES)?;
        build.finish(memory, bytes)?;
        handle.write(memory.cast_const().cast());
        Ok(())
    })
}

/// Turns an environment in place; nothing is rebuilt. `memory`: the environment, which no other thread may use meanwhile.
/// `world_from_map`: replaces the former one; a row-major 3x3 rotation or reflection, world = M map, within 1e-4; null is the
/// identity. `environment` receives the handle. The content id changes: earlier products answer WIS_MISMATCH. A call that fails changes nothing. Costs less than 0.1 us. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says; nobody else uses the memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_environment_turn(
    memory: *mut c_void,
    bytes: usize,
    world_from_map: *const [f32; 9],
    environment: *mut *const EnvironmentObject,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let handle = out(environment, 4)?;
        let frame = frame(world_from_map, 3)?;
        let length = stored_or(Status::Mismatch, memory, bytes, 1, Header::length)?.len();
        turn(slice_mut(memory.cast::<u8>(), length, 1)?, &frame);
        handle.write(memory.cast_const().cast());
        Ok(())
    })
}
