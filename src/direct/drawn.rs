//! Rays that are drawn from a product: those of one hit, or of hits that share it.

use super::Ray;
use crate::brdf::point::Point;
use crate::light::batch::{Drawn, pdfs, samples};
use crate::numeric::{ONE_MINUS_EPSILON, clamp_u, min};
use crate::product::density::Shaded;
use crate::simd::Level;
use crate::sphere::Frame;

/// Rays that are drawn together.
const TOGETHER: usize = 16;

/// Where rays come from.
pub struct Source<'a> {
    /// The instructions to draw them with.
    pub level: Level,
    /// From map space to the world.
    pub frame: &'a Frame,
    /// The product, with its light.
    pub shaded: &'a Shaded<'a>,
    /// The share of rays that the light alone draws, below 1. It bounds the weights for BRDFs that the lobes do not describe.
    pub from_light: f32,
}

impl Source<'_> {
    /// A ray for each `u` at a point, with one over the density of rays for its weight; those below the point's horizon are left out.
    /// Answers how many there are.
    pub fn rays(&self, point: &Point<'_>, u: &[[f32; 2]], total: usize, out: &mut [Ray]) -> usize {
        let mut written = 0;
        for u in u.chunks(TOGETHER) {
            let (mut drawn, mut other) = ([Drawn::default(); TOGETHER], [0.0; TOGETHER]);
            let drawn = drawn.get_mut(..u.len()).unwrap_or_default();
            let products = self.draw(u, drawn, &mut other);
            let (share, rest) = (self.from_light, 1.0 - self.from_light);
            for (i, (&Drawn { wi, pdf }, other)) in drawn.iter().zip(other).enumerate() {
                let density = if i < products { rest * pdf + share * other } else { share * pdf + rest * other };
                if let (true, Some(ray)) = (density > 0.0 && is_above(point, wi), out.get_mut(written)) {
                    *ray = Ray { wi, weight: (1.0 / (total as f32 * density)).min(f32::MAX) };
                    written += 1;
                }
            }
        }
        written
    }

    /// Draws first from the product, then from the light, and queries the density of each in the other. Answers how many came from the
    /// product.
    fn draw(&self, u: &[[f32; 2]], drawn: &mut [Drawn], other: &mut [f32; TOGETHER]) -> usize {
        let &Source { level, frame, shaded, from_light } = self;
        let mut numbers = [[0.0; 2]; TOGETHER];
        let mut products = 0;
        let mut lights = u.len().min(TOGETHER);
        for &[x, y] in u.iter().take(TOGETHER) {
            let [x, y] = [clamp_u(x), clamp_u(y)];
            let (at, x) = if x < from_light {
                lights -= 1;
                (lights, x / from_light)
            } else {
                products += 1;
                (products - 1, (x - from_light) / (1.0 - from_light))
            };
            if let Some(number) = numbers.get_mut(at) {
                *number = [min(x, ONE_MINUS_EPSILON), y];
            }
        }
        let numbers = numbers.get(..u.len()).unwrap_or_default();
        let (of_product, of_light) = numbers.split_at_checked(products).unwrap_or_default();
        let (by_product, by_light) = drawn.split_at_mut_checked(products).unwrap_or_default();
        samples(level, shaded, frame, of_product, by_product);
        if from_light > 0.0 {
            samples(level, &shaded.light, frame, of_light, by_light);
            self.query(drawn, products, other);
        }
        products
    }

    /// The densities of directions from the product in the light, and of the others in the product. Apart: drawing needs the stack, too.
    #[inline(never)]
    fn query(&self, drawn: &[Drawn], products: usize, other: &mut [f32; TOGETHER]) {
        let &Source { level, frame, shaded, .. } = self;
        let mut wi = [[0.0; 3]; TOGETHER];
        for (wi, drawn) in wi.iter_mut().zip(drawn) {
            *wi = drawn.wi;
        }
        let wi = wi.get(..drawn.len()).unwrap_or_default();
        let (in_product, in_light) = wi.split_at_checked(products).unwrap_or_default();
        let (light_of, product_of) = other.split_at_mut_checked(products).unwrap_or_default();
        pdfs(level, &shaded.light, frame, in_product, light_of);
        pdfs(level, shaded, frame, in_light, product_of);
    }
}

/// Whether a direction counts at a point.
fn is_above(point: &Point<'_>, [x, y, z]: [f32; 3]) -> bool {
    let [nx, ny, nz] = point.normal;
    point.whole_sphere || point.material.transmits() || nx * x + ny * y + nz * z > 0.0
}
