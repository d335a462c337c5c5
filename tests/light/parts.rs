//! Where the parts of a divided cell lie: light that is apart has parts of its own.

use super::built::Built;
use super::lookup::{Map, V3, unit};
use super::maps::{rough, sky};
use wis::light::chart::Layout;
use wis::light::guide::{Guide, value};
use wis::light::parts::{Borders, EVEN, PARTS};
use wis::light::plan::{Description, Filter};

const LAYOUTS: [(Layout, u32, u32); 3] =
    [(Layout::LatLong, 256, 128), (Layout::Cube, 128, 768), (Layout::Octahedral, 256, 256)];
/// No row of parts has less of a cell's numbers, and no part of its row's.
const LEAST: f32 = 1.0 / 256.0;

fn with_guide<T>(layout: Layout, size: [u32; 2], radiance: impl Fn(V3) -> f64, look: impl Fn(&Guide<'_>) -> T) -> T {
    let [width, height] = size;
    let map = Map::of_directions(layout, width, height, radiance);
    let built = Built::new(&map, &Description { exact_zero: true, ..map.description(Filter::Bilinear) });
    look(&built.environment().guide().expect("it was built"))
}

/// Widths of rows, and of the parts of each row.
fn widths(borders: &Borders) -> Vec<f32> {
    let of = |three: &[f32]| {
        let ends: Vec<f32> = [0.0].into_iter().chain(three.iter().copied()).chain([1.0]).collect();
        ends.windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<f32>>()
    };
    borders.chunks_exact(PARTS - 1).flat_map(of).collect()
}

/// A sun has most of its cell's light. Of 16 equal parts all but one or two would lie in it.
#[test]
fn the_sky_about_a_sun_has_parts_of_its_own() {
    for (layout, width, height) in LAYOUTS {
        let sun = unit([0.9, 0.3, 0.35]);
        let is_sun = |d: V3| (0..3).map(|k| d[k] * sun[k]).sum::<f64>() > 0.9996;
        for light in [300.0, 1000.0, 4000.0] {
            let radiance = |d: V3| if is_sun(d) { light } else { 1.0 };
            let (share, in_sky) = with_guide(layout, [width, height], radiance, |guide| {
                let mass = |cell: &usize| guide.mass(*cell);
                let cell = (0..guide.cells()).max_by(|a, b| mass(a).total_cmp(&mass(b))).expect("a cell");
                let [x, y, z] = guide.middles(cell);
                let middles = x.iter().zip(y).zip(z).map(|((&x, &y), &z)| [x, y, z].map(|x| f64::from(value(x))));
                (mass(&cell), middles.filter(|&d| !is_sun(d)).count())
            });
            println!("{layout:?} {light}: the cell has {share:.2} of the light, {in_sky} of 16 parts lie in the sky");
            assert!((4..16).contains(&in_sky), "{layout:?} {light}: {in_sky}");
        }
    }
}

#[test]
fn even_light_has_equal_parts() {
    for (layout, width, height) in LAYOUTS {
        with_guide(
            layout,
            [width, height],
            |_| 0.3,
            |guide| {
                assert!((0..guide.cells()).all(|cell| guide.borders(cell) == EVEN), "{layout:?}");
            },
        );
    }
}

/// Also where a cell has no light, or that of a texel alone.
#[test]
fn parts_are_not_too_narrow() {
    let lone = |d: V3| if d[0] > 0.999_97 { 1.0 } else { 0.0 };
    let dark = |_: V3| 0.0;
    let lights: [(&str, &dyn Fn(V3) -> f64); 4] = [("rough", &rough), ("sky", &sky), ("dark", &dark), ("lone", &lone)];
    for (layout, width, height) in LAYOUTS {
        for (name, radiance) in lights {
            with_guide(layout, [width, height], radiance, |guide| {
                for cell in 0..guide.cells() {
                    let narrowest = widths(&guide.borders(cell)).into_iter().fold(1.0, f32::min);
                    assert!(narrowest >= 0.999 * LEAST, "{layout:?} {name}, cell {cell}: {narrowest}");
                }
            });
        }
    }
}
