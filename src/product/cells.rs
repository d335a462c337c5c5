//! The cells of a product under construction, in the caller's memory, and the squares and leaves that become of them.
//!
//! What a round computes side by side comes and goes in rows of four numbers. Priorities are an array of their own: the
//! best leaves are found eight at a time.

use super::{LEAF, Leaf, Square};
use crate::prior::{WIS_PRIOR_CELLS, mean_weight};
use crate::simd::{LANES, Lanes};

/// Set in [`Cell::peak`]: it lies near a narrow lobe's peak.
pub const NEAR: u32 = 1;
/// Set in [`Cell::peak`]: and is too coarse for it.
pub const COARSE: u32 = 2;

/// A cell under construction: four rows of four numbers.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Cell {
    /// BRDF x cosine at the corners, as evaluated.
    pub corners: [f32; 4],
    /// The same, not below the floor.
    pub raised: [f32; 4],
    /// Where it stands.
    pub place: Place,
    /// The average light.
    pub light: f32,
    /// The average product.
    pub weight: f32,
    /// [`NEAR`] and [`COARSE`]. Only cells near a peak have children near it.
    pub peak: u32,
    /// The square that it has become; 0 for a leaf. (The root, square 0, is nobody's child.)
    pub inner: u32,
}

/// Where a cell stands; as in [`Leaf`], but for the index.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Place {
    /// The environment's square for the cell, or NO_SQUARE.
    pub square: u32,
    /// Four times the environment's square above the cell plus the child that contains it, or NO_SQUARE.
    pub light: u32,
    /// Along axis 1, and 2^16 times that along axis 2.
    pub index: u32,
    /// Among 2^level cells along each axis.
    pub level: u32,
}

impl Place {
    /// From the bits of a row.
    #[inline(always)]
    pub fn from_row(&[square, light, index, level]: &[f32; 4]) -> Place {
        let [square, light, index, level] = [square.to_bits(), light.to_bits(), index.to_bits(), level.to_bits()];
        Place { square, light, index, level }
    }
}

impl Cell {
    /// What it is as a leaf.
    #[inline(always)]
    fn leaf(&self) -> Leaf {
        let Place { square, light, index, level } = self.place;
        Leaf { corners: self.raised, square, light, index: [index as u16, (index >> 16) as u16], level }
    }
}

/// A cell that was split. Child `c` is cell `first + c * apart`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Split {
    /// The cell.
    pub cell: u32,
    /// Its first child.
    pub first: u32,
    /// The distance from a child to the next.
    pub apart: u32,
}

/// How much room a budget of squares needs.
#[derive(Clone, Copy, Debug)]
pub struct Room {
    /// Cells.
    pub cells: usize,
    /// Priorities: whole groups of lanes are written.
    pub priorities: usize,
    /// Squares.
    pub splits: usize,
}

impl Room {
    /// For a budget of squares.
    pub fn new(squares: u32) -> Option<Room> {
        let cells = squares.checked_mul(4)?.checked_add(1)? as usize;
        Some(Room { cells, priorities: cells.checked_add(LANES)?, splits: squares as usize })
    }
}

/// What a product is built in, in the caller's memory.
pub struct Scratch<'a> {
    /// The cells; the root first.
    pub cells: &'a mut [Cell],
    /// How much splitting a leaf is worth; 0 for cells that are none.
    pub priorities: &'a mut [f32],
    /// The cell and the children of each square.
    pub splits: &'a mut [Split],
}

impl Scratch<'_> {
    /// Whether there is room for a budget.
    pub fn fits(&self, room: Room) -> bool {
        let (cells, priorities) = (self.cells.len() >= room.cells, self.priorities.len() >= room.priorities);
        cells && priorities && self.splits.len() >= room.splits
    }

    /// What is in use of it.
    pub fn into_used(self, used: usize, squares: usize) -> Self {
        Scratch {
            cells: self.cells.get_mut(..used).unwrap_or_default(),
            priorities: self.priorities,
            splits: self.splits.get_mut(..squares).unwrap_or_default(),
        }
    }

    /// The leaves of more than a priority that are worth most, at most `room` and at most eight, the best first; of
    /// equal ones the first.
    #[inline(always)]
    pub fn most_valuable<F: Lanes>(&self, used: usize, least: f32, room: usize) -> Batch {
        let Some(last) = room.checked_sub(1).map(|last| last & (LANES - 1)) else { return Batch::default() };
        // Numbers that are not negative are ordered as their bits.
        let mut best = [0u64; LANES];
        let mut worst = least;
        let groups = self.priorities.chunks_exact(LANES).take(used.div_ceil(LANES));
        for (first, eight) in (0u32..).step_by(LANES).zip(groups) {
            let Some(eight) = eight.first_chunk::<LANES>() else { continue };
            let mut better = F::bits(F::splat(worst).lt(F::from_array(*eight)));
            while better != 0 {
                let lane = better.trailing_zeros();
                better &= better - 1;
                let priority = eight[lane as usize & (LANES - 1)].to_bits();
                let mut candidate = u64::from(priority) << 32 | u64::from(!(first + lane));
                for kept in &mut best {
                    (*kept, candidate) = if candidate > *kept { (candidate, *kept) } else { (*kept, candidate) };
                }
                let kept = f32::from_bits((best[last] >> 32) as u32);
                worst = if kept > least { kept } else { least };
            }
        }
        let mut batch = Batch::default();
        for key in best.into_iter().take(room).filter(|&key| key != 0) {
            batch.push(!(key as u32) as usize);
        }
        batch
    }

    /// Writes the squares and leaves, and answers the average product, without and with the factors of a prior.
    pub fn emit(&mut self, prior: Option<&[f32; WIS_PRIOR_CELLS]>, to: (&mut [Square], &mut [Leaf])) -> [f32; 2] {
        let (squares, leaves) = to;
        let average = self.link(squares, leaves);
        let Some(factors) = prior else { return [average; 2] };
        for cell in self.cells.iter_mut().filter(|cell| cell.inner == 0) {
            let leaf = cell.leaf();
            cell.weight *= mean_weight(factors, leaf.level, leaf.index);
        }
        [average, self.link(squares, leaves)]
    }

    /// Sums the weights of leaves up to the root, and links squares and leaves. Children come after their parents.
    fn link(&mut self, squares: &mut [Square], leaves: &mut [Leaf]) -> f32 {
        let mut count = 0u32;
        for (split, square) in self.splits.iter().zip(squares).rev() {
            let mut k = split.first as usize;
            for (weight, link) in square.weights.iter_mut().zip(&mut square.links) {
                let Some(cell) = self.cells.get(k) else { continue };
                // A leaf is written in any case, and counted if it is one: most are, in no order to be predicted.
                if let Some(leaf) = leaves.get_mut(count as usize) {
                    *leaf = cell.leaf();
                }
                *weight = cell.weight;
                *link = if cell.inner == 0 { count | LEAF } else { cell.inner };
                count += u32::from(cell.inner == 0);
                k += split.apart as usize;
            }
            let [a, b, c, d] = square.weights;
            if let Some(cell) = self.cells.get_mut(split.cell as usize) {
                cell.weight = 0.25 * ((a + b) + (c + d));
            }
        }
        self.cells.first().map_or(0.0, |root| root.weight)
    }
}

/// Up to eight cells.
#[derive(Clone, Copy, Default)]
pub struct Batch {
    cells: [usize; LANES],
    /// How many.
    pub count: usize,
}

impl Batch {
    /// Cells one after the other.
    pub fn run(first: usize, count: usize) -> Batch {
        let mut batch = Batch::default();
        (first..first + count).for_each(|cell| batch.push(cell));
        batch
    }

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
        self.cells.into_iter().enumerate().take(self.count)
    }

    /// The lanes in use as bits.
    #[inline(always)]
    pub fn lanes(&self) -> u32 {
        (1 << self.count) - 1
    }
}
