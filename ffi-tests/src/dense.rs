//! The limit of rule 34: sampling of the product from all cells of a fine grid, without floor or dilation. Cells in
//! which the light varies are sampled in 16 x 16 parts. It takes about a millisecond for a point and is a yardstick: what variance is left comes from visibility.

use crate::lanes::{F8, LANES, V8};
use crate::light::{Light, octahedral_direction};
use crate::material::Bsdf;
use glam::Vec3;
use std::collections::HashMap;
use std::f32::consts::PI;

/// Cells along an axis of the octahedral square.
const SIDE: usize = 512;
const LEVELS: usize = 9;
/// Parts along an axis of a cell in which the light varies, so that a sun of a texel is found within its cell.
const PARTS: usize = 16;
/// Cells vary if looks into them differ by more than this factor.
const VARIES: f32 = 1.2;

/// The mean luminance of every cell in the world's frame, and the directions of their centres, in Morton order.
pub struct Grid {
    luminance: Vec<F8>,
    centre: Vec<V8>,
    /// Where the light varies: what the parts of the cell sum up to, in order.
    parts: HashMap<usize, Vec<f32>>,
}

impl Grid {
    pub fn new(light: &Light) -> Grid {
        let cell = |code: usize| (compact(code), compact(code >> 1));
        let look = |code: usize, k: usize, i: usize| {
            let (x, y) = cell(code);
            let at = |c: usize, part: usize| (c as f32 + (part as f32 + 0.5) / k as f32) / SIDE as f32;
            light.radiance(octahedral_direction(at(x, i % k), at(y, i / k)))
        };
        let (mut rows, mut parts) = (vec![0.0; SIDE * SIDE], HashMap::new());
        for code in 0..SIDE * SIDE {
            let looks: [f32; 16] = std::array::from_fn(|i| look(code, 4, i));
            let (x, y) = cell(code);
            let mean = |looks: &[f32]| looks.iter().sum::<f32>() / looks.len() as f32;
            let [least, most] = looks.iter().fold([f32::MAX, 0.0_f32], |[a, b], &l| [a.min(l), b.max(l)]);
            rows[y * SIDE + x] = mean(&looks);
            if most > VARIES * least {
                let fine: Vec<f32> = (0..PARTS * PARTS).map(|i| look(code, PARTS, i)).collect();
                rows[y * SIDE + x] = mean(&fine);
                let mut sum = 0.0;
                let sums = fine.iter().map(|l| {
                    sum += l;
                    sum
                });
                parts.insert(code, sums.collect());
            }
        }
        let centre = |code: usize| {
            let (x, y) = cell(code);
            let at = |c: usize| (c as f32 + 0.5) / SIDE as f32;
            octahedral_direction(at(x), at(y))
        };
        let blocks = || (0..SIDE * SIDE).step_by(LANES);
        let lanes = |first: usize, of: &dyn Fn(usize) -> f32| F8::new(std::array::from_fn(|i| of(first + i)));
        let luminance = |code: usize| {
            let (x, y) = cell(code);
            rows[y * SIDE + x]
        };
        let directions = |first: usize| {
            let axis = |k: usize| lanes(first, &|code| centre(code)[k]);
            V8::new(axis(0), axis(1), axis(2))
        };
        Grid {
            luminance: blocks().map(|first| lanes(first, &luminance)).collect(),
            centre: blocks().map(directions).collect(),
            parts,
        }
    }
}

/// Every second bit.
fn compact(code: usize) -> usize {
    (0..LEVELS).fold(0, |bits, i| bits | (code >> (2 * i) & 1) << i)
}

/// The product at a point: sums over the cells of all levels, the finest first, in Morton order.
#[derive(Default)]
pub struct Dense {
    levels: Vec<Vec<f32>>,
}

impl Dense {
    pub fn prepare(&mut self, grid: &Grid, bsdf: &Bsdf) {
        self.levels.resize_with(LEVELS + 1, Vec::new);
        let finest = &mut self.levels[0];
        finest.clear();
        for (&luminance, &centre) in grid.luminance.iter().zip(&grid.centre) {
            finest.extend_from_slice((luminance * bsdf.eval(centre, LANES).0).as_array_ref());
        }
        for level in 1..=LEVELS {
            let (finer, coarser) = self.levels.split_at_mut(level);
            coarser[0].clear();
            coarser[0].extend(finer[level - 1].chunks_exact(4).map(|c| (c[0] + c[1]) + (c[2] + c[3])));
        }
    }

    /// A direction and its pdf; 0 if the product is black.
    pub fn sample(&self, grid: &Grid, mut u: [f32; 2]) -> (Vec3, f32) {
        let (mut code, mut density) = (0, 1.0);
        let (mut x, mut y) = (0, 0);
        for level in (0..LEVELS).rev() {
            let children: [f32; 4] = std::array::from_fn(|i| self.levels[level][4 * code + i]);
            let (low, high) = (children[0] + children[1], children[2] + children[3]);
            if low + high <= 0.0 {
                return (Vec3::Z, 0.0);
            }
            let up = take(&mut u[1], low / (low + high), &mut density);
            let pair = &children[2 * up..2 * up + 2];
            let right = take(&mut u[0], pair[0] / (pair[0] + pair[1]), &mut density);
            (code, x, y) = (4 * code + 2 * up + right, 2 * x + right, 2 * y + up);
        }
        if let Some(sums) = grid.parts.get(&code) {
            // Rows of parts along one axis of u, then the parts of a row along the other.
            let total = sums[PARTS * PARTS - 1];
            let before = |i: usize| if i == 0 { 0.0 } else { sums[i - 1] };
            let target = u[1] * total;
            let row = (0..PARTS - 1).position(|row| before((row + 1) * PARTS) > target).unwrap_or(PARTS - 1);
            let (low, high) = (before(row * PARTS), before((row + 1) * PARTS));
            let inside = |low: f32, high: f32, target: f32| ((target - low) / (high - low)).clamp(0.0, 0.999_999_9);
            u[1] = (row as f32 + inside(low, high, target)) / PARTS as f32;
            let target = low + u[0] * (high - low);
            let columns = row * PARTS..(row + 1) * PARTS - 1;
            let part = columns.clone().find(|&i| sums[i] > target).unwrap_or(columns.end);
            u[0] = ((part % PARTS) as f32 + inside(before(part), sums[part], target)) / PARTS as f32;
            density *= (sums[part] - before(part)) / total * (PARTS * PARTS) as f32;
        }
        let at = |cell: usize, u: f32| (cell as f32 + u) / SIDE as f32;
        (octahedral_direction(at(x, u[0]), at(y, u[1])), density / (4.0 * PI))
    }
}

/// Chooses the lower (0) or the upper side (1) of a split and stretches `u` over it.
fn take(u: &mut f32, lower: f32, density: &mut f32) -> usize {
    let upper = usize::from(*u >= lower);
    let (start, share) = if upper == 0 { (0.0, lower) } else { (lower, 1.0 - lower) };
    *u = ((*u - start) / share).clamp(0.0, 0.999_999_9);
    *density *= 2.0 * share;
    upper
}
