//! Diffuse reflection, and diffuse transmission as its mirror image.

use crate::simd::Num;
use crate::sphere::sin_cos_turns;
use core::f32::consts::FRAC_1_PI;

/// The density of a cosine-distributed direction with this cosine.
#[inline(always)]
pub fn pdf<F: Num>(cosine: F) -> F {
    cosine.max(F::splat(0.0)) * FRAC_1_PI
}

/// A direction with a cosine distribution about +z: the concentric disc of Shirley and Chiu 1997, raised to the hemisphere.
#[inline(always)]
pub fn sample<F: Num>(u: [F; 2]) -> [F; 3] {
    let (zero, one, two) = (F::splat(0.0), F::splat(1.0), F::splat(2.0));
    let (a, b) = (two * u[0] - one, two * u[1] - one);
    let steep = a.abs().lt(b.abs());
    let (radius, minor) = (F::select(steep, b, a), F::select(steep, a, b));
    let divisor = F::select(radius.abs().lt(F::splat(f32::MIN_POSITIVE)), one, radius);
    // A quarter of the circle on either side of the axis, in quarter turns from -1/2 to 1/2.
    let turns = F::splat(0.5) * (minor / divisor);
    let (sine, cosine) = sin_cos_turns(turns.abs());
    let sine = sine.copysign(turns);
    let (along, across) = (radius * cosine, radius * sine);
    let (x, y) = (F::select(steep, across, along), F::select(steep, along, across));
    [x, y, (one - radius * radius).max(zero).sqrt()]
}
