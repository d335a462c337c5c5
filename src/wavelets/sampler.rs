//! A prepared shading point: a product as one block of bytes without pointers, and the estimate of its integral.

use crate::numeric::{exp2i, luminance};
use crate::object::{Layout, Part, header, take, taken, write_header};
use crate::sphere::{Frame, direction};
use crate::status::{Result, Status};
use crate::wavelets::environment::Environment;
use crate::wavelets::lanes::Native;
use crate::wavelets::lobe::{Brdf, Lobes};
use crate::wavelets::product::{Budget, Built, Cell, Node, Product, Room, Scratch, build};
use crate::wavelets::query::Query;
use crate::wavelets::table::Table;
use bytemuck::{Pod, Zeroable};
use core::f64::consts::PI;
use glam::Vec3;

/// The first bytes of a product.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Header {
    /// Marks a product of this version.
    pub magic: u64,
    /// Bytes of the whole.
    pub bytes: u64,
    /// The content id of its environment.
    pub environment: u64,
    /// The shading point; of size 0 if the BRDF was a callback.
    pub query: Query,
    /// world_from_map, column by column.
    pub frame: [f32; 9],
    /// The average product over the square, in the units of what is stored.
    pub average: f32,
    /// The stored BRDF is its own times `2^-exponent`.
    pub exponent: i32,
    /// Inner nodes.
    pub squares: u32,
    /// Inner nodes of its base.
    pub base: u32,
    /// BRDF evaluations that the build spent.
    pub evaluations: u32,
}

/// "wis-prd" and the version of the format.
const MAGIC: u64 = u64::from_le_bytes(*b"wis-prd\x04");

/// The nodes of a product of so many squares.
fn nodes(squares: u32) -> usize {
    if squares == 0 { 0 } else { 4 * squares as usize + 1 }
}

/// A product with its environment, ready for a call.
#[derive(Clone, Copy)]
pub struct Prepared<'a> {
    /// The light.
    pub environment: Environment<'a>,
    /// Every number that is not of a node.
    pub header: &'a Header,
    /// What is sampled.
    pub cells: Product<'a>,
    /// The frame in which the product was prepared.
    pub frame: Frame,
}

/// The bytes that a product of a budget is prepared in: header and nodes, then what is needed only to build.
pub fn size(budget: Budget) -> Option<usize> {
    let room = Room::new(budget.squares)?;
    let parts = [
        taken::<Header>(1)?,
        taken::<Node>(room.nodes)?,
        taken::<Cell>(room.cells)?,
        taken::<f32>(room.priorities)?,
        taken::<u32>(room.squares)?,
    ];
    parts.into_iter().try_fold(0usize, usize::checked_add).filter(|bytes| *bytes <= isize::MAX as usize)
}

/// Prepares a product in memory of [`size`], aligned to 16 bytes. `query`: what it keeps of the BRDF; none of a callback.
///
/// # Errors
/// [`Status::MemoryTooSmall`], and what the BRDF answers.
#[inline(never)]
pub fn prepare_in<B: Brdf>(
    environment: &Environment,
    query: Option<&Query>,
    frame: &Frame,
    brdf: &mut B,
    budget: Budget,
    memory: &mut [u8],
) -> Result<()> {
    let room = Room::new(budget.squares).ok_or(Status::Overflow)?;
    let (small, mut rest) = (Status::MemoryTooSmall, &mut *memory);
    let _: &mut [Header] = take(&mut rest, 1).ok_or(small)?;
    let mut scratch = Scratch {
        nodes: take(&mut rest, room.nodes).ok_or(small)?,
        cells: take(&mut rest, room.cells).ok_or(small)?,
        priorities: take(&mut rest, room.priorities).ok_or(small)?,
        slots: take(&mut rest, room.squares).ok_or(small)?,
    };
    let built = build::<Native, B>(environment.light(), frame, brdf, budget, &mut scratch)?;
    let average = scratch.finish(built.base, built.squares);
    Header::write(memory, environment, query, frame, &built, average).ok_or(Status::Overflow)
}
impl Header {
    /// Writes what was built; `None` for too many bytes. By itself: it need not lie on the stack of a build.
    #[inline(never)]
    fn write(
        memory: &mut [u8],
        environment: &Environment,
        query: Option<&Query>,
        frame: &Frame,
        built: &Built,
        average: f32,
    ) -> Option<()> {
        let mut whole = Layout::behind::<Header>();
        whole.part::<Node>(nodes(built.squares) as u64);
        let header = Header {
            magic: MAGIC,
            bytes: whole.bytes()? as u64,
            environment: environment.header.content_id,
            query: query.copied().unwrap_or_default(),
            frame: frame.to_array(),
            average,
            exponent: built.exponent,
            squares: built.squares,
            base: built.base,
            evaluations: built.evaluations,
        };
        write_header(memory, &header);
        Some(())
    }

    /// The bytes of the product that begins with this; `None` if none does.
    #[inline(always)]
    pub fn length(&self) -> Option<usize> {
        if self.magic == MAGIC { Some(self.bytes as usize) } else { None }
    }
}

/// What a prepared product is made of.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct ProductInfo {
    /// sizeof(wis_wavelet_product_info), set by the caller.
    pub size: u32,
    /// Inner nodes.
    pub squares: u32,
    /// Leaves.
    pub leaves: u32,
    /// BRDF evaluations that the preparation spent.
    pub evaluations: u32,
    /// Bytes in use: that much of the block is the product.
    pub bytes: u64,
    /// The content id of the light.
    pub environment: u64,
    /// An approximation of the integral over directions of luminance x luminance of BRDF x cosine, without visibility, in the
    /// units of the map. A ratio or control variate that uses it inherits its error.
    pub estimate: f64,
}

impl<'a> Prepared<'a> {
    /// What was prepared.
    pub fn info(&self) -> ProductInfo {
        let header = self.header;
        ProductInfo {
            size: size_of::<ProductInfo>() as u32,
            squares: header.squares,
            leaves: if header.squares == 0 { 0 } else { 3 * header.squares + 1 },
            evaluations: header.evaluations,
            bytes: header.bytes,
            environment: header.environment,
            estimate: self.estimate(),
        }
    }

    /// The product that bytes hold; `None` if they hold none of this environment.
    #[inline(always)]
    pub fn view(environment: Environment<'a>, bytes: &'a [u8]) -> Option<Prepared<'a>> {
        let header: &Header = header(bytes)?;
        if header.magic != MAGIC || header.environment != environment.header.content_id {
            return None;
        }
        let cells = Product {
            light: environment.light(),
            nodes: Part { offset: size_of::<Header>(), count: nodes(header.squares) }.of(bytes),
            base: header.base,
            squares: header.squares,
            average: header.average,
        };
        Some(Prepared { environment, header, cells, frame: Frame::from_array(&header.frame) })
    }

    /// What a stored integral over the square is in the units of the input.
    fn unit(&self) -> f64 {
        4.0 * PI * exp2i(self.environment.header.exponent) * exp2i(self.header.exponent)
    }

    /// An approximation of the integral of luminance x BRDF x cosine over directions.
    pub fn estimate(&self) -> f64 {
        f64::from(self.header.average) * self.unit()
    }

    /// The approximation of the integral of radiance x BRDF x cosine, channel by channel: the leaves' shares, each
    /// in the colour of its light and of the BRDF at its centre, or of the lobes as a whole if the centre lies below
    /// the horizon. Costs a BRDF evaluation for each leaf. `lobes`: those of the product's query; `tables`: as
    /// [`Lobes::coloured`] takes them, if its table is coloured.
    ///
    /// # Errors
    /// [`Status::NotBuilt`] if the environment has no RGB.
    pub fn estimate_rgb(&self, lobes: &Lobes, tables: Option<[&Table; 3]>) -> Result<[f64; 3]> {
        if self.environment.rgb.is_empty() && self.environment.header.squares > 0 {
            return Err(Status::NotBuilt);
        }
        let mut sum = [0.0f64; 3];
        for (leaf, share) in self.cells.shares() {
            let wi: Vec3 = self.frame.to_world(direction(leaf.centre()));
            let light = hue(self.environment.rgb(leaf.light()), [1.0; 3]);
            let value = tables.map_or_else(|| lobes.rgb(wi), |tables| lobes.coloured(wi, tables));
            let brdf = hue(value, lobes.tint());
            for ((sum, light), brdf) in sum.iter_mut().zip(light).zip(brdf) {
                *sum += f64::from(share) * light * brdf;
            }
        }
        Ok(sum.map(|s| s * self.unit()))
    }
}

/// A colour divided by its luminance; black counts as another colour, or as grey if that is black too.
fn hue(rgb: [f32; 3], otherwise: [f32; 3]) -> [f64; 3] {
    let colour = if luminance(rgb) > 0.0 { rgb } else { otherwise };
    let luminance = f64::from(luminance(colour));
    colour.map(|c| if luminance > 0.0 { f64::from(c) / luminance } else { 1.0 })
}
