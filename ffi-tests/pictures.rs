//! Pictures of a renderer that is a client, and how far they scatter: for clients that are no part of the workspace.

use anyhow::{Context, Result, anyhow};
use std::fmt::Write;
use std::ops::Range;
use wis::{Block, Config, Environment, Level, Map, Sampler};

pub const WIDTH: u32 = 96;
pub const HEIGHT: u32 = 54;
/// Of a pixel.
pub const SAMPLES: u32 = 16;

/// Luminance pixel by pixel, and the least seconds of the processor that a picture took.
pub struct Pictures {
    pub of: Vec<Vec<f64>>,
    pub seconds: f64,
}

impl Pictures {
    /// A picture for each seed.
    pub fn take(seeds: Range<u64>, mut one: impl FnMut(u64) -> Result<Vec<f64>>) -> Result<Pictures> {
        let mut pictures = Pictures { of: Vec::new(), seconds: f64::INFINITY };
        for seed in seeds {
            let start = processor_seconds()?;
            pictures.of.push(one(seed)?);
            pictures.seconds = pictures.seconds.min(processor_seconds()? - start);
        }
        Ok(pictures)
    }

    /// The mean over a region, and its standard error.
    pub fn mean(&self, region: &[usize]) -> (f64, f64) {
        let means = self.of.iter().map(|picture| region.iter().map(|&i| picture[i]).sum::<f64>() / region.len() as f64);
        let (mean, variance) = moments(&means.collect::<Vec<f64>>());
        (mean, (variance / self.of.len() as f64).sqrt())
    }

    /// The relative and the absolute variance of a pixel, as means over a region. Relative: over the square of the mean + 1 %.
    pub fn variance(&self, region: &[usize], truth: &[f64]) -> [f64; 2] {
        let least = 0.01 * truth.iter().sum::<f64>() / truth.len() as f64;
        let mut sums = [0.0; 2];
        for &i in region {
            let (_, variance) = moments(&self.of.iter().map(|picture| picture[i]).collect::<Vec<f64>>());
            sums[0] += variance / (truth[i] + least).powi(2) / region.len() as f64;
            sums[1] += variance / region.len() as f64;
        }
        sums
    }
}

/// The mean and the variance of numbers.
fn moments(of: &[f64]) -> (f64, f64) {
    let mean = of.iter().sum::<f64>() / of.len() as f64;
    (mean, of.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (of.len() - 1) as f64)
}

/// Of this thread, so that other programs change nothing.
fn processor_seconds() -> Result<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat")?;
    Ok(1e-9 * text.split(' ').next().context("schedstat is empty")?.parse::<f64>()?)
}

/// The object of each pixel whose corners all see it; `seen` answers that of a place of a pixel, 0 to 1.
pub fn regions(mut seen: impl FnMut(u32, u32, [f32; 2]) -> Option<usize>) -> Vec<Option<usize>> {
    let mut of_pixel = |pixel: u32| {
        let places = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        let corners = places.map(|place| seen(pixel % WIDTH, pixel / WIDTH, place));
        corners[0].filter(|_| corners.iter().all(|corner| *corner == corners[0]))
    };
    (0..WIDTH * HEIGHT).map(&mut of_pixel).collect()
}

/// Builds a light from a map, and hands it over together with a sampler for so many rays.
pub fn with_light<T>(
    map: &Map<'_>,
    rays: usize,
    then: impl FnOnce(&Environment<'_>, &mut Sampler<'_>) -> Result<T>,
) -> Result<T> {
    let (size, config) = (map.size()?, Config::for_rays(rays as u32));
    let [mut memory, mut scratch, mut working] =
        [size.bytes, size.scratch, config.bytes()].map(|bytes| vec![Block::ZERO; Block::count(bytes)]);
    let environment = map.build_in(&mut memory, &mut scratch).map_err(|error| anyhow!("{error:?}"))?;
    let sampler = Sampler::new(Level::detect(), config, Block::bytes_mut(&mut working));
    then(&environment, &mut sampler.context("too little memory")?)
}

/// A row of each object, and the largest z of a mean: gains of wis over a method, and its mean beside that of the reference.
pub fn rows(
    names: &[String],
    (regions, truth): (&[Option<usize>], &[f64]),
    [wis, method, reference]: [&Pictures; 3],
    digits: usize,
) -> Result<(String, f64)> {
    let (mut text, mut worst, faster) = (String::new(), 0.0f64, method.seconds / wis.seconds);
    for (number, name) in names.iter().enumerate() {
        let region: Vec<usize> = (0..regions.len()).filter(|&i| regions[i] == Some(number)).collect();
        let ((a, da), (b, db)) = (wis.mean(&region), reference.mean(&region));
        let (error, z) = (da.hypot(db), (a - b) / da.hypot(db));
        worst = worst.max(z.abs());
        let [of_method, of_wis] = [method, wis].map(|pictures| pictures.variance(&region, truth));
        let [relative, absolute] = [0, 1].map(|k| of_method[k] / of_wis[k]);
        writeln!(
            text,
            "| {name} | {relative:.digits$}x | {absolute:.digits$}x | {:.1}x | {:.1}x | {:+.2} % +- {:.2} % | {z:+.1} |",
            relative * faster,
            absolute * faster,
            100.0 * (a - b) / b,
            100.0 * error / b
        )?;
    }
    Ok((text, worst))
}

pub fn verdict(holds: bool) -> &'static str {
    if holds { "holds" } else { "**does not hold**" }
}
