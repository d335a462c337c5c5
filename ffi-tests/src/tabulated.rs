//! Scattered measurements on a grid, as a renderer would keep them: looked up in constant time, and sampled.
//!
//! A slice for each elevation of wo holds the BRDF over the unit square of wi: azimuth from wo along one axis, the squared
//! sine of the elevation along the other. Areas of that square are pi times smaller than projected solid angles, so a
//! density in proportion to the BRDF becomes one in proportion to BRDF x cosine.

use crate::cornell::Scattered;
use crate::grid::{Grid, Slices};
use crate::lanes::{F8, V8, sin_cos_turn, turn};
use crate::reflectance::{Reflectance, View};
use crate::warp::Warp;
use glam::{DVec3, dvec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A BRDF on a grid.
pub struct Tabulated {
    name: String,
    elevations: Vec<f32>,
    density: Warp,
    /// That density, and the BRDF.
    both: Grid,
    roughness: f64,
}

impl std::fmt::Debug for Tabulated {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "Tabulated({})", self.name)
    }
}

/// Elevations of wo, up to a little less than a right angle.
const SLICES: usize = 16;
const GRAZING: f64 = 0.99;
/// Azimuths and elevations of wi; the azimuths 0 and 2 pi are both there.
const COLUMNS: usize = 65;
const ROWS: usize = 48;
/// No value is smaller than this share of the largest of its slice: what is interpolated can then be sampled.
const FLOOR: f64 = 1e-4;

impl Tabulated {
    pub fn new(scattered: &Scattered) -> Tabulated {
        let elevations: Vec<f64> = (0..SLICES).map(|k| k as f64 / (SLICES - 1) as f64 * GRAZING * FRAC_PI_2).collect();
        let mut values = Vec::with_capacity(SLICES * ROWS * COLUMNS);
        for &theta in &elevations {
            let wo = dvec3(theta.sin(), 0.0, theta.cos());
            let first = values.len();
            for (row, column) in (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (row, column))) {
                // The last row is the horizon itself, where there is no BRDF.
                let y = (row as f64 / (ROWS - 1) as f64).min(0.999);
                let wi = direction([column as f64 / (COLUMNS - 1) as f64, y]);
                values.push(scattered.eval(wo, wi) / wi.z);
            }
            let slice = &mut values[first..];
            let largest = slice.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
            slice.iter_mut().for_each(|value| *value = value.max(FLOOR * largest));
        }
        let density = Warp::new([COLUMNS, ROWS], &values);
        let both = density.densities().zip(values).map(|(density, value)| [density, value as f32]).collect();
        Tabulated {
            name: scattered.name.clone(),
            elevations: elevations.into_iter().map(|theta| theta as f32).collect(),
            density,
            both: Grid::new([COLUMNS, ROWS], both),
            roughness: roughness(scattered),
        }
    }
}

/// From where a lobe at 45 degrees has fallen to half of its mirror direction, in the plane of incidence.
fn roughness(scattered: &Scattered) -> f64 {
    let at = |theta: f64| dvec3(theta.sin(), 0.0, theta.cos());
    let lobe = |turned: f64| scattered.eval(at(-0.25 * PI), at(0.25 * PI - turned));
    let half = (1..90).map(|i| f64::from(i) * 0.25 * PI / 90.0).find(|&turned| lobe(turned) < 0.5 * lobe(0.0));
    // A half vector turns by half of that.
    half.map_or(1.0, |angle| 0.5 * angle / 0.64)
}

/// The direction of wi for a point of the square.
fn direction([x, y]: [f64; 2]) -> DVec3 {
    let (phi, sine) = (TAU * x, y.sqrt());
    dvec3(sine * phi.cos(), sine * phi.sin(), (1.0 - y).max(0.0).sqrt())
}

impl Reflectance for Tabulated {
    fn name(&self) -> &str {
        &self.name
    }

    fn roughness(&self) -> f64 {
        self.roughness
    }

    fn view(&self, wo: DVec3) -> View {
        let mut view = View::new(wo);
        view.slices = Slices::about(&self.elevations, view.elevation);
        view
    }

    fn eval_lanes(&self, view: &View, wi: V8, used: usize) -> (F8, F8) {
        let V8 { x, y, z } = view.facing(wi);
        let [density, value] = self.both.eval(view.slices, [turn(x, y), x * x + y * y], used);
        let cosine = view.above(z) & z;
        (value * cosine, density * cosine * F8::splat(PI.recip() as f32))
    }

    fn sample_lanes(&self, view: &View, u: [F8; 2], used: usize) -> V8 {
        let [x, y] = self.density.sample(view.slices, u, used).0;
        let ((sin, cos), sine) = (sin_cos_turn(x), y.sqrt());
        view.back(V8::new(sine * cos, sine * sin, (F8::ONE - y).fast_max(F8::ZERO).sqrt()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A glossy lobe on a diffuse ground, measured at scattered pairs of directions.
    fn scattered() -> Scattered {
        let mut text = String::from("1\n555\n");
        for i in 0..1200 {
            let at = |k: u32| f64::from((i * k) % 1201) / 1201.0;
            let (theta_i, theta_o, azimuth) = (1.4 * at(571), 1.4 * at(769), PI * at(947));
            let wo = dvec3(-theta_o.sin(), 0.0, theta_o.cos());
            let wi = dvec3(theta_i.sin() * azimuth.cos(), theta_i.sin() * azimuth.sin(), theta_i.cos());
            let value = 0.1 + 2.0 * wo.dot(wi).max(0.0).powi(12);
            text += &format!("{theta_i} {azimuth} {theta_o} 0 {value}\n");
        }
        Scattered::parse("made here".into(), &text).unwrap()
    }

    #[test]
    fn scattered_measurements_are_sampled_as_they_reflect() {
        let (scattered, count) = (scattered(), 1 << 16);
        let brdf = Tabulated::new(&scattered);
        let u = crate::points::of(3, count);
        for theta in [0.05, 0.6, 1.2f64] {
            let wo = dvec3(theta.sin() * 0.8, theta.sin() * 0.6, theta.cos());
            let (mut sampled, mut uniform, mut density, mut measured) = (0.0, 0.0, 0.0, 0.0);
            for u in &u {
                let u = u.map(f64::from);
                let wi = brdf.sample(wo, u);
                let pdf = brdf.pdf(wo, wi);
                assert!(wi.z <= 0.0 || pdf > 0.0);
                sampled += if wi.z > 0.0 { brdf.eval(wo, wi) / pdf } else { 0.0 };
                let radius = (1.0 - u[0] * u[0]).sqrt();
                let flat = dvec3(radius * (TAU * u[1]).cos(), radius * (TAU * u[1]).sin(), u[0]);
                uniform += brdf.eval(wo, flat) * TAU;
                density += brdf.pdf(wo, flat) * TAU;
            }
            for u in u.iter().step_by(64) {
                let wi = direction(u.map(f64::from));
                measured += scattered.eval(wo, wi) / wi.z * PI * 64.0;
            }
            let [sampled, uniform, density, measured] =
                [sampled, uniform, density, measured].map(|sum| sum / count as f64);
            assert!((density - 1.0).abs() < 0.01, "{theta}: the pdf integrates to {density}");
            assert!((sampled / uniform - 1.0).abs() < 0.01, "{theta}: {sampled} {uniform}");
            assert!((uniform / measured - 1.0).abs() < 0.05, "{theta}: {uniform} in place of {measured}");
        }
        assert!((0.1..0.8).contains(&brdf.roughness()), "{}", brdf.roughness());
    }
}
