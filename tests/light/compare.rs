//! Each mistake that stays silent in pictures is found and named, and what is no mistake is not.

use super::built::{Built, Random};
use super::lookup::{Map, V3, direction, double, place_of};
use super::maps::{layouts, real, rough, sky};
use wis::light::chart::Layout;
use wis::light::compare::{Cause, Comparison, compare};
use wis::light::plan::{Description, Filter};

const IDENTITY: [f32; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// A renderer that sees this luminance.
pub fn seen(built: &Built, mut radiance: impl FnMut(V3) -> f64) -> Comparison {
    let mut all = |wi: &[[f32; 3]], rgb: &mut [[f32; 3]]| {
        for (out, wi) in rgb.iter_mut().zip(wi) {
            *out = [radiance(double(*wi)) as f32; 3];
        }
        true
    };
    compare(&built.environment(), &mut all).expect("finite and not negative")
}

/// The luminance that a renderer finds in a map.
pub fn look(map: &Map, filter: Filter, rows_at_poles: bool, least: f64, d: V3) -> f64 {
    map.radiance(&Description { rows_at_poles, ..map.description(filter) }, least, d)
}

/// A row-major matrix times a direction.
pub fn times(m: &[f32; 9], d: V3) -> V3 {
    [0, 1, 2].map(|k| (0..3).map(|j| f64::from(m[3 * k + j]) * d[j]).sum())
}

/// Renderers that look the map up with these components of a direction, and what is to be found.
const FRAMES: [(Cause, [f32; 9]); 8] = [
    (Cause::Axes, [1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0]),
    (Cause::Axes, [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
    (Cause::Mirrored, [1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0]),
    (Cause::Mirrored, [0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
    (Cause::Turned, [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
    (Cause::Turned, [-1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0]),
    (Cause::UpsideDown, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0]),
    (Cause::UpsideDown, [1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0]),
];

fn rough_map(layout: Layout, side: u32) -> Map {
    let (_, width, height) = *layouts(side).iter().find(|(of, ..)| *of == layout).expect("a layout");
    Map::of_directions(layout, width, height, rough)
}

pub fn other(filter: Filter) -> Filter {
    if filter == Filter::Bilinear { Filter::Nearest } else { Filter::Bilinear }
}

#[test]
fn the_light_that_was_built_is_no_mistake() {
    for layout in [Layout::LatLong, Layout::Cube, Layout::Octahedral] {
        let map = rough_map(layout, 64);
        for filter in [Filter::Bilinear, Filter::Nearest] {
            for (compensated, budget) in [(false, 0.0), (true, 0.0), (false, 0.05)] {
                let of = Description { compensated, budget, ..map.description(filter) };
                let built = Built::new(&map, &of);
                let found = seen(&built, |d| look(&map, filter, false, built.least(), d));
                assert_eq!(found.cause, Cause::None, "{layout:?} {filter:?} {compensated} {budget}: {found:?}");
                assert_eq!(found.world_from_map, IDENTITY);
                assert_eq!((found.filter, found.rows_at_poles, found.shift), (filter, false, [0.0; 2]));
            }
        }
    }
}

#[test]
fn another_frame_is_found_with_the_matrix_that_mends_it() {
    for layout in [Layout::LatLong, Layout::Cube, Layout::Octahedral] {
        let map = rough_map(layout, 64);
        let built = Built::new(&map, &map.description(Filter::Bilinear));
        for (cause, matrix) in FRAMES {
            let found = seen(&built, |d| look(&map, Filter::Bilinear, false, 0.0, times(&matrix, d)));
            assert_eq!(found.cause, cause, "{layout:?}: {found:?}");
            assert!(found.explained < 0.002 && found.error > 0.05, "{found:?}");
            // map = matrix world, so the matrix that mends it is the transposed.
            let [a, b, c, d, e, f, g, h, i] = matrix;
            assert_eq!(found.world_from_map, [a, d, g, b, e, h, c, f, i]);
        }
    }
}

/// A renderer that does not apply the rotation of its light, or applies the inverse.
#[test]
fn a_rotation_that_is_not_applied_is_found() {
    let map = rough_map(Layout::LatLong, 64);
    let mut random = Random(7);
    let built = Built::new(&map, &map.description(Filter::Bilinear));
    for _ in 0..4 {
        let frame = random.frame();
        let columns = frame.to_array();
        let turned = built.turned(&frame);
        // The nine numbers column by column are the rows of map_from_world.
        let found = seen(&turned, |d| look(&map, Filter::Bilinear, false, 0.0, times(&columns, d)));
        assert_eq!(found.cause, Cause::None, "{found:?}");
        let found = seen(&turned, |d| look(&map, Filter::Bilinear, false, 0.0, d));
        assert_eq!((found.cause, found.world_from_map), (Cause::Frame, IDENTITY), "{found:?}");
        let [a, b, c, d, e, f, g, h, i] = columns;
        let inverse = [a, d, g, b, e, h, c, f, i];
        let found = seen(&turned, |d| look(&map, Filter::Bilinear, false, 0.0, times(&inverse, d)));
        assert_eq!((found.cause, found.world_from_map), (Cause::Frame, columns), "{found:?}");
    }
}

#[test]
fn a_factor_is_measured() {
    let map = rough_map(Layout::LatLong, 64);
    let built = Built::new(&map, &map.description(Filter::Bilinear));
    for factor in [0.0, 1e-6, 0.5, 0.97, 1.05, std::f64::consts::PI, 1e6] {
        let found = seen(&built, |d| factor * look(&map, Filter::Bilinear, false, 0.0, d));
        assert_eq!(found.cause, Cause::Scaled, "{found:?}");
        assert!((f64::from(found.scale) - factor).abs() <= 0.005 * factor, "{factor}: {found:?}");
    }
    let found = seen(&built, |d| look(&map, Filter::Bilinear, false, 0.0, d));
    assert_eq!(found.cause, Cause::None, "{found:?}");
}

#[test]
fn the_wrong_filter_is_found() {
    for layout in [Layout::LatLong, Layout::Cube, Layout::Octahedral] {
        let map = rough_map(layout, 64);
        for filter in [Filter::Bilinear, Filter::Nearest] {
            let built = Built::new(&map, &map.description(filter));
            let found = seen(&built, |d| look(&map, other(filter), false, 0.0, d));
            assert_eq!((found.cause, found.filter), (Cause::Filter, other(filter)), "{layout:?}: {found:?}");
        }
    }
}

#[test]
fn half_a_texel_is_found() {
    for filter in [Filter::Bilinear, Filter::Nearest] {
        let map = rough_map(Layout::LatLong, 64);
        let built = Built::new(&map, &map.description(filter));
        for shift in [[0.5, 0.5], [0.5, 0.0], [0.0, -0.5], [-0.5, 0.5]] {
            let found = seen(&built, |d| {
                let (_, [u, v]) = place_of(Layout::LatLong, d);
                let place = [u + shift[0] / 128.0, (v + shift[1] / 64.0).clamp(0.0, 1.0)];
                look(&map, filter, false, 0.0, direction(Layout::LatLong, 0, place))
            });
            assert_eq!((found.cause, found.shift.map(f64::from)), (Cause::Shifted, shift), "{filter:?}: {found:?}");
        }
    }
}

#[test]
fn rows_at_the_poles_are_found() {
    let map = rough_map(Layout::LatLong, 64);
    for filter in [Filter::Bilinear, Filter::Nearest] {
        for at_poles in [false, true] {
            let built = Built::new(&map, &Description { rows_at_poles: at_poles, ..map.description(filter) });
            let found = seen(&built, |d| look(&map, filter, !at_poles, 0.0, d));
            assert_eq!((found.cause, found.rows_at_poles), (Cause::Rows, !at_poles), "{filter:?}: {found:?}");
        }
    }
}

#[test]
fn another_map_or_a_curve_is_something_else() {
    let map = rough_map(Layout::LatLong, 64);
    let built = Built::new(&map, &map.description(Filter::Bilinear));
    let other = Map::of_directions(Layout::LatLong, 128, 64, |d| 1.0 + (9.0 * d[0] - 4.0 * d[1]).sin());
    for found in [
        seen(&built, |d| look(&other, Filter::Bilinear, false, 0.0, d)),
        seen(&built, |d| look(&map, Filter::Bilinear, false, 0.0, d).powf(1.0 / 2.2)),
    ] {
        assert_eq!(found.cause, Cause::Other, "{found:?}");
        assert!(found.error > 0.1, "{found:?}");
    }
}

/// What a map does not show is no mistake, and black is no error.
#[test]
fn symmetric_and_black_maps() {
    let zonal = Map::of_directions(Layout::LatLong, 128, 64, |d| 1.0 + d[2]);
    let built = Built::new(&zonal, &zonal.description(Filter::Bilinear));
    for (cause, matrix) in FRAMES {
        let found = seen(&built, |d| look(&zonal, Filter::Bilinear, false, 0.0, times(&matrix, d)));
        let shows = matches!(cause, Cause::Axes | Cause::UpsideDown);
        assert_eq!(found.cause, if shows { cause } else { Cause::None }, "{found:?}");
    }
    let black = Map::latlong(64, 32, |_, _| 0.0);
    let built = Built::new(&black, &black.description(Filter::Bilinear));
    let found = seen(&built, |_| 0.0);
    assert_eq!((found.cause, found.error), (Cause::None, 0.0), "{found:?}");
    assert_eq!(seen(&built, |_| 1.0).cause, Cause::Other);
}

#[test]
fn bad_radiance_is_blamed_on_its_direction() {
    let map = Map::of_directions(Layout::LatLong, 64, 32, sky);
    let built = Built::new(&map, &map.description(Filter::Bilinear));
    for bad in [f32::NAN, f32::INFINITY, -1.0] {
        let mut called = 0;
        let mut all = |_: &[[f32; 3]], rgb: &mut [[f32; 3]]| {
            called += 1;
            rgb.fill([1.0; 3]);
            if called == 3 {
                rgb[5][1] = bad;
            }
            true
        };
        assert_eq!(compare(&built.environment(), &mut all), Err(2 * 64 + 5));
    }
    assert_eq!(compare(&built.environment(), &mut |_, _| false), Err(0));
}

/// On photographs each mistake is found, or its error is below what tables leave.
#[test]
fn mistakes_on_real_maps() {
    for (name, map) in real() {
        let built = Built::new(&map, &map.description(Filter::Bilinear));
        let clean = seen(&built, |d| look(&map, Filter::Bilinear, false, built.least(), d));
        println!("{name}: none {:.4} {:?}", clean.error, clean.cause);
        assert_eq!(clean.cause, Cause::None, "{name}: {clean:?}");
        for (cause, matrix) in FRAMES {
            let found = seen(&built, |d| look(&map, Filter::Bilinear, false, built.least(), times(&matrix, d)));
            println!("{name}: {cause:?} {:.4} -> {:.4} {:?}", found.error, found.explained, found.cause);
            assert_eq!(found.cause, cause, "{name}: {found:?}");
        }
        let mut look_ups =
            vec![(Cause::Filter, seen(&built, |d| look(&map, Filter::Nearest, false, built.least(), d)))];
        if map.layout == Layout::LatLong {
            look_ups.push((Cause::Rows, seen(&built, |d| look(&map, Filter::Bilinear, true, built.least(), d))));
            let shifted = |d| {
                let (_, [u, v]) = place_of(Layout::LatLong, d);
                let place = [u + 0.5 / f64::from(map.width), (v + 0.5 / f64::from(map.height)).min(1.0)];
                look(&map, Filter::Bilinear, false, built.least(), direction(Layout::LatLong, 0, place))
            };
            look_ups.push((Cause::Shifted, seen(&built, shifted)));
        }
        for (cause, found) in look_ups {
            println!("{name}: {cause:?} {:.4} -> {:.4} {:?}", found.error, found.explained, found.cause);
            assert!(found.cause == cause || found.error < 0.02, "{name}: {cause:?} {found:?}");
        }
    }
}
