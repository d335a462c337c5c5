//! Measures triple product integrals (Ng et al. 2004) on a real light, real visibility and analytic BRDFs: triple <page> [sections]

mod approximation;
mod complexity;
mod domain;
mod fields;
mod relighting;
mod spherical;
mod terms;
mod threads;

use anyhow::Result;
use wis_ffi_tests::data;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::paper::Paper;

/// Writes a section for a light.
type Section = fn(&mut Paper, &Light) -> Result<()>;

fn main() -> Result<()> {
    let mut page = Paper::from_arguments("triple")?;
    let light = data::light("grace_latlong.exr")?;
    let sections: [(&str, Section); 6] = [
        ("complexity", |page, _| complexity::write(page)),
        ("time", approximation::write),
        ("bases", |page, _| spherical::write(page)),
        ("vertices", relighting::write),
        ("terms", terms::write),
        ("fields", fields::write),
    ];
    for (name, section) in sections {
        page.section(name, |page| section(page, &light))?;
    }
    page.write("Triple product wavelet integrals", INTRODUCTION)
}

const INTRODUCTION: &str =
    "Ng et al. 2004, \"Triple Product Wavelet Integrals for All-Frequency Relighting\", claim by claim. The calls:
`wis_triple_*` for integrals and the sublinear algorithm. A term is a square of up to three wavelets, as Section 7.2 keeps the light:
the squares with the largest sum of squared coefficients. The sizes of the paper's fields agree with that: 250 kB for 0.12 % of Lambert's
are 22 bytes a term. \"Displayed\": the root mean squared difference, of white, of pictures of mean 0.4 and gamma 2.2. Pictures look the same
up to 2 %, five of 255 levels. Written by `make triple` at {commit}.
";
