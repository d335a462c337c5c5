//! The page: the verdict first, then the tables that it comes from.

use crate::{Cell, FEW, PASSES, REGIONS};
use anyhow::Result;
use std::fmt::Write;
use wis_ffi_tests::cost::MODELS;
use wis_ffi_tests::page::{provenance, times};

/// The goal in penumbra and umbra.
const GOAL: f64 = 1.5;

impl Cell {
    /// How many times lower the variance is with a cache at equal time, in a region and a cost model; none for few points.
    fn gain(&self, region: usize, model: usize) -> Option<f64> {
        let cost = |with: usize| self.errors[with][region] * self.times[with][model];
        (self.points[region] >= FEW).then(|| cost(0) / cost(1))
    }
}

/// The geometric mean of gains, the lowest, and their number; none without any.
fn mean(gains: impl Iterator<Item = f64>) -> Option<(f64, f64, usize)> {
    let gains: Vec<f64> = gains.collect();
    let sum: f64 = gains.iter().map(|gain| gain.ln()).sum();
    (!gains.is_empty()).then(|| {
        let least = gains.iter().copied().fold(f64::INFINITY, f64::min);
        ((sum / gains.len() as f64).exp(), least, gains.len())
    })
}

pub fn write(cells: &[Cell]) -> Result<String> {
    let mut out = String::from("# Rendering in passes, with a visibility cache\n\n");
    let of = |region: usize, model: usize| mean(cells.iter().filter_map(|cell| cell.gain(region, model)));
    let reached =
        |region: usize| (0..MODELS.len()).all(|model| of(region, model).is_some_and(|(mean, ..)| mean >= GOAL));
    let verdicts = [1, 2].map(|region| {
        let gains: Vec<String> = (0..MODELS.len())
            .filter_map(|model| Some(format!("{} {}", times(of(region, model)?.0), MODELS[model].0)))
            .collect();
        format!("{}: {} ({})", REGIONS[region], gains.join(", "), if reached(region) { "reached" } else { "missed" })
    });
    writeln!(
        out,
        "**How many times lower the variance is with a cache, at equal time. Goal: {GOAL} in penumbra and in umbra. {}.**\n",
        verdicts.join("; ")
    )?;
    writeln!(
        out,
        "\
{PASSES} passes of one ray of `wis_direct` at each hit. After each pass `wis_visibility_cache_end_pass`; in the passes behind it
`wis_direct` prefers directions along which rays from the same place reached the light. Both images leave the first pass out.

Variance: the mean squared error of the image, of each point relative to reference^2 + (0.01 mean)^2. v: the part of a point's light that is
visible. Time: processor time of one thread for all but the tracing of camera rays. It holds key, recording and the end of passes.
Cost models: {} is the harness as it is; {} adds 150 ns for an evaluation of BRDF and radiance and 500 ns for a ray.\n",
        MODELS[0].0, MODELS[1].0
    )?;
    summary(&mut out, cells)?;
    each(&mut out, cells)?;
    Ok(out + "\n" + &provenance("passes")?)
}

/// A line for each scene and region.
fn summary(out: &mut String, cells: &[Cell]) -> Result<()> {
    writeln!(out, "| scene | points | {} | worst | {} | worst |", MODELS[0].0, MODELS[1].0)?;
    writeln!(out, "|---|---|---:|---:|---:|---:|")?;
    let mut scenes: Vec<&String> = cells.iter().map(|cell| &cell.name[0]).collect();
    scenes.dedup();
    for scene in scenes {
        for (region, name) in REGIONS.iter().enumerate() {
            let here = || cells.iter().filter(|cell| cell.name[0] == *scene);
            let gains = |model: usize| mean(here().filter_map(|cell| cell.gain(region, model)));
            if let (Some(cheap), Some(expensive)) = (gains(0), gains(1)) {
                let numbers = [cheap.0, cheap.1, expensive.0, expensive.1].map(times).join(" | ");
                writeln!(out, "| {scene} | {name}, {} cells | {numbers} |", cheap.2)?;
            }
        }
    }
    Ok(())
}

/// A line for each scene, light and material.
fn each(out: &mut String, cells: &[Cell]) -> Result<()> {
    writeln!(out, "\n## Each cell\n\nGains in the {} cost model. A dash: fewer than {FEW} points.\n", MODELS[1].0)?;
    writeln!(out, "| scene | light | material | {} | ns a point, without | with |", REGIONS.join(" | "))?;
    writeln!(out, "|---|---|---|---:|---:|---:|---:|---:|")?;
    for cell in cells {
        let gains = [0, 1, 2].map(|region| cell.gain(region, 1).map_or("-".into(), times)).join(" | ");
        let [without, with] = cell.times.map(|times| times[1]);
        writeln!(out, "| {} | {gains} | {without:.0} | {with:.0} |", cell.name.join(" | "))?;
    }
    Ok(())
}
