//! Lobes that stand in for a measured BRDF in the choice of rays: how a renderer would fit them once, when it reads the file.
//!
//! A ray that is chosen by the lobes' g has the weight f / g. So the weights of some lobes of fixed shapes make the integral of f^2 / g small,
//! by multiplicative steps on directions that are drawn from the BRDF.

use crate::reflectance::Reflectance;
use glam::{DVec3, dvec3};
use std::f64::consts::{FRAC_1_PI, PI, TAU};

/// A diffuse lobe, or one of microfacets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StandIn {
    /// The roughness of GGX; none: a Lambertian lobe.
    pub alpha: Option<f64>,
    /// What it is multiplied by.
    pub weight: f64,
}

/// Elevations of the viewer, in degrees.
const VIEWS: [f64; 6] = [10.0, 35.0, 55.0, 70.0, 80.0, 86.0];
/// Directions for each view.
const DIRECTIONS: u32 = 2048;
/// Roughness over that of the BRDF's peak.
const WIDTHS: [f64; 7] = [0.5, 0.7, 1.0, 1.5, 2.5, 4.0, 7.0];
/// The largest roughness.
const WIDEST: f64 = 0.8;
/// Lobes of microfacets that are kept.
const KEPT: usize = 2;
/// Lobes of microfacets that scatter less than this share are left out. The diffuse one scatters at least as much: it bounds the weights of
/// directions that the others miss.
const LEAST: f64 = 0.01;
/// Steps of the fit.
const STEPS: usize = 60;

/// A diffuse lobe and up to two of microfacets for a BRDF; microfacets reflect `f0` at normal incidence.
pub fn fit(brdf: &dyn Reflectance, f0: f64) -> Vec<StandIn> {
    let peak = brdf.roughness();
    let widths = WIDTHS.iter().map(|factor| factor * peak).filter(|&alpha| alpha < WIDEST);
    let mut lobes: Vec<StandIn> =
        [None].into_iter().chain(widths.map(Some)).map(|alpha| StandIn { alpha, weight: 0.1 }).collect();
    let drawn = draw(brdf);
    let mut scattered = refine(&mut lobes, &drawn, f0);
    // Those that scatter most.
    let mut order: Vec<usize> = (1..lobes.len()).collect();
    order.sort_by(|&a, &b| scattered[b].total_cmp(&scattered[a]));
    order.truncate(KEPT);
    lobes = std::iter::once(0).chain(order).map(|i| lobes[i]).collect();
    scattered = refine(&mut lobes, &drawn, f0);
    let all: f64 = scattered.iter().sum();
    lobes[0].weight = lobes[0].weight.max(LEAST * all / VIEWS.len() as f64);
    let kept = lobes.iter().zip(scattered).filter(|(lobe, own)| lobe.alpha.is_none() || *own > LEAST * all);
    kept.map(|(lobe, _)| *lobe).collect()
}

/// A direction that was drawn from the BRDF.
struct Drawn {
    wo: DVec3,
    wi: DVec3,
    /// BRDF x cosine.
    value: f64,
    /// The same over the density.
    weight: f64,
}

fn draw(brdf: &dyn Reflectance) -> Vec<Drawn> {
    let each = VIEWS.iter().flat_map(|view| {
        let (sine, cosine) = view.to_radians().sin_cos();
        (0..DIRECTIONS).map(move |i| (dvec3(sine, 0.0, cosine), numbers(i)))
    });
    let weighed = each.filter_map(|(wo, u)| {
        let wi = brdf.sample(wo, u);
        let (value, pdf) = (brdf.eval(wo, wi), brdf.pdf(wo, wi));
        (wi.z > 0.0 && value > 0.0 && pdf > 0.0).then(|| Drawn {
            wo,
            wi,
            value,
            weight: value / pdf / f64::from(DIRECTIONS),
        })
    });
    weighed.collect()
}

/// Improves the weights of lobes, and answers what each scatters, summed over views.
fn refine(lobes: &mut [StandIn], drawn: &[Drawn], f0: f64) -> Vec<f64> {
    let scatters: Vec<f64> =
        lobes.iter().map(|lobe| VIEWS.iter().map(|view| albedo(lobe, view.to_radians(), f0)).sum()).collect();
    let values: Vec<Vec<f64>> =
        drawn.iter().map(|at| lobes.iter().map(|lobe| value(lobe, at.wo, at.wi, f0)).collect()).collect();
    for _ in 0..STEPS {
        let mut better = vec![0.0; lobes.len()];
        for (at, values) in drawn.iter().zip(&values) {
            let all: f64 = lobes.iter().zip(values).map(|(lobe, value)| lobe.weight * value).sum();
            for (better, value) in better.iter_mut().zip(values) {
                *better += at.weight * at.value * value / (all * all).max(f64::MIN_POSITIVE);
            }
        }
        for ((lobe, better), scatters) in lobes.iter_mut().zip(better).zip(&scatters) {
            lobe.weight *= (better / scatters).sqrt();
        }
    }
    lobes.iter().zip(scatters).map(|(lobe, scatters)| lobe.weight * scatters).collect()
}

/// What a lobe of weight 1 scatters.
fn albedo(lobe: &StandIn, view: f64, f0: f64) -> f64 {
    let Some(alpha) = lobe.alpha else { return 1.0 };
    let wo = dvec3(view.sin(), 0.0, view.cos());
    let each = (0..DIRECTIONS).map(numbers).map(|[u, v]| {
        // Half vectors by the distribution of normals times their cosine.
        let tangent = alpha * (u / (1.0 - u)).sqrt();
        let (cosine, phi) = (1.0 / (1.0 + tangent * tangent).sqrt(), TAU * v);
        let half = dvec3(tangent * cosine * phi.cos(), tangent * cosine * phi.sin(), cosine);
        let wi = half * (2.0 * half.dot(wo)) - wo;
        let pdf = distribution(alpha, cosine) * cosine / (4.0 * half.dot(wo).abs());
        value(lobe, wo, wi, f0) / pdf
    });
    each.sum::<f64>() / f64::from(DIRECTIONS)
}

/// BRDF x cosine of a lobe of weight 1.
fn value(lobe: &StandIn, wo: DVec3, wi: DVec3, f0: f64) -> f64 {
    if !(wi.z > 0.0 && wo.z > 0.0) {
        return 0.0;
    }
    let Some(alpha) = lobe.alpha else { return wi.z * FRAC_1_PI };
    let half = (wo + wi).normalize();
    let length = |w: DVec3| dvec3(alpha * w.x, alpha * w.y, w.z).length();
    let smith = 0.5 / (wi.z * length(wo) + wo.z * length(wi));
    let fresnel = f0 + (1.0 - f0) * (1.0 - half.dot(wi)).powi(5);
    distribution(alpha, half.z) * smith * fresnel * wi.z
}

/// GGX.
fn distribution(alpha: f64, cosine: f64) -> f64 {
    let (a2, c2) = (alpha * alpha, cosine * cosine);
    let denominator = c2 * (a2 - 1.0) + 1.0;
    a2 / (PI * denominator * denominator)
}

/// A point of Hammersley's.
fn numbers(i: u32) -> [f64; 2] {
    [(f64::from(i) + 0.5) / f64::from(DIRECTIONS), (f64::from(i.reverse_bits()) + 0.5) / 4_294_967_296.0]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A BRDF that is made of lobes, drawn by cosines.
    #[derive(Debug)]
    struct Lobes([StandIn; 3]);

    impl Reflectance for Lobes {
        fn name(&self) -> &str {
            "lobes"
        }

        fn roughness(&self) -> f64 {
            0.2
        }

        fn eval(&self, wo: DVec3, wi: DVec3) -> f64 {
            self.0.iter().map(|lobe| lobe.weight * value(lobe, wo, wi, 0.9)).sum()
        }

        fn sample(&self, _: DVec3, [u, v]: [f64; 2]) -> DVec3 {
            let (radius, phi) = (u.sqrt(), TAU * v);
            dvec3(radius * phi.cos(), radius * phi.sin(), (1.0 - u).sqrt())
        }

        fn pdf(&self, _: DVec3, wi: DVec3) -> f64 {
            wi.z.max(0.0) * FRAC_1_PI
        }
    }

    #[test]
    fn a_sum_of_lobes_is_fitted() {
        let lobe = |alpha, weight| StandIn { alpha, weight };
        let brdf = Lobes([lobe(None, 0.4), lobe(Some(0.2), 0.3), lobe(Some(0.5), 0.2)]);
        let found = fit(&brdf, 0.9);
        let (mut all, mut wrong) = (0.0, 0.0);
        for at in draw(&brdf) {
            let fitted: f64 = found.iter().map(|lobe| lobe.weight * value(lobe, at.wo, at.wi, 0.9)).sum();
            all += at.weight;
            wrong += at.weight * (fitted / at.value - 1.0).abs();
        }
        assert!(wrong < 0.15 * all, "{} with {found:?}", wrong / all);
    }

    #[test]
    fn a_diffuse_lobe_always_remains() {
        let lobe = |weight| StandIn { alpha: Some(0.2), weight };
        let found = fit(&Lobes([lobe(1.0), lobe(0.0), lobe(0.0)]), 0.9);
        let diffuse = found.iter().find(|lobe| lobe.alpha.is_none()).unwrap();
        assert!(diffuse.weight > 0.005 && diffuse.weight < 0.05, "{found:?}");
        assert!(found.iter().any(|lobe| lobe.alpha == Some(0.2) && (lobe.weight - 1.0).abs() < 0.05), "{found:?}");
    }
}
