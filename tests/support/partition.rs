//! The square cut into bins of similar probability, by integrating a pdf over its cells.

use super::quadrature::GAUSS;
use super::vector::V3;
use std::f64::consts::PI;
use wis::sphere::direction_f64;

/// The level of the finest cells of the library.
const FINEST: u32 = 12;

/// A cell of the square with the probability that a pdf gives it.
pub struct Cell {
    pub mass: f64,
    /// Four, or none.
    children: Vec<Cell>,
    /// The number of the bin that the cell is.
    bin: usize,
}

impl Cell {
    /// Integrates a pdf per solid angle of map space. Inside the finest cells of its tree a pdf is bilinear, for which
    /// four points are exact; cells are divided down to `level` and from there on until that changes nothing.
    pub fn integrate(level: u32, pdf: &impl Fn(V3) -> f64) -> Cell {
        Cell::of(0, [0, 0], level, None, pdf)
    }

    /// A cell, whose mass by four points is `estimate` if that is known.
    fn of(level: u32, index: [u32; 2], least: u32, estimate: Option<f64>, pdf: &impl Fn(V3) -> f64) -> Cell {
        let quarters = quarters(index);
        if level < least {
            return Cell::parent(quarters.map(|index| Cell::of(level + 1, index, least, None, pdf)));
        }
        let estimate = estimate.unwrap_or_else(|| gauss(level, index, pdf));
        if level == FINEST {
            return Cell { mass: estimate, children: Vec::new(), bin: 0 };
        }
        let masses = quarters.map(|index| gauss(level + 1, index, pdf));
        let mass: f64 = masses.iter().sum();
        if (mass - estimate).abs() <= 1e-4 * mass + 1e-9 {
            return Cell { mass, children: Vec::new(), bin: 0 };
        }
        let child = |c: usize| Cell::of(level + 1, quarters[c], least, Some(masses[c]), pdf);
        Cell::parent([0, 1, 2, 3].map(child))
    }

    fn parent(children: [Cell; 4]) -> Cell {
        Cell { mass: children.iter().map(|child| child.mass).sum(), children: children.into(), bin: 0 }
    }

    /// Joins the cells with at most `mass` to bins and returns the mass of each bin.
    pub fn join(&mut self, mass: f64) -> Vec<f64> {
        let mut bins = Vec::new();
        self.number(mass, &mut bins);
        bins
    }

    fn number(&mut self, mass: f64, bins: &mut Vec<f64>) {
        if self.mass <= mass || self.children.is_empty() {
            self.children.clear();
            self.bin = bins.len();
            bins.push(self.mass);
        }
        self.children.iter_mut().for_each(|child| child.number(mass, bins));
    }

    /// The bin that holds a point.
    pub fn find(&self, s: [f32; 2]) -> usize {
        if self.children.is_empty() {
            return self.bin;
        }
        let [i, j] = s.map(|s| if s >= 0.5 { 1 } else { 0 });
        self.children[2 * i + j].find([2.0 * s[0] - i as f32, 2.0 * s[1] - j as f32])
    }
}

fn quarters([i, j]: [u32; 2]) -> [[u32; 2]; 4] {
    [[2 * i, 2 * j], [2 * i, 2 * j + 1], [2 * i + 1, 2 * j], [2 * i + 1, 2 * j + 1]]
}

/// The integral over a cell by Gauss' rule with two points per axis.
fn gauss(level: u32, index: [u32; 2], pdf: &impl Fn(V3) -> f64) -> f64 {
    let width = 1.0 / f64::from(1u32 << level);
    let points = index.map(|i| [0.5 - GAUSS, 0.5 + GAUSS].map(|offset| (f64::from(i) + offset) * width));
    let values = points[0].iter().flat_map(|&x| points[1].map(|y| pdf(direction_f64([x, y]))));
    PI * width * width * values.sum::<f64>()
}
