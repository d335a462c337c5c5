//! A map in another frame: the light about a direction as pixels of the octahedral square of that frame.
//!
//! Clarberg et al. 2005, Section 5.1, turn the map about every direction of a grid so that light and BRDF meet in one
//! frame. Here a pixel is the mean of a few places in it, each the stored average of the cell of the map that it lies in:
//! of cells as large as what the place stands for, so that no lamp is missed that the map's tree knows.

use crate::sphere::{self, Frame};
use crate::tree::Tree;

/// The most places along an axis of a pixel.
pub const WIS_MAX_PLACES: u32 = 16;

/// A map as another frame sees it.
#[derive(Clone, Copy)]
pub struct Turned<'a> {
    light: Tree<'a, 4>,
    world_from_map: Frame,
    world_from_tree: Frame,
    depth: u32,
    places: u32,
    least: f32,
}

impl<'a> Turned<'a> {
    /// The map on 2^depth x 2^depth pixels, each the mean of `places` x `places` (1 to [`WIS_MAX_PLACES`]), to which the share
    /// `least` of the map's mean is added.
    pub fn new(
        light: Tree<'a, 4>,
        [world_from_map, world_from_tree]: [Frame; 2],
        depth: u32,
        places: u32,
        least: f32,
    ) -> Self {
        Turned { light, world_from_map, world_from_tree, depth, places, least }
    }

    /// Fills pixels in C order, in the units that the map stores.
    pub fn fill(&self, pixels: &mut [f32]) {
        let side = 1usize << self.depth;
        let step = 1.0 / (side as f32 * self.places as f32);
        let level = self.depth + self.places.next_power_of_two().trailing_zeros();
        let share = 1.0 / f64::from(self.places * self.places);
        let least = f64::from(self.least) * f64::from(self.light.average());
        for (i, row) in pixels.chunks_mut(side).enumerate() {
            for (j, pixel) in row.iter_mut().enumerate() {
                let at = |first: usize, k: u32| (first as f32 * self.places as f32 + k as f32 + 0.5) * step;
                let places = (0..self.places).flat_map(|a| (0..self.places).map(move |b| [at(i, a), at(j, b)]));
                let sum: f64 = places.map(|s| f64::from(self.average(s, level))).sum();
                *pixel = (sum * share + least) as f32;
            }
        }
    }

    /// The average of the map's cell of a level in which a place of the square lies.
    fn average(&self, s: [f32; 2], level: u32) -> f32 {
        let world = self.world_from_tree.to_world(sphere::direction(s));
        let [mut x, mut y] = sphere::square(self.world_from_map.to_map(world));
        let (mut average, mut square) = (self.light.average(), self.light.root_square());
        for _ in 0..level {
            let Some(here) = square else { break };
            // Doubling is exact, so that the bits of a place come out one by one.
            (x, y) = (2.0 * x, 2.0 * y);
            let (right, upper) = (u32::from(x >= 1.0), u32::from(y >= 1.0));
            (x, y) = (x - right as f32, y - upper as f32);
            let c = 2 * right + upper;
            average = self.light.children(here)[c as usize & 3];
            square = self.light.child_square(here, c);
        }
        average
    }
}
