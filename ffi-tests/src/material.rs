//! The renderer's own materials: evaluation, pdf and sampling of Lambert, GGX and their mix. All are grey, so that
//! luminance is the whole of an estimate.
//!
//! GGX is sampled by visible normals (Heitz 2018) in the form of Dupuy and Benyoub 2023, "Sampling Visible GGX Normals
//! with Spherical Caps".

use crate::client::{self, raw};
use crate::lanes::{F8, LANES, V8, sin_cos_turn};
use crate::measured;
use crate::product::{Product, Rotations};
use crate::reflectance::{Reflectance, View};
use crate::scene::ShadingPoint;
use crate::standin::{self, StandIn};
use crate::table::Table;
use anyhow::Result;
use glam::Vec3;
use std::f32::consts::PI;
use std::path::Path;
use wide::{CmpGt, CmpLt};

/// A weighted sum of a diffuse and an isotropic microfacet lobe.
#[derive(Clone, Debug)]
pub struct Material {
    pub name: String,
    diffuse: f32,
    specular: f32,
    alpha: f32,
    /// Whether the diffuse lobe has a texture.
    pub textured: bool,
    /// In place of the lobes.
    pub measured: Option<&'static dyn Reflectance>,
    /// The lobes of a measured material, as the library is told of them for the choice of rays.
    stand_in: &'static [StandIn],
    /// What the library is told of a measured material; without it, it calls back.
    pub table: Option<&'static Table>,
}

/// Slices, depth, error budget and places in a pixel of the tables: 64 x 64 directions, and twice as many along each axis
/// for each of two roughnesses that the material is below, and twice as many places: where pixels are coarser than the lobe
/// or miss its peak, samples have large weights.
const TABLE: (u32, u32, f32, u32) = (16, 6, 0.001, 2);
const FINER: [f64; 2] = [0.15, 0.1];

/// The reflectance of the microfacets at normal incidence.
const F0: f32 = 0.9;

impl Material {
    const PLAIN: Material = Material {
        name: String::new(),
        diffuse: 0.0,
        specular: 0.0,
        alpha: 1.0,
        textured: false,
        measured: None,
        stand_in: &[],
        table: None,
    };

    pub fn lambert() -> Material {
        Material { name: "Lambert".into(), diffuse: 0.7, specular: 0.0, alpha: 1.0, ..Material::PLAIN }
    }

    pub fn ggx(alpha: f32) -> Material {
        Material { name: format!("GGX {alpha}"), diffuse: 0.0, specular: 1.0, alpha, ..Material::PLAIN }
    }

    pub fn mix(alpha: f32) -> Material {
        Material { name: format!("mix {alpha}"), diffuse: 0.35, specular: 0.5, alpha, ..Material::PLAIN }
    }

    /// The same with a texture on its diffuse lobe.
    pub fn textured(self) -> Material {
        Material { name: format!("textured {}", self.name), textured: true, ..self }
    }

    /// The weight of the diffuse lobe at a point.
    fn diffuse_at(&self, point: &ShadingPoint) -> f32 {
        if self.textured { self.diffuse * texture(point.origin) } else { self.diffuse }
    }

    /// A measured material from a file, which is kept until the program ends.
    ///
    /// # Errors
    /// The file cannot be read, or is another kind of material.
    pub fn measured(path: &Path) -> Result<Material> {
        let measured = measured::load(path)?;
        let (slices, depth, budget, places) = TABLE;
        let roughness = measured.roughness();
        let finer = FINER.iter().filter(|below| roughness < **below).count() as u32;
        let (depth, places) = (depth + finer, places << (finer / 2));
        let table = Table::new(slices, depth, budget, places, |wo, wi| measured.eval(wo, wi))?;
        let table: &'static Table = Box::leak(Box::new(table));
        Ok(Material { table: Some(table), ..Material::called_back(measured) })
    }

    /// A measured material that the library asks for in a callback.
    pub fn called_back(measured: &'static dyn Reflectance) -> Material {
        let stand_in = Box::leak(standin::fit(measured, f64::from(F0)).into_boxed_slice());
        Material { name: measured.name().into(), measured: Some(measured), stand_in, ..Material::lambert() }
    }

    /// All that the report measures.
    pub fn all() -> Vec<Material> {
        let ggx = [0.5, 0.2, 0.05, 0.01].map(Material::ggx);
        [vec![Material::lambert()], ggx.to_vec(), vec![Material::mix(0.1)]].concat()
    }

    /// The product with a map at a point, as the paper has it.
    ///
    /// # Errors
    /// Those of the library.
    pub fn prepare(&self, map: &Rotations, point: &ShadingPoint) -> client::Result<Product> {
        let bsdf = Bsdf::new(self, point);
        let mirror = (2.0 * point.normal.dot(point.wo) * point.normal - point.wo).normalize();
        map.product(mirror, |wi, f_cos| bsdf.values(wi, f_cos))
    }

    /// The lobes that stand in for the BRDF in wis_direct, each with its weight: roughness 0 is diffuse. On no heap, as in a renderer.
    fn weighted_lobes(&self, diffuse: f32) -> impl Iterator<Item = (f32, f32)> {
        let known = if self.measured.is_some() { [0.0; 2] } else { [diffuse, self.specular] };
        let stand_in = self.stand_in.iter().map(|lobe| (lobe.alpha.unwrap_or(0.0) as f32, lobe.weight as f32));
        [(0.0, known[0]), (self.alpha, known[1])].into_iter().filter(|lobe| lobe.1 > 0.0).chain(stand_in)
    }

    /// The shapes of the lobes that stand in for the BRDF in wis_direct.
    pub fn lobes(&self) -> Vec<raw::wis_lobe> {
        let lobe = |alpha| match alpha {
            0.0 => raw::wis_lobe { kind: raw::WIS_LOBE_LAMBERT, a: 0.0, b: 0.0, eta: 0.0 },
            _ => raw::wis_lobe { kind: raw::WIS_LOBE_GGX, a: alpha, b: alpha, eta: 0.0 },
        };
        self.weighted_lobes(self.diffuse).map(|(alpha, _)| lobe(alpha)).collect()
    }

    /// A shading point for wis_direct, with the material of `lobes`.
    pub fn point(&self, point: &ShadingPoint, material: &raw::wis_material) -> raw::wis_point {
        let mut at = raw::wis_point {
            size: size_of::<raw::wis_point>() as u32,
            material,
            normal: point.normal.to_array(),
            wo: point.wo.to_array(),
            ..Default::default()
        };
        let lobes = self.weighted_lobes(self.diffuse_at(point));
        for ((weight, f0), (_, own)) in at.weight.iter_mut().zip(&mut at.f0).zip(lobes) {
            (*weight, *f0) = ([own; 3], [F0; 3]);
        }
        at
    }
}

/// The factor of a texture at a place: 3 to 97 %, in cubes of a fourteenth of the mesh with a gradient over them.
fn texture(at: Vec3) -> f32 {
    let cell = (at * 14.0).floor();
    let checker = (cell.x + cell.y + cell.z).rem_euclid(2.0);
    0.03 + 0.94 * checker * (0.5 + 0.5 * (3.0 * at.z + 2.0 * at.x).sin().abs())
}

/// A material at a shading point.
#[derive(Clone, Copy)]
pub struct Bsdf {
    tangent: V8,
    bitangent: V8,
    normal: V8,
    /// To the eye, in the frame of the three above.
    wo: Vec3,
    alpha: f32,
    diffuse: f32,
    specular: f32,
    /// The probability of the microfacet lobe.
    specular_share: f32,
    /// The length of wo stretched by alpha.
    wo_length: f32,
    measured: Option<(&'static dyn Reflectance, View)>,
}

impl Bsdf {
    pub fn new(material: &Material, point: &ShadingPoint) -> Bsdf {
        let normal = point.normal;
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        let wo = Vec3::new(point.wo.dot(tangent), point.wo.dot(bitangent), point.wo.dot(normal).max(1e-6));
        let &Material { specular, alpha, .. } = material;
        let diffuse = material.diffuse_at(point);
        Bsdf {
            tangent: V8::splat(tangent),
            bitangent: V8::splat(bitangent),
            normal: V8::splat(normal),
            wo,
            alpha,
            diffuse,
            specular,
            specular_share: specular / (diffuse + specular),
            wo_length: Vec3::new(alpha * wo.x, alpha * wo.y, wo.z).length(),
            measured: material.measured.map(|measured| (measured, measured.view(wo.as_dvec3().normalize()))),
        }
    }

    /// BRDF x cosine, and the pdf of `sample`, for one direction.
    pub fn eval_one(&self, wi: Vec3) -> (f32, f32) {
        let (value, pdf) = self.eval(V8::splat(wi), 1);
        (value.as_array_ref()[0], pdf.as_array_ref()[0])
    }

    /// BRDF x cosine for any number of directions.
    pub fn values(&self, wi: &[[f32; 3]], f_cos: &mut [f32]) {
        for (wi, f_cos) in wi.chunks(LANES).zip(f_cos.chunks_mut(LANES)) {
            let each = |i: usize| wi.get(i).map_or(Vec3::Z, |&wi| Vec3::from_array(wi));
            let (value, _) = self.eval(V8::each(std::array::from_fn(each)), wi.len());
            f_cos.copy_from_slice(&value.as_array_ref()[..f_cos.len()]);
        }
    }

    /// A direction by its pdf, for one point.
    pub fn sample_one(&self, u: [f32; 2]) -> Vec3 {
        self.sample(u.map(F8::splat), 1).get(0)
    }

    /// BRDF x cosine, and the pdf of `sample`, of the first `used` directions.
    #[inline]
    pub fn eval(&self, wi: V8, used: usize) -> (F8, F8) {
        let wi = V8::new(wi.dot(self.tangent), wi.dot(self.bitangent), wi.dot(self.normal));
        if let Some((measured, view)) = &self.measured {
            return measured.eval_lanes(view, wi, used.min(LANES));
        }
        let above = wi.z.cmp_gt(F8::ZERO);
        let cosine_pdf = wi.z * F8::splat(1.0 / PI);
        if self.specular == 0.0 {
            return (above & (cosine_pdf * F8::splat(self.diffuse)), above & cosine_pdf);
        }
        let (value, pdf) = self.microfacets(wi);
        let pdf = cosine_pdf + (pdf - cosine_pdf) * F8::splat(self.specular_share);
        let value = cosine_pdf * F8::splat(self.diffuse) + value * F8::splat(self.specular);
        (above & value, above & pdf)
    }

    /// Directions by their pdf for the first `used` points; they may lie below the horizon, where BRDF and pdf are 0.
    #[inline]
    pub fn sample(&self, u: [F8; 2], used: usize) -> V8 {
        let share = F8::splat(self.specular_share);
        let local = if let Some((measured, view)) = &self.measured {
            measured.sample_lanes(view, u, used)
        } else if self.specular == 0.0 {
            cosine_hemisphere(u)
        } else if self.diffuse == 0.0 {
            self.reflect_at_visible_normal(u)
        } else {
            // One number chooses the lobe and is then stretched to be used again.
            let glossy = self.reflect_at_visible_normal([(u[0] / share).min(F8::ONE), u[1]]);
            let diffuse = cosine_hemisphere([(u[0] - share) / (F8::ONE - share), u[1]]);
            glossy.or(u[0].cmp_lt(share), diffuse)
        };
        let V8 { x, y, z } = local;
        self.tangent.scale(x).plus(self.bitangent.scale(y)).plus(self.normal.scale(z)).normalize()
    }

    /// GGX x Smith x Schlick x cosine, and the pdf by visible normals, for directions above the horizon.
    #[inline]
    fn microfacets(&self, wi: V8) -> (F8, F8) {
        let (alpha, a2) = (F8::splat(self.alpha), F8::splat(self.alpha * self.alpha));
        let h = wi.plus(V8::splat(self.wo));
        let squared = h.dot(h);
        let ratio = squared / ((h.x * h.x + h.y * h.y) / a2 + h.z * h.z);
        let d = ratio * ratio / (F8::splat(PI) * a2);
        let wi_length = V8::new(alpha * wi.x, alpha * wi.y, wi.z).length();
        let half = F8::splat(0.5);
        let smith = half / (wi.z * F8::splat(self.wo_length) + F8::splat(self.wo.z) * wi_length);
        let grazing = F8::ONE - (half * squared.sqrt()).min(F8::ONE);
        let fourth = grazing * grazing * (grazing * grazing);
        let fresnel = F8::splat(F0) + F8::splat(1.0 - F0) * (fourth * grazing);
        (d * smith * fresnel * wi.z, d * half / F8::splat(self.wo.z + self.wo_length))
    }

    #[inline]
    fn reflect_at_visible_normal(&self, u: [F8; 2]) -> V8 {
        let stretched = Vec3::new(self.alpha * self.wo.x, self.alpha * self.wo.y, self.wo.z) / self.wo_length;
        let z = (F8::ONE - u[1]) * F8::splat(1.0 + stretched.z) - F8::splat(stretched.z);
        let radius = (F8::ONE - z * z).max(F8::ZERO).sqrt();
        let (sin, cos) = sin_cos_turn(u[0]);
        let cap = V8::new(radius * cos, radius * sin, z).plus(V8::splat(stretched));
        let alpha = F8::splat(self.alpha);
        let h = V8::new(alpha * cap.x, alpha * cap.y, cap.z).normalize();
        let wo = V8::splat(self.wo);
        h.scale(wo.dot(h) * F8::splat(2.0)).plus(V8::splat(-self.wo))
    }
}

#[inline]
fn cosine_hemisphere(u: [F8; 2]) -> V8 {
    let (sin, cos) = sin_cos_turn(u[0]);
    let radius = u[1].max(F8::ZERO).sqrt();
    V8::new(radius * cos, radius * sin, (F8::ONE - u[1]).max(F8::ZERO).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::directions::sphere;
    use glam::DVec3;

    fn point() -> ShadingPoint {
        let normal = Vec3::new(0.2, -0.3, 0.9).normalize();
        let wo = Vec3::new(0.7, 0.1, 0.5).normalize();
        ShadingPoint { pixel: [0, 0], hit: 0, origin: Vec3::ZERO, normal, wo }
    }

    #[test]
    fn the_pdf_integrates_to_what_lies_above_the_horizon() {
        for material in [Material::lambert(), Material::ggx(0.5), Material::mix(0.2)] {
            let bsdf = Bsdf::new(&material, &point());
            let u = crate::points::of(7, 1 << 18);
            let uniform = |u: [f32; 2]| DVec3::from_array(sphere(u.map(f64::from))).as_vec3();
            let count = u.len() as f64;
            let integral: f64 = u.iter().map(|&u| f64::from(bsdf.eval_one(uniform(u)).1)).sum::<f64>() / count
                * 4.0
                * std::f64::consts::PI;
            let above = u.iter().filter(|&&u| bsdf.eval_one(bsdf.sample_one(u)).1 > 0.0).count() as f64 / count;
            assert!((integral - above).abs() < 2e-3, "{}: {integral} {above}", material.name);
        }
    }
}
