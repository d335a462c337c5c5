//! L / pdf: constant up to the quantisation of the tables, for what a client of each kind looks up.

use super::built::{Built, Random};
use super::lookup::{Map, double, place_of};
use super::maps::{descriptions, layouts, real, rough, suns};
use std::f64::consts::{PI, TAU};
use wis::light::chart::Layout;
use wis::light::plan::{Description, Filter};
use wis::sphere::Frame;

const SAMPLES: usize = 1 << 16;

/// The relative standard deviation of L / pdf over samples, its maximum over its mean, and the mean over the power.
pub fn weights(map: &Map, built: &Built, radiance: impl Fn([f32; 3]) -> f64) -> [f64; 3] {
    let power = built.environment().header().power;
    let mut random = Random(21);
    let (mut sum, mut squares, mut largest) = (0.0, 0.0, 0.0f64);
    for _ in 0..SAMPLES {
        let (wi, pdf) = built.sample(&Frame::IDENTITY, [random.unit(), random.unit()]);
        let w = radiance(wi) / (f64::from(pdf) * power);
        assert!(w.is_finite(), "{:?} {wi:?} {pdf}", map.layout);
        sum += w;
        squares += w * w;
        largest = largest.max(w);
    }
    let mean = sum / SAMPLES as f64;
    let variance = (squares / SAMPLES as f64 - mean * mean).max(0.0);
    [variance.sqrt() / mean, largest / mean, mean]
}

fn test(name: &str, map: &Map, of: &Description) {
    let built = Built::new(map, of);
    let least = built.least();
    let [deviation, largest, mean] = weights(map, &built, |wi| map.radiance(of, least, double(wi)));
    println!("{name} {:?} {:?}: {deviation:.5} {largest:.4} {mean:.5}", of.layout, of.filter);
    assert!(deviation <= 0.01, "{name} {of:?}: the relative standard deviation of L / pdf is {deviation}");
    assert!(largest <= 1.05, "{name} {of:?}: the largest L / pdf is {largest}");
    // The power is that of what the client looks up.
    assert!((mean - 1.0).abs() < 2e-3, "{name} {of:?}: the mean of L / (pdf power) is {mean}");
}

#[test]
fn own_maps() {
    for (layout, width, height) in layouts(64) {
        let map = Map::of_directions(layout, width, height, rough);
        for of in descriptions(&map) {
            test("rough", &map, &of);
        }
    }
}

#[test]
fn unclipped_suns() {
    for (name, map) in suns(256, 128) {
        for of in descriptions(&map) {
            test(&name, &map, &of);
        }
    }
}

/// Ground of a twentieth of the sky: what stands beside the sun is 2e6 times darker.
#[test]
fn unclipped_suns_over_dark_ground() {
    for ground in [1.0, 0.05] {
        // In the middle of a block's rows, and at its end.
        for (row, sun) in [(64, 1e5), (70, 1e5), (79, 5e5)] {
            let is_sun = |x, y| (x, y) == (100, row) || (x, y) == (230, row - 3);
            let map = Map::latlong(256, 128, |x, y| {
                if is_sun(x, y) {
                    sun
                } else if y < 60 {
                    1.0
                } else {
                    ground
                }
            });
            for of in descriptions(&map) {
                test(&format!("sun of {sun} in row {row} over {ground}"), &map, &of);
            }
        }
    }
}

#[test]
fn cubes_with_unclipped_suns() {
    for side in [64, 96] {
        // In the middle of a face, at an edge, at a corner.
        for (face, x, y) in [(4, side / 2, side / 3), (0, 0, side / 2), (3, side - 1, 0)] {
            let mut map = Map::of_directions(Layout::Cube, side, 6 * side, rough);
            map.texels[((face * side + y) * side + x) as usize] = 1e5;
            for of in descriptions(&map) {
                test("sun", &map, &of);
            }
        }
    }
}

#[test]
fn small_maps_are_refined() {
    let mut random = Random(23);
    for (width, height) in [(1, 1), (2, 1), (5, 3), (16, 8), (33, 20), (64, 33)] {
        let texels: Vec<f32> = (0..width * height).map(|_| random.unit()).collect();
        let map = Map::latlong(width, height, |x, y| texels[(y * width + x) as usize]);
        for of in descriptions(&map) {
            test("random", &map, &of);
        }
    }
}

#[test]
fn real_maps() {
    for (name, map) in real() {
        for filter in [Filter::Nearest, Filter::Bilinear] {
            test(&name, &map, &map.description(filter));
        }
    }
}

/// A client that computes in f32 looks up the very texel that was sampled.
#[test]
fn a_nearest_client_in_single_precision_finds_the_sampled_texel() {
    for (name, map) in suns(1024, 512) {
        let of = map.description(Filter::Nearest);
        let built = Built::new(&map, &of);
        let least = built.least();
        let [_, largest, _] = weights(&map, &built, |wi| {
            let [x, y, z] = wi;
            let phi = y.atan2(x);
            let phi = if phi < 0.0 { phi + TAU as f32 } else { phi };
            let theta = x.hypot(y).atan2(z);
            let column = (phi * (1.0 / TAU as f32) * map.width as f32) as u32;
            let row = (theta * (1.0 / PI as f32) * map.height as f32) as u32;
            let texel = row.min(map.height - 1) * map.width + column.min(map.width - 1);
            f64::from(map.texels[texel as usize]).max(least)
        });
        assert!(largest <= 1.05, "{name}: {largest}");
    }
}

#[test]
fn samples_of_a_nearest_light_keep_off_the_borders() {
    /// Of the length of an axis; the light promises 2^-22, less the rounding of the directions themselves.
    const MARGIN: f64 = 1.0 / (1 << 23) as f64;
    for (layout, width, height) in layouts(64) {
        let map = Map::of_directions(layout, width, height, rough);
        let built = Built::new(&map, &map.description(Filter::Nearest));
        let mut random = Random(27);
        let side = height / super::lookup::faces(layout);
        for _ in 0..SAMPLES {
            let (wi, _) = built.sample(&Frame::IDENTITY, [random.unit(), random.unit()]);
            let (_, place) = place_of(layout, double(wi));
            for (at, texels) in place.into_iter().zip([width, side]) {
                let texel = at * f64::from(texels);
                let from_border = (texel - texel.round()).abs() / f64::from(texels);
                assert!(from_border > MARGIN, "{layout:?} {wi:?}: {from_border:e}");
            }
        }
    }
}
