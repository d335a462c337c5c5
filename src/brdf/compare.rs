//! Whether a client's BRDF x cosine is what the lobes of a point say; if not, which mistake explains the difference.
//!
//! Every mistake is a hypothesis about the point: with another wo, another alpha or another weight its lobes would be the client's
//! BRDF. A hypothesis is named only if it leaves almost no difference: lobes that merely resemble a BRDF are no mistake.

use super::material::{ALPHA_RANGE, MAX_LOBES, Material, Shape};
use super::point::Point;
use super::portal::Portal;
use super::surface::{Sample, Surface};
use crate::numeric::{luminance, max, sqrt};
use crate::points::hammersley;
use crate::simd::{Four, Num};
use crate::sphere::{Frame, SPHERE, direction, sin_cos_quarters};
use crate::status::{Error, Status};
use bytemuck::{Pod, Zeroable};
use core::ffi::CStr;
use glam::Vec3;

/// Directions that are computed together.
const WIDTH: usize = Four::WIDTH;
/// Directions at which the client is called: a fifth spread over the sphere, the others drawn from lobes that may be the client's.
pub const DIRECTIONS: usize = 5 * TOGETHER;
/// Directions of one call of the client, and of one way to draw them.
pub const TOGETHER: usize = 40;

/// Nothing explains a difference below this, which rounding leaves.
const LEAST_DIFFERENCE: f64 = 0.002;
/// A difference up to this that nothing explains is none.
const AGREES: f64 = 0.01;
/// Lobes that differ by less resemble a BRDF.
const RESEMBLES: f64 = 0.5;
/// A mistake is named if it leaves at most so much, and at most such a share of the difference. Of 4000 lobes with random errors of 40 %
/// one meets that: its alpha is the root of the BRDF's by chance.
const EXPLAINS: [f64; 2] = [0.03, 0.05];
/// The same for a cosine, which no alpha or weight makes good by chance: the best of those BRDFs leaves 0.1, and 0.4.
const EXPLAINS_COSINE: [f64; 2] = [0.1, 0.25];
/// The same for a direction that is reversed, where nothing agrees as it is: also lobes that resemble a BRDF can be reversed.
const EXPLAINS_REVERSED: [f64; 2] = [RESEMBLES, 1.0];
/// The same where nothing else is to be said.
const EXPLAINS_ALL: [f64; 2] = [1.0, f64::MAX];
/// A larger difference leaves nothing that agrees.
const NOTHING: f64 = 0.95;
/// A later hypothesis must be better than an earlier, simpler one by this factor.
const SIMPLER_FIRST: f64 = 0.5;
/// A common factor this close to 1 is none.
const SCALE_IS_ONE: f64 = 0.01;
/// A weight of lobes that resemble a BRDF may be wrong by this factor.
const WEIGHT_IS_RIGHT: f64 = 1.5;
/// The same for f0, as a difference.
const F0_IS_RIGHT: f64 = 0.03;
/// The same for the tangent, as a share of half a turn.
const TANGENT_IS_RIGHT: f32 = 0.02;
/// So small a share of the client's BRDF below the horizon is rounding.
const LEAST_BELOW: f64 = 0.01;
/// Angles of the tangent that are tried, in half a turn.
const ANGLES: usize = 36;
/// How often the step between them is then halved.
const HALVINGS: usize = 12;
/// The largest factor.
const MOST: f64 = f32::MAX as f64;
/// Cosines are not divided by less.
const LEAST_COSINE: f32 = 1e-6;

/// What explains the difference between a client's BRDF x cosine and the lobes of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub enum Mistake {
    /// The lobes are your BSDF.
    None = 0,
    /// Your BSDF is `scale` times the lobes: harmless, since rays are chosen alike.
    Scaled = 1,
    /// wo points into the surface. Also where your BSDF ignores the side of wo and wo lies below.
    Wo = 2,
    /// The normal points to the other side: flip it to the side of wo, or set WIS_POINT_WHOLE_SPHERE.
    Normal = 3,
    /// Your BSDF takes wi towards the surface: wi points to the light.
    Wi = 4,
    /// The weights of all lobes are 0.
    NoWeight = 5,
    /// The weight of `lobe` should be `value` times as large, or `value` if it is 0.
    Weight = 6,
    /// Your values lack a cosine: multiply by it, or set WIS_POINT_COSINE_INCLUDED.
    CosineMissing = 7,
    /// Your values have a cosine too many: WIS_POINT_COSINE_INCLUDED is set, or you multiply twice.
    CosineTwice = 8,
    /// Your alpha is the square of `a` and `b` of GGX lobes: you pass roughness in place of its square.
    AlphaSquare = 9,
    /// Your alpha is the square root of `a` and `b` of GGX lobes.
    AlphaRoot = 10,
    /// The tangent should be rotated about the normal by `angle`; by 90 degrees: or swap `a` and `b`.
    Tangent = 11,
    /// `eta` is inverted.
    Eta = 12,
    /// Your sides and the lobes' differ: set WIS_POINT_WHOLE_SPHERE, or add a lobe that transmits.
    Sides = 13,
    /// f0 of `lobe`, and of lobes with the same f0, should be `value`.
    F0 = 14,
    /// No mistake: the lobes resemble your BSDF, of which they are 1 - `error` (docs/integrating.md).
    Resembles = 15,
    /// Less than half of your BSDF is in the lobes: two mistakes, or lobes of another kind.
    Other = 16,
    /// Your BSDF is in the lobes, but no portal faces the point: `edges[0]` x `edges[1]` points into the room.
    Portals = 17,
}

impl Mistake {
    /// A sentence for a log, in English.
    pub const fn message(self) -> &'static CStr {
        const MESSAGES: [&CStr; 18] = [
            c"the lobes are your BSDF",
            c"your BSDF is the lobes times a factor, which changes no ray",
            c"wo points into the surface, or your BSDF ignores the side of wo: wo points away from the surface",
            c"the normal points to the other side: flip it to the side of wo, or set WIS_POINT_WHOLE_SPHERE",
            c"your BSDF takes wi towards the surface: it points away from the surface, to the light",
            c"the weights of all lobes are 0",
            c"the weight of a lobe is 0 or wrong by a factor",
            c"your values lack the cosine: multiply by it, or set WIS_POINT_COSINE_INCLUDED",
            c"your values have a cosine too many: WIS_POINT_COSINE_INCLUDED by mistake, or multiplied twice",
            c"your alpha is the square of the lobes': pass roughness squared",
            c"your alpha is the square root of the lobes': it was squared twice",
            c"the tangent is rotated about the normal, or a and b are swapped (90 degrees)",
            c"eta is inverted: it is the index beyond the surface over that on the side of wo",
            c"your BSDF and the lobes scatter to different sides: WIS_POINT_WHOLE_SPHERE, or a lobe that transmits",
            c"f0 is wrong",
            c"no mistake found: the lobes resemble your BSDF",
            c"the lobes have little in common with your BSDF",
            c"no portal faces the point: edges[0] x edges[1] points into the room",
        ];
        MESSAGES[self as usize]
    }
}

/// The result of a comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// What explains the difference.
    pub mistake: Mistake,
    /// The integral of |client - lobes| over that of the larger of both, 0 to 1; a common factor does not count.
    pub error: f32,
    /// The error that is left without the mistake.
    pub explained: f32,
    /// The client's values over those of the lobes without the mistake.
    pub scale: f32,
    /// The number of the lobe, for a weight or f0.
    pub lobe: u32,
    /// For a weight: by what to multiply it, or what it should be if it is 0; for f0: what it should be. Else 0.
    pub value: f32,
    /// The angle from the point's tangent to the client's about the normal, 0 to 180 degrees. Else 0.
    pub angle: f32,
}

/// A client's BRDF x cosine: writes its luminance for each world direction, and answers whether it could.
pub type FCos<'a> = dyn FnMut(&[[f32; 3]], &mut [f32]) -> bool + 'a;

/// How much differs, and the client's values over those of the lobes.
#[derive(Clone, Copy)]
struct Fit {
    error: f64,
    scale: f64,
}

/// What is done to a value of lobes, at a cosine and where the client has another value.
type Change = fn(value: f32, cosine: f32, client: f32) -> f32;

const SAME: Change = |value, _, _| value;
/// 0 below the horizon.
const ABOVE: Change = |value, cosine, _| if cosine < 0.0 { 0.0 } else { value };
/// 0 above the horizon.
const BELOW: Change = |value, cosine, _| if cosine > 0.0 { 0.0 } else { value };
/// The client's below the horizon.
const BEYOND: Change = |value, cosine, client| if cosine < 0.0 { client } else { value };

/// A direction, the client's value there, and the solid angle that it stands for.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Seen {
    /// In map space.
    wi: [f32; 3],
    value: f32,
    weight: f32,
}

/// A point, what the client answered, and what explains that best.
struct Compared<'a> {
    point: &'a Point<'a>,
    frame: &'a Frame,
    seen: &'a mut [Seen; DIRECTIONS],
    best: Match,
    fit: Fit,
}

/// Compares a client's BRDF x cosine with the lobes of a point.
///
/// # Errors
/// What is wrong with the point; [`Status::CallbackFailed`] with the number of the direction at which the client failed, or answered a value
/// that is NaN, infinite or negative.
pub fn compare(point: &Point<'_>, frame: &Frame, f_cos: &mut FCos<'_>) -> Result<Match, Error> {
    let given = Surface::new(point, frame)?;
    let mut seen = [Seen::zeroed(); DIRECTIONS];
    let fit = Fit { error: 1.0, scale: 1.0 };
    let best =
        Match { mistake: Mistake::None, error: 0.0, explained: 0.0, scale: 1.0, lobe: 0, value: 0.0, angle: 0.0 };
    let mut compared = Compared { point, frame, seen: &mut seen, best, fit };
    compared.choose();
    compared.look(f_cos).map_err(|direction| Error::new(Status::CallbackFailed, 0).of(c"target").in_row(direction))?;
    let as_given = compared.tried(point, SAME);
    compared.fit = as_given;
    let below = if given.is_whole() { 0.0 } else { compared.below(given.normal()) };
    if as_given.error > LEAST_DIFFERENCE {
        compared.simple(below);
        compared.tangents();
        compared.lobes();
    }
    Ok(compared.verdict(as_given, below))
}

/// Value, density and cosine at some directions. Not inlined, as other steps: this is cold code, of which there should be little.
#[inline(never)]
fn lobes_at(surface: &Surface, seen: &[Seen]) -> [[f32; WIDTH]; 3] {
    let mut columns = [[0.0; WIDTH]; 3];
    for (lane, seen) in seen.iter().take(WIDTH).enumerate() {
        for (column, x) in columns.iter_mut().zip(seen.wi) {
            column[lane] = x;
        }
    }
    let local = surface.to_local(columns.map(Four::load));
    let (value, pdf) = surface.eval_apart(local);
    // From below some lobes keep their formulas, but a wo that points there is what most often is wrong.
    let value = if surface.wo()[2] > 0.0 { value } else { Four::splat(0.0) };
    [value, pdf, local[2]].map(Num::store)
}

/// Two numbers of the points of one way to draw directions.
#[inline(never)]
fn number(i: usize) -> [f32; 2] {
    hammersley(i as u32, TOGETHER as u32)
}

impl Compared<'_> {
    /// Chooses directions: over the sphere, from the lobes, from lobes that are narrower, and from lobes on other sides.
    #[inline(never)]
    fn choose(&mut self) {
        for (i, seen) in self.seen.iter_mut().enumerate().take(TOGETHER) {
            (seen.wi, seen.weight) = (direction(number(i)).to_array(), 1.0);
        }
        let narrow = self.material(squared);
        // Then the sum of all densities, which `value` holds before the client is called.
        for draws in [true, false] {
            for part in 1..DIRECTIONS / TOGETHER {
                let Some(surface) = self.drawn_from(part, &narrow) else { continue };
                if draws {
                    self.draw(part, &surface);
                } else {
                    self.add_densities(&surface);
                }
            }
        }
        for seen in self.seen.iter_mut() {
            seen.weight /= seen.value + 1.0 / SPHERE;
        }
    }

    /// The lobes of which a part of the directions is drawn, all of which count: those of the point, reversed, mirrored and narrower.
    #[inline(never)]
    fn drawn_from(&self, part: usize, narrow: &Material) -> Option<Surface> {
        let mut point = Point { weight: [[1.0; 3]; MAX_LOBES], f0: [[0.5; 3]; MAX_LOBES], ..*self.point };
        let (wo, normal) = (Vec3::from_array(point.wo), Vec3::from_array(point.normal));
        let cosine = wo.dot(normal);
        // On the side of wo, which is another than that of the point where wo lies below.
        match part {
            1 => {}
            2 => {
                point.wo = negated(point.wo);
                if cosine > 0.0 {
                    point.normal = negated(point.normal);
                }
            }
            3 => {
                point.normal = negated(point.normal);
                if cosine > 0.0 {
                    point.wo = (wo - normal * (2.0 * cosine)).to_array();
                }
            }
            _ => return Surface::new(&Point { material: narrow, ..point }, self.frame).ok(),
        }
        Surface::new(&point, self.frame).ok()
    }

    /// Draws a part of the directions.
    #[inline(never)]
    fn draw(&mut self, part: usize, surface: &Surface) {
        let seen = self.seen.chunks_mut(TOGETHER).nth(part).unwrap_or_default();
        for (first, eight) in (0..).step_by(WIDTH).zip(seen.chunks_mut(WIDTH)) {
            let mut u = [[0.0; WIDTH]; 2];
            let [across, down] = &mut u;
            for (lane, (across, down)) in across.iter_mut().zip(down).enumerate() {
                [*across, *down] = number(first + lane);
            }
            let [x, y, z] = surface.to_map(Four::apart(Sample { surface, u: u.map(Four::load) })).map(Num::store);
            for (seen, ((x, y), z)) in eight.iter_mut().zip(x.into_iter().zip(y).zip(z)) {
                // Where a lobe draws none, the normal stands for it, and does not count.
                let none = [x, y, z] == [0.0; 3];
                (seen.wi, seen.weight) = if none { (surface.normal(), 0.0) } else { ([x, y, z], 1.0) };
            }
        }
    }

    #[inline(never)]
    fn add_densities(&mut self, surface: &Surface) {
        for eight in self.seen.chunks_mut(WIDTH) {
            let [_, pdf, _] = lobes_at(surface, eight);
            for (seen, pdf) in eight.iter_mut().zip(pdf) {
                seen.value += pdf;
            }
        }
    }

    /// Calls the client.
    #[inline(never)]
    fn look(&mut self, f_cos: &mut FCos<'_>) -> Result<(), usize> {
        for (part, seen) in self.seen.chunks_mut(TOGETHER).enumerate() {
            let (mut wi, mut values) = ([[0.0; 3]; TOGETHER], [0.0; TOGETHER]);
            for (wi, seen) in wi.iter_mut().zip(seen.iter()) {
                *wi = self.frame.to_world(seen.wi);
            }
            if !f_cos(&wi, &mut values) {
                return Err(part * TOGETHER);
            }
            for (i, (seen, value)) in seen.iter_mut().zip(values).enumerate() {
                if !(0.0..=f32::MAX).contains(&value) {
                    return Err(part * TOGETHER + i);
                }
                seen.value = value;
            }
        }
        Ok(())
    }

    /// The share of the client's whole that lies below the horizon.
    #[inline(never)]
    fn below(&self, normal: [f32; 3]) -> f64 {
        let (mut below, mut all) = (0.0, f64::MIN_POSITIVE);
        for seen in self.seen.iter() {
            let part = f64::from(seen.weight) * f64::from(seen.value);
            all += part;
            if Vec3::from_array(seen.wi).dot(Vec3::from_array(normal)) < 0.0 {
                below += part;
            }
        }
        below / all
    }

    /// How well the lobes of a point, times a factor, are the client.
    fn tried(&self, point: &Point<'_>, change: Change) -> Fit {
        self.fit(None, point, change, MOST)
    }

    /// How well a point on a line from one to another is the client, and where on the line that is; without one, from black.
    #[inline(never)]
    fn fit(&self, from: Option<&Point<'_>>, to: &Point<'_>, change: Change, most: f64) -> Fit {
        let mut fit = Fit { error: 1.0, scale: 1.0 };
        let Ok(to) = Surface::new(to, self.frame) else { return fit };
        let from = from.and_then(|from| Surface::new(from, self.frame).ok());
        // First where on the line the integrals agree, then how much differs there.
        for differs in [false, true] {
            let (mut above, mut under) = (0.0, 0.0);
            for eight in self.seen.chunks(WIDTH) {
                let begin = from.as_ref().map_or([0.0; WIDTH], |from| lobes_at(from, eight)[0]);
                let [end, _, cosine] = lobes_at(&to, eight);
                let lanes = begin.into_iter().zip(end).zip(cosine);
                for (seen, ((begin, end), cosine)) in eight.iter().zip(lanes) {
                    let [begin, end] = [begin, end].map(|value| f64::from(change(value, cosine, seen.value)));
                    let (client, weight) = (f64::from(seen.value), f64::from(seen.weight));
                    if differs {
                        let lobes = begin + fit.scale * (end - begin);
                        above += weight * (client - lobes).abs();
                        under += weight * if client > lobes { client } else { lobes };
                    } else {
                        above += weight * (client - begin);
                        under += weight * (end - begin);
                    }
                }
            }
            if differs {
                fit.error = if under > 0.0 { above / under } else { 0.0 };
            } else if under != 0.0 {
                fit.scale = (above / under).max(0.0).min(most);
            }
        }
        fit
    }

    /// Keeps an explanation if it is the best.
    fn keep(&mut self, fit: Fit, explanation: Match) {
        if self.fit.error > LEAST_DIFFERENCE && fit.error < SIMPLER_FIRST * self.fit.error {
            (self.fit, self.best) = (fit, explanation);
        }
    }

    #[inline(never)]
    fn hypothesis(&mut self, mistake: Mistake, point: &Point<'_>, change: Change) {
        let fit = self.tried(point, change);
        self.keep(fit, Match { mistake, ..self.best });
    }

    /// Directions that point the other way, another power of the cosine or another side, and lobes of other shapes.
    #[inline(never)]
    fn simple(&mut self, below: f64) {
        for (mistake, wo, normal) in
            [(Mistake::Wo, true, false), (Mistake::Wi, true, true), (Mistake::Normal, false, true)]
        {
            let turned = |turns: bool, d: [f32; 3]| if turns { negated(d) } else { d };
            let (wo, normal) = (turned(wo, self.point.wo), turned(normal, self.point.normal));
            self.hypothesis(mistake, &Point { wo, normal, ..*self.point }, SAME);
        }
        let divided: Change = |value, cosine, _| value * (1.0 / max(cosine.abs(), LEAST_COSINE));
        let side = if (LEAST_BELOW..1.0 - LEAST_BELOW).contains(&below) { BEYOND } else { BELOW };
        for (mistake, change) in [
            (Mistake::CosineMissing, divided),
            (Mistake::CosineTwice, |value, cosine, _| value * cosine.abs()),
            (Mistake::Sides, ABOVE),
            (Mistake::Sides, side),
        ] {
            self.hypothesis(mistake, self.point, change);
        }
        let inverted: fn(&mut Shape) = |shape| shape.eta = 1.0 / shape.eta;
        for (mistake, change) in [
            (Mistake::AlphaSquare, squared as fn(&mut Shape)),
            (Mistake::AlphaRoot, |shape| alphas(shape, sqrt)),
            (Mistake::Eta, inverted),
        ] {
            let material = self.material(change);
            self.hypothesis(mistake, &Point { material: &material, ..*self.point }, SAME);
        }
    }

    /// The point's material, each lobe changed.
    #[inline(never)]
    fn material(&self, change: fn(&mut Shape)) -> Material {
        self.point.material.with_shapes(|lobe| {
            let mut shape = *lobe;
            change(&mut shape);
            shape
        })
    }

    /// The angle of the tangent: the best of some, and then by halves of the step.
    #[inline(never)]
    fn tangents(&mut self) {
        if !self.point.material.kinds().1 {
            return;
        }
        let mut best = (0.0, Fit { error: 1.0, scale: 1.0 });
        let mut step = 1.0 / ANGLES as f32;
        (1..ANGLES).for_each(|trial| self.rotate(step * trial as f32, &mut best));
        for _ in 0..HALVINGS {
            step *= 0.5;
            let middle = best.0;
            for angle in [middle - step, middle + step] {
                self.rotate(angle, &mut best);
            }
        }
        let (angle, fit) = best;
        if (TANGENT_IS_RIGHT..=1.0 - TANGENT_IS_RIGHT).contains(&angle) {
            self.keep(fit, Match { mistake: Mistake::Tangent, angle: 180.0 * angle, ..self.best });
        }
    }

    /// Tries a tangent that is rotated by a share of half a turn.
    #[inline(never)]
    fn rotate(&self, angle: f32, best: &mut (f32, Fit)) {
        let (sine, cosine) = sin_cos_quarters(2.0 * angle);
        let along = Vec3::from_array(self.point.tangent);
        let across = Vec3::from_array(self.point.normal).cross(along);
        let tangent = (along * cosine + across * sine).to_array();
        let fit = self.tried(&Point { tangent, ..*self.point }, SAME);
        if fit.error < best.1.error {
            *best = (angle, fit);
        }
    }

    /// Weights and reflectances, lobe by lobe.
    #[inline(never)]
    fn lobes(&mut self) {
        let point = self.point;
        let lobes = point.material.lobes();
        let mut weights = point.weight.iter().take(lobes.len());
        if !lobes.is_empty() && weights.all(|weight| luminance(*weight) == 0.0) {
            self.fit = self.tried(&Point { weight: [[1.0; 3]; MAX_LOBES], ..*point }, SAME);
            self.best = Match { mistake: Mistake::NoWeight, ..self.best };
            return;
        }
        for (lobe, shape) in lobes.iter().enumerate() {
            if lobes.len() > 1 {
                self.weight_of(lobe);
            }
            if shape.kind.is_ggx() {
                self.f0_of(lobe);
            }
        }
    }

    /// Another weight of a lobe.
    #[inline(never)]
    fn weight_of(&mut self, lobe: usize) {
        let [mut from, mut to] = [*self.point; 2];
        let (Some(none), Some(one)) = (from.weight.get_mut(lobe), to.weight.get_mut(lobe)) else { return };
        let black = luminance(*one) == 0.0;
        *none = [0.0; 3];
        if black {
            *one = [1.0; 3];
        }
        let fit = self.fit(Some(&from), &to, SAME, MOST);
        if black || !(1.0 / WEIGHT_IS_RIGHT..=WEIGHT_IS_RIGHT).contains(&fit.scale) {
            self.keep_number(Mistake::Weight, fit, lobe);
        }
    }

    /// Another f0 of a lobe, and of those that have the same: lobes of one interface have one f0.
    #[inline(never)]
    fn f0_of(&mut self, lobe: usize) {
        let [mut from, mut to] = [*self.point; 2];
        let Some(&f0) = self.point.f0.get(lobe) else { return };
        for (from, to) in from.f0.iter_mut().zip(&mut to.f0).filter(|(own, _)| **own == f0) {
            (*from, *to) = ([0.0; 3], [1.0; 3]);
        }
        let fit = self.fit(Some(&from), &to, SAME, 1.0);
        if (fit.scale - f64::from(luminance(f0))).abs() > F0_IS_RIGHT {
            self.keep_number(Mistake::F0, fit, lobe);
        }
    }

    /// Keeps an explanation by a number of a lobe, which is where on the line the lobes are the client.
    fn keep_number(&mut self, mistake: Mistake, fit: Fit, lobe: usize) {
        let value = fit.scale as f32;
        self.keep(Fit { scale: 1.0, ..fit }, Match { mistake, lobe: lobe as u32, value, ..self.best });
    }

    fn verdict(&self, as_given: Fit, below: f64) -> Match {
        let [most, share] = match self.best.mistake {
            Mistake::NoWeight => EXPLAINS_ALL,
            Mistake::CosineMissing | Mistake::CosineTwice => EXPLAINS_COSINE,
            Mistake::Wo | Mistake::Normal | Mistake::Wi if as_given.error > NOTHING => EXPLAINS_REVERSED,
            _ => EXPLAINS,
        };
        let explains = self.fit.error <= most && self.fit.error <= share * as_given.error;
        let (fit, best) = if self.best.mistake != Mistake::None && explains {
            (self.fit, self.best)
        } else {
            let mistake = if below > LEAST_BELOW {
                Mistake::Sides
            } else if as_given.error > RESEMBLES {
                Mistake::Other
            } else if self.point.portals.iter().any(Portal::is_given) && !self.point.portals.iter().any(Portal::faces) {
                Mistake::Portals
            } else if as_given.error > AGREES {
                Mistake::Resembles
            } else if (as_given.scale - 1.0).abs() > SCALE_IS_ONE {
                Mistake::Scaled
            } else {
                Mistake::None
            };
            (as_given, Match { mistake, lobe: 0, value: 0.0, angle: 0.0, ..self.best })
        };
        let [error, explained, scale] = [as_given.error, fit.error, fit.scale].map(|x| x as f32);
        Match { error, explained, scale, ..best }
    }
}

fn negated(v: [f32; 3]) -> [f32; 3] {
    v.map(|x| -x)
}

fn squared(shape: &mut Shape) {
    alphas(shape, |alpha| alpha * alpha);
}

fn alphas(shape: &mut Shape, change: fn(f32) -> f32) {
    if shape.kind.is_ggx() {
        let [least, most] = ALPHA_RANGE;
        [shape.a, shape.b] = [shape.a, shape.b].map(|alpha| change(alpha).clamp(least, most));
    }
}
