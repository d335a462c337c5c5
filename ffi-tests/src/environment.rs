//! The light in small tables and the calls that take a sampler: a Rust client of the C functions wis_environment_*,
//! wis_product_*, wis_sample, wis_pdf, wis_invert and wis_direct.

pub use crate::client::Map;
use crate::client::{self, Block, Brdf, Density, Result, answered, brdf_batch, check, raw, sized, told};
use std::cell::RefCell;
use std::ffi::c_void;
use std::ptr::{null, null_mut};

/// An environment and its memory.
#[derive(Clone)]
pub struct Environment {
    memory: Block,
    /// What was built.
    pub info: raw::wis_environment_info,
}

impl Environment {
    /// The bytes that a map needs.
    ///
    /// # Errors
    /// Those of the library.
    pub fn size(map: &Map) -> Result<raw::wis_memory_size> {
        // SAFETY: every pointer is to a live local.
        client::size(|size, diagnostic| unsafe { raw::wis_environment_size(&map.config(), size, diagnostic) })
    }

    /// Builds a map.
    ///
    /// # Errors
    /// Those of the library.
    pub fn new(map: &Map) -> Result<Environment> {
        let size = Environment::size(map)?;
        Environment::new_in(map, Block::new(size.bytes), &mut Block::new(size.scratch_bytes))
    }

    /// Builds a map in memory that is there.
    ///
    /// # Errors
    /// Those of the library.
    pub fn new_in(map: &Map, mut memory: Block, scratch: &mut Block) -> Result<Environment> {
        let (config, mut handle) = (map.config(), null());
        // SAFETY: the blocks are as long as they say, and the texels live as long as the map.
        told(|diagnostic| unsafe {
            let (place, bytes) = (memory.start_mut(), memory.bytes());
            let (work, room) = (scratch.start_mut(), scratch.bytes());
            raw::wis_environment_init(&config, place, bytes, work, room, &mut handle, diagnostic)
        })?;
        let info = sized!(wis_environment_info {});
        // SAFETY: the handle is that of a finished environment.
        let info = answered(info, |info| unsafe { raw::wis_environment_describe(handle, info) })?;
        memory.shorten(info.bytes as usize);
        Ok(Environment { memory, info })
    }

    /// What was built.
    pub fn bytes(&self) -> &[u8] {
        // SAFETY: as many bytes as the block has.
        unsafe { std::slice::from_raw_parts(self.memory.start().cast(), self.info.bytes as usize) }
    }

    /// The handle, for raw calls.
    pub fn handle(&self) -> *const raw::wis_environment {
        self.memory.start().cast()
    }
}

/// Where the loop in C hands over each ray.
#[repr(C)]
struct Reflected {
    add: unsafe extern "C" fn(*mut c_void, *const f32, f32),
    client: *mut c_void,
}

unsafe extern "C" {
    /// `direct_light` of c-examples/direct.h, as direct.c compiles it.
    fn harness_direct_light(
        sampler: *mut raw::wis_sampler,
        environment: *const raw::wis_environment,
        point: *const raw::wis_point,
        rays: u32,
        ray: *mut raw::wis_ray,
        sum: *mut Reflected,
    ) -> raw::wis_status;
}

/// What the loop calls for a function of Rust. A panic in it ends the program.
///
/// # Safety
/// `client` is the address of an `F` that is alive and not in use; `wi` has three elements.
unsafe extern "C" fn add_ray<F: FnMut([f32; 3], f32)>(client: *mut c_void, wi: *const f32, weight: f32) {
    // SAFETY: direct_light names the type and gives the address of its own function; the loop gives a ray that was written.
    let (add, wi) = unsafe { (&mut *client.cast::<F>(), *wi.cast::<[f32; 3]>()) };
    add(wi, weight);
}

/// One thread's sampler and its memory.
pub struct Sampler {
    memory: Block,
}

impl Sampler {
    /// For at most so many rays a call; 0 candidates for each leave their number to the library.
    ///
    /// # Errors
    /// Those of the library.
    pub fn new(rays: usize, candidates_per_ray: usize, hits_per_pixel: usize) -> Result<Sampler> {
        let [rays, candidates_per_ray, hits_per_pixel] = [rays, candidates_per_ray, hits_per_pixel].map(|n| n as u32);
        let config = sized!(wis_sampler_config { rays, candidates_per_ray, hits_per_pixel });
        let mut handle = null_mut();
        // SAFETY: every pointer is to a live local, and the block is as long as it says.
        let memory = client::built(
            |size, diagnostic| unsafe { raw::wis_sampler_size(&config, size, diagnostic) },
            |place, bytes, _, _, diagnostic| unsafe {
                raw::wis_sampler_init(&config, place, bytes, &mut handle, diagnostic)
            },
        )?;
        Ok(Sampler { memory })
    }

    fn handle(&mut self) -> *mut raw::wis_sampler {
        self.memory.start_mut().cast()
    }

    /// What comes next belongs to another pixel.
    ///
    /// # Errors
    /// Those of the library.
    pub fn begin_pixel(&mut self) -> Result<()> {
        // SAFETY: the handle is alive.
        check(unsafe { raw::wis_sampler_begin_pixel(self.handle()) })
    }

    /// The README's loop: writes the rays to trace at a point and adds each with its weight. Candidates are weighed by the
    /// `target` if there is one.
    ///
    /// # Errors
    /// Those of the library.
    pub fn direct_light<F: FnMut([f32; 3], f32)>(
        &mut self,
        environment: &Environment,
        point: &raw::wis_point,
        mut target: Option<Brdf>,
        ray: &mut [raw::wis_ray],
        mut add: F,
    ) -> Result<()> {
        let point = aimed(point, &mut target);
        let mut sum = Reflected { add: add_ray::<F>, client: std::ptr::from_mut(&mut add).cast() };
        // SAFETY: handles, material, BRDF and `add` are alive, and there is room for each ray.
        check(unsafe {
            let (rays, out) = (ray.len() as u32, ray.as_mut_ptr());
            harness_direct_light(self.handle(), environment.handle(), &point, rays, out, &mut sum)
        })
    }

    /// [`Sampler::direct_light`] for the rays alone: answers how many there are.
    ///
    /// # Errors
    /// Those of the library.
    pub fn direct(
        &mut self,
        environment: &Environment,
        point: &raw::wis_point,
        ray: &mut [raw::wis_ray],
    ) -> Result<usize> {
        let mut count = 0;
        self.direct_light(environment, point, None, ray, |_, _| count += 1)?;
        Ok(count)
    }

    /// [`Sampler::direct_by`], or [`Sampler::direct`] without a BRDF, for a look at what a call that fails writes.
    ///
    /// # Errors
    /// Those of the library.
    pub fn direct_into(
        &mut self,
        environment: &Environment,
        point: &raw::wis_point,
        mut brdf: Option<Brdf>,
        ray: &mut [raw::wis_ray],
        count: &mut u32,
    ) -> Result<()> {
        let point = aimed(point, &mut brdf);
        // SAFETY: handles, point, BRDF and material are alive, and there is room for the rays.
        check(unsafe {
            let (rays, out) = (ray.len() as u32, ray.as_mut_ptr());
            raw::wis_direct(self.handle(), environment.handle(), &point, rays, out, count)
        })
    }

    /// [`Sampler::direct`] with candidates that are weighed by a BRDF of the caller's own.
    ///
    /// # Errors
    /// Those of the library.
    pub fn direct_by(
        &mut self,
        environment: &Environment,
        point: &raw::wis_point,
        brdf: Brdf,
        ray: &mut [raw::wis_ray],
    ) -> Result<usize> {
        let mut count = 0;
        self.direct_light(environment, point, Some(brdf), ray, |_, _| count += 1)?;
        Ok(count)
    }

    /// Prepares products at points, in memory that grows as it must; writes where each begins and answers the bytes of all.
    ///
    /// # Errors
    /// Those of the library.
    pub fn prepare(
        &mut self,
        environment: &Environment,
        config: &raw::wis_product_config,
        points: &[raw::wis_point],
        memory: &mut Block,
        offset: &mut [usize],
    ) -> Result<usize> {
        assert!(offset.len() == points.len());
        let most = points.len() * product_bytes(config)?;
        memory.grow(most);
        let (mut used, count) = (0, points.len());
        // SAFETY: handles, points and materials are alive, and there is room for as many products.
        check(unsafe {
            let (environment, point, offset) = (environment.handle(), points.as_ptr(), offset.as_mut_ptr());
            let (memory, bytes) = (memory.start_mut(), memory.bytes());
            let own = self.handle();
            raw::wis_product_prepare(own, environment, config, count, point, memory, bytes, offset, &mut used)
        })?;
        Ok(used)
    }
}

/// A point whose target is a BRDF, if there is one.
fn aimed(point: &raw::wis_point, target: &mut Option<Brdf>) -> raw::wis_point {
    let Some(brdf) = target else { return *point };
    raw::wis_point { target: Some(brdf_batch), target_user: std::ptr::from_mut(brdf).cast(), ..*point }
}

/// How products are prepared by default.
pub fn product_config() -> raw::wis_product_config {
    sized!(wis_product_config {})
}

/// The most bytes that a product takes.
///
/// # Errors
/// Those of the library.
pub fn product_bytes(config: &raw::wis_product_config) -> Result<usize> {
    // SAFETY: the pointers are to live values.
    Ok(client::size(|size, diagnostic| unsafe { raw::wis_product_size(config, size, diagnostic) })?.bytes)
}

/// The light of an environment, or its product with the BRDF at a point, as a density, with the sampler of a thread.
pub struct Light<'a> {
    environment: &'a Environment,
    sampler: &'a RefCell<Sampler>,
    product: *const raw::wis_product,
}

impl<'a> Light<'a> {
    pub fn new(environment: &'a Environment, sampler: &'a RefCell<Sampler>) -> Light<'a> {
        Light { environment, sampler, product: null() }
    }

    /// The product at a point, in memory that grows as it must.
    ///
    /// # Errors
    /// Those of the library.
    pub fn product(
        environment: &'a Environment,
        sampler: &'a RefCell<Sampler>,
        point: &raw::wis_point,
        memory: &'a mut Block,
    ) -> Result<Light<'a>> {
        let points = std::slice::from_ref(point);
        sampler.borrow_mut().prepare(environment, &product_config(), points, memory, &mut [0])?;
        Ok(Light::prepared(environment, sampler, memory))
    }

    /// A product that stands in memory already.
    pub fn prepared(environment: &'a Environment, sampler: &'a RefCell<Sampler>, memory: &'a Block) -> Light<'a> {
        assert!(memory.bytes() > 0);
        Light { environment, sampler, product: memory.start().cast() }
    }

    /// Whether a product serves another point well.
    ///
    /// # Errors
    /// Those of the library.
    pub fn covers(&self, point: &raw::wis_point) -> Result<bool> {
        // SAFETY: product, point and material are alive.
        Ok(answered(0, |covers| unsafe { raw::wis_product_covers(self.product, point, covers) })? != 0)
    }

    /// What was prepared, of a product.
    ///
    /// # Errors
    /// Those of the library.
    pub fn describe(&self) -> Result<raw::wis_product_info> {
        let (info, environment) = (sized!(wis_product_info {}), self.environment.handle());
        // SAFETY: environment and product are alive.
        answered(info, |info| unsafe { raw::wis_product_describe(environment, self.product, info) })
    }
}

/// Samples of one call.
const TOGETHER: usize = 64;

impl Light<'_> {
    fn draw(&self, u: &[[f32; 2]], drawn: &mut [raw::wis_drawn]) -> Result<()> {
        assert!(u.len() == drawn.len());
        let mut sampler = self.sampler.borrow_mut();
        // SAFETY: both handles are alive, and the arrays are of one length.
        check(unsafe {
            let (environment, numbers) = (self.environment.handle(), u.as_ptr().cast());
            raw::wis_sample(sampler.handle(), environment, self.product, u.len(), numbers, 0, drawn.as_mut_ptr(), 0)
        })
    }
}

impl Density for Light<'_> {
    fn sample(&self, u: [f32; 2]) -> Result<raw::wis_drawn> {
        let mut drawn = raw::wis_drawn::default();
        self.draw(&[u], std::slice::from_mut(&mut drawn))?;
        Ok(drawn)
    }

    fn sample_n(&self, u: &[[f32; 2]], wi: &mut [[f32; 3]], pdf: &mut [f32]) -> Result<()> {
        assert!(u.len() == wi.len() && u.len() == pdf.len());
        // No heap: what a client allocates for a call would count as the call's time.
        let mut room = [raw::wis_drawn::default(); TOGETHER];
        for ((u, wi), pdf) in u.chunks(TOGETHER).zip(wi.chunks_mut(TOGETHER)).zip(pdf.chunks_mut(TOGETHER)) {
            let drawn = &mut room[..u.len()];
            self.draw(u, drawn)?;
            for ((wi, pdf), drawn) in wi.iter_mut().zip(pdf).zip(drawn) {
                (*wi, *pdf) = (drawn.wi, drawn.pdf);
            }
        }
        Ok(())
    }

    fn pdf_n(&self, wi: &[[f32; 3]], pdf: &mut [f32]) -> Result<()> {
        assert!(wi.len() == pdf.len());
        let mut sampler = self.sampler.borrow_mut();
        // SAFETY: both handles are alive, and the arrays are of one length.
        check(unsafe {
            let (environment, directions) = (self.environment.handle(), wi.as_ptr().cast());
            raw::wis_pdf(sampler.handle(), environment, self.product, wi.len(), directions, 0, pdf.as_mut_ptr(), 0)
        })
    }

    fn invert(&self, wi: [f32; 3]) -> Result<[f32; 2]> {
        let (mut sampler, mut u, mut status) = (self.sampler.borrow_mut(), [f32::NAN; 2], 0);
        // SAFETY: both handles are alive, and the arrays hold an element.
        check(unsafe {
            let (own, environment, u) = (sampler.handle(), self.environment.handle(), u.as_mut_ptr());
            raw::wis_invert(own, environment, self.product, 1, wi.as_ptr(), 0, u, 0, &mut status)
        })?;
        check(raw::wis_status::from(status)).map(|()| u)
    }
}

/// A material of lobes.
///
/// # Errors
/// Those of the library.
pub fn material(lobes: &[raw::wis_lobe]) -> Result<raw::wis_material> {
    let mut material = sized!(wis_material { lobe_count: lobes.len() as u32 });
    material.lobe[..lobes.len()].copy_from_slice(lobes);
    // SAFETY: both pointers are to live locals.
    told(|diagnostic| unsafe { raw::wis_material_init(&mut material, diagnostic) })?;
    Ok(material)
}
