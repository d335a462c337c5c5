//! Wavelet trees of any function on the unit cube of one to four axes, in C.

use crate::ffi::wavelets::check_grid;
use crate::ffi::{
    Checked, Diagnostic, ExclusiveBlock, Failure, MemorySize, SharedBlock, WIS_ALIGNMENT, answer, borrow, out, sized,
    slice, slice_mut,
};
use crate::numeric::{ContentHash, times_power};
use crate::status::{Fault, Status};
use crate::wavelets::tree::{self as kernel, Link, complete_len};
use crate::wavelets::{image, inner, morton, prune, warp};
use core::ffi::c_void;
use core::ptr::null_mut;

pub mod combine;
pub mod rotated;
pub mod sparse;

/// The tree of a function: bytes in your memory without pointers, so it may be copied (to any block aligned to
/// WIS_ALIGNMENT), saved and mapped. Constant once built; any number of threads may use it at once. Nothing to free.
#[allow(missing_debug_implementations)]
pub struct Tree {
    _opaque: [u8; 0],
}

/// What to build.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TreeConfig {
    /// sizeof(wis_tree_config).
    pub size: u32,
    /// Axes n, 1 to 4.
    pub dimensions: u32,
    /// The grid has 2^depth pixels along each axis; 0 to 12.
    pub depth: u32,
    /// The variance that pruning may add to an estimate of the integral, relative to its square, 0 or more (0.01 =
    /// 1 %); 0 drops nothing but constant squares.
    pub error_budget: f32,
    /// 2^(n depth) values, C order: axis 1 slowest, the last axis fastest. Finite, 0 or more.
    pub pixels: *const f32,
}

/// What was built.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct TreeInfo {
    /// sizeof(wis_tree_info), set by the caller.
    pub size: u32,
    /// Axes.
    pub dimensions: u32,
    /// The grid has 2^depth pixels along each axis.
    pub depth: u32,
    /// Squares stored, each the averages of 2^n children.
    pub squares: u32,
    /// Bytes of the tree: that much of the block is in use and needs to be saved.
    pub bytes: u64,
    /// Tells trees apart: a hash of the bytes.
    pub content_id: u64,
    /// The average of the function.
    pub average: f64,
    /// The variance that pruning added, relative.
    pub error: f64,
}

/// The bytes that a tree needs at most (the bytes that are in use stand in wis_tree_info; a block that is too short
/// fails with WIS_MEMORY_TOO_SMALL and tells them). Does not read the pixels. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_size(
    config: *const TreeConfig,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        let request = Request::new(unsafe { sized(config, 1)? })?;
        let size = out(size, 2)?;
        let stored = request.stored(request.complete)?;
        let needed = MemorySize { bytes: stored.bytes, align: WIS_ALIGNMENT, scratch_bytes: request.scratch()?.bytes };
        // SAFETY: checked by `out`.
        unsafe { size.write(needed) };
        Ok(())
    })
}

/// Builds a tree. `info` may be null. WIS_INVALID_TEXEL: `x` is the position along the last axis, `y` the number of
/// the row. Work: pixels.
///
/// # Safety
/// Pointers are null or point to what the header says; blocks are as long as stated and nobody else uses them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_init(
    config: *const TreeConfig,
    memory: *mut c_void,
    bytes: usize,
    scratch: *mut c_void,
    scratch_bytes: usize,
    tree: *mut *const Tree,
    info: *mut TreeInfo,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let request = Request::new(sized(config, 1)?)?;
            check_results(tree, 6, info, 7)?;
            let pixels = request.pixels()?;
            let scratch = ExclusiveBlock::new(scratch.cast(), scratch_bytes, request.scratch()?.bytes, 4)?;
            // How long the block must be is known only when the tree is pruned.
            ExclusiveBlock::new(memory.cast(), bytes, 0, 2)?;
            let header = with_axes!(request.dimensions, 1, build(&request, pixels, &scratch, memory.cast(), bytes))?;
            publish(memory.cast(), &header, tree, info);
        }
        Ok(())
    })
}

/// Checks bytes that an earlier build wrote (copied, or mapped from a file) and gives them as a tree. WIS_CORRUPT if a byte
/// was changed. Reads all of them once. `info` may be null. Work: bytes.
///
/// # Safety
/// Pointers are null or point to what the header says; the bytes do not change while the tree is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_open(
    memory: *const c_void,
    bytes: usize,
    tree: *mut *const Tree,
    info: *mut TreeInfo,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            check_results(tree, 3, info, 4)?;
            let block = SharedBlock::new(memory.cast(), bytes, size_of::<Header>(), 1)?;
            let corrupt = Failure::new(Status::Corrupt, 1);
            let header = block.slice::<Header>(0, 0, 1).first().ok_or(corrupt)?;
            let stored = header.layout().filter(|stored| stored.bytes as u64 == header.bytes).ok_or(corrupt)?;
            let block = SharedBlock::new(memory.cast(), bytes, stored.bytes, 1)?;
            with_axes!(header.dimensions, 1, check(&Object { header, block }))?;
            publish(memory.cast(), header, tree, info);
        }
        Ok(())
    })
}

/// The average of the function. Work: constant.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_average(tree: *const Tree, average: *mut f64) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe { out(average, 2)?.write(Object::view(tree, 1)?.header.mean) };
        Ok(())
    })
}

/// The integral over the unit cube of the product of the stored functions. `f` has the first axes of `e`, at most as
/// many (else WIS_INVALID_ARGUMENT), and is constant along the rest. At least 0; WIS_OVERFLOW if it is beyond a double.
/// Costs one visit of each square that both trees keep. Work: squares.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_product_integral(e: *const Tree, f: *const Tree, integral: *mut f64) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let (e, f) = (Object::view(e, 1)?, Object::view(f, 2)?);
            let integral = out(integral, 3)?;
            integral.write(product_integral(&e, &f)?);
        }
        Ok(())
    })
}

/// Samples a point of the unit cube in proportion to the function. `u`: n numbers in [0, 1) (others are moved there,
/// NaN counts as 1/2); `point`: n numbers; `pdf`: the density there with respect to the cube. A tree that is 0
/// everywhere gives pdf 0. Work: depth.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_sample(tree: *const Tree, u: *const f32, point: *mut f32, pdf: *mut f32) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let tree = Object::view(tree, 1)?;
            with_axes!(tree.header.dimensions, 1, sample(&tree, u, point, pdf))
        }
    })
}

/// The density at any point (coordinates are moved into [0, 1)): the very bits that a sample came with. Work: depth.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_pdf(tree: *const Tree, point: *const f32, pdf: *mut f32) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let tree = Object::view(tree, 1)?;
            with_axes!(tree.header.dimensions, 1, pdf_at(&tree, point, pdf))
        }
    })
}

/// The `u` that leads to a point. WIS_ZERO_DENSITY if none does. Work: depth.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_invert(tree: *const Tree, point: *const f32, u: *mut f32) -> Status {
    answer(null_mut(), || {
        // SAFETY: the caller's contract.
        unsafe {
            let tree = Object::view(tree, 1)?;
            with_axes!(tree.header.dimensions, 1, invert(&tree, point, u))
        }
    })
}

/// Warps `count` points (n packed numbers each) in place; afterwards points of one cell stand together. The points
/// and `index` (your numbers of the points) are permuted alike; as a set, the points are those of wis_tree_sample to
/// the bit.
/// WIS_ZERO_DENSITY if the tree is 0 everywhere. Work: count x depth.
///
/// # Safety
/// Pointers are null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_warp_in_place(
    tree: *const Tree,
    points: *mut f32,
    index: *mut u32,
    count: usize,
    diagnostic: *mut Diagnostic,
) -> Status {
    answer(diagnostic, || {
        // SAFETY: the caller's contract.
        unsafe {
            let tree = Object::view(tree, 1)?;
            with_axes!(tree.header.dimensions, 1, warp_points(&tree, points, index, count))
        }
    })
}

/// A checked configuration.
#[derive(Clone, Copy)]
struct Request {
    dimensions: u32,
    depth: u32,
    budget: f32,
    pixels: *const f32,
    /// Squares of the complete tree.
    complete: usize,
    /// The pixels are those of the input times 2^-exponent.
    exponent: i32,
    /// Which argument is the block of the tree.
    memory: u32,
}

impl Request {
    fn new(config: &TreeConfig) -> Checked<Request> {
        for (holds, field) in [
            ((1..=4).contains(&config.dimensions), c"dimensions"),
            (config.depth <= kernel::MAX_DEPTH, c"depth"),
            (config.error_budget >= 0.0, c"error_budget"),
        ] {
            if !holds {
                return Err(Failure::fault(Fault::range(field), 1));
            }
        }
        let complete =
            with_axes!(config.dimensions, 1, complete_squares(config.depth)).map_err(|at| at.of(c"depth"))?;
        Ok(Request {
            dimensions: config.dimensions,
            depth: config.depth,
            budget: config.error_budget,
            pixels: config.pixels,
            complete,
            exponent: 0,
            memory: 2,
        })
    }

    /// # Safety
    /// The configuration's pixels are readable.
    unsafe fn pixels<'a>(&self) -> Checked<&'a [f32]> {
        let count = morton::cells(self.dimensions, self.depth).ok_or(Failure::new(Status::Overflow, 1))?;
        // SAFETY: the caller's contract.
        let pixels = unsafe { slice(self.pixels, count, 1) }.map_err(|at| at.of(c"pixels"))?;
        match image::first_invalid(pixels) {
            Some(pixel) => {
                let along = |value: usize| u32::try_from(value).unwrap_or(u32::MAX);
                let (x, y) = (pixel & ((1 << self.depth) - 1), pixel >> self.depth);
                Err(Failure::at(Status::InvalidTexel, 1, along(x), along(y)).of(c"pixels"))
            }
            None => Ok(pixels),
        }
    }

    fn stored(&self, squares: usize) -> Checked<Stored> {
        Stored::new(self.dimensions, squares).ok_or(Failure::new(Status::Overflow, 1))
    }

    fn scratch(&self) -> Checked<Scratch> {
        let squares_bytes = self.complete.checked_mul(children(self.dimensions) * size_of::<f32>());
        let savings = squares_bytes.ok_or(Failure::new(Status::Overflow, 1))?;
        let bytes = self.complete.checked_mul(size_of::<f64>()).and_then(|bytes| bytes.checked_add(savings));
        match bytes {
            Some(bytes) if bytes <= isize::MAX as usize => Ok(Scratch { savings, bytes }),
            _ => Err(Failure::new(Status::Overflow, 1)),
        }
    }
}

fn complete_squares<const N: usize, const C: usize>(depth: u32) -> Checked<usize> {
    complete_len::<C>(depth).map(|len| len as usize).ok_or(Failure::new(Status::Overflow, 1))
}

fn children(dimensions: u32) -> usize {
    1usize.wrapping_shl(dimensions)
}

/// The scratch block: the squares of the complete tree, then what keeping each saves.
struct Scratch {
    savings: usize,
    bytes: usize,
}

/// The first bytes of a stored tree.
#[repr(C)]
#[derive(Clone, Copy)]
struct Header {
    magic: u64,
    bytes: u64,
    content_id: u64,
    mean: f64,
    error: f64,
    dimensions: u32,
    depth: u32,
    squares: u32,
    exponent: i32,
    average: f32,
    reserved: u32,
}

/// The exponents that a tree may have: its mean is a double, which is in [1, 2) times the power of two.
const EXPONENTS: core::ops::RangeInclusive<i32> = -1022..=1023;

/// A mean that a tree with such an exponent can have, from what it stores.
fn mean_of(stored: f64, power: i32, exponent: i32, argument: u32) -> Checked<f64> {
    let mean = times_power(stored, power);
    let lost = mean <= 0.0 && stored > 0.0;
    let fits = EXPONENTS.contains(&exponent) && mean <= f64::MAX && !lost;
    if fits { Ok(mean) } else { Err(Failure::new(Status::Overflow, argument)) }
}

/// A result in the units of the input, from one in the units of what is stored.
pub(super) fn in_units(stored: f64, exponents: &[i32], argument: u32) -> Checked<f64> {
    let exponent = exponents.iter().fold(0i32, |sum, exponent| sum.saturating_add(*exponent));
    let value = times_power(stored, exponent);
    if value.is_finite() { Ok(value) } else { Err(Failure::new(Status::Overflow, argument)) }
}

/// "wis-tre" and the version of the format.
const MAGIC: u64 = u64::from_le_bytes(*b"wis-tre\x02");

impl Header {
    /// Where the parts stand; `None` if this is not the header of a tree.
    fn layout(&self) -> Option<Stored> {
        if self.magic != MAGIC || check_grid(self.dimensions, self.depth).is_err() {
            return None;
        }
        Stored::new(self.dimensions, self.squares as usize)
    }

    /// Whether mean and error are finite, and the mean is what average and exponent say.
    fn is_possible(&self) -> bool {
        let finite = [self.mean, self.error].iter().all(|value| (0.0..=f64::MAX).contains(value));
        let told = times_power(self.average.into(), self.exponent);
        // The average is rounded, and a mean below 2^-1022 is rounded twice.
        let rounding = self.mean * 1e-6 + f64::MIN_POSITIVE * 1e-9;
        finite && EXPONENTS.contains(&self.exponent) && (self.mean - told).abs() <= rounding
    }

    /// The hash of everything but the id itself.
    fn content_id<const C: usize>(&self, tree: &kernel::Tree<C>) -> u64 {
        let mut hash = ContentHash::new();
        for word in [self.magic, self.bytes, self.mean.to_bits(), self.error.to_bits(), self.exponent as u64] {
            hash.add(word);
        }
        for word in [self.dimensions, self.depth, self.squares, self.average.to_bits()] {
            hash.add(word.into());
        }
        for square in tree.squares() {
            hash.add_floats(square);
        }
        for link in tree.links() {
            hash.add(u64::from(link.first) << 32 | u64::from(link.mask));
        }
        hash.finish()
    }
}

/// Where the parts of a stored tree stand, behind the header.
#[derive(Clone, Copy)]
struct Stored {
    links: usize,
    bytes: usize,
}

impl Stored {
    fn new(dimensions: u32, squares: usize) -> Option<Stored> {
        let links = squares.checked_mul(children(dimensions) * size_of::<f32>())?.checked_add(size_of::<Header>())?;
        let bytes = squares.checked_mul(size_of::<Link>())?.checked_add(links)?;
        if bytes > isize::MAX as usize { None } else { Some(Stored { links, bytes }) }
    }
}

/// A stored tree behind a handle.
struct Object<'a> {
    header: &'a Header,
    block: SharedBlock,
}

impl<'a> Object<'a> {
    /// # Safety
    /// The handle is null or points to a tree that this version built or opened.
    #[inline(always)]
    unsafe fn view(tree: *const Tree, argument: u32) -> Checked<Object<'a>> {
        // SAFETY: the caller's contract; a header is at least aligned.
        let header = unsafe { borrow(tree.cast::<Header>(), argument)? };
        let stored = header.layout().ok_or(Failure::new(Status::Mismatch, argument))?;
        let block = SharedBlock::new(tree.cast(), stored.bytes, stored.bytes, argument)?;
        Ok(Object { header, block })
    }

    /// The squares and links.
    ///
    /// # Safety
    /// The block is as long as the header says, has `C` children a square, and nobody writes it.
    #[inline(always)]
    unsafe fn parts<const C: usize>(&self) -> (&'a [[f32; C]], &'a [Link]) {
        let count = self.header.squares as usize;
        let links = size_of::<Header>() + count * size_of::<[f32; C]>();
        // SAFETY: the caller's contract; the parts lie inside the block.
        unsafe { (self.block.slice(size_of::<Header>(), 0, count), self.block.slice(links, 0, count)) }
    }

    /// # Safety
    /// As [`Object::parts`].
    #[inline(always)]
    unsafe fn tree<const C: usize>(&self) -> kernel::Tree<'a, C> {
        // SAFETY: the caller's contract.
        let (squares, links) = unsafe { self.parts::<C>() };
        kernel::Tree::trusted(self.header.depth, self.header.average, squares, links)
    }
}

/// Builds the complete tree in scratch memory and writes the squares that the budget keeps.
///
/// # Safety
/// Blocks are the caller's to write.
unsafe fn build<const N: usize, const C: usize>(
    request: &Request,
    pixels: &[f32],
    scratch: &ExclusiveBlock,
    memory: *mut u8,
    bytes: usize,
) -> Checked<Header> {
    // SAFETY: the caller's contract; the parts do not overlap.
    unsafe {
        let squares = scratch.slice::<[f32; C]>(0, 0, request.complete);
        let savings = scratch.slice::<f64>(request.scratch()?.savings, 0, request.complete);
        let scale = image::build::<N, C>(request.depth, pixels, squares)?;
        let complete = kernel::Tree::trusted(request.depth, scale.average, squares, &[]);
        let planned = prune::plan(&complete, request.budget.into(), savings)?;
        let stored = request.stored(planned.squares as usize)?;
        let block = ExclusiveBlock::new(memory, bytes, stored.bytes, request.memory)?;
        let count = planned.squares as usize;
        let kept = block.slice::<[f32; C]>(size_of::<Header>(), 0, count);
        let links = block.slice::<Link>(stored.links, 0, count);
        prune::write(&complete, savings, kept, links)?;
        let mut header = Header {
            magic: MAGIC,
            bytes: stored.bytes as u64,
            content_id: 0,
            mean: times_power(scale.mean, request.exponent),
            error: planned.error,
            dimensions: request.dimensions,
            depth: request.depth,
            squares: planned.squares,
            exponent: scale.exponent.saturating_add(request.exponent),
            average: scale.average,
            reserved: 0,
        };
        header.content_id = header.content_id(&kernel::Tree::trusted(request.depth, scale.average, kept, links));
        memory.cast::<Header>().write(header);
        Ok(header)
    }
}

/// Checks everything in stored bytes that later calls rely on.
///
/// # Safety
/// As [`Object::parts`].
unsafe fn check<const N: usize, const C: usize>(object: &Object) -> Checked<()> {
    // SAFETY: the caller's contract.
    let (squares, links) = unsafe { object.parts::<C>() };
    let corrupt = Failure::new(Status::Corrupt, 1);
    let header = object.header;
    let tree = kernel::Tree::sparse(header.depth, header.average, squares, links).map_err(|_| corrupt)?;
    let sound = header.reserved == 0 && header.is_possible() && header.content_id == header.content_id(&tree);
    if sound { Ok(()) } else { Err(corrupt) }
}

/// Checks the pointers to the results of a build.
///
/// # Safety
/// Pointers are null or point to what the header says.
unsafe fn check_results(
    tree: *mut *const Tree,
    tree_argument: u32,
    info: *mut TreeInfo,
    info_argument: u32,
) -> Checked<()> {
    out(tree, tree_argument)?;
    if !info.is_null() {
        // SAFETY: the caller's contract.
        unsafe { sized(info.cast_const(), info_argument)? };
    }
    Ok(())
}

/// Writes the results of a build or an opening.
///
/// # Safety
/// [`check_results`] accepted the pointers.
unsafe fn publish(memory: *const Tree, header: &Header, tree: *mut *const Tree, info: *mut TreeInfo) {
    // SAFETY: checked before; info may be null.
    unsafe {
        tree.write(memory);
        if !info.is_null() {
            info.write(TreeInfo {
                size: size_of::<TreeInfo>() as u32,
                dimensions: header.dimensions,
                depth: header.depth,
                squares: header.squares,
                bytes: header.bytes,
                content_id: header.content_id,
                average: header.mean,
                error: header.error,
            });
        }
    }
}

/// A tree of two dimensions, and the exponent of the power of two that its stored values are to be multiplied by.
///
/// # Safety
/// The handle is null or points to a tree of this version.
pub(super) unsafe fn square_tree<'a>(tree: *const Tree, argument: u32) -> Checked<(kernel::Tree<'a, 4>, i32)> {
    // SAFETY: the caller's contract; the header tells the number of children.
    unsafe {
        let object = Object::view(tree, argument)?;
        if object.header.dimensions != 2 {
            return Err(Failure::new(Status::InvalidArgument, argument));
        }
        Ok((object.tree::<4>(), object.header.exponent))
    }
}

/// # Safety
/// The objects are trees of this version.
unsafe fn product_integral(e: &Object, f: &Object) -> Checked<f64> {
    // SAFETY: the caller's contract; the header tells the number of children.
    let integral = unsafe {
        match (e.header.dimensions, f.header.dimensions) {
            (1, 1) => inner::integral(&e.tree::<2>(), &f.tree::<2>()),
            (2, 1) => inner::integral(&e.tree::<4>(), &f.tree::<2>()),
            (2, 2) => inner::integral(&e.tree::<4>(), &f.tree::<4>()),
            (3, 1) => inner::integral(&e.tree::<8>(), &f.tree::<2>()),
            (3, 2) => inner::integral(&e.tree::<8>(), &f.tree::<4>()),
            (3, 3) => inner::integral(&e.tree::<8>(), &f.tree::<8>()),
            (4, 1) => inner::integral(&e.tree::<16>(), &f.tree::<2>()),
            (4, 2) => inner::integral(&e.tree::<16>(), &f.tree::<4>()),
            (4, 3) => inner::integral(&e.tree::<16>(), &f.tree::<8>()),
            (4, 4) => inner::integral(&e.tree::<16>(), &f.tree::<16>()),
            _ => return Err(Failure::new(Status::InvalidArgument, 2)),
        }
    };
    in_units(integral, &[e.header.exponent, f.header.exponent], 3)
}

/// # Safety
/// As wis_tree_sample, for a tree of `N` axes.
#[inline(always)]
unsafe fn sample<const N: usize, const C: usize>(
    tree: &Object,
    u: *const f32,
    point: *mut f32,
    pdf: *mut f32,
) -> Checked<()> {
    // SAFETY: the caller's contract.
    unsafe {
        let u = *borrow(u.cast::<[f32; N]>(), 2)?;
        let (point, pdf) = (out(point.cast::<[f32; N]>(), 3)?, out(pdf, 4)?);
        let none = warp::Sample { point: [0.0; N], pdf: 0.0 };
        let sample = warp::sample(&tree.tree::<C>(), u).unwrap_or(none);
        point.write(sample.point);
        pdf.write(sample.pdf);
    }
    Ok(())
}

/// # Safety
/// As wis_tree_pdf, for a tree of `N` axes.
#[inline(always)]
unsafe fn pdf_at<const N: usize, const C: usize>(tree: &Object, point: *const f32, pdf: *mut f32) -> Checked<()> {
    // SAFETY: the caller's contract.
    unsafe {
        let point = *borrow(point.cast::<[f32; N]>(), 2)?;
        out(pdf, 3)?.write(warp::pdf(&tree.tree::<C>(), point));
    }
    Ok(())
}

/// # Safety
/// As wis_tree_invert, for a tree of `N` axes.
#[inline(always)]
unsafe fn invert<const N: usize, const C: usize>(tree: &Object, point: *const f32, u: *mut f32) -> Checked<()> {
    // SAFETY: the caller's contract.
    unsafe {
        let point = *borrow(point.cast::<[f32; N]>(), 2)?;
        let u = out(u.cast::<[f32; N]>(), 3)?;
        u.write(warp::invert(&tree.tree::<C>(), point).map_err(|status| Failure::new(status, 2))?);
    }
    Ok(())
}

/// # Safety
/// As wis_warp_in_place, for a tree of `N` axes.
#[inline(always)]
unsafe fn warp_points<const N: usize, const C: usize>(
    tree: &Object,
    points: *mut f32,
    index: *mut u32,
    count: usize,
) -> Checked<()> {
    // SAFETY: the caller's contract.
    unsafe {
        if count.checked_mul(size_of::<[f32; N]>()).is_none_or(|bytes| bytes > isize::MAX as usize) {
            return Err(Failure::new(Status::Overflow, 4));
        }
        let points = slice_mut(points.cast::<[f32; N]>(), count, 2)?;
        let index = slice_mut(index, count, 3)?;
        warp::warp_in_place(&tree.tree::<C>(), points, index).map_err(|status| Failure::new(status, 1))?;
    }
    Ok(())
}
