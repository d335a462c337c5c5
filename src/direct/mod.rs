//! Rays for direct light: candidates from the light and from the lobes, weighed by the library's own lobes and light, of which
//! the best spread is traced.
//!
//! Resampled importance sampling (Talbot et al. 2005) with multiple importance sampling of the candidates and systematic
//! picks. A ray's weight is one over the density of rays given the candidates, so that the sum of weight x f x cosine x L x V
//! is unbiased for every BRDF, radiance and visibility of the client that vanish where the point's hemisphere or the light do.

pub mod candidates;
pub mod effort;
pub mod group;
pub mod joint;
pub mod pick;
pub mod portals;
pub mod ray;
pub mod sampler;
#[cfg(feature = "products")]
pub mod shared;
#[cfg(not(feature = "products"))]
#[path = "unshared.rs"]
pub mod shared;

pub use ray::Ray;
