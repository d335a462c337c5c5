//! Materials and points in C.

use super::visibility::VisibilityCacheObject;
use super::{Checked, Diagnostic, answer, out, pointer};
use crate::brdf::material::Material;
use crate::brdf::point::{Point, Target};
use crate::brdf::portal::{MAX_PORTALS, Portal};
use crate::status::{Error, Status};
use crate::visibility::Factors;
use core::ffi::{c_int, c_void};

/// Lobes of a material.
pub const WIS_MAX_LOBES: usize = 4;

/// Diffuse reflection: `weight / pi` above the surface; with both sides, on the side of wo.
pub const WIS_LOBE_LAMBERT: u32 = 1;
/// Microfacets: `weight F D G / (4 cos cos)`, GGX, height-correlated Smith shadowing, Schlick's Fresnel term.
pub const WIS_LOBE_GGX: u32 = 2;
/// `weight (a + 2) / (2 pi) max(0, r.wi)^a` on the side of wo; r, the mirror direction of wo, may lie below.
pub const WIS_LOBE_PHONG: u32 = 3;
/// Transmission through GGX microfacets (Walter et al. 2007, Eq. 21): `weight (1 - F)` times D, G and the Jacobian for `eta`; 0 beyond
/// the critical angle. F: Schlick's term by the cosine of wo and the half vector, from either side with `f0` of this lobe: ((eta - 1) /
/// (eta + 1))^2 for clear glass. Seen from inside glass `eta` is 1 / 1.5, and the GGX lobe has an `f0` of 1 where wo is beyond the
/// critical angle. Wherever a width counts, the lobe is as narrow as a mirror of alpha |1 - 1 / eta| / 2.
pub const WIS_LOBE_GGX_TRANSMISSION: u32 = 5;
/// Diffuse transmission: `weight / pi` on the side opposite to wo.
pub const WIS_LOBE_LAMBERT_TRANSMISSION: u32 = 6;

/// The shape of a lobe.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct LobeData {
    /// WIS_LOBE_*.
    pub kind: u32,
    /// GGX: alpha along the tangent, 1e-5 to 16. Phong: the exponent, 0 to 1e7. Others: not read.
    pub a: f32,
    /// GGX: alpha along the bitangent, 1e-5 to 16. Others: not read.
    pub b: f32,
    /// GGX transmission: refractive index beyond over that on the side of wo, 0.1 to 10, not within 1e-3 of 1.
    pub eta: f32,
}

/// The shapes of a material's lobes. Plain and copyable: fill `size`, `lobe_count` and `lobe`, then call wis_material_init once.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct MaterialData {
    /// sizeof(wis_material).
    pub size: u32,
    /// Lobes used, 0 to 4. Without lobes a point reflects alike in all directions.
    pub lobe_count: u32,
    /// The lobes, of which the first lobe_count are read.
    pub lobe: [LobeData; WIS_MAX_LOBES],
    /// Written by wis_material_init: tells materials apart by their content.
    pub hash: u64,
}

/// Directions on both sides count, with |n.wi| for the cosine. Implied by a lobe that transmits.
pub const WIS_POINT_WHOLE_SPHERE: u32 = 1;
/// The client's BRDF already contains the cosine, and so do the lobes: it is not multiplied again.
pub const WIS_POINT_COSINE_INCLUDED: u32 = 2;
/// Rays bring what exceeds the light's mean, escaping BSDF rays the rest: wis_base. Products ignore it.
pub const WIS_POINT_COMPENSATED: u32 = 4;
/// Directions outside all portals do not count. Without it an eighth of the rays looks elsewhere, and means are right in any case.
pub const WIS_POINT_PORTALS_COMPLETE: u32 = 8;
/// All flags of points.
pub(super) const POINT_FLAGS: u32 =
    WIS_POINT_WHOLE_SPHERE | WIS_POINT_COSINE_INCLUDED | WIS_POINT_COMPENSATED | WIS_POINT_PORTALS_COMPLETE;

/// Portals of a point.
pub const WIS_MAX_PORTALS: usize = 8;
const _: () = assert!(WIS_MAX_PORTALS == MAX_PORTALS);

/// Writes the luminance of your BRDF x |cosine| (finite, at least 0) for `count` world directions, three floats each. Returns 0;
/// anything else stops the call with WIS_CALLBACK_FAILED. Floating-point control is the default meanwhile.
pub type TargetFn =
    Option<unsafe extern "C" fn(user: *mut c_void, count: usize, wi: *const f32, f_cos: *mut f32) -> c_int>;

/// A shading point in world space. Plain and copyable.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PointData {
    /// sizeof(wis_point).
    pub size: u32,
    /// WIS_POINT_*, or 0: the upper hemisphere of the normal.
    pub flags: u32,
    /// The material, after wis_material_init. Null: no lobes. Read during calls only.
    pub material: *const MaterialData,
    /// The shading normal, unit length.
    pub normal: [f32; 3],
    /// Direction of alpha `a`, length 0.01 to 1e18, not along the normal. All 0: any, if no lobe is anisotropic.
    pub tangent: [f32; 3],
    /// The direction to the viewer, unit length. Below the shading horizon, of a point without WIS_POINT_WHOLE_SPHERE, GGX is 0 and other
    /// lobes keep their formulas. If all lobes are 0 by that, the point counts as one without lobes.
    pub wo: [f32; 3],
    /// Linear RGB factor of each lobe at this hit, at least 0: textures. All 0: rays ignore the lobes.
    pub weight: [[f32; 3]; WIS_MAX_LOBES],
    /// GGX: reflectance at normal incidence of each lobe, RGB in [0, 1]. Others: not read.
    pub f0: [[f32; 3]; WIS_MAX_LOBES],
    /// The pixel: any number, another one for each pixel.
    pub seed: u32,
    /// The number of this hit among all of its pixel and bounce, over all passes. Gaps only slow convergence.
    pub sample: u32,
    /// The bounce: 0 for camera hits, 1 for the next ...
    pub bounce: u32,
    /// The place in `visibility`, such as wis_visibility_key or the number of a tile of pixels + 1. 0: none.
    pub visibility_key: u32,
    /// How many portals there are, at most WIS_MAX_PORTALS; 0: light may come from everywhere.
    pub portal_count: u32,
    /// What rays of earlier passes saw, which wis_direct then prefers. Null: not known.
    pub visibility: *mut VisibilityCacheObject,
    /// Your own BRDF in place of the values of the lobes, which then only propose directions: called for 16 candidates at a time. Null:
    /// none.
    pub target: TargetFn,
    /// Handed to `target`.
    pub target_user: *mut c_void,
    /// Windows that light comes through; may overlap. Not read by products.
    pub portals: *const Portal,
}

/// A client's target.
#[derive(Debug)]
pub(super) struct ClientTarget {
    eval: unsafe extern "C" fn(*mut c_void, usize, *const f32, *mut f32) -> c_int,
    user: *mut c_void,
}

impl ClientTarget {
    /// The function of a client, if there is one.
    pub(super) fn new(eval: TargetFn, user: *mut c_void) -> Option<ClientTarget> {
        eval.map(|eval| ClientTarget { eval, user })
    }
}

impl Target for ClientTarget {
    fn f_cos(&self, wi: &[[f32; 3]], out: &mut [f32]) -> bool {
        let count = wi.len().min(out.len());
        // SAFETY: both arrays hold `count` elements; the function is the client's.
        unsafe { (self.eval)(self.user, count, wi.as_ptr().cast(), out.as_mut_ptr()) == 0 }
    }
}

/// Checks the shapes of a material and writes its hash. Costs 20 ns: also good for one hit, where a texture gives the roughness.
/// WIS_INVALID_ARGUMENT names the field; `y` of the diagnostic is the number of the lobe. Work: lobes.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_material_init(material: *mut MaterialData, diagnostic: *mut Diagnostic) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let target = out(material, 1)?;
        let _: &MaterialData = super::sized(target, 1)?;
        // SAFETY: both structs are the same plain numbers.
        (*target).hash = (*target.cast::<Material>()).checked().map_err(|error| error.instead(1))?;
        Ok(())
    })
}

/// A material that wis_material_init checked.
///
/// # Safety
/// The pointer is null or points to a material.
#[inline(always)]
pub(super) unsafe fn material<'a>(data: *const MaterialData, argument: u32) -> Checked<&'a Material> {
    const { assert!(size_of::<Material>() == size_of::<MaterialData>()) };
    if data.is_null() {
        return Ok(&Material::NONE);
    }
    let at = |failure: Error| failure.instead(argument).of(c"material");
    // SAFETY: not null, and aligned; the caller states what it points to, and both structs are the same plain numbers.
    let material: &Material = unsafe { &*pointer(data, argument).map_err(at)?.cast() };
    // wis_material_init was forgotten, or failed, or the lobes were changed after it.
    if material.is_sealed() { Ok(material) } else { Err(Error::new(Status::NotBuilt, argument).of(c"material")) }
}

/// A point with its material.
///
/// # Safety
/// The pointer is null or points to a point, whose material is null or a material.
#[inline(always)]
pub(super) unsafe fn point<'a>(data: *const PointData, argument: u32) -> Checked<(&'a PointData, &'a Material)> {
    // SAFETY: the caller's contract.
    unsafe {
        let data: &PointData = super::sized(data, argument)?;
        if data.flags & !POINT_FLAGS != 0 {
            return Err(Error::new(Status::InvalidArgument, argument).of(c"flags"));
        }
        let material = material(data.material, argument)?;
        Ok((data, material))
    }
}

impl PointData {
    /// Its portals.
    ///
    /// # Safety
    /// `portals` points to `portal_count` of them, if it is neither null nor misaligned.
    #[inline(always)]
    pub(super) unsafe fn portals(&self, argument: u32) -> Checked<&[Portal]> {
        if self.portal_count == 0 {
            return Ok(&[]);
        }
        let count = self.portal_count as usize;
        super::require(count <= MAX_PORTALS, Status::InvalidArgument, argument).map_err(|at| at.of(c"portal_count"))?;
        // SAFETY: the caller's contract; the pointer is checked.
        unsafe { super::slice(self.portals, count, argument).map_err(|at| at.of(c"portals")) }
    }

    /// The client's own target, if there is one.
    pub(super) fn target(&self) -> Option<ClientTarget> {
        ClientTarget::new(self.target, self.target_user)
    }

    /// The point as the kernel has it.
    pub(super) fn kernel<'a>(
        &self,
        material: &'a Material,
        seen: Option<&'a Factors>,
        target: Option<&'a ClientTarget>,
        portals: &'a [Portal],
    ) -> Point<'a> {
        Point {
            material,
            normal: self.normal,
            tangent: self.tangent,
            wo: self.wo,
            weight: self.weight,
            f0: self.f0,
            whole_sphere: self.flags & WIS_POINT_WHOLE_SPHERE != 0,
            cosine_included: self.flags & WIS_POINT_COSINE_INCLUDED != 0,
            compensated: self.flags & WIS_POINT_COMPENSATED != 0,
            seen,
            target: target.map(|target| target as &dyn Target),
            portals,
            portals_complete: self.flags & WIS_POINT_PORTALS_COMPLETE != 0,
        }
    }
}
