//! A build at work on the caller's blocks, by one thread or by many (see [`kernel`]): the only one, for C and for Rust. It stands here
//! because threads write side by side into blocks that they know by address.

use super::config::Request;
use crate::ffi::Checked;
use crate::ffi::memory::{DividedBlock, block_mut};
use crate::light::blocks::{CellTables, Steps};
use crate::light::build::{self as kernel, Arrays, Begun, CellWork, PASSES, Totals};
use crate::light::decode::{Pixels, RowSummary, decode_row};
use crate::light::environment::{Environment, Sections, Writer};
use crate::light::map;
use crate::light::pixels::{Rows, missing};
use crate::light::plan::Plan;
use crate::light::tables::Cell;
use crate::light::texels::Texels;
use crate::object::Part;
use crate::sphere::Frame;
use crate::status::{Error, Status};
use core::ffi::c_void;
use core::marker::PhantomData;
use core::ops::Range;

impl<'a> Environment<'a> {
    /// Builds an environment from rows of pixels. Memory is aligned to 16.
    ///
    /// # Errors
    /// [`Error`].
    pub fn build_in<'p>(
        plan: &Plan,
        pixels: &Pixels,
        frame: &Frame,
        row: impl Fn(u32) -> Option<&'p [u8]>,
        memory: &'a mut [u8],
        scratch: &mut [u8],
    ) -> Checked<Environment<'a>> {
        let request = Request { plan: *plan, pixels: *pixels, frame: *frame, flags: 0 };
        let (start, bytes) = (memory.as_mut_ptr().cast(), memory.len());
        // SAFETY: both blocks are borrowed by this call alone.
        unsafe {
            Build::begin(&request, scratch.as_mut_ptr().cast(), scratch.len(), 4)?.run_all(
                &Given(row, PhantomData),
                start,
                bytes,
            )?
        };
        Environment::view(memory).ok_or(Error::new(Status::Misaligned, 2))
    }
}

/// Rows that a function gives.
struct Given<'p, R>(R, PhantomData<&'p [u8]>);

impl<'p, R: Fn(u32) -> Option<&'p [u8]>> Rows for Given<'p, R> {
    fn row(&self, y: u32) -> Option<&[u8]> {
        (self.0)(y)
    }
}

/// A build at work.
pub(super) struct Build<'a> {
    request: &'a Request,
    arrays: Arrays,
    block: DividedBlock,
    /// The number of the scratch block among the arguments; that of the object is 2.
    argument: u32,
}

/// What stands before all arrays.
const BEGUN: Part = Part { offset: 0, count: 1 };

impl<'r> Build<'r> {
    fn new(request: &'r Request, scratch: *mut c_void, bytes: usize, argument: u32) -> Checked<Build<'r>> {
        let overflow = Error::new(Status::Overflow, 1);
        request.plan.size().map_err(|_| overflow)?;
        let arrays = Arrays::of(&request.plan).ok_or(overflow)?;
        let block = DividedBlock::new(scratch.cast(), bytes, arrays.bytes, argument)?;
        Ok(Build { request, arrays, block, argument })
    }

    /// Starts a build.
    ///
    /// # Safety
    /// The block is the caller's to write, and nobody else's meanwhile.
    pub(super) unsafe fn begin(
        request: &'r Request,
        scratch: *mut c_void,
        bytes: usize,
        argument: u32,
    ) -> Checked<Build<'r>> {
        let build = Build::new(request, scratch, bytes, argument)?;
        let Build { arrays, block, .. } = &build;
        // SAFETY: nothing else uses the block yet, and the arrays do not overlap.
        unsafe {
            block.all(BEGUN).fill(Begun::new(request.fingerprint()));
            kernel::begin(block.all(arrays.rows), block.all(arrays.work), block.all(arrays.cell_light));
            kernel::weights(&request.plan, block.all(arrays.weights));
        }
        Ok(build)
    }

    /// Goes on with a build that [`Build::begin`] started.
    ///
    /// # Safety
    /// The block may be read, and nobody begins another build in it meanwhile.
    pub(super) unsafe fn go_on(
        request: &'r Request,
        scratch: *mut c_void,
        bytes: usize,
        argument: u32,
    ) -> Checked<Build<'r>> {
        let build = Build::new(request, scratch, bytes, argument)?;
        // SAFETY: threads only read the header.
        let begun = unsafe { build.block.finished().all::<Begun>(BEGUN) } == [Begun::new(request.fingerprint())];
        if begun { Ok(build) } else { Err(Error::new(Status::Mismatch, argument)) }
    }

    /// How many items each pass has.
    pub(super) fn items(&self) -> [u32; PASSES] {
        kernel::items(&self.request.plan)
    }

    /// Checks that every item of the passes before this one is done.
    ///
    /// # Safety
    /// No thread is at work on an earlier pass.
    pub(super) unsafe fn require_before(&self, pass: usize) -> Checked<()> {
        let Build { arrays, block, .. } = self;
        // SAFETY: what earlier passes wrote is not written any more.
        let done = unsafe {
            (pass < 1 || kernel::decoded(block.finished().all(arrays.rows)))
                && (pass < 2 || kernel::chosen(block.finished().all(arrays.work)))
                && (pass < 3 || kernel::written(block.finished().all(arrays.cell_light)))
        };
        if done { Ok(()) } else { Err(Error::new(Status::Mismatch, self.argument)) }
    }

    /// Does all passes, one after the other.
    ///
    /// # Safety
    /// No other thread uses the blocks.
    pub(super) unsafe fn run_all(&self, rows: &impl Rows, memory: *mut c_void, bytes: usize) -> Checked<()> {
        // SAFETY: the caller's contract.
        unsafe {
            for (pass, count) in self.items().into_iter().enumerate() {
                self.run(rows, (memory, bytes), pass, 0..count)?;
            }
            self.finish(memory, bytes)
        }
    }

    /// Works on items of a pass; the object's memory is written by the last one only. Passes are not inlined, so that they share the
    /// stack.
    ///
    /// # Safety
    /// No other thread works on these items, nor on an earlier pass.
    pub(super) unsafe fn run(
        &self,
        rows: &impl Rows,
        (memory, bytes): (*mut c_void, usize),
        pass: usize,
        items: Range<u32>,
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
    unsafe fn decode(&self, rows: &impl Rows, y: u32) -> Checked<()> {
        let Build { request: Request { plan, pixels, .. }, arrays, block, .. } = self;
        let (width, columns, row) = (plan.of.width as usize, plan.grid[0] as usize, y as usize);
        // SAFETY: elements of this row only.
        let (luminance, rgb, summary) = unsafe {
            (
                block.part(arrays.luminance, row * width, width),
                block.part(arrays.rgb, row * columns, columns),
                block.part::<RowSummary>(arrays.rows, row, 1),
            )
        };
        let needed = pixels.row_bytes(plan.of.width).unwrap_or(usize::MAX);
        let bytes = rows.row(y).and_then(|bytes| bytes.get(..needed)).ok_or(missing(y));
        let decoded = bytes.and_then(|bytes| decode_row(plan, pixels, bytes, y, luminance, rgb));
        summary.fill(decoded.map_err(|error| error.instead(1))?);
        Ok(())
    }

    /// # Safety
    /// As [`Build::run`]; the first pass is done.
    #[inline(never)]
    unsafe fn choose(&self, items: Range<u32>) {
        let Build { request: Request { plan, .. }, arrays, block, .. } = self;
        // SAFETY: what the first pass wrote is only read; of grids and cells those of these items only are written.
        unsafe {
            let totals = self.totals();
            let texels = self.texels(&totals);
            for index in items {
                let (first, count) = kernel::block_range(plan, index);
                let (tile, tiles) = map::tile_range(plan, index);
                let tile_steps = block.part(arrays.tile_steps, tile, tiles);
                let chosen = kernel::choose_cell(&texels, index, block.part(arrays.steps, first, count), tile_steps);
                block.part::<CellWork>(arrays.work, index as usize, 1).fill(chosen);
            }
        }
    }

    /// # Safety
    /// As [`Build::run`]; the first two passes are done.
    #[inline(never)]
    unsafe fn write(&self, memory: *mut c_void, bytes: usize, items: Range<u32>) -> Checked<()> {
        let Build { request: Request { plan, .. }, arrays, block, .. } = self;
        // SAFETY: what earlier passes wrote is only read; of all tables the parts of these cells only are written.
        unsafe {
            let (totals, work) = (self.totals(), block.finished().all::<CellWork>(arrays.work));
            let texels = self.texels(&totals);
            let places = Sections::of_cells(plan, work).map_err(|status| Error::new(status, 1))?;
            let tables = DividedBlock::new(memory.cast(), bytes, places.end as usize, 2)?;
            let table = |offset: u64| Part { offset: offset as usize, count: 0 };
            let plain = plan.plain();
            for index in items {
                let (first, count) = kernel::block_range(plan, index);
                let Some(own) = work.get(index as usize) else { continue };
                let (offset, length) = (kernel::offset(work, index), own.lengths());
                let (tile, tiles) = map::tile_range(plan, index);
                let tile_steps = block.finished().part::<u8>(arrays.tile_steps, tile, tiles);
                for piece in map::pieces(&plain, index, offset.groups, tile_steps) {
                    let words = tables.part(table(places.texels), piece.start, piece.length);
                    map::write(&Texels { plan: &plain, ..texels }, &piece, words);
                }
                let mut cell_light = 0.0;
                if !plan.of.rays_only {
                    let parts = CellTables {
                        offset,
                        starts: tables.part(table(places.starts), offset.starts, length.starts),
                        blocks: tables.part(table(places.blocks), offset.blocks, length.blocks),
                        words: tables.part(table(places.words), offset.words, length.words),
                        light: block.part(arrays.block_light, first, count),
                    };
                    let steps = block.finished().part::<Steps>(arrays.steps, first, count);
                    let (cell, light) = kernel::write(&texels, index, own, steps, parts);
                    tables.part::<Cell>(table(places.cells), index as usize, 1).fill(cell);
                    cell_light = light;
                }
                block.part(arrays.cell_light, index as usize, 1).fill(cell_light);
            }
        }
        Ok(())
    }

    /// Writes what is known when all passes are done.
    ///
    /// # Safety
    /// All passes are done in this memory, and no thread is at work.
    pub(super) unsafe fn finish(&self, memory: *mut c_void, bytes: usize) -> Checked<()> {
        let Build { request: Request { plan, frame, .. }, arrays, block, .. } = self;
        // SAFETY: this thread is alone; the arrays do not overlap, and the memory is another block than the scratch.
        unsafe {
            let (totals, work) = (self.totals(), block.all::<CellWork>(arrays.work));
            let places = Sections::of_cells(plan, work).map_err(|status| Error::new(status, 1))?;
            let memory = block_mut(memory, bytes, places.end as usize, 2)?;
            for (work, light) in work.iter_mut().zip(block.finished().all::<f64>(arrays.cell_light)) {
                work.light = *light;
            }
            let writer = Writer::new(plan, work, places, memory);
            let (rgb, room) = (block.finished().all(arrays.rgb), block.all::<f32>(arrays.luminance));
            let tile_steps = block.finished().all::<u8>(arrays.tile_steps);
            let finished = writer.finish(&totals, work, tile_steps, rgb, frame, room);
            finished.map_err(|status| Error::new(status, 1))
        }
    }

    /// # Safety
    /// The first pass is done.
    unsafe fn totals(&self) -> Totals {
        // SAFETY: summaries of rows are only read from then on.
        Totals::of(unsafe { self.block.finished().all(self.arrays.rows) })
    }

    /// # Safety
    /// The first pass is done.
    unsafe fn texels<'a>(&'a self, totals: &Totals) -> Texels<'a> {
        // SAFETY: luminance is only read from then on, weights since the beginning.
        let (luminance, weights) = unsafe {
            (self.block.finished().all(self.arrays.luminance), self.block.finished().all(self.arrays.weights))
        };
        totals.texels(&self.request.plan, luminance, weights)
    }
}
