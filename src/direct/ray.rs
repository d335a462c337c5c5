//! A ray that the library asks the client to trace.

use bytemuck::{Pod, Zeroable};

/// A direction to trace, and what the light that comes from it counts.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Ray {
    /// The direction towards the light, unit length, world space.
    pub wi: [f32; 3],
    /// What f x cosine x L x V is multiplied by.
    pub weight: f32,
}
