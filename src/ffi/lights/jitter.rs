//! Places inside strata in C.

use crate::ffi::light::LightConfig;
use crate::ffi::lights::strata::read_map;
use crate::ffi::memory::{block_mut, handle, stored_or};
use crate::ffi::{
    Checked, Diagnostic, MemorySize, answer, borrow, out, put, put_size, require, require_all, sized, slice, slice_mut,
};
use crate::lights::jitter::{self, Config, Header, Jitter as Table};
use crate::sample::Sample;
use crate::sphere::Frame;
use crate::status::{Error, Status};
use core::ffi::c_void;
use core::ptr::null_mut;

/// Directions uniform over the solid angle of a stratum: the paper's jitter, biased in shadow where the light varies
/// inside the stratum.
pub const WIS_JITTER_UNIFORM: u32 = 0;
/// Directions in proportion to the radiance of the texels: the light's `rgb` luminance x visibility is unbiased.
pub const WIS_JITTER_ENERGY: u32 = 1;

/// The texels of every stratum, to place samples inside: bytes in your memory without pointers. Constant once built; any
/// number of threads may use it at once. Nothing to free.
#[allow(missing_debug_implementations)]
pub struct Jitter {
    _opaque: [u8; 0],
}

/// Which texel lies in which stratum, and how places are drawn.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct JitterConfig {
    /// sizeof(wis_jitter_config).
    pub size: u32,
    /// Strata: the lights that wis_strata_lights placed.
    pub light_count: u32,
    /// WIS_JITTER_*.
    pub distribution: u32,
    /// Always 0.
    pub reserved: u32,
    /// The light of each texel, width x height numbers below `light_count`: as wis_strata_lights found them. wis_jitter_size does
    /// not read it.
    pub label: *const u32,
}

/// The memory that wis_jitter_init needs for the strata of a lat-long map. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_jitter_size(
    map: *const LightConfig,
    config: *const JitterConfig,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let (map, _) = read_map(map)?;
        let config = Config { size: map.size, lights: checked(config)?.light_count };
        put_size(size, 3, config.size().ok_or(Error::new(Status::Overflow, 1)))
    })
}

/// Sorts the texels of a map by their strata, so that directions can be drawn inside each. `map` as in wis_strata_size.
/// WIS_INVALID_ARGUMENT for a label that is no stratum: `y` in the diagnostic is the number of the texel. Work: texels + lights.
///
/// # Safety
/// Pointers are null or point to what the header says; nobody else uses the memory meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_jitter_init(
    map: *const LightConfig,
    config: *const JitterConfig,
    memory: *mut c_void,
    bytes: usize,
    scratch: *mut c_void,
    scratch_bytes: usize,
    jitter: *mut *const Jitter,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let (map, rows) = read_map(map)?;
        let &JitterConfig { light_count, distribution, label, .. } = checked(config)?;
        let config = Config { size: map.size, lights: light_count };
        let size = config.size().ok_or(Error::new(Status::Overflow, 1))?;
        let labels: &[u32] = slice(label, config.texels(), 2).map_err(|at| at.of(c"label"))?;
        let block = block_mut(memory, bytes, size.bytes, 3)?;
        block_mut(scratch, scratch_bytes, size.scratch, 5)?;
        let target = out(jitter, 7)?;
        let luminance: &mut [f64] = slice_mut(scratch.cast(), config.texels(), 5)?;
        map.decode(&rows, luminance, &mut []).map_err(|error| error.of_build([1, 5]))?;
        let luminance = Some(&*luminance).filter(|_| distribution == WIS_JITTER_ENERGY);
        let wrong = || labels.iter().position(|&label| label >= light_count).unwrap_or(0);
        let built = config.build_in(&map.frame, labels, luminance, block);
        built.map_err(|status| Error::new(status, 2).of(c"label").in_row(wrong()))?;
        target.write(memory.cast_const().cast());
        Ok(())
    })
}

/// Opens bytes that wis_jitter_init wrote: copied, or mapped from a file. `jitter` receives the handle, which is the address of `memory`.
/// WIS_CORRUPT if a byte was changed; with the field `magic` in the diagnostic if another version of wis wrote them. Reads all bytes once.
/// Work: bytes.
///
/// # Safety
/// Pointers are null or point to what the header says; the bytes do not change while the table is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_jitter_open(
    memory: *const c_void,
    bytes: usize,
    jitter: *mut *const Jitter,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let target = out(jitter, 3)?;
        let opened = Table::open(stored_or(Status::Corrupt, memory, bytes, 1, Header::length)?);
        opened.map_err(|status| Error::new(status, 1))?;
        target.write(memory.cast());
        Ok(())
    })
}

/// Draws a direction inside stratum `light` (WIS_INVALID_ARGUMENT if there is none). The pdf is per solid angle within the
/// stratum. With WIS_JITTER_ENERGY add the light's whole energy x BRDF x cosine x visibility, without dividing by the
/// pdf; for radiance looked up at the sample divide by it. Work: log texels.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_jitter_sample(
    jitter: *const Jitter,
    light: u32,
    u: *const [f32; 2],
    sample: *mut Sample,
) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let (table, frame) = view(jitter, light)?;
        let u = *borrow(u, 3)?;
        put(sample, 4, Ok(table.sample(&frame, light, u)))
    })
}

/// The pdf of wis_jitter_sample for any direction of unit length: the very bits that a sample came with, and 0 outside
/// the stratum. Work: log texels.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_jitter_pdf(
    jitter: *const Jitter,
    light: u32,
    wi: *const [f32; 3],
    pdf: *mut f32,
) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let (table, frame) = view(jitter, light)?;
        let wi = *borrow(wi, 3)?;
        put(pdf, 4, table.pdf(&frame, light, wi).map_err(|status| Error::new(status, 3)))
    })
}

/// Which lights are worth a shadow ray at a point (Agarwal et al. 2003, Section 4): writes the numbers of `count`
/// lights into `index`, the first `traced` of them in the order of `contribution` (radiance x BRDF x cosine, at least 0
/// and finite, else WIS_INVALID_ARGUMENT), the largest first, equal ones by number. What the others could add is at
/// most `threshold` (0 to 1, however small) of the whole; they follow in an order of no meaning. Estimate those by
/// their sum x the share that is visible of a few of them drawn in proportion to `contribution`: without bias. The time
/// is that of a pass over all lights and of sorting those that are traced. Work: count x log count.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_strata_order(
    count: usize,
    contribution: *const f32,
    threshold: f32,
    index: *mut u32,
    traced: *mut u32,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        require(count < u32::MAX as usize, Status::Overflow, 1)?;
        let contribution: &[f32] = if count == 0 { &[] } else { slice(contribution, count, 2)? };
        require_all(contribution, 2, |c| (0.0..=f32::MAX).contains(c))?;
        require((0.0..=1.0).contains(&threshold), Status::InvalidArgument, 3)?;
        let index = slice_mut(index, count, 4)?;
        out(traced, 5)?.write(jitter::order(contribution, threshold.into(), index) as u32);
        Ok(())
    })
}

/// A configuration, checked but for its labels.
///
/// # Safety
/// The pointer is null or points to what the header says.
unsafe fn checked<'a>(config: *const JitterConfig) -> Checked<&'a JitterConfig> {
    // SAFETY: the caller's contract.
    let config = unsafe { sized(config, 2)? };
    Error::first([(config.distribution <= WIS_JITTER_ENERGY, c"distribution"), (config.reserved == 0, c"reserved")])
        .map_err(|error| error.instead(2))?;
    Ok(config)
}

/// The table behind a handle, which has a stratum of this number.
///
/// # Safety
/// The handle is null or points to a table of this version.
unsafe fn view<'a>(jitter: *const Jitter, light: u32) -> Checked<(Table<'a>, Frame)> {
    // SAFETY: the caller's contract.
    let bytes = unsafe { handle(jitter.cast(), Header::length, 1)? };
    let viewed = Table::view(bytes).ok_or(Error::new(Status::Mismatch, 1))?;
    if light < viewed.0.strata() { Ok(viewed) } else { Err(Error::new(Status::InvalidArgument, 2)) }
}
