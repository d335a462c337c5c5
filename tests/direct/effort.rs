//! How many candidates a point has: more where a narrow lobe meets a bright part of the light, by the point alone.

use super::client::{self, Client};
use super::light::{Light, Thread};
use crate::support::maps::sun;
use crate::support::{Map, Random};
use wis::brdf::material::Shape;
use wis::brdf::surface::Surface;
use wis::direct::Ray;
use wis::direct::effort::{Deviation, MOST, factor};
use wis::direct::sampler::{Config, Sequence};
use wis::simd::{Level, run};

/// Candidates for one ray of lobes that are not all diffuse.
const USUAL: u32 = 32;

fn white() -> Map {
    Map::latlong(64, 32, |_, _| 1.0)
}

fn deviation(map: &Map, alpha: f32) -> f32 {
    let light = Light::of(map);
    let environment = light.environment();
    let client = Client::new(&[Shape::ggx(alpha, alpha)], client::lambert);
    let surface = Surface::new(&client.point(), &environment.frame()).unwrap();
    run(Level::detect(), Deviation { light: &environment.light(), surface: &surface })
}

/// The rays of a turn with the library's number of candidates, and with a number of the client's.
fn rays(map: &Map, alpha: f32, per_ray: u32, at: Sequence) -> Vec<Ray> {
    let light = Light::of(map);
    let client = Client::new(&[Shape::ggx(alpha, alpha)], client::lambert);
    let config = Config { rays: 1, candidates_per_ray: per_ray, hits_per_pixel: 0, reserved: 0 };
    Thread::with(Level::detect(), config).direct(&light.environment(), &client.point(), at, 1)
}

#[test]
fn candidates_are_multiplied_by_powers_of_two() {
    let deviations = [0.0, 0.99, 1.0, 1.99, 2.0, 4.0, f32::MAX, f32::INFINITY];
    assert_eq!(deviations.map(factor), [1, 1, 2, 2, 4, MOST, MOST, MOST]);
}

/// Under an even light candidates of a lobe bring all the same; near the mirror direction of a sun some bring thousands of times more.
#[test]
fn candidates_differ_most_where_a_narrow_lobe_meets_a_lamp() {
    let (even, lamp) = (white(), sun(512, 256).reduced(8));
    for alpha in [0.02, 0.1] {
        let [even, lamp] = [&even, &lamp].map(|map| deviation(map, alpha));
        assert!(even < 0.5, "{alpha}: {even}");
        assert!(lamp > 4.0, "{alpha}: {lamp}");
    }
}

/// Where they differ little, rays have the bits that they have with the usual number.
#[test]
fn an_even_light_leaves_the_usual_number() {
    let mut random = Random(4);
    for _ in 0..32 {
        let at = Sequence { seed: random.bits() as u32, turn: random.bits() as u32 % 1000, stream: 0 };
        let bits = |rays: Vec<Ray>| rays.iter().map(|ray| (ray.wi, ray.weight)).collect::<Vec<_>>();
        let map = white();
        assert_eq!(bits(rays(&map, 0.1, 0, at)), bits(rays(&map, 0.1, USUAL, at)));
    }
}
