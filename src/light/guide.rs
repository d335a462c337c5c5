//! What a product must know of each cell without reading the tables: where its corners are, where its light is, how far it reaches.
//!
//! Written once with the light, so that preparing a product needs no trigonometry and no walk. The light of a cell is known by
//! the directions that the middles of 4 x 4 parts of its numbers (w, v) lead to.
//!
//! All but the light of cells is kept in 16 bits: F between corners is known far less exactly, and a preparation from cold caches waits for
//! half as many lines.

use super::parts::{self, Area, BORDERS, Borders, EVEN, MIDDLES, PARTS, Sampled};
use super::tables::Light;
use crate::numeric::sqrt;
use crate::simd::{Four, GROUP, Num};
use glam::Vec3;

/// A number of each cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Column {
    /// Of the quadrants of the numbers (w, v), row by row: the mean position of their light along columns, 0 to 1 in the cell.
    Across = 0,
    /// The same along rows.
    Down = 4,
    /// The axis of a cone that contains the cell.
    AxisX = 8,
    /// The axis.
    AxisY = 9,
    /// The axis.
    AxisZ = 10,
    /// The sine of the cone's half-angle.
    Sine = 11,
    /// The cosine of the cone's half-angle.
    Cosine = 12,
}

/// How many of these numbers a cell has.
const COLUMNS: usize = 13;

/// The numbers of a group of cells.
pub type Columns = [[Short; GROUP]; COLUMNS];

/// Numbers of the parts of a cell, filled up to two cache lines.
const OF_PARTS: usize = (3 * MIDDLES + BORDERS).next_multiple_of(32);

/// A number from -1 to 1, in steps of 2^-15; 1 is one step less.
pub type Short = i16;

/// Steps in 1.
pub const STEPS: f32 = 32768.0;

/// No number differs by more from what it was.
pub const ROUNDING: f32 = 1.0 / STEPS;

/// The nearest step.
fn short(x: f32) -> Short {
    // Conversions end at the ends of their range.
    (x * STEPS + 0.5f32.copysign(x)) as Short
}

/// The number of a step.
#[inline(always)]
pub fn value(x: Short) -> f32 {
    f32::from(x) * ROUNDING
}

/// The first numbers of a slice; zeros if it is too short.
#[inline(always)]
pub fn read<F: Num>(numbers: &[Short]) -> F {
    F::shorts(numbers) * ROUNDING
}

/// The most corners of cells: lat-long and octahedral maps have 17 x 9, cubes six times 5 x 5.
pub const MAX_CORNERS: usize = 160;
/// The most cells: 16 x 8.
pub const MAX_CELLS: usize = 128;

/// Numbers along each axis of the lattice that finds how far a cell reaches.
const LATTICE: usize = 9;

/// No cell of a sound guide has a larger share of the light: it may exceed 1 by rounding.
const LARGEST: f32 = 1.0 + 1e-5;

/// The guide of a light.
#[derive(Clone, Copy, Debug)]
pub struct Guide<'a> {
    /// Cells along columns, and along the rows of one face.
    face_grid: [usize; 2],
    cells: usize,
    corner_count: usize,
    /// Of each cell x, then y, then z of the middles of its parts, row by row; then their borders. First, so that no cell begins inside a line.
    parts: &'a [[Short; OF_PARTS]],
    /// The light of each cell.
    masses: &'a [[f32; GROUP]],
    /// [`COLUMNS`] numbers of groups of cells, column by column.
    columns: &'a [Columns],
    /// x, then y, then z of all corners, face by face, row by row.
    corners: &'a [Short],
}

/// Corners of so many cells, filled up to whole groups.
fn corner_count([columns, rows]: [u32; 2], faces: u32) -> usize {
    ((columns as usize + 1) * (rows as usize / faces.max(1) as usize + 1) * faces as usize).next_multiple_of(GROUP)
}

/// Where the parts, the masses, the columns and the corners of a guide end, in numbers of 16 bits.
fn ends(grid: [u32; 2], faces: u32) -> [usize; 4] {
    let cells = grid[0] as usize * grid[1] as usize;
    let parts = OF_PARTS * cells;
    let masses = parts + size_of::<f32>() / size_of::<Short>() * cells;
    let columns = masses + COLUMNS * cells;
    [parts, masses, columns, columns + 3 * corner_count(grid, faces)]
}

/// The numbers of 16 bits that a guide takes, for cells along columns and rows of all faces.
pub fn length(grid: [u32; 2], faces: u32) -> usize {
    let [.., end] = ends(grid, faces);
    end
}

impl<'a> Guide<'a> {
    /// The guide that numbers hold; empty if they are too few.
    #[inline(always)]
    pub fn new(grid: [u32; 2], faces: u32, numbers: &'a [Short]) -> Guide<'a> {
        let [parts, masses, columns, corners] = ends(grid, faces);
        let of = |from: usize, to: usize| numbers.get(from..to).unwrap_or(&[]);
        Guide {
            face_grid: [grid[0] as usize, grid[1] as usize / faces.max(1) as usize],
            cells: grid[0] as usize * grid[1] as usize,
            corner_count: corner_count(grid, faces),
            parts: bytemuck::try_cast_slice(of(0, parts)).unwrap_or(&[]),
            masses: bytemuck::try_cast_slice(of(parts, masses)).unwrap_or(&[]),
            columns: bytemuck::try_cast_slice(of(masses, columns)).unwrap_or(&[]),
            corners: of(columns, corners),
        }
    }

    /// The number of cells, whole groups of them.
    #[inline(always)]
    pub fn cells(&self) -> usize {
        self.cells
    }

    /// The number of corners, whole groups of them.
    #[inline(always)]
    pub fn corners(&self) -> usize {
        self.corner_count
    }

    /// The directions of all corners: x, y and z.
    pub fn corner_directions(&self) -> [&'a [Short]; 3] {
        columns(self.corners, self.corner_count)
    }

    /// The directions of the middles of a cell's parts, x, y and z; then the borders of the parts.
    #[inline(always)]
    pub fn parts(&self, cell: usize) -> &'a [Short; OF_PARTS] {
        self.parts.get(cell).unwrap_or(&[0; OF_PARTS])
    }

    /// The directions of the middles of a cell's parts: x, y and z.
    #[inline(always)]
    pub fn middles(&self, cell: usize) -> [&'a [Short]; 3] {
        columns(self.parts(cell), MIDDLES)
    }

    /// The borders of a cell's parts, in steps of [`ROUNDING`].
    #[inline(always)]
    pub fn steps(&self, cell: usize) -> &'a [Short; BORDERS] {
        let [_, rest] = self.parts(cell).split_at(3 * MIDDLES).into();
        rest.first_chunk().unwrap_or(&[0; BORDERS])
    }

    /// The borders of a cell's parts.
    #[inline(always)]
    pub fn borders(&self, cell: usize) -> Borders {
        // One number stands behind them.
        let mut borders = [0.0; BORDERS + 1];
        for first in (0..BORDERS).step_by(Four::WIDTH) {
            read::<Four>(self.parts(cell).get(3 * MIDDLES + first..).unwrap_or(&[])).write(&mut borders, first);
        }
        borders.first_chunk().copied().unwrap_or_default()
    }

    /// A cell's share of the light.
    #[inline(always)]
    pub fn mass(&self, cell: usize) -> f32 {
        self.masses.as_flattened().get(cell).copied().unwrap_or(0.0)
    }

    /// The shares of all cells, eight by eight.
    #[inline(always)]
    pub fn masses(&self) -> &'a [[f32; GROUP]] {
        self.masses
    }

    /// The numbers of all cells, eight by eight.
    #[inline(always)]
    pub fn columns(&self) -> &'a [Columns] {
        self.columns
    }

    /// The first corner of a cell.
    #[inline(always)]
    pub fn corner_of(&self, cell: usize) -> usize {
        // Powers of two.
        let [columns, rows] = self.face_grid;
        let (row, column) = (cell >> (columns.trailing_zeros() & 31), cell & columns.wrapping_sub(1));
        // A face has one row of corners more than of cells.
        (row + (row >> (rows.trailing_zeros() & 31))) * (columns + 1) + column
    }

    /// The columns of cells on a face.
    #[inline(always)]
    pub fn row_length(&self) -> usize {
        let [columns, _] = self.face_grid;
        columns
    }

    /// Whether all numbers are there, shares of the light are such that products of them are finite, and parts have a width.
    pub fn is_sound(&self) -> bool {
        self.masses.as_flattened().len() == self.cells
            && self.corners.len() == 3 * self.corner_count
            && self.masses.as_flattened().iter().all(|mass| mass.abs() <= LARGEST)
            && (0..self.cells).all(|cell| parts::are_sound(&self.borders(cell)))
    }
}

/// The first three columns of `count` numbers each; empty if they are too few.
#[inline(always)]
fn columns(numbers: &[Short], count: usize) -> [&[Short]; 3] {
    let column = |k: usize| numbers.get(k * count..(k + 1) * count).unwrap_or(&[]);
    [column(0), column(1), column(2)]
}

/// What is written of one cell.
#[derive(Clone, Copy, Debug)]
pub struct CellGuide {
    mass: f32,
    columns: [f32; COLUMNS],
    middles: [[f32; MIDDLES]; 3],
    borders: [Short; BORDERS],
}

impl CellGuide {
    /// Measures a cell of a light whose tables are complete. `room`: as for [`parts::borders`].
    pub fn of(light: &Light<'_>, cell: u32, room: &mut [f32]) -> CellGuide {
        let mut guide = CellGuide {
            mass: light.cell(cell).probability,
            columns: [0.0; COLUMNS],
            middles: [[0.0; MIDDLES]; 3],
            borders: EVEN.map(short),
        };
        let area = Area::new(light, cell);
        for first in (0..MIDDLES).step_by(Four::WIDTH) {
            let sampled = middles(&area, &EVEN, first);
            for (axis, column) in [Column::Across, Column::Down].into_iter().enumerate() {
                guide.add_means(column, first, &sampled.position[axis].store());
            }
        }
        let (axis, [sine, cosine]) = cone(&area);
        guide.borders = parts::borders(&area, axis, room).map(short);
        // As they are read.
        let borders = guide.borders.map(value);
        for first in (0..MIDDLES).step_by(Four::WIDTH) {
            let sampled = middles(&area, &borders, first);
            for (out, x) in guide.middles.iter_mut().zip(sampled.direction) {
                for (out, x) in out.iter_mut().skip(first).zip(x.store()) {
                    *out = x;
                }
            }
        }
        let rest = [axis[0], axis[1], axis[2], sine, cosine];
        for (out, x) in guide.columns.iter_mut().skip(Column::AxisX as usize).zip(rest) {
            *out = x;
        }
        guide
    }

    /// Adds positions of the parts from `first` on to the means of their quadrants.
    fn add_means(&mut self, column: Column, first: usize, positions: &[f32]) {
        for (part, x) in (first..).zip(positions) {
            let (i, j) = (part % PARTS, part / PARTS);
            let quadrant = 2 * usize::from(j >= PARTS / 2) + usize::from(i >= PARTS / 2);
            if let Some(mean) = self.columns.get_mut(column as usize + quadrant) {
                *mean += x / PARTS as f32;
            }
        }
    }
}

/// Where the middles of parts from `first` on are, as many as there are lanes.
#[inline(never)]
fn middles(area: &Area<'_>, borders: &Borders, first: usize) -> Sampled {
    let (mut across, mut down) = (Four::floats(), Four::floats());
    for (part, (w, v)) in (first..).zip(across.iter_mut().zip(&mut down)) {
        [*w, *v] = parts::middle(borders, part);
    }
    area.sample([Four::load(across), Four::load(down)])
}

/// A cone that contains a cell: the axis, sine and cosine of the half-angle.
///
/// No point is farther from the nearest point of a lattice than the largest diagonal of the lattice's cells.
// Apart, so that its stack is free again.
#[inline(never)]
fn cone(area: &Area<'_>) -> ([f32; 3], [f32; 2]) {
    let [axis, ..] = transposed(area.direction([Four::splat(0.5); 2]));
    let mut lattice = [Vec3::ZERO; (LATTICE * LATTICE).next_multiple_of(GROUP)];
    for (group, out) in lattice.chunks_exact_mut(Four::WIDTH).enumerate() {
        let at =
            |of: fn(usize) -> usize| Four::each(|lane| of(group * Four::WIDTH + lane) as f32 / (LATTICE - 1) as f32);
        let directions = area.direction([at(|k| k % LATTICE), at(|k| (k / LATTICE).min(LATTICE - 1))]);
        out.iter_mut().zip(transposed(directions)).for_each(|(out, direction)| *out = direction);
    }
    let at = |i: usize, j: usize| lattice.get(j * LATTICE + i).copied().unwrap_or(axis);
    let (mut farthest, mut diagonal) = (0.0f32, 0.0f32);
    for (i, j) in (0..LATTICE * LATTICE).map(|k| (k % LATTICE, k / LATTICE)) {
        farthest = farthest.max(axis.distance_squared(at(i, j)));
        if i + 1 < LATTICE && j + 1 < LATTICE {
            diagonal = diagonal.max(at(i, j).distance_squared(at(i + 1, j + 1)));
            diagonal = diagonal.max(at(i + 1, j).distance_squared(at(i, j + 1)));
        }
    }
    let reach = sqrt(farthest) + sqrt(diagonal);
    if reach * reach >= 2.0 {
        return (axis.to_array(), [1.0, 0.0]);
    }
    (axis.to_array(), [reach * sqrt(1.0 - 0.25 * reach * reach), 1.0 - 0.5 * reach * reach])
}

/// Lanes of x, y and z as a direction for each lane.
fn transposed(columns: [Four; 3]) -> [Vec3; Four::WIDTH] {
    let [x, y, z] = columns.map(Num::store);
    core::array::from_fn(|lane| Vec3::new(x[lane], y[lane], z[lane]))
}

/// Writes the directions of the corners of all cells.
pub fn write_corners(light: &Light<'_>, out: &mut [Short]) {
    let faces = light.chart.faces();
    let count = corner_count(light.grid, faces);
    let columns = light.grid[0] as usize;
    let rows = (light.grid[1] / faces.max(1)) as usize;
    let mut put = |corner: usize, direction: [f32; 3]| {
        for (k, x) in direction.into_iter().enumerate() {
            if let Some(out) = out.get_mut(corner + k * count) {
                *out = short(x);
            }
        }
    };
    let mut corner = 0;
    for face in 0..faces {
        for at in (0..=rows).flat_map(|j| (0..=columns).map(move |i| [i, j])) {
            put(corner, corner_direction(light, face, at, [columns, rows]));
            corner += 1;
        }
    }
    // What fills up the lanes is a direction, too.
    (corner..count).for_each(|corner| put(corner, [1.0, 0.0, 0.0]));
}

/// The direction of corner (i, j) of a face: where a cell begins, or the last one ends.
fn corner_direction(light: &Light<'_>, face: u32, at: [usize; 2], [columns, rows]: [usize; 2]) -> [f32; 3] {
    let [i, j] = [at[0].min(columns.saturating_sub(1)), at[1].min(rows.saturating_sub(1))];
    let cell = light.cells.get((face as usize * rows + j) * columns + i).copied().unwrap_or_default();
    let edge = |k: usize, last: bool| {
        let patch = cell.origin[k] + if last { cell.patches[k] } else { 0 };
        light.chart.axes[k].edge(f32::from(patch))
    };
    parts::direction_of(&light.chart, face as f32, [edge(0, at[0] == columns), edge(1, at[1] == rows)])
}

/// The corners among the numbers of a guide.
pub fn corners_mut(grid: [u32; 2], faces: u32, numbers: &mut [Short]) -> &mut [Short] {
    let [.., first, end] = ends(grid, faces);
    numbers.get_mut(first..end).unwrap_or_default()
}

/// Writes what was measured of a cell into the numbers of a guide.
pub fn write_cell(grid: [u32; 2], faces: u32, cell: u32, guide: &CellGuide, numbers: &mut [Short]) {
    let cell = cell as usize;
    let [first_mass, first, ..] = ends(grid, faces);
    let CellGuide { mass, columns, middles, borders } = guide;
    let group = first + cell / GROUP * COLUMNS * GROUP;
    for (k, &x) in columns.iter().enumerate() {
        if let Some(out) = numbers.get_mut(group + k * GROUP + cell % GROUP) {
            *out = short(x);
        }
    }
    let (parts, rest) = numbers.split_at_mut_checked(first_mass).unwrap_or_default();
    let masses = rest.get_mut(..first - first_mass).and_then(|masses| bytemuck::try_cast_slice_mut(masses).ok());
    if let Some(out) = masses.and_then(|masses: &mut [f32]| masses.get_mut(cell)) {
        *out = *mass;
    }
    let filled = middles.as_flattened().iter().map(|&x| short(x)).chain(*borders).chain(core::iter::repeat(0));
    for (out, x) in parts.iter_mut().skip(OF_PARTS * cell).take(OF_PARTS).zip(filled) {
        *out = x;
    }
}
