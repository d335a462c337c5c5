//! Calls every function of the headers with valid and hostile arguments, and checks what must hold afterwards.
//!
//! The functions are called in a built shared library by the calling convention of x86-64 Linux. Everything follows from the
//! seed: a failure names the words that reproduce it.

mod again;
mod alarm;
mod building;
mod call;
mod case;
mod header;
mod inputs;
mod laws;
mod maps;
mod memory;
mod oracle;
mod play;
mod pool;
mod random;
mod rows;
mod structs;
mod tally;
mod values;
mod world;

use crate::play::{Words, play};
use crate::rows::ROWS;
use crate::tally::Tally;
use crate::world::World;
use anyhow::Result;
use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// Calls after which everything begins anew, so that a failure is reproduced in seconds.
const EPOCH: u64 = 4000;

#[derive(Parser)]
struct Options {
    /// The shared library.
    library: String,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How long.
    #[arg(long, default_value_t = 0.5)]
    minutes: f64,
    /// The words of a failure: seed:epoch:number.
    #[arg(long)]
    replay: Option<String>,
    /// A list of such words, which must hold now.
    #[arg(long)]
    replays: Option<PathBuf>,
    /// Inputs of the guided fuzzer: a file, or a folder.
    #[arg(long)]
    corpus: Option<PathBuf>,
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("{fault}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<()> {
    alarm::set();
    if let Some(list) = &options.replays {
        return again::replays(&options.library, list);
    }
    if let Some(path) = &options.corpus {
        return again::corpus(&options.library, path);
    }
    let (mut world, mut tally) = (World::new(&options.library)?, Tally::default());
    if let Some(words) = &options.replay {
        return play(&mut world, &Words::read(words)?, &mut tally, true);
    }
    let (begin, length) = (Instant::now(), Duration::from_secs_f64(60.0 * options.minutes));
    let mut epoch = 0;
    while begin.elapsed() < length && !alarm::STOP.load(Ordering::Relaxed) {
        let words = Words { seed: options.seed, epoch, number: EPOCH - 1, rows: ROWS.len() };
        play(&mut world, &words, &mut tally, false)?;
        epoch += 1;
    }
    print!("{}", tally.table());
    let hours = alarm::seconds(libc::CLOCK_PROCESS_CPUTIME_ID) / 3600.0;
    println!("seed {}, {epoch} epochs, {hours:.3} hours of a core", options.seed);
    tally.judge()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The headers drive the fuzzer: what they declare has a row.
    #[test]
    fn every_function_has_a_row() {
        let mut declared: Vec<String> = header::Headers::read().functions.into_iter().map(|f| f.name).collect();
        let mut rows: Vec<String> = rows::current().map(|row| row.name.into()).collect();
        declared.sort_unstable();
        rows.sort_unstable();
        assert_eq!(declared, rows);
    }

    /// The parser of headers agrees with a compiler on what it reads.
    #[test]
    fn layouts_are_those_of_the_binary_interface() {
        let headers = header::Headers::read();
        let abi = include_str!("../../packaging/abi.txt");
        let mut seen = 0;
        for line in abi.lines().filter_map(|line| line.strip_prefix("struct ")) {
            let Some((name, size)) = line.split_once(": ").filter(|(name, _)| !name.contains('.')) else { continue };
            let layout = &headers.layouts[name];
            assert_eq!(size, format!("{} bytes, alignment {}", layout.size, layout.align), "{name}");
            seen += 1;
        }
        assert!(seen >= 15, "{seen}");
    }
}
