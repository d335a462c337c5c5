//! Directions <-> the unit square: the equal-area octahedral map, and the lat-long and cube layouts of input maps.
//!
//! The octahedral map (Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD") has the Jacobian
//! 4 pi everywhere: +z is the centre of the square, -z its four corners, the equator the diamond between the
//! edges' midpoints. Axis 1 of the square runs along x, axis 2 along y.
//! The radius comes from `sqrt((x^2 + y^2) / (1 + |z|))`, which does not cancel at the poles.

use crate::numeric::{ONE_MINUS_EPSILON, min, sqrt};
use crate::simd::Num;
use core::f64::consts::PI;
use glam::{Mat3, Vec3};

/// The solid angle of the sphere: a density on the square divided by this is a density per solid angle.
pub const SPHERE: f32 = 4.0 * core::f32::consts::PI;

/// The points of [0, 1]^2 for directions of unit length. -0 counts as +0, and a point on a folded edge is the one with the lower Morton code.
#[inline(always)]
pub fn octahedral_square<F: Num>([x, y, z]: [F; 3]) -> [F; 2] {
    let (zero, half, one) = (F::splat(0.0), F::splat(0.5), F::splat(1.0));
    let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
    let radius = ((ax * ax + ay * ay) / (one + az)).sqrt();
    let minor = radius * atan_turns(ax.min(ay) / ax.max(ay).max(F::splat(f32::MIN_POSITIVE)));
    let major = radius - minor;
    let steep = ax.lt(ay);
    let (along_x, along_y) = (F::select(steep, minor, major), F::select(steep, major, minor));
    let south = z.lt(zero);
    let lower_x = F::select(south, half * along_y, half - half * along_x);
    let lower_y = F::select(south, half * along_x, half - half * along_y);
    let s = F::select(zero.lt(x), one - lower_x, lower_x).max(zero).min(one);
    let t = F::select(zero.lt(y), one - lower_y, lower_y).max(zero).min(one);
    [s, t]
}

/// The directions for points of [0, 1]^2.
#[inline(always)]
pub fn octahedral_direction<F: Num>(s: [F; 2]) -> [F; 3] {
    let (half, one, two) = (F::splat(0.5), F::splat(1.0), F::splat(2.0));
    // Distances to the nearer edges, then from the centre (north) or, folded, from the corner (south): all exact.
    let (x, y) = (s[0].min(one - s[0]), s[1].min(one - s[1]));
    let south = (x + y).lt(half);
    let (a, b) = (F::select(south, two * y, one - two * x), F::select(south, two * x, one - two * y));
    let radius = a + b;
    let (sin, cos) = sin_cos_turns(a.min(b) / radius.max(F::splat(f32::MIN_POSITIVE)));
    let squared = radius * radius;
    let horizontal = radius * (two - squared).sqrt();
    let steep = a.lt(b);
    let (dx, dy) = (F::select(steep, sin, cos), F::select(steep, cos, sin));
    let z = one - squared;
    [
        (horizontal * dx).copysign(s[0] - half),
        (horizontal * dy).copysign(s[1] - half),
        F::select(south, F::splat(0.0) - z, z),
    ]
}

/// The point of [0, 1)^2 for a direction of unit length: as [`octahedral_square`].
pub fn square(direction: Vec3) -> [f32; 2] {
    octahedral_square(direction.to_array()).map(|s| min(s, ONE_MINUS_EPSILON))
}

/// The direction for a point of [0, 1]^2: as [`octahedral_direction`].
pub fn direction(point: [f32; 2]) -> Vec3 {
    octahedral_direction(point).into()
}

/// The coefficients of [`atan_turns`].
const ATAN_TURNS: [f32; 9] = [
    0.636_619_75,
    -0.212_205_07,
    0.127_278_34,
    -0.090_431_29,
    0.067_772_95,
    -0.047_843_616,
    0.027_267_836,
    -0.010_288_856,
    0.001_829_949,
];
/// The coefficients of the sine and the cosine of [`sin_cos_turns`].
const SIN_TURNS: [f32; 5] = [1.570_796_4, -0.645_964_1, 0.079_692_58, -0.004_681_266_3, 0.000_158_206_3];
const COS_TURNS: [f32; 5] = [1.0, -1.233_700_5, 0.253_669_26, -0.020_860_216, 0.000_903_541_6];

/// `atan(x) 2 / pi` for x in [0, 1], within 1.4e-7 relative (minimax, odd, degree 17).
#[inline(always)]
pub fn atan_turns<F: Num>(x: F) -> F {
    x * polynomial(ATAN_TURNS, x * x)
}

/// Sine and cosine of `x pi / 2` for x in [0, 1/2], within 1e-7 relative.
#[inline(always)]
pub fn sin_cos_turns<F: Num>(x: F) -> (F, F) {
    let t = x * x;
    (x * polynomial(SIN_TURNS, t), polynomial(COS_TURNS, t))
}

/// Sine and the magnitude of the cosine of `x pi / 2` for x in [0, 2]: of the eighth of the circle, by reflections.
#[inline(always)]
pub fn sin_cos_half<F: Num>(x: F) -> (F, F) {
    let one = F::splat(1.0);
    let quarter = x.min(F::splat(2.0) - x).max(F::splat(0.0));
    let (minor, major) = sin_cos_turns(quarter.min(one - quarter));
    let swapped = F::splat(0.5).lt(quarter);
    (F::select(swapped, major, minor), F::select(swapped, minor, major))
}

/// Sine and cosine of `x pi / 2` for x in [0, 4].
#[inline(always)]
pub fn sin_cos_quarters<F: Num>(x: F) -> (F, F) {
    let two = F::splat(2.0);
    let half = F::select(two.le(x), F::splat(4.0) - x, x);
    let (sine, cosine) = sin_cos_half(half);
    (sine.copysign(two - x), cosine.copysign(F::splat(1.0) - half))
}

/// The polynomial with coefficients `c`, lowest first, at `t`: even and odd powers apart, which takes half as long.
#[inline(always)]
fn polynomial<F: Num, const N: usize>(c: [f32; N], t: F) -> F {
    let squared = t * t;
    let (last, before) = (F::splat(c[N - 1]), F::splat(c[N - 2]));
    let (mut same, mut other) = (last, before);
    let mut k = N - 2;
    while k > 0 {
        k -= 1;
        let next = same * squared + F::splat(c[k]);
        (same, other) = (other, next);
    }
    // `other` holds the constant's powers.
    other + same * t
}

/// The azimuth of a direction in quarter turns, [0, 4).
#[inline(always)]
pub fn azimuth<F: Num>(x: F, y: F) -> F {
    let (zero, one, two, four) = (F::splat(0.0), F::splat(1.0), F::splat(2.0), F::splat(4.0));
    let (ax, ay) = (x.abs(), y.abs());
    let eighth = atan_turns(ax.min(ay) / ax.max(ay).max(F::splat(f32::MIN_POSITIVE)));
    let quarter = F::select(ax.lt(ay), one - eighth, eighth);
    let half = F::select(x.lt(zero), two - quarter, quarter);
    let whole = F::select(y.lt(zero), four - half, half);
    F::select(four.le(whole), zero, whole)
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

    /// Directions of map space in world space.
    #[inline(always)]
    pub fn to_world<F: Num>(&self, map: [F; 3]) -> [F; 3] {
        let [a, b, c, d, e, f, g, h, i] = self.to_array();
        [dot([a, d, g], map), dot([b, e, h], map), dot([c, f, i], map)]
    }

    /// Directions of world space in map space.
    #[inline(always)]
    pub fn to_map<F: Num>(&self, world: [F; 3]) -> [F; 3] {
        let [a, b, c, d, e, f, g, h, i] = self.to_array();
        [dot([a, b, c], world), dot([d, e, f], world), dot([g, h, i], world)]
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

#[inline(always)]
fn dot<F: Num>([a, b, c]: [f32; 3], [x, y, z]: [F; 3]) -> F {
    F::splat(a) * x + F::splat(b) * y + F::splat(c) * z
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
