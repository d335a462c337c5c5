//! The visibility prior in C.

use super::{Checked, Failure, Strided, StridedMut, answer, frame, sized};
use crate::prior::Prior;
use crate::sphere::{square, unit};
use crate::status::{Fault, Status};
use core::ptr::null_mut;

/// Counts rays: `visible[k]` is not 0 where the ray along `wi[k]` reached the light. Directions that are not of unit
/// length are left out. The cells divide map space: give the `world_from_map` (null: the identity) of the environment
/// that the prior will serve. Stride in bytes, 0: packed.
///
/// A prior is worth having for a tile of about 8 x 8 pixels. So that estimates stay unbiased, what a product or pool
/// reads must be made of samples whose random numbers are independent of that pixel's: count into a second prior while
/// the first is read and swap them between passes, with a seed of its own for each pixel and pass. With samples that
/// neighbouring pixels share (a screen-space mask) it is slightly biased. Counts are integers: with wis_prior_add the
/// result does not depend on how many threads counted.
///
/// # Safety
/// Pointers are null or point to what the header says; nobody else uses the prior.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_prior_count(
    prior: *mut Prior,
    world_from_map: *const [f32; 9],
    count: usize,
    wi: *const f32,
    wi_stride: usize,
    visible: *const u8,
) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract; indices stay below `count`.
        unsafe {
            check(prior, 1)?;
            let frame = frame(world_from_map, 2)?;
            let wi = Strided::<3>::new(wi, wi_stride, count, 4)?;
            if visible.is_null() && count > 0 {
                return Err(Failure::new(Status::NullPointer, 6));
            }
            for index in 0..count {
                if let Some(wi) = unit(wi.read(index)) {
                    (*prior).count(square(frame.to_map(wi)), *visible.add(index) != 0);
                }
            }
        }
        Ok(())
    })
}

/// Adds the counts of another prior: what threads or tiles have counted apart.
///
/// # Safety
/// Pointers are null or point to two different priors; nobody else uses `prior`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_prior_add(prior: *mut Prior, other: *const Prior) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            check(prior, 1)?;
            let other = *check(other, 2)?;
            (*prior).add(&other);
        }
        Ok(())
    })
}

/// Halves all counts: what was seen long ago, or by a camera that has moved, counts less.
///
/// # Safety
/// The pointer is null or points to a prior that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_prior_halve(prior: *mut Prior) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            check(prior, 1)?;
            (*prior).halve();
        }
        Ok(())
    })
}

/// The factor g of the prior for `count` directions, 0.1 to about 0.6: for the pool. Multiply a candidate's weight by its
/// g before wis_pool_pick, and divide what its pick contributes by it. 0 for directions that are not of unit length.
/// Strides in bytes, 0: packed.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_prior_weights(
    prior: *const Prior,
    world_from_map: *const [f32; 9],
    count: usize,
    wi: *const f32,
    wi_stride: usize,
    weight: *mut f32,
    weight_stride: usize,
) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract; indices stay below `count`.
        unsafe {
            let weights = check(prior, 1)?.weights();
            let frame = frame(world_from_map, 2)?;
            let wi = Strided::<3>::new(wi, wi_stride, count, 4)?;
            let target = StridedMut::<1>::new(weight, weight_stride, count, 6)?;
            for index in 0..count {
                let cell = unit(wi.read(index)).map(|wi| crate::prior::cell(square(frame.to_map(wi))));
                target.write(index, [cell.and_then(|cell| weights.get(cell)).copied().unwrap_or(0.0)]);
            }
        }
        Ok(())
    })
}

/// A prior that counts can be taken from.
///
/// # Safety
/// The pointer is null or points to what the header says.
pub(super) unsafe fn check<'a>(prior: *const Prior, argument: u32) -> Checked<&'a Prior> {
    // SAFETY: the caller's contract.
    let prior = unsafe { sized(prior, argument)? };
    if prior.is_sound() { Ok(prior) } else { Err(Failure::fault(Fault::range(c"visible"), argument)) }
}
