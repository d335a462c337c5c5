//! Products that hits of a pixel share, for clients that hand in well-spread numbers of their own.
//!
//! Such numbers keep their spread through the warp of one product, and lose it in a choice among candidates. A hit draws from a
//! product of an earlier hit that covers it. Else one is prepared for it, up to a number of products in a pixel. Beginning a pixel
//! forgets them all.

use super::Ray;
use crate::brdf::point::{Fault, Point};
use crate::light::batch::{Drawn, samples};
use crate::light::environment::Environment;
use crate::product::density::Shaded;
use crate::product::prepare::{Config, DIVIDED, PrepareError, Work, prepare_in};
use crate::product::stored::{Product, most_bytes};
use crate::simd::Level;

/// The most products of a pixel. Where its hits differ more, preparing would take longer than it gains: with pixels as wide as the knot of
/// `c-examples/pathtracer`, variance x time of hits under a compensated light is 1.06 times lower than where a new product takes the oldest's place.
const MOST: usize = 4;
/// How far normals may turn before a hit gets a product of its own, in radians: hits of a pixel on a smooth mesh.
const CONE: f32 = 0.1;
/// From so many hits of a pixel on, the spread of the client's numbers outweighs the choice among candidates.
const MANY_HITS: u32 = 16;
/// The bounce whose hits share: those of later bounces lie all over the scene. Variance x time of paths of four hits is 1.11 times
/// lower than where all hits share, in the mean over five development maps.
const FIRST: u32 = 0;
/// Rays that are drawn together.
const TOGETHER: usize = 16;
/// What stands before the products: how many there are.
const STATE: usize = 16;

/// Whether a pixel with so many hits shares products.
pub fn is_worth(hits_per_pixel: u32) -> bool {
    hits_per_pixel >= MANY_HITS
}

/// Whether a hit may draw from shared products: they know the whole light and the lobes, but no target of the client's own.
pub fn serves(environment: &Environment<'_>, point: &Point<'_>, bounce: u32) -> bool {
    bounce == FIRST && point.target.is_none() && !point.compensated && environment.guide().is_some()
}

/// The bytes of a pixel's products.
pub fn bytes() -> usize {
    STATE + MOST * most_bytes(DIVIDED)
}

/// The products of a pixel, in memory aligned to 8.
#[derive(Debug)]
pub struct Shared<'a> {
    memory: &'a mut [u8],
}

impl<'a> Shared<'a> {
    /// Those in memory of [`bytes`]; what was there before stays.
    pub fn new(memory: &'a mut [u8]) -> Shared<'a> {
        Shared { memory }
    }

    /// Forgets all products.
    pub fn clear(&mut self) {
        self.memory.iter_mut().take(STATE).for_each(|byte| *byte = 0);
    }

    /// How many products there are.
    fn prepared(&self) -> usize {
        let state = self.memory.first_chunk::<8>().copied().unwrap_or_default();
        u64::from_le_bytes(state) as usize
    }

    fn slot(&mut self, number: usize) -> Option<&mut [u8]> {
        let size = most_bytes(DIVIDED);
        self.memory.get_mut(STATE + number * size..)?.get_mut(..size)
    }

    /// The number of the product that serves a point: one that covers it, or a new one. `None` if there is no room for that.
    #[inline(never)]
    fn serve(
        &mut self,
        level: Level,
        environment: &Environment<'_>,
        point: &Point<'_>,
        work: &mut Work,
    ) -> Result<Option<usize>, Fault> {
        let prepared = self.prepared().min(MOST);
        for number in (0..prepared).rev() {
            let product = self.slot(number).and_then(|bytes| Product::view(bytes));
            let covers = |product: Product<'_>| {
                product.header.environment == environment.header().content_id && product.header.covers(point)
            };
            if product.is_some_and(covers) {
                return Ok(Some(number));
            }
        }
        if prepared == MOST {
            return Ok(None);
        }
        let config = Config { cone: CONE, ..Config::default() };
        let memory = self.slot(prepared).unwrap_or_default();
        match prepare_in(level, environment, point, &config, work, memory) {
            Ok(_) => {}
            Err(PrepareError::Point(fault)) => return Err(fault),
            // The memory is as long as any product, and aligned: this is never reached.
            Err(_) => return Ok(None),
        }
        if let Some(state) = self.memory.first_chunk_mut::<8>() {
            *state = (prepared as u64 + 1).to_le_bytes();
        }
        Ok(Some(prepared))
    }

    /// A ray for each of the client's numbers; those below the horizon of the point are left out. Answers how many there are; `None` if
    /// no product serves the point.
    ///
    /// # Errors
    /// What is wrong with the point.
    pub fn direct(
        &mut self,
        level: Level,
        environment: &Environment<'_>,
        point: &Point<'_>,
        u: &[[f32; 2]],
        work: &mut Work,
        out: &mut [Ray],
    ) -> Result<Option<usize>, Fault> {
        let Some(number) = self.serve(level, environment, point, work)? else { return Ok(None) };
        Ok(self.slot(number).and_then(|product| draw(environment, point, product, u, out)))
    }
}

/// A ray for each `u` at a point, with one over the density of rays for its weight; those below the point's horizon are left out.
/// Answers how many there are. Apart, so that its stack does not lie below that of a preparation.
#[inline(never)]
fn draw(
    environment: &Environment<'_>,
    point: &Point<'_>,
    product: &[u8],
    u: &[[f32; 2]],
    out: &mut [Ray],
) -> Option<usize> {
    let (frame, shaded) =
        (environment.frame(), Shaded { light: environment.light(), product: Product::view(product)? });
    let mut written = 0;
    for some in u.chunks(TOGETHER) {
        let mut drawn = [Drawn::default(); TOGETHER];
        samples(&shaded, &frame, some, &mut drawn);
        for &Drawn { wi, pdf } in drawn.iter().take(some.len()) {
            if let (true, Some(ray)) = (pdf > 0.0 && is_above(point, wi), out.get_mut(written)) {
                *ray = Ray { wi, weight: (1.0 / (u.len() as f32 * pdf)).min(f32::MAX) };
                written += 1;
            }
        }
    }
    Some(written)
}

/// Whether a direction counts at a point.
fn is_above(point: &Point<'_>, [x, y, z]: [f32; 3]) -> bool {
    let [nx, ny, nz] = point.normal;
    point.whole_sphere || point.material.transmits() || nx * x + ny * y + nz * z > 0.0
}
