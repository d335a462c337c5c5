//! Maps and points at their limits: what can be drawn is drawn, and everything stays a number.

use super::built::{Built, Random};
use super::lookup::{Map, single};
use super::maps::{layouts, rough, sky};
use super::points::{materials, view};
use super::prepared::Prepared;
use wis::brdf::material::{Kind, Material, Shape};
use wis::brdf::point::Point;
use wis::direct::Ray;
use wis::direct::sampler::{self as direct, Sampler};
use wis::light::chart::Layout;
use wis::light::plan::{Description, Filter};
use wis::product::prepare::{Config, Task};
use wis::product::stored::most_bytes;
use wis::simd::Level;
use wis::status::Status;

/// Draws and queries; answers how many samples have a density.
fn exercise(prepared: &Prepared<'_>) -> usize {
    let mut random = Random(51);
    let mut drawn = 0;
    for _ in 0..300 {
        let (wi, pdf) = prepared.sample([random.unit(), random.unit()]);
        assert!(wi.iter().all(|x| x.is_finite()) && pdf >= 0.0 && pdf.is_finite(), "{wi:?} {pdf}");
        assert_eq!(pdf.to_bits(), prepared.pdf(wi).to_bits());
        drawn += usize::from(pdf > 0.0);
        let other = prepared.pdf(single(random.direction()));
        assert!(other >= 0.0 && other.is_finite());
    }
    let header = *prepared.product().header;
    assert!(header.integral >= 0.0 && header.integral.is_finite());
    let environment = prepared.built.environment();
    let rgb = prepared.shaded().colour(environment.colours());
    let luminance: f64 = rgb.iter().zip([0.2126, 0.7152, 0.0722]).map(|(c, w)| f64::from(*c) * w).sum();
    let integral = header.integral.min(f64::from(f32::MAX));
    assert!((luminance - integral).abs() <= 1e-3 * integral, "{rgb:?} {integral}");
    drawn
}

#[test]
fn a_black_map_has_no_samples() {
    for (layout, width, height) in layouts(16) {
        let map = Map::of_directions(layout, width, height, |_| 0.0);
        for exact_zero in [false, true] {
            let of = Description { exact_zero, ..map.description(Filter::Bilinear) };
            let built = Built::new(&map, &of);
            for (name, material) in materials() {
                let prepared = Prepared::new(&built, &view(&material, [0.0, 0.6, 0.8], 40.0, 1.0));
                assert_eq!(exercise(&prepared), 0, "{name}");
                assert_eq!(prepared.product().header.integral, 0.0);
            }
        }
    }
}

#[test]
fn maps_of_any_size() {
    for (width, height) in [(1, 1), (1, 7), (7, 1), (5, 3), (33, 17)] {
        let map = Map::latlong(width, height, |x, y| 1.0 + (x + y) as f32);
        let built = Built::new(&map, &map.description(Filter::Bilinear));
        for (_, material) in materials() {
            assert_eq!(exercise(&Prepared::new(&built, &view(&material, [0.0, 0.6, 0.8], 40.0, 1.0))), 300);
        }
    }
}

/// Light below the horizon only: nothing can be drawn, or, where black is not exact, what the floor leaves.
#[test]
fn light_below_the_horizon() {
    let map = Map::latlong(64, 32, |_, y| if y > 24 { 1.0 } else { 0.0 });
    for (exact_zero, expected) in [(true, 0), (false, 300)] {
        let built = Built::new(&map, &Description { exact_zero, ..map.description(Filter::Bilinear) });
        let (lambert, glossy) = (&materials()[0].1, &materials()[4].1);
        for material in [lambert, glossy] {
            let prepared = Prepared::new(&built, &view(material, [0.0, 0.0, 1.0], 40.0, 1.0));
            assert_eq!(exercise(&prepared), expected);
        }
    }
}

#[test]
fn points_without_lobes_or_light() {
    let map = Map::of_directions(Layout::LatLong, 64, 32, rough);
    let built = Built::new(&map, &map.description(Filter::Bilinear));
    let none = Material::NONE;
    assert_eq!(exercise(&Prepared::new(&built, &Point::new(&none, [0.0, 0.0, 1.0], [0.0, 0.6, 0.8]))), 300);
    // Black, huge, and seen from below: still the light of the hemisphere.
    for (_, material) in materials() {
        for (weight, wo) in
            [(0.0, [0.0, 0.6, 0.8]), (f32::MAX, [0.0, 0.6, 0.8]), (1e-38, [0.0, 0.6, 0.8]), (1.0, [0.0, 0.6, -0.8])]
        {
            let mut point = view(&material, [0.0, 0.0, 1.0], 40.0, 1.0);
            (point.weight, point.wo) = ([[weight; 3]; 4], wo);
            assert_eq!(exercise(&Prepared::new(&built, &point)), 300, "{weight} {wo:?}");
        }
    }
}

#[test]
fn both_sides_of_a_surface() {
    let map = Map::of_directions(Layout::LatLong, 64, 32, sky);
    let built = Built::new(&map, &map.description(Filter::Bilinear));
    let through = |kind, a: f32| Shape { kind, a, b: a, eta: 1.5 };
    for shapes in [
        vec![Shape::LAMBERT],
        vec![through(Kind::LambertTransmission, 1.0)],
        vec![through(Kind::GgxTransmission, 0.3)],
        vec![through(Kind::GgxTransmission, 0.05), Shape::ggx(0.05, 0.05)],
        vec![Shape { eta: 0.6, ..through(Kind::GgxTransmission, 0.1) }],
    ] {
        let material = Material::new(&shapes).unwrap();
        let mut point = view(&material, [0.0, 0.6, 0.8], 70.0, 1.0);
        point.f0 = [[0.04; 3]; 4];
        point.whole_sphere = true;
        let prepared = Prepared::new(&built, &point);
        assert_eq!(exercise(&prepared), 300);
        let mut random = Random(53);
        for _ in 0..1000 {
            assert!(prepared.pdf(single(random.direction())) > 0.0, "{shapes:?}");
        }
    }
}

#[test]
fn scaling_the_map_scales_integrals_only() {
    let scaled = |k: i32| Map::of_directions(Layout::LatLong, 64, 32, |d| rough(d) * 2f64.powi(k));
    let built = |map: &Map| Built::new(map, &map.description(Filter::Bilinear));
    let (one, other) = (built(&scaled(0)), built(&scaled(20)));
    for (_, material) in materials() {
        let point = view(&material, [0.0, 0.6, 0.8], 40.0, 1.0);
        let (a, b) = (Prepared::new(&one, &point), Prepared::new(&other, &point));
        let (a, b) = (*a.product().header, *b.product().header);
        assert_eq!((a.integral * 2f64.powi(20)).to_bits(), b.integral.to_bits());
        assert_eq!(a.scale.to_bits(), b.scale.to_bits());
        let mut random = Random(55);
        let (a, b) = (Prepared::new(&one, &point), Prepared::new(&other, &point));
        for _ in 0..100 {
            let u = [random.unit(), random.unit()];
            let ((p, f), (q, g)) = (a.sample(u), b.sample(u));
            assert_eq!((p.map(f32::to_bits), f.to_bits()), (q.map(f32::to_bits), g.to_bits()));
        }
    }
}

#[test]
fn products_are_small() {
    assert!(most_bytes(Config::default().divided) <= 4096);
    for (layout, width, height) in layouts(32) {
        let map = Map::of_directions(layout, width, height, rough);
        let built = Built::new(&map, &map.description(Filter::Bilinear));
        for (name, material) in materials() {
            let point = view(&material, [0.0, 0.6, 0.8], 40.0, 1.0);
            for divided in [0, 3, 8, 24] {
                let prepared = Prepared::with(&built, &point, &Config { divided, ..Config::default() });
                let bytes = prepared.bytes().len();
                assert!(bytes <= most_bytes(divided) && bytes % 16 == 0, "{layout:?} {name}: {bytes}");
            }
        }
    }
}

/// A light that was built without what products need says so, and rays that would share one are picks among candidates.
#[test]
fn a_light_alone_has_no_products() {
    let map = Map::of_directions(Layout::LatLong, 64, 32, sky);
    let with = Built::new(&map, &map.description(Filter::Bilinear));
    let alone = Built::new(&map, &Description { light_only: true, ..map.description(Filter::Bilinear) });
    let saved = with.bytes().len() - alone.bytes().len();
    assert!((20_000..22_000).contains(&saved), "{saved}");
    let (_, material) = &materials()[0];
    let point = view(material, [0.0, 0.6, 0.8], 40.0, 1.0);
    let mut memory = vec![0u64; most_bytes(8).div_ceil(8)];
    let bytes = bytemuck::cast_slice_mut(&mut memory);
    let (level, environment) = (Level::BASELINE, &alone.environment());
    let task = Task { level, environment, point: &point, config: &Config::default() };
    assert_eq!(task.prepare(None, bytes), Err(Status::NotBuilt.into()));
    let rays = |built: &Built, hits_per_pixel| {
        let config = direct::Config { rays: 4, candidates_per_ray: 0, hits_per_pixel, reserved: 0 };
        let mut memory = vec![0u64; config.bytes().div_ceil(8)];
        let mut sampler = Sampler::new(Level::BASELINE, config, bytemuck::cast_slice_mut(&mut memory)).unwrap();
        let mut rays = [Ray::default(); 4];
        let count = sampler.direct(&built.environment(), &point, direct::Sequence::default(), 4, &mut rays);
        (count, rays.map(|ray| ray.wi.map(f32::to_bits)))
    };
    assert_eq!(rays(&alone, 64), rays(&alone, 0));
    assert_ne!(rays(&with, 64), rays(&with, 0));
}
