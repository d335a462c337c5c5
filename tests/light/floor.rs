//! What the light keeps of dark texels: 2^-16 of the mean, and all of it (rule 16).

use super::built::{Built, Random};
use super::lookup::{Map, single};
use super::maps::{descriptions, layouts};

/// Parts of 16-bit words.
const QUANTISED: f64 = 0.02;

/// Black but for a bright disc of texels: everywhere else the density is that of the floor. Directions beside the disc are left out.
#[test]
fn black_is_as_bright_as_the_floor() {
    let mut random = Random(97);
    for (layout, width, height) in layouts(64) {
        let map = Map::of_directions(layout, width, height, |d| if d[2] > 0.9 { 3.0 } else { 0.0 });
        for of in descriptions(&map) {
            let built = Built::new(&map, &of);
            let header = *built.environment().header();
            let floor = header.mean / 65536.0 / header.power;
            for _ in 0..2000 {
                let d = random.direction();
                if d[2] < 0.8 {
                    let share = f64::from(built.pdf(single(d))) / floor;
                    assert!(share > 1.0 - QUANTISED, "{of:?} {d:?}: {share}");
                    // Beside light a unit of a table may be many times the floor; far from it one more is little.
                    assert!(d[2] > -0.5 || share < 1.3, "{of:?} {d:?}: {share}");
                }
            }
        }
    }
}
