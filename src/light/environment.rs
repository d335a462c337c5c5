//! The environment: a light as one block of bytes without pointers, in the caller's memory. Built once, shared by all threads,
//! copied, saved and mapped as it is.

use super::blocks::Lengths;
use super::chart::{Axis, Chart, LAYOUTS, Layout};
use super::guide::{self, Guide};
use super::map;
use super::plan::{Description, Filter, Plan};
use super::radiance::{Radiance, Source};
use super::strata::{self, StandIn};
use super::tables::{Block, Cell, Light};
pub use crate::blob::Size;
use crate::blob::{self, Magic, Part, Table};
use crate::numeric::ContentHash;
use crate::simd::WINDOW;
use crate::sphere::Frame;
use crate::status::{Result, Status};
use bytemuck::{Pod, Zeroable};

/// What stands at the beginning of an environment.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Header {
    pub(super) magic: u64,
    /// Bytes of the environment.
    pub bytes: u64,
    /// Tells environments apart: a hash of all bytes behind it, and of the frame.
    pub content_id: u64,
    pub(super) tables_hash: u64,
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
    pub(super) lengths: Lengths,
    pub(super) sections: Sections,
    /// What stands in for the exact tables.
    pub stand_in: StandIn,
    pub(super) layout: u32,
    pub(super) flags: u32,
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    pub(super) patches: [u32; 2],
    pub(super) length: [f32; 2],
    pub(super) shift: [f32; 2],
    pub(super) offset: f32,
    /// The error budget.
    pub budget: f32,
    pub(crate) grid: [u32; 2],
    pub(super) side: [u32; 2],
    pub(super) frame: [f32; 9],
    pub(super) reserved: u32,
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
        Chart { layout: self.layout(), axes: [axis(0), axis(1)], offset: self.offset }
    }

    fn cells(&self) -> u64 {
        u64::from(self.grid[0]) * u64::from(self.grid[1])
    }

    #[inline(always)]
    fn layout(&self) -> Layout {
        LAYOUTS.get(self.layout as usize).copied().unwrap_or(Layout::Octahedral)
    }

    #[inline(always)]
    fn is_bilinear(&self) -> bool {
        self.flags & BILINEAR != 0
    }
}

/// Of [`Header::flags`].
pub(super) const BILINEAR: u32 = 1;
/// Of [`Header::flags`]: the [`Description::switches`].
pub(super) const SWITCHES: [u32; 5] = [2, 4, COMPENSATED, LIGHT_ONLY, RAYS_ONLY];
const COMPENSATED: u32 = 8;
const LIGHT_ONLY: u32 = 16;
const RAYS_ONLY: u32 = 32;

/// Lines begin at a multiple of this, so that those of a full block of a bilinear light are cache lines.
const LINE: u64 = 64;

/// Where the parts of an environment begin, in bytes. Behind each table that is searched stands a window of zeros.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Sections {
    pub(super) tops: u64,
    pub(super) cell_of: [u64; 2],
    /// [`Cell`]s.
    pub cells: u64,
    pub(super) colours: u64,
    pub(super) guide: u64,
    /// In-cell starts.
    pub starts: u64,
    /// [`Block`]s.
    pub blocks: u64,
    /// Of blocks.
    pub words: u64,
    pub(super) tiles: u64,
    /// Words of the texel map.
    pub texels: u64,
    /// Last: how many there are is known when all else is written.
    pub strata: u64,
    /// The bytes of the environment.
    pub end: u64,
}

impl Sections {
    /// Of each section the bytes that are written, the zeros behind them, and the alignment. What every sample reads stands together:
    /// the fewer pages, the fewer walks through page tables.
    fn all(plan: &Plan, lengths: &Lengths, strata: usize) -> [[u64; 3]; 12] {
        // Rays alone read the texel map and its strata.
        let exact = |count: usize| if plan.of.rays_only { 0 } else { count as u64 };
        let bytes = |count: u64, size: usize| count.saturating_mul(size as u64);
        let (cells, window) = (exact(plan.cells() as usize), exact(WINDOW));
        let pad = 2 * map::PAD as u64;
        [
            [4 * exact(tops(plan.grid)), 4 * window, 4],
            [exact(plan.small_blocks(0) as usize), 0, 1],
            [exact(plan.small_blocks(1) as usize), 0, 1],
            [bytes(cells, size_of::<Cell>()), 0, LINE],
            [12 * cells, 0, 4],
            [0, 2 * guide_length(plan) as u64, LINE],
            [bytes(lengths.starts, 4), 4 * window, 16],
            [bytes(lengths.blocks, size_of::<Block>()), 0, 16],
            [bytes(lengths.words, 2), 2 * window, LINE],
            [4 * map::tile_count(plan) as u64, 0, 4],
            [bytes(map::words(plan, lengths.groups), 2) - pad, pad, LINE],
            [bytes(strata as u64, size_of::<[f32; 4]>()), 0, LINE],
        ]
    }

    /// `None` if no memory is as long.
    pub(super) fn new(plan: &Plan, lengths: &Lengths, strata: usize) -> Option<Sections> {
        let (mut starts, mut all) = ([0; 13], blob::Layout::behind::<Header>());
        for (start, [used, zeros, alignment]) in starts.iter_mut().zip(Sections::all(plan, lengths, strata)) {
            *start = all.aligned_part::<u8>(used.saturating_add(zeros), alignment).offset as u64;
        }
        Some(Sections { end: all.bytes()? as u64, ..bytemuck::cast(starts) })
    }

    /// Fills what stands behind what is written with zeros: it is part of the bytes, too.
    pub(super) fn clear(&self, plan: &Plan, lengths: &Lengths, strata: usize, bytes: &mut [u8]) {
        let starts: [u64; 13] = bytemuck::cast(*self);
        for (pair, [used, ..]) in starts.windows(2).zip(Sections::all(plan, lengths, strata)) {
            if let &[start, next] = pair {
                bytes.get_mut((start + used) as usize..next as usize).unwrap_or_default().fill(0);
            }
        }
    }
}

/// The numbers of the guide.
pub(super) fn guide_length(plan: &Plan) -> usize {
    if plan.of.light_only || plan.of.rays_only { 0 } else { guide::length(plan.grid, plan.chart.faces()) }
}

/// Numbers in the tables of cells: of rows, then of the columns of each.
#[inline(always)]
pub(super) fn tops([columns, rows]: [u32; 2]) -> usize {
    let [columns, rows] = [columns as usize, rows as usize];
    rows + 1 + rows * (columns + 1)
}

/// An environment in bytes that hold one.
#[derive(Clone, Copy, Debug)]
pub struct Environment<'a> {
    bytes: &'a [u8],
    header: &'a Header,
}

impl<'a> Environment<'a> {
    /// The environment that bytes hold, without a check of what they hold.
    #[inline(always)]
    pub fn view(bytes: &'a [u8]) -> Option<Environment<'a>> {
        let header: &Header = blob::header(bytes)?;
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
        let filter = if h.is_bilinear() { Filter::Bilinear } else { Filter::Nearest };
        Description::new(h.layout(), [h.width, h.height], filter, h.budget).switched(h.flags, SWITCHES)
    }

    /// The plan of its build, if the header is one that a build of this version writes, and the bytes are those that were written.
    pub(super) fn sound_plan(&self) -> Option<Plan> {
        let h = self.header;
        let known = BILINEAR | SWITCHES.iter().sum::<u32>();
        if h.magic != Header::MAGIC || h.flags & !known != 0 || h.layout > 2 || h.reserved != 0 {
            return None;
        }
        let plan = Plan::new(&self.description()).ok()?;
        let sections = Sections::new(&plan, &h.lengths, h.stand_in.strata as usize)?;
        let hash = hash(self.bytes);
        let sound = plan.chart == h.chart()
            && plan.grid == h.grid
            && plan.side == h.side
            && sections == h.sections
            && sections.end == h.bytes
            && map::words(&plan, h.lengths.groups) == h.stand_in.words
            && map::tile_count(&plan) as u64 == u64::from(h.stand_in.tiles)
            && h.tables_hash == hash
            && h.content_id == content_id(hash, &h.frame)
            && [h.power, h.mean, h.largest_share, h.error].iter().all(|x| (0.0..f64::INFINITY).contains(x))
            && [h.stand_in.mean, h.stand_in.inverse_power, h.stand_in.second_moment]
                .iter()
                .all(|x| (0.0..f32::INFINITY).contains(x))
            && Frame::new(&h.frame).is_some();
        sound.then_some(plan)
    }

    /// The part of a radiance that BSDF rays bring where rays of direct light bring what exceeds the mean.
    pub fn base(&self, radiance: [f32; 3]) -> f32 {
        let luminance = crate::numeric::luminance(radiance);
        let mean = self.header.stand_in.mean;
        if luminance > mean { mean / luminance } else { 1.0 }
    }

    #[inline(always)]
    fn part<T: Pod>(&self, start: u64, count: u64) -> &'a [T] {
        Part::at(start, count).of(self.bytes)
    }

    /// What candidates read of it.
    #[inline(always)]
    pub fn source(&self) -> Source<'a> {
        let (h, s, of) = (self.header, &self.header.sections, &self.header.stand_in);
        let (words, tiles) = (self.part(s.texels, of.words), self.part(s.tiles, of.tiles.into()));
        let chart = h.chart();
        let radiance = Radiance::new(words, tiles, of.tile_side, h.is_bilinear(), &chart);
        let strata = self.part(s.strata, of.strata.into());
        let unit = strata::unit(&chart);
        Source { chart, radiance, strata, unit, mean: of.mean, inverse_power: of.inverse_power }
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
        let (s, of) = (&self.header.sections, &self.header.stand_in);
        Light {
            texels: self.part(s.texels, of.words),
            tiles: self.part(s.tiles, of.tiles.into()),
            strata: self.part(s.strata, of.strata.into()),
            ..self.tables()
        }
    }

    /// The tables alone: what samples and densities need.
    #[inline(never)]
    pub fn tables(&self) -> Light<'a> {
        let (h, s) = (self.header, &self.header.sections);
        let behind = |count: u64| count.wrapping_add(WINDOW as u64);
        Light {
            exact: h.budget == 0.0,
            power: h.power,
            grid: h.grid,
            cells: self.part(s.cells, h.cells()),
            tops: Table::new(self.part(s.tops, behind(tops(h.grid) as u64)), &[0.0; WINDOW]),
            cell_of: [
                self.part(s.cell_of[0], s.cell_of[1].wrapping_sub(s.cell_of[0])),
                self.part(s.cell_of[1], s.cells.wrapping_sub(s.cell_of[1])),
            ],
            side: h.side,
            starts: Table::new(self.part(s.starts, behind(h.lengths.starts)), &[0.0; WINDOW]),
            blocks: self.part(s.blocks, h.lengths.blocks),
            words: Table::new(self.part(s.words, behind(h.lengths.words)), &[0; WINDOW]),
            ..Light::of_map(h.chart(), h.is_bilinear(), h.stand_in.tile_side, &[], &[])
        }
    }

    /// What products must know of the cells; `None` if it was built for the light alone.
    #[inline(always)]
    pub fn guide(&self) -> Option<Guide<'a>> {
        let h = self.header;
        if h.flags & (LIGHT_ONLY | RAYS_ONLY) != 0 {
            return None;
        }
        let faces = if h.layout() == Layout::Cube { 6 } else { 1 };
        Some(Guide::new(h.grid, faces, self.part(h.sections.guide, guide::length(h.grid, faces) as u64)))
    }

    /// The light of each cell as a colour, over the power: its luminance is the cell's probability.
    pub fn colours(&self) -> &'a [[f32; 3]] {
        self.part(self.header.sections.colours, self.header.cells())
    }
}

/// A hash of what stands behind the content id and the hash itself, but for the frame.
fn hash(bytes: &[u8]) -> u64 {
    let mut hash = ContentHash::new();
    let frame = core::mem::offset_of!(Header, frame);
    hash.add_bytes(bytes.get(core::mem::offset_of!(Header, power)..frame).unwrap_or(&[]));
    hash.add_bytes(bytes.get(size_of::<Header>()..).unwrap_or(&[]));
    hash.finish()
}

fn content_id(tables: u64, frame: &[f32; 9]) -> u64 {
    let mut hash = ContentHash::new();
    hash.add(tables);
    hash.add_floats(frame);
    hash.finish()
}

/// The header of an environment, to write.
pub(super) fn header_mut(bytes: &mut [u8]) -> Option<&mut Header> {
    Part::at(0, 1).of_mut(bytes).first_mut()
}

/// Ends a build: all else is written.
pub(super) fn sign(bytes: &mut [u8]) {
    let hash = hash(bytes);
    if let Some(header) = header_mut(bytes) {
        (header.tables_hash, header.content_id) = (hash, content_id(hash, &header.frame));
    }
}

/// Gives an environment another frame, in place: the light turns, nothing is rebuilt.
pub fn turn(bytes: &mut [u8], frame: &Frame) {
    let Some(header) = header_mut(bytes) else { return };
    header.frame = frame.to_array();
    header.content_id = content_id(header.tables_hash, &header.frame);
}
