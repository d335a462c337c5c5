//! Cells against the peaks of narrow lobes: which cells a lobe asks to refine, and which may hold its peak.

use crate::lobe::Peak;
use crate::simd::Lanes;
use crate::wide::vector::{V3, dot, splat, subtract};

/// Cells are refined where they overlap the ellipse of this many half-widths about a peak ...
const REACH: f32 = 1.5;
/// ... until they are smaller than this many of its short half-widths.
const DETAIL: f32 = 2.5;
/// A leaf that overlaps the ellipse of this many half-widths may hold the peak itself.
const CORE: f32 = 0.5;
/// Cells of this level and finer are flat enough to be taken as parallelograms.
const FLAT_WIDTH: f32 = 1.0 / 32.0;
/// No leaf is darker than this share of a peak that it may hold.
const FLOOR: f32 = 0.1;

/// Where eight cells lie on the sphere.
pub struct Shape<F: Lanes> {
    centre: V3<F>,
    /// No point of a cell is farther from its centre.
    chord: F,
    /// The cells that are small enough to be flat, and their half axes.
    flat: F::Mask,
    basis: Basis<F>,
    area: F,
}

/// What a peak means to eight cells.
pub struct Verdict<F: Lanes> {
    /// They lie near it.
    pub near: F::Mask,
    /// They do, and are too coarse for it.
    pub coarse: F::Mask,
    /// They may hold it, and then are not darker than this.
    pub holds: F::Mask,
    /// The floor of cells that hold it.
    pub floor: F,
}

impl<F: Lanes> Shape<F> {
    /// Cells by the world directions of their centres, the vectors from there to the middles of their upper edges
    /// (which matter only for small cells), their widths, and their chords.
    #[inline(always)]
    pub fn new(centre: V3<F>, half_axes: [V3<F>; 2], width: F, chord: F) -> Self {
        Shape { centre, chord, flat: width.le(F::splat(FLAT_WIDTH)), basis: Basis::new(half_axes), area: width * width }
    }

    /// Judges a peak of this value.
    #[inline(always)]
    pub fn judge(&self, peak: &Peak, value: f32) -> Verdict<F> {
        let offset = subtract(splat(peak.direction.to_array()), self.centre);
        let distance = dot(offset, offset).sqrt();
        let across = dot(offset, splat(peak.across.to_array())).abs();
        let mut near = self.is_close(peak, REACH, distance, across);
        let mut core = self.is_close(peak, CORE, distance, across);
        if F::bits(F::and(near, self.flat)) != 0 {
            let ellipse = Ellipse::new(peak, offset, &self.basis);
            near = F::select_mask(self.flat, F::and(near, ellipse.overlaps(REACH)), near);
            core = F::select_mask(self.flat, F::and(core, ellipse.overlaps(CORE)), core);
        }
        // All that the lobe reflects lies within about twice its half-widths: a coarse leaf holds no more.
        let share = (F::splat(peak.radii[0] * peak.radii[1]) / self.area).min(F::splat(FLOOR));
        Verdict {
            near,
            coarse: F::and(near, F::splat(DETAIL * peak.radii[1]).lt(self.chord)),
            holds: F::and(near, core),
            floor: share * F::splat(value),
        }
    }

    /// Whether the cells may overlap the ellipse of `reach` half-widths about a peak, by their chords.
    #[inline(always)]
    fn is_close(&self, peak: &Peak, reach: f32, distance: F, across: F) -> F::Mask {
        let [long, short] = [F::splat(reach * peak.radii[0]), F::splat(reach * peak.radii[1])];
        F::and(distance.le(long + self.chord), across.le(short + self.chord))
    }
}

/// The ellipse of one half-width about a peak in the coordinates of eight cells' half axes: a cell is [-1, 1]^2.
struct Ellipse<F> {
    centre: [F; 2],
    extent: [F; 2],
}

impl<F: Lanes> Ellipse<F> {
    #[inline(always)]
    fn new(peak: &Peak, offset: V3<F>, basis: &Basis<F>) -> Self {
        let [x, y] = basis.coordinates(offset);
        let u = basis.coordinates(splat((peak.along() * peak.radii[0]).to_array()));
        let v = basis.coordinates(splat((peak.across * peak.radii[1]).to_array()));
        let extent = [(u[0] * u[0] + v[0] * v[0]).sqrt(), (u[1] * u[1] + v[1] * v[1]).sqrt()];
        Ellipse { centre: [x.abs(), y.abs()], extent }
    }

    /// Whether the ellipse of `reach` half-widths overlaps the cells.
    #[inline(always)]
    fn overlaps(&self, reach: f32) -> F::Mask {
        // A peak on the very border, as symmetric scenes have it, belongs to both sides in spite of rounding.
        let (border, reach) = (F::splat(1.02), F::splat(reach));
        let within_x = self.centre[0].le(border + reach * self.extent[0]);
        let within_y = self.centre[1].le(border + reach * self.extent[1]);
        F::and(within_x, within_y)
    }
}

/// Two axes that need not be orthogonal, and the inverse of their Gram matrix.
struct Basis<F> {
    axes: [V3<F>; 2],
    inverse: [F; 3],
}

impl<F: Lanes> Basis<F> {
    #[inline(always)]
    fn new([a, b]: [V3<F>; 2]) -> Self {
        let (aa, ab, bb) = (dot(a, a), dot(a, b), dot(b, b));
        let factor = F::splat(1.0) / (aa * bb - ab * ab).max(F::splat(f32::MIN_POSITIVE));
        Basis { axes: [a, b], inverse: [bb * factor, ab * factor, aa * factor] }
    }

    /// The coordinates of a vector's projection on the plane of the axes.
    #[inline(always)]
    fn coordinates(&self, v: V3<F>) -> [F; 2] {
        let [bb, ab, aa] = self.inverse;
        let (va, vb) = (dot(v, self.axes[0]), dot(v, self.axes[1]));
        [va * bb - vb * ab, vb * aa - va * ab]
    }
}
