//! Where the functions live: the six faces of a cube. Functions are lists of pixels, face after face, and a tree for each face.

use anyhow::Result;
use glam::{Mat3, Vec3};
use wis_ffi_tests::client::{Tree, raw};
use wis_ffi_tests::light::Light;
use wis_ffi_tests::packed::energy;

/// Look-ups along an axis of a pixel that light is averaged over.
const FINE: usize = 4;

/// Squares of 2^depth x 2^depth pixels.
#[derive(Clone, Copy)]
pub struct Domain {
    pub depth: u32,
    faces: usize,
}

impl Domain {
    pub const fn cube(depth: u32) -> Domain {
        Domain { depth, faces: 6 }
    }

    pub fn name(&self) -> String {
        format!("6 x {0} x {0}", 1 << self.depth)
    }

    /// Pixels of all faces.
    pub fn pixels(&self) -> usize {
        self.faces << (2 * self.depth)
    }

    /// Wavelets of all faces.
    pub fn wavelets(&self) -> usize {
        self.pixels() - self.faces
    }

    /// How many squares a share of the wavelets is.
    pub fn terms(&self, share: f64) -> usize {
        (share * self.wavelets() as f64).round() as usize
    }

    /// The direction of a place in a pixel, and the solid angle about it by the mean solid angle.
    pub fn place(&self, i: usize, parts: [f32; 2]) -> (Vec3, f32) {
        let side = 1usize << self.depth;
        let (face, i) = (i / (side * side), i % (side * side));
        let at = |c: usize, part: f32| (c as f32 + part) / side as f32;
        let (u, v) = (at(i % side, parts[0]), at(i / side, parts[1]));
        let (s, t) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        let direction = match face {
            0 => Vec3::new(1.0, -t, -s),
            1 => Vec3::new(-1.0, -t, s),
            2 => Vec3::new(s, 1.0, t),
            3 => Vec3::new(s, -1.0, -t),
            4 => Vec3::new(s, -t, 1.0),
            _ => Vec3::new(-s, -t, -1.0),
        };
        // A face of [-1, 1]^2 has ds dt / r^3 of solid angle; the mean over six faces of area 4 is 4 pi / 24.
        let r = direction.length();
        (direction / r, 24.0 / (4.0 * std::f32::consts::PI) / (r * r * r))
    }

    /// The directions of all pixels.
    pub fn directions(&self) -> Vec<Vec3> {
        (0..self.pixels()).map(|i| self.place(i, [0.5, 0.5]).0).collect()
    }

    /// Radiance of a turned light times solid angle, by the mean solid angle.
    pub fn light(&self, light: &Light, turn: Mat3) -> Vec<f32> {
        let fine = |j: usize| (j as f32 + 0.5) / FINE as f32;
        let pixel = |i: usize| {
            let look_up = |j: usize| {
                let (direction, weight) = self.place(i, [fine(j % FINE), fine(j / FINE)]);
                weight * light.radiance(turn * direction)
            };
            (0..FINE * FINE).map(look_up).sum::<f32>() / (FINE * FINE) as f32
        };
        (0..self.pixels()).map(pixel).collect()
    }

    /// A tree for each face.
    pub fn trees(&self, pixels: &[f32]) -> Result<Vec<Tree>> {
        pixels.chunks(1 << (2 * self.depth)).map(|face| Ok(Tree::new(self.depth, 0.0, face)?)).collect()
    }

    /// All wavelets, face by face.
    pub fn all(&self, trees: &[Tree]) -> Result<Lists> {
        Ok(trees.iter().map(|tree| tree.largest(3 << (2 * self.depth))).collect::<Result<_, _>>()?)
    }

    /// The largest squares of all faces together, face by face.
    pub fn largest(&self, trees: &[Tree], keep: usize) -> Result<Lists> {
        Ok(largest(self.all(trees)?, keep))
    }

    /// The mean over the sphere of something that is summed over faces.
    pub fn mean(&self, sum: f64) -> f64 {
        sum / self.faces as f64
    }
}

/// Wavelets of each face.
pub type Lists = Vec<Vec<raw::wis_wavelets>>;

/// The largest of all faces' squares, by the rule of WIS_SELECT_SQUARES.
pub fn largest(mut lists: Lists, keep: usize) -> Lists {
    let mut sizes: Vec<f64> = lists.iter().flatten().map(energy).filter(|size| *size > 0.0).collect();
    if sizes.len() > keep {
        let least = *sizes.select_nth_unstable_by(keep.max(1) - 1, |a, b| b.total_cmp(a)).1;
        lists.iter_mut().for_each(|list| list.retain(|w| energy(w) >= least));
    }
    lists
}
