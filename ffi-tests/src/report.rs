//! The report as a Markdown page: what was measured, and where the library wins and loses.

use crate::cost::MODELS;
use crate::library::Mode;
use crate::measure::{BATCHES, Cell, Errors, FEW, REGIONS, Row};
use crate::method::{EXTENDED, LISTS, Method, Peers};
use crate::peers::{Candidates, Peer};
use crate::reference::BOUND;
use crate::statistics::bootstrap_ratio;
use std::fmt::{Result, Write};

/// What the page says about the run itself.
pub struct Run {
    pub machine: String,
    pub commit: String,
    pub command: String,
    pub points: usize,
    pub repeats: u32,
    pub lights: Vec<BuiltLight>,
    /// File names and captions.
    pub pictures: Vec<(String, String)>,
}

/// A light and what its environment cost.
pub struct BuiltLight {
    pub name: String,
    pub texels: usize,
    pub milliseconds: f64,
    pub bytes: usize,
}

/// A mean squared error of a region.
type Metric = fn(&Errors) -> f64;

const METRICS: [(&str, Metric); 2] = [("absolute", |e| e.absolute), ("relative", |e| e.relative)];

/// How gains are counted.
#[derive(Clone, Copy)]
struct Scale {
    region: usize,
    error: Metric,
    /// Of `MODELS`.
    model: usize,
    /// Of `CACHES`.
    caches: usize,
}

impl Scale {
    /// Metrics and cost models with their names, over a region, with cold caches.
    fn of(region: usize) -> impl Iterator<Item = (String, Scale)> {
        let models = MODELS.iter().enumerate();
        let all = models.flat_map(|(model, (cost, _))| METRICS.map(|(metric, error)| (metric, cost, error, model)));
        all.map(move |(metric, cost, error, model)| {
            (format!("{metric}, {cost}"), Scale { region, error, model, caches: 0 })
        })
    }

    /// These, and the same with warm caches.
    fn with_warm(region: usize) -> impl Iterator<Item = (String, Scale)> {
        let warm = Scale::of(region).map(|(name, scale)| (format!("{name}, warm"), Scale { caches: 1, ..scale }));
        Scale::of(region).chain(warm)
    }
}

/// Writes the page. `plot` names the picture of a cell.
///
/// # Errors
/// Those of the writer.
pub fn write(out: &mut impl Write, run: &Run, cells: &[Cell], plot: impl Fn(&Cell) -> String) -> Result {
    title(out, cells)?;
    preamble(out, run)?;
    for view in views(cells) {
        let cells: Vec<&Cell> = cells.iter().filter(|cell| cell.scene == view).collect();
        summary(out, &view, &cells)?;
        modes(out, &cells)?;
        limits(out, &cells)?;
    }
    losses(out, cells)?;
    peer_costs(out, cells)?;
    pictures(out, run)?;
    for cell in cells {
        section(out, cell, &plot(cell))?;
    }
    Ok(())
}

/// Writes a page without the sections of cells, for people who read one page: notes by hand, and a line for each cell.
///
/// # Errors
/// Those of the writer.
pub fn digest(out: &mut impl Write, run: &Run, cells: &[Cell], notes: &str) -> Result {
    title(out, cells)?;
    preamble(out, run)?;
    writeln!(out, "{}\n", notes.trim())?;
    for view in views(cells) {
        let cells: Vec<&Cell> = cells.iter().filter(|cell| cell.scene == view).collect();
        summary(out, &view, &cells)?;
        modes(out, &cells)?;
        limits(out, &cells)?;
        regions(out, &cells)?;
        lines(out, &cells)?;
    }
    peer_costs(out, cells)?;
    pictures(out, run)
}

/// A line for each cell.
fn lines(out: &mut impl Write, cells: &[&Cell]) -> Result {
    const METHODS: [&str; 6] = ["MIS balance", "MIS compensated", "P(4)", "direct", "wis", "wis tree pool"];
    let Some(first) = cells.first() else { return Ok(()) };
    let count = counts(first).into_iter().rev().nth(1).or(counts(first).last().copied()).unwrap_or(1);
    let methods: Vec<&str> = METHODS.into_iter().filter(|name| row(first, name, count).is_some()).collect();
    writeln!(
        out,
        "Each cell at N = {count}: absolute error of some methods, gain over the best peer of the {} list [95 %] in both",
        EXTENDED.name
    )?;
    writeln!(
        out,
        "metrics and cost models; with warm caches: preparation, a sample in batches of 64, a pdf; bytes of a"
    )?;
    writeln!(out, "product, and the largest f L / (p I).\n")?;
    let scales: Vec<(String, Scale)> = Scale::of(0).collect();
    let heads: Vec<&str> = scales.iter().map(|(name, _)| name.as_str()).collect();
    writeln!(
        out,
        "| light | material | {} | limit | best peer | {} | prepare ns | sample ns | pdf ns | bytes | weight |",
        methods.join(" | "),
        heads.join(" | ")
    )?;
    let columns = heads.len() + 5;
    writeln!(out, "|---|---|{}---:|---|{}", "---:|".repeat(methods.len()), "---:|".repeat(columns))?;
    for cell in cells {
        write!(out, "| {} | {} ", cell.light, cell.material)?;
        for method in &methods {
            write!(out, "| {:.3} ", variance(cell, method, count).unwrap_or(f64::NAN).sqrt())?;
        }
        match limit(cell, count) {
            Some(limit) => write!(out, "| {:.3} ", limit.sqrt())?,
            None => write!(out, "| - ")?,
        }
        let best: Vec<_> = scales.iter().map(|(_, scale)| best_peer(cell, &EXTENDED, count, *scale)).collect();
        write!(out, "| {} ", best[0].as_ref().map_or("-", |b| b.0.as_str()))?;
        for best in best {
            match best {
                Some((_, [ratio, low, high])) => write!(out, "| {ratio:.2} [{low:.2}, {high:.2}] ")?,
                None => write!(out, "| - ")?,
            }
        }
        let costs = &cell.costs;
        let [prepare, sample, pdf] = [costs.prepare, costs.sample[3], costs.pdf];
        writeln!(out, "| {prepare:.0} | {sample:.0} | {pdf:.0} | {} | {:.0} |", costs.product_bytes, costs.max_weight)?;
    }
    writeln!(out)
}

/// The goals of the expensive cost model against the best peer of each cell: absolute and relative, for few samples and for 16
/// and more.
const GOALS: [[f64; 2]; 2] = [[3.5, 2.5], [2.5, 2.0]];

/// What is recommended against the best peers and against what version 0.1 recommended, and whether the goals are met.
fn title(out: &mut impl Write, cells: &[Cell]) -> Result {
    writeln!(out, "# Error against samples and time\n")?;
    let view = views(cells).into_iter().find(|view| cells.iter().any(|c| c.scene == *view && counts(c).len() > 1));
    let Some(view) = view else { return Ok(()) };
    let cells: Vec<&Cell> = cells.iter().filter(|cell| cell.scene == view && ours(cell) == "direct").collect();
    let Some(first) = cells.first() else { return Ok(()) };
    let counts = counts(first);
    let heads: Vec<String> = counts.iter().map(|n| format!("N = {n}")).collect();
    writeln!(
        out,
        "Gain of `wis_direct` at equal time in {view}, geometric mean over {} cells; above 1 it is ahead.\n",
        cells.len()
    )?;
    writeln!(out, "| against | metric, cost | {} | goal | verdict |", heads.join(" | "))?;
    writeln!(out, "|---|---|{}---|---|", "---:|".repeat(counts.len()))?;
    let goals = |metric: usize| counts.iter().map(move |&n| GOALS[usize::from(n >= 16)][metric]).collect::<Vec<_>>();
    let mut row = |against: &str, scale: &str, gains: Vec<f64>, goals: Option<Vec<f64>>| {
        write!(out, "| {against} | {scale} ")?;
        gains.iter().try_for_each(|gain| write!(out, "| {gain:.2} "))?;
        let Some(goals) = goals else { return writeln!(out, "| none | |") };
        let holds = gains.iter().zip(&goals).all(|(gain, goal)| gain >= goal);
        let mut distinct: Vec<String> = goals.iter().map(f64::to_string).collect();
        distinct.dedup();
        writeln!(out, "| {} | {} |", distinct.join(", then "), if holds { "met" } else { "**not met**" })
    };
    let list = &LISTS[0];
    for (number, (name, scale)) in Scale::with_warm(0).enumerate() {
        let of = |&count: &usize| {
            let best = cells.iter().filter_map(|cell| best_peer(cell, list, count, scale));
            geometric_mean(best.map(|(_, gain)| gain[0]))
        };
        let is_goal = scale.model == 1;
        if is_goal || scale.caches == 0 {
            let goals = is_goal.then(|| goals(number % METRICS.len()));
            row(&format!("best peer, {} list", list.name), &name, counts.iter().map(of).collect(), goals)?;
        }
    }
    for (name, scale) in Scale::of(0) {
        let of = |&count: &usize| {
            let gains = cells.iter().filter_map(|cell| gain(cell, "wis by rule", count, scale));
            geometric_mean(gains.map(|gain| gain[0]))
        };
        row("version 0.1 by its rule", &name, counts.iter().map(of).collect(), Some(vec![1.0; counts.len()]))?;
    }
    writeln!(out)
}

fn preamble(out: &mut impl Write, run: &Run) -> Result {
    writeln!(out, "- Machine: {}\n- Commit: {}\n- Command: `{}`", run.machine, run.commit, run.command)?;
    writeln!(out, "- {} shading points in a scene, {} independent repeats, one thread", run.points, run.repeats)?;
    writeln!(
        out,
        "
Absolute error: RMSE / mean of the image. Relative error: sqrt(mean(d^2 / (reference^2 + (0.01 mean)^2))). Unshadowed:
the absolute error where nothing casts a shadow. Regions by v = reference / unshadowed reference: lit > .95, penumbra
.05 to .95, umbra < .05. Errors are medians over repeats. Times are means over some pixels: sampling, evaluation and rays, for\nwis with the preparation. Before each timed pixel 32 MB of other memory are touched, so caches are cold as in a renderer; \"warm\" means that the pixel follows another.
Two cost models stand side by side. Cheap: the harness as it is. Expensive: the client spends 150 ns more for each direction
whose BRDF or radiance it evaluates, and 500 ns more for each ray. All materials are grey and the light
is looked up to the nearest texel. All methods have the same points, BRDF, look-up and rays, and the renderer's side of
each computes eight samples side by side with the widest instructions of the machine; the library is the one that
ships. Peers draw from the light's own texels by inverse cumulative distributions with guide tables. **Gain** is
(variance x time of a peer) / (variance x time of wis) at the same number of samples: above 1 wis is ahead. There are two
lists of peers: that of version 0.1, and the extended one with resampling from compensated candidates (\"comp.\"). The best
peer of a list is chosen on the even repeats and scored, as wis, on the odd ones; intervals are bootstrap 95 % over these repeats.
\"direct\" is what the library recommends: `wis_direct`, whose rays are all that the client evaluates. Names that begin with \"wis\"
are modes of the wavelet product, compared like peers. A method that never finds a small light looks better than it is: its rare hits
are outside the repeats. In a scene named \"64 hits\" each pixel is 64 hits of a path tracer with one light sample
each.
The limit is the product of light and BRDF x cosine on all 512 x 512 cells (those in which the light varies in 16 x 16
parts), sampled directly or through a pool of four
candidates a pick, whichever is better: what is left of its variance comes from visibility.
"
    )?;
    writeln!(out, "| light | texels | build ms | environment MiB |\n|---|---:|---:|---:|")?;
    for light in &run.lights {
        let mib = light.bytes as f64 / f64::from(1 << 20);
        writeln!(out, "| {} | {} | {:.0} | {mib:.1} |", light.name, light.texels, light.milliseconds)?;
    }
    writeln!(out)
}

fn views(cells: &[Cell]) -> Vec<String> {
    let mut names: Vec<String> = cells.iter().map(|cell| cell.scene.clone()).collect();
    names.sort();
    names.dedup();
    names
}

/// Geometric means of the gain over all cells.
fn summary(out: &mut impl Write, view: &str, cells: &[&Cell]) -> Result {
    let Some(first) = cells.first() else { return Ok(()) };
    writeln!(out, "## {view}: gain of {}, geometric mean over {} cells\n", ours(first), cells.len())?;
    let others = ["wis by rule", "wis", "wis + MIS", "wis reuse"].into_iter().filter(|name| *name != ours(first));
    let others = others.filter(|name| first.rows.iter().any(|row| row.method == *name));
    let methods: Vec<String> = peers(first).into_iter().chain(others.map(String::from)).collect();
    let best: Vec<String> = LISTS.iter().map(|list| format!("best of {}", list.name)).collect();
    writeln!(out, "| metric, cost | N | {} | {} |", methods.join(" | "), best.join(" | "))?;
    writeln!(out, "|---|---:|{}", "---:|".repeat(methods.len() + best.len()))?;
    for ((name, scale), count) in
        Scale::with_warm(0).flat_map(|s| counts(first).into_iter().map(move |n| (s.clone(), n)))
    {
        write!(out, "| {name} | {count} ")?;
        for method in &methods {
            let gains = cells.iter().filter_map(|cell| gain(cell, method, count, scale));
            write!(out, "| {:.2} ", geometric_mean(gains.map(|g| g[0])))?;
        }
        for list in &LISTS {
            let best = cells.iter().filter_map(|cell| best_peer(cell, list, count, scale));
            write!(out, "| {:.2} ", geometric_mean(best.map(|(_, g)| g[0])))?;
        }
        writeln!(out, "|")?;
    }
    writeln!(out)
}

/// The error of the library's modes, and how far it is from the integral that the biased ones take for the truth.
fn modes(out: &mut impl Write, cells: &[&Cell]) -> Result {
    let modes = Mode::ALL.map(|mode| mode.name().to_string()).into_iter();
    let modes: Vec<String> =
        modes.filter(|mode| cells.iter().any(|c| c.rows.iter().any(|r| r.method == *mode))).collect();
    writeln!(out, "Absolute error of the library's modes, geometric mean over cells:\n")?;
    writeln!(out, "| N | {} |\n|---:|{}", modes.join(" | "), "---:|".repeat(modes.len()))?;
    let Some(first) = cells.first() else { return Ok(()) };
    for count in counts(first) {
        write!(out, "| {count} ")?;
        for mode in &modes {
            let errors: Vec<f64> = cells.iter().filter_map(|cell| Some(variance(cell, mode, count)?.sqrt())).collect();
            if errors.is_empty() {
                write!(out, "| - ")?;
            } else {
                write!(out, "| {:.3} ", geometric_mean(errors.into_iter()))?;
            }
        }
        writeln!(out, "|")?;
    }
    writeln!(out)
}

/// Variance of wis over that of the limit, for each material.
fn limits(out: &mut impl Write, cells: &[&Cell]) -> Result {
    let Some(first) = cells.first() else { return Ok(()) };
    let counts = counts(first);
    if cells.iter().all(|cell| counts.iter().all(|&count| limit(cell, count).is_none())) {
        return Ok(());
    }
    writeln!(out, "Distance to the limit: variance over that of the limit at equal N, geometric mean over lights.\n")?;
    let methods = [ours(first), "MIS compensated", "P(4)"];
    let heads: Vec<String> =
        methods.iter().flat_map(|method| counts.iter().map(move |n| format!("{method} N={n}"))).collect();
    writeln!(out, "| material | {} |\n|---|{}", heads.join(" | "), "---:|".repeat(heads.len()))?;
    // Measured materials have no limit.
    let has_limit = |material: &str| cells.iter().any(|c| c.material == material && limit(c, counts[0]).is_some());
    for material in materials(cells).into_iter().filter(|material| has_limit(material)) {
        write!(out, "| {material} ")?;
        for (method, count) in methods.iter().flat_map(|m| counts.iter().map(move |&n| (m, n))) {
            let of_material = cells.iter().filter(|cell| cell.material == material);
            let ratios = of_material.filter_map(|cell| Some(variance(cell, method, count)? / limit(cell, count)?));
            write!(out, "| {:.2} ", geometric_mean(ratios))?;
        }
        writeln!(out, "|")?;
    }
    writeln!(out)
}

/// The gain over the best peer in light, penumbra and umbra, for each material.
fn regions(out: &mut impl Write, cells: &[&Cell]) -> Result {
    let is_large = |cell: &Cell, region: usize| cell.pixels[region] >= FEW;
    let Some(first) = cells.iter().find(|cell| (1..REGIONS.len()).any(|region| is_large(cell, region))) else {
        return Ok(());
    };
    let columns: Vec<(usize, usize)> =
        (1..REGIONS.len()).flat_map(|region| counts(first).into_iter().map(move |count| (region, count))).collect();
    writeln!(
        out,
        "Gain over the best peer of each cell ({} list) in light, penumbra and umbra: geometric mean over the lights",
        EXTENDED.name
    )?;
    writeln!(out, "under which a region has at least {FEW} pixels.\n")?;
    let heads: Vec<String> = columns.iter().map(|&(region, count)| format!("{} N={count}", REGIONS[region])).collect();
    writeln!(out, "| material | metric, cost | {} |\n|---|---|{}", heads.join(" | "), "---:|".repeat(heads.len()))?;
    for (material, (name, scale)) in materials(cells).into_iter().flat_map(|m| Scale::of(0).map(move |s| (m, s))) {
        write!(out, "| {material} | {name} ")?;
        for &(region, count) in &columns {
            let large = cells.iter().filter(|cell| cell.material == material && is_large(cell, region));
            let scale = Scale { region, ..scale };
            let best = large.filter_map(|cell| best_peer(cell, &EXTENDED, count, scale));
            let best: Vec<f64> = best.map(|(_, gain)| gain[0]).collect();
            if best.is_empty() {
                write!(out, "| - ")?;
            } else {
                write!(out, "| {:.2} ", geometric_mean(best.into_iter()))?;
            }
        }
        writeln!(out, "|")?;
    }
    writeln!(out)
}

fn materials<'a>(cells: &[&'a Cell]) -> Vec<&'a str> {
    let mut materials: Vec<&str> = cells.iter().map(|cell| cell.material.as_str()).collect();
    materials.sort_unstable();
    materials.dedup();
    materials
}

fn variance(cell: &Cell, method: &str, count: usize) -> Option<f64> {
    Some(row(cell, method, count)?.median(|repeat| repeat.errors[0].absolute))
}

/// The better of both limits.
fn limit(cell: &Cell, count: usize) -> Option<f64> {
    let limits = Method::all().filter(|m| m.is_limit());
    limits.filter_map(|m| variance(cell, &m.name(), count)).min_by(f64::total_cmp)
}

fn pictures(out: &mut impl Write, run: &Run) -> Result {
    for (file, caption) in &run.pictures {
        writeln!(out, "![{caption}]({file})\n\n{caption}\n")?;
    }
    Ok(())
}

/// The cells in which the best peer is ahead beyond doubt.
fn losses(out: &mut impl Write, cells: &[Cell]) -> Result {
    writeln!(out, "## Where wis loses to the best peer of the {} list\n", EXTENDED.name)?;
    writeln!(
        out,
        "| scene | light | material | N | metric, cost | best peer | gain |\n|---|---|---|---:|---|---|---:|"
    )?;
    for cell in cells {
        for ((name, scale), count) in Scale::of(0).flat_map(|s| counts(cell).into_iter().map(move |n| (s.clone(), n))) {
            let best = best_peer(cell, &EXTENDED, count, scale);
            if let Some((peer, [ratio, low, high])) = best.filter(|b| b.1[2] < 1.0) {
                let Cell { scene, light, material, .. } = cell;
                let gain = format!("{ratio:.2} [{low:.2}, {high:.2}]");
                writeln!(out, "| {scene} | {light} | {material} | {count} | {name} | {peer} | {gain} |")?;
            }
        }
    }
    writeln!(out)
}

/// Peers' times beside those of the prototype, which had 8 lanes.
fn peer_costs(out: &mut impl Write, cells: &[Cell]) -> Result {
    writeln!(out, "## What peers cost\n")?;
    writeln!(
        out,
        "Nanoseconds without rays, cold, mean over cells, beside those of a prototype, warm, with 512 x 512 texels on another"
    )?;
    writeln!(out, "machine: a ratio above 1.5 is marked, and gains over that peer may then be flattering.\n")?;
    writeln!(out, "| peer | for | here | prototype | |\n|---|---|---:|---:|---|")?;
    let yardsticks: [(Peer, &str, f64, f64); 5] = [
        (Peer::MisBalance, "sample", 1.0, 16.0),
        (Peer::MisCompensated, "sample", 1.0, 16.0),
        (Peer::Ris(8, Candidates::Plain), "candidate", 8.0, 18.0),
        (Peer::Ris(32, Candidates::Plain), "candidate", 32.0, 18.0),
        (Peer::Pool(4, Candidates::Plain), "pick", 1.0, 110.0),
    ];
    for (peer, unit, per_sample, prototype) in yardsticks {
        // With one sample alone the lanes are mostly idle: the yardsticks are for many.
        let many = cells.iter().filter(|cell| counts(cell).len() > 1);
        let rows = many.filter_map(|cell| row(cell, &peer.name(), counts(cell).last().copied()?));
        let costs: Vec<f64> = rows.map(|r| r.times[0][0].sampling / r.count as f64 / per_sample).collect();
        if !costs.is_empty() {
            let ns = costs.iter().sum::<f64>() / costs.len() as f64;
            let mark = if ns > 1.5 * prototype { "above 1.5 x" } else { "" };
            writeln!(out, "| {} | {unit} | {ns:.0} | {prototype} | {mark} |", peer.name())?;
        }
    }
    writeln!(out)
}

fn section(out: &mut impl Write, cell: &Cell, plot: &str) -> Result {
    writeln!(out, "## {}, {}, {}\n\n![error]({plot})\n", cell.scene, cell.light, cell.material)?;
    let (samples, disagreement) = cell.reference;
    let verdict = if disagreement <= BOUND { "" } else { ", **above the bound: small errors are limited by it**" };
    writeln!(
        out,
        "Reference: two halves of 3 x {samples} samples, error of their mean {:.2} % (bound {} %){verdict}.",
        disagreement * 100.0,
        BOUND * 100.0
    )?;
    let costs = &cell.costs;
    let sample: Vec<_> = BATCHES.iter().zip(costs.sample).map(|(n, ns)| format!("{ns:.0} ({n})")).collect();
    writeln!(
        out,
        "wis: prepare {:.0} ns, ns per sample (in batches of) {}, pdf {:.0} ns, product {} bytes, max f L / (p I) {:.1}.\n",
        costs.prepare,
        sample.join(", "),
        costs.pdf,
        costs.product_bytes,
        costs.max_weight
    )?;
    errors(out, cell)?;
    gains(out, cell)
}

/// Errors of every method on the whole image.
fn errors(out: &mut impl Write, cell: &Cell) -> Result {
    writeln!(
        out,
        "| method | N | us, cheap | us, expensive | us, cheap, warm | us, expensive, warm | absolute | relative | unshadowed \
         | 99.9 % |\n|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|"
    )?;
    for row in &cell.rows {
        let root = |of: fn(&Errors) -> f64| row.median(|r| of(&r.errors[0])).sqrt();
        let (absolute, relative, unshadowed) = (root(|e| e.absolute), root(|e| e.relative), root(|e| e.unshadowed));
        let tail = row.median(|r| r.errors[0].tail);
        let Row { method, count, .. } = row;
        write!(out, "| {method} | {count} ")?;
        for time in row.times.iter().flatten() {
            let us = time.ns() / 1e3;
            if us > 0.0 { write!(out, "| {us:.2} ")? } else { write!(out, "| - ")? }
        }
        writeln!(out, "| {absolute:.4} | {relative:.4} | {unshadowed:.4} | {tail:.3} |")?;
    }
    writeln!(out)
}

/// Gains over every peer and the best, in each region.
fn gains(out: &mut impl Write, cell: &Cell) -> Result {
    let peers = peers(cell);
    let best: Vec<String> = LISTS.iter().map(|list| format!("best of {} | gain", list.name)).collect();
    let (heads, bests) = (peers.join(" | "), best.join(" | "));
    writeln!(out, "| region | pixels | metric, cost | N | {heads} | wis + MIS | {bests} |")?;
    writeln!(out, "|---|---:|---|---:|{}---:|{}", "---:|".repeat(peers.len()), "---|---:|".repeat(LISTS.len()))?;
    for (region, name) in REGIONS.iter().enumerate().filter(|&(region, _)| cell.pixels[region] > 0) {
        let few = if cell.pixels[region] < FEW { " (few)" } else { "" };
        for ((scale_name, scale), count) in
            Scale::of(region).flat_map(|s| counts(cell).into_iter().map(move |n| (s.clone(), n)))
        {
            write!(out, "| {name} | {}{few} | {scale_name} | {count} ", cell.pixels[region])?;
            for method in peers.iter().map(String::as_str).chain(["wis + MIS"]) {
                match gain(cell, method, count, scale) {
                    Some([ratio, ..]) => write!(out, "| {ratio:.2} ")?,
                    None => write!(out, "| ")?,
                }
            }
            for list in &LISTS {
                match best_peer(cell, list, count, scale) {
                    Some((peer, [ratio, low, high])) => write!(out, "| {peer} | {ratio:.2} [{low:.2}, {high:.2}] ")?,
                    None => write!(out, "| | ")?,
                }
            }
            writeln!(out, "|")?;
        }
    }
    writeln!(out)
}

/// The peers that were measured.
fn peers(cell: &Cell) -> Vec<String> {
    measured(cell, &EXTENDED)
}

/// Those of a list.
fn measured(cell: &Cell, list: &Peers) -> Vec<String> {
    let names = list.each.iter().map(|peer| peer.name());
    names.filter(|name| cell.rows.iter().any(|row| row.method == *name)).collect()
}

fn counts(cell: &Cell) -> Vec<usize> {
    cell.rows.iter().filter(|row| row.method == "wis").map(|row| row.count).collect()
}

/// The mode whose gains are told.
fn ours(cell: &Cell) -> &'static str {
    let measured = |name: &&str| cell.rows.iter().any(|row| row.method == *name);
    ["direct", "wis by rule"].into_iter().find(measured).unwrap_or("wis")
}

fn row<'a>(cell: &'a Cell, method: &str, count: usize) -> Option<&'a Row> {
    cell.rows.iter().find(|row| row.method == method && row.count == count)
}

/// Variance x time of the repeats of one parity, or of all.
fn costs(row: &Row, parity: Option<usize>, scale: Scale) -> Vec<f64> {
    let ns = row.times[scale.caches][scale.model].ns();
    let kept = row.repeats.iter().enumerate().filter(|(i, _)| parity.is_none_or(|p| i % 2 == p));
    kept.map(|(_, repeat)| (scale.error)(&repeat.errors[scale.region]) * ns).collect()
}

/// The ratio to a method with its interval; `None` if there is no error to compare.
fn gain(cell: &Cell, method: &str, count: usize, scale: Scale) -> Option<[f64; 3]> {
    let [theirs, ours] = [row(cell, method, count)?, row(cell, ours(cell), count)?];
    comparable(bootstrap_ratio(&costs(theirs, None, scale), &costs(ours, None, scale)))
}

/// The peer of a list with the smallest variance x time on the even repeats, and the ratio to it on the odd ones.
fn best_peer(cell: &Cell, list: &Peers, count: usize, scale: Scale) -> Option<(String, [f64; 3])> {
    let cost = |name: &str| Some(costs(row(cell, name, count)?, Some(0), scale).iter().sum::<f64>());
    let peers = measured(cell, list).into_iter();
    let best = peers.min_by(|a, b| cost(a).partial_cmp(&cost(b)).unwrap_or(std::cmp::Ordering::Equal))?;
    let [theirs, ours] = [row(cell, &best, count)?, row(cell, ours(cell), count)?];
    let ratio = bootstrap_ratio(&costs(theirs, Some(1), scale), &costs(ours, Some(1), scale));
    Some((best, comparable(ratio)?))
}

fn comparable(ratio: [f64; 3]) -> Option<[f64; 3]> {
    (ratio[0].is_finite() && ratio[0] > 0.0).then_some(ratio)
}

fn geometric_mean(values: impl Iterator<Item = f64>) -> f64 {
    let logarithms: Vec<f64> = values.map(f64::ln).collect();
    (logarithms.iter().sum::<f64>() / logarithms.len() as f64).exp()
}
