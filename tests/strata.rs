//! Structured importance sampling: the oracle's strata, what every stratification has, and hard maps.

mod stored;

use stored::{cases, doubles, floats, integer, number};
use wis::status::Status;
use wis::strata::{Ball, Config, GROUP, Scratch, stratify};

/// Centres and the label of each texel.
struct Strata {
    centres: Vec<u32>,
    label: Vec<u32>,
}

fn try_run(config: &Config, luminance: &[f32]) -> Result<Strata, Status> {
    let texels = config.texels();
    let (mut rows, mut columns) = (vec![[0.0; 3]; config.height as usize], vec![[0.0; 2]; config.width as usize]);
    let (mut component, mut members, mut start) = (vec![7; texels], vec![7; texels], vec![7; texels]);
    let (mut distance, mut is_centre) = (vec![f64::NAN; texels], vec![9; texels]);
    let mut balls = vec![Ball::default(); texels.div_ceil(GROUP) + 1];
    let mut centres = vec![0; config.capacity()];
    let mut scratch = Scratch {
        rows: &mut rows,
        columns: &mut columns,
        component: &mut component,
        members: &mut members,
        distance: &mut distance,
        start: &mut start,
        balls: &mut balls,
        is_centre: &mut is_centre,
    };
    let luminance: Vec<f64> = luminance.iter().map(|&l| f64::from(l)).collect();
    let count = stratify(config, &luminance, &mut scratch, &mut centres)?;
    centres.truncate(count);
    Ok(Strata { centres, label: component })
}

fn run(config: &Config, luminance: &[f32]) -> Strata {
    try_run(config, luminance).unwrap()
}

fn direction(config: &Config, texel: u32) -> [f64; 3] {
    let (x, y) = (texel % config.width, texel / config.width);
    let theta = std::f64::consts::PI * (f64::from(y) + 0.5) / f64::from(config.height);
    let phi = std::f64::consts::TAU * (f64::from(x) + 0.5) / f64::from(config.width);
    [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()]
}

fn chord(config: &Config, a: u32, b: u32) -> f64 {
    let (a, b) = (direction(config, a), direction(config, b));
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn the_oracle_has_the_same_centres_and_strata() {
    for case in cases("sis.json") {
        let (width, height) = (integer(&case["w"]) as u32, integer(&case["h"]) as u32);
        let config = Config {
            levels: integer(&case["d"]) as u32,
            angle_limit: number(&case["dw0"]),
            ..Config::new(width, height, integer(&case["N"]) as u32)
        };
        let strata = run(&config, &floats(&case["lum"]));
        let centres: Vec<u32> = doubles(&case["centres"]).iter().map(|&c| c as u32).collect();
        assert_eq!(strata.centres, centres, "{width} x {height}");
        for (texel, (label, expected)) in strata.label.iter().zip(doubles(&case["label"])).enumerate() {
            assert!(expected < 0.0 || f64::from(*label) == expected, "texel {texel}: {label} for {expected}");
        }
    }
}

/// A map with a window, two lamps and a gradient, of any size.
fn room(width: u32, height: u32) -> Vec<f32> {
    let texel = |i: u32| {
        let (u, v) = (f64::from(i % width) / f64::from(width), f64::from(i / width) / f64::from(height));
        let window = (u < 0.06 || u > 0.95) && (0.3..0.5).contains(&v);
        let lamp = |a: f64, b: f64| (u - a).hypot(v - b) < 0.015;
        let light = if window { 30.0 } else { 0.0 } + if lamp(0.4, 0.2) || lamp(0.7, 0.6) { 200.0 } else { 0.0 };
        (light + 0.3 + 0.5 * (1.0 - v) + 0.1 * (u * 40.0).sin()) as f32
    };
    (0..width * height).map(texel).collect()
}

#[test]
fn labels_are_the_nearest_centres_and_centres_are_distinct() {
    for (width, height, count) in [(96, 48, 60), (40, 31, 9), (64, 32, 300)] {
        let config = Config::new(width, height, count);
        let strata = run(&config, &room(width, height));
        assert!(strata.centres.len() >= count as usize && strata.centres.len() <= config.capacity());
        let mut sorted = strata.centres.clone();
        sorted.sort_unstable();
        sorted.dedup();
        assert_eq!(sorted.len(), strata.centres.len());
        for (texel, &label) in strata.label.iter().enumerate() {
            let to = |number: usize| chord(&config, texel as u32, strata.centres[number]);
            let nearest = (0..strata.centres.len()).map(to).fold(f64::INFINITY, f64::min);
            assert!(to(label as usize) <= nearest + 1e-12);
        }
    }
}

/// In each component the added centres are farthest-first: the naive traversal picks the same.
#[test]
fn the_darkest_layer_is_traversed_farthest_first() {
    let config = Config { levels: 1, ..Config::new(48, 24, 40) };
    let luminance = room(48, 24);
    let strata = run(&config, &luminance);
    let mut distance = vec![f64::INFINITY; config.texels()];
    for (number, &centre) in strata.centres.iter().enumerate() {
        if number > 0 {
            let largest = distance.iter().copied().fold(0.0, f64::max);
            let first = distance.iter().position(|&d| d >= largest - 1e-9).unwrap();
            assert_eq!(centre as usize, first, "centre {number}");
        }
        for (texel, d) in distance.iter_mut().enumerate() {
            *d = d.min(chord(&config, texel as u32, centre));
        }
    }
}

#[test]
fn scale_and_turns_of_the_map_change_nothing() {
    let (width, height) = (64, 32);
    let config = Config::new(width, height, 50);
    let map = room(width, height);
    let strata = run(&config, &map);
    let scaled: Vec<f32> = map.iter().map(|l| l * 1024.0).collect();
    assert_eq!(run(&config, &scaled).centres, strata.centres);
    // A component that wraps around the azimuth gets what it gets elsewhere.
    let turned: Vec<f32> = (0..width * height).map(|i| map[(i / width * width + (i + 16) % width) as usize]).collect();
    let moved = run(&config, &turned);
    let shares = |strata: &Strata, map: &[f32]| strata.centres.iter().filter(|&&c| map[c as usize] > 20.0).count();
    assert_eq!(moved.centres.len(), strata.centres.len());
    assert_eq!(shares(&moved, &turned), shares(&strata, &map));
}

#[test]
fn hard_maps_have_defined_results() {
    let config = Config::new(16, 8, 10);
    assert!(run(&config, &[0.0; 128]).centres.is_empty());
    assert_eq!(run(&config, &[3.0; 128]).centres.len(), 10);
    let mut one = [0.0; 128];
    one[37] = 5.0;
    let strata = run(&config, &one);
    assert!(strata.centres[0] == 37 && strata.centres.len() >= 10);
    assert_eq!(run(&Config::new(1, 1, 5), &[2.0]).centres, [0]);
    assert!(run(&Config::new(16, 8, 0), &[1.0; 128]).centres.is_empty());
    // More lights than texels: every texel is one.
    assert_eq!(run(&Config::new(4, 2, 1000), &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]).centres.len(), 8);
    for bad in [
        Config { levels: 0, ..config },
        Config { angle_limit: 0.0, ..config },
        Config { angle_exponent: f64::NAN, ..config },
        Config { radiance_exponent: -1.0, ..config },
    ] {
        assert_eq!(try_run(&bad, &[1.0; 128]).err(), Some(Status::InvalidArgument));
    }
    assert_eq!(try_run(&config, &[1.0; 127]).err(), Some(Status::InvalidArgument));
}
