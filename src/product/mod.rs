//! The product of light and BRDF x cosine at a shading point: a density with sample, pdf and invert.
//!
//! A product is a function F over the light's own numbers, so its density is F times the light's density over the integral of F.
//! F is bilinear in the numbers (w, v) of each cell of the light, or of each of 4 x 4 parts of the cells whose division is worth most. No walk
//! through the light is needed to normalise it: a bilinear function's integral is the mean of its corners.
//!
//! Narrow lobes vary inside a cell. Their products are mixtures of this grid with the lobes' own density; a trial in a few directions
//! says how much of each.

pub mod check;
mod covers;
pub mod density;
pub mod info;
pub mod peak;
pub mod prepare;
mod share;
pub mod stored;
