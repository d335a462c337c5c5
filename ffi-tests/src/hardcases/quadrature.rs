//! Integrals over the sphere that do not sample: a quadtree on the lat-long square, finer about a peak and wherever Gauss's rule
//! of three points disagrees with itself on the quarters of a cell.

use super::brdf::{V3, dot};
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

/// Cells are at least that fine: 2^START along the polar angle, twice as many around.
const START: u32 = 6;
/// The finest: 2^MOST along the polar angle.
const MOST: u32 = 17;
const NODES: [f64; 3] = [0.112_701_665_379_258_31, 0.5, 0.887_298_334_620_741_7];
const WEIGHTS: [f64; 3] = [5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0];

/// Values in nine directions.
pub type Values<'a> = &'a dyn Fn(&[V3; 9]) -> [f64; 9];

/// Where to look closely, and at what scale.
#[derive(Clone, Copy, Debug)]
pub struct Peak {
    pub at: V3,
    pub detail: f64,
}

/// A cell of the square, with what it integrates to.
pub struct Cell {
    level: u32,
    pub integral: f64,
    quarters: Option<Box<[Cell; 4]>>,
}

impl Cell {
    fn divided(level: u32, quarters: [Cell; 4]) -> Cell {
        let integral = quarters.iter().map(|cell| cell.integral).sum();
        Cell { level, integral, quarters: Some(Box::new(quarters)) }
    }
}

/// A direction by azimuth and polar angle, in turns of the circle and shares of pi.
fn direction(u: f64, v: f64) -> V3 {
    let ((sine, cosine), (y, x)) = ((PI * v).sin_cos(), (TAU * u).sin_cos());
    [sine * x, sine * y, cosine]
}

/// The place of a direction.
fn place([x, y, z]: V3) -> [f64; 2] {
    [y.atan2(x).rem_euclid(TAU) / TAU, x.hypot(y).atan2(z) / PI]
}

/// An integral over the sphere; each cell is right to about `tolerance`.
pub struct Integral {
    cells: [Cell; 2],
    pub value: f64,
}

impl Integral {
    pub fn new(of: Values, peaks: &[Peak], tolerance: f64) -> Integral {
        let cells = [0, 1].map(|x| refine(of, peaks, tolerance, [0, x, 0], f64::NAN));
        let value = cells.iter().map(|cell| cell.integral).sum();
        Integral { cells, value }
    }

    /// The same to a relative accuracy: about `relative` in all.
    pub fn relative(of: Values, peaks: &[Peak], relative: f64) -> Integral {
        let rough = Integral::new(of, peaks, f64::INFINITY);
        // A few hundred cells matter.
        Integral::new(of, peaks, rough.value * relative / 300.0)
    }

    /// Parts of the sphere that hold at most `share` of the integral each, where cells are that fine.
    pub fn bins(&self, share: f64) -> Bins<'_> {
        let mut bins = Bins { integral: self, of: Vec::new(), number: HashMap::new(), most: share * self.value };
        for cell in &self.cells {
            bins.add(cell);
        }
        bins
    }
}

/// Parts of the sphere, each a cell.
pub struct Bins<'a> {
    integral: &'a Integral,
    /// What each holds.
    pub of: Vec<f64>,
    number: HashMap<*const Cell, usize>,
    most: f64,
}

impl<'a> Bins<'a> {
    fn is_bin(&self, cell: &Cell) -> bool {
        cell.integral <= self.most || cell.quarters.is_none()
    }

    fn add(&mut self, cell: &'a Cell) {
        match &cell.quarters {
            Some(quarters) if !self.is_bin(cell) => quarters.iter().for_each(|quarter| self.add(quarter)),
            _ => {
                self.number.insert(cell, self.of.len());
                self.of.push(cell.integral);
            }
        }
    }

    /// How many directions lie in each.
    pub fn counts(&self, directions: impl Iterator<Item = V3>) -> Vec<usize> {
        let mut counts = vec![0; self.of.len()];
        for wi in directions {
            let [u, v] = place(wi);
            let at = |x: f64, cells: u32| ((x * f64::from(cells)) as u32).min(cells - 1);
            let root = at(u, 2) as usize;
            let mut cell = &self.integral.cells[root];
            while let Some(quarters) = cell.quarters.as_ref().filter(|_| !self.is_bin(cell)) {
                let (x, y) = (at(u, 4 << cell.level), at(v, 2 << cell.level));
                cell = &quarters[(2 * (y & 1) + (x & 1)) as usize];
            }
            counts[self.number[&std::ptr::from_ref(cell)]] += 1;
        }
        counts
    }
}

fn rule(of: Values, level: u32, x: u32, y: u32) -> f64 {
    let (columns, rows) = (f64::from(2u32 << level), f64::from(1u32 << level));
    let at = |k: usize| {
        let (u, v) = ((f64::from(x) + NODES[k % 3]) / columns, (f64::from(y) + NODES[k / 3]) / rows);
        (direction(u, v), (PI * v).sin() * WEIGHTS[k % 3] * WEIGHTS[k / 3])
    };
    let points: [(V3, f64); 9] = std::array::from_fn(at);
    let values = of(&points.map(|(wi, _)| wi));
    let sum: f64 = values.iter().zip(points).map(|(value, (_, weight))| value * weight).sum();
    sum * TAU / columns * PI / rows
}

fn refine(of: Values, peaks: &[Peak], tolerance: f64, [level, x, y]: [u32; 3], value: f64) -> Cell {
    let leaf = Cell { level, integral: value, quarters: None };
    if level >= MOST {
        return leaf;
    }
    let place = |k: u32| [level + 1, 2 * x + (k & 1), 2 * y + (k >> 1)];
    if level < START {
        let quarters = std::array::from_fn(|k| {
            let [level, x, y] = place(k as u32);
            let value = if level < START { f64::NAN } else { rule(of, level, x, y) };
            refine(of, peaks, tolerance, [level, x, y], value)
        });
        return Cell::divided(level, quarters);
    }
    let (columns, rows) = (f64::from(2u32 << level), f64::from(1u32 << level));
    let middle = direction((f64::from(x) + 0.5) / columns, (f64::from(y) + 0.5) / rows);
    let size = PI / rows;
    let graded = peaks.iter().any(|peak| {
        let distance = dot(middle, peak.at).clamp(-1.0, 1.0).acos();
        size > 0.5 * peak.detail + 0.25 * (distance - 1.5 * size).max(0.0)
    });
    if !graded && tolerance == f64::INFINITY {
        return leaf;
    }
    let parts: [f64; 4] = std::array::from_fn(|k| {
        let [level, x, y] = place(k as u32);
        rule(of, level, x, y)
    });
    let sum: f64 = parts.iter().sum();
    if !graded && (sum - value).abs() <= tolerance {
        return Cell { integral: sum, ..leaf };
    }
    Cell::divided(level, std::array::from_fn(|k| refine(of, peaks, tolerance, place(k as u32), parts[k])))
}

#[cfg(test)]
mod tests {
    use super::*;

    const UP: [Peak; 1] = [Peak { at: [0.0, 0.0, 1.0], detail: 1.0 }];

    fn each(of: impl Fn(V3) -> f64) -> impl Fn(&[V3; 9]) -> [f64; 9] {
        move |wi| wi.map(&of)
    }

    #[test]
    fn integrals_of_known_functions() {
        let sphere = Integral::relative(&each(|_| 1.0), &UP, 1e-6);
        assert!((sphere.value / (4.0 * PI) - 1.0).abs() < 1e-7, "{}", sphere.value);
        // A kink at the horizon, askew to all cells.
        let normal = [0.36, 0.48, 0.8];
        let cosine = Integral::relative(&each(|wi| dot(wi, normal).max(0.0)), &UP, 1e-4);
        assert!((cosine.value / PI - 1.0).abs() < 1e-4, "{}", cosine.value);
        // A lobe of a thousandth: the integral of exp(k (cos - 1)) is 2 pi / k.
        let lobe = each(|wi: V3| (1e6 * (dot(wi, normal) - 1.0)).exp());
        let lobe = Integral::relative(&lobe, &[Peak { at: normal, detail: 1e-3 }], 1e-4);
        assert!((lobe.value * 1e6 / TAU - 1.0).abs() < 1e-4, "{}", lobe.value);
    }

    #[test]
    fn bins_hold_what_lies_in_them() {
        let integral = Integral::relative(&each(|wi: V3| 1.0 + wi[2]), &UP, 1e-6);
        let bins = integral.bins(1e-3);
        assert!((bins.of.iter().sum::<f64>() / integral.value - 1.0).abs() < 1e-9);
        assert!((1000..4000).contains(&bins.of.len()), "{}", bins.of.len());
        // Directions spread evenly in the density fall into each bin as often as it says.
        let golden = |k: u32| (f64::from(k) * 0.618_033_988_749_895).fract();
        let spread = |k: u32| {
            let (z, phi) = (2.0 * ((f64::from(k) + 0.5) / 1e6).sqrt() - 1.0, TAU * golden(k));
            [(1.0 - z * z).sqrt() * phi.cos(), (1.0 - z * z).sqrt() * phi.sin(), z]
        };
        let counts = bins.counts((0..1_000_000).map(spread));
        let off = |(count, of): (&usize, &f64)| (*count as f64 - of / integral.value * 1e6).abs();
        let most = counts.iter().zip(&bins.of).map(off).fold(0.0, f64::max);
        assert!(most < 60.0, "{most}");
    }
}
