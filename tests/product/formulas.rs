//! Values and densities of microfacet lobes against their formulas in f64 (Walter et al. 2007).

use super::lookup::single;
use super::points::view;
use crate::direct::brdfs::{self, Lobe};
use std::f64::consts::PI;
use wis::brdf::ggx::{Ggx, Refracting};
use wis::brdf::material::{Kind, Material, Shape};
use wis::brdf::surface::{Local, Surface};
use wis::sphere::Frame;

const ALPHA: f32 = 0.4;

/// Directions that are local.
struct Own;

impl Local<f32> for Own {
    type Given = f32;

    fn local(&self, d: [&[f32]; 3]) -> [f32; 3] {
        d.map(|axis| axis[0])
    }
}

#[test]
fn values_are_those_of_the_formulas() {
    for eta in [1.5, 1.0 / 1.5] {
        let shape = |kind| Shape { kind, a: ALPHA, b: ALPHA, eta: eta as f32 };
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
                let expected = brdfs::sum(&[Lobe { shape: shape(kind), weight: 1.0, f0: 0.04 }], false, wo, wi);
                let (wi_of, mut sum) = (single(wi), [f32::NAN]);
                surface.values(wi_of.each_ref().map(core::slice::from_ref), &mut sum, &Own, [1.0; 2]);
                let [of_lobes] = sum;
                assert_eq!(of_lobes, surface.eval::<f32>(wi_of).0, "{kind:?} {eta} {wi:?}");
                let found = f64::from(of_lobes);
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
