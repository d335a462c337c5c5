//! Sparse sets of wavelets on the square, not only rooted ones, and the tree of what a set means, which can be sampled.
//!
//! Free thresholding (Clarberg et al. 2005, Section 4.1; Ng et al. 2004) keeps single wavelets wherever they are. The sum of
//! such a set may be negative. Integrals take it as it is; a tree raises it to a floor, and then it is the raised function that
//! is sampled, whose pdf is told and whose averages are stored.

use crate::blob::Size;
use crate::numeric::{exp2i, exponent, max};
use crate::status::Status;
use crate::wavelets::morton::MAX_DEPTH;
use crate::wavelets::stored::{AnyTree, Built, Facts, Header, Parts, mean_of, store};
use crate::wavelets::tree::Link;
use crate::wavelets::triple::{Ancestors, Wavelets, butterfly, shift};

/// Axes of a square.
const AXES: u32 = 2;

/// A function on the square: its average, and wavelets in order.
#[derive(Clone, Copy, Debug)]
pub struct Sparse<'a> {
    /// Over the whole square.
    pub average: f64,
    /// By position, and squares before those inside them.
    pub wavelets: &'a [Wavelets],
}

/// The squares that the tree of a set has: those of its wavelets and all above them.
pub fn squares(list: &[Wavelets]) -> usize {
    (0..MAX_DEPTH).map(|level| count_above(list, level)).sum()
}

/// The number of squares of a level that hold wavelets of a list. Not in line: one copy serves all levels.
#[inline(never)]
fn count_above(list: &[Wavelets], level: u32) -> usize {
    above(list, level).count()
}

/// The level below the finest square of a set.
pub fn depth(list: &[Wavelets]) -> u32 {
    list.iter().map(|w| w.level + 1).max().unwrap_or(0)
}

/// The positions of the squares of a level that hold wavelets of a list, in order.
fn above(list: &[Wavelets], level: u32) -> impl Iterator<Item = u32> {
    let (mut last, shift) = (None, shift(level));
    list.iter().filter(move |w| w.level >= level).filter_map(move |w| {
        let square = w.position >> shift << shift;
        let is_new = last != Some(square);
        last = Some(square);
        is_new.then_some(square)
    })
}

/// The bytes of the tree of a set; `None` if no memory is as long.
pub fn size(list: &[Wavelets]) -> Option<Size> {
    Some(Size { bytes: Parts::new(AXES, squares(list))?.bytes, scratch: 0 })
}

/// Stores the tree of a set, whose values are raised to `least`, 0 or more.
///
/// # Errors
/// [`Built`]; [`Status::InvalidArgument`], if values are too large beside the average.
pub fn build_in(set: Sparse, least: f64, memory: &mut [u8]) -> Built<Header> {
    // -0 counts as 0, or it would be stored.
    let least = max(least, 0.0);
    store(memory, AXES, squares(set.wavelets), |averages, links| {
        let raised = max(set.average, least);
        let power = if raised > 0.0 { exponent(raised).clamp(-1000, 1000) } else { 0 };
        let mean = to_tree(set, least, exp2i(-power), averages, links);
        let (depth, average) = (depth(set.wavelets), mean as f32);
        if !AnyTree::trusted(AXES, depth, average, averages, links).is_sound() {
            return Err(Status::InvalidArgument.into());
        }
        Ok(Facts { depth, mean: mean_of(mean, power, power)?, error: 0.0, exponent: power, average })
    })
}

/// Writes the tree of a set: on each of its finest cells the function, raised to `least` and times `scale`,
/// and above them the true averages of that. Returns the average.
///
/// `averages` has four numbers for each of `links`, which are as many as [`squares`] says; the tree's depth is [`depth`].
pub fn to_tree(set: Sparse, least: f64, scale: f64, averages: &mut [f32], links: &mut [Link]) -> f64 {
    let mut squares = averages.chunks_exact_mut(4);
    for level in 0..MAX_DEPTH {
        let mut way = Ancestors::new(set.average, set.wavelets, butterfly);
        for (position, square) in above(set.wavelets, level).zip(&mut squares) {
            let children = way.below((position, level));
            for (average, child) in square.iter_mut().zip(children) {
                *average = (max(child, least) * scale) as f32;
            }
        }
    }
    link(set.wavelets, links);
    // Below a kept square the averages are those of what is below, children before parents.
    for parent in (0..links.len()).rev() {
        let Link { first, mask } = links.get(parent).copied().unwrap_or_default();
        for (below, c) in (first as usize..).zip((0..4usize).filter(|c| mask >> c & 1 == 1)) {
            let mean = mean(averages, below).unwrap_or(0.0);
            if let Some(slot) = averages.get_mut(4 * parent + c) {
                *slot = mean as f32;
            }
        }
    }
    mean(averages, 0).unwrap_or(max(set.average, least) * scale)
}

/// The average of a square from those of its children.
fn mean(averages: &[f32], square: usize) -> Option<f64> {
    let children = averages.get(4 * square..4 * (square + 1))?;
    Some(children.iter().map(|&x| f64::from(x)).sum::<f64>() / 4.0)
}

/// Writes where the children of each square stand, level by level.
fn link(list: &[Wavelets], links: &mut [Link]) {
    let (mut slots, mut child) = (links.iter_mut(), usize::from(!list.is_empty()));
    for level in 0..MAX_DEPTH {
        let (shift, shift_below) = (shift(level), shift(level + 1));
        let mut below = above(list, level + 1).peekable();
        for (square, slot) in above(list, level).zip(&mut slots) {
            let mut link = Link { first: child as u32, mask: 0 };
            while let Some(next) = below.next_if(|next| next >> shift == square >> shift) {
                link.mask |= 1 << (next >> shift_below & 3);
                child += 1;
            }
            *slot = if link.mask == 0 { Link::default() } else { link };
        }
    }
}
