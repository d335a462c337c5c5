//! Holds the work of every function of the headers to what its comment states: `Work: count.`
//!
//! Each function of a built shared library is run at growing sizes of the inputs that its statement names. Instructions are
//! counted, not time. The growth between two sizes must not exceed that of the statement.

mod arguments;
mod count;
mod curve;
mod world;

use crate::curve::{Curve, Place};
use crate::world::World;
use anyhow::{Context, Result, bail, ensure};
use clap::Parser;
use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;
use wis_fuzz::header;

#[derive(Parser)]
struct Options {
    /// The shared library.
    library: String,
    /// A folder for the counts.
    folder: String,
    /// Functions whose names contain this.
    #[arg(long, default_value = "")]
    only: String,
    /// What runs under valgrind.
    #[arg(long, hide = true)]
    measure: bool,
}

fn main() -> Result<()> {
    let options = Options::parse();
    if options.measure { measure(&options) } else { judge(&options) }
}

/// Runs every function at every size and prints what was run.
fn measure(options: &Options) -> Result<()> {
    ensure!(count::is_possible(), "not under valgrind");
    let mut world = World::new(&options.library, &options.only)?;
    let rows = include_str!("curves.txt").lines().filter(|line| !line.starts_with('#'));
    rows.for_each(|row| world.curve(row));
    Ok(())
}

/// The curves of the lines that the program under valgrind prints: function, input, relation, size, stated, measured or the label
/// of a count.
fn curves(options: &Options) -> Result<Vec<Curve>> {
    let _ = std::fs::remove_dir_all(&options.folder);
    std::fs::create_dir_all(&options.folder)?;
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--instr-atstart=no", "--collect-atstart=no", "--quiet"])
        .arg(format!("--callgrind-out-file={}/count", options.folder))
        .arg(std::env::current_exe()?)
        .args([&options.library, &options.folder, "--measure", "--only", &options.only])
        .output()
        .context("valgrind")?;
    ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let counts = count::read(options.folder.as_ref())?;
    let mut curves: Vec<Curve> = Vec::new();
    for line in String::from_utf8(output.stdout)?.lines() {
        let words: Vec<&str> = line.split('\t').collect();
        let [function, input, relation, size, stated, measured] = words[..] else { bail!("{line}") };
        let measured = match measured.strip_prefix("count ") {
            Some(label) => *counts.get(label).with_context(|| format!("no count of {line}"))? as f64,
            None => measured.parse()?,
        };
        if curves.last().is_none_or(|last| (&*last.function, &*last.input) != (function, input)) {
            let is_bound = relation == "at most";
            curves.push(Curve { function: function.into(), input: input.into(), is_bound, places: Vec::new() });
        }
        let place = Place { size: size.parse()?, stated: stated.parse()?, measured };
        curves.last_mut().context("a curve")?.places.push(place);
    }
    Ok(curves)
}

fn judge(options: &Options) -> Result<()> {
    let curves = curves(options)?;
    let functions = header::Headers::read().functions;
    let works: BTreeMap<String, Option<String>> =
        functions.into_iter().map(|function| (function.name, function.work)).collect();
    println!(
        "{:34} {:22} {:>12} {:>9} {:>9} {:>7}  work",
        "function", "input", "at the last", "measured", "stated", "excess"
    );
    for curve in &curves {
        let (measured, stated) = curve.exponents();
        let last = curve.places.last().map_or(0.0, |place| place.measured);
        let work = works.get(&curve.function).and_then(Option::as_deref).unwrap_or("none");
        let (name, input, excess) = (&curve.function, &curve.input, curve.excess());
        println!("{name:34} {input:22} {last:12} {measured:9.2} {stated:9.2} {excess:7.2}  {work}");
    }
    let mut faults: Vec<String> = curves.iter().filter_map(Curve::fault).collect();
    faults.extend(missing(&curves, &works).into_iter().filter(|fault| fault.contains(&options.only)));
    let functions: BTreeSet<&str> = curves.iter().map(|curve| &*curve.function).collect();
    println!("{} functions, {} curves, {} faults", functions.len(), curves.len(), faults.len());
    ensure!(faults.is_empty(), "{}", faults.join("\n"));
    Ok(())
}

/// Functions of the headers without a curve or a statement.
fn missing(curves: &[Curve], works: &BTreeMap<String, Option<String>>) -> Vec<String> {
    let measured: BTreeSet<&str> = curves.iter().map(|curve| &*curve.function).collect();
    let without = works.keys().filter(|name| !measured.contains(name.as_str()));
    let mut faults: Vec<String> = without.map(|name| format!("{name} has no curve")).collect();
    faults.extend(works.iter().filter(|(_, work)| work.is_none()).map(|(name, _)| format!("{name} states no work")));
    faults
}
