//! Picks from a pool: as many as asked for, in proportion to the weights, spread over the sphere, without bias.

use crate::support::{Memory, Random};
use std::ptr::null_mut;
use wis::ffi::MemorySize;
use wis::ffi::pool::{Candidates, wis_pool_pick, wis_pool_size};
use wis::pool::{Pick, key, places, sort};
use wis::status::Status;

/// Picks, with the sum of the weights.
fn pick(wi: &[[f32; 3]], weight: &[f32], picks: u32, u: f32) -> Result<(Vec<Pick>, f64), Status> {
    let mut size = MemorySize::default();
    let mut chosen = vec![Pick::default(); picks as usize];
    let (mut count, mut sum) = (0, f64::NAN);
    // SAFETY: all arrays are as long as the header says.
    let status = unsafe {
        assert_eq!(wis_pool_size(wi.len(), &mut size), Status::Ok);
        let mut scratch = Memory::filled(size.bytes, 0xa5);
        wis_pool_pick(
            &Candidates {
                size: size_of::<Candidates>() as u32,
                reserved: 0,
                count: wi.len(),
                wi: wi.as_ptr().cast(),
                wi_stride: 0,
                weight: weight.as_ptr(),
                weight_stride: 0,
            },
            picks,
            u,
            scratch.pointer(),
            size.bytes,
            chosen.as_mut_ptr(),
            &mut count,
            &mut sum,
            null_mut(),
        )
    };
    chosen.truncate(count as usize);
    if status == Status::Ok { Ok((chosen, sum)) } else { Err(status) }
}

fn candidates(count: usize, seed: u64) -> (Vec<[f32; 3]>, Vec<f32>) {
    let mut random = Random(seed);
    let wi = (0..count).map(|_| random.direction().map(|c| c as f32)).collect();
    let weight = (0..count).map(|i| if i % 3 == 0 { 0.0 } else { (random.f32() * 6.0).exp2() }).collect();
    (wi, weight)
}

#[test]
fn picks_are_as_many_as_asked_for_and_within_one_of_their_share() {
    for (count, picks) in [(1, 1), (2, 5), (7, 3), (24, 6), (25, 6), (64, 16), (256, 64), (5000, 1000), (3, 100_000)] {
        let (wi, weight) = candidates(count + 1, count as u64);
        let total: f64 = weight.iter().map(|&w| f64::from(w)).sum();
        for u in [0.0, 1e-9, 0.3, 0.999_999_94, 1.0, f32::NAN, -2.0] {
            let (chosen, sum) = pick(&wi, &weight, picks, u).unwrap();
            assert!((sum / total - 1.0).abs() < 1e-12);
            assert_eq!(chosen.iter().map(|p| p.multiplicity).sum::<u32>(), picks);
            for p in &chosen {
                let share = f64::from(weight[p.candidate as usize]) / total * f64::from(picks);
                assert!((f64::from(p.multiplicity) - share).abs() < 1.0 + 1e-6, "{p:?} of {share}");
            }
            let mut numbers: Vec<u32> = chosen.iter().map(|p| p.candidate).collect();
            numbers.sort_unstable();
            numbers.dedup();
            assert_eq!(numbers.len(), chosen.len());
        }
    }
}

/// Picks come in the order of the curve, whatever the order of the candidates: neighbouring thresholds then fall on
/// neighbouring directions, which is what spreads the picks.
#[test]
fn picks_follow_the_curve() {
    for count in [20, 400, 5000] {
        let (wi, _) = candidates(count, 3);
        let (chosen, _) = pick(&wi, &vec![1.0; count], count as u32 / 2, 0.5).unwrap();
        let place = |p: &Pick| places::<f32>(wi[p.candidate as usize])[0];
        let along: Vec<u32> = chosen.iter().map(place).collect();
        assert!(along.is_sorted(), "{count} candidates: {along:?}");
    }
}

/// Over evenly spread u the multiplicities average to the shares: the pool has no bias.
#[test]
fn multiplicities_are_the_shares_in_expectation() {
    let (wi, weight) = candidates(40, 5);
    let total: f64 = weight.iter().map(|&w| f64::from(w)).sum();
    let (rounds, picks) = (1 << 14, 7);
    let mut sums = vec![0.0; wi.len()];
    for round in 0..rounds {
        let u = (round as f32 + 0.5) / rounds as f32;
        for p in pick(&wi, &weight, picks, u).unwrap().0 {
            sums[p.candidate as usize] += f64::from(p.multiplicity) / f64::from(rounds);
        }
    }
    for (sum, weight) in sums.iter().zip(&weight) {
        let share = f64::from(*weight) / total * f64::from(picks);
        assert!((sum - share).abs() < 2.0 / f64::from(rounds), "{sum} for {share}");
    }
}

#[test]
fn what_cannot_be_picked_is_not() {
    let (wi, _) = candidates(9, 1);
    let (chosen, sum) = pick(&wi, &[0.0; 9], 5, 0.5).unwrap();
    assert!(chosen.is_empty() && sum == 0.0);
    assert_eq!(pick(&[], &[], 5, 0.5).unwrap(), (vec![], 0.0));
    assert_eq!(pick(&wi, &[1.0; 9], 0, 0.5).unwrap().0, vec![]);
    for bad in [-1.0, f32::NAN, f32::INFINITY] {
        let mut weight = [1.0; 9];
        weight[4] = bad;
        assert_eq!(pick(&wi, &weight, 5, 0.5).unwrap_err(), Status::InvalidArgument);
    }
    // Weights far apart, and as small and large as they come.
    let (chosen, _) = pick(&wi[..3], &[1e-45, 3e38, 1e-45], 4, 0.0).unwrap();
    assert!(chosen.iter().map(|p| p.multiplicity).sum::<u32>() == 4 && chosen.iter().any(|p| p.candidate == 1));
    // Directions that are none still have a place.
    let odd = [[f32::NAN; 3], [0.0; 3], [f32::INFINITY, 0.0, 0.0], [1e38, 1e38, -1e38]];
    assert_eq!(pick(&odd, &[1.0; 4], 4, 0.5).unwrap().0.len(), 4);
    let mut size = MemorySize::default();
    // SAFETY: the pointer is to a live value or null.
    unsafe {
        assert_eq!(wis_pool_size(1 << 25, &mut size), Status::Overflow);
        assert_eq!(wis_pool_size(4, null_mut()), Status::NullPointer);
    }
}

#[test]
fn keys_sort_as_numbers_do() {
    for count in [0, 1, 2, 24, 25, 300, 5000] {
        let mut random = Random(count as u64);
        let mut keys: Vec<u64> = (0..count).map(|i| key(random.bits() as u32 & 0xffff, i)).collect();
        let (mut expected, mut spare) = (keys.clone(), keys.clone());
        expected.sort_unstable();
        sort(&mut keys, &mut spare);
        assert_eq!(keys, expected);
    }
}

/// Places that follow one another are close on the sphere: on average the step is a small part of it.
#[test]
fn neighbours_on_the_curve_are_close() {
    let mut random = Random(4);
    let mut placed: Vec<(u32, [f64; 3])> = (0..4096)
        .map(|_| {
            let d = random.direction();
            (places::<f32>(d.map(|c| c as f32))[0], d)
        })
        .collect();
    placed.sort_by_key(|p| p.0);
    let step = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    let mean = placed.windows(2).map(|pair| step(pair[0].1, pair[1].1)).sum::<f64>() / 4095.0;
    // Points of 4096 cells are about .055 apart; jumps of the curve add to that.
    assert!(mean < 0.11, "{mean}");
}
