//! Several rays at a hit: drawn from its own product, with points of the hit's turn.
//!
//! One preparation serves them all. Such rays have less variance than picks among as many candidates as the same time pays for.

use super::Ray;
use super::drawn::Source;
use super::joint::{Set, Turn};
use crate::brdf::point::{Fault, Point};
use crate::light::environment::Environment;
use crate::product::prepare::{Config, DIVIDED, PrepareError, prepare};
use crate::product::stored::{Product, most_bytes};
use crate::simd::Level;

/// From so many rays on a product is worth its preparation: under the developer maps the least variance x time for every lobe.
pub const SEVERAL: usize = 4;
/// The share of rays that the light alone draws: what every candidate keeps of the mean weight, too (rule 24).
const FROM_LIGHT: f32 = super::candidates::FLOOR;
/// Points that are made together.
const TOGETHER: usize = 16;

/// The bytes of a product.
pub fn bytes() -> usize {
    most_bytes(DIVIDED)
}

/// The rays of a hit. `memory`: at least [`bytes`], aligned to 16. Answers how many there are.
///
/// # Errors
/// What is wrong with the point.
pub fn direct(
    level: Level,
    environment: &Environment<'_>,
    point: &Point<'_>,
    turn: Turn,
    memory: &mut [u8],
    out: &mut [Ray],
) -> Result<usize, Fault> {
    match prepare(level, environment, point, &Config::default(), memory) {
        Ok(_) => {}
        Err(PrepareError::Point(fault)) => return Err(fault),
        // The memory is as long as any product, and aligned: this is never reached, and answers no rays.
        Err(_) => return Ok(0),
    }
    let Some(product) = Product::view(memory) else { return Ok(0) };
    let source = Source { level, environment, product, from_light: FROM_LIGHT };
    let total = out.len();
    let (seed, first) = turn.set(Set::Light, total);
    let mut written = 0;
    for begin in (0..total).step_by(TOGETHER) {
        let mut u = [[0.0; 2]; TOGETHER];
        for (u, index) in u.iter_mut().zip(begin as u32..) {
            *u = Turn::point(seed, first.wrapping_add(index));
        }
        let u = u.get(..TOGETHER.min(total - begin)).unwrap_or_default();
        written += source.rays(point, u, total, out.get_mut(written..).unwrap_or_default());
    }
    Ok(written)
}
