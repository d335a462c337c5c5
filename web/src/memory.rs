//! The module's heap: memory that only grows. What lives long is made once, and each map has a new instance of the module.

#[cfg(target_arch = "wasm32")]
mod heap {
    use core::alloc::{GlobalAlloc, Layout};
    use core::arch::wasm32::memory_grow;
    use core::sync::atomic::{AtomicUsize, Ordering::Relaxed};

    const PAGE: usize = 65536;

    /// The next free byte, and the end of the memory that was asked for.
    struct Heap {
        next: AtomicUsize,
        end: AtomicUsize,
    }

    #[global_allocator]
    static HEAP: Heap = Heap { next: AtomicUsize::new(0), end: AtomicUsize::new(0) };

    // SAFETY: blocks begin at multiples of the alignment, do not overlap, and lie in pages that this heap asked for.
    unsafe impl GlobalAlloc for Heap {
        unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
            let start = self.next.load(Relaxed).next_multiple_of(layout.align());
            let missing = (start + layout.size()).saturating_sub(self.end.load(Relaxed));
            if missing > 0 {
                let pages = missing.div_ceil(PAGE) + 1;
                let grown = memory_grow::<0>(pages);
                if grown == usize::MAX {
                    return core::ptr::null_mut();
                }
                let is_first = self.end.load(Relaxed) == 0;
                self.end.store((grown + pages) * PAGE, Relaxed);
                if is_first {
                    self.next.store(grown * PAGE, Relaxed);
                    // SAFETY: the same request, which the first page cannot miss any more but by what it asked for.
                    return unsafe { self.alloc(layout) };
                }
            }
            self.next.store(start + layout.size(), Relaxed);
            start as *mut u8
        }

        unsafe fn dealloc(&self, _: *mut u8, _: Layout) {}
    }
}
