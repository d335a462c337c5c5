//! Measured BRDFs on meshes (Figs. 8 and 12): pictures with few samples, and how noisy they are.

use crate::{STEP, by_product, in_a_row};
use anyhow::Result;
use glam::Vec3;
use image::{GrayImage, Luma};
use std::fmt::Write;
use std::path::Path;
use wis_ffi_tests::client::{self, Density, Environment, Preparation, Product, Tree};
use wis_ffi_tests::data;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::points;
use wis_ffi_tests::scene::{HEIGHT, Scene, View, WIDTH};
use wis_ffi_tests::table::Table;

const FILES: [&str; 6] = [
    "paper_white_rgb.bsdf",
    "colodur_napoli_4f_rgb.bsdf",
    "satin_rosaline_rgb.bsdf",
    "cc_ibiza_sunset_rgb.bsdf",
    "cc_iris_purple_gem_rgb.bsdf",
    "cg_sunflower_rgb.bsdf",
];

/// Writes the section and both pictures.
pub fn write(out: &mut String, folder: &Path, light: &Light, environment: &Environment) -> Result<()> {
    writeln!(out, "\n## Measured BRDFs (Figs. 8 and 12)\n\n{TEXT}")?;
    writeln!(
        out,
        "| light | samples | mesh | material | noise | noise without occlusion | us a point |\n|---|---:|---|---|---:|---:|---:|"
    )?;
    let of_buddha = row(out, "buddha.obj", 30, light, environment)?;
    let eucalyptus = data::light("rnl_cross.hdr")?;
    let other = eucalyptus.environment()?;
    let rows =
        [row(out, "dragon_vrip_res3.ply", 10, &eucalyptus, &other)?, row(out, "teapot.obj", 10, &eucalyptus, &other)?];
    of_buddha.save(folder.join("measured.png"))?;
    let (width, height) = rows[0].dimensions();
    let mut both = GrayImage::from_pixel(width, 2 * height, Luma([255]));
    for (k, row) in (0..).zip(&rows) {
        image::imageops::replace(&mut both, row, 0, i64::from(k * height));
    }
    both.save(folder.join("eucalyptus.png"))?;
    let name = folder.file_name().and_then(|name| name.to_str()).unwrap_or(".");
    writeln!(
        out,
        "\n![measured.png]({name}/measured.png)\n\nBuddha in Grace cathedral, 30 samples, from diffuse to glossy."
    )?;
    writeln!(
        out,
        "\n![eucalyptus.png]({name}/eucalyptus.png)\n\nDragon and teapot in the eucalyptus grove, 10 samples."
    )?;
    Ok(())
}

const TEXT: &str = "Samples of the product by tables of 16 elevations x 64 x 64 to 256 x 256 directions, finer for glossier ones; the estimate takes the measured
BRDF itself.
Noise: the root mean square of the difference of two runs over sqrt(2) and the mean; what is left of it without occlusion is
the product's own. Times with rays and this program's evaluation of the BRDF. The paper shows eight materials with 30 samples
at 400 x 800 in about a minute, and twelve on two cars with 10 samples at 4000 x 1600 in 804 s; six of ours are public.
The glossiest, cg_sunflower, keeps some bright pixels: its lobe is narrower than the pixels of a 256 x 256 slice, which are
too low at its peak.
";

/// A row of pictures of a mesh in all materials.
fn row(out: &mut String, mesh: &str, count: usize, light: &Light, environment: &Environment) -> Result<GrayImage> {
    let scene = data::scene(mesh, View::Image(STEP))?;
    let mut panels = Vec::new();
    for file in FILES {
        let material = data::measured(file)?;
        let runs = [0, 1].map(|pass| by_product(&scene, &material, (light, environment), count, pass));
        let [(first, lit), (second, other)] = match runs {
            [Ok(a), Ok(b)] => [a, b],
            [Err(error), _] | [_, Err(error)] => return Err(error),
        };
        let noise = |a: &[f64], b: &[f64]| {
            let mean = a.iter().sum::<f64>() / a.len() as f64;
            let squares = a.iter().zip(b).map(|(x, y)| (x - y).powi(2)).sum::<f64>() / (2.0 * a.len() as f64);
            squares.sqrt() / mean
        };
        writeln!(
            out,
            "| {} | {count} | {} | {} | {:.3} | {:.3} | {:.0} |",
            light.name,
            scene.name,
            material.name,
            noise(&first.values, &second.values),
            noise(&lit, &other),
            first.us
        )?;
        panels.push(panel(&scene, &first.values));
    }
    Ok(in_a_row(&panels))
}

/// A picture with a mean of .4, gamma-corrected.
pub fn panel(scene: &Scene, values: &[f64]) -> GrayImage {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let mut panel = GrayImage::from_pixel(WIDTH / STEP, HEIGHT / STEP, Luma([30]));
    for (point, value) in scene.points.iter().zip(values) {
        let tone = (0.4 * value / mean).min(1.0).powf(1.0 / 2.2);
        panel.put_pixel(point.pixel[0] / STEP, point.pixel[1] / STEP, Luma([(255.0 * tone).round() as u8]));
    }
    panel
}

/// Fig. 10 in pictures: BRDFs of a share of their wavelets, the largest wherever they are.
pub fn sparsity(out: &mut String, folder: &Path, light: &Light, environment: &Environment) -> Result<()> {
    const SHARES: [f64; 4] = [0.005, 0.01, 0.02, 0.05];
    const COUNT: usize = 30;
    let scene = data::scene("buddha.obj", View::Image(STEP))?;
    let material = data::measured("satin_rosaline_rgb.bsdf")?;
    let Some(table) = material.table else { return Ok(()) };
    let exact = by_table(&scene, (light, environment), table, COUNT)?;
    let mut panels = Vec::new();
    let mut errors = Vec::new();
    for share in SHARES {
        let kept = table.slices().iter().map(|slice| {
            let keep = (share * f64::from(1u32 << (2 * slice.info.depth))) as u32;
            Tree::of_wavelets(slice.info.average, &slice.largest(keep)?, 0.0)
        });
        let sparse = Table::of(kept.collect::<client::Result<Vec<Tree>>>()?);
        let values = by_table(&scene, (light, environment), &sparse, COUNT)?;
        let (squares, mean) = exact.iter().zip(&values).fold((0.0, 0.0), |(q, m), (e, v)| (q + (e - v).powi(2), m + e));
        let count = exact.len() as f64;
        errors.push(format!("{:.3}", (squares / count).sqrt() / (mean / count)));
        panels.push(panel(&scene, &values));
    }
    panels.push(panel(&scene, &exact));
    in_a_row(&panels).save(folder.join("sparsity.png"))?;
    let name = folder.file_name().and_then(|name| name.to_str()).unwrap_or(".");
    writeln!(
        out,
        "\n![sparsity.png]({name}/sparsity.png)\n\n{} drawn with .5, 1, 2 and 5 % of the wavelets of each slice (free thresholding, \
         `wis_tree_of_wavelets`), and with all, {COUNT} samples each. Difference to the last, relative: {}.",
        material.name,
        errors.join(", ")
    )?;
    Ok(())
}

/// A picture in which the table is the BRDF.
fn by_table(
    scene: &Scene,
    (light, environment): (&Light, &Environment),
    table: &Table,
    count: usize,
) -> Result<Vec<f64>> {
    let preparation = Preparation { world_from_map: Some(light.world_from_map()), ..Default::default() };
    let mut memory = preparation.memory()?;
    let (mut u, mut wi, mut pdf) = (vec![[0.0; 2]; count], vec![[0.0; 3]; count], vec![0.0; count]);
    let mut f_cos = vec![[0.0; 3]; count];
    let mut values = Vec::with_capacity(scene.points.len());
    for point in &scene.points {
        let query = client::query(point.normal.to_array(), point.wo.to_array(), &[client::tabulated([1.0; 3])]);
        let product = Product::prepare_table(environment, &table.raw(), &query, &preparation, &mut memory)?;
        points::sobol(client::pixel_seed(point.pixel, 0), 0, &mut u);
        product.sample_n(&u, &mut wi, &mut pdf)?;
        client::table_eval(&table.raw(), &query, &wi, &mut f_cos)?;
        let each = wi.iter().zip(&pdf).zip(&f_cos).map(|((wi, pdf), f)| {
            let wi = Vec3::from_array(*wi);
            let seen = *pdf > 0.0 && f[0] > 0.0 && scene.visible(point, wi);
            if seen { f64::from(f[0] * light.radiance(wi) / pdf) } else { 0.0 }
        });
        values.push(each.sum::<f64>() / count as f64);
    }
    Ok(values)
}
