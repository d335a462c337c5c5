//! Several environments: a call for each, against one call for a map of their sum. Candidates of one call for several environments would
//! have the density of that sum, and a look-up for each environment besides: the sum bounds what such a call can save.

use anyhow::Result;
use std::path::Path;
use wis_ffi_tests::caches::RENDERER;
use wis_ffi_tests::cost::{Cost, MODELS};
use wis_ffi_tests::data;
use wis_ffi_tests::estimator::Estimator;
use wis_ffi_tests::library::Mode;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::measure::Truth;
use wis_ffi_tests::method::Method;
use wis_ffi_tests::reference::Reference;
use wis_ffi_tests::scene::{Scene, View};
use wis_ffi_tests::setting::{Lit, Setting, shadowed_and_not};
use wis_ffi_tests::timing::time;

/// Where references are kept.
pub const REFERENCES: &str = "build/rooms";

/// A set of environments, a material and a number of rays for all of them.
pub struct Several {
    pub name: String,
    pub rays: usize,
    /// Of a call each, and of one call for the sum: the mean squared error in both metrics, and nanoseconds in each of `MODELS`.
    pub errors: [[f64; 2]; 2],
    pub times: [[f64; MODELS.len()]; 2],
}

const REPEATS: u32 = 8;

/// A light of a mean of its own.
fn scaled(light: &Light, mean: f64) -> Vec<f32> {
    let factor = (mean / light.mean()) as f32;
    light.luminance().iter().map(|l| l * factor).collect()
}

pub fn measured(lights: &[Light], points: usize, quick: bool) -> Result<Vec<Several>> {
    let scene = data::scene("spot.obj", View::Points(points))?;
    let [width, height] = lights[0].size();
    let width_of = |light: &Light| light.size() == [width, height];
    let sun = Light::unclipped("sun", width, 2, [width / 10, height / 3]);
    let maps: Vec<&Light> = lights.iter().chain([&sun]).filter(|light| width_of(light)).collect();
    let sets: [(&str, &[f64]); 3] =
        [("two alike", &[1.0, 1.0]), ("two, one ten times as bright", &[1.0, 0.1]), ("four alike", &[1.0; 4])];
    let mut all = Vec::new();
    for (name, means) in sets.into_iter().filter(|(_, means)| means.len() <= maps.len()) {
        let texels: Vec<Vec<f32>> = means.iter().zip(&maps).map(|(&mean, map)| scaled(map, mean)).collect();
        let sum = (0..width * height).map(|i| texels.iter().map(|texels| texels[i]).sum()).collect();
        let light = |name: &str, texels| Light::latlong(name, width, height, texels).bilinear();
        let (sum, each): (_, Vec<Light>) =
            (light(name, sum), texels.into_iter().map(|texels| light("one of them", texels)).collect());
        let sum = Lit::new(&sum)?;
        let each = each.iter().map(Lit::new).collect::<Result<Vec<_>, _>>()?;
        for material in [Material::lambert(), Material::mix(0.1)] {
            let whole = Setting::new(&sum, &material);
            let parts: Vec<Setting> = each.iter().map(|lit| Setting::new(lit, &material)).collect();
            let file = format!("several-{name}-{}-{:x}.json", material.name, scene.fingerprint()).replace(' ', "_");
            let most = if quick { 512 } else { 4096 };
            let truth = Truth::new(&Reference::cached(&Path::new(REFERENCES).join(file), &scene, &whole, most)?, 1);
            for rays in [means.len(), 4 * means.len()] {
                let ways = [of(&scene, &parts, &truth, rays / parts.len())?, of(&scene, &[whole], &truth, rays)?];
                let name = format!("{name}, {}", material.name);
                all.push(Several { name, rays, errors: ways.map(|way| way.0), times: ways.map(|way| way.1) });
            }
        }
    }
    Ok(all)
}

/// Errors and times of a call for each of some lights.
fn of(scene: &Scene, lights: &[Setting], truth: &Truth, rays: usize) -> Result<([f64; 2], [f64; MODELS.len()])> {
    let method = Method::Library(Mode::Direct);
    let (mut errors, mut times) = ([0.0; 2], [0.0; MODELS.len()]);
    for pass in 0..REPEATS {
        let mut estimates = vec![[0.0; 2]; scene.points.len()];
        for (number, setting) in (0..).zip(lights) {
            let mut estimator = Estimator::new(setting, 1)?;
            for (point, sum) in scene.points.iter().zip(&mut estimates) {
                // Calls of one hit have seeds of their own: with one for all, their errors would add up.
                let picks = estimator.picks(method, setting, point, pass + number * REPEATS, rays)?;
                let more = shadowed_and_not(scene, Cost::CHEAP, point, picks);
                *sum = [sum[0] + more[0], sum[1] + more[1]];
            }
        }
        let found = truth.errors(&estimates, 0);
        errors = [errors[0] + found.absolute, errors[1] + found.relative];
    }
    for setting in lights {
        let took = time(scene, setting, method, rays, 48, 1)?[RENDERER];
        times.iter_mut().zip(took).for_each(|(sum, took)| *sum += took.ns());
    }
    Ok((errors.map(|sum| sum / f64::from(REPEATS)), times))
}
