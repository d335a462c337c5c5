//! A distribution over the texels of a lat-long map: exact where the light is, and found without a walk.
//!
//! What a product multiplies must be a tree; the compensated distribution is only ever sampled, so it keeps the texels
//! as they are: a row and a column by table, then a direction, uniform in the solid angle of the texel. The pdf of a
//! direction is a look-up of its texel. Sample and pdf agree to the bit, since both multiply the same two numbers.

use super::inverse::{self, Inverse, Span};
use crate::descent::{ONE_MINUS_EPSILON, Sample, Sampled, clamp};
use crate::numeric::{ContentHash, atan_turns, max, min, select, sin_cos_turns, sqrt};
use crate::sphere::{Frame, latlong_solid_angle, unit};
use crate::status::{Result, Status};
use core::f64::consts::PI;
use glam::Vec3;

/// Four numbers of a row, in this order.
///
/// `near`: 1 - |z| at the edge that is nearer to the pole of the row's hemisphere. `extent`: by how much 1 - |z| grows to
/// the other edge; negative in the southern hemisphere, whose rows begin at the edge that is farther from its pole.
/// `density`: the pdf in a texel whose column is one unit wide. `border`: points nearer than this to the left or right
/// border of a texel may come out in its neighbour.
pub type RowNumbers = [f32; 4];

/// Rounding moves a direction by less than this, radians.
const ROUNDING: f64 = 2e-6;

/// A distribution over the texels of a map.
#[derive(Clone, Copy, Debug)]
pub struct LatLong<'a> {
    /// The mean of the values over the sphere; 0 if there is nothing to sample.
    average: f32,
    pub(super) inverse: Inverse<'a>,
    pub(super) rows: &'a [RowNumbers],
}

/// A texel, by row and column.
type Texel = [u32; 2];

impl<'a> LatLong<'a> {
    /// A view of what [`fill`] wrote. Other numbers give meaningless directions, but never a panic.
    #[inline(always)]
    pub fn trusted(average: f32, inverse: Inverse<'a>, rows: &'a [RowNumbers]) -> Self {
        LatLong { average, inverse, rows }
    }

    /// Whether this is what [`fill`] writes.
    pub fn is_sound(&self) -> bool {
        let same = |(row, numbers): (u32, &RowNumbers)| {
            row_numbers(&self.inverse, row).map(f32::to_bits) == numbers.map(f32::to_bits)
        };
        let [rows, _] = self.inverse.size();
        self.inverse.is_sound() && self.rows.len() == rows as usize && (0..).zip(self.rows).all(same)
    }

    /// Adds every number to a hash.
    pub fn add_to(&self, hash: &mut ContentHash) {
        self.inverse.add_to(hash);
        self.rows.iter().for_each(|numbers| hash.add_floats(numbers));
    }

    /// Whether there is anything to sample.
    pub(super) fn is_positive(&self) -> bool {
        self.average > 0.0
    }

    /// Points nearer than this to the upper or lower border of a texel may come out in its neighbour.
    #[inline(always)]
    pub(super) fn border(&self) -> f32 {
        let [rows, _] = self.inverse.size();
        // The width of a row in 1 - |z| is at least half its angle times the sine at its edge.
        (2.0 * ROUNDING / PI) as f32 * inverse::number(rows)
    }

    #[inline(always)]
    fn row(&self, row: u32) -> RowNumbers {
        self.rows.get(row as usize).copied().unwrap_or_default()
    }

    /// The pdf in a column of a row.
    #[inline(always)]
    fn density(&self, row: u32, column: Span) -> f32 {
        self.row(row)[2] * inverse::number(column.width)
    }

    /// The direction of map space at a place inside a texel.
    #[inline(always)]
    fn direction(&self, [row, column]: Texel, [a, b]: [f32; 2]) -> Vec3 {
        let [near, extent, ..] = self.row(row);
        let south = extent < 0.0;
        let height = near + select(south, 1.0 - a, a) * extent.abs();
        let across = sqrt(max(height * (2.0 - height), 0.0));
        let z = select(south, height - 1.0, 1.0 - height);
        // Quarter turns.
        let [_, columns] = self.inverse.size();
        let turned = (inverse::number(column) + b) * (4.0 / inverse::number(columns));
        let passed = |quarter: f32| select(quarter <= turned, 1.0, 0.0);
        let rest = turned - (passed(1.0) + passed(2.0) + passed(3.0));
        let (minor, major) = sin_cos_turns(max(min(rest, 1.0 - rest), 0.0));
        let swapped = 0.5 < rest;
        let (cos, sin) = (select(swapped, minor, major), select(swapped, major, minor));
        let odd = (1.0..2.0).contains(&turned) || 3.0 <= turned;
        let (x, y) = (across * select(odd, sin, cos), across * select(odd, cos, sin));
        Vec3::new(select((1.0..3.0).contains(&turned), 0.0 - x, x), select(2.0 <= turned, 0.0 - y, y), z)
    }

    /// The texel of a direction of map space, and where inside it in rows and columns.
    #[inline(always)]
    fn texel(&self, d: Vec3) -> (Texel, [f32; 2]) {
        let [rows, columns] = self.inverse.size();
        let (ax, ay, az) = (d.x.abs(), d.y.abs(), d.z.abs());
        let polar = atan_turns(sqrt(ax * ax + ay * ay) / (1.0 + az));
        let down = select(d.z < 0.0, 1.0 - polar, polar) * inverse::number(rows);
        let eighth = atan_turns(min(ax, ay) / max(max(ax, ay), f32::MIN_POSITIVE));
        let quarter = select(ax < ay, 1.0 - eighth, eighth);
        let half = select(d.x < 0.0, 2.0 - quarter, quarter);
        let along = select(d.y < 0.0, 4.0 - half, half) * (inverse::number(columns) * 0.25);
        // Rounding may lead to the end.
        let texel = [(down as u32).min(rows.wrapping_sub(1)), (along as u32).min(columns.wrapping_sub(1))];
        (texel, [down, along])
    }

    /// Where in its texel a direction lies, both in [0, 1].
    fn inside(&self, texel: Texel, along: f32, d: Vec3) -> [f32; 2] {
        let [near, extent, ..] = self.row(texel[0]);
        let height = (d.x * d.x + d.y * d.y) / (1.0 + d.z.abs());
        // A row across the equator counts from the north.
        let height = if extent > 0.0 && d.z < 0.0 { 2.0 - height } else { height };
        let a = (height - near) / extent.abs();
        let down = if extent < 0.0 { 1.0 - a } else { a };
        [down, along - inverse::number(texel[1])].map(|c| min(max(c, 0.0), ONE_MINUS_EPSILON))
    }

    /// A sample that rounding may carry out of its texel: it then moves towards the centre, a little at first.
    #[inline(never)]
    pub(super) fn settle(&self, frame: &Frame, texel: Texel, inside: [f32; 2]) -> Sample {
        let (mut inside, mut step) = (inside, self.border());
        loop {
            let world = frame.to_world(self.direction(texel, inside));
            let back = unit(world.to_array()).map_or(texel, |world| self.texel(frame.to_map(world)).0);
            if back == texel || !(step <= 1.0) {
                let density = self.density(back[0], self.inverse.column(back[0], back[1]));
                return Sample { wi: world.to_array(), pdf: density };
            }
            inside = inside.map(|c| c + min(max(0.5 - c, -step), step));
            step *= 2.0;
        }
    }
}

/// Makes the distribution from the values of texels (row, column); returns their mean over the sphere.
pub fn fill(
    size: [u32; 2],
    (starts, guides, rows): (&mut [u32], &mut [u16], &mut [RowNumbers]),
    value: impl Fn([u32; 2]) -> f64,
) -> f64 {
    let share = |row: u32| latlong_solid_angle(size[1], size[0], row) / (4.0 * PI);
    let mean = Inverse::fill(size, starts, guides, |texel| value(texel) * share(texel[0]));
    let inverse = Inverse::trusted(size, starts, guides);
    for (row, numbers) in (0..).zip(rows) {
        *numbers = row_numbers(&inverse, row);
    }
    mean
}

/// The numbers of a row.
fn row_numbers(inverse: &Inverse, row: u32) -> RowNumbers {
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

impl Sampled for LatLong<'_> {
    #[inline]
    fn sample(&self, frame: &Frame, u: [f32; 2]) -> Sample {
        if !self.is_positive() {
            return Sample::default();
        }
        let positions = clamp(u).map(inverse::position);
        let row = self.inverse.find_row(positions[0]);
        let column = self.inverse.find_column(row.cell, positions[1]);
        let inside = [row.inside(positions[0]), column.inside(positions[1])];
        let [.., border] = self.row(row.cell);
        let near = |c: f32, border: f32| c < border || 1.0 - border < c;
        if near(inside[0], self.border()) || near(inside[1], border) {
            return self.settle(frame, [row.cell, column.cell], inside);
        }
        let world = frame.to_world(self.direction([row.cell, column.cell], inside));
        Sample { wi: world.to_array(), pdf: self.density(row.cell, column) }
    }

    #[inline]
    fn pdf(&self, frame: &Frame, wi: [f32; 3]) -> Result<f32> {
        let world = unit(wi).ok_or(Status::InvalidTransform)?;
        let ([row, column], _) = self.texel(frame.to_map(world));
        let pdf = self.density(row, self.inverse.column(row, column));
        Ok(if self.is_positive() { pdf } else { 0.0 })
    }

    fn invert(&self, frame: &Frame, wi: [f32; 3]) -> Result<[f32; 2]> {
        let map = frame.to_map(unit(wi).ok_or(Status::InvalidTransform)?);
        let (texel, [_, along]) = self.texel(map);
        let (row, column) = (self.inverse.row(texel[0]), self.inverse.column(texel[0], texel[1]));
        if !(self.is_positive() && self.density(texel[0], column) > 0.0) {
            return Err(Status::ZeroDensity);
        }
        let inside = self.inside(texel, along, map);
        Ok([row.undo(inside[0]), column.undo(inside[1])])
    }
}
