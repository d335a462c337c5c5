//! Sample, pdf and invert of a product over its light.
//!
//! The density is F over the light's numbers, times the light's density, over F's integral. As for the light, the pdf is one
//! function of the f32 world direction, and a sample's pdf is that function at the direction that it returns.

use super::peak::Peak;
use super::stored::{OF_DIVIDED, PART_ENDS, Product};
use crate::light::batch::{Density, Drawn};
use crate::light::density::{Inverted, clamp_u, inward, settle_lanes, to_world};
use crate::light::parts::{MIDDLES, PARTS, range};
use crate::light::search::find;
use crate::light::tables::{Light, Located, decode, decode_wide, decoded};
use crate::light::warp::{PatchDensity, Profiles};
use crate::numeric::{ONE_MINUS_EPSILON, min};
use crate::simd::{Apart, GROUP, Num};
use crate::sphere::Frame;

/// A product with the light that it was prepared for.
#[derive(Clone, Copy, Debug)]
pub struct Shaded<'a> {
    /// The light.
    pub light: Light<'a>,
    /// The product.
    pub product: Product<'a>,
}

/// Where F is bilinear: a cell, or a part of one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Leaf {
    /// Which group of leaves, and which of them.
    at: [u32; 2],
    /// Where the leaf begins in the cell's numbers (w, v).
    start: [f32; 2],
    /// Its width along both; 1: the cell.
    width: [f32; 2],
}

/// Leaves and numbers of lanes, written lane by lane and read together.
#[derive(Clone, Copy, Debug)]
struct Found<const N: usize> {
    cell: [u32; N],
    /// Pairs of corner words: of the upper and of the lower row.
    corner: [[u32; N]; 2],
    /// Where the leaves begin in the cells' numbers (w, v).
    start: [[f32; N]; 2],
    width: [[f32; N]; 2],
    /// The numbers: those of the cells, or what is left of them inside the leaves.
    numbers: [[f32; N]; 2],
}

impl<const N: usize> Found<N> {
    /// Lanes with these numbers.
    #[inline(always)]
    fn new<F: Num>(numbers: [F; 2]) -> Found<N> {
        let mut lanes = [[0.0; N]; 2];
        for (out, numbers) in lanes.iter_mut().zip(numbers) {
            for (out, &x) in out.iter_mut().zip(numbers.store().as_ref()) {
                *out = x;
            }
        }
        Found { cell: [0; N], corner: [[0; N]; 2], start: [[0.0; N]; 2], width: [[0.0; N]; 2], numbers: lanes }
    }

    #[inline(always)]
    fn put(&mut self, lane: usize, leaf: &Leaf, [a, b, c, d]: [u16; 4]) {
        let pair = |low: u16, high: u16| u32::from(low) | u32::from(high) << 16;
        self.corner[0][lane] = pair(a, b);
        self.corner[1][lane] = pair(c, d);
        self.start[0][lane] = leaf.start[0];
        self.start[1][lane] = leaf.start[1];
        self.width[0][lane] = leaf.width[0];
        self.width[1][lane] = leaf.width[1];
    }

    #[inline(always)]
    fn leaves<F: Num>(&self) -> Leaves<F> {
        let ([a, b], [c, d]) =
            (decoded::<F>(F::read_ints(&self.corner[0])), decoded::<F>(F::read_ints(&self.corner[1])));
        let shape = PatchDensity::new([a, b, c, d], Profiles { down: None, across: None });
        Leaves {
            shape,
            start: [F::read(&self.start[0]), F::read(&self.start[1])],
            width: [F::read(&self.width[0]), F::read(&self.width[1])],
        }
    }
}

/// Leaves, one for each lane.
struct Leaves<F: Num> {
    shape: PatchDensity<F>,
    start: [F; 2],
    width: [F; 2],
}

impl<'a> Shaded<'a> {
    /// The integral of the light's colour x luminance of BRDF x cosine, from the colours and the power of the light.
    pub fn colour(&self, colours: &[[f32; 3]]) -> [f32; 3] {
        let mut sum = [0.0f64; 3];
        for (cell, colour) in (0..).zip(colours) {
            let mean = match self.divided(cell) {
                None => self.mean(whole(cell)),
                Some(number) => {
                    let parts = (0..MIDDLES).map(|part| {
                        let Leaf { at, width: [across, down], .. } = self.part(number, part % PARTS, part / PARTS);
                        self.mean(at) * f64::from(across * down)
                    });
                    parts.sum::<f64>()
                }
            };
            for (sum, &c) in sum.iter_mut().zip(colour) {
                *sum += mean * f64::from(c);
            }
        }
        let scale = self.product.header.unit * self.light.power;
        let largest = f64::from(f32::MAX);
        // Of a light that was changed and signed again a colour may be anything.
        sum.map(|c| c * scale).map(|c| if c.is_nan() { 0.0 } else { c.clamp(-largest, largest) as f32 })
    }

    /// The mean of a leaf.
    fn mean(&self, leaf: [u32; 2]) -> f64 {
        0.25 * self.words(leaf).iter().map(|&word| f64::from(decode(word))).sum::<f64>()
    }

    /// The words of a leaf: its corners in 16 bits.
    #[inline(always)]
    fn words(&self, [group, lane]: [u32; 2]) -> [u16; 4] {
        let Some([a, b, c, d]) = self.product.leaves.get(group as usize) else { return [0; 4] };
        let lane = lane as usize % GROUP;
        [a[lane], b[lane], c[lane], d[lane]]
    }

    /// The number of a divided cell among those; a divided cell's own leaf keeps it.
    #[inline(always)]
    fn divided(&self, cell: u32) -> Option<u32> {
        let [marker, number, ..] = self.words(whole(cell));
        if marker == 0 { u32::from(number).checked_sub(1) } else { None }
    }

    /// The leaf of part (column, row) of the divided cell with this number.
    #[inline(always)]
    fn part(&self, number: u32, column: usize, row: usize) -> Leaf {
        let cells = (self.light.cells.len() / GROUP) as u32;
        let (group, lane) = (number / GROUP as u32, number % GROUP as u32);
        let part = (row * PARTS + column) as u32;
        let [left, right] = range(&self.borders(number, 1 + row), column);
        let [top, bottom] = range(&self.borders(number, 0), row);
        let (start, width) = ([left, top], [right - left, bottom - top]);
        Leaf { at: [cells + group * MIDDLES as u32 + part, lane], start, width }
    }

    /// The leaf that holds the numbers (w, v) of a cell.
    #[inline(always)]
    fn leaf_at(&self, cell: u32, [w, v]: [f32; 2]) -> Leaf {
        match self.divided(cell) {
            None => Leaf { at: whole(cell), start: [0.0; 2], width: [1.0; 2] },
            Some(number) => {
                let place = |which: usize, x: f32| {
                    let [a, b, c] = self.borders(number, which);
                    usize::from(a <= x) + usize::from(b <= x) + usize::from(c <= x)
                };
                let row = place(0, v);
                self.part(number, place(1 + row, w), row)
            }
        }
    }

    /// The cell that `u` leads to, the leaf in it, and what is left of `u`.
    #[inline(always)]
    fn search(&self, [across, down]: [f32; 2]) -> (u32, Leaf, [f32; 2]) {
        let tops = &self.product.tops;
        let [columns, rows] = self.product.header.grid.map(|n| n as usize);
        let [total, ..] = *tops.window(rows);
        let (row, range) = find(tops, 0, rows, down * total);
        let v = rest(down * total, range);
        let line = rows + 1 + row * (columns + 1);
        let [sum, ..] = *tops.window(line + columns);
        let (column, range) = find(tops, line, columns, across * sum);
        let w = rest(across * sum, range);
        let cell = (row * columns + column) as u32;
        let Some(number) = self.divided(cell) else {
            return (cell, Leaf { at: whole(cell), start: [0.0; 2], width: [1.0; 2] }, [w, v]);
        };
        let (row, v) = self.search_ends(number, 0, v);
        let (column, w) = self.search_ends(number, PARTS * (1 + row), w);
        (cell, self.part(number, column, row), [w, v])
    }

    /// Ends `first` to `first` + 3 of a divided cell.
    #[inline(always)]
    fn ends(&self, number: u32, first: usize) -> [f32; PARTS] {
        let lane = number as usize % GROUP;
        let first = number as usize / GROUP * OF_DIVIDED + first;
        match self.product.ends.get(first..).and_then(|rest| rest.first_chunk::<PARTS>()) {
            Some([a, b, c, d]) => [a[lane], b[lane], c[lane], d[lane]],
            None => [1.0; PARTS],
        }
    }

    /// The borders of a divided cell between its rows of parts (0), or in one of those (1 to 4).
    #[inline(always)]
    fn borders(&self, number: u32, which: usize) -> [f32; PARTS - 1] {
        let lane = number as usize % GROUP;
        let first = number as usize / GROUP * OF_DIVIDED + PART_ENDS + (PARTS - 1) * which;
        match self.product.ends.get(first..).and_then(|rest| rest.first_chunk::<{ PARTS - 1 }>()) {
            Some([a, b, c]) => [a[lane], b[lane], c[lane]],
            None => [1.0; PARTS - 1],
        }
    }

    /// Which of four ends a number falls before, and what is left of it.
    #[inline(always)]
    fn search_ends(&self, number: u32, first: usize, u: f32) -> (usize, f32) {
        let [a, b, c, total] = self.ends(number, first);
        let t = u * total;
        let index = usize::from(a <= t) + usize::from(b <= t) + usize::from(c <= t);
        let starts = [0.0, a, b, c, total];
        let (start, end) = (starts[index.min(PARTS - 1)], starts[(index + 1).min(PARTS)]);
        (index, rest(t, [start, end]))
    }

    /// Finds the leaves that numbers of the grid lead to, and what is left of those.
    // A function of its own: it is the same at all levels.
    #[inline(never)]
    fn search_all<const N: usize>(&self, found: &mut Found<N>, count: usize) {
        for lane in 0..count.min(N) {
            let (cell, leaf, rest) = self.search([found.numbers[0][lane], found.numbers[1][lane]]);
            found.cell[lane] = cell;
            found.numbers[0][lane] = rest[0];
            found.numbers[1][lane] = rest[1];
            found.put(lane, &leaf, self.words(leaf.at));
        }
    }

    /// Finds the leaves that hold numbers of cells.
    #[inline(never)]
    fn locate_all<const N: usize>(&self, found: &mut Found<N>, count: usize) {
        for lane in 0..count.min(N) {
            let leaf = self.leaf_at(found.cell[lane], [found.numbers[0][lane], found.numbers[1][lane]]);
            found.put(lane, &leaf, self.words(leaf.at));
        }
    }

    /// The numbers of cells that numbers in [0, 1 - 2^-24]^2 lead to.
    #[inline(always)]
    fn cells<F: Num>(&self, u: [F; 2]) -> (F::Ints, [F; 2]) {
        if F::WIDTH == 1 { self.cells_of::<F, 1>(u) } else { self.cells_of::<F, GROUP>(u) }
    }

    #[inline(always)]
    fn cells_of<F: Num, const N: usize>(&self, u: [F; 2]) -> (F::Ints, [F; 2]) {
        let mut found = Found::<N>::new(u);
        self.search_all(&mut found, F::WIDTH);
        let leaves = found.leaves::<F>();
        let inside = leaves.shape.sample([F::read(&found.numbers[0]), F::read(&found.numbers[1])]);
        let last = F::splat(ONE_MINUS_EPSILON);
        let at = |k: usize| (leaves.start[k] + inside[k] * leaves.width[k]).min(last);
        (F::read_ints(&found.cell), [at(0), at(1)])
    }

    /// The leaves of located directions, and the positions in them.
    #[inline(always)]
    fn leaves<F: Num>(&self, located: &Located<F>) -> (Leaves<F>, [F; 2]) {
        let numbers = located.numbers(&self.light);
        let leaves = if F::WIDTH == 1 {
            self.leaves_of::<F, 1>(located.patch.cell, numbers)
        } else {
            self.leaves_of::<F, GROUP>(located.patch.cell, numbers)
        };
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let at = |k: usize| ((numbers[k] - leaves.start[k]) / leaves.width[k]).max(zero).min(one);
        let inside = [at(0), at(1)];
        (leaves, inside)
    }

    #[inline(always)]
    fn leaves_of<F: Num, const N: usize>(&self, cells: F::Ints, numbers: [F; 2]) -> Leaves<F> {
        let mut found = Found::<N>::new(numbers);
        for (out, &cell) in found.cell.iter_mut().zip(cells.as_ref()) {
            *out = cell;
        }
        self.locate_all(&mut found, F::WIDTH);
        found.leaves()
    }

    /// The density of located directions by the grid.
    #[inline(always)]
    fn grid<F: Num>(&self, located: &Located<F>) -> F {
        let (leaves, inside) = self.leaves(located);
        leaves.shape.unscaled(inside) * (self.light.alone(located) * self.product.header.scale)
    }

    /// Directions of map space near those that numbers of the grid, in [0, 1 - 2^-24]^2, lead to, and what [`Shaded::grid_and_light`] answers
    /// for them.
    #[inline(always)]
    pub fn draw_grid<F: Num>(&self, frame: &Frame, u: [F; 2]) -> ([F; 3], (F, F)) {
        let FromGrid { world, pdf, light, .. } = F::apart(SampleGrid { shaded: self, frame, u, mixed: false });
        (self.light.valid(frame, world).0, (pdf, light))
    }

    /// The densities of directions of map space, of unit length, by the grid and in the light.
    #[inline(always)]
    pub fn grid_and_light<F: Num>(&self, map: [F; 3]) -> (F, F) {
        let located = self.light.locate(map, true);
        (self.grid(&located), self.light.alone(&located))
    }

    /// The density of directions of map space of unit length, and where they are.
    #[inline(always)]
    fn find<F: Num>(&self, map: [F; 3]) -> (F, Located<F>) {
        let located = self.light.locate(map, true);
        (self.mixed(map, self.grid(&located)), located)
    }

    /// The density of directions of map space for that of the grid.
    #[inline(always)]
    fn mixed<F: Num>(&self, map: [F; 3], grid: F) -> F {
        match &self.product.peak {
            None => grid,
            Some(peak) => F::splat(1.0 - peak.share) * grid + F::splat(peak.share) * peak.density(map),
        }
    }

    /// World directions for numbers of the grid, and their densities.
    #[inline(always)]
    fn sample_grid<F: Num>(&self, frame: &Frame, u: [F; 2]) -> ([F; 3], F) {
        let sample = SampleGrid { shaded: self, frame, u, mixed: true };
        let FromGrid { mut world, mut pdf, strayed, .. } = F::apart(sample);
        settle_lanes(u, strayed, &mut world, &mut pdf, |u| self.settled(frame, u));
        (world, pdf)
    }

    /// The sample of numbers of the grid, settled.
    #[cold]
    #[inline(never)]
    fn settled(&self, frame: &Frame, u: [f32; 2]) -> Drawn {
        let ([cell], numbers) = self.cells::<f32>(u);
        let (wi, located) = self.light.settle(frame, cell, numbers);
        Drawn { wi, pdf: self.with_lobes(frame, wi, self.grid(&located)) }
    }

    /// The densities of world directions for those of the grid.
    #[inline(always)]
    fn with_lobes<F: Num>(&self, frame: &Frame, world: [F; 3], grid: F) -> F {
        if self.product.peak.is_none() {
            return grid;
        }
        let (map, _) = self.light.valid(frame, world);
        self.mixed(map, grid)
    }

    /// World directions for numbers of the narrow lobes, and their densities.
    #[inline(always)]
    fn sample_peak<F: Num>(&self, frame: &Frame, peak: &Peak, u: [F; 2]) -> ([F; 3], F) {
        let world = to_world(frame, peak.sample(u));
        let pdf = self.pdf(frame, world);
        // Rounding may lose a direction at the very border of a lobe: of such numbers, a few of 2^24, the grid makes something.
        let mut lost = F::bits(pdf.le(F::splat(0.0)));
        if lost == 0 {
            return (world, pdf);
        }
        let (mut lanes, u) = ([world[0].store(), world[1].store(), world[2].store(), pdf.store()], u.map(F::store));
        while lost != 0 {
            let lane = lost.trailing_zeros() as usize;
            lost &= lost - 1;
            let of = |lanes: &F::Floats| lanes.as_ref().get(lane).copied().unwrap_or(0.0);
            let ([x, y, z], pdf) = self.regain(frame, [of(&u[0]), of(&u[1])]);
            for (lanes, x) in lanes.iter_mut().zip([x, y, z, pdf]) {
                put(lanes.as_mut(), lane, x);
            }
        }
        let [x, y, z, pdf] = lanes.map(F::load);
        ([x, y, z], pdf)
    }

    /// What the grid makes of numbers.
    #[cold]
    #[inline(never)]
    fn regain(&self, frame: &Frame, u: [f32; 2]) -> ([f32; 3], f32) {
        self.sample_grid::<f32>(frame, u)
    }

    /// The `u` that leads to a world direction of unit length, through the grid: as [`Light::invert`].
    pub fn invert(&self, frame: &Frame, wi: [f32; 3]) -> Inverted {
        let (map, _) = self.light.valid(frame, wi);
        let (density, located) = self.find::<f32>(map);
        if !(density > 0.0) {
            return Inverted::Zero;
        }
        let peak = self.product.peak.map_or(0.0, |peak| peak.share);
        let [cell] = located.patch.cell;
        let outer = |numbers: [f32; 2]| {
            let [w, v] = self.outer(cell, numbers);
            [min(peak + (1.0 - peak) * w, ONE_MINUS_EPSILON), v]
        };
        let leads = |u: &[f32; 2]| {
            let grid = (u[0] - peak) / (1.0 - peak);
            if !(grid >= 0.0) {
                return false;
            }
            let (cells, numbers) = self.cells::<f32>([min(grid, ONE_MINUS_EPSILON), u[1]]);
            located.is_in_patch_of(&self.light.sample_in::<f32>(cells, numbers))
        };
        inward(located.numbers(&self.light), located.middle(), outer, leads)
    }

    /// The numbers of the grid that lead to numbers (w, v) of a cell: the inverse of [`Shaded::cells`].
    fn outer(&self, cell: u32, [w, v]: [f32; 2]) -> [f32; 2] {
        let leaf = self.leaf_at(cell, [w, v]);
        let [a, b, c, d] = self.words(leaf.at).map(|word| decode_wide(word.into()));
        let shape = PatchDensity::new([a, b, c, d], Profiles { down: None, across: None });
        let mut u = shape.invert([(w - leaf.start[0]) / leaf.width[0], (v - leaf.start[1]) / leaf.width[1]]);
        if let Some(number) = self.divided(cell) {
            let part = leaf.at[0] as usize - self.light.cells.len() / GROUP;
            let part = [part % PARTS, part / PARTS % PARTS];
            let within = |first: usize, part: usize, u: f32| {
                let ends = self.ends(number, first);
                let start = if part == 0 { 0.0 } else { ends[(part - 1) % PARTS] };
                (start + u * (ends[part] - start)) / ends[PARTS - 1]
            };
            u = [within(PARTS * (1 + part[1]), part[0], u[0]), within(0, part[1], u[1])];
        }
        let tops = &self.product.tops;
        let [columns, rows] = self.product.header.grid.map(|n| (n as usize).max(1));
        let (row, column) = (cell as usize / columns, cell as usize % columns);
        let line = rows + 1 + row * (columns + 1);
        let within = |first: usize, index: usize, last: usize, u: f32| {
            let ([start, end, ..], [total, ..]) = (*tops.window(first + index), *tops.window(first + last));
            min((start + u * (end - start)) / total, ONE_MINUS_EPSILON)
        };
        [within(line, column, columns, u[0]), within(0, row, rows, u[1])]
    }
}

impl Density for Shaded<'_> {
    #[inline(always)]
    fn sample<F: Num>(&self, frame: &Frame, u: [F; 2]) -> ([F; 3], F) {
        let u = [clamp_u(u[0]), clamp_u(u[1])];
        let Some(peak) = &self.product.peak else { return self.sample_grid(frame, u) };
        let from_peak = u[0].lt(F::splat(peak.share));
        let lanes = F::bits(from_peak);
        if lanes == 0 {
            return self.sample_grid(frame, [of_grid(peak.share, u[0]), u[1]]);
        }
        let drawn = self.sample_peak(frame, peak, [of_peak(peak.share, u[0]), u[1]]);
        if lanes.count_ones() as usize == F::WIDTH {
            return drawn;
        }
        let other = self.sample_grid(frame, [of_grid(peak.share, u[0]), u[1]]);
        let select = |k: usize| F::select(from_peak, drawn.0[k], other.0[k]);
        ([select(0), select(1), select(2)], F::select(from_peak, drawn.1, other.1))
    }

    /// Numbers that draw from narrow lobes and those that draw from the grid fill lanes of their own.
    #[inline(always)]
    fn samples<F: Num>(&self, frame: &Frame, u: &[[f32; 2]], out: &mut [Drawn]) {
        let share = self.product.peak.map_or(0.0, |peak| peak.share);
        for (u, out) in u.chunks(TOGETHER).zip(out.chunks_mut(TOGETHER)) {
            let count = u.len().min(out.len());
            let (mut order, mut behind_grid, mut peak) = ([0u8; TOGETHER], 0, count);
            for (number, &[first, _]) in (0..).zip(u).take(count) {
                let place = if clamp_u(first) < share {
                    peak -= 1;
                    peak
                } else {
                    behind_grid += 1;
                    behind_grid - 1
                };
                put(&mut order, place, number);
            }
            let mut first = 0;
            while first < count {
                let from_peak = first >= behind_grid;
                let end = (first + F::WIDTH).min(if from_peak { count } else { behind_grid });
                let lanes = order.get(first..end).unwrap_or(&[]);
                first = end;
                let (mut across, mut down) = (F::floats(), F::floats());
                // Lanes that are left over draw the same once more: nothing that another lane does not do, too.
                for lane in 0..F::WIDTH {
                    let number = lanes.get(lane).or(lanes.first()).copied().unwrap_or(0);
                    let [x, y] = u.get(usize::from(number)).copied().unwrap_or_default();
                    put(across.as_mut(), lane, x);
                    put(down.as_mut(), lane, y);
                }
                let (across, down) = (clamp_u(F::load(across)), clamp_u(F::load(down)));
                let (wi, pdf) = match &self.product.peak {
                    Some(peak) if from_peak => self.sample_peak(frame, peak, [of_peak(share, across), down]),
                    peak => {
                        let across = if peak.is_some() { of_grid(share, across) } else { across };
                        self.sample_grid(frame, [across, down])
                    }
                };
                let (x, y, z, pdf) = (wi[0].store(), wi[1].store(), wi[2].store(), pdf.store());
                let drawn = x.as_ref().iter().zip(y.as_ref()).zip(z.as_ref()).zip(pdf.as_ref());
                for (&number, (((&x, &y), &z), &pdf)) in lanes.iter().zip(drawn) {
                    put(out, number.into(), Drawn { wi: [x, y, z], pdf });
                }
            }
        }
    }

    #[inline(always)]
    fn pdf<F: Num>(&self, frame: &Frame, wi: [F; 3]) -> F {
        F::apart(Pdf { shaded: self, frame, wi })
    }
}

struct SampleGrid<'a, F: Num> {
    shaded: &'a Shaded<'a>,
    frame: &'a Frame,
    u: [F; 2],
    /// Whether densities are those of the product; else those of its grid alone.
    mixed: bool,
}

/// What numbers of the grid lead to.
struct FromGrid<F: Num> {
    world: [F; 3],
    pdf: F,
    /// The density in the light.
    light: F,
    /// The lanes that rounding carried out of their patch.
    strayed: u32,
}

impl<F: Num> Apart<F> for SampleGrid<'_, F> {
    type Output = FromGrid<F>;

    #[inline(always)]
    fn run(self) -> FromGrid<F> {
        let SampleGrid { shaded, frame, u, mixed } = self;
        let (cells, numbers) = shaded.cells(u);
        let (world, located, strayed) = shaded.light.to_world(frame, &shaded.light.sample_in::<F>(cells, numbers));
        let grid = shaded.grid(&located);
        let pdf = if mixed { shaded.with_lobes(frame, world, grid) } else { grid };
        FromGrid { world, pdf, light: shaded.light.alone(&located), strayed }
    }
}

struct Pdf<'a, F: Num> {
    shaded: &'a Shaded<'a>,
    frame: &'a Frame,
    wi: [F; 3],
}

impl<F: Num> Apart<F> for Pdf<'_, F> {
    type Output = F;

    #[inline(always)]
    fn run(self) -> F {
        let (map, valid) = self.shaded.light.valid(self.frame, self.wi);
        F::only(valid, self.shaded.find(map).0)
    }
}

/// Directions whose numbers are put in order together.
const TOGETHER: usize = 64;

/// The number of narrow lobes that a first number stands for which draws from them.
#[inline(always)]
fn of_peak<F: Num>(share: f32, u: F) -> F {
    (u * (1.0 / share)).min(F::splat(ONE_MINUS_EPSILON))
}

/// The number of the grid that any other stands for.
#[inline(always)]
fn of_grid<F: Num>(share: f32, u: F) -> F {
    ((u - share) * (1.0 / (1.0 - share))).max(F::splat(0.0)).min(F::splat(ONE_MINUS_EPSILON))
}

/// The leaf of a whole cell.
#[inline(always)]
fn whole(cell: u32) -> [u32; 2] {
    [cell / GROUP as u32, cell % GROUP as u32]
}

/// The position of a number between two ends.
#[inline(always)]
fn rest(number: f32, [start, end]: [f32; 2]) -> f32 {
    crate::light::search::inside(number, start, (end - start).max(f32::MIN_POSITIVE)).max(0.0)
}

#[inline(always)]
fn put<T: Copy>(lanes: &mut [T], lane: usize, x: T) {
    if let Some(out) = lanes.get_mut(lane) {
        *out = x;
    }
}
