//! Densities on the unit square, one for each of some parameters, that are bilinear: sampled and inverted for eight points
//! at once. Rows are chosen first.

use crate::ascending::Ascending;
use crate::grid::{Cells, Grid, Pairs, Slices, between, indices};
use crate::lanes::{F8, LANES};

/// Densities in proportion to bilinear functions.
pub struct Warp {
    /// The density, of integral 1 where a patch has the area 1, and its integral along the row up to the node.
    nodes: Grid,
    /// For each row: the integral along it, and the integral of rows up to it.
    rows: Pairs,
    /// The integrals along rows, and those of rows.
    along: Ascending,
    down: Ascending,
    size: [usize; 2],
}

impl Warp {
    /// Of values at the nodes: slice by slice, row by row.
    pub fn new(size: [usize; 2], values: &[f64]) -> Warp {
        let [columns, count] = size;
        let (mut nodes, mut rows) = (Vec::with_capacity(values.len()), Vec::new());
        for slice in values.chunks_exact(columns * count) {
            let along: Vec<f64> = slice.chunks_exact(columns).flat_map(integrals).collect();
            let ends: Vec<f64> = along.chunks_exact(columns).map(|row| row[columns - 1]).collect();
            let down: Vec<f64> = integrals(&ends).collect();
            let total = if down[count - 1] > 0.0 { down[count - 1] } else { 1.0 };
            let pair = |(a, b): (&f64, &f64)| [(a / total) as f32, (b / total) as f32];
            nodes.extend(slice.iter().zip(&along).map(pair));
            rows.extend(ends.iter().zip(&down).map(pair));
        }
        Warp {
            along: Ascending::new(columns, nodes.iter().map(|node| node[1])),
            down: Ascending::new(count, rows.iter().map(|row| row[1])),
            nodes: Grid::new(size, nodes),
            rows: Pairs::new(count, rows),
            size,
        }
    }

    /// The densities, up to a factor, and their integrals along rows.
    pub fn nodes(&self) -> &Grid {
        &self.nodes
    }

    /// The densities at nodes, slice by slice, row by row.
    pub fn densities(&self) -> impl Iterator<Item = f32> {
        let [columns, rows] = self.nodes.patches();
        self.nodes.nodes().all().iter().map(move |node| node[0] * columns * rows)
    }

    /// The points that the density puts at `u`, and the density there.
    #[inline]
    pub fn sample(&self, slices: Slices, u: [F8; 2], used: usize) -> ([F8; 2], F8) {
        let row = self.find_rows(slices, u[1], used);
        let [[start, sum], [end, _]] = self.rows.next(slices, indices(row), used);
        let y = inverse_linear([start, end], u[1] - sum);
        let target = u[0] * between(start, end, y);
        let column = self.find_columns(slices, row, y, target, used);
        let cells = Cells { column, row, within: [F8::ZERO, y] };
        let ([left, right], sum) = self.line(slices, &cells, used);
        let x = inverse_linear([left, right], target - sum);
        let [columns, rows] = self.nodes.patches();
        let at = [(column + x) * F8::splat(columns.recip()), (row + y) * F8::splat(rows.recip())];
        (at, between(left, right, x) * self.patches())
    }

    /// The `u` of [`Warp::sample`] for points, and the density there.
    #[inline]
    pub fn invert(&self, slices: Slices, at: [F8; 2], used: usize) -> ([F8; 2], F8) {
        let cells = self.nodes.cells(at);
        let [x, y] = cells.within;
        let ([left, right], sum) = self.line(slices, &cells, used);
        let [[start, before], [end, _]] = self.rows.next(slices, indices(cells.row), used);
        let along = sum + integral([left, right], x);
        let whole = between(start, end, y).fast_max(F8::splat(f32::MIN_POSITIVE));
        let down = before + integral([start, end], y);
        ([along / whole, down], between(left, right, x) * self.patches())
    }

    /// Patches in the square.
    #[inline]
    fn patches(&self) -> F8 {
        let [columns, rows] = self.nodes.patches();
        F8::splat(columns * rows)
    }

    /// On the line through a point along its row: the density at both sides of the patch, and its integral up to the first.
    #[inline]
    fn line(&self, slices: Slices, cells: &Cells, used: usize) -> ([F8; 2], F8) {
        let y = cells.within[1];
        let [v00, v10, v01, v11] = self.nodes.corners(slices, cells, used);
        ([between(v00[0], v01[0], y), between(v10[0], v11[0], y)], between(v00[1], v01[1], y))
    }

    /// The rows in which the integral of rows reaches targets.
    #[inline]
    fn find_rows(&self, slices: Slices, target: F8, used: usize) -> F8 {
        let (targets, weights) = (target.to_array(), slices.weights());
        found(used, self.size[1], |lane| self.down.find(slices.index, weights, targets[lane]))
    }

    /// The columns in which the integral along lines within rows reaches targets.
    #[inline]
    fn find_columns(&self, slices: Slices, row: F8, y: F8, target: F8, used: usize) -> F8 {
        let ([below, above], [of_below, of_above]) = (slices.index, slices.weights());
        let (rows, ys, targets) = (indices(row), y.to_array(), target.to_array());
        found(used, self.size[0], |lane| {
            let (a, b, y) = (below * self.size[1] + rows[lane], above * self.size[1] + rows[lane], ys[lane]);
            let factors = [of_below * (1.0 - y), of_above * (1.0 - y), of_below * y, of_above * y];
            self.along.find([a, b, a + 1, b + 1], factors, targets[lane])
        })
    }
}

/// Integrals up to each of equidistant nodes.
fn integrals(values: &[f64]) -> impl Iterator<Item = f64> {
    let parts = values.windows(2).map(|ends| 0.5 * (ends[0] + ends[1]));
    std::iter::once(0.0).chain(parts).scan(0.0, |sum, part| {
        *sum += part;
        Some(*sum)
    })
}

/// Of each lane in use: which of the patches between so many nodes is found.
#[inline]
fn found(used: usize, nodes: usize, find: impl Fn(usize) -> usize) -> F8 {
    if used == 1 {
        // Without memory, which would be written in part and then read as a whole.
        return F8::splat(find(0).min(nodes - 2) as f32);
    }
    let mut found = [0.0; LANES];
    for (lane, found) in found.iter_mut().enumerate().take(used) {
        *found = find(lane).min(nodes - 2) as f32;
    }
    F8::new(found)
}

/// The integral over [0, x] of the linear function from `a` to `b`.
#[inline]
fn integral([a, b]: [F8; 2], x: F8) -> F8 {
    x * (F8::splat(0.5) * x).mul_add(b - a, a)
}

/// Where that integral reaches a target.
#[inline]
fn inverse_linear([a, b]: [F8; 2], target: F8) -> F8 {
    let twice = target.fast_max(F8::ZERO) * F8::splat(2.0);
    let root = (a * a + twice * (b - a)).fast_max(F8::ZERO).sqrt();
    (twice / (a + root).fast_max(F8::splat(f32::MIN_POSITIVE))).fast_min(F8::ONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A warp that is made here: sample and invert are inverse to each other, and the density integrates to 1.
    #[test]
    fn warps_are_densities() {
        let values: Vec<f64> = (0..2 * 5 * 4).map(|i| 0.1 + f64::from(i * i % 13)).collect();
        let warp = Warp::new([5, 4], &values);
        for parameter in [0.0, 0.3, 1.0, 2.0] {
            let slices = Slices::about(&[0.0, 1.0], parameter);
            let grid = |side: usize, i: usize| {
                [0, 1].map(|k| {
                    F8::new(std::array::from_fn(|lane| {
                        let i = i * LANES + lane;
                        ([i % side, i / side][k] as f32 + 0.5) / side as f32
                    }))
                })
            };
            let density = |i: usize| f64::from(warp.invert(slices, grid(400, i), LANES).1.reduce_add());
            let sum = (0..20_000).map(density).sum::<f64>() / 160_000.0;
            assert!((sum - 1.0).abs() < 1e-3, "{sum}");
            for i in 0..128 {
                let u = grid(32, i);
                let (at, density) = warp.sample(slices, u, LANES);
                let (back, same) = warp.invert(slices, at, LANES);
                let [x, y] = [0, 1].map(|k| (back[k] - u[k]).abs().to_array());
                let ratio = (density / same - F8::ONE).abs().to_array();
                for i in 0..LANES {
                    assert!(x[i] + y[i] < 1e-5 && ratio[i] < 1e-5, "{} {} {}", x[i], y[i], ratio[i]);
                }
            }
        }
    }

    #[test]
    fn lanes_that_are_not_in_use_change_nothing() {
        let warp = Warp::new([3, 3], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
        let u = [F8::splat(0.3), F8::splat(0.8)];
        let first = |used: usize| {
            let (at, density) = warp.sample(Slices::default(), u, used);
            [at[0], at[1], density].map(|c| c.to_array()[0])
        };
        assert_eq!(first(1), first(LANES));
    }
}
