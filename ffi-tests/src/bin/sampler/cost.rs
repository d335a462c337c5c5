//! What calls cost, with warm and with cold caches, for products now and those of version 0.1.

use crate::own::Own;
use std::time::Instant;
use wis_ffi_tests::caches::Cold;
use wis_ffi_tests::client::{self, Density, Preparation, Product, Result};
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::products::points;
use wis_ffi_tests::scene::ShadingPoint;
use wis_ffi_tests::statistics::median;

/// Points whose products are timed.
const POINTS: usize = 200;
/// Points at which samples and pdfs are timed.
const DRAWN: usize = 12;
/// Rounds of a warm timing, of which the fastest counts.
const ROUNDS: usize = 15;
/// Single cold calls, of which the median counts.
const COLD: usize = 25;

/// What is timed, in the order of [`Cost::ns`].
pub const NAMES: [&str; 9] = [
    "prepare, warm",
    "prepare, cold",
    "sample alone, warm",
    "sample alone, cold",
    "sample in 8, warm",
    "sample in 64, warm",
    "sample in 64, cold",
    "pdf alone, warm",
    "pdf in 64, warm",
];

/// Nanoseconds for a product, a sample or a pdf.
pub struct Cost {
    pub ns: [f64; NAMES.len()],
    /// Bytes of a product.
    pub bytes: f64,
}

/// A product that was prepared.
trait Draws {
    fn sample(&mut self, u: &[[f32; 2]]) -> Result<()>;
    fn pdf(&mut self, wi: &[[f32; 3]]) -> Result<()>;
}

impl Draws for Own {
    fn sample(&mut self, u: &[[f32; 2]]) -> Result<()> {
        Own::sample(self, u).map(drop)
    }

    fn pdf(&mut self, wi: &[[f32; 3]]) -> Result<()> {
        let mut pdf = [0.0; 64];
        Own::pdf(self, wi, &mut pdf[..wi.len()])
    }
}

impl Draws for Product<'_> {
    fn sample(&mut self, u: &[[f32; 2]]) -> Result<()> {
        let (mut wi, mut pdf) = ([[0.0; 3]; 64], [0.0; 64]);
        self.sample_n(u, &mut wi[..u.len()], &mut pdf[..u.len()])
    }

    fn pdf(&mut self, wi: &[[f32; 3]]) -> Result<()> {
        let mut pdf = [0.0; 64];
        self.pdf_n(wi, &mut pdf[..wi.len()])
    }
}

/// What is done with a product.
type Use<'a> = &'a mut dyn FnMut(&mut dyn Draws) -> Result<()>;

/// Times of what `at` does: it prepares a product at a point, hands it out, and answers its bytes.
fn measure(
    at: &mut dyn FnMut(&ShadingPoint, Use) -> Result<usize>,
    points: &[ShadingPoint],
    u: &[[f32; 2]],
    wi: &[[f32; 3]],
) -> Result<Cost> {
    let (mut cold, mut ns, mut bytes) = (Cold::default(), [0.0; NAMES.len()], Vec::new());
    ns[0] = fastest(points.len(), || {
        points.iter().try_for_each(|point| at(point, &mut |_| Ok(())).map(|used| bytes.push(used as f64)))
    })?;
    ns[1] = far(&mut cold, 1, |i| at(&points[i], &mut |_| Ok(())).map(drop))?;
    let mut each: [Vec<f64>; NAMES.len()] = Default::default();
    for point in points.iter().step_by(points.len() / DRAWN) {
        at(point, &mut |product| {
            for (slot, batch) in [(2, 1), (4, 8), (5, 64)] {
                each[slot].push(fastest(u.len(), || u.chunks(batch).try_for_each(|u| product.sample(u)))?);
            }
            for (slot, batch) in [(7, 1), (8, 64)] {
                each[slot].push(fastest(wi.len(), || wi.chunks(batch).try_for_each(|wi| product.pdf(wi)))?);
            }
            each[3].push(far(&mut cold, 1, |i| product.sample(&u[i..=i]))?);
            each[6].push(far(&mut cold, 64, |i| product.sample(&u[64 * (i % 4)..][..64]))?);
            Ok(())
        })?;
    }
    for (ns, values) in ns.iter_mut().zip(&each).filter(|(_, values)| !values.is_empty()) {
        *ns = median(values);
    }
    Ok(Cost { ns, bytes: median(&bytes) })
}

/// The fastest round, in nanoseconds for an item.
fn fastest(items: usize, mut round: impl FnMut() -> Result<()>) -> Result<f64> {
    let mut best = f64::MAX;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        round()?;
        best = best.min(start.elapsed().as_secs_f64() * 1e9 / items as f64);
    }
    Ok(best)
}

/// The median of calls that find other memory in the caches, in nanoseconds for an item.
fn far(cold: &mut Cold, items: usize, mut call: impl FnMut(usize) -> Result<()>) -> Result<f64> {
    let mut all = Vec::new();
    for i in 0..COLD {
        cold.touch();
        let start = Instant::now();
        call(i)?;
        all.push(start.elapsed().as_secs_f64() * 1e9 / items as f64);
    }
    Ok(median(&all))
}

/// The costs of products now and of version 0.1, of a material under a light.
///
/// # Errors
/// Those of the library.
pub fn costs(light: &Light, material: &Material) -> Result<[Cost; 2]> {
    let points = points(POINTS)?;
    let mut u = vec![[0.0; 2]; 256];
    client::sobol(5, 0, &mut u)?;
    let mut own = Own::new(light, material)?;
    own.prepare(material, &points[0])?;
    let wi: Vec<[f32; 3]> = own.sample(&u[..64])?.iter().map(|drawn| drawn.wi).collect();
    let mut now = |point: &ShadingPoint, then: Use| {
        let used = own.prepare(material, point)?;
        then(&mut own).map(|()| used)
    };
    let now = measure(&mut now, &points, &u, &wi)?;
    let environment = light.environment()?;
    let preparation = Preparation { world_from_map: Some(light.world_from_map()), ..Default::default() };
    let mut memory = preparation.memory()?;
    let mut before = |point: &ShadingPoint, then: Use| {
        let mut product = Product::prepare(&environment, &material.query(point), &preparation, &mut memory)?;
        then(&mut product).map(|()| 0)
    };
    let mut before = measure(&mut before, &points, &u, &wi)?;
    let mut bytes = Vec::new();
    for point in &points {
        let product = Product::prepare(&environment, &material.query(point), &preparation, &mut memory)?;
        bytes.push(product.describe()?.bytes as f64);
    }
    before.bytes = median(&bytes);
    Ok([now, before])
}
