//! The pooled resampler in C.

use super::strided::Strided;
use super::{Diagnostic, MemorySize, answer, check_block, out, put_size, sized, slice_mut};
use crate::blob::Size;
use crate::pool::{self, MAX_CANDIDATES, Pick};
use crate::status::{Error, Status};
use core::ffi::c_void;
use core::ptr::null_mut;

/// The most candidates of one pool.
pub const WIS_MAX_CANDIDATES: u32 = 1 << 24;
const _: () = assert!(WIS_MAX_CANDIDATES as usize == MAX_CANDIDATES);

/// Candidates of your own. Strides in bytes, 0: packed.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Candidates {
    /// sizeof(wis_candidates).
    pub size: u32,
    /// Always 0.
    pub reserved: u32,
    /// How many, at most WIS_MAX_CANDIDATES.
    pub count: usize,
    /// Three numbers each: a direction in world space.
    pub wi: *const f32,
    /// Bytes from a direction to the next.
    pub wi_stride: usize,
    /// The weight of each, finite and not negative.
    pub weight: *const f32,
    /// Bytes from a weight to the next.
    pub weight_stride: usize,
}

/// The scratch memory that wis_pool_pick needs for `count` candidates. WIS_OVERFLOW for more than
/// WIS_MAX_CANDIDATES. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_pool_size(count: usize, size: *mut MemorySize) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let bytes = pool::scratch_bytes(count).ok_or(Error::new(Status::Overflow, 1))?;
        put_size(size, 2, Ok(Size { bytes, scratch: 0 }))
    })
}

/// Picks directions to trace from candidates of your own, in proportion to weights of your own (resampled importance sampling).
/// wis_direct does the same with the library's candidates and lobes.
///
/// An unbiased estimate needs the weight g(x) / (n_1 p_1(x) + n_2 p_2(x) + ...) of a candidate x, for n_i candidates of density p_i and
/// any g that is above 0 where light is reflected; best is the luminance of radiance x BRDF x cosine. WIS_INVALID_ARGUMENT for a weight
/// out of range: `y` in the diagnostic is its number. `picks`: how many. `u`: one more random number for all. `scratch`: of
/// wis_pool_size.
///
/// `pick` receives up to `picks` elements, `pick_count` how many, `weight_sum` the sum of all weights. A pick counts radiance x BRDF x
/// cosine x visibility x multiplicity x weight_sum / (picks x g). In expectation a candidate is picked picks x weight / weight_sum times.
/// Two picks and more are systematic along a curve over the sphere. If all weights are 0, there are no picks. Work: count.
///
/// # Safety
/// Pointers are null or point to what the header says; nobody else uses the scratch memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_pool_pick(
    candidates: *const Candidates,
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
        let &Candidates { reserved, count, wi, wi_stride, weight, weight_stride, .. } = sized(candidates, 1)?;
        Error::first([(reserved == 0, c"reserved")]).map_err(|error| error.instead(1))?;
        let overflow = Error::new(Status::Overflow, 1).of(c"count");
        let needed = pool::scratch_bytes(count).ok_or(overflow)?;
        let wi = Strided::<3>::in_struct((wi, c"wi"), (wi_stride, c"wi_stride"), count, 1)?;
        let weight = Strided::<1>::in_struct((weight, c"weight"), (weight_stride, c"weight_stride"), count, 1)?;
        check_block(scratch.cast(), scratch_bytes, needed, 4)?;
        let keys = slice_mut(scratch.cast(), 2 * count, 4)?;
        let chosen = slice_mut(pick, picks as usize, 6)?;
        let (pick_count, weight_sum) = (out(pick_count, 7)?, out(weight_sum, 8)?);
        let picked = pool::resample(count, |i| wi.read(i), |i| weight.read(i)[0], u, keys, chosen);
        let at_fault = |row| Error::range(c"weight").instead(1).in_row(row);
        let (written, sum) = picked.map_err(at_fault)?;
        pick_count.write(written);
        weight_sum.write(sum);
        Ok(())
    })
}
