//! A thread's estimator: one of the methods at a point.

use crate::client;
use crate::dense::Dense;
use crate::lanes::F8;
use crate::library::Library;
use crate::material::Bsdf;
use crate::method::{Limit, Method};
use crate::pool::Pick;
use crate::scene::ShadingPoint;
use crate::setting::{Sampler, Setting};

/// The memory of a thread that estimates.
pub struct Estimator {
    library: Library,
    /// The limit's product, and for which pixel and hit it is.
    dense: Dense,
    dense_for: Option<([u32; 2], u32)>,
    sampler: Sampler,
}

impl Estimator {
    /// # Errors
    /// Those of the library.
    pub fn new(setting: &Setting, hits: usize) -> client::Result<Estimator> {
        let (library, sampler) = (Library::new(setting, hits)?, Sampler::default());
        Ok(Estimator { library, dense: Dense::default(), dense_for: None, sampler })
    }

    /// The samples of a point in a pass; their contributions add up to the estimate.
    ///
    /// # Errors
    /// Those of the library.
    pub fn picks(
        &mut self,
        method: impl Into<Method>,
        setting: &Setting,
        point: &ShadingPoint,
        pass: u32,
        n: usize,
    ) -> client::Result<&[Pick]> {
        let Estimator { library, dense, dense_for, sampler } = self;
        let bsdf = Bsdf::new(setting.material, point);
        sampler.picks.clear();
        sampler.batch.begin(point.pixel, pass, point.hit);
        match method.into() {
            Method::Peer(peer) => sampler.peer(peer, setting, point, &bsdf, n)?,
            Method::Library(mode) => library.estimate(mode, sampler, (setting, point, &bsdf), pass, n)?,
            Method::Limit(limit) => {
                if *dense_for != Some((point.pixel, point.hit)) {
                    dense.prepare(setting.grid, &bsdf);
                    *dense_for = Some((point.pixel, point.hit));
                }
                sampler.limit(limit, dense, setting, &bsdf, n);
            }
        }
        Ok(&sampler.picks)
    }
}

impl Sampler {
    fn limit(&mut self, limit: Limit, dense: &Dense, setting: &Setting, bsdf: &Bsdf, n: usize) {
        const CANDIDATES: usize = 4;
        let drawn = if limit == Limit::Pooled { n * CANDIDATES } else { n };
        self.batch.from_dense((dense, setting.grid), drawn);
        self.reflect(setting, bsdf);
        self.batch.weigh_by_drawn(|_, pdf, _| pdf * F8::splat(drawn as f32));
        match limit {
            Limit::Sampled => self.take_all(),
            Limit::Pooled => self.pick_along_curve(n),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Light;
    use crate::material::Material;
    use crate::peers::{Candidates, Peer};
    use crate::reflectance::Reflectance;
    use crate::setting::Lit;
    use glam::{DVec3, Vec3};
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// A diffuse surface that counts how often it is asked.
    #[derive(Debug, Default)]
    struct Counting {
        evaluated: AtomicUsize,
        sampled: AtomicUsize,
    }

    impl Reflectance for Counting {
        fn name(&self) -> &str {
            "counting"
        }

        fn roughness(&self) -> f64 {
            1.0
        }

        fn eval(&self, _: DVec3, wi: DVec3) -> f64 {
            self.evaluated.fetch_add(1, Ordering::Relaxed);
            wi.z.max(0.0)
        }

        fn sample(&self, _: DVec3, u: [f64; 2]) -> DVec3 {
            self.sampled.fetch_add(1, Ordering::Relaxed);
            DVec3::new((1.0 - u[0] * u[0]).sqrt(), 0.0, u[0])
        }

        fn pdf(&self, _: DVec3, wi: DVec3) -> f64 {
            wi.z.max(0.0)
        }
    }

    /// A measured material is evaluated once for each sample or candidate: lanes that are not in use cost nothing.
    #[test]
    fn only_lanes_in_use_are_evaluated() {
        let counting: &'static Counting = Box::leak(Box::default());
        let material = Material::called_back(counting);
        let light = Light::windows(32);
        let lit = Lit::new(&light).unwrap();
        let setting = Setting::new(&lit, &material);
        let mut estimator = Estimator::new(&setting, 1).unwrap();
        let (normal, wo) = (Vec3::Z, Vec3::new(0.6, 0.0, 0.8));
        let point = ShadingPoint { pixel: [5, 9], hit: 0, origin: Vec3::ZERO, normal, wo };
        for n in [1, 3, 8, 11] {
            for (peer, evaluated) in [
                (Peer::Environment, n),
                (Peer::Brdf, n),
                // At least one of each technique.
                (Peer::MisBalance, n.max(2)),
                (Peer::MisCompensated, n.max(2)),
                (Peer::Ris(8, Candidates::Compensated), 8 * n),
                (Peer::Pool(4, Candidates::Plain), 4 * n),
            ] {
                counting.evaluated.store(0, Ordering::Relaxed);
                counting.sampled.store(0, Ordering::Relaxed);
                estimator.picks(peer, &setting, &point, 0, n).unwrap();
                assert_eq!(counting.evaluated.load(Ordering::Relaxed), evaluated, "{} of {n}", peer.name());
                assert!(counting.sampled.load(Ordering::Relaxed) <= evaluated, "{} of {n}", peer.name());
            }
        }
    }
}
