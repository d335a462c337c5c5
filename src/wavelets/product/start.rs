//! The start of a product: a complete tree of a few levels, whose leaves are made row by row. A smooth BRDF needs no more.

use super::base::{Base, CENTRES, FINEST, Row, SIDE, complete, level_of_base};
use super::build::{Builder, sum_of_lanes};
use super::cells::{COLUMNS, NEAR, Scratch};
use super::weigh::{Eight, Raised, leaf_weight, worth};
use super::{LEAF, Node};
use crate::numeric::inverse_power;
use crate::sphere::cell_chord;
use crate::wavelets::lanes::{LANES, Lanes};
use crate::wavelets::lobe::Brdf;
use crate::wavelets::tree::{NO_SQUARE, Tree};
use crate::wavelets::wide::ALL;

/// The most leaves of the base.
const CELLS: usize = SIDE * SIDE;
/// The last of them: a mask by which the compiler sees that an index is one.
const LAST: usize = CELLS - 1;
/// The Morton code of a cell in row 0; those of row x are larger by twice the x-th.
const MORTON: [usize; SIDE] = [0, 1, 4, 5, 16, 17, 20, 21];

/// The Morton codes of a row of cells.
fn codes(x: usize) -> [usize; SIDE] {
    MORTON.map(|y| 2 * MORTON[x & (SIDE - 1)] + y)
}

/// The light in the quarters of each leaf of the base, in Morton order, where the environment stores it in heap order. `None`: it stands
/// where the leaves will be written, as [`Scratch::collect`] puts it.
type InHeap<'a> = Option<&'a [[f32; 4]; CELLS]>;

/// The light of a row of leaves.
struct LightOfRow {
    quarters: [[f32; 4]; SIDE],
    /// The environment's square for each leaf, and [`Node::light`].
    places: [[u32; 2]; SIDE],
}

impl Scratch<'_> {
    /// Puts the light of each leaf of the base where what is known of the leaf will stand: its quarters in place of the cell's corners,
    /// the environment's square and [`Node::light`] in place of the node's links. For environments that are not stored down to the base.
    #[inline(never)]
    fn collect(&mut self, light: Tree<4>, level: u32, base: u32) {
        let nodes = self.nodes.get_mut(base as usize..).unwrap_or_default();
        let all = nodes.iter_mut().zip(self.cells.iter_mut()).take(CELLS);
        for (leaf, (node, cell)) in (0u32..).zip(all) {
            let (mut square, mut average, mut above) = (light.root_square(), light.average(), NO_SQUARE);
            for l in (0..level).rev() {
                let Some(parent) = square else { break };
                let c = leaf >> (2 * l) & 3;
                average = light.children(parent)[c as usize & 3];
                above = parent * 4 + c;
                square = light.child_square(parent, c);
            }
            let is_leaf = leaf < 1 << (2 * level);
            cell.corners =
                if is_leaf { square.map_or([average; 4], |square| light.children(square)) } else { [0.0; 4] };
            let place = if is_leaf { [square.unwrap_or(NO_SQUARE), above] } else { [NO_SQUARE; 2] };
            [node.links[0], node.links[1]] = place;
        }
    }

    /// The light of a row of leaves.
    #[inline(always)]
    fn light_of_row(&self, in_heap: InHeap, x: usize, base: u32) -> LightOfRow {
        let codes = codes(x);
        if let Some(quarters) = in_heap {
            // In heap order a square and its place above are next to each other.
            let places = codes.map(|m| [m as u32 + base, (m as u32 + base).wrapping_sub(1)]);
            return LightOfRow { quarters: codes.map(|m| quarters[m & LAST]), places };
        }
        let node =
            |m: usize| self.nodes.get(base as usize + m).map_or([NO_SQUARE; 2], |node| [node.links[0], node.links[1]]);
        let cell = |m: usize| self.cells.get(m).map_or([0.0; 4], |cell| cell.corners);
        LightOfRow { quarters: codes.map(cell), places: codes.map(node) }
    }
}

/// A row of leaves.
struct Leaves<F: Lanes> {
    cells: Eight<F>,
    raised: Raised<F>,
    light: [F; 4],
    weight: F,
}

impl<B: Brdf> Builder<'_, '_, B> {
    /// Makes the squares of the base, as many levels as the budget allows, and its leaves.
    #[inline(always)]
    pub fn start<F: Lanes>(&mut self, base: &Base) {
        let level = level_of_base(self.budget.squares);
        (self.base, self.squares) = (complete(level), complete(level));
        let rows = self.light.squares().get(self.base as usize..).and_then(|rows| rows.first_chunk());
        let in_heap = rows.filter(|_| level == FINEST && self.light.heap() >= complete(FINEST + 1));
        if in_heap.is_none() {
            self.to.collect(self.light, level, self.base);
        }
        let grid = base.grid(level);
        let goes_on = self.goes_on();
        let residuals = if goes_on { residuals::<F>(&grid, level) } else { [[0.0; 12]; SIDE + 1] };
        let mut weights = [0.0; CELLS];
        let mut sum = F::splat(0.0);
        for x in 0..SIDE >> (FINEST - level) {
            let light = self.to.light_of_row(in_heap, x, self.base);
            let row = self.row::<F>(&grid, &light, x, level);
            sum = sum + F::only(F::mask(row.cells.lanes), row.weight);
            let (codes, weights_here) = (codes(x), row.weight.to_array());
            for y in 0..SIDE {
                weights[codes[y] & LAST] = weights_here[y];
            }
            self.put_leaves(x, level, &light, row.raised.corners);
            if goes_on {
                self.put_cells(x, &row, corners(&residuals, x));
            }
        }
        self.total = sum_of_lanes(sum.to_array()) * inverse_power(2 * level);
        self.put_base(&weights);
    }

    /// A row of leaves.
    #[inline(always)]
    fn row<F: Lanes>(&self, grid: &[Row; SIDE + 1], light: &LightOfRow, x: usize, level: u32) -> Leaves<F> {
        let cells = Eight {
            corners: corners(grid, x),
            index: [F::splat(x as f32), F::from_array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0])],
            width: F::splat(inverse_power(level)),
            chord: F::splat(cell_chord(level)),
            lanes: ALL >> (LANES - (1 << level)),
            near: if self.floors.has_peaks() { ALL } else { 0 },
            centres: if level == FINEST { CENTRES.get(x) } else { None },
        };
        let raised = self.floors.raise(&cells, None);
        let light = F::transpose(light.quarters.each_ref());
        let weight = leaf_weight(raised.corners, light);
        Leaves { cells, raised, light, weight }
    }

    /// Writes the leaves of a row.
    #[inline(always)]
    fn put_leaves<F: Lanes>(&mut self, x: usize, level: u32, light: &LightOfRow, corners: [F; 4]) {
        let all = |number: u32| F::index([number; LANES]);
        let (squares, light) =
            (F::index(light.places.map(|place| place[0])), F::index(light.places.map(|place| place[1])));
        let index = F::add_index(F::index([0, 1, 2, 3, 4, 5, 6, 7].map(|y| y << 16)), all(x as u32));
        let places = F::rows([squares, light, index, all(level)].map(F::with_bits));
        let (values, leaves) = (F::rows(corners), self.to.nodes.get_mut(self.base as usize..));
        let Some(leaves) = leaves.and_then(|leaves| leaves.first_chunk_mut::<CELLS>()) else { return };
        // By number: of what is zipped, the compiler keeps the places in memory.
        let codes = codes(x);
        for y in 0..SIDE {
            let leaf = &mut leaves[codes[y] & LAST];
            leaf.values = values[y];
            leaf.links = places[y].map(f32::to_bits);
        }
    }

    /// Writes what is known of the leaves of a row, given how far their corners are from the next coarser grid.
    #[inline(always)]
    fn put_cells<F: Lanes>(&mut self, x: usize, row: &Leaves<F>, [a, b, c, d]: [F; 4]) {
        let all = |number: u32| F::index([number; LANES]);
        let light = F::splat(0.25) * ((row.light[0] + row.light[1]) + (row.light[2] + row.light[3]));
        let worth = worth(row.raised.corners, a.max(b).max(c.max(d)), light, row.cells.width);
        let worth = F::select(F::mask(row.raised.coarse), worth.copysign(F::splat(-1.0)), worth);
        let near = F::select_index(F::mask(row.raised.near), all(NEAR), all(0));
        let slot = F::add_index(F::index(codes(x).map(|m| m as u32)), all(self.base.wrapping_sub(1)));
        let (corners, rest) =
            (F::rows(row.cells.corners), F::rows([light, row.weight, F::with_bits(near), F::with_bits(slot)]));
        let (Some(cells), Some(priorities)) =
            (self.to.cells.first_chunk_mut::<CELLS>(), self.to.priorities.first_chunk_mut::<CELLS>())
        else {
            return;
        };
        let (codes, worth) = (codes(x), worth.to_array());
        for y in 0..SIDE {
            let m = codes[y] & LAST;
            cells[m].corners = corners[y];
            cells[m].rest = rest[y];
            priorities[m] = worth[y];
        }
    }

    /// Writes the squares, of which the last level gets its averages, and clears the priorities behind the leaves.
    #[inline(always)]
    fn put_base(&mut self, weights: &[f32; CELLS]) {
        let links = |square: usize, kind: u32| [1, 2, 3, 4].map(|c| (4 * square as u32 + c) | kind);
        let (base, above) = (self.base as usize, (self.base as usize - 1) / 4);
        let squares = self.to.nodes.get_mut(..base).unwrap_or_default();
        for (square, node) in squares.iter_mut().enumerate().take(above) {
            *node = Node { values: [0.0; 4], links: links(square, 0) };
        }
        for ((square, node), weights) in squares.iter_mut().enumerate().skip(above).zip(weights.chunks_exact(4)) {
            *node = Node { values: [weights[0], weights[1], weights[2], weights[3]], links: links(square, LEAF) };
        }
        let used = self.used();
        if let Some(rest) = self.to.priorities.get_mut(used..used + COLUMNS) {
            rest.fill(0.0);
        }
    }
}

/// Eight values of a row from point `first` on.
#[inline(always)]
fn eight<F: Lanes>(row: &Row, first: usize) -> F {
    let mut lanes = [0.0; LANES];
    for (lane, value) in lanes.iter_mut().zip(row.iter().skip(first)) {
        *lane = *value;
    }
    F::from_array(lanes)
}

/// The values of a grid at the corners of a row of cells.
#[inline(always)]
fn corners<F: Lanes>(grid: &[Row; SIDE + 1], x: usize) -> [F; 4] {
    let (left, right) = (&grid[x & (SIDE - 1)], &grid[(x & (SIDE - 1)) + 1]);
    [eight(left, 1), eight(left, 2), eight(right, 1), eight(right, 2)]
}

/// How far each grid point is from the bilinear function of the next coarser grid.
#[inline(always)]
fn residuals<F: Lanes>(grid: &[Row; SIDE + 1], level: u32) -> [Row; SIDE + 1] {
    let mut residuals = [[0.0; 12]; SIDE + 1];
    let (half, odd) = (F::splat(0.5), F::mask(0b1010_1010));
    let side = 1usize << level;
    for (x, to) in residuals.iter_mut().enumerate().take(side + 1) {
        let row = &grid[x.min(SIDE)];
        // The mean of the neighbours along axis 2 in columns between those of the coarser grid.
        let along = |row: &Row| F::select(odd, half * (eight::<F>(row, 0) + eight::<F>(row, 2)), eight(row, 1));
        let mut coarse = along(row);
        if x % 2 == 1 {
            let (before, behind) = (&grid[(x - 1).min(SIDE)], &grid[(x + 1).min(SIDE)]);
            coarse = half * (along(before) + along(behind));
            // The last column, which no lane holds.
            if side == SIDE {
                to[1 + SIDE] = (row[1 + SIDE] - 0.5 * (before[1 + SIDE] + behind[1 + SIDE])).abs();
            }
        }
        let beyond = (eight::<F>(row, 1) - coarse).abs().to_array();
        for (to, beyond) in to.iter_mut().skip(1).zip(beyond) {
            *to = beyond;
        }
    }
    residuals
}
