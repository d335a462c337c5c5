//! Clients in f64: BRDFs written apart from the library's, radiance, visibility, and the integral that rays estimate.

use super::brdfs::{GGX, dielectric, microfacets, schlick, transmitted};
use super::light::TURNED;
use crate::support::GAUSS;
use crate::support::Map;
use crate::support::maps::Filter;
use crate::support::vector::{V3, add, cross, dot, rotate, scale, single, unit};
use std::f64::consts::PI;
use wis::brdf::material::{MAX_LOBES, Material, Shape};
use wis::brdf::point::Point;

/// BRDF x |cosine| for wo and wi along tangent, bitangent and normal.
pub type Brdf = fn(V3, V3) -> f64;

/// What a client has at a hit.
#[derive(Clone)]
pub struct Client {
    pub normal: V3,
    pub tangent: V3,
    pub wo: V3,
    /// The library's picture of the BRDF: shapes, weights and reflectances.
    pub material: Material,
    pub weight: [f32; MAX_LOBES],
    pub f0: f32,
    pub whole_sphere: bool,
    pub cosine_included: bool,
    /// The client's own.
    pub brdf: Brdf,
    /// By what the radiance in a direction of the world differs from the map, and visibility.
    pub factor: fn(V3) -> f64,
}

impl Client {
    /// A point in the light of the sun of [`crate::support::maps::sun`], which stands 37 degrees off the normal.
    pub fn new(shapes: &[Shape], brdf: Brdf) -> Client {
        let sun = rotate(&TURNED, unit([0.48, 0.36, 0.8]));
        let side = unit(cross(sun, [0.3, 0.5, -0.7]));
        let normal = unit(add(scale(sun, 0.8), scale(side, 0.6)));
        let tangent = unit(cross(normal, [1.0, 0.0, 0.0]));
        let across = cross(normal, tangent);
        // Near the mirror direction of the sun, and 50 degrees off the normal.
        let wo = unit(add(scale(normal, 0.64), add(scale(side, 0.6), scale(across, 0.25))));
        Client {
            normal,
            tangent,
            wo,
            material: Material::new(shapes).unwrap(),
            weight: [1.0; MAX_LOBES],
            f0: 0.8,
            whole_sphere: false,
            cosine_included: false,
            brdf,
            factor: |_| 1.0,
        }
    }

    pub fn point(&self) -> Point<'_> {
        Point {
            tangent: single(self.tangent),
            weight: self.weight.map(|w| [w; 3]),
            f0: [[self.f0; 3]; MAX_LOBES],
            whole_sphere: self.whole_sphere,
            cosine_included: self.cosine_included,
            ..Point::new(&self.material, single(self.normal), single(self.wo))
        }
    }

    /// Directions of the world along tangent, bitangent and normal; as the library does, the normal is turned to the side of wo
    /// where both sides count.
    fn local(&self, w: V3) -> V3 {
        let whole = self.whole_sphere || self.material.transmits();
        let normal = if whole && dot(self.normal, self.wo) < 0.0 { scale(self.normal, -1.0) } else { self.normal };
        [dot(w, self.tangent), dot(w, cross(normal, self.tangent)), dot(w, normal)]
    }

    /// A direction along tangent, bitangent and normal, in the world.
    pub fn to_world(&self, [x, y, z]: V3) -> V3 {
        let bitangent = cross(self.normal, self.tangent);
        add(scale(self.tangent, x), add(scale(bitangent, y), scale(self.normal, z)))
    }

    /// The view along tangent, bitangent and normal.
    pub fn wo_local(&self) -> V3 {
        self.local(self.wo)
    }

    /// Everything but the map's radiance: BRDF x cosine x radiance / map x visibility.
    pub fn response(&self, wi: V3) -> f64 {
        (self.brdf)(self.local(self.wo), self.local(wi)) * (self.factor)(wi)
    }

    /// The integral of response x radiance, and its error: patches inside which the look-up is smooth are divided into as many
    /// squares along each side as `fineness` says, with four points in each; the error is what half as many change.
    pub fn integral(&self, map: &Map, filter: Filter, fineness: u32) -> (f64, f64) {
        let [rough, fine] = [fineness / 2, fineness].map(|n| self.integral_by(map, filter, n));
        (fine, (fine - rough).abs())
    }

    fn integral_by(&self, map: &Map, filter: Filter, parts: u32) -> f64 {
        let height = f64::from(map.height);
        let shift = if filter == Filter::Nearest { 0.0 } else { 0.5 };
        let mut sum = 0.0;
        for row in 0..=map.height {
            let bounds = [0.0, 1.0].map(|end| (f64::from(row) - shift + end).clamp(0.0, height));
            if bounds[1] <= bounds[0] {
                continue;
            }
            let points = (0..parts * parts * map.width * 4).map(|k| {
                let (g, k) = (k % 4, k / 4);
                let (i, k) = (k % parts, k / parts);
                let (j, column) = (k % parts, k / parts);
                let at = |cell: u32, side: u32| {
                    (f64::from(cell) + 0.5 + if side == 0 { -GAUSS } else { GAUSS }) / f64::from(parts)
                };
                let x = f64::from(column) - shift + at(i, g % 2);
                (x, bounds[0] + (bounds[1] - bounds[0]) * at(j, g / 2))
            });
            for (x, y) in points {
                let response = self.response(rotate(&TURNED, map.direction(x, y)));
                if response > 0.0 {
                    let area = (bounds[1] - bounds[0]) / f64::from(4 * parts * parts);
                    sum += response * map.radiance_at(filter, x, y)[0] * (PI * y / height).sin() * area;
                }
            }
        }
        sum * PI / height * 2.0 * PI / f64::from(map.width)
    }
}

/// 1 / pi.
pub fn lambert(_: V3, wi: V3) -> f64 {
    wi[2].max(0.0) / PI
}

/// 1 / pi on either side.
pub fn leaf(wo: V3, wi: V3) -> f64 {
    wi[2].abs() * (if wo[2] * wi[2] > 0.0 { 0.7 } else { 0.3 }) / PI
}

/// A lobe whose reflectance is 0.8.
fn ggx(alpha: [f64; 2], wo: V3, wi: V3) -> f64 {
    schlick(0.8, dot(wo, unit(add(wo, wi)))) * microfacets(&GGX, alpha, wo, wi)
}

/// The library's own, with alpha 0.3.
pub fn ggx_03(wo: V3, wi: V3) -> f64 {
    ggx([0.3; 2], wo, wi)
}

/// The same with Fresnel's equations for an index of 1.5, which Schlick's term with 0.04 resembles.
pub fn fresnel_03(wo: V3, wi: V3) -> f64 {
    let h = unit(add(wo, wi));
    ggx_03(wo, wi) * dielectric(1.5, dot(wo, h)) / schlick(0.8, dot(wo, h))
}

/// The same with separable Smith shadowing.
pub fn separable_03(wo: V3, wi: V3) -> f64 {
    let [view, light] = [wo, wi].map(|w| (GGX.lambda)([0.3; 2], w));
    ggx_03(wo, wi) * (1.0 + view + light) / ((1.0 + view) * (1.0 + light))
}

/// 0.4 Lambert and 0.6 of an anisotropic lobe.
pub fn mixture(wo: V3, wi: V3) -> f64 {
    0.4 * lambert(wo, wi) + 0.6 * ggx([0.4, 0.15], wo, wi)
}

pub fn phong(wo: V3, wi: V3) -> f64 {
    let cosine = dot([-wo[0], -wo[1], wo[2]], wi);
    if cosine <= 0.0 || wi[2] <= 0.0 { 0.0 } else { 22.0 / (2.0 * PI) * cosine.powi(20) * wi[2] }
}

/// A coat with Fresnel's equations and separable Smith over a base that is darker where the coat reflects more: no sum of the
/// library's lobes.
pub fn coated(wo: V3, wi: V3) -> f64 {
    if wo[2] <= 0.0 || wi[2] <= 0.0 {
        return 0.0;
    }
    let [view, light] = [wo, wi].map(|w| (GGX.lambda)([0.25; 2], w));
    let separable = (1.0 + view + light) / ((1.0 + view) * (1.0 + light));
    let coat = 4.0 * dielectric(1.5, dot(wo, unit(add(wo, wi)))) * microfacets(&GGX, [0.25; 2], wo, wi) * separable;
    coat + 0.6 * (1.0 - dielectric(1.5, wo[2])) * (1.0 - dielectric(1.5, wi[2])) * wi[2] / PI
}

/// The ratio of indices of [`glass`].
pub const ETA: f64 = 1.5;

/// Rough glass with reflection and transmission, Walter et al. 2007, Eqs. 20 and 21, and a third of a diffuse leaf behind it.
pub fn glass(wo: V3, wi: V3) -> f64 {
    let alpha = [0.3; 2];
    if wo[2] <= 0.0 || wi[2] == 0.0 {
        return 0.0;
    }
    if wi[2] > 0.0 {
        return ggx(alpha, wo, wi);
    }
    0.3 * -wi[2] / PI + transmitted(alpha, ETA, 0.8, wo, wi)
}

/// A phase function (Henyey and Greenstein 1941, g = 0.5): there is no cosine.
pub fn phase(wo: V3, wi: V3) -> f64 {
    0.75 / (4.0 * PI) / (1.25 + dot(wo, wi)).powf(1.5)
}
