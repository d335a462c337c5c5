//! Wherever the client's filter finds light, the density is above 0: at every corner, edge and half-texel shift of lit texels.

use super::built::{Built, Random};
use super::lookup::{Map, V3, double, faces, single};
use super::maps::{descriptions, layouts};
use wis::light::chart::Layout;
use wis::light::plan::{Description, Filter};
use wis::sphere::Frame;

/// One texel in black: in the middle, at edges and at corners of a face; every other texel; two rows at the horizon.
fn maps(layout: Layout, width: u32, height: u32) -> Vec<Map> {
    let side = height / faces(layout);
    let face = faces(layout) / 2;
    let lit =
        [(side / 2, side / 3), (0, side / 2), (width - 1, 1), (3, 0), (5, side - 1), (0, 0), (width - 1, side - 1)];
    let mut all: Vec<Map> = lit
        .iter()
        .map(|&at| Map::new(layout, width, height, |x, y| if (x, y) == (at.0, face * side + at.1) { 7.0 } else { 0.0 }))
        .collect();
    all.push(Map::new(layout, width, height, |x, y| if (x + y) % 2 == 0 { 1.0 } else { 0.0 }));
    all.push(Map::new(layout, width, height, |x, y| {
        if (y % side == side / 2 || y % side == side / 2 - 1) && x % 4 != 3 { 1.0 + x as f32 } else { 0.0 }
    }));
    all
}

fn test(map: &Map, of: &Description) {
    let built = Built::new(map, of);
    let side = map.height / faces(map.layout);
    let mut random = Random(31);
    let lit = (0..map.height).flat_map(|y| (0..map.width).map(move |x| (x, y)));
    for (x, y) in lit.filter(|&(x, y)| map.texels[(y * map.width + x) as usize] > 0.0) {
        for at in map.around(y / side, x, y % side) {
            // The direction itself, and what rounding may make of it.
            for shift in [0.0, 1e-7, 1e-6] {
                let offset = random.direction();
                let wi = single(super::maps::near(at, offset, shift));
                let (radiance, pdf) = (map.radiance(of, 0.0, double(wi)), built.pdf(wi));
                assert!(pdf.is_finite());
                let reached = pdf > 0.0 || (of.exact_zero && radiance == 0.0);
                assert!(reached, "{of:?} texel {x} {y}, {wi:?}, radiance {radiance}");
            }
        }
    }
}

#[test]
fn everything_lit_has_a_density() {
    for (layout, width, height) in layouts(32) {
        for map in maps(layout, width, height) {
            for of in descriptions(&map) {
                for exact_zero in [false, true] {
                    for budget in [0.0, 0.05] {
                        test(&map, &Description { exact_zero, budget, ..of });
                    }
                }
            }
        }
    }
}

#[test]
fn everything_lit_in_small_maps_has_a_density() {
    for (layout, width, height) in
        [(Layout::LatLong, 5, 3), (Layout::LatLong, 1, 2), (Layout::Cube, 3, 18), (Layout::Octahedral, 5, 5)]
    {
        for y in 0..height {
            for x in 0..width {
                let map = Map::new(layout, width, height, |i, j| if (i, j) == (x, y) { 1.0 } else { 0.0 });
                for of in descriptions(&map) {
                    test(&map, &Description { exact_zero: true, ..of });
                }
            }
        }
    }
}

/// Also where u leads to the very corners of patches, some of which are black.
#[test]
fn every_sample_has_a_density() {
    let ends = [0.0, 1.0 / 16_777_216.0, 0.5, 1.0 - f32::EPSILON / 2.0];
    let mut random = Random(34);
    for (layout, width, height) in layouts(32) {
        for map in maps(layout, width, height) {
            for of in descriptions(&map) {
                let built = Built::new(&map, &Description { exact_zero: true, ..of });
                for i in 0..400 {
                    let u = if i < 16 { [ends[i % 4], ends[i / 4]] } else { [random.unit(), random.unit()] };
                    let (wi, pdf) = built.sample(&Frame::IDENTITY, u);
                    assert!(pdf > 0.0 && pdf.is_finite(), "{of:?} {u:?}: {wi:?} {pdf}");
                    assert_eq!(pdf.to_bits(), built.pdf(wi).to_bits());
                }
            }
        }
    }
}

#[test]
fn exact_zero_keeps_black_black() {
    for (layout, width, height) in layouts(32) {
        let map = maps(layout, width, height).swap_remove(0);
        for of in descriptions(&map) {
            let built = Built::new(&map, &Description { exact_zero: true, ..of });
            let mut random = Random(33);
            let black = (0..1000).filter(|_| built.pdf(single(random.direction())) == 0.0).count();
            assert!(black > 900, "{of:?}: {black}");
        }
    }
}

/// What is black is never returned, at the ends of u and of the tables' words, too: only the texel, or the patches around its centre, is lit.
#[test]
fn black_beside_light_is_never_returned() {
    let ends = [0.0, 1.0 / 16_777_216.0, 0.5, 1.0 - f32::EPSILON, 1.0 - f32::EPSILON / 2.0];
    let mut random = Random(35);
    for (layout, width, height) in layouts(16) {
        for at in (0..width * height).step_by(7) {
            let lit = (at % width, at / width);
            let map = Map::new(layout, width, height, |x, y| if (x, y) == lit { 7.0 } else { 0.0 });
            for of in descriptions(&map) {
                let of = Description { exact_zero: true, ..of };
                let built = Built::new(&map, &of);
                for i in 0..2000 {
                    let u = if i < 25 { [ends[i % 5], ends[i / 5]] } else { [random.unit(), random.unit()] };
                    let wi = double(built.sample(&Frame::IDENTITY, u).0);
                    let mut lit_at = |wi: V3| map.radiance(&of, 0.0, wi) > 0.0;
                    // A sample of a bilinear light may lie on the border of its patch, where the client finds 0.
                    let beside = |_| super::maps::near(wi, random.direction(), 1e-5);
                    let bilinear = of.filter == Filter::Bilinear;
                    let found = lit_at(wi) || bilinear && (0..2000).map(beside).any(&mut lit_at);
                    assert!(found, "{of:?} {lit:?}: {u:?} led to {wi:?}");
                }
                // Nor has it a density, but where rounding may find the light.
                for _ in 0..500 {
                    let wi = random.direction();
                    let pdf = built.pdf(single(wi));
                    assert_eq!(
                        pdf > 0.0,
                        map.radiance(&of, 0.0, double(single(wi))) > 0.0,
                        "{of:?} {lit:?}: {wi:?} has {pdf}"
                    );
                }
            }
        }
    }
}
