//! The coarsest grids that an error budget b allows.
//!
//! A grid is allowed if the relative variance of w = L / q over the block is at most b^2, and w at most 1 + 8 b or 4/3 everywhere: L
//! is the map's own bilinear light, q what the grid stores. Between the nodes of the map both are bilinear, so the largest w
//! lies at a node, and the error w - 1 is integrated as the bilinear function of its nodes.

use super::blocks::{CellBlocks, CellWork, Steps, parts, stored_corners};
use super::chart::Layout;
use super::plan::Filter;
use super::tables::BLOCK;
use super::texels::{Corners, Texels, Tile};

/// The largest w is this many budgets above 1, or a third: a block with a rare error of that size still fits the budget, and no
/// single sample stands out by it. The patches about a pole of a sky with waves in azimuth need that third.
const LARGEST: f32 = 8.0;
const LARGEST_AT_LEAST: f32 = 1.0 / 3.0;

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
    for (number, out) in (0..cell.count()).zip(steps.iter_mut()) {
        *out = coarsest(texels, &cell, number, [0, 0]);
    }
    let lengths = |cell: &CellBlocks, steps: &[Steps]| {
        cell.lengths(plan, |number| steps.get(number).copied().unwrap_or_default())
    };
    let mut choice = CellWork { lengths: lengths(&cell, steps), ..CellWork::default() };
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
            let single = (0..2).any(|k: usize| u32::from(least[k]) >= cell.side[k]);
            let chosen = if single { coarsest(texels, &doubled, number, least) } else { least };
            if let Some(out) = steps.get_mut(number) {
                *out = chosen;
            }
        }
        cell = doubled;
        choice = CellWork { level: level.into(), lengths: lengths(&cell, steps), ..CellWork::default() };
    }
    choice.variance = variance(texels, &cell, steps);
    choice
}

/// The variance that the blocks of a cell add, times their light. Apart from the choice, so that both share the stack.
#[inline(never)]
fn variance(texels: &Texels<'_>, cell: &CellBlocks, steps: &[Steps]) -> f64 {
    let (mut light, mut sum) = (NO_LIGHT, 0.0);
    let mut nodes = Nodes { part: None, light: &mut light };
    for (number, &steps) in (0..cell.count()).zip(steps).filter(|(_, steps)| **steps != [0, 0]) {
        let tile = cell.tile(number, steps);
        let [variance, light] = added(texels, &tile, f64::INFINITY, &mut nodes).unwrap_or_default();
        sum += variance + light * skew_variance(texels, &tile, skew(texels, &tile));
    }
    sum
}

/// The smallest steps of the blocks that block `number` of the next level replaces.
fn finest_below(cell: &CellBlocks, doubled: &CellBlocks, number: usize, steps: &[Steps]) -> Steps {
    let [columns, rows] = cell.blocks().map(|n| n as usize);
    let across = doubled.blocks()[0].max(1) as usize;
    let (column, row) = (2 * (number % across.max(1)), 2 * (number / across.max(1)));
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
/// then one of them.
#[inline(never)]
fn coarsest(texels: &Texels<'_>, cell: &CellBlocks, number: usize, least: Steps) -> Steps {
    let budget = f64::from(texels.plan.of.budget);
    let most = cell.side.map(|side| side as u8);
    let mut light = NO_LIGHT;
    let mut nodes = Nodes { part: None, light: &mut light };
    let mut allowed = |steps: Steps| {
        let tile = cell.tile(number, steps);
        let variance = budget * budget - skew_variance(texels, &tile, MOST_SKEW);
        (0..2).all(|k: usize| steps[k] <= most[k])
            && variance > 0.0
            && added(texels, &tile, variance, &mut nodes).is_some()
    };
    let mut best = least;
    while allowed([best[0] + 1, best[1] + 1]) {
        best = [best[0] + 1, best[1] + 1];
    }
    let both = best;
    for along in [[1, 0], [0, 1]] {
        while best[0] - both[0] + best[1] - both[1] == 0 || best[0] - both[0] > 0 && along[0] > 0 {
            let next = [best[0] + along[0], best[1] + along[1]];
            if !allowed(next) {
                break;
            }
            best = next;
        }
    }
    best
}

/// The most that [`skew`] can be.
const MOST_SKEW: f64 = 0.75;

/// How far the solid angle at the middle of a tile of a cube is from a product of two numbers, one for each axis: the mixed
/// logarithmic derivative of q^(-3/2), q = 1 + s^2 + t^2.
fn skew(texels: &Texels<'_>, tile: &Tile) -> f64 {
    let [s, t] = [0, 1].map(|k: usize| {
        let axis = &texels.plan.chart.axes[k];
        let middle = 0.5 * f64::from(tile.origin[k] + tile.end[k]) - f64::from(axis.shift);
        2.0 * middle / f64::from(axis.length) - 1.0
    });
    let q = 1.0 + s * s + t * t;
    6.0 * s * t / (q * q)
}

/// The relative variance that a skew makes in the cells of a cube's grid, inside which the solid angle is stored as a product of
/// two profiles: the product of two numbers in [-1/2, 1/2] has a variance of 1/144.
fn skew_variance(texels: &Texels<'_>, tile: &Tile, skew: f64) -> f64 {
    if texels.plan.of.layout != Layout::Cube {
        return 0.0;
    }
    let [width, height] = [0, 1].map(|k: usize| {
        let widest = (1u32 << tile.step[k]).min(tile.end[k] - tile.origin[k]);
        2.0 * f64::from(widest) / f64::from(texels.plan.chart.axes[k].length)
    });
    let deviation = skew * width * height;
    deviation * deviation * (1.0 / 144.0)
}

/// Nodes along a side of a part.
const NODES: usize = BLOCK + 1;

/// The light at the nodes of a part of a tile, in units of the map's mean; for a nearest client, of its patches.
struct Nodes<'a> {
    part: Option<Tile>,
    light: &'a mut Corners,
}

/// Room for the light of nodes.
const NO_LIGHT: Corners = [0.0; NODES * NODES];

impl Nodes<'_> {
    /// Those of the part with this origin and end.
    fn read(&mut self, texels: &Texels<'_>, part: &Tile) {
        if self.part.is_some_and(|held| held.origin == part.origin && held.end == part.end && held.face == part.face) {
            return;
        }
        if texels.plan.of.filter == Filter::Bilinear {
            texels.corners(part, self.light);
        } else {
            texels.patches(part, self.light);
        }
        let scale = scale(texels);
        for node in self.light.iter_mut() {
            *node = (f64::from(*node) * scale) as f32;
        }
        self.part = Some(*part);
    }
}

/// What light is multiplied by, so that neither huge nor tiny maps leave the range of f32.
fn scale(texels: &Texels<'_>) -> f64 {
    if texels.mean > 0.0 { 1.0 / f64::from(texels.mean) } else { 1.0 }
}

/// A number for each node of a line.
type Line = [f32; NODES];
/// A number for each patch of a row.
type PatchRow = [f32; BLOCK];

/// Where the patches of a part lie in the cells of a tile's grid, along an axis.
struct Axis {
    /// The cell of each patch.
    cell: [u8; NODES],
    /// The position of each node in the cell of its patch; of the last node, in that of the last patch.
    position: Line,
}

impl Axis {
    fn new(tile: &Tile, part: &Tile, axis: usize) -> Axis {
        let mut of = Axis { cell: [0; NODES], position: [0.0; NODES] };
        let patches = part.end[axis] - part.origin[axis];
        for (i, (cell, position)) in (0..=patches).zip(of.cell.iter_mut().zip(&mut of.position)) {
            let node = part.origin[axis] + i - tile.origin[axis];
            let at = (part.origin[axis] + i.min(patches - 1) - tile.origin[axis]) >> tile.step[axis];
            let (begin, end) = (tile.edge(axis, at) - tile.origin[axis], tile.edge(axis, at + 1) - tile.origin[axis]);
            *cell = at as u8;
            *position = (node - begin) as f32 / (end - begin) as f32;
        }
        of
    }
}

/// Two lines of nodes and the patches between them.
struct Row {
    /// What is stored at the nodes, above and below.
    stored: [Line; 2],
    /// The light there.
    light: [Line; 2],
    /// The node at the other side of a patch: the next one, or, for a nearest client, the patch's only one again.
    next: usize,
    /// The weights of the upper and of the lower nodes of each patch.
    weights: [PatchRow; 2],
}

impl Row {
    /// The integral over a patch of a function at its nodes.
    #[inline(always)]
    fn integral(&self, of: &[Line; 2], i: usize) -> f32 {
        let [upper, lower] = of;
        // An index below BLOCK and a step of 0 or 1, as the compiler shall see.
        let (i, next) = (i % BLOCK, i % BLOCK + (self.next & 1));
        self.weights[0][i] * (upper[i] + upper[next]) + self.weights[1][i] * (lower[i] + lower[next])
    }

    /// The mean of (w - 1)^2 over each patch, and the largest w - 1 of any; the light counts `factor` times.
    #[inline(always)]
    fn errors(&self, factor: &PatchRow) -> (PatchRow, f32) {
        let mut ratio = [[0.0; NODES]; 2];
        for (ratio, (light, stored)) in ratio.iter_mut().zip(self.light.iter().zip(&self.stored)) {
            for i in 0..NODES {
                ratio[i] = light[i] / stored[i];
            }
        }
        let [upper, lower] = ratio;
        let (mut squares, mut largest) = ([0.0; BLOCK], 0.0f32);
        for i in 0..BLOCK {
            let next = i + (self.next & 1);
            let [a, b] = [upper[i] * factor[i] - 1.0, upper[next] * factor[i] - 1.0];
            let [c, d] = [lower[i] * factor[i] - 1.0, lower[next] * factor[i] - 1.0];
            let sides = a * b + c * d + a * c + b * d;
            squares[i] = (a * a + b * b + c * c + d * d + sides + 0.5 * (a * d + b * c)) * (1.0 / 9.0);
            let most = a.max(b).max(c.max(d));
            largest = if self.weights[0][i] + self.weights[1][i] > 0.0 { largest.max(most) } else { largest };
        }
        (squares, largest)
    }
}

/// The relative variance that a grid adds to its tile, times the tile's light, and that light; `None` if the variance is above
/// `allowed`, or some w too large. With an infinite allowance there is no limit. Each row of the grid is finished before the next.
fn added(texels: &Texels<'_>, tile: &Tile, allowed: f64, nodes: &mut Nodes<'_>) -> Option<[f64; 2]> {
    let limited = allowed < f64::INFINITY;
    let largest = if limited { (LARGEST * texels.plan.of.budget).max(LARGEST_AT_LEAST) } else { f32::INFINITY };
    let mut coarse = [1.0; NODES * NODES];
    if texels.plan.of.filter == Filter::Bilinear {
        stored_corners(texels, tile, &mut coarse);
    }
    let (mut sum, mut total) = (0.0f64, 0.0f64);
    for grid_row in 0..tile.grid[1] {
        let rows = [tile.edge(1, grid_row), tile.edge(1, grid_row + 1)];
        // Of each cell of this row: what is stored, over the light.
        let mut integrals = [[0.0f32; BLOCK]; 2];
        each_row(texels, tile, rows, &coarse, nodes, &mut |cells, row| {
            for (i, &cell) in cells.iter().enumerate().take(BLOCK) {
                for (integrals, of) in integrals.iter_mut().zip([&row.stored, &row.light]) {
                    if let Some(out) = integrals.get_mut(usize::from(cell)) {
                        *out += row.integral(of, i);
                    }
                }
            }
            true
        });
        let [stored, light] = integrals;
        let mut factors = [0.0f32; BLOCK];
        for (factor, (stored, light)) in factors.iter_mut().zip(stored.iter().zip(light)) {
            *factor = if light > 0.0 { stored / light } else { 0.0 };
        }
        let fits = each_row(texels, tile, rows, &coarse, nodes, &mut |cells, row| {
            let mut factor = [0.0; BLOCK];
            for (out, &cell) in factor.iter_mut().zip(cells) {
                *out = factors.get(usize::from(cell)).copied().unwrap_or(0.0);
            }
            let (squares, most) = row.errors(&factor);
            let mut added = 0.0f32;
            for i in 0..BLOCK {
                let light = if factor[i] > 0.0 { row.integral(&row.stored, i) / factor[i] } else { 0.0 };
                added += squares[i] * light;
            }
            sum += f64::from(added);
            most <= largest
        });
        total += light.iter().map(|&l| f64::from(l)).sum::<f64>();
        if !fits {
            return None;
        }
    }
    if limited && sum > allowed * total { None } else { Some([sum, total].map(|light| light / scale(texels))) }
}

/// Calls `each` with the cells of the patches of each row of a tile between two edges, part by part, and the row, until it
/// answers false.
fn each_row(
    texels: &Texels<'_>,
    tile: &Tile,
    [first, end]: [u32; 2],
    coarse: &Corners,
    nodes: &mut Nodes<'_>,
    each: &mut dyn FnMut(&[u8], &Row) -> bool,
) -> bool {
    let bilinear = texels.plan.of.filter == Filter::Bilinear;
    for part in parts(tile).filter(|part| part.origin[1] < end && first < part.end[1]) {
        nodes.read(texels, &part);
        let (across, down) = (Axis::new(tile, &part, 0), Axis::new(tile, &part, 1));
        let next = usize::from(bilinear);
        let mut row = Row { next, stored: [[1.0; NODES]; 2], light: [[1.0; NODES]; 2], weights: [[0.0; BLOCK]; 2] };
        for y in first.max(part.origin[1])..end.min(part.end[1]) {
            let j = (y - part.origin[1]) as usize;
            texels.halves(&part, j as u32, &mut row.weights);
            // The lower line of a row is the upper one of the next.
            (row.stored[0], row.light[0]) = (row.stored[1], row.light[1]);
            let begin = if y == first.max(part.origin[1]) || !bilinear { 0 } else { 1 };
            for below in begin..2 {
                let line = j + if bilinear { below } else { 0 };
                let light = nodes.light.get(line * NODES..).and_then(|l| l.first_chunk::<NODES>());
                row.light[below] = light.copied().unwrap_or([0.0; NODES]);
                if bilinear {
                    let (cell, t) = (usize::from(down.cell[(j + below) % NODES]), down.position[(j + below) % NODES]);
                    row.stored[below] = stored_line(coarse, &across, cell, t);
                }
            }
            if !each(across.cell.get(..part.grid[0] as usize).unwrap_or(&[]), &row) {
                return false;
            }
        }
    }
    true
}

/// What is stored at the nodes of a line that lies at `t` between two rows of corners.
fn stored_line(coarse: &Corners, across: &Axis, row: usize, t: f32) -> Line {
    let mut mixed = [0.0; NODES];
    let above = coarse.get(row * NODES..).unwrap_or(&[]);
    let below = coarse.get((row + 1) * NODES..).unwrap_or(&[]);
    for (out, (a, b)) in mixed.iter_mut().zip(above.iter().zip(below)) {
        *out = a + (b - a) * t;
    }
    let mut line = [1.0; NODES];
    for (out, (&cell, &s)) in line.iter_mut().zip(across.cell.iter().zip(&across.position)) {
        let [from, to] = [mixed[usize::from(cell) % BLOCK], mixed[usize::from(cell) % BLOCK + 1]];
        *out = from + (to - from) * s;
    }
    line
}
