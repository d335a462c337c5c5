//! BRDF x cosine in directions of map space, as the grid interpolates it.

use crate::brdf::surface::Surface;
use crate::simd::Num;

/// How far normals of other hits may lie from this one, for which cosines are widened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// The cosine of its half-angle; 1: this normal only.
    pub cosine: f32,
    /// The sine of its half-angle.
    pub sine: f32,
}

/// The luminance of BRDF x cosine; below the horizon of a hemisphere it goes on with negative sign, as if mirrored.
///
/// A cell that crosses the horizon would otherwise waste samples below: interpolation between corners that are clamped at 0
/// reaches 0 at the lower corners only.
#[inline(always)]
pub fn response<F: Num>(surface: &Surface, cone: &Cone, d: [F; 3]) -> F {
    let w = surface.to_local(d);
    let here = signed(surface, w);
    if cone.sine == 0.0 {
        return here;
    }
    here.max(signed(surface, raised(cone, w)))
}

#[inline(always)]
fn signed<F: Num>(surface: &Surface, [x, y, z]: [F; 3]) -> F {
    if surface.is_whole() {
        return surface.eval([x, y, z]).0;
    }
    surface.eval([x, y, z.abs()]).0.copysign(z)
}

/// A direction turned towards the normal by the cone's half-angle, at most onto it: so the cosine is that to the nearest normal of
/// the cone.
#[inline(always)]
fn raised<F: Num>(cone: &Cone, [x, y, z]: [F; 3]) -> [F; 3] {
    let (zero, one) = (F::splat(0.0), F::splat(1.0));
    let (cosine, sine) = (F::splat(cone.cosine), F::splat(cone.sine));
    let across = (x * x + y * y).sqrt();
    let inside = cosine.le(z);
    let up = F::select(inside, one, z * cosine + across * sine);
    let out = F::select(inside, zero, (across * cosine - z * sine).max(zero));
    let scale = out / across.max(F::splat(f32::MIN_POSITIVE));
    [x * scale, y * scale, up]
}
