//! A rotated map: the light about a direction as pixels of the octahedral square of that frame.
//!
//! Clarberg et al. 2005, Section 6.1, rotate the map about every direction of a grid, so that light and BRDF meet in one frame.
//! Here each patch of the light hands its own light out to the pixels that it covers. What it hands out is its share in the light's
//! tables, so a tree has the energy of the light, however small its sun is.

use crate::blob::Size;
use crate::light::chart::{Chart, Layout};
use crate::light::environment::Environment;
use crate::light::tables::{Light, Patches};
use crate::numeric::{exponent, max, min, times_power};
use crate::simd::{Four, Num};
use crate::sphere::{Frame, octahedral_square};
use crate::status::{Error, Status};
use crate::wavelets::image::Config;
use crate::wavelets::stored::{Built, Header};
use bytemuck::{cast_slice_mut, try_cast_slice, try_cast_slice_mut};
use core::f64::consts::PI;
use glam::Vec3;

/// The largest share of the map's mean that may be added to its pixels: beyond it the map would be lost in rounding.
pub const MAX_LEAST: f64 = 1e6;
/// The side of the square as an angle: the root of 4 pi.
const SIDE: f32 = 3.544_907_8;
/// Parts of a patch are no wider than this share of a pixel, ...
const PART: f32 = 0.25;
/// ... nor than that share of a pixel of a square with so many: their bounds are straight, they themselves are not.
const LEAST_SIDE: f32 = 32.0;
/// A part that seems wider than this many times its width lies across an edge of the square.
const FOLDED: f32 = 4.0;
/// It is divided into so many along each axis.
const DIVIDED: u32 = 4;

/// What to build of a map.
#[derive(Clone, Copy, Debug)]
pub struct Rotation {
    /// The tree has 2^depth pixels along each axis.
    pub depth: u32,
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
    pub fn checked(self) -> Result<Rotation, Error> {
        Error::first([((0.0..=MAX_LEAST).contains(&self.least), c"least")])?;
        self.tree().checked().map(|_| self)
    }

    /// The memory of a build at most; `None` if none is as long. Sums of pixels stand behind what the tree needs.
    pub fn size(&self) -> Option<Size> {
        let Size { bytes, scratch } = self.tree().size()?;
        let scratch = scratch.checked_add(self.sums())?;
        Some(Size { bytes, scratch }).filter(|size| size.scratch <= isize::MAX as usize)
    }

    /// Bytes of the sums.
    fn sums(&self) -> usize {
        size_of::<f64>() << (2 * self.depth)
    }

    /// Builds the tree of a map as the frame `world_from_tree` sees it. `scratch` is as long as [`Rotation::size`] says.
    ///
    /// # Errors
    /// [`Built`].
    pub fn build_in(
        &self,
        environment: &Environment<'_>,
        world_from_tree: &Frame,
        memory: &mut [u8],
        scratch: &mut [u8],
    ) -> Built<Header> {
        let small = Status::MemoryTooSmall;
        let size = self.tree().size().ok_or(Status::Overflow)?;
        let (work, room) = scratch.split_at_mut_checked(size.scratch).ok_or(small)?;
        let room = room.get_mut(..self.sums()).ok_or(small)?;
        let sums: &mut [f64] = try_cast_slice_mut(room).map_err(|_| small)?;
        sums.fill(0.0);
        Rotated::new(environment, world_from_tree, self.depth).add_to(sums);
        let exponent = self.normalise(environment.header().power / (4.0 * PI), sums);
        let pixels: &[f32] = try_cast_slice(sums).map_err(|_| small)?;
        let pixels = pixels.get(..1 << (2 * self.depth)).ok_or(small)?;
        self.tree().build_in(pixels, exponent, memory, work)
    }

    /// Makes sums pixels, in place, whose mean is 2^-exponent of the light's, and answers that exponent. Pixels fill the first half
    /// of the room.
    fn normalise(&self, mean: f64, sums: &mut [f64]) -> i32 {
        let total = sums.iter().sum::<f64>() / sums.len() as f64;
        let exponent = if mean > 0.0 { exponent(mean) } else { 0 };
        let mean = times_power(mean, -exponent);
        let (scale, least) = if total > 0.0 { (mean / total, self.least * mean) } else { (0.0, 0.0) };
        for k in 0..sums.len() {
            let sum = sums.get(k).copied().unwrap_or(0.0);
            // What has light keeps some, however little.
            let dark = if sum > 0.0 { f64::from(f32::MIN_POSITIVE) } else { 0.0 };
            let pixel = (sum * scale).max(dark) + least;
            let pixels: &mut [f32] = cast_slice_mut(sums);
            if let Some(out) = pixels.get_mut(k) {
                *out = pixel as f32;
            }
        }
        exponent
    }
}

/// A light as another frame sees it.
struct Rotated<'a> {
    light: Light<'a>,
    /// The axes of the map in the frame of the tree.
    axes: [[f32; 3]; 3],
    /// Pixels along each axis.
    side: f32,
    /// Parts for each column and row of the map.
    parts: [f32; 2],
    /// A part that seems wider, in pixels, lies across an edge of the square.
    widest: f32,
}

/// Low and high ends along both axes: of a part on its face, or in the square in pixels.
type Bounds = [[f32; 2]; 2];

impl<'a> Rotated<'a> {
    fn new(environment: &Environment<'a>, world_from_tree: &Frame, depth: u32) -> Self {
        let (light, world_from_map) = (environment.light(), environment.frame());
        let axes = [Vec3::X, Vec3::Y, Vec3::Z].map(|e| world_from_tree.to_map(world_from_map.to_world(e.to_array())));
        let side = (1u32 << (depth & 31)) as f32;
        let part = PART / max(side, LEAST_SIDE);
        let parts = angles(&light.chart).map(|angle| angle / (part * SIDE));
        Rotated { light, axes, side, parts, widest: FOLDED * part * side }
    }

    /// Adds the shares of all patches to pixels in C order.
    fn add_to(&self, sums: &mut [f64]) {
        for face in 0..self.light.chart.faces() {
            for row in 0..self.light.chart.axes[1].patches {
                self.light.each_patch(face, row, |patch| self.add_patch(face, patch, sums));
            }
        }
    }

    /// Adds a patch: its parts have what its density says, and all of them together its share.
    fn add_patch(&self, face: u32, patch: &Patches<f32>, sums: &mut [f64]) {
        let &Patches { low, size, shape, light, probability, .. } = patch;
        let [columns, rows] = [0, 1].map(|k: usize| (size[k] * self.parts[k]) as u32 + 1);
        let step = [1.0 / columns as f32, 1.0 / rows as f32];
        let parts = || (0..rows).flat_map(|j| (0..columns).map(move |i| [i as f32 * step[0], j as f32 * step[1]]));
        let density = |[x, y]: [f32; 2]| f64::from(shape.unscaled([x + 0.5 * step[0], y + 0.5 * step[1]]));
        let single = columns == 1 && rows == 1;
        let total: f64 = if single { 0.0 } else { parts().map(density).sum() };
        let even = 1.0 / (f64::from(columns) * f64::from(rows));
        for at in parts() {
            let part = if total > 0.0 { density(at) / total } else { even };
            let place = [0, 1].map(|k: usize| [low[k] + size[k] * at[k], low[k] + size[k] * (at[k] + step[k])]);
            self.add_part(f64::from(light * probability) * part, face, place, sums);
        }
    }

    /// Adds a part of a patch to the pixels that its bounds overlap; one across an edge of the square is divided.
    fn add_part(&self, light: f64, face: u32, [columns, rows]: Bounds, sums: &mut [f64]) {
        if let Some(bounds) = self.bounds(face, [columns, rows]) {
            return add(light, bounds, self.side, sums);
        }
        let cut = |[from, to]: [f32; 2], i: u32| from + (to - from) * (i as f32 / DIVIDED as f32);
        let smaller = |of: [f32; 2], i: u32| [cut(of, i), cut(of, i + 1)];
        for [i, j] in (0..DIVIDED * DIVIDED).map(|k| [k % DIVIDED, k / DIVIDED]) {
            let place = [smaller(columns, i), smaller(rows, j)];
            let bounds = self.bounds(face, place).unwrap_or_else(|| self.middle(face, place));
            add(light / f64::from(DIVIDED * DIVIDED), bounds, self.side, sums);
        }
    }

    /// Where a part of a face lies in the square; `None` across an edge of it.
    #[inline(never)]
    fn bounds(&self, face: u32, [columns, rows]: Bounds) -> Option<Bounds> {
        let corner = |of: [f32; 2], bit: usize| Four::each(|k| if k >> bit & 1 == 0 { of[0] } else { of[1] });
        let corners = self.square(face, [corner(columns, 0), corner(rows, 1)]);
        let bounds = corners.map(|[a, b, c, d]| [min(min(a, b), min(c, d)), max(max(a, b), max(c, d))]);
        bounds.iter().all(|[low, high]| high - low <= self.widest).then_some(bounds)
    }

    /// Where the middle of a part lies.
    #[inline(never)]
    fn middle(&self, face: u32, part: Bounds) -> Bounds {
        let middle = part.map(|[from, to]| Four::splat(0.5 * (from + to)));
        self.square(face, middle).map(|[x, ..]| [x, x])
    }

    /// Where four positions of a face lie in the square, in pixels.
    #[inline(always)]
    fn square(&self, face: u32, position: [Four; 2]) -> [[f32; Four::WIDTH]; 2] {
        let [x, y, z] = self.light.chart.direction(Four::splat(face as f32), position);
        let along = |k: usize| x * self.axes[0][k] + y * self.axes[1][k] + z * self.axes[2][k];
        octahedral_square([along(0), along(1), along(2)]).map(|s| (s * self.side).store())
    }
}

/// Adds light to the pixels that bounds overlap, in proportion to area.
fn add(light: f64, bounds: Bounds, side: f32, sums: &mut [f64]) {
    let last = max(side - 1.0, 0.0);
    let [columns, rows] = bounds.map(|of| of.map(|x| min(x, last) as usize));
    let share = |[low, high]: [f32; 2], pixel: usize| {
        let inside = min(high, pixel as f32 + 1.0) - max(low, pixel as f32);
        f64::from(inside / max(high - low, f32::MIN_POSITIVE))
    };
    let mut put = |column: usize, row: usize, light: f64| {
        if let Some(sum) = sums.get_mut(column * side as usize + row) {
            *sum += light;
        }
    };
    if columns[0] == columns[1] && rows[0] == rows[1] {
        return put(columns[0], rows[0], light);
    }
    for column in columns[0]..=columns[1] {
        let across = if columns[0] == columns[1] { 1.0 } else { share(bounds[0], column) };
        for row in rows[0]..=rows[1] {
            let down = if rows[0] == rows[1] { 1.0 } else { share(bounds[1], row) };
            put(column, row, light * across * down);
        }
    }
}

/// The angles of a column and of a row, at most; of the octahedral square, on average.
fn angles(chart: &Chart) -> [f32; 2] {
    let whole = match chart.layout {
        Layout::LatLong => [2.0 * PI as f32, PI as f32],
        Layout::Cube => [2.0; 2],
        Layout::Octahedral => [SIDE; 2],
    };
    [0, 1].map(|k: usize| whole[k] / chart.axes[k].length)
}
