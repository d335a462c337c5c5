//! Building an environment: decode rows, integrate cells, then the trees.

use super::integrate::{Texels, cell_average, cell_moments, neighbour};
use super::spread::{Refined, Spread};
use super::{
    Header, Storage, WIS_WAVELET_LIGHT_EXACT_ZERO, WIS_WAVELET_LIGHT_NEAREST, WIS_WAVELET_LIGHT_RGB,
    WIS_WAVELET_LIGHT_SANITISE,
};
use crate::light::pixels::{Layout, Pixels, RowSummary, Rows, decode_row, missing};
use crate::numeric::{exp2i, exponent};
use crate::status::{Error, Result, Status};
use crate::wavelets::morton;
use crate::wavelets::prune::{self, Pruning};
use crate::wavelets::tree::{self, Link, MAX_DEPTH, Tree};
use core::f64::consts::PI;

/// What to build.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// The input.
    pub pixels: Pixels,
    /// The square has 2^depth cells per axis.
    pub depth: u32,
    /// How the tree is stored.
    pub storage: Storage,
    /// Sparse storage: the variance that pruning may add, relative.
    pub error_budget: f64,
    /// The client looks texels up without filtering, so importance is not spread to neighbours.
    pub nearest: bool,
    /// Black stays exactly 0.
    pub exact_zero: bool,
    /// RGB averages are stored too.
    pub rgb: bool,
    /// NaN and infinite channels are replaced, not rejected.
    pub sanitise: bool,
    /// Cells of a pyramid are refined where light varies within them.
    pub refined: bool,
}

/// No cell is darker than this share of the mean, unless it is to stay exactly 0 (rule 16).
const FLOOR: f64 = 1.0 / 65_536.0;
/// No cell that is lit at all is darker than this share of the mean (rule 18).
const LEAST: f64 = 1.0 / 18_446_744_073_709_551_616.0;

impl Config {
    /// Cells per axis that are integrated: at least 2, since a cell must lie in one quadrant.
    pub fn cells(&self) -> u32 {
        1 << self.depth.clamp(1, MAX_DEPTH)
    }

    /// The most squares below cells.
    pub fn room(&self) -> usize {
        // At most one for each two of the last level of the pyramid: forests, whose light varies from texel to texel, use
        // all, most maps far fewer. And enough for a sun in a small map.
        let share = (1usize << (2 * self.depth)) / 8;
        if self.refined { share.max(4096) } else { 0 }
    }

    /// Marks for the cells.
    pub fn marks(&self) -> usize {
        if self.refined { (1usize << (2 * self.depth)).div_ceil(32) } else { 0 }
    }

    /// WIS_WAVELET_LIGHT_*.
    pub fn flags(&self) -> u32 {
        let flags = [
            (self.nearest, WIS_WAVELET_LIGHT_NEAREST),
            (self.exact_zero, WIS_WAVELET_LIGHT_EXACT_ZERO),
            (self.rgb, WIS_WAVELET_LIGHT_RGB),
            (self.sanitise, WIS_WAVELET_LIGHT_SANITISE),
        ];
        flags.into_iter().filter(|(is_set, _)| *is_set).fold(0, |all, (_, flag)| all | flag)
    }

    /// The number of texels.
    pub fn texels(&self) -> usize {
        self.pixels.width as usize * self.pixels.height as usize
    }

    /// The depth for a map whose resolution is left to the library: as many cells as texels, or up to four times as
    /// many. With fewer, a small sun or lamp shares its cells with the dark beside it.
    pub fn natural_depth(pixels: &Pixels) -> u32 {
        let texels = u64::from(pixels.width) * u64::from(pixels.height);
        // The logarithm, rounded up; ilog2 would leave a panic path.
        let levels = u64::BITS - texels.saturating_sub(1).leading_zeros();
        levels.div_ceil(2).min(MAX_DEPTH)
    }
}

/// First pass: decodes row `y` into its luminance and, if kept, its RGB.
///
/// # Errors
/// [`Error`]
pub fn decode(
    config: &Config,
    rows: &impl Rows,
    y: u32,
    luminance: &mut [f64],
    rgb: &mut [[f32; 3]],
) -> core::result::Result<RowSummary, Error> {
    let bytes = config.pixels.row_bytes().unwrap_or(usize::MAX);
    let row = rows.row(y).and_then(|row| row.get(..bytes)).ok_or(missing(y))?;
    decode_row(&config.pixels, row, y, config.sanitise, luminance, rgb)
}

/// All decoded texels.
#[derive(Clone, Copy)]
pub struct Decoded<'a> {
    /// Row by row.
    pub luminance: &'a [f64],
    /// Row by row; empty if RGB is not kept.
    pub rgb: &'a [[f32; 3]],
}

/// Texels with what the client's bilinear look-up spreads to them.
pub(super) struct Dilated<'a> {
    pub(super) config: &'a Config,
    pub(super) decoded: Decoded<'a>,
}

impl Dilated<'_> {
    fn index(&self, x: u32, y: u32) -> usize {
        y as usize * self.config.pixels.width as usize + x as usize
    }

    /// The exact average over a texel of the bilinear reconstruction: weights [1 6 1] / 8 per axis (rule 17).
    fn average<const N: usize>(&self, x: u32, y: u32, value: impl Fn(usize) -> [f64; N]) -> [f64; N] {
        if self.config.nearest {
            return value(self.index(x, y));
        }
        let pixels = &self.config.pixels;
        let (face, row) = match pixels.layout {
            Layout::Cube => (y / pixels.width.max(1), y % pixels.width.max(1)),
            _ => (0, y),
        };
        let mut sum = [0.0; N];
        for (dy, wy) in [(-1, 0.125), (0, 0.75), (1, 0.125)] {
            for (dx, wx) in [(-1, 0.125), (0, 0.75), (1, 0.125)] {
                let [nx, ny] = neighbour(pixels, i64::from(x) + dx, i64::from(row) + dy, face);
                for (sum, v) in sum.iter_mut().zip(value(self.index(nx, ny))) {
                    *sum += wx * wy * v;
                }
            }
        }
        sum
    }

    fn luminance(&self, index: usize) -> f64 {
        self.decoded.luminance.get(index).copied().unwrap_or(0.0)
    }

    fn rgb(&self, index: usize) -> [f64; 3] {
        self.decoded.rgb.get(index).copied().unwrap_or([0.0; 3]).map(f64::from)
    }
}

impl Texels<1> for Dilated<'_> {
    fn texel(&self, x: u32, y: u32) -> [f64; 1] {
        self.average(x, y, |index| [self.luminance(index)])
    }
}

/// Luminance and its square.
impl Texels<2> for Dilated<'_> {
    fn texel(&self, x: u32, y: u32) -> [f64; 2] {
        let [luminance] = self.texel(x, y);
        [luminance, luminance * luminance]
    }
}

impl Texels<4> for Dilated<'_> {
    fn texel(&self, x: u32, y: u32) -> [f64; 4] {
        self.average(x, y, |index| {
            let [r, g, b] = self.rgb(index);
            [self.luminance(index), r, g, b]
        })
    }
}

/// A row of integrated cells; what is not kept is empty.
pub struct Row<'a> {
    /// Average luminance.
    pub luminance: &'a mut [f64],
    /// How light is spread within cells.
    pub spread: &'a mut [Spread],
    /// Average RGB.
    pub rgb: &'a mut [[f32; 3]],
}

/// Second pass: the cells of row `i` of the square (axis 1).
pub fn integrate(config: &Config, decoded: Decoded, i: u32, row: Row) {
    let texels = Dilated { config, decoded };
    let (pixels, cells) = (&config.pixels, config.cells());
    let exact = !matches!(pixels.layout, Layout::Cube);
    let (mut spreads, mut colours) = (row.spread.iter_mut(), row.rgb.iter_mut());
    for (j, out) in (0..cells).zip(row.luminance) {
        let moments = spreads.next().map(|slot| {
            let moments = cell_moments(pixels, &texels, cells, i, j);
            *slot = Spread::of(moments);
            moments.average
        });
        *out = match (colours.next(), moments) {
            (Some(colour), _) => {
                let [average, r, g, b] = cell_average::<4>(pixels, &texels, cells, i, j);
                *colour = [r as f32, g as f32, b as f32];
                average
            }
            (None, Some([average, _])) if exact => average,
            (None, _) => {
                let [average] = cell_average::<1>(pixels, &texels, cells, i, j);
                average
            }
        };
    }
}

/// The integrated cells, axis 1 slowest.
#[derive(Clone, Copy)]
pub struct Grid<'a> {
    /// Average luminance.
    pub luminance: &'a [f64],
    /// How light is spread within cells; empty if none is to be refined.
    pub spread: &'a [Spread],
    /// Average RGB; empty if not kept.
    pub rgb: &'a [[f32; 3]],
}

/// The trees: squares in heap order, then those below cells. Each slice has one entry per square, or none if that tree
/// is not kept.
pub struct Trees<'a> {
    /// Luminance.
    pub plain: &'a mut [[f32; 4]],
    /// RGB.
    pub rgb: &'a mut [[[f32; 3]; 4]],
}

/// The mean luminance over the sphere, in the units of the input.
pub(super) fn mean(grid: &Grid, cells: u32) -> f64 {
    let rows = grid.luminance.chunks_exact(cells.max(1) as usize);
    let sum: f64 = rows.map(|row| row.iter().sum::<f64>()).sum();
    sum / (f64::from(cells) * f64::from(cells))
}

/// Builds the trees and the header's numbers. A black map leaves every average 0.
///
/// # Errors
/// [`Status::InvalidArgument`] if a slice has the wrong length.
pub fn complete(
    config: &Config,
    grid: &Grid,
    refined: &[Refined],
    trees: &mut Trees,
    header: &mut Header,
) -> Result<()> {
    let cells = config.cells();
    let mean = mean(grid, cells);
    header.power = 4.0 * PI * mean;
    header.exponent = if mean > 0.0 { exponent(mean) } else { 0 };
    let normal = Normaliser::new(header.exponent);
    let mean = normal.apply(mean);
    let value = |luminance: f64| floored(config, normal.apply(luminance), mean);
    let colour = |c: [f32; 3]| c.map(|c| normal.apply(c.into()));
    let light = |t: [u32; 2]| {
        let mean = at(grid.luminance, t, cells);
        at(grid.spread, t, cells).least(mean, mean)
    };
    let (heap, below) = halves(trees.plain, refined)?;
    header.average = fill(config.depth, heap, |t| value(light(t)))?;
    for (square, from) in below.iter_mut().zip(refined) {
        *square = from.luminance.map(|l| value(l) as f32);
    }
    if config.rgb {
        let (heap, below) = halves(trees.rgb, refined)?;
        header.rgb_average = fill_rgb(config.depth, heap, |t| colour(at(grid.rgb, t, cells)))?;
        for (square, from) in below.iter_mut().zip(refined) {
            *square = from.rgb.map(|c| colour(c).map(|c| c as f32));
        }
    }
    header.refined = refined.len() as u32;
    Ok(())
}

/// The squares in heap order and those below cells.
fn halves<'a, T>(squares: &'a mut [T], refined: &[Refined]) -> Result<(&'a mut [T], &'a mut [T])> {
    let heap = squares.len().checked_sub(refined.len()).ok_or(Status::InvalidArgument)?;
    squares.split_at_mut_checked(heap).ok_or(Status::InvalidArgument)
}

/// Multiplies by `2^-exponent`, in two steps so that neither factor overflows.
#[derive(Clone, Copy)]
struct Normaliser([f64; 2]);

impl Normaliser {
    fn new(exponent: i32) -> Self {
        let half = exponent / 2;
        Normaliser([exp2i(-half), exp2i(half - exponent)])
    }

    fn apply(&self, x: f64) -> f64 {
        x * self.0[0] * self.0[1]
    }
}

fn at<T: Copy + Default>(grid: &[T], [i, j]: [u32; 2], cells: u32) -> T {
    grid.get(i as usize * cells as usize + j as usize).copied().unwrap_or_default()
}

/// The value that a cell is stored with.
fn floored(config: &Config, value: f64, mean: f64) -> f64 {
    let floor = match (config.exact_zero, value > 0.0) {
        (false, _) => FLOOR * mean,
        (true, true) => LEAST * mean,
        (true, false) => 0.0,
    };
    if value > floor { value } else { floor }
}

/// Fills a complete tree from the values of its finest cells; a tree of depth 0 is the mean of 2 x 2 cells.
fn fill(depth: u32, squares: &mut [[f32; 4]], value: impl Fn([u32; 2]) -> f64) -> Result<f32> {
    if depth == 0 {
        let sum: f64 = [[0, 0], [0, 1], [1, 0], [1, 1]].into_iter().map(value).sum();
        return Ok((0.25 * sum) as f32);
    }
    for (code, square) in finest(depth, squares) {
        for ((c, child), t) in (0..).zip(square.iter_mut()).zip([code; 4]) {
            *child = value(morton::decode::<2>(4 * t + c, depth)) as f32;
        }
    }
    Ok(tree::build::<4>(depth, squares)? as f32)
}

/// The finest squares with their Morton codes.
fn finest<T>(depth: u32, squares: &mut [T]) -> impl Iterator<Item = (u64, &mut T)> {
    let first = tree::complete_len::<4>(depth.saturating_sub(1)).unwrap_or(0) as usize;
    (0u64..).zip(squares.iter_mut().skip(first))
}

/// As [`fill`], for three channels.
fn fill_rgb(depth: u32, squares: &mut [[[f32; 3]; 4]], value: impl Fn([u32; 2]) -> [f64; 3]) -> Result<[f32; 3]> {
    let mean = |sum: [f64; 3]| sum.map(|s| (0.25 * s) as f32);
    let add = |a: [f64; 3], b: [f64; 3]| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
    if depth == 0 {
        return Ok(mean([[0, 0], [0, 1], [1, 0], [1, 1]].into_iter().map(value).fold([0.0; 3], add)));
    }
    if tree::complete_len::<4>(depth).map(|len| len as usize) != Some(squares.len()) {
        return Err(Status::InvalidArgument);
    }
    for (code, square) in finest(depth, squares) {
        for (c, child) in (0..).zip(square.iter_mut()) {
            *child = value(morton::decode::<2>(4 * code + c, depth)).map(|v| v as f32);
        }
    }
    let average = |square: &[[f32; 3]; 4]| mean(square.iter().map(|c| c.map(f64::from)).fold([0.0; 3], add));
    for index in (1..squares.len()).rev() {
        let own = squares.get(index).map_or([0.0; 3], average);
        let parent = squares.get_mut((index - 1) / 4).and_then(|parent| parent.get_mut((index - 1) % 4));
        if let Some(slot) = parent {
            *slot = own;
        }
    }
    Ok(squares.first().map_or([0.0; 3], average))
}

/// Chooses the squares of a sparse tree; `savings` has one entry per square of the complete tree.
///
/// # Errors
/// [`Status::InvalidArgument`] if a length is wrong.
pub fn plan(config: &Config, header: &Header, complete: &[[f32; 4]], savings: &mut [f64]) -> Result<Pruning> {
    let tree = Tree::trusted(config.depth, header.average, complete, &[]);
    prune::plan(&tree, config.error_budget, savings)
}

/// Writes the squares that [`plan`] keeps, with their links.
///
/// # Errors
/// [`Status::InvalidArgument`] if a length is not what was planned.
pub fn write_kept(
    config: &Config,
    header: &Header,
    complete: &[[f32; 4]],
    savings: &[f64],
    squares: &mut [[f32; 4]],
    links: &mut [Link],
) -> Result<()> {
    let tree = Tree::trusted(config.depth, header.average, complete, &[]);
    prune::write(&tree, savings, squares, links)
}

/// Copies to `sparse` the squares of `complete` that a sparse tree with these links keeps; `sources` is filled
/// with the place of each in the complete tree.
pub fn copy_kept<T: Copy>(links: &[Link], sources: &mut [u32], complete: &[T], sparse: &mut [T]) {
    if let Some(first) = sources.first_mut() {
        *first = 0;
    }
    for slot in 0..links.len() {
        let link = links.get(slot).copied().unwrap_or_default();
        let source = sources.get(slot).copied().unwrap_or(0);
        if let (Some(from), Some(to)) = (complete.get(source as usize), sparse.get_mut(slot)) {
            *to = *from;
        }
        let kept = (0..4u32).filter(|c| link.mask >> c & 1 == 1);
        for (next, c) in (link.first as usize..).zip(kept) {
            if let Some(target) = sources.get_mut(next) {
                *target = source.saturating_mul(4).saturating_add(1 + c);
            }
        }
    }
}
