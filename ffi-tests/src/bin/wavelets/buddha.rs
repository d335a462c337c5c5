//! A glossy buddha on a diffuse floor in Grace cathedral (Figs. 7 and 9).

use crate::{Lit, by_product, in_colour};
use anyhow::Result;
use std::fmt::Write;
use wis_ffi_tests::client::raw;
use wis_ffi_tests::data;
use wis_ffi_tests::images::Sheet;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::paper::{Paper, Verdict, columns};
use wis_ffi_tests::product::Rotations;
use wis_ffi_tests::scene::{Scene, View};
use wis_ffi_tests::structured::{How, Lights, Picture, Raster, Source, coloured, picture, truth};

const COUNTS: [usize; 6] = [1, 3, 10, 30, 60, 100];
/// Strata without jitter.
const STRATA: [u32; 3] = [300, 1000, 3000];
/// Columns and rows of pixels from one measured point to the next.
const STEP: u32 = 2;
/// How much larger an error may be that counts as similar.
const SIMILAR: f64 = 1.1;
/// How many times as long a sample of the product takes in the paper, with many.
const TWICE: f64 = 2.0;
/// How many times further behind jittered strata the BRDF is on the floor than on the buddha, if it is "very poor" there.
const VERY: f64 = 3.0;
/// log2 of the pixels along an axis of the trees of Fig. 7.
const FINER: u32 = 7;
/// Microseconds that a ray takes more in scenes of the paper's time. Its strata take 103 s with 100 samples: 4 us a sample, were the picture
/// of 500 x 500 points.
const RAY: f64 = 1.0;
/// Samples of the pictures.
const SHOWN: usize = 30;
/// The error over the mean that is drawn in the lightest colour.
const LIGHTEST: f64 = 0.5;

/// The two parts of the scene, each under the tracer of all of it.
struct Part {
    scene: Scene,
    material: Material,
    truth: Vec<f64>,
}

/// The points of the floor, or those of the buddha.
fn scene(floor: bool, step: u32) -> Result<Scene> {
    let mut scene = data::scene("buddha.obj", View::Image(step))?;
    scene.points.retain(|point| point.is_ground() == floor);
    Ok(scene)
}

fn parts(lit: &Lit) -> Result<[Part; 2]> {
    let part = |floor: bool, material: Material| -> Result<Part> {
        let scene = scene(floor, STEP)?;
        let truth = truth(&scene, &lit.light, &material)?;
        Ok(Part { scene, material, truth })
    };
    Ok([part(false, Material::ggx(0.2))?, part(true, Material::lambert())?])
}

/// Errors over the mean of all: of buddha, floor and both; and microseconds of a point.
#[derive(Clone, Copy)]
struct Row {
    errors: [f64; 3],
    us: f64,
    rays: f64,
}

impl Row {
    /// Microseconds where rays are as slow as in the paper.
    fn slow(&self) -> f64 {
        self.us + RAY * self.rays
    }
}

fn row(parts: &[Part; 2], of: impl FnMut(&Part) -> Result<Picture>) -> Result<Row> {
    let pictures = parts.iter().map(of).collect::<Result<Vec<_>>>()?;
    let count = |k: usize| parts[k].truth.len() as f64;
    let mean =
        |of: fn(&Picture) -> f64| (count(0) * of(&pictures[0]) + count(1) * of(&pictures[1])) / (count(0) + count(1));
    let (us, rays) = (mean(|picture| picture.us), mean(|picture| picture.rays));
    let values = pictures.iter().flat_map(|picture| picture.values.clone()).collect();
    let all = Picture { values, rays, us }.error(&parts.each_ref().map(|part| part.truth.as_slice()).concat());
    let [buddha, floor] = [0, 1].map(|k| pictures[k].error(&parts[k].truth));
    Ok(Row { errors: [buddha, floor, all], us, rays })
}

/// Writes the section.
pub fn write(page: &mut Paper, lit: &Lit) -> Result<()> {
    let parts = parts(lit)?;
    page.heading("A glossy buddha on a diffuse floor in Grace cathedral (Figs. 7 and 9)")?;
    let names = ["product", "structured, jittered", "environment", "BRDF"];
    let heads = names.map(|name| format!("{name}: buddha | floor | all | us")).join(" | ");
    columns(&mut page.text, 0, &format!("samples | {heads}"))?;
    let (source, raster) = (Source::new(&lit.light), Raster::new(&lit.light));
    let mut rows = Vec::new();
    for count in COUNTS {
        let strata = source.strata(count as u32)?;
        let jitter = source.jitter(&strata, raw::WIS_JITTER_ENERGY)?;
        let lights = Lights::of(&strata);
        let by = |how: How| row(&parts, |part| Ok(picture(&part.scene, &part.material, &how, 0)?));
        let all = [
            row(&parts, |part| by_product(&part.scene, &part.material, &lit.integrated, count))?,
            by(How::Jittered(&lights, &jitter))?,
            by(How::Importance(&raster, count))?,
            by(How::Brdf(&lit.light, count))?,
        ];
        let cell =
            |row: Row| format!("{:.3} | {:.3} | {:.3} | {:.1}", row.errors[0], row.errors[1], row.errors[2], row.us);
        writeln!(page.text, "| {count} | {} |", all.map(cell).join(" | "))?;
        rows.push(all);
    }
    writeln!(page.text)?;
    columns(&mut page.text, 0, "strata without jitter | buddha | floor | all | us")?;
    let mut plain = Vec::new();
    for count in STRATA {
        let lights = Lights::of(&source.strata(count)?);
        let row = row(&parts, |part| Ok(picture(&part.scene, &part.material, &How::Lights(&lights), 0)?))?;
        let [buddha, floor, all] = row.errors;
        writeln!(page.text, "| {count} | {buddha:.3} | {floor:.3} | {all:.3} | {:.1} |", row.us)?;
        plain.push((count, row));
    }
    claims(page, &rows, &plain);
    glossier(page, lit)
}

fn claims(page: &mut Paper, rows: &[[Row; 4]], plain: &[(u32, Row)]) {
    let [one, ten, thirty, hundred] = [0, 2, 3, 5].map(|i| &rows[i]);
    let all = |row: &Row| row.errors[2];
    let goal = SIMILAR * all(&hundred[1]);
    let enough = COUNTS.iter().zip(rows).find(|(_, row)| all(&row[0]) <= goal).map(|(count, _)| count);
    let [few, more, jittered] = [all(&ten[0]), all(&thirty[0]), all(&hundred[1])];
    let others =
        plain.iter().map(|(count, row)| format!("{count} plain {:.3}", all(row))).collect::<Vec<_>>().join(", ");
    let suffice = enough.map_or("none".into(), usize::to_string);
    page.claim(
        "10 to 30 samples",
        enough.is_some_and(|count| *count <= 30),
        &[&few, &more, &jittered, &others, &(few / jittered), &(more / jittered), &suffice],
    );
    let rivals = |k: usize| [thirty[3].errors[k], thirty[1].errors[k]];
    let [[of_buddha, strata], [of_floor, below]] = [rivals(0), rivals(1)];
    page.claim(
        "sampling the BRDF does",
        of_buddha / strata * VERY <= of_floor / below,
        &[&of_buddha, &(of_buddha / strata), &of_floor, &(of_floor / below)],
    );
    let [a, b, c, d] = [&thirty[3], &thirty[1], &hundred[3], &hundred[1]].map(all);
    page.claim("overall, sampling the BRDF", a > b && c > d, &[&a, &b, &c, &d]);
    let ratio = |row: &[Row; 4]| row[0].slow() / row[1].slow();
    let ([a, b, c], [own, strata]) = ([one, ten, hundred].map(ratio), [&hundred[0], &hundred[1]]);
    page.claim(
        "for equal time the",
        Verdict::Untested.unless(c <= SIMILAR * TWICE && c < b && b < a),
        &[&RAY, &a, &b, &c, &(own.us / strata.us), &strata.rays, &(c * strata.rays / own.rays)],
    );
    let within = |strata: Vec<Row>, us: f64| {
        let fit = strata.into_iter().filter(|strata| strata.slow() <= 1.05 * us);
        fit.map(|strata| strata.errors[2]).fold(f64::INFINITY, f64::min)
    };
    let rivals = [ten, thirty, hundred].map(|row| {
        let us = row[0].slow();
        let jittered = within(rows.iter().map(|row| row[1]).collect(), us);
        (all(&row[0]), jittered, within(plain.iter().map(|(_, row)| *row).collect(), us), us)
    });
    let cell = |(own, jittered, plain, us): (f64, f64, f64, f64)| {
        let plain = if plain.is_finite() { format!("{plain:.3}") } else { "none as fast".into() };
        format!(
            "{us:.0} us with rays of {RAY:.0} us more: product {own:.3}, jittered strata {jittered:.3} (without jitter {plain})"
        )
    };
    let is_ahead = rivals.iter().all(|(own, jittered, ..)| own < jittered);
    page.claim("at equal time the", is_ahead, &[&rivals.map(cell).join("; ")]);
}

/// Fig. 7: glossier and glossier.
fn glossier(page: &mut Paper, lit: &Lit) -> Result<()> {
    let (scene, source) = (scene(false, STEP)?, Source::new(&lit.light));
    let finer = Rotations::integrated(lit.light.tables(0, 0.0)?, FINER)?;
    let lights = Lights::of(&source.strata(1000)?);
    writeln!(page.text, "\nOn the buddha alone, glossier and glossier (Fig. 7):\n")?;
    columns(&mut page.text, 0, "roughness | 100 samples of the product | us | 1000 strata | us")?;
    let mut rows = Vec::new();
    for alpha in [0.2, 0.1, 0.05] {
        let material = Material::ggx(alpha);
        let truth = truth(&scene, &lit.light, &material)?;
        let product = by_product(&scene, &material, &finer, 100)?;
        let strata = picture(&scene, &material, &How::Lights(&lights), 0)?;
        let (own, other) = (product.error(&truth), strata.error(&truth));
        writeln!(page.text, "| {alpha} | {own:.3} | {:.1} | {other:.3} | {:.1} |", product.us, strata.us)?;
        rows.push((alpha, own, other));
    }
    let list = rows.iter().map(|(alpha, own, other)| format!("roughness {alpha}: {own:.3} and {other:.3}"));
    let is_ahead = rows.last().is_some_and(|(_, own, other)| own < other);
    page.claim("in difficult cases 100", is_ahead, &[&list.collect::<Vec<_>>().join(", ")]);
    Ok(())
}

/// Fig. 9 in colour, at the measured points.
pub fn picture_of(page: &mut Paper, lit: &Lit) -> Result<()> {
    let (parts, source) = (parts(lit)?, Source::new(&lit.light));
    let strata = source.strata(SHOWN as u32)?;
    let jitter = source.jitter(&strata, raw::WIS_JITTER_ENERGY)?;
    let lights = Lights::of(&strata).tinted(&lit.light, &lit.colours);
    let l1000 = Lights::of(&source.strata(1000)?).tinted(&lit.light, &lit.colours);
    let rows = [
        ("product, 30", None),
        ("jittered strata, 30", Some(How::Jittered(&lights, &jitter))),
        ("BRDF, 30", Some(How::Brdf(&lit.light, SHOWN))),
        ("plain strata, 1000", Some(How::Lights(&l1000))),
    ];
    let points = parts.iter().flat_map(|part| part.scene.points.iter().copied()).collect::<Vec<_>>();
    let count = points.len() as f64;
    let mean = parts.iter().flat_map(|part| &part.truth).sum::<f64>() / count;
    let whole = Scene { points, ..data::scene("buddha.obj", View::Points(1))? };
    let mut sheet = Sheet::new(2, 4, mean);
    for (i, (name, how)) in (0..).zip(&rows) {
        let (mut rgb, mut errors) = (Vec::new(), Vec::new());
        for Part { scene, material, truth } in &parts {
            let (values, colours) = match how {
                Some(how) => coloured(scene, material, how, &lit.colours)?,
                None => in_colour(scene, material, lit, SHOWN)?,
            };
            errors.extend(values.iter().zip(truth).map(|(value, truth)| (value - truth).abs() / mean / LIGHTEST));
            rgb.extend(colours);
        }
        let error = LIGHTEST * (errors.iter().map(|error| error * error).sum::<f64>() / count).sqrt();
        sheet.picture([i % 2, 2 * (i / 2)], &whole, &rgb, name);
        sheet.errors([i % 2, 2 * (i / 2) + 1], &whole, &errors, &format!("error {error:.3}"));
    }
    page.save("buddha.png", &sheet)?;
    let lightest = 100.0 * LIGHTEST;
    writeln!(
        page.text,
        "\nBelow each picture its error over the mean: black is 0, light yellow {lightest:.0} % and more."
    )?;
    Ok(())
}
