//! A cell as an area of its face.

use super::chart::Place;
use super::tables::Light;
use crate::numeric::max;
use crate::simd::{Four, Num};

/// A cell on its face.
pub(super) struct Area<'a> {
    light: &'a Light<'a>,
    cell: u32,
    face: Four,
    low: [f32; 2],
    size: [f32; 2],
}

/// Where pairs of a cell's numbers lead to.
#[derive(Clone, Copy)]
pub(super) struct Sampled {
    /// In the cell, [0, 1].
    pub position: [Four; 2],
    /// The same as a direction.
    pub direction: [Four; 3],
    /// The density within the cell, per steradian.
    pub density: Four,
}

// Functions of their own: each stands once in a library, and a build is not slower for it.
impl Area<'_> {
    pub(super) fn new<'a>(light: &'a Light<'a>, cell: u32) -> Area<'a> {
        let c = light.cell(cell);
        let edge = |k: usize, patch: u16| light.chart.axes[k].edge(f32::from(patch));
        let low = [0, 1].map(|k: usize| edge(k, c.origin[k]));
        let size = [0, 1].map(|k: usize| edge(k, c.origin[k] + c.patches[k]) - low[k]);
        Area { light, cell, face: splat(f32::from(c.face)), low, size }
    }

    /// Where numbers (w, v) lead to.
    #[inline(never)]
    pub(super) fn sample(&self, numbers: [Four; 2]) -> Sampled {
        let drawn = self.light.sample_in::<Four>(Four::each_int(|_| self.cell), numbers);
        let place = drawn.place();
        let position = [0, 1].map(|k: usize| {
            let share = (place[k] - self.low[k]) / max(self.size[k], f32::MIN_POSITIVE);
            share.max(splat(0.0)).min(splat(1.0))
        });
        let direction = self.direction(position);
        let density = self.light.drawn_at(&self.place(direction), &drawn).density;
        Sampled { position, direction, density }
    }

    /// The numbers of positions, as far as rounding leaves them in the cell; 2 beyond.
    #[inline(never)]
    pub(super) fn find(&self, position: [Four; 2]) -> [Four; 2] {
        let located = self.light.locate::<Four>(self.direction(position), true);
        let mut numbers = located.numbers().map(Num::store);
        for (lane, &cell) in located.patch.cell.iter().enumerate() {
            for of in &mut numbers {
                of[lane] = if cell == self.cell { of[lane] } else { 2.0 };
            }
        }
        numbers.map(Four::load)
    }

    /// The directions of positions in the cell.
    #[inline(never)]
    pub(super) fn direction(&self, position: [Four; 2]) -> [Four; 3] {
        let place = [0, 1].map(|k: usize| splat(self.low[k]) + position[k] * self.size[k]);
        self.light.chart.direction(self.face, place)
    }

    /// The density of directions with equal shares of the cell's area on its face, per steradian.
    pub(super) fn density_of_area(&self, direction: [Four; 3]) -> Four {
        splat(1.0) / (self.place(direction).solid_angle * (self.size[0] * self.size[1]))
    }

    #[inline(never)]
    fn place(&self, direction: [Four; 3]) -> Place<Four> {
        self.light.chart.place(direction)
    }
}

/// The same number in all lanes.
pub(super) fn splat(x: f32) -> Four {
    Four::splat(x)
}
