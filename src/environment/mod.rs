//! An environment: light from every direction, as a tree over the octahedral square in map space.
//!
//! Two storages stand behind one interface: the exact pyramid, and a sparse tree pruned by an error budget.
//! On its own an environment samples directions in proportion to its luminance, or to the luminance above the mean
//! (compensated: Karlik et al. 2019, "MIS Compensation", for use together with BRDF sampling). Nothing is multiplied by
//! the compensated distribution, so a pyramid keeps it as tables of its cells, which are found without a walk.

mod build;
mod integrate;
mod inverse;
mod pixels;
mod polygon;
mod refine;

pub use build::{
    Config, Decoded, Grid, Row, Table as TableParts, Trees, complete, copy_kept, decode, integrate, plan, replacement,
    write_kept,
};
pub use integrate::Texels;
pub use inverse::Inverse;
pub use pixels::{Format, InvalidTexel, Layout, Pixels, RowError, RowSummary, Rows, check};
pub use refine::{Refined, Refinement, Spread, refine};

use crate::descent::{Cell, Density, Start};
use crate::morton;
use crate::numeric::{ContentHash, ONE_MINUS_EPSILON, exp2i, inverse_power};
use crate::simd::{LANES, Lanes};
use crate::tree::{Link, Mark, NO_SQUARE, Tree};
use crate::wide::{ALL, GROUPS, Locating, Sampling, Walker, WideDensity};
use core::f64::consts::PI;
use inverse::Span;

/// How a tree is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storage {
    /// Every square: 16 bytes for each four cells, and a third more; and squares below some cells.
    Pyramid,
    /// The squares that an error budget keeps: 24 bytes each.
    Sparse,
}

/// The first bytes of an environment: what it is, and every number that is not per square.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Header {
    /// Marks an environment of this version.
    pub magic: u64,
    /// Bytes of the whole.
    pub bytes: u64,
    /// A hash of everything else.
    pub content_id: u64,
    /// Texels that were sanitised.
    pub sanitised: u64,
    /// The integral of luminance over the sphere, in the units of the input.
    pub power: f64,
    /// The variance that pruning adds, relative.
    pub error: f64,
    /// WIS_STORAGE_*.
    pub storage: u32,
    /// WIS_ENVIRONMENT_*.
    pub flags: u32,
    /// The square has 2^depth cells per axis.
    pub depth: u32,
    /// Squares stored.
    pub squares: u32,
    /// The stored values are the input's times `2^-exponent`; their mean is in [1, 2).
    pub exponent: i32,
    /// The stored average.
    pub average: f32,
    /// The stored average of the compensated distribution.
    pub compensated_average: f32,
    /// The stored average of RGB.
    pub rgb_average: [f32; 3],
    /// Squares below the cells of a pyramid.
    pub refined: u32,
    /// Always 0.
    pub reserved: u32,
}

impl Header {
    /// The integral of the compensated distribution, in the units of the input.
    pub fn compensated_power(&self) -> f64 {
        4.0 * PI * f64::from(self.compensated_average) * exp2i(self.exponent)
    }
}

/// "wis-env" and the version of the format.
pub const MAGIC: u64 = u64::from_le_bytes(*b"wis-env\x02");

/// An environment in the caller's memory.
#[derive(Clone, Copy)]
pub struct Environment<'a> {
    /// Every number that is not per square.
    pub header: &'a Header,
    /// Child averages of luminance.
    pub squares: &'a [[f32; 4]],
    /// The cells of a pyramid that are refined; empty if none is.
    pub marks: &'a [Mark],
    /// The links of sparse storage, or of the squares below the cells of a pyramid.
    pub links: &'a [Link],
    /// Child averages of the compensated distribution: of all squares in sparse storage, of a pyramid of those below its
    /// cells. Empty if not built.
    pub compensated: &'a [[f32; 4]],
    /// The cells of a pyramid by the compensated distribution; `None` if not built.
    pub cells: Option<Inverse<'a>>,
    /// Child averages of RGB; empty if not built.
    pub rgb: &'a [[[f32; 3]; 4]],
}

impl<'a> Environment<'a> {
    /// The luminance.
    pub fn light(&self) -> Tree<'a, 4> {
        let (depth, average) = (self.header.depth, self.header.average);
        if self.marks.is_empty() {
            Tree::trusted(depth, average, self.squares, self.links)
        } else {
            Tree::trusted_refined(depth, average, self.squares, self.marks, self.links)
        }
    }

    /// The stored RGB average of child `c` of a square, or of the whole square.
    pub fn rgb(&self, place: Option<(u32, u32)>) -> [f32; 3] {
        match place {
            None => self.header.rgb_average,
            Some((square, c)) => {
                self.rgb.get(square as usize).and_then(|quad| quad.get(c as usize)).copied().unwrap_or([0.0; 3])
            }
        }
    }

    /// The hash of everything but the id itself.
    pub fn content_id(&self) -> u64 {
        let h = self.header;
        let mut hash = ContentHash::new();
        for word in [h.magic, h.bytes, h.sanitised, h.power.to_bits(), h.error.to_bits(), h.exponent as u64] {
            hash.add(word);
        }
        for word in
            [h.storage, h.flags, h.depth, h.squares, h.refined, h.average.to_bits(), h.compensated_average.to_bits()]
        {
            hash.add(word.into());
        }
        hash.add_floats(&h.rgb_average);
        for square in self.squares.iter().chain(self.compensated) {
            hash.add_floats(square);
        }
        if let Some(cells) = &self.cells {
            cells.add_to(&mut hash);
        }
        for mark in self.marks {
            hash.add(u64::from(mark.before) << 32 | u64::from(mark.bits));
        }
        for link in self.links {
            hash.add(u64::from(link.first) << 32 | u64::from(link.mask));
        }
        for colour in self.rgb.iter().flatten() {
            hash.add_floats(colour);
        }
        hash.finish()
    }
}

/// The environment's light as a density: constant within a cell.
#[derive(Clone, Copy)]
pub struct Light<'a> {
    /// The whole tree, or what lies below the cells of `table`.
    tree: Tree<'a, 4>,
    table: Option<Table<'a>>,
}

/// Cells that are found without a walk, and which of them go on as squares of the tree.
#[derive(Clone, Copy)]
struct Table<'a> {
    cells: Inverse<'a>,
    marks: &'a [Mark],
}

impl<'a> Light<'a> {
    /// The density of a tree.
    pub fn of(tree: Tree<'a, 4>) -> Self {
        Light { tree, table: None }
    }

    /// The density of cells, of which those that are marked go on in the squares of a sparse tree.
    pub fn of_cells(cells: Inverse<'a>, marks: &'a [Mark], tree: Tree<'a, 4>) -> Self {
        Light { tree, table: Some(Table { cells, marks }) }
    }

    /// Proportional to luminance.
    pub fn plain(environment: &Environment<'a>) -> Self {
        Light::of(environment.light())
    }

    /// Proportional to the luminance above the mean.
    pub fn compensated(environment: &Environment<'a>) -> Self {
        let Environment { header, compensated, links, .. } = environment;
        let tree = Tree::trusted(header.depth, header.compensated_average, compensated, links);
        match environment.cells {
            Some(cells) => Light::of_cells(cells, environment.marks, tree),
            None => Light::of(tree),
        }
    }
}

impl Table<'_> {
    /// The square of a cell; [`NO_SQUARE`] if it is not refined.
    #[inline(always)]
    fn square(&self, index: [u32; 2]) -> u32 {
        if self.marks.is_empty() {
            return NO_SQUARE;
        }
        self.below(morton::encode_pair(index))
    }

    /// The square of a cell by its Morton code.
    #[inline(always)]
    fn below(&self, cell: u32) -> u32 {
        let Mark { bits, before } = self.marks.get((cell / 32) as usize).copied().unwrap_or_default();
        let bit = 1u32.wrapping_shl(cell % 32);
        if bits & bit == 0 { NO_SQUARE } else { before.wrapping_add((bits & (bit - 1)).count_ones()) }
    }

    /// The density of a cell, the product of the probabilities of its row and column times the number of cells.
    #[inline(always)]
    fn density(&self, row: Span, column: Span) -> f32 {
        let scale = self.cells.scale();
        (row.width as f32 * scale) * (column.width as f32 * scale)
    }
}

impl Density for Light<'_> {
    fn is_positive(&self) -> bool {
        self.tree.average() > 0.0
    }

    #[inline(always)]
    fn enter(&self, u: [f32; 2]) -> Start {
        let Some(table) = &self.table else { return Start { u, ..Start::WHOLE } };
        let positions = u.map(inverse::position);
        let row = table.cells.find(0, positions[0]);
        let column = table.cells.find(1 + row.cell, positions[1]);
        let cell = Cell { level: table.cells.depth(), index: [row.cell, column.cell] };
        let u = [row.inside(positions[0]), column.inside(positions[1])];
        Start { cell, u, density: table.density(row, column), square: table.square(cell.index) }
    }

    #[inline(always)]
    fn enter_at(&self, s: [f32; 2]) -> Start {
        let Some(table) = &self.table else { return Start::WHOLE };
        let level = table.cells.depth();
        let [i, j] = s.map(|s| (s * (1u32 << (level & 31)) as f32) as u32);
        let density = table.density(table.cells.span(0, i), table.cells.span(1 + i, j));
        Start { cell: Cell { level, index: [i, j] }, u: [0.0; 2], density, square: table.square([i, j]) }
    }

    fn leave(&self, start: &Start, u: [f32; 2]) -> [f32; 2] {
        let Some(table) = &self.table else { return u };
        let [i, j] = start.cell.index;
        [table.cells.span(0, i).undo(u[0]), table.cells.span(1 + i, j).undo(u[1])]
    }

    #[inline(always)]
    fn walk(&self, square: u32, mut choose: impl FnMut([f32; 4]) -> Option<u32>) -> Option<[f32; 4]> {
        let mut square = self.tree.square(square);
        while let Some(here) = square {
            let c = choose(self.tree.children(here))?;
            square = self.tree.child_square(here, c);
        }
        Some([1.0; 4])
    }
}

/// Eight places in a tree.
pub(crate) struct Descent<'a, F: Lanes> {
    tree: Tree<'a, 4>,
    squares: F::Index,
    /// The lanes that stand at a square, as bits.
    pub walks: u32,
}

impl<'a, F: Lanes> Descent<'a, F> {
    /// Starts at squares; those of lanes that are not in `walks` do not matter.
    #[inline(always)]
    pub fn from(tree: Tree<'a, 4>, squares: [u32; LANES], walks: u32) -> Self {
        let squares = F::select_index(F::mask(walks), F::index(squares), F::index([0; LANES]));
        Descent { tree, squares, walks }
    }

    /// The averages of the children, child by child.
    #[inline(always)]
    pub fn children(&self) -> [F; 4] {
        F::gather(self.tree.squares(), self.squares)
    }

    /// Goes to the children on the sides; lanes whose child is a cell stay and end there.
    #[inline(always)]
    pub fn step(&mut self, sides: [F::Mask; 2]) {
        let children = F::child(self.squares, sides);
        let in_heap = F::below(children, self.tree.heap());
        let walks = F::bits(in_heap) & self.walks;
        let leaving = self.walks & !walks;
        if leaving == 0 && walks == ALL {
            self.squares = children;
            return;
        }
        self.squares = F::select_index(F::mask(walks), children, self.squares);
        self.walks = walks;
        if leaving != 0 && !self.tree.links().is_empty() {
            self.leave(sides, F::numbers(children), leaving);
        }
    }

    /// Lanes that leave the heap, or are behind it, ask one by one.
    #[inline(always)]
    fn leave(&mut self, sides: [F::Mask; 2], children: [u32; LANES], leaving: u32) {
        let sides = [F::bits(sides[0]), F::bits(sides[1])];
        let mut squares = F::numbers(self.squares);
        for (i, (square, child)) in squares.iter_mut().zip(children).enumerate() {
            // Most cells of the heap are not refined.
            let asks = leaving >> i & 1 == 1 && self.tree.may_have(*square, child);
            let c = 2 * (sides[0] >> i & 1) + (sides[1] >> i & 1);
            if let Some(child) = asks.then(|| self.tree.child_square(*square, c)).flatten() {
                *square = child;
                self.walks |= 1 << i;
            }
        }
        self.squares = F::index(squares);
    }
}

impl WideDensity for Light<'_> {
    type One = Self;

    #[inline(always)]
    fn one(&self, _: usize) -> &Self {
        self
    }

    #[inline(always)]
    fn positive(&self) -> u32 {
        if self.is_positive() { ALL } else { 0 }
    }

    #[inline(always)]
    fn enter_wide<F: Lanes>(&self, u: [F; 2]) -> (Sampling<F>, [u32; LANES]) {
        let Some(table) = &self.table else { return (Sampling::whole(u), [0; LANES]) };
        let positions = [inverse::positions(u[0]), inverse::positions(u[1])];
        // All rows before the first column: the look-ups do not wait for one another.
        let (mut rows, mut columns) = (Spans::default(), Spans::default());
        for (lane, position) in F::numbers(positions[0]).into_iter().enumerate() {
            rows.set(lane, table.cells.find(0, position));
        }
        for (lane, position) in F::numbers(positions[1]).into_iter().enumerate() {
            columns.set(lane, table.cells.find(1 + rows.cell[lane & 7], position));
        }
        let start = Sampling {
            inside: [rows.inside::<F>(positions[0]), columns.inside::<F>(positions[1])],
            index: [F::from_index(F::index(rows.cell)), F::from_index(F::index(columns.cell))],
            width: F::splat(inverse_power(table.cells.depth())),
            product: table.density_wide::<F>(&rows, &columns),
        };
        (start, table.squares([rows.cell, columns.cell]))
    }

    #[inline(always)]
    fn enter_at_wide<F: Lanes>(&self, s: [F; 2]) -> (Locating<F>, [u32; LANES]) {
        let Some(table) = &self.table else { return (Locating::whole(s), [0; LANES]) };
        let cells = F::splat((1u32 << (table.cells.depth() & 31)) as f32);
        let scaled = [s[0] * cells, s[1] * cells];
        let index = [scaled[0].truncate(), scaled[1].truncate()];
        let (i, j) = (F::numbers(index[0]), F::numbers(index[1]));
        let (mut rows, mut columns) = (Spans::default(), Spans::default());
        for lane in 0..LANES {
            rows.set(lane, table.cells.span(0, i[lane]));
            columns.set(lane, table.cells.span(1 + i[lane], j[lane]));
        }
        let rest = [scaled[0] - F::from_index(index[0]), scaled[1] - F::from_index(index[1])];
        (Locating { rest, product: table.density_wide::<F>(&rows, &columns) }, table.squares([i, j]))
    }

    #[inline(always)]
    fn walk_wide<F: Lanes>(
        groups: [&Self; GROUPS],
        starts: [(u32, [u32; LANES]); GROUPS],
        walkers: &mut [impl Walker<F>; GROUPS],
    ) -> [([F; 4], u32); GROUPS] {
        let mut descents = [0, 1].map(|g: usize| {
            let (tree, (walks, squares)) = (groups[g].tree, starts[g]);
            let begins = if tree.squares().is_empty() { 0 } else { walks & !F::highest_bits(F::index(squares)) };
            Descent::<F>::from(tree, squares, begins)
        });
        let (mut levels, mut walks) = (0, true);
        while walks && levels < crate::tree::MAX_REFINED {
            walks = false;
            for (descent, walker) in descents.iter_mut().zip(walkers.iter_mut()) {
                if descent.walks != 0 {
                    let sides = walker.choose(descent.walks, descent.children());
                    descent.step(sides);
                    walks |= descent.walks != 0;
                }
            }
            levels += 1;
        }
        descents.map(|descent| ([F::splat(1.0); 4], descent.walks))
    }
}

impl Table<'_> {
    /// As [`Table::density`].
    #[inline(always)]
    fn density_wide<F: Lanes>(&self, rows: &Spans, columns: &Spans) -> F {
        let scale = F::splat(self.cells.scale());
        let widths = [F::from_index(F::index(rows.width)), F::from_index(F::index(columns.width))];
        (widths[0] * scale) * (widths[1] * scale)
    }

    /// As [`Table::square`].
    #[inline(always)]
    fn squares(&self, [i, j]: [[u32; LANES]; 2]) -> [u32; LANES] {
        let mut squares = [NO_SQUARE; LANES];
        if self.marks.is_empty() {
            return squares;
        }
        // Codes apart from look-ups, so that they are computed side by side.
        let mut cells = [0; LANES];
        for (cell, (i, j)) in cells.iter_mut().zip(i.into_iter().zip(j)) {
            *cell = morton::encode_pair([i, j]);
        }
        for (square, cell) in squares.iter_mut().zip(cells) {
            *square = self.below(cell);
        }
        squares
    }
}

/// The spans of eight lanes, column by column.
#[derive(Default)]
struct Spans {
    cell: [u32; LANES],
    start: [u32; LANES],
    width: [u32; LANES],
}

impl Spans {
    #[inline(always)]
    fn set(&mut self, lane: usize, span: Span) {
        self.cell[lane & 7] = span.cell;
        self.start[lane & 7] = span.start;
        self.width[lane & 7] = span.width;
    }

    /// As [`Span::inside`].
    #[inline(always)]
    fn inside<F: Lanes>(&self, positions: F::Index) -> F {
        let mut offsets = F::numbers(positions);
        for (offset, start) in offsets.iter_mut().zip(self.start) {
            *offset = offset.wrapping_sub(start);
        }
        let inside = F::from_index(F::index(offsets)) / F::from_index(F::index(self.width));
        inside.min(F::splat(ONE_MINUS_EPSILON))
    }
}
