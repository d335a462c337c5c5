//! Directions and points of the square of [`crate::sphere`] in eight lanes, bit for bit.

use super::Lanes;
use super::vector::{V3, dot, splat};
use crate::numeric::{ATAN_TURNS, COS_TURNS, ONE_MINUS_EPSILON, SIN_TURNS};
use crate::sphere::{Frame, UNIT};

/// The points of [0, 1)^2 for directions of unit length.
#[inline(always)]
pub fn square<F: Lanes>([x, y, z]: [F; 3]) -> [F; 2] {
    let (zero, one) = (F::splat(0.0), F::splat(1.0));
    let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
    let radius = ((ax * ax + ay * ay) / (one + az)).sqrt();
    let minor = radius * atan_turns(ax.min(ay) / ax.max(ay).max(F::splat(f32::MIN_POSITIVE)));
    let major = radius - minor;
    let steep = ax.lt(ay);
    let (along_x, along_y) = (F::select(steep, minor, major), F::select(steep, major, minor));
    let south = z.lt(zero);
    [coordinate(zero.lt(x), south, along_x, along_y), coordinate(zero.lt(y), south, along_y, along_x)]
}

#[inline(always)]
fn coordinate<F: Lanes>(positive: F::Mask, south: F::Mask, own: F, other: F) -> F {
    let half = F::splat(0.5);
    let lower = F::select(south, half * other, half - half * own);
    let s = F::select(positive, F::splat(1.0) - lower, lower);
    s.max(F::splat(0.0)).min(F::splat(ONE_MINUS_EPSILON))
}

/// The directions for points of [0, 1]^2.
#[inline(always)]
pub fn direction<F: Lanes>(s: [F; 2]) -> [F; 3] {
    let (half, one, two) = (F::splat(0.5), F::splat(1.0), F::splat(2.0));
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
    let x = (horizontal * dx).copysign(s[0] - half);
    let y = (horizontal * dy).copysign(s[1] - half);
    [x, y, F::select(south, F::splat(0.0) - z, z)]
}

/// Directions of map space in world space.
#[inline(always)]
pub fn to_world<F: Lanes>(frame: &Frame, v: V3<F>) -> V3<F> {
    let [a, b, c, d, e, f, g, h, i] = frame.to_array();
    [dot(splat([a, d, g]), v), dot(splat([b, e, h]), v), dot(splat([c, f, i]), v)]
}

/// Directions of world space in map space.
#[inline(always)]
pub fn to_map<F: Lanes>(frame: &Frame, v: V3<F>) -> V3<F> {
    let [a, b, c, d, e, f, g, h, i] = frame.to_array();
    [dot(splat([a, b, c]), v), dot(splat([d, e, f]), v), dot(splat([g, h, i]), v)]
}

/// Directions, normalised, and which are of unit length as [`crate::sphere::unit`] demands it; others mean nothing.
#[inline(always)]
pub fn unit<F: Lanes>([x, y, z]: V3<F>) -> (V3<F>, F::Mask) {
    let squared = x * x + y * y + z * z;
    let unit = (squared - F::splat(1.0)).abs().lt(F::splat(UNIT));
    let length = squared.sqrt();
    ([x / length, y / length, z / length], unit)
}

/// The points of the square for world directions, and whether those are of unit length.
#[inline(always)]
pub fn to_square<F: Lanes>(frame: &Frame, world: V3<F>) -> ([F; 2], F::Mask) {
    let (v, unit) = unit(world);
    (square(to_map(frame, v)), unit)
}

/// As [`crate::numeric::atan_turns`].
#[inline(always)]
pub fn atan_turns<F: Lanes>(x: F) -> F {
    x * horner(ATAN_TURNS, x * x)
}

/// As [`crate::numeric::sin_cos_turns`].
#[inline(always)]
pub fn sin_cos_turns<F: Lanes>(x: F) -> (F, F) {
    let t = x * x;
    (x * horner(SIN_TURNS, t), horner(COS_TURNS, t))
}

/// The polynomial with coefficients `c`, lowest first, at `t`.
#[inline(always)]
fn horner<F: Lanes, const N: usize>(c: [f32; N], t: F) -> F {
    let mut sum = F::splat(c[N - 1]);
    for k in (0..N - 1).rev() {
        sum = sum * t + F::splat(c[k]);
    }
    sum
}

/// The world directions of points of the square.
#[inline(always)]
pub fn direction_in<F: Lanes>(frame: &Frame, s: [F; 2]) -> V3<F> {
    to_world(frame, direction(s))
}
