//! How clients look a map up, in f64, and how they turn directions into places: written from the definitions of the layouts.

pub use crate::support::vector::{V3, single, unit};
use std::f64::consts::{PI, TAU};
use wis::light::chart::Layout;
use wis::light::plan::{Description, Filter};

/// A map of luminances.
#[derive(Clone)]
pub struct Map {
    pub layout: Layout,
    pub width: u32,
    pub height: u32,
    pub texels: Vec<f32>,
}

impl Map {
    pub fn new(layout: Layout, width: u32, height: u32, mut of: impl FnMut(u32, u32) -> f32) -> Map {
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| of(x, y)).collect();
        Map { layout, width, height, texels }
    }

    pub fn latlong(width: u32, height: u32, of: impl FnMut(u32, u32) -> f32) -> Map {
        Map::new(Layout::LatLong, width, height, of)
    }

    /// A map whose texels are a function of the direction of their centres.
    pub fn of_directions(layout: Layout, width: u32, height: u32, of: impl Fn(V3) -> f64) -> Map {
        let side = height / faces(layout);
        Map::new(layout, width, height, |x, y| {
            let place = [(f64::from(x) + 0.5) / f64::from(width), (f64::from(y % side) + 0.5) / f64::from(side)];
            of(direction(layout, y / side, place)) as f32
        })
    }

    pub fn description(&self, filter: Filter) -> Description {
        Description {
            layout: self.layout,
            width: self.width,
            height: self.height,
            filter,
            rows_at_poles: false,
            exact_zero: false,
            compensated: false,
            light_only: false,
            rays_only: false,
            budget: 0.0,
        }
    }

    fn side(&self) -> i64 {
        i64::from(self.height / faces(self.layout))
    }

    fn inside(&self, face: u32, x: i64, y: i64) -> f64 {
        f64::from(self.texels[((i64::from(face) * self.side() + y) * i64::from(self.width) + x) as usize])
    }

    /// A texel at most one beyond the border of a face.
    fn texel(&self, face: u32, x: i64, y: i64) -> f64 {
        let (w, h) = (i64::from(self.width), self.side());
        let (in_x, in_y) = ((0..w).contains(&x), (0..h).contains(&y));
        match self.layout {
            _ if in_x && in_y => self.inside(face, x, y),
            Layout::LatLong if in_y => self.inside(0, x.rem_euclid(w), y),
            Layout::LatLong => {
                // Half a turn on; between two texels if their number is odd.
                let row = y.clamp(0, h - 1);
                let over = |x: i64| self.inside(0, x.rem_euclid(w), row);
                0.5 * (over(x + w / 2) + over(x + (w + 1) / 2))
            }
            Layout::Octahedral if in_x => self.inside(0, w - 1 - x, y.clamp(0, h - 1)),
            Layout::Octahedral if in_y => self.inside(0, x.clamp(0, w - 1), h - 1 - y),
            Layout::Octahedral => self.inside(0, (w - 1 - x).clamp(0, w - 1), (h - 1 - y).clamp(0, h - 1)),
            Layout::Cube if in_x || in_y => {
                // Just beyond the edge lies the neighbour's outermost texel.
                const BEYOND: f64 = 1.0 + 1e-9;
                let place = |k: i64| ((2.0 * k as f64 + 1.0) / w as f64 - 1.0).clamp(-BEYOND, BEYOND);
                let (other, at) = place_of(Layout::Cube, cube_direction(face, place(x), place(y)));
                let texel = |t: f64| ((t * w as f64) as i64).clamp(0, w - 1);
                self.inside(other, texel(at[0]), texel(at[1]))
            }
            Layout::Cube => {
                let (a, b) = (x.clamp(0, w - 1), y.clamp(0, w - 1));
                (self.inside(face, a, b) + self.texel(face, a, y) + self.texel(face, x, b)) / 3.0
            }
        }
    }

    /// The radiance at a place of a face in [0, 1]^2. `least`: no texel is darker.
    fn at(&self, filter: Filter, rows_at_poles: bool, least: f64, face: u32, place: [f64; 2]) -> f64 {
        let (w, h) = (f64::from(self.width), self.side() as f64);
        let texel = |x: i64, y: i64| self.texel(face, x, y).max(least);
        if filter == Filter::Nearest {
            let rows = if rows_at_poles { place[1] * (h - 1.0) + 0.5 } else { place[1] * h };
            return texel(((place[0] * w) as i64).min(w as i64 - 1), (rows as i64).min(h as i64 - 1));
        }
        let x = place[0] * w - 0.5;
        let y = if rows_at_poles { place[1] * (h - 1.0) } else { place[1] * h - 0.5 };
        let (column, row) = (x.floor(), y.floor());
        let (s, t) = (x - column, y - row);
        let (column, row) = (column as i64, row as i64);
        let line = |row: i64| texel(column, row) * (1.0 - s) + texel(column + 1, row) * s;
        if t == 0.0 { line(row) } else { line(row) * (1.0 - t) + line(row + 1) * t }
    }

    /// The radiance that a client finds in a direction of map space.
    pub fn radiance(&self, of: &Description, least: f64, direction: V3) -> f64 {
        let (face, place) = place_of(self.layout, direction);
        self.at(of.filter, of.rows_at_poles && self.height > 1, least, face, place)
    }

    /// The directions to corners, edges and half-texel shifts of a texel.
    pub fn around(&self, face: u32, x: u32, y: u32) -> Vec<V3> {
        let (w, h) = (f64::from(self.width), self.side() as f64);
        let shifts = [-1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0];
        let mut all = Vec::new();
        for dy in shifts {
            for dx in shifts {
                let place = [(f64::from(x) + dx) / w, (f64::from(y) + dy) / h];
                if self.layout == Layout::LatLong {
                    if (0.0..=1.0).contains(&place[1]) {
                        all.push(direction(self.layout, face, place));
                    }
                } else if place.iter().all(|p| (0.0..=1.0).contains(p)) {
                    all.push(direction(self.layout, face, place));
                }
            }
        }
        all
    }
}

pub fn faces(layout: Layout) -> u32 {
    if layout == Layout::Cube { 6 } else { 1 }
}

/// The direction of a place of a face in [0, 1]^2.
pub fn direction(layout: Layout, face: u32, [u, v]: [f64; 2]) -> V3 {
    match layout {
        Layout::LatLong => {
            let (theta, phi) = (PI * v, TAU * u);
            [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()]
        }
        Layout::Cube => unit(cube_direction(face, 2.0 * u - 1.0, 2.0 * v - 1.0)),
        Layout::Octahedral => crate::support::sphere::direction_f64([u, v]),
    }
}

/// The face and the place in [0, 1]^2 of a direction.
pub fn place_of(layout: Layout, d: V3) -> (u32, [f64; 2]) {
    let [x, y, z] = d;
    match layout {
        Layout::LatLong => {
            let phi = y.atan2(x);
            let around = if phi < 0.0 { phi + TAU } else { phi };
            (0, [(around / TAU).min(1.0 - 1e-16), x.hypot(y).atan2(z) / PI])
        }
        Layout::Cube => {
            let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
            let (face, s, t) = if ax >= ay && ax >= az {
                if x > 0.0 { (0, -z / ax, -y / ax) } else { (1, z / ax, -y / ax) }
            } else if ay >= az {
                if y > 0.0 { (2, x / ay, z / ay) } else { (3, x / ay, -z / ay) }
            } else if z > 0.0 {
                (4, x / az, -y / az)
            } else {
                (5, -x / az, -y / az)
            };
            (face, [0.5 + 0.5 * s, 0.5 + 0.5 * t])
        }
        Layout::Octahedral => {
            // Equal-area: the radius of a pole's diamond is the chord, the angle is linear along its side.
            let radius = x.hypot(y) / (1.0 + z.abs()).sqrt();
            let angle = y.abs().atan2(x.abs()) / (0.5 * PI);
            let (along_x, along_y) = (radius * (1.0 - angle), radius * angle);
            let (p, q) = if z < 0.0 { (1.0 - along_y, 1.0 - along_x) } else { (along_x, along_y) };
            (0, [0.5 + 0.5 * p.copysign(x), 0.5 + 0.5 * q.copysign(y)])
        }
    }
}

fn cube_direction(face: u32, s: f64, t: f64) -> V3 {
    match face {
        0 => [1.0, -t, -s],
        1 => [-1.0, -t, s],
        2 => [s, 1.0, t],
        3 => [s, -1.0, -t],
        4 => [s, -t, 1.0],
        _ => [-s, -t, -1.0],
    }
}

pub fn double(v: [f32; 3]) -> V3 {
    v.map(f64::from)
}
