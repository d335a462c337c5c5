//! The client's own BRDF as the target: means stay right, errors fall, and failures are answers.

use super::client::{self, Client};
use super::light::{Light, TURNED, Thread, first_hit, mean_of};
use super::maps;
use crate::support::maps::Filter;
use crate::support::statistics::{LARGEST_MISSED, corrected};
use crate::support::vector::rotate_back;
use wis::brdf::material::Shape;
use wis::brdf::point::{Fault, Point, Target};
use wis::direct::Ray;
use wis::direct::sampler::{Config, Sampler};
use wis::simd::Level;

/// A client's response, as single floats.
struct Own<'a>(&'a Client);

impl std::fmt::Debug for Own<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Own")
    }
}

impl Target for Own<'_> {
    fn f_cos(&self, wi: &[[f32; 3]], out: &mut [f32]) -> bool {
        assert!(!wi.is_empty() && wi.len() == out.len() && wi.len() <= 16);
        for (wi, out) in wi.iter().zip(out) {
            *out = self.0.response(wi.map(f64::from)) as f32;
        }
        true
    }
}

/// The coat that no lobes describe, proposed by a diffuse lobe and a wide one. The z-tests find a fault of 2 %.
#[test]
fn means_are_right_and_errors_smaller() {
    let client = Client::new(&[Shape::LAMBERT, Shape::ggx(0.5, 0.5)], client::coated);
    let own = Own(&client);
    for (name, map) in maps() {
        let (integral, error) = client.integral(&map, Filter::Bilinear, 12);
        let light = Light::of(&map);
        for rays in [1, 4] {
            let variance = |target| {
                let mut thread = Thread::new(16);
                let mean = mean_of(corrected(8), |seed| {
                    let point = Point { target, ..client.point() };
                    let rays = thread.direct(&light.environment(), &point, first_hit(seed), rays);
                    let brings = rays.iter().map(|ray| {
                        let wi = ray.wi.map(f64::from);
                        let radiance = map.radiance(Filter::Bilinear, rotate_back(&TURNED, wi))[0];
                        f64::from(ray.weight) * client.response(wi) * radiance
                    });
                    brings.sum()
                });
                let p = mean.p_value(integral, error);
                assert!(p > corrected(8), "{name}, {rays} rays: {} instead of {integral}, p {p:e}", mean.mean);
                assert!(mean.smallest_fault(corrected(8)) < LARGEST_MISSED);
                mean.standard_error().powi(2) * mean.count
            };
            let (lobes, own) = (variance(None), variance(Some(&own as &dyn Target)));
            println!("{name}, {rays} rays: {:.2} times less variance", lobes / own);
            assert!(own < lobes);
        }
    }
}

/// A target that answers a value, or that fails.
#[derive(Debug)]
struct Answers(Option<f32>);

impl Target for Answers {
    fn f_cos(&self, _: &[[f32; 3]], out: &mut [f32]) -> bool {
        out.fill(self.0.unwrap_or(1.0));
        self.0.is_some()
    }
}

#[test]
fn failures_and_bad_values_are_told() {
    let client = Client::new(&[Shape::LAMBERT], client::lambert);
    let light = Light::of(&maps()[0].1);
    let config = Config { rays: 4, candidates_per_ray: 0, hits_per_pixel: 0, reserved: 0 };
    let mut memory = vec![0u64; config.bytes().div_ceil(8)];
    let mut sampler = Sampler::new(Level::detect(), config, bytemuck::cast_slice_mut(&mut memory)).unwrap();
    let mut answer = |value| {
        let target = Answers(value);
        let point = Point { target: Some(&target), ..client.point() };
        let mut rays = [Ray::default(); 4];
        sampler.direct(&light.environment(), &point, first_hit(1), 4, &[], &mut rays)
    };
    for bad in [None, Some(f32::NAN), Some(f32::INFINITY), Some(-1.0)] {
        assert_eq!(answer(bad), Err(Fault::Target), "{bad:?}");
    }
    // Black everywhere: all candidates are alike. Huge: they are counted as the largest number.
    for sound in [0.0, -0.0, 1e-45, f32::MAX] {
        assert!(matches!(answer(Some(sound)), Ok(1..=4)), "{sound}");
    }
}
