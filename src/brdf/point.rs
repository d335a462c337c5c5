//! A shading point: where light is to be gathered, and how strongly each lobe of the material reflects there.

use super::material::{MAX_LOBES, Material};
use super::portal::Portal;
use crate::visibility::Factors;
use core::fmt;

/// The client's BRDF as what candidates are weighed by.
pub trait Target {
    /// Writes the luminance of BRDF x |cosine| for world directions, finite and not negative; false if that failed.
    fn f_cos(&self, wi: &[[f32; 3]], out: &mut [f32]) -> bool;
}

// Not of the client's type: each target would bring the code that prints it.
impl fmt::Debug for dyn Target + '_ {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Target")
    }
}

/// A shading point in world space. What C has side by side is apart here: copied in one piece, it would be a call of `memcpy`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Point<'a> {
    /// The shading normal, unit length.
    pub normal: [f32; 3],
    /// The direction of alpha along the tangent; all 0: any, if no lobe is anisotropic.
    pub tangent: [f32; 3],
    /// The direction to the viewer, unit length.
    pub wo: [f32; 3],
    /// The shape of its lobes.
    pub material: &'a Material,
    /// Linear RGB factor of each lobe, finite and not negative.
    pub weight: [[f32; 3]; MAX_LOBES],
    /// GGX: reflectance at normal incidence, RGB in [0, 1].
    pub f0: [[f32; 3]; MAX_LOBES],
    /// Directions on both sides count; the cosine is |n.wi|. Implied by a lobe that transmits.
    pub whole_sphere: bool,
    /// What was seen from about here, by cell of the world's directions; `None`: nothing is known.
    pub seen: Option<&'a Factors>,
    /// The client's own BRDF in the choice of rays, in place of the lobes' values; `None`: the lobes'.
    pub target: Option<&'a dyn Target>,
    /// The client's BRDF already contains the cosine, and so do the lobes.
    pub cosine_included: bool,
    /// Rays bring only the radiance above the light's mean: BSDF rays that escape bring the rest.
    pub compensated: bool,
    /// Rectangles that light comes through, relative to the point; of more than eight, the first.
    pub portals: &'a [Portal],
    /// Directions outside all portals do not count. Not read without portals.
    pub portals_complete: bool,
}

impl<'a> Point<'a> {
    /// A white Lambertian point seen along its normal.
    pub fn new(material: &'a Material, normal: [f32; 3], wo: [f32; 3]) -> Point<'a> {
        Point {
            material,
            normal,
            tangent: [0.0; 3],
            wo,
            weight: [[1.0; 3]; MAX_LOBES],
            f0: [[0.0; 3]; MAX_LOBES],
            whole_sphere: false,
            seen: None,
            target: None,
            cosine_included: false,
            compensated: false,
            portals: &[],
            portals_complete: false,
        }
    }
}
