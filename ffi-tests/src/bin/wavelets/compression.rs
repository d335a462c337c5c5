//! What tables of measured BRDFs take: error against size (Fig. 10).

use crate::Lit;
use anyhow::Result;
use std::fmt::Write;
use wis_ffi_tests::client::{Tree, raw};
use wis_ffi_tests::data::{self, Brdf};
use wis_ffi_tests::paper::Paper;
use wis_ffi_tests::table;

const SHARES: [f64; 4] = [0.005, 0.01, 0.02, 0.05];
/// Slices along an axis and levels of the paper's two tables, and the kB that they take there.
const TABLES: [(u32, u32, f64); 2] = [(16, 6, 300.0), (32, 7, 5000.0)];
/// Places along an axis of a pixel.
pub const PLACES: u32 = 2;

type Value<'a> = &'a (dyn Fn(glam::DVec3, glam::DVec3) -> f64 + Sync);

/// Writes the section.
pub fn write(page: &mut Paper, _: &Lit) -> Result<()> {
    writeln!(page.text, "\n## Compression of measured BRDFs (Fig. 10)\n\n{TEXT}")?;
    let brdfs = data::all_brdfs()?;
    TABLES.into_iter().try_for_each(|table| sizes(page, &brdfs, table))
}

fn sizes(page: &mut Paper, brdfs: &[Brdf], (slices, depth, goal): (u32, u32, f64)) -> Result<()> {
    let side = 1 << depth;
    let out = &mut page.text;
    writeln!(out, "\n### {slices} x {slices} x {side} x {side}; the paper: {goal:.0} kB\n")?;
    writeln!(
        out,
        "| material | error with 0.5 % | 1 % | 2 % | 5 % | luminance: kB a slice | {slices} slices | {} slices | colour, measured: kB a \
         slice | {slices} slices | {} slices |",
        slices * slices,
        slices * slices
    )?;
    writeln!(out, "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|")?;
    let (mut grey, mut coloured, mut kept) = (Vec::new(), Vec::new(), Vec::new());
    for brdf in brdfs {
        let pixels = slices_of(&*brdf.value, slices, depth)?;
        let errors = by_share(&pixels, depth)?;
        let luminance = smallest(&pixels, depth, errors[2])?;
        let all = (pixels.len() << (2 * depth)) as f64;
        kept.push(luminance.coefficients as f64 / (SHARES[2] * all));
        let colour = match &brdf.channels {
            Some(channels) => {
                let kb = |channel: &Value| -> Result<f64> {
                    Ok(smallest(&slices_of(channel, slices, depth)?, depth, errors[2])?.kb())
                };
                Some(channels.iter().map(|channel| kb(&&**channel)).sum::<Result<f64>>()?)
            }
            None => None,
        };
        let three =
            |total: f64| format!("{:.2} | {total:.0} | {:.0}", total / f64::from(slices), total * f64::from(slices));
        let errors = errors.map(|error| format!("{error:.3}")).join(" | ");
        let of_colour = colour.map_or("not read | - | -".into(), three);
        writeln!(out, "| {} | {errors} | {} | {of_colour} |", brdf.name, three(luminance.kb()))?;
        grey.push(luminance.kb());
        coloured.extend(colour);
    }
    let ([low, high], [least, most]) = (range(&coloured), range(&grey));
    writeln!(
        out,
        "\nNot a claim of the paper: by elevation alone an isotropic BRDF needs {slices} of these slices. They take {low:.0} to {high:.0} kB\n\
         in colour, {least:.0} to {most:.0} kB in luminance."
    )?;
    claim(page, (slices, depth, goal), [low, high], range(&kept));
    Ok(())
}

/// The paper's size against that of slices in colour, and how many times 2 % of the coefficients trees keep.
fn claim(page: &mut Paper, (slices, depth, goal): (u32, u32, f64), colour: [f64; 2], kept: [f64; 2]) {
    let (side, whole) = (1u32 << depth, f64::from(slices));
    let ([low, high], [fewest, most]) = (colour.map(|kb| kb * whole), kept);
    let coefficients = SHARES[2] * whole * whole * f64::from(side * side) * 3.0;
    page.claims.add(
        &format!("a table of {slices} x {slices} slices of {side} x {side} in colour fits {goal:.0} kB"),
        &format!("about {goal:.0} kB, {:.2} kB a slice", goal / whole / whole),
        format!(
            "{low:.0} to {high:.0} kB ({:.2} to {:.2} kB a slice) at the error of 2 % of the coefficients",
            low / whole / whole,
            high / whole / whole
        ),
        high <= goal,
        &format!(
            "at that error whole squares keep {fewest:.1} to {most:.1} times as many coefficients; the paper has {:.1} bytes for each",
            1e3 * goal / coefficients
        ),
    );
}

/// The least and the largest of some numbers.
pub fn range(values: &[f64]) -> [f64; 2] {
    values.iter().fold([f64::INFINITY, 0.0], |[least, most], x| [x.min(least), x.max(most)])
}

const TEXT: &str = "Every BRDF file at hand, BRDF x cosine about the mirror direction (`wis_table_view`, four places in a pixel).
Errors: relative L2 over the whole table in luminance. The wavelets that are kept are the largest of all slices, as in the paper. Then the size of trees of whole squares whose error is at most that of 2 % of the wavelets. They hold no negative
values, and can be sampled, multiplied and blended. The paper has a slice for each of two angles of the view. An isotropic BRDF
depends on its elevation alone: it has as many different slices as elevations. Colour is measured: three tables, each to that
error. The Cornell sets (those without _rgb) are read as luminance alone, so their rows have no colour. They have 1439 pairs of
directions, spread by their nearest neighbours.
";

fn slices_of(value: Value, slices: u32, depth: u32) -> Result<Vec<Vec<f32>>> {
    (0..slices).map(|slice| Ok(table::pixels(slice, slices, depth, PLACES, value)?)).collect()
}

fn energy(pixels: &[Vec<f32>]) -> f64 {
    pixels.iter().flatten().map(|&x| f64::from(x).powi(2)).sum::<f64>() / pixels[0].len() as f64
}

/// The relative L2 error if a share of all wavelets is kept, the largest of all slices.
pub fn by_share(pixels: &[Vec<f32>], depth: u32) -> Result<[f64; 4]> {
    let (mut energies, mut kept) = (Vec::new(), 0.0);
    for slice in pixels {
        let tree = Tree::new(depth, 0.0, slice)?;
        kept += tree.info.average.powi(2);
        energies.extend(tree.largest(3 << (2 * depth))?.iter().flat_map(energies_of));
    }
    energies.sort_by(|a, b| b.total_cmp(a));
    let (whole, all) = (energy(pixels), (pixels.len() << (2 * depth)) as f64);
    Ok(SHARES.map(|share| {
        let count = ((share * all).round() as usize).saturating_sub(pixels.len());
        let lost = whole - kept - energies.iter().take(count).sum::<f64>();
        (lost.max(0.0) / whole).sqrt()
    }))
}

fn energies_of(w: &raw::wis_wavelets) -> [f64; 3] {
    w.detail.map(|d| f64::from(d).powi(2) * 0.25f64.powi(w.level as i32))
}

/// What trees keep.
#[derive(Clone, Copy)]
struct Size {
    bytes: u64,
    coefficients: usize,
}

impl Size {
    fn kb(self) -> f64 {
        self.bytes as f64 / 1e3
    }
}

/// The size of trees with one error budget for all slices, the largest with which they lose no more.
fn smallest(pixels: &[Vec<f32>], depth: u32, error: f64) -> Result<Size> {
    let whole = energy(pixels);
    let (mut low, mut high) = (1e-9f32, 30.0f32);
    let build = |budget: f32| -> Result<(Size, f64)> {
        let (mut size, mut kept) = (Size { bytes: 0, coefficients: pixels.len() }, 0.0);
        for slice in pixels {
            let tree = Tree::new(depth, budget, slice)?;
            // A tree of whole squares is a projection: what it loses is what its wavelets lack.
            let wavelets = tree.largest(3 << (2 * depth))?;
            size.bytes += tree.info.bytes;
            size.coefficients += 3 * wavelets.len();
            kept += tree.info.average.powi(2) + wavelets.iter().flat_map(energies_of).sum::<f64>();
        }
        Ok((size, ((whole - kept).max(0.0) / whole).sqrt()))
    };
    let mut best = build(0.0)?.0;
    for _ in 0..12 {
        let middle = (low * high).sqrt();
        let (size, lost) = build(middle)?;
        if lost <= error {
            low = middle;
            best = if size.bytes < best.bytes { size } else { best };
        } else {
            high = middle;
        }
    }
    Ok(best)
}
