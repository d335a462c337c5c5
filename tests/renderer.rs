//! The renderer's path, wis.h: light, direct, points, and the vectors and directions below them.

mod direct;
mod light;
mod light_ffi;
mod points;
mod product;
mod simd;
mod sphere;
mod stored;
mod support;
