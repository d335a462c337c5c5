//! The radiance of the light in a direction, over its power: what candidates are weighed by.
//!
//! The density of a direction follows from the tables that it is drawn from, and has their rounding; the radiance follows from the
//! corners alone, which are fewer reads. A light for nearest clients has no corners: there it is the density.

use super::chart::Place;
use super::search::{UNITS, cell16};
use super::tables::{Light, decoded};
use super::walk::{Floats, Ints, NUMBER, WHOLE, floats, ints, put};
use super::warp::PatchDensity;
use crate::simd::Num;

/// What lanes look up: column and row of patches first, then of the part of a block's grid.
pub(super) struct Look<const N: usize> {
    /// Where they are: column and row on the face, and the solid angle of a texel.
    place: [Floats<N>; 3],
    face: Ints<N>,
    at: [Ints<N>; 2],
    cell: Ints<N>,
    block: Ints<N>,
    /// The first patch of the part, and one behind it, along both axes: of lights in coarse tables.
    from: [Ints<N>; 2],
    behind: [Ints<N>; 2],
    /// Pairs of corner words, of the upper and of the lower row; before they are read, where they stand.
    corner: [Ints<N>; 2],
    /// What 1 in a corner stands for; without corners, the light of the part.
    pub(super) scale: Floats<N>,
    /// How many times more candidates are drawn from the cell than its share of the light.
    candidates: Floats<N>,
}

/// What is found in a direction.
#[derive(Clone, Copy)]
pub struct Looked<F> {
    /// The radiance over the power of the light: the density that the direction would have in the light if tables did not round.
    pub radiance: F,
    /// How many times more candidates are drawn there.
    pub candidates: F,
}

impl<const N: usize> Look<N> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Look {
            place: [[NUMBER; N]; 3],
            face: [WHOLE; N],
            at: [[WHOLE; N]; 2],
            cell: [WHOLE; N],
            block: [WHOLE; N],
            from: [[WHOLE; N]; 2],
            behind: [[WHOLE; N]; 2],
            corner: [[WHOLE; N]; 2],
            scale: [NUMBER; N],
            candidates: [NUMBER; N],
        }
    }

    /// Notes the places of the lanes from `first` on.
    #[inline(always)]
    pub(super) fn aim<F: Num>(&mut self, light: &Light<'_>, first: usize, place: &Place<F>) {
        let axes = &light.chart.axes;
        put(&mut self.face, first, place.face.truncate().as_ref());
        for (k, &position) in place.position.iter().enumerate() {
            put(&mut self.place[k], first, position.store().as_ref());
            put(&mut self.at[k], first, axes[k].patch(position).as_ref());
        }
        put(&mut self.place[2], first, place.solid_angle.store().as_ref());
    }

    // The stages of a look. Each reads what the one before asked for.

    #[inline(always)]
    pub(super) fn find_cells(&mut self, light: &Light<'_>, count: usize) {
        let face_rows = light.grid[1] / light.chart.faces();
        for lane in 0..count.min(N) {
            self.cell[lane] = light.find_cell(self.face[lane], face_rows, [self.at[0][lane], self.at[1][lane]]);
        }
    }

    #[inline(always)]
    pub(super) fn find_blocks(&mut self, light: &Light<'_>, count: usize) {
        for lane in 0..count.min(N) {
            let c = light.cell(self.cell[lane]);
            let found = light.find_block(c, [self.at[0][lane], self.at[1][lane]]);
            for k in 0..2 {
                self.from[k][lane] = found.at[k];
                self.at[k][lane] = found.patch[k];
            }
            self.candidates[lane] = c.candidates;
            self.block[lane] = found.number;
        }
    }

    /// The light of each lane's block over the patches of the block: another end of a look, for its scale.
    #[inline(always)]
    pub(super) fn average(&mut self, light: &Light<'_>, count: usize) {
        for lane in 0..count.min(N) {
            let (c, block) = (light.cell(self.cell[lane]), light.block(self.block[lane]));
            let mut patches = 1;
            for k in 0..2 {
                let begin = self.from[k][lane] << (c.side[k] & 31);
                let end = (begin + (1 << (c.side[k] & 31))).min(u32::from(c.patches[k]));
                patches *= end.wrapping_sub(begin);
            }
            self.scale[lane] = c.probability * block.share / patches.max(1) as f32;
        }
    }

    #[inline(always)]
    pub(super) fn ask_for_corners(&mut self, light: &Light<'_>, count: usize) {
        for lane in 0..count.min(N) {
            let block = light.block(self.block[lane]);
            let (x, y) = (self.at[0][lane] >> block.step(0), self.at[1][lane] >> block.step(1));
            let word = block.line(y as usize, light.bilinear);
            light.words.prefetch(word);
            if light.bilinear {
                let below = word + 2 * usize::from(block.grid[0]);
                light.words.prefetch(below);
                self.corner[0][lane] = word as u32 + x;
                self.corner[1][lane] = below as u32 + x;
                self.scale[lane] = block.brightest;
            }
            if !light.exact || !light.bilinear {
                self.at[0][lane] = x;
                self.at[1][lane] = y;
            }
        }
    }

    #[inline(always)]
    pub(super) fn read_corners(&mut self, light: &Light<'_>, count: usize) {
        for lane in 0..count.min(N) {
            if light.bilinear {
                self.corner[0][lane] = light.pair(self.corner[0][lane] as usize);
                self.corner[1][lane] = light.pair(self.corner[1][lane] as usize);
            } else {
                self.scale[lane] = self.share(light, lane);
            }
            if !light.exact {
                let (c, block) = (light.cell(self.cell[lane]), light.block(self.block[lane]));
                for k in 0..2 {
                    let (from, behind) = c.extent(k, self.from[k][lane], self.at[k][lane], block.step(k));
                    self.from[k][lane] = from;
                    self.behind[k][lane] = behind;
                }
            }
        }
    }

    /// The light of a part without corners.
    fn share(&self, light: &Light<'_>, lane: usize) -> f32 {
        let block = light.block(self.block[lane]);
        let (x, y) = (self.at[0][lane] as usize, self.at[1][lane] as usize);
        let ([columns, rows], to_ends) = (block.grid.map(usize::from), block.words_at_ends());
        let [top, bottom] = cell16(&light.words, block.rows as usize, rows, y, to_ends);
        let [left, right] = cell16(&light.words, block.line(y, false), columns, x, to_ends);
        let [width, height] = [right.wrapping_sub(left), bottom.wrapping_sub(top)].map(|n| n as f32 * (1.0 / UNITS));
        light.cell(self.cell[lane]).probability * block.share * (width * height)
    }

    /// What the lanes from `first` on found.
    #[inline(always)]
    pub(super) fn looked<F: Num>(&self, light: &Light<'_>, first: usize) -> Looked<F> {
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let axes = &light.chart.axes;
        let place = [0, 1, 2].map(|k: usize| floats::<F, N>(&self.place[k], first));
        let [from, behind] = if light.exact {
            let from = [F::of_ints(axes[0].patch(place[0])), F::of_ints(axes[1].patch(place[1]))];
            [from, [from[0] + one, from[1] + one]]
        } else {
            let whole = |of: &[Ints<N>; 2]| [0, 1].map(|k: usize| F::of_ints(ints::<F, N>(&of[k], first)));
            [whole(&self.from), whole(&self.behind)]
        };
        let (left, right) = (axes[0].edge(from[0]), axes[0].edge(behind[0]));
        let (top, bottom) = (axes[1].edge(from[1]), axes[1].edge(behind[1]));
        let scale = floats::<F, N>(&self.scale, first);
        let candidates = floats::<F, N>(&self.candidates, first);
        let s = ((place[0] - left) / (right - left)).max(zero).min(one);
        let t = ((place[1] - top) / (bottom - top)).max(zero).min(one);
        if !light.bilinear {
            // Exactly the density: the weights of candidates from both sources add up to 1 only then.
            let (low, size) = ([left, top], [right - left, bottom - top]);
            let shape = PatchDensity::new([one; 4], light.chart.profiles(low, size));
            let area = size[0] * size[1] * place[2];
            let scale = scale / (shape.total() * area).max(F::splat(f32::MIN_POSITIVE));
            return Looked { radiance: scale * shape.unscaled([s, t]), candidates };
        }
        let [a, b] = decoded::<F>(ints::<F, N>(&self.corner[0], first));
        let [c, d] = decoded::<F>(ints::<F, N>(&self.corner[1], first));
        // Sums of products of what is not negative: above 0 where a corner has a part in it.
        let (upper, lower) = (a * (one - s) + b * s, c * (one - s) + d * s);
        Looked { radiance: (upper * (one - t) + lower * t) * scale, candidates }
    }
}
