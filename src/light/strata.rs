//! Strata: rectangles of equal probability that cover all faces. A candidate is a stratum, and a position inside.
//!
//! They are the leaves of a kD-tree: each node cuts its box and divides its strata (the kD warp of Clarberg et al. 2005, run once; the
//! strata of Agarwal et al. 2003 for random numbers). What they follow is g = max(L - mean, L / 4) x solid angle; of a cut, the sum over
//! both sides of area x integral of g^2 / strata counts, which is the second moment of g over the strata's density.
//!
//! Inside a stratum density is linear along both axes, as the light in the cells of which it was cut says.
//!
//! A node looks at its box as a grid of at most 32 x 32 cells and cuts at their borders: cells are 2^k patches wide, whose sums
//! stand in a pyramid, or parts of a patch, which are looked up. Its parts are cut in the same grid, until they have too few cells and
//! wait for one of their own, in the place of the strata that they will be. So the work is that of the strata, besides one pass over
//! all patches.

use super::chart::{Chart, Layout};
use super::map::{WHOLE, solid_angle};
use super::plan::Plan;
use super::radiance::{DIM, EVEN_SLOPE, SLOPE_BITS, SLOPES, decode};
use super::tables::Light;
use crate::numeric::{max, min, sqrt};
use crate::simd::{Four, Num};
use bytemuck::{Pod, Zeroable};
use core::f64::consts::PI;

/// The most strata of a light.
pub const MOST: usize = 65536;
/// How many there may be: the fewest that follow the light well enough.
const COUNTS: [usize; 5] = [256, 1024, 4096, 16384, MOST];
/// The second moment of p^ / p that is well enough, above 1. An error budget allows as much as itself besides.
const GOAL: f32 = 0.025;

/// Four times as many strata divide what the moment is above 1 by 2 to 3: numbers that cannot reach the goal are not tried.
const GAIN: f32 = 3.0;

/// Strata are divided by a mass that is the light but for this share, which is the root of its mean square in a cell, ...
const ROOT: f32 = 0.1;
/// ... at most so many times the light, ...
const MOST_ROOT: f32 = 4.0;
/// ... and by a little for every direction: of the mean.
const EVERYWHERE: f32 = 0.005;
/// Cells with less light than so many strata are divided by that root alone: a lamp that few strata can follow gets more of them.
const RAISED: f64 = 4.0;
/// A cut that leaves long boxes counts more by this share.
const LONG: f64 = 0.3;
/// Where all cuts are equal, so many squares of the mass decide by the shape of boxes.
const EVEN: f64 = 0.01;

/// A cut that leaves one side with few strata counts more by up to this share: groups of candidates, which lie side by side in the order of
/// the tree, are then compact. Open variances of 8 + 8 are 0.7 of those of exact candidates with 0, and 0.9 with 16.
const UNEVEN: f64 = 16.0;
/// Candidates beyond which that no longer counts.
const MOST_TOGETHER: usize = 64;

/// The steepest density in a stratum, in steps: it is a quarter of the mean at its least, so that no candidate is rare.
const STEEPEST: f32 = 0.75 * EVEN_SLOPE;

/// log2 of the units that a patch is wide, at most: where strata can begin and end.
const FINEST: u32 = 12;
/// Units are told apart by an f32.
const BITS: u32 = 24;
/// The most cells of a grid along an axis.
const GRID: usize = 64;
/// Cells at the top of the pyramid along an axis.
const TOP: u32 = 16;
/// Numbers of a pyramid's cell: mass and square.
const NUMBERS: usize = 2;

/// Parts in which threads finish the strata, at most.
pub const MOST_PARTS: usize = 16;

/// Faces of a chart, at most.
const FACES: usize = 6;
/// Nodes of a grid that wait: the smaller one of two goes first, and none has more strata than a group.
const WAITING: usize = (MOST / MOST_TOGETHER).ilog2() as usize + 1;

/// What an environment says of its texel map and strata.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct StandIn {
    /// Words of the texel map, and of the zeros behind.
    pub(super) words: u64,
    /// Records of tiles.
    pub(super) tiles: u32,
    pub(super) tile_side: u32,
    /// The mean radiance of the map.
    pub mean: f32,
    /// 1 / the integral of max(L - mean, L / 4).
    pub inverse_power: f32,
    /// E[(p^ / p)^2] for p the density of strata and p^ that function over its integral: what strata lose is what it exceeds 1 by.
    pub second_moment: f32,
    /// Strata.
    pub strata: u32,
}

/// The width of a unit of strata: a part of a patch by a power of two, so that all faces in a row are at most 2^`BITS` units long.
#[inline(always)]
pub fn unit(chart: &Chart) -> f32 {
    const FINEST_UNIT: f32 = 1.0 / (1u32 << FINEST) as f32;
    const MANTISSA: u32 = (1 << 23) - 1;
    let longest = max(chart.axes[0].length, chart.axes[1].length * chart.faces() as f32);
    // The power of two that is not below, by the exponent: each call for rays comes here.
    let power = f32::from_bits(longest.to_bits().wrapping_add(MANTISSA) & !MANTISSA);
    max(power * (1.0 / (1u32 << BITS) as f32), FINEST_UNIT)
}

/// A stratum: column, row (counted over all faces), width and height; and along both axes its density where it begins over the mean one.
/// Where it ends that is 2 less this.
pub fn rectangle([x, y, width, height]: [f32; 4], unit: f32) -> ([f32; 4], [f32; 2]) {
    let [[x, a], [y, b]] = [x, y].map(|start| {
        let bits = start.to_bits();
        [(bits >> SLOPE_BITS) as f32 * unit, (bits & SLOPES) as f32 / EVEN_SLOPE]
    });
    ([x, y, width, height], [a, b])
}

/// Levels of the pyramid over a face: the first has cells of two patches.
fn levels(patches: [u32; 2]) -> u32 {
    (1..16).find(|level| patches.iter().all(|n| n.div_ceil(1 << level) <= TOP)).unwrap_or(16)
}

/// Cells of a level along both axes.
fn level_cells(patches: [u32; 2], level: u32) -> [usize; 2] {
    patches.map(|n| n.div_ceil(1 << level) as usize)
}

/// Cells of all levels below one.
fn cells_below(patches: [u32; 2], level: u32) -> usize {
    (1..level).map(|level| level_cells(patches, level)).map(|[columns, rows]| columns * rows).sum()
}

/// The most strata of a chart: a map of a few texels is followed by a few strata.
pub fn most(chart: &Chart) -> usize {
    let patches = chart.axes.map(|axis| u64::from(axis.patches)).iter().product::<u64>() * u64::from(chart.faces());
    COUNTS.into_iter().find(|&count| count as u64 >= patches).unwrap_or(MOST)
}

/// Numbers of the pyramid of a chart.
pub fn pyramid(chart: &Chart) -> usize {
    let patches = chart.axes.map(|axis| axis.patches);
    chart.faces() as usize * cells_below(patches, levels(patches) + 1) * NUMBERS
}

/// How many numbers a build needs room for.
pub fn room(plan: &Plan) -> usize {
    pyramid(&plan.chart) + parts(plan) * GRID * GRID * NUMBERS
}

/// The most cells of a node's grid along an axis. With half of them along its longer side a part is cut in the grid of another node.
fn most_cells(count: u32) -> usize {
    match count {
        0..4 => GRID / 8,
        4..16 => GRID / 4,
        16..64 => GRID / 2,
        _ => GRID,
    }
}

/// A rectangle of a face in units: low and high ends of columns, then of rows.
type Box = [[u32; 2]; 2];

/// A node of the tree.
#[derive(Clone, Copy, Debug, Default)]
struct Node {
    face: u32,
    extent: Box,
    first: u32,
    count: u32,
    /// log2 of the units of the cells at whose borders it lies.
    size: u32,
}

/// Integrals over a cell.
#[derive(Clone, Copy, Debug, Default)]
struct Integrals {
    light: f32,
    square: f32,
    angle: f32,
    area: f32,
}

impl Integrals {
    /// What strata are divided by.
    fn mass(&self) -> f32 {
        let root = sqrt(self.square * self.area).min(MOST_ROOT * self.light);
        (1.0 - ROOT) * self.light + ROOT * root + EVERYWHERE * self.angle
    }
}

/// Cells along an axis: the number of the first, and how many.
#[derive(Clone, Copy, Debug)]
struct Span {
    ends: [u32; 2],
    /// log2 of the units of a cell.
    size: u32,
    first: u32,
    count: usize,
}

impl Span {
    fn new(ends: [u32; 2], size: u32) -> Span {
        let first = ends[0] >> size;
        Span { ends, size, first, count: (ends[1].div_ceil(1 << size) - first) as usize }
    }

    /// Where the middle of cell `i` lies, from -1 to 1, and the part of the length that the cell takes.
    fn middle(&self, i: usize) -> (f32, f32) {
        let [low, high] = [i, i + 1].map(|i| (self.border(i) - self.ends[0]) as f32);
        let all = 1.0 / (self.ends[1] - self.ends[0]).max(1) as f32;
        ((low + high) * all - 1.0, (high - low) * all)
    }

    /// The slope of the density that follows the sums of cells best, in steps and at most [`STEEPEST`].
    fn slope(&self, sums: &Sums) -> i32 {
        let (mut all, mut along, mut squares) = (0.0, 0.0, 0.0);
        for (i, sum) in sums.iter().enumerate().take(self.count) {
            let (middle, part) = self.middle(i);
            all += sum[0] as f32;
            along += sum[0] as f32 * middle;
            squares += part * middle * middle;
        }
        let slope = along * EVEN_SLOPE / (all * squares).max(f32::MIN_POSITIVE);
        min(max(slope + if slope < 0.0 { -0.5 } else { 0.5 }, -STEEPEST), STEEPEST) as i32
    }

    /// Whether its cells are of this size, also the first and the last.
    fn is_whole(&self, size: u32) -> bool {
        self.size == size
            && [0, self.count].map(|i| self.border(i)) == [0, self.count].map(|i| (self.first + i as u32) << size)
    }

    /// Where cell `i` begins.
    fn border(&self, i: usize) -> u32 {
        ((self.first + i as u32) << self.size).max(self.ends[0]).min(self.ends[1])
    }
}

/// Light and solid angle along a line.
struct Line {
    light: [f32; GRID + 1],
    angle: [f32; GRID + 1],
}

/// Of no light.
const DARK: Line = Line { light: [0.0; GRID + 1], angle: [0.0; GRID + 1] };

/// Integrals over a row of cells.
#[derive(Clone, Copy, Zeroable)]
struct Row {
    width: [f32; GRID],
    height: f32,
    light: [f32; GRID],
    square: [f32; GRID],
    angle: [f32; GRID],
}

impl Row {
    /// Those over its cells.
    #[inline(always)]
    fn cells(&self) -> impl Iterator<Item = Integrals> {
        let sums = self.light.iter().zip(&self.square).zip(&self.angle);
        let cells = sums.zip(&self.width);
        cells.map(|(((&light, &square), &angle), width)| Integrals { light, square, angle, area: width * self.height })
    }
}

/// Sums of the columns or rows of a part of a grid: mass and square.
type Sums = [[f64; NUMBERS]; GRID];
/// Room for both.
const NO_SUMS: [Sums; 2] = [[[0.0; NUMBERS]; GRID]; 2];

/// Mass and square of the cells of a node's box, row by row.
struct Grid<'a> {
    spans: [Span; 2],
    cells: &'a [[f32; NUMBERS]],
}

impl Grid<'_> {
    /// The rows of a part, each from the first column of the part to the end of the grid.
    #[inline(always)]
    fn lines(&self, part: &[Span; 2]) -> impl Iterator<Item = &[[f32; NUMBERS]]> {
        let [x, y] = [0, 1].map(|k: usize| (part[k].first - self.spans[k].first) as usize);
        let lines = self.cells.get(GRID * y..).unwrap_or(&[]).chunks_exact(GRID).take(part[1].count);
        lines.map(move |line| line.get(x..).unwrap_or(&[]))
    }

    /// Sums of the columns and of the rows of a part; what stands behind them stays.
    #[inline(always)]
    fn sums(&self, part: &[Span; 2], [columns, rows]: &mut [Sums; 2]) {
        // By slices, which know their ends: each node comes here.
        let columns = columns.get_mut(..part[0].count).unwrap_or_default();
        columns.fill([0.0; NUMBERS]);
        for (line, row) in self.lines(part).zip(rows) {
            let mut sum = [0.0; NUMBERS];
            for (cell, column) in line.iter().zip(columns.iter_mut()) {
                let numbers = cell.map(f64::from);
                *column = [column[0] + numbers[0], column[1] + numbers[1]];
                sum = [sum[0] + numbers[0], sum[1] + numbers[1]];
            }
            *row = sum;
        }
    }
}

/// What all nodes of a build share.
struct Build<'a, 'b> {
    field: &'a Field<'a>,
    /// The sums of the patches.
    pyramid: &'b [f32],
    /// Room for a grid.
    cells: &'b mut [[f32; NUMBERS]],
    /// The strata of a candidate, where as many are drawn together as may be.
    group: u32,
}

/// A cut, and what it is worth.
#[derive(Clone, Copy)]
struct Cut {
    cost: f64,
    axis: usize,
    at: u32,
    /// Strata before it.
    count: u32,
    /// The integrals of the square of both sides.
    squares: [f64; 2],
}

/// The light as strata see it.
#[derive(Clone, Copy)]
struct Field<'a> {
    light: &'a Light<'a>,
    patches: [u32; 2],
    /// log2 of the units that a patch is wide.
    patch: u32,
    /// What light is multiplied by, so that neither huge nor tiny maps leave the range of f32.
    scale: f64,
}

/// Strata between the passes of a build.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Begun {
    /// How many strata.
    pub count: u64,
    /// The integral of all light.
    power: f64,
    /// The sum of area x integral of the square over the strata that are finished.
    squares: f64,
    /// Where the parts begin in which the others wait, and where the last one ends.
    starts: [u64; MOST_PARTS + 1],
}

/// How many rows the lowest level of the pyramid has: one after the other, for all faces.
pub fn rows(chart: &Chart) -> u32 {
    chart.faces() * level_cells(chart.axes.map(|axis| axis.patches), 1)[1] as u32
}

/// The parts of the strata, which threads finish: as many as have room for grids of their own where the luminances stood.
pub fn parts(plan: &Plan) -> usize {
    let texels = plan.rows() as usize * plan.of.width as usize;
    (texels.saturating_sub(pyramid(&plan.chart)) / (GRID * GRID * NUMBERS)).clamp(1, MOST_PARTS)
}

/// Where a row of the pyramid stands in the room of a build, and its length.
pub fn row(chart: &Chart, row: u32) -> (usize, usize) {
    let patches = chart.axes.map(|axis| axis.patches);
    let [columns, rows] = level_cells(patches, 1);
    let (face, row) = (row as usize / rows.max(1), row as usize % rows.max(1));
    let first = face * cells_below(patches, levels(patches) + 1) + row * columns;
    (first * NUMBERS, columns * NUMBERS)
}

/// Where the grid of a part stands in the room of a build, behind the pyramid, and its length.
pub fn grid(chart: &Chart, part: usize) -> (usize, usize) {
    let length = GRID * GRID * NUMBERS;
    (pyramid(chart) + part * length, length)
}

/// Writes a row of the lowest level of the pyramid of a light whose texel map is written, and answers the integral of its light. `mean`: that
/// of the radiance.
pub fn sum_row(light: &Light<'_>, mean: f64, row: u32, out: &mut [f32]) -> f64 {
    let field = Field::new(light, 1.0 / mean);
    let rows = level_cells(field.patches, 1)[1].max(1) as u32;
    let [across, down] = field.face();
    let ends = |k: u32, span: u32, all: [u32; 2]| {
        let [low, high] = [k * span, (k + 1) * span].map(|patch| patch << field.patch);
        Span::new([low.max(all[0]), high.min(all[1])], field.patch)
    };
    let of_row = ends(row % rows, 2, down);
    let parts = (0..).zip(out.chunks_mut(GRID / 2 * NUMBERS));
    parts.map(|(part, out)| field.sum_up_part(row / rows, [ends(part, GRID as u32, across), of_row], out)).sum()
}

/// Chooses how many strata there are, and begins them. `totals`: of the rows; `room` as [`room`] says; `out` has room for [`MOST`].
pub fn begin(
    light: &Light<'_>,
    mean: f64,
    plan: &Plan,
    totals: &[f64],
    room: &mut [f32],
    out: &mut [[f32; 4]],
) -> Begun {
    let (pyramid, cells) = room.split_at_mut_checked(pyramid(&light.chart)).unwrap_or_default();
    let field = &Field::new(light, 1.0 / mean);
    let power: f64 = totals.iter().sum();
    let (goal, most) = (1.0 + GOAL + plan.of.budget, most(&light.chart));
    let mut begun = Begun { count: 0, power, squares: 0.0, starts: [0; MOST_PARTS + 1] };
    let mut hoped = 1.0;
    for count in COUNTS {
        if hoped > goal && count < most {
            hoped = 1.0 + (hoped - 1.0) / GAIN;
            continue;
        }
        let out = out.get_mut(..count).unwrap_or_default();
        field.raise(pyramid, (RAISED * power / count as f64) as f32);
        let mut build = Build::new(field, pyramid, cells, count);
        begun = Begun { count: count as u64, squares: build.begin(out), ..begun };
        if count == most {
            begun.starts = starts(out, parts(plan));
            break;
        }
        begun.squares += build.divide_waiting(out, 0);
        let moment = begun.second_moment();
        if moment <= goal {
            break;
        }
        hoped = 1.0 + (moment - 1.0) / GAIN;
    }
    begun
}

/// Where parts begin that have about as many strata each, and no node in common; and the end.
fn starts(out: &[[f32; 4]], parts: usize) -> [u64; MOST_PARTS + 1] {
    let mut starts = [out.len() as u64; MOST_PARTS + 1];
    let (mut at, mut part) = (0, 0);
    while at < out.len() {
        while part < parts && at >= part * out.len() / parts.max(1) {
            if let Some(start) = starts.get_mut(part) {
                *start = at as u64;
            }
            part += 1;
        }
        at += Node::waiting(out, at).map_or(1, |node| node.count as usize);
    }
    starts
}

impl Begun {
    /// The strata of a part, and how many they are.
    pub fn part(&self, part: usize) -> (usize, usize) {
        match self.starts.get(part..part + 2) {
            Some(&[first, end]) => (first as usize, end.saturating_sub(first) as usize),
            _ => (0, 0),
        }
    }

    /// Finishes the strata of a part. Answers the sum of area x integral of the square over them.
    pub fn divide(
        &self,
        light: &Light<'_>,
        mean: f64,
        pyramid: &[f32],
        cells: &mut [f32],
        out: &mut [[f32; 4]],
    ) -> f64 {
        let field = &Field::new(light, 1.0 / mean);
        Build::new(field, pyramid, cells, self.count as usize).divide_waiting(out, 0)
    }

    fn second_moment(&self) -> f32 {
        let (count, power) = (self.count as f64, self.power);
        if power > 0.0 { (count * self.squares / (power * power)) as f32 } else { 1.0 }
    }

    /// What is stored of them. `squares`: what [`Begun::divide`] answered for all parts.
    pub fn finish(mut self, mean: f64, squares: &[f64]) -> StandIn {
        self.squares += squares.iter().sum::<f64>();
        let inverse_power =
            if self.power > 0.0 { (scale(1.0 / mean) / self.power).min(f64::from(f32::MAX)) } else { 0.0 };
        StandIn {
            strata: self.count as u32,
            mean: mean as f32,
            inverse_power: inverse_power as f32,
            second_moment: self.second_moment(),
            ..StandIn::zeroed()
        }
    }
}

/// A factor for light; 1 in place of one that is no number.
fn scale(factor: f64) -> f64 {
    if factor.is_finite() { factor } else { 1.0 }
}

impl Field<'_> {
    /// The light of a map in units of its mean.
    fn new<'a>(light: &'a Light<'a>, factor: f64) -> Field<'a> {
        let patches = light.chart.axes.map(|axis| axis.patches);
        let patch = ((1.0 / unit(&light.chart)) as u32).trailing_zeros();
        Field { light, patches, patch, scale: scale(factor) }
    }

    /// The width of a unit.
    fn unit(&self) -> f32 {
        1.0 / (1u32 << self.patch) as f32
    }

    /// The box of a face.
    fn face(&self) -> Box {
        self.light.chart.axes.map(|a| [a.shift, a.shift + a.length].map(|x| (x * (1u32 << self.patch) as f32) as u32))
    }

    /// The position of a unit along an axis.
    fn position(&self, axis: usize, unit: u32) -> f32 {
        unit as f32 * self.unit() - self.light.chart.axes[axis & 1].shift
    }

    /// What exceeds the mean, or a share of the light.
    #[inline(always)]
    fn excess(&self, light: Four) -> Four {
        (light - 1.0).max(light * DIM)
    }

    /// Light and solid angle at the borders of cells along a line. `places`: where those lie along it, as [`Field::inside`]
    /// says; none if cells are patches of a map of one tile.
    #[inline(never)]
    fn read_line(&self, face: u32, row: u32, columns: &Span, places: &[(u32, f32)], out: &mut Line) {
        let (light, scale) = (self.light, self.scale);
        let (y, t) = self.inside(1, row);
        let scaled = |x: f32| (f64::from(x) * scale) as f32;
        let rows = self.rows_of_words(face, y);
        let words = rows.and_then(|[above, _]| above.get(columns.first as usize..)).filter(|_| places.is_empty());
        if let Some(words) = words {
            for (out, &word) in out.light.iter_mut().zip(words).take(columns.count + 1) {
                *out = scaled(decode(word));
            }
        } else {
            for (&(x, s), out) in places.iter().zip(out.light.iter_mut()) {
                let corners =
                    rows.map(|rows| rows.map(|row| row.get(x as usize..).and_then(|row| row.first_chunk::<2>())));
                *out = scaled(match corners {
                    Some([Some(above), Some(below)]) => {
                        let [above, below] = [above, below].map(|pair| pair.map(decode));
                        let line = |[a, b]: [f32; 2]| a * (1.0 - s) + b * s;
                        line(above) * (1.0 - t) + line(below) * t
                    }
                    _ => light.radiance_in(face, [x, y], [s, t]),
                });
            }
        }
        let angle = |i: usize| solid_angle(&light.chart, [self.position(0, columns.border(i)), self.position(1, row)]);
        if light.chart.layout == Layout::Cube {
            for (i, out) in (0..=columns.count).zip(out.angle.iter_mut()) {
                *out = angle(i);
            }
        } else {
            out.angle.fill(angle(0));
        }
    }

    /// The rows of words above and below the patches of a row, if the map is one tile.
    fn rows_of_words(&self, face: u32, row: u32) -> Option<[&[u16]; 2]> {
        let stride = self.patches[0] as usize + 1;
        let first = (face * (self.patches[1] + 1) + row) as usize * stride;
        let rows = self.light.texels.get(first..first + 2 * stride).filter(|_| self.light.tile_side == WHOLE)?;
        let (above, below) = rows.split_at_checked(stride)?;
        Some([above, below])
    }

    /// The patch that holds a unit, and where in the patch that lies; for a nearest client at its beginning.
    #[inline(always)]
    fn inside(&self, axis: usize, unit: u32) -> (u32, f32) {
        let patch = (unit >> self.patch).min(self.patches[axis & 1] - 1);
        let rest = (unit - (patch << self.patch)) as f32 * self.unit();
        (patch, if self.light.bilinear { rest } else { 0.0 })
    }

    /// Hands out the integrals over the rows of a grid whose cells are at most a patch wide.
    #[inline(never)]
    fn each_row(&self, face: u32, [columns, rows]: [Span; 2], each: &mut dyn FnMut(&Row)) {
        let (mut lines, mut row, mut places) = ([DARK; 2], Row::zeroed(), [(0, 0.0); GRID + 1]);
        let unit = self.unit();
        // The last line of a face lies at the end of patches.
        let inner = self.light.tile_side == WHOLE && self.inside(1, rows.border(rows.count)).1 == 0.0;
        let whole = inner && [columns, rows].iter().all(|span| span.is_whole(self.patch));
        let places = if whole { &mut [] } else { places.get_mut(..=columns.count).unwrap_or_default() };
        for (i, place) in places.iter_mut().enumerate() {
            *place = self.inside(0, columns.border(i));
        }
        for (i, width) in row.width.iter_mut().enumerate().take(columns.count) {
            *width = (columns.border(i + 1) - columns.border(i)) as f32 * unit;
        }
        self.read_line(face, rows.border(0), &columns, places, &mut lines[0]);
        for j in 0..rows.count {
            let [above, below] = &mut lines;
            self.read_line(face, rows.border(j + 1), &columns, places, below);
            row.height = (rows.border(j + 1) - rows.border(j)) as f32 * unit;
            self.integrate(above, below, columns.count, &mut row);
            each(&row);
            lines.swap(0, 1);
        }
    }

    /// The integrals over a row of cells in which light is bilinear: down a cell by two Gauss points, since both light and solid angle
    /// vary.
    #[inline(never)]
    fn integrate(&self, above: &Line, below: &Line, count: usize, row: &mut Row) {
        const GAUSS: [f32; 2] = [0.211_324_87, 0.788_675_1];
        let (next, kink) = (usize::from(self.light.bilinear), 1.0 / (1.0 - DIM));
        let below_light = if self.light.bilinear { &below.light } else { &above.light };
        let mut across = 0u64;
        let (height, kink) = (row.height, Four::splat(kink));
        for first in (0..count.min(GRID)).step_by(Four::WIDTH) {
            let corners = |above: &[f32], below: &[f32], next: usize| {
                [(above, 0), (above, next), (below, 0), (below, next)].map(|(line, next)| Four::at(line, first + next))
            };
            let light = corners(&above.light, below_light, next);
            let [p, q, r, s] = corners(&above.angle, &below.angle, 1);
            let [a, b, c, d] = light;
            let is_across = Four::and(a.min(b).min(c.min(d)).lt(kink), kink.lt(a.max(b).max(c.max(d))));
            across |= u64::from(Four::bits(is_across)) << first;
            let [a, b, c, d] = light.map(|light| self.excess(light));
            let (mut sum, mut squares) = (Four::splat(0.0), Four::splat(0.0));
            for t in GAUSS {
                let [left, right] = [(a + (c - a) * t) * (p + (r - p) * t), (b + (d - b) * t) * (q + (s - q) * t)];
                sum = sum + (left + right);
                squares = squares + (left * left + left * right + right * right);
            }
            let area = Four::at(&row.width, first) * height;
            (area * 0.25 * sum).write(&mut row.light, first);
            (area * squares * (1.0 / 6.0)).write(&mut row.square, first);
            (area * 0.25 * ((p + q) + (r + s))).write(&mut row.angle, first);
        }
        if count < GRID {
            across &= (1 << count) - 1;
        }
        while across != 0 {
            let (mut group, found) = ([0; Four::WIDTH], across.count_ones() as usize);
            for place in group.iter_mut().take(found) {
                *place = across.trailing_zeros() as usize;
                across &= across - 1;
            }
            let corners = |above: &[f32; GRID + 1], below: &[f32; GRID + 1], next: usize| {
                [(above, 0), (above, next), (below, 0), (below, next)]
                    .map(|(line, next)| Four::each(|lane| line[group[lane] % GRID + (next & 1)]))
            };
            let light = corners(&above.light, below_light, next);
            let [sums, squares] = self.means_across(light, corners(&above.angle, &below.angle, 1)).map(Num::store);
            for (&i, (sum, square)) in group.iter().zip(sums.iter().zip(squares)).take(found) {
                let area = row.width[i % GRID] * row.height;
                (row.light[i % GRID], row.square[i % GRID]) = (area * sum, area * square);
            }
        }
    }

    /// The means of cells, and of their squares, where light crosses what the mean leaves: at 4 x 4 places.
    #[inline(never)]
    fn means_across(&self, light: [Four; 4], angle: [Four; 4]) -> [Four; 2] {
        const AT: [f32; 4] = [0.125, 0.375, 0.625, 0.875];
        let mix = |a: Four, b: Four, t: f32| a + (b - a) * t;
        let mut sums = [Four::splat(0.0); 2];
        for t in AT {
            let ends = |[a, b, c, d]: [Four; 4]| [mix(a, c, t), mix(b, d, t)];
            let ([a, b], [p, q]) = (ends(light), ends(angle));
            for s in AT {
                let g = self.excess(mix(a, b, s)) * mix(p, q, s);
                sums = [sums[0] + g, sums[1] + g * g];
            }
        }
        sums.map(|sum| sum * (1.0 / 16.0))
    }

    /// Writes a part of a row of the lowest level of the pyramid, and answers the integral of its light.
    #[inline(never)]
    fn sum_up_part(&self, face: u32, spans: [Span; 2], out: &mut [f32]) -> f64 {
        let mut sums = [Integrals::default(); GRID / 2];
        self.each_row(face, spans, &mut |row| {
            let mut cells = row.cells().take(spans[0].count);
            for sum in &mut sums {
                for cell in cells.by_ref().take(2) {
                    sum.light += cell.light;
                    sum.square += cell.square;
                    sum.angle += cell.angle;
                    sum.area += cell.area;
                }
            }
        });
        for (sum, out) in sums.iter().zip(out.chunks_exact_mut(NUMBERS)) {
            out.copy_from_slice(&[sum.mass(), sum.square]);
        }
        sums.iter().map(|sum| f64::from(sum.light)).sum()
    }

    /// Writes the other levels of the pyramid. A cell with less light than one stratum has the root of its mean square as its mass: where
    /// strata cannot follow the light, they are divided by what is left to them (Neyman).
    fn raise(&self, room: &mut [f32], one: f32) {
        let per_face = cells_below(self.patches, levels(self.patches) + 1) * NUMBERS;
        for numbers in room.chunks_exact_mut(per_face.max(1)).take(self.light.chart.faces() as usize) {
            for level in 2..=levels(self.patches) {
                let below = cells_below(self.patches, level) * NUMBERS;
                let (done, out) = numbers.split_at_mut_checked(below).unwrap_or_default();
                let [below, above] = [level - 1, level].map(|level| level_cells(self.patches, level));
                let done = done.get(cells_below(self.patches, level - 1) * NUMBERS..).unwrap_or(&[]);
                let (area, length) = ((1u64 << (2 * level)) as f32, below[0] * NUMBERS);
                for (y, out) in out.chunks_exact_mut(above[0].max(1) * NUMBERS).enumerate().take(above[1]) {
                    let row =
                        |y: usize| done.get(y * length..).filter(|_| y < below[1]).and_then(|row| row.get(..length));
                    let [upper, lower] = [2 * y, 2 * y + 1].map(|y| row(y).unwrap_or_default());
                    for (x, out) in out.chunks_exact_mut(NUMBERS).enumerate() {
                        for (k, out) in out.iter_mut().enumerate() {
                            let at = |row: &[f32], x: usize| row.get(x * NUMBERS + k).copied().unwrap_or(0.0);
                            let [upper, lower] = [upper, lower].map(|row| at(row, 2 * x) + at(row, 2 * x + 1));
                            *out = upper + lower;
                        }
                        if let [mass, square] = out
                            && *mass < one
                        {
                            *mass = sqrt(*square * area).min(MOST_ROOT * *mass);
                        }
                    }
                }
            }
        }
    }
}

impl<'a, 'b> Build<'a, 'b> {
    fn new(field: &'a Field<'a>, pyramid: &'b [f32], cells: &'b mut [f32], count: usize) -> Build<'a, 'b> {
        let cells = cells.get_mut(..GRID * GRID * NUMBERS).unwrap_or_default();
        let cells = bytemuck::try_cast_slice_mut(cells).unwrap_or_default();
        Build { field, pyramid, cells, group: (count / MOST_TOGETHER) as u32 }
    }

    /// Begins strata of all faces: nodes of more of them than a group are cut. Answers the sum of area x integral of the square over strata that
    /// are finished.
    fn begin(&mut self, out: &mut [[f32; 4]]) -> f64 {
        let Field { light, patches, patch, .. } = *self.field;
        let faces = light.chart.faces();
        let root = Node { face: 0, extent: self.field.face(), first: 0, count: 1, size: patch + levels(patches) };
        let mut of_faces = [[0.0; NUMBERS]; FACES];
        for (face, all) in (0..faces).zip(&mut of_faces) {
            let grid = self.read(&Node { face, ..root });
            let mut sums = NO_SUMS;
            grid.sums(&grid.spans, &mut sums);
            *all = sums[0].iter().fold(*all, |a, b| [a[0] + b[0], a[1] + b[1]]);
        }
        let masses: f64 = of_faces.iter().map(|face| face[0]).sum();
        let (mut first, mut rest, mut total) = (0, masses, 0.0);
        for (face, [mass, square]) in (0..faces).zip(of_faces) {
            let (left, behind) = (out.len() as u32 - first, faces - 1 - face);
            let share = if behind == 0 { left } else { rounded(f64::from(left) * mass / rest) };
            let count = share.max(1).min(left.saturating_sub(behind).max(1));
            total += self.field.put(&Node { face, first, count, ..root }, square, out);
            first += count;
            rest -= mass;
        }
        total + self.divide_waiting(out, self.group)
    }

    /// Divides the nodes that wait with more strata than so many. Answers the same.
    fn divide_waiting(&mut self, out: &mut [[f32; 4]], least: u32) -> f64 {
        let (mut at, mut total) = (0, 0.0);
        while at < out.len() {
            match Node::waiting(out, at) {
                Some(node) if node.count > least => {
                    let (field, group) = (self.field, self.group);
                    total += field.divide(&self.read(&node), node, group, out);
                }
                node => at += node.map_or(1, |node| node.count.max(1) as usize),
            }
        }
        total
    }

    /// The grid of a node's box.
    #[inline(never)]
    fn read(&mut self, node: &Node) -> Grid<'_> {
        let field = self.field;
        let spans = node.grid(most_cells(node.count));
        let [across, down] = spans;
        if across.size <= field.patch {
            let mut lines = self.cells.chunks_exact_mut(GRID);
            field.each_row(node.face, spans, &mut |row| {
                let line = lines.next().and_then(|line| line.get_mut(..across.count)).unwrap_or_default();
                line.iter_mut().zip(row.cells()).for_each(|(out, cell)| *out = [cell.mass(), cell.square]);
            });
            return Grid { spans, cells: self.cells };
        }
        let level = across.size - field.patch;
        let per_face = cells_below(field.patches, levels(field.patches) + 1);
        let first = node.face as usize * per_face + cells_below(field.patches, level);
        let width = level_cells(field.patches, level)[0];
        for (j, out) in self.cells.chunks_exact_mut(GRID).enumerate().take(down.count) {
            let start = first + (down.first as usize + j) * width + across.first as usize;
            let line = self.pyramid.get(NUMBERS * start..).unwrap_or(&[]);
            for (out, numbers) in out.iter_mut().zip(line.chunks_exact(NUMBERS)).take(across.count) {
                out.copy_from_slice(numbers);
            }
        }
        Grid { spans, cells: self.cells }
    }
}

impl Node {
    /// The grid in which it is cut: never coarser than the cells of which its box is made.
    fn grid(&self, most: usize) -> [Span; 2] {
        let fits = |size: &u32| self.extent.iter().all(|&ends| Span::new(ends, *size).count <= most);
        let size = (0..self.size).find(fits).unwrap_or(self.size);
        self.extent.map(|ends| Span::new(ends, size))
    }

    /// A node of at least two strata as it waits in their place: told from strata by a width below 0.
    fn waits(&self) -> [[f32; 4]; 2] {
        let [[left, right], [top, bottom]] = self.extent.map(|ends| ends.map(|end| end as f32));
        [[left, right, -1.0 - self.face as f32, self.size as f32], [top, bottom, self.count as f32, 0.0]]
    }

    /// The node that waits in a place.
    fn waiting(out: &[[f32; 4]], first: usize) -> Option<Node> {
        let [left, right, face, size] = *out.get(first).filter(|slot| slot[2] < 0.0)?;
        let [top, bottom, count, _] = *out.get(first + 1)?;
        let extent = [[left, right], [top, bottom]].map(|ends| ends.map(|end| end as u32));
        let (face, count, size) = ((-1.0 - face) as u32, count as u32, size as u32);
        Some(Node { face, extent, first: first as u32, count, size })
    }
}

impl Field<'_> {
    /// Cuts a node until its parts are strata, or too small for its grid. Answers the sum of area x integral of the square over the strata.
    /// Apart, so that sums are not on the stack with what reads a grid.
    #[inline(never)]
    fn divide(&self, grid: &Grid<'_>, node: Node, group: u32, out: &mut [[f32; 4]]) -> f64 {
        let size = grid.spans[0].size;
        let (mut nodes, mut sums) = ([Node::default(); WAITING], NO_SUMS);
        let (mut count, mut total) = (1usize, 0.0);
        nodes[0] = Node { size, ..node };
        while let Some(&node) = count.checked_sub(1).and_then(|last| nodes.get(last)) {
            count -= 1;
            let (mut parts, mut squares) = self.cut(grid, &node, group, &mut sums);
            // The smaller part goes first, so that few wait.
            if parts[0].count < parts[1].count {
                parts.swap(0, 1);
                squares.swap(0, 1);
            }
            for (part, square) in parts.iter().zip(squares) {
                let cells = part.extent.map(|ends| Span::new(ends, size).count);
                // Even cuts need borders of their own.
                let suits = part.count <= group && 2 * cells[0].max(cells[1]) >= most_cells(part.count);
                let is_fine = part.count > 1 && suits;
                match nodes.get_mut(count).filter(|_| is_fine) {
                    Some(place) => {
                        *place = *part;
                        count += 1;
                    }
                    None if part.count > 1 => total += self.put(part, square, out),
                    None => total += self.finish(grid, part, &mut sums, out),
                }
            }
        }
        total
    }

    /// Writes a stratum, and answers area x integral of the square; or leaves a node to wait.
    fn put(&self, node: &Node, square: f64, out: &mut [[f32; 4]]) -> f64 {
        let Some(slots) = out.get_mut(node.first as usize..) else { return 0.0 };
        if node.count > 1 {
            for (slot, waits) in slots.iter_mut().zip(node.waits()) {
                *slot = waits;
            }
            return 0.0;
        }
        if let Some(slot) = slots.first_mut() {
            *slot = self.stratum(node, [0; 2]);
        }
        self.area(&node.extent) * square
    }

    /// A stratum with slopes along both axes, as [`rectangle`] reads it.
    fn stratum(&self, node: &Node, slopes: [i32; 2]) -> [f32; 4] {
        let before = |k: usize| {
            let axis = &self.light.chart.axes[k & 1];
            let [shift, length] = [axis.shift, axis.length].map(|x| (x * (1u32 << self.patch) as f32) as u32);
            node.extent[k & 1][0] - shift + if k == 1 { node.face * length } else { 0 }
        };
        let [x, y] = [0, 1].map(|k: usize| {
            let first = EVEN_SLOPE as i32 - slopes[k & 1];
            f32::from_bits(before(k) << SLOPE_BITS | first as u32 & SLOPES)
        });
        let [width, height] = node.extent.map(|[low, high]| (high - low) as f32 * self.unit());
        [x, y, width, height]
    }

    /// Writes the stratum of a node in a grid, with the slopes of the light there. Answers area x integral of the square over its density.
    #[inline(never)]
    fn finish(&self, grid: &Grid<'_>, node: &Node, sums: &mut [Sums; 2], out: &mut [[f32; 4]]) -> f64 {
        let spans = node.extent.map(|ends| Span::new(ends, node.size));
        grid.sums(&spans, sums);
        let slopes = [0, 1].map(|k: usize| spans[k & 1].slope(&sums[k & 1]));
        if let Some(slot) = out.get_mut(node.first as usize) {
            *slot = self.stratum(node, slopes);
        }
        let mut densities = [[1.0; GRID]; 2];
        for ((densities, span), slope) in densities.iter_mut().zip(&spans).zip(slopes) {
            for (i, density) in densities.iter_mut().enumerate().take(span.count) {
                *density = 1.0 + span.middle(i).0 * slope as f32 / EVEN_SLOPE;
            }
        }
        let [columns, rows] = &densities;
        let columns = columns.get(..spans[0].count).unwrap_or_default();
        let mut sum = 0.0;
        for (line, row) in grid.lines(&spans).zip(rows) {
            for (cell, column) in line.iter().zip(columns) {
                sum += f64::from(cell[1] / (column * row));
            }
        }
        self.area(&node.extent) * sum
    }

    /// Cuts a node in two, where that makes the least second moment. Answers the integrals of the squares of both parts.
    #[inline(never)]
    fn cut(&self, grid: &Grid<'_>, node: &Node, group: u32, sums: &mut [Sums; 2]) -> ([Node; 2], [f64; 2]) {
        let spans = node.extent.map(|ends| Span::new(ends, node.size));
        grid.sums(&spans, sums);
        let middle = node.extent.map(|[low, high]| low.midpoint(high));
        let mut best = Cut { cost: f64::INFINITY, axis: 0, at: middle[0], count: node.count / 2, squares: [0.0; 2] };
        for (axis, (sums, span)) in sums.iter().zip(&spans).enumerate() {
            self.best_cut(node, group, span, axis, sums, &mut best);
        }
        let mut parts = [*node; 2];
        parts[0].extent[best.axis & 1][1] = best.at;
        parts[1].extent[best.axis & 1][0] = best.at;
        parts[0].count = best.count;
        parts[1].count = node.count - best.count;
        parts[1].first += best.count;
        (parts, best.squares)
    }

    /// The best cut along an axis, if it is better than one that is known.
    #[inline(never)]
    fn best_cut(&self, node: &Node, group: u32, span: &Span, axis: usize, sums: &Sums, best: &mut Cut) {
        let all = sums.iter().take(span.count).fold([0.0; NUMBERS], |a, b| [a[0] + b[0], a[1] + b[1]]);
        let mut before = [0.0; NUMBERS];
        let whole = self.area(&node.extent);
        let shape = 1.0 + LONG * self.length_across(node, axis);
        let units = whole * f64::from(1u32 << (2 * self.patch));
        let [strata, last] = [node.count, node.count - 1].map(f64::from);
        let per_mass = if all[0] > 0.0 { strata / all[0] } else { 0.0 };
        let per_unit = 1.0 / f64::from(span.ends[1] - span.ends[0]);
        for (i, sum) in sums.iter().enumerate().take(span.count.saturating_sub(1)) {
            before = [before[0] + sum[0], before[1] + sum[1]];
            let at = span.border(i + 1);
            let share = f64::from(at - span.ends[0]) * per_unit;
            let behind = [all[0] - before[0], all[1] - before[1]].map(|x| max(x, 0.0));
            // No side has more strata than units.
            let [least, most] = [max(strata - units * (1.0 - share), 1.0), min(units * share, last)];
            let count = rounded(max(min(before[0] * per_mass, most), least));
            let areas = [whole * share, whole * (1.0 - share)];
            let sides =
                [(count, areas[0] * before[1], before[0]), (node.count - count, areas[1] * behind[1], behind[0])];
            let [first, second] = sides.map(|(count, square, mass)| {
                let (count, even) = (f64::from(count), EVEN * mass * mass);
                (square + even) / count
            });
            let uneven = || f64::from(count) * 2.0 / f64::from(node.count) - 1.0;
            let uneven = if node.count > group { 1.0 + UNEVEN * uneven() * uneven() } else { 1.0 };
            let cost = (first + second) * shape * uneven;
            if cost < best.cost {
                *best = Cut { cost, axis, at, count, squares: [before[1], behind[1]] };
            }
        }
    }

    /// The area of a box, in patches.
    fn area(&self, extent: &Box) -> f64 {
        let [width, height] = extent.map(|[low, high]| f64::from(high - low) * f64::from(self.unit()));
        width * height
    }

    /// How long a box is across an axis, as a share of both lengths.
    fn length_across(&self, node: &Node, axis: usize) -> f64 {
        let [width, height] = node.extent.map(|[low, high]| f64::from(high - low));
        let chart = &self.light.chart;
        let [width, height] = if chart.layout == Layout::LatLong {
            let row = 0.5 * (self.position(1, node.extent[1][0]) + self.position(1, node.extent[1][1]));
            let [columns, rows] = chart.axes.map(|axis| f64::from(axis.length));
            let sine = libm::sin(PI * f64::from(row) / rows);
            [width * 2.0 * sine / columns, height / rows]
        } else {
            [width, height]
        };
        (if axis == 0 { height } else { width }) / (width + height)
    }
}

/// Whether strata lie in faces, at units of which an f32 tells the sides apart, and cover as much as all faces.
pub fn are_sound(light: &Light<'_>) -> bool {
    let field = Field::new(light, 1.0);
    let units = (1u32 << field.patch) as f32;
    let [length, height] = light.chart.axes.map(|axis| axis.length);
    let (mut sum, all) = (0u64, f64::from(length * units) * f64::from(height * units) * f64::from(light.chart.faces()));
    let sound = light.strata.iter().all(|&stratum| {
        let (sides, first) = rectangle(stratum, field.unit());
        let [x, y, width, rows] = sides.map(|x| x * units);
        if first.iter().any(|a| (a - 1.0).abs() * EVEN_SLOPE > STEEPEST) {
            return false;
        }
        let whole = [x, y, width, rows].iter().all(|&n| (0.0..(1 << BITS) as f32).contains(&n) && n as u32 as f32 == n);
        if !whole {
            return false;
        }
        let [x, y, width, rows] = [x, y, width, rows].map(|n| n as u64);
        let [length, height] = [length, height].map(|n| (n * units) as u64);
        sum = sum.saturating_add(width * rows);
        let fits =
            x + width <= length && y % height.max(1) + rows <= height && y < height * u64::from(light.chart.faces());
        width > 0 && rows > 0 && fits
    });
    sound && COUNTS.contains(&light.strata.len()) && sum as f64 == all
}

/// The nearest whole number.
fn rounded(x: f64) -> u32 {
    (x + 0.5) as u32
}
