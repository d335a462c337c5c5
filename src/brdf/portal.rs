//! A rectangle that light comes through, as clients hand it in.

use bytemuck::{Pod, Zeroable};

/// The most portals of a point.
pub const MAX_PORTALS: usize = 8;

/// A rectangle that light comes through, such as a window, in world space. `edges[0]` x `edges[1]` points into the room. A portal that is
/// seen from behind or from its plane, or has no area, is left out: zeros are no portal.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Portal {
    /// A corner less the position of the shading point.
    pub corner: [f32; 3],
    /// The two edges that begin there, at right angles within 1e-3.
    pub edges: [[f32; 3]; 2],
}
