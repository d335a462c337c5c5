//! Samplers in C: the working memory of a thread.

use super::{
    Checked, Diagnostic, MemorySize, WIS_ALIGNMENT, answer, check_block, memory, out, put_size, require, sized,
    slice_mut,
};
use crate::blob::Size;
use crate::direct::sampler::{Config, MAX_PER_RAY, MAX_RAYS, Sampler};
use crate::simd::Level;
use crate::status::{Error, Status};
use core::ffi::c_void;

/// Detect the instructions of this processor.
pub const WIS_CPU_DETECT: u32 = 0;
/// Instructions that every processor of the platform has.
pub const WIS_CPU_BASELINE: u32 = 1;
/// x86-64 with AVX2.
pub const WIS_CPU_AVX2: u32 = 2;

/// One thread's working memory: bytes in your memory without pointers to it. One thread at a time may use it.
#[allow(missing_debug_implementations)]
pub struct SamplerObject {
    _opaque: [u8; 0],
}

/// What a sampler is made for. Zeros are good choices.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct SamplerConfig {
    /// sizeof(wis_sampler_config).
    pub size: u32,
    /// WIS_CPU_*. Never changes a bit of the results. WIS_INVALID_ARGUMENT for a level that this processor lacks.
    pub cpu_level: u32,
    /// The most rays of one call, 1 to 4096; 0: 16.
    pub rays: u32,
    /// Candidates for each ray, 1 to 256, rounded up to powers of two, at least 16 a call: 1 to 16 are the same for one ray. 0: chosen by rays,
    /// point and lobes, for cheap and expensive rays alike.
    pub candidates_per_ray: u32,
    /// First hits of a pixel, between calls of wis_sampler_begin_pixel; 0: unknown. From 16 on they share products: 16 kB more.
    pub hits_per_pixel: u32,
    /// Always 0.
    pub reserved: u32,
}

const MAGIC: u64 = u64::from_le_bytes(*b"wissmp\x02\x00");
const RAYS: u32 = 16;

/// What stands at the beginning of a sampler.
#[repr(C, align(16))]
pub(super) struct Header {
    magic: u64,
    config: Config,
    level: u32,
    /// Bytes of working memory behind this.
    scratch: u32,
    pub(super) fault: Diagnostic,
    #[cfg(feature = "products")]
    tables: super::light::Tables,
}

/// The levels in the order of their numbers, from [`WIS_CPU_BASELINE`] on.
fn level(number: u32) -> Checked<Level> {
    let detected = Level::detect();
    let has_lanes = detected != Level::BASELINE;
    match number {
        WIS_CPU_DETECT => Ok(detected),
        WIS_CPU_BASELINE => Ok(Level::BASELINE),
        WIS_CPU_AVX2 if has_lanes => Ok(detected),
        _ => Err(Error::new(Status::InvalidArgument, 1).of(c"cpu_level")),
    }
}

fn checked(config: &SamplerConfig) -> Checked<Config> {
    Error::first([
        (config.rays as usize <= MAX_RAYS, c"rays"),
        (config.candidates_per_ray as usize <= MAX_PER_RAY, c"candidates_per_ray"),
        (config.cpu_level <= WIS_CPU_AVX2, c"cpu_level"),
        (config.reserved == 0, c"reserved"),
    ])
    .map_err(|error| error.instead(1))?;
    let rays = if config.rays == 0 { RAYS } else { config.rays };
    let (candidates_per_ray, hits_per_pixel) = (config.candidates_per_ray, config.hits_per_pixel);
    Ok(Config { rays, candidates_per_ray, hits_per_pixel, reserved: 0 })
}

fn needed(config: &Config) -> usize {
    (size_of::<Header>() + config.bytes()).next_multiple_of(WIS_ALIGNMENT)
}

/// The bytes that a sampler needs: 6 kB for 16 rays, 2 kB for one to four. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_sampler_size(
    config: *const SamplerConfig,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let config = checked(sized(config, 1)?)?;
        put_size(size, 2, Ok(Size { bytes: needed(&config), scratch: 0 }))
    })
}

/// Makes a sampler in `memory`. Detects the processor's instructions, which takes microseconds: once for a thread.
/// Work: bytes.
///
/// # Safety
/// Pointers are null or point to what the header says; nobody else uses the memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_sampler_init(
    config: *const SamplerConfig,
    memory: *mut c_void,
    bytes: usize,
    sampler: *mut *mut SamplerObject,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract; the block is aligned to 16 and longer than a header, and the scratch behind it becomes
    // initialised numbers.
    answer(diagnostic, || unsafe {
        let raw = sized(config, 1)?;
        let config = checked(raw)?;
        let level = level(raw.cpu_level)?.code();
        check_block(memory.cast(), bytes, needed(&config), 2)?;
        let handle = out(sampler, 4)?;
        // All zeros, also what no field takes: the same bytes whatever the block held.
        memory.cast::<u8>().write_bytes(0, needed(&config));
        let header = memory.cast::<Header>();
        ((*header).magic, (*header).level) = (MAGIC, level);
        ((*header).config, (*header).scratch) = (config, config.bytes() as u32);
        handle.write(memory.cast());
        Ok(())
    })
}

/// Forgets products that hits of the last pixel shared, so that images depend on the order of pixels and on threads in nothing.
/// Call it when the seed of points changes. WIS_NULL_POINTER, WIS_MISMATCH for memory that holds no sampler.
/// Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_sampler_begin_pixel(sampler: *mut SamplerObject) -> Status {
    // SAFETY: the caller's sampler.
    unsafe {
        with_sampler(sampler, |sampler| {
            sampler.begin_pixel();
            Ok(())
        })
    }
}

/// Where the last call on this sampler that failed was at fault: argument, field and element. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_sampler_fault(sampler: *const SamplerObject, fault: *mut Diagnostic) -> Status {
    // SAFETY: the caller's sampler, which is only read, and the caller's diagnostic.
    let copied = unsafe {
        readable(sampler.cast()).and_then(|header| {
            out(fault, 2)?.write((*header).fault);
            Ok(())
        })
    };
    copied.map_or_else(|failure| failure.status, |()| Status::Ok)
}

/// The header of a sampler, the first argument, to read.
///
/// # Safety
/// The pointer is null or points to a sampler.
unsafe fn readable(header: *const Header) -> Checked<*const Header> {
    // SAFETY: the caller's contract; every block that a sampler was made in is longer than a header.
    let found: &Header = unsafe { memory::header(header.cast(), 1)? };
    require(found.magic == MAGIC, Status::Mismatch, 1)?;
    Ok(header)
}

/// The instructions that a sampler was made for, and the tables that it keeps, for a call that needs nothing else of it; notes where the call
/// fails.
///
/// # Safety
/// As [`with_sampler`].
#[cfg(feature = "products")]
#[inline(always)]
pub(super) unsafe fn with_level(
    sampler: *mut SamplerObject,
    body: impl FnOnce(Level, &mut super::light::Tables) -> Checked<()>,
) -> Status {
    // SAFETY: the caller's contract; the level was detected on this machine when the sampler was made.
    unsafe {
        if let Err(failure) = readable(sampler.cast()) {
            return failure.status;
        }
        let header: *mut Header = sampler.cast();
        let Some(level) = Level::from_code((*header).level) else { return Status::Mismatch };
        answer(&raw mut (*header).fault, || body(level, &mut (*header).tables))
    }
}

/// Opens a sampler for a call, and notes where the call fails.
///
/// # Safety
/// The pointer is null or points to a sampler that no other thread uses.
pub(super) unsafe fn with_sampler(
    sampler: *mut SamplerObject,
    body: impl FnOnce(&mut Sampler<'_>) -> Checked<()>,
) -> Status {
    // SAFETY: the caller's contract.
    if let Err(failure) = unsafe { readable(sampler.cast()) } {
        return failure.status;
    }
    let header: *mut Header = sampler.cast();
    // SAFETY: the header is initialised, its level was detected on this machine when the sampler was made, and the scratch
    // of that many initialised bytes stands behind it.
    unsafe {
        let config = (*header).config;
        let Some(level) = Level::from_code((*header).level) else { return Status::Mismatch };
        let bytes = (*header).scratch as usize;
        let Ok(scratch) = slice_mut(header.add(1).cast::<u8>(), bytes, 1) else { return Status::Mismatch };
        let Some(mut opened) = Sampler::open(level, config, scratch) else { return Status::Mismatch };
        answer(&raw mut (*header).fault, || body(&mut opened))
    }
}
