//! Whether a renderer's radiance is the light that was built; if not, which mistake explains the difference.
//!
//! Every mistake is a hypothesis about the renderer: it looks the same map up in another frame, or at other positions. The built
//! light itself answers what the renderer would then see, because density times power is luminance. The hypothesis with the
//! least error wins if it leaves almost none, also at the directions that are spread over the sphere, and also where it says that the
//! renderer sees light: a frame that only moves a sun to plain sky explains nothing.

use super::batch::{pdf, sample};
use super::chart::Layout;
use super::environment::Environment;
use super::parts::direction_of;
use super::plan::Filter;
use super::tables::Light;
use crate::numeric::{luminance, max, min, sqrt};
use crate::points::{hammersley, sobol};
use crate::sphere::{Frame, direction};
use core::f32::consts::PI;
use glam::Vec3;

/// Directions at which the renderer is called: half drawn from the light, which finds its sun, half spread over the sphere.
pub const DIRECTIONS: usize = 2 * HALF;
/// Half of them.
const HALF: usize = 128;
/// Directions of one call of the renderer, at most.
pub const TOGETHER: usize = 64;
/// Directions of one call that confirms a hypothesis: fewer, so that they fit on the stack beside those above.
const CONFIRMING: usize = 32;

/// How far beside directions drawn from the light an explanation is confirmed, in texels: a sun in the wrong place, blurs.
const BESIDE: [f32; 8] = [0.0, 0.5, 1.0, 1.0, 2.0, 4.0, 8.0, 16.0];

/// A look-up leaves less than this share of the error, which is at least [`LEAST_DIFFERENCE`].
const WINS: f32 = 0.5;
/// A frame leaves less than this share until the look-up is mended, too.
const FRAME_WINS: f32 = 0.75;
/// An explanation leaves less than this share of the error, and of the light beside its suns. On 15 photographs and measured rooms the
/// right one leaves at most 0.04.
const EXPLAINS: f32 = 0.08;
/// A clamp below so many times the mean may be a sky without its sun.
const LEAST_CLAMP: f32 = 4.0;
/// What is clamped shows if one light is so many times another.
const CLAMPS_SPAN: f32 = 2.0;
/// Differences below are none. The 16-bit tables leave 0.0003; rows at the poles in a map without detail give 0.005.
const LEAST_DIFFERENCE: f32 = 0.002;
/// A later hypothesis must be better by this factor than an earlier, simpler one: symmetric maps fit many frames.
const SIMPLER_FIRST: f32 = 0.98;
/// An error up to this that nothing explains is none: clamps and other weights of luminance leave as much.
const AGREES: f32 = 0.02;
/// A factor this close to 1 is none.
const SCALE_IS_ONE: f32 = 0.01;
/// What is far darker than the mean counts less: the floor of the light (rule 16) is no difference.
const DARK: f32 = 1.0 / 256.0;

/// What explains the difference between a renderer's radiance and the built light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub enum Cause {
    /// The environment is the light that you see.
    None = 0,
    /// Your radiance is `scale` times the light: harmless if you meant it, since rays are chosen alike.
    Scaled = 1,
    /// You do not apply world_from_map, or you apply its inverse.
    Frame = 2,
    /// Your map is rotated by 90, 180 or 270 degrees about the polar axis.
    Turned = 3,
    /// Your map is mirrored: azimuth runs the other way.
    Mirrored = 4,
    /// Your polar axis points the other way: rows from bottom to top.
    UpsideDown = 5,
    /// Another axis is your polar axis: y up, for instance, in place of z.
    Axes = 6,
    /// You look texels up half a texel beside.
    Shifted = 7,
    /// Your first and last rows lie at the poles and those of the environment do not, or the other way round.
    Rows = 8,
    /// You interpolate and the environment takes the nearest texel, or the other way round.
    Filter = 9,
    /// Another map, rotation, blur or curve of colours: no other cause leaves almost no difference.
    Other = 10,
    /// You clamp what you look up at `limit`: clamp the map before you build the light.
    Clamped = 11,
}

/// The result of a comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// What explains the difference.
    pub cause: Cause,
    /// The mean over directions of |L / scale - light| over the larger of both, 0 to 1.
    pub error: f32,
    /// The error that is left where the light is built as the following fields say.
    pub explained: f32,
    /// The renderer's radiance over that of the light.
    pub scale: f32,
    /// The row-major `world_from_map` with which the light agrees best with the renderer.
    pub world_from_map: [f32; 9],
    /// The filter with which it does.
    pub filter: Filter,
    /// Whether the first and the last row lie at the poles.
    pub rows_at_poles: bool,
    /// How many texels the renderer looks too far along columns and rows: 0 or half a texel.
    pub shift: [f32; 2],
    /// The luminance at which the renderer clamps what it looks up; 0 if it does not.
    pub limit: f32,
}

/// How a renderer may look the map up.
#[derive(Clone, Copy, PartialEq)]
struct LookUp {
    filter: Filter,
    rows_at_poles: bool,
    shift: [f32; 2],
}

/// How the renderer may see the map.
#[derive(Clone, Copy)]
struct Hypothesis {
    cause: Cause,
    frame: Frame,
    /// None: as the light is built.
    look_up: Option<LookUp>,
    /// The largest luminance.
    limit: f32,
    /// The renderer's radiance over what this says.
    scale: f32,
    /// The mean error over all directions.
    error: f32,
    /// The mean over those that are spread over the sphere.
    spread: f32,
}

/// The renderer, and how many directions it was asked for.
struct Renderer<'a, 'b> {
    radiance: &'a mut Radiance<'b>,
    asked: usize,
}

/// The map that the renderer has, as the built light knows it, and what the renderer sees.
struct Compared<'a, 'b, 'c> {
    light: Light<'a>,
    frame: Frame,
    texels: [f32; 2],
    built: LookUp,
    compensated: bool,
    mean: f32,
    tolerance: f32,
    renderer: Renderer<'b, 'c>,
    /// Drawn from the light, and as many spread over the sphere.
    wi: &'b mut [[f32; 3]; DIRECTIONS],
    luminance: &'b mut [f32; DIRECTIONS],
}

/// A renderer's radiance: writes the colour of each direction, and answers whether it could.
pub type Radiance<'a> = dyn FnMut(&[[f32; 3]], &mut [[f32; 3]]) -> bool + 'a;

/// Compares a renderer's radiance with an environment. `radiance` writes the colour of each direction, and answers whether it could.
///
/// # Errors
/// The number of the direction at which it could not, or at which a channel is NaN, infinite or negative.
pub fn compare(environment: &Environment<'_>, radiance: &mut Radiance<'_>) -> Result<Comparison, usize> {
    let (header, of, light) = (environment.header(), environment.description(), environment.light());
    // Apart, so that the stack holds them once.
    let mut wi = [[0.0; 3]; DIRECTIONS];
    let mut luminance = [0.0; DIRECTIONS];
    let mut compared = Compared {
        light,
        frame: environment.frame(),
        texels: [of.width as f32, (of.height / light.chart.faces().max(1)) as f32],
        built: LookUp { filter: of.filter, rows_at_poles: of.rows_at_poles, shift: [0.0; 2] },
        compensated: of.compensated,
        mean: header.mean as f32,
        tolerance: AGREES + 2.0 * header.error as f32,
        renderer: Renderer { radiance, asked: 0 },
        wi: &mut wi,
        luminance: &mut luminance,
    };
    compared.look(&environment.frame())?;
    let as_built = compared.as_built();
    let best = compared.explain(&as_built)?;
    let cause = if best.cause != Cause::None {
        best.cause
    } else if as_built.error > compared.tolerance {
        Cause::Other
    } else if (best.scale - 1.0).abs() > max(SCALE_IS_ONE, compared.tolerance - AGREES) {
        Cause::Scaled
    } else {
        Cause::None
    };
    let look_up = best.look_up.unwrap_or(compared.built);
    Ok(Comparison {
        cause,
        error: as_built.error,
        explained: best.error,
        scale: best.scale,
        world_from_map: transposed(&best.frame.to_array()),
        filter: look_up.filter,
        rows_at_poles: look_up.rows_at_poles,
        shift: look_up.shift,
        limit: if best.cause == Cause::Clamped { best.limit } else { 0.0 },
    })
}

fn transposed([a, b, c, d, e, f, g, h, i]: &[f32; 9]) -> [f32; 9] {
    [*a, *d, *g, *b, *e, *h, *c, *f, *i]
}

impl Renderer<'_, '_> {
    /// Calls the renderer for at most [`TOGETHER`] directions. Steps are not inlined into each other, so that they share the stack.
    #[inline(never)]
    fn look(&mut self, wi: &[[f32; 3]], out: &mut [f32]) -> Result<(), usize> {
        let first = self.asked;
        self.asked += wi.len();
        let mut colours = [[0.0; 3]; TOGETHER];
        let colours = colours.get_mut(..wi.len()).unwrap_or_default();
        if !(self.radiance)(wi, colours) {
            return Err(first);
        }
        for (number, (out, colour)) in (first..).zip(out.iter_mut().zip(colours)) {
            *out = luminance(*colour);
            if !(colour.iter().all(|c| *c >= 0.0) && *out < f32::INFINITY) {
                return Err(number);
            }
        }
        Ok(())
    }
}

impl Compared<'_, '_, '_> {
    #[inline(never)]
    fn look(&mut self, frame: &Frame) -> Result<(), usize> {
        for index in 0..HALF {
            self.wi[index] = self.drawn(frame, index as u32);
            self.wi[HALF + index] = direction(hammersley(index as u32, HALF as u32)).to_array();
        }
        for (wi, out) in self.wi.chunks(TOGETHER).zip(self.luminance.chunks_mut(TOGETHER)) {
            self.renderer.look(wi, out)?;
        }
        Ok(())
    }

    /// A direction drawn from the light in a frame.
    #[inline(never)]
    fn drawn(&self, frame: &Frame, index: u32) -> [f32; 3] {
        // One by one, which takes less of the stack than a batch.
        let drawn = sample(&self.light, frame, hammersley(index, HALF as u32));
        // A black light has no samples.
        if drawn.pdf > 0.0 { drawn.wi } else { [0.0, 0.0, 1.0] }
    }

    /// Luminance at world directions by a hypothesis.
    #[inline(never)]
    fn luminances(&self, by: &Hypothesis, wi: &[[f32; 3]], out: &mut [f32]) {
        for (l, &wi) in out.iter_mut().zip(wi) {
            let here = match &by.look_up {
                Some(look_up) => self.looked_up(look_up, by.frame.to_map(wi)),
                None => self.luminance(&by.frame, wi),
            };
            *l = min(here, by.limit);
        }
    }

    #[inline(never)]
    fn luminance(&self, frame: &Frame, wi: [f32; 3]) -> f32 {
        let importance = pdf(&self.light, frame, wi) * self.light.power as f32;
        match self.compensated {
            // max(L - mean, L / 64) is L - mean from L = 64 / 63 of the mean on.
            true if importance > self.mean / 63.0 => importance + self.mean,
            true => importance * 64.0,
            false => importance,
        }
    }

    /// The light as it was built: by its density, or by its texels, at which alone a compensated light is exact.
    #[inline(never)]
    fn as_built(&self) -> Hypothesis {
        let (frame, limit) = (self.frame, f32::INFINITY);
        let by = Hypothesis { cause: Cause::None, frame, look_up: None, limit, scale: 1.0, error: 1.0, spread: 1.0 };
        let [density, texels] = [None, Some(self.built)].map(|look_up| self.fitted(Hypothesis { look_up, ..by }));
        if self.compensated && texels.error < density.error { texels } else { density }
    }

    /// What explains what was seen; the light as it was built if nothing does.
    #[inline(never)]
    fn explain(&mut self, as_built: &Hypothesis) -> Result<Hypothesis, usize> {
        if as_built.error <= LEAST_DIFFERENCE {
            return Ok(*as_built);
        }
        let budget = 0.5 * (self.tolerance - AGREES);
        let framed = self.best(as_built, true, &mut frames(as_built))?;
        for (attempt, by) in [framed, *as_built, *as_built].into_iter().enumerate() {
            let by_frame = attempt == 0;
            if by_frame && by.cause == Cause::None {
                continue;
            }
            let best = if attempt < 2 {
                // How texels are looked up shows where a frame has its lights.
                self.look(&by.frame)?;
                let by = self.fitted(by);
                self.best(&by, false, &mut look_ups(&by, self.built, self.light.chart.layout))?
            } else {
                self.clamped(as_built)
            };
            let left = if by_frame && as_built.spread < AGREES && !self.compensated {
                // Only suns show that frame: each of many angles moves them almost there.
                LEAST_DIFFERENCE
            } else {
                min(self.tolerance, EXPLAINS * as_built.error)
            };
            let explains =
                best.error <= left + budget && best.spread <= max(WINS * as_built.spread, LEAST_DIFFERENCE + budget);
            if explains && self.missing(&best, &BESIDE)?[1] < EXPLAINS {
                return Ok(best);
            }
        }
        Ok(*as_built)
    }

    /// The best of some hypotheses, simpler ones first, if it is much better than what stands. Those of frames are judged also where they
    /// say that there is light.
    #[inline(never)]
    fn best(
        &mut self,
        stands: &Hypothesis,
        frames: bool,
        all: &mut dyn Iterator<Item = Hypothesis>,
    ) -> Result<Hypothesis, usize> {
        let mut best = *stands;
        let mut most = if frames { FRAME_WINS } else { WINS } * stands.error;
        for by in all {
            let by = self.fitted(by);
            if by.error < most {
                // As the error of the light as it was built, of which half the directions are its own.
                let missing = if frames { 0.5 * self.missing(&by, &[0.0])?[0] } else { 0.0 };
                let error = max(by.error, missing);
                if error < most {
                    (best, most) = (by, SIMPLER_FIRST * error);
                }
            }
        }
        Ok(best)
    }

    /// A renderer that clamps what it looks up at the most that was seen; the light as it was built where that shows at no two
    /// lights, or where the renderer may just see no lamp.
    #[inline(never)]
    fn clamped(&self, as_built: &Hypothesis) -> Hypothesis {
        let limit = self.luminance.iter().fold(0.0, |most, l| max(most, *l));
        let (mut least, mut most, mut light) = (f32::INFINITY, 0.0, [0.0; HALF]);
        self.luminances(as_built, self.wi, &mut light);
        for &light in light.iter().filter(|light| **light > limit) {
            (least, most) = (min(least, light), max(most, light));
        }
        if most < CLAMPS_SPAN * least || limit < LEAST_CLAMP * self.mean {
            return *as_built;
        }
        self.fitted(Hypothesis { cause: Cause::Clamped, limit, ..*as_built })
    }

    /// The error where a hypothesis says that the renderer sees light: the mean, and the sum of differences over that of light.
    ///
    /// Directions are drawn from the light in its frame, once for each of some distances beside, in texels.
    #[inline(never)]
    fn missing(&mut self, by: &Hypothesis, beside: &[f32]) -> Result<[f32; 2], usize> {
        let [mut mean, mut difference, mut light] = [0.0; 3];
        let texel = PI / sqrt(self.texels[0] * self.texels[1]);
        for (time, beside) in (0..).zip(beside) {
            for first in (0..HALF as u32).step_by(CONFIRMING) {
                let mut wi = [[0.0; 3]; CONFIRMING];
                for (index, wi) in (first..).zip(&mut wi) {
                    let around = direction(sobol(time, index)) * (texel * beside);
                    let drawn = Vec3::from(self.found_at(by, self.drawn(&by.frame, index)));
                    *wi = (drawn + around).normalize_or_zero().to_array();
                }
                let (mut seen, mut lights) = ([0.0; CONFIRMING], [0.0; CONFIRMING]);
                self.renderer.look(&wi, &mut seen)?;
                self.luminances(by, &wi, &mut lights);
                mean += self.error(&seen, &lights, by.scale);
                for (seen, l) in seen.iter().zip(&lights) {
                    difference += (seen - l * by.scale).abs();
                    light += max(*seen, l * by.scale);
                }
            }
        }
        Ok([mean / (beside.len() * HALF / CONFIRMING) as f32, difference / light])
    }

    /// The direction that a renderer looks up where the built light has this one.
    #[inline(never)]
    fn found_at(&self, by: &Hypothesis, wi: [f32; 3]) -> [f32; 3] {
        let Some(look_up) = by.look_up else { return wi };
        let (face, position) = self.position(&self.built, by.frame.to_map(wi));
        by.frame.to_world(self.direction(&look_up, face, position))
    }

    /// The face, column and row where a direction of the map is looked up, in texels.
    #[inline(never)]
    fn position(&self, how: &LookUp, d: [f32; 3]) -> (f32, [f32; 2]) {
        let chart = &self.light.chart;
        let place = chart.place::<f32>(d);
        let [columns, rows] = self.texels;
        let across = (place.position[0] + chart.offset) / chart.axes[0].length;
        let down = place.position[1] / chart.axes[1].length;
        let y = if how.rows_at_poles { down * (rows - 1.0) + 0.5 } else { down * rows };
        (place.face, [across * columns + how.shift[0], y + how.shift[1]])
    }

    /// The inverse of [`Compared::position`]. Columns of a lat-long map wrap; elsewhere the border goes on.
    #[inline(never)]
    fn direction(&self, how: &LookUp, face: f32, [x, y]: [f32; 2]) -> [f32; 3] {
        let chart = &self.light.chart;
        let [columns, rows] = self.texels;
        let (x, y) = (x - how.shift[0], y - how.shift[1]);
        let x = if chart.layout == Layout::LatLong { x - columns * libm::floorf(x / columns) } else { x };
        let across = min(max(x, 0.0), columns) / columns * chart.axes[0].length - chart.offset;
        let across = if across < 0.0 { across + chart.axes[0].length } else { across };
        let down = if how.rows_at_poles { (y - 0.5) / max(rows - 1.0, 1.0) } else { y / rows };
        direction_of(chart, face, [across, min(max(down, 0.0), 1.0) * chart.axes[1].length])
    }

    /// What a renderer sees that looks the map up in another way: texels are what the built light answers at their centres.
    #[inline(never)]
    fn looked_up(&self, how: &LookUp, d: [f32; 3]) -> f32 {
        let (face, [x, y]) = self.position(how, d);
        if how.filter == Filter::Nearest {
            return self.texel(face, [libm::floorf(x), libm::floorf(y)]);
        }
        let (x, y) = (x - 0.5, y - 0.5);
        let (left, top) = (libm::floorf(x), libm::floorf(y));
        let (s, t) = (x - left, y - top);
        let line = |row: f32| {
            let [a, b] = [left, left + 1.0].map(|column| self.texel(face, [column, row]));
            a + s * (b - a)
        };
        let [above, below] = [line(top), line(top + 1.0)];
        above + t * (below - above)
    }

    /// The luminance of a texel.
    #[inline(never)]
    fn texel(&self, face: f32, [column, row]: [f32; 2]) -> f32 {
        let [columns, rows] = self.texels;
        let inside =
            |x: f32, last: f32| if self.light.chart.layout == Layout::LatLong { x } else { min(max(x, 0.0), last) };
        let (column, row) = (inside(column, columns - 1.0), min(max(row, 0.0), rows - 1.0));
        let centre = self.direction(&self.built, face, [column + 0.5, row + 0.5]);
        self.luminance(&Frame::IDENTITY, centre)
    }

    /// The hypothesis with its factor and its error.
    #[inline(never)]
    fn fitted(&self, by: Hypothesis) -> Hypothesis {
        let mut light = [0.0; DIRECTIONS];
        self.luminances(&by, self.wi, &mut light);
        let scale = ratio(self.luminance, &light, DARK * self.mean);
        let mut halves = self.luminance.chunks(HALF).zip(light.chunks(HALF));
        let [drawn, spread] =
            [(); 2].map(|()| halves.next().map_or(0.0, |(seen, light)| self.error(seen, light, scale)));
        Hypothesis { error: 0.5 * (drawn + spread), spread, scale, ..by }
    }

    /// The mean error between what was seen and a light.
    #[inline(never)]
    fn error(&self, seen: &[f32], light: &[f32], scale: f32) -> f32 {
        let dark = max(DARK * self.mean * scale, f32::MIN_POSITIVE);
        let mut sum = 0.0;
        for (&seen, &light) in seen.iter().zip(light) {
            let light = min(light * scale, f32::MAX);
            sum += (seen - light).abs() / (max(seen, light) + dark);
        }
        min(sum / seen.len() as f32, 1.0)
    }
}

/// The median of what was seen over the light, where the light is not dark; 1 if it is dark everywhere.
///
/// Bisection of the bits of a float, which ascend with it.
fn ratio(seen: &[f32], light: &[f32], dark: f32) -> f32 {
    let lit = || seen.iter().zip(light).filter(|(_, light)| **light > dark);
    let count = lit().count();
    if count == 0 {
        return 1.0;
    }
    let (mut low, mut high) = (0, f32::INFINITY.to_bits());
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        let above = lit().filter(|(seen, light)| **seen > **light * f32::from_bits(middle)).count();
        if 2 * above > count {
            low = middle;
        } else {
            high = middle;
        }
    }
    // Nothing is above a ratio of 0 if half of what was seen is black.
    if low == 0 { 0.0 } else { min(f32::from_bits(high), f32::MAX) }
}

/// Other frames, simpler ones first: those that take axes to axes, of the light's frame, of none, and of the inverse.
fn frames(as_built: &Hypothesis) -> impl Iterator<Item = Hypothesis> {
    const KINDS: [Cause; 5] = [Cause::None, Cause::Turned, Cause::Mirrored, Cause::UpsideDown, Cause::Axes];
    let by = Hypothesis { look_up: None, ..*as_built };
    let bases = [by.frame, Frame::IDENTITY, Frame::from_array(&transposed(&by.frame.to_array()))];
    (0..bases.len() * KINDS.len() * Axes::COUNT).filter_map(move |code| {
        let (axes, kind) = (Axes::of(code), KINDS[code / Axes::COUNT % KINDS.len()]);
        let (number, base) = (code / Axes::COUNT / KINDS.len(), bases[code / Axes::COUNT / KINDS.len() % bases.len()]);
        let is_new = axes.cause() == kind && (number == 0 || base != by.frame);
        let cause = if number == 0 { kind } else { Cause::Frame };
        is_new.then(|| Hypothesis { cause, frame: axes.applied(&base), ..by })
    })
}

/// Other look-ups, simpler ones first: filters, rows, and shifts by half a texel along both axes. None if that is no difference.
fn look_ups(by: &Hypothesis, built: LookUp, layout: Layout) -> impl Iterator<Item = Hypothesis> {
    const SHIFTS: [f32; 3] = [0.0, 0.5, -0.5];
    let by = *by;
    let rows = if layout == Layout::LatLong { 2 } else { 1 };
    let count = if by.error > LEAST_DIFFERENCE { SHIFTS.len() * SHIFTS.len() * 4 } else { 0 };
    (0..count).filter(move |code| code / 2 % 2 < rows).map(move |code| {
        let is_bilinear = (built.filter == Filter::Bilinear) == (code % 2 == 0);
        let filter = if is_bilinear { Filter::Bilinear } else { Filter::Nearest };
        let rows_at_poles = built.rows_at_poles != (code / 2 % 2 == 1);
        let look_up = LookUp { filter, rows_at_poles, shift: [SHIFTS[code / 4 % 3], SHIFTS[code / 12 % 3]] };
        // Of several changes the one that costs most.
        let cause = if by.cause != Cause::None {
            by.cause
        } else if look_up.shift != [0.0; 2] {
            Cause::Shifted
        } else if rows_at_poles != built.rows_at_poles {
            Cause::Rows
        } else if filter != built.filter {
            Cause::Filter
        } else {
            Cause::None
        };
        Hypothesis { cause, look_up: Some(look_up), ..by }
    })
}

/// A rotation or reflection that takes axes to axes: component k of a direction becomes `sign[k]` times component `from[k]`.
#[derive(Clone, Copy)]
struct Axes {
    from: [usize; 3],
    sign: [f32; 3],
}

impl Axes {
    const COUNT: usize = 6 * 8;

    fn of(code: usize) -> Axes {
        const ORDERS: [[usize; 3]; 6] = [[2, 1, 0], [1, 2, 0], [2, 0, 1], [0, 2, 1], [1, 0, 2], [0, 1, 2]];
        let sign = [code / 6, code / 12, code / 24].map(|half| if half % 2 == 0 { 1.0 } else { -1.0 });
        Axes { from: ORDERS[code % 6], sign }
    }

    fn cause(&self) -> Cause {
        let [x, y, z] = self.sign;
        let swapped = self.from[0] != 0;
        if self.from[2] != 2 {
            Cause::Axes
        } else if z < 0.0 {
            Cause::UpsideDown
        } else if (x * y > 0.0) == swapped {
            Cause::Mirrored
        } else if swapped || x < 0.0 {
            Cause::Turned
        } else {
            Cause::None
        }
    }

    /// The frame of a renderer that looks up these components of a direction in map space: `M P^T` for `world = M map`.
    fn applied(&self, frame: &Frame) -> Frame {
        let (columns, mut out) = (frame.to_array(), [0.0; 9]);
        for (k, out) in out.iter_mut().enumerate() {
            // Never -0.
            *out = self.sign[k / 3] * columns[(3 * self.from[k / 3] + k % 3) % 9] + 0.0;
        }
        Frame::from_array(&out)
    }
}
