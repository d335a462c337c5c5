//! Picks among candidates, by the letter of rule 24: which weights they get, and what a ray weighs.

use super::client::{Client, mixture};
use super::light::{Light, Thread};
use super::maps;
use crate::support::Random;
use wis::brdf::material::Shape;
use wis::brdf::point::Point;
use wis::direct::group::Group;
use wis::direct::pick::{FLOOR, FLOOR_IN_THE_DARK, pick};
use wis::direct::sampler::{Config, Sequence};
use wis::simd::{Four, GROUP, Level};

/// The share of the mean that every candidate has at least, and that where little of the light was seen.
const C: f64 = 0.04;
const IN_THE_DARK: f64 = 0.25;

/// The share of the picks that candidates of the light have at least.
const OF_LIGHT: f64 = 0.25;

/// Directions, densities and target over density of candidates; an infinite density: the candidate does not count.
struct Columns {
    place: [Vec<f32>; 3],
    density: Vec<f32>,
    weight: Vec<f32>,
}

impl Columns {
    fn random(random: &mut Random, count: usize) -> Columns {
        let mut column = |of: &dyn Fn(f32) -> f32| (0..count).map(|_| of(random.f32())).collect::<Vec<f32>>();
        let density = column(&|u| if u < 0.2 { f32::INFINITY } else { (10.0 * u).exp2() });
        let dark: Vec<f32> = column(&|u| if u < 0.3 { 0.0 } else { (12.0 * u).exp2() });
        let weight = dark.iter().zip(&density).map(|(w, d)| if *d < f32::INFINITY { *w } else { 0.0 }).collect();
        let number = (0..count).map(|i| i as f32).collect();
        Columns { place: [number, vec![0.0; count], vec![1.0; count]], density, weight }
    }

    /// The numbers of the picked candidates and the weights of their rays.
    fn pick(&self, rays: usize, u: f32) -> Vec<(usize, f64)> {
        self.pick_from(0, FLOOR, rays, u)
    }

    fn pick_from(&self, light: usize, floor: f32, rays: usize, u: f32) -> Vec<(usize, f64)> {
        let mut groups = vec![Group::default(); self.weight.len() / GROUP];
        for (group, first) in groups.iter_mut().zip((0..).step_by(GROUP)) {
            let part = |column: &[f32]| column[first..first + GROUP].try_into().unwrap();
            group.direction = self.place.each_ref().map(|column| part(column));
            (group.density, group.weight) = (part(&self.density), part(&self.weight));
        }
        let mut picked = Vec::new();
        let count = pick::<Four>(&mut groups, light, floor, rays, u, |ray, [x, ..], weight| {
            assert_eq!(ray, picked.len());
            picked.push((x as usize, f64::from(weight)));
        });
        assert_eq!(count, picked.len());
        picked
    }
}

/// w = v g / q + c mean(v g / q) where a candidate counts, else 0, with v = 1 but for candidates of the light that have less than their share; a ray that stands for m picks weighs m S / (N w q), and all picks are
/// spent. So the sum of (ray's weight) w q is S, whatever is picked.
#[test]
fn weights_are_those_of_the_rule() {
    let mut random = Random(131);
    for round in 0..4000 {
        let (count, rays) = ([8, 16, 24, 64][round % 4], [1, 2, 3, 4, 15, 40][round % 6]);
        let (floor, c) = [(FLOOR, C), (FLOOR_IN_THE_DARK, IN_THE_DARK)][round % 5 % 2];
        let (light, scale) = ([0, 1][round % 7 % 2], [1.0, 1e-3, 1e-12][round % 11 % 3]);
        let mut given = Columns::random(&mut random, count);
        given.weight[..GROUP * light].iter_mut().for_each(|weight| *weight *= scale);
        let sum = |weight: &[f32]| weight.iter().map(|&w| f64::from(w)).sum::<f64>();
        let (of_light, others) = (sum(&given.weight[..GROUP * light]), sum(&given.weight[GROUP * light..]));
        let share = OF_LIGHT.min(1.0 / rays as f64);
        let growth = if of_light > 0.0 { f64::max(1.0, others * share / (1.0 - share) / of_light) } else { 1.0 };
        let mean = (growth * of_light + others) / count as f64;
        let counts = |i: usize| given.density[i] < f32::INFINITY;
        // Without any target all that count are alike.
        let expected = |i: usize| match (counts(i), mean > 0.0) {
            (false, _) => 0.0,
            (true, true) => f64::from(given.weight[i]) * if i < GROUP * light { growth } else { 1.0 } + c * mean,
            (true, false) => 1.0,
        };
        let sum: f64 = (0..count).map(expected).sum();
        let picked =
            Columns { place: given.place.clone(), density: given.density.clone(), weight: given.weight.clone() }
                .pick_from(light, floor, rays, random.f32());
        assert!(picked.len() <= rays && picked.is_empty() == (sum == 0.0));
        let mut all = 0.0;
        for &(i, weight) in &picked {
            assert!(counts(i), "a candidate that does not count");
            let times = weight * rays as f64 * expected(i) * f64::from(given.density[i]) / sum;
            let share = rays as f64 * expected(i) / sum;
            assert!((times - times.round()).abs() < 1e-3 && times > 0.5, "{times} picks");
            assert!((times - share).abs() < 1.001, "{times} picks of {share}");
            all += times;
        }
        assert!(picked.is_empty() || (all - rays as f64).abs() < 1e-2, "{all} of {rays} picks");
    }
}

/// Candidates of the light have their share where a pixel has four picks, in a call or over its hits, and none under a compensated light.
#[test]
fn pixels_of_four_picks_give_the_light_its_share() {
    let light = Light::of(&maps()[0].1);
    let client = Client::new(&[Shape::ggx(0.05, 0.05)], mixture);
    let rays = |rays: u32, hits_per_pixel: u32, compensated: bool| {
        let config = Config { rays, candidates_per_ray: 0, hits_per_pixel, reserved: 0 };
        let mut thread = Thread::with(Level::detect(), config);
        let point = Point { compensated, ..client.point() };
        let at = |sample| Sequence { seed: 3, sample, bounce: 0 };
        (0..8).map(|sample| thread.direct(&light.environment(), &point, at(sample), rays as usize)).collect::<Vec<_>>()
    };
    assert_eq!(rays(1, 0, false), rays(1, 3, false));
    assert_ne!(rays(1, 0, false), rays(1, 4, false));
    assert_eq!(rays(4, 0, false), rays(4, 1, false));
    assert_eq!(rays(1, 0, true), rays(1, 4, true));
}

/// Targets at the ends of f32, of a lobe whose tail alone meets the light for instance: no ray loses its weight, and the mean stays.
#[test]
fn tiny_and_huge_targets_leave_no_weight_behind() {
    const SAMPLES: usize = 1 << 10;
    let mut random = Random(139);
    for scale in [3e-49, 1e-48, 1e-44, 1e-38, 1e-33, 1e-20, 1e20, 1e34] {
        let mut given = Columns::random(&mut random, 16);
        given.weight.iter_mut().for_each(|weight| *weight = (f64::from(*weight) * scale) as f32);
        let counting = given.density.iter().filter(|density| **density < f32::INFINITY).count() as f64;
        let mut sum = 0.0;
        for sample in 0..SAMPLES {
            for (i, weight) in given.pick(4, (sample as f32 + 0.5) / SAMPLES as f32) {
                assert!(weight > 0.0 && weight < f64::from(f32::MAX), "{scale}: a weight of {weight}");
                sum += weight * f64::from(given.density[i]) / SAMPLES as f64;
            }
        }
        assert!((sum / counting - 1.0).abs() < 0.02, "{scale}: {sum} of {counting} candidates");
    }
}

/// Over evenly spread u a candidate is picked N w / S times: also those whose target is 0.
#[test]
fn candidates_are_picked_in_proportion() {
    const SAMPLES: usize = 1 << 12;
    let mut random = Random(137);
    for rays in [1, 3] {
        let given = Columns::random(&mut random, 24);
        let mean = given.weight.iter().map(|&w| f64::from(w)).sum::<f64>() / 24.0;
        let expected = |i: usize| {
            if given.density[i] < f32::INFINITY { f64::from(given.weight[i]) + C * mean } else { 0.0 }
        };
        let sum: f64 = (0..24).map(expected).sum();
        let mut times = [0.0; 24];
        for sample in 0..SAMPLES {
            let u = (sample as f32 + 0.5) / SAMPLES as f32;
            let again =
                Columns { place: given.place.clone(), density: given.density.clone(), weight: given.weight.clone() };
            for (i, weight) in again.pick(rays, u) {
                times[i] += weight * rays as f64 * expected(i) * f64::from(given.density[i]) / sum / SAMPLES as f64;
            }
        }
        for (i, times) in times.iter().enumerate() {
            let share = rays as f64 * expected(i) / sum;
            assert!((times - share).abs() < 2e-3, "candidate {i} of {rays} rays: {times} for {share}");
        }
    }
}
