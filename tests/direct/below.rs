//! Views from below the shading normal, as bent normals have them: a client that still reflects there loses nothing.

use super::client::{self, Client};
use super::light::{Light, TURNED, Thread, first_hit};
use crate::support::maps::{Filter, sun};
use crate::support::statistics::Mean;
use crate::support::vector::{V3, add, cross, dot, rotate_back, scale, unit};
use crate::support::{Map, Random};
use std::f64::consts::PI;
use wis::brdf::material::{Kind, Shape};
use wis::direct::sampler::Config;
use wis::simd::Level;

const CALLS: u32 = 20_000;

/// A client whose view has this cosine.
fn seen(client: Client, cosine: f64) -> Client {
    let across = unit(cross(client.normal, [0.3, 0.5, -0.7]));
    let wo = unit(add(scale(client.normal, cosine), scale(across, (1.0 - cosine * cosine).sqrt())));
    Client { wo, ..client }
}

/// What calls for so many rays bring: their mean, and the largest contribution of a ray. `shared`: they draw from one product.
fn estimates(client: &Client, map: &Map, rays: usize, shared: bool) -> (Mean, f64) {
    let light = Light::of(map);
    let config = Config { rays: 16, candidates_per_ray: 0, hits_per_pixel: if shared { 64 } else { 0 }, reserved: 0 };
    let mut thread = Thread::with(Level::detect(), config);
    let (mut mean, mut largest) = (Mean::default(), 0.0f64);
    for seed in 0..CALLS {
        let drawn = thread.direct(&light.environment(), &client.point(), first_hit(seed), rays);
        let brings = drawn.iter().map(|ray| {
            let wi = ray.wi.map(f64::from);
            let radiance = map.radiance(Filter::Bilinear, rotate_back(&TURNED, wi))[0];
            f64::from(ray.weight) * client.response(wi) * radiance
        });
        let brings: Vec<f64> = brings.collect();
        largest = brings.iter().fold(largest, |a, &b| a.max(b));
        mean.add(brings.iter().sum());
    }
    (mean, largest)
}

fn relative_variance((mean, _): &(Mean, f64)) -> f64 {
    mean.standard_error().powi(2) * mean.count / mean.mean.powi(2)
}

/// Samples of [`CALLS`] know a variance under a lamp to a tenth; without lobes' values it is 17 to 80 times as large.
#[test]
fn a_diffuse_client_has_the_variance_of_a_view_from_above() {
    let white = Map::latlong(64, 32, |_, _| 1.0);
    for (name, map) in [("white", white), ("sun", sun(512, 256).reduced(8))] {
        for shapes in [&[Shape::LAMBERT][..], &[Shape::LAMBERT, Shape::ggx(0.3, 0.3)]] {
            for rays in [1, 3] {
                let of =
                    |cosine: f64| estimates(&seen(Client::new(shapes, client::lambert), cosine), &map, rays, false);
                let [above, below] = [0.05, -0.0523].map(|cosine| relative_variance(&of(cosine)));
                println!("{name}, {} lobes, {rays} rays: {below:.4} from below, {above:.4} from above", shapes.len());
                assert!(below <= 1.3 * above + 1e-4, "{name}, {rays} rays: {below} from below, {above} from above");
            }
        }
    }
}

/// The formula of the header, with an exponent.
fn phong<const A: i32>(wo: V3, wi: V3) -> f64 {
    let cosine = dot([-wo[0], -wo[1], wo[2]], wi);
    if cosine <= 0.0 || wi[2] <= 0.0 { 0.0 } else { f64::from(A + 2) / (2.0 * PI) * cosine.powi(A) * wi[2] }
}

/// The integral of a client's response x radiance, by rows of elevation near the horizon ever denser.
fn integral(client: &Client, map: &Map, brdf: client::Brdf) -> f64 {
    const SIDE: u32 = 1500;
    let local = client.wo_local();
    let mut sum = 0.0;
    for i in 0..SIDE {
        let t = (f64::from(i) + 0.5) / f64::from(SIDE);
        let (z, width) = (t * t * t, 3.0 * t * t / f64::from(SIDE));
        for j in 0..SIDE {
            // About the azimuth of the mirror direction, denser there.
            let s = 2.0 * (f64::from(j) + 0.5) / f64::from(SIDE) - 1.0;
            let azimuth = (-local[1]).atan2(-local[0]) + PI * s * s * s;
            let (y, x) = azimuth.sin_cos();
            let level = (1.0 - z * z).sqrt();
            let wi = [level * x, level * y, z];
            let radiance = map.radiance(Filter::Bilinear, rotate_back(&TURNED, client.to_world(wi)))[0];
            sum += brdf(local, wi) * radiance * width * 6.0 * PI * s * s / f64::from(SIDE);
        }
    }
    sum
}

/// Lamps of 7 x 5 texels, 6000 times as bright as the sky.
fn hall() -> Map {
    let mut random = Random(6);
    let mut map = Map::latlong(256, 128, |_, _| 0.05);
    for _ in 0..25 {
        let [x, y] = [248.0, 60.0].map(|range| (random.f64() * range) as usize);
        let texels = (0..35).map(|k| (y + 2 + k / 7) * 256 + x + k % 7);
        texels.for_each(|texel| map.pixels[texel] = 300.0);
    }
    map
}

/// Lamps of one texel, 40,000 times as bright as the sky, for which few strata are left each: with a quarter of the strata rays
/// weigh 64 to 96 integrals here. What is left is due to the number of candidates: with four times as many it is a third.
#[test]
fn contributions_under_many_lamps_are_bounded() {
    let mut random = Random(6);
    let mut map = Map::latlong(256, 128, |_, _| 0.05);
    for _ in 0..400 {
        let [x, y] = [255.0, 124.0].map(|range| (random.f64() * range) as usize);
        map.pixels[(y + 1) * 256 + x] = 2000.0;
    }
    let cases: [(f32, client::Brdf, f64); 3] =
        [(50.0, phong::<50>, 1.0), (1000.0, phong::<1000>, 0.05), (1000.0, phong::<1000>, 1.0)];
    for (exponent, brdf, cosine) in cases {
        let shape = Shape { kind: Kind::Phong, a: exponent, b: 0.0, eta: 1.0 };
        let (mean, largest) = estimates(&seen(Client::new(&[shape], brdf), cosine), &map, 1, false);
        let times = largest / mean.mean;
        println!("Phong {exponent}, cosine {cosine}: at most {times:.1} times {}", mean.mean);
        assert!(times < 50.0, "Phong {exponent}, cosine {cosine}: {times} integrals");
    }
}

/// Rule 33: also where the mirror direction lies below the horizon, and all that counts is a lobe's flank: 1e5 integrals without lobes there.
#[test]
fn contributions_of_phong_are_bounded() {
    let maps = [("white", Map::latlong(64, 32, |_, _| 1.0)), ("hall", hall())];
    let cases: [(i32, client::Brdf); 3] = [(10, phong::<10>), (50, phong::<50>), (1000, phong::<1000>)];
    for ((name, map), (exponent, brdf)) in maps.iter().flat_map(|map| cases.map(|case| (map, case))) {
        for degrees in [1.0, 5.0, 15.0] {
            let shape = Shape { kind: Kind::Phong, a: exponent as f32, b: 0.0, eta: 1.0 };
            let client = seen(Client::new(&[shape], brdf), -f64::to_radians(degrees).sin());
            let integral = integral(&client, map, brdf);
            for (rays, shared) in [(1, false), (4, false), (4, true)] {
                let (mean, largest) = estimates(&client, map, rays, shared);
                let times = rays as f64 * largest / integral;
                println!(
                    "{name}, Phong {exponent}, {degrees} degrees below, {rays} rays, shared {shared}: {} of {integral}, at most {times:.1} times",
                    mean.mean
                );
                assert!((mean.mean - integral).abs() < 5.0 * mean.standard_error() + 2e-3 * integral);
                assert!(
                    times < 50.0,
                    "{name}, Phong {exponent}, {degrees} degrees below, {rays} rays: {times} integrals"
                );
            }
        }
    }
}
