//! Trees of every source: what a configuration points to, which fields count, and which field a diagnostic names.

use super::block::{Block, SENTINEL};
use super::call::{Call, field};
use super::objects::{self, function};
use super::scene::{SOURCES, Scene};
use std::ffi::c_void;
use std::ptr::null;
use wis::ffi::wavelets::tree::*;
use wis::status::Status;
use wis::wavelets::triple::Wavelets;

const INVALID: Status = Status::InvalidArgument;
const MISALIGNED: Status = Status::Misaligned;
const NULL: Status = Status::NullPointer;
const TRANSFORM: Status = Status::InvalidTransform;
static SCALED: [f32; 9] = [2.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// What reads a field: the size query and the build, or the build alone.
const BOTH: &[&str] = &["wis_tree_size", "wis_tree_init"];
const BUILD: &[&str] = &["wis_tree_init"];

/// The field that a diagnostic names, the number of the element at fault, an edit that spoils it, and the status.
type Fault<'a> = (&'static str, u32, &'a dyn Fn(&mut TreeConfig), Status);

/// Calls functions with a configuration of a source that is spoiled in one field after another.
fn check(scene: &Scene, functions: &[&str], source: u32, faults: &[Fault]) {
    for function in functions.iter().map(|name| function(name)) {
        for (name, row, edit, status) in faults {
            let mut call = Call::valid(scene, function);
            call.give("config", Block::new(&scene.tree_config(source), 0));
            call.edit("config", edit);
            let diagnostic = call.fails(&format!("{source}: {name}"), *status, "config");
            assert_eq!((field(&diagnostic), diagnostic.x, diagnostic.y), (Some(*name), 0, *row), "{}", function.name);
        }
    }
}

/// A pointer, one byte further.
fn off<T>(pointer: *const T) -> *const T {
    pointer.wrapping_byte_add(1)
}

#[test]
fn unknown_sources() {
    for source in [SOURCES, u32::MAX] {
        check(&Scene::new(), BOTH, WIS_TREE_PIXELS, &[("source", 0, &|c| c.source = source, INVALID)]);
    }
}

#[test]
fn products() {
    let scene = Scene::new();
    let hypercube = Block::new(&objects::tree(&scene, |config| (config.dimensions, config.depth) = (4, 1)), 0);
    let handle = |block: &Block| block.pointer().cast_const().cast::<Tree>();
    let mut tree = null();
    // SAFETY: the configuration is that of a product.
    Block::new(&scene.tree_config(WIS_TREE_PRODUCT), 0).edit(|c: &mut TreeConfig| tree = unsafe { c.trees.read() });
    let wrong = [[tree, handle(&hypercube), tree], [tree, tree, handle(&hypercube)]];
    for source in [WIS_TREE_PRODUCT, WIS_TREE_BLEND] {
        let faults: &[Fault] = &[
            ("tree_count", 0, &|c| c.tree_count = 0, INVALID),
            ("tree_count", 0, &|c| c.tree_count = 17, INVALID),
            ("tree_count", 0, &|c| c.tree_count = u32::MAX, INVALID),
            ("trees", 0, &|c| c.trees = null(), NULL),
            ("trees", 0, &|c| c.trees = off(c.trees), MISALIGNED),
            ("trees", 1, &|c| c.trees = wrong[0].as_ptr(), INVALID),
            ("trees", 2, &|c| c.trees = wrong[1].as_ptr(), INVALID),
        ];
        check(&scene, BOTH, source, faults);
        for row in 0..3 {
            let mut trees = [tree; 3];
            for (pointer, status) in [(null(), NULL), (tree.wrapping_byte_add(8), MISALIGNED), (off(tree), MISALIGNED)]
            {
                trees[row] = pointer;
                check(&scene, BOTH, source, &[("trees", row as u32, &|c| c.trees = trees.as_ptr(), status)]);
            }
            for other in others(&scene, scene.tree().len(), "wis_tree") {
                trees[row] = handle(&other);
                check(&scene, BOTH, source, &[("trees", row as u32, &|c| c.trees = trees.as_ptr(), Status::Mismatch)]);
            }
        }
    }
    let faults: &[Fault] =
        &[("tree_count", 0, &|c| c.tree_count = 1, INVALID), ("tree_count", 0, &|c| c.tree_count = 4, INVALID)];
    check(&scene, BOTH, WIS_TREE_PRODUCT, faults);
    let weights = [[-1.0, 1.0, 1.0], [1.0, f64::NAN, 1.0], [1.0, 1.0, f64::INFINITY]];
    let faults: &[Fault] = &[
        ("weight", 0, &|c| c.weight = null(), NULL),
        ("weight", 0, &|c| c.weight = off(c.weight), MISALIGNED),
        ("weight", 0, &|c| c.weight = weights[0].as_ptr(), INVALID),
        ("weight", 1, &|c| c.weight = weights[1].as_ptr(), INVALID),
        ("weight", 2, &|c| c.weight = weights[2].as_ptr(), INVALID),
    ];
    check(&scene, BUILD, WIS_TREE_BLEND, faults);
}

/// What a handle may not point to.
fn others(scene: &Scene, len: usize, kind: &str) -> [Block; 3] {
    [vec![0; len], vec![SENTINEL; len], scene.other_object(kind)].map(|bytes| Block::new(&bytes, 0))
}

#[test]
fn lists() {
    let scene = Scene::new();
    let wavelets = [1, 0].map(|level| Wavelets { level, ..Wavelets::default() });
    let faults: &[Fault] = &[
        ("wavelets", 0, &|c| c.wavelets = null(), NULL),
        ("wavelets", 0, &|c| c.wavelets = off(c.wavelets), MISALIGNED),
        ("wavelets", 1, &|c| c.wavelets = wavelets.as_ptr(), INVALID),
    ];
    check(&scene, BOTH, WIS_TREE_WAVELETS, faults);
    let faults: &[Fault] = &[
        ("average", 0, &|c| c.average = f64::NAN, INVALID),
        ("average", 0, &|c| c.average = f64::INFINITY, INVALID),
        ("least", 0, &|c| c.least = -1e-9, INVALID),
        ("least", 0, &|c| c.least = f64::NAN, INVALID),
        ("least", 0, &|c| c.least = f64::INFINITY, INVALID),
    ];
    check(&scene, BUILD, WIS_TREE_WAVELETS, faults);
    // Nothing to do is no fault, wherever the list is.
    accepted(&scene, WIS_TREE_WAVELETS, |c| (c.count, c.wavelets) = (0, null()));
}

#[test]
fn environments() {
    let scene = Scene::new();
    let faults: &[Fault] = &[
        ("depth", 0, &|c| c.depth = 13, INVALID),
        ("depth", 0, &|c| c.depth = u32::MAX, INVALID),
        ("error_budget", 0, &|c| c.error_budget = -1.0, INVALID),
        ("error_budget", 0, &|c| c.error_budget = f32::NAN, INVALID),
        ("least", 0, &|c| c.least = -1e-9, INVALID),
        ("least", 0, &|c| c.least = 2e6, INVALID),
        ("least", 0, &|c| c.least = f64::INFINITY, INVALID),
        ("least", 0, &|c| c.least = f64::NAN, INVALID),
        // Not 0 before it is rounded to a float.
        ("least", 0, &|c| c.least = -1e-300, INVALID),
    ];
    check(&scene, BOTH, WIS_TREE_ENVIRONMENT, faults);
    let faults: &[Fault] = &[
        ("environment", 0, &|c| c.environment = null(), NULL),
        ("environment", 0, &|c| c.environment = off(c.environment), MISALIGNED),
        ("environment", 0, &|c| c.environment = c.environment.wrapping_byte_add(8), MISALIGNED),
        ("world_from_tree", 0, &|c| c.world_from_tree = SCALED.as_ptr(), TRANSFORM),
        ("world_from_tree", 0, &|c| c.world_from_tree = off(SCALED.as_ptr()), MISALIGNED),
    ];
    check(&scene, BUILD, WIS_TREE_ENVIRONMENT, faults);
    for other in others(&scene, scene.light().len(), "wis_environment") {
        let environment = other.pointer().cast_const().cast();
        let faults: &[Fault] = &[("environment", 0, &|c| c.environment = environment, Status::Mismatch)];
        check(&scene, BUILD, WIS_TREE_ENVIRONMENT, faults);
    }
    let map = wis::Map::latlong(4, 2, 1, &[0.0; 8]);
    let blocks = |bytes: usize| vec![wis::Block::ZERO; wis::Block::count(bytes)];
    let size = map.size().unwrap();
    let mut black = blocks(size.bytes);
    map.build_in(&mut black, &mut blocks(size.scratch)).unwrap();
    accepted(&scene, WIS_TREE_ENVIRONMENT, |c| c.environment = black.as_ptr().cast());
    accepted(&scene, WIS_TREE_ENVIRONMENT, |c| c.world_from_tree = null());
}

/// Both functions take a configuration.
fn accepted(scene: &Scene, source: u32, edit: impl Fn(&mut TreeConfig)) {
    for function in BOTH.iter().map(|name| function(name)) {
        let mut call = Call::valid(scene, function);
        call.give("config", Block::new(&scene.tree_config(source), 0));
        call.edit("config", &edit);
        call.succeeds(&format!("source {source}"));
    }
}

/// Fields that a source does not read may be anything.
#[test]
fn other_fields() {
    let (scene, init) = (Scene::new(), function("wis_tree_init"));
    for source in 0..SOURCES {
        let valid = scene.tree_config(source);
        let built = |config: &[u8]| {
            let mut call = Call::valid(&scene, init);
            call.give("config", Block::new(config, 0));
            call.succeeds(&format!("source {source}"));
            call.bytes("memory").to_vec()
        };
        let mut config = Block::new(&valid, 0);
        config.edit(|c: &mut TreeConfig| spoil(c, source));
        assert_ne!(*config, valid[..]);
        assert_eq!(built(&config), built(&valid), "source {source}");
    }
}

/// Spoils each field that the source does not read.
fn spoil(c: &mut TreeConfig, source: u32) {
    let reads = |sources: &[u32]| sources.contains(&source);
    fn wild<T>() -> *const T {
        std::ptr::without_provenance(usize::MAX)
    }
    if !reads(&[WIS_TREE_PIXELS]) {
        c.dimensions = 99;
    }
    if !reads(&[WIS_TREE_PIXELS, WIS_TREE_ENVIRONMENT]) {
        (c.depth, c.error_budget) = (99, f32::NAN);
    }
    if !reads(&[WIS_TREE_PIXELS]) {
        c.pixels = wild();
    }
    if !reads(&[WIS_TREE_PRODUCT, WIS_TREE_BLEND]) {
        (c.tree_count, c.trees) = (99, wild());
    }
    if !reads(&[WIS_TREE_BLEND]) {
        c.weight = wild();
    }
    if !reads(&[WIS_TREE_WAVELETS]) {
        (c.average, c.count, c.wavelets) = (f64::NAN, u32::MAX, wild());
    }
    if !reads(&[WIS_TREE_WAVELETS, WIS_TREE_ENVIRONMENT]) {
        c.least = f64::NAN;
    }
    if !reads(&[WIS_TREE_ENVIRONMENT]) {
        (c.environment, c.world_from_tree) = (wild(), wild());
    }
}

/// Null and misaligned blocks of every source; lists need no scratch memory.
#[test]
fn blocks() {
    let (scene, init) = (Scene::new(), function("wis_tree_init"));
    for source in 0..SOURCES {
        let given = |name: &str, word: usize| {
            let mut call = Call::valid(&scene, init);
            call.give("config", Block::new(&scene.tree_config(source), 0));
            call.set(name, word);
            call
        };
        let wild: *const c_void = std::ptr::without_provenance(8);
        for (name, word, status) in [
            ("memory", 0, NULL),
            ("memory", wild as usize, MISALIGNED),
            ("scratch", 0, NULL),
            ("scratch", wild as usize, MISALIGNED),
        ] {
            if name == "scratch" && source == WIS_TREE_WAVELETS {
                given(name, word).succeeds("no scratch memory");
            } else {
                given(name, word).fails(&format!("source {source}"), status, name);
            }
        }
    }
}
