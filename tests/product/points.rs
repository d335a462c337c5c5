//! Materials and views that products are judged on.

use super::client::{cross, unit};
use super::lookup::{V3, single};
use wis::brdf::material::{Kind, Material, Shape};
use wis::brdf::point::Point;

pub fn phong(exponent: f32) -> Shape {
    Shape { kind: Kind::Phong, a: exponent, b: 0.0, eta: 1.0 }
}

/// From wide to narrow, isotropic and not, and mixtures.
pub fn materials() -> Vec<(&'static str, Material)> {
    let of = |shapes: &[Shape]| Material::new(shapes).unwrap();
    let ggx = |a: f32| Shape::ggx(a, a);
    vec![
        ("Lambert", of(&[Shape::LAMBERT])),
        ("GGX .5", of(&[ggx(0.5)])),
        ("GGX .2", of(&[ggx(0.2)])),
        ("GGX .1", of(&[ggx(0.1)])),
        ("GGX .05", of(&[ggx(0.05)])),
        ("GGX .02", of(&[ggx(0.02)])),
        ("GGX .5 x .02", of(&[Shape::ggx(0.5, 0.02)])),
        ("GGX .2 x .02", of(&[Shape::ggx(0.2, 0.02)])),
        ("GGX .3 x .05", of(&[Shape::ggx(0.3, 0.05)])),
        ("Phong 20", of(&[phong(20.0)])),
        ("Phong 500", of(&[phong(500.0)])),
        ("Lambert + GGX .1", of(&[Shape::LAMBERT, ggx(0.1)])),
        ("Lambert + GGX .02", of(&[Shape::LAMBERT, ggx(0.02)])),
    ]
}

/// A point with this normal whose view is `degrees` from it, in a plane that stands `around` about the normal.
pub fn view<'a>(material: &'a Material, normal: V3, degrees: f64, around: f64) -> Point<'a> {
    let n = unit(normal);
    let t = unit(cross(n, if n[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] }));
    let b = cross(n, t);
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let (y, x) = around.sin_cos();
    let wo = [0, 1, 2].map(|k| n[k] * cosine + sine * (t[k] * x + b[k] * y));
    let mut point = Point::new(material, single(n), single(unit(wo)));
    point.tangent = single(t);
    // A diffuse lobe beside another is 0.8 bright, the glossy one has the reflectance of plastic.
    for (weight, (f0, shape)) in point.weight.iter_mut().zip(point.f0.iter_mut().zip(material.lobes())) {
        *weight = if shape.kind == Kind::Lambert && material.lobes().len() > 1 { [0.8; 3] } else { [1.0; 3] };
        *f0 = if material.lobes().len() > 1 { [0.05; 3] } else { [0.9; 3] };
    }
    point
}
