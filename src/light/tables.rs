//! The stored light: cells of blocks of patches, as cumulative tables, and the only walks through them.
//!
//! A face is divided into a few cells, on which products are built; a cell into blocks; a block into a grid of at most 16 x 16
//! patches, each as large as a texel or, where an error budget allows it, as a square of texels. A sample is four short
//! searches: row and column of a block in its cell, row and column of a patch in its block; then one warp inside the patch.
//! A density reads the same numbers at the patch that holds the direction.

use super::chart::{Chart, Place};
use super::search::{Found, UNITS, cell, cell16, find, find16, inside};
use super::warp::PatchDensity;
use crate::numeric::ONE_MINUS_EPSILON;
use crate::simd::{Num, prefetch};
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
    /// The integral of luminance over the sphere.
    pub power: f64,
    /// Cells along columns and rows of all faces.
    pub grid: [u32; 2],
    /// The cells, row by row, face by face.
    pub cells: &'a [Cell],
    /// The starts of the rows of cells, then of the cells of each row.
    pub tops: &'a [f32],
    /// The column and the row of cells in which a column and a row of the smallest blocks lie.
    pub cell_of: [&'a [u8]; 2],
    /// The smallest block has 2^side patches along each axis.
    pub side: [u32; 2],
    /// In-cell tables.
    pub starts: &'a [f32],
    /// The blocks.
    pub blocks: &'a [Block],
    /// Row starts of blocks.
    pub rows: &'a [u16],
    /// Lines of blocks.
    pub lines: &'a [u16],
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
    /// One lane.
    pub(super) fn lane(&self, lane: usize) -> Patches<f32> {
        let one = |f: F| f.store().as_ref().get(lane).copied().unwrap_or(0.0);
        let two = |f: [F; 2]| f.map(one);
        Patches {
            cell: [self.cell.as_ref().get(lane).copied().unwrap_or(0)],
            face: one(self.face),
            first: two(self.first),
            behind: two(self.behind),
            low: two(self.low),
            size: two(self.size),
            corner: self.corner.map(one),
            probability: one(self.probability),
            start: two(self.start),
            width: two(self.width),
        }
    }

    /// These patches with that of one lane replaced.
    pub(super) fn with_lane(self, lane: usize, by: &Patches<f32>) -> Patches<F> {
        let one = |f: F, x: f32| set(f, lane, x);
        let two = |f: [F; 2], x: [f32; 2]| [one(f[0], x[0]), one(f[1], x[1])];
        let mut cell = self.cell;
        if let (Some(out), [number]) = (cell.as_mut().get_mut(lane), by.cell) {
            *out = number;
        }
        let [a, b, c, d] = self.corner;
        let [p, q, r, s] = by.corner;
        Patches {
            cell,
            face: one(self.face, by.face),
            first: two(self.first, by.first),
            behind: two(self.behind, by.behind),
            low: two(self.low, by.low),
            size: two(self.size, by.size),
            corner: [one(a, p), one(b, q), one(c, r), one(d, s)],
            probability: one(self.probability, by.probability),
            start: two(self.start, by.start),
            width: two(self.width, by.width),
        }
    }

    #[inline(always)]
    pub(super) fn shape(&self, light: &Light<'_>) -> PatchDensity<F> {
        PatchDensity::new(self.corner, light.chart.profiles(self.low, self.size))
    }
}

/// What a search found in each lane.
struct Searched<F: Num> {
    index: F::Ints,
    start: F::Floats,
    width: F::Floats,
}

impl<F: Num> Searched<F> {
    #[inline(always)]
    fn new() -> Self {
        Searched { index: F::ints(), start: F::floats(), width: F::floats() }
    }

    #[inline(always)]
    fn put(&mut self, lane: usize, index: usize, (start, width): (f32, f32)) {
        put_int::<F>(&mut self.index, lane, index as u32);
        put::<F>(&mut self.start, lane, start);
        put::<F>(&mut self.width, lane, width);
    }

    #[inline(always)]
    fn found(&mut self, lane: usize, found: Found) {
        self.put(lane, found.index, (found.start, found.width));
    }

    #[inline(always)]
    fn index(&self, lane: usize) -> usize {
        int_at::<F>(&self.index, lane) as usize
    }

    /// Starts and widths.
    #[inline(always)]
    fn ranges(&self) -> (F, F) {
        (F::load(self.start), F::load(self.width))
    }

    /// Positions inside, of the numbers that were searched.
    #[inline(always)]
    fn rest(&self, number: F) -> F {
        let (start, width) = self.ranges();
        inside(number, start, width)
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
fn at<F: Num>(lanes: &F::Floats, lane: usize) -> f32 {
    lanes.as_ref().get(lane).copied().unwrap_or(0.0)
}

#[inline(always)]
fn int_at<F: Num>(lanes: &F::Ints, lane: usize) -> u32 {
    lanes.as_ref().get(lane).copied().unwrap_or(0)
}

/// Patches while they are put together, lane by lane.
struct Gathered<F: Num> {
    cell: F::Ints,
    face: F::Ints,
    first: [F::Ints; 2],
    behind: [F::Ints; 2],
    /// Pairs of corner words: of the upper and of the lower row.
    corner: [F::Ints; 2],
    share: F::Floats,
}

impl<F: Num> Gathered<F> {
    #[inline(always)]
    fn new() -> Self {
        let none = F::ints();
        Gathered {
            cell: none,
            face: none,
            first: [none, none],
            behind: [none, none],
            corner: [none, none],
            share: F::floats(),
        }
    }

    /// Puts the patch `patch_at` (column, row) of a block that is the one at `block_at` (column, row) of its cell.
    #[inline(always)]
    fn put(&mut self, lane: usize, light: &Light<'_>, cell: usize, block: &Block, at: [[usize; 2]; 2]) {
        let c = light.cell(cell);
        let [[block_column, block_row], [column, row]] = at;
        let (x0, x1) = c.extent(0, block_column, column, block.step[0]);
        let (y0, y1) = c.extent(1, block_row, row, block.step[1]);
        put_int::<F>(&mut self.cell, lane, cell as u32);
        put_int::<F>(&mut self.face, lane, c.face.into());
        put_int::<F>(&mut self.first[0], lane, x0);
        put_int::<F>(&mut self.first[1], lane, y0);
        put_int::<F>(&mut self.behind[0], lane, x1);
        put_int::<F>(&mut self.behind[1], lane, y1);
        put::<F>(&mut self.share, lane, block.share);
        if light.bilinear {
            let columns = usize::from(block.grid[0]);
            let corner = block.line(row, true) + columns - 1 + column;
            put_int::<F>(&mut self.corner[0], lane, light.pair(corner));
            put_int::<F>(&mut self.corner[1], lane, light.pair(corner + 2 * columns));
        }
    }

    /// All lanes, with starts and widths in the cell: of block columns and rows, then of columns and rows in units.
    #[inline(always)]
    fn patches(self, light: &Light<'_>, outer: [(F, F); 2], inner: [(F, F); 2]) -> Patches<F> {
        let [columns, rows] = light.chart.axes;
        let (x0, y0) = (F::of_ints(self.first[0]), F::of_ints(self.first[1]));
        let (x1, y1) = (F::of_ints(self.behind[0]), F::of_ints(self.behind[1]));
        let low = [columns.edge(x0), rows.edge(y0)];
        let one = F::splat(1.0);
        let corner = if light.bilinear {
            let ([a, b], [c, d]) = (corners(self.corner[0]), corners(self.corner[1]));
            [a, b, c, d]
        } else {
            [one, one, one, one]
        };
        let unit = F::splat(1.0 / UNITS);
        let (column_width, row_width) = (inner[0].1 * unit, inner[1].1 * unit);
        Patches {
            cell: self.cell,
            face: F::of_ints(self.face),
            first: [x0, y0],
            behind: [x1, y1],
            low,
            size: [columns.edge(x1) - low[0], rows.edge(y1) - low[1]],
            corner,
            probability: F::load(self.share) * row_width * column_width,
            start: [outer[0].0 + outer[0].1 * (inner[0].0 * unit), outer[1].0 + outer[1].1 * (inner[1].0 * unit)],
            width: [outer[0].1 * column_width, outer[1].1 * row_width],
        }
    }
}

impl Cell {
    /// The first patch and one behind the last, along an axis, of a part of a block's grid.
    #[inline(always)]
    fn extent(&self, axis: usize, block: usize, part: usize, step: u8) -> (u32, u32) {
        let (origin, patches) = (u32::from(self.origin[axis]), u32::from(self.patches[axis]));
        let block_begin = (block as u32) << (self.side[axis] & 31);
        let block_end = (block_begin + (1 << (self.side[axis] & 31))).min(patches);
        let first = block_begin + ((part as u32) << (step & 31));
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
        match self.lines.get(index..).and_then(|words| words.first_chunk::<2>()) {
            Some(&[low, high]) => u32::from(low) | u32::from(high) << 16,
            None => 0,
        }
    }

    /// The cell that `u` (column, row) falls into, and the position in it: the light alone.
    #[inline(always)]
    pub fn cell_at(&self, [across, down]: [f32; 2]) -> (usize, [f32; 2]) {
        let ([cell], numbers) = self.cells_at::<f32>([across, down]);
        (cell as usize, numbers)
    }

    /// As [`Light::cell_at`], for each lane.
    #[inline(always)]
    pub fn cells_at<F: Num>(&self, u: [F; 2]) -> (F::Ints, [F; 2]) {
        let [columns, rows] = [self.grid[0] as usize, self.grid[1] as usize];
        let (across, down) = (u[0].store(), u[1].store());
        let (mut row, mut column) = (Searched::<F>::new(), Searched::<F>::new());
        let mut cells = F::ints();
        for lane in 0..F::WIDTH {
            let found_row = find(self.tops, 0, rows, at::<F>(&down, lane));
            let found_column = find(self.tops, rows + found_row.index * columns, columns, at::<F>(&across, lane));
            put_int::<F>(&mut cells, lane, (found_row.index * columns + found_column.index) as u32);
            row.found(lane, found_row);
            column.found(lane, found_column);
        }
        (cells, [column.rest(u[0]), row.rest(u[1])])
    }

    /// The inverse of [`Light::cell_at`]: start and width of a cell along columns and rows.
    #[inline(always)]
    pub fn cell_range(&self, cell_index: usize) -> [(f32, f32); 2] {
        let [columns, rows] = [self.grid[0] as usize, self.grid[1] as usize];
        let (row, column) = (cell_index / columns, cell_index % columns);
        [cell(self.tops, rows + row * columns, columns, column), cell(self.tops, 0, rows, row)]
    }

    /// The places for numbers (column, row) in [0, 1 - 2^-24]^2 of cells.
    #[inline(always)]
    pub fn sample_in<F: Num>(&self, cells: F::Ints, numbers: [F; 2]) -> Drawn<F> {
        let units = F::splat(UNITS);
        let mut block_row = Searched::<F>::new();
        let v = numbers[1].store();
        for lane in 0..F::WIDTH {
            let c = self.cell(int_at::<F>(&cells, lane) as usize);
            let found = find(self.starts, c.starts as usize, c.blocks[1].into(), at::<F>(&v, lane));
            prefetch(self.blocks, c.first as usize + found.index * usize::from(c.blocks[0]));
            block_row.found(lane, found);
        }
        let t = block_row.rest(numbers[1]) * units;
        let (mut block_column, mut blocks) = (Searched::<F>::new(), F::ints());
        let w = numbers[0].store();
        for lane in 0..F::WIDTH {
            let c = self.cell(int_at::<F>(&cells, lane) as usize);
            let [columns, rows] = [usize::from(c.blocks[0]), usize::from(c.blocks[1])];
            let before = block_row.index(lane) * columns;
            let found = find(self.starts, c.starts as usize + rows + before, columns, at::<F>(&w, lane));
            let block = c.first as usize + before + found.index;
            prefetch(self.rows, self.block(block).rows as usize);
            put_int::<F>(&mut blocks, lane, block as u32);
            block_column.found(lane, found);
        }
        let s = block_column.rest(numbers[0]) * units;
        let mut row = Searched::<F>::new();
        let (down, across) = (t.store(), s.store());
        for lane in 0..F::WIDTH {
            let block = self.block(int_at::<F>(&blocks, lane) as usize);
            let key = at::<F>(&down, lane) as i32 as u16;
            let found = find16(self.rows, block.rows as usize, block.grid[1].into(), key);
            self.prefetch_lines(&block, found.index);
            row.found(lane, found);
        }
        let mut column = Searched::<F>::new();
        let mut gathered = Gathered::<F>::new();
        for lane in 0..F::WIDTH {
            let block = self.block(int_at::<F>(&blocks, lane) as usize);
            let key = at::<F>(&across, lane) as i32 as u16;
            let line = block.line(row.index(lane), self.bilinear);
            let found = find16(self.lines, line, block.grid[0].into(), key);
            let place = [[block_column.index(lane), block_row.index(lane)], [found.index, row.index(lane)]];
            gathered.put(lane, self, int_at::<F>(&cells, lane) as usize, &block, place);
            column.found(lane, found);
        }
        let outer = [block_column.ranges(), block_row.ranges()];
        let patch = gathered.patches(self, outer, [column.ranges(), row.ranges()]);
        let shape = patch.shape(self);
        let mut position = shape.sample([column.rest(s), row.rest(t)]);
        if !self.bilinear {
            // Away from the borders, where a client's rounding might find the neighbour.
            for k in 0..2 {
                let least = F::splat(1.25 * self.chart.margin(k)) / patch.size[k];
                position[k] = position[k].max(least).min(F::splat(1.0) - least);
            }
        }
        Drawn { patch, shape, position }
    }

    /// Asks for the line of a row of patches, and for the corners below.
    #[inline(always)]
    fn prefetch_lines(&self, block: &Block, row: usize) {
        let line = block.line(row, self.bilinear);
        prefetch(self.lines, line);
        if self.bilinear {
            prefetch(self.lines, line + 4 * usize::from(block.grid[0]) - 1);
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
            prefetch(self.rows, block.rows as usize);
            self.prefetch_lines(&block, in_row as usize);
            put_int::<F>(&mut cells, lane, index);
            put_int::<F>(&mut blocks, lane, number as u32);
            put_int::<F>(&mut block_at[0], lane, i);
            put_int::<F>(&mut block_at[1], lane, j);
            put_int::<F>(&mut patch_at[0], lane, (x & !(u32::MAX << side_x)) >> (block.step[0] & 31));
            put_int::<F>(&mut patch_at[1], lane, in_row);
        }
        let (mut outer_column, mut outer_row) = (Searched::<F>::new(), Searched::<F>::new());
        let (mut inner_column, mut inner_row) = (Searched::<F>::new(), Searched::<F>::new());
        let mut gathered = Gathered::<F>::new();
        for lane in 0..F::WIDTH {
            let block = self.block(int_at::<F>(&blocks, lane) as usize);
            let cell_index = int_at::<F>(&cells, lane) as usize;
            let [i, j] = [int_at::<F>(&block_at[0], lane) as usize, int_at::<F>(&block_at[1], lane) as usize];
            let [x, y] = [int_at::<F>(&patch_at[0], lane) as usize, int_at::<F>(&patch_at[1], lane) as usize];
            inner_row.put(lane, y, cell16(self.rows, block.rows as usize, block.grid[1].into(), y));
            let line = block.line(y, self.bilinear);
            inner_column.put(lane, x, cell16(self.lines, line, block.grid[0].into(), x));
            if numbers {
                let c = self.cell(cell_index);
                let [columns, rows] = [usize::from(c.blocks[0]), usize::from(c.blocks[1])];
                let first = c.starts as usize;
                outer_row.put(lane, j, cell(self.starts, first, rows, j));
                outer_column.put(lane, i, cell(self.starts, first + rows + j * columns, columns, i));
            }
            gathered.put(lane, self, cell_index, &block, [[i, j], [x, y]]);
        }
        let outer = [outer_column.ranges(), outer_row.ranges()];
        gathered.patches(self, outer, [inner_column.ranges(), inner_row.ranges()])
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
        let Drawn { patch, shape, position } = drawn;
        let area = (patch.size[0] * patch.size[1]) * place.solid_angle;
        let scale = (shape.total() * area).max(F::splat(f32::MIN_POSITIVE));
        Located { patch: *patch, position: *position, density: patch.probability * shape.unscaled(*position) / scale }
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
            for k in 0..2 {
                let (from, margin) = (place.position[k] - patch.low[k], F::splat(self.chart.margin(k)));
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
    let area = (patch.size[0] * patch.size[1]) * place.solid_angle;
    let scale = (shape.total() * area).max(F::splat(f32::MIN_POSITIVE));
    let density = patch.probability * shape.unscaled([s, t]) / scale;
    Located { patch: *patch, position: [s, t], density }
}

#[inline(always)]
fn byte(bytes: &[u8], index: usize) -> u8 {
    bytes.get(index).copied().unwrap_or(0)
}

/// The values of pairs of corners.
#[inline(always)]
fn corners<F: Num>(pairs: F::Ints) -> [F; 2] {
    let add = EXPONENT_OF_WORD_0 << 23;
    let least = F::splat(f32::from_bits(add));
    let [a, b] = F::halves(pairs, add);
    [F::only(least.lt(a), a), F::only(least.lt(b), b)]
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
}

/// The numbers with that of one lane replaced.
pub(super) fn set<F: Num>(f: F, lane: usize, x: f32) -> F {
    let mut lanes = f.store();
    put::<F>(&mut lanes, lane, x);
    F::load(lanes)
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
