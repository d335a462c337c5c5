//! The renderer's path, wis.h: light, direct, pools, points, and the vectors and directions below them.

mod direct;
mod light;
mod light_ffi;
mod points;
mod pool;
mod product;
mod simd;
mod sphere;
mod stored;
mod support;
