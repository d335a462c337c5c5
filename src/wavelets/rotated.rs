//! A rotated map: the light about a direction as pixels of the octahedral square of that frame.
//!
//! Clarberg et al. 2005, Section 6.1, turn the map about every direction of a grid so that light and BRDF meet in one
//! frame. Here a pixel is the mean of a few places in it, each the stored average of the cell of the map that it lies in:
//! of cells as large as what the place stands for, so that no lamp is missed that the map's tree knows.

use crate::numeric::min;
use crate::object::Size;
use crate::sphere::Frame;
use crate::status::{Error, Status};
use crate::wavelets::environment::Environment;
use crate::wavelets::lanes::sphere as wide;
use crate::wavelets::lanes::{LANES, Lanes, Native};
use crate::wavelets::pruned::Config;
use crate::wavelets::stored::{Header, Refused};
use crate::wavelets::tree::{MAX_AVERAGE, Tree, complete_len};
use bytemuck::try_cast_slice_mut;

/// The most places along an axis of a pixel.
pub const WIS_MAX_PLACES: u32 = 16;
/// The largest share of the map's mean that may be added to its pixels: beyond it the map would be lost in rounding.
pub const MAX_LEAST: f64 = 1e6;

/// What to build of a map.
#[derive(Clone, Copy, Debug)]
pub struct Rotation {
    /// The tree has 2^depth pixels along each axis.
    pub depth: u32,
    /// Each pixel is the mean of places x places, 1 to [`WIS_MAX_PLACES`].
    pub places: u32,
    /// The variance that pruning may add to an estimate of the integral, relative to its square.
    pub error_budget: f32,
    /// The share of the map's mean that is added to each pixel.
    pub least: f64,
}

impl Rotation {
    fn tree(&self) -> Config {
        Config { dimensions: 2, depth: self.depth, error_budget: self.error_budget }
    }

    /// Checks what a client asks for.
    ///
    /// # Errors
    /// [`Error`] names the field.
    pub fn check(&self) -> core::result::Result<(), Error> {
        Error::first([
            ((1..=WIS_MAX_PLACES).contains(&self.places), c"places"),
            ((0.0..=MAX_LEAST).contains(&self.least), c"least"),
        ])?;
        self.tree().check()
    }

    /// The memory of a build at most; `None` if none is as long. Pixels stand behind what the tree needs.
    pub fn size(&self) -> Option<Size> {
        let Size { bytes, scratch } = self.tree().size()?;
        let scratch = scratch.checked_add(size_of::<f32>() << (2 * self.depth))?;
        Some(Size { bytes, scratch }).filter(|size| size.scratch <= isize::MAX as usize)
    }

    /// Builds the tree of a map as the frame `world_from_tree` sees it; frames are `[world_from_map, world_from_tree]`.
    /// `scratch` is as long as [`Rotation::size`] says.
    ///
    /// # Errors
    /// [`Refused`].
    pub fn build_in(
        &self,
        environment: &Environment,
        frames: [Frame; 2],
        memory: &mut [u8],
        scratch: &mut [u8],
    ) -> core::result::Result<Header, Refused> {
        let small = Refused::Input(Status::MemoryTooSmall);
        let size = self.tree().size().ok_or(Refused::Squares)?;
        let (work, pixels) = scratch.split_at_mut_checked(size.scratch).ok_or(small)?;
        let pixels: &mut [f32] = try_cast_slice_mut(pixels).map_err(|_| small)?;
        Rotated::new(environment.light(), frames, self.depth, self.places, self.least as f32).fill(pixels);
        self.tree().build_in(pixels, environment.header.exponent, memory, work)
    }
}

/// A map as another frame sees it.
#[derive(Clone, Copy)]
pub struct Rotated<'a> {
    light: Tree<'a, 4>,
    world_from_map: Frame,
    world_from_tree: Frame,
    depth: u32,
    places: u32,
    least: f32,
    /// Of the map's cells that are looked up.
    level: u32,
    /// Whether the map has all of those, in heap order.
    is_heap: bool,
}

impl<'a> Rotated<'a> {
    /// The map on 2^depth x 2^depth pixels, each the mean of `places` x `places` (1 to [`WIS_MAX_PLACES`]), to which the share
    /// `least` of the map's mean is added.
    pub fn new(
        light: Tree<'a, 4>,
        [world_from_map, world_from_tree]: [Frame; 2],
        depth: u32,
        places: u32,
        least: f32,
    ) -> Self {
        let level = depth + places.next_power_of_two().trailing_zeros();
        let level = level.min(light.depth());
        let is_heap = complete_len::<4>(light.depth()) == Some(light.heap());
        Rotated { light, world_from_map, world_from_tree, depth, places, least, level, is_heap }
    }

    /// Fills pixels in C order, in the units that the map stores.
    pub fn fill(&self, pixels: &mut [f32]) {
        let side = 1usize << self.depth;
        let step = 1.0 / (side as f32 * self.places as f32);
        let share = 1.0 / (self.places * self.places) as f32;
        let least = self.least * self.light.average();
        let mut along = (0u32..).map(|k| (k as f32 + 0.5) * step);
        for row in pixels.chunks_mut(side) {
            row.fill(0.0);
            for x in along.by_ref().take(self.places as usize) {
                self.add_places(x, step, row);
            }
            row.iter_mut().for_each(|pixel| *pixel = min(*pixel * share + least, MAX_AVERAGE));
        }
    }

    /// Adds what lies at all places of a row that have the first coordinate `x`.
    fn add_places(&self, x: f32, step: f32, row: &mut [f32]) {
        let count = row.len() * self.places as usize;
        let (mut pixels, mut left, mut pixel) = (row.iter_mut(), 0, None);
        for first in (0..count).step_by(LANES) {
            let mut y = [0.5; LANES];
            for (y, k) in y.iter_mut().zip(first..count) {
                *y = (k as f32 + 0.5) * step;
            }
            for value in self.averages(x, y).into_iter().take(count - first) {
                if left == 0 {
                    (pixel, left) = (pixels.next(), self.places);
                }
                if let Some(pixel) = &mut pixel {
                    **pixel += value;
                }
                left -= 1;
            }
        }
    }

    /// The averages of the map's cells in which eight places of the square lie.
    fn averages(&self, x: f32, y: [f32; LANES]) -> [f32; LANES] {
        let s = [Native::splat(x), Native::from_array(y)];
        let world = wide::to_world(&self.world_from_tree, wide::direction(s));
        let ([x, y], _) = wide::to_square(&self.world_from_map, world);
        let cells = (1u32 << (self.level & 31)) as f32;
        let (x, y) = ((x * Native::splat(cells)).to_array(), (y * Native::splat(cells)).to_array());
        let mut averages = [0.0; LANES];
        for (average, (x, y)) in averages.iter_mut().zip(x.into_iter().zip(y)) {
            *average = self.average(x as u32, y as u32);
        }
        averages
    }

    /// The average of a cell.
    #[inline(always)]
    fn average(&self, x: u32, y: u32) -> f32 {
        if self.level == 0 {
            return self.light.average();
        }
        if self.is_heap {
            // The cell's parent stands behind all coarser squares.
            let code = spread(x) << 1 | spread(y);
            let coarser = (1u32 << ((2 * (self.level - 1)) & 31)) / 3;
            return self.light.children(coarser + (code >> 2))[code as usize & 3];
        }
        let (mut average, mut square) = (self.light.average(), self.light.root_square());
        for bit in (0..self.level).rev() {
            let Some(here) = square else { break };
            let c = 2 * (x >> bit & 1) + (y >> bit & 1);
            average = self.light.children(here)[c as usize & 3];
            square = self.light.child_square(here, c);
        }
        average
    }
}

/// Sixteen bits, each followed by a 0 above it.
#[inline(always)]
fn spread(x: u32) -> u32 {
    let x = (x | x << 8) & 0x00ff_00ff;
    let x = (x | x << 4) & 0x0f0f_0f0f;
    let x = (x | x << 2) & 0x3333_3333;
    (x | x << 1) & 0x5555_5555
}
