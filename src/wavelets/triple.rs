//! Triple product integrals: of BRDF x light x visibility over a square, from their wavelets.
//!
//! Ng et al. 2004, "Triple Product Wavelet Integrals for All-Frequency Relighting", Section 5. Wavelets of one square
//! meet in three ways: all three differ (the signs multiply to 1), or two are equal and the third function is constant on
//! the square, where it has the average that the paper calls a parent sum. In value space (coefficients times 2^level)
//! there are no other factors than the area of the square. Averages are what our trees store, so parent sums cost
//! nothing. [`integral`] visits the squares of the paper's linear algorithm, but sums products of averages where no two
//! functions vary any more: the sum of what wavelets add cancels, and may be below 0 where the product is 0 everywhere.

use crate::numeric::{inverse_power, is_float};
use crate::status::{Result, Status};
use crate::wavelets::combine::WIS_MAX_BLEND;
use crate::wavelets::morton::MAX_DEPTH;
use crate::wavelets::tree::{Spot, Tree};
use core::ops::{Add, Mul};

/// The wavelets of a square that an approximation keeps. Approximations are lists of these, depth first: by position,
/// and squares before those inside them.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wavelets {
    /// The Morton code of the square's first pixel among 4096 x 4096 (axis 1 in the higher bit of each pair).
    pub position: u32,
    /// The square has the width 2^-level.
    pub level: u32,
    /// The details 1 (axis 2), 2 (axis 1) and 3 (both) in value space, 2^level times the orthonormal coefficients; 0 for
    /// those that were dropped.
    pub detail: [f32; 3],
}

impl Wavelets {
    /// What comes first in depth-first order.
    pub(crate) fn key(&self) -> (u32, u32) {
        (self.position, self.level)
    }

    pub(crate) fn details(&self) -> [f64; 3] {
        self.detail.map(f64::from)
    }
}

/// Bits of a position below those of a level.
pub(crate) fn shift(level: u32) -> u32 {
    (2 * MAX_DEPTH.saturating_sub(level)) & 31
}

/// Whether a list is in order, of squares on the grid, with numbers.
pub fn is_ordered(list: &[Wavelets]) -> bool {
    disorder(list).is_none()
}

/// The first element of a list that is not on the grid, no number, or not behind the one before it.
pub fn disorder(list: &[Wavelets]) -> Option<usize> {
    let on_grid = |w: &Wavelets| {
        let inside = u64::from(w.position) < 1 << (2 * MAX_DEPTH) && w.level < MAX_DEPTH;
        inside
            && w.position.trailing_zeros().min(2 * MAX_DEPTH) >= shift(w.level)
            && w.detail.iter().all(|d| d.is_finite())
    };
    let mut before = None;
    list.iter().position(|w| {
        let behind = before.is_none_or(|last| last < w.key());
        before = Some(w.key());
        !behind || !on_grid(w)
    })
}

/// A function on a square: its average and its details.
pub(crate) type Square = [f64; 4];

/// That function from the averages of the children: detail f is the mean of (-1)^popcount(f & c) times the average of child c.
#[inline]
pub fn analyse(children: [f64; 4]) -> Square {
    butterfly(children).map(|sum| sum / 4.0)
}

/// The averages of the children from a function on a square.
#[inline]
pub(crate) fn butterfly([a, b, c, d]: Square) -> [f64; 4] {
    let (low, high) = ([a + b, a - b], [c + d, c - d]);
    [low[0] + high[0], low[1] + high[1], low[0] - high[0], low[1] - high[1]]
}

/// What the wavelets of a square add to the integral of three functions, each its average and its details, but for the
/// square's area: one product for each order of three different ones, and for each wavelet that two functions share the
/// average of the third. 21 multiplications and 14 additions; the paper's form has 34 and 24. Generic, so that a test can
/// count them.
#[inline(always)]
pub fn meet<T: Copy + Add<Output = T> + Mul<Output = T>>(p: [T; 4], l: [T; 4], v: [T; 4]) -> T {
    let different =
        p[1] * (l[2] * v[3] + l[3] * v[2]) + p[2] * (l[1] * v[3] + l[3] * v[1]) + p[3] * (l[1] * v[2] + l[2] * v[1]);
    let shared = |a: [T; 4], b: [T; 4]| a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    different + p[0] * shared(l, v) + l[0] * shared(p, v) + v[0] * shared(p, l)
}

fn area(level: u32) -> f64 {
    f64::from(inverse_power(2 * level))
}

/// A square during a walk through three trees.
#[derive(Clone, Copy)]
struct Visit {
    spots: [Spot; 3],
    level: u32,
}

impl Visit {
    /// Whether wavelets of two functions may meet here or below.
    fn is_shared(&self) -> bool {
        self.level < MAX_DEPTH && self.spots.iter().filter(|spot| spot.varies()).count() >= 2
    }

    /// Adds the integral over this square, on which no two functions vary.
    fn add(&self, sum: &mut f64) {
        let [a, b, c] = self.spots.map(|spot| f64::from(spot.average));
        *sum += area(self.level) * (a * b * c);
    }

    /// Adds the integral over this square. Recursion ends at the finest level.
    fn add_below(&self, trees: [&Tree<4>; 3], sum: &mut f64) {
        let [p, l, v] = [0, 1, 2].map(|k: usize| trees[k].all_below(self.spots[k]));
        let children = [0, 1, 2, 3].map(|c: usize| Visit { spots: [p[c], l[c], v[c]], level: self.level + 1 });
        children.iter().rev().filter(|child| !child.is_shared()).for_each(|child| child.add(sum));
        children.iter().filter(|child| child.is_shared()).for_each(|child| child.add_below(trees, sum));
    }
}

/// The integral over the unit square of the product of three trees. One visit of each square that two of them keep; on its
/// children that no two keep, the product of averages is exact. No term is negative, so the relative error is that of the
/// stored averages, 3 2^-24 at most.
pub fn integral(trees: [&Tree<4>; 3]) -> f64 {
    let mut sum = 0.0;
    match (Visit { spots: trees.map(Tree::root), level: 0 }) {
        root if root.is_shared() => root.add_below(trees, &mut sum),
        root => root.add(&mut sum),
    }
    sum
}

/// A function's averages on the children of a square.
fn averages(square: Square) -> [f64; 4] {
    let sign = |f: u32, c: u32| if (f & c).count_ones() % 2 == 1 { -1.0 } else { 1.0 };
    let value = |c| square[0] + (sign(1, c) * square[1] + sign(2, c) * square[2] + sign(3, c) * square[3]);
    [0, 1, 2, 3].map(value)
}

/// Averages over nested squares, as the sublinear algorithm asks for them. Of two kinds, whose code is the same.
pub trait Quadtree {
    /// The whole square.
    fn root(&self) -> Spot;
    /// Child `c` of a spot.
    fn below(&self, spot: Spot, c: u32) -> Spot;
    /// The averages of the children of a square.
    fn children(&self, square: u32) -> [f32; 4];
}

impl Quadtree for Tree<'_, 4> {
    fn root(&self) -> Spot {
        Tree::root(self)
    }

    fn below(&self, spot: Spot, c: u32) -> Spot {
        Tree::below(self, spot, c)
    }

    fn children(&self, square: u32) -> [f32; 4] {
        Tree::children(self, square)
    }
}

/// Looks up a function on squares that come in depth-first order: the way down to the last one is kept, and only what
/// differs is walked again.
struct Cursor<'a> {
    tree: &'a dyn Quadtree,
    /// The spot at each level of the way.
    way: [Spot; MAX_DEPTH as usize + 1],
    last: Wavelets,
}

impl<'a> Cursor<'a> {
    fn new(tree: &'a dyn Quadtree) -> Self {
        Cursor { tree, way: [tree.root(); MAX_DEPTH as usize + 1], last: Wavelets::default() }
    }

    fn look_up(&mut self, wavelets: &Wavelets) -> Square {
        let differing = u32::BITS - (wavelets.position ^ self.last.position).leading_zeros();
        let common = (MAX_DEPTH - differing.div_ceil(2).min(MAX_DEPTH)).min(self.last.level).min(wavelets.level);
        let mut spot = self.way.get(common as usize).copied().unwrap_or(Spot::NOWHERE);
        for level in common..wavelets.level {
            if spot.varies() {
                spot = self.tree.below(spot, wavelets.position >> shift(level + 1) & 3);
            }
            if let Some(slot) = self.way.get_mut(level as usize + 1) {
                *slot = spot;
            }
        }
        self.last = *wavelets;
        if spot.varies() {
            return analyse(self.tree.children(spot.square).map(f64::from));
        }
        [spot.average.into(), 0.0, 0.0, 0.0]
    }
}

/// An approximation in the units of the input: its details times `scale` are those of a stored tree.
#[derive(Clone, Copy, Debug)]
pub struct Scaled<'a> {
    /// In order.
    pub wavelets: &'a [Wavelets],
    /// A power of two.
    pub scale: f64,
}

/// The integral with approximations of BRDF and light: the sublinear algorithm. Wavelets of the BRDF meet the exact light
/// and visibility; light and visibility that share a wavelet meet the approximate BRDF, for the wavelets of the light
/// that are kept. Exact if nothing was dropped. Costs a few steps down the trees for each square that is kept.
///
/// Both lists in order ([`is_ordered`]); `average` is that of the BRDF over the square.
pub fn sublinear(
    average: f64,
    brdf: &[Wavelets],
    kept_light: Scaled,
    light: &dyn Quadtree,
    visible: &dyn Quadtree,
) -> f64 {
    let mut sum = average * f64::from(light.root().average) * f64::from(visible.root().average);
    let (mut of_light, mut of_visible) = (Cursor::new(light), Cursor::new(visible));
    for wavelets in brdf {
        let v = of_visible.look_up(wavelets);
        // Half of all squares lie below the horizon.
        if v == [0.0; 4] {
            continue;
        }
        let l = of_light.look_up(wavelets);
        let [a, b, c] = wavelets.details();
        sum += area(wavelets.level) * meet([0.0, a, b, c], l, v);
    }
    let mut above = Ancestors::new(average, brdf, averages);
    let mut of_visible = Cursor::new(visible);
    for wavelets in kept_light.wavelets {
        let [_, a, b, c] = of_visible.look_up(wavelets);
        if [a, b, c] == [0.0; 3] {
            continue;
        }
        let parents = above.average_on(wavelets.key()) * kept_light.scale;
        let [l1, l2, l3] = wavelets.details();
        sum += area(wavelets.level) * parents * (l1 * a + l2 * b + l3 * c);
    }
    sum
}

/// The averages of an approximation on squares that come in depth-first order: lazy parent sums without a table.
pub(crate) struct Ancestors<'a> {
    average: f64,
    rest: &'a [Wavelets],
    /// The squares of the approximation that hold the present one, and the averages of their children.
    stack: [((u32, u32), [f64; 4]); MAX_DEPTH as usize],
    depth: usize,
    split: fn(Square) -> [f64; 4],
}

impl<'a> Ancestors<'a> {
    /// `split` gives the averages of the children of a square.
    pub(crate) fn new(average: f64, list: &'a [Wavelets], split: fn(Square) -> [f64; 4]) -> Self {
        Ancestors { average, rest: list, stack: [((0, 0), [0.0; 4]); MAX_DEPTH as usize], depth: 0, split }
    }

    /// The average on a square.
    fn average_on(&mut self, key: (u32, u32)) -> f64 {
        while let Some((next, rest)) = self.rest.split_first().filter(|(next, _)| next.key() < key) {
            self.rest = rest;
            let ([a, b, c], average) = (next.details(), self.value(next.key()));
            let children = (self.split)([average, a, b, c]);
            if let Some(slot) = self.stack.get_mut(self.depth) {
                (*slot, self.depth) = ((next.key(), children), self.depth + 1);
            }
        }
        self.value(key)
    }

    /// The averages on the children of a square.
    pub(crate) fn below(&mut self, key: (u32, u32)) -> [f64; 4] {
        let average = self.average_on(key);
        let [a, b, c] = self.rest.first().filter(|w| w.key() == key).map_or([0.0; 3], Wavelets::details);
        (self.split)([average, a, b, c])
    }

    /// The average on a square, after those that do not hold it have left the stack.
    #[inline(never)]
    fn value(&mut self, (position, level): (u32, u32)) -> f64 {
        while let Some((top, children)) = self.depth.checked_sub(1).and_then(|top| self.stack.get(top)) {
            if top.1 < level && (position ^ top.0) >> shift(top.1) == 0 {
                return children[(position >> shift(top.1 + 1) & 3) as usize];
            }
            self.depth -= 1;
        }
        self.average
    }
}

/// The weighted sum of approximations, each in order, as one in order: interpolation between tabulated BRDFs, wavelet by
/// wavelet. Writes it to `out` as far as there is room, and answers how many squares it has.
///
/// # Errors
/// [`Status::Overflow`] for a sum that is no float.
pub fn blend(lists: &[&[Wavelets]], weights: &[f64], out: &mut [Wavelets]) -> Result<usize> {
    let mut rest = [&[] as &[Wavelets]; WIS_MAX_BLEND];
    rest.iter_mut().zip(lists.iter().zip(weights)).for_each(|(rest, (list, _))| *rest = list);
    let mut count = 0;
    while let Some(next) = rest.iter().filter_map(|list| list.first()).min_by_key(|next| next.key()).copied() {
        let mut detail = [0.0f64; 3];
        for (list, weight) in rest.iter_mut().zip(weights) {
            let Some((first, behind)) = list.split_first().filter(|(first, _)| first.key() == next.key()) else {
                continue;
            };
            detail.iter_mut().zip(first.details()).for_each(|(sum, d)| *sum += weight * d);
            *list = behind;
        }
        if !detail.iter().all(|d| is_float(*d)) {
            return Err(Status::Overflow);
        }
        if let Some(slot) = out.get_mut(count) {
            *slot = Wavelets { detail: detail.map(|d| d as f32), ..next };
        }
        count += 1;
    }
    Ok(count)
}
