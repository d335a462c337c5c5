//! Eight cells side by side: the floor under their corners, what they weigh as leaves, and what splitting them is worth.

use super::peak::{Axes, Family, Narrow, Shape, Verdict};
use super::{LEAF_FLOOR, Parts};
use crate::sphere::Frame;
use crate::wavelets::lanes::sphere::direction_in;
use crate::wavelets::lanes::sphere::to_world;
use crate::wavelets::lanes::vector::{V3, dot, splat};
use crate::wavelets::lanes::{LANES, Lanes};
use crate::wavelets::lobe::{MAX_PEAKS, Peak};
use glam::Vec3;

/// What bounds the BRDF from below.
pub struct Floors<'a> {
    pub frame: &'a Frame,
    /// The normal of the hemisphere outside which the BRDF is 0.
    pub hemisphere: Option<Vec3>,
    /// The least value of a corner in a leaf that reaches above the horizon (rule 16 of the design).
    pub least: f32,
    /// The peaks of narrow lobes.
    pub peaks: [Option<Narrow>; MAX_PEAKS],
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

/// Eight cells that are about to be split, as the peaks see their children.
pub struct Families<F: Lanes> {
    axes: Axes<F>,
    of_peaks: [Family<F>; MAX_PEAKS],
    /// The lanes whose children are small enough, as bits.
    flat: u32,
}

impl<F: Lanes> Families<F> {
    /// From the world directions of the new points, as [`Axes::new`] takes them, and the width of the children.
    #[inline(always)]
    pub fn new(floors: &Floors, new: [V3<F>; 5], width: F) -> Self {
        let axes = Axes::new(new);
        let first = floors.peaks[0].map_or(Peak::disc(Vec3::Z, 1.0), |narrow| narrow.peak);
        let mut of_peaks = [axes.family(&first, width); MAX_PEAKS];
        for (family, narrow) in of_peaks.iter_mut().zip(floors.peaks.iter().flatten()).skip(1) {
            *family = axes.family(&narrow.peak, width);
        }
        Families { axes, of_peaks, flat: F::bits(Axes::are_flat(width)) }
    }
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

    /// Raises the corners of cells to the floor: of the `c`-th children of families, or of any cells.
    #[inline(always)]
    pub fn raise<F: Lanes>(&self, cells: &Eight<F>, children: Option<(&Families<F>, u32)>) -> Raised<F> {
        let zero = F::splat(0.0);
        let [a, b, c, d] = cells.corners;
        let largest = a.max(b).max(c.max(d));
        let mut floor = (F::splat(LEAF_FLOOR) * largest).max(F::splat(self.least));
        let (mut near, mut coarse) = (0, 0);
        let nearby = cells.near & cells.lanes;
        let flat = nearby & children.map_or(0, |(families, _)| families.flat);
        let dark = F::bits(largest.le(zero)) & cells.lanes;
        if dark | nearby & !flat != 0 {
            let centre = self.centres(cells);
            // Four dark corners do not mean a dark cell: one that reaches above the horizon keeps the least value.
            if let Some(normal) = self.hemisphere {
                let height = dot(splat(normal.to_array()), centre);
                let above = zero.le(height + cells.chord);
                let known = F::select(above, floor, F::splat(-1.0));
                floor = F::select(F::mask(dark), known, floor);
            }
            if nearby & !flat != 0 {
                // Without this the cells at a narrow peak, whose corners are all dark, are missed.
                let shape = Shape { centre, chord: cells.chord, width: cells.width };
                for narrow in self.peaks.iter().flatten() {
                    let verdict = shape.judge(narrow);
                    heed(&verdict, nearby & !flat, [&mut near, &mut coarse], &mut floor);
                }
            }
        }
        if let Some((families, c)) = children.filter(|_| flat != 0) {
            for (narrow, family) in self.peaks.iter().flatten().zip(&families.of_peaks) {
                let verdict = families.axes.judge(family, narrow, c, cells.index, [cells.width, cells.chord]);
                heed(&verdict, flat, [&mut near, &mut coarse], &mut floor);
            }
        }
        let reaches = zero.le(floor);
        // What lies below the horizon stays negative where nothing but the largest corner sets the floor: the leaf then
        // has its floor below the horizon, and not what a straight line from 0 has.
        let (own_floor, lowest) = (floor.le(F::splat(LEAF_FLOOR) * largest), zero - largest);
        let mut corners = cells.corners;
        for corner in &mut corners {
            let below = F::and(own_floor, corner.lt(zero));
            *corner = F::only(reaches, F::select(below, corner.max(lowest), corner.max(floor)));
        }
        Raised { corners, near, coarse }
    }

    /// The world directions of the centres of cells.
    #[inline(always)]
    fn centres<F: Lanes>(&self, cells: &Eight<F>) -> V3<F> {
        if let Some([x, y, z]) = cells.centres {
            return to_world(self.frame, [F::from_array(*x), F::from_array(*y), F::from_array(*z)]);
        }
        let (half, [x, y]) = (F::splat(0.5), cells.index);
        direction_in(self.frame, [(x + half) * cells.width, (y + half) * cells.width])
    }
}

/// Takes the verdict on some lanes into account; the floor of cells below the horizon stays where it is.
#[inline(always)]
fn heed<F: Lanes>(verdict: &Verdict<F>, lanes: u32, [near, coarse]: [&mut u32; 2], floor: &mut F) {
    *near |= F::bits(verdict.near) & lanes;
    *coarse |= F::bits(verdict.coarse) & lanes;
    let holds = F::and(verdict.holds, F::and(F::splat(0.0).le(*floor), F::mask(lanes)));
    *floor = F::select(holds, floor.max(verdict.floor), *floor);
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
    let zero = F::splat(0.0);
    let [a, b, c, d] = [corners[0].max(zero), corners[1].max(zero), corners[2].max(zero), corners[3].max(zero)];
    let mean = F::splat(0.25) * ((a + b) + (c + d));
    let spread = a.max(b).max(c.max(d)) - a.min(b).min(c.min(d));
    let error = F::splat(0.35) * beyond + F::splat(0.03) * spread;
    let worth = width * width * light * error * error / (mean + F::splat(0.3) * error);
    F::only(zero.lt(mean), worth)
}
