//! The naive twin of the lobes: textbook formulas in f64.

use super::vector::{V3, add, cross, dot, scale, sub, unit};
use std::f64::consts::PI;
use wis::wavelets::query::{
    Lobe, Query, WIS_WAVELET_LOBE_GGX, WIS_WAVELET_LOBE_LAMBERT, WIS_WAVELET_QUERY_COSINE_INCLUDED,
    WIS_WAVELET_QUERY_WHOLE_SPHERE,
};

/// A query as a client evaluates it.
pub struct Material {
    pub query: Query,
    pub normal: V3,
    frame: [V3; 2],
    wo: V3,
}

impl Material {
    pub fn new(query: &Query) -> Material {
        let normal = unit(query.normal.map(f64::from));
        let given = query.tangent.map(f64::from);
        let helper = if normal[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let along = if given == [0.0; 3] { helper } else { given };
        let tangent = unit(sub(along, scale(normal, dot(normal, along))));
        let frame = [tangent, cross(normal, tangent)];
        Material { query: *query, normal, frame, wo: unit(query.wo.map(f64::from)) }
    }

    /// The mirror direction of wo.
    pub fn mirror(&self) -> V3 {
        sub(scale(self.normal, 2.0 * dot(self.normal, self.wo)), self.wo)
    }

    pub fn lobes(&self) -> &[Lobe] {
        &self.query.lobe[..self.query.lobe_count as usize]
    }

    /// The angle over which the narrowest lobe varies along the plane of incidence, and above the horizon.
    pub fn detail(&self) -> f64 {
        let detail =
            |lobe: &Lobe| if lobe.kind == WIS_WAVELET_LOBE_GGX { lobe.a.min(lobe.b).into() } else { half_angle(lobe) };
        self.lobes().iter().map(detail).fold(1.0, f64::min)
    }

    /// The same across the plane of incidence, where a grazing view makes it narrower.
    pub fn narrowest_detail(&self) -> f64 {
        self.detail() * dot(self.normal, self.wo).clamp(0.05, 1.0)
    }

    /// The half-angle of the whole: that of the widest lobe with at least a tenth of the weight (rule 25).
    pub fn half_angle(&self) -> f64 {
        let total: f32 = self.lobes().iter().map(|lobe| lobe.weight[1]).sum();
        let heavy = self.lobes().iter().filter(|lobe| lobe.weight[1] >= 0.1 * total);
        heavy.map(half_angle).fold(0.0, f64::max)
    }

    /// RGB of BRDF x cosine.
    pub fn f_cos(&self, wi: V3) -> V3 {
        let whole = self.query.flags & WIS_WAVELET_QUERY_WHOLE_SPHERE != 0;
        let local = |v: V3| [dot(v, self.frame[0]), dot(v, self.frame[1]), dot(v, self.normal)];
        let (mut wi, mut wo) = (local(wi), local(self.wo));
        if whole && wo[2] < 0.0 {
            (wi[2], wo[2]) = (-wi[2], -wo[2]);
        }
        if !whole && (wi[2] <= 0.0 || wo[2] <= 0.0) {
            return [0.0; 3];
        }
        let cosine = if self.query.flags & WIS_WAVELET_QUERY_COSINE_INCLUDED != 0 { 1.0 } else { wi[2].abs() };
        let sum = self.lobes().iter().fold([0.0; 3], |sum, lobe| add(sum, value(lobe, wo, wi)));
        scale(sum, cosine)
    }
}

fn half_angle(lobe: &Lobe) -> f64 {
    match lobe.kind {
        WIS_WAVELET_LOBE_LAMBERT => 0.5 * PI,
        WIS_WAVELET_LOBE_GGX => f64::from(lobe.a * lobe.b).sqrt(),
        _ => (-1.0 / (f64::from(lobe.a) + 1.0)).exp2().acos(),
    }
}

/// A lobe without the cosine; in the frame of tangent, bitangent and normal.
fn value(lobe: &Lobe, wo: V3, wi: V3) -> V3 {
    let weight = lobe.weight.map(f64::from);
    if lobe.kind == WIS_WAVELET_LOBE_LAMBERT {
        return scale(weight, 1.0 / PI);
    }
    if wi[2] <= 0.0 || wo[2] <= 0.0 {
        return [0.0; 3];
    }
    if lobe.kind == WIS_WAVELET_LOBE_GGX {
        return ggx(lobe, wo, wi);
    }
    let exponent = f64::from(lobe.a);
    let cosine = wi[2] * wo[2] - wi[0] * wo[0] - wi[1] * wo[1];
    let shape = if cosine > 0.0 { cosine.powf(exponent) } else { 0.0 };
    scale(weight, (exponent + 2.0) / (2.0 * PI) * shape)
}

/// Walter et al. 2007 and Heitz 2014: D F G / (4 cos cos), with height-correlated masking and shadowing.
fn ggx(lobe: &Lobe, wo: V3, wi: V3) -> V3 {
    let (ax, ay) = (f64::from(lobe.a), f64::from(lobe.b));
    let h = unit(add(wo, wi));
    let slope = (h[0] / ax).powi(2) + (h[1] / ay).powi(2) + h[2] * h[2];
    let d = 1.0 / (PI * ax * ay * slope * slope);
    let lambda = |v: V3| 0.5 * ((1.0 + ((ax * v[0]).powi(2) + (ay * v[1]).powi(2)) / (v[2] * v[2])).sqrt() - 1.0);
    let g = 1.0 / (1.0 + lambda(wo) + lambda(wi));
    let grazing = (1.0 - dot(wi, h)).powi(5);
    let shape = d * g / (4.0 * wo[2] * wi[2]);
    let channel = |c: usize| {
        let f0 = f64::from(lobe.f0[c]);
        f64::from(lobe.weight[c]) * (f0 + (1.0 - f0) * grazing) * shape
    };
    [channel(0), channel(1), channel(2)]
}
