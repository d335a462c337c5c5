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
use wis_ffi_tests::paper::{Paper, VISIBLE};
use wis_ffi_tests::points;
use wis_ffi_tests::product::Product;
use wis_ffi_tests::scene::{Scene, View};
use wis_ffi_tests::table;

/// Columns and rows of pixels from one measured point to the next.
const STEP: u32 = 4;
/// Noise that counts as practically noise-free, and how much noisier the noisiest material may be than the quietest to be handled equally
/// well.
const QUIET: f64 = 0.1;
const EQUALLY: f64 = 2.0;
/// Samples of the paper's pictures.
const FEW: usize = 30;
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

/// The slices of a material: all of their wavelets, and 2 % of those of all slices as they are read back.
struct Tables {
    all: Vec<Tree>,
    sparse: Vec<Tree>,
}

impl Tables {
    fn new(value: &data::Value) -> Result<Tables> {
        let slice = |k| Ok(Tree::new(DEPTH, 0.0, &table::pixels(k, SLICES, DEPTH, PLACES, value)?)?);
        let all = (0..SLICES).map(slice).collect::<Result<Vec<Tree>>>()?;
        let mut list = Vec::new();
        let unpacked = |packed: &wis_ffi_tests::packed::Packed| {
            packed.unpack(&mut list);
            Ok(Tree::of_wavelets(packed.average(), &list, 0.0)?)
        };
        let sparse = sparse(&all, DEPTH, TWO_PERCENT)?.0.iter().map(unpacked).collect::<Result<Vec<Tree>>>()?;
        Ok(Tables { all, sparse })
    }
}

/// Pictures of a mesh in one material: two of all wavelets with other points each, and one of 2 % with the first points.
#[derive(Default)]
struct Pictures([Vec<f64>; 3]);

/// Writes both sections.
pub fn write(page: &mut Paper, lit: &Lit) -> Result<()> {
    let brdfs = data::all_brdfs()?;
    let chosen: Vec<_> = FILES.iter().filter_map(|name| brdfs.iter().find(|brdf| brdf.name == *name)).collect();
    let chosen = if chosen.is_empty() { brdfs.iter().collect() } else { chosen };
    let tables = chosen.iter().map(|brdf| Tables::new(&brdf.value)).collect::<Result<Vec<_>>>()?;
    let names: Vec<&str> = chosen.iter().map(|brdf| brdf.name.as_str()).collect();
    let eucalyptus = Lit::load("rnl_cross.hdr")?;
    writeln!(page.text, "\n## Measured BRDFs (Figs. 8, 10 and 12)\n\n{TEXT}")?;
    writeln!(
        page.text,
        "| light | samples | mesh | material | noise | 2 % against all, displayed |\n|---|---:|---|---|---:|---:|"
    )?;
    let mut of = |mesh: &str, count: usize, lit: &Lit| -> Result<Vec<[f64; 2]>> {
        let scene = data::scene(mesh, View::Image(STEP))?;
        let pictures = pictures(&scene, &tables, lit, count)?;
        let mut rows = Vec::new();
        for (name, Pictures([one, two, kept])) in names.iter().zip(&pictures) {
            let row = [difference(one, two) / SQRT_2, displayed_difference(one, kept)];
            let [noise, off] = row;
            writeln!(page.text, "| {} | {count} | {} | {name} | {noise:.3} | {off:.4} |", lit.light.name, scene.name)?;
            rows.push(row);
        }
        Ok(rows)
    };
    let buddha = of("buddha.obj", FEW, lit)?;
    let others = [of("dragon_vrip_res3.ply", 10, &eucalyptus)?, of("teapot.obj", 10, &eucalyptus)?].concat();
    let column = |rows: &[[f64; 2]], k: usize| range(&rows.iter().map(|row| row[k]).collect::<Vec<_>>());
    let alike = buddha.iter().filter(|row| row[1] <= VISIBLE).count();
    let ([nearest, farthest], [low, high], [least, most]) =
        (column(&buddha, 1), column(&buddha, 0), column(&others, 0));
    page.claims.add(
        "pictures with 2 % of the coefficients at 64 x 64 are indistinguishable from a reference (Fig. 10)",
        "for most measured BRDFs; 1 to 2 % in practice",
        format!(
            "{alike} of {} differ by at most {:.0} % of white from all coefficients; all by {:.1} to {:.1} %",
            buddha.len(),
            100.0 * VISIBLE,
            100.0 * nearest,
            100.0 * farthest
        ),
        2 * alike > buddha.len(),
        "the largest wavelets of all slices leave few for the darker ones",
    );
    page.claims.add(
        "measured BRDFs from diffuse to glossy are practically noise-free with 30 samples (Fig. 8)",
        "pictures",
        format!("noise {low:.3} to {high:.3}, all of it in shadows; allowed {QUIET}"),
        high <= QUIET,
        "what is left is the noise of visibility alone",
    );
    page.claims.add(
        "glossy materials are handled equally well as diffuse ones with 10 samples (Fig. 12)",
        "a picture",
        format!("noise {least:.3} to {most:.3}, a factor of {:.1}", most / least),
        most <= EQUALLY * least,
        "what is left is the noise of visibility alone",
    );
    Ok(())
}

/// Of each material.
fn pictures(scene: &Scene, tables: &[Tables], lit: &Lit, count: usize) -> Result<Vec<Pictures>> {
    let mut pictures: Vec<Pictures> = tables.iter().map(|_| Pictures::default()).collect();
    let (mut u, mut scratch) = (vec![[0.0; 2]; count], Block::new(0));
    for point in &scene.points {
        let (slices, weights, frame) = client::table_view(SLICES, point.normal.to_array(), point.wo.to_array())?;
        let map = lit.integrated.turned(frame)?;
        let mut product = |table: &[Tree]| -> Result<Product> {
            let terms = [0, 1].map(|k| (&table[slices[k] as usize], weights[k]));
            Ok(Product::new(&map, &Tree::blend(&terms, &mut scratch)?, frame)?)
        };
        for (table, Pictures(values)) in tables.iter().zip(&mut pictures) {
            let [all, kept] = [product(&table.all)?, product(&table.sparse)?];
            for (values, (product, pass)) in values.iter_mut().zip([(&all, 0), (&all, 1), (&kept, 0)]) {
                points::sobol(client::pixel_seed(point.pixel, pass), 0, &mut u);
                values.push(estimate(scene, point, product, &mut u)?);
            }
        }
    }
    Ok(pictures)
}

/// The root mean squared difference of two pictures over the mean of the first.
fn difference(exact: &[f64], picture: &[f64]) -> f64 {
    let (squares, sum) = exact.iter().zip(picture).fold((0.0, 0.0), |(q, m), (e, v)| (q + (e - v).powi(2), m + e));
    let count = exact.len() as f64;
    (squares / count).sqrt() / (sum / count)
}

const TEXT: &str = "Tables of 16 elevations x 64 x 64 directions about the mirror direction, the map rotated to that frame, the product of both, and
its warped points. Noise: the root mean square of the difference of two runs over sqrt 2 and the mean. Displayed: the root mean squared
difference, of white, of pictures of mean 0.4 and gamma 2.2, as they are drawn. A difference below two percent, five of 255 levels, is not
seen. The paper shows eight materials with 30 samples and twelve with 10; here two meshes in six materials stand in for its cars.
";
