//! Bounds on errors, weights and frequencies of densities and rays.
//!
//! Nothing here is taken from the library but its answers: BRDFs are the client's own ([`super::brdf`]), so is the look-up of the
//! map, and references are integrals by quadrature ([`super::quadrature`]).

use super::brdf::{V3, single, unit};
use super::laws::{self, ensure};
use super::quadrature::{Integral, Peak};
use crate::client::{Block, Brdf, Density, raw};
use crate::directions::sphere;
use crate::environment::{Environment, Light, Sampler};
use crate::statistics::{chi_square, mean_and_error};
use crate::threads::on_threads;
use std::cell::RefCell;
use std::rc::Rc;

/// Rule 33 of docs/design.md: the largest f L cos / (p I).
pub const LARGEST: f64 = 50.0;
/// How far a mean may be from the reference: so many standard errors, and what the quadrature is off by.
const ERRORS: f64 = 4.5;
const QUADRATURE: f64 = 1e-3;
/// The largest fault of a mean that may be missed (rule 36), in standard errors: those above, and 2.33 for a power of 0.99.
pub const MISSED: f64 = 0.02;
const REACH: f64 = ERRORS + 2.33;
/// The p-value below which frequencies are not those of the density, and how far its integral may be from 1.
const SIGNIFICANCE: f64 = 1e-6;
const MASS: f64 = 4e-3;
/// Parts of the sphere that frequencies are counted in hold at most this much, where they can be divided.
const SHARE: f64 = 1.0 / 64.0;
/// Samples of a density at first, and at most; looks for the largest weight.
const SAMPLES: [usize; 2] = [1 << 18, 1 << 20];
const LOOKS: usize = 6000;
/// Hits of a pixel in a mean of rays; of how many pixels at first, and at most.
const HITS: u32 = 64;
const PIXELS: [usize; 2] = [64, 16384];

/// A fault that a test injects, to see that rows notice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    None,
    /// Densities are larger by 2.5 %.
    Density,
    /// Weights of rays are larger by 2.5 %.
    Weight,
    /// One of 20 samples goes to the peak.
    Frequency,
    /// The integral is larger by twice what it may be off by.
    Integral,
    /// The density is a hundredth where much of the light is.
    Hole,
    /// One of ten rays goes the other way.
    Idle,
}

/// A row that is not measured yet.
pub struct Job {
    pub case: String,
    pub measure: Box<dyn Fn() -> Result<Figures, String> + Send + Sync>,
}

impl Job {
    pub fn new(case: impl Into<String>, measure: impl Fn() -> Result<Figures, String> + Send + Sync + 'static) -> Job {
        Job { case: case.into(), measure: Box::new(measure) }
    }
}

/// A case of products and rays.
pub struct Bounded {
    /// Lobes, view and light.
    pub case: String,
    /// What was measured, or what is out of bounds.
    pub got: Result<Figures, String>,
}

/// Measures rows on all processors.
pub fn measure(jobs: &[Job]) -> Vec<Bounded> {
    let row = |job: &Job| Ok(Bounded { case: job.case.clone(), got: (job.measure)() });
    on_threads(jobs, row).expect("no row fails by itself")
}

/// What a client adds up, and where it is large.
pub struct Task<'a> {
    /// Radiance x BRDF x cosine, in a unit in which nothing overflows.
    pub brings: &'a dyn Fn(V3) -> f64,
    pub peaks: Vec<Peak>,
    /// The integral.
    pub value: f64,
    pub fault: Fault,
}

impl<'a> Task<'a> {
    pub fn new(brings: &'a dyn Fn(V3) -> f64, peaks: Vec<Peak>, accuracy: f64, fault: Fault) -> Task<'a> {
        let value = Integral::relative(&|wi| wi.map(brings), &peaks, accuracy).value;
        Task { brings, peaks, value, fault }
    }
}

/// What was measured.
#[derive(Clone, Copy, Debug, Default)]
pub struct Figures {
    /// How far apart the stated integral and the reference are ([`apart`]), and the limit; none if there is none.
    pub integral: Option<[f64; 2]>,
    /// The largest weight of a sample over the reference.
    pub largest: f64,
    /// The mean of samples over the reference, less 1.
    pub mean: f64,
    /// The share of samples that bring nothing.
    pub empty: f64,
    /// The same means for calls with one ray and with four, and the larger share of rays that bring nothing.
    pub rays: Option<[f64; 3]>,
}

/// Limits of a row, besides those that hold for all.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// How far apart the stored integral and the reference may be.
    pub integral: f64,
    /// The largest share of samples that bring nothing.
    pub empty: f64,
    /// The largest share of rays that do.
    pub idle: f64,
    /// The largest weight.
    pub weights: f64,
    /// The largest fault of a mean that may be missed.
    pub missed: f64,
}

/// The larger of two integrals over the smaller, less 1: an estimate of 0 is beyond any limit.
fn apart(stored: f64, reference: f64) -> f64 {
    (stored / reference).max(reference / stored) - 1.0
}

pub fn wide(wi: [f32; 3]) -> V3 {
    wi.map(f64::from)
}

/// The product at a point, legal and against the reference: [`density`].
pub fn product(
    environment: &Environment,
    point: &raw::wis_point,
    task: &Task,
    limits: &Limits,
) -> Result<Figures, String> {
    let (own, mut memory) = (Rc::new(RefCell::new(Sampler::new(1, 0, 0)?)), Block::new(0));
    let product = Light::product(environment, &own, point, &mut memory)?;
    laws::legal_with_lobes(&product)?;
    let stored = product.describe()?.integral / environment.info.mean;
    density(&product, &Light::new(environment)?, stored, task, limits)
}

/// A density against the reference: the integral that it states, in the task's unit, the mean and the largest of its weights, and
/// how often samples go where. `light` tells where else to look for large weights.
fn density(
    product: &impl Density,
    light: &impl Density,
    stored: f64,
    task: &Task,
    limits: &Limits,
) -> Result<Figures, String> {
    let Task { value, fault, .. } = *task;
    let mut figures = Figures::default();
    let stored = if fault == Fault::Integral { value * (1.0 + 2.0 * limits.integral) } else { stored };
    let off = apart(stored, value);
    figures.integral = Some([off, limits.integral]);
    ensure(off <= limits.integral, || format!("the stated integral is {stored:.5}, the reference {value:.5}"))?;
    let factor = if fault == Fault::Density { 1.025 } else { 1.0 };
    let (mut wi, mut weights, mut means) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..SAMPLES[1] / SAMPLES[0] {
        let u = crate::points::of(seed as u32 + 7, SAMPLES[0]);
        let mut drawn = vec![raw::wis_drawn::default(); u.len()];
        product.sample_n(&u, &mut drawn)?;
        let weight = |drawn: &raw::wis_drawn| (task.brings)(wide(drawn.wi)) / (factor * f64::from(drawn.pdf) * value);
        weights.extend(drawn.iter().map(weight));
        wi.extend(drawn.iter().map(|drawn| drawn.wi));
        // Means of blocks, each of them well spread: they vary less than as many samples would by themselves.
        means = weights.chunks(256).map(|block: &[f64]| block.iter().sum::<f64>() / block.len() as f64).collect();
        if finds(mean_and_error(&means).1, MISSED) {
            break;
        }
    }
    figures.mean = judge("samples", &means, limits)?;
    figures.empty = weights.iter().filter(|weight| **weight == 0.0).count() as f64 / weights.len() as f64;
    ensure(figures.empty <= limits.empty, || format!("{:.3} of the samples bring nothing", figures.empty))?;
    figures.largest = weights.iter().copied().fold(0.0, f64::max).max(look(product, light, task)?);
    ensure(figures.largest <= limits.weights, || format!("a weight of {:.1} integrals", figures.largest))?;
    if fault == Fault::Frequency {
        wi.iter_mut().step_by(20).for_each(|wi| *wi = single(task.peaks[0].at));
    }
    frequencies(product, &task.peaks, &wi)?;
    Ok(figures)
}

/// Looks for large weights where the light is, at every distance of the peaks, and all over the sphere.
fn look(product: &impl Density, light: &impl Density, task: &Task) -> Result<f64, String> {
    let u = crate::points::of(11, LOOKS);
    let mut all: Vec<[f32; 3]> = Vec::with_capacity(3 * LOOKS);
    for (k, u) in u.iter().enumerate() {
        let sphere = sphere([1.0 - f64::from(u[0]), f64::from(u[1])]);
        let (scale, peak) = (10f64.powi(-((k % 5) as i32)), task.peaks[k % task.peaks.len()].at);
        all.push(light.sample(*u)?.wi);
        all.push(single(sphere));
        all.push(single(unit([0, 1, 2].map(|k| peak[k] + scale * sphere[k]))));
    }
    let (mut pdf, mut largest) = (vec![0.0; all.len()], 0.0f64);
    product.pdf_n(&all, &mut pdf)?;
    for (wi, pdf) in all.iter().zip(pdf) {
        let brings = (task.brings)(wide(*wi));
        ensure(brings == 0.0 || pdf > 0.0, || format!("pdf({wi:?}) = {pdf} where {brings} comes from"))?;
        let hole = task.fault == Fault::Hole && brings > 0.5 * f64::from(pdf) * task.value;
        let pdf = f64::from(pdf) * if hole { 0.01 } else { 1.0 };
        if brings > 0.0 {
            largest = largest.max(brings / (pdf * task.value));
        }
    }
    Ok(largest)
}

/// Directions of samples against the density that the library states, in parts of the sphere of about equal probability.
fn frequencies(product: &impl Density, peaks: &[Peak], wi: &[[f32; 3]]) -> Result<(), String> {
    let density = |wi: &[V3; 9]| {
        let mut pdf = [0.0; 9];
        let answered = product.pdf_n(&wi.map(single), &mut pdf);
        answered.map_or([f64::NAN; 9], |()| pdf.map(f64::from))
    };
    let mass = Integral::relative(&density, peaks, 1e-2);
    ensure((mass.value - 1.0).abs() < MASS, || format!("the density integrates to {:.5}", mass.value))?;
    let bins = mass.bins(SHARE);
    let p = chi_square(&bins.counts(wi.iter().map(|wi| wide(*wi))), &bins.of);
    ensure(p > SIGNIFICANCE, || format!("frequencies in {} parts of the sphere: p = {p:.1e}", bins.of.len()))
}

/// Whether a fault would be seen beside such a standard error.
fn finds(error: f64, fault: f64) -> bool {
    REACH * error + QUADRATURE <= fault
}

/// The mean of values that should be 1, less 1; an error if it is too far off, or if too small a fault would not be seen.
fn judge(what: &str, values: &[f64], limits: &Limits) -> Result<f64, String> {
    let (mean, error) = mean_and_error(values);
    ensure((mean - 1.0).abs() <= ERRORS * error + QUADRATURE, || {
        format!("{what}: the mean is {mean:.5} of the reference, its standard error {error:.5}")
    })?;
    ensure(finds(error, limits.missed), || format!("{what}: finds only faults of {:.3}", REACH * error))?;
    Ok((mean - 1.0).abs())
}

/// Calls of wis_direct with one ray and with four against the reference; a target of the client's own, or none.
pub fn rays(
    environment: &Environment,
    point: &raw::wis_point,
    target: Option<Brdf>,
    task: &Task,
    limits: &Limits,
) -> Result<[f64; 3], String> {
    let mut target = target;
    let (mut figures, mut most) = ([0.0; 3], 0.0f64);
    for (slot, rays) in [1, 4].into_iter().enumerate() {
        let mut sampler = Sampler::new(rays, 0, 0)?;
        let mut ray = vec![raw::wis_ray::default(); rays];
        let (mut means, mut idle, mut traced) = (Vec::new(), 0usize, 0usize);
        let factor = if task.fault == Fault::Weight { 1.025 } else { 1.0 };
        loop {
            for seed in means.len()..(2 * means.len()).max(PIXELS[0]) {
                sampler.begin_pixel()?;
                let mut sum = 0.0;
                for sample in 0..HITS {
                    let point = raw::wis_point { seed: seed as u32 + 1, sample, ..*point };
                    let target: Option<Brdf> = if let Some(target) = &mut target { Some(*target) } else { None };
                    let count = sampler.direct(environment, &point, target, &mut ray)?;
                    for ray in &ray[..count] {
                        let sign = if task.fault == Fault::Idle && sample % 10 == 0 { -1.0 } else { 1.0 };
                        let brings = (task.brings)(wide(ray.wi).map(|x| sign * x));
                        idle += usize::from(brings == 0.0);
                        sum += f64::from(ray.weight) * factor * brings;
                    }
                    traced += count;
                }
                means.push(sum / f64::from(HITS) / task.value);
            }
            if finds(mean_and_error(&means).1, limits.missed) || means.len() >= PIXELS[1] {
                break;
            }
        }
        most = most.max(idle as f64 / traced as f64);
        ensure(most <= limits.idle, || format!("{most:.3} of the rays bring nothing"))?;
        figures[slot] = judge(if rays == 1 { "one ray" } else { "four rays" }, &means, limits)?;
    }
    figures[2] = most;
    Ok(figures)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_estimate_of_nothing_is_beyond_any_limit() {
        assert!((apart(3.0, 2.0) - 0.5).abs() < 1e-12 && (apart(2.0, 3.0) - 0.5).abs() < 1e-12);
        assert_eq!(apart(0.0, 1.0), f64::INFINITY);
    }
}
