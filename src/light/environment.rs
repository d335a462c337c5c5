//! The environment: a light as one block of bytes without pointers, in the caller's memory. Built once, shared by all threads,
//! copied, saved and mapped as it is.

use super::blocks::{Lengths, SINGLE};
use super::build::{self, Arrays, CellWork, Totals};
use super::candidates::Source;
use super::chart::{Axis, Chart, Layout};
use super::guide::{self, CellGuide, Guide};
use super::map;
use super::plan::{Description, Filter, Plan};
use super::radiance::Radiance;
use super::strata;
use super::tables::{Block, Cell, Light};
use crate::numeric::ContentHash;
use crate::object::Magic;
pub use crate::object::Size;
use crate::simd::{Blob, Table, WINDOW};
use crate::sphere::Frame;
use crate::status::{Result, Status};
use bytemuck::{Pod, Zeroable, try_cast_slice_mut};

/// What stands at the beginning of an environment.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Header {
    magic: u64,
    /// Bytes of the environment.
    pub bytes: u64,
    /// Tells environments apart: a hash of all bytes behind it, and of the frame.
    pub content_id: u64,
    tables_hash: u64,
    /// The integral of luminance over the sphere.
    pub power: f64,
    /// The mean luminance of the texels.
    pub mean: f64,
    /// The share of the light that the brightest texel gives.
    pub largest_share: f64,
    /// The relative standard deviation of L / pdf that the error budget added.
    pub error: f64,
    /// Texels that were replaced.
    pub sanitised: u64,
    /// Elements of: in-cell starts, blocks, words, groups of the texel map.
    lengths: [u64; 4],
    sections: Sections,
    /// What stands in for the exact tables.
    pub stand_in: StandIn,
    layout: u32,
    flags: u32,
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    patches: [u32; 2],
    length: [f32; 2],
    shift: [f32; 2],
    offset: f32,
    /// The error budget.
    pub budget: f32,
    pub(crate) grid: [u32; 2],
    side: [u32; 2],
    frame: [f32; 9],
    reserved: u32,
}

/// The texel map and its strata.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct StandIn {
    /// Words of the texel map, and of the zeros behind.
    words: u64,
    /// Records of tiles.
    tiles: u32,
    tile_side: u32,
    /// The mean radiance of the map.
    pub mean: f32,
    /// 1 / the integral of max(L - mean, L / 4).
    pub inverse_power: f32,
    /// E[(p^ / p)^2] for p the density of strata and p^ that function over its integral: what strata lose is what it exceeds 1 by.
    pub second_moment: f32,
    /// Strata.
    pub strata: u32,
}

impl Magic for Header {
    const MAGIC: u64 = u64::from_le_bytes(*b"wisenv\x03\x00");
}

impl Header {
    /// The bytes of the environment that begins with this; `None` if it is no environment of this version.
    #[inline(always)]
    pub fn length(&self) -> Option<usize> {
        if self.magic == Header::MAGIC { usize::try_from(self.bytes).ok() } else { None }
    }

    /// Directions and positions.
    #[inline(always)]
    fn chart(&self) -> Chart {
        let axis = |k: usize| Axis { patches: self.patches[k], length: self.length[k], shift: self.shift[k] };
        Chart { layout: layout_of(self.layout), axes: [axis(0), axis(1)], offset: self.offset }
    }
}

const BILINEAR: u32 = 1;
const ROWS_AT_POLES: u32 = 2;
const EXACT_ZERO: u32 = 4;
const COMPENSATED: u32 = 8;
const LIGHT_ONLY: u32 = 16;
const RAYS_ONLY: u32 = 32;

/// Lines begin at a multiple of this, so that those of a full block of a bilinear light are cache lines.
const LINE: usize = 64;

/// Where the parts of an environment begin, in bytes. Behind each table that is searched stands a window of zeros.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Sections {
    tops: u64,
    cell_of: [u64; 2],
    /// [`Cell`]s.
    pub cells: u64,
    colours: u64,
    guide: u64,
    /// In-cell starts.
    pub starts: u64,
    /// [`Block`]s.
    pub blocks: u64,
    /// Of blocks.
    pub words: u64,
    tiles: u64,
    /// Words of the texel map.
    pub texels: u64,
    /// Last: how many there are is known when all else is written.
    strata: u64,
    /// The bytes of the environment.
    pub end: u64,
}

impl Sections {
    /// For what the cells were found to take, with the most strata.
    ///
    /// # Errors
    /// [`Status::Overflow`].
    pub fn of_cells(plan: &Plan, work: &[CellWork]) -> Result<Sections> {
        let lengths = build::offset(work, plan.cells());
        Sections::new(plan, lengths, strata::most(&plan.chart)).ok_or(Status::Overflow)
    }

    /// `None` if the sum overflows.
    fn new(plan: &Plan, lengths: Lengths, strata: usize) -> Option<Sections> {
        let Plan { grid, .. } = *plan;
        // Rays alone read the texel map and its strata.
        let exact = |count: usize| if plan.of.rays_only { 0 } else { count };
        let cells = exact(plan.cells() as usize);
        let mut at = size_of::<Header>();
        let mut put = |count: usize, size: usize, align: usize| {
            let start = at.checked_next_multiple_of(align)?;
            at = start.checked_add(count.checked_mul(size)?)?;
            Some(start as u64)
        };
        // What every sample reads stands together: the fewer pages, the fewer walks through page tables.
        let sections = Sections {
            tops: put(exact(tops(grid) + WINDOW), 4, 4)?,
            cell_of: [
                put(exact(plan.small_blocks(0) as usize), 1, 1)?,
                put(exact(plan.small_blocks(1) as usize), 1, 1)?,
            ],
            cells: put(cells, size_of::<Cell>(), LINE)?,
            colours: put(cells, 12, 4)?,
            guide: put(guide_length(plan), 2, LINE)?,
            starts: put(lengths.starts.checked_add(exact(WINDOW))?, 4, 16)?,
            blocks: put(lengths.blocks, size_of::<Block>(), 16)?,
            words: put(lengths.words.checked_add(exact(WINDOW))?, 2, LINE)?,
            tiles: put(map::tile_count(plan), 4, 4)?,
            texels: put(map::words(plan, lengths.groups)?, 2, LINE)?,
            strata: put(strata, size_of::<[f32; 4]>(), LINE)?,
            end: 0,
        };
        Some(Sections { end: put(0, 1, 16)?, ..sections })
    }
}

/// The numbers of the guide.
fn guide_length(plan: &Plan) -> usize {
    if plan.of.light_only || plan.of.rays_only { 0 } else { guide::length(plan.grid, plan.chart.faces()) }
}

/// Numbers in the tables of cells: of rows, then of the columns of each.
#[inline(always)]
fn tops([columns, rows]: [u32; 2]) -> usize {
    let [columns, rows] = [columns as usize, rows as usize];
    rows + 1 + rows * (columns + 1)
}

fn part_mut<T: Pod>(bytes: &mut [u8], start: usize, count: usize) -> &mut [T] {
    let end = start.saturating_add(count.saturating_mul(size_of::<T>()));
    bytes.get_mut(start..end).and_then(|part| try_cast_slice_mut(part).ok()).unwrap_or(&mut [])
}

/// An environment in bytes that hold one.
#[derive(Clone, Copy, Debug)]
pub struct Environment<'a> {
    bytes: &'a [u8],
    header: &'a Header,
}

impl Plan {
    /// What a build of this plan takes at most.
    ///
    /// # Errors
    /// [`Status::Overflow`] if no memory can hold it.
    pub fn size(&self) -> Result<Size> {
        let full = build::full_lengths(self);
        // Positions of words are 32-bit numbers.
        if full.words as u64 > u64::from(u32::MAX) {
            return Err(Status::Overflow);
        }
        let sections = Sections::new(self, full, strata::most(&self.chart)).ok_or(Status::Overflow)?;
        let size = Size { bytes: sections.end as usize, scratch: Arrays::of(self).ok_or(Status::Overflow)?.bytes };
        if size.bytes <= isize::MAX as usize { Ok(size) } else { Err(Status::Overflow) }
    }
}

impl<'a> Environment<'a> {
    /// The environment that bytes hold, without a check of what they hold.
    #[inline(always)]
    pub fn view(bytes: &'a [u8]) -> Option<Environment<'a>> {
        let header = Blob::new(bytes).part::<Header>(0, 1).first()?;
        Some(Environment { bytes: bytes.get(..usize::try_from(header.bytes).ok()?)?, header })
    }

    /// The environment that bytes hold, checked: any answer leads to no access outside, no endless loop and no number that is
    /// not finite. Reads all bytes once.
    ///
    /// # Errors
    /// [`Status::Corrupt`].
    pub fn open(bytes: &'a [u8]) -> Result<Environment<'a>> {
        let environment = Environment::view(bytes).ok_or(Status::Corrupt)?;
        if super::check::is_sound(&environment) { Ok(environment) } else { Err(Status::Corrupt) }
    }

    /// What stands at its beginning.
    pub fn header(&self) -> &'a Header {
        self.header
    }

    /// Whether the light is what compensation leaves of it.
    pub fn is_compensated(&self) -> bool {
        self.header.flags & COMPENSATED != 0
    }

    /// Its bytes.
    pub fn as_bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// From the map's space to the world's.
    #[inline(always)]
    pub fn frame(&self) -> Frame {
        Frame::from_array(&self.header.frame)
    }

    /// What was built.
    pub fn description(&self) -> Description {
        let h = self.header;
        let flag = |bit: u32| h.flags & bit != 0;
        Description {
            layout: layout_of(h.layout),
            width: h.width,
            height: h.height,
            filter: if flag(BILINEAR) { Filter::Bilinear } else { Filter::Nearest },
            rows_at_poles: flag(ROWS_AT_POLES),
            exact_zero: flag(EXACT_ZERO),
            compensated: flag(COMPENSATED),
            light_only: flag(LIGHT_ONLY),
            rays_only: flag(RAYS_ONLY),
            budget: h.budget,
        }
    }

    /// Whether the header is one that a build of this version writes, and the bytes are those that were written.
    pub(super) fn header_is_sound(&self) -> bool {
        let h = self.header;
        let known = BILINEAR | ROWS_AT_POLES | EXACT_ZERO | COMPENSATED | LIGHT_ONLY | RAYS_ONLY;
        if h.magic != Header::MAGIC || h.flags & !known != 0 || h.layout > 2 || h.reserved != 0 {
            return false;
        }
        let Ok(plan) = Plan::new(&self.description()) else { return false };
        let sections = Sections::new(&plan, self.lengths(), h.stand_in.strata as usize);
        let hash = hash(self.bytes);
        plan.chart == h.chart()
            && plan.grid == h.grid
            && plan.side == h.side
            && sections.is_some_and(|s| s == h.sections && s.end == h.bytes)
            && map::words(&plan, self.lengths().groups).is_some_and(|words| words as u64 == h.stand_in.words)
            && map::tile_count(&plan) as u64 == u64::from(h.stand_in.tiles)
            && h.tables_hash == hash
            && h.content_id == content_id(hash, &h.frame)
            && [h.power, h.mean, h.largest_share, h.error].iter().all(|x| (0.0..f64::INFINITY).contains(x))
            && [h.stand_in.mean, h.stand_in.inverse_power, h.stand_in.second_moment]
                .iter()
                .all(|x| (0.0..f32::INFINITY).contains(x))
            && Frame::new(&h.frame).is_some()
    }

    fn lengths(&self) -> Lengths {
        let [starts, blocks, words, groups] = self.header.lengths.map(|n| n as usize);
        Lengths { starts, blocks, words, groups }
    }

    /// The part of a radiance that BSDF rays bring where rays of direct light bring what exceeds the mean.
    pub fn base(&self, radiance: [f32; 3]) -> f32 {
        let luminance = crate::numeric::luminance(radiance);
        let mean = self.header.stand_in.mean;
        if luminance > mean { mean / luminance } else { 1.0 }
    }

    /// What candidates read of it.
    #[inline(always)]
    pub fn source(&self) -> Source<'a> {
        let h = self.header;
        let (blob, s, of) = (Blob::new(self.bytes), &h.sections, &h.stand_in);
        let (words, tiles) = (blob.part(s.texels, of.words), blob.part(s.tiles, of.tiles.into()));
        let chart = h.chart();
        let radiance = Radiance::new(words, tiles, of.tile_side, h.flags & BILINEAR != 0, &chart);
        let strata = blob.part(s.strata, of.strata.into());
        Source { chart, radiance, strata, mean: of.mean, inverse_power: of.inverse_power }
    }

    /// Requires the exact tables.
    ///
    /// # Errors
    /// [`Status::NotBuilt`] if it was built for rays alone.
    #[inline(always)]
    pub fn exact(&self) -> Result<&Self> {
        if self.header.flags & RAYS_ONLY == 0 { Ok(self) } else { Err(Status::NotBuilt) }
    }

    /// The tables, the texel map and the strata.
    pub fn light(&self) -> Light<'a> {
        let (blob, s, of) = (Blob::new(self.bytes), &self.header.sections, &self.header.stand_in);
        Light {
            texels: blob.part(s.texels, of.words),
            tiles: blob.part(s.tiles, of.tiles.into()),
            strata: blob.part(s.strata, of.strata.into()),
            ..self.tables()
        }
    }

    /// The tables alone: what samples and densities need.
    #[inline(never)]
    pub fn tables(&self) -> Light<'a> {
        self.tables_of(Blob::new(self.bytes))
    }

    /// As [`Environment::tables`], cut from a blob of its bytes.
    #[inline(always)]
    pub fn tables_of(&self, blob: Blob<'a>) -> Light<'a> {
        let h = self.header;
        let s = &h.sections;
        let [starts, blocks, words, _] = h.lengths;
        let cells = h.grid[0] as usize * h.grid[1] as usize;
        Light {
            chart: h.chart(),
            bilinear: h.flags & BILINEAR != 0,
            exact: h.budget == 0.0,
            power: h.power,
            grid: h.grid,
            cells: blob.part(s.cells, cells as u64),
            tops: Table::new(blob.part(s.tops, (tops(h.grid) + WINDOW) as u64), &[0.0; WINDOW]),
            cell_of: [
                blob.part(s.cell_of[0], s.cell_of[1].wrapping_sub(s.cell_of[0])),
                blob.part(s.cell_of[1], s.cells.wrapping_sub(s.cell_of[1])),
            ],
            side: h.side,
            starts: Table::new(blob.part(s.starts, starts.wrapping_add(WINDOW as u64)), &[0.0; WINDOW]),
            blocks: blob.part(s.blocks, blocks),
            words: Table::new(blob.part(s.words, words.wrapping_add(WINDOW as u64)), &[0; WINDOW]),
            texels: &[],
            tiles: &[],
            tile_side: h.stand_in.tile_side,
            strata: &[],
            mean: h.stand_in.mean,
            inverse_power: h.stand_in.inverse_power,
        }
    }

    /// What products must know of the cells; `None` if it was built for the light alone.
    #[inline(always)]
    pub fn guide(&self) -> Option<Guide<'a>> {
        if self.header.flags & (LIGHT_ONLY | RAYS_ONLY) != 0 {
            return None;
        }
        let (grid, faces) = (self.header.grid, if self.header.layout == 1 { 6 } else { 1 });
        Some(Guide::new(
            grid,
            faces,
            Blob::new(self.bytes).part(self.header.sections.guide, guide::length(grid, faces) as u64),
        ))
    }

    /// The light of each cell as a colour, over the power: its luminance is the cell's probability.
    pub fn colours(&self) -> &'a [[f32; 3]] {
        let cells = u64::from(self.header.grid[0]) * u64::from(self.header.grid[1]);
        Blob::new(self.bytes).part(self.header.sections.colours, cells)
    }
}

fn layout_of(code: u32) -> Layout {
    match code {
        0 => Layout::LatLong,
        1 => Layout::Cube,
        _ => Layout::Octahedral,
    }
}

/// A hash of what stands behind the content id and the hash itself, but for the frame.
fn hash(bytes: &[u8]) -> u64 {
    let mut hash = ContentHash::new();
    let frame = core::mem::offset_of!(Header, frame);
    let first = bytes.get(core::mem::offset_of!(Header, power)..frame).unwrap_or(&[]);
    let rest = bytes.get(size_of::<Header>()..).unwrap_or(&[]);
    hash.add_bytes(first);
    hash.add_bytes(rest);
    hash.finish()
}

fn content_id(tables: u64, frame: &[f32; 9]) -> u64 {
    let mut hash = ContentHash::new();
    hash.add(tables);
    hash.add_floats(frame);
    hash.finish()
}

/// An environment while its tables are written.
#[derive(Debug)]
pub struct Writer<'a> {
    plan: Plan,
    sections: Sections,
    lengths: Lengths,
    bytes: &'a mut [u8],
}

impl<'a> Writer<'a> {
    /// The memory for what the cells were found to take: as long as the sections say.
    pub fn new(plan: &Plan, work: &[CellWork], sections: Sections, bytes: &'a mut [u8]) -> Writer<'a> {
        Writer { plan: *plan, sections, lengths: build::offset(work, plan.cells()), bytes }
    }

    /// Writes all that is known when every cell is written. `room`: the luminances, which nobody reads any more.
    ///
    /// # Errors
    /// [`Status::Overflow`] if the power is not a number.
    pub fn finish(
        mut self,
        totals: &Totals,
        work: &[CellWork],
        tile_steps: &[u8],
        rgb: &[[f64; 3]],
        frame: &Frame,
        room: &mut [f32],
    ) -> Result<()> {
        let table = part_mut(self.bytes, self.sections.tiles as usize, map::tile_count(&self.plan));
        map::write_table(&self.plan, tile_steps, table);
        self.tables(totals, work, rgb, frame);
        let Writer { plan, sections, lengths, bytes } = self;
        let count = write_strata(&plan, &sections, bytes, room);
        let sections = Sections::new(&plan, lengths, count).ok_or(Status::Overflow)?;
        let bytes = bytes.get_mut(..sections.end as usize).ok_or(Status::Misaligned)?;
        write_guide(&plan, sections.guide as usize, bytes, room);
        let tables_hash = hash(bytes);
        let header =
            bytes.get_mut(..size_of::<Header>()).and_then(|start| bytemuck::try_from_bytes_mut::<Header>(start).ok());
        let header = header.ok_or(Status::Misaligned)?;
        header.tables_hash = tables_hash;
        header.content_id = content_id(tables_hash, &header.frame);
        if header.power.is_finite() { Ok(()) } else { Err(Status::Overflow) }
    }

    /// Writes the tables of cells, and the header but for its hashes. Apart, so that its stack is free again.
    #[inline(never)]
    fn tables(&mut self, totals: &Totals, work: &[CellWork], rgb: &[[f64; 3]], frame: &Frame) {
        let Writer { plan, sections, lengths, bytes } = self;
        let (plan, sections, lengths) = (*plan, *sections, *lengths);
        let count = if plan.of.rays_only { 0 } else { plan.cells() as usize };
        let (tiles, words) = (map::tile_count(&plan), map::words(&plan, lengths.groups).unwrap_or(0));
        // Gaps between sections are part of the bytes.
        for (start, length, end) in [
            (0, size_of::<Header>(), sections.tops),
            (sections.tops, if count > 0 { 4 * tops(plan.grid) } else { 0 }, sections.cell_of[0]),
            (sections.cell_of[1], if count > 0 { plan.small_blocks(1) as usize } else { 0 }, sections.cells),
            (sections.colours, 12 * count, sections.guide),
            (sections.guide, 0, sections.starts),
            (sections.starts, 4 * lengths.starts, sections.blocks),
            (sections.blocks, size_of::<Block>() * lengths.blocks, sections.words),
            (sections.words, 2 * lengths.words, sections.tiles),
            (sections.tiles, 4 * tiles, sections.texels),
            (sections.texels, 2 * (words - map::PAD), sections.strata),
        ] {
            bytes.get_mut(start as usize + length..end as usize).unwrap_or(&mut []).fill(0);
        }
        for (out, &start) in part_mut(bytes, sections.starts as usize, SINGLE.len()).iter_mut().zip(&SINGLE) {
            *out = start;
        }
        for k in if count > 0 { 0..2 } else { 0..0 } {
            let of = part_mut::<u8>(bytes, sections.cell_of[k] as usize, plan.small_blocks(k) as usize);
            for (small, out) in (0..).zip(of) {
                *out = plan.cell_of(k, small) as u8;
            }
        }
        let (before, colours) = bytes.split_at_mut_checked(sections.colours as usize).unwrap_or_default();
        let (before, cells) = before.split_at_mut_checked(sections.cells as usize).unwrap_or_default();
        let cells = part_mut(cells, 0, count);
        let power =
            build::finish(&plan, totals, work, cells, part_mut(before, sections.tops as usize, tops(plan.grid)));
        build::colours(&plan, rgb, cells, part_mut(colours, 0, count));
        let flag = |on: bool, bit: u32| if on { bit } else { 0 };
        let variance: f64 = work.iter().map(|cell| cell.variance).sum();
        let axis = plan.chart.axes;
        let header = Header {
            magic: Header::MAGIC,
            // Those of the strata are written next.
            bytes: sections.strata,
            content_id: 0,
            tables_hash: 0,
            power,
            mean: totals.mean,
            largest_share: build::largest_share(totals),
            error: if power > 0.0 { libm::sqrt((variance / power).max(0.0)) } else { 0.0 },
            sanitised: totals.sanitised,
            lengths: [lengths.starts, lengths.blocks, lengths.words, lengths.groups].map(|n| n as u64),
            sections,
            stand_in: StandIn {
                words: words as u64,
                tiles: tiles as u32,
                tile_side: map::tile_side(&plan),
                ..StandIn::zeroed()
            },
            layout: match plan.of.layout {
                Layout::LatLong => 0,
                Layout::Cube => 1,
                Layout::Octahedral => 2,
            },
            flags: flag(plan.of.filter == Filter::Bilinear, BILINEAR)
                | flag(plan.of.rows_at_poles, ROWS_AT_POLES)
                | flag(plan.of.exact_zero, EXACT_ZERO)
                | flag(plan.of.compensated, COMPENSATED)
                | flag(plan.of.light_only, LIGHT_ONLY)
                | flag(plan.of.rays_only, RAYS_ONLY),
            width: plan.of.width,
            height: plan.of.height,
            patches: axis.map(|a| a.patches),
            length: axis.map(|a| a.length),
            shift: axis.map(|a| a.shift),
            offset: plan.chart.offset,
            budget: plan.of.budget,
            grid: plan.grid,
            side: plan.side,
            frame: frame.to_array(),
            reserved: 0,
        };
        if let Some(out) = bytes.get_mut(..size_of::<Header>()) {
            for (out, &byte) in out.iter_mut().zip(bytemuck::bytes_of(&header)) {
                *out = byte;
            }
        }
        scale_blocks(part_mut(bytes, sections.blocks as usize, lengths.blocks), power);
    }
}

/// Builds the strata of an environment whose texel map is complete, and notes them in the header. Answers how many there are.
#[inline(never)]
fn write_strata(plan: &Plan, sections: &Sections, bytes: &mut [u8], room: &mut [f32]) -> usize {
    let (before, rest) = bytes.split_at_mut_checked(sections.strata as usize).unwrap_or_default();
    let Some(environment) = Environment::view(before) else { return 0 };
    let built = strata::build(
        &environment.light(),
        environment.header().mean,
        plan.of.budget,
        room,
        part_mut(rest, 0, strata::most(&plan.chart)),
    );
    let header = before.get_mut(..size_of::<Header>()).and_then(|start| bytemuck::try_from_bytes_mut(start).ok());
    let Some::<&mut Header>(header) = header else { return 0 };
    header.bytes = sections.strata + (built.count * size_of::<[f32; 4]>()) as u64;
    header.sections.end = header.bytes;
    header.stand_in = StandIn {
        strata: built.count as u32,
        mean: built.mean,
        inverse_power: built.inverse_power,
        second_moment: built.second_moment,
        ..header.stand_in
    };
    built.count
}

/// Makes radiance a share of the power.
fn scale_blocks(blocks: &mut [Block], power: f64) {
    for block in blocks {
        let share = if power > 0.0 { f64::from(block.brightest) / power } else { 0.0 };
        block.brightest = share.min(f64::from(f32::MAX)) as f32;
    }
}

/// Writes the guide of an environment whose tables are complete.
fn write_guide(plan: &Plan, start: usize, bytes: &mut [u8], room: &mut [f32]) {
    let (faces, length) = (plan.chart.faces(), guide_length(plan));
    if length == 0 {
        return;
    }
    write_corners(plan, start, bytes);
    for cell in 0..plan.cells() {
        let measured = Environment::view(bytes).map(|environment| CellGuide::of(&environment.light(), cell, room));
        if let Some(measured) = measured {
            guide::write_cell(plan.grid, faces, cell, &measured, part_mut(bytes, start, length));
        }
    }
}

/// Writes the corners of the guide. Apart, so that its stack is free again.
#[inline(never)]
fn write_corners(plan: &Plan, start: usize, bytes: &mut [u8]) {
    let mut corners = [0; 3 * guide::MAX_CORNERS];
    if let Some(environment) = Environment::view(bytes) {
        guide::write_corners(&environment.light(), &mut corners);
    }
    let numbers = part_mut(bytes, start, guide_length(plan));
    for (out, &x) in guide::corners_mut(plan.grid, plan.chart.faces(), numbers).iter_mut().zip(&corners) {
        *out = x;
    }
}

/// Gives an environment another frame, in place: the light turns, nothing is rebuilt.
pub fn turn(bytes: &mut [u8], frame: &Frame) {
    let Some(start) = bytes.get_mut(..size_of::<Header>()) else { return };
    let Ok(header) = bytemuck::try_from_bytes_mut::<Header>(start) else { return };
    header.frame = frame.to_array();
    header.content_id = content_id(header.tables_hash, &header.frame);
}
