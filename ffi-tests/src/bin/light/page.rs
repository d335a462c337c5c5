//! The page: conclusions first, long tables last. Every verdict follows from the numbers of the run that writes it.

use crate::equal::{Cell, Gain, METRICS, scales};
use crate::speed::CALLS;
use crate::{Fits, Results};
use anyhow::Result;
use std::fmt::Write;
use wis_ffi_tests::cost::MODELS;
use wis_ffi_tests::lightonly::{Source, Technique};
use wis_ffi_tests::page;

/// The goals: the relative standard deviation of L / pdf and its maximum.
const DEVIATION: f64 = 0.01;
const MAXIMUM: f64 = 1.05;
/// Cold times over those of version 0.1, of samples in 64 and alone.
const COLD: [f64; 2] = [0.6, 0.4];
/// Warm times in nanoseconds, in the order of `CALLS`.
const WARM: [f64; 4] = [40.0, 15.0, 110.0, 60.0];
/// Of a map of 1024 x 512: bytes, and milliseconds of the build.
const BYTES: f64 = 2.4e6;
const BUILD: f64 = 10.0;
/// Bytes of a smooth sky with a budget of 1 %.
const SKY: f64 = 16e3;

pub fn write(results: &Results) -> Result<String> {
    let mut out = String::from(INTRODUCTION);
    conclusions(&mut out, results)?;
    writeln!(out, "\n{METHOD}")?;
    if results.quick {
        writeln!(out, "\nThis is a quick run: its numbers only show that the instrument works.")?;
    }
    gains(&mut out, results)?;
    speeds(&mut out, results)?;
    sizes(&mut out, results)?;
    budgets(&mut out, results)?;
    fits(&mut out, results)?;
    cells(&mut out, results)?;
    Ok(out + "\n" + &page::provenance("light")?)
}

const INTRODUCTION: &str = "# The light, measured

Written by `make light`. Every number and verdict is of the run that wrote this page.

";

const METHOD: &str = "Three densities stand side by side. **wis** is `wis_environment` with `wis_sample` and `wis_pdf`. **Version 0.1** is
the pyramid of `wis_wavelet_light_*`. **pbrt-like** is the piecewise constant 2D distribution of pbrt-v3, in scalar floats with
binary searches. For a bilinear client it has twice the texels along each axis, filled with interpolated values.

A *bilinear* client interpolates between texel centres. A *nearest* client takes the texel that holds the direction. Each
density is built for its client. *Cold*: 32 MB of other memory are touched before each 64 samples or pdfs, whether they come in
one call or one by one. *Warm*: the same 1024 inputs again and again.

Suns of one and four texels are 10^5 times as bright as their sky. Their maps have 512 x 256 texels.";

/// The goals with what was measured.
fn conclusions(out: &mut String, results: &Results) -> Result<()> {
    writeln!(out, "| goal | measured | verdict |\n|---|---|---|")?;
    let mut row = |goal: &str, measured: String, holds: bool| {
        writeln!(out, "| {goal} | {measured} | {} |", if holds { "holds" } else { "**does not hold**" })
    };
    for (bilinear, client) in [(true, "bilinear"), (false, "nearest")] {
        let of = || results.fits.iter().filter(|fits| fits.bilinear == bilinear);
        let worst = |value: fn(&Fits) -> f64| {
            of().map(|fits| (value(fits), &fits.light)).max_by(|a, b| a.0.total_cmp(&b.0)).expect("a map")
        };
        let (deviation, most) = (worst(|f| f.each[0].deviation()), worst(|f| f.each[0].maximum));
        row(
            &format!(
                "L / pdf, {client} client, all maps: standard deviation at most {DEVIATION}, maximum at most {MAXIMUM}"
            ),
            format!("{:.4} ({}), {:.3} ({})", deviation.0, deviation.1, most.0, most.1),
            deviation.0 <= DEVIATION && most.0 <= MAXIMUM,
        )?;
    }
    let speeds = &results.speeds[0];
    let [alone, batch] = [2, 0].map(|call| speeds[0].cold[call] / speeds[1].cold[call]);
    row(
        &format!("cold sample over version 0.1: at most {} in 64, {} alone", COLD[0], COLD[1]),
        format!("{batch:.2} in 64, {alone:.2} alone"),
        batch <= COLD[0] && alone <= COLD[1],
    )?;
    let warm = speeds[0].warm;
    for (name, pair) in [("sample", [0, 2]), ("pdf", [1, 3])] {
        row(
            &format!("warm {name}: at most {} ns in 64, {} ns alone", WARM[pair[0]], WARM[pair[1]]),
            format!("{:.0} ns in 64, {:.0} ns alone", warm[pair[0]], warm[pair[1]]),
            pair.iter().all(|&call| warm[call] <= WARM[call]),
        )?;
    }
    if let Some(size) = results.sizes.iter().find(|size| size.width == 1024) {
        let (bytes, build) = (size.bytes as f64, size.build[0]);
        row(
            &format!("1024 x 512 at full detail: at most {:.1} MB, built in at most {BUILD} ms", BYTES / 1e6),
            format!("{:.2} MB, {build:.1} ms", bytes / 1e6),
            bytes <= BYTES && build <= BUILD,
        )?;
    }
    if let Some(budget) = results.budgets.iter().find(|b| b.light == "sky" && b.budget == 0.01) {
        row(
            &format!("a smooth sky with a budget of 1 %, light alone: at most {:.0} kB", SKY / 1e3),
            format!("{:.1} kB, standard deviation {:.4}", budget.bytes as f64 / 1e3, budget.deviation),
            budget.bytes as f64 <= SKY && budget.deviation <= 0.01,
        )?;
    }
    for against in [Source::Pyramid, Source::Piecewise] {
        let ([least, low, high], name) = least_gain(results, against);
        row(
            &format!(
                "equal time, every technique that it has, metric, cost model and cache: not behind {}",
                against.name()
            ),
            format!("least gain {least:.2} [{low:.2}, {high:.2}] ({name})"),
            high >= 1.0,
        )?;
    }
    Ok(())
}

/// Real maps and suns, by name.
fn groups(results: &Results) -> Vec<(&'static str, Vec<&Cell>)> {
    let of = |is_sun| results.cells.iter().filter(|cell| cell.is_sun == is_sun).collect::<Vec<_>>();
    [("maps", of(false)), ("suns", of(true))].into_iter().filter(|group| !group.1.is_empty()).collect()
}

fn least_gain(results: &Results, against: Source) -> ([f64; 3], String) {
    let mut least = ([f64::INFINITY; 3], String::new());
    for (group, cells) in groups(results) {
        for technique in Technique::ALL.into_iter().filter(|&technique| against.has(technique)) {
            for (scale, metric, model, caches) in scales() {
                let gain = Gain { technique, against, metric, model, caches }.over(&cells, &results.counts);
                if gain[0] < least.0[0] {
                    least = (gain, format!("{}, {group}, {scale}", technique.name()));
                }
            }
        }
    }
    least
}

fn gains(out: &mut String, results: &Results) -> Result<()> {
    let counts: Vec<String> = results.counts.iter().map(usize::to_string).collect();
    writeln!(
        out,
        "\n## Equal time\n
Gain: variance x time with the other tables over variance x time with wis; above 1 wis is ahead. The geometric mean over
materials, lights and N = {}, with bootstrap intervals of 95 % over {} repeats. {} shading points with shadows and
a bilinear client. Caches are cold where 32 MB of other memory are touched before a point, and warm where another point comes
before it. Renderer: before a point a ray goes through a million triangles, and 256 kB of 16 MB of other memory are read. The last section has the cells.\n",
        counts.join(", "),
        results.repeats,
        results.points
    )?;
    let heads: Vec<String> = scales().map(|(name, ..)| name).collect();
    writeln!(out, "| lights | technique | against | {} |", heads.join(" | "))?;
    writeln!(out, "|---|---|---|{}", "---:|".repeat(heads.len()))?;
    for (group, cells) in groups(results) {
        for technique in Technique::ALL {
            for against in [Source::Pyramid, Source::Piecewise].into_iter().filter(|source| source.has(technique)) {
                write!(out, "| {group} | {} | {} ", technique.name(), against.name())?;
                for (_, metric, model, caches) in scales() {
                    let [gain, low, high] =
                        Gain { technique, against, metric, model, caches }.over(&cells, &results.counts);
                    write!(out, "| {gain:.2} [{low:.2}, {high:.2}] ")?;
                }
                writeln!(out, "|")?;
            }
        }
    }
    Ok(())
}

fn speeds(out: &mut String, results: &Results) -> Result<()> {
    writeln!(
        out,
        "\n## Time of a sample and of a pdf\n
Nanoseconds on {}: cold medians, and the fastest of the warm rounds. The machine has other tenants: compare within a column.
\"First\" is a single call right after 32 MB of other memory were touched: code and page tables are cold, too.

In a map of 1024 x 512 a sample of wis reads 8 cache lines for a bilinear client, and a pdf 7:\n
- sample: the table of all cells (1), its cell (1), the cell's starts (2), the block (1), the row starts (1), texels (2);
- pdf: the maps from blocks to cells (2), the cell (1), the block (1), the row starts (1), texels (2).\n
Block, row starts and texels are in one page. The maps have 97 bytes in all. A nearest client reads one line of texels less.\n",
        results.timed
    )?;
    let calls = CALLS.iter().flat_map(|call| [format!("{call}, cold"), "warm".into()]);
    let heads: Vec<String> = calls.chain(["first sample".into(), "first pdf".into()]).collect();
    writeln!(out, "| client | light | {} |\n|---|---|{}", heads.join(" | "), "---:|".repeat(heads.len()))?;
    for (client, speeds) in ["bilinear", "nearest"].iter().zip(&results.speeds) {
        for (source, speed) in Source::ALL.iter().zip(speeds) {
            write!(out, "| {client} | {} ", source.name())?;
            for (cold, warm) in speed.cold.iter().zip(speed.warm) {
                write!(out, "| {cold:.0} | {warm:.0} ")?;
            }
            let [sample, pdf] = speed.first;
            writeln!(out, "| {sample:.0} | {pdf:.0} |")?;
        }
    }
    Ok(())
}

fn sizes(out: &mut String, results: &Results) -> Result<()> {
    writeln!(
        out,
        "\n## Bytes and build time\n
A bilinear client, noise in every texel, rows by callback. Builds are on one core, in milliseconds of processor time. Scratch
memory is needed during the build only.\n
| map | bytes | bytes / texel | scratch bytes | build, f32 RGB | build, f16 RGB | ns / texel, f32 | version 0.1: build | bytes |
|---|---:|---:|---:|---:|---:|---:|---:|---:|"
    )?;
    for size in &results.sizes {
        let texels = (size.width * size.width / 2) as f64;
        let [single, half] = size.build;
        write!(
            out,
            "| {} x {} | {} | {:.2} | {} | {single:.1} | {half:.1} | {:.1} ",
            size.width,
            size.width / 2,
            size.bytes,
            size.bytes as f64 / texels,
            size.scratch,
            single * 1e6 / texels
        )?;
        match size.pyramid {
            Some((build, bytes)) => writeln!(out, "| {build:.0} | {bytes} |")?,
            None => writeln!(out, "| not measured | not measured |")?,
        }
    }
    Ok(())
}

fn budgets(out: &mut String, results: &Results) -> Result<()> {
    writeln!(
        out,
        "\n## Error budgets\n
Standard deviations of L / pdf for a bilinear client: the one allowed, the one added as the library states it, the one measured.
`error` of the info states it. The lights are built for themselves; what products read takes 21 kB more
(WIS_ENVIRONMENT_LIGHT_ONLY).\n
| light | budget | bytes | stated | measured | within budget |\n|---|---:|---:|---:|---:|---|"
    )?;
    for budget in &results.budgets {
        let allowed = f64::from(budget.budget).max(DEVIATION);
        let within = if budget.deviation <= allowed { "yes" } else { "**no**" };
        writeln!(
            out,
            "| {} | {} | {} | {:.4} | {:.4} | {within} |",
            budget.light, budget.budget, budget.bytes, budget.stated, budget.deviation
        )?;
    }
    Ok(())
}

fn fits(out: &mut String, results: &Results) -> Result<()> {
    writeln!(
        out,
        "\n## L / pdf on every map\n
w = L / (pdf x power), where L is the client's look-up in double precision. An exact density has w = 1 everywhere. Three
figures describe w over at least {} directions: its standard deviation, its maximum, and E[w^2] / E[w]^2. The last one multiplies the
variance. \"Missed\" is the share of the light whose pdf is 0, if there is any.",
        if results.quick { "130,000" } else { "1 million" }
    )?;
    for (bilinear, client) in [(true, "bilinear"), (false, "nearest")] {
        writeln!(
            out,
            "\n### A {client} client\n
| map | wis: deviation | maximum | E[w^2]/E[w]^2 | version 0.1: deviation | maximum | E[w^2]/E[w]^2 | pbrt-like: deviation | maximum | E[w^2]/E[w]^2 |
|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|"
        )?;
        for fits in results.fits.iter().filter(|fits| fits.bilinear == bilinear) {
            write!(out, "| {} ", fits.light)?;
            for fit in &fits.each {
                let missed = if fit.missed > 0.0 { format!(" (missed {:.1e})", fit.missed) } else { String::new() };
                write!(out, "| {:.4}{missed} | {:.3} | {:.5} ", fit.deviation(), fit.maximum, fit.ratio)?;
            }
            writeln!(out, "|")?;
        }
    }
    Ok(())
}

fn cells(out: &mut String, results: &Results) -> Result<()> {
    writeln!(
        out,
        "\n## Cells\n
Absolute: RMSE over the mean of the image. Relative: RMSE of each point over its reference. us: microseconds for a shading point in
the {} and the {} cost model, with a renderer's caches. The reference's own error follows the name of the light.\n",
        MODELS[0].0, MODELS[1].0
    )?;
    write!(out, "| light (error of the reference) | material | technique | N ")?;
    for source in Source::ALL {
        write!(out, "| {}: absolute | relative | us, {} | us, {} ", source.name(), MODELS[0].0, MODELS[1].0)?;
    }
    writeln!(out, "|\n|---|---|---|---:|{}", "---:|".repeat(4 * Source::ALL.len()))?;
    for cell in &results.cells {
        for technique in Technique::ALL {
            for &count in &results.counts {
                let (light, error) = (&cell.light, cell.disagreement);
                write!(out, "| {light} ({error:.4}) | {} | {} | {count} ", cell.material, technique.name())?;
                for source in Source::ALL {
                    if !source.has(technique) {
                        write!(out, "| - | - | - | - ")?;
                        continue;
                    }
                    let row = cell.row(technique, source, count);
                    for (_, metric) in METRICS {
                        let mean =
                            row.repeats.iter().map(|r| metric(&r.errors[0])).sum::<f64>() / row.repeats.len() as f64;
                        write!(out, "| {:.3} ", mean.sqrt())?;
                    }
                    for time in row.times[0] {
                        write!(out, "| {:.2} ", time.ns() / 1e3)?;
                    }
                }
                writeln!(out, "|")?;
            }
        }
    }
    Ok(())
}
