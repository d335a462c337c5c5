//! The light against look-ups of its own map that are written here a second time, in f64.

use crate::support::statistics;

mod bits;
mod budget;
mod build;
pub mod built;
mod bumps;
mod bytes;
mod causes;
mod chi_square;
mod compare;
mod compensated;
mod conventions;
mod degenerate;
mod floor;
mod invert;
pub mod lookup;
pub mod maps;
mod parts;
mod reach;
mod strata;
mod weights;
mod words;
