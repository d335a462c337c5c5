//! The paper's own system: the map turned about every direction of a grid, and BRDF tables for two dimensions of the view
//! in that frame; built and measured.

use crate::{Lit, middle, relative_variance, tilted};
use anyhow::Result;
use glam::Vec3;
use std::fmt::Write;
use std::time::Instant;
use wis_ffi_tests::client::{self, Block, Tree};
use wis_ffi_tests::data;
use wis_ffi_tests::environment::Environment;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::{Bsdf, Material};
use wis_ffi_tests::paper::{Paper, columns, range};
use wis_ffi_tests::product::{BUDGET, FLOOR, frame, turned};
use wis_ffi_tests::scene::ShadingPoint;
use wis_ffi_tests::structured::Raster;
use wis_ffi_tests::threads::on_threads;

/// One in so many directions of a table is built; times and sizes are those of all.
const EVERY: usize = 16;
/// Seconds.
const HOUR: f64 = 3600.0;

/// Writes the section.
pub fn write(page: &mut Paper, lit: &Lit) -> Result<()> {
    page.heading("The map rotated to every direction (Sections 6.1 and 7)")?;
    let (light, environment, out) = (&lit.light, &lit.map.environment, &mut page.text);
    let mut built = Vec::new();
    columns(out, 1, "directions x pixels | trees | seconds | MB | without pruning, MB")?;
    for (grid, depth) in [(64u32, 6u32), (128, 7)] {
        let start = Instant::now();
        let cells: Vec<u32> = (0..grid * grid).step_by(EVERY).collect();
        let sizes = on_threads(&cells, |&cell| {
            let direction = Vec3::from_array(client::grid_direction(grid, cell)?);
            Ok(turned(environment, direction, depth)?.info.bytes)
        })?;
        let sizes = sizes.iter().sum::<u64>();
        let (sizes, seconds) = (EVERY as u64 * sizes, EVERY as f64 * start.elapsed().as_secs_f64());
        let whole = f64::from(grid * grid) * f64::from((1u32 << (2 * depth)) - 1) / 3.0 * 24.0 / 1e6;
        let (side, count, mb) = (1 << depth, grid * grid, sizes as f64 / 1e6);
        writeln!(out, "| {grid} x {grid} x {side} x {side} | {count} | {seconds:.1} | {mb:.0} | {whole:.0} |")?;
        built.push((grid, seconds, mb));
    }
    let rows = compare(out, light, environment)?;
    let list = built.iter().map(|(grid, seconds, mb)| format!("{grid}^4 in {seconds:.1} s, {mb:.0} MB"));
    let is_fast = built.iter().all(|row| row.1 <= 2.0 * HOUR);
    page.claim("rotated maps of 64^4", is_fast, &[&list.collect::<Vec<_>>().join("; ")]);
    page.claim(
        "products of rotated maps",
        rows.iter().all(|row| row.blended.iter().all(|variance| *variance < row.alone[0].min(row.alone[1]))),
        &[&rows.iter().map(Compared::cell).collect::<Vec<_>>().join("; ")],
    );
    Ok(())
}

/// Variances of densities for a material.
struct Compared {
    name: String,
    /// Of the BRDF and of the map.
    alone: [f64; 2],
    /// With the nearest direction of 64 x 64.
    nearest: f64,
    /// With four directions and views blended, and with the point's own: of 64 x 64 pixels and of 128 x 128.
    blended: [f64; 2],
    own: [f64; 2],
}

impl Compared {
    fn cell(&self) -> String {
        let Compared { name, alone: [brdf, map], blended: [coarse, fine], .. } = self;
        format!("{name}: variance {coarse:.2} with 64^4, {fine:.2} with 128^4 (BRDF {brdf:.0}, map {map:.0})")
    }
}

/// Relative variances and costs of the paper's product.
fn compare(out: &mut String, light: &Light, environment: &Environment) -> Result<Vec<Compared>> {
    let mut rows = Vec::new();
    const SIDE: usize = 512;
    writeln!(
        out,
        "\nOne point, variance of one sample relative to the square of the integral. First the product of a rotated tree and a BRDF slice\n\
         in its frame (`WIS_TREE_PRODUCT`), with the nearest of 64 x 64 directions. Then four directions and four of 16 x 16 views\n\
         blended (`WIS_TREE_BLEND`: one product is all sixteen, exactly), and the point's own direction.\n\
         Times: blends and product.\n"
    )?;
    columns(
        out,
        1,
        "material | nearest, 64 x 64 | us | 4 x 4 blended | us | 4 x 4, 128 x 128 | us | own, 64 x 64 | own, 128 x 128",
    )?;
    for name in ["satin_rosaline_rgb.bsdf", "cc_iris_purple_gem_rgb.bsdf"] {
        let material = data::measured(name)?;
        let point = tilted();
        let bsdf = Bsdf::new(&material, &point);
        let wi: Vec<Vec3> = (0..SIDE * SIDE).map(|i| middle(i, SIDE)).collect();
        let values: Vec<f64> = wi.iter().map(|&wi| f64::from(bsdf.eval_one(wi).0 * light.radiance(wi))).collect();
        let scene = Turning { environment, material: &material, point: &point };
        let variance = |(product, direction): &(Tree, Vec3)| {
            let to_tree = frame(*direction).transpose();
            let pdf = |wi: Vec3| {
                let point = client::square_point((to_tree * wi).to_array(), None)?;
                Ok(f64::from(product.pdf(point)?) / (4.0 * std::f64::consts::PI))
            };
            relative_variance(&wi, &values, pdf)
        };
        let raster = Raster::new(light);
        let alone = [
            relative_variance(&wi, &values, |wi| Ok(f64::from(bsdf.eval_one(wi).1)))?,
            relative_variance(&wi, &values, |wi| Ok(f64::from(light.radiance(wi)) / raster.power()))?,
        ];
        let mirror = point.reflected();
        let (nearest, nearest_us) = scene.product(&[(grid(64, mirror)?[0].0, 1.0)], &[(point.wo, 1.0)], 6)?;
        let nearest = variance(&(nearest, grid(64, mirror)?[0].0))?;
        let mut cells = vec![format!("{nearest:.3} | {nearest_us:.0}")];
        let (mut blended, mut own) = ([0.0; 2], [0.0; 2]);
        for (blended, depth) in blended.iter_mut().zip([6, 7]) {
            let (tree, us) = scene.product(&grid(64, mirror)?, &grid(16, point.wo)?, depth)?;
            *blended = variance(&(tree, mirror))?;
            cells.push(format!("{blended:.3} | {us:.0}"));
        }
        for (own, depth) in own.iter_mut().zip([6, 7]) {
            *own = variance(&(scene.product(&[(mirror, 1.0)], &[(point.wo, 1.0)], depth)?.0, mirror))?;
            cells.push(format!("{own:.3}"));
        }
        writeln!(out, "| {} | {} |", material.name, cells.join(" | "))?;
        rows.push(Compared { name: material.name.clone(), alone, nearest, blended, own });
    }
    writeln!(out, "\n{}", lesson(&rows))?;
    Ok(rows)
}

/// Directions of a grid about one, the nearest first, with their bilinear weights.
fn grid(side: u32, direction: Vec3) -> Result<Vec<(Vec3, f64)>> {
    let (cells, weights) = client::grid_cells(side, direction.to_array())?;
    let pairs = cells.iter().zip(weights).filter(|(_, weight)| *weight > 0.0);
    let mut directions = pairs
        .map(|(&cell, weight)| Ok((Vec3::from_array(client::grid_direction(side, cell)?), f64::from(weight))))
        .collect::<Result<Vec<_>>>()?;
    directions.sort_by(|a, b| b.1.total_cmp(&a.1));
    Ok(directions)
}

/// What the paper's product is made of.
struct Turning<'a> {
    environment: &'a Environment,
    material: &'a Material,
    point: &'a ShadingPoint,
}

impl Turning<'_> {
    /// The product of the map about some directions and the BRDF of some views, each with its weight, in the frame of the
    /// reflected direction; and the microseconds that it took once its tables were there.
    fn product(&self, directions: &[(Vec3, f64)], views: &[(Vec3, f64)], depth: u32) -> Result<(Tree, f64)> {
        let maps = directions
            .iter()
            .map(|(direction, weight)| Ok((turned(self.environment, *direction, depth)?, *weight)))
            .collect::<Result<Vec<_>>>()?;
        let slices =
            views.iter().map(|(wo, weight)| Ok((self.slice(*wo, depth)?, *weight))).collect::<Result<Vec<_>>>()?;
        let (mut scratch, mut us, mut product) = (Block::new(16), f64::MAX, None);
        for _ in 0..20 {
            let start = Instant::now();
            let [map, brdf] = [&maps, &slices].map(|terms| {
                let terms: Vec<(&Tree, f64)> = terms.iter().map(|(tree, weight)| (tree, *weight)).collect();
                // One tree is itself.
                if let [(tree, _)] = terms[..] { Ok(tree.clone()) } else { Tree::blend(&terms, &mut scratch) }
            });
            product = Some(map?.multiply(&brdf?, None, &mut scratch)?);
            us = us.min(start.elapsed().as_secs_f64() * 1e6);
        }
        Ok((product.expect("twenty rounds"), us))
    }

    /// BRDF x cosine of a view in the frame of its reflected direction.
    fn slice(&self, wo: Vec3, depth: u32) -> Result<Tree> {
        let point = ShadingPoint { wo, ..*self.point };
        let (bsdf, frame, side) = (Bsdf::new(self.material, &point), frame(point.reflected()), 1usize << depth);
        // Axis 1 of the library's square lies along x, that of `middle` along y.
        let place = |i: usize| middle(i % side * side + i / side, side);
        let pixels: Vec<f32> = (0..side * side).map(|i| bsdf.eval_one((frame * place(i)).normalize()).0).collect();
        let mean = pixels.iter().sum::<f32>() / pixels.len() as f32;
        let raised: Vec<f32> = pixels.iter().map(|value| value + FLOOR * mean).collect();
        Ok(Tree::new(depth, BUDGET, &raised)?)
    }
}

/// What the rows say.
fn lesson(rows: &[Compared]) -> String {
    let ratios = |of: fn(&Compared) -> f64| range(rows.iter().map(of));
    let ([low, high], [least, most]) = (ratios(|row| row.own[0] / row.own[1]), ratios(|row| row.nearest / row.own[0]));
    format!(
        "About the point's own direction, 128 x 128 pixels in place of 64 x 64 divide the variance by {low:.1} to {high:.1}.\n\
         With 64 x 64 pixels, the nearest direction of the grid has {least:.2} to {most:.2} times the variance of the point's own."
    )
}
