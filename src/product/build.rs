//! Building a product: which cells to refine, what a leaf weighs, and the floor under it.

use super::{LEAF, Leaf, Square, corners_of_child, leaf_weight};
use crate::lobe::{Brdf, Peak};
use crate::numeric::{exp2i, exponent, inverse_power, max, min, sqrt};
use crate::sphere::{Frame, cell_chord, direction};
use crate::status::{Result, Status};
use crate::tree::{MAX_DEPTH, NO_SQUARE, Tree};
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
    /// What is spent if the caller does not say.
    pub const DEFAULT: Budget = Budget { squares: 128, evaluations: 64 };
}

/// Splits that the peaks of narrow lobes may cause.
const PEAK_SPLITS: u32 = 64;
/// Cells are refined where they overlap the ellipse of this many half-widths about a peak ...
const PEAK_REACH: f32 = 1.5;
/// ... until they are smaller than this many of its short half-widths.
const PEAK_DETAIL: f32 = 2.5;
/// A leaf that overlaps the ellipse of this many half-widths may hold the peak itself.
const PEAK_CORE: f32 = 0.5;
/// Cells of this level and finer are flat enough to be taken as parallelograms.
const FLAT_LEVEL: u32 = 5;
/// No leaf is darker than this share of a peak that it may hold ...
const PEAK_FLOOR: f32 = 0.1;
/// ... or than this share of its largest corner.
const LEAF_FLOOR: f32 = 0.05;
/// Refinement stops where a split would lower the variance of a sample's weight by less than this.
const TOLERANCE: f32 = 1e-4;
/// Squares of the base: the root and its children.
const BASE_SQUARES: u32 = 5;
/// Cells that are split side by side.
const BATCH: usize = 8;
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
    /// The stored values of the BRDF are its own times `2^-exponent`.
    pub exponent: i32,
}

/// The cells that a budget of squares needs.
pub fn cell_count(squares: u32) -> Option<u32> {
    squares.checked_mul(4)?.checked_add(1)
}

/// The floor under leaves (rule 16 of the design).
#[derive(Clone, Copy)]
struct Floor {
    hemisphere: Option<Vec3>,
    /// The least value of a corner in a leaf that reaches above the horizon.
    least: f32,
}

impl Floor {
    /// The floor of a leaf; below 0 for one that is wholly below the horizon.
    ///
    /// Four dark corners do not mean a dark cell: one that reaches above the horizon keeps the least value.
    fn of(&self, corners: [f32; 4], level: u32, centre: Vec3) -> f32 {
        let above = self.hemisphere.is_none_or(|normal| normal.dot(centre) + cell_chord(level) >= 0.0);
        if above { self.above(corners) } else { -1.0 }
    }

    /// The floor of a leaf that reaches above the horizon.
    fn above(&self, corners: [f32; 4]) -> f32 {
        let largest = corners.iter().fold(0.0, |a, &b| max(a, b));
        max(LEAF_FLOOR * largest, self.least)
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
    /// Values are multiplied by this power of two before they are stored.
    scale: f32,
    floor: Floor,
    /// The narrow lobes and their values at the peak.
    peaks: [Option<(Peak, f32)>; 4],
}

/// Builds the cells of a product.
///
/// # Errors
/// [`Status::MemoryTooSmall`] if `cells` is shorter than [`cell_count`] of the budget,
/// [`Status::CallbackFailed`] if the BRDF gives a value that is NaN, infinite or negative.
pub fn build<B: Brdf>(
    light: Tree<'_, 4>,
    frame: &Frame,
    brdf: &mut B,
    budget: Budget,
    cells: &mut [Cell],
) -> Result<Built> {
    let needed = cell_count(budget.squares).ok_or(Status::Overflow)?;
    if budget.squares == 0 || cells.len() < needed as usize {
        return Err(Status::MemoryTooSmall);
    }
    let base = Base::evaluate(frame, brdf)?;
    if !(light.average() > 0.0 && brdf.may_reflect()) {
        return Ok(Built { evaluations: base.evaluations, ..Built::default() });
    }
    let mut builder = Builder::new(light, frame, brdf, cells, &base);
    builder.base(&base, budget);
    builder.resolve_peaks(budget)?;
    builder.refine(budget)?;
    Ok(builder.finish(base.exponent))
}

/// The directions of the corners of 4 x 4 cells: 25 grid points, of which the folded edges leave 18.
const BASE: [[f32; 3]; 18] = {
    const H: f32 = 0.661_437_8;
    const D: f32 = core::f32::consts::FRAC_1_SQRT_2;
    [
        [0.0, 0.0, -1.0],
        [-H, 0.0, -0.75],
        [-1.0, 0.0, 0.0],
        [0.0, -H, -0.75],
        [-D, -D, 0.0],
        [-H, 0.0, 0.75],
        [-D, D, 0.0],
        [0.0, H, -0.75],
        [0.0, -1.0, 0.0],
        [0.0, -H, 0.75],
        [0.0, 0.0, 1.0],
        [0.0, H, 0.75],
        [0.0, 1.0, 0.0],
        [D, -D, 0.0],
        [H, 0.0, 0.75],
        [D, D, 0.0],
        [H, 0.0, -0.75],
        [1.0, 0.0, 0.0],
    ]
};

/// Which of [`BASE`] is the grid point (i, j), both 0 to 4.
const GRID: [[u8; 5]; 5] =
    [[0, 1, 2, 1, 0], [3, 4, 5, 6, 7], [8, 9, 10, 11, 12], [3, 13, 14, 15, 7], [0, 16, 17, 16, 0]];

/// The first values of the BRDF, and what follows from them.
struct Base {
    values: [f32; BASE.len()],
    /// The values at the peaks.
    peaks: [f32; 4],
    /// The mean of the values above the horizon.
    mean: f32,
    exponent: i32,
    evaluations: u32,
}

impl Base {
    /// Evaluates the base directions and the peaks.
    fn evaluate<B: Brdf>(frame: &Frame, brdf: &mut B) -> Result<Base> {
        let mut directions = [Vec3::ZERO; BASE.len() + 4];
        let hemisphere = brdf.hemisphere();
        let mut count = BASE.len();
        for (slot, base) in directions.iter_mut().zip(BASE) {
            *slot = frame.to_world(Vec3::from_array(base));
        }
        for (slot, peak) in directions.iter_mut().skip(BASE.len()).zip(brdf.peaks()) {
            *slot = peak.direction;
            count += 1;
        }
        let mut values = [0.0; BASE.len() + 4];
        let (wi, out) = (directions.get(..count).unwrap_or(&[]), values.get_mut(..count).unwrap_or(&mut []));
        evaluate(brdf, wi, out)?;
        let largest = values.iter().fold(0.0, |a, &b| max(a, b));
        let above = |wi: &Vec3| hemisphere.is_none_or(|n| n.dot(*wi) > 0.0);
        let lit = directions.iter().zip(values).take(BASE.len()).filter(|(wi, _)| above(wi));
        let (sum, lit) = lit.fold((0.0f64, 0.0f64), |(sum, n), (_, v)| (sum + f64::from(v), n + 1.0));
        let mut base = [0.0; BASE.len()];
        let mut peaks = [0.0; 4];
        for (slot, value) in base.iter_mut().chain(&mut peaks).zip(values) {
            *slot = value;
        }
        Ok(Base {
            values: base,
            peaks,
            mean: (sum / if lit > 0.0 { lit } else { 1.0 }) as f32,
            // Within what an f32 holds as a factor, also for the values of denormal BRDFs and if all are 0.
            exponent: if largest > 0.0 { exponent(f64::from(largest)).clamp(-126, 126) } else { -126 },
            evaluations: count as u32,
        })
    }

    /// The value at a grid point of the 4 x 4 cells.
    fn at(&self, i: usize, j: usize) -> f32 {
        let direction = GRID.get(i).and_then(|row| row.get(j)).copied().unwrap_or(0);
        self.values.get(usize::from(direction)).copied().unwrap_or(0.0)
    }
}

/// Evaluates a BRDF and checks what it gives.
fn evaluate<B: Brdf>(brdf: &mut B, wi: &[Vec3], f_cos: &mut [f32]) -> Result<()> {
    brdf.eval(wi, f_cos)?;
    if f_cos.iter().all(|f| (0.0..=f32::MAX).contains(f)) { Ok(()) } else { Err(Status::CallbackFailed) }
}

impl<'a, B: Brdf> Builder<'a, B> {
    fn new(light: Tree<'a, 4>, frame: &'a Frame, brdf: &'a mut B, cells: &'a mut [Cell], base: &Base) -> Self {
        let scale = exp2i(-base.exponent) as f32;
        // The mean of the base may underflow for very narrow lobes: the second term keeps the floor positive, since
        // the BRDF may well be above 0 between the directions of the base.
        let least = max(base.mean * scale * (1.0 / 1024.0), exp2i(-40) as f32);
        let floor = Floor { hemisphere: brdf.hemisphere(), least };
        let mut peaks = [None; 4];
        for ((slot, peak), value) in peaks.iter_mut().zip(brdf.peaks()).zip(base.peaks) {
            *slot = Some((peak, value * scale));
        }
        let evaluations = base.evaluations;
        Builder { light, frame, brdf, cells, used: 0, squares: 0, evaluations, scale, floor, peaks }
    }

    fn cell(&self, index: usize) -> Cell {
        self.cells.get(index).copied().unwrap_or_default()
    }

    /// The root, its four children and, if the budget allows, its sixteen grandchildren.
    fn base(&mut self, base: &Base, budget: Budget) {
        let value = |i: usize, j: usize| base.at(i, j) * self.scale;
        let root = Cell {
            corners: [value(0, 0), value(0, 4), value(4, 0), value(4, 4)],
            light: self.light.average(),
            square: self.light.root_square().unwrap_or(NO_SQUARE),
            above: NO_SQUARE,
            ..Cell::default()
        };
        if let Some(slot) = self.cells.first_mut() {
            *slot = root;
        }
        self.used = 1;
        let inner = if budget.squares < BASE_SQUARES { 1 } else { BASE_SQUARES };
        for index in 0..inner as usize {
            let cell = self.cell(index);
            let step = if cell.level == 0 { 2 } else { 1 };
            let (i, j) = (usize::from(cell.index[0]) * 2 * step, usize::from(cell.index[1]) * 2 * step);
            let at = |di: usize, dj: usize| base.at(i + di * step, j + dj * step) * self.scale;
            self.split(index, [at(1, 0), at(1, 2), at(0, 1), at(2, 1), at(1, 1)]);
        }
    }

    /// Splits every cell about a narrow lobe's peak until it is finer than the lobe.
    fn resolve_peaks(&mut self, budget: Budget) -> Result<()> {
        let limit = budget.squares.min(self.squares + PEAK_SPLITS);
        let mut next = 0;
        while next < self.used && self.squares < limit {
            let mut batch = [0usize; BATCH];
            let mut count = 0;
            let room = (limit - self.squares).min(BATCH as u32) as usize;
            while next < self.used && count < room {
                let cell = self.cell(next);
                if cell.children == 0 && cell.coarse != 0 {
                    if let Some(slot) = batch.get_mut(count) {
                        *slot = next;
                        count += 1;
                    }
                }
                next += 1;
            }
            self.split_batch(batch.get(..count).unwrap_or(&[]))?;
        }
        Ok(())
    }

    /// Splits the cells that are worth most, a batch at a time, until the budget or the gain runs out.
    fn refine(&mut self, budget: Budget) -> Result<()> {
        let spent_on_peaks = self.evaluations;
        loop {
            let spent = self.evaluations - spent_on_peaks + BASE.len() as u32;
            let affordable = budget.evaluations.saturating_sub(spent) / NEW as u32;
            let room = affordable.min(budget.squares - self.squares).min(BATCH as u32) as usize;
            let (batch, count) = self.most_valuable(room);
            if count == 0 {
                return Ok(());
            }
            self.split_batch(batch.get(..count).unwrap_or(&[]))?;
        }
    }

    /// The leaves with the highest priority, the best first; equal ones in the order of their index.
    fn most_valuable(&self, room: usize) -> ([usize; BATCH], usize) {
        let total: f32 = self.leaves().map(|(_, cell)| cell.weight * area(cell.level)).sum();
        let mut best = [(TOLERANCE * total, usize::MAX); BATCH];
        for (index, cell) in self.leaves() {
            let mut candidate = (cell.priority, index);
            if best.get(room.wrapping_sub(1)).is_none_or(|worst| candidate.0 <= worst.0) {
                continue;
            }
            for kept in best.iter_mut().take(room) {
                if candidate.0 > kept.0 {
                    core::mem::swap(&mut candidate, kept);
                }
            }
        }
        let count = best.iter().take(room).filter(|(_, index)| *index != usize::MAX).count();
        (best.map(|(_, index)| index), count)
    }

    fn leaves(&self) -> impl Iterator<Item = (usize, &Cell)> {
        self.cells.iter().take(self.used).enumerate().filter(|(_, cell)| cell.children == 0)
    }

    /// Evaluates the five new points of each cell of a batch together, then splits the cells.
    fn split_batch(&mut self, batch: &[usize]) -> Result<()> {
        if batch.is_empty() {
            return Ok(());
        }
        let mut wi = [Vec3::ZERO; BATCH * NEW];
        let mut f_cos = [0.0; BATCH * NEW];
        for (slots, &index) in wi.chunks_exact_mut(NEW).zip(batch) {
            let cell = self.cell(index);
            for (slot, s) in slots.iter_mut().zip(new_points(&cell)) {
                *slot = self.frame.to_world(direction(s));
            }
        }
        let count = batch.len() * NEW;
        let (wi, f_cos) = (wi.get(..count).unwrap_or(&[]), f_cos.get_mut(..count).unwrap_or(&mut []));
        evaluate(self.brdf, wi, f_cos)?;
        self.evaluations += count as u32;
        for (values, &index) in f_cos.chunks_exact(NEW).zip(batch) {
            let mut new = [0.0; NEW];
            for (slot, value) in new.iter_mut().zip(values) {
                *slot = min(value * self.scale, LARGEST);
            }
            self.split(index, new);
        }
        Ok(())
    }

    /// Appends the four children of a cell.
    fn split(&mut self, index: usize, new: [f32; NEW]) {
        let parent = self.cell(index);
        let residuals = residuals(parent.corners, new);
        let light = self.light.children(parent.square);
        let near_peak = parent.near_peak != 0 || parent.level == 0;
        let first = self.used;
        for c in 0..4u32 {
            let has_square = parent.square != NO_SQUARE;
            let mut child = Cell {
                corners: corners_of_child(parent.corners, new, c),
                light: if has_square { light.get(c as usize).copied().unwrap_or(0.0) } else { parent.light },
                square: if has_square {
                    self.light.child_square(parent.square, c).unwrap_or(NO_SQUARE)
                } else {
                    NO_SQUARE
                },
                above: if has_square { parent.square * 4 + c } else { parent.above },
                level: parent.level + 1,
                index: [2 * parent.index[0] + (c >> 1) as u16, 2 * parent.index[1] + (c & 1) as u16],
                ..Cell::default()
            };
            self.weigh(&mut child, corners_of_child([0.0; 4], residuals, c), near_peak);
            if let Some(slot) = self.cells.get_mut(self.used) {
                *slot = child;
                self.used += 1;
            }
        }
        if let Some(cell) = self.cells.get_mut(index) {
            cell.children = first as u32;
        }
        self.squares += 1;
    }

    /// The weight of a cell as a leaf, and what splitting it is worth.
    fn weigh(&self, cell: &mut Cell, residuals: [f32; 4], parent_peaks: bool) {
        let dark = cell.corners.iter().any(|&c| c <= 0.0);
        if dark || parent_peaks {
            let centre = self.frame.to_world(direction(centre(cell)));
            cell.floor = self.floor.of(cell.corners, cell.level, centre);
            if parent_peaks {
                self.mind_peaks(cell, centre);
            }
        } else {
            cell.floor = self.floor.above(cell.corners);
        }
        let corners = cell.raised();
        cell.weight = leaf_weight(corners, cell.light, self.light.children(cell.square), cell.square);
        let largest = corners.iter().fold(0.0, |a, &b| max(a, b));
        let smallest = corners.iter().fold(largest, |a, &b| min(a, b));
        let mean = 0.25 * ((corners[0] + corners[1]) + (corners[2] + corners[3]));
        let residual = residuals.iter().fold(0.0, |a, &b| max(a, b));
        let error = 0.35 * residual + 0.03 * (largest - smallest);
        if cell.level < MAX_DEPTH && mean > 0.0 {
            cell.priority = area(cell.level) * cell.light * error * error / (mean + 0.3 * error);
        }
    }

    /// Marks a cell that is too coarse for a peak near it, and raises the floor of one that may hold the peak itself.
    ///
    /// Without this the cells at a narrow peak, whose corners are all dark, are missed.
    fn mind_peaks(&self, cell: &mut Cell, centre: Vec3) {
        let shape = Shape::of(cell, centre, self.frame);
        for (peak, value) in self.peaks.iter().flatten() {
            if !shape.is_near(peak, PEAK_REACH) {
                continue;
            }
            cell.near_peak = 1;
            let coarse = cell_chord(cell.level) > PEAK_DETAIL * peak.radii[1] && cell.level < MAX_DEPTH;
            cell.coarse |= u32::from(coarse);
            if cell.floor >= 0.0 && shape.is_near(peak, PEAK_CORE) {
                // All that the lobe reflects lies within about twice its half-widths: a coarse leaf holds no more.
                let share = min(PEAK_FLOOR, peak.radii[0] * peak.radii[1] / area(cell.level));
                cell.floor = max(cell.floor, share * value);
            }
        }
    }

    /// Sums the weights up to the root and numbers squares and leaves.
    fn finish(self, exponent: i32) -> Built {
        let cells = self.cells.get_mut(..self.used).unwrap_or(&mut []);
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
        let (mut squares, mut leaves) = (0, 0);
        for cell in cells.iter_mut() {
            let counter = if cell.children == 0 { &mut leaves } else { &mut squares };
            cell.number = *counter;
            *counter += 1;
        }
        let average = cells.first().map_or(0.0, |root| root.weight);
        Built { cells: self.used as u32, squares, leaves, evaluations: self.evaluations, average, exponent }
    }
}

/// Values above this multiple of the largest of the base are cut, so that products stay finite.
const LARGEST: f32 = 1e9;

fn area(level: u32) -> f32 {
    inverse_power(2 * level)
}

fn centre(cell: &Cell) -> [f32; 2] {
    let width = inverse_power(cell.level);
    cell.index.map(|i| (f32::from(i) + 0.5) * width)
}

/// The points of a cell's five new values, in the order of [`corners_of_child`].
fn new_points(cell: &Cell) -> [[f32; 2]; NEW] {
    let half = inverse_power(cell.level + 1);
    let at =
        |i: f32, j: f32| [(2.0 * f32::from(cell.index[0]) + i) * half, (2.0 * f32::from(cell.index[1]) + j) * half];
    [at(1.0, 0.0), at(1.0, 2.0), at(0.0, 1.0), at(2.0, 1.0), at(1.0, 1.0)]
}

/// How far the five new values are from the bilinear function of the corners.
fn residuals(corners: [f32; 4], new: [f32; NEW]) -> [f32; NEW] {
    let [c00, c01, c10, c11] = corners;
    let predicted = [
        0.5 * (c00 + c10),
        0.5 * (c01 + c11),
        0.5 * (c00 + c01),
        0.5 * (c10 + c11),
        0.25 * ((c00 + c01) + (c10 + c11)),
    ];
    let mut result = new;
    for (value, predicted) in result.iter_mut().zip(predicted) {
        *value = (*value - predicted).abs();
    }
    result
}

/// Where a cell lies on the sphere.
struct Shape {
    centre: Vec3,
    /// No point of the cell is farther from the centre.
    chord: f32,
    /// The vectors from the centre to the middles of the upper edges, of a cell small enough to be flat.
    half_axes: Option<[Vec3; 2]>,
}

impl Shape {
    fn of(cell: &Cell, middle: Vec3, frame: &Frame) -> Shape {
        let half = inverse_power(cell.level + 1);
        let [x, y] = centre(cell);
        let axes = || [[x + half, y], [x, y + half]].map(|s| frame.to_world(direction(s)) - middle);
        let half_axes = (cell.level >= FLAT_LEVEL).then(axes);
        Shape { centre: middle, chord: cell_chord(cell.level), half_axes }
    }

    /// Whether the cell overlaps the ellipse of `reach` half-widths about a peak.
    fn is_near(&self, peak: &Peak, reach: f32) -> bool {
        let [long, short] = peak.radii.map(|r| reach * r);
        let offset = peak.direction - self.centre;
        let close =
            sqrt(offset.length_squared()) <= long + self.chord && offset.dot(peak.across).abs() <= short + self.chord;
        close && self.half_axes.is_none_or(|axes| overlaps(peak, [long, short], offset, axes))
    }
}

/// Whether an ellipse overlaps a cell: in the coordinates of the cell's half axes the cell is the square [-1, 1]^2.
fn overlaps(peak: &Peak, [long, short]: [f32; 2], offset: Vec3, [a, b]: [Vec3; 2]) -> bool {
    let (aa, ab, bb) = (a.dot(a), a.dot(b), b.dot(b));
    let determinant = max(aa * bb - ab * ab, f32::MIN_POSITIVE);
    let local = |v: Vec3| {
        let (va, vb) = (v.dot(a), v.dot(b));
        [(va * bb - vb * ab) / determinant, (vb * aa - va * ab) / determinant]
    };
    let ([x, y], [ux, uy], [vx, vy]) = (local(offset), local(peak.along() * long), local(peak.across * short));
    x.abs() <= 1.0 + sqrt(ux * ux + vx * vx) && y.abs() <= 1.0 + sqrt(uy * uy + vy * vy)
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
