//! The method under test: the modes of the library through its C interface. What calls the library in order to estimate
//! stands here and nowhere else.

use crate::batch::{Batch, Stream};
use crate::client::{self, Block, Density, Preparation, Product, raw};
use crate::environment;
use crate::estimator::{Pick, Sampler, Setting};
use crate::lanes::F8;
use crate::material::{Bsdf, Material};
use crate::peers::balance;
use crate::scene::ShadingPoint;
use glam::Vec3;
use std::cell::RefCell;

/// A mode of the library.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// What the library's header says is to be used: see `by_rule`.
    Rule,
    /// The product alone.
    Product,
    /// The product and the BRDF, by the balance heuristic.
    ProductMis,
    /// The integral times the share of the samples that is visible; biased (Clarberg et al. 2005, Eq. 11).
    Biased,
    /// The integral times shadowed by unshadowed estimate; biased.
    Ratio,
    /// The product, prepared at the first hit of a pixel and used for the others that it covers, with more of them for those
    /// that it does not.
    Reuse,
    /// `Reuse` with the visibility prior of the pixel's tile.
    ReusePrior,
    /// The product with the visibility prior of the pixel's tile.
    Prior,
    /// The pool: so many candidates a pick, half of compensated light and half of the BRDF, of mirrors a quarter and the
    /// rest. One a pick: all of them, by the balance heuristic.
    Pool(usize),
    /// `Pool` with that prior.
    PoolPrior(usize),
    /// The pool with candidates of the product instead of the light.
    TreePool(usize),
    /// The rays that wis_direct answers.
    Direct,
}

impl Mode {
    /// What the report measures.
    pub const ALL: [Mode; 12] = [
        Mode::Direct,
        Mode::Rule,
        Mode::Product,
        Mode::ProductMis,
        Mode::Biased,
        Mode::Ratio,
        Mode::Reuse,
        Mode::ReusePrior,
        Mode::Prior,
        Mode::Pool(4),
        Mode::PoolPrior(4),
        Mode::TreePool(4),
    ];

    pub fn name(self) -> &'static str {
        match self {
            Mode::Direct => "direct",
            Mode::Rule => "wis by rule",
            Mode::Product => "wis",
            Mode::ProductMis => "wis + MIS",
            Mode::Biased => "wis biased",
            Mode::Ratio => "wis ratio",
            Mode::Reuse => "wis reuse",
            Mode::ReusePrior => "wis reuse + prior",
            Mode::Prior => "wis + prior",
            Mode::Pool(_) => "wis pool",
            Mode::PoolPrior(_) => "wis pool + prior",
            Mode::TreePool(_) => "wis tree pool",
        }
    }

    /// Whether it reads a visibility prior.
    pub fn takes_prior(self) -> bool {
        matches!(self, Mode::ReusePrior | Mode::Prior | Mode::PoolPrior(_))
    }

    /// Whether it shares a product among the hits of a pixel.
    pub fn shares(self) -> bool {
        matches!(self, Mode::Reuse | Mode::ReusePrior)
    }

    /// Whether its mean is the integral.
    pub fn is_unbiased(self) -> bool {
        !matches!(self, Mode::Biased | Mode::Ratio)
    }
}

/// The sampler that the library's header names ("Which sampler") for samples of a point and hits of a pixel.
fn by_rule(setting: &Setting, n: usize, hits: usize) -> Mode {
    let material = setting.material;
    let is_mirror = material.widest_half_angle() < 0.02;
    // A product of a callback covers no other hit.
    let is_shared = hits > 1 && (material.measured.is_none() || material.table.is_some());
    match (is_mirror, is_shared) {
        (false, true) => Mode::Reuse,
        (false, false) if n >= 16 && !setting.has_sun => Mode::Product,
        _ => Mode::Pool(candidates(n, material, setting.has_sun)),
    }
}

/// Candidates of a pool for each of so many picks, as wis_pool_pick advises.
fn candidates(picks: usize, material: &Material, has_sun: bool) -> usize {
    let expensive = material.measured.is_some();
    let few = expensive || material.is_lambert();
    match picks {
        0..=1 if expensive => 8,
        0..=1 => 16,
        2..=4 if !few => 8,
        5.. if few && has_sun => 1,
        _ => 4,
    }
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

/// What a thread keeps for the library between points.
pub struct Library {
    product: Block,
    /// Hits of a pixel, and what they share.
    hits: usize,
    shared: Shared,
    /// What other pixels saw, for the modes that take it.
    pub prior: raw::wis_prior,
    pool: Pool,
    sampler: RefCell<environment::Sampler>,
    direct: Direct,
}

/// The material of the setting and the rays of a call.
struct Direct {
    material: raw::wis_material,
    rays: Vec<raw::wis_ray>,
}

/// Rays of a call to wis_direct at most.
const RAYS: usize = 64;

/// What the library's pool chose, its memory, and the factors of a prior.
#[derive(Default)]
struct Pool {
    chosen: Vec<raw::wis_pick>,
    scratch: Block,
    factors: Vec<f32>,
}

impl Library {
    /// # Errors
    /// Those of the library.
    pub fn new(setting: &Setting, hits: usize) -> client::Result<Library> {
        let (product, shared, pool) = (setting.preparation.memory()?, Shared::default(), Pool::default());
        let sampler = RefCell::new(environment::Sampler::new(RAYS, setting.candidates, hits)?);
        let direct = Direct { material: environment::material(&setting.material.lobes())?, rays: Vec::new() };
        Ok(Library { product, hits, shared, prior: client::prior(), pool, sampler, direct })
    }

    /// What calls on the new light take.
    pub fn sampler(&self) -> &RefCell<environment::Sampler> {
        &self.sampler
    }

    /// Estimates by a mode. The sampler has begun the point's sequences.
    ///
    /// # Errors
    /// Those of the library.
    pub fn estimate(
        &mut self,
        mode: Mode,
        sampler: &mut Sampler,
        (setting, point, bsdf): (&Setting, &ShadingPoint, &Bsdf),
        pass: u32,
        n: usize,
    ) -> client::Result<()> {
        let mode = if mode == Mode::Rule { by_rule(setting, n, self.hits) } else { mode };
        let Library { product, hits, shared, prior, pool, sampler: own, direct } = self;
        match mode {
            Mode::Product | Mode::Rule => sampler.density(&prepare(setting, point, product)?, setting, bsdf, n),
            Mode::ProductMis => sampler.density_mis(&prepare(setting, point, product)?, setting, bsdf, n),
            Mode::Biased => {
                let product = prepare(setting, point, product)?;
                sampler.density(&product, setting, bsdf, n)?;
                let share = product.estimate()? as f32 / n as f32;
                sampler.picks.iter_mut().for_each(|pick| pick.contribution = share);
                Ok(())
            }
            Mode::Ratio => {
                let product = prepare(setting, point, product)?;
                sampler.density(&product, setting, bsdf, n)?;
                let unshadowed: f32 = sampler.picks.iter().map(|pick| pick.contribution).sum();
                let scale = product.estimate()? as f32 / unshadowed;
                sampler.picks.iter_mut().for_each(|pick| pick.contribution *= scale);
                Ok(())
            }
            Mode::Prior => {
                let preparation = Preparation { prior: Some(*prior), ..setting.preparation };
                sampler.density(&prepare_by(setting, point, &preparation, product)?, setting, bsdf, n)
            }
            Mode::Direct => {
                let own = own.get_mut();
                if point.hit == 0 {
                    own.begin_pixel()?;
                }
                direct.estimate(own, sampler, (setting, point, bsdf), pass, n)
            }
            Mode::Pool(k) => pool.of_light(sampler, setting, bsdf, (n, k), None),
            Mode::PoolPrior(k) => pool.of_light(sampler, setting, bsdf, (n, k), Some(prior)),
            Mode::TreePool(k) => {
                pool.of_density(&prepare(setting, point, product)?, sampler, setting, bsdf, (n, k), None)
            }
            Mode::Reuse | Mode::ReusePrior => {
                if point.hit == 0 {
                    shared.clear();
                }
                let mut covering = shared.covering(point.normal);
                if covering.is_none() && shared.normals.len() < SHARED_PRODUCTS {
                    let prior = Some(*prior).filter(|_| mode.takes_prior());
                    let preparation = Preparation { reuse_cone: REUSE_CONE, prior, ..setting.preparation };
                    let prepared = prepare_by(setting, point, &preparation, product)?;
                    // Its samples are for all hits, from the first on.
                    sampler.batch.begin(point.pixel, pass, 0);
                    share(&mut sampler.batch, &prepared, *hits * n, &mut shared.samples)?;
                    covering = Some(shared.normals.len());
                    shared.normals.push(point.normal);
                }
                match covering {
                    Some(product) => {
                        let own = &shared.samples[(product * *hits + point.hit as usize) * n..][..n];
                        sampler.drawn(own, setting, bsdf);
                    }
                    None => sampler.mis(setting.compensated, balance, setting, bsdf, n),
                }
                Ok(())
            }
        }
    }
}

/// The product of a setting at a point.
///
/// # Errors
/// Those of the library.
pub fn prepare<'a>(setting: &Setting<'a>, point: &ShadingPoint, memory: &'a mut Block) -> client::Result<Product<'a>> {
    prepare_by(setting, point, &setting.preparation, memory)
}

fn prepare_by<'a>(
    setting: &Setting<'a>,
    point: &ShadingPoint,
    preparation: &Preparation,
    memory: &'a mut Block,
) -> client::Result<Product<'a>> {
    setting.material.prepare_at(setting.cost, setting.environment, point, preparation, memory)
}

/// Draws samples for all hits of a pixel from one of its products.
fn share(batch: &mut Batch, product: &Product, count: usize, samples: &mut Vec<([f32; 3], f32)>) -> client::Result<()> {
    batch.from_density(product, count)?;
    samples.extend(batch.drawn());
    batch.clear();
    Ok(())
}

impl Sampler {
    /// Samples of a density alone.
    ///
    /// # Errors
    /// Those of the library.
    pub fn density(&mut self, density: &dyn Density, setting: &Setting, bsdf: &Bsdf, n: usize) -> client::Result<()> {
        self.batch.from_density(density, n)?;
        self.evaluate(setting, bsdf);
        self.batch.weigh_by_drawn(|pdf, _| pdf * F8::splat(n as f32));
        self.take_all();
        Ok(())
    }

    /// Half of a density and half of the BRDF, by the balance heuristic; a single sample tosses a coin.
    ///
    /// # Errors
    /// Those of the library.
    pub fn density_mis(
        &mut self,
        density: &dyn Density,
        setting: &Setting,
        bsdf: &Bsdf,
        n: usize,
    ) -> client::Result<()> {
        let (counts, expected) = self.halves(n);
        self.batch.from_density(density, counts[0])?;
        self.batch.from_bsdf(bsdf, counts[1]);
        self.batch.ask(density)?;
        self.evaluate(setting, bsdf);
        let expected = expected.map(F8::splat);
        self.batch.weigh_by_drawn(|product, bsdf| product * expected[0] + bsdf * expected[1]);
        self.take_all();
        Ok(())
    }

    /// Evaluates samples that were drawn for this hit.
    fn drawn(&mut self, drawn: &[([f32; 3], f32)], setting: &Setting, bsdf: &Bsdf) {
        for &(wi, pdf) in drawn {
            self.batch.push_drawn(wi, pdf);
        }
        self.evaluate(setting, bsdf);
        self.batch.weigh_by_drawn(|pdf, _| pdf * F8::splat(drawn.len() as f32));
        self.take_all();
    }
}

impl Direct {
    /// The client's loop: BRDF and radiance are evaluated for the rays alone.
    fn estimate(
        &mut self,
        own: &mut environment::Sampler,
        sampler: &mut Sampler,
        (setting, point, bsdf): (&Setting, &ShadingPoint, &Bsdf),
        pass: u32,
        n: usize,
    ) -> client::Result<()> {
        let mut at = setting.material.point(point, &self.material);
        // A repeat has another seed, as another pixel has.
        (at.seed, at.turn) = (client::pixel_seed(point.pixel, pass), point.hit);
        self.rays.resize(n, Default::default());
        let count = own.direct(setting.tables, &at, &mut self.rays)?;
        for ray in &self.rays[..count] {
            sampler.batch.push_drawn(ray.wi, 1.0 / ray.weight);
        }
        sampler.evaluate(setting, bsdf);
        sampler.batch.weigh_by_drawn(|density, _| density);
        sampler.take_all();
        Ok(())
    }
}

impl Pool {
    fn of_light(
        &mut self,
        sampler: &mut Sampler,
        setting: &Setting,
        bsdf: &Bsdf,
        counts: (usize, usize),
        prior: Option<&raw::wis_prior>,
    ) -> client::Result<()> {
        let light = setting.light.distribution(setting.environment, raw::WIS_DISTRIBUTION_COMPENSATED);
        self.of_density(&light, sampler, setting, bsdf, counts, prior)
    }

    /// `n` picks of `k` candidates each, half of a density of the library and half of the BRDF, of mirrors a quarter and the
    /// rest.
    fn of_density(
        &mut self,
        density: &dyn Density,
        sampler: &mut Sampler,
        setting: &Setting,
        bsdf: &Bsdf,
        (n, k): (usize, usize),
        prior: Option<&raw::wis_prior>,
    ) -> client::Result<()> {
        let mirrors = setting.material.widest_half_angle() < 0.02;
        let drawn = n * k / if mirrors { 4 } else { 2 };
        let counts = [drawn, n * k - drawn];
        sampler.batch.from_density(density, counts[0])?;
        sampler.batch.from_bsdf(bsdf, counts[1]);
        sampler.batch.ask(density)?;
        sampler.evaluate(setting, bsdf);
        let counts = counts.map(|count| F8::splat(count as f32));
        sampler.batch.weigh_by_drawn(|drawn, bsdf| counts[0] * drawn + counts[1] * bsdf);
        let Some(prior) = prior else {
            if k == 1 {
                sampler.take_all();
                return Ok(());
            }
            return self.pick(sampler, n);
        };
        // Candidates weigh what is likely to be seen of them, and their picks make up for it.
        self.factors.resize(sampler.batch.len(), 0.0);
        let matrix = setting.light.world_from_map();
        client::prior_weights(prior, &matrix, sampler.batch.weighed().0, &mut self.factors)?;
        sampler.batch.scale(&self.factors);
        self.pick(sampler, n)?;
        let chosen = self.chosen.iter().zip(&mut sampler.picks);
        chosen.for_each(|(chosen, pick)| pick.contribution /= self.factors[chosen.candidate as usize]);
        Ok(())
    }

    /// Picks `n` samples of a weighed batch by the library.
    fn pick(&mut self, Sampler { batch, picks, .. }: &mut Sampler, n: usize) -> client::Result<()> {
        picks.clear();
        let u = batch.points(Stream::Choice, 1)[0][0];
        self.chosen.resize(n, Default::default());
        let (wi, weight) = batch.weighed();
        let (count, sum) = client::pick(wi, weight, u, &mut self.scratch, &mut self.chosen)?;
        let share = sum as f32 / n as f32;
        picks.extend(self.chosen[..count].iter().map(|pick| Pick {
            wi: Vec3::from_array(wi[pick.candidate as usize]),
            contribution: share * pick.multiplicity as f32,
        }));
        Ok(())
    }
}
