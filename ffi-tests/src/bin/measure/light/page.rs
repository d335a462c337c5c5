//! The page: conclusions first, long tables last. Every verdict follows from the numbers of the run that writes it.

use super::{fit, size};
use crate::speed::{CALLS, Speed};
use anyhow::Result;
use wis_ffi_tests::page::{NONE, Page, Part, Table, section};

/// The goals: the relative standard deviation of L / pdf and its maximum.
const DEVIATION: f64 = 0.01;
const MAXIMUM: f64 = 1.05;
/// Warm times in nanoseconds, in the order of `CALLS`.
const WARM: [f64; 4] = [40.0, 15.0, 110.0, 60.0];
/// Of a map of 1024 x 512: bytes, and milliseconds of the build.
const BYTES: f64 = 2.4e6;
const BUILD: f64 = 10.0;
/// Bytes of a smooth sky with a budget of 1 %.
const SKY: f64 = 16e3;
/// The densities side by side.
const SOURCES: [&str; 2] = ["wis", "pbrt-like"];

/// All that stands on the page.
pub struct Results {
    pub quick: bool,
    pub fits: Vec<Fits>,
    /// For a bilinear client and for a nearest one.
    pub speeds: [Vec<Speed>; 2],
    pub timed: String,
    pub sizes: Vec<size::Size>,
    pub budgets: Vec<size::Budget>,
}

/// A map's fits by wis and pbrt's table.
pub struct Fits {
    pub light: String,
    pub bilinear: bool,
    pub each: Vec<fit::Fit>,
}

pub fn page(results: &Results) -> Result<Page> {
    let mut short = vec![Part::Text(
        "Written by `make light`. Every number and verdict is of the run that wrote this page.".into(),
    )];
    short.push(Part::Table(conclusions(results)));
    short.push(Part::Text(METHOD.into()));
    if results.quick {
        short.push(Part::Text("This is a quick run: its numbers only show that the instrument works.".into()));
    }
    let sections = [speeds(results), sizes(results), budgets(results), fits(results)];
    short.extend(sections.into_iter().flatten());
    Page::measured("The light, measured", short, "light")
}

const METHOD: &str = "Two densities stand side by side. **wis** is `wis_environment` with `wis_sample` and `wis_pdf`. **pbrt-like** is the
piecewise constant 2D distribution of pbrt-v3, in scalar floats with binary searches. For a bilinear client it has twice the texels along
each axis, filled with interpolated values.

A *bilinear* client interpolates between texel centres. A *nearest* client takes the texel that holds the direction. Each
density is built for its client. *Cold*: 32 MB of other memory are touched before each 64 samples or pdfs, whether they come in
one call or one by one. *Warm*: the same 1024 inputs again and again.

Suns of one and four texels are 10^5 times as bright as their sky. Their maps have 512 x 256 texels.";

/// The goals with what was measured.
fn conclusions(results: &Results) -> Table {
    let mut table = Table::new(["goal", "measured", "verdict"], NONE);
    let mut row = |goal: String, measured: String, holds: bool| {
        table.row([&*goal, &measured, if holds { "holds" } else { "**does not hold**" }], NONE);
    };
    for (bilinear, client) in [(true, "bilinear"), (false, "nearest")] {
        let of = || results.fits.iter().filter(|fits| fits.bilinear == bilinear);
        let worst = |value: fn(&Fits) -> f64| {
            of().map(|fits| (value(fits), &fits.light)).max_by(|a, b| a.0.total_cmp(&b.0)).expect("a map")
        };
        let (deviation, most) = (worst(|f| f.each[0].deviation()), worst(|f| f.each[0].maximum));
        row(
            format!(
                "L / pdf, {client} client, all maps: standard deviation at most {DEVIATION}, maximum at most {MAXIMUM}"
            ),
            format!("{:.4} ({}), {:.3} ({})", deviation.0, deviation.1, most.0, most.1),
            deviation.0 <= DEVIATION && most.0 <= MAXIMUM,
        );
    }
    let warm = results.speeds[0][0].warm;
    for (name, pair) in [("sample", [0, 2]), ("pdf", [1, 3])] {
        row(
            format!("warm {name}: at most {} ns in 64, {} ns alone", WARM[pair[0]], WARM[pair[1]]),
            format!("{:.0} ns in 64, {:.0} ns alone", warm[pair[0]], warm[pair[1]]),
            pair.iter().all(|&call| warm[call] <= WARM[call]),
        );
    }
    if let Some(size) = results.sizes.iter().find(|size| size.width == 1024) {
        let (bytes, build) = (size.bytes as f64, size.build[0]);
        row(
            format!("1024 x 512 at full detail: at most {:.1} MB, built in at most {BUILD} ms", BYTES / 1e6),
            format!("{:.2} MB, {build:.1} ms", bytes / 1e6),
            bytes <= BYTES && build <= BUILD,
        );
    }
    if let Some(budget) = results.budgets.iter().find(|b| b.light == "sky" && b.budget == 0.01) {
        row(
            format!("a smooth sky with a budget of 1 %, light alone: at most {:.0} kB", SKY / 1e3),
            format!("{:.1} kB, standard deviation {:.4}", budget.bytes as f64 / 1e3, budget.deviation),
            budget.bytes as f64 <= SKY && budget.deviation <= 0.01,
        );
    }
    table
}

fn speeds(results: &Results) -> Vec<Part> {
    let text = format!(
        "Nanoseconds on {}: cold medians, and the fastest of the warm rounds. The machine has other tenants: compare within a column.
\"First\" is a single call right after 32 MB of other memory were touched: code and page tables are cold, too.

In a map of 1024 x 512 a sample of wis reads 8 cache lines for a bilinear client, and a pdf 7:

- sample: the table of all cells (1), its cell (1), the cell's starts (2), the block (1), the row starts (1), texels (2);
- pdf: the maps from blocks to cells (2), the cell (1), the block (1), the row starts (1), texels (2).

Block, row starts and texels are in one page. The maps have 97 bytes in all. A nearest client reads one line of texels less.",
        results.timed
    );
    let calls = CALLS.iter().flat_map(|call| [format!("{call}, cold"), "warm".into()]);
    let mut table = Table::new(["client", "light"], calls.chain(["first sample".into(), "first pdf".into()]));
    for (client, speeds) in ["bilinear", "nearest"].iter().zip(&results.speeds) {
        for (source, speed) in SOURCES.iter().zip(speeds) {
            let times = speed.cold.iter().zip(&speed.warm).flat_map(|(cold, warm)| [*cold, *warm]).chain(speed.first);
            table.row([client, source], times.map(|ns| format!("{ns:.0}")));
        }
    }
    section("Time of a sample and of a pdf", text, table)
}

fn sizes(results: &Results) -> Vec<Part> {
    let text = "A bilinear client, noise in every texel, rows by callback. Builds are on one core, in milliseconds of processor time. Scratch
memory is needed during the build only.";
    let heads = ["bytes", "bytes / texel", "scratch bytes", "build, f32 RGB", "build, f16 RGB", "ns / texel, f32"];
    let mut table = Table::new(["map"], heads);
    for size in &results.sizes {
        let (texels, [single, half]) = ((size.width * size.width / 2) as f64, size.build);
        let bytes = [size.bytes.to_string(), format!("{:.2}", size.bytes as f64 / texels), size.scratch.to_string()];
        let times = [single, half, single * 1e6 / texels].map(|time| format!("{time:.1}"));
        table.row([format!("{} x {}", size.width, size.width / 2)], bytes.into_iter().chain(times));
    }
    section("Bytes and build time", text, table)
}

fn budgets(results: &Results) -> Vec<Part> {
    let text = "Standard deviations of L / pdf for a bilinear client: the one allowed, the one added as the library states it, the one measured.
`error` of the info states it. The lights are built for themselves; what products read takes 21 kB more
(WIS_ENVIRONMENT_LIGHT_ONLY).";
    let mut table = Table::new(["light"], ["budget", "bytes", "stated", "measured", "within budget"]);
    for budget in &results.budgets {
        let within = budget.deviation <= f64::from(budget.budget).max(DEVIATION);
        let [stated, measured] = [budget.stated, budget.deviation].map(|value| format!("{value:.4}"));
        let [allowed, bytes] = [budget.budget.to_string(), budget.bytes.to_string()];
        table.row([&budget.light], [&*allowed, &bytes, &stated, &measured, if within { "yes" } else { "**no**" }]);
    }
    section("Error budgets", text, table)
}

fn fits(results: &Results) -> Vec<Part> {
    let text = format!(
        "w = L / (pdf x power), where L is the client's look-up in double precision. An exact density has w = 1 everywhere. Three
figures describe w over at least {} directions: its standard deviation, its maximum, and E[w^2] / E[w]^2. The last one multiplies the
variance. \"Missed\" is the share of the light whose pdf is 0, if there is any.",
        if results.quick { "130,000" } else { "1 million" }
    );
    let figures = ["deviation", "maximum", "E[w^2]/E[w]^2"];
    let heads = SOURCES.iter().flat_map(|source| figures.map(|figure| format!("{source}: {figure}")));
    let mut table = Table::new(["map", "client"], heads);
    for fits in &results.fits {
        let client = if fits.bilinear { "bilinear" } else { "nearest" };
        let cells = fits.each.iter().flat_map(|fit| {
            let missed = if fit.missed > 0.0 { format!(" (missed {:.1e})", fit.missed) } else { String::new() };
            [format!("{:.4}{missed}", fit.deviation()), format!("{:.3}", fit.maximum), format!("{:.5}", fit.ratio)]
        });
        table.row([&fits.light, client], cells);
    }
    section("L / pdf on every map", text, table)
}
