//! Vectors in the frame of a surface.

use crate::simd::Num;
use glam::Vec3;

/// The inner product.
#[inline(always)]
pub fn dot<F: Num>(a: [F; 3], b: [f32; 3]) -> F {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The cross product.
pub fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    Vec3::from_array(a).cross(Vec3::from_array(b)).to_array()
}

/// A unit vector normal to a unit vector: Frisvad's method in the branch-free form of Duff et al. 2017.
pub fn any_tangent([x, y, z]: [f32; 3]) -> [f32; 3] {
    let sign = if z < 0.0 { -1.0 } else { 1.0 };
    let a = -1.0 / (sign + z);
    [1.0 + sign * x * x * a, sign * x * y * a, -sign * x]
}
