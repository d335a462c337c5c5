//! The boundary of `wis_lights.h`.

pub mod jitter;
pub mod strata;
