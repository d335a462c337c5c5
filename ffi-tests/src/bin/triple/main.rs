//! Measures triple product integrals (Ng et al. 2004) on a real light, real visibility and analytic BRDFs: triple <page> [sections]

mod approximation;
mod complexity;
mod domain;
mod fields;
mod relighting;
mod sampling;
mod spherical;
mod terms;
mod threads;

use anyhow::Result;
use glam::Vec3;
use wis_ffi_tests::data;
use wis_ffi_tests::light::{Light, octahedral_direction};
use wis_ffi_tests::material::Bsdf;
use wis_ffi_tests::paper::Paper;

const DEPTH: u32 = 7;
const SIDE: usize = 1 << DEPTH;

/// Writes a section for a light.
type Section = fn(&mut Paper, &Light) -> Result<()>;

fn main() -> Result<()> {
    let mut page = Paper::from_arguments("triple")?;
    let light = data::light("grace_latlong.exr")?;
    let sections: [(&str, Section); 7] = [
        ("complexity", |page, _| complexity::write(page)),
        ("time", approximation::write),
        ("bases", |page, _| spherical::write(page)),
        ("vertices", relighting::write),
        ("terms", terms::write),
        ("fields", fields::write),
        ("sampling", sampling::write),
    ];
    for (name, section) in sections {
        page.section(name, |page| section(page, &light))?;
    }
    page.write("Triple product wavelet integrals", INTRODUCTION)
}

const INTRODUCTION: &str =
    "Ng et al. 2004, \"Triple Product Wavelet Integrals for All-Frequency Relighting\", claim by claim. The calls:
`wis_triple_*` for integrals and the sublinear algorithm, and
`WIS_TREE_PRODUCT` for the product as something to sample. Written by `make triple` at
{commit}.
";

/// The direction of a place in a pixel.
fn pixel(i: usize, parts: [f32; 2]) -> Vec3 {
    let at = |c: usize, part: f32| (c as f32 + part) / SIDE as f32;
    octahedral_direction(at(i % SIDE, parts[0]), at(i / SIDE, parts[1]))
}

/// BRDF x cosine, the mean of four places in a pixel.
fn mean_on_pixel(bsdf: &Bsdf, i: usize) -> f32 {
    let quarters = [[0.25, 0.25], [0.25, 0.75], [0.75, 0.25], [0.75, 0.75]];
    quarters.iter().map(|&parts| bsdf.eval_one(pixel(i, parts)).0).sum::<f32>() / 4.0
}
