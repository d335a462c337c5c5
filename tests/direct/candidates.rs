//! What candidates are, seen from outside: they stand in order along the tree of strata and along the lobes' first numbers (rule 39), and what
//! stands for the light's density is never taken for it (rule 24).

use super::client::{self, Client};
use super::light::{Light, TURNED, Thread, first_hit, mean_of};
use super::maps;
use crate::support::Map;
use crate::support::maps::Filter;
use crate::support::statistics::{LARGEST_MISSED, corrected};
use crate::support::vector::{V3, cross, dot, rotate_back, single};
use std::f64::consts::FRAC_PI_4;
use wis::brdf::material::Shape;
use wis::direct::sampler::{Config, Sequence};
use wis::light::environment::Environment;
use wis::light::strata::rectangle;
use wis::simd::Level;

/// The stratum that holds a direction; `None` on borders.
fn stratum(environment: &Environment<'_>, wi: V3) -> Option<usize> {
    let source = environment.source();
    let place = source.chart.place::<f32>(single(rotate_back(&TURNED, wi)));
    let inside = |at: f32, first: f32, length: f32| at > first && at < first + length;
    source.strata.iter().position(|&stratum| {
        let ([column, row, width, height], _) = rectangle(stratum, source.unit);
        inside(place.position[0], column, width) && inside(place.position[1], row, height)
    })
}

/// Which of 2^bits intervals holds the first of the numbers that lead to a direction of a diffuse lobe (Shirley and Chiu 1997).
fn interval(client: &Client, wi: V3, bits: u32) -> u32 {
    let (x, y) = (dot(wi, client.tangent), dot(wi, cross(client.normal, client.tangent)));
    let (radius, steep) = ((x * x + y * y).sqrt(), x.abs() < y.abs());
    let first = if steep { radius * (x / y.abs()).atan() / FRAC_PI_4 } else { radius.copysign(x) };
    ((0.5 + 0.5 * first) * f64::from(1u32 << bits)) as u32
}

/// Rays come in the order of candidates: those of the light ascend along the strata, and then those of a diffuse lobe along its first numbers. Of sets of
/// 8, 16 and 32 in any other order hardly any would.
#[test]
fn picks_follow_the_order_of_candidates() {
    // A lobe without weight that is longer along the tangent: numbers of the other one are then those of the client's axes, too.
    let shapes = [Shape::LAMBERT, Shape::ggx(0.5, 0.4)];
    let client = Client { weight: [1.0, 0.0, 0.0, 0.0], ..Client::new(&shapes, client::lambert) };
    let light = Light::of(&maps()[0].1);
    let environment = light.environment();
    for (candidates_per_ray, bits) in [(1, 3), (2, 4), (4, 5)] {
        let config = Config { rays: 16, candidates_per_ray, hits_per_pixel: 0, reserved: 0 };
        let mut thread = Thread::with(Level::detect(), config);
        let (mut ordered, mut of_light, mut all) = (0, 0, 0);
        for sample in 0..200 {
            let at = Sequence { seed: 3, sample, bounce: 0 };
            let wi: Vec<V3> =
                thread.direct(&environment, &client.point(), at, 16).iter().map(|ray| ray.wi.map(f64::from)).collect();
            let strata: Vec<_> = wi.iter().map(|&wi| stratum(&environment, wi)).collect();
            let of_lobes: Vec<_> = wi.iter().map(|&wi| interval(&client, wi, bits)).collect();
            let ascends = |split: usize| {
                strata[..split].iter().flatten().is_sorted() && of_lobes[split..].is_sorted_by(|a, b| a < b)
            };
            let split = (1..wi.len()).find(|&split| ascends(split));
            ordered += u32::from(split.is_some());
            of_light += split.unwrap_or(0);
            all += wi.len();
        }
        println!("sets of {}: {ordered} of 200 in order, {of_light} of {all} rays from the light", 1 << bits);
        assert!(ordered >= 190, "sets of {}: {ordered} of 200", 1 << bits);
        assert!((0.2..0.8).contains(&(of_light as f64 / all as f64)));
    }
}

/// A light whose look-up, and so what stands for its density, is four times too large in half of its directions.
fn with_wrong_stand_in(map: &Map) -> Vec<u64> {
    let brighter =
        |i: usize| if i / map.channels as usize % map.width as usize * 2 < map.width as usize { 4.0 } else { 1.0 };
    let pixels = map.pixels.iter().enumerate().map(|(i, x)| x * brighter(i)).collect();
    let (own, other) = (Light::of(map), Light::of(&Map { pixels, ..map.clone() }));
    let (own, other) = (own.environment(), other.environment());
    let (words, replaced) = (own.source().radiance.words, other.source().radiance.words);
    assert_eq!(words.len(), replaced.len());
    let first = words.as_ptr() as usize - own.as_bytes().as_ptr() as usize;
    let mut copy = vec![0u64; own.as_bytes().len().div_ceil(8)];
    let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut copy);
    bytes[..own.as_bytes().len()].copy_from_slice(own.as_bytes());
    bytes[first..first + 2 * words.len()].copy_from_slice(bytemuck::cast_slice(replaced));
    copy
}

/// It costs noise and changes no mean.
#[test]
fn a_wrong_stand_in_changes_no_mean() {
    let client = Client::new(&[Shape::LAMBERT], client::lambert);
    for (name, map) in maps() {
        let (integral, error) = client.integral(&map, Filter::Bilinear, 12);
        let words = with_wrong_stand_in(&map);
        let environment = Environment::view(bytemuck::cast_slice(&words)).unwrap();
        for rays in [1, 4] {
            let mut thread = Thread::new(rays as u32);
            let mean = mean_of(corrected(4), |seed| {
                let rays = thread.direct(&environment, &client.point(), first_hit(seed), rays);
                let brings = rays.iter().map(|ray| {
                    let wi = ray.wi.map(f64::from);
                    f64::from(ray.weight)
                        * client.response(wi)
                        * map.radiance(Filter::Bilinear, rotate_back(&TURNED, wi))[0]
                });
                brings.sum()
            });
            let (p, fault) = (mean.p_value(integral, error), mean.smallest_fault(corrected(4)));
            println!("{name}, {rays} rays: {} of {integral}, p {p:.1e}, finds {:.2} %", mean.mean, 100.0 * fault);
            assert!(p > corrected(4) && fault < LARGEST_MISSED, "{name}: {} instead of {integral}", mean.mean);
        }
    }
}
