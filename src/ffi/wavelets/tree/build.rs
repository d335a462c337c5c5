//! Trees built in C: of pixels, of trees, of wavelets or of an environment, as the source of the configuration says.

use super::{Tree, TreeInfo, view};
use crate::blob::Size;
use crate::ffi::light::{EnvironmentObject, environment};
use crate::ffi::memory::block_mut;
use crate::ffi::wavelets::memory::{Results, ordered, room_mut};
use crate::ffi::{Checked, Diagnostic, MemorySize, answer, frame, put_size, require_all, sized, slice};
use crate::status::{Error, Status};
use crate::wavelets::combine::{MAX_FACTORS, WIS_MAX_BLEND, add_in, multiply_in, product_size, sum_size};
use crate::wavelets::pruned::Config;
use crate::wavelets::rotated::Rotation;
use crate::wavelets::sparse::{self, Sparse};
use crate::wavelets::stored::{Header, Refused, Stored};
use crate::wavelets::triple::{Wavelets, disorder};
use crate::wavelets::{image, morton};
use bytemuck::cast_slice_mut;
use core::ffi::{CStr, c_void};
use core::ops::RangeInclusive;
use core::ptr::null;

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
    answer(diagnostic, || unsafe { put_size(size, 2, needed(sized(config, 1)?)) })
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
        let results = Results::new((tree, 6), (info, 7))?;
        let built = built(config, &Blocks { memory, bytes, scratch, scratch_bytes })?;
        results.publish(memory, built.map_err(|why| refused(why, config))?.info())
    })
}

/// The memory that a tree needs.
///
/// # Safety
/// What the source reads is what the header says.
unsafe fn needed(config: &TreeConfig) -> Checked<Size> {
    // SAFETY: the caller's contract.
    let size = unsafe {
        match config.source {
            WIS_TREE_PIXELS => grid(config)?.size(),
            WIS_TREE_PRODUCT => product_size(factors(config)?.all()),
            WIS_TREE_BLEND => sum_size(terms(config)?.all()),
            WIS_TREE_WAVELETS => sparse::size(wavelets(config)?),
            WIS_TREE_ENVIRONMENT => rotation(config)?.size(),
            _ => return Err(no_source()),
        }
    };
    size.ok_or(overflow(config))
}

type Built = core::result::Result<Header, Refused>;

/// Builds the tree, or tells why there is none.
///
/// # Safety
/// As [`needed`], and the blocks are as long as stated.
unsafe fn built(config: &TreeConfig, blocks: &Blocks) -> Checked<Built> {
    // SAFETY: the caller's contract.
    unsafe {
        match config.source {
            WIS_TREE_PIXELS => of_pixels(config, blocks),
            WIS_TREE_PRODUCT => {
                let (factors, (block, scratch)) = (factors(config)?, blocks.whole()?);
                Ok(multiply_in(factors.all(), block, scratch))
            }
            WIS_TREE_BLEND => of_terms(config, blocks),
            WIS_TREE_WAVELETS => of_wavelets(config, blocks),
            WIS_TREE_ENVIRONMENT => of_environment(config, blocks),
            _ => Err(no_source()),
        }
    }
}

/// # Safety
/// As [`built`].
unsafe fn of_pixels(config: &TreeConfig, blocks: &Blocks) -> Checked<Built> {
    let grid = grid(config)?;
    // SAFETY: the caller's contract.
    unsafe {
        let pixels = read_pixels(config)?;
        let (block, scratch) = blocks.of(grid.size().ok_or(overflow(config))?)?;
        Ok(grid.build_in(pixels, 0, block, scratch))
    }
}

/// # Safety
/// As [`built`].
unsafe fn of_terms(config: &TreeConfig, blocks: &Blocks) -> Checked<Built> {
    // SAFETY: the caller's contract.
    unsafe {
        let terms = terms(config)?;
        let fits = |weight: &f64| (0.0..=f64::MAX).contains(weight);
        let weights = slice(config.weight, terms.count, 1);
        let weights = weights.and_then(|all| require_all(all, 1, fits).map(|()| all));
        let weights = weights.map_err(|at| at.of(c"weight"))?;
        let (block, scratch) = blocks.whole()?;
        Ok(add_in(terms.all(), weights, block, scratch))
    }
}

/// # Safety
/// As [`built`].
unsafe fn of_wavelets(config: &TreeConfig, blocks: &Blocks) -> Checked<Built> {
    let &TreeConfig { average, least, .. } = config;
    // SAFETY: the caller's contract.
    let wavelets = unsafe { wavelets(config)? };
    in_range([(average.is_finite(), c"average"), ((0.0..=f64::MAX).contains(&least), c"least")])?;
    // SAFETY: the caller's contract.
    let (block, _) = unsafe { blocks.of(sparse::size(wavelets).ok_or(overflow(config))?)? };
    Ok(sparse::build_in(Sparse { average, wavelets }, least, block))
}

/// # Safety
/// As [`built`].
unsafe fn of_environment(config: &TreeConfig, blocks: &Blocks) -> Checked<Built> {
    let rotation = rotation(config)?;
    // SAFETY: the caller's contract.
    unsafe {
        let environment = environment(config.environment, 1).map_err(|at| at.of(c"environment"))?;
        let world_from_tree = frame(config.world_from_tree.cast(), 1).map_err(|at| at.of(c"world_from_tree"))?;
        let (block, scratch) = blocks.of(rotation.size().ok_or(overflow(config))?)?;
        Ok(rotation.build_in(&environment, &world_from_tree, block, scratch))
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
            Ok((room_mut(self.memory, self.bytes, size.bytes, 2)?, scratch))
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

/// Checks fields of the configuration, each with whether it is in its range.
fn in_range<const N: usize>(fields: [(bool, &'static CStr); N]) -> Checked<()> {
    Error::first(fields).map_err(|error| error.instead(1))
}

fn no_source() -> Error {
    Error::range(c"source").instead(1)
}

/// The field that tells what the tree is made of.
fn subject(config: &TreeConfig) -> &'static CStr {
    match config.source {
        WIS_TREE_PIXELS => c"pixels",
        WIS_TREE_WAVELETS => c"wavelets",
        WIS_TREE_ENVIRONMENT => c"environment",
        _ => c"trees",
    }
}

/// The tree, or its average, is too large.
fn overflow(config: &TreeConfig) -> Error {
    Error::new(Status::Overflow, 1).of(subject(config))
}

/// Why a tree was not built.
fn refused(why: Refused, config: &TreeConfig) -> Error {
    match why {
        Refused::Memory(bytes) => Error::too_small(2, bytes),
        Refused::Scratch(bytes) => Error::too_small(4, bytes),
        Refused::Squares | Refused::Average => overflow(config),
        Refused::Input(status) => Error::new(status, 1).of(subject(config)),
    }
}

/// The grid of a configuration, checked.
fn grid(config: &TreeConfig) -> Checked<Config> {
    let &TreeConfig { dimensions, depth, error_budget, .. } = config;
    let grid = Config { dimensions, depth, error_budget };
    grid.check().map_err(|error| error.instead(1))?;
    Ok(grid)
}

/// The pixels of a grid that was checked.
///
/// # Safety
/// The pointer is null or points to as many as the configuration says.
unsafe fn read_pixels<'a>(config: &TreeConfig) -> Checked<&'a [f32]> {
    let &TreeConfig { dimensions, depth, pixels, .. } = config;
    let count = morton::cells(dimensions, depth).ok_or(overflow(config))?;
    // SAFETY: the caller's contract.
    let pixels = unsafe { slice(pixels, count, 1) }.map_err(|at| at.of(c"pixels"))?;
    let Some(pixel) = image::first_invalid(pixels) else { return Ok(pixels) };
    let along = |value: usize| u32::try_from(value).unwrap_or(u32::MAX);
    let (x, y) = (pixel & ((1 << depth) - 1), pixel >> depth);
    Err(Error::new(Status::InvalidTexel, 1).at(along(x), along(y)).of(c"pixels"))
}

/// How a map is rotated, checked.
fn rotation(config: &TreeConfig) -> Checked<Rotation> {
    let &TreeConfig { depth, error_budget, least, .. } = config;
    let rotation = Rotation { depth, error_budget, least };
    rotation.check().map_err(|error| error.instead(1))?;
    Ok(rotation)
}

/// The list of a function of two axes.
///
/// # Safety
/// The pointer is null or points to as many elements as are said.
unsafe fn wavelets<'a>(config: &TreeConfig) -> Checked<&'a [Wavelets]> {
    // SAFETY: the caller's contract.
    unsafe { ordered(config.wavelets, config.count, 1, disorder) }.map_err(|at| at.of(c"wavelets"))
}

/// The trees of a configuration.
struct Trees<'a> {
    trees: [Stored<'a>; WIS_MAX_BLEND],
    count: usize,
}

impl<'a> Trees<'a> {
    fn all(&self) -> &[Stored<'a>] {
        self.trees.get(..self.count).unwrap_or(&[])
    }
}

/// Trees that are multiplied.
///
/// # Safety
/// As [`read_trees`].
unsafe fn factors<'a>(config: &TreeConfig) -> Checked<Trees<'a>> {
    // SAFETY: the caller's contract.
    unsafe { read_trees(config, 2..=MAX_FACTORS, |first, axes| axes <= first) }
}

/// Trees that are added up.
///
/// # Safety
/// As [`read_trees`].
unsafe fn terms<'a>(config: &TreeConfig) -> Checked<Trees<'a>> {
    // SAFETY: the caller's contract.
    unsafe { read_trees(config, 1..=WIS_MAX_BLEND, |first, axes| axes == first) }
}

/// So many trees, whose axes fit those of the first.
///
/// # Safety
/// `trees` is null or points to as many handles as are said, which are null or point to trees of this version.
unsafe fn read_trees<'a>(
    config: &TreeConfig,
    counts: RangeInclusive<usize>,
    fits: fn(u32, u32) -> bool,
) -> Checked<Trees<'a>> {
    let count = config.tree_count as usize;
    in_range([(counts.contains(&count), c"tree_count")])?;
    let of_tree = |at: Error, k| at.instead(1).in_row(k).of(c"trees");
    // SAFETY: the caller's contract.
    unsafe {
        let handles = slice(config.trees, count, 1).map_err(|at| of_tree(at, 0))?;
        let read = |k: usize, handle| view(handle, 1).map_err(|at| of_tree(at, k));
        let first = read(0, handles.first().copied().unwrap_or(null()))?;
        let mut trees = [first; WIS_MAX_BLEND];
        for ((k, &handle), tree) in handles.iter().enumerate().zip(&mut trees) {
            *tree = read(k, handle)?;
            if !fits(first.tree.axes(), tree.tree.axes()) {
                return Err(of_tree(Error::new(Status::InvalidArgument, 1), k));
            }
        }
        Ok(Trees { trees, count })
    }
}
