//! The sampler of version 0.1 that the library still has: its product of wavelets. The report compares it as it compares peers.

use crate::client::{self, Block, Product};
use crate::estimator::Setting;
use crate::scene::ShadingPoint;

/// The product of a setting at a point.
///
/// # Errors
/// Those of the library.
pub fn prepare<'a>(setting: &Setting<'a>, point: &ShadingPoint, memory: &'a mut Block) -> client::Result<Product<'a>> {
    setting.material.prepare_at(setting.cost, setting.environment, point, &setting.preparation, memory)
}
