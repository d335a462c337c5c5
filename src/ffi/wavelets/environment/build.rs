//! A build at work on the caller's scratch block: its layout, its two passes, and the trees at the end.

use super::request::Request;
use super::stored::Stored;
use super::{Environment, EnvironmentInfo, WIS_STORAGE_PYRAMID, WIS_STORAGE_SPARSE, publish};
use crate::ffi::light::rows::PixelRows;
use crate::ffi::{Checked, DividedBlock, ExclusiveBlock, Failure, WIS_ALIGNMENT};
use crate::status::Status;
use crate::wavelets::environment::{
    self as kernel, Decoded, Grid, Header, MAGIC, Refined, Refinement, Row, RowError, RowSummary, Spread, Storage,
    Table, Trees,
};
use crate::wavelets::tree::{Link, Mark};
use core::ffi::c_void;

/// The first words of a scratch block in use.
#[repr(C)]
struct ScratchHeader {
    magic: u64,
    fingerprint: u64,
}

const SCRATCH_MAGIC: u64 = u64::from_le_bytes(*b"wis-bld\x02");

/// The largest luminance of a row of texels, or the first cell of a row, until that row is done.
const UNFINISHED: f64 = -1.0;

/// Where the parts of a scratch block stand; the trees only if they do not go to the environment at once.
#[derive(Clone, Copy)]
pub(super) struct Scratch {
    rows: usize,
    texels: usize,
    texels_rgb: usize,
    cells: usize,
    spread: usize,
    cells_rgb: usize,
    refined: usize,
    marks: usize,
    links: usize,
    plain: usize,
    compensated: usize,
    rgb: usize,
    savings: usize,
    sources: usize,
    pub(super) bytes: usize,
}

impl Scratch {
    pub(super) fn of(request: &Request) -> Option<Scratch> {
        let config = &request.config;
        let mut end = size_of::<ScratchHeader>();
        let mut part = |count: usize, bytes_each: usize| {
            let start = end;
            end = count.checked_mul(bytes_each)?.checked_add(start)?.checked_next_multiple_of(WIS_ALIGNMENT)?;
            Some(start)
        };
        let when = |condition: bool, count: usize| if condition { count } else { 0 };
        let texels = config.texels();
        let cells = config.cells() as usize * config.cells() as usize;
        let squares = when(config.storage == Storage::Sparse, request.squares() as usize);
        let scratch = Scratch {
            rows: part(config.pixels.height as usize, size_of::<RowSummary>())?,
            texels: part(texels, size_of::<f64>())?,
            texels_rgb: part(when(config.rgb, texels), size_of::<[f32; 3]>())?,
            cells: part(cells, size_of::<f64>())?,
            spread: part(when(config.refined, cells), size_of::<Spread>())?,
            cells_rgb: part(when(config.rgb, cells), size_of::<[f32; 3]>())?,
            refined: part(config.room(), size_of::<Refined>())?,
            marks: part(config.marks(), size_of::<Mark>())?,
            links: part(config.room(), size_of::<Link>())?,
            plain: part(squares, size_of::<[f32; 4]>())?,
            compensated: part(when(config.compensated, squares), size_of::<[f32; 4]>())?,
            rgb: part(when(config.rgb, squares), size_of::<[[f32; 3]; 4]>())?,
            savings: part(squares, size_of::<f64>())?,
            sources: part(squares, size_of::<u32>())?,
            bytes: 0,
        };
        if end > isize::MAX as usize { None } else { Some(Scratch { bytes: end, ..scratch }) }
    }
}

/// A build at work on a scratch block.
pub(super) struct Build {
    request: Request,
    scratch: Scratch,
    block: DividedBlock,
}

impl Build {
    fn new(request: Request, scratch: *mut c_void, bytes: usize, argument: u32) -> Checked<Build> {
        let layout = Scratch::of(&request).ok_or(Failure::new(Status::Overflow, 1))?;
        let block = DividedBlock::new(scratch.cast(), bytes, layout.bytes, argument)?;
        Ok(Build { request, scratch: layout, block })
    }

    /// Starts a build.
    ///
    /// # Safety
    /// The block is the caller's to write.
    pub(super) unsafe fn begin(request: Request, scratch: *mut c_void, bytes: usize, argument: u32) -> Checked<Build> {
        let build = Build::new(request, scratch, bytes, argument)?;
        let [texel_rows, cell_rows] = build.rows();
        // SAFETY: the caller's contract; nothing else uses the block yet.
        unsafe {
            if let Some(header) = build.block.own::<ScratchHeader>(0, 0, 1).first_mut() {
                *header = ScratchHeader { magic: SCRATCH_MAGIC, fingerprint: request.fingerprint() };
            }
            let unfinished = RowSummary { largest: UNFINISHED, sanitised: 0 };
            build.block.own::<RowSummary>(build.scratch.rows, 0, texel_rows as usize).fill(unfinished);
            for row in 0..cell_rows {
                build.block.own(build.first_cell(row), 0, 1).fill(UNFINISHED);
            }
        }
        Ok(build)
    }

    /// Goes on with a build that [`Build::begin`] started.
    ///
    /// # Safety
    /// The block holds a build that was begun.
    pub(super) unsafe fn go_on(request: Request, scratch: *mut c_void, bytes: usize, argument: u32) -> Checked<Build> {
        let build = Build::new(request, scratch, bytes, argument)?;
        // SAFETY: the caller's contract; threads only read the header.
        let begun = unsafe { build.block.finished::<ScratchHeader>(0, 0, 1) }
            .first()
            .is_some_and(|h| h.magic == SCRATCH_MAGIC && h.fingerprint == request.fingerprint());
        if begun { Ok(build) } else { Err(Failure::new(Status::Mismatch, argument)) }
    }

    /// Checks that every row of a pass is done.
    ///
    /// # Safety
    /// No thread is at work on that pass.
    pub(super) unsafe fn require(&self, pass: u32, scratch_argument: u32) -> Checked<()> {
        let [_, cell_rows] = self.rows();
        // SAFETY: the caller's contract.
        let done = unsafe {
            match pass {
                0 => self.summaries().iter().all(|row| row.largest != UNFINISHED),
                _ => (0..cell_rows).all(|row| self.block.finished::<f64>(self.first_cell(row), 0, 1) != [UNFINISHED]),
            }
        };
        if done { Ok(()) } else { Err(Failure::new(Status::Mismatch, scratch_argument)) }
    }

    /// Where the first cell of a row of the second pass stands.
    fn first_cell(&self, row: u32) -> usize {
        self.scratch.cells + row as usize * self.request.config.cells() as usize * size_of::<f64>()
    }

    /// Rows of the two passes.
    pub(super) fn rows(&self) -> [u32; 2] {
        [self.request.config.pixels.height, self.request.config.cells()]
    }

    /// Works on rows of a pass.
    ///
    /// # Safety
    /// No other thread works on these rows, nor on the first pass while this is the second.
    pub(super) unsafe fn run(&self, rows: &PixelRows, pass: u32, first: u32, count: u32) -> Checked<()> {
        for row in first..first + count {
            // SAFETY: the caller's contract.
            unsafe { if pass == 0 { self.decode(rows, row)? } else { self.integrate(row) } }
        }
        Ok(())
    }

    /// # Safety
    /// As [`Build::run`].
    unsafe fn decode(&self, rows: &PixelRows, y: u32) -> Checked<()> {
        let width = self.request.config.pixels.width as usize;
        let start = y as usize * width;
        let coloured = if self.request.config.rgb { width } else { 0 };
        // SAFETY: elements of this row only.
        let (luminance, rgb, summary) = unsafe {
            (
                self.block.own::<f64>(self.scratch.texels, start, width),
                self.block.own::<[f32; 3]>(self.scratch.texels_rgb, start, coloured),
                self.block.own::<RowSummary>(self.scratch.rows, y as usize, 1),
            )
        };
        let decoded = kernel::decode(&self.request.config, rows, y, luminance, rgb).map_err(|error| match error {
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
    unsafe fn integrate(&self, i: u32) {
        let config = &self.request.config;
        let cells = config.cells() as usize;
        let start = i as usize * cells;
        let when = |kept: bool| if kept { cells } else { 0 };
        // SAFETY: what is only read is not written in this pass; of the cells this row only is written.
        unsafe {
            let row = Row {
                luminance: self.block.own(self.scratch.cells, start, cells),
                spread: self.block.own(self.scratch.spread, start, when(config.refined)),
                rgb: self.block.own(self.scratch.cells_rgb, start, when(config.rgb)),
            };
            kernel::integrate(config, self.decoded(), i, row);
        }
    }

    /// The decoded texels.
    ///
    /// # Safety
    /// The first pass is done.
    unsafe fn decoded<'a>(&self) -> Decoded<'a> {
        let texels = self.request.config.texels();
        let coloured = if self.request.config.rgb { texels } else { 0 };
        // SAFETY: only read from then on.
        unsafe {
            Decoded {
                luminance: self.block.finished(self.scratch.texels, 0, texels),
                rgb: self.block.finished(self.scratch.texels_rgb, 0, coloured),
                replacement: kernel::replacement(self.summaries()),
            }
        }
    }

    /// # Safety
    /// The first pass is done.
    unsafe fn summaries<'a>(&self) -> &'a [RowSummary] {
        // SAFETY: written by the first pass, only read from then on.
        unsafe { self.block.finished(self.scratch.rows, 0, self.request.config.pixels.height as usize) }
    }

    /// Builds the trees and writes the environment; both passes are done.
    ///
    /// # Safety
    /// As wis_wavelet_light_finish.
    pub(super) unsafe fn finish(
        &self,
        memory: *mut u8,
        bytes: usize,
        environment: *mut *const Environment,
        info: *mut EnvironmentInfo,
    ) -> Checked<()> {
        // SAFETY: the caller's contract; the parts of the blocks do not overlap.
        unsafe {
            let header = match self.request.config.storage {
                Storage::Pyramid => self.store_pyramid(memory, bytes)?,
                Storage::Sparse => self.store_sparse(memory, bytes)?,
            };
            publish(memory.cast_const().cast(), &header, environment, info);
        }
        Ok(())
    }

    /// A header with what does not depend on the trees.
    ///
    /// # Safety
    /// Both passes are done.
    unsafe fn header(&self) -> Header {
        let config = &self.request.config;
        Header {
            magic: MAGIC,
            bytes: 0,
            content_id: 0,
            // SAFETY: the caller's contract.
            sanitised: unsafe { self.summaries() }.iter().map(|row| row.sanitised).sum(),
            power: 0.0,
            error: 0.0,
            storage: if config.storage == Storage::Sparse { WIS_STORAGE_SPARSE } else { WIS_STORAGE_PYRAMID },
            flags: self.request.flags,
            depth: config.depth,
            squares: 0,
            exponent: 0,
            average: 0.0,
            compensated_average: 0.0,
            rgb_average: [0.0; 3],
            refined: 0,
            texels: [0; 2],
        }
    }

    /// The integrated cells.
    ///
    /// # Safety
    /// Both passes are done.
    unsafe fn grid<'a>(&self) -> Grid<'a> {
        let cells = self.request.config.cells() as usize * self.request.config.cells() as usize;
        let when = |kept: bool| if kept { cells } else { 0 };
        // SAFETY: only read from now on.
        unsafe {
            Grid {
                luminance: self.block.finished(self.scratch.cells, 0, cells),
                spread: self.block.finished(self.scratch.spread, 0, when(self.request.config.refined)),
                rgb: self.block.finished(self.scratch.cells_rgb, 0, when(self.request.config.rgb)),
            }
        }
    }

    /// Refines cells, and builds the trees where they stay.
    ///
    /// # Safety
    /// As [`Build::finish`].
    unsafe fn store_pyramid(&self, memory: *mut u8, bytes: usize) -> Checked<Header> {
        let config = &self.request.config;
        // SAFETY: the caller's contract; the parts do not overlap.
        unsafe {
            let mut below = Refinement {
                squares: self.block.own(self.scratch.refined, 0, config.room()),
                links: self.block.own(self.scratch.links, 0, config.room()),
                marks: self.block.own(self.scratch.marks, 0, config.marks()),
            };
            let refined = kernel::refine(config, self.decoded(), &self.grid(), &mut below)?;
            let stored = self.request.stored(self.request.squares(), refined).ok_or_else(overflow)?;
            let block = ExclusiveBlock::new(memory, bytes, stored.bytes, 2)?;
            let mut header = self.header();
            let mut trees = Trees {
                plain: Stored::part(&block, stored.squares),
                compensated: Stored::part(&block, stored.compensated),
                texels: None,
                rgb: Stored::part(&block, stored.rgb),
            };
            if stored.rows.count > 0 {
                trees.texels = Some(Table {
                    starts: Stored::part(&block, stored.starts),
                    guides: Stored::part(&block, stored.guides),
                    rows: Stored::part(&block, stored.rows),
                });
            }
            let squares = below.squares.get(..refined as usize).unwrap_or(&[]);
            kernel::complete(config, self.decoded(), &self.grid(), squares, &mut trees, &mut header)?;
            copy(below.marks, Stored::part(&block, stored.marks));
            copy(below.links, Stored::part(&block, stored.links));
            header.squares = stored.squares.count as u32;
            Ok(seal(&block, &stored, header))
        }
    }

    /// Builds the complete trees in scratch memory and copies the squares that the budget keeps.
    ///
    /// # Safety
    /// As [`Build::finish`].
    unsafe fn store_sparse(&self, memory: *mut u8, bytes: usize) -> Checked<Header> {
        let config = &self.request.config;
        let all = self.request.squares() as usize;
        let when = |condition: bool, count: usize| if condition { count } else { 0 };
        // SAFETY: the caller's contract; the parts do not overlap.
        unsafe {
            let mut header = self.header();
            let mut trees = Trees {
                plain: self.block.own(self.scratch.plain, 0, all),
                compensated: self.block.own(self.scratch.compensated, 0, when(config.compensated, all)),
                texels: None,
                rgb: self.block.own(self.scratch.rgb, 0, when(config.rgb, all)),
            };
            kernel::complete(config, self.decoded(), &self.grid(), &[], &mut trees, &mut header)?;
            let savings = self.block.own::<f64>(self.scratch.savings, 0, all);
            let planned = kernel::plan(config, &header, trees.plain, savings)?;
            let kept = planned.squares as usize;
            let stored = self.request.stored(planned.squares, 0).ok_or_else(overflow)?;
            let block = ExclusiveBlock::new(memory, bytes, stored.bytes, 2)?;
            let links: &mut [Link] = Stored::part(&block, stored.links);
            kernel::write_kept(config, &header, trees.plain, savings, Stored::part(&block, stored.squares), links)?;
            let sources = self.block.own::<u32>(self.scratch.sources, 0, kept);
            kernel::copy_kept(links, sources, trees.compensated, Stored::part(&block, stored.compensated));
            kernel::copy_kept(links, sources, trees.rgb, Stored::part(&block, stored.rgb));
            header.squares = planned.squares;
            header.error = planned.error;
            Ok(seal(&block, &stored, header))
        }
    }
}

fn overflow() -> Failure {
    Failure::new(Status::Overflow, 1)
}

fn copy<T: Copy>(from: &[T], to: &mut [T]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
}

/// Writes the header, the content id and what lies between the parts, the last step of a build.
///
/// # Safety
/// The block is the caller's to write and holds everything but the header.
unsafe fn seal(block: &ExclusiveBlock, stored: &Stored, header: Header) -> Header {
    // SAFETY: the caller's contract; the views do not outlive the statement that made them.
    unsafe {
        let mut header = Header { bytes: stored.bytes as u64, ..header };
        // The bytes of an environment must not depend on what was in the block.
        stored.clear_padding(block);
        let write = |header: Header| {
            if let Some(slot) = block.slice::<Header>(0, 0, 1).first_mut() {
                *slot = header;
            }
        };
        write(header);
        header.content_id = stored.environment(block.start().cast()).content_id();
        write(header);
        header
    }
}
