//! The mean of what rays bring is the integral, for any BRDF, radiance and visibility of the client (rule 24).
//!
//! Each comparison is a z-test; all of them are one family of significance 1e-4, and each finds a fault of 2 % with power 0.99.

use super::client::{self, Client};
use super::light::{Light, TURNED, Thread, description, first_hit, mean_of};
use super::maps;
use crate::support::Map;
use crate::support::maps::{Filter, horizon};
use crate::support::statistics::{LARGEST_MISSED, Mean, corrected};
use crate::support::vector::{V3, add, cross, dot, rotate_back, scale};
use wis::brdf::material::{Kind, Shape};
use wis::direct::Ray;
use wis::direct::sampler::Config;
use wis::light::chart::Layout;
use wis::light::plan::{Description, Filter as Built};
use wis::points::{pixel_seed, sobol};
use wis::simd::Level;

const RAYS: [usize; 3] = [1, 4, 16];

/// Calls of the test of an even sky.
const CALLS: u32 = 300_000;

/// Comparisons of all tests of this file, at most.
const TESTS: usize = 150;

/// A light, what the client looks up, and candidates per ray (0: the library's choice).
struct Setting<'a> {
    name: String,
    map: &'a Map,
    of: Description,
    per_ray: u32,
}

impl<'a> Setting<'a> {
    fn new(name: &str, map: &'a Map) -> Setting<'a> {
        Setting { name: name.to_string(), map, of: description(map), per_ray: 0 }
    }

    fn filter(&self) -> Filter {
        if self.of.filter == Built::Nearest { Filter::Nearest } else { Filter::Bilinear }
    }

    /// What a ray adds to the estimate, after a look at whether it is sound.
    fn brings(&self, client: &Client, ray: &Ray) -> f64 {
        let wi = ray.wi.map(f64::from);
        check_ray(client, wi, ray.weight);
        let radiance = self.map.radiance(self.filter(), rotate_back(&TURNED, wi))[0];
        f64::from(ray.weight) * client.response(wi) * radiance
    }

    /// Compares means of calls for 1, 4 and 16 rays with the integral.
    fn check(&self, client: &Client) {
        let (integral, error) = client.integral(self.map, self.filter(), 12);
        assert!(error < 2e-3 * integral, "{}: the reference {integral} is good to {error} only", self.name);
        let light = Light::build(self.map, &self.of);
        for rays in RAYS {
            let config = Config { rays: 16, candidates_per_ray: self.per_ray, hits_per_pixel: 0, reserved: 0 };
            let mut thread = Thread::with(Level::detect(), config);
            let significance = corrected(TESTS);
            let mean = mean_of(significance, |seed| {
                let rays = thread.direct(&light.environment(), &client.point(), first_hit(seed), rays);
                rays.iter().map(|ray| self.brings(client, ray)).sum()
            });
            let (p, fault) = (mean.p_value(integral, error), mean.smallest_fault(significance));
            let what = format!("{} {rays} rays: {} instead of {integral}, p {p:.1e}", self.name, mean.mean);
            println!("{what}, finds {:.2} % with {} calls", 100.0 * fault, mean.count);
            assert!(p > significance, "{what}");
            assert!(fault < LARGEST_MISSED, "{what}: would find {fault} only");
        }
    }
}

/// A ray has unit length, a weight, and lies where directions count.
fn check_ray(client: &Client, wi: V3, weight: f32) {
    assert!(weight > 0.0 && weight < f32::INFINITY, "{weight}");
    assert!((dot(wi, wi) - 1.0).abs() < 1e-5, "{wi:?}");
    let whole = client.whole_sphere || client.material.transmits();
    assert!(whole || dot(wi, client.normal) > -1e-6, "{wi:?}");
}

/// Under a smooth light and under a sun.
fn check(name: &str, client: &Client) {
    for (light, map) in maps() {
        Setting::new(&format!("{name}, {light}:"), &map).check(client);
    }
}

const GGX: Shape = Shape { kind: Kind::Ggx, a: 0.3, b: 0.3, eta: 1.0 };

#[test]
fn lambert() {
    check("Lambert", &Client::new(&[Shape::LAMBERT], client::lambert));
}

#[test]
fn ggx() {
    check("GGX", &Client::new(&[GGX], client::ggx_03));
}

#[test]
fn phong() {
    let shape = Shape { kind: Kind::Phong, a: 20.0, b: 0.0, eta: 1.0 };
    check("Phong", &Client::new(&[shape], client::phong));
}

/// Two lobes, one of them anisotropic.
#[test]
fn mixture() {
    let weight = [0.4, 0.6, 0.0, 0.0];
    let client = Client { weight, ..Client::new(&[Shape::LAMBERT, Shape::ggx(0.4, 0.15)], client::mixture) };
    check("mixture", &client);
}

/// Separable shadowing, Fresnel's equations and a base below a coat: the lobes only resemble it.
#[test]
fn a_brdf_that_the_lobes_do_not_describe() {
    let client = Client { f0: 0.2, ..Client::new(&[Shape::LAMBERT, GGX], client::coated) };
    check("coated", &client);
}

#[test]
fn lobes_that_are_black() {
    let client = Client { weight: [0.0; 4], ..Client::new(&[Shape::LAMBERT, GGX], client::mixture) };
    check("black lobes", &client);
}

/// The lobe is a sixth as wide as the client's.
#[test]
fn a_lobe_that_is_too_narrow() {
    check("narrow lobe", &Client::new(&[Shape::ggx(0.05, 0.05)], client::ggx_03));
}

/// From below a surface no lobe reflects anything, but the client's does.
#[test]
fn a_view_from_below() {
    let above = Client::new(&[Shape::LAMBERT, GGX], client::lambert);
    check("from below", &Client { wo: scale(above.wo, -1.0), ..above });
}

/// Another radiance than that of the map, between 0.1 and 1.9 of it.
#[test]
fn another_radiance() {
    let factor = |wi: V3| 1.0 + 0.9 * (5.0 * wi[0] + 3.0 * wi[2]).sin();
    check("radiance", &Client { factor, ..Client::new(&[Shape::LAMBERT, GGX], client::coated) });
}

/// Two walls, one of which hides a part of the sky from the sun on.
#[test]
fn visibility() {
    let factor = |wi: V3| if wi[0] + 0.4 * wi[1] > 0.55 || wi[2] < -0.2 { 0.0 } else { 1.0 };
    check("visibility", &Client { factor, ..Client::new(&[Shape::LAMBERT, GGX], client::coated) });
}

/// Rough glass before a leaf: all lobes of both sides, from outside; the client's normal may point either way.
#[test]
fn transmission() {
    let through = Shape { kind: Kind::GgxTransmission, a: 0.3, b: 0.3, eta: client::ETA as f32 };
    let leaf = Shape { kind: Kind::LambertTransmission, a: 0.0, b: 0.0, eta: 1.0 };
    let outside = Client { weight: [1.0, 1.0, 0.3, 0.0], ..Client::new(&[GGX, through, leaf], client::glass) };
    check("glass", &outside);
    let turned = Client { normal: scale(outside.normal, -1.0), ..outside };
    check("glass, normal turned", &turned);
}

/// Light from both sides by a flag alone.
#[test]
fn a_whole_sphere() {
    let client = Client { whole_sphere: true, ..Client::new(&[Shape::LAMBERT], client::leaf) };
    check("whole sphere", &client);
}

#[test]
fn no_lobes() {
    check("no lobes", &Client::new(&[], client::mixture));
    let volume = Client { whole_sphere: true, cosine_included: true, ..Client::new(&[], client::phase) };
    check("volume", &volume);
}

/// Light that is compensated, of which a point without the flag has the whole, of texels, and black in most directions.
#[test]
fn other_lights() {
    let client = Client::new(&[Shape::LAMBERT, GGX], client::coated);
    for (light, map) in maps() {
        let compensated = Setting::new(&format!("compensated {light}:"), &map);
        let compensated = Setting { of: Description { compensated: true, ..compensated.of }, ..compensated };
        compensated.check(&client);
        // Wide lobes: all candidates come from the light.
        compensated.check(&Client::new(&[Shape::LAMBERT], client::lambert));
        let nearest = Setting::new(&format!("nearest {light}:"), &map);
        Setting { of: Description { filter: Built::Nearest, ..nearest.of }, ..nearest }.check(&client);
    }
    let map = horizon();
    let dark = Setting::new("black:", &map);
    Setting { of: Description { exact_zero: true, ..dark.of }, ..dark }.check(&client);
}

/// The weights of an even sky add up to the sphere, for lights whose patches cover very different solid angles: at poles, at corners of
/// cubes, merged under an error budget. Finds a fault of 0.12 %.
#[test]
fn weights_of_an_even_sky_add_up() {
    let client = Client { whole_sphere: true, cosine_included: true, ..Client::new(&[], client::phase) };
    for (layout, width, height) in [(Layout::LatLong, 16, 8), (Layout::Cube, 8, 48), (Layout::Octahedral, 8, 8)] {
        let map = Map { width, height, channels: 1, layout: 0, pixels: vec![1.0; (width * height) as usize] };
        for budget in [0.0, 0.05] {
            let of = Description { layout, filter: Built::Nearest, budget, ..description(&map) };
            let light = Light::build(&map, &of);
            let mut thread = Thread::new(1);
            let significance = corrected(TESTS);
            let mut mean = Mean::default();
            for seed in 0..CALLS {
                let rays = thread.direct(&light.environment(), &client.point(), first_hit(seed), 1);
                mean.add(rays.iter().map(|ray| f64::from(ray.weight)).sum());
            }
            let sphere = 4.0 * std::f64::consts::PI;
            let (p, fault) = (mean.p_value(sphere, 0.0), mean.smallest_fault(significance));
            assert!(p > significance && fault < 1.2e-3, "{of:?}: {} of {sphere}, p {p:.1e}, finds {fault}", mean.mean);
        }
    }
}

/// Numbers of candidates that are no powers of two, and the least.
#[test]
fn any_number_of_candidates() {
    let client = Client::new(&[Shape::LAMBERT, GGX], client::coated);
    for (light, map) in maps() {
        for per_ray in [1, 3, 40] {
            let setting = Setting::new(&format!("{per_ray} candidates for each ray, {light}:"), &map);
            Setting { per_ray, ..setting }.check(&client);
        }
    }
}

/// Rule 41: rays bring what exceeds the mean of the client's own radiance, BSDF rays that escape bring the rest.
#[test]
fn compensated() {
    let clients = [
        ("Lambert", Client::new(&[Shape::LAMBERT], client::lambert)),
        ("GGX", Client::new(&[GGX], client::ggx_03)),
        ("another light", Client { factor: |w| 1.5 + w[0], ..Client::new(&[Shape::LAMBERT], client::lambert) }),
    ];
    for ((name, client), (light, map)) in clients.iter().flat_map(|client| maps().map(move |map| (client, map))) {
        let setting = Setting::new(&format!("compensated, {name}, {light}:"), &map);
        let (integral, error) = client.integral(&map, setting.filter(), 12);
        let built = Light::build(&map, &setting.of);
        let environment = built.environment();
        let mut thread =
            Thread::with(Level::detect(), Config { rays: 1, candidates_per_ray: 0, hits_per_pixel: 0, reserved: 0 });
        // The parts of what comes along a direction that rays bring, and BSDF rays.
        let parts = |wi: V3| {
            let radiance = map.radiance(setting.filter(), rotate_back(&TURNED, wi)).map(|l| l * (client.factor)(wi));
            let base = f64::from(environment.base(radiance.map(|l| l as f32)));
            let whole = client.response(wi) * map.radiance(setting.filter(), rotate_back(&TURNED, wi))[0];
            [(1.0 - base) * whole, base * whole]
        };
        let significance = corrected(TESTS);
        let mean = mean_of(significance, |seed| {
            let point = wis::Point { compensated: true, ..client.point() };
            let rays = thread.direct(&environment, &point, first_hit(seed), 1);
            let direct: f64 = rays.iter().map(|ray| f64::from(ray.weight) * parts(ray.wi.map(f64::from))[0]).sum();
            let (wi, pdf) = cosine(client, sobol(pixel_seed(seed, 7, 0), 0));
            direct + parts(wi)[1] / pdf
        });
        let (p, fault) = (mean.p_value(integral, error), mean.smallest_fault(significance));
        let what = format!("{} {} instead of {integral}, p {p:.1e}", setting.name, mean.mean);
        println!("{what}, finds {:.2} % with {} calls", 100.0 * fault, mean.count);
        assert!(p > significance && fault < LARGEST_MISSED, "{what}: finds {fault}");
    }
}

/// A direction about the normal, in proportion to the cosine, and its density.
fn cosine(client: &Client, [u, v]: [f32; 2]) -> (V3, f64) {
    let (radius, angle) = (f64::from(u).sqrt(), std::f64::consts::TAU * f64::from(v));
    let height = (1.0 - f64::from(u)).sqrt();
    let across = cross(client.normal, client.tangent);
    let plane = add(scale(client.tangent, radius * angle.cos()), scale(across, radius * angle.sin()));
    (add(plane, scale(client.normal, height)), height / std::f64::consts::PI)
}
