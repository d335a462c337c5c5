//! Trowbridge-Reitz (GGX) microfacets: reflection and transmission, with height-correlated Smith shadowing.
//!
//! Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces"; visible normals are drawn by spherical caps
//! (Dupuy and Benyoub 2023). The half vector is never normalised: D needs only its squared length.

use super::vector::dot;
use crate::simd::Num;
use crate::sphere::{azimuth, sin_cos_quarters};
use bytemuck::{Pod, Zeroable};
use core::f32::consts::FRAC_1_PI;

/// How far below the surface a half vector may seem to lie by rounding.
const LEVEL: f32 = 1e-6;

/// Directions on the rim of the normals that let directions through.
const RIM: u32 = 128;
/// How much farther than those normals reach.
const BESIDE: f32 = 1.02;
/// Normals that stand steepest are drawn so many times as often as in the mean: what they let through is masked least.
const STEEPEST: f32 = 1.5;
/// Azimuths may be off by this much of a turn.
const ROUNDING: f32 = 1e-5;

/// Numbers of normals: a range of azimuths, and of 1 less the second number from 0 on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Refracting {
    /// Where azimuths begin, 0 to 1.
    pub start: f32,
    /// How many of them, up to 1.
    pub width: f32,
    /// How much of the second number.
    pub rest: f32,
}

impl Refracting {
    /// Those of all normals.
    pub const ALL: Refracting = Refracting { start: 0.0, width: 1.0, rest: 1.0 };

    /// Their part of all numbers.
    pub fn area(&self) -> f32 {
        self.width * self.rest
    }

    fn is_all(&self) -> bool {
        *self == Refracting::ALL
    }

    /// Whether the range is one.
    pub fn is_sound(&self) -> bool {
        (0.0..=1.0).contains(&self.start)
            && [self.width, self.rest].iter().all(|x| (f32::MIN_POSITIVE..=1.0).contains(x))
    }
}

/// A distribution of microfacets seen from a direction, in the frame of the surface.
#[derive(Clone, Copy, Debug)]
pub struct Ggx {
    /// Roughness along tangent and bitangent, and its inverse.
    alpha: [f32; 2],
    inverse: [f32; 2],
    /// 1 / (pi alpha_x alpha_y).
    norm: f32,
    wo: [f32; 3],
    /// The length of wo stretched by alpha.
    wo_length: f32,
    /// The density of a visible normal is this times D times its cosine to wo.
    visible: f32,
    /// wo stretched and normalised.
    stretched: [f32; 3],
}

/// What a direction has with such a surface.
#[derive(Clone, Copy)]
pub struct Response<F: Num> {
    /// The BRDF without Fresnel term.
    pub value: F,
    /// The density of the direction if visible normals are drawn.
    pub pdf: F,
    /// The cosine of wo and the half vector.
    pub cosine: F,
}

/// What a direction has with the half vector across the surface: that, of any length; D of it and its cosine to wo; the density of the
/// direction over that of the half vector; its density if visible normals are drawn; and whether wo and the direction see both sides.
struct Across<F: Num> {
    h: [F; 3],
    d: F,
    cos_o: F,
    jacobian: F,
    pdf: F,
    passes: F::Mask,
}

impl Ggx {
    /// The distribution seen from `wo`, on the upper side.
    pub fn new(alpha: [f32; 2], wo: [f32; 3]) -> Ggx {
        let [x, y, z] = [alpha[0] * wo[0], alpha[1] * wo[1], wo[2]];
        let wo_length = Num::sqrt(x * x + y * y + z * z);
        let scale = 1.0 / wo_length;
        let stretched = [x * scale, y * scale, z * scale];
        let inverse = alpha.map(|a| 1.0 / a);
        let norm = FRAC_1_PI * inverse[0] * inverse[1];
        Ggx { alpha, inverse, norm, wo, wo_length, visible: 2.0 / (wo[2] + wo_length), stretched }
    }

    /// D of a half vector of any length, and its squared length.
    #[inline(always)]
    fn distribution<F: Num>(&self, h: [F; 3]) -> (F, F) {
        let squared = h[0] * h[0] + h[1] * h[1] + h[2] * h[2];
        let (x, y) = (h[0] * self.inverse[0], h[1] * self.inverse[1]);
        let ratio = squared / (x * x + y * y + h[2] * h[2]).max(F::splat(f32::MIN_POSITIVE));
        (F::splat(self.norm) * ratio * ratio, squared)
    }

    /// The length of a direction stretched by alpha.
    #[inline(always)]
    fn length<F: Num>(&self, w: [F; 3]) -> F {
        let (x, y) = (F::splat(self.alpha[0]) * w[0], F::splat(self.alpha[1]) * w[1]);
        (x * x + y * y + w[2] * w[2]).sqrt()
    }

    /// Reflection into a direction on the upper side; 0 below it.
    #[inline(always)]
    pub fn reflect<F: Num>(&self, wi: [F; 3]) -> Response<F> {
        let (zero, half, one) = (F::splat(0.0), F::splat(0.5), F::splat(1.0));
        let wo_z = F::splat(self.wo[2]);
        let h = [wi[0] + self.wo[0], wi[1] + self.wo[1], wi[2] + wo_z];
        let (d, squared) = self.distribution(h);
        let smith = wi[2] * self.wo_length + wo_z * self.length(wi);
        let above = zero.lt(wi[2]);
        let value = half * d / smith.max(F::splat(f32::MIN_POSITIVE));
        let pdf = d * (0.25 * self.visible);
        Response {
            value: F::only(above, finite(value)),
            pdf: F::only(above, finite(pdf)),
            cosine: (half * squared.sqrt()).min(one),
        }
    }

    /// Transmission into a direction on the lower side, for `eta` = index beyond the surface over index on the side of wo; 0 above
    /// it. Radiance is scaled by the squared ratio of indices as it is in Walter et al.
    #[inline(always)]
    pub fn transmit<F: Num>(&self, wi: [F; 3], eta: f32) -> Response<F> {
        let zero = F::splat(0.0);
        let Across { d, cos_o, jacobian, pdf, passes, .. } = self.across(wi, eta);
        let smith = wi[2].abs() * self.wo_length + self.length(wi) * self.wo[2];
        let below = F::and(wi[2].lt(zero), passes);
        let value = F::splat(2.0) * d * cos_o * jacobian / smith.max(F::splat(f32::MIN_POSITIVE));
        Response {
            value: F::only(below, finite(value)),
            pdf: F::only(below, pdf),
            cosine: cos_o.max(zero).min(F::splat(1.0)),
        }
    }

    /// What a direction beyond the surface has with its half vector.
    #[inline(always)]
    fn across<F: Num>(&self, wi: [F; 3], eta: f32) -> Across<F> {
        let (zero, one, index) = (F::splat(0.0), F::splat(1.0), F::splat(eta));
        let h = [index * wi[0] + self.wo[0], index * wi[1] + self.wo[1], index * wi[2] + self.wo[2]];
        let (d, squared) = self.distribution(h);
        let scale = one.copysign(h[2]) / squared.sqrt().max(F::splat(f32::MIN_POSITIVE));
        let cos_o = dot(h, self.wo) * scale;
        let cos_i = (wi[0] * h[0] + wi[1] * h[1] + wi[2] * h[2]) * scale;
        // wo . h + eta wi . h is the length of h with its sign.
        let jacobian = index * index * cos_i.abs() / squared.max(F::splat(f32::MIN_POSITIVE));
        let pdf = finite(d * self.visible * cos_o * jacobian);
        Across { h, d, cos_o, jacobian, pdf, passes: F::and(zero.lt(cos_o), cos_i.lt(zero)) }
    }

    /// The density over the whole sphere of [`Ggx::sample_reflection`], also where it leaves the surface's upper side.
    #[inline(always)]
    pub fn reflected<F: Num>(&self, wi: [F; 3]) -> F {
        let zero = F::splat(0.0);
        let [x, y, z] = self.wo;
        let (d, _) = self.distribution([wi[0] + x, wi[1] + y, wi[2] + z]);
        let density = d * (0.25 * self.visible);
        // Normals have an upper side, but for rounding.
        F::only((zero - LEVEL).lt(wi[2] + z), finite(density))
    }

    /// Where the numbers of normals lie that let directions through, for `eta` as in [`Ggx::transmit`]. Beyond the critical angle those are few, and far
    /// from the surface's own.
    // Apart, since its caller needs its stack.
    #[inline(never)]
    pub fn refracting(&self, eta: f32) -> Refracting {
        let least = Num::sqrt(Num::max(1.0 - eta * eta, 0.0));
        // The normal of the numbers' pole, about which azimuths turn: where it lets directions through, normals of any azimuth may.
        let pole = self.unit_normal::<f32>([0.0; 2]);
        if !(dot(self.wo, pole) < least) {
            return Refracting::ALL;
        }
        let [x, y, z] = self.wo;
        // Two directions across wo: the first is level.
        let level = Num::max(Num::sqrt(x * x + y * y), f32::MIN_POSITIVE);
        let (first, second) = ([y / level, -x / level, 0.0], [-x * z / level, -y * z / level, level]);
        let sine = eta;
        let on_rim = |k: u32| {
            let (sin, cos) = sin_cos_quarters((k % RIM) as f32 * 4.0 / RIM as f32);
            let at = |k: usize| least * self.wo[k] + sine * (cos * first[k] + sin * second[k]);
            self.numbers([at(0), at(1), Num::max(at(2), 0.0)])
        };
        let [mut turn, mut rest] = on_rim(0);
        let (mut from, mut to) = (turn, turn);
        for k in 1..RIM {
            let [azimuth, own] = on_rim(k);
            // The shorter way from the direction before, beyond a whole turn if need be.
            let step = azimuth - turn;
            turn += step - libm::roundf(step);
            (from, to, rest) = (Num::min(from, turn), Num::max(to, turn), Num::max(rest, own));
        }
        let beside = (to - from) * (BESIDE - 1.0) + ROUNDING;
        let (start, width, rest) = (from - beside, to - from + 2.0 * beside, Num::min(rest * BESIDE, 1.0));
        if !(width < 1.0) {
            return Refracting { rest, ..Refracting::ALL };
        }
        Refracting { start: start - libm::floorf(start), width, rest }
    }

    /// The numbers of a visible normal of any length: the azimuth, and 1 less the second one.
    #[inline(always)]
    fn numbers<F: Num>(&self, h: [F; 3]) -> [F; 2] {
        let [sx, sy, sz] = self.stretched;
        let [x, y, z] = [h[0] * self.inverse[0], h[1] * self.inverse[1], h[2]];
        let squared = (x * x + y * y + z * z).max(F::splat(f32::MIN_POSITIVE));
        // What the normal of a sphere mirrors the view into: its height over the lowest one is 2 (s . h) h_z.
        let twice = (x * sx + y * sy + z * sz) * 2.0 / squared;
        [azimuth(twice * x - sx, twice * y - sy) * 0.25, twice * z * (1.0 / (1.0 + sz))]
    }

    /// The density over the whole sphere of [`Ggx::sample_refraction`].
    #[inline(always)]
    pub fn transmitted<F: Num>(&self, wi: [F; 3], eta: f32, of: &Refracting) -> F {
        let Across { h, pdf, passes, .. } = self.across(wi, eta);
        let through = F::only(passes, pdf);
        // Normals that let nothing through reflect.
        let half = [wi[0] + self.wo[0], wi[1] + self.wo[1], wi[2] + self.wo[2]];
        let cosine = F::splat(0.25) * (half[0] * half[0] + half[1] * half[1] + half[2] * half[2]);
        let total = F::splat(eta * eta).le(F::splat(1.0) - cosine);
        let reflected = F::only(total, self.reflected(wi));
        if of.is_all() {
            return through + reflected;
        }
        finite(through * self.favoured(h, of) + reflected * self.favoured(half, of))
    }

    /// How much more often than by all numbers a normal of any length is drawn.
    #[inline(always)]
    fn favoured<F: Num>(&self, h: [F; 3], of: &Refracting) -> F {
        let zero = F::splat(0.0);
        let [azimuth, rest] = self.numbers(h);
        let turn = azimuth - of.start;
        let turn = F::select(turn.lt(zero), turn + 1.0, turn);
        let share = rest * (1.0 / of.rest);
        let inside = F::and(turn.le(F::splat(of.width)), share.le(F::splat(1.0)));
        F::only(inside, (F::splat(STEEPEST) - share) * (1.0 / of.area()))
    }

    /// A direction behind a visible normal, or, where it lets nothing through, before it.
    #[inline(always)]
    pub fn sample_refraction<F: Num>(&self, u: [F; 2], eta: f32, of: &Refracting) -> [F; 3] {
        let one = F::splat(1.0);
        let turn = u[0] * of.width + of.start;
        let turn = F::select(one.le(turn), turn - 1.0, turn);
        // With a density of 3/2 - share.
        let share = if of.is_all() {
            one - u[1]
        } else {
            F::splat(STEEPEST) - (F::splat(STEEPEST * STEEPEST) - (one - u[1]) * 2.0).sqrt()
        };
        let h = self.unit_normal_of(turn, share * of.rest);
        let (total, beyond, cos_o) = self.bent(h, eta);
        let along = F::select(total, cos_o + cos_o, beyond);
        let back = F::select(total, one, F::splat(1.0 / eta));
        [along * h[0] - back * self.wo[0], along * h[1] - back * self.wo[1], along * h[2] - back * self.wo[2]]
    }

    /// Whether a normal of unit length lets nothing through, else its part of the refracted direction; and its cosine to wo.
    #[inline(always)]
    fn bent<F: Num>(&self, h: [F; 3], eta: f32) -> (F::Mask, F, F) {
        let (zero, one, inverse) = (F::splat(0.0), F::splat(1.0), F::splat(1.0 / eta));
        let cos_o = dot(h, self.wo);
        let squared = one - inverse * inverse * (one - cos_o * cos_o);
        (squared.le(zero), inverse * cos_o - squared.max(zero).sqrt(), cos_o)
    }

    /// As [`Ggx::unit_normal`], for an azimuth and 1 less the second number, however small.
    #[inline(always)]
    fn unit_normal_of<F: Num>(&self, turn: F, rest: F) -> [F; 3] {
        let [sx, sy, sz] = self.stretched;
        let (sine, cosine) = sin_cos_quarters(turn * 4.0);
        let height = rest * (1.0 + sz);
        // 1 - (height - s_z)^2, without the difference of two numbers near 1.
        let radius = ((F::splat(1.0 + sz) - height) * (height + (1.0 - sz))).max(F::splat(0.0)).sqrt();
        let [ax, ay] = self.alpha;
        let (x, y) = ((radius * cosine + sx) * ax, (radius * sine + sy) * ay);
        let scale = F::splat(1.0) / (x * x + y * y + height * height).max(F::splat(f32::MIN_POSITIVE)).sqrt();
        [x * scale, y * scale, height * scale]
    }

    /// A visible normal of any length, and that squared.
    #[inline(always)]
    fn normal<F: Num>(&self, u: [F; 2]) -> ([F; 3], F) {
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let [sx, sy, sz] = self.stretched;
        let (sine, cosine) = sin_cos_quarters(u[0] * 4.0);
        let z = (one - u[1]) * (1.0 + sz) - sz;
        let radius = (one - z * z).max(zero).sqrt();
        let [ax, ay] = self.alpha;
        let x = (radius * cosine + sx) * ax;
        let y = (radius * sine + sy) * ay;
        let z = (z + sz).max(zero);
        ([x, y, z], (x * x + y * y + z * z).max(F::splat(f32::MIN_POSITIVE)))
    }

    /// A visible normal, of unit length.
    #[inline(always)]
    fn unit_normal<F: Num>(&self, u: [F; 2]) -> [F; 3] {
        let (h, squared) = self.normal(u);
        let scale = F::splat(1.0) / squared.sqrt();
        [h[0] * scale, h[1] * scale, h[2] * scale]
    }

    /// A reflected direction; below the surface if it is none.
    #[inline(always)]
    pub fn sample_reflection<F: Num>(&self, u: [F; 2]) -> [F; 3] {
        let (h, squared) = self.normal(u);
        let twice = dot(h, self.wo) * 2.0 / squared;
        [twice * h[0] - self.wo[0], twice * h[1] - self.wo[1], twice * h[2] - self.wo[2]]
    }

    /// A transmitted direction; above the surface if there is none (total reflection).
    #[inline(always)]
    pub fn sample_transmission<F: Num>(&self, u: [F; 2], eta: f32) -> [F; 3] {
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let h = self.unit_normal(u);
        let (total, along, _) = self.bent(h, eta);
        let beyond = |k: usize| along * h[k] - F::splat(1.0 / eta) * self.wo[k];
        [F::select(total, zero, beyond(0)), F::select(total, zero, beyond(1)), F::select(total, one, beyond(2))]
    }
}

/// The number, or 0 where it is not finite.
#[inline(always)]
fn finite<F: Num>(x: F) -> F {
    F::only(x.lt(F::splat(f32::MAX)), x)
}
