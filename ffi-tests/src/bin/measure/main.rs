//! The measuring program: what it measures is its first argument, `measure report --quick`.

mod goals;
mod light;
mod passes;
mod report;
mod speed;
mod tuning;

use clap::Parser;

#[derive(Parser)]
enum Instrument {
    Report(report::Options),
    Light(light::Options),
    Passes(passes::Options),
    Goals(goals::Options),
    Tuning(tuning::Options),
}

fn main() -> anyhow::Result<()> {
    match Instrument::parse() {
        Instrument::Report(options) => report::run(options),
        Instrument::Light(options) => light::run(options),
        Instrument::Passes(options) => passes::run(options),
        Instrument::Goals(options) => goals::run(options),
        Instrument::Tuning(options) => tuning::run(options),
    }
}
