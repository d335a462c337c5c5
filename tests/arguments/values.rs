//! Values out of range in structs, matrices, directions, random numbers and what callbacks return.

use super::block::Block;
use super::call::Call;
use super::header::{Function, functions};
use super::objects::{self, function};
use super::scene::{Scene, numbers};
use std::ffi::{c_int, c_void};
use std::ptr::null;
use wis::ffi::light::*;
use wis::ffi::lights::jitter::*;
use wis::ffi::wavelets::environment::*;
use wis::ffi::wavelets::product::*;
use wis::ffi::wavelets::tree::TreeConfig;
use wis::status::Status;
use wis::wavelets::query::*;

const INVALID: Status = Status::InvalidArgument;
const OVERFLOW: Status = Status::Overflow;
const TRANSFORM: Status = Status::InvalidTransform;

/// Every function that has a parameter of this declaration.
fn taking(declaration: &str) -> Vec<Function> {
    let taking: Vec<_> = functions().into_iter().filter(|function| function.takes(declaration)).collect();
    assert!(!taking.is_empty(), "{declaration}");
    taking
}

/// A name, an edit that spoils a struct, and what every function that takes the struct answers.
type Fault<T> = (&'static str, fn(&mut T), Status);

fn check_faults<T: Copy>(declaration: &str, faults: &[Fault<T>]) {
    let scene = Scene::new();
    let name = declaration.rsplit('*').next().unwrap();
    for function in taking(declaration) {
        for (fault, edit, status) in faults {
            let mut call = Call::valid(&scene, &function);
            call.edit(name, edit);
            let diagnostic = call.fails(fault, *status, name);
            // An overflow may be that of all fields together.
            let told = function.takes("wis_diagnostic *diagnostic") && *status != OVERFLOW;
            assert!(!told || !diagnostic.field.is_null(), "{}: {fault}: no field", function.name);
        }
    }
}

#[test]
fn environment_configurations() {
    let faults: &[Fault<EnvironmentConfig>] = &[
        ("layout 0", |c| c.layout = 0, INVALID),
        ("layout 4", |c| c.layout = 4, INVALID),
        ("layout max", |c| c.layout = u32::MAX, INVALID),
        ("format 0", |c| c.format = 0, INVALID),
        ("format 3", |c| c.format = 3, INVALID),
        ("format max", |c| c.format = u32::MAX, INVALID),
        ("storage 0", |c| c.storage = 0, INVALID),
        ("storage 3", |c| c.storage = 3, INVALID),
        ("storage max", |c| c.storage = u32::MAX, INVALID),
        ("channels 0", |c| c.channels = 0, INVALID),
        ("channels 2", |c| c.channels = 2, INVALID),
        ("channels 5", |c| c.channels = 5, INVALID),
        ("channels max", |c| c.channels = u32::MAX, INVALID),
        ("flag 16", |c| c.flags |= 16, INVALID),
        ("all flags", |c| c.flags = u32::MAX, INVALID),
        ("width 0", |c| c.width = 0, INVALID),
        ("height 0", |c| c.height = 0, INVALID),
        ("a cube of 5 faces", |c| (c.layout, c.width, c.height) = (WIS_LAYOUT_CUBE, 2, 10), INVALID),
        ("a cube beyond 2^32", |c| (c.layout, c.width, c.height) = (WIS_LAYOUT_CUBE, 1 << 31, 0), INVALID),
        ("an oblong square", |c| (c.layout, c.width, c.height) = (WIS_LAYOUT_OCTAHEDRAL, 4, 8), INVALID),
        ("resolution 3", |c| c.resolution = 3, INVALID),
        ("resolution 4095", |c| c.resolution = 4095, INVALID),
        ("resolution 8192", |c| c.resolution = 8192, INVALID),
        ("resolution 2^31", |c| c.resolution = 1 << 31, INVALID),
        ("resolution max", |c| c.resolution = u32::MAX, INVALID),
        ("budget < 0", |c| c.error_budget = -1e-30, INVALID),
        ("budget NaN", |c| c.error_budget = f32::NAN, INVALID),
        ("budget Inf", |c| c.error_budget = f32::INFINITY, INVALID),
        ("rows that overlap", |c| c.row_stride = 71, INVALID),
        ("rows that overlap backwards", |c| c.row_stride = -71, INVALID),
        ("rows beyond memory", |c| c.row_stride = isize::MAX - 3, OVERFLOW),
        ("rows before memory", |c| c.row_stride = isize::MIN, OVERFLOW),
        ("4 billion squared", |c| (c.width, c.height) = (u32::MAX, u32::MAX), OVERFLOW),
        ("2^60 texels", |c| (c.width, c.height) = (1 << 30, 1 << 30), OVERFLOW),
        ("scratch of 2^63 bytes", |c| (c.width, c.height, c.channels, c.format) = (1 << 30, 1 << 30, 1, 2), OVERFLOW),
        ("no pixels", |c| c.pixels = null(), Status::NullPointer),
    ];
    check_faults("const wis_wavelet_light_config *config", faults);
}

#[test]
fn light_configurations() {
    let faults: &[Fault<LightConfig>] = &[
        ("layout 0", |c| c.layout = 0, INVALID),
        ("layout max", |c| c.layout = u32::MAX, INVALID),
        ("format 0", |c| c.format = 0, INVALID),
        ("format max", |c| c.format = u32::MAX, INVALID),
        ("filter max", |c| c.filter = u32::MAX, INVALID),
        ("channels 0", |c| c.channels = 0, INVALID),
        ("channels max", |c| c.channels = u32::MAX, INVALID),
        ("all flags", |c| c.flags = u32::MAX, INVALID),
        ("a cube beyond 2^32", |c| (c.layout, c.width, c.height) = (WIS_LAYOUT_CUBE, 1 << 31, 0), INVALID),
        ("an oblong square", |c| (c.layout, c.width, c.height) = (WIS_LAYOUT_OCTAHEDRAL, 4, 8), INVALID),
        ("budget < 0", |c| c.error_budget = -1e-30, INVALID),
        ("budget > 1", |c| c.error_budget = 1.5, INVALID),
        ("budget NaN", |c| c.error_budget = f32::NAN, INVALID),
        ("rows that overlap", |c| c.row_stride = 71, INVALID),
        ("rows that overlap backwards", |c| c.row_stride = -71, INVALID),
        ("rows beyond memory", |c| c.row_stride = isize::MAX - 3, OVERFLOW),
        ("rows before memory", |c| c.row_stride = isize::MIN, OVERFLOW),
        ("4 billion squared", |c| (c.width, c.height) = (u32::MAX, u32::MAX), OVERFLOW),
        ("no pixels", |c| c.pixels = null(), Status::NullPointer),
    ];
    check_faults("const wis_environment_config *config", faults);
}

#[test]
fn tree_configurations() {
    const UNALIGNED: *const f32 = std::ptr::without_provenance(6);
    let faults: &[Fault<TreeConfig>] = &[
        ("no axes", |c| c.dimensions = 0, INVALID),
        ("5 axes", |c| c.dimensions = 5, INVALID),
        ("axes max", |c| c.dimensions = u32::MAX, INVALID),
        ("depth 13", |c| c.depth = 13, INVALID),
        ("depth max", |c| c.depth = u32::MAX, INVALID),
        ("2^48 pixels", |c| (c.dimensions, c.depth) = (4, 12), OVERFLOW),
        ("budget < 0", |c| c.error_budget = -1.0, INVALID),
        ("budget NaN", |c| c.error_budget = f32::NAN, INVALID),
    ];
    check_faults("const wis_tree_config *config", faults);
    let scene = Scene::new();
    let init = function("wis_tree_init");
    for (pixels, status) in [(null(), Status::NullPointer), (UNALIGNED, Status::Misaligned)] {
        let mut call = Call::valid(&scene, &init);
        call.edit("config", |c: &mut TreeConfig| c.pixels = pixels);
        call.fails("pixels", status, "config");
    }
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0] {
        for pixel in [0, 7, 15] {
            let mut image = [1.0f32; 16];
            image[pixel] = bad;
            let mut call = Call::valid(&scene, &init);
            call.edit("config", |c: &mut TreeConfig| c.pixels = image.as_ptr());
            let diagnostic = call.fails("a pixel", Status::InvalidTexel, "config");
            assert_eq!((diagnostic.x as usize, diagnostic.y as usize), (pixel % 4, pixel / 4));
        }
    }
}

#[test]
fn product_configurations() {
    static UNALIGNED: [f32; 10] = [0.0; 10];
    let faults: &[Fault<ProductConfig>] = &[
        ("4097 squares", |c| c.max_squares = WIS_MAX_SQUARES + 1, INVALID),
        ("squares max", |c| c.max_squares = u32::MAX, INVALID),
        ("reserved", |c| c.reserved = 1, INVALID),
        ("a matrix at an odd address", |c| c.world_from_map = UNALIGNED.as_ptr().wrapping_byte_add(2), {
            Status::Misaligned
        }),
    ];
    check_faults("const wis_wavelet_product_config *config", faults);
}

/// A matrix that scales or shears is refused where the configuration is first seen, not at the first hit.
#[test]
fn product_matrices() {
    static SCALED: [f32; 9] = [2.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0];
    static SHEARED: [f32; 9] = [1.0, 0.1, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    static UNKNOWN: [f32; 9] = [f32::NAN; 9];
    let faults: &[Fault<ProductConfig>] = &[
        ("scale", |c| c.world_from_map = SCALED.as_ptr(), TRANSFORM),
        ("shear", |c| c.world_from_map = SHEARED.as_ptr(), TRANSFORM),
        ("NaN", |c| c.world_from_map = UNKNOWN.as_ptr(), TRANSFORM),
    ];
    assert!(
        taking("const wis_wavelet_product_config *config")
            .iter()
            .any(|function| function.name == "wis_wavelet_product_size")
    );
    check_faults("const wis_wavelet_product_config *config", faults);
}

#[test]
fn queries() {
    fn lambert(lobe: &mut Lobe) {
        lobe.kind = WIS_WAVELET_LOBE_LAMBERT;
    }
    let faults: &[Fault<Query>] = &[
        ("flag 4", |q| q.flags = 4, INVALID),
        ("all flags", |q| q.flags = u32::MAX, INVALID),
        ("5 lobes", |q| q.lobe_count = 5, INVALID),
        ("lobes max", |q| q.lobe_count = u32::MAX, INVALID),
        ("kind 0", |q| q.lobe[1].kind = 0, INVALID),
        ("kind 5", |q| q.lobe[1].kind = 5, INVALID),
        ("kind max", |q| q.lobe[2].kind = u32::MAX, INVALID),
        ("weight NaN", |q| q.lobe[0].weight[0] = f32::NAN, INVALID),
        ("weight < 0", |q| q.lobe[1].weight[2] = -1.0, INVALID),
        ("weight Inf", |q| q.lobe[2].weight[1] = f32::INFINITY, INVALID),
        ("f0 NaN", |q| q.lobe[1].f0[0] = f32::NAN, INVALID),
        ("f0 < 0", |q| q.lobe[1].f0[1] = -0.1, INVALID),
        ("f0 > 1", |q| q.lobe[1].f0[2] = 1.1, INVALID),
        ("alpha 0", |q| q.lobe[1].a = 0.0, INVALID),
        ("alpha 0 along the bitangent", |q| q.lobe[1].b = 0.0, INVALID),
        ("alpha < 0", |q| q.lobe[1].a = -0.5, INVALID),
        ("alpha NaN", |q| q.lobe[1].b = f32::NAN, INVALID),
        ("alpha Inf", |q| q.lobe[1].a = f32::INFINITY, INVALID),
        ("alpha 9e-6", |q| (q.lobe[1].a, q.lobe[1].b) = (9e-6, 9e-6), INVALID),
        ("alpha 17", |q| (q.lobe[1].a, q.lobe[1].b) = (17.0, 17.0), INVALID),
        ("exponent < 0", |q| q.lobe[2].a = -1.0, INVALID),
        ("exponent NaN", |q| q.lobe[2].a = f32::NAN, INVALID),
        ("exponent Inf", |q| q.lobe[2].a = f32::INFINITY, INVALID),
        ("exponent 2e7", |q| q.lobe[2].a = 2e7, INVALID),
        ("normal NaN", |q| q.normal[1] = f32::NAN, TRANSFORM),
        ("normal Inf", |q| q.normal[1] = f32::INFINITY, TRANSFORM),
        ("normal 0", |q| q.normal = [0.0; 3], TRANSFORM),
        ("normal of 1.0011", |q| q.normal = [0.0, 0.0, 1.0011], TRANSFORM),
        ("normal of 1e30", |q| q.normal = [0.0, 0.0, 1e30], TRANSFORM),
        ("wo NaN", |q| q.wo[0] = f32::NAN, TRANSFORM),
        ("wo Inf", |q| q.wo[2] = f32::NEG_INFINITY, TRANSFORM),
        ("wo 0", |q| q.wo = [0.0; 3], TRANSFORM),
        ("wo of 0.9989", |q| q.wo = [0.0, 0.0, 0.9989], TRANSFORM),
        ("tangent NaN", |q| q.tangent[0] = f32::NAN, TRANSFORM),
        ("tangent Inf", |q| q.tangent[0] = f32::INFINITY, TRANSFORM),
        ("no tangent, though one is needed", |q| (q.lobe[1].b, q.tangent) = (0.5, [0.0; 3]), TRANSFORM),
        ("tangent along the normal, though one is needed", |q| (q.lobe[1].b, q.tangent) = (0.5, q.normal), TRANSFORM),
    ];
    check_faults("const wis_wavelet_query *query", faults);
    let accepted: &[fn(&mut Query)] = &[
        |q| q.lobe_count = 0,
        |q| q.flags = WIS_WAVELET_QUERY_WHOLE_SPHERE | WIS_WAVELET_QUERY_COSINE_INCLUDED,
        |q| (q.normal, q.wo) = (q.normal.map(|c| c * 1.001), q.wo.map(|c| c * 0.999)),
        |q| q.wo = [0.0, 0.6, -0.8],
        |q| (q.lobe[1].a, q.lobe[1].b, q.tangent) = (1e-5, 16.0, [1.0, 0.0, 0.5]),
        |q| (q.lobe[1].f0, q.lobe[2].a) = ([0.0, -0.0, 1.0], 1e7),
        |q| (q.lobe[3].kind, q.lobe[3].a, q.lobe[3].weight) = (99, f32::NAN, [f32::NAN; 3]),
        |q| {
            lambert(&mut q.lobe[2]);
            (q.lobe[2].a, q.lobe[2].b, q.lobe[2].f0) = (f32::NAN, -1.0, [f32::INFINITY; 3]);
        },
        |q| q.lobe.iter_mut().for_each(|lobe| lobe.weight = [0.0; 3]),
        |q| q.lobe.iter_mut().for_each(|lobe| lobe.weight = [f32::MAX; 3]),
    ];
    let scene = Scene::new();
    for function in taking("const wis_wavelet_query *query") {
        for (number, edit) in accepted.iter().enumerate() {
            let mut call = Call::valid(&scene, &function);
            call.edit("query", edit);
            call.succeeds(&format!("query {number}"));
        }
    }
}

#[test]
fn callback_brdfs() {
    let faults: &[Fault<CallbackBrdf>] = &[
        ("no function", |b| b.eval = None, Status::NullPointer),
        ("half-angle < 0", |b| b.half_angle = -0.1, INVALID),
        ("half-angle NaN", |b| b.half_angle = f32::NAN, INVALID),
        ("half-angle Inf", |b| b.half_angle = f32::INFINITY, INVALID),
        ("half-angle 1.6", |b| b.half_angle = 1.6, INVALID),
        ("peak NaN", |b| b.peak[2] = f32::NAN, TRANSFORM),
        ("peak 0", |b| b.peak = [0.0; 3], TRANSFORM),
        ("peak Inf", |b| b.peak[1] = f32::INFINITY, TRANSFORM),
        ("refuses", |b| b.eval = Some(refuses), Status::CallbackFailed),
        ("gives NaN", |b| b.eval = Some(gives_nan), Status::CallbackFailed),
        ("gives Inf", |b| b.eval = Some(gives_infinity), Status::CallbackFailed),
        ("gives less than 0", |b| b.eval = Some(gives_negative), Status::CallbackFailed),
        ("refuses later", |b| b.eval = Some(refuses_late), Status::CallbackFailed),
    ];
    let of_queries: &[Fault<Query>] = &[
        ("flag 2", |q| q.flags = WIS_WAVELET_QUERY_COSINE_INCLUDED, INVALID),
        ("flag 4", |q| q.flags = 4, INVALID),
        ("all flags", |q| q.flags = u32::MAX, INVALID),
        ("normal NaN", |q| q.normal[0] = f32::NAN, TRANSFORM),
        ("normal 0", |q| q.normal = [0.0; 3], TRANSFORM),
        ("normal of 2", |q| q.normal = [0.0, 2.0, 0.0], TRANSFORM),
    ];
    let accepted: &[fn(&mut CallbackBrdf)] = &[
        |b| (b.half_angle, b.peak) = (0.0, [f32::NAN; 3]),
        |b| b.half_angle = std::f32::consts::FRAC_PI_2,
        |b| b.half_angle = 1e-30,
    ];
    let scene = Scene::new();
    let prepare = function("wis_wavelet_product_prepare");
    let with = |callback: &Block| {
        let mut call = Call::valid(&scene, &prepare);
        call.edit("config", |c: &mut ProductConfig| c.callback = callback.pointer().cast_const().cast());
        call
    };
    for (fault, edit, status) in faults {
        let mut callback = Block::new(&scene.callback, 0);
        callback.edit(edit);
        let diagnostic = with(&callback).fails(fault, *status, "config");
        assert!(!diagnostic.field.is_null(), "{fault}");
    }
    for (fault, edit, status) in of_queries {
        let mut call = with(&scene.callback);
        call.edit("query", edit);
        assert!(!call.fails(fault, *status, "query").field.is_null(), "{fault}");
    }
    for edit in accepted {
        let mut callback = Block::new(&scene.callback, 0);
        callback.edit(edit);
        with(&callback).succeeds("a callback");
    }
    let mut call = with(&scene.callback);
    call.edit("query", |q: &mut Query| (q.flags, q.lobe_count) = (WIS_WAVELET_QUERY_WHOLE_SPHERE, 99));
    call.succeeds("lobes do not count");
}

/// Fills every result with a value, and answers.
fn fill(count: usize, f_cos: *mut f32, value: f32, answer: c_int) -> c_int {
    for i in 0..count {
        // SAFETY: the library gives room for `count` results.
        unsafe { f_cos.add(i).write(value) };
    }
    answer
}

extern "C" fn refuses(_: *mut c_void, count: usize, _: *const f32, f_cos: *mut f32) -> c_int {
    fill(count, f_cos, 1.0, -1)
}

extern "C" fn gives_nan(_: *mut c_void, count: usize, _: *const f32, f_cos: *mut f32) -> c_int {
    fill(count, f_cos, f32::NAN, 0)
}

extern "C" fn gives_infinity(_: *mut c_void, count: usize, _: *const f32, f_cos: *mut f32) -> c_int {
    fill(count, f_cos, f32::INFINITY, 0)
}

extern "C" fn gives_negative(_: *mut c_void, count: usize, _: *const f32, f_cos: *mut f32) -> c_int {
    fill(count, f_cos, -f32::MIN_POSITIVE, 0)
}

/// Fails at the first batch that is not the base of the refinement.
extern "C" fn refuses_late(_: *mut c_void, count: usize, wi: *const f32, f_cos: *mut f32) -> c_int {
    fill(count, f_cos, 0.0, 0);
    // SAFETY: the library gives `count` directions.
    let z = |i: usize| unsafe { wi.add(3 * i + 2).read() };
    for i in 0..count {
        // SAFETY: the library gives room for `count` results.
        unsafe { f_cos.add(i).write(z(i).max(0.0).powi(40)) };
    }
    c_int::from(count % 5 == 0)
}

/// Matrices that turn or mirror, and those that do not.
#[test]
fn matrices() {
    let turned = [0.8f32, -0.6, 0.0, 0.6, 0.8, 0.0, 0.0, 0.0, 1.0];
    let mirrored = [-1.0f32, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let change = |index: usize, value: f32| {
        let mut matrix = mirrored.map(f32::abs);
        matrix[index] = value;
        matrix
    };
    let accepted = [turned, mirrored, turned.map(|m| -m), turned.map(|m| m * 1.00004), change(1, 9e-5)];
    let rejected = [
        [0.0; 9],
        [1.0; 9],
        [f32::NAN; 9],
        [f32::INFINITY; 9],
        [1e30; 9],
        change(8, 0.0),
        change(1, 2e-4),
        change(5, f32::NAN),
        change(6, f32::NEG_INFINITY),
        turned.map(|m| m * 1.0001),
        turned.map(|m| m * 0.5),
        turned.map(|m| m * 2.0),
    ];
    check_matrices(&accepted, None);
    check_matrices(&rejected, Some(TRANSFORM));
}

fn check_matrices(matrices: &[[f32; 9]], failure: Option<Status>) {
    let scene = Scene::new();
    for matrix in matrices {
        for function in taking("const float world_from_map[9]") {
            let mut call = Call::valid(&scene, &function);
            call.give("world_from_map", Block::new(&numbers(matrix), 0));
            check(&mut call, matrix, failure, "world_from_map");
        }
        for function in taking("const wis_wavelet_product_config *config") {
            let mut call = Call::valid(&scene, &function);
            call.edit("config", |c: &mut ProductConfig| c.world_from_map = matrix.as_ptr());
            check(&mut call, matrix, failure, "config");
        }
    }
}

fn check(call: &mut Call, matrix: &[f32; 9], failure: Option<Status>, at_fault: &str) {
    match failure {
        Some(status) => {
            call.fails(&format!("{matrix:?}"), status, at_fault);
        }
        None => call.succeeds(&format!("{matrix:?}")),
    }
}

const NO_DIRECTIONS: [[f32; 3]; 8] = [
    [0.0; 3],
    [f32::NAN, 0.0, 1.0],
    [0.0, f32::INFINITY, 0.0],
    [f32::NEG_INFINITY; 3],
    [0.0, 0.0, 1.0011],
    [0.0, -0.9989, 0.0],
    [1e30, 0.0, 0.0],
    [1e-30, 0.0, 0.0],
];

/// A direction that is none: the calls for one say so, the calls for many give 0 for it.
#[test]
fn directions() {
    let scene = Scene::new();
    for direction in NO_DIRECTIONS {
        for function in taking("const float wi[3]") {
            let mut call = Call::valid(&scene, &function);
            call.give("wi", Block::new(&numbers(&direction), 0));
            call.fails(&format!("{direction:?}"), TRANSFORM, "wi");
        }
        // A pool finds a place for anything, a cache leaves it out, and an inversion has a status for each.
        let many = taking("const float *wi").into_iter();
        for function in many.filter(|f| {
            !["wis_pool_pick", "wis_visibility_cache_record", "wis_invert", "wis_wavelet_invert"]
                .contains(&f.name.as_str())
        }) {
            let results = ["pdf", "f_cos", "weight"];
            let result = results.into_iter().find(|name| function.takes(&format!("float *{name}"))).unwrap();
            let valid = Call::valid(&scene, &function);
            valid.succeeds("valid");
            let mut call = Call::valid(&scene, &function);
            let mut directions = valid.floats("wi");
            directions[3..6].copy_from_slice(&direction);
            call.give("wi", Block::new(&numbers(&directions), 0));
            call.succeeds("a direction that is none");
            let mut expected = valid.floats(result);
            let width = expected.len() / 3;
            expected[width..2 * width].fill(0.0);
            assert_eq!(call.floats(result), expected, "{}", function.name);
        }
    }
}

/// A direction of nearly unit length counts as that of unit length.
#[test]
fn nearly_unit_directions() {
    let scene = Scene::new();
    for function in taking("const float wi[3]") {
        let result = ["pdf", "weights", "u"].into_iter().find(|name| function.parameter(name).is_some()).unwrap();
        let unit = Call::valid(&scene, &function);
        unit.succeeds("unit");
        for factor in [0.999, 1.001] {
            let mut call = Call::valid(&scene, &function);
            let scaled: Vec<f32> = unit.floats("wi").iter().map(|c| c * factor).collect();
            call.give("wi", Block::new(&numbers(&scaled), 0));
            call.succeeds("nearly unit");
            for (scaled, unit) in call.floats(result).iter().zip(unit.floats(result)) {
                assert!((scaled - unit).abs() <= 1e-4 * unit.abs(), "{}: {scaled} {unit}", function.name);
            }
        }
    }
}

/// Random numbers outside of [0, 1) count as the nearest inside, NaN as 1/2.
#[test]
fn random_numbers() {
    let last = 1.0 - f32::EPSILON / 2.0;
    let moved = [
        (f32::NAN, 0.5),
        (-f32::NAN, 0.5),
        (1.0, last),
        (1e30, last),
        (f32::INFINITY, last),
        (-0.0, 0.0),
        (-1e-45, 0.0),
        (-7.0, 0.0),
        (f32::NEG_INFINITY, 0.0),
    ];
    let scene = Scene::new();
    for function in functions().iter().filter(|f| f.takes("const float u[2]") || f.takes("const float *u")) {
        for (outside, inside) in moved {
            let run = |number: f32| {
                let mut call = Call::valid(&scene, function);
                let mut u = call.floats("u");
                u[1] = number;
                call.give("u", Block::new(&numbers(&u), 0));
                call.succeeds("u");
                let results = function.parameters.iter().filter(|p| p.is_result());
                results.flat_map(|p| call.bytes(&p.name).to_vec()).collect::<Vec<u8>>()
            };
            assert_eq!(run(outside), run(inside), "{}: {outside}", function.name);
        }
    }
}

#[test]
fn distributions() {
    let faults: &[Fault<JitterConfig>] = &[
        ("distribution 2", |c| c.distribution = 2, INVALID),
        ("distribution 3", |c| c.distribution = 3, INVALID),
        ("distribution max", |c| c.distribution = u32::MAX, INVALID),
    ];
    check_faults("const wis_jitter_config *config", faults);
    let scene = Scene::new();
    for function in taking("const wis_jitter_config *config") {
        for distribution in [WIS_JITTER_UNIFORM, WIS_JITTER_ENERGY] {
            let mut call = Call::valid(&scene, &function);
            call.edit("config", |config: &mut JitterConfig| config.distribution = distribution);
            call.succeeds("either distribution");
        }
    }
}

/// Every rule works, and no other number is one.
#[test]
fn rules() {
    let scene = Scene::new();
    for function in taking("uint32_t rule") {
        for rule in [0, 1] {
            let mut call = Call::valid(&scene, &function);
            call.set("rule", rule);
            call.succeeds(&format!("rule {rule}"));
        }
        for rule in [2, 3, u32::MAX as usize] {
            let mut call = Call::valid(&scene, &function);
            call.set("rule", rule);
            call.fails(&format!("rule {rule}"), INVALID, "rule");
        }
    }
}

/// Sizes that do not fit each other, or the grid.
#[test]
fn grids_and_points() {
    let scene = Scene::new();
    for function in taking("double *values") {
        for direction in [0, 1] {
            let mut call = Call::valid(&scene, &function);
            call.set("direction", direction);
            call.succeeds("a direction");
        }
        for (name, numbers) in [
            ("direction", [2, 3, 255]),
            ("dimensions", [0, 5, 255]),
            ("depth", [13, 32, 255]),
            ("count", [0, 15, usize::MAX]),
        ] {
            for number in numbers {
                let mut call = Call::valid(&scene, &function);
                call.set(name, number);
                call.fails(&format!("{name} {number}"), INVALID, name);
            }
        }
    }
    for (name, first, count, total, status) in [
        ("wis_points_hammersley", 6, 3, 8, INVALID),
        ("wis_points_hammersley", 0xffff_ffff, 3, 8, INVALID),
        ("wis_points_hammersley", 0, 1, 0, INVALID),
        ("wis_points_sobol", 0xffff_fffe, 3, 0, OVERFLOW),
        ("wis_points_sobol", 0, (1 << 32) + 1, 0, OVERFLOW),
    ] {
        let function = function(name);
        let mut call = Call::valid(&scene, &function);
        call.set_all(&[("first", first), ("count", count)]);
        if function.parameter("total").is_some() {
            call.set("total", total);
        }
        call.fails("points", status, "count");
    }
}

/// A product answers only with the environment that it was prepared with.
#[test]
fn other_environments() {
    let scene = Scene::new();
    for function in taking("const wis_wavelet_product *product") {
        let mut call = Call::valid(&scene, &function);
        call.give("environment", Block::new(&objects::plain_environment(&scene), 0));
        call.fails("another environment", Status::Mismatch, "product");
    }
}

/// RGB needs an environment with RGB and a product of a query.
#[test]
fn estimates_without_rgb() {
    let scene = Scene::new();
    for function in taking("double rgb[3]") {
        let plain = objects::plain_environment(&scene);
        for (environment, product) in [
            (plain.as_slice(), objects::product(&scene, &plain)),
            (scene.environment(), objects::callback_product(&scene, scene.environment())),
        ] {
            let mut call = Call::valid(&scene, &function);
            call.give("environment", Block::new(environment, 0));
            call.give("product", Block::new(&product, 0));
            call.fails("no RGB", Status::NotBuilt, "product");
        }
    }
}

/// A black map is an environment; nothing leads anywhere in it.
#[test]
fn black() {
    let scene = Scene::new();
    let black = objects::black_environment(&scene);
    for function in taking("const wis_wavelet_light *environment") {
        let mut call = Call::valid(&scene, &function);
        call.give("environment", Block::new(&black, 0));
        if function.takes("const wis_wavelet_product *product") {
            call.give("product", Block::new(&objects::product(&scene, &black), 0));
        }
        call.succeeds("black");
        if function.name.ends_with("_invert") {
            assert!(call.bytes("status").iter().all(|&status| status == Status::ZeroDensity as u8));
        }
        if function.parameter("drawn").is_some() {
            assert!(call.floats("drawn").chunks_exact(4).all(|drawn| drawn[3] == 0.0));
        }
        let is_zero = function.parameter("pdf").is_none_or(|_| call.bytes("pdf").iter().all(|&byte| byte == 0));
        assert!(is_zero, "{}", function.name);
    }
}

/// Without a product the calls work on the light, under its matrix.
#[test]
fn the_light_alone() {
    let scene = Scene::new();
    for (name, result) in [("wis_wavelet_sample", "drawn"), ("wis_wavelet_pdf", "pdf"), ("wis_wavelet_invert", "u")] {
        let function = function(name);
        let results = [false, true].map(|alone| {
            let mut call = Call::valid(&scene, &function);
            if alone {
                call.set("product", 0);
            }
            call.succeeds("the light or a product");
            call.bytes(result).to_vec()
        });
        assert_ne!(results[0], results[1], "{name}");
    }
}

#[test]
fn trees() {
    let scene = Scene::new();
    let cube = objects::tree(&scene, |config| (config.dimensions, config.depth) = (3, 1));
    let integral = function("wis_tree_product_integral");
    let mut call = Call::valid(&scene, &integral);
    call.give("f", Block::new(&cube, 0));
    call.fails("more axes than the other", INVALID, "f");
    call.give("e", Block::new(&cube, 0));
    call.succeeds("as many axes");

    let zeros = [0.0f32; 16];
    let black = objects::tree(&scene, |config| config.pixels = zeros.as_ptr());
    for function in taking("const wis_tree *tree") {
        let mut call = Call::valid(&scene, &function);
        call.give("tree", Block::new(&black, 0));
        match function.name.as_str() {
            "wis_tree_invert" | "wis_warp_in_place" => {
                call.fails("black", Status::ZeroDensity, "tree");
            }
            _ => call.succeeds("black"),
        }
    }
}
