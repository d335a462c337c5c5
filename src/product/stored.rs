//! A product as bytes: relocatable, without pointers, and as short as the point needs.

use crate::blob::Magic;
use crate::brdf::ggx::Refracting;
use crate::brdf::material::MAX_LOBES;
use crate::light::guide::{MAX_CELLS, Short, read};
use crate::light::parts::{MIDDLES, PARTS};
use crate::light::tables::decode;
use crate::simd::{Four, GROUP, Num, Whole, places};
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
    /// [`checksum`](crate::blob::checksum) of the product; 0: it is not to be stored.
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
    const MAGIC: u64 = u64::from_le_bytes(*b"wisprd\x07\x00");
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

/// The flags of a product.
pub fn flags(whole: bool, cosine_included: bool) -> u32 {
    (u32::from(whole) * WHOLE_SPHERE) | (u32::from(cosine_included) * COSINE_INCLUDED)
}

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

/// A divided cell, but for the borders of its parts.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Divided {
    /// The leaves of its parts, row by row.
    pub leaves: [Leaves; MIDDLES / GROUP],
    /// Running sums over its rows of parts, then over the parts of each row.
    pub ends: Ends,
}

/// Running sums over the parts of a divided cell.
pub type Ends = [Quad; QUADS];

/// Quads of a group of leaves, of a divided cell, and of its leaves.
const QUADS_OF_LEAVES: usize = size_of::<Leaves>() / size_of::<Quad>();
/// See above.
pub const QUADS_OF_DIVIDED: usize = size_of::<Divided>() / size_of::<Quad>();
/// See above.
pub const QUADS_OF_PARTS: usize = QUADS_OF_DIVIDED - QUADS;

/// Where the parts of a product begin behind its header, in quads. [`Leaves`] of cells come first.
#[derive(Clone, Copy, Debug)]
pub struct Places {
    /// [`Quad`]s of [`tops`].
    pub tops: usize,
    /// [`Divided`] cells.
    pub divided: usize,
    /// The borders of the parts of each, those of rows first, as the light has them, with a 0 behind each three.
    pub borders: usize,
    /// Where the product ends.
    pub end: usize,
}

impl Places {
    /// Of a product with so many cells, of which some are divided.
    #[inline(always)]
    pub fn new(grid: [u32; 2], divided: usize) -> Places {
        let tops_at = QUADS_OF_LEAVES * (grid[0] as usize * grid[1] as usize / GROUP);
        let first = tops_at + tops(grid).iter().sum::<usize>();
        let borders = first + QUADS_OF_DIVIDED * divided;
        Places { tops: tops_at, divided: first, borders, end: borders + (QUADS * divided).div_ceil(2) }
    }

    /// The bytes of the product.
    #[inline(always)]
    pub fn bytes(&self) -> usize {
        size_of::<Header>() + size_of::<Quad>() * self.end
    }
}

/// The most bytes of a product, over any light, with at most so many divided cells.
pub fn most_bytes(divided: usize) -> usize {
    // The finest grids: lat-long, and the four columns of a cube.
    let grids = [[16, MAX_CELLS as u32 / 16], [4, 24]];
    grids.into_iter().map(|grid| Places::new(grid, divided.min(MAX_DIVIDED)).bytes()).fold(0, usize::max)
}

/// A product in bytes that hold one.
#[derive(Clone, Copy, Debug)]
pub struct Product<'a> {
    /// What stands at its beginning.
    pub header: &'a Header,
    /// All that stands behind the header.
    pub quads: &'a [Quad],
    /// The same, as numbers of 16 bits.
    pub words: &'a [u16],
    /// Where parts begin in it.
    pub places: Places,
}

/// Numbers of 16 bits in a quad.
pub const WORDS: usize = size_of::<Quad>() / size_of::<u16>();

impl<'a> Product<'a> {
    /// The product that bytes hold; `None` if they hold none of this version.
    #[inline(always)]
    pub fn view(bytes: &'a [u8]) -> Option<Product<'a>> {
        let (first, rest) = bytes.split_at_checked(size_of::<Header>())?;
        let header: &Header = bytemuck::try_from_bytes(first).ok()?;
        if header.magic != Header::MAGIC || header.divided as usize > MAX_DIVIDED {
            return None;
        }
        let places = Places::new(header.grid, header.divided as usize);
        let rest = rest.get(..size_of::<Quad>() * places.end)?;
        let (quads, words) = (bytemuck::try_cast_slice(rest).ok()?, bytemuck::try_cast_slice(rest).ok()?);
        Some(Product { header, quads, words, places })
    }

    /// The quads of running sums over all cells.
    pub fn tops(&self) -> &'a [Quad] {
        self.part(self.places.tops, self.places.divided)
    }

    /// The leaves of cells.
    pub fn leaves(&self) -> &'a [Leaves] {
        bytemuck::try_cast_slice(self.part(0, self.places.tops)).unwrap_or(&[])
    }

    /// The divided cells.
    pub fn divided(&self) -> &'a [Divided] {
        bytemuck::try_cast_slice(self.part(self.places.divided, self.places.borders)).unwrap_or(&[])
    }

    /// The borders of the parts of divided cells.
    pub fn borders(&self) -> &'a [[Short; 4]] {
        let all = bytemuck::try_cast_slice(self.part(self.places.borders, self.places.end)).unwrap_or(&[]);
        all.get(..QUADS * self.header.divided as usize).unwrap_or(&[])
    }

    fn part(&self, from: usize, to: usize) -> &'a [Quad] {
        self.quads.get(from..to).unwrap_or(&[])
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

/// Corners in the range of what leaves hold.
#[inline(always)]
pub fn near<F: Num>(corners: Corners<F>) -> Corners<F> {
    corners.map(|x| x.max(F::splat(LEAST)).min(F::splat(MOST)))
}

/// Stores leaves from place `first` of a group on, whose corners are in that range where they count. `only`: what counts; elsewhere 0. Answers the mean of what
/// is stored.
#[inline(always)]
pub fn store<F: Num>(corners: &Corners<F>, only: impl Fn(F) -> F, out: &mut Leaves, first: usize) -> F {
    let rounded = |x: F| (x.to_bits() + F::Whole::splat(HALF_STEP)) & F::Whole::splat(!(2 * HALF_STEP - 1));
    let [a, b, c, d] = [rounded(corners[0]), rounded(corners[1]), rounded(corners[2]), rounded(corners[3])];
    // A word is what stands above half a step, less what word 0 has there; the upper one of a pair loses what is above it.
    let none = F::Whole::splat((OF_WORD_0 >> 12).wrapping_add(OF_WORD_0 << 4).wrapping_neg());
    for (out, [low, high]) in out.iter_mut().zip([[a, b], [c, d]]) {
        let pair = F::ints_of(only(F::from_bits(low.shr::<12>() + high.shl::<4>() + none)).to_bits());
        if let Some(out) = out.get_mut(first..first + F::WIDTH) {
            out.copy_from_slice(pair.as_ref());
        }
    }
    only((F::from_bits(a) + F::from_bits(b) + F::from_bits(c) + F::from_bits(d)) * 0.25)
}

/// The mean of a leaf, with the bits that [`store`] answers.
pub fn mean([upper, lower]: [u32; 2]) -> f32 {
    let [a, b, c, d] = [upper, upper >> 16, lower, lower >> 16].map(|word| decode(word as u16));
    (a + b + c + d) * 0.25
}

/// Running sums of each four.
#[inline(always)]
fn running<F: Num>(x: F) -> F {
    let two = x + x.up();
    let three = x + two.up();
    x + three.up()
}

/// Writes running sums of the weights of all cells, which a sample searches and nobody normalises. Answers their sum.
#[inline(always)]
pub fn write_tops<'a, F: Num>(
    weights: impl Iterator<Item = &'a [f32; GROUP]>,
    grid: [u32; 2],
    tops_out: &mut [Quad],
) -> f32 {
    let [rows, quads, _] = tops(grid);
    let (of_rows, rest) = tops_out.split_at_mut_checked(rows).unwrap_or_default();
    let (of_quads, of_cells) = rest.split_at_mut_checked(quads).unwrap_or_default();
    // A cell without weight must end where it begins: each sum comes from the one before.
    for (out, weights) in of_cells.as_flattened_mut().chunks_exact_mut(GROUP).zip(weights) {
        for first in places::<F>() {
            running(F::at(weights, first)).write(out, first);
        }
    }
    let mut total = 0.0;
    let ends = of_rows.as_flattened_mut().iter_mut();
    if of_quads.is_empty() {
        for (end, &[.., sum]) in ends.zip(&*of_cells) {
            total += sum;
            *end = total;
        }
        return total;
    }
    let of_cells: &[[Quad; 4]] = bytemuck::try_cast_slice(of_cells).unwrap_or(&[]);
    for ((end, out), &[[.., a], [.., b], [.., c], [.., d]]) in ends.zip(of_quads).zip(of_cells) {
        *out = [a, a + b, a + b + c, a + b + c + d];
        total += out[3];
        *end = total;
    }
    total
}

/// Sums the means of the parts of a divided cell. Answers the mean of the cell.
#[inline(always)]
pub fn sum_parts<F: Num>(
    means: &[f32; MIDDLES],
    borders: &[[Short; 4]; QUADS],
    [of_rows, of_parts @ ..]: &mut Ends,
) -> f32 {
    let [of_row, borders @ ..] = borders;
    let out = of_parts.as_flattened_mut();
    for (first, borders) in (0..).step_by(F::WIDTH).zip(borders.as_flattened().chunks_exact(F::WIDTH)) {
        running(F::at(means, first) * widths::<F>(borders)).write(out, first);
    }
    *of_rows = running(Four::load(of_parts.map(|[.., sum]| sum)) * widths::<Four>(of_row)).store();
    of_rows[PARTS - 1]
}

/// The widths of the four parts that each three borders make.
#[inline(always)]
pub fn widths<F: Num>(borders: &[Short]) -> F {
    // A 0 stands behind them.
    let ends = read::<F>(borders) + F::each(|lane| if lane % PARTS == PARTS - 1 { 1.0 } else { 0.0 });
    ends - ends.up()
}
