//! A visibility prior: which parts of the sphere were seen from about here. Counts of rays in 64 cells become a factor
//! of a density; the pdf stays exact, because it is that of whatever density was prepared.
//!
//! Cells of equal solid angle are those of level 3 of the octahedral square, so they coincide with cells of a product's
//! tree. Nothing is learned inside a pixel (splitting its samples would cost more stratification than they teach): the
//! counts come from other pixels.

use crate::numeric::{max, sqrt};

/// The square has 2^LEVEL cells along each axis.
pub const LEVEL: u32 = 3;
/// Cells of a prior.
pub const WIS_PRIOR_CELLS: usize = 64;

/// No cell weighs less: shadows have edges inside a cell, and other pixels see other things.
const FLOOR: f32 = 0.1;
/// How many rays the mean over all cells counts as in each of them.
const SMOOTHING: f32 = 2.0;

/// Rays that were traced from some place, cell by cell; all 0 before the first. Plain and copyable.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Prior {
    /// sizeof(wis_prior).
    pub size: u32,
    /// Always 0.
    pub reserved: u32,
    /// Rays that reached the light, at most as many as were traced.
    pub visible: [u32; WIS_PRIOR_CELLS],
    /// Rays that were traced.
    pub traced: [u32; WIS_PRIOR_CELLS],
}

impl Prior {
    /// Whether no cell has more visible rays than rays.
    pub fn is_sound(&self) -> bool {
        self.reserved == 0 && self.visible.iter().zip(&self.traced).all(|(visible, traced)| visible <= traced)
    }

    /// Counts a ray to a point of the square.
    pub fn count(&mut self, s: [f32; 2], visible: bool) {
        let cell = cell(s);
        // Where a count is full, both stay as they are.
        if let (Some(seen), Some(traced)) = (self.visible.get_mut(cell), self.traced.get_mut(cell)) {
            if *traced < u32::MAX {
                *traced += 1;
                *seen += u32::from(visible);
            }
        }
    }

    /// Adds the counts of another; those that would overflow stay as they are.
    pub fn add(&mut self, other: &Prior) {
        let counts = self.visible.iter_mut().zip(&mut self.traced);
        for ((visible, traced), (more_visible, more)) in counts.zip(other.visible.iter().zip(&other.traced)) {
            if let Some(sum) = traced.checked_add(*more) {
                *traced = sum;
                *visible += more_visible;
            }
        }
    }

    /// Halves all counts, rounding down.
    pub fn halve(&mut self) {
        self.visible.iter_mut().chain(&mut self.traced).for_each(|count| *count /= 2);
    }

    /// What each cell weighs: (sqrt(v (1 - v)) + v) / 2 with v the visible share, smoothed towards the mean of all
    /// cells; at least 0.1. The root keeps the edges of shadows in sight, the other term prefers what is seen.
    pub fn weights(&self) -> [f32; WIS_PRIOR_CELLS] {
        let sum = |counts: &[u32]| counts.iter().map(|&count| u64::from(count)).sum::<u64>();
        let (visible, traced) = (sum(&self.visible), sum(&self.traced));
        let mean = if traced > 0 { (visible as f64 / traced as f64) as f32 } else { 1.0 };
        let mut weights = [0.0; WIS_PRIOR_CELLS];
        for (weight, (&visible, &traced)) in weights.iter_mut().zip(self.visible.iter().zip(&self.traced)) {
            let share = (visible as f32 + SMOOTHING * mean) / (traced as f32 + SMOOTHING);
            *weight = max(0.5 * (sqrt(share * max(1.0 - share, 0.0)) + share), FLOOR);
        }
        weights
    }
}

/// The cell that contains a point of the square.
pub fn cell(s: [f32; 2]) -> usize {
    let [i, j] = s.map(|s| ((s * (1 << LEVEL) as f32) as usize).min((1 << LEVEL) - 1));
    (i << LEVEL) + j
}

/// The mean weight over cell `index` of 2^level along each axis.
pub fn mean_weight(weights: &[f32; WIS_PRIOR_CELLS], level: u32, index: [u16; 2]) -> f32 {
    let [i, j] = index.map(usize::from);
    let Some(coarser) = LEVEL.checked_sub(level) else {
        let finer = level.saturating_sub(LEVEL) & 31;
        return at(weights, i >> finer, j >> finer);
    };
    let side = 1usize << coarser;
    let mut sum = 0.0;
    for di in 0..side {
        for dj in 0..side {
            sum += at(weights, i * side + di, j * side + dj);
        }
    }
    sum / (side * side) as f32
}

fn at(weights: &[f32; WIS_PRIOR_CELLS], i: usize, j: usize) -> f32 {
    weights.get((i << LEVEL) + j).copied().unwrap_or(FLOOR)
}
