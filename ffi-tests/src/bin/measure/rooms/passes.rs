//! Images in passes of one ray at a hit, with a visibility cache, with portals, and with both: in the open, and in a room with one window.

use super::renderer::Renderer;
use super::several::REFERENCES;
use anyhow::{Result, ensure};
use std::path::Path;
use wis_ffi_tests::cost::MODELS;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::measure::{Errors, FEW, REGIONS, Truth};
use wis_ffi_tests::reference::Reference;
use wis_ffi_tests::scene::{Scene, Stage, View, WINDOW};
use wis_ffi_tests::setting::{Lit, Setting};
use wis_ffi_tests::statistics::mean_and_error;
use wis_ffi_tests::{data, processor};

/// Whether there is a cache, and whether there are portals.
pub const WAYS: [(&str, [bool; 2]); 4] = [
    ("neither", [false, false]),
    ("a visibility cache", [true, false]),
    ("a portal", [false, true]),
    ("both", [true, true]),
];
/// Errors and times are those of all passes but the first, in which the cache knows nothing.
pub const PASSES: u32 = 16;
/// Where: the first has no portal.
pub const PLACES: [&str; 2] = ["in the open", "one window"];
/// Of the columns and rows that are rendered, every so many have a reference.
const KNOWN: u32 = 4;
/// No image is brighter or darker than its reference by more than this part, nor by more than so many standard errors.
const BIAS: f64 = 0.2;
const ERRORS: f64 = 4.5;

/// A scene, a light and a material.
pub struct Passes {
    /// One of `PLACES`.
    pub place: &'static str,
    /// Points in each of `REGIONS`.
    points: [usize; REGIONS.len()],
    /// Of each of `WAYS` that the scene has: the errors of the image in each region.
    pub errors: Vec<[Errors; REGIONS.len()]>,
    /// Nanoseconds for a point and a pass in each of `MODELS`.
    pub times: Vec<[f64; MODELS.len()]>,
}

impl Passes {
    /// How many times lower the relative variance is with a cache at equal time, in a region and a cost model; none for few points.
    pub fn gain(&self, region: usize, model: usize) -> Option<f64> {
        let cost = |way: usize| self.errors[way][region].relative * self.times[way][model];
        (self.points[region] >= FEW).then(|| cost(0) / cost(1))
    }
}

pub fn measured(lights: &[Light], quick: bool) -> Result<Vec<Passes>> {
    let (step, width, most) = if quick { (6, 128, 512) } else { (2, 1024, 2048) };
    let sun = Light::unclipped("unclipped sun", width, 2, [width / 10, width / 7]).bilinear();
    let stages = [Stage::outdoors(data::mesh("spot.obj")?), Stage::indoors(data::mesh("spot.obj")?, &[WINDOW])];
    let mut all = Vec::new();
    for ((place, stage), ways) in PLACES.into_iter().zip(&stages).zip([&WAYS[..2], &WAYS]) {
        let [scene, judged] = [step, KNOWN * step].map(|step| Scene::of(place, stage, View::Image(step)));
        let (scene, judged) = (scene?, judged?);
        for light in lights.iter().take(if quick { 0 } else { 2 }).chain([&sun]) {
            let lit = Lit::new(light)?;
            for material in [Material::lambert(), Material::ggx(0.2), Material::mix(0.1)] {
                let setting = Setting::new(&lit, &material);
                let name = format!("passes-{}-{}-{:x}.json", light.name, material.name, judged.fingerprint());
                let file = Path::new(REFERENCES).join(name.replace(' ', "_"));
                let reference = Reference::cached(&file, &judged, &setting, most)?;
                let (truth, exact) = (Truth::new(&reference, 1), reference.values());
                let points = [0, 1, 2, 3].map(|region| truth.members(region).count());
                let mut of = Passes { place, points, errors: Vec::new(), times: Vec::new() };
                for (_, with) in ways {
                    let (mut times, mut values) = ([0.0; MODELS.len()], Vec::<[f64; 2]>::new());
                    for (time, (_, cost)) in times.iter_mut().zip(MODELS) {
                        let (image, ns) = passes(&scene, &setting.at(cost), *with)?;
                        let places = scene.points.iter().zip(image);
                        let known = places.filter(|(place, _)| place.pixel.iter().all(|c| c % (KNOWN * step) == 0));
                        (*time, values) = (ns, known.map(|(_, value)| [value; 2]).collect());
                    }
                    let off: Vec<f64> = values.iter().zip(&exact).map(|(value, exact)| value[0] - exact[0]).collect();
                    let (mean, error) = mean_and_error(&off);
                    ensure!(
                        mean.abs() < BIAS * truth.mean() || mean.abs() < ERRORS * error,
                        "{}: the image is off by {mean} of {}",
                        file.display(),
                        truth.mean()
                    );
                    of.errors.push([0, 1, 2, 3].map(|region| truth.errors(&values, region)));
                    of.times.push(times);
                }
                eprintln!("{PASSES} passes, {place}, {}, {}", light.name, material.name);
                all.push(of);
            }
        }
    }
    Ok(all)
}

/// The image of all passes but the first, and the nanoseconds for a point and a pass, with or without a cache and portals.
fn passes(scene: &Scene, setting: &Setting, with: [bool; 2]) -> Result<(Vec<f64>, f64)> {
    let (mut renderer, mut image, mut begin) = (Renderer::new(setting, with, 1)?, vec![0.0; scene.points.len()], 0.0);
    for pass in 0..PASSES {
        if pass == 1 {
            begin = 1e9 * processor::seconds();
        }
        for (place, pixel) in scene.points.iter().zip(&mut image) {
            let reflected = renderer.call(scene, setting, place, (0, pass))?;
            *pixel += if pass > 0 { reflected / f64::from(PASSES - 1) } else { 0.0 };
        }
        renderer.end_pass()?;
    }
    let points = (scene.points.len() * (PASSES as usize - 1)) as f64;
    Ok((image, (1e9 * processor::seconds() - begin) / points))
}
