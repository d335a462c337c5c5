//! The naive twin of a point: lobes by textbook formulas in f64, in its frame.

use super::lookup::V3;
use crate::direct::brdfs::{self, Lobe};
pub use crate::support::vector::{cross, dot, unit};
use wis::brdf::point::Point;

/// A point as a client evaluates it.
pub struct Client {
    lobes: Vec<Lobe>,
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
        let lobes = lobes.map(|(&shape, (w, f))| Lobe { shape, weight: w[1].into(), f0: f[1].into() }).collect();
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
        if wi[2] <= 0.0 { 0.0 } else { brdfs::sum(&self.lobes, false, self.wo, wi) }
    }
}
