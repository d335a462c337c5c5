//! Measures the estimators on a cell: one scene, light and material.

use crate::caches::CACHES;
use crate::client::{self, Block, Density, raw};
use crate::cost::Cost;
use crate::environment::{self, Light};
use crate::estimator::Estimator;
use crate::light::octahedral_direction;
use crate::material::Bsdf;
use crate::method::Method;
use crate::reference::Reference;
use crate::scene::Scene;
use crate::setting::{Setting, shadowed_and_not};
use crate::statistics::mean_and_error;
use crate::threads::on_threads;
use crate::timing::{Times, time};
use anyhow::Result;
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::rc::Rc;

/// Groups of pixels by the visible part v of their light; `ALL` are all of them.
pub const REGIONS: [&str; 4] = ["all", "lit", "penumbra", "umbra"];
/// Regions with fewer pixels are marked.
pub const FEW: usize = 50;
/// How much to measure.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Effort {
    pub methods: Vec<String>,
    pub counts: Vec<usize>,
    /// Independent repeats.
    pub repeats: u32,
    /// Pixels that are timed.
    pub timed: usize,
    /// With so many of `CACHES`, from the first on.
    pub caches: usize,
}

/// What was measured on one scene, light and material.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Cell {
    /// The group of cells that it belongs to.
    pub study: String,
    pub scene: String,
    pub light: String,
    pub material: String,
    /// Pixels in each region.
    pub pixels: [usize; 4],
    /// Samples of each technique in half of the reference, and the disagreement of the halves.
    pub reference: (usize, f64),
    /// The largest f L cos / (p I) of the product on a grid of directions, over some points (rule 33).
    pub max_weight: f64,
    /// The share of the light that visibility leaves, over the image.
    pub visible: f64,
    /// Candidates that wis_direct weighs for a ray, by the number of rays.
    pub candidates: Vec<(usize, f64)>,
    pub rows: Vec<Row>,
}

/// A method at a number of samples.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Row {
    pub method: String,
    pub count: usize,
    /// With each of `CACHES`; 0 of limits.
    pub times: [Times; CACHES.len()],
    pub repeats: Vec<Repeat>,
}

/// The errors of one repeat, in each region.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Repeat {
    pub errors: [Errors; 4],
}

/// Mean squared errors of a region.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Errors {
    /// Relative to the squared mean of the image.
    pub absolute: f64,
    /// Of each pixel relative to reference^2 + (0.01 mean)^2.
    pub relative: f64,
    /// As `absolute`, without shadows.
    pub unshadowed: f64,
    /// The 99.9th percentile of the pixels' absolute errors, relative to the mean of the image; not squared.
    pub tail: f64,
}

impl Row {
    /// The mean over repeats of what a repeat answers: a median would hide the rare repeats that a method fails in.
    pub fn mean(&self, of: impl Fn(&Repeat) -> f64) -> f64 {
        mean_and_error(&self.repeats.iter().map(of).collect::<Vec<_>>()).0
    }
}

/// Measures a cell.
///
/// # Errors
/// Those of the library.
pub fn measure(study: &str, scene: &Scene, setting: &Setting, reference: &Reference, effort: &Effort) -> Result<Cell> {
    let truth = Truth::new(reference, scene.hits);
    let methods = Method::all().filter(|m| effort.methods.contains(&m.name()));
    let rows = rows(scene, setting, &truth, methods, effort)?;
    let weighed = |&rays: &usize| Ok((rays, candidates(scene, setting, rays)?));
    Ok(Cell {
        study: study.into(),
        scene: scene.name.clone(),
        light: setting.light.name.clone(),
        material: setting.material.name.clone(),
        pixels: [0, 1, 2, 3].map(|region| truth.members(region).count()),
        reference: (reference.samples, reference.disagreement()),
        max_weight: max_weight(scene, setting)?,
        visible: truth.means[0] / truth.means[1],
        candidates: effort.counts.iter().map(weighed).collect::<client::Result<_>>()?,
        rows,
    })
}

/// Errors and times of methods.
///
/// # Errors
/// Those of the library.
pub fn rows(
    scene: &Scene,
    setting: &Setting,
    truth: &Truth,
    methods: impl Iterator<Item = Method>,
    effort: &Effort,
) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for method in methods {
        if method.is_limit() {
            rows.extend(limit(scene, setting, truth, method, effort)?);
            continue;
        }
        for &count in &effort.counts {
            // Repeats are independent: threads share them. Times are taken afterwards, by one.
            let passes: Vec<u32> = (0..effort.repeats).collect();
            let of = |pass: &u32| Ok(repeat(scene, setting, truth, method, *pass, count)?);
            let repeats = on_threads(&passes, of)?;
            let times = time(scene, setting, method, count, effort.timed, effort.caches)?;
            rows.push(Row { method: method.name(), count, times, repeats });
        }
    }
    Ok(rows)
}

/// The reference, its mean and the region of each point.
pub struct Truth {
    hits: usize,
    values: Vec<[f64; 2]>,
    regions: Vec<usize>,
    means: [f64; 2],
}

impl Truth {
    pub fn new(reference: &Reference, hits: usize) -> Truth {
        let values = pixels(&reference.values(), hits);
        let region = |[shadowed, unshadowed]: &[f64; 2]| match shadowed / unshadowed {
            v if v > 0.95 => 1,
            v if v >= 0.05 => 2,
            _ => 3,
        };
        let mean = |i: usize| values.iter().map(|v| v[i]).sum::<f64>() / values.len() as f64;
        Truth { hits, regions: values.iter().map(region).collect(), means: [mean(0), mean(1)], values }
    }

    /// The mean over all points, with shadows.
    pub fn mean(&self) -> f64 {
        self.means[0]
    }

    /// The points of a region of `REGIONS`.
    pub fn members(&self, region: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.values.len()).filter(move |&i| region == 0 || self.regions[i] == region)
    }

    /// The errors of estimates with and without shadows, in a region.
    pub fn errors(&self, estimates: &[[f64; 2]], region: usize) -> Errors {
        let [mean, unshadowed_mean] = self.means;
        let estimates = pixels(estimates, self.hits);
        let mut sum = Errors::default();
        let mut tail = Vec::new();
        for i in self.members(region) {
            let difference = [0, 1].map(|k| estimates[i][k] - self.values[i][k]);
            sum.absolute += (difference[0] / mean).powi(2);
            sum.relative += difference[0].powi(2) / (self.values[i][0].powi(2) + (0.01 * mean).powi(2));
            sum.unshadowed += (difference[1] / unshadowed_mean).powi(2);
            tail.push((difference[0] / mean).abs());
        }
        if tail.is_empty() {
            return Errors::default();
        }
        let count = tail.len() as f64;
        Errors {
            absolute: sum.absolute / count,
            relative: sum.relative / count,
            unshadowed: sum.unshadowed / count,
            tail: crate::statistics::quantile(&tail, 0.999),
        }
    }
}

/// The means over the hits of each pixel.
fn pixels(values: &[[f64; 2]], hits: usize) -> Vec<[f64; 2]> {
    let mean = |hits: &[[f64; 2]], k: usize| hits.iter().map(|v| v[k]).sum::<f64>() / hits.len() as f64;
    values.chunks(hits).map(|hits| [mean(hits, 0), mean(hits, 1)]).collect()
}

/// Estimates every point once.
fn repeat(
    scene: &Scene,
    setting: &Setting,
    truth: &Truth,
    method: Method,
    pass: u32,
    count: usize,
) -> client::Result<Repeat> {
    let mut estimator = Estimator::new(setting, scene.hits)?;
    let mut estimates = Vec::with_capacity(scene.points.len());
    for point in &scene.points {
        let picks = estimator.picks(method, setting, point, pass, count)?;
        estimates.push(shadowed_and_not(scene, Cost::CHEAP, point, picks));
    }
    Ok(Repeat { errors: [0, 1, 2, 3].map(|region| truth.errors(&estimates, region)) })
}

/// All repeats of a limit, point by point, since it is expensive to prepare. Its time is not measured.
fn limit(scene: &Scene, setting: &Setting, truth: &Truth, method: Method, effort: &Effort) -> client::Result<Vec<Row>> {
    let mut estimator = Estimator::new(setting, scene.hits)?;
    let passes = effort.counts.iter().flat_map(|&count| (0..effort.repeats).map(move |pass| (count, pass)));
    let mut estimates = vec![Vec::with_capacity(scene.points.len()); passes.clone().count()];
    for point in &scene.points {
        for ((count, pass), estimates) in passes.clone().zip(&mut estimates) {
            let picks = estimator.picks(method, setting, point, pass, count)?;
            estimates.push(shadowed_and_not(scene, Cost::CHEAP, point, picks));
        }
    }
    let errors = |estimates: &Vec<_>| [0, 1, 2, 3].map(|region| truth.errors(estimates, region));
    let repeats: Vec<Repeat> = estimates.iter().map(|estimates| Repeat { errors: errors(estimates) }).collect();
    let rows = effort.counts.iter().zip(repeats.chunks(effort.repeats as usize));
    let times = [Times::default(); CACHES.len()];
    Ok(rows.map(|(&count, repeats)| Row { method: method.name(), count, times, repeats: repeats.to_vec() }).collect())
}

/// The largest f L / (p I) on a grid of directions, one in each of its cells, over up to 8 points (rule 33).
///
/// Neither centres of cells nor their corners, and none of a power of two: a direction on the border of two texels belongs
/// to either, as rounding has it, and may belong to one for the light and to the other for the library.
fn max_weight(scene: &Scene, setting: &Setting) -> client::Result<f64> {
    const SIDE: usize = 383;
    let sampler = Rc::new(RefCell::new(environment::Sampler::new(1, 0, 1)?));
    let (material, mut memory) = (environment::material(&setting.material.lobes())?, Block::new(0));
    let at = |c: usize| (c as f32 + 0.382) / SIDE as f32;
    let grid: Vec<Vec3> = (0..SIDE * SIDE).map(|i| octahedral_direction(at(i % SIDE), at(i / SIDE))).collect();
    let mut largest = 0.0_f64;
    for point in scene.points.iter().step_by(scene.points.len().div_ceil(8)) {
        let at = setting.material.point(point, &material);
        let product = Light::product(setting.tables, &sampler, &at, &mut memory)?;
        let bsdf = Bsdf::new(setting.material, point);
        let lit = |wi: &Vec3| (wi.to_array(), f64::from(bsdf.eval_one(*wi).0 * setting.light.radiance(*wi)));
        let (wi, reflected): (Vec<_>, Vec<_>) = grid.iter().map(lit).filter(|v| v.1 > 0.0).unzip();
        let integral = reflected.iter().sum::<f64>() * 4.0 * std::f64::consts::PI / grid.len() as f64;
        let mut pdf = vec![0.0; wi.len()];
        product.pdf_n(&wi, &mut pdf)?;
        let weights = reflected.iter().zip(pdf).map(|(value, pdf)| value / (f64::from(pdf) * integral));
        largest = weights.fold(largest, f64::max);
    }
    Ok(largest)
}

/// How many candidates wis_direct weighs for a ray, over up to 64 points. A target counts them.
fn candidates(scene: &Scene, setting: &Setting, rays: usize) -> client::Result<f64> {
    const POINTS: usize = 64;
    let lobes = setting.material.lobes();
    let (mut sampler, material) = (environment::Sampler::new(rays, 0, 1)?, environment::material(&lobes)?);
    let (mut weighed, mut points, mut ray) = (0, 0, vec![raw::wis_ray::default(); rays]);
    for point in scene.points.iter().step_by(scene.points.len().div_ceil(POINTS)) {
        let (bsdf, mut at) = (Bsdf::new(setting.material, point), setting.material.point(point, &material));
        at.seed = client::pixel_seed(point.pixel, 0);
        let mut target = |wi: &[[f32; 3]], f_cos: &mut [f32]| {
            weighed += wi.len();
            bsdf.values(wi, f_cos);
            true
        };
        sampler.direct(setting.tables, &at, Some(&mut target), &mut ray)?;
        points += 1;
    }
    Ok(weighed as f64 / (points * rays) as f64)
}
