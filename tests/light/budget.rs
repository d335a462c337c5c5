//! The error budget: what is promised, and what it saves.

use super::built::Built;
use super::lookup::{Map, double};
use super::maps::{descriptions, layouts, rough, sky, suns};
use super::weights::weights;
use wis::light::chart::Layout;
use wis::light::plan::{Description, Filter};

/// What is left to chance.
const CHANCE: f64 = 0.001;

fn test(name: &str, map: &Map, of: &Description) {
    let built = Built::new(map, of);
    let least = built.least();
    let [deviation, largest, _] = weights(map, &built, |wi| map.radiance(of, least, double(wi)));
    let budget = f64::from(of.budget);
    let promised = built.environment().header().error;
    println!(
        "{name} {budget} {:?} {:?}: {deviation:.5} ({promised:.5}) {largest:.4}, {} bytes",
        of.layout,
        of.filter,
        built.bytes().len()
    );
    // The words of an exact light deviate already.
    let exact = Built::new(map, &Description { budget: 0.0, ..*of });
    let [words, ..] = weights(map, &exact, |wi| map.radiance(of, least, double(wi)));
    assert!(deviation <= budget.hypot(words) + CHANCE, "{name} {of:?}: {deviation}");
    assert!(largest <= 1.0 + 8.0 * budget + 0.05, "{name} {of:?}: {largest}");
    assert!(promised <= budget, "{name} {of:?}: {promised}");
    assert!(
        (deviation - promised.hypot(words)).abs() <= 0.1 * promised + CHANCE,
        "{name} {of:?}: {deviation} {promised}"
    );
}

#[test]
fn the_deviation_stays_within_the_budget() {
    for budget in [0.01, 0.1] {
        for (layout, width, height) in layouts(64) {
            for (name, of_direction) in [("rough", rough as fn(_) -> f64), ("sky", sky)] {
                let map = Map::of_directions(layout, width, height, of_direction);
                for of in descriptions(&map) {
                    test(name, &map, &Description { budget, ..of });
                }
            }
        }
        for (name, map) in suns(256, 128) {
            for of in descriptions(&map) {
                test(&name, &map, &Description { budget, ..of });
            }
        }
    }
}

#[test]
fn a_smooth_sky_takes_kilobytes() {
    for filter in [Filter::Nearest, Filter::Bilinear] {
        // As tests/support/maps.rs has it: smooth but for the pole, and for the horizon.
        let map = Map::latlong(1024, 512, |x, y| {
            let [u, v] = [(x as f32 + 0.5) / 1024.0, (y as f32 + 0.5) / 512.0];
            let up = (std::f32::consts::PI * v).cos();
            0.2 + if up > 0.0 { up * (1.0 + 0.3 * (std::f32::consts::TAU * u).sin()) } else { 0.0 }
        });
        let built = Built::new(&map, &Description { budget: 0.01, ..map.description(filter) });
        println!("{filter:?}: {} bytes", built.bytes().len());
        if filter == Filter::Bilinear {
            assert!(built.bytes().len() <= 16384, "{}", built.bytes().len());
        }
    }
}

#[test]
fn more_budget_takes_less_memory() {
    let map = Map::of_directions(Layout::LatLong, 512, 256, rough);
    let bytes = [0.0, 0.001, 0.01, 0.1, 1.0]
        .map(|budget| Built::new(&map, &Description { budget, ..map.description(Filter::Bilinear) }).bytes().len());
    assert!(bytes.windows(2).all(|pair| pair[1] <= pair[0]), "{bytes:?}");
}
