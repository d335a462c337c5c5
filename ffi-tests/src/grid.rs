//! Pairs of bilinear functions on the unit square, one pair for each of some parameters, looked up for eight points at once.

use crate::lanes::{F8, LANES};

/// The two slices about a parameter.
#[derive(Clone, Copy, Debug, Default)]
pub struct Slices {
    pub index: [usize; 2],
    /// Of the second.
    weight: f32,
}

impl Slices {
    /// Those about a parameter, of slices at ascending ones.
    pub fn about(parameters: &[f32], parameter: f32) -> Slices {
        let last = parameters.len() - 1;
        let above = parameters.partition_point(|&p| p <= parameter).clamp(1, last.max(1)).min(last);
        let below = above.saturating_sub(1);
        let [low, high] = [parameters[below], parameters[above]];
        let weight = if high > low { ((parameter - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 };
        Slices { index: [below, above], weight }
    }

    /// The weight of each.
    #[inline]
    pub fn weights(self) -> [f32; 2] {
        [1.0 - self.weight, self.weight]
    }
}

/// Pairs of numbers, slice by slice.
pub struct Pairs {
    /// Pairs in a slice.
    stride: usize,
    pairs: Vec<[f32; 2]>,
}

impl Pairs {
    pub fn new(stride: usize, pairs: Vec<[f32; 2]>) -> Pairs {
        assert!(pairs.len() % stride == 0 && !pairs.is_empty());
        Pairs { stride, pairs }
    }

    pub fn all(&self) -> &[[f32; 2]] {
        &self.pairs
    }

    /// A pair and the next one, and the same from another pair on; linear between slices.
    #[inline]
    fn fours(&self, slices: Slices, first: usize, second: usize) -> F8 {
        let load = |slice: usize| {
            let four = |at: usize| &self.pairs[slice * self.stride + at..][..2];
            let (&[[a, b], [c, d]], &[[e, f], [g, h]]) = (four(first), four(second)) else { unreachable!() };
            F8::new([a, b, c, d, e, f, g, h])
        };
        let ([below, above], [of_below, of_above]) = (slices.index, slices.weights());
        load(above).mul_add(F8::splat(of_above), load(below) * F8::splat(of_below))
    }

    /// Of each lane in use: a pair and the next one, and the same from another pair on.
    #[inline]
    fn columns(&self, slices: Slices, first: [usize; LANES], second: [usize; LANES], used: usize) -> [[F8; 2]; 4] {
        let mut rows = [F8::ZERO; LANES];
        for (lane, row) in rows.iter_mut().enumerate().take(used) {
            *row = self.fours(slices, first[lane], second[lane]);
        }
        let [a, b, c, d, e, f, g, h] = F8::transpose(rows);
        [[a, b], [c, d], [e, f], [g, h]]
    }

    /// Of each lane in use: a pair and the next one.
    #[inline]
    pub fn next(&self, slices: Slices, first: [usize; LANES], used: usize) -> [[F8; 2]; 2] {
        let [a, b, ..] = self.columns(slices, first, first, used);
        [a, b]
    }
}

/// The patches of a grid that contain eight points.
#[derive(Clone, Copy)]
pub struct Cells {
    pub column: F8,
    pub row: F8,
    /// Where the points lie in them.
    pub within: [F8; 2],
}

/// A pair of functions: bilinear between the nodes of a slice, linear between slices.
pub struct Grid {
    /// Columns (first coordinate) and rows.
    size: [usize; 2],
    /// Row by row.
    nodes: Pairs,
}

impl Grid {
    /// The values at the nodes: slice by slice, row by row.
    pub fn new(size: [usize; 2], nodes: Vec<[f32; 2]>) -> Grid {
        assert!(size[0] > 1 && size[1] > 1, "no patch");
        Grid { size, nodes: Pairs::new(size[0] * size[1], nodes) }
    }

    /// Patches along each axis.
    #[inline]
    pub fn patches(&self) -> [f32; 2] {
        let [columns, rows] = self.size;
        [(columns - 1) as f32, (rows - 1) as f32]
    }

    /// The patches that contain points.
    #[inline]
    pub fn cells(&self, at: [F8; 2]) -> Cells {
        let along = |k: usize| {
            let patches = self.patches()[k];
            let scaled = at[k].fast_max(F8::ZERO).fast_min(F8::ONE) * F8::splat(patches);
            let cell = scaled.floor().fast_min(F8::splat(patches - 1.0));
            (cell, scaled - cell)
        };
        let ((column, x), (row, y)) = (along(0), along(1));
        Cells { column, row, within: [x, y] }
    }

    /// The first corners of patches, as indices into a slice.
    #[inline]
    fn node(&self, column: F8, row: F8) -> [usize; LANES] {
        indices(row.mul_add(F8::splat(self.size[0] as f32), column))
    }

    pub fn nodes(&self) -> &Pairs {
        &self.nodes
    }

    /// Both functions at the corners (x0 y0), (x1 y0), (x0 y1), (x1 y1) of patches.
    #[inline]
    pub fn corners(&self, slices: Slices, cells: &Cells, used: usize) -> [[F8; 2]; 4] {
        let first = self.node(cells.column, cells.row);
        let second = std::array::from_fn(|lane| first[lane] + self.size[0]);
        self.nodes.columns(slices, first, second, used)
    }

    /// Both functions at points.
    #[inline]
    pub fn eval(&self, slices: Slices, at: [F8; 2], used: usize) -> [F8; 2] {
        let cells = self.cells(at);
        let [x, y] = cells.within;
        let [v00, v10, v01, v11] = self.corners(slices, &cells, used);
        let value = |k: usize| between(between(v00[k], v10[k], x), between(v01[k], v11[k], x), y);
        [value(0), value(1)]
    }
}

/// Linear from `a` to `b`.
#[inline]
pub fn between(a: F8, b: F8, at: F8) -> F8 {
    (b - a).mul_add(at, a)
}

/// Whole numbers as indices.
#[inline]
pub fn indices(numbers: F8) -> [usize; LANES] {
    let numbers = numbers.fast_trunc_int().to_array();
    std::array::from_fn(|i| numbers[i] as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_are_bilinear_and_linear_between_slices() {
        let function = |slice: usize, x: f32, y: f32| (1.0 + slice as f32) * (1.0 + x) * (2.0 - y);
        let node = |i: usize| function(i / 12, (i % 4) as f32 / 3.0, (i / 4 % 3) as f32 / 2.0);
        let grid = Grid::new([4, 3], (0..24).map(|i| [node(i), 1.0 - node(i)]).collect());
        let slices = Slices::about(&[1.0, 3.0], 1.5);
        for used in 1..=LANES {
            let at = [0, 1].map(|k| F8::new(std::array::from_fn(|i| [i as f32 / 7.0, (7 - i) as f32 / 7.0][k])));
            let found = grid.eval(slices, at, used).map(F8::to_array);
            for (i, (first, second)) in found[0].into_iter().zip(found[1]).enumerate().take(used) {
                let [x, y] = at.map(|c| c.to_array()[i]);
                let expected = 0.75 * function(0, x, y) + 0.25 * function(1, x, y);
                assert!((first - expected).abs() < 1e-5 && (second - 1.0 + expected).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn parameters_outside_of_all_slices_belong_to_the_outermost() {
        for (parameter, index, weight) in [(0.0, [0, 1], 0.0), (2.5, [1, 2], 0.25), (9.0, [1, 2], 1.0)] {
            let slices = Slices::about(&[1.0, 2.0, 4.0], parameter);
            assert_eq!((slices.index, slices.weight), (index, weight));
        }
        assert_eq!(Slices::about(&[0.5], 0.7).index, [0, 0]);
    }
}
