//! Products at random shading points without occlusion: what their estimates miss is their own error.

use crate::client::{self, Result};
use crate::data;
use crate::lanes::{F8, LANES, V8};
use crate::light::Light;
use crate::material::{Bsdf, Material};
use crate::scene::ShadingPoint;
use glam::Vec3;
use std::path::Path;

/// Maps that the library was tuned on.
pub const DEVELOPER: [&str; 5] = [
    "studio_small_03_1k.hdr",
    "st_fagans_interior_1k.hdr",
    "venice_sunset_1k.hdr",
    "rooitou_park_1k.hdr",
    "forest_slope_1k.hdr",
];
/// Maps that it was not.
pub const OTHERS: [&str; 4] =
    ["adams_place_bridge_1k.hdr", "empty_warehouse_01_1k.hdr", "dikhololo_night_1k.hdr", "potsdamer_platz_1k.hdr"];

/// Random shading points of an error. Errors under lamps have long tails: with a quarter as many, those of narrow lobes change by a third
/// from one set of points to another.
pub const POINTS: usize = 480;
/// Samples of an estimate.
pub const SAMPLES: usize = 16;
/// Estimates of each point.
const PASSES: usize = 4;

/// Those of the maps that are there, looked up bilinearly.
///
/// # Errors
/// A map that cannot be read.
pub fn lights(names: &[&str]) -> anyhow::Result<Vec<Light>> {
    let paths = names.iter().map(|name| Path::new(data::FOLDER).join("envmaps").join(name));
    paths.filter(|path| path.exists()).map(|path| Ok(Light::load(&path)?.bilinear())).collect()
}

/// The materials whose errors have goals.
pub fn materials() -> Vec<Material> {
    vec![Material::lambert(), Material::ggx(0.5), Material::ggx(0.2), Material::mix(0.1), Material::ggx(0.05)]
}

/// Random points whose viewer is above the surface.
///
/// # Errors
/// Those of the library.
pub fn points(count: usize) -> Result<Vec<ShadingPoint>> {
    let mut u = vec![[0.0; 2]; 4 * count];
    client::sobol(77, 0, &mut u)?;
    let direction = |[a, b]: [f32; 2]| {
        let (z, phi) = (1.0 - 2.0 * a, std::f32::consts::TAU * b);
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    };
    let pairs = u.chunks(2).map(|pair| (direction(pair[0]), direction(pair[1])));
    let points = pairs.filter(|(normal, wo)| normal.dot(*wo) > 0.05).take(count).zip(0..);
    Ok(points.map(|((normal, wo), i)| ShadingPoint { pixel: [i, 7], hit: 0, origin: Vec3::ZERO, normal, wo }).collect())
}

/// A material at points under a light, with the reflected light of each.
pub struct Case<'a> {
    pub light: &'a Light,
    pub material: &'a Material,
    pub points: &'a [ShadingPoint],
    bsdf: Vec<Bsdf>,
    truth: Vec<f64>,
}

impl<'a> Case<'a> {
    /// Integrates over all texels.
    pub fn new(light: &'a Light, material: &'a Material, points: &'a [ShadingPoint]) -> Case<'a> {
        let bsdf: Vec<Bsdf> = points.iter().map(|point| Bsdf::new(material, point)).collect();
        let all: Vec<(Vec3, f64)> =
            light.quadrature(1).map(|(wi, area)| (wi, area * f64::from(light.radiance(wi)))).collect();
        let eights: Vec<(V8, F8)> = all
            .chunks(LANES)
            .map(|eight| {
                let at = |k: usize| eight.get(k).copied().unwrap_or((Vec3::Z, 0.0));
                let of = |component: fn(Vec3) -> f32| F8::new(std::array::from_fn(|k| component(at(k).0)));
                let wi = V8::new(of(|d| d.x), of(|d| d.y), of(|d| d.z));
                (wi, F8::new(std::array::from_fn(|k| at(k).1 as f32)))
            })
            .collect();
        let truth = bsdf.iter().map(|bsdf| {
            let rows = eights.chunks(64).map(|row| {
                let sum = row.iter().fold(F8::ZERO, |sum, (wi, light)| sum + bsdf.eval(*wi, LANES).0 * *light);
                sum.as_array_ref().iter().map(|&lane| f64::from(lane)).sum::<f64>()
            });
            rows.sum()
        });
        let truth = truth.collect();
        Case { light, material, points, bsdf, truth }
    }

    /// The root of the mean squared error of estimates over the mean of all points. `draw` draws from the product at a point.
    ///
    /// # Errors
    /// Those of the library.
    pub fn error(
        &self,
        mut draw: impl FnMut(&ShadingPoint, &[[f32; 2]], &mut [[f32; 3]], &mut [f32]) -> Result<()>,
    ) -> Result<f64> {
        let mean = self.truth.iter().sum::<f64>() / self.truth.len() as f64;
        let mut u = [[0.0; 2]; SAMPLES * PASSES];
        let (mut wi, mut pdf) = ([[0.0; 3]; SAMPLES * PASSES], [0.0; SAMPLES * PASSES]);
        let mut squares = 0.0;
        for (((number, point), bsdf), truth) in (0..).zip(self.points).zip(&self.bsdf).zip(&self.truth) {
            for (pass, u) in (0..).zip(u.chunks_mut(SAMPLES)) {
                client::sobol(number * PASSES as u32 + pass, 0, u)?;
            }
            draw(point, &u, &mut wi, &mut pdf)?;
            for (wi, pdf) in wi.chunks(SAMPLES).zip(pdf.chunks(SAMPLES)) {
                let each = wi.iter().zip(pdf).filter(|(_, pdf)| **pdf > 0.0).map(|(wi, pdf)| {
                    let wi = Vec3::from_array(*wi);
                    f64::from(bsdf.eval_one(wi).0) * f64::from(self.light.radiance(wi)) / f64::from(*pdf)
                });
                squares += ((each.sum::<f64>() / SAMPLES as f64 - truth) / mean).powi(2);
            }
        }
        Ok((squares / (self.truth.len() * PASSES) as f64).sqrt())
    }
}

/// The geometric mean.
pub fn geometric(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for value in values {
        (sum, count) = (sum + value.ln(), count + 1);
    }
    (sum / f64::from(count)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::Density;

    /// The light alone under a white sky, which Lambert reflects whole: no sample is far off, and the mean is right.
    #[test]
    fn errors_are_those_of_the_density() {
        let light = Light::latlong("white", 64, 32, vec![1.0; 64 * 32]).bilinear();
        let (material, points) = (Material::lambert(), points(40).unwrap());
        let case = Case::new(&light, &material, &points);
        assert!(case.truth.iter().all(|truth| (truth - 0.7).abs() < 0.01), "{:?}", case.truth);
        let environment = light.environment().unwrap();
        let density = light.distribution(&environment);
        let error = case.error(|_, u, wi, pdf| density.sample_n(u, wi, pdf)).unwrap();
        assert!((0.05..0.5).contains(&error), "{error}");
    }
}
