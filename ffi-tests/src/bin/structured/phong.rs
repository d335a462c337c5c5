//! The material of the paper's buddha: a normalized Phong lobe.

use glam::DVec3;
use std::f64::consts::TAU;
use wis_ffi_tests::reflectance::Reflectance;

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

    fn eval(&self, wo: DVec3, wi: DVec3) -> f64 {
        let cosine = reflected(wo).dot(wi).max(0.0);
        f64::from(self.exponent + 2) / TAU * cosine.powi(self.exponent) * wi.z.max(0.0)
    }

    fn sample(&self, wo: DVec3, u: [f64; 2]) -> DVec3 {
        let cosine = u[0].powf(1.0 / f64::from(self.exponent + 1));
        let (sin, cos) = (TAU * u[1]).sin_cos();
        let (a, b) = reflected(wo).any_orthonormal_pair();
        let across = (1.0 - cosine * cosine).max(0.0).sqrt();
        a * (across * cos) + b * (across * sin) + reflected(wo) * cosine
    }

    fn pdf(&self, wo: DVec3, wi: DVec3) -> f64 {
        f64::from(self.exponent + 1) / TAU * reflected(wo).dot(wi).max(0.0).powi(self.exponent)
    }
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
}
