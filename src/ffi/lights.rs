//! The boundary of `wis_lights.h`: structured importance sampling, a map as directional lights, and places inside their strata.

use super::light::{LightConfig, PixelRows, read_config};
use super::memory::{block_mut, handle, stored_or};
use super::{
    Checked, Diagnostic, MemorySize, answer, borrow, out, put, put_size, require, require_all, sized, slice, slice_mut,
};
use crate::light::chart::Layout;
use crate::light::pixels::Pixels;
use crate::lights::jitter::{Config as TableConfig, Header, Jitter as Table, order};
use crate::lights::{Map, strata};
use crate::numeric::is_float;
use crate::sample::Sample;
use crate::sphere::Frame;
use crate::status::{Error, Status};
use core::ffi::c_void;
use core::ptr::null_mut;

/// How to cut a map into strata. Zeros stand for the paper's choices.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct StrataConfig {
    /// sizeof(wis_strata_config).
    pub size: u32,
    /// Lights to place; there may be more where many small bright regions are each worth a light.
    pub count: u32,
    /// Layers of brightness, cut at multiples of the map's standard deviation, at most 64; 0: 6.
    pub levels: u32,
    /// The solid angle in sr from which on the size of a region does not count; 0: 0.01.
    pub angle_limit: f32,
    /// Two exponents, at least 0 and at most 8, of radiance and of solid angle: how much a region counts. (1, 0) is
    /// importance sampling of the light, (0, 1) with an `angle_limit` of 4 pi stratifies the sphere; null: 1 and 1/4.
    pub exponents: *const f32,
}

/// The memory that wis_strata_lights needs: `bytes` of lights and `scratch_bytes` of scratch. `map`: lat-long, without
/// WIS_ENVIRONMENT_ROWS_AT_POLES; of its flags only WIS_ENVIRONMENT_SANITISE counts; filter and error budget do not matter.
/// Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_strata_size(
    map: *const LightConfig,
    config: *const StrataConfig,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let (config, ..) = read(map, config)?;
        put_size(size, 3, config.size().ok_or(Error::new(Status::Overflow, 1)))
    })
}

/// Cuts a map into strata and gives each as a directional light (Agarwal et al. 2003): bright regions get more lights
/// than dark ones of the same energy, and lights of a region stand apart. The lights' `rgb` add up to the integral of
/// radiance over the sphere. Written are `light_count` lights, in the order of importance in which they were placed; 0
/// for a black map. The result depends on nothing but the map and the config. WIS_OVERFLOW if the light of a stratum is no
/// float.
///
/// `lights` holds `bytes` of wis_strata_size. `label` may be null; else it holds width x height numbers, and gets the
/// number of the light of each texel. Work: (lights + levels) x texels.
///
/// # Safety
/// Pointers are null or point to what the header says; nobody else uses the memory meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_strata_lights(
    map: *const LightConfig,
    config: *const StrataConfig,
    scratch: *mut c_void,
    scratch_bytes: usize,
    lights: *mut strata::Light,
    light_count: *mut u32,
    label: *mut u32,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let (config, map, rows) = read(map, config)?;
        let size = config.size().ok_or(Error::new(Status::Overflow, 1))?;
        let block = block_mut(scratch, scratch_bytes, size.scratch, 3)?;
        let lights = slice_mut(lights, config.capacity(), 5)?;
        let light_count = out(light_count, 6)?;
        let label = if label.is_null() { &mut [] } else { slice_mut(label, config.texels(), 7)? };
        let written =
            config.lights_in(&map, &|y| rows.row(y), block, lights, label).map_err(|error| match error.status {
                Status::InvalidArgument => error.instead(2),
                _ => error.of_build([1, 3]),
            })?;
        light_count.write(written as u32);
        Ok(())
    })
}

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
        let config = TableConfig { size: map.size, lights: checked(config)?.light_count };
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
        let config = TableConfig { size: map.size, lights: light_count };
        let size = config.size().ok_or(Error::new(Status::Overflow, 1))?;
        let labels: &[u32] = slice(label, config.texels(), 2).map_err(|at| at.of(c"label"))?;
        let block = block_mut(memory, bytes, size.bytes, 3)?;
        block_mut(scratch, scratch_bytes, size.scratch, 5)?;
        let target = out(jitter, 7)?;
        let luminance: &mut [f64] = slice_mut(scratch.cast(), config.texels(), 5)?;
        map.decode(&|y| rows.row(y), luminance, &mut []).map_err(|error| error.of_build([1, 5]))?;
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
        out(traced, 5)?.write(order(contribution, threshold.into(), index) as u32);
        Ok(())
    })
}

/// Checks the configuration of a lat-long map, the first argument.
///
/// # Safety
/// The pointer is null or points to what the header says.
unsafe fn read_map<'a>(map: *const LightConfig) -> Checked<(Map, PixelRows<'a>)> {
    // SAFETY: the caller's contract.
    let (request, rows) = unsafe { read_config(map)? };
    let of = &request.plan.of;
    Error::first([(of.layout == Layout::LatLong, c"layout"), (!of.rows_at_poles, c"flags")])
        .map_err(|error| error.instead(1))?;
    let pixels = Pixels { absolute: false, ..request.pixels };
    Ok((Map { size: [of.width, of.height], pixels, frame: request.frame }, rows))
}

/// Checks a map and how to cut it.
///
/// # Safety
/// The pointers are null or point to what the header says.
unsafe fn read<'a>(
    map: *const LightConfig,
    config: *const StrataConfig,
) -> Checked<(strata::Config, Map, PixelRows<'a>)> {
    // SAFETY: the caller's contract.
    let ((map, rows), given) = unsafe { (read_map(map)?, sized(config, 2)?) };
    let [width, height] = map.size;
    let mut config = strata::Config::new(width, height, given.count);
    if !given.exponents.is_null() {
        // SAFETY: the caller's contract.
        let exponents = unsafe { *borrow(given.exponents.cast::<[f32; 2]>(), 2).map_err(|at| at.of(c"exponents"))? };
        [config.radiance_exponent, config.angle_exponent] = exponents.map(f64::from);
    }
    if given.angle_limit != 0.0 {
        config.angle_limit = given.angle_limit.into();
    }
    if given.levels != 0 {
        config.levels = given.levels;
    }
    let in_range = |exponent: &f64| (0.0..=8.0).contains(exponent);
    Error::first([
        (config.levels <= 64, c"levels"),
        (config.angle_limit > 0.0 && is_float(config.angle_limit), c"angle_limit"),
        ([config.radiance_exponent, config.angle_exponent].iter().all(in_range), c"exponents"),
    ])
    .map_err(|error| error.instead(2))?;
    if config.texels() >= u32::MAX as usize {
        return Err(Error::new(Status::Overflow, 1).of(c"height"));
    }
    Ok((config, map, rows))
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
