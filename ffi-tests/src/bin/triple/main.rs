//! Measures triple product integrals (Ng et al. 2004) on a real light, real visibility and analytic BRDFs: triple <page> [sections]

mod approximation;
mod complexity;
mod domain;
mod fields;
mod relighting;
mod spherical;
mod terms;

use anyhow::Result;
use wis_ffi_tests::data;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::paper::Paper;

/// Writes a section for a light.
type Section = fn(&mut Paper, &Light) -> Result<()>;

fn main() -> Result<()> {
    let mut page = Paper::from_arguments("triple", include_str!("page.md"))?;
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
    page.write()
}
