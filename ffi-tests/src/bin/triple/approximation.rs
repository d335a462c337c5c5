//! Error and time against the number of terms (Ng et al. 2004, Fig. 3): sublinear integrals against sums over pixels.

use crate::domain::{Domain, Lists};
use anyhow::Result;
use glam::Mat3;
use std::fmt::Write;
use std::time::Instant;
use wide::f32x8;
use wis_ffi_tests::client::{Tree, raw};
use wis_ffi_tests::data;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::{Bsdf, Material};
use wis_ffi_tests::scene::{Scene, ShadingPoint, View};

const POINTS: usize = 40;
/// Shares of the wavelets that are kept.
const SHARES: [f64; 9] = [0.0005, 0.001, 0.002, 0.005, 0.01, 0.03, 0.1, 0.3, 1.0];
const ROUNDS: usize = 9;

/// Writes the section.
pub fn write(out: &mut String, light: &Light) -> Result<()> {
    let scene = data::scene("spot.obj", View::Points(POINTS))?;
    writeln!(out, "\n## Error and time against the terms that are kept (Fig. 3)\n")?;
    writeln!(out, "Light: {}, visibility: {} points of {}.\n", light.name, scene.points.len(), scene.name)?;
    for domain in [Domain::cube(6), Domain::octahedral(7)] {
        let pixels = domain.light(light, Mat3::IDENTITY);
        let lit = Lit { domain, trees: domain.trees(&pixels)?, pixels };
        writeln!(out, "### {} pixels, {} wavelets\n", domain.name(), domain.wavelets())?;
        for material in [Material::lambert(), Material::ggx(0.5), Material::ggx(0.2), Material::mix(0.1)] {
            table(out, &scene, &lit, &material)?;
        }
    }
    Ok(())
}

/// A light on a domain.
struct Lit {
    domain: Domain,
    pixels: Vec<f32>,
    trees: Vec<Tree>,
}

/// A shading point's BRDF x cosine and visibility.
struct Point {
    brdf: Vec<f32>,
    visible: Vec<f32>,
    brdf_trees: Vec<Tree>,
    visible_trees: Vec<Tree>,
    exact: f64,
}

impl Point {
    fn new(scene: &Scene, point: &ShadingPoint, light: &Lit, material: &Material) -> Result<Point> {
        let (bsdf, domain) = (Bsdf::new(material, point), light.domain);
        let quarters = [[0.25, 0.25], [0.25, 0.75], [0.75, 0.25], [0.75, 0.75]];
        let mean = |i: usize| quarters.iter().map(|&at| bsdf.eval_one(domain.place(i, at).0).0).sum::<f32>() / 4.0;
        let seen = |i: usize| f32::from(u8::from(scene.visible(point, domain.place(i, [0.5, 0.5]).0)));
        let brdf: Vec<f32> = (0..domain.pixels()).map(mean).collect();
        let visible: Vec<f32> = (0..domain.pixels()).map(seen).collect();
        let (brdf_trees, visible_trees) = (domain.trees(&brdf)?, domain.trees(&visible)?);
        let terms = brdf.iter().zip(&light.pixels).zip(&visible);
        let sum = terms.map(|((&b, &l), &v)| f64::from(b) * f64::from(l) * f64::from(v)).sum::<f64>();
        Ok(Point { brdf, visible, brdf_trees, visible_trees, exact: sum / domain.pixels() as f64 })
    }

    /// By the linear algorithm.
    fn linear(&self, light: &Lit) -> Result<f64> {
        let mut sum = 0.0;
        for ((brdf, light), visible) in self.brdf_trees.iter().zip(&light.trees).zip(&self.visible_trees) {
            sum += Tree::triple_integral([brdf, light, visible])?;
        }
        Ok(light.domain.mean(sum))
    }

    /// With the wavelets of the BRDF and of the light that are kept.
    fn sublinear(&self, light: &Lit, brdf: &Lists, kept: &Lists) -> Result<f64> {
        let mut sum = 0.0;
        for (face, tree) in light.trees.iter().enumerate() {
            let brdf = (self.brdf_trees[face].info.average, brdf[face].as_slice());
            sum += tree.sublinear(brdf, &kept[face], &self.visible_trees[face])?;
        }
        Ok(light.domain.mean(sum))
    }
}

/// The pixels of a face in Morton order: what a renderer that stores wavelets pays before it can add up pixels.
fn decompress(depth: u32, average: f64, list: &[raw::wis_wavelets], pixels: &mut [f32]) {
    const MORTON_BITS: u32 = 24;
    pixels.fill(average as f32);
    for w in list {
        let quarter = pixels.len() >> (2 * w.level + 2);
        let first = (w.position >> (MORTON_BITS - 2 * depth)) as usize;
        let [a, b, c] = w.detail;
        let parts = [a + b + c, b - a - c, a - b - c, c - a - b];
        for (part, value) in pixels[first..first + 4 * quarter].chunks_exact_mut(quarter).zip(parts) {
            part.iter_mut().for_each(|pixel| *pixel += value);
        }
    }
}

/// The pixels of all faces.
fn decompressed(domain: Domain, trees: &[Tree], lists: &Lists) -> Vec<f32> {
    let mut pixels = vec![0.0; domain.pixels()];
    for ((tree, list), face) in trees.iter().zip(lists).zip(pixels.chunks_mut(1 << (2 * domain.depth))) {
        decompress(domain.depth, tree.info.average, list, face);
    }
    pixels
}

/// The fastest round over all points, in microseconds for a point.
fn fastest(points: &[Point], mut each: impl FnMut(usize, &Point) -> Result<f64>) -> Result<f64> {
    let mut best = f64::MAX;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        for (i, point) in points.iter().enumerate() {
            std::hint::black_box(each(i, point)?);
        }
        best = best.min(start.elapsed().as_secs_f64() * 1e6 / points.len() as f64);
    }
    Ok(best)
}

/// The mean of the products of pixels, eight at a time.
pub fn by_pixels(brdf: &[f32], light: &[f32], visible: &[f32]) -> f64 {
    let eight = |values: &[f32], i: usize| f32x8::from(<[f32; 8]>::try_from(&values[i..i + 8]).expect("eight"));
    let terms = (0..light.len()).step_by(8).map(|i| eight(brdf, i) * eight(light, i) * eight(visible, i));
    f64::from(terms.fold(f32x8::ZERO, |sum, term| sum + term).reduce_add()) / light.len() as f64
}

fn table(out: &mut String, scene: &Scene, light: &Lit, material: &Material) -> Result<()> {
    let domain = light.domain;
    let points = scene.points.iter().map(|p| Point::new(scene, p, light, material)).collect::<Result<Vec<_>>>()?;
    let norm = points.iter().map(|p| p.exact * p.exact).sum::<f64>().sqrt();
    let off = |values: &[f64]| {
        let squares = values.iter().zip(&points).map(|(v, p)| (v - p.exact).powi(2));
        squares.sum::<f64>().sqrt() / norm
    };
    let exact = points.iter().map(|p| p.linear(light)).collect::<Result<Vec<_>>>()?;
    let pixel_us = fastest(&points, |_, p| Ok(by_pixels(&p.brdf, &light.pixels, &p.visible)))?;
    let linear_us = fastest(&points, |_, p| p.linear(light))?;
    let unpacked_us = decompression(&points, light)?;
    let squares: u32 = points.iter().flat_map(|p| p.visible_trees.iter().map(|tree| tree.info.squares)).sum();
    writeln!(
        out,
        "#### {}\n\nPixel loop, eight lanes: {pixel_us:.1} us; {unpacked_us:.1} us if BRDF and visibility are wavelets that it \
         must decompress. Linear algorithm: {linear_us:.1} us, off by {:.1e}. Visibility keeps {:.0} of {} squares without loss.\n",
        material.name,
        off(&exact),
        f64::from(squares) / points.len() as f64,
        domain.wavelets() / 3
    )?;
    writeln!(out, "| share kept | terms | relative L2 error | us | pixels / this | decompressed / this |")?;
    writeln!(out, "|---:|---:|---:|---:|---:|---:|")?;
    for share in SHARES {
        let keep = (share * domain.wavelets() as f64).round() as usize;
        let kept = domain.largest(&light.trees, keep)?;
        let lists = points.iter().map(|p| domain.largest(&p.brdf_trees, keep)).collect::<Result<Vec<Lists>>>()?;
        let value = |i: usize, p: &Point| p.sublinear(light, &lists[i], &kept);
        let values = points.iter().enumerate().map(|(i, p)| value(i, p)).collect::<Result<Vec<f64>>>()?;
        let us = fastest(&points, value)?;
        writeln!(
            out,
            "| {:.2} % | {keep} | {:.4} | {us:.2} | {:.2} | {:.2} |",
            100.0 * share,
            off(&values),
            pixel_us / us,
            unpacked_us / us
        )?;
    }
    Ok(writeln!(out)?)
}

/// The time of the pixel loop if BRDF and visibility must be decompressed for it.
fn decompression(points: &[Point], light: &Lit) -> Result<f64> {
    let domain = light.domain;
    let all = |trees: &[Tree]| domain.all(trees);
    let pixels = decompressed(domain, &light.trees, &all(&light.trees)?);
    let stored =
        points.iter().map(|p| Ok([all(&p.brdf_trees)?, all(&p.visible_trees)?])).collect::<Result<Vec<_>>>()?;
    fastest(points, |i, p| {
        let [brdf, visible] = &stored[i];
        let brdf = decompressed(domain, &p.brdf_trees, brdf);
        Ok(by_pixels(&brdf, &pixels, &decompressed(domain, &p.visible_trees, visible)))
    })
}
