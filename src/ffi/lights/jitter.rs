//! Places inside strata in C.

use crate::ffi::light::LightConfig;
use crate::ffi::lights::strata::{decode_luminance, read_map};
use crate::ffi::{
    Checked, Diagnostic, ExclusiveBlock, Failure, MemorySize, SharedBlock, WIS_ALIGNMENT, answer, borrow, out, slice,
    slice_mut,
};
use crate::lights::jitter::{self, Jitter as Table, Parts};
use crate::sample::Sample;
use crate::sphere::{Frame, latlong_solid_angle};
use crate::status::Status;
use core::ffi::c_void;
use core::ptr::null_mut;

/// Directions uniform over the solid angle of a stratum: the paper's jitter, biased in shadow where the light varies
/// inside the stratum.
pub const WIS_JITTER_UNIFORM: u32 = 0;
/// Directions in proportion to the radiance of the texels: the light's `rgb` luminance x visibility is unbiased.
pub const WIS_JITTER_ENERGY: u32 = 1;

/// The texels of every stratum, to place samples inside: bytes in your memory without pointers. Constant once built; any
/// number of threads may use it at once. Nothing to free.
#[allow(missing_debug_implementations)]
pub struct Jitter {
    _opaque: [u8; 0],
}

/// The first bytes of a jitter table.
#[repr(C)]
#[derive(Clone, Copy)]
struct Header {
    magic: u64,
    bytes: u64,
    size: [u32; 2],
    lights: u32,
    frame: [f32; 9],
}

/// "wis-jit" and the version of the format.
const MAGIC: u64 = u64::from_le_bytes(*b"wis-jit\x02");

/// Where the parts of a table stand.
struct Layout {
    start: usize,
    order: usize,
    rank: usize,
    cumulative: usize,
    texels: usize,
    lights: usize,
    bytes: usize,
}

impl Layout {
    fn new([width, height]: [u32; 2], lights: u32) -> Option<Layout> {
        let texels = (width as usize).checked_mul(height as usize)?;
        let mut end = size_of::<Header>().next_multiple_of(WIS_ALIGNMENT);
        let mut part = |count: usize, size: usize| {
            let start = end;
            end = count.checked_mul(size)?.checked_add(end)?.checked_next_multiple_of(WIS_ALIGNMENT)?;
            Some(start)
        };
        let start = part((lights as usize).checked_add(1)?, size_of::<u32>())?;
        let (order, rank) = (part(texels, size_of::<u32>())?, part(texels, size_of::<u32>())?);
        let cumulative = part(texels, size_of::<f64>())?;
        Some(Layout { start, order, rank, cumulative, texels, lights: lights as usize, bytes: end })
    }

    /// # Safety
    /// As [`ExclusiveBlock::slice`].
    unsafe fn parts<'a>(&self, block: &ExclusiveBlock) -> Parts<'a> {
        // SAFETY: the caller's contract; the parts do not overlap.
        unsafe {
            Parts {
                start: block.slice(self.start, 0, self.lights + 1),
                order: block.slice(self.order, 0, self.texels),
                rank: block.slice(self.rank, 0, self.texels),
                cumulative: block.slice(self.cumulative, 0, self.texels),
            }
        }
    }
}

impl Header {
    /// The table behind a header of this layout.
    ///
    /// # Safety
    /// As [`SharedBlock::slice`].
    unsafe fn table<'a>(&self, layout: &Layout, block: &SharedBlock) -> Table<'a> {
        // SAFETY: the caller's contract.
        unsafe {
            Table {
                size: self.size,
                start: block.slice(layout.start, 0, layout.lights + 1),
                order: block.slice(layout.order, 0, layout.texels),
                rank: block.slice(layout.rank, 0, layout.texels),
                cumulative: block.slice(layout.cumulative, 0, layout.texels),
            }
        }
    }
}

/// The memory that wis_jitter_init needs for the strata of a lat-long map. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_jitter_size(
    map: *const LightConfig,
    light_count: u32,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let (map, _) = read_map(map)?;
            let dimensions = [map.pixels.width, map.pixels.height];
            let layout = Layout::new(dimensions, light_count).ok_or(Failure::new(Status::Overflow, 1))?;
            let scratch_bytes = (layout.texels * size_of::<f64>()).next_multiple_of(WIS_ALIGNMENT);
            out(size, 3)?.write(MemorySize { bytes: layout.bytes, align: WIS_ALIGNMENT, scratch_bytes });
        }
        Ok(())
    })
}

/// Sorts the texels of a map by the strata that wis_strata_lights found (`label`, width x height numbers below
/// `light_count`, else WIS_INVALID_ARGUMENT), so that directions can be drawn inside each. `distribution`:
/// WIS_JITTER_*. `map` as in wis_strata_size. Work: texels + lights.
///
/// # Safety
/// Pointers are null or point to what the header says; nobody else uses the memory meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_jitter_init(
    map: *const LightConfig,
    light_count: u32,
    label: *const u32,
    distribution: u32,
    memory: *mut c_void,
    bytes: usize,
    scratch: *mut c_void,
    scratch_bytes: usize,
    jitter: *mut *const Jitter,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract; the parts of the blocks do not overlap.
        unsafe {
            let (map, rows) = read_map(map)?;
            let size = [map.pixels.width, map.pixels.height];
            let layout = Layout::new(size, light_count).ok_or(Failure::new(Status::Overflow, 1))?;
            let labels: &[u32] = slice(label, layout.texels, 3)?;
            if distribution > WIS_JITTER_ENERGY {
                return Err(Failure::new(Status::InvalidArgument, 4));
            }
            let block = ExclusiveBlock::new(memory.cast(), bytes, layout.bytes, 5)?;
            let needed = (layout.texels * size_of::<f64>()).next_multiple_of(WIS_ALIGNMENT);
            let scratch = ExclusiveBlock::new(scratch.cast(), scratch_bytes, needed, 7)?;
            let target = out(jitter, 9)?;
            let luminance = scratch.slice::<f64>(0, 0, layout.texels);
            decode_luminance(&map, &rows, luminance)?;
            let solid_angle = |texel: usize| {
                let row = texel / (size[0].max(1) as usize);
                latlong_solid_angle(size[0], size[1], row as u32)
            };
            let energy = |texel: usize| luminance.get(texel).copied().unwrap_or(0.0) * solid_angle(texel);
            // Also what stands between the parts: equal tables are equal bytes.
            block.start().write_bytes(0, layout.bytes);
            let mut parts = layout.parts(&block);
            let built = match distribution {
                WIS_JITTER_UNIFORM => jitter::build(labels, solid_angle, solid_angle, &mut parts),
                _ => jitter::build(labels, energy, solid_angle, &mut parts),
            };
            let wrong = || labels.iter().position(|&label| label >= light_count).unwrap_or(0);
            built.map_err(|status| Failure::new(status, 3).in_row(3, wrong()))?;
            let header = Header {
                magic: MAGIC,
                bytes: layout.bytes as u64,
                size,
                lights: light_count,
                frame: map.frame.to_array(),
            };
            if let Some(slot) = block.slice::<Header>(0, 0, 1).first_mut() {
                *slot = header;
            }
            target.write(memory.cast_const().cast());
        }
        Ok(())
    })
}

/// Draws a direction inside stratum `light` (WIS_INVALID_ARGUMENT if there is none). The pdf is per solid angle within the
/// stratum. With WIS_JITTER_ENERGY add the light's whole energy x BRDF x cosine x visibility, without dividing by the
/// pdf; for radiance looked up at the sample divide by it. Work: log texels.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_jitter_sample(
    jitter: *const Jitter,
    light: u32,
    u: *const [f32; 2],
    sample: *mut Sample,
) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let (table, frame) = view(jitter, light)?;
            let u = *borrow(u, 3)?;
            out(sample, 4)?.write(table.sample(&frame, light, u));
        }
        Ok(())
    })
}

/// The pdf of wis_jitter_sample for any direction of unit length: the very bits that a sample came with, and 0 outside
/// the stratum. Work: log texels.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_jitter_pdf(
    jitter: *const Jitter,
    light: u32,
    wi: *const [f32; 3],
    pdf: *mut f32,
) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let (table, frame) = view(jitter, light)?;
            let wi = *borrow(wi, 3)?;
            let target = out(pdf, 4)?;
            target.write(table.pdf(&frame, light, wi).map_err(|status| Failure::new(status, 3))?);
        }
        Ok(())
    })
}

/// Which lights are worth a shadow ray at a point (Agarwal et al. 2003, Section 4): writes the numbers of `count`
/// lights into `index`, the first `traced` of them in the order of `contribution` (radiance x BRDF x cosine, at least 0
/// and finite, else WIS_INVALID_ARGUMENT), the largest first, equal ones by number. What the others could add is at
/// most `threshold` (0 to 1, however small) of the whole; they follow in an order of no meaning. Estimate those by
/// their sum x the share that is visible of a few of them drawn in proportion to `contribution`: without bias. The time
/// is that of a pass over all lights and of sorting those that are traced. Work: count x log count.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_strata_order(
    count: usize,
    contribution: *const f32,
    threshold: f32,
    index: *mut u32,
    traced: *mut u32,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            if count >= u32::MAX as usize {
                return Err(Failure::new(Status::Overflow, 1));
            }
            let contribution: &[f32] = if count == 0 { &[] } else { slice(contribution, count, 2)? };
            if let Some(wrong) = contribution.iter().position(|c| !(0.0..=f32::MAX).contains(c)) {
                return Err(Failure::new(Status::InvalidArgument, 2).in_row(2, wrong));
            }
            if !(0.0..=1.0).contains(&threshold) {
                return Err(Failure::new(Status::InvalidArgument, 3));
            }
            let index = slice_mut(index, count, 4)?;
            let target = out(traced, 5)?;
            target.write(jitter::order(contribution, threshold.into(), index) as u32);
        }
        Ok(())
    })
}

/// The table behind a handle.
///
/// # Safety
/// The handle is null or points to a table of this version.
unsafe fn view<'a>(jitter: *const Jitter, light: u32) -> Checked<(Table<'a>, Frame)> {
    // SAFETY: the caller's contract; the object is as long as its header says.
    unsafe {
        let header = borrow(jitter.cast::<Header>(), 1)?;
        let mismatch = Failure::new(Status::Mismatch, 1);
        let layout = Layout::new(header.size, header.lights).filter(|l| l.bytes as u64 == header.bytes);
        let layout = layout.filter(|_| header.magic == MAGIC).ok_or(mismatch)?;
        let block = SharedBlock::new(jitter.cast(), layout.bytes, layout.bytes, 1)?;
        if light >= header.lights {
            return Err(Failure::new(Status::InvalidArgument, 2));
        }
        Ok((header.table(&layout, &block), Frame::from_array(&header.frame)))
    }
}
