//! The reference integral of radiance x BRDF x cosine over the sphere, as a client evaluates them.

use super::Map;
use super::maps::Filter;
use super::material::Material;
use super::vector::{V3, distance, dot, luminance, rotate, rotate_back};
use std::f64::consts::PI;
use wis::wavelets::query::WIS_WAVELET_QUERY_WHOLE_SPHERE;

/// Abscissa of Gauss' rule with two points on [-1/2, 1/2].
pub const GAUSS: f64 = 0.288_675_134_594_812_9;

/// A map and a shading point in world space.
pub struct Scene<'a> {
    pub map: &'a Map,
    pub filter: Filter,
    pub world_from_map: [f32; 9],
    pub material: Material,
}

impl Scene<'_> {
    /// The luminance of radiance x BRDF x cosine at a direction of world space.
    pub fn integrand(&self, wi: V3) -> f64 {
        let f = self.material.f_cos(wi);
        if f == [0.0; 3] {
            return 0.0;
        }
        let l = self.map.radiance(self.filter, rotate_back(&self.world_from_map, wi));
        luminance([f[0] * l[0], f[1] * l[1], f[2] * l[2]])
    }

    /// The integral of the integrand. The cells inside which the look-up is smooth are divided until they are small
    /// beside the lobes' detail or the distance from their peak; an error below 1e-4 is left at `fineness` 1.
    pub fn integral(&self, fineness: f64) -> f64 {
        let integrator = Integrator { scene: self, mirror: self.material.mirror(), fineness };
        let height = f64::from(self.map.height);
        // A bilinear look-up is smooth between the centres of texels.
        let shift = if self.filter == Filter::Nearest { 0.0 } else { -0.5 };
        let rows = (0..=self.map.height).map(|row| f64::from(row) + shift);
        let rows = rows.map(|y| [y.max(0.0), (y + 1.0).min(height)]).filter(|y| y[1] > y[0]);
        let columns = || (0..self.map.width).map(|column| f64::from(column) + shift);
        rows.flat_map(|y| columns().map(move |x| ([x, x + 1.0], y))).map(|(x, y)| integrator.cell(x, y, 0)).sum()
    }
}

struct Integrator<'a> {
    scene: &'a Scene<'a>,
    mirror: V3,
    fineness: f64,
}

impl Integrator<'_> {
    /// The integral over a cell, in units of texels.
    fn cell(&self, x: [f64; 2], y: [f64; 2], depth: u32) -> f64 {
        let (map, material) = (self.scene.map, &self.scene.material);
        let middle = [0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])];
        if depth == 0 && map.radiance_at(self.scene.filter, middle[0], middle[1]) == [0.0; 3] {
            return 0.0;
        }
        let (width, height) =
            (2.0 * PI * (x[1] - x[0]) / f64::from(map.width), PI * (y[1] - y[0]) / f64::from(map.height));
        let sine = (PI * middle[1] / f64::from(map.height)).sin();
        let radius = 0.5 * (width * (sine + 0.5 * height)).hypot(height);
        let centre = rotate(&self.scene.world_from_map, map.direction(middle[0], middle[1]));
        let elevation = dot(material.normal, centre);
        let whole = material.query.flags & WIS_WAVELET_QUERY_WHOLE_SPHERE != 0;
        if elevation < -radius && !whole {
            return 0.0;
        }
        let about_peak = 0.07 * (material.narrowest_detail() + distance(centre, self.mirror));
        let above_horizon = 0.1 * (material.detail() + elevation.abs());
        // The cosine has a kink at the horizon.
        let at_horizon = if elevation.abs() < radius { 0.01 } else { 1.0 };
        let limit = about_peak.min(above_horizon).min(at_horizon);
        if radius * self.fineness > limit && depth < 16 {
            let halves = |s: [f64; 2], m: f64| [[s[0], m], [m, s[1]]];
            let quarters = halves(x, middle[0]).into_iter().flat_map(|x| halves(y, middle[1]).map(|y| (x, y)));
            return quarters.map(|(x, y)| self.cell(x, y, depth + 1)).sum();
        }
        width * height * self.mean(x, y)
    }

    /// The mean of integrand x sine of the polar angle over a cell.
    fn mean(&self, x: [f64; 2], y: [f64; 2]) -> f64 {
        let map = self.scene.map;
        let points = |s: [f64; 2]| [-GAUSS, GAUSS].map(|g| 0.5 * (s[0] + s[1]) + g * (s[1] - s[0]));
        let value = |x: f64, y: f64| {
            let sine = (PI * y / f64::from(map.height)).sin();
            sine * self.scene.integrand(rotate(&self.scene.world_from_map, map.direction(x, y)))
        };
        0.25 * points(x).iter().flat_map(|&x| points(y).map(|y| value(x, y))).sum::<f64>()
    }
}
