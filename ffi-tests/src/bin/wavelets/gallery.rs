//! Measured BRDFs on meshes (Figs. 8, 10 and 12), all by the paper's pipeline: tables about the mirror direction, the map rotated to it, the
//! product of both, and its warped points.

use crate::compression::{PLACES, TWO_PERCENT, range, sparse};
use crate::{DEPTH, Lit, estimate};
use anyhow::Result;
use std::f64::consts::SQRT_2;
use std::fmt::Write;
use wis_ffi_tests::client::{self, Block, Tree};
use wis_ffi_tests::data;
use wis_ffi_tests::images::displayed_difference;
use wis_ffi_tests::paper::{Paper, VISIBLE, Verdict};
use wis_ffi_tests::points;
use wis_ffi_tests::product::Product;
use wis_ffi_tests::scene::{Scene, View};
use wis_ffi_tests::table;

/// Columns and rows of pixels from one measured point to the next.
const STEP: u32 = 6;
/// Noise that counts as practically noise-free, and how much noisier a glossy material may be than the most diffuse one to be handled
/// equally well.
const QUIET: f64 = 0.1;
const EQUALLY: f64 = 2.0;
/// Samples of the paper's pictures of measured BRDFs and of its cars.
const SAMPLES: [usize; 2] = [30, 10];
/// Samples of pictures that are compared, so that little noise is left in them.
const MANY: usize = 256;
/// The paper's smaller table.
const SLICES: u32 = 16;

/// From diffuse to glossy.
const FILES: [&str; 6] = [
    "paper_white_rgb",
    "colodur_napoli_4f_rgb",
    "satin_rosaline_rgb",
    "cc_ibiza_sunset_rgb",
    "cc_iris_purple_gem_rgb",
    "cg_sunflower_rgb",
];

/// The slices of a material: with all of their wavelets, with the largest 2 % of all slices, and with the largest 2 % of each.
struct Tables([Vec<Tree>; 3]);

impl Tables {
    fn new(value: &data::Value) -> Result<Tables> {
        let slice = |k| Ok(Tree::new(DEPTH, 0.0, &table::pixels(k, SLICES, DEPTH, PLACES, value)?)?);
        let all = (0..SLICES).map(slice).collect::<Result<Vec<Tree>>>()?;
        let kept =
            |slices: &[Tree]| sparse(slices, DEPTH, TWO_PERCENT)?.0.iter().map(|slice| Ok(slice.tree()?)).collect();
        let together: Result<Vec<Tree>> = kept(&all);
        let apart = all.chunks(1).map(kept).collect::<Result<Vec<_>>>()?.concat();
        Ok(Tables([all, together?, apart]))
    }
}

/// What is measured of a mesh in one material.
#[derive(Default)]
struct Row {
    noise: f64,
    /// Displayed differences of two ways to keep 2 % from all wavelets; only with the paper's 30 samples.
    off: Option<[f64; 2]>,
}

/// Writes both sections.
pub fn write(page: &mut Paper, lit: &Lit) -> Result<()> {
    let brdfs = data::all_brdfs()?;
    let chosen: Vec<_> = FILES.iter().filter_map(|name| brdfs.iter().find(|brdf| brdf.name == *name)).collect();
    let chosen = if chosen.is_empty() { brdfs.iter().collect() } else { chosen };
    let tables = chosen.iter().map(|brdf| Tables::new(&brdf.value)).collect::<Result<Vec<_>>>()?;
    let eucalyptus = Lit::load("rnl_cross.hdr")?;
    writeln!(page.text, "\n## Measured BRDFs (Figs. 8, 10 and 12)\n\n{TEXT}")?;
    writeln!(
        page.text,
        "| light | samples | mesh | material | noise | 2 % of all slices, displayed | 2 % of each slice |\n|---|---:|---|---|---:|---:|---:|"
    )?;
    let mut of = |mesh: &str, few: bool, lit: &Lit| -> Result<Vec<Row>> {
        let scene = data::scene(mesh, View::Image(STEP))?;
        let rows = rows(&scene, &tables, lit, few)?;
        for (brdf, Row { noise, off }) in chosen.iter().zip(&rows) {
            let off = off.map_or("| ".into(), |off| off.map(|off| format!("{off:.4}")).join(" | "));
            let (light, count) = (&lit.light.name, SAMPLES[usize::from(few)]);
            writeln!(page.text, "| {light} | {count} | {} | {} | {noise:.3} | {off} |", scene.name, brdf.name)?;
        }
        Ok(rows)
    };
    let buddha = of("buddha.obj", false, lit)?;
    let others = [of("dragon_vrip_res3.ply", true, &eucalyptus)?, of("teapot.obj", true, &eucalyptus)?];
    let noises = |rows: &[Row]| rows.iter().map(|row| row.noise).collect::<Vec<_>>();
    let off = |k: usize| buddha.iter().filter_map(|row| row.off.map(|off| off[k])).collect::<Vec<_>>();
    let alike = |k: usize| off(k).iter().filter(|off| **off <= VISIBLE).count();
    let cell = |k: usize| {
        let [nearest, farthest] = range(&off(k)).map(|off| 100.0 * off);
        format!("{} of {}, by {nearest:.1} to {farthest:.1} %", alike(k), buddha.len())
    };
    page.claims.add(
        "pictures with 2 % of the coefficients at 64 x 64 are indistinguishable from a reference (Fig. 10)",
        "for most measured BRDFs; 1 to 2 % in practice",
        format!(
            "{:.0} % of white from all coefficients at most: with the largest of all slices {}; of each slice {}",
            100.0 * VISIBLE,
            cell(0),
            cell(1)
        ),
        Verdict::Refuted.unless((0..2).any(|k| 2 * alike(k) > buddha.len())),
        "both tables have the same slices, views and points of light: what differs are the 98 % of the coefficients",
    );
    let [low, high] = range(&noises(&buddha));
    page.claims.add(
        "measured BRDFs from diffuse to glossy are practically noise-free with 30 samples (Fig. 8)",
        "pictures",
        format!("noise {low:.3} to {high:.3}, all of it in shadows; allowed {QUIET}"),
        Verdict::Refuted.unless(high <= QUIET),
        "an integral that is not hidden has no noise (Eq. 11): all of it is that of visibility alone, of which 30 samples are taken",
    );
    // The first is the most diffuse.
    let worse = others.each_ref().map(|rows| range(&noises(&rows[1..]))[1] / rows[0].noise);
    let each = others.each_ref().map(|rows| {
        let [least, most] = range(&noises(&rows[1..]));
        format!("noise {least:.3} to {most:.3}, {:.3} of the most diffuse one", rows[0].noise)
    });
    page.claims.add(
        "glossy materials are handled equally well as diffuse ones with 10 samples (Fig. 12)",
        "a picture",
        each.join("; "),
        Verdict::Refuted.unless(worse.iter().all(|ratio| *ratio <= EQUALLY)),
        "an integral that is not hidden has no noise (Eq. 11): all of it is that of visibility alone",
    );
    Ok(())
}

/// A row for each material.
fn rows(scene: &Scene, tables: &[Tables], lit: &Lit, few: bool) -> Result<Vec<Row>> {
    let mut runs: Vec<[Vec<f64>; 2]> = tables.iter().map(|_| Default::default()).collect();
    let mut exact: Vec<[Vec<f64>; 3]> = tables.iter().map(|_| Default::default()).collect();
    let [mut set, mut many] = [SAMPLES[usize::from(few)], MANY].map(|count| vec![[0.0; 2]; count]);
    client::hammersley(&mut set)?;
    client::hammersley(&mut many)?;
    let mut scratch = Block::new(0);
    for point in &scene.points {
        let (slices, weights, frame) = client::table_view(SLICES, point.normal.to_array(), point.wo.to_array())?;
        let map = lit.integrated.turned(frame)?;
        let value = |product: &Product, set: &[[f32; 2]], pass: u32| {
            // Rotated by a random vector, or all pixels would have the same points.
            let mut turn = [[0.0; 2]];
            points::sobol(client::pixel_seed(point.pixel, pass), 0, &mut turn);
            let mut u: Vec<_> = set.iter().map(|u| [0, 1].map(|axis| (u[axis] + turn[0][axis]).fract())).collect();
            estimate(scene, point, product, &mut u)
        };
        for ((Tables(tables), runs), exact) in tables.iter().zip(&mut runs).zip(&mut exact) {
            for (k, (table, exact)) in tables.iter().zip(exact).enumerate().take(if few { 1 } else { 3 }) {
                let terms = [0, 1].map(|k| (&table[slices[k] as usize], weights[k]));
                let product = Product::new(&map, &Tree::blend(&terms, &mut scratch)?, frame)?;
                if k == 0 {
                    (0..)
                        .zip(&mut *runs)
                        .try_for_each(|(pass, run)| value(&product, &set, pass).map(|v| run.push(v)))?;
                }
                if !few {
                    exact.push(value(&product, &many, 2)?);
                }
            }
        }
    }
    let row = |([one, two], [all, together, apart]): (&[Vec<f64>; 2], &[Vec<f64>; 3])| Row {
        noise: difference(one, two) / SQRT_2,
        off: (!few).then(|| [together, apart].map(|kept| displayed_difference(all, kept))),
    };
    Ok(runs.iter().zip(&exact).map(row).collect())
}

/// The root mean squared difference of two pictures over the mean of the first.
fn difference(exact: &[f64], picture: &[f64]) -> f64 {
    let (squares, sum) = exact.iter().zip(picture).fold((0.0, 0.0), |(q, m), (e, v)| (q + (e - v).powi(2), m + e));
    let count = exact.len() as f64;
    (squares / count).sqrt() / (sum / count)
}

const TEXT: &str = "Tables of 16 elevations x 64 x 64 directions about the mirror direction, the map rotated to that frame, the product of both, and
its warped points: Hammersley's, as in the paper, rotated by a random vector at each pixel. Noise: the root mean square of the difference of
two runs over sqrt 2 and the mean. Displayed: the root mean squared difference, of white, of pictures of mean 0.4 and gamma 2.2 with 256
samples, from that of all coefficients. A difference below two percent, five of 255 levels, is not seen. The paper discards coefficients
below a threshold, and does not say whether slices share it: 2 % are kept of all slices together, and of each slice.
The paper shows eight materials with 30 samples and twelve with 10; here two meshes in six materials stand in for its cars.
";
