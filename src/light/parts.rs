//! Where the parts of a divided cell begin: borders between light that lies apart.
//!
//! A product holds F at the middle of each part. Of parts with equal shares of a cell's light, all would lie in a sun, and none in the sky
//! about it. So a cell's numbers (w, v) are cut where that leaves the least spread of directions, like a regression tree (Breiman et al.
//! 1984): into rows of parts first, then each row into its parts.

use super::chart::{Chart, Place};
use super::tables::Light;
use crate::numeric::{max, min};
use crate::points::sobol_in_order;
use crate::simd::{Four, GROUP, Num};
use bytemuck::{Pod, Zeroable, try_cast_slice_mut};
use glam::Vec3;

/// Parts of a cell along each axis.
pub const PARTS: usize = 4;
/// Parts of a cell.
pub const MIDDLES: usize = PARTS * PARTS;
/// Cuts that make so many parts.
const CUTS: usize = PARTS - 1;
/// The borders of the parts of a cell.
pub const BORDERS: usize = CUTS + PARTS * CUTS;

/// The borders of a cell's parts in its numbers (w, v): those between rows of parts, then those between the parts of each row.
pub type Borders = [f32; BORDERS];

/// Borders of equal parts.
pub const EVEN: Borders = [0.25, 0.5, 0.75, 0.25, 0.5, 0.75, 0.25, 0.5, 0.75, 0.25, 0.5, 0.75, 0.25, 0.5, 0.75];

/// Directions with equal shares of the light that show where it lies, and as many with equal areas. With 32 of each, variances of products of
/// GGX are 4 to 9 % higher (seven maps on `spot`). With 256 of each, that of GGX 0.05 is 7 % lower, and a build takes 7 ms more.
const EACH: usize = 64;
/// So many of each show whether a cell's light is even.
const FEW: usize = 16;
/// Light is even if it is nowhere more than so many times denser than elsewhere, but for what is too little for a part. Equal parts do there: others
/// change variances by less than 1 %.
const EVEN_WITHIN: f32 = 20.0;
/// Of the points, a (0,2)-sequence.
const SEED: u32 = 0;
/// No row of parts has less of a cell's numbers than this, and no part less of its row's: numbers have 24 bits.
const LEAST: f32 = 1.0 / 256.0;

/// Start and end of one of the four parts that borders make.
#[inline(always)]
pub fn range(borders: &[f32; CUTS], index: usize) -> [f32; 2] {
    let [a, b, c] = *borders;
    let ends = [0.0, a, b, c, 1.0];
    [ends[index % PARTS], ends[index % PARTS + 1]]
}

/// Whether all parts have a width.
pub(super) fn are_sound(borders: &Borders) -> bool {
    borders
        .chunks_exact(CUTS)
        .all(|of| of.first() > Some(&0.0) && of.is_sorted_by(|a, b| a < b) && of.last() < Some(&1.0))
}

/// The numbers (w, v) of the middle of a part.
pub(super) fn middle(borders: &Borders, part: usize) -> [f32; 2] {
    let (column, row) = (part % PARTS, part / PARTS);
    let of = |first: usize| borders.get(first..).and_then(|rest| rest.first_chunk()).unwrap_or(&[1.0; CUTS]);
    [range(of(CUTS + row * CUTS), column), range(of(0), row)].map(|[start, end]| 0.5 * (start + end))
}

/// A cell on its face.
pub(super) struct Area<'a> {
    light: &'a Light<'a>,
    cell: u32,
    face: Four,
    low: [f32; 2],
    size: [f32; 2],
}

/// Where pairs of a cell's numbers lead to.
#[derive(Clone, Copy)]
pub(super) struct Sampled {
    /// In the cell, [0, 1].
    pub position: [Four; 2],
    /// The same as a direction.
    pub direction: [Four; 3],
    /// The density within the cell, per steradian.
    pub density: Four,
}

// Functions of their own: each stands once in a library, and a build is not slower for it.
impl Area<'_> {
    pub(super) fn new<'a>(light: &'a Light<'a>, cell: u32) -> Area<'a> {
        let c = light.cell(cell);
        let edge = |k: usize, patch: u16| light.chart.axes[k].edge(f32::from(patch));
        let low = [0, 1].map(|k: usize| edge(k, c.origin[k]));
        let size = [0, 1].map(|k: usize| edge(k, c.origin[k] + c.patches[k]) - low[k]);
        Area { light, cell, face: Four::splat(f32::from(c.face)), low, size }
    }

    /// Where numbers (w, v) lead to.
    #[inline(never)]
    pub(super) fn sample(&self, numbers: [Four; 2]) -> Sampled {
        let drawn = self.light.sample_in::<Four>(Four::each_int(|_| self.cell), numbers);
        let place = drawn.place();
        let position = [0, 1].map(|k: usize| {
            let share = (place[k] - self.low[k]) / max(self.size[k], f32::MIN_POSITIVE);
            share.max(Four::splat(0.0)).min(Four::splat(1.0))
        });
        let direction = self.direction(position);
        let density = self.light.density_at(&self.place(direction), &drawn);
        Sampled { position, direction, density }
    }

    /// The numbers of positions, as far as rounding leaves them in the cell; 2 beyond.
    #[inline(never)]
    pub(super) fn find(&self, position: [Four; 2]) -> [Four; 2] {
        let located = self.light.locate::<Four>(self.direction(position), true);
        let mut numbers = located.numbers.map(Num::store);
        for (lane, &cell) in located.cell.iter().enumerate() {
            for of in &mut numbers {
                of[lane] = if cell == self.cell { of[lane] } else { 2.0 };
            }
        }
        numbers.map(Four::load)
    }

    /// The directions of positions in the cell.
    pub(super) fn direction(&self, position: [Four; 2]) -> [Four; 3] {
        let place = [0, 1].map(|k: usize| Four::splat(self.low[k]) + position[k] * self.size[k]);
        direction(&self.light.chart, self.face, place)
    }

    /// The density of directions with equal shares of the cell's area on its face, per steradian.
    pub(super) fn density_of_area(&self, direction: [Four; 3]) -> Four {
        Four::splat(1.0) / (self.place(direction).solid_angle * (self.size[0] * self.size[1]))
    }

    #[inline(never)]
    fn place(&self, direction: [Four; 3]) -> Place<Four> {
        self.light.chart.place(direction)
    }
}

/// The directions of positions on faces: in a function of its own, which cold code shares.
#[inline(never)]
pub(super) fn direction(chart: &Chart, face: Four, position: [Four; 2]) -> [Four; 3] {
    chart.direction(face, position)
}

/// The same of one position: lanes have the bits of single numbers.
pub(super) fn direction_of(chart: &Chart, face: f32, position: [f32; 2]) -> [f32; 3] {
    direction(chart, Four::splat(face), position.map(Four::splat)).map(|x| x.store()[0])
}

/// A direction in a cell.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Point {
    numbers: [f32; 2],
    /// From the cell's axis.
    from_axis: [f32; 3],
    weight: f32,
}

/// The borders of the parts of a cell, whose middle is the axis. `room`: memory of any content, at least as many numbers as points take.
/// Less is what maps of a few texels for each cell have, whose parts are equal.
pub(super) fn borders(area: &Area<'_>, axis: [f32; 3], room: &mut [f32]) -> Borders {
    let room = room.get_mut(..2 * EACH * size_of::<Point>() / 4);
    let Some(points) = room.and_then(|room| try_cast_slice_mut::<f32, Point>(room).ok()) else { return EVEN };
    let look = Look { area, axis, even: area.density_of_area(axis.map(Four::splat)) };
    let (few, more) = points.split_at_mut(2 * FEW);
    let mut borders = EVEN;
    if look.around(0, few) {
        return borders;
    }
    look.around(FEW, more);
    let (rows, columns) = borders.split_at_mut(CUTS);
    cut(points, 1, rows);
    let mut rest = points;
    for (row, out) in columns.chunks_exact_mut(CUTS).enumerate() {
        let end = rows.get(row).copied().unwrap_or(f32::INFINITY);
        let count = rest.partition_point(|point| point.numbers[1] < end);
        let (of_row, behind) = rest.split_at_mut_checked(count).unwrap_or_default();
        cut(of_row, 0, out);
        rest = behind;
    }
    borders
}

/// Point `index` of the sequence. Apart: a build calls it in a loop.
#[inline(never)]
fn place(index: u32) -> [f32; 2] {
    sobol_in_order(SEED, index)
}

/// Looks for where the light of a cell lies.
struct Look<'a> {
    area: &'a Area<'a>,
    axis: [f32; 3],
    /// The density of even light.
    even: Four,
}

impl Look<'_> {
    /// Writes points from number `first` on, by equal shares of the light and by equal shares of the area. Answers whether the light is even
    /// there.
    fn around(&self, first: usize, out: &mut [Point]) -> bool {
        let (mut least, mut most) = (f32::INFINITY, 0.0);
        for (first, out) in (first..).step_by(GROUP).zip(out.chunks_exact_mut(2 * GROUP)) {
            let (by_light, by_area) = out.split_at_mut(GROUP);
            let parts = by_light.chunks_exact_mut(Four::WIDTH).zip(by_area.chunks_exact_mut(Four::WIDTH));
            for (first, (by_light, by_area)) in (first..).step_by(Four::WIDTH).zip(parts) {
                let (mut across, mut down) = (Four::floats(), Four::floats());
                for (index, (x, y)) in (first as u32..).zip(across.iter_mut().zip(&mut down)) {
                    [*x, *y] = place(index);
                }
                let u = [Four::load(across), Four::load(down)];
                for (out, numbers) in [by_light, by_area].into_iter().zip([u, self.area.find(u)]) {
                    let densities = self.put(numbers, out);
                    for (point, density) in out.iter().zip(densities) {
                        if point.numbers.iter().all(|number| (LEAST..=1.0 - LEAST).contains(number)) {
                            (least, most) = (min(least, density), max(most, density));
                        }
                    }
                }
            }
        }
        most <= EVEN_WITHIN * least
    }

    /// Writes where numbers lead to, and answers the densities there. What both ways to draw points give together, the balance heuristic, is
    /// weighed by the light and by the root of light and area: of a sun and the sky about it, neither must take all parts.
    #[inline(never)]
    fn put(&self, numbers: [Four; 2], out: &mut [Point]) -> [f32; Four::WIDTH] {
        let Sampled { direction, density, .. } = self.area.sample(numbers);
        let weight =
            ((density + (density * self.even).sqrt()) / (density + self.area.density_of_area(direction))).store();
        let ([w, v], [x, y, z], axis) = (numbers.map(Num::store), direction.map(Num::store), self.axis);
        for (lane, out) in out.iter_mut().enumerate().take(Four::WIDTH) {
            // Beyond the cell nothing counts.
            let weight = if weight[lane] > 0.0 && w[lane] < 1.0 && v[lane] < 1.0 { weight[lane] } else { 0.0 };
            let from_axis = [x[lane] - axis[0], y[lane] - axis[1], z[lane] - axis[2]];
            *out = Point { numbers: [w[lane], v[lane]], from_axis, weight };
        }
        density.store()
    }
}

/// Gaps of [`sort`] (Ciura 2001).
const GAPS: [usize; 5] = [57, 23, 10, 4, 1];

/// Points in order of their numbers, and where they are to be cut.
#[derive(Clone, Copy)]
struct Segment<'a> {
    points: &'a [Point],
    range: [f32; 2],
    gain: f32,
    border: f32,
    /// How many points lie before the border.
    before: usize,
}

/// The weight of points, and the weighted sum of their directions.
#[derive(Clone, Copy)]
struct Sum {
    weight: f32,
    direction: Vec3,
}

impl Sum {
    const NONE: Sum = Sum { weight: 0.0, direction: Vec3::ZERO };

    fn and(self, point: &Point) -> Sum {
        let direction = self.direction + point.weight * Vec3::from_array(point.from_axis);
        Sum { weight: self.weight + point.weight, direction }
    }

    fn without(self, other: Sum) -> Sum {
        Sum { weight: self.weight - other.weight, direction: self.direction - other.direction }
    }

    /// Its square: over the weight, it is by how much less the points spread about their mean than about the axis.
    fn squared(self) -> f32 {
        self.direction.length_squared()
    }
}

impl<'a> Segment<'a> {
    /// Cuts where the points of both sides spread least about their means; in the middle of numbers that do not spread.
    #[inline(never)]
    fn new(points: &'a [Point], range: [f32; 2], axis: usize) -> Segment<'a> {
        let number = |point: &Point| point.numbers[axis & 1];
        let [low, high] = range;
        let middle = 0.5 * (low + high);
        let before = points.iter().take_while(|point| number(point) < middle).count();
        let mut segment = Segment { points, range, gain: 0.0, border: middle, before };
        let all = points.iter().fold(Sum::NONE, Sum::and);
        let whole = all.squared() / all.weight;
        let mut left = Sum::NONE;
        for (before, (point, next)) in (1..).zip(points.iter().zip(points.iter().skip(1))) {
            left = left.and(point);
            let border = 0.5 * (number(point) + number(next));
            if border - low < LEAST || high - border < LEAST {
                continue;
            }
            let right = all.without(left);
            let sides = left.squared() * right.weight + right.squared() * left.weight;
            let gain = sides / (left.weight * right.weight) - whole;
            // Not of a side without weight, which gives no number.
            if gain > segment.gain {
                segment = Segment { gain, border, before, ..segment };
            }
        }
        segment
    }

    fn halves(&self, axis: usize) -> [Segment<'a>; 2] {
        let (left, right) = self.points.split_at_checked(self.before).unwrap_or_default();
        let [low, high] = self.range;
        [Segment::new(left, [low, self.border], axis), Segment::new(right, [self.border, high], axis)]
    }

    /// Whether this is to be cut before the other: where that gains most, or else the widest.
    fn comes_before(&self, other: &Segment<'_>) -> bool {
        let width = |segment: &Segment<'_>| segment.range[1] - segment.range[0];
        self.gain > other.gain || self.gain == other.gain && width(self) > width(other)
    }
}

/// Puts points in order of their numbers along an axis, by Shell's method (1959): fewer bytes of code than the standard library's.
fn sort(points: &mut [Point], axis: usize) {
    for gap in GAPS {
        for mut at in gap..points.len() {
            while let Some(before) = at.checked_sub(gap) {
                let (low, high) = points.split_at_mut_checked(at).unwrap_or_default();
                let (Some(earlier), Some(later)) = (low.get_mut(before), high.first_mut()) else { break };
                if !(later.numbers[axis & 1] < earlier.numbers[axis & 1]) {
                    break;
                }
                core::mem::swap(earlier, later);
                at = before;
            }
        }
    }
}

/// Puts points in order of their numbers along an axis, and cuts them where that takes away most of their spread, again and again.
fn cut(points: &mut [Point], axis: usize, borders: &mut [f32]) {
    sort(points, axis);
    let mut segments = [Segment::new(points, [0.0, 1.0], axis); PARTS];
    for count in 1..PARTS {
        let (whole, rest) = segments.split_at_mut(count);
        let next = whole.iter_mut().reduce(|a, b| if b.comes_before(a) { b } else { a });
        if let (Some(next), Some(last)) = (next, rest.first_mut()) {
            [*next, *last] = next.halves(axis);
        }
    }
    // All but the first begin at a border.
    let [a, b, c] = [1, 2, 3].map(|k: usize| segments[k].range[0]);
    let (low, high) = (min(a, b), max(a, b));
    for (border, x) in borders.iter_mut().zip([min(low, c), max(low, min(high, c)), max(high, c)]) {
        *border = x;
    }
}
