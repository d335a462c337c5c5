//! Products for a cone of normals: horizon and cosines are widened by it, and by no more (rule 26).

use super::built::{Built, Random};
use super::client::Client;
use super::lookup::{Map, double, single};
use super::maps::layouts;
use super::points::view;
use super::prepared::Prepared;
use std::f64::consts::{FRAC_PI_2, PI};
use wis::brdf::material::{Material, Shape};
use wis::light::plan::Filter;
use wis::product::prepare::Config;

/// From a direction to the farthest corner of its cell, at the most: a face has 4 x 4 cells or more.
const CELL: f64 = 0.9;
/// How far interpolation between the corners of cells is off, on average, as a share of the albedo.
const INTERPOLATION: f64 = 0.06;

/// Under a white light and for a Lambertian lobe a product stores the cosine to the nearest normal of the cone, over pi. Its mean
/// difference to that is small, and so it is just above the lowered horizon, where the cosine to the product's own normal is 0.
#[test]
fn cosines_are_those_to_the_nearest_normal_of_the_cone() {
    let mut random = Random(89);
    for (layout, width, height) in layouts(32) {
        let map = Map::of_directions(layout, width, height, |_| 1.0);
        let built = Built::new(&map, &map.description(Filter::Bilinear));
        let power = built.environment().light().power;
        let material = Material::new(&[Shape::LAMBERT]).unwrap();
        for cone in [0.0, 0.2, 0.5] {
            let point = view(&material, random.direction(), 20.0, 0.3);
            let client = Client::new(&point);
            let prepared = Prepared::with(&built, &point, &Config { cone: cone as f32, ..Config::default() });
            let integral = prepared.product().header.integral;
            let (mut difference, mut all) = (0.0, 0.0);
            let (mut low, mut low_stored) = (0.0, 0.0);
            for _ in 0..20_000 {
                let wi = single(random.direction());
                let angle = client.cosine(double(wi)).clamp(-1.0, 1.0).acos();
                let widened = (angle - cone).max(0.0).cos().max(0.0) / PI;
                let stored = f64::from(prepared.pdf(wi) / built.pdf(wi)) * integral / power;
                difference += (stored - widened).abs();
                all += widened;
                if (FRAC_PI_2..FRAC_PI_2 + 0.5 * cone).contains(&angle) {
                    (low, low_stored) = (low + widened, low_stored + stored);
                }
                assert!(angle < FRAC_PI_2 + cone + CELL || stored == 0.0, "{layout:?} {cone}: {stored} at {angle}");
            }
            println!("{layout:?} {cone}: off by {:.4}, {:.3} of what is below", difference / all, low_stored / low);
            assert!(difference < INTERPOLATION * all, "{layout:?} {cone}: {}", difference / all);
            assert!(cone == 0.0 || (0.8..1.25).contains(&(low_stored / low)), "{layout:?} {cone}: {low_stored} {low}");
        }
    }
}
