//! The stored light: cells of blocks of patches, as cumulative tables, and the only walks through them.
//!
//! A face is divided into a few cells, on which products are built; a cell into blocks; a block into a grid of at most 16 x 16
//! patches, each as large as a texel or, where an error budget allows it, as a square of texels. A sample is four short
//! searches: row and column of a block in its cell, row and column of a patch in its block; then one warp inside the patch.
//! A density reads the same numbers at the patch that holds the direction.

use super::chart::{Chart, Place};
use super::search::{UNITS, cell, cell16, find, find16};
use super::warp::PatchDensity;
use crate::numeric::ONE_MINUS_EPSILON;
use crate::simd::Num;
use bytemuck::{Pod, Zeroable};

/// The most patches along a side of a block.
pub const BLOCK: usize = 16;

/// A cell: a rectangle of patches of one face. Indices are columns first, then rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Cell {
    /// Its first patch on the face.
    pub origin: [u32; 2],
    /// Its patches.
    pub patches: [u32; 2],
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

/// A patch of one lane, as the tables have it.
#[derive(Clone, Copy, Debug, Default)]
struct Patch {
    cell: usize,
    /// The smallest and one behind the largest patch on the face, columns then rows.
    first: [u32; 2],
    behind: [u32; 2],
    corner: [f32; 4],
    /// Its share of the cell's light.
    probability: f32,
    /// Where its numbers (v along rows, w along columns) begin in the cell's [0, 1)^2, and how many there are.
    start: [f32; 2],
    width: [f32; 2],
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
        let u = self.patch.warp(light).invert(self.position);
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
    fn warp(&self, light: &Light<'_>) -> PatchDensity<F> {
        PatchDensity::new(self.corner, light.chart.profiles(self.low, self.size))
    }
}

impl Light<'_> {
    /// Whether the profile across columns is constant.
    #[inline(always)]
    fn flat(&self) -> bool {
        self.chart.faces() == 1
    }

    /// The cell that `u` (column, row) falls into, and the position in it: the light alone.
    #[inline(always)]
    pub fn cell_at(&self, u: [f32; 2]) -> (usize, [f32; 2]) {
        let [columns, rows] = self.grid.map(|n| n as usize);
        let row = find(self.tops.get(..rows).unwrap_or(&[]), u[1]);
        let first = rows + row.index * columns;
        let column = find(self.tops.get(first..first + columns).unwrap_or(&[]), u[0]);
        (row.index * columns + column.index, [column.rest, row.rest])
    }

    /// The inverse of [`Light::cell_at`]: start and width of a cell along columns and rows.
    #[inline(always)]
    pub fn cell_range(&self, cell_index: usize) -> [(f32, f32); 2] {
        let [columns, rows] = self.grid.map(|n| n as usize);
        let (row, column) = (cell_index / columns, cell_index % columns);
        let first = rows + row * columns;
        let across = cell(self.tops.get(first..first + columns).unwrap_or(&[]), column);
        [across, cell(self.tops.get(..rows).unwrap_or(&[]), row)]
    }

    /// The patch of a cell that the numbers (column, row) lead to, and the position inside.
    #[inline(always)]
    fn descend(&self, index: usize, [w, v]: [f32; 2]) -> (Patch, [f32; 2]) {
        let c = self.cells.get(index).copied().unwrap_or_default();
        let blocks = c.blocks.map(usize::from);
        let starts = self.starts.get(c.starts as usize..).unwrap_or(&[]);
        let block_row = find(starts.get(..blocks[1]).unwrap_or(&[]), v);
        let first = blocks[1] + block_row.index * blocks[0];
        let block_column = find(starts.get(first..first + blocks[0]).unwrap_or(&[]), w);
        let block = self.block(&c, [block_column.index, block_row.index]);
        let grid = block.grid.map(usize::from);
        let row = find16(self.row_starts(&block), block_row.rest);
        let line = self.line(&block, row.index);
        let column = find16(line.get(..grid[0] - 1).unwrap_or(&[]), block_column.rest);
        let place = BlockPlace { cell: c, index, block, at: [block_column.index, block_row.index] };
        let mut patch = self.patch(&place, [column.index, row.index], [column.width, row.width]);
        let ends = [(&block_column, &column), (&block_row, &row)];
        patch.start = ends.map(|(outer, inner)| outer.start + outer.width * (inner.start / UNITS));
        patch.width = ends.map(|(outer, inner)| outer.width * (inner.width / UNITS));
        (patch, [column.rest, row.rest])
    }

    /// The patch at columns and rows of a face; its numbers only if `numbers`.
    #[inline(always)]
    fn patch_at(&self, face: u32, at: [u32; 2], numbers: bool) -> Patch {
        let of = |k: usize| {
            let small = (at[k] >> self.side[k]) as usize;
            self.cell_of[k].get(small).copied().unwrap_or(0)
        };
        let faces = self.chart.faces().max(1);
        let row = face * (self.grid[1] / faces) + u32::from(of(1));
        let index = (row * self.grid[0] + u32::from(of(0))) as usize;
        let c = self.cells.get(index).copied().unwrap_or_default();
        let inside = |k: usize| at[k].saturating_sub(c.origin[k]);
        let block_at = [0, 1].map(|k: usize| (inside(k) >> c.side[k]) as usize);
        let block = self.block(&c, block_at);
        let in_block = |k: usize| (inside(k) & ((1 << c.side[k]) - 1)) >> block.step[k];
        let [column, row] = [in_block(0) as usize, in_block(1) as usize];
        let grid = block.grid.map(usize::from);
        let (row_start, row_width) = cell16(self.row_starts(&block), row);
        let line = self.line(&block, row);
        let (column_start, column_width) = cell16(line.get(..grid[0] - 1).unwrap_or(&[]), column);
        let place = BlockPlace { cell: c, index, block, at: block_at };
        let mut patch = self.patch(&place, [column, row], [column_width, row_width]);
        if numbers {
            let blocks = c.blocks.map(usize::from);
            let starts = self.starts.get(c.starts as usize..).unwrap_or(&[]);
            let (start, width) = cell(starts.get(..blocks[1]).unwrap_or(&[]), block_at[1]);
            let first = blocks[1] + block_at[1] * blocks[0];
            let across = cell(starts.get(first..first + blocks[0]).unwrap_or(&[]), block_at[0]);
            let inner = [(column_start, column_width), (row_start, row_width)];
            let outer = [across, (start, width)];
            patch.start = [0, 1].map(|k: usize| outer[k].0 + outer[k].1 * (inner[k].0 / UNITS));
            patch.width = [0, 1].map(|k: usize| outer[k].1 * (inner[k].1 / UNITS));
        }
        patch
    }

    #[inline(always)]
    fn block(&self, c: &Cell, [column, row]: [usize; 2]) -> Block {
        let index = c.first as usize + row * usize::from(c.blocks[0]) + column;
        self.blocks.get(index).copied().unwrap_or(Block { grid: [1, 1], ..Block::default() })
    }

    #[inline(always)]
    fn row_starts(&self, block: &Block) -> &[u16] {
        let first = block.rows as usize;
        self.rows.get(first..first + usize::from(block.grid[1]) - 1).unwrap_or(&[])
    }

    /// The line of a row of a block's patches, and all that follows.
    #[inline(always)]
    fn line(&self, block: &Block, row: usize) -> &[u16] {
        self.lines.get(block.lines as usize + row * line_words(block.grid[0].into(), self.bilinear)..).unwrap_or(&[])
    }

    #[inline(always)]
    fn patch(&self, place: &BlockPlace, at: [usize; 2], units: [f32; 2]) -> Patch {
        let BlockPlace { cell: c, index, block, at: block_at } = place;
        let grid = usize::from(block.grid[0]);
        let corner = if self.bilinear {
            let line = self.line(block, at[1]);
            let value = |k: usize| decode(line.get(k).copied().unwrap_or(0));
            let (here, below) = (grid - 1 + at[0], 2 * grid + grid - 1 + at[0]);
            [value(here), value(here + 1), value(below), value(below + 1)]
        } else {
            [1.0; 4]
        };
        let first = [0, 1]
            .map(|k: usize| c.origin[k] + ((block_at[k] as u32) << c.side[k]) + ((at[k] as u32) << block.step[k]));
        let behind = [0, 1].map(|k: usize| {
            let block_end = c.origin[k] + ((block_at[k] as u32 + 1) << c.side[k]);
            (first[k] + (1 << block.step[k])).min(block_end).min(c.origin[k] + c.patches[k])
        });
        Patch {
            cell: *index,
            first,
            behind,
            corner,
            probability: block.share * (units[1] / UNITS) * (units[0] / UNITS),
            ..Patch::default()
        }
    }

    /// The patches of all lanes side by side.
    #[inline(always)]
    fn gather<F: Num>(&self, patch: impl Fn(usize) -> Patch) -> Patches<F> {
        let mut cells = F::ints();
        let mut floats = [F::floats(); 13];
        let mut face = F::floats();
        for lane in 0..F::WIDTH {
            let p = patch(lane);
            let numbers = [
                p.first[0] as f32,
                p.first[1] as f32,
                p.behind[0] as f32,
                p.behind[1] as f32,
                p.corner[0],
                p.corner[1],
                p.corner[2],
                p.corner[3],
                p.probability,
                p.start[0],
                p.start[1],
                p.width[0],
                p.width[1],
            ];
            for (row, number) in floats.iter_mut().zip(numbers) {
                if let Some(out) = row.as_mut().get_mut(lane) {
                    *out = number;
                }
            }
            if let Some(out) = cells.as_mut().get_mut(lane) {
                *out = p.cell as u32;
            }
            if let Some(out) = face.as_mut().get_mut(lane) {
                *out = self.cells.get(p.cell).map_or(0.0, |c| f32::from(c.face));
            }
        }
        let [a, b, c, d, e, f, g, h, i, j, k, l, m] = floats;
        let (x0, y0, x1, y1) = (F::load(a), F::load(b), F::load(c), F::load(d));
        let corner = [F::load(e), F::load(f), F::load(g), F::load(h)];
        let [columns, rows] = self.chart.axes;
        let low = [columns.edge(x0), rows.edge(y0)];
        Patches {
            cell: cells,
            face: F::load(face),
            first: [x0, y0],
            behind: [x1, y1],
            low,
            size: [columns.edge(x1) - low[0], rows.edge(y1) - low[1]],
            corner,
            probability: F::load(i),
            start: [F::load(j), F::load(k)],
            width: [F::load(l), F::load(m)],
        }
    }

    /// Where directions of unit length are, their densities within their cells, and, if `numbers`, what
    /// [`Located::numbers`] needs.
    #[inline(always)]
    pub fn locate<F: Num>(&self, d: Direction<F>, numbers: bool) -> Located<F> {
        let place = self.chart.place(d);
        let [columns, rows] = self.chart.axes;
        let (face, column, row) =
            (place.face.truncate(), columns.patch(place.position[0]), rows.patch(place.position[1]));
        let at = |lane: usize| {
            let of = |ints: &F::Ints| ints.as_ref().get(lane).copied().unwrap_or(0);
            self.patch_at(of(&face), [of(&column), of(&row)], numbers)
        };
        let patch = self.gather::<F>(at);
        self.within(patch, &place)
    }

    /// A place in the patch that holds it.
    #[inline(always)]
    fn within<F: Num>(&self, patch: Patches<F>, place: &Place<F>) -> Located<F> {
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let s = ((place.position[0] - patch.low[0]) / patch.size[0]).max(zero).min(one);
        let t = ((place.position[1] - patch.low[1]) / patch.size[1]).max(zero).min(one);
        let position = [s, t];
        let shape = patch.warp(self).at(position) / (place.solid_angle * (patch.size[0] * patch.size[1]));
        Located { patch, position, density: patch.probability * shape }
    }

    /// The places for numbers (column, row) in [0, 1 - 2^-24]^2 of cells.
    #[inline(always)]
    pub fn sample_in<F: Num>(&self, cells: F::Ints, numbers: [F; 2]) -> Drawn<F> {
        let (w, v) = (numbers[0].store(), numbers[1].store());
        let mut rest = [F::floats(); 2];
        let mut patches = [Patch::default(); crate::simd::LANES];
        for lane in 0..F::WIDTH {
            let of = |numbers: &F::Floats| numbers.as_ref().get(lane).copied().unwrap_or(0.0);
            let cell = cells.as_ref().get(lane).copied().unwrap_or(0);
            let (patch, inside) = self.descend(cell as usize, [of(&w), of(&v)]);
            for (row, number) in rest.iter_mut().zip(inside) {
                if let Some(out) = row.as_mut().get_mut(lane) {
                    *out = number;
                }
            }
            if let Some(out) = patches.get_mut(lane) {
                *out = patch;
            }
        }
        let patch = self.gather::<F>(|lane| patches.get(lane).copied().unwrap_or_default());
        let position = patch.warp(self).sample([F::load(rest[0]), F::load(rest[1])], self.flat());
        Drawn { patch, position }
    }

    /// The direction of a drawn place.
    #[inline(always)]
    pub fn direction_of<F: Num>(&self, drawn: &Drawn<F>) -> Direction<F> {
        let Drawn { patch, position } = drawn;
        let column = patch.low[0] + position[0] * patch.size[0];
        self.chart.direction(patch.face, [column, patch.low[1] + position[1] * patch.size[1]])
    }

    /// As [`Light::locate`] for directions that were drawn from known patches: in those that still hold them, and a mask of the
    /// lanes in which rounding left the patch.
    #[inline(always)]
    pub fn relocate<F: Num>(&self, d: Direction<F>, drawn: &Drawn<F>) -> (Located<F>, F::Mask) {
        let place = self.chart.place(d);
        let patch = drawn.patch;
        let column = F::of_ints(self.chart.axes[0].patch(place.position[0]));
        let row = F::of_ints(self.chart.axes[1].patch(place.position[1]));
        let columns_out = F::or(column.lt(patch.first[0]), patch.behind[0].le(column));
        let rows_out = F::or(row.lt(patch.first[1]), patch.behind[1].le(row));
        let other_face = F::or(place.face.lt(patch.face), patch.face.lt(place.face));
        let out = F::or(F::or(columns_out, rows_out), other_face);
        (self.within(patch, &place), out)
    }
}

/// Places that were drawn: the patches, and the positions inside.
#[derive(Clone, Copy)]
pub struct Drawn<F: Num> {
    /// The patches.
    pub patch: Patches<F>,
    /// Column and row inside, in [0, 1].
    pub position: [F; 2],
}

/// The numbers with that of one lane replaced.
pub(super) fn set<F: Num>(f: F, lane: usize, x: f32) -> F {
    let mut lanes = f.store();
    if let Some(out) = lanes.as_mut().get_mut(lane) {
        *out = x;
    }
    F::load(lanes)
}

/// A block in its cell.
struct BlockPlace {
    cell: Cell,
    index: usize,
    block: Block,
    at: [usize; 2],
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
