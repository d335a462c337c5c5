//! Products that hits of a pixel share: unbiased for hits that differ in normal, view and texture; forgotten between pixels.

use super::client::{self, Client};
use super::light::{Light, TURNED, Thread, description};
use super::maps;
use crate::support::Random;
use crate::support::maps::Filter;
use crate::support::statistics::{Mean, corrected};
use crate::support::vector::{V3, add, cross, dot, luminance, rotate_back, scale, single, unit};
use wis::brdf::material::Shape;
use wis::brdf::point::Point;
use wis::direct::Ray;
use wis::direct::sampler::{Config, Sequence};
use wis::light::plan::Description;
use wis::simd::Level;

const HITS: u32 = 16;

fn sharing(level: Level) -> Thread {
    Thread::with(level, Config { rays: 4, candidates_per_ray: 0, hits_per_pixel: HITS, reserved: 0 })
}

/// The client with its normal turned: across the surface of a smooth mesh, and now and then farther than a product reaches.
fn turned(client: &Client, random: &mut Random) -> Client {
    let across = cross(client.normal, client.tangent);
    let reach = if random.f64() < 0.1 { 0.8 } else { 0.1 };
    let tilt = [0; 2].map(|_| reach * (random.f64() - 0.5));
    let offset = add(scale(client.tangent, tilt[0]), scale(across, tilt[1]));
    Client { normal: unit(add(client.normal, offset)), ..client.clone() }
}

/// What the rays of a hit bring.
fn brings(rays: &[Ray], response: impl Fn(V3) -> f64, radiance: impl Fn(V3) -> f64) -> f64 {
    let each = rays.iter().map(|ray| {
        let wi = ray.wi.map(f64::from);
        f64::from(ray.weight) * response(wi) * radiance(wi)
    });
    each.sum()
}

/// The mean over pixels of hits with products of one another is the mean of their own integrals, which candidates estimate without
/// any sharing; both are random, and their difference finds a fault of 2 %. Some hits find no product, since the pixel has enough of them.
#[test]
fn shared_products_are_unbiased() {
    are_unbiased(false);
}

/// The same under a compensated light, of which rays bring what exceeds the mean.
#[test]
fn shared_products_of_a_compensated_light_are_unbiased() {
    are_unbiased(true);
}

fn are_unbiased(compensated: bool) {
    for (name, map) in maps() {
        let light = Light::build(&map, &Description { compensated, ..description(&map) });
        let base = if compensated { light.environment().header().mean } else { 0.0 };
        let lambert = Client::new(&[Shape::LAMBERT], client::lambert);
        let glossy = Client::new(&[Shape::ggx(0.3, 0.3)], client::ggx_03);
        for (what, client) in [("Lambert", lambert), ("GGX", glossy)] {
            let (mut shares, mut own) = (sharing(Level::detect()), Thread::new(4));
            let (mut difference, mut size) = (Mean::default(), 0.0);
            for pixel in 0..12_000 {
                let mut random = Random(u64::from(pixel));
                shares.begin_pixel();
                let mut sum = 0.0;
                for sample in 0..HITS {
                    let hit = turned(&client, &mut random);
                    // A texture: it changes weights only, and no product knows it.
                    let texture = 0.2 + random.f64();
                    let point = Point { weight: [[texture as f32; 3]; 4], compensated, ..hit.point() };
                    let radiance = |wi: V3| {
                        let radiance = map.radiance(Filter::Bilinear, rotate_back(&TURNED, wi));
                        (1.0 - (base / luminance(radiance)).min(1.0)) * radiance[0] * texture
                    };
                    let at = Sequence { seed: pixel, sample, bounce: 0 };
                    let environment = light.environment();
                    let with = brings(&shares.direct(&environment, &point, at, 1), |wi| hit.response(wi), radiance);
                    let without = brings(&own.direct(&environment, &point, at, 1), |wi| hit.response(wi), radiance);
                    sum += (with - without) / f64::from(HITS);
                    size += without / f64::from(HITS);
                }
                difference.add(sum);
            }
            let (mean, size) = (difference.mean, size / difference.count);
            let error = difference.standard_error();
            println!(
                "{name}, {what}: {mean} of {size}, {:.2} standard errors, each {:.2} %",
                mean / error,
                100.0 * error / size
            );
            assert!(difference.p_value(0.0, 0.0) > corrected(8), "{name}, {what}: {mean} of {size}");
            assert!(6.3 * error < 0.02 * size);
        }
    }
}

#[test]
fn rays_are_the_same_on_every_level_and_after_every_pixel() {
    let (_, map) = &maps()[1];
    let light = Light::of(map);
    let client = Client::new(&[Shape::LAMBERT, Shape::ggx(0.4, 0.25)], client::mixture);
    let pixel = |thread: &mut Thread, pixel: u32| {
        thread.begin_pixel();
        let mut random = Random(u64::from(pixel));
        let mut bits = Vec::new();
        for sample in 0..HITS {
            let hit = turned(&client, &mut random);
            let at = Sequence { seed: pixel, sample, bounce: 0 };
            for ray in thread.direct(&light.environment(), &hit.point(), at, 3) {
                assert!(ray.weight > 0.0 && ray.weight < f32::INFINITY);
                bits.extend(ray.wi.map(f32::to_bits));
                bits.push(ray.weight.to_bits());
            }
        }
        bits
    };
    let (mut thread, mut baseline) = (sharing(Level::detect()), sharing(Level::BASELINE));
    let forth: Vec<_> = (0..40).map(|k| pixel(&mut thread, k)).collect();
    let back: Vec<_> = (0..40).rev().map(|k| pixel(&mut baseline, k)).collect();
    assert!(forth.iter().eq(back.iter().rev()));
}

/// Points lead through one product: the same point gives the same direction at hits that share it.
#[test]
fn hits_share_a_product() {
    let light = Light::of(&maps()[0].1);
    let client = Client::new(&[Shape::LAMBERT], client::lambert);
    let mut thread = sharing(Level::detect());
    thread.begin_pixel();
    let other = Client { normal: unit(add(client.normal, scale(client.tangent, 0.05))), ..client.clone() };
    let far = Client { normal: client.tangent, tangent: client.normal, ..client.clone() };
    let [here, there, away, again] = [&client, &other, &far, &client].map(|client| {
        let at = Sequence { seed: 1, sample: 0, bounce: 0 };
        thread.direct(&light.environment(), &client.point(), at, 1)
    });
    assert_eq!((&here, &here), (&there, &again));
    assert_ne!(here, away);
    assert_eq!(single(here[0].wi.map(f64::from)), here[0].wi);
}

/// A product belongs to its light: of two lights in one pixel each has its own.
#[test]
fn another_light_has_another_product() {
    let [(_, sky), (_, sun)] = maps();
    let (sky, sun) = (Light::of(&sky), Light::of(&sun));
    let client = Client::new(&[Shape::LAMBERT], client::lambert);
    let at = Sequence { seed: 1, sample: 0, bounce: 0 };
    let mut thread = sharing(Level::detect());
    let mut rays = |light: &Light| thread.direct(&light.environment(), &client.point(), at, 1);
    rays(&sky);
    let behind = rays(&sun);
    let alone = sharing(Level::detect()).direct(&sun.environment(), &client.point(), at, 1);
    assert_eq!(behind, alone);
}

/// Whether the sampler draws rays of a hit from a product: they are not, to the bit, those that are chosen among candidates.
fn draws_a_product(thread: &mut Thread, light: &Light, client: &Client, at: Sequence) -> bool {
    // A pixel of so few hits shares no product, and gives the light its share of the picks as one of many hits does.
    let few = Config { rays: 1, candidates_per_ray: 0, hits_per_pixel: 4, reserved: 0 };
    let [shared, own] = [thread, &mut Thread::with(Level::detect(), few)]
        .map(|thread| thread.direct(&light.environment(), &client.point(), at, 1));
    shared != own
}

#[test]
fn later_bounces_share_no_products() {
    let light = Light::of(&maps()[1].1);
    let client = Client::new(&[Shape::LAMBERT], client::lambert);
    let mut thread = sharing(Level::detect());
    for sample in 0..HITS {
        let drawn =
            [0, 1].map(|bounce| draws_a_product(&mut thread, &light, &client, Sequence { seed: 5, sample, bounce }));
        assert_eq!(drawn, [true, false]);
    }
}

/// A product that is a little off misses a lobe of 0.19; one of 0.2 is wide enough.
#[test]
fn narrow_lobes_share_no_products() {
    let light = Light::of(&maps()[1].1);
    for (alpha, shares) in [(0.05, false), (0.19, false), (0.2, true), (0.5, true)] {
        for shapes in [vec![Shape::ggx(alpha, alpha)], vec![Shape::LAMBERT, Shape::ggx(0.6, alpha)]] {
            let client = Client::new(&shapes, client::mixture);
            let mut thread = sharing(Level::detect());
            let at = |sample| Sequence { seed: 5, sample, bounce: 0 };
            let drawn: Vec<_> = (0..8).map(|k| draws_a_product(&mut thread, &light, &client, at(k))).collect();
            assert_eq!(drawn, [shares; 8], "{alpha}");
        }
    }
}

/// The points of 64 hits are spread over both dimensions of the product: half behind a blocker, the variance of a pixel's mean is below half that
/// of picks among candidates (measured 0.17). 400 pixels know their ratio within a fifth; 64 independent points have 1.5.
#[test]
fn hits_of_a_pixel_are_spread() {
    let [(_, map), _] = maps();
    let light = Light::of(&map);
    let client = Client::new(&[Shape::LAMBERT], client::lambert);
    let edge = unit(add(client.tangent, scale(cross(client.normal, client.tangent), 0.4)));
    let variance = |mut thread: Thread| {
        let mut all = Mean::default();
        for seed in 0..400 {
            thread.begin_pixel();
            let hits = (0..64).map(|sample| {
                let rays =
                    thread.direct(&light.environment(), &client.point(), Sequence { seed, sample, bounce: 0 }, 1);
                let seen = |wi: V3| if dot(wi, edge) > 0.1 { client.response(wi) } else { 0.0 };
                brings(&rays, seen, |wi| map.radiance(Filter::Bilinear, rotate_back(&TURNED, wi))[0])
            });
            all.add(hits.sum());
        }
        all.standard_error().powi(2)
    };
    let ratio = variance(sharing(Level::detect())) / variance(Thread::new(1));
    println!("{ratio:.3} of the variance of candidates");
    assert!(ratio < 0.5, "{ratio}");
}

/// Normals in all directions: four hits have products of their own, which stay, and the fifth is chosen among candidates. One product more
/// or less is seen.
#[test]
fn a_pixel_has_four_products() {
    let light = Light::of(&maps()[0].1);
    let client = Client::new(&[Shape::LAMBERT], client::lambert);
    let (t, n) = (client.tangent, client.normal);
    let normals = [n, t, cross(n, t), scale(t, -1.0), scale(cross(n, t), -1.0)];
    let mut thread = sharing(Level::detect());
    for pixel in 0..8 {
        thread.begin_pixel();
        let mut draws = |&normal: &V3| {
            let along = dot(normal, client.tangent).abs() > 0.5;
            let hit = Client { normal, tangent: if along { client.normal } else { client.tangent }, ..client.clone() };
            draws_a_product(&mut thread, &light, &hit, Sequence { seed: pixel, sample: 0, bounce: 0 })
        };
        assert_eq!(normals.each_ref().map(&mut draws), [true, true, true, true, false]);
        assert!(draws(&n));
    }
}
