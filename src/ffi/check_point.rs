//! The comparison of a client's BSDF with the lobes of a point, in C.

use super::light::{EnvironmentObject, environment as view};
use super::material::{PointData, point as read_point};
use super::sampler::{SamplerObject, with_sampler};
use super::{put, sized};
use crate::brdf::compare::{Match, compare};
use crate::brdf::point::Target;
use crate::status::{Error, Status};
use core::ffi::c_char;

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
            let found = compare(&data.kernel(material, None, None, portals), &environment.frame(), &mut f_cos);
            put(verdict, 4, found.map_err(|error| error.instead(3)).map(PointVerdict::from))
        })
    }
}
