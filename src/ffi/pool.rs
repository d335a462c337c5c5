//! The pooled resampler in C.

use super::{Checked, Diagnostic, ExclusiveBlock, Failure, MemorySize, Strided, WIS_ALIGNMENT, answer, out, slice_mut};
use crate::numeric::clamp_u;
use crate::pool::{self, Key, Pick};
use crate::simd::{LANES, Lanes, Native};
use crate::status::Status;
use core::ffi::c_void;
use core::ptr::null_mut;

/// The most candidates of one pool.
pub const WIS_MAX_CANDIDATES: u32 = 1 << 24;

/// The scratch memory that wis_pool_pick needs for `count` candidates, in `bytes`. WIS_OVERFLOW for more than
/// WIS_MAX_CANDIDATES. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_pool_size(count: usize, size: *mut MemorySize) -> Status {
    answer(null_mut(), || {
        let bytes = scratch_bytes(count)?;
        let size = out(size, 2)?;
        // SAFETY: checked; the rest is the caller's contract.
        unsafe { size.write(MemorySize { bytes, align: WIS_ALIGNMENT, scratch_bytes: 0 }) };
        Ok(())
    })
}

/// Picks directions to trace from `count` candidates of your own, in proportion to weights of your own (resampled importance
/// sampling). wis_direct does the same with the library's candidates and lobes.
///
/// `wi`: directions in world space. `weight`: of each, finite and not negative, else WIS_INVALID_ARGUMENT. An unbiased estimate
/// needs the weight g(x) / (n_1 p_1(x) + n_2 p_2(x) + ...) of a candidate x, for n_i candidates of density p_i and any g that is
/// above 0 where the light is reflected; best is the luminance of radiance x BRDF x cosine. `picks`: how many. `u`: one more
/// random number for all. `scratch`: of wis_pool_size. Strides in bytes, 0: packed.
///
/// `pick` receives up to `picks` elements, `pick_count` how many, `weight_sum` the sum of all weights. A pick counts radiance x
/// BRDF x cosine x visibility x multiplicity x weight_sum / (picks x g). In expectation a candidate is picked
/// picks x weight / weight_sum times, and never if its weight is 0. Two picks and more are systematic along a curve over the
/// sphere, so that well-spread candidates give well-spread picks. If all weights are 0, there are no picks. Time grows with
/// the number of candidates. Work: count.
///
/// # Safety
/// Pointers are null or point to what the header says; nobody else uses the scratch memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_pool_pick(
    count: usize,
    wi: *const f32,
    wi_stride: usize,
    weight: *const f32,
    weight_stride: usize,
    picks: u32,
    u: f32,
    scratch: *mut c_void,
    scratch_bytes: usize,
    pick: *mut Pick,
    pick_count: *mut u32,
    weight_sum: *mut f64,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        let needed = self::scratch_bytes(count)?;
        let wi = Strided::<3>::new(wi, wi_stride, count, 2)?;
        let weight = Strided::<1>::new(weight, weight_stride, count, 4)?;
        let block = ExclusiveBlock::new(scratch.cast(), scratch_bytes, needed, 8)?;
        // SAFETY: the caller's contract; both halves of the scratch memory are apart, and all indices are below their
        // counts.
        unsafe {
            let chosen = slice_mut(pick, picks as usize, 10)?;
            let (pick_count, weight_sum) = (out(pick_count, 11)?, out(weight_sum, 12)?);
            let keys = block.slice::<Key>(0, 0, count);
            let spare = block.slice::<Key>(count * size_of::<Key>(), 0, count);
            // A single pick has no others that it could be spread among.
            let spread = picks > 1;
            let (used, sum) = gather(count, |i| wi.read(i), |i| weight.read(i)[0], keys, spread)?;
            let (keys, spare) = (keys.get_mut(..used).unwrap_or(&mut []), spare.get_mut(..used).unwrap_or(&mut []));
            if spread {
                pool::sort(keys, spare);
            }
            let mut written = 0u32;
            let emit = |pick| {
                if let Some(slot) = chosen.get_mut(written as usize) {
                    *slot = pick;
                    written += 1;
                }
            };
            if sum > 0.0 {
                pool::pick(keys, |i| weight.read(i as usize)[0], sum, (picks, clamp_u(u)), emit);
            }
            pick_count.write(written);
            weight_sum.write(sum);
        }
        Ok(())
    })
}

/// Writes the keys of the candidates that can be picked, in the order in which they came, with their places on the curve
/// if picks are to be `spread` along it; answers how many there are, and the sum of their weights.
#[inline(always)]
fn gather(
    count: usize,
    wi: impl Fn(usize) -> [f32; 3],
    weight: impl Fn(usize) -> f32,
    keys: &mut [Key],
    spread: bool,
) -> Checked<(usize, f64)> {
    let (mut used, mut sum) = (0, 0.0);
    for first in (0..count).step_by(LANES) {
        let here = (count - first).min(LANES);
        let places = if spread { places(here, |i| wi(first + i)) } else { [0; LANES] };
        for (i, place) in places.into_iter().enumerate().take(here) {
            let weight = weight(first + i);
            if !(0.0..=f32::MAX).contains(&weight) {
                return Err(Failure::new(Status::InvalidArgument, 4).in_row(4, first + i));
            }
            // Every key is written, and its place only kept if it can be picked: there is nothing to predict.
            if let Some(slot) = keys.get_mut(used) {
                *slot = pool::key(place, (first + i) as u32);
            }
            used += usize::from(weight > 0.0);
            sum += f64::from(weight);
        }
    }
    Ok((used, sum))
}

/// The places on the curve of at most eight directions.
#[inline(always)]
fn places(count: usize, wi: impl Fn(usize) -> [f32; 3]) -> [u32; LANES] {
    let mut axes = [[0.0; LANES]; 3];
    for i in 0..count {
        for (axis, component) in axes.iter_mut().zip(wi(i)) {
            axis[i & (LANES - 1)] = component;
        }
    }
    let [x, y, z] = axes;
    pool::places([Native::from_array(x), Native::from_array(y), Native::from_array(z)])
}

fn scratch_bytes(count: usize) -> Checked<usize> {
    if count > WIS_MAX_CANDIDATES as usize {
        return Err(Failure::new(Status::Overflow, 1));
    }
    Ok((2 * count * size_of::<Key>()).next_multiple_of(WIS_ALIGNMENT))
}
