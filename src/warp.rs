//! The warp of uniform points into the distribution that a tree stores: sample, pdf and invert of one point,
//! and the in-place warp of a whole batch.
//!
//! Clarberg et al. 2005, "Wavelet Importance Sampling", Section 4.2 and Fig. 5: each square splits its points
//! in one axis after another by the masses of the splits. Every split is an increasing bijection, so is the
//! whole warp; its Jacobian is 1 / pdf, and well-spread points stay well spread.

pub use crate::numeric::ONE_MINUS_EPSILON;
use crate::numeric::{max, min};
use crate::status::{Result, Status};
use crate::tree::{MAX_DEPTH, Tree};

/// No side that has mass is less probable than this, or a 24-bit u of 0 would enter it too often: the clamp
/// makes the probability of such a side the one that it is really sampled with.
const SMALLEST_SPLIT: f32 = 1.0 / 16_777_216.0;

/// `u` moved into [0, 1 - 2^-24]; NaN counts as 1/2.
#[inline]
pub fn clamp_u(u: f32) -> f32 {
    if u.is_nan() { 0.5 } else { min(max(u, 0.0), ONE_MINUS_EPSILON) }
}

/// The probabilities of the two splits of a split. Every sample, pdf and invert of the library decides by it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Split {
    lower: f32,
}

impl Split {
    /// Splits by two masses, each in [0, 2^120]. Both positive: the lower half has the probability
    /// lower / (lower + upper), clamped to [2^-24, 1 - 2^-24]; one of them 0: exactly 0 or 1; both 0: 1/2.
    #[inline(always)]
    pub fn new(lower: f32, upper: f32) -> Split {
        let total = lower + upper;
        let ratio = lower / max(total, f32::from_bits(1));
        let least = if lower > 0.0 { SMALLEST_SPLIT } else { 0.0 };
        let most = if upper > 0.0 { ONE_MINUS_EPSILON } else { 1.0 };
        let neither = if total > 0.0 { 0.0 } else { 0.5 };
        Split { lower: min(max(ratio, least), most) + neither }
    }

    /// The side that `u` in [0, 1 - 2^-24] falls into, 0 = lower and 1 = upper, and its position inside that
    /// side, again in [0, 1 - 2^-24]. A side of probability 0 is never entered.
    #[inline(always)]
    pub fn take(self, u: f32) -> (u32, f32) {
        let side = u32::from(u >= self.lower);
        let offset = u - side as f32 * self.lower;
        (side, min(offset / self.probability(side), ONE_MINUS_EPSILON))
    }

    /// The factor by which the split multiplies the density on a side: twice its probability.
    #[inline(always)]
    pub fn density(self, side: u32) -> f32 {
        2.0 * self.probability(side)
    }

    /// The inverse of [`Split::take`] on a side of positive probability.
    #[inline(always)]
    pub fn undo(self, side: u32, u: f32) -> f32 {
        min(side as f32 * self.lower + u * self.probability(side), ONE_MINUS_EPSILON)
    }

    /// p or 1 - p, exactly, and without a branch: which side is taken cannot be predicted.
    #[inline(always)]
    fn probability(self, side: u32) -> f32 {
        (side as f32 - self.lower).abs()
    }

    /// One of two splits, exactly, and without a branch.
    #[inline(always)]
    fn choose(side: u32, lower: Split, upper: Split) -> Split {
        let b = side as f32;
        Split { lower: (1.0 - b) * lower.lower + b * upper.lower }
    }
}

/// Sends a point of a square into one of its four children and returns the child, the point inside it and the
/// factor of the density. Child `c = 2 b1 + b2`; axis 1 (`u[0]`) splits first.
#[inline(always)]
pub fn take_quad(masses: [f32; 4], u: [f32; 2]) -> (u32, [f32; 2], f32) {
    let mut u = u;
    let mut density = 1.0;
    let child = Splits::new(masses).take(&mut u, &mut density);
    (child, u, density)
}

/// The factor by which the two splits that lead to `child` (0..4) multiply the density: the bits of [`take_quad`].
#[inline(always)]
pub fn quad_density(masses: [f32; 4], child: u32) -> f32 {
    let mut density = 1.0;
    Splits::new(masses).multiply_density::<2>(child, &mut density);
    density
}

/// The inverse of [`take_quad`] for a child (0..4) of positive mass.
#[inline(always)]
pub fn undo_quad(masses: [f32; 4], child: u32, u: [f32; 2]) -> [f32; 2] {
    let mut u = u;
    Splits::new(masses).undo(child, &mut u);
    u
}

/// The coordinate of offset `u` in [0, 1) inside cell `t` of 2^depth cells, rounded so that it stays in the
/// half-open cell (t + u would else round up to the next one).
#[inline]
pub fn place(t: u32, u: f32, depth: u32) -> f32 {
    let width = cell_width(depth);
    let first = t as f32 * width;
    let end = f32::from_bits(((t as f32 + 1.0) * width).to_bits().wrapping_sub(1));
    min(max((t as f32 + u) * width, first), end)
}

/// The cell of 2^depth cells (depth at most 23) that contains coordinate `y` in [0, 1), and the offset inside
/// it: the inverse of [`place`].
#[inline]
pub fn locate(y: f32, depth: u32) -> (u32, f32) {
    let scaled = y * (1u32 << (depth & 31)) as f32;
    let t = scaled as u32;
    (t, scaled - t as f32)
}

fn cell_width(depth: u32) -> f32 {
    1.0 / (1u32 << (depth & 31)) as f32
}

/// What the warp descends: nodes with one mass per child, to a fixed depth. Where a node has no child node the
/// density is constant down to that depth.
pub trait Hierarchy<const C: usize> {
    /// A node with children.
    type Node: Copy;
    /// Cells per axis are 2^depth; at most [`MAX_DEPTH`].
    fn depth(&self) -> u32;
    /// Whether the whole has any mass.
    fn has_mass(&self) -> bool;
    /// The node of the unit cube; `None` where the density is constant.
    fn root(&self) -> Option<Self::Node>;
    /// The masses of the children, each in [0, 2^120], in one unit.
    fn masses(&self, node: Self::Node) -> [f32; C];
    /// The node of child `c`; `None` where the density is constant.
    fn child(&self, node: Self::Node, c: u32) -> Option<Self::Node>;
}

impl<const C: usize> Hierarchy<C> for Tree<'_, C> {
    type Node = u32;

    fn depth(&self) -> u32 {
        Tree::depth(self)
    }

    fn has_mass(&self) -> bool {
        self.average() > 0.0
    }

    fn root(&self) -> Option<u32> {
        self.root_square()
    }

    fn masses(&self, square: u32) -> [f32; C] {
        self.children(square)
    }

    fn child(&self, square: u32, c: u32) -> Option<u32> {
        self.child_square(square, c)
    }
}

/// A point of the unit cube and its density with respect to the cube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<const N: usize> {
    /// Coordinates in [0, 1), axis 1 first.
    pub point: [f32; N],
    /// The density there; its integral over the cube is 1.
    pub pdf: f32,
}

/// Warps `u` (clamped by [`clamp_u`]) into the distribution. `None` if the whole has no mass.
pub fn sample<const C: usize, const N: usize, H: Hierarchy<C>>(hierarchy: &H, u: [f32; N]) -> Option<Sample<N>> {
    const { assert!(C == 1 << N, "a square of n axes has 2^n children") };
    if !hierarchy.has_mass() {
        return None;
    }
    let mut cell = Cell::UNIT;
    let mut u = u.map(clamp_u);
    let mut pdf = 1.0;
    let mut node = hierarchy.root();
    while let (Some(here), true) = (node, cell.level < hierarchy.depth()) {
        let child = Splits::new(hierarchy.masses(here)).take(&mut u, &mut pdf);
        cell = cell.child(child);
        node = hierarchy.child(here, child);
    }
    Some(Sample { point: cell.place(u, hierarchy.depth()), pdf })
}

/// The density at a point, coordinates clamped by [`clamp_u`]: the bits that [`sample`] returns with it.
pub fn pdf<const C: usize, const N: usize, H: Hierarchy<C>>(hierarchy: &H, point: [f32; N]) -> f32 {
    const { assert!(C == 1 << N, "a square of n axes has 2^n children") };
    if !hierarchy.has_mass() {
        return 0.0;
    }
    let depth = hierarchy.depth();
    let cells = point.map(|y| locate(clamp_u(y), depth).0);
    let mut pdf = 1.0;
    let mut node = hierarchy.root();
    for level in 0..depth {
        let Some(here) = node else { break };
        let child = child_of(cells, depth - 1 - level);
        Splits::new(hierarchy.masses(here)).multiply_density::<N>(child, &mut pdf);
        node = hierarchy.child(here, child);
    }
    pdf
}

/// The u that [`sample`] warps to `point` (coordinates clamped by [`clamp_u`]), within 16 eps / (the product of
/// the split probabilities of that axis).
///
/// # Errors
/// [`Status::ZeroDensity`] where the density is 0.
pub fn invert<const C: usize, const N: usize, H: Hierarchy<C>>(hierarchy: &H, point: [f32; N]) -> Result<[f32; N]> {
    let point = point.map(clamp_u);
    if !(pdf(hierarchy, point) > 0.0) {
        return Err(Status::ZeroDensity);
    }
    let depth = hierarchy.depth();
    let cells = point.map(|y| locate(y, depth).0);
    let mut path = [None; MAX_DEPTH as usize];
    let mut leaf_level = 0;
    let mut node = hierarchy.root();
    for (level, step) in (0..depth).zip(&mut path) {
        let Some(here) = node else { break };
        let child = child_of(cells, depth - 1 - level);
        *step = Some((here, child));
        node = hierarchy.child(here, child);
        leaf_level = level + 1;
    }
    let mut u = point.map(|y| locate(y, leaf_level).1);
    for (here, child) in path.iter().rev().flatten() {
        Splits::new(hierarchy.masses(*here)).undo(*child, &mut u);
    }
    Ok(u)
}

/// Warps a batch in place: splits the points of each square by its masses as quicksort does, then goes down with
/// each side. `points` and `index` are permuted alike; as a set, the points are those that [`sample`] gives one by
/// one, to the bit. Afterwards points of one cell stand together.
///
/// # Errors
/// [`Status::InvalidArgument`] if the lengths differ, [`Status::ZeroDensity`] if the whole has no mass; nothing is
/// changed then.
pub fn warp_in_place<const C: usize, const N: usize, H: Hierarchy<C>>(
    hierarchy: &H,
    points: &mut [[f32; N]],
    index: &mut [u32],
) -> Result<()> {
    const { assert!(C == 1 << N, "a square of n axes has 2^n children") };
    if points.len() != index.len() {
        return Err(Status::InvalidArgument);
    }
    if !hierarchy.has_mass() {
        return Err(Status::ZeroDensity);
    }
    points.iter_mut().flatten().for_each(|u| *u = clamp_u(*u));
    warp_square(hierarchy, hierarchy.root(), Cell::UNIT, Batch { points, index });
    Ok(())
}

/// Warps the points of one square; recursion ends at the depth of the hierarchy, at most 12 squares deep.
fn warp_square<const C: usize, const N: usize, H: Hierarchy<C>>(
    hierarchy: &H,
    node: Option<H::Node>,
    cell: Cell<N>,
    batch: Batch<N>,
) {
    if let (Some(here), true) = (node, cell.level < hierarchy.depth()) {
        warp_half(hierarchy, here, &Splits::new(hierarchy.masses(here)), (1, 0), cell, batch);
    } else {
        batch.points.iter_mut().for_each(|point| *point = cell.place(*point, hierarchy.depth()));
    }
}

/// Splits the points of a half (its number in [`Splits`], and the axis to split) until the splits are children.
fn warp_half<const C: usize, const N: usize, H: Hierarchy<C>>(
    hierarchy: &H,
    here: H::Node,
    splits: &Splits<C>,
    (half, axis): (usize, usize),
    cell: Cell<N>,
    batch: Batch<N>,
) {
    if batch.points.is_empty() {
        return;
    }
    if axis == N {
        let child = (half & (C - 1)) as u32;
        return warp_square(hierarchy, hierarchy.child(here, child), cell.child(child), batch);
    }
    let (lower, upper) = batch.split(splits.heap[half & (MAX_CHILDREN - 1)], axis);
    warp_half(hierarchy, here, splits, (2 * half, axis + 1), cell, lower);
    warp_half(hierarchy, here, splits, (2 * half + 1, axis + 1), cell, upper);
}

/// Points and what they were numbered before.
struct Batch<'b, const N: usize> {
    points: &'b mut [[f32; N]],
    index: &'b mut [u32],
}

impl<'b, const N: usize> Batch<'b, N> {
    /// Moves the points of the lower side before those of the upper one, each at its place inside its side.
    fn split(self, split: Split, axis: usize) -> (Batch<'b, N>, Batch<'b, N>) {
        let mut lower = 0;
        let mut upper = self.points.len();
        while lower < upper {
            let Some(u) = self.points.get_mut(lower).and_then(|point| point.get_mut(axis)) else { break };
            let (side, inside) = split.take(*u);
            *u = inside;
            if side == 0 {
                lower += 1;
            } else {
                upper -= 1;
                swap(self.points, lower, upper);
                swap(self.index, lower, upper);
            }
        }
        let (lower_points, upper_points) = self.points.split_at_mut_checked(lower).unwrap_or_default();
        let (lower_index, upper_index) = self.index.split_at_mut_checked(lower).unwrap_or_default();
        (Batch { points: lower_points, index: lower_index }, Batch { points: upper_points, index: upper_index })
    }
}

fn swap<T: Copy>(items: &mut [T], a: usize, b: usize) {
    if let (Some(&first), Some(&second)) = (items.get(a), items.get(b)) {
        if let Some(item) = items.get_mut(a) {
            *item = second;
        }
        if let Some(item) = items.get_mut(b) {
            *item = first;
        }
    }
}

/// The child whose square contains a cell: bit `bit` of each coordinate, axis 1 most significant.
fn child_of<const N: usize>(cells: [u32; N], bit: u32) -> u32 {
    cells.iter().fold(0, |child, t| 2 * child + (t.wrapping_shr(bit) & 1))
}

/// A square of the unit cube.
#[derive(Clone, Copy)]
struct Cell<const N: usize> {
    level: u32,
    translation: [u32; N],
}

impl<const N: usize> Cell<N> {
    const UNIT: Cell<N> = Cell { level: 0, translation: [0; N] };

    #[inline(always)]
    fn child(self, child: u32) -> Cell<N> {
        let mut translation = self.translation;
        for (bit, t) in translation.iter_mut().rev().enumerate() {
            *t = t.wrapping_mul(2) + (child.wrapping_shr(bit as u32) & 1);
        }
        Cell { level: self.level + 1, translation }
    }

    /// The point at offset `u` inside the cell, rounded as a finest cell rounds it: a tree that was pruned
    /// without loss then gives the same bits as the complete one.
    #[inline(always)]
    fn place(self, u: [f32; N], depth: u32) -> [f32; N] {
        let finer = depth.wrapping_sub(self.level) & 31;
        let mut point = u;
        for (y, t) in point.iter_mut().zip(self.translation) {
            let (inner, offset) = locate(*y, finer);
            *y = place(t.wrapping_shl(finer) | inner, offset, depth);
        }
        point
    }
}

/// The splits of a square as a heap: node 1 splits axis 1, and the sides of node `i` are nodes `2 i` and `2 i + 1`,
/// down to child `c`, which is node `C + c`.
#[derive(Clone, Copy)]
struct Splits<const C: usize> {
    heap: [Split; MAX_CHILDREN],
}

const MAX_CHILDREN: usize = 16;

impl<const C: usize> Splits<C> {
    /// All splits at once: their divisions do not wait for one another. Pairwise sums keep equal children at 1/2.
    #[inline(always)]
    fn new(children: [f32; C]) -> Self {
        const { assert!(C <= MAX_CHILDREN) };
        let mut mass = [0.0; 2 * MAX_CHILDREN];
        for (c, child) in children.into_iter().enumerate() {
            mass[C + c] = child;
        }
        let mut heap = [Split { lower: 0.5 }; MAX_CHILDREN];
        for node in (1..C).rev() {
            let (lower, upper) = (mass[2 * node], mass[2 * node + 1]);
            mass[node] = lower + upper;
            heap[node] = Split::new(lower, upper);
        }
        Splits { heap }
    }

    /// The splits of one side of the first axis.
    #[inline(always)]
    fn side(self, side: u32) -> Self {
        let mut heap = self.heap;
        for node in 1..C / 2 {
            let width = 1 << node.ilog2();
            heap[node] = Split::choose(side, self.heap[node + width], self.heap[node + 2 * width]);
        }
        Splits { heap }
    }

    #[inline(always)]
    fn take<const N: usize>(self, u: &mut [f32; N], density: &mut f32) -> u32 {
        let mut splits = self;
        let mut child = 0;
        for u in u {
            let split = splits.heap[1];
            let (side, inside) = split.take(*u);
            *u = inside;
            multiply(density, split.density(side));
            child = 2 * child + side;
            splits = splits.side(side);
        }
        child
    }

    #[inline(always)]
    fn multiply_density<const N: usize>(&self, child: u32, density: &mut f32) {
        for axis in 0..N {
            let (split, side) = self.step::<N>(child, axis);
            multiply(density, split.density(side));
        }
    }

    #[inline(always)]
    fn undo<const N: usize>(&self, child: u32, u: &mut [f32; N]) {
        for (axis, u) in u.iter_mut().enumerate() {
            let (split, side) = self.step::<N>(child, axis);
            *u = split.undo(side, *u);
        }
    }

    /// The split of `axis` on the way to `child`, and the side of the child.
    #[inline(always)]
    fn step<const N: usize>(&self, child: u32, axis: usize) -> (Split, u32) {
        let below = (N - axis) as u32;
        let node = (C + child as usize) >> below;
        (self.heap[node & (MAX_CHILDREN - 1)], (child >> (below - 1)) & 1)
    }
}

/// Multiplies a density by the factor of one split. A chain of improbable splits must not underflow to 0: what
/// can be sampled has a positive pdf.
#[inline(always)]
fn multiply(density: &mut f32, factor: f32) {
    let product = *density * factor;
    let reachable = *density > 0.0 && factor > 0.0;
    *density = if reachable && product < f32::MIN_POSITIVE { f32::MIN_POSITIVE } else { product };
}
