//! A product as bytes: relocatable, without pointers, and as short as the point needs.

use super::peak::Peak;
use crate::brdf::material::MAX_LOBES;
use crate::light::guide::MAX_CELLS;
use crate::light::parts::{BORDERS, MIDDLES};
use crate::object::Magic;
use crate::simd::{GROUP, Table, WINDOW};
use bytemuck::{Pod, Zeroable, try_cast_slice, try_from_bytes};

/// The most cells that can be divided.
pub const MAX_DIVIDED: usize = 24;

/// Corners of a group of leaves in 16 bits: of each corner, those of all leaves. A cache line.
pub type Leaves = [[u16; GROUP]; 4];

/// A lobe, as far as other hits are compared with it and directions are drawn from it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct StoredLobe {
    /// Its kind's number.
    pub kind: u32,
    /// Its share of what the point scatters.
    pub scattered: f32,
    /// The shape.
    pub a: f32,
    /// The shape.
    pub b: f32,
    /// The shape.
    pub eta: f32,
    /// The share of the peak's directions that are drawn from it.
    pub share: f32,
}

/// What stands at the beginning of a product.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Header {
    /// [`Magic::MAGIC`].
    pub magic: u64,
    /// The content id of the environment.
    pub environment: u64,
    /// [`checksum`](crate::object::checksum) of the product; 0: it is not to be stored.
    pub checksum: u64,
    /// The hash of the material.
    pub material: u64,
    /// An approximation of the integral of luminance x BRDF x cosine.
    pub integral: f64,
    /// What BRDF x cosine is for 1 in a leaf; 0 if it is 0 everywhere.
    pub unit: f64,
    /// One over the integral of F over the light's numbers; 0: nothing can be drawn.
    pub scale: f32,
    /// Bytes of the product, a multiple of 16.
    pub bytes: u32,
    /// Cells along columns, and along the rows of all faces.
    pub grid: [u32; 2],
    /// Cells that are divided.
    pub divided: u32,
    /// 1: the whole sphere; 2: the lobes contain the cosine.
    pub flags: u32,
    /// Lobes of the material.
    pub lobes: u32,
    /// The share of numbers that draw from the lobes; 0: the grid alone.
    pub peak: f32,
    /// The cosine of the cone of normals that it serves.
    pub cone: f32,
    /// The normal, in world space.
    pub normal: [f32; 3],
    /// The direction to the viewer, in world space.
    pub wo: [f32; 3],
    /// Tangent, bitangent and normal in map space.
    pub axes: [[f32; 3]; 3],
    /// wo along them.
    pub local_wo: [f32; 3],
    /// The lobes.
    pub lobe: [StoredLobe; MAX_LOBES],
    /// Always 0: with it the header fills cache lines.
    pub reserved: u32,
}

impl Magic for Header {
    const MAGIC: u64 = u64::from_le_bytes(*b"wisprd\x04\x00");
}

impl Header {
    /// The bytes of the product that begins with this; `None` if it is no product of this version.
    pub fn length(&self) -> Option<usize> {
        if self.magic == Header::MAGIC { Some(self.bytes as usize) } else { None }
    }
}

/// Directions on both sides count.
pub const WHOLE_SPHERE: u32 = 1;
/// The lobes contain the cosine.
pub const COSINE_INCLUDED: u32 = 2;

/// Numbers of the tables of rows and of the cells of each row.
pub fn tops([columns, rows]: [u32; 2]) -> usize {
    rows as usize + 1 + rows as usize * (columns as usize + 1)
}

/// Ends of the rows and of the parts of a divided cell.
pub const PART_ENDS: usize = 4 + MIDDLES;

/// Numbers of a divided cell: the ends, then the borders of its parts in the light's numbers.
pub const OF_DIVIDED: usize = PART_ENDS + BORDERS;

/// Groups that divided cells fill.
pub fn groups(divided: usize) -> usize {
    divided.div_ceil(GROUP)
}

/// The lengths of a product's parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lengths {
    /// [`Leaves`].
    pub leaves: usize,
    /// Numbers of tables, with a window behind them.
    pub tops: usize,
    /// Ends of parts, of groups of cells.
    pub ends: usize,
}

impl Lengths {
    /// Of a product with so many cells, of which some are divided.
    pub fn new(grid: [u32; 2], divided: usize) -> Lengths {
        let cells = grid[0] as usize * grid[1] as usize;
        let groups = groups(divided);
        Lengths {
            leaves: cells.div_ceil(GROUP) + MIDDLES * groups,
            tops: (tops(grid) + WINDOW).next_multiple_of(GROUP),
            ends: OF_DIVIDED * groups,
        }
    }

    /// Bytes of the product.
    pub fn bytes(&self) -> usize {
        let bytes = size_of::<Header>() + size_of::<Leaves>() * self.leaves + 4 * self.tops + 4 * GROUP * self.ends;
        bytes.next_multiple_of(16)
    }
}

/// The most bytes of a product, over any light, with at most so many divided cells.
pub fn most_bytes(divided: usize) -> usize {
    // The finest grids: lat-long, and the four columns of a cube.
    let grids = [[16, MAX_CELLS as u32 / 16], [4, 24]];
    grids.into_iter().map(|grid| Lengths::new(grid, divided.min(MAX_DIVIDED)).bytes()).fold(0, usize::max)
}

/// A product in bytes that hold one.
#[derive(Clone, Copy, Debug)]
pub struct Product<'a> {
    /// What stands at its beginning.
    pub header: &'a Header,
    /// Corners of cells, then of the parts of divided cells: of groups of cells, part by part.
    pub leaves: &'a [Leaves],
    /// Starts of the rows of cells, then of the cells of each row.
    pub tops: Table<'a, f32>,
    /// Of groups of divided cells: the ends of the rows of parts, then of the parts of each row; then the borders
    /// of their parts.
    pub ends: &'a [[f32; GROUP]],
    /// The narrow lobes.
    pub peak: Option<Peak>,
}

impl<'a> Product<'a> {
    /// The product that bytes hold; `None` if they hold none of this version.
    #[inline(always)]
    pub fn view(bytes: &'a [u8]) -> Option<Product<'a>> {
        let (first, rest) = bytes.split_at_checked(size_of::<Header>())?;
        let header: &Header = try_from_bytes(first).ok()?;
        if header.magic != Header::MAGIC || header.divided as usize > MAX_DIVIDED {
            return None;
        }
        let lengths = Lengths::new(header.grid, header.divided as usize);
        let (leaves, rest) = rest.split_at_checked(size_of::<Leaves>() * lengths.leaves)?;
        let (tops, rest) = rest.split_at_checked(4 * lengths.tops)?;
        let ends = rest.get(..4 * GROUP * lengths.ends)?;
        Some(Product {
            header,
            leaves: try_cast_slice(leaves).ok()?,
            tops: Table::new(try_cast_slice(tops).ok()?, &[0.0; WINDOW]),
            ends: try_cast_slice(ends).ok()?,
            peak: if header.peak > 0.0 { Some(Peak::of(header)) } else { None },
        })
    }
}
