//! What candidates for rays read of a light: strata to draw from, and the radiance at any direction.

use super::chart::{Chart, Layout};
use super::radiance::Radiance;
use crate::simd::Num;

/// A light as a source of candidates.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// Directions and positions.
    pub chart: Chart,
    /// The map.
    pub radiance: Radiance<'a>,
    /// Rectangles of equal probability that tile all faces: column, row (counted over all faces), width and height.
    pub strata: &'a [[f32; 4]],
    /// The mean radiance over the sphere.
    pub mean: f32,
    /// One over the integral of what candidates are drawn by; 0 for a black light.
    pub inverse_power: f32,
}

/// What candidates are drawn by keeps this part of the radiance below the mean.
pub const DIM: f32 = 0.25;

impl Source<'_> {
    /// What stands for the density of candidates where the light has a radiance: a function of it alone.
    #[inline(always)]
    pub fn stand_in<F: Num>(&self, radiance: F) -> F {
        (radiance - self.mean).max(radiance * DIM) * self.inverse_power
    }

    /// Directions of map space for two numbers in (0, 1); the face and position of each, and one over its density.
    #[inline(always)]
    pub fn sample<F: Num>(&self, [u, v]: [F; 2]) -> ([F; 3], F, [F; 2], F) {
        let count = self.strata.len() as i32 as f32;
        let scaled = u * count;
        let index = scaled.to_whole();
        let [column, row, width, height] = F::rows(self.strata, index);
        let (x, y) = (column + width * (scaled - F::of_whole(index)), row + height * v);
        let (face, y) = if self.chart.layout == Layout::Cube {
            let rows = self.chart.axes[1].length;
            // By its middle: no stratum spans two faces, and rounding leads to none from there.
            let face = F::of_whole(((row + height * 0.5) * (1.0 / rows)).to_whole());
            (face, y - face * rows)
        } else {
            (F::splat(0.0), y)
        };
        let (direction, angle) = self.chart.direction_and_angle(face, [x, y]);
        (direction, face, [x, y], width * height * (angle * count))
    }
}
