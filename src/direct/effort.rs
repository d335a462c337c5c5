//! How many candidates a point is worth: more where a narrow lobe may meet a lamp.
//!
//! An image's squared error is the sum over its points, so candidates should be spread over points as their standard deviations are
//! (Neyman 1934). Those of narrow lobes are the largest by far, under bright and small lights.

use crate::brdf::point::Point;

/// The most that candidates are multiplied by.
pub const MOST: usize = 4;

/// What the candidates of a point are multiplied by.
pub fn factor(point: &Point<'_>) -> usize {
    if point.is_narrow() { MOST } else { 1 }
}
