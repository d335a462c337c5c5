//! The texels of a cube map as directions, uniform on the plane of each face.
//!
//! Of a row, `edge` is where it begins on its face, from -1 to 1, and `axis` is 1, 2 or 3 for the faces along x, y or z,
//! negative for those on the negative side. Seen from the centre a texel is the smaller the farther it is from the middle
//! of its face, so densities grow outwards by 1 / m^3 with m the direction's largest component.

use super::inverse::{self, Inverse};
use super::shape::{ROUNDING, RowNumbers, Shape, Texel, cell, cells};
use crate::numeric::{max, select, sqrt};
use crate::simd::{LANES, Lanes};
use crate::sphere::cube_solid_angle;
use crate::sphere::vector::V3;
use core::f64::consts::PI;
use glam::Vec3;

/// [`super::Layout::Cube`].
#[derive(Clone, Copy, Debug)]
pub struct Cube;

impl Shape for Cube {
    const CONSTANT: bool = false;
    /// Where a sample that left its texel begins to move.
    const BORDER: f64 = 2.0 * ROUNDING / PI;

    fn share([_, columns]: Texel, [row, column]: Texel) -> f64 {
        let edges = |i: u32| [i, i + 1].map(|i| 2.0 * f64::from(i) / f64::from(columns) - 1.0);
        cube_solid_angle(edges(column), edges(row % columns.max(1))) / (4.0 * PI)
    }

    fn numbers(inverse: &Inverse, row: u32) -> RowNumbers {
        let [_, columns] = inverse.size();
        let (face, row_of_face) = (row / columns.max(1), row % columns.max(1));
        let width = 2.0 / f64::from(columns);
        let axis = f64::from(1 + face / 2);
        let probability = f64::from(inverse.row(row).width) * inverse::UNIT * inverse::UNIT;
        let signed = if face % 2 == 1 { -axis } else { axis };
        [(f64::from(row_of_face) * width - 1.0) as f32, signed as f32, (probability / (width * width)) as f32, 1.0]
    }

    #[inline(always)]
    fn direction([edge, axis, ..]: RowNumbers, column: f32, columns: f32, [a, b]: [f32; 2]) -> Vec3 {
        let width = 2.0 / columns;
        let (s, t) = ((column + b) * width - 1.0, edge + a * width);
        let (side, length) = (1f32.copysign(axis), sqrt(1.0 + s * s + t * t));
        let (is_x, is_z) = (axis.abs() < 1.5, 2.5 < axis.abs());
        let x = select(is_x, side, select(is_z, side * s, s));
        let y = select(is_x || is_z, 0.0 - t, side);
        let z = select(is_x, 0.0 - side * s, select(is_z, side, side * t));
        Vec3::new(x / length, y / length, z / length)
    }

    #[inline(always)]
    fn texel([_, columns]: Texel, d: Vec3) -> (Texel, f32) {
        let (face, [s, t], major) = on_face(d);
        let half = inverse::number(columns) * 0.5;
        let place = [t, s].map(|c| cell((c / major + 1.0) * half, columns));
        ([face * columns + place[0], place[1]], 1.0 / (major * major * major))
    }

    fn inside(_: RowNumbers, [_, columns]: Texel, [row, column]: Texel, d: Vec3) -> [f32; 2] {
        let (_, [s, t], major) = on_face(d);
        let half = inverse::number(columns) * 0.5;
        let first = [row % columns.max(1), column].map(inverse::number);
        [(t / major + 1.0) * half - first[0], (s / major + 1.0) * half - first[1]]
    }

    #[inline(always)]
    fn direction_lanes<F: Lanes>(row: [F; 4], column: F, columns: f32, [a, b]: [F; 2]) -> V3<F> {
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let [edge, axis, ..] = row;
        let width = F::splat(2.0 / columns);
        let (s, t) = ((column + b) * width - one, edge + a * width);
        let (side, length) = (one.copysign(axis), (one + s * s + t * t).sqrt());
        let (is_x, is_z) = (axis.abs().lt(F::splat(1.5)), F::splat(2.5).lt(axis.abs()));
        let x = F::select(is_x, side, F::select(is_z, side * s, s));
        let y = F::select(F::or(is_x, is_z), zero - t, side);
        let z = F::select(is_x, zero - side * s, F::select(is_z, side, side * t));
        [x / length, y / length, z / length]
    }

    #[inline(always)]
    fn texel_lanes<F: Lanes>([_, columns]: Texel, [x, y, z]: V3<F>) -> ([[u32; LANES]; 2], F) {
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
        let is_x = F::and(ay.le(ax), az.le(ax));
        let (yes, no) = (az.le(ay), F::mask(0));
        let is_y = F::select_mask(is_x, no, yes);
        let signed = F::select(is_x, x, F::select(is_y, y, z));
        let major = F::select(is_x, ax, F::select(is_y, ay, az)).max(F::splat(f32::MIN_POSITIVE));
        let side = one.copysign(signed);
        let s = F::select(is_x, zero - side * z, F::select(is_y, x, side * x));
        let t = F::select(is_y, side * z, zero - y);
        let axis = F::select(is_x, zero, F::select(is_y, F::splat(2.0), F::splat(4.0)));
        let face = axis + F::only(side.lt(zero), one);
        let half = F::splat(inverse::number(columns) * 0.5);
        let mut rows = cells((t / major + one) * half, columns);
        for (row, face) in rows.iter_mut().zip(F::numbers(face.truncate())) {
            *row = row.wrapping_add(face.wrapping_mul(columns));
        }
        ([rows, cells((s / major + one) * half, columns)], one / (major * major * major))
    }
}

/// The face of a direction, the point on its plane times the largest component, and that component's size.
#[inline(always)]
fn on_face(d: Vec3) -> (u32, [f32; 2], f32) {
    let (ax, ay, az) = (d.x.abs(), d.y.abs(), d.z.abs());
    let is_x = ay <= ax && az <= ax;
    let is_y = !is_x && az <= ay;
    let signed = select(is_x, d.x, select(is_y, d.y, d.z));
    let major = max(select(is_x, ax, select(is_y, ay, az)), f32::MIN_POSITIVE);
    let side = 1f32.copysign(signed);
    let s = select(is_x, 0.0 - side * d.z, select(is_y, d.x, side * d.x));
    let t = select(is_y, side * d.z, 0.0 - d.y);
    let axis = if is_x { 0 } else { if is_y { 2 } else { 4 } };
    (axis + u32::from(side < 0.0), [s, t], major)
}
