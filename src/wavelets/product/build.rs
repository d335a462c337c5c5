//! Building a product: which cells to refine. Up to eight are split side by side.

use super::base::{BASE, Base, bounded, level_of_base};
use super::cells::{Batch, COLUMNS, Cell, NEAR, Room, Scratch};
use super::peak::{Narrow, is_narrow};
use super::weigh::{Eight, Families, Floors, leaf_weight, worth};
use super::{LEAF, Node};
use crate::numeric::{exp2i, inverse_power, max};
use crate::sphere::{Frame, cell_chord, square};
use crate::status::{Result, Status};
use crate::wavelets::lanes::sphere::direction_in;
use crate::wavelets::lanes::vector::{V3, splat};
use crate::wavelets::lanes::{LANES, Lanes};
use crate::wavelets::lobe::{Asked, Brdf, MAX_PEAKS, Peak};
use crate::wavelets::tree::{MAX_DEPTH, NO_SQUARE, Tree};
use crate::wavelets::wide::ALL;

/// What a build may spend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Inner nodes, at least 1.
    pub squares: u32,
    /// BRDF evaluations besides those that a narrow lobe's peak asks for; 0: what the BRDF deserves.
    pub evaluations: u32,
}

impl Budget {
    /// What is spent if the caller does not say.
    pub const DEFAULT: Budget = Budget { squares: 128, evaluations: 0 };

    /// The evaluations, chosen: the base and so many rounds of eight splits.
    fn evaluations(&self, rounds: u32) -> u32 {
        if self.evaluations > 0 { self.evaluations } else { BASE as u32 + rounds * (LANES * NEW) as u32 }
    }
}

/// Splits that the peaks of narrow lobes may cause.
const PEAK_SPLITS: u32 = 64;
/// Refinement stops where a split would lower the variance of a sample's weight by less than this.
const TOLERANCE: f32 = 1e-4;
/// New values that a split needs.
const NEW: usize = 5;

/// What a build made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Built {
    /// Inner nodes.
    pub squares: u32,
    /// Inner nodes of the base.
    pub base: u32,
    /// BRDF evaluations.
    pub evaluations: u32,
    /// The stored values of the BRDF are its own times `2^-exponent`.
    pub exponent: i32,
}

/// A build in progress.
pub struct Builder<'a, 'c, B: Brdf> {
    pub light: Tree<'a, 4>,
    pub floors: Floors<'a>,
    brdf: &'a mut B,
    pub to: &'a mut Scratch<'c>,
    /// The squares of the base, and all.
    pub base: u32,
    pub squares: u32,
    /// The squares and evaluations that may be made.
    pub budget: Budget,
    evaluations: u32,
    /// Whether cells may be left that are too coarse for a peak.
    is_coarse: bool,
    /// What was spent when all peaks were resolved.
    spent_on_peaks: u32,
    /// Values are multiplied by this power of two before they are stored.
    pub scale: f32,
    /// The average product over all leaves.
    pub total: f32,
}

/// Builds a product, but for the averages of its squares ([`Scratch::finish`]).
///
/// # Errors
/// [`Status::MemoryTooSmall`] if there is less room than [`Room`] tells for the budget,
/// [`Status::CallbackFailed`] if the BRDF gives a value that is NaN, infinite or negative.
#[inline(always)]
pub fn build<F: Lanes, B: Brdf>(
    light: Tree<'_, 4>,
    frame: &Frame,
    brdf: &mut B,
    budget: Budget,
    scratch: &mut Scratch,
) -> Result<Built> {
    let room = Room::new(budget.squares).ok_or(Status::Overflow)?;
    if budget.squares == 0 || !scratch.fits(room) {
        return Err(Status::MemoryTooSmall);
    }
    let peaks = brdf.peaks();
    let base = Base::evaluate::<F, B>(frame, brdf, &peaks)?;
    if !(light.average() > 0.0 && brdf.may_reflect()) {
        return Ok(Built { evaluations: base.evaluations, ..Built::default() });
    }
    let mut builder = Builder::new((light, frame, brdf), scratch, &base, &peaks, budget);
    builder.start::<F>(&base);
    builder.refine::<F>()?;
    let Builder { squares, base: base_squares, evaluations, .. } = builder;
    Ok(Built { squares, base: base_squares, evaluations, exponent: base.exponent })
}

impl<'a, 'c, B: Brdf> Builder<'a, 'c, B> {
    #[inline(always)]
    fn new(
        (light, frame, brdf): (Tree<'a, 4>, &'a Frame, &'a mut B),
        to: &'a mut Scratch<'c>,
        base: &Base,
        peaks: &[Option<Peak>; MAX_PEAKS],
        budget: Budget,
    ) -> Self {
        // The mean of the base may underflow for very narrow lobes: the second term keeps the floor positive, since
        // the BRDF may well be above 0 between the directions of the base.
        let least = max(base.mean * (1.0 / 1024.0), exp2i(-40) as f32);
        let hemisphere = brdf.hemisphere();
        let squares = budget.squares;
        let all = peaks.iter().flatten().zip(base.peaks());
        let narrow = all.filter(|(peak, _)| is_narrow(peak, level_of_base(squares)));
        let mut peaks = [None; MAX_PEAKS];
        for (slot, (peak, value)) in peaks.iter_mut().zip(narrow) {
            let place = square(frame.to_map(peak.direction));
            *slot = Some(Narrow { peak: *peak, value, place });
        }
        let evaluations = budget.evaluations(brdf.rounds());
        Builder {
            light,
            floors: Floors { frame, hemisphere, least, peaks },
            brdf,
            to,
            base: 0,
            squares: 0,
            budget: Budget { squares, evaluations },
            evaluations: base.evaluations,
            is_coarse: peaks[0].is_some(),
            spent_on_peaks: base.evaluations,
            scale: exp2i(-base.exponent) as f32,
            total: 0.0,
        }
    }

    /// Splits cells as long as that is worth it.
    #[inline(always)]
    fn refine<F: Lanes>(&mut self) -> Result<()> {
        loop {
            let batch = self.next::<F>();
            if batch.count == 0 {
                return Ok(());
            }
            let parents = Parents::load(self, &batch);
            let new = self.evaluate::<F>(&batch, &parents)?;
            self.split(&batch, &parents, new);
        }
    }

    /// Whether any cell of the base may be split.
    pub fn goes_on(&self) -> bool {
        let affordable = self.floors.has_peaks() || self.budget.evaluations >= (BASE + NEW) as u32;
        affordable && self.base < self.budget.squares
    }

    /// The numbers in use, of leaves and of the squares among them.
    pub fn used(&self) -> usize {
        (4 * self.squares + 1 - self.base) as usize
    }

    #[inline(always)]
    fn child_square(&self, square: u32, c: u32) -> u32 {
        if square == NO_SQUARE { NO_SQUARE } else { self.light.child_square(square, c).unwrap_or(NO_SQUARE) }
    }

    /// The next cells to split: those about a narrow lobe's peak until they are finer than the lobe, then those that
    /// are worth most, until the budget or the gain runs out.
    #[inline(always)]
    fn next<F: Lanes>(&mut self) -> Batch {
        if !self.goes_on() {
            return Batch::default();
        }
        if self.is_coarse {
            let room = self.budget.squares.min(self.base + PEAK_SPLITS).saturating_sub(self.squares);
            let batch = self.to.coarse::<F>(self.used(), room as usize);
            if batch.count > 0 {
                self.spent_on_peaks = self.evaluations + (batch.count * NEW) as u32;
                return batch;
            }
            self.is_coarse = false;
        }
        let spent = self.evaluations - self.spent_on_peaks + BASE as u32;
        let affordable = self.budget.evaluations.saturating_sub(spent) / NEW as u32;
        let affordable = affordable.min(self.budget.squares - self.squares);
        // Nine splits are better chosen as five and then four than as eight and then one.
        let rounds = affordable.div_ceil(LANES as u32).max(1);
        self.to.most_valuable::<F>(self.used(), TOLERANCE * self.total, affordable.div_ceil(rounds) as usize)
    }

    /// Evaluates the five new points of each cell of a batch.
    #[inline(always)]
    fn evaluate<F: Lanes>(&mut self, batch: &Batch, parents: &Parents<F>) -> Result<New<F>> {
        let [x, y] = parents.index;
        let mut wi = [Asked { wi: splat([0.0; 3]), lanes: batch.lanes() }; NEW];
        for (asked, [i, j]) in wi.iter_mut().zip([[1.0, 0.0], [1.0, 2.0], [0.0, 1.0], [2.0, 1.0], [1.0, 1.0]]) {
            let s = [(x + x + F::splat(i)) * parents.half, (y + y + F::splat(j)) * parents.half];
            asked.wi = direction_in(self.floors.frame, s);
        }
        let mut f_cos = [F::splat(0.0); NEW];
        self.brdf.eval(&wi, &mut f_cos)?;
        self.evaluations += (batch.count * NEW) as u32;
        for f in &mut f_cos {
            *f = bounded(*f * F::splat(self.scale));
        }
        Ok(New { wi: wi.map(|asked| asked.wi), f_cos })
    }

    /// Makes squares of the cells of a batch.
    #[inline(always)]
    fn split<F: Lanes>(&mut self, batch: &Batch, parents: &Parents<F>, New { wi, f_cos }: New<F>) {
        let residuals = residuals(parents.corners, f_cos);
        let families =
            if parents.near & parents.lanes != 0 { Some(Families::new(&self.floors, wi, parents.half)) } else { None };
        let mut weights = [F::splat(0.0); 4];
        for (c, weight) in (0u32..).zip(&mut weights) {
            let children = self.weigh(parents, families.as_ref(), f_cos, residuals, c);
            self.put_children(batch, &children);
            *weight = children.weight;
        }
        let [a, b, c, d] = weights;
        let before = parents.weight * F::splat(4.0);
        let change = F::only(F::mask(parents.lanes), (((a + b) + (c + d)) - before) * parents.half * parents.half);
        self.total += sum_of_lanes(change.to_array());
        self.put_squares(batch, parents, F::rows(weights));
    }

    /// Weighs the `c`-th children.
    #[inline(always)]
    fn weigh<F: Lanes>(
        &self,
        parents: &Parents<F>,
        families: Option<&Families<F>>,
        new: [F; NEW],
        residuals: [F; NEW],
        c: u32,
    ) -> Children<F> {
        let all = |number: u32| F::index([number; LANES]);
        let [x, y] = parents.index;
        let cells = Eight {
            corners: corners_of_child(parents.corners, new, c),
            index: [x + x + F::splat((c >> 1) as f32), y + y + F::splat((c & 1) as f32)],
            width: parents.half,
            chord: parents.chord,
            lanes: parents.lanes,
            near: parents.near,
            centres: None,
        };
        let raised = self.floors.raise(&cells, families.map(|families| (families, c)));
        let squares = F::index(self.squares_of_children(parents, c));
        let light = parents.light[c as usize & 3];
        let mut quarters = F::gather(self.light.squares(), squares);
        // Squares are fewer than 2^31, and NO_SQUARE is more.
        let constant = F::highest_bits(squares);
        if constant != 0 {
            let constant = F::mask(constant);
            for quarter in &mut quarters {
                *quarter = F::select(constant, light, *quarter);
            }
        }
        let beyond = residuals_of_child(residuals, c);
        let worth = F::only(F::mask(parents.divisible), worth(raised.corners, beyond, light, parents.half));
        let coarse = F::mask(raised.coarse & parents.divisible);
        let near = F::select_index(F::mask(raised.near), all(NEAR), all(0));
        let above = F::add_index(parents.above, F::select_index(parents.lit, all(c), all(0)));
        let index = F::add_index(parents.place, all(next_index(0, c)));
        Children {
            c,
            corners: cells.corners,
            raised: raised.corners,
            place: [squares, above, index, parents.level].map(F::with_bits),
            light,
            weight: leaf_weight(raised.corners, quarters),
            near: F::with_bits(near),
            priority: F::select(coarse, worth.copysign(F::splat(-1.0)), worth),
        }
    }

    /// The node of the square that the cell in a lane becomes.
    #[inline(always)]
    fn node_of(&self, lane: usize) -> u32 {
        4 * (self.squares + lane as u32) + 1
    }

    /// Writes one child of each cell of a batch: the first where its parent stood, the others behind their square.
    #[inline(always)]
    fn put_children<F: Lanes>(&mut self, batch: &Batch, children: &Children<F>) {
        let c = children.c;
        let slots = F::index([0, 1, 2, 3, 4, 5, 6, 7].map(|lane| 4 * self.node_of(lane) + c));
        let (values, places) = (F::rows(children.raised), F::rows(children.place));
        let corners = F::rows(children.corners);
        let rest = F::rows([children.light, children.weight, children.near, F::with_bits(slots)]);
        let priorities = children.priority.to_array();
        for (lane, parent) in batch.iter() {
            let number = if c == 0 { parent } else { (self.node_of(lane) + c - self.base) as usize };
            let lane = lane & (LANES - 1);
            // Row by row: what is put together elsewhere and then copied waits for its own parts.
            if let Some(node) = self.to.nodes.get_mut(number + self.base as usize) {
                node.values = values[lane];
                node.links = places[lane].map(f32::to_bits);
            }
            if let Some(cell) = self.to.cells.get_mut(number) {
                cell.corners = corners[lane];
                cell.rest = rest[lane];
            }
            if let Some(priority) = self.to.priorities.get_mut(number) {
                *priority = priorities[lane];
            }
        }
    }

    /// Writes the squares that a batch becomes, links them, and clears the priorities behind all that is in use.
    #[inline(always)]
    fn put_squares<F: Lanes>(&mut self, batch: &Batch, parents: &Parents<F>, weights: [[f32; 4]; LANES]) {
        for (lane, number) in batch.iter() {
            let (place, slot) = (self.node_of(0), parents.slots[lane & (LANES - 1)]);
            let children = [number as u32 + self.base, place + 1, place + 2, place + 3];
            if let Some(node) = self.to.nodes.get_mut(place as usize) {
                node.values = weights[lane & (LANES - 1)];
                node.links = children.map(|child| child | LEAF);
            }
            if let Some(above) = self.to.nodes.get_mut(slot as usize / 4) {
                above.links[slot as usize & 3] = place;
            }
            if let Some(to) = self.to.slots.get_mut(self.squares as usize) {
                *to = slot;
            }
            if let Some(priority) = self.to.priorities.get_mut((place - self.base) as usize) {
                *priority = 0.0;
            }
            self.squares += 1;
        }
        let used = self.used();
        if let Some(rest) = self.to.priorities.get_mut(used..used + COLUMNS) {
            rest.fill(0.0);
        }
    }

    /// The environment's squares for the `c`-th children.
    #[inline(always)]
    fn squares_of_children<F: Lanes>(&self, parents: &Parents<F>, c: u32) -> [u32; LANES] {
        if parents.in_heap {
            parents.squares.map(|square| square.wrapping_mul(4).wrapping_add(1 + c))
        } else {
            parents.squares.map(|square| self.child_square(square, c))
        }
    }
}

/// The index of child `c` of a cell, both axes in one number.
fn next_index(index: u32, c: u32) -> u32 {
    2 * index + (c >> 1 & 1) + ((c & 1) << 16)
}

/// A sum in a fixed order.
pub fn sum_of_lanes([a, b, c, d, e, f, g, h]: [f32; LANES]) -> f32 {
    ((a + b) + (c + d)) + ((e + f) + (g + h))
}

/// The new points of eight cells and their values: the middles of the edges at the lower and upper end of axis 2, at the
/// lower and upper end of axis 1, and the centres.
struct New<F> {
    wi: [V3<F>; NEW],
    f_cos: [F; NEW],
}

/// Cells that are about to be split, one in each lane.
struct Parents<F: Lanes> {
    /// The lanes in use, those that lie near a peak, and those whose children may be split, as bits.
    lanes: u32,
    near: u32,
    divisible: u32,
    corners: [F; 4],
    weight: F,
    index: [F; 2],
    /// The width of a child, and the largest distance from its centre.
    half: F,
    chord: F,
    /// The light of each child.
    light: [F; 4],
    squares: [u32; LANES],
    /// Whether the squares of all children stand in heap order.
    in_heap: bool,
    /// [`Node::light`] of the first children; that of the others is larger by their number in the lanes that are lit.
    above: F::Index,
    lit: F::Mask,
    /// The index of the first children in one number, and the level of all.
    place: F::Index,
    level: F::Index,
    /// [`Cell::slot`].
    slots: [u32; LANES],
}

impl<F: Lanes> Parents<F> {
    #[inline(always)]
    fn load<B: Brdf>(builder: &Builder<B>, batch: &Batch) -> Self {
        let (mut cells, mut leaves) = ([&Cell::NOTHING; LANES], [&Node::ROOT; LANES]);
        for (lane, number) in batch.iter() {
            let lane = lane & (LANES - 1);
            cells[lane] = builder.to.cells.get(number).unwrap_or(&Cell::NOTHING);
            leaves[lane] = builder.to.nodes.get(number + builder.base as usize).unwrap_or(&Node::ROOT);
        }
        let [squares, light_above, index, level] = [0, 1, 2, 3].map(|k: usize| leaves.map(|leaf| leaf.links[k & 3]));
        let level = level.map(|level| level.wrapping_add(1));
        let inner = builder.light.heap().saturating_sub(1) / 4;
        let in_heap = squares.iter().fold(true, |all, &square| all & (square < inner));
        let (mut above, mut lit) = (squares.map(|square| square.wrapping_mul(4)), ALL);
        let mut light = F::gather(builder.light.squares(), F::index(squares));
        if squares.contains(&NO_SQUARE) {
            for lane in (0..LANES).filter(|&lane| squares[lane & (LANES - 1)] == NO_SQUARE) {
                above[lane & (LANES - 1)] = light_above[lane & (LANES - 1)];
                lit &= !(1 << lane);
            }
            let whole = F::from_array(cells.map(|cell| cell.light()));
            for quarter in &mut light {
                *quarter = F::select(F::mask(lit), *quarter, whole);
            }
        }
        let near = if builder.floors.has_peaks() {
            cells.iter().rev().fold(0, |bits, cell| bits << 1 | cell.near())
        } else {
            0
        };
        let (x, y) = (index.map(|index| (index & 0xffff) as f32), index.map(|index| (index >> 16) as f32));
        let index = F::index(index);
        Parents {
            lanes: batch.lanes(),
            near,
            divisible: F::bits(F::below(F::index(level), MAX_DEPTH)) & batch.lanes(),
            corners: F::transpose(cells.map(|cell| &cell.corners)),
            weight: F::from_array(cells.map(|cell| cell.weight())),
            index: [F::from_array(x), F::from_array(y)],
            half: F::from_array(level.map(inverse_power)),
            chord: F::from_array(level.map(cell_chord)),
            light,
            squares,
            in_heap,
            above: F::index(above),
            lit: F::mask(lit),
            place: F::add_index(index, index),
            level: F::index(level),
            slots: cells.map(|cell| cell.slot()),
        }
    }
}

/// One child of each of eight cells.
struct Children<F> {
    c: u32,
    corners: [F; 4],
    /// The corners, not below the floor; 0 if a cell is wholly below the horizon.
    raised: [F; 4],
    /// The links of a leaf.
    place: [F; 4],
    light: F,
    weight: F,
    /// [`Cell::near`].
    near: F,
    priority: F,
}

/// The corners of child `c` from its parent's corners and five new values.
#[inline(always)]
fn corners_of_child<F: Lanes>(corners: [F; 4], new: [F; NEW], c: u32) -> [F; 4] {
    let [c00, c01, c10, c11] = corners;
    let [low2, high2, low1, high1, centre] = new;
    match c & 3 {
        0 => [c00, low1, low2, centre],
        1 => [low1, c01, centre, high2],
        2 => [low2, centre, c10, high1],
        _ => [centre, high2, high1, c11],
    }
}

/// The largest residual at a corner of child `c`.
#[inline(always)]
fn residuals_of_child<F: Lanes>(residuals: [F; NEW], c: u32) -> F {
    let [a, b, d, e] = corners_of_child([F::splat(0.0); 4], residuals, c);
    a.max(b).max(d.max(e))
}

/// How far the five new values are from the bilinear function of the corners.
#[inline(always)]
fn residuals<F: Lanes>(corners: [F; 4], new: [F; NEW]) -> [F; NEW] {
    let [c00, c01, c10, c11] = corners;
    let (half, quarter) = (F::splat(0.5), F::splat(0.25));
    let [a, b, c, d, e] = new;
    [
        (a - half * (c00 + c10)).abs(),
        (b - half * (c01 + c11)).abs(),
        (c - half * (c00 + c01)).abs(),
        (d - half * (c10 + c11)).abs(),
        (e - quarter * ((c00 + c01) + (c10 + c11))).abs(),
    ]
}
