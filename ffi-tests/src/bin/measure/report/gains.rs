//! Gains: how many times lower the variance of one method is than that of others at equal time.

use super::studies::{HITS, TEXTURED};
use wis_ffi_tests::cost::MODELS;
use wis_ffi_tests::measure::{Cell, Errors, Row};
use wis_ffi_tests::method::{Method, Peers};
use wis_ffi_tests::page::Prose;
use wis_ffi_tests::statistics::{bootstrap_ratio, geometric};

/// What the page says beside its numbers.
pub const PROSE: Prose = Prose(include_str!("page.md"));

/// A mean squared error of a region.
type Error = fn(&Errors) -> f64;

/// The metrics, by name.
pub const METRICS: [(&str, Error); 2] = [("absolute", |e| e.absolute), ("relative", |e| e.relative)];

/// The heads of both metrics of something.
pub fn metrics(of: impl std::fmt::Display) -> [String; METRICS.len()] {
    METRICS.map(|(metric, _)| format!("{of}, {metric}"))
}

/// How gains are counted: one of `METRICS`, one of `MODELS`, with one of `CACHES`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scale {
    pub metric: usize,
    pub model: usize,
    pub caches: usize,
}

impl Scale {
    /// Every metric in every cost model, with a renderer's caches.
    pub fn all() -> impl Iterator<Item = Scale> {
        let of = |model| (0..METRICS.len()).map(move |metric| Scale { metric, model, ..Scale::default() });
        (0..MODELS.len()).flat_map(of)
    }

    /// The metrics of a cost model.
    pub fn of_model(model: usize) -> [Scale; METRICS.len()] {
        std::array::from_fn(|metric| Scale { metric, model, ..Scale::default() })
    }

    pub fn name(self) -> String {
        format!("{}, {}", METRICS[self.metric].0, MODELS[self.model].0)
    }
}

/// A cell's row of a method at a number of samples.
pub fn row<'a>(cell: &'a Cell, method: &str, count: usize) -> Option<&'a Row> {
    cell.rows.iter().find(|row| row.method == method && row.count == count)
}

/// The numbers of samples that a cell was measured at.
pub fn counts(cell: &Cell) -> Vec<usize> {
    let mut counts: Vec<usize> = cell.rows.iter().map(|row| row.count).collect();
    counts.sort_unstable();
    counts.dedup();
    counts
}

/// The mean variance of a method.
pub fn variance(cell: &Cell, method: &str, count: usize, metric: usize) -> Option<f64> {
    Some(row(cell, method, count)?.mean(|repeat| METRICS[metric].1(&repeat.errors[0])))
}

/// The better of both limits.
pub fn limit(cell: &Cell, count: usize) -> Option<f64> {
    let limits = Method::all().filter(|m| m.is_limit());
    limits.filter_map(|m| variance(cell, &m.name(), count, 0)).min_by(f64::total_cmp)
}

/// Variance x time of the repeats.
fn costs(row: &Row, scale: Scale) -> Vec<f64> {
    costs_in_time_of(row, row, scale)
}

/// The same, in the time of another method.
fn costs_in_time_of(timed: &Row, row: &Row, scale: Scale) -> Vec<f64> {
    let ns = timed.times[scale.caches][scale.model].ns();
    row.repeats.iter().map(|repeat| METRICS[scale.metric].1(&repeat.errors[0]) * ns).collect()
}

fn comparable(ratio: [f64; 3]) -> Option<[f64; 3]> {
    (ratio[0].is_finite() && ratio[0] > 0.0).then_some(ratio)
}

/// The gain of a method over another with its interval of 95 %; `None` if there is no error to compare.
pub fn over(cell: &Cell, ours: &str, theirs: &str, count: usize, scale: Scale) -> Option<[f64; 3]> {
    let [theirs, ours] = [row(cell, theirs, count)?, row(cell, ours, count)?];
    comparable(bootstrap_ratio(&costs(theirs, scale), &costs(ours, scale)))
}

/// The gain that the samples of one method would have over another if they took the time of a third.
pub fn in_time_of(cell: &Cell, timed: &str, ours: &str, theirs: &str, count: usize, scale: Scale) -> Option<f64> {
    let [timed, ours, theirs] = [row(cell, timed, count)?, row(cell, ours, count)?, row(cell, theirs, count)?];
    Some(comparable(bootstrap_ratio(&costs(theirs, scale), &costs_in_time_of(timed, ours, scale)))?[0])
}

/// The peer of a list with the smallest variance x time, with hindsight: a gain over it is at most that over any of the list.
pub fn best(cell: &Cell, list: &Peers, count: usize, scale: Scale) -> Option<String> {
    let cost = |name: &String| Some(costs(row(cell, name, count)?, scale).iter().sum::<f64>());
    let measured = list.each.iter().map(|peer| peer.name()).filter_map(|name| Some((cost(&name)?, name)));
    measured.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, name)| name)
}

/// That peer, and the gain over it.
pub fn over_best(cell: &Cell, ours: &str, list: &Peers, count: usize, scale: Scale) -> Option<(String, [f64; 3])> {
    let best = best(cell, list, count, scale)?;
    let gain = over(cell, ours, &best, count, scale)?;
    Some((best, gain))
}

/// What a gain is counted against.
#[derive(Clone, Copy)]
pub enum Against {
    Method(&'static str),
    Best(&'static Peers),
}

impl Against {
    pub fn name(self) -> String {
        match self {
            Against::Method(name) => name.into(),
            Against::Best(list) => format!("best of {} baselines", list.each.len()),
        }
    }

    /// The gain over it in a cell.
    pub fn gain(self, cell: &Cell, ours: &str, count: usize, scale: Scale) -> Option<f64> {
        match self {
            Against::Method(theirs) => over(cell, ours, theirs, count, scale).map(|gain| gain[0]),
            Against::Best(list) => over_best(cell, ours, list, count, scale).map(|(_, gain)| gain[0]),
        }
    }

    /// The geometric mean over cells; not a number if there are none.
    pub fn mean<'a>(self, cells: impl IntoIterator<Item = &'a Cell>, ours: &str, count: usize, scale: Scale) -> f64 {
        geometric(cells.into_iter().filter_map(|cell| self.gain(cell, ours, count, scale)))
    }
}

pub fn of_study<'a>(cells: &'a [Cell], study: &str) -> Vec<&'a Cell> {
    cells.iter().filter(|cell| cell.study == study).collect()
}

/// Names in the order in which they come first.
pub fn distinct<'a>(names: impl Iterator<Item = &'a String>) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    names.for_each(|name| {
        if !all.contains(name) {
            all.push(name.clone())
        }
    });
    all
}

pub fn studies(cells: &[Cell]) -> Vec<String> {
    distinct(cells.iter().map(|cell| &cell.study))
}

pub fn materials(cells: &[&Cell]) -> Vec<String> {
    distinct(cells.iter().map(|cell| &cell.material))
}

pub fn lights(cells: &[&Cell]) -> Vec<String> {
    distinct(cells.iter().map(|cell| &cell.light))
}

/// The study's recommended method.
pub fn ours(study: &str) -> &'static str {
    if study == HITS || study == TEXTURED { "direct, shared" } else { "direct" }
}
