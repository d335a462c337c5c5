//! Sample, pdf and invert of a product over its light.
//!
//! The density is F over the light's numbers, times the light's density, over F's integral. As for the light, the pdf is one
//! function of the f32 world direction, and a sample's pdf is that function at the direction that it returns.

use super::peak::Peak;
use super::stored::{Product, QUADS, QUADS_OF_DIVIDED, QUADS_OF_PARTS, Quad, STORED_ONE, WORDS, mean, tops};
use crate::light::batch::{Density, write_lanes};
use crate::light::density::{Inverted, clamp_u, inward, lane_of, settle_lanes};
use crate::light::guide::ROUNDING;
use crate::light::parts::PARTS;
use crate::light::search::inside;
use crate::light::tables::{Light, Located, decoded};
use crate::light::warp::{PatchDensity, Profiles};
use crate::numeric::{ONE_MINUS_EPSILON, min};
use crate::sample::Sample;
use crate::simd::{Apart, GROUP, Num, Whole};
use crate::sphere::Frame;

/// A product with the light that it was prepared for.
#[derive(Clone, Copy, Debug)]
pub struct Shaded<'a> {
    /// The light.
    pub light: &'a Light<'a>,
    /// The product.
    pub product: Product<'a>,
    /// Its narrow lobes.
    pub(super) peak: Option<Peak<'a>>,
}

/// Where F is bilinear, in lanes: cells, or parts of some.
#[derive(Clone, Copy)]
struct Leaf<F: Num> {
    /// Pairs of corner words: of the upper and of the lower row.
    words: [F::Whole; 2],
    /// Where the leaves begin in the cells' numbers (w, v), and where they end.
    start: [F; 2],
    end: [F; 2],
}

/// Which lanes lie in divided cells, and the numbers of those.
type Divided<F> = (<F as Num>::Mask, <F as Num>::Whole);

impl<F: Num> Leaf<F> {
    #[inline(always)]
    fn shape(&self) -> PatchDensity<F> {
        let ([a, b], [c, d]) = (decoded::<F>(F::ints_of(self.words[0])), decoded::<F>(F::ints_of(self.words[1])));
        PatchDensity::new([a, b, c, d], Profiles { down: None, across: None })
    }

    /// Whether all leaves hold the numbers (w, v) of their cells.
    #[inline(always)]
    fn holds(&self, numbers: [F; 2]) -> bool {
        let along = |k: usize| F::and(self.start[k].le(numbers[k]), numbers[k].lt(self.end[k]));
        F::bits(F::and(along(0), along(1))) == (1 << F::WIDTH) - 1
    }

    #[inline(always)]
    fn width(&self, k: usize) -> F {
        self.end[k] - self.start[k]
    }
}

/// Which of four running sums a number falls before, and the range that ends with it. `before`: the sum before the first.
#[inline(always)]
fn find<F: Num>([a, b, c, d]: [F; 4], before: F, number: F) -> (F, [F; 2]) {
    let one = F::splat(1.0);
    let (behind_a, behind_b, behind_c) = (a.le(number), b.le(number), c.le(number));
    if F::WIDTH == 1 {
        // Sums never fall: it is looked up.
        let index = F::bits(behind_a) + F::bits(behind_b) + F::bits(behind_c);
        let ends = [before, a, b, c, d];
        let place = index as usize % 4;
        return (F::splat(index as f32), [ends[place], ends[place + 1]]);
    }
    let index = F::only(behind_a, one) + F::only(behind_b, one) + F::only(behind_c, one);
    let start = F::select(behind_c, c, F::select(behind_b, b, F::select(behind_a, a, before)));
    let end = F::select(behind_c, d, F::select(behind_b, c, F::select(behind_a, b, a)));
    (index, [start, end])
}

/// Which of the running sums at a place a share of the last falls before; and, in the lanes of a mask, what is left of it.
#[inline(always)]
fn pick<F: Num>(all: &[Quad], place: F::Whole, u: F, mask: F::Mask) -> (F, F) {
    let sums = F::rows(all, place);
    let number = u * sums[3];
    let (index, range) = find(sums, F::splat(0.0), number);
    (index, F::select(mask, rest(number, range), u))
}

/// Where a part begins and ends, for the borders between four.
#[inline(always)]
fn part_range<F: Num>([a, b, c]: [F; 3], index: F) -> [F; 2] {
    let (behind_a, behind_b, behind_c) = (F::splat(1.0).le(index), F::splat(2.0).le(index), F::splat(3.0).le(index));
    let start = F::select(behind_c, c, F::select(behind_b, b, F::only(behind_a, a)));
    [start, F::select(behind_c, F::splat(1.0), F::select(behind_b, c, F::select(behind_a, b, a)))]
}

/// The position of a number in a range.
#[inline(always)]
fn rest<F: Num>(number: F, [start, end]: [F; 2]) -> F {
    inside(number, start, (end - start).max(F::splat(f32::MIN_POSITIVE))).max(F::splat(0.0))
}

/// Sums of whole numbers in lanes.
#[inline(always)]
fn plus<F: Num>(a: F::Whole, b: usize) -> F::Whole {
    a + F::Whole::splat(b as u32)
}

impl<'a> Shaded<'a> {
    /// A product of a light, ready to draw from.
    #[inline(always)]
    pub fn new(light: &'a Light<'a>, product: Product<'a>) -> Shaded<'a> {
        let mut shaded = Shaded { light, product, peak: None };
        if product.header.peak > 0.0 {
            shaded.peak = Some(Peak::of(product.header));
        }
        shaded
    }

    /// The integral of the light's colour x luminance of BRDF x cosine, from the colours and the power of the light.
    pub fn colour(&self, colours: &[[f32; 3]]) -> [f32; 3] {
        let mut sum = [0.0f64; 3];
        for (cell, colour) in (0..).zip(colours) {
            let (leaf, divided) = self.cell::<f32>(f32::whole([cell]));
            let divided = divided.and_then(|(_, number)| self.product.divided().get(f32::ints_of(number)[0] as usize));
            // What all parts of a cell have in the mean stands behind the last of its rows.
            let mean = match divided {
                Some(divided) => divided.ends[0][PARTS - 1],
                None => mean(leaf.words.map(|words| f32::ints_of(words)[0])),
            };
            let mean = f64::from(mean / STORED_ONE);
            for (sum, &c) in sum.iter_mut().zip(colour) {
                *sum += mean * f64::from(c);
            }
        }
        let scale = self.product.header.unit * f64::from(STORED_ONE) * self.light.power;
        let largest = f64::from(f32::MAX);
        // Of a light that was changed and signed again a colour may be anything.
        sum.map(|c| c * scale).map(|c| if c.is_nan() { 0.0 } else { c.clamp(-largest, largest) as f32 })
    }

    /// The words of leaves behind quad `first`, for the places of their upper words among all.
    #[inline(always)]
    fn words<F: Num>(&self, first: usize, place: F::Whole) -> [F::Whole; 2] {
        let place = plus::<F>(place.shl::<1>(), WORDS * first);
        [F::pairs(self.product.words, place), F::pairs(self.product.words, plus::<F>(place, 2 * GROUP))]
    }

    /// The leaves of cells, and of the lanes whose cells are divided the numbers of those among the divided ones; `None` if none is.
    #[inline(always)]
    fn cell<F: Num>(&self, cell: F::Whole) -> (Leaf<F>, Option<Divided<F>>) {
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        // Groups have as many lower words.
        let words = self.words::<F>(0, cell + (cell & F::Whole::splat(!(GROUP as u32 - 1))));
        let leaf = Leaf { words, start: [zero; 2], end: [one; 2] };
        let number = F::of_whole(words[0].shr::<16>());
        let marked = F::of_whole(words[0] & F::Whole::splat(0xffff)).le(zero);
        let divided = F::and(marked, zero.lt(number));
        let number = F::only(divided, number - one).to_whole();
        (leaf, if F::bits(divided) == 0 { None } else { Some((divided, number)) })
    }

    /// Borders of parts.
    #[inline(always)]
    fn borders<F: Num>(&self, place: F::Whole) -> [F; 3] {
        let place = plus::<F>(place.shl::<2>(), WORDS * self.product.places.borders);
        let (low, high) = (F::pairs(self.product.words, place), F::pairs(self.product.words, plus::<F>(place, 2)));
        // None is negative.
        let number = |step: F::Whole| F::of_whole(step & F::Whole::splat(0xffff)) * ROUNDING;
        [number(low), number(low.shr::<16>()), number(high)]
    }

    /// The leaves of parts (column, row) of divided cells.
    #[inline(always)]
    fn part<F: Num>(&self, number: F::Whole, [column, row]: [F; 2], [columns, rows]: [[F; 3]; 2]) -> Leaf<F> {
        let part = (row * PARTS as f32 + column).to_whole();
        // Words are pairs of those that a quad counts. Groups have as many lower ones.
        let place = number * F::Whole::splat((WORDS / 2 * QUADS_OF_DIVIDED) as u32)
            + part
            + (part & F::Whole::splat(GROUP as u32));
        let ([left, right], [top, bottom]) = (part_range(columns, column), part_range(rows, row));
        Leaf { words: self.words::<F>(self.product.places.divided, place), start: [left, top], end: [right, bottom] }
    }

    /// `a` in the lanes of a mask, elsewhere `b`.
    #[inline(always)]
    fn either<F: Num>(mask: F::Mask, a: &Leaf<F>, b: &Leaf<F>) -> Leaf<F> {
        let word = |k: usize| F::select(mask, F::from_bits(a.words[k]), F::from_bits(b.words[k])).to_bits();
        let (start, end) =
            (|k: usize| F::select(mask, a.start[k], b.start[k]), |k: usize| F::select(mask, a.end[k], b.end[k]));
        Leaf { words: [word(0), word(1)], start: [start(0), start(1)], end: [end(0), end(1)] }
    }

    /// The cells that `u` leads to, the leaves in them, and what is left of `u`.
    #[inline(always)]
    fn search<F: Num>(&self, [across, down]: [F; 2]) -> (F::Whole, Leaf<F>, [F; 2]) {
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let Product { header, quads: all, places, .. } = self.product;
        let [rows, quads, _] = tops(header.grid);
        let of_rows = all.get(places.tops..places.tops + rows).unwrap_or(&[]);
        let (last, before) = of_rows.split_last().unwrap_or((&[0.0; 4], &[]));
        let number = down * last[3];
        let (mut quad, mut start) = (zero, zero);
        for &[.., end] in before {
            let behind = F::splat(end).le(number);
            quad = quad + F::only(behind, one);
            start = F::select(behind, F::splat(end), start);
        }
        let (row, range) = find(F::rows(of_rows, quad.to_whole()), start, number);
        let (mut row, mut v) = (quad * 4.0 + row, rest(number, range));
        let mut place = row;
        let mut number = across;
        if quads > 0 {
            let sums = F::rows(all, plus::<F>(row.to_whole(), places.tops + rows));
            number = across * sums[3];
            let (quad, [start, _]) = find(sums, zero, number);
            (place, number) = (row * 4.0 + quad, number - start);
        }
        let sums = F::rows(all, plus::<F>(place.to_whole(), places.tops + rows + quads));
        // Below the sum, or the number would fall into a cell without weight behind the last one with some.
        number = (if quads > 0 { number } else { across * sums[3] }).min(sums[3] * ONE_MINUS_EPSILON);
        let (column, range) = find(sums, zero, number);
        let (cell, mut w) = ((place * 4.0 + column).to_whole(), rest(number, range));
        let (leaf, divided) = self.cell::<F>(cell);
        let Some((divided, number)) = divided else { return (cell, leaf, [w, v]) };
        let first = plus::<F>(number * F::Whole::splat(QUADS_OF_DIVIDED as u32), places.divided + QUADS_OF_PARTS);
        let column;
        (row, v) = pick(all, first, v, divided);
        let of_row = plus::<F>(row.to_whole(), 1);
        (column, w) = pick(all, first + of_row, w, divided);
        let first = number * F::Whole::splat(QUADS as u32);
        let borders = [self.borders::<F>(first + of_row), self.borders::<F>(first)];
        (cell, Self::either(divided, &self.part(number, [column, row], borders), &leaf), [w, v])
    }

    /// The numbers of cells that numbers in [0, 1 - 2^-24]^2 lead to, and the leaves that they lie in but for rounding.
    #[inline(always)]
    fn cells<F: Num>(&self, u: [F; 2]) -> (F::Ints, [F; 2], Leaf<F>) {
        let (cell, leaf, left) = self.search(u);
        let inside = leaf.shape().sample(left);
        let last = F::splat(ONE_MINUS_EPSILON);
        let at = |k: usize| (leaf.start[k] + inside[k] * leaf.width(k)).min(last);
        (F::ints_of(cell), [at(0), at(1)], leaf)
    }

    /// One by one many need it.
    #[inline(never)]
    fn cells_apart<F: Num>(&self, u: [F; 2]) -> (F::Ints, [F; 2], Leaf<F>) {
        self.cells(u)
    }

    /// The density of located directions by the grid. `near`: leaves that may hold them.
    #[inline(always)]
    fn grid<F: Num>(&self, located: &Located<F>, near: Option<&Leaf<F>>) -> F {
        let numbers = located.numbers;
        let leaf = match near.filter(|near| near.holds(numbers)) {
            Some(near) => *near,
            None => F::apart(LeafAt(self, F::whole(located.cell), numbers)),
        };
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let at = |k: usize| ((numbers[k] - leaf.start[k]) / leaf.width(k)).max(zero).min(one);
        let inside = [at(0), at(1)];
        leaf.shape().unscaled(inside) * (located.alone * self.product.header.scale)
    }

    /// Directions of map space near those that numbers of the grid, in [0, 1 - 2^-24]^2, lead to, and what [`Shaded::grid_and_light`] answers
    /// for them.
    #[inline(always)]
    pub fn draw_grid<F: Num>(&self, frame: &Frame, u: [F; 2]) -> ([F; 3], (F, F)) {
        let (world, pdf, light, _) = F::apart(GridSample { shaded: self, frame, u, mixed: false });
        (self.light.valid(frame, world).0, (pdf, light))
    }

    /// The densities of directions of map space, of unit length, by the grid and in the light.
    #[inline(always)]
    pub fn grid_and_light<F: Num>(&self, map: [F; 3]) -> (F, F) {
        let located = self.light.locate(map, true);
        (self.grid(&located, None), located.alone)
    }

    /// The density of directions of map space of unit length, and where they are.
    #[inline(always)]
    fn find<F: Num>(&self, map: [F; 3]) -> (F, Located<F>) {
        let located = self.light.locate(map, true);
        (self.mixed(map, self.grid(&located, None)), located)
    }

    /// The density of directions of map space for that of the grid.
    #[inline(always)]
    fn mixed<F: Num>(&self, map: [F; 3], grid: F) -> F {
        match &self.peak {
            None => grid,
            Some(peak) => F::splat(1.0 - peak.share()) * grid + F::splat(peak.share()) * peak.density(map),
        }
    }

    /// World directions for numbers of the grid, and their densities.
    #[inline(always)]
    fn sample_grid<F: Num>(&self, frame: &Frame, u: [F; 2]) -> ([F; 3], F) {
        let (mut world, mut pdf, _, strayed) = F::apart(GridSample { shaded: self, frame, u, mixed: true });
        settle_lanes(strayed, &mut world, &mut pdf, |lane| self.settled(frame, lane_of(u, lane)));
        (world, pdf)
    }

    /// The sample of numbers of the grid, settled.
    #[cold]
    #[inline(never)]
    fn settled(&self, frame: &Frame, u: [f32; 2]) -> Sample {
        let ([cell], numbers, _) = self.cells_apart(u);
        let (wi, located) = self.light.settle(frame, cell, numbers);
        Sample { wi, pdf: self.with_lobes(frame, wi, self.grid(&located, None)) }
    }

    /// The densities of world directions for those of the grid.
    #[inline(always)]
    fn with_lobes<F: Num>(&self, frame: &Frame, world: [F; 3], grid: F) -> F {
        let (map, _) = self.light.valid(frame, world);
        self.mixed(map, grid)
    }

    /// World directions for numbers of the narrow lobes, and their densities.
    #[inline(always)]
    fn sample_peak<F: Num>(&self, frame: &Frame, peak: &Peak<'_>, u: [F; 2]) -> ([F; 3], F) {
        let mut world = frame.to_world(peak.sample(u));
        let mut pdf = self.pdf(frame, world);
        // Rounding may lose a direction at the very border of a lobe: of such numbers, a few of 2^24, the grid makes something.
        let lost = F::bits(pdf.le(F::splat(0.0)));
        settle_lanes(lost, &mut world, &mut pdf, |lane| self.regain(frame, lane_of(u, lane)));
        (world, pdf)
    }

    /// What the grid makes of numbers.
    #[cold]
    #[inline(never)]
    fn regain(&self, frame: &Frame, u: [f32; 2]) -> Sample {
        let (wi, pdf) = self.sample_grid::<f32>(frame, u);
        Sample { wi, pdf }
    }

    /// The `u` that leads to a world direction of unit length, through the grid: as [`Light::invert`].
    pub fn invert(&self, frame: &Frame, wi: [f32; 3]) -> Inverted {
        let (map, _) = self.light.valid(frame, wi);
        let (density, located) = self.find::<f32>(map);
        if !(density > 0.0) {
            return Inverted::Zero;
        }
        let peak = self.peak.map_or(0.0, |peak| peak.share());
        let [cell] = located.cell;
        let outer = |numbers: [f32; 2]| {
            let [w, v] = self.outer(cell, numbers);
            [min(peak + (1.0 - peak) * w, ONE_MINUS_EPSILON), v]
        };
        let leads = |u: &[f32; 2]| {
            let grid = (u[0] - peak) / (1.0 - peak);
            if !(grid >= 0.0) {
                return false;
            }
            let (cells, numbers, _) = self.cells_apart([min(grid, ONE_MINUS_EPSILON), u[1]]);
            located.is_in_patch_of(&self.light.lead::<f32>(frame, cells, numbers, false).1)
        };
        inward(located.numbers, located.middle(), outer, leads)
    }

    /// The numbers of the grid that lead to numbers (w, v) of a cell: the inverse of [`Shaded::cells`].
    fn outer(&self, cell: u32, [w, v]: [f32; 2]) -> [f32; 2] {
        let leaf = f32::apart(LeafAt(self, f32::whole([cell]), [w, v]));
        let mut u = leaf.shape().invert([(w - leaf.start[0]) / leaf.width(0), (v - leaf.start[1]) / leaf.width(1)]);
        let within = |all: &[Quad], place: usize, u: f32| {
            let sums = all.get(place / 4).unwrap_or(&[1.0; 4]);
            let start = if place % 4 == 0 { 0.0 } else { sums[(place - 1) % 4] };
            start + u * (sums[place % 4] - start)
        };
        if let (_, Some((_, number))) = self.cell::<f32>(f32::whole([cell])) {
            let [first] = f32::ints_of(number).map(|number| number as usize * QUADS);
            let part = |borders: [f32; 3], x: f32| borders.iter().filter(|&&border| border <= x).count();
            let of = |place: usize| self.borders::<f32>(f32::whole([place as u32]));
            let row = part(of(first), v);
            let column = part(of(first + 1 + row), w);
            let none = &[[1.0; 4]; QUADS];
            let ends = self.product.divided().get(first / QUADS).map_or(none, |divided| &divided.ends);
            let share =
                |quad: usize, place: usize, u: f32| within(ends, 4 * quad + place, u) / within(ends, 4 * quad + 3, 1.0);
            u = [share(1 + row, column, u[0]), share(0, row, u[1])];
        }
        let all = self.product.tops();
        let [rows, quads, _] = tops(self.product.header.grid);
        let of_row = if quads > 0 { 16 } else { 4 };
        let (row, column) = (cell as usize / of_row, cell as usize % of_row);
        let place = 4 * (rows + quads);
        let mut across = within(all, place + cell as usize, u[0]);
        let mut sum = within(all, (place + cell as usize) | 3, 1.0);
        if quads > 0 {
            let before = within(all, 4 * (rows + row) + column / 4, 0.0);
            (across, sum) = (before + across, within(all, 4 * (rows + row) + 3, 1.0));
        }
        // Of rows the running sum goes on from quad to quad.
        let sum_of = |row: usize| within(all, row, 1.0);
        let before = if row == 0 { 0.0 } else { sum_of(row - 1) };
        let down = before + u[1] * (sum_of(row) - before);
        [min(across / sum, ONE_MINUS_EPSILON), min(down / sum_of(4 * rows - 1), ONE_MINUS_EPSILON)]
    }
}

impl Density for Shaded<'_> {
    #[inline(always)]
    fn sample<F: Num>(&self, frame: &Frame, u: [F; 2]) -> ([F; 3], F) {
        let u = [clamp_u(u[0]), clamp_u(u[1])];
        let Some(peak) = &self.peak else { return self.sample_grid(frame, u) };
        let from_peak = u[0].lt(F::splat(peak.share()));
        let lanes = F::bits(from_peak);
        if lanes == 0 {
            return self.sample_grid(frame, [of_grid(peak.share(), u[0]), u[1]]);
        }
        let drawn = self.sample_peak(frame, peak, [of_peak(peak.share(), u[0]), u[1]]);
        if lanes.count_ones() as usize == F::WIDTH {
            return drawn;
        }
        let other = self.sample_grid(frame, [of_grid(peak.share(), u[0]), u[1]]);
        let select = |k: usize| F::select(from_peak, drawn.0[k], other.0[k]);
        ([select(0), select(1), select(2)], F::select(from_peak, drawn.1, other.1))
    }

    /// Numbers that draw from narrow lobes and those that draw from the grid fill lanes of their own.
    #[inline(always)]
    fn samples<F: Num>(&self, frame: &Frame, u: &[[f32; 2]], out: &mut [Sample]) {
        let share = self.peak.as_ref().map_or(0.0, Peak::share);
        for (u, out) in u.chunks(TOGETHER).zip(out.chunks_mut(TOGETHER)) {
            // Those of the grid from the front on, those of the lobes from the back.
            let (mut order, mut front, mut back) = (IN_ORDER, u.len().min(out.len()), TOGETHER);
            if share > 0.0 {
                front = 0;
                for (number, &[first, _]) in (0..).zip(u).take(out.len()) {
                    let from_peak = usize::from(clamp_u(first) < share);
                    back -= from_peak;
                    put(&mut order, if from_peak > 0 { back } else { front }, number);
                    front += 1 - from_peak;
                }
            }
            let (of_grid_all, of_peak_all) = (order.get(..front).unwrap_or(&[]), order.get(back..).unwrap_or(&[]));
            for lanes in of_grid_all.chunks(F::WIDTH).chain(of_peak_all.chunks(F::WIDTH)) {
                // Lanes that are left over draw the same once more: nothing that another lane does not do, too.
                let (mut across, mut down) = (F::floats(), F::floats());
                for (lane, (across, down)) in across.as_mut().iter_mut().zip(down.as_mut()).enumerate() {
                    let number = lanes.get(lane).or(lanes.first()).copied().unwrap_or(0);
                    [*across, *down] = u.get(usize::from(number)).copied().unwrap_or_default();
                }
                let (across, down) = (clamp_u(F::load(across)), clamp_u(F::load(down)));
                let (wi, pdf) = match &self.peak {
                    Some(peak) if F::bits(across.lt(F::splat(share))) != 0 => {
                        self.sample_peak(frame, peak, [of_peak(share, across), down])
                    }
                    _ => self.sample_grid(frame, [of_grid(share, across), down]),
                };
                write_lanes(wi, pdf, |lane, sample| {
                    if let Some(&number) = lanes.get(lane) {
                        put(out, number.into(), sample);
                    }
                });
            }
        }
    }

    #[inline(always)]
    fn pdf<F: Num>(&self, frame: &Frame, wi: [F; 3]) -> F {
        F::apart(Pdf { shaded: self, frame, wi })
    }
}

/// What numbers of the grid lead to: directions, their densities, those in the light, and the lanes that rounding carried out of their patch.
/// `mixed`: densities are those of the product; else those of its grid alone.
struct GridSample<'a, F> {
    shaded: &'a Shaded<'a>,
    frame: &'a Frame,
    u: [F; 2],
    mixed: bool,
}

impl<F: Num> Apart<F> for GridSample<'_, F> {
    type Output = ([F; 3], F, F, u32);

    #[inline(always)]
    fn run(self) -> Self::Output {
        let GridSample { shaded, frame, u, mixed } = self;
        let (cells, numbers, leaf) = if F::WIDTH == 1 { shaded.cells_apart(u) } else { shaded.cells(u) };
        let (world, located, strayed) = shaded.light.lead::<F>(frame, cells, numbers, true);
        let grid = shaded.grid(&located, Some(&leaf));
        let pdf = if mixed { shaded.with_lobes(frame, world, grid) } else { grid };
        (world, pdf, located.alone, strayed)
    }
}

/// The leaves that hold the numbers (w, v) of cells.
struct LeafAt<'a, F: Num>(&'a Shaded<'a>, F::Whole, [F; 2]);

impl<F: Num> Apart<F> for LeafAt<'_, F> {
    type Output = Leaf<F>;

    #[inline(always)]
    fn run(self) -> Leaf<F> {
        let LeafAt(shaded, cell, [w, v]) = self;
        let (leaf, divided) = shaded.cell::<F>(cell);
        let Some((divided, number)) = divided else { return leaf };
        let one = F::splat(1.0);
        let place = |[a, b, c]: [F; 3], x: F| F::only(a.le(x), one) + F::only(b.le(x), one) + F::only(c.le(x), one);
        let first = number * F::Whole::splat(QUADS as u32);
        let rows = shaded.borders::<F>(first);
        let row = place(rows, v);
        let columns = shaded.borders::<F>(plus::<F>(first, 1) + row.to_whole());
        Shaded::either(divided, &shaded.part(number, [place(columns, w), row], [columns, rows]), &leaf)
    }
}

/// The densities of world directions.
struct Pdf<'a, F> {
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

/// Their numbers.
const IN_ORDER: [u8; TOGETHER] = {
    let mut order = [0; TOGETHER];
    let mut number = 0;
    while number < TOGETHER {
        order[number] = number as u8;
        number += 1;
    }
    order
};

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

#[inline(always)]
fn put<T: Copy>(lanes: &mut [T], lane: usize, x: T) {
    if let Some(out) = lanes.get_mut(lane) {
        *out = x;
    }
}
