//! The page: what to call and what it gives, where the library loses, which goals are reached, and all numbers behind it.

use super::gains::{
    self, Against, METRICS, PROSE, Scale, lights, materials, metrics, of_study, ours, over_best, studies,
};
use super::goals::{self, Measured, Times};
use super::studies::{HITS, MAIN, MEASURED, NEAREST, ROOM, SMOOTH, SUN, TEXTURED, has_known_lobes};
use super::{losses, plots};
use anyhow::Result;
use std::fmt::Display;
use wis_ffi_tests::caches::{CACHES, COLD, RENDERER, SLOWER, WARM};
use wis_ffi_tests::cost::MODELS;
use wis_ffi_tests::data::DEVELOPER;
use wis_ffi_tests::earlier;
use wis_ffi_tests::measure::{Cell, Errors, REGIONS};
use wis_ffi_tests::method::EXTENDED;
use wis_ffi_tests::page::{Page, Part, Table, times};
use wis_ffi_tests::statistics::geometric;

/// What the page says about the run.
pub struct Run {
    pub machine: String,
    pub commit: String,
    pub command: String,
    pub made_from: String,
    pub points: usize,
    pub repeats: u32,
}

/// What a renderer does, what it calls, and the cells that tell what it gets.
struct Situation {
    renderer: &'static str,
    call: &'static str,
    study: &'static str,
    /// The only light; empty: all.
    light: &'static str,
    method: &'static str,
    count: usize,
}

impl Situation {
    const fn of(
        renderer: &'static str,
        call: &'static str,
        study: &'static str,
        method: &'static str,
        count: usize,
    ) -> Situation {
        Situation { renderer, call, study, light: "", method, count }
    }
}

const SITUATIONS: [Situation; 17] = [
    Situation::of("one shadow ray per hit", "`wis_direct`", MAIN, "direct", 1),
    Situation::of("4 rays per hit", "`wis_direct`", MAIN, "direct", 4),
    Situation::of("16 rays per hit", "`wis_direct`", MAIN, "direct", 16),
    Situation::of("64 rays per hit", "`wis_direct`", MAIN, "direct", 64),
    Situation::of("4 samples of a density per hit", "`wis_product_prepare`, `wis_sample`", MAIN, "product", 4),
    Situation::of("16 samples of a density per hit", "`wis_product_prepare`, `wis_sample`", MAIN, "product", 16),
    Situation::of("64 hits per pixel", "`wis_direct`, `hits_per_pixel`", HITS, "direct, shared", 1),
    Situation::of("the same, textured", "`wis_direct`, `hits_per_pixel`", TEXTURED, "direct, shared", 1),
    Situation::of(
        "needs densities for its own MIS, 16 samples and a BSDF ray",
        "`wis_product_prepare`, `wis_sample`, `wis_pdf`",
        MAIN,
        "product + MIS",
        16,
    ),
    Situation { light: SUN, ..Situation::of("an unclipped sun, 4 rays", "`wis_direct`", MAIN, "direct", 4) },
    Situation::of("looks up the nearest texel, 4 rays", "`WIS_FILTER_NEAREST`, `wis_direct`", NEAREST, "direct", 4),
    Situation::of("dense mesh, interpolated normals, 4 rays", "`wis_direct`", SMOOTH, "direct", 4),
    Situation::of("a room with one window, 4 rays", "`wis_direct`", ROOM, "direct", 4),
    Situation::of("the same, with a portal", "`wis_direct`, `portals`", ROOM, "direct, portals", 4),
    Situation::of(
        "the same, all light through it",
        "`WIS_POINT_PORTALS_COMPLETE`",
        ROOM,
        "direct, complete portals",
        4,
    ),
    Situation::of("measured BRDFs that no lobe describes, 4 rays", "`wis_direct`", MEASURED, "direct", 4),
    Situation::of("the same, handed over as a target", "`wis_direct`, `target`", MEASURED, "direct, target", 4),
];

/// What the first table compares with.
const RIVALS: [Against; 4] = [
    Against::Method("MIS balance"),
    Against::Method("MIS compensated"),
    Against::Best(&EXTENDED),
    Against::Method(earlier::NAME),
];

/// The whole page.
///
/// # Errors
/// Those of drawing and writing.
pub fn page(run: &Run, cells: &[Cell], suns: &[Cell], measured: &Measured) -> Result<Page> {
    let main: Vec<&Cell> = of_study(cells, MAIN);
    let lobes = materials(&main);
    let [verdict, gains @ ..] = first_screen(run, cells);
    let mut parts = vec![verdict];
    parts.extend(drawn(&main, &lobes)?);
    parts.extend(gains);
    parts.extend(losses::parts(cells));
    parts.extend(situations(cells));
    parts.extend(certain(cells));
    parts.extend(costs(cells, measured));
    parts.extend(sun(suns));
    parts.extend(weights_and_limit(&main));
    parts.extend(by_maps(&main, &lights(&main)));
    parts.extend(method(run, measured.slower));
    Ok(Page { title: "wis beside other ways to sample an environment".into(), parts, made_from: run.made_from.clone() })
}

/// The situations of the first screen: those that differ most, for better and for worse.
const FIRST_SCREEN: [&str; 5] = [
    "one shadow ray per hit",
    "16 rays per hit",
    "64 hits per pixel",
    "needs densities for its own MIS, 16 samples and a BSDF ray",
    "a room with one window, 4 rays",
];

/// What to call and what it gives, in ten rows.
fn first_screen(run: &Run, cells: &[Cell]) -> [Part; 4] {
    let table = of_situations(cells, &|situation| FIRST_SCREEN.contains(&situation.renderer), false);
    let ahead = |columns: std::ops::Range<usize>| {
        let gains = table.rows.iter().flat_map(|row| &row[columns.clone()]);
        let gains: Vec<f64> = gains.filter_map(|cell| cell.strip_suffix('x')?.parse().ok()).collect();
        format!("{} of {}", gains.iter().filter(|gain| **gain > 1.0).count(), gains.len())
    };
    let (mis, compensated, best) = (ahead(3..5), ahead(5..7), ahead(7..9));
    let filled: [(&str, &dyn Display); 4] = [
        ("over_mis", &mis),
        ("over_compensated", &compensated),
        ("baselines", &EXTENDED.each.len()),
        ("over_best", &best),
    ];
    let run: [(&str, &dyn Display); 3] =
        [("points", &run.points), ("repeats", &run.repeats), ("machine", &run.machine)];
    let heading = Part::Heading("How many times lower is the variance at equal time?".into());
    [PROSE.part("Verdict", &filled), heading, Part::Table(table), PROSE.part("First table", &run)]
}

/// Every situation, with other caches, too.
fn situations(cells: &[Cell]) -> Vec<Part> {
    let table = of_situations(cells, &|_| true, true);
    PROSE.section("And in every situation?", &[], table)
}

fn of_situations(cells: &[Cell], kept: &dyn Fn(&Situation) -> bool, others: bool) -> Table {
    let best = RIVALS[2];
    let heads = RIVALS.iter().flat_map(|rival| metrics(rival.name()));
    let caches: &[usize] = if others { &[WARM, COLD] } else { &[] };
    let beside = caches.iter().flat_map(|&c| metrics(best.name()).map(|head| format!("{head}, {}", CACHES[c])));
    let mut table = Table::new(["your renderer", "call", "costs"], heads.chain(beside));
    for situation in SITUATIONS.iter().filter(|situation| kept(situation)) {
        let measured = |cell: &&Cell| {
            cell.study == situation.study
                && (situation.light.is_empty() || cell.light == situation.light)
                && gains::row(cell, situation.method, situation.count).is_some()
        };
        let cells: Vec<&Cell> = cells.iter().filter(measured).collect();
        if cells.is_empty() {
            continue;
        }
        for (model, (costs, _)) in MODELS.iter().enumerate() {
            let gain = |rival: &Against, scale| {
                times(rival.mean(cells.iter().copied(), situation.method, situation.count, scale))
            };
            let numbers = RIVALS.iter().flat_map(|rival| Scale::of_model(model).map(|scale| gain(rival, scale)));
            let beside = caches.iter().flat_map(|&caches| Scale::of_model(model).map(|s| Scale { caches, ..s }));
            let numbers = numbers.chain(beside.map(|scale| gain(&best, scale)));
            table.row([situation.renderer, situation.call, costs], numbers);
        }
    }
    table
}

/// In how many cells the intervals exclude 1.
fn certain(cells: &[Cell]) -> Vec<Part> {
    let scales: Vec<Scale> = Scale::all().collect();
    let mut table = Table::new(["study"], ["cells".into()].into_iter().chain(scales.iter().map(|scale| scale.name())));
    for study in studies(cells) {
        let gains = |scale: Scale| -> Vec<[f64; 3]> {
            let of =
                of_study(cells, &study).into_iter().flat_map(|c| gains::counts(c).into_iter().map(move |n| (c, n)));
            of.filter_map(|(cell, n)| Some(over_best(cell, ours(&study), &EXTENDED, n, scale)?.1)).collect()
        };
        let count = |scale: &Scale| {
            let gains = gains(*scale);
            let [ahead, behind] =
                [gains.iter().filter(|g| g[1] > 1.0).count(), gains.iter().filter(|g| g[2] < 1.0).count()];
            format!("{ahead} / {} / {behind}", gains.len() - ahead - behind)
        };
        let number = gains(scales[0]).len().to_string();
        table.row([&study], [number].into_iter().chain(scales.iter().map(count)));
    }
    PROSE.section("In how many cells is wis ahead, undecided, behind?", &[], table)
}

pub fn verdict(is_reached: bool) -> &'static str {
    if is_reached { "reached" } else { "**missed**" }
}

/// Facts of products, and what calls take.
fn costs(cells: &[Cell], measured: &Measured) -> Vec<Part> {
    let known = cells.iter().filter(|cell| has_known_lobes(cell));
    let largest = known.map(|cell| cell.max_weight).fold(0.0, f64::max);
    let mut table = Table::new(["of products"], ["measured"]);
    let bound = format!("largest f L cos / (p I) of the product, every cell (at most {})", goals::LARGEST_WEIGHT);
    table.row([bound], [format!("{largest:.1}")]);
    table.row(["bytes that a product asks for"], [format!("{} B", measured.product_bytes)]);
    let heading = "What does a call cost?";
    let mut parts = vec![Part::Heading(heading.into()), Part::Table(table), PROSE.part(heading, &[])];
    parts.extend(call_times(measured));
    parts
}

fn call_times(measured: &Measured) -> Vec<Part> {
    let mut table = Table::new(["ns"], CACHES);
    let mut row = |name: String, times: Times| {
        let number = |x: f64| if x.is_nan() { "-".into() } else { format!("{x:.0}") };
        table.row([name], times.map(number));
    };
    for (material, times) in goals::PREPARE.iter().zip(&measured.prepare) {
        row(format!("prepare a product, {material}"), *times);
    }
    for (i, call) in crate::speed::CALLS.iter().enumerate() {
        row(format!("product of GGX 0.2: {call}"), [f64::NAN, measured.product.warm[i], measured.product.cold[i]]);
    }
    for (i, call) in ["first sample", "first pdf"].iter().enumerate() {
        row(format!("product of GGX 0.2: {call} alone"), [f64::NAN, f64::NAN, measured.product.first[i]]);
    }
    row("direct: one ray, 16 candidates".into(), measured.direct[0]);
    row("direct: a candidate of 64 rays x 4".into(), measured.direct[1]);
    let (ms, bytes) = measured.build;
    let text = format!(
        "Times of calls in ns, lower is better, under {}. The light was built in {ms:.1} ms \
         and takes {:.2} MB.",
        measured.light,
        bytes as f64 / 1e6
    );
    vec![Part::Text(text), Part::Table(table)]
}

/// What the product should reach against compensated MIS under suns that are not clipped: absolute, relative.
const LEAST_UNDER_SUNS: [f64; 2] = [1.0, 0.9];

/// The product under suns that are not clipped, and the limit in its time: where even that misses a goal, time alone is what is missing.
fn sun(suns: &[Cell]) -> Vec<Part> {
    let columns: Vec<(usize, Scale)> = [4, 16].into_iter().flat_map(|n| Scale::all().map(move |s| (n, s))).collect();
    let heads = columns.iter().map(|(n, scale)| format!("{n}, {}", scale.name()));
    let mut table = Table::new(["method", "light", "lobe", "verdict"], heads);
    let ways = [("product", "product"), ("product + MIS", "product + MIS"), ("limit", "product")];
    let mut reached = ways.map(|_| Vec::new());
    for ((method, timed), reached) in ways.into_iter().zip(&mut reached) {
        for cell in suns {
            let gain = |&(n, scale): &(usize, Scale)| {
                gains::in_time_of(cell, timed, method, "MIS compensated", n, scale).unwrap_or(f64::NAN)
            };
            let gains: Vec<f64> = columns.iter().map(gain).collect();
            let holds = |(gain, (_, scale)): (&f64, &(usize, Scale))| *gain >= LEAST_UNDER_SUNS[scale.metric];
            let is_reached = gains.iter().zip(&columns).all(holds);
            reached.push(is_reached);
            table.row([method, &cell.light, &cell.material, verdict(is_reached)], gains.into_iter().map(times));
        }
    }
    let count = |reached: &Vec<bool>| reached.iter().filter(|is_reached| **is_reached).count();
    let rows =
        ways.iter().zip(&reached).map(|((method, _), of)| format!("{method}: {} of {} rows", count(of), of.len()));
    let missed = || reached[0].iter().zip(&reached[2]).filter(|(product, _)| !**product);
    let text = format!(
        "**At equal time**, by the same goal in every column, it is reached by {}. Limit: samples of the exact product of light and \
         BRDF x cosine, if they took at most the time of those of `product`. Of the {} rows that the product misses, that limit misses \
         {}, too. {} independent repeats. The sun of the project's own has 2 x 2 texels, 10^5 times as bright as its sky.",
        rows.collect::<Vec<_>>().join("; "),
        missed().count(),
        missed().filter(|(_, limit)| !**limit).count(),
        suns.first().map_or(0, |cell| cell.rows[0].repeats.len()),
    );
    let [samples, of_samples] = sun_by_samples(suns);
    vec![
        Part::Heading("What does a product gain under an unclipped sun?".into()),
        samples,
        of_samples,
        Part::Text(text),
        Part::Table(table),
    ]
}

/// The variance of compensated MIS over that of the product with as many samples.
fn sun_by_samples(suns: &[Cell]) -> [Part; 2] {
    let columns = [4, 16].into_iter().flat_map(|n| [0, 1].map(|metric| (n, Scale { metric, ..Scale::default() })));
    let columns: Vec<(usize, Scale)> = columns.collect();
    let heads = columns.iter().map(|(n, scale)| format!("{n} samples, {}", METRICS[scale.metric].0));
    let mut table = Table::new(["light", "lobe", "verdict"], heads);
    let mut reached = 0;
    for cell in suns {
        let ratio = |&(n, scale): &(usize, Scale)| {
            gains::in_time_of(cell, "MIS compensated", "product", "MIS compensated", n, scale).unwrap_or(f64::NAN)
        };
        let ratios: Vec<f64> = columns.iter().map(ratio).collect();
        let is_reached =
            ratios.iter().zip(&columns).all(|(ratio, (_, scale))| *ratio >= LEAST_UNDER_SUNS[scale.metric]);
        reached += usize::from(is_reached);
        table.row([&cell.light, &cell.material, verdict(is_reached)], ratios.into_iter().map(times));
    }
    let text = format!(
        "**With as many samples the product is ahead of compensated MIS in {reached} of {} rows.** Variance of compensated MIS over that of \
         the product, with 4 and 16 samples each and a bilinear client. Goal: at least {} in the absolute metric and {} in the relative one.",
        suns.len(),
        LEAST_UNDER_SUNS[0],
        LEAST_UNDER_SUNS[1]
    );
    [Part::Text(text), Part::Table(table)]
}

fn weights_and_limit(main: &[&Cell]) -> Vec<Part> {
    let methods = ["direct", "product", "MIS compensated"];
    let heads = methods.iter().map(|method| format!("{method} / limit"));
    let mut table = Table::new(["lobe"], ["largest weight".into()].into_iter().chain(heads));
    for material in materials(main) {
        let of = || main.iter().filter(|cell| cell.material == material);
        let largest = of().map(|cell| cell.max_weight).fold(0.0, f64::max);
        let ratio = |method: &&str| {
            let ratios = of().filter_map(|cell| Some(gains::variance(cell, method, 16, 0)? / gains::limit(cell, 16)?));
            format!("{:.2}", geometric(ratios))
        };
        table.row([&material], [format!("{largest:.1}")].into_iter().chain(methods.iter().map(ratio)));
    }
    PROSE.section("How large do weights get, and how far is the limit?", &[], table)
}

/// Rays for a hit that both groups of maps are compared at.
const RAYS: [usize; 2] = [4, 16];

/// Gains on the maps that the library was tuned on, and on others (rule 37).
fn by_maps(main: &[&Cell], lights: &[String]) -> Vec<Part> {
    let is_developer = |light: &str| DEVELOPER.iter().any(|map| map.trim_end_matches(".hdr") == light);
    let list = |kept: &dyn Fn(&str) -> bool| {
        let names: Vec<&str> = lights.iter().map(String::as_str).filter(|light| kept(light)).collect();
        if names.is_empty() { "none".into() } else { names.join(", ") }
    };
    let (developer, judged) = (list(&is_developer), list(&|light| !is_developer(light) && light != SUN));
    let filled: [(&str, &dyn Display); 3] = [("developer", &developer), ("judged", &judged), ("SUN", &SUN)];
    let rivals = [Against::Method("MIS balance"), Against::Best(&EXTENDED)];
    let mut table = Table::new(["maps", "rays"], rivals.iter().flat_map(|rival| metrics(rival.name())));
    for (name, developer) in [("development", true), ("judged", false)] {
        let kept = |cell: &&&Cell| is_developer(&cell.light) == developer && cell.light != SUN;
        let of: Vec<&Cell> = main.iter().filter(kept).copied().collect();
        for rays in RAYS {
            let gain = |rival: &Against, scale| times(rival.mean(of.iter().copied(), "direct", rays, scale));
            let gains = rivals.iter().flat_map(|rival| Scale::of_model(1).map(|scale| gain(rival, scale)));
            table.row([name, &rays.to_string()], gains);
        }
    }
    PROSE.section("Are judged maps worse than those it was tuned on?", &filled, table)
}

fn drawn(main: &[&Cell], lobes: &[String]) -> Result<Vec<Part>> {
    let mut parts = vec![Part::Heading("Plots".into())];
    let chosen: Vec<String> = lights(main)
        .into_iter()
        .filter(|l| ["adams_place_bridge_1k", "forest_slope_1k", SUN].contains(&l.as_str()))
        .collect();
    let chosen = if chosen.len() < 2 { lights(main) } else { chosen };
    let names: Vec<&str> = chosen.iter().map(String::as_str).take(3).collect();
    let shown: Vec<&str> =
        lobes.iter().map(String::as_str).filter(|m| ["Lambert", "GGX 0.2", "mix 0.1"].contains(m)).collect();
    for scale in Scale::of_model(1) {
        let metric = METRICS[scale.metric].0;
        let svg = plots::error_against_time(main, scale, &names, &shown)?;
        let caption = format!(
            "Root mean squared {metric} error against time per hit, expensive costs, a renderer's caches, 1 to 64 rays. Lower left is better. \
             Green and violet: the other baselines that are best most often here. Black: no baseline of the {} lies to the lower left.",
            EXTENDED.each.len()
        );
        parts.push(Part::Plot(format!("error-{metric}.svg"), svg, caption));
    }
    let against = [Against::Method("MIS compensated"), Against::Best(&EXTENDED)];
    for (method, call) in [("direct", "`wis_direct`"), ("product", "the product alone (`wis_sample`)")] {
        let caption = format!(
            "Gain of {call} by lobe and number of rays, mean over lights, a renderer's caches: blue above 1 is ahead, red below 1 is behind."
        );
        parts.push(Part::Plot(format!("gains-{method}.svg"), plots::heat(main, method, &against, lobes)?, caption));
    }
    let caption = "Variance over that of the limit, absolute metric, mean over lights. Lower is better; below 1 a method finds the light better than cells do.";
    parts.push(Part::Plot("limit.svg".into(), plots::distance(main, lobes)?, caption.into()));
    Ok(parts)
}

fn method(run: &Run, slower: Times) -> Vec<Part> {
    let peers = EXTENDED.each.iter().map(|peer| peer.name()).collect::<Vec<_>>().join("; ");
    let items = [
        format!("Machine: {}, one thread. Commit {}. `report {}`.", run.machine, run.commit, run.command),
        format!("{} shading points in a scene, {} independent repeats, means over repeats.", run.points, run.repeats),
        "Absolute error: RMSE / mean of the image. Relative error: sqrt(mean(d^2 / (reference^2 + (0.01 mean)^2))). Tables of gains compare squared errors.".into(),
        "Equal time: variance x time of a baseline over variance x time of wis, at the same number of rays.".into(),
        "Times include drawing, preparing, evaluating and tracing. The costs of the expensive model are really spent.".into(),
        "Caches of a renderer: before each hit a ray goes through a million triangles, tile after tile, and 256 kB of 16 MB of other memory are read. Warm: a pixel after another. Cold: 32 MB are touched before a pixel.".into(),
        format!("A call of 0.2 for one ray takes {:.2} times its warm time with a renderer's caches, and {:.1} times with cold ones. In pbrt-v3 it takes 1.20 to 1.26 times its warm time; {} to {} are right here.", slower[RENDERER], slower[COLD], SLOWER[0], SLOWER[1]),
        "The client looks the map up bilinearly, but in the study of the nearest look-up. Baselines then draw from a table of twice the resolution, filled with interpolated values.".into(),
        "All methods have the same points, BRDF, look-up and rays. The client's side and the baselines compute eight lanes with the instructions of this machine. The library is the one that ships.".into(),
        format!("The {} baselines: {peers}. What their names mean stands under [Where does wis lose, and why?](#where-does-wis-lose-and-why).", EXTENDED.each.len()),
        "The best baseline of a cell is chosen with hindsight, which counts against wis.".into(),
        "Measured BRDFs: a diffuse lobe and up to two of GGX are fitted to each when its file is read. Baselines draw from the measurement itself.".into(),
    ];
    vec![Part::Heading("How it was measured".into()), Part::List(items.into())]
}

/// Every error and time as a table for programs, with tabs: a line for a method, a number of rays and a region of a cell.
pub fn cells(cells: &[&Cell]) -> String {
    let us = CACHES.iter().flat_map(|caches| MODELS.map(|(model, _)| format!("\tus, {model}, {caches}")));
    let mut text =
        "study\tscene\tlight\tlobe\tmethod\trays\tregion\tpixels\tabsolute\trelative\tunshadowed\ttail".to_string();
    text.extend(us.chain(["\n".into()]));
    for cell in cells {
        let Cell { study, scene, light, material, pixels, .. } = cell;
        for row in &cell.rows {
            let us: String = row
                .times
                .iter()
                .flatten()
                .map(|time| format!("\t{:.3}", time.ns() / 1e3))
                .chain(["\n".into()])
                .collect();
            for (region, name) in REGIONS.iter().enumerate() {
                let [absolute, relative, unshadowed, tail]: [fn(&Errors) -> f64; 4] =
                    [|e| e.absolute, |e| e.relative, |e| e.unshadowed, |e| e.tail];
                let errors =
                    [absolute, relative, unshadowed, tail].map(|of| row.mean(|repeat| of(&repeat.errors[region])));
                let errors = errors.map(|error| format!("{error:.3e}")).join("\t");
                let (method, rays, pixels) = (&row.method, row.count, pixels[region]);
                text +=
                    &format!("{study}\t{scene}\t{light}\t{material}\t{method}\t{rays}\t{name}\t{pixels}\t{errors}{us}");
            }
        }
    }
    text
}
