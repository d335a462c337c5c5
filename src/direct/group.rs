//! Candidates side by side: what a register computes with stands together, and so does what a pick reads.

use crate::simd::{GROUP, Num};
use bytemuck::{Pod, Zeroable};

/// Some candidates of a hit, component by component.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Group {
    /// Directions in map space; of portals also before candidates are weighed.
    pub direction: [[f32; GROUP]; 3],
    /// Densities with counts: what a candidate's target is divided by; infinite where a direction does not count. With portals, negative
    /// outside all of them until [`favour_portals`](super::candidates::favour_portals).
    pub density: [f32; GROUP],
    /// Target over density.
    pub weight: [f32; GROUP],
}

impl Group {
    /// The directions from a candidate on.
    #[inline(always)]
    pub fn directions<F: Num>(&self, at: usize) -> [F; 3] {
        let [x, y, z] = &self.direction;
        [F::at(x, at), F::at(y, at), F::at(z, at)]
    }

    /// Writes directions from a candidate on.
    #[inline(always)]
    pub fn put_direction<F: Num>(&mut self, at: usize, direction: [F; 3]) {
        for (component, out) in direction.into_iter().zip(&mut self.direction) {
            component.write(out, at);
        }
    }

    /// Direction, density and weight of each candidate.
    pub fn each(&mut self) -> impl Iterator<Item = ([f32; 3], &mut f32, &mut f32)> {
        let [x, y, z] = &self.direction;
        let places = x.iter().zip(y).zip(z).map(|((x, y), z)| [*x, *y, *z]);
        places.zip(&mut self.density).zip(&mut self.weight).map(|((place, density), weight)| (place, density, weight))
    }
}
