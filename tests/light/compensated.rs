//! The compensated light: proportional to max(L - mean, L / 64) (rule 41), so that it is 0 nowhere where the map is not.

use super::built::{Built, Random};
use super::lookup::{Map, V3, single};
use super::maps::layouts;
use wis::light::plan::{Description, Filter};

/// Parts of 16-bit words.
const QUANTISED: f64 = 0.02;

/// A sky of four regions, two of which lie below the mean: its cosine to +z.
fn sky(d: V3) -> f64 {
    match d[2] {
        z if z > 0.7 => 8.0,
        z if z > 0.2 => 2.5,
        z if z > -0.4 => 1.0,
        _ => 0.25,
    }
}

#[test]
fn the_density_is_what_compensation_leaves() {
    let mut random = Random(101);
    for (layout, width, height) in layouts(64) {
        let map = Map::of_directions(layout, width, height, sky);
        for filter in [Filter::Nearest, Filter::Bilinear] {
            let built = Built::new(&map, &Description { compensated: true, ..map.description(filter) });
            let header = *built.environment().header();
            // The mean is that of the map.
            let mean = 0.15 * 8.0 + 0.25 * 2.5 + 0.3 + 0.3 * 0.25;
            assert!((header.mean / mean - 1.0).abs() < 0.02, "{layout:?}: {}", header.mean);
            let left = |l: f64| (l - header.mean).max(l / 64.0);
            for _ in 0..4000 {
                let d = random.direction();
                // Two texels off the borders of regions.
                let inside = [0.7, 0.2, -0.4].iter().all(|border: &f64| (d[2].acos() - border.acos()).abs() > 0.12);
                if inside {
                    let share = f64::from(built.pdf(single(d))) * header.power / left(sky(d));
                    assert!((share - 1.0).abs() < QUANTISED, "{layout:?} {filter:?} {d:?}: {share}");
                }
            }
        }
    }
}
