//! Objects as bytes: a header, then arrays one behind the other, each aligned; and the only slices that are cut from memory without the
//! compiler's knowledge, outside of the boundary and the vector module.

use crate::numeric::ContentHash;
use crate::simd::{WINDOW, prefetch};
use crate::status::{Error, Status};
use bytemuck::{Pod, try_cast_slice_mut, try_from_bytes};
use core::ops::{Deref, Range};
use core::slice;

/// Every object, and every array if nothing else is said, begins at a multiple of this.
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

/// Writes the checksum of an object, and answers it.
pub fn write_checksum(bytes: &mut [u8]) -> u64 {
    let checksum = checksum(bytes);
    bytes.iter_mut().skip(CHECKSUM.start).zip(checksum.to_ne_bytes()).for_each(|(slot, byte)| *slot = byte);
    checksum
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
    /// So many elements from a byte on. No memory is as long as 2^63 bytes, so that what an object says in 64 bits needs no other check.
    #[inline(always)]
    pub const fn at(offset: u64, count: u64) -> Part {
        Part { offset: offset as usize, count: count as usize }
    }

    /// The array in the bytes of its object; empty if it does not fit or is misaligned.
    #[inline(always)]
    pub fn of<T: Pod>(self, bytes: &[u8]) -> &[T] {
        if !holds::<T>(bytes.as_ptr(), bytes.len(), self) {
            return &[];
        }
        // SAFETY: inside the bytes and aligned; any bits are a `T`, and the bytes are borrowed for as long.
        unsafe { slice::from_raw_parts(bytes.as_ptr().add(self.offset).cast(), self.count) }
    }

    /// The same, to write.
    pub fn of_mut<T: Pod>(self, bytes: &mut [u8]) -> &mut [T] {
        let end = self.offset.saturating_add(self.count.saturating_mul(size_of::<T>()));
        bytes.get_mut(self.offset..end).and_then(|part| try_cast_slice_mut(part).ok()).unwrap_or_default()
    }

    /// Some elements of it.
    #[inline(always)]
    fn elements<T>(self, first: usize, count: usize) -> Part {
        Part { offset: self.offset.saturating_add(first.saturating_mul(size_of::<T>())), count }
    }
}

/// Whether an array of `T` lies inside a block and is aligned.
#[inline(always)]
fn holds<T>(start: *const u8, bytes: usize, part: Part) -> bool {
    const { assert!(size_of::<T>() > 0) };
    let fits = part.offset <= bytes && part.count <= (bytes - part.offset) / size_of::<T>();
    fits && start.wrapping_add(part.offset).addr() % align_of::<T>() == 0
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
        Layout { end: size_of::<H>() as u64 }
    }

    /// Places an array.
    #[inline(always)]
    pub const fn part<T>(&mut self, count: u64) -> Part {
        self.aligned_part::<T>(count, ALIGNMENT as u64)
    }

    /// The same at a multiple of `alignment`.
    #[inline(always)]
    pub const fn aligned_part<T>(&mut self, count: u64, alignment: u64) -> Part {
        let offset = aligned(self.end, alignment);
        // What a header claims may be beyond all memory.
        self.end = offset.saturating_add(count.saturating_mul(size_of::<T>() as u64));
        Part::at(offset, count)
    }

    /// The bytes of the whole; `None` if no memory is as long.
    pub fn bytes(self) -> Option<usize> {
        let end = aligned(self.end, ALIGNMENT as u64);
        usize::try_from(end).ok().filter(|bytes| *bytes <= isize::MAX as usize)
    }
}

/// The next multiple of a power of two; near the end of all numbers the last one.
#[inline(always)]
const fn aligned(end: u64, alignment: u64) -> u64 {
    let below = alignment.wrapping_sub(1);
    end.saturating_add(below) & !below
}

/// A table of at least a [`WINDOW`], which is read a window at a time, without a branch. What is read beyond its last window is read
/// from there.
#[derive(Clone, Copy, Debug)]
pub struct Table<'a, T> {
    numbers: &'a [T],
    /// Where the last window begins: the length less a window.
    last: usize,
}

impl<'a, T> Table<'a, T> {
    /// The table of these numbers; `none` if they are fewer than a window.
    #[inline(always)]
    pub fn new(numbers: &'a [T], none: &'a [T; WINDOW]) -> Table<'a, T> {
        match numbers.len().checked_sub(WINDOW) {
            Some(last) => Table { numbers, last },
            None => Table { numbers: none, last: 0 },
        }
    }

    /// The window that begins at `first`.
    #[inline(always)]
    pub fn window(&self, first: usize) -> &'a [T; WINDOW] {
        let first = if first < self.last { first } else { self.last };
        // SAFETY: `last` and a window are the length of the table.
        unsafe { &*self.numbers.as_ptr().add(first).cast() }
    }

    /// The numbers at which a window can begin: all but the last window of them.
    pub fn beginnings(&self) -> &'a [T] {
        self.numbers.get(..self.last).unwrap_or(&[])
    }

    /// Asks for the cache line of a number.
    #[inline(always)]
    pub fn prefetch(&self, index: usize) {
        prefetch(self.numbers, index);
    }
}

/// Memory of an object that calls read, maybe many at once: it gives `&` and never `&mut`.
#[derive(Clone, Copy)]
pub(crate) struct Shared {
    start: *const u8,
    bytes: usize,
}

impl Shared {
    /// Checks a block that must hold `needed` bytes.
    pub(crate) fn new(start: *const u8, bytes: usize, needed: usize, argument: u32) -> Result<Shared, Error> {
        check_block(start, bytes, needed, argument)?;
        Ok(Shared { start, bytes: needed })
    }

    /// Elements `first..first + count` of an array; none if they do not fit.
    ///
    /// # Safety
    /// The bytes of the block are readable, and nobody writes these elements while the result lives, but for atomic ones.
    #[inline(always)]
    pub(crate) unsafe fn part<'a, T>(&self, array: Part, first: usize, count: usize) -> &'a [T] {
        let part = array.elements::<T>(first, count);
        if !holds::<T>(self.start, self.bytes, part) {
            return &[];
        }
        // SAFETY: inside the block and aligned, by `holds`; the rest is this function's contract.
        unsafe { slice::from_raw_parts(self.start.add(part.offset).cast(), count) }
    }

    /// A whole array.
    ///
    /// # Safety
    /// As [`Shared::part`].
    pub(crate) unsafe fn all<'a, T>(&self, array: Part) -> &'a [T] {
        // SAFETY: the caller's contract.
        unsafe { self.part(array, 0, array.count) }
    }
}

/// Memory in which threads build together: each writes elements of its own, and all read what is finished.
pub(crate) struct Divided {
    start: *mut u8,
    finished: Shared,
}

impl Deref for Divided {
    type Target = Shared;

    fn deref(&self) -> &Shared {
        &self.finished
    }
}

impl Divided {
    /// Checks a block that must hold `needed` bytes.
    pub(crate) fn new(start: *mut u8, bytes: usize, needed: usize, argument: u32) -> Result<Divided, Error> {
        Ok(Divided { start, finished: Shared::new(start, bytes, needed, argument)? })
    }

    /// Elements that are this thread's alone; none if they do not fit.
    ///
    /// # Safety
    /// The bytes of the block are writable, and no other slice of them that lives as long, of any thread, has an element in
    /// common with this one.
    #[inline(always)]
    pub(crate) unsafe fn part_mut<'a, T>(&self, array: Part, first: usize, count: usize) -> &'a mut [T] {
        let part = array.elements::<T>(first, count);
        if !holds::<T>(self.start, self.bytes, part) {
            return &mut [];
        }
        // SAFETY: inside the block and aligned, by `holds`; the rest is this function's contract.
        unsafe { slice::from_raw_parts_mut(self.start.add(part.offset).cast(), count) }
    }

    /// A whole array, when no other thread is at work on it.
    ///
    /// # Safety
    /// As [`Divided::part_mut`].
    pub(crate) unsafe fn all_mut<'a, T>(&self, array: Part) -> &'a mut [T] {
        // SAFETY: the caller's contract.
        unsafe { self.part_mut(array, 0, array.count) }
    }
}

/// Checks that an argument is a block of at least so many bytes.
pub(crate) fn check_block(start: *const u8, bytes: usize, needed: usize, argument: u32) -> Result<(), Error> {
    if start.is_null() {
        return Err(Error::new(Status::NullPointer, argument));
    }
    if start.addr() % ALIGNMENT != 0 {
        return Err(Error::new(Status::Misaligned, argument));
    }
    if bytes < needed { Err(Error::too_small(argument, needed)) } else { Ok(()) }
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

/// Memory that is handed out array by array; where it ends, it still counts what was asked for.
#[derive(Debug)]
pub struct Room<'a> {
    rest: &'a mut [u8],
    /// The bytes that were asked for; `None` if no memory is as long.
    pub asked: Option<usize>,
}

impl<'a> Room<'a> {
    /// A block; an empty one measures.
    pub fn new(rest: &'a mut [u8]) -> Room<'a> {
        Room { rest, asked: Some(0) }
    }

    /// The next array; none where memory has come to an end.
    pub fn take<T: Pod>(&mut self, count: usize) -> &'a mut [T] {
        let length = count.checked_mul(size_of::<T>()).and_then(|length| length.checked_next_multiple_of(ALIGNMENT));
        self.asked = self.asked.and_then(|asked| asked.checked_add(length?));
        take(&mut self.rest, count).unwrap_or_default()
    }
}
