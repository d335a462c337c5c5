//! Measures the sampler's own costs, its error against what it may spend, and each idea switched off: sampler <page>
//!
//! Points are random, without occlusion: what is measured is the quality of the product itself.

use anyhow::{Context, Result};
use glam::Vec3;
use std::fmt::Write;
use std::path::Path;
use std::time::Instant;
use wis_ffi_tests::client::{self, Block, Density, Environment, Map, Preparation, Product, raw};
use wis_ffi_tests::data;
use wis_ffi_tests::estimator::{Estimator, Lit, Setting};
use wis_ffi_tests::library::Mode;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::method::Method;
use wis_ffi_tests::peers::{Candidates, Peer};
use wis_ffi_tests::scene::ShadingPoint;
use wis_ffi_tests::statistics::median;

const MAPS: [&str; 5] = [
    "studio_small_03_1k.hdr",
    "st_fagans_interior_1k.hdr",
    "venice_sunset_1k.hdr",
    "rooitou_park_1k.hdr",
    "forest_slope_1k.hdr",
];
/// Random shading points, and estimates of each.
const POINTS: usize = 120;
const PASSES: u32 = 4;
/// So often are they repeated, since the first finds neither map nor tree in near caches.
const REPEATS: u32 = 5;
/// Samples of an estimate.
const SAMPLES: usize = 16;
/// Samples of the reference of a point.
const MANY: usize = 1 << 15;
/// Rounds of a timing, of which the fastest counts.
const ROUNDS: usize = 15;

fn main() -> Result<()> {
    let page = std::env::args().nth(1).context("usage: sampler <page>")?;
    let lights = lights()?;
    let mut out = String::from(
        "# The sampler by itself\n\nWritten by `make sampler`: random shading points without occlusion, so that errors are those of the product.\n\
         Error: RMSE of estimates of 16 samples over the mean of all points, geometric mean over maps. Times: nanoseconds,\n\
         the fastest of 15 rounds over 1000 points of st_fagans (or of the windows if there are no maps); the machine has\n\
         other tenants, and doubles them at times.\n",
    );
    costs(&mut out, lights.iter().find(|l| l.name.contains("fagans")).unwrap_or(&lights[0]))?;
    budgets(&mut out, &lights)?;
    ablation(&mut out, &lights)?;
    sizes(&mut out)?;
    print!("{out}");
    Ok(std::fs::write(page, out)?)
}

/// The real maps that are there, the windows and the sun.
fn lights() -> Result<Vec<Light>> {
    let maps = MAPS.map(|name| Path::new(data::FOLDER).join("envmaps").join(name));
    let real = maps.iter().filter(|map| map.exists()).map(|map| Light::load(map)).collect::<Result<Vec<_>>>()?;
    Ok([vec![Light::windows(512), Light::sun(512)], real].concat())
}

fn materials() -> Vec<Material> {
    vec![Material::lambert(), Material::ggx(0.5), Material::ggx(0.2), Material::ggx(0.05), Material::mix(0.1)]
}

/// Random points whose viewer is above the surface.
fn points(count: usize) -> Vec<ShadingPoint> {
    let mut u = vec![[0.0; 2]; 4 * count];
    client::sobol(77, 0, &mut u).expect("a valid range");
    let direction = |[a, b]: [f32; 2]| {
        let (z, phi) = (1.0 - 2.0 * a, std::f32::consts::TAU * b);
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    };
    let pairs = u.chunks(2).map(|pair| (direction(pair[0]), direction(pair[1])));
    let points = pairs.filter(|(normal, wo)| normal.dot(*wo) > 0.05).take(count).zip(0..);
    points.map(|((normal, wo), i)| ShadingPoint { pixel: [i, 7], hit: 0, origin: Vec3::ZERO, normal, wo }).collect()
}

/// The fastest round, in nanoseconds for an item.
fn fastest(items: usize, mut round: impl FnMut() -> client::Result<()>) -> client::Result<f64> {
    let mut best = f64::MAX;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        round()?;
        best = best.min(start.elapsed().as_secs_f64() * 1e9 / items as f64);
    }
    Ok(best)
}

/// What the calls cost beside the goals of the design.
fn costs(out: &mut String, light: &Light) -> Result<()> {
    let environment = light.environment()?;
    let preparation = Preparation { world_from_map: Some(light.world_from_map()), ..Default::default() };
    let (points, mut memory) = (points(1000), preparation.memory()?);
    writeln!(
        out,
        "\n## Costs\n\nThe last three columns: 64 shading points in one call, one sample of each.\n\n\
         | material | prepare | sample alone | sample in 8 | in 64 | pdf alone | pdf in 64 | bytes | prepare, 64 points | \
         sample | pdf |"
    )?;
    writeln!(out, "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|")?;
    for material in materials() {
        let queries: Vec<_> = points.iter().map(|point| material.query(point)).collect();
        let prepare = fastest(queries.len(), || {
            queries.iter().try_for_each(|q| Product::prepare(&environment, q, &preparation, &mut memory).map(drop))
        })?;
        let mut u = vec![[0.0; 2]; 64];
        client::sobol(5, 0, &mut u)?;
        let (mut wi, mut pdf) = (vec![[0.0; 3]; 64], vec![0.0; 64]);
        let mut each: [Vec<f64>; 6] = Default::default();
        for query in queries.iter().step_by(25) {
            let product = Product::prepare(&environment, query, &preparation, &mut memory)?;
            each[5].push(product.describe()?.bytes as f64);
            for (slot, batch) in [(0, 1), (1, 8), (2, 64)] {
                each[slot].push(fastest(64, || {
                    let parts = u.chunks(batch).zip(wi.chunks_mut(batch)).zip(pdf.chunks_mut(batch));
                    parts.into_iter().try_for_each(|((u, wi), pdf)| product.sample_n(u, wi, pdf))
                })?);
            }
            for (slot, batch) in [(3, 1), (4, 64)] {
                each[slot].push(fastest(64, || {
                    let mut parts = wi.chunks(batch).zip(pdf.chunks_mut(batch));
                    parts.try_for_each(|(wi, pdf)| product.pdf_n(wi, pdf))
                })?);
            }
        }
        let [a, b, c, d, e, bytes] = each.map(|values| median(&values));
        let [p, s, q] = side_by_side(&environment, &queries[..64], &preparation, &u)?;
        let name = &material.name;
        write!(out, "| {name} | {prepare:.0} | {a:.0} | {b:.0} | {c:.0} | {d:.0} | {e:.0} | {bytes:.0} ")?;
        writeln!(out, "| {p:.0} | {s:.0} | {q:.0} |")?;
    }
    Ok(())
}

/// What a point costs if all are prepared, sampled once and asked for one pdf in a call each.
fn side_by_side(
    environment: &Environment,
    queries: &[raw::wis_wavelet_query],
    preparation: &Preparation,
    u: &[[f32; 2]],
) -> Result<[f64; 3]> {
    let count = queries.len();
    let mut memory = Block::new(count * preparation.memory()?.bytes());
    let prepare = fastest(count, || client::prepare_points(environment, queries, preparation, &mut memory).map(drop))?;
    let points = client::prepare_points(environment, queries, preparation, &mut memory)?;
    let (mut wi, mut pdf) = (vec![[0.0; 3]; count], vec![0.0; count]);
    let sample = fastest(count, || points.sample(u, &mut wi, &mut pdf))?;
    Ok([prepare, sample, fastest(count, || points.pdf(&wi, &mut pdf))?])
}

/// The mean of a setting at each point, by many samples of light and BRDF.
fn truth(setting: &Setting, points: &[ShadingPoint]) -> client::Result<Vec<f64>> {
    let mut estimator = Estimator::new(setting, 1)?;
    points.iter().map(|point| Ok(sum(estimator.picks(Peer::MisBalance, setting, point, 1 << 20, MANY)?))).collect()
}

fn sum(picks: &[wis_ffi_tests::estimator::Pick]) -> f64 {
    picks.iter().map(|pick| f64::from(pick.contribution)).sum()
}

/// The error of a method, and its nanoseconds for a point.
fn error(method: Method, setting: &Setting, points: &[ShadingPoint], truth: &[f64]) -> client::Result<[f64; 2]> {
    let mut estimator = Estimator::new(setting, 1)?;
    let mean = truth.iter().sum::<f64>() / truth.len() as f64;
    let (mut squares, mut ns) = (0.0, f64::MAX);
    for pass in (0..REPEATS).flat_map(|_| 0..PASSES) {
        let start = Instant::now();
        for (point, truth) in points.iter().zip(truth) {
            squares += ((sum(estimator.picks(method, setting, point, pass, SAMPLES)?) - truth) / mean).powi(2);
        }
        ns = ns.min(start.elapsed().as_secs_f64() * 1e9 / points.len() as f64);
    }
    Ok([(squares / (truth.len() as f64 * f64::from(REPEATS * PASSES))).sqrt(), ns])
}

/// Geometric means over maps of error and time, material by material.
struct Row([(f64, f64); 8], usize);

impl Row {
    fn new() -> Row {
        Row([(0.0, 0.0); 8], 0)
    }

    fn add(&mut self, results: &[[f64; 2]]) {
        for ((error, ns), [e, t]) in self.0.iter_mut().zip(results) {
            (*error, *ns) = (*error + e.ln(), *ns + t.ln());
        }
        self.1 += 1;
    }

    fn write(&self, out: &mut String, name: &str, columns: usize) -> Result<()> {
        write!(out, "| {name} ")?;
        for (error, ns) in &self.0[..columns] {
            let mean = |sum: &f64| (sum / self.1 as f64).exp();
            write!(out, "| {:.3} / {:.1} ", mean(error), mean(ns) / 1e3)?;
        }
        Ok(writeln!(out, "|")?)
    }
}

fn head(out: &mut String, title: &str, first: &str) -> Result<()> {
    let names: Vec<String> = materials().into_iter().map(|m| m.name).collect();
    writeln!(out, "\n## {title}\n\nError / microseconds of an estimate of 16 samples.\n")?;
    Ok(writeln!(out, "| {first} | {} |\n|---|{}", names.join(" | "), "---:|".repeat(names.len()))?)
}

/// Error and time against the evaluations that may be spent.
fn budgets(out: &mut String, lights: &[Light]) -> Result<()> {
    const BUDGETS: [u32; 6] = [66, 86, 106, 146, 226, 386];
    head(out, "What evaluations buy", "evaluations")?;
    let mut rows = BUDGETS.map(|_| Row::new());
    let points = points(POINTS);
    for light in lights {
        let environment = light.environment()?;
        let lit = Lit::new(light, &environment)?;
        let mut results = BUDGETS.map(|_| Vec::new());
        for material in materials() {
            let mut setting = Setting::new(&lit, &material);
            let truth = truth(&setting, &points)?;
            for (budget, results) in BUDGETS.iter().zip(&mut results) {
                (setting.preparation.max_evaluations, setting.preparation.max_squares) = (*budget, 1024);
                results.push(error(Mode::Product.into(), &setting, &points, &truth)?);
            }
        }
        rows.iter_mut().zip(&results).for_each(|(row, results)| row.add(results));
    }
    for (budget, row) in BUDGETS.iter().zip(&rows) {
        row.write(out, &budget.to_string(), materials().len())?;
    }
    Ok(())
}

/// A lat-long map with other flags and another resolution.
fn environment(light: &Light, flags: u32, resolution: u32) -> client::Result<Environment> {
    let [width, height] = light.size();
    let map = Map::latlong(width as u32, height as u32, 1, light.luminance());
    Environment::new(&Map { flags, resolution, ..map })
}

/// Each idea switched off, one at a time.
fn ablation(out: &mut String, lights: &[Light]) -> Result<()> {
    const FLAGS: u32 = raw::WIS_WAVELET_LIGHT_NEAREST;
    head(out, "One idea switched off at a time", "what")?;
    let points = points(POINTS);
    let names = [
        "all on",
        "no squares below cells",
        "texels spread to neighbours",
        "no BRDF: the light alone",
        "base grid only",
        "tree pool",
        "MIS, compensated",
        "RIS8",
    ];
    let mut rows = names.map(|_| Row::new());
    for light in lights {
        let [width, height] = light.size();
        let natural = ((width * height).next_power_of_two().ilog2().div_ceil(2)).min(12);
        let whole = environment(light, FLAGS, 0)?;
        let coarse = environment(light, FLAGS, 1 << natural)?;
        let spread = environment(light, FLAGS & !raw::WIS_WAVELET_LIGHT_NEAREST, 0)?;
        let [whole, coarse, spread] = [&whole, &coarse, &spread].map(|environment| Lit::new(light, environment));
        let (whole, coarse, spread) = (whole?, coarse?, spread?);
        let mut results = names.map(|_| Vec::new());
        for material in materials() {
            let mut base = Setting::new(&whole, &material);
            let [whole, coarse, spread] = [&whole, &coarse, &spread].map(|lit| Setting::new(lit, &material));
            let truth = truth(&whole, &points)?;
            base.preparation.max_evaluations = 66;
            let variants: [(&Setting, Method); 8] = [
                (&whole, Mode::Product.into()),
                (&coarse, Mode::Product.into()),
                (&spread, Mode::Product.into()),
                (&whole, Peer::Environment.into()),
                (&base, Mode::Product.into()),
                (&whole, Mode::TreePool(4).into()),
                (&whole, Peer::MisCompensated.into()),
                (&whole, Peer::Ris(8, Candidates::Plain).into()),
            ];
            for ((setting, method), results) in variants.into_iter().zip(&mut results) {
                results.push(error(method, setting, &points, &truth)?);
            }
        }
        rows.iter_mut().zip(&results).for_each(|(row, results)| row.add(results));
    }
    for (name, row) in names.iter().zip(&rows) {
        row.write(out, name, materials().len())?;
    }
    Ok(())
}

/// Costs against the size of the map.
fn sizes(out: &mut String) -> Result<()> {
    writeln!(
        out,
        "\n## What the size of the map costs\n\nA sky with a sun, GGX 0.2; error and microseconds as above.\n"
    )?;
    writeln!(
        out,
        "| texels | build ms | environment bytes | bytes a texel | error | us |\n|---|---:|---:|---:|---:|---:|"
    )?;
    let (points, material) = (points(POINTS), Material::ggx(0.2));
    for width in [64, 128, 256, 512, 1024, 2048, 4096] {
        let light = Light::sun(width);
        let start = Instant::now();
        let environment = light.environment()?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        let lit = Lit::new(&light, &environment)?;
        let setting = Setting::new(&lit, &material);
        let [error, ns] = error(Mode::Product.into(), &setting, &points, &truth(&setting, &points)?)?;
        let (bytes, texels) = (environment.info.bytes, light.luminance().len());
        let each = bytes as f64 / texels as f64;
        writeln!(out, "| {texels} | {ms:.0} | {bytes} | {each:.0} | {error:.3} | {:.1} |", ns / 1e3)?;
    }
    Ok(())
}
