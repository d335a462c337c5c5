//! The goals of version 0.3 that one process can decide, beside version 0.2: goals <page> [--quick]
//!
//! Times with each of `CACHES`; variances at equal numbers of candidates, in the open and with blockers; variances over the hits of a
//! pixel (rule 39). A ratio is that of 0.2 over the current one: above 1 the current one is ahead.

mod times;
mod variance;

use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};
use wis_ffi_tests::client;
use wis_ffi_tests::earlier;
use wis_ffi_tests::environment;
use wis_ffi_tests::hardcases::brdf::Lobe;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::page::{self, Page, Part};
use wis_ffi_tests::data::{DEVELOPER, OTHERS, lights};
use wis_ffi_tests::statistics::geometric;

/// A light as both build it.
pub struct Lit {
    pub light: Light,
    pub is_judged: bool,
    pub new: environment::Environment,
    pub old: earlier::Environment,
}

impl Lit {
    fn new(light: Light, is_judged: bool) -> Result<Lit> {
        let light = light.bilinear();
        let new = light.tables(0, 0.0)?;
        let old =
            light.mapped(0, 0.0, earlier::Environment::new)?.context("version 0.2, which scripts/earlier.sh builds")?;
        Ok(Lit { light, is_judged, new, old })
    }
}

/// Both samplers for a material.
pub struct Both {
    pub new: environment::Sampler,
    pub old: earlier::Sampler,
    pub material: client::raw::wis_material,
}

impl Both {
    /// For so many rays of so many candidates; 0: the library's choice.
    ///
    /// # Errors
    /// Those of the library.
    pub fn new(lobes: &[Lobe], rays: usize, candidates: usize) -> Result<Both> {
        let shapes: Vec<_> = lobes.iter().map(Lobe::shape).collect();
        let old = earlier::Sampler::new(rays, candidates, 1, &shapes)?.context("version 0.2")?;
        let (new, material) = (environment::Sampler::new(rays, candidates, 1)?, environment::material(&shapes)?);
        Ok(Both { new, old, material })
    }
}

/// A ratio with its bootstrap interval of 95 %.
pub fn printed([ratio, low, high]: [f64; 3]) -> String {
    format!("{ratio:.2} [{low:.2}, {high:.2}]")
}

/// The maps that are there, developer maps first, or two of the project's own.
fn all(quick: bool) -> Result<Vec<Lit>> {
    let width = if quick { 128 } else { 512 };
    let own = || [Light::room(width), Light::unclipped("unclipped sun", width, 2, [width / 10, width / 7])];
    let mut all = Vec::new();
    for (names, is_judged) in [(&DEVELOPER[..], false), (&OTHERS[..], true)].into_iter().filter(|_| !quick) {
        for light in lights(names)? {
            all.push(Lit::new(light, is_judged)?);
        }
    }
    if all.is_empty() {
        all = own().into_iter().map(|light| Lit::new(light, true)).collect::<Result<_>>()?;
    }
    Ok(all)
}

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let file = PathBuf::from(arguments.next().context("usage: goals <page> [--quick]")?);
    let quick = arguments.next().is_some_and(|argument| argument == "--quick");
    ensure!(earlier::is_there(), "version 0.2 is not there: scripts/earlier.sh builds it from the history");
    let lights = all(quick)?;
    let mut short = vec![Part::Text(
        "Every ratio is that of version 0.2 over the current one, in one process: above 1 the current one is ahead. Brackets hold the \
         bootstrap interval of 95 %."
            .into(),
    )];
    short.extend(times::parts(&lights[lights.len() / 4], if quick { 6 } else { 60 })?);
    short.extend(variance::parts(&lights, quick)?);
    let title = "Goals of version 0.3 beside version 0.2".into();
    let page = Page { title, short, long: Vec::new(), made_from: page::made_from("goals")? };
    std::fs::create_dir_all(file.parent().unwrap_or(Path::new(".")))?;
    page.write_markdown(&file)?;
    println!("The page is {}", file.display());
    Ok(())
}

/// The geometric mean and the smallest of ratios.
pub fn mean_and_least(ratios: &[f64]) -> [f64; 2] {
    [geometric(ratios.iter().copied()), ratios.iter().copied().fold(f64::INFINITY, f64::min)]
}
