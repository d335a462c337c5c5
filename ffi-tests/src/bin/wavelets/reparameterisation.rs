//! What frames about the mirror direction do to tables of the BRDF itself: with the wavelets that a table keeps, and between its slices.
//! Cosine and horizon move in that frame. They belong to the normal, so they are multiplied when a table is read.

use crate::compression::{PLACES, TWO_PERCENT, sparse};
use crate::middle;
use anyhow::Result;
use glam::{DMat3, DVec3, dvec3};
use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt::Write;
use wis_ffi_tests::client::Tree;
use wis_ffi_tests::data::{Brdf, Value};
use wis_ffi_tests::paper::{Paper, Verdict, columns};

const SLICES: u32 = 16;
const DEPTH: u32 = 6;
/// The mirror direction stands so far beside the middle of the square, where four quadrants of the Haar tree meet, and beside its axes.
const BESIDE: [f64; 2] = [PI / 9.0, PI / 7.0];
/// The least cosine that a BRDF x cosine is divided by.
const GRAZING: f64 = 0.02;

/// Errors with 2 % of the coefficients and between slices, about the mirror direction and about the normal.
struct Row([[f64; 2]; 2]);

impl Row {
    /// The error of a table: both parts are apart from each other.
    fn whole(&self, frame: usize) -> f64 {
        self.0[frame][0].hypot(self.0[frame][1])
    }
}

/// Writes the section.
pub fn write(page: &mut Paper, brdfs: &[Brdf]) -> Result<()> {
    page.heading("Reparameterisation")?;
    columns(
        &mut page.text,
        1,
        "BRDF | mirror: 2 % of the coefficients | between slices | both | normal: 2 % of the coefficients | between slices | both",
    )?;
    let phong = |wo: DVec3, wi: DVec3| dvec3(-wo.x, -wo.y, wo.z).dot(wi).max(0.0).powi(50) * wi.z.max(0.0);
    let lobe = Brdf { name: "Phong 50".into(), value: Box::new(phong), channels: None };
    let mut rows = Vec::new();
    for brdf in std::iter::once(&lobe).chain(brdfs) {
        let row = Row([
            frame(&brdf.value, |view| DMat3::from_rotation_y(BESIDE[0] - view) * DMat3::from_rotation_z(BESIDE[1]))?,
            frame(&brdf.value, |_| DMat3::IDENTITY)?,
        ]);
        let cells = [0, 1].map(|k| format!("{:.3} | {:.3} | {:.3}", row.0[k][0], row.0[k][1], row.whole(k)));
        writeln!(page.text, "| {} | {} |", brdf.name, cells.join(" | "))?;
        rows.push(row);
    }
    let measured = &rows[1..];
    let lower = measured.iter().filter(|row| row.whole(0) < row.whole(1)).count();
    let ratio = |row: &Row| row.whole(0) / row.whole(1);
    page.claim(
        "reparameterisation about the mirror",
        Verdict::Untested.unless(2 * lower > measured.len()),
        &[&lower, &measured.len(), &ratio(&rows[0])],
    );
    Ok(())
}

/// The errors of slices of 16 views in a frame that a view has.
fn frame(value: &Value, frame: impl Fn(f64) -> DMat3) -> Result<[f64; 2]> {
    // Every third of these slices is one of the table.
    let fine: Vec<_> = (0..3 * SLICES).map(|k| slice(value, k, &frame)).collect();
    let trees = fine.iter().skip(1).step_by(3).map(|pixels| Ok(Tree::new(DEPTH, 0.0, pixels)?));
    let trees = trees.collect::<Result<Vec<_>>>()?;
    Ok([sparse(&trees, DEPTH, TWO_PERCENT)?.1, interpolated(&fine)])
}

/// The BRDF without cosine, below the horizon its image above.
pub fn bare(value: &Value, wo: DVec3, wi: DVec3) -> f64 {
    let wi = dvec3(wi.x, wi.y, wi.z.abs().max(GRAZING)).normalize();
    value(wo, wi) / wi.z
}

/// Its pixels for a view.
fn slice(value: &Value, number: u32, frame: impl Fn(f64) -> DMat3) -> Vec<f32> {
    let (side, places) = (1usize << DEPTH, PLACES as usize);
    let view = FRAC_PI_2 * (f64::from(number) + 0.5) / f64::from(3 * SLICES);
    let (wo, turn) = (dvec3(view.sin(), 0.0, view.cos()), frame(view));
    let place = |i: usize, k: usize| {
        let (row, column) = (places * (i / side) + k / places, places * (i % side) + k % places);
        bare(value, wo, turn * middle(row * places * side + column, places * side).as_dvec3())
    };
    let mean = |i: usize| (0..places * places).map(|k| place(i, k)).sum::<f64>() / (places * places) as f64;
    (0..side * side).map(|i| mean(i) as f32).collect()
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
