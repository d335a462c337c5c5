//! The product of light and BRDF: a density that is exact, positive wherever it must be, and the same on every level.

mod bits;
mod chi_square;
mod client;
mod degenerate;
mod invert;
mod mean;
mod points;
mod prepared;
mod reach;
mod share;
mod weights;

use crate::light::{built, lookup, maps};
use crate::support::statistics;
