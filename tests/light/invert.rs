//! invert leads back, or says that nothing does.

use super::built::{Built, Random};
use super::lookup::{Map, double, single};
use super::maps::{descriptions, layouts, rough, suns};
use wis::light::batch::Density;
use wis::light::chart::Layout;
use wis::light::density::Inverted;
use wis::light::plan::Filter;
use wis::sphere::Frame;

fn distance(a: [f32; 3], b: [f32; 3]) -> f64 {
    let (a, b) = (double(a), double(b));
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// Inverts samples and arbitrary directions; answers how many could not be reached, of how many. What can be is led back to
/// within `near`.
fn test(built: &Built, near: f64) -> (usize, usize) {
    let environment = built.environment();
    let light = environment.light();
    let mut random = Random(41);
    let (mut unreachable, mut all) = (0, 0);
    for i in 0..4000 {
        let frame = if i % 4 == 0 { Frame::IDENTITY } else { random.frame() };
        let sampled = i % 2 == 0;
        let wi =
            if sampled { built.sample(&frame, [random.unit(), random.unit()]).0 } else { single(random.direction()) };
        match light.invert(&frame, wi) {
            Inverted::To(u) => {
                assert!(u.iter().all(|u| (0.0..1.0).contains(u)));
                let back = built.sample(&frame, u).0;
                assert!(distance(back, wi) <= near, "{:?}: {wi:?} {u:?} {back:?}", environment.description());
            }
            Inverted::Unreachable => {
                assert!(!sampled, "{:?}: {wi:?} was sampled", environment.description());
                unreachable += 1;
            }
            Inverted::Zero => assert_eq!(light.pdf::<f32>(&frame, wi), 0.0),
        }
        all += 1;
    }
    (unreachable, all)
}

#[test]
fn it_leads_back() {
    for (layout, width, height) in layouts(64) {
        let map = Map::of_directions(layout, width, height, rough);
        for of in descriptions(&map) {
            let (unreachable, _) = test(&Built::new(&map, &of), 3e-5);
            assert_eq!(unreachable, 0, "{of:?}");
        }
    }
}

/// Directions on the borders of patches, as a client meets them that loops over rows and columns.
#[test]
fn borders_lead_back() {
    for (layout, width, height) in layouts(16) {
        let map = Map::of_directions(layout, width, height, rough);
        for of in descriptions(&map) {
            let built = Built::new(&map, &of);
            let light = built.environment();
            let light = light.light();
            for i in 0..64 * 64 {
                let (polar, azimuth) = (f64::from(1 + i / 64) / 66.0, f64::from(i % 64) / 64.0);
                let ((sine, cosine), (y, x)) =
                    ((polar * std::f64::consts::PI).sin_cos(), (azimuth * std::f64::consts::TAU).sin_cos());
                let wi = single([sine * x, sine * y, cosine]);
                let Inverted::To(u) = light.invert(&Frame::IDENTITY, wi) else {
                    panic!("{of:?}: {wi:?} cannot be reached");
                };
                let back = built.sample(&Frame::IDENTITY, u).0;
                assert!(distance(back, wi) <= 1e-3, "{of:?}: {wi:?} {u:?} {back:?}");
            }
        }
    }
}

/// Beside an unclipped sun dark patches have small shares of u; what is led back to is the same patch.
#[test]
fn under_suns_it_leads_back_to_the_patch_or_not_at_all() {
    for (name, map) in suns(128, 64) {
        for of in descriptions(&map) {
            let patch = 2.0f64.sqrt() * std::f64::consts::PI / 64.0;
            let (unreachable, all) = test(&Built::new(&map, &of), patch);
            assert!(10 * unreachable <= all, "{name} {of:?}: {unreachable} of {all} cannot be reached");
        }
    }
}

/// Cells whose share of u is below 2^-24 are told apart from black ones.
#[test]
fn shares_below_the_resolution_of_u_are_unreachable() {
    let map = Map::new(Layout::LatLong, 16, 32, |x, y| if (x, y) == (5, 11) { 1e4 } else { 1e-6 });
    for filter in [Filter::Nearest, Filter::Bilinear] {
        let built = Built::new(&map, &map.description(filter));
        let (unreachable, all) = test(&built, 0.6);
        println!("{filter:?}: {unreachable} of {all}");
        assert!(unreachable > 0 && unreachable <= all / 2);
        // All that cannot be reached together has so small a share of the light.
        let light = built.environment().light();
        let mut random = Random(42);
        let directions = (0..20_000).map(|_| single(random.direction()));
        let shares = directions.map(|wi| match light.invert(&Frame::IDENTITY, wi) {
            Inverted::Unreachable => f64::from(built.pdf(wi)) * 4.0 * std::f64::consts::PI / 20_000.0,
            _ => 0.0,
        });
        let share: f64 = shares.sum();
        println!("{share:e}");
        assert!(share < 1e-4, "{share:e}");
    }
}
