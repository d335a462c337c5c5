//! The hard cases: degenerate light, lobes, arguments and numbers, each with the answer that the header documents.

mod bounds;
pub mod brdf;
mod failing;
mod holes;
mod huge;
mod laws;
mod maps;
mod peers;
mod quadrature;
mod scenes;
mod table;
mod tables;
mod vectors;

pub use table::{Row, Table};

/// Runs every case, in the order of the page.
pub fn run() -> Table {
    let (mut table, mut jobs) = (Table::default(), Vec::new());
    scenes::add(&mut jobs);
    holes::add(&mut jobs);
    table.bounded = bounds::measure(&jobs);
    tables::add(&mut table);
    failing::add(&mut table);
    vectors::add(&mut table);
    table
}
