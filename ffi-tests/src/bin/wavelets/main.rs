//! Goes through figures and claims of "Wavelet Importance Sampling" on real maps, meshes and measured BRDFs, and writes a
//! page with pictures: wavelets <page>

mod compression;
mod four;
mod gallery;
mod rotated;

use anyhow::{Context, Result};
use glam::Vec3;
use image::{GrayImage, Luma};
use std::fmt::Write;
use std::path::PathBuf;
use std::time::Instant;
use wis_ffi_tests::client::{self, Block, Density, Environment, Preparation, Tree, raw};
use wis_ffi_tests::data;
use wis_ffi_tests::images::side_by_side;
use wis_ffi_tests::light::{Light, octahedral_direction};
use wis_ffi_tests::material::{Bsdf, Material};
use wis_ffi_tests::points;
use wis_ffi_tests::scene::{Scene, ShadingPoint, View};
use wis_ffi_tests::structured::{How, Lights, Picture, Raster, Source, picture, truth};

const DEPTH: u32 = 7;
const SIDE: usize = 1 << DEPTH;
const STEP: u32 = 2;

fn main() -> Result<()> {
    let page = PathBuf::from(std::env::args().nth(1).context("usage: wavelets <page>")?);
    let pictures = page.with_extension("");
    std::fs::create_dir_all(&pictures)?;
    let light = data::light("grace_latlong.exr")?;
    let environment = light.environment()?;
    let mut page_text = Page { text: String::from(INTRODUCTION), pictures, light, environment };
    page_text.one_point()?;
    page_text.point_sets()?;
    page_text.convergence()?;
    page_text.buddha()?;
    compression::write(&mut page_text.text)?;
    gallery::sparsity(&mut page_text.text, &page_text.pictures, &page_text.light, &page_text.environment)?;
    gallery::write(&mut page_text.text, &page_text.pictures, &page_text.light, &page_text.environment)?;
    rotated::write(&mut page_text.text, &page_text.light, &page_text.environment)?;
    four::write(&mut page_text.text, &page_text.pictures)?;
    page_text.memory()?;
    print!("{}", page_text.text);
    Ok(std::fs::write(page, page_text.text)?)
}

const INTRODUCTION: &str = r#"# Wavelet importance sampling

Written by `make wavelets`. Clarberg et al. 2005, "Wavelet Importance Sampling: Efficiently Evaluating Products of Complex
Functions": products of trees (`wis_tree_multiply`), the hierarchical warp (`wis_warp_in_place`), tables of BRDFs about the
mirror direction (`wis_wavelet_table_*`), and the product at a shading point without turned maps (`wis_wavelet_product_*`).

| claim | paper | here | holds |
|---|---|---|---|
| 100 samples of the product of a point (Fig. 1) | .1 ms | 11 us for GGX .2, 25 us for a measured BRDF by its table | yes |
| the product is a better density than its factors | a picture | variance .04 to .11; BRDF 25 to 124, map 3 to 1354 | yes |
| the warp keeps the quality of the points (Fig. 4) | a picture | discrepancy of 256 Hammersley points .014 to .020, random ones .043 to .048 | mostly: .006 before |
| 64 Hammersley points are better than 512 random ones (Fig. 6) | yes | 128 are, with shadows and without | nearly |
| structured sampling misses details with 1000 lights, the product does not with 100 (Fig. 7) | yes | error .113 and .034 | yes |
| measured BRDFs from diffuse to glossy with 30 samples (Fig. 8) | practically noise-free | noise .07 to .2, .04 to .13 without occlusion | the glossiest has a few bright pixels |
| 10 to 30 samples of the product are as good as 100 and more strata (Fig. 9) | yes | 30: .075, 100: .30, 1000: .113 | yes |
| the BRDF alone does well for shiny materials | relatively | .27 with 100 samples, the product .15 with 10 | yes |
| 1 to 2 % of the coefficients are enough (Fig. 10) | a picture | 2 %: relative L2 error .02 to .16 at 64 x 64, .006 to .06 at 128 x 128 | yes |
| 16 x 16 x 64 x 64 in 300 kB | in colour | 18 to 70 kB in luminance at that error, 53 to 210 kB in colour | yes |
| 32 x 32 x 128 x 128 in 5 MB | in colour | .16 to .66 MB in luminance, .5 to 2 MB in colour | yes |
| 4-D products as a pre-process render 2.1 times as fast (Fig. 11) | yes | 2.9 times, error .52 in place of .10 | the time does |
| glossy and diffuse alike with 10 samples in the eucalyptus grove (Fig. 12) | yes | noise .04 to .14 without occlusion, the glossiest .3 | mostly |
| turned maps take hours to build | yes | 64^4 in .8 s, 38 MB; 128^4 in 12 s, 396 MB | no |
| turned maps and tables give the product (5.1) | the system | variance .2 to .7, blended four by four .23 to .7, the product on the map itself .04 to .11 | yes, but it is not the way to do it |

*Free sets of wavelets.* `wis_triple_select` keeps a number of wavelets, `wis_triple_terms` says how many an error needs,
`wis_triple_multiply` multiplies any two sets without decompression, and `wis_tree_of_wavelets` makes a tree of one that can
be sampled: values below a floor are raised to it, in average, sample and pdf alike.
`wis_sparse_select`, `wis_sparse_multiply` and `wis_tree_of_details` do the same for one to four axes.

*Blends.* `wis_tree_blend` adds up to sixteen trees with weights; a product of two such sums is the bilinear blend of all pairs,
since the inner product of details is bilinear. `wis_tree_of_environment` turns a map when a direction is asked for.

*Estimators* ([report.md](report.md), absolute error, geometric mean of 48 cells; 1, 4, 16, 64 samples): unbiased (Eq. 8) .38, .17,
.072, .033; pre-integrated (Eq. 11) .24, .14, .10, .087; the ratio of shadowed and unshadowed times the integral .24, .14,
.10, .087. The biased ones stop at the error of the integral, and win for up to 4 samples.

*Colour.* Directions are sampled by luminance; a client divides its own colour by the pdf, so that each sample has the hue of
its light and BRDF, and `wis_wavelet_product_estimate_rgb` integrates in colour. A `wis_wavelet_table` samples by luminance and evaluates red, green and blue (`wis_wavelet_query_eval`, `wis_wavelet_product_estimate_rgb`).
"#;

/// What is written, and the light of all figures.
struct Page {
    text: String,
    pictures: PathBuf,
    light: Light,
    environment: Environment,
}

impl Page {
    fn preparation(&self) -> Preparation {
        Preparation { world_from_map: Some(self.light.world_from_map()), ..Default::default() }
    }

    /// Fig. 1.
    fn one_point(&mut self) -> Result<()> {
        const SAMPLES: usize = 100;
        let preparation = self.preparation();
        let (mut memory, raster) = (preparation.memory()?, Raster::new(&self.light));
        writeln!(self.text, "\n## One point, 100 samples (Fig. 1)\n\n{ONE_POINT}")?;
        writeln!(self.text, "| material | BRDF | environment | product | prepare us | 100 samples us |")?;
        writeln!(self.text, "|---|---:|---:|---:|---:|---:|")?;
        for material in [
            data::measured("cc_iris_purple_gem_rgb.bsdf")?,
            data::measured("satin_rosaline_rgb.bsdf")?,
            Material::ggx(0.2),
        ] {
            let (point, bsdf) = (tilted(), Bsdf::new(&material, &tilted()));
            let (wi, values) = reflected(&self.light, &bsdf, 512);
            let of_bsdf = relative_variance(&wi, &values, |wi| Ok(f64::from(bsdf.eval_one(wi).1)))?;
            let of_light =
                relative_variance(&wi, &values, |wi| Ok(f64::from(self.light.radiance(wi)) / raster.power()))?;
            let (mut prepare, mut sample, mut of_product) = (f64::MAX, f64::MAX, 0.0);
            let (mut u, mut out, mut pdf) = ([[0.0; 2]; SAMPLES], [[0.0; 3]; SAMPLES], [0.0; SAMPLES]);
            for round in 0..200 {
                points::sobol(round, 0, &mut u);
                let start = Instant::now();
                let product = material.prepare(&self.environment, &point, &preparation, &mut memory)?;
                prepare = prepare.min(start.elapsed().as_secs_f64() * 1e6);
                let start = Instant::now();
                product.sample_n(&u, &mut out, &mut pdf)?;
                sample = sample.min(start.elapsed().as_secs_f64() * 1e6);
                if round == 0 {
                    of_product = relative_variance(&wi, &values, |wi| Ok(f64::from(product.pdf(wi.to_array())?)))?;
                }
            }
            writeln!(
                self.text,
                "| {} | {of_bsdf:.2} | {of_light:.2} | {of_product:.3} | {prepare:.1} | {sample:.1} |",
                material.name
            )?;
        }
        self.one_point_drawn()
    }

    /// The map, a BRDF and their product about one point, with 100 samples of the product.
    fn one_point_drawn(&mut self) -> Result<()> {
        let material = data::measured("cc_iris_purple_gem_rgb.bsdf")?;
        let bsdf = Bsdf::new(&material, &tilted());
        let light = self.light.on_octahedron(SIDE, 4, |world| world);
        let brdf: Vec<f32> = (0..SIDE * SIDE).map(|i| bsdf.eval_one(middle(i, SIDE)).0).collect();
        let (light_tree, brdf_tree) = (Tree::new(DEPTH, 0.0, &light)?, Tree::new(DEPTH, 0.0, &brdf)?);
        let product = light_tree.multiply(&brdf_tree, None, &mut Block::new(0))?;
        let pixels: Vec<f32> = light.iter().zip(&brdf).map(|(l, b)| l * b).collect();
        let mut points = vec![[0.0; 2]; 100];
        client::hammersley(&mut points)?;
        product.warp(&mut points, &mut (0..100).collect::<Vec<u32>>())?;
        let panels = [&light, &brdf, &pixels].map(|pixels| dotted(pixels, &points));
        self.save("point.png", &in_a_row(&panels))?;
        writeln!(
            self.text,
            "\nThe map, cc_iris_purple_gem and their product at the point, with 100 samples of the product."
        )?;
        Ok(())
    }

    /// Fig. 4.
    fn point_sets(&mut self) -> Result<()> {
        const POINTS: usize = 256;
        writeln!(self.text, "\n## Point sets (Fig. 4)\n\n{POINT_SETS}")?;
        writeln!(self.text, "| function | points | before | after | after, by mass |\n|---|---|---:|---:|---:|")?;
        let light = self.light.on_octahedron(SIDE, 4, |world| world);
        let bsdf = Bsdf::new(&Material::ggx(0.5), &tilted());
        let brdf: Vec<f32> = (0..SIDE * SIDE).map(|i| bsdf.eval_one(middle(i, SIDE)).0).collect();
        let (light_tree, brdf_tree) = (Tree::new(DEPTH, 0.0, &light)?, Tree::new(DEPTH, 0.0, &brdf)?);
        let product = light_tree.multiply(&brdf_tree, None, &mut Block::new(0))?;
        let pixels: Vec<f32> = light.iter().zip(&brdf).map(|(l, b)| l * b).collect();
        let mut panels = Vec::new();
        for (name, tree, pixels) in [("the map", &light_tree, &light), ("its product with GGX .5", &product, &pixels)] {
            let mut hammersley = vec![[0.0; 2]; POINTS];
            client::hammersley(&mut hammersley)?;
            let mut sobol = vec![[0.0; 2]; POINTS];
            points::sobol(1, 0, &mut sobol);
            let masses = Masses::new(pixels);
            for (kind, set) in
                [("random", random(7, POINTS)), ("Hammersley", hammersley), ("Owen-scrambled Sobol", sobol)]
            {
                let mut warped = set.clone();
                let mut index: Vec<u32> = (0..POINTS as u32).collect();
                tree.warp(&mut warped, &mut index)?;
                let before = discrepancy(&set, |x, y| x * y);
                let plain = discrepancy(&warped, |x, y| x * y);
                let after = discrepancy(&warped, |x, y| masses.below(x, y));
                writeln!(self.text, "| {name} | {kind} | {before:.3} | {plain:.3} | {after:.3} |")?;
                if kind != "Owen-scrambled Sobol" {
                    panels.push(dotted(pixels, &warped));
                }
            }
        }
        self.save("points.png", &in_a_row(&panels))?;
        writeln!(self.text, "\nFrom the left: the map and its product, each with random and Hammersley points.")?;
        Ok(())
    }

    /// Fig. 6.
    fn convergence(&mut self) -> Result<()> {
        const COUNTS: [usize; 10] = [1, 2, 4, 8, 16, 32, 64, 128, 256, 512];
        let scene = data::scene("spot.obj", View::Points(300))?;
        let material = Material::lambert();
        writeln!(self.text, "\n## Variance against samples (Fig. 6)\n\n{CONVERGENCE}")?;
        writeln!(
            self.text,
            "| samples | random | Hammersley | Owen-scrambled Sobol | random, lit | Hammersley | Owen-scrambled |"
        )?;
        writeln!(self.text, "|---:|---:|---:|---:|---:|---:|---:|")?;
        let preparation = self.preparation();
        let mut memory = preparation.memory()?;
        let mut errors = [[0.0; 6]; COUNTS.len()];
        for (number, point) in (0..).zip(&scene.points) {
            let bsdf = Bsdf::new(&material, point);
            let product = material.prepare(&self.environment, point, &preparation, &mut memory)?;
            let estimate = |shadows: bool, u: &[[f32; 2]]| -> Result<f64> {
                let (mut wi, mut pdf) = (vec![[0.0; 3]; u.len()], vec![0.0; u.len()]);
                product.sample_n(u, &mut wi, &mut pdf)?;
                let value = |(wi, pdf): (&[f32; 3], &f32)| {
                    let wi = Vec3::from_array(*wi);
                    let seen = *pdf > 0.0 && (!shadows || scene.visible(point, wi));
                    if seen { f64::from(bsdf.eval_one(wi).0 * self.light.radiance(wi)) / f64::from(*pdf) } else { 0.0 }
                };
                Ok(wi.iter().zip(&pdf).map(value).sum::<f64>() / u.len() as f64)
            };
            let mut many = vec![[0.0; 2]; 1 << 15];
            points::sobol(u32::MAX - number, 0, &mut many);
            let exact = [estimate(true, &many)?, estimate(false, &many)?];
            if exact[0] <= 0.0 {
                continue;
            }
            for (errors, count) in errors.iter_mut().zip(COUNTS) {
                let mut hammersley = vec![[0.0; 2]; count];
                client::hammersley(&mut hammersley)?;
                // Rotated by a random vector, or all pixels would have the same points.
                let turn = random(2 * number + 1, 1)[0];
                for u in &mut hammersley {
                    *u = [0, 1].map(|axis| (u[axis] + turn[axis]).fract());
                }
                let mut sobol = vec![[0.0; 2]; count];
                points::sobol(number, 0, &mut sobol);
                let sets = [random(2 * number, count), hammersley, sobol];
                for (i, error) in errors.iter_mut().enumerate() {
                    *error += (estimate(i < 3, &sets[i % 3])? / exact[i / 3] - 1.0).powi(2);
                }
            }
        }
        for (errors, count) in errors.iter().zip(COUNTS) {
            let errors = errors.map(|error| format!("{:.5}", error / scene.points.len() as f64)).join(" | ");
            writeln!(self.text, "| {count} | {errors} |")?;
        }
        Ok(())
    }

    /// Figs. 7 and 9.
    fn buddha(&mut self) -> Result<()> {
        const COUNTS: [usize; 6] = [1, 3, 10, 30, 60, 100];
        let scene = data::scene("buddha.obj", View::Image(STEP))?;
        let material = Material::ggx(0.2);
        let truth = truth(&scene, &self.light, &material)?;
        writeln!(self.text, "\n## A glossy buddha in Grace cathedral (Figs. 7 and 9)\n\n{BUDDHA}")?;
        writeln!(self.text, "| samples | product | us | structured, jittered | us | environment | us | BRDF | us |")?;
        writeln!(self.text, "|---:|---:|---:|---:|---:|---:|---:|---:|---:|")?;
        let light = self.light.clone();
        let (source, raster) = (Source::new(&light), Raster::new(&light));
        let mut shown = Vec::new();
        for count in COUNTS {
            let strata = source.strata(count as u32)?;
            let jitter = source.jitter(&strata, raw::WIS_JITTER_ENERGY)?;
            let lights = Lights::of(&strata);
            let of_product = by_product(&scene, &material, (&self.light, &self.environment), count, 0)?.0;
            let others = [
                picture(&scene, &material, &How::Jittered(&lights, &jitter), 0)?,
                picture(&scene, &material, &How::Importance(&raster, count), 0)?,
                picture(&scene, &material, &How::Brdf(&light, count), 0)?,
            ];
            write!(self.text, "| {count} | {:.3} | {:.1} ", of_product.error(&truth), of_product.us)?;
            for picture in &others {
                write!(self.text, "| {:.3} | {:.1} ", picture.error(&truth), picture.us)?;
            }
            writeln!(self.text, "|")?;
            if count == 30 {
                let [structured, environment, brdf] = others;
                shown = [of_product, structured, environment, brdf].map(|picture| picture.values).into();
            }
        }
        for count in [300, 1000] {
            let lights = Lights::of(&source.strata(count)?);
            let picture = picture(&scene, &material, &How::Lights(&lights), 0)?;
            writeln!(
                self.text,
                "| {count} | | | {:.3}, no jitter | {:.1} | | | | |",
                picture.error(&truth),
                picture.us
            )?;
        }
        self.save("buddha.png", &side_by_side(&scene, &truth, &shown, 1.0))?;
        writeln!(
            self.text,
            "\n30 samples, from the left: reference, product, structured, environment, BRDF; errors below."
        )?;
        Ok(())
    }

    /// What each mode keeps in memory.
    fn memory(&mut self) -> Result<()> {
        let material = data::measured("satin_rosaline_rgb.bsdf")?;
        let preparation = self.preparation();
        let mut memory = preparation.memory()?;
        let reserved = memory.bytes() as f64 / 1e3;
        let product = material.prepare(&self.environment, &tilted(), &preparation, &mut memory)?;
        let kb = |bytes: u64| bytes as f64 / 1e3;
        let table = material.table.map_or(0, |table| table.bytes() as u64);
        let peak = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let peak = peak.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or("unknown").trim();
        writeln!(
            self.text,
            "\n## Memory\n\n| what | kB |\n|---|---:|\n| environment of {} | {:.0} |\n| table of {} | {:.0} |\n\
             | product of a point | {:.1} |\n| the block that it is prepared in, one a thread | {reserved:.0} |\n\n\
             The product on the fly keeps the first three; turned maps and the product for all directions keep what stands there \
             instead of the first. Peak of this program, with all maps, meshes and pictures: {peak}.",
            self.light.name,
            kb(self.environment.info.bytes),
            material.name,
            kb(table),
            kb(product.describe()?.bytes)
        )?;
        Ok(())
    }

    fn save(&mut self, file: &str, image: &GrayImage) -> Result<()> {
        image.save(self.pictures.join(file))?;
        let folder = self.pictures.file_name().and_then(|n| n.to_str()).unwrap_or(".");
        writeln!(self.text, "\n![{file}]({folder}/{file})")?;
        Ok(())
    }
}

const ONE_POINT: &str = "Variance of one sample of each density, relative to the square of the unshadowed integral: exact sums
over the map's light on 512 x 512 directions. Times are the fastest of 200; measured BRDFs are tables (in a callback, which
takes .7 us a direction in this program, they took 66 us).
";

const POINT_SETS: &str =
    "256 points, warped by a tree of 128 x 128. Discrepancy: the largest difference, over 4096 boxes at the
origin, between the share of points and of area; after the warp also between the share of points and of the function's
mass, which is what the warp ought to keep low.
";

const CONVERGENCE: &str =
    "Spot and ground, Lambert, 300 points: the mean squared relative error of samples of the product, with
shadows and without (lit). The paper: 64 Hammersley points have less variance than 512 random ones.
For that they must be 8 times better than 64 random ones; they are 4 times, and 8 times with 128: light over density still
jumps at borders of leaves and of shadows.
";

const BUDDHA: &str =
    "GGX of roughness .2, root mean squared error over the mean, and microseconds a point, rays and this
program's scalar evaluation included. Structured sampling has as many strata as samples.
";

/// A picture by samples of the product, and the same without occlusion.
fn by_product(
    scene: &Scene,
    material: &Material,
    (light, environment): (&Light, &Environment),
    count: usize,
    pass: u32,
) -> Result<(Picture, Vec<f64>)> {
    let preparation = Preparation { world_from_map: Some(light.world_from_map()), ..Default::default() };
    let mut memory = preparation.memory()?;
    let (mut u, mut wi, mut pdf) = (vec![[0.0; 2]; count], vec![[0.0; 3]; count], vec![0.0; count]);
    let (start, mut rays) = (Instant::now(), 0);
    let (mut values, mut lit) = (Vec::with_capacity(scene.points.len()), Vec::with_capacity(scene.points.len()));
    for point in &scene.points {
        let bsdf = Bsdf::new(material, point);
        let product = material.prepare(environment, point, &preparation, &mut memory)?;
        points::sobol(client::pixel_seed(point.pixel, pass), 0, &mut u);
        product.sample_n(&u, &mut wi, &mut pdf)?;
        let (mut sum, mut open) = (0.0, 0.0);
        for (wi, &pdf) in wi.iter().map(|&wi| Vec3::from_array(wi)).zip(&pdf).filter(|(_, pdf)| **pdf > 0.0) {
            let value = f64::from(bsdf.eval_one(wi).0 * light.radiance(wi)) / f64::from(pdf);
            if value > 0.0 {
                rays += 1;
                open += value;
                sum += if scene.visible(point, wi) { value } else { 0.0 };
            }
        }
        values.push(sum / count as f64);
        lit.push(open / count as f64);
    }
    let points = scene.points.len() as f64;
    let us = start.elapsed().as_secs_f64() * 1e6 / points;
    Ok((Picture { values, rays: f64::from(rays) / points, us }, lit))
}

/// A point whose normal leans, seen from the side.
fn tilted() -> ShadingPoint {
    let normal = Vec3::new(0.3, -0.4, 0.85).normalize();
    let wo = (normal + Vec3::new(0.7, 0.2, 0.0)).normalize();
    ShadingPoint { pixel: [0, 0], hit: 0, origin: Vec3::ZERO, normal, wo }
}

/// The direction in the middle of a pixel of the octahedral square.
fn middle(i: usize, side: usize) -> Vec3 {
    let at = |c: usize| (c as f32 + 0.5) / side as f32;
    octahedral_direction(at(i % side), at(i / side))
}

/// Directions, and what is reflected from each.
fn reflected(light: &Light, bsdf: &Bsdf, side: usize) -> (Vec<Vec3>, Vec<f64>) {
    let wi = (0..side * side).map(|i| middle(i, side));
    wi.map(|wi| (wi, f64::from(bsdf.eval_one(wi).0 * light.radiance(wi)))).unzip()
}

/// The variance of value / pdf over the square of its mean.
fn relative_variance(wi: &[Vec3], values: &[f64], pdf: impl Fn(Vec3) -> Result<f64>) -> Result<f64> {
    let area = 4.0 * std::f64::consts::PI / wi.len() as f64;
    let (mut sum, mut squares) = (0.0, 0.0);
    for (&wi, &value) in wi.iter().zip(values).filter(|(_, value)| **value > 0.0) {
        sum += value * area;
        squares += value * value / pdf(wi)? * area;
    }
    Ok(squares / (sum * sum) - 1.0)
}

/// Numbers from a congruential generator.
fn random(seed: u32, count: usize) -> Vec<[f32; 2]> {
    let mut state = u64::from(seed).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678_9abc_def1;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mixed = (state ^ (state >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
        (mixed >> 40) as f32 / (1 << 24) as f32
    };
    (0..count).map(|_| [next(), next()]).collect()
}

/// The largest difference between the share of points below a corner and what it ought to be.
fn discrepancy(points: &[[f32; 2]], share: impl Fn(f64, f64) -> f64) -> f64 {
    let corners = (0..64 * 64).map(|i| [(i % 64 + 1) as f32 / 64.0, (i / 64 + 1) as f32 / 64.0]);
    let difference = |corner: [f32; 2]| {
        let below = points.iter().filter(|p| p[0] < corner[0] && p[1] < corner[1]).count();
        (below as f64 / points.len() as f64 - share(corner[0].into(), corner[1].into())).abs()
    };
    corners.map(difference).fold(0.0, f64::max)
}

/// The shares of a function's mass below points; axis 1 is that of the rows.
struct Masses(Vec<f64>);

impl Masses {
    fn new(pixels: &[f32]) -> Masses {
        let side = SIDE + 1;
        let mut sums = vec![0.0; side * side];
        for (i, &value) in pixels.iter().enumerate() {
            let (y, x) = (i / SIDE + 1, i % SIDE + 1);
            sums[y * side + x] =
                f64::from(value) + sums[(y - 1) * side + x] + sums[y * side + x - 1] - sums[(y - 1) * side + x - 1];
        }
        Masses(sums)
    }

    fn below(&self, x: f64, y: f64) -> f64 {
        let at = |c: f64| (c * SIDE as f64).round() as usize;
        self.0[at(x) * (SIDE + 1) + at(y)] / self.0[self.0.len() - 1]
    }
}

/// A function as a picture, brighter by the fourth root, with points.
fn dotted(pixels: &[f32], points: &[[f32; 2]]) -> GrayImage {
    const ZOOM: usize = 2;
    let largest = pixels.iter().fold(0.0f32, |largest, &value| largest.max(value));
    let side = (SIDE * ZOOM) as u32;
    let mut image = GrayImage::from_fn(side, side, |x, y| {
        let value = pixels[y as usize / ZOOM * SIDE + x as usize / ZOOM] / largest;
        Luma([(150.0 * value.powf(0.25)) as u8])
    });
    for point in points {
        let [y, x] = point.map(|c| ((c * side as f32) as u32).min(side - 2));
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            image.put_pixel(x + dx, y + dy, Luma([255]));
        }
    }
    image
}

fn in_a_row(panels: &[GrayImage]) -> GrayImage {
    const GAP: u32 = 4;
    let (width, height) = panels.first().map_or((1, 1), |panel| panel.dimensions());
    let mut row = GrayImage::from_pixel(panels.len() as u32 * (width + GAP), height, Luma([255]));
    for (i, panel) in (0..).zip(panels) {
        image::imageops::replace(&mut row, panel, i64::from(i * (width + GAP)), 0);
    }
    row
}
