//! Cold caches: between two pixels a renderer walks through geometry, textures and frame buffers, so a sampler finds its
//! own data in far memory. Here other memory is touched in their place.

use std::hint::black_box;

/// Other memory, larger than the near caches.
pub struct Cold {
    lines: Vec<Line>,
}

/// A line of the cache.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Line(u64);

/// What is touched.
const BYTES: usize = 32 << 20;

impl Default for Cold {
    fn default() -> Cold {
        Cold { lines: vec![Line(1); BYTES / size_of::<Line>()] }
    }
}

impl Cold {
    /// Reads and writes every line.
    pub fn touch(&mut self) {
        for line in &mut self.lines {
            line.0 = line.0.wrapping_add(1);
        }
        black_box(&mut self.lines);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    /// Reading a megabyte at random takes longer after a touch than right after it was read. The fastest of some rounds:
    /// other programs only make a round longer.
    #[test]
    fn what_was_near_is_far_after_a_touch() {
        let mut cold = Cold::default();
        // Each place is read from the one before, so that no load can run ahead; they form one cycle.
        const PLACES: u32 = 1 << 18;
        let next = |i: u32| i.wrapping_mul(1_664_525).wrapping_add(1_013_904_223) % PLACES;
        let near: Vec<u32> = (0..PLACES).map(next).collect();
        let walk = || {
            let start = Instant::now();
            let last = (0..4000).fold(0u32, |at, _| near[at as usize]);
            black_box(last);
            start.elapsed().as_secs_f64()
        };
        let fastest =
            |mut before: Box<dyn FnMut() + '_>| (0..20).map(|_| (before(), walk()).1).fold(f64::INFINITY, f64::min);
        let warm = fastest(Box::new(|| _ = walk()));
        let far = fastest(Box::new(|| cold.touch()));
        println!("{:.1} ns near, {:.1} ns far", warm / 4e-6, far / 4e-6);
        assert!(far > 1.5 * warm, "{warm} {far}");
    }
}
