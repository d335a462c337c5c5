//! Paths under a map whose light they gather by MIS or by wis: the same BSDF, look-up, random points and number of rays.

use crate::light::{Map, Samples};
use crate::material::{Bsdf, Material};
use crate::scene::{MATERIALS, Scene};
use glam::Vec3;
use wis::points::{dimension_seed, sobol};
use wis::{Environment, Ray, Sampler, Sequence};

/// The most rays for light at a hit.
pub const MAX_RAYS: usize = 16;

/// How light is gathered.
#[derive(Clone, Copy, PartialEq)]
pub enum Method {
    /// Samples of the map and of the BSDF, combined by the balance heuristic.
    Mis,
    /// The rays that wis chooses bring what exceeds the mean of the map, BSDF rays that escape bring the rest.
    Wis,
}

/// What paths run through.
pub struct World<'a> {
    pub scene: &'a Scene,
    pub map: &'a Map,
    pub samples: &'a Samples,
    pub environment: Environment<'a>,
    pub materials: &'a [Material; MATERIALS],
    pub rays: usize,
    /// Hits of a path at the most.
    pub depth: u32,
}

impl World<'_> {
    /// The share of the light that BSDF rays bring.
    fn base(&self, light: Vec3) -> f32 {
        self.environment.base(light.to_array())
    }

    /// The light that reaches a hit by the rays of one method.
    fn gather(&self, method: Method, bsdf: &Bsdf<'_>, position: Vec3, at: Sequence, sampler: &mut Sampler<'_>) -> Vec3 {
        let unblocked = |f: Vec3, wi: Vec3| f != Vec3::ZERO && !self.scene.blocks(position, wi);
        let mut sum = Vec3::ZERO;
        if method == Method::Wis {
            let mut rays = [Ray::default(); MAX_RAYS];
            let point = wis::Point { compensated: true, ..bsdf.point() };
            let count = sampler.direct(&self.environment, &point, at, self.rays, &mut rays).unwrap_or(0);
            for ray in rays.iter().take(count) {
                let wi = Vec3::from_array(ray.wi);
                let (f, _) = bsdf.eval(wi);
                if unblocked(f, wi) {
                    let light = self.map.radiance(wi);
                    sum += f * light * ((1.0 - self.base(light)) * ray.weight);
                }
            }
            return sum;
        }
        let seed = dimension_seed(at.seed, 2 + 2 * at.bounce);
        for i in 0..self.rays as u32 {
            let (wi, light) = self.samples.sample(self.map, sobol(seed, at.sample * self.rays as u32 + i));
            let (f, pdf) = bsdf.eval(wi);
            if unblocked(f, wi) {
                sum += f * light / (self.rays as f32 * self.samples.pdf(light) + pdf);
            }
        }
        sum
    }

    /// The radiance along a camera ray.
    pub fn path(
        &self,
        method: Method,
        mut o: Vec3,
        mut d: Vec3,
        seed: u32,
        sample: u32,
        sampler: &mut Sampler<'_>,
    ) -> Vec3 {
        let (mut color, mut beta, mut pdf) = (Vec3::ZERO, Vec3::ONE, 0.0);
        for bounce in 0.. {
            let Some(hit) = self.scene.trace(o, d) else {
                if bounce == 0 {
                    return self.map.smooth(d);
                }
                let light = self.map.radiance(d);
                let share = match method {
                    Method::Mis => pdf / (pdf + self.rays as f32 * self.samples.pdf(light)),
                    Method::Wis => self.base(light),
                };
                return color + beta * light * share;
            };
            if bounce == self.depth {
                break;
            }
            let material = self.materials[hit.material].at(hit.position);
            let bsdf = Bsdf::new(&material, hit.normal, -d);
            let at = Sequence { seed, sample, bounce };
            color += beta * self.gather(method, &bsdf, hit.position, at, sampler);
            d = bsdf.sample(sobol(dimension_seed(seed, 1 + 2 * bounce), sample));
            let (f, density) = bsdf.eval(d);
            if f == Vec3::ZERO {
                break;
            }
            (o, beta, pdf) = (hit.position, beta * f / density, density);
        }
        color
    }
}
