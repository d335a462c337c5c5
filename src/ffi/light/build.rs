//! A build at work on the caller's blocks, by one thread or by many (see [`kernel`]): the only one, for C and for Rust. It stands here
//! because threads write side by side into blocks that they know by address.

use super::config::Request;
use crate::blob::{Divided, Part};
use crate::ffi::Checked;
use crate::ffi::memory::block_mut;
use crate::light::blocks::{CellTables, Steps, write_cell};
use crate::light::build::{self as kernel, Arrays, Begun, CellWork, PASSES, Passed, Totals};
use crate::light::environment::Environment;
use crate::light::map;
use crate::light::pixels::{Pixels, RowSummary, Rows, decode_row, missing};
use crate::light::plan::{Filter, Plan};
use crate::light::strata;
use crate::light::tables::{Cell, Light};
use crate::light::texels::Texels;
use crate::sphere::Frame;
use crate::status::{Error, Status};
use core::ffi::c_void;
use core::ops::Range;

impl<'a> Environment<'a> {
    /// Builds an environment from rows of pixels. Memory is aligned to 16.
    ///
    /// # Errors
    /// [`Error`].
    pub fn build_in(
        plan: &Plan,
        pixels: &Pixels,
        frame: &Frame,
        rows: &Rows<'_>,
        memory: &'a mut [u8],
        scratch: &mut [u8],
    ) -> Checked<Environment<'a>> {
        let request = Request { plan: *plan, pixels: *pixels, frame: *frame, flags: 0 };
        let (start, bytes) = (memory.as_mut_ptr().cast(), memory.len());
        // SAFETY: both blocks are borrowed by this call alone.
        unsafe { Build::begin(&request, scratch.as_mut_ptr().cast(), scratch.len(), 4)?.run_all(rows, start, bytes)? };
        Environment::view(memory).ok_or(Error::new(Status::Misaligned, 2))
    }
}

/// A build at work.
pub(super) struct Build<'a> {
    request: &'a Request,
    arrays: Arrays,
    block: Divided,
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
        let block = Divided::new(scratch.cast(), bytes, arrays.bytes, argument)?;
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
            block.all_mut(BEGUN).fill(Begun::new(request.fingerprint()));
            block.all_mut(arrays.done).fill(0u8);
            kernel::weights(&request.plan, block.all_mut(arrays.weights));
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
        let begun = unsafe { build.block.all::<Begun>(BEGUN) } == [Begun::new(request.fingerprint())];
        if begun { Ok(build) } else { Err(Error::new(Status::Mismatch, argument)) }
    }

    /// How many items each pass has.
    pub(super) fn items(&self) -> [u32; PASSES] {
        kernel::items(&self.request.plan)
    }

    fn items_before(&self, pass: usize) -> usize {
        self.items().iter().take(pass).map(|&items| items as usize).sum()
    }

    /// Checks that every item of the passes before this one is done.
    ///
    /// # Safety
    /// No thread is at work on an earlier pass.
    pub(super) unsafe fn require_before(&self, pass: usize) -> Checked<()> {
        // SAFETY: what earlier passes wrote is not written any more.
        let done = unsafe {
            self.block.part::<u8>(self.arrays.done, 0, self.items_before(pass)).iter().all(|done| *done == 1)
        };
        if done { Ok(()) } else { Err(Error::new(Status::Mismatch, self.argument)) }
    }

    /// Does all passes, one after the other.
    ///
    /// # Safety
    /// No other thread uses the blocks.
    pub(super) unsafe fn run_all(&self, rows: &Rows<'_>, memory: *mut c_void, bytes: usize) -> Checked<()> {
        // SAFETY: the caller's contract.
        unsafe {
            for (pass, count) in self.items().into_iter().enumerate() {
                self.run(rows, (memory, bytes), pass, 0..count)?;
            }
            self.finish(memory, bytes)
        }
    }

    /// Works on items of a pass; the object's memory is used from the third one on. Passes are not inlined, so that they share the
    /// stack.
    ///
    /// # Safety
    /// No other thread works on these items, nor on an earlier pass.
    pub(super) unsafe fn run(
        &self,
        rows: &Rows<'_>,
        (memory, bytes): (*mut c_void, usize),
        pass: usize,
        items: Range<u32>,
    ) -> Checked<()> {
        // SAFETY: the caller's contract.
        unsafe {
            match pass {
                0 => items.clone().try_for_each(|y| self.decode(rows, y))?,
                1 => self.choose(items.clone()),
                2 => self.write(memory, bytes, items.clone())?,
                _ => items.clone().try_for_each(|item| self.stratify(memory, bytes, pass, item))?,
            }
            let first = self.items_before(pass) + items.start as usize;
            self.block.part_mut(self.arrays.done, first, items.len()).fill(1u8);
        }
        Ok(())
    }

    /// # Safety
    /// As [`Build::run`].
    #[inline(never)]
    unsafe fn decode(&self, rows: &Rows<'_>, y: u32) -> Checked<()> {
        let Build { request: Request { plan, pixels, .. }, arrays, block, .. } = self;
        let (width, columns, row) = (plan.of.width as usize, plan.grid[0] as usize, y as usize);
        // SAFETY: elements of this row only.
        let (luminance, rgb, summary) = unsafe {
            (
                block.part_mut(arrays.luminance, row * width, width),
                block.part_mut(arrays.rgb, row * columns, columns),
                block.part_mut::<RowSummary>(arrays.rows, row, 1),
            )
        };
        let needed = pixels.row_bytes(plan.of.width).unwrap_or(usize::MAX);
        let bytes = rows(y).and_then(|bytes| bytes.get(..needed)).ok_or(missing(y));
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
                let tile_steps = block.part_mut(arrays.tile_steps, tile, tiles);
                let chosen =
                    kernel::choose_cell(&texels, index, block.part_mut(arrays.steps, first, count), tile_steps);
                block.part_mut::<CellWork>(arrays.work, index as usize, 1).fill(chosen);
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
            let (totals, work) = (self.totals(), block.all::<CellWork>(arrays.work));
            let texels = self.texels(&totals);
            let places = Passed::sections(plan, work).map_err(|status| Error::new(status, 1))?;
            let tables = Divided::new(memory.cast(), bytes, places.end as usize, 2)?;
            let table = |offset: u64| Part::at(offset, 0);
            let plain = plan.plain();
            for index in items {
                if index == 0 {
                    // What all cells share: the first of them writes it.
                    let [tiles, words] = kernel::texel_map(plan, work, &places);
                    map::write_table(plan, block.all(arrays.tile_steps), tables.all_mut(tiles));
                    tables.part_mut::<u16>(words, words.count.saturating_sub(map::PAD), map::PAD).fill(0);
                }
                let (first, count) = kernel::block_range(plan, index);
                let Some(own) = work.get(index as usize) else { continue };
                let (offset, length) = (kernel::offset(work, index), own.lengths);
                let [starts, blocks, words] =
                    [[offset.starts, length.starts], [offset.blocks, length.blocks], [offset.words, length.words]]
                        .map(|[first, count]| (first as usize, count as usize));
                let (tile, tiles) = map::tile_range(plan, index);
                let tile_steps = block.part::<u8>(arrays.tile_steps, tile, tiles);
                for piece in map::pieces(&plain, index, offset.groups, tile_steps) {
                    let words = tables.part_mut(table(places.texels), piece.start, piece.length);
                    map::write(&Texels { plan: &plain, ..texels }, &piece, words);
                }
                let mut cell_light = 0.0;
                if plan.of.is_exact() {
                    let parts = CellTables {
                        offset,
                        starts: tables.part_mut(table(places.starts), starts.0, starts.1),
                        blocks: tables.part_mut(table(places.blocks), blocks.0, blocks.1),
                        words: tables.part_mut(table(places.words), words.0, words.1),
                        light: block.part_mut(arrays.block_light, first, count),
                    };
                    let steps = block.part::<Steps>(arrays.steps, first, count);
                    let (cell, light) = write_cell(&texels, index, own.level as u32, steps, parts);
                    tables.part_mut::<Cell>(table(places.cells), index as usize, 1).fill(cell);
                    cell_light = light;
                }
                block.part_mut(arrays.cell_light, index as usize, 1).fill(cell_light);
            }
        }
        Ok(())
    }

    /// The passes that make strata: sums, the choice of a number, and their parts.
    ///
    /// # Safety
    /// As [`Build::run`]; the first three passes are done in this memory.
    #[inline(never)]
    unsafe fn stratify(&self, memory: *mut c_void, bytes: usize, pass: usize, item: u32) -> Checked<()> {
        let Build { request: Request { plan, .. }, arrays, block, .. } = self;
        let (chart, part) = (&plan.chart, item as usize);
        // SAFETY: what earlier passes wrote is only read; of sums and strata those of this item only are written.
        unsafe {
            let (mean, work) = (self.totals().mean, block.all::<CellWork>(arrays.work));
            let places = Passed::sections(plan, work).map_err(|status| Error::new(status, 1))?;
            let tables = Divided::new(memory.cast(), bytes, places.end as usize, 2)?;
            let [tiles, words] = kernel::texel_map(plan, work, &places);
            let bilinear = plan.of.filter == Filter::Bilinear;
            let light = Light::of_map(*chart, bilinear, map::tile_side(plan), tables.all(words), tables.all(tiles));
            let strata = |first, count| tables.part_mut::<[f32; 4]>(Part::at(places.strata, 0), first, count);
            let room = |(first, count)| block.part_mut::<f32>(arrays.luminance, first, count);
            let done = |array, number| block.part_mut::<f64>(array, part, 1).fill(number);
            if pass == 3 {
                let out = room(strata::row(chart, item));
                done(arrays.sums, strata::sum_row(&light, mean, item, out));
            } else if pass == 4 {
                let (sums, room) = (block.all(arrays.sums), block.all_mut(arrays.luminance));
                let begun = strata::begin(&light, mean, plan, sums, room, strata(0, strata::most(chart)));
                block.all_mut(arrays.begun).fill(begun);
            } else if let [begun] = block.all::<strata::Begun>(arrays.begun) {
                let (first, count) = begun.part(part);
                let pyramid = block.part(arrays.luminance, 0, strata::pyramid(chart));
                let grid = room(strata::grid(chart, part));
                done(arrays.squares, begun.divide(&light, mean, pyramid, grid, strata(first, count)));
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
            let (totals, work) = (self.totals(), block.all_mut::<CellWork>(arrays.work));
            for (work, light) in work.iter_mut().zip(block.all::<f64>(arrays.cell_light)) {
                work.light = *light;
            }
            let [begun] = block.all::<strata::Begun>(arrays.begun) else { return Err(Error::new(Status::Mismatch, 4)) };
            let strata = begun.finish(totals.mean, block.all(arrays.squares));
            let passed = Passed { plan, totals: &totals, work, rgb: block.all(arrays.rgb), frame, strata };
            let of_config = |status| Error::new(status, 1);
            let sections = Passed::sections(plan, work).map_err(of_config)?;
            let memory = block_mut(memory, bytes, sections.end as usize, 2)?;
            passed.finish(&sections, memory, block.all_mut(arrays.luminance)).map_err(of_config)
        }
    }

    /// # Safety
    /// The first pass is done.
    unsafe fn totals(&self) -> Totals {
        // SAFETY: summaries of rows are only read from then on.
        Totals::of(unsafe { self.block.all(self.arrays.rows) })
    }

    /// # Safety
    /// The first pass is done.
    unsafe fn texels<'a>(&'a self, totals: &Totals) -> Texels<'a> {
        // SAFETY: luminance is only read from then on, weights since the beginning.
        let (luminance, weights) =
            unsafe { (self.block.all(self.arrays.luminance), self.block.all(self.arrays.weights)) };
        totals.texels(&self.request.plan, luminance, weights)
    }
}
