//! BRDF x cosine in directions of map space, as the grid interpolates it.

use crate::brdf::surface::Surface;
use crate::light::guide::{Short, read};
use crate::simd::{Apart, Num};

/// How far normals of other hits may lie from this one, for which cosines are widened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// The cosine of its half-angle; 1: this normal only.
    pub cosine: f32,
    /// The sine of its half-angle.
    pub sine: f32,
}

/// Evaluates the luminance of BRDF x cosine in directions of map space, a whole number of lanes of them; below the horizon of a
/// hemisphere it goes on with negative sign, as if mirrored.
///
/// A cell that crosses the horizon would otherwise waste samples below: interpolation between corners that are clamped at 0
/// reaches 0 at the lower corners only.
#[inline(always)]
pub fn respond<F: Num>(surface: &Surface, cone: &Cone, directions: [&[Short]; 3], out: &mut [f32]) {
    F::apart(Respond { surface, cone, directions, out });
}

struct Respond<'a> {
    surface: &'a Surface,
    cone: &'a Cone,
    directions: [&'a [Short]; 3],
    out: &'a mut [f32],
}

impl<F: Num> Apart<F> for Respond<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Respond { surface, cone, directions: [x, y, z], out } = self;
        let width = F::WIDTH;
        let groups = x.chunks_exact(width).zip(y.chunks_exact(width)).zip(z.chunks_exact(width));
        for (((x, y), z), out) in groups.zip(out.chunks_exact_mut(width)) {
            let mut w = surface.to_local([read::<F>(x), read::<F>(y), read::<F>(z)]);
            let mut value = F::splat(f32::MIN);
            // Once more if normals may turn: one loop, so that the lobes stand here once.
            let mut again = cone.sine != 0.0;
            loop {
                value = value.max(signed(surface, w));
                if !again {
                    break;
                }
                w = raised(cone, w);
                again = false;
            }
            out.copy_from_slice(value.store().as_ref());
        }
    }
}

#[inline(always)]
fn signed<F: Num>(surface: &Surface, [x, y, z]: [F; 3]) -> F {
    let whole = surface.is_whole();
    let value = surface.value([x, y, if whole { z } else { z.abs() }]);
    if whole { value } else { value.copysign(z) }
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
