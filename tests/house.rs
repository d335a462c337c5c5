//! The repository about itself: who imports whom, and that what is written down in two places agrees.

mod imports;
mod inventory;
mod mutants;
mod pages;
mod shared;
