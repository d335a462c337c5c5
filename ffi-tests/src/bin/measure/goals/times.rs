//! What calls take.

use super::both::{Lit, both, printed};
use super::variance;
use anyhow::Result;
use std::cell::RefCell;
use std::rc::Rc;
use wis_ffi_tests::caches::{CACHES, COLD, RENDERER, SLOWER, WARM};
use wis_ffi_tests::client::{self, Block, Density, raw};
use wis_ffi_tests::earlier;
use wis_ffi_tests::environment::{self, Light};
use wis_ffi_tests::page::{Part, Table};
use wis_ffi_tests::points;
use wis_ffi_tests::statistics::{bootstrap_ratio, geometric, median};
use wis_ffi_tests::timing::singles;

/// Calls for rays: name, material, rays, candidates for each.
const CALLS: [(&str, &str, usize, usize); 6] = [
    ("direct, Lambert, 8 + 8", "Lambert", 1, 16),
    ("direct, GGX 0.2, 16 + 16", "GGX 0.2", 1, 32),
    ("direct, Lambert, default", "Lambert", 1, 0),
    ("direct, GGX 0.2, default", "GGX 0.2", 1, 0),
    ("direct, GGX 0.2, 4 rays", "GGX 0.2", 4, 0),
    ("direct, GGX 0.2, 16 rays", "GGX 0.2", 16, 0),
];
/// Points that calls walk over.
pub const POINTS: usize = 64;
/// Samples of a product in a batch.
pub const BATCH: usize = 64;
/// A call that took so many times the median was interrupted by another program.
const INTERRUPTED: f64 = 4.0;

/// Of 0.2 and of the current one.
pub type Times = [[Vec<f64>; CACHES.len()]; 2];

/// The table and its heading.
///
/// # Errors
/// Those of the library.
pub fn parts(lit: &Lit, rounds: usize) -> Result<Vec<Part>> {
    let mut table = table(earlier::NAME);
    let mut slower = Vec::new();
    for (name, material, rays, candidates) in CALLS {
        let times = direct(lit, material, (rays, candidates), rounds)?;
        let of = |caches: usize| median(&times[0][caches]) / median(&times[0][WARM]);
        if rays == 1 {
            slower.push([of(RENDERER), of(COLD)]);
        }
        row(&mut table, name, 1, &times);
    }
    for material in ["Lambert", "GGX 0.2"] {
        row(&mut table, &format!("prepare a product, {material}"), 1, &prepare(lit, material, rounds)?);
    }
    for (name, batch) in [("in 64", BATCH), ("alone", 1)] {
        let [sample, pdf] = product(lit, batch, rounds)?;
        row(&mut table, &format!("product of GGX 0.2: sample {name}"), batch, &sample);
        row(&mut table, &format!("product of GGX 0.2: pdf {name}"), batch, &pdf);
    }
    let [renderer, cold] = [0, 1].map(|caches| geometric(slower.iter().map(|of| of[caches])));
    let is_right = (SLOWER[0]..=SLOWER[1]).contains(&renderer);
    let text = format!(
        "Medians of single calls, under {}. Renderer: before each call a ray goes through a million triangles and 256 kB of 16 MB of other memory are \
         read. **A call of 0.2 for one ray takes {renderer:.2} times its warm time then, {}, and {cold:.1} times after 32 MB**: geometric means of four.",
        lit.light.name,
        if is_right { "as in pbrt-v3" } else { "unlike in pbrt-v3: 1.15 to 1.35 would be right" }
    );
    Ok(vec![Part::Heading("Times".into()), Part::Text(text), Part::Table(table)])
}

/// Without rows.
pub fn table(old: &str) -> Table {
    let heads =
        CACHES.iter().flat_map(|caches| [format!("{old}, {caches}"), caches.to_string(), format!("ratio, {caches}")]);
    Table::new(["ns"], heads)
}

pub fn row(table: &mut Table, name: &str, items: usize, [old, new]: &Times) {
    let cells = old.iter().zip(new).flat_map(|(old, new)| {
        let kept = |all: &[f64]| -> Vec<f64> {
            let most = INTERRUPTED * median(all);
            all.iter().copied().filter(|ns| *ns <= most).collect()
        };
        let ns = |all: &[f64]| format!("{:.0}", median(all) / items as f64);
        [ns(old), ns(new), printed(bootstrap_ratio(&kept(old), &kept(new)))]
    });
    table.row([name], cells);
}

/// Times of calls of both, by the number of a call.
fn timed(rounds: usize, [mut old, mut new]: [impl FnMut(usize) -> client::Result<()>; 2]) -> client::Result<Times> {
    singles(rounds, [&mut old, &mut new])
}

fn direct(lit: &Lit, material: &str, (rays, candidates): (usize, usize), rounds: usize) -> Result<Times> {
    let mut both = both(&variance::lobes(material), rays, candidates)?;
    let mut light = lit.each.iter();
    let calls = both.each_mut().map(|(sampler, own)| {
        let (light, points) = (light.next().expect("two"), variance::points(material, own, POINTS));
        let mut ray = vec![raw::wis_ray::default(); rays];
        move |i: usize| sampler.direct(light, &points[i % POINTS], None, &mut ray).map(drop)
    });
    Ok(timed(rounds, calls)?)
}

fn prepare(lit: &Lit, material: &str, rounds: usize) -> Result<Times> {
    let (mut both, config) = (both(&variance::lobes(material), 1, 0)?, environment::product_config());
    let (mut light, config) = (lit.each.iter(), &config);
    let calls = both.each_mut().map(|(sampler, own)| {
        let (light, points) = (light.next().expect("two"), variance::points(material, own, POINTS));
        let mut memory = Block::new(1 << 14);
        move |i: usize| sampler.prepare(light, config, &points[i % POINTS], &mut memory)
    });
    Ok(timed(rounds, calls)?)
}

/// Samples and pdfs of a product.
fn product(lit: &Lit, batch: usize, rounds: usize) -> Result<[Times; 2]> {
    let (both, mut blocks) = (both(&variance::lobes("GGX 0.2"), 1, 0)?, [Block::new(0), Block::new(0)]);
    let points = both.each_ref().map(|(_, own)| variance::points("GGX 0.2", own, 1)[0]);
    let samplers = both.map(|(sampler, _)| Rc::new(RefCell::new(sampler)));
    let [first, second] = &mut blocks;
    let old = Light::product(&lit.each[0], &samplers[0], &points[0], first)?;
    let new = Light::product(&lit.each[1], &samplers[1], &points[1], second)?;
    calls([&old, &new], batch, rounds)
}

/// Samples and pdfs of two densities of one BRDF.
///
/// # Errors
/// Those of the library.
pub fn calls(both: [&dyn Density; 2], batch: usize, rounds: usize) -> Result<[Times; 2]> {
    let u = points::of(3, POINTS * BATCH);
    let mut drawn = vec![raw::wis_drawn::default(); u.len()];
    both[0].sample_n(&u, &mut drawn)?;
    let wi: Vec<_> = drawn.iter().map(|drawn| drawn.wi).collect();
    let at = |i: usize| i * BATCH % u.len()..i * BATCH % u.len() + batch;
    let (u, wi, at) = (&u, &wi, &at);
    let sample = both.map(|product| {
        let mut drawn = [raw::wis_drawn::default(); BATCH];
        move |i| product.sample_n(&u[at(i)], &mut drawn[..batch])
    });
    let pdf = both.map(|product| {
        let mut pdf = [0.0; BATCH];
        move |i| product.pdf_n(&wi[at(i)], &mut pdf[..batch])
    });
    Ok([timed(rounds, sample)?, timed(rounds, pdf)?])
}
