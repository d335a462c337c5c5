//! The stored light: cells of blocks of patches, as cumulative tables, and the only walks through them.
//!
//! A face is divided into a few cells, on which products are built; a cell into blocks; a block into a grid of at most 16 x 16
//! patches, each as large as a texel or, where an error budget allows it, as a square of texels. A sample is four short
//! searches: row and column of a block in its cell, row and column of a patch in its block; then one warp inside the patch.
//! A density reads the same numbers at the patch that holds the direction.

use super::chart::Chart;
pub use super::walk::{Direction, Drawn, Located, Patches};
use crate::blob::Table;
use crate::simd::{Num, WINDOW};
use bytemuck::{Pod, Zeroable};

/// The most patches along a side of a block.
pub const BLOCK: usize = 16;

/// A cell: a rectangle of patches of one face. Indices are columns first, then rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Cell {
    /// Its first patch on the face.
    pub origin: [u16; 2],
    /// Its patches.
    pub patches: [u16; 2],
    /// Its blocks.
    pub blocks: [u16; 2],
    /// A block has 2^side patches along each axis, but for those at the end.
    pub side: [u8; 2],
    /// The face.
    pub face: u8,
    /// Always 0.
    pub reserved: u8,
    /// Where its tables begin among the starts: of its block rows, then of the blocks of each row.
    pub starts: u32,
    /// Its first block.
    pub first: u32,
    /// Its share of the light.
    pub probability: f32,
}

/// A block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Block {
    /// Where its row starts begin. Its lines stand behind them: of each row of patches the corners above it, then the column starts
    /// without the first; and a last line with the corners below.
    pub rows: u32,
    /// The radiance of its brightest corner, which is 1 in the words, over the power of the light; 0 without corners.
    pub brightest: f32,
    /// Its share of the cell's light: the product of the probabilities of its block row and of itself in that row.
    pub share: f32,
    /// Columns and rows of its grid, 1 to 16.
    pub grid: [u8; 2],
    /// Four bits for each axis, columns lowest: a cell of the grid is 2^step patches wide and high.
    pub steps: u8,
    /// 1 if the words of its tables lie closer towards the ends of a table, else 0.
    pub to_ends: u8,
}

/// A light, as slices of what is stored.
#[derive(Clone, Copy, Debug)]
pub struct Light<'a> {
    /// Directions and positions.
    pub chart: Chart,
    /// Whether patches have corners (a bilinear client) or are constant.
    pub bilinear: bool,
    /// Whether every patch of the map is kept: no error budget.
    pub exact: bool,
    /// The integral of luminance over the sphere.
    pub power: f64,
    /// Cells along columns and rows of all faces.
    pub grid: [u32; 2],
    /// The cells, row by row, face by face.
    pub cells: &'a [Cell],
    /// The starts of the rows of cells, then of the cells of each row.
    pub tops: Table<'a, f32>,
    /// The column and the row of cells in which a column and a row of the smallest blocks lie.
    pub cell_of: [&'a [u8]; 2],
    /// The smallest block has 2^side patches along each axis.
    pub side: [u32; 2],
    /// In-cell tables.
    pub starts: Table<'a, f32>,
    /// The blocks.
    pub blocks: &'a [Block],
    /// Row starts and lines of blocks.
    pub words: Table<'a, u16>,
    /// The texel map, with zeros behind it: see [`super::map`].
    pub texels: &'a [u16],
    /// Where its tiles begin, and their steps.
    pub tiles: &'a [u32],
    /// log2 of the patches along a side of a tile; 31 if the map is one tile.
    pub tile_side: u32,
    /// Rectangles of equal probability that cover all faces, in kD order: see [`rectangle`](super::strata::rectangle).
    pub strata: &'a [[f32; 4]],
}

impl<'a> Light<'a> {
    /// A light of which the texel map alone is known.
    pub fn of_map(chart: Chart, bilinear: bool, tile_side: u32, texels: &'a [u16], tiles: &'a [u32]) -> Light<'a> {
        Light {
            chart,
            bilinear,
            exact: true,
            power: 0.0,
            grid: [0; 2],
            cells: &[],
            tops: Table::new(&[], &[0.0; WINDOW]),
            cell_of: [&[]; 2],
            side: [0; 2],
            starts: Table::new(&[], &[0.0; WINDOW]),
            blocks: &[],
            words: Table::new(&[], &[0; WINDOW]),
            texels,
            tiles,
            tile_side,
            strata: &[],
        }
    }
}

impl Cell {
    /// Where the table of a row's blocks begins among the starts.
    #[inline(always)]
    pub(super) fn row(&self, row: usize) -> usize {
        self.starts as usize + usize::from(self.blocks[1]) + 1 + row * (usize::from(self.blocks[0]) + 1)
    }

    /// The first patch and one behind the last, along an axis, of a part of a block's grid.
    #[inline(always)]
    pub(super) fn extent(&self, axis: usize, block: u32, part: u32, step: u8) -> (u32, u32) {
        let (origin, patches) = (u32::from(self.origin[axis]), u32::from(self.patches[axis]));
        let block_begin = block << (self.side[axis] & 31);
        let block_end = (block_begin + (1 << (self.side[axis] & 31))).min(patches);
        let first = block_begin + (part << (step & 31));
        (origin + first, origin + (first + (1 << (step & 31))).min(block_end))
    }
}

impl Block {
    /// log2 of the patches of a cell of its grid along an axis.
    #[inline(always)]
    pub(super) fn step(&self, axis: usize) -> u8 {
        (self.steps >> (4 * (axis & 1))) & 15
    }

    /// Whether the words of its tables lie closer towards the ends.
    #[inline(always)]
    pub(super) fn words_at_ends(&self) -> bool {
        self.to_ends != 0
    }

    /// Words of corners before the column starts of a line.
    #[inline(always)]
    pub(super) fn corners(&self, bilinear: bool) -> usize {
        if bilinear { usize::from(self.grid[0]) + 1 } else { 0 }
    }

    /// Where the line of a row of patches begins.
    #[inline(always)]
    pub(super) fn line(&self, row: usize, bilinear: bool) -> usize {
        let [columns, rows] = self.grid.map(usize::from);
        self.rows as usize + row_words(columns, rows) + row * line_words(columns, bilinear)
    }
}

/// Words of the row starts of a block. The first start is left out, and its place stays empty. Those of full width fill half a cache
/// line, so that all lines begin at halves of cache lines.
pub const fn row_words(columns: usize, rows: usize) -> usize {
    if columns == BLOCK { BLOCK } else { rows }
}

/// Words of a line of a block with so many columns.
pub const fn line_words(columns: usize, bilinear: bool) -> usize {
    if bilinear { 2 * columns } else { columns }
}

/// What a word's exponent of 0 stands for, as that of an f32: corners span 2^31.
const EXPONENT_OF_WORD_0: u32 = 112;

/// Pairs of corners from pairs of words.
#[inline(always)]
pub(crate) fn decoded<F: Num>(pairs: F::Ints) -> [F; 2] {
    let add = EXPONENT_OF_WORD_0 << 23;
    let least = F::splat(f32::from_bits(add));
    let [a, b] = F::halves(pairs, add);
    [F::only(least.lt(a), a), F::only(least.lt(b), b)]
}

/// A corner from 16 bits: five of exponent, eleven of fraction, and 0.
#[inline(always)]
pub fn decode(word: u16) -> f32 {
    let bits = (u32::from(word) << 12) + (EXPONENT_OF_WORD_0 << 23);
    if word == 0 { 0.0 } else { f32::from_bits(bits) }
}

/// The nearest corner in 16 bits to a value in [0, 1], of which 1 is the largest; above 0 if the value is.
#[inline(always)]
pub fn encode(value: f32) -> u16 {
    let bits = (value * 65536.0).to_bits().saturating_sub(EXPONENT_OF_WORD_0 << 23);
    let word = ((bits + (1 << 11)) >> 12).clamp(1, 0xffff) as u16;
    if value > 0.0 { word } else { 0 }
}
