//! How maps lay the sphere of directions out in texels: lat-long and cube maps, eight directions at once.
//!
//! Positions on a map are in texels, columns to the right and rows downwards; the six faces of a cube stand below one
//! another.

use crate::lanes::{F8, V8, sin_cos_turn, turn};
use std::f32::consts::PI;
use wide::{CmpGe, CmpGt, CmpLt, f32x8};

/// A way to lay the sphere out, in the map's own frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Layout {
    /// z up; columns are azimuth, rows are polar angle.
    LatLong,
    /// The faces +x -x +y -y +z -z of OpenGL, table 8.19 of its specification.
    Cube,
}

/// Positions of eight directions on a map.
pub struct Position {
    pub column: F8,
    pub row: F8,
}

/// The face that a direction meets, as the coordinate that is largest, and the coordinates on it from -1 to 1.
struct Face {
    number: F8,
    major: F8,
    s: F8,
    t: F8,
}

impl Layout {
    /// Where directions lie on a map of `width` by `height` texels.
    #[inline]
    pub fn position(self, size: [usize; 2], d: V8) -> Position {
        let [width, height] = size.map(|n| F8::splat(n as f32));
        match self {
            Layout::LatLong => {
                let polar = d.z.max(-F8::ONE).min(F8::ONE).acos();
                Position { column: turn(d.x, d.y) * width, row: polar * F8::splat(1.0 / PI) * height }
            }
            Layout::Cube => {
                let Face { number, major, s, t } = face(d);
                let cell = |c: F8| (c / major + F8::ONE) * F8::HALF * width;
                let last = width - F8::splat(0.001);
                Position { column: cell(s), row: number * width + cell(t).min(last) }
            }
        }
    }

    /// The directions at positions.
    #[inline]
    pub fn direction(self, size: [usize; 2], at: Position) -> V8 {
        let [width, height] = size.map(|n| F8::splat(n as f32));
        match self {
            Layout::LatLong => {
                let (sin_theta, cos_theta) = sin_cos_turn(at.row / height * F8::HALF);
                let (sin_phi, cos_phi) = sin_cos_turn(at.column / width);
                V8::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
            }
            Layout::Cube => {
                let number = (at.row / width).floor();
                let s = at.column / width * F8::splat(2.0) - F8::ONE;
                let t = (at.row / width - number) * F8::splat(2.0) - F8::ONE;
                from_face(number, s, t).normalize()
            }
        }
    }

    /// Texels for a unit of solid angle about directions.
    #[inline]
    pub fn texels_per_solid_angle(self, size: [usize; 2], d: V8) -> F8 {
        let [width, height] = size.map(|n| F8::splat(n as f32));
        let across = (d.x * d.x + d.y * d.y).sqrt().max(F8::splat(1e-9));
        match self {
            Layout::LatLong => width * height * F8::splat(0.5 / (PI * PI)) / across,
            Layout::Cube => {
                let major = face(d).major;
                let half = width * F8::HALF;
                half * half / (major * major * major)
            }
        }
    }
}

#[inline]
fn face(d: V8) -> Face {
    let [x, y, z] = [d.x.abs(), d.y.abs(), d.z.abs()];
    let (on_x, on_y) = (x.cmp_ge(y) & x.cmp_ge(z), y.cmp_ge(z));
    let pick = |a: F8, b: F8, c: F8| on_x.blend(a, on_y.blend(b, c));
    let signed = |c: F8, positive: F8, negative: F8| c.cmp_gt(F8::ZERO).blend(positive, negative);
    let number = |c: F8, first: f32| signed(c, F8::splat(first), F8::splat(first + 1.0));
    Face {
        number: pick(number(d.x, 0.0), number(d.y, 2.0), number(d.z, 4.0)),
        major: pick(x, y, z),
        s: pick(signed(d.x, -d.z, d.z), d.x, signed(d.z, d.x, -d.x)),
        t: pick(-d.y, signed(d.y, d.z, -d.z), -d.y),
    }
}

#[inline]
fn from_face(number: F8, s: F8, t: F8) -> V8 {
    let on = |n: f32| number.cmp_lt(F8::splat(n + 0.5));
    let faces = [
        V8::new(F8::ONE, -t, -s),
        V8::new(-F8::ONE, -t, s),
        V8::new(s, F8::ONE, t),
        V8::new(s, -F8::ONE, -t),
        V8::new(s, -t, F8::ONE),
    ];
    let last = V8::new(-s, -t, -f32x8::ONE);
    (0..5).rev().fold(last, |chosen, i| faces[i].or(on(i as f32), chosen))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZES: [(Layout, [usize; 2]); 2] = [(Layout::LatLong, [32, 16]), (Layout::Cube, [8, 48])];

    fn lanes(of: impl Fn(usize) -> f32) -> F8 {
        F8::new(std::array::from_fn(of))
    }

    #[test]
    fn directions_come_back_to_where_they_were() {
        for (layout, size) in SIZES {
            for row in 0..size[1] {
                let at = Position { column: lanes(|i| i as f32 + 0.3), row: F8::splat(row as f32 + 0.6) };
                let d = layout.direction(size, at);
                let back = layout.position(size, d);
                for i in 0..8 {
                    let (x, y) = (i as f32 + 0.3, row as f32 + 0.6);
                    let (column, row) = (back.column.as_array_ref()[i], back.row.as_array_ref()[i]);
                    assert!((column - x).abs() < 1e-3 && (row - y).abs() < 1e-3, "{layout:?} {x} {y}: {column} {row}");
                }
            }
        }
    }

    #[test]
    fn texels_for_solid_angle_add_up_to_the_sphere() {
        for (layout, size) in SIZES {
            const FINE: usize = 32;
            let mut solid_angle = 0.0;
            for (row, column) in (0..size[1] * FINE).flat_map(|y| (0..size[0] * FINE / 8).map(move |x| (y, 8 * x))) {
                let fine = |i: usize| (i as f32 + 0.5) / FINE as f32;
                let at = Position { column: lanes(|i| fine(column + i)), row: F8::splat(fine(row)) };
                let texels = layout.texels_per_solid_angle(size, layout.direction(size, at));
                solid_angle +=
                    texels.as_array_ref().iter().map(|t| 1.0 / f64::from(*t)).sum::<f64>() / (FINE * FINE) as f64;
            }
            let whole = 4.0 * std::f64::consts::PI;
            assert!((solid_angle / whole - 1.0).abs() < 2e-3, "{layout:?}: {solid_angle}");
        }
    }
}
