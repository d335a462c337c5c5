//! What the calls take.

use super::studies::Study;
use crate::speed::{self, Speed};
use anyhow::Result;
use std::cell::RefCell;
use std::rc::Rc;
use std::time::Instant;
use wis_ffi_tests::caches::{CACHES, WARM};
use wis_ffi_tests::client::{self, Block, raw};
use wis_ffi_tests::earlier;
use wis_ffi_tests::environment::{self, CURRENT, Environment, Light, Version};
use wis_ffi_tests::material::Material;
use wis_ffi_tests::scene::ShadingPoint;
use wis_ffi_tests::setting::Lit;
use wis_ffi_tests::statistics::median;
use wis_ffi_tests::timing::singles;

/// The bound of rule 33.
pub const LARGEST_WEIGHT: f64 = 50.0;
/// Materials whose products are prepared.
pub const PREPARE: [&str; 4] = ["Lambert", "GGX 0.5", "GGX 0.2", "GGX 0.05"];

/// Nanoseconds with each of `CACHES`.
pub type Times = [f64; CACHES.len()];

/// What was measured apart from the cells.
pub struct Measured {
    /// The light and its build: milliseconds and bytes.
    pub light: String,
    pub build: (f64, usize),
    /// The preparation of a product for each of `PREPARE`.
    pub prepare: Vec<Times>,
    /// The product of GGX 0.2.
    pub product: Speed,
    pub product_bytes: usize,
    /// A call for one ray of 16 candidates, and a candidate of a call for 64 rays of 4.
    pub direct: [Times; 2],
    /// How many times its warm time a call of version 0.2 takes with each of `CACHES`: of the current one if that is not there.
    pub slower: Times,
}

impl Measured {
    /// # Errors
    /// Those of the library.
    pub fn new(studies: &[Study], quick: bool) -> Result<Measured> {
        let light = studies[0].lights[0].clone().bilinear();
        let builds: Vec<f64> = (0..if quick { 1 } else { 9 }).map(|_| build(&light)).collect::<client::Result<_>>()?;
        let lit = Lit::new(&light)?;
        let rounds = if quick { 3 } else { 40 };
        let points: Vec<ShadingPoint> =
            studies[0].scene.points.iter().step_by(studies[0].scene.points.len().div_ceil(64)).copied().collect();
        let of = |name: &str| Material::all().into_iter().find(|m| m.name == name).unwrap_or_else(Material::lambert);
        let prepare = PREPARE.map(|name| prepare(&lit, &of(name), &points, rounds));
        let glossy = Material::ggx(0.2);
        let (current, before) = ((&CURRENT, &lit.tables), earlier::version().zip(lit.earlier.as_ref()));
        let direct = |by, calls| direct(by, &glossy, &points, calls, rounds);
        let (one, many) = (direct(current, (1, 16))?, direct(current, (64, 4))?);
        let before = before.map_or(Ok(one), |before| direct(before, (1, 16)))?;
        Ok(Measured {
            slower: before.map(|ns| ns / before[WARM]),
            light: light.name.clone(),
            build: (median(&builds), lit.tables.info.bytes as usize),
            prepare: prepare.into_iter().collect::<client::Result<_>>()?,
            product: product(&lit, &glossy, &points[points.len() / 2], rounds)?,
            product_bytes: environment::product_bytes(&CURRENT, &environment::product_config())?,
            direct: [one, many.map(|ns| ns / 256.0)],
        })
    }
}

fn build(light: &wis_ffi_tests::light::Light) -> client::Result<f64> {
    let start = Instant::now();
    light.tables(0, 0.0)?;
    Ok(start.elapsed().as_secs_f64() * 1e3)
}

/// The median of calls for one point each.
fn time(count: usize, rounds: usize, mut call: impl FnMut(usize) -> client::Result<()>) -> client::Result<Times> {
    let [times] = singles(rounds, [&mut |i| call(i % count)])?;
    Ok(times.map(|times| median(&times)))
}

fn shaded(material: &Material, own: &raw::wis_material, points: &[ShadingPoint]) -> Vec<raw::wis_point> {
    points.iter().map(|point| material.point(point, own)).collect()
}

fn prepare(lit: &Lit, material: &Material, points: &[ShadingPoint], rounds: usize) -> client::Result<Times> {
    let own = environment::material(&material.lobes())?;
    let (mut sampler, config) = (environment::Sampler::new(1, 0, 1)?, environment::product_config());
    let (at, mut memory) = (shaded(material, &own, points), Block::new(1 << 14));
    time(at.len(), rounds, |i| sampler.prepare(&lit.tables, &config, &at[i], &mut memory))
}

fn product(lit: &Lit, material: &Material, point: &ShadingPoint, rounds: usize) -> Result<Speed> {
    let own = environment::material(&material.lobes())?;
    let (sampler, mut memory) = (Rc::new(RefCell::new(environment::Sampler::new(1, 0, 1)?)), Block::new(0));
    let at = material.point(point, &own);
    let product = Light::product(&lit.tables, &sampler, &at, &mut memory)?;
    Ok(speed::speed(&[&product], rounds)?[0])
}

/// Nanoseconds of a call of a version for rays and candidates of each.
fn direct(
    (version, environment): (&'static Version, &Environment),
    material: &Material,
    points: &[ShadingPoint],
    (rays, candidates): (usize, usize),
    rounds: usize,
) -> client::Result<Times> {
    let (own, mut ray) = (environment::material_by(version, &material.lobes())?, vec![raw::wis_ray::default(); rays]);
    let mut sampler = environment::Sampler::by(version, rays, candidates, 1)?;
    let at = shaded(material, &own, points);
    time(at.len(), rounds, |i| sampler.direct(environment, &at[i], None, &mut ray).map(drop))
}
