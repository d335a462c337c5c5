//! A map as directional lights, by structured importance sampling and by k-means, and pictures lit by such lights or by
//! plain sampling of the map (Agarwal et al. 2003, Sections 4 and 5).

use crate::client::{self, Jitter, Map, Strata, raw};
use crate::directions;
use crate::estimator::{Lit, Setting};
use crate::lanes::{F8, LANES, V8};
use crate::light::Light;
use crate::material::{Bsdf, Material};
use crate::measure::BATCHES;
use crate::points;
use crate::reference::Reference;
use crate::scene::{Scene, ShadingPoint};
use anyhow::Result;
use glam::Vec3;
use std::f32::consts::TAU;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;
use std::time::Instant;

/// A lat-long light for the library, which takes its texels and matrix from here.
pub struct Source<'a> {
    pub light: &'a Light,
    world_from_map: [f32; 9],
}

impl<'a> Source<'a> {
    pub fn new(light: &'a Light) -> Source<'a> {
        Source { light, world_from_map: light.world_from_map() }
    }

    fn map(&self) -> Map<'a> {
        let [width, height] = self.light.size().map(|n| n as u32);
        Map::latlong(width, height, 1, self.light.luminance())
    }

    /// The strata for a number of lights.
    ///
    /// # Errors
    /// Those of the library.
    pub fn strata(&self, count: u32) -> client::Result<Strata> {
        self.strata_by(&raw::wis_strata_config { count, ..Default::default() })
    }

    /// The strata of a config.
    ///
    /// # Errors
    /// Those of the library.
    pub fn strata_by(&self, config: &raw::wis_strata_config) -> client::Result<Strata> {
        Strata::new(&self.map(), &self.world_from_map, config)
    }

    /// Places inside strata: `WIS_JITTER_*`.
    ///
    /// # Errors
    /// Those of the library.
    pub fn jitter(&self, strata: &Strata, distribution: u32) -> client::Result<Jitter> {
        strata.jitter(&self.map(), &self.world_from_map, distribution)
    }
}

/// A map's strata for each number of samples of the report, with places inside: one sample a stratum by the light, as
/// unbiased as sampling by the light alone.
pub struct Stratified(Vec<Places>);

/// No more strata than samples.
pub struct Places {
    samples: usize,
    strata: Strata,
    jitter: Jitter,
}

impl Stratified {
    /// # Errors
    /// Those of the library.
    pub fn new(light: &Light) -> client::Result<Stratified> {
        let latlong = light.to_latlong(512);
        let source = Source::new(&latlong);
        let places = |samples: &usize| {
            let mut count = *samples as u32;
            let mut strata = source.strata(count)?;
            // Small bright regions may have got lights of their own.
            while strata.lights.len() > *samples && count > 1 {
                count -= 1;
                strata = source.strata(count)?;
            }
            let jitter = source.jitter(&strata, raw::WIS_JITTER_ENERGY)?;
            Ok(Places { samples: *samples, strata, jitter })
        };
        Ok(Stratified(BATCHES.iter().map(places).collect::<client::Result<_>>()?))
    }

    /// The strata for so many samples.
    ///
    /// # Panics
    /// The report has no such number.
    pub fn of(&self, samples: usize) -> &Places {
        self.0.iter().find(|places| places.samples == samples).expect("a number of samples of the report")
    }
}

impl Places {
    pub fn count(&self) -> usize {
        self.strata.lights.len()
    }

    /// A direction in a stratum, and its pdf there.
    ///
    /// # Errors
    /// Those of the library.
    pub fn sample(&self, stratum: usize, u: [f32; 2]) -> client::Result<([f32; 3], f32)> {
        self.jitter.sample(stratum as u32, u)
    }
}

/// Directional lights, eight side by side.
pub struct Lights {
    pub count: usize,
    each: Vec<Vec3>,
    directions: Vec<V8>,
    energy: Vec<F8>,
}

impl Lights {
    /// Lights by direction and energy (radiance x solid angle).
    pub fn new(lights: &[(Vec3, f32)]) -> Lights {
        let at = |i: usize| lights.get(i).copied().unwrap_or((Vec3::Z, 0.0));
        let lanes = |of: &dyn Fn((Vec3, f32)) -> f32, first: usize| F8::new(std::array::from_fn(|i| of(at(first + i))));
        let blocks = || (0..lights.len()).step_by(LANES);
        let direction = |i: usize| V8::new(lanes(&|l| l.0.x, i), lanes(&|l| l.0.y, i), lanes(&|l| l.0.z, i));
        Lights {
            count: lights.len(),
            each: lights.iter().map(|l| l.0).collect(),
            directions: blocks().map(direction).collect(),
            energy: blocks().map(|i| lanes(&|l| l.1, i)).collect(),
        }
    }

    pub fn of(strata: &Strata) -> Lights {
        let light = |l: &raw::wis_light| (Vec3::from_array(l.direction), l.luminance);
        Lights::new(&strata.lights.iter().map(light).collect::<Vec<_>>())
    }

    /// What each light adds at a point if it is seen.
    fn contributions(&self, bsdf: &Bsdf, out: &mut Vec<f32>) {
        out.clear();
        let blocks = self.directions.iter().zip(&self.energy);
        for ((wi, energy), first) in blocks.zip((0..).step_by(LANES)) {
            out.extend((bsdf.eval(*wi, self.count - first).0 * *energy).to_array());
        }
        out.truncate(self.count);
    }
}

/// Weighted spherical k-means, the idea of LightGen (Cohen and Debevec 2001): texels weigh their irradiance. Starts from
/// centres spread along the texels by weight.
pub fn clustered(light: &Light, count: usize, rounds: usize) -> Lights {
    let texels: Vec<(Vec3, f32)> = light
        .quadrature(1)
        .zip(light.luminance())
        .map(|((direction, area), radiance)| (direction, area as f32 * radiance))
        .filter(|texel| texel.1 > 0.0)
        .collect();
    let mut centres = spread(&texels, count);
    let mut energy = Vec::new();
    for _ in 0..rounds {
        let lights = Lights::new(&centres.iter().map(|&c| (c, 0.0)).collect::<Vec<_>>());
        let mut sums = vec![(Vec3::ZERO, 0.0_f64); count];
        for &(direction, weight) in &texels {
            let sum = &mut sums[nearest(&lights, direction)];
            sum.0 += direction * weight;
            sum.1 += f64::from(weight);
        }
        for (centre, sum) in centres.iter_mut().zip(&sums) {
            *centre = sum.0.try_normalize().unwrap_or(*centre);
        }
        energy = sums.iter().map(|sum| sum.1 as f32).collect();
    }
    Lights::new(&centres.into_iter().zip(energy).collect::<Vec<_>>())
}

/// Texels at equal steps of accumulated weight.
fn spread(texels: &[(Vec3, f32)], count: usize) -> Vec<Vec3> {
    let total: f64 = texels.iter().map(|t| f64::from(t.1)).sum();
    let (mut sum, mut next, mut centres) = (0.0, 0.5, Vec::with_capacity(count));
    for texel in texels {
        sum += f64::from(texel.1) / total * count as f64;
        while next < sum && centres.len() < count {
            // Centres of one texel are told apart by a little.
            centres.push((texel.0 + 1e-4 * (next as f32).sin() * texel.0.any_orthonormal_vector()).normalize());
            next += 1.0;
        }
    }
    centres.resize(count, Vec3::Z);
    centres
}

fn nearest(lights: &Lights, direction: Vec3) -> usize {
    let direction = V8::splat(direction);
    let mut best = (F8::splat(-2.0), F8::ZERO);
    for (block, wi) in lights.directions.iter().enumerate() {
        let near = wi.dot(direction);
        let better = wide::CmpGt::cmp_gt(near, best.0);
        best = (better.blend(near, best.0), better.blend(F8::splat(block as f32), best.1));
    }
    let (near, block) = (best.0.to_array(), best.1.to_array());
    let lane = (0..LANES).fold(0, |best, lane| if near[lane] > near[best] { lane } else { best });
    (block[lane] as usize * LANES + lane).min(lights.count - 1)
}

/// Sampling of a map by a table over its texels in raster order, with stratified numbers: what the paper compares with.
pub struct Raster<'a> {
    light: &'a Light,
    sums: Vec<f64>,
}

impl<'a> Raster<'a> {
    pub fn new(light: &'a Light) -> Raster<'a> {
        let texels = light.luminance().iter().zip(light.solid_angles());
        let sum = |sum: &mut f64, (radiance, area): (&f32, f64)| {
            *sum += f64::from(*radiance) * area;
            Some(*sum)
        };
        Raster { light, sums: texels.scan(0.0, sum).collect() }
    }

    pub fn power(&self) -> f64 {
        self.sums.last().copied().unwrap_or(0.0)
    }

    /// A direction by a number in [0, 1), at a random place in its texel.
    fn sample(&self, u: f64, place: [f32; 2]) -> Vec3 {
        let texel = self.sums.partition_point(|&sum| sum <= u * self.power()).min(self.sums.len() - 1);
        let [width, height] = self.light.size();
        let (x, y) = (texel % width, texel / width);
        let cosine = |y: usize| (std::f64::consts::PI * y as f64 / height as f64).cos() as f32;
        let z = cosine(y) + (cosine(y + 1) - cosine(y)) * place[1];
        let (sin, cos) = (TAU * (x as f32 + place[0]) / width as f32).sin_cos();
        let across = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(across * cos, -across * sin, z)
    }
}

/// Where references are kept.
const CACHE: &str = "build/report";
/// Samples of each technique in half of a reference.
const MOST: usize = 2048;
/// The disagreement of the halves, over the mean, that is good enough.
const BOUND: f64 = 0.004;

/// The picture without noise, by the report's references but to a bound of their own; kept in a file.
///
/// # Errors
/// Those of the library, and of writing the file.
pub fn truth(scene: &Scene, light: &Light, material: &Material) -> Result<Vec<f64>> {
    let environment = light.environment()?;
    let lit = Lit::new(light, &environment)?;
    let setting = Setting::new(&lit, material);
    let mut hasher = DefaultHasher::new();
    (scene.fingerprint(), light.fingerprint(), format!("{material:?}"), MOST, BOUND.to_bits()).hash(&mut hasher);
    let file = Path::new(CACHE).join(format!("structured-{:016x}.json", hasher.finish()));
    let reference = Reference::to(BOUND, &file, scene, &setting, MOST)?;
    eprintln!("reference of {}, {}: halves differ by {:.4}", scene.name, light.name, reference.disagreement());
    Ok(reference.values().iter().map(|v| v[0]).collect())
}

/// How a picture is lit.
pub enum How<'a> {
    /// All lights.
    Lights(&'a Lights),
    /// The lights in the order of what they may add, until the rest is below a share of the whole; of the rest so many
    /// random ones tell which share of it is seen.
    Sorted(&'a Lights, f32, usize),
    /// All lights, each seen from a random place of its stratum.
    Jittered(&'a Lights, &'a Jitter),
    /// Stratified samples of the map.
    Importance(&'a Raster<'a>, usize),
    /// Stratified samples of the hemisphere.
    Uniform(&'a Light, usize),
    /// Samples of the BRDF.
    Brdf(&'a Light, usize),
}

/// A picture: the radiance of its points, and what it took.
pub struct Picture {
    pub values: Vec<f64>,
    /// Shadow rays for a point.
    pub rays: f64,
    /// Microseconds for a point.
    pub us: f64,
}

impl Picture {
    /// The root mean squared error over the mean.
    pub fn error(&self, truth: &[f64]) -> f64 {
        let squares: f64 = self.values.iter().zip(truth).map(|(v, t)| (v - t).powi(2)).sum();
        (squares / truth.len() as f64).sqrt() / (truth.iter().sum::<f64>() / truth.len() as f64)
    }
}

/// Memory for the estimates of a picture.
#[derive(Default)]
pub struct Shader {
    contributions: Vec<f32>,
    index: Vec<u32>,
    rest: Vec<u32>,
    u: Vec<[f32; 2]>,
    pub rays: u64,
}

/// Lights all points of a scene; `frame` seeds the random numbers.
///
/// # Errors
/// Those of the library.
pub fn picture(scene: &Scene, material: &Material, how: &How, frame: u32) -> client::Result<Picture> {
    let mut shader = Shader::default();
    let start = Instant::now();
    let mut values = Vec::with_capacity(scene.points.len());
    for point in &scene.points {
        values.push(shader.estimate(scene, point, &Bsdf::new(material, point), how, frame)?);
    }
    let points = scene.points.len() as f64;
    Ok(Picture { values, rays: shader.rays as f64 / points, us: start.elapsed().as_secs_f64() * 1e6 / points })
}

impl Shader {
    /// The light that a point reflects.
    ///
    /// # Errors
    /// Those of the library.
    pub fn estimate(
        &mut self,
        scene: &Scene,
        point: &ShadingPoint,
        bsdf: &Bsdf,
        how: &How,
        frame: u32,
    ) -> client::Result<f64> {
        let seed = client::pixel_seed(point.pixel, frame);
        match *how {
            How::Lights(lights) => {
                lights.contributions(bsdf, &mut self.contributions);
                self.traced(scene, point, |i| Ok(lights.each[i]))
            }
            How::Sorted(lights, threshold, few) => self.sorted(scene, point, bsdf, (lights, threshold, few), seed),
            How::Jittered(lights, jitter) => {
                lights.contributions(bsdf, &mut self.contributions);
                self.draw(seed, lights.count);
                let u = std::mem::take(&mut self.u);
                let sum = self.traced(scene, point, |i| Ok(Vec3::from_array(jitter.sample(i as u32, u[i])?.0)));
                self.u = u;
                sum
            }
            How::Importance(raster, count) => {
                let pdf = |wi: Vec3| f64::from(raster.light.radiance(wi)) / raster.power();
                let sample = |i: usize, u: [f32; 2], place: [f32; 2]| {
                    raster.sample((i as f64 + f64::from(u[0])) / count as f64, [u[1], place[0]])
                };
                Ok(self.sampled(scene, point, bsdf, (raster.light, count, seed), sample, pdf))
            }
            How::Uniform(light, count) => {
                let sample = |_: usize, u: [f32; 2], _: [f32; 2]| directions::hemisphere(point.normal, u);
                Ok(self.sampled(scene, point, bsdf, (light, count, seed), sample, |_| 1.0 / f64::from(TAU)))
            }
            How::Brdf(light, count) => {
                let sample = |_: usize, u: [f32; 2], _: [f32; 2]| bsdf.sample_one(u);
                let pdf = |wi: Vec3| f64::from(bsdf.eval_one(wi).1);
                Ok(self.sampled(scene, point, bsdf, (light, count, seed), sample, pdf))
            }
        }
    }

    fn draw(&mut self, seed: u32, count: usize) {
        self.u.resize(count, [0.0; 2]);
        points::sobol(seed, 0, &mut self.u);
    }

    /// The sum of the contributions whose direction is seen.
    fn traced(
        &mut self,
        scene: &Scene,
        point: &ShadingPoint,
        direction: impl Fn(usize) -> client::Result<Vec3>,
    ) -> client::Result<f64> {
        let mut sum = 0.0;
        for (i, &contribution) in self.contributions.iter().enumerate().filter(|c| *c.1 > 0.0) {
            self.rays += 1;
            sum += if scene.visible(point, direction(i)?) { f64::from(contribution) } else { 0.0 };
        }
        Ok(sum)
    }

    fn sorted(
        &mut self,
        scene: &Scene,
        point: &ShadingPoint,
        bsdf: &Bsdf,
        (lights, threshold, few): (&Lights, f32, usize),
        seed: u32,
    ) -> client::Result<f64> {
        lights.contributions(bsdf, &mut self.contributions);
        self.index.resize(lights.count, 0);
        let traced = client::order(&self.contributions, threshold, &mut self.index)?;
        let seen = |i: u32| scene.visible(point, lights.each[i as usize]);
        let value = |i: &u32| f64::from(self.contributions[*i as usize]);
        let (first, rest) = self.index.split_at(traced);
        self.rest.clear();
        self.rest.extend(rest.iter().copied().filter(|i| value(i) > 0.0));
        let rest = &self.rest;
        let sum: f64 = first.iter().filter(|&&i| seen(i)).map(value).sum();
        let few = few.min(rest.len());
        self.rays += (traced + few) as u64;
        if few == 0 {
            return Ok(sum);
        }
        // Chosen by contribution, the share that is seen estimates the rest without bias.
        let whole: f64 = rest.iter().map(value).sum();
        let choice = |u: f32| {
            let mut left = f64::from(u) * whole;
            rest.iter().copied().find(|i| {
                left -= value(i);
                left < 0.0
            })
        };
        self.u.resize(few, [0.0; 2]);
        points::sobol(seed, 0, &mut self.u);
        let share = self.u.iter().filter_map(|u| choice(u[0])).filter(|&i| seen(i)).count() as f64 / few as f64;
        Ok(sum + share * whole)
    }

    /// The mean of samples over their density.
    fn sampled(
        &mut self,
        scene: &Scene,
        point: &ShadingPoint,
        bsdf: &Bsdf,
        (light, count, seed): (&Light, usize, u32),
        sample: impl Fn(usize, [f32; 2], [f32; 2]) -> Vec3,
        pdf: impl Fn(Vec3) -> f64,
    ) -> f64 {
        self.draw(seed, 2 * count);
        let mut sum = 0.0;
        for i in 0..count {
            let wi = sample(i, self.u[i], self.u[count + i]);
            let value = f64::from(bsdf.eval_one(wi).0 * light.radiance(wi));
            if value > 0.0 {
                self.rays += 1;
                sum += if scene.visible(point, wi) { value / pdf(wi) } else { 0.0 };
            }
        }
        sum / count as f64
    }
}
