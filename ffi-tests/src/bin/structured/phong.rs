//! The material of the paper's buddha: a normalized Phong lobe.

use glam::DVec3;
use std::f64::consts::TAU;
use wis_ffi_tests::lanes::{F8, V8};
use wis_ffi_tests::reflectance::{Reflectance, View};

/// (n + 2) / (2 pi) x cosine^n of the angle to the reflected direction.
#[derive(Debug)]
pub struct Phong {
    pub exponent: i32,
}

fn reflected(wo: DVec3) -> DVec3 {
    DVec3::new(-wo.x, -wo.y, wo.z)
}

impl Reflectance for Phong {
    fn name(&self) -> &str {
        "Phong"
    }

    fn roughness(&self) -> f64 {
        (2.0 / f64::from(self.exponent + 2)).sqrt()
    }

    fn sample(&self, wo: DVec3, u: [f64; 2]) -> DVec3 {
        let cosine = u[0].powf(1.0 / f64::from(self.exponent + 1));
        let (sin, cos) = (TAU * u[1]).sin_cos();
        let (a, b) = reflected(wo).any_orthonormal_pair();
        let across = (1.0 - cosine * cosine).max(0.0).sqrt();
        a * (across * cos) + b * (across * sin) + reflected(wo) * cosine
    }

    fn eval_lanes(&self, view: &View, wi: V8, _: usize) -> (F8, F8) {
        let lobe = power(V8::splat(reflected(view.wo).as_vec3()).dot(wi).fast_max(F8::ZERO), self.exponent as u32);
        let [value, density] = [self.exponent + 2, self.exponent + 1].map(|n| F8::splat((f64::from(n) / TAU) as f32));
        (value * lobe * wi.z.fast_max(F8::ZERO), density * lobe)
    }
}

/// By squares and products.
fn power(base: F8, exponent: u32) -> F8 {
    let (mut result, mut square) = (F8::ONE, base);
    for bit in 0..u32::BITS - exponent.leading_zeros() {
        result = if exponent >> bit & 1 == 1 { result * square } else { result };
        square *= square;
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of eval / pdf over samples is the albedo, as by a sum over the hemisphere.
    #[test]
    fn samples_have_their_pdf() {
        let (phong, wo, side) = (Phong { exponent: 50 }, DVec3::new(0.6, 0.0, 0.8), 256);
        let cell = |i: usize| [(i % side) as f64 + 0.5, (i / side) as f64 + 0.5].map(|c| c / side as f64);
        let mean =
            |of: &dyn Fn([f64; 2]) -> f64| (0..side * side).map(|i| of(cell(i))).sum::<f64>() / (side * side) as f64;
        let sampled = mean(&|u| {
            let wi = phong.sample(wo, u);
            if wi.z > 0.0 { phong.eval(wo, wi) / phong.pdf(wo, wi) } else { 0.0 }
        });
        let summed = mean(&|u| {
            let (sin, cos) = (TAU * u[1]).sin_cos();
            let across = (1.0 - u[0] * u[0]).sqrt();
            TAU * phong.eval(wo, DVec3::new(across * cos, across * sin, u[0]))
        });
        assert!((sampled / summed - 1.0).abs() < 1e-3, "{sampled} {summed}");
    }

    #[test]
    fn lobes_are_those_of_the_paper() {
        let (phong, wo) = (Phong { exponent: 50 }, DVec3::new(0.6, 0.0, 0.8));
        for wi in [DVec3::new(-0.6, 0.0, 0.8), DVec3::new(-0.5, 0.2, 0.84).normalize(), DVec3::Z, DVec3::NEG_Z] {
            let lobe = reflected(wo).dot(wi).max(0.0).powi(50) / TAU;
            for (found, exact) in [(phong.eval(wo, wi), 52.0 * lobe * wi.z.max(0.0)), (phong.pdf(wo, wi), 51.0 * lobe)]
            {
                assert!((found - exact).abs() <= 1e-4 * exact, "{wi}: {found} {exact}");
            }
        }
    }
}
