//! The page: the verdict first, then the tables that it comes from.

use anyhow::Result;
use wis_ffi_tests::cost::MODELS;
use wis_ffi_tests::measure::FEW;
use wis_ffi_tests::page::{Page, Part, Table, times};
use wis_ffi_tests::statistics::geometric;

/// The goal in penumbra and umbra.
const GOAL: f64 = 1.5;

/// Passes of one ray; errors and times are those of all but the first, in which the cache knows nothing.
pub const PASSES: u32 = 16;
/// Groups of points by the visible part v of their light: those of `measure::REGIONS` but all.
pub const REGIONS: [&str; 3] = ["lit", "penumbra", "umbra"];

/// A scene, a light and a material.
pub struct Cell {
    pub name: [String; 3],
    /// Points that are rendered in a pass, and whether those are all.
    pub rendered: usize,
    pub all: bool,
    /// Points in each region.
    pub points: [usize; REGIONS.len()],
    /// Mean squared relative error of the image by region, without and with a cache.
    pub errors: [[f64; REGIONS.len()]; 2],
    /// Nanoseconds of processor time for a point and a pass in each cost model, without and with a cache.
    pub times: [[f64; MODELS.len()]; 2],
}

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
    let least = gains.iter().copied().fold(f64::INFINITY, f64::min);
    (!gains.is_empty()).then(|| (geometric(gains.iter().copied()), least, gains.len()))
}

pub fn page(cells: &[Cell]) -> Result<Page> {
    let [cheap, expensive] = MODELS.map(|model| model.0);
    let mut verdicts = Vec::new();
    for (region, name) in REGIONS.iter().enumerate().skip(1) {
        let gains =
            |model: usize| mean(cells.iter().filter(|cell| cell.all).filter_map(|cell| cell.gain(region, model)));
        let Some((few, many)) = gains(0).zip(gains(1)) else { continue };
        let verdict = if few.0.min(many.0) >= GOAL { "reached" } else { "**missed**" };
        let [few, many] = [few, many].map(|gain| times(gain.0).trim_end_matches('x').to_string());
        verdicts.push(format!(
            "In the {name} the variance is {few} times lower with a cache at equal time ({cheap}), and {many} times ({expensive}). The goal of \
             {GOAL} is {verdict}."
        ));
    }
    let rendered = |all: bool| cells.iter().filter(|cell| cell.all == all).map(|cell| cell.rendered).max().unwrap_or(0);
    let method = format!(
        "{PASSES} passes of one ray of `wis_direct` at each hit. After each pass `wis_visibility_cache_end_pass`; in the passes behind it
`wis_direct` prefers directions along which rays from the same place reached the light. Both images leave the first pass out.

A cache learns from all points of a place. *All points*: up to {} in a pass. *A quarter*: up to {}, at the same places.

Variance: the mean squared error of the image, of each point relative to reference^2 + (0.01 mean)^2. v: the part of a point's light that
is visible. Lit: v > 0.95. Umbra: v < 0.05. Time: processor time of one thread for all but camera rays. It holds keys, recording
and the end of passes. Costs are two models. The {cheap} one is the harness as it is. The {expensive} one adds 150 ns for an evaluation of
BRDF and radiance, and 500 ns for a ray.",
        rendered(true),
        rendered(false)
    );
    let heading =
        format!("All points, in the {expensive} cost model. A dash: fewer than {FEW} points have that much light.");
    let short = vec![
        Part::List(verdicts),
        Part::Text(method),
        Part::Table(summary(cells)),
        Part::Heading("Each cell".into()),
        Part::Text(heading),
        Part::Table(each(cells)),
    ];
    Page::measured("Rendering in passes, with a visibility cache", short, "passes")
}

/// A line for each scene, density and region.
fn summary(cells: &[Cell]) -> Table {
    let mut table =
        Table::new(3, &["scene", "region", "rendered", "cells", MODELS[0].0, "worst", MODELS[1].0, "worst"]);
    let mut scenes: Vec<&String> = cells.iter().map(|cell| &cell.name[0]).collect();
    scenes.dedup();
    for scene in scenes {
        for (region, name) in REGIONS.iter().enumerate() {
            for all in [true, false] {
                let here = || cells.iter().filter(|cell| cell.name[0] == *scene && cell.all == all);
                let gains = |model: usize| mean(here().filter_map(|cell| cell.gain(region, model)));
                if let (Some(cheap), Some(expensive)) = (gains(0), gains(1)) {
                    let words =
                        [scene.as_str(), name, if all { "all points" } else { "a quarter" }, &cheap.2.to_string()]
                            .map(String::from);
                    table.row(words.into_iter().chain([cheap.0, cheap.1, expensive.0, expensive.1].map(times)));
                }
            }
        }
    }
    table
}

/// A line for each scene, light and material.
fn each(cells: &[Cell]) -> Table {
    let [lit, penumbra, umbra] = REGIONS;
    let mut table = Table::new(3, &["scene", "light", "material", lit, penumbra, umbra, "ns a point, without", "with"]);
    for cell in cells.iter().filter(|cell| cell.all) {
        let gains = [0, 1, 2].map(|region| cell.gain(region, 1).map_or("-".into(), times));
        let ns = cell.times.map(|times| format!("{:.0}", times[1]));
        table.row(cell.name.iter().cloned().chain(gains).chain(ns));
    }
    table
}
