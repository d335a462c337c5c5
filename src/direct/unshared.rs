//! Hits that share nothing: what stands for [`shared`](super::shared) without the feature `products`.

use super::Ray;
use super::joint::Points;
use crate::brdf::point::Point;
use crate::light::environment::Environment;
use crate::simd::Level;
use crate::status::Error;
use core::convert::Infallible;
use core::marker::PhantomData;

/// No number of hits is enough.
pub fn is_worth(_: u32) -> bool {
    false
}

/// No hit draws from products.
pub fn serves(_: &Environment<'_>, _: &Point<'_>, _: u32) -> bool {
    false
}

/// No lobe is wide enough.
pub fn is_wide(_: f32) -> bool {
    false
}

/// The bytes of a pixel's products.
pub fn bytes() -> usize {
    0
}

/// The bytes in which one is prepared.
pub fn scratch_bytes() -> usize {
    0
}

/// The products of a pixel: there are none.
#[derive(Debug)]
pub struct Shared<'a>(Infallible, PhantomData<&'a ()>);

impl Shared<'_> {
    /// None.
    pub fn new(_: &mut [u8]) -> Option<Self> {
        None
    }

    /// Never called.
    pub fn clear(&mut self) {
        match self.0 {}
    }

    /// Never called.
    ///
    /// # Errors
    /// None.
    pub fn direct(
        &mut self,
        _: Level,
        _: &Environment<'_>,
        _: &Point<'_>,
        _: &Points,
        _: &mut [f32],
        _: &mut [Ray],
    ) -> Result<Option<usize>, Error> {
        match self.0 {}
    }
}
