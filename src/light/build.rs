//! The passes of a build: rows of texels, then the choice of grids, then the tables of cells. Threads may share rows and cells in any
//! portions: each has elements of its own in every array that the pass writes, and what a pass reads, an earlier one wrote.

pub use super::blocks::CellWork;
use super::blocks::{CellBlocks, Lengths, SINGLE, Steps, write_tables};
use super::budget::choose;
use super::environment::{self, BILINEAR, Environment, Header, SWITCHES, Sections, header_mut, tops};
use super::guide::{self, CellGuide};
use super::map;
use super::pixels::RowSummary;
use super::plan::{Filter, Plan};
use super::strata::{self, StandIn};
use super::tables::{Block, Cell};
use super::texels::{Texels, row_weights};
use crate::blob::{Layout, Magic, Part, Size, write_header};
use crate::numeric::luminance_f64;
use crate::sphere::Frame;
use crate::status::{Result, Status};
use bytemuck::Zeroable;
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

/// What stands before the tables of the cells.
fn shared() -> Lengths {
    Lengths { starts: SINGLE.len() as u64, ..Lengths::default() }
}

/// The tables of all cells of a plan without a budget: the most that any build of it takes.
pub fn full_lengths(plan: &Plan) -> Lengths {
    (0..plan.cells()).fold(shared(), |sum, index| {
        let tiles = Lengths { groups: map::full_groups(plan, index), ..Lengths::default() };
        let exact = if plan.of.is_exact() { CellBlocks::new(plan, index, 0).full(plan) } else { Lengths::default() };
        sum.plus(exact).plus(tiles)
    })
}

impl Plan {
    /// What a build of this plan takes at most.
    ///
    /// # Errors
    /// [`Status::Overflow`] if no memory can hold it.
    pub fn size(&self) -> Result<Size> {
        let full = full_lengths(self);
        // Positions of words are 32-bit numbers.
        if full.words > u64::from(u32::MAX) {
            return Err(Status::Overflow);
        }
        let sections = Sections::new(self, &full, strata::most(&self.chart)).ok_or(Status::Overflow)?;
        Ok(Size { bytes: sections.end as usize, scratch: Arrays::of(self).ok_or(Status::Overflow)?.bytes })
    }
}

/// The blocks of cell `index` before they are doubled, and those of all cells before it.
pub fn block_range(plan: &Plan, index: u32) -> (usize, usize) {
    let count = |index: u32| if plan.of.is_exact() { CellBlocks::new(plan, index, 0).count() } else { 0 };
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
    let work = if texels.plan.of.is_exact() { choose(texels, index, steps) } else { CellWork::default() };
    let groups = map::choose(&Texels { plan: &texels.plan.plain(), ..*texels }, index, tile_steps);
    CellWork { lengths: Lengths { groups, ..work.lengths }, ..work }
}

/// Where the tables of each cell begin: those of the cells before it.
pub fn offset(work: &[CellWork], index: u32) -> Lengths {
    work.iter().take(index as usize).fold(shared(), |sum, cell| sum.plus(cell.lengths))
}

/// What the passes of a build leave.
pub struct Passed<'a> {
    /// What is built.
    pub plan: &'a Plan,
    /// Of all rows.
    pub totals: &'a Totals,
    /// The cells, with their light.
    pub work: &'a [CellWork],
    /// The colour of each row in each column of cells.
    pub rgb: &'a [[f64; 3]],
    /// From the map's space to the world's.
    pub frame: &'a Frame,
    /// The strata, which are written.
    pub strata: StandIn,
}

impl Passed<'_> {
    /// Where the tables go.
    ///
    /// # Errors
    /// [`Status::Overflow`].
    pub fn sections(plan: &Plan, work: &[CellWork]) -> Result<Sections> {
        Sections::new(plan, &offset(work, plan.cells()), strata::most(&plan.chart)).ok_or(Status::Overflow)
    }

    /// Writes all that is known when cells and strata are written, in memory as long as the sections say. `room`: the luminances, which
    /// nobody reads any more.
    ///
    /// # Errors
    /// [`Status::Overflow`] if the power is not a number.
    pub fn finish(&self, sections: &Sections, memory: &mut [u8], room: &mut [f32]) -> Result<()> {
        self.write_tables(sections, memory);
        let end = sections.strata as usize + self.strata.strata as usize * size_of::<[f32; 4]>();
        let bytes = memory.get_mut(..end).ok_or(Status::Misaligned)?;
        write_guide(self.plan, sections.guide, bytes, room);
        environment::sign(bytes);
        let power = header_mut(bytes).map_or(0.0, |header| header.power);
        if power.is_finite() { Ok(()) } else { Err(Status::Overflow) }
    }

    /// Writes the tables of cells, and the header but for its hashes. Apart, so that its stack is free again.
    #[inline(never)]
    fn write_tables(&self, sections: &Sections, bytes: &mut [u8]) {
        let Passed { plan, totals, work, strata, .. } = *self;
        let (lengths, tiles) = (offset(work, plan.cells()), map::tile_count(plan));
        sections.clear(plan, &lengths, strata::most(&plan.chart), bytes);
        let single: &mut [f32] = Part::at(sections.starts, SINGLE.len() as u64).of_mut(bytes);
        single.iter_mut().zip(SINGLE).for_each(|(out, start)| *out = start);
        let mut power = 4.0 * PI * totals.mean;
        if plan.of.is_exact() {
            for k in 0..2 {
                let small = plan.small_blocks(k);
                let of: &mut [u8] = Part::at(sections.cell_of[k], small.into()).of_mut(bytes);
                for (small, out) in (0..).zip(of) {
                    *out = plan.cell_of(k, small) as u8;
                }
            }
            power = self.write_cells(sections, bytes);
            let blocks: &mut [Block] = Part::at(sections.blocks, lengths.blocks).of_mut(bytes);
            for block in blocks {
                // Radiance becomes a share of the power.
                let share = if power > 0.0 { f64::from(block.brightest) / power } else { 0.0 };
                block.brightest = share.min(f64::from(f32::MAX)) as f32;
            }
        }
        let variance: f64 = work.iter().map(|cell| cell.variance).sum();
        let (of, axis) = (&plan.of, plan.chart.axes);
        let words = map::words(plan, lengths.groups);
        let stand_in = StandIn { words, tiles: tiles as u32, tile_side: map::tile_side(plan), ..strata };
        let end = sections.strata + u64::from(strata.strata) * size_of::<[f32; 4]>() as u64;
        let header = Header {
            magic: Header::MAGIC,
            bytes: end,
            power,
            mean: totals.mean,
            largest_share: if totals.mean > 0.0 { (totals.brightest / (totals.mean * 4.0 * PI)).min(1.0) } else { 0.0 },
            error: if power > 0.0 { libm::sqrt((variance / power).max(0.0)) } else { 0.0 },
            sanitised: totals.sanitised,
            lengths,
            sections: Sections { end, ..*sections },
            stand_in,
            layout: of.layout as u32,
            flags: if of.filter == Filter::Bilinear { BILINEAR } else { 0 } | of.flags(SWITCHES),
            width: of.width,
            height: of.height,
            patches: axis.map(|a| a.patches),
            length: axis.map(|a| a.length),
            shift: axis.map(|a| a.shift),
            offset: plan.chart.offset,
            budget: of.budget,
            grid: plan.grid,
            side: plan.side,
            frame: self.frame.to_array(),
            ..Header::zeroed()
        };
        write_header(bytes, &header);
    }

    /// Writes the tables above the cells, their probabilities and their colours. Answers the light of all.
    fn write_cells(&self, sections: &Sections, bytes: &mut [u8]) -> f64 {
        let plan = self.plan;
        let count = u64::from(plan.cells());
        let (above, rest) = bytes.split_at_mut_checked(sections.cells as usize).unwrap_or_default();
        let colours = Part::at(sections.colours - sections.cells, count);
        let (cells, rest) = rest.split_at_mut_checked(colours.offset).unwrap_or_default();
        let cells: &mut [Cell] = Part::at(0, count).of_mut(cells);
        let light = |index: usize| self.work.get(index).map_or(0.0, |cell| cell.light);
        let tops = Part::at(sections.tops, tops(plan.grid) as u64).of_mut(above);
        let power = write_tables(plan.grid, &light, tops, &mut |index, probability| {
            if let Some(cell) = cells.get_mut(index) {
                cell.probability = probability;
            }
        });
        if !(power > 0.0) {
            cells.iter_mut().for_each(|cell| cell.probability = 0.0);
        }
        write_colours(plan, self.rgb, cells, Part::at(0, count).of_mut(rest));
        power
    }
}

/// Writes the guide of an environment whose tables are complete.
fn write_guide(plan: &Plan, start: u64, bytes: &mut [u8], room: &mut [f32]) {
    let (faces, length) = (plan.chart.faces(), environment::guide_length(plan) as u64);
    if length == 0 || !plan.of.is_exact() {
        return;
    }
    write_corners(plan, Part::at(start, length), bytes);
    for cell in 0..plan.cells() {
        let measured = Environment::view(bytes).map(|environment| CellGuide::of(&environment.light(), cell, room));
        if let Some(measured) = measured {
            guide::write_cell(plan.grid, faces, cell, &measured, Part::at(start, length).of_mut(bytes));
        }
    }
}

/// Writes the corners of the guide. Apart, so that its stack is free again.
#[inline(never)]
fn write_corners(plan: &Plan, guide: Part, bytes: &mut [u8]) {
    let mut corners = [0; 3 * guide::MAX_CORNERS];
    if let Some(environment) = Environment::view(bytes) {
        guide::write_corners(&environment.light(), &mut corners);
    }
    let of = guide::corners_mut(plan.grid, plan.chart.faces(), guide.of_mut(bytes));
    of.iter_mut().zip(&corners).for_each(|(out, &x)| *out = x);
}

/// The colour of each cell: its light over the power, as a colour whose luminance is its probability.
fn write_colours(plan: &Plan, rgb: &[[f64; 3]], cells: &[Cell], colours: &mut [[f32; 3]]) {
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

/// Rows of texels are decoded; grids of cells are chosen; tables of cells are written; rows of the texel map are summed up; strata are
/// begun; parts of them are finished.
pub const PASSES: usize = 6;

/// How many items each pass has.
pub fn items(plan: &Plan) -> [u32; PASSES] {
    [plan.rows(), plan.cells(), plan.cells(), strata::rows(&plan.chart), 1, strata::parts(plan) as u32]
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
    /// The integral of each row of the texel map.
    pub sums: Part,
    /// The [`strata::Begun`].
    pub begun: Part,
    /// What strata of each part add up to.
    pub squares: Part,
    /// 1 for each item that is done, pass by pass.
    pub done: Part,
    /// Of the whole block.
    pub bytes: usize,
}

impl Arrays {
    /// The arrays of a build; `None` if no memory is as long.
    pub fn of(plan: &Plan) -> Option<Arrays> {
        let (rows, cells, blocks) = (u64::from(plan.rows()), u64::from(plan.cells()), full_lengths(plan).blocks);
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
            sums: whole.part::<f64>(strata::rows(&plan.chart).into()),
            begun: whole.part::<strata::Begun>(1),
            squares: whole.part::<f64>(strata::parts(plan) as u64),
            done: whole.part::<u8>(items(plan).iter().map(|&items| u64::from(items)).sum()),
            bytes: 0,
        };
        Some(Arrays { bytes: whole.bytes()?, ..arrays })
    }
}

/// Where tiles and words of the texel map stand.
pub fn texel_map(plan: &Plan, work: &[CellWork], sections: &Sections) -> [Part; 2] {
    let words = map::words(plan, offset(work, plan.cells()).groups);
    [Part::at(sections.tiles, map::tile_count(plan) as u64), Part::at(sections.texels, words)]
}
