//! What tables of measured BRDFs take: error against size (Fig. 10), and what reparameterisation does.

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
/// The error between slices above which they differ much.
const DIFFERENT: f64 = 0.1;
/// Places along an axis of a pixel.
const PLACES: u32 = 2;

type Value<'a> = &'a (dyn Fn(glam::DVec3, glam::DVec3) -> f64 + Sync);

/// Writes the section.
pub fn write(page: &mut Paper, _: &Lit) -> Result<()> {
    writeln!(page.text, "\n## Compression of measured BRDFs (Fig. 10)\n\n{TEXT}")?;
    let brdfs = data::all_brdfs()?;
    for (slices, depth, goal) in TABLES {
        sizes(page, &brdfs, (slices, depth, goal))?;
    }
    reparameterisation(page, &brdfs)
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
    let (mut grey, mut coloured) = (Vec::new(), Vec::new());
    for brdf in brdfs {
        let pixels = slices_of(&*brdf.value, slices, depth)?;
        let errors = by_share(&pixels, depth)?;
        let kb = |pixels: &[Vec<f32>]| -> Result<f64> { Ok(smallest(pixels, depth, errors[2])? as f64 / 1e3) };
        let luminance = kb(&pixels)?;
        let colour = match &brdf.channels {
            Some(channels) => {
                let each = channels.iter().map(|channel| kb(&slices_of(&**channel, slices, depth)?));
                Some(each.sum::<Result<f64>>()?)
            }
            None => None,
        };
        let three =
            |total: f64| format!("{:.2} | {total:.0} | {:.0}", total / f64::from(slices), total * f64::from(slices));
        let errors = errors.map(|error| format!("{error:.3}")).join(" | ");
        let of_colour = colour.map_or("- | - | -".into(), three);
        writeln!(out, "| {} | {errors} | {} | {of_colour} |", brdf.name, three(luminance))?;
        grey.push(luminance);
        coloured.extend(colour);
    }
    let range = |values: &[f64]| values.iter().fold([f64::INFINITY, 0.0], |[a, b]: [f64; 2], x| [x.min(a), x.max(b)]);
    let ([low, high], [least, most]) = (range(&coloured), range(&grey));
    let whole = f64::from(slices);
    page.claims.add(
        &format!("a table of {slices} x {slices} slices of {side} x {side} in colour fits {goal:.0} kB"),
        &format!("about {goal:.0} kB, {:.2} kB a slice", goal / whole / whole),
        format!(
            "{:.0} to {:.0} kB ({:.2} to {:.2} kB a slice) at the error of 2 % of the coefficients",
            low * whole,
            high * whole,
            low / whole,
            high / whole
        ),
        high * whole <= goal,
        &format!(
            "the paper has {:.1} bytes for a coefficient of a channel; here whole squares with all their parents are kept, so that nothing is negative",
            1e3 * goal / (0.02 * whole * whole * f64::from(1u32 << (2 * depth)) * 3.0)
        ),
    );
    page.claims.add(
        &format!("isotropic BRDFs need {slices} of these slices, by elevation alone"),
        "not used: a slice for each of two angles",
        format!("{low:.0} to {high:.0} kB in colour, {least:.0} to {most:.0} in luminance"),
        high <= goal,
        "",
    );
    Ok(())
}

/// What turning the slices about the mirror direction does to their sparsity, and to what lies between them.
fn reparameterisation(page: &mut Paper, brdfs: &[Brdf]) -> Result<()> {
    const SLICES: u32 = 16;
    const DEPTH: u32 = 6;
    writeln!(page.text, "\n### Reparameterisation\n\n{TURNED}")?;
    writeln!(
        page.text,
        "| material | 2 % of the coefficients: about the mirror | about the normal | between slices: about the mirror | about the normal |"
    )?;
    writeln!(page.text, "|---|---:|---:|---:|---:|")?;
    let mut rows = Vec::new();
    for brdf in brdfs {
        // Every third of these slices is one of the table.
        let fine = [slices_of(&*brdf.value, 3 * SLICES, DEPTH)?, unturned(&*brdf.value, 3 * SLICES, DEPTH)];
        let coarse = fine.each_ref().map(|fine| fine.iter().skip(1).step_by(3).cloned().collect::<Vec<_>>());
        let [sparse, plain] = [by_share(&coarse[0], DEPTH)?[2], by_share(&coarse[1], DEPTH)?[2]];
        let [turned, fixed] = [between(&fine[0]), between(&fine[1])];
        writeln!(page.text, "| {} | {sparse:.3} | {plain:.3} | {turned:.3} | {fixed:.3} |", brdf.name)?;
        rows.push([sparse, plain, turned, fixed]);
    }
    let ahead = |a: usize, b: usize| rows.iter().filter(|row| row[a] < row[b]).count();
    let (fewer, nearer) = (ahead(0, 1), ahead(2, 3));
    let glossy: Vec<_> = rows.iter().filter(|row| row[3] > DIFFERENT).collect();
    let helped = glossy.iter().filter(|row| row[2] < row[3]).count();
    page.claims.add(
        "reparameterisation about the mirror direction makes tables compact",
        "\"combined with reparameterization, allows us to store general BRDFs in around 300 kB\"",
        format!(
            "lower error with 2 % of the coefficients for {fewer} of {n} materials, between slices for {nearer} of {n}",
            n = rows.len()
        ),
        2 * nearer > rows.len(),
        &format!(
            "it helps where lobes move: {helped} of the {} whose slices about the normal are off by more than {DIFFERENT}; about the normal, horizon and cosine stay in place, which is better for diffuse ones",
            glossy.len()
        ),
    );
    Ok(())
}

/// The relative L2 error of slices a third of the way from one of the table to the next, by interpolation.
fn between(fine: &[Vec<f32>]) -> f64 {
    let (mut squares, mut whole) = (0.0, 0.0);
    for first in (1..fine.len() - 3).step_by(3) {
        let [a, exact, b] = [&fine[first], &fine[first + 1], &fine[first + 3]];
        for ((a, b), exact) in a.iter().zip(b).zip(exact) {
            let value = (2.0 * f64::from(*a) + f64::from(*b)) / 3.0;
            squares += (value - f64::from(*exact)).powi(2);
            whole += f64::from(*exact).powi(2);
        }
    }
    (squares / whole).sqrt()
}

const TEXT: &str = "Every BRDF file at hand, BRDF x cosine about the mirror direction (`wis_wavelet_table_directions`, four places in a pixel).
Errors: relative L2 over the whole table in luminance, if so many of all wavelets are kept, the largest of all slices, as the
paper does. Then the size of trees of whole squares whose error is at most that of 2 % of the wavelets. They hold no negative
values, and can be sampled, multiplied and blended. The paper has a slice for each of two angles of the view. An isotropic BRDF
depends on its elevation alone: it has as many different slices as elevations. Colour is measured: three tables, each to that
error. Materials without _rgb are the Cornell sets, whose colours are not read: 1439 pairs of directions, spread by their
nearest neighbours.
";

const TURNED: &str = "16 slices of 64 x 64, both ways with four places in a pixel. *2 % of the coefficients*: the error of the slices themselves.
About the mirror direction the horizon lies askew to the grid, which costs coefficients; a lobe at the middle of the grid saves
some. *Between slices*: the error a third of the way to the next elevation, by interpolation. About the mirror direction a lobe
stays where it is, which helps glossy materials. About the normal the horizon and the cosine stay, which helps diffuse ones.
";

fn slices_of(value: Value, slices: u32, depth: u32) -> Result<Vec<Vec<f32>>> {
    (0..slices).map(|slice| Ok(table::pixels(slice, slices, depth, PLACES, value)?)).collect()
}

/// The same slices about the normal.
fn unturned(value: Value, slices: u32, depth: u32) -> Vec<Vec<f32>> {
    let (side, places) = (1usize << depth, PLACES as usize);
    let slice = |slice: u32| {
        let angle = std::f64::consts::FRAC_PI_2 * (f64::from(slice) + 0.5) / f64::from(slices);
        let wo = glam::dvec3(angle.sin(), 0.0, angle.cos());
        let place = |i: usize, k: usize| {
            let (row, column) = (places * (i / side) + k / places, places * (i % side) + k % places);
            value(wo, crate::middle(row * places * side + column, places * side).as_dvec3().normalize())
        };
        let mean = |i: usize| (0..places * places).map(|k| place(i, k)).sum::<f64>() / (places * places) as f64;
        (0..side * side).map(|i| mean(i) as f32).collect()
    };
    (0..slices).map(slice).collect()
}

fn energy(pixels: &[Vec<f32>]) -> f64 {
    pixels.iter().flatten().map(|&x| f64::from(x).powi(2)).sum::<f64>() / pixels[0].len() as f64
}

/// The relative L2 error if a share of all wavelets is kept, the largest of all slices.
fn by_share(pixels: &[Vec<f32>], depth: u32) -> Result<[f64; 4]> {
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

/// The bytes of trees with one error budget for all slices, the largest with which they lose no more.
fn smallest(pixels: &[Vec<f32>], depth: u32, error: f64) -> Result<u64> {
    let whole = energy(pixels);
    let (mut low, mut high) = (1e-9f32, 30.0f32);
    let build = |budget: f32| -> Result<(u64, f64)> {
        let (mut bytes, mut kept) = (0, 0.0);
        for slice in pixels {
            let tree = Tree::new(depth, budget, slice)?;
            bytes += tree.info.bytes;
            // A tree of whole squares is a projection: what it loses is what its wavelets lack.
            let wavelets = tree.largest(3 << (2 * depth))?;
            kept += tree.info.average.powi(2) + wavelets.iter().flat_map(energies_of).sum::<f64>();
        }
        Ok((bytes, ((whole - kept).max(0.0) / whole).sqrt()))
    };
    let mut bytes = build(0.0)?.0;
    for _ in 0..12 {
        let middle = (low * high).sqrt();
        let (size, lost) = build(middle)?;
        if lost <= error {
            (low, bytes) = (middle, bytes.min(size));
        } else {
            high = middle;
        }
    }
    Ok(bytes)
}
