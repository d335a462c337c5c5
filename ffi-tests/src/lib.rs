//! Instruments that use the release library as a client does: through its C header only.

pub mod client;
pub mod hardcases;
