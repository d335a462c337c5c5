//! Products and weighted sums of trees in C.

use super::{Header, MAGIC, Object, Stored, Tree, TreeInfo, check_results, mean_of, publish};
use crate::ffi::{Checked, Diagnostic, ExclusiveBlock, Failure, MemorySize, WIS_ALIGNMENT, answer, out, slice};
use crate::numeric::{exp2i, exponent};
use crate::status::Status;
use crate::wavelets::combine::{
    self as kernel, Factor, MAX_FACTORS, Place, Rule, Scratch, Times, WIS_MAX_BLEND, Weighted,
};
use crate::wavelets::tree::{self, Link};
use core::ffi::c_void;

/// The memory that wis_tree_multiply needs for these trees at most; `g` may be null. If all trees have the same axes the
/// size is exact, and costs one visit of each square of the product. Otherwise it is an upper bound, and costs one visit of
/// each square of the trees. WIS_OVERFLOW if there may be more than 2^32 - 2 squares.
/// Work: squares of the trees and of the product.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_multiply_size(
    e: *const Tree,
    f: *const Tree,
    g: *const Tree,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let factors = Factors::read(e, f, g)?;
            let size = out(size, 4)?;
            let squares = with_axes!(factors.dimensions, 2, count(&factors))?;
            let scratch = with_axes!(factors.dimensions, 2, layout_of_product(squares))?;
            size.write(needed(factors.dimensions, squares, &scratch)?);
        }
        Ok(())
    })
}

/// Multiplies two or three trees into a tree: sampled, saved and multiplied like any other. `f` and `g` (null: 1) have the
/// first axes of `e`, at most as many, and are constant along the rest. The averages are exact but for rounding (Clarberg
/// et al. 2005, Section 4.3; with light, BRDF x cosine and visibility as factors the triple product of Ng et al. 2004).
/// `error` in `info`, which may be null, is 0: what was dropped from the factors is not counted. WIS_INVALID_ARGUMENT if `f` or
/// `g` has more axes than `e`; WIS_OVERFLOW if the average is above 0 and below 2^-1022, or beyond a double.
///
/// Blocks may be longer than wis_tree_multiply_size says, and serve for many products. They may be shorter, too: the call
/// answers WIS_MEMORY_TOO_SMALL as soon as the product exceeds the scratch block, or at the end if it exceeds the other one.
/// The diagnostic then tells enough bytes, of the scratch block as wis_tree_multiply_size does. The bytes in use stand in
/// `info`. Work: squares of the trees and of the product.
///
/// # Safety
/// Pointers are null or point to what the header says; blocks are as long as stated and nobody else uses them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_multiply(
    e: *const Tree,
    f: *const Tree,
    g: *const Tree,
    memory: *mut c_void,
    bytes: usize,
    scratch: *mut c_void,
    scratch_bytes: usize,
    tree: *mut *const Tree,
    info: *mut TreeInfo,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract; the parts of the scratch memory are apart.
        unsafe {
            let factors = Factors::read(e, f, g)?;
            check_results(tree, 8, info, 9)?;
            let scratch = ExclusiveBlock::new(scratch.cast(), scratch_bytes, scratch_bytes, 6)?;
            ExclusiveBlock::new(memory.cast(), bytes, 0, 4)?;
            let blocks = Blocks { scratch, scratch_bytes, memory: memory.cast(), bytes };
            let header = with_axes!(factors.dimensions, 2, multiply(&factors, &blocks))?;
            publish(memory.cast(), &header, tree, info);
        }
        Ok(())
    })
}

/// Trees that were checked.
struct Factors<'a> {
    trees: [Factor<'a>; MAX_FACTORS],
    count: usize,
    /// The axes of the first.
    dimensions: u32,
    /// The sum of the trees' exponents.
    exponent: i32,
}

impl<'a> Factors<'a> {
    /// # Safety
    /// The pointers are null or point to trees of this version.
    unsafe fn read(e: *const Tree, f: *const Tree, g: *const Tree) -> Checked<Factors<'a>> {
        let nothing = Factor::Line(tree::Tree::trusted(0, 0.0, &[], &[]));
        let count = if g.is_null() { 2 } else { 3 };
        let mut read = Factors { trees: [nothing; MAX_FACTORS], count, dimensions: 0, exponent: 0 };
        for (argument, (slot, tree)) in (1..).zip(read.trees.iter_mut().zip([e, f, g])).take(count) {
            // SAFETY: the caller's contract; the header tells the number of children.
            let (factor, exponent) = unsafe { factor(tree, argument)? };
            read.dimensions = if argument == 1 { factor.axes() } else { read.dimensions };
            if factor.axes() > read.dimensions {
                return Err(Failure::new(Status::InvalidArgument, argument));
            }
            *slot = factor;
            read.exponent = read.exponent.saturating_add(exponent);
        }
        Ok(read)
    }

    fn trees(&self) -> &[Factor<'a>] {
        self.trees.get(..self.count).unwrap_or(&[])
    }
}

/// A tree and its exponent.
///
/// # Safety
/// The handle is null or points to a tree of this version.
unsafe fn factor<'a>(tree: *const Tree, argument: u32) -> Checked<(Factor<'a>, i32)> {
    // SAFETY: the caller's contract; the header tells the number of children.
    unsafe {
        let object = Object::view(tree, argument)?;
        let factor = match object.header.dimensions {
            1 => Factor::Line(object.tree()),
            2 => Factor::Square(object.tree()),
            3 => Factor::Cube(object.tree()),
            _ => Factor::Tesseract(object.tree()),
        };
        Ok((factor, object.header.exponent))
    }
}

/// The squares of the product, or where counting them could cost more than all trees are large, the most that it can have.
fn count<const N: usize, const C: usize>(factors: &Factors) -> Checked<usize> {
    let alike = factors.trees().iter().all(|tree| tree.axes() == factors.dimensions);
    let squares = match alike {
        true => kernel::count::<C, MAX_FACTORS>(factors.trees(), &Times),
        false => kernel::most::<C>(factors.trees()),
    };
    Ok(squares.ok_or(Failure::new(Status::Overflow, 2))? as usize)
}

/// Where the parts of the scratch memory stand for so many squares.
struct Layout {
    places: usize,
    links: usize,
    bytes: usize,
}

fn layout<const C: usize, const K: usize>(squares: usize) -> Checked<Layout> {
    let parts = || {
        let places = squares.checked_mul(size_of::<[f64; C]>())?;
        let links = squares.checked_mul(size_of::<Place<K>>())?.checked_add(places)?;
        let bytes = squares.checked_mul(size_of::<Link>())?.checked_add(links)?;
        if bytes > isize::MAX as usize { None } else { Some(Layout { places, links, bytes }) }
    };
    parts().ok_or(Failure::new(Status::Overflow, 2))
}

fn layout_of_product<const N: usize, const C: usize>(squares: usize) -> Checked<Layout> {
    layout::<C, MAX_FACTORS>(squares)
}

fn layout_of_sum<const N: usize, const C: usize>(squares: usize) -> Checked<Layout> {
    layout::<C, WIS_MAX_BLEND>(squares)
}

/// What a result of so many squares needs.
fn needed(dimensions: u32, squares: usize, scratch: &Layout) -> Checked<MemorySize> {
    let stored = Stored::new(dimensions, squares).ok_or(Failure::new(Status::Overflow, 2))?;
    Ok(MemorySize { bytes: stored.bytes, align: WIS_ALIGNMENT, scratch_bytes: scratch.bytes })
}

/// The caller's memory: arguments 4 to 7 of both calls.
struct Blocks {
    scratch: ExclusiveBlock,
    scratch_bytes: usize,
    memory: *mut u8,
    bytes: usize,
}

/// # Safety
/// The blocks are the caller's to write.
unsafe fn multiply<const N: usize, const C: usize>(factors: &Factors, blocks: &Blocks) -> Checked<Header> {
    // SAFETY: the caller's contract.
    match unsafe { run::<C, MAX_FACTORS>(factors.trees(), &Times, factors.exponent, blocks)? } {
        Some(header) => Ok(header),
        None => Err(Failure::too_small(6, layout_of_product::<N, C>(count::<N, C>(factors)?)?.bytes)),
    }
}

/// Combines trees of at most C children and writes the result; `None` if the scratch memory is too short. Values are
/// those of the trees times `2^exponent`.
///
/// # Safety
/// The blocks are the caller's to write.
unsafe fn run<const C: usize, const K: usize>(
    trees: &[Factor],
    rule: &impl Rule<K>,
    exponent: i32,
    blocks: &Blocks,
) -> Checked<Option<Header>> {
    let room = blocks.scratch_bytes / (size_of::<[f64; C]>() + size_of::<Place<K>>() + size_of::<Link>());
    let Layout { places, links, .. } = layout::<C, K>(room)?;
    // SAFETY: the caller's contract; the parts do not overlap, and the trees are read only.
    unsafe {
        let mut parts = Scratch {
            places: blocks.scratch.slice::<Place<K>>(places, 0, room),
            values: blocks.scratch.slice::<[f64; C]>(0, 0, room),
            links: blocks.scratch.slice::<Link>(links, 0, room),
        };
        let Some(result) = kernel::combine::<C, K>(trees, rule, &mut parts) else { return Ok(None) };
        let (squares, dimensions) = (result.squares as usize, C.trailing_zeros());
        let stored = Stored::new(dimensions, squares).ok_or(Failure::new(Status::Overflow, 2))?;
        let block = ExclusiveBlock::new(blocks.memory, blocks.bytes, stored.bytes, 4)?;
        let kept = block.slice::<[f32; C]>(size_of::<Header>(), 0, squares);
        let links = block.slice::<Link>(stored.links, 0, squares);
        let (power, average) = kernel::store(parts.values.get(..squares).unwrap_or(&[]), result.mean, kept);
        let mean = match result.mean > 0.0 {
            true => mean_of(result.mean, exponent, exponent.saturating_add(power), 1)?,
            false => 0.0,
        };
        for (link, from) in links.iter_mut().zip(parts.links.iter()) {
            *link = *from;
        }
        let depth = trees.iter().map(Factor::depth).max().unwrap_or(0);
        let mut header = Header {
            magic: MAGIC,
            bytes: stored.bytes as u64,
            content_id: 0,
            mean,
            error: 0.0,
            dimensions,
            depth,
            squares: result.squares,
            exponent: if mean > 0.0 { exponent.saturating_add(power) } else { 0 },
            average,
            reserved: 0,
        };
        header.content_id = header.content_id(&tree::Tree::trusted(depth, average, kept, links));
        blocks.memory.cast::<Header>().write(header);
        Ok(Some(header))
    }
}

/// The memory that wis_tree_blend needs for these trees, at most. Costs one visit of each square of the sum.
/// Work: squares of all trees.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_blend_size(
    tree_count: u32,
    trees: *const *const Tree,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let terms = Terms::read(tree_count, trees)?;
            let size = out(size, 3)?;
            let squares = with_axes!(terms.dimensions, 2, count_sum(&terms, &[1.0; WIS_MAX_BLEND]))?;
            let scratch = with_axes!(terms.dimensions, 2, layout_of_sum(squares))?;
            size.write(needed(terms.dimensions, squares, &scratch)?);
        }
        Ok(())
    })
}

/// The weighted sum of 1 to WIS_MAX_BLEND trees of the same axes as a tree: what stands between tabulated functions, exactly
/// (Clarberg et al. 2005, Section 5.2: coefficients interpolate one by one). `weight`: finite, 0 or more. The product
/// (wis_tree_multiply) of two such sums is the bilinear blend of the products of all pairs. WIS_INVALID_ARGUMENT for another
/// number of trees, trees of different axes, or a weight out of range: `y` in the diagnostic is the number of the tree or the
/// weight. WIS_OVERFLOW as wis_tree_multiply.
///
/// Blocks may be longer than wis_tree_blend_size says; one that is too short fails with WIS_MEMORY_TOO_SMALL. The bytes in use
/// stand in `info`, which may be null; its `error` is 0. Work: squares of all trees.
///
/// # Safety
/// Pointers are null or point to what the header says; blocks are as long as stated and nobody else uses them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_blend(
    tree_count: u32,
    trees: *const *const Tree,
    weight: *const f64,
    memory: *mut c_void,
    bytes: usize,
    scratch: *mut c_void,
    scratch_bytes: usize,
    tree: *mut *const Tree,
    info: *mut TreeInfo,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract; the parts of the scratch memory are apart.
        unsafe {
            let terms = Terms::read(tree_count, trees)?;
            let weights = slice(weight, terms.count, 3)?;
            if let Some(wrong) = weights.iter().position(|weight| !(0.0..=f64::MAX).contains(weight)) {
                return Err(Failure::new(Status::InvalidArgument, 3).in_row(3, wrong));
            }
            check_results(tree, 8, info, 9)?;
            let scratch = ExclusiveBlock::new(scratch.cast(), scratch_bytes, scratch_bytes, 6)?;
            ExclusiveBlock::new(memory.cast(), bytes, 0, 4)?;
            let blocks = Blocks { scratch, scratch_bytes, memory: memory.cast(), bytes };
            let header = with_axes!(terms.dimensions, 2, add(&terms, weights, &blocks))?;
            publish(memory.cast(), &header, tree, info);
        }
        Ok(())
    })
}

/// Trees that are added up.
struct Terms<'a> {
    trees: [Factor<'a>; WIS_MAX_BLEND],
    exponents: [i32; WIS_MAX_BLEND],
    count: usize,
    dimensions: u32,
}

impl<'a> Terms<'a> {
    /// # Safety
    /// The pointer is null or points to `count` handles, which are null or point to trees of this version.
    unsafe fn read(count: u32, trees: *const *const Tree) -> Checked<Terms<'a>> {
        if !(1..=WIS_MAX_BLEND as u32).contains(&count) {
            return Err(Failure::new(Status::InvalidArgument, 1));
        }
        let nothing = Factor::Line(tree::Tree::trusted(0, 0.0, &[], &[]));
        let mut read = Terms {
            trees: [nothing; WIS_MAX_BLEND],
            exponents: [0; WIS_MAX_BLEND],
            count: count as usize,
            dimensions: 0,
        };
        // SAFETY: the caller's contract.
        let handles = unsafe { slice(trees, count as usize, 2)? };
        let slots = read.trees.iter_mut().zip(&mut read.exponents);
        for (k, (&handle, (slot, to_exponent))) in handles.iter().zip(slots).enumerate() {
            // SAFETY: the caller's contract.
            let (tree, exponent) = unsafe { factor(handle, 2) }.map_err(|at| at.in_row(2, k))?;
            read.dimensions = if k == 0 { tree.axes() } else { read.dimensions };
            if tree.axes() != read.dimensions {
                return Err(Failure::new(Status::InvalidArgument, 2).in_row(2, k));
            }
            (*slot, *to_exponent) = (tree, exponent);
        }
        Ok(read)
    }
}

/// Weights for what the trees store, and the power of two that was taken out: the largest term has a weight in [1, 2), so
/// that nothing overflows; a term of less than 2^-200 of it counts as that.
#[inline(never)]
fn stored_weights(terms: &Terms, weights: &[f64]) -> ([f64; WIS_MAX_BLEND], i32) {
    let power = |weight: f64, own: i32| exponent(weight).saturating_add(own);
    let mut largest = i32::MIN;
    for (&weight, &own) in weights.iter().zip(&terms.exponents) {
        if weight > 0.0 && power(weight, own) > largest {
            largest = power(weight, own);
        }
    }
    let mut stored = [0.0; WIS_MAX_BLEND];
    for (slot, (&weight, &own)) in stored.iter_mut().zip(weights.iter().zip(&terms.exponents)) {
        if weight > 0.0 {
            let (out, below) = (exponent(weight), power(weight, own).saturating_sub(largest));
            // Twice, since a weight may be as small as 2^-1074.
            let mantissa = weight * exp2i(-out / 2) * exp2i(-out - -out / 2);
            *slot = mantissa * exp2i(if below < -200 { -200 } else { below });
        }
    }
    (stored, if largest > i32::MIN { largest } else { 0 })
}

/// # Safety
/// The blocks are the caller's to write.
unsafe fn add<const N: usize, const C: usize>(terms: &Terms, weights: &[f64], blocks: &Blocks) -> Checked<Header> {
    let (scaled, largest) = stored_weights(terms, weights);
    let trees = terms.trees.get(..terms.count).unwrap_or(&[]);
    // SAFETY: the caller's contract.
    match unsafe { run::<C, WIS_MAX_BLEND>(trees, &Weighted(scaled), largest, blocks)? } {
        Some(header) => Ok(header),
        None => Err(Failure::too_small(6, layout_of_sum::<N, C>(count_sum::<N, C>(terms, &scaled)?)?.bytes)),
    }
}

fn count_sum<const N: usize, const C: usize>(terms: &Terms, weights: &[f64; WIS_MAX_BLEND]) -> Checked<usize> {
    let trees = terms.trees.get(..terms.count).unwrap_or(&[]);
    let squares = kernel::count::<C, WIS_MAX_BLEND>(trees, &Weighted(*weights));
    Ok(squares.ok_or(Failure::new(Status::Overflow, 2))? as usize)
}
