//! The light: an environment map as small cumulative tables, exactly as the renderer looks it up.

pub mod batch;
pub mod blocks;
mod budget;
pub mod build;
pub mod chart;
mod check;
pub mod compare;
pub mod density;
pub mod environment;
pub mod guide;
pub mod map;
pub mod parts;
pub mod pixels;
pub mod plan;
pub mod radiance;
pub mod search;
pub mod strata;
pub mod tables;
pub mod texels;
mod walk;
pub mod warp;
