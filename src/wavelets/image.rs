//! The stored tree of an image: complete in scratch memory first, of pixels in C order as normalised averages in heap order, then the
//! squares that an error budget keeps.

use crate::blob::Size;
use crate::numeric::{exp2i, times_power};
use crate::status::{self, Error, Status};
use crate::wavelets::stored::{AXES, Built, Facts, Header, Parts, store};
use crate::wavelets::tree::{self, MAX_DEPTH, Tree, complete_len};
use crate::wavelets::{morton, prune};
use bytemuck::{Pod, try_cast_slice_mut};

/// What to build.
#[derive(Clone, Copy, Debug)]
pub struct Config {
    /// Axes, 2 or 4.
    pub dimensions: u32,
    /// The grid has 2^depth pixels along each axis.
    pub depth: u32,
    /// The variance that pruning may add to an estimate of the integral, relative to its square.
    pub error_budget: f32,
}

impl Config {
    /// Checks what a client asks for.
    ///
    /// # Errors
    /// [`Error`] names the field.
    pub fn checked(self) -> Result<Config, Error> {
        Error::first([
            (AXES.contains(&self.dimensions), c"dimensions"),
            (self.depth <= MAX_DEPTH, c"depth"),
            (self.error_budget >= 0.0, c"error_budget"),
        ])?;
        self.complete().map(|_| self).ok_or(Error::new(Status::Overflow, 0).of(c"depth"))
    }

    /// The squares of the complete tree.
    fn complete(&self) -> Option<usize> {
        complete_len(1 << self.dimensions, self.depth)
    }

    /// The memory of a build at most; `None` if none is as long.
    pub fn size(&self) -> Option<Size> {
        let complete = self.complete()?;
        let scratch = complete.checked_mul(size_of::<f32>() << self.dimensions)?;
        let scratch = complete.checked_mul(size_of::<f64>())?.checked_add(scratch)?;
        let bytes = Parts::new(self.dimensions, complete)?.bytes;
        Some(Size { bytes, scratch }).filter(|size| size.scratch <= isize::MAX as usize)
    }

    /// Builds the tree of an image whose pixels are 2^-exponent of the function, C order, finite and not negative. `scratch`
    /// is as long as [`Config::size`] says.
    ///
    /// # Errors
    /// [`Built`].
    pub fn build_in(&self, pixels: &[f32], exponent: i32, memory: &mut [u8], scratch: &mut [u8]) -> Built<Header> {
        match self.dimensions {
            2 => build_in::<2, 4>(self, pixels, exponent, memory, scratch),
            _ => build_in::<4, 16>(self, pixels, exponent, memory, scratch),
        }
    }
}

fn build_in<const N: usize, const C: usize>(
    config: &Config,
    pixels: &[f32],
    exponent: i32,
    memory: &mut [u8],
    scratch: &mut [u8],
) -> Built<Header>
where
    [f32; C]: Pod,
{
    let complete = config.complete().ok_or(Status::Overflow)?;
    let (squares, savings) = scratch
        .split_at_mut_checked(complete * size_of::<[f32; C]>())
        .and_then(|(squares, savings)| Some((try_cast_slice_mut(squares).ok()?, try_cast_slice_mut(savings).ok()?)))
        .ok_or(Status::MemoryTooSmall)?;
    let scale = build::<N, C>(config.depth, pixels, squares)?;
    let complete = Tree::trusted(config.depth, scale.average, squares, &[]);
    let planned = prune::plan(&complete, config.error_budget.into(), savings)?;
    store(memory, config.dimensions, planned.squares as usize, |averages, links| {
        let squares: &mut [[f32; C]] = try_cast_slice_mut(averages).unwrap_or(&mut []);
        prune::write(&complete, savings, squares, links)?;
        Ok(Facts {
            depth: config.depth,
            mean: times_power(scale.mean, exponent),
            error: planned.error,
            exponent: scale.exponent.saturating_add(exponent),
            average: scale.average,
        })
    })
}

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
pub fn build<const N: usize, const C: usize>(
    depth: u32,
    pixels: &[f32],
    squares: &mut [[f32; C]],
) -> status::Result<Scale> {
    const { assert!(C == 1 << N, "a square of n axes has 2^n children") };
    if complete_len(C, depth) != Some(squares.len()) {
        return Err(Status::InvalidArgument);
    }
    let mut single = [0.0];
    let finest = squares.as_flattened_mut();
    let coarser = finest.len().saturating_sub(pixels.len());
    let finest = if depth == 0 { &mut single } else { finest.get_mut(coarser..).unwrap_or_default() };
    morton::copy_from_c_order::<N>(depth, pixels, finest)?;
    let exponent = tree::normalise(finest);
    let average = if depth == 0 { f64::from(single[0]) } else { tree::build(depth, squares)? };
    Ok(Scale { average: average as f32, exponent, mean: average * exp2i(exponent) })
}
