//! Memory of exactly as many bytes as a call is told, so that a memory checker sees every access beyond them.

use std::alloc::{Layout, alloc, dealloc, handle_alloc_error};
use std::ops::{Deref, DerefMut};

/// What nobody has written yet.
pub const SENTINEL: u8 = 0xa5;

const ALIGNMENT: usize = 16;

/// Bytes that begin `offset` bytes behind a multiple of 16.
pub struct Block {
    start: *mut u8,
    offset: usize,
    len: usize,
}

impl Block {
    pub fn new(content: &[u8], offset: usize) -> Block {
        let layout = Block::layout(offset, content.len());
        // SAFETY: the layout is not empty.
        let start = unsafe { alloc(layout) };
        if start.is_null() {
            handle_alloc_error(layout);
        }
        // SAFETY: the memory holds offset + len bytes.
        unsafe { start.add(offset).copy_from_nonoverlapping(content.as_ptr(), content.len()) };
        Block { start, offset, len: content.len() }
    }

    pub fn unwritten(len: usize) -> Block {
        Block::new(&vec![SENTINEL; len], 0)
    }

    pub fn pointer(&self) -> *mut u8 {
        // SAFETY: inside the memory, or at its end.
        unsafe { self.start.add(self.offset) }
    }

    /// Edits the struct that begins the block, which is aligned for it.
    pub fn edit<T: Copy>(&mut self, edit: impl FnOnce(&mut T)) {
        assert!(self.len >= size_of::<T>() && self.pointer().cast::<T>().is_aligned());
        // SAFETY: long enough and aligned; the structs of the boundary are valid with any bytes that tests give.
        edit(unsafe { &mut *self.pointer().cast::<T>() });
    }

    fn layout(offset: usize, len: usize) -> Layout {
        Layout::from_size_align((offset + len).max(1), ALIGNMENT).expect("the tests' blocks are small")
    }
}

impl Deref for Block {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        // SAFETY: len initialised bytes stand there.
        unsafe { std::slice::from_raw_parts(self.pointer(), self.len) }
    }
}

impl DerefMut for Block {
    fn deref_mut(&mut self) -> &mut [u8] {
        // SAFETY: len initialised bytes stand there.
        unsafe { std::slice::from_raw_parts_mut(self.pointer(), self.len) }
    }
}

impl Drop for Block {
    fn drop(&mut self) {
        // SAFETY: allocated with this layout.
        unsafe { dealloc(self.start, Block::layout(self.offset, self.len)) };
    }
}

/// The bytes of a struct of the boundary: zeros, but for the fields that `set` assigns.
pub fn plain<T: Copy>(set: impl FnOnce(&mut T)) -> Vec<u8> {
    let mut block = Block::new(&vec![0; size_of::<T>()], 0);
    block.edit(set);
    block.to_vec()
}
