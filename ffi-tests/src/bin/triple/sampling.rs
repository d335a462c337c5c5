//! What a density gains that knows visibility: the product of light, BRDF x cosine and an estimate of visibility as a tree,
//! against the product of the first two.

use crate::{DEPTH, SIDE, mean_on_pixel};
use anyhow::Result;
use std::fmt::Write;
use std::time::Instant;
use wis_ffi_tests::client::{Block, Tree};
use wis_ffi_tests::data;
use wis_ffi_tests::light::{Light, octahedral_direction};
use wis_ffi_tests::material::{Bsdf, Material};
use wis_ffi_tests::paper::Paper;
use wis_ffi_tests::scene::{Scene, ShadingPoint, View};

const POINTS: usize = 240;
/// The visibility that a density gives to what it believes hidden.
const FLOOR: f32 = 0.1;
const REGIONS: [&str; 3] = ["lit", "penumbra", "umbra"];

/// Where an estimate of visibility comes from.
const SOURCES: [(&str, Source); 5] = [
    ("its own, 128 x 128", Source::Own(1)),
    ("its own, 16 x 16", Source::Own(8)),
    ("its own, 8 x 8", Source::Own(16)),
    ("the nearest other point's", Source::Others(1)),
    ("the mean of the four nearest", Source::Others(4)),
];

enum Source {
    /// The point's own visibility, averaged over blocks of so many pixels along an axis.
    Own(usize),
    /// The mean of that of so many other points.
    Others(usize),
}

/// Writes the section.
pub fn write(page: &mut Paper, light: &Light) -> Result<()> {
    let out = &mut page.text;
    let scene = data::scene("spot.obj", View::Points(POINTS))?;
    let pixels = light.on_octahedron(SIDE, 4, |world| world);
    let light_tree = Tree::new(DEPTH, 0.0, &pixels)?;
    let visible: Vec<Vec<f32>> = scene.points.iter().map(|point| visibility(&scene, point)).collect();
    writeln!(out, "\n## Not in the paper: sampling the triple product\n\n{TEXT}")?;
    writeln!(out, "{POINTS} points of {}, light: {}.\n", scene.name, light.name)?;
    for material in [Material::lambert(), Material::ggx(0.2)] {
        let rows = SOURCES.map(|(name, source)| (name, source, Row::default()));
        let mut table = Table { rows, scratch: Block::new(0) };
        for (i, point) in scene.points.iter().enumerate() {
            table.add(&scene, &visible, i, &Bsdf::new(&material, point), (&pixels, &light_tree))?;
        }
        table.write(out, &material)?;
    }
    Ok(())
}

const TEXT: &str =
    "`WIS_TREE_PRODUCT` makes a tree of light x BRDF x cosine x (0.1 + 0.9 visibility), for renderers that hold an
estimate of visibility: from a coarse map of the point itself, or from other points. Variances of one sample are exact sums over
the pixels of the octahedral square. The table has the variance without visibility over that with it: above 1, knowing visibility
lowers the variance. Gains are geometric means over the points of a region. Lit: more than 0.95 of the unshadowed light arrives;
umbra: less than 0.05. Microseconds are wall time of a shared machine: an upper bound.
";

/// Sums over the points of a region: of the logarithm of the gain, and how many.
#[derive(Default)]
struct Row {
    regions: [(f64, usize); 3],
    squares: f64,
    us: f64,
    bytes: f64,
    points: usize,
}

struct Table {
    rows: [(&'static str, Source, Row); 5],
    scratch: Block,
}

impl Table {
    fn add(
        &mut self,
        scene: &Scene,
        visible: &[Vec<f32>],
        index: usize,
        bsdf: &Bsdf,
        (pixels, light): (&[f32], &Tree),
    ) -> Result<()> {
        let brdf: Vec<f32> = (0..SIDE * SIDE).map(|i| mean_on_pixel(bsdf, i)).collect();
        let reflected: Vec<f64> = brdf.iter().zip(pixels).map(|(&b, &l)| f64::from(b) * f64::from(l)).collect();
        let seen: Vec<f64> = reflected.iter().zip(&visible[index]).map(|(r, &v)| r * f64::from(v)).collect();
        let [unshadowed, shadowed] = [&reflected, &seen].map(|values| values.iter().sum::<f64>());
        if shadowed <= 0.0 {
            return Ok(());
        }
        let region = match shadowed / unshadowed {
            share if share > 0.95 => 0,
            share if share >= 0.05 => 1,
            _ => 2,
        };
        let brdf = Tree::new(DEPTH, 0.0, &brdf)?;
        let without = variance(&light.multiply(&brdf, None, &mut self.scratch)?, &seen)?;
        for (_, source, row) in &mut self.rows {
            let estimate = source.estimate(scene, visible, index);
            let estimate = Tree::new(DEPTH, 0.0, &estimate)?;
            let start = Instant::now();
            let product = light.multiply(&brdf, Some(&estimate), &mut self.scratch)?;
            row.us += start.elapsed().as_secs_f64() * 1e6;
            row.squares += f64::from(product.info.squares);
            row.bytes += product.info.bytes as f64;
            row.points += 1;
            let with = variance(&product, &seen)?;
            // What is sampled exactly has no variance but for rounding.
            let least = 1e-6 * shadowed * shadowed;
            row.regions[region].0 += (without.max(least) / with.max(least)).ln();
            row.regions[region].1 += 1;
        }
        Ok(())
    }

    fn write(&self, out: &mut String, material: &Material) -> Result<()> {
        let counts = self.rows[0].2.regions.map(|region| region.1);
        writeln!(out, "### {}\n", material.name)?;
        let names = REGIONS.iter().zip(counts).map(|(name, count)| format!("{name} ({count})")).collect::<Vec<_>>();
        writeln!(
            out,
            "| visibility | {} | squares | kB | us |\n|---|---:|---:|---:|---:|---:|---:|",
            names.join(" | ")
        )?;
        for (name, _, row) in &self.rows {
            let gain = row.regions.map(|(sum, count)| format!("{:.2}", (sum / count.max(1) as f64).exp())).join(" | ");
            let mean = |sum: f64| sum / row.points as f64;
            let (squares, kb, us) = (mean(row.squares), mean(row.bytes) / 1e3, mean(row.us));
            writeln!(out, "| {name} | {gain} | {squares:.0} | {kb:.0} | {us:.0} |")?;
        }
        Ok(writeln!(out)?)
    }
}

impl Source {
    fn estimate(&self, scene: &Scene, visible: &[Vec<f32>], index: usize) -> Vec<f32> {
        let raw: Vec<f32> = match *self {
            Source::Own(block) => averaged(&visible[index], block),
            Source::Others(count) => {
                let near = nearest(scene, index, count);
                let mean = |pixel: usize| near.iter().map(|&i| visible[i][pixel]).sum::<f32>() / near.len() as f32;
                (0..SIDE * SIDE).map(mean).collect()
            }
        };
        raw.into_iter().map(|v| FLOOR + (1.0 - FLOOR) * v).collect()
    }
}

/// Averages over blocks of pixels.
fn averaged(values: &[f32], block: usize) -> Vec<f32> {
    let corner = |i: usize| (i / SIDE / block * block, i % SIDE / block * block);
    let mean = |i: usize| {
        let (y, x) = corner(i);
        let sum: f32 = (0..block * block).map(|k| values[(y + k / block) * SIDE + x + k % block]).sum();
        sum / (block * block) as f32
    };
    (0..SIDE * SIDE).map(mean).collect()
}

/// The other points that are nearest.
fn nearest(scene: &Scene, index: usize, count: usize) -> Vec<usize> {
    let here = scene.points[index].origin;
    let mut others: Vec<usize> = (0..scene.points.len()).filter(|&i| i != index).collect();
    let distance = |i: &usize| scene.points[*i].origin.distance_squared(here);
    others.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    others.truncate(count);
    others
}

/// Which pixels a point sees, the horizon left to the BRDF.
fn visibility(scene: &Scene, point: &ShadingPoint) -> Vec<f32> {
    let at = |c: usize| (c as f32 + 0.5) / SIDE as f32;
    let seen = |i: usize| scene.visible(point, octahedral_direction(at(i % SIDE), at(i / SIDE)));
    (0..SIDE * SIDE).map(|i| f32::from(u8::from(seen(i)))).collect()
}

/// The variance of one sample of a density as an estimate of the sum of the values, in units of that sum.
fn variance(density: &Tree, values: &[f64]) -> Result<f64> {
    let (mut sum, mut squares) = (0.0, 0.0);
    let at = |c: usize| (c as f32 + 0.5) / SIDE as f32;
    for (i, &value) in values.iter().enumerate().filter(|(_, value)| **value > 0.0) {
        // Axis 1 of a tree is that of the rows.
        let pdf = f64::from(density.pdf([at(i / SIDE), at(i % SIDE)])?);
        sum += value;
        squares += value * value * (SIDE * SIDE) as f64 / pdf;
    }
    Ok(squares - sum * sum)
}
