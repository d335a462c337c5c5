//! Isotropic BRDFs as tables: trees of BRDF x cosine about the mirror direction, one for each elevation of the view.
//!
//! Clarberg et al. 2005, Section 5: two dimensions of wo times two of wi, reparameterised about the mirror direction, in
//! which a lobe stays where it is while the view sinks. Of n x n directions of the view only n differ if the BRDF is
//! isotropic: slices are numbered by the angle of wo and the normal, `(k + 1/2) / n` of a right angle, and any other
//! view blends the two slices beside it.
//!
//! A slice lives on the octahedral square with the mirror direction in its centre; axis 1 of the square runs along what
//! lies in the plane of incidence.

use crate::numeric::{inverse_power, max, min, select, sqrt};
use crate::sphere::{self, cell_chord};
use crate::wavelets::lanes::sphere as wide;
use crate::wavelets::lanes::vector::{V3, dot, splat};
use crate::wavelets::lanes::{LANES, Lanes};
use crate::wavelets::tree::{Link, MAX_DEPTH, Tree};
use core::f32::consts::FRAC_PI_2;
use glam::Vec3;

/// The most slices of a table.
pub const WIS_MAX_SLICES: u32 = 256;

/// The direction of the view of a slice, in a frame whose normal is +z; y is 0.
pub fn view(slice: u32, count: u32) -> Vec3 {
    let angle = (slice as f32 + 0.5) / count.max(1) as f32 * FRAC_PI_2;
    Vec3::new(libm::sinf(angle), 0.0, libm::cosf(angle))
}

/// The direction of the light for a point of a slice's square, in the frame of [`view`].
pub fn light(wo: Vec3, s: [f32; 2]) -> Vec3 {
    let [along, across, mirror] = axes(wo);
    let [x, y, z] = sphere::direction(s).to_array();
    along * x + across * y + mirror * z
}

/// [`light`] for a place in a pixel of a slice of 2^depth x 2^depth pixels, C order.
pub fn light_of_pixel(wo: Vec3, depth: u32, index: usize, offset: [f32; 2]) -> Vec3 {
    let side = 1usize << depth;
    let (pixel, [i, j]) = (1.0 / side as f32, [index >> depth, index & (side - 1)]);
    light(wo, [(i as f32 + offset[0]) * pixel, (j as f32 + offset[1]) * pixel])
}

/// The axes of a slice's frame for a view on the upper side: the third is the mirror direction.
fn axes(wo: Vec3) -> [Vec3; 3] {
    let horizontal = sqrt(wo.x * wo.x + wo.y * wo.y);
    let (x, y) = if horizontal > 0.0 { (wo.x / horizontal, wo.y / horizontal) } else { (1.0, 0.0) };
    [Vec3::new(x * wo.z, y * wo.z, horizontal), Vec3::new(-y, x, 0.0), Vec3::new(-wo.x, -wo.y, wo.z)]
}

/// The two slices beside a view and the share of the second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Between {
    /// The slices.
    pub slices: [u32; 2],
    /// The share of the second, 0 to 1.
    pub share: f32,
}

impl Between {
    /// The slices for a cosine of wo and the normal.
    pub fn new(cosine: f32, count: u32) -> Between {
        let last = count.max(1) - 1;
        let angle = libm::acosf(max(min(cosine, 1.0), 0.0));
        let place = min(max(angle / FRAC_PI_2 * count as f32 - 0.5, 0.0), last as f32);
        let low = (place as u32).min(last);
        Between { slices: [low, (low + 1).min(last)], share: min(place - low as f32, 1.0) }
    }
}

/// BRDF x cosine for one elevation of the view.
#[derive(Clone, Copy, Debug)]
pub struct Slice<'a> {
    /// Over the square about the mirror direction.
    pub tree: Tree<'a, 4>,
    /// What the stored values are to be multiplied by.
    pub scale: f32,
}

impl Slice<'_> {
    const NOTHING: Slice<'static> = Slice { tree: Tree::NOTHING, scale: 0.0 };

    /// The value at a point of the square.
    #[inline(always)]
    fn at(&self, s: [f32; 2]) -> f32 {
        let [i, j] = s.map(|s| (s * CELLS) as u32);
        let mut value = self.tree.average();
        let mut square = self.tree.root_square();
        for level in (0..MAX_DEPTH).rev() {
            let Some(here) = square else { break };
            let c = 2 * (i >> level & 1) + (j >> level & 1);
            value = self.tree.children(here)[c as usize & 3];
            square = self.tree.child_square(here, c);
        }
        value * self.scale
    }

    /// The values at eight places in units of the finest cells. All lanes go down together: their loads do not wait for
    /// one another, and no branch depends on where a lane ends.
    #[inline(always)]
    fn at_each(&self, [i, j]: &[[u32; LANES]; 2]) -> [f32; LANES] {
        let (squares, links) = (self.tree.squares(), self.tree.links());
        let mut values = [self.tree.average(); LANES];
        let mut at = [0u32; LANES];
        let mut live = if squares.is_empty() { [0; LANES] } else { [1u32; LANES] };
        for level in (0..self.tree.depth()).rev() {
            let shift = level + MAX_DEPTH - self.tree.depth();
            let mut any = 0;
            for lane in 0..LANES {
                let c = (2 * (i[lane] >> shift & 1) + (j[lane] >> shift & 1)) & 3;
                let here = at[lane] as usize;
                let square = squares.get(here).unwrap_or(&[0.0; 4]);
                let Link { first, mask } = links.get(here).copied().unwrap_or_default();
                values[lane] = select(live[lane] == 1, square[c as usize], values[lane]);
                at[lane] = first.wrapping_add(bits_below(mask, c));
                live[lane] &= mask >> c & 1;
                any |= live[lane];
            }
            if any == 0 {
                break;
            }
        }
        values.map(|value| value * self.scale)
    }

    /// The brightest of five cells, and the coarsest cell about it that has half its brightness: the centre of the one and
    /// the level of the other. The cells are the four next to the mirror direction, where narrow lobes are however bright
    /// the rest is, and the one to which the brightest child of each square leads.
    fn brightest(&self) -> ([f32; 2], u32) {
        let mut best = self.follow(None);
        for quarter in 0..4 {
            let cell = self.follow(Some(quarter));
            best = if cell.value > best.value { cell } else { best };
        }
        (best.index.map(|i| (i as f32 + 0.5) * inverse_power(best.level)), best.coarsest)
    }

    /// Goes down to a cell: always to the brightest child, or to that next to the square's middle in one of its quarters.
    fn follow(&self, quarter: Option<u32>) -> Followed {
        let mut levels = [self.tree.average(); MAX_DEPTH as usize + 1];
        let (mut index, mut level, mut square) = ([0u32; 2], 0, self.tree.root_square());
        while let Some(here) = square {
            let children = self.tree.children(here);
            let brightest =
                || (1..4).fold(0usize, |best, c| if children[c & 3] > children[best & 3] { c } else { best });
            let c = match quarter {
                None => brightest() as u32,
                // The middle is the corner of its quarters that lies inside.
                Some(quarter) => {
                    if level == 0 {
                        quarter
                    } else {
                        3 - quarter
                    }
                }
            };
            index = [2 * index[0] + (c >> 1), 2 * index[1] + (c & 1)];
            level += 1;
            match levels.get_mut(level as usize) {
                Some(slot) => *slot = children[c as usize & 3],
                None => break,
            }
            square = self.tree.child_square(here, c);
        }
        let value = levels.get(level as usize).copied().unwrap_or(0.0);
        let coarsest = levels.iter().take(level as usize).position(|&average| average >= 0.5 * value);
        Followed { value, index, level, coarsest: coarsest.map_or(level, |level| level as u32) }
    }
}

/// A cell that was found.
struct Followed {
    value: f32,
    index: [u32; 2],
    level: u32,
    /// The level of the coarsest cell about it that is half as bright.
    coarsest: u32,
}

/// The finest cells along an axis.
const CELLS: f32 = (1 << MAX_DEPTH) as f32;

/// How many of the four bits of a mask stand below bit `c`.
#[inline(always)]
fn bits_below(mask: u32, c: u32) -> u32 {
    const COUNTS: u32 = 0b1110_1001_1001_0100;
    let below = mask & ((1 << c) - 1);
    // Of three bits at most: two bits of COUNTS for each of the eight cases.
    COUNTS >> (2 * below) & 3
}

/// A table as one view sees it.
#[derive(Clone, Copy, Debug)]
pub struct Table<'a> {
    slices: [Slice<'a>; 2],
    share: f32,
    axes: [Vec3; 3],
}

impl<'a> Table<'a> {
    /// A table that is 0.
    pub const NOTHING: Table<'static> =
        Table { slices: [Slice::NOTHING; 2], share: 0.0, axes: [Vec3::X, Vec3::Y, Vec3::Z] };

    /// The blend of two slices. Of views, [`Table::seen`] says which.
    pub fn new(slices: [Slice<'a>; 2], share: f32) -> Table<'a> {
        Table { slices, share, ..Table::NOTHING }
    }

    /// The table for a view in the frame of a surface whose normal is +z, on the upper side.
    pub fn seen(self, wo: Vec3) -> Table<'a> {
        Table { axes: axes(wo), ..self }
    }

    /// Whether it can be above 0 anywhere.
    pub fn matters(&self) -> bool {
        self.slices.iter().any(|slice| slice.tree.average() > 0.0)
    }

    /// BRDF x cosine for a direction in the frame of [`Table::seen`].
    pub fn at(&self, wi: Vec3) -> f32 {
        let s = sphere::square(Vec3::from_array(self.axes.map(|axis| axis.dot(wi))));
        let [low, high] = self.slices.map(|slice| slice.at(s));
        min((1.0 - self.share) * low + self.share * high, f32::MAX)
    }

    /// As [`Table::at`], in lanes.
    #[inline(always)]
    pub fn at_wide<F: Lanes>(&self, wi: V3<F>) -> F {
        let [along, across, mirror] = self.axes;
        let v =
            [dot(wi, splat(along.to_array())), dot(wi, splat(across.to_array())), dot(wi, splat(mirror.to_array()))];
        let [x, y] = wide::square(v);
        let [low, high] = self.look_up([x.to_array(), y.to_array()]).map(F::from_array);
        let blended = F::splat(1.0 - self.share) * low + F::splat(self.share) * high;
        blended.min(F::splat(f32::MAX))
    }

    /// The values of both slices at eight points: one function for all widths of lanes.
    #[inline(never)]
    fn look_up(&self, [x, y]: [[f32; LANES]; 2]) -> [[f32; LANES]; 2] {
        let finest = |s: [f32; LANES]| s.map(|s| (s * CELLS) as u32);
        let [low, high] = self.slices;
        let places = [finest(x), finest(y)];
        [low.at_each(&places), high.at_each(&places)]
    }

    /// The direction of the brightest cell in the frame of [`Table::seen`] and the half-width of the lobe about it in
    /// radians; `None` if it is no narrow lobe.
    pub fn peak(&self) -> Option<(Vec3, f32)> {
        let [low, high] = &self.slices;
        let (s, level) = if self.share < 0.5 { low.brightest() } else { high.brightest() };
        let [along, across, mirror] = self.axes;
        let [x, y, z] = sphere::direction(s).to_array();
        if level > BROAD { Some((along * x + across * y + mirror * z, HALF_WIDTH * cell_chord(level))) } else { None }
    }
}

/// The half-width of a lobe as a share of how far the corners of its brightest cell are from its centre: of .4, .5 and 1
/// it gave the least noise for six measured materials.
const HALF_WIDTH: f32 = 0.4;
/// Cells of this level about the peak, or coarser ones, are not narrow: the base of a product resolves them.
const BROAD: u32 = 3;
