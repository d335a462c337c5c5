//! The comparison of a client's radiance with the environment that was built, in C.

use super::light::{EnvironmentObject, WIS_ENVIRONMENT_ROWS_AT_POLES, WIS_FILTER_BILINEAR, WIS_FILTER_NEAREST, exact};
use super::sampler::{SamplerObject, with_sampler};
use super::{put, sized};
use crate::light::compare::{Comparison, compare};
use crate::light::plan::Filter;
use crate::status::{Error, Status};
use core::ffi::{c_int, c_void};

/// What was found. From `filter` on: what to build the environment with so that it is the light that you see.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct CheckInfo {
    /// sizeof(wis_check_info), set by the caller.
    pub size: u32,
    /// A wis_cause: the likely cause of the difference.
    pub cause: u32,
    /// The mean difference of both, each as a share of the larger, 0 to 1. A factor does not count.
    pub error: f32,
    /// The difference that is left with the fields below: `error` if nothing explains it.
    pub explained: f32,
    /// Your radiance over that of the light.
    pub scale: f32,
    /// WIS_FILTER_*.
    pub filter: u32,
    /// WIS_ENVIRONMENT_ROWS_AT_POLES or 0.
    pub flags: u32,
    /// How far beside you look texels up along columns and rows, in texels: 0, 0.5 or -0.5. To be mended in your look-up.
    pub shift: [f32; 2],
    /// The row-major matrix.
    pub world_from_map: [f32; 9],
    /// The luminance at which you clamp what you look up; 0 if you do not.
    pub limit: f32,
}

impl From<Comparison> for CheckInfo {
    fn from(found: Comparison) -> CheckInfo {
        CheckInfo {
            size: size_of::<CheckInfo>() as u32,
            cause: found.cause as u32,
            error: found.error,
            explained: found.explained,
            scale: found.scale,
            filter: if found.filter == Filter::Bilinear { WIS_FILTER_BILINEAR } else { WIS_FILTER_NEAREST },
            flags: if found.rows_at_poles { WIS_ENVIRONMENT_ROWS_AT_POLES } else { 0 },
            shift: found.shift,
            world_from_map: found.world_from_map,
            limit: found.limit,
        }
    }
}

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
/// the number of the direction. WIS_NOT_BUILT for an environment with WIS_ENVIRONMENT_RAYS_ONLY. 1 to 20 ms besides `radiance`. Work: constant.
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
