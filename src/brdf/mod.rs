//! BRDFs as sums of lobes: a material has their shapes, a point their weights, a surface is both, ready to evaluate.
//!
//! All lobes live in the frame of tangent, bitangent and normal, on the side of wo. They are written once for any width of
//! [`crate::simd::Num`]. A lobe tells its luminance, draws directions and knows their density.

pub mod compare;
pub mod ggx;
pub mod lambert;
pub mod material;
pub mod phong;
pub mod point;
pub mod portal;
pub mod surface;
pub mod vector;
