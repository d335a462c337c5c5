//! The walks through the tables of many lanes side by side, and what the lanes become of it.
//!
//! A walk computes lane by lane and goes through memory between its stages, with prefetches ahead, so that the cache misses of all
//! lanes overlap. Lanes are loaded once, at its end, since a vector load has to wait for all smaller stores into it.

use super::chart::Place;
use super::search::{UNITS, cell, cell16, find, find16, inside};
use super::tables::{Block, Cell, Light, decoded};
use super::warp::PatchDensity;
use crate::blob::Table;
use crate::numeric::ONE_MINUS_EPSILON;
use crate::simd::{Apart, GROUP, Num, prefetch, truncate};

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

/// A direction that was found in the tables: what is left of its patch goes through memory.
#[derive(Clone, Copy)]
pub struct Located<F: Num> {
    /// The cell.
    pub cell: F::Ints,
    /// The density of the direction in the light.
    pub(crate) alone: F,
    /// The numbers of the direction in its cell, along columns and along rows, each in [0, 1 - 2^-24]; 0 where nobody asked for them.
    pub(crate) numbers: [F; 2],
    /// The first patch on the face, and the numbers of its cell that lead to it.
    first: [F; 2],
    start: [F; 2],
    width: [F; 2],
}

/// The patch of a direction, the position inside, [0, 1] along columns and rows, and the density within the cell.
#[derive(Clone, Copy)]
pub(super) struct Within<F: Num> {
    patch: Patches<F>,
    position: [F; 2],
    density: F,
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
        let Drawn { patch: Patches { low, size, .. }, position } = self;
        [low[0] + position[0] * size[0], low[1] + position[1] * size[1]]
    }
}

impl<F: Num> Within<F> {
    /// The density in the light.
    #[inline(always)]
    fn alone(&self) -> F {
        self.patch.light * self.density
    }

    /// What is known of the direction; its numbers if asked for.
    #[inline(always)]
    pub(super) fn located(&self, numbered: bool) -> Located<F> {
        let Within { patch, position, .. } = self;
        let Patches { cell, first, start, width, .. } = *patch;
        let mut numbers = [F::splat(0.0); 2];
        if numbered {
            let u = patch.shape.invert(*position);
            let number = |k: usize| (start[k] + u[k] * width[k]).max(F::splat(0.0)).min(F::splat(ONE_MINUS_EPSILON));
            numbers = [number(0), number(1)];
        }
        Located { cell, alone: self.alone(), numbers, first, start, width }
    }
}

impl Located<f32> {
    /// The numbers of the middle of the patch, in its cell.
    pub(crate) fn middle(&self) -> [f32; 2] {
        [self.start[0] + 0.5 * self.width[0], self.start[1] + 0.5 * self.width[1]]
    }

    /// Whether another direction is in the same patch.
    pub(crate) fn is_in_patch_of(&self, other: &Located<f32>) -> bool {
        self.cell == other.cell && self.first == other.first
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

/// The numbers of one lane.
#[inline(always)]
pub(crate) fn lane_of<F: Num, const N: usize>(of: [F; N], lane: usize) -> [f32; N] {
    let mut out = [0.5; N];
    for (out, of) in out.iter_mut().zip(of) {
        *out = of.store().as_ref().get(lane).copied().unwrap_or(0.5);
    }
    out
}

/// Numbers moved into [0, 1 - 2^-24]; NaN counts as 1/2.
#[inline(always)]
pub fn clamp_u<F: Num>(u: F) -> F {
    // Only a NaN is neither below nor above 1/2.
    let number = F::or(u.le(F::splat(0.5)), F::splat(0.5).le(u));
    F::select(number, u.max(F::splat(0.0)).min(F::splat(ONE_MINUS_EPSILON)), F::splat(0.5))
}

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
    /// Shares of the light that cells have, and of those that blocks have.
    shares: [Floats<N>; 2],
    /// Starts and ends of blocks in their cells.
    outer: [[Floats<N>; 2]; 2],
    /// Starts and ends of the part in the block, in units.
    inner: [[Ints<N>; 2]; 2],
    /// The first patch of the part on the face; on the way down, which block of the cell.
    from: [Ints<N>; 2],
    /// One patch behind the part, if that may be more than one patch.
    behind: [Ints<N>; 2],
    /// Pairs of corner words: of the upper and of the lower row.
    corner: [Ints<N>; 2],
}

// What lanes begin with is never read. Not zeros: the compiler leaves those to a function of the C library, whose code is in
// far memory.
pub(super) const WHOLE: u32 = 1;
pub(super) const NUMBER: f32 = 0.5;

impl<'a, const N: usize> Walk<'a, N> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Walk {
            cell: [WHOLE; N],
            face: [WHOLE; N],
            cells: [NO_CELL; N],
            blocks: [NO_BLOCK; N],
            shares: [[NUMBER; N]; 2],
            outer: [[[NUMBER; N]; 2]; 2],
            inner: [[[WHOLE; N]; 2]; 2],
            from: [[WHOLE; N]; 2],
            behind: [[WHOLE; N]; 2],
            corner: [[WHOLE; N]; 2],
        }
    }

    /// Walks down to the patches that the numbers of each lane in its cell lead to, which become the numbers in blocks, in units.
    // A function of its own: it is the same at all levels, and code that is read from far memory costs as much as tables.
    #[inline(never)]
    fn down(&mut self, light: &Light<'a>, numbers: &mut [Floats<N>; 2], count: usize) {
        self.down_here(light, numbers, count);
    }

    /// As [`Walk::down`], inlined: of one lane nothing goes through memory.
    #[inline(always)]
    fn down_here(&mut self, light: &Light<'a>, numbers: &mut [Floats<N>; 2], count: usize) {
        self.ask_for_starts(light, count);
        self.find_block_rows(light, numbers, count);
        self.find_blocks(light, numbers, count);
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
    fn find_block_rows(&mut self, light: &Light<'a>, numbers: &mut [Floats<N>; 2], count: usize) {
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
            self.put_outer(1, lane, range);
        }
    }

    #[inline(always)]
    #[allow(clippy::needless_range_loop)]
    fn find_blocks(&mut self, light: &Light<'a>, numbers: &mut [Floats<N>; 2], count: usize) {
        for lane in 0..count.min(N) {
            let c = self.cells[lane];
            let (w, row) = (numbers[0][lane], self.from[1][lane] as usize);
            let (column, range) = find(&light.starts, c.row(row), c.blocks[0].into(), w);
            let block = c.first as usize + row * usize::from(c.blocks[0]) + column;
            self.blocks[lane] = light.block(block as u32);
            self.from[0][lane] = column as u32;
            numbers[0][lane] = UNITS * rest(w, range);
            self.put_outer(0, lane, range);
        }
    }

    #[inline(always)]
    #[allow(clippy::needless_range_loop)]
    fn find_patches(&mut self, light: &Light<'a>, numbers: &[Floats<N>; 2], count: usize) {
        // One lane alone reads them at once.
        if N > 1 {
            self.blocks.iter().take(count).for_each(|block| light.words.prefetch(block.rows as usize));
        }
        for lane in 0..count.min(N) {
            let (c, block) = (self.cells[lane], self.blocks[lane]);
            let [columns, rows] = block.grid.map(usize::from);
            let key = |k: usize| truncate(numbers[k][lane]);
            let (y, range) = find16(&light.words, block.rows as usize, rows, key(1), block.words_at_ends());
            self.put_inner(1, lane, range);
            let line = block.line(y, light.bilinear);
            let starts = line + block.corners(light.bilinear);
            let (x, range) = find16(&light.words, starts, columns, key(0), block.words_at_ends());
            self.put_inner(0, lane, range);
            self.put_corners(light, lane, block, line + x);
            self.face[lane] = c.face.into();
            (self.shares[0][lane], self.shares[1][lane]) = (c.probability, block.share);
            let part = [x as u32, y as u32];
            for k in 0..2 {
                let block_at = self.from[k][lane];
                self.from[k][lane] = u32::from(c.origin[k]) + (block_at << (light.side[k] & 31)) + part[k];
                if !light.exact {
                    let (from, behind) = c.extent(k, block_at, part[k], block.step(k));
                    (self.from[k][lane], self.behind[k][lane]) = (from, behind);
                }
            }
        }
    }

    /// Columns and rows of faces for the lanes from `first` on.
    #[inline(always)]
    pub(super) fn put_places<F: Num>(&mut self, first: usize, face: F::Ints, [column, row]: [F::Ints; 2]) {
        put(&mut self.face, first, face.as_ref());
        put(&mut self.from[0], first, column.as_ref());
        put(&mut self.from[1], first, row.as_ref());
    }

    /// Finds the patches at columns and rows of faces, which stand in `from`.
    #[inline(never)]
    fn at(&mut self, light: &Light<'a>, count: usize) {
        self.at_here(light, count);
    }

    /// As [`Walk::at`], inlined.
    #[inline(always)]
    fn at_here(&mut self, light: &Light<'a>, count: usize) {
        let count = count.min(N);
        let face_rows = light.grid[1] / light.chart.faces();
        for lane in 0..count {
            self.cell[lane] = light.find_cell(self.face[lane], face_rows, [self.from[0][lane], self.from[1][lane]]);
        }
        for lane in 0..count {
            let c = light.cell(self.cell[lane]);
            let (block, [i, j], patch) = light.find_block(c, [self.from[0][lane], self.from[1][lane]]);
            self.cells[lane] = c;
            self.shares[0][lane] = c.probability;
            self.blocks[lane] = light.block(block);
            self.put_outer(1, lane, cell(&light.starts, c.starts as usize, j as usize));
            self.put_outer(0, lane, cell(&light.starts, c.row(j as usize), i as usize));
            // In the block, for now.
            (self.behind[0][lane], self.behind[1][lane]) = (patch[0], patch[1]);
        }
        for lane in 0..count {
            let block = self.blocks[lane];
            let [x, y] = [0, 1].map(|k: usize| (self.behind[k][lane] >> block.step(k)) as usize);
            let [columns, rows] = block.grid.map(usize::from);
            let line = block.line(y, light.bilinear);
            let starts = line + block.corners(light.bilinear);
            self.put_inner(1, lane, cell16(&light.words, block.rows as usize, rows, y, block.words_at_ends()));
            self.put_inner(0, lane, cell16(&light.words, starts, columns, x, block.words_at_ends()));
            self.put_corners(light, lane, block, line + x);
            self.shares[1][lane] = block.share;
            if !light.exact {
                let c = self.cells[lane];
                for (k, part) in [x, y].into_iter().enumerate() {
                    let block_at = self.from[k][lane].wrapping_sub(c.origin[k].into()) >> (c.side[k] & 31);
                    let (from, behind) = c.extent(k, block_at, part as u32, block.step(k));
                    (self.from[k][lane], self.behind[k][lane]) = (from, behind);
                }
            }
        }
    }

    #[inline(always)]
    fn put_outer(&mut self, axis: usize, lane: usize, [start, end]: [f32; 2]) {
        self.outer[axis][0][lane] = start;
        self.outer[axis][1][lane] = end;
    }

    #[inline(always)]
    fn put_inner(&mut self, axis: usize, lane: usize, [start, end]: [u32; 2]) {
        self.inner[axis][0][lane] = start;
        self.inner[axis][1][lane] = end;
    }

    /// The corners of the patch whose upper ones begin at a word.
    #[inline(always)]
    fn put_corners(&mut self, light: &Light<'_>, lane: usize, block: &Block, first: usize) {
        if light.bilinear {
            self.corner[0][lane] = light.pair(first);
            self.corner[1][lane] = light.pair(first + 2 * usize::from(block.grid[0]));
        }
    }

    /// The patches of the lanes from `first` on.
    #[inline(always)]
    pub(super) fn patches<F: Num>(&self, light: &Light<'_>, first: usize) -> Patches<F> {
        let outer_range = |axis: usize| {
            let start = floats::<F, N>(&self.outer[axis][0], first);
            (start, floats::<F, N>(&self.outer[axis][1], first) - start)
        };
        let outer = [outer_range(0), outer_range(1)];
        let inner = [self.inner_range::<F>(0, first), self.inner_range::<F>(1, first)];
        let whole = |of: &Ints<N>| F::of_ints(ints::<F, N>(of, first));
        let from = [whole(&self.from[0]), whole(&self.from[1])];
        // A texel each.
        let mut behind = [from[0] + 1.0, from[1] + 1.0];
        if !light.exact {
            behind = [whole(&self.behind[0]), whole(&self.behind[1])];
        }
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
            light: floats::<F, N>(&self.shares[0], first),
            face: whole(&self.face),
            first: from,
            behind,
            low,
            size,
            shape: PatchDensity::new(corner, light.chart.profiles(low, size)),
            probability: floats::<F, N>(&self.shares[1], first) * row_width * column_width,
            start: [outer[0].0 + outer[0].1 * (inner[0].0 * unit), outer[1].0 + outer[1].1 * (inner[1].0 * unit)],
            width: [outer[0].1 * column_width, outer[1].1 * row_width],
        }
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
    pub(super) fn drawn<F: Num>(&self, light: &Light<'_>, numbers: &[Floats<N>; 2], first: usize) -> Drawn<F> {
        let patch = self.patches::<F>(light, first);
        let inside = [self.in_part::<F>(numbers, 0, first), self.in_part::<F>(numbers, 1, first)];
        let mut position = patch.shape.sample(inside);
        if !light.bilinear {
            // Away from the borders, where a client's rounding might find the neighbour.
            let moved = |k: usize| {
                let least = F::splat(1.25 * light.chart.margin(k)) / patch.size[k];
                position[k].max(least).min(F::splat(1.0) - least)
            };
            position = [moved(0), moved(1)];
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
        let numbers = [numbers[0].store(), numbers[1].store()];
        match F::WIDTH {
            1 => self.draw::<F, 1>(cells, numbers),
            4 => self.draw::<F, 4>(cells, numbers),
            _ => self.draw::<F, GROUP>(cells, numbers),
        }
    }

    #[inline(always)]
    fn draw<F: Num, const N: usize>(&self, cells: F::Ints, of_lanes: [F::Floats; 2]) -> Drawn<F> {
        let mut walk = Walk::<N>::new();
        put(&mut walk.cell, 0, cells.as_ref());
        let mut numbers = [[NUMBER; N]; 2];
        for (out, numbers) in numbers.iter_mut().zip(&of_lanes) {
            put(out, 0, numbers.as_ref());
        }
        match N {
            1 => walk.down_here(self, &mut numbers, 1),
            _ => walk.down(self, &mut numbers, F::WIDTH),
        }
        walk.drawn::<F>(self, &numbers, 0)
    }

    /// Where directions of unit length are; `numbered`: with their numbers.
    #[inline(always)]
    pub fn locate<F: Num>(&self, direction: Direction<F>, numbered: bool) -> Located<F> {
        F::apart(Locate { light: self, direction, numbered, settles: true })
    }

    #[inline(always)]
    fn find<F: Num, const N: usize>(&self, direction: Direction<F>) -> (Within<F>, Place<F>) {
        let place = self.chart.place(direction);
        let [columns, rows] = self.chart.axes;
        let mut walk = Walk::<N>::new();
        let [column, row] = [columns.patch(place.position[0]), rows.patch(place.position[1])];
        walk.put_places::<F>(0, place.face.truncate(), [column, row]);
        match N {
            1 => walk.at_here(self, 1),
            _ => walk.at(self, F::WIDTH),
        }
        (within(&walk.patches::<F>(self, 0), &place), place)
    }

    /// The lanes without light from which rounding may lead a client over a border of their patches.
    #[inline(always)]
    pub(super) fn dark_at_border<F: Num>(&self, located: &Within<F>, place: &Place<F>) -> F::Mask {
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let from_border = |k: usize| {
            let position = located.position[k];
            position.min(one - position) * located.patch.size[k]
        };
        let (across, down) = (from_border(0), from_border(1));
        // Texels are at least as narrow as this is, for their solid angle.
        let [columns, rows] = self.chart.axes;
        let widest = 2.0 * core::f32::consts::PI / columns.length.min(rows.length);
        let angle = across.min(down) * place.solid_angle * F::splat(1.0 / widest);
        F::and(located.alone().le(zero), angle.lt(F::splat(ROUNDING)))
    }

    /// The brightest of the directions that rounding makes of one, if any is lit. About a pole it moves azimuths, too.
    #[cold]
    #[inline(never)]
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
            let located = f32::apart(Locate { light: self, direction: moved, numbered: false, settles: false });
            if located.alone > brightest {
                (brightest, found) = (located.alone, moved);
            }
        }
        found
    }

    /// The direction of a drawn place.
    #[inline(always)]
    pub fn direction_of<F: Num>(&self, drawn: &Drawn<F>) -> Direction<F> {
        self.chart.direction(drawn.patch.face, drawn.place())
    }

    /// The densities of drawn places within their cells: what [`Light::locate`] would find, but for rounding at the borders of patches.
    #[inline(always)]
    pub fn density_at<F: Num>(&self, place: &Place<F>, drawn: &Drawn<F>) -> F {
        located(&drawn.patch, drawn.position, place).density
    }

    /// As [`Light::locate`] for directions that were drawn from known patches: in those that still hold them, and a mask of the
    /// lanes in which rounding left the patch. In a light for nearest clients, also of those in which it came so close to the
    /// border that the client's own rounding might find the neighbour.
    #[inline(always)]
    pub(super) fn relocate<F: Num>(&self, d: Direction<F>, drawn: &Drawn<F>) -> (Within<F>, F::Mask) {
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
        (located, F::or(out, located.alone().le(F::splat(0.0))))
    }

    /// Hands out the patches that begin in a row of a face, from left to right. Of coarse ones, all rows together hand out each once.
    pub fn each_patch(&self, face: u32, row: u32, mut each: impl FnMut(&Patches<f32>)) {
        let columns = self.chart.axes[0].patches;
        for first in (0..columns).step_by(GROUP) {
            let mut walk = Walk::<GROUP>::new();
            let lanes = first..columns.min(first + GROUP as u32);
            walk.face = [face; GROUP];
            walk.from[1] = [row; GROUP];
            walk.from[0].iter_mut().zip(lanes.clone()).for_each(|(out, column)| *out = column);
            walk.at(self, lanes.len());
            for (lane, column) in lanes.enumerate() {
                let patch = walk.patches::<f32>(self, lane);
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

    /// The block of a cell that holds a patch: its number, its column and row in the cell, and those of the patch in it.
    #[inline(always)]
    pub(super) fn find_block(&self, cell: &Cell, patch: [u32; 2]) -> (u32, [u32; 2], [u32; 2]) {
        let (mut at, mut inside) = ([0; 2], [0; 2]);
        for k in 0..2 {
            let from_cell = patch[k].wrapping_sub(cell.origin[k].into());
            at[k] = from_cell >> (cell.side[k] & 31);
            inside[k] = from_cell & !(u32::MAX << (cell.side[k] & 31));
        }
        let number = cell.first + at[1] * u32::from(cell.blocks[0]) + at[0];
        prefetch(self.blocks, number as usize);
        (number, at, inside)
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

    /// Where the table of the columns of a row of cells begins.
    #[inline(always)]
    fn top_row(&self, row: usize) -> usize {
        self.grid[1] as usize + 1 + row * (self.grid[0] as usize + 1)
    }
}

/// [`Light::locate`]. `settles`: whether a place without light moves over a border to one with light.
struct Locate<'a, F> {
    light: &'a Light<'a>,
    direction: Direction<F>,
    numbered: bool,
    settles: bool,
}

impl<F: Num> Apart<F> for Locate<'_, F> {
    type Output = Located<F>;

    #[inline(always)]
    fn run(mut self) -> Located<F> {
        let Locate { light, direction, numbered, settles } = self;
        let (located, place) = match F::WIDTH {
            1 => light.find::<F, 1>(direction),
            4 => light.find::<F, 4>(direction),
            _ => light.find::<F, GROUP>(direction),
        };
        let mut lanes = F::bits(light.dark_at_border(&located, &place));
        if !settles || lanes == 0 {
            return located.located(numbered);
        }
        // Dark lanes move over the border, where light is beside.
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            let [x, y, z] = light.lit_beside(lane_of(self.direction, lane));
            set(&mut self.direction[0], lane, x);
            set(&mut self.direction[1], lane, y);
            set(&mut self.direction[2], lane, z);
        }
        F::apart(Locate { settles: false, ..self })
    }
}

/// A place in the patch that holds it.
#[inline(always)]
pub(super) fn within<F: Num>(patch: &Patches<F>, place: &Place<F>) -> Within<F> {
    let (zero, one) = (F::splat(0.0), F::splat(1.0));
    // The quotients do not wait for the place.
    let (across, down) = (one / patch.size[0], one / patch.size[1]);
    let s = ((place.position[0] - patch.low[0]) * across).max(zero).min(one);
    let t = ((place.position[1] - patch.low[1]) * down).max(zero).min(one);
    located(patch, [s, t], place)
}

/// A position inside a patch, with its density.
#[inline(always)]
fn located<F: Num>(patch: &Patches<F>, position: [F; 2], place: &Place<F>) -> Within<F> {
    let shape = &patch.shape;
    let area = (patch.size[0] * patch.size[1]) * place.solid_angle;
    let scale = patch.probability / (shape.total() * area).max(F::splat(f32::MIN_POSITIVE));
    Within { patch: *patch, position, density: scale * shape.unscaled(position) }
}
