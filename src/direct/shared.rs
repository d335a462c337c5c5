//! Products that hits of a pixel share.
//!
//! The low-discrepancy points of a pixel's samples keep their spread in two dimensions through the warp of one product, and in one dimension
//! in picks among candidates. A hit draws from a product of an earlier hit that covers it. Else one is prepared for it, up to a number of
//! products in a pixel. Beginning a pixel forgets them all.

use super::Ray;
use super::joint::Points;
use crate::brdf::point::Point;
use crate::light::batch::samples;
use crate::light::environment::Environment;
use crate::product::density::Shaded;
use crate::product::prepare::{Config, DIVIDED, Task, Work};
use crate::product::stored::{Product, most_bytes};
use crate::sample::Sample;
use crate::simd::Level;
use crate::status::{Error, Status};

/// The most products of a pixel. Where its hits differ more, preparing would take longer than it gains: with pixels as wide as the knot of
/// `c-examples/pathtracer`, variance x time of hits under a compensated light is 1.06 times lower than where a new product takes the oldest's place.
const MOST: usize = 4;
/// How far normals may turn before a hit gets a product of its own, in radians: hits of a pixel on a smooth mesh.
const CONE: f32 = 0.1;
/// The narrowest lobe that shares: twice the cone (rule 26). Beside 16 candidates, GGX 0.1 has 1.3 times and GGX 0.05 3 times the error of
/// candidates by absolute squared error, and half of it by relative.
const NARROWEST: f32 = 2.0 * CONE;
/// From so many hits of a pixel on, the spread of points outweighs the choice among candidates.
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

/// Whether a hit may draw from shared products: they know the light as it was built, whole or above its mean, and lobes
/// that are wide, but no target of the client's own.
pub fn serves(environment: &Environment<'_>, point: &Point<'_>, bounce: u32) -> bool {
    let alike = point.compensated == environment.is_compensated();
    bounce == FIRST && point.target.is_none() && alike && environment.guide().is_some()
}

/// Whether the narrowest lobe of a point is wide enough.
pub fn is_wide(least_alpha: f32) -> bool {
    least_alpha >= NARROWEST
}

/// The bytes of a pixel's products.
pub fn bytes() -> usize {
    STATE + MOST * most_bytes(DIVIDED)
}

/// The bytes in which one is prepared.
pub fn scratch_bytes() -> usize {
    size_of::<Work>()
}

/// The products of a pixel, in memory aligned to 8.
#[derive(Debug)]
pub struct Shared<'a> {
    memory: &'a mut [u8],
}

impl<'a> Shared<'a> {
    /// Those in memory of [`bytes`]; what was there before stays. None in no memory.
    pub fn new(memory: &'a mut [u8]) -> Option<Shared<'a>> {
        if memory.is_empty() { None } else { Some(Shared { memory }) }
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
    ) -> Result<Option<usize>, Error> {
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
        match (Task { level, environment, point, config: &config }).prepare(Some(work), memory) {
            Ok(_) => {}
            // The memory is as long as any product, and aligned: this is never reached.
            Err(Error { status: Status::MemoryTooSmall | Status::Misaligned, .. }) => return Ok(None),
            Err(error) => return Err(error),
        }
        if let Some(state) = self.memory.first_chunk_mut::<8>() {
            *state = (prepared as u64 + 1).to_le_bytes();
        }
        Ok(Some(prepared))
    }

    /// As many rays as there is room for; those below the horizon of the point are left out. Answers how many there are; `None` if no product
    /// serves the point. `scratch`: at least [`scratch_bytes`].
    ///
    /// # Errors
    /// What is wrong with the point.
    pub fn direct(
        &mut self,
        level: Level,
        environment: &Environment<'_>,
        point: &Point<'_>,
        points: &Points,
        scratch: &mut [f32],
        out: &mut [Ray],
    ) -> Result<Option<usize>, Error> {
        let Some(work) = work(scratch) else { return Ok(Some(0)) };
        let Some(number) = self.serve(level, environment, point, work)? else { return Ok(None) };
        Ok(self.slot(number).and_then(|product| draw(environment, point, product, points, out)))
    }
}

/// What a product is prepared with; `None` if the scratch is too short.
fn work(scratch: &mut [f32]) -> Option<&mut Work> {
    let bytes = bytemuck::cast_slice_mut(scratch).get_mut(..scratch_bytes())?;
    bytemuck::try_from_bytes_mut(bytes).ok()
}

/// Rays at a point, with one over the density of rays for their weight; those below the point's horizon are left out. Answers how many there
/// are. Apart, so that its stack does not lie below that of a preparation.
#[inline(never)]
fn draw(
    environment: &Environment<'_>,
    point: &Point<'_>,
    product: &[u8],
    points: &Points,
    out: &mut [Ray],
) -> Option<usize> {
    let (frame, light) = (environment.frame(), environment.tables());
    let shaded = Shaded::new(&light, Product::view(product)?);
    let (rays, mut written) = (out.len(), 0);
    let mut numbers = points.samples(rays);
    for first in (0..rays).step_by(TOGETHER) {
        let (mut u, mut drawn) = ([[0.0; 2]; TOGETHER], [Sample::default(); TOGETHER]);
        u.iter_mut().zip(&mut numbers).for_each(|(u, number)| *u = number);
        let some = u.get(..TOGETHER.min(rays - first)).unwrap_or_default();
        // Wider registers would gain little for so few rays, and be a tenth more code.
        samples(Level::BASELINE, &shaded, &frame, some, &mut drawn);
        for &Sample { wi, pdf } in drawn.iter().take(some.len()) {
            if let (true, Some(ray)) = (pdf > 0.0 && is_above(point, wi), out.get_mut(written)) {
                *ray = Ray { wi, weight: (1.0 / (rays as f32 * pdf)).min(f32::MAX) };
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
