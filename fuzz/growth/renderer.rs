//! Curves of wis.h.

use crate::world::{Block, Map, World, call, counted, directions, numbers, sized};
use std::ffi::{c_int, c_void};
use std::ptr::{null, null_mut};
use wis::Drawn;
use wis::direct::Ray;
use wis::ffi::check::*;
use wis::ffi::check_point::*;
use wis::ffi::direct::*;
use wis::ffi::light::*;
use wis::ffi::material::*;
use wis::ffi::points::*;
use wis::ffi::pool::*;
use wis::ffi::product::*;
use wis::ffi::sampler::*;
use wis::ffi::sampling::*;
use wis::ffi::visibility::*;
use wis::ffi::wave::*;
use wis::ffi::{MemorySize, wis_status_string, wis_version};
use wis::pool::Pick;
use wis::status::Status;

/// Texels of maps: 16 x 8 to 256 x 128.
const TEXELS: [usize; 4] = [512, 2048, 8192, 32768];
const COUNTS: [usize; 4] = [64, 256, 1024, 4096];
/// Texels of whole builds, whose 128 cells are most of the work of small ones.
const BUILDS: [usize; 3] = [2048, 32768, 131072];
const LOBES: [usize; 2] = [1, 4];

pub fn run(world: &mut World) {
    small(world);
    environments(world);
    builds(world);
    samplers(world);
    caches(world);
    rays(world);
    products(world);
    samples(world);
    pools(world);
    points(world);
}

fn constant(_: f64) -> f64 {
    1.0
}

fn linear(n: f64) -> f64 {
    n
}

fn small(w: &mut World) {
    w.curve("wis_status_string", "status", &[1, 1000], constant, |w, n| {
        counted!(w, wis_status_string(n as u32));
    });
    w.curve("wis_version", "call", &[1, 4], constant, |w, _| {
        counted!(w, wis_version());
    });
    w.curve("wis_pixel_seed", "x", &[1, 1 << 30], constant, |w, n| {
        counted!(w, wis_pixel_seed(n as u32, n as u32, n as u32));
    });
    w.curve("wis_visibility_key", "position", &[1, 1 << 30], constant, |w, n| {
        let (position, normal, mut key) = ([n as f32; 3], [0.0, 0.0, 1.0], 0);
        counted!(w, wis_visibility_key(&position, &normal, 1.0, &mut key));
    });
    w.at_most("wis_material_init", "lobes", &LOBES, linear, |w, n| {
        let mut material = unhashed(n);
        counted!(w, wis_material_init(&mut material, null_mut()));
    });
}

fn environments(w: &mut World) {
    w.curve("wis_base", "texels", &TEXELS, constant, |w, n| {
        let (memory, radiance, mut base) = (Map::new(n).build(w), [n as f32; 3], 0.0);
        counted!(w, wis_base(memory.of(), &radiance, &mut base));
    });
    w.curve("wis_environment_size", "texels", &TEXELS, constant, |w, n| {
        let (map, mut size) = (Map::new(n), MemorySize::default());
        counted!(w, wis_environment_size(&map.config, &mut size, null_mut()));
    });
    w.curve("wis_environment_size", "bytes by texels", &[32768, 131072, 524288], linear, |w, n| {
        let bytes = Map::new(n).size(w).bytes;
        w.bytes(bytes);
    });
    w.curve("wis_environment_size", "scratch by texels", &[32768, 131072, 524288], linear, |w, n| {
        let bytes = Map::new(n).size(w).scratch_bytes;
        w.bytes(bytes);
    });
    w.at_most("wis_environment_open", "texels", &BUILDS, linear, |w, n| {
        let (memory, mut handle) = (Map::new(n).build(w), null());
        counted!(w, wis_environment_open(memory.of(), memory.bytes, &mut handle, null_mut()));
    });
    w.curve("wis_environment_describe", "texels", &TEXELS, constant, |w, n| {
        let (memory, mut info) = (Map::new(n).build(w), sized());
        counted!(w, wis_environment_describe(memory.of(), &mut info));
    });
    w.curve("wis_environment_turn", "texels", &TEXELS, constant, |w, n| {
        let (mut memory, mut handle) = (Map::new(n).build(w), null());
        let (place, bytes) = (memory.at(), memory.bytes);
        counted!(w, wis_environment_turn(place, bytes, null(), &mut handle, null_mut()));
    });
}

/// A build in its parts.
struct Build {
    map: Map,
    memory: Block,
    scratch: Block,
    items: [u32; 3],
}

impl Build {
    fn new(w: &World, texels: usize) -> Build {
        let map = Map::new(texels);
        let size = map.size(w);
        let scratch = Block::new(size.scratch_bytes);
        Build { map, memory: Block::new(size.bytes), scratch, items: [0; 3] }
    }

    fn begin(&mut self, w: &World) {
        let (config, scratch, room) = (&self.map.config, self.scratch.at(), self.scratch.bytes);
        let status = call!(w, wis_environment_begin(config, scratch, room, &mut self.items, null_mut()));
        assert_eq!(status, Status::Ok);
    }

    fn run(&mut self, w: &World, pass: u32) {
        let (config, scratch, room, count) =
            (&self.map.config, self.scratch.at(), self.scratch.bytes, self.items[pass as usize]);
        let (memory, bytes) = (self.memory.at(), self.memory.bytes);
        let none = null_mut();
        let status = call!(w, wis_environment_run(config, memory, bytes, scratch, room, pass, 0, count, none));
        assert_eq!(status, Status::Ok);
    }
}

/// Counts a whole build.
fn built(w: &mut World, texels: usize, budget: f32, filter: u32, flags: u32) {
    let mut build = Build::new(w, texels);
    let config = &mut build.map.config;
    (config.error_budget, config.filter, config.flags) = (budget, filter, flags);
    let size = build.map.size(w);
    (build.memory, build.scratch) = (Block::new(size.bytes), Block::new(size.scratch_bytes));
    let (config, memory, scratch) = (&build.map.config, build.memory.at(), build.scratch.at());
    let (bytes, room, mut handle) = (build.memory.bytes, build.scratch.bytes, null());
    counted!(w, wis_environment_init(config, memory, bytes, scratch, room, &mut handle, null_mut()));
}

fn builds(w: &mut World) {
    let (smooth, nearest) = (WIS_FILTER_BILINEAR, WIS_FILTER_NEAREST);
    // Strata take as long as hundreds of thousands of texels.
    w.at_most("wis_environment_init", "texels", &BUILDS, linear, |w, n| built(w, n, 0.0, smooth, 0));
    w.at_most("wis_environment_init", "texels, budget", &TEXELS, linear, |w, n| built(w, n, 0.01, smooth, 0));
    w.at_most("wis_environment_init", "texels, nearest", &TEXELS, linear, |w, n| {
        built(w, n, 0.0, nearest, WIS_ENVIRONMENT_COMPENSATED);
    });
    w.at_most("wis_environment_begin", "rows^2", &TEXELS, f64::sqrt, |w, n| {
        let mut build = Build::new(w, n);
        let (config, scratch, room) = (&build.map.config, build.scratch.at(), build.scratch.bytes);
        counted!(w, wis_environment_begin(config, scratch, room, &mut build.items, null_mut()));
    });
    for (pass, input) in [(0, "texels, pass 0"), (1, "texels, pass 1"), (2, "texels, pass 2")] {
        w.at_most("wis_environment_run", input, &TEXELS[1..], linear, |w, n| {
            let mut build = Build::new(w, n);
            build.begin(w);
            (0..pass).for_each(|earlier| build.run(w, earlier));
            let (config, memory, scratch) = (&build.map.config, build.memory.at(), build.scratch.at());
            let (bytes, room, count, none) =
                (build.memory.bytes, build.scratch.bytes, build.items[pass as usize], null_mut());
            counted!(w, wis_environment_run(config, memory, bytes, scratch, room, pass, 0, count, none));
        });
    }
    w.at_most("wis_environment_finish", "texels", &BUILDS, linear, |w, n| {
        let mut build = Build::new(w, n);
        build.begin(w);
        (0..3).for_each(|pass| build.run(w, pass));
        let (config, memory, scratch) = (&build.map.config, build.memory.at(), build.scratch.at());
        let (bytes, room, mut handle) = (build.memory.bytes, build.scratch.bytes, null());
        counted!(w, wis_environment_finish(config, memory, bytes, scratch, room, &mut handle, null_mut()));
    });
}

/// A configuration of a sampler.
fn config(rays: usize, candidates: usize) -> SamplerConfig {
    let mut config: SamplerConfig = sized();
    (config.rays, config.candidates_per_ray) = (rays as u32, candidates as u32);
    config
}

/// The memory of a sampler.
fn room(w: &World, config: &SamplerConfig) -> Block {
    let mut size = MemorySize::default();
    assert_eq!(call!(w, wis_sampler_size(config, &mut size, null_mut())), Status::Ok);
    Block::new(size.bytes)
}

fn sampler(w: &World, config: &SamplerConfig) -> Block {
    let (mut memory, mut handle) = (room(w, config), null_mut());
    let (place, bytes) = (memory.at(), memory.bytes);
    assert_eq!(call!(w, wis_sampler_init(config, place, bytes, &mut handle, null_mut())), Status::Ok);
    memory
}

fn samplers(w: &mut World) {
    w.curve("wis_sampler_size", "rays", &COUNTS, constant, |w, n| {
        let mut size = MemorySize::default();
        counted!(w, wis_sampler_size(&config(n, 0), &mut size, null_mut()));
    });
    w.at_most("wis_sampler_size", "bytes by rays", &COUNTS, linear, |w, n| w.bytes(room(w, &config(n, 0)).bytes));
    w.curve("wis_sampler_size", "bytes by candidates", &[16, 64, 256], linear, |w, n| {
        w.bytes(room(w, &config(16, n)).bytes);
    });
    w.at_most("wis_sampler_init", "bytes", &COUNTS, linear, |w, n| {
        let config = config(n, 0);
        let (mut memory, mut handle) = (room(w, &config), null_mut());
        let (place, bytes) = (memory.at(), memory.bytes);
        counted!(w, wis_sampler_init(&config, place, bytes, &mut handle, null_mut()));
    });
    w.curve("wis_sampler_begin_pixel", "rays", &COUNTS, constant, |w, n| {
        let mut memory = sampler(w, &config(n, 0));
        counted!(w, wis_sampler_begin_pixel(memory.at()));
    });
    w.curve("wis_sampler_fault", "rays", &COUNTS, constant, |w, n| {
        let (memory, mut fault) = (sampler(w, &config(n, 0)), Default::default());
        counted!(w, wis_sampler_fault(memory.of(), &mut fault));
    });
}

fn cache(w: &World, places: usize) -> Block {
    let mut size = MemorySize::default();
    assert_eq!(call!(w, wis_visibility_cache_size(places as u32, &mut size, null_mut())), Status::Ok);
    let (mut memory, mut handle) = (Block::new(size.bytes), null_mut());
    let (place, bytes) = (memory.at(), memory.bytes);
    let status = call!(w, wis_visibility_cache_init(places as u32, place, bytes, &mut handle, null_mut()));
    assert_eq!(status, Status::Ok);
    memory
}

fn caches(w: &mut World) {
    w.curve("wis_visibility_cache_size", "places", &COUNTS, constant, |w, n| {
        let mut size = MemorySize::default();
        counted!(w, wis_visibility_cache_size(n as u32, &mut size, null_mut()));
    });
    w.curve("wis_visibility_cache_size", "bytes by places", &COUNTS, linear, |w, n| w.bytes(cache(w, n).bytes));
    w.curve("wis_visibility_cache_init", "places", &COUNTS, linear, |w, n| {
        let mut memory = cache(w, n);
        let (place, bytes, mut handle) = (memory.at(), memory.bytes, null_mut());
        counted!(w, wis_visibility_cache_init(n as u32, place, bytes, &mut handle, null_mut()));
    });
    w.curve("wis_visibility_cache_end_pass", "places", &COUNTS, linear, |w, n| {
        let mut memory = cache(w, n);
        counted!(w, wis_visibility_cache_end_pass(memory.at()));
    });
    w.curve("wis_visibility_cache_record", "count", &COUNTS, linear, |w, n| {
        let (mut memory, material, wi, reached) = (cache(w, 16), material(w, 1), directions(1, n), vec![1u8; n]);
        let mut point = point(&material);
        (point.visibility, point.visibility_key) = (memory.at(), 1);
        counted!(w, wis_visibility_cache_record(&point, n, wi.as_ptr().cast(), 0, reached.as_ptr()));
    });
}

/// GGX lobes of different widths, and Lambert's.
fn unhashed(lobes: usize) -> MaterialData {
    let mut material: MaterialData = sized();
    material.lobe_count = lobes as u32;
    material.lobe[0].kind = WIS_LOBE_LAMBERT;
    for (lobe, alpha) in material.lobe[1..lobes].iter_mut().zip([0.4, 0.1, 0.02]) {
        (lobe.kind, lobe.a, lobe.b) = (WIS_LOBE_GGX, alpha, alpha);
    }
    material
}

fn material(w: &World, lobes: usize) -> MaterialData {
    let mut material = unhashed(lobes);
    assert_eq!(call!(w, wis_material_init(&mut material, null_mut())), Status::Ok);
    material
}

fn point(material: &MaterialData) -> PointData {
    let mut point: PointData = sized();
    point.material = material;
    (point.normal, point.tangent, point.wo) = ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.6, 0.0, 0.8]);
    (point.weight, point.f0) = ([[0.25; 3]; 4], [[0.5; 3]; 4]);
    point
}

/// Counts one wis_direct.
fn direct(w: &mut World, texels: usize, rays: usize, candidates: usize, lobes: usize) {
    let (light, material) = (Map::new(texels).build(w), material(w, lobes));
    let mut memory = sampler(w, &config(rays, candidates));
    let (mut ray, mut count) = (vec![Ray::default(); rays], 0);
    let (light, point) = (light.of(), point(&material));
    counted!(w, wis_direct(memory.at(), light, &point, rays as u32, ray.as_mut_ptr(), &mut count));
}

fn rays(w: &mut World) {
    w.curve("wis_direct", "rays", &COUNTS, linear, |w, n| direct(w, 2048, n, 16, 4));
    w.curve("wis_direct", "candidates per ray", &[16, 64, 256], linear, |w, n| direct(w, 2048, 16, n, 4));
    w.curve("wis_direct", "rays of a product", &COUNTS, linear, |w, n| direct(w, 2048, n, 0, 1));
    w.at_most("wis_direct", "lobes", &LOBES, linear, |w, n| direct(w, 2048, 16, 16, n));
    w.curve("wis_direct", "texels", &TEXELS, constant, |w, n| direct(w, n, 16, 16, 4));
    w.curve("wis_direct_wave", "count", &COUNTS[..3], linear, |w, n| wave(w, n, 4));
    w.curve("wis_direct_wave", "rays", &[4, 16, 64], linear, |w, n| wave(w, 16, n));
    w.curve("wis_check", "texels", &[512, 32768], constant, |w, n| {
        let (light, mut memory, mut info) = (Map::new(n).build(w), sampler(w, &config(16, 0)), sized());
        let mut config: CheckConfig = sized();
        config.radiance = Some(white);
        counted!(w, wis_check(memory.at(), light.of(), &config, &mut info));
    });
    w.curve("wis_check_point", "texels", &[512, 32768], constant, check_point);
}

/// Counts one wis_check_point.
fn check_point(w: &mut World, texels: usize) {
    let (light, material) = (Map::new(texels).build(w), material(w, 4));
    let (mut memory, mut verdict) = (sampler(w, &config(16, 0)), sized());
    let mut point = point(&material);
    point.target = Some(even);
    counted!(w, wis_check_point(memory.at(), light.of(), &point, &mut verdict));
}

extern "C" fn even(_: *mut c_void, count: usize, _: *const f32, f_cos: *mut f32) -> c_int {
    // SAFETY: the library gives room for `count` values.
    unsafe { std::slice::from_raw_parts_mut(f_cos, count) }.fill(1.0);
    0
}

extern "C" fn white(_: *mut c_void, count: usize, _: *const f32, rgb: *mut f32) -> c_int {
    // SAFETY: the library gives room for `count` colours.
    unsafe { std::slice::from_raw_parts_mut(rgb, 3 * count) }.fill(1.0);
    0
}

fn wave(w: &mut World, count: usize, rays: usize) {
    let (light, material) = (Map::new(2048).build(w), material(w, 2));
    let mut memory = sampler(w, &config(rays, 16));
    let (mut ray, mut counts, seeds) = (vec![Ray::default(); rays * count], vec![0; count], vec![1u32; count]);
    let (normal, wo) = ([0.0f32, 0.0, 1.0], [0.6f32, 0.0, 0.8]);
    let mut wave: DirectWave = sized();
    (wave.material_count, wave.rays, wave.materials) = (1, rays as u32, &material);
    wave.normal.first = normal.as_ptr();
    wave.wo.first = wo.as_ptr();
    (wave.seed.first, wave.seed.point) = (seeds.as_ptr(), 4);
    (wave.ray.first, wave.ray.point) = (ray.as_mut_ptr().cast(), (rays * size_of::<Ray>()) as isize);
    wave.count = counts.as_mut_ptr();
    counted!(w, wis_direct_wave(memory.at(), light.of(), count, &wave));
}

/// Products of points that are alike.
struct Products {
    light: Block,
    sampler: Block,
    config: GridConfig,
    memory: Block,
    points: Vec<PointData>,
    _material: Box<MaterialData>,
}

impl Products {
    fn new(w: &World, texels: usize, count: usize, lobes: usize, cells: usize) -> Products {
        let material = Box::new(material(w, lobes));
        let (mut config, mut size): (GridConfig, _) = (sized(), MemorySize::default());
        config.divided_cells = cells as u32;
        assert_eq!(call!(w, wis_product_size(&config, &mut size, null_mut())), Status::Ok);
        Products {
            light: Map::new(texels).build(w),
            sampler: sampler(w, &crate::renderer::config(16, 0)),
            config,
            memory: Block::new(count * size.bytes),
            points: vec![point(&material); count],
            _material: material,
        }
    }

    fn prepare(mut self, w: &World) -> Products {
        let (count, mut offset, mut used) = (self.points.len(), vec![0; self.points.len()], 0);
        let (sampler, light, point) = (self.sampler.at(), self.light.of(), self.points.as_ptr());
        let (memory, bytes, config, offset) = (self.memory.at(), self.memory.bytes, &self.config, offset.as_mut_ptr());
        let status =
            call!(w, wis_product_prepare(sampler, light, config, count, point, memory, bytes, offset, &mut used));
        assert_eq!(status, Status::Ok);
        self
    }

    fn count(mut self, w: &mut World) {
        let (count, mut offset, mut used) = (self.points.len(), vec![0; self.points.len()], 0);
        let (sampler, light, point) = (self.sampler.at(), self.light.of(), self.points.as_ptr());
        let (memory, bytes, config, offset) = (self.memory.at(), self.memory.bytes, &self.config, offset.as_mut_ptr());
        counted!(w, wis_product_prepare(sampler, light, config, count, point, memory, bytes, offset, &mut used));
    }
}

fn products(w: &mut World) {
    w.curve("wis_product_size", "divided cells", &[6, 24], constant, |w, n| {
        let (mut config, mut size): (GridConfig, _) = (sized(), MemorySize::default());
        config.divided_cells = n as u32;
        counted!(w, wis_product_size(&config, &mut size, null_mut()));
    });
    w.at_most("wis_product_size", "bytes by divided cells", &[6, 24], linear, |w, n| {
        let bytes = Products::new(w, 512, 1, 1, n).memory.bytes;
        w.bytes(bytes);
    });
    w.curve("wis_product_prepare", "count", &[4, 16, 64], linear, |w, n| Products::new(w, 2048, n, 4, 0).count(w));
    w.at_most("wis_product_prepare", "lobes", &LOBES, linear, |w, n| Products::new(w, 2048, 4, n, 0).count(w));
    w.at_most("wis_product_prepare", "divided cells", &[6, 24], linear, |w, n| {
        Products::new(w, 2048, 4, 4, n).count(w)
    });
    w.curve("wis_product_prepare", "texels", &TEXELS, constant, |w, n| Products::new(w, n, 4, 4, 0).count(w));
    w.at_most("wis_product_open", "divided cells", &[6, 24], linear, |w, n| {
        let (mut made, mut handle) = (Products::new(w, 2048, 1, 4, n), null());
        made.config.flags = WIS_PRODUCT_CHECKSUM;
        let made = made.prepare(w);
        counted!(w, wis_product_open(made.light.of(), made.memory.of(), made.memory.bytes, &mut handle, null_mut()));
    });
    w.at_most("wis_product_describe", "divided cells", &[6, 24], linear, |w, n| {
        let (made, mut info) = (Products::new(w, 2048, 1, 4, n).prepare(w), sized());
        counted!(w, wis_product_describe(made.light.of(), made.memory.of(), &mut info));
    });
    w.at_most("wis_product_covers", "lobes", &LOBES, linear, |w, n| {
        let (made, mut covers) = (Products::new(w, 2048, 1, n, 0).prepare(w), 0);
        counted!(w, wis_product_covers(made.memory.of(), &made.points[0], &mut covers));
    });
}

/// Counts samples, densities and inverses of a light, or of a product.
fn sampled(w: &mut World, function: &str, texels: usize, count: usize, lobes: usize) {
    let mut made = Products::new(w, texels, 1, lobes.max(1), 0).prepare(w);
    let product = if lobes > 0 { made.memory.of() } else { null() };
    let (mut u, wi) = (numbers(2, 2 * count), directions(3, count));
    let (mut drawn, mut pdf, mut status) = (vec![Drawn::default(); count], vec![0.0; count], vec![0; count]);
    let (sampler, light, wi) = (made.sampler.at(), made.light.of(), wi.as_ptr().cast());
    match function {
        "wis_sample" => {
            counted!(w, wis_sample(sampler, light, product, count, u.as_ptr(), 0, drawn.as_mut_ptr().cast(), 0));
        }
        "wis_pdf" => {
            counted!(w, wis_pdf(sampler, light, product, count, wi, 0, pdf.as_mut_ptr(), 0));
        }
        _ => {
            counted!(w, wis_invert(sampler, light, product, count, wi, 0, u.as_mut_ptr(), 0, status.as_mut_ptr()));
        }
    }
}

fn samples(w: &mut World) {
    for function in ["wis_sample", "wis_pdf", "wis_invert"] {
        w.at_most(function, "lobes", &LOBES, linear, |w, n| sampled(w, function, 2048, 256, n));
        for (by_count, by_texels, lobes) in [("count", "texels", 0), ("count, product", "texels, product", 4)] {
            w.curve(function, by_count, &COUNTS, linear, |w, n| sampled(w, function, 2048, n, lobes));
            w.curve(function, by_texels, &TEXELS, f64::log2, |w, n| sampled(w, function, n, 256, lobes));
        }
    }
}

fn pool(w: &mut World, count: usize, picks: usize, weight: impl Fn(usize) -> f32) {
    let mut size = MemorySize::default();
    assert_eq!(call!(w, wis_pool_size(count, &mut size)), Status::Ok);
    let (mut scratch, wi) = (Block::new(size.bytes), directions(4, count));
    let weight: Vec<f32> = (0..count).map(weight).collect();
    let (mut pick, mut picked, mut sum) = (vec![Pick::default(); picks], 0, 0.0);
    let (wi, weight, room, pick) = (wi.as_ptr().cast(), weight.as_ptr(), size.bytes, pick.as_mut_ptr());
    let (picks, place, none) = (picks as u32, scratch.at(), null_mut());
    let size = size_of::<Candidates>() as u32;
    let all = Candidates { size, reserved: 0, count, wi, wi_stride: 0, weight, weight_stride: 0 };
    counted!(w, wis_pool_pick(&all, picks, 0.5, place, room, pick, &mut picked, &mut sum, none));
}

fn pools(w: &mut World) {
    w.curve("wis_pool_size", "count", &COUNTS, constant, |w, n| {
        let mut size = MemorySize::default();
        counted!(w, wis_pool_size(n, &mut size));
    });
    w.curve("wis_pool_size", "bytes by count", &COUNTS, linear, |w, n| {
        let mut size = MemorySize::default();
        assert_eq!(call!(w, wis_pool_size(n, &mut size)), Status::Ok);
        w.bytes(size.bytes);
    });
    w.curve("wis_pool_pick", "count", &COUNTS, linear, |w, n| pool(w, n, 16, |i| (i % 7) as f32));
    w.curve("wis_pool_pick", "count, one bright", &COUNTS, linear, |w, n| {
        pool(w, n, 16, |i| if i == 3 { 1e30 } else { 1.0 })
    });
    w.curve("wis_pool_pick", "count and picks", &COUNTS, linear, |w, n| pool(w, n, n, |_| 1.0));
    w.curve("wis_pool_pick", "picks", &COUNTS, constant, |w, n| pool(w, 64, n, |_| 1.0));
}

fn points(w: &mut World) {
    w.curve("wis_points_hammersley", "count", &COUNTS, linear, |w, n| {
        let mut out = vec![0.0f32; 2 * n];
        counted!(w, wis_points_hammersley(0, n as u32, n as u32, out.as_mut_ptr(), 0));
    });
    w.curve("wis_points_sobol", "count", &COUNTS, linear, |w, n| {
        let mut out = vec![0.0f32; 2 * n];
        counted!(w, wis_points_sobol(1, 0, n, out.as_mut_ptr(), 0));
    });
    w.curve("wis_points_sobol", "first", &[1, 1 << 30], constant, |w, n| {
        let mut out = vec![0.0f32; 128];
        counted!(w, wis_points_sobol(1, n as u32, 64, out.as_mut_ptr(), 0));
    });
}
