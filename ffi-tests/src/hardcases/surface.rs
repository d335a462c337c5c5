//! Surfaces and directions: grazing and below the horizon, not of unit length, zero, NaN; matrices that are none.

use super::laws::{self, Verdict, ensure, fails};
use super::light::{TILTED, diffuse};
use super::lobes::{dark, judge, metal, rejected};
use super::maps::sky;
use super::table::Table;
use crate::client::{self, Density, Environment, Preparation, Product, lambert, query, raw};

const UP: [f32; 3] = [0.0, 0.0, 1.0];
const LEGAL: &str = "legal samples; pdf > 0 wherever f L cos > 0";
const REJECTED: &str = "INVALID_TRANSFORM";

/// Vectors that are no direction.
const NONE: [(&str, [f32; 3]); 6] = [
    ("of length 1.01", [0.0, 0.0, 1.01]),
    ("of length 1e20", [0.0, 0.0, 1e20]),
    ("zero", [0.0; 3]),
    ("NaN", [0.0, f32::NAN, 1.0]),
    ("infinite", [0.0, 0.0, f32::INFINITY]),
    ("denormal", [0.0, 0.0, 1e-42]),
];

/// Adds the cases.
pub fn add(table: &mut Table) {
    views(table);
    vectors(table);
    frames(table);
    matrices(table);
}

fn views(table: &mut Table) {
    let lobes = [lambert([0.5; 3]), metal([0.1; 2])];
    let below = [0.6, 0.0, -0.8];
    let horizontal = query(UP, [1.0, 0.0, 0.0], &lobes);
    table.add("view exactly along the surface", "pdf 0 everywhere; estimate 0", dark(&horizontal));
    table.add("view below the surface", "pdf 0 everywhere; estimate 0", dark(&query(UP, below, &lobes)));
    let whole = raw::wis_wavelet_query { flags: raw::WIS_WAVELET_QUERY_WHOLE_SPHERE, ..query(UP, below, &lobes) };
    let name = "view below the surface, whole sphere";
    table.add(name, LEGAL, judge(&sky(), &whole, &Preparation::default()));
    let least = query(UP, [1.0, 0.0, f32::from_bits(1)], &lobes);
    let name = "view 2^-149 above the surface";
    table.add(name, LEGAL, judge(&sky(), &least, &Preparation::default()));
    let included =
        raw::wis_wavelet_query { flags: raw::WIS_WAVELET_QUERY_COSINE_INCLUDED, ..query(UP, TILTED, &lobes) };
    let name = "values that contain the cosine already";
    table.add(name, LEGAL, judge(&sky(), &included, &Preparation::default()));
    // The geometric normal is +z: the view is above it by 5 degrees, and below the shading normal.
    let shading = query([-0.6, 0.0, 0.8], [0.996_194_7, 0.0, 0.087_155_74], &lobes);
    let name = "view above the geometric, below the shading normal";
    table.add(name, "pdf 0 everywhere; estimate 0", dark(&shading));
    let shading = query([0.6, 0.0, 0.8], [-0.6, 0.0, 0.8], &lobes);
    let name = "shading normal 37 degrees from the geometric: light below the geometric horizon";
    table.add(name, LEGAL, judge(&sky(), &shading, &Preparation::default()));
}

fn vectors(table: &mut Table) {
    let lobes = [lambert([0.5; 3])];
    for (name, vector) in NONE {
        table.add(format!("normal {name}"), REJECTED, rejected(&query(vector, UP, &lobes), raw::WIS_INVALID_TRANSFORM));
        table.add(format!("wo {name}"), REJECTED, rejected(&query(UP, vector, &lobes), raw::WIS_INVALID_TRANSFORM));
        let expected = "INVALID_TRANSFORM from invert; pdf and eval answer 0";
        table.add(format!("wi {name}"), expected, wi(vector));
    }
    let nearly = [0.0, 0.0, 1.0004];
    let expected = "accepted and normalised: the pdf of the normalised direction";
    table.add("normal, wo and wi of length 1.0004", expected, normalised(nearly));
}

fn wi(vector: [f32; 3]) -> Verdict {
    let environment = Environment::new(&sky().map())?;
    let preparation = Preparation::default();
    let mut memory = preparation.memory()?;
    let product = Product::prepare(&environment, &diffuse(UP), &preparation, &mut memory)?;
    refused(&environment.light(None), vector)?;
    refused(&product, vector)?;
    let mut f_cos = [[f32::NAN; 3]];
    client::evaluate(&diffuse(UP), &[vector], &mut f_cos)?;
    ensure(f_cos == [[0.0; 3]], || format!("{f_cos:?}"))?;
    Ok("INVALID_TRANSFORM; 0".into())
}

fn refused(density: &impl Density, vector: [f32; 3]) -> Result<(), String> {
    let alone = density.pdf(vector).map_err(|fault| format!("{fault:?}"))?;
    ensure(alone == 0.0, || format!("pdf {alone}"))?;
    fails(density.invert(vector), raw::WIS_INVALID_TRANSFORM)?;
    let mut pdf = [f32::NAN; 2];
    density.pdf_n(&[vector, UP], &mut pdf)?;
    ensure(pdf[0] == 0.0 && pdf[1] > 0.0, || format!("pdf_n {pdf:?}"))
}

fn normalised(nearly: [f32; 3]) -> Verdict {
    let environment = Environment::new(&sky().map())?;
    let preparation = Preparation::default();
    let (mut first, mut second) = (preparation.memory()?, preparation.memory()?);
    let lobes = [lambert([0.5; 3])];
    let given = Product::prepare(&environment, &query(nearly, nearly, &lobes), &preparation, &mut first)?;
    let exact = Product::prepare(&environment, &query(UP, UP, &lobes), &preparation, &mut second)?;
    laws::legal(&given)?;
    let pdf = given.pdf(nearly)?;
    ensure(pdf == exact.pdf(UP)?, || format!("pdf {pdf}"))?;
    Ok("legal; the same pdf".into())
}

fn frames(table: &mut Table) {
    let anisotropic = |tangent| raw::wis_wavelet_query { tangent, ..query(UP, [0.6, 0.0, 0.8], &[metal([0.05, 0.4])]) };
    for (name, tangent) in [
        ("zero", [0.0; 3]),
        ("parallel to the normal", UP),
        ("of length 1e-4", [1e-4, 0.0, 0.0]),
        ("NaN", [f32::NAN, 0.0, 0.0]),
        ("infinite", [f32::INFINITY, 0.0, 0.0]),
    ] {
        let verdict = rejected(&anisotropic(tangent), raw::WIS_INVALID_TRANSFORM);
        table.add(format!("anisotropic lobe, tangent {name}"), REJECTED, verdict);
    }
    for (name, tangent) in [("not normal to the normal", [0.7, 0.1, 0.7]), ("of length 0.01", [0.01, 0.0, 0.0])] {
        let name = format!("anisotropic lobe, tangent {name}");
        table.add(name, LEGAL, judge(&sky(), &anisotropic(tangent), &Preparation::default()));
    }
    let isotropic = query(UP, [0.6, 0.0, 0.8], &[metal([0.1; 2])]);
    table.add("isotropic lobe, tangent zero", LEGAL, judge(&sky(), &isotropic, &Preparation::default()));
}

fn matrices(table: &mut Table) {
    let none = [
        ("zero", [0.0; 9]),
        ("singular (two rows equal)", [1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
        ("sheared", [1.0, 0.01, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]),
        ("scaled by 1.001", [1.001, 0.0, 0.0, 0.0, 1.001, 0.0, 0.0, 0.0, 1.001]),
        ("NaN", [f32::NAN, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]),
        ("infinite", [f32::INFINITY, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]),
    ];
    for (name, matrix) in none {
        table.add(format!("matrix: {name}"), REJECTED, no_matrix(matrix));
    }
    for (name, matrix) in [
        ("mirrored", [1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0]),
        ("point reflection", [-1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0]),
        ("rotation, off by 2e-5", [0.800_02, -0.6, 0.0, 0.6, 0.8, 0.0, 0.0, 0.0, 1.0]),
    ] {
        let preparation = Preparation { world_from_map: Some(matrix), ..Preparation::default() };
        let verdict = turned(matrix).and_then(|()| judge(&sky(), &diffuse(TILTED), &preparation));
        table.add(format!("matrix: {name}"), LEGAL, verdict);
    }
}

fn no_matrix(matrix: [f32; 9]) -> Verdict {
    let environment = Environment::new(&sky().map())?;
    let light = environment.light(Some(matrix));
    fails(light.sample([0.5; 2]), raw::WIS_INVALID_TRANSFORM)?;
    fails(light.pdf(UP), raw::WIS_INVALID_TRANSFORM)?;
    let preparation = Preparation { world_from_map: Some(matrix), ..Preparation::default() };
    let mut memory = Preparation::default().memory()?;
    let result = Product::prepare(&environment, &diffuse(UP), &preparation, &mut memory);
    Ok(fails(result, raw::WIS_INVALID_TRANSFORM)?.to_string())
}

fn turned(matrix: [f32; 9]) -> Result<(), String> {
    let environment = Environment::new(&sky().map())?;
    laws::legal(&environment.light(Some(matrix)))
}
