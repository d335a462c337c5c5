//! The product of up to three trees, or the weighted sum of up to sixteen, as a tree: built once, then sampled, saved and
//! combined like any other.
//!
//! A square is kept where one of the trees still varies (and of a product none is 0); squares stand in breadth-first order. Averages
//! are sums from the bottom up in f64: exact, where the product of averages a_E a_F is not. That misses the inner product of all details
//! inside a square (Clarberg et al. 2005, Section 4.3), and two complementary checkerboards would give 1/4 instead of 0. With the
//! visibility of a point as the third factor this is the triple product of Ng et al. 2004 as something to sample; sums interpolate
//! between tables, and a product of two sums is the bilinear blend of all pairs.

use crate::blob::Size;
use crate::numeric::{exp2i, exponent};
use crate::status::{Error, Status};
use crate::wavelets::stored::{AXES, AnyTree, Built, Facts, Header, Parts, SCRATCH, Stored, mean_of, of_any, store};
use crate::wavelets::tree::{Link, MAX_DEPTH, Spot, Tree};
use bytemuck::try_cast_slice_mut;
use core::array::from_fn;

/// The most factors of a product.
pub const MAX_FACTORS: usize = 3;
/// The most trees or approximations that are blended at once: quadrilinear interpolation has 16.
pub const WIS_MAX_BLEND: usize = 16;

/// How trees are combined.
#[derive(Clone, Copy, Debug)]
enum Rule {
    /// Their product.
    Times,
    /// Their sum with these weights, 0 or more.
    Weighted([f64; WIS_MAX_BLEND]),
}

/// The integral of the product of a tree of more axes and one of the first of them, which is constant along the rest: exact but for the
/// rounding of `f64` sums. One visit of each square that both trees keep, children before parents.
pub fn integral<const C: usize, const M: usize>(e: &Tree<C>, f: &Tree<M>) -> f64 {
    const { assert!(M <= C && M.is_power_of_two() && C.is_power_of_two(), "F has at most the axes of E") };
    integral_on(e, f, e.root(), f.root(), 0)
}

/// The same on a square of this level, where the trees are at these spots.
fn integral_on<const C: usize, const M: usize>(e: &Tree<C>, f: &Tree<M>, a: Spot, b: Spot, level: u32) -> f64 {
    // Where one tree ends it is constant, and the average of the other decides.
    if !a.varies() || !b.varies() || level == MAX_DEPTH {
        return f64::from(a.average) * f64::from(b.average);
    }
    let (of_e, of_f) = (e.all_below(a), f.all_below(b));
    // The bits of the first axes are the most significant ones.
    let on_f = |c: usize| of_f[c >> (C / M).trailing_zeros() & (M - 1)];
    let below = of_e.into_iter().enumerate().map(|(c, on_e)| integral_on(e, f, on_e, on_f(c), level + 1));
    below.sum::<f64>() / C as f64
}

impl AnyTree<'_> {
    /// The integral over the unit cube of the product with a tree of the first of these axes, at most as many; `None` if
    /// that has more.
    pub fn product_integral(&self, f: &AnyTree) -> Option<f64> {
        use AnyTree::{Square, Tesseract};
        match (self, f) {
            (Square(e), Square(f)) => Some(integral(e, f)),
            (Tesseract(e), Square(f)) => Some(integral(e, f)),
            (Tesseract(e), Tesseract(f)) => Some(integral(e, f)),
            (Square(_), Tesseract(_)) => None,
        }
    }

    /// The number of squares of each level, as breadth-first order tells it.
    fn levels(&self) -> [u64; MAX_DEPTH as usize] {
        let (squares, children) = (self.averages().len() >> self.axes(), 1usize << self.axes());
        let mut levels = [0; MAX_DEPTH as usize];
        let (mut count, mut links) = (squares.min(1), self.links().iter());
        for slot in &mut levels {
            *slot = count as u64;
            count = if self.links().is_empty() {
                // Heap order: complete.
                if slot.saturating_mul(children as u64) < squares as u64 { count * children } else { 0 }
            } else {
                links.by_ref().take(count).map(|link| link.mask.count_ones() as usize).sum()
            };
        }
        levels
    }

    fn root(&self) -> Spot {
        of_any!(self, tree => tree.root())
    }
}

/// What a tree of as many axes or fewer has on the children of a square of the result: averages, and bit c where child c varies.
struct Below<const C: usize> {
    averages: [f32; C],
    varies: u32,
}

impl<const C: usize> Below<C> {
    fn new<const M: usize>(tree: &Tree<M>, spot: Spot) -> Self {
        // The bits of the first axes are the most significant ones.
        let own = |c: u32| c >> (C / M).trailing_zeros();
        let averages = match tree.squares().get(spot.square as usize) {
            Some(averages) => from_fn(|c| averages[own(c as u32) as usize & (M - 1)]),
            None => [spot.average; C],
        };
        let mask = tree.link(spot.square).mask;
        let varies = if M == C { mask } else { (0..C as u32).fold(0, |all, c| all | (mask >> own(c) & 1) << c) };
        Below { averages, varies }
    }
}

/// The most squares that the product of trees of at most so many axes can have, from how many each tree has on each level:
/// a square of m axes stands for 2^((n - m) level) of n axes. `None` if they are more than 2^32 - 2. Where the trees have as
/// many axes, [`Trees::squares`] counts no more squares than the trees have, and is exact.
fn most(axes: u32, trees: &[Stored]) -> Option<u32> {
    let mut levels = [0u64; MAX_DEPTH as usize];
    if trees.iter().any(|stored| stored.tree.root().average <= 0.0) {
        return Some(0);
    }
    for Stored { tree, .. } in trees {
        let beyond = axes.saturating_sub(tree.axes());
        for ((level, sum), count) in (0..).zip(&mut levels).zip(tree.levels()) {
            *sum = sum.saturating_add(count.saturating_mul(1 << (beyond * level)));
        }
    }
    let whole = |level: u32| 1u64 << (axes * level);
    let squares = (0..).zip(levels).map(|(level, count)| count.min(whole(level))).sum::<u64>();
    u32::try_from(squares).ok().filter(|&squares| squares < u32::MAX)
}

/// Trees to combine, none of more axes than the first. A place is a square of the result: where each tree is.
struct Trees<'a> {
    trees: &'a [Stored<'a>],
    rule: Rule,
}

impl Trees<'_> {
    fn axes(&self) -> u32 {
        self.trees.first().map_or(AXES[0], |stored| stored.tree.axes())
    }

    fn weight(&self, k: usize) -> f64 {
        match &self.rule {
            Rule::Times => 1.0,
            Rule::Weighted(weights) => weights.get(k).copied().unwrap_or(0.0),
        }
    }

    /// What a value is before the first tree.
    fn start(&self) -> f64 {
        if let Rule::Times = self.rule { 1.0 } else { 0.0 }
    }

    /// A value with one more tree in it.
    #[inline(always)]
    fn with(&self, value: f64, term: f64) -> f64 {
        if let Rule::Times = self.rule { value * term } else { value + term }
    }

    /// The values of the C children of a place; bit c: child c varies.
    fn children<const C: usize>(&self, place: &[Spot]) -> ([f64; C], u32) {
        let (mut values, mut varies) = ([self.start(); C], 0);
        for (k, (&spot, Stored { tree, .. })) in place.iter().zip(self.trees).enumerate() {
            let below = of_any!(tree, tree => Below::<C>::new(tree, spot));
            let weight = self.weight(k);
            for (value, average) in values.iter_mut().zip(below.averages) {
                *value = self.with(*value, weight * f64::from(average));
            }
            varies |= if weight > 0.0 { below.varies } else { 0 };
        }
        // Three f32 do not underflow in f64: a product is 0 where a tree is, and does not vary there.
        if let Rule::Times = self.rule {
            varies &= values.iter().zip(0..).fold(0, |all, (&value, c)| all | u32::from(value > 0.0) << c);
        }
        (values, varies)
    }

    /// Writes the place of a child of a place.
    fn descend(&self, place: &[Spot], c: u32, below: &mut [Spot]) {
        let axes = self.axes();
        for ((to, &spot), Stored { tree, .. }) in below.iter_mut().zip(place).zip(self.trees) {
            let own = c >> axes.saturating_sub(tree.axes());
            *to = of_any!(tree, tree => tree.below(spot, own));
        }
    }

    /// The place of the root, its value, and whether it varies.
    fn root(&self) -> ([Spot; WIS_MAX_BLEND], f64, bool) {
        let (mut place, mut value, mut varies) = ([Spot::NOWHERE; WIS_MAX_BLEND], self.start(), false);
        for (k, (to, stored)) in place.iter_mut().zip(self.trees).enumerate() {
            *to = stored.tree.root();
            value = self.with(value, self.weight(k) * f64::from(to.average));
            varies |= self.weight(k) > 0.0 && to.varies();
        }
        (place, value, varies && value > 0.0)
    }

    /// The number of squares of the result, of trees of as many axes; `None` if they are more than 2^32 - 2.
    fn squares(&self) -> Option<u32> {
        let squares = match (self.root(), self.axes()) {
            ((_, _, false), _) => 0,
            ((root, ..), 2) => self.squares_from::<4>(&root, 0),
            ((root, ..), _) => self.squares_from::<16>(&root, 0),
        };
        u32::try_from(squares).ok().filter(|&squares| squares < u32::MAX)
    }

    /// Those from a place of this level on: no more than the trees have together. Recursion ends at the finest level.
    fn squares_from<const C: usize>(&self, place: &[Spot], level: u32) -> u64 {
        if level == MAX_DEPTH {
            return 0;
        }
        let (_, varies) = self.children::<C>(place);
        let below = (0..C as u32).filter(|c| varies >> c & 1 == 1).map(|c| {
            let mut child = [Spot::NOWHERE; WIS_MAX_BLEND];
            self.descend(place, c, &mut child);
            self.squares_from::<C>(&child, level + 1)
        });
        1 + below.sum::<u64>()
    }

    /// Writes the squares below a root that varies, parents before their children; returns how many there are, or `None` if the
    /// scratch memory is too short.
    fn expand<const C: usize>(&self, root: &[Spot], scratch: &mut Scratch) -> Option<usize> {
        let each = self.trees.len();
        scratch.places.get_mut(..each)?.iter_mut().zip(root).for_each(|(place, spot)| *place = *spot);
        let (mut done, mut used) = (0usize, 1usize);
        while done < used {
            let (values, varies) = self.children::<C>(scratch.places.get(done * each..)?);
            *scratch.values.get_mut(done * C..)?.first_chunk_mut::<C>()? = values;
            *scratch.links.get_mut(done)? = Link { first: u32::try_from(used).ok()?, mask: varies };
            for c in (0..C as u32).filter(|c| varies >> c & 1 == 1) {
                let (before, after) = scratch.places.split_at_mut_checked(used * each)?;
                self.descend(before.get(done * each..)?, c, after.get_mut(..each)?);
                used += 1;
            }
            done += 1;
        }
        Some(used)
    }

    /// Combines them; `None` if the scratch memory is too short.
    fn combine(&self, scratch: &mut Scratch) -> Option<Combined> {
        let axes = self.axes();
        let used = match (self.root(), axes) {
            ((_, mean, false), _) => return Some(Combined { squares: 0, mean }),
            ((root, ..), 2) => self.expand::<4>(&root, scratch)?,
            ((root, ..), _) => self.expand::<16>(&root, scratch)?,
        };
        // Children stand behind their parents.
        for parent in (0..used).rev() {
            let Link { first, mask } = *scratch.links.get(parent)?;
            let kept = (0..1usize << axes).filter(|c| mask >> c & 1 == 1);
            for (child, c) in (first as usize..).zip(kept) {
                let average = mean(axes, scratch.values, child)?;
                *scratch.values.get_mut((parent << axes) + c)? = average;
            }
            if mask == 0 {
                scratch.links.get_mut(parent)?.first = 0;
            }
        }
        Some(Combined { squares: u32::try_from(used).ok()?, mean: mean(axes, scratch.values, 0)? })
    }

    /// The memory of a result of so many squares; `None` if none is as long.
    fn size(&self, squares: u32) -> Option<Size> {
        let scratch = (squares as usize).checked_mul(Scratch::each(self.axes(), self.trees.len()))?;
        let bytes = Parts::new(self.axes(), squares as usize)?.bytes;
        Some(Size { bytes, scratch }).filter(|size| size.scratch <= isize::MAX as usize)
    }

    /// Combines them, whose values are multiplied by `2^exponent`, into a tree; `None` if the scratch memory is too short.
    fn build(&self, exponent: i32, memory: &mut [u8], scratch: &mut [u8]) -> Built<Option<Header>> {
        let Some(mut scratch) = Scratch::new(self.axes(), self.trees.len(), scratch) else { return Ok(None) };
        let Some(result) = self.combine(&mut scratch) else { return Ok(None) };
        let stored = store(memory, self.axes(), result.squares as usize, |averages, links| {
            let (power, average) = scale(scratch.values, result.mean, averages);
            let own = exponent.saturating_add(power);
            let mean = if result.mean > 0.0 { mean_of(result.mean, exponent, own)? } else { 0.0 };
            links.iter_mut().zip(scratch.links).for_each(|(link, from)| *link = *from);
            let depth = self.trees.iter().map(|stored| stored.tree.depth()).max().unwrap_or(0);
            Ok(Facts { depth, mean, error: 0.0, exponent: if mean > 0.0 { own } else { 0 }, average })
        });
        stored.map(Some)
    }
}

/// Memory of a result: all three for as many squares as it has, or more.
struct Scratch<'a> {
    /// The averages of the children, of one square behind those of another.
    values: &'a mut [f64],
    /// Where the trees are.
    places: &'a mut [Spot],
    /// The result's links.
    links: &'a mut [Link],
}

impl<'a> Scratch<'a> {
    /// The bytes for a square of so many axes, from so many trees.
    fn each(axes: u32, trees: usize) -> usize {
        (size_of::<f64>() << axes) + trees * size_of::<Spot>() + size_of::<Link>()
    }

    /// Divides a block, for as many squares as fit.
    fn new(axes: u32, trees: usize, block: &'a mut [u8]) -> Option<Self> {
        let room = block.len().checked_div(Self::each(axes, trees))?;
        let (values, rest) = block.split_at_mut_checked(room * (size_of::<f64>() << axes))?;
        let (places, rest) = rest.split_at_mut_checked(room * trees * size_of::<Spot>())?;
        let links = rest.get_mut(..room * size_of::<Link>())?;
        Some(Scratch {
            values: try_cast_slice_mut(values).ok()?,
            places: try_cast_slice_mut(places).ok()?,
            links: try_cast_slice_mut(links).ok()?,
        })
    }
}

/// A result in its scratch memory.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Combined {
    /// The number of squares.
    squares: u32,
    /// The average over the unit cube, of what the trees store.
    mean: f64,
}

/// The average of a square from those of its children.
fn mean(axes: u32, values: &[f64], square: usize) -> Option<f64> {
    let children = values.get(square << axes..(square + 1) << axes)?;
    Some(children.iter().sum::<f64>() / f64::from(1u32 << axes))
}

/// The memory of the product of two or three trees, of which no other has more axes than the first: exactly if all have as
/// many, else at most. `None` if no memory is as long.
pub fn product_size(trees: &[Stored]) -> Option<Size> {
    let product = Trees { trees, rule: Rule::Times };
    let alike = trees.iter().all(|stored| stored.tree.axes() == product.axes());
    product.size(if alike { product.squares()? } else { most(product.axes(), trees)? })
}

/// Multiplies two or three trees, of which no other has more axes than the first.
///
/// # Errors
/// [`Built`].
pub fn multiply_in(trees: &[Stored], memory: &mut [u8], scratch: &mut [u8]) -> Built<Header> {
    let exponent = trees.iter().fold(0i32, |sum, stored| sum.saturating_add(stored.header.exponent));
    let built = Trees { trees, rule: Rule::Times }.build(exponent, memory, scratch)?;
    built.ok_or_else(|| too_small(product_size(trees)))
}

/// The memory of a weighted sum of trees of the same axes, at most. `None` if none is as long.
pub fn sum_size(trees: &[Stored]) -> Option<Size> {
    let sum = Trees { trees, rule: Rule::Weighted([1.0; WIS_MAX_BLEND]) };
    sum.size(sum.squares()?)
}

/// The sum of trees of the same axes, each times its weight, finite and 0 or more.
///
/// # Errors
/// [`Built`].
pub fn add_in(trees: &[Stored], weights: &[f64], memory: &mut [u8], scratch: &mut [u8]) -> Built<Header> {
    let (weights, largest) = stored_weights(trees, weights);
    let sum = Trees { trees, rule: Rule::Weighted(weights) };
    let built = sum.build(largest, memory, scratch)?;
    built.ok_or_else(|| too_small(sum.squares().and_then(|squares| sum.size(squares))))
}

fn too_small(need: Option<Size>) -> Error {
    need.map_or(Status::Overflow.into(), |size| Error::too_small(SCRATCH, size.scratch))
}

/// Weights for what the trees store, and the power of two that was taken out: the largest term has a weight in [1, 2), so
/// that nothing overflows; a term of less than 2^-200 of it counts as that.
#[inline(never)]
fn stored_weights(trees: &[Stored], weights: &[f64]) -> ([f64; WIS_MAX_BLEND], i32) {
    let power = |weight: f64, stored: &Stored| exponent(weight).saturating_add(stored.header.exponent);
    let mut largest = i32::MIN;
    for (&weight, stored) in weights.iter().zip(trees) {
        if weight > 0.0 && power(weight, stored) > largest {
            largest = power(weight, stored);
        }
    }
    let mut stored = [0.0; WIS_MAX_BLEND];
    for (slot, (&weight, stored)) in stored.iter_mut().zip(weights.iter().zip(trees)) {
        if weight > 0.0 {
            let (out, below) = (exponent(weight), power(weight, stored).saturating_sub(largest));
            // Twice, since a weight may be as small as 2^-1074.
            let mantissa = weight * exp2i(-out / 2) * exp2i(-out - -out / 2);
            *slot = mantissa * exp2i(if below < -200 { -200 } else { below });
        }
    }
    (stored, if largest > i32::MIN { largest } else { 0 })
}

/// Writes averages as trees store them, scaled to a mean in [1, 2) (see [`crate::wavelets::tree::normalise`]); returns the power of
/// two that was taken out, and the stored average.
fn scale(values: &[f64], mean: f64, averages: &mut [f32]) -> (i32, f32) {
    let power = if mean > 0.0 { exponent(mean) } else { 0 };
    let scale = exp2i(-power);
    let smallest = mean * scale * exp2i(-64);
    for (average, &value) in averages.iter_mut().zip(values) {
        let scaled = value * scale;
        let raised = if scaled < smallest { smallest } else { scaled };
        *average = if value > 0.0 { raised as f32 } else { 0.0 };
    }
    (power, (mean * scale) as f32)
}
