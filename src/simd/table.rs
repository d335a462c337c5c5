//! Tables of numbers that are read a window at a time, without a branch.

use super::WINDOW;
use bytemuck::Pod;

/// A table of at least a window. What is read beyond its last window is read from there.
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

    /// All numbers.
    pub fn numbers(&self) -> &'a [T] {
        self.numbers
    }

    /// The numbers at which a window can begin: all but the last window of them.
    pub fn beginnings(&self) -> &'a [T] {
        self.numbers.get(..self.last).unwrap_or(&[])
    }

    /// Asks for the cache line of a number.
    #[inline(always)]
    pub fn prefetch(&self, index: usize) {
        super::prefetch(self.numbers, index);
    }
}

/// Bytes of which tables are cut.
#[derive(Clone, Copy, Debug)]
pub struct Blob<'a> {
    bytes: &'a [u8],
    checks: bool,
}

impl<'a> Blob<'a> {
    /// What is cut from these bytes.
    #[inline(always)]
    pub fn new(bytes: &'a [u8]) -> Blob<'a> {
        Blob { bytes, checks: true }
    }

    /// As [`Blob::new`], of bytes whose parts need no check: each sample cuts all tables.
    ///
    /// # Safety
    /// All parts that are cut from it lie in the bytes and are aligned.
    #[inline(always)]
    pub unsafe fn trusted(bytes: &'a [u8]) -> Blob<'a> {
        Blob { bytes, checks: false }
    }

    /// `count` elements from byte `start` on; empty if they do not fit or are misaligned.
    #[inline(always)]
    pub fn part<T: Pod>(&self, start: u64, count: u64) -> &'a [T] {
        const { assert!(size_of::<T>() > 0 && size_of::<usize>() <= size_of::<u64>()) };
        let length = self.bytes.len() as u64;
        let at = self.bytes.as_ptr().wrapping_add(start as usize);
        let fits = || start <= length && count <= (length - start) / size_of::<T>() as u64;
        if self.checks && (!fits() || at.addr() % align_of::<T>() != 0) {
            return &[];
        }
        // SAFETY: inside the bytes and aligned, as checked or by the word of `trusted`; any bits are a `T`, and the bytes are borrowed for as long.
        unsafe { core::slice::from_raw_parts(at.cast::<T>(), count as usize) }
    }
}
