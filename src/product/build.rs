//! Building a product: which cells to refine, what a leaf weighs, and the floor under it. Up to eight cells are split
//! side by side.

use super::Parts;
use super::base::{BASE, Base};
use super::cells::{Batch, COARSE, Cell, NEAR, Place, Room, Scratch, Split};
use super::peak::Shape;
use crate::lobe::{Asked, Brdf, MAX_PEAKS, Peak};
use crate::numeric::{exp2i, inverse_power, max};
use crate::reuse::Reuse;
use crate::simd::{LANES, Lanes};
use crate::sphere::{Frame, cell_chord};
use crate::status::{Result, Status};
use crate::tree::{MAX_DEPTH, NO_SQUARE, Tree};
use crate::wide::ALL;
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
pub struct Options {
    /// What may be spent.
    pub budget: Budget,
    /// Which normals the product is to serve.
    pub reuse: Reuse,
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

/// What a build made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Built {
    /// Cells in use.
    pub cells: u32,
    /// Inner nodes.
    pub squares: u32,
    /// BRDF evaluations.
    pub evaluations: u32,
    /// The stored values of the BRDF are its own times `2^-exponent`.
    pub exponent: i32,
}

impl Built {
    /// Leaves; 0 if there is nothing to sample.
    pub fn leaves(&self) -> u32 {
        if self.squares == 0 { 0 } else { 3 * self.squares + 1 }
    }
}

/// A build in progress.
struct Builder<'a, 'c, B: Brdf> {
    light: Tree<'a, 4>,
    frame: &'a Frame,
    brdf: &'a mut B,
    to: &'a mut Scratch<'c>,
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
/// [`Status::MemoryTooSmall`] if there is less room for cells than [`Room`] tells for the budget,
/// [`Status::CallbackFailed`] if the BRDF gives a value that is NaN, infinite or negative.
#[inline(always)]
pub fn build<F: Lanes, B: Brdf>(
    light: Tree<'_, 4>,
    frame: &Frame,
    brdf: &mut B,
    options: &Options,
    scratch: &mut Scratch,
) -> Result<Built> {
    let budget = options.budget;
    let room = Room::new(budget.squares).ok_or(Status::Overflow)?;
    if budget.squares == 0 || !scratch.fits(room) {
        return Err(Status::MemoryTooSmall);
    }
    let base = Base::evaluate::<F, B>(frame, brdf)?;
    if !(light.average() > 0.0 && brdf.may_reflect()) {
        return Ok(Built { evaluations: base.evaluations, ..Built::default() });
    }
    let mut builder = Builder::new(light, frame, brdf, scratch, &base);
    builder.horizon = options.reuse.horizon();
    let (mut batch, mut new) = builder.base::<F>(&base, budget);
    let mut parents = Parents::load(&builder, &batch);
    loop {
        builder.split(&batch, &parents, new);
        batch = builder.next::<F>(budget);
        if batch.count == 0 {
            let (cells, squares, evaluations) = (builder.used as u32, builder.squares, builder.evaluations);
            return Ok(Built { cells, squares, evaluations, exponent: base.exponent });
        }
        parents = Parents::load(&builder, &batch);
        new = builder.evaluate(&batch, &parents)?;
    }
}

impl<'a, 'c, B: Brdf> Builder<'a, 'c, B> {
    fn new(light: Tree<'a, 4>, frame: &'a Frame, brdf: &'a mut B, to: &'a mut Scratch<'c>, base: &Base) -> Self {
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
            to,
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
        let peak = if self.peaks[0].is_some() { NEAR } else { 0 };
        let square = self.light.root_square().unwrap_or(NO_SQUARE);
        let light = self.light.average();
        let place = Place { square, light: NO_SQUARE, index: 0, level: 0 };
        self.add(Cell { corners: corners(0, 0, 4), place, light, peak, ..Cell::default() });
        if budget.squares < BASE_SQUARES {
            return (Batch::run(0, 1), to_lanes(between(0, 0, 2).map(|value| [value; LANES])));
        }
        let lights = if square == NO_SQUARE { [light; 4] } else { self.light.children(square) };
        let quarters = [(0, 0), (0, 2), (2, 0), (2, 2)];
        let mut new = [[0.0; LANES]; NEW];
        for ((c, (i, j)), light) in (0u32..).zip(quarters).zip(lights) {
            let place = Place {
                square: self.child_square(square, c),
                light: if square == NO_SQUARE { NO_SQUARE } else { square * 4 + c },
                index: next_index(0, c),
                level: 1,
            };
            self.add(Cell { corners: corners(i, j, 2), place, light, peak, ..Cell::default() });
            for (row, value) in new.iter_mut().zip(between(i, j, 1)) {
                row[c as usize & (LANES - 1)] = value;
            }
        }
        self.record(Split { cell: 0, first: 1, apart: 1 });
        (Batch::run(1, 4), to_lanes(new))
    }

    /// Appends a cell that is to be split at once.
    fn add(&mut self, cell: Cell) {
        if let Some(slot) = self.to.cells.get_mut(self.used) {
            *slot = cell;
        }
        if let Some(priority) = self.to.priorities.get_mut(self.used) {
            *priority = 0.0;
        }
        self.used += 1;
    }

    /// Makes an inner node of a cell.
    #[inline(always)]
    fn record(&mut self, split: Split) {
        if let Some(slot) = self.to.splits.get_mut(self.squares as usize) {
            *slot = split;
        }
        if let Some(cell) = self.to.cells.get_mut(split.cell as usize) {
            cell.inner = self.squares;
        }
        if let Some(priority) = self.to.priorities.get_mut(split.cell as usize) {
            *priority = 0.0;
        }
        self.squares += 1;
    }

    #[inline(always)]
    fn child_square(&self, square: u32, c: u32) -> u32 {
        if square == NO_SQUARE { NO_SQUARE } else { self.light.child_square(square, c).unwrap_or(NO_SQUARE) }
    }

    /// The next cells to split: those about a narrow lobe's peak until they are finer than the lobe, then those that
    /// are worth most, until the budget or the gain runs out.
    #[inline(always)]
    fn next<F: Lanes>(&mut self, budget: Budget) -> Batch {
        let mut batch = Batch::default();
        if self.peaks[0].is_some() {
            let room = budget.squares.min(BASE_SQUARES + PEAK_SPLITS).saturating_sub(self.squares);
            let room = room.min(LANES as u32) as usize;
            while self.resolved < self.used && batch.count < room {
                let coarse = |cell: &Cell| cell.peak & COARSE != 0 && cell.inner == 0;
                if self.to.cells.get(self.resolved).is_some_and(coarse) {
                    batch.push(self.resolved);
                }
                self.resolved += 1;
            }
            if batch.count > 0 {
                self.spent_on_peaks = self.evaluations + (batch.count * NEW) as u32;
                return batch;
            }
        }
        let spent = self.evaluations - self.spent_on_peaks + BASE.len() as u32;
        let affordable = budget.evaluations.saturating_sub(spent) / NEW as u32;
        let affordable = affordable.min(budget.squares - self.squares);
        // Nine splits are better chosen as five and then four than as eight and then one.
        let rounds = affordable.div_ceil(LANES as u32).max(1);
        self.to.most_valuable::<F>(self.used, TOLERANCE * self.total, affordable.div_ceil(rounds) as usize)
    }

    /// Evaluates the five new points of each cell of a batch.
    #[inline(always)]
    fn evaluate<F: Lanes>(&mut self, batch: &Batch, parents: &Parents<F>) -> Result<[F; NEW]> {
        let [x, y] = parents.index;
        let mut wi = [Asked { wi: splat([0.0; 3]), lanes: batch.lanes() }; NEW];
        for (asked, [i, j]) in wi.iter_mut().zip([[1.0, 0.0], [1.0, 2.0], [0.0, 1.0], [2.0, 1.0], [1.0, 1.0]]) {
            let s = [(x + x + F::splat(i)) * parents.half, (y + y + F::splat(j)) * parents.half];
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
    fn split<F: Lanes>(&mut self, batch: &Batch, parents: &Parents<F>, new: [F; NEW]) {
        let residuals = residuals(parents.corners, new);
        let first = self.used;
        let mut sum = F::splat(0.0);
        for c in 0..4 {
            let children = self.weigh(parents, new, residuals, c);
            sum = sum + children.weight;
            self.append(batch, parents, &children);
        }
        self.put(F::splat(0.0));
        let before = parents.weight * F::splat(4.0);
        let change = F::only(F::mask(parents.lanes), (sum - before) * parents.half * parents.half);
        self.total += sum_of_lanes(change.to_array());
        for (lane, cell) in batch.iter() {
            self.record(Split { cell: cell as u32, first: (first + lane) as u32, apart: batch.count as u32 });
        }
    }

    /// Writes priorities behind the cells in use, as many as there are lanes.
    #[inline(always)]
    fn put<F: Lanes>(&mut self, priority: F) {
        if let Some(slots) = self.to.priorities.get_mut(self.used..self.used + LANES) {
            slots.copy_from_slice(&priority.to_array());
        }
    }

    /// Appends one child of each cell of a batch.
    #[inline(always)]
    fn append<F: Lanes>(&mut self, batch: &Batch, parents: &Parents<F>, children: &Children<F>) {
        self.put(children.priority);
        let all = |number: u32| F::index([number; LANES]);
        let light = F::add_index(parents.above, F::select_index(parents.lit, all(children.c), all(0)));
        let index = F::add_index(parents.place, all(next_index(0, children.c)));
        let place = [F::index(children.squares), light, index, parents.level].map(F::with_bits);
        let near = F::select_index(F::mask(children.near), all(NEAR), all(0));
        let peak = F::add_index(near, F::select_index(F::mask(children.coarse), all(COARSE), all(0)));
        let rest = [children.light, children.weight, F::with_bits(peak), F::splat(0.0)];
        let (corners, raised) = (F::rows(children.corners), F::rows(children.raised));
        let (place, rest) = (F::rows(place), F::rows(rest));
        let slots = self.to.cells.get_mut(self.used..self.used + batch.count).unwrap_or_default();
        for (lane, slot) in slots.iter_mut().enumerate() {
            let lane = lane & (LANES - 1);
            // Row by row: a cell that is put together elsewhere and then copied waits for its own parts.
            slot.corners = corners[lane];
            slot.raised = raised[lane];
            slot.place = Place::from_row(&place[lane]);
            slot.light = rest[lane][0];
            slot.weight = rest[lane][1];
            slot.peak = rest[lane][2].to_bits();
            slot.inner = 0;
        }
        self.used += batch.count;
    }

    /// The weights of the `c`-th children as leaves, and what splitting them is worth.
    #[inline(always)]
    fn weigh<F: Lanes>(&self, parents: &Parents<F>, new: [F; NEW], residuals: [F; NEW], c: u32) -> Children<F> {
        let zero = F::splat(0.0);
        let corners = corners_of_child(parents.corners, new, c);
        let [x, y] = parents.index;
        let width = parents.half;
        let light = parents.light[c as usize & 3];
        let largest = corners[0].max(corners[1]).max(corners[2].max(corners[3]));
        let smallest = corners[0].min(corners[1]).min(corners[2].min(corners[3]));
        let mut floor = (F::splat(LEAF_FLOOR) * largest).max(F::splat(self.least));
        let (mut near, mut coarse) = (0, 0);
        let unsure = (F::bits(smallest.le(zero)) | parents.near) & parents.lanes;
        if unsure != 0 {
            let half = F::splat(0.5);
            let index = [x + x + F::splat((c >> 1) as f32), y + y + F::splat((c & 1) as f32)];
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
        let reaches = zero.le(floor);
        let mut raised = corners;
        for corner in &mut raised {
            *corner = F::only(reaches, corner.max(floor));
        }
        let squares = self.squares_of_children(parents, c);
        let weight = self.leaf_weight(raised, light, squares);
        let [r0, r1, r2, r3] = raised;
        let mean = F::splat(0.25) * ((r0 + r1) + (r2 + r3));
        let spread = r0.max(r1).max(r2.max(r3)) - r0.min(r1).min(r2.min(r3));
        let beyond = residuals_of_child(residuals, c);
        let error = F::splat(0.35) * beyond + F::splat(0.03) * spread;
        let worth = width * width * light * error * error / (mean + F::splat(0.3) * error);
        let divisible = F::and(zero.lt(mean), F::mask(parents.divisible));
        Children {
            c,
            corners,
            raised,
            light,
            squares,
            weight,
            priority: F::only(divisible, worth),
            near: near & parents.near,
            coarse: coarse & parents.near & parents.divisible,
        }
    }

    /// The environment's squares for the `c`-th children.
    #[inline(always)]
    fn squares_of_children<F: Lanes>(&self, parents: &Parents<F>, c: u32) -> [u32; LANES] {
        if parents.in_heap {
            parents.squares.map(|square| square.wrapping_mul(4).wrapping_add(1 + c))
        } else {
            parents.squares.map(|square| self.child_square(square, c))
        }
    }

    /// The average product over leaves, as the descent below them sees it.
    #[inline(always)]
    fn leaf_weight<F: Lanes>(&self, corners: [F; 4], light: F, squares: [u32; LANES]) -> F {
        let squares = F::index(squares);
        let mut weights = Parts::whole(corners).masses(F::gather(self.light.squares(), squares));
        // Squares are fewer than 2^31, and NO_SQUARE is more.
        let dark = F::highest_bits(squares);
        if dark != 0 {
            let dark = F::mask(dark);
            for (weight, corner) in weights.iter_mut().zip(corners) {
                *weight = F::select(dark, light * corner, *weight);
            }
        }
        let [a, b, c, d] = weights;
        F::splat(0.25) * ((a + b) + (c + d))
    }
}

/// Values above this multiple of the largest of the base are cut, so that products stay finite.
const LARGEST: f32 = 1e9;

/// The index of child `c` of a cell, both axes in one number.
fn next_index(index: u32, c: u32) -> u32 {
    2 * index + (c >> 1 & 1) + ((c & 1) << 16)
}

/// A sum in a fixed order.
fn sum_of_lanes([a, b, c, d, e, f, g, h]: [f32; LANES]) -> f32 {
    ((a + b) + (c + d)) + ((e + f) + (g + h))
}

/// Cells that are about to be split, one in each lane.
struct Parents<F: Lanes> {
    /// The lanes in use, those that lie near a peak, and those whose children may be split, as bits.
    lanes: u32,
    near: u32,
    divisible: u32,
    corners: [F; 4],
    weight: F,
    index: [F; 2],
    /// The width of a child, and the largest distance from its centre.
    half: F,
    chord: F,
    /// The light of each child.
    light: [F; 4],
    squares: [u32; LANES],
    /// Whether the squares of all children stand in heap order.
    in_heap: bool,
    /// [`Place::light`] of the first children; that of the others is larger by their number in the lanes that are lit.
    above: F::Index,
    lit: F::Mask,
    /// [`Place::index`] and level of the first children.
    place: F::Index,
    level: F::Index,
}

impl<F: Lanes> Parents<F> {
    #[inline(always)]
    fn load<B: Brdf>(builder: &Builder<B>, batch: &Batch) -> Self {
        const NOTHING: Cell = Cell {
            corners: [0.0; 4],
            raised: [0.0; 4],
            place: Place { square: 0, light: 0, index: 0, level: 0 },
            light: 0.0,
            weight: 0.0,
            peak: 0,
            inner: 0,
        };
        let mut cells = [&NOTHING; LANES];
        for (slot, (_, index)) in cells.iter_mut().zip(batch.iter()) {
            *slot = builder.to.cells.get(index).unwrap_or(&NOTHING);
        }
        let level = cells.map(|cell| cell.place.level + 1);
        let index = cells.map(|cell| cell.place.index);
        let squares = cells.map(|cell| cell.place.square);
        let inner = builder.light.heap().saturating_sub(1) / 4;
        let in_heap = squares.iter().fold(true, |all, &square| all & (square < inner));
        let (mut above, mut lit) = (squares.map(|square| square.wrapping_mul(4)), ALL);
        let light = if squares.contains(&NO_SQUARE) {
            let light = |cell: &Cell| match cell.place.square {
                NO_SQUARE => [cell.light; 4],
                square => builder.light.children(square),
            };
            for (lane, cell) in cells.iter().enumerate().filter(|(_, cell)| cell.place.square == NO_SQUARE) {
                above[lane & (LANES - 1)] = cell.place.light;
                lit &= !(1 << lane);
            }
            F::transpose(cells.map(light).each_ref())
        } else {
            F::gather(builder.light.squares(), F::index(squares))
        };
        let near = if builder.peaks[0].is_some() {
            cells.iter().rev().fold(0, |bits, cell| bits << 1 | (cell.peak & NEAR))
        } else {
            0
        };
        let (x, y) = (index.map(|index| (index & 0xffff) as f32), index.map(|index| (index >> 16) as f32));
        let index = F::index(index);
        Parents {
            lanes: batch.lanes(),
            near,
            divisible: F::bits(F::below(F::index(level), MAX_DEPTH)) & batch.lanes(),
            corners: F::transpose(cells.map(|cell| &cell.corners)),
            weight: F::from_array(cells.map(|cell| cell.weight)),
            index: [F::from_array(x), F::from_array(y)],
            half: F::from_array(level.map(inverse_power)),
            chord: F::from_array(level.map(cell_chord)),
            light,
            squares,
            in_heap,
            above: F::index(above),
            lit: F::mask(lit),
            place: F::add_index(index, index),
            level: F::index(level),
        }
    }
}

/// One child of each of eight cells.
struct Children<F> {
    c: u32,
    corners: [F; 4],
    /// The corners, not below the floor; 0 if a cell is wholly below the horizon.
    raised: [F; 4],
    light: F,
    squares: [u32; LANES],
    weight: F,
    priority: F,
    near: u32,
    coarse: u32,
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
