//! What a visibility cache brings in a renderer that works in passes of one ray at a hit.

pub mod cache;
pub mod page;

use anyhow::{Result, ensure};
use cache::Cache;
use glam::Vec3;
use page::{Cell, PASSES, REGIONS};
use std::path::Path;
use wis_ffi_tests::client::{pixel_seed, raw};
use wis_ffi_tests::cost::MODELS;
use wis_ffi_tests::environment::{Sampler, material};
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::{Bsdf, Material};
use wis_ffi_tests::measure::Truth;
use wis_ffi_tests::mesh::Mesh;
use wis_ffi_tests::reference::Reference;
use wis_ffi_tests::scene::{Scene, ShadingPoint, View};
use wis_ffi_tests::setting::{Lit, Setting};
use wis_ffi_tests::{data, processor, statistics};

/// Independent repeats.
const REPEATS: u32 = 2;
/// Of the columns and rows that are rendered, every so many have a reference.
const KNOWN: u32 = 2;
const MAPS: [&str; 2] = ["rooitou_park_1k.hdr", "adams_place_bridge_1k.hdr"];
/// No image is brighter or darker than its reference by more than this part, with or without a cache.
const BIAS: f64 = 0.2;
/// Where references are kept.
const REFERENCES: &str = "build/passes";

/// Measures and writes the page.
///
/// # Errors
/// Those of the library and of files, and images that are far too bright or too dark.
pub fn run(file: &Path, quick: bool) -> Result<()> {
    let step = step(quick);
    let mut cells = Vec::new();
    let [rendered, judged] = [step, KNOWN * step].map(|step| scenes(View::Image(step), quick));
    for scene in rendered?.iter().zip(&judged?) {
        for light in lights(quick)? {
            let lit = Lit::new(&light)?;
            for material in [Material::lambert(), Material::ggx(0.2), Material::mix(0.1)] {
                // The cache learns from all that is rendered: once with those points alone that have a reference.
                for rendered in [scene.0, scene.1] {
                    cells.push(cell((rendered, scene.1), &Setting::new(&lit, &material), quick)?);
                }
                eprintln!("{}", cells[cells.len() - 1].name.join(", "));
            }
        }
    }
    page::page(&cells)?.write(file)
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
    let truth = Truth::new(&Reference::cached(&file, judged, setting, if quick { 512 } else { 4096 })?, 1);
    let points = [1, 2, 3].map(|region| truth.members(region).count());
    let (mut errors, mut times) = ([[0.0; REGIONS.len()]; 2], [[0.0; MODELS.len()]; 2]);
    for (with, (errors, times)) in errors.iter_mut().zip(&mut times).enumerate() {
        let mut taken = vec![Vec::new(); MODELS.len()];
        let mut sum = 0.0;
        for repeat in 0..REPEATS {
            for (model, taken) in taken.iter_mut().enumerate() {
                let (estimates, time) = passes(scene, &setting.at(MODELS[model].1), [with == 1, false], repeat)?;
                taken.push(time);
                if model > 0 {
                    continue;
                }
                let is_known = |place: &ShadingPoint| place.pixel.iter().all(|c| c % (KNOWN * step) == 0);
                let known = scene.points.iter().zip(&estimates).filter(|(place, _)| is_known(place));
                let known: Vec<[f64; 2]> = known.map(|(_, estimate)| [*estimate; 2]).collect();
                sum += known.iter().map(|v| v[0]).sum::<f64>() / known.len() as f64;
                for (region, error) in errors.iter_mut().enumerate() {
                    *error += truth.errors(&known, region + 1).relative / f64::from(REPEATS);
                }
            }
        }
        let brightness = sum / f64::from(REPEATS) / truth.mean();
        ensure!((brightness - 1.0).abs() < BIAS, "{}: {brightness} of the reference", name.join(", "));
        *times = [0, 1].map(|model| statistics::median(&taken[model]));
    }
    let (rendered, all) = (scene.points.len(), scene.points.len() > judged.points.len());
    Ok(Cell { name, rendered, all, points, errors, times })
}

/// The image of all passes but the first, and the nanoseconds for a point and a pass, with or without a cache and portals.
pub fn passes(scene: &Scene, setting: &Setting, [with, portals]: [bool; 2], repeat: u32) -> Result<(Vec<f64>, f64)> {
    let made = material(&setting.material.lobes())?;
    let (mut sampler, mut cache) = (Sampler::new(1, 0, 0)?, Cache::new()?);
    let mut image = vec![0.0; scene.points.len()];
    let mut begin = 0.0;
    for pass in 0..PASSES {
        if pass == 1 {
            begin = 1e9 * processor::seconds();
        }
        for (place, pixel) in scene.points.iter().zip(&mut image) {
            let bsdf = Bsdf::new(setting.material, place);
            let mut point = setting.material.point(place, &made);
            (point.seed, point.sample) = (pixel_seed(place.pixel, repeat), pass);
            if with {
                cache.lend(place, &mut point)?;
            }
            let here: Vec<_> = scene.portals.iter().map(|portal| portal.at(place.origin)).collect();
            if portals {
                (point.portals, point.portal_count) = (here.as_ptr(), here.len() as u32);
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
    Ok((image, (1e9 * processor::seconds() - begin) / points))
}
