//! Random numbers that all hits of a pixel share: the points of all its samples are one Sobol sequence.
//!
//! Candidate i of a set is point `t block + i` of an Owen-scrambled Sobol sequence, `t` being the shuffled number of the sample and `block` the
//! power of two that holds the set: a smaller block would overlap the next sample's, and of a larger one the first points lie in
//! the same intervals for every sample. Both sets are functions of the first two Sobol coordinates; the pick is the third at the same
//! index. So the pick is uniform for any given candidates, and all three are stratified together. (With one of the first two
//! coordinates for the pick the mean over samples is wrong by some per cent, however many there are.)

use crate::points::{centred, dimension_seed, permute, sobol_in_order, third_sobol};

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
    Portals = 4,
}

/// The pick's number among the sets, and that of samples of a product.
const PICK: u32 = 2;
const SAMPLES: u32 = 4;

impl Points {
    /// Hit number `sample` of the pixel `seed` at the bounce `bounce`.
    pub fn new(seed: u32, sample: u32, bounce: u32) -> Points {
        let seed = dimension_seed(seed, bounce);
        Points { seed, order: permute(sample.reverse_bits(), dimension_seed(seed, 3)).reverse_bits() }
    }

    /// A seed for points of sets of `count` points, a power of two. Sets of different sizes would share points.
    #[inline(always)]
    fn seed(&self, set: u32, count: usize) -> u32 {
        dimension_seed(self.seed, set | (count.max(1) as u32).trailing_zeros() << 3)
    }

    /// The index of the first point of sets of `count` points.
    #[inline(always)]
    fn first(&self, count: usize) -> u32 {
        self.order.wrapping_mul(count.max(1) as u32)
    }

    /// The seed of a set of `count` points, and the index of its first.
    #[inline(always)]
    pub fn set(&self, set: Set, count: usize) -> (u32, u32) {
        (self.seed(set as u32, count), self.first(count))
    }

    /// Point `index` of a set with this seed.
    #[inline(always)]
    pub fn point(seed: u32, index: u32) -> [f32; 2] {
        sobol_in_order(seed, index)
    }

    /// The points of `count` samples of a product, any number of them.
    #[inline(always)]
    pub fn samples(&self, count: usize) -> impl Iterator<Item = [f32; 2]> {
        let count = count as u32;
        let (seed, first) = (dimension_seed(self.seed, SAMPLES | count << 3), self.order.wrapping_mul(count));
        (0..count).map(move |i| Points::point(seed, first.wrapping_add(i)))
    }

    /// The number of the pick among sets of `count` points, in (0, 1).
    #[inline(always)]
    pub fn pick(&self, count: usize) -> f32 {
        let digits = third_sobol(self.first(count));
        centred(permute(digits, self.seed(PICK, count)).reverse_bits())
    }
}
