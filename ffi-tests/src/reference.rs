//! References: multiple importance sampling of light, BRDF, the uniform sphere and portals, in two independent halves, kept in
//! files. The product under test has no part in them.

use crate::batch::{Batch, Stream};
use crate::client;
use crate::cost::Cost;
use crate::lanes::{F8, V8, sin_cos_turn};
use crate::material::Bsdf;
use crate::portal::{Portals, Uniform};
use crate::scene::{Scene, ShadingPoint};
use crate::setting::Setting;
use anyhow::Result;
use serde::{Deserialize, Serialize};
use std::f32::consts::PI;
use std::ops::Range;
use std::path::Path;

/// Samples of each technique that are drawn at once.
const BLOCK: usize = 256;
/// The passes of the two halves, apart from those that are measured.
const PASSES: [u32; 2] = [1 << 24, 1 << 25];
/// The disagreement at which a reference is good enough.
pub const BOUND: f64 = 0.01;

/// Reflected light with and without shadows for each shading point.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Reference {
    halves: [Vec<[f64; 2]>; 2],
    /// Samples of each technique in each half.
    pub samples: usize,
}

impl Reference {
    /// Doubles the samples until the halves agree to `BOUND`, or there are `most`; read from `file` if it is there.
    ///
    /// # Errors
    /// Those of the library, and of writing the file.
    pub fn cached(file: &Path, scene: &Scene, setting: &Setting, most: usize) -> Result<Reference> {
        Reference::to(BOUND, file, scene, setting, most)
    }

    /// The same with another bound.
    ///
    /// # Errors
    /// Those of the library, and of writing the file.
    pub fn to(bound: f64, file: &Path, scene: &Scene, setting: &Setting, most: usize) -> Result<Reference> {
        if let Some(stored) = std::fs::read(file).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok()) {
            return Ok(stored);
        }
        let reference = Reference::converge(bound, scene, setting, most)?;
        if let Some(folder) = file.parent() {
            std::fs::create_dir_all(folder)?;
        }
        std::fs::write(file, serde_json::to_vec(&reference)?)?;
        Ok(reference)
    }

    /// The mean of the halves: shadowed and unshadowed.
    pub fn values(&self) -> Vec<[f64; 2]> {
        let pairs = self.halves[0].iter().zip(&self.halves[1]);
        pairs.map(|(a, b)| [(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0]).collect()
    }

    /// Half the difference of the halves, as the error of a mean: relative to the mean over all points (RMS).
    pub fn disagreement(&self) -> f64 {
        let values = self.values();
        let mean = values.iter().map(|v| v[0]).sum::<f64>() / values.len() as f64;
        let pairs = self.halves[0].iter().zip(&self.halves[1]);
        let squares: f64 = pairs.map(|(a, b)| ((a[0] - b[0]) / 2.0).powi(2)).sum();
        (squares / values.len() as f64).sqrt() / mean
    }

    fn converge(bound: f64, scene: &Scene, setting: &Setting, most: usize) -> Result<Reference> {
        let zeros = vec![[0.0; 2]; scene.points.len()];
        let mut sums = Reference { halves: [zeros.clone(), zeros], samples: 0 };
        loop {
            let target = (2 * sums.samples).max(BLOCK);
            let turns = (sums.samples / BLOCK) as u32..(target / BLOCK) as u32;
            // The halves are independent: each has a thread of its own.
            let [first, second] = &mut sums.halves;
            std::thread::scope(|threads| {
                let other = threads.spawn(|| add(scene, setting, PASSES[1], turns.clone(), second));
                add(scene, setting, PASSES[0], turns.clone(), first)?;
                other.join().expect("a thread that does not panic")
            })?;
            sums.samples = target;
            if target >= most || sums.scaled().disagreement() <= bound {
                return Ok(sums.scaled());
            }
        }
    }

    fn scaled(&self) -> Reference {
        let scale = |half: &Vec<[f64; 2]>| half.iter().map(|v| v.map(|x| x / self.samples as f64)).collect();
        Reference { halves: [scale(&self.halves[0]), scale(&self.halves[1])], samples: self.samples }
    }
}

/// Adds blocks to a half, at every point.
fn add(scene: &Scene, setting: &Setting, pass: u32, turns: Range<u32>, half: &mut [[f64; 2]]) -> client::Result<()> {
    let mut batch = Batch::default();
    for (point, sum) in scene.points.iter().zip(half) {
        let bsdf = Bsdf::new(setting.material, point);
        let portals = Uniform::of(&scene.portals, point.origin);
        for turn in turns.clone() {
            batch.begin(point.pixel, pass.wrapping_add(point.hit), turn);
            add_block(&mut batch, scene, setting, (point, &bsdf, &portals), sum)?;
        }
    }
    Ok(())
}

/// Adds a block of each technique, weighed by the balance heuristic.
fn add_block(
    batch: &mut Batch,
    scene: &Scene,
    setting: &Setting,
    (point, bsdf, portals): (&ShadingPoint, &Bsdf, &Portals<Uniform>),
    sum: &mut [f64; 2],
) -> client::Result<()> {
    if portals.are_there() {
        batch.from_density(portals, BLOCK)?;
    }
    batch.from_texels(setting.plain, setting.light, BLOCK);
    batch.from_bsdf(bsdf, BLOCK);
    batch.from_map(Stream::Uniform, BLOCK, uniform_sphere);
    batch.evaluate(bsdf, setting.light, setting.plain, Cost::CHEAP);
    let through = if portals.are_there() { batch.ask(portals)? } else { &[] }.to_vec();
    let through = |i: usize| F8::new(std::array::from_fn(|k| through.get(i + k).copied().unwrap_or(0.0)));
    batch.weigh(|i, pdf_light, pdf_bsdf| pdf_light + pdf_bsdf + F8::splat(0.25 / PI) + through(i));
    for i in (0..batch.len()).filter(|&i| batch.reflected(i) > 0.0) {
        let value = f64::from(batch.reflected(i));
        sum[0] += if scene.visible(point, batch.wi().get(i)) { value } else { 0.0 };
        sum[1] += value;
    }
    Ok(())
}

fn uniform_sphere(u: [F8; 2], _used: usize) -> V8 {
    let z = F8::ONE - u[0] - u[0];
    let radius = (F8::ONE - z * z).max(F8::ZERO).sqrt();
    let (sin, cos) = sin_cos_turn(u[1]);
    V8::new(radius * cos, radius * sin, z)
}
