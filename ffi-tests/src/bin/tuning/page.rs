//! Values of a constant side by side, and which of them the rule takes.

use crate::constants::Constant;
use crate::{Cell, MAPS};
use anyhow::Result;
use std::fmt::Write;
use wis_ffi_tests::statistics::{median, quantile, splitmix};

/// How a value is chosen.
const RULE: &str = "The value with the smallest score is the best. The score is variance x time over that of the value in force: the geometric \
    mean over four maps, all materials and numbers of rays where the constant acts, both metrics and both cost models, with cold caches. \
    A value in force whose score is within 3 % of the best stays. The rule was committed before the first run.";
/// A value in force stays if the best is no better than this.
const MARGIN: f64 = 0.03;
/// Resamples of an interval.
const RESAMPLES: usize = 300;

/// A row of a cell.
struct Measured {
    light: String,
    /// Absolute and relative, by repeat.
    errors: Vec<[f64; 2]>,
    /// Cold and warm, cheap and expensive, by round.
    ns: Vec<[[f64; 2]; 2]>,
}

/// Its means, or those of a resample.
struct Means {
    errors: [f64; 2],
    ns: [[f64; 2]; 2],
}

impl Measured {
    fn all(cells: &[Cell]) -> Vec<Measured> {
        let rows = cells
            .iter()
            .flat_map(|cell| cell.rows.iter().zip(&cell.times).map(|(row, times)| (&cell.light, row, times)));
        rows.map(|(light, row, times)| Measured {
            light: light.clone(),
            errors: row.repeats.iter().map(|r| [r.errors[0].absolute, r.errors[0].relative]).collect(),
            ns: times.iter().map(|times| times.map(|caches| caches.map(|time| time.ns()))).collect(),
        })
        .collect()
    }

    fn means(&self, mut pick: impl FnMut(usize, usize) -> usize) -> Means {
        let (repeats, rounds) = (self.errors.len(), self.ns.len());
        let errors: Vec<[f64; 2]> = (0..repeats).map(|i| self.errors[pick(i, repeats)]).collect();
        let ns: Vec<[[f64; 2]; 2]> = (0..rounds).map(|i| self.ns[pick(i, rounds)]).collect();
        let time = |caches: usize, model: usize| median(&ns.iter().map(|t| t[caches][model]).collect::<Vec<_>>());
        Means {
            errors: [0, 1].map(|metric| errors.iter().map(|e| e[metric]).sum::<f64>() / repeats as f64),
            ns: [0, 1].map(|caches| [0, 1].map(|model| time(caches, model))),
        }
    }
}

/// What a mean is taken over.
#[derive(Clone, Copy)]
struct Scope<'a> {
    metrics: &'a [usize],
    models: &'a [usize],
    caches: usize,
    variance: bool,
    time: bool,
}

const ALL: Scope = Scope { metrics: &[0, 1], models: &[0, 1], caches: 0, variance: true, time: true };

impl Scope<'_> {
    /// The geometric mean of the ratios of both.
    fn score<'a>(self, pairs: impl Iterator<Item = (&'a Means, &'a Means)>) -> f64 {
        let (mut sum, mut count) = (0.0, 0);
        for (own, other) in pairs {
            for &metric in self.metrics {
                for &model in self.models {
                    let variance = own.errors[metric] / other.errors[metric];
                    let time = own.ns[self.caches][model] / other.ns[self.caches][model];
                    sum += if self.variance { variance.ln() } else { 0.0 } + if self.time { time.ln() } else { 0.0 };
                    count += 1;
                }
            }
        }
        (sum / f64::from(count)).exp()
    }
}

/// The page of all constants that were measured.
pub fn page(measured: &[(&Constant, Vec<Vec<Cell>>)], commit: &str) -> Result<String> {
    let (mut out, mut tables, mut verdicts) = (String::new(), String::new(), Vec::new());
    for (constant, values) in measured {
        verdicts.push(table(&mut tables, constant, values)?);
    }
    writeln!(out, "# Constants chosen on development maps alone\n")?;
    writeln!(out, "| constant | file | in force | best | score of the best | stays |\n|---|---|---:|---:|---:|---|")?;
    for ((constant, _), (best, score)) in measured.iter().zip(&verdicts) {
        let stays = if 1.0 - score <= MARGIN { "yes" } else { "**no**" };
        let (what, file, own) = (constant.what, constant.file, constant.values[0]);
        writeln!(out, "| {what} | `{file}` | {own} | {best} | {score:.3} | {stays} |")?;
    }
    let maps = MAPS.map(short).join(", ");
    writeln!(out, "\n{RULE}\n")?;
    writeln!(
        out,
        "Maps: {maps}. Mesh: `spot`. Below 1 a value is better than the one in force. The interval of 95 % resamples repeats and rounds of \
         times; shading points are the same for all values. Warm caches do not count for the score.\n"
    )?;
    out.push_str(&tables);
    writeln!(out, "Commit {commit}. Each value is built into a library of its own: `make tuning`.")?;
    Ok(out)
}

fn short(map: &str) -> &str {
    map.trim_end_matches(".hdr").trim_end_matches("_1k")
}

/// Writes the values of a constant; the best and its score.
fn table<'a>(out: &mut String, constant: &Constant, values: &[Vec<Cell>]) -> Result<(&'a str, f64)>
where
    Constant: 'a,
{
    writeln!(out, "## {}\n", constant.what[..1].to_uppercase() + &constant.what[1..])?;
    let materials = (constant.cells)().into_iter().map(|(material, rays)| {
        let rays: Vec<String> = rays.iter().map(usize::to_string).collect();
        format!("{} ({})", material.name, rays.join(", "))
    });
    let hits = if constant.hits > 1 { format!(", {} hits in a pixel", constant.hits) } else { String::new() };
    writeln!(out, "Materials, and rays at a hit: {}{hits}.\n", materials.collect::<Vec<_>>().join(", "))?;
    let maps = MAPS.map(short).join(" | ");
    writeln!(
        out,
        "| `{}` | score | 95 % | {maps} | absolute | relative | cheap | expensive | variance | time | score, warm caches |",
        constant.text
    )?;
    writeln!(out, "|---|{}", "---:|".repeat(9 + MAPS.len()))?;
    let measured: Vec<Vec<Measured>> = values.iter().map(|cells| Measured::all(cells)).collect();
    let means = |value: &[Measured]| -> Vec<Means> { value.iter().map(|m| m.means(|i, _| i)).collect() };
    let current = means(&measured[0]);
    let mut best = (constant.values[0], 1.0);
    for (value, rows) in constant.values.iter().zip(&measured) {
        let own = means(rows);
        let score = |scope: Scope| scope.score(own.iter().zip(&current));
        let of_map = |map: &&str| {
            let pairs = own.iter().zip(&current).zip(rows);
            ALL.score(pairs.filter(|(_, row)| row.light == map.trim_end_matches(".hdr")).map(|(pair, _)| pair))
        };
        let total = score(ALL);
        let mut columns = vec![total];
        let interval = interval(rows, &measured[0]);
        columns.extend(MAPS.iter().map(of_map));
        columns.extend([0, 1].map(|metric| score(Scope { metrics: &[metric], ..ALL })));
        columns.extend([0, 1].map(|model| score(Scope { models: &[model], ..ALL })));
        columns.push(score(Scope { time: false, ..ALL }));
        columns.push(score(Scope { variance: false, ..ALL }));
        columns.push(score(Scope { caches: 1, ..ALL }));
        let mut cells: Vec<String> = columns.iter().map(|column| format!("{column:.3}")).collect();
        cells.insert(1, format!("{:.3} to {:.3}", interval[0], interval[1]));
        writeln!(out, "| {value} | {} |", cells.join(" | "))?;
        if total < best.1 {
            best = (value, total);
        }
    }
    writeln!(out)?;
    Ok(best)
}

/// The interval of 95 % of a score.
fn interval(own: &[Measured], current: &[Measured]) -> [f64; 2] {
    let mut state = 37;
    let mut resample = |rows: &[Measured]| -> Vec<Means> {
        let pick = |_: usize, count: usize| (splitmix(&mut state) % count as u64) as usize;
        let mut pick = pick;
        rows.iter().map(|row| row.means(&mut pick)).collect()
    };
    let scores: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            let (own, current) = (resample(own), resample(current));
            ALL.score(own.iter().zip(&current))
        })
        .collect();
    [0.025, 0.975].map(|tau| quantile(&scores, tau))
}
