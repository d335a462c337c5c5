//! Phong's lobe about the mirror direction.

use super::vector::{any_tangent, cross};
use crate::numeric::{max, min, sqrt};
use crate::simd::{Apart, Num};
use crate::sphere::sin_cos_quarters;
use core::f32::consts::PI;

/// A lobe seen from a direction, in the frame of the surface.
#[derive(Clone, Copy, Debug)]
pub struct Phong {
    exponent: f32,
    /// The mirror direction, and two directions normal to it.
    axes: [[f32; 3]; 3],
}

impl Phong {
    /// The lobe seen from `wo`. A function of its own: else its axes are made for points without such a lobe.
    #[inline(never)]
    pub fn new(exponent: f32, wo: [f32; 3]) -> Phong {
        let [x, y, z] = wo;
        Phong::about(exponent, [-x, -y, z])
    }

    /// The lobe that directions are drawn from: seen from below, one about the horizon, since the flank of its own is all that counts.
    pub fn drawn(exponent: f32, wo: [f32; 3]) -> Phong {
        let [x, y, z] = wo;
        let level = sqrt(x * x + y * y);
        if z > 0.0 || !(level > 0.0) {
            Phong::new(exponent, wo)
        } else {
            Phong::about(exponent, [-x / level, -y / level, 0.0])
        }
    }

    fn about(exponent: f32, mirror: [f32; 3]) -> Phong {
        let across = any_tangent(mirror);
        Phong { exponent, axes: [across, cross(mirror, across), mirror] }
    }

    /// The cosine to the mirror direction, raised to the exponent.
    #[inline(always)]
    pub fn power<F: Num>(&self, wi: [F; 3]) -> F {
        let [_, _, mirror] = self.axes;
        self.power_about(mirror, wi)
    }

    /// As [`Phong::power`], about another direction.
    #[inline(always)]
    pub fn power_about<F: Num>(&self, [x, y, z]: [f32; 3], wi: [F; 3]) -> F {
        let cosine = F::splat(x) * wi[0] + F::splat(y) * wi[1] + F::splat(z) * wi[2];
        F::apart(Power { of: cosine, exponent: self.exponent, least: 0.0 })
    }

    /// The BRDF, without its weight, for a power.
    pub fn norm(&self) -> f32 {
        (self.exponent + 2.0) / (2.0 * PI)
    }

    /// The density of a sample, for a power.
    pub fn pdf_norm(&self) -> f32 {
        (self.exponent + 1.0) / (2.0 * PI)
    }

    /// A direction in proportion to the power.
    #[inline(always)]
    pub fn sample<F: Num>(&self, u: [F; 2]) -> [F; 3] {
        let of = F::splat(1.0) - u[1];
        let cosine = F::apart(Power { of, exponent: 1.0 / (self.exponent + 1.0), least: f32::MIN_POSITIVE });
        let sine = (F::splat(1.0) - cosine * cosine).max(F::splat(0.0)).sqrt();
        let (sin, cos) = sin_cos_quarters(u[0] * 4.0);
        let (x, y) = (sine * cos, sine * sin);
        let [a, b, c] = self.axes;
        [
            F::splat(a[0]) * x + F::splat(b[0]) * y + F::splat(c[0]) * cosine,
            F::splat(a[1]) * x + F::splat(b[1]) * y + F::splat(c[1]) * cosine,
            F::splat(a[2]) * x + F::splat(b[2]) * y + F::splat(c[2]) * cosine,
        ]
    }
}

/// Numbers, at least the least and at most 1, raised to an exponent; 0 for those that are not above 0. A function of its own: few points
/// have such a lobe.
struct Power<F> {
    of: F,
    exponent: f32,
    least: f32,
}

impl<F: Num> Apart<F> for Power<F> {
    type Output = F;

    #[inline(always)]
    fn run(self) -> F {
        let of = self.of.store();
        F::each(|lane| {
            let x = max(of.as_ref().get(lane).copied().unwrap_or(0.0), self.least);
            if x > 0.0 { libm::powf(min(x, 1.0), self.exponent) } else { 0.0 }
        })
    }
}
