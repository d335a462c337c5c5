//! Samples against the density that pdf answers, by Pearson's chi-square test, and the density's integral.

use super::built::{Built, Random};
use super::lookup::{Map, direction, faces, place_of, single};
use super::maps::{descriptions, layouts, rough};
use super::statistics::{LARGEST_MISSED, chi_square, chi_square_smallest_fault, corrected};
use std::f64::consts::PI;
use wis::light::chart::Layout;
use wis::light::plan::Description;
use wis::sphere::Frame;

/// Texels along each side of a bin.
const BIN: u32 = 2;
const SAMPLES: usize = 1 << 20;
/// Layouts, filters and rows at poles, below.
const TESTS: usize = 8;

/// The solid angle of a unit of place.
fn solid_angle(layout: Layout, [u, v]: [f64; 2]) -> f64 {
    match layout {
        Layout::LatLong => 2.0 * PI * PI * (PI * v).sin(),
        Layout::Cube => {
            let (s, t) = (2.0 * u - 1.0, 2.0 * v - 1.0);
            4.0 / (1.0 + s * s + t * t).powf(1.5)
        }
        Layout::Octahedral => 4.0 * PI,
    }
}

/// The probability of a rectangle of places, by two Gauss points along each axis of each half texel: borders of patches lie at
/// halves of texels, also where rows lie at the poles.
fn probability(built: &Built, map: &Map, face: u32, from: [f64; 2], size: [f64; 2]) -> f64 {
    const GAUSS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];
    let steps = 2 * BIN;
    let mut sum = 0.0;
    for (i, j) in (0..steps).flat_map(|j| (0..steps).map(move |i| (i, j))) {
        for (g, h) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let at = |k: usize, i: u32, g: usize| from[k] + size[k] * (f64::from(i) + GAUSS[g]) / f64::from(steps);
            let place = [at(0, i, g), at(1, j, h)];
            let d = direction(map.layout, face, place);
            sum += f64::from(built.pdf(single(d))) * solid_angle(map.layout, place);
        }
    }
    sum * size[0] * size[1] / (4.0 * f64::from(steps * steps))
}

fn test(map: &Map, of: &Description) {
    let built = Built::new(map, of);
    let side = map.height / faces(map.layout);
    // With rows at the poles there is one row of texels less from pole to pole.
    let spans = side - u32::from(of.rows_at_poles);
    let (columns, rows) = (map.width / BIN, spans.div_ceil(BIN));
    let edges = |bins: u32, spans: u32| -> Vec<f64> {
        (0..=bins).map(|bin| f64::from((bin * BIN).min(spans)) / f64::from(spans)).collect()
    };
    let (across, down) = (edges(columns, map.width), edges(rows, spans));
    let bins: Vec<(u32, usize, usize)> = (0..faces(map.layout))
        .flat_map(|face| {
            (0..rows as usize).flat_map(move |row| (0..columns as usize).map(move |column| (face, column, row)))
        })
        .collect();
    let probabilities: Vec<f64> = bins
        .iter()
        .map(|&(face, column, row)| {
            let size = [across[column + 1] - across[column], down[row + 1] - down[row]];
            probability(&built, map, face, [across[column], down[row]], size)
        })
        .collect();
    let total: f64 = probabilities.iter().sum();
    assert!((total - 1.0).abs() < 2e-4, "{of:?}: the density integrates to {total}");
    let mut counts = vec![0u64; bins.len()];
    let mut random = Random(5);
    for _ in 0..SAMPLES {
        let (wi, pdf) = built.sample(&Frame::IDENTITY, [random.unit(), random.unit()]);
        assert!(pdf > 0.0);
        let (face, place) = place_of(map.layout, wi.map(f64::from));
        let column = ((place[0] * f64::from(map.width)) as u32 / BIN).min(columns - 1);
        let row = ((place[1] * f64::from(spans)) as u32 / BIN).min(rows - 1);
        counts[((face * rows + row) * columns + column) as usize] += 1;
    }
    let expected: Vec<f64> = probabilities.iter().map(|p| p / total * SAMPLES as f64).collect();
    let result = chi_square(&counts, &expected);
    let significance = corrected(TESTS);
    let fault = chi_square_smallest_fault(result.degrees, SAMPLES as f64, significance);
    println!("{of:?}: p {:.4}, smallest fault {fault:.4}", result.p_value);
    assert!(fault <= LARGEST_MISSED, "finds only faults of {fault}");
    assert!(result.p_value > significance, "{of:?}: p {}", result.p_value);
}

#[test]
fn samples_follow_the_density() {
    let mut tests = 0;
    for (layout, width, height) in layouts(32) {
        let map = Map::of_directions(layout, width, height, rough);
        for of in descriptions(&map) {
            test(&map, &of);
            tests += 1;
        }
    }
    assert_eq!(tests, TESTS);
}

#[test]
fn the_density_of_any_size_integrates_to_one() {
    let mut random = Random(3);
    for (width, height) in [(1, 1), (1, 7), (7, 1), (5, 3), (33, 17), (31, 64), (130, 65)] {
        let texels: Vec<f32> = (0..width * height).map(|_| random.unit()).collect();
        let map = Map::latlong(width, height, |x, y| texels[(y * width + x) as usize]);
        for of in descriptions(&map) {
            let built = Built::new(&map, &of);
            // Many points about every patch, also of refined maps.
            const ACROSS: u32 = 1024;
            let points = (0..ACROSS / 2).flat_map(|j| (0..ACROSS).map(move |i| (i, j)));
            let total: f64 = points
                .map(|(i, j)| {
                    let place =
                        [(f64::from(i) + 0.5) / f64::from(ACROSS), (f64::from(j) + 0.5) / f64::from(ACROSS / 2)];
                    f64::from(built.pdf(single(direction(map.layout, 0, place)))) * solid_angle(map.layout, place)
                })
                .sum::<f64>()
                / f64::from(ACROSS * ACROSS / 2);
            assert!((total - 1.0).abs() < 4e-3, "{width} x {height} {of:?}: {total}");
        }
    }
}
