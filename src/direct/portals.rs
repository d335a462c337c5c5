//! Portals: rectangles that light comes through, as a source of candidates for rays.
//!
//! Directions are uniform in the solid angle of a rectangle (Urena, Fajardo and King 2013). In coordinates along its edges, with its plane
//! at the distance 1, the part of it from x = 0 on has the solid angle `g = asin(c b1) - asin(c b0)`, where `c = x / sqrt(1 + x^2)` and
//! `b = y / sqrt(1 + y^2)` at the two ends of y. Solved for x by the sine of g / 2 that also holds in f32 for small windows, where the
//! paper's differences of angles cancel. What does not depend on the candidate is computed in f64.

use super::group::Group;
use super::joint::{Points, Sequence, Set};
use crate::brdf::point::Point;
use crate::brdf::portal::{MAX_PORTALS, Portal};
use crate::brdf::vector::dot;
use crate::simd::{Apart, Compute, GROUP, Level, Num, Whole, compute, places};
use crate::sphere::Frame;
use crate::sphere::sin_cos_quarters;
use crate::status::Error;
use bytemuck::{Pod, Zeroable};
use core::f64::consts::PI;
use glam::{DVec3, Vec3};

/// The least solid angle of a portal, in steradians: f32 hardly tells directions inside a smaller one apart.
const LEAST: f64 = 1e-9;
/// The largest cosine of the angle between the edges of a rectangle.
const SQUARE: f64 = 1e-3;
/// Portals end here, in distances of their planes: what lies beyond is seen at a millionth of a radian.
const FAR: f64 = 1e6;

/// A portal as lanes read it, row by row.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
struct Rectangle {
    /// Along the edges and towards the plane, in map space. Behind them g at the first end of x in units of pi, (b1 - b0)^2 and 1 - b0 b1.
    axes: [[f32; 4]; 3],
    /// The ends of x and of y.
    ends: [f32; 4],
    /// (b1 + b0)^2 and 1 + b0 b1; the solid angle of the portals before, in units of pi; 0.
    rest: [f32; 4],
}

/// The solid angle between the axes and a point of the plane at the distance 1.
#[inline(never)]
fn part(x: f64, y: f64) -> f64 {
    libm::atan2(x * y, libm::sqrt(1.0 + x * x + y * y))
}

/// Rows of a [`Rectangle`].
const ROWS: u32 = 5;

impl Rectangle {
    /// A portal as a source, but for its share, and its solid angle: 0 if it is left out. `None` if it is no rectangle.
    fn new(portal: &Portal, frame: &Frame) -> Option<(Rectangle, f64)> {
        let [corner, a, b] = [portal.corner, portal.edges[0], portal.edges[1]].map(|v| Vec3::from_array(v).as_dvec3());
        let (width, height) = (libm::sqrt(a.length_squared()), libm::sqrt(b.length_squared()));
        if !(corner + a + b).is_finite() || a.dot(b).abs() > SQUARE * width * height {
            return None;
        }
        let normal = a.cross(b);
        let distance = -corner.dot(normal) / libm::sqrt(normal.length_squared());
        if !(distance > 0.0) {
            return Some((Rectangle::default(), 0.0));
        }
        let (x, y) = (a / width, b / height);
        let z = x.cross(y) * (-1.0);
        let end = |v: f64| (v / distance).clamp(-FAR, FAR);
        let (x0, y0) = (corner.dot(x), corner.dot(y));
        let ([x0, x1], [y0, y1]) = ([x0, x0 + width].map(end), [y0, y0 + height].map(end));
        let before = part(x0, y1) - part(x0, y0);
        let angle = part(x1, y1) - part(x1, y0) - before;
        let [b0, b1] = [y0, y1].map(|y| y / libm::sqrt(1.0 + y * y));
        let axis = |axis: DVec3, behind: f64| {
            let [x, y, z] = frame.to_map(axis.as_vec3().to_array());
            [x, y, z, behind as f32]
        };
        let axes = [axis(x, before / PI), axis(y, (b1 - b0) * (b1 - b0)), axis(z, 1.0 - b0 * b1)];
        let rest = [((b1 + b0) * (b1 + b0)) as f32, (1.0 + b0 * b1) as f32, 0.0, 0.0];
        let angle = if angle > LEAST { angle } else { 0.0 };
        Some((Rectangle { axes, ends: [x0, x1, y0, y1].map(|end| end as f32), rest }, angle))
    }

    /// A direction along one of its axes.
    #[inline(always)]
    fn along<F: Num>(&self, axis: usize, direction: [F; 3]) -> F {
        let [x, y, z, _] = self.axes[axis % 3];
        dot(direction, [x, y, z])
    }

    /// Where a direction goes through it.
    #[inline(always)]
    fn contains<F: Num>(&self, direction: [F; 3]) -> F::Mask {
        // Without closures: where they are not inlined, instructions of a level become calls.
        let [x, y, z] = [self.along(0, direction), self.along(1, direction), self.along(2, direction)];
        let [x0, x1, y0, y1] = self.ends;
        let (across, down) = (F::and((z * x0).le(x), x.le(z * x1)), F::and((z * y0).le(y), y.le(z * y1)));
        F::and(F::splat(0.0).lt(z), F::and(across, down))
    }
}

/// The portals of a point that are seen from there.
#[derive(Debug)]
pub struct Portals {
    rectangles: [Rectangle; MAX_PORTALS],
    count: usize,
    /// The sum of their solid angles in units of pi, and one over it in steradians.
    total: f32,
    inverse: f32,
    /// Whether directions outside all of them do not count.
    pub complete: bool,
}

impl Portals {
    /// Checks the portals of a point and prepares them in map space.
    ///
    /// # Errors
    /// Which of them is no rectangle.
    #[inline(never)]
    pub fn new(point: &Point<'_>, frame: &Frame) -> Result<Portals, Error> {
        let rectangles = [Rectangle::default(); MAX_PORTALS];
        let mut portals = Portals { rectangles, count: 0, total: 0.0, inverse: 0.0, complete: point.portals_complete };
        let (mut slots, mut total) = (portals.rectangles.iter_mut(), 0.0);
        for (number, portal) in point.portals.iter().take(MAX_PORTALS).enumerate() {
            let (rectangle, angle) = Rectangle::new(portal, frame).ok_or(Error::range(c"portals").in_row(number))?;
            if angle > 0.0 {
                let Some(slot) = slots.next() else { break };
                *slot = rectangle;
                slot.rest[2] = (total / PI) as f32;
                portals.count += 1;
                total += angle;
            }
        }
        (portals.total, portals.inverse) = ((total / PI) as f32, (1.0 / total) as f32);
        Ok(portals)
    }

    /// Whether none is seen.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Writes the directions of candidates in map space.
    #[inline(never)]
    pub fn enter(&self, at: Sequence, out: &mut [Group]) {
        compute(Level::BASELINE, Enter { portals: self, at, out });
    }

    /// The density of candidates at directions of map space; 0 outside.
    #[inline(always)]
    pub fn density<F: Num>(&self, direction: [F; 3]) -> F {
        F::apart(Density { portals: self, direction })
    }
}

struct Density<'a, F: Num> {
    portals: &'a Portals,
    direction: [F; 3],
}

impl<F: Num> Apart<F> for Density<'_, F> {
    type Output = F;

    /// Each portal is chosen by its solid angle, so that all have the same density, and overlapping ones add up.
    #[inline(always)]
    fn run(self) -> F {
        let mut density = F::splat(0.0);
        for rectangle in self.portals.rectangles.iter().take(self.portals.count) {
            density = density + F::only(rectangle.contains(self.direction), F::splat(self.portals.inverse));
        }
        density
    }
}

/// Draws the candidates of portals: at the width of any processor, since few calls have portals.
struct Enter<'a> {
    portals: &'a Portals,
    at: Sequence,
    /// A power of two of groups.
    out: &'a mut [Group],
}

impl Compute for Enter<'_> {
    type Output = ();

    #[inline(always)]
    fn run<F: Num>(self) {
        let Enter { portals, at, out } = self;
        let sets = Points::new::<F>(at).sets::<F>(GROUP * out.len());
        for (first, group) in (0..).step_by(GROUP).zip(out) {
            for place in places::<F>() {
                group.put_direction(place, portals.sample::<F>(sets.at(Set::Portals, first + place as u32)));
            }
        }
    }
}

impl Portals {
    /// Directions of map space for two numbers in (0, 1): the first one chooses the portal, too.
    #[inline(always)]
    fn sample<F: Num>(&self, [u, v]: [F; 2]) -> [F; 3] {
        let (one, tiny) = (F::splat(1.0), F::splat(f32::MIN_POSITIVE));
        let (mut index, u) = (F::splat(-1.0), u * self.total);
        for rectangle in self.rectangles.iter().take(self.count) {
            index = index + F::only(F::splat(rectangle.rest[2]).le(u), one);
        }
        let (first, table) = (index.to_whole() * F::Whole::splat(ROWS), bytemuck::cast_slice(&self.rectangles));
        let row = |row: u32| F::rows(table, first + F::Whole::splat(row));
        let [axis_x, axis_y, axis_z] = [row(0), row(1), row(2)];
        let ([x0, x1, y0, y1], [sum, above, before, _]) = (row(3), row(4));
        let part = axis_x[3] + (u - before);
        let (sine, cosine) = sin_cos_quarters(part.abs());
        // The same number twice: by the smaller of sine and cosine it does not cancel.
        let small = sine.min(cosine);
        let (squared, by_sine) = (small * small, sine.le(cosine));
        let (first, second) = (F::select(by_sine, axis_y[3], sum), F::select(by_sine, axis_z[3], above));
        let root = (first - squared * 4.0 * (second - squared)).max(tiny).sqrt();
        let x = (sine * cosine * 2.0 / root).copysign(part).max(x0).min(x1);
        // Along y, what is uniform is the sine of the angle over the plane of x and z.
        let beside = x * x + 1.0;
        let [h0, h1] = [y0, y1].map(|y| y / (beside + y * y).sqrt());
        let h = h0 + (h1 - h0) * v;
        let y = (h * beside.sqrt() / (one - h * h).max(tiny).sqrt()).max(y0).min(y1);
        let scale = one / (beside + y * y).sqrt();
        let along = |k: usize| (axis_x[k] * x + axis_y[k] * y + axis_z[k]) * scale;
        [along(0), along(1), along(2)]
    }
}
