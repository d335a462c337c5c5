//! Eight cells side by side: the floor under their corners, what they weigh as leaves, and what splitting them is worth.

use super::Parts;
use super::peak::Shape;
use crate::lobe::{MAX_PEAKS, Peak};
use crate::simd::{LANES, Lanes};
use crate::sphere::Frame;
use crate::wide::sphere::to_world;
use crate::wide::vector::{direction_in, dot, splat};
use glam::Vec3;

/// No leaf that reaches above the horizon is darker than this share of its largest corner.
const LEAF_FLOOR: f32 = 0.05;

/// What bounds the BRDF from below.
pub struct Floors<'a> {
    pub frame: &'a Frame,
    /// The normal of the hemisphere outside which the BRDF is 0.
    pub hemisphere: Option<Vec3>,
    /// How far the horizon lies below that hemisphere's.
    pub horizon: f32,
    /// The least value of a corner in a leaf that reaches above the horizon (rule 16 of the design).
    pub least: f32,
    /// The narrow lobes and their values at the peak.
    pub peaks: [Option<(Peak, f32)>; MAX_PEAKS],
}

/// Eight cells.
pub struct Eight<F> {
    /// BRDF x cosine at their corners.
    pub corners: [F; 4],
    /// Their places along both axes.
    pub index: [F; 2],
    pub width: F,
    /// No point of a cell is farther from its centre.
    pub chord: F,
    /// The lanes in use, and those that may lie near a peak, as bits.
    pub lanes: u32,
    pub near: u32,
    /// The directions of their centres in map space, if they are known.
    pub centres: Option<&'static [[f32; LANES]; 3]>,
}

/// The corners of eight cells, not below the floor, and the lanes that lie near a peak or are too coarse for one.
pub struct Raised<F> {
    /// 0 if a cell is wholly below the horizon.
    pub corners: [F; 4],
    pub near: u32,
    pub coarse: u32,
}

impl Floors<'_> {
    /// Whether there are narrow lobes.
    pub fn has_peaks(&self) -> bool {
        self.peaks[0].is_some()
    }

    /// Raises the corners of cells to the floor.
    #[inline(always)]
    pub fn raise<F: Lanes>(&self, cells: &Eight<F>) -> Raised<F> {
        let zero = F::splat(0.0);
        let [a, b, c, d] = cells.corners;
        let (largest, smallest) = (a.max(b).max(c.max(d)), a.min(b).min(c.min(d)));
        let mut floor = (F::splat(LEAF_FLOOR) * largest).max(F::splat(self.least));
        let (mut near, mut coarse) = (0, 0);
        let nearby = cells.near & cells.lanes;
        let unsure = (F::bits(smallest.le(zero)) | nearby) & cells.lanes;
        if unsure != 0 {
            let (half, [x, y]) = (F::splat(0.5), cells.index);
            let middle = [(x + half) * cells.width, (y + half) * cells.width];
            let centre = match cells.centres {
                Some([x, y, z]) => to_world(self.frame, [F::from_array(*x), F::from_array(*y), F::from_array(*z)]),
                None => direction_in(self.frame, middle),
            };
            // Four dark corners do not mean a dark cell: one that reaches above the horizon keeps the least value.
            if let Some(normal) = self.hemisphere {
                let height = dot(splat(normal.to_array()), centre);
                let above = zero.le(height + cells.chord + F::splat(self.horizon));
                let known = F::select(above, floor, F::splat(-1.0));
                floor = F::select(F::mask(unsure), known, floor);
            }
            if nearby != 0 {
                // Without this the cells at a narrow peak, whose corners are all dark, are missed.
                let shape = Shape::new(self.frame, middle, centre, cells.width, cells.chord);
                for (peak, value) in self.peaks.iter().flatten() {
                    let verdict = shape.judge(peak, *value);
                    near |= F::bits(verdict.near);
                    coarse |= F::bits(verdict.coarse);
                    let holds = F::and(verdict.holds, F::and(zero.le(floor), F::mask(nearby)));
                    floor = F::select(holds, floor.max(verdict.floor), floor);
                }
            }
        }
        let reaches = zero.le(floor);
        let mut corners = cells.corners;
        for corner in &mut corners {
            *corner = F::only(reaches, corner.max(floor));
        }
        Raised { corners, near: near & nearby, coarse: coarse & nearby }
    }
}

/// The average products over leaves, as the descent below them sees them, given the light of each quarter.
#[inline(always)]
pub fn leaf_weight<F: Lanes>(corners: [F; 4], light: [F; 4]) -> F {
    let [a, b, c, d] = Parts::whole(corners).masses(light);
    F::splat(0.25) * ((a + b) + (c + d))
}

/// What splitting leaves is worth: about how much of the variance of a sample's weight they cause. `beyond`: how far
/// their corners are from what the cells above them would have given.
#[inline(always)]
pub fn worth<F: Lanes>(corners: [F; 4], beyond: F, light: F, width: F) -> F {
    let [a, b, c, d] = corners;
    let mean = F::splat(0.25) * ((a + b) + (c + d));
    let spread = a.max(b).max(c.max(d)) - a.min(b).min(c.min(d));
    let error = F::splat(0.35) * beyond + F::splat(0.03) * spread;
    let worth = width * width * light * error * error / (mean + F::splat(0.3) * error);
    F::only(F::splat(0.0).lt(mean), worth)
}
