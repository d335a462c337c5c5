//! The product of up to three trees, or the weighted sum of up to sixteen, as a tree: built once, then sampled, saved and
//! combined like any other.
//!
//! Where [`crate::wavelets::inner`] descends two trees side by side, here the averages are written out. A square is kept where one of
//! the trees still varies (and of a product none is 0); squares stand in breadth-first order. Averages are sums from the
//! bottom up in f64: exact, where the product of averages is not (Clarberg et al. 2005, Section 4.3). With the visibility
//! of a point as the third factor this is the triple product of Ng et al. 2004 as something to sample; sums interpolate
//! between tables, and a product of two sums is the bilinear blend of all pairs.

use crate::numeric::{exp2i, exponent};
use crate::wavelets::tree::{Link, MAX_DEPTH, Tree};

/// The most factors of a product.
pub const MAX_FACTORS: usize = 3;
/// The most trees or approximations that are blended at once: quadrilinear interpolation has 16.
pub const WIS_MAX_BLEND: usize = 16;

/// How trees are combined.
pub trait Rule<const K: usize> {
    /// The value where the trees have these averages.
    fn value(&self, spots: &[Spot; K]) -> f64;
    /// Whether it varies there.
    fn varies(&self, spots: &[Spot; K]) -> bool;
}

/// Their product.
#[derive(Clone, Copy, Debug)]
pub struct Times;

impl Rule<MAX_FACTORS> for Times {
    fn value(&self, spots: &[Spot; MAX_FACTORS]) -> f64 {
        spots.iter().map(|spot| f64::from(spot.average)).product()
    }

    fn varies(&self, spots: &[Spot; MAX_FACTORS]) -> bool {
        spots.iter().any(|spot| spot.square.is_some()) && spots.iter().all(|spot| spot.average > 0.0)
    }
}

/// Their sum with these weights, 0 or more.
#[derive(Clone, Copy, Debug)]
pub struct Weighted(pub [f64; WIS_MAX_BLEND]);

// Not in line: one copy serves all numbers of axes.
impl Rule<WIS_MAX_BLEND> for Weighted {
    #[inline(never)]
    fn value(&self, spots: &[Spot; WIS_MAX_BLEND]) -> f64 {
        spots.iter().zip(self.0).map(|(spot, weight)| weight * f64::from(spot.average)).sum()
    }

    #[inline(never)]
    fn varies(&self, spots: &[Spot; WIS_MAX_BLEND]) -> bool {
        spots.iter().zip(self.0).any(|(spot, weight)| weight > 0.0 && spot.square.is_some())
    }
}

/// A tree of one to four axes.
#[derive(Clone, Copy, Debug)]
pub enum Factor<'a> {
    /// One axis.
    Line(Tree<'a, 2>),
    /// Two axes.
    Square(Tree<'a, 4>),
    /// Three axes.
    Cube(Tree<'a, 8>),
    /// Four axes.
    Tesseract(Tree<'a, 16>),
}

impl Factor<'_> {
    /// The number of axes.
    pub fn axes(&self) -> u32 {
        match self {
            Factor::Line(_) => 1,
            Factor::Square(_) => 2,
            Factor::Cube(_) => 3,
            Factor::Tesseract(_) => 4,
        }
    }

    /// The depth of the grid.
    pub fn depth(&self) -> u32 {
        match self {
            Factor::Line(tree) => tree.depth(),
            Factor::Square(tree) => tree.depth(),
            Factor::Cube(tree) => tree.depth(),
            Factor::Tesseract(tree) => tree.depth(),
        }
    }

    /// The number of squares of each level.
    fn levels(&self) -> [u64; MAX_DEPTH as usize] {
        match self {
            Factor::Line(tree) => levels(tree),
            Factor::Square(tree) => levels(tree),
            Factor::Cube(tree) => levels(tree),
            Factor::Tesseract(tree) => levels(tree),
        }
    }

    fn root(&self) -> Spot {
        match self {
            Factor::Line(tree) => root(tree),
            Factor::Square(tree) => root(tree),
            Factor::Cube(tree) => root(tree),
            Factor::Tesseract(tree) => root(tree),
        }
    }

    /// The child of a spot of the result, whose axes are `beyond` more than this tree's: it is constant along those.
    #[inline(never)]
    fn child(&self, spot: Spot, c: u32, beyond: u32) -> Spot {
        let c = c.wrapping_shr(beyond);
        match (self, spot.square) {
            (_, None) => spot,
            (Factor::Line(tree), Some(square)) => child(tree, square, c),
            (Factor::Square(tree), Some(square)) => child(tree, square, c),
            (Factor::Cube(tree), Some(square)) => child(tree, square, c),
            (Factor::Tesseract(tree), Some(square)) => child(tree, square, c),
        }
    }
}

/// A tree's average on a square, and its own square there if it varies.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    square: Option<u32>,
    average: f32,
}

/// A function that is 1: what stands for a factor that is not there.
const ONE: Spot = Spot { square: None, average: 1.0 };

fn root<const C: usize>(tree: &Tree<C>) -> Spot {
    Spot { square: tree.root_square(), average: tree.average() }
}

fn child<const C: usize>(tree: &Tree<C>, square: u32, c: u32) -> Spot {
    let average = tree.children(square).get(c as usize).copied().unwrap_or(0.0);
    Spot { square: tree.child_square(square, c), average }
}

/// Breadth-first order tells how many squares a level has.
fn levels<const C: usize>(tree: &Tree<C>) -> [u64; MAX_DEPTH as usize] {
    let mut levels = [0; MAX_DEPTH as usize];
    let (mut count, mut links) = (tree.squares().len().min(1), tree.links().iter());
    for slot in &mut levels {
        *slot = count as u64;
        count = if tree.links().is_empty() {
            // Heap order: complete.
            if slot.saturating_mul(C as u64) < tree.squares().len() as u64 { count * C } else { 0 }
        } else {
            links.by_ref().take(count).map(|link| link.mask.count_ones() as usize).sum()
        };
    }
    levels
}

/// The most squares that the product of trees with at most log2(C) axes can have, from how many each tree has on each level:
/// a square of m axes stands for 2^((n - m) level) of n axes. `None` if they are more than 2^32 - 2. Where the trees have as
/// many axes, [`count`] visits no more squares than the trees have, and is exact.
pub fn most<const C: usize>(factors: &[Factor]) -> Option<u32> {
    let axes = C.trailing_zeros();
    let mut levels = [0u64; MAX_DEPTH as usize];
    if factors.iter().any(|factor| factor.root().average <= 0.0) {
        return Some(0);
    }
    for factor in factors {
        let beyond = axes.saturating_sub(factor.axes());
        for ((level, sum), count) in (0..).zip(&mut levels).zip(factor.levels()) {
            *sum = sum.saturating_add(count.saturating_mul(1 << (beyond * level)));
        }
    }
    let whole = |level: u32| 1u64 << (axes * level);
    let squares = (0..).zip(levels).map(|(level, count)| count.min(whole(level))).sum::<u64>();
    u32::try_from(squares).ok().filter(|&squares| squares < u32::MAX)
}

/// A square of the result: where each tree is.
#[derive(Clone, Copy, Debug)]
pub struct Place<const K: usize> {
    spots: [Spot; K],
}

impl<const K: usize> Place<K> {
    const NOWHERE: Place<K> = Place { spots: [ONE; K] };

    fn root(factors: &[Factor]) -> Place<K> {
        let mut place = Place::NOWHERE;
        for (spot, factor) in place.spots.iter_mut().zip(factors) {
            *spot = factor.root();
        }
        place
    }

    fn child<const C: usize>(&self, factors: &[Factor], c: u32) -> Place<K> {
        let mut place = *self;
        for (spot, factor) in place.spots.iter_mut().zip(factors) {
            *spot = factor.child(*spot, c, C.trailing_zeros().saturating_sub(factor.axes()));
        }
        place
    }
}

/// The number of squares of the result of at most K trees with at most log2(C) axes; `None` if they are more than 2^32 - 2.
pub fn count<const C: usize, const K: usize>(factors: &[Factor], rule: &impl Rule<K>) -> Option<u32> {
    // The way down, and at each level the child that is next.
    let mut way = [(Place::<K>::NOWHERE, 0u32); MAX_DEPTH as usize];
    let root = Place::root(factors);
    let (mut level, mut squares) = (0usize, u32::from(rule.varies(&root.spots)));
    way[0] = (root, if squares == 0 { C as u32 } else { 0 });
    while let Some((place, c)) = way.get_mut(level) {
        if *c == C as u32 {
            let Some(above) = level.checked_sub(1) else { break };
            level = above;
            continue;
        }
        let child = place.child::<C>(factors, *c);
        *c += 1;
        if rule.varies(&child.spots) {
            squares = squares.checked_add(1).filter(|&squares| squares < u32::MAX)?;
            level += 1;
            if let Some(slot) = way.get_mut(level) {
                *slot = (child, 0);
            }
        }
    }
    Some(squares)
}

/// Memory of a result: all three as long as it has squares, or longer.
pub struct Scratch<'a, const C: usize, const K: usize> {
    /// Where the trees are.
    pub places: &'a mut [Place<K>],
    /// The averages of the children.
    pub values: &'a mut [[f64; C]],
    /// The result's links.
    pub links: &'a mut [Link],
}

/// A result in its scratch memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Combined {
    /// The number of squares.
    pub squares: u32,
    /// The average over the unit cube, of what the trees store.
    pub mean: f64,
}

/// Combines at most K trees; `None` if the scratch memory is too short.
pub fn combine<const C: usize, const K: usize>(
    factors: &[Factor],
    rule: &impl Rule<K>,
    scratch: &mut Scratch<C, K>,
) -> Option<Combined> {
    let root = Place::root(factors);
    if !rule.varies(&root.spots) {
        return Some(Combined { squares: 0, mean: rule.value(&root.spots) });
    }
    *scratch.places.first_mut()? = root;
    let (mut done, mut used) = (0usize, 1usize);
    while done < used {
        let place = *scratch.places.get(done)?;
        let (values, link) = (scratch.values.get_mut(done)?, scratch.links.get_mut(done)?);
        *link = Link { first: u32::try_from(used).ok()?, mask: 0 };
        for (c, value) in (0..C as u32).zip(values.iter_mut()) {
            let child = place.child::<C>(factors, c);
            *value = rule.value(&child.spots);
            if rule.varies(&child.spots) {
                *scratch.places.get_mut(used)? = child;
                link.mask |= 1 << c;
                used += 1;
            }
        }
        done += 1;
    }
    // Children stand behind their parents.
    for parent in (0..used).rev() {
        let Link { first, mask } = *scratch.links.get(parent)?;
        let kept = (0..C).filter(|c| mask >> c & 1 == 1);
        for (child, c) in (first as usize..).zip(kept) {
            let average = mean(scratch.values.get(child)?);
            *scratch.values.get_mut(parent)?.get_mut(c)? = average;
        }
        if mask == 0 {
            scratch.links.get_mut(parent)?.first = 0;
        }
    }
    Some(Combined { squares: u32::try_from(used).ok()?, mean: mean(scratch.values.first()?) })
}

fn mean<const C: usize>(values: &[f64; C]) -> f64 {
    values.iter().sum::<f64>() / C as f64
}

/// Writes averages as trees store them, scaled to a mean in [1, 2) (see [`crate::wavelets::tree::normalise`]); returns the power of
/// two that was taken out, and the stored average.
pub fn store<const C: usize>(values: &[[f64; C]], mean: f64, squares: &mut [[f32; C]]) -> (i32, f32) {
    let power = if mean > 0.0 { exponent(mean) } else { 0 };
    let scale = exp2i(-power);
    let smallest = mean * scale * exp2i(-64);
    for (square, values) in squares.iter_mut().zip(values) {
        *square = values.map(|value| {
            let scaled = value * scale;
            let raised = if scaled < smallest { smallest } else { scaled };
            if value > 0.0 { raised as f32 } else { 0.0 }
        });
    }
    (power, (mean * scale) as f32)
}
