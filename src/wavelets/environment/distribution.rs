//! The environment alone, as what can be sampled: the cells of its tree, or the texels of its map.

use super::inverse::Inverse;
use super::shape::{RowNumbers, Texel};
use super::texels::TexelMap;
use super::{Cube, LatLong, Layout, Light, MOST_CELLS, Octahedral};
use crate::numeric::ContentHash;
use crate::simd::Level;
use crate::sphere::Frame;
use crate::status::Result;
use crate::wavelets::descent::{Sample, Sampled};
use crate::wavelets::wide::{InLanes, SampledWide};

/// What the environment alone is sampled from.
#[derive(Clone, Copy)]
pub enum Distribution<'a> {
    /// Cells of the square.
    Tree(Light<'a>),
    /// Texels of a lat-long map.
    LatLong(TexelMap<'a, LatLong>),
    /// Texels of a cube map.
    Cube(TexelMap<'a, Cube>),
    /// Texels of an octahedral map.
    Octahedral(TexelMap<'a, Octahedral>),
}

/// Where texels are kept: as long as [`Inverse::lengths`] tells, and a row each.
pub struct Table<'a> {
    /// Starts of rows and texels.
    pub starts: &'a mut [u32],
    /// Guides.
    pub guides: &'a mut [u16],
    /// Rows as directions.
    pub rows: &'a mut [RowNumbers],
}

/// How an environment's header writes the size of a map: of a cube map 0 and the columns, of an octahedral one the rows and
/// 0. Twice 0 if its texels cannot be kept.
pub fn written(layout: Layout, [rows, columns]: Texel) -> [u16; 2] {
    if rows > MOST_CELLS || columns > MOST_CELLS {
        return [0; 2];
    }
    match layout {
        Layout::LatLong => [rows as u16, columns as u16],
        Layout::Cube => [0, columns as u16],
        Layout::Octahedral => [rows as u16, 0],
    }
}

/// Rows and columns of a size that `written` wrote; 0 if there are none.
#[inline(always)]
pub fn size(written: [u16; 2]) -> Texel {
    let [rows, columns] = written.map(u32::from);
    [if rows == 0 { 6 * columns } else { rows }, if columns == 0 { rows } else { columns }]
}

/// Makes the distribution of texels with these values, of which some are not 0 in `written`; returns their mean over the
/// sphere.
pub fn fill(texels: [u16; 2], table: &mut Table, value: impl Fn(Texel) -> f64) -> f64 {
    let Table { starts, guides, rows } = table;
    match texels {
        [0, _] => TexelMap::<Cube>::fill(size(texels), (starts, guides, rows), value),
        [_, 0] => TexelMap::<Octahedral>::fill(size(texels), (starts, guides, rows), value),
        _ => TexelMap::<LatLong>::fill(size(texels), (starts, guides, rows), value),
    }
}

impl<'a> Distribution<'a> {
    /// A view of what `fill` wrote.
    #[inline(always)]
    pub fn of_texels(
        texels: [u16; 2],
        average: f32,
        (starts, guides, rows): (&'a [u32], &'a [u16], &'a [RowNumbers]),
    ) -> Self {
        let inverse = Inverse::trusted(size(texels), starts, guides);
        match texels {
            [0, _] => Distribution::Cube(TexelMap::trusted(average, inverse, rows)),
            [_, 0] => Distribution::Octahedral(TexelMap::trusted(average, inverse, rows)),
            _ => Distribution::LatLong(TexelMap::trusted(average, inverse, rows)),
        }
    }

    /// Whether texels are as `fill` writes them.
    pub fn is_sound(&self) -> bool {
        match self {
            Distribution::Tree(_) => true,
            Distribution::LatLong(texels) => texels.is_sound(),
            Distribution::Cube(texels) => texels.is_sound(),
            Distribution::Octahedral(texels) => texels.is_sound(),
        }
    }

    /// Adds every number of texels to a hash.
    pub fn add_to(&self, hash: &mut ContentHash) {
        match self {
            Distribution::Tree(_) => {}
            Distribution::LatLong(texels) => texels.add_to(hash),
            Distribution::Cube(texels) => texels.add_to(hash),
            Distribution::Octahedral(texels) => texels.add_to(hash),
        }
    }
}

impl Sampled for Distribution<'_> {
    // One copy: many calls come here, and three kinds of samplers are large.
    #[inline(never)]
    fn sample(&self, frame: &Frame, u: [f32; 2]) -> Sample {
        match self {
            Distribution::Tree(light) => light.sample(frame, u),
            Distribution::LatLong(texels) => texels.sample(frame, u),
            Distribution::Cube(texels) => texels.sample(frame, u),
            Distribution::Octahedral(texels) => texels.sample(frame, u),
        }
    }

    #[inline(never)]
    fn pdf(&self, frame: &Frame, wi: [f32; 3]) -> Result<f32> {
        match self {
            Distribution::Tree(light) => light.pdf(frame, wi),
            Distribution::LatLong(texels) => texels.pdf(frame, wi),
            Distribution::Cube(texels) => texels.pdf(frame, wi),
            Distribution::Octahedral(texels) => texels.pdf(frame, wi),
        }
    }

    #[inline(never)]
    fn invert(&self, frame: &Frame, wi: [f32; 3]) -> Result<[f32; 2]> {
        match self {
            Distribution::Tree(light) => light.invert(frame, wi),
            Distribution::LatLong(texels) => texels.invert(frame, wi),
            Distribution::Cube(texels) => texels.invert(frame, wi),
            Distribution::Octahedral(texels) => texels.invert(frame, wi),
        }
    }
}

impl SampledWide for Distribution<'_> {
    type One = Self;

    #[inline(always)]
    fn one(&self, _: usize) -> &Self {
        self
    }

    #[inline(always)]
    fn samples(&self, level: Level, frame: &Frame, u: &[[f32; 2]], samples: &mut [Sample]) {
        match self {
            Distribution::Tree(light) => light.samples(level, frame, u, samples),
            Distribution::LatLong(texels) => texels.sample_all(level, frame, u, samples),
            Distribution::Cube(texels) => texels.sample_all(level, frame, u, samples),
            Distribution::Octahedral(texels) => texels.sample_all(level, frame, u, samples),
        }
    }

    #[inline(always)]
    fn pdfs(&self, level: Level, frame: &Frame, wi: &[[f32; 3]], values: &mut [f32]) {
        match self {
            Distribution::Tree(light) => light.pdfs(level, frame, wi, values),
            Distribution::LatLong(texels) => texels.pdf_all(level, frame, wi, values),
            Distribution::Cube(texels) => texels.pdf_all(level, frame, wi, values),
            Distribution::Octahedral(texels) => texels.pdf_all(level, frame, wi, values),
        }
    }
}
