//! Whether bytes hold a product that every call can use: what is opened need not be what was written.
//!
//! Tables, scale and integral follow from the leaves and the light: they are computed anew and must have the same bits.

use super::prepare::{integral, scale};
use super::stored::{
    COSINE_INCLUDED, Header, Leaves, MAX_DIVIDED, Places, Product, QUADS, Quad, WHOLE_SPHERE, mean, sum_parts, tops,
    write_tops,
};
use crate::blob::{Magic, has_checksum, write_checksum};
use crate::brdf::material::{Kind, MAX_LOBES, Shape};
use crate::light::environment::Environment;
use crate::light::guide::{Guide, MAX_CELLS};
use crate::light::parts::MIDDLES;
use crate::numeric::{exp2i, exponent};
use crate::simd::{Four, GROUP};
use crate::sphere::{Frame, unit};
use crate::status::{Result, Status};

/// Quads of running sums over all cells, at most.
const MOST_TOPS: usize = MAX_CELLS / 4 + MAX_CELLS / 4 + MAX_CELLS / 4;
/// How far directions that are computed in two ways may be apart along an axis: unit vectors are such within a thousandth.
const APART: f32 = 2e-3;

impl Header {
    /// The bytes of the product that begins with this, which may come from anywhere; `None` if none does.
    pub fn stored_length(&self) -> Option<usize> {
        let [columns, rows] = self.grid;
        let fits = u64::from(columns) * u64::from(rows) <= MAX_CELLS as u64 && self.divided as usize <= MAX_DIVIDED;
        let length = if fits { Places::new(self.grid, self.divided as usize).bytes() } else { 0 };
        Some(length).filter(|length| self.magic == Header::MAGIC && fits && *length == self.bytes as usize)
    }
}

/// Gives each of some products, one behind the other, the checksum that [`open`] asks for.
pub fn write_checksums(mut products: &mut [u8]) {
    while let Some(length) = Product::view(products).map(|product| product.header.bytes as usize) {
        let Some((product, rest)) = products.split_at_mut_checked(length.max(1)) else { break };
        write_checksum(product);
        products = rest;
    }
}

/// The product in bytes that may come from anywhere.
///
/// # Errors
/// [`Status::Corrupt`] if they are not those of a product with a checksum, [`Status::Mismatch`] for a product of another light.
pub fn open<'a>(bytes: &'a [u8], environment: &Environment<'_>) -> Result<Product<'a>> {
    let product = Product::view(bytes).filter(|_| has_checksum(bytes)).ok_or(Status::Corrupt)?;
    let header = product.header;
    // Without a guide no product was ever prepared.
    let own = header.environment == environment.header().content_id;
    let guide = environment.guide().filter(|_| own).ok_or(Status::Mismatch)?;
    let cells = environment.light().grid;
    let whole = header.stored_length() == Some(bytes.len()) && header.grid == cells;
    let total = if whole { total(&product, &guide) } else { None };
    let fits = |total| {
        header.scale == scale(total)
            && header.integral == integral(total, header.unit, environment.header().power)
            && directions_are_sound(header, &environment.frame())
            && lobes_are_sound(header)
    };
    if total.is_some_and(fits) { Ok(product) } else { Err(Status::Corrupt) }
}

/// The integral of F in units; `None` if the tables are not those of the leaves.
fn total(product: &Product<'_>, guide: &Guide<'_>) -> Option<f32> {
    let header = product.header;
    let mut cells = [0; MAX_DIVIDED];
    let (mut weights, mut used) = ([0.0; MAX_CELLS], 0u32);
    for (cell, weight) in weights.iter_mut().enumerate().take(guide.cells()) {
        let [upper, lower] = words(product.leaves().get(cell / GROUP)?, cell % GROUP);
        if upper & 0xffff == 0 && (upper, lower) != (0, 0) {
            let number = (upper >> 16).wrapping_sub(1);
            if lower != 0 || number >= header.divided || used & 1 << number != 0 {
                return None;
            }
            used |= 1 << number;
            *cells.get_mut(number as usize)? = cell;
        }
        *weight = guide.mass(cell) * mean([upper, lower]);
    }
    if used != (1 << header.divided) - 1 {
        return None;
    }
    let means = divided_means(product, guide, cells.get(..header.divided as usize)?)?;
    for (&cell, mean) in cells.iter().zip(means).take(header.divided as usize) {
        *weights.get_mut(cell)? = guide.mass(cell) * mean;
    }
    let mut table = [[0.0; 4]; MOST_TOPS];
    let table: &mut [Quad] = table.get_mut(..tops(header.grid).iter().sum())?;
    let groups = weights.get(..guide.cells())?.chunks_exact(GROUP).filter_map(|group| group.first_chunk());
    let total = write_tops::<Four>(groups, header.grid, table);
    (product.tops() == table).then_some(total)
}

/// The means of the divided cells; `None` if the ends of their parts are not those of their leaves, or their borders not those of the light.
fn divided_means(product: &Product<'_>, guide: &Guide<'_>, cells: &[usize]) -> Option<[f32; MAX_DIVIDED]> {
    let mut all = [0.0; MAX_DIVIDED];
    let found = product.divided().iter().zip(product.borders().chunks_exact(QUADS));
    for ((&cell, out), (divided, borders)) in cells.iter().zip(&mut all).zip(found) {
        let steps = guide.steps(cell).iter().map(|&step| (step, 0));
        let own = borders.iter().flat_map(|&[a, b, c, none]| [a, b, c].map(|step| (step, none)));
        if !own.eq(steps) {
            return None;
        }
        let (mut means, mut ends) = ([0.0; MIDDLES], [[0.0; 4]; QUADS]);
        for (part, out) in means.iter_mut().enumerate() {
            *out = mean(words(divided.leaves.get(part / GROUP)?, part % GROUP));
        }
        *out = sum_parts::<Four>(&means, borders.first_chunk()?, &mut ends);
        if divided.ends != ends {
            return None;
        }
    }
    Some(all)
}

/// The words of a leaf.
fn words([upper, lower]: &Leaves, lane: usize) -> [u32; 2] {
    [upper, lower].map(|words| words.get(lane).copied().unwrap_or(0))
}

/// Whether normal, view and axes are those of a point.
fn directions_are_sound(header: &Header, frame: &Frame) -> bool {
    let (Some(normal), Some(wo)) = (unit(header.normal), unit(header.wo)) else { return false };
    let [t, b, n] = header.axes.map(glam::Vec3::from_array);
    let view = glam::Vec3::from(frame.to_map(wo.to_array()));
    let along = [view.dot(t), view.dot(b), view.dot(n)];
    let near = |a: f32, b: f32| (a - b).abs() < APART;
    Frame::new(bytemuck::cast_ref(&header.axes)).is_some()
        && near(glam::Vec3::from(frame.to_map(normal.to_array())).dot(n).abs(), 1.0)
        && along.iter().zip(header.local_wo).all(|(&a, b)| near(a, b))
        && (0.0..=1.0).contains(&header.cone)
}

/// Whether lobes are those of a material, and flags and numbers are such as a [preparation](super::prepare) writes.
fn lobes_are_sound(header: &Header) -> bool {
    let count = header.lobes as usize;
    let mut drawn = 0.0;
    let [.., cosine] = header.local_wo;
    for lobe in header.lobe.iter().take(count) {
        let Some(kind) = Kind::from_code(lobe.kind) else { return false };
        let shape = Shape { kind, a: lobe.a, b: lobe.b, eta: lobe.eta };
        let shares = [lobe.scattered, lobe.share];
        if !lobe.refracting.is_sound()
            || shape.invalid().is_some()
            || !shares.iter().all(|s| (0.0..=1.0).contains(s))
            // From below no microfacet is visible.
            || kind.is_ggx() && lobe.share > 0.0 && !(cosine > 0.0)
        {
            return false;
        }
        drawn += lobe.share;
    }
    let draws = header.scale > 0.0 && (drawn - 1.0).abs() < APART;
    let unit = header.unit;
    count <= MAX_LOBES
        && header.lobe.iter().skip(count).all(|lobe| bytemuck::bytes_of(lobe).iter().all(|&byte| byte == 0))
        && header.flags & !(WHOLE_SPHERE | COSINE_INCLUDED) == 0
        && header.reserved == [0; 5]
        && (header.peak == 0.0 || (0.0..1.0).contains(&header.peak) && draws)
        && (unit == 0.0 || (0.0..f64::MAX).contains(&unit) && unit == exp2i(exponent(unit)))
}
