//! Switches ideas of products off, one at a time, and looks for their largest weights: ablation <file>
//!
//! The header has no switches for experiments, so this links the kernel itself, and measures no times.

mod weights;

use anyhow::{Context, Result};
use std::fmt::Write;
use wis::light::batch::{Drawn, samples};
use wis::light::tables::{decode, encode};
use wis::product::density::Shaded;
use wis::product::peak::Mixture;
use wis::product::prepare::{Config, DIVIDED, prepare};
use wis::product::stored::{MAX_DIVIDED, Product, most_bytes};
use wis::{Block, Environment, Kind, Level, Map, Material, Point, Shape};
use wis_ffi_tests::light::Light;
use wis_ffi_tests::products::{Case, DEVELOPER, POINTS, geometric, lights, materials, points};
use wis_ffi_tests::{material, scene};

fn main() -> Result<()> {
    let file = std::env::args().nth(1).context("usage: ablation <file>")?;
    let mut maps = lights(&DEVELOPER)?;
    if maps.is_empty() {
        maps.extend([Light::windows(512), Light::room(512)].map(Light::bilinear));
    }
    let mut out = String::new();
    ablation(&mut out, &maps)?;
    weights::write(&mut out)?;
    Ok(std::fs::write(file, out)?)
}

/// The environment of a light, in memory of its own.
pub struct Built {
    memory: Vec<Block>,
}

impl Built {
    pub fn new(light: &Light) -> Built {
        let [width, height] = light.size().map(|n| n as u32);
        let map = Map { world_from_map: light.world_from_map(), ..Map::latlong(width, height, 1, light.luminance()) };
        let size = map.size().expect("a map of this size");
        let mut memory = vec![Block::ZERO; Block::count(size.bytes)];
        let mut scratch = vec![Block::ZERO; Block::count(size.scratch)];
        map.build_in(&mut memory, &mut scratch).expect("a sound map");
        Built { memory }
    }

    pub fn environment(&self) -> Environment<'_> {
        Environment::open(Block::bytes(&self.memory)).expect("it was built")
    }
}

/// A product in memory of its own.
pub struct Prepared(Vec<Block>);

impl Prepared {
    pub fn new(environment: &Environment<'_>, point: &Point<'_>, config: &Config) -> Prepared {
        let mut memory = vec![Block::ZERO; Block::count(most_bytes(MAX_DIVIDED))];
        prepare(Level::detect(), environment, point, config, Block::bytes_mut(&mut memory)).expect("a valid point");
        Prepared(memory)
    }

    pub fn over<'a>(&'a self, environment: &Environment<'a>) -> Shaded<'a> {
        let product = Product::view(Block::bytes(&self.0)).expect("it was prepared");
        Shaded { light: environment.light(), product }
    }
}

/// The lobes of a material of the instruments.
fn kernel(material: &material::Material) -> Material {
    let shape = |lobe: &wis_ffi_tests::client::raw::wis_lobe| Shape {
        kind: Kind::from_code(lobe.kind).expect("a lobe's number"),
        a: lobe.a,
        b: lobe.b,
        eta: lobe.eta,
    };
    let shapes: Vec<Shape> = material.lobes().iter().map(shape).collect();
    Material::new(&shapes).expect("lobes in range")
}

/// A point of the instruments.
fn at<'a>(material: &'a Material, of: &material::Material, point: &scene::ShadingPoint) -> Point<'a> {
    let raw = of.point(point, &wis_ffi_tests::client::raw::wis_material::default());
    Point { weight: raw.weight, f0: raw.f0, ..Point::new(material, raw.normal, raw.wo) }
}

/// What is switched, and the evaluations of F that it takes at most.
fn variants() -> Vec<(String, Config)> {
    let usual = Config::default();
    let mut all = vec![(format!("as it is: {DIVIDED} divided cells"), usual)];
    for divided in [0, 1, 2, 4, 16, MAX_DIVIDED] {
        all.push((format!("{divided} divided cells"), Config { divided, ..usual }));
    }
    all.push(("no mixture: the grid alone".into(), Config { mixture: Mixture::NONE, ..usual }));
    let unwidened = Mixture { resolved: 0.0, ..Mixture::TUNED };
    all.push(("a mixture whose grid sees narrow lobes as they are".into(), Config { mixture: unwidened, ..usual }));
    all
}

fn ablation(out: &mut String, maps: &[Light]) -> Result<()> {
    let (materials, points, variants) = (materials(), points(POINTS)?, variants());
    let mut errors = vec![vec![Vec::new(); materials.len()]; variants.len()];
    for map in maps {
        let built = Built::new(map);
        let environment = built.environment();
        for (i, material) in materials.iter().enumerate() {
            let case = Case::new(map, material, &points);
            let lobes = kernel(material);
            for ((_, config), errors) in variants.iter().zip(&mut errors) {
                errors[i].push(case.error(|point, u, wi, pdf| {
                    let prepared = Prepared::new(&environment, &at(&lobes, material, point), config);
                    let mut drawn = vec![Drawn::default(); u.len()];
                    let shaded = prepared.over(&environment);
                    samples(&shaded, &environment.frame(), u, &mut drawn);
                    for ((wi, pdf), drawn) in wi.iter_mut().zip(pdf).zip(drawn) {
                        (*wi, *pdf) = (drawn.wi, drawn.pdf);
                    }
                    Ok(())
                })?);
            }
        }
        eprintln!("{}", map.name);
    }
    let mean = |variant: usize, material: usize| geometric(errors[variant][material].iter().copied());
    let names: Vec<&str> = materials.iter().map(|material| material.name.as_str()).collect();
    writeln!(out, "## Ideas switched off\n\nError on the maps for tuning; one switch at a time.\n")?;
    writeln!(out, "| what | {} |\n|---|{}", names.join(" | "), "---:|".repeat(names.len()))?;
    for (variant, (name, _)) in variants.iter().enumerate() {
        let cells: Vec<String> = (0..names.len()).map(|i| format!("{:.3}", mean(variant, i))).collect();
        writeln!(out, "| {name} | {} |", cells.join(" | "))?;
    }
    let finest = (variants.len() - 4, MAX_DIVIDED);
    let buys: Vec<String> = (0..names.len())
        .map(|i| format!("{} {:.0} %", names[i], 100.0 * (1.0 - mean(finest.0, i) / mean(1, i))))
        .collect();
    writeln!(
        out,
        "\nThe corners of all cells take up to 160 evaluations of F, each divided cell 16 more. {} divided cells in place of none take \
         this off the error: {}.",
        finest.1,
        buys.join(", ")
    )?;
    let rounded = (1..1 << 16).map(|i| 0.5 + i as f32 / (1 << 17) as f32);
    let largest = rounded.map(|x| f64::from((decode(encode(x)) / (65536.0 * x) - 1.0).abs())).fold(0.0, f64::max);
    let least = (0..names.len()).map(|i| mean(0, i)).fold(f64::MAX, f64::min);
    writeln!(
        out,
        "\nCorners in 16 bits: the largest rounding is {largest:.1e} of a corner, so densities of f32 corners differ by at most twice that. \
         Against the least error above it is 1 part in {:.0}: no error changes by it in a digit that stands here.",
        least / (2.0 * largest)
    )?;
    Ok(())
}
