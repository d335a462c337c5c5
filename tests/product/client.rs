//! The naive twin of the lobes: textbook formulas in f64, in the frame of the point.

use super::lookup::V3;
use std::f64::consts::PI;
use wis::brdf::material::{Kind, Shape};
use wis::brdf::point::Point;

pub fn dot(a: V3, b: V3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn cross(a: V3, b: V3) -> V3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub fn unit(a: V3) -> V3 {
    a.map(|x| x / dot(a, a).sqrt())
}

/// A point as a client evaluates it.
pub struct Client {
    lobes: Vec<(Shape, f64, f64)>,
    axes: [V3; 3],
    wo: V3,
}

impl Client {
    /// Grey weights and reflectances only.
    pub fn new(point: &Point<'_>) -> Client {
        let n = unit(point.normal.map(f64::from));
        let helper = if n[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let given = point.tangent.map(f64::from);
        let along = if given == [0.0; 3] { helper } else { given };
        let t = unit([0, 1, 2].map(|k| along[k] - n[k] * dot(n, along)));
        let axes = [t, cross(n, t), n];
        let lobes = point.material.lobes().iter().zip(point.weight.iter().zip(&point.f0));
        let lobes = lobes.map(|(shape, (w, f))| (*shape, f64::from(w[1]), f64::from(f[1]))).collect();
        let wo = unit(point.wo.map(f64::from));
        Client { lobes, axes, wo: axes.map(|axis| dot(axis, wo)) }
    }

    /// The mirror direction of wo.
    pub fn mirror(&self) -> V3 {
        let [t, b, n] = self.axes;
        [0, 1, 2].map(|k| self.wo[2] * n[k] - self.wo[0] * t[k] - self.wo[1] * b[k])
    }

    /// The normal.
    pub fn normal(&self) -> V3 {
        self.axes[2]
    }

    /// The cosine to the normal.
    pub fn cosine(&self, wi: V3) -> f64 {
        dot(self.axes[2], wi)
    }

    /// BRDF x cosine, on the upper hemisphere.
    pub fn f_cos(&self, wi: V3) -> f64 {
        let wi = self.axes.map(|axis| dot(axis, wi));
        if wi[2] <= 0.0 || self.wo[2] <= 0.0 {
            return 0.0;
        }
        self.lobes.iter().map(|(shape, weight, f0)| weight * value(shape, *f0, self.wo, wi)).sum::<f64>() * wi[2]
    }
}

fn value(shape: &Shape, f0: f64, wo: V3, wi: V3) -> f64 {
    match shape.kind {
        Kind::Lambert => 1.0 / PI,
        Kind::Ggx => ggx(shape, f0, wo, wi),
        Kind::Phong => {
            let exponent = f64::from(shape.a);
            let cosine = wi[2] * wo[2] - wi[0] * wo[0] - wi[1] * wo[1];
            (exponent + 2.0) / (2.0 * PI) * if cosine > 0.0 { cosine.powf(exponent) } else { 0.0 }
        }
        kind => panic!("{kind:?} has no twin"),
    }
}

/// Walter et al. 2007 and Heitz 2014: D F G / (4 cos cos), with height-correlated masking and shadowing.
fn ggx(shape: &Shape, f0: f64, wo: V3, wi: V3) -> f64 {
    let (ax, ay) = (f64::from(shape.a), f64::from(shape.b));
    let h = unit([0, 1, 2].map(|k| wo[k] + wi[k]));
    let slope = (h[0] / ax).powi(2) + (h[1] / ay).powi(2) + h[2] * h[2];
    let d = 1.0 / (PI * ax * ay * slope * slope);
    let lambda = |v: V3| 0.5 * ((1.0 + ((ax * v[0]).powi(2) + (ay * v[1]).powi(2)) / (v[2] * v[2])).sqrt() - 1.0);
    let g = 1.0 / (1.0 + lambda(wo) + lambda(wi));
    let fresnel = f0 + (1.0 - f0) * (1.0 - dot(wi, h)).powi(5);
    d * fresnel * g / (4.0 * wo[2] * wi[2])
}
