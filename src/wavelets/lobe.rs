//! Materials: sums of Lambert, GGX, Phong and tabulated lobes as a plain copyable query, and what a product asks of any BRDF.

use crate::numeric::{LUMINANCE, max, min, sqrt};
use crate::sphere::unit;
use crate::status::{Error, Result};
use crate::wavelets::lanes::vector::{V3, add, dot, splat, to_arrays};
use crate::wavelets::lanes::{LANES, Lanes};
use crate::wavelets::query::{
    Lobe, Query, WIS_WAVELET_LOBE_GGX, WIS_WAVELET_LOBE_LAMBERT, WIS_WAVELET_LOBE_PHONG, WIS_WAVELET_LOBE_TABLE,
    WIS_WAVELET_MAX_LOBES, WIS_WAVELET_QUERY_COSINE_INCLUDED, WIS_WAVELET_QUERY_WHOLE_SPHERE,
};
use crate::wavelets::table::Table;
use core::f32::consts::PI;
use core::ffi::CStr;
use glam::Vec3;

/// The narrowest and the widest microfacet distribution that a lobe may have.
pub const ALPHA_RANGE: [f32; 2] = [1e-5, 16.0];
/// The sharpest Phong lobe.
pub const MAX_EXPONENT: f32 = 1e7;
/// What is above the horizon is continued below it, negative, so that what is bilinear between both crosses 0 near the
/// horizon. Of Lambert's lobes this share of what they are in the mirror image: with all of it few samples are lost, but the
/// bilinear function is far too low where a cell is bent ...
const CONTINUED_LAMBERT: f32 = 0.4;
/// ... and of other broad lobes this: they rise steeply from the horizon and then less.
const CONTINUED: f32 = 0.15;
/// Lobes of at least this half-width, in radians, are broad. Narrower ones are not continued: their mirror image would reach
/// above the horizon.
const BROAD: f32 = 0.2;

/// Where a narrow lobe is concentrated: an ellipse of directions, about which cells are refined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// The middle, a world direction of unit length.
    pub direction: Vec3,
    /// The short axis of the ellipse, unit length and normal to the direction.
    pub across: Vec3,
    /// The half-widths in radians along the long and the short axis.
    pub radii: [f32; 2],
}

impl Peak {
    /// A disc.
    pub fn disc(direction: Vec3, radius: f32) -> Peak {
        Peak { direction, across: any_tangent(direction), radii: [radius; 2] }
    }

    /// The long axis of the ellipse.
    pub fn along(&self) -> Vec3 {
        self.direction.cross(self.across)
    }
}

/// Which share of a lobe that is not Lambert's is continued below the horizon.
pub fn share_of_lobe(peak: Option<Peak>) -> f32 {
    if peak.is_none_or(|peak| peak.radii[0] >= BROAD) { CONTINUED } else { 0.0 }
}

/// What a product asks of a BRDF at a shading point.
pub trait Brdf {
    /// The normal of the hemisphere outside which the BRDF is 0, or `None` for the whole sphere.
    fn hemisphere(&self) -> Option<Vec3>;
    /// Whether it can be above 0 anywhere.
    fn may_reflect(&self) -> bool;
    /// How many rounds of eight splits show what a base of 8 x 8 cells does not, besides those that peaks ask for.
    fn rounds(&self) -> u32;
    /// The narrow lobes, the first ones first.
    fn peaks(&self) -> [Option<Peak>; MAX_PEAKS];
    /// Writes the luminance of BRDF x cosine, finite, for the directions that are asked for; what it writes to other lanes
    /// is as sound but means nothing. It is not negative above the horizon, and not positive below it.
    ///
    /// # Errors
    /// `Status::CallbackFailed` if there is no such value.
    fn eval<F: Lanes>(&mut self, wi: &[Asked<F>], f_cos: &mut [F]) -> Result<()>;
}

/// The most peaks that a BRDF may have.
pub const MAX_PEAKS: usize = WIS_WAVELET_MAX_LOBES;

/// Eight world directions, of which some are asked for.
#[derive(Clone, Copy)]
pub struct Asked<F> {
    /// The directions.
    pub wi: V3<F>,
    /// The lanes that count, as bits.
    pub lanes: u32,
}

/// Eight directions in the frame of tangent, bitangent and normal. Those below the horizon, if there is one, are seen as their
/// mirror images above it.
struct Look<F: Lanes> {
    local: V3<F>,
    /// The cosine, or 1 if it is part of the BRDF.
    factor: F,
    /// Those below the horizon.
    below: F::Mask,
}

impl<F: Lanes> Look<F> {
    /// The value above the horizon, and its negative below, of which a share is kept.
    #[inline(always)]
    fn continued(&self, value: F, share: f32) -> F {
        F::select(self.below, value * F::splat(-share), value)
    }
}

/// A lobe with everything precomputed that does not depend on wi.
#[derive(Clone, Copy)]
enum Prepared {
    Lambert { albedo: f32 },
    Ggx { alpha: [f32; 2], norm: f32, wo_length: f32, fresnel: [f32; 2] },
    Phong { exponent: f32, norm: f32 },
    Table { weight: f32 },
}

/// A query with its lobes prepared for evaluation.
#[derive(Clone, Copy)]
pub struct Lobes<'a> {
    normal: Vec3,
    tangent: Vec3,
    bitangent: Vec3,
    /// wo in the frame of tangent, bitangent and normal, on the upper side.
    wo: Vec3,
    /// +1, or -1 if wo lies below the surface and the whole sphere counts.
    side: f32,
    flags: u32,
    count: usize,
    /// How many rounds of splits the one with the most detail deserves.
    rounds: u32,
    table: Table<'a>,
    prepared: [Prepared; WIS_WAVELET_MAX_LOBES],
    /// Which share of each is continued below the horizon.
    shares: [f32; WIS_WAVELET_MAX_LOBES],
    raw: &'a [Lobe; WIS_WAVELET_MAX_LOBES],
}

impl<'a> Lobes<'a> {
    /// Checks and prepares a query; a tabulated lobe needs a table.
    ///
    /// # Errors
    /// `Status::InvalidTransform` for a normal or wo that is not of unit length, or a tangent that is needed and
    /// is parallel to the normal; `Status::InvalidArgument` for anything else out of its range. The lobes come first, so
    /// that a wrong alpha is not taken for an anisotropy without tangent.
    pub fn new(query: &'a Query, table: Option<Table<'a>>) -> core::result::Result<Lobes<'a>, Error> {
        if query.flags & !(WIS_WAVELET_QUERY_WHOLE_SPHERE | WIS_WAVELET_QUERY_COSINE_INCLUDED) != 0 {
            return Err(Error::range(c"flags"));
        }
        let lobes = query.lobe.get(..query.lobe_count as usize).ok_or(Error::range(c"lobe_count"))?;
        for (lobe, fields) in lobes.iter().zip(&FIELDS) {
            check(lobe, table.is_some()).map_err(|field| Error::range(fields[field as usize]))?;
        }
        let normal = unit(query.normal).ok_or(Error::transform(c"normal"))?;
        let world_wo = unit(query.wo).ok_or(Error::transform(c"wo"))?;
        let anisotropic = lobes.iter().any(|l| l.kind == WIS_WAVELET_LOBE_GGX && l.a != l.b);
        let tangent = tangent_frame(normal, query.tangent, anisotropic).ok_or(Error::transform(c"tangent"))?;
        let bitangent = normal.cross(tangent);
        let mut wo = Vec3::new(world_wo.dot(tangent), world_wo.dot(bitangent), world_wo.dot(normal));
        let side = if query.flags & WIS_WAVELET_QUERY_WHOLE_SPHERE != 0 && wo.z < 0.0 { -1.0 } else { 1.0 };
        wo.z *= side;
        let mut prepared = [Prepared::Lambert { albedo: 0.0 }; WIS_WAVELET_MAX_LOBES];
        for (slot, lobe) in prepared.iter_mut().zip(lobes) {
            *slot = prepare(lobe, wo);
        }
        let count = lobes.len();
        let mut all = Lobes {
            normal,
            tangent,
            bitangent,
            wo,
            side,
            flags: query.flags,
            count,
            rounds: lobes.iter().map(rounds_for).max().unwrap_or(0),
            table: table.unwrap_or(Table::NOTHING).seen(wo),
            prepared,
            shares: [0.0; WIS_WAVELET_MAX_LOBES],
            raw: &query.lobe,
        };
        all.shares = all.prepared.map(|lobe| all.share(&lobe));
        Ok(all)
    }

    /// Eight directions as the lobes see them.
    #[inline(always)]
    fn look<F: Lanes>(&self, wi: V3<F>) -> Look<F> {
        let cosine = F::splat(self.side) * dot(wi, splat(self.normal.to_array()));
        let factor = if self.flags & WIS_WAVELET_QUERY_COSINE_INCLUDED != 0 { F::splat(1.0) } else { cosine.abs() };
        let (x, y) = (dot(wi, splat(self.tangent.to_array())), dot(wi, splat(self.bitangent.to_array())));
        if self.is_whole() {
            return Look { local: [x, y, cosine], factor, below: F::mask(0) };
        }
        Look { local: [x, y, cosine.abs()], factor, below: cosine.le(F::splat(0.0)) }
    }

    /// Whether the whole sphere counts: there is no horizon.
    #[inline(always)]
    fn is_whole(&self) -> bool {
        self.flags & WIS_WAVELET_QUERY_WHOLE_SPHERE != 0
    }

    /// Which share of a lobe is continued below the horizon; nothing if it does not become 0 there.
    fn share(&self, lobe: &Prepared) -> f32 {
        let becomes_0 = self.flags & (WIS_WAVELET_QUERY_WHOLE_SPHERE | WIS_WAVELET_QUERY_COSINE_INCLUDED) == 0;
        match lobe {
            Prepared::Lambert { .. } if becomes_0 => CONTINUED_LAMBERT,
            _ if becomes_0 => share_of_lobe(self.peak(lobe)),
            _ => 0.0,
        }
    }

    /// The luminance of a tabulated lobe. Not inlined: copies for several directions would fill the stack of a preparation.
    #[inline(never)]
    fn tabulated<F: Lanes>(&self, look: &Look<F>, weight: f32) -> F {
        // The table holds the cosine itself.
        self.table.at_wide(look.local) * F::splat(weight)
    }

    /// The sum of the lobes' luminances, finite.
    #[inline(always)]
    fn bounded<F: Lanes>(&self, sum: F) -> F {
        if self.is_whole() || self.wo.z > 0.0 {
            sum.max(F::splat(-f32::MAX)).min(F::splat(f32::MAX))
        } else {
            F::splat(0.0)
        }
    }

    /// RGB of BRDF x cosine, the tabulated lobes as grey as their table.
    pub fn rgb(&self, wi: Vec3) -> [f32; 3] {
        self.coloured(wi, [&self.table; 3])
    }

    /// RGB of BRDF x cosine, with a table for each channel that [`Lobes::seen`] turned.
    pub fn coloured(&self, wi: Vec3, tables: [&Table; 3]) -> [f32; 3] {
        [0, 1, 2].map(|c: usize| {
            let channel = |v: [f32; 3]| v.get(c).copied().unwrap_or(0.0);
            self.sum(wi, tables.get(c).copied().unwrap_or(&self.table), |lobe, raw, shape, grazing| {
                let weight = channel(raw.weight);
                match lobe {
                    Prepared::Lambert { .. } => shape * (weight / PI),
                    Prepared::Ggx { .. } => {
                        let f0 = channel(raw.f0);
                        shape * (weight * (f0 + (1.0 - f0) * grazing))
                    }
                    Prepared::Phong { exponent, .. } => shape * (weight * phong_norm(*exponent)),
                    Prepared::Table { .. } => shape * weight,
                }
            })
        })
    }

    /// A table as this view sees it.
    pub fn seen<'b>(&self, table: Table<'b>) -> Table<'b> {
        table.seen(self.wo)
    }

    /// The colour of the lobes where no direction is given: the sum of their weights, of GGX times f0.
    pub fn tint(&self) -> [f32; 3] {
        let lobes = self.raw.iter().take(self.count);
        lobes.fold([0.0; 3], |[r, g, b], lobe| {
            let [f, e, d] = if lobe.kind == WIS_WAVELET_LOBE_GGX { lobe.f0 } else { [1.0; 3] };
            let [x, y, z] = lobe.weight;
            [r + x * f, g + y * e, b + z * d].map(|c| min(c, f32::MAX))
        })
    }

    /// The mirror direction of wo.
    fn mirror(&self) -> Vec3 {
        self.world(Vec3::new(-self.wo.x, -self.wo.y, self.wo.z))
    }

    /// A direction of the lobes' frame in world space.
    fn world(&self, local: Vec3) -> Vec3 {
        self.tangent * local.x + self.bitangent * local.y + self.normal * (local.z * self.side)
    }

    /// Whether a lobe reflects anything.
    fn matters(&self, lobe: &Prepared) -> bool {
        lobe.matters() && (!matches!(lobe, Prepared::Table { .. }) || self.table.matters())
    }

    /// Where a lobe is concentrated; `None` if nowhere.
    fn peak(&self, lobe: &Prepared) -> Option<Peak> {
        match *lobe {
            Prepared::Lambert { .. } => None,
            Prepared::Ggx { alpha, .. } => Some(self.ggx_peak(alpha)),
            Prepared::Phong { exponent, .. } => Some(Peak::disc(self.mirror(), phong_half_angle(exponent))),
            Prepared::Table { .. } => {
                let (direction, radius) = self.table.peak()?;
                Some(Peak::disc(self.world(direction), radius))
            }
        }
    }

    /// The peak of a GGX lobe. A half vector that leans by an angle in the plane of incidence turns wi by twice that
    /// angle, but one that leans across the plane only by `2 cos(theta_o)` times it: at grazing view the lobe is a
    /// narrow blade.
    fn ggx_peak(&self, alpha: [f32; 2]) -> Peak {
        let horizontal = sqrt(self.wo.x * self.wo.x + self.wo.y * self.wo.y);
        let (x, y) = if horizontal > 0.0 { (self.wo.x / horizontal, self.wo.y / horizontal) } else { (1.0, 0.0) };
        let along = sqrt(x * x * alpha[0] * alpha[0] + y * y * alpha[1] * alpha[1]);
        let across = sqrt(y * y * alpha[0] * alpha[0] + x * x * alpha[1] * alpha[1]);
        let narrowed = across * max(self.wo.z, min(along, 1.0));
        Peak {
            direction: self.mirror(),
            across: self.tangent * -y + self.bitangent * x,
            radii: [max(along, narrowed), narrowed],
        }
    }

    /// The sum over the lobes of `value(lobe, its parameters, shape x cosine, Schlick's grazing term)`.
    #[inline(always)]
    fn sum(&self, wi: Vec3, table: &Table, value: impl Fn(&Prepared, &Lobe, f32, f32) -> f32) -> f32 {
        let cosine = self.side * wi.dot(self.normal);
        let reflects = cosine > 0.0 && self.wo.z > 0.0;
        if !reflects && self.flags & WIS_WAVELET_QUERY_WHOLE_SPHERE == 0 {
            return 0.0;
        }
        let local = Vec3::new(wi.dot(self.tangent), wi.dot(self.bitangent), cosine);
        let factor = if self.flags & WIS_WAVELET_QUERY_COSINE_INCLUDED != 0 { 1.0 } else { cosine.abs() };
        let lobes = self.prepared.iter().zip(self.raw).take(self.count);
        let sum = lobes.fold(0.0, |sum, (lobe, raw)| {
            if matches!(lobe, Prepared::Table { .. }) {
                return sum + value(lobe, raw, table.at(local), 0.0);
            }
            let (shape, grazing) = lobe.shape(self.wo, local);
            sum + value(lobe, raw, shape * factor, grazing)
        });
        // Products of extreme weights and sharp lobes stay finite.
        min(max(sum, 0.0), f32::MAX)
    }
}

impl Brdf for Lobes<'_> {
    fn hemisphere(&self) -> Option<Vec3> {
        if self.flags & WIS_WAVELET_QUERY_WHOLE_SPHERE != 0 { None } else { Some(self.normal) }
    }

    fn may_reflect(&self) -> bool {
        let lit = self.wo.z > 0.0 || self.flags & WIS_WAVELET_QUERY_WHOLE_SPHERE != 0;
        lit && self.prepared.iter().take(self.count).any(|lobe| self.matters(lobe))
    }

    fn rounds(&self) -> u32 {
        self.rounds
    }

    fn peaks(&self) -> [Option<Peak>; MAX_PEAKS] {
        let mut peaks = [None; MAX_PEAKS];
        let lit = self.prepared.iter().take(self.count).filter(|lobe| self.matters(lobe) && self.wo.z > 0.0);
        for (slot, peak) in peaks.iter_mut().zip(lit.filter_map(|lobe| self.peak(lobe))) {
            *slot = Some(peak);
        }
        peaks
    }

    /// Lobe by lobe: what a lobe needs is then prepared once for all directions.
    #[inline(always)]
    fn eval<F: Lanes>(&mut self, wi: &[Asked<F>], f_cos: &mut [F]) -> Result<()> {
        f_cos.fill(F::splat(0.0));
        for (lobe, &share) in self.prepared.iter().zip(&self.shares).take(self.count) {
            match *lobe {
                Prepared::Lambert { albedo } => {
                    for (sum, asked) in f_cos.iter_mut().zip(wi) {
                        let look = self.look(asked.wi);
                        *sum = *sum + look.continued(look.factor * F::splat(albedo), share);
                    }
                }
                Prepared::Table { weight } => {
                    for (sum, asked) in f_cos.iter_mut().zip(wi) {
                        let look = self.look(asked.wi);
                        *sum = *sum + look.continued(self.tabulated(&look, weight), share);
                    }
                }
                _ if !(self.wo.z > 0.0) => {}
                Prepared::Ggx { .. } => {
                    for (sum, asked) in f_cos.iter_mut().zip(wi) {
                        let look = self.look(asked.wi);
                        *sum = *sum + look.continued(lobe.ggx(self.wo, &look), share);
                    }
                }
                Prepared::Phong { norm, .. } => {
                    for (sum, asked) in f_cos.iter_mut().zip(wi) {
                        let look = self.look(asked.wi);
                        *sum = *sum + look.continued(lobe.phong(self.wo, &look, norm), share);
                    }
                }
            }
        }
        for sum in f_cos {
            *sum = self.bounded(*sum);
        }
        Ok(())
    }
}

impl Prepared {
    /// Whether the lobe's weight is above 0.
    fn matters(&self) -> bool {
        match *self {
            Prepared::Table { weight } => weight > 0.0,
            Prepared::Lambert { albedo } => albedo > 0.0,
            Prepared::Ggx { fresnel: [constant, slope], .. } => constant + slope > 0.0,
            Prepared::Phong { norm, .. } => norm > 0.0,
        }
    }

    /// The lobe's value without its weights and without the cosine, and Schlick's `(1 - wi.h)^5`.
    #[inline(always)]
    fn shape(&self, wo: Vec3, wi: Vec3) -> (f32, f32) {
        match *self {
            Prepared::Lambert { .. } => (1.0, 0.0),
            Prepared::Table { .. } => (0.0, 0.0),
            _ if !(wi.z > 0.0 && wo.z > 0.0) => (0.0, 0.0),
            Prepared::Ggx { alpha: [a, b], norm, wo_length, .. } => {
                // The half vector stays unnormalised: its length gives wi.h, and D needs only its square.
                let h = wi + wo;
                let squared = h.length_squared();
                let (x, y) = (h.x / a, h.y / b);
                let slope = x * x + y * y + h.z * h.z;
                let ratio = squared / slope;
                let wi_length = Vec3::new(a * wi.x, b * wi.y, wi.z).length();
                let smith = wi.z * wo_length + wo.z * wi_length;
                let cosine = min(0.5 * sqrt(squared), 1.0);
                (finite(norm * ratio * ratio / smith), fifth_power(1.0 - cosine))
            }
            Prepared::Phong { exponent, .. } => {
                let cosine = wi.z * wo.z - wi.x * wo.x - wi.y * wo.y;
                (if cosine > 0.0 { libm::powf(min(cosine, 1.0), exponent) } else { 0.0 }, 0.0)
            }
        }
    }
}

impl Prepared {
    /// The luminance of a GGX lobe in eight directions.
    #[inline(always)]
    fn ggx<F: Lanes>(&self, wo: Vec3, look: &Look<F>) -> F {
        let Prepared::Ggx { alpha: [a, b], norm, wo_length, fresnel: [constant, slope] } = *self else {
            return F::splat(0.0);
        };
        let (zero, one, wi) = (F::splat(0.0), F::splat(1.0), look.local);
        let h = add(wi, splat(wo.to_array()));
        let squared = dot(h, h);
        let (x, y) = (h[0] / F::splat(a), h[1] / F::splat(b));
        let stretched = x * x + y * y + h[2] * h[2];
        let ratio = squared / stretched;
        let flat = [F::splat(a) * wi[0], F::splat(b) * wi[1], wi[2]];
        let smith = wi[2] * F::splat(wo_length) + F::splat(wo.z) * dot(flat, flat).sqrt();
        let cosine = (F::splat(0.5) * squared.sqrt()).min(one);
        let shape = F::splat(norm) * ratio * ratio / smith;
        let finite = F::select(shape.lt(F::splat(f32::MAX)), shape, zero);
        let grazing = one - cosine;
        let squared = grazing * grazing;
        let fresnel = F::splat(constant) + F::splat(slope) * (squared * squared * grazing);
        F::select(zero.lt(wi[2]), finite * look.factor * fresnel, zero)
    }

    /// The luminance of a Phong lobe in eight directions. Not inlined, for the stack's sake.
    #[inline(never)]
    fn phong<F: Lanes>(&self, wo: Vec3, look: &Look<F>, norm: f32) -> F {
        let [x, y, z] = to_arrays(look.local);
        let mut shape = [0.0; LANES];
        for (i, shape) in shape.iter_mut().enumerate() {
            let i = i & (LANES - 1);
            *shape = self.shape(wo, Vec3::new(x[i], y[i], z[i])).0;
        }
        F::from_array(shape) * look.factor * F::splat(norm)
    }
}

fn finite(x: f32) -> f32 {
    if x < f32::MAX { x } else { 0.0 }
}

fn fifth_power(x: f32) -> f32 {
    let squared = x * x;
    squared * squared * x
}

fn phong_norm(exponent: f32) -> f32 {
    (exponent + 2.0) / (2.0 * PI)
}

/// Where the lobe has fallen to half its peak: acos(2^(-1 / (s + 1))).
fn phong_half_angle(exponent: f32) -> f32 {
    libm::acosf(libm::exp2f(-1.0 / (exponent + 1.0)))
}

/// A measured lobe may have any shape; a peak says where the others have theirs.
fn rounds_for(lobe: &Lobe) -> u32 {
    match lobe.kind {
        WIS_WAVELET_LOBE_LAMBERT => 0,
        WIS_WAVELET_LOBE_TABLE => 2,
        _ => 1,
    }
}

/// A field of a lobe.
#[derive(Clone, Copy)]
enum Field {
    Kind,
    Weight,
    F0,
    A,
    B,
}

/// The fields' names in C, lobe by lobe.
const FIELDS: [[&CStr; 5]; WIS_WAVELET_MAX_LOBES] = [
    [c"lobe[0].kind", c"lobe[0].weight", c"lobe[0].f0", c"lobe[0].a", c"lobe[0].b"],
    [c"lobe[1].kind", c"lobe[1].weight", c"lobe[1].f0", c"lobe[1].a", c"lobe[1].b"],
    [c"lobe[2].kind", c"lobe[2].weight", c"lobe[2].f0", c"lobe[2].a", c"lobe[2].b"],
    [c"lobe[3].kind", c"lobe[3].weight", c"lobe[3].f0", c"lobe[3].a", c"lobe[3].b"],
];

/// Whether a lobe is one; else the first field out of its range.
fn check(lobe: &Lobe, has_table: bool) -> core::result::Result<(), Field> {
    let known = match lobe.kind {
        WIS_WAVELET_LOBE_LAMBERT | WIS_WAVELET_LOBE_GGX | WIS_WAVELET_LOBE_PHONG => true,
        WIS_WAVELET_LOBE_TABLE => has_table,
        _ => false,
    };
    let (is_ggx, is_phong) = (lobe.kind == WIS_WAVELET_LOBE_GGX, lobe.kind == WIS_WAVELET_LOBE_PHONG);
    let is_alpha = |a: f32| (ALPHA_RANGE[0]..=ALPHA_RANGE[1]).contains(&a);
    let checks = [
        (known, Field::Kind),
        (lobe.weight.iter().all(|w| (0.0..=f32::MAX).contains(w)), Field::Weight),
        (!is_ggx || lobe.f0.iter().all(|f| (0.0..=1.0).contains(f)), Field::F0),
        (!is_ggx || is_alpha(lobe.a), Field::A),
        (!is_ggx || is_alpha(lobe.b), Field::B),
        (!is_phong || (0.0..=MAX_EXPONENT).contains(&lobe.a), Field::A),
    ];
    checks.iter().find(|(holds, _)| !holds).map_or(Ok(()), |(_, field)| Err(*field))
}

/// Prepares a lobe that was checked.
fn prepare(lobe: &Lobe, wo: Vec3) -> Prepared {
    let luminance = |v: [f64; 3]| (LUMINANCE[0] * v[0] + LUMINANCE[1] * v[1] + LUMINANCE[2] * v[2]) as f32;
    let weight = lobe.weight.map(f64::from);
    match lobe.kind {
        WIS_WAVELET_LOBE_GGX => {
            let alpha = [lobe.a, lobe.b];
            let [r, g, b] = lobe.f0.map(f64::from);
            let normal = [weight[0] * r, weight[1] * g, weight[2] * b];
            let rest = [weight[0] * (1.0 - r), weight[1] * (1.0 - g), weight[2] * (1.0 - b)];
            Prepared::Ggx {
                alpha,
                norm: 0.5 / (PI * alpha[0] * alpha[1]),
                wo_length: Vec3::new(alpha[0] * wo.x, alpha[1] * wo.y, wo.z).length(),
                fresnel: [luminance(normal), luminance(rest)],
            }
        }
        WIS_WAVELET_LOBE_TABLE => Prepared::Table { weight: luminance(weight) },
        WIS_WAVELET_LOBE_PHONG => Prepared::Phong { exponent: lobe.a, norm: luminance(weight) * phong_norm(lobe.a) },
        _ => Prepared::Lambert { albedo: luminance(weight) / PI },
    }
}

/// A unit tangent normal to `normal`: the client's, made orthogonal, or any if it is not needed and all 0.
fn tangent_frame(normal: Vec3, tangent: [f32; 3], needed: bool) -> Option<Vec3> {
    let given = Vec3::from_array(tangent);
    let rejected = given - normal * normal.dot(given);
    let length = rejected.length();
    if length > 1e-3 && length < f32::MAX {
        return Some(rejected / length);
    }
    if needed || tangent.iter().any(|t| !t.is_finite()) {
        return None;
    }
    Some(any_tangent(normal))
}

/// A unit vector normal to a unit vector: Frisvad's method in the branch-free form of Duff et al. 2017.
fn any_tangent(normal: Vec3) -> Vec3 {
    let sign = if normal.z < 0.0 { -1.0 } else { 1.0 };
    let a = -1.0 / (sign + normal.z);
    Vec3::new(1.0 + sign * normal.x * normal.x * a, sign * normal.x * normal.y * a, -sign * normal.x)
}
