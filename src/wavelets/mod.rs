//! Wavelet importance sampling (Clarberg et al. 2005) and triple product wavelet integrals (Ng et al. 2004).
//!
//! Functions as fixed-depth sparse trees, rotated maps, tables of BRDFs, products of trees, the in-place kD warp, and sets of
//! wavelets: trees and integrals of them, and how they are stored. A file imports only what stands before it in this list: `morton`,
//! `tree`, `prune`, `split`, `warp`, `stored`, `image`, `combine`, `table`, `triple`, `sparse`, `packed`, `approximate`, `visibility`,
//! `rotated`.

pub mod approximate;
pub mod combine;
pub mod image;
pub mod morton;
pub mod packed;
pub mod prune;
pub mod rotated;
pub mod sparse;
pub mod split;
pub mod stored;
pub mod table;
pub mod tree;
pub mod triple;
pub mod visibility;
pub mod warp;
