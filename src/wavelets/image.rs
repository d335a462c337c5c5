//! The complete tree of an image: pixels in C order become normalised averages in heap order.

use crate::numeric;
use crate::status::{Result, Status};
use crate::wavelets::morton;
use crate::wavelets::tree;

/// How the averages of a tree relate to the pixels that it was built from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scale {
    /// The stored average over the unit cube, in [1, 2], or 0.
    pub average: f32,
    /// Pixels are 2^exponent times the stored values.
    pub exponent: i32,
    /// The mean of the pixels.
    pub mean: f64,
}

/// The first pixel that is NaN, infinite or negative.
pub fn first_invalid(pixels: &[f32]) -> Option<usize> {
    pixels.iter().position(|pixel| !(0.0..=f32::MAX).contains(pixel))
}

/// Builds the tree of an image of 2^depth pixels on each of `N` axes, C order (axis 1 slowest). Pixels must be
/// finite and not negative; they are normalised by [`tree::normalise`].
///
/// # Errors
/// [`Status::InvalidArgument`] if the number of pixels is not 2^(n depth), or that of the squares not
/// [`tree::complete_len`].
pub fn build<const N: usize, const C: usize>(depth: u32, pixels: &[f32], squares: &mut [[f32; C]]) -> Result<Scale> {
    const { assert!(C == 1 << N, "a square of n axes has 2^n children") };
    if tree::complete_len::<C>(depth).map(|len| len as usize) != Some(squares.len()) {
        return Err(Status::InvalidArgument);
    }
    let mut single = [0.0];
    let finest = squares.as_flattened_mut();
    let coarser = finest.len().saturating_sub(pixels.len());
    let finest = if depth == 0 { &mut single } else { finest.get_mut(coarser..).unwrap_or_default() };
    morton::copy_from_c_order::<N>(depth, pixels, finest)?;
    let exponent = tree::normalise(finest);
    let average = if depth == 0 { f64::from(single[0]) } else { tree::build(depth, squares)? };
    Ok(Scale { average: average as f32, exponent, mean: average * numeric::exp2i(exponent) })
}
