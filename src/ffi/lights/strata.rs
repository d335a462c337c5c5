//! Structured importance sampling in C: a map as directional lights.

use crate::ffi::light::{LightConfig, PixelRows, read_config};
use crate::ffi::memory::block_mut;
use crate::ffi::{Checked, Diagnostic, MemorySize, answer, out, put_size, sized, slice, slice_mut};
use crate::light::chart::Layout;
use crate::light::pixels::Pixels;
use crate::lights::map::Map;
use crate::lights::strata::{Config, Light};
use crate::status::{Error, Status};
use core::ffi::c_void;

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
    lights: *mut Light,
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
        let written = config.lights_in(&map, &rows, block, lights, label).map_err(|error| match error.status {
            Status::InvalidArgument => error.instead(2),
            _ => error.of_build([1, 3]),
        })?;
        light_count.write(written as u32);
        Ok(())
    })
}

/// Checks the configuration of a lat-long map, the first argument.
///
/// # Safety
/// The pointer is null or points to what the header says.
pub(super) unsafe fn read_map(map: *const LightConfig) -> Checked<(Map, PixelRows)> {
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
unsafe fn read(map: *const LightConfig, config: *const StrataConfig) -> Checked<(Config, Map, PixelRows)> {
    // SAFETY: the caller's contract.
    let (map, rows, given, exponents) = unsafe {
        let (map, rows) = read_map(map)?;
        let given = sized(config, 2)?;
        let exponents = match given.exponents.is_null() {
            true => &[1.0, 0.25],
            false => slice(given.exponents, 2, 2).map_err(|at| at.of(c"exponents"))?,
        };
        (map, rows, given, exponents)
    };
    let limit = if given.angle_limit == 0.0 { 0.01 } else { given.angle_limit };
    Error::first([
        (given.levels <= 64, c"levels"),
        (limit > 0.0 && limit <= f32::MAX, c"angle_limit"),
        (exponents.iter().all(|exponent| (0.0..=8.0).contains(exponent)), c"exponents"),
    ])
    .map_err(|error| error.instead(2))?;
    let exponent = |i: usize| exponents.get(i).map_or(0.0, |&exponent| f64::from(exponent));
    let [width, height] = map.size;
    let config = Config {
        levels: if given.levels == 0 { 6 } else { given.levels },
        radiance_exponent: exponent(0),
        angle_exponent: exponent(1),
        angle_limit: if given.angle_limit == 0.0 { 0.01 } else { f64::from(limit) },
        ..Config::new(width, height, given.count)
    };
    if config.texels() >= u32::MAX as usize {
        return Err(Error::new(Status::Overflow, 1).of(c"height"));
    }
    Ok((config, map, rows))
}
