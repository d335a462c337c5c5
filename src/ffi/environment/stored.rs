//! Where the parts of a stored environment stand, and whether stored bytes are what they claim to be.

use super::super::{Block, WIS_ALIGNMENT};
use super::{ALL_FLAGS, WIS_ENVIRONMENT_COMPENSATED, WIS_ENVIRONMENT_RGB, WIS_STORAGE_PYRAMID, WIS_STORAGE_SPARSE};
use crate::environment::{Environment, Header, MAGIC};
use crate::status::{Result, Status};
use crate::tree::{Link, MAX_DEPTH, Mark, Tree};

/// Checks everything in stored bytes that later calls rely on, and that nothing was changed.
pub(super) fn check_stored(view: &Environment) -> Result<()> {
    let header = view.header;
    let tree = |average, squares| match header.storage {
        WIS_STORAGE_SPARSE => Tree::<4>::sparse(header.depth, average, squares, view.links),
        _ => Tree::<4>::refined(header.depth, average, squares, view.marks, view.links),
    };
    tree(header.average, view.squares)?;
    if header.flags & WIS_ENVIRONMENT_COMPENSATED != 0 {
        tree(header.compensated_average, view.compensated)?;
    }
    let mut colours = view.rgb.iter().flatten().chain([&header.rgb_average]).flatten();
    let finite = [header.power, header.error].iter().all(|value| (0.0..=f64::MAX).contains(value))
        && colours.all(|channel| (0.0..=f32::MAX).contains(channel));
    let unchanged = header.reserved == 0 && header.content_id == view.content_id();
    if finite && unchanged { Ok(()) } else { Err(Status::Corrupt) }
}

/// How many squares a stored environment has.
#[derive(Clone, Copy)]
pub(super) struct Counts {
    pub(super) squares: usize,
    /// Squares below the cells of a pyramid of this depth.
    pub(super) refined: usize,
    pub(super) depth: u32,
    pub(super) sparse: bool,
}

/// Where the parts of a stored environment stand.
#[derive(Clone, Copy)]
pub(super) struct Stored {
    pub(super) squares: usize,
    pub(super) marks: usize,
    pub(super) links: usize,
    pub(super) compensated: Option<usize>,
    pub(super) rgb: Option<usize>,
    pub(super) count: usize,
    pub(super) mark_count: usize,
    pub(super) link_count: usize,
    pub(super) bytes: usize,
}

impl Stored {
    pub(super) fn new(counts: Counts, flags: u32) -> Option<Stored> {
        let mut end = size_of::<Header>();
        let mut part = |count: usize, bytes_each: usize| {
            let start = end;
            end = count.checked_mul(bytes_each)?.checked_add(start)?.checked_next_multiple_of(WIS_ALIGNMENT)?;
            Some(start)
        };
        let count = counts.squares;
        let link_count = if counts.sparse { count } else { counts.refined };
        let cells = 1usize << (2 * counts.depth);
        let mark_count = if counts.sparse || counts.refined == 0 { 0 } else { cells.div_ceil(32) };
        let squares = part(count, size_of::<[f32; 4]>())?;
        let marks = part(mark_count, size_of::<Mark>())?;
        let links = part(link_count, size_of::<Link>())?;
        let mut when = |flag: u32, bytes_each: usize| {
            if flags & flag != 0 { part(count, bytes_each).map(Some) } else { Some(None) }
        };
        let compensated = when(WIS_ENVIRONMENT_COMPENSATED, size_of::<[f32; 4]>())?;
        let rgb = when(WIS_ENVIRONMENT_RGB, size_of::<[[f32; 3]; 4]>())?;
        if end > isize::MAX as usize {
            return None;
        }
        Some(Stored { squares, marks, links, compensated, rgb, count, mark_count, link_count, bytes: end })
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
        let (squares, refined) = (header.squares as usize, header.refined as usize);
        Stored::new(Counts { squares, refined, depth: header.depth, sparse }, header.flags)
    }

    /// The room behind odd numbers of marks and links.
    ///
    /// # Safety
    /// As [`Block::slice`].
    pub(super) unsafe fn padding<'a>(&self, block: &Block) -> (&'a mut [Mark], &'a mut [Link]) {
        // SAFETY: the caller's contract; both parts are padded to the alignment of the next.
        unsafe {
            (
                block.slice(self.marks, self.mark_count, self.mark_count & 1),
                block.slice(self.links, self.link_count, self.link_count & 1),
            )
        }
    }

    /// The environment in a block.
    ///
    /// # Safety
    /// The block holds an environment of this layout that nobody writes.
    #[inline(always)]
    pub(super) unsafe fn view<'a>(&self, block: &Block) -> Option<Environment<'a>> {
        // SAFETY: the caller's contract; the parts lie inside the block.
        unsafe {
            Some(Environment {
                header: block.slice::<Header>(0, 0, 1).first()?,
                squares: block.slice(self.squares, 0, self.count),
                marks: block.slice(self.marks, 0, self.mark_count),
                links: block.slice(self.links, 0, self.link_count),
                compensated: self.compensated.map_or(&[], |offset| block.slice(offset, 0, self.count)),
                rgb: self.rgb.map_or(&[], |offset| block.slice(offset, 0, self.count)),
            })
        }
    }
}
