//! Version 0.2 of the library beside the current one, in one process: the shared library that scripts/earlier.sh built from the history,
//! if it is there. Its structs are the current ones, or begin them.

use crate::client::{Block, Result, built, check, raw, size, sized};
use crate::environment::Map;
use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
use std::ffi::c_void;
use std::ptr::{null, null_mut};
use std::sync::OnceLock;

/// Its name in tables.
pub const NAME: &str = "0.2";
const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../build/0.2/lib/libwis.so");
const VERSION: u32 = 512;

/// The bytes of its wis_point: portals came later, and their number stands where it had padding.
const POINT: usize = std::mem::offset_of!(raw::wis_point, portals);
const _: () = assert!(POINT == 192 && std::mem::offset_of!(raw::wis_point, visibility) == 168);
const _: () = assert!(size_of::<raw::wis_environment_config>() == 80 && size_of::<raw::wis_sampler_config>() == 24);
const _: () = assert!(size_of::<raw::wis_material>() == 80 && size_of::<raw::wis_product_config>() == 16);

macro_rules! calls {
    ($($name:ident: fn($($argument:ty),*);)*) => {
        struct Calls {
            $($name: unsafe extern "C" fn($($argument),*) -> raw::wis_status,)*
        }

        impl Calls {
            /// # Safety
            /// The library is that of version 0.2, and stays loaded.
            unsafe fn new(library: &Library) -> std::result::Result<Calls, libloading::Error> {
                // SAFETY: the types are those of its header.
                Ok(Calls { $($name: unsafe { *library.get(concat!("wis_", stringify!($name)).as_bytes())? },)* })
            }
        }
    };
}

type Void = *mut c_void;

calls! {
    environment_size: fn(*const raw::wis_environment_config, *mut raw::wis_memory_size, Void);
    environment_init: fn(*const raw::wis_environment_config, Void, usize, Void, usize, *mut *const c_void, Void);
    sampler_size: fn(*const raw::wis_sampler_config, *mut raw::wis_memory_size, Void);
    sampler_init: fn(*const raw::wis_sampler_config, Void, usize, *mut Void, Void);
    material_init: fn(*mut raw::wis_material, Void);
    direct: fn(Void, *const c_void, *const raw::wis_point, u32, *const f32, *mut raw::wis_ray, *mut u32);
    product_size: fn(*const raw::wis_product_config, *mut raw::wis_memory_size, Void);
    product_prepare: fn(Void, *const c_void, *const raw::wis_product_config, usize, *const raw::wis_point, Void, usize, *mut usize, *mut usize);
    sample: fn(Void, *const c_void, *const c_void, usize, *const f32, usize, *mut raw::wis_drawn, usize);
    pdf: fn(Void, *const c_void, *const c_void, usize, *const f32, usize, *mut f32, usize);
}

/// What RTLD_DEEPBIND is on Linux: names that the library has itself are its own, not those of the current one.
const DEEPBIND: i32 = 8;

/// # Panics
/// If the file is no library of version 0.2.
fn calls() -> Option<&'static Calls> {
    static CALLS: OnceLock<Option<Calls>> = OnceLock::new();
    let load = || {
        // SAFETY: loading it runs no code of its own.
        let library = unsafe { Library::open(Some(FILE), RTLD_NOW | RTLD_LOCAL | DEEPBIND) }.ok()?;
        // SAFETY: the header says so; the version is checked before any other call, and nothing unloads the library.
        let (version, calls) = unsafe {
            let version = *library.get::<unsafe extern "C" fn() -> u32>(b"wis_version").expect("its version");
            (version(), Calls::new(&library).expect("its functions"))
        };
        assert_eq!(version, VERSION, "{FILE}");
        std::mem::forget(library);
        Some(calls)
    };
    CALLS.get_or_init(load).as_ref()
}

/// Whether it is there.
pub fn is_there() -> bool {
    calls().is_some()
}

/// An environment.
pub struct Environment {
    memory: Block,
}

impl Environment {
    /// Builds a map, if version 0.2 is there.
    ///
    /// # Errors
    /// Those of the library.
    pub fn new(map: &Map) -> Result<Option<Environment>> {
        let Some(calls) = calls() else { return Ok(None) };
        let (config, mut handle) = (map.config(), null());
        // SAFETY: the pointers are to live values; the blocks are as long as they say.
        let memory = built(
            |size, _| unsafe { (calls.environment_size)(&config, size, null_mut()) },
            |place, bytes, work, room, _| unsafe {
                (calls.environment_init)(&config, place, bytes, work, room, &mut handle, null_mut())
            },
        )?;
        Ok(Some(Environment { memory }))
    }
}

/// A thread's sampler with a material.
pub struct Sampler {
    calls: &'static Calls,
    memory: Block,
    material: Box<raw::wis_material>,
    rays: Vec<raw::wis_ray>,
    product: Block,
}

impl Sampler {
    /// For at most so many rays, if version 0.2 is there.
    ///
    /// # Errors
    /// Those of the library.
    pub fn new(rays: usize, candidates: usize, hits: usize, lobes: &[raw::wis_lobe]) -> Result<Option<Sampler>> {
        let Some(calls) = calls() else { return Ok(None) };
        let [rays_of_call, candidates_per_ray, hits_per_pixel] = [rays, candidates, hits].map(|n| n as u32);
        let config = sized!(wis_sampler_config { rays: rays_of_call, candidates_per_ray, hits_per_pixel });
        let mut material = Box::new(sized!(wis_material { lobe_count: lobes.len() as u32 }));
        material.lobe[..lobes.len()].copy_from_slice(lobes);
        let products = sized!(wis_product_config {});
        let mut handle = null_mut();
        // SAFETY: as in `Environment::new`.
        let memory = built(
            |size, _| unsafe { (calls.sampler_size)(&config, size, null_mut()) },
            |place, bytes, _, _, _| unsafe { (calls.sampler_init)(&config, place, bytes, &mut handle, null_mut()) },
        )?;
        // SAFETY: the pointers are to live values.
        let product = size(|size, _| unsafe { (calls.product_size)(&products, size, null_mut()) })?;
        // SAFETY: the material is alive.
        check(unsafe { (calls.material_init)(&mut *material, null_mut()) })?;
        let rays = vec![raw::wis_ray::default(); rays];
        Ok(Some(Sampler { calls, memory, material, rays, product: Block::new(product.bytes) }))
    }

    /// A point without what it has not.
    fn point(&self, point: &raw::wis_point) -> raw::wis_point {
        let (size, material, visibility_key, portal_count) = (POINT as u32, &raw const *self.material, 0, 0);
        let (visibility, target, target_user) = (null_mut(), None, null_mut());
        raw::wis_point { size, material, visibility_key, portal_count, visibility, target, target_user, ..*point }
    }

    /// The rays to trace at a point, at most `count`.
    ///
    /// # Errors
    /// Those of the library.
    pub fn direct(
        &mut self,
        environment: &Environment,
        point: &raw::wis_point,
        count: usize,
    ) -> Result<&[raw::wis_ray]> {
        let (point, mut rays) = (self.point(point), 0);
        assert!(count <= self.rays.len());
        let (own, light) = (self.memory.start_mut(), environment.memory.start());
        // SAFETY: the handles and the material are alive, and there is room for the rays.
        check(unsafe {
            (self.calls.direct)(own, light, &point, count as u32, null(), self.rays.as_mut_ptr(), &mut rays)
        })?;
        Ok(&self.rays[..rays as usize])
    }

    /// Prepares the product at a point, which is kept for `sample` and `pdf`.
    ///
    /// # Errors
    /// Those of the library.
    pub fn prepare(&mut self, environment: &Environment, point: &raw::wis_point) -> Result<()> {
        let (point, mut offset, mut used) = (self.point(point), 0, 0);
        let config = sized!(wis_product_config {});
        let (own, light) = (self.memory.start_mut(), environment.memory.start());
        let (at, bytes) = (self.product.start_mut(), self.product.bytes());
        // SAFETY: as in `direct`; the block has the bytes of one product.
        check(unsafe {
            (self.calls.product_prepare)(own, light, &config, 1, &point, at, bytes, &mut offset, &mut used)
        })
    }

    /// Samples of the product that was prepared.
    ///
    /// # Errors
    /// Those of the library.
    pub fn sample(&mut self, environment: &Environment, u: &[[f32; 2]], drawn: &mut [raw::wis_drawn]) -> Result<()> {
        assert!(u.len() == drawn.len());
        let (own, light, product) = (self.memory.start_mut(), environment.memory.start(), self.product.start());
        // SAFETY: as in `direct`; the arrays are of one length.
        check(unsafe { (self.calls.sample)(own, light, product, u.len(), u.as_ptr().cast(), 0, drawn.as_mut_ptr(), 0) })
    }

    /// Pdfs of the product that was prepared.
    ///
    /// # Errors
    /// Those of the library.
    pub fn pdf(&mut self, environment: &Environment, wi: &[[f32; 3]], pdf: &mut [f32]) -> Result<()> {
        assert!(wi.len() == pdf.len());
        let (own, light, product) = (self.memory.start_mut(), environment.memory.start(), self.product.start());
        // SAFETY: as in `sample`.
        check(unsafe { (self.calls.pdf)(own, light, product, wi.len(), wi.as_ptr().cast(), 0, pdf.as_mut_ptr(), 0) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Light;

    /// Its functions are its own, and its rays carry the light of a white sky.
    #[test]
    fn version_0_2_stands_beside_the_current_one() {
        let Some(calls) = calls() else {
            eprintln!("left out: scripts/earlier.sh did not build it");
            return;
        };
        assert_ne!(calls.direct as usize, raw::wis_direct as *const () as usize);
        let light = Light::latlong("white", 64, 32, vec![1.0; 64 * 32]).bilinear();
        let environment = light.mapped(0, 0.0, Environment::new).unwrap().unwrap();
        let lobe = raw::wis_lobe { kind: raw::WIS_LOBE_LAMBERT, ..Default::default() };
        let mut sampler = Sampler::new(4, 0, 1, &[lobe]).unwrap().unwrap();
        let mut point = raw::wis_point { normal: [0.0, 0.0, 1.0], wo: [0.6, 0.0, 0.8], ..Default::default() };
        point.weight[0] = [1.0; 3];
        const HITS: u32 = 1000;
        let mut sum = 0.0;
        for seed in 0..HITS {
            point.seed = seed;
            let rays = sampler.direct(&environment, &point, 4).unwrap();
            sum += rays.iter().map(|ray| ray.weight * ray.wi[2].max(0.0)).sum::<f32>() / std::f32::consts::PI;
        }
        assert!((sum / HITS as f32 - 1.0).abs() < 0.02, "{sum}");
    }
}
