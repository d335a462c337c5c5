//! A product under construction, in the caller's memory. Nodes are written where they will stay: a leaf that is split
//! gives its place to its first child.
//!
//! Squares are numbered in the order of their making. The first `base` of them are a complete tree and stand, followed
//! by its `3 base + 1` leaves, at the front; every later square q stands at node `4 q + 1` before three of its children.
//! Leaves are numbered from the first one on, later squares among them.

use super::Node;
use super::base::LEAST_SQUARES;
use crate::wavelets::lanes::{LANES, Lanes};
use bytemuck::{Pod, Zeroable};

/// A cell that lies near a narrow lobe's peak.
pub const NEAR: u32 = 1;

/// What is known of a leaf besides its node, while it may be split.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Cell {
    /// BRDF x cosine at the corners, as evaluated.
    pub corners: [f32; 4],
    /// The average light and product, and the bits of two words.
    pub rest: [f32; 4],
}

impl Cell {
    /// No cell.
    pub const NOTHING: Cell = Cell { corners: [0.0; 4], rest: [0.0; 4] };

    /// The average light.
    pub fn light(&self) -> f32 {
        self.rest[0]
    }

    /// The average product.
    pub fn weight(&self) -> f32 {
        self.rest[1]
    }

    /// `NEAR` if it lies near a narrow lobe's peak, else 0. Only such cells have children near it.
    pub fn near(&self) -> u32 {
        self.rest[2].to_bits()
    }

    /// Four times the node of the square above plus which child it is.
    pub fn slot(&self) -> u32 {
        self.rest[3].to_bits()
    }
}

/// How much room a budget of squares needs.
#[derive(Clone, Copy, Debug)]
pub struct Room {
    /// Nodes.
    pub nodes: usize,
    /// Cells.
    pub cells: usize,
    /// Priorities: whole rows are read.
    pub priorities: usize,
    /// Squares.
    pub squares: usize,
}

impl Room {
    /// For a budget of squares.
    pub fn new(squares: u32) -> Option<Room> {
        let squares = squares.max(LEAST_SQUARES);
        let nodes = squares.checked_mul(4)?.checked_add(1)? as usize;
        Some(Room { nodes, cells: nodes, priorities: nodes.checked_add(COLUMNS)?, squares: squares as usize })
    }
}

/// What a product is built in, in the caller's memory.
pub struct Scratch<'a> {
    /// The product itself.
    pub nodes: &'a mut [Node],
    /// What is known of leaves.
    pub cells: &'a mut [Cell],
    /// How much splitting a leaf is worth, with the sign set if it is too coarse for a peak; 0 for what is none.
    pub priorities: &'a mut [f32],
    /// [`Cell::slot`] of each later square.
    pub slots: &'a mut [u32],
}

impl Scratch<'_> {
    /// Whether there is room for a budget.
    pub fn fits(&self, room: Room) -> bool {
        let (nodes, cells) = (self.nodes.len() >= room.nodes, self.cells.len() >= room.cells);
        nodes && cells && self.priorities.len() >= room.priorities && self.slots.len() >= room.squares
    }

    /// The first leaves that are too coarse for a peak, at most `room` and at most eight.
    #[inline(always)]
    pub fn coarse<F: Lanes>(&self, used: usize, room: usize) -> Batch {
        let mut batch = Batch::default();
        for (first, eight) in self.groups(used) {
            let mut coarse = F::highest_bits(F::index(eight.map(f32::to_bits)));
            while coarse != 0 && batch.count < room.min(LANES) {
                batch.push(first as usize + coarse.trailing_zeros() as usize);
                coarse &= coarse - 1;
            }
        }
        batch
    }

    /// At most `room` and at most eight leaves of more than a priority: of the best of each column those that are worth
    /// most. They are worth nothing any more.
    #[inline(always)]
    pub fn most_valuable<F: Lanes>(&mut self, used: usize, least: f32, room: usize) -> Batch {
        let (worth, rows) = self.best_of_columns::<F>(used);
        let mut batch = Batch::default();
        let mut chosen = largest::<F>(&keys(&worth, least), room.min(LANES));
        while chosen != 0 {
            let column = chosen.trailing_zeros() as usize & (COLUMNS - 1);
            let number = rows[column] as usize * COLUMNS + column;
            if let Some(priority) = self.priorities.get_mut(number) {
                *priority = 0.0;
            }
            batch.push(number);
            chosen &= chosen - 1;
        }
        batch
    }

    /// The largest priority of each column, and the first row in which it stands.
    #[inline(always)]
    fn best_of_columns<F: Lanes>(&self, used: usize) -> ([f32; COLUMNS], [f32; COLUMNS]) {
        let (mut best, mut best_row) = ([F::splat(0.0); GROUPS], [F::splat(0.0); GROUPS]);
        let rows = self.priorities.chunks_exact(COLUMNS).take(used.div_ceil(COLUMNS));
        for (row, priorities) in (0u32..).zip(rows) {
            let row = F::splat(row as f32);
            let groups = priorities.chunks_exact(LANES).filter_map(|eight| eight.first_chunk());
            for ((best, best_row), eight) in best.iter_mut().zip(&mut best_row).zip(groups) {
                let worth = F::from_array(*eight).abs();
                let better = best.lt(worth);
                (*best, *best_row) = (F::select(better, worth, *best), F::select(better, row, *best_row));
            }
        }
        (in_columns(best), in_columns(best_row))
    }

    /// Eight priorities at a time, and the number of the first.
    #[inline(always)]
    fn groups(&self, used: usize) -> impl Iterator<Item = (u32, &[f32; LANES])> {
        let groups = self.priorities.chunks_exact(LANES).take(used.div_ceil(LANES));
        (0u32..).step_by(LANES).zip(groups.filter_map(|eight| eight.first_chunk()))
    }

    /// Completes the averages of squares, and answers that of the product.
    pub fn finish(&mut self, base: u32, squares: u32) -> f32 {
        if squares == 0 { 0.0 } else { self.sum_up(base, squares) }
    }

    /// Sums averages up to the root. Children come after their parents.
    fn sum_up(&mut self, base: u32, squares: u32) -> f32 {
        let mean = |[a, b, c, d]: [f32; 4]| 0.25 * ((a + b) + (c + d));
        let slots = self.slots.get(base as usize..squares as usize).unwrap_or_default();
        for (later, &slot) in slots.iter().enumerate().rev() {
            let average = self.nodes.get(4 * (base as usize + later) + 1).map_or(0.0, |node| mean(node.values));
            if let Some(node) = self.nodes.get_mut(slot as usize / 4) {
                node.values[slot as usize & 3] = average;
            }
        }
        let squares = self.nodes.get_mut(..base as usize).unwrap_or_default();
        for above in (0..squares.len() / 4).rev() {
            let Some(children) = squares.get(4 * above + 1..).and_then(|children| children.first_chunk::<4>()) else {
                continue;
            };
            squares[above].values = children.map(|child| mean(child.values));
        }
        squares.first().map_or(0.0, |root| mean(root.values))
    }
}

/// The most valuable leaves are found among the best of so many columns, in which they stand row by row: in one pass, and
/// at the price of one or two of the eight best, on average, for which the next best are taken.
pub const COLUMNS: usize = GROUPS * LANES;
const GROUPS: usize = 2;
/// What tells columns apart in a number's bits.
const LAST_BITS: u32 = COLUMNS as u32 - 1;

/// The numbers of all columns.
#[inline(always)]
fn in_columns<F: Lanes>(groups: [F; GROUPS]) -> [f32; COLUMNS] {
    let mut columns = [0.0; COLUMNS];
    for (eight, group) in columns.chunks_exact_mut(LANES).zip(groups) {
        eight.copy_from_slice(&group.to_array());
    }
    columns
}

/// Numbers in the order of what columns are worth, of which no two are equal: the last bits give way to the number of the
/// column. 0 for a column that is not worth more than `least`.
#[inline(always)]
fn keys(worth: &[f32; COLUMNS], least: f32) -> [f32; COLUMNS] {
    let mut keys = [0.0; COLUMNS];
    for ((key, &worth), column) in keys.iter_mut().zip(worth).zip(0u32..) {
        let finite = if worth < f32::MAX { worth } else { f32::MAX };
        let unique = f32::from_bits(finite.to_bits() & !LAST_BITS | LAST_BITS ^ column);
        *key = if worth > least { unique } else { 0.0 };
    }
    keys
}

/// The columns with the `count` largest keys, as bits; none with 0.
#[inline(always)]
fn largest<F: Lanes>(keys: &[f32; COLUMNS], count: usize) -> u32 {
    let mut groups = [F::splat(0.0); GROUPS];
    for (group, eight) in groups.iter_mut().zip(keys.chunks_exact(LANES).filter_map(|eight| eight.first_chunk())) {
        *group = F::from_array(*eight);
    }
    let mut before = [F::splat(0.0); GROUPS];
    for &key in keys {
        for (before, group) in before.iter_mut().zip(groups) {
            *before = *before + F::unit(group.lt(F::splat(key)));
        }
    }
    let first = |(group, before): (&F, &F)| F::and(F::splat(0.0).lt(*group), before.lt(F::splat(count as f32)));
    groups.iter().zip(&before).rev().fold(0, |bits, pair| bits << LANES | F::bits(first(pair)))
}

/// Up to eight cells.
#[derive(Clone, Copy, Default)]
pub struct Batch {
    cells: [usize; LANES],
    /// How many.
    pub count: usize,
}

impl Batch {
    /// Adds a cell, if there is room.
    #[inline(always)]
    pub fn push(&mut self, cell: usize) {
        if let Some(slot) = self.cells.get_mut(self.count) {
            *slot = cell;
            self.count += 1;
        }
    }

    /// Lane and cell.
    #[inline(always)]
    pub fn iter(&self) -> impl Iterator<Item = (usize, usize)> {
        (0..self.count).map(|lane| (lane, self.cells[lane & (LANES - 1)]))
    }

    /// The lanes in use as bits.
    #[inline(always)]
    pub fn lanes(&self) -> u32 {
        (1 << self.count) - 1
    }
}
