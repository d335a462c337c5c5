//! The visibility cache in C: what rays of earlier passes saw from places of the scene.

use super::material::PointData;
use super::memory::{block_mut, header};
use super::strided::Strided;
use super::{Checked, Diagnostic, MemorySize, answer, borrow, out, put_size, sized, slice};
use crate::blob::{Divided, Shared, Size};
use crate::sphere::unit;
use crate::status::{Error, Status};
use crate::visibility::{Arrays, Factors, Header, UNKNOWN, VisibilityCache, end_pass, key};
use core::ffi::c_void;
use core::ptr::null_mut;

/// What rays saw from places of the scene, in your memory. Any number of threads may record and read at once; between passes one
/// of them calls wis_visibility_cache_end_pass alone.
#[allow(missing_debug_implementations)]
pub struct VisibilityCacheObject {
    _opaque: [u8; 0],
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
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let Arrays { bytes, .. } = checked(places)?;
        put_size(size, 2, Ok(Size { bytes, scratch: 0 }))
    })
}

fn checked(places: u32) -> Checked<Arrays> {
    Arrays::new(places).ok_or(Error::new(Status::InvalidArgument, 1))
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
    // SAFETY: the caller's contract; zeros are counts.
    answer(diagnostic, || unsafe {
        let arrays = checked(places)?;
        let block = Divided::new(memory.cast(), bytes, arrays.bytes, 2)?;
        let handle = out(cache, 4)?;
        block_mut(memory, bytes, arrays.bytes, 2)?.fill(0);
        block.all_mut(arrays.header).fill(Header::new(places));
        block.all_mut::<Factors>(arrays.factors).fill(UNKNOWN);
        handle.write(memory.cast());
        Ok(())
    })
}

/// Where the arrays of a cache stand.
///
/// # Safety
/// The pointer is null or points to a cache.
unsafe fn arrays(cache: *const VisibilityCacheObject, argument: u32) -> Checked<Arrays> {
    // SAFETY: the caller's contract; every block that a cache was made in is longer than a header.
    let header: &Header = unsafe { header(cache.cast(), argument)? };
    header.arrays().ok_or(Error::new(Status::Mismatch, argument))
}

/// A cache to read and to record in.
///
/// # Safety
/// The pointer is null or points to a cache, whose pass nobody ends while the result lives.
pub(super) unsafe fn cache<'a>(cache: *const VisibilityCacheObject, argument: u32) -> Checked<VisibilityCache<'a>> {
    // SAFETY: the caller's contract. Counts are atomic, so that others may add to them meanwhile.
    unsafe {
        let arrays = arrays(cache, argument)?;
        let block = Shared::new(cache.cast(), arrays.bytes, arrays.bytes, argument)?;
        Ok(VisibilityCache { counts: block.all(arrays.counts), factors: block.all(arrays.factors) })
    }
}

/// The factors that a pixel reads at a place; `None` without a cache.
///
/// # Safety
/// As [`cache`].
#[inline]
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
    // SAFETY: the caller's contract; indices stay below `count`.
    answer(null_mut(), || unsafe {
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
    })
}

/// Ends a pass: points then read what was recorded so far. No other call may use the cache meanwhile. 0.5 us for each
/// place. Work: places.
///
/// # Safety
/// The pointer is null or points to a cache that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_visibility_cache_end_pass(cache: *mut VisibilityCacheObject) -> Status {
    // SAFETY: the caller's contract; counts and factors have no byte in common.
    answer(null_mut(), || unsafe {
        let arrays = arrays(cache, 1)?;
        let block = Divided::new(cache.cast(), arrays.bytes, arrays.bytes, 1)?;
        end_pass(block.all(arrays.counts), block.all_mut(arrays.factors));
        Ok(())
    })
}

/// A key for the piece of surface about a position: the cell of a grid of width `cell` (0 or less: 1), apart for six directions of
/// the normal. Never 0. A twentieth of the scene is a good width. Renderers that know the pixel may use its tile's number + 1. Work: constant.
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
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let target = out(visibility_key, 4)?;
        target.write(key(*borrow(position, 1)?, *borrow(normal, 2)?, cell));
        Ok(())
    })
}
