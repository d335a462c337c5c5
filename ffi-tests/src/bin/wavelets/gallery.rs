//! Measured BRDFs on meshes (Figs. 8, 10 and 12): pictures with few samples, and how noisy they are.

use crate::{Lit, by_product, in_colour};
use anyhow::Result;
use glam::Vec3;
use std::fmt::Write;
use wis_ffi_tests::client::{self, Density, Product, Tree};
use wis_ffi_tests::data;
use wis_ffi_tests::images::Sheet;
use wis_ffi_tests::paper::Paper;
use wis_ffi_tests::points;
use wis_ffi_tests::scene::{Scene, View};
use wis_ffi_tests::table::Table;

/// Columns and rows of pixels from one measured point to the next.
const STEP: u32 = 3;
/// Noise of the product itself that counts as practically noise-free, and how much noisier the noisiest material may be
/// than the quietest to be handled equally well.
const QUIET: f64 = 0.1;
const EQUALLY: f64 = 2.0;
/// The difference that sparse tables may make.
const INDISTINGUISHABLE: f64 = 0.05;

const FILES: [&str; 6] = [
    "paper_white_rgb.bsdf",
    "colodur_napoli_4f_rgb.bsdf",
    "satin_rosaline_rgb.bsdf",
    "cc_ibiza_sunset_rgb.bsdf",
    "cc_iris_purple_gem_rgb.bsdf",
    "cg_sunflower_rgb.bsdf",
];

/// Writes the sections and pictures.
pub fn write(page: &mut Paper, lit: &Lit) -> Result<()> {
    sparsity(page, lit)?;
    writeln!(page.text, "\n## Measured BRDFs (Figs. 8 and 12)\n\n{TEXT}")?;
    writeln!(page.text, "| light | samples | mesh | material | noise | noise, unoccluded | us a point |")?;
    writeln!(page.text, "|---|---:|---|---|---:|---:|---:|")?;
    let (mut buddha, mut others) = (Sheet::new(3, 2, 1.0), Sheet::new(3, 4, 1.0));
    let of_buddha = rows(page, &mut buddha, 0, ("buddha.obj", 30), lit)?;
    let eucalyptus = Lit::load("rnl_cross.hdr")?;
    let of_others = [
        rows(page, &mut others, 0, ("dragon_vrip_res3.ply", 10), &eucalyptus)?,
        rows(page, &mut others, 2, ("teapot.obj", 10), &eucalyptus)?,
    ]
    .concat();
    page.save("measured.png", &buddha)?;
    page.save("eucalyptus.png", &others)?;
    let range = |values: &[f64]| values.iter().fold([f64::INFINITY, 0.0], |[a, b]: [f64; 2], x| [x.min(a), x.max(b)]);
    let ([low, high], [least, most]) = (range(&of_buddha), range(&of_others));
    page.claims.add(
        "measured BRDFs from diffuse to glossy are practically noise-free with 30 samples (Fig. 8)",
        "pictures",
        format!("noise without occlusion {low:.3} to {high:.3}; allowed {QUIET}"),
        high <= QUIET,
        "the glossiest (cg_sunflower) has a lobe narrower than the pixels of a 256 x 256 slice, which are too low at its peak",
    );
    page.claims.add(
        "glossy materials are handled equally well as diffuse ones with 10 samples (Fig. 12)",
        "a picture",
        format!("noise without occlusion {least:.3} to {most:.3}, a factor of {:.1}", most / least),
        most <= EQUALLY * least,
        "as above: the noise grows with the glossiness, row by row of the table",
    );
    Ok(())
}

const TEXT: &str = "Samples of the product by tables of 16 elevations x 64 x 64 to 256 x 256 directions, finer for glossier ones. The estimate
evaluates the measured BRDF itself, in luminance. Noise: the root mean square of the difference of two runs over sqrt 2 and the
mean. Unoccluded, only the product's own noise is left. Microseconds of processor time with rays and this program's evaluation of the BRDF.
The paper shows eight materials with 30 samples at 400 x 800 in about a minute. Twelve on two cars with 10 samples at 4000 x
1600 take it 804 s; here two meshes in six materials stand in for the cars. From top left, materials go from diffuse to glossy.
";

/// Pictures of a mesh in all materials in two rows of a sheet, and the noise of each without occlusion.
fn rows(page: &mut Paper, sheet: &mut Sheet, first: u32, (mesh, count): (&str, usize), lit: &Lit) -> Result<Vec<f64>> {
    let (thin, whole) = (data::scene(mesh, View::Image(STEP))?, data::scene(mesh, View::Image(1))?);
    let mut noises = Vec::new();
    for (i, file) in (0..).zip(FILES) {
        let material = data::measured(file)?;
        let run = |pass: u32| by_product(&thin, &material, (&lit.light, &lit.environment), count, pass);
        let [(one, open), (two, other)] = [run(0)?, run(1)?];
        let noise = |a: &[f64], b: &[f64]| {
            let mean = a.iter().sum::<f64>() / a.len() as f64;
            let squares = a.iter().zip(b).map(|(x, y)| (x - y).powi(2)).sum::<f64>() / (2.0 * a.len() as f64);
            squares.sqrt() / mean
        };
        let unoccluded = noise(&open, &other);
        writeln!(
            page.text,
            "| {} | {count} | {} | {} | {:.3} | {unoccluded:.3} | {:.0} |",
            lit.light.name,
            thin.name,
            material.name,
            noise(&one.values, &two.values),
            one.us
        )?;
        noises.push(unoccluded);
        draw(sheet, [i % 3, first + i / 3], &whole, &in_colour(&whole, &material, lit, count)?, short(&material.name));
    }
    Ok(noises)
}

fn short(name: &str) -> &str {
    name.strip_suffix("_rgb").unwrap_or(name)
}

/// Draws a picture with a mean of its own.
fn draw(sheet: &mut Sheet, at: [u32; 2], scene: &Scene, (values, rgb): &(Vec<f64>, Vec<[f32; 3]>), name: &str) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let scaled: Vec<[f32; 3]> = rgb.iter().map(|rgb| rgb.map(|c| c / mean as f32)).collect();
    sheet.picture(at, scene, &scaled, name);
}

/// Fig. 10 in pictures: BRDFs of a share of their wavelets, the largest wherever they are.
fn sparsity(page: &mut Paper, lit: &Lit) -> Result<()> {
    const SHARES: [f64; 4] = [0.005, 0.01, 0.02, 0.05];
    const COUNT: usize = 30;
    let scene = data::scene("buddha.obj", View::Image(1))?;
    let material = data::measured("satin_rosaline_rgb.bsdf")?;
    let Some(table) = material.table else { return Ok(()) };
    let exact = by_table(&scene, lit, table, COUNT)?;
    let (mut sheet, mut off) = (Sheet::new(3, 2, 1.0), Vec::new());
    for (i, share) in (0..).zip(SHARES) {
        let kept = table.slices().iter().map(|slice| {
            let keep = (share * f64::from(1u32 << (2 * slice.info.depth))) as u32;
            Tree::of_wavelets(slice.info.average, &slice.largest(keep)?, 0.0)
        });
        let sparse = Table::of(kept.collect::<client::Result<Vec<Tree>>>()?);
        let picture = by_table(&scene, lit, &sparse, COUNT)?;
        let pairs = exact.0.iter().zip(&picture.0);
        let (squares, sum) = pairs.fold((0.0, 0.0), |(q, m), (e, v)| (q + (e - v).powi(2), m + e));
        let count = exact.0.len() as f64;
        off.push((squares / count).sqrt() / (sum / count));
        draw(
            &mut sheet,
            [i % 3, i / 3],
            &scene,
            &picture,
            &format!("{:.1} %, differs by {:.3}", 100.0 * share, off[i as usize]),
        );
    }
    draw(&mut sheet, [1, 1], &scene, &exact, "all wavelets");
    writeln!(
        page.text,
        "\n### Pictures of sparse tables\n\n{} drawn with shares of the wavelets of each slice (free thresholding, \
         `wis_tree_of_wavelets`), and with all, {COUNT} samples each.",
        material.name
    )?;
    page.save("sparsity.png", &sheet)?;
    page.claims.add(
        "pictures with 2 % of the coefficients at 64 x 64 are indistinguishable from a reference (Fig. 10)",
        "yes; 1 to 2 % in practice",
        format!("{} differs by {:.3} with 2 %, {:.3} with 1 %", material.name, off[2], off[1]),
        off[2] <= INDISTINGUISHABLE,
        "",
    );
    Ok(())
}

/// A picture in which the table is the BRDF: luminance, and red, green and blue.
fn by_table(scene: &Scene, lit: &Lit, table: &Table, count: usize) -> Result<(Vec<f64>, Vec<[f32; 3]>)> {
    let preparation = lit.preparation();
    let mut memory = preparation.memory()?;
    let (mut u, mut wi, mut pdf) = (vec![[0.0; 2]; count], vec![[0.0; 3]; count], vec![0.0; count]);
    let mut f_cos = vec![[0.0; 3]; count];
    let (mut values, mut colours) = (Vec::new(), Vec::new());
    for point in &scene.points {
        let query = client::query(point.normal.to_array(), point.wo.to_array(), &[client::tabulated([1.0; 3])]);
        let product = Product::prepare_table(&lit.environment, &table.raw(), &query, &preparation, &mut memory)?;
        points::sobol(client::pixel_seed(point.pixel, 0), 0, &mut u);
        product.sample_n(&u, &mut wi, &mut pdf)?;
        client::table_eval(&table.raw(), &query, &wi, &mut f_cos)?;
        let (mut sum, mut rgb) = (0.0, [0.0; 3]);
        for ((wi, pdf), f) in wi.iter().zip(&pdf).zip(&f_cos) {
            let wi = Vec3::from_array(*wi);
            if *pdf > 0.0 && f[0] > 0.0 && scene.visible(point, wi) {
                let share = f[0] / pdf / count as f32;
                sum += f64::from(share * lit.light.radiance(wi));
                rgb.iter_mut().zip(&lit.colours).for_each(|(sum, c)| *sum += share * c.radiance(wi));
            }
        }
        values.push(sum);
        colours.push(rgb);
    }
    Ok((values, colours))
}
