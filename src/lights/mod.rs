//! Structured importance sampling (Agarwal et al. 2003): a lat-long map as directional lights.

pub mod jitter;
pub mod map;
pub mod strata;
