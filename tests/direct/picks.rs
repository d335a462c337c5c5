//! Picks among candidates, by the letter of rule 24: which weights they get, and what a ray weighs.

use crate::support::Random;
use wis::direct::candidates::Candidates;
use wis::direct::pick::pick;

/// The share of the mean that every candidate has at least.
const C: f64 = 0.05;

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

    fn again(&self) -> Columns {
        Columns { place: self.place.clone(), density: self.density.clone(), weight: self.weight.clone() }
    }

    /// The numbers of the picked candidates and the weights of their rays.
    fn pick(&mut self, rays: usize, u: f32) -> Vec<(usize, f64)> {
        let [x, y, z] = &mut self.place;
        let mut candidates = Candidates { x, y, z, density: &mut self.density, weight: &mut self.weight };
        let mut picked = Vec::new();
        let count = pick(&mut candidates, rays, u, |ray, [x, ..], weight| {
            assert_eq!(ray, picked.len());
            picked.push((x as usize, f64::from(weight)));
        });
        assert_eq!(count, picked.len());
        picked
    }
}

/// What the rule says of given candidates: w = g / q + c mean(g / q) where one counts, else 0; and the picks of each in expectation.
fn rule(given: &Columns, rays: usize) -> (Vec<f64>, Vec<f64>) {
    let count = given.weight.len();
    let mean = given.weight.iter().map(|&w| f64::from(w)).sum::<f64>() / count as f64;
    // Without any target all that count are alike.
    let weight = |i: usize| match (given.density[i] < f32::INFINITY, mean > 0.0) {
        (false, _) => 0.0,
        (true, true) => f64::from(given.weight[i]) + C * mean,
        (true, false) => 1.0,
    };
    let weights: Vec<f64> = (0..count).map(weight).collect();
    let sum_of = |set: &dyn Fn(f64) -> bool| weights.iter().filter(|w| set(**w)).sum::<f64>();
    let is_faint = |w: f64| C * mean * 1.000001 < w && w <= mean;
    let (all, faint) = (sum_of(&|_| true), sum_of(&is_faint));
    let kept = (rays / 8).max(1) as f64;
    let is_split = rays >= 4 && faint > 0.0 && faint * (rays as f64) < kept * all;
    let picks = |w: f64| match (is_split, is_faint(w)) {
        (false, _) => rays as f64 * w / all,
        (true, true) => kept * w / faint,
        (true, false) => (rays as f64 - kept) * w / (all - faint),
    };
    let picks = weights.iter().map(|&w| picks(w)).collect();
    (weights, picks)
}

/// A ray that stands for m picks weighs m over its candidate's picks in expectation, over q, and all picks are spent.
#[test]
fn weights_are_those_of_the_rule() {
    let mut random = Random(131);
    for round in 0..4000 {
        let (count, rays) = ([8, 16, 24, 64][round % 4], [1, 2, 3, 4, 15, 40][round % 6]);
        let given = Columns::random(&mut random, count);
        let (weights, shares) = rule(&given, rays);
        let picked = given.again().pick(rays, random.f32());
        assert!(picked.len() <= rays && picked.is_empty() == (weights.iter().sum::<f64>() == 0.0));
        let mut all = 0.0;
        for &(i, weight) in &picked {
            assert!(weights[i] > 0.0, "a candidate that does not count");
            let times = weight * shares[i] * f64::from(given.density[i]);
            assert!((times - times.round()).abs() < 1e-3 && times > 0.5, "{times} picks");
            assert!((times - shares[i]).abs() < 1.001, "{times} picks of {}", shares[i]);
            all += times;
        }
        assert!(picked.is_empty() || (all - rays as f64).abs() < 1e-2, "{all} of {rays} picks");
    }
}

/// Over evenly spread u a candidate is picked as often as the rule says: also those whose target is 0.
#[test]
fn candidates_are_picked_in_proportion() {
    const TURNS: usize = 1 << 12;
    let mut random = Random(137);
    for rays in [1, 3, 4, 16] {
        let given = Columns::random(&mut random, 24);
        let (_, shares) = rule(&given, rays);
        let mut times = [0.0; 24];
        for turn in 0..TURNS {
            let u = (turn as f32 + 0.5) / TURNS as f32;
            for (i, weight) in given.again().pick(rays, u) {
                times[i] += weight * shares[i] * f64::from(given.density[i]) / TURNS as f64;
            }
        }
        for (i, (times, share)) in times.iter().zip(&shares).enumerate() {
            assert!((times - share).abs() < 2e-3, "candidate {i} of {rays} rays: {times} for {share}");
        }
    }
}

/// Of eight rays one goes to the faint candidates, and the sum is what all of them bring: nothing is lost where all is visible.
#[test]
fn faint_candidates_get_a_ray_of_eight() {
    let (bright, faint) = (8, 56);
    let weight: Vec<f32> = (0..bright + faint).map(|i| if i < bright { 100.0 } else { 0.01 }).collect();
    let number = (0..weight.len()).map(|i| i as f32).collect();
    let given = Columns {
        place: [number, vec![0.0; weight.len()], vec![1.0; weight.len()]],
        density: vec![2.0; weight.len()],
        weight,
    };
    let (weights, _) = rule(&given, 8);
    for turn in 0..64 {
        let picked = given.again().pick(8, (turn as f32 + 0.5) / 64.0);
        assert_eq!(picked.iter().filter(|(i, _)| *i >= bright).count(), 1);
        let brought: f64 = picked.iter().map(|&(i, weight)| weight * weights[i] * 2.0).sum();
        assert!((brought / weights.iter().sum::<f64>() - 1.0).abs() < 1e-5);
    }
}
