//! The environment: integration of input maps, and the light alone as a distribution.

mod support;

use support::*;
use wis::ffi::environment::*;

#[test]
fn a_constant_map_is_uniform() {
    for (width, height) in [(1, 1), (3, 5), (64, 32), (31, 17)] {
        for resolution in [1, 2, 16, 64] {
            let environment = Map::latlong(width, height, |_, _| 3.0).build(resolution, 0);
            let uniform = 1.0 / (4.0 * std::f32::consts::PI);
            assert!((environment.info.power / (12.0 * std::f64::consts::PI) - 1.0).abs() < 1e-12);
            let mut random = Random(7);
            for _ in 0..100 {
                let sample = environment.sample(WIS_DISTRIBUTION_PLAIN, None, [random.f32(), random.f32()]);
                assert!((sample.pdf / uniform - 1.0).abs() < 1e-5, "{width}x{height} at {resolution}: {}", sample.pdf);
            }
        }
    }
}

/// The power of a map is the sum of its texels' radiance times solid angle, whatever the resolution of the tree.
#[test]
fn power_is_exact() {
    let mut random = Random(3);
    for (width, height) in [(1, 1), (2, 1), (1, 7), (5, 3), (37, 19), (128, 64)] {
        let map = Map::latlong(width, height, |_, _| random.f32() * random.f32() * 100.0);
        let sum: f64 = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| {
                let solid_angle = wis::sphere::latlong_solid_angle(width, height, y);
                f64::from(map.pixels[(y * width + x) as usize]) * solid_angle
            })
            .sum();
        for resolution in [1, 4, 64, 256] {
            let power = map.build(resolution, WIS_ENVIRONMENT_NEAREST).info.power;
            assert!((power / sum - 1.0).abs() < 1e-12, "{width}x{height} at {resolution}: {power} {sum}");
        }
    }
}

/// Each cell's density is the average of the map over it: the average of many look-ups, cell by cell.
#[test]
fn cells_are_averages_of_the_map() {
    let (width, height) = (23, 11);
    let mut random = Random(11);
    let map = Map::latlong(width, height, |_, _| random.f32() + 0.1);
    let environment = map.build(4, WIS_ENVIRONMENT_NEAREST);
    let side = 400;
    for i in 0..4 {
        for j in 0..4 {
            let mut sum = 0.0;
            for k in 0..side * side {
                let at = |cell: u32, k: u32| (f64::from(cell) + (f64::from(k) + 0.5) / f64::from(side)) / 4.0;
                let direction = wis::sphere::direction_f64([at(i, k / side), at(j, k % side)]);
                let [u, v] = wis::sphere::latlong(direction);
                let x = ((u * f64::from(width)) as u32).min(width - 1);
                let y = ((v * f64::from(height)) as u32).min(height - 1);
                sum += f64::from(map.pixels[(y * width + x) as usize]);
            }
            let average = sum / f64::from(side * side);
            let centre = wis::sphere::direction_f64([(f64::from(i) + 0.37) / 4.0, (f64::from(j) + 0.41) / 4.0]);
            let pdf = f64::from(environment.pdf(WIS_DISTRIBUTION_PLAIN, None, centre.map(|c| c as f32)));
            let expected = average / environment.info.power;
            assert!((pdf / expected - 1.0).abs() < 2e-3, "cell {i} {j}: {pdf} {expected}");
        }
    }
}

/// A sample's pdf is pdf(wi) to the bit, and inversion leads back.
#[test]
fn sample_pdf_invert() {
    let mut random = Random(5);
    let map = Map::latlong(64, 32, |_, _| if random.f32() < 0.05 { 1000.0 * random.f32() } else { random.f32() });
    let environment = map.build(128, WIS_ENVIRONMENT_COMPENSATED);
    for distribution in [WIS_DISTRIBUTION_PLAIN, WIS_DISTRIBUTION_COMPENSATED] {
        for _ in 0..20_000 {
            let u = [random.f32(), random.f32()];
            let sample = environment.sample(distribution, None, u);
            assert_eq!(sample.pdf.to_bits(), environment.pdf(distribution, None, sample.wi).to_bits());
            let back = environment.invert(distribution, None, sample.wi).unwrap();
            for q in 0..2 {
                assert!((back[q] - u[q]).abs() < 1e-3, "{u:?} {back:?}");
            }
        }
    }
}
