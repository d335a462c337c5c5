//! The shape of a material: what its lobes are, apart from where they are used and how strongly they reflect there.

use crate::numeric::{ContentHash, min, sqrt};
use crate::status::Error;
use bytemuck::{Pod, Zeroable};
use core::ffi::CStr;

/// The most lobes of a material.
pub const MAX_LOBES: usize = 4;
/// The narrowest and the widest microfacet distribution that a lobe may have.
pub const ALPHA_RANGE: [f32; 2] = [1e-5, 16.0];
/// The sharpest Phong lobe.
pub const MAX_EXPONENT: f32 = 1e7;
/// Ratios of refractive indices, 1 excepted: light would not be deflected, and such a lobe is none.
pub const ETA_RANGE: [f32; 2] = [0.1, 10.0];
/// How near to 1 a ratio may be.
pub const ETA_DISTANCE: f32 = 1e-3;

/// A kind of lobe: the number that C has for it.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct Kind(u32);

#[allow(non_upper_case_globals)]
impl Kind {
    /// weight / pi.
    pub const Lambert: Kind = Kind(1);
    /// weight F D G / (4 cos cos), Schlick's Fresnel term.
    pub const Ggx: Kind = Kind(2);
    /// weight (a + 2) / (2 pi) max(0, r.wi)^a with r the mirror direction of wo.
    pub const Phong: Kind = Kind(3);
    /// Transmission through GGX microfacets: weight (1 - F) times Walter et al. 2007, Eq. 21.
    pub const GgxTransmission: Kind = Kind(5);
    /// weight / pi on the side opposite to wo.
    pub const LambertTransmission: Kind = Kind(6);
}

impl Kind {
    /// The kind with this number.
    pub fn from_code(code: u32) -> Option<Kind> {
        matches!(code, 1..=3 | 5..=6).then_some(Kind(code))
    }

    /// Its number.
    pub const fn code(self) -> u32 {
        self.0
    }

    /// Whether the lobe lies on the side opposite to wo.
    pub fn transmits(self) -> bool {
        matches!(self, Kind::GgxTransmission | Kind::LambertTransmission)
    }

    /// Whether the lobe has a roughness along each axis.
    pub fn is_ggx(self) -> bool {
        matches!(self, Kind::Ggx | Kind::GgxTransmission)
    }
}

/// The shape of a lobe.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Shape {
    /// What it is.
    pub kind: Kind,
    /// GGX: alpha along the tangent. Phong: the exponent.
    pub a: f32,
    /// GGX: alpha along the bitangent.
    pub b: f32,
    /// GGX transmission: index of refraction beyond the surface over that on the side of wo.
    pub eta: f32,
}

impl Shape {
    /// Diffuse reflection.
    pub const LAMBERT: Shape = Shape { kind: Kind::Lambert, a: 0.0, b: 0.0, eta: 1.0 };

    /// Microfacets of this roughness.
    pub fn ggx(a: f32, b: f32) -> Shape {
        Shape { kind: Kind::Ggx, a, b, eta: 1.0 }
    }

    /// By how much microfacets turn a direction that has this cosine, across the plane of incidence, over how much they turn what they
    /// mirror at normal incidence. Reflection: twice a normal's own turn. Refraction: `cos t - cosine / eta` of it, with the cosine of what
    /// the mean normal lets through; beyond the critical angle that normal lets nothing through, and others spread it as mirrors do.
    pub fn bend(&self, cosine: f32) -> f32 {
        let square = 1.0 - (1.0 - cosine * cosine) / (self.eta * self.eta);
        match self.kind {
            Kind::GgxTransmission if square > 0.0 => min(0.5 * (sqrt(square) - cosine.abs() / self.eta).abs(), 1.0),
            _ => 1.0,
        }
    }

    /// The smaller alpha, or that of mirrors about as narrow; f32::MAX if it is diffuse.
    #[inline]
    pub fn alpha(&self) -> f32 {
        match self.kind {
            Kind::Ggx | Kind::GgxTransmission => self.bend(1.0) * min(self.a, self.b),
            Kind::Phong => sqrt(2.0 / (self.a + 2.0)),
            _ => f32::MAX,
        }
    }

    /// The first field that is out of its range.
    pub fn invalid(&self) -> Option<&'static CStr> {
        let alpha = |a: f32| (ALPHA_RANGE[0]..=ALPHA_RANGE[1]).contains(&a);
        match self.kind {
            kind if Kind::from_code(kind.code()).is_none() => Some(c"kind"),
            Kind::Phong => (!(0.0..=MAX_EXPONENT).contains(&self.a)).then_some(c"a"),
            Kind::Ggx | Kind::GgxTransmission if !alpha(self.a) => Some(c"a"),
            Kind::Ggx | Kind::GgxTransmission if !alpha(self.b) => Some(c"b"),
            Kind::Ggx => None,
            Kind::GgxTransmission => {
                let bends = (ETA_RANGE[0]..=ETA_RANGE[1]).contains(&self.eta) && (self.eta - 1.0).abs() >= ETA_DISTANCE;
                (!bends).then_some(c"eta")
            }
            _ => None,
        }
    }
}

/// Up to four lobes, as C has them.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Material {
    /// Its bytes: `wis_material.size`.
    size: u32,
    count: u32,
    lobes: [Shape; MAX_LOBES],
    /// The seal: a hash of the lobes, which [`Material::new`] checked; 0 without lobes that were.
    hash: u64,
}

impl Material {
    /// A material without lobes: reflects alike in all directions.
    pub const NONE: Material =
        Material { size: size_of::<Material>() as u32, count: 0, lobes: [Shape::LAMBERT; MAX_LOBES], hash: 0 };

    /// The material of some lobes.
    ///
    /// # Errors
    /// More than four lobes, or a field of one that is out of its range.
    pub fn new(shapes: &[Shape]) -> Result<Material, Error> {
        let mut material = Material { count: shapes.len() as u32, ..Material::NONE };
        for (slot, shape) in material.lobes.iter_mut().zip(shapes) {
            *slot = *shape;
        }
        material.hash = material.checked()?;
        Ok(material)
    }

    /// The seal of lobes that are in their ranges.
    ///
    /// # Errors
    /// As [`Material::new`].
    pub fn checked(&self) -> Result<u64, Error> {
        Error::first([(self.count as usize <= MAX_LOBES, c"lobe_count")])?;
        let mut faults = self.lobes().iter().map(Shape::invalid).enumerate();
        let fault = faults.find_map(|(lobe, field)| field.map(|field| Error::range(field).in_row(lobe)));
        fault.map_or(Ok(self.seal()), Err)
    }

    /// A hash of the lobes.
    #[inline(always)]
    fn seal(&self) -> u64 {
        let mut hash = ContentHash::new();
        for Shape { kind, a, b, eta } in self.lobes() {
            hash.add(u64::from(kind.code()) << 32 | u64::from(a.to_bits()));
            hash.add(u64::from(b.to_bits()) << 32 | u64::from(eta.to_bits()));
        }
        hash.finish()
    }

    /// Whether it is one that [`Material::new`] made.
    #[inline(always)]
    pub fn is_sealed(&self) -> bool {
        self.size as usize == size_of::<Material>() && self.count as usize <= MAX_LOBES && self.hash == self.seal()
    }

    /// The same material, to tell apart from others, with lobes of other shapes.
    pub fn with_shapes(mut self, of: impl Fn(&Shape) -> Shape) -> Material {
        self.lobes.iter_mut().take(self.count as usize).for_each(|lobe| *lobe = of(lobe));
        self
    }

    /// Its lobes.
    #[inline(always)]
    pub fn lobes(&self) -> &[Shape] {
        self.lobes.get(..self.count as usize).unwrap_or(&[])
    }

    /// A hash of its content.
    pub fn hash(&self) -> u64 {
        self.hash
    }

    /// [`Material::transmits`], and whether a lobe depends on the tangent, in one pass.
    #[inline(always)]
    pub fn kinds(&self) -> (bool, bool) {
        // A bit for each kind; of lobes with one alpha, and moved up of others.
        const OTHERS: u32 = 8;
        const TRANSMITS: u32 = 1 << Kind::GgxTransmission.0 | 1 << Kind::LambertTransmission.0;
        const GGX: u32 = 1 << Kind::Ggx.0 | 1 << Kind::GgxTransmission.0;
        let of = |lobe: &Shape| u32::from(lobe.a.to_bits() != lobe.b.to_bits()) * OTHERS + lobe.kind.0 % OTHERS;
        let seen = self.lobes().iter().fold(0, |seen: u32, lobe| seen | 1 << of(lobe));
        (seen & (TRANSMITS | TRANSMITS << OTHERS) != 0, seen & GGX << OTHERS != 0)
    }

    /// Whether a lobe lies on the side opposite to wo.
    pub fn transmits(&self) -> bool {
        self.lobes().iter().any(|lobe| lobe.kind.transmits())
    }
}
