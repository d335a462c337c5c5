//! The estimators under comparison. All share the points, the BRDF, the look-up of the light and the rays, run one
//! sample at a time without SIMD, and draw from the light through the library.

use crate::client::{self, Block, Density, Environment, Preparation, Product, raw};
use crate::light::Light;
use crate::material::{Bsdf, Material};
use crate::pool::Candidates;
use crate::scene::ShadingPoint;
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
    /// The library's product alone.
    Wis,
    /// The library's product and the BRDF, by the balance heuristic.
    WisMis,
}

impl Method {
    /// Every peer, then the library.
    pub const ALL: [Method; 11] = [
        Method::Environment,
        Method::Brdf,
        Method::MisBalance,
        Method::MisPower,
        Method::MisCompensated,
        Method::Ris(8),
        Method::Ris(32),
        Method::Pool(4),
        Method::Pool(8),
        Method::Wis,
        Method::WisMis,
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
            Method::Wis => "wis".into(),
            Method::WisMis => "wis + MIS".into(),
        }
    }

    /// Whether it is another's method.
    pub fn is_peer(self) -> bool {
        !matches!(self, Method::Wis | Method::WisMis)
    }
}

/// What the estimators of a report cell share.
pub struct Setting<'a> {
    pub light: &'a Light,
    pub environment: &'a Environment,
    pub material: &'a Material,
    plain: client::Light<'a>,
    compensated: client::Light<'a>,
    pub preparation: Preparation,
}

impl<'a> Setting<'a> {
    pub fn new(light: &'a Light, environment: &'a Environment, material: &'a Material) -> Setting<'a> {
        Setting {
            light,
            environment,
            material,
            plain: light.distribution(environment, raw::WIS_DISTRIBUTION_PLAIN),
            compensated: light.distribution(environment, raw::WIS_DISTRIBUTION_COMPENSATED),
            preparation: Preparation { world_from_map: Some(light.world_from_map()), ..Default::default() },
        }
    }

    /// The light's own density.
    pub fn plain(&self) -> &client::Light<'a> {
        &self.plain
    }
}

/// A direction to trace and what it adds to the estimate if it is not blocked.
#[derive(Clone, Copy, Debug)]
pub struct Pick {
    pub wi: Vec3,
    pub contribution: f32,
}

/// Independent sequences of points within a pixel and pass.
#[derive(Clone, Copy)]
pub enum Stream {
    Light,
    Bsdf,
    Choice,
    Uniform,
}

/// Points, directions and densities of the samples being drawn.
#[derive(Default)]
pub struct Draws {
    pixel: [u32; 2],
    pass: u32,
    first: u32,
    u: Vec<[f32; 2]>,
    wi: Vec<[f32; 3]>,
    pdf: Vec<f32>,
}

impl Draws {
    /// Chooses the sequences of a pixel in a pass, from a number on.
    pub fn begin(&mut self, pixel: [u32; 2], pass: u32, first: u32) {
        (self.pixel, self.pass, self.first) = (pixel, pass, first);
    }

    /// The next points of a stream.
    pub fn points(&mut self, stream: Stream, count: usize) -> client::Result<&[[f32; 2]]> {
        self.u.resize(count, [0.0; 2]);
        let seed = client::pixel_seed(self.pixel, self.pass.wrapping_mul(4).wrapping_add(stream as u32));
        client::sobol(seed, self.first, &mut self.u)?;
        Ok(&self.u)
    }

    /// Draws directions with their densities.
    pub fn from_density(&mut self, density: &impl Density, stream: Stream, count: usize) -> client::Result<()> {
        self.points(stream, count)?;
        self.resize(count);
        density.sample_n(&self.u, &mut self.wi, &mut self.pdf)
    }

    /// Draws directions from the BRDF; `evaluate` gives them densities.
    pub fn from_bsdf(&mut self, bsdf: &Bsdf, stream: Stream, count: usize) -> client::Result<()> {
        self.from_map(stream, count, |u| bsdf.sample(u))
    }

    /// Draws directions by a function of the points.
    pub fn from_map(&mut self, stream: Stream, count: usize, map: impl Fn([f32; 2]) -> Vec3) -> client::Result<()> {
        self.points(stream, count)?;
        self.resize(count);
        for (u, wi) in self.u.iter().zip(&mut self.wi) {
            *wi = map(*u).to_array();
        }
        Ok(())
    }

    /// Replaces the densities by another's.
    pub fn evaluate(&mut self, density: &impl Density) -> client::Result<()> {
        density.pdf_n(&self.wi, &mut self.pdf)
    }

    pub fn for_each(&self, mut visit: impl FnMut(Vec3, f32)) {
        for (wi, pdf) in self.wi.iter().zip(&self.pdf) {
            visit(Vec3::from_array(*wi), *pdf);
        }
    }

    fn resize(&mut self, count: usize) {
        self.wi.resize(count, [0.0; 3]);
        self.pdf.resize(count, 0.0);
    }
}

/// The effective density of a sample: that of its own technique and that of the other, counts included.
type Heuristic = fn(f32, f32) -> f32;

fn balance(own: f32, other: f32) -> f32 {
    own + other
}

fn power(own: f32, other: f32) -> f32 {
    own + other * (other / own)
}

/// The memory of a thread that estimates.
pub struct Estimator {
    product: Block,
    sampler: Sampler,
}

#[derive(Default)]
struct Sampler {
    draws: Draws,
    candidates: Candidates,
    picks: Vec<Pick>,
}

impl Estimator {
    /// # Errors
    /// Those of the library.
    pub fn new(setting: &Setting) -> client::Result<Estimator> {
        Ok(Estimator { product: setting.preparation.memory()?, sampler: Sampler::default() })
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
        let Estimator { product, sampler } = self;
        let bsdf = Bsdf::new(setting.material, point);
        let light = setting.light;
        sampler.picks.clear();
        sampler.draws.begin(point.pixel, pass, 0);
        match method {
            Method::Environment => sampler.single(&setting.plain, light, &bsdf, n)?,
            Method::Brdf => sampler.bsdf(light, &bsdf, n)?,
            Method::MisBalance => sampler.mis(&setting.plain, balance, light, &bsdf, n)?,
            Method::MisPower => sampler.mis(&setting.plain, power, light, &bsdf, n)?,
            Method::MisCompensated => sampler.mis(&setting.compensated, balance, light, &bsdf, n)?,
            Method::Ris(m) => {
                let Sampler { draws, candidates, picks } = sampler;
                candidates.pick_each(draws, (&setting.plain, light, &bsdf), n, m, picks)?;
            }
            Method::Pool(k) => {
                let Sampler { draws, candidates, picks } = sampler;
                candidates.pick_pooled(draws, (&setting.plain, light, &bsdf), n, k, picks)?;
            }
            Method::Wis => sampler.single(&prepare(setting, point, product)?, light, &bsdf, n)?,
            Method::WisMis => sampler.mis(&prepare(setting, point, product)?, balance, light, &bsdf, n)?,
        }
        Ok(&sampler.picks)
    }
}

/// The product of a setting at a point.
///
/// # Errors
/// Those of the library.
pub fn prepare<'a>(setting: &Setting<'a>, point: &ShadingPoint, memory: &'a mut Block) -> client::Result<Product<'a>> {
    Product::prepare(setting.environment, &setting.material.query(point), &setting.preparation, memory)
}

impl Sampler {
    fn single(&mut self, density: &impl Density, light: &Light, bsdf: &Bsdf, n: usize) -> client::Result<()> {
        self.draws.from_density(density, Stream::Light, n)?;
        let picks = &mut self.picks;
        self.draws.for_each(|wi, pdf| add(picks, light, wi, bsdf.eval(wi).0, pdf * n as f32));
        Ok(())
    }

    fn bsdf(&mut self, light: &Light, bsdf: &Bsdf, n: usize) -> client::Result<()> {
        self.draws.from_bsdf(bsdf, Stream::Bsdf, n)?;
        let picks = &mut self.picks;
        self.draws.for_each(|wi, _| {
            let (f_cos, pdf) = bsdf.eval(wi);
            add(picks, light, wi, f_cos, pdf * n as f32);
        });
        Ok(())
    }

    /// Half the samples from a density and half from the BRDF; a single sample tosses a coin.
    fn mis(
        &mut self,
        density: &impl Density,
        heuristic: Heuristic,
        light: &Light,
        bsdf: &Bsdf,
        n: usize,
    ) -> client::Result<()> {
        let (first, second) = (n / 2, n - n / 2);
        if n == 1 {
            let heads = self.draws.points(Stream::Choice, 1)?[0][0] < 0.5;
            self.mis_part(density, heuristic, light, bsdf, [usize::from(heads), usize::from(!heads)], [0.5; 2])
        } else {
            self.mis_part(density, heuristic, light, bsdf, [first, second], [first as f32, second as f32])
        }
    }

    /// Draws `counts` samples of the density and the BRDF, of which `expected` were to be expected.
    fn mis_part(
        &mut self,
        density: &impl Density,
        heuristic: Heuristic,
        light: &Light,
        bsdf: &Bsdf,
        counts: [usize; 2],
        expected: [f32; 2],
    ) -> client::Result<()> {
        let Sampler { draws, picks, .. } = self;
        draws.from_density(density, Stream::Light, counts[0])?;
        draws.for_each(|wi, pdf| {
            let (f_cos, pdf_bsdf) = bsdf.eval(wi);
            add(picks, light, wi, f_cos, heuristic(expected[0] * pdf, expected[1] * pdf_bsdf));
        });
        draws.from_bsdf(bsdf, Stream::Bsdf, counts[1])?;
        draws.evaluate(density)?;
        draws.for_each(|wi, pdf| {
            let (f_cos, pdf_bsdf) = bsdf.eval(wi);
            add(picks, light, wi, f_cos, heuristic(expected[1] * pdf_bsdf, expected[0] * pdf));
        });
        Ok(())
    }
}

/// Keeps a sample that can add something; the light is looked up only for those.
#[inline]
fn add(picks: &mut Vec<Pick>, light: &Light, wi: Vec3, f_cos: f32, density: f32) {
    if f_cos > 0.0 && density > 0.0 {
        let contribution = f_cos * light.radiance(wi) / density;
        if contribution > 0.0 {
            picks.push(Pick { wi, contribution });
        }
    }
}
