//! The largest weight under an error budget: a texel far above its surroundings is too rare to count in the variance of a block, and is
//! kept apart all the same (rule 17).

use super::built::Built;
use super::lookup::{Map, direction, single};
use wis::light::chart::Layout;
use wis::light::plan::{Description, Filter};

const WIDTH: u32 = 256;
const HEIGHT: u32 = 128;

/// A bump in each block of 16 x 16 texels of a grey map: w is 1 + 8 b at the most, or 4/3, and the rounding of the tables.
#[test]
fn no_weight_is_larger_than_the_budget_allows() {
    for (budget, bump) in [(0.01f32, 1.15f32), (0.05, 1.7), (0.1, 2.4)] {
        let is_bump = |x: u32, y: u32| x % 16 == 7 && y % 16 == 5;
        let map = Map::latlong(WIDTH, HEIGHT, |x, y| if is_bump(x, y) { bump } else { 1.0 });
        for filter in [Filter::Nearest, Filter::Bilinear] {
            let built = Built::new(&map, &Description { budget, ..map.description(filter) });
            let header = *built.environment().header();
            let mut largest = 0.0f64;
            for (x, y) in (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y))).filter(|&(x, y)| is_bump(x, y)) {
                let place = [(f64::from(x) + 0.5) / f64::from(WIDTH), (f64::from(y) + 0.5) / f64::from(HEIGHT)];
                let pdf = f64::from(built.pdf(single(direction(Layout::LatLong, 0, place))));
                largest = largest.max(f64::from(bump) / (pdf * header.power));
            }
            let allowed = f64::from(1.0 + (8.0 * budget).max(1.0 / 3.0)) + 0.05;
            println!(
                "{filter:?}, budget {budget}, bumps of {bump}: {largest:.3} of {allowed:.3}, {} bytes",
                header.bytes
            );
            assert!(largest <= allowed, "{filter:?}, budget {budget}, bumps of {bump}: {largest} of {allowed}");
        }
    }
}
