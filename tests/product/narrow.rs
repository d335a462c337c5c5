//! Anisotropic lobes are as narrow as their narrow axis (rule 25), not as both axes together.

use super::built::Built;
use super::lookup::Map;
use super::maps::sky;
use super::points::view;
use super::prepared::Prepared;
use wis::brdf::material::{Material, Shape};
use wis::light::chart::Layout;
use wis::light::plan::Filter;

fn material(a: f32, b: f32) -> Material {
    Material::new(&[Shape::ggx(a, b)]).unwrap()
}

/// As many numbers draw from a lobe of 0.5 x 0.02 as from one of 0.02, and as few other views are served.
#[test]
fn the_narrow_axis_decides() {
    let map = Map::of_directions(Layout::LatLong, 64, 32, sky);
    let built = Built::new(&map, &map.description(Filter::Bilinear));
    let narrow = material(0.02, 0.02);
    let alone = view(&narrow, [0.0, 0.0, 1.0], 0.0, 0.5);
    let share = Prepared::new(&built, &alone).product().header.peak;
    assert!(share > 0.5, "{share}");
    for (a, b) in [(0.5, 0.02), (0.02, 0.5), (1.0, 0.02)] {
        let lobes = material(a, b);
        let product = Prepared::new(&built, &view(&lobes, [0.0, 0.0, 1.0], 0.0, 0.5));
        let header = *product.product().header;
        assert!((header.peak - share).abs() < 1e-3, "{a} x {b}: {} of {share}", header.peak);
        let covers = |degrees| product.product().header.covers(&view(&lobes, [0.0, 0.0, 1.0], degrees, 0.5));
        assert!(covers(0.3) && !covers(1.5), "{a} x {b}");
    }
}
