//! The look-ups of renderers against lights that are built as docs/integrating.md says.

use super::built::Built;
use super::lookup::{Map, V3, direction};
use super::maps::rough;
use std::f64::consts::{PI, TAU};
use wis::light::chart::Layout;
use wis::light::compare::{Cause, compare};
use wis::light::plan::{Description, Filter};
use wis::sphere::Frame;

/// Where a renderer looks a map up: column over width and row over height, or for the square of pbrt-v4 both coordinates.
type LookUp = fn(V3) -> [f64; 2];

struct Convention {
    renderer: &'static str,
    layout: Layout,
    filter: Filter,
    rows_at_poles: bool,
    look_up: LookUp,
    world_from_map: [f32; 9],
}

const LATLONG: Convention = Convention {
    renderer: "pbrt-v3",
    layout: Layout::LatLong,
    filter: Filter::Bilinear,
    rows_at_poles: false,
    look_up: |[x, y, z]| [y.atan2(x) / TAU, z.acos() / PI],
    world_from_map: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
};

const CONVENTIONS: [Convention; 6] = [
    LATLONG,
    Convention {
        renderer: "pbrt-v4",
        layout: Layout::Octahedral,
        filter: Filter::Nearest,
        look_up: equal_area_square,
        ..LATLONG
    },
    Convention {
        renderer: "Mitsuba 3",
        rows_at_poles: true,
        look_up: |[x, y, z]| [x.atan2(-z) / TAU, y.acos() / PI],
        world_from_map: [0.0, 1.0, 0.0, 0.0, 0.0, 1.0, -1.0, 0.0, 0.0],
        ..LATLONG
    },
    Convention {
        renderer: "Cycles",
        look_up: |[x, y, z]| [0.5 - y.atan2(x) / TAU, z.acos() / PI],
        world_from_map: [-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        ..LATLONG
    },
    Convention {
        renderer: "Tungsten",
        look_up: |[x, y, z]| [0.5 + z.atan2(x) / TAU, y.acos() / PI],
        world_from_map: [-1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0],
        ..LATLONG
    },
    Convention {
        renderer: "y up, -z in the middle of the map, +x right of it (Arnold, Maya)",
        look_up: |[x, y, z]| [0.5 + x.atan2(-z) / TAU, y.acos() / PI],
        world_from_map: [0.0, -1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0],
        ..LATLONG
    },
];

/// The equal-area mapping as pbrt-v4's book has it (Clarberg 2008): angles in place of the folding by cases of the kernel.
fn equal_area_square([x, y, z]: V3) -> [f64; 2] {
    let radius = (1.0 - z.abs()).max(0.0).sqrt();
    let angle = y.abs().atan2(x.abs()) / (0.5 * PI);
    let (mut u, mut v) = (radius * (1.0 - angle), radius * angle);
    if z < 0.0 {
        (u, v) = (1.0 - v, 1.0 - u);
    }
    [0.5 + 0.5 * u.copysign(x), 0.5 + 0.5 * v.copysign(y)]
}

#[test]
fn lights_are_what_renderers_see() {
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/integrating.md")).expect("the page");
    for of in CONVENTIONS {
        let (width, height) = if of.layout == Layout::LatLong { (128, 64) } else { (64, 64) };
        let map = Map::of_directions(of.layout, width, height, rough);
        let description = Description { rows_at_poles: of.rows_at_poles, ..map.description(of.filter) };
        let frame = Frame::new(&of.world_from_map).expect("a matrix of the page");
        let built = Built::new(&map, &description).turned(&frame);
        let mut radiance = |wi: &[[f32; 3]], rgb: &mut [[f32; 3]]| {
            for (out, wi) in rgb.iter_mut().zip(wi) {
                let [u, v] = (of.look_up)(wi.map(|x| f64::from(x).clamp(-1.0, 1.0)));
                let place = [u.rem_euclid(1.0), v];
                *out = [map.radiance(&description, 0.0, direction(of.layout, 0, place)) as f32; 3];
            }
            true
        };
        let found = compare(&built.environment(), &mut radiance).expect("finite");
        assert_eq!(found.cause, Cause::None, "{}: {found:?}", of.renderer);
        assert!(found.error < 0.005, "{}: {found:?}", of.renderer);

        let row = |row: &[f32]| row.iter().map(f32::to_string).collect::<Vec<_>>().join(" ");
        let matrix = of.world_from_map.chunks(3).map(row).collect::<Vec<_>>().join(", ");
        let line =
            page.lines().find(|line| line.starts_with(&format!("| {} |", of.renderer))).expect("a row of the page");
        assert!(line.ends_with(&format!("| {matrix} |")), "{line}: {matrix}");
        assert_eq!(line.contains("rows at the poles"), of.rows_at_poles);
        assert_eq!(line.contains("octahedral, nearest"), of.layout == Layout::Octahedral);
    }
}
