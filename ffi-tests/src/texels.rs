//! Sampling the texels of a map by their light: the environment sampling of the peers. Rows and columns by the
//! inverse of their cumulative distribution, which keeps the stratification of the points, found in constant time with
//! a guide table (Chen and Asau 1974).

use crate::lanes::{Directions, F8, LANES, V8};
use crate::layout::Position;
use crate::light::Light;

/// A distribution over the texels of a light, and what a look-up of a texel needs.
pub struct Texels {
    /// Radiance and probability of each texel.
    looked_up: Vec<[f32; 2]>,
    rows: Inverse,
    columns: Vec<Inverse>,
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
        let [width, height] = light.size();
        let solid_angle = light.solid_angles();
        let radiance = light.luminance();
        let total: f64 = radiance.iter().zip(&solid_angle).map(|(&l, a)| f64::from(l) * a).sum();
        let mean = total / solid_angle.iter().sum::<f64>();
        let weighted = |i: usize| weight(f64::from(radiance[i]), mean) * solid_angle[i];
        let mut weights: Vec<f64> = (0..width * height).map(weighted).collect();
        if weights.iter().all(|&w| w == 0.0) {
            weights.copy_from_slice(&solid_angle);
        }
        let columns: Vec<Inverse> = weights.chunks(width).map(Inverse::new).collect();
        let rows = Inverse::new(&weights.chunks(width).map(|row| row.iter().sum()).collect::<Vec<f64>>());
        let probability = |i: usize| rows.probability(i / width) * columns[i / width].probability(i % width);
        let looked_up = (0..width * height).map(|i| [radiance[i], probability(i)]).collect();
        Texels { looked_up, rows, columns }
    }

    /// Draws `u.len()` directions into `wi`, from number `first` on.
    pub fn sample(&self, light: &Light, u: &[[f32; 2]], wi: &mut Directions, first: usize) {
        for (block, u) in u.chunks(LANES).enumerate() {
            let (mut column, mut row) = ([0.5; LANES], [0.5; LANES]);
            for (i, u) in u.iter().enumerate() {
                let (y, in_row) = self.rows.find(u[1]);
                let (x, in_column) = self.columns[y].find(u[0]);
                (column[i], row[i]) = (x as f32 + in_column, y as f32 + in_row);
            }
            let at = Position { column: F8::new(column), row: F8::new(row) };
            wi.store(first + block * LANES, light.direction(at));
        }
    }

    /// Radiance from directions, and the pdf of `sample`.
    #[inline]
    pub fn eval(&self, light: &Light, wi: V8) -> (F8, F8) {
        let (texels, density) = light.texels(wi);
        let looked_up = texels.map(|texel| self.looked_up[texel]);
        let (radiance, probability) = (looked_up.map(|t| t[0]), looked_up.map(|t| t[1]));
        (F8::new(radiance), F8::new(probability) * density)
    }
}

/// The inverse of a cumulative distribution over cells.
struct Inverse {
    /// Bounds of the cells; one more than there are cells.
    cumulative: Vec<f32>,
    /// The first cell that may hold i / cells.
    guide: Vec<u32>,
}

impl Inverse {
    fn new(weights: &[f64]) -> Inverse {
        let total: f64 = weights.iter().sum();
        let mut sum = 0.0;
        let mut cumulative = vec![0.0];
        for weight in weights {
            sum += weight;
            cumulative.push(if total > 0.0 { (sum / total) as f32 } else { 0.0 });
        }
        // A row that is dark has no probability, and is never entered.
        *cumulative.last_mut().expect("one bound") = 1.0;
        let mut cell = 0;
        let guide = (0..weights.len()).map(|i| {
            while cumulative[cell + 1] <= i as f32 / weights.len() as f32 {
                cell += 1;
            }
            cell as u32
        });
        Inverse { guide: guide.collect(), cumulative }
    }

    fn probability(&self, cell: usize) -> f32 {
        self.cumulative[cell + 1] - self.cumulative[cell]
    }

    /// The cell that holds `u`, and where in it.
    #[inline]
    fn find(&self, u: f32) -> (usize, f32) {
        let slot = ((u * self.guide.len() as f32) as usize).min(self.guide.len() - 1);
        let mut cell = self.guide[slot] as usize;
        while self.cumulative[cell + 1] <= u {
            cell += 1;
        }
        // `slot / cells` may be rounded to above u.
        while cell > 0 && self.cumulative[cell] > u {
            cell -= 1;
        }
        let [low, high] = [self.cumulative[cell], self.cumulative[cell + 1]];
        (cell, ((u - low) / (high - low)).min(0.999_999_9))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_meets_the_cumulative_distribution() {
        let weights: Vec<f64> = (0..37).map(|i| f64::from(i * i % 11)).collect();
        let inverse = Inverse::new(&weights);
        for k in 0..1 << 16 {
            let u = (k as f32 + 0.5) / 65536.0;
            let (cell, inside) = inverse.find(u);
            assert!(weights[cell] > 0.0 && (0.0..1.0).contains(&inside));
            let back = inverse.cumulative[cell] + inside * inverse.probability(cell);
            assert!((back - u).abs() < 1e-6);
        }
    }
}
