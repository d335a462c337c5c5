//! BRDFs that renderers have, in f64 and along tangent, bitangent and normal: the library's lobes, and what lobes only resemble.

use crate::support::vector::{V3, add, dot, scale, unit};
use std::f64::consts::PI;
use wis::brdf::material::{Kind, Shape};

/// A lobe with its weight and its reflectance.
#[derive(Clone, Copy, Debug)]
pub struct Lobe {
    pub shape: Shape,
    pub weight: f64,
    pub f0: f64,
}

impl Lobe {
    pub fn lambert(weight: f64) -> Lobe {
        Lobe { shape: Shape::LAMBERT, weight, f0: 0.0 }
    }

    pub fn ggx(a: f32, b: f32, weight: f64, f0: f64) -> Lobe {
        Lobe { shape: Shape::ggx(a, b), weight, f0 }
    }

    pub fn phong(exponent: f32, weight: f64) -> Lobe {
        Lobe { shape: Shape { kind: Kind::Phong, a: exponent, b: 0.0, eta: 1.0 }, weight, f0: 0.0 }
    }

    pub fn leaf(weight: f64) -> Lobe {
        Lobe { shape: Shape { kind: Kind::LambertTransmission, ..Shape::LAMBERT }, weight, f0: 0.0 }
    }

    pub fn glass(a: f32, eta: f32, weight: f64, f0: f64) -> Lobe {
        Lobe { shape: Shape { kind: Kind::GgxTransmission, a, b: a, eta }, weight, f0 }
    }

    /// BRDF x |cosine|, wo above.
    fn f_cos(&self, wo: V3, wi: V3) -> f64 {
        let alpha = [self.shape.a, self.shape.b].map(f64::from);
        let upper = wi[2] > 0.0;
        self.weight
            * match self.shape.kind {
                Kind::Lambert if upper => wi[2] / PI,
                Kind::LambertTransmission if !upper => -wi[2] / PI,
                Kind::Ggx if upper => schlick(self.f0, dot(wo, half(wo, wi))) * microfacets(&GGX, alpha, wo, wi),
                Kind::Phong if upper => phong(alpha[0], wo, wi),
                Kind::GgxTransmission if !upper => transmitted(alpha, self.shape.eta.into(), self.f0, wo, wi),
                _ => 0.0,
            }
    }
}

/// A sum of lobes: 0 for wo below, unless both sides count, which turns the normal to the side of wo.
pub fn sum(lobes: &[Lobe], whole: bool, wo: V3, wi: V3) -> f64 {
    let turned = |w: V3| if whole && wo[2] < 0.0 { [w[0], -w[1], -w[2]] } else { w };
    let (wo, wi) = (turned(wo), turned(wi));
    if wo[2] <= 0.0 { 0.0 } else { lobes.iter().map(|lobe| lobe.f_cos(wo, wi)).sum() }
}

fn half(wo: V3, wi: V3) -> V3 {
    unit(add(wo, wi))
}

pub fn schlick(f0: f64, cosine: f64) -> f64 {
    f0 + (1.0 - f0) * (1.0 - cosine.abs()).powi(5)
}

/// Fresnel's equations for a dielectric of this index, by the cosine on the outer side.
pub fn dielectric(eta: f64, cosine: f64) -> f64 {
    let squared = 1.0 - (1.0 - cosine * cosine) / (eta * eta);
    if squared <= 0.0 {
        return 1.0;
    }
    let inner = squared.sqrt();
    let parallel = (eta * cosine - inner) / (eta * cosine + inner);
    let perpendicular = (cosine - eta * inner) / (cosine + eta * inner);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// A distribution of microfacets: its density of a half vector and Smith's Lambda.
pub struct Facets {
    pub density: fn([f64; 2], V3) -> f64,
    pub lambda: fn([f64; 2], V3) -> f64,
}

pub const GGX: Facets = Facets {
    density: |[a, b], h| {
        let q = (h[0] / a).powi(2) + (h[1] / b).powi(2) + h[2] * h[2];
        1.0 / (PI * a * b * q * q)
    },
    lambda: |[a, b], w| {
        let slope = ((a * w[0]).powi(2) + (b * w[1]).powi(2)) / (w[2] * w[2]);
        0.5 * ((1.0 + slope).sqrt() - 1.0)
    },
};

/// Beckmann's, with the approximation of Walter et al. 2007.
pub const BECKMANN: Facets = Facets {
    density: |[a, b], h| {
        let slope = ((h[0] / a).powi(2) + (h[1] / b).powi(2)) / (h[2] * h[2]);
        (-slope).exp() / (PI * a * b * h[2].powi(4))
    },
    lambda: |[a, b], w| {
        let x = w[2].abs() / ((a * w[0]).powi(2) + (b * w[1]).powi(2)).sqrt().max(1e-12);
        if x < 1.6 { (1.0 - 1.259 * x + 0.396 * x * x) / (3.535 * x + 2.181 * x * x) } else { 0.0 }
    },
};

/// D G / (4 cos) without the Fresnel term, with height-correlated shadowing.
pub fn microfacets(of: &Facets, alpha: [f64; 2], wo: V3, wi: V3) -> f64 {
    if wo[2] <= 0.0 || wi[2] <= 0.0 {
        return 0.0;
    }
    let g = 1.0 / (1.0 + (of.lambda)(alpha, wo) + (of.lambda)(alpha, wi));
    (of.density)(alpha, half(wo, wi)) * g / (4.0 * wo[2])
}

fn phong(exponent: f64, wo: V3, wi: V3) -> f64 {
    let cosine = dot([-wo[0], -wo[1], wo[2]], wi);
    if cosine <= 0.0 { 0.0 } else { (exponent + 2.0) / (2.0 * PI) * cosine.powf(exponent) * wi[2] }
}

/// Walter et al. 2007, Eq. 21.
pub fn transmitted(alpha: [f64; 2], eta: f64, f0: f64, wo: V3, wi: V3) -> f64 {
    let mut h = unit(add(wo, scale(wi, eta)));
    if h[2] < 0.0 {
        h = scale(h, -1.0);
    }
    let (o, i) = (dot(wo, h), dot(wi, h));
    if o <= 0.0 || i >= 0.0 {
        return 0.0;
    }
    let g = 1.0 / (1.0 + (GGX.lambda)(alpha, wo) + (GGX.lambda)(alpha, wi));
    let jacobian = eta * eta / (o + eta * i).powi(2);
    (1.0 - schlick(f0, o)) * (GGX.density)(alpha, h) * g * (o * i).abs() * jacobian / wo[2]
}

/// Oren and Nayar 1994, the qualitative model.
pub fn oren_nayar(sigma: f64, wo: V3, wi: V3) -> f64 {
    if wo[2] <= 0.0 || wi[2] <= 0.0 {
        return 0.0;
    }
    let variance = sigma * sigma;
    let (a, b) = (1.0 - 0.5 * variance / (variance + 0.33), 0.45 * variance / (variance + 0.09));
    let sine = |w: V3| (1.0 - w[2] * w[2]).max(0.0).sqrt();
    let between = (wo[0] * wi[0] + wo[1] * wi[1]) / (sine(wo) * sine(wi)).max(1e-9);
    let (larger, smaller) = if wo[2] < wi[2] { (sine(wo), sine(wi) / wi[2]) } else { (sine(wi), sine(wo) / wo[2]) };
    (a + b * between.max(0.0) * larger * smaller) * wi[2] / PI
}

/// Burley 2012: diffuse reflection with retro-reflection.
pub fn burley(roughness: f64, wo: V3, wi: V3) -> f64 {
    if wo[2] <= 0.0 || wi[2] <= 0.0 {
        return 0.0;
    }
    let grazing = |w: V3| (1.0 - w[2]).powi(5);
    let f90 = 0.5 + 2.0 * roughness * dot(wi, half(wo, wi)).powi(2);
    (1.0 + (f90 - 1.0) * grazing(wo)) * (1.0 + (f90 - 1.0) * grazing(wi)) * wi[2] / PI
}

/// A coat with Fresnel's equations over a diffuse base, which is darker where the coat reflects more.
pub fn coated(of: &Facets, alpha: f64, base: f64, wo: V3, wi: V3) -> f64 {
    if wo[2] <= 0.0 || wi[2] <= 0.0 {
        return 0.0;
    }
    let through = (1.0 - dielectric(1.5, wo[2])) * (1.0 - dielectric(1.5, wi[2]));
    dielectric(1.5, dot(wo, half(wo, wi))) * microfacets(of, [alpha; 2], wo, wi) + base * through * wi[2] / PI
}

/// Blinn's lobe about the half vector, normalised as in game engines.
pub fn blinn(exponent: f64, wo: V3, wi: V3) -> f64 {
    if wo[2] <= 0.0 || wi[2] <= 0.0 {
        return 0.0;
    }
    (exponent + 8.0) / (8.0 * PI) * half(wo, wi)[2].powf(exponent) * wi[2]
}

/// Ashikhmin and Shirley 2000, the specular term of an isotropic lobe.
pub fn ashikhmin(exponent: f64, f0: f64, wo: V3, wi: V3) -> f64 {
    if wo[2] <= 0.0 || wi[2] <= 0.0 {
        return 0.0;
    }
    let h = half(wo, wi);
    let cosine = dot(wo, h);
    (exponent + 1.0) / (8.0 * PI) * h[2].powf(exponent) / (cosine * wo[2].max(wi[2])) * schlick(f0, cosine) * wi[2]
}

/// The sheen of Estevez and Kulla 2017 with the visibility term of Ashikhmin.
pub fn sheen(roughness: f64, wo: V3, wi: V3) -> f64 {
    if wo[2] <= 0.0 || wi[2] <= 0.0 {
        return 0.0;
    }
    let h = half(wo, wi);
    let (inverse, sine) = (1.0 / roughness, (1.0 - h[2] * h[2]).max(0.0).sqrt());
    (2.0 + inverse) * sine.powf(inverse) / (2.0 * PI) / (4.0 * (wi[2] + wo[2] - wi[2] * wo[2])) * wi[2]
}

/// 1 / pi.
pub fn lambert(wo: V3, wi: V3) -> f64 {
    if wo[2] <= 0.0 { 0.0 } else { wi[2].max(0.0) / PI }
}
