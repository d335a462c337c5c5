//! BRDFs that the client evaluates: narrow, black, wrong and failing.

use super::laws::{self, Verdict, ensure, fails};
use super::maps::sky;
use super::table::Table;
use crate::client::{self, CallbackShape, Environment, Preparation, Product, raw};

const UP: [f32; 3] = [0.0, 0.0, 1.0];
const SHAPE: CallbackShape = CallbackShape { flags: 0, normal: UP, peak: [0.0; 3], half_angle: 0.0 };

/// Adds the cases.
pub fn add(table: &mut Table) {
    let legal = "legal samples; pdf > 0 wherever the BRDF is";
    table.add("callback: diffuse", legal, answers(&SHAPE, |wi| wi[2].max(0.0)));
    table.add("callback: 1e-40 times diffuse", legal, answers(&SHAPE, |wi| 1e-40 * wi[2].max(0.0)));
    table.add("callback: 3e38 everywhere", legal, answers(&SHAPE, |wi| if wi[2] > 0.0 { 3e38 } else { 0.0 }));
    let peak = [-0.6, 0.0, 0.8];
    for half_angle in [1e-6, 1e-3, std::f32::consts::FRAC_PI_2] {
        let shape = CallbackShape { peak, half_angle, ..SHAPE };
        let lobe = move |wi: [f32; 3]| {
            let distance: f32 = wi.iter().zip(peak).map(|(a, b)| (a - b) * (a - b)).sum();
            if wi[2] > 0.0 { (-distance / (half_angle * half_angle)).exp() + 1e-6 } else { 0.0 }
        };
        table.add(format!("callback: lobe of half-angle {half_angle:e}"), legal, answers(&shape, lobe));
    }
    table.add("callback: 0 everywhere", "pdf 0 everywhere; estimate 0", zero());
    invalid(table);
}

fn answers(shape: &CallbackShape, brdf: impl Fn([f32; 3]) -> f32) -> Verdict {
    let environment = Environment::new(&sky().map())?;
    let preparation = Preparation::default();
    let mut memory = preparation.memory()?;
    let mut batch = batch(&brdf);
    let product = Product::prepare_callback(&environment, shape, &mut batch, &preparation, &mut memory)?;
    laws::legal(&product)?;
    let estimate = product.estimate()?;
    ensure(estimate > 0.0 && estimate.is_finite(), || format!("estimate {estimate}"))?;
    let lit = sky().lit().into_iter().filter(|wi| brdf(*wi) > 0.0);
    let count = laws::positive(&product, lit)?;
    fails(product.estimate_rgb(), raw::WIS_NOT_BUILT)?;
    Ok(format!("legal; pdf > 0 at {count} directions"))
}

fn batch(brdf: impl Fn([f32; 3]) -> f32) -> impl FnMut(&[[f32; 3]], &mut [f32]) -> bool {
    move |wi, f_cos| {
        wi.iter().zip(f_cos).for_each(|(wi, f)| *f = brdf(*wi));
        true
    }
}

fn zero() -> Verdict {
    let environment = Environment::new(&sky().map())?;
    let preparation = Preparation::default();
    let mut memory = preparation.memory()?;
    let mut batch = batch(|_| 0.0);
    let product = Product::prepare_callback(&environment, &SHAPE, &mut batch, &preparation, &mut memory)?;
    laws::nothing(&product)?;
    let estimate = product.estimate()?;
    ensure(estimate == 0.0, || format!("estimate {estimate}"))?;
    Ok("pdf 0, estimate 0".into())
}

fn invalid(table: &mut Table) {
    for (name, value) in [("NaN", f32::NAN), ("+Inf", f32::INFINITY), ("-1e-30", -1e-30)] {
        let once = move |wi: [f32; 3]| if wi[0] > 0.5 { value } else { 1.0 };
        let verdict = prepared(&SHAPE, &mut batch(once), raw::WIS_CALLBACK_FAILED);
        table.add(format!("callback: {name} for some directions"), "CALLBACK_FAILED", verdict);
    }
    let verdict = prepared(&SHAPE, &mut |_, _| false, raw::WIS_CALLBACK_FAILED);
    table.add("callback: reports a failure", "CALLBACK_FAILED", verdict);
    for (name, half_angle) in [("NaN", f32::NAN), ("-1", -1.0), ("2", 2.0)] {
        let shape = CallbackShape { peak: UP, half_angle, ..SHAPE };
        let verdict = prepared(&shape, &mut batch(|_| 1.0), raw::WIS_INVALID_ARGUMENT);
        table.add(format!("callback: half-angle {name}"), "INVALID_ARGUMENT", verdict);
    }
    for (name, peak) in [("zero", [0.0; 3]), ("NaN", [f32::NAN; 3])] {
        let shape = CallbackShape { peak, half_angle: 0.1, ..SHAPE };
        let verdict = prepared(&shape, &mut batch(|_| 1.0), raw::WIS_INVALID_TRANSFORM);
        table.add(format!("callback: peak {name}"), "INVALID_TRANSFORM", verdict);
    }
}

fn prepared(shape: &CallbackShape, brdf: client::Brdf, status: raw::wis_status) -> Verdict {
    let environment = Environment::new(&sky().map())?;
    let preparation = Preparation::default();
    let mut memory = preparation.memory()?;
    let result = Product::prepare_callback(&environment, shape, brdf, &preparation, &mut memory);
    Ok(fails(result, status)?.to_string())
}
