//! Structured importance sampling in C: a map as directional lights.

use crate::ffi::light::LightConfig;
use crate::ffi::light::request::read_config;
use crate::ffi::light::rows::PixelRows;
use crate::ffi::{
    Checked, Diagnostic, ExclusiveBlock, Failure, MemorySize, WIS_ALIGNMENT, answer, out, sized, slice, slice_mut,
};
use crate::light::chart::Layout as Chart;
use crate::light::pixels::decode_row;
use crate::light::pixels::{Layout, Pixels, RowError, RowSummary, Rows};
use crate::lights::strata::{self, Ball, Config, GROUP, Gathered, Light, Scratch};
use crate::sphere::Frame;
use crate::status::{Fault, Status};
use core::ffi::c_void;
use glam::Vec3;

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
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let request = Request::read(map, config)?;
            let layout = Layouts::new(&request.config).ok_or(Failure::new(Status::Overflow, 1))?;
            let bytes = request.config.capacity() * size_of::<Light>();
            out(size, 3)?.write(MemorySize { bytes, align: WIS_ALIGNMENT, scratch_bytes: layout.bytes });
        }
        Ok(())
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
    answer(diagnostic, || {
        // SAFETY: the caller's contract; the parts of the scratch memory are apart.
        unsafe {
            let request = Request::read(map, config)?;
            let layout = Layouts::new(&request.config).ok_or(Failure::new(Status::Overflow, 1))?;
            let block = ExclusiveBlock::new(scratch.cast(), scratch_bytes, layout.bytes, 3)?;
            let lights = slice_mut(lights, request.config.capacity(), 5)?;
            let light_count = out(light_count, 6)?;
            let texels = request.config.texels();
            let label = if label.is_null() { &mut [] } else { slice_mut(label, texels, 7)? };
            light_count.write(run(&request, &layout, &block, lights, label)?);
        }
        Ok(())
    })
}

/// # Safety
/// The block is the caller's to write.
unsafe fn run(
    request: &Request,
    layout: &Layouts,
    block: &ExclusiveBlock,
    lights: &mut [Light],
    label: &mut [u32],
) -> Checked<u32> {
    let config = &request.config;
    let (texels, capacity) = (config.texels(), config.capacity());
    // SAFETY: the parts do not overlap, and each is as long as `Layouts` says.
    let (luminance, rgb, centres, gathered, mut scratch) = unsafe {
        (
            block.slice::<f64>(layout.luminance, 0, texels),
            block.slice::<[f32; 3]>(layout.rgb, 0, texels),
            block.slice::<u32>(layout.centres, 0, capacity),
            block.slice::<Gathered>(layout.gathered, 0, capacity),
            Scratch {
                rows: block.slice(layout.rows, 0, config.height as usize),
                columns: block.slice(layout.columns, 0, config.width as usize),
                component: block.slice(layout.component, 0, texels),
                members: block.slice(layout.members, 0, texels),
                distance: block.slice(layout.distance, 0, texels),
                start: block.slice(layout.start, 0, texels),
                balls: block.slice(layout.balls, 0, texels.div_ceil(GROUP) + 1),
                is_centre: block.slice(layout.is_centre, 0, texels),
            },
        )
    };
    decode(request, luminance, rgb)?;
    let count = strata::stratify(config, luminance, &mut scratch, centres).map_err(|s| Failure::new(s, 2))?;
    let centres = centres.get(..count).unwrap_or(&[]);
    let (gathered, written) =
        (gathered.get_mut(..count).unwrap_or(&mut []), lights.get_mut(..count).unwrap_or(&mut []));
    let to_world = |d: [f64; 3]| request.map.frame.to_world(Vec3::from_array(d.map(|c| c as f32))).to_array();
    let written = strata::gather(config, (luminance, rgb), &scratch, centres, gathered, to_world, written);
    written.map_err(|status| Failure::new(status, 1))?;
    for (slot, number) in label.iter_mut().zip(scratch.component.iter()) {
        *slot = if count == 0 { 0 } else { *number };
    }
    Ok(count as u32)
}

/// Reads all texels; +Inf becomes the largest finite luminance, in grey.
fn decode(request: &Request, luminance: &mut [f64], rgb: &mut [[f32; 3]]) -> Checked<()> {
    let Request { map, rows, .. } = request;
    let width = map.pixels.width.max(1) as usize;
    let mut largest = 0.0;
    for ((y, values), colours) in (0..).zip(luminance.chunks_exact_mut(width)).zip(rgb.chunks_exact_mut(width)) {
        let summary = map.decode(rows, y, values, colours)?;
        largest = if summary.largest > largest { summary.largest } else { largest };
    }
    for (value, colour) in luminance.iter_mut().zip(rgb) {
        if !(*value < f64::INFINITY) {
            (*value, *colour) = (largest, [largest as f32; 3]);
        }
    }
    Ok(())
}

/// Decodes the luminance of all texels as [`decode`] does.
pub(super) fn decode_luminance(map: &Map, rows: &PixelRows, luminance: &mut [f64]) -> Checked<()> {
    let width = map.pixels.width.max(1) as usize;
    let mut largest = 0.0;
    for (y, values) in (0..).zip(luminance.chunks_exact_mut(width)) {
        let summary = map.decode(rows, y, values, &mut [])?;
        largest = if summary.largest > largest { summary.largest } else { largest };
    }
    for value in luminance.iter_mut().filter(|value| !(**value < f64::INFINITY)) {
        *value = largest;
    }
    Ok(())
}

/// A lat-long map.
#[derive(Clone, Copy)]
pub(super) struct Map {
    pub(super) pixels: Pixels,
    pub(super) frame: Frame,
    sanitise: bool,
}

impl Map {
    /// Decodes a row; `rgb` may be empty.
    fn decode(&self, rows: &PixelRows, y: u32, luminance: &mut [f64], rgb: &mut [[f32; 3]]) -> Checked<RowSummary> {
        let decoded = rows.row(y).ok_or(RowError::Missing);
        let decoded = decoded.and_then(|bytes| decode_row(&self.pixels, bytes, y, self.sanitise, luminance, rgb));
        decoded.map_err(|error| refused(&error, y))
    }
}

/// Checks the configuration of a lat-long map, the first argument.
///
/// # Safety
/// The pointer is null or points to what the header says.
pub(super) unsafe fn read_map(map: *const LightConfig) -> Checked<(Map, PixelRows)> {
    // SAFETY: the caller's contract.
    let (request, rows) = unsafe { read_config(map)? };
    let of = &request.plan.of;
    for (holds, field) in [(of.layout == Chart::LatLong, c"layout"), (!of.rows_at_poles, c"flags")] {
        if !holds {
            return Err(Failure::fault(Fault::range(field), 1));
        }
    }
    let pixels = Pixels {
        layout: Layout::LatLong,
        width: of.width,
        height: of.height,
        channels: request.pixels.channels,
        format: request.pixels.format,
    };
    Ok((Map { pixels, frame: request.frame, sanitise: request.pixels.sanitise }, rows))
}

/// A row that was refused.
fn refused(error: &RowError, y: u32) -> Failure {
    match error {
        RowError::Missing => Failure::at(error.status(), 1, 0, y).of(c"row"),
        RowError::Texel(texel) => Failure::at(error.status(), 1, texel.x, texel.y).of(c"pixels"),
    }
}

/// A map and a config that were checked.
struct Request {
    map: Map,
    rows: PixelRows,
    config: Config,
}

impl Request {
    /// # Safety
    /// The pointers are null or point to what the header says.
    unsafe fn read(map: *const LightConfig, config: *const StrataConfig) -> Checked<Request> {
        // SAFETY: the caller's contract.
        let (map, rows, given, exponents) = unsafe {
            let (map, rows) = read_map(map)?;
            let given = sized(config, 2)?;
            let exponents = if given.exponents.is_null() {
                &[1.0, 0.25]
            } else {
                slice(given.exponents, 2, 2).map_err(|at| at.of(c"exponents"))?
            };
            (map, rows, given, exponents)
        };
        let limit = if given.angle_limit == 0.0 { 0.01 } else { given.angle_limit };
        let allowed = exponents.iter().all(|exponent| (0.0..=8.0).contains(exponent));
        for (holds, field) in [
            (given.levels <= 64, c"levels"),
            (limit > 0.0 && limit <= f32::MAX, c"angle_limit"),
            (allowed, c"exponents"),
        ] {
            if !holds {
                return Err(Failure::fault(Fault::range(field), 2));
            }
        }
        let exponent = |i: usize| exponents.get(i).map_or(0.0, |&exponent| f64::from(exponent));
        let (width, height) = (map.pixels.width, map.pixels.height);
        let config = Config {
            levels: if given.levels == 0 { 6 } else { given.levels },
            radiance_exponent: exponent(0),
            angle_exponent: exponent(1),
            angle_limit: if given.angle_limit == 0.0 { 0.01 } else { f64::from(limit) },
            ..Config::new(width, height, given.count)
        };
        if config.texels() >= u32::MAX as usize {
            return Err(Failure::new(Status::Overflow, 1).of(c"height"));
        }
        Ok(Request { map, rows, config })
    }
}

/// Where the parts of the scratch memory stand.
struct Layouts {
    luminance: usize,
    distance: usize,
    rows: usize,
    columns: usize,
    balls: usize,
    gathered: usize,
    rgb: usize,
    component: usize,
    members: usize,
    start: usize,
    centres: usize,
    is_centre: usize,
    bytes: usize,
}

impl Layouts {
    fn new(config: &Config) -> Option<Layouts> {
        let (texels, capacity) = (config.texels(), config.capacity());
        let mut end = 0usize;
        let mut part = |count: usize, size: usize| {
            let start = end;
            end = count.checked_mul(size)?.checked_add(end)?.checked_next_multiple_of(WIS_ALIGNMENT)?;
            Some(start)
        };
        Some(Layouts {
            luminance: part(texels, size_of::<f64>())?,
            distance: part(texels, size_of::<f64>())?,
            rows: part(config.height as usize, size_of::<[f64; 3]>())?,
            columns: part(config.width as usize, size_of::<[f64; 2]>())?,
            balls: part(texels.div_ceil(GROUP) + 1, size_of::<Ball>())?,
            gathered: part(capacity, size_of::<Gathered>())?,
            rgb: part(texels, size_of::<[f32; 3]>())?,
            component: part(texels, size_of::<u32>())?,
            members: part(texels, size_of::<u32>())?,
            start: part(texels, size_of::<u32>())?,
            centres: part(capacity, size_of::<u32>())?,
            is_centre: part(texels, 1)?,
            bytes: part(0, 1)?,
        })
    }
}
