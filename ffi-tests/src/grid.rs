//! Bilinear functions on the unit square, one for each of some parameters, and densities in proportion to them.

/// Grids over the unit square, one for each of some parameters, bilinear inside and linear between the parameters.
pub struct Grid {
    /// Columns (first coordinate) and rows.
    size: [usize; 2],
    parameters: Vec<f64>,
    /// Slice by slice, row by row.
    values: Vec<f64>,
    /// For each row: the integral up to each column, in units of columns; for each slice: that of rows.
    along: Vec<f64>,
    rows: Vec<f64>,
}

impl Grid {
    /// Normalised grids are densities: their integral over the square is 1.
    pub fn new(size: [usize; 2], parameters: Vec<f64>, mut values: Vec<f64>, normalised: bool) -> Grid {
        let [columns, count] = size;
        let (mut along, mut rows) = (vec![0.0; values.len()], vec![0.0; values.len() / columns]);
        for slice in 0..parameters.len() {
            let first = slice * columns * count;
            for row in 0..count {
                let start = first + row * columns;
                for x in 1..columns {
                    along[start + x] = along[start + x - 1] + 0.5 * (values[start + x - 1] + values[start + x]);
                }
            }
            let end = |row: usize| along[first + (row + 1) * columns - 1];
            for row in 1..count {
                rows[slice * count + row] = rows[slice * count + row - 1] + 0.5 * (end(row - 1) + end(row));
            }
            let total = rows[(slice + 1) * count - 1];
            if normalised && total > 0.0 {
                // In units of columns and rows: a patch has the area 1.
                values[first..first + columns * count].iter_mut().for_each(|v| *v /= total);
                along[first..first + columns * count].iter_mut().for_each(|v| *v /= total);
                rows[slice * count..(slice + 1) * count].iter_mut().for_each(|v| *v /= total);
            }
        }
        Grid { size, parameters, values, along, rows }
    }

    /// Patches in the square.
    fn patches(&self) -> f64 {
        ((self.size[0] - 1) * (self.size[1] - 1)) as f64
    }

    /// The two slices about a parameter, and the weight of the second.
    fn slices(&self, parameter: f64) -> ([usize; 2], f64) {
        let last = self.parameters.len() - 1;
        let above = self.parameters.partition_point(|&p| p <= parameter).clamp(1, last.max(1)).min(last);
        let below = above.saturating_sub(1);
        let [low, high] = [self.parameters[below], self.parameters[above]];
        let weight = if high > low { ((parameter - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 };
        ([below, above], weight)
    }

    fn blend(&self, table: &[f64], slices: ([usize; 2], f64), stride: usize, offset: usize) -> f64 {
        let ([a, b], weight) = slices;
        (1.0 - weight) * table[a * stride + offset] + weight * table[b * stride + offset]
    }

    /// The corners (x0 y0), (x1 y0), (x0 y1), (x1 y1) of the patch that contains a point, and where it lies in it.
    fn patch(&self, slices: ([usize; 2], f64), at: [f64; 2]) -> ([f64; 4], [usize; 2], [f64; 2]) {
        let scaled = [0, 1].map(|k| at[k].clamp(0.0, 1.0) * (self.size[k] - 1) as f64);
        let cell = [0, 1].map(|k| (scaled[k] as usize).min(self.size[k] - 2));
        let stride = self.size[0] * self.size[1];
        let corner = |dx: usize, dy: usize| {
            self.blend(&self.values, slices, stride, (cell[1] + dy) * self.size[0] + cell[0] + dx)
        };
        let corners = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
        (corners, cell, [0, 1].map(|k| scaled[k] - cell[k] as f64))
    }

    /// The value at a point; of a normalised grid the density.
    pub fn eval(&self, parameter: f64, at: [f64; 2]) -> f64 {
        let ([v00, v10, v01, v11], _, [x, y]) = self.patch(self.slices(parameter), at);
        (1.0 - y) * ((1.0 - x) * v00 + x * v10) + y * ((1.0 - x) * v01 + x * v11)
    }

    /// The density at a point.
    pub fn density(&self, parameter: f64, at: [f64; 2]) -> f64 {
        self.eval(parameter, at) * self.patches()
    }

    /// The point that the density puts at `u`, and the density there: rows first.
    pub fn sample(&self, parameter: f64, u: [f64; 2]) -> ([f64; 2], f64) {
        let slices = self.slices(parameter);
        let [columns, count] = self.size;
        let row_sum = |row: usize| self.blend(&self.rows, slices, count, row);
        let total = row_sum(count - 1);
        let target = u[1] * total;
        let row = last_below(count - 1, |row| row_sum(row) <= target);
        let sum = |row: usize, x: usize| self.blend(&self.along, slices, columns * count, row * columns + x);
        let ends = [sum(row, columns - 1), sum(row + 1, columns - 1)];
        let y = inverse_linear(ends, target - row_sum(row));
        let between = |x: usize| (1.0 - y) * sum(row, x) + y * sum(row + 1, x);
        let target = u[0] * between(columns - 1);
        let column = last_below(columns - 1, |x| between(x) <= target);
        let value = |x: usize| {
            let at = |row: usize| self.blend(&self.values, slices, columns * count, row * columns + x);
            (1.0 - y) * at(row) + y * at(row + 1)
        };
        let (left, right) = (value(column), value(column + 1));
        let x = inverse_linear([left, right], target - between(column));
        let density = ((1.0 - x) * left + x * right) * self.patches();
        ([(column as f64 + x) / (columns - 1) as f64, (row as f64 + y) / (count - 1) as f64], density)
    }

    /// The `u` of [`Grid::sample`] for a point, and the density there.
    pub fn invert(&self, parameter: f64, at: [f64; 2]) -> ([f64; 2], f64) {
        let slices = self.slices(parameter);
        let [columns, count] = self.size;
        let ([v00, v10, v01, v11], [column, row], [x, y]) = self.patch(slices, at);
        let (left, right) = ((1.0 - y) * v00 + y * v01, (1.0 - y) * v10 + y * v11);
        let density = ((1.0 - x) * left + x * right) * self.patches();
        let sum = |row: usize, x: usize| self.blend(&self.along, slices, columns * count, row * columns + x);
        let between = |x: usize| (1.0 - y) * sum(row, x) + y * sum(row + 1, x);
        let along = between(column) + x * (left + 0.5 * x * (right - left));
        let ends = [sum(row, columns - 1), sum(row + 1, columns - 1)];
        let row_sum = |row: usize| self.blend(&self.rows, slices, count, row);
        let down = row_sum(row) + y * (ends[0] + 0.5 * y * (ends[1] - ends[0]));
        let ratio = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 0.0 };
        ([ratio(along, between(columns - 1)), ratio(down, row_sum(count - 1))], density)
    }
}

/// The last index below `count` for which a monotone condition holds; 0 if none does.
fn last_below(count: usize, holds: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high) = (0, count);
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if holds(middle) { low = middle } else { high = middle }
    }
    low
}

/// Where the integral of the linear function from `a` to `b` over [0, x] reaches a target.
fn inverse_linear([a, b]: [f64; 2], target: f64) -> f64 {
    let root = (a * a + 2.0 * target * (b - a)).max(0.0).sqrt();
    let x = if a + root > 0.0 { 2.0 * target / (a + root) } else { 0.0 };
    x.clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid that is made here: sample and invert are inverse to each other, and the density integrates to 1.
    #[test]
    fn grids_are_densities() {
        let values: Vec<f64> = (0..2 * 5 * 4).map(|i| 0.1 + f64::from(i * i % 13)).collect();
        let grid = Grid::new([5, 4], vec![0.0, 1.0], values, true);
        for parameter in [0.0, 0.3, 1.0, 2.0] {
            let mut sum = 0.0;
            for i in 0..400 * 400 {
                let at = [(f64::from(i % 400) + 0.5) / 400.0, (f64::from(i / 400) + 0.5) / 400.0];
                sum += grid.density(parameter, at) / 160_000.0;
            }
            assert!((sum - 1.0).abs() < 1e-3, "{sum}");
            for i in 0..100 {
                let u = [(f64::from(i) + 0.5) / 100.0, (f64::from(i * 37 % 100) + 0.5) / 100.0];
                let (at, density) = grid.sample(parameter, u);
                let (back, same) = grid.invert(parameter, at);
                assert!((back[0] - u[0]).abs() + (back[1] - u[1]).abs() < 1e-9, "{u:?} {back:?}");
                assert!(
                    (density / same - 1.0).abs() < 1e-9 && (density / grid.density(parameter, at) - 1.0).abs() < 1e-9
                );
            }
        }
    }
}
