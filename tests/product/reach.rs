//! The density is above 0 wherever the client's radiance x BRDF x cosine is.

use super::built::{Built, Random};
use super::client::{Client, cross, unit};
use super::lookup::{Map, V3, single};
use super::maps::{layouts, sky};
use super::points::{materials, view};
use super::prepared::Prepared;
use wis::brdf::material::{Kind, Material};
use wis::light::chart::Layout;
use wis::light::plan::{Description, Filter};
use wis::product::prepare::Config;

fn maps() -> Vec<Map> {
    let mut all = Vec::new();
    for (x, y) in [(0, 0), (63, 31), (20, 15), (40, 8)] {
        all.push(Map::latlong(64, 32, |i, j| if (i, j) == (x, y) { 7.0 } else { 0.0 }));
    }
    all.push(Map::latlong(64, 32, |x, y| if (x + y) % 2 == 0 { 1.0 } else { 0.0 }));
    all.push(Map::latlong(64, 32, |x, y| if (y == 15 || y == 16) && x % 4 != 3 { 1.0 + x as f32 } else { 0.0 }));
    all.extend(layouts(32).map(|(layout, width, height)| Map::of_directions(layout, width, height, sky)));
    all
}

/// Directions about lit texels, close to the horizon of a normal, and all over the sphere.
fn directions(map: &Map, normal: V3, random: &mut Random) -> Vec<V3> {
    let mut all = Vec::new();
    let side = map.height / super::lookup::faces(map.layout);
    let lit = (0..map.width * map.height).filter(|&i| map.texels[i as usize] > 0.0);
    for i in lit.step_by(13) {
        let (x, y) = (i % map.width, i / map.width);
        all.extend(map.around(y / side, x, y % side));
    }
    let t = unit(cross(normal, [0.3, -0.7, 0.2]));
    let b = cross(normal, t);
    for _ in 0..2000 {
        let (y, x) = (6.3 * random.f64()).sin_cos();
        let up = 1e-3 * random.f64();
        all.push(unit([0, 1, 2].map(|k| x * t[k] + y * b[k] + up * normal[k])));
        all.push(random.direction());
    }
    all
}

#[test]
fn the_density_is_positive_where_the_client_reflects() {
    let mut random = Random(71);
    for map in maps() {
        for exact_zero in [false, true] {
            for filter in [Filter::Bilinear, Filter::Nearest] {
                let of = Description { exact_zero, ..map.description(filter) };
                let built = Built::new(&map, &of);
                for (name, material) in materials() {
                    let point = view(&material, random.direction(), 70.0 * random.f64(), random.f64());
                    let client = Client::new(&point);
                    let prepared = Prepared::new(&built, &point);
                    for wi in directions(&map, client.normal(), &mut random) {
                        // A client that rounds to the other side of a border finds light that is not there.
                        let lit = map.radiance(&of, built.least(), wi) > 1e-5 && built.pdf(single(wi)) > 0.0;
                        let reflects = client.cosine(wi) > 1e-7 && client.f_cos(wi) > 0.0;
                        assert!(!lit || !reflects || prepared.pdf(single(wi)) > 0.0, "{:?} {name} {wi:?}", map.layout);
                    }
                }
            }
        }
    }
}

/// How far normals of hits that a product serves may lie from its own.
fn reach(material: &Material) -> f64 {
    let widths = material.lobes().iter().map(|shape| match shape.kind {
        Kind::Phong => 0.5 * (2.0f64).powf(-1.0 / (f64::from(shape.a) + 1.0)).acos(),
        Kind::Ggx => f64::from(shape.a.min(shape.b)),
        _ => 1.0,
    });
    widths.fold(0.2, f64::min) / 2.0
}

/// Every normal of the cone sees a density above 0; a product without the cone does not serve them. One with it serves those that lie within
/// 0.1 and within half of the narrowest lobe's width.
#[test]
fn normals_within_the_cone_are_served() {
    const CONE: f64 = 0.3;
    let mut random = Random(73);
    let map = Map::of_directions(Layout::LatLong, 64, 32, sky);
    let of = map.description(Filter::Bilinear);
    let built = Built::new(&map, &of);
    let mut unserved = 0;
    for (name, material) in materials() {
        let point = view(&material, random.direction(), 50.0, random.f64());
        let served = Prepared::with(&built, &point, &Config { cone: CONE as f32, ..Config::default() });
        let narrow = Prepared::new(&built, &point);
        for _ in 0..20 {
            let n = Client::new(&point).normal();
            let t = unit(cross(n, random.direction()));
            let (sine, cosine) = (CONE * 0.999).sin_cos();
            let mut tilted = point;
            tilted.normal = single(unit([0, 1, 2].map(|k| cosine * n[k] + sine * t[k])));
            assert!(!served.product().header.covers(&tilted), "{name}");
            let (sine, cosine) = (0.999 * reach(&material)).sin_cos();
            let mut near = point;
            near.normal = single(unit([0, 1, 2].map(|k| cosine * n[k] + sine * t[k])));
            assert!(served.product().header.covers(&near), "{name}");
            assert!(!narrow.product().header.covers(&near), "{name}");
            let client = Client::new(&tilted);
            for wi in directions(&map, client.normal(), &mut random) {
                if client.cosine(wi) > 1e-6 {
                    assert!(served.pdf(single(wi)) > 0.0, "{name} {wi:?}");
                    unserved += usize::from(narrow.pdf(single(wi)) == 0.0);
                }
            }
        }
    }
    assert!(unserved > 0, "the cone is not needed: this test finds no fault");
}
