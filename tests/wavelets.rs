//! Trees, rotated maps, tables and integrals (wis_wavelets.h), and strata (wis_lights.h).

mod combine;
mod hard;
mod ranges;
mod rotated;
mod sparse;
mod split;
mod stored;
mod strata;
mod support;
mod table;
mod tree;
mod tree_ffi;
mod triple;
mod visibility;
mod warp;
