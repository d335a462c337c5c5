//! The first values of the BRDF at a shading point: on a grid of 4 x 4 cells of the square, and at its peaks.

use crate::lobe::{Asked, Brdf, MAX_PEAKS};
use crate::numeric::{exponent, max};
use crate::simd::{LANES, Lanes};
use crate::sphere::Frame;
use crate::status::Result;
use crate::wide::ALL;
use crate::wide::vector::{lanes_of, splat};
use glam::Vec3;

/// Eight directions each that hold the base and the peaks.
const GROUPS: usize = (BASE.len() + MAX_PEAKS).div_ceil(LANES);

/// The directions of the corners of 4 x 4 cells: 25 grid points, of which the folded edges leave 18.
pub const BASE: [[f32; 3]; 18] = {
    const H: f32 = 0.661_437_8;
    const D: f32 = core::f32::consts::FRAC_1_SQRT_2;
    [
        [0.0, 0.0, -1.0],
        [-H, 0.0, -0.75],
        [-1.0, 0.0, 0.0],
        [0.0, -H, -0.75],
        [-D, -D, 0.0],
        [-H, 0.0, 0.75],
        [-D, D, 0.0],
        [0.0, H, -0.75],
        [0.0, -1.0, 0.0],
        [0.0, -H, 0.75],
        [0.0, 0.0, 1.0],
        [0.0, H, 0.75],
        [0.0, 1.0, 0.0],
        [D, -D, 0.0],
        [H, 0.0, 0.75],
        [D, D, 0.0],
        [H, 0.0, -0.75],
        [1.0, 0.0, 0.0],
    ]
};

/// Which of [`BASE`] is the grid point (i, j), both 0 to 4.
const GRID: [[u8; 5]; 5] =
    [[0, 1, 2, 1, 0], [3, 4, 5, 6, 7], [8, 9, 10, 11, 12], [3, 13, 14, 15, 7], [0, 16, 17, 16, 0]];

/// The first values of the BRDF, and what follows from them.
pub struct Base {
    values: [f32; BASE.len()],
    /// The values at the peaks.
    pub peaks: [f32; MAX_PEAKS],
    /// The mean of the values above the horizon.
    pub mean: f32,
    /// Values times 2^-exponent are ordinary numbers.
    pub exponent: i32,
    pub evaluations: u32,
}

impl Base {
    /// Evaluates the base directions and the peaks.
    #[inline(always)]
    pub fn evaluate<F: Lanes, B: Brdf>(frame: &Frame, brdf: &mut B) -> Result<Base> {
        let mut directions = [Vec3::Z; GROUPS * LANES];
        let hemisphere = brdf.hemisphere();
        let mut count = BASE.len();
        for (slot, base) in directions.iter_mut().zip(BASE) {
            *slot = frame.to_world(Vec3::from_array(base));
        }
        for (slot, peak) in directions.iter_mut().skip(BASE.len()).zip(brdf.peaks()) {
            *slot = peak.direction;
            count += 1;
        }
        let mut wi = [Asked { wi: splat([0.0, 0.0, 1.0]), lanes: 0 }; GROUPS];
        for (group, (asked, eight)) in wi.iter_mut().zip(directions.chunks_exact(LANES)).enumerate() {
            if let Some(eight) = eight.first_chunk() {
                *asked = Asked { wi: lanes_of(eight), lanes: below(count.saturating_sub(group * LANES)) };
            }
        }
        let mut f_cos = [F::splat(0.0); GROUPS];
        brdf.eval(&wi, &mut f_cos)?;
        let mut values = [0.0; GROUPS * LANES];
        for (eight, f_cos) in values.chunks_exact_mut(LANES).zip(f_cos) {
            eight.copy_from_slice(&f_cos.to_array());
        }
        let values = values.get(..count).unwrap_or(&[]);
        let largest = values.iter().fold(0.0, |a, &b| max(a, b));
        let above = |wi: &Vec3| hemisphere.is_none_or(|n| n.dot(*wi) > 0.0);
        let lit = directions.iter().zip(values).take(BASE.len()).filter(|(wi, _)| above(wi));
        let (sum, lit) = lit.fold((0.0f64, 0.0f64), |(sum, n), (_, v)| (sum + f64::from(*v), n + 1.0));
        let mut base = [0.0; BASE.len()];
        let mut peaks = [0.0; MAX_PEAKS];
        for (slot, value) in base.iter_mut().chain(&mut peaks).zip(values) {
            *slot = *value;
        }
        Ok(Base {
            values: base,
            peaks,
            mean: (sum / if lit > 0.0 { lit } else { 1.0 }) as f32,
            // Within what an f32 holds as a factor, also for the values of denormal BRDFs and if all are 0.
            exponent: if largest > 0.0 { exponent(f64::from(largest)).clamp(-126, 126) } else { -126 },
            evaluations: count as u32,
        })
    }

    /// The value at a grid point of the 4 x 4 cells.
    pub fn at(&self, i: usize, j: usize) -> f32 {
        let direction = GRID.get(i).and_then(|row| row.get(j)).copied().unwrap_or(0);
        self.values.get(usize::from(direction)).copied().unwrap_or(0.0)
    }
}

/// The bits of the first lanes.
fn below(count: usize) -> u32 {
    if count < LANES { (1 << count) - 1 } else { ALL }
}
