//! A map as directional lights, by structured importance sampling and by k-means, and pictures lit by such lights or by
//! plain sampling of the map (Agarwal et al. 2003, Sections 4 and 5).

use crate::client::{self, Jitter, Strata, raw};
use crate::directions;
use crate::lanes::{F8, LANES, V8};
use crate::light::Light;
use crate::material::{Bsdf, Material};
use crate::points;
use crate::processor;
use crate::reference::Reference;
use crate::scene::{Scene, ShadingPoint};
use crate::setting::{Lit, Setting};
pub use crate::stratified::Source;
use crate::threads::on_threads;
use anyhow::Result;
use glam::Vec3;
use std::f32::consts::TAU;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

/// Directional lights, eight side by side.
pub struct Lights {
    pub count: usize,
    each: Vec<Vec3>,
    /// The colour of each over its luminance; none where no colours are drawn.
    tints: Vec<[f32; 3]>,
    directions: Vec<V8>,
    energy: Vec<F8>,
    /// All lights, neighbours of the sphere one after the other.
    along: Vec<u32>,
}

impl Lights {
    /// Lights by direction and energy (radiance x solid angle).
    pub fn new(lights: &[(Vec3, f32)]) -> Lights {
        let at = |i: usize| lights.get(i).copied().unwrap_or((Vec3::Z, 0.0));
        let lanes = |of: &dyn Fn((Vec3, f32)) -> f32, first: usize| F8::new(std::array::from_fn(|i| of(at(first + i))));
        let blocks = || (0..lights.len()).step_by(LANES);
        let direction = |i: usize| V8::new(lanes(&|l| l.0.x, i), lanes(&|l| l.0.y, i), lanes(&|l| l.0.z, i));
        let mut along: Vec<u32> = (0..lights.len() as u32).collect();
        along.sort_by_key(|i| curve(lights[*i as usize].0));
        Lights {
            along,
            count: lights.len(),
            each: lights.iter().map(|l| l.0).collect(),
            tints: Vec::new(),
            directions: blocks().map(direction).collect(),
            energy: blocks().map(|i| lanes(&|l| l.1, i)).collect(),
        }
    }

    pub fn of(strata: &Strata) -> Lights {
        let light = |l: &raw::wis_light| (Vec3::from_array(l.direction), l.luminance);
        Lights::new(&strata.lights.iter().map(light).collect::<Vec<_>>())
    }

    /// The directions of the lights.
    pub fn directions(&self) -> &[Vec3] {
        &self.each
    }

    /// The same with the mean colour of the texels that are nearest to each light.
    pub fn tinted(mut self, light: &Light, colours: &[Light; 3]) -> Lights {
        let mut sums = vec![[0.0f64; 4]; self.count];
        for (i, (direction, area)) in light.quadrature(1).enumerate() {
            let sum = &mut sums[nearest(&self, direction)];
            let channels = [&colours[0], &colours[1], &colours[2], light].map(|channel| channel.luminance()[i]);
            sum.iter_mut().zip(channels).for_each(|(sum, value)| *sum += f64::from(value) * area);
        }
        let tint = |[r, g, b, luminance]: [f64; 4]| [r, g, b].map(|c| (c / luminance.max(1e-30)) as f32);
        self.tints = sums.into_iter().map(tint).collect();
        self
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

/// The place of a direction along a curve through the pixels of the octahedral square: their Morton code.
fn curve(direction: Vec3) -> u32 {
    const SIDE: f32 = 256.0;
    let [x, y] = client::square_point(direction.to_array(), None).unwrap_or_default().map(|c| (c * SIDE) as u32);
    (0..8).fold(0, |code, bit| code | (x >> bit & 1) << (2 * bit + 1) | (y >> bit & 1) << (2 * bit))
}

/// Where k-means begins.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// Centres spread along the texels by their weight.
    Weight,
    /// Centres spread evenly over the sphere.
    Area,
}

/// Weighted spherical k-means, the idea of LightGen (Cohen and Debevec 2001): texels weigh their irradiance.
pub fn clustered(light: &Light, count: usize, rounds: usize, start: Start) -> Lights {
    let texels: Vec<(Vec3, f32)> = light
        .quadrature(1)
        .zip(light.luminance())
        .map(|((direction, area), radiance)| (direction, area as f32 * radiance))
        .filter(|texel| texel.1 > 0.0)
        .collect();
    let mut centres = match start {
        Start::Weight => spread(&texels, count),
        Start::Area => spiral(count),
    };
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

/// Directions along a spiral from pole to pole, each with as much of the sphere.
fn spiral(count: usize) -> Vec<Vec3> {
    let golden = std::f32::consts::PI * (3.0 - 5.0f32.sqrt());
    let at = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f32 / count as f32;
        let (sin, cos) = (golden * i as f32).sin_cos();
        let across = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(across * cos, across * sin, z)
    };
    (0..count).map(at).collect()
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

    /// Sample number `i` of `count`, each in its own part of the light.
    fn stratified(&self, i: usize, count: usize, u: [f32; 2], place: [f32; 2]) -> Vec3 {
        self.sample((i as f64 + f64::from(u[0])) / count as f64, [u[1], place[0]])
    }

    /// The density of a direction.
    fn pdf(&self, wi: Vec3) -> f64 {
        f64::from(self.light.radiance(wi)) / self.power()
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
    let lit = Lit::new(light)?;
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
    /// All lights, whose BRDFs are evaluated one by one, as those of samples are.
    OneByOne(&'a Lights),
    /// The lights in the order of what they may add, until the rest is below a share of the whole; of the rest so many
    /// random ones tell which share of it is seen.
    Sorted(&'a Lights, f32, usize),
    /// The lights that may add as much as a share of the level, and of the rest systematic picks along the sphere in proportion to what
    /// each may add, at steps of that much. The level is a radiance, or what could arrive at the point.
    Picked(&'a Lights, f32, Option<f64>),
    /// The same, where what is seen of the traced light before it along the sphere stands for each of the rest, and picks estimate the
    /// difference: a control variate.
    Controlled(&'a Lights, f32, Option<f64>),
    /// All lights, each seen from a random place of its stratum.
    Jittered(&'a Lights, &'a Jitter),
    /// All lights, whose BRDF is the mean over so many places of the stratum.
    Spread(&'a Lights, &'a Jitter, usize),
    /// Stratified samples of the map.
    Importance(&'a Raster<'a>, usize),
    /// Stratified samples of the hemisphere.
    Uniform(&'a Light, usize),
    /// Samples of the BRDF.
    Brdf(&'a Light, usize),
    /// Half of the samples of the map, stratified, half of the BRDF, weighed by the balance heuristic.
    Mis(&'a Raster<'a>, usize),
}

/// A picture: the radiance of its points, and what it took.
pub struct Picture {
    pub values: Vec<f64>,
    /// Shadow rays for a point.
    pub rays: f64,
    /// Microseconds of processor time for a point.
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
pub struct Shader<'a> {
    /// The red, green and blue of the light, where colours are drawn.
    colours: Option<&'a [Light; 3]>,
    contributions: Vec<f32>,
    index: Vec<u32>,
    rest: Vec<u32>,
    u: Vec<[f32; 2]>,
    pub rays: u64,
    sum: f64,
    /// The last estimate in colour.
    pub rgb: [f64; 3],
}

/// Lights all points of a scene; `frame` seeds the random numbers. Times are of the processor.
///
/// # Errors
/// Those of the library.
pub fn picture(scene: &Scene, material: &Material, how: &How, frame: u32) -> client::Result<Picture> {
    let mut shader = Shader::default();
    let start = processor::seconds();
    let mut values = Vec::with_capacity(scene.points.len());
    for point in &scene.points {
        values.push(shader.estimate(scene, point, material, how, frame)?);
    }
    let points = scene.points.len() as f64;
    Ok(Picture { values, rays: shader.rays as f64 / points, us: (processor::seconds() - start) * 1e6 / points })
}

/// Microseconds of a point for the steps before any ray: what each light may add, and the order of that.
///
/// # Errors
/// Those of the library.
pub fn steps(scene: &Scene, material: &Material, lights: &Lights) -> client::Result<[f64; 2]> {
    let (mut shader, mut seconds) = (Shader::default(), [0.0; 2]);
    shader.index.resize(lights.count, 0);
    for point in &scene.points {
        let start = processor::seconds();
        lights.contributions(&Bsdf::new(material, point), &mut shader.contributions);
        let middle = processor::seconds();
        client::order(&shader.contributions, 0.0, &mut shader.index)?;
        let times = [middle - start, processor::seconds() - middle];
        seconds.iter_mut().zip(times).for_each(|(sum, time)| *sum += time);
    }
    Ok(seconds.map(|seconds| seconds * 1e6 / scene.points.len() as f64))
}

/// Lights all points of a scene in the colours of the light, on two threads: luminance, and red, green and blue. Lights
/// need tints.
///
/// # Errors
/// Those of the library.
///
/// # Panics
/// A thread panics.
pub fn coloured(
    scene: &Scene,
    material: &Material,
    how: &How,
    colours: &[Light; 3],
) -> Result<(Vec<f64>, Vec<[f32; 3]>)> {
    let all = on_threads(&scene.points, |point| {
        let mut shader = Shader::coloured(colours);
        let value = shader.estimate(scene, point, material, how, 0)?;
        Ok((value, shader.rgb.map(|c| c as f32)))
    })?;
    Ok(all.into_iter().unzip())
}

impl<'a> Shader<'a> {
    /// A shader that also answers colours: those of the light.
    pub fn coloured(colours: &'a [Light; 3]) -> Shader<'a> {
        Shader { colours: Some(colours), ..Default::default() }
    }
}

/// A point that is lit, and the seed of its random numbers.
#[derive(Clone, Copy)]
struct At<'a> {
    scene: &'a Scene,
    point: &'a ShadingPoint,
    bsdf: &'a Bsdf,
    seed: u32,
}

impl At<'_> {
    fn sees(self, wi: Vec3) -> bool {
        self.scene.visible(self.point, wi)
    }
}

impl Shader<'_> {
    /// The light that a point reflects.
    ///
    /// # Errors
    /// Those of the library.
    pub fn estimate(
        &mut self,
        scene: &Scene,
        point: &ShadingPoint,
        material: &Material,
        how: &How,
        frame: u32,
    ) -> client::Result<f64> {
        let (seed, bsdf) = (client::pixel_seed(point.pixel, frame), &Bsdf::new(material, point));
        let at = At { scene, point, bsdf, seed };
        (self.sum, self.rgb) = (0.0, [0.0; 3]);
        match *how {
            How::Lights(lights) => {
                lights.contributions(bsdf, &mut self.contributions);
                self.traced(at, lights, |i| Ok(lights.each[i]))?;
            }
            How::OneByOne(lights) => {
                self.contributions.clear();
                let energy = |i: usize| lights.energy[i / LANES].to_array()[i % LANES];
                self.contributions.extend((0..lights.count).map(|i| bsdf.eval_one(lights.each[i]).0 * energy(i)));
                self.traced(at, lights, |i| Ok(lights.each[i]))?;
            }
            How::Sorted(lights, threshold, few) => self.sorted(at, lights, threshold, few)?,
            How::Picked(lights, share, level) => self.picked(at, lights, share, level, false),
            How::Controlled(lights, share, level) => self.picked(at, lights, share, level, true),
            How::Spread(lights, jitter, places) => {
                self.contributions.clear();
                self.draw(seed, places);
                for i in 0..lights.count {
                    let mut sum = 0.0;
                    for u in &self.u[..places] {
                        sum += bsdf.eval_one(Vec3::from_array(jitter.sample(i as u32, *u)?.0)).0;
                    }
                    self.contributions.push(sum / places as f32 * lights.energy[i / LANES].to_array()[i % LANES]);
                }
                self.traced(at, lights, |i| Ok(lights.each[i]))?;
            }
            How::Jittered(lights, jitter) => {
                lights.contributions(bsdf, &mut self.contributions);
                self.draw(seed, lights.count);
                let u = std::mem::take(&mut self.u);
                let traced = self.traced(at, lights, |i| Ok(Vec3::from_array(jitter.sample(i as u32, u[i])?.0)));
                self.u = u;
                traced?;
            }
            How::Importance(raster, count) => {
                let sample = |i: usize, u: [f32; 2], place: [f32; 2]| raster.stratified(i, count, u, place);
                self.sampled(at, raster.light, count, sample, |wi| raster.pdf(wi));
            }
            How::Uniform(light, count) => {
                let sample = |_: usize, u: [f32; 2], _: [f32; 2]| directions::hemisphere(point.normal, u);
                self.sampled(at, light, count, sample, |_| 1.0 / f64::from(TAU));
            }
            How::Brdf(light, count) => {
                let sample = |_: usize, u: [f32; 2], _: [f32; 2]| bsdf.sample_one(u);
                let pdf = |wi: Vec3| f64::from(bsdf.eval_one(wi).1);
                self.sampled(at, light, count, sample, pdf);
            }
            How::Mis(raster, count) => {
                let half = count / 2;
                let sample = |i: usize, u: [f32; 2], place: [f32; 2]| {
                    if i < half { raster.stratified(i, half, u, place) } else { bsdf.sample_one(u) }
                };
                // The mean of both densities, each of half of the samples: the balance heuristic.
                let pdf = |wi: Vec3| 0.5 * (raster.pdf(wi) + f64::from(bsdf.eval_one(wi).1));
                self.sampled(at, raster.light, 2 * half, sample, pdf);
            }
        }
        Ok(self.sum)
    }

    /// Adds light that is seen, of a colour over its luminance.
    fn add(&mut self, value: f64, tint: impl FnOnce(&[Light; 3]) -> [f32; 3]) {
        self.sum += value;
        if let Some(colours) = self.colours {
            let tint = tint(colours);
            self.rgb.iter_mut().zip(tint).for_each(|(sum, tint)| *sum += value * f64::from(tint));
        }
    }

    fn draw(&mut self, seed: u32, count: usize) {
        self.u.resize(count, [0.0; 2]);
        points::sobol(seed, 0, &mut self.u);
    }

    /// Adds the contributions whose direction is seen.
    fn traced(
        &mut self,
        at: At,
        lights: &Lights,
        direction: impl Fn(usize) -> client::Result<Vec3>,
    ) -> client::Result<()> {
        for i in 0..self.contributions.len() {
            let contribution = f64::from(self.contributions[i]);
            if contribution > 0.0 {
                self.rays += 1;
                if at.sees(direction(i)?) {
                    self.add(contribution, |_| lights.tints[i]);
                }
            }
        }
        Ok(())
    }

    fn sorted(&mut self, at: At, lights: &Lights, threshold: f32, few: usize) -> client::Result<()> {
        lights.contributions(at.bsdf, &mut self.contributions);
        self.index.resize(lights.count, 0);
        let traced = client::order(&self.contributions, threshold, &mut self.index)?;
        self.rest.clear();
        let contributions = &self.contributions;
        self.rest.extend(self.index[traced..].iter().copied().filter(|i| contributions[*i as usize] > 0.0));
        let few = few.min(self.rest.len());
        self.rays += (traced + few) as u64;
        let seen = |i: u32| at.sees(lights.each[i as usize]);
        for k in 0..traced {
            let i = self.index[k];
            if seen(i) {
                self.add(f64::from(self.contributions[i as usize]), |_| lights.tints[i as usize]);
            }
        }
        if few == 0 {
            return Ok(());
        }
        // Chosen by contribution, the share that is seen estimates the rest without bias.
        let value = |contributions: &[f32], i: u32| f64::from(contributions[i as usize]);
        let whole: f64 = self.rest.iter().map(|&i| value(&self.contributions, i)).sum();
        self.draw(at.seed, few);
        for k in 0..few {
            let mut left = f64::from(self.u[k][0]) * whole;
            let chosen = self.rest.iter().copied().find(|&i| {
                left -= value(&self.contributions, i);
                left < 0.0
            });
            if let Some(i) = chosen.filter(|&i| seen(i)) {
                self.add(whole / few as f64, |_| lights.tints[i as usize]);
            }
        }
        Ok(())
    }

    /// Lights whose contribution is at least a step are traced. A random start makes the others an estimate without bias: each is picked
    /// with the probability contribution / step, and stands for a whole step.
    fn picked(&mut self, at: At, lights: &Lights, share: f32, level: Option<f64>, control: bool) {
        lights.contributions(at.bsdf, &mut self.contributions);
        let level = level.unwrap_or_else(|| f64::from(self.contributions.iter().sum::<f32>()));
        let step = f64::from(share) * level;
        self.draw(at.seed, 1);
        let mut next = f64::from(self.u[0][0]) * step;
        let seen = |shader: &mut Self, light: usize| {
            shader.rays += 1;
            f64::from(u8::from(at.sees(lights.each[light])))
        };
        let mut before = 0.0;
        for &light in &lights.along {
            let light = light as usize;
            let contribution = f64::from(self.contributions[light]);
            let mut value = before * contribution;
            if contribution >= step && contribution > 0.0 {
                let share = seen(self, light);
                value = share * contribution;
                before = if control { share } else { 0.0 };
            } else {
                next -= contribution;
                if next < 0.0 {
                    next += step;
                    value += (seen(self, light) - before) * step;
                }
            }
            if value != 0.0 {
                self.add(value, |_| lights.tints[light]);
            }
        }
    }

    /// Adds the mean of samples over their density.
    fn sampled(
        &mut self,
        at: At,
        light: &Light,
        count: usize,
        sample: impl Fn(usize, [f32; 2], [f32; 2]) -> Vec3,
        pdf: impl Fn(Vec3) -> f64,
    ) {
        self.draw(at.seed, 2 * count);
        for i in 0..count {
            let wi = sample(i, self.u[i], self.u[count + i]);
            let radiance = light.radiance(wi);
            let value = f64::from(at.bsdf.eval_one(wi).0 * radiance);
            if value > 0.0 {
                self.rays += 1;
                if at.sees(wi) {
                    let tint = |colours: &[Light; 3]| colours.each_ref().map(|c| c.radiance(wi) / radiance);
                    self.add(value / pdf(wi) / count as f64, tint);
                }
            }
        }
    }
}
