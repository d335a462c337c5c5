//! The measuring program: what it measures is its first argument, `measure report --quick`.

mod goals;
mod light;
mod passes;
mod report;
mod speed;
mod tuning;

use clap::{Args, Parser};
use std::path::PathBuf;

#[derive(Parser)]
enum Instrument {
    Report(report::Options),
    Light(light::Options),
    /// Rendering in passes of one ray at a hit, with and without a visibility cache
    Passes(Output),
    /// What one process can decide beside version 0.2
    Goals(Output),
    Tuning(tuning::Options),
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
        Instrument::Light(options) => light::run(options),
        Instrument::Passes(of) => passes::run(&of.page, of.quick),
        Instrument::Goals(of) => goals::run(&of.page, of.quick),
        Instrument::Tuning(options) => tuning::run(options),
    }
}
