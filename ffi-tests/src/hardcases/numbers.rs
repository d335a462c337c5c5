//! Random numbers at splits and at the ends, and counts of samples.

use super::laws::{self, Verdict, ensure};
use super::light::{TILTED, diffuse};
use super::maps::sky;
use super::table::Table;
use crate::client::{self, Density, Environment, Light, Map, Preparation, Product, raw};
use std::ptr::null;

/// Adds the cases.
pub fn add(table: &mut Table) {
    splits(table);
    counts(table);
}

/// Two by two texels whose splits are all 1 : 3, so that u below 1/4 leads to the lower side of each axis.
fn quarters() -> Result<Environment, String> {
    let texels = [1.0, 3.0, 3.0, 9.0];
    let flags = raw::WIS_WAVELET_LIGHT_NEAREST;
    Ok(Environment::new(&Map { flags, resolution: 2, ..Map::octahedral(2, &texels) })?)
}

fn splits(table: &mut Table) {
    let below = |x: f32| f32::from_bits(x.to_bits() - 1);
    let above = |x: f32| f32::from_bits(x.to_bits() + 1);
    let last = 1.0 - 1.0 / 16_777_216.0;
    // The number, its name, and the number that it must be the same as.
    let cases = [
        ("0", 0.0, 0.0),
        ("-0.0", -0.0, 0.0),
        ("2^-149", f32::from_bits(1), f32::from_bits(1)),
        ("the number below a split", below(0.25), below(0.25)),
        ("a split", 0.25, 0.25),
        ("the number above a split", above(0.25), above(0.25)),
        ("0.5", 0.5, 0.5),
        ("the number below 1 - 2^-24", below(last), below(last)),
        ("1 - 2^-24", last, last),
        ("1", 1.0, last),
        ("2", 2.0, last),
        ("+Inf", f32::INFINITY, last),
        ("-2^-149", -f32::from_bits(1), 0.0),
        ("-Inf", f32::NEG_INFINITY, 0.0),
        ("NaN", f32::NAN, 0.5),
    ];
    for (name, u, same) in cases {
        let side = if same < 0.25 { "lower" } else { "upper" };
        let expected = format!("the {side} side of a split at 1/4; the bits of u = {same:e}");
        table.add(format!("u = {name}"), expected, split(u, same));
    }
}

fn split(u: f32, same: f32) -> Verdict {
    let environment = quarters()?;
    let light = environment.light(None);
    let sample = light.sample([u, u])?;
    let twin = light.sample([same, same])?;
    ensure(sample.wi.map(f32::to_bits) == twin.wi.map(f32::to_bits), || format!("{sample:?}, not {twin:?}"))?;
    ensure(sample.pdf.to_bits() == light.pdf(sample.wi)?.to_bits(), || format!("{sample:?}"))?;
    // A quarter of the sphere has a sixteenth of the light on the lower side of both axes, nine on the upper.
    let quarter = f64::from(sample.pdf) * std::f64::consts::PI;
    let parts = if same < 0.25 { 1.0 } else { 9.0 };
    ensure((16.0 * quarter - parts).abs() < 1e-5, || format!("{sample:?} lies on the other side"))?;
    Ok(format!("{} side, pdf {:.5}", if parts == 1.0 { "lower" } else { "upper" }, sample.pdf))
}

fn counts(table: &mut Table) {
    let expected = "status ok, nothing read or written, null pointers allowed";
    table.add("N = 0", expected, none());
    for count in [1, 1 << 20] {
        table.add(format!("N = {count}"), "the bits of single calls; every pdf finite, above 0", many(count));
    }
}

fn none() -> Verdict {
    let environment = Environment::new(&sky().map())?;
    let light: Light = environment.light(None);
    light.sample_n(&[], &mut [], &mut [])?;
    light.pdf_n(&[], &mut [])?;
    let null_mut = std::ptr::null_mut();
    // SAFETY: 0 elements are read or written.
    let status = unsafe { raw::wis_wavelet_sample(environment.handle(), null(), null(), 0, null(), 0, null_mut, 0) };
    ensure(status == raw::WIS_OK, || format!("status {status}"))?;
    client::sobol(1, 0, &mut [])?;
    Ok("ok".into())
}

fn many(count: usize) -> Verdict {
    let environment = Environment::new(&sky().map())?;
    let preparation = Preparation::default();
    let mut memory = preparation.memory()?;
    let product = Product::prepare(&environment, &diffuse(TILTED), &preparation, &mut memory)?;
    let mut u = vec![[0.0; 2]; count];
    client::sobol(3, 0, &mut u)?;
    batch(&environment.light(None), &u)?;
    batch(&product, &u)?;
    laws::legal(&product)?;
    Ok("the same bits".into())
}

fn batch(density: &impl Density, u: &[[f32; 2]]) -> Result<(), String> {
    let (mut wi, mut pdf) = (vec![[0.0; 3]; u.len()], vec![0.0; u.len()]);
    density.sample_n(u, &mut wi, &mut pdf)?;
    for ((u, wi), pdf) in u.iter().zip(&wi).zip(&pdf) {
        let single = density.sample(*u)?;
        let same = single.wi.map(f32::to_bits) == wi.map(f32::to_bits) && single.pdf.to_bits() == pdf.to_bits();
        ensure(same && *pdf > 0.0 && pdf.is_finite(), || format!("u = {u:?}: {single:?}"))?;
    }
    Ok(())
}
