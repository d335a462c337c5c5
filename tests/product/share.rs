//! Which hits a product serves.

use super::built::Built;
use super::lookup::Map;
use super::maps::sky;
use super::points::view;
use super::prepared::Prepared;
use wis::brdf::material::{Kind, Material, Shape};
use wis::light::chart::Layout;
use wis::light::plan::Filter;
use wis::product::prepare::Config;

fn built() -> Built {
    let map = Map::of_directions(Layout::LatLong, 64, 32, sky);
    Built::new(&map, &map.description(Filter::Bilinear))
}

fn material(shapes: &[Shape]) -> Material {
    Material::new(shapes).unwrap()
}

fn mix() -> Material {
    material(&[Shape::LAMBERT, Shape::ggx(0.3, 0.3)])
}

#[test]
fn weights_and_reflectances_may_differ_but_not_lobes() {
    let built = built();
    let mix = mix();
    let point = view(&mix, [0.0, 0.0, 1.0], 30.0, 0.5);
    let product = Prepared::new(&built, &point);
    let covers = |edit: &dyn Fn(&mut wis::brdf::point::Point<'_>)| {
        let mut other = point;
        edit(&mut other);
        product.product().header.covers(&other)
    };
    assert!(covers(&|_| ()));
    assert!(covers(&|p| p.weight = [[0.1, 0.9, 0.3]; 4]));
    assert!(covers(&|p| p.f0 = [[0.06; 3]; 4]));
    assert!(!covers(&|p| p.f0 = [[0.5; 3]; 4]));
    assert!(covers(&|p| p.weight[1] = [0.0; 3]));
    assert!(!covers(&|p| p.whole_sphere = true));
    assert!(!covers(&|p| p.cosine_included = true));
    assert!(!covers(&|p| p.normal = [0.0, 0.02, 0.9998]));
    for (shapes, serves) in [
        (vec![Shape::LAMBERT], false),
        (vec![Shape::ggx(0.3, 0.3), Shape::LAMBERT], false),
        (vec![Shape::LAMBERT, Shape::ggx(0.25, 0.35)], true),
        (vec![Shape::LAMBERT, Shape::ggx(0.15, 0.3)], false),
    ] {
        let other = material(&shapes);
        let mut point = view(&other, [0.0, 0.0, 1.0], 30.0, 0.5);
        point.weight = [[1.0; 3]; 4];
        assert_eq!(product.product().header.covers(&point), serves, "{shapes:?}");
    }
}

/// A sharp lobe through glass points elsewhere than one through water.
#[test]
fn another_refractive_index_is_not_served() {
    let built = built();
    let through = |eta: f32| material(&[Shape { kind: Kind::GgxTransmission, a: 0.2, b: 0.2, eta }]);
    let (glass, water) = (through(1.5), through(1.33));
    let point = view(&glass, [0.0, 0.0, 1.0], 30.0, 0.5);
    let product = Prepared::new(&built, &point);
    assert!(product.product().header.covers(&point));
    assert!(!product.product().header.covers(&view(&water, [0.0, 0.0, 1.0], 30.0, 0.5)));
}

/// Weights f cos / pdf grow as the share of a lobe does.
#[test]
fn a_lobe_that_scatters_a_much_larger_share_is_not_served() {
    let built = built();
    let mix = mix();
    let mut point = view(&mix, [0.0, 0.0, 1.0], 30.0, 0.5);
    point.weight[0] = [0.1; 3];
    point.f0 = [[0.1; 3]; 4];
    // Both lobes scatter a half.
    let product = Prepared::new(&built, &point);
    for (diffuse, serves) in [(0.01, false), (0.03, false), (0.08, true), (0.12, true), (0.2, false), (0.9, false)] {
        point.weight[0] = [diffuse; 3];
        assert_eq!(product.product().header.covers(&point), serves, "{diffuse}");
    }
}

#[test]
fn a_lobe_that_was_black_is_not_served() {
    let built = built();
    let mix = mix();
    let mut point = view(&mix, [0.0, 0.0, 1.0], 30.0, 0.5);
    point.weight[1] = [0.0; 3];
    let product = Prepared::new(&built, &point);
    assert!(product.product().header.covers(&point));
    point.weight[1] = [0.2; 3];
    assert!(!product.product().header.covers(&point));
}

#[test]
fn glossy_lobes_need_about_the_same_view() {
    let built = built();
    for (shape, far, near) in [(Shape::LAMBERT, 0.0, 80.0), (Shape::ggx(0.4, 0.4), 60.0, 35.0)] {
        let lobes = material(&[shape]);
        let product = Prepared::with(&built, &view(&lobes, [0.0, 0.0, 1.0], 30.0, 0.5), &Config::default());
        assert!(product.product().header.covers(&view(&lobes, [0.0, 0.0, 1.0], near, 0.5)));
        assert!(far == 0.0 || !product.product().header.covers(&view(&lobes, [0.0, 0.0, 1.0], far, 0.5)));
    }
}
