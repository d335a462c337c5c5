//! Where the parts of a stored environment stand, and whether stored bytes are what they claim to be.

use super::{ALL_FLAGS, WIS_STORAGE_PYRAMID, WIS_STORAGE_SPARSE, WIS_WAVELET_LIGHT_COMPENSATED, WIS_WAVELET_LIGHT_RGB};
use crate::ffi::{ExclusiveBlock, SharedBlock, WIS_ALIGNMENT};
use crate::numeric::times_power;
use crate::status::{Result, Status};
use crate::wavelets::environment::{Distribution, Environment, Header, Inverse, MAGIC, RowNumbers, size_of_texels};
use crate::wavelets::tree::{Link, MAX_AVERAGE, MAX_DEPTH, Mark, Tree};
use core::f64::consts::PI;

/// Checks everything in stored bytes that later calls rely on, and that nothing was changed.
pub(super) fn check_stored(view: &Environment) -> Result<()> {
    let header = view.header;
    let tree = |average, squares| match header.storage {
        WIS_STORAGE_SPARSE => Tree::<4>::sparse(header.depth, average, squares, view.links),
        _ => Tree::<4>::refined(header.depth, average, squares, view.marks, view.links),
    };
    tree(header.average, view.squares)?;
    match &view.texels {
        Some(texels) if !texels.is_sound() => return Err(Status::Corrupt),
        None if header.flags & WIS_WAVELET_LIGHT_COMPENSATED != 0 => {
            tree(header.compensated_average, view.compensated)?;
        }
        _ => {}
    }
    let mut colours = view.rgb.iter().flatten().chain([&header.rgb_average]).flatten();
    let finite = [header.power, header.error].iter().all(|value| (0.0..=f64::MAX).contains(value))
        && (0.0..=MAX_AVERAGE).contains(&header.compensated_average)
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

/// How many squares a stored environment has.
#[derive(Clone, Copy)]
pub(super) struct Counts {
    pub(super) squares: u32,
    /// Squares below the cells of a pyramid of this depth.
    pub(super) refined: u32,
    pub(super) depth: u32,
    pub(super) sparse: bool,
    /// The texels that the compensated distribution keeps, as the header writes them.
    pub(super) texels: [u16; 2],
}

/// Where an array stands, and its length.
#[derive(Clone, Copy)]
pub(super) struct Part {
    pub(super) offset: usize,
    pub(super) count: usize,
}

/// Where the parts of a stored environment stand; what is not kept is empty.
#[derive(Clone, Copy)]
pub(super) struct Stored {
    pub(super) squares: Part,
    pub(super) marks: Part,
    pub(super) links: Part,
    pub(super) compensated: Part,
    pub(super) rgb: Part,
    pub(super) rows: Part,
    pub(super) starts: Part,
    pub(super) guides: Part,
    pub(super) bytes: usize,
}

impl Stored {
    /// The layout; `None` if it is longer than memory can be.
    pub(super) fn new(counts: Counts, flags: u32) -> Option<Stored> {
        let (stored, bytes) = Stored::layout(counts, flags);
        if bytes > isize::MAX as u64 { None } else { Some(stored) }
    }

    /// The layout and its bytes, which 64 bits always hold: every call on an environment comes through here.
    #[inline(always)]
    fn layout(counts: Counts, flags: u32) -> (Stored, u64) {
        const ALIGNMENT: u64 = WIS_ALIGNMENT as u64;
        let mut end = size_of::<Header>() as u64;
        let mut part = |count: u64, bytes_each: usize| {
            let start = end;
            end = (start + count * bytes_each as u64 + ALIGNMENT - 1) & !(ALIGNMENT - 1);
            Part { offset: start as usize, count: count as usize }
        };
        let (squares, refined) = (u64::from(counts.squares), u64::from(counts.refined));
        let when = |condition: bool, count: u64| if condition { count } else { 0 };
        let has = |flag: u32| flags & flag != 0;
        let cells = 1u64 << ((2 * counts.depth) & 31);
        let is_refined = !counts.sparse && refined > 0;
        let linked = if counts.sparse { squares } else { refined };
        let texels = size_of_texels(counts.texels);
        let keeps = texels[0] != 0;
        let [starts, guides] = Inverse::lengths(texels);
        let mut stored = Stored {
            squares: part(squares, size_of::<[f32; 4]>()),
            marks: part(when(is_refined, cells.div_ceil(32)), size_of::<Mark>()),
            links: part(linked, size_of::<Link>()),
            compensated: part(when(has(WIS_WAVELET_LIGHT_COMPENSATED) && !keeps, squares), size_of::<[f32; 4]>()),
            rgb: part(when(has(WIS_WAVELET_LIGHT_RGB), squares), size_of::<[[f32; 3]; 4]>()),
            rows: part(when(keeps, texels[0].into()), size_of::<RowNumbers>()),
            starts: part(when(keeps, starts), size_of::<u32>()),
            guides: part(when(keeps, guides), size_of::<u16>()),
            bytes: 0,
        };
        stored.bytes = end as usize;
        (stored, end)
    }

    pub(super) fn of_header(header: &Header) -> Option<Stored> {
        let storage_known = matches!(header.storage, WIS_STORAGE_PYRAMID | WIS_STORAGE_SPARSE);
        if header.magic != MAGIC || !storage_known || header.depth > MAX_DEPTH || header.flags & !ALL_FLAGS != 0 {
            return None;
        }
        let sparse = header.storage == WIS_STORAGE_SPARSE;
        if header.refined > header.squares || (sparse && header.refined != 0) {
            return None;
        }
        let possible = !sparse && header.flags & WIS_WAVELET_LIGHT_COMPENSATED != 0;
        if header.texels != [0; 2] && !possible {
            return None;
        }
        Stored::new(Counts::of(header), header.flags)
    }

    /// Whether the room behind odd numbers of marks and links is clear.
    ///
    /// # Safety
    /// As [`SharedBlock::slice`].
    pub(super) unsafe fn is_padding_clear(&self, block: &SharedBlock) -> bool {
        let Stored { marks, links, .. } = self;
        // SAFETY: the caller's contract; both parts are padded to the alignment of the next.
        unsafe {
            let marks = block.slice::<Mark>(marks.offset, marks.count, marks.count & 1);
            let links = block.slice::<Link>(links.offset, links.count, links.count & 1);
            marks.iter().all(|mark| *mark == Mark::default()) && links.iter().all(|link| *link == Link::default())
        }
    }

    /// Clears the room behind odd numbers of marks and links.
    ///
    /// # Safety
    /// As [`ExclusiveBlock::slice`].
    pub(super) unsafe fn clear_padding(&self, block: &ExclusiveBlock) {
        let Stored { marks, links, .. } = self;
        // SAFETY: the caller's contract; both parts are padded to the alignment of the next.
        unsafe {
            block.slice(marks.offset, marks.count, marks.count & 1).fill(Mark::default());
            block.slice(links.offset, links.count, links.count & 1).fill(Link::default());
        }
    }

    /// A part that is to be written.
    ///
    /// # Safety
    /// As [`ExclusiveBlock::slice`].
    pub(super) unsafe fn part<'a, T>(block: &ExclusiveBlock, part: Part) -> &'a mut [T] {
        // SAFETY: the caller's contract.
        unsafe { block.slice(part.offset, 0, part.count) }
    }

    /// The environment that begins with a header.
    ///
    /// # Safety
    /// Behind the header stand the parts of this layout, which nobody writes.
    #[inline(always)]
    pub(super) unsafe fn environment<'a>(&self, header: *const Header) -> Environment<'a> {
        /// # Safety
        /// The part lies in the object at `start`, aligned for `T`.
        #[inline(always)]
        unsafe fn array<'a, T>(start: *const Header, part: Part) -> &'a [T] {
            // SAFETY: the caller's contract.
            unsafe { core::slice::from_raw_parts(start.byte_add(part.offset).cast(), part.count) }
        }
        // SAFETY: the caller's contract; every part is aligned to WIS_ALIGNMENT.
        unsafe {
            Environment {
                header: &*header,
                squares: array(header, self.squares),
                marks: array(header, self.marks),
                links: array(header, self.links),
                compensated: array(header, self.compensated),
                rgb: array(header, self.rgb),
                texels: if self.rows.count == 0 {
                    None
                } else {
                    let parts = (array(header, self.starts), array(header, self.guides), array(header, self.rows));
                    Some(Distribution::of_texels((*header).texels, (*header).compensated_average, parts))
                },
            }
        }
    }
}

impl Counts {
    #[inline(always)]
    fn of(header: &Header) -> Counts {
        let Header { squares, refined, depth, storage, texels, .. } = *header;
        Counts { squares, refined, depth, sparse: storage == WIS_STORAGE_SPARSE, texels }
    }
}

/// The environment that begins with a header.
///
/// # Safety
/// The header is of an environment that this version built or opened, and the pointer may reach all of it.
#[inline(always)]
pub(super) unsafe fn opened<'a>(header: *const Header) -> Environment<'a> {
    // SAFETY: the caller's contract.
    unsafe { Stored::layout(Counts::of(&*header), (*header).flags).0.environment(header) }
}
