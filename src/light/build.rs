//! The passes of a build: rows of texels, then the choice of grids, then the tables of cells. Threads may share rows and cells in any
//! portions: each has elements of its own in every array that the pass writes, and what a pass reads, an earlier one wrote.

use super::blocks::{CellBlocks, CellTables, Lengths, SINGLE, Steps, write_cell};
use super::budget::{Choice, choose};
use super::decode::RowSummary;
use super::map;
use super::plan::Plan;
use super::search::{stored_cell, write_table};
use super::strata;
use super::tables::Cell;
use super::texels::{Texels, row_weights};
use crate::numeric::luminance_f64;
use crate::object::{Layout, Part};
use bytemuck::{Pod, Zeroable};
use core::f64::consts::PI;

/// No cell is darker than this share of the mean, unless black is to stay black.
const FLOOR: f64 = 1.0 / 65536.0;
/// Nor darker than this where there is light at all: compensation leaves a 64th, the mean of two texels at a pole adds halves, and none of
/// these may round to 0.
const LEAST: f32 = f32::from_bits(2 * 64);

/// What is known when all rows are decoded.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Totals {
    /// The mean luminance over the sphere.
    pub mean: f64,
    /// The largest luminance times solid angle of a texel.
    pub brightest: f64,
    /// Texels that were negative, or replaced.
    pub sanitised: u64,
}

impl Totals {
    /// The totals of all rows.
    pub fn of(rows: &[RowSummary]) -> Totals {
        let mut totals = Totals::default();
        let mut sum = RowSummary::default();
        for row in rows {
            totals.brightest = totals.brightest.max(row.brightest);
            totals.sanitised += row.sanitised;
            sum.light += row.light;
            sum.angle += row.angle;
        }
        totals.mean = if sum.angle > 0.0 { sum.light / sum.angle } else { 0.0 };
        totals
    }

    /// The luminances as light.
    pub fn texels<'a>(&self, plan: &'a Plan, luminance: &'a [f32], rows: &'a [[f64; 2]]) -> Texels<'a> {
        let lifts = !plan.of.exact_zero && self.mean > 0.0;
        let least = if lifts { ((self.mean * FLOOR) as f32).max(LEAST) } else { 0.0 };
        Texels { plan, luminance, rows, least, mean: self.mean as f32 }
    }
}

/// A cell while it is built.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct CellWork {
    /// How often its blocks are doubled.
    pub level: u64,
    /// What it takes of each table: starts, blocks, words, groups of the texel map.
    pub lengths: [u64; 4],
    /// Its light.
    pub light: f64,
    /// The variance that coarser grids add, times the light.
    pub variance: f64,
}

impl CellWork {
    /// What the cell takes.
    pub fn lengths(&self) -> Lengths {
        let [starts, blocks, words, groups] = self.lengths.map(|n| n as usize);
        Lengths { starts, blocks, words, groups }
    }
}

/// What stands before the tables of the cells.
fn shared() -> Lengths {
    Lengths { starts: SINGLE.len(), ..Lengths::default() }
}

/// The tables of all cells of a plan without a budget: the most that any build of it takes.
pub fn full_lengths(plan: &Plan) -> Lengths {
    (0..plan.cells()).fold(shared(), |sum, index| {
        let tiles = Lengths { groups: map::full_groups(plan, index), ..Lengths::default() };
        let exact = CellBlocks::new(plan, index, 0).full(plan);
        sum.plus(if plan.of.rays_only { Lengths::default() } else { exact }).plus(tiles)
    })
}

/// The blocks of cell `index` before they are doubled, and those of all cells before it.
pub fn block_range(plan: &Plan, index: u32) -> (usize, usize) {
    let count = |index: u32| if plan.of.rays_only { 0 } else { CellBlocks::new(plan, index, 0).count() };
    ((0..index).map(count).sum(), count(index))
}

/// Before the second pass: the weights of each row of patches.
pub fn weights(plan: &Plan, weights: &mut [[f64; 2]]) {
    for (y, out) in (0..).zip(weights) {
        *out = row_weights(plan, y);
    }
}

/// The second pass, for a cell.
pub fn choose_cell(texels: &Texels<'_>, index: u32, steps: &mut [Steps], tile_steps: &mut [u8]) -> CellWork {
    let rays_only = texels.plan.of.rays_only;
    let Choice { level, lengths, variance } = if rays_only { Choice::default() } else { choose(texels, index, steps) };
    let groups = map::choose(&Texels { plan: &texels.plan.plain(), ..*texels }, index, tile_steps);
    let lengths = [lengths.starts, lengths.blocks, lengths.words, groups].map(|n| n as u64);
    CellWork { level: level.into(), lengths, light: 0.0, variance }
}

/// Where the tables of each cell begin: those of the cells before it.
pub fn offset(work: &[CellWork], index: u32) -> Lengths {
    work.iter().take(index as usize).fold(shared(), |sum, cell| sum.plus(cell.lengths()))
}

/// The third pass, for a cell of a light that has exact tables.
pub fn write(texels: &Texels<'_>, index: u32, work: &CellWork, steps: &[Steps], tables: CellTables<'_>) -> (Cell, f64) {
    write_cell(texels, index, work.level as u32, steps, tables)
}

/// The end: probabilities of cells, and the tables above them. Answers the light of all, which without tables is that of the texels.
pub fn finish(plan: &Plan, totals: &Totals, work: &[CellWork], cells: &mut [Cell], tops: &mut [f32]) -> f64 {
    if plan.of.rays_only {
        return 4.0 * PI * totals.mean;
    }
    let light = |index: usize| work.get(index).map_or(0.0, |cell| cell.light);
    write_tops(plan, light, tops, |index, probability| {
        if let Some(cell) = cells.get_mut(index) {
            cell.probability = probability;
        }
    })
}

/// Writes the starts of the rows of cells, then of the cells of each row, for the light of each cell, and hands over their probabilities.
/// Answers the light of all.
fn write_tops(
    plan: &Plan,
    light: impl Fn(usize) -> f64 + Copy,
    tops: &mut [f32],
    mut put: impl FnMut(usize, f32),
) -> f64 {
    let [columns, rows] = plan.grid.map(|n| n as usize);
    let (row_starts, column_starts) = tops.split_at_mut_checked(rows + 1).unwrap_or_default();
    let row = |j: usize| (j * columns..(j + 1) * columns).map(light);
    let power = write_table((0..rows).map(|j| row(j).sum()), row_starts);
    for (j, starts) in column_starts.chunks_exact_mut((columns + 1).max(1)).enumerate() {
        write_table(row(j), starts);
        let [top, bottom] = stored_cell(row_starts, j);
        for i in 0..columns {
            let [left, right] = stored_cell(starts, i);
            put(j * columns + i, if power > 0.0 { (bottom - top) * (right - left) } else { 0.0 });
        }
    }
    power
}

/// The colour of each cell: its light over the power, as a colour whose luminance is its probability.
pub fn colours(plan: &Plan, rgb: &[[f64; 3]], cells: &[Cell], colours: &mut [[f32; 3]]) {
    let columns = plan.grid[0] as usize;
    let rows_of_face = plan.texels[1];
    let [_, grid_rows] = plan.face_grid();
    for (index, (out, cell)) in colours.iter_mut().zip(cells).enumerate() {
        let (row, column) = ((index / columns.max(1)) as u32, index % columns.max(1));
        let (face, row) = (row / grid_rows.max(1), row % grid_rows.max(1));
        let first = face * rows_of_face + row * rows_of_face / grid_rows.max(1);
        let end = face * rows_of_face + ((row + 1) * rows_of_face).div_ceil(grid_rows.max(1));
        let mut sum = [0.0; 3];
        for y in first..end.max(first + 1) {
            let of = rgb.get(y as usize * columns + column).copied().unwrap_or_default();
            for (sum, c) in sum.iter_mut().zip(of) {
                *sum += c;
            }
        }
        let luminance = luminance_f64(sum);
        let scale = if luminance > 0.0 { f64::from(cell.probability) / luminance } else { 0.0 };
        *out = sum.map(|c| (c * scale) as f32);
        if !(luminance > 0.0) {
            *out = [cell.probability; 3];
        }
    }
}

/// The share of the light that the brightest texel gives.
pub fn largest_share(totals: &Totals) -> f64 {
    let power = totals.mean * 4.0 * PI;
    if power > 0.0 { (totals.brightest / power).min(1.0) } else { 0.0 }
}

/// Rows of texels are decoded; grids of cells are chosen; tables of cells are written.
pub const PASSES: usize = 3;

/// How many items each pass has.
pub fn items(plan: &Plan) -> [u32; PASSES] {
    [plan.rows(), plan.cells(), plan.cells()]
}

/// The first words of a scratch block in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct Begun {
    magic: u64,
    fingerprint: u64,
}

impl Begun {
    /// Those of a build with this fingerprint.
    pub fn new(fingerprint: u64) -> Begun {
        Begun { magic: u64::from_le_bytes(*b"wis-lit\x02"), fingerprint }
    }
}

/// The largest luminance of a row, and the light of a cell, until that item is done.
pub const UNFINISHED: f64 = -1.0;
/// The level of a cell until its grids are chosen.
const UNCHOSEN: u64 = u64::MAX;

/// Where the arrays of a scratch block stand.
#[derive(Clone, Copy, Debug)]
pub struct Arrays {
    /// A [`RowSummary`] of each row.
    pub rows: Part,
    /// The colour of each row in each column of cells.
    pub rgb: Part,
    /// The weights of each row of patches.
    pub weights: Part,
    /// A [`CellWork`] for each cell.
    pub work: Part,
    /// The light of each block.
    pub block_light: Part,
    /// The luminance of each texel.
    pub luminance: Part,
    /// The grid of each block.
    pub steps: Part,
    /// The step of each tile of the texel map, cell by cell.
    pub tile_steps: Part,
    /// The light of each cell.
    pub cell_light: Part,
    /// Of the whole block.
    pub bytes: usize,
}

impl Arrays {
    /// The arrays of a build; `None` if no memory is as long.
    pub fn of(plan: &Plan) -> Option<Arrays> {
        let (rows, cells, blocks) = (u64::from(plan.rows()), u64::from(plan.cells()), full_lengths(plan).blocks as u64);
        // Sums of the strata stand there when all is decoded.
        let luminance = (rows * u64::from(plan.of.width)).max(strata::room(plan) as u64);
        let mut whole = Layout::behind::<Begun>();
        let arrays = Arrays {
            rows: whole.part::<RowSummary>(rows),
            rgb: whole.part::<[f64; 3]>(rows * u64::from(plan.grid[0])),
            weights: whole.part::<[f64; 2]>(plan.chart.axes[1].patches.into()),
            work: whole.part::<CellWork>(cells),
            block_light: whole.part::<f64>(blocks),
            luminance: whole.part::<f32>(luminance),
            steps: whole.part::<Steps>(blocks),
            tile_steps: whole.part::<u8>(map::tile_count(plan) as u64),
            cell_light: whole.part::<f64>(cells),
            bytes: 0,
        };
        Some(Arrays { bytes: whole.bytes()?, ..arrays })
    }
}

/// Marks all items as not done.
pub fn begin(rows: &mut [RowSummary], work: &mut [CellWork], cell_light: &mut [f64]) {
    rows.fill(RowSummary { brightest: UNFINISHED, ..RowSummary::default() });
    work.fill(CellWork { level: UNCHOSEN, ..CellWork::default() });
    cell_light.fill(UNFINISHED);
}

/// Whether all rows are decoded.
pub fn decoded(rows: &[RowSummary]) -> bool {
    rows.iter().all(|row| row.brightest != UNFINISHED)
}

/// Whether the grids of all cells are chosen.
pub fn chosen(work: &[CellWork]) -> bool {
    work.iter().all(|cell| cell.level != UNCHOSEN)
}

/// Whether the tables of all cells are written.
pub fn written(cell_light: &[f64]) -> bool {
    cell_light.iter().all(|light| *light != UNFINISHED)
}
