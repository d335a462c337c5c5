//! The largest weight of a client: max f L cos / (p I), rule 33 of docs/design.md.

use super::built::{Built, Random};
use super::client::{Client, cross, unit};
use super::lookup::{Map, V3, direction, double, single};
use super::maps::{sky, suns};
use super::points::{materials, view};
use super::prepared::Prepared;
use wis::brdf::material::{Kind, Material, Shape};
use wis::brdf::surface::Surface;
use wis::light::chart::Layout;
use wis::light::plan::Filter;

/// Of any lobe whose narrow half-angle is at least 0.02, at views up to 89 degrees.
pub const LARGEST: f64 = 50.0;

/// Directions of each kind through glass.
const COUNT: u32 = 3000;

/// White, an unclipped sun high and at the horizon, and lamps.
fn maps() -> Vec<(String, Map)> {
    let mut all = vec![(String::from("white"), Map::latlong(256, 128, |_, _| 1.0))];
    all.extend(suns(256, 128).into_iter().step_by(4));
    let lamp = |d: V3, at: V3| (0..3).map(|k| d[k] * at[k]).sum::<f64>() > 0.995;
    let places = [[0.6, 0.0, 0.8], [-0.48, 0.64, 0.6], [0.0, -0.6, 0.8], [0.8, 0.6, 0.0]];
    let lamps = Map::of_directions(Layout::LatLong, 256, 128, |d| {
        0.05 * sky(d) + if places.iter().any(|&at| lamp(d, at)) { 200.0 } else { 0.0 }
    });
    all.push((String::from("lamps"), lamps));
    all
}

/// The largest weight over directions of the light, of the lobes, and of the sphere, and where it is.
pub fn largest(map: &Map, built: &Built, prepared: &Prepared<'_>, client: &Client, count: usize) -> (f64, V3) {
    let of = map.description(Filter::Bilinear);
    let least = built.least();
    let mut random = Random(91);
    let (mut sum, mut samples) = (0.0, 0.0);
    let mut worst = (0.0, [0.0; 3]);
    let weight = |wi: [f32; 3]| {
        let value = client.f_cos(double(wi)) * map.radiance(&of, least, double(wi));
        let pdf = f64::from(prepared.pdf(wi));
        assert!(value == 0.0 || pdf > 0.0, "{wi:?}: f L cos is {value}, the density 0");
        if value > 0.0 { value / pdf } else { 0.0 }
    };
    for i in 0..count {
        let (wi, pdf) = prepared.sample([random.unit(), random.unit()]);
        let w = weight(wi);
        assert!(pdf > 0.0);
        sum += w;
        samples += 1.0;
        let mut look = |wi: [f32; 3]| {
            let w = weight(wi);
            if w > worst.0 {
                worst = (w, double(wi));
            }
        };
        look(wi);
        look(built.sample(&prepared.frame(), [random.unit(), random.unit()]).0);
        // About the mirror direction, ever closer.
        let mirror = client.mirror();
        let near = super::maps::near(mirror, random.direction(), [1.0, 0.3, 0.1, 0.03, 0.01][i % 5]);
        look(single(near));
        look(single(random.direction()));
    }
    (worst.0 * samples / sum, worst.1)
}

#[test]
fn no_weight_is_huge() {
    let mut failures = Vec::new();
    for (map_name, map) in maps() {
        let built = Built::new(&map, &map.description(Filter::Bilinear));
        for (name, material) in materials() {
            for degrees in [0.0, 45.0, 70.0, 80.0, 85.0, 89.0, 89.5] {
                let mut most = (0.0, 0.0);
                for around in [0.3, 1.9, 3.6] {
                    let point = view(&material, [0.1, 0.2, 0.9], degrees, around);
                    let prepared = Prepared::new(&built, &point);
                    let (w, at) = largest(&map, &built, &prepared, &Client::new(&point), 4000);
                    let angle = Client::new(&point).cosine(at).acos().to_degrees();
                    if w > most.0 {
                        most = (w, angle);
                    }
                }
                println!("{map_name:40} {name:20} {degrees:4} : {:8.1} at {:.1} degrees", most.0, most.1);
                if most.0 > LARGEST && degrees <= 89.0 {
                    failures.push(format!("{map_name}, {name}, {degrees} degrees: {:.0}", most.0));
                }
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// The largest weight through a lobe of glass, over directions of the product, of the light, of the lobe, and of the sphere. The integral is
/// that of product and light together, since a product that is wrong does not find its own.
fn through_glass(map: &Map, built: &Built, filter: Filter, shape: Shape, normal: V3, degrees: f64) -> f64 {
    let of = map.description(filter);
    let material = Material::new(&[shape]).unwrap();
    let point = view(&material, normal, degrees, 0.3);
    let prepared = Prepared::new(built, &point);
    let surface = Surface::new(&point, &prepared.frame()).unwrap();
    let mut random = Random(91);
    let (mut sum, mut most) = (0.0, 0.0);
    for _ in 0..COUNT {
        let brings = |wi: [f32; 3]| {
            let value = f64::from(surface.eval::<f32>(surface.to_local(wi)).0);
            value * map.radiance(&of, built.least(), double(wi))
        };
        let mut number = || [random.unit(), random.unit()];
        let drawn = [prepared.sample(number()).0, built.sample(&prepared.frame(), number()).0];
        let both = |wi| f64::from(prepared.pdf(wi)) + f64::from(built.pdf(wi));
        sum += drawn.map(|wi| brings(wi) / both(wi)).iter().sum::<f64>();
        let lobe = surface.to_map(surface.sample::<f32>(number()));
        for wi in [drawn[0], drawn[1], lobe, single(random.direction())].into_iter().filter(|wi| *wi != [0.0; 3]) {
            most = f64::max(most, brings(wi) / f64::from(prepared.pdf(wi)).max(1e-30));
        }
    }
    most * f64::from(COUNT) / sum
}

fn glass(a: f32, b: f32, eta: f32) -> Shape {
    Shape { kind: Kind::GgxTransmission, a, b, eta }
}

/// Through glass beyond the critical angle a sliver at the horizon passes, with weights up to 1,051 while total reflection took the numbers.
#[test]
fn no_weight_through_glass_is_huge() {
    let mut failures = Vec::new();
    for (map_name, map) in maps().into_iter().take(2) {
        let built = Built::new(&map, &map.description(Filter::Bilinear));
        for (a, b) in [(0.05, 0.05), (0.1, 0.1), (0.2, 0.2), (0.05, 0.3)] {
            for degrees in [45.0, 60.0, 80.0, 85.0, 89.0] {
                let shape = glass(a, b, 1.0 / 1.5);
                let weight = through_glass(&map, &built, Filter::Bilinear, shape, [0.1, 0.2, 0.9], degrees);
                println!("{map_name}, {a} x {b}, {degrees} degrees: {weight:.1}");
                if weight > LARGEST {
                    failures.push(format!("{map_name}, {a} x {b}, {degrees} degrees: {weight:.0}"));
                }
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// Refraction bends by a fraction of what reflection does, so that glass of alpha 0.2 is as narrow as a mirror of 0.03. Under a sun behind it
/// weights were up to 950 while the grid took it for as wide as alpha.
#[test]
fn no_weight_of_a_sun_behind_glass_is_huge() {
    let mut failures = Vec::new();
    for (texels, filter) in [(1, Filter::Nearest), (3, Filter::Nearest), (3, Filter::Bilinear)] {
        let mut map = Map::latlong(256, 128, |_, _| 1.0);
        for (i, j) in (0..texels).flat_map(|i| (0..texels).map(move |j| (i, j))) {
            map.texels[(37 + j) * 256 + 90 + i] = 1.4e6;
        }
        let built = Built::new(&map, &map.description(filter));
        let sun =
            direction(Layout::LatLong, 0, [(90.0 + 0.5 * texels as f64) / 256.0, (37.0 + 0.5 * texels as f64) / 128.0]);
        let across = unit(cross(sun, [0.3, -0.8, 0.5]));
        for eta in [1.33, 1.5, 1.0 / 1.5] {
            for (a, b) in [(0.05, 0.05), (0.2, 0.2), (0.4, 0.4), (0.1, 0.4)] {
                for below in [50.0f64, 62.0, 70.0, 80.0] {
                    let (sine, cosine) = below.to_radians().sin_cos();
                    let normal = [0, 1, 2].map(|k| across[k] * cosine - sun[k] * sine);
                    for degrees in [0.0, 40.0] {
                        let weight = through_glass(&map, &built, filter, glass(a, b, eta), normal, degrees);
                        if weight > LARGEST {
                            let what = format!("{texels} texels, {filter:?}, eta {eta}, {a} x {b}, {below} below");
                            failures.push(format!("{what}, {degrees} degrees: {weight:.0}"));
                        }
                    }
                }
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
