//! A valid argument for every parameter of the header, from which the tests then spoil one at a time.

use super::block::{Block, SENTINEL, plain};
use super::call::Call;
use super::header::{Function, Parameter};
use super::objects::{self, function, headers};
use std::ffi::{c_int, c_void};
use std::ptr::{null, null_mut};
use wis::direct::Ray;
use wis::ffi::MemorySize;
use wis::ffi::check::CheckConfig;
use wis::ffi::light::*;
use wis::ffi::lights::*;
use wis::ffi::material::{MaterialData, PointData};
use wis::ffi::product::*;
use wis::ffi::sampler::*;
use wis::ffi::wave::{DirectWave, FloatsIn, FloatsOut, IntsIn};
use wis::ffi::wavelets::tree::*;
use wis::status::Status;
use wis::wavelets::triple::Wavelets;

/// A rotation about the axis (1, 1, 1).
pub const ROTATION: [f32; 9] = [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
/// Elements of the functions that take many.
const COUNT: usize = 3;

/// Room for products and blends of wavelets.
const PRODUCT: usize = 48;
/// Places of a visibility cache.
const PLACES: u32 = 2;
/// Sources of trees: all numbers from 0.
pub const SOURCES: u32 = 5;
/// Weights of trees and lists.
const WEIGHTS: [f64; COUNT] = [0.5; COUNT];
/// Rays of a point.
const RAYS: usize = 2;
/// Slices of the table.
const SLICES: usize = 2;

static DIRECTIONS: [[f32; 3]; COUNT] = [[0.6, 0.0, 0.8], [0.0, -0.6, 0.8], [0.0, 0.0, 1.0]];
const RANDOM: [[f32; 2]; COUNT] = [[0.25, 0.75], [0.0, 0.5], [0.9, 0.1]];
const WIDTH: u32 = 6;
const HEIGHT: u32 = 3;
const IMAGE: [f64; 16] = [1.0, 2.0, 3.0, 4.0, 0.5, 9.0, 7.0, 1.0, 1.0, 2.0, 3.0, 3.0, 2.0, 1.0, 5.0, 8.0];

fn sampler_config() -> Vec<u8> {
    plain(|config: &mut SamplerConfig| config.size = size_of::<SamplerConfig>() as u32)
}

fn check_config() -> Vec<u8> {
    plain(|config: &mut CheckConfig| {
        config.size = size_of::<CheckConfig>() as u32;
        config.radiance = Some(white);
    })
}

extern "C" fn white(_: *mut c_void, count: usize, _: *const f32, rgb: *mut f32) -> c_int {
    // SAFETY: the library gives room for `count` colours.
    unsafe { std::slice::from_raw_parts_mut(rgb, 3 * count) }.fill(1.0);
    0
}

fn material() -> Vec<u8> {
    plain(|material: &mut MaterialData| {
        (material.size, material.lobe_count) = (size_of::<MaterialData>() as u32, 1);
        material.lobe[0].kind = wis::ffi::material::WIS_LOBE_LAMBERT;
    })
}

/// A valid value for a parameter.
pub enum Value {
    Number(usize),
    /// What the pointer points to.
    Bytes(Vec<u8>),
}

/// A map, an image and everything that is built from them.
pub struct Scene {
    pixels: Vec<f32>,
    image: Vec<f32>,
    /// What the size queries answered, by the kind of object.
    sizes: Vec<(&'static str, MemorySize)>,
    sampler: Vec<u8>,
    /// What points read and record in.
    cache: Block,
    /// A product of the light at the point.
    grid: Vec<u8>,
    /// A material after wis_material_init, and what a wave's arrays hold.
    material: Block,
    wave: [Block; 4],
    /// A scratch block after two passes and after three; the memory after three, and at the end.
    light_scratch: [Vec<u8>; 2],
    light_memory: [Vec<u8>; 2],
    jitter: Vec<u8>,
    /// A tree as calls on many take it: a block that stays where it is, and its handles.
    stored: Block,
    tree: Vec<u8>,
    /// A tree of values up to 1, and visibility made of it.
    shares: Vec<u8>,
    visibility: Vec<u8>,
    lists: [Block; 1],
    list: [*const Wavelets; COUNT],
    trees: [*const Tree; COUNT],
    /// An environment for a configuration of a tree.
    light: Block,
}

impl Scene {
    pub fn new() -> Scene {
        let mut scene = Scene {
            pixels: (0..WIDTH * HEIGHT * 3).map(|i| 0.25 + (i % 7) as f32).collect(),
            image: IMAGE.map(|value| value as f32).to_vec(),
            sizes: Vec::new(),
            sampler: Vec::new(),
            cache: Block::unwritten(0),
            grid: Vec::new(),
            material: Block::unwritten(0),
            wave: [
                Block::new(&numbers(&DIRECTIONS), 0),
                Block::new(&numbers(&[7u32; COUNT]), 0),
                Block::unwritten(COUNT * RAYS * size_of::<Ray>()),
                Block::unwritten(4 * COUNT),
            ],
            light_scratch: [Vec::new(), Vec::new()],
            light_memory: [Vec::new(), Vec::new()],
            jitter: Vec::new(),
            stored: Block::unwritten(0),
            tree: Vec::new(),
            shares: Vec::new(),
            visibility: Vec::new(),
            lists: [Block::new(&numbers(&WAVELETS), 0)],
            list: [null(); COUNT],
            trees: [null(); COUNT],
            light: Block::unwritten(0),
        };
        scene.build_light();
        scene.cache = Block::new(&scene.built("wis_visibility_cache"), 0);
        scene.sampler = scene.built("wis_sampler");
        scene.material = Block::new(scene.called("wis_material_init").bytes("material"), 0);
        scene.build_grid();
        scene.measure("wis_strata");
        scene.jitter = scene.built("wis_jitter");
        scene.build_trees();
        scene.visibility = scene.built("wis_visibility");
        scene
    }

    /// A call with valid arguments that was made.
    fn called(&self, name: &str) -> Call<'static> {
        let call = Call::valid(self, function(name));
        call.succeeds("valid");
        call
    }

    /// Asks how much memory a kind of object needs.
    fn measure(&mut self, object: &'static str) {
        let size = self.called(&format!("{object}_size")).read("size");
        self.sizes.push((object, size));
    }

    /// Builds an object with valid arguments, in as much memory as it needs.
    fn built(&mut self, object: &'static str) -> Vec<u8> {
        self.measure(object);
        self.called(&format!("{object}_init")).bytes("memory").to_vec()
    }

    fn build_light(&mut self) {
        self.measure("wis_environment");
        let MemorySize { bytes, scratch_bytes, .. } = self.size("wis_environment");
        let config = Block::new(&self.light_config(), 0);
        let (memory, scratch) = (Block::unwritten(bytes), Block::unwritten(scratch_bytes));
        let (config, place, work) = (config.pointer().cast(), memory.pointer().cast(), scratch.pointer().cast());
        let (mut items, mut handle, none) = ([0; 6], null(), null_mut());
        // SAFETY: all pointers are valid.
        unsafe {
            expect_ok(wis_environment_begin(config, work, scratch_bytes, &mut items, none));
            let run = |pass: u32, count| {
                expect_ok(wis_environment_run(config, place, bytes, work, scratch_bytes, pass, 0, count, none));
            };
            run(0, items[0]);
            run(1, items[1]);
            self.light_scratch[0] = scratch.to_vec();
            (2..).zip(&items[2..]).for_each(|(pass, &count)| run(pass, count));
            self.light_scratch[1] = scratch.to_vec();
            self.light_memory[0] = memory.to_vec();
            expect_ok(wis_environment_finish(config, place, bytes, work, scratch_bytes, &mut handle, none));
            self.light_memory[1] = memory.to_vec();
        }
    }

    fn build_grid(&mut self) {
        self.measure("wis_product");
        let mut call = Call::valid(self, function("wis_product_prepare"));
        call.set("count", 1);
        call.succeeds("one product");
        self.grid = call.bytes("memory")[..call.read("bytes_used")].to_vec();
    }

    fn build_trees(&mut self) {
        self.measure("wis_tree");
        self.tree = objects::tree(self, |_| ());
        let shares = IMAGE.map(|value| (value / 9.0) as f32);
        self.shares = objects::tree(self, |config| config.pixels = shares.as_ptr());
        self.list = [self.lists[0].pointer().cast_const().cast(); COUNT];
        self.stored = Block::new(&self.tree, 0);
        self.trees = [self.stored.pointer().cast_const().cast(); COUNT];
        self.light = Block::new(&self.light_memory[1], 0);
        // The memory that is enough for a tree of any source.
        for source in 0..SOURCES {
            let mut call = Call::valid(self, function("wis_tree_size"));
            call.give("config", Block::new(&self.tree_config(source), 0));
            call.succeeds("size");
            let (size, (_, most)) = (call.read::<MemorySize>("size"), self.sizes.last_mut().expect("measured"));
            most.bytes = most.bytes.max(size.bytes);
            most.scratch_bytes = most.scratch_bytes.max(size.scratch_bytes);
        }
    }

    fn point(&self) -> Vec<u8> {
        plain(|point: &mut PointData| {
            point.size = size_of::<PointData>() as u32;
            point.material = self.material.pointer().cast_const().cast();
            (point.normal, point.wo) = (DIRECTIONS[2], DIRECTIONS[0]);
            point.weight = [[1.0; 3]; 4];
            (point.visibility, point.visibility_key) = (self.cache.pointer().cast(), 7);
        })
    }

    /// A point with a BRDF of its own.
    fn seen_point(&self) -> Vec<u8> {
        let mut point = Block::new(&self.point(), 0);
        point.edit(|point: &mut PointData| point.target = Some(lambert));
        point.to_vec()
    }

    fn wave(&self) -> Vec<u8> {
        let [directions, seeds, rays, counts] = self.wave.each_ref().map(Block::pointer);
        let vectors = FloatsIn { first: directions.cast(), point: 12, number: 0 };
        let shared = FloatsIn { point: 0, ..vectors };
        plain(|wave: &mut DirectWave| {
            wave.size = size_of::<DirectWave>() as u32;
            (wave.rays, wave.material_count) = (RAYS as u32, 1);
            wave.materials = self.material.pointer().cast_const().cast();
            (wave.normal, wave.wo) = (shared, vectors);
            wave.seed = IntsIn { first: seeds.cast(), point: 4 };
            wave.visibility = self.cache.pointer().cast();
            wave.visibility_key = IntsIn { first: seeds.cast(), point: 4 };
            wave.ray = FloatsOut { first: rays.cast(), point: (RAYS * size_of::<Ray>()) as isize, number: 0 };
            wave.count = counts.cast();
        })
    }

    /// A valid argument for a parameter of a function.
    pub fn value(&self, function: &Function, parameter: &Parameter) -> Value {
        if parameter.is_pointer() {
            Value::Bytes(self.bytes(function, parameter))
        } else {
            Value::Number(self.number(function, parameter))
        }
    }

    fn number(&self, function: &Function, parameter: &Parameter) -> usize {
        let name = function.name.as_str();
        match parameter.name.as_str() {
            "count" if name == "wis_environment_run" => 1,
            "count" if name == "wis_sparse_pack" => 2,
            "packed_bytes" => packed().len(),
            "room" if name == "wis_sparse_pack" => packed().len(),
            "pass" if name == "wis_environment_run" => 2,
            "count" => COUNT,
            "bytes" if function.takes("const void *memory") => self.stored(name).len(),
            "bytes" => self.size(name).bytes,
            "scratch_bytes" => self.size(name).scratch_bytes,
            "picks" => 2,
            "keep" | "brdf_count" | "light_count" => 2,
            "average" | "brdf_average" | "light" | "threshold" | "bound" => 1,
            "u" => 0,
            "side" => 4,
            "rays" => RAYS,
            "places" => PLACES as usize,
            "cell" => 5,
            "room" => PRODUCT,
            "slice_count" => SLICES,
            "rule" | "distribution" | "pass" | "first" | "seed" | "x" | "y" | "status" => 0,
            stride if stride.ends_with("stride") => 0,
            _ => panic!("no argument for {} of {name}", parameter.declaration),
        }
    }

    fn bytes(&self, function: &Function, parameter: &Parameter) -> Vec<u8> {
        let name = function.name.as_str();
        let count = if function.has("count") { COUNT } else { 1 };
        let unwritten = |len: usize| vec![SENTINEL; len];
        match parameter.declaration.as_str() {
            "const wis_environment_config *config" => self.light_config(),
            "const wis_environment_config *map" => self.light_config(),
            "const wis_strata_config *config" => strata_config(),
            "const wis_sampler_config *config" => sampler_config(),
            "const wis_check_config *config" => check_config(),
            "wis_sampler *sampler" | "const wis_sampler *sampler" => self.sampler.clone(),
            "wis_material *material" => material(),
            "wis_visibility_cache *cache" => self.cache.to_vec(),
            "const uint8_t *reached" => vec![1, 0, 1],
            "const float position[3]" | "const float normal[3]" | "const float radiance[3]" => numbers(&DIRECTIONS[0]),
            "const wis_point *point" if name == "wis_check_point" => self.seen_point(),
            "const wis_point *point" => self.point().repeat(count),
            "const wis_wave *wave" => self.wave(),
            "const wis_product_config *config" => grid_config(),
            "const wis_product *product" => self.grid.clone(),
            "const wis_tree_config *config" => self.tree_config(WIS_TREE_PIXELS),
            "const float wo[3]" => numbers(&DIRECTIONS[0]),
            "const wis_environment *environment" => self.light_memory[1].clone(),
            "const wis_jitter *jitter" => self.jitter.clone(),
            "const wis_jitter_config *config" => jitter_config(),
            "const float *contribution" => numbers(&[1.0f32, 0.0, 2.0]),
            "const wis_tree *tree" if name.starts_with("wis_visibility") => self.shares.clone(),
            tree if tree.starts_with("const wis_tree *") => self.tree.clone(),
            "const wis_wavelets *brdf" | "const wis_wavelets *kept_light" => numbers(&WAVELETS),
            "const wis_wavelets *const *list" => numbers(&self.list),
            "const uint32_t *list_count" => numbers(&[2u32; COUNT]),
            "const double *weight" => numbers(&WEIGHTS),
            "wis_wavelets *wavelets" if name == "wis_triple_blend" || name == "wis_sparse_unpack" => {
                unwritten(PRODUCT * size_of::<Wavelets>())
            }
            "const wis_wavelets *wavelets" => numbers(&WAVELETS),
            "const uint8_t *packed" => packed(),
            "uint8_t *packed" => unwritten(packed().len()),
            "const wis_visibility *visibility" => self.visibility.clone(),
            "const void *memory" => self.stored(name).to_vec(),
            "void *memory" if name == "wis_environment_finish" => self.light_memory[0].clone(),
            "void *memory" if name == "wis_environment_turn" => self.light_memory[1].clone(),
            "void *memory" => unwritten(self.size(name).bytes),
            "void *scratch" if name == "wis_environment_run" => self.light_scratch[0].clone(),
            "void *scratch" if name == "wis_environment_finish" => self.light_scratch[1].clone(),
            "void *scratch" => unwritten(self.size(name).scratch_bytes),
            "const float world_from_map[9]" | "const float world_from_tree[9]" => numbers(&ROTATION),
            "const float *u" | "const float u[2]" => numbers(&RANDOM[..count]),
            "const float *wi" | "const float wi[3]" => numbers(&DIRECTIONS[..count]),
            "const float *point" | "const float point[2]" => numbers(&RANDOM[0]),
            "float *points" => numbers(&RANDOM),
            "uint32_t *index" => numbers(&[0u32, 1, 2]),
            "wis_light *lights" => unwritten(self.size(name).bytes),
            _ if parameter.is_result() || parameter.is_handle() || parameter.name == "diagnostic" => {
                let layout = headers().pointed(parameter);
                let elements = match parameter.name.as_str() {
                    "offset" | "drawn" | "status" | "pdf" => count,
                    "u" | "out" | "point" => 2 * count,
                    "ray" => RAYS,
                    "wavelets" => 2,
                    "label" => (WIDTH * HEIGHT) as usize,
                    _ => 1,
                };
                let bytes = layout.size * parameter.elements.unwrap_or(elements);
                if layout.begins_with_size() { sized(bytes) } else { unwritten(bytes) }
            }
            other => panic!("no argument for {other} of {name}"),
        }
    }

    pub fn light(&self) -> &[u8] {
        &self.light_memory[1]
    }

    pub fn tree(&self) -> &[u8] {
        &self.tree
    }

    /// An object of another kind than a handle's.
    pub fn other_object(&self, kind: &str) -> Vec<u8> {
        if kind == "wis_tree" { self.jitter.clone() } else { self.tree.clone() }
    }

    /// The object that a function opens.
    fn stored(&self, function: &str) -> &[u8] {
        match function {
            name if name.starts_with("wis_tree") => &self.tree,
            name if name.starts_with("wis_visibility") => &self.visibility,
            name if name.starts_with("wis_environment") => &self.light_memory[1],
            name if name.starts_with("wis_product") => &self.grid,
            _ => &self.jitter,
        }
    }

    /// The memory that a function builds in.
    fn size(&self, function: &str) -> MemorySize {
        let found = self.sizes.iter().find(|(object, _)| function.starts_with(object));
        let (_, size) = *found.unwrap_or_else(|| panic!("{function} has no size"));
        let count = if function == "wis_product_prepare" { COUNT } else { 1 };
        MemorySize { bytes: count * size.bytes, ..size }
    }

    fn light_config(&self) -> Vec<u8> {
        plain(|config: &mut LightConfig| {
            config.size = size_of::<LightConfig>() as u32;
            config.layout = WIS_LAYOUT_LATLONG;
            (config.width, config.height, config.channels) = (WIDTH, HEIGHT, 3);
            config.format = WIS_FORMAT_F32;
            config.pixels = self.pixels.as_ptr().cast();
            config.world_from_map = ROTATION.as_ptr();
        })
    }

    /// What a source reads, and nothing else.
    pub fn tree_config(&self, source: u32) -> Vec<u8> {
        plain(|config: &mut TreeConfig| {
            (config.size, config.source) = (size_of::<TreeConfig>() as u32, source);
            match source {
                WIS_TREE_PIXELS => {
                    (config.dimensions, config.depth, config.pixels) = (2, 2, self.image.as_ptr());
                }
                WIS_TREE_PRODUCT => (config.tree_count, config.trees) = (COUNT as u32, self.trees.as_ptr()),
                WIS_TREE_BLEND => {
                    (config.tree_count, config.trees) = (COUNT as u32, self.trees.as_ptr());
                    config.weight = WEIGHTS.as_ptr();
                }
                WIS_TREE_WAVELETS => {
                    (config.average, config.count) = (1.0, 2);
                    config.wavelets = self.lists[0].pointer().cast_const().cast();
                }
                _ => {
                    (config.depth, config.least) = (2, 0.25);
                    config.environment = self.light.pointer().cast_const().cast();
                    config.world_from_tree = ROTATION.as_ptr();
                }
            }
        })
    }
}

/// The wavelets as bytes.
pub fn packed() -> Vec<u8> {
    let mut bytes = vec![0; 100];
    let length = wis::wavelets::packed::pack(1.0, &WAVELETS, &mut bytes);
    bytes.truncate(length);
    bytes
}

fn grid_config() -> Vec<u8> {
    plain(|config: &mut GridConfig| {
        (config.size, config.flags) = (size_of::<GridConfig>() as u32, WIS_PRODUCT_CHECKSUM);
    })
}

extern "C" fn lambert(_: *mut c_void, count: usize, wi: *const f32, f_cos: *mut f32) -> c_int {
    for i in 0..count {
        // SAFETY: the library gives `count` directions and as many results.
        unsafe { f_cos.add(i).write(wi.add(3 * i + 2).read().max(0.0)) };
    }
    0
}

/// The wavelets of two squares.
static WAVELETS: [Wavelets; 2] = [
    Wavelets { position: 0, level: 0, detail: [0.5, 0.0, -0.25] },
    Wavelets { position: 1 << 22, level: 1, detail: [0.5, 0.0, -0.25] },
];

/// Which of two lights each texel belongs to.
static LABELS: [u32; (WIDTH * HEIGHT) as usize] = {
    let mut labels = [0; (WIDTH * HEIGHT) as usize];
    let mut i = 0;
    while i < labels.len() {
        labels[i] = i as u32 / 7 % 2;
        i += 1;
    }
    labels
};

fn jitter_config() -> Vec<u8> {
    plain(|config: &mut JitterConfig| {
        (config.size, config.light_count) = (size_of::<JitterConfig>() as u32, 2);
        (config.distribution, config.label) = (WIS_JITTER_ENERGY, LABELS.as_ptr());
    })
}

/// The bytes of numbers.
pub fn numbers<T: Copy>(values: &[T]) -> Vec<u8> {
    // SAFETY: numbers have no padding.
    unsafe { std::slice::from_raw_parts(values.as_ptr().cast(), size_of_val(values)) }.to_vec()
}

/// A struct that only its size is known of.
/// Three lights.
fn strata_config() -> Vec<u8> {
    plain(|config: &mut StrataConfig| {
        config.size = size_of::<StrataConfig>() as u32;
        config.count = 3;
    })
}

fn sized(size: usize) -> Vec<u8> {
    let mut bytes = vec![SENTINEL; size];
    bytes[..4].copy_from_slice(&(size as u32).to_ne_bytes());
    bytes
}

fn expect_ok(status: Status) {
    assert_eq!(status, Status::Ok);
}
