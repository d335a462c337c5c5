//! The fuzzer: an epoch after the other, or cases on record.

use anyhow::Result;
use clap::Parser;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use wis_fuzz::play::{Words, play};
use wis_fuzz::tally::Tally;
use wis_fuzz::world::World;
use wis_fuzz::{again, alarm};

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
    /// Inputs of the guided fuzzer: a file, or a folder.
    #[arg(long)]
    corpus: Option<PathBuf>,
}

fn main() -> Result<()> {
    let options = Options::parse();
    alarm::set();
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
        let words = Words { seed: options.seed, epoch, number: EPOCH - 1 };
        play(&mut world, &words, &mut tally, false)?;
        epoch += 1;
    }
    print!("{}", tally.table());
    let hours = alarm::seconds(libc::CLOCK_PROCESS_CPUTIME_ID) / 3600.0;
    println!("seed {}, {epoch} epochs, {hours:.3} hours of a core", options.seed);
    tally.judge()
}
