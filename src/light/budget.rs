//! The coarsest grids that an error budget b allows.
//!
//! A grid is allowed if the relative variance of w = L / q over the block is at most b^2, and w at most 1 + 8 b everywhere: L
//! is the map's own bilinear light, q what the grid stores. Between the nodes of the map both are bilinear, so the largest w
//! lies at a node, and the error w - 1 is integrated as the bilinear function of its nodes.

use super::blocks::{CellBlocks, Lengths, Steps, parts, stored_corners};
use super::plan::Filter;
use super::tables::BLOCK;
use super::texels::{Corners, Texels, Tile};

/// The largest w is this many budgets above 1: a block with a rare error of that size still fits the budget.
const LARGEST: f32 = 8.0;

/// Nodes along a side of a part.
const NODES: usize = BLOCK + 1;

/// What the budget makes of a cell.
#[derive(Clone, Copy, Debug, Default)]
pub struct Choice {
    /// How often its blocks are doubled.
    pub level: u32,
    /// What it takes.
    pub lengths: Lengths,
    /// The variance that coarser grids add, times the light.
    pub variance: f64,
}

/// Chooses the level and the grids of a cell; `steps` has room for those of its blocks at level 0.
///
/// Blocks are doubled as long as that saves memory, each with the finest of the grids that it replaces, or with a coarser one
/// if all of those were single cells.
pub fn choose(texels: &Texels<'_>, index: u32, steps: &mut [Steps]) -> Choice {
    let plan = texels.plan;
    let mut cell = CellBlocks::new(plan, index, 0);
    if !(plan.of.budget > 0.0) {
        steps.fill([0, 0]);
        return Choice { lengths: cell.full(plan), ..Choice::default() };
    }
    for (number, out) in (0..cell.count()).zip(steps.iter_mut()) {
        *out = coarsest(texels, &cell, number, [0, 0]);
    }
    let lengths = |cell: &CellBlocks, steps: &[Steps]| {
        cell.lengths(plan, |number| steps.get(number).copied().unwrap_or_default())
    };
    let mut choice = Choice { level: 0, lengths: lengths(&cell, steps), variance: 0.0 };
    for level in 1..=plan.levels(cell.patches) {
        let doubled = CellBlocks::new(plan, index, level);
        let finest = |number: usize| finest_below(&cell, &doubled, number, steps);
        let fits = (0..doubled.count()).all(|number| {
            let steps = finest(number);
            (0..2).all(|k: usize| u32::from(steps[k]) + super::plan::BLOCK_SIDE >= doubled.side[k])
        });
        if !fits || doubled.lengths(plan, finest).bytes() >= choice.lengths.bytes() {
            break;
        }
        for number in 0..doubled.count() {
            // The blocks that this one replaces stand at its own number or behind it.
            let least = finest_below(&cell, &doubled, number, steps);
            let single = (0..2).all(|k: usize| u32::from(least[k]) == cell.side[k]);
            let chosen = if single { coarsest(texels, &doubled, number, least) } else { least };
            if let Some(out) = steps.get_mut(number) {
                *out = chosen;
            }
        }
        cell = doubled;
        choice = Choice { level, lengths: lengths(&cell, steps), variance: 0.0 };
    }
    for (number, &steps) in (0..cell.count()).zip(steps.iter()).filter(|(_, steps)| **steps != [0, 0]) {
        choice.variance += added(texels, &cell.tile(number, steps), f64::INFINITY).unwrap_or(0.0);
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
/// coarsest first, since what is too coarse is found out soon; then one of them.
fn coarsest(texels: &Texels<'_>, cell: &CellBlocks, number: usize, least: Steps) -> Steps {
    let budget = f64::from(texels.plan.of.budget);
    let most = cell.side.map(|side| side as u8);
    let allowed = |steps: Steps| added(texels, &cell.tile(number, steps), budget * budget).is_some();
    let grown = |by: u8| [(least[0] + by).min(most[0]), (least[1] + by).min(most[1])];
    let room = (most[0].saturating_sub(least[0])).max(most[1].saturating_sub(least[1]));
    let mut best = least;
    if let Some(by) = (1..=room).rev().find(|&by| allowed(grown(by))) {
        best = grown(by);
    }
    for axis in [0, 1] {
        let mut next = best;
        next[axis] += 1;
        while next[axis] <= most[axis] && allowed(next) {
            best = next;
            next[axis] += 1;
        }
        if best != grown(0) && next[axis] > best[axis] + 1 {
            break;
        }
    }
    best
}

/// Values at the nodes of a part, row by row.
type Nodes = [f32; NODES * NODES];

/// Solid angles of the upper and of the lower half of each patch of a row, weighted by the distance from the other edge.
type Weights = [[f32; 2]; BLOCK];

/// Where the patches of a part lie in the cells of a tile's grid, along an axis.
struct Axis {
    cell: [u8; BLOCK],
    /// The positions of both edges of each patch in its cell.
    edges: [[f32; 2]; BLOCK],
    patches: usize,
}

impl Axis {
    fn new(tile: &Tile, part: &Tile, axis: usize) -> Axis {
        let mut of = Axis { cell: [0; BLOCK], edges: [[0.0; 2]; BLOCK], patches: part.grid[axis] as usize };
        for (i, (cell, edges)) in (0..part.grid[axis]).zip(of.cell.iter_mut().zip(&mut of.edges)) {
            let patch = part.origin[axis] + i;
            let at = (patch - tile.origin[axis]) >> tile.step[axis];
            let (begin, end) = (tile.edge(axis, at), tile.edge(axis, at + 1));
            let scale = 1.0 / (end - begin) as f32;
            *cell = at as u8;
            *edges = [(patch - begin) as f32 * scale, (patch + 1 - begin) as f32 * scale];
        }
        of
    }
}

/// What is stored for the light of the four nodes of each patch of a row, and that light.
struct Row {
    /// What is stored: upper left, upper right, lower left, lower right.
    stored: [[f32; BLOCK]; 4],
    /// The light over what is stored.
    ratio: [[f32; BLOCK]; 4],
    weights: Weights,
}

/// The grid of a tile, and sums over its cells.
struct Sums {
    coarse: Corners,
    /// Integrals of the stored function, which become the factors that make it the light.
    shape: [f32; BLOCK * BLOCK],
    light: [f32; BLOCK * BLOCK],
}

/// The relative variance that a grid adds to its tile, times the tile's light; `None` if it is above `allowed`, or some w too
/// large. With an infinite allowance there is no limit.
fn added(texels: &Texels<'_>, tile: &Tile, allowed: f64) -> Option<f64> {
    let limited = allowed < f64::INFINITY;
    let bilinear = texels.plan.of.filter == Filter::Bilinear;
    let mut sums = Sums { coarse: [1.0; NODES * NODES], shape: [0.0; BLOCK * BLOCK], light: [0.0; BLOCK * BLOCK] };
    if bilinear {
        stored_corners(texels, tile, &mut sums.coarse);
    }
    let mut fine = [0.0; NODES * NODES];
    // A block of level 0 is one part, whose nodes serve both passes.
    let single = parts(tile).nth(1).is_none();
    for part in parts(tile) {
        nodes(texels, &part, &mut fine);
        each_row(texels, tile, &part, &sums.coarse, &fine, |cells, row| {
            for (i, &cell) in cells.iter().enumerate() {
                let (shape, light) = row.integrals(i);
                if let (Some(s), Some(l)) = (sums.shape.get_mut(cell), sums.light.get_mut(cell)) {
                    *s += shape;
                    *l += light;
                }
            }
            true
        });
    }
    let total: f64 = sums.light.iter().map(|&l| f64::from(l)).sum();
    for (shape, light) in sums.shape.iter_mut().zip(&sums.light) {
        *shape = if *light > 0.0 { *shape / light } else { 0.0 };
    }
    let most = if limited { (total * allowed) as f32 } else { f32::INFINITY };
    let largest = if limited { LARGEST * texels.plan.of.budget } else { f32::INFINITY };
    let mut sum = 0.0f32;
    for part in parts(tile) {
        if !single {
            nodes(texels, &part, &mut fine);
        }
        let fits = each_row(texels, tile, &part, &sums.coarse, &fine, |cells, row| {
            let mut worst = 0.0f32;
            for (i, &cell) in cells.iter().enumerate() {
                let factor = sums.shape.get(cell).copied().unwrap_or(0.0);
                if factor > 0.0 {
                    let (square, above) = row.error(i, factor);
                    sum += square * row.integrals(i).0 / factor;
                    worst = worst.max(above);
                }
            }
            worst <= largest && sum <= most
        });
        if !fits {
            return None;
        }
    }
    Some(f64::from(sum) / scale(texels))
}

/// What light is multiplied by, so that neither huge nor tiny maps leave the range of f32.
fn scale(texels: &Texels<'_>) -> f64 {
    if texels.mean > 0.0 { 1.0 / f64::from(texels.mean) } else { 1.0 }
}

/// The light at the nodes of a part; for a nearest client, of its patches.
fn nodes(texels: &Texels<'_>, part: &Tile, nodes: &mut Nodes) {
    if texels.plan.of.filter == Filter::Bilinear {
        texels.corners(part, nodes);
    } else {
        texels.patches(part, nodes);
    }
    let scale = scale(texels);
    for node in nodes.iter_mut() {
        *node = (f64::from(*node) * scale) as f32;
    }
}

/// Calls `each` with the cells of the patches of each row of a part, and the row, until it answers false.
fn each_row(
    texels: &Texels<'_>,
    tile: &Tile,
    part: &Tile,
    coarse: &Corners,
    fine: &Nodes,
    mut each: impl FnMut(&[usize], &Row) -> bool,
) -> bool {
    let (across, down) = (Axis::new(tile, part, 0), Axis::new(tile, part, 1));
    let bilinear = texels.plan.of.filter == Filter::Bilinear;
    let mut row = Row { stored: [[1.0; BLOCK]; 4], ratio: [[1.0; BLOCK]; 4], weights: [[0.0; 2]; BLOCK] };
    let mut cells = [0usize; BLOCK];
    for j in 0..down.patches {
        texels.halves(part, j as u32, &mut row.weights);
        let (cell_row, edges) = (usize::from(down.cell[j % BLOCK]), down.edges[j % BLOCK]);
        for (cell, &at) in cells.iter_mut().zip(&across.cell) {
            *cell = cell_row * BLOCK + usize::from(at);
        }
        for (lower, &t) in edges.iter().enumerate() {
            let light = fine.get((j + lower * usize::from(bilinear)) * NODES..).unwrap_or(&[]);
            if !bilinear {
                for (i, &l) in light.iter().take(across.patches).enumerate() {
                    row.ratio[2 * lower][i % BLOCK] = l;
                    row.ratio[2 * lower + 1][i % BLOCK] = l;
                }
                continue;
            }
            let above = coarse.get(cell_row * NODES..).unwrap_or(&[]);
            let below = coarse.get((cell_row + 1) * NODES..).unwrap_or(&[]);
            let mut mixed = [0.0f32; NODES];
            for (out, (a, b)) in mixed.iter_mut().zip(above.iter().zip(below)) {
                *out = a + (b - a) * t;
            }
            for (i, pair) in light.windows(2).take(across.patches).enumerate() {
                let at = usize::from(across.cell[i % BLOCK]);
                let (&[from, to], &[left, right]) =
                    (mixed.get(at..).and_then(|m| m.first_chunk::<2>()).unwrap_or(&[0.0; 2]), &across.edges[i % BLOCK]);
                for (right_edge, s) in [left, right].into_iter().enumerate() {
                    let stored = from + (to - from) * s;
                    row.stored[2 * lower + right_edge][i % BLOCK] = stored;
                    row.ratio[2 * lower + right_edge][i % BLOCK] =
                        pair.get(right_edge).copied().unwrap_or(0.0) / stored;
                }
            }
        }
        if !each(cells.get(..across.patches).unwrap_or(&[]), &row) {
            return false;
        }
    }
    true
}

impl Row {
    /// The integrals over a patch of what is stored and of the light.
    #[inline(always)]
    fn integrals(&self, i: usize) -> (f32, f32) {
        let i = i % BLOCK;
        let [upper, lower] = self.weights[i];
        let [a, b, c, d] = [self.stored[0][i], self.stored[1][i], self.stored[2][i], self.stored[3][i]];
        let [p, q, r, s] = [self.ratio[0][i], self.ratio[1][i], self.ratio[2][i], self.ratio[3][i]];
        (upper * (a + b) + lower * (c + d), upper * (a * p + b * q) + lower * (c * r + d * s))
    }

    /// The mean of (w - 1)^2 over a patch, and the largest w - 1.
    #[inline(always)]
    fn error(&self, i: usize, factor: f32) -> (f32, f32) {
        let i = i % BLOCK;
        let of = |k: usize| self.ratio[k][i] * factor - 1.0;
        let [a, b, c, d] = [of(0), of(1), of(2), of(3)];
        let squares = a * a + b * b + c * c + d * d;
        let sides = a * b + c * d + a * c + b * d;
        let square = (squares + sides + 0.5 * (a * d + b * c)) * (1.0 / 9.0);
        (square, a.max(b).max(c.max(d)))
    }
}
