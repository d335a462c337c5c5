//! What rays saw from places of the scene in earlier passes, as a factor of the target of direct light.
//!
//! A place is a key of the client's: a tile of pixels, or a piece of surface. Its rays are counted in 64 cells of equal solid
//! angle, in world space. A ray to a cell that was blocked before is traced less often, so that more of the others are.
//!
//! Two things keep estimates sound. The pixels fall into two halves, each of which reads what the other counted: no pixel reads
//! its own rays, with which its later points share a sequence. And counts become factors between passes only; they are integers,
//! added atomically, so that neither threads nor their order change a bit.

use crate::blob::{Layout, Part};
use crate::numeric::{max, sqrt};
use crate::points::dimension_seed;
use crate::simd::{Num, Whole};
use crate::sphere::square;
use core::sync::atomic::{AtomicU32, Ordering};
use glam::Vec3;

/// The square of directions has 2^LEVEL cells along each axis.
const LEVEL: u32 = 3;
/// Cells of a place.
pub const CELLS: usize = 1 << (2 * LEVEL);
/// Halves of the pixels.
pub const HALVES: usize = 2;
/// The most places.
pub const MAX_PLACES: u32 = 1 << 20;

/// The factor of light that is always seen, of which factors are parts.
const SEEN: f32 = 255.0;
/// No cell has a smaller factor: shadows have edges inside a cell, and other pixels of a place see other things.
const LEAST: f32 = 0.1;
/// How many rays the mean over all cells of a place counts as in each of them; with 2 the variance after 8 passes is a tenth higher.
const SMOOTHING: f32 = 0.7;

/// Rays to a cell that were traced.
const TRACED: usize = 0;
/// Rays to a cell that reached the light.
const REACHED: usize = 1;

/// The factors of the cells of a place for one half of the pixels, in 255ths.
pub type Factors = [u8; CELLS];
/// The rays of one half of the pixels from a place, by cell: traced, and reached the light.
pub type Counts = [[AtomicU32; 2]; CELLS];

/// What a cache begins with.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Header {
    magic: u64,
    places: u32,
    reserved: u32,
}

/// "wisvis" and the version of the format.
const MAGIC: u64 = u64::from_le_bytes(*b"wisvis\x02\x00");

/// Where the header, counts and factors of a cache stand.
#[derive(Clone, Copy, Debug)]
pub struct Arrays {
    /// One [`Header`].
    pub header: Part,
    /// [`Counts`], an element for each half of a place.
    pub counts: Part,
    /// [`Factors`], as many.
    pub factors: Part,
    /// Of the whole.
    pub bytes: usize,
}

impl Arrays {
    /// The arrays of a cache of so many places; `None` for none, or more than [`MAX_PLACES`].
    pub fn new(places: u32) -> Option<Arrays> {
        let count = HALVES as u64 * u64::from(places);
        let mut whole = Layout::behind::<Header>();
        let (counts, factors) = (whole.part::<Counts>(count), whole.part::<Factors>(count));
        let arrays = Arrays { header: Part { offset: 0, count: 1 }, counts, factors, bytes: whole.bytes()? };
        Some(arrays).filter(|_| (1..=MAX_PLACES).contains(&places))
    }
}

impl Header {
    /// That of a cache of so many places.
    pub fn new(places: u32) -> Header {
        Header { magic: MAGIC, places, reserved: 0 }
    }

    /// The arrays of the cache that begins with this; `None` if none does.
    pub fn arrays(&self) -> Option<Arrays> {
        if self.magic == MAGIC { Arrays::new(self.places) } else { None }
    }
}

/// What was counted in all places, and the factors that earlier passes left. Element `HALVES place + half` of both.
#[derive(Clone, Copy, Debug)]
pub struct VisibilityCache<'a> {
    /// Counts of this and of earlier passes.
    pub counts: &'a [Counts],
    /// What a half reads.
    pub factors: &'a [Factors],
}

/// The half of a pixel.
fn half(seed: u32) -> usize {
    /// Another sequence than those of points.
    const HALF: u32 = 0x4841_4c46;
    dimension_seed(seed, HALF) as usize % HALVES
}

impl<'a> VisibilityCache<'a> {
    /// The place of a key; keys may share one, which makes neither wrong.
    fn place(&self, key: u32) -> usize {
        let places = (self.factors.len() / HALVES).max(1);
        dimension_seed(key, 0) as usize % places
    }

    /// The factors that a pixel reads at a place; `None` for key 0, which is no place.
    pub fn factors(&self, key: u32, seed: u32) -> Option<&'a Factors> {
        if key == 0 { None } else { self.factors.get(HALVES * self.place(key) + half(seed)) }
    }

    /// Counts a ray of a pixel from a place along a direction of unit length. Key 0 counts nothing.
    pub fn record(&self, key: u32, seed: u32, wi: Vec3, reached: bool) {
        let counts = self.counts.get(HALVES * self.place(key) + half(seed));
        let [cell] = f32::ints_of(cells(square(wi)));
        if let (Some(counts), true) = (counts.and_then(|counts| counts.get(cell as usize)), key != 0) {
            counts[TRACED].fetch_add(1, Ordering::Relaxed);
            counts[REACHED].fetch_add(u32::from(reached), Ordering::Relaxed);
        }
    }
}

/// Ends a pass: each half of the pixels will read what the other has counted so far.
pub fn end_pass(counts: &[Counts], factors: &mut [Factors]) {
    for (counts, factors) in counts.chunks_exact(HALVES).zip(factors.chunks_exact_mut(HALVES)) {
        for (factors, counts) in factors.iter_mut().zip(counts.iter().rev()) {
            *factors = factors_of(counts);
        }
    }
}

/// Factors of places from which no ray was traced.
pub const UNKNOWN: Factors = [SEEN as u8; CELLS];

/// Whether earlier passes saw little of the light from a place: its factors have a mean below a half. Nearly all places of a room with a
/// window have, and next to none in the open.
pub fn is_dark(factors: &Factors) -> bool {
    factors.iter().map(|factor| u32::from(*factor)).sum::<u32>() < CELLS as u32 * SEEN as u32 / 2
}

/// The factor of each cell: the root of the share of its rays that reached the light, smoothed towards the mean of all cells.
///
/// A ray that is picked in proportion to f L g has the least second moment for g = sqrt(share).
fn factors_of(counts: &Counts) -> Factors {
    let sum = |which: usize| counts.iter().map(|cell| u64::from(cell[which].load(Ordering::Relaxed))).sum::<u64>();
    let (traced, reached) = (sum(TRACED), sum(REACHED));
    if traced == 0 {
        return UNKNOWN;
    }
    let mean = (reached as f64 / traced as f64) as f32;
    let mut factors = UNKNOWN;
    for (factor, cell) in factors.iter_mut().zip(counts) {
        let [traced, reached] = [TRACED, REACHED].map(|which| cell[which].load(Ordering::Relaxed) as f32);
        let share = (reached + SMOOTHING * mean) / (traced + SMOOTHING);
        *factor = (SEEN * max(sqrt(share), LEAST) + 0.5) as u8;
    }
    factors
}

/// A key for the cell of a grid of width `cell` about a position, apart for six directions of the normal; never 0.
pub fn key(position: [f32; 3], normal: [f32; 3], cell: f32) -> u32 {
    let [x, y, z] = normal.map(f32::abs);
    let (axis, component) = match (y > x, z > max(x, y)) {
        (_, true) => (2, normal[2]),
        (true, _) => (1, normal[1]),
        _ => (0, normal[0]),
    };
    let side = 2 * axis + u32::from(component < 0.0);
    let width = if cell > 0.0 { cell } else { 1.0 };
    let number = |x: f32| libm::floorf(x / width) as i32 as u32;
    position.into_iter().fold(side, |key, x| dimension_seed(key, number(x))).max(1)
}

/// The cells that contain points of the square.
#[inline(always)]
pub fn cells<F: Num>(s: [F; 2]) -> F::Whole {
    const SIDE: u32 = 1 << LEVEL;
    let [i, j] = s.map(|s| (s * SIDE as f32).min(F::splat((SIDE - 1) as f32)).to_whole());
    i.shl::<{ LEVEL as i32 }>() + j
}
