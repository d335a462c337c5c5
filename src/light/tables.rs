//! The stored light: cells of blocks of patches, as cumulative tables, and the only walks through them.
//!
//! A face is divided into a few cells, on which products are built; a cell into blocks; a block into a grid of at most 16 x 16
//! patches, each as large as a texel or, where an error budget allows it, as a square of texels. A sample is four short
//! searches: row and column of a block in its cell, row and column of a patch in its block; then one warp inside the patch.
//! A density reads the same numbers at the patch that holds the direction.

use super::chart::{Chart, Layout, Place};
use super::search::{Found, UNITS, cell, cell16, find, find16, inside};
use super::warp::PatchDensity;
use crate::numeric::ONE_MINUS_EPSILON;
use crate::simd::{Num, Table, prefetch};
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
    /// Always 0: two cells share a cache line.
    pub padding: u32,
}

/// A block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Block {
    /// Where its row starts begin.
    pub rows: u32,
    /// Where its lines begin: of each row of patches the column starts without the first, then the corners above it; and a
    /// last line with the corners below.
    pub lines: u32,
    /// Its share of the cell's light: the product of the probabilities of its block row and of itself in that row.
    pub share: f32,
    /// Columns and rows of its grid, 1 to 16.
    pub grid: [u8; 2],
    /// A cell of the grid is 2^step patches wide and high.
    pub step: [u8; 2],
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
    /// Row starts of blocks.
    pub rows: Table<'a, u16>,
    /// Lines of blocks.
    pub lines: Table<'a, u16>,
}

/// Patches, one for each lane.
#[derive(Clone, Copy)]
pub struct Patches<F: Num> {
    /// The cell of each.
    pub cell: F::Ints,
    face: F,
    /// The smallest patch on the face and one behind the largest, columns and rows.
    first: [F; 2],
    behind: [F; 2],
    low: [F; 2],
    size: [F; 2],
    corner: [F; 4],
    probability: F,
    start: [F; 2],
    width: [F; 2],
}

/// A direction that was found in the tables: its patch, and where in it.
#[derive(Clone, Copy)]
pub struct Located<F: Num> {
    /// The patch.
    pub patch: Patches<F>,
    /// The position inside, [0, 1] along columns and rows.
    pub position: [F; 2],
    /// The density of the direction within its cell, per steradian.
    pub density: F,
}

impl<F: Num> Located<F> {
    /// Replaces one lane.
    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, by: &Located<f32>) {
        self.patch.set(lane, &by.patch);
        set(&mut self.position[0], lane, by.position[0]);
        set(&mut self.position[1], lane, by.position[1]);
        set(&mut self.density, lane, by.density);
    }

    /// The numbers of the direction in its cell: along columns and along rows, each in [0, 1 - 2^-24].
    #[inline(always)]
    pub fn numbers(&self, light: &Light<'_>) -> [F; 2] {
        let u = self.patch.shape(light).invert(self.position);
        let (first, last) = (F::splat(0.0), F::splat(ONE_MINUS_EPSILON));
        let Patches { start, width, .. } = self.patch;
        let w = (start[0] + u[0] * width[0]).max(first).min(last);
        let v = (start[1] + u[1] * width[1]).max(first).min(last);
        [w, v]
    }
}

/// A direction in map space.
pub type Direction<F> = [F; 3];

impl<F: Num> Patches<F> {
    /// Replaces the patch of one lane.
    #[inline(always)]
    fn set(&mut self, lane: usize, by: &Patches<f32>) {
        let [cell] = by.cell;
        put_int::<F>(&mut self.cell, lane, cell);
        set(&mut self.face, lane, by.face);
        for k in 0..2 {
            set(&mut self.first[k], lane, by.first[k]);
            set(&mut self.behind[k], lane, by.behind[k]);
            set(&mut self.low[k], lane, by.low[k]);
            set(&mut self.size[k], lane, by.size[k]);
            set(&mut self.start[k], lane, by.start[k]);
            set(&mut self.width[k], lane, by.width[k]);
        }
        for k in 0..4 {
            set(&mut self.corner[k], lane, by.corner[k]);
        }
        set(&mut self.probability, lane, by.probability);
    }

    #[inline(always)]
    fn shape(&self, light: &Light<'_>) -> PatchDensity<F> {
        PatchDensity::new(self.corner, light.chart.profiles(self.low, self.size))
    }
}

/// What a search in tables of f32 found in each lane.
struct Searched<F: Num> {
    index: F::Ints,
    start: F::Floats,
    end: F::Floats,
}

impl<F: Num> Searched<F> {
    #[inline(always)]
    fn new() -> Self {
        Searched { index: F::ints(), start: F::floats(), end: F::floats() }
    }

    #[inline(always)]
    fn put(&mut self, lane: usize, (index, [start, end]): Found<f32>) {
        put_int::<F>(&mut self.index, lane, index as u32);
        put::<F>(&mut self.start, lane, start);
        put::<F>(&mut self.end, lane, end);
    }

    #[inline(always)]
    fn index(&self, lane: usize) -> usize {
        int_at::<F>(&self.index, lane) as usize
    }

    #[inline(always)]
    fn range(&self, lane: usize) -> [f32; 2] {
        [at::<F>(&self.start, lane), at::<F>(&self.end, lane)]
    }

    #[inline(always)]
    fn ranges(&self) -> Ranges<F> {
        let start = F::load(self.start);
        Ranges { start, width: F::load(self.end) - start }
    }
}

/// What a search in 16-bit tables found in each lane.
struct Searched16<F: Num> {
    index: F::Ints,
    start: F::Ints,
    end: F::Ints,
}

impl<F: Num> Searched16<F> {
    #[inline(always)]
    fn new() -> Self {
        Searched16 { index: F::ints(), start: F::ints(), end: F::ints() }
    }

    #[inline(always)]
    fn put(&mut self, lane: usize, (index, [start, end]): Found<u32>) {
        put_int::<F>(&mut self.index, lane, index as u32);
        put_int::<F>(&mut self.start, lane, start);
        put_int::<F>(&mut self.end, lane, end);
    }

    #[inline(always)]
    fn index(&self, lane: usize) -> usize {
        int_at::<F>(&self.index, lane) as usize
    }

    #[inline(always)]
    fn ranges(&self) -> Ranges<F> {
        let start = F::of_ints(self.start);
        Ranges { start, width: F::of_ints(self.end) - start }
    }
}

/// The position between two ends of the number that was searched.
#[inline(always)]
fn rest(number: f32, [start, end]: [f32; 2]) -> f32 {
    inside(number, start, end - start)
}

/// Starts and widths of cells of tables.
#[derive(Clone, Copy)]
struct Ranges<F: Num> {
    start: F,
    width: F,
}

impl<F: Num> Ranges<F> {
    /// Positions inside, of the numbers that were searched.
    #[inline(always)]
    fn rest(&self, number: F) -> F {
        inside(number, self.start, self.width)
    }
}

#[inline(always)]
fn put<F: Num>(lanes: &mut F::Floats, lane: usize, x: f32) {
    if let Some(out) = lanes.as_mut().get_mut(lane) {
        *out = x;
    }
}

#[inline(always)]
fn put_int<F: Num>(lanes: &mut F::Ints, lane: usize, x: u32) {
    if let Some(out) = lanes.as_mut().get_mut(lane) {
        *out = x;
    }
}

#[inline(always)]
pub(super) fn at<F: Num>(lanes: &F::Floats, lane: usize) -> f32 {
    lanes.as_ref().get(lane).copied().unwrap_or(0.0)
}

#[inline(always)]
pub(super) fn int_at<F: Num>(lanes: &F::Ints, lane: usize) -> u32 {
    lanes.as_ref().get(lane).copied().unwrap_or(0)
}

/// Where patches lie on their faces: the first, and one behind the last, columns and rows.
type Extents<F> = [[F; 2]; 2];

/// Pairs of corner words of each lane's patch: of the upper and of the lower row.
struct Corners<F: Num>([F::Ints; 2]);

impl<F: Num> Corners<F> {
    /// Puts those of the patch at a column of a block's line.
    #[inline(always)]
    fn put(&mut self, lane: usize, light: &Light<'_>, columns: usize, line: usize, column: usize) {
        let first = line + columns + column;
        put_int::<F>(&mut self.0[0], lane, light.pair(first - 1));
        put_int::<F>(&mut self.0[1], lane, light.pair(first - 1 + 2 * columns));
    }

    #[inline(always)]
    fn values(self, light: &Light<'_>) -> [F; 4] {
        if !light.bilinear {
            let one = F::splat(1.0);
            return [one, one, one, one];
        }
        let add = EXPONENT_OF_WORD_0 << 23;
        let least = F::splat(f32::from_bits(add));
        let ([a, b], [c, d]) = (F::halves(self.0[0], add), F::halves(self.0[1], add));
        [F::only(least.lt(a), a), F::only(least.lt(b), b), F::only(least.lt(c), c), F::only(least.lt(d), d)]
    }
}

/// Where the table of a row's cells begins.
#[inline(always)]
fn top_row([columns, rows]: [u32; 2], row: usize) -> usize {
    rows as usize + 1 + row * (columns as usize + 1)
}

impl Cell {
    /// Where the table of a row's blocks begins among the starts.
    #[inline(always)]
    fn row(&self, row: usize) -> usize {
        self.starts as usize + usize::from(self.blocks[1]) + 1 + row * (usize::from(self.blocks[0]) + 1)
    }

    /// The first patch and one behind the last, along an axis, of a part of a block's grid.
    #[inline(always)]
    fn extent(&self, axis: usize, block: u32, part: u32, step: u8) -> (u32, u32) {
        let (origin, patches) = (u32::from(self.origin[axis]), u32::from(self.patches[axis]));
        let block_begin = block << (self.side[axis] & 31);
        let block_end = (block_begin + (1 << (self.side[axis] & 31))).min(patches);
        let first = block_begin + (part << (step & 31));
        (origin + first, origin + (first + (1 << (step & 31))).min(block_end))
    }
}

impl Block {
    /// Where the line of a row of patches begins.
    #[inline(always)]
    fn line(&self, row: usize, bilinear: bool) -> usize {
        self.lines as usize + row * line_words(self.grid[0].into(), bilinear)
    }
}

impl Light<'_> {
    #[inline(always)]
    fn cell(&self, index: usize) -> Cell {
        self.cells.get(index).copied().unwrap_or_default()
    }

    #[inline(always)]
    fn block(&self, index: usize) -> Block {
        self.blocks.get(index).copied().unwrap_or_default()
    }

    /// Two words that stand side by side, the first one low.
    #[inline(always)]
    fn pair(&self, index: usize) -> u32 {
        let [low, high, ..] = *self.lines.window(index);
        u32::from(low) | u32::from(high) << 16
    }

    /// Patches put together from what the walks found: starts and widths in the cell, of block columns and rows, then of
    /// columns and rows in units.
    #[inline(always)]
    fn patches<F: Num>(
        &self,
        cell: F::Ints,
        [first, behind]: Extents<F>,
        corner: [F; 4],
        share: F,
        outer: [Ranges<F>; 2],
        inner: [Ranges<F>; 2],
    ) -> Patches<F> {
        let [columns, rows] = self.chart.axes;
        let low = [columns.edge(first[0]), rows.edge(first[1])];
        let unit = F::splat(1.0 / UNITS);
        let (column_width, row_width) = (inner[0].width * unit, inner[1].width * unit);
        let mut face = F::splat(0.0);
        if self.chart.layout == Layout::Cube {
            let mut faces = F::ints();
            for lane in 0..F::WIDTH {
                put_int::<F>(&mut faces, lane, self.cell(int_at::<F>(&cell, lane) as usize).face.into());
            }
            face = F::of_ints(faces);
        }
        Patches {
            cell,
            face,
            first,
            behind,
            low,
            size: [columns.edge(behind[0]) - low[0], rows.edge(behind[1]) - low[1]],
            corner,
            probability: share * row_width * column_width,
            start: [
                outer[0].start + outer[0].width * (inner[0].start * unit),
                outer[1].start + outer[1].width * (inner[1].start * unit),
            ],
            width: [outer[0].width * column_width, outer[1].width * row_width],
        }
    }

    /// Where patches lie that are parts of blocks of cells, each by number along columns and rows.
    #[inline(always)]
    fn extents<F: Num>(&self, cells: &F::Ints, blocks: &F::Ints, at: [F::Ints; 2], part: [F::Ints; 2]) -> Extents<F> {
        let mut first = [F::ints(), F::ints()];
        if self.exact {
            for lane in 0..F::WIDTH {
                let [x, y] = self.cell(int_at::<F>(cells, lane) as usize).origin;
                put_int::<F>(&mut first[0], lane, x.into());
                put_int::<F>(&mut first[1], lane, y.into());
            }
            let (across, down) = ((1u32 << (self.side[0] & 31)) as f32, (1u32 << (self.side[1] & 31)) as f32);
            let x = F::of_ints(first[0]) + F::of_ints(at[0]) * F::splat(across) + F::of_ints(part[0]);
            let y = F::of_ints(first[1]) + F::of_ints(at[1]) * F::splat(down) + F::of_ints(part[1]);
            return [[x, y], [x + F::splat(1.0), y + F::splat(1.0)]];
        }
        let mut behind = first;
        for lane in 0..F::WIDTH {
            let c = self.cell(int_at::<F>(cells, lane) as usize);
            let block = self.block(int_at::<F>(blocks, lane) as usize);
            for k in 0..2 {
                let (block_at, part) = (int_at::<F>(&at[k], lane), int_at::<F>(&part[k], lane));
                let (from, to) = c.extent(k, block_at, part, block.step[k]);
                put_int::<F>(&mut first[k], lane, from);
                put_int::<F>(&mut behind[k], lane, to);
            }
        }
        let [first, behind] = [first, behind];
        [[F::of_ints(first[0]), F::of_ints(first[1])], [F::of_ints(behind[0]), F::of_ints(behind[1])]]
    }

    /// The cell that `u` (column, row) falls into, and the position in it: the light alone.
    #[inline(always)]
    pub fn cell_at(&self, [across, down]: [f32; 2]) -> (usize, [f32; 2]) {
        let ([cell], [[w], [v]]) = self.cells_at::<f32>([across, down]);
        (cell as usize, [w, v])
    }

    /// As [`Light::cell_at`], for each lane.
    #[inline(always)]
    pub fn cells_at<F: Num>(&self, u: [F; 2]) -> (F::Ints, [F::Floats; 2]) {
        let [columns, rows] = [self.grid[0] as usize, self.grid[1] as usize];
        let (across, down) = (u[0].store(), u[1].store());
        let (mut cells, mut numbers) = (F::ints(), [F::floats(), F::floats()]);
        for lane in 0..F::WIDTH {
            let (w, v) = (at::<F>(&across, lane), at::<F>(&down, lane));
            let (row, rows) = find(&self.tops, 0, rows, v);
            let (column, columns_range) = find(&self.tops, top_row(self.grid, row), columns, w);
            put_int::<F>(&mut cells, lane, (row * columns + column) as u32);
            put::<F>(&mut numbers[0], lane, rest(w, columns_range));
            put::<F>(&mut numbers[1], lane, rest(v, rows));
        }
        (cells, numbers)
    }

    /// The inverse of [`Light::cell_at`]: start and width of a cell along columns and rows.
    #[inline(always)]
    pub fn cell_range(&self, cell_index: usize) -> [(f32, f32); 2] {
        let (row, column) = (cell_index / self.grid[0] as usize, cell_index % self.grid[0] as usize);
        let [left, right] = cell(&self.tops, top_row(self.grid, row), column);
        let [top, bottom] = cell(&self.tops, 0, row);
        [(left, right - left), (top, bottom - top)]
    }

    /// The places for numbers (column, row) in [0, 1 - 2^-24]^2 of cells.
    #[inline(always)]
    pub fn sample_in<F: Num>(&self, cells: F::Ints, numbers: [F; 2]) -> Drawn<F> {
        self.draw(cells, [numbers[0].store(), numbers[1].store()])
    }

    /// As [`Light::sample_in`]. The walk computes lane by lane and goes through memory between its stages, so that the cache
    /// misses of all lanes overlap; lanes are loaded once, at its end, since a load has to wait for all smaller stores into it.
    #[inline(always)]
    pub(super) fn draw<F: Num>(&self, cells: F::Ints, numbers: [F::Floats; 2]) -> Drawn<F> {
        let mut block_row = Searched::<F>::new();
        for lane in 0..F::WIDTH {
            let c = self.cell(int_at::<F>(&cells, lane) as usize);
            let found = find(&self.starts, c.starts as usize, c.blocks[1].into(), at::<F>(&numbers[1], lane));
            prefetch(self.blocks, c.first as usize + found.0 * usize::from(c.blocks[0]));
            block_row.put(lane, found);
        }
        let (mut block_column, mut blocks) = (Searched::<F>::new(), F::ints());
        let mut units = [F::floats(), F::floats()];
        for lane in 0..F::WIDTH {
            let c = self.cell(int_at::<F>(&cells, lane) as usize);
            let (w, v) = (at::<F>(&numbers[0], lane), at::<F>(&numbers[1], lane));
            let found = find(&self.starts, c.row(block_row.index(lane)), c.blocks[0].into(), w);
            let block = c.first as usize + block_row.index(lane) * usize::from(c.blocks[0]) + found.0;
            self.rows.prefetch(self.block(block).rows as usize);
            put_int::<F>(&mut blocks, lane, block as u32);
            put::<F>(&mut units[0], lane, UNITS * rest(w, found.1));
            put::<F>(&mut units[1], lane, UNITS * rest(v, block_row.range(lane)));
            block_column.put(lane, found);
        }
        let mut row = Searched16::<F>::new();
        for lane in 0..F::WIDTH {
            let block = self.block(int_at::<F>(&blocks, lane) as usize);
            let key = at::<F>(&units[1], lane) as i32 as u32;
            let found = find16(&self.rows, block.rows as usize, block.grid[1].into(), key);
            self.prefetch_lines(&block, found.0);
            row.put(lane, found);
        }
        let mut column = Searched16::<F>::new();
        let (mut corners, mut share) = (Corners::<F>([F::ints(), F::ints()]), F::floats());
        for lane in 0..F::WIDTH {
            let block = self.block(int_at::<F>(&blocks, lane) as usize);
            let line = block.line(row.index(lane), self.bilinear);
            let key = at::<F>(&units[0], lane) as i32 as u32;
            let found = find16(&self.lines, line, block.grid[0].into(), key);
            put::<F>(&mut share, lane, block.share);
            if self.bilinear {
                corners.put(lane, self, block.grid[0].into(), line, found.0);
            }
            column.put(lane, found);
        }
        let (columns, rows) = (column.ranges(), row.ranges());
        let extents = self.extents(&cells, &blocks, [block_column.index, block_row.index], [column.index, row.index]);
        let (outer, inner) = ([block_column.ranges(), block_row.ranges()], [columns, rows]);
        let patch = self.patches(cells, extents, corners.values(self), F::load(share), outer, inner);
        let shape = patch.shape(self);
        let mut position = shape.sample([columns.rest(F::load(units[0])), rows.rest(F::load(units[1]))]);
        if !self.bilinear {
            // Away from the borders, where a client's rounding might find the neighbour.
            for ((k, at), &size) in position.iter_mut().enumerate().zip(&patch.size) {
                let least = F::splat(1.25 * self.chart.margin(k)) / size;
                *at = at.max(least).min(F::splat(1.0) - least);
            }
        }
        Drawn { patch, shape, position, numbers }
    }

    /// Asks for the line of a row of patches, and for the corners below.
    #[inline(always)]
    fn prefetch_lines(&self, block: &Block, row: usize) {
        let line = block.line(row, self.bilinear);
        self.lines.prefetch(line);
        if self.bilinear {
            self.lines.prefetch(line + 4 * usize::from(block.grid[0]) - 1);
        }
    }

    /// The patches at columns and rows of faces; their numbers only if `numbers`.
    #[inline(always)]
    fn patches_at<F: Num>(&self, face: F::Ints, column: F::Ints, row: F::Ints, numbers: bool) -> Patches<F> {
        let (mut cells, mut blocks) = (F::ints(), F::ints());
        let (mut block_at, mut patch_at) = ([F::ints(), F::ints()], [F::ints(), F::ints()]);
        let face_rows = self.grid[1] / self.chart.faces();
        for lane in 0..F::WIDTH {
            let (x, y) = (int_at::<F>(&column, lane), int_at::<F>(&row, lane));
            let cell_column = u32::from(byte(self.cell_of[0], (x >> (self.side[0] & 31)) as usize));
            let cell_row = u32::from(byte(self.cell_of[1], (y >> (self.side[1] & 31)) as usize));
            let index = (int_at::<F>(&face, lane) * face_rows + cell_row) * self.grid[0] + cell_column;
            let c = self.cell(index as usize);
            let (x, y) = (x.wrapping_sub(c.origin[0].into()), y.wrapping_sub(c.origin[1].into()));
            let (side_x, side_y) = (c.side[0] & 31, c.side[1] & 31);
            let (i, j) = (x >> side_x, y >> side_y);
            let number = c.first as usize + j as usize * usize::from(c.blocks[0]) + i as usize;
            let block = self.block(number);
            let in_row = (y & !(u32::MAX << side_y)) >> (block.step[1] & 31);
            self.rows.prefetch(block.rows as usize);
            self.prefetch_lines(&block, in_row as usize);
            put_int::<F>(&mut cells, lane, index);
            put_int::<F>(&mut blocks, lane, number as u32);
            put_int::<F>(&mut block_at[0], lane, i);
            put_int::<F>(&mut block_at[1], lane, j);
            put_int::<F>(&mut patch_at[0], lane, (x & !(u32::MAX << side_x)) >> (block.step[0] & 31));
            put_int::<F>(&mut patch_at[1], lane, in_row);
        }
        let (mut outer_column, mut outer_row) = (Searched::<F>::new(), Searched::<F>::new());
        let (mut inner_column, mut inner_row) = (Searched16::<F>::new(), Searched16::<F>::new());
        let (mut corners, mut share) = (Corners::<F>([F::ints(), F::ints()]), F::floats());
        for lane in 0..F::WIDTH {
            let block = self.block(int_at::<F>(&blocks, lane) as usize);
            let (x, y) = (int_at::<F>(&patch_at[0], lane) as usize, int_at::<F>(&patch_at[1], lane) as usize);
            inner_row.put(lane, (y, cell16(&self.rows, block.rows as usize, block.grid[1].into(), y)));
            let line = block.line(y, self.bilinear);
            inner_column.put(lane, (x, cell16(&self.lines, line, block.grid[0].into(), x)));
            put::<F>(&mut share, lane, block.share);
            if self.bilinear {
                corners.put(lane, self, block.grid[0].into(), line, x);
            }
            if numbers {
                let c = self.cell(int_at::<F>(&cells, lane) as usize);
                let (i, j) = (int_at::<F>(&block_at[0], lane) as usize, int_at::<F>(&block_at[1], lane) as usize);
                outer_row.put(lane, (j, cell(&self.starts, c.starts as usize, j)));
                outer_column.put(lane, (i, cell(&self.starts, c.row(j), i)));
            }
        }
        let extents = if self.exact {
            let (x, y, one) = (F::of_ints(column), F::of_ints(row), F::splat(1.0));
            [[x, y], [x + one, y + one]]
        } else {
            self.extents(&cells, &blocks, block_at, patch_at)
        };
        let outer = [outer_column.ranges(), outer_row.ranges()];
        let inner = [inner_column.ranges(), inner_row.ranges()];
        self.patches(cells, extents, corners.values(self), F::load(share), outer, inner)
    }

    /// Where directions of unit length are, their densities within their cells, and, if `numbers`, what
    /// [`Located::numbers`] needs.
    #[inline(always)]
    pub fn locate<F: Num>(&self, d: Direction<F>, numbers: bool) -> Located<F> {
        let place = self.chart.place(d);
        let (column, row) = (self.chart.axes[0].patch(place.position[0]), self.chart.axes[1].patch(place.position[1]));
        let patch = self.patches_at::<F>(place.face.truncate(), column, row, numbers);
        let shape = patch.shape(self);
        within(&patch, &shape, &place)
    }

    /// The direction of a drawn place.
    #[inline(always)]
    pub fn direction_of<F: Num>(&self, drawn: &Drawn<F>) -> Direction<F> {
        let Drawn { patch, position, .. } = drawn;
        let column = patch.low[0] + position[0] * patch.size[0];
        self.chart.direction(patch.face, [column, patch.low[1] + position[1] * patch.size[1]])
    }

    /// Drawn places with their densities: what [`Light::locate`] would find, but for rounding at the borders of patches.
    #[inline(always)]
    pub fn drawn_at<F: Num>(&self, d: Direction<F>, drawn: &Drawn<F>) -> Located<F> {
        let place = self.chart.place(d);
        located(&drawn.patch, &drawn.shape, drawn.position, &place)
    }

    /// As [`Light::locate`] for directions that were drawn from known patches: in those that still hold them, and a mask of the
    /// lanes in which rounding left the patch. In a light for nearest clients, also of those in which it came so close to the
    /// border that the client's own rounding might find the neighbour.
    #[inline(always)]
    pub fn relocate<F: Num>(&self, d: Direction<F>, drawn: &Drawn<F>) -> (Located<F>, F::Mask) {
        let place = self.chart.place(d);
        let patch = &drawn.patch;
        let column = F::of_ints(self.chart.axes[0].patch(place.position[0]));
        let row = F::of_ints(self.chart.axes[1].patch(place.position[1]));
        let columns_out = F::or(column.lt(patch.first[0]), patch.behind[0].le(column));
        let rows_out = F::or(row.lt(patch.first[1]), patch.behind[1].le(row));
        let other_face = F::or(place.face.lt(patch.face), patch.face.lt(place.face));
        let mut out = F::or(F::or(columns_out, rows_out), other_face);
        if !self.bilinear {
            for (k, &position) in place.position.iter().enumerate() {
                let (from, margin) = (position - patch.low[k], F::splat(self.chart.margin(k)));
                out = F::or(out, F::or(from.lt(margin), (patch.size[k] - margin).lt(from)));
            }
        }
        (within(patch, &drawn.shape, &place), out)
    }
}

/// A place in the patch that holds it.
#[inline(always)]
fn within<F: Num>(patch: &Patches<F>, shape: &PatchDensity<F>, place: &Place<F>) -> Located<F> {
    let (zero, one) = (F::splat(0.0), F::splat(1.0));
    let s = ((place.position[0] - patch.low[0]) / patch.size[0]).max(zero).min(one);
    let t = ((place.position[1] - patch.low[1]) / patch.size[1]).max(zero).min(one);
    located(patch, shape, [s, t], place)
}

/// A position inside a patch, with its density.
#[inline(always)]
fn located<F: Num>(patch: &Patches<F>, shape: &PatchDensity<F>, position: [F; 2], place: &Place<F>) -> Located<F> {
    let area = (patch.size[0] * patch.size[1]) * place.solid_angle;
    let scale = (shape.total() * area).max(F::splat(f32::MIN_POSITIVE));
    let density = patch.probability * shape.unscaled(position) / scale;
    Located { patch: *patch, position, density }
}

#[inline(always)]
fn byte(bytes: &[u8], index: usize) -> u8 {
    bytes.get(index).copied().unwrap_or(0)
}

/// Places that were drawn: the patches, and the positions inside.
#[derive(Clone, Copy)]
pub struct Drawn<F: Num> {
    /// The patches.
    pub patch: Patches<F>,
    /// The densities inside.
    pub(super) shape: PatchDensity<F>,
    /// Column and row inside, in [0, 1].
    pub position: [F; 2],
    /// The numbers that led here.
    pub(super) numbers: [F::Floats; 2],
}

/// Replaces the number of one lane.
#[inline(always)]
pub(super) fn set<F: Num>(f: &mut F, lane: usize, x: f32) {
    let mut lanes = f.store();
    put::<F>(&mut lanes, lane, x);
    *f = F::load(lanes);
}

/// Words of a line of a block with so many columns.
pub const fn line_words(columns: usize, bilinear: bool) -> usize {
    if bilinear { 2 * columns } else { columns }
}

/// What a word's exponent of 0 stands for, as that of an f32: corners span 2^31.
const EXPONENT_OF_WORD_0: u32 = 112;

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
