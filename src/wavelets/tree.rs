//! Fixed-depth wavelet trees in the caller's slices: complete pyramids, and sparse trees pruned to an error budget.
//!
//! A kept square stores the averages of its 2^n children instead of 2^n - 1 Haar details: with the parent's
//! average the two say the same, but averages stay exact beside a texel that is 1e9 times brighter.
//!
//! Only whole squares whose parents are kept may be dropped. Dropping single coefficients, as Clarberg et al.
//! 2005 and Ng et al. 2004 print it, turns [4, 0, 0, 0] without its detail 11 into a texel of -1; the expansion
//! over a rooted set of whole squares is the projection onto piecewise constants, so every value is a true
//! average of the function: never negative, and never 0 where the function is not.

use crate::numeric;
use crate::status::{Result, Status};
pub use crate::wavelets::morton::MAX_DEPTH;
use bytemuck::{Pod, Zeroable};

/// Stands for "no square": the function is constant from here on.
pub const NO_SQUARE: u32 = u32::MAX;

/// The largest average that a tree accepts: sums of 16 of them stay finite.
pub const MAX_AVERAGE: f32 = 1.329_228e36;

/// Where the kept children of a square stand.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Link {
    /// The first kept child square; the others follow in child order.
    pub first: u32,
    /// Bit c: child c is kept.
    pub mask: u32,
}

impl Link {
    /// The square of child `c`; `None` if it is not kept.
    #[inline]
    pub fn child(self, c: u32) -> Option<u32> {
        let bit = 1u32.wrapping_shl(c);
        if self.mask & bit == 0 { None } else { self.first.checked_add((self.mask & (bit - 1)).count_ones()) }
    }
}

/// A tree's average on a square, and its own square there if it varies.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Spot {
    /// Or [`NO_SQUARE`].
    pub square: u32,
    /// The average.
    pub average: f32,
}

impl Spot {
    /// No square of any tree.
    pub const NOWHERE: Spot = Spot { square: NO_SQUARE, average: 0.0 };

    /// Whether the tree has a square there.
    #[inline]
    pub fn varies(&self) -> bool {
        self.square != NO_SQUARE
    }
}

/// A function on the unit cube of n axes: averages over nested squares with `C = 2^n` children each.
///
/// Child `c = (b1 .. bn)` in binary, axis 1 most significant, bit 0 = lower half. A child without a square is
/// constant.
#[derive(Clone, Copy, Debug)]
pub struct Tree<'a, const C: usize> {
    depth: u32,
    average: f32,
    squares: &'a [[f32; C]],
    /// A link for each square; none if the tree is complete, with squares in heap order.
    links: &'a [Link],
}

/// The number of squares of a complete tree whose squares have so many children: (C^depth - 1) / (C - 1). `None` if it exceeds 2^32 - 1 or
/// the depth exceeds [`MAX_DEPTH`].
pub fn complete_len(children: usize, depth: u32) -> Option<usize> {
    let squares = (0..depth).try_fold(0u32, |squares, _| squares.checked_mul(children as u32)?.checked_add(1));
    squares.map(|squares| squares as usize).filter(|_| depth <= MAX_DEPTH)
}

/// Scales values by the power of two 2^-e that brings their mean to [1, 2), and returns e; 0 if all are 0.
///
/// Products of two normalised functions neither overflow nor underflow. A value above 0 but below 2^-64 of the
/// mean is raised to that. Values must be finite and not negative; -0 becomes 0.
pub fn normalise(values: &mut [f32]) -> i32 {
    let total: f64 = values.iter().map(|&value| f64::from(value)).sum();
    let mean = total / values.len() as f64;
    let exponent = if mean > 0.0 { numeric::exponent(mean) } else { 0 };
    let scale = numeric::exp2i(-exponent);
    let smallest = mean * scale * numeric::exp2i(-64);
    for value in values {
        let scaled = f64::from(*value) * scale;
        let raised = if scaled < smallest { smallest } else { scaled };
        *value = if scaled > 0.0 { raised as f32 } else { 0.0 };
    }
    exponent
}

/// Fills the coarser levels of a complete tree in heap order whose finest squares (the last C^(depth - 1), in
/// Morton order) hold the averages of the finest cells. Returns the average over the unit cube.
///
/// The sums are `f64`, in child order; each average is rounded to `f32` once.
///
/// # Errors
/// [`Status::InvalidArgument`] if the depth is 0 or the number of squares is not that of `depth`.
pub fn build<const C: usize>(depth: u32, squares: &mut [[f32; C]]) -> Result<f64> {
    let coarser_levels = depth.checked_sub(1).ok_or(Status::InvalidArgument)?;
    let first = complete_len(C, coarser_levels).ok_or(Status::InvalidArgument)?;
    if complete_len(C, depth) != Some(squares.len()) {
        return Err(Status::InvalidArgument);
    }
    let (coarser, finest) = squares.split_at_mut_checked(first).ok_or(Status::InvalidArgument)?;
    let mut open = [0.0; MAX_DEPTH as usize];
    let open = open.get_mut(..coarser_levels as usize).ok_or(Status::InvalidArgument)?;
    let mut average = 0.0;
    for (square, children) in (first..).zip(finest.iter()) {
        let mean = children.iter().map(|&child| f64::from(child)).sum::<f64>() / C as f64;
        average = close(square, mean, coarser, open);
    }
    Ok(average)
}

/// Hands the mean of a finished square to its parent, and so on up while it finishes the parent too. `open` holds
/// the sum of the finished children of the one unfinished square of each level. Returns the last mean.
fn close<const C: usize>(square: usize, mean: f64, coarser: &mut [[f32; C]], open: &mut [f64]) -> f64 {
    let mut square = square;
    let mut mean = mean;
    for sum in open.iter_mut().rev() {
        let child = square.wrapping_sub(1) % C;
        square = square.wrapping_sub(1) / C;
        if let Some(parent) = coarser.get_mut(square) {
            parent[child] = mean as f32;
        }
        *sum += mean;
        if child + 1 < C {
            break;
        }
        mean = *sum / C as f64;
        *sum = 0.0;
    }
    mean
}

/// Whether squares, each with its first kept child and a mask of those, are a tree of at most so many levels in breadth-first order: every
/// square but the first has exactly one parent before it, so there is no cycle.
pub(crate) fn is_tree(depth: u32, squares: impl ExactSizeIterator<Item = (u32, u32)>) -> bool {
    let (count, begin) = (squares.len(), usize::from(squares.len() > 0));
    let (mut next, mut level, mut level_end) = (begin, 1, begin);
    for (square, (first, mask)) in squares.enumerate() {
        if square == level_end {
            (level, level_end) = (level + 1, next);
        }
        if mask != 0 && first as usize != next || level > depth {
            return false;
        }
        next += mask.count_ones() as usize;
    }
    next == count
}

impl<'a, const C: usize> Tree<'a, C> {
    /// A complete tree in heap order: child `c` of square `s` is square `C s + 1 + c`.
    ///
    /// # Errors
    /// [`Status::InvalidArgument`] if the number of squares is not that of `depth`, [`Status::Corrupt`] if an
    /// average is not in [0, [`MAX_AVERAGE`]].
    pub fn complete(depth: u32, average: f32, squares: &'a [[f32; C]]) -> Result<Self> {
        if complete_len(C, depth) != Some(squares.len()) {
            return Err(Status::InvalidArgument);
        }
        let tree = Self::trusted(depth, average, squares, &[]);
        tree.check_averages()?;
        Ok(tree)
    }

    /// A sparse tree in breadth-first order, one link per square. Without squares it is a constant.
    ///
    /// # Errors
    /// [`Status::InvalidArgument`] for a depth above [`MAX_DEPTH`], [`Status::Corrupt`] if the squares are not a
    /// tree of that depth in breadth-first order, or an average is not in [0, [`MAX_AVERAGE`]].
    pub fn sparse(depth: u32, average: f32, squares: &'a [[f32; C]], links: &'a [Link]) -> Result<Self> {
        if depth > MAX_DEPTH {
            return Err(Status::InvalidArgument);
        }
        let tree = Self::trusted(depth, average, squares, links);
        tree.check_averages()?;
        tree.check_links()?;
        Ok(tree)
    }

    /// A view of storage that [`Tree::complete`] (no links) or [`Tree::sparse`] accepted before, without reading
    /// it again. Other storage gives meaningless values, but never a panic.
    #[inline]
    pub fn trusted(depth: u32, average: f32, squares: &'a [[f32; C]], links: &'a [Link]) -> Self {
        let depth = if depth < MAX_DEPTH { depth } else { MAX_DEPTH };
        Tree { depth, average, squares, links }
    }

    fn check_averages(&self) -> Result<()> {
        let valid = |average: f32| (0.0..=MAX_AVERAGE).contains(&average);
        if valid(self.average) && self.squares.iter().flatten().all(|&average| valid(average)) {
            Ok(())
        } else {
            Err(Status::Corrupt)
        }
    }

    fn check_links(&self) -> Result<()> {
        let masks = self.links.iter().all(|link| u64::from(link.mask) < 1 << C);
        let links = self.links.iter().map(|link| (link.first, link.mask));
        if masks && self.links.len() == self.squares.len() && is_tree(self.depth, links) {
            Ok(())
        } else {
            Err(Status::Corrupt)
        }
    }

    /// The grid has 2^depth cells per axis.
    #[inline]
    pub fn depth(&self) -> u32 {
        self.depth
    }

    /// The average over the unit cube.
    #[inline]
    pub fn average(&self) -> f32 {
        self.average
    }

    /// The stored squares.
    #[inline]
    pub fn squares(&self) -> &'a [[f32; C]] {
        self.squares
    }

    /// The links of the squares; empty for a complete tree.
    #[inline]
    pub fn links(&self) -> &'a [Link] {
        self.links
    }

    /// The square of the unit cube; `None` if the function is constant.
    #[inline]
    pub fn root_square(&self) -> Option<u32> {
        if self.squares.is_empty() { None } else { Some(0) }
    }

    /// The unit cube.
    #[inline]
    pub fn root(&self) -> Spot {
        Spot { square: self.root_square().unwrap_or(NO_SQUARE), average: self.average }
    }

    /// Child `c` of a spot: where the tree is constant, the spot itself.
    #[inline]
    pub fn below(&self, spot: Spot, c: u32) -> Spot {
        match self.squares.get(spot.square as usize) {
            Some(averages) => Spot {
                square: self.child_square(spot.square, c).unwrap_or(NO_SQUARE),
                average: averages[c as usize & (C - 1)],
            },
            None => spot,
        }
    }

    /// All children of a spot.
    #[inline(never)]
    pub fn all_below(&self, spot: Spot) -> [Spot; C] {
        let Some(averages) = self.squares.get(spot.square as usize) else { return [spot; C] };
        let (link, last) = (self.link(spot.square), self.squares.len() as u32);
        let square = |c: usize| link.child(c as u32).filter(|&child| child < last).unwrap_or(NO_SQUARE);
        core::array::from_fn(|c| Spot { square: square(c), average: averages[c] })
    }

    /// The averages of the children of a square; 0 for a square that does not exist.
    #[inline]
    pub fn children(&self, square: u32) -> [f32; C] {
        self.squares.get(square as usize).copied().unwrap_or([0.0; C])
    }

    /// Where the kept children of a square stand; none of a square that does not exist.
    #[inline]
    pub fn link(&self, square: u32) -> Link {
        if !self.links.is_empty() {
            return self.links.get(square as usize).copied().unwrap_or_default();
        }
        match square.checked_mul(C as u32).and_then(|before| before.checked_add(1)) {
            Some(first) if (first as usize) < self.squares.len() => Link { first, mask: u32::MAX >> (32 - C) },
            _ => Link::default(),
        }
    }

    /// The square of child `c` (0..C); `None` if the function is constant there.
    #[inline]
    pub fn child_square(&self, square: u32, c: u32) -> Option<u32> {
        self.link(square).child(c).filter(|&child| (child as usize) < self.squares.len())
    }
}
