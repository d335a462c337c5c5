//! What products are prepared for: lobes, or a BRDF that the client evaluates.

use crate::brdf::point::Target;
use crate::sphere::unit;
use crate::status::{Error, Result, Status};
use crate::wavelets::lanes::vector::{V3, dot, splat, to_arrays};
use crate::wavelets::lanes::{LANES, Lanes};
use crate::wavelets::lobe::{Asked, Brdf, Lobes, MAX_PEAKS, Peak, share_of_lobe};
use crate::wavelets::query::{Query, WIS_WAVELET_QUERY_WHOLE_SPHERE};
use glam::Vec3;

/// The client's BRDF.
#[derive(Debug)]
pub struct Callback<'a> {
    hemisphere: Option<Vec3>,
    peak: Option<Peak>,
    /// Which share of the BRDF is continued below the horizon.
    share: f32,
    target: &'a dyn Target,
}

impl<'a> Callback<'a> {
    /// A BRDF at the normal of a query, concentrated within `half_angle` of the direction `peak`; 0: not narrow.
    ///
    /// # Errors
    /// [`Error`] names the field of the query.
    pub fn new(
        target: &'a dyn Target,
        (peak, half_angle): ([f32; 3], f32),
        query: &Query,
    ) -> core::result::Result<Callback<'a>, Error> {
        let whole = query.flags & WIS_WAVELET_QUERY_WHOLE_SPHERE != 0;
        if query.flags & !WIS_WAVELET_QUERY_WHOLE_SPHERE != 0 {
            return Err(Error::range(c"flags"));
        }
        let normal = unit(query.normal).ok_or(Error::transform(c"normal"))?;
        let peak = unit(peak).filter(|_| half_angle > 0.0);
        let peak = peak.map(|direction| Peak::disc(direction, half_angle));
        let hemisphere = if whole { None } else { Some(normal) };
        let share = if whole { 0.0 } else { share_of_lobe(peak) };
        Ok(Callback { hemisphere, peak, share, target })
    }
}

/// What products are prepared for. One type, since each would have its own copy of the preparation.
#[allow(clippy::large_enum_variant)]
pub enum Material<'a> {
    /// The query's lobes.
    Lobes(Lobes<'a>),
    /// The client's BRDF.
    Callback(Callback<'a>),
}

impl Brdf for Material<'_> {
    fn hemisphere(&self) -> Option<Vec3> {
        match self {
            Material::Lobes(lobes) => lobes.hemisphere(),
            Material::Callback(callback) => callback.hemisphere,
        }
    }

    fn rounds(&self) -> u32 {
        match self {
            Material::Lobes(lobes) => lobes.rounds(),
            // A peak is where the caller says, but of any shape.
            Material::Callback(callback) => 1 + u32::from(callback.peak.is_some()),
        }
    }

    fn may_reflect(&self) -> bool {
        match self {
            Material::Lobes(lobes) => lobes.may_reflect(),
            Material::Callback(_) => true,
        }
    }

    fn peaks(&self) -> [Option<Peak>; MAX_PEAKS] {
        match self {
            Material::Lobes(lobes) => lobes.peaks(),
            Material::Callback(callback) => [callback.peak, None, None, None],
        }
    }

    #[inline(always)]
    fn eval<F: Lanes>(&mut self, wi: &[Asked<F>], f_cos: &mut [F]) -> Result<()> {
        match self {
            Material::Lobes(lobes) => lobes.eval(wi, f_cos),
            Material::Callback(callback) => callback.eval(wi, f_cos),
        }
    }
}

impl Callback<'_> {
    #[inline(never)]
    fn eval<F: Lanes>(&mut self, wi: &[Asked<F>], f_cos: &mut [F]) -> Result<()> {
        wi.chunks(MOST_GROUPS).zip(f_cos.chunks_mut(MOST_GROUPS)).try_for_each(|(wi, f_cos)| self.call(wi, f_cos))
    }

    /// One call of the client's function.
    fn call<F: Lanes>(&mut self, wi: &[Asked<F>], f_cos: &mut [F]) -> Result<()> {
        let mut directions = [[0.0f32; 3]; MOST_GROUPS * LANES];
        let mut count = 0;
        for Asked { wi, lanes } in wi {
            let [x, y, z] = to_arrays(self.mirrored(*wi).0);
            for (i, ((&x, &y), &z)) in x.iter().zip(&y).zip(&z).enumerate() {
                if let Some(slot) = directions.get_mut(count).filter(|_| lanes >> i & 1 == 1) {
                    *slot = [x, y, z];
                    count += 1;
                }
            }
        }
        let mut values = [f32::NAN; MOST_GROUPS * LANES];
        let asked = directions.get(..count).unwrap_or(&directions);
        let answered = self.target.f_cos(asked, values.get_mut(..count).unwrap_or(&mut []));
        let mut values = values.into_iter().take(count);
        for (Asked { wi, lanes }, out) in wi.iter().zip(f_cos) {
            let mut eight = [0.0; LANES];
            for (i, slot) in eight.iter_mut().enumerate() {
                if lanes >> i & 1 == 1 {
                    *slot = values.next().unwrap_or(f32::NAN);
                }
            }
            if !answered || !eight.iter().all(|f| (0.0..=f32::MAX).contains(f)) {
                return Err(Status::CallbackFailed);
            }
            let (value, below) = (F::from_array(eight), self.mirrored(*wi).1);
            *out = F::select(below, value * F::splat(-self.share), value);
        }
        Ok(())
    }

    /// Directions, those below a horizon that values continue across as their mirror images; and which these are.
    fn mirrored<F: Lanes>(&self, wi: V3<F>) -> (V3<F>, F::Mask) {
        let Some(normal) = self.hemisphere.filter(|_| self.share > 0.0) else { return (wi, F::mask(0)) };
        let normal = splat(normal.to_array());
        let below = dot(wi, normal).min(F::splat(0.0));
        let twice = below + below;
        let [x, y, z] = [normal[0] * twice, normal[1] * twice, normal[2] * twice];
        ([wi[0] - x, wi[1] - y, wi[2] - z], below.lt(F::splat(0.0)))
    }
}

/// The most groups of eight directions that a client's function is asked for at once.
const MOST_GROUPS: usize = 5;
