//! Rotations and reflections of worlds.

use super::vector::{V3, cross, dot, scale, sub, unit};

/// Rotations and a reflection of the world against the map, row-major.
pub fn matrices() -> [[f32; 9]; 3] {
    let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let turned = rows(unit([1.0, 2.0, -0.5]), unit([0.3, -1.0, 2.0]), 1.0);
    let reflected = rows(unit([-0.7, 0.2, 1.0]), unit([1.0, 1.0, 0.1]), -1.0);
    [identity, turned, reflected]
}

/// The orthonormal matrix with the first row `a`, the second in the plane of `a` and `b`, and this determinant.
pub fn rows(a: V3, b: V3, determinant: f64) -> [f32; 9] {
    let second = unit(sub(b, scale(a, dot(a, b))));
    let third = scale(cross(a, second), determinant);
    let all: Vec<f32> = [a, second, third].into_iter().flatten().map(|c| c as f32).collect();
    all.try_into().unwrap()
}
