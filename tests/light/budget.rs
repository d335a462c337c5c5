//! The error budget: what is promised, and what it saves.

use super::built::Built;
use super::lookup::{Map, V3, double};
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
    assert!(largest <= (1.0 + 8.0 * budget).max(4.0 / 3.0) + 0.05, "{name} {of:?}: {largest}");
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
    let azimuth = |d: V3| d[1].atan2(d[0]);
    // A gradient, a horizon, a glow, and waves around: those go on up to a pole.
    let skies: [(&str, &dyn Fn(V3) -> f64); 6] = [
        ("gradient", &|d| 1.0 + 0.8 * d[2]),
        ("horizon", &sky),
        ("glow", &|d| {
            0.4 + 0.2 * d[2] + 0.3 * (-8.0 * d[2] * d[2]).exp() + (4.0 * (0.7 * d[0] + 0.7 * d[2] - 1.0)).exp()
        }),
        ("a wave", &|d| (1.0 + 0.3 * azimuth(d).sin()) * (1.2 + d[2])),
        ("three waves", &|d| (1.0 + 0.3 * (3.0 * azimuth(d)).sin()) * (1.2 + d[2])),
        ("eight waves", &|d| 1.0 + 0.3 * (8.0 * azimuth(d)).sin() * (1.0 - d[2] * d[2])),
    ];
    for (name, of) in skies {
        let map = Map::of_directions(Layout::LatLong, 1024, 512, of);
        for rows_at_poles in [false, true] {
            let of = Description { budget: 0.01, rows_at_poles, light_only: true, ..map.description(Filter::Bilinear) };
            let built = Built::new(&map, &of);
            let (bytes, least) = (built.bytes().len(), built.least());
            let [deviation, ..] = weights(&map, &built, |wi| map.radiance(&of, least, double(wi)));
            println!("{name}: {bytes} bytes, {deviation:.5}");
            let strata = 16 * built.environment().light().strata.len();
            println!("{name}: of these, {strata} of strata");
            assert!(bytes - strata <= 60_000, "{name}: {bytes}");
            assert!(deviation <= 0.01, "{name}: {deviation}");
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
