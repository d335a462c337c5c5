//! A shading point as the client states it: normal, view and up to four lobes; the same struct in Rust and in C.

use bytemuck::{Pod, Zeroable};

/// A lobe `weight / pi`.
pub const WIS_WAVELET_LOBE_LAMBERT: u32 = 1;
/// A lobe of Trowbridge-Reitz (GGX) microfacets: `weight F D G / (4 cos cos)` with height-correlated Smith shadowing
/// and Schlick's Fresnel term.
pub const WIS_WAVELET_LOBE_GGX: u32 = 2;
/// A lobe `weight (a + 2) / (2 pi) max(0, r.wi)^a` with r the mirror direction of wo.
pub const WIS_WAVELET_LOBE_PHONG: u32 = 3;
/// A lobe `weight` times the table that is given with the query.
pub const WIS_WAVELET_LOBE_TABLE: u32 = 4;

/// Query flag: wi may lie on either side of the surface; the cosine is |n.wi|.
pub const WIS_WAVELET_QUERY_WHOLE_SPHERE: u32 = 1;
/// Query flag: the values already contain the cosine: it is not multiplied again.
pub const WIS_WAVELET_QUERY_COSINE_INCLUDED: u32 = 2;

/// Lobes in a query.
pub const WIS_WAVELET_MAX_LOBES: usize = 4;

/// One lobe of a BRDF.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Lobe {
    /// WIS_WAVELET_LOBE_LAMBERT, WIS_WAVELET_LOBE_GGX, WIS_WAVELET_LOBE_PHONG or WIS_WAVELET_LOBE_TABLE.
    pub kind: u32,
    /// Linear RGB factor, finite and not negative.
    pub weight: [f32; 3],
    /// GGX: reflectance at normal incidence, RGB in [0, 1]. Others: not read.
    pub f0: [f32; 3],
    /// GGX: alpha along the tangent, 1e-5 to 16. Phong: the exponent, 0 to 1e7. Others: not read.
    pub a: f32,
    /// GGX: alpha along the bitangent, 1e-5 to 16; equal to `a` for an isotropic lobe, never 0. Others: not read.
    pub b: f32,
}

/// A shading point: everything that the product needs to know of it. World space; plain and copyable.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Query {
    /// sizeof(wis_wavelet_query).
    pub size: u32,
    /// WIS_WAVELET_QUERY_* flags, or 0: the upper hemisphere of the normal, the cosine not contained.
    pub flags: u32,
    /// Lobes used, 0 to 4; with 0 there is nothing to sample.
    pub lobe_count: u32,
    /// The shading normal, unit length.
    pub normal: [f32; 3],
    /// The direction of alpha `a`; need not be exactly normal to the normal. All 0, or along the normal: any, if no lobe is
    /// anisotropic; else WIS_INVALID_TRANSFORM.
    pub tangent: [f32; 3],
    /// The direction to the viewer, unit length.
    pub wo: [f32; 3],
    /// The lobes, of which the first lobe_count are read.
    pub lobe: [Lobe; WIS_WAVELET_MAX_LOBES],
}
