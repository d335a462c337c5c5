//! Sampling the texels of a map by their light: the environment sampling of the peers. Rows and columns by the
//! inverse of their cumulative distribution, which keeps the stratification of the points, found in constant time with
//! a guide table (Chen and Asau 1974).

use crate::lanes::{Directions, F8, LANES, V8};
use crate::layout::Position;
use crate::light::Light;

/// A distribution over the texels of a light. For a client that interpolates it has two texels in place of one along each axis,
/// filled with interpolated values, as pbrt's has.
pub struct Texels {
    /// The map of those texels, where it is not the light itself.
    fine: Option<Light>,
    /// Radiance of each texel of a light that is not interpolated.
    radiance: Vec<f32>,
    probability: Vec<f32>,
    rows: Inverse,
    columns: Inverse,
}

impl Texels {
    /// Proportional to radiance x solid angle.
    pub fn plain(light: &Light) -> Texels {
        Texels::new(light, |radiance, _| radiance)
    }

    /// Proportional to what radiance has above its mean (Karlik et al. 2019).
    pub fn compensated(light: &Light) -> Texels {
        Texels::new(light, |radiance, mean| (radiance - mean).max(0.0))
    }

    fn new(light: &Light, weight: impl Fn(f64, f64) -> f64) -> Texels {
        let fine = light.is_bilinear().then(|| light.doubled());
        let grid = fine.as_ref().unwrap_or(light);
        let [width, height] = grid.size();
        let (solid_angle, means) = (grid.solid_angles(), grid.luminance());
        let total: f64 = means.iter().zip(&solid_angle).map(|(&l, a)| f64::from(l) * a).sum();
        let mean = total / solid_angle.iter().sum::<f64>();
        let weighted = |i: usize| weight(f64::from(means[i]), mean) * solid_angle[i];
        let mut weights: Vec<f64> = (0..width * height).map(weighted).collect();
        if weights.iter().all(|&w| w == 0.0) {
            weights.copy_from_slice(&solid_angle);
        }
        let columns = Inverse::new(width, &weights);
        let rows = Inverse::new(height, &weights.chunks(width).map(|row| row.iter().sum()).collect::<Vec<f64>>());
        let probability = |i: usize| rows.probability(0, i / width) * columns.probability(i / width, i % width);
        let probability = (0..width * height).map(probability).collect();
        let radiance = if fine.is_none() { means.to_vec() } else { Vec::new() };
        Texels { fine, radiance, probability, rows, columns }
    }

    /// Draws `u.len()` directions into `wi`, from number `first` on.
    pub fn sample(&self, light: &Light, u: &[[f32; 2]], wi: &mut Directions, first: usize) {
        for (block, u) in u.chunks(LANES).enumerate() {
            let (mut column, mut row) = ([0.5; LANES], [0.5; LANES]);
            // Rows first, so that the look-ups of columns do not wait for one another.
            let mut rows = [0; LANES];
            for (i, u) in u.iter().enumerate() {
                let (y, inside) = self.rows.find(0, u[1]);
                (rows[i], row[i]) = (y, y as f32 + inside);
            }
            for (i, u) in u.iter().enumerate() {
                let (x, inside) = self.columns.find(rows[i], u[0]);
                column[i] = x as f32 + inside;
            }
            let at = Position { column: F8::new(column), row: F8::new(row) };
            wi.store(first + block * LANES, self.fine.as_ref().unwrap_or(light).direction(at));
        }
    }

    /// Radiance from the first `used` directions; 0 for the others, unless the light is interpolated.
    #[inline]
    pub fn radiance(&self, light: &Light, wi: V8, used: usize) -> F8 {
        light.interpolated(wi).unwrap_or_else(|| look_up(&self.radiance, light.texels(wi).0, used))
    }

    /// The same, and the pdf of `sample`.
    #[inline]
    pub fn eval(&self, light: &Light, wi: V8, used: usize) -> (F8, F8) {
        let (texels, density) = self.fine.as_ref().unwrap_or(light).texels(wi);
        let radiance = light.interpolated(wi).unwrap_or_else(|| look_up(&self.radiance, texels, used));
        (radiance, look_up(&self.probability, texels, used) * density)
    }
}

/// Values of the first `used` texels; 0 for the others.
#[inline]
fn look_up(from: &[f32], texels: [usize; LANES], used: usize) -> F8 {
    let mut values = [0.0; LANES];
    values.iter_mut().zip(texels).take(used).for_each(|(value, texel)| *value = from[texel]);
    F8::new(values)
}

/// The inverses of cumulative distributions over cells.
struct Inverse {
    cells: usize,
    /// Bounds of the cells of each distribution; one more than there are cells.
    cumulative: Vec<f32>,
    /// The first cell that may hold i / slots, for each distribution.
    guide: Vec<u16>,
}

impl Inverse {
    /// Distributions of so many cells each.
    fn new(cells: usize, weights: &[f64]) -> Inverse {
        let mut inverse = Inverse { cells, cumulative: Vec::new(), guide: Vec::new() };
        weights.chunks(cells).for_each(|weights| inverse.push(weights));
        inverse
    }

    fn push(&mut self, weights: &[f64]) {
        let total: f64 = weights.iter().sum();
        let start = self.cumulative.len();
        let mut sum = 0.0;
        self.cumulative.push(0.0);
        for weight in weights {
            sum += weight;
            self.cumulative.push(if total > 0.0 { (sum / total) as f32 } else { 0.0 });
        }
        // A distribution that is dark has no probability, and is never entered.
        self.cumulative[start + self.cells] = 1.0;
        let mut cell = 0;
        for i in 0..self.cells {
            // Slots are powers of two or not; u x slots may then be rounded up, and a slot begins a little earlier.
            let from = (i as f32 / self.cells as f32) * (1.0 - 1e-6);
            while self.cumulative[start + cell + 1] <= from {
                cell += 1;
            }
            self.guide.push(cell as u16);
        }
    }

    fn probability(&self, distribution: usize, cell: usize) -> f32 {
        let bounds = &self.cumulative[distribution * (self.cells + 1)..];
        bounds[cell + 1] - bounds[cell]
    }

    /// The cell that holds `u`, and where in it.
    #[inline]
    fn find(&self, distribution: usize, u: f32) -> (usize, f32) {
        let slot = ((u * self.cells as f32) as usize).min(self.cells - 1);
        let mut cell = usize::from(self.guide[distribution * self.cells + slot]);
        let bounds = &self.cumulative[distribution * (self.cells + 1)..][..self.cells + 1];
        // Most slots hold the bounds of few cells: steps that need no prediction, then the rest.
        cell += usize::from(bounds[cell + 1] <= u);
        cell += usize::from(bounds[cell + 1] <= u);
        while bounds[cell + 1] <= u {
            cell += 1;
        }
        let [low, high] = [bounds[cell], bounds[cell + 1]];
        (cell, ((u - low) / (high - low)).min(0.999_999_9))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_meets_the_cumulative_distribution() {
        let weights: Vec<f64> = (0..37).map(|i| f64::from(i * i % 11)).collect();
        let inverse = Inverse::new(37, &weights);
        for k in 0..1 << 16 {
            let u = (k as f32 + 0.5) / 65536.0;
            let (cell, inside) = inverse.find(0, u);
            assert!(weights[cell] > 0.0 && (0.0..1.0).contains(&inside));
            let back = inverse.cumulative[cell] + inside * inverse.probability(0, cell);
            assert!((back - u).abs() < 1e-6);
        }
    }
}
