//! The methods under test: the library through its C interface. What calls it in order to estimate stands here and in
//! `earlier`, and nowhere else.

use crate::client::{self, Block, Brdf, Density, raw};
use crate::earlier;
use crate::environment::{self, Light};
use crate::lanes::F8;
use crate::material::Bsdf;
use crate::peers::{Heuristic, halves, of_two, power};
use crate::scene::ShadingPoint;
use crate::setting::{Sampler, Setting};
use std::cell::RefCell;
use std::rc::Rc;
use wide::CmpGt;

/// A way to use the library.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// The rays that wis_direct answers.
    Direct,
    /// The same with a sampler that knows the hits of a pixel: they share products.
    Shared,
    /// The rays of wis_direct with the client's own BRDF as `target`.
    Target,
    /// The rays of wis_direct with the portals of the room.
    Portals,
    /// The same, where nothing comes from elsewhere.
    Complete,
    /// The rays of wis_direct with so many candidates for each.
    Few,
    /// One half of the rays from wis_direct for the light above its mean, one half from the BRDF for the rest.
    Split,
    /// Samples of the product.
    Product,
    /// Samples of the product and one of the BRDF, which a path tracer traces anyway, by the power heuristic: classic MIS.
    ProductMis,
    /// The rays that wis_direct of version 0.2 answers.
    Earlier,
}

impl Mode {
    /// What the report measures.
    pub const ALL: [Mode; 10] = [
        Mode::Direct,
        Mode::Shared,
        Mode::Target,
        Mode::Portals,
        Mode::Complete,
        Mode::Few,
        Mode::Split,
        Mode::Product,
        Mode::ProductMis,
        Mode::Earlier,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Mode::Direct => "direct",
            Mode::Shared => "direct, shared",
            Mode::Target => "direct, target",
            Mode::Portals => "direct, portals",
            Mode::Complete => "direct, complete portals",
            Mode::Few => "direct, 4 candidates",
            Mode::Split => "direct and BRDF",
            Mode::Product => "product",
            Mode::ProductMis => "product + MIS",
            Mode::Earlier => earlier::NAME,
        }
    }

    /// Whether the report has it: of a single hit, sharing is nothing of its own, nor is a target that is the lobes. Others are of rooms.
    pub fn differs(self, hits_share: bool, is_measured: bool) -> bool {
        match self {
            Mode::Shared => hits_share,
            Mode::Target => is_measured,
            Mode::Few | Mode::Split => false,
            _ => true,
        }
    }
}

/// What a thread keeps for the library between points.
pub struct Library {
    sampler: Rc<RefCell<environment::Sampler>>,
    shares: environment::Sampler,
    is_shared: bool,
    few: environment::Sampler,
    material: raw::wis_material,
    product: Block,
    /// Of version 0.2, with its material.
    earlier: Option<(environment::Sampler, raw::wis_material)>,
    rays: Vec<raw::wis_ray>,
}

/// Rays of a call to wis_direct at most.
const RAYS: usize = 64;
/// Candidates for a ray of [`Mode::Few`].
const FEW: usize = 4;

impl Library {
    /// # Errors
    /// Those of the library.
    pub fn new(setting: &Setting, hits: usize) -> client::Result<Library> {
        let sampler = Rc::new(RefCell::new(environment::Sampler::new(RAYS, 0, 0)?));
        let shares = environment::Sampler::new(RAYS, 0, hits)?;
        let few = environment::Sampler::new(RAYS, FEW, 0)?;
        let (product, rays, lobes) = (Block::new(0), Vec::new(), setting.material.lobes());
        let material = environment::material(&lobes)?;
        let earlier = earlier::version().map(|version| {
            let own = environment::Sampler::by(version, RAYS, 0, hits)?;
            client::Result::Ok((own, environment::material_by(version, &lobes)?))
        });
        let earlier = earlier.transpose()?;
        Ok(Library { sampler, shares, is_shared: hits > 1, few, material, product, earlier, rays })
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
        let Library { sampler: own, shares, is_shared, few, material, product, earlier, rays } = self;
        let mut at = setting.material.point(point, material);
        match mode {
            Mode::Product => {
                let density = Light::product(setting.tables, own, &at, product)?;
                return sampler.density(&density, setting, bsdf, n);
            }
            Mode::ProductMis => {
                let density = Light::product(setting.tables, own, &at, product)?;
                return sampler.density_mis(&density, power, setting, bsdf, [n, 1], false);
            }
            _ => (),
        }
        // A repeat has another seed, as another pixel has.
        (at.seed, at.sample) = (client::pixel_seed(point.pixel, pass), point.hit);
        let (mut alone, mut tables) = (own.borrow_mut(), setting.tables);
        let own = match mode {
            Mode::Shared => shares,
            Mode::Few => few,
            Mode::Earlier => {
                let (own, material) = earlier.as_mut().expect("a mode that is there");
                (at.material, tables) = (material, setting.earlier.expect("a light that is there"));
                own
            }
            _ => &mut *alone,
        };
        // Hits that share nothing need no beginning.
        if *is_shared && point.hit == 0 && matches!(mode, Mode::Shared | Mode::Earlier) {
            own.begin_pixel()?;
        }
        let mut portals;
        if let (Mode::Portals | Mode::Complete, Some(room)) = (mode, setting.room) {
            portals = [raw::wis_portal::default(); raw::WIS_MAX_PORTALS as usize];
            portals.iter_mut().zip(&room.portals).for_each(|(to, portal)| *to = portal.at(point.origin));
            (at.portals, at.portal_count) = (portals.as_ptr(), room.portals.len() as u32);
            at.flags |= if mode == Mode::Complete { raw::WIS_POINT_PORTALS_COMPLETE } else { 0 };
        }
        let [n, scattered] = if mode == Mode::Split { halves(n) } else { [n, 0] };
        at.flags |= if mode == Mode::Split { raw::WIS_POINT_COMPENSATED } else { 0 };
        rays.resize(n, Default::default());
        let mut weigh = |wi: &[[f32; 3]], f_cos: &mut [f32]| {
            setting.cost.evaluate(wi.len());
            bsdf.values(wi, f_cos);
            true
        };
        let target: Option<Brdf> = if mode == Mode::Target { Some(&mut weigh) } else { None };
        let count = own.direct(tables, &at, target, rays)?;
        // BRDF and radiance are evaluated for the rays alone, after the call: eight side by side.
        rays[..count].iter().for_each(|ray| sampler.batch.push_drawn(ray.wi, 1.0 / ray.weight));
        if mode == Mode::Split {
            sampler.split(setting, bsdf, scattered);
        } else {
            sampler.weighted(setting, bsdf);
        }
        Ok(())
    }
}

impl Sampler {
    /// Rays that have weights.
    fn weighted(&mut self, setting: &Setting, bsdf: &Bsdf) {
        self.reflect(setting, bsdf);
        self.batch.weigh_by_drawn(|_, density, _| density);
        self.take_all();
    }

    /// Rays that have weights bring the light above its mean, and so many samples of the BRDF the rest.
    fn split(&mut self, setting: &Setting, bsdf: &Bsdf, scattered: usize) {
        self.batch.from_bsdf(bsdf, scattered);
        self.reflect(setting, bsdf);
        self.batch.weigh_parts(setting.tables.info.mean as f32, scattered);
        self.take_all();
    }

    /// Samples of a density alone.
    ///
    /// # Errors
    /// Those of the library.
    pub fn density(&mut self, density: &dyn Density, setting: &Setting, bsdf: &Bsdf, n: usize) -> client::Result<()> {
        self.batch.from_density(density, n)?;
        self.reflect(setting, bsdf);
        self.batch.weigh_by_drawn(|_, pdf, _| pdf * F8::splat(n as f32));
        self.take_all();
        Ok(())
    }

    /// So many samples of a density and of the BRDF, by a heuristic. Where the density is all that counts, samples of the BRDF
    /// outside of it bring nothing.
    ///
    /// # Errors
    /// Those of the library.
    pub fn density_mis(
        &mut self,
        density: &dyn Density,
        heuristic: Heuristic,
        setting: &Setting,
        bsdf: &Bsdf,
        counts: [usize; 2],
        is_all: bool,
    ) -> client::Result<()> {
        self.batch.from_density(density, counts[0])?;
        self.batch.from_bsdf(bsdf, counts[1]);
        self.batch.ask(density)?;
        self.reflect(setting, bsdf);
        let weighed = of_two(counts, heuristic);
        self.batch.weigh_by_drawn(|first, density, bsdf| {
            let counts = if is_all { density.cmp_gt(F8::ZERO) } else { F8::ONE.cmp_gt(F8::ZERO) };
            counts & weighed(first, density, bsdf)
        });
        self.take_all();
        Ok(())
    }
}
