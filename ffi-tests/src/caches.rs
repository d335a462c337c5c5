//! What stands in the caches when a hit begins. Between two hits a renderer walks through geometry, textures and frame buffers, so a
//! sampler finds its tables and its code farther away than in a loop of its own. Here other work takes the place of the renderer's.

use crate::embree::Tracer;
use crate::mesh::Mesh;
use glam::Vec3;
use std::hint::black_box;

/// The models, by name, in the order of all tables: claims stand on the first, the others stand beside it.
pub const CACHES: [&str; 3] = ["renderer", "warm", "cold"];
pub const RENDERER: usize = 0;
pub const WARM: usize = 1;
pub const COLD: usize = 2;

/// How many times its warm time a call of version 0.2 takes in a renderer, at least and at most: 1.20 to 1.26 times in pbrt-v3. The
/// work of [`Renderer`] is right if it does so, too.
pub const SLOWER: [f64; 2] = [1.15, 1.35];

/// A line of the cache.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Line(u64);

/// Memory of others.
struct Memory(Vec<Line>);

impl Memory {
    /// Written, since memory that never was costs more than the touch.
    fn new(bytes: usize) -> Memory {
        Memory(vec![Line(1); bytes / size_of::<Line>()])
    }

    /// Part `number` of those that are `bytes` long, from the first again after the last.
    fn read(&self, number: usize, bytes: usize) {
        let lines = bytes / size_of::<Line>();
        let parts = self.0.len() / lines;
        let part = &self.0[number % parts * lines..][..lines];
        black_box(part.iter().fold(0, |sum: u64, line| sum.wrapping_add(line.0)));
    }

    fn write(&mut self) {
        self.0.iter_mut().for_each(|line| line.0 = line.0.wrapping_add(1));
        black_box(&mut self.0);
    }
}

/// Memory larger than the near caches.
pub struct Cold(Memory);

impl Default for Cold {
    fn default() -> Cold {
        Cold(Memory::new(32 << 20))
    }
}

impl Cold {
    /// Reads and writes every line.
    pub fn touch(&mut self) {
        self.0.write();
    }
}

/// What runs before a hit in each of `CACHES`.
#[derive(Default)]
pub struct Others {
    cold: Cold,
    renderer: Renderer,
}

impl Others {
    pub fn run(&mut self, caches: usize) {
        match caches {
            RENDERER => self.renderer.hit(),
            COLD => self.cold.touch(),
            _ => (),
        }
    }
}

/// What a renderer does between two hits: a ray through the scene, and its materials, textures and film.
struct Renderer {
    tracer: Tracer,
    memory: Memory,
    pixel: usize,
}

/// Vertices along each side of a hilly ground of a million triangles.
const SIDE: u32 = 708;
/// Pixels along each side of the image and of a tile.
const IMAGE: usize = 512;
const TILE: usize = 16;
/// What a hit reads beside the ray.
const READ: usize = 256 << 10;
/// What hits read in turns. With the same 256 kB at each hit a call of 0.2 takes 1.11 times its warm time: too little.
const FILM: usize = 16 << 20;

impl Default for Renderer {
    fn default() -> Renderer {
        let mut ground = Mesh::grid(1.0, SIDE);
        for v in &mut ground.vertices {
            v.z = 0.1 * (9.0 * v.x).sin() * (7.0 * v.y).cos() + 0.01 * (61.0 * v.x + 53.0 * v.y).sin();
        }
        let tracer = Tracer::new(&[ground]).expect("a ground without faults");
        Renderer { tracer, memory: Memory::new(FILM), pixel: 0 }
    }
}

impl Renderer {
    /// Traces the ray of the next pixel, tile after tile, and reads memory.
    fn hit(&mut self) {
        let (tile, within) = (self.pixel / (TILE * TILE), self.pixel % (TILE * TILE));
        let across = IMAGE / TILE;
        let at = |tile: usize, within: usize| ((tile * TILE + within) as f32 + 0.5) / IMAGE as f32 - 0.5;
        let (x, y) = (at(tile % across, within % TILE), at(tile / across, within / TILE));
        black_box(self.tracer.intersect(Vec3::new(0.0, -0.9, 1.2), Vec3::new(1.2 * x, 0.9 + y, -1.2).normalize()));
        self.pixel = (self.pixel + 1) % (IMAGE * IMAGE);
        self.memory.read(self.pixel, READ);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    /// Reading a megabyte at random takes longer after a touch than right after it was read. The fastest of some rounds:
    /// other programs only make a round longer.
    #[test]
    fn what_was_near_is_far_after_a_touch_and_between_in_a_renderer() {
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
        let mut renderer = Renderer::default();
        let between = fastest(Box::new(|| renderer.hit()));
        println!("{:.1} ns near, {:.1} ns in a renderer, {:.1} ns far", warm / 4e-6, between / 4e-6, far / 4e-6);
        assert!(far > 1.5 * warm && (0.9 * warm..far).contains(&between), "{warm} {between} {far}");
    }
}
