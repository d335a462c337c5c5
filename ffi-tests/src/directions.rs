//! Directions about another one: uniform over a hemisphere, by the cosine, at an angle.

use glam::Vec3;
use std::f32::consts::TAU;

/// A direction uniform over the hemisphere.
pub fn hemisphere(normal: Vec3, u: [f32; 2]) -> Vec3 {
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let (sin, cos) = (TAU * u[1]).sin_cos();
    let across = (1.0 - u[0] * u[0]).max(0.0).sqrt();
    tangent * (across * cos) + bitangent * (across * sin) + normal * u[0]
}

/// The direction at an angle from another, on one of its sides.
pub fn beside(direction: Vec3, angle: f32, turn: f32) -> Vec3 {
    let (a, b) = direction.any_orthonormal_pair();
    let side = a * turn.cos() + b * turn.sin();
    (direction * angle.cos() + side * angle.sin()).normalize()
}

/// A direction uniform over the sphere.
pub fn sphere(u: [f64; 2]) -> [f64; 3] {
    let (z, (sin, cos)) = (1.0 - 2.0 * u[0], (std::f64::consts::TAU * u[1]).sin_cos());
    let across = (1.0 - z * z).sqrt();
    [across * cos, across * sin, z]
}

/// A direction proportional to the cosine.
pub fn cosine(normal: Vec3, u: [f32; 2]) -> Vec3 {
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let (radius, turn) = (u[0].sqrt(), TAU * u[1]);
    tangent * (radius * turn.cos()) + bitangent * (radius * turn.sin()) + normal * (1.0 - u[0]).max(0.0).sqrt()
}
