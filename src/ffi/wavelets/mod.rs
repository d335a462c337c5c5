//! The boundary of `wis_wavelets.h`.

pub mod grid;
mod memory;
pub mod sparse;
pub mod table;
pub mod tree;
pub mod triple;
pub mod visibility;
