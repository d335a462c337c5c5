//! The texel map: the light at the corners of patches in 16 bits, the upper half of an f32, and the only look-up of it.
//!
//! Corner (i, j) of a face lies at position (i, j) less the shift of its axes: where half a patch lies at a border, beyond that. So
//! bilinear interpolation holds on all of a face. A nearest client has the value of a patch at its first corner, and reads no other.
//!
//! Without an error budget the map is one tile: all rows of corners of all faces. With one, a face is cut into square tiles, each
//! with its own step: it stores every 2^step-th corner.

use super::chart::{Chart, Layout};
use super::plan::{Filter, Plan};
pub use super::radiance::ONE_TILE as WHOLE;
use super::radiance::{STEP_SHIFT, decode, encode};
use super::tables::Light;
use super::texels::Texels;
use core::f32::consts::PI;

/// Words of zeros behind the last: words are read in pairs.
pub const PAD: usize = 16;
/// The same with an error budget.
const TILE_SIDE: u32 = 5;
/// Corners along a side of a tile, at most.
const NODES: usize = (1 << TILE_SIDE) + 1;
/// Tiles begin at multiples of so many words.
const GROUP: usize = 8;
/// L over what a coarse tile says is at most so many budgets above 1, or a third, as in the tables.
const LARGEST: f32 = 8.0;
const LARGEST_AT_LEAST: f32 = 1.0 / 3.0;

/// log2 of the patches along a side of a tile.
pub fn tile_side(plan: &Plan) -> u32 {
    if plan.of.budget > 0.0 { TILE_SIDE } else { WHOLE }
}

/// The records of the table of tiles.
pub fn tile_count(plan: &Plan) -> usize {
    if tile_side(plan) == WHOLE {
        return 1;
    }
    let along = plan.chart.axes.map(|axis| axis.patches.div_ceil(1 << TILE_SIDE) as usize);
    plan.chart.faces() as usize * along[0] * along[1]
}

/// Words of a map of one tile.
fn whole_words(plan: &Plan) -> u64 {
    let corners = plan.chart.axes.map(|axis| u64::from(axis.patches) + 1);
    u64::from(plan.chart.faces()) * corners[0] * corners[1]
}

/// The words of a map whose tiles take so many groups, with the zeros behind them.
pub fn words(plan: &Plan, groups: u64) -> u64 {
    let words = if tile_side(plan) == WHOLE { whole_words(plan) } else { groups.saturating_mul(GROUP as u64) };
    words.saturating_add(PAD as u64)
}

/// Corners along a side of a tile.
fn nodes(step: u8) -> usize {
    (1 << TILE_SIDE >> step) + 1
}

/// Groups of words that a tile takes.
fn groups(step: u8) -> usize {
    (nodes(step) * nodes(step)).div_ceil(GROUP)
}

/// The tiles whose first patch lies in cell `index`, which writes them: their numbers in the table, face and first patch.
fn tiles_of(plan: &Plan, index: u32) -> impl Iterator<Item = (usize, u32, [u32; 2])> + use<> {
    let (face, origin, patches) = plan.cell(index);
    let side = tile_side(plan);
    let first = [0, 1].map(|k: usize| origin[k].div_ceil(1 << side));
    let end = [0, 1].map(|k: usize| if side == WHOLE { 0 } else { (origin[k] + patches[k]).div_ceil(1 << side) });
    let along = plan.chart.axes.map(|axis| axis.patches.div_ceil(1 << side));
    (first[1]..end[1]).flat_map(move |y| {
        let row = (face * along[1] + y) * along[0];
        (first[0]..end[0]).map(move |x| ((row + x) as usize, face, [x << side, y << side]))
    })
}

/// The tiles of all cells before this one, and its own.
pub fn tile_range(plan: &Plan, index: u32) -> (usize, usize) {
    let count = |index: u32| tiles_of(plan, index).count();
    ((0..index).map(count).sum(), count(index))
}

/// Groups of words of a cell's tiles at their finest.
pub fn full_groups(plan: &Plan, index: u32) -> u64 {
    (tiles_of(plan, index).count() * groups(0)) as u64
}

/// Chooses the steps of a cell's tiles, and answers the groups of words that they take.
pub fn choose(texels: &Texels<'_>, index: u32, steps: &mut [u8]) -> u64 {
    let tiles = tiles_of(texels.plan, index).zip(steps.iter_mut());
    tiles.fold(0, |sum, ((_, face, origin), step)| {
        *step = coarsest(texels, face, origin);
        sum + groups(*step) as u64
    })
}

/// Writes the table of tiles.
pub fn write_table(plan: &Plan, steps: &[u8], table: &mut [u32]) {
    table.fill(0);
    let mut at = 0;
    let tiles = (0..plan.cells()).flat_map(|index| tiles_of(plan, index));
    for ((number, ..), &step) in tiles.zip(steps) {
        if let Some(record) = table.get_mut(number) {
            *record = u32::from(step) << STEP_SHIFT | at as u32;
        }
        at += groups(step);
    }
}

/// Corners that one thread writes: a tile, or a part of a row.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// Its first word.
    pub start: usize,
    /// Its words.
    pub length: usize,
    face: u32,
    origin: [u32; 2],
    columns: usize,
    step: u8,
}

/// The pieces of a cell's part of the map; `first` group of words, and the steps of its tiles.
pub fn pieces(plan: &Plan, index: u32, first: u64, steps: &[u8]) -> impl Iterator<Item = Piece> {
    let tiles = tiles_of(plan, index).zip(steps.iter().copied());
    let mut at = first as usize * GROUP;
    let tiles = tiles.map(move |((_, face, origin), step)| {
        let (start, columns) = (at, nodes(step));
        at += groups(step) * GROUP;
        Piece { start, length: groups(step) * GROUP, face, origin, columns, step }
    });
    let (face, origin, patches) = plan.cell(index);
    let all = plan.chart.axes.map(|axis| axis.patches);
    // The last cells of a face have its last corners.
    let end = [0, 1].map(|k: usize| origin[k] + patches[k] + u32::from(origin[k] + patches[k] == all[k]));
    let rows = if tile_side(plan) == WHOLE { origin[1]..end[1] } else { 0..0 };
    tiles.chain(rows.map(move |y| {
        let row = (face * (all[1] + 1) + y) as usize * (all[0] as usize + 1);
        let columns = (end[0] - origin[0]) as usize;
        Piece { start: row + origin[0] as usize, length: columns, face, origin: [origin[0], y], columns, step: 0 }
    }))
}

/// Writes a piece of the map.
pub fn write(texels: &Texels<'_>, piece: &Piece, words: &mut [u16]) {
    let Piece { face, origin, columns, step, .. } = *piece;
    let row_count = if columns == words.len() { 1 } else { columns };
    let rows = words.chunks_exact_mut(columns.max(1));
    for (j, row) in (0..).zip(rows).take(row_count) {
        let y = origin[1] + (j << step);
        if step == 0 && texels.corner_row(face, [origin[0], y], row) {
            continue;
        }
        for (i, word) in (0..).zip(row.iter_mut()) {
            *word = encode(texels.node(face, [origin[0] + (i << step), y], step));
        }
    }
    words.get_mut(row_count * columns..).unwrap_or_default().fill(0);
}

/// The coarsest step of a tile that the budget allows.
#[inline(never)]
fn coarsest(texels: &Texels<'_>, face: u32, origin: [u32; 2]) -> u8 {
    let patches = texels.plan.chart.axes.map(|axis| axis.patches);
    let corners = [0, 1].map(|k: usize| patches[k].min(origin[k] + (1 << TILE_SIDE)) - origin[k] + 1);
    let mut fine = [0.0; NODES * NODES];
    for (y, row) in (0..corners[1]).zip(fine.chunks_exact_mut(NODES)) {
        for (x, out) in (0..corners[0]).zip(row) {
            *out = texels.node(face, [origin[0] + x, origin[1] + y], 0);
        }
    }
    let allowed = |step: &u8| is_allowed(texels, face, origin, corners, &fine, *step);
    (1..=TILE_SIDE as u8).rev().find(allowed).unwrap_or(0)
}

/// Whether the relative variance that a step adds to a tile is within the budget, and nothing is far too dark.
fn is_allowed(
    texels: &Texels<'_>,
    face: u32,
    origin: [u32; 2],
    corners: [u32; 2],
    fine: &[f32; NODES * NODES],
    step: u8,
) -> bool {
    let Plan { chart, of, .. } = texels.plan;
    let bilinear = of.filter == Filter::Bilinear;
    let last = corners.map(|n| n - 1);
    // Of the tile's own corners, those of the coarse grid.
    let stored = |at: [u32; 2]| {
        let [x, y] = [0, 1].map(|k: usize| (at[k] << step).min(last[k]) as usize);
        fine.get(y * NODES + x).copied().unwrap_or(0.0)
    };
    // For a nearest client, of a row of the coarse grid: each is the mean of many patches.
    let mut means = [0.0; NODES];
    let largest = 1.0 + (LARGEST * of.budget).max(LARGEST_AT_LEAST);
    let (mut sum, mut total) = (0.0f64, 0.0f64);
    let inside = if bilinear { 0 } else { 1 };
    for (y, row) in (0..corners[1] - inside).zip(fine.chunks_exact(NODES)) {
        let inside_cell = |n: u32| n & ((1 << step) - 1);
        if !bilinear && inside_cell(y) == 0 {
            for (x, mean) in (0..corners[0]).step_by(1 << step).zip(&mut means) {
                *mean = texels.node(face, [origin[0] + x, origin[1] + y], step);
            }
        }
        for (x, &light) in (0..corners[0] - inside).zip(row) {
            let [i, j] = [x >> step, y >> step];
            let [s, t] = [x, y].map(|n| inside_cell(n) as f32 / (1 << step) as f32);
            let line =
                |j: u32| if s > 0.0 { stored([i, j]) * (1.0 - s) + stored([i + 1, j]) * s } else { stored([i, j]) };
            let coarse = match bilinear {
                true if t > 0.0 => line(j) * (1.0 - t) + line(j + 1) * t,
                true => line(j),
                false => means.get(i as usize).copied().unwrap_or(0.0),
            };
            if light > largest * coarse {
                return false;
            }
            let border = |n: u32, last: u32| if bilinear && (n == 0 || n == last) { 0.5 } else { 1.0 };
            let at = [x, y].map(|n| n as f32);
            let at = [0, 1].map(|k: usize| chart.axes[k].edge(origin[k] as f32 + at[k]));
            let weight = border(x, last[0]) * border(y, last[1]) * solid_angle(chart, at);
            let missing = if coarse > 0.0 { light / coarse - 1.0 } else { 0.0 };
            sum += f64::from(weight * missing * missing) * f64::from(coarse);
            total += f64::from(weight) * f64::from(light);
        }
    }
    sum <= f64::from(of.budget) * f64::from(of.budget) * total
}

/// Steradians for each unit of position.
pub fn solid_angle(chart: &Chart, position: [f32; 2]) -> f32 {
    let [columns, rows] = chart.axes.map(|axis| axis.length);
    match chart.layout {
        Layout::LatLong => {
            let sine = libm::sin(f64::from(position[1]) * core::f64::consts::PI / f64::from(rows)).max(0.0);
            2.0 * PI / columns * (PI / rows) * sine as f32
        }
        Layout::Cube => {
            let unit = 2.0 / columns;
            let [s, t] = position.map(|x| x * unit - 1.0);
            let squared = 1.0 + s * s + t * t;
            unit * unit / (squared * crate::numeric::sqrt(squared))
        }
        Layout::Octahedral => 4.0 * PI / (columns * columns),
    }
}

impl Light<'_> {
    /// The radiance of the texel map at a position on a face.
    pub fn radiance(&self, face: u32, position: [f32; 2]) -> f32 {
        let [(x, s), (y, t)] = [0, 1].map(|k: usize| {
            let axis = &self.chart.axes[k];
            let at = (position[k] + axis.shift).max(0.0);
            let patch = (at as u32).min(axis.patches - 1);
            (patch, if self.bilinear { (at - patch as f32).min(1.0) } else { 0.0 })
        });
        self.radiance_in(face, [x, y], [s, t])
    }

    /// The same inside a patch.
    pub(super) fn radiance_in(&self, face: u32, patch: [u32; 2], inside: [f32; 2]) -> f32 {
        let (first, stride, [s, t]) = self.corner_in(face, patch, inside);
        let word = |at: usize| decode(self.texels.get(at).copied().unwrap_or(0));
        let line = |at: usize| word(at) * (1.0 - s) + word(at + 1) * s;
        line(first) * (1.0 - t) + line(first + stride) * t
    }

    /// The word of the corner before a place in a patch, how many words a row of corners takes, and how far the place lies behind it.
    fn corner_in(&self, face: u32, patch: [u32; 2], inside: [f32; 2]) -> (usize, usize, [f32; 2]) {
        let side = self.tile_side & 31;
        let patches = self.chart.axes.map(|axis| axis.patches);
        if side == WHOLE {
            let stride = patches[0] as usize + 1;
            let row = (face * (patches[1] + 1) + patch[1]) as usize;
            return (row * stride + patch[0] as usize, stride, inside);
        }
        let along = patches.map(|n| n.div_ceil(1 << side));
        let number = (face * along[1] + (patch[1] >> side)) * along[0] + (patch[0] >> side);
        let record = self.tiles.get(number as usize).copied().unwrap_or(0);
        let step = record >> STEP_SHIFT;
        let start = (record & ((1 << STEP_SHIFT) - 1)) as usize * GROUP;
        let stride = (1usize << side >> step) + 1;
        let own = patch.map(|n| n & ((1 << side) - 1));
        let [x, y] = own.map(|n| (n >> step) as usize);
        let size = 1.0 / (1u32 << step) as f32;
        let within = [0, 1].map(|k: usize| ((own[k] & ((1 << step) - 1)) as f32 + inside[k]) * size);
        let within = if self.bilinear { within } else { [0.0; 2] };
        (start + y * stride + x, stride, within)
    }
}

/// Whether every tile lies in front of the zeros, and every word is a light.
pub fn is_sound(plan: &Plan, light: &Light<'_>) -> bool {
    let Some(end) = light.texels.len().checked_sub(PAD) else { return false };
    let tile_fits = |&record: &u32| {
        let (step, start) = (record >> STEP_SHIFT, (record & ((1 << STEP_SHIFT) - 1)) as usize * GROUP);
        step <= TILE_SIDE && start.checked_add(groups(step as u8) * GROUP).is_some_and(|behind| behind <= end)
    };
    let tiles = if tile_side(plan) == WHOLE { light.tiles == [0] } else { light.tiles.iter().all(tile_fits) };
    let rest = light.texels.get(end..).unwrap_or(&[]);
    tiles
        && light.tile_side == tile_side(plan)
        && light.texels.iter().all(|&word| word <= encode(f32::MAX))
        && rest.iter().all(|&word| word == 0)
}
