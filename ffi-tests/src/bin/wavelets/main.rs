//! Goes through figures and claims of "Wavelet Importance Sampling" on real maps, meshes and measured BRDFs, and writes a
//! page with pictures: wavelets <page> [sections]

mod buddha;
mod compression;
mod figures;
mod four;
mod gallery;
mod reparameterisation;
mod rotated;

use anyhow::Result;
use glam::Vec3;
use std::fmt::Write;
use std::path::Path;
use wis_ffi_tests::client::{self, Density};
use wis_ffi_tests::data;
use wis_ffi_tests::light::{Light, octahedral_direction};
use wis_ffi_tests::material::{Bsdf, Material};
use wis_ffi_tests::paper::Paper;
use wis_ffi_tests::points;
use wis_ffi_tests::processor;
use wis_ffi_tests::product::Rotations;
use wis_ffi_tests::scene::{Scene, ShadingPoint};
use wis_ffi_tests::structured::Picture;

/// A section of the page.
type Section = fn(&mut Paper, &Lit) -> Result<()>;

fn main() -> Result<()> {
    let mut page = Paper::from_arguments("wavelets")?;
    let lit = Lit::load("grace_latlong.exr")?;
    let sections: [(&str, Section); 9] = [
        ("point", figures::one_point),
        ("sets", figures::point_sets),
        ("variance", figures::convergence),
        ("buddha", buddha::write),
        ("compression", |page, lit| {
            compression::write(page, lit)?;
            reparameterisation::write(page, &data::all_brdfs()?)
        }),
        ("gallery", gallery::write),
        ("rotated", rotated::write),
        ("four", four::write),
        ("memory", memory),
    ];
    for (name, section) in sections {
        page.section(name, |page| section(page, &lit))?;
    }
    page.write("Wavelet importance sampling", INTRODUCTION)
}

const INTRODUCTION: &str = "Clarberg et al. 2005, \"Wavelet Importance Sampling: Efficiently Evaluating Products of Complex Functions\", claim by
claim. Maps rotated to 64 x 64 directions are `WIS_TREE_ENVIRONMENT`, products of trees `WIS_TREE_PRODUCT`, the hierarchical warp is
`wis_warp_in_place`. At a point the product is that of the nearest rotated map and of the BRDF over the square of its frame, 64 x 64
pixels each. Written by `make wavelets` at {commit}.
";

/// A light with its colours, as a renderer holds it.
pub struct Lit {
    pub light: Light,
    pub colours: [Light; 3],
    pub map: Rotations,
}

impl Lit {
    /// A map beside the project, or the project's room.
    pub fn load(name: &str) -> Result<Lit> {
        let light = data::light(name)?;
        let path = Path::new(data::FOLDER).join("envmaps").join(name);
        let colours =
            if path.exists() { Light::load_channels(&path)? } else { [light.clone(), light.clone(), light.clone()] };
        let map = Rotations::new(light.tables(0, 0.0)?);
        Ok(Lit { light, colours, map })
    }
}

/// What each mode keeps in memory.
fn memory(page: &mut Paper, lit: &Lit) -> Result<()> {
    let material = data::measured("satin_rosaline_rgb.bsdf")?;
    let product = material.prepare(&lit.map, &tilted())?;
    let kb = |bytes: u64| bytes as f64 / 1e3;
    let table = material.table.map_or(0, |table| table.bytes() as u64);
    let peak = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = peak.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or("unknown").trim();
    writeln!(
        page.text,
        "\n## Memory\n\n| what | kB |\n|---|---:|\n| environment of {} | {:.0} |\n| table of {} | {:.0} |\n\
         | product of a point | {:.1} |\n\n\
         Rotated maps and the product for all directions keep what stands there. Peak of this program, with all maps, meshes and pictures: {peak}.",
        lit.light.name,
        kb(lit.map.environment.info.bytes),
        material.name,
        kb(table),
        kb(product.tree.info.bytes)
    )?;
    Ok(())
}

/// A picture by samples of the product, and the same without occlusion.
pub fn by_product(
    scene: &Scene,
    material: &Material,
    (light, map): (&Light, &Rotations),
    count: usize,
    pass: u32,
) -> Result<(Picture, Vec<f64>)> {
    let (mut u, mut wi, mut pdf) = (vec![[0.0; 2]; count], vec![[0.0; 3]; count], vec![0.0; count]);
    let (start, mut rays) = (processor::seconds(), 0);
    let (mut values, mut lit) = (Vec::with_capacity(scene.points.len()), Vec::with_capacity(scene.points.len()));
    for point in &scene.points {
        let bsdf = Bsdf::new(material, point);
        let product = material.prepare(map, point)?;
        points::sobol(client::pixel_seed(point.pixel, pass), 0, &mut u);
        product.sample_n(&u, &mut wi, &mut pdf)?;
        let (mut sum, mut open) = (0.0, 0.0);
        for (wi, &pdf) in wi.iter().map(|&wi| Vec3::from_array(wi)).zip(&pdf).filter(|(_, pdf)| **pdf > 0.0) {
            let value = f64::from(bsdf.eval_one(wi).0 * light.radiance(wi)) / f64::from(pdf);
            if value > 0.0 {
                rays += 1;
                open += value;
                sum += if scene.visible(point, wi) { value } else { 0.0 };
            }
        }
        values.push(sum / count as f64);
        lit.push(open / count as f64);
    }
    let points = scene.points.len() as f64;
    let us = (processor::seconds() - start) * 1e6 / points;
    Ok((Picture { values, rays: f64::from(rays) / points, us }, lit))
}

/// A picture by samples of the product in the colours of the light, on two threads: luminance, and red, green and blue.
pub fn in_colour(scene: &Scene, material: &Material, lit: &Lit, count: usize) -> Result<(Vec<f64>, Vec<[f32; 3]>)> {
    let shade = |points: &[ShadingPoint]| -> Result<Vec<(f64, [f32; 3])>> {
        let (mut u, mut wi, mut pdf) = (vec![[0.0; 2]; count], vec![[0.0; 3]; count], vec![0.0; count]);
        let each = |point: &ShadingPoint| -> Result<(f64, [f32; 3])> {
            let bsdf = Bsdf::new(material, point);
            let product = material.prepare(&lit.map, point)?;
            points::sobol(client::pixel_seed(point.pixel, 0), 0, &mut u);
            product.sample_n(&u, &mut wi, &mut pdf)?;
            let (mut sum, mut rgb) = (0.0, [0.0; 3]);
            for (wi, &pdf) in wi.iter().map(|&wi| Vec3::from_array(wi)).zip(&pdf).filter(|(_, pdf)| **pdf > 0.0) {
                let share = bsdf.eval_one(wi).0 / pdf / count as f32;
                if share > 0.0 && scene.visible(point, wi) {
                    sum += f64::from(share * lit.light.radiance(wi));
                    rgb.iter_mut().zip(&lit.colours).for_each(|(sum, c)| *sum += share * c.radiance(wi));
                }
            }
            Ok((sum, rgb))
        };
        points.iter().map(each).collect()
    };
    let (first, second) = scene.points.split_at(scene.points.len() / 2);
    let [mut all, rest] = std::thread::scope(|threads| {
        let other = threads.spawn(|| shade(second));
        Ok::<_, anyhow::Error>([shade(first)?, other.join().expect("a thread that does not panic")?])
    })?;
    all.extend(rest);
    Ok(all.into_iter().unzip())
}

/// A point whose normal leans, seen from the side.
pub fn tilted() -> ShadingPoint {
    let normal = Vec3::new(0.3, -0.4, 0.85).normalize();
    let wo = (normal + Vec3::new(0.7, 0.2, 0.0)).normalize();
    ShadingPoint { pixel: [0, 0], hit: 0, origin: Vec3::ZERO, normal, wo }
}

/// The direction in the middle of a pixel of the octahedral square.
pub fn middle(i: usize, side: usize) -> Vec3 {
    let at = |c: usize| (c as f32 + 0.5) / side as f32;
    octahedral_direction(at(i % side), at(i / side))
}

/// Directions, and what is reflected from each.
pub fn reflected(light: &Light, bsdf: &Bsdf, side: usize) -> (Vec<Vec3>, Vec<f64>) {
    let wi = (0..side * side).map(|i| middle(i, side));
    wi.map(|wi| (wi, f64::from(bsdf.eval_one(wi).0 * light.radiance(wi)))).unzip()
}

/// The variance of value / pdf over the square of its mean.
pub fn relative_variance(wi: &[Vec3], values: &[f64], pdf: impl Fn(Vec3) -> Result<f64>) -> Result<f64> {
    let area = 4.0 * std::f64::consts::PI / wi.len() as f64;
    let (mut sum, mut squares) = (0.0, 0.0);
    for (&wi, &value) in wi.iter().zip(values).filter(|(_, value)| **value > 0.0) {
        sum += value * area;
        squares += value * value / pdf(wi)? * area;
    }
    Ok(squares / (sum * sum) - 1.0)
}
