//! Wavelet trees of any function on the unit cube of two or four axes, in C: built of pixels, of trees, of wavelets or of an environment,
//! as the source of the configuration says.

pub use crate::wavelets::stored::TreeInfo;

use crate::blob::Size;
use crate::ffi::light::{EnvironmentObject, environment};
use crate::ffi::memory::{block_mut, handle, stored_or};
use crate::ffi::wavelets::ordered;
use crate::ffi::{
    Checked, Diagnostic, MemorySize, answer, frame, out, put, put_size, require_all, sized, slice, slice_mut,
};
use crate::status::{Error, Status};
use crate::wavelets::combine::{MAX_FACTORS, WIS_MAX_BLEND, add_in, multiply_in, product_size, sum_size};
use crate::wavelets::image::{self, Config};
use crate::wavelets::rotated::Rotation;
use crate::wavelets::sparse::{self, Sparse};
use crate::wavelets::stored::{AnyTree, Header, Stored, in_units};
use crate::wavelets::triple::{Wavelets, disorder};
use crate::wavelets::{morton, tree as kernel};
use bytemuck::cast_slice_mut;
use core::ffi::c_void;
use core::ops::RangeInclusive;
use core::ptr::{null, null_mut};

/// The tree of a function: bytes in your memory without pointers, so it may be copied (to any block aligned to
/// WIS_ALIGNMENT), saved and mapped. Constant once built; any number of threads may use it at once. Nothing to free.
#[allow(missing_debug_implementations)]
pub struct Tree {
    _opaque: [u8; 0],
}

/// Source of a tree: values on a grid. It reads `dimensions`, `depth`, `error_budget` and `pixels`.
///
/// wis_tree_size tells the bytes that the tree needs at most (the bytes that are in use stand in wis_tree_info; a block that is
/// too short fails with WIS_MEMORY_TOO_SMALL and tells them). It does not read the pixels. WIS_INVALID_TEXEL: `x` is the position
/// along the last axis, `y` the number of the row. Work: pixels.
pub const WIS_TREE_PIXELS: u32 = 0;
/// Source of a tree: the product of two or three trees, sampled, saved and multiplied like any other. It reads `tree_count` and
/// `trees`. Trees behind the first have its first axes, at most as many, and are constant along the rest. The averages are exact
/// but for rounding (Clarberg et al. 2005, Section 4.3; with light, BRDF x cosine and visibility as factors the triple product of
/// Ng et al. 2004). `error` in wis_tree_info is 0: what was dropped from the factors is not counted. WIS_INVALID_ARGUMENT for
/// another number of trees, or if a tree has more axes than the first: `y` in the diagnostic is its number. WIS_OVERFLOW if the
/// average is above 0 and below 2^-1022, or beyond a double.
///
/// If all trees have the same axes the size is exact, and costs one visit of each square of the product. Otherwise it is an upper
/// bound, and costs one visit of each square of the trees. WIS_OVERFLOW if there may be more than 2^32 - 2 squares.
///
/// Blocks may be longer than wis_tree_size says, and serve for many products. They may be shorter, too: the call answers
/// WIS_MEMORY_TOO_SMALL as soon as the product exceeds the scratch block, or at the end if it exceeds the other one. The
/// diagnostic then tells enough bytes, of the scratch block as wis_tree_size does. Work: squares of the trees and of the product.
pub const WIS_TREE_PRODUCT: u32 = 1;
/// Source of a tree: a blend, the weighted sum of 1 to WIS_MAX_BLEND trees of the same axes. It reads `tree_count`, `trees` and
/// `weight`. The sum is what stands between tabulated functions, exactly (Clarberg et al. 2005, Section 5.2: coefficients
/// interpolate one by one). The product of two such sums is the bilinear blend of the products of all pairs. WIS_INVALID_ARGUMENT
/// for another number of trees, trees of different axes, or a weight out of range: `y` in the diagnostic is the number of the
/// tree or the weight. WIS_OVERFLOW as for WIS_TREE_PRODUCT. `error` in wis_tree_info is 0.
///
/// wis_tree_size does not read the weights, and costs one visit of each square of the sum. Blocks may be longer than it says; one
/// that is too short fails with WIS_MEMORY_TOO_SMALL. Work: squares of all trees.
pub const WIS_TREE_BLEND: u32 = 2;
/// Source of a tree: the average of a function of two axes and any set of its wavelets in order, free thresholding as the papers
/// print it. It reads `average`, `count`, `wavelets` and `least`. Such a function may be negative or 0 where what it approximates
/// is not. Values below `least` are raised to it, and the tree is that of the raised function, in average, sample and pdf alike.
/// A `least` above 0 keeps the pdf above 0 everywhere. WIS_INVALID_ARGUMENT if the list is out of order (`y` in the diagnostic is
/// the first element that is), or if values are too large for a tree: above 2^120 times the average. WIS_OVERFLOW if the tree's
/// average is beyond a double.
///
/// The size is exactly the bytes in use, without scratch memory. wis_tree_size does not read `average` and `least`. Work: count.
pub const WIS_TREE_WAVELETS: u32 = 3;
/// Source of a tree: the luminance of an environment over the octahedral square of another frame, a map that is rotated about a
/// direction (Clarberg et al. 2005, Section 6.1). It reads `depth`, `error_budget`, `least`, `environment` and `world_from_tree`.
/// With a BRDF that is tabulated about the same direction WIS_TREE_PRODUCT gives their product; WIS_TREE_BLEND interpolates
/// between directions, wis_grid_cells says which.
///
/// Each patch of the light hands its share out to the pixels that it covers, so that `average` in wis_tree_info is the power in
/// wis_environment_info over 4 pi: no lamp is lost, however small. Pixels of an even sky differ by 0.6 % (root mean square). Of a
/// compensated environment it is the tree of what compensation leaves. wis_tree_size tells the bytes that the tree needs at most, and
/// reads neither the environment nor the matrix.
/// Work: (columns + 2^depth) x (rows + 2^depth), of the map with all its faces.
pub const WIS_TREE_ENVIRONMENT: u32 = 4;

/// What to build. Fields that the source does not read need not be set.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TreeConfig {
    /// sizeof(wis_tree_config).
    pub size: u32,
    /// What the tree is made of: a WIS_TREE_ constant, which tells the fields that are read. 0 is WIS_TREE_PIXELS.
    pub source: u32,
    /// Of pixels: axes n, 2 (a direction) or 4 (two directions).
    pub dimensions: u32,
    /// Of pixels and environments: the grid has 2^depth pixels along each axis; 0 to 12. For environments the paper has 6 and 7.
    pub depth: u32,
    /// Of pixels and environments: the variance that pruning may add to an estimate of the integral, relative to its square, 0 or
    /// more (0.01 = 1 %); 0 drops nothing but constant squares.
    pub error_budget: f32,
    /// Of pixels: 2^(n depth) values, C order: axis 1 slowest, the last axis fastest. Finite, 0 or more.
    pub pixels: *const f32,
    /// Of products, 2 or 3, and of blends, 1 to WIS_MAX_BLEND: how many trees.
    pub tree_count: u32,
    /// Of products and blends: the trees.
    pub trees: *const *const Tree,
    /// Of blends: a weight for each tree, finite, 0 or more.
    pub weight: *const f64,
    /// Of wavelets: the average of the function, finite.
    pub average: f64,
    /// Of wavelets: elements of the list.
    pub count: u32,
    /// Of wavelets: the list, in order.
    pub wavelets: *const Wavelets,
    /// Of wavelets: the value that smaller ones are raised to, finite, 0 or more. Of environments: the share of the
    /// map's mean that is added to each pixel, 0 to 1e6: what keeps the pdf above 0 wherever there is light.
    pub least: f64,
    /// Of environments: the map.
    pub environment: *const EnvironmentObject,
    /// Of environments: nine numbers, row by row: world = M tree, within 1e-4 of a rotation or reflection. The direction about which
    /// the map is rotated is the third column. Null is the identity.
    pub world_from_tree: *const f32,
}

/// The memory of a tree, as its source tells. WIS_INVALID_ARGUMENT with the field `source` for a number that is none.
/// Work: constant for pixels and environments; count for lists; else squares of the trees and of the result.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_size(
    config: *const TreeConfig,
    size: *mut MemorySize,
    diagnostic: *mut Diagnostic,
) -> Status {
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let config = sized(config, 1)?;
        let needed = Source::read(config).and_then(|source| source.size());
        put_size(size, 2, needed.map_err(|error| placed(error, config)))
    })
}

/// Builds a tree of what its configuration says. Each source tells its statuses, the bounds of its blocks and its work.
/// `scratch` may be null where wis_tree_size asks for none. `info` may be null. The bytes in use stand in `info`.
/// Work: pixels; (columns + 2^depth) x (rows + 2^depth) for environments; count for lists; else squares of the trees and of the result.
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
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let config = sized(config, 1)?;
        check_results(tree, info, 6)?;
        let blocks = Blocks { memory, bytes, scratch, scratch_bytes };
        let built = Source::read(config).and_then(|source| source.build(config, &blocks));
        publish(memory, &built.map_err(|error| placed(error, config))?, tree, info);
        Ok(())
    })
}

/// Checks bytes that an earlier build wrote (copied, or mapped from a file) and gives them as a tree. WIS_CORRUPT if a byte
/// was changed; with the field `magic` in the diagnostic if another version of wis wrote them. Reads all of them once. `info`
/// may be null. Work: bytes.
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
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        check_results(tree, info, 3)?;
        let opened = Stored::open(stored_or(Status::Corrupt, memory, bytes, 1, Header::checked_length)?);
        publish(memory, opened.map_err(|status| Error::new(status, 1))?.header, tree, info);
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
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let (e, f) = (view(e, 1)?, view(f, 2)?);
        let product = e.tree.product_integral(&f.tree).ok_or(Error::new(Status::InvalidArgument, 2));
        put(integral, 3, product.and_then(|sum| integral_of(sum, &[e.header.exponent, f.header.exponent], 3)))
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
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let tree = view(tree, 1)?.tree;
        let axes = tree.axes() as usize;
        let (u, point) = (slice(u, axes, 2)?, slice_mut(point, axes, 3)?);
        out(pdf, 4)?.write(tree.sample(u, point));
        Ok(())
    })
}

/// The density at any point (coordinates are moved into [0, 1)): the very bits that a sample came with. Work: depth.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_pdf(tree: *const Tree, point: *const f32, pdf: *mut f32) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let tree = view(tree, 1)?.tree;
        let point = slice(point, tree.axes() as usize, 2)?;
        out(pdf, 3)?.write(tree.pdf(point));
        Ok(())
    })
}

/// The `u` that leads to a point. WIS_ZERO_DENSITY if none does. Work: depth.
///
/// # Safety
/// Pointers are null or point to what the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wis_tree_invert(tree: *const Tree, point: *const f32, u: *mut f32) -> Status {
    // SAFETY: the caller's contract.
    answer(null_mut(), || unsafe {
        let tree = view(tree, 1)?.tree;
        let axes = tree.axes() as usize;
        let (point, u) = (slice(point, axes, 2)?, slice_mut(u, axes, 3)?);
        tree.invert(point, u).map_err(|status| Error::new(status, 2))
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
    // SAFETY: the caller's contract.
    answer(diagnostic, || unsafe {
        let tree = view(tree, 1)?.tree;
        let numbers = count.checked_mul(tree.axes() as usize).filter(|n| *n <= isize::MAX as usize / size_of::<f32>());
        let numbers = numbers.ok_or(Error::new(Status::Overflow, 4))?;
        let (points, index) = (slice_mut(points, numbers, 2)?, slice_mut(index, count, 3)?);
        tree.warp_in_place(points, index).map_err(|status| Error::new(status, 1))
    })
}

/// Checks where a tree goes, and behind that argument what was built, which may be null.
///
/// # Safety
/// They are null or point to what the header says.
unsafe fn check_results(tree: *mut *const Tree, info: *mut TreeInfo, argument: u32) -> Checked<()> {
    out(tree, argument)?;
    // SAFETY: the caller's contract.
    if info.is_null() { Ok(()) } else { unsafe { sized(info.cast_const(), argument + 1) }.map(|_| ()) }
}

/// Writes the tree that begins at `memory`, and what was built.
///
/// # Safety
/// The pointers were checked by [`check_results`].
unsafe fn publish(memory: *const c_void, header: &Header, tree: *mut *const Tree, info: *mut TreeInfo) {
    // SAFETY: the caller's contract.
    unsafe {
        tree.write(memory.cast());
        if !info.is_null() {
            info.write(header.info());
        }
    }
}

/// What a tree is made of, checked as far as its size depends on it. Errors without an argument are of the configuration, and without a
/// field of what its source is about: see [`placed`].
enum Source<'a> {
    Pixels(Config),
    Product(Trees<'a>),
    Blend(Trees<'a>),
    Wavelets(&'a [Wavelets]),
    Environment(Rotation),
}

impl<'a> Source<'a> {
    /// # Safety
    /// What the source reads is what the header says.
    unsafe fn read(config: &TreeConfig) -> Checked<Source<'a>> {
        let &TreeConfig { dimensions, depth, error_budget, least, .. } = config;
        // SAFETY: the caller's contract.
        unsafe {
            Ok(match config.source {
                WIS_TREE_PIXELS => Source::Pixels(Config { dimensions, depth, error_budget }.checked()?),
                WIS_TREE_PRODUCT => Source::Product(Trees::read(config, 2..=MAX_FACTORS, |first, axes| axes <= first)?),
                WIS_TREE_BLEND => Source::Blend(Trees::read(config, 1..=WIS_MAX_BLEND, |first, axes| axes == first)?),
                WIS_TREE_WAVELETS => Source::Wavelets(ordered(config.wavelets, config.count, 0, disorder)?),
                WIS_TREE_ENVIRONMENT => Source::Environment(Rotation { depth, error_budget, least }.checked()?),
                _ => return Err(Error::range(c"source")),
            })
        }
    }

    fn size(&self) -> Checked<Size> {
        let size = match self {
            Source::Pixels(grid) => grid.size(),
            Source::Product(factors) => product_size(factors.all()),
            Source::Blend(terms) => sum_size(terms.all()),
            Source::Wavelets(list) => sparse::size(list),
            Source::Environment(rotation) => rotation.size(),
        };
        size.ok_or(Status::Overflow.into())
    }

    /// # Safety
    /// What the source reads is what the header says, and the blocks are as long as stated.
    unsafe fn build(&self, config: &TreeConfig, blocks: &Blocks) -> Checked<Header> {
        let &TreeConfig { average, least, .. } = config;
        // SAFETY: the caller's contract.
        unsafe {
            match self {
                Source::Pixels(grid) => {
                    let pixels = read_pixels(config)?;
                    let (block, scratch) = blocks.of(self.size()?)?;
                    grid.build_in(pixels, 0, block, scratch)
                }
                Source::Product(factors) => {
                    let (block, scratch) = blocks.whole()?;
                    multiply_in(factors.all(), block, scratch)
                }
                Source::Blend(terms) => {
                    let fits = |weight: &f64| (0.0..=f64::MAX).contains(weight);
                    let weights = slice(config.weight, terms.count, 0);
                    let weights = weights.and_then(|all| require_all(all, 0, fits).map(|()| all));
                    let weights = weights.map_err(|at| at.of(c"weight"))?;
                    let (block, scratch) = blocks.whole()?;
                    add_in(terms.all(), weights, block, scratch)
                }
                Source::Wavelets(wavelets) => {
                    Error::first([(average.is_finite(), c"average"), ((0.0..=f64::MAX).contains(&least), c"least")])?;
                    let (block, _) = blocks.of(self.size()?)?;
                    sparse::build_in(Sparse { average, wavelets }, least, block)
                }
                Source::Environment(rotation) => {
                    let environment = environment(config.environment, 0)?;
                    let frame = frame(config.world_from_tree.cast(), 0).map_err(|at| at.of(c"world_from_tree"))?;
                    let (block, scratch) = blocks.of(self.size()?)?;
                    rotation.build_in(&environment, &frame, block, scratch)
                }
            }
        }
    }
}

/// An error with its argument and its field: where it has none, of the configuration and of what its source is about.
fn placed(error: Error, config: &TreeConfig) -> Error {
    let subject = match config.source {
        WIS_TREE_PIXELS => c"pixels",
        WIS_TREE_WAVELETS => c"wavelets",
        WIS_TREE_ENVIRONMENT => c"environment",
        _ => c"trees",
    };
    match error.argument {
        0 => Error { argument: 1, field: error.field.or(Some(subject)), ..error },
        _ => error,
    }
}

/// The blocks of a build: arguments 2 to 5.
struct Blocks {
    memory: *mut c_void,
    bytes: usize,
    scratch: *mut c_void,
    scratch_bytes: usize,
}

impl Blocks {
    /// Memory of at most so many bytes, and so much scratch memory; where that is none, any pointer does.
    ///
    /// # Safety
    /// The blocks are null or as long as stated, and nobody else uses them meanwhile.
    unsafe fn of<'a>(&self, size: Size) -> Checked<(&'a mut [u8], &'a mut [u8])> {
        // As aligned as a block is.
        let mut scratch: &mut [u8] = cast_slice_mut::<u128, u8>(&mut []);
        // SAFETY: the caller's contract.
        unsafe {
            if size.scratch > 0 {
                scratch = block_mut(self.scratch, self.scratch_bytes, size.scratch, 4)?;
            }
            // What turns out how long it is: at most so many bytes.
            let room = self.bytes.min(size.bytes).min(isize::MAX as usize);
            Ok((block_mut(self.memory, self.bytes, room, 2)?, scratch))
        }
    }

    /// Both blocks as long as they are: for trees that turn out on the way how large they are.
    ///
    /// # Safety
    /// As [`Blocks::of`].
    unsafe fn whole<'a>(&self) -> Checked<(&'a mut [u8], &'a mut [u8])> {
        // SAFETY: the caller's contract.
        unsafe { self.of(Size { bytes: usize::MAX, scratch: self.scratch_bytes }) }
    }
}

/// The pixels of a grid that was checked.
///
/// # Safety
/// The pointer is null or points to as many as the configuration says.
unsafe fn read_pixels<'a>(config: &TreeConfig) -> Checked<&'a [f32]> {
    let &TreeConfig { dimensions, depth, pixels, .. } = config;
    let count = morton::cells(dimensions, depth).ok_or(Status::Overflow)?;
    // SAFETY: the caller's contract.
    let pixels = unsafe { slice(pixels, count, 0)? };
    let Some(pixel) = image::first_invalid(pixels) else { return Ok(pixels) };
    let along = |value: usize| u32::try_from(value).unwrap_or(u32::MAX);
    Err(Error::from(Status::InvalidTexel).at(along(pixel & ((1 << depth) - 1)), along(pixel >> depth)))
}

/// The trees of a configuration.
struct Trees<'a> {
    trees: [Stored<'a>; WIS_MAX_BLEND],
    count: usize,
}

impl<'a> Trees<'a> {
    /// So many trees, whose axes fit those of the first.
    ///
    /// # Safety
    /// `trees` is null or points to as many handles as are said, which are null or point to trees of this version.
    unsafe fn read(config: &TreeConfig, counts: RangeInclusive<usize>, fits: fn(u32, u32) -> bool) -> Checked<Self> {
        let count = config.tree_count as usize;
        Error::first([(counts.contains(&count), c"tree_count")])?;
        // SAFETY: the caller's contract.
        unsafe {
            let handles = slice(config.trees, count, 0)?;
            let read = |k: usize, handle| view(handle, 0).map_err(|at| at.in_row(k));
            let first = read(0, handles.first().copied().unwrap_or(null()))?;
            let mut trees = [first; WIS_MAX_BLEND];
            for ((k, &handle), tree) in handles.iter().enumerate().zip(&mut trees) {
                *tree = read(k, handle)?;
                if !fits(first.tree.axes(), tree.tree.axes()) {
                    return Err(Error::from(Status::InvalidArgument).in_row(k));
                }
            }
            Ok(Trees { trees, count })
        }
    }

    fn all(&self) -> &[Stored<'a>] {
        self.trees.get(..self.count).unwrap_or(&[])
    }
}

/// The tree behind a handle.
///
/// # Safety
/// The handle is null or points to a tree that this version built or opened.
#[inline(always)]
pub(super) unsafe fn view<'a>(tree: *const Tree, argument: u32) -> Checked<Stored<'a>> {
    // SAFETY: the caller's contract.
    let bytes = unsafe { handle(tree.cast(), Header::length, argument)? };
    Stored::view(bytes).ok_or(Error::new(Status::Mismatch, argument))
}

/// A tree of two dimensions, and the exponent of the power of two that its stored values are to be multiplied by.
///
/// # Safety
/// As [`view`].
pub(super) unsafe fn square_tree<'a>(tree: *const Tree, argument: u32) -> Checked<(kernel::Tree<'a, 4>, i32)> {
    // SAFETY: the caller's contract.
    match unsafe { view(tree, argument)? } {
        Stored { tree: AnyTree::Square(tree), header } => Ok((tree, header.exponent)),
        _ => Err(Error::new(Status::InvalidArgument, argument)),
    }
}

/// An integral in the units of the input.
pub(super) fn integral_of(stored: f64, exponents: &[i32], argument: u32) -> Checked<f64> {
    in_units(stored, exponents).ok_or(Error::new(Status::Overflow, argument))
}
