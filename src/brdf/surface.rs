//! A point with everything computed that does not depend on wi: what its lobes reflect, and directions drawn from them.

use super::ggx::{Ggx, Response};
use super::lambert;
use super::material::{Kind, MAX_LOBES, Shape};
use super::phong::Phong;
use super::point::Point;
use super::vector::{any_tangent, dot};
use crate::numeric::{self, ONE_MINUS_EPSILON, min, sqrt};
use crate::simd::{Apart, Four, Num, Whole};
use crate::sphere::{Frame, UNIT};
use crate::status::Error;
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;

/// A Phong lobe of which less than this share of its peak reaches above the horizon reflects nothing.
const FAINT: f32 = 1.0 / (1u64 << 63) as f32;

/// A lobe at a point.
#[derive(Clone, Copy, Debug)]
pub struct Lobe {
    shape: LobeShape,
    /// The luminance that does not depend on the angle to the half vector, and what Schlick's (1 - cos)^5 is multiplied by.
    fresnel: [f32; 2],
    /// The share of directions that are drawn from it, and its inverse.
    share: f32,
    inverse: f32,
}

#[derive(Clone, Copy, Debug)]
enum LobeShape {
    /// On [`UPPER`] or the other side.
    Lambert(f32),
    Ggx(Ggx),
    Phong(Phong),
    /// Seen from below: the one that directions are drawn from.
    PhongFromBelow(Phong),
    GgxTransmission(Ggx, f32),
}

/// The sign of cosines on the normal's side.
const UPPER: f32 = 1.0;
/// The bit of the sign.
const SIGN: u32 = 1 << 31;

/// A point ready to evaluate, in the space of its frame.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Tangent, bitangent and normal; the normal on the side of wo if both sides count.
    axes: [[f32; 3]; 3],
    /// wo along the axes.
    wo: [f32; 3],
    /// Whether directions on both sides count.
    whole: bool,
    cosine_included: bool,
    lobes: [Option<Lobe>; MAX_LOBES],
    count: usize,
    /// The least alpha of lobes that scatter; f32::MAX if all are diffuse.
    least_alpha: f32,
}

/// Whether numbers are from 0 to a positive one: by their bits, but for -0.
fn are_up_to(most: f32, numbers: &[f32; 3]) -> bool {
    numbers.map(f32::to_bits).into_iter().fold(0, u32::max) <= most.to_bits()
        || numbers.iter().all(|x| (0.0..=most).contains(x))
}

fn luminance(rgb: [f32; 3]) -> f32 {
    min(numeric::luminance(rgb), f32::MAX)
}

/// Luminance that does not depend on the angle to the half vector, and what Schlick's (1 - cos)^5 is multiplied by.
#[inline]
fn schlick(kind: Kind, weight: [f32; 3], f0: [f32; 3]) -> [f32; 2] {
    let all = luminance(weight);
    if !kind.is_ggx() {
        return [all, 0.0];
    }
    let at_normal = luminance([weight[0] * f0[0], weight[1] * f0[1], weight[2] * f0[2]]);
    if kind == Kind::Ggx { [at_normal, all - at_normal] } else { [all - at_normal, at_normal - all] }
}

/// About what a lobe scatters, for its values in [`schlick`], seen at a cosine.
fn reflectance(fresnel: [f32; 2], cosine: f32) -> f32 {
    if fresnel[1] == 0.0 {
        return fresnel[0];
    }
    (fresnel[0] + fresnel[1] * fifth_power(1.0 - cosine.clamp(0.0, 1.0))).max(0.0)
}

/// The share of one of some lobes in what they scatter together: equal shares if that is nothing or too much.
fn share(own: f32, total: f32, lobes: usize) -> f32 {
    if total > 0.0 && total < f32::MAX { own / total } else { 1.0 / lobes as i32 as f32 }
}

/// Those of microfacets with these weights and F0, of which none is visible from below.
#[inline(always)]
fn microfacets(shape: &Shape, [weight, f0]: [&[f32; 3]; 2], index: usize, wo: [f32; 3]) -> Result<[f32; 2], Error> {
    if !are_up_to(1.0, f0) {
        return Err(Error::range(c"f0").in_row(index));
    }
    Ok(if wo[2] > 0.0 { schlick(shape.kind, *weight, *f0) } else { [0.0; 2] })
}

/// Microfacets seen from a direction, on the upper side at least.
#[inline(always)]
fn seen(shape: &Shape, wo: [f32; 3]) -> Ggx {
    Ggx::new([shape.a, shape.b], if wo[2] > 0.0 { wo } else { [0.0, 0.0, 1.0] })
}

/// Turns what each of some lobes scatters into shares of what all do.
#[inline(never)]
fn share_out<'a>(lobes: impl Iterator<Item = &'a mut Lobe>, total: f32, count: usize) {
    for lobe in lobes {
        lobe.share = share(lobe.share, total, count);
        lobe.inverse = 1.0 / lobe.share;
    }
}

/// About the share of each lobe in what a point scatters, seen at a cosine above 0: those of [`Surface::shares`], without the rest.
pub fn shares(point: &Point<'_>, cosine: f32) -> [f32; MAX_LOBES] {
    let mut all = [0.0; MAX_LOBES];
    let lobes = point.material.lobes();
    for (own, (shape, (weight, f0))) in all.iter_mut().zip(lobes.iter().zip(point.weight.iter().zip(&point.f0))) {
        *own = reflectance(schlick(shape.kind, *weight, *f0), cosine);
    }
    let total = all.iter().sum();
    all.map(|own| share(own, total, lobes.len()))
}

impl Surface {
    /// A point without lobes, seen along its normal. No constant: that would be copied, and here lobes are just none.
    #[inline(always)]
    pub fn empty() -> Surface {
        Surface {
            axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            wo: [0.0, 0.0, 1.0],
            whole: false,
            cosine_included: false,
            lobes: [None, None, None, None],
            count: 0,
            least_alpha: f32::MAX,
        }
    }

    /// Its lobes.
    #[inline(always)]
    fn lobes(&self) -> impl Iterator<Item = &Lobe> {
        self.lobes.iter().take(self.count).flatten()
    }

    /// Checks a point and prepares it in map space.
    ///
    /// # Errors
    /// What is wrong with it.
    #[inline(always)]
    pub fn new(point: &Point<'_>, frame: &Frame) -> Result<Surface, Error> {
        let mut surface = Surface::empty();
        surface.set(point, frame)?;
        Ok(surface)
    }

    /// As [`Surface::new`], in place of [`Surface::empty`]: nothing is copied.
    ///
    /// # Errors
    /// As [`Surface::new`].
    #[inline(never)]
    pub fn set(&mut self, point: &Point<'_>, frame: &Frame) -> Result<(), Error> {
        let [normal, view] = directions(point, frame)?;
        let material = point.material;
        let (transmits, is_anisotropic) = material.kinds();
        self.whole = point.whole_sphere || transmits;
        self.cosine_included = point.cosine_included;
        let normal = if self.whole && view.dot(normal) < 0.0 { -normal } else { normal };
        let [x, y, z] = point.tangent;
        // Nothing times what is not finite is no number.
        if x * 0.0 + y * 0.0 + z * 0.0 != 0.0 {
            return Err(Error::transform(c"tangent"));
        }
        let tangent = if is_anisotropic {
            tangent(normal, point.tangent, frame).ok_or(Error::transform(c"tangent"))?
        } else {
            Vec3::from_array(any_tangent(normal.to_array()))
        };
        let bitangent = normal.cross(tangent);
        self.wo = [view.dot(tangent), view.dot(bitangent), view.dot(normal)];
        self.axes = [tangent.to_array(), bitangent.to_array(), normal.to_array()];
        self.count = material.lobes().len();
        let above = self.wo[2] > 0.0;
        let mut total = 0.0;
        let parameters = point.weight.iter().zip(&point.f0);
        for (index, ((lobe, shape), (weight, f0))) in
            self.lobes.iter_mut().zip(material.lobes()).zip(parameters).enumerate()
        {
            if !are_up_to(f32::MAX, weight) {
                return Err(Error::range(c"weight").in_row(index));
            }
            let all = luminance(*weight);
            let (own, alpha) = match shape.kind {
                Kind::Lambert => {
                    *lobe =
                        Some(Lobe { shape: LobeShape::Lambert(UPPER), fresnel: [all, 0.0], share: all, inverse: 1.0 });
                    (all, f32::MAX)
                }
                Kind::Ggx => {
                    let fresnel = microfacets(shape, [weight, f0], index, self.wo)?;
                    let own = reflectance(fresnel, self.wo[2]);
                    *lobe =
                        Some(Lobe { shape: LobeShape::Ggx(seen(shape, self.wo)), fresnel, share: own, inverse: 1.0 });
                    (own, shape.alpha())
                }
                _ => {
                    let made = lobe.insert(Lobe::rare(shape, [weight, f0], index, self.wo)?);
                    (made.share, shape.alpha())
                }
            };
            total += own;
            if own > 0.0 {
                self.least_alpha = min(self.least_alpha, alpha);
            }
        }
        if !above && !(total > 0.0) {
            // As without lobes.
            self.count = 0;
        }
        match (self.count, &mut self.lobes) {
            (1, [Some(only), ..]) => only.share = 1.0,
            (count, lobes) => share_out(lobes.iter_mut().take(count).flatten(), total, count),
        }
        Ok(())
    }

    /// Whether directions on both sides count.
    pub fn is_whole(&self) -> bool {
        self.whole
    }

    /// Whether BRDF x cosine is a constant times the cosine, above the horizon alone.
    #[inline]
    pub fn is_diffuse(&self) -> bool {
        !self.whole && self.lobes().all(|lobe| matches!(lobe.shape, LobeShape::Lambert(UPPER)))
    }

    /// What the cosine is multiplied by where BRDF x cosine is that, above the horizon alone.
    #[inline]
    pub fn diffuse(&self) -> Option<f32> {
        if self.count == 0 || self.cosine_included || !self.is_diffuse() {
            return None;
        }
        let albedo: f32 = self.lobes().map(|lobe| lobe.fresnel[0]).sum();
        (albedo < f32::MAX).then_some(albedo * FRAC_1_PI)
    }

    /// The least alpha of lobes that scatter, and what corresponds to it of others; f32::MAX if all are diffuse.
    pub fn least_alpha(&self) -> f32 {
        self.least_alpha
    }

    /// The normal, in map space, on the side of wo if both sides count.
    pub fn normal(&self) -> [f32; 3] {
        self.axes[2]
    }

    /// The direction to the viewer along tangent, bitangent and normal.
    pub fn wo(&self) -> [f32; 3] {
        self.wo
    }

    /// Tangent, bitangent and normal in map space.
    pub fn axes(&self) -> [[f32; 3]; 3] {
        self.axes
    }

    /// The mirror direction of wo, in map space.
    pub fn mirror(&self) -> [f32; 3] {
        let [x, y, z] = self.wo;
        self.to_map::<f32>([-x, -y, z])
    }

    /// The share of directions that [`Surface::sample`] draws from each lobe; all 0 without lobes.
    pub fn shares(&self) -> [f32; MAX_LOBES] {
        self.lobes.map(|lobe| lobe.map_or(0.0, |lobe| lobe.share))
    }

    /// How many lobes there are.
    pub fn lobe_count(&self) -> usize {
        self.count
    }

    /// Directions of map space along tangent, bitangent and normal.
    #[inline(always)]
    pub fn to_local<F: Num>(&self, d: [F; 3]) -> [F; 3] {
        [dot(d, self.axes[0]), dot(d, self.axes[1]), dot(d, self.axes[2])]
    }

    /// The inverse of [`Surface::to_local`].
    #[inline(always)]
    pub fn to_map<F: Num>(&self, w: [F; 3]) -> [F; 3] {
        let [t, b, n] = self.axes;
        [
            w[0] * t[0] + w[1] * b[0] + w[2] * n[0],
            w[0] * t[1] + w[1] * b[1] + w[2] * n[1],
            w[0] * t[2] + w[1] * b[2] + w[2] * n[2],
        ]
    }

    /// The luminance of BRDF x cosine in many directions, times `scale`; below the horizon of a hemisphere it goes on with negative sign, as if
    /// mirrored. Lobe by lobe: what is read of one, and the branch to its kind, are half of what a register of directions takes.
    #[inline(always)]
    pub fn values<F: Num, L: Local<F>>(&self, d: [&[L::Given]; 3], out: &mut [f32], local: &L, scale: [f32; 2]) {
        let mut all = Values { surface: self, local, scale, d, out, first: true, last: self.count <= 1 };
        if self.count == 0 {
            all.add(|_: [F; 3]| F::splat(1.0));
        }
        // Copies: what is written must not be what is read here, or it would be read for each register again.
        if let (
            [
                Some(base @ Lobe { shape: LobeShape::Lambert(side), .. }),
                Some(coat @ Lobe { shape: LobeShape::Ggx(ggx), .. }),
                ..,
            ],
            2,
        ) = (&self.lobes, self.count)
        {
            // Plastic.
            let (base, side, coat, ggx) = (*base, *side, *coat, *ggx);
            all.last = true;
            return all.add(|wi| base.diffuse(side, wi).0 + coat.glossy(&ggx.reflect(wi)).0);
        }
        for (index, &lobe) in self.lobes().enumerate() {
            (all.first, all.last) = (index == 0, index + 1 == self.count);
            match &lobe.shape {
                LobeShape::Lambert(side) => all.add(|wi| lobe.diffuse(*side, wi).0),
                LobeShape::Ggx(ggx) => all.add(|wi| lobe.glossy(&ggx.reflect(wi)).0),
                LobeShape::GgxTransmission(ggx, eta) => all.add(|wi| lobe.glossy(&ggx.transmit(wi, *eta)).0),
                LobeShape::Phong(phong) => all.add(|wi| lobe.phong(phong, wi).0),
                LobeShape::PhongFromBelow(drawn) => all.add(|wi| lobe.phong_from_below(drawn, self.wo, wi).0),
            }
        }
    }

    /// The luminance of BRDF x cosine in local directions, finite; and the density with which [`Surface::sample`] draws them.
    /// Without lobes: the cosine, drawn with its distribution. What most surfaces take is inlined, without a loop; others are evaluated apart.
    #[inline(always)]
    pub fn eval<F: Num>(&self, wi: [F; 3]) -> (F, F) {
        let factor = if self.cosine_included { F::splat(1.0) } else { wi[2].abs() };
        let (value, pdf) = match (&self.lobes, self.count) {
            ([Some(lobe @ Lobe { shape: LobeShape::Lambert(side), .. }), ..], 1) => lobe.diffuse(*side, wi),
            ([Some(lobe @ Lobe { shape: LobeShape::Ggx(ggx), .. }), ..], 1) => lobe.glossy(&ggx.reflect(wi)),
            // Plastic.
            (
                [
                    Some(base @ Lobe { shape: LobeShape::Lambert(side), .. }),
                    Some(coat @ Lobe { shape: LobeShape::Ggx(ggx), .. }),
                    ..,
                ],
                2,
            ) => {
                let ((value, pdf), (own, density)) = (base.diffuse(*side, wi), coat.glossy(&ggx.reflect(wi)));
                (value + own, pdf + density)
            }
            _ => {
                let (value, pdf) = F::apart(Eval { surface: self, wi });
                (value, pdf)
            }
        };
        ((value * factor).min(F::splat(f32::MAX)), pdf)
    }

    /// [`Surface::eval`], apart whatever the lobes: for calls that a renderer makes while it is written.
    pub fn eval_apart<F: Num>(&self, wi: [F; 3]) -> (F, F) {
        let factor = if self.cosine_included { F::splat(1.0) } else { wi[2].abs() };
        let (value, pdf) = F::apart(Eval { surface: self, wi });
        ((value * factor).min(F::splat(f32::MAX)), pdf)
    }

    /// [`Surface::eval`] of any lobes, but for the cosine.
    #[inline(always)]
    fn eval_all<F: Num>(&self, wi: [F; 3]) -> (F, F) {
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        if self.count == 0 {
            let cosine = wi[2];
            return match self.whole {
                true => (one, F::splat(0.5) * lambert::pdf(cosine.abs())),
                false => (F::only(zero.lt(cosine), one), lambert::pdf(cosine)),
            };
        }
        let (mut value, mut pdf) = (zero, zero);
        for lobe in self.lobes() {
            let (own, density) = match &lobe.shape {
                LobeShape::Lambert(side) => lobe.diffuse(*side, wi),
                LobeShape::Ggx(ggx) => lobe.glossy(&ggx.reflect(wi)),
                LobeShape::GgxTransmission(ggx, eta) => lobe.glossy(&ggx.transmit(wi, *eta)),
                LobeShape::Phong(phong) => lobe.phong(phong, wi),
                LobeShape::PhongFromBelow(drawn) => lobe.phong_from_below(drawn, self.wo, wi),
            };
            (value, pdf) = (value + own, pdf + density);
        }
        (value, pdf)
    }

    /// Local directions of lobes for numbers in (0, 1): the first number chooses the lobe, too. 0 in all components, which is none, where a
    /// microfacet reflects to the lower side, or transmits to the upper: [`Surface::eval`] counts no density there.
    #[inline(always)]
    pub fn sample<F: Num>(&self, u: [F; 2]) -> [F; 3] {
        match (&self.lobes, self.count) {
            ([Some(lobe @ Lobe { shape: LobeShape::Lambert(_) | LobeShape::Ggx(_), .. }), ..], 1) => lobe.sample(u),
            _ => {
                let [x, y, z] = F::apart(Sample { surface: self, u });
                [x, y, z]
            }
        }
    }

    /// [`Surface::sample`] of any lobes.
    #[inline(always)]
    fn sample_all<F: Num>(&self, u: [F; 2]) -> [F; 3] {
        let (zero, half) = (F::splat(0.0), F::splat(0.5));
        if self.count == 0 {
            let upper = u[0].lt(half);
            let first = if self.whole { F::select(upper, u[0] + u[0], u[0] + u[0] - 1.0) } else { u[0] };
            let [x, y, z] = lambert::sample([first, u[1]]);
            return [x, y, if self.whole { F::select(upper, z, zero - z) } else { z }];
        }
        let mut wi = [zero, zero, F::splat(1.0)];
        let mut before = 0.0;
        for lobe in self.lobes().filter(|lobe| lobe.share > 0.0) {
            let here = F::splat(before).le(u[0]);
            let last = F::splat(ONE_MINUS_EPSILON);
            let first = ((u[0] - before) * lobe.inverse).max(zero).min(last);
            before += lobe.share;
            let [x, y, z] = lobe.sample([first, u[1]]);
            wi = [F::select(here, x, wi[0]), F::select(here, y, wi[1]), F::select(here, z, wi[2])];
        }
        wi
    }
}

/// What makes directions local that [`Surface::values`] is given. No closure: the compiler would leave it to the baseline's instructions.
pub trait Local<F> {
    /// A component of a direction.
    type Given;
    /// A register of local directions.
    fn local(&self, d: [&[Self::Given]; 3]) -> [F; 3];
}

/// Replaces numbers of directions, a whole number of registers of them.
#[inline(always)]
pub fn replace<F: Num, T>([x, y, z]: [&[T]; 3], out: &mut [f32], value: impl Fn(F, [&[T]; 3]) -> F) {
    let directions = x.chunks_exact(F::WIDTH).zip(y.chunks_exact(F::WIDTH)).zip(z.chunks_exact(F::WIDTH));
    for (((x, y), z), out) in directions.zip(out.chunks_exact_mut(F::WIDTH)) {
        value(F::read(out), [x, y, z]).write(out, 0);
    }
}

/// [`Surface::values`], while lobes are added.
struct Values<'a, L, T> {
    surface: &'a Surface,
    local: &'a L,
    scale: [f32; 2],
    d: [&'a [T]; 3],
    out: &'a mut [f32],
    /// Whether nothing was added so far, and whether nothing will be.
    first: bool,
    last: bool,
}

impl<L, T> Values<'_, L, T> {
    /// Adds values of a lobe in directions on the upper side.
    #[inline(always)]
    fn add<F: Num>(&mut self, value: impl Fn([F; 3]) -> F)
    where
        L: Local<F, Given = T>,
    {
        let Values { surface, local, scale, d, out, first, last } = self;
        // What differs between surfaces is masked: branches would take more in each register.
        let bits = |set: bool, bits: u32| F::Whole::splat(if set { bits } else { 0 });
        let (sign, rest) = (bits(!surface.whole, SIGN), F::Whole::splat(if surface.whole { !0 } else { !SIGN }));
        let (cosine, one) = (bits(!surface.cosine_included, !SIGN), bits(surface.cosine_included, 1f32.to_bits()));
        let (before, last, scale) = (bits(!*first, !0), *last, scale.map(F::splat));
        replace(*d, out, |sum: F, d| {
            let [x, y, z] = local.local(d);
            let own = value([x, y, F::from_bits(z.to_bits() & rest)]);
            let sum = own + F::from_bits(sum.to_bits() & before);
            if !last {
                return sum;
            }
            let value = (sum * F::from_bits(z.to_bits() & cosine | one)).min(F::splat(f32::MAX));
            F::from_bits(value.to_bits() & rest | z.to_bits() & sign) * scale[0] * scale[1]
        });
    }
}

struct Eval<'a, F: Num> {
    surface: &'a Surface,
    wi: [F; 3],
}

impl<F: Num> Apart<F> for Eval<'_, F> {
    type Output = (F, F);

    #[inline(always)]
    fn run(self) -> (F, F) {
        self.surface.eval_all(self.wi)
    }
}

pub(super) struct Sample<'a, F: Num> {
    pub(super) surface: &'a Surface,
    pub(super) u: [F; 2],
}

impl<F: Num> Apart<F> for Sample<'_, F> {
    type Output = [F; 3];

    #[inline(always)]
    fn run(self) -> [F; 3] {
        self.surface.sample_all(self.u)
    }
}

impl Lobe {
    /// A lobe of a kind that few materials have, seen from a direction.
    #[inline(never)]
    fn rare(shape: &Shape, parameters: [&[f32; 3]; 2], index: usize, wo: [f32; 3]) -> Result<Lobe, Error> {
        // From below clients evaluate other lobes than microfacets as from above.
        let mut fresnel = [luminance(*parameters[0]), 0.0];
        let seen = match shape.kind {
            Kind::GgxTransmission => {
                fresnel = microfacets(shape, parameters, index, wo)?;
                LobeShape::GgxTransmission(seen(shape, wo), shape.eta)
            }
            Kind::Phong if wo[2] > 0.0 => LobeShape::Phong(Phong::new(shape.a, wo)),
            Kind::Phong => {
                let [x, y, _] = wo;
                if !(libm::powf(min(sqrt(x * x + y * y), 1.0), shape.a) > FAINT) {
                    fresnel = [0.0; 2];
                }
                LobeShape::PhongFromBelow(Phong::drawn(shape.a, wo))
            }
            _ => LobeShape::Lambert(-UPPER),
        };
        Ok(Lobe { shape: seen, fresnel, share: reflectance(fresnel, wo[2]), inverse: 1.0 })
    }

    /// Directions of the lobe.
    #[inline(always)]
    fn sample<F: Num>(&self, u: [F; 2]) -> [F; 3] {
        let zero = F::splat(0.0);
        match &self.shape {
            LobeShape::Lambert(side) => {
                let [x, y, z] = lambert::sample(u);
                [x, y, z * *side]
            }
            LobeShape::Ggx(ggx) => {
                let wi = ggx.sample_reflection(u);
                only(zero.lt(wi[2]), wi)
            }
            LobeShape::GgxTransmission(ggx, eta) => {
                let wi = ggx.sample_transmission(u, *eta);
                only(wi[2].lt(zero), wi)
            }
            LobeShape::Phong(phong) | LobeShape::PhongFromBelow(phong) => phong.sample(u),
        }
    }

    // The luminance of the BRDF in local directions, and the lobe's part of their density.

    #[inline(always)]
    fn diffuse<F: Num>(&self, side: f32, [.., z]: [F; 3]) -> (F, F) {
        let cosine = z * side;
        let value = F::only(F::splat(0.0).lt(cosine), F::splat(self.fresnel[0]) * FRAC_1_PI);
        (value, F::splat(self.share) * lambert::pdf(cosine))
    }

    #[inline(always)]
    fn glossy<F: Num>(&self, response: &Response<F>) -> (F, F) {
        (response.value * self.schlick(response.cosine), F::splat(self.share) * response.pdf)
    }

    #[inline(always)]
    fn phong<F: Num>(&self, phong: &Phong, wi: [F; 3]) -> (F, F) {
        let power = phong.power(wi);
        let value = F::splat(self.fresnel[0]) * phong.norm() * power;
        (F::only(F::splat(0.0).lt(wi[2]), value), F::splat(self.share) * phong.pdf_norm() * power)
    }

    #[inline(always)]
    fn phong_from_below<F: Num>(&self, drawn: &Phong, [x, y, z]: [f32; 3], wi: [F; 3]) -> (F, F) {
        let value = F::splat(self.fresnel[0]) * drawn.norm() * drawn.power_about([-x, -y, z], wi);
        let density = F::splat(self.share) * drawn.pdf_norm() * drawn.power(wi);
        (F::only(F::splat(0.0).lt(wi[2]), value), density)
    }

    /// The Fresnel factor for a cosine of wo and the half vector.
    #[inline(always)]
    fn schlick<F: Num>(&self, cosine: F) -> F {
        let grazing = F::splat(1.0) - cosine;
        let squared = grazing * grazing;
        F::splat(self.fresnel[0]) + F::splat(self.fresnel[1]) * (squared * squared * grazing)
    }
}

/// A direction where the mask is set, elsewhere 0.
#[inline(always)]
fn only<F: Num>(mask: F::Mask, [x, y, z]: [F; 3]) -> [F; 3] {
    [F::only(mask, x), F::only(mask, y), F::only(mask, z)]
}

fn fifth_power(x: f32) -> f32 {
    let squared = x * x;
    squared * squared * x
}

/// The normal and wo in map space, of unit length: side by side, they take half the instructions.
#[inline(always)]
fn directions(point: &Point<'_>, frame: &Frame) -> Result<[Vec3; 2], Error> {
    let both = [0, 1, 2].map(|k: usize| Four::load([point.normal[k], point.wo[k], point.normal[k], point.wo[k]]));
    let [x, y, z] = both;
    let squared = x * x + y * y + z * z;
    let fits = Four::bits((squared - 1.0).abs().lt(Four::splat(UNIT)));
    if fits & 0b11 != 0b11 {
        return Err(Error::transform(if fits & 0b01 == 0 { c"normal" } else { c"wo" }));
    }
    let length = squared.sqrt();
    let [[a, d, ..], [b, e, ..], [c, f, ..]] = frame.to_map(both.map(|component| component / length)).map(Num::store);
    Ok([Vec3::new(a, b, c), Vec3::new(d, e, f)])
}

/// The client's tangent in map space, made orthogonal to the normal, of unit length.
#[inline(never)]
fn tangent(normal: Vec3, given: [f32; 3], frame: &Frame) -> Option<Vec3> {
    let given = Vec3::from(frame.to_map(given));
    let rejected = given - normal * normal.dot(given);
    let length = sqrt(rejected.length_squared());
    if !(length > 1e-3 && length < f32::MAX) {
        return None;
    }
    // Once more: a tangent almost along the normal left only digits that rounding had touched.
    let tangent = rejected / length;
    let tangent = tangent - normal * normal.dot(tangent);
    Some(tangent / sqrt(tangent.length_squared()))
}
