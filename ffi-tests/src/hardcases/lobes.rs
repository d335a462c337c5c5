//! Lobes from mirror-like to diffuse, budgets from one square, and parameters out of range.

use super::laws::{self, Verdict, ensure, fails};
use super::maps::{Image, hot, sky};
use super::table::Table;
use crate::client::{self, Environment, Preparation, Product, ggx, lambert, phong, query, raw};
use std::f32::consts::TAU;

const UP: [f32; 3] = [0.0, 0.0, 1.0];
const SLANTED: [f32; 3] = [0.6, 0.0, 0.8];
const GRAZING: [f32; 3] = [0.999_999_5, 0.0, 1e-3];
const LEGAL: &str = "legal samples; pdf > 0 wherever f L cos > 0";

/// Adds the cases.
pub fn add(table: &mut Table) {
    alphas(table);
    exponents(table);
    meetings(table);
    weights(table);
    budgets(table);
    invalid(table);
}

/// A metal of one or two alphas.
pub fn metal(alpha: [f32; 2]) -> raw::wis_wavelet_lobe {
    ggx([1.0; 3], [0.9; 3], alpha)
}

/// Directions all over the sphere, and at every scale about the mirror direction.
fn directions(query: &raw::wis_wavelet_query) -> Vec<[f32; 3]> {
    let mirror = |k: usize| 2.0 * query.normal[k] * dot(query.normal, query.wo) - query.wo[k];
    let mut points = vec![[0.0; 2]; 10_000];
    client::sobol(7, 0, &mut points).expect("that many points");
    let sphere = |u: [f32; 2]| {
        let (z, phi) = (2.0 * u[0] - 1.0, TAU * u[1]);
        [(1.0 - z * z).sqrt() * phi.cos(), (1.0 - z * z).sqrt() * phi.sin(), z]
    };
    let near = |(k, u): (usize, &[f32; 2])| {
        let offset = sphere(*u);
        let scale = if k % 2 == 0 { f32::INFINITY } else { 10.0f32.powi(-(k as i32 / 2 % 7)) };
        unit([0, 1, 2].map(|c| if scale.is_finite() { mirror(c) + scale * offset[c] } else { offset[c] }))
    };
    points.iter().enumerate().map(near).collect()
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn unit(v: [f32; 3]) -> [f32; 3] {
    let length = dot(v, v).sqrt();
    v.map(|x| x / length)
}

/// Prepares a query and checks its product where the lobes reflect; the map is lit everywhere.
pub fn judge(image: &Image, query: &raw::wis_wavelet_query, preparation: &Preparation) -> Verdict {
    let environment = Environment::new(&image.map())?;
    let mut memory = preparation.memory()?;
    let product = Product::prepare(&environment, query, preparation, &mut memory)?;
    let estimate = product.estimate()?;
    ensure(estimate > 0.0 && estimate.is_finite(), || format!("estimate {estimate}"))?;
    laws::legal(&product)?;
    let wi = directions(query);
    let mut f_cos = vec![[0.0; 3]; wi.len()];
    client::evaluate(query, &wi, &mut f_cos)?;
    ensure(f_cos.iter().flatten().all(|f| (0.0..=f32::MAX).contains(f)), || "f cos is not in range".into())?;
    let reflecting = wi.iter().zip(&f_cos).filter(|(_, f)| f[1] >= f32::MIN_POSITIVE).map(|(wi, _)| *wi);
    let count = laws::positive(&product, reflecting)?;
    ensure(count > 0, || "no direction reflects".into())?;
    Ok(format!("legal; pdf > 0 at {count} directions; estimate {estimate:.4e}"))
}

fn alphas(table: &mut Table) {
    for alpha in [1.0, 0.1, 0.01, 1e-3, 1e-4, 1e-5] {
        let query = query(UP, SLANTED, &[metal([alpha; 2])]);
        table.add(format!("GGX lobe of alpha {alpha:e}"), LEGAL, judge(&sky(), &query, &Preparation::default()));
    }
    for alpha in [0.5, 0.01, 1e-5] {
        let query = query(UP, GRAZING, &[metal([alpha; 2])]);
        let name = format!("GGX lobe of alpha {alpha:e}, view 0.06 degrees above the surface");
        table.add(name, LEGAL, judge(&sky(), &query, &Preparation::default()));
    }
    let mut blade = query(UP, SLANTED, &[metal([1e-5, 16.0])]);
    blade.tangent = [0.0, 1.0, 0.0];
    table.add("GGX lobe of alphas 1e-5 and 16", LEGAL, judge(&sky(), &blade, &Preparation::default()));
    let four = [lambert([0.3; 3]), metal([0.3; 2]), metal([1e-3; 2]), phong([0.1; 3], 1e5)];
    let query = query(UP, SLANTED, &four);
    table.add(
        "four lobes, alphas 0.3 and 1e-3, exponent 1e5, diffuse",
        LEGAL,
        judge(&sky(), &query, &Preparation::default()),
    );
}

fn exponents(table: &mut Table) {
    for exponent in [0.0, 1.0, 1e7] {
        let query = query(UP, SLANTED, &[phong([0.5; 3], exponent)]);
        let name = format!("Phong lobe of exponent {exponent:e}");
        table.add(name, LEGAL, judge(&sky(), &query, &Preparation::default()));
    }
}

fn meetings(table: &mut Table) {
    for (name, background) in [("a 1e6 texel far from it on 1e-3", 1e-3), ("a 1e6 texel far from it on 1e-30", 1e-30)] {
        let query = query(UP, SLANTED, &[metal([1e-4; 2])]);
        let verdict = judge(&hot(8, 10, 1e6, background), &query, &Preparation::default());
        table.add(format!("GGX lobe of alpha 1e-4, {name}"), LEGAL, verdict);
    }
    // The mirror direction (-0.6, 0, 0.8) lies in column 31 or 32, row 6.
    let query = query(UP, SLANTED, &[metal([1e-4; 2])]);
    let verdict = judge(&hot(32, 6, 1e6, 1e-3), &query, &Preparation::default());
    table.add("GGX lobe of alpha 1e-4 on a 1e6 texel", LEGAL, verdict);
}

fn weights(table: &mut Table) {
    for weight in [1e-40, 1e-30, 1e30, f32::MAX] {
        let query = query(UP, SLANTED, &[lambert([weight; 3])]);
        let preparation = Preparation::default();
        let verdict = (|| {
            let environment = Environment::new(&sky().map())?;
            let mut memory = preparation.memory()?;
            let product = Product::prepare(&environment, &query, &preparation, &mut memory)?;
            laws::legal(&product)?;
            let estimate = product.estimate()?;
            ensure(estimate > 0.0 && estimate.is_finite(), || format!("estimate {estimate}"))?;
            Ok(format!("legal; estimate {estimate:.4e}"))
        })();
        table.add(format!("diffuse lobe of weight {weight:e}"), "legal samples; estimate finite, above 0", verdict);
    }
    let black =
        [("no lobe", query(UP, SLANTED, &[])), ("a lobe of weight 0", query(UP, SLANTED, &[lambert([0.0; 3])]))];
    for (name, query) in black {
        table.add(name, "pdf 0 everywhere; estimate 0", dark(&query));
    }
}

/// A product of nothing on a map that is lit everywhere.
pub fn dark(query: &raw::wis_wavelet_query) -> Verdict {
    let environment = Environment::new(&sky().map())?;
    let preparation = Preparation::default();
    let mut memory = preparation.memory()?;
    let product = Product::prepare(&environment, query, &preparation, &mut memory)?;
    laws::nothing(&product)?;
    let estimate = product.estimate()?;
    ensure(estimate == 0.0, || format!("estimate {estimate}"))?;
    Ok("pdf 0, estimate 0".into())
}

fn budgets(table: &mut Table) {
    let narrow = query(UP, SLANTED, &[metal([1e-3; 2])]);
    let diffuse = query(UP, SLANTED, &[lambert([0.8; 3])]);
    for (name, query) in [("GGX of alpha 1e-3", narrow), ("diffuse", diffuse)] {
        for (max_squares, max_evaluations) in [(1, 1), (1, 0), (0, 1), (4096, 16384)] {
            let preparation = Preparation { max_squares, max_evaluations, ..Preparation::default() };
            let number = |n: u32| if n == 0 { "the default".into() } else { n.to_string() };
            let name = format!("{name}: squares {}, evaluations {}", number(max_squares), number(max_evaluations));
            table.add(name, LEGAL, judge(&sky(), &query, &preparation));
        }
    }
    let preparation = Preparation { max_squares: raw::WIS_MAX_SQUARES + 1, ..Preparation::default() };
    let verdict = fails(preparation.memory(), raw::WIS_INVALID_ARGUMENT).map(|_| "INVALID_ARGUMENT".into());
    table.add("4097 squares", "INVALID_ARGUMENT", verdict);
}

fn invalid(table: &mut Table) {
    let lobes = [
        ("GGX alpha 0", metal([0.0, 0.1])),
        ("GGX alpha 9e-6", metal([9e-6; 2])),
        ("GGX alpha 17", metal([17.0; 2])),
        ("GGX alpha NaN", metal([0.1, f32::NAN])),
        ("GGX reflectance 1.1", ggx([1.0; 3], [1.1; 3], [0.1; 2])),
        ("Phong exponent -1", phong([1.0; 3], -1.0)),
        ("Phong exponent 1.1e7", phong([1.0; 3], 1.1e7)),
        ("weight NaN", lambert([1.0, f32::NAN, 1.0])),
        ("weight +Inf", lambert([f32::INFINITY; 3])),
        ("weight negative", lambert([-1e-30; 3])),
        ("a lobe of kind 0", raw::wis_wavelet_lobe { kind: 0, ..lambert([1.0; 3]) }),
    ];
    for (name, lobe) in lobes {
        let query = raw::wis_wavelet_query { tangent: [0.0, 1.0, 0.0], ..query(UP, SLANTED, &[lobe]) };
        table.add(name, "INVALID_ARGUMENT", rejected(&query, raw::WIS_INVALID_ARGUMENT));
    }
    let five = raw::wis_wavelet_query { lobe_count: 5, ..query(UP, SLANTED, &[lambert([1.0; 3])]) };
    table.add("five lobes", "INVALID_ARGUMENT", rejected(&five, raw::WIS_INVALID_ARGUMENT));
}

/// The preparation of a query fails with this status, and so does its evaluation.
pub fn rejected(query: &raw::wis_wavelet_query, status: raw::wis_status) -> Verdict {
    let environment = Environment::new(&sky().map())?;
    let preparation = Preparation::default();
    let mut memory = preparation.memory()?;
    fails(Product::prepare(&environment, query, &preparation, &mut memory), status)?;
    let failure = fails(client::evaluate(query, &[UP], &mut [[0.0; 3]]), status)?;
    Ok(failure.to_string())
}
