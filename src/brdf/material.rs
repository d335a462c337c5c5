//! The shape of a material: what its lobes are, apart from where they are used and how strongly they reflect there.

use crate::numeric::ContentHash;
use crate::status::{Result, Status};

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

/// A kind of lobe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// weight / pi.
    Lambert,
    /// weight F D G / (4 cos cos), Schlick's Fresnel term.
    Ggx,
    /// weight (a + 2) / (2 pi) max(0, r.wi)^a with r the mirror direction of wo.
    Phong,
    /// Transmission through GGX microfacets: weight (1 - F) times Walter et al. 2007, Eq. 21.
    GgxTransmission,
    /// weight / pi on the side opposite to wo.
    LambertTransmission,
}

impl Kind {
    /// The kind with this number.
    pub fn from_code(code: u32) -> Option<Kind> {
        [Kind::Lambert, Kind::Ggx, Kind::Phong, Kind::GgxTransmission, Kind::LambertTransmission]
            .into_iter()
            .find(|kind| kind.code() == code)
    }

    /// Its number.
    pub fn code(self) -> u32 {
        match self {
            Kind::Lambert => 1,
            Kind::Ggx => 2,
            Kind::Phong => 3,
            Kind::GgxTransmission => 5,
            Kind::LambertTransmission => 6,
        }
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
#[derive(Clone, Copy, Debug, PartialEq)]
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

/// Which field of a lobe is out of its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// `a`.
    A,
    /// `b`.
    B,
    /// `eta`.
    Eta,
}

impl Shape {
    /// Diffuse reflection.
    pub const LAMBERT: Shape = Shape { kind: Kind::Lambert, a: 0.0, b: 0.0, eta: 1.0 };

    /// Microfacets of this roughness.
    pub fn ggx(a: f32, b: f32) -> Shape {
        Shape { kind: Kind::Ggx, a, b, eta: 1.0 }
    }

    /// The first field that is out of its range.
    pub fn invalid(&self) -> Option<Field> {
        let alpha = |a: f32| (ALPHA_RANGE[0]..=ALPHA_RANGE[1]).contains(&a);
        match self.kind {
            Kind::Lambert | Kind::LambertTransmission => None,
            Kind::Phong => (!(0.0..=MAX_EXPONENT).contains(&self.a)).then_some(Field::A),
            Kind::Ggx | Kind::GgxTransmission if !alpha(self.a) => Some(Field::A),
            Kind::Ggx | Kind::GgxTransmission if !alpha(self.b) => Some(Field::B),
            Kind::Ggx => None,
            Kind::GgxTransmission => {
                let bends = (ETA_RANGE[0]..=ETA_RANGE[1]).contains(&self.eta) && (self.eta - 1.0).abs() >= ETA_DISTANCE;
                (!bends).then_some(Field::Eta)
            }
        }
    }
}

/// Up to four lobes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    lobes: [Shape; MAX_LOBES],
    count: usize,
    hash: u64,
}

impl Material {
    /// A material without lobes: reflects alike in all directions.
    pub const NONE: Material = Material { lobes: [Shape::LAMBERT; MAX_LOBES], count: 0, hash: 0 };

    /// The material of some lobes.
    ///
    /// # Errors
    /// [`Status::InvalidArgument`] for more than four lobes, or one with a field out of its range.
    pub fn new(shapes: &[Shape]) -> Result<Material> {
        if shapes.len() > MAX_LOBES || shapes.iter().any(|shape| shape.invalid().is_some()) {
            return Err(Status::InvalidArgument);
        }
        let mut material = Material { count: shapes.len(), ..Material::NONE };
        let mut hash = ContentHash::new();
        for (slot, shape) in material.lobes.iter_mut().zip(shapes) {
            *slot = *shape;
            hash.add(shape.kind.code().into());
            hash.add_floats(&[shape.a, shape.b, shape.eta]);
        }
        material.hash = hash.finish();
        Ok(material)
    }

    /// The material of shapes that [`Material::new`] checked, which gave this hash.
    pub fn checked(shapes: &[Shape], hash: u64) -> Material {
        let mut material = Material { count: shapes.len().min(MAX_LOBES), hash, ..Material::NONE };
        for (slot, shape) in material.lobes.iter_mut().zip(shapes) {
            *slot = *shape;
        }
        material
    }

    /// Its lobes.
    pub fn lobes(&self) -> &[Shape] {
        self.lobes.get(..self.count).unwrap_or(&[])
    }

    /// A hash of its content.
    pub fn hash(&self) -> u64 {
        self.hash
    }

    /// Whether a lobe lies on the side opposite to wo.
    pub fn transmits(&self) -> bool {
        self.lobes().iter().any(|lobe| lobe.kind.transmits())
    }

    /// Whether a lobe depends on the tangent.
    pub fn is_anisotropic(&self) -> bool {
        self.lobes().iter().any(|lobe| lobe.kind.is_ggx() && lobe.a != lobe.b)
    }
}
