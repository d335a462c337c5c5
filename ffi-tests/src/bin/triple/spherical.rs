//! Haar wavelets beside pixels and spherical harmonics: how well so many terms approximate a light (Section 6.1).

use anyhow::Result;
use std::fmt::Write;
use wis_ffi_tests::client::Tree;
use wis_ffi_tests::data;
use wis_ffi_tests::light::octahedral_direction;
use wis_ffi_tests::packed::energy;
use wis_ffi_tests::paper::{Paper, columns};

/// Pixels of the lights.
const DEPTH: u32 = 7;
const SIDE: usize = 1 << DEPTH;
/// The highest degree.
const DEGREE: usize = 39;
const TERMS: [usize; 6] = [9, 25, 100, 400, 900, 1600];
const LIGHTS: [&str; 5] =
    ["grace_latlong.exr", "galileo_cross.hdr", "rnl_cross.hdr", "studio_small_03_1k.hdr", "potsdamer_platz_1k.hdr"];

/// Terms from which on the bases are compared, how much further off than the best a basis may be that follows a light, and how
/// much further off one is that does not.
const COMPARED: usize = 400;
const FOLLOWS: f64 = 1.1;
const BEHIND: f64 = 2.0;

/// Writes the section.
pub fn write(page: &mut Paper) -> Result<()> {
    page.heading("Approximation in three bases (Section 6.1)")?;
    let out = &mut page.text;
    let mut compared = Vec::new();
    let basis = basis();
    for name in LIGHTS {
        let light = data::light(name)?;
        let pixels = light.on_octahedron(SIDE, 4);
        writeln!(out, "### {}\n", light.name)?;
        columns(out, 0, "terms | of all | pixels | harmonics, lowest | harmonics, largest | Haar, largest")?;
        compared.push((light.name.clone(), table(out, &pixels, &basis)?));
        writeln!(out)?;
    }
    claim(page, &compared);
    Ok(())
}

/// Errors of pixels, of the better harmonics and of wavelets.
type Errors = [f64; 3];

/// Wavelets follow each light as well as the better of the others does, and each of the others is far behind on some light.
fn claim(page: &mut Paper, compared: &[(String, Vec<(usize, Errors)>)]) {
    let rows = || compared.iter().flat_map(|(_, rows)| rows);
    let later = || rows().filter(|(terms, _)| *terms >= COMPARED).map(|(_, errors)| *errors);
    let ratio = |[pixels, harmonics, wavelets]: Errors| wavelets / pixels.min(harmonics);
    let worst = later().map(ratio).fold(0.0, f64::max);
    let first = || rows().filter(|(terms, _)| *terms == COMPARED).map(|(_, errors)| *errors);
    let behind = |k: usize| first().map(|errors| errors[k] / errors[2]).fold(0.0, f64::max);
    let before = rows().filter(|(terms, _)| *terms < COMPARED).map(|(_, errors)| ratio(*errors)).fold(0.0, f64::max);
    let list = |k: usize| first().map(|errors| format!("{:.3}", errors[k])).collect::<Vec<_>>().join(", ");
    let names = compared.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ");
    page.claim(
        "wavelets approximate lights of",
        worst <= FOLLOWS && behind(0) >= BEHIND && behind(1) >= BEHIND,
        &[&COMPARED, &names, &list(2), &list(0), &list(1), &worst],
    );
    page.text += &format!(
        "With fewer than {COMPARED} terms, wavelets are up to {before:.1} times as far off as the better of the others.\n"
    );
}

/// The real spherical harmonics at the pixels, pixel by pixel.
fn basis() -> Vec<Vec<f64>> {
    let at = |c: usize| (c as f32 + 0.5) / SIDE as f32;
    (0..SIDE * SIDE).map(|i| harmonics(octahedral_direction(at(i % SIDE), at(i / SIDE)).as_dvec3())).collect()
}

/// The real, orthonormal spherical harmonics up to the highest degree: degree by degree, orders from -l to l.
fn harmonics(d: glam::DVec3) -> Vec<f64> {
    let (z, phi) = (d.z.clamp(-1.0, 1.0), d.y.atan2(d.x));
    let sine = (1.0 - z * z).sqrt();
    let mut values = vec![0.0; (DEGREE + 1) * (DEGREE + 1)];
    // Normalised associated Legendre functions: along the diagonal l = m, then upwards in l.
    let mut diagonal = (0.25 / std::f64::consts::PI).sqrt();
    for m in 0..=DEGREE {
        if m > 0 {
            diagonal *= sine * ((2 * m + 1) as f64 / (2 * m) as f64).sqrt();
        }
        let (mut before, mut value) = (0.0, diagonal);
        for l in m..=DEGREE {
            if l > m {
                let square = |x: usize| (x * x) as f64;
                let a = ((4.0 * square(l) - 1.0) / (square(l) - square(m))).sqrt();
                let b = ((square(l - 1) - square(m)) / (4.0 * square(l - 1) - 1.0)).sqrt();
                let next = a * (z * value - b * before);
                (before, value) = (value, next);
            }
            let (sin, cos) = (m as f64 * phi).sin_cos();
            let scale = if m > 0 { std::f64::consts::SQRT_2 } else { 1.0 };
            values[l * (l + 1) + m] = scale * value * cos;
            if m > 0 {
                values[l * (l + 1) - m] = scale * value * sin;
            }
        }
    }
    values
}

/// Writes the table; returns its terms and errors.
fn table(out: &mut String, pixels: &[f32], basis: &[Vec<f64>]) -> Result<Vec<(usize, Errors)>> {
    let count = pixels.len() as f64;
    let total: f64 = pixels.iter().map(|p| f64::from(*p).powi(2)).sum();
    let mut coefficients = vec![0.0; basis[0].len()];
    for (pixel, row) in pixels.iter().zip(basis) {
        let weight = f64::from(*pixel) * 4.0 * std::f64::consts::PI / count;
        coefficients.iter_mut().zip(row).for_each(|(c, y)| *c += weight * y);
    }
    let mut order: Vec<usize> = (0..coefficients.len()).collect();
    order.sort_by(|a, b| coefficients[*b].abs().total_cmp(&coefficients[*a].abs()));
    let lowest: Vec<usize> = (0..coefficients.len()).collect();
    let harmonic = |chosen: &[usize]| {
        let off = pixels.iter().zip(basis).map(|(pixel, row)| {
            let value: f64 = chosen.iter().map(|&k| coefficients[k] * row[k]).sum();
            (value - f64::from(*pixel)).powi(2)
        });
        (off.sum::<f64>() / total).sqrt()
    };
    let mut bright: Vec<f64> = pixels.iter().map(|p| f64::from(*p).powi(2)).collect();
    bright.sort_by(|a, b| b.total_cmp(a));
    let tree = Tree::new(DEPTH, 0.0, pixels)?;
    let mut compared = Vec::new();
    for terms in TERMS {
        let rest: f64 = bright.iter().skip(terms).sum();
        // The mean is one of the terms.
        let kept = tree.largest(terms as u32 - 1)?;
        let energy: f64 = kept.iter().map(energy).sum();
        let haar = (1.0 - (tree.info.average.powi(2) + energy) * count / total).max(0.0).sqrt();
        let (by_pixels, by_lowest, by_largest) =
            ((rest / total).sqrt(), harmonic(&lowest[..terms]), harmonic(&order[..terms]));
        writeln!(
            out,
            "| {terms} | {:.2} % | {by_pixels:.3} | {by_lowest:.3} | {by_largest:.3} | {haar:.3} |",
            100.0 * terms as f64 / count
        )?;
        compared.push((terms, [by_pixels, by_lowest.min(by_largest), haar]));
    }
    Ok(compared)
}
