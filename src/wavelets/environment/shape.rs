//! What a layout of texels must tell to be sampled: where texels lie, and how large they are.

use super::inverse::{self, Inverse};
use crate::simd::{LANES, Lanes};
use crate::sphere::vector::V3;
use glam::Vec3;

/// A texel, or how many there are: row and column.
pub type Texel = [u32; 2];

/// Four numbers of a row: two that place it, the pdf in a texel whose column is one unit wide, and how near to the left or
/// right border of a texel rounding may carry a direction into the next.
pub type RowNumbers = [f32; 4];

/// Rounding moves a direction by less than this, radians.
pub const ROUNDING: f64 = 2e-6;

/// A layout. Functions of lanes give the bits of those of the same name.
pub trait Shape {
    /// Whether densities are constant in a texel: then only a sample near a border needs to be looked up again.
    const CONSTANT: bool;
    /// How near to the upper or lower border of a texel rounding may carry a direction into the next, if there were one row.
    const BORDER: f64;

    /// A texel's share of the sphere.
    fn share(size: Texel, texel: Texel) -> f64;
    /// The numbers of a row.
    fn numbers(inverse: &Inverse, row: u32) -> RowNumbers;
    /// The direction at a place inside a texel, down and along.
    fn direction(row: RowNumbers, column: f32, columns: f32, inside: [f32; 2]) -> Vec3;
    /// The texel of a direction, and its density there over that which its row tells.
    fn texel(size: Texel, d: Vec3) -> (Texel, f32);
    /// Where inside its texel a direction lies.
    fn inside(row: RowNumbers, size: Texel, texel: Texel, d: Vec3) -> [f32; 2];
    /// As [`Shape::direction`].
    fn direction_lanes<F: Lanes>(row: [F; 4], column: F, columns: f32, inside: [F; 2]) -> V3<F>;
    /// As [`Shape::texel`], rows and columns apart.
    fn texel_lanes<F: Lanes>(size: Texel, d: V3<F>) -> ([[u32; LANES]; 2], F);
}

/// The cell of a coordinate, not beyond the last of so many: rounding may lead there.
#[inline(always)]
pub fn cell(coordinate: f32, count: u32) -> u32 {
    (coordinate as u32).min(count.wrapping_sub(1))
}

/// As [`cell`].
#[inline(always)]
pub fn cells<F: Lanes>(coordinate: F, count: u32) -> [u32; LANES] {
    let last = F::splat(inverse::number(count.wrapping_sub(1)));
    F::numbers(coordinate.max(F::splat(0.0)).min(last).truncate())
}
