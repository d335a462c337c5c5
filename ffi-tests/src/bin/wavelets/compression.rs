//! What tables of measured BRDFs take: error against size (Fig. 10).

use anyhow::Result;
use std::fmt::Write;
use wis_ffi_tests::client::{Tree, raw};
use wis_ffi_tests::data::{self, Brdf};
use wis_ffi_tests::table;

const SHARES: [f64; 4] = [0.005, 0.01, 0.02, 0.05];
/// Slices and levels of the paper's two tables, and what is asked of them in kB.
const TABLES: [(u32, u32, f64); 2] = [(16, 6, 100.0), (32, 7, 1500.0)];

/// Writes the section.
pub fn write(out: &mut String) -> Result<()> {
    writeln!(out, "\n## Compression of measured BRDFs (Fig. 10)\n\n{TEXT}")?;
    let brdfs = data::all_brdfs()?;
    for (slices, depth, goal) in TABLES {
        let side = 1 << depth;
        writeln!(out, "### {slices} x {slices} x {side} x {side}, goal {goal:.0} kB\n")?;
        writeln!(
            out,
            "| material | .5 % | 1 % | 2 % | 5 % | without reparameterisation, 2 % | trees, kB | three colours | .5 % | 5 % |"
        )?;
        writeln!(out, "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|")?;
        let mut worst = (String::new(), 0.0);
        for brdf in &brdfs {
            let pixels = slices_of(brdf, slices, depth)?;
            let (errors, plain) = (by_share(&pixels, depth)?, by_share(&unturned(brdf, slices, depth), depth)?);
            let kb = |error: f64| -> Result<f64> { Ok(smallest(&pixels, depth, error)? as f64 / 1e3) };
            let trees = kb(errors[2])?;
            writeln!(
                out,
                "| {} | {} | {:.3} | {trees:.1} | {:.1} | {:.1} | {:.1} |",
                brdf.name,
                errors.map(|error| format!("{error:.3}")).join(" | "),
                plain[2],
                3.0 * trees,
                kb(errors[0])?,
                kb(errors[3])?
            )?;
            if trees > worst.1 {
                worst = (brdf.name.clone(), trees);
            }
        }
        let (name, trees) = worst;
        writeln!(out, "\nThe largest: {name}, {trees:.1} kB in luminance, {:.1} in three colours.\n", 3.0 * trees)?;
    }
    Ok(())
}

const TEXT: &str = "Every BRDF file at hand, luminance of BRDF x cosine about the mirror direction (`wis_wavelet_table_directions`, four places in a
pixel). Errors: relative L2 over the whole table, if so many of all wavelets are kept, the largest of all slices, as the paper
does. Then the size of trees of whole squares whose error is at most that of 2 % of the wavelets, and at most those of .5 and
5 %: they hold no negative values, can be sampled, multiplied and blended. An isotropic table has as many different slices as
elevations. The paper: about 300 kB and 5 MB in colour, at 1.5 to 2 %. The four files without _rgb are the Cornell sets:
1439 pairs of directions, spread by their nearest neighbours.
";

fn slices_of(brdf: &Brdf, slices: u32, depth: u32) -> Result<Vec<Vec<f32>>> {
    (0..slices).map(|slice| Ok(table::pixels(slice, slices, depth, 2, |wo, wi| (brdf.value)(wo, wi))?)).collect()
}

/// The same slices about the normal.
fn unturned(brdf: &Brdf, slices: u32, depth: u32) -> Vec<Vec<f32>> {
    let side = 1usize << depth;
    let slice = |slice: u32| {
        let angle = std::f64::consts::FRAC_PI_2 * (f64::from(slice) + 0.5) / f64::from(slices);
        let wo = glam::dvec3(angle.sin(), 0.0, angle.cos());
        (0..side * side).map(|i| (brdf.value)(wo, crate::middle(i, side).as_dvec3()) as f32).collect()
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
