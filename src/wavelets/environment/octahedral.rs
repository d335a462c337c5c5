//! The texels of an octahedral map as directions: squares of the library's own square, all of one solid angle.
//!
//! Of a row, `number` is which it is; rows run along axis 2 of the square, columns along axis 1.

use super::inverse::{self, Inverse};
use super::shape::{ROUNDING, RowNumbers, Shape, Texel, cell, cells};
use crate::simd::{LANES, Lanes};
use crate::sphere;
use crate::sphere::vector::V3;
use crate::sphere::wide as lanes;
use core::f64::consts::PI;
use glam::Vec3;

/// [`super::Layout::Octahedral`].
#[derive(Clone, Copy, Debug)]
pub struct Octahedral;

impl Shape for Octahedral {
    const CONSTANT: bool = true;
    /// A step on the sphere is at most .62 as long on the square.
    const BORDER: f64 = 1.25 * ROUNDING;

    fn share([rows, columns]: Texel, _: Texel) -> f64 {
        1.0 / (f64::from(rows) * f64::from(columns))
    }

    fn numbers(inverse: &Inverse, row: u32) -> RowNumbers {
        let [rows, columns] = inverse.size().map(f64::from);
        let probability = f64::from(inverse.row(row).width) * inverse::UNIT * inverse::UNIT;
        let border = (Self::BORDER * columns).min(1.0);
        [inverse::number(row), 0.0, (probability * rows * columns / (4.0 * PI)) as f32, border as f32]
    }

    #[inline(always)]
    fn direction([number, ..]: RowNumbers, column: f32, columns: f32, [a, b]: [f32; 2]) -> Vec3 {
        let width = 1.0 / columns;
        sphere::direction([(column + b) * width, (number + a) * width])
    }

    #[inline(always)]
    fn texel([rows, columns]: Texel, d: Vec3) -> (Texel, f32) {
        let [x, y] = sphere::square(d);
        ([cell(y * inverse::number(rows), rows), cell(x * inverse::number(columns), columns)], 1.0)
    }

    fn inside(_: RowNumbers, [rows, columns]: Texel, [row, column]: Texel, d: Vec3) -> [f32; 2] {
        let [x, y] = sphere::square(d);
        [y * inverse::number(rows) - inverse::number(row), x * inverse::number(columns) - inverse::number(column)]
    }

    #[inline(always)]
    fn direction_lanes<F: Lanes>([number, ..]: [F; 4], column: F, columns: f32, [a, b]: [F; 2]) -> V3<F> {
        let width = F::splat(1.0 / columns);
        lanes::direction([(column + b) * width, (number + a) * width])
    }

    #[inline(always)]
    fn texel_lanes<F: Lanes>([rows, columns]: Texel, d: V3<F>) -> ([[u32; LANES]; 2], F) {
        let [x, y] = lanes::square(d);
        let of = |s: F, count: u32| cells(s * F::splat(inverse::number(count)), count);
        ([of(y, rows), of(x, columns)], F::splat(1.0))
    }
}
