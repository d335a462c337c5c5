//! Which cells are divided: the heaviest, kept in order while they are found.

use super::stored::MAX_DIVIDED;

/// A list of the heaviest cells.
#[derive(Clone, Copy, Debug)]
pub struct Heaviest {
    cells: [u32; MAX_DIVIDED],
    weights: [f32; MAX_DIVIDED],
    room: usize,
    count: usize,
}

impl Heaviest {
    /// An empty list with room for so many.
    pub fn new(room: usize) -> Heaviest {
        Heaviest { cells: [0; MAX_DIVIDED], weights: [0.0; MAX_DIVIDED], room: room.min(MAX_DIVIDED), count: 0 }
    }

    /// How many it can hold.
    pub fn room(&self) -> usize {
        self.room
    }

    /// The cells, heaviest first.
    pub fn cells(&self) -> &[u32] {
        self.cells.get(..self.count).unwrap_or(&[])
    }

    /// Puts a cell in its place, if there is one.
    #[inline(always)]
    pub fn offer(&mut self, cell: u32, weight: f32) {
        if self.count < self.room {
            self.count += 1;
        } else if self.weights.get(..self.count).and_then(|kept| kept.last()).is_none_or(|&least| weight <= least) {
            return;
        }
        let (mut cell, mut weight) = (cell, weight);
        // What is lighter moves on by one.
        for (c, w) in self.cells.iter_mut().zip(&mut self.weights).take(self.count) {
            if *w < weight {
                core::mem::swap(c, &mut cell);
                core::mem::swap(w, &mut weight);
            }
        }
    }
}
