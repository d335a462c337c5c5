//! Cells against the peaks of narrow lobes: which cells a lobe asks to refine, and which may hold its peak.

use crate::sphere::cell_chord;
use crate::wavelets::lanes::Lanes;
use crate::wavelets::lanes::vector::{V3, dot, splat, subtract};
use crate::wavelets::lobe::Peak;

/// Cells are refined where they overlap the ellipse about a peak of so many half-widths ...
const REACH: f32 = 1.2;
/// ... and of this distance on the unit sphere besides: the tails of a narrow lobe are many half-widths long, ...
const MARGIN: f32 = 0.05;
/// ... but of no more half-widths than this.
const FARTHEST: f32 = 4.0;
/// A cell as far across as the ellipse and so many of its short half-widths is not refined any more.
const DETAIL: f32 = 1.3;
/// A leaf that overlaps the ellipse of this many half-widths may hold the peak itself.
const CORE: f32 = 0.5;
/// Cells of this width and smaller are flat enough to be taken as parallelograms.
const FLAT_WIDTH: f32 = 1.0 / 32.0;
/// How much wider than they are the cells are taken to be, as a multiple of their widths on the square.
const BENT: f32 = 4.0;
/// No leaf is darker than this share of a peak that it may hold.
const FLOOR: f32 = 0.1;

/// So many half-widths about a peak cells are refined.
fn reach(peak: &Peak) -> f32 {
    let reach = REACH + MARGIN / peak.radii[0];
    if reach < FARTHEST { reach } else { FARTHEST }
}

/// Cells of no more than this chord are fine enough for a peak.
fn fine_enough(peak: &Peak) -> f32 {
    (DETAIL + reach(peak)) * peak.radii[1]
}

/// Whether cells of a level may be too coarse for a peak.
pub fn is_narrow(peak: &Peak, level: u32) -> bool {
    fine_enough(peak) < cell_chord(level)
}

/// The peak of a narrow lobe.
#[derive(Clone, Copy)]
pub struct Narrow {
    pub peak: Peak,
    /// The lobe's value there.
    pub value: f32,
    /// Where it is on the square.
    pub place: [f32; 2],
}

/// Where eight cells lie on the sphere, which may be anything between a quarter of it and a point.
pub struct Shape<F: Lanes> {
    /// The world directions of the centres.
    pub centre: V3<F>,
    /// No point of a cell is farther from its centre.
    pub chord: F,
    pub width: F,
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
    /// Judges a peak.
    #[inline(always)]
    pub fn judge(&self, &Narrow { ref peak, value, .. }: &Narrow) -> Verdict<F> {
        let near = self.is_near(peak, reach(peak));
        Verdict {
            near,
            coarse: F::and(near, is_coarse(peak, self.chord)),
            holds: F::and(near, self.is_near(peak, CORE)),
            floor: floor(peak, value, self.width),
        }
    }

    /// Whether the cells overlap the ellipse of `reach` half-widths about a peak.
    #[inline(always)]
    fn is_near(&self, peak: &Peak, reach: f32) -> F::Mask {
        let offset = subtract(splat(peak.direction.to_array()), self.centre);
        let distance = dot(offset, offset).sqrt();
        is_close(peak, reach, distance, dot(offset, splat(peak.across.to_array())), self.chord)
    }
}

/// Whether cells are too coarse for a peak.
#[inline(always)]
fn is_coarse<F: Lanes>(peak: &Peak, chord: F) -> F::Mask {
    F::splat(fine_enough(peak)).lt(chord)
}

/// All that a lobe reflects lies within about twice its half-widths: a coarse leaf that holds it has no more.
#[inline(always)]
fn floor<F: Lanes>(peak: &Peak, value: f32, width: F) -> F {
    let share = (F::splat(peak.radii[0] * peak.radii[1]) / (width * width)).min(F::splat(FLOOR));
    share * F::splat(value)
}

/// Whether cells at a distance from a peak, and from its long axis, may overlap the ellipse of `reach` half-widths.
#[inline(always)]
fn is_close<F: Lanes>(peak: &Peak, reach: f32, distance: F, across: F, chord: F) -> F::Mask {
    let within = distance.le(F::splat(reach * peak.radii[0]) + chord);
    F::and(within, across.abs().le(F::splat(reach * peak.radii[1]) + chord))
}

/// Eight cells that are about to be split, small enough to be taken as parallelograms, as a peak sees their children. In
/// the coordinates of a child's half axes every child is [-1, 1]^2, and their centres are 2 apart.
#[derive(Clone, Copy)]
pub struct Family<F: Lanes> {
    /// The vector from the centre to the peak, in those coordinates.
    place: [F; 2],
    /// How far the ellipse reaches along both coordinates: what of it is to be refined, and its core.
    extents: [[F; 2]; 2],
}

/// The half axes of the children of eight cells.
pub struct Axes<F: Lanes> {
    centre: V3<F>,
    basis: Basis<F>,
}

impl<F: Lanes> Axes<F> {
    /// Whether children of a width are small enough.
    #[inline(always)]
    pub fn are_flat(width: F) -> F::Mask {
        width.le(F::splat(FLAT_WIDTH))
    }

    /// From the world directions of the middles of the edges, at the lower and the upper end of axis 2 and then of axis
    /// 1, and of the centre.
    #[inline(always)]
    pub fn new([low2, high2, low1, high1, centre]: [V3<F>; 5]) -> Self {
        let quarter = F::splat(0.25);
        let scaled = |v: V3<F>| [v[0] * quarter, v[1] * quarter, v[2] * quarter];
        Axes { centre, basis: Basis::new([scaled(subtract(high1, low1)), scaled(subtract(high2, low2))]) }
    }

    /// The vector from the centre to a peak, in the world.
    #[inline(always)]
    fn offset(&self, peak: &Peak) -> V3<F> {
        subtract(splat(peak.direction.to_array()), self.centre)
    }

    /// What a peak sees of the children, which have this width.
    #[inline(always)]
    pub fn family(&self, peak: &Peak, width: F) -> Family<F> {
        let offset = self.offset(peak);
        let [long, short] = peak.radii;
        let u = self.basis.coordinates(splat((peak.along() * long).to_array()));
        let v = self.basis.coordinates(splat((peak.across * short).to_array()));
        // Parallelograms that wide do not lie where the cells do, quite.
        let border = F::splat(1.02) + F::splat(BENT) * width;
        let radii = [(u[0] * u[0] + v[0] * v[0]).sqrt(), (u[1] * u[1] + v[1] * v[1]).sqrt()];
        let (whole, core) = (F::splat(reach(peak)), F::splat(CORE));
        Family {
            place: self.basis.coordinates(offset),
            extents: [
                [border + whole * radii[0], border + whole * radii[1]],
                [border + core * radii[0], border + core * radii[1]],
            ],
        }
    }

    /// Judges a peak by the `c`-th children: cells of these indices, this width and chord.
    #[inline(always)]
    pub fn judge(
        &self,
        family: &Family<F>,
        narrow: &Narrow,
        c: u32,
        index: [F; 2],
        [width, chord]: [F; 2],
    ) -> Verdict<F> {
        let &Narrow { ref peak, value, place } = narrow;
        let sides = [F::splat(if c & 2 == 0 { -1.0 } else { 1.0 }), F::splat(if c & 1 == 0 { -1.0 } else { 1.0 })];
        let [along, other] = self.basis.axes;
        let mut offset = self.offset(peak);
        for (k, offset) in offset.iter_mut().enumerate() {
            *offset = *offset - (sides[0] * along[k % 3] + sides[1] * other[k % 3]);
        }
        let distance = dot(offset, offset).sqrt();
        let across = dot(offset, splat(peak.across.to_array()));
        let from_centre = [(family.place[0] - sides[0]).abs(), (family.place[1] - sides[1]).abs()];
        let [whole, core] = family.extents;
        let overlaps = F::and(from_centre[0].le(whole[0]), from_centre[1].le(whole[1]));
        let in_core = F::and(from_centre[0].le(core[0]), from_centre[1].le(core[1]));
        let contains = F::and(is_within(index[0], width, place[0]), is_within(index[1], width, place[1]));
        let near = F::or(contains, F::and(overlaps, is_close(peak, reach(peak), distance, across, chord)));
        let in_core = F::or(contains, F::and(in_core, is_close(peak, CORE, distance, across, chord)));
        Verdict {
            near,
            coarse: F::and(near, is_coarse(peak, chord)),
            holds: F::and(near, in_core),
            floor: floor(peak, value, width),
        }
    }
}

/// Whether cells contain a coordinate. One on the very border, as symmetric scenes have it, belongs to both sides.
#[inline(always)]
fn is_within<F: Lanes>(index: F, width: F, place: f32) -> F::Mask {
    let from_centre = (index + F::splat(0.5)) * width - F::splat(place);
    from_centre.abs().le(F::splat(0.51) * width)
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
