//! Products that serve several hits: cosines and the horizon, widened by a cone of normals (rule 26 of the design).

use crate::simd::Lanes;
use core::f32::consts::FRAC_PI_2;

/// How far normals may turn away from the one that is prepared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reuse {
    /// Cosine and sine of the angle.
    cosine: f32,
    sine: f32,
}

/// The cosine of an angle from 0 to pi/2.
pub fn cosine(angle: f32) -> f32 {
    libm::cosf(angle)
}

impl Reuse {
    /// This normal only.
    pub const NONE: Reuse = Reuse { cosine: 1.0, sine: 0.0 };

    /// Normals within an angle, 0 to pi/2.
    pub fn new(cone: f32) -> Reuse {
        if cone > 0.0 {
            Reuse { cosine: cosine(cone), sine: libm::sinf(if cone < FRAC_PI_2 { cone } else { FRAC_PI_2 }) }
        } else {
            Reuse::NONE
        }
    }

    /// Whether anything is widened.
    pub fn is_wide(&self) -> bool {
        self.sine > 0.0
    }

    /// How far the horizon sinks: directions down to this cosine below it may reflect light.
    pub fn horizon(&self) -> f32 {
        self.sine
    }

    /// `cos(max(0, theta - cone))` of a cosine, the largest that any of the normals gives; below 0 where all are.
    #[inline(always)]
    pub fn widen<F: Lanes>(&self, cosine: F) -> F {
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let sine = (one - cosine * cosine).max(zero).sqrt();
        let turned = cosine * F::splat(self.cosine) + sine * F::splat(self.sine);
        F::select(cosine.lt(F::splat(self.cosine)), turned, one)
    }
}
