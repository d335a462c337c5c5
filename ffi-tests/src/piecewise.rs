//! The environment sampling of pbrt-v3 (Pharr et al. 2016, section 14.2.4): a piecewise constant 2D distribution, in scalar
//! floats with binary searches. For clients who interpolate it has twice the texels along each axis, each with the interpolated
//! value at its centre times the sine there; for others it has the texels.

use crate::bilinear::{direction, position};
use crate::client::{self, Density, raw};
use crate::layout::Layout;
use crate::light::Light;
use glam::{Mat3, Vec3};
use std::f32::consts::PI;

/// A piecewise constant distribution on the directions of a map.
pub struct Piecewise {
    layout: Layout,
    size: [usize; 2],
    map_from_world: Mat3,
    conditional: Vec<Constant>,
    marginal: Constant,
}

/// A piecewise constant function on [0, 1].
struct Constant {
    value: Vec<f32>,
    cumulative: Vec<f32>,
    integral: f32,
}

impl Constant {
    fn new(value: Vec<f32>) -> Constant {
        let n = value.len() as f32;
        let mut cumulative = vec![0.0];
        let mut sum = 0.0;
        cumulative.extend(value.iter().map(|v| {
            sum += v / n;
            sum
        }));
        let last = value.len();
        for (i, bound) in cumulative.iter_mut().enumerate() {
            *bound = if sum == 0.0 { i as f32 / last as f32 } else { *bound / sum };
        }
        Constant { value, cumulative, integral: sum }
    }

    /// Where `u` leads, and in which piece.
    fn sample(&self, u: f32) -> (f32, usize) {
        let piece = self.cumulative.partition_point(|&bound| bound <= u).saturating_sub(1).min(self.value.len() - 1);
        let [low, high] = [self.cumulative[piece], self.cumulative[piece + 1]];
        let inside = if high > low { (u - low) / (high - low) } else { u - low };
        ((piece as f32 + inside) / self.value.len() as f32, piece)
    }
}

impl Piecewise {
    /// Proportional to the light as its client looks it up.
    pub fn new(light: &Light) -> Piecewise {
        let finer = if light.is_bilinear() { 2 } else { 1 };
        let (layout, size) = (light.layout(), light.size().map(|n| finer * n));
        let cell = |x: usize, y: usize| {
            let (d, angle) = direction(layout, size, [x as f64 + 0.5, y as f64 + 0.5]);
            (light.exact(light.to_world(d).as_vec3()) * angle) as f32
        };
        let conditional: Vec<Constant> =
            (0..size[1]).map(|y| Constant::new((0..size[0]).map(|x| cell(x, y)).collect())).collect();
        let marginal = Constant::new(conditional.iter().map(|row| row.integral).collect());
        Piecewise { layout, size, map_from_world: light.map_from_world(), conditional, marginal }
    }

    /// Probability for a unit of the map over the directions of that unit.
    fn density(&self, value: f32, d: Vec3, [column, row]: [f32; 2]) -> f32 {
        let angle = match self.layout {
            Layout::LatLong => 2.0 * PI * PI * (row * PI).sin(),
            _ => {
                let count = (self.size[0] * self.size[1]) as f64;
                let at = [f64::from(column) * self.size[0] as f64, f64::from(row) * self.size[1] as f64];
                (direction(self.layout, self.size, at).1 * count) as f32
            }
        };
        if angle > 0.0 && d != Vec3::ZERO { value / (self.marginal.integral * angle) } else { 0.0 }
    }
}

impl Density for Piecewise {
    fn sample(&self, u: [f32; 2]) -> client::Result<raw::wis_drawn> {
        let (row, y) = self.marginal.sample(u[1]);
        let (column, x) = self.conditional[y].sample(u[0]);
        let d = match self.layout {
            Layout::LatLong => {
                let ((sin_theta, cos_theta), (sin_phi, cos_phi)) =
                    ((row * PI).sin_cos(), (column * 2.0 * PI).sin_cos());
                Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
            }
            _ => {
                let at = [f64::from(column) * self.size[0] as f64, f64::from(row) * self.size[1] as f64];
                direction(self.layout, self.size, at).0.as_vec3()
            }
        };
        let pdf = self.density(self.conditional[y].value[x], d, [column, row]);
        Ok(raw::wis_drawn { wi: (self.map_from_world.transpose() * d).to_array(), pdf })
    }

    fn pdf(&self, wi: [f32; 3]) -> client::Result<f32> {
        let d = self.map_from_world * Vec3::from_array(wi);
        let [column, row] = match self.layout {
            Layout::LatLong => {
                let azimuth = d.y.atan2(d.x) * (0.5 / PI);
                [if azimuth < 0.0 { azimuth + 1.0 } else { azimuth }, d.z.clamp(-1.0, 1.0).acos() / PI]
            }
            _ => {
                let [column, row] = position(self.layout, self.size, d.as_dvec3());
                [(column / self.size[0] as f64) as f32, (row / self.size[1] as f64) as f32]
            }
        };
        let [x, y] = [(column, self.size[0]), (row, self.size[1])].map(|(c, n)| ((c * n as f32) as usize).min(n - 1));
        Ok(self.density(self.conditional[y].value[x], d, [column, row]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of L / pdf over samples is the power, and the pdf of a sample is that of its direction.
    #[test]
    fn samples_meet_their_pdf() {
        for light in [Light::windows(64), Light::windows(64).bilinear()] {
            let table = Piecewise::new(&light);
            let u = crate::points::of(3, 1 << 14);
            let (mut sum, mut off) = (0.0, 0);
            for u in &u {
                let drawn = table.sample(*u).unwrap();
                sum += light.exact(Vec3::from_array(drawn.wi)) / f64::from(drawn.pdf);
                off += u32::from((table.pdf(drawn.wi).unwrap() / drawn.pdf - 1.0).abs() > 1e-3);
            }
            let mean = sum / u.len() as f64 / (4.0 * std::f64::consts::PI);
            assert!((mean / light.mean() - 1.0).abs() < 0.01, "{mean} {}", light.mean());
            assert!(off < 8, "{off} pdfs differ");
        }
    }
}
