//! The browser's page: a small path tracer around wis as one WebAssembly module. A worker makes a tracer, writes a map into it,
//! builds the light, and renders samples of its rows. All functions take the tracer that `tracer_new` made.
#![cfg_attr(target_arch = "wasm32", no_std)]

extern crate alloc;

mod bits;
mod light;
mod material;
mod memory;
mod path;
mod scene;

use alloc::boxed::Box;
use alloc::vec;
use alloc::vec::Vec;
use glam::{Mat3, Vec3, vec3};
use light::{Map, Samples};
use material::Material;
use path::{MAX_RAYS, Method, World};
use scene::{MATERIALS, Scene};
use wis::light::environment::turn;
use wis::points::{pixel_seed, sobol};
use wis::sphere::Frame;
use wis::{Block, Config, Environment, Filter, Level, Sampler};

/// MIS, wis, and a reference by each, with other random points.
const PICTURES: usize = 4;
const MAX_CANDIDATES: u32 = 64;
const EYE: Vec3 = vec3(0.0, -6.4, 2.4);
const TARGET: Vec3 = vec3(0.0, 0.0, 0.74);
/// Half the height of the picture plane at distance 1, for a square picture.
const ZOOM: f32 = 0.285;

#[derive(Default)]
struct Picture {
    sums: Vec<Vec3>,
    samples: u32,
}

/// One worker's state.
pub struct Tracer {
    scene: Scene,
    map: Map,
    samples: Samples,
    blob: Vec<Block>,
    working: Vec<Block>,
    materials: [Material; MATERIALS],
    rays: u32,
    candidates: u32,
    depth: u32,
    width: u32,
    height: u32,
    /// Its rows are `first`, `first + step` ...
    first: u32,
    step: u32,
    pictures: [Picture; PICTURES],
}

fn materials(chosen: Material) -> [Material; MATERIALS] {
    let mut floor = Material::new(Vec3::splat(0.5), Vec3::ZERO, 1.0);
    floor.tiles = true;
    [floor, chosen, Material::new(vec3(0.55, 0.25, 0.16), Vec3::splat(0.04), 0.3)]
}

/// A tracer for a map of this size.
#[unsafe(no_mangle)]
pub extern "C" fn tracer_new(width: u32, height: u32) -> *mut Tracer {
    let (width, height) = (width as usize, height as usize);
    let most = Config { rays: MAX_RAYS as u32, candidates_per_ray: MAX_CANDIDATES, hits_per_pixel: 0, reserved: 0 };
    Box::into_raw(Box::new(Tracer {
        scene: Scene::new(),
        map: Map { width, height, texels: vec![Vec3::ZERO; width * height], frame: Mat3::IDENTITY },
        samples: Samples::default(),
        blob: Vec::new(),
        working: vec![Block::ZERO; Block::count(most.bytes())],
        materials: materials(Material::new(Vec3::ZERO, Vec3::ONE, 0.2)),
        rays: 4,
        candidates: 0,
        depth: 1,
        width: 0,
        height: 0,
        first: 0,
        step: 1,
        pictures: Default::default(),
    }))
}

/// Where the map goes: RGB floats.
#[unsafe(no_mangle)]
pub extern "C" fn tracer_texels(tracer: &mut Tracer) -> *mut Vec3 {
    tracer.map.texels.as_mut_ptr()
}

/// Builds the light of the map, of wis and of MIS; 0 if that failed.
#[unsafe(no_mangle)]
pub extern "C" fn tracer_build(tracer: &mut Tracer, compensated_mis: u32) -> u32 {
    let map = &tracer.map;
    tracer.samples = Samples::new(map, compensated_mis != 0);
    if !tracer.blob.is_empty() {
        return 1;
    }
    let texels: &[f32] = bytemuck::cast_slice(&map.texels);
    let described = wis::Map::latlong(map.width as u32, map.height as u32, 3, texels);
    let described = wis::Map { filter: Filter::Nearest, rays_only: true, ..described };
    let Ok(size) = described.size() else { return 0 };
    let mut blob = vec![Block::ZERO; Block::count(size.bytes)];
    let mut scratch = vec![Block::ZERO; Block::count(size.scratch)];
    let built = described.build_in(&mut blob, &mut scratch).is_ok();
    tracer.blob = blob;
    u32::from(built)
}

/// Turns the light: about the vertical axis, then about the axis to the right; in radians.
#[unsafe(no_mangle)]
pub extern "C" fn tracer_turn(tracer: &mut Tracer, azimuth: f32, tilt: f32) {
    let frame = Mat3::from_rotation_x(tilt) * Mat3::from_rotation_z(azimuth);
    tracer.map.frame = frame;
    if let Some(frame) = Frame::new(&frame.transpose().to_cols_array()) {
        turn(Block::bytes_mut(&mut tracer.blob), &frame);
    }
}

/// What the knot and the left sphere are made of. Roughness is the root of alpha.
#[unsafe(no_mangle)]
pub extern "C" fn tracer_material(tracer: &mut Tracer, kind: u32, roughness: f32) {
    let alpha = (roughness * roughness).clamp(1e-3, 1.0);
    tracer.materials = materials(match kind {
        0 => Material::new(Vec3::ZERO, vec3(0.95, 0.64, 0.32), alpha),
        1 => Material::new(vec3(0.05, 0.22, 0.2), Vec3::splat(0.05), alpha),
        _ => Material::new(vec3(0.4, 0.42, 0.45), Vec3::ZERO, 1.0),
    });
}

/// Rays for light at a hit, candidates for each (0: wis chooses), and hits of a path.
#[unsafe(no_mangle)]
pub extern "C" fn tracer_effort(tracer: &mut Tracer, rays: u32, candidates: u32, depth: u32) {
    tracer.rays = rays.clamp(1, MAX_RAYS as u32);
    tracer.candidates = candidates.min(MAX_CANDIDATES);
    tracer.depth = depth;
}

/// Begins pictures of this size, of which this tracer renders the rows `first`, `first + step` ...
#[unsafe(no_mangle)]
pub extern "C" fn tracer_begin(tracer: &mut Tracer, width: u32, height: u32, first: u32, step: u32) {
    (tracer.width, tracer.height, tracer.first, tracer.step) = (width, height, first, step.max(1));
    let pixels = width * height.saturating_sub(first).div_ceil(tracer.step);
    for picture in &mut tracer.pictures {
        picture.samples = 0;
        picture.sums.clear();
        picture.sums.resize(pixels as usize, Vec3::ZERO);
    }
}

/// Adds samples to each pixel of a picture; where the sums are.
#[unsafe(no_mangle)]
pub extern "C" fn tracer_render(tracer: &mut Tracer, picture: u32, samples: u32) -> *const Vec3 {
    let Tracer { width, height, rays, candidates, .. } = *tracer;
    // Hits share no products: those do not know what BSDF rays bring.
    let config = Config { rays, candidates_per_ray: candidates, hits_per_pixel: 0, reserved: 0 };
    let out = &mut tracer.pictures[picture as usize % PICTURES];
    let environment = Environment::view(Block::bytes(&tracer.blob));
    let sampler = Sampler::new(Level::detect(), config, Block::bytes_mut(&mut tracer.working));
    let (Some(environment), Some(mut sampler)) = (environment, sampler) else { return out.sums.as_ptr() };
    let world = World {
        scene: &tracer.scene,
        map: &tracer.map,
        samples: &tracer.samples,
        environment,
        materials: &tracer.materials,
        rays: rays as usize,
        depth: tracer.depth,
    };
    let method = [Method::Mis, Method::Wis][picture as usize % 2];
    let forward = (TARGET - EYE).normalize();
    let right = forward.cross(Vec3::Z).normalize();
    let up = right.cross(forward);
    let unit = 2.0 * ZOOM / height as f32;
    let places = (tracer.first..height).step_by(tracer.step as usize).flat_map(|y| (0..width).map(move |x| (x, y)));
    for (sum, (x, y)) in out.sums.iter_mut().zip(places) {
        let seed = pixel_seed(x, y, picture);
        sampler.begin_pixel();
        for sample in out.samples..out.samples + samples {
            let [u, v] = sobol(seed, sample);
            let (px, py) = (x as f32 + u - 0.5 * width as f32, 0.5 * height as f32 - y as f32 - v);
            let d = (forward + right * (px * unit) + up * (py * unit)).normalize();
            *sum += world.path(method, EYE, d, seed, sample, &mut sampler);
        }
    }
    out.samples += samples;
    out.sums.as_ptr()
}

/// Twenty rays as 80 numbers, for the test that their bits are those of the C library.
#[unsafe(no_mangle)]
pub extern "C" fn twenty_rays() -> *const f32 {
    Box::leak(Box::new(bits::twenty_rays())).as_ptr().cast()
}

#[cfg(target_arch = "wasm32")]
#[panic_handler]
fn stop(_: &core::panic::PanicInfo<'_>) -> ! {
    core::arch::wasm32::unreachable()
}
