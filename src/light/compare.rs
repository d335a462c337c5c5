//! Whether a renderer's radiance is the light that was built; if not, which mistake explains the difference.
//!
//! Every mistake is a hypothesis about the renderer: it looks the same map up in another frame, or at other positions. The built
//! light itself answers what the renderer would then see, because density times power is luminance. The hypothesis with the
//! least error wins if it is far ahead of the light as it was built.

use super::batch::pdf;
use super::chart::{Chart, Layout};
use super::environment::Environment;
use super::plan::Filter;
use super::tables::Light;
use crate::numeric::{luminance, max, min};
use crate::points::hammersley;
use crate::sphere::{Frame, direction};
use bytemuck::{Pod, Zeroable};

/// Directions at which the renderer is called: half drawn from the light, which finds its sun, half spread over the sphere.
pub const DIRECTIONS: usize = 256;
/// Directions of one call of the renderer.
pub const TOGETHER: usize = 64;

/// A hypothesis explains a difference if it leaves less than this share of the error, which is then at least
/// [`LEAST_DIFFERENCE`]. On 15 photographs and measured rooms the right one leaves at most 0.04.
const WINS: f32 = 0.5;
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
#[repr(u32)]
pub enum Cause {
    /// There is no difference.
    None = 0,
    /// A factor alone.
    Scaled = 1,
    /// `world_from_map` is not applied, or its inverse is.
    Frame = 2,
    /// A rotation by a quarter, half or three quarters of a turn about the polar axis.
    Turned = 3,
    /// A reflection that keeps the polar axis.
    Mirrored = 4,
    /// The polar axis is reversed.
    UpsideDown = 5,
    /// Another axis is the polar axis.
    Axes = 6,
    /// Positions differ by half a texel.
    Shifted = 7,
    /// The first and the last row lie at the poles for one, and half a texel beside them for the other.
    Rows = 8,
    /// One interpolates, the other takes the nearest texel.
    Filter = 9,
    /// None of these.
    Other = 10,
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
}

/// How a renderer may look the map up.
#[derive(Clone, Copy, PartialEq)]
struct LookUp {
    filter: Filter,
    rows_at_poles: bool,
    shift: [f32; 2],
}

/// Error and factor of a hypothesis.
#[derive(Clone, Copy)]
struct Fit {
    error: f32,
    scale: f32,
}

/// Directions, and the renderer's luminance there.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Seen {
    wi: [[f32; 3]; DIRECTIONS],
    luminance: [f32; DIRECTIONS],
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
    let mut seen = Seen::zeroed();
    map.look(radiance, &mut seen)?;
    let as_built = map.in_frame(&seen, &map.frame);
    let (frame, of_frame, fit) = map.best_frame(&seen, as_built);
    let (look_up, of_look_up, explained) = map.best_look_up(&seen, &frame, fit);
    // A compensated light is exact at texel centres only: what the light as it was built explains is no error.
    let error = if of_frame == Cause::None && of_look_up == Cause::None { explained.error } else { as_built.error };
    let cause = if of_frame != Cause::None {
        of_frame
    } else if of_look_up != Cause::None {
        of_look_up
    } else if error > map.tolerance {
        Cause::Other
    } else if (explained.scale - 1.0).abs() > max(SCALE_IS_ONE, map.tolerance - AGREES) {
        Cause::Scaled
    } else {
        Cause::None
    };
    Ok(Comparison {
        cause,
        error,
        explained: explained.error,
        scale: explained.scale,
        world_from_map: transposed(&frame.to_array()),
        filter: look_up.filter,
        rows_at_poles: look_up.rows_at_poles,
        shift: look_up.shift,
    })
}

fn transposed([a, b, c, d, e, f, g, h, i]: &[f32; 9]) -> [f32; 9] {
    [*a, *d, *g, *b, *e, *h, *c, *f, *i]
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

    /// Calls the renderer. Steps are not inlined into each other, so that they share the stack.
    #[inline(never)]
    fn look(&self, radiance: &mut Radiance<'_>, seen: &mut Seen) -> Result<(), usize> {
        let parts = seen.wi.chunks_mut(TOGETHER).zip(seen.luminance.chunks_mut(TOGETHER));
        for (part, (wi, luminances)) in parts.enumerate() {
            let first = part * TOGETHER;
            self.choose(first as u32, wi);
            let mut colours = [[0.0; 3]; TOGETHER];
            let colours = colours.get_mut(..wi.len()).unwrap_or_default();
            if !radiance(wi, colours) {
                return Err(first);
            }
            for (number, (out, colour)) in (first..).zip(luminances.iter_mut().zip(colours)) {
                *out = luminance(*colour);
                if !(colour.iter().all(|c| *c >= 0.0) && *out < f32::INFINITY) {
                    return Err(number);
                }
            }
        }
        Ok(())
    }

    /// Directions from number `first` on.
    #[inline(never)]
    fn choose(&self, first: u32, wi: &mut [[f32; 3]]) {
        const HALF: u32 = DIRECTIONS as u32 / 2;
        for (index, out) in (first..).zip(wi) {
            if index >= HALF {
                *out = direction(hammersley(index - HALF, HALF)).to_array();
                continue;
            }
            // One by one, which takes less of the stack than a batch.
            let (drawn, pdf) = self.light.sample::<f32>(&self.frame, hammersley(index, HALF));
            // A black light has no samples.
            *out = if pdf > 0.0 { drawn } else { [0.0, 0.0, 1.0] };
        }
    }

    /// Luminance at world directions in a frame.
    #[inline(never)]
    fn luminances(&self, frame: &Frame, wi: &[[f32; 3]], out: &mut [f32]) {
        for (l, &wi) in out.iter_mut().zip(wi) {
            // One by one, which takes less of the stack than a batch.
            let importance = pdf(&self.light, frame, wi) * self.light.power as f32;
            *l = match self.compensated {
                // max(L - mean, L / 64) is L - mean from L = 64 / 63 of the mean on.
                Some(mean) if importance > mean / 63.0 => importance + mean,
                Some(_) => importance * 64.0,
                None => importance,
            };
        }
    }

    /// How well another frame explains what was seen.
    #[inline(never)]
    fn in_frame(&self, seen: &Seen, frame: &Frame) -> Fit {
        let mut light = [0.0; DIRECTIONS];
        self.luminances(frame, &seen.wi, &mut light);
        self.fit(seen, &light)
    }

    /// The frame that explains best what was seen.
    #[inline(never)]
    fn best_frame(&self, seen: &Seen, as_built: Fit) -> (Frame, Cause, Fit) {
        let mut best = (self.frame, Cause::None, as_built);
        if as_built.error <= LEAST_DIFFERENCE {
            return best;
        }
        let inverse = Frame::from_array(&transposed(&self.frame.to_array()));
        let bases = [(self.frame, false), (Frame::IDENTITY, true), (inverse, true)];
        for (base, other) in bases {
            if other && base == self.frame {
                continue;
            }
            for class in [Cause::None, Cause::Turned, Cause::Mirrored, Cause::UpsideDown, Cause::Axes] {
                for axes in (0..Axes::COUNT).filter_map(Axes::of).filter(|axes| axes.cause() == class) {
                    let cause = if other { Cause::Frame } else { class };
                    let frame = axes.applied(&base);
                    let fit = self.in_frame(seen, &frame);
                    if fit.error < SIMPLER_FIRST * best.2.error {
                        best = (frame, cause, fit);
                    }
                }
            }
        }
        if best.2.error < WINS * as_built.error { best } else { (self.frame, Cause::None, as_built) }
    }

    /// How the renderer must look the map up so that a frame explains best what was seen.
    #[inline(never)]
    fn best_look_up(&self, seen: &Seen, frame: &Frame, as_built: Fit) -> (LookUp, Cause, Fit) {
        let unchanged = (self.built, Cause::None, as_built);
        if as_built.error <= LEAST_DIFFERENCE {
            return unchanged;
        }
        let mut best = unchanged;
        for look_up in (0..LookUp::COUNT).map(|code| self.built.changed(code)) {
            if look_up.rows_at_poles != self.built.rows_at_poles && self.light.chart.layout != Layout::LatLong {
                continue;
            }
            let mut light = [0.0; DIRECTIONS];
            for (out, wi) in light.iter_mut().zip(&seen.wi) {
                let [x, y, z] = super::density::to_map(frame, *wi);
                *out = self.looked_up(&look_up, [x, y, z]);
            }
            let fit = self.fit(seen, &light);
            if fit.error < SIMPLER_FIRST * best.2.error {
                best = (look_up, look_up.cause(&self.built), fit);
            }
        }
        if best.2.error < WINS * as_built.error { best } else { unchanged }
    }

    /// What a renderer sees that looks the map up in another way: texels are what the built light answers at their centres.
    #[inline(never)]
    fn looked_up(&self, how: &LookUp, d: [f32; 3]) -> f32 {
        let chart = &self.light.chart;
        let place = chart.place::<f32>(d);
        let [columns, rows] = self.texels;
        let across = (place.position[0] + chart.offset) / chart.axes[0].length;
        let down = place.position[1] / chart.axes[1].length;
        let x = across * columns + how.shift[0];
        let y = if how.rows_at_poles { down * (rows - 1.0) + 0.5 } else { down * rows } + how.shift[1];
        if how.filter == Filter::Nearest {
            return self.texel(chart, place.face, [libm::floorf(x), libm::floorf(y)]);
        }
        let (x, y) = (x - 0.5, y - 0.5);
        let (left, top) = (libm::floorf(x), libm::floorf(y));
        let (s, t) = (x - left, y - top);
        let line = |row: f32| {
            let [a, b] = [left, left + 1.0].map(|column| self.texel(chart, place.face, [column, row]));
            a + s * (b - a)
        };
        let [above, below] = [line(top), line(top + 1.0)];
        above + t * (below - above)
    }

    /// The luminance of a texel. Columns of a lat-long map wrap; elsewhere the border goes on.
    #[inline(never)]
    fn texel(&self, chart: &Chart, face: f32, [column, row]: [f32; 2]) -> f32 {
        let [columns, rows] = self.texels;
        let wraps = chart.layout == Layout::LatLong;
        let column = if wraps { column - columns * libm::floorf(column / columns) } else { column };
        let (column, row) = (min(max(column, 0.0), columns - 1.0), min(max(row, 0.0), rows - 1.0));
        let across = (column + 0.5) / columns * chart.axes[0].length - chart.offset;
        let across = if across < 0.0 { across + chart.axes[0].length } else { across };
        let down = if self.built.rows_at_poles { row / max(rows - 1.0, 1.0) } else { (row + 0.5) / rows };
        let centre = chart.direction::<f32>(face, [across, down * chart.axes[1].length]);
        let mut luminance = [0.0];
        self.luminances(&Frame::IDENTITY, &[centre], &mut luminance);
        luminance[0]
    }

    /// The factor and the error between what was seen and a light.
    #[inline(never)]
    fn fit(&self, seen: &Seen, light: &[f32; DIRECTIONS]) -> Fit {
        let scale = ratio(&seen.luminance, light, DARK * self.mean);
        let dark = max(DARK * self.mean * scale, f32::MIN_POSITIVE);
        let mut sum = 0.0;
        for (&seen, &light) in seen.luminance.iter().zip(light) {
            let light = min(light * scale, f32::MAX);
            sum += (seen - light).abs() / (max(seen, light) + dark);
        }
        Fit { error: min(sum / DIRECTIONS as f32, 1.0), scale }
    }
}

/// The median of what was seen over the light, where the light is not dark; 1 if it is dark everywhere.
///
/// Bisection of the bits of a float, which ascend with it.
fn ratio(seen: &[f32; DIRECTIONS], light: &[f32; DIRECTIONS], dark: f32) -> f32 {
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
