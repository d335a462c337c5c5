//! `wis`: product importance sampling of environment light x BRDF x cosine.
//!
//! The kernel allocates nothing, prints nothing, keeps no global state and never panics. Everything it
//! builds lives in memory that the caller gives and holds no pointer, so it can be copied, saved and mapped.
//!
//! Data flows one way, and a file imports only what stands before it in this list:
//! `status`, `numeric`, `sphere`, `points`, `morton`, `haar`, `tree`, `image`, `prune`, `split`, `warp`, `inner`,
//! `descent`, `simd`, `light`, `brdf`, `direct`, `wide`, `environment`, `query`, `reuse`, `table`, `lobe`, `product`, `sampler`,
//! `pool`, `strata`, `ffi`.
#![no_std]
#![deny(unsafe_code, missing_docs)]

pub mod approximate;
pub mod brdf;
pub mod combine;
pub mod descent;
pub mod direct;
pub mod environment;
pub mod grid;
pub mod haar;
pub mod image;
pub mod inner;
pub mod jitter;
pub mod light;
pub mod lobe;
pub mod morton;
pub mod numeric;
pub mod points;
pub mod pool;
pub mod prior;
pub mod product;
pub mod product_grid;
pub mod prune;
pub mod query;
pub mod reuse;
pub mod rotated;
pub mod sampler;
#[allow(unsafe_code)]
pub mod simd;
pub mod sparse;
pub mod sphere;
pub mod split;
pub mod status;
pub mod strata;
pub mod table;
pub mod tree;
pub mod triple;
pub mod tripling;
pub mod visibility;
pub mod warp;
pub mod wide;

#[allow(unsafe_code)]
pub mod ffi;
