//! The octahedral light, its products, trees and integrals (wis_wavelets.h), and strata (wis_lights.h).

mod combine;
mod density;
mod environment;
mod exactness;
mod haar;
mod hard;
mod inner;
mod lanes;
mod products;
mod ranges;
mod reachability;
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
mod wavelet_product;
