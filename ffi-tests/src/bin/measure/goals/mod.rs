//! The goals of version 0.3 that one process can decide, beside version 0.2
//!
//! Times with each of `CACHES`; variances at equal numbers of candidates, in the open and with blockers; variances over the hits of a
//! pixel (rule 39). A ratio is that of 0.2 over the current one: above 1 the current one is ahead.

mod before;
mod both;
mod times;
mod variance;

use self::both::Lit;
use anyhow::Result;
use std::path::Path;
use wis_ffi_tests::data::{DEVELOPER, OTHERS, lights};
use wis_ffi_tests::light::Light;
use wis_ffi_tests::page::{Page, Part};

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

/// Measures and writes the page.
///
/// # Errors
/// Those of the library and of files; version 0.2 is not there.
pub fn run(file: &Path, quick: bool) -> Result<()> {
    let lights = all(quick)?;
    let mut short = vec![Part::Text(
        "Every ratio is that of version 0.2 over the current one, in one process: above 1 the current one is ahead. Brackets hold the \
         bootstrap interval of 95 %."
            .into(),
    )];
    let (timed, rounds) = (&lights[lights.len() / 4], if quick { 6 } else { 60 });
    short.extend(times::parts(timed, rounds)?);
    short.extend(before::parts(&lights, timed, rounds, quick)?);
    short.extend(variance::parts(&lights, quick, &file.with_extension("tsv"))?);
    Page::measured("Goals of version 0.3 beside version 0.2", short, "goals")?.write(file)
}
