//! The light against look-ups of its own map that are written here a second time, in f64.

#[path = "../support/statistics.rs"]
#[allow(dead_code)]
mod statistics;

mod bits;
mod budget;
mod build;
mod built;
mod bytes;
mod chi_square;
mod degenerate;
mod invert;
mod lookup;
mod maps;
mod reach;
mod weights;
mod words;
