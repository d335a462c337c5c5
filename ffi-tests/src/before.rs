//! The samplers of version 0.1, which the library still has: its product of wavelets, its pool, and the rule that its header
//! named. The report compares them as it compares peers.

use crate::batch::{Batch, Stream};
use crate::client::{self, Block, Density, Preparation, Product, raw};
use crate::estimator::{Pick, Sampler, Setting};
use crate::lanes::F8;
use crate::material::{Bsdf, Material};
use crate::peers::balance;
use crate::scene::ShadingPoint;
use glam::Vec3;

/// A sampler of version 0.1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Before {
    /// What the header of version 0.1 said is to be used: see `by_rule`.
    Rule,
    /// The product of wavelets.
    Product,
    /// The same, prepared at the first hit of a pixel and used for the others that it covers, with more of them for those
    /// that it does not.
    Reuse,
    /// The product with the visibility prior of the pixel's tile.
    Prior,
    /// The pool: so many candidates a pick, half of compensated light and half of the BRDF, of mirrors a quarter and the
    /// rest. One a pick: all of them, by the balance heuristic.
    Pool(usize),
    /// The pool with candidates of the product instead of the light.
    TreePool(usize),
}

impl Before {
    pub fn name(self) -> &'static str {
        match self {
            Before::Rule => "0.1 by its rule",
            Before::Product => "wavelet product",
            Before::Reuse => "0.1 reuse",
            Before::Prior => "0.1 prior",
            Before::Pool(_) => "0.1 pool",
            Before::TreePool(_) => "0.1 tree pool",
        }
    }
}

/// The sampler that the library's header names ("Which sampler") for samples of a point and hits of a pixel.
fn by_rule(setting: &Setting, n: usize, hits: usize) -> Before {
    let material = setting.material;
    let is_mirror = material.widest_half_angle() < 0.02;
    // A product covers neither hits of other weights nor, of a callback, any other hit.
    let is_shared = hits > 1 && !material.textured && (material.measured.is_none() || material.table.is_some());
    match (is_mirror, is_shared) {
        (false, true) => Before::Reuse,
        (false, false) if n >= 16 && !setting.has_sun => Before::Product,
        _ => Before::Pool(candidates(n, material, setting.has_sun)),
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

/// What a thread keeps for version 0.1 between points.
pub struct State {
    product: Block,
    /// Hits of a pixel, and what they share.
    hits: usize,
    shared: Shared,
    /// What other pixels saw, for the modes that take it.
    pub prior: raw::wis_prior,
    pool: Pool,
}

/// What the pool chose, and its memory.
#[derive(Default)]
struct Pool {
    chosen: Vec<raw::wis_pick>,
    scratch: Block,
}

impl State {
    /// # Errors
    /// Those of the library.
    pub fn new(setting: &Setting, hits: usize) -> client::Result<State> {
        let (product, shared, pool) = (setting.preparation.memory()?, Shared::default(), Pool::default());
        Ok(State { product, hits, shared, prior: client::prior(), pool })
    }

    /// Estimates by a sampler of version 0.1.
    ///
    /// # Errors
    /// Those of the library.
    pub fn estimate(
        &mut self,
        mode: Before,
        sampler: &mut Sampler,
        (setting, point, bsdf): (&Setting, &ShadingPoint, &Bsdf),
        pass: u32,
        n: usize,
    ) -> client::Result<()> {
        let mode = if mode == Before::Rule { by_rule(setting, n, self.hits) } else { mode };
        let State { product, hits, shared, prior, pool } = self;
        match mode {
            Before::Product | Before::Rule => sampler.density(&prepare(setting, point, product)?, setting, bsdf, n),
            Before::Prior => {
                let preparation = Preparation { prior: Some(*prior), ..setting.preparation };
                sampler.density(&prepare_by(setting, point, &preparation, product)?, setting, bsdf, n)
            }
            Before::Pool(k) => {
                let light = setting.light.distribution(setting.environment, raw::WIS_DISTRIBUTION_COMPENSATED);
                pool.of_density(&light, sampler, setting, bsdf, (n, k))
            }
            Before::TreePool(k) => pool.of_density(&prepare(setting, point, product)?, sampler, setting, bsdf, (n, k)),
            Before::Reuse => {
                if point.hit == 0 {
                    shared.clear();
                }
                let mut covering = shared.covering(point.normal);
                if covering.is_none() && shared.normals.len() < SHARED_PRODUCTS {
                    let preparation = Preparation { reuse_cone: REUSE_CONE, ..setting.preparation };
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

impl Pool {
    /// `n` picks of `k` candidates each, half of a density of the library and half of the BRDF, of mirrors a quarter and the
    /// rest.
    fn of_density(
        &mut self,
        density: &dyn Density,
        sampler: &mut Sampler,
        setting: &Setting,
        bsdf: &Bsdf,
        (n, k): (usize, usize),
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
        if k == 1 {
            sampler.take_all();
            return Ok(());
        }
        self.pick(sampler, n)
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
