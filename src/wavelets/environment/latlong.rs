//! The texels of a lat-long map as directions, uniform in the solid angle of each.
//!
//! Of a row, `near` is 1 - |z| at the edge that is nearer to the pole of its hemisphere, and `extent` by how much 1 - |z|
//! grows to the other edge; negative in the southern hemisphere, whose rows begin at the edge that is farther from its
//! pole. So nothing cancels at the poles.

use super::inverse::{self, Inverse};
use super::shape::{ROUNDING, RowNumbers, Shape, Texel, cell, cells};
use crate::numeric::{atan_turns, max, min, select, sin_cos_turns, sqrt};
use crate::simd::{LANES, Lanes};
use crate::sphere::latlong_solid_angle;
use crate::sphere::vector::V3;
use crate::sphere::wide as lanes;
use core::f64::consts::PI;
use glam::Vec3;

/// [`super::Layout::LatLong`].
#[derive(Clone, Copy, Debug)]
pub struct LatLong;

impl Shape for LatLong {
    const CONSTANT: bool = true;
    /// A row is at least half as wide in 1 - |z| as its angle times the sine at its edge.
    const BORDER: f64 = 2.0 * ROUNDING / PI;

    fn share([rows, columns]: Texel, [row, _]: Texel) -> f64 {
        latlong_solid_angle(columns, rows, row) / (4.0 * PI)
    }

    fn numbers(inverse: &Inverse, row: u32) -> RowNumbers {
        let [rows, columns] = inverse.size().map(f64::from);
        let (row_here, last) = (f64::from(row), rows - 1.0);
        // The row's mirror image in the north.
        let south = row_here > 0.5 * last;
        let from_pole = if south { last - row_here } else { row_here };
        // 1 - cos of an angle as a product, without cancellation.
        let height = |edge: f64| {
            let sine = libm::sin(0.5 * PI * edge / rows);
            2.0 * sine * sine
        };
        let near = height(from_pole);
        let extent = height(from_pole + 1.0) - near;
        let texel = 2.0 * PI / columns * extent;
        let probability = f64::from(inverse.row(row).width) * inverse::UNIT * inverse::UNIT;
        let sine = libm::sin(PI * from_pole / rows);
        let border = if sine > 0.0 { (ROUNDING * columns / (2.0 * PI * sine)).min(1.0) } else { 1.0 };
        let signed = if south { -extent } else { extent };
        [near as f32, signed as f32, (probability / texel) as f32, border as f32]
    }

    #[inline(always)]
    fn direction([near, extent, ..]: RowNumbers, column: f32, columns: f32, [a, b]: [f32; 2]) -> Vec3 {
        let south = extent < 0.0;
        let height = near + select(south, 1.0 - a, a) * extent.abs();
        let across = sqrt(max(height * (2.0 - height), 0.0));
        let z = select(south, height - 1.0, 1.0 - height);
        // Quarter turns.
        let turned = (column + b) * (4.0 / columns);
        let passed = |quarter: f32| select(quarter <= turned, 1.0, 0.0);
        let rest = turned - (passed(1.0) + passed(2.0) + passed(3.0));
        let (minor, major) = sin_cos_turns(max(min(rest, 1.0 - rest), 0.0));
        let swapped = 0.5 < rest;
        let (cos, sin) = (select(swapped, minor, major), select(swapped, major, minor));
        let odd = (1.0..2.0).contains(&turned) || 3.0 <= turned;
        let (x, y) = (across * select(odd, sin, cos), across * select(odd, cos, sin));
        Vec3::new(select((1.0..3.0).contains(&turned), 0.0 - x, x), select(2.0 <= turned, 0.0 - y, y), z)
    }

    #[inline(always)]
    fn texel([rows, columns]: Texel, d: Vec3) -> (Texel, f32) {
        let polar = atan_turns(sqrt(d.x * d.x + d.y * d.y) / (1.0 + d.z.abs()));
        let down = select(d.z < 0.0, 1.0 - polar, polar) * inverse::number(rows);
        ([cell(down, rows), cell(along(d, columns), columns)], 1.0)
    }

    fn inside([near, extent, ..]: RowNumbers, [_, columns]: Texel, [_, column]: Texel, d: Vec3) -> [f32; 2] {
        let height = (d.x * d.x + d.y * d.y) / (1.0 + d.z.abs());
        // A row across the equator counts from the north.
        let height = if extent > 0.0 && d.z < 0.0 { 2.0 - height } else { height };
        let a = (height - near) / extent.abs();
        [if extent < 0.0 { 1.0 - a } else { a }, along(d, columns) - inverse::number(column)]
    }

    #[inline(always)]
    fn direction_lanes<F: Lanes>(row: [F; 4], column: F, columns: f32, [a, b]: [F; 2]) -> V3<F> {
        let (zero, half, one, two) = (F::splat(0.0), F::splat(0.5), F::splat(1.0), F::splat(2.0));
        let three = F::splat(3.0);
        let [near, extent, ..] = row;
        let south = extent.lt(zero);
        let height = near + F::select(south, one - a, a) * extent.abs();
        let across = (height * (two - height)).max(zero).sqrt();
        let z = F::select(south, height - one, one - height);
        let turned = (column + b) * F::splat(4.0 / columns);
        let rest = turned - (F::unit(one.le(turned)) + F::unit(two.le(turned)) + F::unit(three.le(turned)));
        let (minor, major) = lanes::sin_cos_turns(rest.min(one - rest).max(zero));
        let swapped = half.lt(rest);
        let (cos, sin) = (F::select(swapped, minor, major), F::select(swapped, major, minor));
        let odd = F::or(F::and(one.le(turned), turned.lt(two)), three.le(turned));
        let (x, y) = (across * F::select(odd, sin, cos), across * F::select(odd, cos, sin));
        let west = F::and(one.le(turned), turned.lt(three));
        [F::select(west, zero - x, x), F::select(two.le(turned), zero - y, y), z]
    }

    #[inline(always)]
    fn texel_lanes<F: Lanes>([rows, columns]: Texel, [x, y, z]: V3<F>) -> ([[u32; LANES]; 2], F) {
        let (zero, one, two, four) = (F::splat(0.0), F::splat(1.0), F::splat(2.0), F::splat(4.0));
        let (ax, ay) = (x.abs(), y.abs());
        let polar = lanes::atan_turns((x * x + y * y).sqrt() / (one + z.abs()));
        let down = F::select(z.lt(zero), one - polar, polar) * F::splat(inverse::number(rows));
        let eighth = lanes::atan_turns(ax.min(ay) / ax.max(ay).max(F::splat(f32::MIN_POSITIVE)));
        let quarter = F::select(ax.lt(ay), one - eighth, eighth);
        let half = F::select(x.lt(zero), two - quarter, quarter);
        let along = F::select(y.lt(zero), four - half, half) * F::splat(inverse::number(columns) * 0.25);
        ([cells(down, rows), cells(along, columns)], one)
    }
}

/// The azimuth of a direction in columns.
#[inline(always)]
fn along(d: Vec3, columns: u32) -> f32 {
    let (ax, ay) = (d.x.abs(), d.y.abs());
    let eighth = atan_turns(min(ax, ay) / max(max(ax, ay), f32::MIN_POSITIVE));
    let quarter = select(ax < ay, 1.0 - eighth, eighth);
    let half = select(d.x < 0.0, 2.0 - quarter, quarter);
    select(d.y < 0.0, 4.0 - half, half) * (inverse::number(columns) * 0.25)
}
