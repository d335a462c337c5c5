//! The working memory of one thread: its CPU level, its configuration, and room for candidates.

use super::Ray;
use super::candidates::{Counts, Draw, favour_portals, weigh_by};
use super::effort::Effort;
use super::group::Group;
use super::joint::Points;
pub use super::joint::Sequence;
use super::pick::{FLOOR, FLOOR_IN_THE_DARK, pick_rays};
use super::portals::Portals;
use super::shared::{self, Shared};
use crate::brdf::point::Point;
use crate::brdf::surface::Surface;
use crate::light::environment::Environment;
use crate::simd::{Compute, GROUP, Level, Num, compute};
use crate::sphere::Frame;
use crate::status::{Error, Status};
use crate::visibility::is_dark;
use bytemuck::{Pod, Zeroable};

/// The most rays of a call that a sampler can be made for.
pub const MAX_RAYS: usize = 4096;
/// The most rays of a point of a wave.
pub const WAVE_RAYS: usize = 64;
/// The most candidates per ray.
pub const MAX_PER_RAY: usize = 256;

/// What a sampler is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Config {
    /// The most rays of a call, 1 to [`MAX_RAYS`].
    pub rays: u32,
    /// Candidates for each ray; 0: the library's choice.
    pub candidates_per_ray: u32,
    /// First hits of a pixel between two calls of [`Sampler::begin_pixel`]; 0: not known.
    pub hits_per_pixel: u32,
    /// Always 0.
    pub reserved: u32,
}

impl Config {
    /// How many candidates a call has.
    fn effort(&self, rays: usize) -> Effort {
        let wanted = self.candidates_per_ray as usize;
        Effort { rays, wanted, compensated: false, targeted: false, portals: false, dark: false }
    }

    /// Whether a call for so many rays keeps a share of its picks for the light: where a pixel has four and more, in one call or over its hits, that is
    /// one of them. Of a single one it would be a chance, which adds to the variance what a lobe alone does not have.
    fn shares_out(&self, rays: usize) -> bool {
        const FEWEST: usize = 4;
        rays.saturating_mul(self.hits_per_pixel.max(1) as usize) >= FEWEST
    }

    /// Bytes of working memory.
    #[inline(never)]
    pub fn bytes(&self) -> usize {
        self.shared_bytes() + self.wave_bytes() + self.scratch_bytes()
    }

    /// Bytes of the rays of one point of a wave.
    fn wave_bytes(&self) -> usize {
        WAVE_RAYS.min(self.rays as usize) * size_of::<Ray>()
    }

    /// Bytes of what a call works in: candidates, or what a product is prepared with.
    fn scratch_bytes(&self) -> usize {
        let prepares = shared::is_worth(self.hits_per_pixel);
        let candidates = size_of::<Group>() / GROUP * self.effort(self.rays as usize).most();
        if prepares { candidates.max(shared::scratch_bytes()) } else { candidates }
    }

    /// Bytes of the products that hits share.
    #[inline]
    fn shared_bytes(&self) -> usize {
        if shared::is_worth(self.hits_per_pixel) { shared::bytes() } else { 0 }
    }
}

/// One thread's sampler.
#[derive(Debug)]
pub struct Sampler<'a> {
    level: Level,
    config: Config,
    shared: Option<Shared<'a>>,
    wave: &'a mut [Ray],
    scratch: &'a mut [f32],
}

impl<'a> Sampler<'a> {
    /// A sampler in memory of [`Config::bytes`], aligned to 16: zeros, or what a sampler of the same configuration left.
    pub fn new(level: Level, config: Config, memory: &'a mut [u8]) -> Option<Sampler<'a>> {
        Sampler::open(level, config, memory.get_mut(..config.bytes())?)
    }

    /// As [`Sampler::new`], in memory of exactly that length, which every call from C would have to find out again.
    #[inline]
    pub(crate) fn open(level: Level, config: Config, memory: &'a mut [u8]) -> Option<Sampler<'a>> {
        let (shared, rest) = memory.split_at_mut_checked(config.shared_bytes())?;
        let (wave, scratch) = rest.split_at_mut_checked(config.wave_bytes())?;
        let wave = bytemuck::try_cast_slice_mut(wave).ok()?;
        Some(Sampler {
            level,
            config,
            shared: Shared::new(shared),
            wave,
            scratch: bytemuck::try_cast_slice_mut(scratch).ok()?,
        })
    }

    /// The instructions that it uses.
    pub fn level(&self) -> Level {
        self.level
    }

    /// What it was made for.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The room for rays of a point of a wave, once: up to [`WAVE_RAYS`], and as many as the sampler was made for.
    pub fn take_wave(&mut self) -> &'a mut [Ray] {
        core::mem::take(&mut self.wave)
    }

    /// Forgets what hits of the last pixel shared.
    pub fn begin_pixel(&mut self) {
        if let Some(shared) = &mut self.shared {
            shared.clear();
        }
    }

    /// The rays to trace at a point: their number, at most `rays` and the room in `out`. A sampler that was made for fewer rays
    /// answers those.
    ///
    /// # Errors
    /// What is wrong with the point.
    #[inline(always)]
    pub fn direct(
        &mut self,
        environment: &Environment<'_>,
        point: &Point<'_>,
        at: Sequence,
        rays: usize,
        out: &mut [Ray],
    ) -> Result<usize, Error> {
        let rays = rays.min(self.config.rays as usize).min(out.len());
        if rays == 0 || !(environment.header().power > 0.0) {
            return check(environment, point).map(|_| 0);
        }
        let out = out.get_mut(..rays).unwrap_or_default();
        if point.portals.is_empty() && self.shared.is_none() {
            return self.rays(environment, point, at, out, None);
        }
        self.otherwise(environment, point, at, out)
    }

    /// As [`Sampler::direct`], where there are portals, or where hits share products.
    #[inline(never)]
    fn otherwise(
        &mut self,
        environment: &Environment<'_>,
        point: &Point<'_>,
        at: Sequence,
        out: &mut [Ray],
    ) -> Result<usize, Error> {
        if !point.portals.is_empty() {
            return self.through(environment, point, at, out);
        }
        let shares = self.shared.as_mut().filter(|_| shared::serves(environment, point, at.bounce));
        if let Some(shared) = shares
            && shared::is_wide(check(environment, point)?)
        {
            let points = Points::new::<f32>(at);
            if let Some(count) = shared.direct(self.level, environment, point, &points, self.scratch, out)? {
                return Ok(count);
            }
        }
        self.rays(environment, point, at, out, None)
    }

    /// As [`Sampler::rays`], of a point with portals.
    fn through(
        &mut self,
        environment: &Environment<'_>,
        point: &Point<'_>,
        at: Sequence,
        out: &mut [Ray],
    ) -> Result<usize, Error> {
        let portals = Portals::new(point, &environment.frame())?;
        match portals.is_empty() {
            true if portals.complete => check(environment, point).map(|_| 0),
            true => self.rays(environment, point, at, out, None),
            false => self.rays(environment, point, at, out, Some(&portals)),
        }
    }

    /// As many rays as there is room for, picked among candidates. Apart from the preparation, so that the two share the stack.
    #[inline(never)]
    fn rays(
        &mut self,
        environment: &Environment<'_>,
        point: &Point<'_>,
        at: Sequence,
        out: &mut [Ray],
        portals: Option<&Portals>,
    ) -> Result<usize, Error> {
        let Sampler { level, config, scratch, .. } = self;
        let frame = &environment.frame();
        let mut surface = Surface::empty();
        surface.set(point, frame)?;
        let surface = &surface;
        let (compensated, targeted) = (point.compensated, point.target.is_some());
        // Portals say where light comes from, and of a compensated light lamps alone are left.
        let dark = portals.is_none() && !compensated && point.seen.is_some_and(is_dark);
        let effort = Effort { compensated, targeted, portals: portals.is_some(), dark, ..config.effort(out.len()) };
        let counts = effort.counts(surface);
        let groups = scratch.get_mut(..counts.sum() * (size_of::<Group>() / GROUP / size_of::<f32>()));
        let groups: &mut [Group] = groups.and_then(|room| bytemuck::try_cast_slice_mut(room).ok()).unwrap_or_default();
        if let Some(portals) = portals {
            portals.enter(at, groups.get_mut((counts.light + counts.lobes) / GROUP..).unwrap_or_default());
        }
        let floor = if dark { FLOOR_IN_THE_DARK } else { FLOOR };
        // Portals share rays out by themselves; of a compensated light all candidates look for the same lamps.
        let shares = portals.is_none() && !compensated && config.shares_out(out.len());
        let shared = if shares { counts.light / GROUP } else { 0 };
        let trace = Trace { environment, point, surface, frame, counts, portals, at, groups, shared, floor, out };
        let picked = compute(*level, trace);
        picked.ok_or(Error::new(Status::CallbackFailed, 0).of(c"target"))
    }
}

/// The least alpha of lobes that scatter, or what is wrong with a point.
#[inline(never)]
fn check(environment: &Environment<'_>, point: &Point<'_>) -> Result<f32, Error> {
    Portals::new(point, &environment.frame())?;
    Surface::new(point, &environment.frame()).map(|surface| surface.least_alpha())
}

/// Draws candidates and picks rays among them: one function of a level, so that little goes from one to the other through memory.
struct Trace<'a> {
    environment: &'a Environment<'a>,
    point: &'a Point<'a>,
    surface: &'a Surface,
    frame: &'a Frame,
    counts: Counts,
    portals: Option<&'a Portals>,
    at: Sequence,
    groups: &'a mut [Group],
    /// Groups of the light that have a share of the picks.
    shared: usize,
    floor: f32,
    out: &'a mut [Ray],
}

impl Compute for Trace<'_> {
    type Output = Option<usize>;

    /// How many rays there are; `None` if the target failed.
    #[inline(always)]
    fn run<F: Num>(self) -> Option<usize> {
        let Trace { environment, point, surface, frame, counts, portals, at, groups, shared, floor, out } = self;
        let light = &environment.source();
        let (without_lobes, compensated, seen) = (point.target.is_some(), point.compensated, point.seen);
        let draw = Draw { light, surface, frame, counts, without_lobes, compensated, seen, portals };
        let points = Points::new::<F>(at);
        let sets = points.sets::<F>(counts.light);
        let fewer;
        let of_lobes = if counts.lobes == counts.light {
            &sets
        } else {
            fewer = points.sets::<F>(counts.lobes);
            &fewer
        };
        draw.fill::<F>([&sets, of_lobes], groups);
        if let Some(target) = point.target {
            weigh_by(groups, target, frame)?;
        }
        if portals.is_some() {
            favour_portals(groups);
        }
        Some(pick_rays::<F>(groups, shared, floor, sets.pick::<F>(), frame, out))
    }
}
