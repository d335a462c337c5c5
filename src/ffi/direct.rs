//! Direct light in C: the rays to trace at a hit.

use super::light::{EnvironmentObject, environment as view};
use super::material::{PointData, point as read_point};
use super::sampler::{SamplerObject, with_sampler};
use super::visibility::factors;
use super::{answer, borrow, out, put, require, slice_mut};
use crate::direct::Ray;
use crate::direct::sampler::Sequence;
use crate::light::environment::Header;
use crate::simd::prefetch_all;
use crate::status::Status;
use core::ptr::null_mut;

/// The part of a radiance that BSDF rays bring where points have WIS_POINT_COMPENSATED, 0 to 1: the light's mean radiance over the luminance
/// of `radiance`, at most 1; 1 for black. WIS_NULL_POINTER. Costs 3 ns. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_base(
    environment: *const EnvironmentObject,
    radiance: *const [f32; 3],
    base: *mut f32,
) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let (environment, radiance) = (view(environment, 1)?, *borrow(radiance, 2)?);
        put(base, 3, Ok(environment.base(radiance)))
    })
}

/// The rays to trace at a hit, each with a weight. For each, evaluate your BRDF, radiance and visibility, and add `weight f(wo, wi) |cos|
/// L(wi) V(wi)`. The sum is unbiased for any BRDF and radiance that vanish outside the point's
/// hemisphere and where the built light is 0.
///
/// `rays`: at most as many as the sampler was made for (WIS_INVALID_ARGUMENT). `ray_count`: how many there are, 0 (no light) to `rays`.
/// Rays are picked among candidates, half from the light and half from the lobes. One ray has 16, or 64 for a lobe below 0.15. Of
/// up to 8 rays each has 16 (8 if all lobes are diffuse), beyond 8; 2048 in all at the most. Where the visibility cache of the point knows that
/// little of the light was seen, each has 8.
///
/// Portals of the point add 8 candidates for each ray, at least 16. WIS_INVALID_ARGUMENT for one that is not finite or has no right
/// angle: `y` of the fault is its number. If all are left out, rays are those without portals; none with
/// WIS_POINT_PORTALS_COMPLETE.
///
/// With `hits_per_pixel` of 16 and more, first hits (`bounce` 0) whose lobes are all of 0.2 or wider draw from at most four products that
/// hits of the pixel share. Others, hits with portals, and hits of which light or point alone is COMPENSATED have candidates.
///
/// Path tracers, whose BSDF rays go on from the hit, may split any light: with WIS_POINT_COMPENSATED rays count (1 - base) L(wi), where
/// `base` is wis_base of L(wi), and BSDF rays that leave the scene, also after the last hit, count base L(wi). Candidates are then 4 for
/// each ray, at least 8 of each source. WIS_NOT_BUILT: the material was not initialised. WIS_INVALID_TRANSFORM: normal, wo or tangent.
/// Work: rays x candidates x lobes.
///
/// # Safety
/// Pointers are null or point to what the header says; `ray` to `rays` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_direct(
    sampler: *mut SamplerObject,
    environment: *const EnvironmentObject,
    point: *const PointData,
    rays: u32,
    ray: *mut Ray,
    ray_count: *mut u32,
) -> Status {
    // In a renderer they are far away, and needed one after the other.
    prefetch_all(environment.cast::<Header>());
    prefetch_all(point);
    // SAFETY: the caller's contract, also for what stands inside.
    unsafe {
        with_sampler(sampler, |sampler| {
            let environment = view(environment, 2)?;
            let (data, material) = read_point(point, 3)?;
            let seen = factors(data.visibility, data.visibility_key, data.seed, 3)?;
            let (target, portals) = (data.target(), data.portals(3)?);
            require(rays <= sampler.config().rays, Status::InvalidArgument, 4)?;
            let room = slice_mut(ray, rays as usize, 5)?;
            let counted = out(ray_count, 6)?;
            let at = Sequence { seed: data.seed, sample: data.sample, bounce: data.bounce };
            let point = data.kernel(material, seen, target.as_ref(), portals);
            let got =
                sampler.direct(&environment, &point, at, rays as usize, room).map_err(|error| error.instead(3))?;
            counted.write(got as u32);
            Ok(())
        })
    }
}
