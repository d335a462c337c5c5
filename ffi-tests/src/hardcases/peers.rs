//! What a common sampler of a lat-long map does on a hard case: the table of pbrt-v3, for a client that interpolates.

use super::laws::points;
use super::maps::Image;
use crate::client::{Density, Result};
use crate::light::Light;
use crate::piecewise::Piecewise;

/// Says what is wrong with its samples.
///
/// # Errors
/// None: a table does not fail.
pub fn judge(image: &Image) -> Result<String> {
    let light = Light::latlong("hard", image.width as usize, image.height as usize, image.texels.clone()).bilinear();
    let table = Piecewise::new(&light);
    let [mut samples, mut broken, mut dark, mut off, mut lit, mut blind] = [0; 6];
    for u in points().into_iter().filter(|u| u.iter().all(|u| (0.0..1.0).contains(u))) {
        let (drawn, is_number) = (table.sample(u)?, f32::is_finite);
        let again = f64::from(table.pdf(drawn.wi)?) / f64::from(drawn.pdf);
        samples += 1;
        match () {
            () if !drawn.wi.into_iter().all(is_number) || !is_number(drawn.pdf) => broken += 1,
            () if drawn.pdf <= 0.0 => dark += 1,
            () => off += usize::from((again - 1.0).abs() > 1e-3 || again.is_nan()),
        }
    }
    for ((wi, _), radiance) in light.quadrature(1).zip(light.luminance()) {
        lit += usize::from(*radiance > 0.0);
        blind += usize::from(*radiance > 0.0 && table.pdf(wi.to_array())? <= 0.0);
    }
    let faults =
        [(broken, "NaN or Inf", samples), (dark, "pdf 0", samples), (off, "off", samples), (blind, "blind", lit)];
    let told =
        faults.iter().filter(|(count, ..)| *count > 0).map(|(count, what, of)| format!("{what} in {count} of {of}"));
    let told: Vec<String> = told.collect();
    Ok(if told.is_empty() { "sound".into() } else { told.join("; ") })
}
