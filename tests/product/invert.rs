//! invert leads back, or says that nothing does.

use super::built::{Built, Random};
use super::lookup::{Map, double, single};
use super::maps::{layouts, rough};
use super::points::{materials, view};
use super::prepared::Prepared;
use wis::brdf::material::{Material, Shape};
use wis::light::batch::Density;
use wis::light::density::Inverted;
use wis::light::plan::{Description, Filter};

/// The diagonal of a patch, as a chord: what it leads back to is the same patch.
const PATCH: f64 = 0.14;
/// How near most directions come, as a chord; in patches with small shares of u fewer numbers of 24 bits lie.
const NEAR: f64 = 1e-3;

#[test]
fn it_leads_back() {
    let mut random = Random(41);
    for (layout, width, height) in layouts(32) {
        let map = Map::of_directions(layout, width, height, rough);
        for filter in [Filter::Bilinear, Filter::Nearest] {
            let built = Built::new(&map, &map.description(filter));
            let (mut unreachable, mut unsampled, mut all, mut far) = (0, 0, 0, 0);
            for (name, material) in materials() {
                let prepared = Prepared::new(&built, &view(&material, random.direction(), 60.0, random.f64()));
                let shaded = prepared.shaded();
                for i in 0..1000 {
                    let frame = random.frame();
                    let u = [random.unit(), random.unit()];
                    let wi = if i % 2 == 0 { prepared.sample(u).0 } else { single(random.direction()) };
                    match shaded.invert(&frame, wi) {
                        Inverted::To(u) => {
                            assert!(u.iter().all(|u| (0.0..1.0).contains(u)));
                            let back = shaded.sample::<f32>(&frame, u).0;
                            let (a, b) = (double(wi), double(back));
                            let distance = (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
                            far += usize::from(distance > NEAR);
                            assert!(distance <= PATCH, "{name} {wi:?} {u:?} {back:?}");
                        }
                        // A sample of a lobe may lie where the grid has hardly any share.
                        Inverted::Unreachable => {
                            let drawn = i % 2 == 0 && prepared.product().header.peak == 0.0;
                            unsampled += usize::from(drawn);
                            unreachable += 1;
                        }
                        Inverted::Zero => {
                            assert_eq!(shaded.pdf::<f32>(&frame, wi), 0.0);
                        }
                    }
                    all += 1;
                }
            }
            println!(
                "{layout:?} {filter:?}: {unreachable} of {all} unreachable, of which {unsampled} sampled, {far} in the patch only"
            );
            assert!(20 * far < all, "{layout:?} {filter:?}: {far} of {all} are led back to the patch only");
            assert!(1000 * unsampled < all, "{layout:?} {filter:?}: {unsampled} of {all} samples are not led back to");
            assert!(10 * unreachable < all, "{layout:?} {filter:?}: {unreachable} of {all} unreachable");
        }
    }
}

/// A sample has a density, so it is led back to or unreachable: also where it lies on the border of light under which all is black.
#[test]
fn samples_at_borders_have_a_density() {
    let ends = [0.0, 1.0 / 16_777_216.0, 1.0 - f32::EPSILON / 2.0];
    let mut random = Random(43);
    for (layout, width, height) in layouts(18) {
        let map = Map::of_directions(layout, width, height, |d| {
            if (9.0 * d[0]).sin() * (7.0 * d[1]).cos() > 0.3 { rough(d) } else { 0.0 }
        });
        for filter in [Filter::Bilinear, Filter::Nearest] {
            let built =
                Built::new(&map, &Description { exact_zero: true, compensated: true, ..map.description(filter) });
            let material = Material::new(&[Shape::ggx(0.3, 0.3)]).unwrap();
            for i in 0..12 {
                let prepared =
                    Prepared::new(&built, &view(&material, random.direction(), 5.0 * f64::from(i), random.f64()));
                let shaded = prepared.shaded();
                for k in 0..20_000 {
                    let mut u = [random.unit(), random.unit()];
                    u[k % 2] = ends[k / 2 % 3];
                    let frame = random.frame();
                    let (wi, pdf) = shaded.sample::<f32>(&frame, u);
                    let (light, light_pdf) = shaded.light.sample::<f32>(&frame, u);
                    let zero = shaded.invert(&frame, wi) == Inverted::Zero;
                    assert!(pdf > 0.0 && !zero, "{layout:?} {filter:?}: {u:?} led to {wi:?} of {pdf}");
                    let zero = shaded.light.invert(&frame, light) == Inverted::Zero;
                    assert!(light_pdf > 0.0 && !zero, "{layout:?} {filter:?}: {u:?} led to {light:?} of {light_pdf}");
                }
            }
        }
    }
}
