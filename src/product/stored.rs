//! A product as bytes: relocatable, without pointers, and as short as the point needs.

use super::peak::Peak;
use crate::brdf::ggx::Refracting;
use crate::brdf::material::MAX_LOBES;
use crate::light::guide::{MAX_CELLS, Short};
use crate::light::parts::{BORDERS, MIDDLES, PARTS};
use crate::object::{self, ALIGNMENT, Magic, Part};
use crate::simd::{GROUP, Num, Whole};
use bytemuck::{Pod, Zeroable};

/// The most cells that can be divided.
pub const MAX_DIVIDED: usize = 24;

/// F at the corners (w, v) = (0, 0), (1, 0), (0, 1), (1, 1) of leaves.
pub type Corners<F> = [F; 4];

/// Corners of a group of leaves in 16 bits: of each leaf the pair of the upper ones, then of each that of the lower ones. A cache line. The
/// leaf of a divided cell holds 0 and the number of that cell among the divided ones, from 1 on.
pub type Leaves = [[u32; GROUP]; 2];

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
    /// Of a lobe of microfacets that transmits, the numbers that are drawn; else all.
    pub refracting: Refracting,
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
    pub reserved: [u32; 5],
}

impl Magic for Header {
    const MAGIC: u64 = u64::from_le_bytes(*b"wisprd\x06\x00");
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

/// Four running sums, or the ends of four parts.
pub type Quad = [f32; 4];

/// Quads of a divided cell: one of its rows of parts, then one of the parts of each row.
pub const QUADS: usize = 1 + PARTS;

/// Quads of the running sums over rows of cells, over the quads of each row, and over the cells of each quad. With one quad in a row
/// the second are left out.
pub fn tops([columns, rows]: [u32; 2]) -> [usize; 3] {
    let (rows, quads) = (rows as usize, columns as usize / 4);
    [rows / 4, if quads > 1 { rows } else { 0 }, rows * quads]
}

/// Where the parts of a product stand, and its bytes.
#[derive(Clone, Copy, Debug)]
pub struct Places {
    /// [`Leaves`] of cells.
    pub leaves: Part,
    /// [`Quad`]s of [`tops`].
    pub tops: Part,
    /// [`Leaves`] of the parts of divided cells: of groups of cells, part by part.
    pub parts: Part,
    /// [`Quad`]s of divided cells: running sums over rows of parts, then over the parts of each row.
    pub ends: Part,
    /// The borders of the parts in the same order, as the light has them, with a 0 behind each three.
    pub borders: Part,
    /// Bytes of the product.
    pub bytes: usize,
}

impl Places {
    /// Of a product with so many cells, of which some are divided.
    pub fn new(grid: [u32; 2], divided: usize) -> Places {
        let count = [grid[0] as usize * grid[1] as usize / GROUP, tops(grid).iter().sum()];
        let part = |offset, count| Part { offset, count };
        let leaves = part(size_of::<Header>(), count[0]);
        let tops = part(leaves.offset + size_of::<Leaves>() * leaves.count, count[1]);
        let parts = part(tops.offset + size_of::<Quad>() * tops.count, MIDDLES * divided.div_ceil(GROUP));
        let ends = part(parts.offset + size_of::<Leaves>() * parts.count, QUADS * divided);
        let borders = part(ends.offset + size_of::<Quad>() * ends.count, ends.count);
        let bytes = (borders.offset + size_of::<[Short; 4]>() * borders.count).next_multiple_of(ALIGNMENT);
        Places { leaves, tops, parts, ends, borders, bytes }
    }
}

/// The most bytes of a product, over any light, with at most so many divided cells.
pub fn most_bytes(divided: usize) -> usize {
    // The finest grids: lat-long, and the four columns of a cube.
    let grids = [[16, MAX_CELLS as u32 / 16], [4, 24]];
    grids.into_iter().map(|grid| Places::new(grid, divided.min(MAX_DIVIDED)).bytes).fold(0, usize::max)
}

/// A product in bytes that hold one.
#[derive(Clone, Copy, Debug)]
pub struct Product<'a> {
    /// What stands at its beginning.
    pub header: &'a Header,
    /// The parts of [`Places`], in their order.
    pub leaves: &'a [Leaves],
    /// See [`Places`].
    pub tops: &'a [Quad],
    /// See [`Places`].
    pub parts: &'a [Leaves],
    /// See [`Places`].
    pub ends: &'a [Quad],
    /// See [`Places`].
    pub borders: &'a [[Short; 4]],
    /// The narrow lobes.
    pub peak: Option<Peak<'a>>,
}

impl<'a> Product<'a> {
    /// The product that bytes hold; `None` if they hold none of this version.
    #[inline(always)]
    pub fn view(bytes: &'a [u8]) -> Option<Product<'a>> {
        let header: &Header = object::header(bytes)?;
        if header.magic != Header::MAGIC || header.divided as usize > MAX_DIVIDED {
            return None;
        }
        let Places { leaves, tops, parts, ends, borders, bytes: length } =
            Places::new(header.grid, header.divided as usize);
        let bytes = bytes.get(..length)?;
        let peak = if header.peak > 0.0 { Some(Peak::of(header)) } else { None };
        let (leaves, parts) = (leaves.of(bytes), parts.of(bytes));
        Some(Product {
            header,
            leaves,
            tops: tops.of(bytes),
            parts,
            ends: ends.of(bytes),
            borders: borders.of(bytes),
            peak,
        })
    }
}

/// What a leaf holds for 1.
pub const STORED_ONE: f32 = 65536.0;
/// The bits of what word 0 would stand for, and of half a step between words.
const OF_WORD_0: u32 = 112 << 23;
const HALF_STEP: u32 = 1 << 11;
/// What the words 1 and 0xffff stand for.
const LEAST: f32 = f32::from_bits(OF_WORD_0 + (1 << 12));
const MOST: f32 = f32::from_bits(OF_WORD_0 + (0xffff << 12));

/// Stores leaves whose corners count, from place `first` of a group on; others become 0. Answers the mean of what is stored.
#[inline(always)]
pub fn store<F: Num>([a, b, c, d]: &Corners<F>, counts: F::Mask, out: &mut Leaves, first: usize) -> F {
    let word = |x: F| {
        let x = x.max(F::splat(LEAST)).min(F::splat(MOST));
        (x.to_bits() + F::Whole::splat(HALF_STEP.wrapping_sub(OF_WORD_0))).shr::<12>()
    };
    let [a, b, c, d] = [word(*a), word(*b), word(*c), word(*d)];
    let [upper, lower] = out;
    for (out, pair) in [(upper, a | b.shl::<16>()), (lower, c | d.shl::<16>())] {
        let pair = F::ints_of(F::only(counts, F::from_bits(pair)).to_bits());
        if let Some(out) = out.get_mut(first..first + F::WIDTH) {
            out.copy_from_slice(pair.as_ref());
        }
    }
    let stored = |word: F::Whole| F::from_bits(word.shl::<12>() + F::Whole::splat(OF_WORD_0));
    F::only(counts, (stored(a) + stored(b) + stored(c) + stored(d)) * 0.25)
}

/// The mean of a leaf, with the bits that [`store`] answers.
pub fn mean([upper, lower]: [u32; 2]) -> f32 {
    let stored = |word: u32| if word == 0 { 0.0 } else { f32::from_bits((word << 12) + OF_WORD_0) };
    (stored(upper & 0xffff) + stored(upper >> 16) + stored(lower & 0xffff) + stored(lower >> 16)) * 0.25
}

/// Writes running sums of the weights of all cells, which a sample searches and nobody normalises. Answers their sum.
pub fn write_tops(weights: &[f32], grid: [u32; 2], tops_out: &mut [Quad]) -> f32 {
    let [rows, quads, _] = tops(grid);
    let (of_rows, rest) = tops_out.split_at_mut_checked(rows).unwrap_or_default();
    let (of_quads, of_cells) = rest.split_at_mut_checked(quads).unwrap_or_default();
    // One after the other, not in lanes: a cell without weight must end where it begins.
    for ([a, b, c, d], weights) in of_cells.iter_mut().zip(weights.chunks_exact(4)) {
        let &[first, second, third, last] = weights.first_chunk().unwrap_or(&[0.0; 4]);
        *a = first;
        *b = first + second;
        *c = *b + third;
        *d = *c + last;
    }
    let (mut total, mut sums) = (0.0, of_cells.iter().map(|&[.., sum]| sum));
    let mut of_quads = of_quads.iter_mut();
    for end in of_rows.as_flattened_mut() {
        let mut sum = 0.0;
        match of_quads.next() {
            Some(ends) => {
                for end in ends {
                    sum += sums.next().unwrap_or(0.0);
                    *end = sum;
                }
            }
            None => sum = sums.next().unwrap_or(0.0),
        }
        total += sum;
        *end = total;
    }
    total
}

/// The widths of the four parts that three borders make, of the cells from place `first` of a group on.
#[inline(always)]
pub fn widths<F: Num>(borders: &[[f32; GROUP]], first: usize) -> [F; PARTS] {
    let [a, b, c] = borders.first_chunk().unwrap_or(&[[0.0; GROUP]; PARTS - 1]);
    let [a, b, c] = [F::at(a, first), F::at(b, first), F::at(c, first)];
    [a, b - a, c - b, F::splat(1.0) - c]
}

/// Running sums over the parts of divided cells, of cells side by side: what [`Places::ends`] holds.
pub type Ends = [[[f32; GROUP]; PARTS]; QUADS];

/// Sums the means of the parts of divided cells from place `first` of a group on. Answers the means of the cells.
#[inline(always)]
pub fn sum_parts<F: Num>(means: &[F; MIDDLES], borders: &[[f32; GROUP]; BORDERS], ends: &mut Ends, first: usize) -> F {
    let ([of_rows], of_parts) = ends.split_at_mut(1) else { return F::splat(0.0) };
    let (rows, columns) = borders.split_at(PARTS - 1);
    let mut total = F::splat(0.0);
    let parts = of_parts.iter_mut().zip(means.chunks_exact(PARTS)).zip(columns.chunks_exact(PARTS - 1));
    for ((end, height), ((parts, means), columns)) in of_rows.iter_mut().zip(widths::<F>(rows, first)).zip(parts) {
        let mut sum = F::splat(0.0);
        for ((end, &mean), width) in parts.iter_mut().zip(means).zip(widths::<F>(columns, first)) {
            sum = sum + mean * width;
            sum.write(end, first);
        }
        total = total + sum * height;
        total.write(end, first);
    }
    total
}
