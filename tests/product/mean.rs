//! Estimates against quadrature: a density that is not that of its samples gives a wrong mean.

use super::built::{Built, Random};
use super::client::Client;
use super::lookup::{Map, V3, direction, double, faces};
use super::maps::{layouts, rough};
use super::points::{materials, view};
use super::prepared::Prepared;
use super::statistics::{LARGEST_MISSED, Mean, corrected};
use std::f64::consts::PI;
use wis::light::chart::Layout;
use wis::light::plan::Filter;
use wis::product::prepare::Config;

const SAMPLES: usize = 100_000;
/// Lat-long rows of the quadrature.
const ROWS: u32 = 700;
/// How accurate it is: its steps are small beside every lobe that is tested.
pub const TOLERANCE: f64 = 1e-3;
/// Lobes that a look-up every quarter of a degree resolves.
const WIDE: [&str; 7] = ["Lambert", "GGX .5", "GGX .2", "GGX .1", "Phong 20", "Lambert + GGX .1", "GGX .3 x .05"];

/// The integral over the sphere by the midpoint rule.
pub fn integral(of: impl Fn(V3) -> f64) -> f64 {
    let columns = 2 * ROWS;
    let step = PI / f64::from(ROWS);
    let mut sum = 0.0;
    for (i, j) in (0..ROWS).flat_map(|j| (0..columns).map(move |i| (i, j))) {
        let place = [(f64::from(i) + 0.5) / f64::from(columns), (f64::from(j) + 0.5) / f64::from(ROWS)];
        sum += of(direction(Layout::LatLong, 0, place)) * (PI * place[1]).sin();
    }
    sum * step * step
}

#[test]
fn estimates_are_unbiased() {
    let mut random = Random(61);
    let significance = corrected(3 * 2 * WIDE.len());
    let mut largest_fault = 0.0f64;
    for (layout, width, height) in layouts(32) {
        let map = Map::of_directions(layout, width, height, rough);
        assert_eq!(map.height / faces(layout), 32);
        let of = map.description(Filter::Bilinear);
        let built = Built::new(&map, &of);
        let least = built.least();
        for (name, material) in materials().iter().filter(|(name, _)| WIDE.contains(name)) {
            for degrees in [20.0, 65.0] {
                let point = view(material, random.direction(), degrees, random.f64());
                let client = Client::new(&point);
                let value = |wi: V3| client.f_cos(wi) * map.radiance(&of, least, wi);
                let reference = integral(value);
                let config = Config { cone: if degrees > 50.0 { 0.1 } else { 0.0 }, ..Config::default() };
                let prepared = Prepared::with(&built, &point, &config);
                let mut mean = Mean::default();
                for _ in 0..SAMPLES {
                    let (wi, pdf) = prepared.sample([random.unit(), random.unit()]);
                    mean.add(value(double(wi)) / f64::from(pdf));
                }
                let p = mean.p_value(reference, TOLERANCE * reference);
                largest_fault = largest_fault.max(mean.smallest_fault(significance));
                assert!(p > significance, "{layout:?} {name} {degrees}: {} of {reference}, p {p}", mean.mean);
                let stored = prepared.product().header.integral;
                let wide = ["Lambert", "GGX .5"].contains(name) && config.cone == 0.0;
                assert!(!wide || (stored / reference - 1.0).abs() < 0.1, "{layout:?} {name}: {stored} of {reference}");
            }
        }
    }
    println!("the smallest fault that is found: {largest_fault:.4}");
    assert!(largest_fault <= LARGEST_MISSED + TOLERANCE, "finds only faults of {largest_fault}");
}
