//! A tree of two or four axes as one block of bytes without pointers: what it says of itself, then squares, then links.

use crate::blob::{Magic, Part, has_checksum, header, write_checksum, write_header};
use crate::numeric::times_power;
use crate::status::{Error, Result, Status};
use crate::wavelets::tree::{Link, MAX_DEPTH, Tree};
use crate::wavelets::warp;
use bytemuck::{Pod, Zeroable, try_cast_slice, try_cast_slice_mut};
use core::ops::RangeInclusive;

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

/// A tree of as many axes as one may have: those of a direction, or of two.
#[derive(Clone, Copy, Debug)]
pub enum AnyTree<'a> {
    /// Two axes.
    Square(Tree<'a, 4>),
    /// Four axes.
    Tesseract(Tree<'a, 16>),
}

/// How many axes a tree may have.
pub const AXES: [u32; 2] = [2, 4];

/// The same expression for a tree of each number of axes; the number may have a name.
macro_rules! of_any {
    ($any:expr, $tree:ident => $value:expr) => {
        match $any {
            AnyTree::Square($tree) => $value,
            AnyTree::Tesseract($tree) => $value,
        }
    };
    ($any:expr, $axes:ident, $tree:ident => $value:expr) => {
        match $any {
            AnyTree::Square($tree) => {
                const $axes: usize = 2;
                $value
            }
            AnyTree::Tesseract($tree) => {
                const $axes: usize = 4;
                $value
            }
        }
    };
}
pub(crate) use of_any;

impl<'a> AnyTree<'a> {
    /// A view of storage that was checked before (see [`Tree::trusted`]), of two or four axes.
    pub(crate) fn trusted(axes: u32, depth: u32, average: f32, averages: &'a [f32], links: &'a [Link]) -> AnyTree<'a> {
        match axes {
            2 => AnyTree::Square(Tree::trusted(depth, average, groups(averages), links)),
            _ => AnyTree::Tesseract(Tree::trusted(depth, average, groups(averages), links)),
        }
    }

    /// The number of axes.
    pub fn axes(&self) -> u32 {
        of_any!(self, AXES, _tree => AXES as u32)
    }

    /// The depth of the grid.
    pub fn depth(&self) -> u32 {
        of_any!(self, tree => tree.depth())
    }

    /// The averages of the children of all squares, one behind the other.
    pub fn averages(&self) -> &'a [f32] {
        of_any!(self, tree => tree.squares().as_flattened())
    }

    /// Where the kept children of squares stand.
    pub fn links(&self) -> &'a [Link] {
        of_any!(self, tree => tree.links())
    }

    /// Whether the squares are a tree of that depth, and the averages what a tree accepts.
    pub(crate) fn is_sound(&self) -> bool {
        of_any!(self, tree => Tree::sparse(tree.depth(), tree.average(), tree.squares(), tree.links()).is_ok())
    }

    /// Samples a point of the unit cube for a number for each axis: its coordinates into `point`, and its density. A tree
    /// that is 0 everywhere gives the origin, and 0.
    pub fn sample(&self, u: &[f32], point: &mut [f32]) -> f32 {
        of_any!(self, AXES, tree => {
            let none = warp::Sample { point: [0.0; AXES], pdf: 0.0 };
            let sample = warp::sample(tree, array::<AXES>(u)).unwrap_or(none);
            copy(sample.point, point);
            sample.pdf
        })
    }

    /// The density at a point of as many coordinates as there are axes.
    pub fn pdf(&self, point: &[f32]) -> f32 {
        of_any!(self, AXES, tree => warp::pdf(tree, array::<AXES>(point)))
    }

    /// Writes the numbers that lead to a point.
    ///
    /// # Errors
    /// [`Status::ZeroDensity`] if none do.
    pub fn invert(&self, point: &[f32], u: &mut [f32]) -> Result<()> {
        of_any!(self, AXES, tree => warp::invert(tree, array::<AXES>(point)).map(|numbers| copy(numbers, u)))
    }

    /// Warps points, one behind the other, in place (see [`warp::warp_in_place`]).
    ///
    /// # Errors
    /// As [`warp::warp_in_place`].
    pub fn warp_in_place(&self, points: &mut [f32], index: &mut [u32]) -> Result<()> {
        of_any!(self, AXES, tree => warp::warp_in_place(tree, groups_mut::<[f32; AXES]>(points), index))
    }
}

/// The first numbers of a slice, which has as many.
fn array<const N: usize>(from: &[f32]) -> [f32; N] {
    from.first_chunk().copied().unwrap_or([0.0; N])
}

fn copy<const N: usize>(from: [f32; N], to: &mut [f32]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = from);
}

/// Numbers in groups, such as the averages of a square.
fn groups<T: Pod>(numbers: &[f32]) -> &[T] {
    try_cast_slice(numbers).unwrap_or(&[])
}

fn groups_mut<T: Pod>(numbers: &mut [f32]) -> &mut [T] {
    try_cast_slice_mut(numbers).unwrap_or(&mut [])
}

/// The first bytes of a stored tree.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Header {
    magic: u64,
    bytes: u64,
    content_id: u64,
    /// The average of the function.
    pub mean: f64,
    error: f64,
    dimensions: u32,
    depth: u32,
    squares: u32,
    /// The function is 2^exponent times what is stored.
    pub exponent: i32,
    average: f32,
    reserved: u32,
}

/// The exponents that a tree may have: its mean is a double, which is in [1, 2) times the power of two.
const EXPONENTS: RangeInclusive<i32> = -1022..=1023;

impl Magic for Header {
    const MAGIC: u64 = u64::from_le_bytes(*b"wis-tre\x03");
}

impl Header {
    /// The bytes of the tree that begins with this; `None` if none does.
    #[inline(always)]
    pub fn length(&self) -> Option<usize> {
        if self.magic != Header::MAGIC || !AXES.contains(&self.dimensions) || self.depth > MAX_DEPTH {
            return None;
        }
        Parts::new(self.dimensions, self.squares as usize).map(|parts| parts.bytes)
    }

    /// The same, if it is what the header says.
    pub fn checked_length(&self) -> Option<usize> {
        self.length().filter(|bytes| *bytes as u64 == self.bytes)
    }

    /// What was built.
    pub fn info(&self) -> TreeInfo {
        TreeInfo {
            size: size_of::<TreeInfo>() as u32,
            dimensions: self.dimensions,
            depth: self.depth,
            squares: self.squares,
            bytes: self.bytes,
            content_id: self.content_id,
            average: self.mean,
            error: self.error,
        }
    }

    /// Whether mean and error are finite, and the mean is what average and exponent say.
    fn is_possible(&self) -> bool {
        let finite = [self.mean, self.error].iter().all(|value| (0.0..=f64::MAX).contains(value));
        let told = times_power(self.average.into(), self.exponent);
        // The average is rounded, and a mean below 2^-1022 is rounded twice.
        let rounding = self.mean * 1e-6 + f64::MIN_POSITIVE * 1e-9;
        finite && EXPONENTS.contains(&self.exponent) && (self.mean - told).abs() <= rounding
    }
}

/// Where the parts of a stored tree stand.
#[derive(Clone, Copy, Debug)]
pub struct Parts {
    averages: Part,
    links: Part,
    /// Of the whole.
    pub bytes: usize,
}

impl Parts {
    /// Those of a tree of so many squares; `None` if no memory is as long.
    pub fn new(axes: u32, squares: usize) -> Option<Parts> {
        let averages = Part { offset: size_of::<Header>(), count: squares.checked_mul(1 << axes)? };
        let offset = averages.count.checked_mul(size_of::<f32>())?.checked_add(averages.offset)?;
        let bytes = squares.checked_mul(size_of::<Link>())?.checked_add(offset)?;
        let parts = Parts { averages, links: Part { offset, count: squares }, bytes };
        if bytes > isize::MAX as usize { None } else { Some(parts) }
    }

    fn divide<'a>(&self, memory: &'a mut [u8]) -> Option<(&'a mut [f32], &'a mut [Link])> {
        let (before, links) = memory.get_mut(..self.bytes)?.split_at_mut_checked(self.links.offset)?;
        let averages = try_cast_slice_mut(before.get_mut(self.averages.offset..)?).ok()?;
        Some((averages, try_cast_slice_mut(links).ok()?))
    }
}

/// A tree in bytes that hold one.
#[derive(Clone, Copy, Debug)]
pub struct Stored<'a> {
    /// Every number that is not of a square.
    pub header: &'a Header,
    /// The function, 2^-exponent of what was given.
    pub tree: AnyTree<'a>,
}

impl<'a> Stored<'a> {
    /// The tree that bytes hold, without a check of its squares; `None` if they are of something else.
    #[inline(always)]
    pub fn view(bytes: &'a [u8]) -> Option<Stored<'a>> {
        let header: &Header = header(bytes)?;
        header.length()?;
        let parts = Parts::new(header.dimensions, header.squares as usize)?;
        let (averages, links) = (parts.averages.of(bytes), parts.links.of(bytes));
        let tree = AnyTree::trusted(header.dimensions, header.depth, header.average, averages, links);
        Some(Stored { header, tree })
    }

    /// The tree that bytes hold, checked. Reads all bytes once.
    ///
    /// # Errors
    /// [`Status::Corrupt`].
    pub fn open(bytes: &'a [u8]) -> Result<Stored<'a>> {
        let stored = Stored::view(bytes).filter(|stored| stored.tree.is_sound()).ok_or(Status::Corrupt)?;
        let header = stored.header;
        let known = header.reserved == 0 && header.checked_length().is_some() && header.is_possible();
        if known && has_checksum(bytes) { Ok(stored) } else { Err(Status::Corrupt) }
    }
}

/// A tree that was built, or why not: a block that is too short, with its number among the arguments of a build and the bytes that are
/// needed; [`Status::Overflow`] for more squares than there can be, or an average beyond a double or below the smallest normal one; else
/// what is wrong with what the tree is made of.
pub type Built<T> = core::result::Result<T, Error>;
/// The number of a tree's block among the arguments of a build.
const MEMORY: u32 = 2;
/// That of the scratch block.
pub(crate) const SCRATCH: u32 = 4;

/// What a tree stores besides squares.
#[derive(Clone, Copy, Debug)]
pub struct Facts {
    /// The depth of the grid.
    pub depth: u32,
    /// The average of the function.
    pub mean: f64,
    /// The variance that pruning added, relative.
    pub error: f64,
    /// The function is 2^exponent times what is stored.
    pub exponent: i32,
    /// The average of what is stored.
    pub average: f32,
}

/// Stores a tree of so many squares: `fill` writes averages and links, and answers the rest.
///
/// # Errors
/// [`Built`].
pub fn store(
    memory: &mut [u8],
    axes: u32,
    squares: usize,
    fill: impl FnOnce(&mut [f32], &mut [Link]) -> Built<Facts>,
) -> Built<Header> {
    let parts = Parts::new(axes, squares).ok_or(Status::Overflow)?;
    let (averages, links) = parts.divide(memory).ok_or(Error::too_small(MEMORY, parts.bytes))?;
    let Facts { depth, mean, error, exponent, average } = fill(averages, links)?;
    let header = Header {
        magic: Header::MAGIC,
        bytes: parts.bytes as u64,
        content_id: 0,
        mean,
        error,
        dimensions: axes,
        depth,
        squares: squares as u32,
        exponent,
        average,
        reserved: 0,
    };
    let tree = memory.get_mut(..parts.bytes).unwrap_or_default();
    write_header(tree, &header);
    Ok(Header { content_id: write_checksum(tree), ..header })
}

/// The mean of a function from what is stored of it, `2^-power` of it; a tree with this exponent can have it.
///
/// # Errors
/// [`Status::Overflow`].
pub fn mean_of(stored: f64, power: i32, exponent: i32) -> Built<f64> {
    let mean = times_power(stored, power);
    let lost = mean <= 0.0 && stored > 0.0;
    let fits = EXPONENTS.contains(&exponent) && mean <= f64::MAX && !lost;
    if fits { Ok(mean) } else { Err(Status::Overflow.into()) }
}

/// A result in the units of the input from one in those of what is stored; `None` if it is beyond a double.
pub fn in_units(stored: f64, exponents: &[i32]) -> Option<f64> {
    let exponent = exponents.iter().fold(0i32, |sum, exponent| sum.saturating_add(*exponent));
    Some(times_power(stored, exponent)).filter(|value| value.is_finite())
}
