//! The unit of the BRDF: scaling all lobes by a power of two changes no bit of directions and pdfs (rule 19).

use super::built::{Built, Random};
use super::lookup::Map;
use super::maps::rough;
use super::points::{materials, view};
use super::prepared::Prepared;
use wis::light::chart::Layout;
use wis::light::plan::Filter;

#[test]
fn scaling_the_lobes_scales_the_integral_only() {
    let map = Map::of_directions(Layout::LatLong, 64, 32, rough);
    let built = Built::new(&map, &map.description(Filter::Bilinear));
    let mut random = Random(139);
    for (name, material) in materials() {
        let point = view(&material, [0.0, 0.6, 0.8], 40.0, 1.0);
        let one = Prepared::new(&built, &point);
        // The tail of so sharp a lobe is denormal as it is.
        let smaller = if name == "Phong 500" { 2 } else { 0 };
        for k in [-60, -20, 20, 60].into_iter().skip(smaller) {
            let mut scaled = point;
            scaled.weight = point.weight.map(|weight| weight.map(|w| w * 2f32.powi(k)));
            let other = Prepared::new(&built, &scaled);
            let [a, b] = [&one, &other].map(|prepared| prepared.product().header.integral);
            assert_eq!((a * 2f64.powi(k)).to_bits(), b.to_bits(), "{name}, 2^{k}");
            for _ in 0..50 {
                let u = [random.unit(), random.unit()];
                let [a, b] = [one.sample(u), other.sample(u)];
                assert_eq!(
                    (a.0.map(f32::to_bits), a.1.to_bits()),
                    (b.0.map(f32::to_bits), b.1.to_bits()),
                    "{name} 2^{k}"
                );
            }
        }
    }
}
