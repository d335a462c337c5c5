//! The radiance of the light in a direction, over its power: what candidates are weighed by.
//!
//! The density of a direction follows from the tables that it is drawn from, and has their rounding; the radiance follows from the
//! corners alone, which are fewer reads. A light for nearest clients has no corners: there both are the same numbers.

use super::chart::Place;
use super::search::{UNITS, cell16};
use super::tables::{Light, decoded};
use super::walk::{floats, ints};
use crate::simd::{Apart, LANES, Num};

/// What lanes look up: column and row of patches first, then of the part of a block's grid.
struct Look<const N: usize> {
    face: [u32; N],
    at: [[u32; N]; 2],
    cell: [u32; N],
    block: [u32; N],
    /// The first patch of the part, and one behind it, along both axes: of lights in coarse tables.
    from: [[u32; N]; 2],
    behind: [[u32; N]; 2],
    /// Pairs of corner words, of the upper and of the lower row; before they are read, where they stand.
    corner: [[u32; N]; 2],
    /// What 1 in a corner stands for; without corners, the light of the part.
    scale: [f32; N],
    /// How many times more candidates are drawn from the cell than its share of the light.
    candidates: [f32; N],
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
    /// Finds the parts of blocks in which the patches of the first `count` lanes lie.
    // A function of its own: it is the same at all levels. `count` is no constant, so that loops stay short code.
    #[inline(never)]
    fn find(&mut self, light: &Light<'_>, count: usize) {
        let count = count.min(N);
        let face_rows = light.grid[1] / light.chart.faces();
        for lane in 0..count {
            self.cell[lane] = light.find_cell(self.face[lane], face_rows, [self.at[0][lane], self.at[1][lane]]);
        }
        for lane in 0..count {
            let c = light.cell(self.cell[lane]);
            let found = light.find_block(c, [self.at[0][lane], self.at[1][lane]]);
            for k in 0..2 {
                self.from[k][lane] = found.at[k];
                self.at[k][lane] = found.patch[k];
            }
            self.candidates[lane] = c.candidates;
            self.block[lane] = found.number;
        }
        for lane in 0..count {
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
        for lane in 0..count {
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
}

/// [`Light::radiance`].
struct Radiance<'a, F: Num> {
    light: &'a Light<'a>,
    place: &'a Place<F>,
}

impl<F: Num> Radiance<'_, F> {
    #[inline(always)]
    fn look<const N: usize>(&self) -> Looked<F> {
        let Radiance { light, place } = self;
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let axes = &light.chart.axes;
        let patch = [axes[0].patch(place.position[0]), axes[1].patch(place.position[1])];
        // What it begins with is never read, as in a walk.
        let mut look = Look::<N> {
            face: [1; N],
            at: [[1; N]; 2],
            cell: [1; N],
            block: [1; N],
            from: [[1; N]; 2],
            behind: [[1; N]; 2],
            corner: [[1; N]; 2],
            scale: [0.5; N],
            candidates: [0.5; N],
        };
        super::walk::put(&mut look.face, 0, place.face.truncate().as_ref());
        super::walk::put(&mut look.at[0], 0, patch[0].as_ref());
        super::walk::put(&mut look.at[1], 0, patch[1].as_ref());
        look.find(light, N.min(F::WIDTH));
        let [from, behind] = if light.exact {
            let from = [F::of_ints(patch[0]), F::of_ints(patch[1])];
            [from, [from[0] + one, from[1] + one]]
        } else {
            [
                [F::of_ints(ints::<F, N>(&look.from[0], 0)), F::of_ints(ints::<F, N>(&look.from[1], 0))],
                [F::of_ints(ints::<F, N>(&look.behind[0], 0)), F::of_ints(ints::<F, N>(&look.behind[1], 0))],
            ]
        };
        let (left, right) = (axes[0].edge(from[0]), axes[0].edge(behind[0]));
        let (top, bottom) = (axes[1].edge(from[1]), axes[1].edge(behind[1]));
        let scale = floats::<F, N>(&look.scale, 0);
        let candidates = floats::<F, N>(&look.candidates, 0);
        if !light.bilinear {
            let area = (right - left) * (bottom - top);
            return Looked { radiance: scale / (area * place.solid_angle), candidates };
        }
        let [a, b] = decoded::<F>(ints::<F, N>(&look.corner[0], 0));
        let [c, d] = decoded::<F>(ints::<F, N>(&look.corner[1], 0));
        let s = ((place.position[0] - left) / (right - left)).max(zero).min(one);
        let t = ((place.position[1] - top) / (bottom - top)).max(zero).min(one);
        // Sums of products of what is not negative: above 0 where a corner has a part in it.
        let (upper, lower) = (a * (one - s) + b * s, c * (one - s) + d * s);
        Looked { radiance: (upper * (one - t) + lower * t) * scale, candidates }
    }
}

impl<F: Num> Apart<F> for Radiance<'_, F> {
    type Output = Looked<F>;

    #[inline(always)]
    fn run(self) -> Looked<F> {
        if F::WIDTH == 1 { self.look::<1>() } else { self.look::<LANES>() }
    }
}

impl Light<'_> {
    /// The radiance at places.
    #[inline(always)]
    pub fn radiance<F: Num>(&self, place: &Place<F>) -> Looked<F> {
        F::apart(Radiance { light: self, place })
    }
}
