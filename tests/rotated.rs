//! Rotated maps: against the environment itself, for rotations and mirrors, and what is added.

use crate::support;
use crate::support::{BuiltTree, Memory, Random, tree_config};
use std::ptr::{null, null_mut};
use wis::ffi::MemorySize;
use wis::ffi::wavelets::environment::*;
use wis::ffi::wavelets::tree::*;
use wis::sphere;
use wis::status::Status;

const HEIGHT: u32 = 64;

/// A sky with a lamp, and its environment.
fn environment(radiance: impl Fn([f64; 3]) -> f32) -> (Memory, *const Environment) {
    environment_in(WIS_STORAGE_PYRAMID, radiance)
}

fn environment_in(storage: u32, radiance: impl Fn([f64; 3]) -> f32) -> (Memory, *const Environment) {
    let (width, height) = (2 * HEIGHT as usize, HEIGHT as usize);
    let texel = |i: usize| {
        let uv = [((i % width) as f64 + 0.5) / width as f64, ((i / width) as f64 + 0.5) / height as f64];
        radiance(sphere::latlong_direction(uv))
    };
    let texels: Vec<f32> = (0..width * height).map(texel).collect();
    // SAFETY: zeros are valid for a plain struct; the configuration describes the texels, and blocks are as large as asked for.
    unsafe {
        let mut config: EnvironmentConfig = std::mem::zeroed();
        config.size = size_of::<EnvironmentConfig>() as u32;
        (config.layout, config.width, config.height) = (WIS_LAYOUT_LATLONG, width as u32, height as u32);
        (config.channels, config.format, config.storage) = (1, WIS_FORMAT_F32, storage);
        (config.resolution, config.pixels) = (128, texels.as_ptr().cast());
        let (mut size, mut handle) = (MemorySize::default(), null());
        assert_eq!(wis_wavelet_light_size(&config, &mut size, null_mut()), Status::Ok);
        let (mut memory, mut scratch) = (Memory::new(size.bytes), Memory::new(size.scratch_bytes));
        let (place, work) = (memory.pointer(), scratch.pointer());
        let status = wis_wavelet_light_init(
            &config,
            place,
            size.bytes,
            work,
            size.scratch_bytes,
            &mut handle,
            null_mut(),
            null_mut(),
        );
        assert_eq!(status, Status::Ok);
        (memory, handle)
    }
}

/// The tree of a rotated map, and its average.
fn rotated(config: &TreeConfig) -> (Memory, TreeInfo) {
    let built = BuiltTree::new(config).unwrap();
    (built.memory, built.info)
}

fn config(environment: *const Environment, depth: u32, frame: &[f32; 9]) -> TreeConfig {
    let world_from_tree = frame.as_ptr();
    TreeConfig { depth, places: 4, environment, world_from_tree, ..tree_config(WIS_TREE_ENVIRONMENT) }
}

/// Row by row: a rotation, mirrored if asked for.
fn random_frame(random: &mut Random, mirrored: bool) -> [f32; 9] {
    let (x, helper) = (support::normalise(random.direction()), support::normalise(random.direction()));
    let cross = |a: [f32; 3], b: [f32; 3]| {
        support::normalise([0, 1, 2].map(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            f64::from(a[j]) * f64::from(b[k]) - f64::from(a[k]) * f64::from(b[j])
        }))
    };
    let y = cross(x, helper);
    let z = cross(x, y).map(|c| if mirrored { -c } else { c });
    [x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]]
}

fn luminance(d: [f64; 3]) -> f32 {
    let lamp = 0.36 * d[0] + 0.48 * d[1] + 0.8 * d[2];
    (1.0 + 0.5 * d[2] + 0.3 * d[0] + if lamp > 0.97 { 40.0 } else { 0.0 }) as f32
}

/// The light keeps its power, and each direction its radiance: where the sky is smooth to the width of a pixel, and
/// within the lamp, whatever the frame.
#[test]
fn light_is_where_it_was() {
    let (memory, handle) = environment(luminance);
    let mut info = EnvironmentInfo { size: size_of::<EnvironmentInfo>() as u32, ..Default::default() };
    // SAFETY: the memory holds the light.
    let status = unsafe {
        wis_wavelet_light_open(handle.cast(), memory.len(), &mut std::ptr::null(), &mut info, std::ptr::null_mut())
    };
    assert_eq!(status, Status::Ok);
    let power = info.power;
    let mut random = Random(5);
    for k in 0..6 {
        let frame = random_frame(&mut random, k % 2 == 1);
        let (tree, info) = rotated(&config(handle, 6, &frame));
        let mean = power / (4.0 * std::f64::consts::PI);
        assert!((info.average / mean - 1.0).abs() < 0.01, "{} {mean}", info.average);
        for _ in 0..500 {
            let local = random.direction();
            let world = [0, 1, 2].map(|i| (0..3).map(|j| f64::from(frame[3 * i + j]) * local[j]).sum::<f64>());
            let lamp = 0.36 * world[0] + 0.48 * world[1] + 0.8 * world[2];
            if (0.92..0.99).contains(&lamp) {
                continue;
            }
            let point = sphere::square(glam::Vec3::from_array(local.map(|x| x as f32)));
            let mut pdf = 0.0;
            // SAFETY: the tree is alive and the point has two numbers.
            unsafe {
                let handle = tree.bytes().as_ptr().cast();
                assert_eq!(wis_tree_pdf(handle, point.as_ptr(), &mut pdf), Status::Ok);
            }
            let value = f64::from(pdf) * info.average;
            let expected = f64::from(luminance(world));
            assert!((value - expected).abs() < 0.06 + 0.01 * expected, "{world:?}: {value} {expected}");
        }
    }
}

/// What is added is a share of the mean, and rotations of map and tree cancel.
#[test]
fn the_least_and_the_frames() {
    let (_memory, handle) = environment(luminance);
    let frame = random_frame(&mut Random(7), false);
    let plain = rotated(&TreeConfig { world_from_tree: null(), ..config(handle, 5, &frame) });
    let both = rotated(&TreeConfig { world_from_map: frame.as_ptr(), ..config(handle, 5, &frame) });
    assert!((plain.1.average / both.1.average - 1.0).abs() < 1e-3);
    let more = rotated(&TreeConfig { least: 0.5, ..config(handle, 5, &frame) });
    let less = rotated(&config(handle, 5, &frame));
    // The map's own mean is not that of the look-ups, but for a per cent.
    let added = (more.1.average - less.1.average) / less.1.average;
    assert!((added - 0.5).abs() < 0.01, "{added}");
    let (_memory, black) = environment(|_| 0.0);
    assert_eq!(rotated(&TreeConfig { least: 1.0, ..config(black, 5, &frame) }).1.average, 0.0);
}

/// A sparse light keeps its squares in another order than one in heap order, and means the same.
#[test]
fn sparse_lights_rotate_as_others_do() {
    let lights = [WIS_STORAGE_PYRAMID, WIS_STORAGE_SPARSE].map(|storage| environment_in(storage, luminance));
    let frame = random_frame(&mut Random(11), false);
    let trees = [0, 1].map(|k: usize| rotated(&config(lights[k].1, 5, &frame)).0);
    let mut random = Random(13);
    for _ in 0..300 {
        let point = [random.f32(), random.f32()];
        let [a, b] = [0, 1].map(|k: usize| {
            let mut pdf = 0.0;
            // SAFETY: the tree is alive and the point has two numbers.
            unsafe {
                assert_eq!(wis_tree_pdf(trees[k].bytes().as_ptr().cast(), point.as_ptr(), &mut pdf), Status::Ok);
            }
            pdf
        });
        assert!((a - b).abs() <= 1e-3 * a, "{point:?}: {a} {b}");
    }
}
