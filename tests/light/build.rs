//! Sizes: what fits, what is needed, and the largest maps.

use super::built::{Built, Random};
use super::lookup::{Map, direction, single};
use super::maps::layouts;
use std::cell::RefCell;
use wis::light::chart::Layout;
use wis::light::plan::{Description, Filter, Plan};
use wis::light::strata;
use wis::sphere::Frame;

fn latlong(width: u32, height: u32) -> Description {
    Map { layout: Layout::LatLong, width, height, texels: Vec::new() }.description(Filter::Bilinear)
}

#[test]
fn a_1k_map_takes_3_45_megabytes_besides_strata() {
    let size = |filter, light_only| {
        let plan = Plan::new(&Description { filter, light_only, ..latlong(1024, 512) }).unwrap();
        plan.size().unwrap().bytes - 16 * strata::MOST
    };
    // Of that, the texel map has 1.05 MB.
    assert!(size(Filter::Bilinear, false) <= 3_453_000, "{}", size(Filter::Bilinear, false));
    assert!(size(Filter::Nearest, true) <= 2_253_000, "{}", size(Filter::Nearest, true));
}

/// For rays alone, a map has its texels and strata, and a smooth sky with a budget little of them.
#[test]
fn sizes_for_rays_alone() {
    let of = Description { rays_only: true, ..latlong(1024, 512) };
    let size = Plan::new(&of).unwrap().size().unwrap();
    let texels = 2 * 1025 * 514;
    assert!((texels + 16 * strata::MOST..texels + 16 * strata::MOST + 1024).contains(&size.bytes), "{}", size.bytes);
    let whole = Plan::new(&latlong(1024, 512)).unwrap().size().unwrap();
    assert!(size.scratch < whole.scratch && whole.bytes - size.bytes > 2_300_000, "{whole:?}");
    let sky = Map::new(Layout::LatLong, 256, 128, |_, y| 1.0 + y as f32 / 128.0);
    let built = Built::new(&sky, &Description { rays_only: true, budget: 0.01, ..sky.description(Filter::Bilinear) });
    assert!(built.bytes().len() < 8 << 10, "{}", built.bytes().len());
}

#[test]
fn sizes_without_a_budget_are_exact_but_for_strata() {
    for (layout, width, height) in layouts(32).into_iter().chain([(Layout::LatLong, 1, 1), (Layout::LatLong, 101, 67)])
    {
        let map = Map::new(layout, width, height, |x, y| 1.0 + (x ^ y) as f32);
        for filter in [Filter::Nearest, Filter::Bilinear] {
            let of = map.description(filter);
            let built = Built::new(&map, &of);
            let missing = strata::most(&built.environment().light().chart) - built.environment().light().strata.len();
            assert_eq!(Plan::new(&of).unwrap().size().unwrap().bytes, built.bytes().len() + 16 * missing);
        }
    }
}

#[test]
fn what_is_no_map_has_no_plan() {
    let cube = Description { layout: Layout::Cube, ..latlong(8, 48) };
    assert!(Plan::new(&cube).is_ok());
    let octahedral = Description { layout: Layout::Octahedral, ..latlong(8, 8) };
    assert!(Plan::new(&octahedral).is_ok());
    for of in [
        latlong(0, 4),
        latlong(4, 0),
        latlong(1 << 20, 4),
        Description { height: 47, ..cube },
        Description { height: 9, ..octahedral },
        Description { rows_at_poles: true, ..octahedral },
        Description { budget: -0.1, ..cube },
        Description { budget: f32::NAN, ..cube },
    ] {
        assert!(Plan::new(&of).is_err(), "{of:?}");
    }
}

/// 16384 x 8192 texels, handed over row by row. The rows are made as they are asked for: few distinct ones, which must live as
/// long as the build.
#[test]
fn the_largest_maps_are_built_from_rows() {
    const WIDTH: u32 = 16384;
    const HEIGHT: u32 = 8192;
    let mut random = Random(71);
    let rows: Vec<Vec<f32>> = (0..16).map(|_| (0..WIDTH).map(|_| 0.5 + random.unit()).collect()).collect();
    let asked = RefCell::new(0u64);
    let of = Description { filter: Filter::Nearest, ..latlong(WIDTH, HEIGHT) };
    let built = Built::of_rows(&of, false, 0, |y| {
        *asked.borrow_mut() += 1;
        Some(bytemuck::cast_slice(&rows[y as usize % 16]))
    })
    .unwrap_or_else(|error| panic!("{error:?}"));
    assert_eq!(asked.into_inner(), u64::from(HEIGHT));
    let power = built.environment().header().power;
    for _ in 0..2000 {
        let (wi, pdf) = built.sample(&Frame::IDENTITY, [random.unit(), random.unit()]);
        assert_eq!(pdf.to_bits(), built.pdf(wi).to_bits());
    }
    // In the middle of texels the density is their share of the light.
    for _ in 0..2000 {
        let (x, y) = ((random.bits() % u64::from(WIDTH)) as u32, 1000 + (random.bits() % 6000) as u32);
        let place = [(f64::from(x) + 0.5) / f64::from(WIDTH), (f64::from(y) + 0.5) / f64::from(HEIGHT)];
        let pdf = f64::from(built.pdf(single(direction(Layout::LatLong, 0, place))));
        let expected = f64::from(rows[y as usize % 16][x as usize]) / power;
        assert!((pdf / expected - 1.0).abs() < 0.01, "{x} {y}: {pdf} {expected}");
    }
}
