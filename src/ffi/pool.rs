//! The pooled resampler in C.

use super::strided::Strided;
use super::{Diagnostic, Failure, MemorySize, answer, check_block, out, put_size, slice_mut};
use crate::object::Size;
use crate::pool::{self, MAX_CANDIDATES, Pick};
use crate::status::Status;
use core::ffi::c_void;
use core::ptr::null_mut;

/// The most candidates of one pool.
pub const WIS_MAX_CANDIDATES: u32 = 1 << 24;
const _: () = assert!(WIS_MAX_CANDIDATES as usize == MAX_CANDIDATES);

/// The scratch memory that wis_pool_pick needs for `count` candidates, in `bytes`. WIS_OVERFLOW for more than
/// WIS_MAX_CANDIDATES. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_pool_size(count: usize, size: *mut MemorySize) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let bytes = pool::scratch_bytes(count).ok_or(Failure::new(Status::Overflow, 1))?;
        put_size(size, 2, Ok(Size { bytes, scratch: 0 }))
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
    // SAFETY: the caller's contract; all indices are below the count.
    answer(diagnostic, || unsafe {
        let needed = pool::scratch_bytes(count).ok_or(Failure::new(Status::Overflow, 1))?;
        let wi = Strided::<3>::new(wi, wi_stride, count, 2)?;
        let weight = Strided::<1>::new(weight, weight_stride, count, 4)?;
        check_block(scratch.cast(), scratch_bytes, needed, 8)?;
        let keys = slice_mut(scratch.cast(), 2 * count, 8)?;
        let chosen = slice_mut(pick, picks as usize, 10)?;
        let (pick_count, weight_sum) = (out(pick_count, 11)?, out(weight_sum, 12)?);
        let picked = pool::resample(count, |i| wi.read(i), |i| weight.read(i)[0], u, keys, chosen);
        let (written, sum) = picked.map_err(|wrong| Failure::new(Status::InvalidArgument, 4).in_row(4, wrong))?;
        pick_count.write(written);
        weight_sum.write(sum);
        Ok(())
    })
}
