//! Measures what a visibility cache brings in a renderer that works in passes of one ray at a hit: passes <page> [--quick]

mod cache;
mod page;

use anyhow::{Context, Result, ensure};
use cache::Cache;
use glam::Vec3;
use rustix::time::{ClockId, clock_gettime};
use std::path::Path;
use wis_ffi_tests::client::{pixel_seed, raw};
use wis_ffi_tests::cost::MODELS;
use wis_ffi_tests::environment::{Sampler, material};
use wis_ffi_tests::estimator::{Lit, Setting};
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::{Bsdf, Material};
use wis_ffi_tests::mesh::Mesh;
use wis_ffi_tests::reference::Reference;
use wis_ffi_tests::scene::{Scene, ShadingPoint, View};
use wis_ffi_tests::{data, statistics};

/// Passes of one ray; errors and times are those of all but the first, in which the cache knows nothing.
pub const PASSES: u32 = 16;
/// Independent repeats.
const REPEATS: u32 = 2;
/// Of the columns and rows that are rendered, every so many have a reference.
const KNOWN: u32 = 2;
/// Groups of points by the visible part v of their light.
pub const REGIONS: [&str; 3] = ["lit", "penumbra", "umbra"];
/// Fewer points are no group.
pub const FEW: usize = 30;
const MAPS: [&str; 2] = ["rooitou_park_1k.hdr", "adams_place_bridge_1k.hdr"];
/// No image is brighter or darker than its reference by more than this part, with or without a cache.
const BIAS: f64 = 0.2;
/// Where references are kept.
const REFERENCES: &str = "build/passes";

/// A scene, a light and a material.
pub struct Cell {
    pub name: [String; 3],
    /// Points that are rendered in a pass, and whether those are all.
    pub rendered: usize,
    pub all: bool,
    /// Points in each region.
    pub points: [usize; REGIONS.len()],
    /// Mean squared relative error of the image by region, without and with a cache.
    pub errors: [[f64; REGIONS.len()]; 2],
    /// Nanoseconds of processor time for a point and a pass in each cost model, without and with a cache.
    pub times: [[f64; MODELS.len()]; 2],
}

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let page = arguments.next().context("usage: passes <page> [--quick]")?;
    let quick = arguments.next().is_some_and(|argument| argument == "--quick");
    let step = step(quick);
    let mut cells = Vec::new();
    let [rendered, judged] = [step, KNOWN * step].map(|step| scenes(View::Image(step), quick));
    for scene in rendered?.iter().zip(&judged?) {
        for light in lights(quick)? {
            let environment = light.environment()?;
            let lit = Lit::new(&light, &environment)?;
            for material in [Material::lambert(), Material::ggx(0.2), Material::mix(0.1)] {
                // The cache learns from all that is rendered: once with those points alone that have a reference.
                for rendered in [scene.0, scene.1] {
                    cells.push(cell((rendered, scene.1), &Setting::new(&lit, &material), quick)?);
                }
                eprintln!("{}", cells[cells.len() - 1].name.join(", "));
            }
        }
    }
    let written = page::write(&cells)?;
    print!("{written}");
    Ok(std::fs::write(page, written)?)
}

/// Every so many columns and rows of the view are rendered.
fn step(quick: bool) -> u32 {
    if quick { 12 } else { 2 }
}

fn scenes(view: View, quick: bool) -> Result<Vec<Scene>> {
    let spot = Path::new(data::FOLDER).join("meshes/spot.obj");
    if quick || !spot.exists() {
        return Ok(vec![Scene::procedural(view)?]);
    }
    Ok(vec![Scene::from_file(&spot, view)?, Scene::room(Mesh::load(&spot)?, view)?])
}

fn lights(quick: bool) -> Result<Vec<Light>> {
    let width = if quick { 128 } else { 1024 };
    let mut lights = vec![Light::unclipped("unclipped sun", width, 2, [width / 10, width / 7]).bilinear()];
    for map in MAPS.map(|name| Path::new(data::FOLDER).join("envmaps").join(name)) {
        if map.exists() && !quick {
            lights.push(Light::load(&map)?.bilinear());
        }
    }
    Ok(lights)
}

fn cell((scene, judged): (&Scene, &Scene), setting: &Setting, quick: bool) -> Result<Cell> {
    let step = step(quick);
    let name = [scene.name.clone(), setting.light.name.clone(), setting.material.name.clone()];
    let file =
        Path::new(REFERENCES).join(format!("{}-{:x}.json", name.join("-").replace(' ', "_"), judged.fingerprint()));
    let reference = Reference::cached(&file, judged, setting, if quick { 512 } else { 4096 })?.values();
    let region = |[shadowed, unshadowed]: &[f64; 2]| match shadowed / unshadowed {
        v if v > 0.95 => 0,
        v if v >= 0.05 => 1,
        _ => 2,
    };
    let regions: Vec<usize> = reference.iter().map(region).collect();
    let points = [0, 1, 2].map(|r| regions.iter().filter(|&&region| region == r).count());
    let mean = reference.iter().map(|v| v[0]).sum::<f64>() / reference.len() as f64;
    let (mut errors, mut times) = ([[0.0; REGIONS.len()]; 2], [[0.0; MODELS.len()]; 2]);
    for (with, (errors, times)) in errors.iter_mut().zip(&mut times).enumerate() {
        let mut taken = vec![Vec::new(); MODELS.len()];
        let mut sum = 0.0;
        for repeat in 0..REPEATS {
            for (model, taken) in taken.iter_mut().enumerate() {
                let (estimates, time) = passes(scene, &setting.at(MODELS[model].1), with == 1, repeat)?;
                taken.push(time);
                if model > 0 {
                    continue;
                }
                let is_known = |place: &ShadingPoint| place.pixel.iter().all(|c| c % (KNOWN * step) == 0);
                let known = scene.points.iter().zip(&estimates).filter(|(place, _)| is_known(place));
                for (((_, estimate), truth), &region) in known.zip(&reference).zip(&regions) {
                    sum += estimate;
                    let square = (estimate - truth[0]).powi(2) / (truth[0].powi(2) + (0.01 * mean).powi(2));
                    errors[region] += square / f64::from(REPEATS) / points[region] as f64;
                }
            }
        }
        let brightness = sum / (f64::from(REPEATS) * reference.len() as f64 * mean);
        ensure!((brightness - 1.0).abs() < BIAS, "{}: {brightness} of the reference", name.join(", "));
        *times = [0, 1].map(|model| statistics::median(&taken[model]));
    }
    let (rendered, all) = (scene.points.len(), scene.points.len() > judged.points.len());
    Ok(Cell { name, rendered, all, points, errors, times })
}

/// The image of all passes but the first, and the nanoseconds for a point and a pass.
fn passes(scene: &Scene, setting: &Setting, with: bool, repeat: u32) -> Result<(Vec<f64>, f64)> {
    let made = material(&setting.material.lobes())?;
    let (mut sampler, mut cache) = (Sampler::new(1, 0, 0)?, Cache::new()?);
    let mut image = vec![0.0; scene.points.len()];
    let mut begin = 0.0;
    for pass in 0..PASSES {
        if pass == 1 {
            begin = processor_time();
        }
        for (place, pixel) in scene.points.iter().zip(&mut image) {
            let bsdf = Bsdf::new(setting.material, place);
            let mut point = setting.material.point(place, &made);
            (point.seed, point.sample) = (pixel_seed(place.pixel, repeat), pass);
            if with {
                cache.lend(place, &mut point)?;
            }
            let mut rays = [raw::wis_ray::default()];
            let count = sampler.direct(setting.tables, &point, &mut rays)?;
            for ray in &rays[..count] {
                let wi = Vec3::from(ray.wi);
                setting.cost.evaluate(1);
                let reflected = bsdf.eval_one(wi).0 * setting.light.radiance(wi) * ray.weight;
                let reached = scene.visible_at(setting.cost, place, wi);
                if with {
                    cache.record(&point, &ray.wi, reached)?;
                }
                if reached && pass > 0 {
                    *pixel += f64::from(reflected) / f64::from(PASSES - 1);
                }
            }
        }
        if with {
            cache.end_pass()?;
        }
    }
    let points = (scene.points.len() * (PASSES as usize - 1)) as f64;
    Ok((image, (processor_time() - begin) / points))
}

/// Nanoseconds that this thread has worked.
fn processor_time() -> f64 {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    now.tv_sec as f64 * 1e9 + now.tv_nsec as f64
}
