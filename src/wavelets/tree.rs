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

/// Refined cells go on to at most 2^14 along each axis. Coordinates of 24 bits then still tell 2^10 places in a cell.
pub const MAX_REFINED: u32 = 14;

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

/// Which of 32 finest cells of a complete tree, in Morton order, go on below as squares.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Mark {
    /// Bit k: cell k of the 32 does.
    pub bits: u32,
    /// How many cells before these 32 do.
    pub before: u32,
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
    /// The number of squares in heap order, which come first; 0 for a sparse tree.
    heap: u32,
    /// Where squares follow below the heap; empty if none do.
    marks: &'a [Mark],
    /// The links of the squares behind the heap.
    links: &'a [Link],
}

/// The number of squares of a complete tree: (C^depth - 1) / (C - 1). `None` if it exceeds 2^32 - 1 or the depth
/// exceeds [`MAX_DEPTH`].
pub const fn complete_len<const C: usize>(depth: u32) -> Option<u32> {
    if depth > MAX_DEPTH {
        return None;
    }
    let mut squares: u32 = 0;
    let mut level = 0;
    while level < depth {
        squares = match squares.checked_mul(C as u32) {
            Some(children) => match children.checked_add(1) {
                Some(next) => next,
                None => return None,
            },
            None => return None,
        };
        level += 1;
    }
    Some(squares)
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
    let first = complete_len::<C>(coarser_levels).ok_or(Status::InvalidArgument)? as usize;
    if complete_len::<C>(depth).map(|len| len as usize) != Some(squares.len()) {
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

impl<'a, const C: usize> Tree<'a, C> {
    /// The function that is 0.
    pub const NOTHING: Self = Tree { depth: 0, average: 0.0, squares: &[], heap: 0, marks: &[], links: &[] };

    /// A complete tree in heap order: child `c` of square `s` is square `C s + 1 + c`.
    ///
    /// # Errors
    /// [`Status::InvalidArgument`] if the number of squares is not that of `depth`, [`Status::Corrupt`] if an
    /// average is not in [0, [`MAX_AVERAGE`]].
    pub fn complete(depth: u32, average: f32, squares: &'a [[f32; C]]) -> Result<Self> {
        let expected = complete_len::<C>(depth).ok_or(Status::InvalidArgument)?;
        if squares.len() != expected as usize {
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
        tree.check_links(0, usize::from(!squares.is_empty()))?;
        Ok(tree)
    }

    /// A complete tree of `depth` of which some finest cells are refined: its squares in heap order, then those below
    /// the marked cells, breadth-first, the first of them in the order of the cells. Links count from the first square
    /// behind the heap. `marks` has a bit for each cell, 32 to an entry, or is empty if none is refined.
    ///
    /// # Errors
    /// As [`Tree::sparse`].
    pub fn refined(
        depth: u32,
        average: f32,
        squares: &'a [[f32; C]],
        marks: &'a [Mark],
        links: &'a [Link],
    ) -> Result<Self> {
        let heap = complete_len::<C>(depth).ok_or(Status::InvalidArgument)?;
        if squares.len() as u64 != u64::from(heap) + links.len() as u64 {
            return Err(Status::InvalidArgument);
        }
        let tree = Self::trusted_refined(depth, average, squares, marks, links);
        tree.check_averages()?;
        tree.check_links(depth, tree.check_marks()?)?;
        Ok(tree)
    }

    /// A view of storage that [`Tree::complete`] (no links) or [`Tree::sparse`] accepted before, without reading
    /// it again. Other storage gives meaningless values, but never a panic.
    #[inline]
    pub fn trusted(depth: u32, average: f32, squares: &'a [[f32; C]], links: &'a [Link]) -> Self {
        let depth = if depth < MAX_DEPTH { depth } else { MAX_DEPTH };
        let heap = if links.is_empty() { squares.len() as u32 } else { 0 };
        Tree { depth, average, squares, heap, marks: &[], links }
    }

    /// As [`Tree::trusted`], for [`Tree::refined`].
    #[inline]
    pub fn trusted_refined(
        depth: u32,
        average: f32,
        squares: &'a [[f32; C]],
        marks: &'a [Mark],
        links: &'a [Link],
    ) -> Self {
        let heap = squares.len().saturating_sub(links.len()) as u32;
        Tree { heap, marks, links, ..Self::trusted(depth, average, squares, &[]) }
    }

    fn check_averages(&self) -> Result<()> {
        let valid = |average: f32| (0.0..=MAX_AVERAGE).contains(&average);
        if valid(self.average) && self.squares.iter().flatten().all(|&average| valid(average)) {
            Ok(())
        } else {
            Err(Status::Corrupt)
        }
    }

    /// The number of marked cells.
    fn check_marks(&self) -> Result<usize> {
        let bits = (C as u64) << (C.trailing_zeros() * self.depth.saturating_sub(1));
        let expected = if self.depth == 0 || self.marks.is_empty() { 0 } else { bits.div_ceil(32) };
        let mut marked = 0;
        for (first, mark) in (0u64..).step_by(32).zip(self.marks) {
            let beyond = bits.saturating_sub(first) < 32 && u64::from(mark.bits) >> bits.saturating_sub(first) != 0;
            if mark.before != marked || beyond {
                return Err(Status::Corrupt);
            }
            marked = marked.checked_add(mark.bits.count_ones()).ok_or(Status::Corrupt)?;
        }
        if self.marks.len() as u64 == expected { Ok(marked as usize) } else { Err(Status::Corrupt) }
    }

    /// Breadth-first order gives every square but the first ones, whose parents have `level`, exactly one parent
    /// before it: a tree without cycles.
    fn check_links(&self, level: u32, first: usize) -> Result<()> {
        let len = self.squares.len() - self.heap as usize;
        let deepest = if level == 0 { self.depth } else { MAX_REFINED };
        let (mut next, mut level, mut level_end) = (first, level + 1, first);
        for (square, link) in self.links.iter().enumerate() {
            if square == level_end {
                (level, level_end) = (level + 1, next);
            }
            let children = link.mask.count_ones() as usize;
            let in_order = children == 0 || link.first as usize == next;
            if !in_order || u64::from(link.mask) >= 1 << C || level > deepest {
                return Err(Status::Corrupt);
            }
            next += children;
        }
        if self.links.len() == len && next == len { Ok(()) } else { Err(Status::Corrupt) }
    }

    /// The grid has 2^depth cells per axis, not counting what lies below refined cells.
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

    /// The squares in heap order.
    #[inline]
    pub fn heap(&self) -> u32 {
        self.heap
    }

    /// The links of the squares that are not in heap order; empty for a complete tree.
    #[inline]
    pub fn links(&self) -> &'a [Link] {
        self.links
    }

    /// The square of the unit cube; `None` if the function is constant.
    #[inline]
    pub fn root_square(&self) -> Option<u32> {
        if self.squares.is_empty() { None } else { Some(0) }
    }

    /// The averages of the children of a square; 0 for a square that does not exist.
    #[inline]
    pub fn children(&self, square: u32) -> [f32; C] {
        self.squares.get(square as usize).copied().unwrap_or([0.0; C])
    }

    /// The square of child `c` (0..C); `None` if the function is constant there.
    #[inline]
    pub fn child_square(&self, square: u32, c: u32) -> Option<u32> {
        let child = if square < self.heap {
            let child = square.checked_mul(C as u32)?.checked_add(c)?.checked_add(1)?;
            if child < self.heap { child } else { self.refinement(child - self.heap)? }
        } else {
            let link = self.links.get((square - self.heap) as usize)?;
            let bit = 1u32.wrapping_shl(c);
            if link.mask & bit == 0 {
                return None;
            }
            self.heap.checked_add(link.first)?.checked_add((link.mask & (bit - 1)).count_ones())?
        };
        if (child as usize) < self.squares.len() { Some(child) } else { None }
    }

    /// Whether a square may have a child in heap order or behind the heap: false only if it has none.
    #[inline(always)]
    pub(crate) fn may_have(&self, square: u32, child: u32) -> bool {
        let Some(cell) = child.checked_sub(self.heap) else { return true };
        square >= self.heap
            || self.marks.get((cell / 32) as usize).is_some_and(|mark| mark.bits >> (cell % 32) & 1 == 1)
    }

    /// The square below a finest cell of the heap, which is numbered in Morton order as heap order goes on.
    #[inline]
    fn refinement(&self, cell: u32) -> Option<u32> {
        let mark = self.marks.get((cell / 32) as usize)?;
        let bit = 1u32.wrapping_shl(cell % 32);
        if mark.bits & bit == 0 {
            return None;
        }
        self.heap.checked_add(mark.before)?.checked_add((mark.bits & (bit - 1)).count_ones())
    }
}
