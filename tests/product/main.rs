//! The product of light and BRDF: a density that is exact, positive wherever it must be, and the same on every level.

#[path = "../light/built.rs"]
#[allow(dead_code)]
mod built;
#[path = "../light/lookup.rs"]
#[allow(dead_code)]
mod lookup;
#[path = "../light/maps.rs"]
#[allow(dead_code)]
mod maps;
#[path = "../support/statistics.rs"]
#[allow(dead_code)]
mod statistics;

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
