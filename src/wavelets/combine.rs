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
use crate::wavelets::stored::{AnyTree, Built, Facts, Header, Parts, SCRATCH, Stored, mean_of, of_any, store};
use crate::wavelets::tree::{Link, MAX_DEPTH, NO_SQUARE, Tree};
use bytemuck::{Pod, Zeroable, try_cast_slice_mut};

/// The most factors of a product.
pub const MAX_FACTORS: usize = 3;
/// The most trees or approximations that are blended at once: quadrilinear interpolation has 16.
pub const WIS_MAX_BLEND: usize = 16;

/// How trees are combined.
trait Rule<const K: usize> {
    /// The value where the trees have these averages.
    fn value(&self, spots: &[Spot; K]) -> f64;
    /// Whether it varies there.
    fn varies(&self, spots: &[Spot; K]) -> bool;
}

/// Their product.
#[derive(Clone, Copy, Debug)]
struct Times;

impl Rule<MAX_FACTORS> for Times {
    fn value(&self, spots: &[Spot; MAX_FACTORS]) -> f64 {
        spots.iter().map(|spot| f64::from(spot.average)).product()
    }

    fn varies(&self, spots: &[Spot; MAX_FACTORS]) -> bool {
        spots.iter().any(Spot::varies) && spots.iter().all(|spot| spot.average > 0.0)
    }
}

/// Their sum with these weights, 0 or more.
#[derive(Clone, Copy, Debug)]
struct Weighted([f64; WIS_MAX_BLEND]);

// Not in line: one copy serves all numbers of axes.
impl Rule<WIS_MAX_BLEND> for Weighted {
    #[inline(never)]
    fn value(&self, spots: &[Spot; WIS_MAX_BLEND]) -> f64 {
        spots.iter().zip(self.0).map(|(spot, weight)| weight * f64::from(spot.average)).sum()
    }

    #[inline(never)]
    fn varies(&self, spots: &[Spot; WIS_MAX_BLEND]) -> bool {
        spots.iter().zip(self.0).any(|(spot, weight)| weight > 0.0 && spot.varies())
    }
}

/// The integral of the product of a tree of more axes and one of the first of them, which is constant along the rest: exact but for the
/// rounding of `f64` sums. One visit of each square that both trees keep, children before parents.
pub fn integral<const C: usize, const M: usize>(e: &Tree<C>, f: &Tree<M>) -> f64 {
    const { assert!(M <= C && M.is_power_of_two() && C.is_power_of_two(), "F has at most the axes of E") };
    integral_on(e, f, [e.root_square(), f.root_square()], [e.average(), f.average()], 0)
}

/// The same on a square of this level, where the trees have these squares and averages.
fn integral_on<const C: usize, const M: usize>(
    e: &Tree<C>,
    f: &Tree<M>,
    squares: [Option<u32>; 2],
    [a, b]: [f32; 2],
    level: u32,
) -> f64 {
    // Where one tree ends it is constant, and the average of the other decides.
    let ([Some(on_e), Some(on_f)], false) = (squares, level == MAX_DEPTH) else { return f64::from(a) * f64::from(b) };
    let (of_e, of_f) = (e.children(on_e), f.children(on_f));
    let below = (0..C as u32).map(|c| {
        // The bits of the first axes are the most significant ones.
        let fc = c >> (C / M).trailing_zeros();
        let averages = [of_e[c as usize & (C - 1)], of_f[fc as usize & (M - 1)]];
        integral_on(e, f, [e.child_square(on_e, c), f.child_square(on_f, fc)], averages, level + 1)
    });
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
        of_any!(self, tree => Spot { square: tree.root_square().unwrap_or(NO_SQUARE), average: tree.average() })
    }

    /// The child of a spot of the result, whose axes are `beyond` more than this tree's: it is constant along those.
    #[inline(never)]
    fn child(&self, spot: Spot, c: u32, beyond: u32) -> Spot {
        let c = c.wrapping_shr(beyond);
        match spot.square {
            NO_SQUARE => spot,
            square => of_any!(self, tree => child_spot(tree, square, c)),
        }
    }
}

/// A tree's average on a square, and its own square there if it varies.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Spot {
    /// Or [`NO_SQUARE`].
    square: u32,
    average: f32,
}

impl Spot {
    fn varies(&self) -> bool {
        self.square != NO_SQUARE
    }
}

/// A function that is 1: what stands for a factor that is not there.
const ONE: Spot = Spot { square: NO_SQUARE, average: 1.0 };

fn child_spot<const C: usize>(tree: &Tree<C>, square: u32, c: u32) -> Spot {
    let average = tree.children(square).get(c as usize).copied().unwrap_or(0.0);
    Spot { square: tree.child_square(square, c).unwrap_or(NO_SQUARE), average }
}

/// The most squares that the product of trees of at most so many axes can have, from how many each tree has on each level:
/// a square of m axes stands for 2^((n - m) level) of n axes. `None` if they are more than 2^32 - 2. Where the trees have as
/// many axes, [`count`] visits no more squares than the trees have, and is exact.
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

/// A square of the result: where each tree is.
type Place<const K: usize> = [Spot; K];

fn root<const K: usize>(trees: &[Stored]) -> Place<K> {
    let mut place = [ONE; K];
    for (spot, stored) in place.iter_mut().zip(trees) {
        *spot = stored.tree.root();
    }
    place
}

/// The child of a place of the result, which has so many axes. In line: as a function apart it answers in memory, and a product waits for what
/// it wrote in halves: 1.5 times as long.
#[inline(always)]
fn child<const K: usize>(mut place: Place<K>, trees: &[Stored], c: u32, axes: u32) -> Place<K> {
    for (spot, Stored { tree, .. }) in place.iter_mut().zip(trees) {
        *spot = tree.child(*spot, c, axes.saturating_sub(tree.axes()));
    }
    place
}

/// The number of squares of the result of at most K trees of at most so many axes, from a place of this level on; `None` if they are
/// more than 2^32 - 2. Recursion ends at the finest level.
fn count<const K: usize>(
    axes: u32,
    trees: &[Stored],
    rule: &impl Rule<K>,
    place: &Place<K>,
    level: u32,
) -> Option<u32> {
    if level == MAX_DEPTH || !rule.varies(place) {
        return Some(0);
    }
    (0..1 << axes).try_fold(1u32, |squares, c| {
        let below = count(axes, trees, rule, &child(*place, trees, c, axes), level + 1)?;
        squares.checked_add(below).filter(|&squares| squares < u32::MAX)
    })
}

/// Memory of a result: all three for as many squares as it has, or more.
struct Scratch<'a, const K: usize> {
    /// The averages of the children, of one square behind those of another.
    values: &'a mut [f64],
    /// Where the trees are.
    places: &'a mut [Place<K>],
    /// The result's links.
    links: &'a mut [Link],
}

impl<'a, const K: usize> Scratch<'a, K>
where
    Place<K>: Pod,
{
    /// The bytes for a square of so many axes.
    fn each(axes: u32) -> usize {
        (size_of::<f64>() << axes) + size_of::<Place<K>>() + size_of::<Link>()
    }

    /// Divides a block, for as many squares as fit.
    fn new(axes: u32, block: &'a mut [u8]) -> Option<Self> {
        let room = block.len() / Self::each(axes);
        let (values, rest) = block.split_at_mut_checked(room * (size_of::<f64>() << axes))?;
        let (places, rest) = rest.split_at_mut_checked(room * size_of::<Place<K>>())?;
        let links = rest.get_mut(..room * size_of::<Link>())?;
        Some(Scratch {
            values: try_cast_slice_mut(values).ok()?,
            places: try_cast_slice_mut(places).ok()?,
            links: try_cast_slice_mut(links).ok()?,
        })
    }

    /// The memory of a result of so many squares; `None` if none is as long.
    fn size(axes: u32, squares: u32) -> Option<Size> {
        let scratch = (squares as usize).checked_mul(Self::each(axes))?;
        let bytes = Parts::new(axes, squares as usize)?.bytes;
        Some(Size { bytes, scratch }).filter(|size| size.scratch <= isize::MAX as usize)
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

/// Combines at most K trees; `None` if the scratch memory is too short.
fn combine<const K: usize>(
    axes: u32,
    trees: &[Stored],
    rule: &impl Rule<K>,
    scratch: &mut Scratch<K>,
) -> Option<Combined> {
    let root = root(trees);
    if !rule.varies(&root) {
        return Some(Combined { squares: 0, mean: rule.value(&root) });
    }
    *scratch.places.first_mut()? = root;
    let (mut done, mut used) = (0usize, 1usize);
    while done < used {
        let place = *scratch.places.get(done)?;
        let (values, link) = (scratch.values.get_mut(done << axes..)?, scratch.links.get_mut(done)?);
        *link = Link { first: u32::try_from(used).ok()?, mask: 0 };
        for (c, value) in (0..1 << axes).zip(values) {
            let child = child(place, trees, c, axes);
            *value = rule.value(&child);
            if rule.varies(&child) {
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

/// The average of a square from those of its children.
fn mean(axes: u32, values: &[f64], square: usize) -> Option<f64> {
    let children = values.get(square << axes..(square + 1) << axes)?;
    Some(children.iter().sum::<f64>() / f64::from(1u32 << axes))
}

/// Combines trees, whose values are multiplied by `2^exponent`, into a tree; `None` if the scratch memory is too short.
#[inline(never)]
fn build<const K: usize>(
    trees: &[Stored],
    rule: &impl Rule<K>,
    exponent: i32,
    memory: &mut [u8],
    scratch: &mut [u8],
) -> Built<Option<Header>>
where
    Place<K>: Pod,
{
    let axes = axes(trees);
    let Some(mut scratch) = Scratch::new(axes, scratch) else { return Ok(None) };
    let Some(result) = combine(axes, trees, rule, &mut scratch) else { return Ok(None) };
    let stored = store(memory, axes, result.squares as usize, |averages, links| {
        let (power, average) = scale(scratch.values, result.mean, averages);
        let own = exponent.saturating_add(power);
        let mean = if result.mean > 0.0 { mean_of(result.mean, exponent, own)? } else { 0.0 };
        links.iter_mut().zip(scratch.links).for_each(|(link, from)| *link = *from);
        let depth = trees.iter().map(|stored| stored.tree.depth()).max().unwrap_or(0);
        Ok(Facts { depth, mean, error: 0.0, exponent: if mean > 0.0 { own } else { 0 }, average })
    });
    stored.map(Some)
}

/// The axes of a result: those of the first tree.
fn axes(trees: &[Stored]) -> u32 {
    trees.first().map_or(1, |stored| stored.tree.axes())
}

/// The memory of the product of two or three trees, of which no other has more axes than the first: exactly if all have as
/// many, else at most. `None` if no memory is as long.
pub fn product_size(trees: &[Stored]) -> Option<Size> {
    let axes = axes(trees);
    let alike = trees.iter().all(|stored| stored.tree.axes() == axes);
    let squares = if alike { count(axes, trees, &Times, &root(trees), 0)? } else { most(axes, trees)? };
    Scratch::<MAX_FACTORS>::size(axes, squares)
}

/// Multiplies two or three trees, of which no other has more axes than the first.
///
/// # Errors
/// [`Built`].
pub fn multiply_in(trees: &[Stored], memory: &mut [u8], scratch: &mut [u8]) -> Built<Header> {
    let exponent = trees.iter().fold(0i32, |sum, stored| sum.saturating_add(stored.header.exponent));
    let built = build(trees, &Times, exponent, memory, scratch)?;
    built.ok_or_else(|| {
        product_size(trees).map_or(Status::Overflow.into(), |size| Error::too_small(SCRATCH, size.scratch))
    })
}

/// The memory of a weighted sum of trees of the same axes, at most. `None` if none is as long.
pub fn sum_size(trees: &[Stored]) -> Option<Size> {
    weighted_size(trees, &Weighted([1.0; WIS_MAX_BLEND]))
}

fn weighted_size(trees: &[Stored], rule: &Weighted) -> Option<Size> {
    Scratch::<WIS_MAX_BLEND>::size(axes(trees), count(axes(trees), trees, rule, &root(trees), 0)?)
}

/// The sum of trees of the same axes, each times its weight, finite and 0 or more.
///
/// # Errors
/// [`Built`].
pub fn add_in(trees: &[Stored], weights: &[f64], memory: &mut [u8], scratch: &mut [u8]) -> Built<Header> {
    let (rule, largest) = stored_weights(trees, weights);
    let built = build(trees, &rule, largest, memory, scratch)?;
    built.ok_or_else(|| {
        weighted_size(trees, &rule).map_or(Status::Overflow.into(), |size| Error::too_small(SCRATCH, size.scratch))
    })
}

/// Weights for what the trees store, and the power of two that was taken out: the largest term has a weight in [1, 2), so
/// that nothing overflows; a term of less than 2^-200 of it counts as that.
#[inline(never)]
fn stored_weights(trees: &[Stored], weights: &[f64]) -> (Weighted, i32) {
    let power = |weight: f64, stored: &Stored| exponent(weight).saturating_add(stored.header.exponent);
    let mut largest = i32::MIN;
    for (&weight, stored) in weights.iter().zip(trees) {
        if weight > 0.0 && power(weight, stored) > largest {
            largest = power(weight, stored);
        }
    }
    let mut rule = Weighted([0.0; WIS_MAX_BLEND]);
    for (slot, (&weight, stored)) in rule.0.iter_mut().zip(weights.iter().zip(trees)) {
        if weight > 0.0 {
            let (out, below) = (exponent(weight), power(weight, stored).saturating_sub(largest));
            // Twice, since a weight may be as small as 2^-1074.
            let mantissa = weight * exp2i(-out / 2) * exp2i(-out - -out / 2);
            *slot = mantissa * exp2i(if below < -200 { -200 } else { below });
        }
    }
    (rule, if largest > i32::MIN { largest } else { 0 })
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
