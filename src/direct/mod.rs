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

use candidates::FEWEST;
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
    (rays * per_ray).next_power_of_two().max(2 * FEWEST)
}
