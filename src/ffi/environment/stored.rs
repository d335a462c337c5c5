//! Where the parts of a stored environment stand, and whether stored bytes are what they claim to be.

use super::super::{Block, WIS_ALIGNMENT};
use super::{ALL_FLAGS, WIS_ENVIRONMENT_COMPENSATED, WIS_ENVIRONMENT_RGB, WIS_STORAGE_PYRAMID, WIS_STORAGE_SPARSE};
use crate::environment::{Environment, Header, MAGIC};
use crate::status::{Result, Status};
use crate::tree::{Link, MAX_DEPTH, Tree};

/// Checks everything in stored bytes that later calls rely on, and that nothing was changed.
pub(super) fn check_stored(view: &Environment) -> Result<()> {
    let header = view.header;
    let tree = |average, squares| match header.storage {
        WIS_STORAGE_SPARSE => Tree::<4>::sparse(header.depth, average, squares, view.links),
        _ => Tree::<4>::complete(header.depth, average, squares),
    };
    tree(header.average, view.squares)?;
    if header.flags & WIS_ENVIRONMENT_COMPENSATED != 0 {
        tree(header.compensated_average, view.compensated)?;
    }
    let mut colours = view.rgb.iter().flatten().chain([&header.rgb_average]).flatten();
    let finite = [header.power, header.error].iter().all(|value| (0.0..=f64::MAX).contains(value))
        && colours.all(|channel| (0.0..=f32::MAX).contains(channel));
    let unchanged = header.reserved == [0; 2] && header.content_id == view.content_id();
    if finite && unchanged { Ok(()) } else { Err(Status::Corrupt) }
}

/// Where the parts of a stored environment stand.
#[derive(Clone, Copy)]
pub(super) struct Stored {
    pub(super) squares: usize,
    pub(super) links: Option<usize>,
    pub(super) compensated: Option<usize>,
    pub(super) rgb: Option<usize>,
    pub(super) count: usize,
    pub(super) bytes: usize,
}

impl Stored {
    pub(super) fn new(count: usize, sparse: bool, flags: u32) -> Option<Stored> {
        let mut end = size_of::<Header>();
        let mut part = |bytes_each: usize| {
            let start = end;
            end = count.checked_mul(bytes_each)?.checked_add(start)?.checked_next_multiple_of(WIS_ALIGNMENT)?;
            Some(start)
        };
        let squares = part(size_of::<[f32; 4]>())?;
        let links = if sparse { Some(part(size_of::<Link>())?) } else { None };
        let has = |flag: u32| flags & flag != 0;
        let compensated = if has(WIS_ENVIRONMENT_COMPENSATED) { Some(part(size_of::<[f32; 4]>())?) } else { None };
        let rgb = if has(WIS_ENVIRONMENT_RGB) { Some(part(size_of::<[[f32; 3]; 4]>())?) } else { None };
        if end > isize::MAX as usize {
            return None;
        }
        Some(Stored { squares, links, compensated, rgb, count, bytes: end })
    }

    pub(super) fn of_header(header: &Header) -> Option<Stored> {
        let storage_known = matches!(header.storage, WIS_STORAGE_PYRAMID | WIS_STORAGE_SPARSE);
        if header.magic != MAGIC || !storage_known || header.depth > MAX_DEPTH || header.flags & !ALL_FLAGS != 0 {
            return None;
        }
        Stored::new(header.squares as usize, header.storage == WIS_STORAGE_SPARSE, header.flags)
    }

    /// The room behind an odd number of links.
    ///
    /// # Safety
    /// As [`Block::slice`].
    pub(super) unsafe fn padding<'a>(&self, block: &Block) -> &'a mut [Link] {
        // SAFETY: the caller's contract; the links are padded to the alignment of the next part.
        self.links.map_or(&mut [], |links| unsafe { block.slice(links, self.count, self.count & 1) })
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
                links: self.links.map_or(&[], |offset| block.slice(offset, 0, self.count)),
                compensated: self.compensated.map_or(&[], |offset| block.slice(offset, 0, self.count)),
                rgb: self.rgb.map_or(&[], |offset| block.slice(offset, 0, self.count)),
            })
        }
    }
}
