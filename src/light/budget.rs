//! The coarsest grids that an error budget b allows.
//!
//! A grid is allowed if the relative variance of w = L / q over the block is at most b^2, and w at most 1 + 8 b or 4/3 everywhere: L
//! is the map's own bilinear light, q what the grid stores. Between the nodes of the map both are bilinear, so the largest w
//! lies at a node, and w is integrated as the bilinear function of its nodes.

use super::blocks::{CellBlocks, CellWork, Steps, stored_corners};
use super::chart::Layout;
use super::plan::{BLOCK_SIDE, Filter};
use super::tables::BLOCK;
use super::texels::{Texels, Tile};

/// The largest w is this many budgets above 1, or a third: a block with a rare error of that size still fits the budget, and no
/// single sample stands out by it. The patches about a pole of a sky with waves in azimuth need that third.
const LARGEST: f64 = 8.0;
const LARGEST_AT_LEAST: f64 = 1.0 / 3.0;

/// Chooses the level and the grids of a cell; `steps` has room for those of its blocks at level 0.
///
/// Blocks are doubled as long as that saves memory, each with the finest of the grids that it replaces, or with a coarser one
/// if those were single cells along an axis.
pub fn choose(texels: &Texels<'_>, index: u32, steps: &mut [Steps]) -> CellWork {
    let plan = texels.plan;
    let mut cell = CellBlocks::new(plan, index, 0);
    if !(plan.of.budget > 0.0) {
        steps.fill([0, 0]);
        return CellWork { lengths: cell.full(plan), ..CellWork::default() };
    }
    for (number, out) in steps.iter_mut().enumerate() {
        *out = coarsest(texels, &cell, number, [0, 0]);
    }
    let lengths = |cell: &CellBlocks, steps: &[Steps]| {
        cell.lengths(plan, |number| steps.get(number).copied().unwrap_or_default())
    };
    let mut choice = CellWork { lengths: lengths(&cell, steps), ..CellWork::default() };
    for level in 1..=plan.levels(cell.patches) {
        let doubled = CellBlocks::new(plan, index, level);
        let finest = |number: usize| finest_below(&cell, &doubled, number, steps);
        let fits = |steps: Steps| (0..2).all(|k: usize| u32::from(steps[k]) + BLOCK_SIDE >= doubled.side[k]);
        if !(0..doubled.count()).map(finest).all(fits)
            || doubled.lengths(plan, finest).bytes() >= choice.lengths.bytes()
        {
            break;
        }
        for number in 0..doubled.count() {
            // The blocks that this one replaces stand at its own number or behind it.
            let least = finest_below(&cell, &doubled, number, steps);
            let single = (0..2).any(|k: usize| u32::from(least[k]) >= cell.side[k]);
            let chosen = if single { coarsest(texels, &doubled, number, least) } else { least };
            if let Some(out) = steps.get_mut(number) {
                *out = chosen;
            }
        }
        cell = doubled;
        choice = CellWork { level: level.into(), lengths: lengths(&cell, steps), ..choice };
    }
    for (number, &steps) in (0..cell.count()).zip(&*steps).filter(|(_, steps)| **steps != [0, 0]) {
        choice.variance += added(texels, &cell.tile(number, steps), f64::INFINITY).unwrap_or_default()[0];
    }
    choice
}

/// The smallest steps of the blocks that block `number` of the next level replaces.
fn finest_below(cell: &CellBlocks, doubled: &CellBlocks, number: usize, steps: &[Steps]) -> Steps {
    let [columns, rows] = cell.blocks().map(|n| n as usize);
    let across = doubled.blocks()[0].max(1) as usize;
    let (column, row) = (2 * (number % across), 2 * (number / across));
    let mut finest = [u8::MAX; 2];
    for j in row..(row + 2).min(rows) {
        for i in column..(column + 2).min(columns) {
            let of = steps.get(j * columns + i).copied().unwrap_or_default();
            finest = [finest[0].min(of[0]), finest[1].min(of[1])];
        }
    }
    finest
}

/// The coarsest grid of a block that the budget allows, from one that it does allow: both axes together as far as they go,
/// then each of them.
#[inline(never)]
fn coarsest(texels: &Texels<'_>, cell: &CellBlocks, number: usize, least: Steps) -> Steps {
    let budget = f64::from(texels.plan.of.budget);
    let largest = 1.0 + (LARGEST * budget).max(LARGEST_AT_LEAST);
    let allowed = |steps: &Steps| {
        (0..2).all(|k: usize| u32::from(steps[k]) <= cell.side[k])
            && added(texels, &cell.tile(number, *steps), largest)
                .is_some_and(|[variance, light]| variance <= budget * budget * light)
    };
    let mut best = least;
    for along in [[1, 1], [1, 0], [0, 1]] {
        while let Some(next) = Some([best[0] + along[0], best[1] + along[1]]).filter(allowed) {
            best = next;
        }
    }
    best
}

/// The relative variance that a grid adds to its tile, times the tile's light, and that light; `None` if some w is above `largest`.
fn added(texels: &Texels<'_>, tile: &Tile, largest: f64) -> Option<[f64; 2]> {
    let mut stored = [1.0; (BLOCK + 1) * (BLOCK + 1)];
    if texels.plan.of.filter == Filter::Bilinear {
        stored_corners(texels, tile, &mut stored);
    }
    let (mut sums, columns) = ([0.0; 2], tile.grid[0].max(1) as usize);
    for (number, cell) in tile.cells().enumerate() {
        let first = number / columns * (BLOCK + 1) + number % columns;
        let corner = |k: usize| stored.get(first + k).map_or(1.0, |&corner| f64::from(corner));
        let [variance, light, most] = added_in(texels, &cell, [0, 1, BLOCK + 1, BLOCK + 2].map(corner));
        if most > largest {
            return None;
        }
        sums = [sums[0] + variance, sums[1] + light];
    }
    Some(sums)
}

/// The same for a cell of a grid with these corners, and the largest w.
#[inline(never)]
fn added_in(texels: &Texels<'_>, cell: &Tile, [p, q, r, s]: [f64; 4]) -> [f64; 3] {
    let size = [0, 1].map(|k: usize| f64::from(cell.end[k] - cell.origin[k]));
    let per_patch = [1.0 / size[0], 1.0 / size[1]];
    let [mut mass, mut light, mut mean, mut square, mut most] = [0.0f64; 5];
    for part in cell.parts() {
        let from = [part.origin[0] - cell.origin[0], part.origin[1] - cell.origin[1]];
        texels.each_patch(&part, |[i, j], weights, lit, of_patch| {
            let [x, y] = [f64::from(from[0] + i) * per_patch[0], f64::from(from[1] + j) * per_patch[1]];
            // The left and the right end of a line of the cell, and what is stored on the line at the sides of the patch.
            let on_line = |y: f64| {
                let (left, slope) = (p + (r - p) * y, (q - p) + ((s - r) - (q - p)) * y);
                (left + slope * x, left + slope * (x + per_patch[0]))
            };
            let ((a, b), (c, d)) = (on_line(y), on_line(y + per_patch[1]));
            let of_stored = weights[0] * a + weights[1] * b + weights[2] * c + weights[3] * d;
            let [a, b, c, d] = [lit[0] / a, lit[1] / b, lit[2] / c, lit[3] / d];
            let sides = a * b + c * d + a * c + b * d;
            square += (a * a + b * b + c * c + d * d + sides + 0.5 * (a * d + b * c)) * (1.0 / 9.0) * of_stored;
            mean += (a + b + c + d) * 0.25 * of_stored;
            (mass, light) = (mass + of_stored, light + of_patch);
            if of_stored > 0.0 {
                most = most.max(a.max(b).max(c.max(d)));
            }
        });
    }
    if !(light > 0.0) {
        return [0.0; 3];
    }
    let factor = mass / light;
    [factor * square - 2.0 * mean + light + light * skew_variance(texels, cell, size), light, factor * most]
}

/// The relative variance in a cell of a cube's grid, inside which the solid angle is stored as a product of two profiles. The skew is
/// how far it is from that, the mixed logarithmic derivative of q^(-3/2), q = 1 + s^2 + t^2, at the middle; the product of two numbers
/// in [-1/2, 1/2] has a variance of 1/144.
fn skew_variance(texels: &Texels<'_>, cell: &Tile, size: [f64; 2]) -> f64 {
    if texels.plan.of.layout != Layout::Cube {
        return 0.0;
    }
    let axes = &texels.plan.chart.axes;
    let sides = [0, 1].map(|k: usize| 2.0 * size[k] / f64::from(axes[k].length));
    let [s, t] = [0, 1].map(|k: usize| {
        let middle = f64::from(cell.origin[k]) + 0.5 * size[k] - f64::from(axes[k].shift);
        2.0 * middle / f64::from(axes[k].length) - 1.0
    });
    let q = 1.0 + s * s + t * t;
    let deviation = 6.0 * s * t / (q * q) * sides[0] * sides[1];
    deviation * deviation * (1.0 / 144.0)
}
