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
use wis_ffi_tests::client;
use wis_ffi_tests::data;
use wis_ffi_tests::light::{Light, octahedral_direction};
use wis_ffi_tests::material::{Bsdf, Material};
use wis_ffi_tests::paper::Paper;
use wis_ffi_tests::points;
use wis_ffi_tests::processor;
use wis_ffi_tests::product::{Product, Rotations};
use wis_ffi_tests::scene::{Scene, ShadingPoint};
use wis_ffi_tests::structured::Picture;
use wis_ffi_tests::threads::on_threads;

/// log2 of the pixels along an axis of the paper's trees.
const DEPTH: u32 = 6;

/// A section of the page.
type Section = fn(&mut Paper, &Lit) -> Result<()>;

fn main() -> Result<()> {
    let mut page = Paper::from_arguments("wavelets", include_str!("page.md"))?;
    let lit = Lit::load("grace_latlong.exr")?;
    let sections: [(&str, Section); 9] = [
        ("point", figures::one_point),
        ("sets", figures::point_sets),
        ("variance", figures::convergence),
        ("buddha", buddha::write),
        ("picture", buddha::picture_of),
        ("compression", |page, lit| {
            compression::write(page, lit)?;
            reparameterisation::write(page, &data::all_brdfs()?)
        }),
        ("gallery", gallery::write),
        ("rotated", rotated::write),
        ("four", four::write),
    ];
    for (name, section) in sections {
        page.section(name, |page| section(page, &lit))?;
    }
    page.write()
}

/// A light with its colours, as a renderer holds it.
pub struct Lit {
    pub light: Light,
    pub colours: [Light; 3],
    /// For samples that are weighed by their pdf, and for the paper's estimate.
    pub map: Rotations,
    pub integrated: Rotations,
}

impl Lit {
    /// A map beside the project, or the project's room.
    pub fn load(name: &str) -> Result<Lit> {
        let light = data::light(name)?;
        let colours = data::colours(name)?;
        let map = Rotations::new(light.tables(0, 0.0)?)?;
        let integrated = Rotations::integrated(light.tables(0, 0.0)?, DEPTH)?;
        Ok(Lit { light, colours, map, integrated })
    }
}

/// The paper's estimate at a point: the integral of the product times the share of the warped points that is seen.
pub fn estimate(scene: &Scene, point: &ShadingPoint, product: &Product, u: &mut [[f32; 2]]) -> Result<f64> {
    let mut wi = Vec::with_capacity(u.len());
    product.warp(u, &mut wi)?;
    let seen = wi.iter().filter(|wi| wi.dot(point.normal) > 0.0 && scene.visible(point, **wi)).count();
    Ok(product.integral * seen as f64 / u.len() as f64)
}

/// A picture by the paper's estimate.
pub fn by_product(scene: &Scene, material: &Material, map: &Rotations, count: usize) -> Result<Picture> {
    let (mut u, mut seconds) = (vec![[0.0; 2]; count], 0.0);
    let mut values = Vec::with_capacity(scene.points.len());
    for point in &scene.points {
        let product = material.prepare(map, point)?;
        let start = processor::seconds();
        points::sobol(client::pixel_seed(point.pixel, 0), 0, &mut u);
        values.push(estimate(scene, point, &product, &mut u)?);
        seconds += product.seconds + processor::seconds() - start;
    }
    let points = scene.points.len() as f64;
    Ok(Picture { values, rays: count as f64, us: seconds * 1e6 / points })
}

/// The same in the colours of the light, on two threads: luminance, and red, green and blue. Samples are those of the luminance, each
/// times the hue of the light (Section 6.1).
pub fn in_colour(scene: &Scene, material: &Material, lit: &Lit, count: usize) -> Result<(Vec<f64>, Vec<[f32; 3]>)> {
    let all = on_threads(&scene.points, |point| {
        let (mut u, mut wi) = (vec![[0.0; 2]; count], Vec::new());
        let product = material.prepare(&lit.integrated, point)?;
        points::sobol(client::pixel_seed(point.pixel, 0), 0, &mut u);
        product.warp(&mut u, &mut wi)?;
        let share = product.integral / count as f64;
        let (mut sum, mut rgb) = (0.0, [0.0; 3]);
        for &wi in wi.iter().filter(|wi| wi.dot(point.normal) > 0.0 && scene.visible(point, **wi)) {
            sum += share;
            let hue = share as f32 / lit.light.radiance(wi).max(f32::MIN_POSITIVE);
            rgb.iter_mut().zip(&lit.colours).for_each(|(sum, c)| *sum += hue * c.radiance(wi));
        }
        Ok((sum, rgb))
    })?;
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
