//! The hard cases: degenerate light, lobes, arguments and numbers, each with the answer that the header documents.

mod bounds;
pub mod brdf;
mod callbacks;
mod failing;
mod holes;
mod host;
mod huge;
mod laws;
mod light;
mod lobes;
mod maps;
mod numbers;
mod peers;
mod quadrature;
mod radiance;
mod scenes;
mod shapes;
mod surface;
mod table;
mod tables;
mod vectors;
mod wavelets;

pub use table::{Row, Table};

/// Runs every case, in the order of the page.
pub fn run() -> Table {
    let (mut table, mut jobs) = (Table::default(), Vec::new());
    scenes::add(&mut jobs);
    holes::add(&mut jobs);
    wavelets::add(&mut jobs);
    table.bounded = bounds::measure(&jobs);
    tables::add(&mut table);
    radiance::add(&mut table);
    shapes::add(&mut table);
    lobes::add(&mut table);
    surface::add(&mut table);
    callbacks::add(&mut table);
    failing::add(&mut table);
    numbers::add(&mut table);
    host::add(&mut table);
    vectors::add(&mut table);
    table
}
