//! Values and densities of microfacet lobes against their formulas in f64 (Walter et al. 2007).

use super::client::unit;
use super::lookup::{V3, single};
use super::points::view;
use std::f64::consts::PI;
use wis::brdf::ggx::{Ggx, Refracting};
use wis::brdf::material::{Kind, Material, Shape};
use wis::brdf::surface::Surface;
use wis::sphere::Frame;

const ALPHA: f64 = 0.4;

fn dot(a: V3, b: V3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn lambda(w: V3) -> f64 {
    let slope = ALPHA * ALPHA * (w[0] * w[0] + w[1] * w[1]) / (w[2] * w[2]);
    0.5 * ((1.0 + slope).sqrt() - 1.0)
}

fn distribution(h: V3) -> f64 {
    let q = (h[0] * h[0] + h[1] * h[1]) / (ALPHA * ALPHA) + h[2] * h[2];
    1.0 / (PI * ALPHA * ALPHA * q * q)
}

fn schlick(f0: f64, cosine: f64) -> f64 {
    f0 + (1.0 - f0) * (1.0 - cosine).powi(5)
}

/// Height-correlated shadowing on one side; across the surface both lambdas are those of their own sides.
fn shadowing(wo: V3, wi: V3) -> f64 {
    1.0 / (1.0 + lambda(wo) + lambda(wi))
}

fn reflected(f0: f64, wo: V3, wi: V3) -> f64 {
    let h = unit([0, 1, 2].map(|k| wo[k] + wi[k]));
    schlick(f0, dot(wo, h)) * distribution(h) * shadowing(wo, wi) / (4.0 * wo[2])
}

fn transmitted(f0: f64, eta: f64, wo: V3, wi: V3) -> f64 {
    let h = unit([0, 1, 2].map(|k| wo[k] + eta * wi[k]));
    let h = if h[2] < 0.0 { h.map(|x| -x) } else { h };
    let (o, i) = (dot(wo, h), dot(wi, h));
    if o <= 0.0 || i >= 0.0 {
        return 0.0;
    }
    let jacobian = eta * eta * i.abs() / (o + eta * i).powi(2);
    (1.0 - schlick(f0, o)) * distribution(h) * shadowing(wo, wi) * o * jacobian / wo[2]
}

#[test]
fn values_are_those_of_the_formulas() {
    for eta in [1.5, 1.0 / 1.5] {
        let shape = |kind| Shape { kind, a: ALPHA as f32, b: ALPHA as f32, eta: eta as f32 };
        for kind in [Kind::Ggx, Kind::GgxTransmission] {
            let material = Material::new(&[shape(kind)]).unwrap();
            let mut point = view(&material, [0.0, 0.0, 1.0], 40.0, 0.7);
            point.f0 = [[0.04; 3]; 4];
            let surface = Surface::new(&point, &Frame::IDENTITY).unwrap();
            let wo = surface.wo().map(f64::from);
            let mut compared = 0;
            for k in 0..400 {
                let (z, turn) = ((f64::from(k) + 0.5) / 400.0, 2.399_963 * f64::from(k));
                let z = if kind == Kind::Ggx { z } else { -z };
                let level = (1.0 - z * z).sqrt();
                let wi = [level * turn.cos(), level * turn.sin(), z];
                let expected = if kind == Kind::Ggx { reflected(0.04, wo, wi) } else { transmitted(0.04, eta, wo, wi) };
                let found = f64::from(surface.value::<f32>(single(wi)));
                assert!(
                    (found - expected).abs() <= 1e-3 * expected + 1e-5,
                    "{kind:?} {eta} {wi:?}: {found} {expected}"
                );
                compared += usize::from(expected > 1e-3);
            }
            assert!(compared > 50, "{kind:?} {eta}: {compared}");
        }
    }
}

/// What total reflection sends back counts, too: the density of all directions that are drawn integrates to 1. Of 0.1 beyond the critical angle only
/// numbers about those that let directions through are drawn: were one left out, the integral would be less.
#[test]
fn densities_of_refraction_integrate_to_one() {
    const SIDE: u32 = 1600;
    for (eta, alpha, z) in
        [(1.5f32, [0.5; 2], 0.5f32), (1.0 / 1.5, [0.5; 2], 0.5), (1.0 / 1.5, [0.1; 2], 0.1), (0.8, [0.1, 0.3], 0.3)]
    {
        let level = (1.0 - z * z).sqrt();
        let ggx = Ggx::new(alpha, [0.8 * level, 0.6 * level, z]);
        let drawn = ggx.refracting(eta);
        assert_eq!(drawn == Refracting::ALL, eta > 1.0, "{eta}, {alpha:?}");
        for of in [Refracting::ALL, drawn] {
            let mut sum = 0.0;
            for k in 0..SIDE * SIDE {
                let z = 2.0 * (f64::from(k / SIDE) + 0.5) / f64::from(SIDE) - 1.0;
                let (level, turn) = ((1.0 - z * z).sqrt(), 2.0 * PI * (f64::from(k % SIDE) + 0.5) / f64::from(SIDE));
                let wi = single([level * turn.cos(), level * turn.sin(), z]);
                sum += f64::from(ggx.transmitted::<f32>(wi, eta, &of));
            }
            let integral = sum * 4.0 * PI / f64::from(SIDE * SIDE);
            assert!((integral - 1.0).abs() < 0.01, "{eta}, {alpha:?}, {of:?}: {integral}");
        }
    }
}
