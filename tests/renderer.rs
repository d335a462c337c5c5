//! The renderer's path, wis.h: light, direct, pools, priors, points, and the vectors and directions below them.

mod direct;
mod light;
mod light_ffi;
mod points;
mod pool;
mod prior;
mod product;
mod sphere;
mod stored;
mod support;
