//! What frames about the mirror direction do to the sparsity of tables, and to what lies between their slices: for lobes that
//! differ in one thing at a time, then for the measured ones.

use crate::compression::{PLACES, by_share};
use crate::middle;
use anyhow::Result;
use glam::{DMat3, DVec3, dvec3};
use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt::Write;
use wis_ffi_tests::data::{Brdf, Value};
use wis_ffi_tests::paper::Paper;

const SLICES: u32 = 16;
const DEPTH: u32 = 6;
/// Of the shares of `by_share`, the one of 2 %.
const TWO_PERCENT: usize = 2;
/// How far beside the mirror direction the third frame stands, radians.
const BESIDE: f64 = PI / 9.0;
/// Rows of the table from which the reason is read.
const HORIZON: usize = 0;
const COSINE: usize = 1;
const LOBE: usize = 3;

/// Errors about the mirror direction, the normal, and a direction beside the mirror; and between slices about the first two.
struct Row {
    sparse: [f64; 3],
    between: [f64; 2],
}

/// Writes the section.
pub fn write(page: &mut Paper, brdfs: &[Brdf]) -> Result<()> {
    writeln!(page.text, "\n### Reparameterisation\n\n{TEXT}")?;
    writeln!(
        page.text,
        "| function | 2 % of the coefficients: mirror | normal | beside the mirror | between slices: mirror | normal |\n\
         |---|---:|---:|---:|---:|---:|"
    )?;
    let mut simple = Vec::new();
    for (name, value) in &lobes() {
        simple.push(row(page, name, value)?);
    }
    let mut rows = Vec::new();
    for brdf in brdfs {
        rows.push(row(page, &brdf.name, &brdf.value)?);
    }
    let reasons = reasons(&simple);
    writeln!(page.text, "\n{}", reasons.join("\n"))?;
    let fewer = rows.iter().filter(|row| row.sparse[0] < row.sparse[1]).count();
    let nearer = rows.iter().filter(|row| row.between[0] < row.between[1]).count();
    page.claims.add(
        "reparameterisation about the mirror direction makes tables compact",
        "\"combined with reparameterization, allows us to store general BRDFs in around 300 kB\"",
        format!(
            "lower error with 2 % of the coefficients for {fewer} of {n} materials, between slices for {nearer} of {n}",
            n = rows.len()
        ),
        2 * fewer > rows.len() && 2 * nearer > rows.len(),
        &reasons.join(" "),
    );
    Ok(())
}

fn row(page: &mut Paper, name: &str, value: &Value) -> Result<Row> {
    // About the view's mirror image, the normal, and beside the mirror image.
    let frames: [fn(f64) -> f64; 3] = [|view| -view, |_| 0.0, |view| BESIDE - view];
    let (mut sparse, mut between) = ([0.0; 3], [0.0; 2]);
    for (k, frame) in frames.into_iter().enumerate() {
        // Every third of these slices is one of the table.
        let fine = slices(value, frame);
        let coarse: Vec<_> = fine.iter().skip(1).step_by(3).cloned().collect();
        sparse[k] = by_share(&coarse, DEPTH)?[TWO_PERCENT];
        between.iter_mut().skip(k).take(1).for_each(|error| *error = interpolated(&fine));
    }
    let cells = sparse.iter().chain(&between).map(|error| format!("{error:.3}")).collect::<Vec<_>>();
    writeln!(page.text, "| {name} | {} |", cells.join(" | "))?;
    Ok(Row { sparse, between })
}

/// Functions that have a horizon, a cosine or a lobe, or more than one of them.
fn lobes() -> Vec<(String, Value)> {
    let mut lobes: Vec<(String, Value)> = vec![
        ("horizon alone".into(), Box::new(|_, wi| if wi.z > 0.0 { 1.0 } else { 0.0 })),
        ("horizon and cosine: Lambert".into(), Box::new(|_, wi| wi.z.max(0.0))),
    ];
    for exponent in [10, 50, 200] {
        lobes.push((format!("lobe alone: Phong {exponent}"), Box::new(move |wo, wi| phong(wo, wi, exponent))));
    }
    lobes.push(("Phong 50 with horizon and cosine".into(), Box::new(|wo, wi| phong(wo, wi, 50) * wi.z.max(0.0))));
    for alpha in [0.1, 0.5] {
        lobes.push((format!("GGX {alpha} with horizon and cosine"), Box::new(move |wo, wi| ggx(wo, wi, alpha))));
    }
    lobes
}

fn phong(wo: DVec3, wi: DVec3, exponent: i32) -> f64 {
    dvec3(-wo.x, -wo.y, wo.z).dot(wi).max(0.0).powi(exponent)
}

/// BRDF x cosine without Fresnel's term, with Smith's masking of both directions apart.
fn ggx(wo: DVec3, wi: DVec3, alpha: f64) -> f64 {
    if wi.z <= 0.0 {
        return 0.0;
    }
    let (squared, half) = (alpha * alpha, (wo + wi).normalize().z);
    let density = squared / (PI * (half * half * (squared - 1.0) + 1.0).powi(2));
    let seen = |cosine: f64| 2.0 * cosine / (cosine + (squared + (1.0 - squared) * cosine * cosine).sqrt());
    density * seen(wo.z) * seen(wi.z) / (4.0 * wo.z)
}

/// Slices of three times as many views as the table has, in frames that a function of the view's angle turns from the
/// normal.
fn slices(value: &Value, frame: fn(f64) -> f64) -> Vec<Vec<f32>> {
    let (side, places) = (1usize << DEPTH, PLACES as usize);
    let slice = |slice: u32| {
        let view = FRAC_PI_2 * (f64::from(slice) + 0.5) / f64::from(3 * SLICES);
        let (wo, turn) = (dvec3(view.sin(), 0.0, view.cos()), DMat3::from_rotation_y(frame(view)));
        let place = |i: usize, k: usize| {
            let (row, column) = (places * (i / side) + k / places, places * (i % side) + k % places);
            value(wo, turn * middle(row * places * side + column, places * side).as_dvec3().normalize())
        };
        let mean = |i: usize| (0..places * places).map(|k| place(i, k)).sum::<f64>() / (places * places) as f64;
        (0..side * side).map(|i| mean(i) as f32).collect()
    };
    (0..3 * SLICES).map(slice).collect()
}

/// The relative L2 error of slices a third of the way from one of the table to the next, by interpolation.
fn interpolated(fine: &[Vec<f32>]) -> f64 {
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

/// What the simple functions say, a sentence each.
fn reasons(rows: &[Row]) -> Vec<String> {
    let [horizon, cosine, lobe] = [HORIZON, COSINE, LOBE].map(|i| &rows[i]);
    let against = |mirror: f64, normal: f64| {
        let word = if mirror < normal { "lower" } else { "higher" };
        format!("{word} about the mirror direction: {mirror:.3} against {normal:.3}.")
    };
    let sparse = |row: &Row| against(row.sparse[0], row.sparse[1]);
    let between = |row: &Row| against(row.between[0], row.between[1]);
    let mut reasons = vec![
        format!("With 2 % of the coefficients the error of horizon and cosine alone is {}", sparse(cosine)),
        format!("That of a lobe alone (Phong 50) is {}", sparse(lobe)),
        format!("Between slices the error of a horizon alone is {}", between(horizon)),
        format!("Between slices that of the lobe is {}", between(lobe)),
    ];
    let [centre, _, beside] = lobe.sparse;
    if beside < centre {
        let degrees = BESIDE.to_degrees();
        let where_it_meets = "The lobe's loss is the middle of the grid, where four quadrants of the Haar tree meet";
        reasons.insert(2, format!("{where_it_meets}: {degrees:.0} degrees beside it the error is {beside:.3}."));
    }
    reasons
}

const TEXT: &str = "16 slices of 64 x 64 in three frames: about the mirror direction, about the normal, and 20 degrees beside the mirror direction.
First come functions that have only a horizon, a cosine or a lobe; then the measured ones. *2 % of the coefficients*: the error of
the slices themselves. *Between slices*: the error a third of the way to the next elevation, by interpolation.
";
