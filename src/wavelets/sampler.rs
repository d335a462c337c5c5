//! A prepared shading point: what the library knows of a product besides its cells, and the estimate of its integral.

use crate::numeric::{exp2i, luminance};
use crate::sphere::{Frame, direction, unit};
use crate::status::{Result, Status};
use crate::wavelets::environment::Environment;
use crate::wavelets::lobe::Lobes;
use crate::wavelets::product::Product;
use crate::wavelets::query::Query;
use crate::wavelets::reuse::cosine;
use crate::wavelets::table::Table;
use core::f64::consts::PI;
use glam::Vec3;

/// The first bytes of a product.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
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
    /// Normals within this angle of the query's may use the product.
    pub reuse_cone: f32,
    /// What the average is with the factor of a visibility prior.
    pub visible: f32,
    /// Always 0; leaves no padding, whose bytes would differ from build to build.
    pub reserved: [u32; 2],
}

/// "wis-prd" and the version of the format.
pub const MAGIC: u64 = u64::from_le_bytes(*b"wis-prd\x03");

impl Header {
    /// The frame in which the product was prepared.
    #[inline(always)]
    pub fn frame(&self) -> Frame {
        Frame::from_array(&self.frame)
    }

    /// Whether a hit with this query, whose normal is given at unit length, may use the product.
    pub fn covers(&self, query: &Query, normal: Vec3) -> bool {
        let prepared = unit(self.query.normal).filter(|_| self.query.size != 0);
        let within = prepared.is_some_and(|prepared| {
            let turned = prepared.dot(normal);
            query.normal == self.query.normal || turned >= cosine(self.reuse_cone) && self.reuse_cone > 0.0
        });
        let lobes = |query: &Query| query.lobe.map(|lobe| (lobe.kind, lobe.weight, lobe.f0, [lobe.a, lobe.b]));
        let kind = |query: &Query| (query.flags, query.lobe_count);
        within && kind(query) == kind(&self.query) && lobes(query) == lobes(&self.query)
    }

    /// What a stored integral over the square is in the units of the input.
    fn unit(&self, environment: &Environment) -> f64 {
        4.0 * PI * exp2i(environment.header.exponent) * exp2i(self.exponent)
    }

    /// An approximation of the integral of luminance x BRDF x cosine over directions.
    pub fn estimate(&self, environment: &Environment) -> f64 {
        f64::from(self.average) * self.unit(environment)
    }

    /// The approximation of the integral of radiance x BRDF x cosine, channel by channel: the leaves' shares, each
    /// in the colour of its light and of the BRDF at its centre, or of the lobes as a whole if the centre lies below
    /// the horizon. Costs a BRDF evaluation for each leaf. `lobes`: those of the product's query; `tables`: as
    /// [`Lobes::coloured`] takes them, if its table is coloured.
    ///
    /// # Errors
    /// [`Status::NotBuilt`] if the environment has no RGB.
    pub fn estimate_rgb(
        &self,
        environment: &Environment,
        product: &Product,
        lobes: &Lobes,
        tables: Option<[&Table; 3]>,
    ) -> Result<[f64; 3]> {
        if environment.rgb.is_empty() && environment.header.squares > 0 {
            return Err(Status::NotBuilt);
        }
        let frame = self.frame();
        let mut sum = [0.0f64; 3];
        for (leaf, share) in product.shares() {
            let wi: Vec3 = frame.to_world(direction(leaf.centre()));
            let light = hue(environment.rgb(leaf.light()), [1.0; 3]);
            let value = tables.map_or_else(|| lobes.rgb(wi), |tables| lobes.coloured(wi, tables));
            let brdf = hue(value, lobes.tint());
            for ((sum, light), brdf) in sum.iter_mut().zip(light).zip(brdf) {
                *sum += f64::from(share) * light * brdf;
            }
        }
        // The leaves' shares carry the factor of a visibility prior, if there was one.
        let seen = if self.visible > 0.0 { f64::from(self.average) / f64::from(self.visible) } else { 1.0 };
        Ok(sum.map(|s| s * seen * self.unit(environment)))
    }
}

/// A colour divided by its luminance; black counts as another colour, or as grey if that is black too.
fn hue(rgb: [f32; 3], otherwise: [f32; 3]) -> [f64; 3] {
    let colour = if luminance(rgb) > 0.0 { rgb } else { otherwise };
    let luminance = f64::from(luminance(colour));
    colour.map(|c| if luminance > 0.0 { f64::from(c) / luminance } else { 1.0 })
}
