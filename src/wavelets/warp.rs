//! The warp of uniform points into the distribution that a tree stores: sample, pdf and invert of one point,
//! and the in-place warp of a whole batch.
//!
//! Clarberg et al. 2005, "Wavelet Importance Sampling", Section 4.2 and Fig. 5: each square splits its points
//! in one axis after another by the masses of the halves. Every split is an increasing bijection, so is the
//! whole warp; its Jacobian is 1 / pdf, and well-spread points stay well spread.

use crate::numeric::{max, min};
use crate::status::{Result, Status};
use crate::wavelets::split::Splits;
pub use crate::wavelets::split::{ONE_MINUS_EPSILON, Split, clamp_u};
use crate::wavelets::tree::{MAX_DEPTH, Tree};

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

/// A point of the unit cube and its density with respect to the cube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<const N: usize> {
    /// Coordinates in [0, 1), axis 1 first.
    pub point: [f32; N],
    /// The density there; its integral over the cube is 1.
    pub pdf: f32,
}

/// Warps `u` (clamped by [`clamp_u`]) into the distribution. `None` if the whole has no mass.
pub fn sample<const C: usize, const N: usize>(tree: &Tree<C>, u: [f32; N]) -> Option<Sample<N>> {
    const { assert!(C == 1 << N, "a square of n axes has 2^n children") };
    if !(tree.average() > 0.0) {
        return None;
    }
    let (point, pdf) = descend(tree, tree.root_square(), Cell::UNIT, u.map(clamp_u));
    Some(Sample { point, pdf })
}

/// Warps the point at offset `u` inside `cell`, whose node is `node`: the point of the cube, and its density times
/// the volume of the cell over the probability of the cell.
#[inline]
fn descend<const C: usize, const N: usize>(
    tree: &Tree<C>,
    node: Option<u32>,
    cell: Cell<N>,
    u: [f32; N],
) -> ([f32; N], f32) {
    let (mut node, mut cell, mut u, mut pdf) = (node, cell, u, 1.0);
    while let (Some(here), true) = (node, cell.level < tree.depth()) {
        let child = Splits::new(tree.children(here)).take(&mut u, &mut pdf);
        cell = cell.child(child);
        node = tree.child_square(here, child);
    }
    (cell.place(u, tree.depth()), pdf)
}

/// The density at a point, coordinates clamped by [`clamp_u`]: the bits that [`sample`] returns with it.
pub fn pdf<const C: usize, const N: usize>(tree: &Tree<C>, point: [f32; N]) -> f32 {
    const { assert!(C == 1 << N, "a square of n axes has 2^n children") };
    if !(tree.average() > 0.0) {
        return 0.0;
    }
    let depth = tree.depth();
    let cells = point.map(|y| locate(clamp_u(y), depth).0);
    let mut pdf = 1.0;
    let mut node = tree.root_square();
    for level in 0..depth {
        let Some(here) = node else { break };
        let child = child_of(cells, depth - 1 - level);
        Splits::new(tree.children(here)).multiply_density::<N>(child, &mut pdf);
        node = tree.child_square(here, child);
    }
    pdf
}

/// The u that [`sample`] warps to `point` (coordinates clamped by [`clamp_u`]), within (16 + 2^depth P) 2^-24 in an
/// axis whose split probabilities on the way have the product P.
///
/// # Errors
/// [`Status::ZeroDensity`] where the density is 0.
pub fn invert<const C: usize, const N: usize>(tree: &Tree<C>, point: [f32; N]) -> Result<[f32; N]> {
    let point = point.map(clamp_u);
    if pdf(tree, point) <= 0.0 {
        return Err(Status::ZeroDensity);
    }
    let depth = tree.depth();
    let cells = point.map(|y| locate(y, depth).0);
    let mut path = [None; MAX_DEPTH as usize];
    let mut leaf_level = 0;
    let mut node = tree.root_square();
    for (level, step) in (0..depth).zip(&mut path) {
        let Some(here) = node else { break };
        let child = child_of(cells, depth - 1 - level);
        *step = Some((here, child));
        node = tree.child_square(here, child);
        leaf_level = level + 1;
    }
    let mut u = point.map(|y| locate(y, leaf_level).1);
    for (here, child) in path.iter().rev().flatten() {
        Splits::new(tree.children(*here)).undo(*child, &mut u);
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
pub fn warp_in_place<const C: usize, const N: usize>(
    tree: &Tree<C>,
    points: &mut [[f32; N]],
    index: &mut [u32],
) -> Result<()> {
    const { assert!(C == 1 << N, "a square of n axes has 2^n children") };
    if points.len() != index.len() {
        return Err(Status::InvalidArgument);
    }
    if !(tree.average() > 0.0) {
        return Err(Status::ZeroDensity);
    }
    points.iter_mut().flatten().for_each(|u| *u = clamp_u(*u));
    warp_square(tree, tree.root_square(), Cell::UNIT, Batch { points, index });
    Ok(())
}

/// Warps the points of one square; recursion ends at the depth of the tree, at most 12 squares deep.
fn warp_square<const C: usize, const N: usize>(tree: &Tree<C>, node: Option<u32>, cell: Cell<N>, batch: Batch<N>) {
    let (here, Batch { mut points, mut index }) = match (node, batch.points.len()) {
        (Some(here), 2..) if cell.level < tree.depth() => (here, batch),
        _ => return warp_points(tree, node, cell, batch.points),
    };
    let counts = split_square(tree, here, Batch { points: &mut *points, index: &mut *index });
    for (child, &count) in (0..).zip(&counts) {
        let (own_points, other_points) = points.split_at_mut_checked(count).unwrap_or_default();
        let (own_index, other_index) = index.split_at_mut_checked(count).unwrap_or_default();
        (points, index) = (other_points, other_index);
        if count > 0 {
            let own = Batch { points: own_points, index: own_index };
            warp_square(tree, tree.child_square(here, child), cell.child(child), own);
        }
    }
}

/// Warps points of a square one by one: a single point goes down alone, and where the density is constant all stay.
#[inline(never)]
fn warp_points<const C: usize, const N: usize>(
    tree: &Tree<C>,
    node: Option<u32>,
    cell: Cell<N>,
    points: &mut [[f32; N]],
) {
    match points {
        [point] => *point = descend(tree, node, cell, *point).0,
        points => points.iter_mut().for_each(|point| *point = cell.place(*point, tree.depth())),
    }
}

/// Splits the points of a square axis by axis, so that those of one child stand together, in the order of children. Answers how many
/// each child has. Not inlined: of its stack nothing is left while the children are warped.
#[inline(never)]
fn split_square<const C: usize, const N: usize>(
    tree: &Tree<C>,
    here: u32,
    Batch { points, index }: Batch<N>,
) -> [usize; C] {
    let splits = Splits::new(tree.children(here));
    // Of each part how many points it has; parts double with each axis.
    let mut counts = [0; C];
    if let Some(all) = counts.first_mut() {
        *all = points.len();
    }
    for axis in 0..N {
        let (mut points, mut index, before) = (&mut *points, &mut *index, counts);
        for (part, &count) in before.iter().enumerate().take(1 << axis) {
            let (own_points, other_points) = points.split_at_mut_checked(count).unwrap_or_default();
            let (own_index, other_index) = index.split_at_mut_checked(count).unwrap_or_default();
            (points, index) = (other_points, other_index);
            let half = (1 << axis) + part;
            let lower = split(Batch { points: own_points, index: own_index }, splits.at(half), axis);
            for (side, count) in [lower, count.wrapping_sub(lower)].into_iter().enumerate() {
                if let Some(out) = counts.get_mut(2 * part + side) {
                    *out = count;
                }
            }
        }
    }
    counts
}

/// Points and what they were numbered before.
struct Batch<'b, const N: usize> {
    points: &'b mut [[f32; N]],
    index: &'b mut [u32],
}

/// Moves the points of the lower side before those of the upper one, each at its place inside its side. Answers how many are below.
fn split<const N: usize>(Batch { points, index }: Batch<N>, split: Split, axis: usize) -> usize {
    let mut lower = 0;
    for next in 0..points.len() {
        let Some(&point) = points.get(next) else { break };
        let (side, inside) = split.take(point.get(axis).copied().unwrap_or(0.0));
        let point = core::array::from_fn(|a| if a == axis { inside } else { point[a] });
        replace(points, next, lower, point);
        if let Some(&number) = index.get(next) {
            replace(index, next, lower, number);
        }
        lower += 1 - side as usize;
    }
    lower
}

/// Puts `item` at `to`, and what stood there at `from`.
#[inline(always)]
fn replace<T: Copy>(items: &mut [T], from: usize, to: usize, item: T) {
    if let Some(displaced) = items.get_mut(to).map(|slot| core::mem::replace(slot, item)) {
        if let (true, Some(slot)) = (from != to, items.get_mut(from)) {
            *slot = displaced;
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
