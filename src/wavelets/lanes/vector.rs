//! Eight vectors of three components. Components are written out one by one, here and wherever lanes are computed:
//! closures are not always inlined, and lanes must be.

use super::{LANES, Lanes};
use glam::Vec3;

/// Eight vectors.
pub type V3<F> = [F; 3];

/// The same vector in all lanes.
#[inline(always)]
pub fn splat<F: Lanes>(v: [f32; 3]) -> V3<F> {
    [F::splat(v[0]), F::splat(v[1]), F::splat(v[2])]
}

/// Component by component, the numbers of all lanes.
#[inline(always)]
pub fn to_arrays<F: Lanes>(v: V3<F>) -> [[f32; LANES]; 3] {
    [v[0].to_array(), v[1].to_array(), v[2].to_array()]
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
