//! The walks through the tables of many lanes side by side, and what the lanes become of it.
//!
//! A walk computes lane by lane and goes through memory between its stages, with prefetches ahead, so that the cache misses of all
//! lanes overlap. Lanes are loaded once, at its end, since a vector load has to wait for all smaller stores into it.

use super::chart::Place;
use super::search::{Found, UNITS, cell, cell16, find, find16, inside};
use super::tables::{Block, Cell, Light, decoded};
use super::warp::PatchDensity;
use crate::blob::Table;
use crate::numeric::ONE_MINUS_EPSILON;
use crate::simd::{GROUP, Num, prefetch};

/// A direction in map space.
pub type Direction<F> = [F; 3];

/// Patches, one for each lane.
#[derive(Clone, Copy)]
pub struct Patches<F: Num> {
    /// The cell of each.
    pub cell: F::Ints,
    /// The share of the light that the cell has.
    pub light: F,
    face: F,
    /// The smallest patch on the face and one behind the largest, columns and rows.
    first: [F; 2],
    behind: [F; 2],
    /// Column and row on the face at which it begins.
    pub low: [F; 2],
    /// Columns and rows.
    pub size: [F; 2],
    /// The density inside.
    pub shape: PatchDensity<F>,
    /// The share of the cell's light that the patch has.
    pub probability: F,
    start: [F; 2],
    width: [F; 2],
}

/// A direction that was found in the tables: its patch, and where in it.
#[derive(Clone, Copy)]
pub struct Located<F: Num> {
    /// The patch.
    pub patch: Patches<F>,
    /// The position inside, [0, 1] along columns and rows.
    pub position: [F; 2],
    /// The density of the direction within its cell, per steradian.
    pub density: F,
}

/// Places that were drawn: the patches, and the positions inside.
#[derive(Clone, Copy)]
pub struct Drawn<F: Num> {
    /// The patches.
    pub patch: Patches<F>,
    /// Column and row inside, in [0, 1].
    pub position: [F; 2],
}

impl<F: Num> Drawn<F> {
    /// Column and row on the face.
    #[inline(always)]
    pub fn place(&self) -> [F; 2] {
        self.patch.place(self.position)
    }
}

impl<F: Num> Patches<F> {
    /// The direction of a position in the patch.
    #[inline(always)]
    pub(super) fn direction(&self, light: &Light<'_>, position: [F; 2]) -> Direction<F> {
        light.chart.direction(self.face, self.place(position))
    }

    /// Column and row on the face of a position in the patch.
    #[inline(always)]
    fn place(&self, position: [F; 2]) -> [F; 2] {
        [self.low[0] + position[0] * self.size[0], self.low[1] + position[1] * self.size[1]]
    }
}

impl<F: Num> Located<F> {
    /// The numbers of the direction in its cell: along columns and along rows, each in [0, 1 - 2^-24].
    #[inline(never)]
    pub fn numbers(&self) -> [F; 2] {
        let Located { patch, position, .. } = self;
        let u = patch.shape.invert(*position);
        let (first, last) = (F::splat(0.0), F::splat(ONE_MINUS_EPSILON));
        [0, 1].map(|k: usize| (patch.start[k] + u[k] * patch.width[k]).max(first).min(last))
    }
}

impl Located<f32> {
    /// The numbers of the middle of the patch, in its cell.
    pub(crate) fn middle(&self) -> [f32; 2] {
        let Patches { start, width, .. } = self.patch;
        [start[0] + 0.5 * width[0], start[1] + 0.5 * width[1]]
    }

    /// Whether a place was drawn in the patch.
    pub(crate) fn is_in_patch_of(&self, drawn: &Drawn<f32>) -> bool {
        let (a, b) = (&self.patch, &drawn.patch);
        a.cell == b.cell && a.first == b.first
    }
}

#[inline(always)]
pub(super) fn put<T: Copy>(out: &mut [T], first: usize, lanes: &[T]) {
    for (out, &x) in out.iter_mut().skip(first).zip(lanes) {
        *out = x;
    }
}

/// Replaces the number of one lane.
#[inline(always)]
pub(crate) fn set<F: Num>(f: &mut F, lane: usize, x: f32) {
    let mut lanes = f.store();
    if let Some(out) = lanes.as_mut().get_mut(lane) {
        *out = x;
    }
    *f = F::load(lanes);
}

/// Numbers moved into [0, 1 - 2^-24]; NaN counts as 1/2.
#[inline(always)]
pub fn clamp_u<F: Num>(u: F) -> F {
    // Only a NaN is neither below nor above 1/2.
    let number = F::or(u.le(F::splat(0.5)), F::splat(0.5).le(u));
    F::select(number, u.max(F::splat(0.0)).min(F::splat(ONE_MINUS_EPSILON)), F::splat(0.5))
}

/// Lanes that walk together in a batch; found by timing batches of 64 from cold caches.
pub(super) const TOGETHER: usize = 32;

/// A number for each lane of a walk.
pub(super) type Floats<const N: usize> = [f32; N];
/// A whole number for each lane of a walk.
pub(super) type Ints<const N: usize> = [u32; N];

/// A walk of up to `N` lanes. Pairs are columns and rows.
pub(super) struct Walk<'a, const N: usize> {
    pub(super) cell: Ints<N>,
    face: Ints<N>,
    cells: [&'a Cell; N],
    blocks: [&'a Block; N],
    /// Starts and ends of the part in the block, in units.
    inner: [[Ints<N>; 2]; 2],
    /// The first patch of the part on the face; before the last stage, which block of the cell.
    from: [Ints<N>; 2],
    /// One patch behind the part; before the last stage, which part of the block.
    behind: [Ints<N>; 2],
    /// Pairs of corner words: of the upper and of the lower row.
    corner: [Ints<N>; 2],
}

/// What a walk also notes of cells, if it is asked to: products need it.
pub(super) struct OfCells<const N: usize> {
    /// Starts and ends of blocks in their cells.
    outer: [[Floats<N>; 2]; 2],
}

// What lanes begin with is never read. Not zeros: the compiler leaves those to a function of the C library, whose code is in
// far memory.
pub(super) const WHOLE: u32 = 1;
pub(super) const NUMBER: f32 = 0.5;

impl<const N: usize> OfCells<N> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        OfCells { outer: [[[NUMBER; N]; 2]; 2] }
    }

    #[inline(always)]
    fn put(&mut self, axis: usize, lane: usize, [start, end]: [f32; 2]) {
        self.outer[axis][0][lane] = start;
        self.outer[axis][1][lane] = end;
    }

    /// Start and width of blocks in their cells.
    #[inline(always)]
    fn range<F: Num>(&self, axis: usize, first: usize) -> (F, F) {
        let [start, end] = &self.outer[axis];
        let start = floats::<F, N>(start, first);
        (start, floats::<F, N>(end, first) - start)
    }
}

impl<'a, const N: usize> Walk<'a, N> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Walk {
            cell: [WHOLE; N],
            face: [WHOLE; N],
            cells: [NO_CELL; N],
            blocks: [NO_BLOCK; N],
            inner: [[[WHOLE; N]; 2]; 2],
            from: [[WHOLE; N]; 2],
            behind: [[WHOLE; N]; 2],
            corner: [[WHOLE; N]; 2],
        }
    }

    /// Begins in the cells that `u` (column, row) of each lane falls into, with the numbers in those cells.
    #[inline(always)]
    pub(super) fn begin(&mut self, light: &Light<'a>, u: &[[f32; 2]], numbers: &mut [Floats<N>; 2], count: usize) {
        let [across, down] = numbers;
        // By number: so the compiler sees that every lane is one.
        #[allow(clippy::needless_range_loop)]
        for lane in 0..count.min(N) {
            let u = u.get(lane).copied().unwrap_or([NUMBER; 2]);
            let (cell, [w, v]) = light.cell_at(&light.tops, u.map(clamp_u));
            prefetch(light.cells, cell);
            self.cell[lane] = cell as u32;
            across[lane] = w;
            down[lane] = v;
        }
    }

    /// Walks down to the patches that the numbers of each lane in its cell lead to, which become the numbers in blocks, in units.
    // A function of its own: it is the same at all levels, and code that is read from far memory costs as much as tables.
    #[inline(never)]
    pub(super) fn down(
        &mut self,
        light: &Light<'a>,
        numbers: &mut [Floats<N>; 2],
        mut of_cells: Option<&mut OfCells<N>>,
        count: usize,
    ) {
        self.ask_for_starts(light, count);
        self.find_block_rows(light, numbers, of_cells.as_deref_mut(), count);
        self.find_blocks(light, numbers, of_cells, count);
        self.find_rows(light, numbers, count);
        self.find_patches(light, numbers, count);
    }

    // The stages of a walk down. Each reads what the one before asked for.

    #[inline(always)]
    fn ask_for_starts(&mut self, light: &Light<'a>, count: usize) {
        for (&cell, out) in self.cell.iter().zip(&mut self.cells).take(count) {
            *out = light.cell(cell);
            if N > 1 {
                light.starts.prefetch(out.starts as usize);
            }
        }
    }

    // By number, here and below: so the compiler sees that every lane is one.
    #[inline(always)]
    #[allow(clippy::needless_range_loop)]
    fn find_block_rows(
        &mut self,
        light: &Light<'a>,
        numbers: &mut [Floats<N>; 2],
        mut of_cells: Option<&mut OfCells<N>>,
        count: usize,
    ) {
        for lane in 0..count.min(N) {
            let c = self.cells[lane];
            let v = numbers[1][lane];
            let (row, range) = find(&light.starts, c.starts as usize, c.blocks[1].into(), v);
            if N > 1 {
                light.starts.prefetch(c.row(row));
            }
            prefetch(light.blocks, c.first as usize + row * usize::from(c.blocks[0]));
            self.from[1][lane] = row as u32;
            numbers[1][lane] = UNITS * rest(v, range);
            if let Some(of_cells) = &mut of_cells {
                of_cells.put(1, lane, range);
            }
        }
    }

    #[inline(always)]
    #[allow(clippy::needless_range_loop)]
    fn find_blocks(
        &mut self,
        light: &Light<'a>,
        numbers: &mut [Floats<N>; 2],
        mut of_cells: Option<&mut OfCells<N>>,
        count: usize,
    ) {
        for lane in 0..count.min(N) {
            let c = self.cells[lane];
            let (w, row) = (numbers[0][lane], self.from[1][lane] as usize);
            let (column, range) = find(&light.starts, c.row(row), c.blocks[0].into(), w);
            let block = c.first as usize + row * usize::from(c.blocks[0]) + column;
            self.blocks[lane] = light.block(block as u32);
            self.from[0][lane] = column as u32;
            numbers[0][lane] = UNITS * rest(w, range);
            if let Some(of_cells) = &mut of_cells {
                of_cells.put(0, lane, range);
            }
        }
    }

    #[inline(always)]
    #[allow(clippy::needless_range_loop)]
    fn find_rows(&mut self, light: &Light<'a>, numbers: &[Floats<N>; 2], count: usize) {
        // One lane alone reads them at once.
        if N > 1 {
            self.blocks.iter().take(count).for_each(|block| light.words.prefetch(block.rows as usize));
        }
        for lane in 0..count.min(N) {
            let block = self.blocks[lane];
            let key = numbers[1][lane] as i32 as u32;
            let found = find16(&light.words, block.rows as usize, block.grid[1].into(), key, block.words_at_ends());
            light.prefetch_lines(block, found.0);
            self.put_inner(1, lane, found);
        }
    }

    #[inline(always)]
    #[allow(clippy::needless_range_loop)]
    fn find_patches(&mut self, light: &Light<'a>, numbers: &[Floats<N>; 2], count: usize) {
        for lane in 0..count.min(N) {
            let block = self.blocks[lane];
            let line = block.line(self.behind[1][lane] as usize, light.bilinear);
            let key = numbers[0][lane] as i32 as u32;
            let starts = line + block.corners(light.bilinear);
            let found = find16(&light.words, starts, block.grid[0].into(), key, block.words_at_ends());
            self.put_inner(0, lane, found);
            self.put_patch(light, lane, block, line);
        }
    }

    /// Columns and rows of faces for the lanes from `first` on.
    #[inline(always)]
    pub(super) fn put_places<F: Num>(&mut self, first: usize, face: F::Ints, [column, row]: [F::Ints; 2]) {
        put(&mut self.face, first, face.as_ref());
        put(&mut self.behind[0], first, column.as_ref());
        put(&mut self.behind[1], first, row.as_ref());
    }

    /// Finds the patches at columns and rows of faces, which stand in `behind`.
    #[inline(never)]
    pub(super) fn at(&mut self, light: &Light<'a>, mut of_cells: Option<&mut OfCells<N>>, count: usize) {
        let count = count.min(N);
        let face_rows = light.grid[1] / light.chart.faces();
        for lane in 0..count {
            let patch = [self.behind[0][lane], self.behind[1][lane]];
            self.cell[lane] = light.find_cell(self.face[lane], face_rows, patch);
        }
        for lane in 0..count {
            let cell = light.cell(self.cell[lane]);
            let found = light.find_block(cell, [self.behind[0][lane], self.behind[1][lane]]);
            self.cells[lane] = cell;
            for k in 0..2 {
                self.from[k][lane] = found.at[k];
                // Patches, for now.
                self.behind[k][lane] = found.patch[k];
            }
            // Its number, for now.
            self.inner[0][0][lane] = found.number;
        }
        for lane in 0..count {
            let block = light.block(self.inner[0][0][lane]);
            self.blocks[lane] = block;
            let row = self.behind[1][lane] >> block.step(1);
            if N > 1 {
                light.words.prefetch(block.rows as usize);
                light.prefetch_lines(block, row as usize);
            }
            self.behind[0][lane] >>= block.step(0);
            self.behind[1][lane] = row;
        }
        for lane in 0..count {
            let block = self.blocks[lane];
            let (x, y) = (self.behind[0][lane] as usize, self.behind[1][lane] as usize);
            let [columns, rows] = block.grid.map(usize::from);
            let line = block.line(y, light.bilinear);
            let starts = line + block.corners(light.bilinear);
            if let Some(of_cells) = &mut of_cells {
                let c = self.cells[lane];
                let (i, j) = (self.from[0][lane] as usize, self.from[1][lane] as usize);
                of_cells.put(1, lane, cell(&light.starts, c.starts as usize, j));
                of_cells.put(0, lane, cell(&light.starts, c.row(j), i));
            }
            self.put_inner(1, lane, (y, cell16(&light.words, block.rows as usize, rows, y, block.words_at_ends())));
            self.put_inner(0, lane, (x, cell16(&light.words, starts, columns, x, block.words_at_ends())));
            self.put_patch(light, lane, block, line);
        }
    }

    #[inline(always)]
    fn put_inner(&mut self, axis: usize, lane: usize, (index, [start, end]): Found<u32>) {
        self.behind[axis][lane] = index as u32;
        self.inner[axis][0][lane] = start;
        self.inner[axis][1][lane] = end;
    }

    /// The last stage: the part of a block that was found becomes a patch on the face.
    #[inline(always)]
    fn put_patch(&mut self, light: &Light<'_>, lane: usize, block: &Block, line: usize) {
        let c = self.cells[lane];
        self.face[lane] = c.face.into();
        if light.bilinear {
            let first = line + self.behind[0][lane] as usize;
            self.corner[0][lane] = light.pair(first);
            self.corner[1][lane] = light.pair(first + 2 * usize::from(block.grid[0]));
        }
        for k in 0..2 {
            let at = [self.from[k][lane], self.behind[k][lane]];
            let (from, behind) = if light.exact {
                let from = u32::from(c.origin[k]) + (at[0] << (light.side[k] & 31)) + at[1];
                (from, from + 1)
            } else {
                c.extent(k, at[0], at[1], block.step(k))
            };
            self.from[k][lane] = from;
            self.behind[k][lane] = behind;
        }
    }

    /// The patches of the lanes from `first` on. `of_cells`: what was noted, else it is left out of the patches.
    #[inline(always)]
    pub(super) fn patches<F: Num>(&self, light: &Light<'_>, of_cells: Option<&OfCells<N>>, first: usize) -> Patches<F> {
        let none = F::splat(0.0);
        let outer = match of_cells {
            None => [(none, none); 2],
            Some(of) => [of.range::<F>(0, first), of.range::<F>(1, first)],
        };
        let inner = [self.inner_range::<F>(0, first), self.inner_range::<F>(1, first)];
        let whole = |of: &Ints<N>| F::of_ints(ints::<F, N>(of, first));
        let [from, behind] =
            [[whole(&self.from[0]), whole(&self.from[1])], [whole(&self.behind[0]), whole(&self.behind[1])]];
        let [columns, rows] = light.chart.axes;
        let low = [columns.edge(from[0]), rows.edge(from[1])];
        let unit = F::splat(1.0 / UNITS);
        let (column_width, row_width) = (inner[0].1 * unit, inner[1].1 * unit);
        let one = F::splat(1.0);
        let mut corner = [one, one, one, one];
        if light.bilinear {
            let ([a, b], [c, d]) = (
                decoded::<F>(ints::<F, N>(&self.corner[0], first)),
                decoded::<F>(ints::<F, N>(&self.corner[1], first)),
            );
            corner = [a, b, c, d];
        }
        let size = [columns.edge(behind[0]) - low[0], rows.edge(behind[1]) - low[1]];
        Patches {
            cell: ints::<F, N>(&self.cell, first),
            light: self.each(first, |cell, _| cell.probability),
            face: whole(&self.face),
            first: from,
            behind,
            low,
            size,
            shape: PatchDensity::new(corner, light.chart.profiles(low, size)),
            probability: self.each::<F>(first, |_, block| block.share) * row_width * column_width,
            start: [outer[0].0 + outer[0].1 * (inner[0].0 * unit), outer[1].0 + outer[1].1 * (inner[1].0 * unit)],
            width: [outer[0].1 * column_width, outer[1].1 * row_width],
        }
    }

    /// Numbers of the cells and blocks of the lanes from `first` on.
    #[inline(always)]
    fn each<F: Num>(&self, first: usize, of: impl Fn(&Cell, &Block) -> f32) -> F {
        let lanes = (self.cells.get(first..).unwrap_or(&[]), self.blocks.get(first..).unwrap_or(&[]));
        F::each(|lane| of(lanes.0.get(lane).unwrap_or(&NO_CELL), lanes.1.get(lane).unwrap_or(&NO_BLOCK)))
    }

    /// Start and width of parts in their blocks, in units.
    #[inline(always)]
    fn inner_range<F: Num>(&self, axis: usize, first: usize) -> (F, F) {
        let [start, end] = &self.inner[axis];
        let start = F::of_ints(ints::<F, N>(start, first));
        (start, F::of_ints(ints::<F, N>(end, first)) - start)
    }

    /// The positions of the numbers in their parts.
    #[inline(always)]
    fn in_part<F: Num>(&self, numbers: &[Floats<N>; 2], axis: usize, first: usize) -> F {
        let (start, width) = self.inner_range::<F>(axis, first);
        inside(floats::<F, N>(&numbers[axis], first), start, width)
    }

    /// The places that the walk down led the lanes from `first` on to.
    #[inline(always)]
    pub(super) fn drawn<F: Num>(
        &self,
        light: &Light<'_>,
        numbers: &[Floats<N>; 2],
        of_cells: Option<&OfCells<N>>,
        first: usize,
    ) -> Drawn<F> {
        let patch = self.patches::<F>(light, of_cells, first);
        let inside = [self.in_part::<F>(numbers, 0, first), self.in_part::<F>(numbers, 1, first)];
        let mut position = patch.shape.sample(inside);
        if !light.bilinear {
            // Away from the borders, where a client's rounding might find the neighbour.
            position = [0, 1].map(|k: usize| {
                let least = F::splat(1.25 * light.chart.margin(k)) / patch.size[k];
                position[k].max(least).min(F::splat(1.0) - least)
            });
        }
        Drawn { patch, position }
    }
}

/// The position between two ends of the number that was searched.
#[inline(always)]
fn rest(number: f32, [start, end]: [f32; 2]) -> f32 {
    inside(number, start, end - start)
}

/// The lanes of a walk from `first` on.
#[inline(always)]
pub(super) fn floats<F: Num, const N: usize>(of: &Floats<N>, first: usize) -> F {
    F::read(of.get(first..).unwrap_or(&[]))
}

#[inline(always)]
pub(super) fn ints<F: Num, const N: usize>(of: &Ints<N>, first: usize) -> F::Ints {
    F::read_ints(of.get(first..).unwrap_or(&[]))
}

#[inline(always)]
pub(super) fn byte(bytes: &[u8], index: usize) -> u8 {
    bytes.get(index).copied().unwrap_or(0)
}

/// A block that was found in a cell.
pub(super) struct FoundBlock {
    /// Its number.
    pub number: u32,
    /// Its column and row in the cell.
    pub at: [u32; 2],
    /// The column and row of the patch in the block.
    pub patch: [u32; 2],
}

/// How far rounding may carry a direction, of a client or of its own, in radians.
const ROUNDING: f32 = 1.0 / (1 << 20) as f32;

/// What is read of a cell that does not exist.
const NO_CELL: &Cell = &Cell {
    origin: [0; 2],
    patches: [0; 2],
    blocks: [0; 2],
    side: [0; 2],
    face: 0,
    reserved: 0,
    starts: 0,
    first: 0,
    probability: 0.0,
};
/// What is read of a block that does not exist.
const NO_BLOCK: &Block = &Block { rows: 0, brightest: 0.0, share: 0.0, grid: [0; 2], steps: 0, to_ends: 0 };

impl<'a> Light<'a> {
    /// The cell that `u` (column, row) falls into in tables of cells, and the position in it.
    #[inline(always)]
    pub fn cell_at(&self, tops: &Table<'_, f32>, [w, v]: [f32; 2]) -> (usize, [f32; 2]) {
        let [columns, rows] = [self.grid[0] as usize, self.grid[1] as usize];
        let (row, rows) = find(tops, 0, rows, v);
        let (column, columns_range) = find(tops, self.top_row(row), columns, w);
        (row * columns + column, [rest(w, columns_range), rest(v, rows)])
    }

    /// The inverse of [`Light::cell_at`]: start and width of a cell along columns and rows.
    #[inline(always)]
    pub fn cell_range(&self, cell_index: usize) -> [(f32, f32); 2] {
        let (row, column) = (cell_index / (self.grid[0] as usize).max(1), cell_index % (self.grid[0] as usize).max(1));
        let [left, right] = cell(&self.tops, self.top_row(row), column);
        let [top, bottom] = cell(&self.tops, 0, row);
        [(left, right - left), (top, bottom - top)]
    }

    /// The places for numbers (column, row) in [0, 1 - 2^-24]^2 of cells.
    #[inline(always)]
    pub fn sample_in<F: Num>(&self, cells: F::Ints, numbers: [F; 2]) -> Drawn<F> {
        let numbers = numbers.map(F::store);
        match F::WIDTH {
            1 => self.draw_one(cells, numbers),
            4 => self.draw::<F, 4>(cells, numbers),
            _ => self.draw::<F, GROUP>(cells, numbers),
        }
    }

    /// One by one a result is short, and many need it.
    #[inline(never)]
    fn draw_one<F: Num>(&self, cells: F::Ints, numbers: [F::Floats; 2]) -> Drawn<F> {
        self.draw::<F, 1>(cells, numbers)
    }

    #[inline(always)]
    fn draw<F: Num, const N: usize>(&self, cells: F::Ints, of_lanes: [F::Floats; 2]) -> Drawn<F> {
        let mut walk = Walk::<N>::new();
        put(&mut walk.cell, 0, cells.as_ref());
        let (mut numbers, mut of_cells) = ([[NUMBER; N]; 2], OfCells::<N>::new());
        for (out, numbers) in numbers.iter_mut().zip(&of_lanes) {
            put(out, 0, numbers.as_ref());
        }
        walk.down(self, &mut numbers, Some(&mut of_cells), F::WIDTH);
        walk.drawn::<F>(self, &numbers, Some(&of_cells), 0)
    }

    /// Where directions of unit length are, their densities within their cells, and, if `numbers`, what
    /// [`Located::numbers`] needs.
    #[inline(always)]
    pub fn locate<F: Num>(&self, direction: Direction<F>, numbers: bool) -> Located<F> {
        self.locate_apart(direction, numbers, true)
    }

    #[inline(never)]
    fn locate_apart<F: Num>(&self, direction: Direction<F>, numbers: bool, settles: bool) -> Located<F> {
        self.locate_here(direction, numbers, settles)
    }

    /// As [`Light::locate`], inside a larger function. `settles`: whether a place without light moves over a border to one with light.
    #[inline(always)]
    pub(super) fn locate_here<F: Num>(&self, direction: Direction<F>, numbers: bool, settles: bool) -> Located<F> {
        let (located, place) = match F::WIDTH {
            1 => self.find::<F, 1>(direction, numbers),
            4 => self.find::<F, 4>(direction, numbers),
            _ => self.find::<F, GROUP>(direction, numbers),
        };
        let dark = self.dark_at_border(&located, &place);
        if !settles || F::bits(dark) == 0 { located } else { self.beside(direction, numbers, dark) }
    }

    #[inline(always)]
    fn find<F: Num, const N: usize>(&self, direction: Direction<F>, numbers: bool) -> (Located<F>, Place<F>) {
        let place = self.chart.place(direction);
        let [columns, rows] = self.chart.axes;
        let mut walk = Walk::<N>::new();
        let [column, row] = [columns.patch(place.position[0]), rows.patch(place.position[1])];
        walk.put_places::<F>(0, place.face.truncate(), [column, row]);
        let mut of_cells = OfCells::<N>::new();
        walk.at(self, if numbers { Some(&mut of_cells) } else { None }, F::WIDTH);
        let of_cells = if numbers { Some(&of_cells) } else { None };
        (within(&walk.patches::<F>(self, of_cells, 0), &place), place)
    }

    /// Moves the directions of dark lanes over the border, where light is beside.
    #[cold]
    #[inline(never)]
    fn beside<F: Num>(&self, mut direction: Direction<F>, numbers: bool, dark: F::Mask) -> Located<F> {
        let mut lanes = F::bits(dark);
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            let of_lane = direction.map(|axis| axis.store().as_ref().get(lane).copied().unwrap_or(0.0));
            for (axis, x) in direction.iter_mut().zip(self.lit_beside(of_lane)) {
                set(axis, lane, x);
            }
        }
        self.locate_apart(direction, numbers, false)
    }

    /// The lanes without light from which rounding may lead a client over a border of their patches.
    #[inline(always)]
    pub(super) fn dark_at_border<F: Num>(&self, located: &Located<F>, place: &Place<F>) -> F::Mask {
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let [across, down] = [0, 1].map(|k: usize| {
            let position = located.position[k];
            position.min(one - position) * located.patch.size[k]
        });
        // Texels are at least as narrow as this is, for their solid angle.
        let [columns, rows] = self.chart.axes;
        let widest = 2.0 * core::f32::consts::PI / columns.length.min(rows.length);
        let angle = across.min(down) * place.solid_angle * F::splat(1.0 / widest);
        F::and(self.alone(located).le(zero), angle.lt(F::splat(ROUNDING)))
    }

    /// The brightest of the directions that rounding makes of one, if any is lit. About a pole it moves azimuths, too.
    fn lit_beside(&self, direction: Direction<f32>) -> Direction<f32> {
        /// A pole has any azimuth: that of directions so close to it.
        const POLE: f32 = 1e-30;
        let [x, y, z] = direction;
        let turn = ROUNDING * x.abs().max(y.abs()).max(POLE);
        let sign = |of: u32, bit: u32| if (of >> bit) & 1 == 0 { 1.0 } else { -1.0 };
        let corner = |k: u32| [0, 1, 2].map(|axis: usize| direction[axis] + ROUNDING * sign(k, axis as u32));
        let turned = [[x + turn, y, z], [x - turn, y, z], [x, y + turn, z], [x, y - turn, z]];
        let (mut brightest, mut found) = (0.0, direction);
        for moved in (0..8).map(corner).chain(turned) {
            let located = self.locate_apart::<f32>(moved, false, false);
            let density = self.alone(&located);
            if density > brightest {
                (brightest, found) = (density, moved);
            }
        }
        found
    }

    /// The direction of a drawn place.
    #[inline(always)]
    pub fn direction_of<F: Num>(&self, drawn: &Drawn<F>) -> Direction<F> {
        drawn.patch.direction(self, drawn.position)
    }

    /// Drawn places with their densities: what [`Light::locate`] would find, but for rounding at the borders of patches.
    #[inline(always)]
    pub fn drawn_at<F: Num>(&self, place: &Place<F>, drawn: &Drawn<F>) -> Located<F> {
        located(&drawn.patch, drawn.position, place)
    }

    /// As [`Light::locate`] for directions that were drawn from known patches: in those that still hold them, and a mask of the
    /// lanes in which rounding left the patch. In a light for nearest clients, also of those in which it came so close to the
    /// border that the client's own rounding might find the neighbour.
    #[inline(always)]
    pub fn relocate<F: Num>(&self, d: Direction<F>, drawn: &Drawn<F>) -> (Located<F>, F::Mask) {
        let place = self.chart.place(d);
        let patch = &drawn.patch;
        let column = F::of_ints(self.chart.axes[0].patch(place.position[0]));
        let row = F::of_ints(self.chart.axes[1].patch(place.position[1]));
        let columns_out = F::or(column.lt(patch.first[0]), patch.behind[0].le(column));
        let rows_out = F::or(row.lt(patch.first[1]), patch.behind[1].le(row));
        let other_face = F::or(place.face.lt(patch.face), patch.face.lt(place.face));
        let mut out = F::or(F::or(columns_out, rows_out), other_face);
        if !self.bilinear {
            for (k, &position) in place.position.iter().enumerate() {
                let (from, margin) = (position - patch.low[k], F::splat(self.chart.margin(k)));
                out = F::or(out, F::or(from.lt(margin), (patch.size[k] - margin).lt(from)));
            }
        }
        let located = within(patch, &place);
        // What has no density where it was drawn may have one where it is found.
        (located, F::or(out, self.alone(&located).le(F::splat(0.0))))
    }

    /// Hands out the patches that begin in a row of a face, from left to right. Of coarse ones, all rows together hand out each once.
    pub fn each_patch(&self, face: u32, row: u32, mut each: impl FnMut(&Patches<f32>)) {
        let columns = self.chart.axes[0].patches;
        for first in (0..columns).step_by(GROUP) {
            let mut walk = Walk::<GROUP>::new();
            let lanes = first..columns.min(first + GROUP as u32);
            walk.face = [face; GROUP];
            walk.behind[1] = [row; GROUP];
            walk.behind[0].iter_mut().zip(lanes.clone()).for_each(|(out, column)| *out = column);
            walk.at(self, None, lanes.len());
            for (lane, column) in lanes.enumerate() {
                let patch = walk.patches::<f32>(self, None, lane);
                if patch.first == [column as f32, row as f32] {
                    each(&patch);
                }
            }
        }
    }

    /// The cell that holds a patch of a face of so many rows of cells.
    #[inline(always)]
    pub(super) fn find_cell(&self, face: u32, face_rows: u32, [x, y]: [u32; 2]) -> u32 {
        let column = u32::from(byte(self.cell_of[0], (x >> (self.side[0] & 31)) as usize));
        let row = u32::from(byte(self.cell_of[1], (y >> (self.side[1] & 31)) as usize));
        let index = (face * face_rows + row) * self.grid[0] + column;
        prefetch(self.cells, index as usize);
        index
    }

    /// The block of a cell that holds a patch.
    #[inline(always)]
    pub(super) fn find_block(&self, cell: &Cell, patch: [u32; 2]) -> FoundBlock {
        let (mut at, mut inside) = ([0; 2], [0; 2]);
        for k in 0..2 {
            let from_cell = patch[k].wrapping_sub(cell.origin[k].into());
            at[k] = from_cell >> (cell.side[k] & 31);
            inside[k] = from_cell & !(u32::MAX << (cell.side[k] & 31));
        }
        let number = cell.first + at[1] * u32::from(cell.blocks[0]) + at[0];
        prefetch(self.blocks, number as usize);
        FoundBlock { number, at, patch: inside }
    }

    #[inline(always)]
    pub(super) fn cell(&self, index: u32) -> &'a Cell {
        self.cells.get(index as usize).unwrap_or(NO_CELL)
    }

    #[inline(always)]
    pub(super) fn block(&self, index: u32) -> &'a Block {
        self.blocks.get(index as usize).unwrap_or(NO_BLOCK)
    }

    /// Two words that stand side by side, the first one low.
    #[inline(always)]
    pub(super) fn pair(&self, index: usize) -> u32 {
        let [low, high, ..] = *self.words.window(index);
        u32::from(low) | u32::from(high) << 16
    }

    /// Asks for the line of a row of patches, and for the corners below.
    #[inline(always)]
    pub(super) fn prefetch_lines(&self, block: &Block, row: usize) {
        let line = block.line(row, self.bilinear);
        self.words.prefetch(line);
        if self.bilinear {
            self.words.prefetch(line + 2 * usize::from(block.grid[0]));
        }
    }

    /// Where the table of the columns of a row of cells begins.
    #[inline(always)]
    fn top_row(&self, row: usize) -> usize {
        self.grid[1] as usize + 1 + row * (self.grid[0] as usize + 1)
    }
}

/// A place in the patch that holds it.
#[inline(always)]
pub(super) fn within<F: Num>(patch: &Patches<F>, place: &Place<F>) -> Located<F> {
    let (zero, one) = (F::splat(0.0), F::splat(1.0));
    // The quotients do not wait for the place.
    let (across, down) = (one / patch.size[0], one / patch.size[1]);
    let s = ((place.position[0] - patch.low[0]) * across).max(zero).min(one);
    let t = ((place.position[1] - patch.low[1]) * down).max(zero).min(one);
    located(patch, [s, t], place)
}

/// A position inside a patch, with its density.
#[inline(always)]
fn located<F: Num>(patch: &Patches<F>, position: [F; 2], place: &Place<F>) -> Located<F> {
    let shape = &patch.shape;
    let area = (patch.size[0] * patch.size[1]) * place.solid_angle;
    let scale = patch.probability / (shape.total() * area).max(F::splat(f32::MIN_POSITIVE));
    Located { patch: *patch, position, density: scale * shape.unscaled(position) }
}
