//! What candidates for rays read of the light: walks down of those that are drawn from it, looks of those that are drawn from lobes.
//!
//! Both go on side by side, stage by stage: what one asks for arrives while the other works.

use super::chart::Place;
use super::glance::Look;
pub use super::glance::Looked;
use super::tables::Light;
use super::walk::{Floats, NUMBER, OfCells, Walk, clamp_u};
use crate::simd::{LANES, Num, prefetch};

/// Candidates of each source that are read together: those of one ray.
pub const TOGETHER: usize = 16;

/// What is read for up to [`TOGETHER`] candidates of each source.
pub struct Reads {
    walk: Walk<TOGETHER>,
    numbers: [Floats<TOGETHER>; 2],
    of_cells: OfCells<TOGETHER>,
    look: Look<TOGETHER>,
}

impl Default for Reads {
    #[inline(always)]
    fn default() -> Self {
        Reads { walk: Walk::new(), numbers: [[NUMBER; TOGETHER]; 2], of_cells: OfCells::new(), look: Look::new() }
    }
}

impl Reads {
    /// Begins in the cells of as many candidates of the light as there are numbers, across and down.
    // Functions of their own, here and below: they are the same at all levels. Counts are no constants, so that loops stay short code.
    #[inline(never)]
    pub fn begin(&mut self, light: &Light<'_>, across: &[f32], down: &[f32]) {
        let [numbers_across, numbers_down] = &mut self.numbers;
        let lanes = self.walk.cell.iter_mut().zip(numbers_across).zip(numbers_down);
        for (((cell, w), v), (&x, &y)) in lanes.zip(across.iter().zip(down)) {
            let (found, numbers) = light.cell_at(&light.candidates, [clamp_u(x), clamp_u(y)]);
            prefetch(light.cells, found);
            *cell = found as u32;
            [*w, *v] = numbers;
        }
    }

    /// Notes where candidates of lobes are, from number `first` on.
    #[inline(always)]
    pub fn aim<F: Num>(&mut self, light: &Light<'_>, first: usize, place: &Place<F>) {
        self.look.aim(light, first, place);
    }

    /// Reads what so many candidates of both sources need.
    #[inline(never)]
    pub fn read(&mut self, light: &Light<'_>, walks: usize, looks: usize) {
        let Reads { walk, numbers, of_cells, look } = self;
        look.find_cells(light, looks);
        walk.ask_for_starts(light, walks);
        look.find_blocks(light, looks);
        walk.find_block_rows(light, numbers, Some(of_cells), walks);
        look.ask_for_corners(light, looks);
        walk.find_blocks(light, numbers, Some(of_cells), walks);
        walk.ask_for_rows(light, walks);
        look.read_corners(light, looks);
        walk.find_rows(light, numbers, walks);
        walk.find_patches(light, numbers, walks);
    }

    /// The candidates of the light from number `first` on: directions of map space, their densities over [`Looked::candidates`], and
    /// what a look would find there.
    #[inline(always)]
    pub fn drawn<F: Num>(&self, light: &Light<'_>, first: usize) -> ([F; 3], F, Looked<F>) {
        let drawn = self.walk.drawn::<F>(light, &self.numbers, Some(&self.of_cells), first);
        let direction = light.direction_of(&drawn);
        let density = light.alone(&light.drawn_at(&light.chart.place(direction), &drawn));
        (
            direction,
            density,
            Looked { radiance: light.radiance_at(&drawn, density), candidates: drawn.patch.candidates },
        )
    }

    /// What the candidates of lobes found, from number `first` on.
    #[inline(always)]
    pub fn looked<F: Num>(&self, light: &Light<'_>, first: usize) -> Looked<F> {
        self.look.looked(light, first)
    }
}

/// Eight looks that stop at blocks.
pub struct Glance {
    look: Look<LANES>,
}

impl Glance {
    /// The mean radiance of the blocks that places lie in, over the power.
    #[inline(always)]
    pub fn means<F: Num>(light: &Light<'_>, place: &Place<F>) -> F {
        let mut glance = Glance { look: Look::new() };
        glance.look.aim(light, 0, place);
        glance.find(light, LANES);
        F::read(&glance.look.scale) / place.solid_angle
    }

    #[inline(never)]
    fn find(&mut self, light: &Light<'_>, count: usize) {
        self.look.find_cells(light, count);
        self.look.find_blocks(light, count);
        self.look.average(light, count);
    }
}
