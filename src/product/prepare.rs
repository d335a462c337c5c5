//! Preparing a product: BRDF x cosine at the corners of the light's cells becomes leaves, and tables above them.
//!
//! One pass lays the leaves of cells, weighs them, and finds those that may hide something: much light, or the peak of a narrow lobe. The
//! cells whose division is worth most get 4 x 4 parts, with F at the middle of each.

use super::peak;
use super::share;
use super::stored::{
    Corners, Divided, Header, Leaves, MAX_DIVIDED, Places, QUADS, Quad, STORED_ONE, flags, near, store, sum_parts,
    widths, write_tops,
};
use crate::blob::{Magic, take};
use crate::brdf::material::{Kind, Shape};
use crate::brdf::point::Point;
use crate::brdf::surface::{Local, Surface, replace};
use crate::brdf::vector::dot;
use crate::light::environment::Environment;
use crate::light::guide::{self, Column, Columns, Guide, MAX_CELLS, MAX_CORNERS, Short};
use crate::light::parts::{MIDDLES, PARTS};
use crate::numeric::{exp2i, exponent, max, min};
use crate::simd::{Apart, Compute, Four, GROUP, Level, Num, REGISTERS, Whole, compute, places, sum};
use crate::status::{Error, Status};
use bytemuck::{Pod, Zeroable};

/// What a product is prepared for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// The most cells that are divided, up to [`super::stored::MAX_DIVIDED`].
    pub divided: usize,
    /// How far the normals of other hits may turn from this one, in radians.
    pub cone: f32,
}

/// Cells that are divided by default; the error hardly falls beyond.
pub const DIVIDED: usize = 8;

impl Default for Config {
    fn default() -> Config {
        Config { divided: DIVIDED, cone: 0.0 }
    }
}

/// Cells with less than this share of the product are not divided: what they add to the variance is small.
const WORTH: f32 = 0.015;
/// The same where lobes draw more than [`NARROW`]. Over [`WORTH`] relative variances of GGX 0.1 are 0.97 with 16 samples and 0.94 with 64, those of GGX 0.02
/// 0.89 and 0.89 (eight maps), for 0.8 cells more.
const WORTH_IF_NARROW: f32 = 0.008;
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

/// F is evaluated at four places of each part, not at one, where narrow lobes may draw more than this: GGX 0.1 at any view, GGX 0.2 at grazing
/// ones. The variance of GGX 0.1 falls by a quarter there (eight maps). That of GGX 0.2 at other views would by 3 %, which the time outweighs.
const NARROW: f32 = 0.045;
/// Cosine and sine of how far a cell may lie from the mirror direction for that: 0.1. With 0, GGX 0.3 x 0.05 has up to 1.5 times the
/// variance (forest_slope), with 0.2 nothing differs by more than 1 %.
const BESIDE: [f32; 2] = [0.995, 0.0998];

/// Divided cells whose middles are evaluated together.
const HELD: usize = 8;

/// Directions that are raised together.
const TOGETHER: usize = 4 * GROUP;

/// No leaf that counts is darker than this share of the brightest value about it.
const FLOOR: f32 = 0.05;
/// The same where all lobes are narrow, of one width, and draw more than [`NARROW`] above a surface, but for grazing views: what they draw bounds weights,
/// too. Over [`FLOOR`] relative variances of GGX 0.1 are 0.89 with 16 samples and 0.93 with 64, those of GGX 0.05 0.84 and 0.82 (eight maps); 0.003 gains
/// no more.
const FLOOR_IF_DRAWN: f32 = 0.01;

/// The largest corner is 2^LARGEST to 2^(LARGEST + 1) where a leaf holds [`STORED_ONE`] for 1: F between corners may be 2^10 times as large, and the
/// least leaf, a 2^18th of it, is stored with all its bits.
const LARGEST: i32 = -10;

/// By how much rounding may raise a cell above the horizon, in steps: that of its axis, of two numbers, and of all sums.
const ROUNDING: f32 = 4.0;

/// Cells with this share of the light are looked at more closely, up to [`CLOSER`]; if all lobes are Lambert's, with [`WORTH_IF_DIFFUSE`].
const BRIGHT: f32 = 0.01;
/// The most cells that are looked at more closely.
const CLOSER: usize = 2 * GROUP;

/// The parts whose middles are looked at: opposite ones of the inner four.
const LOOKED_AT: [usize; 2] = [5, 10];
/// The same under a narrow lobe, whose flank may lie at any side of the light.
const LOOKED_AT_IF_NARROW: [usize; 5] = [0, 3, 6, 12, 15];

/// A part reflects nothing if F is not above 0 up to this far beyond its middle, over the way to its corners: slopes are no more than a guess, and
/// a sliver of a lamp may stand above the horizon. The largest weights of `the_sky_about_a_lamp_below_the_horizon_has_no_huge_weight` are
/// 50000 at 1.25, 59 at 1.5 to 2, and 163 at 3.
const REACH: f32 = 1.75;

/// What is known of cells before a product is finished.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Work {
    /// F at the corners.
    values: [[f32; GROUP]; MAX_CORNERS / GROUP],
    /// Groups of cells.
    cells: [Weighed; MAX_CELLS / GROUP],
}

/// What is known of a group of cells.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Weighed {
    /// The weight of each cell: its light times its mean of F.
    weight: [f32; GROUP],
    /// What its division is worth.
    worth: [f32; GROUP],
    /// The least that a leaf of it holds, above the horizon.
    floor: [f32; GROUP],
}

impl Work {
    /// Of any content. Not zeros: the compiler leaves those to a function of the C library; and by groups: single numbers it would copy.
    #[inline(always)]
    fn new() -> Work {
        let group = Weighed { weight: [0.5; GROUP], worth: [0.5; GROUP], floor: [0.5; GROUP] };
        Work { values: [[0.5; GROUP]; MAX_CORNERS / GROUP], cells: [group; MAX_CELLS / GROUP] }
    }

    /// The groups of so many cells.
    #[inline(always)]
    fn groups(&self, cells: usize) -> &[Weighed] {
        self.cells.get(..cells / GROUP).unwrap_or(&[])
    }
}

/// The group of a cell, and its place there.
#[inline(always)]
fn place_of(cell: u32) -> (usize, usize) {
    (cell as usize / GROUP % (MAX_CELLS / GROUP), cell as usize % GROUP)
}

/// What a product is prepared of.
#[derive(Clone, Copy, Debug)]
pub struct Task<'a> {
    /// What the processor has.
    pub level: Level,
    /// The light, with a guide.
    pub environment: &'a Environment<'a>,
    /// The hit.
    pub point: &'a Point<'a>,
    /// How.
    pub config: &'a Config,
}

impl Task<'_> {
    /// Prepares a product at the beginning of `memory`, aligned to 16. `work`: the caller's memory for that, of any content, or else the stack. Answers the
    /// product's bytes.
    ///
    /// # Errors
    /// [`Error`].
    #[inline(always)]
    pub fn prepare(self, work: Option<&mut Work>, memory: &mut [u8]) -> Result<usize, Error> {
        // Lobes of rays are wide: their trials are not worth a tenth more code.
        let level = if work.is_some() { Level::BASELINE } else { self.level };
        // In place: a surface is long.
        let mut surface = Surface::empty();
        surface.set(self.point, &self.environment.frame())?;
        let (bytes, adds_lobes) = match work {
            Some(work) => self.grid(&surface, work, memory)?,
            None => self.grid_with_work(&surface, memory)?,
        };
        let product = memory.get_mut(..bytes).unwrap_or_default();
        // The share of its lobes.
        share::decide(level, self.environment, &surface, adds_lobes, product);
        Ok(bytes)
    }

    /// As [`Task::grid`]. Its work stands on the stack no longer than it must.
    #[inline(never)]
    fn grid_with_work(self, surface: &Surface, memory: &mut [u8]) -> Result<(usize, bool), Error> {
        self.grid(surface, &mut Work::new(), memory)
    }

    /// The product, whose narrow lobes draw as much as they may. Answers its bytes, and whether all lobes are to be drawn, too.
    #[inline(never)]
    fn grid(self, surface: &Surface, work: &mut Work, memory: &mut [u8]) -> Result<(usize, bool), Error> {
        let Task { level, environment, point, config } = self;
        let guide = environment.guide().ok_or(Error::new(Status::NotBuilt, 0))?;
        let (grid, power) = (environment.header().grid, environment.header().power);
        let too_small = |divided| Error::too_small(0, Places::new(grid, divided).bytes());
        let places = Places::new(grid, 0);
        if memory.len() < places.bytes() {
            return Err(too_small(0));
        }
        let mut rest = memory;
        let misaligned = Error::new(Status::Misaligned, 0);
        let header = take::<Header>(&mut rest, 1).and_then(|of| of.first_mut()).ok_or(misaligned)?;
        // Lobes are written in place, since they are long.
        header.lobe = Default::default();
        let allowed = peak::choose(point.material, surface, &mut header.lobe);
        let peak = if allowed > 0.0 { surface.mirror() } else { [0.0; 3] };
        let mut wider = Surface::empty();
        let is_widened = widen(environment, point, surface.wo()[2], &mut wider)?;
        let cone = Cone::new(config.cone);
        let seen = if is_widened { &wider } else { surface };
        // Elsewhere the floor is part of what keeps weights below 50 integrals, through glass and beside wide lobes, and the stated integral of long
        // lobes near.
        let is_round = |lobe: &Shape| lobe.kind != Kind::Ggx || lobe.a == lobe.b;
        let is_drawn = allowed > NARROW
            && !surface.is_whole()
            && surface.wo()[2] > peak::GRAZING
            && point.material.lobes().iter().zip(&header.lobe).all(|(shape, lobe)| lobe.share > 0.0 && is_round(shape));
        let stage = Stage {
            guide,
            surface: seen,
            cone: &cone,
            diffuse: seen.diffuse().filter(|_| cone.sine == 0.0),
            peak,
            from_peak: allowed,
            // A lobe that was widened has another integral at grazing views: the stated one is nearer without.
            varies: allowed > NARROW && (!is_widened || surface.wo()[2] > peak::GRAZING),
            floor: if is_drawn { FLOOR_IF_DRAWN } else { FLOOR },
            smoothness: Smoothness::of(seen, allowed),
            work,
            closer: [0; CLOSER],
            count: 0,
            weight: 0.0,
            missed: 0.0,
            scale: [1.0; 2],
            darkest: 1.0,
        };
        let leaves = take(&mut rest, guide.cells() / GROUP).ok_or(misaligned)?;
        let tops = take(&mut rest, places.divided - places.tops).ok_or(misaligned)?;
        let laid = compute(level, Lay { stage, room: config.divided.min(MAX_DIVIDED), grid, leaves, tops, rest });
        let Laid { total, unit, divided, adds_lobes } = laid.map_err(too_small)?;
        let scale = scale(total);
        let bytes = Places::new(grid, divided).bytes();
        header.magic = Header::MAGIC;
        header.environment = environment.header().content_id;
        header.checksum = 0;
        header.material = point.material.hash();
        header.integral = integral(total, unit, power);
        header.unit = unit;
        header.scale = scale;
        header.bytes = bytes as u32;
        header.grid = grid;
        header.divided = divided as u32;
        header.flags = flags(surface.is_whole(), point.cosine_included);
        header.lobes = point.material.lobes().len() as u32;
        header.peak = if scale > 0.0 { allowed } else { 0.0 };
        header.cone = cone.cosine;
        header.normal = point.normal;
        header.wo = point.wo;
        header.axes = surface.axes();
        header.local_wo = surface.wo();
        header.reserved = [0; 5];
        Ok((bytes, adds_lobes && scale > 0.0))
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

/// Makes an empty surface one whose lobes are all as wide as the grid resolves, if they are not. Apart, so that its stack is free again.
#[inline(never)]
fn widen(environment: &Environment<'_>, point: &Point<'_>, cosine: f32, out: &mut Surface) -> Result<bool, Error> {
    let Some(material) = &peak::widened(point.material, cosine) else { return Ok(false) };
    out.set(&Point { material, ..*point }, &environment.frame())?;
    Ok(true)
}

/// How F varies over a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Smoothness {
    /// As it may: some lobe is narrow, or light on both sides counts.
    Any,
    /// As it may, and lobes draw more than [`NARROW`].
    Narrow,
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
        } else if from_peak > NARROW {
            Smoothness::Narrow
        } else if surface.is_whole() || from_peak > 0.0 {
            Smoothness::Any
        } else {
            Smoothness::Wide
        }
    }

    /// The least share of what division is worth in all cells for which a cell is divided, and the share of the light from which on it is looked at more
    /// closely.
    fn thresholds(self) -> (f32, f32) {
        match self {
            Smoothness::Any => (WORTH, BRIGHT),
            Smoothness::Narrow => (WORTH_IF_NARROW, BRIGHT),
            Smoothness::Wide => (WORTH_IF_WIDE, BRIGHT),
            Smoothness::Diffuse => (WORTH_IF_DIFFUSE, WORTH_IF_DIFFUSE),
        }
    }

    /// What the division of cells may be worth, for their weights, shares of the light, and least corners where all corners are above the horizon.
    #[inline(always)]
    fn worth<F: Num>(self, weight: F, mass: F, least: F) -> F {
        match self {
            // The lobe may peak between corners and all that was looked at.
            Smoothness::Any | Smoothness::Narrow => weight,
            // What is the same all over a cell is worth nothing.
            Smoothness::Wide => weight - mass * least,
            Smoothness::Diffuse => F::select(F::splat(0.0).lt(least), weight * FITTED, weight),
        }
    }
}

/// How far normals of other hits may lie from this one, for which cosines are widened.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cone {
    /// The cosine of its half-angle; 1: this normal only.
    cosine: f32,
    /// The sine of its half-angle.
    sine: f32,
}

impl Cone {
    fn new(angle: f32) -> Cone {
        if angle == 0.0 {
            Cone { cosine: 1.0, sine: 0.0 }
        } else {
            Cone { cosine: libm::cosf(angle), sine: libm::sinf(angle) }
        }
    }
}

/// Evaluates the luminance of BRDF x cosine in directions of map space, a whole number of registers of them; below the horizon of a
/// hemisphere it goes on with negative sign, as if mirrored.
///
/// A cell that crosses the horizon would otherwise waste samples below: interpolation between corners that are clamped at 0
/// reaches 0 at the lower corners only.
struct Respond<'a> {
    surface: &'a Surface,
    /// See [`Surface::diffuse`]; `None` if normals may turn.
    diffuse: Option<f32>,
    /// By which directions are raised.
    cone: Option<Cone>,
    /// What values are multiplied by: twice, since once might leave the range of floats.
    scale: [f32; 2],
    directions: [&'a [Short]; 3],
    out: &'a mut [f32],
}

impl<F: Num> Apart<F> for Respond<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Respond { surface, diffuse, cone, scale, directions, out } = self;
        // Directions are whole numbers of steps.
        let raised = Raised { axes: surface.axes().map(|axis| axis.map(|x| x * guide::ROUNDING)), cone };
        if let Some(albedo) = diffuse {
            replace(directions, out, |_: F, [x, y, z]| {
                dot([F::shorts(x), F::shorts(y), F::shorts(z)], raised.axes[2]) * albedo * scale[0] * scale[1]
            });
            return;
        }
        surface.values::<F, Raised>(directions, out, &raised, scale);
    }
}

impl Respond<'_> {
    /// Evaluates it for the nearest of the normals of a cone, too.
    #[inline(always)]
    fn nearest<F: Num>(self, cone: &Cone) {
        if cone.sine > 0.0 {
            return self.raised::<F>(cone);
        }
        F::apart(self);
    }

    /// As [`Respond::nearest`], of more than one normal.
    #[inline(never)]
    fn raised<F: Num>(self, cone: &Cone) {
        let Respond { surface, diffuse, scale, directions, out, .. } = self;
        F::apart(Respond { surface, diffuse, cone: None, scale, directions, out });
        let [x, y, z] = directions.map(|axis| axis.chunks(TOGETHER));
        for (((x, y), z), out) in x.zip(y).zip(z).zip(out.chunks_mut(TOGETHER)) {
            let mut raised = [0.5; TOGETHER];
            let raised = raised.get_mut(..out.len()).unwrap_or_default();
            F::apart(Respond { surface, diffuse, cone: Some(*cone), scale, directions: [x, y, z], out: raised });
            out.iter_mut().zip(raised).for_each(|(out, raised)| *out = max(*out, *raised));
        }
    }
}

/// Directions along the axes of a surface, raised by a cone.
struct Raised {
    /// Over the steps of 1.
    axes: [[f32; 3]; 3],
    cone: Option<Cone>,
}

impl<F: Num> Local<F> for Raised {
    type Given = Short;

    #[inline(always)]
    fn local(&self, [x, y, z]: [&[Short]; 3]) -> [F; 3] {
        let (d, [t, b, n]) = ([F::shorts(x), F::shorts(y), F::shorts(z)], self.axes);
        let w = [dot(d, t), dot(d, b), dot(d, n)];
        match &self.cone {
            None => w,
            Some(cone) => raised(cone, w),
        }
    }
}

/// A direction turned towards the normal by the cone's half-angle, at most onto it: so the cosine is that to the nearest normal of
/// the cone.
#[inline(always)]
fn raised<F: Num>(cone: &Cone, [x, y, z]: [F; 3]) -> [F; 3] {
    let (zero, one) = (F::splat(0.0), F::splat(1.0));
    let (cosine, sine) = (F::splat(cone.cosine), F::splat(cone.sine));
    let across = (x * x + y * y).sqrt();
    let inside = cosine.le(z);
    let up = F::select(inside, one, z * cosine + across * sine);
    let out = F::select(inside, zero, (across * cosine - z * sine).max(zero));
    let scale = out / across.max(F::splat(f32::MIN_POSITIVE));
    [x * scale, y * scale, up]
}

/// A number of the cells from place `first` of a group on, in steps; of `further` columns behind it.
#[inline(always)]
fn column<F: Num>(columns: &Columns, column: Column, further: usize, first: usize) -> F {
    F::shorts(columns.get(column as usize + further).and_then(|of| of.get(first..)).unwrap_or(&[]))
}

/// Cones that contain cells, from a place of a group on, in steps: they are compared alone.
struct Cones<F> {
    axis: [F; 3],
    sine: F,
    cosine: F,
}

impl<F: Num> Cones<F> {
    #[inline(always)]
    fn new(columns: &Columns, first: usize) -> Cones<F> {
        let of = |which: Column| column(columns, which, 0, first);
        let axis = [of(Column::AxisX), of(Column::AxisY), of(Column::AxisZ)];
        Cones { axis, sine: of(Column::Sine), cosine: of(Column::Cosine) }
    }

    /// Which cells reach above the horizon, as far as any normal of a cone sees it. `below`: how far below.
    #[inline(always)]
    fn reach(&self, normal: [F; 3], below: F, cone: Cone) -> F::Mask {
        let (mut sine, mut cosine) = (self.sine, self.cosine);
        if cone.sine > 0.0 {
            let (c, s) = (F::splat(cone.cosine), F::splat(cone.sine));
            (sine, cosine) = (self.sine * c + self.cosine * s, self.cosine * c - self.sine * s);
        }
        let [x, y, z] = self.axis;
        let above = (below - sine).lt(x * normal[0] + y * normal[1] + z * normal[2]);
        F::or(cosine.le(F::splat(0.0)), above)
    }

    /// Which cells a direction falls into, or nearly.
    #[inline(always)]
    fn hold(&self, direction: [f32; 3]) -> F::Mask {
        self.cosine.lt(dot(self.axis, direction))
    }
}

/// The values at the corners of the cells from `first` on, from those of all corners: the light's four directions.
#[inline(always)]
fn corner_values<F: Num>(guide: &Guide<'_>, values: &[f32], first: usize) -> Corners<F> {
    const BELOW: usize = 17;
    const BELOW_IN_FACE: usize = 5;
    if guide.row_length() > 4 {
        // There is one face: a row of corners has one more than one of cells.
        let row = first >> (guide.row_length().trailing_zeros() & 31);
        let values = values.get(first + row..).and_then(|values| values.first_chunk());
        let values = values.unwrap_or(&[0.0; BELOW + 1 + GROUP]);
        return [F::at(values, 0), F::at(values, 1), F::at(values, BELOW), F::at(values, BELOW + 1)];
    }
    // Rows have four cells, so that each half of the lanes lies in one.
    let mut corners = [F::floats(); 4];
    for half in 0..F::WIDTH / 4 {
        let values = values.get(guide.corner_of(first + 4 * half)..).and_then(|values| values.first_chunk());
        let values = values.unwrap_or(&[0.0; BELOW_IN_FACE + 1 + 4]);
        for (lanes, further) in corners.iter_mut().zip([0, 1, BELOW_IN_FACE, BELOW_IN_FACE + 1]) {
            for (out, &x) in lanes.as_mut().iter_mut().skip(4 * half).zip(values.iter().skip(further).take(4)) {
                *out = x;
            }
        }
    }
    let [a, b, c, d] = corners;
    [F::load(a), F::load(b), F::load(c), F::load(d)]
}

/// F over the numbers of the cells from place `first` of a group on: interpolated to where the light of each quadrant is, and extrapolated to the corners.
#[inline(always)]
fn tilted<F: Num>(columns: &Columns, [a, b, c, d]: &Corners<F>, first: usize) -> Corners<F> {
    let (upper, lower) = ((*b - *a) * guide::ROUNDING, (*d - *c) * guide::ROUNDING);
    let mut at = [*a; 4];
    for (quadrant, out) in at.iter_mut().enumerate() {
        let across = column::<F>(columns, Column::Across, quadrant, first);
        let (top, bottom) = (*a + upper * across, *c + lower * across);
        *out = top + (bottom - top) * (column::<F>(columns, Column::Down, quadrant, first) * guide::ROUNDING);
    }
    extrapolated(at)
}

/// The corners of a bilinear function from its values at the middles of the quadrants.
#[inline(always)]
fn extrapolated<F: Num>([a, b, c, d]: [F; 4]) -> Corners<F> {
    let half = F::splat(0.5);
    let apart = |low: F, high: F| {
        let step = half * (high - low);
        [low - step, high + step]
    };
    let ([a, b], [c, d]) = (apart(a, b), apart(c, d));
    let ([a, c], [b, d]) = (apart(a, c), apart(b, d));
    [a, b, c, d]
}

/// F that is nowhere below a least value or that share of its largest corner, and about so large in the mean as it was: steeper corners come nearer to the mean.
#[inline(always)]
fn fitted<F: Num>(quadrants: [F; 4], least: F, floor: f32) -> Corners<F> {
    let zero = F::splat(0.0);
    let corners = extrapolated(quadrants);
    let mean_of = |[a, b, c, d]: [F; 4]| (a + b + c + d) * 0.25;
    let (mean, middle) = (mean_of(quadrants.map(|x| x.max(zero))).max(least), mean_of(corners));
    let floor = (largest(corners) * floor).max(least).min(mean);
    let lowest = corners[0].min(corners[1]).min(corners[2].min(corners[3]));
    let kept = ((mean - floor) / (middle - lowest).max(F::splat(f32::MIN_POSITIVE))).min(F::splat(1.0));
    corners.map(|x| mean + kept * (x - middle))
}

/// The largest of four.
#[inline(always)]
fn largest<F: Num>([a, b, c, d]: [F; 4]) -> F {
    a.max(b).max(c.max(d))
}

/// The cells whose division is worth most; of equal ones the first: the bits of what it is worth, then those of the cell's number,
/// inverted. 0: no cell.
type Chosen = [u64; MAX_DIVIDED];

/// Whether a part reflects so little at its middle that most of its least value is wasted.
#[inline(always)]
fn is_wasted<F: Num>(middle: F, least: F) -> F::Mask {
    middle.lt(F::splat(0.5) * least)
}

/// F at the middles of the parts of a cell, with as many numbers on both sides as a row has parts.
type Middles = [f32; PARTS + MIDDLES + PARTS];

/// Columns and rows of the parts of a cell from part `first` on, a whole number of rows.
#[inline(always)]
fn places_of<F: Num>(first: usize) -> [F; 2] {
    const { assert!(F::WIDTH % PARTS == 0) };
    let row = F::each(|lane| (lane / PARTS) as f32) + (first / PARTS) as f32;
    [F::each(|lane| (lane % PARTS) as f32), row]
}

/// How a number changes from the middles to the borders of the parts of a cell from part `first` on, along columns and rows.
#[inline(always)]
fn half_slopes<F: Num>(at: impl Fn(usize) -> F, [column, row]: [F; 2]) -> [F; 2] {
    let value = at(PARTS);
    [half_slope::<F>(at(PARTS - 1), value, at(PARTS + 1), column), half_slope::<F>(at(0), value, at(2 * PARTS), row)]
}

/// F at the corners of the parts of a cell from part `first` on: the middle's value with the slopes to its neighbours. Then the least value
/// there: `kept` where nothing is reflected, also not beside the part.
#[inline(always)]
fn parts_from<F: Num>(middles: &Middles, first: usize, place: [F; 2], least: F, kept: F) -> (Corners<F>, F) {
    let at = |further: usize| F::at(middles, first + further);
    let value = at(PARTS);
    let [across, down] = half_slopes(at, place);
    let highest = value + F::splat(REACH) * (across.abs() + down.abs());
    let is_dark = F::and(is_wasted::<F>(value, least), highest.le(F::splat(0.0)));
    (beside(value, [across, down]), F::select(is_dark, kept, least))
}

/// A number at the corners of a rectangle, for that in its middle and by how much it changes from there to the right and down.
#[inline(always)]
fn beside<F: Num>(middle: F, [across, down]: [F; 2]) -> [F; 4] {
    let (left, right) = (middle - across, middle + across);
    [left - down, right - down, left + down, right + down]
}

/// Half the slope over a part: at either end of a cell to the only neighbour; elsewhere the mean of both, but at most twice the smaller,
/// so that a jump on one side does not overshoot on the other (van Leer 1977).
#[inline(always)]
fn half_slope<F: Num>(before: F, value: F, behind: F, place: F) -> F {
    let (zero, last) = (F::splat(0.0), F::splat(PARTS as f32 - 1.0));
    let (left, right) = (value - before, behind - value);
    let (left, right) = (F::select(place.le(zero), right, left), F::select(last.le(place), left, right));
    // One of the two limits is 0.
    ((left + right) * 0.25).min(left.min(right).max(zero)).max(left.max(right).min(zero))
}

/// F before it is stored, in the unit of what leaves hold.
struct Stage<'a> {
    guide: Guide<'a>,
    surface: &'a Surface,
    cone: &'a Cone,
    /// See [`Surface::diffuse`]; `None` if normals may turn.
    diffuse: Option<f32>,
    /// The mirror direction, in map space; 0 if no lobe is narrow.
    peak: [f32; 3],
    /// The share of numbers that draws from narrow lobes.
    from_peak: f32,
    /// Whether a lobe varies inside the parts of a cell.
    varies: bool,
    /// [`FLOOR`] or [`FLOOR_IF_DRAWN`].
    floor: f32,
    smoothness: Smoothness,
    work: &'a mut Work,
    /// Cells that were looked at more closely.
    closer: [u32; CLOSER],
    count: usize,
    /// What all cells weigh.
    weight: f32,
    /// What the weights of those lack if F is everywhere as large as there.
    missed: f32,
    /// What F is multiplied by: twice, since once might leave the range of floats.
    scale: [f32; 2],
    /// No leaf that counts is darker.
    darkest: f32,
}

/// What was laid.
struct Laid {
    /// The integral of F over the light's numbers, in units.
    total: f32,
    /// What F is for 1 in a leaf; 0 if it is 0 everywhere.
    unit: f64,
    divided: usize,
    /// Whether all lobes are drawn, since parts that reflect nothing take too much.
    adds_lobes: bool,
}

/// Writes leaves and tables.
struct Lay<'a, 'b> {
    stage: Stage<'a>,
    /// The most cells that are divided.
    room: usize,
    grid: [u32; 2],
    leaves: &'b mut [Leaves],
    tops: &'b mut [Quad],
    /// The memory behind those.
    rest: &'b mut [u8],
}

impl Compute for Lay<'_, '_> {
    /// If the memory is too small, how many cells are to be divided.
    type Output = Result<Laid, usize>;

    #[inline(always)]
    fn run<F: Num>(self) -> Result<Laid, usize> {
        let Lay { mut stage, room, grid, leaves, tops, mut rest } = self;
        let unit = stage.evaluate::<F>();
        stage.lay::<F>(leaves);
        let mut chosen: Chosen = [0; MAX_DIVIDED];
        if room > 0 && unit > 0.0 {
            if stage.peak == [0.0; 3] {
                stage.look_closer::<F, _>(LOOKED_AT);
            } else {
                stage.look_closer::<F, _>(LOOKED_AT_IF_NARROW);
            }
            stage.choose::<F>(chosen.get_mut(..room).unwrap_or_default());
        }
        let count = chosen.iter().take_while(|&&key| key > 0).count();
        let cells = chosen.map(|key| !(key as u32));
        let cells = cells.get(..count).unwrap_or(&[]);
        let mut adds_lobes = false;
        if !cells.is_empty() {
            let divided = take::<Divided>(&mut rest, cells.len()).ok_or(cells.len())?;
            let borders = (QUADS * cells.len()).next_multiple_of(2);
            let borders = take::<[Short; 4]>(&mut rest, borders).ok_or(cells.len())?;
            let wasted = stage.hold::<F>(cells, divided, borders);
            let mut kept = 1.0;
            if stage.surface.lobe_count() > 0 {
                adds_lobes = wasted > LITTLE_WASTED && 1.0 + wasted > (1.0 + WASTED) * (1.0 - stage.from_peak);
                kept = min(MOST_WASTED / wasted, 1.0);
            }
            stage.divide::<F>(cells, kept, divided, borders);
            for (number, &cell) in (1..).zip(cells) {
                mark(leaves, cell, number);
            }
        }
        let weights = stage.work.groups(stage.guide.cells()).iter().map(|group| &group.weight);
        Ok(Laid { total: write_tops::<F>(weights, grid, tops), unit, divided: cells.len(), adds_lobes })
    }
}

/// Notes in the leaf of a cell which of the divided ones it is.
fn mark(leaves: &mut [Leaves], cell: u32, number: u32) {
    let Some([upper, lower]) = leaves.get_mut(cell as usize / GROUP) else { return };
    let lane = cell as usize % GROUP;
    (upper[lane], lower[lane]) = (number << 16, 0);
}

impl Stage<'_> {
    /// F at the corners. Answers what F is for 1 in a leaf; where F is 0 everywhere, 0, and 1 stands for F.
    #[inline(always)]
    fn evaluate<F: Num>(&mut self) -> f64 {
        let zero = F::splat(0.0);
        let Stage { guide, surface, diffuse, scale, cone, .. } = *self;
        let values = self.work.values.as_flattened_mut().get_mut(..guide.corners()).unwrap_or_default();
        let directions = guide.corner_directions();
        Respond { surface, diffuse, cone: None, scale, directions, out: values }.nearest::<F>(cone);
        let mut largest = zero;
        for group in values.chunks_exact(F::WIDTH) {
            largest = largest.max(F::read(group));
        }
        let largest = largest.store().as_ref().iter().fold(0.0, |largest, &x| max(largest, x));
        if !(largest > 0.0) {
            self.work.values = [[1.0; GROUP]; MAX_CORNERS / GROUP];
            return 0.0;
        }
        let unit = exponent(largest.into()) - LARGEST - exponent(STORED_ONE.into());
        self.scale = [exp2i(-unit / 2) as f32, exp2i(-unit - -unit / 2) as f32];
        let (mut sums, mut above) = ([zero; REGISTERS], [zero; REGISTERS]);
        for group in values.chunks_exact_mut(GROUP) {
            for (value, (sum, above)) in group.chunks_exact_mut(F::WIDTH).zip(sums.iter_mut().zip(&mut above)) {
                let scaled = F::read(value) * self.scale[0] * self.scale[1];
                value.copy_from_slice(scaled.store().as_ref());
                *sum = *sum + scaled.max(zero);
                *above = *above + F::only(zero.lt(scaled), F::splat(1.0));
            }
        }
        self.darkest = DARKEST * sum(sums) / sum(above).max(1.0);
        exp2i(unit)
    }

    /// The leaves of whole cells, what they weigh and what their division is worth, and which are to be looked at more closely.
    #[inline(always)]
    fn lay<F: Num>(&mut self, leaves: &mut [Leaves]) {
        let zero = F::splat(0.0);
        let (_, bright) = self.smoothness.thresholds();
        let (smoothness, cone, darkest) = (self.smoothness, *self.cone, F::splat(self.darkest));
        let normal = self.surface.normal().map(F::splat);
        let below = F::splat(if self.surface.is_whole() { f32::NEG_INFINITY } else { -ROUNDING });
        let (is_narrow, is_diffuse) = (self.peak != [0.0; 3], self.smoothness == Smoothness::Diffuse);
        let guide = self.guide;
        let mut sums = [zero; REGISTERS];
        let Work { values, cells } = &mut *self.work;
        let groups = leaves.iter_mut().zip(guide.columns()).zip(guide.masses()).zip(cells);
        for (group, (((out, columns), mass), cells)) in groups.enumerate() {
            for (first, sum) in places::<F>().zip(&mut sums) {
                let at = group * GROUP + first;
                let cones = Cones::<F>::new(columns, first);
                let counts = cones.reach(normal, below, cone);
                if F::bits(counts) == 0 {
                    for out in &mut *out {
                        out.get_mut(first..first + F::WIDTH).unwrap_or_default().copy_from_slice(F::ints().as_ref());
                    }
                    zero.write(&mut cells.weight, first);
                    zero.write(&mut cells.worth, first);
                    // Nobody reads it, but work of callers has the same bytes at every level, and whatever it held.
                    zero.write(&mut cells.floor, first);
                    continue;
                }
                let mass = F::at(mass, first);
                let mut closer = F::splat(bright).lt(mass);
                if is_narrow {
                    closer = F::or(closer, cones.hold(self.peak));
                }
                let corners = corner_values::<F>(&guide, values.as_flattened(), at);
                let floor = (largest(corners) * self.floor).max(darkest);
                let [a, b, c, d] = tilted(columns, &corners, first);
                let corners = [a.max(floor), b.max(floor), c.max(floor), d.max(floor)];
                let mean = store(&corners, |x| F::only(counts, x), out, first);
                let least = corners[0].min(corners[1]).min(corners[2].min(corners[3]));
                let least = F::only(F::and(counts, floor.lt(least)), least);
                let weight = mass * mean;
                *sum = *sum + weight;
                weight.write(&mut cells.weight, first);
                smoothness.worth(weight, mass, least).write(&mut cells.worth, first);
                F::only(counts, floor).write(&mut cells.floor, first);
                if is_diffuse {
                    closer = F::and(closer, least.le(zero));
                }
                let mut bits = F::bits(F::and(closer, counts));
                while bits != 0 {
                    if let Some(out) = self.closer.get_mut(self.count) {
                        *out = at as u32 + bits.trailing_zeros();
                        self.count += 1;
                    }
                    bits &= bits - 1;
                }
            }
        }
        self.weight = sum(sums);
    }

    /// F in directions of map space.
    #[inline(always)]
    fn respond<F: Num>(&self, directions: [&[Short]; 3], out: &mut [f32]) {
        let Stage { surface, diffuse, scale, cone, .. } = *self;
        Respond { surface, diffuse, cone: None, scale, directions, out }.nearest::<F>(cone);
    }

    /// Whether a lobe that varies inside the parts of a cell mirrors into it, or beside it.
    #[inline(always)]
    fn is_near(&self, cell: u32) -> bool {
        let (group, lane) = (cell as usize / GROUP, cell as usize % GROUP);
        let columns = self.guide.columns().get(group).filter(|_| self.varies);
        let [cosine, sine] = BESIDE;
        columns.is_some_and(|columns| {
            let cone = Cones::<f32>::new(columns, lane);
            cone.cosine * cosine - cone.sine * sine < dot(cone.axis, self.peak)
        })
    }

    /// Weighs cells again by F at some of their parts, since interpolation between corners may have missed where their light is.
    #[inline(always)]
    fn look_closer<F: Num, const N: usize>(&mut self, looked_at: [usize; N]) {
        let cells = self.closer.get(..self.count).unwrap_or(&[]);
        if cells.is_empty() {
            return;
        }
        let (mut directions, mut values) = ([[[1; N]; CLOSER]; 3], [[0.5; N]; CLOSER]);
        let [x, y, z] = &mut directions;
        for (&cell, ((x, y), z)) in cells.iter().zip(x.iter_mut().zip(y).zip(z)) {
            let parts = self.guide.parts(cell as usize);
            let [of_x, of_y, of_z] =
                [0, 1, 2].map(|axis: usize| looked_at.map(|part| parts[MIDDLES * axis + part % MIDDLES]));
            (*x, *y, *z) = (of_x, of_y, of_z);
        }
        let count = (N * cells.len()).next_multiple_of(GROUP);
        let directions = directions.each_ref().map(|of| of.as_flattened().get(..count).unwrap_or(&[]));
        self.respond::<F>(directions, values.as_flattened_mut().get_mut(..count).unwrap_or_default());
        for (&cell, values) in cells.iter().zip(&values) {
            let most = values.iter().fold(0.0, |most, &x| max(most, x));
            let (group, lane) = place_of(cell);
            let group = &mut self.work.cells[group];
            let missed = max(self.guide.mass(cell as usize) * most - group.weight[lane], 0.0);
            group.worth[lane] += missed;
            self.missed += missed;
        }
    }

    /// Chooses the cells whose division is worth most.
    #[inline(always)]
    fn choose<F: Num>(&self, chosen: &mut [u64]) {
        /// Groups of cells whose worth is compared before some are chosen.
        const SIDE_BY_SIDE: usize = 64 / GROUP;
        let (share, _) = self.smoothness.thresholds();
        let least = F::splat(share * (self.weight + self.missed));
        let (mut count, mut below) = (0, 0);
        for (first, groups) in
            (0..).step_by(SIDE_BY_SIDE).zip(self.work.groups(self.guide.cells()).chunks(SIDE_BY_SIDE))
        {
            let mut bits = 0;
            for group in groups.iter().rev() {
                for worth in group.worth.chunks_exact(F::WIDTH).rev() {
                    bits = bits << F::WIDTH | u64::from(F::bits(least.lt(F::read(worth))));
                }
            }
            while bits != 0 {
                let cell = (GROUP * first) as u32 + bits.trailing_zeros();
                bits &= bits - 1;
                let (group, lane) = place_of(cell);
                let key = u64::from(self.work.cells[group].worth[lane].to_bits()) << 32 | u64::from(!cell);
                if let Some(place) = chosen.get_mut(count) {
                    *place = key;
                    count += 1;
                } else if below < key {
                    // What is left is not less than the least was.
                    let Some(least) = chosen.iter_mut().min() else { return };
                    below = *least;
                    *least = key.max(*least);
                }
            }
        }
    }

    /// Keeps F at the middles of the parts of divided cells where their leaves will stand, and writes the borders of the parts. Answers what parts that
    /// reflect nothing would take by their least value, over what all others reflect.
    #[inline(always)]
    fn hold<F: Num>(&mut self, cells: &[u32], divided: &mut [Divided], borders: &mut [[Short; 4]]) -> f32 {
        if let Some(last) = borders.last_mut() {
            *last = [0; 4];
        }
        // At least what other cells reflect, and at most what parts may take.
        let (mut others, mut taken) = (0.99 * self.weight, 0.0);
        for ((cells, divided), borders) in
            cells.chunks(HELD).zip((*divided).chunks_mut(HELD)).zip((*borders).chunks_mut(HELD * QUADS))
        {
            let (mut directions, mut values) = ([[[1; MIDDLES]; HELD]; 3], [[0.5; MIDDLES]; HELD]);
            for (lane, &cell) in cells.iter().enumerate() {
                for (out, middles) in directions.iter_mut().zip(self.guide.middles(cell as usize)) {
                    out[lane % HELD] = *middles.first_chunk().unwrap_or(&[1; MIDDLES]);
                }
            }
            let values_of = values.as_flattened_mut().get_mut(..MIDDLES * cells.len()).unwrap_or_default();
            self.respond::<F>(directions.each_ref().map(|axis| axis.as_flattened()), values_of);
            for (((&cell, divided), values), borders) in
                cells.iter().zip(divided).zip(&values).zip(borders.chunks_exact_mut(QUADS))
            {
                held_mut(divided).copy_from_slice(values);
                let (least, mut wasted) = (self.least(cell), 0);
                for middles in values.chunks_exact(F::WIDTH) {
                    wasted |= F::bits(is_wasted::<F>(F::read(middles), F::splat(least)));
                }
                if wasted != 0 {
                    taken += self.guide.mass(cell as usize) * least;
                }
                let (group, lane) = place_of(cell);
                others -= self.work.cells[group].weight[lane];
                let [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o] = *self.guide.steps(cell as usize);
                if let Some(out) = borders.first_chunk_mut() {
                    *out = [[a, b, c, 0], [d, e, f, 0], [g, h, i, 0], [j, k, l, 0], [m, n, o, 0]];
                }
            }
        }
        if taken <= LITTLE_WASTED * others { 0.0 } else { self.wasted::<F>(cells, divided, borders) }
    }

    /// What [`Stage::hold`] answers where a part of some cell reflects nothing.
    #[inline(always)]
    fn wasted<F: Num>(&mut self, cells: &[u32], divided: &[Divided], borders: &[[Short; 4]]) -> f32 {
        let zero = F::splat(0.0);
        let (mut wasted, mut reflected) = ([zero; REGISTERS], [zero; REGISTERS]);
        for ((&cell, divided), borders) in cells.iter().zip(divided).zip(borders.chunks_exact(QUADS)) {
            let (mass, least) = (F::splat(self.guide.mass(cell as usize)), F::splat(self.least(cell)));
            let (of_row, of_parts) = borders.as_flattened().split_at_checked(PARTS).unwrap_or_default();
            let heights = widths::<Four>(of_row).store();
            for (first, borders) in (0..).step_by(F::WIDTH).zip(of_parts.chunks_exact(F::WIDTH)) {
                let height = F::each(|lane| heights[(first + lane) / PARTS % PARTS]);
                let (middle, mass) = (F::at(held(divided), first), mass * (height * widths::<F>(borders)));
                let register = first % GROUP / F::WIDTH % REGISTERS;
                wasted[register] = wasted[register] + F::only(is_wasted::<F>(middle, least), mass * least);
                reflected[register] = reflected[register] + mass * middle.max(zero);
            }
            // They do not count twice.
            let (group, lane) = place_of(cell);
            self.work.cells[group].weight[lane] = 0.0;
        }
        for group in self.work.groups(self.guide.cells()) {
            for (sum, weights) in reflected.iter_mut().zip(group.weight.chunks_exact(F::WIDTH)) {
                *sum = *sum + F::read(weights);
            }
        }
        sum(wasted) / max(sum(reflected), f32::MIN_POSITIVE)
    }

    /// The least value of each part of a divided cell.
    #[inline(always)]
    fn least(&self, cell: u32) -> f32 {
        let (group, lane) = place_of(cell);
        max(self.darkest, KEPT * self.work.cells[group].floor[lane])
    }

    /// The leaves of the parts of divided cells, from what was held there, the sums over them, and the weights of the cells. `kept`: the part of the least
    /// value that parts keep which reflect nothing.
    #[inline(always)]
    fn divide<F: Num>(&mut self, cells: &[u32], kept: f32, divided: &mut [Divided], borders: &[[Short; 4]]) {
        let borders: &[[[Short; 4]; QUADS]] = borders
            .get(..QUADS * cells.len())
            .and_then(|borders| bytemuck::try_cast_slice(borders).ok())
            .unwrap_or(&[]);
        for ((&cell, divided), borders) in cells.iter().zip(divided).zip(borders) {
            let (mut middles, mut means): (Middles, _) = ([0.0; 2 * PARTS + MIDDLES], [0.5; MIDDLES]);
            if let Some(out) = middles.get_mut(PARTS..PARTS + MIDDLES) {
                out.copy_from_slice(held(divided));
            }
            let least = F::splat(self.least(cell));
            let evaluated = if self.is_near(cell) { Some(F::apart(Quadrants(self, cell))) } else { None };
            let [column, mut row] = places_of::<F>(0);
            for (group, leaves) in divided.leaves.iter_mut().enumerate() {
                for place in places::<F>() {
                    let first = group * GROUP + place;
                    let (corners, least) = parts_from::<F>(&middles, first, [column, row], least, least * kept);
                    row = row + (F::WIDTH / PARTS) as f32;
                    let corners = match &evaluated {
                        Some(of) => fitted(of.each_ref().map(|of| F::at(of, first)), least, self.floor),
                        None => {
                            let floor = (largest(corners) * self.floor).max(least);
                            corners.map(|x| x.max(floor))
                        }
                    };
                    store(&near(corners), |x| x, leaves, place).write(&mut means, first);
                }
            }
            let mean = sum_parts::<F>(&means, borders, &mut divided.ends);
            let (group, lane) = place_of(cell);
            self.work.cells[group].weight[lane] = self.guide.mass(cell as usize) * mean;
        }
    }
}

/// F at the middles of the quadrants of the parts of a cell. Where the light lies in a part is known by the middles of its neighbours. Apart, since few cells
/// need it.
struct Quadrants<'a, 'b>(&'a Stage<'b>, u32);

impl<F: Num> Apart<F> for Quadrants<'_, '_> {
    type Output = [[f32; MIDDLES]; 4];

    #[inline(always)]
    fn run(self) -> [[f32; MIDDLES]; 4] {
        let Quadrants(stage, cell) = self;
        // In steps: lengths do not count.
        let mut kept = [0; PARTS + 4 * MIDDLES];
        if let Some(kept) = kept.get_mut(PARTS..) {
            kept.copy_from_slice(stage.guide.parts(cell as usize));
        }
        const BELOW_0: u32 = (guide::STEPS as u32).wrapping_neg();
        let mut directions = [[[1; MIDDLES]; 4]; 3];
        for first in (0..MIDDLES).step_by(F::WIDTH) {
            let columns_and_rows = places_of(first);
            let mut axes = [[F::splat(0.0); 4]; 3];
            for (axis, out) in axes.iter_mut().enumerate() {
                let beside_them = kept.get(MIDDLES * axis + first..).and_then(|kept| kept.first_chunk());
                let beside_them: &[Short; 2 * PARTS + GROUP] = beside_them.unwrap_or(&[0; 2 * PARTS + GROUP]);
                let at = |further: usize| F::shorts(beside_them.get(further..).unwrap_or(&[]));
                *out = beside(at(PARTS), half_slopes(at, columns_and_rows).map(|half| half * 0.5));
            }
            let [x, y, z] = &axes;
            for (quadrant, ((&x, &y), &z)) in x.iter().zip(y).zip(z).enumerate() {
                let scale =
                    F::splat(guide::STEPS - 1.0) / (x * x + y * y + z * z).max(F::splat(f32::MIN_POSITIVE)).sqrt();
                for (out, x) in directions.iter_mut().zip([x, y, z]) {
                    // Above 0, since only there numbers become whole ones.
                    let steps = F::ints_of((x * scale + (guide::STEPS + 0.5)).to_whole() + F::Whole::splat(BELOW_0));
                    for (out, &step) in out[quadrant].iter_mut().skip(first).zip(steps.as_ref()) {
                        *out = step as Short;
                    }
                }
            }
        }
        let mut out = [[0.5; MIDDLES]; 4];
        stage.respond::<F>(directions.each_ref().map(|axis| axis.as_flattened()), out.as_flattened_mut());
        out
    }
}

/// F at the middles of the parts of a divided cell that is not finished.
fn held(divided: &Divided) -> &[f32; MIDDLES] {
    bytemuck::cast_slice(&divided.leaves).first_chunk().unwrap_or(&[0.0; MIDDLES])
}

/// As [`held`], to write.
fn held_mut(divided: &mut Divided) -> &mut [f32] {
    bytemuck::cast_slice_mut(&mut divided.leaves).get_mut(..MIDDLES).unwrap_or_default()
}
