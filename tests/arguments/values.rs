//! Values out of range in structs, matrices, directions, random numbers and what callbacks return.

use super::block::Block;
use super::call::Call;
use super::header::Function;
use super::objects::{self, function, functions};
use super::scene::{Scene, numbers};
use wis::ffi::lights::*;
use wis::ffi::wavelets::tree::TreeConfig;
use wis::status::Status;

const INVALID: Status = Status::InvalidArgument;
const OVERFLOW: Status = Status::Overflow;
const TRANSFORM: Status = Status::InvalidTransform;

/// Every function that has a parameter of this declaration.
fn taking(declaration: &str) -> Vec<&'static Function> {
    let taking: Vec<_> = functions().iter().filter(|function| function.takes(declaration)).collect();
    assert!(!taking.is_empty(), "{declaration}");
    taking
}

/// A pixel that is none is named by its place.
#[test]
fn pixels() {
    let scene = Scene::new();
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0] {
        for pixel in [0, 7, 15] {
            let mut image = [1.0f32; 16];
            image[pixel] = bad;
            let mut call = Call::valid(&scene, function("wis_tree_init"));
            call.edit("config", |c: &mut TreeConfig| c.pixels = image.as_ptr());
            let diagnostic = call.fails("a pixel", Status::InvalidTexel, "config");
            assert_eq!((diagnostic.x as usize, diagnostic.y as usize), (pixel % 4, pixel / 4));
        }
    }
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
            let mut call = Call::valid(&scene, function);
            call.give("world_from_map", Block::new(&numbers(matrix), 0));
            check(&mut call, matrix, failure, "world_from_map");
        }
        for function in taking("const float world_from_tree[9]") {
            let mut call = Call::valid(&scene, function);
            call.give("world_from_tree", Block::new(&numbers(matrix), 0));
            check(&mut call, matrix, failure, "world_from_tree");
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
            let mut call = Call::valid(&scene, function);
            call.give("wi", Block::new(&numbers(&direction), 0));
            call.fails(&format!("{direction:?}"), TRANSFORM, "wi");
        }
        // A cache leaves it out, and an inversion has a status for each.
        let many = taking("const float *wi").into_iter();
        for function in many.filter(|f| !["wis_visibility_cache_record", "wis_invert"].contains(&f.name.as_str())) {
            let results = ["pdf", "f_cos", "weight"];
            let result = results.into_iter().find(|name| function.takes(&format!("float *{name}"))).unwrap();
            let valid = Call::valid(&scene, function);
            valid.succeeds("valid");
            let mut call = Call::valid(&scene, function);
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
        let result = ["pdf", "weights", "u", "point"].into_iter().find(|name| function.has(name)).unwrap();
        let unit = Call::valid(&scene, function);
        unit.succeeds("unit");
        for factor in [0.999, 1.001] {
            let mut call = Call::valid(&scene, function);
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
    let scene = Scene::new();
    for function in taking("const wis_jitter_config *config") {
        for distribution in [WIS_JITTER_UNIFORM, WIS_JITTER_ENERGY] {
            let mut call = Call::valid(&scene, function);
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
            let mut call = Call::valid(&scene, function);
            call.set("rule", rule);
            call.succeeds(&format!("rule {rule}"));
        }
        for rule in [2, 3, u32::MAX as usize] {
            let mut call = Call::valid(&scene, function);
            call.set("rule", rule);
            call.fails(&format!("rule {rule}"), INVALID, "rule");
        }
    }
}

/// Sizes that do not fit each other.
#[test]
fn points() {
    let scene = Scene::new();
    for (first, count) in [(0xffff_fffe, 3), (0, (1 << 32) + 1)] {
        let mut call = Call::valid(&scene, function("wis_points_sobol"));
        call.set_all(&[("first", first), ("count", count)]);
        call.fails("points", OVERFLOW, "count");
    }
}

#[test]
fn trees() {
    let scene = Scene::new();
    let hypercube = objects::tree(&scene, |config| (config.dimensions, config.depth) = (4, 1));
    let mut call = Call::valid(&scene, function("wis_tree_product_integral"));
    call.give("f", Block::new(&hypercube, 0));
    call.fails("more axes than the other", INVALID, "f");
    call.give("e", Block::new(&hypercube, 0));
    call.succeeds("as many axes");

    let zeros = [0.0f32; 16];
    let black = objects::tree(&scene, |config| config.pixels = zeros.as_ptr());
    for function in taking("const wis_tree *tree") {
        let mut call = Call::valid(&scene, function);
        call.give("tree", Block::new(&black, 0));
        match function.name.as_str() {
            "wis_tree_invert" | "wis_warp_in_place" => {
                call.fails("black", Status::ZeroDensity, "tree");
            }
            _ => call.succeeds("black"),
        }
    }
}
