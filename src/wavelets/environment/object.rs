//! The environment as one block of bytes without pointers, in the caller's memory.

use super::WIS_WAVELET_LIGHT_RGB;
use super::build::{Config, Decoded, Grid, Row, Trees, complete, copy_kept, decode, integrate, plan, write_kept};
use super::refine::{Refinement, refine};
use super::spread::{Refined, Spread};
use super::{ALL_FLAGS, Environment, Header, Storage, WIS_STORAGE_PYRAMID, WIS_STORAGE_SPARSE};
use crate::light::environment::Size;
use crate::light::pixels::{RowSummary, Rows};
use crate::numeric::times_power;
use crate::object::{Layout, Magic, Part, header, take, taken, write_header};
use crate::status::{Error, Result, Status};
use crate::wavelets::tree::{Link, MAX_AVERAGE, MAX_DEPTH, Mark, Tree, complete_len};
use core::f64::consts::PI;

/// Where the parts of an environment stand; what is not kept is empty.
#[derive(Clone, Copy)]
struct Parts {
    squares: Part,
    marks: Part,
    links: Part,
    rgb: Part,
    whole: Layout,
}

impl Parts {
    /// Of so many squares, of which some lie below the cells of a pyramid.
    #[inline(always)]
    fn new((squares, refined, depth): (u32, u32, u32), sparse: bool, flags: u32) -> Parts {
        let when = |condition: bool, count: u64| if condition { count } else { 0 };
        let cells = 1u64 << (2 * (depth & 15));
        let mut whole = Layout::behind::<Header>();
        let linked = if sparse { squares } else { refined };
        let has_rgb = flags & WIS_WAVELET_LIGHT_RGB != 0;
        Parts {
            squares: whole.part::<[f32; 4]>(squares.into()),
            marks: whole.part::<Mark>(when(!sparse && refined > 0, cells.div_ceil(32))),
            links: whole.part::<Link>(linked.into()),
            rgb: whole.part::<[[f32; 3]; 4]>(when(has_rgb, squares.into())),
            whole,
        }
    }

    #[inline(always)]
    fn of(header: &Header) -> Parts {
        let counts = (header.squares, header.refined, header.depth);
        Parts::new(counts, header.storage == WIS_STORAGE_SPARSE, header.flags)
    }

    /// The environment that bytes hold.
    #[inline(always)]
    fn view<'a>(&self, header: &'a Header, bytes: &'a [u8]) -> Environment<'a> {
        Environment {
            header,
            squares: self.squares.of(bytes),
            marks: self.marks.of(bytes),
            links: self.links.of(bytes),
            rgb: self.rgb.of(bytes),
        }
    }

    /// The rooms behind odd numbers of marks and links.
    fn padding(&self) -> [core::ops::Range<usize>; 2] {
        [self.marks.padding::<Mark>(), self.links.padding::<Link>()]
    }

    /// The parts in memory that holds them all: squares, marks, links and RGB.
    #[allow(clippy::type_complexity)]
    fn divide<'a>(
        &self,
        memory: &'a mut [u8],
    ) -> Option<(&'a mut [[f32; 4]], &'a mut [Mark], &'a mut [Link], &'a mut [[[f32; 3]; 4]])> {
        let mut rest = memory.get_mut(self.squares.offset..)?;
        Some((
            take(&mut rest, self.squares.count)?,
            take(&mut rest, self.marks.count)?,
            take(&mut rest, self.links.count)?,
            take(&mut rest, self.rgb.count)?,
        ))
    }
}

/// The memory of a build, divided.
struct Scratch<'a> {
    rows: &'a mut [RowSummary],
    texels: &'a mut [f64],
    texels_rgb: &'a mut [[f32; 3]],
    cells: &'a mut [f64],
    spread: &'a mut [Spread],
    cells_rgb: &'a mut [[f32; 3]],
    refined: &'a mut [Refined],
    marks: &'a mut [Mark],
    links: &'a mut [Link],
    plain: &'a mut [[f32; 4]],
    rgb: &'a mut [[[f32; 3]; 4]],
    savings: &'a mut [f64],
    sources: &'a mut [u32],
}

impl Config {
    /// Squares of the complete tree.
    fn squares(&self) -> u32 {
        complete_len::<4>(self.depth).unwrap_or(0)
    }

    fn parts(&self, squares: u32, refined: u32) -> Option<Parts> {
        let squares = squares.checked_add(refined)?;
        Some(Parts::new((squares, refined, self.depth), self.storage == Storage::Sparse, self.flags()))
    }

    /// The memory of a build: exactly, or at most if squares are pruned or lie below cells.
    ///
    /// # Errors
    /// [`Status::Overflow`] if no memory can hold it.
    pub fn size(&self) -> Result<Size> {
        let parts = self.parts(self.squares(), self.room() as u32).ok_or(Status::Overflow)?;
        let bytes = parts.whole.bytes().ok_or(Status::Overflow)?;
        let scratch = self.scratch_bytes().filter(|bytes| *bytes <= isize::MAX as usize).ok_or(Status::Overflow)?;
        Ok(Size { bytes, scratch })
    }

    /// Elements of the parts of the scratch memory.
    fn counts(&self) -> [usize; 13] {
        let when = |condition: bool, count: usize| if condition { count } else { 0 };
        let (texels, cells) = (self.texels(), self.cells() as usize * self.cells() as usize);
        let (rows, room) = (self.pixels.height as usize, self.room());
        let squares = when(self.storage == Storage::Sparse, self.squares() as usize);
        [
            rows,
            texels,
            when(self.rgb, texels),
            cells,
            when(self.refined, cells),
            when(self.rgb, cells),
            room,
            self.marks(),
            room,
            squares,
            when(self.rgb, squares),
            squares,
            squares,
        ]
    }

    fn scratch_bytes(&self) -> Option<usize> {
        let [rows, texels, texels_rgb, cells, spread, cells_rgb, refined, marks, links, plain, rgb, savings, sources] =
            self.counts();
        let parts = [
            taken::<RowSummary>(rows)?,
            taken::<f64>(texels)?,
            taken::<[f32; 3]>(texels_rgb)?,
            taken::<f64>(cells)?,
            taken::<Spread>(spread)?,
            taken::<[f32; 3]>(cells_rgb)?,
            taken::<Refined>(refined)?,
            taken::<Mark>(marks)?,
            taken::<Link>(links)?,
            taken::<[f32; 4]>(plain)?,
            taken::<[[f32; 3]; 4]>(rgb)?,
            taken::<f64>(savings)?,
            taken::<u32>(sources)?,
        ];
        parts.into_iter().try_fold(0usize, usize::checked_add)
    }

    fn scratch<'a>(&self, mut memory: &'a mut [u8]) -> Option<Scratch<'a>> {
        let [rows, texels, texels_rgb, cells, spread, cells_rgb, refined, marks, links, plain, rgb, savings, sources] =
            self.counts();
        let rest = &mut memory;
        Some(Scratch {
            rows: take(rest, rows)?,
            texels: take(rest, texels)?,
            texels_rgb: take(rest, texels_rgb)?,
            cells: take(rest, cells)?,
            spread: take(rest, spread)?,
            cells_rgb: take(rest, cells_rgb)?,
            refined: take(rest, refined)?,
            marks: take(rest, marks)?,
            links: take(rest, links)?,
            plain: take(rest, plain)?,
            rgb: take(rest, rgb)?,
            savings: take(rest, savings)?,
            sources: take(rest, sources)?,
        })
    }

    /// A header with what does not depend on the trees.
    fn header(&self, rows: &[RowSummary]) -> Header {
        Header {
            magic: Header::MAGIC,
            bytes: 0,
            content_id: 0,
            sanitised: rows.iter().map(|row| row.sanitised).sum(),
            power: 0.0,
            error: 0.0,
            storage: if self.storage == Storage::Sparse { WIS_STORAGE_SPARSE } else { WIS_STORAGE_PYRAMID },
            flags: self.flags(),
            depth: self.depth,
            squares: 0,
            exponent: 0,
            average: 0.0,
            rgb_average: [0.0; 3],
            refined: 0,
            reserved: [0; 2],
        }
    }
}

impl<'a> Environment<'a> {
    /// Builds an environment from rows of pixels. Memory and scratch are aligned to 16 bytes.
    ///
    /// # Errors
    /// [`Error`].
    pub fn build_in(
        config: &Config,
        rows: &impl Rows,
        memory: &'a mut [u8],
        scratch: &mut [u8],
    ) -> core::result::Result<Environment<'a>, Error> {
        let scratch = config.scratch(scratch).ok_or(Status::MemoryTooSmall)?;
        let (width, cells) = (config.pixels.width as usize, config.cells() as usize);
        let mut colours = scratch.texels_rgb.chunks_exact_mut(width.max(1));
        for ((y, luminance), summary) in
            (0..).zip(scratch.texels.chunks_exact_mut(width.max(1))).zip(&mut *scratch.rows)
        {
            let rgb = colours.next().unwrap_or_default();
            *summary = decode(config, rows, y, luminance, rgb)?;
        }
        let decoded = Decoded { luminance: scratch.texels, rgb: scratch.texels_rgb };
        let (mut spreads, mut colours) =
            (scratch.spread.chunks_exact_mut(cells.max(1)), scratch.cells_rgb.chunks_exact_mut(cells.max(1)));
        for (i, luminance) in (0..).zip(scratch.cells.chunks_exact_mut(cells.max(1))) {
            let (spread, rgb) = (spreads.next().unwrap_or_default(), colours.next().unwrap_or_default());
            integrate(config, decoded, i, Row { luminance, spread, rgb });
        }
        let grid = Grid { luminance: scratch.cells, spread: scratch.spread, rgb: scratch.cells_rgb };
        let mut header = config.header(scratch.rows);
        let parts = match config.storage {
            Storage::Pyramid => {
                let mut below = Refinement { squares: scratch.refined, links: scratch.links, marks: scratch.marks };
                let refined = refine(config, decoded, &grid, &mut below)?;
                let parts = config.parts(config.squares(), refined).ok_or(Status::Overflow)?;
                let (plain, marks, links, rgb) = parts.room(memory)?;
                let squares = below.squares.get(..refined as usize).unwrap_or(&[]);
                complete(config, &grid, squares, &mut Trees { plain, rgb }, &mut header)?;
                copy(below.marks, marks);
                copy(below.links, links);
                parts
            }
            Storage::Sparse => {
                let mut trees = Trees { plain: scratch.plain, rgb: scratch.rgb };
                complete(config, &grid, &[], &mut trees, &mut header)?;
                let planned = plan(config, &header, trees.plain, scratch.savings)?;
                header.error = planned.error;
                let parts = config.parts(planned.squares, 0).ok_or(Status::Overflow)?;
                let (squares, _, links, rgb) = parts.room(memory)?;
                write_kept(config, &header, trees.plain, scratch.savings, squares, links)?;
                let sources = scratch.sources.get_mut(..planned.squares as usize).unwrap_or_default();
                copy_kept(links, sources, trees.rgb, rgb);
                parts
            }
        };
        header.squares = parts.squares.count as u32;
        let bytes = parts.whole.bytes().ok_or(Status::Overflow)?;
        header.bytes = bytes as u64;
        // The bytes of an environment must not depend on what was in the block.
        for range in parts.padding() {
            memory.get_mut(range).unwrap_or_default().fill(0);
        }
        header.content_id = parts.view(&header, memory).content_id();
        write_header(memory, &header);
        Environment::view(memory).ok_or(Error::new(Status::Misaligned, 0))
    }

    /// The environment that bytes begin with, without a check of what they hold; `None` if they are of something else.
    #[inline(always)]
    pub fn view(bytes: &'a [u8]) -> Option<Environment<'a>> {
        let header: &Header = header(bytes)?;
        (header.magic == Header::MAGIC).then(|| Parts::of(header).view(header, bytes))
    }

    /// The environment that bytes hold, checked: whatever it is asked leads to no access outside, no endless loop and no
    /// number that is not finite. Reads all bytes once.
    ///
    /// # Errors
    /// [`Status::Corrupt`].
    pub fn open(bytes: &'a [u8]) -> Result<Environment<'a>> {
        let header: &Header = header(bytes).ok_or(Status::Corrupt)?;
        header.checked_length().filter(|length| *length <= bytes.len()).ok_or(Status::Corrupt)?;
        let parts = Parts::of(header);
        let view = parts.view(header, bytes);
        check(&view)?;
        let clear =
            |range: core::ops::Range<usize>| bytes.get(range).is_some_and(|room| room.iter().all(|byte| *byte == 0));
        if parts.padding().into_iter().all(clear) { Ok(view) } else { Err(Status::Corrupt) }
    }
}

impl Parts {
    /// The parts in the memory of a build.
    #[allow(clippy::type_complexity)]
    fn room<'a>(
        &self,
        memory: &'a mut [u8],
    ) -> core::result::Result<(&'a mut [[f32; 4]], &'a mut [Mark], &'a mut [Link], &'a mut [[[f32; 3]; 4]]), Error>
    {
        let bytes = self.whole.bytes().ok_or(Status::Overflow)?;
        if memory.len() < bytes {
            return Err(Error::too_small(0, bytes));
        }
        self.divide(memory).ok_or(Error::new(Status::Misaligned, 0))
    }
}

impl Header {
    /// The bytes of the environment that begins with this, as it says; `None` if none does.
    #[inline(always)]
    pub fn length(&self) -> Option<usize> {
        if self.magic == Header::MAGIC { usize::try_from(self.bytes).ok() } else { None }
    }

    /// The same, if everything that it says can be.
    pub fn checked_length(&self) -> Option<usize> {
        let known = matches!(self.storage, WIS_STORAGE_PYRAMID | WIS_STORAGE_SPARSE);
        if self.magic != Header::MAGIC || !known || self.depth > MAX_DEPTH || self.flags & !ALL_FLAGS != 0 {
            return None;
        }
        if self.reserved != [0; 2]
            || self.refined > self.squares
            || (self.storage == WIS_STORAGE_SPARSE && self.refined != 0)
        {
            return None;
        }
        Parts::of(self).whole.bytes().filter(|bytes| *bytes as u64 == self.bytes)
    }
}

/// Checks everything in stored bytes that later calls rely on, and that nothing was changed.
fn check(view: &Environment) -> Result<()> {
    let header = view.header;
    let tree = match header.storage {
        WIS_STORAGE_SPARSE => Tree::<4>::sparse(header.depth, header.average, view.squares, view.links),
        _ => Tree::<4>::refined(header.depth, header.average, view.squares, view.marks, view.links),
    };
    tree.map_err(|_| Status::Corrupt)?;
    let mut colours = view.rgb.iter().flatten().chain([&header.rgb_average]).flatten();
    let finite = [header.power, header.error].iter().all(|value| (0.0..=f64::MAX).contains(value))
        && (0.0..=MAX_AVERAGE).contains(&header.average)
        && colours.all(|channel| (0.0..=f32::MAX).contains(channel));
    let sound = finite && exponent_is_of(header.exponent, header.power) && header.content_id == view.content_id();
    if sound { Ok(()) } else { Err(Status::Corrupt) }
}

/// Whether an exponent is that of the mean luminance of a map of this power.
fn exponent_is_of(exponent: i32, power: f64) -> bool {
    if power <= 0.0 {
        return exponent == 0;
    }
    // Luminance is a float, at least the smallest one times 0.07 over all texels.
    let stored_mean = times_power(power / (4.0 * PI), exponent.saturating_neg());
    (-256..=128).contains(&exponent) && (0.999_999..=2.000_001).contains(&stored_mean)
}

fn copy<T: Copy>(from: &[T], to: &mut [T]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
}
