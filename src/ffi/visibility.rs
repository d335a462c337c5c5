//! The visibility cache in C: what rays of earlier passes saw from places of the scene.

use super::material::PointData;
use super::{
    Checked, Diagnostic, ExclusiveBlock, Failure, MemorySize, SharedBlock, Strided, WIS_ALIGNMENT, answer, borrow, out,
    pointer, sized, slice,
};
use crate::sphere::unit;
use crate::status::Status;
use crate::visibility::{Counts, Factors, HALVES, MAX_PLACES, UNKNOWN, VisibilityCache, end_pass, key};
use core::ffi::c_void;
use core::ptr::null_mut;

/// What rays saw from places of the scene, in your memory. Any number of threads may record and read at once; between passes one
/// of them calls wis_visibility_cache_end_pass alone. Nothing to free.
#[allow(missing_debug_implementations)]
pub struct VisibilityCacheObject {
    _opaque: [u8; 0],
}

const MAGIC: u64 = u64::from_le_bytes(*b"wisvis\x02\x00");

/// What stands at the beginning: counts follow, and behind them factors.
#[repr(C)]
#[derive(Clone, Copy)]
struct Header {
    magic: u64,
    places: u32,
    reserved: u32,
}

/// Halves of all places, and where their counts and factors begin and end.
struct Layout {
    count: usize,
    counts: usize,
    factors: usize,
    bytes: usize,
}

impl Layout {
    fn new(places: u32) -> Layout {
        let count = HALVES * places as usize;
        let counts = size_of::<Header>();
        let factors = counts + count * size_of::<Counts>();
        Layout {
            count,
            counts,
            factors,
            bytes: (factors + count * size_of::<Factors>()).next_multiple_of(WIS_ALIGNMENT),
        }
    }

    fn checked(places: u32) -> Checked<Layout> {
        if places == 0 || places > MAX_PLACES {
            return Err(Failure::new(Status::InvalidArgument, 1));
        }
        Ok(Layout::new(places))
    }
}

/// The bytes that a cache of so many places needs: 1152 each. `places`: 1 to 2^20; more keys than places share them, which costs
/// quality only. As many as tiles of 8 x 8 pixels, or pieces of surface, are a good number. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_visibility_cache_size(
    places: u32,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        let needed = MemorySize { bytes: Layout::checked(places)?.bytes, align: WIS_ALIGNMENT, scratch_bytes: 0 };
        // SAFETY: `out` checked the pointer, which is the caller's to write.
        unsafe { out(size, 2)?.write(needed) };
        Ok(())
    })
}

/// Makes a cache in which nothing was seen yet. `cache` receives the handle, which is the address of `memory`.
/// Work: places.
///
/// # Safety
/// Pointers are null or point to what the header says; nobody else uses the memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_visibility_cache_init(
    places: u32,
    memory: *mut c_void,
    bytes: usize,
    cache: *mut *mut VisibilityCacheObject,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        let layout = Layout::checked(places)?;
        let block = ExclusiveBlock::new(memory.cast(), bytes, layout.bytes, 2)?;
        let handle = out(cache, 4)?;
        // SAFETY: the block is aligned to 16 and as long as the layout says; zeros are counts.
        unsafe {
            block.start().write_bytes(0, layout.bytes);
            block.start().cast::<Header>().write(Header { magic: MAGIC, places, reserved: 0 });
            block.slice::<Factors>(layout.factors, 0, layout.count).fill(UNKNOWN);
            handle.write(block.start().cast());
        }
        Ok(())
    })
}

/// The layout of a cache.
///
/// # Safety
/// The pointer is null or points to a cache.
unsafe fn layout(cache: *const VisibilityCacheObject, argument: u32) -> Checked<Layout> {
    let header = pointer(cache.cast::<Header>(), argument)?;
    if header.addr() % WIS_ALIGNMENT != 0 {
        return Err(Failure::new(Status::Misaligned, argument));
    }
    // SAFETY: not null and aligned; every block that a cache was made in is longer than a header.
    let header = unsafe { *header };
    if header.magic != MAGIC || header.places == 0 || header.places > MAX_PLACES {
        return Err(Failure::new(Status::Mismatch, argument));
    }
    Ok(Layout::new(header.places))
}

/// A cache to read and to record in.
///
/// # Safety
/// The pointer is null or points to a cache, whose pass nobody ends while the result lives.
pub(super) unsafe fn cache<'a>(cache: *const VisibilityCacheObject, argument: u32) -> Checked<VisibilityCache<'a>> {
    // SAFETY: the caller's contract. Counts are atomic, so that others may add to them meanwhile.
    unsafe {
        let layout = layout(cache, argument)?;
        let block = SharedBlock::new(cache.cast(), layout.bytes, layout.bytes, argument)?;
        Ok(VisibilityCache {
            counts: block.slice(layout.counts, 0, layout.count),
            factors: block.slice(layout.factors, 0, layout.count),
        })
    }
}

/// The factors that a pixel reads at a place; `None` without a cache.
///
/// # Safety
/// As [`cache`].
pub(super) unsafe fn factors<'a>(
    source: *const VisibilityCacheObject,
    key: u32,
    seed: u32,
    argument: u32,
) -> Checked<Option<&'a Factors>> {
    if source.is_null() {
        return Ok(None);
    }
    // SAFETY: the caller's contract.
    let cache = unsafe { cache(source, argument) };
    Ok(cache.map_err(|failure| failure.of(c"visibility"))?.factors(key, seed))
}

/// Records what rays from a point saw: `reached[k]` is not 0 where the ray along `wi[k]` reached the light. Of the point only
/// `visibility`, `visibility_key` and `seed` are read; with a null `visibility` or the key 0 nothing is recorded. Directions that
/// are not of unit length are left out. Rays of wis_direct and others are welcome alike. Threads may record at once.
///
/// Estimates stay unbiased: a pixel never reads its own rays, and what is read does not change before
/// wis_visibility_cache_end_pass. That holds to the last digit if each pass has seeds of its own. With one seed over all passes a
/// pixel's rays reach it again through those of others; no bias was found by tests that find one of 1 %. Work: count.
///
/// # Safety
/// Pointers are null or point to what the header says; arrays hold `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_visibility_cache_record(
    point: *const PointData,
    count: usize,
    wi: *const f32,
    wi_stride: usize,
    reached: *const u8,
) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract; indices stay below `count`.
        unsafe {
            if count == 0 {
                return Ok(());
            }
            let point = sized(point, 1)?;
            let wi = Strided::<3>::new(wi, wi_stride, count, 3)?;
            let reached = slice(reached, count, 5)?;
            if point.visibility.is_null() {
                return Ok(());
            }
            let cache = cache(point.visibility, 1)?;
            for (index, reached) in reached.iter().enumerate() {
                if let Some(wi) = unit(wi.read(index)) {
                    cache.record(point.visibility_key, point.seed, wi, *reached != 0);
                }
            }
            Ok(())
        }
    })
}

/// Ends a pass: from now on points read what was recorded so far. No other call may use the cache meanwhile. About 0.5 us for each
/// place. Work: places.
///
/// # Safety
/// The pointer is null or points to a cache that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_visibility_cache_end_pass(cache: *mut VisibilityCacheObject) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract; counts and factors have no byte in common.
        unsafe {
            let layout = layout(cache, 1)?;
            let block = ExclusiveBlock::new(cache.cast(), layout.bytes, layout.bytes, 1)?;
            let counts: &[Counts] = block.slice(layout.counts, 0, layout.count);
            end_pass(counts, block.slice(layout.factors, 0, layout.count));
            Ok(())
        }
    })
}

/// A key for the piece of surface about a position: the cell of a grid of width `cell` (0 or less: 1), apart for six directions of
/// the normal. Never 0. A twentieth of the scene is a good width. Renderers that know the pixel may use the number of its tile + 1
/// instead. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_visibility_key(
    position: *const [f32; 3],
    normal: *const [f32; 3],
    cell: f32,
    visibility_key: *mut u32,
) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe { out(visibility_key, 4)?.write(key(*borrow(position, 1)?, *borrow(normal, 2)?, cell)) };
        Ok(())
    })
}
