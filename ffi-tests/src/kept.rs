//! Products that a client keeps for the hits of a pixel: what an engineer writes who has wis_product_covers but not wis_direct.

use crate::client::{Block, Result, raw};
use crate::environment::{Environment, Light, Sampler, product_bytes, product_config};
use std::cell::RefCell;

/// Products of a pixel.
pub const MOST: usize = 4;
/// How far the normal of a hit may turn from that of a product, in radians: the good start that wis.h names.
pub const CONE: f32 = 0.05;

/// The newest products of a pixel, in memory that is there from the start.
pub struct Kept {
    config: raw::wis_product_config,
    products: [Block; MOST],
    /// Products of this pixel so far, replaced ones too.
    prepared: usize,
}

impl Kept {
    /// # Errors
    /// Those of the library.
    pub fn new() -> Result<Kept> {
        let config = raw::wis_product_config { cone: CONE, ..product_config() };
        let bytes = product_bytes(&config)?;
        Ok(Kept { config, products: std::array::from_fn(|_| Block::new(bytes)), prepared: 0 })
    }

    /// Forgets all products.
    pub fn begin_pixel(&mut self) {
        self.prepared = 0;
    }

    /// The newest product that covers a point, or else a new one in place of the oldest.
    ///
    /// # Errors
    /// Those of the library.
    pub fn product<'a>(
        &'a mut self,
        environment: &'a Environment,
        sampler: &'a RefCell<Sampler>,
        point: &raw::wis_point,
    ) -> Result<Light<'a>> {
        let slot = match self.covering(environment, sampler, point)? {
            Some(slot) => slot,
            None => self.prepare(environment, &mut sampler.borrow_mut(), point)?,
        };
        Ok(Light::prepared(environment, sampler, &self.products[slot]))
    }

    fn covering(
        &self,
        environment: &Environment,
        sampler: &RefCell<Sampler>,
        point: &raw::wis_point,
    ) -> Result<Option<usize>> {
        for number in (self.prepared.saturating_sub(MOST)..self.prepared).rev() {
            let slot = number % MOST;
            if Light::prepared(environment, sampler, &self.products[slot]).covers(point)? {
                return Ok(Some(slot));
            }
        }
        Ok(None)
    }

    fn prepare(&mut self, environment: &Environment, sampler: &mut Sampler, point: &raw::wis_point) -> Result<usize> {
        let slot = self.prepared % MOST;
        let points = std::slice::from_ref(point);
        sampler.prepare(environment, &self.config, points, &mut self.products[slot], &mut [0])?;
        self.prepared += 1;
        Ok(slot)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment;
    use crate::material::Material;
    use crate::scene::ShadingPoint;
    use glam::Vec3;

    /// Normals by their angle: those within the cone share a product, the fifth product takes the place of the first, and a new
    /// pixel begins with none.
    #[test]
    fn the_four_newest_products_of_a_pixel_are_kept() {
        let environment = crate::light::Light::windows(32).tables(0, 0.0).unwrap();
        let sampler = RefCell::new(Sampler::new(1, 0, 1).unwrap());
        let material = Material::lambert();
        let own = environment::material(&material.lobes()).unwrap();
        let mut kept = Kept::new().unwrap();
        let mut prepared_after = |angle: f32| {
            let (normal, wo) = (Vec3::new(angle.sin(), 0.0, angle.cos()), Vec3::Z);
            let point = ShadingPoint { pixel: [0, 0], hit: 0, origin: Vec3::ZERO, normal, wo };
            if angle < 0.0 {
                kept.begin_pixel();
            }
            kept.product(&environment, &sampler, &material.point(&point, &own)).unwrap();
            kept.prepared
        };
        let angles = [0.0, 0.04, 0.2, 0.4, 0.6, 0.01, 0.8, 0.21, 0.0, 0.41, 0.2, -0.1];
        assert_eq!(angles.map(&mut prepared_after), [1, 1, 2, 3, 4, 4, 5, 5, 6, 6, 7, 1]);
    }
}
