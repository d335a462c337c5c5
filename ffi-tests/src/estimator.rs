//! The estimators under comparison. All share the points, the BRDF, the look-up of the light and the rays, and the
//! renderer's side of each computes eight samples side by side.

use crate::batch::{Batch, Stream};
use crate::client::{self, Block, Density, Environment, Preparation, Product, raw};
use crate::dense::{Dense, Grid};
use crate::lanes::F8;
use crate::light::Light;
use crate::material::{Bsdf, Material};
use crate::pool::Candidates;
use crate::scene::ShadingPoint;
use crate::structured::Stratified;
use crate::texels::Texels;
use glam::Vec3;

/// How to estimate the light that a point reflects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Proportional to the light.
    Environment,
    /// Proportional to the BRDF x cosine.
    Brdf,
    /// Both, by the balance heuristic.
    MisBalance,
    /// Both, by the power heuristic.
    MisPower,
    /// Compensated light and BRDF, by the balance heuristic (Karlik et al. 2019).
    MisCompensated,
    /// Each sample resampled from so many candidates.
    Ris(usize),
    /// All samples resampled from a pool of so many candidates for each.
    Pool(usize),
    /// One sample by the light in each stratum of the map (Agarwal et al. 2003).
    Structured,
    /// What the library's header says is to be used: see `by_rule`.
    WisRule,
    /// The library's product alone.
    Wis,
    /// The library's product and the BRDF, by the balance heuristic.
    WisMis,
    /// The library's integral times the share of its samples that is visible; biased (Clarberg et al. 2005, Eq. 11).
    WisBiased,
    /// The library's integral times shadowed by unshadowed estimate; biased.
    WisRatio,
    /// The library's product, prepared at the first hit of a pixel and used for the others that it covers, with more of
    /// them for those that it does not.
    WisReuse,
    /// `WisReuse` with the visibility prior of the pixel's tile.
    WisReusePrior,
    /// The library's product with the visibility prior of the pixel's tile.
    WisPrior,
    /// `WisPool` with that prior.
    WisPoolPrior(usize),
    /// The library's pool: so many candidates a pick, half of compensated light and half of the BRDF, of mirrors a quarter and
    /// the rest. One a pick: all of them, by the balance heuristic.
    WisPool(usize),
    /// The library's pool with candidates of the product instead of the light.
    WisTreePool(usize),
    /// The product from all cells of a fine grid.
    Limit,
    /// Picks from a pool of samples of `Limit`.
    LimitPooled,
}

impl Method {
    /// Every peer, then the library.
    pub const ALL: [Method; 23] = [
        Method::Environment,
        Method::Brdf,
        Method::MisBalance,
        Method::MisPower,
        Method::MisCompensated,
        Method::Ris(8),
        Method::Ris(32),
        Method::Pool(4),
        Method::Pool(8),
        Method::Structured,
        Method::WisRule,
        Method::Wis,
        Method::WisMis,
        Method::WisBiased,
        Method::WisRatio,
        Method::WisReuse,
        Method::WisReusePrior,
        Method::WisPrior,
        Method::WisPool(4),
        Method::WisPoolPrior(4),
        Method::WisTreePool(4),
        Method::Limit,
        Method::LimitPooled,
    ];

    pub fn name(self) -> String {
        match self {
            Method::Environment => "environment".into(),
            Method::Brdf => "BRDF".into(),
            Method::MisBalance => "MIS balance".into(),
            Method::MisPower => "MIS power".into(),
            Method::MisCompensated => "MIS compensated".into(),
            Method::Ris(m) => format!("RIS{m}"),
            Method::Pool(k) => format!("P({k})"),
            Method::Structured => "structured".into(),
            Method::WisRule => "wis by rule".into(),
            Method::Wis => "wis".into(),
            Method::WisMis => "wis + MIS".into(),
            Method::WisBiased => "wis biased".into(),
            Method::WisRatio => "wis ratio".into(),
            Method::WisReuse => "wis reuse".into(),
            Method::WisReusePrior => "wis reuse + prior".into(),
            Method::WisPrior => "wis + prior".into(),
            Method::WisPool(_) => "wis pool".into(),
            Method::WisPoolPrior(_) => "wis pool + prior".into(),
            Method::WisTreePool(_) => "wis tree pool".into(),
            Method::Limit => "limit".into(),
            Method::LimitPooled => "limit, pooled".into(),
        }
    }

    /// Whether it is another's method.
    pub fn is_peer(self) -> bool {
        !self.is_ours() && !self.is_limit()
    }

    /// Whether it is a mode of the library.
    pub fn is_ours(self) -> bool {
        matches!(
            self,
            Method::WisRule
                | Method::Wis
                | Method::WisMis
                | Method::WisBiased
                | Method::WisRatio
                | Method::WisReuse
                | Method::WisReusePrior
                | Method::WisPrior
                | Method::WisPool(_)
                | Method::WisPoolPrior(_)
                | Method::WisTreePool(_)
        )
    }

    /// Whether it reads a visibility prior.
    pub fn takes_prior(self) -> bool {
        matches!(self, Method::WisReusePrior | Method::WisPrior | Method::WisPoolPrior(_))
    }

    /// Whether it shares a product among the hits of a pixel.
    pub fn shares(self) -> bool {
        matches!(self, Method::WisReuse | Method::WisReusePrior)
    }

    /// Whether it is a yardstick that no renderer could pay for.
    pub fn is_limit(self) -> bool {
        matches!(self, Method::Limit | Method::LimitPooled)
    }

    /// Whether its mean is the integral.
    pub fn is_unbiased(self) -> bool {
        // The limit leaves out what lies in cells whose centre is dark.
        !matches!(self, Method::WisBiased | Method::WisRatio) && !self.is_limit()
    }
}

/// The sampler that the library's header names ("Which sampler") for samples of a point and hits of a pixel.
fn by_rule(setting: &Setting, n: usize, hits: usize) -> Method {
    let material = setting.material;
    let is_mirror = material.widest_half_angle() < 0.02;
    // A product of a callback covers no other hit.
    let is_shared = hits > 1 && (material.measured.is_none() || material.table.is_some());
    match (is_mirror, is_shared) {
        (false, true) => Method::WisReuse,
        (false, false) if n >= 16 && !setting.has_sun => Method::Wis,
        _ => Method::WisPool(candidates(n, material, setting.has_sun)),
    }
}

/// Candidates of a pool for each of so many picks, as wis_pool_pick advises.
fn candidates(picks: usize, material: &Material, has_sun: bool) -> usize {
    let dear = material.measured.is_some();
    let few = dear || material.is_lambert();
    match picks {
        0..=1 if dear => 8,
        0..=1 => 16,
        2..=4 if !few => 8,
        5.. if few && has_sun => 1,
        _ => 4,
    }
}

/// A light as the estimators need it.
pub struct Lit<'a> {
    pub light: &'a Light,
    pub environment: &'a Environment,
    pub plain: Texels,
    pub compensated: Texels,
    pub strata: Stratified,
    pub grid: Grid,
    /// Whether one texel gives a tenth of the light.
    pub has_sun: bool,
}

impl<'a> Lit<'a> {
    /// # Errors
    /// Those of the library.
    pub fn new(light: &'a Light, environment: &'a Environment) -> client::Result<Lit<'a>> {
        let (plain, compensated) = (Texels::plain(light), Texels::compensated(light));
        let strata = Stratified::new(light)?;
        let has_sun = plain.largest() > 0.1;
        Ok(Lit { light, environment, plain, compensated, strata, grid: Grid::new(light), has_sun })
    }
}

/// What the estimators of a report cell share.
pub struct Setting<'a> {
    pub light: &'a Light,
    pub environment: &'a Environment,
    pub material: &'a Material,
    pub plain: &'a Texels,
    compensated: &'a Texels,
    strata: &'a Stratified,
    grid: &'a Grid,
    has_sun: bool,
    pub preparation: Preparation,
}

impl<'a> Setting<'a> {
    pub fn new(lit: &'a Lit<'a>, material: &'a Material) -> Setting<'a> {
        let &Lit { light, environment, ref plain, ref compensated, ref strata, ref grid, has_sun } = lit;
        let preparation = Preparation { world_from_map: Some(light.world_from_map()), ..Default::default() };
        Setting { light, environment, material, plain, compensated, strata, grid, has_sun, preparation }
    }
}

/// A direction to trace and what it adds to the estimate if it is not blocked.
#[derive(Clone, Copy, Debug)]
pub struct Pick {
    pub wi: Vec3,
    pub contribution: f32,
}

/// Hits whose normals turn by up to this angle, in radians, share a product. A wider cone serves more hits, with a density
/// that is too high near their horizons.
const REUSE_CONE: f32 = 0.05;
/// Products of a pixel at most; hits that none of them covers have compensated MIS.
const SHARED_PRODUCTS: usize = 4;

/// What the hits of a pixel share: the normal of each product, and the samples that it drew for all of them.
#[derive(Default)]
struct Shared {
    normals: Vec<Vec3>,
    samples: Vec<([f32; 3], f32)>,
}

impl Shared {
    fn clear(&mut self) {
        self.normals.clear();
        self.samples.clear();
    }

    /// The product that covers a hit. All hits of a pixel have one material here: the normal is what wis_wavelet_product_covers
    /// looks at.
    fn covering(&self, normal: Vec3) -> Option<usize> {
        self.normals.iter().position(|own| *own == normal || own.dot(normal) >= REUSE_CONE.cos())
    }
}

/// The density of a sample: that of its own technique and that of the other, counts included.
type Heuristic = fn(F8, F8) -> F8;

fn balance(own: F8, other: F8) -> F8 {
    own + other
}

fn power(own: F8, other: F8) -> F8 {
    own + other * (other / own)
}

/// The memory of a thread that estimates.
pub struct Estimator {
    product: Block,
    /// Hits of a pixel, and what they share.
    hits: usize,
    shared: Shared,
    /// The limit's product, and for which pixel and hit it is.
    dense: Dense,
    dense_for: Option<([u32; 2], u32)>,
    /// What other pixels saw, for the methods that take it.
    pub prior: raw::wis_prior,
    sampler: Sampler,
}

#[derive(Default)]
struct Sampler {
    batch: Batch,
    candidates: Candidates,
    picks: Vec<Pick>,
    /// What the library's pool chose, and its memory.
    chosen: Vec<raw::wis_pick>,
    scratch: Block,
    /// The factors of a prior.
    factors: Vec<f32>,
}

impl Estimator {
    /// # Errors
    /// Those of the library.
    pub fn new(setting: &Setting, hits: usize) -> client::Result<Estimator> {
        let product = setting.preparation.memory()?;
        let (dense, sampler) = (Dense::default(), Sampler::default());
        Ok(Estimator {
            product,
            hits,
            shared: Shared::default(),
            dense,
            dense_for: None,
            prior: client::prior(),
            sampler,
        })
    }

    /// The samples of a point in a pass; their contributions add up to the estimate.
    ///
    /// # Errors
    /// Those of the library.
    pub fn picks(
        &mut self,
        method: Method,
        setting: &Setting,
        point: &ShadingPoint,
        pass: u32,
        n: usize,
    ) -> client::Result<&[Pick]> {
        let method = if method == Method::WisRule { by_rule(setting, n, self.hits) } else { method };
        let Estimator { product, hits, shared, dense, dense_for, prior, sampler } = self;
        let bsdf = Bsdf::new(setting.material, point);
        sampler.picks.clear();
        sampler.batch.begin(point.pixel, pass, point.hit);
        if method.is_limit() && *dense_for != Some((point.pixel, point.hit)) {
            dense.prepare(setting.grid, &bsdf);
            *dense_for = Some((point.pixel, point.hit));
        }
        match method {
            Method::Environment => sampler.environment(setting, &bsdf, n)?,
            Method::Brdf => sampler.bsdf(setting, &bsdf, n)?,
            Method::MisBalance => sampler.mis(setting.plain, balance, setting, &bsdf, n)?,
            Method::MisPower => sampler.mis(setting.plain, power, setting, &bsdf, n)?,
            Method::MisCompensated => sampler.mis(setting.compensated, balance, setting, &bsdf, n)?,
            Method::Ris(m) => {
                let Sampler { batch, candidates, picks, .. } = sampler;
                candidates.pick_each(batch, (setting, &bsdf), n, m, picks)?;
            }
            Method::Pool(k) => {
                let Sampler { batch, candidates, picks, .. } = sampler;
                candidates.pick_pooled(batch, (setting, &bsdf), n, k, picks)?;
            }
            Method::Structured => sampler.structured(setting, &bsdf, n)?,
            Method::Wis | Method::WisRule => sampler.product(&prepare(setting, point, product)?, setting, &bsdf, n)?,
            Method::WisMis => sampler.product_mis(&prepare(setting, point, product)?, setting, &bsdf, n)?,
            Method::WisBiased => {
                let product = prepare(setting, point, product)?;
                sampler.product(&product, setting, &bsdf, n)?;
                let share = product.estimate()? as f32 / n as f32;
                sampler.picks.iter_mut().for_each(|pick| pick.contribution = share);
            }
            Method::WisRatio => {
                let product = prepare(setting, point, product)?;
                sampler.product(&product, setting, &bsdf, n)?;
                let unshadowed: f32 = sampler.picks.iter().map(|pick| pick.contribution).sum();
                let scale = product.estimate()? as f32 / unshadowed;
                sampler.picks.iter_mut().for_each(|pick| pick.contribution *= scale);
            }
            Method::WisPrior => {
                let preparation = Preparation { prior: Some(*prior), ..setting.preparation };
                let prepared = setting.material.prepare(setting.environment, point, &preparation, product)?;
                sampler.product(&prepared, setting, &bsdf, n)?;
            }
            Method::WisPoolPrior(k) => sampler.pool(setting, &bsdf, n, k, Some(prior))?,
            Method::WisPool(k) => sampler.pool(setting, &bsdf, n, k, None)?,
            Method::WisTreePool(k) => {
                sampler.density_pool(&prepare(setting, point, product)?, setting, &bsdf, n, k, None)?;
            }
            Method::WisReuse | Method::WisReusePrior => {
                if point.hit == 0 {
                    shared.clear();
                }
                let mut covering = shared.covering(point.normal);
                if covering.is_none() && shared.normals.len() < SHARED_PRODUCTS {
                    let prior = Some(*prior).filter(|_| method.takes_prior());
                    let preparation = Preparation { reuse_cone: REUSE_CONE, prior, ..setting.preparation };
                    let prepared = setting.material.prepare(setting.environment, point, &preparation, product)?;
                    // Its samples are for all hits, from the first on.
                    sampler.batch.begin(point.pixel, pass, 0);
                    sampler.share(&prepared, *hits * n, &mut shared.samples)?;
                    covering = Some(shared.normals.len());
                    shared.normals.push(point.normal);
                }
                match covering {
                    Some(product) => {
                        let own = &shared.samples[(product * *hits + point.hit as usize) * n..][..n];
                        sampler.shared(own, setting, &bsdf)?;
                    }
                    None => sampler.mis(setting.compensated, balance, setting, &bsdf, n)?,
                }
            }
            Method::Limit => sampler.limit(dense, setting, &bsdf, n)?,
            Method::LimitPooled => sampler.limit_pooled(dense, setting, &bsdf, n)?,
        }
        Ok(&sampler.picks)
    }
}

/// The product of a setting at a point.
///
/// # Errors
/// Those of the library.
pub fn prepare<'a>(setting: &Setting<'a>, point: &ShadingPoint, memory: &'a mut Block) -> client::Result<Product<'a>> {
    setting.material.prepare(setting.environment, point, &setting.preparation, memory)
}

impl Sampler {
    fn environment(&mut self, setting: &Setting, bsdf: &Bsdf, n: usize) -> client::Result<()> {
        self.batch.from_texels(setting.plain, setting.light, n);
        self.batch.evaluate(bsdf, setting.light, setting.plain);
        self.batch.weigh(|_, light, _| light * F8::splat(n as f32));
        self.take_all();
        Ok(())
    }

    fn bsdf(&mut self, setting: &Setting, bsdf: &Bsdf, n: usize) -> client::Result<()> {
        self.batch.from_bsdf(bsdf, n);
        self.batch.evaluate(bsdf, setting.light, setting.plain);
        self.batch.weigh(|_, _, pdf| pdf * F8::splat(n as f32));
        self.take_all();
        Ok(())
    }

    /// Half the samples from the light and half from the BRDF; a single sample tosses a coin.
    fn mis(
        &mut self,
        texels: &Texels,
        heuristic: Heuristic,
        setting: &Setting,
        bsdf: &Bsdf,
        n: usize,
    ) -> client::Result<()> {
        let (counts, expected) = self.halves(n)?;
        self.batch.from_texels(texels, setting.light, counts[0]);
        self.batch.from_bsdf(bsdf, counts[1]);
        self.batch.evaluate(bsdf, setting.light, texels);
        let [from_light, from_bsdf] = expected.map(F8::splat);
        self.batch.weigh(|first, light, bsdf| {
            let (light, bsdf) = (light * from_light, bsdf * from_bsdf);
            let own = F8::new(std::array::from_fn(|i| f32::from(u8::from(first + i < counts[0]))));
            let of_light = wide::CmpGt::cmp_gt(own, F8::ZERO);
            of_light.blend(heuristic(light, bsdf), heuristic(bsdf, light))
        });
        self.take_all();
        Ok(())
    }

    /// A sample in each stratum; their sum is the estimate.
    fn structured(&mut self, setting: &Setting, bsdf: &Bsdf, n: usize) -> client::Result<()> {
        let strata = setting.strata.of(n);
        self.batch.from_each(strata.count(), |i, u| strata.sample(i, u))?;
        self.batch.evaluate(bsdf, setting.light, setting.plain);
        self.batch.weigh_by_drawn(|pdf, _| pdf);
        self.take_all();
        Ok(())
    }

    fn product(&mut self, product: &Product, setting: &Setting, bsdf: &Bsdf, n: usize) -> client::Result<()> {
        self.batch.from_density(product, n)?;
        self.batch.evaluate(bsdf, setting.light, setting.plain);
        self.batch.weigh_by_drawn(|pdf, _| pdf * F8::splat(n as f32));
        self.take_all();
        Ok(())
    }

    /// Draws samples for all hits of a pixel from one of its products.
    fn share(&mut self, product: &Product, count: usize, samples: &mut Vec<([f32; 3], f32)>) -> client::Result<()> {
        self.batch.from_density(product, count)?;
        samples.extend(self.batch.drawn());
        self.batch.clear();
        Ok(())
    }

    /// Evaluates samples that were drawn for this hit.
    fn shared(&mut self, drawn: &[([f32; 3], f32)], setting: &Setting, bsdf: &Bsdf) -> client::Result<()> {
        for &(wi, pdf) in drawn {
            self.batch.push_drawn(wi, pdf);
        }
        self.batch.evaluate(bsdf, setting.light, setting.plain);
        self.batch.weigh_by_drawn(|pdf, _| pdf * F8::splat(drawn.len() as f32));
        self.take_all();
        Ok(())
    }

    fn product_mis(&mut self, product: &Product, setting: &Setting, bsdf: &Bsdf, n: usize) -> client::Result<()> {
        let (counts, expected) = self.halves(n)?;
        self.batch.from_density(product, counts[0])?;
        self.batch.from_bsdf(bsdf, counts[1]);
        self.batch.ask(product)?;
        self.batch.evaluate(bsdf, setting.light, setting.plain);
        let expected = expected.map(F8::splat);
        self.batch.weigh_by_drawn(|product, bsdf| product * expected[0] + bsdf * expected[1]);
        self.take_all();
        Ok(())
    }

    fn pool(
        &mut self,
        setting: &Setting,
        bsdf: &Bsdf,
        n: usize,
        k: usize,
        prior: Option<&raw::wis_prior>,
    ) -> client::Result<()> {
        let light = setting.light.distribution(setting.environment, raw::WIS_DISTRIBUTION_COMPENSATED);
        self.density_pool(&light, setting, bsdf, n, k, prior)
    }

    /// Candidates half of a density of the library and half of the BRDF, of mirrors a quarter and the rest.
    fn density_pool(
        &mut self,
        density: &impl Density,
        setting: &Setting,
        bsdf: &Bsdf,
        n: usize,
        k: usize,
        prior: Option<&raw::wis_prior>,
    ) -> client::Result<()> {
        let mirrors = setting.material.widest_half_angle() < 0.02;
        let drawn = n * k / if mirrors { 4 } else { 2 };
        let counts = [drawn, n * k - drawn];
        self.batch.from_density(density, counts[0])?;
        self.batch.from_bsdf(bsdf, counts[1]);
        self.batch.ask(density)?;
        self.batch.evaluate(bsdf, setting.light, setting.plain);
        let counts = counts.map(|count| F8::splat(count as f32));
        self.batch.weigh_by_drawn(|drawn, bsdf| counts[0] * drawn + counts[1] * bsdf);
        let Some(prior) = prior else {
            if k == 1 {
                self.take_all();
                return Ok(());
            }
            return self.pick(n);
        };
        // Candidates weigh what is likely to be seen of them, and their picks make up for it.
        self.factors.resize(self.batch.len(), 0.0);
        let matrix = setting.light.world_from_map();
        client::prior_weights(prior, &matrix, self.batch.weighed().0, &mut self.factors)?;
        self.batch.scale(&self.factors);
        self.pick(n)?;
        let chosen = self.chosen.iter().zip(&mut self.picks);
        chosen.for_each(|(chosen, pick)| pick.contribution /= self.factors[chosen.candidate as usize]);
        Ok(())
    }

    /// Picks `n` samples of a weighed batch by the library.
    fn pick(&mut self, n: usize) -> client::Result<()> {
        let Sampler { batch, picks, chosen, scratch, .. } = self;
        picks.clear();
        let u = batch.points(Stream::Choice, 1)[0][0];
        chosen.resize(n, Default::default());
        let (wi, weight) = batch.weighed();
        let (count, sum) = client::pick(wi, weight, u, scratch, chosen)?;
        let share = sum as f32 / n as f32;
        picks.extend(chosen[..count].iter().map(|pick| Pick {
            wi: Vec3::from_array(wi[pick.candidate as usize]),
            contribution: share * pick.multiplicity as f32,
        }));
        Ok(())
    }

    fn limit(&mut self, dense: &Dense, setting: &Setting, bsdf: &Bsdf, n: usize) -> client::Result<()> {
        self.batch.from_dense((dense, setting.grid), n);
        self.batch.evaluate(bsdf, setting.light, setting.plain);
        self.batch.weigh_by_drawn(|pdf, _| pdf * F8::splat(n as f32));
        self.take_all();
        Ok(())
    }

    fn limit_pooled(&mut self, dense: &Dense, setting: &Setting, bsdf: &Bsdf, n: usize) -> client::Result<()> {
        const CANDIDATES: usize = 4;
        let Sampler { batch, candidates, picks, .. } = self;
        batch.from_dense((dense, setting.grid), n * CANDIDATES);
        batch.evaluate(bsdf, setting.light, setting.plain);
        batch.weigh_by_drawn(|pdf, _| pdf * F8::splat((n * CANDIDATES) as f32));
        let offset = batch.points(Stream::Choice, 1)[0][0];
        candidates.pick(batch, n, offset, picks);
        Ok(())
    }

    /// How many samples each of two techniques draws, and how many are to be expected.
    fn halves(&mut self, n: usize) -> client::Result<([usize; 2], [f32; 2])> {
        if n == 1 {
            let heads = self.batch.points(Stream::Choice, 1)[0][0] < 0.5;
            return Ok(([usize::from(heads), usize::from(!heads)], [0.5; 2]));
        }
        let counts = [n / 2, n - n / 2];
        Ok((counts, counts.map(|count| count as f32)))
    }

    /// Picks every sample that adds something.
    fn take_all(&mut self) {
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
}
