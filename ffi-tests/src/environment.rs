//! The light in small tables and the calls that take a sampler: a Rust client of the C functions wis_environment_*,
//! wis_product_*, wis_sample, wis_pdf, wis_invert and wis_direct, of the current version or of an earlier one.

pub use crate::client::Map;
use crate::client::{self, Block, Brdf, Density, Result, answered, brdf_batch, check, raw, sized, told};
use std::cell::RefCell;
use std::ffi::c_void;
use std::ptr::{null, null_mut};
use std::rc::Rc;

type Void = *mut c_void;
type Own = *mut raw::wis_sampler;
type Tables = *const raw::wis_environment;
type Product = *const raw::wis_product;
type Told = *mut raw::wis_diagnostic;
type Asked = *mut raw::wis_memory_size;
pub type Direct =
    unsafe extern "C" fn(Own, Tables, *const raw::wis_point, u32, *mut raw::wis_ray, *mut u32) -> raw::wis_status;

macro_rules! version {
    ($($name:ident: fn($($argument:ty),*);)*) => {
        /// The functions of a version of the library whose structs are the current ones, but for the length of a point.
        pub struct Version {
            /// Bytes of a point.
            pub point: usize,
            pub wis_direct: Direct,
            $($name: unsafe extern "C" fn($($argument),*) -> raw::wis_status,)*
        }

        /// The library that is linked.
        pub static CURRENT: Version =
            Version { point: size_of::<raw::wis_point>(), wis_direct: raw::wis_direct, $($name: raw::$name,)* };

        impl Version {
            /// # Safety
            /// The functions of the library have these types, and it stays loaded.
            pub unsafe fn load(
                library: &libloading::os::unix::Library,
                point: usize,
                wis_direct: Direct,
            ) -> std::result::Result<Version, libloading::Error> {
                // SAFETY: the caller's contract.
                Ok(Version { point, wis_direct, $($name: unsafe { *library.get(stringify!($name).as_bytes())? },)* })
            }
        }
    };
}

version! {
    wis_environment_size: fn(*const raw::wis_environment_config, Asked, Told);
    wis_environment_init: fn(*const raw::wis_environment_config, Void, usize, Void, usize, *mut Tables, Told);
    wis_environment_describe: fn(Tables, *mut raw::wis_environment_info);
    wis_sampler_size: fn(*const raw::wis_sampler_config, Asked, Told);
    wis_sampler_init: fn(*const raw::wis_sampler_config, Void, usize, *mut Own, Told);
    wis_sampler_begin_pixel: fn(Own);
    wis_material_init: fn(*mut raw::wis_material, Told);
    wis_product_size: fn(*const raw::wis_product_config, Asked, Told);
    wis_product_prepare: fn(Own, Tables, *const raw::wis_product_config, usize, *const raw::wis_point, Void, usize, *mut usize, *mut usize);
    wis_sample: fn(Own, Tables, Product, usize, *const f32, usize, *mut raw::wis_drawn, usize);
    wis_pdf: fn(Own, Tables, Product, usize, *const f32, usize, *mut f32, usize);
}

/// An environment and its memory.
#[derive(Clone)]
pub struct Environment {
    version: &'static Version,
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
        Environment::by(&CURRENT, map)
    }

    /// Builds a map by a version.
    ///
    /// # Errors
    /// Those of the library.
    pub fn by(version: &'static Version, map: &Map) -> Result<Environment> {
        // SAFETY: every pointer is to a live local.
        let size = client::size(|size, told| unsafe { (version.wis_environment_size)(&map.config(), size, told) })?;
        Environment::built(version, map, Block::new(size.bytes), &mut Block::new(size.scratch_bytes))
    }

    /// Builds a map in memory that is there.
    ///
    /// # Errors
    /// Those of the library.
    pub fn new_in(map: &Map, memory: Block, scratch: &mut Block) -> Result<Environment> {
        Environment::built(&CURRENT, map, memory, scratch)
    }

    fn built(version: &'static Version, map: &Map, mut memory: Block, scratch: &mut Block) -> Result<Environment> {
        let (config, mut handle) = (map.config(), null());
        // SAFETY: the blocks are as long as they say, and the texels live as long as the map.
        told(|diagnostic| unsafe {
            let (place, bytes) = (memory.start_mut(), memory.bytes());
            let (work, room) = (scratch.start_mut(), scratch.bytes());
            (version.wis_environment_init)(&config, place, bytes, work, room, &mut handle, diagnostic)
        })?;
        let info = sized!(wis_environment_info {});
        // SAFETY: the handle is that of a finished environment.
        let info = answered(info, |info| unsafe { (version.wis_environment_describe)(handle, info) })?;
        memory.shorten(info.bytes as usize);
        Ok(Environment { version, memory, info })
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

/// One thread's sampler and its memory.
pub struct Sampler {
    version: &'static Version,
    memory: Block,
}

impl Sampler {
    /// For at most so many rays a call; 0 candidates for each leave their number to the library.
    ///
    /// # Errors
    /// Those of the library.
    pub fn new(rays: usize, candidates_per_ray: usize, hits_per_pixel: usize) -> Result<Sampler> {
        Sampler::by(&CURRENT, rays, candidates_per_ray, hits_per_pixel)
    }

    /// The same by a version.
    ///
    /// # Errors
    /// Those of the library.
    pub fn by(version: &'static Version, rays: usize, candidates: usize, hits: usize) -> Result<Sampler> {
        let [rays, candidates_per_ray, hits_per_pixel] = [rays, candidates, hits].map(|n| n as u32);
        let config = sized!(wis_sampler_config { rays, candidates_per_ray, hits_per_pixel });
        let mut handle = null_mut();
        // SAFETY: every pointer is to a live local, and the block is as long as it says.
        let memory = client::built(
            |size, diagnostic| unsafe { (version.wis_sampler_size)(&config, size, diagnostic) },
            |place, bytes, _, _, diagnostic| unsafe {
                (version.wis_sampler_init)(&config, place, bytes, &mut handle, diagnostic)
            },
        )?;
        Ok(Sampler { version, memory })
    }

    fn handle(&mut self) -> Own {
        self.memory.start_mut().cast()
    }

    /// What comes next belongs to another pixel.
    ///
    /// # Errors
    /// Those of the library.
    pub fn begin_pixel(&mut self) -> Result<()> {
        // SAFETY: the handle is alive.
        check(unsafe { (self.version.wis_sampler_begin_pixel)(self.handle()) })
    }

    /// Writes the rays to trace at a point and answers how many there are. Candidates are weighed by the `target` if there is one.
    ///
    /// # Errors
    /// Those of the library.
    pub fn direct(
        &mut self,
        environment: &Environment,
        point: &raw::wis_point,
        target: Option<Brdf>,
        ray: &mut [raw::wis_ray],
    ) -> Result<usize> {
        let mut count = 0;
        self.direct_into(environment, point, target, ray, &mut count)?;
        Ok(count as usize)
    }

    /// The same for a look at what a call that fails writes.
    ///
    /// # Errors
    /// Those of the library.
    pub fn direct_into(
        &mut self,
        environment: &Environment,
        point: &raw::wis_point,
        mut target: Option<Brdf>,
        ray: &mut [raw::wis_ray],
        count: &mut u32,
    ) -> Result<()> {
        let mut point = raw::wis_point { size: self.version.point as u32, ..*point };
        if let Some(brdf) = &mut target {
            point.target = Some(brdf_batch);
            point.target_user = std::ptr::from_mut(brdf).cast();
        }
        let (own, rays, out) = (self.handle(), ray.len() as u32, ray.as_mut_ptr());
        // SAFETY: handles, point, BRDF and material are alive, and there is room for the rays.
        check(unsafe { (self.version.wis_direct)(own, environment.handle(), &point, rays, out, count) })
    }

    /// Prepares the product at a point, in memory that is as long as it must be, or has no bytes yet.
    ///
    /// # Errors
    /// Those of the library.
    pub fn prepare(
        &mut self,
        environment: &Environment,
        config: &raw::wis_product_config,
        point: &raw::wis_point,
        memory: &mut Block,
    ) -> Result<()> {
        let (version, own, mut offset, mut used) = (self.version, self.handle(), 0, 0);
        // Asked for once: a renderer does so before it renders.
        if memory.bytes() == 0 {
            memory.grow(product_bytes(version, config)?);
        }
        let point = raw::wis_point { size: version.point as u32, ..*point };
        let (light, place, bytes) = (environment.handle(), memory.start_mut(), memory.bytes());
        // SAFETY: handles, point and material are alive, and there is room for a product.
        check(unsafe {
            (version.wis_product_prepare)(own, light, config, 1, &point, place, bytes, &mut offset, &mut used)
        })
    }
}

/// How products are prepared by default.
pub fn product_config() -> raw::wis_product_config {
    sized!(wis_product_config {})
}

/// The most bytes that a product takes.
///
/// # Errors
/// Those of the library.
pub fn product_bytes(version: &Version, config: &raw::wis_product_config) -> Result<usize> {
    // SAFETY: the pointers are to live values.
    Ok(client::size(|size, diagnostic| unsafe { (version.wis_product_size)(config, size, diagnostic) })?.bytes)
}

/// The light of an environment, or its product with the BRDF at a point, as a density, with the sampler of a thread.
pub struct Light<'a> {
    environment: &'a Environment,
    sampler: Rc<RefCell<Sampler>>,
    product: Product,
}

impl<'a> Light<'a> {
    /// The light, with a sampler of its own.
    ///
    /// # Errors
    /// Those of the library.
    pub fn new(environment: &'a Environment) -> Result<Light<'a>> {
        let sampler = Rc::new(RefCell::new(Sampler::by(environment.version, 1, 0, 0)?));
        Ok(Light { environment, sampler, product: null() })
    }

    /// The product at a point, in memory that grows as it must.
    ///
    /// # Errors
    /// Those of the library.
    pub fn product(
        environment: &'a Environment,
        sampler: &Rc<RefCell<Sampler>>,
        point: &raw::wis_point,
        memory: &'a mut Block,
    ) -> Result<Light<'a>> {
        sampler.borrow_mut().prepare(environment, &product_config(), point, memory)?;
        Ok(Light { environment, sampler: sampler.clone(), product: memory.start().cast() })
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

impl Density for Light<'_> {
    fn sample_n(&self, u: &[[f32; 2]], drawn: &mut [raw::wis_drawn]) -> Result<()> {
        assert!(u.len() == drawn.len());
        let (mut sampler, count, numbers) = (self.sampler.borrow_mut(), u.len(), u.as_ptr().cast());
        let (own, environment, out) = (sampler.handle(), self.environment.handle(), drawn.as_mut_ptr());
        // SAFETY: both handles are alive, and the arrays are of one length.
        check(unsafe {
            (self.environment.version.wis_sample)(own, environment, self.product, count, numbers, 0, out, 0)
        })
    }

    fn pdf_n(&self, wi: &[[f32; 3]], pdf: &mut [f32]) -> Result<()> {
        assert!(wi.len() == pdf.len());
        let mut sampler = self.sampler.borrow_mut();
        // SAFETY: both handles are alive, and the arrays are of one length.
        check(unsafe {
            let (environment, directions) = (self.environment.handle(), wi.as_ptr().cast());
            (self.environment.version.wis_pdf)(
                sampler.handle(),
                environment,
                self.product,
                wi.len(),
                directions,
                0,
                pdf.as_mut_ptr(),
                0,
            )
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
    material_by(&CURRENT, lobes)
}

/// The same by a version.
///
/// # Errors
/// Those of the library.
pub fn material_by(version: &'static Version, lobes: &[raw::wis_lobe]) -> Result<raw::wis_material> {
    let mut material = sized!(wis_material { lobe_count: lobes.len() as u32 });
    material.lobe[..lobes.len()].copy_from_slice(lobes);
    // SAFETY: both pointers are to live locals.
    told(|diagnostic| unsafe { (version.wis_material_init)(&mut material, diagnostic) })?;
    Ok(material)
}
