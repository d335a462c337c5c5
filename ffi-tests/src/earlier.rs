//! Version 0.2 of the library beside the current one, in one process: the shared library that scripts/earlier.sh built from the history,
//! if it is there. Its structs are the current ones, or begin them.

use crate::client::raw;
use crate::environment::{Direct, Version};
use anyhow::Context;
use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
use std::ptr::null;
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
const _: () = assert!(size_of::<raw::wis_environment_info>() == 80 && size_of::<raw::wis_diagnostic>() == 32);

/// What RTLD_DEEPBIND is on Linux: names that the library has itself are its own, not those of the current one.
const DEEPBIND: i32 = 8;

/// Its wis_direct, which takes random numbers of the client's, too.
type Own = unsafe extern "C" fn(
    *mut raw::wis_sampler,
    *const raw::wis_environment,
    *const raw::wis_point,
    u32,
    *const f32,
    *mut raw::wis_ray,
    *mut u32,
) -> raw::wis_status;

static DIRECT: OnceLock<Own> = OnceLock::new();
static LIBRARY: OnceLock<Library> = OnceLock::new();

/// Its wis_direct without such numbers.
///
/// # Safety
/// That of the call; the library is loaded.
unsafe extern "C" fn direct(
    sampler: *mut raw::wis_sampler,
    environment: *const raw::wis_environment,
    point: *const raw::wis_point,
    rays: u32,
    ray: *mut raw::wis_ray,
    count: *mut u32,
) -> raw::wis_status {
    let own = DIRECT.get().expect("the library is loaded");
    // SAFETY: the caller's contract.
    unsafe { own(sampler, environment, point, rays, null(), ray, count) }
}

/// Another of its functions.
///
/// # Safety
/// The function has this type.
///
/// # Errors
/// It is not there.
pub unsafe fn function<T: Copy>(name: &str) -> anyhow::Result<T> {
    let library = version().and_then(|_| LIBRARY.get()).context("version 0.2 is not there")?;
    // SAFETY: the caller's contract; nothing unloads the library.
    Ok(unsafe { *library.get(name.as_bytes())? })
}

/// The version, if it is there.
///
/// # Panics
/// If the file is no library of version 0.2.
pub fn version() -> Option<&'static Version> {
    static LOADED: OnceLock<Option<Version>> = OnceLock::new();
    let load = || {
        // SAFETY: loading it runs no code of its own.
        let library = unsafe { Library::open(Some(FILE), RTLD_NOW | RTLD_LOCAL | DEEPBIND) }.ok()?;
        // SAFETY: the types are those of its header; the version is checked before any other call, and nothing unloads the library.
        let version = unsafe {
            let number = *library.get::<unsafe extern "C" fn() -> u32>(b"wis_version").expect("its version");
            assert_eq!(number(), VERSION, "{FILE}");
            DIRECT.get_or_init(|| *library.get(b"wis_direct").expect("wis_direct"));
            Version::load(&library, POINT, direct as Direct).expect("its functions")
        };
        LIBRARY.get_or_init(|| library);
        Some(version)
    };
    LOADED.get_or_init(load).as_ref()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::{CURRENT, Environment, Sampler, material_by};
    use crate::light::Light;

    /// Its functions are its own, and its rays carry the light of a white sky.
    #[test]
    fn version_0_2_stands_beside_the_current_one() {
        let Some(version) = version() else {
            eprintln!("left out: scripts/earlier.sh did not build it");
            return;
        };
        assert_ne!(*DIRECT.get().unwrap() as usize, CURRENT.wis_direct as usize);
        let light = Light::latlong("white", 64, 32, vec![1.0; 64 * 32]).bilinear();
        let environment = light.mapped(0, 0.0, |map| Environment::by(version, map)).unwrap();
        let lobe = raw::wis_lobe { kind: raw::WIS_LOBE_LAMBERT, ..Default::default() };
        let (mut sampler, own) = (Sampler::by(version, 4, 0, 1).unwrap(), material_by(version, &[lobe]).unwrap());
        let (normal, wo) = ([0.0, 0.0, 1.0], [0.6, 0.0, 0.8]);
        let mut point = raw::wis_point { material: &own, normal, wo, ..Default::default() };
        point.weight[0] = [1.0; 3];
        const HITS: u32 = 1000;
        let (mut sum, mut ray) = (0.0, [raw::wis_ray::default(); 4]);
        for seed in 0..HITS {
            point.seed = seed;
            let count = sampler.direct(&environment, &point, None, &mut ray).unwrap();
            sum += ray[..count].iter().map(|ray| ray.weight * ray.wi[2].max(0.0)).sum::<f32>() / std::f32::consts::PI;
        }
        assert!((sum / HITS as f32 - 1.0).abs() < 0.02, "{sum}");
    }
}
