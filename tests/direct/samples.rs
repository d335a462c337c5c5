//! The numbers of a sample (rule 39): blocks of samples lie apart, shuffled for each bounce; each set and the pick have their own.

use crate::support::statistics::{LARGEST_MISSED, chi_square, chi_square_smallest_fault, corrected};
use wis::direct::joint::{Points, Set};
use wis::direct::sampler::Sequence;

const SEEDS: [u32; 5] = [0, 1, 77, 0xdead_beef, u32::MAX];
const SETS: [Set; 3] = [Set::Light, Set::Lobes, Set::Portals];

fn hit(seed: u32, sample: u32, bounce: u32) -> Points {
    Points::new::<f32>(Sequence { seed, sample, bounce })
}

fn points(sample: Points, set: Set, count: usize) -> impl Iterator<Item = [f32; 2]> {
    let sets = sample.sets::<f32>(count);
    (0..count as u32).map(move |i| sets.at::<f32>(set, i))
}

/// Whether every elementary interval of area 2^-k holds at most one of the points.
fn lie_apart(points: &[[f32; 2]], k: u32) -> bool {
    (0..=k).all(|columns| {
        let mut seen = vec![false; 1 << k];
        points.iter().all(|p| {
            let column = (p[0] * (1u32 << columns) as f32) as usize;
            let row = (p[1] * (1u32 << (k - columns)) as f32) as usize;
            !std::mem::replace(&mut seen[(column << (k - columns)) | row], true)
        })
    })
}

/// The sets of the first 2^m samples are parts of one net: with sets of 2^k points they are the net. Also samples
/// that begin later at a multiple of 2^m.
#[test]
fn sets_of_all_turns_lie_apart() {
    for seed in SEEDS {
        for count in [1usize, 8, 16, 64] {
            for (m, first) in [(0, 3), (4, 0), (7, 0), (6, 5 << 6)] {
                let block = count.next_power_of_two().ilog2();
                for set in SETS {
                    let samples = (first..first + (1 << m)).map(|sample| hit(seed, sample, 1));
                    let all: Vec<[f32; 2]> = samples.flat_map(|sample| points(sample, set, count)).collect();
                    assert!(lie_apart(&all, m + block), "{set:?} of {count}, 2^{m} samples from {first}, seed {seed}");
                }
            }
        }
    }
}

/// Numbers of a sample that must fill the space between them: those of two bounces, of two sets, of the candidates and the pick.
#[test]
fn numbers_of_a_turn_are_independent() {
    const SAMPLES: u32 = 1 << 19;
    const PARTS: usize = 4;
    let first = |seed, sample, bounce, set| points(hit(seed, sample, bounce), set, 1).next().unwrap();
    type Numbers<'a> = &'a dyn Fn(u32, u32) -> [f32; 3];
    let cases: [(&str, Numbers); 3] = [
        ("bounces", &|seed, sample| {
            let ([x, _], [y, z]) = (first(seed, sample, 0, Set::Light), first(seed, sample, 1, Set::Light));
            [x, y, z]
        }),
        ("bounces", &|seed, sample| {
            let [x, y, z] = [1, 2, 3].map(|bounce| first(seed, sample, bounce, Set::Light)[0]);
            [x, y, z]
        }),
        ("candidates and pick", &|seed, sample| {
            let [x, y] = first(seed, sample, 0, Set::Light);
            [x, y, hit(seed, sample, 0).sets::<f32>(1).pick::<f32>()]
        }),
    ];
    let significance = corrected(cases.len() * SEEDS.len());
    for (name, numbers) in cases {
        for seed in SEEDS {
            let mut counts = vec![0; PARTS.pow(3)];
            for sample in 0..SAMPLES {
                let cell = numbers(seed, sample).iter().fold(0, |cell, x| PARTS * cell + (x * PARTS as f32) as usize);
                counts[cell] += 1;
            }
            let expected = vec![f64::from(SAMPLES) / counts.len() as f64; counts.len()];
            let result = chi_square(&counts, &expected);
            let fault = chi_square_smallest_fault(result.degrees, f64::from(SAMPLES), significance);
            println!("{name}, seed {seed}: p {:.4}, finds {fault:.4}", result.p_value);
            assert!(fault <= LARGEST_MISSED, "finds only faults of {fault}");
            assert!(result.p_value > significance, "{name}, seed {seed}: p {:e}", result.p_value);
        }
    }
}

/// A set has a scramble of its own: no two place their points alike, but for the first digits of the first number, which are those of the candidate.
#[test]
fn sets_are_scrambled_apart() {
    for seed in SEEDS {
        let sample = hit(seed, 3, 0);
        let placed = SETS.map(|set| points(sample, set, 64).collect::<Vec<_>>());
        for pair in [[0, 1], [0, 2], [1, 2]] {
            let [one, other] = pair.map(|set| placed[set].iter());
            let alike = one.zip(other).filter(|(a, b)| (a[1] - b[1]).abs() < 1.0 / 64.0).count();
            assert!(alike < 16, "{alike} of 64 points");
        }
    }
}
