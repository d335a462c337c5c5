//! What tables of measured BRDFs take: error against size (Fig. 10).

use crate::Lit;
use anyhow::Result;
use std::fmt::Write;
use std::hint::black_box;
use wis_ffi_tests::client::{Tree, raw};
use wis_ffi_tests::data;
use wis_ffi_tests::packed::{Packed, energy};
use wis_ffi_tests::paper::{Paper, columns, range};
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
    page.heading("Compression of measured BRDFs (Fig. 10)")?;
    TABLES.into_iter().try_for_each(|table| sizes(page, table))
}

fn sizes(page: &mut Paper, (slices, depth, goal): (u32, u32, f64)) -> Result<()> {
    let (side, all) = (1 << depth, f64::from(slices * slices));
    let out = &mut page.text;
    writeln!(out, "\n### {slices} x {slices} x {side} x {side}; the paper: {goal:.0} kB\n")?;
    columns(
        out,
        1,
        "material | error with 0.5 % | 1 % | 2 % | 5 % | packed, kB, luminance | colour | unpack a slice, us | its tree, us | \
         whole squares, error | kB, luminance | trees, kB",
    )?;
    let (mut sizes, mut rows) = (Vec::new(), Vec::new());
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
        let (mut list, mut us, mut bytes) = (Vec::new(), [f64::MAX; 2], 0);
        for _ in 0..3 {
            let start = processor::seconds();
            packed.iter().try_for_each(|slice| black_box(slice).unpack(&mut list).map(|_| ()))?;
            let middle = processor::seconds();
            bytes = packed.iter().map(|slice| Ok(slice.tree()?.info.bytes as usize)).sum::<Result<usize>>()?;
            let times = [middle - start, processor::seconds() - middle];
            us = [0, 1].map(|k| us[k].min(times[k] * 1e6 / packed.len() as f64));
        }
        let grey = kb(packed.iter().map(Packed::size).sum());
        // Where a file is read as luminance alone, three channels take three times as much.
        let (three, shown) =
            if colour > 0.0 { (colour, format!("{colour:.0}")) } else { (3.0 * grey, "not read".into()) };
        sizes.push(three);
        let (whole, whole_error) = whole(&trees, depth, TWO_PERCENT)?;
        rows.push([kb(whole) / grey, whole_error / errors[2], kb(bytes) / grey, us[0], us[1]]);
        let errors = errors.iter().map(|error| format!("{error:.3}")).collect::<Vec<_>>().join(" | ");
        writeln!(
            out,
            "| {} | {errors} | {grey:.0} | {shown} | {:.1} | {:.0} | {whole_error:.3} | {:.0} | {:.0} |",
            brdf.name,
            us[0],
            us[1],
            kb(whole),
            kb(bytes)
        )?;
    }
    let [space, worse, trees, unpack, tree] = [0, 1, 2, 3, 4].map(|k| range(rows.iter().map(|row| row[k])));
    writeln!(
        out,
        "\nWhole squares of as many coefficients take {:.1} to {:.1} times the bytes of packed ones and have {:.1} to {:.1} times their error;\n\
         trees of the packed coefficients take {:.1} to {:.1} times the bytes. What they save is time: a packed slice is read in {:.1} to {:.1} us\n\
         and is a tree after {:.0} to {:.0} us, which whole trees save at every point. So trees of whole squares are the better choice where a\n\
         slice is multiplied at many points and the table fits the memory; packed slices where it does not.",
        space[0], space[1], worse[0], worse[1], trees[0], trees[1], unpack[0], unpack[1], tree[0], tree[1]
    )?;
    let [low, high] = range(sizes);
    let coefficients = TWO_PERCENT * all * f64::from(side * side) * 3.0;
    let (bytes, of_paper) = (1e3 * high / coefficients, 1e3 * goal / coefficients);
    page.claim(
        "a table of",
        high <= goal,
        &[&slices, &slices, &side, &side, &goal, &goal, &of_paper, &low, &high, &bytes],
    );
    Ok(())
}

/// All wavelets of some trees, and the energy of the trees.
fn lists(trees: &[Tree], depth: u32) -> Result<(Vec<Vec<raw::wis_wavelets>>, f64)> {
    let lists = trees.iter().map(|tree| Ok(tree.largest(3 << (2 * depth))?)).collect::<Result<Vec<_>>>()?;
    let averages = trees.iter().map(|tree| tree.info.average.powi(2)).sum::<f64>();
    let whole = averages + lists.iter().flatten().map(energy).sum::<f64>();
    Ok((lists, whole))
}

/// The trees of slices, packed with a share of the wavelets: the largest of all. And their relative L2 error together.
pub fn sparse(trees: &[Tree], depth: u32, share: f64) -> Result<(Vec<Packed>, f64)> {
    let (lists, whole) = lists(trees, depth)?;
    let orthonormal = |w: &raw::wis_wavelets| w.detail.map(|d| (d * 0.5f32.powi(w.level as i32)).abs());
    let mut all: Vec<f32> = lists.iter().flatten().flat_map(orthonormal).collect();
    all.sort_by(|a, b| b.total_cmp(a));
    // The averages are among those that are kept.
    let count = ((share * trees.len() as f64 * f64::from(1u32 << (2 * depth))) as usize).saturating_sub(trees.len());
    let least = all.get(count.max(1) - 1).copied().unwrap_or(0.0);
    let slices = trees.iter().zip(&lists).map(|(tree, list)| {
        let slice = Packed::new(tree.info.average, list, least)?;
        let lost = slice.lost(list)?;
        Ok((slice, lost))
    });
    let (packed, lost): (_, Vec<f64>) = slices.collect::<Result<Vec<_>>>()?.into_iter().unzip();
    Ok((packed, (lost.iter().sum::<f64>() / whole).sqrt()))
}

/// The bytes of the same share in whole squares, those of the most energy, and their relative L2 error.
fn whole(trees: &[Tree], depth: u32, share: f64) -> Result<(usize, f64)> {
    let (lists, whole) = lists(trees, depth)?;
    let mut energies: Vec<f64> = lists.iter().flatten().map(energy).collect();
    energies.sort_by(|a, b| b.total_cmp(a));
    let kept = ((share * trees.len() as f64 * f64::from(1u32 << (2 * depth))) as usize).saturating_sub(trees.len()) / 3;
    let lost = energies.iter().skip(kept).sum::<f64>();
    // The average of a slice is a double.
    Ok((kept * size_of::<raw::wis_wavelets>() + trees.len() * size_of::<f64>(), (lost / whole).sqrt()))
}
