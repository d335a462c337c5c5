//! The paper's own system: the map turned about every direction of a grid, and BRDF tables for two dimensions of the view
//! in that frame; built, measured, and set beside the product that needs neither.

use crate::{middle, relative_variance, tilted};
use anyhow::Result;
use glam::{Mat3, Vec3};
use std::fmt::Write;
use std::time::Instant;
use wis_ffi_tests::client::{self, Block, Density, Environment, Preparation, Tree};
use wis_ffi_tests::data;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::Bsdf;

const THREADS: usize = 2;
/// The variance that pruning may add.
const BUDGET: f32 = 0.01;
/// Pixels are no darker than this share of the mean, so that the product's pdf is above 0.
const FLOOR: f32 = 0.02;

/// The frame of a direction: its columns in world space, the third the direction itself.
pub fn frame(direction: Vec3) -> Mat3 {
    let (x, y) = direction.any_orthonormal_pair();
    Mat3::from_cols(x, y, direction)
}

/// Directions in a tree's frame: four places in each pixel of the octahedral square, pixel by pixel.
fn places(depth: u32) -> Vec<Vec3> {
    let (side, fine) = (1usize << depth, 2usize << depth);
    let place = |i: usize, k: usize| middle((2 * (i / side) + k / 2) * fine + 2 * (i % side) + k % 2, fine);
    (0..side * side).flat_map(|i| (0..4).map(move |k| place(i, k))).collect()
}

/// The map about one direction.
fn turned(map: &Cube, direction: Vec3, places: &[Vec3]) -> client::Result<Tree> {
    let frame = frame(direction);
    let mean = |four: &[Vec3]| four.iter().map(|&d| map.at(frame * d)).sum::<f32>() * 0.25 + FLOOR * map.mean;
    let pixels: Vec<f32> = places.chunks_exact(4).map(mean).collect();
    Tree::new(pixels.len().ilog2() / 2, BUDGET, &pixels)
}

/// The light on the faces of a cube, for quick look-ups.
pub struct Cube {
    pixels: Vec<f32>,
    mean: f32,
}

/// Pixels along an edge of the cube.
const EDGE: usize = 256;

impl Cube {
    pub fn new(light: &Light) -> Cube {
        let at = |i: usize| (2 * i + 1) as f32 / EDGE as f32 - 1.0;
        let pixel = |k: usize| {
            let (face, s, t) = (k / (EDGE * EDGE), at(k / EDGE % EDGE), at(k % EDGE));
            let sign = if face % 2 == 0 { 1.0 } else { -1.0 };
            let d = [Vec3::new(sign, s, t), Vec3::new(t, sign, s), Vec3::new(s, t, sign)][face / 2];
            (d.normalize(), light.radiance(d.normalize()), d.length().powi(-3))
        };
        let all: Vec<_> = (0..6 * EDGE * EDGE).map(pixel).collect();
        let weight: f32 = all.iter().map(|p| p.2).sum();
        let mean = all.iter().map(|p| p.1 * p.2).sum::<f32>() / weight;
        Cube { pixels: all.into_iter().map(|p| p.1).collect(), mean }
    }

    /// The pixel that a direction meets.
    pub fn at(&self, d: Vec3) -> f32 {
        let [x, y, z] = d.abs().to_array();
        let (face, major, s, t) = if x >= y && x >= z {
            (0, d.x, d.y, d.z)
        } else if y >= z {
            (2, d.y, d.z, d.x)
        } else {
            (4, d.z, d.x, d.y)
        };
        let scale = 0.5 * EDGE as f32 / major.abs();
        let cell = |c: f32| ((c * scale + 0.5 * EDGE as f32) as usize).min(EDGE - 1);
        self.pixels[((face + usize::from(major < 0.0)) * EDGE + cell(s)) * EDGE + cell(t)]
    }
}

/// Writes the section.
pub fn write(out: &mut String, light: &Light, environment: &Environment) -> Result<()> {
    writeln!(out, "\n## The map turned about every direction (Section 5.1)\n\n{TEXT}")?;
    writeln!(out, "| directions x pixels | trees | seconds | MB | without pruning, MB |\n|---|---:|---:|---:|---:|")?;
    let map = Cube::new(light);
    for (grid, depth) in [(64u32, 6u32), (128, 7)] {
        let start = Instant::now();
        let places = places(depth);
        let cells: Vec<u32> = (0..grid * grid).collect();
        let sizes = std::thread::scope(|scope| {
            let work = |part| {
                let (map, places) = (&map, &places);
                scope.spawn(move || -> Result<u64> {
                    let mut bytes = 0;
                    for &cell in <[u32]>::iter(part) {
                        let direction = Vec3::from_array(client::grid_direction(grid, cell)?);
                        bytes += turned(map, direction, places)?.info.bytes;
                    }
                    Ok(bytes)
                })
            };
            let threads: Vec<_> = cells.chunks(cells.len().div_ceil(THREADS)).map(work).collect();
            threads.into_iter().map(|t| t.join().expect("no panic")).sum::<Result<u64>>()
        })?;
        let seconds = start.elapsed().as_secs_f64();
        let whole = f64::from(grid * grid) * f64::from((1u32 << (2 * depth)) - 1) / 3.0 * 24.0 / 1e6;
        let (side, count, mb) = (1 << depth, grid * grid, sizes as f64 / 1e6);
        writeln!(out, "| {grid} x {grid} x {side} x {side} | {count} | {seconds:.1} | {mb:.0} | {whole:.0} |")?;
    }
    compare(out, light, environment, &map)
}

const TEXT: &str = "Trees of the map in the frame of each direction of a grid, at 1 % of variance by pruning, on two threads. The paper: hours.
A scene that builds only the directions that its points ask for pays for those alone.
";

/// Relative variances and costs of the paper's product and of the one without tables for the map.
fn compare(out: &mut String, light: &Light, environment: &Environment, map: &Cube) -> Result<()> {
    const SIDE: usize = 512;
    writeln!(
        out,
        "\nOne point, variance of one sample relative to the square of the integral: the product of a turned tree and a BRDF slice \
         in its frame (`wis_tree_multiply`), with the nearest direction of the grid, with the four about it, one chosen by its bilinear weight times its integral, and with the point's own, and the product on \
         the map itself by a table (`wis_product_prepare_table`). Times: the product alone.\n"
    )?;
    writeln!(
        out,
        "| material | 64 x 64, nearest | us | four nearest, blended | own direction, 64 x 64 | own, 128 x 128 | us | product by table | us |"
    )?;
    writeln!(out, "|---|---:|---:|---:|---:|---:|---:|---:|---:|")?;
    for name in ["satin_rosaline_rgb.bsdf", "cc_iris_purple_gem_rgb.bsdf"] {
        let material = data::measured(name)?;
        let point = tilted();
        let bsdf = Bsdf::new(&material, &point);
        let wi: Vec<Vec3> = (0..SIDE * SIDE).map(|i| middle(i, SIDE)).collect();
        let values: Vec<f64> = wi.iter().map(|&wi| f64::from(bsdf.eval_one(wi).0 * light.radiance(wi))).collect();
        let mirror = (2.0 * point.normal.dot(point.wo) * point.normal - point.wo).normalize();
        let (cells, weights) = client::grid_cells(64, mirror.to_array())?;
        let product = |direction: Vec3, depth: u32| -> Result<(Tree, Mat3, f64)> {
            let (light, brdf) = (turned(map, direction, &places(depth))?, slice(&bsdf, mirror, direction, depth)?);
            let (mut scratch, mut us, mut product) = (Block::new(16), f64::MAX, None);
            for _ in 0..20 {
                let start = Instant::now();
                product = Some(light.multiply(&brdf, None, &mut scratch)?);
                us = us.min(start.elapsed().as_secs_f64() * 1e6);
            }
            Ok((product.expect("twenty rounds"), frame(direction).transpose(), us))
        };
        let pdf = |(product, frame, _): &(Tree, Mat3, f64), wi: Vec3| -> Result<f64> {
            Ok(f64::from(product.pdf(place(*frame * wi))?) / (4.0 * std::f64::consts::PI))
        };
        let four = cells.iter().map(|&cell| product(Vec3::from_array(client::grid_direction(64, cell)?), 6));
        let four = four.collect::<Result<Vec<_>>>()?;
        let nearest = (0..4).max_by(|a, b| weights[*a].total_cmp(&weights[*b])).unwrap_or(0);
        let coarse = relative_variance(&wi, &values, |wi| pdf(&four[nearest], wi))?;
        // One of the four is chosen by its weight and integral; the pdf is the sum over all.
        let shares: Vec<f64> = four.iter().zip(weights).map(|(p, w)| f64::from(w) * p.0.info.average).collect();
        let total: f64 = shares.iter().sum();
        let mixed = |wi: Vec3| {
            let each = four.iter().zip(&shares).map(|(p, share)| Ok(share / total * pdf(p, wi)?));
            each.sum::<Result<f64>>()
        };
        let blended = relative_variance(&wi, &values, mixed)?;
        let us = four[nearest].2;
        let own = product(mirror, 6)?;
        let own = relative_variance(&wi, &values, |wi| pdf(&own, wi))?;
        let fine = product(mirror, 7)?;
        let fine_us = fine.2;
        let fine = relative_variance(&wi, &values, |wi| pdf(&fine, wi))?;
        let preparation = Preparation { world_from_map: Some(light.world_from_map()), ..Default::default() };
        let (mut memory, mut table_us) = (preparation.memory()?, f64::MAX);
        for _ in 0..20 {
            let start = Instant::now();
            material.prepare(environment, &point, &preparation, &mut memory)?;
            table_us = table_us.min(start.elapsed().as_secs_f64() * 1e6);
        }
        let product = material.prepare(environment, &point, &preparation, &mut memory)?;
        let table = relative_variance(&wi, &values, |wi| Ok(f64::from(product.pdf(wi.to_array())?)))?;
        let name = &material.name;
        writeln!(
            out,
            "| {name} | {coarse:.3} | {us:.0} | {blended:.3} | {own:.3} | {fine:.3} | {fine_us:.0} | {table:.3} | {table_us:.0} |"
        )?;
    }
    writeln!(out, "\n{LESSON}")?;
    Ok(())
}

const LESSON: &str = "The product by a table is the one to use: it needs no turned maps, follows the map down to its texels, and is faster to
prepare. Turned trees win nowhere here: their pixels are as coarse as the grid, so that a lamp is as wide as a pixel, and
the nearest direction of the grid is off by up to half a cell, which is more than such a lamp.";

/// The point of the octahedral square for a direction in the frame of the trees.
pub fn place(d: Vec3) -> [f32; 2] {
    let (ax, ay) = (d.x.abs(), d.y.abs());
    let radius = (1.0 - d.z.abs()).max(0.0).sqrt();
    let turn = if ax + ay > 0.0 { ay.atan2(ax) * std::f32::consts::FRAC_2_PI } else { 0.0 };
    let (b, a) = (radius * turn, radius - radius * turn);
    let (a, b) = if d.z < 0.0 { (1.0 - b, 1.0 - a) } else { (a, b) };
    // `middle` has columns along x.
    [(b.copysign(d.y) + 1.0) * 0.5, (a.copysign(d.x) + 1.0) * 0.5]
}

/// BRDF x cosine of a point in the frame of a direction that stands for the mirror direction.
fn slice(bsdf: &Bsdf, mirror: Vec3, direction: Vec3, depth: u32) -> Result<Tree> {
    // The lobe turns with the mirror direction.
    let turn = glam::Quat::from_rotation_arc(direction, mirror);
    let (frame, side) = (frame(direction), 1usize << depth);
    let pixels: Vec<f32> =
        (0..side * side).map(|i| bsdf.eval_one((turn * (frame * middle(i, side))).normalize()).0).collect();
    let mean = pixels.iter().sum::<f32>() / pixels.len() as f32;
    let raised: Vec<f32> = pixels.iter().map(|value| value + FLOOR * mean).collect();
    Ok(Tree::new(depth, BUDGET, &raised)?)
}
