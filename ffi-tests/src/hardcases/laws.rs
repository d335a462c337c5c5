//! What holds for every density, whatever the input: the laws that the cases check.

use super::maps::octahedral_direction;
use crate::client::{self, Density, Failure, raw};
use std::f64::consts::PI;

/// What was observed; `Err` if it is not what the header documents.
pub type Verdict = Result<String, String>;

impl From<Failure> for String {
    fn from(failure: Failure) -> String {
        format!("status {failure}")
    }
}

/// `Err` with a text unless the condition holds.
pub fn ensure(condition: bool, fault: impl FnOnce() -> String) -> Result<(), String> {
    if condition { Ok(()) } else { Err(fault()) }
}

/// Numbers that are hard to split by, inside and outside [0, 1).
pub const EDGES: [f32; 13] = [
    0.0,
    f32::from_bits(1),
    1.0 / 16_777_216.0,
    0.25,
    f32::from_bits(0x3eff_ffff),
    0.5,
    f32::from_bits(0x3f00_0001),
    1.0 - 1.0 / 16_777_216.0,
    1.0,
    2.0,
    -1.0,
    f32::INFINITY,
    f32::NAN,
];

/// Every pair of edges, and a low-discrepancy set.
pub fn points() -> Vec<[f32; 2]> {
    let mut points = crate::points::of(1, 1024);
    points.extend(EDGES.iter().flat_map(|&a| EDGES.map(|b| [a, b])));
    points
}

fn bits(v: &[f32]) -> Vec<u32> {
    v.iter().map(|x| x.to_bits()).collect()
}

/// Samples of a density that is not 0: see the page's preamble for what is legal.
pub fn legal(density: &impl Density) -> Result<(), String> {
    legal_but(density, false)
}

/// The same of a product with narrow lobes: those alone lead to some directions, which `invert` then tells.
pub fn legal_with_lobes(density: &impl Density) -> Result<(), String> {
    legal_but(density, true)
}

fn legal_but(density: &impl Density, may_be_unreachable: bool) -> Result<(), String> {
    let u = points();
    let (mut drawn, mut again) = (vec![raw::wis_drawn::default(); u.len()], vec![0.0; u.len()]);
    density.sample_n(&u, &mut drawn)?;
    let (wi, pdf): (Vec<_>, Vec<_>) = drawn.iter().map(|drawn| (drawn.wi, drawn.pdf)).unzip();
    density.pdf_n(&wi, &mut again)?;
    ensure(bits(&pdf) == bits(&again), || "pdf_n differs from sample_n".into())?;
    for ((u, wi), pdf) in u.iter().zip(&wi).zip(&pdf) {
        let single = density.sample(*u)?;
        let at = || format!("u = {u:?}: {single:?}");
        ensure(bits(&single.wi) == bits(wi) && single.pdf.to_bits() == pdf.to_bits(), at)?;
        ensure(single.pdf > 0.0 && single.pdf.is_finite(), at)?;
        let length: f32 = wi.iter().map(|x| x * x).sum();
        ensure((length - 1.0).abs() < 1e-6, at)?;
        let answered = density.pdf(*wi)?;
        ensure(answered.to_bits() == pdf.to_bits(), || format!("{}, pdf(wi) = {answered}", at()))?;
        let back = match density.invert(*wi) {
            Err(failure) if may_be_unreachable && failure.status == raw::WIS_UNREACHABLE => continue,
            back => back?,
        };
        ensure(back.iter().all(|u| (0.0..1.0).contains(u)), || format!("{}, invert {back:?}", at()))?;
    }
    Ok(())
}

/// A density of nothing: samples and pdfs 0, and nothing to invert.
pub fn nothing(density: &impl Density) -> Result<(), String> {
    for u in points() {
        let sample = density.sample(u)?;
        ensure(sample.pdf == 0.0, || format!("u = {u:?}: {sample:?}"))?;
    }
    for wi in [[0.0, 0.0, 1.0], [0.6, 0.0, -0.8], [0.0, 1.0, 0.0]] {
        let pdf = density.pdf(wi)?;
        ensure(pdf == 0.0, || format!("pdf({wi:?}) = {pdf}"))?;
        let status = density.invert(wi).map_or_else(|failure| failure.status, |_| raw::WIS_OK);
        ensure(status == raw::WIS_ZERO_DENSITY, || format!("invert: status {status}"))?;
    }
    Ok(())
}

/// The integral of a density that is constant on cells of the octahedral square, `side` along each axis.
pub fn mass(density: &impl Density, side: u32) -> Result<f64, String> {
    let centre = |i: u32| (f64::from(i) + 0.5) / f64::from(side);
    let mut sum = 0.0;
    for (i, j) in (0..side).flat_map(|i| (0..side).map(move |j| (i, j))) {
        sum += f64::from(density.pdf(octahedral_direction([centre(i), centre(j)]))?);
    }
    Ok(sum * 4.0 * PI / f64::from(side).powi(2))
}

/// The call fails with this status.
pub fn fails<T>(result: client::Result<T>, status: raw::wis_status) -> Result<Failure, String> {
    match result {
        Err(failure) if failure.status == status => Ok(failure),
        Err(failure) => Err(failure.into()),
        Ok(_) => Err("status ok".into()),
    }
}
