//! What tables of measured BRDFs take: error against size (Fig. 10).

use crate::Lit;
use anyhow::Result;
use std::fmt::Write;
use std::hint::black_box;
use wis_ffi_tests::client::{Tree, raw};
use wis_ffi_tests::data;
use wis_ffi_tests::packed::Packed;
use wis_ffi_tests::paper::Paper;
use wis_ffi_tests::processor;
use wis_ffi_tests::table;

const SHARES: [f64; 4] = [0.005, 0.01, 0.02, 0.05];
/// The share that the paper recommends, and its place in the list.
pub const TWO_PERCENT: f64 = SHARES[2];
/// Slices along an axis and levels of the paper's two tables, and the kB that they take there.
const TABLES: [(u32, u32, f64); 2] = [(16, 6, 300.0), (32, 7, 5000.0)];
/// Places along an axis of a pixel.
pub const PLACES: u32 = 2;

type Value<'a> = &'a (dyn Fn(glam::DVec3, glam::DVec3) -> f64 + Sync);

/// Writes the section.
pub fn write(page: &mut Paper, _: &Lit) -> Result<()> {
    writeln!(page.text, "\n## Compression of measured BRDFs (Fig. 10)\n\n{TEXT}")?;
    TABLES.into_iter().try_for_each(|table| sizes(page, table))
}

fn sizes(page: &mut Paper, (slices, depth, goal): (u32, u32, f64)) -> Result<()> {
    let (side, all) = (1 << depth, f64::from(slices * slices));
    let out = &mut page.text;
    writeln!(out, "\n### {slices} x {slices} x {side} x {side}; the paper: {goal:.0} kB\n")?;
    writeln!(
        out,
        "| material | error with 0.5 % | 1 % | 2 % | 5 % | 2 % packed, kB, luminance | colour | trees of 2 %, kB, luminance | unpack a slice, us |"
    )?;
    writeln!(out, "|---|---:|---:|---:|---:|---:|---:|---:|---:|")?;
    let mut sizes = Vec::new();
    for brdf in data::all_brdfs()? {
        let slices_of = |value: Value| -> Result<Vec<Tree>> {
            (0..slices).map(|k| Ok(Tree::new(depth, 0.0, &table::pixels(k, slices, depth, PLACES, value)?)?)).collect()
        };
        // A slice for each of two angles of the view: an isotropic BRDF repeats those of one.
        let kb = |bytes: usize| bytes as f64 * f64::from(slices) / 1e3;
        let trees = slices_of(&*brdf.value)?;
        let errors = SHARES.map(|share| Ok(sparse(&trees, depth, share)?.1));
        let errors = errors.into_iter().collect::<Result<Vec<f64>>>()?;
        let packed = sparse(&trees, depth, TWO_PERCENT)?.0;
        let mut colour = 0.0;
        for channel in brdf.channels.iter().flatten() {
            colour += kb(sparse(&slices_of(&**channel)?, depth, TWO_PERCENT)?.0.iter().map(Packed::size).sum());
        }
        let (mut list, mut us, mut bytes) = (Vec::new(), f64::MAX, 0);
        for round in 0..3 {
            let start = processor::seconds();
            packed.iter().try_for_each(|slice| black_box(slice).unpack(&mut list).map(|_| ()))?;
            us = us.min((processor::seconds() - start) * 1e6 / packed.len() as f64);
            if round == 0 {
                for slice in &packed {
                    bytes += slice.tree()?.info.bytes as usize;
                }
            }
        }
        let grey = kb(packed.iter().map(Packed::size).sum());
        // Where a file is read as luminance alone, three channels take three times as much.
        let (three, shown) =
            if colour > 0.0 { (colour, format!("{colour:.0}")) } else { (3.0 * grey, "not read".into()) };
        sizes.push(three);
        let errors = errors.iter().map(|error| format!("{error:.3}")).collect::<Vec<_>>().join(" | ");
        writeln!(out, "| {} | {errors} | {grey:.0} | {shown} | {:.0} | {us:.1} |", brdf.name, kb(bytes))?;
    }
    let [low, high] = range(&sizes);
    let coefficients = TWO_PERCENT * all * f64::from(side * side) * 3.0;
    page.claims.add(
        &format!("a table of {slices} x {slices} slices of {side} x {side} in colour fits {goal:.0} kB"),
        &format!("about {goal:.0} kB: {:.1} bytes for each of 2 % of the coefficients", 1e3 * goal / coefficients),
        format!("{low:.0} to {high:.0} kB with 2 %: {:.1} bytes for each at most", 1e3 * high / coefficients),
        high <= goal,
        "",
    );
    Ok(())
}

/// The least and the largest of some numbers.
pub fn range(values: &[f64]) -> [f64; 2] {
    values.iter().fold([f64::INFINITY, 0.0], |[least, most], x| [x.min(least), x.max(most)])
}

/// The trees of slices, packed with a share of the wavelets: the largest of all. And their relative L2 error together.
pub fn sparse(trees: &[Tree], depth: u32, share: f64) -> Result<(Vec<Packed>, f64)> {
    let pixels = 1u32 << (2 * depth);
    let lists = trees.iter().map(|tree| Ok(tree.largest(3 * pixels)?)).collect::<Result<Vec<_>>>()?;
    let orthonormal = |w: &raw::wis_wavelets| w.detail.map(|d| (d * 0.5f32.powi(w.level as i32)).abs());
    let mut all: Vec<f32> = lists.iter().flatten().flat_map(orthonormal).collect();
    all.sort_by(|a, b| b.total_cmp(a));
    // The averages are among those that are kept.
    let count = ((share * trees.len() as f64 * f64::from(pixels)) as usize).saturating_sub(trees.len());
    let least = all.get(count.max(1) - 1).copied().unwrap_or(0.0);
    let square = |x: &f32| f64::from(*x).powi(2);
    let whole = trees.iter().map(|tree| tree.info.average.powi(2)).sum::<f64>() + all.iter().map(square).sum::<f64>();
    let (mut packed, mut lost, mut back) = (Vec::new(), 0.0, Vec::new());
    for (tree, list) in trees.iter().zip(&lists) {
        let slice = Packed::new(tree.info.average, list, least)?;
        slice.unpack(&mut back)?;
        let mut kept = back.iter().peekable();
        for w in list {
            let there = kept.next_if(|b| (b.position, b.level) == (w.position, w.level)).map_or([0.0; 3], |b| b.detail);
            let off = w.detail.iter().zip(there).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
            lost += off * 0.25f64.powi(w.level as i32);
        }
        packed.push(slice);
    }
    Ok((packed, (lost / whole).sqrt()))
}

const TEXT: &str = "Every BRDF file at hand, BRDF x cosine about the mirror direction (`wis_table_view`, four places in a pixel).
Errors: relative L2 over the whole table in luminance, of what is read back. The wavelets that are kept are the largest of all slices, as in
the paper. *Packed* (`wis_sparse_pack`): an index by difference in one or two bytes, a value of 16 bits, and 16 bytes for each slice.
A slice is unpacked (`wis_sparse_unpack`) into a list that `WIS_TREE_WAVELETS`, products and integrals take. The paper has a slice for each of two angles of the
view. An isotropic BRDF depends on its elevation alone, so each slice of an elevation counts as often as there are azimuths.
Trees hold the same wavelets ready to sample, with the squares above them. The Cornell sets (those without _rgb) are read as luminance alone.
";
