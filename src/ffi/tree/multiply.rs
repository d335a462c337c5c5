//! Products of trees in C.

use super::super::{Block, Checked, Diagnostic, Failure, MemorySize, WIS_ALIGNMENT, answer, out};
use super::{Header, MAGIC, Object, Stored, Tree, TreeInfo, check_results, publish};
use crate::multiply::{self as kernel, Factor, MAX_FACTORS, Place, Scratch};
use crate::numeric::exp2i;
use crate::status::Status;
use crate::tree::{self, Link};
use core::ffi::c_void;

/// The memory that wis_tree_multiply needs for these trees, `g` may be null. Costs one visit of each square of the product.
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
            let overflow = Failure::new(Status::Overflow, 2);
            let stored = Stored::new(factors.dimensions, squares).ok_or(overflow)?;
            let scratch_bytes = with_axes!(factors.dimensions, 2, layout(squares))?.bytes;
            size.write(MemorySize { bytes: stored.bytes, align: WIS_ALIGNMENT, scratch_bytes });
        }
        Ok(())
    })
}

/// Multiplies two or three trees into a tree: sampled, saved and multiplied like any other. `f` and `g` (null: 1) have the
/// first axes of `e`, at most as many, and are constant along the rest. The averages are exact but for rounding (Clarberg
/// et al. 2005, Section 4.3; with light, BRDF x cosine and visibility as factors the triple product of Ng et al. 2004).
/// `error` in `info`, which may be null, is 0: what was dropped from the factors is not counted.
///
/// Blocks may be longer than wis_tree_multiply_size says, and serve for many products; one that is too short fails with
/// WIS_MEMORY_TOO_SMALL. The bytes in use stand in `info`.
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
            let scratch = Block::new(scratch.cast(), scratch_bytes, scratch_bytes, 6)?;
            Block::new(memory.cast(), bytes, 0, 4)?;
            let header =
                with_axes!(factors.dimensions, 2, run(&factors, &scratch, scratch_bytes, memory.cast(), bytes))?;
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

    fn depth(&self) -> u32 {
        self.trees().iter().map(Factor::depth).fold(0, |deepest, depth| if depth > deepest { depth } else { deepest })
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

fn count<const N: usize, const C: usize>(factors: &Factors) -> Checked<usize> {
    let squares = kernel::count::<C>(factors.trees()).ok_or(Failure::new(Status::Overflow, 2))?;
    Ok(squares as usize)
}

/// Where the parts of the scratch memory stand for so many squares.
struct Layout {
    places: usize,
    links: usize,
    bytes: usize,
}

fn layout<const N: usize, const C: usize>(squares: usize) -> Checked<Layout> {
    let parts = || {
        let places = squares.checked_mul(size_of::<[f64; C]>())?;
        let links = squares.checked_mul(size_of::<Place>())?.checked_add(places)?;
        let bytes = squares.checked_mul(size_of::<Link>())?.checked_add(links)?;
        if bytes > isize::MAX as usize { None } else { Some(Layout { places, links, bytes }) }
    };
    parts().ok_or(Failure::new(Status::Overflow, 2))
}

/// # Safety
/// The blocks are the caller's to write.
unsafe fn run<const N: usize, const C: usize>(
    factors: &Factors,
    scratch: &Block,
    scratch_bytes: usize,
    memory: *mut u8,
    bytes: usize,
) -> Checked<Header> {
    let room = scratch_bytes / (size_of::<[f64; C]>() + size_of::<Place>() + size_of::<Link>());
    let Layout { places, links, .. } = layout::<N, C>(room)?;
    // SAFETY: the caller's contract; the parts do not overlap, and the trees are read only.
    unsafe {
        let mut parts = Scratch {
            places: scratch.slice::<Place>(places, 0, room),
            values: scratch.slice::<[f64; C]>(0, 0, room),
            links: scratch.slice::<Link>(links, 0, room),
        };
        let product = match kernel::multiply::<C>(factors.trees(), &mut parts) {
            Some(product) => product,
            None => return Err(Failure::too_small(6, self::layout::<N, C>(count::<N, C>(factors)?)?.bytes)),
        };
        let squares = product.squares as usize;
        let stored = Stored::new(factors.dimensions, squares).ok_or(Failure::new(Status::Overflow, 2))?;
        let block = Block::new(memory, bytes, stored.bytes, 4)?;
        let kept = block.slice::<[f32; C]>(size_of::<Header>(), 0, squares);
        let links = block.slice::<Link>(stored.links, 0, squares);
        let (power, average) = kernel::store(parts.values.get(..squares).unwrap_or(&[]), product.mean, kept);
        for (link, from) in links.iter_mut().zip(parts.links.iter()) {
            *link = *from;
        }
        let depth = factors.depth();
        let mut header = Header {
            magic: MAGIC,
            bytes: stored.bytes as u64,
            content_id: 0,
            mean: finite(product.mean * exp2i(factors.exponent)),
            error: 0.0,
            dimensions: factors.dimensions,
            depth,
            squares: product.squares,
            exponent: factors.exponent.saturating_add(power),
            average,
            reserved: 0,
        };
        header.content_id = header.content_id(&tree::Tree::trusted(depth, average, kept, links));
        memory.cast::<Header>().write(header);
        Ok(header)
    }
}

/// A mean that a tree can hold.
fn finite(mean: f64) -> f64 {
    if mean < f64::MAX { mean } else { f64::MAX }
}
