//! The measuring program: what it measures is its first argument, `measure report --quick`.

mod goals;
mod light;
mod report;
mod rooms;
mod speed;

use clap::{Args, Parser};
use std::path::PathBuf;

#[derive(Parser)]
enum Instrument {
    Report(report::Options),
    /// The light beside a table as pbrt builds it; fails if a goal is missed by far
    Light(Output),
    /// Rooms with portals and visibility caches beside what renderers do there
    Rooms(Output),
    /// What one process can decide beside version 0.2
    Goals(Output),
}

#[derive(Args)]
struct Output {
    /// The page to write
    page: PathBuf,
    /// Little of everything, for a check
    #[arg(long)]
    quick: bool,
}

fn main() -> anyhow::Result<()> {
    match Instrument::parse() {
        Instrument::Report(options) => report::run(options),
        Instrument::Light(of) => light::run(&of.page, of.quick),
        Instrument::Rooms(of) => rooms::run(&of.page, of.quick),
        Instrument::Goals(of) => goals::run(&of.page, of.quick),
    }
}
