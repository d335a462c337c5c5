//! Squares below the cells of a pyramid, where light varies within cells: a sun of a texel, the edge of a lamp.
//!
//! Sampling a cell uniformly adds area (mean(L^2) - mean(L)^2) / (mean(L) M) to the variance of an estimate of the
//! power, relative to its square, with M the mean over the sphere. Both moments come from the exact integration, so it
//! is known where squares gain most: level by level, as many as there is room for.
//!
//! Within a refined cell the last children share its light in proportion to sqrt(mean(L^2)), not to mean(L): that is the
//! least variance that uniform sampling inside each can have. A child of which the sun covers a hundredth then gives a
//! weight of 10 instead of 100.

use super::build::{Config, Decoded, Dilated, Grid, mean};
use super::integrate::{cell_average, cell_moments};
use super::spread::{Refined, Spread};
use crate::status::{Result, Status};
use crate::wavelets::morton;
use crate::wavelets::tree::{Link, MAX_REFINED, Mark};

/// Where the squares of a refinement are made.
pub struct Refinement<'a> {
    /// As many as [`Config::room`].
    pub squares: &'a mut [Refined],
    /// As many as the squares.
    pub links: &'a mut [Link],
    /// As many as [`Config::marks`].
    pub marks: &'a mut [Mark],
}

/// Variation, summed over a level, that is not worth squares.
const NEGLIGIBLE: f64 = 1.0 / 1024.0;

/// Chooses and integrates the squares below cells. Returns how many there are; without any, marks mean nothing.
///
/// # Errors
/// [`Status::InvalidArgument`] if a slice has the wrong length.
pub fn refine(config: &Config, decoded: Decoded, grid: &Grid, out: &mut Refinement) -> Result<u32> {
    let (depth, cells) = (config.depth, config.cells());
    let mean = mean(grid, cells);
    let count = u64::from(cells) * u64::from(cells);
    if depth == 0 || depth >= MAX_REFINED || grid.spread.is_empty() || mean <= 0.0 {
        return Ok(0);
    }
    if out.links.len() != out.squares.len() || out.marks.len() as u64 != count.div_ceil(32) {
        return Err(Status::InvalidArgument);
    }
    let negligible = NEGLIGIBLE * mean;
    let texels = Dilated { config, decoded };
    let area = 1.0 / (f64::from(cells) * f64::from(cells));
    let of_cell = |index: usize| match (grid.spread.get(index), grid.luminance.get(index)) {
        (Some(spread), Some(&luminance)) => spread.variation(luminance, area),
        _ => 0.0,
    };
    let total: f64 = (0..grid.spread.len()).map(of_cell).sum();
    let least = threshold(total, negligible, out.squares.len());
    let mut used = 0;
    for (first, mark) in (0u64..).step_by(32).zip(out.marks.iter_mut()) {
        *mark = Mark { bits: 0, before: used as u32 };
        for bit in 0..32.min(count.saturating_sub(first)) {
            let index = morton::decode::<2>(first + bit, depth);
            let [i, j] = index.map(|i| i as usize);
            if of_cell(i * cells as usize + j) <= least {
                continue;
            }
            *out.squares.get_mut(used).ok_or(Status::InvalidArgument)? = square(&texels, index, depth);
            mark.bits |= 1 << bit;
            used += 1;
        }
    }
    let mut done = 0;
    for level in depth + 1..MAX_REFINED {
        let end = used;
        let parents = out.squares.get(done..end).unwrap_or(&[]);
        let total: f64 = parents.iter().flat_map(|square| square.variation).sum();
        let least = threshold(total, negligible, out.squares.len() - end);
        for parent in done..end {
            let Some(&Refined { variation, index: [i, j], .. }) = out.squares.get(parent) else { break };
            let mut link = Link { first: used as u32, mask: 0 };
            for (c, variation) in (0..4u32).zip(variation) {
                if variation <= least {
                    continue;
                }
                let index = [2 * i + (c >> 1), 2 * j + (c & 1)];
                *out.squares.get_mut(used).ok_or(Status::InvalidArgument)? = square(&texels, index, level);
                link.mask |= 1 << c;
                used += 1;
            }
            if let Some(slot) = out.links.get_mut(parent) {
                *slot = link;
            }
        }
        done = end;
    }
    out.links.iter_mut().take(used).skip(done).for_each(|link| *link = Link::default());
    // Children stand behind their parents.
    for parent in (0..used).rev() {
        let Some(&Link { first, mask }) = out.links.get(parent) else { break };
        let refined = (0..4usize).filter(|c| mask >> c & 1 == 1);
        for (child, c) in (first as usize..).zip(refined) {
            let below = out.squares.get(child).map_or(0.0, |square| 0.25 * square.luminance.iter().sum::<f64>());
            if let Some(slot) = out.squares.get_mut(parent).and_then(|square| square.luminance.get_mut(c)) {
                *slot = below;
            }
        }
    }
    Ok(used as u32)
}

/// What varies more gets squares: at most half of the room, for the other half is for the levels below.
fn threshold(total: f64, negligible: f64, room: usize) -> f64 {
    if total > negligible { total / (0.5 * room as f64) } else { f64::INFINITY }
}

/// The square at a place among 2^level.
fn square(texels: &Dilated, index: [u32; 2], level: u32) -> Refined {
    let pixels = &texels.config.pixels;
    let cells = 2 << level;
    let area = 1.0 / (f64::from(cells) * f64::from(cells));
    let mut square = Refined { index, ..Refined::default() };
    for c in 0..4u32 {
        let (i, j) = (2 * index[0] + (c >> 1), 2 * index[1] + (c & 1));
        let [mean, square_mean] = cell_average::<2>(pixels, texels, cells, i, j);
        let spread = Spread::of(cell_moments(pixels, texels, cells, i, j));
        let child = c as usize & 3;
        square.luminance[child] = spread.least(libm::sqrt(square_mean), mean);
        square.variation[child] = spread.variation(mean, area);
        if texels.config.rgb {
            let [_, r, g, b] = cell_average::<4>(pixels, texels, cells, i, j);
            square.rgb[child] = [r as f32, g as f32, b as f32];
        }
    }
    square
}
