//! Wavelet importance sampling at a shading point: a rotated map x a tabulated BRDF as trees, their product, and samples of it.
//! What c-examples/wavelets.c does.

use glam::Vec3;
use std::error::Error;
use std::f64::consts::PI;
use wis::blob::Size;
use wis::points::sobol;
use wis::sphere::{Frame, octahedral_direction, square};
use wis::wavelets::combine::{add_in, multiply_in, product_size, sum_size};
use wis::wavelets::image::Config;
use wis::wavelets::rotated::Rotation;
use wis::wavelets::stored::{Built, Header, Stored};
use wis::wavelets::table::View;
use wis::{Block, Map};

const WIDTH: u32 = 64;
const HEIGHT: u32 = 32;
const DEPTH: u32 = 6;
const SLICES: u32 = 16;
const SAMPLES: usize = 8;
const BUDGET: f32 = 0.001;

/// A tree in memory of its own.
fn build(size: Option<Size>, tree: impl FnOnce(&mut [u8], &mut [u8]) -> Built<Header>) -> Result<Vec<Block>, String> {
    let size = size.ok_or("no memory is as long")?;
    let mut memory = vec![Block::ZERO; Block::count(size.bytes)];
    let mut scratch = vec![Block::ZERO; Block::count(size.scratch)];
    let (memory_bytes, scratch) = (Block::bytes_mut(&mut memory), &mut Block::bytes_mut(&mut scratch)[..size.scratch]);
    tree(memory_bytes, scratch).map_err(|error| error.to_string())?;
    Ok(memory)
}

/// A glossy BRDF x cosine about a normal of +z: Phong's lobe over a little of Lambert's.
fn brdf_cosine(wo: Vec3, wi: Vec3) -> f32 {
    let mirror = Vec3::new(-wo.x, -wo.y, wo.z);
    if wi.z > 0.0 { wi.z * (0.1 + 2.0 * mirror.dot(wi).max(0.0).powf(40.0)) } else { 0.0 }
}

/// The frame of the trees about the mirror direction of a view.
fn frame(view: &View) -> Frame {
    let [x, y, z] = view.axes.map(<[f32; 3]>::from);
    Frame::from_array(&[x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]])
}

/// A slice of the table: BRDF x cosine of a view over the square about its mirror direction (Clarberg et al. 2005, Section 5).
fn slice(number: u32) -> Result<Vec<Block>, String> {
    let angle = (number as f32 + 0.5) / SLICES as f32 * std::f32::consts::FRAC_PI_2;
    let wo = Vec3::new(angle.sin(), 0.0, angle.cos());
    let frame = frame(&View::new(Vec3::Z, wo, SLICES));
    let side = 1 << DEPTH;
    let centre = |k: u32| (k as f32 + 0.5) / side as f32;
    let values: Vec<f32> = (0..side * side)
        .map(|k| {
            1e-4 + brdf_cosine(wo, frame.to_world(octahedral_direction([centre(k / side), centre(k % side)])).into())
        })
        .collect();
    let config = Config { dimensions: 2, depth: DEPTH, error_budget: BUDGET };
    build(config.size(), |memory, scratch| config.build_in(&values, 0, memory, scratch))
}

fn main() -> Result<(), Box<dyn Error>> {
    // 1. The light: a lat-long map of luminance, +z up. Here a dim sky with one bright texel.
    let mut pixels: Vec<f32> = (0..WIDTH * HEIGHT).map(|k| if k / WIDTH < HEIGHT / 2 { 0.5 } else { 0.1 }).collect();
    pixels[(8 * WIDTH + 12) as usize] = 500.0;
    let map = Map::latlong(WIDTH, HEIGHT, 1, &pixels);
    let size = map.size()?;
    let mut memory = vec![Block::ZERO; Block::count(size.bytes)];
    let mut scratch = vec![Block::ZERO; Block::count(size.scratch)];
    let environment = map.build_in(&mut memory, &mut scratch)?;

    // 2. A shading point: the slices beside its view, and the frame of the trees about its mirror direction.
    let (normal, wo) = (Vec3::Z, Vec3::new(0.6, 0.0, 0.8));
    let view = View::new(normal, wo, SLICES);
    let frame = frame(&view);

    // 3. The map about that direction, and the BRDF between the two tabulated views beside wo.
    let config = Rotation { depth: DEPTH, error_budget: BUDGET, least: 0.0 };
    let rotated = build(config.size(), |memory, scratch| config.build_in(&environment, &frame, memory, scratch))?;
    let rotated = Stored::open(Block::bytes(&rotated))?;
    let [low, high] = [slice(view.slices[0])?, slice(view.slices[1])?];
    let slices = [Stored::open(Block::bytes(&low))?, Stored::open(Block::bytes(&high))?];
    let brdf = build(sum_size(&slices), |memory, scratch| add_in(&slices, &view.weights, memory, scratch))?;
    let brdf = Stored::open(Block::bytes(&brdf))?;

    // 4. Their product. Its average over the square, times 4 pi, is the light that the point reflects if nothing casts a shadow.
    let factors = [rotated, brdf];
    let product = build(product_size(&factors), |memory, scratch| multiply_in(&factors, memory, scratch))?;
    let product = Stored::open(Block::bytes(&product))?;
    println!("reflected luminance: {:.4}", 4.0 * PI * product.header.info().average);

    // 5. Points of a well-spread set are warped in place: samples of the product, as points of the square.
    let mut points: Vec<f32> = (0..SAMPLES as u32).flat_map(|index| sobol(7, index)).collect();
    let mut index: Vec<u32> = (0..SAMPLES as u32).collect();
    product.tree.warp_in_place(&mut points, &mut index)?;

    // 6. Their directions, densities per steradian, and the way back.
    for (point, index) in points.chunks_exact(2).zip(index) {
        let wi = Vec3::from(frame.to_world(octahedral_direction([point[0], point[1]])));
        let pdf = f64::from(product.tree.pdf(point)) / (4.0 * PI);
        let found = f64::from(product.tree.pdf(&square(frame.to_map(wi.to_array()).into()))) / (4.0 * PI);
        let mut u = [0.0; 2];
        product.tree.invert(point, &mut u)?;
        println!("{index}: wi {wi:.4}  pdf {pdf:.4}  pdf(wi) {found:.4}  u ({:.4}, {:.4})", u[0], u[1]);
    }
    Ok(())
}
