//! The samplers of version 0.1 that the library still has: its product of wavelets, and the pool over it. The report compares
//! the product as it compares peers.

use crate::batch::Stream;
use crate::client::{self, Block, Density, Product, raw};
use crate::estimator::{Pick, Sampler, Setting};
use crate::lanes::F8;
use crate::material::Bsdf;
use crate::scene::ShadingPoint;
use glam::Vec3;

/// A sampler of version 0.1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Before {
    /// The product of wavelets.
    Product,
    /// A pool of so many candidates a pick, half of the product and half of the BRDF, of mirrors a quarter and the rest. One a
    /// pick: all of them, by the balance heuristic.
    TreePool(usize),
}

impl Before {
    pub fn name(self) -> &'static str {
        match self {
            Before::Product => "wavelet product",
            Before::TreePool(_) => "0.1 tree pool",
        }
    }
}

/// What a thread keeps for version 0.1 between points.
pub struct State {
    product: Block,
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
    pub fn new(setting: &Setting) -> client::Result<State> {
        Ok(State { product: setting.preparation.memory()?, pool: Pool::default() })
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
        n: usize,
    ) -> client::Result<()> {
        let State { product, pool } = self;
        let product = prepare(setting, point, product)?;
        match mode {
            Before::Product => sampler.density(&product, setting, bsdf, n),
            Before::TreePool(k) => pool.of_density(&product, sampler, setting, bsdf, (n, k)),
        }
    }
}

/// The product of a setting at a point.
///
/// # Errors
/// Those of the library.
pub fn prepare<'a>(setting: &Setting<'a>, point: &ShadingPoint, memory: &'a mut Block) -> client::Result<Product<'a>> {
    setting.material.prepare_at(setting.cost, setting.environment, point, &setting.preparation, memory)
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
        sampler.reflect(setting, bsdf);
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
