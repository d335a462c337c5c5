//! `wis`: product importance sampling of environment light x BRDF x cosine.
//!
//! The kernel allocates nothing, prints nothing, keeps no global state and never panics. Everything it
//! builds lives in memory that the caller gives and holds no pointer, so it can be copied, saved and mapped.
//!
//! Data flows one way: a folder or file imports only what stands before it in this list, and nothing imports `lights` or
//! `wavelets` but `ffi`.
//! `status`, `numeric`, `simd`, `sphere`, `points`, `pool`, `prior`, `visibility`, `light`, `brdf`, `product`, `direct`, `lights`,
//! `wavelets`, `ffi`.
#![no_std]
#![deny(unsafe_code, missing_docs)]

pub mod brdf;
pub mod direct;
pub mod light;
#[cfg(feature = "lights")]
pub mod lights;
pub mod numeric;
pub mod points;
pub mod pool;
pub mod prior;
pub mod product;
pub mod sample;
#[allow(unsafe_code)]
pub mod simd;
pub mod sphere;
pub mod status;
pub mod visibility;
#[cfg(feature = "wavelets")]
pub mod wavelets;

#[allow(unsafe_code)]
pub mod ffi;
