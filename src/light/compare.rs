//! Whether a renderer's radiance is the light that was built; if not, which mistake explains the difference.
//!
//! Every mistake is a hypothesis about the renderer: it looks the same map up in another frame, or at other positions. The built
//! light itself answers what the renderer would then see, because density times power is luminance. The hypothesis with the
//! least error wins if it leaves almost none, also at the directions that are spread over the sphere, and also where it says that the
//! renderer sees light: a frame that only moves a sun to plain sky explains nothing.

use super::batch::{pdf, sample};
use super::chart::Layout;
use super::environment::Environment;
use super::plan::Filter;
use super::tables::Light;
use crate::numeric::{luminance, max, min, sqrt};
use crate::points::{hammersley, sobol};
use crate::sphere::{Frame, direction};
use bytemuck::{Pod, Zeroable};
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

/// Whether the renderer sees what a hypothesis says, and with which factor.
#[derive(Clone, Copy)]
struct Fit {
    /// The mean over all directions.
    error: f32,
    /// The mean over those that are spread over the sphere.
    spread: f32,
    scale: f32,
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
    fit: Fit,
}

/// The directions that are drawn, and the renderer's luminance there and at those of [`spread`], which would fill the stack.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Seen {
    wi: [[f32; 3]; HALF],
    luminance: [[f32; HALF]; 2],
}

/// The renderer, and how many directions it was asked for.
struct Renderer<'a, 'b> {
    radiance: &'a mut Radiance<'b>,
    asked: usize,
}

/// The map that the renderer has, as the built light knows it.
struct Map<'a> {
    light: Light<'a>,
    frame: Frame,
    texels: [f32; 2],
    built: LookUp,
    /// The mean luminance, if the light is compensated.
    compensated: Option<f32>,
    mean: f32,
    tolerance: f32,
}

/// A renderer's radiance: writes the colour of each direction, and answers whether it could.
pub type Radiance<'a> = dyn FnMut(&[[f32; 3]], &mut [[f32; 3]]) -> bool + 'a;

/// Compares a renderer's radiance with an environment. `radiance` writes the colour of each direction, and answers whether it could.
///
/// # Errors
/// The number of the direction at which it could not, or at which a channel is NaN, infinite or negative.
pub fn compare(environment: &Environment<'_>, radiance: &mut Radiance<'_>) -> Result<Comparison, usize> {
    let map = Map::of(environment);
    let mut renderer = Renderer { radiance, asked: 0 };
    let mut seen = Seen::zeroed();
    map.look(&map.frame, &mut renderer, &mut seen)?;
    let as_built = map.as_built(&seen);
    let best = map.explain(&mut seen, &mut renderer, &as_built)?;
    let Fit { error, .. } = as_built.fit;
    let cause = if best.cause != Cause::None {
        best.cause
    } else if error > map.tolerance {
        Cause::Other
    } else if (best.fit.scale - 1.0).abs() > max(SCALE_IS_ONE, map.tolerance - AGREES) {
        Cause::Scaled
    } else {
        Cause::None
    };
    let look_up = best.look_up.unwrap_or(map.built);
    Ok(Comparison {
        cause,
        error,
        explained: best.fit.error,
        scale: best.fit.scale,
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

/// A direction of those that are spread over the sphere.
#[inline(never)]
fn spread(index: u32) -> [f32; 3] {
    direction(hammersley(index, HALF as u32)).to_array()
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

impl<'a> Map<'a> {
    fn of(environment: &Environment<'a>) -> Map<'a> {
        let (header, of) = (environment.header(), environment.description());
        let light = environment.light();
        Map {
            light,
            frame: environment.frame(),
            texels: [of.width as f32, (of.height / light.chart.faces().max(1)) as f32],
            built: LookUp { filter: of.filter, rows_at_poles: of.rows_at_poles, shift: [0.0; 2] },
            compensated: of.compensated.then_some(header.mean as f32),
            mean: header.mean as f32,
            tolerance: AGREES + 2.0 * header.error as f32,
        }
    }

    #[inline(never)]
    fn look(&self, frame: &Frame, renderer: &mut Renderer<'_, '_>, seen: &mut Seen) -> Result<(), usize> {
        for (index, wi) in (0..).zip(&mut seen.wi) {
            *wi = self.drawn(frame, index);
        }
        let [of_drawn, of_spread] = &mut seen.luminance;
        for (wi, out) in seen.wi.chunks(TOGETHER).zip(of_drawn.chunks_mut(TOGETHER)) {
            renderer.look(wi, out)?;
        }
        for (first, out) in (0..).step_by(TOGETHER).zip(of_spread.chunks_mut(TOGETHER)) {
            let mut wi = [[0.0; 3]; TOGETHER];
            for (index, wi) in (first..).zip(&mut wi) {
                *wi = spread(index);
            }
            renderer.look(&wi, out)?;
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
            Some(mean) if importance > mean / 63.0 => importance + mean,
            Some(_) => importance * 64.0,
            None => importance,
        }
    }

    /// The light as it was built: by its density, or by its texels, at which alone a compensated light is exact.
    #[inline(never)]
    fn as_built(&self, seen: &Seen) -> Hypothesis {
        let fit = Fit { error: 1.0, spread: 1.0, scale: 1.0 };
        let by = Hypothesis { cause: Cause::None, frame: self.frame, look_up: None, limit: f32::INFINITY, fit };
        let [density, texels] = [None, Some(self.built)].map(|look_up| self.fitted(seen, Hypothesis { look_up, ..by }));
        if self.compensated.is_some() && texels.fit.error < density.fit.error { texels } else { density }
    }

    /// What explains what was seen; the light as it was built if nothing does.
    #[inline(never)]
    fn explain(
        &self,
        seen: &mut Seen,
        renderer: &mut Renderer<'_, '_>,
        as_built: &Hypothesis,
    ) -> Result<Hypothesis, usize> {
        if as_built.fit.error <= LEAST_DIFFERENCE {
            return Ok(*as_built);
        }
        let budget = 0.5 * (self.tolerance - AGREES);
        let framed = self.best_frame(seen, renderer, as_built)?;
        for attempt in 0..3 {
            let best = match attempt {
                0 if framed.cause == Cause::None => continue,
                // How texels are looked up shows where that frame has its lights.
                0 => {
                    self.look(&framed.frame, renderer, seen)?;
                    self.best_look_up(seen, &self.fitted(seen, framed))
                }
                1 => {
                    self.look(&self.frame, renderer, seen)?;
                    self.best_look_up(seen, as_built)
                }
                _ => self.clamped(seen, as_built),
            };
            let left = if attempt == 0 && as_built.fit.spread < AGREES && self.compensated.is_none() {
                // Only suns show that frame: each of many angles moves them almost there.
                LEAST_DIFFERENCE
            } else {
                min(self.tolerance, EXPLAINS * as_built.fit.error)
            };
            let explains = best.fit.error <= left + budget
                && best.fit.spread <= max(WINS * as_built.fit.spread, LEAST_DIFFERENCE + budget);
            if explains && self.missing(renderer, &best, &BESIDE)?[1] < EXPLAINS {
                return Ok(best);
            }
        }
        Ok(*as_built)
    }

    /// The frame that explains best what was seen.
    #[inline(never)]
    fn best_frame(
        &self,
        seen: &Seen,
        renderer: &mut Renderer<'_, '_>,
        as_built: &Hypothesis,
    ) -> Result<Hypothesis, usize> {
        let inverse = Frame::from_array(&transposed(&self.frame.to_array()));
        let mut best = *as_built;
        let mut most = FRAME_WINS * as_built.fit.error;
        for (number, base) in [self.frame, Frame::IDENTITY, inverse].iter().enumerate() {
            let other = number > 0;
            if other && *base == self.frame {
                continue;
            }
            for class in [Cause::None, Cause::Turned, Cause::Mirrored, Cause::UpsideDown, Cause::Axes] {
                for axes in (0..Axes::COUNT).filter_map(Axes::of).filter(|axes| axes.cause() == class) {
                    let cause = if other { Cause::Frame } else { class };
                    let by = Hypothesis { cause, frame: axes.applied(base), look_up: None, ..*as_built };
                    let by = self.fitted(seen, by);
                    if by.fit.error < most {
                        // As the error of the light as it was built, of which half the directions are its own.
                        let error = max(by.fit.error, 0.5 * self.missing(renderer, &by, &[0.0])?[0]);
                        if error < most {
                            best = by;
                            most = SIMPLER_FIRST * error;
                        }
                    }
                }
            }
        }
        Ok(best)
    }

    /// How the renderer must look the map up so that a frame explains best what was seen.
    #[inline(never)]
    fn best_look_up(&self, seen: &Seen, framed: &Hypothesis) -> Hypothesis {
        let mut best = *framed;
        if framed.fit.error <= LEAST_DIFFERENCE {
            return best;
        }
        let mut most = WINS * framed.fit.error;
        for look_up in (0..LookUp::COUNT).map(|code| self.built.changed(code)) {
            if look_up.rows_at_poles != self.built.rows_at_poles && self.light.chart.layout != Layout::LatLong {
                continue;
            }
            let cause = if framed.cause == Cause::None { look_up.cause(&self.built) } else { framed.cause };
            let by = self.fitted(seen, Hypothesis { cause, look_up: Some(look_up), ..*framed });
            if by.fit.error < most {
                best = by;
                most = SIMPLER_FIRST * by.fit.error;
            }
        }
        best
    }

    /// A renderer that clamps what it looks up at the most that was seen; the light as it was built where that shows at no two
    /// lights, or where the renderer may just see no lamp.
    #[inline(never)]
    fn clamped(&self, seen: &Seen, as_built: &Hypothesis) -> Hypothesis {
        let limit = seen.luminance.as_flattened().iter().fold(0.0, |most, l| max(most, *l));
        let (mut least, mut most) = (f32::INFINITY, 0.0);
        for wi in &seen.wi {
            let mut light = [0.0];
            self.luminances(as_built, &[*wi], &mut light);
            if light[0] > limit {
                (least, most) = (min(least, light[0]), max(most, light[0]));
            }
        }
        if most < CLAMPS_SPAN * least || limit < LEAST_CLAMP * self.mean {
            return *as_built;
        }
        self.fitted(seen, Hypothesis { cause: Cause::Clamped, limit, ..*as_built })
    }

    /// The error where a hypothesis says that the renderer sees light: the mean, and the sum of differences over that of light.
    ///
    /// Directions are drawn from the light in its frame, once for each of some distances beside, in texels.
    #[inline(never)]
    fn missing(&self, renderer: &mut Renderer<'_, '_>, by: &Hypothesis, beside: &[f32]) -> Result<[f32; 2], usize> {
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
                renderer.look(&wi, &mut seen)?;
                self.luminances(by, &wi, &mut lights);
                mean += self.error(&seen, &lights, by.fit.scale);
                for (seen, l) in seen.iter().zip(&lights) {
                    difference += (seen - l * by.fit.scale).abs();
                    light += max(*seen, l * by.fit.scale);
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

    /// The inverse of [`Map::position`]. Columns of a lat-long map wrap; elsewhere the border goes on.
    #[inline(never)]
    fn direction(&self, how: &LookUp, face: f32, [x, y]: [f32; 2]) -> [f32; 3] {
        let chart = &self.light.chart;
        let [columns, rows] = self.texels;
        let (x, y) = (x - how.shift[0], y - how.shift[1]);
        let x = if chart.layout == Layout::LatLong { x - columns * libm::floorf(x / columns) } else { x };
        let across = min(max(x, 0.0), columns) / columns * chart.axes[0].length - chart.offset;
        let across = if across < 0.0 { across + chart.axes[0].length } else { across };
        let down = if how.rows_at_poles { (y - 0.5) / max(rows - 1.0, 1.0) } else { y / rows };
        chart.direction::<f32>(face, [across, min(max(down, 0.0), 1.0) * chart.axes[1].length])
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
    fn fitted(&self, seen: &Seen, by: Hypothesis) -> Hypothesis {
        let mut light = [[0.0; HALF]; 2];
        let [of_drawn, of_spread] = &mut light;
        self.luminances(&by, &seen.wi, of_drawn);
        for (index, out) in (0..).zip(of_spread.chunks_mut(1)) {
            self.luminances(&by, &[spread(index)], out);
        }
        let scale = ratio(seen.luminance.as_flattened(), light.as_flattened(), DARK * self.mean);
        let [drawn, spread] = [0, 1].map(|half| self.error(&seen.luminance[half], &light[half], scale));
        Hypothesis { fit: Fit { error: 0.5 * (drawn + spread), spread, scale }, ..by }
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

impl LookUp {
    /// Filters, rows and shifts by half a texel along both axes.
    const COUNT: u32 = 2 * 2 * 9;

    /// The look-ups that differ from this one, simpler changes first.
    fn changed(&self, code: u32) -> LookUp {
        let filter = match (code % 2, self.filter) {
            (0, filter) => filter,
            (_, Filter::Bilinear) => Filter::Nearest,
            (_, Filter::Nearest) => Filter::Bilinear,
        };
        let half = |code: u32| match code % 3 {
            0 => 0.0,
            1 => 0.5,
            _ => -0.5,
        };
        let shift = [half(code / 4), half(code / 12)];
        LookUp { filter, rows_at_poles: self.rows_at_poles != (code / 2 % 2 == 1), shift }
    }

    /// The change from how the light was built; of several the one that costs most.
    fn cause(&self, built: &LookUp) -> Cause {
        if self.shift != [0.0; 2] {
            Cause::Shifted
        } else if self.rows_at_poles != built.rows_at_poles {
            Cause::Rows
        } else if self.filter != built.filter {
            Cause::Filter
        } else {
            Cause::None
        }
    }
}

/// A rotation or reflection that takes axes to axes: component k of a direction becomes `sign[k]` times component `from[k]`.
#[derive(Clone, Copy)]
struct Axes {
    from: [usize; 3],
    sign: [f32; 3],
}

impl Axes {
    const COUNT: usize = 27 * 8;

    fn of(code: usize) -> Option<Axes> {
        let from = [code % 3, code / 3 % 3, code / 9 % 3];
        let sign = [code / 27, code / 54, code / 108].map(|half| if half % 2 == 0 { 1.0 } else { -1.0 });
        let permutes = from[0] != from[1] && from[1] != from[2] && from[2] != from[0];
        permutes.then_some(Axes { from, sign })
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
        let columns = frame.to_array();
        let mut out = [0.0; 9];
        for (column, (&from, &sign)) in out.chunks_exact_mut(3).zip(self.from.iter().zip(&self.sign)) {
            for (out, x) in column.iter_mut().zip(columns.iter().skip(3 * from)) {
                // Never -0.
                *out = sign * x + 0.0;
            }
        }
        Frame::from_array(&out)
    }
}
