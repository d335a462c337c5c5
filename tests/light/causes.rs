//! No wrong cause is named: not under a sun, which any frame that moves it to plain sky seems to explain, nor for a renderer that
//! blurs, bends or clamps what it looks up. And the right one still is.

use super::built::{Built, Random};
use super::compare::{look, other, seen, times};
use super::lookup::{Map, V3, direction, place_of, unit};
use super::maps::{rough, sky};
use std::f64::consts::PI;
use wis::light::chart::Layout;
use wis::light::compare::{Cause, Comparison};
use wis::light::plan::{Description, Filter};

/// What a renderer sees in a direction, of the radiance that the light has.
type Mistake = Box<dyn Fn(&dyn Fn(V3) -> f64, V3) -> f64>;

fn about_z(degrees: f64) -> [f32; 9] {
    let (sin, cos) = degrees.to_radians().sin_cos();
    [cos as f32, -sin as f32, 0.0, sin as f32, cos as f32, 0.0, 0.0, 0.0, 1.0]
}

fn transposed([a, b, c, d, e, f, g, h, i]: [f32; 9]) -> [f32; 9] {
    [a, d, g, b, e, h, c, f, i]
}

/// The mean over a disc of a radius in degrees.
fn blurred(look: &dyn Fn(V3) -> f64, d: V3, radius: f64) -> f64 {
    const TAPS: usize = 61;
    let x = unit(if d[2].abs() < 0.9 { [-d[1], d[0], 0.0] } else { [0.0, -d[2], d[1]] });
    let y = [d[1] * x[2] - d[2] * x[1], d[2] * x[0] - d[0] * x[2], d[0] * x[1] - d[1] * x[0]];
    let tap = |k: usize| {
        let r = radius.to_radians() * ((k as f64 + 0.5) / TAPS as f64).sqrt();
        let (sin, cos) = (k as f64 * PI * (3.0 - 5f64.sqrt())).sin_cos();
        look(unit([0, 1, 2].map(|i| d[i] + r.tan() * (cos * x[i] + sin * y[i]))))
    };
    (0..TAPS).map(tap).sum::<f64>() / TAPS as f64
}

/// The direction whose place in the map is so many texels on.
fn moved(map: &Map, d: V3, [columns, rows]: [f64; 2]) -> V3 {
    let (_, [u, v]) = place_of(Layout::LatLong, d);
    let (u, v) = (u + columns / f64::from(map.width), v + rows / f64::from(map.height));
    direction(Layout::LatLong, 0, [u.rem_euclid(1.0), v.clamp(0.0, 1.0)])
}

/// Mistakes that have no name.
fn nameless(map: &Map) -> Vec<(String, Mistake)> {
    let mut all: Vec<(String, Mistake)> = Vec::new();
    for degrees in (0..26).map(|k| 7.0 + 13.4 * f64::from(k)) {
        let turn = about_z(degrees);
        all.push((format!("turned by {degrees:.1}"), Box::new(move |look, d| look(times(&turn, d)))));
    }
    for seed in 0..8 {
        let turn = Random(seed).frame().to_array();
        all.push((format!("frame {seed}"), Box::new(move |look, d| look(times(&turn, d)))));
    }
    for degrees in [2.0, 4.0, 8.0] {
        all.push((format!("blurred by {degrees}"), Box::new(move |look, d| blurred(look, d, degrees))));
    }
    for power in [1.0 / 2.2, 2.2] {
        all.push((format!("to the power of {power:.2}"), Box::new(move |look, d| look(d).powf(power))));
    }
    all.push(("Reinhard's curve".into(), Box::new(|look, d| look(d) / (1.0 + look(d)))));
    all.push(("haze".into(), Box::new(|look, d| 1.0 + look(d))));
    all.push(("no light".into(), Box::new(|_, _| 1.0)));
    all.push(("dark ground".into(), Box::new(|look, d| if d[2] < 0.0 { 0.1 } else { look(d) })));
    for by in [[1.0, 0.0], [1.5, 0.5], [0.0, 3.0]] {
        let map = map.clone();
        all.push((format!("moved by {by:?} texels"), Box::new(move |look, d| look(moved(&map, d, by)))));
    }
    all
}

const FRAMES: [(Cause, [f32; 9]); 5] = [
    (Cause::Axes, [1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0]),
    (Cause::Mirrored, [1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0]),
    (Cause::Turned, [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
    (Cause::Turned, [-1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0]),
    (Cause::UpsideDown, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0]),
];

/// A map of 256 x 128 with a square of bright texels.
fn with_sun(of: impl Fn(V3) -> f64, [u, v]: [f64; 2], texels: u32, radiance: f32) -> Map {
    let mut map = Map::of_directions(Layout::LatLong, 256, 128, of);
    let (x, y) = ((u * 256.0) as u32, (v * 128.0) as u32);
    for (i, j) in (0..texels).flat_map(|i| (0..texels).map(move |j| (i, j))) {
        map.texels[((y + j) * 256 + x + i) as usize] = radiance;
    }
    map
}

fn lamps(count: u64) -> Map {
    let mut random = Random(count);
    let mut map = Map::latlong(256, 128, |_, _| 1.0);
    for _ in 0..count {
        let (x, y) = ((random.f64() * 254.0) as usize, 6 + (random.f64() * 110.0) as usize);
        let radiance = 500.0 * (0.3 + random.unit());
        for place in [0, 1, 256, 257] {
            map.texels[y * 256 + x + place] = radiance;
        }
    }
    map
}

fn maps() -> Vec<(&'static str, Map)> {
    let tilted = |d: V3| 1.0 + 0.2 * (0.6 * d[0] + 0.3 * d[1] + 0.5 * d[2]);
    vec![
        ("sun of four texels", with_sun(|_| 1.0, [0.35, 0.31], 2, 3000.0)),
        ("low sun", with_sun(|_| 1.0, [0.81, 0.49], 2, 3000.0)),
        ("sun of one texel", with_sun(|_| 1.0, [0.35, 0.31], 1, 3000.0)),
        ("high sun of one texel", with_sun(|_| 1.0, [0.12, 0.04], 1, 3000.0)),
        ("sun and a tilted sky", with_sun(tilted, [0.27, 0.2], 2, 3000.0)),
        ("sun and sky", with_sun(sky, [0.27, 0.2], 2, 3000.0)),
        ("sun and a rough sky", with_sun(rough, [0.27, 0.2], 2, 3000.0)),
        ("three lamps", lamps(3)),
        ("sixty lamps", lamps(60)),
    ]
}

/// Where no cause is named: nothing explains the difference, or there is hardly one.
fn unnamed(found: &Comparison) -> bool {
    found.cause == Cause::Other || matches!(found.cause, Cause::None | Cause::Scaled) && found.error <= 0.02
}

#[test]
fn no_wrong_cause_is_named() {
    for (name, map) in maps() {
        for filter in [Filter::Bilinear, Filter::Nearest] {
            let built = Built::new(&map, &map.description(filter));
            for (mistake, sees) in nameless(&map) {
                let found = seen(&built, |d| sees(&|d| look(&map, filter, false, 0.0, d), d));
                assert!(unnamed(&found), "{name}, {filter:?}, {mistake}: {found:?}");
                assert_eq!(found.limit, 0.0);
            }
        }
    }
}

#[test]
fn the_right_cause_is_named_under_suns_and_lamps() {
    for (name, map) in maps() {
        for filter in [Filter::Bilinear, Filter::Nearest] {
            let built = Built::new(&map, &map.description(filter));
            for (cause, matrix) in FRAMES {
                // Also with another mistake.
                for seen_by in [filter, other(filter)] {
                    let found = seen(&built, |d| 2.5 * look(&map, seen_by, false, 0.0, times(&matrix, d)));
                    if unnamed(&found) && found.error <= 0.02 {
                        continue;
                    }
                    assert_eq!(found.cause, cause, "{name}, {filter:?}, {seen_by:?}: {found:?}");
                    assert_eq!(found.world_from_map, transposed(matrix), "{name}, {filter:?}, {seen_by:?}: {found:?}");
                }
            }
            let found = seen(&built, |d| look(&map, other(filter), false, 0.0, d));
            assert!(found.cause == Cause::Filter || found.error <= 0.02, "{name}, {filter:?}: {found:?}");
            for shift in [[0.5, 0.0], [-0.5, 0.5]] {
                let found = seen(&built, |d| look(&map, filter, false, 0.0, moved(&map, d, shift)));
                assert!(
                    found.cause == Cause::Shifted || found.error <= 0.02,
                    "{name}, {filter:?} {shift:?}: {found:?}"
                );
            }
        }
    }
}

/// A clamp is named with its value where lights of several radiances are clamped; nowhere is another cause named.
#[test]
fn a_clamp_is_named_with_its_value() {
    let mut named = 0;
    for (name, map) in maps() {
        let built = Built::new(&map, &map.description(Filter::Bilinear));
        for factor in [0.3, 1.5, 4.5, 10.0, 40.0, 300.0] {
            let limit = factor * built.environment().header().mean;
            let found = seen(&built, |d| look(&map, Filter::Bilinear, false, 0.0, d).min(limit));
            if found.cause == Cause::Clamped {
                assert!((f64::from(found.limit) - limit).abs() < 1e-3 * limit, "{name}, {limit}: {found:?}");
                named += 1;
            } else {
                assert!(unnamed(&found), "{name}, {limit}: {found:?}");
            }
        }
    }
    println!("clamps named: {named}");
    assert!(named >= 20, "{named}");
}

/// The error of the tables' budget is none that a cause must mend.
#[test]
fn a_light_of_a_budget_names_frames() {
    let map = with_sun(|d| 0.5 + 0.4 * d[2], [0.27, 0.2], 2, 3000.0);
    let built = Built::new(&map, &Description { budget: 0.05, ..map.description(Filter::Bilinear) });
    for (cause, matrix) in FRAMES {
        let found = seen(&built, |d| look(&map, Filter::Bilinear, false, 0.0, times(&matrix, d)));
        assert_eq!((found.cause, found.world_from_map), (cause, transposed(matrix)), "{found:?}");
    }
}
