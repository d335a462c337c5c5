//! What the estimators share: the points, the BRDF, the look-up of the light and the rays. The renderer's side of each
//! computes eight samples side by side.

use crate::batch::{Batch, Stream};
use crate::client::{self, Environment, Preparation};
use crate::cost::Cost;
use crate::dense::{Dense, Grid};
use crate::earlier;
use crate::environment;
use crate::lanes::F8;
use crate::library::Library;
use crate::light::Light;
use crate::lightonly::Sources;
use crate::material::{Bsdf, Material};
use crate::method::{Limit, Method};
use crate::pool::Curve;
use crate::scene::ShadingPoint;
use crate::structured::Stratified;
use crate::texels::Texels;
use glam::Vec3;

/// A light as the estimators need it.
pub struct Lit<'a> {
    pub light: &'a Light,
    /// The light of version 0.1.
    pub environment: &'a Environment,
    /// The light in small tables.
    pub tables: environment::Environment,
    /// As version 0.2 builds it, if that is there.
    pub earlier: Option<earlier::Environment>,
    pub sources: Option<Sources>,
    pub plain: Texels,
    pub compensated: Texels,
    pub strata: Stratified,
    pub grid: Grid,
}

impl<'a> Lit<'a> {
    /// # Errors
    /// Those of the library.
    pub fn new(light: &'a Light, environment: &'a Environment) -> client::Result<Lit<'a>> {
        let (plain, compensated) = (Texels::plain(light), Texels::compensated(light));
        let strata = Stratified::new(light)?;
        let (tables, earlier) = (light.tables(0, 0.0)?, light.mapped(0, 0.0, earlier::Environment::new)?);
        let (grid, sources) = (Grid::new(light), None);
        Ok(Lit { light, environment, tables, earlier, sources, plain, compensated, strata, grid })
    }

    /// With what is needed to sample the light alone in other ways.
    ///
    /// # Errors
    /// Those of the library.
    pub fn with_sources(self) -> client::Result<Lit<'a>> {
        Ok(Lit { sources: Some(Sources::new(self.light)?), ..self })
    }
}

/// What the estimators of a report cell share.
#[derive(Clone, Copy)]
pub struct Setting<'a> {
    pub light: &'a Light,
    pub environment: &'a Environment,
    pub tables: &'a environment::Environment,
    pub earlier: Option<&'a earlier::Environment>,
    pub sources: Option<&'a Sources>,
    pub material: &'a Material,
    pub plain: &'a Texels,
    pub compensated: &'a Texels,
    pub strata: &'a Stratified,
    grid: &'a Grid,
    pub preparation: Preparation,
    /// Candidates for each ray of wis_direct; 0: the library's choice.
    pub candidates: usize,
    /// What the client spends besides.
    pub cost: Cost,
}

impl<'a> Setting<'a> {
    pub fn new(lit: &'a Lit<'a>, material: &'a Material) -> Setting<'a> {
        let &Lit { light, environment, ref tables, ref plain, ref compensated, ref strata, ref grid, .. } = lit;
        let (earlier, sources) = (lit.earlier.as_ref(), lit.sources.as_ref());
        let preparation = Preparation { world_from_map: Some(light.world_from_map()), ..Default::default() };
        let (candidates, cost) = (0, Cost::CHEAP);
        Setting {
            light,
            environment,
            tables,
            earlier,
            sources,
            material,
            plain,
            compensated,
            strata,
            grid,
            preparation,
            candidates,
            cost,
        }
    }

    /// The same at another cost.
    pub fn at(&self, cost: Cost) -> Setting<'a> {
        Setting { cost, ..*self }
    }
}

/// A direction to trace and what it adds to the estimate if it is not blocked.
#[derive(Clone, Copy, Debug)]
pub struct Pick {
    pub wi: Vec3,
    pub contribution: f32,
}

/// The memory of a thread that estimates.
pub struct Estimator {
    library: Library,
    /// The limit's product, and for which pixel and hit it is.
    dense: Dense,
    dense_for: Option<([u32; 2], u32)>,
    sampler: Sampler,
}

/// Samples on their way to picks.
#[derive(Default)]
pub struct Sampler {
    pub batch: Batch,
    pub picks: Vec<Pick>,
    curve: Curve,
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
            Method::Peer(peer) => sampler.peer(peer, setting, &bsdf, n)?,
            Method::Library(mode) => library.estimate(mode, sampler, (setting, point, &bsdf), pass, n)?,
            Method::Light(light) => sampler.light_only(light, library.sampler(), (setting, &bsdf), n)?,
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
    /// Evaluates BRDF, its pdf and radiance for all samples: all that a method needs that has a pdf of its own.
    pub fn reflect(&mut self, setting: &Setting, bsdf: &Bsdf) {
        self.batch.reflect(bsdf, setting.light, setting.plain, setting.cost);
    }

    /// The same and the pdf of the plain light.
    pub fn evaluate(&mut self, setting: &Setting, bsdf: &Bsdf) {
        self.batch.evaluate(bsdf, setting.light, setting.plain, setting.cost);
    }

    fn limit(&mut self, limit: Limit, dense: &Dense, setting: &Setting, bsdf: &Bsdf, n: usize) {
        const CANDIDATES: usize = 4;
        let drawn = if limit == Limit::Pooled { n * CANDIDATES } else { n };
        self.batch.from_dense((dense, setting.grid), drawn);
        self.reflect(setting, bsdf);
        self.batch.weigh_by_drawn(|pdf, _| pdf * F8::splat(drawn as f32));
        match limit {
            Limit::Sampled => self.take_all(),
            Limit::Pooled => self.pick_along_curve(n),
        }
    }

    /// Picks every sample that adds something.
    pub fn take_all(&mut self) {
        let Sampler { batch, picks, .. } = self;
        picks.resize(batch.len(), Pick { wi: Vec3::ZERO, contribution: 0.0 });
        // Every sample is written and the place only moves on for those to keep: nothing to predict.
        let mut kept = 0;
        for i in 0..batch.len() {
            picks[kept] = Pick { wi: batch.wi().get(i), contribution: batch.reflected(i) };
            kept += usize::from(batch.reflected(i) > 0.0);
        }
        picks.truncate(kept);
    }

    /// Picks `n` of the weighed samples, spread along the Morton curve.
    pub fn pick_along_curve(&mut self, n: usize) {
        let offset = self.batch.points(Stream::Choice, 1)[0][0];
        self.curve.pick(&self.batch, n, offset, &mut self.picks);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measured::Reflectance;
    use crate::peers::{Candidates, Peer};
    use glam::DVec3;
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
        let environment = light.environment().unwrap();
        let lit = Lit::new(&light, &environment).unwrap();
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
