//! Rays for direct light: candidates from the light and from the lobes, weighed by the library's own lobes and light, of which
//! the best spread is traced.
//!
//! Resampled importance sampling (Talbot et al. 2005) with multiple importance sampling of the candidates and systematic
//! picks. A ray's weight is one over the density of rays given the candidates, so that the sum of weight x f x cosine x L x V
//! is unbiased for every BRDF, radiance and visibility of the client that vanish where the point's hemisphere or the light do.

pub mod candidates;
pub mod drawn;
pub mod effort;
pub mod joint;
pub mod pick;
pub mod ray;
pub mod sampler;
pub mod several;
pub mod shared;

use crate::brdf::point::Target;
use crate::brdf::surface::Surface;
use crate::light::tables::Light;
use crate::simd::{Kernel, LANES, Lanes};
use crate::sphere::Frame;
use crate::visibility::Factors;
use candidates::{Candidates, Counts, Draw};
use joint::Turn;
pub use ray::Ray;

/// Candidates for each ray, by the number of rays and by whether all lobes are diffuse: what has the least variance x time on four
/// development maps, with cold caches, `docs/tuning.md`. On `spot`, mean over eight lights, 32 in place of 16 for one ray divide the absolute
/// variance by 1.3 for Lambert, 2.1 for GGX 0.2 and 2.6 for GGX 0.05. Where rays are cheap, fewer are better from four rays on.
pub fn candidates_per_ray(rays: usize, diffuse: bool) -> usize {
    let full = match rays {
        0..=1 => 32,
        2..=3 => 16,
        _ => 8,
    };
    if diffuse { full / 2 } else { full }
}

/// The candidates of a call: from each source a power of two and whole lanes, so that each is a net, which can be ordered.
pub fn candidate_count(rays: usize, per_ray: usize) -> usize {
    (rays * per_ray).next_power_of_two().max(2 * LANES)
}

/// A call for rays.
#[derive(Debug)]
pub struct Request<'a, 'b> {
    /// The light.
    pub light: &'a Light<'a>,
    /// From map space to the world.
    pub frame: &'a Frame,
    /// The point, in map space.
    pub surface: &'a Surface,
    /// Its random numbers.
    pub turn: Turn,
    /// What was seen from there.
    pub seen: Option<&'a Factors>,
    /// The client's own target.
    pub target: Option<&'a dyn Target>,
    /// How many rays may be traced.
    pub rays: usize,
    /// How many candidates come from each source.
    pub counts: Counts,
    /// Room for the candidates.
    pub candidates: &'a mut Candidates<'b>,
    /// The rays, at least as many as may be traced.
    pub out: &'a mut [Ray],
}

impl Kernel for Request<'_, '_> {
    type Output = Option<usize>;

    /// How many rays there are; `None` if the target failed.
    #[inline(always)]
    fn run<F: Lanes>(self) -> Option<usize> {
        let Request { light, frame, surface, turn, seen, target, rays, counts, candidates, out } = self;
        let draw = Draw { light, surface, turn, frame, counts, without_lobes: target.is_some(), seen };
        draw.run::<F>(candidates);
        if let Some(target) = target {
            candidates.weigh_by(target, frame)?;
        }
        Some(pick::pick(candidates, rays, turn.pick(counts.light), |ray, direction, weight| {
            if let Some(out) = out.get_mut(ray) {
                let [x, y, z] = crate::light::density::to_world(frame, direction);
                *out = Ray { wi: [x, y, z], weight };
            }
        }))
    }
}
