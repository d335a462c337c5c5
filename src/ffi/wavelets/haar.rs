//! The Haar transform in C.

use crate::ffi::{Diagnostic, answer, require, require_all, slice_mut};
use crate::status::{Error, Status};
use crate::wavelets::tree::MAX_DEPTH;
use crate::wavelets::{haar, morton};

/// Direction of wis_haar: from an image to its coefficients.
pub const WIS_HAAR_FORWARD: u32 = 0;
/// Direction of wis_haar: from the coefficients to the image.
pub const WIS_HAAR_INVERSE: u32 = 1;

/// Replaces an image by its orthonormal non-standard Haar coefficients, in place, or these by the image. `values`: `count` =
/// 2^(n depth) numbers, C order (axis 1 slowest), at most 1e290 in size; `dimensions` n = 1 to 4, `depth` at most 12. The
/// coefficient of level l, translation t and wavelet f = (f1 .. fn) replaces the pixel at coordinates (2 t_q + f_q)
/// 2^(depth - 1 - l), the scaling coefficient the pixel at the origin. WIS_INVALID_ARGUMENT for anything out of these
/// ranges, or another `direction` than WIS_HAAR_FORWARD and WIS_HAAR_INVERSE. Work: count.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_haar(
    direction: u32,
    dimensions: u32,
    depth: u32,
    count: usize,
    values: *mut f64,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let transform = match direction {
            WIS_HAAR_FORWARD => haar::forward_any,
            WIS_HAAR_INVERSE => haar::inverse_any,
            _ => return Err(Error::new(Status::InvalidArgument, 1)),
        };
        require((1..=4).contains(&dimensions), Status::InvalidArgument, 2)?;
        require(depth <= MAX_DEPTH, Status::InvalidArgument, 3)?;
        require(morton::cells(dimensions, depth) == Some(count), Status::InvalidArgument, 4)?;
        let values = slice_mut(values, count, 5)?;
        // Sums over all levels, of coefficients of up to 2^22 in value space, stay finite.
        require_all(values, 5, |value| (-LARGEST..=LARGEST).contains(value))?;
        transform(dimensions, depth, values).map_err(Error::from)
    })
}

/// The largest number that is transformed.
const LARGEST: f64 = 1e290;
