//! The model of visibility behind structured importance sampling (Agarwal et al. 2003, Section 2.1), measured: how fast
//! visibility forgets with the angle, and how much it varies in a cone.

use crate::directions::{beside, hemisphere};
use crate::points;
use crate::scene::{Scene, ShadingPoint};
use glam::Vec3;
use std::f32::consts::TAU;

/// Angles are measured in so many steps up to `WIDEST`.
pub const STEPS: usize = 24;
/// Radians.
pub const WIDEST: f32 = 0.72;
/// Pairs of directions at each angle, and cones of each half-angle.
const PAIRS: usize = 16384;
const CONES: usize = 2048;
/// Directions in a cone.
const IN_A_CONE: usize = 32;

/// What was measured at a point.
pub struct Model {
    /// The share of the hemisphere that is visible.
    pub visible: f64,
    /// Angle, and the correlation of visibility at that distance.
    pub correlation: Vec<(f64, f64)>,
    /// Half-angle of a cone, and the variance of visibility in it over that of the hemisphere.
    pub variance: Vec<(f64, f64)>,
    /// The angle T of the fit exp(-angle / T).
    pub angle: f64,
    /// How much of the variation of log(correlation) the fit explains.
    pub explained: f64,
}

/// The share of the hemisphere that a point sees, roughly.
pub fn visible_share(scene: &Scene, point: &ShadingPoint) -> f64 {
    let u = points::of(1, 64);
    let seen = u.iter().filter(|u| scene.visible(point, hemisphere(point.normal, **u))).count();
    seen as f64 / u.len() as f64
}

/// Measures at a point.
pub fn measure(scene: &Scene, point: &ShadingPoint) -> Model {
    let angle = |step: usize| WIDEST * (step + 1) as f32 / STEPS as f32;
    let u = points::of(2, PAIRS * 2);
    let seen = |wi: Vec3| f64::from(u8::from(scene.visible(point, wi)));
    let visible = u.iter().map(|&u| seen(hemisphere(point.normal, u))).sum::<f64>() / u.len() as f64;
    let whole = visible * (1.0 - visible);
    let correlation: Vec<_> =
        (0..STEPS).map(|step| (f64::from(angle(step)), correlation(point, seen, angle(step)))).collect();
    let variance =
        (0..STEPS).map(|step| (f64::from(angle(step)), variance(point, seen, angle(step)) / whole)).collect();
    let (angle, explained) = fit(&correlation);
    Model { visible, correlation, variance, angle, explained }
}

/// The correlation of visibility over pairs of directions of the hemisphere that are an angle apart.
fn correlation(point: &ShadingPoint, seen: impl Fn(Vec3) -> f64, angle: f32) -> f64 {
    let (first, second) = (points::of(3, PAIRS), points::of(4, PAIRS));
    let (mut count, mut sum, mut both) = (0.0, 0.0, 0.0);
    for (u, turn) in first.iter().zip(&second) {
        let a = hemisphere(point.normal, *u);
        let b = beside(a, angle, TAU * turn[0]);
        if b.dot(point.normal) <= 0.0 {
            continue;
        }
        let (a, b) = (seen(a), seen(b));
        count += 1.0;
        sum += a + b;
        both += a * b;
    }
    let mean = 0.5 * sum / count;
    (both / count - mean * mean) / (mean - mean * mean)
}

/// The mean variance of visibility over cones of a half-angle that lie in the hemisphere.
fn variance(point: &ShadingPoint, seen: impl Fn(Vec3) -> f64, half_angle: f32) -> f64 {
    let (mut centres, mut places) = (vec![[0.0; 2]; CONES], vec![[0.0; 2]; IN_A_CONE]);
    points::sobol(5, 0, &mut centres);
    let (mut sum, mut count) = (0.0, 0.0);
    for (seed, centre) in (6..).zip(&centres) {
        let centre = hemisphere(point.normal, *centre);
        if centre.dot(point.normal) < half_angle.sin() {
            continue;
        }
        points::sobol(seed, 0, &mut places);
        let place = |u: &[f32; 2]| beside(centre, (1.0 - u[0] * (1.0 - half_angle.cos())).acos(), TAU * u[1]);
        let mean = places.iter().map(|u| seen(place(u))).sum::<f64>() / IN_A_CONE as f64;
        // Stratified places estimate the mean well: no correction for their number.
        sum += mean * (1.0 - mean);
        count += 1.0;
    }
    sum / count
}

/// The line through the origin that fits log(correlation) where the correlation is at least .1.
fn fit(correlation: &[(f64, f64)]) -> (f64, f64) {
    let logs: Vec<_> = correlation.iter().take_while(|(_, c)| *c > 0.1).map(|(angle, c)| (*angle, c.ln())).collect();
    let slope = logs.iter().map(|(x, y)| x * y).sum::<f64>() / logs.iter().map(|(x, _)| x * x).sum::<f64>();
    let mean = logs.iter().map(|(_, y)| y).sum::<f64>() / logs.len() as f64;
    let left: f64 = logs.iter().map(|(x, y)| (y - slope * x).powi(2)).sum();
    let whole: f64 = logs.iter().map(|(_, y)| (y - mean).powi(2)).sum();
    (-1.0 / slope, 1.0 - left / whole)
}
