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
    for (region, name) in REGIONS.iter().enumerate().skip(1) {
        let gains =
            |model: usize| mean(cells.iter().filter(|cell| cell.all).filter_map(|cell| cell.gain(region, model)));
        let Some((cheap, expensive)) = gains(0).zip(gains(1)) else { continue };
        let verdict = if cheap.0.min(expensive.0) >= GOAL { "reached" } else { "**missed**" };
        writeln!(
            out,
            "- In the {name} the variance is {} times lower with a cache at equal time ({}), and {} times ({}). The goal of {GOAL} is {verdict}.",
            times(cheap.0).trim_end_matches('x'),
            MODELS[0].0,
            times(expensive.0).trim_end_matches('x'),
            MODELS[1].0
        )?;
    }
    let rendered = |all: bool| cells.iter().filter(|cell| cell.all == all).map(|cell| cell.rendered).max().unwrap_or(0);
    writeln!(
        out,
        "
{PASSES} passes of one ray of `wis_direct` at each hit. After each pass `wis_visibility_cache_end_pass`; in the passes behind it
`wis_direct` prefers directions along which rays from the same place reached the light. Both images leave the first pass out.

A cache learns from all points of a place. *All points*: up to {} in a pass. *A quarter*: up to {}, at the same places.

Variance: the mean squared error of the image, of each point relative to reference^2 + (0.01 mean)^2. v: the part of a point's light that
is visible. Lit: v > 0.95. Umbra: v < 0.05. Time: processor time of one thread for all but camera rays. It holds keys, recording
and the end of passes. Costs are two models. The {} one is the harness as it is. The {} one adds 150 ns for an evaluation of
BRDF and radiance, and 500 ns for a ray.\n",
        rendered(true),
        rendered(false),
        MODELS[0].0,
        MODELS[1].0
    )?;
    summary(&mut out, cells)?;
    each(&mut out, cells)?;
    Ok(out + "\n" + &provenance("passes")?)
}

/// A line for each scene, density and region.
fn summary(out: &mut String, cells: &[Cell]) -> Result<()> {
    writeln!(out, "| scene | region | rendered | cells | {} | worst | {} | worst |", MODELS[0].0, MODELS[1].0)?;
    writeln!(out, "|---|---|---|---:|---:|---:|---:|---:|")?;
    let mut scenes: Vec<&String> = cells.iter().map(|cell| &cell.name[0]).collect();
    scenes.dedup();
    for scene in scenes {
        for (region, name) in REGIONS.iter().enumerate() {
            for all in [true, false] {
                let here = || cells.iter().filter(|cell| cell.name[0] == *scene && cell.all == all);
                let gains = |model: usize| mean(here().filter_map(|cell| cell.gain(region, model)));
                if let (Some(cheap), Some(expensive)) = (gains(0), gains(1)) {
                    let numbers = [cheap.0, cheap.1, expensive.0, expensive.1].map(times).join(" | ");
                    writeln!(out, "| {scene} | {name} | {} | {} | {numbers} |", density(all), cheap.2)?;
                }
            }
        }
    }
    Ok(())
}

fn density(all: bool) -> &'static str {
    if all { "all points" } else { "a quarter" }
}

/// A line for each scene, light and material.
fn each(out: &mut String, cells: &[Cell]) -> Result<()> {
    writeln!(
        out,
        "\n## Each cell\n\nAll points, in the {} cost model. A dash: fewer than {FEW} points have that much light.\n",
        MODELS[1].0
    )?;
    writeln!(out, "| scene | light | material | {} | ns a point, without | with |", REGIONS.join(" | "))?;
    writeln!(out, "|---|---|---|---:|---:|---:|---:|---:|")?;
    for cell in cells.iter().filter(|cell| cell.all) {
        let gains = [0, 1, 2].map(|region| cell.gain(region, 1).map_or("-".into(), times)).join(" | ");
        let [without, with] = cell.times.map(|times| times[1]);
        writeln!(out, "| {} | {gains} | {without:.0} | {with:.0} |", cell.name.join(" | "))?;
    }
    Ok(())
}
