//! Products that hits of a pixel share, for clients that hand in well-spread numbers of their own.
//!
//! Such numbers keep their spread through the warp of one product, and lose it in a choice among candidates. A hit draws from a
//! product of an earlier hit that covers it; else one is prepared in its place. Beginning a pixel forgets them all.

use super::Ray;
use super::drawn::Source;
use crate::brdf::point::{Fault, Point};
use crate::light::environment::Environment;
use crate::product::density::Shaded;
use crate::product::prepare::{Config, DIVIDED, PrepareError, Work, prepare_in};
use crate::product::stored::{Product, most_bytes};
use crate::simd::Level;

/// Products that are kept: of the last materials and sides of a surface that a pixel saw.
const KEPT: usize = 4;
/// How far normals may turn before a hit gets a product of its own, in radians: hits of a pixel on a smooth mesh.
const CONE: f32 = 0.1;
/// From so many hits of a pixel on, the spread of the client's numbers outweighs the choice among candidates.
const MANY_HITS: u32 = 16;
/// What stands before the products: how many there are, and which is next to go.
const STATE: usize = 16;

/// Whether a pixel with so many hits shares products.
pub fn is_worth(hits_per_pixel: u32) -> bool {
    hits_per_pixel >= MANY_HITS
}

/// The bytes of a ring.
pub fn bytes() -> usize {
    STATE + KEPT * most_bytes(DIVIDED)
}

/// The products of a pixel, in memory aligned to 8.
#[derive(Debug)]
pub struct Ring<'a> {
    memory: &'a mut [u8],
}

impl<'a> Ring<'a> {
    /// The ring in memory of [`bytes`]; what was there before stays.
    pub fn new(memory: &'a mut [u8]) -> Ring<'a> {
        Ring { memory }
    }

    /// Forgets all products.
    pub fn clear(&mut self) {
        self.memory.iter_mut().take(STATE).for_each(|byte| *byte = 0);
    }

    /// How many products there were so far: the last [`KEPT`] of them are kept.
    fn prepared(&self) -> usize {
        let state = self.memory.first_chunk::<8>().copied().unwrap_or_default();
        u64::from_le_bytes(state) as usize
    }

    fn slot(&mut self, number: usize) -> Option<&mut [u8]> {
        let size = most_bytes(DIVIDED);
        self.memory.get_mut(STATE + number % KEPT * size..)?.get_mut(..size)
    }

    /// The number of the product that serves a point: one that covers it, or a new one.
    #[inline(never)]
    fn serve(
        &mut self,
        level: Level,
        environment: &Environment<'_>,
        point: &Point<'_>,
        work: &mut Work,
    ) -> Result<usize, Fault> {
        let prepared = self.prepared();
        for number in (prepared.saturating_sub(KEPT)..prepared).rev() {
            let product = self.slot(number).and_then(|bytes| Product::view(bytes));
            let covers = |product: Product<'_>| {
                product.header.environment == environment.header().content_id && product.header.covers(point)
            };
            if product.is_some_and(covers) {
                return Ok(number);
            }
        }
        let config = Config { cone: CONE, ..Config::default() };
        let memory = self.slot(prepared).unwrap_or_default();
        match prepare_in(level, environment, point, &config, work, memory) {
            Ok(_) => {}
            Err(PrepareError::Point(fault)) => return Err(fault),
            // The memory is as long as any product, and aligned: this is never reached, and answers no rays.
            Err(_) => return Ok(usize::MAX),
        }
        if let Some(state) = self.memory.first_chunk_mut::<8>() {
            *state = (prepared as u64).wrapping_add(1).to_le_bytes();
        }
        Ok(prepared)
    }

    /// A ray for each of the client's numbers; those below the horizon of the point are left out. Answers how many there are.
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
    ) -> Result<usize, Fault> {
        let number = self.serve(level, environment, point, work)?;
        Ok(self.slot(number).map_or(0, |product| draw(level, environment, point, product, u, out)))
    }
}

/// The rays of a product. Apart, so that its stack does not lie below that of a preparation.
#[inline(never)]
fn draw(
    level: Level,
    environment: &Environment<'_>,
    point: &Point<'_>,
    product: &[u8],
    u: &[[f32; 2]],
    out: &mut [Ray],
) -> usize {
    let Some(product) = Product::view(product) else { return 0 };
    let (frame, shaded) = (environment.frame(), Shaded { light: environment.light(), product });
    let source = Source { level, frame: &frame, shaded: &shaded, from_light: 0.0 };
    source.rays(point, u, u.len(), out)
}
