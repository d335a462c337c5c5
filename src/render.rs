//! What a renderer in Rust calls, all of it safe: a map, memory, and the densities of a sampler.

use crate::brdf::compare::Mistake;
use crate::direct::sampler::{Config, MAX_RAYS, Sampler};
use crate::light::batch::{pdfs, samples};
use crate::light::chart::Layout;
use crate::light::environment::{Environment, Size};
use crate::light::pixels::{Format, Pixels};
use crate::light::plan::{Description, Filter, Plan};
use crate::sample::Sample;
use crate::sphere::{Frame, unit};
use crate::status::{Error, Result, Status};
use bytemuck::{Pod, Zeroable};
use core::fmt;
#[cfg(feature = "checks")]
use {
    crate::brdf::compare::{self, Match},
    crate::brdf::point::Point,
    crate::light::compare::{Comparison, compare},
};

/// 64 bytes, aligned to 64: `vec![Block::ZERO; Block::count(bytes)]` is memory for any object.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Block([u8; 64]);

impl Block {
    /// Zeros.
    pub const ZERO: Block = Block([0; 64]);

    /// How many blocks hold so many bytes.
    pub const fn count(bytes: usize) -> usize {
        bytes.div_ceil(size_of::<Block>())
    }

    /// The bytes of blocks, to read an object from.
    pub fn bytes(blocks: &[Block]) -> &[u8] {
        bytemuck::cast_slice(blocks)
    }

    /// The bytes of blocks, to build an object in.
    pub fn bytes_mut(blocks: &mut [Block]) -> &mut [u8] {
        bytemuck::cast_slice_mut(blocks)
    }
}

/// An environment map of 32-bit floats, and how the renderer looks it up.
#[derive(Clone, Copy, Debug)]
pub struct Map<'p> {
    /// How directions lie on it.
    pub layout: Layout,
    /// Texels in a row, 1 to 32768.
    pub width: u32,
    /// Rows, 1 to 32768; of a cube map all six faces.
    pub height: u32,
    /// 1 (luminance), 3 (RGB) or 4 (RGB and an alpha that is ignored); linear Rec. 709 radiance. Negative channels count as 0: clamp
    /// your look-up at 0.
    pub channels: u32,
    /// Row by row, `width * height * channels` numbers.
    pub pixels: &'p [f32],
    /// How the renderer looks the map up.
    pub filter: Filter,
    /// Lat-long only: the first and the last row of texels lie at the poles.
    pub rows_at_poles: bool,
    /// Black texels get the density 0; otherwise no texel counts as darker than 2^-16 of the mean.
    pub exact_zero: bool,
    /// Proportional to max(L - mean, L / 64) (Karlik et al. 2019), for multiple importance sampling with BRDF samples.
    pub compensated: bool,
    /// No products will be prepared with it: 21 kB less.
    pub light_only: bool,
    /// Only rays will be drawn with it, which read less than half of it: a map of 1024 x 512 takes 1.3 MB and half the time.
    pub rays_only: bool,
    /// The relative standard deviation of radiance / pdf that coarser tables may add, 0 to 1; 0 keeps every texel.
    pub error_budget: f32,
    /// NaN and -Inf count as 0 and +Inf as 65504 instead of being rejected.
    pub sanitise: bool,
    /// Negative channels count by their size instead of as 0, for renderers that do not clamp their look-up at 0.
    pub absolute: bool,
    /// A row-major 3x3 rotation or reflection, world = M map, within 1e-4.
    pub world_from_map: [f32; 9],
}

impl<'p> Map<'p> {
    /// A lat-long map, +z up, that the renderer looks up bilinearly.
    pub fn latlong(width: u32, height: u32, channels: u32, pixels: &'p [f32]) -> Map<'p> {
        Map {
            layout: Layout::LatLong,
            width,
            height,
            channels,
            pixels,
            filter: Filter::Bilinear,
            rows_at_poles: false,
            exact_zero: false,
            compensated: false,
            light_only: false,
            rays_only: false,
            error_budget: 0.0,
            sanitise: false,
            absolute: false,
            world_from_map: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        }
    }

    fn plan(&self) -> Result<Plan> {
        let of = Description {
            layout: self.layout,
            width: self.width,
            height: self.height,
            filter: self.filter,
            rows_at_poles: self.rows_at_poles,
            exact_zero: self.exact_zero,
            compensated: self.compensated,
            light_only: self.light_only,
            rays_only: self.rays_only,
            budget: self.error_budget,
        };
        Plan::new(&of.as_read()).map_err(|error| error.status)
    }

    /// What a build takes: bytes of the environment, exactly without an error budget and at most with one, and of scratch memory.
    ///
    /// # Errors
    /// [`Status::InvalidArgument`] for a field out of its range, [`Status::Overflow`] for a map that is too large.
    pub fn size(&self) -> Result<Size> {
        self.plan()?.size()
    }

    /// Builds the environment in `memory`; `scratch` may be freed afterwards. Sizes are those of [`Map::size`].
    ///
    /// # Errors
    /// [`Error`] tells which texel is NaN or infinite, how many bytes are needed, or what else is wrong.
    pub fn build_in<'a>(
        &self,
        memory: &'a mut [Block],
        scratch: &mut [Block],
    ) -> core::result::Result<Environment<'a>, Error> {
        let frame = Frame::new(&self.world_from_map).ok_or(Status::InvalidTransform)?;
        let plan = self.plan()?;
        let length = (self.width as usize).checked_mul(self.channels as usize).ok_or(Status::Overflow)?;
        if !matches!(self.channels, 1 | 3 | 4) || Some(self.pixels.len()) != length.checked_mul(self.height as usize) {
            return Err(Status::InvalidArgument.into());
        }
        let &Map { channels, sanitise, absolute, .. } = self;
        let pixels = Pixels { channels, format: Format::F32, sanitise, absolute };
        let row = |y: u32| {
            let first = y as usize * length;
            self.pixels.get(first..first + length).map(bytemuck::cast_slice)
        };
        Environment::build_in(&plan, &pixels, &frame, &row, Block::bytes_mut(memory), Block::bytes_mut(scratch))
    }
}

impl Config {
    /// A sampler for calls of at most so many rays, with the library's choice for everything else.
    pub fn for_rays(rays: u32) -> Config {
        Config { rays: rays.clamp(1, MAX_RAYS as u32), candidates_per_ray: 0, hits_per_pixel: 0, reserved: 0 }
    }
}

/// The light alone, for renderers that combine techniques themselves.
impl Sampler<'_> {
    /// Draws directions in proportion to the light, one for each `u`, as many as there is room for. A pdf of 0 means that the
    /// light is black.
    ///
    /// # Errors
    /// [`Status::NotBuilt`] if the environment was built for rays alone.
    pub fn sample(&self, environment: &Environment<'_>, u: &[[f32; 2]], out: &mut [Sample]) -> Result<()> {
        samples(self.level(), &environment.exact()?.tables(), &environment.frame(), u, out);
        Ok(())
    }

    /// The pdf of directions in the light, per steradian: the very bits of [`Sampler::sample`]. 0 for directions that are not of
    /// unit length within 1e-3.
    ///
    /// # Errors
    /// As [`Sampler::sample`].
    pub fn pdf(&self, environment: &Environment<'_>, wi: &[[f32; 3]], out: &mut [f32]) -> Result<()> {
        pdfs(self.level(), &environment.exact()?.tables(), &environment.frame(), wi, out);
        Ok(())
    }

    /// Compares the renderer's radiance with an environment and names the likely mistake: wrong axes, a wrong filter and the like.
    /// `radiance` gives the linear RGB that the renderer sees from a world direction; it is called 256 times. Costs 1 to 5 ms
    /// besides.
    ///
    /// # Errors
    /// [`Status::CallbackFailed`] for a radiance that is NaN, infinite or negative; as [`Sampler::sample`].
    #[cfg(feature = "checks")]
    pub fn check(
        &self,
        environment: &Environment<'_>,
        mut radiance: impl FnMut([f32; 3]) -> [f32; 3],
    ) -> Result<Comparison> {
        let mut all = |wi: &[[f32; 3]], rgb: &mut [[f32; 3]]| {
            for (out, wi) in rgb.iter_mut().zip(wi) {
                *out = radiance(*wi);
            }
            true
        };
        compare(environment.exact()?, &mut all).map_err(|_| Status::CallbackFailed)
    }

    /// Compares the renderer's BSDF with the lobes of a point and names the likely mistake: a wo that is flipped, roughness for alpha, a
    /// cosine too many and the like. `f_cos` gives the luminance of BSDF x |cosine| for a world direction; it is called 200 times, also
    /// below the surface. Costs 0.1 to 2 ms besides. `target` of the point is not read.
    ///
    /// # Errors
    /// What is wrong with the point; [`Status::CallbackFailed`] for a value that is NaN, infinite or negative.
    #[cfg(feature = "checks")]
    pub fn check_point(
        &self,
        environment: &Environment<'_>,
        point: &Point<'_>,
        mut f_cos: impl FnMut([f32; 3]) -> f32,
    ) -> core::result::Result<Match, Error> {
        let mut all = |wi: &[[f32; 3]], out: &mut [f32]| {
            for (out, wi) in out.iter_mut().zip(wi) {
                *out = f_cos(*wi);
            }
            true
        };
        compare::compare(point, &environment.frame(), &mut all)
    }

    /// The `u` that leads to a direction.
    ///
    /// # Errors
    /// [`Status::InvalidTransform`] for a direction that is not of unit length, [`Status::ZeroDensity`] where nothing leads
    /// there, [`Status::Unreachable`] where no u of 24 bits does; as [`Sampler::sample`].
    pub fn invert(&self, environment: &Environment<'_>, wi: [f32; 3]) -> Result<[f32; 2]> {
        unit(wi).ok_or(Status::InvalidTransform)?;
        environment.exact()?.tables().invert(&environment.frame(), wi).numbers()
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.message().to_str().unwrap_or("unknown status"))
    }
}

impl core::error::Error for Status {}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.message().to_str().unwrap_or("unknown mistake"))
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let &Error { status, field, x, y, bytes, .. } = self;
        if let Some(field) = field {
            write!(f, "{}: ", field.to_str().unwrap_or_default())?;
        }
        status.fmt(f)?;
        match status {
            Status::InvalidTexel => write!(f, " (column {x}, row {y})"),
            Status::MemoryTooSmall => write!(f, " ({bytes} bytes are needed)"),
            _ => Ok(()),
        }
    }
}

impl core::error::Error for Error {}
