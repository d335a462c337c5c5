//! Directions <-> the unit square: the equal-area octahedral map, and the lat-long and cube layouts of input maps.
//!
//! The octahedral map (Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD") has the Jacobian
//! 4 pi everywhere: +z is the centre of the square, -z its four corners, the equator the diamond between the
//! edges' midpoints. Axis 1 of the square runs along x, axis 2 along y.
//! The radius comes from `sqrt((x^2 + y^2) / (1 + |z|))`, which does not cancel at the poles.

use crate::numeric::{ONE_MINUS_EPSILON, atan_turns, max, min, select, sin_cos_turns, sqrt};
use core::f64::consts::PI;
use glam::{Mat3, Vec3};

/// The solid angle of the sphere: a density on the square divided by this is a density per solid angle.
pub const SPHERE: f32 = 4.0 * core::f32::consts::PI;

/// The point of [0, 1)^2 for a direction of unit length.
///
/// Total and single-valued: -0 counts as +0, and a point on a folded edge is the one with the lower Morton code.
#[inline(always)]
pub fn square(direction: Vec3) -> [f32; 2] {
    let [x, y, z] = direction.to_array();
    let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
    let radius = sqrt((ax * ax + ay * ay) / (1.0 + az));
    let turns = atan_turns(min(ax, ay) / max(max(ax, ay), f32::MIN_POSITIVE));
    let minor = radius * turns;
    let major = radius - minor;
    let (along_x, along_y) = (select(ay > ax, minor, major), select(ay > ax, major, minor));
    // In the lower half |u| = 1 - along_y and |v| = 1 - along_x.
    let south = z < 0.0;
    [coordinate(x > 0.0, south, along_x, along_y), coordinate(y > 0.0, south, along_y, along_x)]
}

/// One coordinate of the square from the distances along its own and the other axis.
#[inline(always)]
fn coordinate(positive: bool, south: bool, own: f32, other: f32) -> f32 {
    let lower = select(south, 0.5 * other, 0.5 - 0.5 * own);
    min(max(select(positive, 1.0 - lower, lower), 0.0), ONE_MINUS_EPSILON)
}

/// The direction for a point of [0, 1]^2.
#[inline(always)]
pub fn direction(s: [f32; 2]) -> Vec3 {
    // Distances to the nearer edges, then from the centre (north) or, folded, from the corner (south): all exact.
    let [x, y] = s.map(|s| min(s, 1.0 - s));
    let south = x + y < 0.5;
    let (a, b) = (select(south, 2.0 * y, 1.0 - 2.0 * x), select(south, 2.0 * x, 1.0 - 2.0 * y));
    let radius = a + b;
    let (sin, cos) = sin_cos_turns(min(a, b) / max(radius, f32::MIN_POSITIVE));
    let squared = radius * radius;
    let horizontal = radius * sqrt(2.0 - squared);
    let (dx, dy) = (select(b > a, sin, cos), select(b > a, cos, sin));
    let z = 1.0 - squared;
    Vec3::new((horizontal * dx).copysign(s[0] - 0.5), (horizontal * dy).copysign(s[1] - 0.5), select(south, -z, z))
}

/// The point `(u, v)` of a lat-long map, u = phi / 2 pi and v = theta / pi from +z, for a direction.
pub fn latlong(direction: [f64; 3]) -> [f64; 2] {
    let [x, y, z] = direction;
    let phi = libm::atan2(y, x);
    let turns = phi / (2.0 * PI);
    let u = if turns < 0.0 { turns + 1.0 } else { turns };
    [u, libm::atan2(libm::sqrt(x * x + y * y), z) / PI]
}

/// The solid angle of a texel in `row` of a lat-long map of `width` x `height`, without cancellation at the poles.
pub fn latlong_solid_angle(width: u32, height: u32, row: u32) -> f64 {
    let middle = PI * (f64::from(row) + 0.5) / f64::from(height);
    4.0 * PI / f64::from(width) * libm::sin(middle) * libm::sin(0.5 * PI / f64::from(height))
}

/// The face (+x, -x, +y, -y, +z, -z) and the point `(u, v)` in [0, 1]^2 of a cube map for a direction; v runs down.
pub fn cube(direction: [f64; 3]) -> (u32, [f64; 2]) {
    let [x, y, z] = direction;
    let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
    let (face, s, t, major) = if ax >= ay && ax >= az {
        if x > 0.0 { (0, -z, -y, ax) } else { (1, z, -y, ax) }
    } else if ay >= az {
        if y > 0.0 { (2, x, z, ay) } else { (3, x, -z, ay) }
    } else if z > 0.0 {
        (4, x, -y, az)
    } else {
        (5, -x, -y, az)
    };
    let scale = if major > 0.0 { 0.5 / major } else { 0.0 };
    (face, [0.5 + s * scale, 0.5 + t * scale])
}

/// The direction, not normalised, for a point `(s, t)` in [-1, 1]^2 of a cube face.
pub fn cube_direction(face: u32, s: f64, t: f64) -> [f64; 3] {
    match face {
        0 => [1.0, -t, -s],
        1 => [-1.0, -t, s],
        2 => [s, 1.0, t],
        3 => [s, -1.0, -t],
        4 => [s, -t, 1.0],
        _ => [-s, -t, -1.0],
    }
}

/// A rotation or reflection of world space against map space; the matrix is orthonormal to f32 precision.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub struct Frame(Mat3);

impl Frame {
    /// World space is map space.
    pub const IDENTITY: Frame = Frame(Mat3::IDENTITY);

    /// The frame of a row-major 3x3 `world_from_map`; `None` if `|M^T M - I| > 1e-4` in any element.
    ///
    /// One Newton step of the polar decomposition in f64 removes what is left of the error, so that the transpose
    /// is the inverse and a direction finds its way back to the texel that it was sampled in.
    pub fn new(world_from_map: &[f32; 9]) -> Option<Frame> {
        let m = glam::DMat3::from_cols_array(&world_from_map.map(f64::from)).transpose();
        let gram = m.transpose() * m;
        if !(gram - glam::DMat3::IDENTITY).to_cols_array().iter().all(|e| e.abs() <= 1e-4) {
            return None;
        }
        let orthonormal = m * (glam::DMat3::IDENTITY * 1.5 - gram * 0.5);
        Some(Frame(orthonormal.as_mat3()))
    }

    /// A direction of map space in world space.
    #[inline(always)]
    pub fn to_world(&self, map: Vec3) -> Vec3 {
        self.0 * map
    }

    /// A direction of world space in map space.
    #[inline(always)]
    pub fn to_map(&self, world: Vec3) -> Vec3 {
        Vec3::new(self.0.x_axis.dot(world), self.0.y_axis.dot(world), self.0.z_axis.dot(world))
    }

    /// The nine numbers, column by column.
    pub fn to_array(&self) -> [f32; 9] {
        self.0.to_cols_array()
    }

    /// The frame of nine numbers that [`Frame::to_array`] gave.
    pub fn from_array(columns: &[f32; 9]) -> Frame {
        Frame(Mat3::from_cols_array(columns))
    }
}

/// How far the square of a unit vector's length may lie from 1: its length within 1e-3, and rounding.
pub const UNIT: f32 = 2.002e-3;

/// A direction of unit length within 1e-3, normalised; `None` for any other.
#[inline(always)]
pub fn unit(v: [f32; 3]) -> Option<Vec3> {
    let [x, y, z] = v;
    let squared = x * x + y * y + z * z;
    if (squared - 1.0).abs() < UNIT {
        let length = sqrt(squared);
        Some(Vec3::new(x / length, y / length, z / length))
    } else {
        None
    }
}
