//! The comparison of a client's BSDF with the lobes of a point, in C.

use super::light::{EnvironmentObject, environment as view};
use super::material::{PointData, point as read_point};
use super::sampler::{SamplerObject, with_sampler};
use super::{put, sized};
use crate::brdf::compare::{Match, compare};
use crate::brdf::point::Target;
use crate::status::{Error, Status};
use core::ffi::c_char;

/// The lobes are your BSDF.
pub const WIS_MISTAKE_NONE: u32 = 0;
/// Your BSDF is `scale` times the lobes: harmless, since rays are chosen alike.
pub const WIS_MISTAKE_SCALED: u32 = 1;
/// wo points into the surface. Also where your BSDF ignores the side of wo and wo lies below.
pub const WIS_MISTAKE_WO: u32 = 2;
/// The normal points to the other side: flip it to the side of wo, or set WIS_POINT_WHOLE_SPHERE.
pub const WIS_MISTAKE_NORMAL: u32 = 3;
/// Your BSDF takes wi towards the surface: wi points to the light.
pub const WIS_MISTAKE_WI: u32 = 4;
/// The weights of all lobes are 0.
pub const WIS_MISTAKE_NO_WEIGHT: u32 = 5;
/// The weight of `lobe` should be `value` times as large, or `value` if it is 0.
pub const WIS_MISTAKE_WEIGHT: u32 = 6;
/// Your values lack a cosine: multiply by it, or set WIS_POINT_COSINE_INCLUDED.
pub const WIS_MISTAKE_COSINE_MISSING: u32 = 7;
/// Your values have a cosine too many: WIS_POINT_COSINE_INCLUDED is set, or you multiply twice.
pub const WIS_MISTAKE_COSINE_TWICE: u32 = 8;
/// Your alpha is the square of `a` and `b` of GGX lobes: you pass roughness in place of its square.
pub const WIS_MISTAKE_ALPHA_SQUARE: u32 = 9;
/// Your alpha is the square root of `a` and `b` of GGX lobes.
pub const WIS_MISTAKE_ALPHA_ROOT: u32 = 10;
/// The tangent should be rotated about the normal by `angle`; by 90 degrees: or swap `a` and `b`.
pub const WIS_MISTAKE_TANGENT: u32 = 11;
/// `eta` is inverted.
pub const WIS_MISTAKE_ETA: u32 = 12;
/// Your sides and the lobes' differ: set WIS_POINT_WHOLE_SPHERE, or add a lobe that transmits.
pub const WIS_MISTAKE_SIDES: u32 = 13;
/// f0 of `lobe`, and of lobes with the same f0, should be `value`.
pub const WIS_MISTAKE_F0: u32 = 14;
/// No mistake: the lobes resemble your BSDF, of which they are 1 - `error` (docs/integrating.md).
pub const WIS_MISTAKE_RESEMBLES: u32 = 15;
/// Less than half of your BSDF is in the lobes: two mistakes, or lobes of another kind.
pub const WIS_MISTAKE_OTHER: u32 = 16;
/// Your BSDF is in the lobes, but no portal faces the point: `edges[0]` x `edges[1]` points into the room.
pub const WIS_MISTAKE_PORTALS: u32 = 17;

/// What was found.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PointVerdict {
    /// sizeof(wis_point_verdict), set by the caller.
    pub size: u32,
    /// WIS_MISTAKE_*: the likely cause of the difference. Of causes that explain it alike, the first.
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
