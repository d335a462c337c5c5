//! The comparison of a client's radiance with the environment that was built, in C.

pub use crate::light::verdict::*;

use super::light::{EnvironmentObject, exact};
use super::sampler::{SamplerObject, with_sampler};
use super::{put, sized};
use crate::light::compare::compare;
use crate::status::{Error, Status};
use core::ffi::{c_int, c_void};

/// Writes the radiance that you see from `count` world directions, three floats each: linear RGB, three floats each, finite and at
/// least 0. Returns 0; anything else stops the call with WIS_CALLBACK_FAILED. Floating-point control is the default meanwhile.
pub type RadianceFn =
    Option<unsafe extern "C" fn(user: *mut c_void, count: usize, wi: *const f32, rgb: *mut f32) -> c_int>;

/// What the environment is compared with.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CheckConfig {
    /// sizeof(wis_check_config).
    pub size: u32,
    /// Always 0.
    pub reserved: u32,
    /// Your radiance of the environment, as your integrator evaluates it.
    pub radiance: RadianceFn,
    /// Handed to `radiance`.
    pub radiance_user: *mut c_void,
}

/// Compares your radiance with an environment and names the likely mistake: wrong axes, a wrong filter and the like cost no bias but many
/// times the error, in silence. Call it once while you integrate the library, or in a test.
///
/// `radiance` of `config` is called for at most 64 world directions at a time: 256, half of them drawn from the light, and up to 25,000
/// more that confirm an explanation. It answers the same for the same direction. What your map does not show is no mistake: a constant
/// sky fits every frame. WIS_CALLBACK_FAILED for a radiance that is NaN, infinite or negative: `y` of the fault (wis_sampler_fault) is
/// the number of the direction. WIS_NOT_BUILT for an environment with WIS_ENVIRONMENT_RAYS_ONLY. Set `info->size` before. Costs 1 to 20 ms besides `radiance`. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_check(
    sampler: *mut SamplerObject,
    environment: *const EnvironmentObject,
    config: *const CheckConfig,
    info: *mut CheckInfo,
) -> Status {
    // SAFETY: the caller's contract, also for what stands inside.
    unsafe {
        with_sampler(sampler, |_| {
            let environment = exact(environment, 2)?;
            let config = sized(config, 3)?;
            Error::first([(config.reserved == 0, c"reserved")]).map_err(|error| error.instead(3))?;
            let eval = config.radiance.ok_or(Error::new(Status::NullPointer, 3).of(c"radiance"))?;
            sized(info.cast_const(), 4)?;
            let mut radiance = |wi: &[[f32; 3]], rgb: &mut [[f32; 3]]| {
                let count = wi.len().min(rgb.len());
                eval(config.radiance_user, count, wi.as_ptr().cast(), rgb.as_mut_ptr().cast()) == 0
            };
            let failed = |direction| Error::new(Status::CallbackFailed, 3).of(c"radiance").in_row(direction);
            put(info, 4, compare(&environment, &mut radiance).map_err(failed).map(CheckInfo::from))
        })
    }
}
