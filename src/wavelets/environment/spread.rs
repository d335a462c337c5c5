//! How light is spread within a region, and the squares below cells in which it varies.

use super::integrate::Moments;
use bytemuck::{Pod, Zeroable};

/// A square below a cell, in the units of the input.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Refined {
    /// Luminance of the children as it is sampled: the root of the mean square, or the average of what is below.
    pub luminance: [f64; 4],
    /// Average RGB of the children, if it is kept.
    pub rgb: [[f32; 3]; 4],
    /// What varies within the children: see [`Spread::variation`].
    pub(super) variation: [f64; 4],
    /// The place of the square among those of its level along each axis.
    pub(super) index: [u32; 2],
}

/// The share of the brightest light in a region that is the least to store for it: a corner of a lamp that reaches into
/// a dark cell then gives a weight of 32, however small it is (rule 33).
const LEAST_OF_BRIGHTEST: f64 = 1.0 / 32.0;

/// How light is spread within a region, relative to its mean. Scaling changes no bit.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Spread {
    /// mean(L^2) / mean(L)^2 - 1
    variance: f32,
    brightest: f32,
}

impl Spread {
    pub(super) fn of(moments: Moments) -> Spread {
        let [first, second] = moments.average;
        if first > 0.0 {
            let variance = (second / (first * first) - 1.0).max(0.0) as f32;
            Spread { variance, brightest: (moments.largest / first) as f32 }
        } else {
            Spread::default()
        }
    }

    /// A value for a region of a mean, or more if that is little beside its brightest light.
    pub(super) fn least(&self, value: f64, mean: f64) -> f64 {
        value.max(mean * f64::from(self.brightest) * LEAST_OF_BRIGHTEST)
    }

    /// What sampling a region of a share of the sphere uniformly adds to the variance, times the mean over the sphere.
    pub(super) fn variation(&self, mean: f64, area: f64) -> f64 {
        f64::from(self.variance) * mean * area
    }
}
