//! What samplers of a density answer: a direction and its pdf.

use bytemuck::{Pod, Zeroable};

/// A direction in world space and its pdf per solid angle; a pdf of 0 means that there is no sample.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Sample {
    /// The direction towards the light, unit length, world space.
    pub wi: [f32; 3],
    /// The probability density per solid angle; 0: no sample.
    pub pdf: f32,
}
