//! What the renderer knows of a measured BRDF, whatever file it came from: luminance, in a frame whose normal is +z.

use crate::grid::Slices;
use crate::lanes::{F8, LANES, V8};
use glam::{DVec3, Vec2, Vec3};
use std::fmt::Debug;
use wide::CmpGt;

/// A measured BRDF that can be sampled: one direction at a time in double precision, or eight. Each of both follows from the other.
pub trait Reflectance: Debug + Sync {
    fn name(&self) -> &str;
    /// About the roughness alpha of a GGX lobe of this width.
    fn roughness(&self) -> f64;
    /// BRDF x cosine of `wi`; 0 unless both directions are above the surface.
    fn eval(&self, wo: DVec3, wi: DVec3) -> f64 {
        one(self.eval_lanes(&self.view(wo), V8::splat(wi.as_vec3()), 1).0)
    }

    /// A direction about in proportion to [`Reflectance::eval`]; below the surface where there is none.
    fn sample(&self, wo: DVec3, u: [f64; 2]) -> DVec3 {
        self.sample_lanes(&self.view(wo), u.map(|u| F8::splat(u as f32)), 1).get(0).as_dvec3()
    }

    /// The pdf of [`Reflectance::sample`].
    fn pdf(&self, wo: DVec3, wi: DVec3) -> f64 {
        one(self.eval_lanes(&self.view(wo), V8::splat(wi.as_vec3()), 1).1)
    }

    /// What all evaluations and samples for one `wo` have in common.
    fn view(&self, wo: DVec3) -> View {
        View::new(wo)
    }

    /// [`Reflectance::eval`] and [`Reflectance::pdf`] of the first `used` directions, which have length 1. Other lanes are
    /// finite and mean nothing.
    fn eval_lanes(&self, view: &View, wi: V8, used: usize) -> (F8, F8) {
        let (mut value, mut pdf) = ([0.0; LANES], [0.0; LANES]);
        for i in 0..used {
            let wi = wi.get(i).as_dvec3().normalize();
            (value[i], pdf[i]) = (self.eval(view.wo, wi) as f32, self.pdf(view.wo, wi) as f32);
        }
        (F8::new(value), F8::new(pdf))
    }

    /// [`Reflectance::sample`] for the first `used` points.
    fn sample_lanes(&self, view: &View, u: [F8; 2], used: usize) -> V8 {
        let [x, y] = u.map(|u| u.to_array().map(f64::from));
        let drawn = |i: usize| if i < used { self.sample(view.wo, [x[i], y[i]]).as_vec3() } else { Vec3::Z };
        V8::each(std::array::from_fn(drawn))
    }
}

/// The direction to the viewer and what follows from it.
#[derive(Clone, Copy, Debug)]
pub struct View {
    pub wo: DVec3,
    /// Its sine and cosine to the normal.
    sine: f32,
    cosine: f32,
    /// Cosine and sine of its azimuth.
    cos_sin: [f32; 2],
    /// Its angle to the normal, and its azimuth from -pi to pi.
    pub elevation: f32,
    pub azimuth: f32,
    /// The slices of tables by elevation.
    pub slices: Slices,
    /// What values of the tables are multiplied by.
    pub scale: f32,
}

impl View {
    pub fn new(wo: DVec3) -> View {
        let Vec3 { x, y, z } = wo.as_vec3();
        let sine = Vec2::new(x, y).length();
        let cos_sin = if sine > 0.0 { [x / sine, y / sine] } else { [1.0, 0.0] };
        // Both angles in one step: elevation, then azimuth. An arc tangent is precise near the normal.
        let lanes = |first: f32, others: f32| F8::new(std::array::from_fn(|i| if i == 0 { first } else { others }));
        let [elevation, azimuth, ..] = lanes(sine, y).atan2(lanes(z, x)).to_array();
        View { wo, sine, cosine: z, cos_sin, elevation, azimuth, slices: Slices::default(), scale: 1.0 }
    }

    /// The direction to the viewer, in the frame of [`View::facing`].
    #[inline]
    pub fn faced(&self) -> V8 {
        V8::new(F8::splat(self.sine), F8::ZERO, F8::splat(self.cosine))
    }

    /// Where the viewer and a height are above the surface.
    #[inline]
    pub fn above(&self, height: F8) -> F8 {
        height.fast_min(F8::splat(self.cosine)).cmp_gt(F8::ZERO)
    }

    /// Directions in the frame whose x axis is below the viewer.
    #[inline]
    pub fn facing(&self, V8 { x, y, z }: V8) -> V8 {
        let (cos, sin) = (F8::splat(self.cos_sin[0]), F8::splat(self.cos_sin[1]));
        V8::new(x * cos + y * sin, y * cos - x * sin, z)
    }

    /// Back from there.
    #[inline]
    pub fn back(&self, V8 { x, y, z }: V8) -> V8 {
        let (cos, sin) = (F8::splat(self.cos_sin[0]), F8::splat(self.cos_sin[1]));
        V8::new(x * cos - y * sin, x * sin + y * cos, z)
    }
}

/// The number in the first lane.
fn one(lanes: F8) -> f64 {
    f64::from(lanes.as_array_ref()[0])
}
