//! The page: verdicts first, then the tables that they come from.

use crate::cost::NAMES;
use crate::estimators::{self, COUNTS, Figures};
use crate::{Errors, Results};
use anyhow::Result;
use std::fmt::Write;
use wis_ffi_tests::page;
use wis_ffi_tests::products::{POINTS, geometric};

/// Goals of preparations with warm caches, nanoseconds, by material.
const PREPARE: [(&str, f64); 4] = [("Lambert", 200.0), ("GGX 0.5", 600.0), ("GGX 0.2", 1000.0), ("GGX 0.05", 1500.0)];
/// Goals of errors on the maps for tuning, by material.
const ERROR: [(&str, f64); 5] =
    [("Lambert", 0.018), ("GGX 0.5", 0.019), ("GGX 0.2", 0.035), ("mix 0.1", 0.035), ("GGX 0.05", 0.055)];
/// The goal of a sample of 64 with warm caches, nanoseconds: 40 for the light, and what the product adds.
const SAMPLE: f64 = 65.0;
/// The most bytes of a product.
const BYTES: f64 = 4096.0;

const METHOD: &str = "\
Random shading points without occlusion, so that errors are those of the product. **Now** is `wis_product_prepare` with `wis_sample`
and `wis_pdf`; **0.1** is the product of wavelets, `wis_wavelet_product_*`, in the same run. The client looks maps up bilinearly.

Error: the root of the mean squared error of estimates of 16 samples, over the mean of all points; POINTS points, four estimates each.
Lines of several maps are geometric means. Times are nanoseconds. *Warm*: the fastest of 15 rounds, medians over points. *Cold*: 32 MB
of other memory are touched before each call; medians of 25 calls. The machine has other tenants: compare within a row.
";

pub fn write(results: &Results, ablation: &str) -> Result<String> {
    let mut out = String::from(
        "# Products by themselves\n\nWritten by `make sampler`. Every number and verdict is of the run that wrote this page.\n\n",
    );
    conclusions(&mut out, results)?;
    writeln!(out, "\n{}", METHOD.replace("POINTS", &POINTS.to_string()))?;
    costs(&mut out, results)?;
    errors(&mut out, results)?;
    integrals(&mut out, results)?;
    out.push('\n');
    out.push_str(ablation);
    Ok(out + "\n" + &page::provenance("sampler")?)
}

/// What a goal asks for, what was measured, and whether it holds.
fn verdict(out: &mut String, goal: &str, measured: &[(String, f64, f64)], unit: &str, digits: usize) -> Result<()> {
    let each: Vec<String> =
        measured.iter().map(|(name, value, goal)| format!("{name} {value:.digits$} ({goal:.digits$}{unit})")).collect();
    let missed = measured.iter().filter(|(_, value, goal)| value > goal).count();
    let verdict = match missed {
        0 => "holds".to_string(),
        missed if missed == measured.len() => "**does not hold**".to_string(),
        missed => format!("**does not hold** for {missed} of {}", measured.len()),
    };
    Ok(writeln!(out, "| {goal} | {} | {verdict} |", each.join(", "))?)
}

fn conclusions(out: &mut String, results: &Results) -> Result<()> {
    let index = |name: &str| results.materials.iter().position(|material| material == name).expect("it was measured");
    let own = |slot: usize, goals: &[(&str, f64)]| -> Vec<(String, f64, f64)> {
        goals.iter().map(|&(name, goal)| (name.to_string(), results.costs[index(name)][0].ns[slot], goal)).collect()
    };
    writeln!(out, "| goal | measured (goal) | verdict |\n|---|---|---|")?;
    let errors: Vec<(String, f64, f64)> =
        ERROR.iter().map(|&(name, goal)| (name.to_string(), mean(&results.errors[0], index(name), 0), goal)).collect();
    verdict(out, "error of 16 samples on the maps for tuning", &errors, "", 3)?;
    let ahead = |group: usize| -> Vec<(String, f64, f64)> {
        (0..results.materials.len())
            .map(|i| {
                let [now, before] = [0, 1].map(|which| mean(&results.errors[group], i, which));
                (results.materials[i].clone(), now / before, 1.0)
            })
            .collect()
    };
    for (group, name) in GROUPS.iter().enumerate().filter(|(group, _)| !results.errors[*group].is_empty()) {
        verdict(out, &format!("error over that of 0.1, {name}: not above 1"), &ahead(group), "", 2)?;
    }
    verdict(out, "prepare, warm", &own(0, &PREPARE), " ns", 0)?;
    let all: Vec<(&str, f64)> = results.materials.iter().map(|name| (name.as_str(), SAMPLE)).collect();
    verdict(out, "a sample in 64, warm", &own(5, &all), " ns", 0)?;
    let bytes: Vec<(String, f64, f64)> =
        results.materials.iter().zip(&results.costs).map(|(name, [now, _])| (name.clone(), now.bytes, BYTES)).collect();
    verdict(out, "bytes of a product, median", &bytes, "", 0)
}

/// Groups of maps, by name.
const GROUPS: [&str; 2] = ["maps for tuning", "other maps"];

fn mean(errors: &[Errors], material: usize, which: usize) -> f64 {
    geometric(errors.iter().map(|errors| errors.each[material][which]))
}

fn costs(out: &mut String, results: &Results) -> Result<()> {
    writeln!(out, "## Costs\n\nNow / 0.1, on {}.\n\n| what | {} |", results.timed, results.materials.join(" | "))?;
    writeln!(out, "|---|{}", "---:|".repeat(results.materials.len()))?;
    for (slot, name) in NAMES.iter().enumerate() {
        let cells = results.costs.iter().map(|[now, before]| format!("{:.0} / {:.0}", now.ns[slot], before.ns[slot]));
        writeln!(out, "| {name} | {} |", cells.collect::<Vec<_>>().join(" | "))?;
    }
    let cells = results.costs.iter().map(|[now, before]| format!("{:.0} / {:.0}", now.bytes, before.bytes));
    Ok(writeln!(out, "| bytes, median | {} |", cells.collect::<Vec<_>>().join(" | "))?)
}

fn errors(out: &mut String, results: &Results) -> Result<()> {
    writeln!(out, "\n## Error\n\nNow / 0.1.\n\n| map | {} |", results.materials.join(" | "))?;
    writeln!(out, "|---|{}", "---:|".repeat(results.materials.len()))?;
    for (errors, name) in results.errors.iter().zip(GROUPS).filter(|(errors, _)| !errors.is_empty()) {
        for map in errors {
            let cells = map.each.iter().map(|[now, before]| format!("{now:.3} / {before:.3}"));
            writeln!(out, "| {} | {} |", map.light, cells.collect::<Vec<_>>().join(" | "))?;
        }
        let cells =
            (0..results.materials.len()).map(|i| format!("**{:.3} / {:.3}**", mean(errors, i, 0), mean(errors, i, 1)));
        writeln!(out, "| **{name}** | {} |", cells.collect::<Vec<_>>().join(" | "))?;
    }
    Ok(())
}

const INTEGRALS: &str = "\
`wis_product_describe` states an approximation I of the integral, and two estimators use it. V is the visibility; f, L and p are BRDF x
cosine, radiance and density of a sample. *Unbiased*: the mean of f L V / p. *Ratio*: I times the sum of f L V / p over the sum of f L / p.
*Biased*: I times the mean of V, which evaluates no BRDF and no radiance. The errors of both stop falling at that of I. Rows of I have no
occlusion. In the others a quarter of the sphere is blocked at each of POINTS points, elsewhere at each. Errors are relative to the mean of all points.
";

/// A figure of estimators with a material, mean of maps.
fn over(maps: &[Errors], material: usize, of: impl Fn(&Figures) -> f64) -> f64 {
    geometric(maps.iter().map(|map| of(&map.estimators[material])))
}

/// For how many materials an estimator has less error than the unbiased one, by number of samples.
fn less_often(maps: &[Errors], materials: usize, which: usize) -> String {
    let each = COUNTS.iter().enumerate().map(|(number, count)| {
        let ratio = |f: &Figures| f.errors[number][which] / f.errors[number][0];
        let less = (0..materials).filter(|&i| over(maps, i, ratio) < 1.0).count();
        format!("{less} with {count}{}", if number == 0 { " samples" } else { "" })
    });
    each.collect::<Vec<_>>().join(", ")
}

/// The stated integral under each map, and the estimators that use it.
fn integrals(out: &mut String, results: &Results) -> Result<()> {
    let materials = results.materials.len();
    let groups = || results.errors.iter().zip(GROUPS).filter(|(errors, _)| !errors.is_empty());
    writeln!(out, "\n## Estimators by the stated integral\n")?;
    for (maps, group) in groups() {
        let [ratio, biased] = [1, 2].map(|which| less_often(maps, materials, which));
        writeln!(
            out,
            "- Less error than *unbiased*, {group}, of {materials} materials: *ratio* for {ratio}; *biased* for {biased}."
        )?;
    }
    writeln!(out, "\n{}", INTEGRALS.replace("POINTS", &estimators::POINTS.to_string()))?;
    writeln!(out, "| error | {} |\n|---|{}", results.materials.join(" | "), "---:|".repeat(materials))?;
    for (maps, group) in groups() {
        for map in maps {
            let cells = map.estimators.iter().map(|figures| format!("{:.3}", figures.integral));
            writeln!(out, "| I, {} | {} |", map.light, cells.collect::<Vec<_>>().join(" | "))?;
        }
        for (number, count) in COUNTS.iter().enumerate() {
            let cell = |material: usize| {
                let each = (0..estimators::NAMES.len()).map(|which| over(maps, material, |f| f.errors[number][which]));
                each.map(|error| format!("{error:.3}")).collect::<Vec<_>>().join(" / ")
            };
            let cells = (0..materials).map(cell).collect::<Vec<_>>().join(" | ");
            writeln!(out, "| {group}, {count} samples: {} | {cells} |", estimators::NAMES.join(" / "))?;
        }
    }
    Ok(())
}
