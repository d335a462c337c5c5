//! Random numbers that all hits of a pixel share: the points of all its samples are one Sobol sequence.
//!
//! Candidate i of a set is point `t block + i` of an Owen-scrambled Sobol sequence, `t` being the shuffled number of the sample and `block` the
//! power of two that holds the set: a smaller block would overlap the next sample's, and of a larger one the first points lie in
//! the same intervals for every sample. Both sets are functions of the first two Sobol coordinates; the pick is the third at the same
//! index. So the pick is uniform for any given candidates, and all three are stratified together. (With one of the first two
//! coordinates for the pick the mean over samples is wrong by some per cent, however many there are.)

use crate::points::{
    centres, dimension_seed, further_seeds, permuted, shuffled, sobol_fractions, sobol_in_order, third_sobol,
};
use crate::simd::{GROUP, Num, Whole};

/// Where the hits of a pixel are in its random numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sequence {
    /// The pixel.
    pub seed: u32,
    /// The number of the hit among all hits of the pixel and the bounce, over all passes.
    pub sample: u32,
    /// The bounce.
    pub bounce: u32,
}

/// A hit among all hits of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Points {
    /// The pixel.
    seed: u32,
    /// The shuffled number of the sample.
    order: u32,
}

/// Sets of points of a hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Set {
    /// Candidates from the light.
    Light,
    /// Candidates from the lobes.
    Lobes,
    /// Candidates from portals. 2 is the pick's.
    Portals = 3,
}

/// The pick's number among the sets, and that of samples of a product.
const PICK: u32 = 2;
const SAMPLES: u32 = 4;

impl Points {
    /// Those of a hit.
    #[inline(always)]
    pub fn new<F: Num>(Sequence { seed, sample, bounce }: Sequence) -> Points {
        let seed = dimension_seed(seed, bounce);
        let order = F::ints_of(shuffled(F::Whole::splat(sample), dimension_seed(seed, 3)));
        Points { seed, order: order.as_ref().first().copied().unwrap_or_default() }
    }

    /// The sets of `count` points each, a power of two. Sets of different sizes would share points, if seeds did not tell them apart.
    #[inline(always)]
    pub fn sets<F: Num>(&self, count: usize) -> Sets {
        let (count, mut seeds) = (count.max(1) as u32, [0; GROUP]);
        let bits = count.trailing_zeros();
        for at in (0..GROUP).step_by(F::WIDTH) {
            let numbers = F::counted() + F::Whole::splat(at as u32 + GROUP as u32 * bits);
            let further = F::ints_of(further_seeds(self.seed, numbers));
            seeds.iter_mut().skip(at).zip(further.as_ref()).for_each(|(seed, further)| *seed = *further);
        }
        let interval = ((1u64 << 32) >> bits) as u32;
        Sets { seeds, first: self.order.wrapping_mul(count), last: count - 1, interval }
    }

    /// The points of `count` samples of a product, any number of them.
    #[inline(always)]
    pub fn samples(&self, count: usize) -> impl Iterator<Item = [f32; 2]> {
        let count = count as u32;
        let (seed, first) = (dimension_seed(self.seed, SAMPLES | count << 3), self.order.wrapping_mul(count));
        (0..count).map(move |i| sobol_in_order(seed, first.wrapping_add(i)))
    }
}

/// Sets of points of a hit in the order of their first numbers: candidates then stand in order, and systematic picks are spread over
/// directions (rule 39).
#[derive(Clone, Copy, Debug)]
pub struct Sets {
    /// Of both numbers of each set.
    seeds: [u32; GROUP],
    /// The index of the first point.
    first: u32,
    /// The number of the last point of a set.
    last: u32,
    /// The part of 2^32 in which each has its first number.
    interval: u32,
}

impl Sets {
    #[inline(always)]
    fn seed(&self, set: u32, number: usize) -> u32 {
        self.seeds[(2 * set as usize + number) % GROUP]
    }

    /// The numbers of candidates from one on. Candidate k of 2^m lies in interval k: its index ends with the m digits of k in reverse, shuffled so
    /// that each depends on those before it, as by a nested uniform scramble of the first number.
    #[inline(always)]
    pub fn at<F: Num>(&self, set: Set, candidate: u32) -> [F; 2] {
        let seeds = [0, 1].map(|number: usize| self.seed(set as u32, number));
        let (seed, interval) = (F::Whole::splat(seeds[0]), F::Whole::splat(self.interval));
        let begin = (F::Whole::splat(candidate) + F::counted()) * interval;
        let digits = begin.reverse_bits() + seed;
        let digits = digits ^ (digits * seed).shl::<1>();
        let order = F::Whole::splat(self.first) | digits & F::Whole::splat(self.last);
        let [x, y] = sobol_fractions(seeds, order);
        [centres(begin | x & (interval + F::Whole::splat(u32::MAX))), centres(y)]
    }

    /// The number of the pick, in (0, 1).
    #[inline(always)]
    pub fn pick<F: Num>(&self) -> f32 {
        let digits = permuted(F::Whole::splat(third_sobol(self.first)), self.seed(PICK, 0));
        centres::<F>(digits.reverse_bits()).store().as_ref().first().copied().unwrap_or_default()
    }
}
