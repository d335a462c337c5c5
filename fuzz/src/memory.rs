//! Memory between guard pages: each region is mapped twice, once to write and once to read only.

use std::ptr::null_mut;
use std::slice;

/// Bytes of a region: room for an environment of 100000 texels.
pub const CAPACITY: usize = 1 << 20;
/// Bytes before and behind what a call is given that must not change.
const MARGIN: usize = 64;
/// What stands there.
const CANARY: u8 = 0x5c;
const PAGE: usize = 4096;

/// Bytes in a region.
#[derive(Clone, Copy, Debug, Default)]
pub struct Place {
    region: usize,
    start: usize,
    pub len: usize,
}

/// Regions of [`CAPACITY`] bytes.
pub struct Memory {
    writers: *mut u8,
    readers: *mut u8,
    regions: usize,
}

impl Memory {
    pub fn new(regions: usize) -> Memory {
        // SAFETY: plain system calls; the file lives as long as its mappings.
        let file = unsafe { libc::memfd_create(c"wis-fuzz".as_ptr(), 0) };
        assert!(file >= 0 && unsafe { libc::ftruncate(file, (regions * CAPACITY) as i64) } == 0, "no memory");
        let map = |protection| {
            // SAFETY: the fixed mappings lie inside the reserved range.
            unsafe {
                let reserved = regions * (CAPACITY + PAGE) + PAGE;
                let flags = libc::MAP_PRIVATE | libc::MAP_ANONYMOUS | libc::MAP_NORESERVE;
                let base = libc::mmap(null_mut(), reserved, libc::PROT_NONE, flags, -1, 0).cast::<u8>();
                for region in 0..regions {
                    let (at, flags) = (base.add(offset(region)), libc::MAP_SHARED | libc::MAP_FIXED);
                    let mapped = libc::mmap(at.cast(), CAPACITY, protection, flags, file, (region * CAPACITY) as i64);
                    assert_eq!(mapped.cast(), at, "no memory");
                }
                base
            }
        };
        Memory { writers: map(libc::PROT_READ | libc::PROT_WRITE), readers: map(libc::PROT_READ), regions }
    }

    /// So many bytes that end at the guard page, or begin there, but for alignment, with canaries around them.
    /// `beside`: bytes behind a multiple of the alignment.
    pub fn place(&self, region: usize, len: usize, align: usize, beside: usize, at_end: bool) -> Place {
        assert!(region < self.regions && len + align + beside <= CAPACITY, "{len} bytes");
        let start = if at_end { ((CAPACITY - len - beside) & !(align - 1)) + beside } else { beside };
        let place = Place { region, start, len };
        for margin in self.margins(place) {
            margin.fill(CANARY);
        }
        place
    }

    /// Where the library may write.
    pub fn writer(&self, place: Place) -> *mut u8 {
        // SAFETY: inside the mapping.
        unsafe { self.writers.add(offset(place.region) + place.start) }
    }

    /// Where it may only read.
    pub fn reader(&self, place: Place) -> *const u8 {
        // SAFETY: inside the mapping.
        unsafe { self.readers.add(offset(place.region) + place.start) }
    }

    #[allow(clippy::mut_from_ref)]
    pub fn bytes(&self, place: Place) -> &mut [u8] {
        // SAFETY: inside the mapping; nobody holds two views of a place.
        unsafe { slice::from_raw_parts_mut(self.writer(place), place.len) }
    }

    /// Whether the bytes around a place are as they were.
    pub fn is_intact(&self, place: Place) -> bool {
        self.margins(place).iter().all(|margin| margin.iter().all(|byte| *byte == CANARY))
    }

    fn margins(&self, Place { region, start, len }: Place) -> [&mut [u8]; 2] {
        let before = start.min(MARGIN);
        let behind = (CAPACITY - start - len).min(MARGIN);
        [(start - before, before), (start + len, behind)].map(|(start, len)| self.bytes(Place { region, start, len }))
    }
}

fn offset(region: usize) -> usize {
    PAGE + region * (CAPACITY + PAGE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A byte that is written before or behind a block is seen; at the guard page it would end the program.
    #[test]
    fn writes_beside_a_block_are_seen() {
        let memory = Memory::new(1);
        for at_end in [false, true] {
            for beside in [-1, 33] {
                let place = memory.place(0, 33, 16, if at_end { 0 } else { 16 }, at_end);
                assert!(memory.is_intact(place));
                // SAFETY: the byte is in the region.
                unsafe { memory.writer(place).offset(beside).write(1) };
                assert!(!memory.is_intact(place), "{at_end} {beside}");
            }
        }
    }

    #[test]
    fn what_is_written_is_read_elsewhere() {
        let memory = Memory::new(2);
        let place = memory.place(1, 8, 8, 0, true);
        memory.bytes(place).copy_from_slice(&[7; 8]);
        assert_ne!(memory.reader(place), memory.writer(place).cast_const());
        // SAFETY: eight bytes stand there.
        assert_eq!(unsafe { slice::from_raw_parts(memory.reader(place), 8) }, [7; 8]);
    }
}
