//! The hard cases: degenerate light, lobes, arguments and numbers, each with the answer that the header documents.

mod callbacks;
mod host;
mod laws;
mod light;
mod lobes;
mod maps;
mod numbers;
mod peers;
mod radiance;
mod shapes;
mod surface;
mod table;
mod tables;
mod vectors;

pub use table::{Row, Table};

/// Runs every case, in the order of the page.
pub fn run() -> Table {
    let mut table = Table::default();
    tables::add(&mut table);
    radiance::add(&mut table);
    shapes::add(&mut table);
    lobes::add(&mut table);
    surface::add(&mut table);
    callbacks::add(&mut table);
    numbers::add(&mut table);
    host::add(&mut table);
    vectors::add(&mut table);
    table
}
