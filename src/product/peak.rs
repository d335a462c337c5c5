//! Cells against the peaks of narrow lobes: which cells a lobe asks to refine, and which may hold its peak.

use crate::lobe::Peak;
use crate::simd::Lanes;
use crate::sphere::{Frame, cell_chord};
use crate::wide::vector::{V3, direction_in, dot, splat, subtract};

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

/// Whether cells of a level may be too coarse for a peak.
pub fn is_narrow(peak: &Peak, level: u32) -> bool {
    DETAIL * peak.radii[1] < cell_chord(level)
}

/// Where eight cells lie on the sphere.
pub struct Shape<F: Lanes> {
    centre: V3<F>,
    /// No point of a cell is farther from its centre.
    chord: F,
    /// The vectors from the centres to the middles of the upper edges, of cells small enough to be flat; if none is, 0:
    /// the compiler may compute with them before it looks whether any is, and denormal numbers would be slow.
    half_axes: [V3<F>; 2],
    flat: F::Mask,
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
    /// Cells by the point and the world direction of their centres, their widths, and their chords.
    #[inline(always)]
    pub fn new(frame: &Frame, middle: [F; 2], centre: V3<F>, width: F, chord: F) -> Self {
        let half = F::splat(0.5) * width;
        let [x, y] = middle;
        let flat = width.le(F::splat(FLAT_WIDTH));
        let mut half_axes = [splat([0.0; 3]); 2];
        if F::bits(flat) != 0 {
            let (along, across) = (direction_in(frame, [x + half, y]), direction_in(frame, [x, y + half]));
            half_axes = [subtract(along, centre), subtract(across, centre)];
        }
        Shape { centre, chord, half_axes, flat, area: width * width }
    }

    /// Judges a peak of this value.
    #[inline(always)]
    pub fn judge(&self, peak: &Peak, value: f32) -> Verdict<F> {
        let near = self.is_near(peak, REACH);
        // All that the lobe reflects lies within about twice its half-widths: a coarse leaf holds no more.
        let share = (F::splat(peak.radii[0] * peak.radii[1]) / self.area).min(F::splat(FLOOR));
        Verdict {
            near,
            coarse: F::and(near, F::splat(DETAIL * peak.radii[1]).lt(self.chord)),
            holds: F::and(near, self.is_near(peak, CORE)),
            floor: share * F::splat(value),
        }
    }

    /// Whether the cells overlap the ellipse of `reach` half-widths about a peak.
    #[inline(always)]
    fn is_near(&self, peak: &Peak, reach: f32) -> F::Mask {
        let radii = [reach * peak.radii[0], reach * peak.radii[1]];
        let offset = subtract(splat(peak.direction.to_array()), self.centre);
        let along = dot(offset, offset).sqrt().le(F::splat(radii[0]) + self.chord);
        let across = dot(offset, splat(peak.across.to_array())).abs().le(F::splat(radii[1]) + self.chord);
        let close = F::and(along, across);
        if F::bits(F::and(close, self.flat)) == 0 {
            return close;
        }
        F::select_mask(self.flat, F::and(close, overlaps(peak, radii, offset, self.half_axes)), close)
    }
}

/// Whether an ellipse overlaps the cells: in the coordinates of a cell's half axes the cell is [-1, 1]^2.
#[inline(always)]
fn overlaps<F: Lanes>(peak: &Peak, [long, short]: [f32; 2], offset: V3<F>, axes: [V3<F>; 2]) -> F::Mask {
    let basis = Basis::new(axes);
    let [x, y] = basis.coordinates(offset);
    let u = basis.coordinates(splat((peak.along() * long).to_array()));
    let v = basis.coordinates(splat((peak.across * short).to_array()));
    // A peak on the very border, as symmetric scenes have it, belongs to both sides in spite of rounding.
    let border = F::splat(1.02);
    let within_x = x.abs().le(border + (u[0] * u[0] + v[0] * v[0]).sqrt());
    let within_y = y.abs().le(border + (u[1] * u[1] + v[1] * v[1]).sqrt());
    F::and(within_x, within_y)
}

/// Two axes that need not be orthogonal, and their Gram matrix.
struct Basis<F> {
    axes: [V3<F>; 2],
    gram: [F; 3],
    determinant: F,
}

impl<F: Lanes> Basis<F> {
    #[inline(always)]
    fn new([a, b]: [V3<F>; 2]) -> Self {
        let (aa, ab, bb) = (dot(a, a), dot(a, b), dot(b, b));
        let determinant = (aa * bb - ab * ab).max(F::splat(f32::MIN_POSITIVE));
        Basis { axes: [a, b], gram: [aa, ab, bb], determinant }
    }

    /// The coordinates of a vector's projection on the plane of the axes.
    #[inline(always)]
    fn coordinates(&self, v: V3<F>) -> [F; 2] {
        let [aa, ab, bb] = self.gram;
        let (va, vb) = (dot(v, self.axes[0]), dot(v, self.axes[1]));
        [(va * bb - vb * ab) / self.determinant, (vb * aa - va * ab) / self.determinant]
    }
}
