//! The comparison of a client's radiance with the environment that was built, in C.

use super::light::{EnvironmentObject, WIS_ENVIRONMENT_ROWS_AT_POLES, WIS_FILTER_BILINEAR, WIS_FILTER_NEAREST};
use super::sampler::{SamplerObject, with_sampler};
use super::{Failure, out, sized};
use crate::light::compare::compare;
use crate::light::plan::Filter;
use crate::status::Status;
use core::ffi::{c_int, c_void};

/// The environment is the light that you see.
pub const WIS_CAUSE_NONE: u32 = 0;
/// Your radiance is `scale` times the light: harmless if you meant it, since rays are chosen alike.
pub const WIS_CAUSE_SCALED: u32 = 1;
/// You do not apply world_from_map, or you apply its inverse.
pub const WIS_CAUSE_FRAME: u32 = 2;
/// Your map is rotated by 90, 180 or 270 degrees about the polar axis.
pub const WIS_CAUSE_TURNED: u32 = 3;
/// Your map is mirrored: azimuth runs the other way.
pub const WIS_CAUSE_MIRRORED: u32 = 4;
/// Your polar axis points the other way: rows from bottom to top.
pub const WIS_CAUSE_UPSIDE_DOWN: u32 = 5;
/// Another axis is your polar axis: y up, for instance, in place of z.
pub const WIS_CAUSE_AXES: u32 = 6;
/// You look texels up half a texel beside.
pub const WIS_CAUSE_SHIFTED: u32 = 7;
/// Your first and last rows lie at the poles and those of the environment do not, or the other way round.
pub const WIS_CAUSE_ROWS: u32 = 8;
/// You interpolate and the environment takes the nearest texel, or the other way round.
pub const WIS_CAUSE_FILTER: u32 = 9;
/// Something else: another map, a rotation by another angle, a curve applied to the colours.
pub const WIS_CAUSE_OTHER: u32 = 10;

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

/// What was found. From `filter` on: what to build the environment with so that it is the light that you see.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct CheckInfo {
    /// sizeof(wis_check_info), set by the caller.
    pub size: u32,
    /// WIS_CAUSE_*: the likely cause of the difference.
    pub cause: u32,
    /// The mean difference between your radiance and the light, each as a share of the larger of both, 0 to 1. A factor does not
    /// count.
    pub error: f32,
    /// The difference that is left with the fields below. Large: there is more than one mistake.
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
}

/// Compares your radiance with an environment and names the likely mistake: wrong axes, a wrong filter and the like cost no bias but
/// many times the error, in silence. Call it once while you integrate the library, or in a test.
///
/// `radiance` of `config` is called four times, for 64 world directions each: half of them drawn from the light, half spread over the
/// sphere. What your map does not show is no mistake: a constant sky fits every frame. WIS_CALLBACK_FAILED for a radiance that is NaN,
/// infinite or negative: `y` of the fault (wis_sampler_fault) is the number of the direction. Set `info->size` before. Costs 1 to
/// 6 ms besides `radiance`. Work: constant.
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
            let environment = super::light::environment(environment, 2)?;
            let config = sized(config, 3)?;
            if config.reserved != 0 {
                return Err(Failure::new(Status::InvalidArgument, 3).of(c"reserved"));
            }
            let eval = config.radiance.ok_or(Failure::new(Status::NullPointer, 3).of(c"radiance"))?;
            sized(info.cast_const(), 4)?;
            let target = out(info, 4)?;
            let mut radiance = |wi: &[[f32; 3]], rgb: &mut [[f32; 3]]| {
                let count = wi.len().min(rgb.len());
                eval(config.radiance_user, count, wi.as_ptr().cast(), rgb.as_mut_ptr().cast()) == 0
            };
            let failed = |direction| Failure::new(Status::CallbackFailed, 3).of(c"radiance").in_row(3, direction);
            let found = compare(&environment, &mut radiance).map_err(failed)?;
            target.write(CheckInfo {
                size: size_of::<CheckInfo>() as u32,
                cause: found.cause as u32,
                error: found.error,
                explained: found.explained,
                scale: found.scale,
                filter: if found.filter == Filter::Bilinear { WIS_FILTER_BILINEAR } else { WIS_FILTER_NEAREST },
                flags: if found.rows_at_poles { WIS_ENVIRONMENT_ROWS_AT_POLES } else { 0 },
                shift: found.shift,
                world_from_map: found.world_from_map,
            });
            Ok(())
        })
    }
}
