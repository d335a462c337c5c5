//! Environments as wavelet trees in C: size, build, open.

mod request;

pub use crate::ffi::light::{
    RowFn, WIS_FORMAT_F16, WIS_FORMAT_F32, WIS_LAYOUT_CUBE, WIS_LAYOUT_LATLONG, WIS_LAYOUT_OCTAHEDRAL,
};
pub use crate::wavelets::environment::{
    WIS_STORAGE_PYRAMID, WIS_STORAGE_SPARSE, WIS_WAVELET_LIGHT_EXACT_ZERO, WIS_WAVELET_LIGHT_NEAREST,
    WIS_WAVELET_LIGHT_RGB, WIS_WAVELET_LIGHT_SANITISE,
};

use crate::ffi::memory::{block_mut, handle, stored};
use crate::ffi::{Checked, Diagnostic, Failure, MemorySize, WIS_ALIGNMENT, answer, out, sized};
use crate::light::environment::BuildError;
use crate::status::Status;
use crate::wavelets::environment as kernel;
use crate::wavelets::environment::Header;
use core::ffi::c_void;
use request::{read_config, row_failure};

/// An environment: bytes in your memory without pointers, so it may be copied (to any block aligned to
/// WIS_ALIGNMENT), saved and mapped. Constant once built; any number of threads may use it at once. Nothing to free.
#[allow(missing_debug_implementations)]
pub struct Environment {
    _opaque: [u8; 0],
}

/// What to build.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct EnvironmentConfig {
    /// sizeof(wis_wavelet_light_config).
    pub size: u32,
    /// WIS_LAYOUT_*.
    pub layout: u32,
    /// Texels in a row, at least 1; any number, also odd.
    pub width: u32,
    /// Rows, at least 1; of a cube map all six faces.
    pub height: u32,
    /// 1 (luminance), 3 (RGB) or 4 (RGB and an alpha that is ignored); linear Rec. 709 radiance.
    pub channels: u32,
    /// WIS_FORMAT_*.
    pub format: u32,
    /// WIS_WAVELET_LIGHT_*, or 0.
    pub flags: u32,
    /// WIS_STORAGE_*.
    pub storage: u32,
    /// Cells along each side of the octahedral square, a power of two from 1 to 4096; 0: at least as many cells
    /// as texels, and of a pyramid for clients without filter finer ones where light varies within them.
    pub resolution: u32,
    /// Sparse storage: the variance that pruning may add to an estimate of the map's power, relative to its square,
    /// 0 or more (0.01 = 1 %); 0 drops nothing but constant squares.
    pub error_budget: f32,
    /// The first texel of row 0, or null if `row` gives the rows. Aligned to its format, 4 or 2 bytes; the rows of `row` need
    /// no alignment.
    pub pixels: *const c_void,
    /// Bytes from a row to the next, may be negative: a multiple of the bytes of a channel, at least a row. 0: rows stand
    /// close together.
    pub row_stride: isize,
    /// Used if `pixels` is null.
    pub row: RowFn,
    /// Handed to `row`.
    pub row_user: *mut c_void,
}

/// What was built.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct EnvironmentInfo {
    /// sizeof(wis_wavelet_light_info), set by the caller.
    pub size: u32,
    /// Cells along each side of the square.
    pub resolution: u32,
    /// WIS_STORAGE_*.
    pub storage: u32,
    /// WIS_WAVELET_LIGHT_*.
    pub flags: u32,
    /// Bytes of the environment: that much of the block is in use and needs to be saved.
    pub bytes: u64,
    /// Squares stored, each the averages of four children.
    pub squares: u64,
    /// Texels that were replaced.
    pub sanitised: u64,
    /// Tells environments apart: a hash of the bytes.
    pub content_id: u64,
    /// The integral of luminance over the sphere, in the units of the map times steradian.
    pub power: f64,
    /// Sparse storage: the variance that pruning added, relative.
    pub error: f64,
}

/// Measures the memory of a build: exactly for a pyramid of a stated resolution, at most for sparse storage and for a
/// pyramid whose cells may be divided further. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_light_size(
    config: *const EnvironmentConfig,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        let (config, _) = unsafe { read_config(config)? };
        let target = out(size, 2)?;
        let size = config.size().map_err(|status| Failure::new(status, 1))?;
        // SAFETY: checked by `out`.
        unsafe { target.write(MemorySize { bytes: size.bytes, align: WIS_ALIGNMENT, scratch_bytes: size.scratch }) };
        Ok(())
    })
}

/// Builds an environment. `info`, which may be null, tells the bytes in use. WIS_INVALID_TEXEL: the diagnostic names column
/// and row. WIS_MEMORY_TOO_SMALL: the diagnostic tells the bytes that are needed. A map of 1024 x 512 costs about 0.3 s.
/// Work: texels + cells.
///
/// # Safety
/// Pointers are null or point to what the header says; blocks are as long as stated and nobody else uses them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_light_init(
    config: *const EnvironmentConfig,
    memory: *mut c_void,
    bytes: usize,
    scratch: *mut c_void,
    scratch_bytes: usize,
    environment: *mut *const Environment,
    info: *mut EnvironmentInfo,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let (config, rows) = read_config(config)?;
            check_results((environment, 6), (info, 7))?;
            let size = config.size().map_err(|status| Failure::new(status, 1))?;
            let work = block_mut(scratch, scratch_bytes, size.scratch, 4)?;
            // How many bytes a sparse tree needs is known only at the end.
            let target = block_mut(memory, bytes, bytes.min(size.bytes), 2)?;
            let built = kernel::Environment::build_in(&config, &rows, target, work).map_err(|error| match error {
                BuildError::Row(y, error) => row_failure(y, error),
                BuildError::TooSmall(needed) => Failure::too_small(2, needed),
                BuildError::Status(status) => Failure::new(status, 1),
            })?;
            publish(built.header, memory.cast_const(), environment, info);
        }
        Ok(())
    })
}

/// Opens bytes that an earlier build wrote: copied, or mapped from a file. WIS_CORRUPT if a byte was changed. `info` may be
/// null. Reads all bytes once. Work: bytes.
///
/// # Safety
/// Pointers are null or point to what the header says; the bytes do not change while the environment is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_light_open(
    memory: *const c_void,
    bytes: usize,
    environment: *mut *const Environment,
    info: *mut EnvironmentInfo,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            check_results((environment, 3), (info, 4))?;
            let bytes = stored(memory, bytes, Header::checked_length)?;
            let opened = kernel::Environment::open(bytes).map_err(|status| Failure::new(status, 1))?;
            publish(opened.header, memory, environment, info);
        }
        Ok(())
    })
}

/// The environment behind a handle.
///
/// # Safety
/// The handle is null or points to an environment that this version built or opened.
#[inline(always)]
pub(super) unsafe fn view<'a>(environment: *const Environment, argument: u32) -> Checked<kernel::Environment<'a>> {
    // SAFETY: the caller's contract.
    let bytes = unsafe { handle(environment.cast(), Header::length, argument)? };
    kernel::Environment::view(bytes).ok_or(Failure::new(Status::Mismatch, argument))
}

/// Checks the pointers to the results of a build.
///
/// # Safety
/// Pointers are null or point to what the header says.
unsafe fn check_results(
    (environment, at): (*mut *const Environment, u32),
    (info, info_at): (*mut EnvironmentInfo, u32),
) -> Checked<()> {
    out(environment, at)?;
    if !info.is_null() {
        // SAFETY: the caller's contract.
        unsafe { sized(info.cast_const(), info_at)? };
    }
    Ok(())
}

/// Writes the results of a build or an opening.
///
/// # Safety
/// [`check_results`] accepted the pointers.
unsafe fn publish(
    header: &Header,
    memory: *const c_void,
    environment: *mut *const Environment,
    info: *mut EnvironmentInfo,
) {
    // SAFETY: checked before; info may be null.
    unsafe {
        environment.write(memory.cast());
        if !info.is_null() {
            info.write(EnvironmentInfo {
                size: size_of::<EnvironmentInfo>() as u32,
                resolution: 1 << header.depth,
                storage: header.storage,
                flags: header.flags,
                bytes: header.bytes,
                squares: header.squares.into(),
                sanitised: header.sanitised,
                content_id: header.content_id,
                power: header.power,
                error: header.error,
            });
        }
    }
}
