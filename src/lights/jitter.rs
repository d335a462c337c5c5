//! Places inside the strata of a lat-long map: jitter for structured importance sampling (Agarwal et al. 2003, Section
//! 3.3), and the order in which lights are worth a shadow ray (Section 4).
//!
//! Uniform places are the paper's: with the light of a stratum in one number, they are biased in shadows where the light
//! varies inside it. Places in proportion to the energy of texels are not: light x visibility at such a place is an
//! unbiased estimate of the light of the stratum that is seen.

use crate::blob::{Layout, Magic, Part, Room, Size, has_checksum, header, write_checksum, write_header};
use crate::light::plan::MAX_SIDE;
use crate::numeric::{clamp_u, max, min};
use crate::sample::Sample;
use crate::sphere::{Frame, latlong, latlong_solid_angle, unit};
use crate::status::{Result, Status};
use bytemuck::{Pod, Zeroable};
use core::f64::consts::{PI, TAU};
use glam::Vec3;

/// The first bytes of a jitter table.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Header {
    magic: u64,
    bytes: u64,
    checksum: u64,
    size: [u32; 2],
    lights: u32,
    frame: [f32; 9],
}

impl Magic for Header {
    const MAGIC: u64 = u64::from_le_bytes(*b"wis-jit\x03");
}

impl Header {
    /// The bytes of the table that begins with this; `None` if none does.
    pub fn length(&self) -> Option<usize> {
        if self.magic != Header::MAGIC || self.size.iter().any(|side| *side > MAX_SIDE) {
            return None;
        }
        let bytes = Config { size: self.size, lights: self.lights }.size()?.bytes;
        Some(bytes).filter(|bytes| *bytes as u64 == self.bytes)
    }
}

/// A table to build.
#[derive(Clone, Copy, Debug)]
pub struct Config {
    /// Columns and rows of the map, at most 32768 each.
    pub size: [u32; 2],
    /// Strata.
    pub lights: u32,
}

impl Config {
    /// Texels of the map.
    pub fn texels(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    /// Where `start`, `order`, `rank` and `cumulative` stand, and the whole.
    fn parts(&self) -> ([Part; 4], Layout) {
        let (mut whole, texels) = (Layout::behind::<Header>(), self.texels() as u64);
        let start = whole.part::<u32>(u64::from(self.lights) + 1);
        let (order, rank) = (whole.part::<u32>(texels), whole.part::<u32>(texels));
        let cumulative = whole.part::<f64>(texels);
        ([start, order, rank, cumulative], whole)
    }

    /// The memory of the table, and of the luminance of all texels; `None` if no memory is as long.
    pub fn size(&self) -> Option<Size> {
        let mut room = Room::new(&mut []);
        let _: &mut [f64] = room.take(self.texels());
        Some(Size { bytes: self.parts().1.bytes()?, scratch: room.asked? })
    }

    /// Builds the table of strata of a map from the stratum of each texel, below the number of strata. `luminance`, of each
    /// texel: places are in proportion to the energy; none: to the solid angle. `memory` is as long as [`Config::size`] says.
    ///
    /// # Errors
    /// [`Status::InvalidArgument`] for a label that is none.
    pub fn build_in(&self, frame: &Frame, labels: &[u32], luminance: Option<&[f64]>, memory: &mut [u8]) -> Result<()> {
        // Also what stands between the parts: equal tables are equal bytes.
        memory.fill(0);
        let row = |texel: usize| (texel / (self.size[0].max(1) as usize)) as u32;
        let solid_angle = |texel: usize| latlong_solid_angle(self.size[0], self.size[1], row(texel));
        let weight = |texel: usize| {
            let value = luminance.map_or(1.0, |luminance| luminance.get(texel).copied().unwrap_or(0.0));
            value * solid_angle(texel)
        };
        let ([start, order, rank, cumulative], whole) = self.parts();
        let mut room = Room::new(memory);
        let _: &mut [Header] = room.take(1);
        let (start, order): (&mut [u32], &mut [u32]) = (room.take(start.count), room.take(order.count));
        let (rank, cumulative): (&mut [u32], &mut [f64]) = (room.take(rank.count), room.take(cumulative.count));
        for &label in labels {
            *start.get_mut(label as usize).filter(|_| label < self.lights).ok_or(Status::InvalidArgument)? += 1;
        }
        // First where each stratum ends; placing its texels from the last one moves that to where it begins.
        let mut end = 0;
        for slot in start.iter_mut() {
            end += *slot;
            *slot = end;
        }
        for (texel, &label) in labels.iter().enumerate().rev() {
            let Some(place) = start.get_mut(label as usize) else { continue };
            *place = place.wrapping_sub(1);
            if let (Some(order), Some(rank)) = (order.get_mut(*place as usize), rank.get_mut(texel)) {
                (*order, *rank) = (texel as u32, *place);
            }
        }
        // A stratum of weight 0 is uniform.
        for bounds in start.windows(2) {
            let &[first, end] = bounds else { continue };
            let members = order.get(first as usize..end as usize).unwrap_or(&[]);
            let sums = cumulative.get_mut(first as usize..end as usize).unwrap_or(&mut []);
            if sum_up(members, &weight, sums) <= 0.0 {
                sum_up(members, &solid_angle, sums);
            }
        }
        let bytes = whole.bytes().ok_or(Status::MemoryTooSmall)? as u64;
        let Config { size, lights } = *self;
        let (magic, frame) = (Header::MAGIC, frame.to_array());
        write_header(memory, &Header { magic, bytes, checksum: 0, size, lights, frame });
        write_checksum(memory);
        Ok(())
    }
}

/// The texels of every stratum with their probabilities.
#[derive(Clone, Copy, Debug)]
pub struct Jitter<'a> {
    /// Columns and rows of the map.
    pub size: [u32; 2],
    /// Where the texels of each stratum begin in `order`, and one more.
    pub start: &'a [u32],
    /// Texels, stratum by stratum.
    pub order: &'a [u32],
    /// For each texel its place in `order`.
    pub rank: &'a [u32],
    /// Probabilities of the texels of a stratum, summed up in the order of `order`; each stratum ends at 1.
    pub cumulative: &'a [f64],
}

/// Writes the normalised running sums of weights; answers the total.
fn sum_up(members: &[u32], weight: &impl Fn(usize) -> f64, sums: &mut [f64]) -> f64 {
    let mut total = 0.0;
    for (&texel, sum) in members.iter().zip(sums.iter_mut()) {
        total += weight(texel as usize);
        *sum = total;
    }
    if total > 0.0 {
        sums.iter_mut().for_each(|sum| *sum /= total);
    }
    total
}

impl<'a> Jitter<'a> {
    /// The table that bytes hold, and the frame of its map; `None` if they are of something else.
    pub fn view(bytes: &'a [u8]) -> Option<(Jitter<'a>, Frame)> {
        let header: &Header = header(bytes)?;
        header.length()?;
        let ([start, order, rank, cumulative], _) = Config { size: header.size, lights: header.lights }.parts();
        let (start, order, rank, cumulative) = (start.of(bytes), order.of(bytes), rank.of(bytes), cumulative.of(bytes));
        Some((Jitter { size: header.size, start, order, rank, cumulative }, Frame::from_array(&header.frame)))
    }

    /// The table in bytes that may come from anywhere, and the frame of its map.
    ///
    /// # Errors
    /// [`Status::Corrupt`] if they are not those of a table.
    pub fn open(bytes: &'a [u8]) -> Result<(Jitter<'a>, Frame)> {
        let viewed = Jitter::view(bytes).filter(|_| has_checksum(bytes)).ok_or(Status::Corrupt)?;
        let (jitter, frame) = &viewed;
        let is_rotation = Frame::new(&frame.to_array()).is_some();
        if is_rotation && jitter.is_sound() { Ok(viewed) } else { Err(Status::Corrupt) }
    }

    /// Whether each texel stands once in one stratum, in ascending order, and sums end at 1.
    fn is_sound(&self) -> bool {
        let texels = self.order.len();
        let ends = [self.start.first().copied(), self.start.last().copied()];
        let placed = |(place, &texel): (u32, &u32)| self.rank.get(texel as usize) == Some(&place);
        self.start.is_sorted_by(|a, b| a <= b)
            && ends == [Some(0), Some(texels as u32)]
            && (0..).zip(self.order).all(placed)
            && (0..self.strata()).all(|stratum| {
                let Some((first, end)) = self.range(stratum) else { return false };
                let members = self.order.get(first..end).unwrap_or(&[]);
                let sums = self.cumulative.get(first..end).unwrap_or(&[]);
                members.is_sorted_by(|a, b| a < b)
                    && sums.is_sorted_by(|a, b| a <= b)
                    && sums.first().is_none_or(|sum| *sum >= 0.0)
                    && sums.last().is_none_or(|sum| *sum == 1.0)
            })
    }

    /// How many strata there are.
    pub fn strata(&self) -> u32 {
        self.start.len().saturating_sub(1) as u32
    }
}

impl Jitter<'_> {
    /// The places of a stratum's texels in `order`.
    fn range(&self, stratum: u32) -> Option<(usize, usize)> {
        let first = stratum as usize;
        let &[first, end] = self.start.get(first..first.checked_add(2)?)? else { return None };
        Some((first as usize, end as usize))
    }

    /// A direction inside a stratum, and its pdf per solid angle, which integrates to 1 over the stratum. pdf 0 if there
    /// is no such stratum.
    pub fn sample(&self, frame: &Frame, stratum: u32, u: [f32; 2]) -> Sample {
        let Some((first, end)) = self.range(stratum) else { return Sample::default() };
        let [u, v] = u.map(|u| f64::from(clamp_u(u)));
        let sums = self.cumulative.get(first..end).unwrap_or(&[]);
        let index = sums.partition_point(|&sum| sum <= u);
        let Some(&texel) = self.order.get(first + index) else { return Sample::default() };
        let (low, high) = (before(sums, index), sums.get(index).copied().unwrap_or(1.0));
        let inside = (u - low) / (high - low);
        let mut scale = 1.0;
        // Rounding may carry a place at the border into the next texel: it moves towards the centre.
        loop {
            let place = [inside, v].map(|x| 0.5 + (x - 0.5) * scale);
            let wi = frame.to_world(self.direction(texel, place));
            let back = unit(wi).map(|wi| self.texel(frame, wi));
            if back == Some(texel) || scale <= 0.0 {
                return Sample { wi, pdf: self.density(texel, first, end) };
            }
            scale = if scale > 0.5 { scale - 1.0 / 1024.0 } else { 0.0 };
        }
    }

    /// The pdf of [`Jitter::sample`] for a direction: 0 outside the stratum.
    ///
    /// # Errors
    /// [`Status::InvalidTransform`] if `wi` is not of unit length.
    pub fn pdf(&self, frame: &Frame, stratum: u32, wi: [f32; 3]) -> Result<f32> {
        let wi = unit(wi).ok_or(Status::InvalidTransform)?;
        let Some((first, end)) = self.range(stratum) else { return Ok(0.0) };
        Ok(self.density(self.texel(frame, wi), first, end))
    }

    /// The texel that a world direction looks up.
    fn texel(&self, frame: &Frame, wi: Vec3) -> u32 {
        let uv = latlong(frame.to_map(wi.to_array()).map(f64::from));
        let [x, y] = [0, 1].map(|axis: usize| {
            let size = f64::from(self.size[axis & 1]);
            (uv[axis & 1] * size).max(0.0).min(size - 1.0) as u32
        });
        y.wrapping_mul(self.size[0]).wrapping_add(x)
    }

    /// The direction of map space at a place in a texel, uniform over its solid angle.
    fn direction(&self, texel: u32, [across, down]: [f64; 2]) -> [f32; 3] {
        let width = self.size[0].max(1);
        let (x, y) = (f64::from(texel % width), f64::from(texel / width));
        let step = PI / f64::from(self.size[1].max(1));
        // cos(a) - down (cos(a) - cos(b)) without cancellation at the poles: by half angles.
        let [top, bottom] = [y, y + 1.0].map(|row| libm::sin(0.5 * step * row));
        let half = top * top + down * (bottom * bottom - top * top);
        let (z, radius) = (1.0 - 2.0 * half, 2.0 * libm::sqrt((half * (1.0 - half)).max(0.0)));
        let azimuth = TAU * (x + across) / f64::from(width);
        [radius * libm::cos(azimuth), radius * libm::sin(azimuth), z].map(|c| c as f32)
    }

    /// The density of a texel in the stratum with these places; 0 if it is in another one.
    fn density(&self, texel: u32, first: usize, end: usize) -> f32 {
        let Some(&rank) = self.rank.get(texel as usize) else { return 0.0 };
        let Some(index) = (rank as usize).checked_sub(first).filter(|_| (rank as usize) < end) else { return 0.0 };
        let sums = self.cumulative.get(first..end).unwrap_or(&[]);
        let probability = sums.get(index).map_or(0.0, |sum| sum - before(sums, index));
        let row = texel / self.size[0].max(1);
        let pdf = (probability / latlong_solid_angle(self.size[0], self.size[1], row)) as f32;
        if probability > 0.0 { min(max(pdf, f32::MIN_POSITIVE), f32::MAX) } else { 0.0 }
    }
}

/// The sum before an index.
fn before(sums: &[f64], index: usize) -> f64 {
    index.checked_sub(1).and_then(|index| sums.get(index)).copied().unwrap_or(0.0)
}

/// From which share of a sum on it is not carried on by differences: at most 28 sums for any floats.
const RESUM: f64 = 1.0 / 1024.0;

/// Brings the numbers of the lights that are worth a shadow ray to the front, by their potential contribution, the largest
/// first, equal ones by number, and answers how many they are: what the others could add is at most `threshold` of the
/// whole. Contributions are finite and not negative.
pub fn order(contribution: &[f32], threshold: f64, index: &mut [u32]) -> usize {
    index.iter_mut().enumerate().for_each(|(i, slot)| *slot = i as u32);
    let value = |i: u32| contribution.get(i as usize).copied().unwrap_or(0.0);
    // A heap needs as many steps as lights are kept; sorting all of them would cost more than the rays that are saved.
    let before = |a: u32, b: u32| (value(a), core::cmp::Reverse(a)) > (value(b), core::cmp::Reverse(b));
    for root in (0..index.len() / 2).rev() {
        sift(index, root, before);
    }
    let sum_of = |lights: &[u32]| lights.iter().map(|&i| f64::from(value(i))).sum::<f64>();
    let total: f64 = contribution.iter().map(|&value| f64::from(value)).sum();
    let (mut rest, mut summed, mut left) = (total, total, index.len());
    // With a threshold of 0 every light counts, also beside one that swallows it in the sum.
    let worth = |rest: f64, next: f32| next > 0.0 && (rest > threshold * total || threshold == 0.0);
    while let Some(&next) = index.first().filter(|&&next| left > 0 && worth(rest, value(next))) {
        rest -= f64::from(value(next));
        left -= 1;
        exchange(index, 0, left);
        sift(index.get_mut(..left).unwrap_or(&mut []), 0, before);
        // What is left of a difference is rounding where little is left: then it is summed again.
        if rest < RESUM * summed {
            rest = sum_of(index.get(..left).unwrap_or(&[]));
            summed = rest;
        }
    }
    // What was taken off the heap stands at the end, the largest last.
    index.reverse();
    index.len() - left
}

/// Restores a heap, the first item of all at its root, below an item that may come too early.
fn sift(items: &mut [u32], mut root: usize, before: impl Fn(u32, u32) -> bool) {
    loop {
        let mut child = 2 * root + 1;
        let Some(&(mut first)) = items.get(child) else { return };
        if let Some(&other) = items.get(child + 1).filter(|other| before(**other, first)) {
            (child, first) = (child + 1, other);
        }
        match items.get(root) {
            Some(&own) if before(first, own) => exchange(items, root, child),
            _ => return,
        }
        root = child;
    }
}

/// Swaps two items, if they are there.
fn exchange(items: &mut [u32], a: usize, b: usize) {
    if let (Some(&x), Some(&y)) = (items.get(a), items.get(b)) {
        for (place, item) in [(a, y), (b, x)] {
            if let Some(slot) = items.get_mut(place) {
                *slot = item;
            }
        }
    }
}
