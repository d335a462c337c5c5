//! Maps that are hard: black, infinite, tiny, huge; and scaling by powers of two.

use super::built::{Built, Random};
use super::lookup::{Map, single};
use super::maps::{layouts, rough, suns};
use wis::light::batch::Density;
use wis::light::chart::Layout;
use wis::light::density::Inverted;
use wis::light::plan::{Description, Filter};
use wis::sphere::Frame;
use wis::status::{Error, Status};

const FILTERS: [Filter; 2] = [Filter::Nearest, Filter::Bilinear];

/// Samples and pdfs are finite; those of a lit map are above 0.
fn use_light(built: &Built, lit: bool) {
    let environment = built.environment();
    let light = environment.light();
    let mut random = Random(51);
    for _ in 0..500 {
        let (wi, pdf) = built.sample(&Frame::IDENTITY, [random.unit(), random.unit()]);
        assert!(wi.iter().all(|x| x.is_finite()) && pdf.is_finite(), "{wi:?} {pdf}");
        assert_eq!(pdf > 0.0, lit);
        let wi = single(random.direction());
        let pdf = light.pdf::<f32>(&Frame::IDENTITY, wi);
        assert!(pdf.is_finite() && pdf >= 0.0 && (lit || pdf == 0.0), "{wi:?} {pdf}");
        let inverted = light.invert(&Frame::IDENTITY, wi);
        assert_eq!(inverted == Inverted::Zero, pdf == 0.0);
    }
}

#[test]
fn black_has_no_density() {
    for (layout, width, height) in layouts(32) {
        for black in [0.0, -0.0] {
            let map = Map::new(layout, width, height, |_, _| black);
            for filter in FILTERS {
                for budget in [0.0, 0.1] {
                    let built = Built::new(&map, &Description { budget, ..map.description(filter) });
                    assert_eq!(built.environment().header().power, 0.0);
                    use_light(&built, false);
                }
            }
        }
    }
}

#[test]
fn tiny_and_huge_luminances_make_a_light() {
    for (layout, width, height) in layouts(32) {
        for filter in FILTERS {
            for scale in [1e-40f32, 1e-37, 1e30, 1e37] {
                let map = Map::of_directions(layout, width, height, |d| rough(d) * f64::from(scale));
                for budget in [0.0, 0.05] {
                    let built = Built::new(&map, &Description { budget, ..map.description(filter) });
                    use_light(&built, true);
                }
            }
            // A single texel of 1e30 in a sky of 1.
            let mut map = Map::of_directions(layout, width, height, |_| 1.0);
            map.texels[(width * 3 + 7) as usize] = 1e30;
            use_light(&Built::new(&map, &map.description(filter)), true);
            // And the largest one everywhere.
            let map = Map::new(layout, width, height, |_, _| f32::MAX);
            use_light(&Built::new(&map, &map.description(filter)), true);
        }
    }
}

/// What is left of a denormal texel, at a pole or under compensation, may round to 0, and with it the density where light is.
#[test]
fn denormals_keep_their_density() {
    let edges = [0.0, 0.5 * f32::EPSILON, 0.25, 0.5, 0.75, 1.0 - 0.5 * f32::EPSILON];
    for texels in [[1.1754944e-38f32, 9.8e-45], [9.8e-45, 1.4e-45], [1.4e-45, 0.0], [1e-40, 0.0]] {
        for (layout, width, height) in
            [(Layout::LatLong, 1, 2), (Layout::LatLong, 3, 2), (Layout::Cube, 2, 12), (Layout::Octahedral, 2, 2)]
        {
            let map = Map::new(layout, width, height, |_, y| texels[y as usize % 2]);
            for (filter, compensated) in FILTERS.into_iter().flat_map(|filter| [(filter, false), (filter, true)]) {
                let built = Built::new(&map, &Description { compensated, ..map.description(filter) });
                use_light(&built, true);
                for u in edges.into_iter().flat_map(|u| edges.map(|v| [u, v])) {
                    assert!(
                        built.sample(&Frame::IDENTITY, u).1 > 0.0,
                        "{texels:?} {width} x {height} {filter:?} {compensated} {u:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn invalid_texels_are_rejected_or_replaced() {
    for (bad, replaced) in [(f32::NAN, 0.0), (f32::NEG_INFINITY, 0.0), (f32::INFINITY, 65504.0)] {
        let clean = Map::latlong(64, 32, |x, y| if (x, y) == (9, 3) { 5.0 } else { 1.0 });
        let mut map = clean.clone();
        map.texels[20 * 64 + 40] = bad;
        let mut mended = clean;
        mended.texels[20 * 64 + 40] = replaced;
        for filter in FILTERS {
            let of = map.description(filter);
            match Built::over(&map, &of, false, 0) {
                Err(error) => assert_eq!(error, Error::new(Status::InvalidTexel, 1).at(40, 20).of(c"pixels")),
                Ok(_) => panic!("{bad} was not rejected"),
            }
            let (built, other) = (Built::over(&map, &of, true, 0).unwrap(), Built::new(&mended, &of));
            assert_eq!(built.environment().header().sanitised, 1);
            assert_eq!(built.environment().header().power, other.environment().header().power);
            let wi = single([0.6, 0.0, 0.8]);
            assert_eq!(built.pdf(wi), other.pdf(wi));
        }
    }
    let infinite = Map::latlong(64, 32, |_, _| f32::INFINITY);
    let built = Built::over(&infinite, &infinite.description(Filter::Bilinear), true, 0).unwrap();
    assert_eq!(built.environment().header().sanitised, 64 * 32);
    use_light(&built, true);
}

#[test]
fn powers_of_two_change_no_bit() {
    let mut maps: Vec<Map> = layouts(32).map(|(l, w, h)| Map::of_directions(l, w, h, rough)).into();
    maps.extend(suns(64, 32).into_iter().map(|(_, map)| map));
    for map in maps {
        for filter in FILTERS {
            for budget in [0.0, 0.05] {
                let of = Description { budget, ..map.description(filter) };
                let built = Built::new(&map, &of);
                for k in [-60, 7, 90] {
                    let scale = 2f32.powi(k);
                    let scaled = Map { texels: map.texels.iter().map(|t| t * scale).collect(), ..map.clone() };
                    let other = Built::new(&scaled, &of);
                    let header = |built: &Built| *built.environment().header();
                    assert_eq!(header(&other).power, header(&built).power * f64::from(scale));
                    let mut random = Random(53);
                    for _ in 0..300 {
                        let u = [random.unit(), random.unit()];
                        let (a, b) = (built.sample(&Frame::IDENTITY, u), other.sample(&Frame::IDENTITY, u));
                        assert_eq!(a.0.map(f32::to_bits), b.0.map(f32::to_bits));
                        assert_eq!(a.1.to_bits(), b.1.to_bits());
                        let wi = single(random.direction());
                        assert_eq!(built.pdf(wi).to_bits(), other.pdf(wi).to_bits());
                    }
                }
            }
        }
    }
}
