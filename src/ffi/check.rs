//! The comparisons of a client's radiance with the environment that was built, and of its BSDF with the lobes of a point, in C.

use super::light::{EnvironmentObject, WIS_ENVIRONMENT_ROWS_AT_POLES, WIS_FILTER_BILINEAR, WIS_FILTER_NEAREST};
use super::light::{environment as view, exact};
use super::material::{PointData, point as read_point};
use super::sampler::{SamplerObject, with_sampler};
use super::{put, sized};
use crate::brdf::compare::{self as brdf, Match};
use crate::brdf::point::Target;
use crate::light::compare::{Comparison, compare};
use crate::light::plan::Filter;
use crate::status::{Error, Status};
use core::ffi::{c_char, c_int, c_void};

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

/// What was found.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PointVerdict {
    /// sizeof(wis_point_verdict), set by the caller.
    pub size: u32,
    /// A wis_mistake: the likely cause of the difference. Of causes that explain it alike, the first.
    pub mistake: u32,
    /// The same as a sentence for a log; a static string.
    pub message: *const c_char,
    /// The integral of |your BSDF - lobes| over the integral of the larger of both, 0 to 1. A common factor does not count.
    pub error: f32,
    /// The difference that is left without the mistake; `error` where no mistake is named.
    pub explained: f32,
    /// Your BSDF over the lobes without the mistake.
    pub scale: f32,
    /// WIS_MISTAKE_WEIGHT, WIS_MISTAKE_F0: the number of the lobe, 0 = first. Else 0.
    pub lobe: u32,
    /// WIS_MISTAKE_WEIGHT, WIS_MISTAKE_F0: see there; the luminance of a weight, grey f0. Else 0.
    pub value: f32,
    /// WIS_MISTAKE_TANGENT: in degrees, 0 to 180, counter-clockwise seen from the tip of the normal. Else 0.
    pub angle: f32,
}

impl From<Match> for PointVerdict {
    fn from(found: Match) -> PointVerdict {
        PointVerdict {
            size: size_of::<PointVerdict>() as u32,
            mistake: found.mistake as u32,
            message: found.mistake.message().as_ptr(),
            error: found.error,
            explained: found.explained,
            scale: found.scale,
            lobe: found.lobe,
            value: found.value,
            angle: found.angle,
        }
    }
}

/// Compares your BSDF, the `target` of a point, with its lobes and names the likely mistake: a wo that is flipped, roughness for alpha, a
/// cosine too many and the like cost no bias but many times the error, in silence. Call it once for a kind of material, or in a test.
///
/// `target` is called five times, for 40 world directions on both sides of the surface. A mistake is named if it explains almost all of
/// the difference. What a point does not show is no mistake: see it from above, 20 to 70 degrees off the normal, and give each lobe a
/// weight. A `sample` that is always 0 stays unseen. WIS_NULL_POINTER for a target that is null, WIS_CALLBACK_FAILED for a value that is
/// NaN, infinite or negative: `y` of the fault (wis_sampler_fault) is the number of the direction. WIS_NOT_BUILT: the material was not
/// initialised. WIS_INVALID_TRANSFORM: normal, wo or tangent. Costs 0.1 to 2 ms besides `target`. Work:
/// constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_check_point(
    sampler: *mut SamplerObject,
    environment: *const EnvironmentObject,
    point: *const PointData,
    verdict: *mut PointVerdict,
) -> Status {
    // SAFETY: the caller's contract, also for what stands inside.
    unsafe {
        with_sampler(sampler, |_| {
            let environment = view(environment, 2)?;
            let (data, material) = read_point(point, 3)?;
            let target = data.target().ok_or(Error::new(Status::NullPointer, 3).of(c"target"))?;
            sized(verdict.cast_const(), 4)?;
            let mut f_cos = |wi: &[[f32; 3]], out: &mut [f32]| target.f_cos(wi, out);
            let portals = data.portals(3)?;
            let found = brdf::compare(&data.kernel(material, None, None, portals), &environment.frame(), &mut f_cos);
            put(verdict, 4, found.map_err(|error| error.instead(3)).map(PointVerdict::from))
        })
    }
}
