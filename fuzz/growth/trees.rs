//! Curves of trees, visibility and their integrals.

use crate::world::{Block, World, call, counted, numbers, sized};
use std::ptr::{null, null_mut};
use wis::ffi::MemorySize;
use wis::ffi::wavelets::haar::*;
use wis::ffi::wavelets::table::Table;
use wis::ffi::wavelets::tree::*;
use wis::ffi::wavelets::triple::*;
use wis::ffi::wavelets::visibility::*;
use wis::status::Status;

/// Pixels of planar trees.
const PIXELS: [usize; 4] = [64, 256, 1024, 4096];

fn constant(_: f64) -> f64 {
    1.0
}

fn linear(n: f64) -> f64 {
    n
}

pub fn run(w: &mut World) {
    builds(w);
    lookups(w);
    transforms(w);
    combined(w);
    integrals(w);
}

/// A table without slices.
pub fn table() -> Table {
    // SAFETY: a struct of numbers and pointers.
    let mut table: Table = unsafe { std::mem::zeroed() };
    table.size = size_of::<Table>() as u32;
    table
}

/// A tree of noise in which every square is kept.
pub struct Stored {
    config: TreeConfig,
    _pixels: Vec<f32>,
    memory: Block,
    scratch: Block,
}

impl Stored {
    fn unbuilt(w: &World, axes: u32, depth: u32, seed: u64) -> Stored {
        let mut config: TreeConfig = sized();
        let pixels = numbers(seed, 1 << (axes * depth));
        (config.dimensions, config.depth, config.pixels) = (axes, depth, pixels.as_ptr());
        let mut size = MemorySize::default();
        assert_eq!(call!(w, wis_tree_size(&config, &mut size, null_mut())), Status::Ok);
        let (memory, scratch) = (Block::new(size.bytes), Block::new(size.scratch_bytes));
        Stored { config, _pixels: pixels, memory, scratch }
    }

    pub fn new(w: &World, axes: u32, depth: u32, seed: u64) -> Stored {
        let mut made = Stored::unbuilt(w, axes, depth, seed);
        let mut info: TreeInfo = sized();
        let (memory, bytes, scratch, room) =
            (made.memory.at(), made.memory.bytes, made.scratch.at(), made.scratch.bytes);
        let (config, mut handle) = (&made.config, null());
        let status = call!(w, wis_tree_init(config, memory, bytes, scratch, room, &mut handle, &mut info, null_mut()));
        assert_eq!(status, Status::Ok);
        made.memory.bytes = info.bytes as usize;
        made
    }

    /// A planar tree of so many pixels.
    pub fn planar(w: &World, pixels: usize, seed: u64) -> Stored {
        Stored::new(w, 2, pixels.ilog2() / 2, seed)
    }

    pub fn handle(&self) -> *const Tree {
        self.memory.of()
    }
}

fn builds(w: &mut World) {
    w.curve("wis_tree_size", "pixels", &PIXELS, constant, |w, n| {
        let (made, mut size) = (Stored::planar(w, n, 1), MemorySize::default());
        counted!(w, wis_tree_size(&made.config, &mut size, null_mut()));
    });
    w.curve("wis_tree_size", "bytes by pixels", &PIXELS, linear, |w, n| {
        let bytes = Stored::unbuilt(w, 2, n.ilog2() / 2, 1).memory.bytes;
        w.bytes(bytes);
    });
    for (input, axes) in [("pixels, 1 axis", 1), ("pixels, 2 axes", 2), ("pixels, 3 axes", 3), ("pixels, 4 axes", 4)] {
        let sizes: &[usize] = match axes {
            3 => &[512, 4096],
            4 => &[256, 4096],
            _ => &PIXELS,
        };
        w.curve("wis_tree_init", input, sizes, linear, |w, n| {
            let mut made = Stored::unbuilt(w, axes, n.ilog2() / axes, 1);
            let (memory, bytes, scratch, room) =
                (made.memory.at(), made.memory.bytes, made.scratch.at(), made.scratch.bytes);
            let (config, mut handle, none) = (&made.config, null(), null_mut());
            counted!(w, wis_tree_init(config, memory, bytes, scratch, room, &mut handle, none, null_mut()));
        });
    }
    w.curve("wis_tree_open", "pixels", &PIXELS, linear, |w, n| {
        let (made, mut handle) = (Stored::planar(w, n, 1), null());
        counted!(w, wis_tree_open(made.handle().cast(), made.memory.bytes, &mut handle, null_mut(), null_mut()));
    });
    w.curve("wis_tree_average", "pixels", &PIXELS, constant, |w, n| {
        let (made, mut average) = (Stored::planar(w, n, 1), 0.0);
        counted!(w, wis_tree_average(made.handle(), &mut average));
    });
}

fn lookups(w: &mut World) {
    let u = [0.3f32, 0.7];
    w.curve("wis_tree_sample", "pixels", &PIXELS, f64::log2, |w, n| {
        let (made, mut point, mut pdf) = (Stored::planar(w, n, 1), [0.0f32; 2], 0.0);
        counted!(w, wis_tree_sample(made.handle(), u.as_ptr(), point.as_mut_ptr(), &mut pdf));
    });
    w.curve("wis_tree_pdf", "pixels", &PIXELS, f64::log2, |w, n| {
        let (made, mut pdf) = (Stored::planar(w, n, 1), 0.0);
        counted!(w, wis_tree_pdf(made.handle(), u.as_ptr(), &mut pdf));
    });
    w.curve("wis_tree_invert", "pixels", &PIXELS, f64::log2, |w, n| {
        let (made, mut out) = (Stored::planar(w, n, 1), [0.0f32; 2]);
        counted!(w, wis_tree_invert(made.handle(), u.as_ptr(), out.as_mut_ptr()));
    });
    for (input, sizes) in [("count", PIXELS), ("count, all alike", PIXELS), ("pixels", PIXELS)] {
        let stated = |n: f64| if input == "pixels" { n.log2() } else { n };
        w.curve("wis_warp_in_place", input, &sizes, stated, |w, n| {
            let (pixels, count) = if input == "pixels" { (n, 256) } else { (1024, n) };
            let made = Stored::planar(w, pixels, 1);
            let mut points = if input == "count, all alike" { vec![0.3; 2 * count] } else { numbers(2, 2 * count) };
            let mut index: Vec<u32> = (0..count as u32).collect();
            let (points, index) = (points.as_mut_ptr(), index.as_mut_ptr());
            counted!(w, wis_warp_in_place(made.handle(), points, index, count, null_mut()));
        });
    }
}

fn transforms(w: &mut World) {
    w.curve("wis_haar", "count, forward", &PIXELS, linear, |w, n| {
        let mut values = vec![1.0f64; n];
        counted!(w, wis_haar(WIS_HAAR_FORWARD, 2, n.ilog2() / 2, n, values.as_mut_ptr(), null_mut()));
    });
    w.curve("wis_haar", "count, inverse", &PIXELS, linear, |w, n| {
        let mut values = vec![1.0f64; n];
        counted!(w, wis_haar(WIS_HAAR_INVERSE, 2, n.ilog2() / 2, n, values.as_mut_ptr(), null_mut()));
    });
}

/// A configuration of a tree of which nothing is set but the source.
pub fn of(source: u32) -> TreeConfig {
    TreeConfig { source, ..sized() }
}

/// Asks for the memory of a tree, or builds it.
pub fn made(w: &mut World, config: &TreeConfig, is_query: bool) {
    let mut size = MemorySize::default();
    if is_query {
        counted!(w, wis_tree_size(config, &mut size, null_mut()));
        return;
    }
    assert_eq!(call!(w, wis_tree_size(config, &mut size, null_mut())), Status::Ok);
    let (mut memory, mut scratch, mut handle) = (Block::new(size.bytes), Block::new(size.scratch_bytes), null());
    let (place, bytes, work, room) = (memory.at(), size.bytes, scratch.at(), size.scratch_bytes);
    counted!(w, wis_tree_init(config, place, bytes, work, room, &mut handle, null_mut(), null_mut()));
}

/// The query and the build.
pub const VERBS: [(&str, bool); 2] = [("wis_tree_size", true), ("wis_tree_init", false)];

fn combined(w: &mut World) {
    for (input, axes) in [("product, pixels", [2, 2]), ("product, 3 x 1 axes", [3, 1])] {
        let sizes: &[usize] = if axes[0] == 3 { &[64, 512, 4096] } else { &PIXELS };
        for (function, is_query) in VERBS {
            w.curve(function, input, sizes, linear, |w, n| {
                let depth = n.ilog2() / axes[0];
                let (e, f) = (Stored::new(w, axes[0], depth, 1), Stored::new(w, axes[1], depth, 2));
                let trees = [e.handle(), f.handle()];
                let config = TreeConfig { tree_count: 2, trees: trees.as_ptr(), ..of(WIS_TREE_PRODUCT) };
                made(w, &config, is_query);
            });
        }
    }
    for (input, sizes) in [("blend, pixels", &PIXELS[..]), ("blend, trees", &[1, 4, 16])] {
        for (function, is_query) in VERBS {
            w.curve(function, input, sizes, linear, |w, n| blend(w, input, is_query, n));
        }
    }
}

fn blend(w: &mut World, input: &str, is_query: bool, n: usize) {
    let (pixels, count) = if input == "blend, pixels" { (n, 4) } else { (1024, n) };
    let trees: Vec<Stored> = (0..count as u64).map(|seed| Stored::planar(w, pixels, seed)).collect();
    let (handles, weights): (Vec<_>, Vec<f64>) = trees.iter().map(|tree| (tree.handle(), 0.25)).unzip();
    let (tree_count, trees, weight) = (count as u32, handles.as_ptr(), weights.as_ptr());
    made(w, &TreeConfig { tree_count, trees, weight, ..of(WIS_TREE_BLEND) }, is_query);
}

/// Visibility of a tree.
pub fn visibility(w: &World, tree: &Stored) -> Block {
    let (mut size, mut handle) = (MemorySize::default(), null());
    assert_eq!(call!(w, wis_visibility_size(tree.handle(), &mut size, null_mut())), Status::Ok);
    let mut memory = Block::new(size.bytes);
    let (place, bytes) = (memory.at(), memory.bytes);
    assert_eq!(call!(w, wis_visibility_init(tree.handle(), place, bytes, &mut handle, null_mut())), Status::Ok);
    memory
}

fn integrals(w: &mut World) {
    w.curve("wis_tree_product_integral", "pixels", &PIXELS, linear, |w, n| {
        let (e, f, mut integral) = (Stored::planar(w, n, 1), Stored::planar(w, n, 2), 0.0);
        counted!(w, wis_tree_product_integral(e.handle(), f.handle(), &mut integral));
    });
    w.curve("wis_triple_integral", "pixels", &PIXELS, linear, |w, n| {
        let [e, f, g] = [1, 2, 3].map(|seed| Stored::planar(w, n, seed));
        let mut integral = 0.0;
        counted!(w, wis_triple_integral(e.handle(), f.handle(), g.handle(), &mut integral));
    });
    w.curve("wis_visibility_size", "pixels", &PIXELS, constant, |w, n| {
        let (tree, mut size) = (Stored::planar(w, n, 1), MemorySize::default());
        counted!(w, wis_visibility_size(tree.handle(), &mut size, null_mut()));
    });
    w.curve("wis_visibility_size", "bytes by pixels", &PIXELS, linear, |w, n| {
        let tree = Stored::planar(w, n, 1);
        w.bytes(visibility(w, &tree).bytes);
    });
    w.curve("wis_visibility_init", "pixels", &PIXELS, linear, |w, n| {
        let tree = Stored::planar(w, n, 1);
        let (mut memory, mut handle) = (visibility(w, &tree), null());
        let (place, bytes) = (memory.at(), memory.bytes);
        counted!(w, wis_visibility_init(tree.handle(), place, bytes, &mut handle, null_mut()));
    });
    w.curve("wis_visibility_open", "pixels", &PIXELS, linear, |w, n| {
        let (memory, mut handle) = (visibility(w, &Stored::planar(w, n, 1)), null());
        counted!(w, wis_visibility_open(memory.of(), memory.bytes, &mut handle, null_mut()));
    });
    w.curve("wis_visibility_product_integral", "pixels", &PIXELS, linear, |w, n| {
        let (tree, seen, mut integral) = (Stored::planar(w, n, 1), Stored::planar(w, n, 2), 0.0);
        let seen = visibility(w, &seen);
        counted!(w, wis_visibility_product_integral(tree.handle(), seen.of(), &mut integral));
    });
}
