//! Measured BRDFs on meshes (Figs. 8, 10 and 12), all by the paper's pipeline: tables about the mirror direction, the map rotated to it, the
//! product of both, and its warped points.

use crate::compression::{PLACES, TWO_PERCENT, sparse};
use crate::reparameterisation::bare;
use crate::{DEPTH, Lit, estimate};
use anyhow::Result;
use glam::{DVec3, Vec3};
use std::fmt::Write;
use wis_ffi_tests::client::{self, Block, Tree};
use wis_ffi_tests::data;
use wis_ffi_tests::images::displayed_difference;
use wis_ffi_tests::paper::{Paper, VISIBLE, Verdict, columns, range};
use wis_ffi_tests::points;
use wis_ffi_tests::product::Product;
use wis_ffi_tests::scene::{Scene, View};
use wis_ffi_tests::table;

/// Columns and rows of pixels from one measured point to the next.
const STEP: u32 = 15;
/// Noise that counts as practically noise-free, and how much noisier a glossy material may be than the most diffuse one to be handled
/// equally well.
const QUIET: f64 = 0.1;
const EQUALLY: f64 = 2.0;
/// Samples of the paper's pictures of measured BRDFs and of its cars.
const SAMPLES: [usize; 2] = [30, 10];
/// Runs with other random vectors, whose scatter is the noise.
const RUNS: u32 = 16;
/// Samples of pictures that are compared, so that little noise is left in them.
const MANY: usize = 256;
/// The paper's smaller table.
const SLICES: u32 = 16;
/// log2 of the pixels of slices as fine as glossy lobes ask.
const FINER: u32 = 7;
/// The first material of all: the most diffuse one.
const DIFFUSE: &str = "paper_white_rgb";

/// The slices of a material, and pairs of those whose pictures are compared: all of the wavelets first, then what is kept of them.
struct Tables {
    slices: [Vec<Tree>; 7],
}

/// The heads of the columns, and where the two sets of slices are.
const PAIRS: [(&str, usize, usize); 4] =
    [("2 % of all slices", 0, 1), ("2 % of each slice", 0, 2), ("without cosine", 3, 4), ("128 x 128", 5, 6)];
/// Slices from the first to behind the last of these have neither cosine nor horizon.
const BARE: std::ops::Range<usize> = 3..5;

impl Tables {
    fn new(value: &data::Value) -> Result<Tables> {
        let slices = |depth: u32, value: &dyn Fn(DVec3, DVec3) -> f64| -> Result<Vec<Tree>> {
            (0..SLICES).map(|k| Ok(Tree::new(depth, 0.0, &table::pixels(k, SLICES, depth, PLACES, value)?)?)).collect()
        };
        let kept = |slices: &[Tree], depth: u32| -> Result<Vec<Tree>> {
            sparse(slices, depth, TWO_PERCENT)?.0.iter().map(|slice| Ok(slice.tree()?)).collect()
        };
        let all = slices(DEPTH, value)?;
        let bare = slices(DEPTH, &|wo, wi| bare(value, wo, wi))?;
        let finer = slices(FINER, value)?;
        let together = kept(&all, DEPTH)?;
        let apart = all.chunks(1).map(|slice| kept(slice, DEPTH)).collect::<Result<Vec<_>>>()?.concat();
        let (bare_kept, finer_kept) = (kept(&bare, DEPTH)?, kept(&finer, FINER)?);
        Ok(Tables { slices: [all, together, apart, bare, bare_kept, finer, finer_kept] })
    }
}

/// What is measured of a mesh in one material.
struct Row {
    noise: f64,
    /// Displayed differences of what is kept from all wavelets; only with the paper's 30 samples.
    off: Option<[f64; PAIRS.len()]>,
}

/// Writes both sections.
pub fn write(page: &mut Paper, lit: &Lit) -> Result<()> {
    let mut brdfs = data::all_brdfs()?;
    brdfs.sort_by_key(|brdf| brdf.name != DIFFUSE);
    let tables = brdfs.iter().map(|brdf| Tables::new(&brdf.value)).collect::<Result<Vec<_>>>()?;
    let eucalyptus = Lit::load("rnl_cross.hdr")?;
    page.heading("Measured BRDFs (Figs. 8, 10 and 12)")?;
    let pairs = PAIRS.map(|pair| pair.0).join(" | ");
    columns(&mut page.text, 4, &format!("light | samples | mesh | material | noise | {pairs}"))?;
    let mut of = |mesh: &str, few: bool, lit: &Lit| -> Result<Vec<Row>> {
        let scene = data::scene(mesh, View::Image(STEP))?;
        let rows = rows(&scene, &tables, lit, few)?;
        for (brdf, Row { noise, off }) in brdfs.iter().zip(&rows) {
            let off = off.map_or(" | ".repeat(PAIRS.len() - 1), |off| off.map(|off| format!("{off:.4}")).join(" | "));
            let (light, count) = (&lit.light.name, SAMPLES[usize::from(few)]);
            writeln!(page.text, "| {light} | {count} | {} | {} | {noise:.3} | {off} |", scene.name, brdf.name)?;
        }
        Ok(rows)
    };
    let buddha = of("buddha.obj", false, lit)?;
    let others = [of("dragon_vrip_res3.ply", true, &eucalyptus)?, of("teapot.obj", true, &eucalyptus)?];
    let off = |k: usize| buddha.iter().filter_map(|row| row.off.map(|off| off[k])).collect::<Vec<_>>();
    let alike = |k: usize| off(k).iter().filter(|off| **off <= VISIBLE).count();
    let cell = |k: usize| {
        let [nearest, farthest] = range(off(k)).map(|off| 100.0 * off);
        format!("{} {} of {}, by {nearest:.1} to {farthest:.1} %", PAIRS[k].0, alike(k), buddha.len())
    };
    // A verdict over several materials depends on which they are.
    let of_rgl = |k: usize| {
        let rows = brdfs.iter().zip(&buddha).filter(|(brdf, _)| brdf.name.ends_with("_rgb"));
        rows.filter(|(_, row)| row.off.is_some_and(|off| off[k] <= VISIBLE)).count()
    };
    let counts = [0, 1].map(|k| format!("{} of {} ({} of the _rgb files)", alike(k), buddha.len(), of_rgl(k)));
    writeln!(page.text, "\nAlike are {} with 2 % of all slices, {} with 2 % of each slice.", counts[0], counts[1])?;
    // Slices of 128 x 128 are not the claim's.
    let verdict = Verdict::Refuted.unless((0..3).any(|k| 2 * alike(k) > buddha.len()));
    page.claim("pictures with 2 %", verdict, &[&(100.0 * VISIBLE), &[0, 1, 2, 3].map(cell).join("; ")]);
    // The first is the most diffuse.
    let noises = |rows: &[Row]| range(rows.iter().map(|row| row.noise));
    let [low, high] = noises(&buddha);
    page.claim("measured BRDFs from diffuse", Verdict::Refuted.unless(high <= QUIET), &[&low, &high, &RUNS, &QUIET]);
    let ratios = others.each_ref().map(|rows| noises(&rows[1..]).map(|noise| noise / rows[0].noise));
    let each = others.iter().zip(ratios).map(|(rows, [least, most])| {
        let ([low, high], diffuse) = (noises(&rows[1..]), rows[0].noise);
        format!("noise {low:.3} to {high:.3}, {least:.2} to {most:.2} times the {diffuse:.3} of the most diffuse one")
    });
    // Equally well is not worse: less noise is no fault.
    let verdict = Verdict::Refuted.unless(ratios.iter().all(|[_, most]| *most <= EQUALLY));
    page.claim("glossy materials are handled", verdict, &[&each.collect::<Vec<_>>().join("; ")]);
    Ok(())
}

/// A row for each material.
fn rows(scene: &Scene, tables: &[Tables], lit: &Lit, few: bool) -> Result<Vec<Row>> {
    let mut runs = vec![[0.0; 2]; tables.len()];
    let mut pictures: Vec<[Vec<f64>; 7]> = tables.iter().map(|_| Default::default()).collect();
    let [mut set, mut many] = [SAMPLES[usize::from(few)], MANY].map(|count| vec![[0.0; 2]; count]);
    client::hammersley(&mut set);
    client::hammersley(&mut many);
    let mut scratch = Block::new(0);
    for point in &scene.points {
        let (slices, weights, frame) = client::table_view(SLICES, point.normal.to_array(), point.wo.to_array())?;
        let map = lit.integrated.turned(frame)?;
        let below = map.multiply(&lit.integrated.slice(&frame, &mut cosines(point.normal))?, None, &mut scratch)?;
        let value = |product: &Product, set: &[[f32; 2]], pass: u32| {
            // Rotated by a random vector, or all pixels would have the same points.
            let mut turn = [[0.0; 2]];
            points::sobol(client::pixel_seed(point.pixel, pass), 0, &mut turn);
            let mut u: Vec<_> = set.iter().map(|u| [0, 1].map(|axis| (u[axis] + turn[0][axis]).fract())).collect();
            estimate(scene, point, product, &mut u)
        };
        for ((tables, runs), pictures) in tables.iter().zip(&mut runs).zip(&mut pictures) {
            for (k, (table, picture)) in tables.slices.iter().zip(pictures).enumerate().take(if few { 1 } else { 7 }) {
                let terms = [0, 1].map(|k| (&table[slices[k] as usize], weights[k]));
                let map = if BARE.contains(&k) { &below } else { &map };
                let product = Product::new(map, &Tree::blend(&terms, &mut scratch)?, frame)?;
                if k == 0 {
                    let values = (0..RUNS).map(|pass| value(&product, &set, pass)).collect::<Result<Vec<_>>>()?;
                    let mean = values.iter().sum::<f64>() / f64::from(RUNS);
                    let squares = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
                    *runs = [runs[0] + mean, runs[1] + squares / f64::from(RUNS - 1)];
                }
                if !few {
                    picture.push(value(&product, &many, RUNS)?);
                }
            }
        }
    }
    let count = scene.points.len() as f64;
    let row = |([sum, squares], pictures): (&[f64; 2], &[Vec<f64>; 7])| Row {
        noise: (squares / count).sqrt() / (sum / count),
        off: (!few).then(|| PAIRS.map(|(_, all, kept)| displayed_difference(&pictures[all], &pictures[kept]))),
    };
    Ok(runs.iter().zip(&pictures).map(row).collect())
}

/// Cosines to a normal, 0 below its horizon.
fn cosines(normal: Vec3) -> impl FnMut(&[[f32; 3]], &mut [f32]) {
    move |wi, out| wi.iter().zip(out).for_each(|(wi, out)| *out = normal.dot(Vec3::from_array(*wi)).max(0.0))
}
