//! The stored tree of an image: complete in scratch memory first, then the squares that an error budget keeps.

use crate::blob::Size;
use crate::numeric::times_power;
use crate::status::{Error, Status};
use crate::wavelets::stored::{AXES, Facts, Header, Parts, Refused, store};
use crate::wavelets::tree::{MAX_DEPTH, Tree, complete_len};
use crate::wavelets::{image, prune};
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
    pub fn check(&self) -> core::result::Result<(), Error> {
        Error::first([
            (AXES.contains(&self.dimensions), c"dimensions"),
            (self.depth <= MAX_DEPTH, c"depth"),
            (self.error_budget >= 0.0, c"error_budget"),
        ])?;
        self.complete().map(|_| ()).ok_or(Error::new(Status::Overflow, 0).of(c"depth"))
    }

    /// The squares of the complete tree.
    fn complete(&self) -> Option<usize> {
        let squares = match self.dimensions {
            2 => complete_len::<4>(self.depth),
            _ => complete_len::<16>(self.depth),
        };
        squares.map(|squares| squares as usize)
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
    /// [`Refused`].
    pub fn build_in(
        &self,
        pixels: &[f32],
        exponent: i32,
        memory: &mut [u8],
        scratch: &mut [u8],
    ) -> core::result::Result<Header, Refused> {
        match self.dimensions {
            2 => build::<2, 4>(self, pixels, exponent, memory, scratch),
            _ => build::<4, 16>(self, pixels, exponent, memory, scratch),
        }
    }
}

fn build<const N: usize, const C: usize>(
    config: &Config,
    pixels: &[f32],
    exponent: i32,
    memory: &mut [u8],
    scratch: &mut [u8],
) -> core::result::Result<Header, Refused>
where
    [f32; C]: Pod,
{
    let complete = config.complete().ok_or(Refused::Squares)?;
    let (squares, savings) = scratch
        .split_at_mut_checked(complete * size_of::<[f32; C]>())
        .and_then(|(squares, savings)| Some((try_cast_slice_mut(squares).ok()?, try_cast_slice_mut(savings).ok()?)))
        .ok_or(Status::MemoryTooSmall)?;
    let scale = image::build::<N, C>(config.depth, pixels, squares)?;
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
