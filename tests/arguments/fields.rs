//! Which field of a struct, and which element of an array, a diagnostic names.

use super::block::Block;
use super::call::{Call, field};
use super::objects::function;
use super::scene::{Scene, numbers};
use std::ffi::{c_int, c_void};
use std::ptr::null;
use wis::ffi::Diagnostic;
use wis::ffi::check::CheckConfig;
use wis::ffi::light::*;
use wis::ffi::lights::JitterConfig;
use wis::ffi::lights::StrataConfig;
use wis::ffi::wavelets::tree::*;
use wis::status::Status;
use wis::wavelets::triple::Wavelets;

const INVALID: Status = Status::InvalidArgument;
const OVERFLOW: Status = Status::Overflow;
const TRANSFORM: Status = Status::InvalidTransform;
const MISALIGNED: Status = Status::Misaligned;
const NULL: Status = Status::NullPointer;
static SCALED: [f32; 10] = [2.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// The field that a diagnostic names, an edit that spoils it, and the status; no name where several fields overflow together.
pub type Fault<T> = (&'static str, fn(&mut T), Status);

/// Calls functions with an argument that is spoiled in one field after another. Calls with a sampler keep the diagnostic there.
/// Gives the diagnostics.
pub fn check<T: Copy>(functions: &[&str], argument: &str, faults: &[Fault<T>]) -> Vec<Diagnostic> {
    let (scene, mut told_all) = (Scene::new(), Vec::new());
    for function in functions.iter().map(|name| function(name)) {
        for (name, edit, status) in faults {
            let mut call = Call::valid(&scene, function);
            call.edit(argument, edit);
            let diagnostic = call.fails(name, *status, argument);
            let told = function.has("diagnostic");
            assert!(name.is_empty() || field(&diagnostic) == told.then_some(*name), "{}: {name}", function.name);
            told_all.push(diagnostic);
        }
    }
    told_all
}

#[test]
fn lights() {
    let faults: &[Fault<LightConfig>] = &[
        ("size", |c| c.size = 0, Status::InvalidStructSize),
        ("layout", |c| c.layout = 0, INVALID),
        ("layout", |c| c.layout = 9, INVALID),
        ("layout", |c| c.layout = u32::MAX, INVALID),
        ("format", |c| c.format = 0, INVALID),
        ("format", |c| c.format = 9, INVALID),
        ("format", |c| c.format = u32::MAX, INVALID),
        ("filter", |c| c.filter = 2, INVALID),
        ("filter", |c| c.filter = u32::MAX, INVALID),
        ("channels", |c| c.channels = 0, INVALID),
        ("channels", |c| c.channels = 2, INVALID),
        ("channels", |c| c.channels = u32::MAX, INVALID),
        ("flags", |c| c.flags = 1 << 20, INVALID),
        ("flags", |c| c.flags = u32::MAX, INVALID),
        (
            "flags",
            |c| (c.layout, c.width, c.height, c.flags) = (WIS_LAYOUT_CUBE, 1, 6, WIS_ENVIRONMENT_ROWS_AT_POLES),
            INVALID,
        ),
        ("width", |c| c.width = 0, INVALID),
        ("width", |c| (c.width, c.row_stride) = (32769, 0), Status::Overflow),
        ("height", |c| c.height = 0, INVALID),
        ("height", |c| c.height = 32769, Status::Overflow),
        ("height", |c| (c.layout, c.height) = (WIS_LAYOUT_CUBE, 7), INVALID),
        ("height", |c| (c.layout, c.width, c.height) = (WIS_LAYOUT_CUBE, 1 << 31, 0), INVALID),
        ("height", |c| (c.layout, c.width, c.height) = (WIS_LAYOUT_OCTAHEDRAL, 4, 8), INVALID),
        ("", |c| (c.width, c.height) = (u32::MAX, u32::MAX), OVERFLOW),
        ("error_budget", |c| c.error_budget = -1.0, INVALID),
        ("error_budget", |c| c.error_budget = -1e-30, INVALID),
        ("error_budget", |c| c.error_budget = 1.5, INVALID),
        ("error_budget", |c| c.error_budget = f32::NAN, INVALID),
        ("row_stride", |c| c.row_stride = 71, INVALID),
        ("row_stride", |c| c.row_stride = -71, INVALID),
        ("", |c| c.row_stride = isize::MAX - 3, OVERFLOW),
        ("", |c| c.row_stride = isize::MIN, OVERFLOW),
        ("row_stride", |c| c.row_stride = 74, MISALIGNED),
        ("row_stride", |c| (c.format, c.row_stride) = (WIS_FORMAT_F16, -37), MISALIGNED),
        ("pixels", |c| c.pixels = null(), NULL),
        ("pixels", |c| c.pixels = c.pixels.wrapping_byte_add(2), MISALIGNED),
        ("pixels", |c| (c.format, c.pixels) = (WIS_FORMAT_F16, c.pixels.wrapping_byte_add(1)), MISALIGNED),
        ("world_from_map", |c| c.world_from_map = SCALED.as_ptr(), TRANSFORM),
        ("world_from_map", |c| c.world_from_map = c.world_from_map.wrapping_byte_add(2), MISALIGNED),
    ];
    let of_maps: &[Fault<LightConfig>] = &[
        ("layout", |c| (c.layout, c.width) = (WIS_LAYOUT_OCTAHEDRAL, c.height), INVALID),
        ("flags", |c| c.flags = WIS_ENVIRONMENT_ROWS_AT_POLES, INVALID),
    ];
    for faults in [of_maps, faults] {
        check(&["wis_strata_size", "wis_strata_lights", "wis_jitter_size", "wis_jitter_init"], "map", faults);
    }
    let functions = ["size", "init", "begin", "run", "finish"].map(|name| format!("wis_environment_{name}"));
    check(&functions.each_ref().map(String::as_str), "config", faults);
}

#[test]
fn comparisons() {
    extern "C" fn negative(_: *mut c_void, _: usize, _: *const f32, rgb: *mut f32) -> c_int {
        // SAFETY: the library gives room for 64 colours.
        unsafe { rgb.add(4).write(-1.0) };
        0
    }
    extern "C" fn fails(_: *mut c_void, _: usize, _: *const f32, _: *mut f32) -> c_int {
        1
    }
    let faults: &[Fault<CheckConfig>] = &[
        ("size", |c| c.size = 0, Status::InvalidStructSize),
        ("reserved", |c| c.reserved = 1, INVALID),
        ("radiance", |c| c.radiance = None, NULL),
        ("radiance", |c| c.radiance = Some(negative), Status::CallbackFailed),
        ("radiance", |c| c.radiance = Some(fails), Status::CallbackFailed),
    ];
    let (scene, compare) = (Scene::new(), function("wis_check"));
    for (name, edit, status) in faults {
        let mut call = Call::valid(&scene, compare);
        call.edit("config", edit);
        call.fails(name, *status, "config");
    }
}

#[test]
fn trees() {
    let faults: &[Fault<TreeConfig>] = &[
        ("dimensions", |c| c.dimensions = 0, INVALID),
        ("dimensions", |c| c.dimensions = 1, INVALID),
        ("dimensions", |c| c.dimensions = 3, INVALID),
        ("dimensions", |c| c.dimensions = 5, INVALID),
        ("dimensions", |c| c.dimensions = u32::MAX, INVALID),
        ("depth", |c| c.depth = 13, INVALID),
        ("depth", |c| c.depth = u32::MAX, INVALID),
        ("depth", |c| (c.dimensions, c.depth) = (4, 12), OVERFLOW),
        ("error_budget", |c| c.error_budget = -1.0, INVALID),
        ("error_budget", |c| c.error_budget = f32::NAN, INVALID),
    ];
    check(&["wis_tree_size", "wis_tree_init"], "config", faults);
    let faults: &[Fault<TreeConfig>] = &[
        ("pixels", |c| c.pixels = null(), NULL),
        ("pixels", |c| c.pixels = c.pixels.wrapping_byte_add(2), MISALIGNED),
        ("pixels", |c| c.pixels = std::ptr::without_provenance(6), MISALIGNED),
        ("pixels", |c| (c.depth, c.pixels) = (0, [f32::NAN].as_ptr()), Status::InvalidTexel),
    ];
    check(&["wis_tree_init"], "config", faults);
}

#[test]
fn strata() {
    let faults: &[Fault<StrataConfig>] = &[
        ("levels", |c| c.levels = 65, INVALID),
        ("angle_limit", |c| c.angle_limit = -1.0, INVALID),
        ("exponents", |c| c.exponents = [9.0f32, 0.0].as_ptr(), INVALID),
    ];
    check(&["wis_strata_size", "wis_strata_lights"], "config", faults);
}

/// The number of the element at fault in an array of the batch calls.
#[test]
fn elements() {
    let scene = Scene::new();
    let row = |name: &str, argument: &str, content: &[u8], status: Status| {
        let function = function(name);
        let mut call = Call::valid(&scene, function);
        call.give(argument, Block::new(content, 0));
        let diagnostic = call.fails("an element", status, argument);
        assert_eq!(field(&diagnostic), None);
        (diagnostic.x, diagnostic.y)
    };
    let unordered =
        numbers(&[Wavelets { level: 1, ..Wavelets::default() }, Wavelets { level: 0, ..Wavelets::default() }]);
    for (name, argument) in
        [("wis_triple_sublinear", "brdf"), ("wis_triple_sublinear", "kept_light"), ("wis_visibility_integral", "brdf")]
    {
        assert_eq!(row(name, argument, &unordered, INVALID), (0, 1), "{name}");
    }
    let lists = Block::new(&unordered, 0);
    let valid = Call::valid(&scene, function("wis_triple_blend"));
    let mut handles: Vec<usize> = valid.bytes("list").chunks_exact(8).map(address).collect();
    handles[2] = lists.pointer() as usize;
    assert_eq!(row("wis_triple_blend", "list", &numbers(&handles), INVALID), (1, 2));
    assert_eq!(row("wis_triple_blend", "weight", &numbers(&[1.0, f64::NAN, 1.0]), INVALID), (0, 1));
    assert_eq!(row("wis_strata_order", "contribution", &numbers(&[1.0f32, 2.0, -1.0]), INVALID), (0, 2));
}

/// The field, and the number of the element at fault in a list that a struct points to.
#[test]
fn elements_of_fields() {
    static LABELS: [u32; 18] = {
        let mut labels = [0; 18];
        labels[1] = 2;
        labels
    };
    let labels: [Fault<JitterConfig>; 1] = [("label", |config| config.label = LABELS.as_ptr(), INVALID)];
    second(check(&["wis_jitter_init"], "config", &labels));
}

/// The second element is at fault in each.
fn second(diagnostics: Vec<Diagnostic>) {
    assert!(!diagnostics.is_empty());
    for diagnostic in diagnostics {
        assert_eq!((diagnostic.x, diagnostic.y), (0, 1));
    }
}

/// What stands in a struct of labels.
#[test]
fn lists() {
    let tables: [Fault<JitterConfig>; 5] = [
        ("size", |config| config.size = 0, Status::InvalidStructSize),
        ("distribution", |config| config.distribution = 2, INVALID),
        ("distribution", |config| config.distribution = 3, INVALID),
        ("distribution", |config| config.distribution = u32::MAX, INVALID),
        ("reserved", |config| config.reserved = 1, INVALID),
    ];
    check(&["wis_jitter_size", "wis_jitter_init"], "config", &tables);
    let labels: [Fault<JitterConfig>; 2] = [
        ("label", |config| config.label = null(), NULL),
        ("label", |config| config.label = config.label.wrapping_byte_add(1), MISALIGNED),
    ];
    check(&["wis_jitter_init"], "config", &labels);
}

fn address(bytes: &[u8]) -> usize {
    usize::from_ne_bytes(bytes.try_into().expect("as long as an address"))
}

/// A room that is too short tells the bytes that are needed.
#[test]
fn rooms() {
    let scene = Scene::new();
    for (name, result, bytes) in [
        ("wis_sparse_unpack", "wavelets", size_of::<Wavelets>()),
        ("wis_triple_blend", "wavelets", size_of::<Wavelets>()),
    ] {
        let mut call = Call::valid(&scene, function(name));
        call.set("room", 1);
        call.answer();
        let count = u32::from_ne_bytes(call.bytes("wavelet_count").try_into().expect("four bytes"));
        assert!(count > 1 && call.bytes(result).len() >= count as usize * bytes);
        assert_eq!(call.told().bytes_needed, u64::from(count) * bytes as u64, "{name}");
        assert_eq!(call.answer(), Status::MemoryTooSmall as usize);
    }
}
