//! The client's own BRDF as the target: means stay right, errors fall, and failures are answers.

use super::client::{self, Client};
use super::light::{Light, TURNED, Thread, first_hit, mean_of};
use super::maps;
use crate::support::Map;
use crate::support::maps::Filter;
use crate::support::statistics::{LARGEST_MISSED, Mean, corrected};
use crate::support::vector::rotate_back;
use wis::brdf::material::Shape;
use wis::brdf::point::{Point, Target};
use wis::direct::Ray;
use wis::direct::sampler::{Config, Sampler};
use wis::simd::Level;
use wis::status::{Error, Status};

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

/// Estimates of a client, with a target or without.
fn estimates(client: &Client, map: &Map, light: &Light, rays: usize, target: Option<&dyn Target>) -> Mean {
    let mut thread = Thread::new(16);
    mean_of(corrected(8), |seed| {
        let point = Point { target, ..client.point() };
        let rays = thread.direct(&light.environment(), &point, first_hit(seed), rays);
        let brings = rays.iter().map(|ray| {
            let wi = ray.wi.map(f64::from);
            f64::from(ray.weight) * client.response(wi) * map.radiance(Filter::Bilinear, rotate_back(&TURNED, wi))[0]
        });
        brings.sum()
    })
}

fn variance(mean: &Mean) -> f64 {
    mean.standard_error().powi(2) * mean.count
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
            let variances = [None, Some(&own as &dyn Target)].map(|target| {
                let mean = estimates(&client, &map, &light, rays, target);
                let p = mean.p_value(integral, error);
                assert!(p > corrected(8), "{name}, {rays} rays: {} instead of {integral}, p {p:e}", mean.mean);
                assert!(mean.smallest_fault(corrected(8)) < LARGEST_MISSED);
                variance(&mean)
            });
            println!("{name}, {rays} rays: {:.2} times less variance", variances[0] / variances[1]);
            assert!(variances[1] < variances[0]);
        }
    }
}

/// What it costs that lobes are not the client's BRDF: the relative standard deviation of what one ray brings, where nothing blocks it. Bounds
/// are a tenth above what this test prints, and that stands in docs/integrating.md.
#[test]
fn what_other_brdfs_cost() {
    let alike = |f0, brdf| Client { f0, ..Client::new(&[Shape::ggx(0.3, 0.3)], brdf) };
    let two = [Shape::LAMBERT, Shape::ggx(0.3, 0.3)];
    let cases = [
        ("the lobe itself", alike(0.8, client::ggx_03), [0.076, 0.109]),
        ("Fresnel's equations", alike(0.04, client::fresnel_03), [0.118, 0.111]),
        ("separable shadowing", alike(0.8, client::separable_03), [0.077, 0.109]),
        ("a coated base", Client { f0: 0.2, ..Client::new(&two, client::coated) }, [0.195, 0.216]),
        ("a lobe of 0.05", Client::new(&[Shape::ggx(0.05, 0.05)], client::ggx_03), [2.75, 1.50]),
        ("a diffuse lobe", Client::new(&[Shape::LAMBERT], client::ggx_03), [1.11, 0.63]),
    ];
    for (what, client, most) in cases {
        let own = Own(&client);
        for ((name, map), most) in maps().into_iter().zip(most) {
            let light = Light::of(&map);
            let [lobes, own] = [None, Some(&own as &dyn Target)].map(|target| {
                let mean = estimates(&client, &map, &light, 1, target);
                variance(&mean).sqrt() / mean.mean
            });
            println!("{what}, {name}: {lobes:.3}, with the BRDF as target {own:.3}");
            assert!(lobes < most, "{what}, {name}: {lobes}");
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
        sampler.direct(&light.environment(), &point, first_hit(1), 4, &mut rays)
    };
    for bad in [None, Some(f32::NAN), Some(f32::INFINITY), Some(-1.0)] {
        assert_eq!(answer(bad), Err(Error::new(Status::CallbackFailed, 0).of(c"target")), "{bad:?}");
    }
    // Black everywhere: all candidates are alike. Huge: they are counted as the largest number.
    for sound in [0.0, -0.0, 1e-45, f32::MAX] {
        assert!(matches!(answer(Some(sound)), Ok(1..=4)), "{sound}");
    }
}
