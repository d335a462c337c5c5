//! A convex polygon in the square, cut by lines: how texels and cells are intersected exactly.

/// Enough for a triangle or square cut by the two borders of a row and of a column and by a face of a cube.
const CAPACITY: usize = 16;

/// A line `c0 + c1 x + c2 y = 0`; its positive side is where the sum is positive.
pub type Line = [f64; 3];

/// A convex polygon.
#[derive(Clone, Copy)]
pub struct Polygon {
    vertices: [[f64; 2]; CAPACITY],
    len: usize,
}

impl Polygon {
    /// No vertex.
    pub const EMPTY: Polygon = Polygon { vertices: [[0.0; 2]; CAPACITY], len: 0 };

    /// A polygon with the given vertices, in order.
    pub fn new(vertices: &[[f64; 2]]) -> Polygon {
        let mut polygon = Polygon::EMPTY;
        for &vertex in vertices {
            polygon.push(vertex);
        }
        polygon
    }

    /// The axis-aligned rectangle [x0, x1] x [y0, y1].
    pub fn rectangle(x: [f64; 2], y: [f64; 2]) -> Polygon {
        Polygon::new(&[[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]])
    }

    fn push(&mut self, vertex: [f64; 2]) {
        if let Some(slot) = self.vertices.get_mut(self.len) {
            *slot = vertex;
            self.len += 1;
        }
    }

    /// The vertices, in order.
    pub fn vertices(&self) -> &[[f64; 2]] {
        self.vertices.get(..self.len).unwrap_or(&[])
    }

    /// Whether nothing is left.
    pub fn is_empty(&self) -> bool {
        self.len < 3
    }

    /// The area.
    pub fn area(&self) -> f64 {
        let Some((first, rest)) = self.vertices().split_first() else {
            return 0.0;
        };
        let twice: f64 = rest
            .iter()
            .zip(rest.iter().skip(1))
            .map(|(a, b)| (a[0] - first[0]) * (b[1] - first[1]) - (b[0] - first[0]) * (a[1] - first[1]))
            .sum();
        0.5 * twice.abs()
    }

    /// Cuts along a line, into polygons whose vertices are forgotten: many cuts cost less without new ones. An empty part has less than
    /// three vertices.
    pub fn split_into(&self, line: Line, negative: &mut Polygon, positive: &mut Polygon) {
        (negative.len, positive.len) = (0, 0);
        let side = |v: &[f64; 2]| line[0] + line[1] * v[0] + line[2] * v[1];
        let Some(last) = self.vertices().last() else { return };
        let (mut a, mut side_a) = (*last, side(last));
        let (mut any_negative, mut any_positive) = (false, false);
        for &b in self.vertices() {
            let side_b = side(&b);
            if (side_a < 0.0 && side_b > 0.0) || (side_a > 0.0 && side_b < 0.0) {
                let t = side_a / (side_a - side_b);
                let cut = [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
                negative.push(cut);
                positive.push(cut);
            }
            if side_b <= 0.0 {
                negative.push(b);
            }
            if side_b >= 0.0 {
                positive.push(b);
            }
            any_negative |= side_b < 0.0;
            any_positive |= side_b > 0.0;
            (a, side_a) = (b, side_b);
        }
        if !any_negative {
            negative.len = 0;
        }
        if !any_positive {
            positive.len = 0;
        }
    }

    /// The smallest and the largest value of a function over the vertices.
    pub fn range(&self, f: impl Fn(&[f64; 2]) -> f64) -> [f64; 2] {
        self.vertices().iter().map(f).fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
            [if v < low { v } else { low }, if v > high { v } else { high }]
        })
    }
}
