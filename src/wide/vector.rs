//! Eight vectors of three components.

use super::sphere;
use crate::simd::{LANES, Lanes};
use crate::sphere::Frame;
use glam::Vec3;

/// Eight vectors.
pub type V3<F> = [F; 3];

/// The same vector in all lanes.
#[inline(always)]
pub fn splat<F: Lanes>(v: Vec3) -> V3<F> {
    v.to_array().map(F::splat)
}

/// One vector for each lane.
#[inline(always)]
pub fn lanes_of<F: Lanes>(v: &[Vec3; LANES]) -> V3<F> {
    [F::from_array(v.map(|v| v.x)), F::from_array(v.map(|v| v.y)), F::from_array(v.map(|v| v.z))]
}

/// The inner product.
#[inline(always)]
pub fn dot<F: Lanes>(a: V3<F>, b: V3<F>) -> F {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The difference.
#[inline(always)]
pub fn subtract<F: Lanes>(a: V3<F>, b: V3<F>) -> V3<F> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The sum.
#[inline(always)]
pub fn add<F: Lanes>(a: V3<F>, b: V3<F>) -> V3<F> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// The world directions of points of the square.
#[inline(always)]
pub fn direction_in<F: Lanes>(frame: &Frame, s: [F; 2]) -> V3<F> {
    sphere::to_world(frame, sphere::direction(s))
}
