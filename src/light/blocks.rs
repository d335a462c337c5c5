//! Blocks of patches: which grid the error budget allows, and the 16-bit tables of a block.

use super::plan::{BLOCK_SIDE, Filter, Plan};
use super::search::write_starts;
use super::tables::{BLOCK, Block, Cell, decode, encode, line_words};
use super::texels::{Corners, PatchValues, Texels, Tile};

/// No corner of a coarse grid is darker than this share of the brightest one.
const DARKEST_COARSE: f32 = 1.0 / 1024.0;

/// How much of each table a cell takes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lengths {
    /// In-cell starts.
    pub starts: usize,
    /// Blocks.
    pub blocks: usize,
    /// Words of row starts.
    pub rows: usize,
    /// Words of lines.
    pub lines: usize,
}

impl Lengths {
    /// Both.
    pub fn plus(self, b: Lengths) -> Lengths {
        Lengths {
            starts: self.starts + b.starts,
            blocks: self.blocks + b.blocks,
            rows: self.rows + b.rows,
            lines: self.lines + b.lines,
        }
    }

    /// Bytes of all.
    fn bytes(self) -> usize {
        4 * self.starts + size_of::<Block>() * self.blocks + 2 * (self.rows + self.lines)
    }
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
        let step = steps.map(u32::from);
        let grid = [0, 1].map(|k: usize| (end[k] - origin[k]).div_ceil(1 << step[k]));
        Tile { face: self.face, origin, grid, end, step }
    }

    /// What the blocks take with a grid of no steps (level 0), in closed form: big maps have many blocks.
    pub fn full(&self, plan: &Plan) -> Lengths {
        let bilinear = plan.of.filter == Filter::Bilinear;
        let [columns, rows] = self.blocks().map(|n| n as usize);
        let side = 1usize << self.side[0];
        let last = self.patches[0] as usize - columns.saturating_sub(1) * side;
        let words = columns.saturating_sub(1) * line_words(side, bilinear) + line_words(last, bilinear);
        let lines = self.patches[1] as usize + if bilinear { rows } else { 0 };
        Lengths {
            starts: rows + rows * columns,
            blocks: rows * columns,
            rows: columns * self.patches[1] as usize,
            lines: lines * words,
        }
    }
}

fn block_words(plan: &Plan, tile: &Tile) -> Lengths {
    let bilinear = plan.of.filter == Filter::Bilinear;
    let [columns, rows] = tile.grid.map(|n| n as usize);
    // A row start for each row, of which the first is left out and its place stays empty: a block's 16 fill half a cache line.
    let lines = (rows + usize::from(bilinear)) * line_words(columns, bilinear);
    Lengths { rows, lines, ..Lengths::default() }
}

/// Tiles of at most 16 x 16 single patches that cover a tile.
fn parts(tile: &Tile) -> impl Iterator<Item = Tile> + use<> {
    let tile = *tile;
    let counts = [0, 1].map(|k: usize| (tile.end[k] - tile.origin[k]).div_ceil(BLOCK as u32));
    (0..counts[1]).flat_map(move |j| {
        (0..counts[0]).map(move |i| {
            let origin = [tile.origin[0] + i * BLOCK as u32, tile.origin[1] + j * BLOCK as u32];
            let end = [0, 1].map(|k: usize| (origin[k] + BLOCK as u32).min(tile.end[k]));
            Tile { origin, end, grid: [end[0] - origin[0], end[1] - origin[1]], step: [0, 0], ..tile }
        })
    })
}

/// Calls `each` with the cell of the grid, the position in it (0 to 1), the light and the solid angle of each patch of a tile.
fn for_patches(texels: &Texels<'_>, tile: &Tile, mut each: impl FnMut(usize, [f32; 2], f64, f64)) {
    let (mut mass, mut angle): (PatchValues, PatchValues) = ([0.0; BLOCK * BLOCK], [0.0; BLOCK * BLOCK]);
    for part in parts(tile) {
        texels.masses(&part, &mut mass, &mut angle);
        for j in 0..part.grid[1] {
            for i in 0..part.grid[0] {
                let inside = [part.origin[0] + i - tile.origin[0], part.origin[1] + j - tile.origin[1]];
                let at = [0, 1].map(|k: usize| inside[k] >> tile.step[k]);
                let position = [0, 1].map(|k: usize| {
                    let width = tile.edge(k, at[k] + 1) - tile.edge(k, at[k]);
                    let first = at[k] << tile.step[k];
                    ((inside[k] - first) as f32 + 0.5) / width as f32
                });
                let patch = j as usize * BLOCK + i as usize;
                let (Some(&mass), Some(&angle)) = (mass.get(patch), angle.get(patch)) else { continue };
                each(at[1] as usize * BLOCK + at[0] as usize, position, mass, angle);
            }
        }
    }
}

/// The corners of a grid as they are stored, in [0, 1] of the brightest.
fn stored_corners(texels: &Texels<'_>, tile: &Tile, corners: &mut Corners) {
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
}

/// The value of the corners of cell `at` of a grid at a position inside it.
fn interpolate(corners: &Corners, at: usize, [s, t]: [f32; 2]) -> f64 {
    let first = at / BLOCK * (BLOCK + 1) + at % BLOCK;
    let of = |k: usize| f64::from(corners.get(k).copied().unwrap_or(0.0));
    let (s, t) = (f64::from(s), f64::from(t));
    let upper = of(first) * (1.0 - s) + of(first + 1) * s;
    let lower = of(first + BLOCK + 1) * (1.0 - s) + of(first + BLOCK + 2) * s;
    upper * (1.0 - t) + lower * t
}

/// The light of a tile and the relative variance of L / pdf inside it if a grid of its steps stands for it.
fn error(texels: &Texels<'_>, tile: &Tile) -> (f64, f64) {
    let bilinear = texels.plan.of.filter == Filter::Bilinear;
    let mut corners: Corners = [1.0; (BLOCK + 1) * (BLOCK + 1)];
    if bilinear {
        stored_corners(texels, tile, &mut corners);
    }
    let (mut light, mut shape): (PatchValues, PatchValues) = ([0.0; BLOCK * BLOCK], [0.0; BLOCK * BLOCK]);
    for_patches(texels, tile, |at, position, mass, angle| {
        if let (Some(light), Some(shape)) = (light.get_mut(at), shape.get_mut(at)) {
            *light += mass;
            *shape += interpolate(&corners, at, position) * angle;
        }
    });
    let total: f64 = light.iter().sum();
    let mut square = 0.0;
    for_patches(texels, tile, |at, position, mass, angle| {
        if mass > 0.0 {
            let (light, shape) = (light.get(at).copied().unwrap_or(0.0), shape.get(at).copied().unwrap_or(0.0));
            square += mass * mass * shape / (light * interpolate(&corners, at, position) * angle);
        }
    });
    (total, if total > 0.0 { square / total - 1.0 } else { 0.0 })
}

/// The coarsest grid of a block that the budget allows, with the light of the block and its relative variance: the fewest
/// words first. `None` if none with at most 16 x 16 cells does.
fn coarsest(texels: &Texels<'_>, cell: &CellBlocks, number: usize) -> Option<(Steps, f64, f64)> {
    let allowed = f64::from(texels.plan.of.budget) * f64::from(texels.plan.of.budget);
    let least = cell.side.map(|side| side.saturating_sub(BLOCK_SIDE));
    // Sums of both steps from the most on; of equal sums the most balanced first.
    let most = cell.side[0] + cell.side[1];
    for sum in (least[0] + least[1]..=most).rev() {
        for across in least[0].max(sum.saturating_sub(cell.side[1]))..=cell.side[0].min(sum) {
            let down = sum - across;
            if down < least[1] {
                continue;
            }
            let steps = [across as u8, down as u8];
            let exact = steps == [0, 0];
            let (light, variance) = error(texels, &cell.tile(number, steps));
            if variance <= allowed || exact {
                return Some((steps, light, if exact { 0.0 } else { variance.max(0.0) }));
            }
        }
    }
    None
}

/// What the budget makes of a cell.
#[derive(Clone, Copy, Debug, Default)]
pub struct Choice {
    /// How often its blocks are doubled.
    pub level: u32,
    /// What it takes.
    pub lengths: Lengths,
    /// Its light.
    pub light: f64,
    /// The variance that coarser grids add, times the light.
    pub variance: f64,
}

/// Chooses the level and the grids of a cell; `steps` has room for those of its blocks at level 0.
pub fn choose(texels: &Texels<'_>, index: u32, steps: &mut [Steps]) -> Choice {
    let plan = texels.plan;
    let exact = CellBlocks::new(plan, index, 0);
    if !(plan.of.budget > 0.0) {
        steps.fill([0, 0]);
        return Choice { lengths: exact.full(plan), ..Choice::default() };
    }
    // At level 0 the exact grid is always allowed, so there is a choice.
    let choices = (0..=plan.levels(exact.patches)).filter_map(|level| choose_at(texels, index, level));
    let best = choices.min_by_key(|choice| choice.lengths.bytes()).unwrap_or_default();
    let cell = CellBlocks::new(plan, index, best.level);
    for (number, out) in (0..cell.count()).zip(steps) {
        *out = coarsest(texels, &cell, number).map_or([0, 0], |(steps, ..)| steps);
    }
    best
}

fn choose_at(texels: &Texels<'_>, index: u32, level: u32) -> Option<Choice> {
    let cell = CellBlocks::new(texels.plan, index, level);
    let [columns, rows] = cell.blocks().map(|n| n as usize);
    let empty = Lengths { starts: rows + rows * columns, blocks: rows * columns, ..Lengths::default() };
    let mut choice = Choice { level, lengths: empty, light: 0.0, variance: 0.0 };
    for number in 0..cell.count() {
        let (steps, light, variance) = coarsest(texels, &cell, number)?;
        choice.lengths = choice.lengths.plus(block_words(texels.plan, &cell.tile(number, steps)));
        choice.light += light;
        choice.variance += variance * light;
    }
    Some(choice)
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
    /// Row starts.
    pub rows: &'a mut [u16],
    /// Lines.
    pub lines: &'a mut [u16],
    /// Room for the light of each block.
    pub light: &'a mut [f64],
}

/// Writes the tables of a cell: the cell, without its probability, and its light.
pub fn write_cell(texels: &Texels<'_>, index: u32, level: u32, steps: &[Steps], tables: CellTables<'_>) -> (Cell, f64) {
    let cell = CellBlocks::new(texels.plan, index, level);
    let CellTables { offset, starts, blocks, mut rows, mut lines, light } = tables;
    // The room is for the blocks before they are doubled.
    let light = light.get_mut(..cell.count()).unwrap_or_default();
    let (mut row_words, mut line_words) = (offset.rows, offset.lines);
    rows.fill(0);
    lines.fill(0);
    for (((number, block), light), &steps) in (0..cell.count()).zip(blocks.iter_mut()).zip(light.iter_mut()).zip(steps)
    {
        let tile = cell.tile(number, steps);
        let words = block_words(texels.plan, &tile);
        let (row_part, other_rows) = core::mem::take(&mut rows).split_at_mut_checked(words.rows).unwrap_or_default();
        let (line_part, other_lines) =
            core::mem::take(&mut lines).split_at_mut_checked(words.lines).unwrap_or_default();
        (rows, lines) = (other_rows, other_lines);
        *light = write_block(texels, &tile, row_part, line_part);
        *block = Block {
            rows: row_words as u32,
            lines: line_words as u32,
            share: 0.0,
            grid: tile.grid.map(|n| n as u8),
            step: steps,
        };
        row_words += words.rows;
        line_words += words.lines;
    }
    let total = write_cell_starts(&cell, light, starts, blocks);
    let written = Cell {
        origin: cell.origin.map(|n| n as u16),
        patches: cell.patches.map(|n| n as u16),
        blocks: cell.blocks().map(|n| n as u16),
        side: cell.side.map(|n| n as u8),
        face: cell.face as u8,
        reserved: 0,
        starts: offset.starts as u32,
        first: offset.blocks as u32,
        probability: 0.0,
        padding: 0,
    };
    (written, total)
}

/// A probability in f32 tables is a whole number of these, so that differences of starts are exact.
pub const UNIT: f32 = 1.0 / 16_777_216.0;
/// How many there are.
pub const UNITS_24: u32 = 1 << 24;

fn write_cell_starts(cell: &CellBlocks, light: &mut [f64], starts: &mut [f32], blocks: &mut [Block]) -> f64 {
    let [columns, rows] = cell.blocks().map(|n| n as usize);
    let (row_starts, column_starts) = starts.split_at_mut_checked(rows).unwrap_or_default();
    let mut put = |i: usize, units: u32| {
        if let Some(out) = row_starts.get_mut(i) {
            *out = units as f32 * UNIT;
        }
    };
    // The light of each block row.
    let total = write_starts(light.chunks(columns.max(1)).map(|row| row.iter().sum()), UNITS_24, &mut put);
    let lines = column_starts.chunks_exact_mut(columns.max(1)).zip(light.chunks(columns.max(1)));
    for (j, ((starts, light), blocks)) in lines.zip(blocks.chunks_mut(columns.max(1))).enumerate() {
        write_starts(light.iter().copied(), UNITS_24, &mut |i, units| {
            if let Some(out) = starts.get_mut(i) {
                *out = units as f32 * UNIT;
            }
        });
        let row_width = super::search::cell(row_starts, 0, rows, j).1;
        for (i, block) in blocks.iter_mut().enumerate() {
            block.share = row_width * super::search::cell(starts, 0, columns, i).1;
        }
    }
    total
}

/// Writes the row starts and the lines of a block; answers its light.
fn write_block(texels: &Texels<'_>, tile: &Tile, rows: &mut [u16], lines: &mut [u16]) -> f64 {
    let bilinear = texels.plan.of.filter == Filter::Bilinear;
    let [grid_columns, grid_rows] = tile.grid.map(|n| n as usize);
    let mut mass: PatchValues = [0.0; BLOCK * BLOCK];
    if tile.step == [0, 0] {
        let mut angle: PatchValues = [0.0; BLOCK * BLOCK];
        texels.masses(tile, &mut mass, &mut angle);
    } else {
        for_patches(texels, tile, |at, _, light, _| {
            if let Some(out) = mass.get_mut(at) {
                *out += light;
            }
        });
    }
    let mut row_mass = [0.0; BLOCK];
    for (out, row) in row_mass.iter_mut().zip(mass.chunks_exact(BLOCK)).take(grid_rows) {
        *out = row.iter().take(grid_columns).sum();
    }
    let scale = super::search::UNITS as u32;
    let used = row_mass.get(..grid_rows).unwrap_or(&[]);
    write_starts(used.iter().copied(), scale, &mut |i, units| put_inner(rows, i, units));
    let words = line_words(grid_columns, bilinear);
    for (line, row) in lines.chunks_exact_mut(words).zip(mass.chunks_exact(BLOCK)).take(grid_rows) {
        write_starts(row.iter().take(grid_columns).copied(), scale, &mut |i, units| put_inner(line, i, units));
    }
    if bilinear {
        let mut corners: Corners = [0.0; (BLOCK + 1) * (BLOCK + 1)];
        stored_corners(texels, tile, &mut corners);
        for (line, row) in lines.chunks_exact_mut(words).zip(corners.chunks_exact(BLOCK + 1)).take(grid_rows + 1) {
            for (out, &corner) in line.iter_mut().skip(grid_columns - 1).zip(row).take(grid_columns + 1) {
                *out = encode(corner);
            }
        }
    }
    used.iter().sum()
}

/// Writes a start of a 16-bit table; the first, 0, is not stored.
fn put_inner(words: &mut [u16], index: usize, units: u32) {
    if let Some(out) = index.checked_sub(1).and_then(|i| words.get_mut(i)) {
        *out = units as u16;
    }
}

/// The least a stored corner above 0 can be, of the brightest: what [`encode`] leaves.
pub fn darkest_corner() -> f32 {
    decode(1) / decode(encode(1.0))
}
