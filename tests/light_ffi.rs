//! The environment in C: one thread or many, every source of pixels, every policy, stored bytes.

use crate::support::{Memory, light_config};
use std::ffi::{CStr, c_void};
use std::ptr::{null, null_mut};
use wis::ffi::check::{CheckConfig, wis_check};
use wis::ffi::light::*;
use wis::ffi::product::{GridConfig, wis_product_prepare};
use wis::ffi::sampler::{SamplerConfig, wis_sampler_fault, wis_sampler_init};
use wis::ffi::sampling::{wis_invert, wis_pdf, wis_sample};
use wis::ffi::{Diagnostic, MemorySize};
use wis::light::chart::Layout;
use wis::light::environment::Environment;
use wis::light::pixels::{Format, Pixels};
use wis::light::plan::{Description, Filter, Plan};
use wis::sample::Sample;
use wis::sphere::Frame;
use wis::status::Status;

const QUARTER_TURN: [f32; 9] = [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
const MIRROR: [f32; 9] = [-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

fn config(layout: u32, width: u32, height: u32, pixels: &[f32]) -> LightConfig {
    light_config(layout, [width, height], pixels)
}

/// Texels that 16-bit floats represent, one of them a lamp.
fn texels(count: u32) -> Vec<f32> {
    (0..count).map(|i| if i == count / 3 { 4096.0 } else { 0.125 * (i * i % 61) as f32 }).collect()
}

fn size(config: &LightConfig) -> MemorySize {
    let mut size = MemorySize::default();
    // SAFETY: all pointers are valid.
    assert_eq!(unsafe { wis_environment_size(config, &mut size, null_mut()) }, Status::Ok);
    size
}

fn info_of(bytes: &[u8]) -> LightInfo {
    let mut memory = Memory::copy(bytes);
    let mut info = LightInfo { size: size_of::<LightInfo>() as u32, ..LightInfo::default() };
    // SAFETY: the memory holds an environment.
    assert_eq!(unsafe { wis_environment_describe(memory.pointer().cast(), &mut info) }, Status::Ok);
    info
}

/// The bytes of an environment that one call built, or the status and where the fault is.
fn try_build(config: &LightConfig) -> Result<Vec<u8>, (Status, Diagnostic)> {
    let size = size(config);
    let (mut memory, mut scratch) = (Memory::filled(size.bytes, 0xa5), Memory::filled(size.scratch_bytes, 0x5a));
    let (mut handle, mut diagnostic) = (null(), Diagnostic::default());
    let place = memory.pointer();
    // SAFETY: the blocks are as long as stated.
    let status = unsafe {
        let (work, bytes) = (scratch.pointer(), size.scratch_bytes);
        wis_environment_init(config, place, size.bytes, work, bytes, &mut handle, &mut diagnostic)
    };
    if status != Status::Ok {
        assert_eq!(handle, null());
        return Err((status, diagnostic));
    }
    assert_eq!(handle, place.cast_const().cast());
    let used = info_of(memory.bytes()).bytes as usize;
    Ok(memory.bytes()[..used].to_vec())
}

fn build(config: &LightConfig) -> Vec<u8> {
    try_build(config).unwrap_or_else(|(status, _)| panic!("{status:?}"))
}

/// What threads share: the pointers of a build.
#[derive(Clone, Copy)]
struct Shared {
    config: *const LightConfig,
    memory: *mut c_void,
    scratch: *mut c_void,
    size: MemorySize,
}

// SAFETY: calls on different items may be made at once.
unsafe impl Send for Shared {}

impl Shared {
    /// The items of each pass.
    fn begin(self) -> [u32; WIS_ENVIRONMENT_PASSES as usize] {
        let Shared { config, scratch, size, .. } = self;
        let mut items = [0; WIS_ENVIRONMENT_PASSES as usize];
        // SAFETY: all pointers are valid.
        let begun = unsafe { wis_environment_begin(config, scratch, size.scratch_bytes, &mut items, null_mut()) };
        assert_eq!(begun, Status::Ok);
        items
    }

    fn finish(self) -> Status {
        let (Shared { config, memory, scratch, size }, mut handle) = (self, null());
        let (bytes, scratch_bytes) = (size.bytes, size.scratch_bytes);
        // SAFETY: all pointers are valid.
        unsafe { wis_environment_finish(config, memory, bytes, scratch, scratch_bytes, &mut handle, null_mut()) }
    }

    fn run(self, pass: u32, first: u32, count: u32) -> Status {
        let Shared { config, memory, scratch, size } = self;
        let (bytes, scratch_bytes) = (size.bytes, size.scratch_bytes);
        // SAFETY: the blocks outlive the threads.
        unsafe { wis_environment_run(config, memory, bytes, scratch, scratch_bytes, pass, first, count, null_mut()) }
    }
}

/// The bytes of an environment that threads built, each with items of its own.
fn build_shared(config: &LightConfig, threads: u32) -> Vec<u8> {
    let size = size(config);
    let (mut memory, mut scratch) = (Memory::filled(size.bytes, 0), Memory::filled(size.scratch_bytes, 0xff));
    let shared = Shared { config, memory: memory.pointer(), scratch: scratch.pointer(), size };
    for (pass, count) in (0..).zip(shared.begin()) {
        std::thread::scope(|scope| {
            for thread in 0..threads {
                scope.spawn(move || {
                    let shared = shared;
                    // Portions of 3 items, dealt in turns, the last ones first.
                    let portions: Vec<u32> = (0..count.div_ceil(3)).filter(|p| p % threads == thread).collect();
                    for portion in portions.into_iter().rev() {
                        let (first, end) = (3 * portion, (3 * portion + 3).min(count));
                        assert_eq!(shared.run(pass, first, end - first), Status::Ok);
                    }
                });
            }
        });
    }
    assert_eq!(shared.finish(), Status::Ok);
    let used = info_of(memory.bytes()).bytes as usize;
    memory.bytes()[..used].to_vec()
}

/// Maps of every layout with every filter, flag and an error budget.
fn for_each_config(mut test: impl FnMut(&str, LightConfig)) {
    let maps = [
        (WIS_LAYOUT_LATLONG, 1, 1),
        (WIS_LAYOUT_LATLONG, 33, 17),
        (WIS_LAYOUT_LATLONG, 70, 36),
        (WIS_LAYOUT_CUBE, 1, 6),
        (WIS_LAYOUT_CUBE, 20, 120),
        (WIS_LAYOUT_OCTAHEDRAL, 3, 3),
        (WIS_LAYOUT_OCTAHEDRAL, 40, 40),
    ];
    for (layout, width, height) in maps {
        let pixels = texels(width * height * 3);
        for filter in [WIS_FILTER_BILINEAR, WIS_FILTER_NEAREST] {
            let flags: &[u32] = match layout {
                WIS_LAYOUT_LATLONG => &[
                    0,
                    WIS_ENVIRONMENT_ROWS_AT_POLES,
                    WIS_ENVIRONMENT_COMPENSATED,
                    WIS_ENVIRONMENT_LIGHT_ONLY,
                    WIS_ENVIRONMENT_RAYS_ONLY,
                ],
                _ => &[0, WIS_ENVIRONMENT_EXACT_ZERO, WIS_ENVIRONMENT_RAYS_ONLY | WIS_ENVIRONMENT_COMPENSATED],
            };
            for &flags in flags {
                for error_budget in [0.0, 0.2] {
                    let of = config(layout, width, height, &pixels);
                    let of = LightConfig { filter, flags, error_budget, ..of };
                    let name = format!("layout {layout}, {width} x {height}, {filter}, {flags}, {error_budget}");
                    test(&name, of);
                }
            }
        }
    }
}

#[test]
fn threads_write_the_bytes_of_one_call() {
    for_each_config(|name, config| {
        let expected = build(&config);
        for threads in [1, 2, 5, 8, 16] {
            assert!(build_shared(&config, threads) == expected, "{name}: {threads} threads");
        }
    });
}

/// What C builds is what Rust builds, and what the size query says.
#[test]
fn the_same_bytes_as_in_rust() {
    for_each_config(|name, config| {
        let description = Description {
            layout: match config.layout {
                WIS_LAYOUT_LATLONG => Layout::LatLong,
                WIS_LAYOUT_CUBE => Layout::Cube,
                _ => Layout::Octahedral,
            },
            width: config.width,
            height: config.height,
            filter: if config.filter == WIS_FILTER_NEAREST { Filter::Nearest } else { Filter::Bilinear },
            rows_at_poles: config.flags & WIS_ENVIRONMENT_ROWS_AT_POLES != 0,
            exact_zero: config.flags & WIS_ENVIRONMENT_EXACT_ZERO != 0,
            compensated: config.flags & WIS_ENVIRONMENT_COMPENSATED != 0,
            light_only: config.flags & WIS_ENVIRONMENT_LIGHT_ONLY != 0,
            rays_only: config.flags & WIS_ENVIRONMENT_RAYS_ONLY != 0,
            budget: config.error_budget,
        };
        let plan = Plan::new(&description).unwrap();
        let pixels = Pixels { channels: config.channels, format: Format::F32, sanitise: false, absolute: false };
        let row_bytes = (4 * config.channels * config.width) as usize;
        let row = |y: u32| {
            let start = config.pixels.cast::<u8>().wrapping_add(y as usize * row_bytes);
            // SAFETY: the map has that row.
            Some(unsafe { std::slice::from_raw_parts(start, row_bytes) })
        };
        let needed = plan.size().unwrap();
        let (mut memory, mut scratch) = (Memory::filled(needed.bytes, 1), Memory::filled(needed.scratch, 2));
        let (block, work) = (memory.bytes_mut(), scratch.bytes_mut());
        let built = Environment::build_in(&plan, &pixels, &Frame::IDENTITY, &row, block, work).unwrap();
        assert!(built.as_bytes() == build(&config), "{name}");
        assert_eq!(size(&config).bytes, needed.bytes);
        if config.error_budget == 0.0 {
            let light = built.light();
            let missing = wis::light::strata::most(&light.chart) - light.strata.len();
            assert_eq!(built.as_bytes().len() + 16 * missing, needed.bytes, "{name}");
        }
    });
}

/// The nearest 16-bit float of a number that one represents.
fn half(value: f32) -> u16 {
    let bits = value.to_bits();
    let exponent = (bits >> 23 & 255) as i32 - 112;
    assert!(bits >> 31 == 0 && bits & 0x1fff == 0 && (value == 0.0 || (1..31).contains(&exponent)), "{value}");
    if value == 0.0 { 0 } else { (exponent as u16) << 10 | (bits >> 13 & 1023) as u16 }
}

#[test]
fn halves_are_the_floats_that_they_are() {
    for_each_config(|name, config| {
        let count = (config.width * config.height * config.channels) as usize;
        // SAFETY: the map has that many floats.
        let floats = unsafe { std::slice::from_raw_parts(config.pixels.cast::<f32>(), count) };
        let halves: Vec<u16> = floats.iter().map(|&f| half(f)).collect();
        // At an odd multiple of two bytes.
        let shifted: Vec<u16> = [0].into_iter().chain(halves).collect();
        let of_halves = LightConfig { format: WIS_FORMAT_F16, pixels: shifted[1..].as_ptr().cast(), ..config };
        assert!(build(&of_halves) == build(&config), "{name}");
    });
}

/// Rows of a callback, of which `missing` fails.
struct Supply {
    rows: Vec<Vec<u8>>,
    missing: u32,
}

unsafe extern "C" fn supply(user: *mut c_void, y: u32) -> *const c_void {
    // SAFETY: `user` is the supply.
    let supply = unsafe { &*user.cast::<Supply>() };
    if y == supply.missing {
        return null();
    }
    // Behind one byte, where nothing is aligned.
    supply.rows[y as usize][1..].as_ptr().cast()
}

#[test]
fn rows_of_a_callback() {
    let pixels = texels(33 * 17 * 4);
    let array = config(WIS_LAYOUT_LATLONG, 33, 17, &pixels);
    let rows = pixels.chunks_exact(33 * 4).map(|row| {
        let bytes = row.iter().flat_map(|f| f.to_ne_bytes());
        [0].into_iter().chain(bytes).collect()
    });
    let mut supplied = Supply { rows: rows.collect(), missing: u32::MAX };
    for missing in [u32::MAX, 0, 9, 16] {
        supplied.missing = missing;
        let user = (&raw mut supplied).cast();
        let called = LightConfig { pixels: null(), row: Some(supply), row_user: user, ..array };
        if missing == u32::MAX {
            assert!(build(&called) == build(&array));
            continue;
        }
        let (status, at) = try_build(&called).unwrap_err();
        assert_eq!((status, at.argument, at.x, at.y), (Status::CallbackFailed, 1, 0, missing));
        assert_eq!(field(&at), "row");
    }
}

fn field(diagnostic: &Diagnostic) -> &str {
    assert!(!diagnostic.field.is_null());
    // SAFETY: the library gives a static string.
    unsafe { CStr::from_ptr(diagnostic.field) }.to_str().unwrap()
}

#[test]
fn strides_of_rows() {
    let pixels = texels(20 * 12 * 3);
    let packed = config(WIS_LAYOUT_LATLONG, 20, 12, &pixels);
    let expected = build(&packed);
    for (stride, start) in [(60isize, 0usize), (60, 5), (61, 1), (100, 3), (-60, 660), (-77, 900)] {
        let mut spread = vec![f32::NAN; 2048];
        for (y, row) in (0isize..).zip(pixels.chunks_exact(60)) {
            let at = (start as isize + y * stride) as usize;
            spread[at..at + 60].copy_from_slice(row);
        }
        let strided = LightConfig { pixels: spread[start..].as_ptr().cast(), row_stride: 4 * stride, ..packed };
        assert!(build(&strided) == expected, "stride {stride}");
    }
}

/// Texels that are not finite: rejected and named, or replaced and counted.
#[test]
fn bad_texels() {
    let plain = texels(20 * 12 * 3);
    for (value, replacement) in [(f32::NAN, 0.0), (f32::NEG_INFINITY, 0.0), (f32::INFINITY, 65504.0)] {
        for (x, y, channel) in PLACES {
            let [pixels, replaced] = [value, replacement].map(|value| with(&plain, (x, y, channel), value));
            let of = config(WIS_LAYOUT_LATLONG, 20, 12, &pixels);
            let (status, at) = try_build(&of).unwrap_err();
            assert_eq!((status, at.argument), (Status::InvalidTexel, 1));
            assert_eq!((at.x as usize, at.y as usize, field(&at)), (x, y, "pixels"));
            let sanitised = info_of(&build(&LightConfig { flags: WIS_ENVIRONMENT_SANITISE, ..of }));
            let expected = info_of(&build(&config(WIS_LAYOUT_LATLONG, 20, 12, &replaced)));
            assert_eq!((sanitised.sanitised, expected.sanitised), (1, 0));
            assert_eq!((sanitised.power, sanitised.mean), (expected.power, expected.mean));
            assert_eq!(sanitised.largest_share, expected.largest_share);
        }
    }
    assert!(Status::InvalidTexel.message().to_str().unwrap().contains("SANITISE"));
}

/// Resamplers leave negative channels: they are 0 as a clamped look-up has them, or their size, and counted.
#[test]
fn negative_texels() {
    let plain = texels(20 * 12 * 3);
    for value in [-1.0, -0.004, -f32::MIN_POSITIVE] {
        for place in PLACES {
            let pixels = with(&plain, place, value);
            for (flags, replacement) in [(0, 0.0), (WIS_ENVIRONMENT_ABSOLUTE, value.abs())] {
                let of = config(WIS_LAYOUT_LATLONG, 20, 12, &pixels);
                let built = info_of(&build(&LightConfig { flags, ..of }));
                let replaced = with(&plain, place, replacement);
                let expected = info_of(&build(&config(WIS_LAYOUT_LATLONG, 20, 12, &replaced)));
                assert_eq!((built.sanitised, expected.sanitised), (1, 0));
                assert_eq!((built.power, built.mean, built.flags), (expected.power, expected.mean, 0));
            }
        }
    }
}

/// A sun that overflowed in half floats is as bright as the largest of them, whatever else is in the map.
#[test]
fn an_infinite_sun_of_half_floats() {
    const QUARTER: u16 = 0x3400;
    let share = |sun: u16| {
        let mut halves = vec![QUARTER; 64 * 32];
        halves[9 * 64 + 40] = sun;
        let mut of = config(WIS_LAYOUT_LATLONG, 64, 32, &[]);
        (of.channels, of.format, of.pixels) = (1, WIS_FORMAT_F16, halves.as_ptr().cast());
        of.flags = WIS_ENVIRONMENT_SANITISE;
        let info = info_of(&build(&of));
        (info.mean, info.largest_share)
    };
    assert_eq!(share(0x7c00), share(0x7bff));
    assert!(share(0x7c00).1 > 0.99);
}

const PLACES: [(usize, usize, usize); 4] = [(0, 0, 0), (19, 0, 2), (7, 5, 1), (19, 11, 2)];

/// A map of 20 columns in which a channel of a texel is `value`.
fn with(pixels: &[f32], (x, y, channel): (usize, usize, usize), value: f32) -> Vec<f32> {
    let mut pixels = pixels.to_vec();
    pixels[(y * 20 + x) * 3 + channel] = value;
    pixels
}

/// The largest floats are light like any other, also where texels are averaged beyond borders of faces.
#[test]
fn large_texels() {
    for (layout, width, height) in
        [(WIS_LAYOUT_LATLONG, 21, 12), (WIS_LAYOUT_CUBE, 9, 54), (WIS_LAYOUT_OCTAHEDRAL, 9, 9)]
    {
        let mut lone = vec![0.0f32; (width * height * 3) as usize];
        // The luminance of three finite channels is finite.
        lone[30..33].copy_from_slice(&[f32::MAX, f32::MAX, f32::MAX * 0.999_999_9]);
        for (pixels, share) in [(lone, 0.999), (vec![f32::MAX; (width * height * 3) as usize], 0.001)] {
            let stored = build(&config(layout, width, height, &pixels));
            let info = info_of(&stored);
            assert!(info.power.is_finite() && info.power > 1e36 && info.largest_share > share, "{info:?}");
            assert!(open(&mut Memory::copy(&stored), stored.len()).is_ok());
        }
    }
}

#[test]
fn alpha_is_ignored() {
    let build_with = |alpha: f32| {
        let pixels: Vec<f32> = (0..33 * 17).flat_map(|i| [1.0 + i as f32, 2.0, 0.5, alpha]).collect();
        build(&config(WIS_LAYOUT_LATLONG, 33, 17, &pixels))
    };
    let expected = build_with(1.0);
    assert!([f32::NAN, f32::INFINITY, -1.0].into_iter().all(|alpha| build_with(alpha) == expected));
}

/// A light that is turned is the light that was built turned, to the byte.
#[test]
fn turned_lights() {
    let pixels = texels(33 * 17);
    let plain = config(WIS_LAYOUT_LATLONG, 33, 17, &pixels);
    let upright = build(&plain);
    let mut memory = Memory::copy(&upright);
    let mut ids = vec![info_of(&upright).content_id];
    for matrix in [QUARTER_TURN, MIRROR] {
        let mut handle = null();
        let place = memory.pointer();
        // SAFETY: the memory holds an environment.
        let status = unsafe { wis_environment_turn(place, upright.len(), &matrix, &mut handle, null_mut()) };
        assert_eq!((status, handle), (Status::Ok, place.cast_const().cast()));
        let built = build(&LightConfig { world_from_map: matrix.as_ptr(), ..plain });
        assert!(memory.bytes() == built);
        assert!(Environment::open(memory.bytes()).is_ok());
        ids.push(info_of(memory.bytes()).content_id);
    }
    assert!(ids[0] != ids[1] && ids[1] != ids[2] && ids[0] != ids[2]);
    let before = memory.bytes().to_vec();
    for (bytes, matrix, expected, argument) in [
        (upright.len(), [2.0; 9], Status::InvalidTransform, 3),
        (upright.len() - 1, MIRROR, Status::MemoryTooSmall, 1),
        (8, MIRROR, Status::MemoryTooSmall, 1),
    ] {
        let (mut handle, mut at) = (null(), Diagnostic::default());
        // SAFETY: the memory is longer than stated.
        let status = unsafe { wis_environment_turn(memory.pointer(), bytes, &matrix, &mut handle, &mut at) };
        assert_eq!((status, at.argument, handle), (expected, argument, null()));
        assert!(memory.bytes() == before);
    }
    let mut handle = null();
    // SAFETY: a null matrix is the identity.
    let status = unsafe { wis_environment_turn(memory.pointer(), before.len(), null(), &mut handle, null_mut()) };
    assert_eq!(status, Status::Ok);
    assert!(memory.bytes() == upright);
}

fn open(memory: &mut Memory, bytes: usize) -> Result<(), (Status, Diagnostic)> {
    let (mut handle, mut at) = (null(), Diagnostic::default());
    let place = memory.pointer();
    // SAFETY: the memory is as long as stated.
    let status = unsafe { wis_environment_open(place, bytes, &mut handle, &mut at) };
    assert_eq!(handle, if status == Status::Ok { place.cast_const().cast() } else { null() });
    if status == Status::Ok { Ok(()) } else { Err((status, at)) }
}

/// Copies open anywhere; a byte that changed is found wherever it is, and so is one that is missing.
#[test]
fn stored_bytes() {
    for_each_config(|name, config| {
        let stored = build(&config);
        let mut copy = Memory::copy(&stored);
        assert!(open(&mut copy, stored.len()).is_ok(), "{name}");
        let mut longer = Memory::copy(&[&stored[..], &[0xff; 100]].concat());
        assert!(open(&mut longer, stored.len() + 100).is_ok(), "{name}");
        let step = (stored.len() / 40).max(1);
        for place in (0..512.min(stored.len())).chain((0..stored.len()).step_by(step)) {
            let mut copy = Memory::copy(&stored);
            copy.bytes_mut()[place] ^= 1 << (place % 8);
            let (status, at) = open(&mut copy, stored.len()).unwrap_err();
            // A length may also ask for more bytes than there are.
            assert!(matches!(status, Status::Corrupt | Status::MemoryTooSmall), "{name}: byte {place}: {status:?}");
            assert_eq!(at.argument, 1);
        }
        let (status, at) = open(&mut copy, stored.len() - 1).unwrap_err();
        assert_eq!((status, at.bytes_needed), (Status::MemoryTooSmall, stored.len() as u64), "{name}");
    });
}

/// With a budget the bytes are known after the second pass, but for the strata: a block that is too short can be replaced.
#[test]
fn short_memory() {
    let smooth: Vec<f32> = (0..256 * 128).map(|i| 1.0 + (i / 256) as f32 / 128.0).collect();
    let flags = WIS_ENVIRONMENT_LIGHT_ONLY;
    let config = LightConfig { error_budget: 0.01, flags, ..config(WIS_LAYOUT_LATLONG, 256, 128, &smooth) };
    let expected = build(&config);
    let most = size(&config);
    assert!(expected.len() <= 24 << 10 && expected.len() < most.bytes / 4, "{} of {}", expected.len(), most.bytes);
    let mut scratch = Memory::filled(most.scratch_bytes, 0);
    let (mut handle, mut at) = (null(), Diagnostic::default());
    let mut short = Memory::filled(64, 0xa5);
    let (place, work) = (short.pointer(), scratch.pointer());
    let items = Shared { config: &config, memory: place, scratch: work, size: most }.begin();
    // SAFETY: the blocks are as long as stated.
    let status = unsafe { wis_environment_init(&config, place, 64, work, most.scratch_bytes, &mut handle, &mut at) };
    let needed = at.bytes_needed as usize;
    assert_eq!((status, at.argument), (Status::MemoryTooSmall, 2));
    assert!(expected.len() <= needed && needed <= expected.len() + 16 * wis::light::strata::MOST);
    assert!(short.bytes().iter().all(|&byte| byte == 0xa5));
    let mut memory = Memory::filled(needed, 0xa5);
    let size = MemorySize { bytes: needed, ..most };
    let shared = Shared { config: &config, memory: memory.pointer(), scratch: work, size };
    for (pass, count) in (0..).zip(items).skip(2) {
        assert_eq!(shared.run(pass, 0, count), Status::Ok);
    }
    assert_eq!(shared.finish(), Status::Ok);
    assert!(memory.bytes()[..expected.len()] == expected);
}

/// A sampler keeps tables: where a light takes the place of another one, it reads the new ones, as a new sampler does.
#[test]
fn a_light_in_the_place_of_another() {
    // As long as each other: the content id alone tells them apart.
    let lights = [[16, 16], [16, 41]]
        .map(|[width, height]| build(&config(WIS_LAYOUT_LATLONG, width, height, &texels(width * height))));
    assert_eq!(lights[0].len(), lights[1].len());
    let settings = SamplerConfig { size: size_of::<SamplerConfig>() as u32, rays: 1, ..SamplerConfig::default() };
    let (mut place, mut sampler) = (Memory::new(lights[0].len() + lights[1].len()), Memory::new(1 << 16));
    let mut last = |order: &[usize]| {
        let (mut handle, mut drawn, u) = (null_mut(), Sample::default(), [0.3f32, 0.7]);
        // SAFETY: all pointers are valid.
        unsafe {
            let status = wis_sampler_init(&settings, sampler.pointer(), 1 << 16, &mut handle, null_mut());
            assert_eq!(status, Status::Ok);
            for &light in order {
                place.bytes_mut()[..lights[light].len()].copy_from_slice(&lights[light]);
                let environment = place.pointer().cast_const().cast();
                assert_eq!(wis_sample(handle, environment, null(), 1, u.as_ptr(), 0, &mut drawn, 0), Status::Ok);
            }
        }
        drawn
    };
    assert_eq!(last(&[0, 1]), last(&[1]));
    assert_eq!(last(&[1, 0]), last(&[0]));
}

/// What reads exact tables says that they were not built, and where.
#[test]
fn rays_alone() {
    let pixels = texels(33 * 17);
    let flags = WIS_ENVIRONMENT_RAYS_ONLY | WIS_ENVIRONMENT_COMPENSATED;
    let mut memory = Memory::copy(&build(&LightConfig { flags, ..config(WIS_LAYOUT_LATLONG, 33, 17, &pixels) }));
    assert_eq!(info_of(memory.bytes()).flags, flags);
    let mut sampler = Memory::filled(1 << 16, 0);
    let settings = SamplerConfig { size: size_of::<SamplerConfig>() as u32, rays: 1, ..SamplerConfig::default() };
    let environment = memory.pointer().cast_const().cast();
    let (u, wi) = ([0.5f32; 2], [0.0f32, 0.0, 1.0]);
    let (mut drawn, mut pdf, mut back, mut statuses) = (Sample::default(), -1.0f32, [-1.0f32; 2], [9u8]);
    let prepared = GridConfig { size: size_of::<GridConfig>() as u32, ..GridConfig::default() };
    let seen =
        CheckConfig { size: size_of::<CheckConfig>() as u32, reserved: 0, radiance: None, radiance_user: null_mut() };
    let mut handle = null_mut();
    // SAFETY: all pointers are valid.
    unsafe {
        let status = wis_sampler_init(&settings, sampler.pointer(), 1 << 16, &mut handle, null_mut());
        assert_eq!(status, Status::Ok);
        let refused = |status| {
            let mut at = Diagnostic::default();
            assert_eq!(wis_sampler_fault(handle, &mut at), Status::Ok);
            assert_eq!((status, at.argument, field(&at)), (Status::NotBuilt, 2, "flags"));
        };
        refused(wis_sample(handle, environment, null(), 1, u.as_ptr(), 0, &mut drawn, 0));
        refused(wis_pdf(handle, environment, null(), 1, wi.as_ptr(), 0, &mut pdf, 0));
        let (u, told) = (back.as_mut_ptr(), statuses.as_mut_ptr());
        refused(wis_invert(handle, environment, null(), 1, wi.as_ptr(), 0, u, 0, told));
        refused(wis_check(handle, environment, &seen, null_mut()));
        let (memory, offset, used) = (null_mut(), null_mut(), null_mut());
        refused(wis_product_prepare(handle, environment, &prepared, 1, null(), memory, 0, offset, used));
    }
    assert_eq!((pdf, back, statuses), (-1.0, [-1.0; 2], [9]));
}

/// A map in which the strata have several parts: each is finished by a thread of its own.
#[test]
fn threads_share_strata() {
    let pixels: Vec<f32> = (0..512 * 256).map(|i: u32| 0.125 + (i.wrapping_mul(0x9e37_79b9) >> 24) as f32).collect();
    let config = config(WIS_LAYOUT_LATLONG, 512, 256, &pixels);
    let size = size(&config);
    let mut scratch = Memory::filled(size.scratch_bytes, 0);
    let items = Shared { config: &config, memory: null_mut(), scratch: scratch.pointer(), size }.begin();
    assert!(items[5] > 2, "{items:?}");
    let expected = build(&config);
    for threads in [1, 2, 5] {
        assert!(build_shared(&config, threads) == expected, "{threads} threads");
    }
    let memory = Memory::copy(&expected);
    let environment = Environment::open(memory.bytes()).expect("strata tile the map");
    assert_eq!(environment.light().strata.len(), wis::light::strata::MOST, "a number that parts finish");
}

/// A pass waits for all items of those before it, and takes only its own items.
#[test]
fn passes_in_order() {
    let pixels = texels(33 * 17);
    let config = config(WIS_LAYOUT_LATLONG, 33, 17, &pixels);
    let size = size(&config);
    let (mut memory, mut scratch) = (Memory::filled(size.bytes, 0), Memory::filled(size.scratch_bytes, 0xa5));
    let shared = Shared { config: &config, memory: memory.pointer(), scratch: scratch.pointer(), size };
    assert_eq!(shared.run(0, 0, 1), Status::Mismatch);
    let items = shared.begin();
    assert_eq!(items, [17, 128, 128, 17, 1, 1]);
    for (pass, count) in (0..).zip(items) {
        for (first, more) in [(count + 1, 0), (u32::MAX, 1), (0, count + 1), (count, 1)] {
            assert_eq!(shared.run(pass, first, more), Status::InvalidArgument);
        }
        assert_eq!(shared.run(pass, count, 0), Status::Ok);
        assert_eq!(shared.run(pass, 1, count - 1), Status::Ok);
        if pass + 1 < WIS_ENVIRONMENT_PASSES {
            assert_eq!(shared.run(pass + 1, 0, 1), Status::Mismatch);
        }
        assert_eq!(shared.finish(), Status::Mismatch);
        assert_eq!(shared.run(pass, 0, 1), Status::Ok);
    }
    assert_eq!(shared.run(WIS_ENVIRONMENT_PASSES, 0, 0), Status::InvalidArgument);
    assert_eq!(shared.finish(), Status::Ok);
    let expected = build(&config);
    assert!(memory.bytes()[..expected.len()] == expected);
}

/// Another configuration than that of wis_environment_begin is a mismatch.
#[test]
fn changed_configurations() {
    let pixels = texels(12 * 12 * 3);
    let config = config(WIS_LAYOUT_LATLONG, 12, 12, &pixels);
    let size = size(&config);
    let mut scratch = Memory::filled(2 * size.scratch_bytes, 0);
    let mut memory = Memory::filled(2 * size.bytes, 0);
    let work = scratch.pointer();
    Shared { config: &config, memory: memory.pointer(), scratch: work, size }.begin();
    let changes: [fn(&mut LightConfig); 9] = [
        |c| c.layout = WIS_LAYOUT_OCTAHEDRAL,
        |c| c.width = 11,
        |c| c.height = 11,
        |c| c.channels = 1,
        |c| c.format = WIS_FORMAT_F16,
        |c| c.filter = WIS_FILTER_NEAREST,
        |c| c.flags = WIS_ENVIRONMENT_SANITISE,
        |c| c.error_budget = 0.5,
        |c| c.world_from_map = MIRROR.as_ptr(),
    ];
    for (number, change) in changes.into_iter().enumerate() {
        let mut changed = config;
        change(&mut changed);
        let size = MemorySize { bytes: 2 * size.bytes, scratch_bytes: 2 * size.scratch_bytes, ..size };
        let shared = Shared { config: &changed, memory: memory.pointer(), scratch: work, size };
        assert_eq!(shared.run(0, 0, 1), Status::Mismatch, "change {number}");
    }
}

#[test]
fn what_was_built() {
    let pixels = vec![2.0f32; 40 * 20];
    let info = info_of(&build(&LightConfig {
        filter: WIS_FILTER_NEAREST,
        flags: WIS_ENVIRONMENT_EXACT_ZERO | WIS_ENVIRONMENT_SANITISE,
        ..config(WIS_LAYOUT_LATLONG, 40, 20, &pixels)
    }));
    assert_eq!((info.layout, info.width, info.height), (WIS_LAYOUT_LATLONG, 40, 20));
    assert_eq!((info.filter, info.flags), (WIS_FILTER_NEAREST, WIS_ENVIRONMENT_EXACT_ZERO));
    assert_eq!((info.sanitised, info.error), (0, 0.0));
    let sphere = 4.0 * std::f64::consts::PI;
    assert!((info.power / (2.0 * sphere) - 1.0).abs() < 1e-6, "{}", info.power);
    assert!((info.mean - 2.0).abs() < 1e-6, "{}", info.mean);
    // A texel at the equator of 20 rows.
    let share = (std::f64::consts::PI / 20.0).sin() / (2.0 * 40.0);
    assert!((info.largest_share / share - 1.0).abs() < 1e-6, "{}", info.largest_share);

    let black = info_of(&build(&config(WIS_LAYOUT_CUBE, 2, 12, &[0.0; 24])));
    assert_eq!((black.power, black.mean, black.largest_share), (0.0, 0.0, 0.0));
}
