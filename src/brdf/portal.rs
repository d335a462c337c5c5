//! A rectangle that light comes through, as clients hand it in.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

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

impl Portal {
    /// Whether it has an area: zeros are no portal.
    pub fn is_given(&self) -> bool {
        self.normal() != Vec3::ZERO
    }

    /// Whether it faces the point that it is relative to.
    pub fn faces(&self) -> bool {
        Vec3::from_array(self.corner).dot(self.normal()) < 0.0
    }

    fn normal(&self) -> Vec3 {
        let [a, b] = self.edges.map(Vec3::from_array);
        a.cross(b)
    }
}
