//! Environments in C: build, open, and the environment alone as a distribution.

mod build;
pub(super) mod request;
mod stored;

use super::density;

pub use crate::ffi::light::{
    RowFn, WIS_FORMAT_F16, WIS_FORMAT_F32, WIS_LAYOUT_CUBE, WIS_LAYOUT_LATLONG, WIS_LAYOUT_OCTAHEDRAL,
};

use crate::ffi::wavelets::level;
use crate::ffi::{
    Checked, Diagnostic, ExclusiveBlock, Failure, MemorySize, SharedBlock, WIS_ALIGNMENT, answer, borrow, frame, out,
    sized,
};
use crate::sample::Sample;
use crate::simd::Level;
use crate::sphere::Frame;
use crate::status::Status;
use crate::wavelets::environment as kernel;
use crate::wavelets::environment::{Distribution, Header, MAGIC};
use build::{Build, Scratch};
use core::ffi::c_void;
use request::read_config;
use stored::{Stored, check_stored, opened};

/// Every cell is stored: 16 bytes for four cells, and a third more for the coarser levels. If the resolution is left
/// to the library and WIS_WAVELET_LIGHT_NEAREST is set, cells in which light varies much (a sun, the edge of a lamp) are
/// divided further, down to 16384 along each side: 24 bytes a square, in as much room as cells / 8 or 4096 squares take.
pub const WIS_STORAGE_PYRAMID: u32 = 1;
/// A wavelet tree pruned to `error_budget`: 24 bytes for each square that is kept.
pub const WIS_STORAGE_SPARSE: u32 = 2;

/// The client looks texels up without filtering: importance is not spread to neighbouring texels.
pub const WIS_WAVELET_LIGHT_NEAREST: u32 = 1;
/// Black stays black, with density 0. Otherwise no cell is darker than 2^-16 of the mean.
pub const WIS_WAVELET_LIGHT_EXACT_ZERO: u32 = 2;
/// The compensated distribution is stored too (Karlik et al. 2019): max(L - mean, L / 64). It takes as much room as the
/// luminance; in a pyramid whose resolution is left to the library it keeps, for clients without filter
/// (WIS_WAVELET_LIGHT_NEAREST), the texels instead, 6 to 8 bytes each, and is sampled and asked twice as fast.
pub const WIS_WAVELET_LIGHT_COMPENSATED: u32 = 4;
/// RGB averages are stored too, for wis_wavelet_product_estimate_rgb: 48 bytes for four cells, and a third more.
pub const WIS_WAVELET_LIGHT_RGB: u32 = 8;
/// Bad texels are replaced and counted instead of rejected: NaN, -Inf and negative channels by 0, a texel with
/// +Inf by the largest finite luminance of the map.
pub const WIS_WAVELET_LIGHT_SANITISE: u32 = 16;

/// Proportional to luminance.
pub const WIS_DISTRIBUTION_PLAIN: u32 = 0;
/// Proportional to the luminance above the mean: for multiple importance sampling with the BRDF.
pub const WIS_DISTRIBUTION_COMPENSATED: u32 = 1;

const ALL_FLAGS: u32 = WIS_WAVELET_LIGHT_NEAREST
    | WIS_WAVELET_LIGHT_EXACT_ZERO
    | WIS_WAVELET_LIGHT_COMPENSATED
    | WIS_WAVELET_LIGHT_RGB
    | WIS_WAVELET_LIGHT_SANITISE;

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
    /// Used if `pixels` is null; called from each thread that runs the first pass.
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

/// The best instructions that this processor and the library have: a number to hand to preparations (wis_wavelet_product_config)
/// and to the calls that end in _lanes. 0 is the baseline of the platform; other numbers mean nothing to count with. The
/// calls answer WIS_INVALID_ARGUMENT to a number that this function answers on no processor. Keep the number as long as the
/// process, not in a file: another machine may lack the instructions, which wis_wavelet_product_size finds and later calls do not.
/// Takes about 20 us in a virtual machine: call it once.
#[unsafe(no_mangle)]
pub extern "C" fn wis_cpu_detect() -> u32 {
    crate::simd::detect()
}

/// The bytes that an environment needs: exactly for a pyramid of a stated resolution, at most for sparse storage and
/// for a pyramid whose cells may be divided further (the bytes that are in use stand in wis_wavelet_light_info; a block that is too short fails with WIS_MEMORY_TOO_SMALL and tells them, and
/// wis_wavelet_light_finish may then be called again).
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
        let (request, _) = unsafe { read_config(config)? };
        let size = out(size, 2)?;
        let overflow = Failure::new(Status::Overflow, 1);
        let stored = request.stored(request.squares(), request.config.room() as u32).ok_or(overflow)?;
        let scratch = Scratch::of(&request).ok_or(overflow)?;
        let needed = MemorySize { bytes: stored.bytes, align: WIS_ALIGNMENT, scratch_bytes: scratch.bytes };
        // SAFETY: checked by `out`.
        unsafe { size.write(needed) };
        Ok(())
    })
}

/// Builds an environment in one call. `info` may be null.
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
            let (request, rows) = read_config(config)?;
            // Whether the block is long enough for a sparse tree is known only at the end.
            ExclusiveBlock::new(memory.cast(), bytes, 0, 2)?;
            check_results(environment, 6, info, 7)?;
            let build = Build::begin(request, scratch, scratch_bytes, 4)?;
            for (pass, count) in (0..).zip(build.rows()) {
                build.run(&rows, pass, 0, count)?;
            }
            build.finish(memory.cast(), bytes, environment, info)
        }
    })
}

/// Begins a build that threads share: for each of the two passes `p`, the rows `0..rows[p]` go to
/// wis_wavelet_light_run in any portions, on any threads; all of pass 0 before any of pass 1. The bits do not depend on
/// how the rows were shared.
///
/// # Safety
/// Pointers are null or point to what the header says; `rows` to two numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_light_begin(
    config: *const EnvironmentConfig,
    scratch: *mut c_void,
    scratch_bytes: usize,
    rows: *mut [u32; 2],
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let (request, _) = read_config(config)?;
            let target = out(rows, 4)?;
            let build = Build::begin(request, scratch, scratch_bytes, 2)?;
            target.write(build.rows());
        }
        Ok(())
    })
}

/// Works on `count` rows of a pass (0 or 1) from row `first` on. The configuration must be that of
/// wis_wavelet_light_begin. Threads may call this at once for different rows. WIS_MISMATCH if the second pass comes
/// before the first is done.
///
/// # Safety
/// Pointers are null or point to what the header says; no other thread works on the same rows.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_light_run(
    config: *const EnvironmentConfig,
    scratch: *mut c_void,
    scratch_bytes: usize,
    pass: u32,
    first: u32,
    count: u32,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let (request, rows) = read_config(config)?;
            let build = Build::go_on(request, scratch, scratch_bytes, 2)?;
            let available = build.rows().get(pass as usize).copied().ok_or(Failure::new(Status::InvalidArgument, 4))?;
            let left = available.checked_sub(first).ok_or(Failure::new(Status::InvalidArgument, 5))?;
            if count > left {
                return Err(Failure::new(Status::InvalidArgument, 6));
            }
            if pass > 0 {
                build.require(pass - 1, 2)?;
            }
            build.run(&rows, pass, first, count)
        }
    })
}

/// Ends a build when both passes are done (WIS_MISMATCH before). `info` may be null.
///
/// # Safety
/// As wis_wavelet_light_init; no thread is still at work on the scratch block.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_light_finish(
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
            let (request, _) = read_config(config)?;
            check_results(environment, 6, info, 7)?;
            let build = Build::go_on(request, scratch, scratch_bytes, 4)?;
            build.require(1, 4)?;
            build.finish(memory.cast(), bytes, environment, info)
        }
    })
}

/// Checks bytes that an earlier build wrote (copied, or mapped from a file) and gives them as an environment. Reads
/// all of them once. `info` may be null.
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
            check_results(environment, 3, info, 4)?;
            let block = SharedBlock::new(memory.cast(), bytes, size_of::<Header>(), 1)?;
            let header = block.slice::<Header>(0, 0, 1).first().copied().ok_or(Status::Corrupt)?;
            let corrupt = Failure::new(Status::Corrupt, 1);
            let stored = Stored::of_header(&header).ok_or(corrupt)?;
            if header.bytes != stored.bytes as u64 {
                return Err(corrupt);
            }
            let block = SharedBlock::new(memory.cast(), bytes, stored.bytes, 1)?;
            let view = stored.environment(memory.cast());
            check_stored(&view).map_err(|_| corrupt)?;
            if !stored.is_padding_clear(&block) {
                return Err(corrupt);
            }
            publish(memory.cast(), &header, environment, info);
        }
        Ok(())
    })
}

/// The integral of a distribution over the sphere, in the units of the map times steradian: of luminance, or of what
/// compensation leaves of it. Its radiance over this power is the pdf of a direction, up to the size of a cell.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_light_power(
    environment: *const Environment,
    distribution: u32,
    power: *mut f64,
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let environment = view(environment, 1)?;
            select(&environment, distribution)?;
            let header = environment.header;
            let compensated = distribution == WIS_DISTRIBUTION_COMPENSATED;
            out(power, 3)?.write(if compensated { header.compensated_power() } else { header.power });
        }
        Ok(())
    })
}

/// Samples a direction in proportion to the light alone. `u`: two numbers in [0, 1) (others are moved there, NaN
/// counts as 1/2). `world_from_map`: a row-major 3x3 rotation or reflection, within 1e-4; null is the identity. A
/// black environment gives pdf 0.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_light_sample(
    environment: *const Environment,
    distribution: u32,
    world_from_map: *const [f32; 9],
    u: *const [f32; 2],
    sample: *mut Sample,
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let (light, frame) = light(environment, distribution, world_from_map)?;
            density::sample((&light, &frame), u, sample, 4)
        }
    })
}

/// As `count` calls of wis_wavelet_light_sample. Strides are in bytes from one element to the next; 0: packed.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_light_sample_n(
    environment: *const Environment,
    distribution: u32,
    world_from_map: *const [f32; 9],
    count: usize,
    u: *const f32,
    u_stride: usize,
    wi: *mut f32,
    wi_stride: usize,
    pdf: *mut f32,
    pdf_stride: usize,
) -> Status {
    // SAFETY: the caller's contract.
    unsafe {
        wis_wavelet_light_sample_lanes(
            environment,
            distribution,
            world_from_map,
            Level::BASELINE.code(),
            count,
            u,
            u_stride,
            wi,
            wi_stride,
            pdf,
            pdf_stride,
        )
    }
}

/// As wis_wavelet_light_sample_n, with the instructions of a `cpu_level` (wis_cpu_detect): the same bits, with AVX2 in three
/// quarters of the time.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_light_sample_lanes(
    environment: *const Environment,
    distribution: u32,
    world_from_map: *const [f32; 9],
    cpu_level: u32,
    count: usize,
    u: *const f32,
    u_stride: usize,
    wi: *mut f32,
    wi_stride: usize,
    pdf: *mut f32,
    pdf_stride: usize,
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract; indices stay below `count`.
        unsafe {
            let (light, frame) = light(environment, distribution, world_from_map)?;
            let level = level(cpu_level, 4)?;
            density::sample_n((&light, &frame), level, count, (u, u_stride), (wi, wi_stride), (pdf, pdf_stride), 6)
        }
    })
}

/// The pdf per solid angle of any direction of unit length (within 1e-3): the very bits that a sample came with.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_light_pdf(
    environment: *const Environment,
    distribution: u32,
    world_from_map: *const [f32; 9],
    wi: *const [f32; 3],
    pdf: *mut f32,
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let (light, frame) = light(environment, distribution, world_from_map)?;
            density::pdf((&light, &frame), wi, pdf, 4)
        }
    })
}

/// As `count` calls of wis_wavelet_light_pdf; a direction that is not of unit length gets pdf 0.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_light_pdf_n(
    environment: *const Environment,
    distribution: u32,
    world_from_map: *const [f32; 9],
    count: usize,
    wi: *const f32,
    wi_stride: usize,
    pdf: *mut f32,
    pdf_stride: usize,
) -> Status {
    // SAFETY: the caller's contract.
    unsafe {
        wis_wavelet_light_pdf_lanes(
            environment,
            distribution,
            world_from_map,
            Level::BASELINE.code(),
            count,
            wi,
            wi_stride,
            pdf,
            pdf_stride,
        )
    }
}

/// As wis_wavelet_light_pdf_n, with the instructions of a `cpu_level` (wis_cpu_detect): the same bits, with AVX2 in three
/// quarters of the time.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_light_pdf_lanes(
    environment: *const Environment,
    distribution: u32,
    world_from_map: *const [f32; 9],
    cpu_level: u32,
    count: usize,
    wi: *const f32,
    wi_stride: usize,
    pdf: *mut f32,
    pdf_stride: usize,
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract; indices stay below `count`.
        unsafe {
            let (light, frame) = light(environment, distribution, world_from_map)?;
            let level = level(cpu_level, 4)?;
            density::pdf_n((&light, &frame), level, count, (wi, wi_stride), (pdf, pdf_stride), 6)
        }
    })
}

/// The `u` that leads to a direction. WIS_ZERO_DENSITY if none does.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_wavelet_light_invert(
    environment: *const Environment,
    distribution: u32,
    world_from_map: *const [f32; 9],
    wi: *const [f32; 3],
    u: *mut [f32; 2],
) -> Status {
    answer(core::ptr::null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let (light, frame) = light(environment, distribution, world_from_map)?;
            density::invert((&light, &frame), wi, u, 4)
        }
    })
}

/// The density and the frame that the calls on an environment alone work with.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[inline(always)]
unsafe fn light<'a>(
    environment: *const Environment,
    distribution: u32,
    world_from_map: *const [f32; 9],
) -> Checked<(Distribution<'a>, Frame)> {
    // SAFETY: the caller's contract.
    let environment = unsafe { view(environment, 1)? };
    let selected = select(&environment, distribution)?;
    // SAFETY: the caller's contract.
    Ok((selected, unsafe { frame(world_from_map, 3)? }))
}

/// A distribution by its name.
#[inline(always)]
fn select<'a>(environment: &kernel::Environment<'a>, distribution: u32) -> Checked<Distribution<'a>> {
    match distribution {
        WIS_DISTRIBUTION_PLAIN => Ok(environment.plain()),
        WIS_DISTRIBUTION_COMPENSATED if environment.header.flags & WIS_WAVELET_LIGHT_COMPENSATED != 0 => {
            Ok(environment.compensated())
        }
        WIS_DISTRIBUTION_COMPENSATED => Err(Failure::new(Status::NotBuilt, 2)),
        _ => Err(Failure::new(Status::InvalidArgument, 2)),
    }
}

/// The environment behind a handle.
///
/// # Safety
/// The handle is null or points to an environment that this version built or opened.
#[inline(always)]
pub(super) unsafe fn view<'a>(environment: *const Environment, argument: u32) -> Checked<kernel::Environment<'a>> {
    // SAFETY: the caller's contract; a header is at least aligned.
    let header = unsafe { borrow(environment.cast::<Header>(), argument)? };
    if environment.addr() % WIS_ALIGNMENT != 0 {
        return Err(Failure::new(Status::Misaligned, argument));
    }
    if header.magic != MAGIC {
        return Err(Failure::new(Status::Mismatch, argument));
    }
    // SAFETY: the caller's contract.
    Ok(unsafe { opened(environment.cast()) })
}

/// Checks the pointers to the results of a build.
///
/// # Safety
/// Pointers are null or point to what the header says.
unsafe fn check_results(
    environment: *mut *const Environment,
    environment_argument: u32,
    info: *mut EnvironmentInfo,
    info_argument: u32,
) -> Checked<()> {
    out(environment, environment_argument)?;
    if !info.is_null() {
        // SAFETY: the caller's contract.
        unsafe { sized(info.cast_const(), info_argument)? };
    }
    Ok(())
}

/// Writes the results of a build or an opening.
///
/// # Safety
/// [`check_results`] accepted the pointers.
unsafe fn publish(
    memory: *const Environment,
    header: &Header,
    environment: *mut *const Environment,
    info: *mut EnvironmentInfo,
) {
    // SAFETY: checked before; info may be null.
    unsafe {
        environment.write(memory);
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
