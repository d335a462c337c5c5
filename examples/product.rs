//! What the parts of a product are worth: error at 16 samples, largest times, and the same with parts left out.
//!
//! `cargo run --profile instruments --example product [-- FOLDER]` reads lat-long HDR maps from FOLDER, or from the folder of
//! maps beside the crate; without any it says so and uses a sky with a sun of its own.

use std::hint::black_box;
use std::path::PathBuf;
use std::time::Instant;
use wis::brdf::material::{Material, Shape};
use wis::brdf::point::Point;
use wis::brdf::surface::Surface;
use wis::light::batch::{Drawn, pdfs, samples};
use wis::light::chart::Layout;
use wis::light::decode::Pixels;
use wis::light::environment::Environment;
use wis::light::pixels::Format;
use wis::light::plan::{Description, Filter, Plan};
use wis::points::sobol;
use wis::product::density::Shaded;
use wis::product::peak::Mixture;
use wis::product::prepare::{Config, prepare};
use wis::product::stored::{MAX_DIVIDED, Product, most_bytes};
use wis::simd::Level;
use wis::sphere::Frame;

/// Maps for tuning; others are for judging.
const MAPS: [&str; 4] = ["st_fagans_interior", "studio_small_03", "venice_sunset", "rooitou_park"];
/// Samples of an estimate.
const N: u32 = 16;
const POINTS: u32 = 64;
const REPEATS: u32 = 16;
const REFERENCE: u32 = 1 << 14;

struct Map {
    name: String,
    width: usize,
    height: usize,
    luminance: Vec<f32>,
}

impl Map {
    fn own() -> Map {
        let (width, height) = (1024, 512);
        let texel = |i: usize| {
            let (x, y) = (i % width, i / width);
            let sun = (x as f32 - 300.0).hypot(y as f32 - 120.0) < 1.5;
            0.2 + 0.8 * (1.0 - y as f32 / height as f32) + if sun { 1e4 } else { 0.0 }
        };
        Map { name: "sky with sun".into(), width, height, luminance: (0..width * height).map(texel).collect() }
    }

    fn read(path: &PathBuf, name: &str) -> Option<Map> {
        let image = image::open(path).ok()?.into_rgb32f();
        let (width, height) = (image.width() as usize, image.height() as usize);
        let luminance = image.pixels().map(|p| 0.2126 * p.0[0] + 0.7152 * p.0[1] + 0.0722 * p.0[2]).collect();
        Some(Map { name: name.into(), width, height, luminance })
    }

    /// Bilinear between texel centres, as a renderer looks it up.
    fn radiance(&self, [x, y, z]: [f32; 3]) -> f32 {
        let (w, h) = (self.width as f32, self.height as f32);
        let turn = y.atan2(x) / std::f32::consts::TAU;
        let u = (if turn < 0.0 { turn + 1.0 } else { turn }) * w - 0.5;
        let v = x.hypot(y).atan2(z) / std::f32::consts::PI * h - 0.5;
        let texel = |i: f32, j: f32| {
            let over = j < 0.0 || j >= h;
            let i = (i as isize + if over { self.width as isize / 2 } else { 0 }).rem_euclid(self.width as isize);
            self.luminance[(j.clamp(0.0, h - 1.0) as usize) * self.width + i as usize]
        };
        let (i, j) = (u.floor(), v.floor());
        let (s, t) = (u - i, v - j);
        let line = |j: f32| texel(i, j) * (1.0 - s) + texel(i + 1.0, j) * s;
        line(j) * (1.0 - t) + line(j + 1.0) * t
    }

    fn build(&self) -> Vec<u128> {
        let plan = Plan::new(&Description {
            layout: Layout::LatLong,
            width: self.width as u32,
            height: self.height as u32,
            filter: Filter::Bilinear,
            rows_at_poles: false,
            exact_zero: false,
            compensated: false,
            light_only: false,
            rays_only: false,
            budget: 0.0,
        })
        .expect("a map");
        let size = plan.size().expect("a map");
        let mut words = vec![0u128; size.bytes.div_ceil(16)];
        let mut scratch = vec![0u128; size.scratch.div_ceil(16)];
        let row = |y: u32| {
            let first = y as usize * self.width;
            Some(bytemuck::cast_slice::<f32, u8>(&self.luminance[first..first + self.width]))
        };
        let pixels = Pixels { channels: 1, format: Format::F32, sanitise: true, absolute: false };
        let (memory, scratch) = (bytemuck::cast_slice_mut(&mut words), bytemuck::cast_slice_mut(&mut scratch));
        Environment::build_in(&plan, &pixels, &Frame::IDENTITY, row, memory, scratch).expect("a map");
        words
    }
}

fn maps() -> Vec<Map> {
    let beside: PathBuf = [env!("CARGO_MANIFEST_DIR"), "..", "shared", "data", "envmaps"].iter().collect();
    let folder = std::env::args().nth(1).map_or(beside, PathBuf::from);
    let read = |name: &&str| Map::read(&folder.join(format!("{name}_1k.hdr")), name);
    let found: Vec<Map> = MAPS.iter().filter_map(read).collect();
    if found.is_empty() {
        println!("no maps in {}: a sky with a sun of its own", folder.display());
        return vec![Map::own()];
    }
    found
}

fn materials() -> Vec<(&'static str, Material)> {
    let of = |shapes: &[Shape]| Material::new(shapes).expect("lobes");
    let ggx = |a: f32| Shape::ggx(a, a);
    vec![
        ("Lambert", of(&[Shape::LAMBERT])),
        ("GGX .5", of(&[ggx(0.5)])),
        ("GGX .2", of(&[ggx(0.2)])),
        ("mix", of(&[Shape::LAMBERT, ggx(0.1)])),
        ("GGX .05", of(&[ggx(0.05)])),
        ("GGX .02", of(&[ggx(0.02)])),
    ]
}

/// Point `index`: normals all over the sphere, views up to about 80 degrees.
fn point(material: &Material, index: u32) -> Point<'_> {
    let [a, b] = sobol(7, index);
    let [c, d] = sobol(8, index);
    let z = 1.0 - 2.0 * a;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (y, x) = (std::f32::consts::TAU * b).sin_cos();
    let n = glam::Vec3::new(r * x, r * y, z).normalize();
    let t = n.any_orthonormal_vector();
    let cosine = 0.17 + 0.83 * c;
    let sine = (1.0 - cosine * cosine).sqrt();
    let (y, x) = (std::f32::consts::TAU * d).sin_cos();
    let wo = (n * cosine + (t * x + n.cross(t) * y) * sine).normalize();
    let mut point = Point::new(material, n.to_array(), wo.to_array());
    point.f0 = [[0.9; 3]; 4];
    point.weight = [[0.8; 3]; 4];
    if material.lobes().len() > 1 {
        point.weight[1] = [0.4; 3];
    }
    point
}

struct Bench<'a> {
    map: &'a Map,
    environment: Environment<'a>,
    level: Level,
    memory: Vec<u128>,
}

impl Bench<'_> {
    fn prepare(&mut self, point: &Point<'_>, config: &Config) -> usize {
        let memory = bytemuck::cast_slice_mut(&mut self.memory);
        prepare(self.level, &self.environment, point, config, memory).expect("a point")
    }

    fn shaded(&self) -> Shaded<'_> {
        let product = Product::view(bytemuck::cast_slice(&self.memory)).expect("a product");
        Shaded { light: self.environment.light(), product }
    }

    fn estimate(&self, surface: &Surface, seed: u32, count: u32) -> f64 {
        let u: Vec<[f32; 2]> = (0..count).map(|i| sobol(seed, i)).collect();
        let mut drawn = vec![Drawn::default(); u.len()];
        samples(&self.shaded(), &Frame::IDENTITY, &u, &mut drawn);
        let value = |d: &Drawn| {
            let local = surface.to_local(d.wi);
            if local[2] <= 0.0 {
                return 0.0;
            }
            f64::from(surface.eval(local).0) * f64::from(self.map.radiance(d.wi)) / f64::from(d.pdf)
        };
        drawn.iter().map(value).sum::<f64>() / f64::from(count)
    }

    /// The root mean square error of 16 samples over the mean, and the error of the stored integral.
    fn error(&mut self, material: &Material, config: &Config, references: &[f64]) -> (f64, f64) {
        let (mut squares, mut stored, mut sum) = (0.0, 0.0, 0.0);
        for (index, reference) in (0..).zip(references) {
            let point = point(material, index);
            let surface = Surface::new(&point, &Frame::IDENTITY).expect("a point");
            self.prepare(&point, config);
            for repeat in 0..REPEATS {
                let e = self.estimate(&surface, 1000 + repeat + REPEATS * index, N) - reference;
                squares += e * e / f64::from(REPEATS);
            }
            let integral = self.shaded().product.header.integral;
            stored += (integral - reference).powi(2);
            sum += reference;
        }
        let count = references.len() as f64;
        ((squares / count).sqrt() / (sum / count), (stored / count).sqrt() / (sum / count))
    }

    fn references(&mut self, material: &Material) -> Vec<f64> {
        (0..POINTS)
            .map(|index| {
                let point = point(material, index);
                let surface = Surface::new(&point, &Frame::IDENTITY).expect("a point");
                self.prepare(&point, &Config { divided: MAX_DIVIDED, ..Config::default() });
                self.estimate(&surface, 5000 + index, REFERENCE)
            })
            .collect()
    }

    /// Nanoseconds: prepare; sample in 64, alone; pdf in 64, alone. The least of some rounds.
    fn times(&mut self, material: &Material) -> [f64; 5] {
        const ROUNDS: usize = 7;
        let config = Config::default();
        let mut best = [f64::INFINITY; 5];
        let mut keep = |k: usize, ns: f64| best[k] = best[k].min(ns);
        for _ in 0..ROUNDS {
            let points: Vec<Point<'_>> = (0..POINTS).map(|i| point(material, i)).collect();
            let start = Instant::now();
            for point in &points {
                self.prepare(black_box(point), &config);
            }
            keep(0, start.elapsed().as_nanos() as f64 / f64::from(POINTS));
            let (mut t64, mut t1, mut p64, mut p1) = (0.0, 0.0, 0.0, 0.0);
            for (index, point) in points.iter().enumerate() {
                self.prepare(point, &config);
                let shaded = self.shaded();
                let u: Vec<[f32; 2]> = (0..64).map(|i| sobol(index as u32, i)).collect();
                let mut drawn = [Drawn::default(); 64];
                let mut densities = [0.0; 64];
                let timed = |body: &mut dyn FnMut()| {
                    body();
                    let start = Instant::now();
                    body();
                    start.elapsed().as_nanos() as f64 / 64.0
                };
                t64 += timed(&mut || samples(&shaded, &Frame::IDENTITY, black_box(&u), &mut drawn));
                let wi = drawn.map(|d| d.wi);
                p64 += timed(&mut || pdfs(&shaded, &Frame::IDENTITY, black_box(&wi), &mut densities));
                t1 += timed(&mut || {
                    for (u, out) in u.iter().zip(drawn.chunks_mut(1)) {
                        samples(&shaded, &Frame::IDENTITY, black_box(std::slice::from_ref(u)), out);
                    }
                });
                p1 += timed(&mut || {
                    for (wi, out) in wi.iter().zip(densities.chunks_mut(1)) {
                        pdfs(&shaded, &Frame::IDENTITY, black_box(std::slice::from_ref(wi)), out);
                    }
                });
                black_box((&drawn, &densities));
            }
            for (k, t) in [t64, t1, p64, p1].into_iter().enumerate() {
                keep(k + 1, t / f64::from(POINTS));
            }
        }
        best
    }
}

fn main() {
    let full = Config::default();
    let variants = [
        ("all", full),
        ("none divided", Config { divided: 0, ..full }),
        ("24 divided", Config { divided: 24, ..full }),
        ("no mixture", Config { mixture: Mixture::NONE, ..full }),
        ("not widened", Config { mixture: Mixture { resolved: 0.0, ..Mixture::TUNED }, ..full }),
    ];
    let maps = maps();
    let only = std::env::var("WIS_LAB").unwrap_or_default();
    for (name, material) in materials() {
        let mut errors = vec![(0.0, 0.0); variants.len()];
        let mut times = [0.0; 5];
        let (mut bytes, mut environment_bytes) = (0, 0);
        for map in &maps {
            let words = map.build();
            let environment = Environment::view(bytemuck::cast_slice(&words)).expect("built");
            environment_bytes = environment.as_bytes().len();
            let memory = vec![0u128; most_bytes(MAX_DIVIDED) / 16];
            let mut bench = Bench { map, environment, level: Level::detect(), memory };
            if only == "prepare" {
                for i in 0..500_000 {
                    bench.prepare(&point(&material, i % POINTS), &full);
                }
                return;
            }
            if only != "times" {
                let references = bench.references(&material);
                let mut line = format!("{name:10} {:20}", map.name);
                for ((_, config), sum) in variants.iter().zip(&mut errors) {
                    let (error, stored) = bench.error(&material, config, &references);
                    line += &format!(" {error:.4}");
                    *sum = (sum.0 + error / maps.len() as f64, sum.1 + stored / maps.len() as f64);
                }
                println!("{line}");
            }
            if only != "errors" {
                for (sum, ns) in times.iter_mut().zip(bench.times(&material)) {
                    *sum += ns / maps.len() as f64;
                }
            }
            bytes = bytes.max(bench.prepare(&point(&material, 0), &full));
        }
        for ((variant, _), (error, stored)) in variants.iter().zip(errors).filter(|(_, (error, _))| *error > 0.0) {
            println!(
                "{name:10} mean, {variant:14} error at {N} samples {error:.4}, of the stored integral {stored:.4}"
            );
        }
        let [prepare, t64, t1, p64, p1] = times;
        println!(
            "{name:10} prepare {prepare:.0} ns, sample {t64:.0} in 64, {t1:.0} alone; pdf {p64:.0} in 64, {p1:.0} alone; {bytes} bytes over {environment_bytes}"
        );
    }
}
