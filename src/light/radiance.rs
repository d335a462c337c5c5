//! What candidates for rays read of a light: strata to draw from, and the radiance at a position of its chart, which is two reads in a map of
//! 16-bit luminances.
//!
//! A word is the upper half of an f32. Corner (i, j) of a face lies at position (i, j) less the axes' shift; between corners radiance is
//! bilinear, and for a light of nearest texels constant. Words stand in tiles of square parts of a face, each with a step of its own:
//! an error budget leaves out what the map does not need. Without a budget one tile holds all faces.

use super::chart::{Chart, Layout};
use crate::simd::{Num, Whole, prefetch, prefetch_behind};

/// log2 of the words that a tile's first word is a multiple of.
pub const TILE_ALIGNMENT: i32 = 3;
/// Where the step of a tile begins in its record.
pub const STEP_SHIFT: i32 = 28;
/// [`Radiance::tile`] of a map of one tile.
pub const ONE_TILE: u32 = 31;

/// The nearest word to a light; above 0 if that is, and finite.
#[inline(always)]
pub fn encode(light: f32) -> u16 {
    const LARGEST_WORD: u32 = f32::MAX.to_bits() >> 16;
    let bits = light.to_bits();
    let word = (bits.saturating_add(0x7fff + (bits >> 16 & 1)) >> 16).clamp(1, LARGEST_WORD) as u16;
    if light > 0.0 { word } else { 0 }
}

/// The light of a word.
#[inline(always)]
pub fn decode(word: u16) -> f32 {
    f32::from_bits(u32::from(word) << 16)
}

/// The map.
#[derive(Clone, Copy, Debug)]
pub struct Radiance<'a> {
    /// Luminances, tile by tile; two more than any look-up reads.
    pub words: &'a [u16],
    /// Of each tile of each face, row by row: its first word over 8, and in the upper four bits log2 of the patches between its corners.
    pub tiles: &'a [u32],
    /// log2 of the patches along a tile.
    pub tile: u32,
    /// The words of a row, and of a map of one tile those of a face, and the last patch along each axis.
    pub stride: u32,
    pub face: u32,
    pub last: [f32; 2],
    /// How much of the way between corners counts: 1 where radiance is bilinear, else 0.
    pub part: f32,
}

impl<'a> Radiance<'a> {
    /// A map of a chart, in tiles of patches of 2^`tile`.
    #[inline(always)]
    pub fn new(words: &'a [u16], tiles: &'a [u32], tile: u32, bilinear: bool, chart: &Chart) -> Radiance<'a> {
        let [columns, rows] = chart.axes.map(|axis| axis.patches);
        // Patches are at most 2^24.
        let last = [columns, rows].map(|patches| patches.wrapping_sub(1) as i32 as f32);
        let row = columns.wrapping_add(1);
        let face = row.wrapping_mul(rows.wrapping_add(1));
        // Of the finest tile.
        let stride = if tile == ONE_TILE { row } else { (1 << (tile & 31)) + 1 };
        Radiance { words, tiles, tile, stride, face, last, part: if bilinear { 1.0 } else { 0.0 } }
    }
}

/// Where the radiance at some positions stands: the first words of pairs, how far the pairs below are, and the parts of the way to the next words.
#[derive(Clone, Copy)]
pub struct Texels<F: Num> {
    first: F::Whole,
    stride: F::Whole,
    parts: [F; 2],
}

impl<F: Num> Texels<F> {
    /// Those of no position.
    #[inline(always)]
    pub fn none() -> Texels<F> {
        Texels { first: F::Whole::splat(0), stride: F::Whole::splat(0), parts: [F::splat(0.0); 2] }
    }
}

impl Radiance<'_> {
    /// Where the radiance at positions on faces stands.
    #[inline(always)]
    pub fn texels<F: Num>(&self, chart: &Chart, face: F, [column, row]: [F; 2]) -> Texels<F> {
        let [columns, rows] = chart.axes;
        let zero = F::splat(0.0);
        let (x, y) = ((column + columns.shift).max(zero), (row + rows.shift).max(zero));
        let (first, stride, [x, y], [last_x, last_y]) = if self.tile == ONE_TILE {
            let first = face.to_whole() * F::Whole::splat(self.face);
            (first, F::Whole::splat(self.stride), [x, y], [F::splat(self.last[0]), F::splat(self.last[1])])
        } else {
            self.in_tile(chart, face, [x, y])
        };
        let (i, j) = (x.min(last_x).to_whole(), y.min(last_y).to_whole());
        let parts = [(x - F::of_whole(i)) * self.part, (y - F::of_whole(j)) * self.part];
        Texels { first: first + j * stride + i, stride, parts }
    }

    /// Prefetches what [`Radiance::of`] reads.
    #[inline(always)]
    pub fn prefetch<F: Num>(&self, texels: &Texels<F>) {
        for first in F::ints_of(texels.first).as_ref() {
            prefetch(self.words, *first as usize);
            prefetch_behind(self.words, self.stride as usize, *first as usize);
        }
    }

    /// The radiance of texels.
    #[inline(always)]
    pub fn of<F: Num>(&self, &Texels { first, stride, parts: [s, t] }: &Texels<F>) -> F {
        let (above, below) = (F::pairs(self.words, first), F::pairs(self.words, first + stride));
        let line = |pair: F::Whole| {
            let left = F::from_bits(pair.shl::<16>());
            let right = F::from_bits(pair & F::Whole::splat(0xffff_0000));
            left + (right - left) * s
        };
        let (above, below) = (line(above), line(below));
        above + (below - above) * t
    }

    /// The first words and the strides of the tiles at patches of faces; the places in them in units of their steps, and the last ones.
    #[inline(always)]
    fn in_tile<F: Num>(&self, chart: &Chart, face: F, place: [F; 2]) -> (F::Whole, F::Whole, [F; 2], [F; 2]) {
        let side = (1u32 << (self.tile & 31)) as f32;
        let tiles = |k: usize| chart.axes[k & 1].patches.div_ceil(1 << (self.tile & 31)) as f32;
        let along =
            |k: usize| F::of_whole(place[k & 1].min(F::splat((chart.axes[k & 1].patches - 1) as f32)).to_whole());
        let tile = |k: usize| F::of_whole((along(k) * (1.0 / side)).to_whole());
        let (column, row) = (tile(0), tile(1));
        let number = (face * tiles(1) + row) * tiles(0) + column;
        let record = F::pairs(bytemuck::cast_slice(self.tiles), number.to_whole().shl::<1>());
        // 127 less the step, as a float's exponent.
        let scale = F::from_bits((record.shr::<STEP_SHIFT>() ^ F::Whole::splat(127)).shl::<23>());
        let first = (record & F::Whole::splat((1 << STEP_SHIFT) - 1)).shl::<TILE_ALIGNMENT>();
        let (x, y) = ((place[0] - column * side) * scale, (place[1] - row * side) * scale);
        let corners = scale * side;
        let last = corners - 1.0;
        (first, corners.to_whole() + F::Whole::splat(1), [x, y], [last, last])
    }
}

/// A light as a source of candidates.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// Directions and positions.
    pub chart: Chart,
    /// The map.
    pub radiance: Radiance<'a>,
    /// Rectangles of equal probability that tile all faces: see [`rectangle`](super::strata::rectangle).
    pub strata: &'a [[f32; 4]],
    /// The unit of where they begin.
    pub unit: f32,
    /// The mean radiance over the sphere.
    pub mean: f32,
    /// One over the integral of what candidates are drawn by; 0 for a black light.
    pub inverse_power: f32,
}

/// What candidates are drawn by keeps this part of the radiance below the mean.
pub const DIM: f32 = 0.25;

/// Where a stratum begins along an axis stands in units, and below in so many bits the density there over [`EVEN_SLOPE`].
pub const SLOPE_BITS: i32 = 8;
/// All of these bits.
pub const SLOPES: u32 = (1 << SLOPE_BITS) - 1;
/// Of an even stratum.
pub const EVEN_SLOPE: f32 = 128.0;

impl Source<'_> {
    /// What stands for the density of candidates where the light has a radiance: a function of it alone.
    #[inline(always)]
    pub fn stand_in<F: Num>(&self, radiance: F) -> F {
        (radiance - self.mean).max(radiance * DIM) * self.inverse_power
    }

    /// Where a stratum begins along an axis.
    #[inline(always)]
    fn begin<F: Num>(&self, start: F) -> F {
        F::of_whole(start.to_bits().shr::<SLOPE_BITS>()) * self.unit
    }

    /// The position along an axis of a stratum for a number in (0, 1), and [`EVEN_SLOPE`] times its density over the even one. That is linear: a +
    /// 2 (1 - a) t has the distribution a t + (1 - a) t^2, whose inverse is stable as written.
    #[inline(always)]
    fn along<F: Num>(&self, start: F, length: F, u: F) -> (F, F) {
        let first = F::of_whole(start.to_bits() & F::Whole::splat(SLOPES));
        let density = (first * first + (F::splat(EVEN_SLOPE) - first) * (u * (4.0 * EVEN_SLOPE))).sqrt();
        let t = (u * (2.0 * EVEN_SLOPE) / (first + density)).min(F::splat(1.0));
        (self.begin(start) + length * t, density)
    }

    /// Prefetches the strata of first numbers in (0, 1).
    #[inline(always)]
    pub fn prefetch<F: Num>(&self, u: F) {
        let index = (u * (self.strata.len() as i32 as f32)).to_whole();
        for byte in F::ints_of(index.shl::<4>()).as_ref() {
            prefetch::<u8>(bytemuck::cast_slice(self.strata), *byte as usize);
        }
    }

    /// Directions of map space for two numbers in (0, 1); the face and position of each, and one over its density.
    #[inline(always)]
    pub fn sample<F: Num>(&self, [u, v]: [F; 2]) -> ([F; 3], F, [F; 2], F) {
        let count = self.strata.len() as i32 as f32;
        let scaled = u * count;
        let index = scaled.to_whole();
        let [column, row, width, height] = F::rows(self.strata, index);
        let (x, across) = self.along(column, width, scaled - F::of_whole(index));
        let (y, down) = self.along(row, height, v);
        let (face, y) = if self.chart.layout == Layout::Cube {
            let rows = self.chart.axes[1].length;
            // By its middle: no stratum spans two faces, and rounding leads to none from there.
            let face = F::of_whole(((self.begin(row) + height * 0.5) * (1.0 / rows)).to_whole());
            (face, y - face * rows)
        } else {
            (F::splat(0.0), y)
        };
        let (direction, angle) = self.chart.direction_and_angle(face, [x, y]);
        (direction, face, [x, y], width * height * (angle * (count * EVEN_SLOPE * EVEN_SLOPE)) / (across * down))
    }
}
