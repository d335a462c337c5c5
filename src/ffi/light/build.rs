//! A build at work on the caller's scratch block, by one thread or by many. Each item of a pass (a row of texels, then a cell,
//! then a cell again) has elements of its own in every array that the pass writes; what a pass reads, an earlier one wrote.

use super::super::{Checked, DividedBlock, Failure, WIS_ALIGNMENT, slice_mut};
use super::request::Request;
use super::rows::PixelRows;
use crate::light::blocks::{CellTables, Steps};
use crate::light::build::{self as kernel, CellWork, Totals};
use crate::light::decode::{RowSummary, decode_row};
use crate::light::environment::{BuildError, Places, Scratch, Writer};
use crate::light::pixels::{RowError, Rows};
use crate::light::tables::Cell;
use crate::status::Status;
use core::ffi::c_void;

/// Rows of texels are decoded; grids of cells are chosen; tables of cells are written.
pub(super) const PASSES: usize = 3;

/// The first words of a scratch block in use.
#[repr(C)]
struct ScratchHeader {
    magic: u64,
    fingerprint: u64,
}

const SCRATCH_MAGIC: u64 = u64::from_le_bytes(*b"wis-lit\x02");

/// The largest luminance of a row, and the light of a cell, until that item is done.
const UNFINISHED: f64 = -1.0;
/// The level of a cell until its grids are chosen.
const UNCHOSEN: u64 = u64::MAX;

/// Where the arrays of a scratch block stand, in bytes.
#[derive(Clone, Copy)]
struct Arrays {
    rows: usize,
    rgb: usize,
    weights: usize,
    work: usize,
    block_light: usize,
    luminance: usize,
    steps: usize,
    cell_light: usize,
    bytes: usize,
}

impl Arrays {
    fn of(request: &Request) -> Option<Arrays> {
        let mut end = size_of::<ScratchHeader>();
        let mut array = |(count, size): (usize, usize)| {
            let start = end;
            end = count.checked_mul(size)?.checked_add(start)?.checked_next_multiple_of(WIS_ALIGNMENT)?;
            Some(start)
        };
        let blocks = kernel::full_lengths(&request.plan).blocks;
        let [rows, rgb, weights, work, block_light, luminance, steps] = Scratch::counts(&request.plan, blocks)?;
        let arrays = Arrays {
            rows: array(rows)?,
            rgb: array(rgb)?,
            weights: array(weights)?,
            work: array(work)?,
            block_light: array(block_light)?,
            luminance: array(luminance)?,
            steps: array(steps)?,
            cell_light: array((request.plan.cells() as usize, size_of::<f64>()))?,
            bytes: 0,
        };
        if end > isize::MAX as usize { None } else { Some(Arrays { bytes: end, ..arrays }) }
    }
}

/// Bytes of the object, at most, and of the scratch block.
pub(super) fn sizes(request: &Request) -> Checked<(usize, usize)> {
    let overflow = Failure::new(Status::Overflow, 1);
    let bytes = request.plan.size().map_err(|_| overflow)?.bytes;
    let scratch = Arrays::of(request).ok_or(overflow)?.bytes;
    if bytes > isize::MAX as usize { Err(overflow) } else { Ok((bytes, scratch)) }
}

/// A build at work.
pub(super) struct Build {
    request: Request,
    arrays: Arrays,
    block: DividedBlock,
    /// The number of the scratch block among the arguments; that of the object is 2.
    argument: u32,
}

impl Build {
    fn new(request: Request, scratch: *mut c_void, bytes: usize, argument: u32) -> Checked<Build> {
        let overflow = Failure::new(Status::Overflow, 1);
        request.plan.size().map_err(|_| overflow)?;
        let arrays = Arrays::of(&request).ok_or(overflow)?;
        let block = DividedBlock::new(scratch.cast(), bytes, arrays.bytes, argument)?;
        Ok(Build { request, arrays, block, argument })
    }

    /// Starts a build.
    ///
    /// # Safety
    /// The block is the caller's to write, and nobody else's meanwhile.
    pub(super) unsafe fn begin(request: Request, scratch: *mut c_void, bytes: usize, argument: u32) -> Checked<Build> {
        let build = Build::new(request, scratch, bytes, argument)?;
        let [rows, cells, _] = build.items().map(|count| count as usize);
        let Arrays { rows: at_rows, weights, work, cell_light, .. } = build.arrays;
        // SAFETY: nothing else uses the block yet, and the arrays do not overlap.
        unsafe {
            if let Some(header) = build.block.own::<ScratchHeader>(0, 0, 1).first_mut() {
                *header = ScratchHeader { magic: SCRATCH_MAGIC, fingerprint: request.fingerprint() };
            }
            let unfinished = RowSummary { largest: UNFINISHED, ..RowSummary::default() };
            build.block.own::<RowSummary>(at_rows, 0, rows).fill(unfinished);
            build.block.own::<CellWork>(work, 0, cells).fill(CellWork { level: UNCHOSEN, ..CellWork::default() });
            build.block.own::<f64>(cell_light, 0, cells).fill(UNFINISHED);
            kernel::weights(&request.plan, build.block.own(weights, 0, build.patch_rows()));
        }
        Ok(build)
    }

    /// Goes on with a build that [`Build::begin`] started.
    ///
    /// # Safety
    /// The block may be read, and nobody begins another build in it meanwhile.
    pub(super) unsafe fn go_on(request: Request, scratch: *mut c_void, bytes: usize, argument: u32) -> Checked<Build> {
        let build = Build::new(request, scratch, bytes, argument)?;
        // SAFETY: threads only read the header.
        let begun = unsafe { build.block.finished::<ScratchHeader>(0, 0, 1) }
            .first()
            .is_some_and(|h| h.magic == SCRATCH_MAGIC && h.fingerprint == request.fingerprint());
        if begun { Ok(build) } else { Err(Failure::new(Status::Mismatch, argument)) }
    }

    /// How many items each pass has.
    pub(super) fn items(&self) -> [u32; PASSES] {
        let plan = &self.request.plan;
        [plan.rows(), plan.cells(), plan.cells()]
    }

    /// Checks that every item of the passes before this one is done.
    ///
    /// # Safety
    /// No thread is at work on an earlier pass.
    pub(super) unsafe fn require_before(&self, pass: usize) -> Checked<()> {
        let cells = self.request.plan.cells() as usize;
        // SAFETY: what earlier passes wrote is not written any more.
        let done = unsafe {
            (pass < 1 || self.summaries().iter().all(|row| row.largest != UNFINISHED))
                && (pass < 2 || self.work().iter().all(|cell| cell.level != UNCHOSEN))
                && (pass < 3
                    || self
                        .block
                        .finished::<f64>(self.arrays.cell_light, 0, cells)
                        .iter()
                        .all(|light| *light != UNFINISHED))
        };
        if done { Ok(()) } else { Err(Failure::new(Status::Mismatch, self.argument)) }
    }

    /// Works on items of a pass; the object's memory is written by the last one only. Passes are not inlined, so that they share the
    /// stack.
    ///
    /// # Safety
    /// No other thread works on these items, nor on an earlier pass.
    pub(super) unsafe fn run(
        &self,
        rows: &PixelRows,
        (memory, bytes): (*mut c_void, usize),
        pass: usize,
        items: core::ops::Range<u32>,
    ) -> Checked<()> {
        // SAFETY: the caller's contract.
        unsafe {
            match pass {
                0 => items.into_iter().try_for_each(|y| self.decode(rows, y)),
                1 => {
                    self.choose(items);
                    Ok(())
                }
                _ => self.write(memory, bytes, items),
            }
        }
    }

    /// # Safety
    /// As [`Build::run`].
    #[inline(never)]
    unsafe fn decode(&self, rows: &PixelRows, y: u32) -> Checked<()> {
        let plan = &self.request.plan;
        let (width, columns, row) = (plan.of.width as usize, plan.grid[0] as usize, y as usize);
        // SAFETY: elements of this row only.
        let (luminance, rgb, summary) = unsafe {
            (
                self.block.own::<f32>(self.arrays.luminance, row * width, width),
                self.block.own::<[f64; 3]>(self.arrays.rgb, row * columns, columns),
                self.block.own::<RowSummary>(self.arrays.rows, row, 1),
            )
        };
        let decoded = rows
            .row(y)
            .ok_or(RowError::Missing)
            .and_then(|bytes| decode_row(plan, &self.request.pixels, bytes, y, luminance, rgb))
            .map_err(|error| match error {
                RowError::Missing => Failure::at(error.status(), 1, 0, y).of(c"row"),
                RowError::Texel(texel) => Failure::at(error.status(), 1, texel.x, texel.y).of(c"pixels"),
            })?;
        if let Some(summary) = summary.first_mut() {
            *summary = decoded;
        }
        Ok(())
    }

    /// # Safety
    /// As [`Build::run`]; the first pass is done.
    #[inline(never)]
    unsafe fn choose(&self, items: core::ops::Range<u32>) {
        // SAFETY: what the first pass wrote is only read; of grids and cells those of these items only are written.
        unsafe {
            let totals = Totals::of(self.summaries());
            let texels = totals.texels(&self.request.plan, self.luminance(), self.weights());
            for index in items {
                let (first, count) = kernel::block_range(&self.request.plan, index);
                let steps = self.block.own::<Steps>(self.arrays.steps, first, count);
                if let Some(work) = self.block.own::<CellWork>(self.arrays.work, index as usize, 1).first_mut() {
                    *work = kernel::choose_cell(&texels, index, steps);
                }
            }
        }
    }

    /// # Safety
    /// As [`Build::run`]; the first two passes are done.
    #[inline(never)]
    unsafe fn write(&self, memory: *mut c_void, bytes: usize, items: core::ops::Range<u32>) -> Checked<()> {
        let plan = &self.request.plan;
        // SAFETY: what earlier passes wrote is only read; of all tables the parts of these cells only are written.
        unsafe {
            let (totals, work) = (Totals::of(self.summaries()), self.work());
            let texels = totals.texels(plan, self.luminance(), self.weights());
            let places = Places::new(plan, work).map_err(|status| Failure::new(status, 1))?;
            let tables = DividedBlock::new(memory.cast(), bytes, places.bytes(), 2)?;
            for index in items {
                let (first, count) = kernel::block_range(plan, index);
                let steps = self.block.finished::<Steps>(self.arrays.steps, first, count);
                let light = self.block.own::<f64>(self.arrays.block_light, first, count);
                let Some(own) = work.get(index as usize) else { continue };
                let (offset, length) = (kernel::offset(work, index), own.lengths());
                let parts = CellTables {
                    offset,
                    starts: tables.own(places.starts, offset.starts, length.starts),
                    blocks: tables.own(places.blocks, offset.blocks, length.blocks),
                    words: tables.own(places.words, offset.words, length.words),
                    light,
                };
                let (cell, light) = kernel::write(&texels, index, own, steps, parts);
                if let Some(place) = tables.own::<Cell>(places.cells, index as usize, 1).first_mut() {
                    *place = cell;
                }
                if let Some(place) = self.block.own(self.arrays.cell_light, index as usize, 1).first_mut() {
                    *place = light;
                }
            }
        }
        Ok(())
    }

    /// Writes what is known when all passes are done.
    ///
    /// # Safety
    /// All passes are done in this memory, and no thread is at work.
    pub(super) unsafe fn finish(&self, memory: *mut c_void, bytes: usize) -> Checked<()> {
        let plan = &self.request.plan;
        let (cells, columns) = (plan.cells() as usize, plan.grid[0] as usize);
        // SAFETY: this thread is alone; the arrays do not overlap, and the memory is another block than the scratch.
        unsafe {
            let totals = Totals::of(self.summaries());
            let work = self.block.own::<CellWork>(self.arrays.work, 0, cells);
            let places = Places::new(plan, work).map_err(|status| Failure::new(status, 1))?;
            // Checks the block, which is then as long as it was for the last pass.
            DividedBlock::new(memory.cast(), bytes, places.bytes(), 2)?;
            for (work, light) in work.iter_mut().zip(self.block.finished::<f64>(self.arrays.cell_light, 0, cells)) {
                work.light = *light;
            }
            let rgb = self.block.finished::<[f64; 3]>(self.arrays.rgb, 0, plan.rows() as usize * columns);
            let memory = slice_mut(memory.cast::<u8>(), places.bytes(), 2)?;
            let writer = Writer::new(plan, work, memory).map_err(failure)?;
            writer.finish(&totals, work, rgb, &self.request.frame).map_err(|status| Failure::new(status, 1))
        }
    }

    fn patch_rows(&self) -> usize {
        self.request.plan.chart.axes[1].patches as usize
    }

    /// # Safety
    /// The build has begun.
    unsafe fn weights<'a>(&self) -> &'a [[f64; 2]] {
        // SAFETY: written before the first pass, and only read from then on.
        unsafe { self.block.finished(self.arrays.weights, 0, self.patch_rows()) }
    }

    /// # Safety
    /// The first pass is done.
    unsafe fn luminance<'a>(&self) -> &'a [f32] {
        let plan = &self.request.plan;
        // SAFETY: only read from then on.
        unsafe { self.block.finished(self.arrays.luminance, 0, plan.rows() as usize * plan.of.width as usize) }
    }

    /// # Safety
    /// No thread is at work on the first pass.
    unsafe fn summaries<'a>(&self) -> &'a [RowSummary] {
        // SAFETY: only read from then on.
        unsafe { self.block.finished(self.arrays.rows, 0, self.request.plan.rows() as usize) }
    }

    /// # Safety
    /// No thread is at work on the second pass.
    unsafe fn work<'a>(&self) -> &'a [CellWork] {
        // SAFETY: only read from then on.
        unsafe { self.block.finished(self.arrays.work, 0, self.request.plan.cells() as usize) }
    }
}

fn failure(error: BuildError) -> Failure {
    match error {
        BuildError::TooSmall(bytes) => Failure::too_small(2, bytes),
        BuildError::Row(y, error) => Failure::at(error.status(), 1, 0, y),
        BuildError::Status(status) => Failure::new(status, 1),
    }
}
