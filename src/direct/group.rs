//! Candidates side by side: what a register computes with stands together, and so does what a pick reads.

use crate::simd::{GROUP, Num, REGISTERS, places};
use bytemuck::{Pod, Zeroable};

/// Some candidates of a hit, component by component.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Group {
    /// Directions in map space; before, those of portals, and of each other candidate two numbers side by side.
    pub direction: [[f32; GROUP]; 3],
    /// Densities with counts: what a candidate's target is divided by; infinite where a direction does not count. With portals, negative
    /// outside all of them until [`favour_portals`](super::candidates::favour_portals).
    pub density: [f32; GROUP],
    /// Target over density.
    pub weight: [f32; GROUP],
}

impl Group {
    /// The two numbers of each candidate, register by register.
    #[inline(always)]
    pub fn numbers<F: Num>(&self) -> [[F; 2]; REGISTERS] {
        let pairs: &[[f32; 2]; 3 * GROUP / 2] = bytemuck::cast_ref(&self.direction);
        let mut numbers = [[F::splat(0.0); 2]; REGISTERS];
        for (at, numbers) in places::<F>().zip(&mut numbers) {
            *numbers = F::read_pairs(pairs.get(at..).unwrap_or(&[]));
        }
        numbers
    }

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
