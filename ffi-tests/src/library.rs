//! The method under test: the modes of the library through its C interface. What calls the library in order to estimate
//! stands here and nowhere else.

use crate::batch::Stream;
use crate::client::{self, Block, Density, Product, raw};
use crate::environment;
use crate::estimator::{Pick, Sampler, Setting};
use crate::lanes::F8;
use crate::material::Bsdf;
use crate::scene::ShadingPoint;
use glam::Vec3;
use std::cell::RefCell;

/// A mode of the library.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// The wavelet product alone.
    Product,
    /// The wavelet product and the BRDF, by the balance heuristic.
    ProductMis,
    /// The integral times the share of the samples that is visible; biased (Clarberg et al. 2005, Eq. 11).
    Biased,
    /// The integral times shadowed by unshadowed estimate; biased.
    Ratio,
    /// A pool of so many candidates a pick, half of the wavelet product and half of the BRDF, of mirrors a quarter and the rest.
    TreePool(usize),
    /// The rays that wis_direct answers.
    Direct,
}

impl Mode {
    /// What the report measures.
    pub const ALL: [Mode; 6] =
        [Mode::Direct, Mode::Product, Mode::ProductMis, Mode::Biased, Mode::Ratio, Mode::TreePool(4)];

    pub fn name(self) -> &'static str {
        match self {
            Mode::Product => "wis",
            Mode::ProductMis => "wis + MIS",
            Mode::Biased => "wis biased",
            Mode::Ratio => "wis ratio",
            Mode::TreePool(_) => "wis tree pool",
            Mode::Direct => "direct",
        }
    }

    /// Whether its mean is the integral.
    pub fn is_unbiased(self) -> bool {
        !matches!(self, Mode::Biased | Mode::Ratio)
    }
}

/// What a thread keeps for the library between points.
pub struct Library {
    product: Block,
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

/// What the library's pool chose, and its memory.
#[derive(Default)]
struct Pool {
    chosen: Vec<raw::wis_pick>,
    scratch: Block,
}

impl Library {
    /// # Errors
    /// Those of the library.
    pub fn new(setting: &Setting, hits: usize) -> client::Result<Library> {
        let (product, pool) = (setting.preparation.memory()?, Pool::default());
        let sampler = RefCell::new(environment::Sampler::new(RAYS, setting.candidates, hits)?);
        let direct = Direct { material: environment::material(&setting.material.lobes())?, rays: Vec::new() };
        Ok(Library { product, pool, sampler, direct })
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
        let Library { product, pool, sampler: own, direct } = self;
        match mode {
            Mode::Product => sampler.density(&prepare(setting, point, product)?, setting, bsdf, n),
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
            Mode::Direct => {
                let own = own.get_mut();
                if point.hit == 0 {
                    own.begin_pixel()?;
                }
                direct.estimate(own, sampler, (setting, point, bsdf), pass, n)
            }
            Mode::TreePool(k) => pool.of_density(&prepare(setting, point, product)?, sampler, setting, bsdf, (n, k)),
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
