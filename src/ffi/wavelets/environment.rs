//! Environments as wavelet trees in C: size, build, open.

pub use crate::ffi::light::{
    RowFn, WIS_FORMAT_F16, WIS_FORMAT_F32, WIS_LAYOUT_CUBE, WIS_LAYOUT_LATLONG, WIS_LAYOUT_OCTAHEDRAL,
};
pub use crate::wavelets::environment::info::EnvironmentInfo;
pub use crate::wavelets::environment::{
    WIS_STORAGE_PYRAMID, WIS_STORAGE_SPARSE, WIS_WAVELET_LIGHT_EXACT_ZERO, WIS_WAVELET_LIGHT_NEAREST,
    WIS_WAVELET_LIGHT_RGB, WIS_WAVELET_LIGHT_SANITISE,
};

use crate::ffi::light::rows::PixelRows;
use crate::ffi::memory::{block_mut, handle};
use crate::ffi::wavelets::memory::{Results, room_mut, stored};
use crate::ffi::{Checked, Diagnostic, MemorySize, answer, put_size, sized};
use crate::status::{Error, Status};
use crate::wavelets::environment as kernel;
use crate::wavelets::environment::request::Numbers;
use crate::wavelets::environment::{Config, Header};
use core::ffi::c_void;

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
    /// Texel 0 of row 0, aligned to its format; or null, and `row` gives the rows, which need no alignment.
    pub pixels: *const c_void,
    /// Bytes from a row to the next, a multiple of a channel's, may be negative; 0: rows stand close together.
    pub row_stride: isize,
    /// Used if `pixels` is null.
    pub row: RowFn,
    /// Handed to `row`.
    pub row_user: *mut c_void,
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
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let (config, _) = read_config(config)?;
        put_size(size, 2, config.size().map_err(|status| Error::new(status, 1)))
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
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let (config, rows) = read_config(config)?;
        let results = Results::new((environment, 6), (info, 7))?;
        let size = config.size().map_err(|status| Error::new(status, 1))?;
        let work = block_mut(scratch, scratch_bytes, size.scratch, 4)?;
        // How many bytes a sparse tree needs is known only at the end.
        let target = room_mut(memory, bytes, size.bytes, 2)?;
        let built = kernel::Environment::build_in(&config, &rows, target, work);
        results.publish(memory, built.map_err(|error| error.of_build([1, 2]))?.header.info())
    })
}

/// Opens bytes that an earlier build wrote: copied, or mapped from a file. WIS_CORRUPT if a byte was changed; with the field
/// `magic` in the diagnostic if another version of wis wrote them. `info` may be null. Reads all bytes once. Work: bytes.
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
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let results = Results::new((environment, 3), (info, 4))?;
        let opened = kernel::Environment::open(stored(memory, bytes, Header::checked_length)?);
        results.publish(memory, opened.map_err(|status| Error::new(status, 1))?.header.info())
    })
}

/// Checks a configuration, which is argument 1.
///
/// # Safety
/// The pointer is null or points to what the header says.
unsafe fn read_config(config: *const EnvironmentConfig) -> Checked<(Config, PixelRows)> {
    // SAFETY: the caller's contract.
    let c = unsafe { sized(config, 1)? };
    let &EnvironmentConfig { layout, width, height, channels, format, flags, storage, resolution, .. } = c;
    let error_budget = c.error_budget;
    let map = [layout, width, height, channels, format];
    let numbers = Numbers { map, flags, storage, resolution, error_budget };
    let config = Config::new(&numbers).map_err(|error| error.instead(1))?;
    let row_bytes = config.pixels.row_bytes().ok_or(Error::new(Status::Overflow, 1).of(c"width"))?;
    let rows = PixelRows { pixels: c.pixels, row_stride: c.row_stride, row: c.row, row_user: c.row_user, row_bytes };
    let rows = rows.checked(config.pixels.format, height)?;
    Ok((config, rows))
}

/// The environment behind a handle.
///
/// # Safety
/// The handle is null or points to an environment that this version built or opened.
#[inline(always)]
pub(super) unsafe fn view<'a>(environment: *const Environment, argument: u32) -> Checked<kernel::Environment<'a>> {
    // SAFETY: the caller's contract.
    let bytes = unsafe { handle(environment.cast(), Header::length, argument)? };
    kernel::Environment::view(bytes).ok_or(Error::new(Status::Mismatch, argument))
}
