//! The renderer's own materials: evaluation, pdf and sampling of Lambert, GGX and their mix. All are grey, so that
//! luminance is the whole of an estimate.
//!
//! GGX is sampled by visible normals (Heitz 2018) in the form of Dupuy and Benyoub 2023, "Sampling Visible GGX Normals
//! with Spherical Caps".

use crate::client::{self, raw};
use crate::scene::ShadingPoint;
use glam::Vec3;
use std::f32::consts::PI;

/// A weighted sum of a diffuse and an isotropic microfacet lobe.
#[derive(Clone, Debug)]
pub struct Material {
    pub name: String,
    diffuse: f32,
    specular: f32,
    alpha: f32,
}

/// The reflectance of the microfacets at normal incidence.
const F0: f32 = 0.9;

impl Material {
    pub fn lambert() -> Material {
        Material { name: "Lambert".into(), diffuse: 0.7, specular: 0.0, alpha: 1.0 }
    }

    pub fn ggx(alpha: f32) -> Material {
        Material { name: format!("GGX {alpha}"), diffuse: 0.0, specular: 1.0, alpha }
    }

    pub fn mix(alpha: f32) -> Material {
        Material { name: format!("mix {alpha}"), diffuse: 0.35, specular: 0.5, alpha }
    }

    /// All that the report measures.
    pub fn all() -> Vec<Material> {
        let ggx = [0.5, 0.2, 0.05, 0.01].map(Material::ggx);
        [vec![Material::lambert()], ggx.to_vec(), vec![Material::mix(0.1)]].concat()
    }

    /// The same BRDF as the library is told of it.
    pub fn query(&self, point: &ShadingPoint) -> raw::wis_query {
        let grey = |w| [w; 3];
        let diffuse = client::lambert(grey(self.diffuse));
        let specular = client::ggx(grey(self.specular), grey(F0), [self.alpha; 2]);
        let lobes: &[_] = match (self.diffuse > 0.0, self.specular > 0.0) {
            (true, true) => &[diffuse, specular],
            (true, false) => &[diffuse],
            _ => &[specular],
        };
        client::query(point.normal.to_array(), point.wo.to_array(), lobes)
    }
}

/// A material at a shading point.
#[derive(Clone, Copy)]
pub struct Bsdf {
    tangent: Vec3,
    bitangent: Vec3,
    normal: Vec3,
    /// To the eye, in the frame of the three above.
    wo: Vec3,
    alpha: f32,
    diffuse: f32,
    specular: f32,
    /// The probability of the microfacet lobe.
    specular_share: f32,
    /// The length of wo stretched by alpha.
    wo_length: f32,
}

impl Bsdf {
    pub fn new(material: &Material, point: &ShadingPoint) -> Bsdf {
        let normal = point.normal;
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        let wo = Vec3::new(point.wo.dot(tangent), point.wo.dot(bitangent), point.wo.dot(normal).max(1e-6));
        let &Material { diffuse, specular, alpha, .. } = material;
        Bsdf {
            tangent,
            bitangent,
            normal,
            wo,
            alpha,
            diffuse,
            specular,
            specular_share: specular / (diffuse + specular),
            wo_length: Vec3::new(alpha * wo.x, alpha * wo.y, wo.z).length(),
        }
    }

    /// BRDF x cosine, and the pdf of `sample`.
    #[inline]
    pub fn eval(&self, wi: Vec3) -> (f32, f32) {
        let wi = Vec3::new(wi.dot(self.tangent), wi.dot(self.bitangent), wi.dot(self.normal));
        if wi.z <= 0.0 {
            return (0.0, 0.0);
        }
        let cosine_pdf = wi.z / PI;
        let (value, pdf) = if self.specular > 0.0 { self.microfacets(wi) } else { (0.0, 0.0) };
        let pdf = cosine_pdf + (pdf - cosine_pdf) * self.specular_share;
        (self.diffuse * cosine_pdf + self.specular * value, pdf)
    }

    /// A direction by its pdf; it may lie below the horizon, where BRDF and pdf are 0.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> Vec3 {
        // One number chooses the lobe and is then stretched to be used again.
        let local = if u[0] < self.specular_share {
            self.reflect_at_visible_normal([u[0] / self.specular_share, u[1]])
        } else {
            cosine_hemisphere([(u[0] - self.specular_share) / (1.0 - self.specular_share), u[1]])
        };
        (self.tangent * local.x + self.bitangent * local.y + self.normal * local.z).normalize()
    }

    /// GGX x Smith x Schlick x cosine, and the pdf by visible normals, for a direction above the horizon.
    fn microfacets(&self, wi: Vec3) -> (f32, f32) {
        let a2 = self.alpha * self.alpha;
        let h = wi + self.wo;
        let squared = h.length_squared();
        let ratio = squared / ((h.x * h.x + h.y * h.y) / a2 + h.z * h.z);
        let d = ratio * ratio / (PI * a2);
        let wi_length = Vec3::new(self.alpha * wi.x, self.alpha * wi.y, wi.z).length();
        let smith = 0.5 / (wi.z * self.wo_length + self.wo.z * wi_length);
        let grazing = 1.0 - (0.5 * squared.sqrt()).min(1.0);
        let fresnel = F0 + (1.0 - F0) * grazing.powi(5);
        (d * smith * fresnel * wi.z, d * 0.5 / (self.wo.z + self.wo_length))
    }

    fn reflect_at_visible_normal(&self, u: [f32; 2]) -> Vec3 {
        let stretched = Vec3::new(self.alpha * self.wo.x, self.alpha * self.wo.y, self.wo.z) / self.wo_length;
        let z = (1.0 - u[1]) * (1.0 + stretched.z) - stretched.z;
        let radius = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = (std::f32::consts::TAU * u[0]).sin_cos();
        let cap = Vec3::new(radius * cos, radius * sin, z) + stretched;
        let h = Vec3::new(self.alpha * cap.x, self.alpha * cap.y, cap.z).normalize();
        h * (2.0 * self.wo.dot(h)) - self.wo
    }
}

fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let (sin, cos) = (std::f32::consts::TAU * u[0]).sin_cos();
    let radius = u[1].sqrt();
    Vec3::new(radius * cos, radius * sin, (1.0 - u[1]).max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point() -> ShadingPoint {
        let normal = Vec3::new(0.2, -0.3, 0.9).normalize();
        let wo = Vec3::new(0.7, 0.1, 0.5).normalize();
        ShadingPoint { pixel: [0, 0], origin: Vec3::ZERO, normal, wo }
    }

    #[test]
    fn the_library_evaluates_the_same_brdf() {
        for material in Material::all() {
            let bsdf = Bsdf::new(&material, &point());
            let mut u = vec![[0.0; 2]; 512];
            client::sobol(1, 0, &mut u).unwrap();
            let wi: Vec<_> = u.iter().map(|&u| bsdf.sample(u)).collect();
            let arrays: Vec<_> = wi.iter().map(|w| w.to_array()).collect();
            let mut theirs = vec![[0.0; 3]; wi.len()];
            client::evaluate(&material.query(&point()), &arrays, &mut theirs).unwrap();
            for (wi, theirs) in wi.iter().zip(theirs) {
                let ours = bsdf.eval(*wi).0;
                assert!((ours - theirs[0]).abs() <= 2e-3 * ours.max(theirs[0]), "{} {ours} {theirs:?}", material.name);
            }
        }
    }

    #[test]
    fn the_pdf_integrates_to_what_lies_above_the_horizon() {
        for material in [Material::lambert(), Material::ggx(0.5), Material::mix(0.2)] {
            let bsdf = Bsdf::new(&material, &point());
            let mut u = vec![[0.0; 2]; 1 << 18];
            client::sobol(7, 0, &mut u).unwrap();
            let uniform = |u: [f32; 2]| {
                let (z, phi) = (1.0 - 2.0 * u[0], std::f32::consts::TAU * u[1]);
                let r = (1.0 - z * z).max(0.0).sqrt();
                Vec3::new(r * phi.cos(), r * phi.sin(), z)
            };
            let count = u.len() as f64;
            let integral: f64 =
                u.iter().map(|&u| f64::from(bsdf.eval(uniform(u)).1)).sum::<f64>() / count * 4.0 * std::f64::consts::PI;
            let above = u.iter().filter(|&&u| bsdf.eval(bsdf.sample(u)).1 > 0.0).count() as f64 / count;
            assert!((integral - above).abs() < 2e-3, "{}: {integral} {above}", material.name);
        }
    }
}
