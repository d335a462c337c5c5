//! What calls take.

use super::both::{Both, Lit, printed};
use super::variance;
use anyhow::Result;
use std::cell::RefCell;
use wis_ffi_tests::caches::{CACHES, COLD, RENDERER, SLOWER, WARM};
use wis_ffi_tests::client::{self, Block, Density, raw};
use wis_ffi_tests::environment::{self, Light};
use wis_ffi_tests::page::{Part, Table};
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
const POINTS: usize = 64;
/// Samples of a product in a batch.
const BATCH: usize = 64;
/// A call that took so many times the median was interrupted by another program.
const INTERRUPTED: f64 = 4.0;

/// Of 0.2 and of the current one.
type Times = [[Vec<f64>; CACHES.len()]; 2];

/// The table and its heading.
///
/// # Errors
/// Those of the library.
pub fn parts(lit: &Lit, rounds: usize) -> Result<Vec<Part>> {
    let heads =
        CACHES.iter().flat_map(|caches| [format!("0.2, {caches}"), caches.to_string(), format!("ratio, {caches}")]);
    let mut table = Table::new(["ns"], heads);
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

fn row(table: &mut Table, name: &str, items: usize, [old, new]: &Times) {
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

fn direct(lit: &Lit, material: &str, (rays, candidates): (usize, usize), rounds: usize) -> Result<Times> {
    let mut both = Both::new(&variance::lobes(material), rays, candidates)?;
    let (points, mut ray, mut count) =
        (variance::points(material, &both.material, POINTS), vec![raw::wis_ray::default(); rays], 0);
    let Both { new, old, .. } = &mut both;
    let mut earlier = |i: usize| old.direct(&lit.old, &points[i % POINTS], rays).map(drop);
    let mut now = |i: usize| new.direct_into(&lit.new, &points[i % POINTS], None, &mut ray, &mut count);
    Ok(singles(rounds, [&mut earlier, &mut now])?)
}

fn prepare(lit: &Lit, material: &str, rounds: usize) -> Result<Times> {
    let mut both = Both::new(&variance::lobes(material), 1, 0)?;
    let (points, mut memory) = (variance::points(material, &both.material, POINTS), Block::new(1 << 14));
    let (Both { new, old, .. }, config) = (&mut both, environment::product_config());
    let mut earlier = |i: usize| old.prepare(&lit.old, &points[i % POINTS]);
    let mut now =
        |i: usize| new.prepare(&lit.new, &config, &points[i % POINTS..][..1], &mut memory, &mut [0]).map(drop);
    Ok(singles(rounds, [&mut earlier, &mut now])?)
}

/// Samples and pdfs of a product.
fn product(lit: &Lit, batch: usize, rounds: usize) -> Result<[Times; 2]> {
    let both = Both::new(&variance::lobes("GGX 0.2"), 1, 0)?;
    let point = variance::points("GGX 0.2", &both.material, 1)[0];
    let (sampler, mut old, mut memory) = (RefCell::new(both.new), both.old, Block::new(0));
    let new = Light::product(&lit.new, &sampler, &point, &mut memory)?;
    old.prepare(&lit.old, &point)?;
    let mut u = vec![[0.0; 2]; POINTS * BATCH];
    client::sobol(3, 0, &mut u)?;
    let mut drawn = vec![raw::wis_drawn::default(); u.len()];
    old.sample(&lit.old, &u, &mut drawn)?;
    let wi: Vec<[f32; 3]> = drawn.iter().map(|drawn| drawn.wi).collect();
    let (mut d, mut p) = ([[0.0; 3]; BATCH], [0.0; BATCH]);
    let at = |i: usize| i * BATCH % u.len()..i * BATCH % u.len() + batch;
    let sample = singles(
        rounds,
        [&mut |i| old.sample(&lit.old, &u[at(i)], &mut drawn[..batch]), &mut |i| {
            new.sample_n(&u[at(i)], &mut d[..batch], &mut p[..batch])
        }],
    )?;
    let mut q = [0.0; BATCH];
    let pdf = singles(
        rounds,
        [&mut |i| old.pdf(&lit.old, &wi[at(i)], &mut q[..batch]), &mut |i| new.pdf_n(&wi[at(i)], &mut p[..batch])],
    )?;
    Ok([sample, pdf])
}
