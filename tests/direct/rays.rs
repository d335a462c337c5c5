//! Rays of a call: how many, where, and the same bits whatever the processor and the unit of radiance.

use super::client::{self, Client};
use super::light::{Light, TURNED, Thread, description, first_hit, mean_of};
use super::maps;
use crate::support::maps::{Filter, one_texel};
use crate::support::statistics::corrected;
use crate::support::vector::{dot, rotate_back, single, unit};
use crate::support::{Map, Random};
use std::f64::consts::PI;
use wis::brdf::material::{Kind, Material, Shape};
use wis::brdf::point::Point;
use wis::direct::Ray;
use wis::direct::sampler::{Config, Sequence};
use wis::light::plan::Description;
use wis::simd::Level;

fn materials() -> Vec<Material> {
    let lobe = |kind, a, b| Shape { kind, a, b, eta: 1.5 };
    [
        vec![],
        vec![Shape::LAMBERT],
        vec![Shape::LAMBERT, Shape::ggx(0.4, 0.02)],
        vec![lobe(Kind::Phong, 200.0, 0.0)],
        vec![
            lobe(Kind::Ggx, 1e-5, 1e-5),
            lobe(Kind::GgxTransmission, 0.2, 0.2),
            lobe(Kind::LambertTransmission, 0.0, 0.0),
        ],
    ]
    .iter()
    .map(|shapes| Material::new(shapes).unwrap())
    .collect()
}

/// A point with random normal, view, weights and flags.
fn random_point<'a>(random: &mut Random, materials: &'a [Material]) -> Point<'a> {
    let material = &materials[random.bits() as usize % materials.len()];
    let mut direction = || single(random.direction());
    let (normal, tangent, wo) = (direction(), direction(), direction());
    let mut colour = || [0; 4].map(|_| [0; 3].map(|_| (4.0 * random.f32() - 2.0).clamp(0.0, 1.0)));
    let (weight, f0) = (colour(), colour());
    let (whole_sphere, cosine_included) = (random.f32() < 0.3, random.f32() < 0.2);
    Point {
        material,
        normal,
        tangent,
        wo,
        weight,
        f0,
        whole_sphere,
        cosine_included,
        compensated: false,
        seen: None,
        target: None,
        portals: &[],
        portals_complete: false,
    }
}

fn random_hit(random: &mut Random) -> Sequence {
    let bits = random.bits();
    Sequence { seed: bits as u32, sample: (bits >> 32) as u32, bounce: (random.bits() % 8) as u32 }
}

fn bits(rays: &[Ray]) -> Vec<[u32; 4]> {
    rays.iter().map(|ray| [ray.wi[0], ray.wi[1], ray.wi[2], ray.weight].map(f32::to_bits)).collect()
}

/// At most so many rays as were asked for, of unit length, with a weight, on the side that counts; the same at every call and
/// on every level.
#[test]
fn rays_are_sound_and_the_same_on_every_level() {
    let materials = materials();
    let mut random = Random(101);
    let level = Level::detect();
    for (_, map) in maps() {
        let light = Light::of(&map);
        let environment = light.environment();
        for round in 0..20_000 {
            let point = random_point(&mut random, &materials);
            let at = random_hit(&mut random);
            let rays = [1, 2, 3, 4, 7, 16][round % 6];
            let candidates_per_ray = [0, 0, 0, 1, 9, 20][random.bits() as usize % 6];
            let config = Config { rays: 16, candidates_per_ray, hits_per_pixel: 0, reserved: 0 };
            let [got, again, baseline] = [level, level, Level::BASELINE]
                .map(|level| Thread::with(level, config).direct(&environment, &point, at, rays));
            assert_eq!(bits(&got), bits(&again));
            assert_eq!(bits(&got), bits(&baseline), "{point:?} {at:?}");
            let whole = point.whole_sphere || point.material.transmits();
            for Ray { wi, weight } in got {
                let wi = wi.map(f64::from);
                assert!(weight > 0.0 && weight < f32::INFINITY, "{weight} {point:?} {at:?}");
                assert!((dot(wi, wi) - 1.0).abs() < 1e-5, "{wi:?} {point:?}");
                assert!(whole || dot(wi, point.normal.map(f64::from)) > -1e-6, "{wi:?} {point:?}");
            }
        }
    }
}

/// A light for rays alone has the rays of one with exact tables, to the bit.
#[test]
fn rays_need_no_exact_tables() {
    let materials = materials();
    for (name, map) in maps() {
        for budget in [0.0, 0.02] {
            for compensated in [false, true] {
                let of = Description { budget, compensated, ..description(&map) };
                let lights = [true, false]
                    .map(|rays_only| Light::build(&map, &Description { rays_only, light_only: true, ..of }));
                let mut random = Random(109);
                for round in 0..500 {
                    let (point, at) = (random_point(&mut random, &materials), random_hit(&mut random));
                    let rays = [1, 3, 16][round % 3];
                    let [a, b] =
                        [0, 1].map(|k: usize| Thread::new(16).direct(&lights[k].environment(), &point, at, rays));
                    assert_eq!(bits(&a), bits(&b), "{name}: {budget} {compensated} {point:?}");
                }
            }
        }
    }
}

/// Turns, bounces and seeds give other rays.
#[test]
fn other_hits_have_other_rays() {
    let [(_, map), _] = maps();
    let light = Light::of(&map);
    let client = Client::new(&[Shape::LAMBERT], client::lambert);
    let at = |seed, sample, bounce| {
        bits(&Thread::new(1).direct(&light.environment(), &client.point(), Sequence { seed, sample, bounce }, 1))
    };
    let mut all: Vec<_> = (0..1000u32).map(|k| at(k % 10, k / 10 % 10, k / 100)).collect();
    all.sort_unstable();
    all.dedup();
    assert_eq!(all.len(), 1000);
}

/// Scaling the map by a power of two changes no bit of any ray.
#[test]
fn the_unit_of_radiance_changes_no_bit() {
    let materials = materials();
    for (_, map) in maps() {
        let light = Light::of(&map);
        for k in [-90, -1, 1, 90] {
            let factor = 2f32.powi(k);
            let scaled = Map { pixels: map.pixels.iter().map(|p| p * factor).collect(), ..map.clone() };
            let scaled = Light::of(&scaled);
            let mut random = Random(103);
            for _ in 0..500 {
                let point = random_point(&mut random, &materials);
                let at = random_hit(&mut random);
                let [a, b] = [&light, &scaled].map(|l| bits(&Thread::new(4).direct(&l.environment(), &point, at, 4)));
                assert_eq!(a, b, "2^{k}, {point:?}");
            }
        }
    }
}

#[test]
fn a_black_light_has_no_rays() {
    let materials = materials();
    let mut random = Random(107);
    let light = Light::of(&Map::latlong(64, 32, |_, _| 0.0));
    for _ in 0..1000 {
        let point = random_point(&mut random, &materials);
        assert_eq!(Thread::new(16).direct(&light.environment(), &point, random_hit(&mut random), 16), []);
    }
}

/// A sampler that was made for fewer rays answers those; a call for none answers none.
#[test]
fn rays_are_no_more_than_the_sampler_was_made_for() {
    let [(_, map), _] = maps();
    let (light, client) = (Light::of(&map), Client::new(&[Shape::LAMBERT], client::lambert));
    for made_for in [1, 3, 16] {
        let mut thread = Thread::new(made_for);
        for rays in [0, 1, 5, 16, 40] {
            let got = thread.direct(&light.environment(), &client.point(), first_hit(5), rays);
            assert!(got.len() <= rays.min(made_for as usize));
            assert_eq!(got.is_empty(), rays == 0);
        }
    }
}

/// Light on the far side only: candidates from the light do not count, and what is left still answers rays above the surface.
#[test]
fn light_below_the_surface() {
    let map = one_texel(20, 4);
    let light = Light::build(&map, &Description { exact_zero: true, ..description(&map) });
    let lit = crate::support::vector::rotate(&super::light::TURNED, map.direction(20.5, 4.5));
    let normal = single(unit(lit.map(|c| -c)));
    let material = Material::new(&[Shape::LAMBERT]).unwrap();
    let point = Point::new(&material, normal, normal);
    for seed in 0..1000 {
        for ray in Thread::new(4).direct(&light.environment(), &point, first_hit(seed), 4) {
            assert!(dot(ray.wi.map(f64::from), normal.map(f64::from)) > -1e-6 && ray.weight > 0.0);
        }
    }
}

/// Weights are one over one density of rays, whatever the lobes: their sum estimates the solid angle of the hemisphere. The
/// z-tests have significance 1e-4 together and find a fault of 2 % with power 0.99.
#[test]
fn weights_add_up_to_the_hemisphere() {
    let [(_, map), _] = maps();
    let light = Light::of(&map);
    let ggx = Client::new(&[Shape::ggx(0.3, 0.3)], client::ggx_03);
    for client in [Client::new(&[Shape::LAMBERT], client::lambert), Client::new(&[], client::lambert), ggx] {
        for rays in [1, 4, 16] {
            let mut thread = Thread::new(16);
            let mean = mean_of(corrected(9), |seed| {
                let rays = thread.direct(&light.environment(), &client.point(), first_hit(seed), rays);
                rays.iter().map(|ray| f64::from(ray.weight)).sum()
            });
            let (p, fault) = (mean.p_value(2.0 * PI, 0.0), mean.smallest_fault(corrected(9)));
            println!("{rays} rays: {} p {p:.1e}, finds {:.2} %", mean.mean, 100.0 * fault);
            assert!(p > corrected(9) && fault < 0.02, "{rays} rays: {} p {p:e} {fault}", mean.mean);
        }
    }
}

/// The variance of a call for four rays, over the square of the mean, and the share of rays for which the client's BRDF is 0.
fn noise(client: &Client, point: &Point<'_>, map: &Map) -> (f64, f64) {
    let (light, mut thread) = (Light::of(map), Thread::new(4));
    let (mut sums, mut black, mut all) = ([0.0; 2], 0, 0);
    for seed in 0..1024 {
        let mut sum = 0.0;
        for ray in thread.direct(&light.environment(), point, first_hit(seed), 4) {
            let wi = ray.wi.map(f64::from);
            let response = client.response(wi);
            all += 1;
            black += u32::from(response == 0.0);
            sum += f64::from(ray.weight) * response * map.radiance(Filter::Bilinear, rotate_back(&TURNED, wi))[0];
        }
        sums = [sums[0] + sum, sums[1] + sum * sum];
    }
    let mean = sums[0] / 1024.0;
    (sums[1] / 1024.0 / (mean * mean) - 1.0, f64::from(black) / f64::from(all))
}

/// What docs/integrating.md says of a wo that points into the surface: nothing but noise where one side counts, and rays to the
/// wrong side where both do.
#[test]
fn a_flipped_wo_shows() {
    for (name, map) in maps() {
        let client = Client::new(&[Shape::ggx(0.3, 0.3)], client::ggx_03);
        let flipped = Point { wo: client.point().wo.map(|x| -x), ..client.point() };
        let (right, _) = noise(&client, &client.point(), &map);
        let (wrong, _) = noise(&client, &flipped, &map);
        // Strata follow a light so well that noise without the lobe is 9.5 times as large only.
        assert!(wrong > 8.0 * right, "{name}: {wrong} after {right}");
        let whole = |point| noise(&client, &Point { whole_sphere: true, ..point }, &map);
        let ((_, right), (_, wrong)) = (whole(client.point()), whole(flipped));
        assert!(right < 0.05 && wrong > 0.9, "{name}: {wrong} of the rays are black after {right}");
    }
}
