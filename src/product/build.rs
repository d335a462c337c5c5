//! Building a product: which cells to refine, what a leaf weighs, and the floor under it. Up to eight cells are split
//! side by side.

use super::base::{BASE, Base};
use super::peak::Shape;
use super::{LEAF, Leaf, Parts, Square};
use crate::lobe::{Asked, Brdf, MAX_PEAKS, Peak};
use crate::numeric::{exp2i, inverse_power, max};
use crate::prior::{WIS_PRIOR_CELLS, mean_weight};
use crate::reuse::Reuse;
use crate::simd::{LANES, Lanes};
use crate::sphere::{Frame, cell_chord};
use crate::status::{Result, Status};
use crate::tree::{MAX_DEPTH, NO_SQUARE, Tree};
use crate::wide::vector::{direction_in, dot, splat};
use glam::Vec3;

/// What a build may spend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Inner nodes, at least 1.
    pub squares: u32,
    /// BRDF evaluations besides those that a narrow lobe's peak asks for.
    pub evaluations: u32,
}

impl Budget {
    /// What is spent if the caller does not say: the base and two rounds of eight splits, which take as long as the nine
    /// splits that 64 evaluations pay for.
    pub const DEFAULT: Budget = Budget { squares: 128, evaluations: 98 };
}

/// How to build.
#[derive(Clone, Copy, Debug)]
pub struct Options<'a> {
    /// What may be spent.
    pub budget: Budget,
    /// Which normals the product is to serve.
    pub reuse: Reuse,
    /// The factors of a visibility prior.
    pub prior: Option<&'a [f32; WIS_PRIOR_CELLS]>,
}

/// Splits that the peaks of narrow lobes may cause.
const PEAK_SPLITS: u32 = 64;
/// No leaf that reaches above the horizon is darker than this share of its largest corner.
const LEAF_FLOOR: f32 = 0.05;
/// Refinement stops where a split would lower the variance of a sample's weight by less than this.
const TOLERANCE: f32 = 1e-4;
/// Squares of the base: the root and its children.
const BASE_SQUARES: u32 = 5;
/// New values that a split needs.
const NEW: usize = 5;

/// A cell under construction.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Cell {
    /// BRDF x cosine at the corners, as evaluated.
    corners: [f32; 4],
    /// The average light.
    light: f32,
    /// The environment's square for this cell, or [`NO_SQUARE`].
    square: u32,
    /// As in [`Leaf`].
    above: u32,
    /// The average product.
    weight: f32,
    /// How much a split is worth.
    priority: f32,
    /// The first of four children; 0 for a leaf.
    children: u32,
    /// Its number among the squares or leaves.
    number: u32,
    level: u32,
    index: [u16; 2],
    /// Whether it lies near a narrow lobe's peak and is too coarse for it.
    coarse: u32,
    /// Whether it lies near a peak at all: only then its children may.
    near_peak: u32,
    /// The least value of a corner; below 0 if the cell is wholly below the horizon.
    floor: f32,
}

impl Cell {
    /// The corners, not below the floor.
    fn raised(&self) -> [f32; 4] {
        if self.floor < 0.0 { [0.0; 4] } else { self.corners.map(|c| max(c, self.floor)) }
    }

    fn leaf(&self) -> Leaf {
        let (square, light) = (self.square, self.above);
        Leaf { corners: self.raised(), square, light, index: self.index, level: self.level }
    }
}

/// What a build made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Built {
    /// Cells in use.
    pub cells: u32,
    /// Inner nodes.
    pub squares: u32,
    /// Leaves.
    pub leaves: u32,
    /// BRDF evaluations.
    pub evaluations: u32,
    /// The average product over the square; 0 if there is nothing to sample.
    pub average: f32,
    /// The same with the factors of the visibility prior.
    pub visible: f32,
    /// The stored values of the BRDF are its own times `2^-exponent`.
    pub exponent: i32,
}

/// The cells that a budget of squares needs.
pub fn cell_count(squares: u32) -> Option<u32> {
    squares.checked_mul(4)?.checked_add(1)
}

/// Up to eight cells to split.
#[derive(Clone, Copy, Default)]
struct Batch {
    cells: [usize; LANES],
    count: usize,
}

impl Batch {
    fn push(&mut self, cell: usize) {
        if let Some(slot) = self.cells.get_mut(self.count) {
            *slot = cell;
            self.count += 1;
        }
    }

    fn iter(&self) -> impl Iterator<Item = (usize, usize)> {
        self.cells.into_iter().enumerate().take(self.count)
    }

    /// The lanes in use as bits.
    fn lanes(&self) -> u32 {
        (1 << self.count) - 1
    }
}

/// A build in progress.
struct Builder<'a, B: Brdf> {
    light: Tree<'a, 4>,
    frame: &'a Frame,
    brdf: &'a mut B,
    cells: &'a mut [Cell],
    used: usize,
    squares: u32,
    evaluations: u32,
    /// Cells before this one are not too coarse for a peak.
    resolved: usize,
    /// What was spent when all peaks were resolved.
    spent_on_peaks: u32,
    /// Values are multiplied by this power of two before they are stored.
    scale: f32,
    /// The average product over all leaves.
    total: f32,
    /// The normal of the hemisphere outside which the BRDF is 0.
    hemisphere: Option<Vec3>,
    /// How far the horizon lies below that hemisphere's.
    horizon: f32,
    /// The least value of a corner in a leaf that reaches above the horizon (rule 16 of the design).
    least: f32,
    /// The narrow lobes and their values at the peak.
    peaks: [Option<(Peak, f32)>; MAX_PEAKS],
}

/// Builds the cells of a product.
///
/// # Errors
/// [`Status::MemoryTooSmall`] if `cells` is shorter than [`cell_count`] of the budget,
/// [`Status::CallbackFailed`] if the BRDF gives a value that is NaN, infinite or negative.
#[inline(always)]
pub fn build<F: Lanes, B: Brdf>(
    light: Tree<'_, 4>,
    frame: &Frame,
    brdf: &mut B,
    options: &Options,
    cells: &mut [Cell],
) -> Result<Built> {
    let budget = options.budget;
    let needed = cell_count(budget.squares).ok_or(Status::Overflow)?;
    if budget.squares == 0 || cells.len() < needed as usize {
        return Err(Status::MemoryTooSmall);
    }
    let base = Base::evaluate::<F, B>(frame, brdf)?;
    if !(light.average() > 0.0 && brdf.may_reflect()) {
        return Ok(Built { evaluations: base.evaluations, ..Built::default() });
    }
    let mut builder = Builder::new(light, frame, brdf, cells, &base);
    builder.horizon = options.reuse.horizon();
    let (mut batch, mut new) = builder.base::<F>(&base, budget);
    loop {
        builder.split(&batch, new);
        batch = builder.next(budget);
        if batch.count == 0 {
            return Ok(builder.finish(options.prior, base.exponent));
        }
        new = builder.evaluate::<F>(&batch)?;
    }
}

impl<'a, B: Brdf> Builder<'a, B> {
    fn new(light: Tree<'a, 4>, frame: &'a Frame, brdf: &'a mut B, cells: &'a mut [Cell], base: &Base) -> Self {
        let scale = exp2i(-base.exponent) as f32;
        // The mean of the base may underflow for very narrow lobes: the second term keeps the floor positive, since
        // the BRDF may well be above 0 between the directions of the base.
        let least = max(base.mean * scale * (1.0 / 1024.0), exp2i(-40) as f32);
        let hemisphere = brdf.hemisphere();
        let mut peaks = [None; MAX_PEAKS];
        for ((slot, peak), value) in peaks.iter_mut().zip(brdf.peaks()).zip(base.peaks) {
            *slot = Some((peak, value * scale));
        }
        let evaluations = base.evaluations;
        Builder {
            light,
            frame,
            brdf,
            cells,
            used: 0,
            squares: 0,
            evaluations,
            resolved: 0,
            spent_on_peaks: evaluations,
            scale,
            total: 0.0,
            hemisphere,
            horizon: 0.0,
            least,
            peaks,
        }
    }

    fn cell(&self, index: usize) -> Cell {
        self.cells.get(index).copied().unwrap_or_default()
    }

    /// Makes the root and, if the budget allows, its four children. Returns the cells to split, the root or the
    /// children, and the new values for that.
    #[inline(always)]
    fn base<F: Lanes>(&mut self, base: &Base, budget: Budget) -> (Batch, [F; NEW]) {
        let scale = self.scale;
        let value = |i: usize, j: usize| base.at(i, j) * scale;
        let corners =
            |i: usize, j: usize, k: usize| [value(i, j), value(i, j + k), value(i + k, j), value(i + k, j + k)];
        // The five new points of a cell of `2 k` grid points' width.
        let between = |i: usize, j: usize, k: usize| {
            [(k, 0), (k, 2 * k), (0, k), (2 * k, k), (k, k)].map(|(di, dj)| value(i + di, j + dj))
        };
        let root = Cell {
            corners: corners(0, 0, 4),
            light: self.light.average(),
            square: self.light.root_square().unwrap_or(NO_SQUARE),
            above: NO_SQUARE,
            near_peak: 1,
            ..Cell::default()
        };
        if budget.squares < BASE_SQUARES {
            self.write(0, root);
            self.used = 1;
            return (Batch { count: 1, ..Batch::default() }, to_lanes(between(0, 0, 2).map(|value| [value; LANES])));
        }
        let light = self.light.children(root.square);
        let quarters = [(0, 0), (0, 2), (2, 0), (2, 2)];
        let children = [0, 1, 2, 3].map(|c: usize| {
            let (i, j) = quarters.get(c).copied().unwrap_or((0, 0));
            Cell {
                corners: corners(i, j, 2),
                light: if root.square == NO_SQUARE { root.light } else { light.get(c).copied().unwrap_or(0.0) },
                square: self.child_square(root.square, c as u32),
                above: if root.square == NO_SQUARE { NO_SQUARE } else { root.square * 4 + c as u32 },
                level: 1,
                index: [(i / 2) as u16, (j / 2) as u16],
                near_peak: 1,
                ..Cell::default()
            }
        });
        let mut new = [[0.0; LANES]; NEW];
        for (lane, (i, j)) in quarters.into_iter().enumerate() {
            for (row, value) in new.iter_mut().zip(between(i, j, 1)) {
                if let Some(slot) = row.get_mut(lane) {
                    *slot = value;
                }
            }
        }
        self.write(0, Cell { children: 1, ..root });
        for (index, child) in (1..).zip(children) {
            self.write(index, child);
        }
        (self.used, self.squares) = (5, 1);
        (Batch { cells: [1, 2, 3, 4, 0, 0, 0, 0], count: 4 }, to_lanes(new))
    }

    fn write(&mut self, index: usize, cell: Cell) {
        if let Some(slot) = self.cells.get_mut(index) {
            *slot = cell;
        }
    }

    fn child_square(&self, square: u32, c: u32) -> u32 {
        if square == NO_SQUARE { NO_SQUARE } else { self.light.child_square(square, c).unwrap_or(NO_SQUARE) }
    }

    /// The next cells to split: those about a narrow lobe's peak until they are finer than the lobe, then those that
    /// are worth most, until the budget or the gain runs out.
    fn next(&mut self, budget: Budget) -> Batch {
        let mut batch = Batch::default();
        let room = budget.squares.min(BASE_SQUARES + PEAK_SPLITS).saturating_sub(self.squares);
        while self.resolved < self.used && batch.count < room.min(LANES as u32) as usize {
            let coarse = self.cells.get(self.resolved).is_some_and(|cell| cell.coarse != 0 && cell.children == 0);
            if coarse {
                batch.push(self.resolved);
            }
            self.resolved += 1;
        }
        if batch.count > 0 {
            self.spent_on_peaks = self.evaluations + (batch.count * NEW) as u32;
            return batch;
        }
        let spent = self.evaluations - self.spent_on_peaks + BASE.len() as u32;
        let affordable = budget.evaluations.saturating_sub(spent) / NEW as u32;
        let affordable = affordable.min(budget.squares - self.squares);
        // Nine splits are better chosen as five and then four than as eight and then one.
        let rounds = affordable.div_ceil(LANES as u32).max(1);
        self.most_valuable(affordable.div_ceil(rounds) as usize)
    }

    /// The leaves with the highest priority, the best first; equal ones in the order of their index.
    fn most_valuable(&self, room: usize) -> Batch {
        let mut best = [(TOLERANCE * self.total, usize::MAX); LANES];
        let Some(last) = room.checked_sub(1) else { return Batch::default() };
        let mut worst = best[0].0;
        for (index, cell) in self.cells.iter().take(self.used).enumerate() {
            // Inner cells have no priority.
            if cell.priority <= worst {
                continue;
            }
            let mut candidate = (cell.priority, index);
            for kept in best.iter_mut().take(room) {
                if candidate.0 > kept.0 {
                    core::mem::swap(&mut candidate, kept);
                }
            }
            worst = best[last & (LANES - 1)].0;
        }
        let mut batch = Batch::default();
        best.iter().take(room).filter(|(_, index)| *index != usize::MAX).for_each(|&(_, index)| batch.push(index));
        batch
    }

    /// Evaluates the five new points of each cell of a batch.
    #[inline(always)]
    fn evaluate<F: Lanes>(&mut self, batch: &Batch) -> Result<[F; NEW]> {
        let (mut index, mut half) = ([[0.0; LANES]; 2], [1.0; LANES]);
        for (lane, cell) in batch.iter() {
            let cell = self.cell(cell);
            index[0][lane & 7] = f32::from(cell.index[0]);
            index[1][lane & 7] = f32::from(cell.index[1]);
            half[lane & 7] = inverse_power(cell.level + 1);
        }
        let (x, y, half) = (F::from_array(index[0]), F::from_array(index[1]), F::from_array(half));
        let mut wi = [Asked { wi: splat([0.0; 3]), lanes: batch.lanes() }; NEW];
        for (asked, [i, j]) in wi.iter_mut().zip([[1.0, 0.0], [1.0, 2.0], [0.0, 1.0], [2.0, 1.0], [1.0, 1.0]]) {
            let s = [(x + x + F::splat(i)) * half, (y + y + F::splat(j)) * half];
            asked.wi = direction_in(self.frame, s);
        }
        let mut f_cos = [F::splat(0.0); NEW];
        self.brdf.eval(&wi, &mut f_cos)?;
        self.evaluations += (batch.count * NEW) as u32;
        for f in &mut f_cos {
            *f = (*f * F::splat(self.scale)).min(F::splat(LARGEST));
        }
        Ok(f_cos)
    }

    /// Appends the four children of each cell of a batch, whose new values are the lanes of `new`: the middles of the
    /// edges at the lower and upper end of axis 2, at the lower and upper end of axis 1, and the centre.
    #[inline(always)]
    fn split<F: Lanes>(&mut self, batch: &Batch, new: [F; NEW]) {
        let parents = Parents::<F>::load(self, batch);
        let residuals = residuals(parents.corners, new);
        let first = self.used;
        for c in 0..4 {
            let children = self.weigh(&parents, new, residuals, c);
            for lane in 0..batch.count {
                let cell = children.cell(&parents, lane);
                self.total += cell.weight * area(cell.level);
                self.write(first + 4 * lane + c as usize, cell);
            }
        }
        for (lane, index) in batch.iter() {
            if let Some(cell) = self.cells.get_mut(index) {
                self.total -= cell.weight * area(cell.level);
                (cell.children, cell.priority) = ((first + 4 * lane) as u32, 0.0);
            }
        }
        self.used = (first + 4 * batch.count).min(self.cells.len());
        self.squares += batch.count as u32;
    }

    /// The weights of the `c`-th children as leaves, and what splitting them is worth.
    #[inline(always)]
    fn weigh<F: Lanes>(&self, parents: &Parents<F>, new: [F; NEW], residuals: [F; NEW], c: u32) -> Children {
        let zero = F::splat(0.0);
        let corners = corners_of_child(parents.corners, new, c);
        let [x, y] = parents.index;
        let index = [x + x + F::splat((c >> 1) as f32), y + y + F::splat((c & 1) as f32)];
        let width = parents.half;
        let squares = parents.squares.map(|square| self.child_square(square, c));
        let light = parents.light[c as usize & 3];
        let largest = corners[0].max(corners[1]).max(corners[2].max(corners[3]));
        let smallest = corners[0].min(corners[1]).min(corners[2].min(corners[3]));
        let mut floor = (F::splat(LEAF_FLOOR) * largest).max(F::splat(self.least));
        let (mut near, mut coarse) = (0, 0);
        let unsure = (F::bits(smallest.le(zero)) | parents.near) & parents.lanes;
        if unsure != 0 {
            let half = F::splat(0.5);
            let middle = [(index[0] + half) * width, (index[1] + half) * width];
            let centre = direction_in(self.frame, middle);
            // Four dark corners do not mean a dark cell: one that reaches above the horizon keeps the least value.
            if let Some(normal) = self.hemisphere {
                let height = dot(splat(normal.to_array()), centre);
                let above = zero.le(height + parents.chord + F::splat(self.horizon));
                let known = F::select(above, floor, F::splat(-1.0));
                floor = F::select(F::mask(unsure), known, floor);
            }
            if parents.near & parents.lanes != 0 {
                // Without this the cells at a narrow peak, whose corners are all dark, are missed.
                let shape = Shape::new(self.frame, middle, centre, width, parents.chord);
                for (peak, value) in self.peaks.iter().flatten() {
                    let verdict = shape.judge(peak, *value);
                    near |= F::bits(verdict.near);
                    coarse |= F::bits(verdict.coarse);
                    let holds = F::and(verdict.holds, F::and(zero.le(floor), F::mask(parents.near)));
                    floor = F::select(holds, floor.max(verdict.floor), floor);
                }
            }
        }
        let mut raised = corners;
        for corner in &mut raised {
            *corner = F::select(zero.le(floor), corner.max(floor), zero);
        }
        let weight = self.leaf_weight(raised, light, squares);
        let [r0, r1, r2, r3] = raised;
        let mean = F::splat(0.25) * ((r0 + r1) + (r2 + r3));
        let spread = r0.max(r1).max(r2.max(r3)) - r0.min(r1).min(r2.min(r3));
        let beyond = residuals_of_child(residuals, c);
        let error = F::splat(0.35) * beyond + F::splat(0.03) * spread;
        let worth = width * width * light * error * error / (mean + F::splat(0.3) * error);
        let priority = F::select(zero.lt(mean), worth, zero);
        Children {
            c,
            corners: [corners[0].to_array(), corners[1].to_array(), corners[2].to_array(), corners[3].to_array()],
            light: light.to_array(),
            squares,
            weight: weight.to_array(),
            priority: priority.to_array(),
            floor: floor.to_array(),
            near: near & parents.near,
            coarse: coarse & parents.near,
        }
    }

    /// The average product over leaves, as the descent below them sees it.
    #[inline(always)]
    fn leaf_weight<F: Lanes>(&self, corners: [F; 4], light: F, squares: [u32; LANES]) -> F {
        let lit = squares.iter().rev().fold(0, |bits, &square| bits << 1 | u32::from(square != NO_SQUARE));
        let stored = self.light.squares();
        let below = F::transpose(squares.map(|square| stored.get(square as usize).unwrap_or(&[0.0; 4])));
        let masses = Parts::whole(corners).masses(below);
        let mut weights = masses;
        for (weight, corner) in weights.iter_mut().zip(corners) {
            *weight = F::select(F::mask(lit), *weight, light * corner);
        }
        let [a, b, c, d] = weights;
        F::splat(0.25) * ((a + b) + (c + d))
    }

    /// Sums the weights up to the root and numbers squares and leaves.
    fn finish(self, prior: Option<&[f32; WIS_PRIOR_CELLS]>, exponent: i32) -> Built {
        let cells = self.cells.get_mut(..self.used).unwrap_or(&mut []);
        let average = sum_up(cells);
        let mut visible = average;
        if let Some(weights) = prior {
            for cell in cells.iter_mut().filter(|cell| cell.children == 0) {
                cell.weight *= mean_weight(weights, cell.level, cell.index);
            }
            visible = sum_up(cells);
        }
        let (mut squares, mut leaves) = (0, 0);
        for cell in cells.iter_mut() {
            let counter = if cell.children == 0 { &mut leaves } else { &mut squares };
            cell.number = *counter;
            *counter += 1;
        }
        Built { cells: self.used as u32, squares, leaves, evaluations: self.evaluations, average, visible, exponent }
    }
}

/// Sums the weights of leaves up to the root.
fn sum_up(cells: &mut [Cell]) -> f32 {
    for index in (0..cells.len()).rev() {
        let children = cells.get(index).map_or(0, |cell| cell.children as usize);
        if children != 0 {
            let sum = |k: usize| cells.get(children + k).map_or(0.0, |child| child.weight);
            let weight = 0.25 * ((sum(0) + sum(1)) + (sum(2) + sum(3)));
            if let Some(cell) = cells.get_mut(index) {
                cell.weight = weight;
            }
        }
    }
    cells.first().map_or(0.0, |root| root.weight)
}

/// Values above this multiple of the largest of the base are cut, so that products stay finite.
const LARGEST: f32 = 1e9;

fn area(level: u32) -> f32 {
    inverse_power(2 * level)
}

/// Writes the squares and leaves of built cells; the slices have the lengths that [`Built`] tells.
pub fn emit(cells: &[Cell], squares: &mut [Square], leaves: &mut [Leaf]) {
    for cell in cells {
        if cell.children == 0 {
            if let Some(leaf) = leaves.get_mut(cell.number as usize) {
                *leaf = cell.leaf();
            }
        } else if let Some(square) = squares.get_mut(cell.number as usize) {
            *square = Square::default();
            let children = cells.iter().skip(cell.children as usize);
            for ((weight, link), child) in square.weights.iter_mut().zip(&mut square.links).zip(children) {
                *weight = child.weight;
                *link = if child.children == 0 { child.number | LEAF } else { child.number };
            }
        }
    }
}

/// Cells that are about to be split, one in each lane.
struct Parents<F: Lanes> {
    /// The lanes in use, and those that lie near a peak, as bits.
    lanes: u32,
    near: u32,
    corners: [F; 4],
    index: [F; 2],
    /// The width of a child, and the largest distance from its centre.
    half: F,
    chord: F,
    squares: [u32; LANES],
    /// The light of each child.
    light: [F; 4],
    cells: [Cell; LANES],
}

impl<F: Lanes> Parents<F> {
    #[inline(always)]
    fn load<B: Brdf>(builder: &Builder<B>, batch: &Batch) -> Self {
        let mut cells = [Cell { square: NO_SQUARE, ..Cell::default() }; LANES];
        for (slot, (_, index)) in cells.iter_mut().zip(batch.iter()) {
            *slot = builder.cell(index);
        }
        let light = |cell: Cell| {
            if cell.square == NO_SQUARE { [cell.light; 4] } else { builder.light.children(cell.square) }
        };
        let light = cells.map(light);
        let mut numbers = [[0.0; LANES]; 4];
        for (lane, cell) in cells.iter().enumerate() {
            let of_cell = [
                f32::from(cell.index[0]),
                f32::from(cell.index[1]),
                inverse_power(cell.level + 1),
                cell_chord(cell.level + 1),
            ];
            for (row, number) in numbers.iter_mut().zip(of_cell) {
                row[lane] = number;
            }
        }
        Parents {
            lanes: batch.lanes(),
            near: cells.iter().rev().fold(0, |bits, cell| bits << 1 | u32::from(cell.near_peak != 0)),
            corners: F::transpose(cells.each_ref().map(|cell| &cell.corners)),
            index: [F::from_array(numbers[0]), F::from_array(numbers[1])],
            half: F::from_array(numbers[2]),
            chord: F::from_array(numbers[3]),
            squares: cells.map(|cell| cell.square),
            light: F::transpose(light.each_ref()),
            cells,
        }
    }
}

/// One child of each of eight cells.
struct Children {
    c: u32,
    corners: [[f32; LANES]; 4],
    light: [f32; LANES],
    squares: [u32; LANES],
    weight: [f32; LANES],
    priority: [f32; LANES],
    floor: [f32; LANES],
    near: u32,
    coarse: u32,
}

impl Children {
    #[inline(always)]
    fn cell<F: Lanes>(&self, parents: &Parents<F>, lane: usize) -> Cell {
        let lane = lane & (LANES - 1);
        let parent = &parents.cells[lane];
        let level = parent.level + 1;
        let deepest = level >= MAX_DEPTH;
        Cell {
            corners: self.corners.map(|corner| corner[lane]),
            light: self.light[lane],
            square: self.squares[lane],
            above: if parent.square == NO_SQUARE { parent.above } else { parent.square * 4 + self.c },
            weight: self.weight[lane],
            priority: if deepest { 0.0 } else { self.priority[lane] },
            level,
            index: [2 * parent.index[0] + (self.c >> 1) as u16, 2 * parent.index[1] + (self.c & 1) as u16],
            coarse: if deepest { 0 } else { self.coarse >> lane & 1 },
            near_peak: self.near >> lane & 1,
            floor: self.floor[lane],
            ..Cell::default()
        }
    }
}

/// The corners of child `c` from its parent's corners and five new values.
#[inline(always)]
fn corners_of_child<F: Lanes>(corners: [F; 4], new: [F; NEW], c: u32) -> [F; 4] {
    let [c00, c01, c10, c11] = corners;
    let [low2, high2, low1, high1, centre] = new;
    match c & 3 {
        0 => [c00, low1, low2, centre],
        1 => [low1, c01, centre, high2],
        2 => [low2, centre, c10, high1],
        _ => [centre, high2, high1, c11],
    }
}

/// The largest residual at a corner of child `c`.
#[inline(always)]
fn residuals_of_child<F: Lanes>(residuals: [F; NEW], c: u32) -> F {
    let [a, b, d, e] = corners_of_child([F::splat(0.0); 4], residuals, c);
    a.max(b).max(d.max(e))
}

/// How far the five new values are from the bilinear function of the corners.
#[inline(always)]
fn residuals<F: Lanes>(corners: [F; 4], new: [F; NEW]) -> [F; NEW] {
    let [c00, c01, c10, c11] = corners;
    let (half, quarter) = (F::splat(0.5), F::splat(0.25));
    let [a, b, c, d, e] = new;
    [
        (a - half * (c00 + c10)).abs(),
        (b - half * (c01 + c11)).abs(),
        (c - half * (c00 + c01)).abs(),
        (d - half * (c10 + c11)).abs(),
        (e - quarter * ((c00 + c01) + (c10 + c11))).abs(),
    ]
}

#[inline(always)]
fn to_lanes<F: Lanes>([a, b, c, d, e]: [[f32; LANES]; NEW]) -> [F; NEW] {
    [F::from_array(a), F::from_array(b), F::from_array(c), F::from_array(d), F::from_array(e)]
}
