//! The product of light and BRDF: a density that is exact, positive wherever it must be, and the same on every level.

mod bits;
mod chi_square;
mod client;
mod cone;
mod degenerate;
mod divided;
mod floor;
mod formulas;
mod invert;
mod lamp;
mod mean;
mod narrow;
mod points;
mod prepared;
mod reach;
mod scale;
mod share;
mod weights;

use crate::light::{built, lookup, maps};
use crate::support::statistics;
