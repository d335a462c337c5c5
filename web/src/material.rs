//! The renderer's own BSDFs: a diffuse and a glossy lobe. GGX uses height-correlated Smith shadowing and samples visible normals by
//! spherical caps (Dupuy and Benyoub 2023).

use core::f32::consts::PI;
use glam::{Vec3, vec3};
use wis::{Material as Lobes, Point, Shape};

/// Luminance of linear Rec. 709.
pub fn luminance(rgb: Vec3) -> f32 {
    rgb.dot(vec3(0.2126, 0.7152, 0.0722))
}

/// Diffuse reflectance, and of the glossy lobe the reflectance at normal incidence and its alpha.
#[derive(Clone, Copy)]
pub struct Material {
    pub diffuse: Vec3,
    pub f0: Vec3,
    pub alpha: f32,
    /// Every other square is darker.
    pub tiles: bool,
    /// The shapes of both lobes, as wis knows them.
    lobes: Lobes,
}

impl Material {
    pub fn new(diffuse: Vec3, f0: Vec3, alpha: f32) -> Material {
        let shapes = [Shape::LAMBERT, Shape::ggx(alpha, alpha)];
        Material { diffuse, f0, alpha, tiles: false, lobes: Lobes::new(&shapes).unwrap_or(Lobes::NONE) }
    }

    /// The same with the squares of a tiled floor, if it has any.
    pub fn at(&self, position: Vec3) -> Material {
        let square = libm::floorf(position.x * 1.5) + libm::floorf(position.y * 1.5);
        let shade = if self.tiles && square % 2.0 == 0.0 { 0.6 } else { 1.0 };
        Material { diffuse: self.diffuse * shade, ..*self }
    }

    /// The weight of the glossy lobe: none where nothing is reflected at normal incidence.
    fn gloss(&self) -> f32 {
        if self.f0 == Vec3::ZERO { 0.0 } else { 1.0 }
    }
}

/// A material at a hit.
pub struct Bsdf<'a> {
    material: &'a Material,
    pub normal: Vec3,
    wo: Vec3,
    tangents: (Vec3, Vec3),
    cos_o: f32,
    root_o: f32,
    /// The probability that a sample is of the diffuse lobe.
    diffuse: f32,
}

fn schlick(f0: Vec3, cosine: f32) -> Vec3 {
    let c = 1.0 - cosine;
    let c5 = c * c * c * c * c;
    f0 * (1.0 - c5) + Vec3::splat(c5)
}

/// The root in Smith's masking function.
fn smith(alpha: f32, cosine: f32) -> f32 {
    libm::sqrtf(alpha * alpha + (1.0 - alpha * alpha) * cosine * cosine)
}

impl<'a> Bsdf<'a> {
    pub fn new(material: &'a Material, normal: Vec3, wo: Vec3) -> Bsdf<'a> {
        let cos_o = normal.dot(wo);
        let matt = luminance(material.diffuse);
        let diffuse = matt / (matt + material.gloss() * luminance(schlick(material.f0, cos_o)));
        let tangents = normal.any_orthonormal_pair();
        Bsdf { material, normal, wo, tangents, cos_o, root_o: smith(material.alpha, cos_o), diffuse }
    }

    /// What wis must know of the hit.
    pub fn point(&self) -> Point<'a> {
        let mut point = Point::new(&self.material.lobes, self.normal.to_array(), self.wo.to_array());
        point.weight[0] = self.material.diffuse.to_array();
        point.weight[1] = [self.material.gloss(); 3];
        point.f0[1] = self.material.f0.to_array();
        point
    }

    /// BSDF x cosine, and the density of [`Bsdf::sample`].
    pub fn eval(&self, wi: Vec3) -> (Vec3, f32) {
        let Material { diffuse, f0, alpha, .. } = *self.material;
        let cos_i = self.normal.dot(wi);
        if !(cos_i > 0.0 && self.cos_o > 0.0) {
            return (Vec3::ZERO, 0.0);
        }
        let (matt, density) = (diffuse * (cos_i / PI), self.diffuse * cos_i / PI);
        if self.material.gloss() == 0.0 {
            return (matt, density);
        }
        let half = (wi + self.wo).normalize();
        let cos_h = self.normal.dot(half);
        let d = cos_h * cos_h * (alpha * alpha - 1.0) + 1.0;
        let distribution = alpha * alpha / (PI * d * d);
        let visibility = 0.5 / (self.cos_o * smith(alpha, cos_i) + cos_i * self.root_o);
        let glossy = schlick(f0, self.wo.dot(half)) * (distribution * visibility * cos_i);
        let visible = 0.5 * distribution / (self.cos_o + self.root_o);
        (matt + glossy, density + (1.0 - self.diffuse) * visible)
    }

    /// A direction in proportion to one of the lobes.
    pub fn sample(&self, [u, v]: [f32; 2]) -> Vec3 {
        let (x, y) = self.tangents;
        let world = |local: Vec3| (x * local.x + y * local.y + self.normal * local.z).normalize();
        if u < self.diffuse {
            let (sin, cos) = libm::sincosf(2.0 * PI * v);
            let square = u / self.diffuse;
            let r = libm::sqrtf(square);
            return world(vec3(r * cos, r * sin, libm::sqrtf((1.0 - square).max(0.0))));
        }
        let (alpha, wo) = (self.material.alpha, vec3(x.dot(self.wo), y.dot(self.wo), self.cos_o));
        let stretched = vec3(alpha * wo.x, alpha * wo.y, wo.z).normalize();
        let (sin, cos) = libm::sincosf(2.0 * PI * v);
        let z = 1.0 - (u - self.diffuse) / (1.0 - self.diffuse) * (1.0 + stretched.z);
        let r = libm::sqrtf((1.0 - z * z).max(0.0));
        let cap = vec3(r * cos, r * sin, z) + stretched;
        let half = vec3(alpha * cap.x, alpha * cap.y, cap.z.max(1e-6)).normalize();
        world(half * (2.0 * wo.dot(half)) - wo)
    }
}
