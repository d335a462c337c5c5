//! The integral of an input map over a cell of the octahedral square.
//!
//! The octahedral map has constant Jacobian, so solid angles are areas in the square. In one octant a parallel of
//! the lat-long layout is a diagonal line `a + b = r` and a meridian a ray `b / (a + b) = t`: texels are straight-
//! edged, and cutting the cell along their edges gives the integral exactly, not only to a tolerance. Texels of an
//! octahedral map are squares. Texels of a cube map have curved edges there: a cell is cut along chords, and
//! subdivided until the extrapolated error is below 1e-5 of its energy.

use super::polygon::{Line, Polygon};
use crate::light::pixels::{Layout, Pixels};
use crate::sphere::{cube, cube_direction, direction_f64};
use core::f64::consts::{PI, SQRT_2};

/// Texels, as a function of column and row.
pub trait Texels<const N: usize> {
    /// The N channels of a texel; (0, 0) outside the map.
    fn texel(&self, x: u32, y: u32) -> [f64; N];
}

/// The average of the map over cell `(i, j)` of `cells` x `cells` (a power of two, at least 2).
pub fn cell_average<const N: usize>(pixels: &Pixels, texels: &impl Texels<N>, cells: u32, i: u32, j: u32) -> [f64; N] {
    let [x, y] = [i, j].map(|i| range(i, cells));
    let sum = match pixels.layout {
        Layout::Cube => cube_whole(pixels, texels, x, y),
        _ => rectangle(pixels, texels, x, y).value,
    };
    average(sum, cells)
}

/// What is known of a cell: of a cube map only roughly, to tell how much the map varies there.
#[derive(Clone, Copy)]
pub struct Moments {
    /// The averages of the two channels.
    pub average: [f64; 2],
    /// The largest value of the first channel.
    pub largest: f64,
}

/// The averages over a cell of two channels, and the largest value.
pub fn cell_moments(pixels: &Pixels, texels: &impl Texels<2>, cells: u32, i: u32, j: u32) -> Moments {
    let sum = rectangle(pixels, texels, range(i, cells), range(j, cells));
    Moments { average: average(sum.value, cells), largest: sum.largest }
}

/// The bounds of a cell along an axis.
fn range(i: u32, cells: u32) -> [f64; 2] {
    [i, i + 1].map(|i| f64::from(i) / f64::from(cells))
}

/// An integral over a cell as an average.
fn average<const N: usize>(sum: [f64; N], cells: u32) -> [f64; N] {
    let width = 1.0 / f64::from(cells);
    sum.map(|s| s / (width * width))
}

/// A running integral: area times value, channel by channel.
struct Sum<const N: usize> {
    value: [f64; N],
    /// The largest value of the first channel.
    largest: f64,
}

impl<const N: usize> Sum<N> {
    fn new() -> Self {
        Sum { value: [0.0; N], largest: 0.0 }
    }

    /// Adds a piece; a piece that is there never has area 0, so that no lit texel is lost to rounding.
    fn add(&mut self, piece: &Polygon, texel: [f64; N]) {
        const LEAST_AREA: f64 = 1e-24;
        let area = piece.area().max(LEAST_AREA);
        self.largest = texel.first().map_or(self.largest, |&value| value.max(self.largest));
        for (sum, value) in self.value.iter_mut().zip(texel) {
            *sum += area * value;
        }
    }
}

/// The integral over a rectangle; of a cube map, with edges of texels as chords.
fn rectangle<const N: usize>(pixels: &Pixels, texels: &impl Texels<N>, x: [f64; 2], y: [f64; 2]) -> Sum<N> {
    let mut sum = Sum::new();
    match pixels.layout {
        Layout::LatLong => latlong_cell(pixels, texels, x, y, &mut sum),
        Layout::Octahedral => octahedral_cell(pixels, texels, x, y, &mut sum),
        Layout::Cube => cube_chords(pixels, texels, x, y, &mut sum),
    }
    sum
}

/// The integral of a cube map, with edges of texels as chords.
#[inline(never)]
fn cube_chords<const N: usize>(pixels: &Pixels, texels: &impl Texels<N>, x: [f64; 2], y: [f64; 2], sum: &mut Sum<N>) {
    let mut room = NO_POLYGONS;
    cube_rectangle(pixels, texels, Corner::of(x, y), (&mut room, sum));
}

/// The integral over a cell that lies in one quadrant: its part north and its part south of the equator.
#[inline(never)]
fn latlong_cell<const N: usize>(pixels: &Pixels, texels: &impl Texels<N>, x: [f64; 2], y: [f64; 2], sum: &mut Sum<N>) {
    // Distances from the centre lines, in [0, 1].
    let fold = |s: [f64; 2]| if s[0] >= 0.5 { s.map(|s| 2.0 * s - 1.0) } else { [1.0 - 2.0 * s[1], 1.0 - 2.0 * s[0]] };
    let (a, b) = (fold(x), fold(y));
    let octant = |south| Octant { pixels, positive: [x[0] >= 0.5, y[0] >= 0.5], south };
    let mirror = |s: [f64; 2]| [1.0 - s[1], 1.0 - s[0]];
    let mut room = [Polygon::EMPTY; 4];
    for (south, whole) in [(false, Polygon::rectangle(a, b)), (true, Polygon::rectangle(mirror(b), mirror(a)))] {
        let [part, beyond, ..] = &mut room;
        whole.split_into([-1.0, 1.0, 1.0], part, beyond);
        octant(south).integrate(texels, &mut room, sum);
    }
    sum.value = sum.value.map(|v| 0.25 * v);
}

/// One octant of a lat-long map, in the coordinates (a, b): radius r = a + b <= 1 from the pole, azimuth
/// t = b / r of a quarter turn.
struct Octant<'a> {
    pixels: &'a Pixels,
    positive: [bool; 2],
    south: bool,
}

impl Octant<'_> {
    /// The radius of the border between rows k - 1 and k, counted from the pole.
    fn radius(&self, k: u32) -> f64 {
        SQRT_2 * libm::sin(0.5 * PI * f64::from(k) / f64::from(self.pixels.height))
    }

    /// Adds a polygon, the first of `room`, row by row.
    fn integrate<const N: usize>(&self, texels: &impl Texels<N>, room: &mut [Polygon; 4], sum: &mut Sum<N>) {
        let [mut rest, mut beyond, strip, spare] = room.each_mut();
        if rest.is_empty() {
            return;
        }
        let [nearest, farthest] = rest.range(|v| v[0] + v[1]);
        let height = f64::from(self.pixels.height);
        let start = libm::floor(libm::asin((nearest / SQRT_2).min(1.0)) * 2.0 / PI * height - 1e-6).max(0.0);
        for k in start as u32..self.pixels.height {
            let end = self.radius(k + 1);
            rest.split_into([-end, 1.0, 1.0], strip, beyond);
            if !strip.is_empty() {
                let y = if self.south { self.pixels.height - 1 - k } else { k };
                // What is left of the polygon has been cut into strip and beyond: its room is free.
                self.integrate_row(texels, [&mut *strip, &mut *rest, &mut *spare], y, sum);
            }
            if beyond.is_empty() || end > farthest {
                break;
            }
            core::mem::swap(&mut rest, &mut beyond);
        }
    }

    /// Adds a strip of one row, the first of three polygons, column by column in the order of t.
    fn integrate_row<const N: usize>(
        &self,
        texels: &impl Texels<N>,
        [mut rest, mut beyond, piece]: [&mut Polygon; 3],
        y: u32,
        sum: &mut Sum<N>,
    ) {
        let width = f64::from(self.pixels.width);
        let (start, step) = match self.positive {
            [true, true] => (0.0, 0.25 * width),
            [false, true] => (0.5 * width, -0.25 * width),
            [false, false] => (0.5 * width, 0.25 * width),
            [true, false] => (width, -0.25 * width),
        };
        let turns = |v: &[f64; 2]| if v[0] + v[1] > 1e-12 { v[1] / (v[0] + v[1]) } else { 0.5 };
        let [low, high] = rest.range(turns);
        let mut column = libm::floor(start + step * low);
        loop {
            let border = if step > 0.0 { column + 1.0 } else { column };
            let t = (border - start) / step;
            let x = column.max(0.0).min(width - 1.0) as u32;
            rest.split_into([0.0, -t, 1.0 - t], piece, beyond);
            if !piece.is_empty() {
                sum.add(piece, texels.texel(x, y));
            }
            column += if step > 0.0 { 1.0 } else { -1.0 };
            if beyond.is_empty() || t >= high || !(-1.0..=width).contains(&column) {
                break;
            }
            core::mem::swap(&mut rest, &mut beyond);
        }
    }
}

/// The integral of an octahedral map over a rectangle: rectangles all the way.
#[inline(never)]
fn octahedral_cell<const N: usize>(
    pixels: &Pixels,
    texels: &impl Texels<N>,
    x: [f64; 2],
    y: [f64; 2],
    sum: &mut Sum<N>,
) {
    let texel_size = 1.0 / f64::from(pixels.width);
    let first = |s: f64| libm::floor(s / texel_size) as u32;
    for row in first(y[0])..pixels.height {
        let v = overlap(y, f64::from(row) * texel_size, f64::from(row + 1) * texel_size);
        if v[0] >= y[1] {
            break;
        }
        for column in first(x[0])..pixels.width {
            let u = overlap(x, f64::from(column) * texel_size, f64::from(column + 1) * texel_size);
            if u[0] >= x[1] {
                break;
            }
            if u[1] > u[0] && v[1] > v[0] {
                sum.add(&Polygon::rectangle(u, v), texels.texel(column, row));
            }
        }
    }
}

/// The part of a range between two bounds.
fn overlap(range: [f64; 2], low: f64, high: f64) -> [f64; 2] {
    [range[0].max(low), range[1].min(high)]
}

/// Cells of a cube map are subdivided at most this often: an error of 4^-8 of a texel edge's chord.
const CUBE_SUBDIVISIONS: u32 = 4;

/// Where polygons are cut.
type Room = [Polygon; 5];
const NO_POLYGONS: Room = [Polygon::EMPTY; 5];

/// The integral of a cube map over a cell.
#[inline(never)]
fn cube_whole<const N: usize>(pixels: &Pixels, texels: &impl Texels<N>, x: [f64; 2], y: [f64; 2]) -> [f64; N] {
    let mut room = NO_POLYGONS;
    cube_cell(pixels, texels, x, y, (&mut room, 0))
}

/// The integral of a cube map over a rectangle of the square.
///
/// Chords make an error that falls fourfold with each halving of the edges, so one halving tells the error, and
/// extrapolating it leaves about a sixteenth.
#[inline(never)]
fn cube_cell<const N: usize>(
    pixels: &Pixels,
    texels: &impl Texels<N>,
    x: [f64; 2],
    y: [f64; 2],
    (room, subdivisions): (&mut Room, u32),
) -> [f64; N] {
    if let Some(sum) = cube_estimate(pixels, texels, x, y, (&mut *room, subdivisions)) {
        return sum;
    }
    let (mx, my) = (0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1]));
    let mut sum = [0.0; N];
    for quarter in 0..4 {
        let qx = if quarter < 2 { [x[0], mx] } else { [mx, x[1]] };
        let qy = if quarter % 2 == 0 { [y[0], my] } else { [my, y[1]] };
        sum = add(sum, cube_cell(pixels, texels, qx, qy, (&mut *room, subdivisions + 1)));
    }
    sum
}

/// The integral from one halving of the edges; `None` if it has to be subdivided. Apart from the recursion, which is short on stack.
#[inline(never)]
fn cube_estimate<const N: usize>(
    pixels: &Pixels,
    texels: &impl Texels<N>,
    x: [f64; 2],
    y: [f64; 2],
    (room, subdivisions): (&mut Room, u32),
) -> Option<[f64; N]> {
    let (mx, my) = (0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1]));
    // Directions cost most, and corners are shared.
    let [a, b, c] = [x[0], mx, x[1]].map(|x| [y[0], my, y[1]].map(|y| Corner::at([x, y])));
    let mut over = |corners: [Corner; 4]| {
        let mut sum = Sum::new();
        cube_rectangle(pixels, texels, corners, (&mut *room, &mut sum));
        sum.value
    };
    let coarse = over([a[0], a[2], c[0], c[2]]);
    let mut fine = [0.0; N];
    for (near, far) in [(&a, &b), (&b, &c)] {
        for k in 0..2 {
            fine = add(fine, over([near[k], near[k + 1], far[k], far[k + 1]]));
        }
    }
    let close = |(coarse, fine): (&f64, &f64)| (fine - coarse).abs() <= 1.5e-4 * fine;
    if coarse.iter().zip(&fine).all(close) {
        let extrapolate = |(coarse, fine): (f64, f64)| (fine + (fine - coarse) / 3.0).max(0.5 * fine);
        let mut result = fine;
        for (out, pair) in result.iter_mut().zip(coarse.into_iter().zip(fine)) {
            *out = extrapolate(pair);
        }
        return Some(result);
    }
    if subdivisions >= CUBE_SUBDIVISIONS { Some(fine) } else { None }
}

fn add<const N: usize>(mut a: [f64; N], b: [f64; N]) -> [f64; N] {
    for (a, b) in a.iter_mut().zip(b) {
        *a += b;
    }
    a
}

/// The integral over a rectangle as that over two triangles, in each of which the direction is taken as linear.
fn cube_rectangle<const N: usize>(
    pixels: &Pixels,
    texels: &impl Texels<N>,
    [p00, p01, p10, p11]: [Corner; 4],
    (room, sum): (&mut Room, &mut Sum<N>),
) {
    // The diagonal of the square through the quadrant is where its derivative jumps (the equator).
    let [x, y] = p00.place;
    if (x < 0.5) == (y < 0.5) {
        cube_triangle(pixels, texels, [p00, p10, p01], (&mut *room, &mut *sum));
        cube_triangle(pixels, texels, [p11, p01, p10], (&mut *room, &mut *sum));
    } else {
        cube_triangle(pixels, texels, [p01, p00, p11], (&mut *room, &mut *sum));
        cube_triangle(pixels, texels, [p10, p11, p00], (&mut *room, &mut *sum));
    }
}

/// A corner of a rectangle, and the direction there.
#[derive(Clone, Copy)]
struct Corner {
    place: [f64; 2],
    direction: [f64; 3],
}

impl Corner {
    fn at(place: [f64; 2]) -> Corner {
        Corner { place, direction: direction_f64(place) }
    }

    /// The corners of a rectangle, along y first.
    fn of(x: [f64; 2], y: [f64; 2]) -> [Corner; 4] {
        [[x[0], y[0]], [x[0], y[1]], [x[1], y[0]], [x[1], y[1]]].map(Corner::at)
    }
}

/// Adds a triangle of the square, face by face, row by row, column by column.
fn cube_triangle<const N: usize>(
    pixels: &Pixels,
    texels: &impl Texels<N>,
    corners: [Corner; 3],
    (room, sum): (&mut Room, &mut Sum<N>),
) {
    let plane = Linear::new(corners);
    let triangle = Polygon::new(&corners.map(|corner| corner.place));
    // Faces are convex: most triangles lie on one.
    let [first, others @ ..] = corners.map(|corner| cube(corner.direction).0);
    if others == [first; 2] {
        return cube_face(pixels, texels, first, &triangle, plane.face(first), (room, sum));
    }
    for face in 0..6 {
        let (s, t, major) = plane.face(face);
        let outside = [minus(major, s), plus(major, s), minus(major, t), plus(major, t)];
        if outside.iter().any(|&line| triangle.range(|v| at(line, v))[1] <= 0.0) {
            continue;
        }
        let (mut inside, [rest, beyond, ..]) = (triangle, room.each_mut());
        for line in outside {
            inside.split_into(line, rest, beyond);
            inside = *beyond;
        }
        if !inside.is_empty() {
            cube_face(pixels, texels, face, &inside, (s, t, major), (&mut *room, &mut *sum));
        }
    }
}

/// Adds a polygon that lies on one face.
fn cube_face<const N: usize>(
    pixels: &Pixels,
    texels: &impl Texels<N>,
    face: u32,
    polygon: &Polygon,
    (s, t, major): (Line, Line, Line),
    (room, sum): (&mut Room, &mut Sum<N>),
) {
    let n = pixels.width;
    let border = |k: u32| 2.0 * f64::from(k) / f64::from(n) - 1.0;
    // The first and the last texel along an axis that a polygon may touch.
    let touched = |line: Line, part: &Polygon| {
        let [low, high] = part.range(|v| at(line, v) / at(major, v)).map(|c| (c + 1.0) * 0.5 * f64::from(n));
        // Of what is not negative, the whole part is the floor.
        [low - 1e-9, high + 1e-9].map(|c| (c.max(0.0) as u32).min(n - 1))
    };
    let (rows, columns) = (touched(t, polygon), touched(s, polygon));
    if rows[0] == rows[1] && columns[0] == columns[1] {
        return sum.add(polygon, texels.texel(columns[0], face * n + rows[0]));
    }
    let [mut below, mut next, mut right, mut beyond, piece] = room.each_mut();
    *below = *polygon;
    for row in rows[0]..n {
        below.split_into(minus(t, scaled(major, border(row + 1))), right, next);
        if !right.is_empty() {
            for column in touched(s, right)[0]..n {
                right.split_into(minus(s, scaled(major, border(column + 1))), piece, beyond);
                if !piece.is_empty() {
                    sum.add(piece, texels.texel(column, face * n + row));
                }
                if beyond.is_empty() {
                    break;
                }
                core::mem::swap(&mut right, &mut beyond);
            }
        }
        if next.is_empty() {
            break;
        }
        core::mem::swap(&mut below, &mut next);
    }
}

fn at(line: Line, v: &[f64; 2]) -> f64 {
    line[0] + line[1] * v[0] + line[2] * v[1]
}

fn plus(a: Line, b: Line) -> Line {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn minus(a: Line, b: Line) -> Line {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn scaled(a: Line, by: f64) -> Line {
    a.map(|a| a * by)
}

/// The direction as a linear function over a triangle of the square, one line per coordinate.
struct Linear([Line; 3]);

impl Linear {
    fn new(corners: [Corner; 3]) -> Linear {
        let [dp, dq, dr] = corners.map(|corner| corner.direction);
        let [p, q, r] = corners.map(|corner| corner.place);
        let (e, f) = ([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
        let determinant = e[0] * f[1] - e[1] * f[0];
        let line = |dp: f64, dq: f64, dr: f64| {
            let (de, df) = (dq - dp, dr - dp);
            let cx = (de * f[1] - df * e[1]) / determinant;
            let cy = (df * e[0] - de * f[0]) / determinant;
            [dp - cx * p[0] - cy * p[1], cx, cy]
        };
        Linear([line(dp[0], dq[0], dr[0]), line(dp[1], dq[1], dr[1]), line(dp[2], dq[2], dr[2])])
    }

    /// The two coordinates and the axis of a face of the cube as linear functions.
    fn face(&self, face: u32) -> (Line, Line, Line) {
        let [x, y, z] = self.0;
        let negative = |l: Line| scaled(l, -1.0);
        match face {
            0 => (negative(z), negative(y), x),
            1 => (z, negative(y), negative(x)),
            2 => (x, z, y),
            3 => (x, negative(z), negative(y)),
            4 => (x, negative(y), z),
            _ => (negative(x), negative(y), negative(z)),
        }
    }
}

/// The texel that an index just outside its face, row or map means: azimuth wraps, rows mirror over the poles,
/// faces and octahedral edges join. `x` and `y` are at most one texel outside (for a cube, of the face).
pub fn neighbour(pixels: &Pixels, x: i64, y: i64, face: u32) -> [u32; 2] {
    let (w, h) = (i64::from(pixels.width), i64::from(pixels.height));
    let wrapped = match pixels.layout {
        Layout::LatLong => {
            let beyond = y < 0 || y >= h;
            let row = if y < 0 {
                -1 - y
            } else if y >= h {
                2 * h - 1 - y
            } else {
                y
            };
            let column = if beyond { x + w / 2 } else { x };
            [column.rem_euclid(w.max(1)), row]
        }
        Layout::Octahedral => {
            // Beyond an edge the square continues mirrored about the middle of that edge.
            let (x, y) = if x < 0 {
                (-1 - x, w - 1 - y)
            } else if x >= w {
                (2 * w - 1 - x, w - 1 - y)
            } else {
                (x, y)
            };
            if y < 0 {
                [w - 1 - x, -1 - y]
            } else if y >= w {
                [w - 1 - x, 2 * w - 1 - y]
            } else {
                [x, y]
            }
        }
        Layout::Cube => return cube_neighbour(pixels.width, x, y, face),
    };
    wrapped.map(|i| i.max(0) as u32)
}

/// The texel of a cube map below the centre of texel `(x, y)` of a face, which may lie beyond its edges.
fn cube_neighbour(n: u32, x: i64, y: i64, face: u32) -> [u32; 2] {
    let inside = |i: i64| (0..i64::from(n)).contains(&i);
    if inside(x) && inside(y) {
        return [x as u32, face * n + y as u32];
    }
    let centre = |i: i64| (2.0 * i as f64 + 1.0) / f64::from(n) - 1.0;
    let (face, uv) = cube(cube_direction(face, centre(x), centre(y)));
    let index = |u: f64| ((u * f64::from(n)).max(0.0) as u32).min(n - 1);
    [index(uv[0]), face * n + index(uv[1])]
}
