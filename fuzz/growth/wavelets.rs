//! Curves of wavelet lights, their products and tables.

use crate::trees::{self, Stored};
use crate::world::{Block, Map, World, call, counted, directions, numbers, sized};
use std::ptr::{null, null_mut};
use wis::ffi::MemorySize;
use wis::ffi::wavelets::environment::*;
use wis::ffi::wavelets::grid::*;
use wis::ffi::wavelets::product::*;
use wis::ffi::wavelets::sampling::*;
use wis::ffi::wavelets::table::*;
use wis::ffi::wavelets::tree::{TreeConfig, WIS_TREE_ENVIRONMENT};
use wis::status::Status;
use wis::wavelets::descent::Sample;
use wis::wavelets::query::*;

const TEXELS: [usize; 3] = [128, 512, 2048];
const COUNTS: [usize; 3] = [64, 256, 1024];
const LOBES: [usize; 2] = [1, 4];

fn constant(_: f64) -> f64 {
    1.0
}

fn linear(n: f64) -> f64 {
    n
}

pub fn run(w: &mut World) {
    lights(w);
    products(w);
    samples(w);
    tables(w);
    rotated(w);
}

/// A light of RGB, in either storage.
struct Light {
    map: Map,
    config: EnvironmentConfig,
    memory: Block,
    scratch: Block,
}

impl Light {
    fn new(w: &World, texels: usize, storage: u32, flags: u32) -> Light {
        let map = Map::new(texels);
        let mut config: EnvironmentConfig = sized();
        (config.layout, config.width, config.height) = (map.config.layout, map.config.width, map.config.height);
        (config.channels, config.format, config.pixels) = (map.config.channels, map.config.format, map.config.pixels);
        (config.storage, config.flags) = (storage, flags);
        let mut size = MemorySize::default();
        assert_eq!(call!(w, wis_wavelet_light_size(&config, &mut size, null_mut())), Status::Ok);
        Light { map, config, memory: Block::new(size.bytes), scratch: Block::new(size.scratch_bytes) }
    }

    fn build(mut self, w: &mut World, is_counted: bool) -> Light {
        let (memory, bytes, scratch, room) =
            (self.memory.at(), self.memory.bytes, self.scratch.at(), self.scratch.bytes);
        let mut info: EnvironmentInfo = sized();
        let (config, mut handle, none) = (&self.config, null(), null_mut());
        if is_counted {
            counted!(w, wis_wavelet_light_init(config, memory, bytes, scratch, room, &mut handle, &mut info, none));
        } else {
            let status =
                call!(w, wis_wavelet_light_init(config, memory, bytes, scratch, room, &mut handle, &mut info, none));
            assert_eq!(status, Status::Ok);
        }
        self.memory.bytes = info.bytes as usize;
        self
    }
}

fn built(w: &mut World, texels: usize) -> Light {
    Light::new(w, texels, WIS_STORAGE_PYRAMID, WIS_WAVELET_LIGHT_RGB).build(w, false)
}

fn lights(w: &mut World) {
    w.curve("wis_wavelet_light_size", "texels", &TEXELS, constant, |w, n| {
        let (light, mut size) = (Light::new(w, n, WIS_STORAGE_SPARSE, 0), MemorySize::default());
        counted!(w, wis_wavelet_light_size(&light.config, &mut size, null_mut()));
        assert!(light.map.config.width > 0);
    });
    for (input, storage) in
        [("bytes by texels, pyramid", WIS_STORAGE_PYRAMID), ("bytes by texels, sparse", WIS_STORAGE_SPARSE)]
    {
        w.curve("wis_wavelet_light_size", input, &TEXELS, linear, |w, n| {
            let bytes = Light::new(w, n, storage, 0).memory.bytes;
            w.bytes(bytes);
        });
    }
    let build = |w: &mut World, texels, storage, flags| drop(Light::new(w, texels, storage, flags).build(w, true));
    w.curve("wis_wavelet_light_init", "texels, pyramid", &TEXELS, linear, |w, n| {
        build(w, n, WIS_STORAGE_PYRAMID, WIS_WAVELET_LIGHT_RGB);
    });
    w.curve("wis_wavelet_light_init", "texels, sparse", &TEXELS, linear, |w, n| build(w, n, WIS_STORAGE_SPARSE, 0));
    // The finest cells of a sun take as much room in a small map as in a large one.
    w.at_most("wis_wavelet_light_init", "texels, nearest", &TEXELS, linear, |w, n| {
        build(w, n, WIS_STORAGE_PYRAMID, WIS_WAVELET_LIGHT_NEAREST);
    });
    w.curve("wis_wavelet_light_open", "texels", &TEXELS, linear, |w, n| {
        let (light, mut handle) = (built(w, n), null());
        counted!(w, wis_wavelet_light_open(light.memory.of(), light.memory.bytes, &mut handle, null_mut(), null_mut()));
    });
}

/// Lambert's lobe and narrower ones.
fn query(lobes: usize) -> Query {
    let mut query: Query = sized();
    query.lobe_count = lobes as u32;
    (query.normal, query.wo) = ([0.0, 0.0, 1.0], [0.6, 0.0, 0.8]);
    query.lobe[0] = Lobe { kind: WIS_WAVELET_LOBE_LAMBERT, weight: [0.5; 3], ..Lobe::default() };
    for (lobe, alpha) in query.lobe[1..lobes].iter_mut().zip([0.4, 0.1, 0.02]) {
        *lobe = Lobe { kind: WIS_WAVELET_LOBE_GGX, weight: [0.25; 3], f0: [0.5; 3], a: alpha, b: alpha };
    }
    query
}

/// Products of queries that are alike.
struct Products {
    light: Light,
    config: ProductConfig,
    queries: Vec<Query>,
    memory: Block,
}

impl Products {
    fn new(w: &mut World, texels: usize, count: usize, lobes: usize, squares: usize) -> Products {
        let (mut config, mut size): (ProductConfig, _) = (sized(), MemorySize::default());
        (config.max_squares, config.max_evaluations) = (squares as u32, squares as u32);
        assert_eq!(call!(w, wis_wavelet_product_size(&config, &mut size, null_mut())), Status::Ok);
        let memory = Block::new(count * size.bytes);
        Products { light: built(w, texels), config, queries: vec![query(lobes); count], memory }
    }

    fn prepare(mut self, w: &mut World, is_counted: bool) -> Products {
        let (light, config, count, queries) =
            (self.light.memory.of(), &self.config, self.queries.len(), self.queries.as_ptr());
        let (memory, bytes, mut handles, none) = (self.memory.at(), self.memory.bytes, vec![null(); count], null_mut());
        let handles = handles.as_mut_ptr();
        if is_counted {
            counted!(w, wis_wavelet_product_prepare(light, config, count, queries, memory, bytes, handles, none));
        } else {
            let status =
                call!(w, wis_wavelet_product_prepare(light, config, count, queries, memory, bytes, handles, none));
            assert_eq!(status, Status::Ok);
        }
        self
    }
}

fn products(w: &mut World) {
    const SQUARES: [usize; 3] = [64, 256, 1024];
    w.curve("wis_wavelet_product_size", "squares", &SQUARES, constant, |w, n| {
        let (mut config, mut size): (ProductConfig, _) = (sized(), MemorySize::default());
        config.max_squares = n as u32;
        counted!(w, wis_wavelet_product_size(&config, &mut size, null_mut()));
    });
    w.curve("wis_wavelet_product_size", "bytes by squares", &SQUARES, linear, |w, n| {
        let bytes = Products::new(w, 512, 1, 1, n).memory.bytes;
        w.bytes(bytes);
    });
    for (input, sizes) in [("count", [4, 16, 64]), ("squares", SQUARES), ("texels", [2048, 8192, 32768])] {
        let stated = |n| if input == "texels" { constant(n) } else { linear(n) };
        w.curve("wis_wavelet_product_prepare", input, &sizes, stated, |w, n| {
            let (texels, count, squares) = match input {
                "count" => (2048, n, 0),
                "squares" => (8192, 4, n),
                _ => (n, 4, 0),
            };
            Products::new(w, texels, count, 4, squares).prepare(w, true);
        });
    }
    // Narrow lobes ask for evaluations of their own.
    w.at_most("wis_wavelet_product_prepare", "lobes", &LOBES, linear, |w, n| {
        let (made, mut info) = (Products::new(w, 2048, 4, n, 0).prepare(w, false), sized::<ProductInfo>());
        let status = call!(w, wis_wavelet_product_describe(made.light.memory.of(), made.memory.of(), &mut info));
        assert_eq!(status, Status::Ok);
        w.state(f64::from(info.squares + info.evaluations) * n as f64);
        made.prepare(w, true);
    });
    w.curve("wis_wavelet_product_describe", "squares", &SQUARES, constant, |w, n| {
        let (made, mut info) = (Products::new(w, 2048, 1, 4, n).prepare(w, false), sized());
        counted!(w, wis_wavelet_product_describe(made.light.memory.of(), made.memory.of(), &mut info));
    });
    w.curve("wis_wavelet_product_estimate_rgb", "squares", &SQUARES, linear, |w, n| {
        let (made, mut rgb) = (Products::new(w, 8192, 1, 4, n).prepare(w, false), [0.0; 3]);
        counted!(w, wis_wavelet_product_estimate_rgb(made.light.memory.of(), made.memory.of(), null(), &mut rgb));
    });
}

fn sampled(w: &mut World, function: &str, texels: usize, count: usize, squares: usize) {
    let made = Products::new(w, texels, 1, 4, squares).prepare(w, false);
    let product = if squares > 0 { made.memory.of() } else { null() };
    let (mut u, wi, mut drawn) = (numbers(2, 2 * count), directions(3, count), vec![Sample::default(); count]);
    let (mut pdf, mut status) = (vec![0.0; count], vec![0; count]);
    let (light, wi) = (made.light.memory.of(), wi.as_ptr().cast());
    match function {
        "wis_wavelet_sample" => {
            counted!(w, wis_wavelet_sample(light, product, null(), count, u.as_ptr(), 0, drawn.as_mut_ptr(), 0));
        }
        "wis_wavelet_pdf" => {
            counted!(w, wis_wavelet_pdf(light, product, null(), count, wi, 0, pdf.as_mut_ptr(), 0));
        }
        _ => {
            let (u, status) = (u.as_mut_ptr(), status.as_mut_ptr());
            counted!(w, wis_wavelet_invert(light, product, null(), count, wi, 0, u, 0, status));
        }
    }
}

fn samples(w: &mut World) {
    for function in ["wis_wavelet_sample", "wis_wavelet_pdf", "wis_wavelet_invert"] {
        w.curve(function, "count", &COUNTS, linear, |w, n| sampled(w, function, 2048, n, 0));
        w.curve(function, "count, product", &COUNTS, linear, |w, n| sampled(w, function, 2048, n, 128));
        w.curve(function, "texels", &TEXELS, f64::log2, |w, n| sampled(w, function, n, 256, 0));
        w.curve(function, "squares", &[64, 256, 1024], f64::log2, |w, n| sampled(w, function, 8192, 256, n));
    }
}

fn tables(w: &mut World) {
    w.curve("wis_wavelet_query_eval", "count", &COUNTS, linear, |w, n| evaluate(w, n, 4));
    w.at_most("wis_wavelet_query_eval", "lobes", &LOBES, linear, |w, n| evaluate(w, 256, n));
    w.curve("wis_wavelet_query_eval", "slices", &[4, 16, 256], constant, |w, n| tabulated(w, n, 2));
    w.at_most("wis_wavelet_query_eval", "depth of slices", &[2, 4, 6], linear, |w, n| tabulated(w, 2, n as u32));
    w.curve("wis_wavelet_table_directions", "4^depth", &COUNTS, linear, |w, n| {
        let (mut wo, mut wi, depth) = ([0.0; 3], vec![[0.0f32; 3]; n], n.ilog2() / 2);
        counted!(w, wis_wavelet_table_directions(0, 8, depth, &[0.5; 2], &mut wo, wi.as_mut_ptr().cast(), 0));
    });
    w.curve("wis_grid_direction", "side", &[8, 512], constant, |w, n| {
        let mut direction = [0.0; 3];
        counted!(w, wis_grid_direction(n as u32, (n * n) as u32 / 3, &mut direction));
    });
    w.curve("wis_grid_cells", "side", &[8, 512], constant, |w, n| {
        let (mut cell, mut weights) = ([0; 4], [0.0; 4]);
        counted!(w, wis_grid_cells(n as u32, &[0.6, 0.0, 0.8], &mut cell, &mut weights));
    });
}

fn evaluate(w: &mut World, count: usize, lobes: usize) {
    let (query, wi, mut out) = (query(lobes), directions(3, count), vec![[0.0f32; 3]; count]);
    counted!(w, wis_wavelet_query_eval(&query, null(), count, wi.as_ptr().cast(), 0, out.as_mut_ptr().cast(), 0));
}

/// Evaluates a table of equal slices.
fn tabulated(w: &mut World, slices: usize, depth: u32) {
    let tree = Stored::new(w, 2, depth, 1);
    let (handles, mut query, mut table) = (vec![tree.handle(); slices], query(1), trees::table());
    (table.slice_count, table.slice) = (slices as u32, handles.as_ptr());
    query.lobe[0].kind = WIS_WAVELET_LOBE_TABLE;
    let (wi, mut out) = (directions(3, 64), vec![[0.0f32; 3]; 64]);
    counted!(w, wis_wavelet_query_eval(&query, &table, 64, wi.as_ptr().cast(), 0, out.as_mut_ptr().cast(), 0));
}

fn rotated(w: &mut World) {
    let config = |depth: usize, places: usize| {
        let (depth, places) = (depth as u32, places as u32);
        TreeConfig { depth, places, least: 0.25, ..trees::of(WIS_TREE_ENVIRONMENT) }
    };
    w.curve("wis_tree_size", "environment, 4^depth", &COUNTS, constant, |w, n| {
        trees::made(w, &config(n.ilog2() as usize / 2, 2), true);
    });
    for (input, sizes) in [("environment, 4^depth", COUNTS), ("environment, places^2", [4, 16, 64])] {
        w.curve("wis_tree_init", input, &sizes, linear, |w, n| {
            let root = n.ilog2() as usize / 2;
            let config = if input == "environment, 4^depth" { config(root, 2) } else { config(4, 1 << root) };
            let light = built(w, 2048);
            trees::made(w, &TreeConfig { environment: light.memory.of(), ..config }, false);
        });
    }
}
