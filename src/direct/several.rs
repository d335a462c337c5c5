//! Several rays at a hit share a product of their own.
//!
//! One preparation serves them all. Rays are samples of the product: they have less variance than picks among as many candidates as the
//! same time pays for. Where a lobe is narrow, a product errs about its peak and under suns. A few rays are then picks among samples of
//! the product, the light and the lobes.

use super::Ray;
use super::candidates::{Counts, FLOOR};
use super::drawn::Source;
use super::joint::{Set, Turn};
use crate::brdf::point::{Fault, Point};
use crate::brdf::surface::Surface;
use crate::light::environment::Environment;
use crate::product::prepare::{Config, DIVIDED, PrepareError, prepare};
use crate::product::stored::{Product, most_bytes};
use crate::simd::{LANES, Level};

/// From so many rays on a call prepares a product. Chosen from errors at 1, 4 and 16 rays under st_fagans and rooitou; 2 was not tried.
pub const SEVERAL: usize = 4;
/// From so many rays on they are samples of the product even where a lobe is narrow. At 16 rays of GGX 0.2 picks have 1.5 times its variance
/// under st_fagans and 0.6 times under rooitou, and take 1.5 times as long; at 4 rays 0.8 and 0.24 times.
const MANY: usize = 16;
/// Points that are made together.
const TOGETHER: usize = 16;

/// The bytes of a product.
pub fn bytes() -> usize {
    most_bytes(DIVIDED)
}

/// The product of a hit. `memory`: at least [`bytes`], aligned to 16. `None` if there is none.
///
/// # Errors
/// What is wrong with the point.
#[inline(never)]
pub fn product<'a>(
    level: Level,
    environment: &Environment<'_>,
    point: &Point<'_>,
    memory: &'a mut [u8],
) -> Result<Option<Product<'a>>, Fault> {
    match prepare(level, environment, point, &Config::default(), memory) {
        Ok(_) => Ok(Product::view(memory)),
        Err(PrepareError::Point(fault)) => Err(fault),
        // The light was built without what products read: nothing else fails in memory that is long enough and aligned.
        Err(_) => Ok(None),
    }
}

/// Whether so many rays are samples of the product, and not picks among its samples and others.
pub fn suffices(rays: usize, surface: &Surface, seen: bool) -> bool {
    !seen && (rays >= MANY || surface.is_wide())
}

/// Of candidates, half come from the product; light and lobes share the others.
pub fn counts(candidates: usize) -> Counts {
    let quarter = (candidates / 4).next_multiple_of(LANES);
    Counts { product: candidates.saturating_sub(2 * quarter), light: quarter, lobes: quarter }
}

/// Draws the rays of a hit from its product, with the points of its turn. Answers how many there are.
///
/// A share of [`FLOOR`] comes from the light alone, which bounds weights as the floor of candidates does (rule 24).
#[inline(never)]
pub fn draw(
    level: Level,
    environment: &Environment<'_>,
    product: Product<'_>,
    point: &Point<'_>,
    turn: Turn,
    out: &mut [Ray],
) -> usize {
    let source = Source { level, environment, product, from_light: FLOOR };
    let total = out.len();
    let (seed, first) = turn.set(Set::Product, total);
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
