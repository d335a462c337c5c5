//! Blocks of patches: which grid the error budget allows, and the 16-bit tables of a block.

use super::plan::{Filter, Plan};
use super::search::{Words, stored_cell, variance16, words16, write_table};
use super::tables::{BLOCK, Block, Cell, decode, encode, line_words, row_words};
use super::texels::{Corners, PatchValues, Texels, Tile};
use bytemuck::{Pod, Zeroable};

/// No corner of a coarse grid is darker than this share of the brightest one.
const DARKEST_COARSE: f32 = 1.0 / 1024.0;

/// How much of each table a cell takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Lengths {
    /// In-cell starts.
    pub starts: u64,
    /// Blocks.
    pub blocks: u64,
    /// Words of row starts and lines.
    pub words: u64,
    /// Groups of words of the texel map's tiles.
    pub groups: u64,
}

impl Lengths {
    /// Both.
    pub fn plus(self, b: Lengths) -> Lengths {
        Lengths {
            starts: self.starts + b.starts,
            blocks: self.blocks + b.blocks,
            words: self.words + b.words,
            groups: self.groups + b.groups,
        }
    }

    /// Bytes of all.
    pub fn bytes(self) -> u64 {
        4 * self.starts + size_of::<Block>() as u64 * self.blocks + 2 * self.words
    }
}

/// A cell while it is built.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct CellWork {
    /// How often its blocks are doubled.
    pub level: u64,
    /// What it takes of each table.
    pub lengths: Lengths,
    /// Its light.
    pub light: f64,
    /// The variance that coarser grids add, times the light.
    pub variance: f64,
}

/// The steps of a block's grid along columns and rows: a cell of the grid is 2^step patches wide.
pub type Steps = [u8; 2];

/// The blocks of a cell at a level of doubling.
#[derive(Clone, Copy, Debug)]
pub struct CellBlocks {
    /// The face.
    pub face: u32,
    /// The first patch.
    pub origin: [u32; 2],
    /// The patches.
    pub patches: [u32; 2],
    /// log2 of the patches along a side of a block.
    pub side: [u32; 2],
}

impl CellBlocks {
    /// Cell `index` of a plan, with blocks doubled `level` times.
    pub fn new(plan: &Plan, index: u32, level: u32) -> CellBlocks {
        let (face, origin, patches) = plan.cell(index);
        CellBlocks { face, origin, patches, side: plan.block_side(level) }
    }

    /// Blocks along columns and rows.
    pub fn blocks(&self) -> [u32; 2] {
        [0, 1].map(|k: usize| self.patches[k].div_ceil(1 << self.side[k]))
    }

    /// What is stored of it, but for its probability and where its tables are.
    pub fn record(&self) -> Cell {
        Cell {
            origin: self.origin.map(|n| n as u16),
            patches: self.patches.map(|n| n as u16),
            blocks: self.blocks().map(|n| n as u16),
            side: self.side.map(|n| n as u8),
            face: self.face as u8,
            ..Cell::default()
        }
    }

    /// The number of blocks.
    pub fn count(&self) -> usize {
        let [columns, rows] = self.blocks();
        columns as usize * rows as usize
    }

    /// The rectangle of block `number` with a grid of these steps.
    pub fn tile(&self, number: usize, steps: Steps) -> Tile {
        let columns = self.blocks()[0].max(1) as usize;
        let at = [(number % columns) as u32, (number / columns) as u32];
        let origin = [0, 1].map(|k: usize| self.origin[k] + (at[k] << self.side[k]));
        let end = [0, 1].map(|k: usize| (origin[k] + (1 << self.side[k])).min(self.origin[k] + self.patches[k]));
        Tile::new(self.face, [origin, end], steps.map(u32::from))
    }

    /// What the blocks take with a grid of no steps (level 0), in closed form: big maps have many blocks.
    pub fn full(&self, plan: &Plan) -> Lengths {
        let [columns, rows] = self.blocks().map(|n| n as usize);
        let (mut words, side) = (0, self.side.map(|side| 1usize << side));
        let last = [0, 1].map(|k: usize| self.patches[k] as usize - [columns, rows][k].saturating_sub(1) * side[k]);
        for (count_x, grid_x) in [(columns.saturating_sub(1), side[0]), (1, last[0])] {
            for (count_y, grid_y) in [(rows.saturating_sub(1), side[1]), (1, last[1])] {
                words += count_x * count_y * block_words(plan, [grid_x, grid_y]).iter().sum::<usize>();
            }
        }
        cell_lengths([columns, rows]).plus(Lengths { words: words as u64, ..Lengths::default() })
    }

    /// What the blocks take with these steps.
    pub fn lengths(&self, plan: &Plan, steps: impl Fn(usize) -> Steps) -> Lengths {
        let [columns, rows] = self.blocks().map(|n| n as usize);
        (0..self.count()).fold(cell_lengths([columns, rows]), |sum, number| {
            let grid = self.tile(number, steps(number)).grid.map(|n| n as usize);
            let words = block_words(plan, grid).iter().sum::<usize>() as u64;
            sum.plus(Lengths { words, ..Lengths::default() })
        })
    }
}

/// The starts of a cell of a single block, which all such cells share: they are the first.
pub const SINGLE: [f32; 4] = [0.0, 1.0, 0.0, 1.0];

/// Of each table what a cell with so many columns and rows of blocks takes besides its blocks.
fn cell_lengths([columns, rows]: [usize; 2]) -> Lengths {
    let starts = if rows * columns == 1 { 0 } else { rows + 1 + rows * (columns + 1) };
    Lengths { starts: starts as u64, blocks: (rows * columns) as u64, ..Lengths::default() }
}

/// The words of a block: of its row starts, and of its lines.
fn block_words(plan: &Plan, [columns, rows]: [usize; 2]) -> [usize; 2] {
    let bilinear = plan.of.filter == Filter::Bilinear;
    [row_words(columns, rows), (rows + usize::from(bilinear)) * line_words(columns, bilinear)]
}

/// The corners of a grid as they are stored, in [0, 1] of the brightest. Answers that.
pub(super) fn stored_corners(texels: &Texels<'_>, tile: &Tile, corners: &mut Corners) -> f32 {
    texels.corners(tile, corners);
    let rows = tile.grid[1] as usize + 1;
    let used = |row: &[f32]| row.iter().take(tile.grid[0] as usize + 1).fold(0.0f32, |a, &b| a.max(b));
    let brightest = corners.chunks_exact(BLOCK + 1).take(rows).map(used).fold(0.0f32, f32::max);
    let scale = if brightest > 0.0 { 1.0 / f64::from(brightest) } else { 0.0 };
    let coarse = tile.step != [0, 0];
    for corner in corners.iter_mut() {
        let value = (f64::from(*corner) * scale) as f32;
        *corner = if coarse { value.max(DARKEST_COARSE) } else { value };
    }
    brightest
}

/// Where a cell's tables go: its parts of all tables, and where those begin.
#[derive(Debug)]
pub struct CellTables<'a> {
    /// Where the parts begin.
    pub offset: Lengths,
    /// Starts of block rows, then of the blocks of each row.
    pub starts: &'a mut [f32],
    /// Blocks.
    pub blocks: &'a mut [Block],
    /// Row starts and lines.
    pub words: &'a mut [u16],
    /// Room for the light of each block.
    pub light: &'a mut [f64],
}

/// Writes the tables of a cell: the cell, without its probability, and its light.
pub fn write_cell(texels: &Texels<'_>, index: u32, level: u32, steps: &[Steps], tables: CellTables<'_>) -> (Cell, f64) {
    let cell = CellBlocks::new(texels.plan, index, level);
    let CellTables { offset, starts, blocks, mut words, light } = tables;
    // The room is for the blocks before they are doubled.
    let light = light.get_mut(..cell.count()).unwrap_or_default();
    let mut at = offset.words as u32;
    words.fill(0);
    for (((number, block), light), &steps) in (0..cell.count()).zip(blocks.iter_mut()).zip(light.iter_mut()).zip(steps)
    {
        let tile = cell.tile(number, steps);
        let [row_words, line_words] = block_words(texels.plan, tile.grid.map(|n| n as usize));
        let (rows, rest) = core::mem::take(&mut words).split_at_mut_checked(row_words).unwrap_or_default();
        let (lines, rest) = rest.split_at_mut_checked(line_words).unwrap_or_default();
        words = rest;
        let (of_block, to_ends) = write_masses(texels, &tile, rows, lines);
        let bilinear = texels.plan.of.filter == Filter::Bilinear;
        let brightest = if bilinear { write_corners(texels, &tile, lines) } else { 0.0 };
        *light = of_block;
        *block = Block {
            rows: at,
            brightest,
            share: 0.0,
            grid: tile.grid.map(|n| n as u8),
            steps: steps[0] | steps[1] << 4,
            to_ends: u8::from(to_ends),
        };
        at += (row_words + line_words) as u32;
    }
    let total = write_cell_starts(&cell, light, starts, blocks);
    let starts = if cell.count() == 1 { 0 } else { offset.starts as u32 };
    (Cell { starts, first: offset.blocks as u32, ..cell.record() }, total)
}

fn write_cell_starts(cell: &CellBlocks, light: &[f64], starts: &mut [f32], blocks: &mut [Block]) -> f64 {
    if let ([block], &[light]) = (&mut *blocks, light) {
        block.share = 1.0;
        return light;
    }
    let light = |number: usize| light.get(number).copied().unwrap_or(0.0);
    write_tables(cell.blocks(), &light, starts, &mut |number, share| {
        if let Some(block) = blocks.get_mut(number) {
            block.share = share;
        }
    })
}

/// Writes the starts of rows, then of the columns of each row, for the light of each of their cells, and hands over the share of each.
/// Answers the light of all.
pub(super) fn write_tables(
    grid: [u32; 2],
    light: &dyn Fn(usize) -> f64,
    starts: &mut [f32],
    put: &mut dyn FnMut(usize, f32),
) -> f64 {
    let [columns, rows] = grid.map(|n| n as usize);
    let (row_starts, column_starts) = starts.split_at_mut_checked(rows + 1).unwrap_or_default();
    let row = |j: usize| (j * columns..(j + 1) * columns).map(light);
    let all = write_table((0..rows).map(|j| row(j).sum()), row_starts);
    for (j, starts) in column_starts.chunks_exact_mut((columns + 1).max(1)).enumerate() {
        write_table(row(j), starts);
        let [top, bottom] = stored_cell(row_starts, j);
        for i in 0..columns {
            let [left, right] = stored_cell(starts, i);
            put(j * columns + i, (bottom - top) * (right - left));
        }
    }
    all
}

/// Writes the row starts and the column starts of a block; answers its light, and whether its words lie closer towards the ends. A function
/// of its own, as that of corners: both share the stack.
#[inline(never)]
fn write_masses(texels: &Texels<'_>, tile: &Tile, rows: &mut [u16], lines: &mut [u16]) -> (f64, bool) {
    let bilinear = texels.plan.of.filter == Filter::Bilinear;
    let [grid_columns, grid_rows] = tile.grid.map(|n| n as usize);
    let mut mass: PatchValues = [0.0; BLOCK * BLOCK];
    if tile.step == [0, 0] {
        patch_masses(texels, tile, &mut mass);
    } else {
        coarse_masses(texels, tile, &mut mass);
    }
    let mut row_mass = [0.0; BLOCK];
    for (out, row) in row_mass.iter_mut().zip(mass.chunks_exact(BLOCK)).take(grid_rows) {
        *out = row.iter().take(grid_columns).sum();
    }
    let used = row_mass.get(..grid_rows).unwrap_or(&[]);
    let total: f64 = used.iter().sum();
    // Evenly spaced words give too much to others where a patch has much of the light.
    let to_ends = 16.0 * mass.iter().fold(0.0f64, |a, &b| a.max(b)) > total && {
        // The variance that each spacing adds, rows and the columns of each.
        let added = |to_ends: bool| {
            let each = used.iter().zip(mass.chunks_exact(BLOCK)).map(|(of_row, row)| {
                let row = row.get(..grid_columns).unwrap_or(&[]);
                of_row * variance16(row, &words16(row, to_ends), to_ends)
            });
            total * variance16(used, &words16(used, to_ends), to_ends) + each.sum::<f64>()
        };
        added(true) < added(false)
    };
    put_inner(rows, &words16(used, to_ends), grid_rows);
    let words = line_words(grid_columns, bilinear);
    let corners = if bilinear { grid_columns + 1 } else { 0 };
    for (line, row) in lines.chunks_exact_mut(words.max(1)).zip(mass.chunks_exact(BLOCK)).take(grid_rows) {
        let line = line.get_mut(corners..).unwrap_or_default();
        put_inner(line, &words16(row.get(..grid_columns).unwrap_or(&[]), to_ends), grid_columns);
    }
    (total, to_ends)
}

/// Writes the corners of a block. Answers the brightest.
#[inline(never)]
fn write_corners(texels: &Texels<'_>, tile: &Tile, lines: &mut [u16]) -> f32 {
    let [grid_columns, grid_rows] = tile.grid.map(|n| n as usize);
    let words = line_words(grid_columns, true);
    let mut corners: Corners = [0.0; (BLOCK + 1) * (BLOCK + 1)];
    let brightest = stored_corners(texels, tile, &mut corners) / decode(encode(1.0));
    for (line, row) in lines.chunks_exact_mut(words.max(1)).zip(corners.chunks_exact(BLOCK + 1)).take(grid_rows + 1) {
        for (out, &corner) in line.iter_mut().zip(row).take(grid_columns + 1) {
            *out = encode(corner);
        }
    }
    brightest
}

/// The light of each patch of a tile of single patches. A function of its own, which both kinds of tiles share.
#[inline(never)]
fn patch_masses(texels: &Texels<'_>, tile: &Tile, mass: &mut PatchValues) {
    texels.each_patch(tile, |[i, j], _, _, light| {
        if let Some(out) = mass.get_mut(j as usize * BLOCK + i as usize) {
            *out = light;
        }
    });
}

/// The light of each cell of a tile's grid.
#[inline(never)]
fn coarse_masses(texels: &Texels<'_>, tile: &Tile, mass: &mut PatchValues) {
    let mut patches: PatchValues = [0.0; BLOCK * BLOCK];
    let rows = mass.chunks_exact_mut(BLOCK).flat_map(|row| row.iter_mut().take(tile.grid[0] as usize));
    for (out, cell) in rows.zip(tile.cells()) {
        for part in cell.parts() {
            patch_masses(texels, &part, &mut patches);
            let [columns, rows] = part.grid.map(|n| n as usize);
            let rows = patches.chunks_exact(BLOCK).take(rows);
            *out = rows.flat_map(|row| row.iter().take(columns)).fold(*out, |sum, light| sum + light);
        }
    }
}

/// Writes a 16-bit table of so many cells; the first start, 0, is not stored.
fn put_inner(out: &mut [u16], words: &Words, count: usize) {
    for (out, &word) in out.iter_mut().zip(words.iter().skip(1)).take(count.saturating_sub(1)) {
        *out = word;
    }
}
