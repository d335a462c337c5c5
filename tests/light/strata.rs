//! The texel map and its strata: they tile the faces, follow the light, and have the same bytes for any number of threads.

use super::built::{Built, Random};
use super::lookup::{Map, double};
use super::maps::{descriptions, layouts, rough, sky, suns};
use wis::light::chart::Layout;
use wis::light::map::solid_angle;
use wis::light::plan::{Description, Filter};
use wis::light::radiance::{decode, encode};
use wis::light::strata::{StandIn, rectangle, unit};
use wis::light::tables::Light;

/// Rectangles of strata, and their densities at their beginnings.
fn rectangles(light: &Light<'_>) -> Vec<([f32; 4], [f32; 2])> {
    light.strata.iter().map(|&stratum| rectangle(stratum, unit(&light.chart))).collect()
}

/// The face of a stratum.
fn face(light: &Light<'_>, [_, y, _, height]: [f32; 4]) -> u32 {
    ((y + 0.5 * height) / light.chart.axes[1].length) as u32
}

/// Strata lie in faces, and the nodes of a fine grid of places lie in one stratum each: there is no gap and no overlap.
fn tiles(name: &str, light: &Light<'_>) {
    let [length, height] = light.chart.axes.map(|axis| axis.length);
    let mut area = 0.0;
    let all = rectangles(light);
    for &([x, y, width, rows], slopes) in &all {
        assert!(slopes.iter().all(|first| (0.25..=1.75).contains(first)), "{name}: {slopes:?}");
        let top = face(light, [x, y, width, rows]) as f32 * height;
        assert!(width > 0.0 && rows > 0.0 && x >= 0.0 && x + width <= length, "{name}");
        assert!(y >= top && y + rows <= top + height, "{name}: no stratum spans two faces");
        area += f64::from(width) * f64::from(rows);
    }
    assert_eq!(area, f64::from(length) * f64::from(height) * f64::from(light.chart.faces()), "{name}");
    let mut random = Random(91);
    for _ in 0..200 {
        let place = [random.unit() * length, random.unit() * height * light.chart.faces() as f32];
        let holds = |(s, _): &&([f32; 4], [f32; 2])| (0..2).all(|k| s[k] <= place[k] && place[k] < s[k] + s[k + 2]);
        assert_eq!(all.iter().filter(holds).count(), 1, "{name} at {place:?}");
    }
}

/// The mean of p^ / p over the strata's density p, of its square, and the largest p^ / p, by places in each stratum.
fn follows(light: &Light<'_>, of: &StandIn) -> [f64; 3] {
    const SIDE: usize = 12;
    let count = light.strata.len() as f64;
    let (mut mean, mut second, mut largest) = (0.0, 0.0, 0.0f64);
    for (stratum, slopes) in rectangles(light) {
        let [x, y, width, rows] = stratum;
        let face = face(light, stratum);
        let top = face as f32 * light.chart.axes[1].length;
        for k in 0..SIDE * SIDE {
            let at = |k: usize| (k as f32 + 0.5) / SIDE as f32;
            let place = [x + width * at(k % SIDE), y - top + rows * at(k / SIDE)];
            let radiance = light.radiance(face, place);
            let stands_in = f64::from((radiance - of.mean).max(0.25 * radiance)) * f64::from(of.inverse_power);
            let ratio =
                stands_in * f64::from(solid_angle(&light.chart, place)) * count * f64::from(width) * f64::from(rows);
            let density = |k: usize, t: f32| f64::from(slopes[k] + 2.0 * (1.0 - slopes[k]) * t);
            let density = density(0, at(k % SIDE)) * density(1, at(k / SIDE));
            mean += ratio;
            second += ratio * ratio / density;
            largest = largest.max(ratio / density);
        }
    }
    [mean, second].map(|sum| sum / (count * (SIDE * SIDE) as f64)).into_iter().chain([largest]).collect::<Vec<_>>()[..]
        .try_into()
        .unwrap()
}

/// Builds a light, and holds its strata against a bound of the second moment and of the largest ratio.
fn test(name: &str, map: &Map, of: &Description, [bound, worst]: [f64; 2]) {
    let built = Built::new(map, of);
    let environment = built.environment();
    let light = environment.light();
    tiles(name, &light);
    let [mean, second, largest] = follows(&light, &environment.header().stand_in);
    let stated = f64::from(environment.header().stand_in.second_moment);
    println!("{name}: {} strata, {mean:.4} {second:.4} (stated {stated:.4}), largest {largest:.1}", light.strata.len());
    assert!((mean - 1.0).abs() < 0.01, "{name}: p^ integrates to {mean}");
    assert!((second - stated).abs() < 0.02 * stated, "{name}: {second} is stated as {stated}");
    assert!(stated <= bound && largest <= worst, "{name}: {stated} {largest}");
}

#[test]
fn a_smooth_sky_has_few_strata() {
    for (layout, width, height) in layouts(64) {
        let map = Map::of_directions(layout, width, height, sky);
        for of in descriptions(&map) {
            test(&format!("sky, {of:?}"), &map, &of, [1.03, 4.0]);
            assert!(Built::new(&map, &of).environment().light().strata.len() <= 4096);
        }
    }
}

/// Suns of 1 and 4 texels at the horizon, the poles, the seam and elsewhere have strata inside themselves.
#[test]
fn suns_are_followed() {
    for (name, mut map) in suns(256, 128) {
        for brightness in [1e2, 1e4, 1e6] {
            map.texels.iter_mut().filter(|texel| **texel >= 50.0).for_each(|texel| *texel = brightness);
            test(&format!("{name}, {brightness}"), &map, &map.description(Filter::Bilinear), [1.03, 30.0]);
        }
    }
}

#[test]
fn hard_maps_are_followed() {
    let lamp = |x: u32, y: u32| x % 32 == 5 && y % 32 == 7;
    let lamps = Map::latlong(512, 256, |x, y| if lamp(x, y) { 300.0 } else { 0.05 });
    test("lamps of one texel", &lamps, &lamps.description(Filter::Bilinear), [1.03, 15.0]);
    let checkers = Map::latlong(64, 32, |x, y| ((x ^ y) & 1) as f32);
    test("a checkerboard", &checkers, &checkers.description(Filter::Bilinear), [1.3, 8.0]);
    for (width, height) in [(1, 1), (2, 1), (33, 17), (1, 9)] {
        let map = Map::latlong(width, height, |x, y| 0.3 + (x * y % 7 + x) as f32);
        for of in descriptions(&map) {
            test(&format!("{width} x {height}"), &map, &of, [1.2, 12.0]);
        }
    }
}

#[test]
fn a_black_map_has_strata_everywhere() {
    for (layout, width, height) in layouts(32) {
        let map = Map::new(layout, width, height, |_, _| 0.0);
        let built = Built::new(&map, &map.description(Filter::Bilinear));
        let (light, of) = (built.environment().light(), built.environment().header().stand_in);
        assert_eq!((of.inverse_power, of.mean, light.strata.len()), (0.0, 0.0, 256));
        tiles("black", &light);
    }
}

/// The look-up is the map's, but for the rounding of words; also of a compensated light.
#[test]
fn the_texel_map_is_the_light() {
    let mut random = Random(92);
    for (layout, width, height) in layouts(48) {
        let map = Map::of_directions(layout, width, height, rough);
        for of in descriptions(&map) {
            for compensated in [false, true] {
                let built = Built::new(&map, &Description { compensated, ..of });
                let light = built.environment().light();
                for _ in 0..500 {
                    let place = light.chart.axes.map(|axis| axis.length * random.unit());
                    let face = (random.bits() % u64::from(light.chart.faces())) as u32;
                    let direction = light.chart.direction(face as f32, place);
                    let expected = map.radiance(&of, built.least(), double(direction));
                    let found = f64::from(light.radiance(face, place));
                    assert!((found / expected - 1.0).abs() < 0.01, "{of:?} at {place:?}: {found} {expected}");
                }
            }
        }
    }
}

/// With a budget the map deviates by as much, and takes less.
#[test]
fn a_budget_coarsens_the_texel_map() {
    let map = Map::of_directions(Layout::LatLong, 256, 128, sky);
    for filter in [Filter::Bilinear, Filter::Nearest] {
        let exact = Built::new(&map, &map.description(filter));
        let coarse = Built::new(&map, &Description { budget: 0.05, ..map.description(filter) });
        let [a, b] = [&exact, &coarse].map(|built| built.environment().light());
        assert!(4 * b.texels.len() < a.texels.len(), "{} {}", a.texels.len(), b.texels.len());
        let (mut sum, mut all) = (0.0, 0.0);
        for k in 0..20_000 {
            let place = [256.0 * ((k as f32 * 0.618_034) % 1.0), 128.0 * ((k as f32 + 0.5) / 20_000.0)];
            let [expected, found] = [a.radiance(0, place), b.radiance(0, place)].map(f64::from);
            let weight = f64::from(solid_angle(&a.chart, place));
            sum += weight * found * (expected / found - 1.0).powi(2);
            all += weight * expected;
        }
        assert!((sum / all).sqrt() <= 0.052, "{filter:?}: {}", (sum / all).sqrt());
    }
}

#[test]
fn words_are_the_nearest() {
    for bits in (0..0x7f80_0000u32).step_by(99_991) {
        let light = f32::from_bits(bits);
        let word = encode(light);
        assert!(decode(word).is_finite() && (light == 0.0 || decode(word) > 0.0));
        let off = |word: u16| (f64::from(decode(word)) - f64::from(light)).abs();
        assert!(word < 2 || word == 0x7f7f || off(word) <= off(word - 1).min(off(word + 1)), "{light}");
    }
}
