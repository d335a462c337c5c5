//! Where lights are placed (Fig. 3), and what cutting a map takes (Section 5).

use crate::{Map, config, draw_map, place_on};
use anyhow::Result;
use glam::Vec3;
use std::fmt::Write;
use wis_ffi_tests::images::Sheet;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::paper::{Paper, columns};
use wis_ffi_tests::processor;
use wis_ffi_tests::structured::{Source, Start, clustered};

/// The three metrics of Fig. 3: exponents of light and of solid angle, and the limit of the latter.
const METRICS: [(&str, [f32; 2], f32); 3] = [
    ("area: a = 0, b = 1", [0.0, 1.0], 12.567),
    ("light: a = 1, b = 0", [1.0, 0.0], 0.01),
    ("the paper's: a = 1, b = 1/4", [1.0, 0.25], 0.01),
];
/// Rounds of k-means.
pub const ROUNDS: usize = 8;
/// Lights on a real map.
const LIGHTS: u32 = 300;
/// What is bright: so many standard deviations, the highest of the paper's thresholds.
const DEVIATIONS: f64 = 5.0;
/// Seconds that the paper's program took for 300 lights.
const MINUTE: f64 = 60.0;

/// Fig. 3 on a map like the paper's.
pub fn allocation(page: &mut Paper) -> Result<()> {
    let map = three_regions();
    let source = Source::new(&map);
    page.heading("Allocation (Fig. 3)")?;
    columns(&mut page.text, 1, "metric | lights | in the bright region | in the middle one")?;
    let mut bright = Vec::new();
    for (name, exponents, limit) in METRICS {
        let strata = source.strata_by(&config(100, &exponents, limit))?;
        let angle = |l: &wis_ffi_tests::client::raw::wis_light| l.direction[0].clamp(-1.0, 1.0).acos();
        let within = |low: f32, high: f32| strata.lights.iter().filter(|l| (low..high).contains(&angle(l))).count();
        bright.push(within(0.0, BRIGHT));
        writeln!(
            page.text,
            "| {name} | {} | {} | {} |",
            strata.lights.len(),
            within(0.0, BRIGHT),
            within(BRIGHT, MIDDLE)
        )?;
    }
    page.claim("a small bright region", bright[2] < bright[1], &[&bright[2], &bright[1]]);
    Ok(())
}

/// The same on real maps, with pictures.
pub fn real(page: &mut Paper, maps: &[&Map]) -> Result<()> {
    page.heading("The same on real maps")?;
    let heads = METRICS.map(|metric| metric.0).join(" | ");
    columns(&mut page.text, 1, &format!("map | solid angle that is bright, sr | its share of the light | {heads}"))?;
    let (mut holds, mut found, mut sheets) = (true, Vec::new(), Vec::new());
    for map in maps {
        let threshold = DEVIATIONS * deviation(&map.light);
        let is_bright = |direction: Vec3| f64::from(map.light.radiance(direction)) > threshold;
        let texels = map.light.quadrature(1).zip(map.light.luminance());
        let (mut angle, mut light, mut all) = (0.0, 0.0, 0.0);
        for ((direction, area), radiance) in texels {
            let (area, power) = (area, area * f64::from(*radiance));
            all += power;
            if is_bright(direction) {
                (angle, light) = (angle + area, light + power);
            }
        }
        let source = Source::new(&map.light);
        let mut counts = Vec::new();
        let mut sheet = Sheet::of_panels([2, 2], [640, 320], 1.0);
        for (i, (name, exponents, limit)) in (0..).zip(METRICS) {
            let strata = source.strata_by(&config(LIGHTS, &exponents, limit))?;
            let directions: Vec<Vec3> = strata.lights.iter().map(|l| Vec3::from_array(l.direction)).collect();
            counts.push(directions.iter().filter(|d| is_bright(**d)).count());
            let at = [i % 2, i / 2];
            draw_map(&mut sheet, at, map, name.split(':').next().unwrap_or(name));
            directions.iter().for_each(|d| sheet.dot(at, place_on(map, *d), [255, 220, 40]));
        }
        let kmeans = clustered(&map.light, LIGHTS as usize, ROUNDS, Start::Area);
        draw_map(&mut sheet, [1, 1], map, "k-means from an even start");
        kmeans.directions().iter().for_each(|d| sheet.dot([1, 1], place_on(map, *d), [80, 220, 255]));
        writeln!(
            page.text,
            "| {} | {angle:.4} | {:.0} % | {} | {} | {} |",
            map.light.name,
            100.0 * light / all,
            counts[0],
            counts[1],
            counts[2]
        )?;
        holds &= counts[2] < counts[1] && counts[0] < counts[2];
        found.push(format!("{} in place of {} ({})", counts[2], counts[1], map.light.name));
        sheets.push((format!("lights-{}.png", map.light.name), sheet));
    }
    for (file, sheet) in &sheets {
        page.save(file, sheet)?;
    }
    page.claim("the same on real", holds, &[&found.join(", ")]);
    Ok(())
}

/// The standard deviation of the radiance over the sphere.
fn deviation(light: &Light) -> f64 {
    let mean = light.mean();
    let texels = light.quadrature(1).zip(light.luminance());
    let (sum, all) = texels.fold((0.0, 0.0), |(sum, all), ((_, area), radiance)| {
        (sum + area * (f64::from(*radiance) - mean).powi(2), all + area)
    });
    (sum / all).sqrt()
}

/// Section 5: what it takes to cut a map.
pub fn speed(page: &mut Paper, lights: &[&Light]) -> Result<()> {
    page.heading("Time to cut a map (Section 5)")?;
    columns(&mut page.text, 1, "map | texels | lights asked for | lights | processor s | scratch MB")?;
    let mut of_300 = Vec::new();
    for light in lights {
        let ([width, height], name) = (light.size(), &light.name);
        let source = Source::new(light);
        for count in [300, 3000] {
            let mut best = f64::MAX;
            let mut strata = source.strata(count)?;
            for _ in 0..3 {
                let start = processor::seconds();
                strata = source.strata(count)?;
                best = best.min(processor::seconds() - start);
            }
            let (lights, megabytes) = (strata.lights.len(), strata.size.scratch_bytes as f64 / 1e6);
            writeln!(page.text, "| {name} | {width} x {height} | {count} | {lights} | {best:.2} | {megabytes:.0} |")?;
            if count == 300 {
                of_300.push((best, width * height));
            }
        }
        let start = processor::seconds();
        clustered(light, 300, ROUNDS, Start::Weight);
        let seconds = processor::seconds() - start;
        writeln!(page.text, "| {name} | {width} x {height} | 300 | k-means, {ROUNDS} rounds | {seconds:.2} | - |")?;
    }
    let (seconds, texels) = of_300.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).expect("a map");
    page.claim("300 lights of a", seconds <= MINUTE, &[&seconds, &(texels as f64 / 1e6)]);
    Ok(())
}

/// The radii of the regions of Fig. 3's map, about +x.
const BRIGHT: f32 = 0.0287;
const MIDDLE: f32 = 0.25;

/// A disc, a ring and a rest, each of constant radiance, with .35, .4 and .25 of the light.
fn three_regions() -> Light {
    let (width, height) = (2048usize, 1024usize);
    let share = |angle: f32| 2.0 * std::f32::consts::PI * (1.0 - angle.cos());
    let (disc, ring) = (share(BRIGHT), share(MIDDLE) - share(BRIGHT));
    let rest = 4.0 * std::f32::consts::PI - disc - ring;
    let texel = |i: usize| {
        let phi = std::f32::consts::TAU * ((i % width) as f32 + 0.5) / width as f32;
        let theta = std::f32::consts::PI * ((i / width) as f32 + 0.5) / height as f32;
        match (theta.sin() * phi.cos()).acos() {
            angle if angle < BRIGHT => 0.35 / disc,
            angle if angle < MIDDLE => 0.4 / ring,
            _ => 0.25 / rest,
        }
    };
    Light::latlong("three regions", width, height, (0..width * height).map(texel).collect())
}
