//! Objects as bytes: a header, then arrays one behind the other, each aligned to [`ALIGNMENT`].

use crate::numeric::ContentHash;
use bytemuck::{Pod, try_cast_slice, try_cast_slice_mut, try_from_bytes};
use core::ops::Range;

/// Every array of an object begins at a multiple of this.
pub const ALIGNMENT: usize = 16;

/// The header of an object that may come from a file.
pub trait Magic {
    /// The first eight bytes, as a number: kind and version of the format, and the byte order.
    const MAGIC: u64;
}

/// Where objects with a [`checksum`] keep it, in the byte order of the machine.
pub const CHECKSUM: Range<usize> = 16..24;

/// A hash of all bytes of an object but for the checksum itself.
pub fn checksum(bytes: &[u8]) -> u64 {
    let mut hash = ContentHash::new();
    hash.add_bytes(bytes.get(..CHECKSUM.start).unwrap_or(&[]));
    hash.add_bytes(bytes.get(CHECKSUM.end..).unwrap_or(&[]));
    hash.finish()
}

/// Writes the checksum of an object.
pub fn write_checksum(bytes: &mut [u8]) {
    let checksum = checksum(bytes).to_ne_bytes();
    bytes.iter_mut().skip(CHECKSUM.start).zip(checksum).for_each(|(slot, byte)| *slot = byte);
}

/// Whether an object has the checksum of its bytes.
pub fn has_checksum(bytes: &[u8]) -> bool {
    bytes.get(CHECKSUM) == Some(&checksum(bytes).to_ne_bytes())
}

/// The memory of a build, at most.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Bytes of the object.
    pub bytes: usize,
    /// Bytes that only the build needs.
    pub scratch: usize,
}

/// Where an array stands, and its length.
#[derive(Clone, Copy, Debug, Default)]
pub struct Part {
    /// The bytes before it.
    pub offset: usize,
    /// Elements.
    pub count: usize,
}

impl Part {
    /// The array in the bytes of its object; empty if it does not fit.
    #[inline(always)]
    pub fn of<T: Pod>(self, bytes: &[u8]) -> &[T] {
        let end = self.offset.wrapping_add(self.count.wrapping_mul(size_of::<T>()));
        bytes.get(self.offset..end).and_then(|part| try_cast_slice(part).ok()).unwrap_or(&[])
    }
}

/// Arrays that are placed one behind the other.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    end: u64,
}

impl Layout {
    /// Nothing but a header.
    #[inline(always)]
    pub const fn behind<H>() -> Layout {
        Layout { end: aligned(size_of::<H>() as u64) }
    }

    /// Places an array of fewer than 2^48 bytes.
    #[inline(always)]
    pub const fn part<T>(&mut self, count: u64) -> Part {
        let part = Part { offset: self.end as usize, count: count as usize };
        self.end = aligned(self.end + count * size_of::<T>() as u64);
        part
    }

    /// The bytes of the whole; `None` if no memory is as long.
    pub fn bytes(self) -> Option<usize> {
        usize::try_from(self.end).ok().filter(|bytes| *bytes <= isize::MAX as usize)
    }
}

const fn aligned(end: u64) -> u64 {
    (end + ALIGNMENT as u64 - 1) & !(ALIGNMENT as u64 - 1)
}

/// What bytes begin with; `None` if they are too few, or not aligned.
#[inline(always)]
pub fn header<H: Pod>(bytes: &[u8]) -> Option<&H> {
    try_from_bytes(bytes.get(..size_of::<H>())?).ok()
}

/// Writes what an object begins with.
pub fn write_header<H: Pod>(bytes: &mut [u8], header: &H) {
    bytes.iter_mut().zip(bytemuck::bytes_of(header)).for_each(|(slot, byte)| *slot = *byte);
}

/// Takes the first `count` elements of a block off it, and what stands between them and the next multiple of the alignment.
pub fn take<'a, T: Pod>(bytes: &mut &'a mut [u8], count: usize) -> Option<&'a mut [T]> {
    let length = count.checked_mul(size_of::<T>())?;
    let (first, rest) = core::mem::take(bytes).split_at_mut_checked(length.checked_next_multiple_of(ALIGNMENT)?)?;
    *bytes = rest;
    try_cast_slice_mut(first.get_mut(..length)?).ok()
}

/// The bytes that [`take`] takes.
pub fn taken<T>(count: usize) -> Option<usize> {
    count.checked_mul(size_of::<T>())?.checked_next_multiple_of(ALIGNMENT)
}
