#![doc = include_str!("../docs/crate.md")]
// A folder or file imports only what stands before it, and nothing imports `lights` or `wavelets` but `ffi`
// (tests/imports.rs). Order of folders: `status`, `numeric`, `simd`, `sample`, `sphere`, `points`, `blob`,
// `visibility`, `light`, `brdf`, `product`, `direct`, `lights`, `wavelets`, `ffi`, `render`.
#![no_std]
#![deny(unsafe_code, missing_docs)]

#[doc(hidden)]
#[allow(unsafe_code)]
pub mod blob;
#[doc(hidden)]
pub mod brdf;
#[doc(hidden)]
pub mod direct;
#[doc(hidden)]
pub mod light;
#[cfg(feature = "lights")]
pub mod lights;
#[doc(hidden)]
pub mod numeric;
pub mod points;
#[cfg(feature = "products")]
#[doc(hidden)]
pub mod product;
mod render;
#[doc(hidden)]
pub mod sample;
#[doc(hidden)]
#[allow(unsafe_code)]
pub mod simd;
#[doc(hidden)]
pub mod sphere;
#[doc(hidden)]
pub mod status;
pub mod visibility;
#[cfg(feature = "wavelets")]
pub mod wavelets;

#[doc(hidden)]
#[allow(unsafe_code)]
pub mod ffi;

pub use brdf::compare::{Match, Mistake};
pub use brdf::material::{Kind, Material, Shape};
pub use brdf::point::{Point, Target};
pub use brdf::portal::Portal;
pub use direct::Ray;
pub use direct::sampler::{Config, Sampler, Sequence};
pub use light::chart::Layout;
pub use light::compare::{Cause, Comparison};
pub use light::environment::{Environment, Size};
pub use light::plan::Filter;
pub use render::{Block, Map};
pub use sample::Sample;
pub use simd::Level;
pub use status::{Error, Status};
