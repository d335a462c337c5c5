//! Measured BRDFs on meshes (Figs. 8, 10 and 12): pictures with few samples, and how noisy they are.

use crate::compression::{PLACES, range};
use crate::{Lit, by_product, in_colour, middle, tilted};
use anyhow::Result;
use glam::Vec3;
use std::f64::consts::SQRT_2;
use std::fmt::Write;
use wis_ffi_tests::client::{self, Density, Tree};
use wis_ffi_tests::data;
use wis_ffi_tests::images::Sheet;
use wis_ffi_tests::material::Bsdf;
use wis_ffi_tests::paper::Paper;
use wis_ffi_tests::points;
use wis_ffi_tests::scene::{Scene, ShadingPoint, View};
use wis_ffi_tests::table::Table;

/// Columns and rows of pixels from one measured point to the next.
const STEP: u32 = 3;
/// Noise of the product itself that counts as practically noise-free, and how much noisier the noisiest material may be
/// than the quietest to be handled equally well.
const QUIET: f64 = 0.1;
const EQUALLY: f64 = 2.0;
/// Samples of the paper's pictures, whose noise hides smaller differences, and of pictures that show the differences.
const FEW: usize = 30;
const MANY: usize = 256;
/// Directions along an axis of the square on which a lobe's peak is looked for.
const FINE: usize = 1024;

/// The paper's smaller table: slices and depth.
const SLICES: u32 = 16;
const DEPTH: u32 = 6;
/// The material of the pictures of sparse tables.
const SHOWN: &str = "satin_rosaline_rgb";

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
    writeln!(page.text, "\n### Pictures of sparse tables")?;
    sparsity(page, lit)?;
    two_percent(page, lit)?;
    writeln!(page.text, "\n## Measured BRDFs (Figs. 8 and 12)\n\n{TEXT}")?;
    let peaks = peaks(page)?;
    writeln!(page.text, "\n| light | samples | mesh | material | noise | noise, unoccluded | us a point |")?;
    writeln!(page.text, "|---|---:|---|---|---:|---:|---:|")?;
    let (mut buddha, mut others) = (Sheet::new(3, 2, 1.0), Sheet::new(3, 4, 1.0));
    let of_buddha = rows(page, &mut buddha, 0, ("buddha.obj", FEW), lit)?;
    let eucalyptus = Lit::load("rnl_cross.hdr")?;
    let of_others = [
        rows(page, &mut others, 0, ("dragon_vrip_res3.ply", 10), &eucalyptus)?,
        rows(page, &mut others, 2, ("teapot.obj", 10), &eucalyptus)?,
    ]
    .concat();
    page.save("measured.png", &buddha)?;
    page.save("eucalyptus.png", &others)?;
    let ([low, high], [least, most]) = (range(&of_buddha), range(&of_others));
    page.claims.add(
        "measured BRDFs from diffuse to glossy are practically noise-free with 30 samples (Fig. 8)",
        "pictures",
        format!("noise without occlusion {low:.3} to {high:.3}; allowed {QUIET}"),
        high <= QUIET,
        &noisiest(&of_buddha, &peaks),
    );
    page.claims.add(
        "glossy materials are handled equally well as diffuse ones with 10 samples (Fig. 12)",
        "a picture",
        format!("noise without occlusion {least:.3} to {most:.3}, a factor of {:.1}", most / least),
        most <= EQUALLY * least,
        &noisiest(&of_others, &peaks),
    );
    Ok(())
}

/// The noisiest material of some runs over all materials, the factor without it, and its table's share of the peak if that is
/// the smallest.
fn noisiest(noises: &[f64], peaks: &[Peak]) -> String {
    let worst = (0..noises.len()).max_by(|a, b| noises[*a].total_cmp(&noises[*b])).unwrap_or(0) % FILES.len();
    let others = |i: &usize| i % FILES.len() != worst;
    let rest: Vec<f64> = (0..noises.len()).filter(others).map(|i| noises[i]).collect();
    let shares: Vec<f64> = (0..peaks.len()).filter(others).map(|i| peaks[i].share).collect();
    let ([quiet, loud], [low, high]) = (range(&rest), range(&shares));
    let peak = &peaks[worst];
    let mut cause = format!("{} is the noisiest; without it the noise is {quiet:.3} to {loud:.3}", peak.name);
    if peak.share < low {
        let [share, low, high] = [peak.share, low, high].map(|share| format!("{:.0} %", 100.0 * share));
        cause += &format!(
            ". Its pixels are too coarse: its table reaches {share} of the BRDF's peak, the others {low} to {high}"
        );
    }
    cause
}

/// The lobe of a material.
struct Peak {
    name: String,
    /// What the table has of it.
    share: f64,
}

/// Writes how narrow the lobes are, seen at 45 degrees, and what their tables have of their peaks.
fn peaks(page: &mut Paper) -> Result<Vec<Peak>> {
    let point = ShadingPoint { normal: Vec3::Z, wo: Vec3::new(1.0, 0.0, 1.0).normalize(), ..tilted() };
    let wi: Vec<Vec3> = (0..FINE * FINE).map(|i| middle(i, FINE)).filter(|wi| wi.z > 0.0).collect();
    writeln!(page.text, "| material | peak over mean | peak of the table over peak |\n|---|---:|---:|")?;
    let mut peaks = Vec::new();
    for file in FILES {
        let material = data::measured(file)?;
        let bsdf = Bsdf::new(&material, &point);
        let values: Vec<f32> = wi.iter().map(|&wi| bsdf.eval_one(wi).0).collect();
        let highest = (0..wi.len()).max_by(|a, b| values[*a].total_cmp(&values[*b])).unwrap_or(0);
        let (peak, mean) =
            (f64::from(values[highest]), values.iter().copied().map(f64::from).sum::<f64>() / values.len() as f64);
        let mut f_cos = [0.0];
        if let Some(table) = material.table {
            table.eval(point.normal, point.wo, &[wi[highest].to_array()], &mut f_cos)?;
        }
        let share = f64::from(f_cos[0]) / peak;
        writeln!(page.text, "| {} | {:.1} | {share:.2} |", material.name, peak / mean)?;
        peaks.push(Peak { name: short(&material.name).into(), share });
    }
    Ok(peaks)
}

const TEXT: &str = "Samples of the product of rotated map and BRDF, 64 x 64 pixels each. The estimate
evaluates the measured BRDF itself, in luminance. Noise: the root mean square of the difference of two runs over sqrt 2 and the
mean. Unoccluded, only the product's own noise is left. Microseconds of processor time with rays and this program's evaluation of the BRDF.
The paper shows eight materials with 30 samples at 400 x 800 in about a minute. Twelve on two cars with 10 samples at 4000 x
1600 take it 804 s. Here two meshes in six materials stand in for the cars. Materials of a picture follow the first table, from
top left. Its peak and mean are those of BRDF x cosine over the hemisphere, seen at 45 degrees.
";

/// Pictures of a mesh in all materials in two rows of a sheet, and the noise of each without occlusion.
fn rows(page: &mut Paper, sheet: &mut Sheet, first: u32, (mesh, count): (&str, usize), lit: &Lit) -> Result<Vec<f64>> {
    let (thin, whole) = (data::scene(mesh, View::Image(STEP))?, data::scene(mesh, View::Image(1))?);
    let mut noises = Vec::new();
    for (i, file) in (0..).zip(FILES) {
        let material = data::measured(file)?;
        let run = |pass: u32| by_product(&thin, &material, (&lit.light, &lit.map), count, pass);
        let [(one, open), (two, other)] = [run(0)?, run(1)?];
        let noise = |a: &[f64], b: &[f64]| difference(a, b) / SQRT_2;
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

/// A table of a share of the wavelets of each slice, the largest wherever they are.
fn sparse(table: &Table, share: f64) -> Result<Table> {
    let kept = table.slices().iter().map(|slice| {
        let keep = (share * f64::from(1u32 << (2 * slice.info.depth))) as u32;
        Tree::of_wavelets(slice.info.average, &slice.largest(keep)?, 0.0)
    });
    Ok(Table::of(kept.collect::<client::Result<Vec<Tree>>>()?))
}

/// The table of the paper's size with all wavelets.
fn table_of(value: &data::Value) -> Result<Table> {
    Ok(Table::new(SLICES, DEPTH, 0.0, PLACES, value)?)
}

/// The root mean squared difference of two pictures over the mean of the first.
fn difference(exact: &[f64], picture: &[f64]) -> f64 {
    let (squares, sum) = exact.iter().zip(picture).fold((0.0, 0.0), |(q, m), (e, v)| (q + (e - v).powi(2), m + e));
    let count = exact.len() as f64;
    (squares / count).sqrt() / (sum / count)
}

/// Fig. 10 in pictures: a BRDF of a share of its wavelets.
fn sparsity(page: &mut Paper, lit: &Lit) -> Result<()> {
    const SHARES: [f64; 4] = [0.005, 0.01, 0.02, 0.05];
    let scene = data::scene("buddha.obj", View::Image(1))?;
    let Some(brdf) = data::all_brdfs()?.into_iter().find(|brdf| brdf.name == SHOWN) else { return Ok(()) };
    let table = table_of(&brdf.value)?;
    let exact = by_table(&scene, lit, &table, FEW)?;
    let mut sheet = Sheet::new(3, 2, 1.0);
    for (i, share) in (0..).zip(SHARES) {
        let picture = by_table(&scene, lit, &sparse(&table, share)?, FEW)?;
        let name = format!("{:.1} %, differs by {:.3}", 100.0 * share, difference(&exact.0, &picture.0));
        draw(&mut sheet, [i % 3, i / 3], &scene, &picture, &name);
    }
    draw(&mut sheet, [1, 1], &scene, &exact, "all wavelets");
    page.save("sparsity.png", &sheet)?;
    writeln!(
        page.text,
        "\n{SHOWN} drawn with shares of the wavelets of each 64 x 64 slice (free thresholding, `WIS_TREE_WAVELETS`), and\n\
         with all, {FEW} samples each. The differences have their noise."
    )?;
    Ok(())
}

/// The same of all materials that are rendered, in numbers, against the BRDF itself.
fn two_percent(page: &mut Paper, lit: &Lit) -> Result<()> {
    let scene = data::scene("buddha.obj", View::Image(STEP))?;
    writeln!(
        page.text,
        "\nRoot mean squared differences over the mean, of pictures with {MANY} samples a point. Noise: that of {FEW} samples.\n\n\
         | material | 2 % of the wavelets against the BRDF | all against the BRDF | 2 % against all | noise |\n|---|---:|---:|---:|---:|"
    )?;
    let mut rows = Vec::new();
    for brdf in data::all_brdfs()?.iter().filter(|brdf| FILES.iter().any(|file| file.starts_with(&brdf.name))) {
        let material = data::measured(&format!("{}.bsdf", brdf.name))?;
        let run = |count, pass| by_product(&scene, &material, (&lit.light, &lit.map), count, pass);
        let [exact, one, two] = [run(MANY, 2)?, run(FEW, 0)?, run(FEW, 1)?].map(|(picture, _)| picture.values);
        let noise = difference(&one, &two) / SQRT_2;
        let table = table_of(&brdf.value)?;
        let [all, kept] = [&table, &sparse(&table, 0.02)?].map(|table| by_table(&scene, lit, table, MANY));
        let (all, kept) = (all?.0, kept?.0);
        let row = [difference(&exact, &kept), difference(&exact, &all), difference(&all, &kept), noise];
        writeln!(page.text, "| {} | {} |", brdf.name, row.map(|d| format!("{d:.3}")).join(" | "))?;
        rows.push(row);
    }
    let alike = |k: usize| rows.iter().filter(|row| row[k] <= row[3]).count();
    let column = |k: usize| range(&rows.iter().map(|row| row[k]).collect::<Vec<_>>());
    let ([low, high], [least, most]) = (column(0), column(2));
    page.claims.add(
        "pictures with 2 % of the coefficients at 64 x 64 are indistinguishable from a reference (Fig. 10)",
        "for most measured BRDFs; 1 to 2 % in practice",
        format!(
            "{} of {} materials differ by less than the noise of {FEW} samples; all by {low:.3} to {high:.3}, from all coefficients by {least:.3} to {most:.3}",
            alike(0),
            rows.len()
        ),
        2 * alike(0) > rows.len(),
        &format!(
            "with all coefficients of 64 x 64 it is {} materials; 2 % against all coefficients, {}",
            alike(1),
            alike(2)
        ),
    );
    Ok(())
}

/// A picture in which the table is the BRDF: luminance, and red, green and blue.
fn by_table(scene: &Scene, lit: &Lit, table: &Table, count: usize) -> Result<(Vec<f64>, Vec<[f32; 3]>)> {
    let (mut u, mut wi, mut pdf) = (vec![[0.0; 2]; count], vec![[0.0; 3]; count], vec![0.0; count]);
    let mut f_cos = vec![0.0; count];
    let (mut values, mut colours) = (Vec::new(), Vec::new());
    for point in &scene.points {
        let mirror = (2.0 * point.normal.dot(point.wo) * point.normal - point.wo).normalize();
        let eval = |wi: &[[f32; 3]], f_cos: &mut [f32]| {
            table.eval(point.normal, point.wo, wi, f_cos).expect("a table");
        };
        let product = lit.map.product(mirror, eval)?;
        points::sobol(client::pixel_seed(point.pixel, 0), 0, &mut u);
        product.sample_n(&u, &mut wi, &mut pdf)?;
        table.eval(point.normal, point.wo, &wi, &mut f_cos)?;
        let (mut sum, mut rgb) = (0.0, [0.0; 3]);
        for ((wi, pdf), f) in wi.iter().zip(&pdf).zip(&f_cos) {
            let wi = Vec3::from_array(*wi);
            if *pdf > 0.0 && *f > 0.0 && scene.visible(point, wi) {
                let share = f / pdf / count as f32;
                sum += f64::from(share * lit.light.radiance(wi));
                rgb.iter_mut().zip(&lit.colours).for_each(|(sum, c)| *sum += share * c.radiance(wi));
            }
        }
        values.push(sum);
        colours.push(rgb);
    }
    Ok((values, colours))
}
