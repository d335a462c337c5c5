//! What a method takes for a pixel in each cost model, with a renderer's caches, with warm and with cold ones.

use crate::caches::{CACHES, COLD, Others, RENDERER, WARM};
use crate::client;
use crate::cost::{Cost, MODELS};
use crate::estimator::Estimator;
use crate::method::Method;
use crate::scene::Scene;
use crate::setting::{Setting, shadowed_and_not};
use crate::statistics::median;
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::hint::black_box;
use std::time::Instant;

/// Nanoseconds for a shading point.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Time {
    /// Drawing, evaluating and choosing, with what has to be prepared.
    pub sampling: f64,
    pub rays: f64,
}

impl Time {
    pub fn ns(&self) -> f64 {
        self.sampling + self.rays
    }
}

/// In each of `MODELS`.
pub type Times = [Time; MODELS.len()];

/// A pixel that took so many times the median was interrupted by another program.
const INTERRUPTED: f64 = 4.0;
/// The pass whose random numbers are timed.
const PASS: u32 = 0;

thread_local! {
    /// Made once, since both take long to make.
    static OTHERS: RefCell<Others> = RefCell::default();
}

/// The mean over some pixels of a scene, evenly spread, with the first so many of `CACHES`.
///
/// # Errors
/// Those of the library.
pub fn time(
    scene: &Scene,
    setting: &Setting,
    method: Method,
    count: usize,
    pixels: usize,
    kept: usize,
) -> client::Result<[Times; CACHES.len()]> {
    let all = scene.points.len() / scene.hits;
    let pixels: Vec<usize> = (0..pixels.min(all)).map(|i| i * all / pixels.min(all)).collect();
    let mut stopwatch = Stopwatch(Estimator::new(setting, scene.hits)?);
    let mut times = [const { [const { Vec::new() }; MODELS.len()] }; CACHES.len()];
    // The first pixel finds memory that was never written and calls that were never bound.
    stopwatch.pixel(scene, setting, MODELS[0].1, (method, count), 0, WARM)?;
    for (caches, times) in times.iter_mut().enumerate().take(kept) {
        for (number, &pixel) in pixels.iter().enumerate() {
            for ((_, cost), times) in MODELS.into_iter().zip(&mut *times) {
                let between = if caches == RENDERER { RENDERER } else { WARM };
                if caches == COLD {
                    OTHERS.with_borrow_mut(|others| others.run(COLD));
                } else {
                    // A pixel far from this one, so that code and scene are near but not the pixel itself.
                    let other = pixels[(number + pixels.len() / 2) % pixels.len()];
                    stopwatch.pixel(scene, setting, cost, (method, count), other, between)?;
                }
                times.push(stopwatch.pixel(scene, setting, cost, (method, count), pixel, between)?);
            }
        }
    }
    Ok(times.map(|times| times.map(|times| mean(&times, scene.hits))))
}

/// What a timed pixel needs.
struct Stopwatch(Estimator);

impl Stopwatch {
    /// Estimates each hit of a pixel and traces its rays, after what runs between hits.
    fn pixel(
        &mut self,
        scene: &Scene,
        setting: &Setting,
        cost: Cost,
        (method, count): (Method, usize),
        pixel: usize,
        between: usize,
    ) -> client::Result<Time> {
        let (setting, mut time) = (setting.at(cost), Time::default());
        for point in &scene.points[pixel * scene.hits..][..scene.hits] {
            OTHERS.with_borrow_mut(|others| others.run(between));
            let start = Instant::now();
            let picks = self.0.picks(method, &setting, point, PASS, count)?;
            let drawn = Instant::now();
            black_box(shadowed_and_not(scene, cost, point, picks));
            let traced = Instant::now();
            time.sampling += ns(start, drawn);
            time.rays += ns(drawn, traced);
        }
        Ok(time)
    }
}

/// Nanoseconds of single calls with each of `CACHES`, call by call, which take turns: each runs with another number, then what runs
/// between hits, then it is timed.
///
/// # Errors
/// Those of the calls.
pub fn singles<const N: usize>(
    rounds: usize,
    mut calls: [&mut dyn FnMut(usize) -> client::Result<()>; N],
) -> client::Result<[[Vec<f64>; CACHES.len()]; N]> {
    let mut times = [const { [const { Vec::new() }; CACHES.len()] }; N];
    for caches in 0..CACHES.len() {
        // A touch takes milliseconds.
        for round in 0..if caches == COLD { rounds } else { 8 * rounds } {
            // The first finds the inputs of a number farther away than the others do: each is first as often.
            for turn in 0..N {
                let place = (turn + round) % N;
                let (call, times) = (&mut calls[place], &mut times[place]);
                call(7 * round + 3)?;
                OTHERS.with_borrow_mut(|others| others.run(caches));
                let start = Instant::now();
                call(7 * round)?;
                times[caches].push(ns(start, Instant::now()));
            }
        }
    }
    Ok(times)
}

fn ns(from: Instant, to: Instant) -> f64 {
    (to.duration_since(from).as_secs_f64() * 1e9 - clock()).max(0.0)
}

/// The mean for a hit, without interrupted pixels.
fn mean(times: &[Time], hits: usize) -> Time {
    if times.is_empty() {
        return Time::default();
    }
    let typical = median(&times.iter().map(Time::ns).collect::<Vec<_>>());
    let kept: Vec<&Time> = times.iter().filter(|time| time.ns() <= INTERRUPTED * typical).collect();
    let mean = |of: fn(&Time) -> f64| kept.iter().map(|time| of(time)).sum::<f64>() / (kept.len() * hits) as f64;
    Time { sampling: mean(|time| time.sampling), rays: mean(|time| time.rays) }
}

/// What asking for the time takes, nanoseconds.
pub fn clock() -> f64 {
    static NS: std::sync::OnceLock<f64> = std::sync::OnceLock::new();
    *NS.get_or_init(|| {
        let ask = || {
            let start = Instant::now();
            Instant::now().duration_since(start).as_secs_f64() * 1e9
        };
        (0..1000).map(|_| ask()).fold(f64::INFINITY, f64::min)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Light;
    use crate::material::Material;
    use crate::peers::Peer;
    use crate::scene::View;
    use crate::setting::Lit;

    /// Both models differ by what evaluations and rays cost: so many that other programs do not hide it.
    #[test]
    fn models_differ_by_evaluations_and_rays() {
        let light = Light::windows(64);
        let lit = Lit::new(&light).unwrap();
        let (material, scene) = (Material::lambert(), Scene::procedural(View::Points(64)).unwrap());
        let setting = Setting::new(&lit, &material);
        let mut estimator = Estimator::new(&setting, 1).unwrap();
        for count in [64, 256] {
            let method = Method::Peer(Peer::Brdf);
            let mut traced = 0;
            for point in &scene.points {
                let picks = estimator.picks(method, &setting, point, PASS, count).unwrap();
                traced += picks.iter().filter(|pick| point.normal.dot(pick.wi) > 0.0).count();
            }
            let rays = traced as f64 / scene.points.len() as f64;
            let [_, [cheap, expensive], _] = time(&scene, &setting, method, count, 64, CACHES.len()).unwrap();
            let (sampling, tracing) = (expensive.sampling - cheap.sampling, expensive.rays - cheap.rays);
            println!("{count}: {cheap:?} {expensive:?}, {rays} rays");
            let asked = [150.0 * count as f64, 500.0 * rays];
            for (spent, asked) in [sampling, tracing].into_iter().zip(asked) {
                assert!((0.6..2.0).contains(&(spent / asked)), "N = {count}: {spent} ns in place of {asked}");
            }
        }
    }

    #[test]
    fn interrupted_pixels_do_not_count() {
        let time = |ns: f64| Time { sampling: ns, rays: 1.0 };
        let times: Vec<Time> = [100.0, 120.0, 80.0, 100.0, 1e6].map(time).into();
        assert_eq!(mean(&times, 2).sampling, 50.0);
    }
}
