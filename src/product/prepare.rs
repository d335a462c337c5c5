//! Preparing a product: BRDF x cosine at the corners of the light's cells, then leaves, then the tables above them.

use super::choose::Heaviest;
use super::corners::{Cone, respond};
use super::leaves::{FLOOR, corner_values, group_of, largest, quadrants, shorts_of, store, tilted};
use super::peak::{self, Mixture};
use super::stored::{COSINE_INCLUDED, Header, Leaves, Lengths, OF_DIVIDED, PART_ENDS, StoredLobe, WHOLE_SPHERE};
use super::{divide, share, tops};
use crate::brdf::material::MAX_LOBES;
use crate::brdf::point::{Fault, Point};
use crate::brdf::surface::Surface;
use crate::light::environment::Environment;
use crate::light::guide::{self, Column, Guide, MAX_CELLS, MAX_CORNERS, Short};
use crate::light::parts::{MIDDLES, PARTS};
use crate::numeric::exponent;
use crate::object::Magic;
use crate::simd::{Compute, GROUP, Level, Num, REGISTERS, compute, places, sum};
use crate::status::Status;
use bytemuck::{Pod, Zeroable, bytes_of, try_cast_slice_mut};

/// What a product is prepared for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// The most cells that are divided, up to [`super::stored::MAX_DIVIDED`].
    pub divided: usize,
    /// How far the normals of other hits may turn from this one, in radians.
    pub cone: f32,
    /// Whether F is bilinear in a leaf, or the mean of that: for comparison.
    pub constant: bool,
    /// How much is drawn from narrow lobes.
    pub mixture: Mixture,
}

/// Cells that are divided by default; the error hardly falls beyond.
pub const DIVIDED: usize = 8;

impl Default for Config {
    fn default() -> Config {
        Config { divided: DIVIDED, cone: 0.0, constant: false, mixture: Mixture::TUNED }
    }
}

/// Cells with less than this share of the product are not divided: what they add to the variance is small.
const WORTH: f32 = 0.015;
/// The same in a hemisphere without narrow lobes, of what differs in a cell. Variances of GGX 0.5 are 6 % less than with the share above, and
/// errors 9 % (seven maps). Elsewhere it would raise a weight of a transmitted lobe from 40 to 101 (hard cases), where few parts reflect.
const WORTH_IF_WIDE: f32 = 0.006;
/// The same if all lobes are Lambert's. So 0.2 to 1 cell is divided in the mean (six maps), which leaves at most 7 % more variance than
/// the division of the eight heaviest. With 0.015 it is twice as many, and at most 2 % more variance.
const WORTH_IF_DIFFUSE: f32 = 0.03;
/// The cosine is nearly bilinear in a cell above the horizon: its division is worth this part of its share.
const FITTED: f32 = 1.0 / 16.0;

/// No leaf that counts is darker than this share of the mean of F over all corners above the horizon.
const DARKEST: f32 = 1.0 / 1024.0;

/// The parts of a divided cell keep this part of the least value of the whole cell. Where nearly all numbers of a cell lead to a lamp that
/// reflects nothing, the sky about it would otherwise have weights of several hundred. 0.5 cost at
/// most 6 % of the error under three developer maps and a sun, 1 at most 10 %. Its effect on the largest weights is not measured.
const KEPT: f32 = 0.5;

/// Where parts that reflect nothing would take more than this part of what all others reflect, all lobes are drawn as well: a lamp below
/// the horizon, in a cell that reaches above it, leaves too few samples for the sky about it.
const WASTED: f32 = 0.25;
/// Where narrow lobes take numbers from the grid, less is enough; but not less than this.
const LITTLE_WASTED: f32 = 0.05;
/// They take at most this much, so that the rest is found; a part of the lamp may stand above the horizon.
const MOST_WASTED: f32 = 8.0;

/// What a leaf holds for 1.
const STORED_ONE: f64 = 65536.0;

/// By how much rounding may raise a cell above the horizon: that of its axis, of two numbers, and of all sums.
const ROUNDING: f32 = 4.0 * guide::ROUNDING;

/// Why a product was not prepared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PrepareError {
    /// The point is none.
    Point(Fault),
    /// The memory is too small: the bytes that are needed.
    TooSmall(usize),
    /// Anything else.
    Status(Status),
}

/// F over whole cells before it is stored.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Work {
    /// The corners of groups of cells.
    corners: [[[f32; GROUP]; 4]; MAX_CELLS / GROUP],
    /// The least that a leaf of each cell holds; 0 below the horizon.
    floors: [f32; MAX_CELLS],
    /// The weight of each cell: its light times its mean of F.
    weights: [f32; MAX_CELLS],
}

/// Prepares a product at the beginning of `memory`, aligned to 16. Answers its bytes.
///
/// # Errors
/// [`PrepareError`].
#[inline(always)]
pub fn prepare(
    level: Level,
    environment: &Environment<'_>,
    point: &Point<'_>,
    config: &Config,
    memory: &mut [u8],
) -> Result<usize, PrepareError> {
    let task = Task { level, environment, point, config };
    task.finish(task.grid_with_work(memory)?, memory)
}

/// As [`prepare`], with 3 kB of the caller's memory for its work, of any content.
///
/// # Errors
/// [`PrepareError`].
#[inline(never)]
pub fn prepare_in(
    level: Level,
    environment: &Environment<'_>,
    point: &Point<'_>,
    config: &Config,
    work: &mut Work,
    memory: &mut [u8],
) -> Result<usize, PrepareError> {
    let task = Task { level, environment, point, config };
    task.finish(task.grid(work, memory)?, memory)
}

/// What a product is prepared of.
#[derive(Clone, Copy)]
struct Task<'a> {
    level: Level,
    environment: &'a Environment<'a>,
    point: &'a Point<'a>,
    config: &'a Config,
}

/// A product whose narrow lobes draw as much as they may.
struct Prepared {
    /// Its bytes.
    bytes: usize,
    /// Whether all lobes are to be drawn, too.
    adds_lobes: bool,
}

impl Task<'_> {
    /// The product but for the share of its lobes. Its work stands on the stack no longer than it must.
    #[inline(never)]
    fn grid_with_work(self, memory: &mut [u8]) -> Result<Prepared, PrepareError> {
        self.grid(&mut Work::zeroed(), memory)
    }

    /// As [`Task::grid_with_work`], with the caller's memory. Apart, so that its stack is free again.
    #[inline(never)]
    fn grid(self, work: &mut Work, memory: &mut [u8]) -> Result<Prepared, PrepareError> {
        let Task { level, environment, point, config } = self;
        let mut surface = Surface::new(point, &environment.frame()).map_err(PrepareError::Point)?;
        let cone = Cone { cosine: libm::cosf(config.cone), sine: libm::sinf(config.cone) };
        let guide = environment.guide().ok_or(PrepareError::Status(Status::NotBuilt))?;
        let (lobes, allowed) = peak::choose(point.material, &surface, &config.mixture);
        let mirror = if allowed > 0.0 { surface.mirror() } else { [0.0; 3] };
        widen(&mut surface, environment, point, &config.mixture).map_err(PrepareError::Point)?;
        let mut stage = Stage::new(guide, &surface, (allowed, mirror), cone, config, work);
        compute(level, Evaluate { stage: &mut stage });
        let grid = environment.light().grid;
        let divided = stage.heaviest.cells().len();
        let lengths = Lengths::new(grid, divided);
        let memory = memory.get_mut(..lengths.bytes()).ok_or(PrepareError::TooSmall(lengths.bytes()))?;
        let (_, rest) = memory.split_at_mut_checked(size_of::<Header>()).unwrap_or_default();
        let (leaves, rest) = rest.split_at_mut_checked(size_of::<Leaves>() * lengths.leaves).unwrap_or_default();
        let (tops, rest) = rest.split_at_mut_checked(4 * lengths.tops).unwrap_or_default();
        let (ends, padding) = rest.split_at_mut_checked(4 * GROUP * lengths.ends).unwrap_or_default();
        padding.fill(0);
        let misaligned = PrepareError::Status(Status::Misaligned);
        let write = Write {
            stage: &mut stage,
            grid,
            leaves: try_cast_slice_mut(leaves).map_err(|_| misaligned)?,
            tops: try_cast_slice_mut(tops).map_err(|_| misaligned)?,
            ends: try_cast_slice_mut(ends).map_err(|_| misaligned)?,
        };
        let total = compute(level, write);
        let unit = if stage.any { stage.unit() / STORED_ONE } else { 0.0 };
        let power = environment.header().power;
        let product = Header {
            environment: environment.header().content_id,
            integral: integral(total, unit, power),
            unit,
            scale: scale(total),
            bytes: lengths.bytes() as u32,
            grid,
            divided: divided as u32,
            peak: allowed,
            cone: cone.cosine,
            ..Header::zeroed()
        };
        write_header(&product, &lobes, &surface, point, memory);
        Ok(Prepared { bytes: lengths.bytes(), adds_lobes: stage.adds_lobes && product.scale > 0.0 })
    }

    /// The share of the product's lobes. Answers the product's bytes.
    fn finish(self, Prepared { bytes, adds_lobes }: Prepared, memory: &mut [u8]) -> Result<usize, PrepareError> {
        let product = memory.get_mut(..bytes).unwrap_or_default();
        share::decide(self.level, self.environment, self.point, adds_lobes, product).map_err(PrepareError::Point)?;
        Ok(bytes)
    }
}

/// Writes a header for what is known of the grid and for the point. Apart, so that its stack is free again.
#[inline(never)]
fn write_header(
    grid: &Header,
    lobes: &[StoredLobe; MAX_LOBES],
    surface: &Surface,
    point: &Point<'_>,
    memory: &mut [u8],
) {
    let mut flags = if surface.is_whole() { WHOLE_SPHERE } else { 0 };
    flags |= if point.cosine_included { COSINE_INCLUDED } else { 0 };
    let header = Header {
        magic: Header::MAGIC,
        material: point.material.hash(),
        flags,
        lobes: point.material.lobes().len() as u32,
        peak: if grid.scale > 0.0 { grid.peak } else { 0.0 },
        normal: point.normal,
        wo: point.wo,
        axes: surface.axes(),
        local_wo: surface.wo(),
        lobe: *lobes,
        ..*grid
    };
    for (out, &byte) in memory.iter_mut().zip(bytes_of(&header)) {
        *out = byte;
    }
}

/// One over the integral of F in units; 0 where that is so small that its inverse is no number.
pub fn scale(total: f32) -> f32 {
    if total >= f32::MIN_POSITIVE { 1.0 / total } else { 0.0 }
}

/// The integral of a product, for that of F in units.
pub fn integral(total: f32, unit: f64, power: f64) -> f64 {
    (f64::from(total) * unit * power).min(f64::MAX)
}

/// Replaces a surface by one whose lobes are all as wide as the grid resolves. Apart, so that its stack is free again.
#[inline(never)]
fn widen(
    surface: &mut Surface,
    environment: &Environment<'_>,
    point: &Point<'_>,
    mixture: &Mixture,
) -> Result<(), Fault> {
    if let Some(material) = &peak::widened(point.material, mixture) {
        *surface = Surface::new(&Point { material, ..*point }, &environment.frame())?;
    }
    Ok(())
}

/// How F varies over a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Smoothness {
    /// As it may: some lobe is narrow, or light on both sides counts.
    Any,
    /// Slowly, above a horizon.
    Wide,
    /// As the cosine, above a horizon.
    Diffuse,
}

impl Smoothness {
    /// That of a surface, of whose numbers a share draws from narrow lobes.
    fn of(surface: &Surface, from_peak: f32) -> Smoothness {
        if surface.is_diffuse() {
            Smoothness::Diffuse
        } else if surface.is_whole() || from_peak > 0.0 {
            Smoothness::Any
        } else {
            Smoothness::Wide
        }
    }
}

/// F before it is stored.
struct Stage<'a> {
    guide: Guide<'a>,
    surface: &'a Surface,
    cone: Cone,
    heaviest: Heaviest,
    /// The mirror direction, in map space; 0 if no lobe is narrow.
    peak: [f32; 3],
    /// The share of numbers that draws from narrow lobes.
    from_peak: f32,
    constant: bool,
    /// Whether the point has lobes that can be drawn from.
    draws_lobes: bool,
    smoothness: Smoothness,
    work: &'a mut Work,
    /// The largest value of F.
    largest: f32,
    /// No leaf that counts is darker.
    darkest: f32,
    /// Whether F is above 0 anywhere; elsewhere 1 stands for it.
    any: bool,
    /// Whether all lobes are drawn, since parts that reflect nothing take too much.
    adds_lobes: bool,
    /// What such parts keep of their least value.
    kept: f32,
}

impl<'a> Stage<'a> {
    fn new(
        guide: Guide<'a>,
        surface: &'a Surface,
        (from_peak, peak): (f32, [f32; 3]),
        cone: Cone,
        config: &Config,
        work: &'a mut Work,
    ) -> Stage<'a> {
        Stage {
            guide,
            surface,
            cone,
            heaviest: Heaviest::new(config.divided),
            peak,
            from_peak,
            constant: config.constant,
            draws_lobes: surface.lobe_count() > 0,
            smoothness: Smoothness::of(surface, from_peak),
            work,
            largest: 0.0,
            darkest: 0.0,
            any: true,
            adds_lobes: false,
            kept: 1.0,
        }
    }

    /// Corners as they are stored.
    #[inline(always)]
    fn finished<F: Num>(&self, [a, b, c, d]: [F; 4], scale: F) -> [F; 4] {
        let [a, b, c, d] = [a * scale, b * scale, c * scale, d * scale];
        if self.constant { [(a + b + (c + d)) * 0.25; 4] } else { [a, b, c, d] }
    }

    /// What F is divided by: a power of two of which its largest value is 1/4 to 1/2, so that extrapolation stays below 2.
    fn unit(&self) -> f64 {
        /// So that neither this nor its inverse leaves the range of normal floats.
        const LEAST: i32 = -124;
        crate::numeric::exp2i((exponent(self.largest.into()) + 2).max(LEAST))
    }
}

/// Evaluates F everywhere, and chooses the cells that are divided.
struct Evaluate<'a, 'b> {
    stage: &'b mut Stage<'a>,
}

impl Compute for Evaluate<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<F: Num>(self) {
        let mut values = [0.0; MAX_CORNERS];
        self.stage.evaluate::<F>(&mut values);
        self.stage.lay::<F>(&values);
        self.stage.choose::<F>(&mut values);
    }
}

impl Stage<'_> {
    /// F at the corners; where it is 0 everywhere, 1.
    #[inline(always)]
    fn evaluate<F: Num>(&mut self, values: &mut [f32; MAX_CORNERS]) {
        let zero = F::splat(0.0);
        let (mut largest, mut sums, mut above) = (zero, [zero; REGISTERS], [zero; REGISTERS]);
        respond::<F>(self.surface, &self.cone, self.guide.corner_directions(), values);
        for group in values.chunks_exact(GROUP).take(self.guide.corners() / GROUP) {
            for (value, (sum, above)) in group.chunks_exact(F::WIDTH).zip(sums.iter_mut().zip(&mut above)) {
                let value = F::read(value);
                let positive = value.max(zero);
                largest = largest.max(positive);
                *sum = *sum + positive.min(F::splat(LARGEST_SUMMED));
                *above = *above + F::only(zero.lt(value), F::splat(1.0));
            }
        }
        self.largest = highest(largest);
        let (sum, above) = (sum(sums), sum(above));
        self.darkest = DARKEST * sum / above.max(1.0);
        self.any = self.darkest > 0.0;
        if !self.any {
            values.fill(1.0);
            (self.largest, self.darkest) = (1.0, 1.0);
        }
    }

    /// The leaves of whole cells, and their weights.
    #[inline(always)]
    fn lay<F: Num>(&mut self, values: &[f32; MAX_CORNERS]) {
        let zero = F::splat(0.0);
        let (quadrants, masses, cones) = (quadrants(&self.guide), self.guide.masses(), Cones::new(&self.guide));
        let Work { corners, floors, weights } = &mut *self.work;
        // Beyond the last cell.
        weights.get_mut(self.guide.cells()..).unwrap_or_default().fill(0.0);
        let kept = weights.chunks_exact_mut(GROUP).zip(floors.chunks_exact_mut(GROUP));
        let groups = corners.iter_mut().zip(kept).zip(masses);
        for (group, ((out, (weights, floors)), mass)) in groups.enumerate() {
            for first in places::<F>() {
                let counts = cones.reach::<F>(self.surface, &self.cone, group, first);
                // Where nothing counts, nothing is left of what the memory held.
                let (mut all, mut floor, mut sum) = ([zero; 4], zero, zero);
                if F::bits(counts) != 0 {
                    let corners = corner_values::<F>(&self.guide, values, group * GROUP + first);
                    floor = F::only(counts, (largest(corners) * FLOOR).max(F::splat(self.darkest)));
                    for (out, corner) in all.iter_mut().zip(tilted(&quadrants, &corners, group, first)) {
                        *out = F::only(counts, corner.max(floor));
                        sum = sum + *out;
                    }
                }
                for (out, corner) in out.iter_mut().zip(all) {
                    corner.write(out, first);
                }
                floor.write(floors, first);
                (F::at(mass, first) * sum).write(weights, first);
            }
        }
    }

    /// The least corner of cells; 0 in those that reach below the horizon.
    #[inline(always)]
    fn least_corner<F: Num>(&self, group: usize, first: usize) -> F {
        let [a, b, c, d] = self.work.corners.get(group).unwrap_or(&[[0.0; GROUP]; 4]);
        let least = F::at(a, first).min(F::at(b, first)).min(F::at(c, first).min(F::at(d, first)));
        let floor = F::at(&self.work.floors, group * GROUP + first);
        F::only(floor.lt(least), least)
    }

    /// What the division of cells may be worth, for their weights.
    #[inline(always)]
    fn worth<F: Num>(&self, weights: F, group: usize, first: usize) -> F {
        match self.smoothness {
            // The lobe may peak between corners and all that was looked at.
            Smoothness::Any => weights,
            // What is the same all over a cell is worth nothing.
            Smoothness::Wide => {
                let mass = group_of::<F>(self.guide.masses(), group, first);
                weights - F::splat(4.0) * mass * self.least_corner::<F>(group, first)
            }
            Smoothness::Diffuse => {
                let is_above = F::splat(0.0).lt(self.least_corner::<F>(group, first));
                F::select(is_above, weights * FITTED, weights)
            }
        }
    }

    /// Weighs cells again by F where their light is, if interpolation between corners may have missed it: cells with much light,
    /// and those that the peak of a narrow lobe falls into.
    #[inline(always)]
    fn look_closer<F: Num>(&mut self) {
        let mut cells = [0u32; CLOSER];
        let mut count = 0;
        let (masses, cones, is_narrow) = (self.guide.masses(), Cones::new(&self.guide), self.peak != [0.0; 3]);
        let bright = if self.smoothness == Smoothness::Diffuse { WORTH_IF_DIFFUSE } else { BRIGHT };
        for (group, masses) in masses.iter().enumerate() {
            for first in places::<F>() {
                let mut counts = F::splat(bright).lt(F::at(masses, first));
                if is_narrow {
                    counts = F::or(counts, cones.hold::<F>(self.peak, group, first));
                }
                if self.smoothness == Smoothness::Diffuse {
                    let is_below = self.least_corner::<F>(group, first).le(F::splat(0.0));
                    counts = F::and(counts, is_below);
                }
                let mut bits = F::bits(counts);
                while bits != 0 && count < CLOSER {
                    if let Some(cell) = cells.get_mut(count) {
                        *cell = (group * GROUP + first) as u32 + bits.trailing_zeros();
                    }
                    bits &= bits - 1;
                    count += 1;
                }
            }
        }
        let looked_at: &[usize] = if is_narrow { &LOOKED_AT_IF_NARROW } else { &LOOKED_AT };
        for cells in cells.get(..count).unwrap_or(&[]).chunks(GROUP) {
            let mut directions = [[0; MOST_LOOKED_AT * GROUP]; 3];
            for (lane, &cell) in cells.iter().enumerate() {
                let middles = self.guide.middles(cell as usize).map(|of| of.first_chunk().unwrap_or(&[0; MIDDLES]));
                for (out, &part) in (lane..).step_by(GROUP).zip(looked_at) {
                    for (directions, middles) in directions.iter_mut().zip(middles) {
                        if let Some(direction) = directions.get_mut(out) {
                            *direction = middles[part % MIDDLES];
                        }
                    }
                }
            }
            let mut values = [0.0; MOST_LOOKED_AT * GROUP];
            let directions = directions.each_ref().map(|column| column.get(..looked_at.len() * GROUP).unwrap_or(&[]));
            respond::<F>(self.surface, &self.cone, directions, &mut values);
            let mut largest = [0.0; GROUP];
            for values in values.chunks_exact(GROUP) {
                for (largest, &value) in largest.iter_mut().zip(values) {
                    *largest = crate::numeric::max(*largest, value);
                }
            }
            for (&cell, value) in cells.iter().zip(largest) {
                let mass = self.guide.mass(cell as usize);
                if let Some(weight) = self.work.weights.get_mut(cell as usize).filter(|weight| **weight > 0.0) {
                    *weight = crate::numeric::max(*weight, 4.0 * mass * value);
                }
            }
        }
    }

    /// Chooses the cells whose division is worth most. `room`: for a number of each cell.
    #[inline(always)]
    fn choose<F: Num>(&mut self, room: &mut [f32; MAX_CORNERS]) {
        if self.heaviest.room() == 0 || !self.any {
            return;
        }
        self.look_closer::<F>();
        let Some(left) = room.get_mut(..MAX_CELLS) else { return };
        let mut sums = [F::splat(0.0); REGISTERS];
        let groups = left.chunks_exact_mut(GROUP).zip(self.work.weights.chunks_exact(GROUP));
        for (group, (left, weights)) in groups.enumerate() {
            for (first, sum) in places::<F>().zip(&mut sums) {
                let weights = F::at(weights, first);
                *sum = *sum + weights;
                self.worth::<F>(weights, group, first).write(left, first);
            }
        }
        let share = match self.smoothness {
            Smoothness::Any => WORTH,
            Smoothness::Wide => WORTH_IF_WIDE,
            Smoothness::Diffuse => WORTH_IF_DIFFUSE,
        };
        self.heaviest.choose::<F>(left, share * sum(sums));
    }

    /// Notes the borders of the divided cells' parts, evaluates F at their middles, and keeps it where the ends of those parts will stand.
    #[inline(always)]
    fn divide<F: Num>(&mut self, ends: &mut [[f32; GROUP]]) {
        let mut largest = F::splat(self.largest);
        for (cells, ends) in self.heaviest.cells().chunks(GROUP).zip(ends.chunks_exact_mut(OF_DIVIDED)) {
            let Some((ends, borders)) = ends.split_at_mut_checked(PART_ENDS) else { break };
            divide::borders(&self.guide, cells, borders);
            if let Some(out) = ends.last_chunk_mut::<MIDDLES>() {
                // Lanes without a cell.
                *out = [[0.0; GROUP]; MIDDLES];
                divide::middles::<F>(self.surface, &self.cone, &self.guide, cells, out);
                for numbers in out.as_flattened().chunks_exact(F::WIDTH) {
                    largest = largest.max(F::read(numbers));
                }
            }
        }
        self.largest = highest(largest);
        if self.draws_lobes {
            let wasted = self.wasted::<F>(ends);
            self.adds_lobes = wasted > LITTLE_WASTED && 1.0 + wasted > (1.0 + WASTED) * (1.0 - self.from_peak);
            self.kept = (MOST_WASTED / wasted).min(1.0);
        }
    }

    /// The least value of each part of divided cells, as many as there are lanes.
    #[inline(always)]
    fn least<F: Num>(&self, cells: &[u32]) -> F {
        let of = |lane: usize| cells.get(lane).and_then(|&cell| self.work.floors.get(cell as usize)).copied();
        F::splat(self.darkest).max(F::each(|lane| of(lane).unwrap_or(0.0)) * KEPT)
    }

    /// What parts that reflect nothing would take by their least value, over what all others reflect. The weights of divided cells, which
    /// their parts will give, become 0.
    #[inline(always)]
    fn wasted<F: Num>(&mut self, ends: &[[f32; GROUP]]) -> f32 {
        let zero = F::splat(0.0);
        let (mut wasted, mut reflected, mut undivided) = ([zero; REGISTERS], [zero; REGISTERS], [zero; REGISTERS]);
        for (cells, ends) in self.heaviest.cells().chunks(GROUP).zip(ends.chunks_exact(OF_DIVIDED)) {
            let (ends, borders) = ends.split_at_checked(PART_ENDS).unwrap_or_default();
            let (rows, columns) = borders.split_at_checked(PARTS - 1).unwrap_or_default();
            let parts = ends.last_chunk::<MIDDLES>().map_or(&[][..], |middles| middles);
            let sums = wasted.iter_mut().zip(&mut reflected);
            for ((cells, first), (wasted, reflected)) in cells.chunks(F::WIDTH).zip(places::<F>()).zip(sums) {
                let mut masses = F::floats();
                for (mass, &cell) in masses.as_mut().iter_mut().zip(cells) {
                    *mass = self.guide.mass(cell as usize);
                    if let Some(weight) = self.work.weights.get_mut(cell as usize) {
                        *weight = 0.0;
                    }
                }
                let (mass, least) = (F::load(masses), self.least::<F>(cells));
                let rows = tops::widths::<F>(rows, first).into_iter().zip(columns.chunks_exact(PARTS - 1));
                for (middles, (height, columns)) in parts.chunks_exact(PARTS).zip(rows) {
                    for (middle, width) in middles.iter().zip(tops::widths::<F>(columns, first)) {
                        let (middle, mass) = (F::at(middle, first), mass * (height * width));
                        *wasted = *wasted + F::only(divide::is_wasted::<F>(middle, least), mass * least);
                        *reflected = *reflected + mass * middle.max(zero);
                    }
                }
            }
        }
        for weights in self.work.weights.chunks_exact(GROUP) {
            for (sum, weights) in undivided.iter_mut().zip(weights.chunks_exact(F::WIDTH)) {
                *sum = *sum + F::read(weights);
            }
        }
        // Of the undivided cells these are sums of four corners.
        for (useful, undivided) in reflected.iter_mut().zip(undivided) {
            *useful = undivided * 0.25 + *useful;
        }
        sum(wasted) / sum(reflected).max(f32::MIN_POSITIVE)
    }
}

/// Cells with this share of the light are looked at more closely, up to [`CLOSER`]; if all lobes are Lambert's, with [`WORTH_IF_DIFFUSE`].
const BRIGHT: f32 = 0.01;
/// The most cells that are looked at more closely.
const CLOSER: usize = 2 * GROUP;
/// The parts whose middles are looked at: opposite ones of the inner four.
const LOOKED_AT: [usize; 2] = [5, 10];
/// The same under a narrow lobe, whose flank may lie at any side of the light.
const LOOKED_AT_IF_NARROW: [usize; MOST_LOOKED_AT] = [0, 3, 6, 12, 15];
/// How many parts of a cell are looked at, at most.
const MOST_LOOKED_AT: usize = 5;

/// Values above this are not summed as they are: the sum of all corners stays finite.
const LARGEST_SUMMED: f32 = f32::MAX / (2 * MAX_CORNERS) as f32;

/// The largest of some numbers.
#[inline(always)]
fn highest<F: Num>(lanes: F) -> f32 {
    let mut highest = 0.0;
    for &x in lanes.store().as_ref() {
        highest = crate::numeric::max(highest, x);
    }
    highest
}

/// Cones that contain cells, in groups of cells.
struct Cones<'a> {
    axis: [&'a [[Short; GROUP]]; 3],
    sine: &'a [[Short; GROUP]],
    cosine: &'a [[Short; GROUP]],
}

impl<'a> Cones<'a> {
    #[inline(always)]
    fn new(guide: &Guide<'a>) -> Cones<'a> {
        let of = |column: Column| guide.groups(column, 0);
        Cones {
            axis: [of(Column::AxisX), of(Column::AxisY), of(Column::AxisZ)],
            sine: of(Column::Sine),
            cosine: of(Column::Cosine),
        }
    }

    #[inline(always)]
    fn axis<F: Num>(&self, group: usize, first: usize) -> [F; 3] {
        let [x, y, z] = self.axis;
        [shorts_of::<F>(x, group, first), shorts_of::<F>(y, group, first), shorts_of::<F>(z, group, first)]
    }

    /// Which cells reach above the horizon, as far as any normal of a cone sees it.
    #[inline(always)]
    fn reach<F: Num>(&self, surface: &Surface, cone: &Cone, group: usize, first: usize) -> F::Mask {
        let zero = F::splat(0.0);
        if surface.is_whole() {
            return F::le(zero, zero);
        }
        let [.., up] = surface.to_local(self.axis::<F>(group, first));
        let (sine, cosine) = (shorts_of::<F>(self.sine, group, first), shorts_of::<F>(self.cosine, group, first));
        let (c, s) = (F::splat(cone.cosine), F::splat(cone.sine));
        let wider = (cosine * c - sine * s).le(zero);
        let above = (zero - (sine * c + cosine * s) - ROUNDING).lt(up);
        F::or(wider, above)
    }

    /// Which cells a direction falls into, or nearly.
    #[inline(always)]
    fn hold<F: Num>(&self, [x, y, z]: [f32; 3], group: usize, first: usize) -> F::Mask {
        let [axis_x, axis_y, axis_z] = self.axis::<F>(group, first);
        let along = axis_x * x + axis_y * y + axis_z * z;
        shorts_of::<F>(self.cosine, group, first).lt(along)
    }
}

/// Writes leaves and tables. Answers the integral of F over the light's numbers, in units.
struct Write<'a, 'b> {
    stage: &'b mut Stage<'a>,
    grid: [u32; 2],
    leaves: &'b mut [Leaves],
    tops: &'b mut [f32],
    ends: &'b mut [[f32; GROUP]],
}

impl Compute for Write<'_, '_> {
    type Output = f32;

    #[inline(always)]
    fn run<F: Num>(self) -> f32 {
        let Write { stage, grid, leaves, tops, ends } = self;
        stage.divide::<F>(ends);
        let scale = F::splat((1.0 / stage.unit()) as f32);
        let (cells, masses) = (stage.guide.cells(), stage.guide.masses());
        let (whole, parts) = leaves.split_at_mut_checked(cells / GROUP).unwrap_or_default();
        for (group, (out, corners)) in whole.iter_mut().zip(&stage.work.corners).enumerate() {
            for first in places::<F>() {
                let [a, b, c, d] = corners.each_ref().map(|corner| F::at(corner, first));
                // Corners that count are above 0; half of all groups lie below the horizon.
                if F::bits(F::splat(0.0).lt(a)) == 0 {
                    for words in &mut *out {
                        words.get_mut(first..first + F::WIDTH).unwrap_or_default().fill(0);
                    }
                    continue;
                }
                let mean = store::<F>(&stage.finished([a, b, c, d], scale), out, first);
                let weight = group_of::<F>(masses, group, first) * mean;
                weight.write(&mut stage.work.weights, group * GROUP + first);
            }
        }
        let divided = stage.heaviest.cells();
        let groups = divided.chunks(GROUP).zip(parts.chunks_exact_mut(MIDDLES));
        for (group, ((cells, out), ends)) in groups.zip(ends.chunks_exact_mut(OF_DIVIDED)).enumerate() {
            let Some((ends, borders)) = ends.split_at_mut_checked(PART_ENDS) else { break };
            let mut of_cells = [0.0; GROUP];
            for first in places::<F>() {
                let (Some(middles), Some(borders)) = (ends.last_chunk(), borders.first_chunk()) else { break };
                let mut means = [F::splat(0.0); MIDDLES];
                let least = stage.least::<F>(cells.get(first..).unwrap_or(&[]));
                let kept = least * stage.kept;
                for ((index, mean), out) in means.iter_mut().enumerate().zip(&mut *out) {
                    let corners = divide::part::<F>(middles, first, [index % PARTS, index / PARTS], least, kept);
                    *mean = store::<F>(&stage.finished(corners, scale), out, first);
                }
                tops::write_parts(&means, borders, ends, first).write(&mut of_cells, first);
            }
            for ((lane, &cell), mean) in cells.iter().enumerate().zip(of_cells) {
                if let Some(weight) = stage.work.weights.get_mut(cell as usize) {
                    *weight = stage.guide.mass(cell as usize) * mean;
                }
                mark(whole, cell, group * GROUP + lane);
            }
        }
        tops.get_mut(super::stored::tops(grid)..).unwrap_or_default().fill(0.0);
        tops::write(stage.work.weights.get(..cells).unwrap_or(&[]), grid, tops)
    }
}

/// Notes in the leaf of a cell which of the divided ones it is.
fn mark(leaves: &mut [Leaves], cell: u32, number: usize) {
    let Some([a, b, ..]) = leaves.get_mut(cell as usize / GROUP) else { return };
    let lane = cell as usize % GROUP;
    a[lane] = 0;
    b[lane] = number as u16 + 1;
}
