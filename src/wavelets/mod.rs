//! Wavelet importance sampling (Clarberg et al. 2005) and triple product wavelet integrals (Ng et al. 2004).
//!
//! The environment as a fixed-depth sparse tree over the octahedral square, BRDFs as lobes or sparse tables, their product at a
//! shading point, the in-place kD warp, and products and integrals of any sets of wavelets. A file imports only what stands
//! before it in this list: `lanes`, `morton`, `haar`, `tree`, `image`, `prune`, `split`, `warp`, `inner`, `stored`, `pruned`, `combine`,
//! `descent`, `wide`, `environment`, `query`, `table`, `lobe`, `callback`, `product`, `sampler`, `tripling`, `triple`, `sparse`,
//! `approximate`, `visibility`, `grid`, `rotated`.

pub mod approximate;
pub mod callback;
pub mod combine;
pub mod descent;
pub mod environment;
pub mod grid;
pub mod haar;
pub mod image;
pub mod inner;
pub mod lanes;
pub mod lobe;
pub mod morton;
pub mod product;
pub mod prune;
pub mod pruned;
pub mod query;
pub mod rotated;
pub mod sampler;
pub mod sparse;
pub mod split;
pub mod stored;
pub mod table;
pub mod tree;
pub mod triple;
pub mod tripling;
pub mod visibility;
pub mod warp;
pub mod wide;
