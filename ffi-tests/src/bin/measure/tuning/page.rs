//! Values of a constant side by side, and which of them the rule takes.

use super::constants::Constant;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use wis_ffi_tests::caches::{CACHES, RENDERER, WARM};
use wis_ffi_tests::measure::Row;
use wis_ffi_tests::page::{Page, Part, Table};
use wis_ffi_tests::statistics::{median, quantile, splitmix};
use wis_ffi_tests::timing::Times;

/// How a value is chosen.
const RULE: &str = "**The rule.** The value with the smallest score is the best. The score is variance x time over that of the value in \
    force: the geometric mean over four maps, all materials and numbers of rays where the constant acts, both metrics and both cost models, \
    with a renderer's caches. A value in force whose score is within 3 % of the best stays.";
/// What led to the values in force.
const ORDER: &str = "**The order.** The rule was committed in 2c2b48f, before the first run. The first whole run, c95070a, moved two \
    constants: 16 candidates in place of 8 for 2 and 3 rays, and 1.25 in place of 1.5 for products that hits share. This run tries the \
    values in force then against others.";
/// A value in force stays if the best is no better than this.
const MARGIN: f64 = 0.03;
/// Resamples of an interval.
const RESAMPLES: usize = 300;

/// The development maps. `forest_slope`, which older constants were tuned on, too, is not among them.
pub const MAPS: [&str; 4] =
    ["st_fagans_interior_1k.hdr", "studio_small_03_1k.hdr", "venice_sunset_1k.hdr", "rooitou_park_1k.hdr"];

/// What was measured on one map and material.
#[derive(Serialize, Deserialize)]
pub struct Cell {
    pub light: String,
    /// Its times are those of one pixel: see `times`.
    pub rows: Vec<Row>,
    /// Of each row, by round.
    pub times: Vec<Vec<[Times; CACHES.len()]>>,
}

/// A row of a cell.
struct Measured {
    light: String,
    rays: usize,
    /// Absolute and relative, by repeat.
    errors: Vec<[f64; 2]>,
    /// With each of `CACHES`, cheap and expensive, by round.
    ns: Vec<[[f64; 2]; CACHES.len()]>,
}

/// Its means, or those of a resample.
struct Means {
    errors: [f64; 2],
    ns: [[f64; 2]; CACHES.len()],
}

impl Measured {
    fn all(cells: &[Cell]) -> Vec<Measured> {
        let rows = cells
            .iter()
            .flat_map(|cell| cell.rows.iter().zip(&cell.times).map(|(row, times)| (&cell.light, row, times)));
        rows.map(|(light, row, times)| Measured {
            light: light.clone(),
            rays: row.count,
            errors: row.repeats.iter().map(|r| [r.errors[0].absolute, r.errors[0].relative]).collect(),
            ns: times.iter().map(|times| times.map(|caches| caches.map(|time| time.ns()))).collect(),
        })
        .collect()
    }

    fn means(&self, mut pick: impl FnMut(usize, usize) -> usize) -> Means {
        let (repeats, rounds) = (self.errors.len(), self.ns.len());
        let errors: Vec<[f64; 2]> = (0..repeats).map(|i| self.errors[pick(i, repeats)]).collect();
        let ns: Vec<[[f64; 2]; CACHES.len()]> = (0..rounds).map(|i| self.ns[pick(i, rounds)]).collect();
        let time = |caches: usize, model: usize| median(&ns.iter().map(|t| t[caches][model]).collect::<Vec<_>>());
        Means {
            errors: [0, 1].map(|metric| errors.iter().map(|e| e[metric]).sum::<f64>() / repeats as f64),
            ns: std::array::from_fn(|caches| [0, 1].map(|model| time(caches, model))),
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

const ALL: Scope = Scope { metrics: &[0, 1], models: &[0, 1], caches: RENDERER, variance: true, time: true };

/// A row with a value, and with the one in force.
type Pair<'a> = (&'a Measured, &'a Measured);

impl Scope<'_> {
    fn of(self, pairs: &[Pair]) -> f64 {
        let means: Vec<[Means; 2]> =
            pairs.iter().map(|(own, other)| [own.means(|i, _| i), other.means(|i, _| i)]).collect();
        self.score(means.iter().map(|[own, other]| (own, other)))
    }

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

/// The best value of a constant.
struct Best {
    value: &'static str,
    score: f64,
    interval: [f64; 2],
    warm: f64,
}

impl Best {
    /// Whether the value in force stays.
    fn stays(&self) -> bool {
        1.0 - self.score <= MARGIN
    }
}

/// The page of all constants that were measured.
///
/// # Errors
/// There is no value in force, or no provenance.
pub fn page(measured: &[(&Constant, Vec<Vec<Cell>>)], commit: &str) -> Result<Page> {
    let (mut sections, mut lines, mut go) = (Vec::new(), Vec::new(), Vec::new());
    let head = ["constant", "file", "in force", "best", "score of the best", "95 %", "warm", "stays"];
    let mut table = Table::new(2, &head);
    for (constant, values) in measured {
        let best = section(&mut sections, constant, values)?;
        let (what, in_force) = (constant.what, constant.values[0]);
        let Best { value, score, interval, warm } = best;
        let stays = if best.stays() { "yes" } else { "no" };
        let words = [what.into(), format!("`{}`", constant.file), in_force.into(), value.into()];
        table.row(words.into_iter().chain([figure(score), range(interval), figure(warm), stays.into()]));
        if !best.stays() {
            let clear = if interval[1] >= 1.0 {
                format!(" The interval reaches {:.3}, so this is not clear.", interval[1])
            } else {
                String::new()
            };
            go.push(format!(
                "**Does not stay: {what}.** {value} in place of {in_force} has a score of {score:.3}, and {warm:.3} with warm caches.{clear}"
            ));
        }
    }
    lines.push(format!(
        "**{} of {} constants stay: development maps alone give the value in force, or one that is at most 3 % better.**",
        measured.len() - go.len(),
        measured.len()
    ));
    lines.extend(go);
    lines.extend([RULE.into(), ORDER.into()]);
    lines.push(format!(
        "**What was measured.** Maps: {}. The development map forest_slope was not used. Mesh: `spot`, with the same shading points for all \
         values. Below 1 a value is better than the one in force. The interval of 95 % resamples repeats and rounds of times. Where \
         a process keeps its memory changes its times by some percent. So rows that take the same rays with both values do not count: the \
         column \"time, same rays\" has their times, and all times of that value are divided by it. The division was added when 1.1, \
         1.5 and 2.0 for shared products all seemed 4 % to 5 % faster than 1.25. The libraries are of commit {commit}: `make tuning` builds \
         each value into one of its own.",
        MAPS.map(short).join(", ")
    ));
    let short = std::iter::once(Part::Table(table)).chain(lines.into_iter().map(Part::Text)).chain(sections);
    Page::measured("Constants chosen on development maps alone", short.collect(), "tuning")
}

fn short(map: &str) -> &str {
    map.trim_end_matches(".hdr").trim_end_matches("_1k")
}

/// Adds the values of a constant, and answers the best.
fn section(out: &mut Vec<Part>, constant: &Constant, values: &[Vec<Cell>]) -> Result<Best> {
    let materials = (constant.cells)().into_iter().map(|(material, rays)| {
        let rays: Vec<String> = rays.iter().map(usize::to_string).collect();
        format!("{} ({})", material.name, rays.join(", "))
    });
    let materials = materials.collect::<Vec<_>>().join(", ");
    let hits = if constant.hits > 1 { format!(", {} hits in a pixel", constant.hits) } else { String::new() };
    out.push(Part::Heading(constant.what[..1].to_uppercase() + &constant.what[1..]));
    out.push(Part::Text(format!("Materials, and rays at a hit: {materials}{hits}. In force: `{}`.", constant.text)));
    let scopes = ["absolute", "relative", "cheap", "expensive", "variance", "time", "time, same rays", "warm"];
    let head: Vec<&str> = ["value", "score", "95 %"].into_iter().chain(MAPS.map(short)).chain(scopes).collect();
    let mut table = Table::new(1, &head);
    let mut measured: Vec<Vec<Measured>> = values.iter().map(|cells| Measured::all(cells)).collect();
    let (in_force, others) = measured.split_first_mut().context("a value in force")?;
    let mut best = Best { value: constant.values[0], score: 1.0, interval: [f64::NAN; 2], warm: 1.0 };
    for (value, rows) in constant.values[1..].iter().zip(others) {
        let process = same_process(rows, in_force);
        let pairs = rows.iter().zip(&*in_force);
        let acts: Vec<Pair> = pairs.filter(|(own, other)| own.errors != other.errors).collect();
        let score = |scope: Scope| scope.of(&acts);
        let total = score(ALL);
        let mut columns = vec![total];
        columns.extend(MAPS.map(|map| {
            let of_map = acts.iter().filter(|(own, _)| own.light == map.trim_end_matches(".hdr"));
            ALL.of(&of_map.copied().collect::<Vec<_>>())
        }));
        columns.extend([0, 1].map(|metric| score(Scope { metrics: &[metric], ..ALL })));
        columns.extend([0, 1].map(|model| score(Scope { models: &[model], ..ALL })));
        let time = Scope { variance: false, ..ALL };
        columns.extend([score(Scope { time: false, ..ALL }), score(time), process]);
        let warm = score(Scope { caches: WARM, ..ALL });
        columns.push(warm);
        let mut cells: Vec<String> = columns.into_iter().map(figure).collect();
        let interval = interval(&acts);
        cells.insert(1, range(interval));
        table.row(std::iter::once(value.to_string()).chain(cells));
        if total < best.score {
            best = Best { value, score: total, interval, warm };
        }
    }
    out.push(Part::Table(table));
    out.extend(by_rays(constant, &measured).map(Part::Table));
    Ok(best)
}

/// Divides times by those of the rows that do the same work with both values. Answers what it is with a renderer's caches; NaN: there is none.
fn same_process(rows: &mut [Measured], in_force: &[Measured]) -> f64 {
    let pairs: Vec<Pair> = rows.iter().zip(in_force).filter(|(own, other)| own.errors == other.errors).collect();
    let factors: [f64; CACHES.len()] =
        std::array::from_fn(|caches| Scope { caches, variance: false, ..ALL }.of(&pairs));
    if factors.iter().all(|factor| factor.is_finite()) {
        for caches in rows.iter_mut().flat_map(|row| &mut row.ns) {
            caches.iter_mut().zip(factors).for_each(|(ns, factor)| ns.iter_mut().for_each(|ns| *ns /= factor));
        }
    }
    factors[0]
}

/// Scores by the number of rays, if there is more than one.
fn by_rays(constant: &Constant, measured: &[Vec<Measured>]) -> Option<Table> {
    let mut rays: Vec<usize> = measured[0].iter().map(|row| row.rays).collect();
    rays.sort_unstable();
    rays.dedup();
    let columns: Vec<(usize, usize)> =
        rays.iter().flat_map(|&rays| [RENDERER, WARM].map(|caches| (rays, caches))).collect();
    let heads = columns.iter().map(|&(rays, caches)| format!("rays: {rays}, {}", CACHES[caches]));
    let mut table = Table::new(1, &std::iter::once("value".into()).chain(heads).collect::<Vec<String>>());
    for (value, rows) in constant.values.iter().zip(measured).skip(1) {
        let of = |&(rays, caches): &(usize, usize)| {
            let pairs =
                rows.iter().zip(&measured[0]).filter(|(own, other)| own.rays == rays && own.errors != other.errors);
            figure(Scope { caches, ..ALL }.of(&pairs.collect::<Vec<_>>()))
        };
        table.row(std::iter::once(value.to_string()).chain(columns.iter().map(of)));
    }
    (rays.len() > 1).then_some(table)
}

/// A ratio, or a dash if there was nothing to compare.
fn figure(ratio: f64) -> String {
    if ratio.is_finite() { format!("{ratio:.3}") } else { "-".into() }
}

fn range(interval: [f64; 2]) -> String {
    if interval[0].is_finite() { interval.map(figure).join(" to ") } else { "-".into() }
}

/// The interval of 95 % of a score.
fn interval(pairs: &[Pair]) -> [f64; 2] {
    let mut state = 37;
    let mut pick = |_: usize, count: usize| (splitmix(&mut state) % count as u64) as usize;
    let mut resample = || {
        let means: Vec<[Means; 2]> =
            pairs.iter().map(|(own, other)| [own.means(&mut pick), other.means(&mut pick)]).collect();
        ALL.score(means.iter().map(|[own, other]| (own, other)))
    };
    let scores: Vec<f64> = (0..RESAMPLES).map(|_| resample()).collect();
    [0.025, 0.975].map(|tau| quantile(&scores, tau))
}
