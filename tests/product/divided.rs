//! Division: where the BRDF is not bilinear over a cell, samples fit it better if the heaviest cells are divided (rule 20).

use super::built::{Built, Random};
use super::client::Client;
use super::lookup::{Map, V3, double, unit};
use super::maps::{layouts, rough, sky};
use super::points::view;
use super::prepared::Prepared;
use super::statistics::Mean;
use wis::brdf::material::{Material, Shape};
use wis::light::chart::Layout;
use wis::light::plan::Filter;
use wis::product::prepare::Config;

const SAMPLES: usize = 40_000;
const NORMAL: V3 = [0.2, -0.4, 0.8];

/// The variance of f L cos / p over the square of its mean, and how many cells were divided.
fn variance(map: &Map, built: &Built, material: &Material, divided: usize) -> (f64, u32) {
    let of = map.description(Filter::Bilinear);
    let point = view(material, NORMAL, 50.0, 1.0);
    let prepared = Prepared::with(built, &point, &Config { divided, ..Config::default() });
    let (client, mut random, mut mean) = (Client::new(&point), Random(103), Mean::default());
    for _ in 0..SAMPLES {
        let (wi, pdf) = prepared.sample([random.unit(), random.unit()]);
        let wi = double(wi);
        mean.add(client.f_cos(wi) * map.radiance(&of, built.least(), wi) / f64::from(pdf));
    }
    ((mean.standard_error() / mean.mean).powi(2) * mean.count, prepared.product().header.divided)
}

/// A variance of so many samples is off by a few per cent; the gain is far more.
#[test]
fn divided_cells_have_less_variance() {
    let map = Map::of_directions(Layout::LatLong, 64, 32, rough);
    let built = Built::new(&map, &map.description(Filter::Bilinear));
    for alpha in [0.15, 0.2, 0.3] {
        let material = Material::new(&[Shape::ggx(alpha, alpha)]).unwrap();
        let [(whole, none), (divided, count)] = [0, 8].map(|divided| variance(&map, &built, &material, divided));
        println!("GGX {alpha}: {whole:.4} of whole cells, {divided:.4} with {count} divided");
        assert_eq!(none, 0);
        assert!(count > 0 && divided < 0.8 * whole, "GGX {alpha}: {divided} of {whole}, {count} divided");
    }
}

/// The cosine is nearly bilinear in a cell above the horizon.
#[test]
fn a_diffuse_point_divides_no_cell_of_a_sky() {
    let material = Material::new(&[Shape::LAMBERT]).unwrap();
    for (layout, width, height) in layouts(64) {
        let map = Map::of_directions(layout, width, height, sky);
        let built = Built::new(&map, &map.description(Filter::Bilinear));
        let (variance, count) = variance(&map, &built, &material, 8);
        println!("{layout:?}: {variance:.5} with {count} divided");
        assert!(count == 0 && variance < 0.02, "{layout:?}: {variance} with {count} divided");
    }
}

/// Of a lamp on the horizon, half of which reflects nothing, corners of cells say too little.
#[test]
fn a_diffuse_point_divides_cells_of_a_lamp_on_its_horizon() {
    let material = Material::new(&[Shape::LAMBERT]).unwrap();
    let [x, y, z] = unit(NORMAL);
    let lamp = unit([z, 0.0, -x]);
    assert!((x * lamp[0] + y * lamp[1] + z * lamp[2]).abs() < 1e-12);
    for (layout, width, height) in layouts(64) {
        let bright = |d: V3| if (0..3).map(|k| d[k] * lamp[k]).sum::<f64>() > 0.95 { 100.0 } else { 1.0 };
        let map = Map::of_directions(layout, width, height, bright);
        let built = Built::new(&map, &map.description(Filter::Bilinear));
        let [(whole, _), (divided, count)] = [0, 8].map(|divided| variance(&map, &built, &material, divided));
        println!("{layout:?}: {whole:.4} of whole cells, {divided:.4} with {count} divided");
        assert!(count > 0 && divided < 0.7 * whole, "{layout:?}: {divided} of {whole}, {count} divided");
    }
}
