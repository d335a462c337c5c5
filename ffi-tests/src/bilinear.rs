//! The look-up of a client that interpolates between texel centres: azimuth wraps, rows mirror over the poles, faces of a cube
//! join. In eight lanes for shading, and in double precision for the statistics of a light.

use crate::lanes::{F8, LANES};
use crate::layout::{Layout, Position};
use glam::DVec3;
use std::f64::consts::PI;

/// The texels of a map with one more on each side of every face.
#[derive(Clone, Debug)]
pub struct Bilinear {
    layout: Layout,
    /// Texels of the map, all faces.
    size: [usize; 2],
    /// Of a face.
    height: usize,
    padded: Vec<f32>,
}

impl Bilinear {
    /// For a lat-long or a cube map.
    pub fn new(layout: Layout, size: [usize; 2], luminance: &[f32]) -> Bilinear {
        let [width, all] = size;
        let height = if layout == Layout::Cube { width } else { all };
        let texel = |face: usize, x: usize, y: usize| luminance[(face * height + y) * width + x];
        let mut padded = Vec::with_capacity((width + 2) * (height + 2) * (all / height));
        for face in 0..all / height {
            for y in -1..=height as i64 {
                padded.extend((-1..=width as i64).map(|x| match layout {
                    Layout::Cube => on_cube(width, &texel, face, [x, y]),
                    _ => around([width, height], &|x, y| texel(0, x, y), [x, y]),
                }));
            }
        }
        Bilinear { layout, size, height, padded }
    }

    /// Between the texels about positions on the map.
    #[inline]
    pub fn at(&self, Position { column, row }: Position) -> F8 {
        let stride = self.size[0] + 2;
        let (mut corners, mut part) = ([[0.0; LANES]; 4], [[0.0; LANES]; 2]);
        let (columns, rows) = (column.to_array(), row.to_array());
        for i in 0..LANES {
            let (face, y) = self.face(rows[i]);
            let [x, y] = [columns[i] + 0.5, y + 0.5];
            let [left, top] = [(x as usize).min(self.size[0]), (y as usize).min(self.height)];
            (part[0][i], part[1][i]) = (x - left as f32, y - top as f32);
            let first = (face * (self.height + 2) + top) * stride + left;
            let above = &self.padded[first..first + stride + 2];
            for (corner, value) in corners.iter_mut().zip([above[0], above[1], above[stride], above[stride + 1]]) {
                corner[i] = value;
            }
        }
        let [a, b, c, d] = corners.map(F8::new);
        let [right, below] = part.map(F8::new);
        let (upper, lower) = (a + (b - a) * right, c + (d - c) * right);
        upper + (lower - upper) * below
    }

    #[inline]
    fn face(&self, row: f32) -> (usize, f32) {
        if self.layout != Layout::Cube {
            return (0, row);
        }
        let face = ((row / self.height as f32) as usize).min(5);
        (face, row - (face * self.height) as f32)
    }

    /// The same from a direction in the map's frame, in double precision.
    pub fn exact(&self, d: DVec3) -> f64 {
        let [column, row] = position(self.layout, self.size, d);
        let face = (row as usize / self.height).min(self.size[1] / self.height - 1);
        let [x, y] = [column + 0.5, row - (face * self.height) as f64 + 0.5];
        let [left, top] = [(x as usize).min(self.size[0]), (y as usize).min(self.height)];
        let texel = |i: usize, j: usize| {
            f64::from(self.padded[(face * (self.height + 2) + top + j) * (self.size[0] + 2) + left + i])
        };
        let (right, below) = (x - left as f64, y - top as f64);
        let row = |j: usize| texel(0, j) + (texel(1, j) - texel(0, j)) * right;
        row(0) + (row(1) - row(0)) * below
    }

    /// The mean over each texel: weights 1, 6, 1 along both axes.
    pub fn means(&self) -> Vec<f32> {
        let [width, all] = self.size;
        let stride = width + 2;
        let texel = |i: usize| {
            let (face, y, x) = (i / width / self.height, i / width % self.height, i % width);
            let row = |j: usize| {
                let first = (face * (self.height + 2) + y + j) * stride + x;
                0.125 * (self.padded[first] + 6.0 * self.padded[first + 1] + self.padded[first + 2])
            };
            0.125 * (row(0) + 6.0 * row(1) + row(2))
        };
        (0..width * all).map(texel).collect()
    }
}

/// A texel of a lat-long map at most one beyond its border.
fn around([width, height]: [usize; 2], texel: &impl Fn(usize, usize) -> f32, [x, y]: [i64; 2]) -> f32 {
    let at = |x: i64, y: i64| texel(x.rem_euclid(width as i64) as usize, y as usize);
    let inside = y.clamp(0, height as i64 - 1);
    if inside == y {
        return at(x, y);
    }
    // Over the pole: half a turn on, between two texels if their number is odd.
    0.5 * (at(x + width as i64 / 2, inside) + at(x + (width as i64 + 1) / 2, inside))
}

/// A texel of a cube map at most one beyond the border of its face; beyond a corner, where three faces meet, their mean.
fn on_cube(side: usize, texel: &impl Fn(usize, usize, usize) -> f32, face: usize, [x, y]: [i64; 2]) -> f32 {
    let inside = [x, y].map(|c| c.clamp(0, side as i64 - 1));
    match [x == inside[0], y == inside[1]] {
        [true, true] => texel(face, x as usize, y as usize),
        [false, false] => {
            let beside = [[x, inside[1]], [inside[0], y]].map(|at| on_cube(side, texel, face, at));
            (texel(face, inside[0] as usize, inside[1] as usize) + beside[0] + beside[1]) / 3.0
        }
        _ => {
            // The centre of the texel beyond the edge, with the neighbour folded into the plane.
            let plane = [x, y].map(|c| (2.0 * c as f64 + 1.0) / side as f64 - 1.0);
            let depth = 1.0 - plane.iter().map(|c| (c.abs() - 1.0).max(0.0)).sum::<f64>();
            let mut d = from_face(face, plane.map(|c| c.clamp(-1.0, 1.0)));
            d[face / 2] *= depth;
            let [column, row] = position(Layout::Cube, [side, 6 * side], d);
            let row = (row as usize).min(6 * side - 1);
            texel(row / side, (column as usize).min(side - 1), row % side)
        }
    }
}

/// Where a direction in the map's frame lies, in texels.
pub fn position(layout: Layout, size: [usize; 2], d: DVec3) -> [f64; 2] {
    let [width, height] = size.map(|n| n as f64);
    match layout {
        Layout::LatLong => {
            let azimuth = (d.y.atan2(d.x) / (2.0 * PI)).rem_euclid(1.0);
            [azimuth * width, d.x.hypot(d.y).atan2(d.z) / PI * height]
        }
        Layout::Cube => {
            let size = d.abs();
            let axis = if size.x >= size.y && size.x >= size.z {
                0
            } else if size.y >= size.z {
                1
            } else {
                2
            };
            let negative = d[axis] < 0.0;
            let sign = if negative { -1.0 } else { 1.0 };
            let [s, t] = [[-sign * d.z, -d.y], [d.x, sign * d.z], [sign * d.x, -d.y]][axis];
            let cell = |c: f64| (c / size[axis] + 1.0) * 0.5 * width;
            let last = width * (1.0 - f64::EPSILON);
            [cell(s), (2 * axis + usize::from(negative)) as f64 * width + cell(t).min(last)]
        }
    }
}

/// The direction at a position, and the steradians of a texel there.
pub fn direction(layout: Layout, size: [usize; 2], [column, row]: [f64; 2]) -> (DVec3, f64) {
    let [width, height] = size.map(|n| n as f64);
    match layout {
        Layout::LatLong => {
            let (phi, theta) = (column / width * 2.0 * PI, row / height * PI);
            let d = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            (d, 2.0 * PI * PI / (width * height) * theta.sin())
        }
        Layout::Cube => {
            let face = (row / width) as usize;
            let plane = [column, row - face as f64 * width].map(|c| c / width * 2.0 - 1.0);
            let d = from_face(face, plane);
            (d.normalize(), 4.0 / (width * width) / d.length().powi(3))
        }
    }
}

/// A point of a face of the cube of half-width 1.
fn from_face(face: usize, [s, t]: [f64; 2]) -> DVec3 {
    [
        DVec3::new(1.0, -t, -s),
        DVec3::new(-1.0, -t, s),
        DVec3::new(s, 1.0, t),
        DVec3::new(s, -1.0, -t),
        DVec3::new(s, -t, 1.0),
        DVec3::new(-s, -t, -1.0),
    ][face]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::V8;

    /// Both precisions agree, and at texel centres the look-up is the texel.
    #[test]
    fn lanes_agree_with_double_precision() {
        for (layout, size) in [(Layout::LatLong, [16, 8]), (Layout::Cube, [8, 48])] {
            let luminance: Vec<f32> = (0..size[0] * size[1]).map(|i| (i * 37 % 101) as f32 + 1.0).collect();
            let map = Bilinear::new(layout, size, &luminance);
            for (i, &texel) in luminance.iter().enumerate() {
                let centre = [(i % size[0]) as f64 + 0.5, (i / size[0]) as f64 + 0.5];
                assert!((map.exact(direction(layout, size, centre).0) - f64::from(texel)).abs() < 1e-6);
                let beside = |k: usize| [centre[0] + 0.1 * k as f64 - 0.45, centre[1] + 0.45 - 0.11 * k as f64];
                let d: [DVec3; LANES] = std::array::from_fn(|k| direction(layout, size, beside(k)).0);
                let axis = |c: usize| F8::new(d.map(|d| d[c] as f32));
                let lanes = map.at(layout.position(size, V8::new(axis(0), axis(1), axis(2)))).to_array();
                for (d, value) in d.into_iter().zip(lanes) {
                    assert!((map.exact(d) - f64::from(value)).abs() < 0.02, "{layout:?} {d} {value}");
                }
            }
        }
    }

    /// Across every border the look-up has no step.
    #[test]
    fn faces_join() {
        for (layout, size) in [(Layout::LatLong, [16, 8]), (Layout::Cube, [8, 48])] {
            let luminance: Vec<f32> = (0..size[0] * size[1]).map(|i| (i * 37 % 101) as f32 + 1.0).collect();
            let map = Bilinear::new(layout, size, &luminance);
            let mut last: Option<f64> = None;
            // A closed curve over all faces.
            for i in 0..=400_000 {
                let (a, b) = (2.0 * PI * f64::from(i) / 4e5, 10.0 * PI * f64::from(i) / 4e5);
                let d = DVec3::new(a.cos() * b.cos(), a.sin() * b.cos(), b.sin());
                let value = map.exact(d);
                // The faces of a cube are lines that meet with a kink, but for half a texel at its corners.
                let near_corner = layout == Layout::Cube && d.abs().min_element() > 0.45;
                if let Some(last) = last.filter(|_| !near_corner) {
                    assert!((value - last).abs() < 0.2, "{layout:?} {d}: {last} {value}");
                }
                last = Some(value);
            }
        }
    }
}
