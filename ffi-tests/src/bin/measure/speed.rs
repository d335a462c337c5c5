//! What samples and pdfs take, one by one and in batches of 64, from cold and from warm caches.

use anyhow::Result;
use std::hint::black_box;
use std::time::Instant;
use wis_ffi_tests::caches::Cold;
use wis_ffi_tests::client::{self, Density, raw};
use wis_ffi_tests::directions::sphere;
use wis_ffi_tests::statistics::median;
use wis_ffi_tests::timing::clock;

/// Samples of a batch.
pub const BATCH: usize = 64;
/// Batches that warm caches are measured over, again and again.
const WARM: usize = 16;

/// The calls that are timed.
pub const CALLS: [&str; 4] = ["sample in 64", "pdf in 64", "sample alone", "pdf alone"];

/// Nanoseconds for a sample or a pdf, in the order of `CALLS`.
#[derive(Clone, Copy, Debug)]
pub struct Speed {
    /// Means over 64 of them after other memory was touched.
    pub cold: [f64; 4],
    pub warm: [f64; 4],
    /// Of the last two the first call after other memory was touched.
    pub first: [f64; 2],
}

/// What the calls are made with.
struct Inputs {
    u: Vec<[f32; 2]>,
    wi: Vec<[f32; 3]>,
    drawn: Vec<raw::wis_drawn>,
    pdf: Vec<f32>,
}

/// Medians over rounds, in which the densities take turns; from warm caches the fastest round, which a busy machine disturbs least. Samples have random numbers of their own in each round, pdfs are those
/// of directions all over the sphere.
///
/// # Errors
/// Those of the library.
pub fn speed(densities: &[&dyn Density], rounds: usize) -> Result<Vec<Speed>> {
    let count = (rounds.max(WARM) + 1) * BATCH;
    let u = wis_ffi_tests::points::of(11, count);
    // Neighbours in the sequence are far apart; in a renderer so are neighbours of a batch.
    let wi = u.iter().map(|u| sphere(u.map(f64::from)).map(|c| c as f32)).collect();
    let mut inputs = Inputs { u, wi, drawn: vec![Default::default(); BATCH], pdf: vec![0.0; BATCH] };
    let clock = clock();
    let (mut cold, mut memory) = (vec![[const { Vec::new() }; 4]; densities.len()], Cold::default());
    let mut first = vec![[const { Vec::new() }; 2]; densities.len()];
    for round in 0..rounds {
        for turn in 0..densities.len() {
            let number = (round + turn) % densities.len();
            for (call, times) in cold[number].iter_mut().enumerate() {
                memory.touch();
                let [one, all] = inputs.call(densities[number], call, round)?;
                times.push((all - clock) / BATCH as f64);
                if call >= 2 {
                    first[number][call - 2].push((one - clock).max(0.0));
                }
            }
        }
    }
    let mut warm = vec![[const { Vec::new() }; 4]; densities.len()];
    for round in 0..rounds {
        for turn in 0..densities.len() {
            let number = (round + turn) % densities.len();
            for (call, times) in warm[number].iter_mut().enumerate() {
                // Of each turn the first walk over the inputs is to warm up.
                inputs.walk(densities[number], call)?;
                times.push(inputs.walk(densities[number], call)? / (WARM as f64 * BATCH as f64));
            }
        }
    }
    let speeds = cold.iter().zip(&warm).zip(&first).map(|((cold, warm), first)| Speed {
        cold: std::array::from_fn(|i| median(&cold[i])),
        warm: std::array::from_fn(|i| warm[i].iter().copied().fold(f64::INFINITY, f64::min)),
        first: std::array::from_fn(|i| median(&first[i])),
    });
    Ok(speeds.collect())
}

impl Inputs {
    /// Nanoseconds of the first call, and of all, for the batch of a round.
    fn call(&mut self, density: &dyn Density, call: usize, round: usize) -> client::Result<[f64; 2]> {
        let batch = round * BATCH..(round + 1) * BATCH;
        let (u, wi) = (&self.u[batch.clone()], &self.wi[batch]);
        let start = Instant::now();
        let mut first = None;
        match call {
            0 => density.sample_n(u, &mut self.drawn)?,
            1 => density.pdf_n(wi, &mut self.pdf)?,
            2 => {
                for u in u {
                    black_box(density.sample(*u)?);
                    first.get_or_insert_with(Instant::now);
                }
            }
            _ => {
                for wi in wi {
                    black_box(density.pdf(*wi)?);
                    first.get_or_insert_with(Instant::now);
                }
            }
        }
        let end = Instant::now();
        black_box((&self.drawn, &self.pdf));
        Ok([first.unwrap_or(end), end].map(|at| at.duration_since(start).as_secs_f64() * 1e9))
    }

    /// Nanoseconds of a walk over many inputs, in batches or one by one.
    fn walk(&mut self, density: &dyn Density, call: usize) -> client::Result<f64> {
        let (u, wi) = (&self.u[..WARM * BATCH], &self.wi[..WARM * BATCH]);
        let start = Instant::now();
        match call {
            0 => u.chunks(BATCH).try_for_each(|u| density.sample_n(u, &mut self.drawn))?,
            1 => wi.chunks(BATCH).try_for_each(|wi| density.pdf_n(wi, &mut self.pdf))?,
            2 => u.iter().try_for_each(|u| density.sample(*u).map(|drawn| _ = black_box(drawn)))?,
            _ => wi.iter().try_for_each(|wi| density.pdf(*wi).map(|pdf| _ = black_box(pdf)))?,
        }
        let ns = start.elapsed().as_secs_f64() * 1e9;
        black_box((&self.drawn, &self.pdf));
        Ok(ns)
    }
}
