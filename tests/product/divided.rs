//! Division: where the BRDF is not bilinear over a cell, samples fit it better if the heaviest cells are divided (rule 20).

use super::built::{Built, Random};
use super::client::Client;
use super::lookup::{Map, double};
use super::maps::rough;
use super::points::view;
use super::prepared::Prepared;
use super::statistics::Mean;
use wis::brdf::material::{Material, Shape};
use wis::light::chart::Layout;
use wis::light::plan::Filter;
use wis::product::prepare::Config;

const SAMPLES: usize = 40_000;

/// The variance of f L cos / p over the square of its mean, and how many cells were divided.
fn variance(map: &Map, built: &Built, material: &Material, divided: usize) -> (f64, u32) {
    let of = map.description(Filter::Bilinear);
    let point = view(material, [0.2, -0.4, 0.8], 50.0, 1.0);
    let prepared = Prepared::with(built, &point, &Config { divided, ..Config::default() });
    let (client, mut random, mut mean) = (Client::new(&point), Random(103), Mean::default());
    for _ in 0..SAMPLES {
        let (wi, pdf) = prepared.sample([random.f32(), random.f32()]);
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
