//! Several rays at a hit share a product of their own.
//!
//! One preparation serves them all, and rays are its samples. Where all lobes are wide, they have less variance than picks among as many
//! candidates as the same time pays for. Where one is narrow, a product errs about its peak: under a sun its samples have up to ten times
//! the absolute variance of picks, so that 16 rays may err more than 4 picks.

use super::Ray;
use super::drawn::Source;
use super::joint::{Set, Turn};
use crate::brdf::point::{Fault, Point};
use crate::light::environment::Environment;
use crate::product::density::Shaded;
use crate::product::prepare::{Config, DIVIDED, PrepareError, Work, prepare_in};
use crate::product::stored::{Product, most_bytes};
use crate::simd::Level;

/// From so many rays on a call draws them from a product where all lobes are wide. Chosen from errors at 1, 4 and 16 rays under st_fagans and
/// rooitou. Variance x time on four development maps is 1.16 times higher with 2, and 0.99 times with 8: `docs/tuning.md`.
pub const SEVERAL: usize = 4;
/// The share of rays that the light alone draws. Its weights are at most 50 times those of the light: rule 33. A twentieth costs a tenth of
/// the variance of four rays.
const FROM_LIGHT: f32 = 0.02;
/// Points that are made together.
const TOGETHER: usize = 16;

/// The bytes of a product.
pub fn bytes() -> usize {
    most_bytes(DIVIDED)
}

/// Prepares the product of a hit. `memory`: at least [`bytes`], aligned to 16. False if there is none.
///
/// # Errors
/// What is wrong with the point.
#[inline(never)]
pub fn product(
    level: Level,
    environment: &Environment<'_>,
    point: &Point<'_>,
    work: &mut Work,
    memory: &mut [u8],
) -> Result<bool, Fault> {
    match prepare_in(level, environment, point, &Config::default(), work, memory) {
        Ok(_) => Ok(true),
        Err(PrepareError::Point(fault)) => Err(fault),
        // The light was built without what products read: nothing else fails in memory that is long enough and aligned.
        Err(_) => Ok(false),
    }
}

/// Draws the rays of a hit from its product in `memory`, with the points of its turn. Answers how many there are.
///
/// A share of 2 % comes from the light alone.
#[inline(never)]
pub fn draw(
    level: Level,
    environment: &Environment<'_>,
    memory: &[u8],
    point: &Point<'_>,
    turn: Turn,
    out: &mut [Ray],
) -> usize {
    let Some(product) = Product::view(memory) else { return 0 };
    let (frame, shaded) = (environment.frame(), Shaded { light: environment.light(), product });
    let source = Source { level, frame: &frame, shaded: &shaded, from_light: FROM_LIGHT };
    let total = out.len();
    let (seed, first) = turn.set(Set::Product, total.next_power_of_two());
    let mut written = 0;
    for begin in (0..total).step_by(TOGETHER) {
        let mut u = [[0.0; 2]; TOGETHER];
        for (u, index) in u.iter_mut().zip(begin as u32..) {
            *u = Turn::point(seed, first.wrapping_add(index));
        }
        let u = u.get(..TOGETHER.min(total - begin)).unwrap_or_default();
        written += source.rays(point, u, total, out.get_mut(written..).unwrap_or_default());
    }
    written
}
