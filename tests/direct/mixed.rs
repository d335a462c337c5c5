//! Several rays are samples of a mixture: most are the product's, a few the light's, and each weighs one over N times the density of both
//! together (rule 24).

use super::client::{self, Client};
use super::light::{Light, Thread, first_hit};
use super::maps;
use wis::brdf::material::Shape;
use wis::light::batch::Density;
use wis::product::density::Shaded;
use wis::product::prepare::{Config, DIVIDED, prepare};
use wis::product::stored::{Product, most_bytes};
use wis::simd::Level;

/// The share that the light has, as each ray tells it: where product and light are far apart, all tell the same, to the rounding of f32.
#[test]
fn weights_are_those_of_the_mixture() {
    for (name, map) in maps() {
        let light = Light::of(&map);
        let environment = light.environment();
        for shape in [Shape::LAMBERT, Shape::ggx(0.5, 0.5)] {
            let client = Client::new(&[shape], client::lambert);
            let point = client.point();
            let mut memory = vec![0u128; most_bytes(DIVIDED).div_ceil(16)];
            let bytes = bytemuck::cast_slice_mut(&mut memory);
            prepare(Level::detect(), &environment, &point, &Config::default(), bytes).unwrap();
            let product = Product::view(bytes).expect("it was prepared");
            let (shaded, frame) = (Shaded { light: environment.light(), product }, environment.frame());
            for rays in [4, 16] {
                let (mut least, mut most, mut told) = (f64::MAX, f64::MIN, 0);
                for seed in 0..400 {
                    for ray in Thread::new(16).direct(&environment, &point, first_hit(seed), rays) {
                        let p = f64::from(shaded.pdf::<f32>(&frame, ray.wi));
                        let l = f64::from(environment.light().pdf::<f32>(&frame, ray.wi));
                        if (l - p).abs() > 0.2 * p {
                            let share = (1.0 / (rays as f64 * f64::from(ray.weight)) - p) / (l - p);
                            (least, most, told) = (least.min(share), most.max(share), told + 1);
                        }
                    }
                }
                println!("{name}, {shape:?}, {rays} rays: {least:.6} to {most:.6}, told by {told}");
                assert!(told > 100 && most - least < 1e-4, "{name}, {rays} rays: {least} to {most}, told by {told}");
                assert!(least > 0.001 && most < 0.2, "{name}, {rays} rays: {least}");
            }
        }
    }
}
