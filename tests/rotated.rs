//! Rotated maps: their energy, against quadrature of the light's own look-up, and what is added.

use crate::support::sphere::{direction_f64, latlong_direction};
use crate::support::vector::unit;
use crate::support::{self, BuiltTree, Random, tree_config};
use std::f64::consts::PI;
use std::ptr::null;
use wis::ffi::wavelets::tree::*;
use wis::light::batch::pdfs;
use wis::light::environment::Environment;
use wis::simd::Level;
use wis::sphere::{self, Frame};
use wis::status::Status;
use wis::{Block, Filter, Layout, Map};

const LAYOUTS: [Layout; 3] = [Layout::LatLong, Layout::Cube, Layout::Octahedral];
const FILTERS: [Filter; 2] = [Filter::Nearest, Filter::Bilinear];

/// A map of one channel and its light.
struct Light(Vec<Block>);

impl Light {
    fn new(map: &Map<'_>) -> Light {
        let size = map.size().unwrap();
        let mut memory = vec![Block::ZERO; Block::count(size.bytes)];
        map.build_in(&mut memory, &mut vec![Block::ZERO; Block::count(size.scratch)]).unwrap();
        Light(memory)
    }

    /// A map about `height` rows high of a function of the direction.
    fn of(layout: Layout, height: u32, filter: Filter, radiance: impl FnMut([f64; 3]) -> f32) -> Light {
        let [width, rows] = sides(layout, height);
        let texels = texels(layout, height, radiance);
        Light::new(&Map { layout, filter, ..Map::latlong(width, rows, 1, &texels) })
    }

    fn environment(&self) -> Environment<'_> {
        Environment::view(Block::bytes(&self.0)).unwrap()
    }

    fn config(&self, depth: u32, frame: &[f32; 9]) -> TreeConfig {
        let (environment, world_from_tree) = (self.0.as_ptr().cast(), frame.as_ptr());
        TreeConfig { depth, environment, world_from_tree, ..tree_config(WIS_TREE_ENVIRONMENT) }
    }

    fn tree(&self, depth: u32, frame: &[f32; 9]) -> BuiltTree {
        BuiltTree::new(&self.config(depth, frame)).unwrap()
    }

    fn mean(&self) -> f64 {
        self.environment().header().power / (4.0 * PI)
    }
}

/// Columns and rows of a map about `height` rows high.
fn sides(layout: Layout, height: u32) -> [u32; 2] {
    match layout {
        Layout::LatLong => [2 * height, height],
        Layout::Cube => [height, 6 * height],
        Layout::Octahedral => [height, height],
    }
}

/// The texels of such a map of a function of the direction, row by row.
fn texels(layout: Layout, height: u32, mut radiance: impl FnMut([f64; 3]) -> f32) -> Vec<f32> {
    let [width, rows] = sides(layout, height);
    let at = |i: u32, n: u32| (f64::from(i % n) + 0.5) / f64::from(n);
    let direction = |x: u32, y: u32| match layout {
        Layout::LatLong => latlong_direction([at(x, width), at(y, rows)]),
        Layout::Cube => sphere::cube_direction(y / width, 2.0 * at(x, width) - 1.0, 2.0 * at(y, width) - 1.0),
        Layout::Octahedral => direction_f64([at(x, width), at(y, rows)]),
    };
    (0..width * rows).map(|k| radiance(unit(direction(k % width, k / width)))).collect()
}

/// The centres of the pixels of a tree, in C order.
fn centres(depth: u32) -> impl Iterator<Item = [f32; 2]> {
    let side = 1u32 << depth;
    (0..side * side).map(move |k| [k / side, k % side].map(|i| (i as f32 + 0.5) / side as f32))
}

/// The value of a tree at a point.
fn value(tree: &BuiltTree, point: [f32; 2]) -> f64 {
    let mut pdf = 0.0;
    // SAFETY: the tree is alive and the point has two numbers.
    assert_eq!(unsafe { wis_tree_pdf(tree.handle, point.as_ptr(), &mut pdf) }, Status::Ok);
    f64::from(pdf) * tree.info.average
}

const IDENTITY: [f32; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// Row by row: a rotation, mirrored if asked for.
fn random_frame(random: &mut Random, mirrored: bool) -> [f32; 9] {
    let (x, helper) = (support::normalise(random.direction()), support::normalise(random.direction()));
    let cross = |a: [f32; 3], b: [f32; 3]| {
        support::normalise([0, 1, 2].map(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            f64::from(a[j]) * f64::from(b[k]) - f64::from(a[k]) * f64::from(b[j])
        }))
    };
    let y = cross(x, helper);
    let z = cross(x, y).map(|c| if mirrored { -c } else { c });
    [x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]]
}

/// The identity, then rotations, every other one mirrored.
fn frames(count: u64) -> impl Iterator<Item = [f32; 9]> {
    (0..count).map(|k| if k == 0 { IDENTITY } else { random_frame(&mut Random(k), k % 2 == 0) })
}

/// A direction of the tree's frame in the world.
fn to_world(frame: &[f32; 9], local: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| (0..3).map(|j| f64::from(frame[3 * i + j]) * local[j]).sum())
}

/// Rows of a map: texels as wide as pixels, and far smaller ones.
const HEIGHTS: [u32; 2] = [64, 256];
/// Where suns stand: at both poles, at the horizon on the seam of lat-long maps, across an edge of the square, and anywhere.
const SUNS: [[f64; 3]; 5] = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.48, 0.36, -0.8]];

/// The texel of a map that holds a direction shines 65536 times as bright as all others, and no thousandth of its energy is lost, nor
/// given to the sky: wherever it stands, and however the map is rotated.
#[test]
fn a_sun_of_one_texel_keeps_its_energy() {
    for (layout, filter) in LAYOUTS.into_iter().flat_map(|layout| FILTERS.map(|filter| (layout, filter))) {
        for (k, towards) in SUNS.into_iter().enumerate() {
            let height = HEIGHTS[(k + usize::from(filter == Filter::Bilinear)) % 2];
            let mut brightest = (-1.0, [0.0; 3]);
            let mut is_nearer = |d: [f64; 3]| {
                let cosine: f64 = (0..3).map(|k| d[k] * towards[k]).sum();
                if cosine > brightest.0 + 1e-9 {
                    brightest = (cosine, d);
                }
                0.25
            };
            let _ = texels(layout, height, &mut is_nearer);
            let light = Light::of(layout, height, filter, |d| if d == brightest.1 { 16384.0 } else { 0.25 });
            for (depth, frame) in [3, 0, 6, 7].into_iter().zip(frames(4)) {
                let tree = light.tree(depth, &frame);
                let ratio = tree.info.average / light.mean();
                assert!((ratio - 1.0).abs() < 1e-6, "{layout:?} {filter:?} {towards:?} {height} {depth}: {ratio}");
                if depth == 0 {
                    continue;
                }
                // What the sun lost would lift the sky, and what it won would darken it. Two texels about it are not sky.
                let to_tree = Frame::new(&frame).unwrap();
                let local = glam::Vec3::from(to_tree.to_map(brightest.1.map(|x| x as f32)));
                let far = 2.0 * PI / f64::from(height) + 1.5 * 4.0 / f64::from(1u32 << depth);
                let sky: Vec<f64> = centres(depth)
                    .filter(|&at| f64::from(sphere::direction(at).dot(local)) < far.cos())
                    .map(|at| value(&tree, at) / 0.25)
                    .collect();
                let mean = sky.iter().sum::<f64>() / sky.len() as f64;
                assert!((mean - 1.0).abs() < 1e-3, "{layout:?} {filter:?} {towards:?} {height} {depth}: {mean}");
            }
        }
    }
}

/// A constant map stays constant: parts of patches cover the square evenly, those of coarse and of fine maps.
#[test]
fn a_constant_map_stays_constant() {
    for (layout, height) in LAYOUTS.into_iter().flat_map(|layout| [1, 2, 48, 300].map(|height| (layout, height))) {
        let light = Light::of(layout, height, Filter::Bilinear, |_| 3.0);
        for (frame, depth) in frames(3).zip([5, 6, 7]) {
            let tree = light.tree(depth, &frame);
            let errors: Vec<f64> = centres(depth).map(|at| value(&tree, at) / 3.0 - 1.0).collect();
            let worst = errors.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
            let root = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
            assert!(worst < 0.1 && root < 0.01, "{layout:?} {height} {depth}: {worst} {root}");
        }
    }
}

/// Smooth light with a lamp of ten degrees.
fn smooth(d: [f64; 3]) -> f32 {
    let lamp = 0.36 * d[0] + 0.48 * d[1] + 0.8 * d[2];
    (1.0 + 0.5 * d[2] + 0.3 * d[0] + 40.0 * ((lamp - 0.97) / 0.03).clamp(0.0, 1.0)) as f32
}

/// Pixels are the averages of the light over them, by quadrature of what a sampler of the light answers.
#[test]
fn pixels_are_averages_of_the_light() {
    const PLACES: u32 = 24;
    let mut random = Random(5);
    for layout in LAYOUTS {
        for filter in [Filter::Nearest, Filter::Bilinear] {
            let light = Light::of(layout, 64, filter, smooth);
            let environment = light.environment();
            for frame in frames(4) {
                let tree = light.tree(5, &frame);
                for _ in 0..60 {
                    let pixel = [random.f32(), random.f32()].map(|s| (s * 32.0) as u32);
                    let places = (0..PLACES * PLACES).map(|k| {
                        let inside = [k / PLACES, k % PLACES].map(|i| (i as f32 + 0.5) / PLACES as f32);
                        let at = [0, 1].map(|k: usize| (pixel[k] as f32 + inside[k]) / 32.0);
                        to_world(&frame, sphere::direction(at).to_array().map(f64::from)).map(|x| x as f32)
                    });
                    let directions: Vec<[f32; 3]> = places.collect();
                    let mut pdf = vec![0.0; directions.len()];
                    pdfs(Level::detect(), &environment.light(), &environment.frame(), &directions, &mut pdf);
                    let mean = pdf.iter().map(|&p| f64::from(p)).sum::<f64>() / pdf.len() as f64;
                    let expected = mean * environment.header().power;
                    let found = value(&tree, pixel.map(|i| (i as f32 + 0.5) / 32.0));
                    // Where the lamp's edge crosses a pixel, quadrilaterals of half a pixel count whole.
                    let error = (found - expected).abs();
                    assert!(error < 0.02 * expected + 0.2, "{layout:?} {filter:?} {pixel:?}: {found} {expected}");
                }
            }
        }
    }
}

/// What is added is a share of the mean; rotations of map and tree cancel; of a compensated light the tree is that of what is left.
#[test]
fn the_least_and_the_frames() {
    let texels: Vec<f32> = (0..128 * 64).map(|k| if k % 97 == 0 { 40.0 } else { (k % 13) as f32 }).collect();
    let frame = random_frame(&mut Random(7), false);
    let map = Map::latlong(128, 64, 1, &texels);
    let plain = Light::new(&map);
    let both = Light::new(&Map { world_from_map: frame, ..map });
    let (a, b) = (plain.tree(5, &IDENTITY), both.tree(5, &frame));
    for k in 0..1024u32 {
        let at = [k / 32, k % 32].map(|i| (i as f32 + 0.5) / 32.0);
        assert!((value(&a, at) / value(&b, at) - 1.0).abs() < 1e-3, "{k}");
    }
    let compensated = Light::new(&Map { compensated: true, ..map });
    let ratio = compensated.tree(5, &frame).info.average / compensated.mean();
    assert!((ratio - 1.0).abs() < 1e-6 && compensated.mean() < 0.5 * plain.mean(), "{ratio}");
    let more = BuiltTree::new(&TreeConfig { least: 0.5, ..plain.config(5, &frame) }).unwrap();
    assert!((more.info.average / plain.mean() - 1.5).abs() < 1e-6, "{}", more.info.average);
    let black = Light::of(Layout::LatLong, 8, Filter::Bilinear, |_| 0.0);
    let config = TreeConfig { least: 1.0, world_from_tree: null(), ..black.config(5, &frame) };
    assert_eq!(BuiltTree::new(&config).unwrap().info.average, 0.0);
}

/// A budget leaves texels out; energy stays.
#[test]
fn budgets_keep_energy() {
    let texels: Vec<f32> = (0..512 * 256).map(|k| if k == 36000 { 1e6 } else { 1.0 + (k / 512) as f32 }).collect();
    let light = Light::new(&Map { error_budget: 0.05, ..Map::latlong(512, 256, 1, &texels) });
    let exact = Light::new(&Map::latlong(512, 256, 1, &texels));
    for (frame, depth) in frames(3).zip([3, 5, 6]) {
        let [tree, expected] = [&light, &exact].map(|light| light.tree(depth, &frame));
        let ratio = tree.info.average / light.mean();
        assert!((ratio - 1.0).abs() < 1e-6, "{ratio}");
        // What coarse patches have is where it was: parts of the sky differ by little more than the budget.
        let off = |at| (value(&tree, at) / value(&expected, at) - 1.0).powi(2);
        let root = (centres(depth).map(off).sum::<f64>() / f64::from(1u32 << (2 * depth))).sqrt();
        assert!(root < 0.07, "{depth}: {root}");
    }
}

/// Every platform builds these bytes.
#[test]
fn the_bytes_on_record() {
    let texels: Vec<f32> = (0..48 * 24).map(|k| if k == 500 { 3e4 } else { ((7 * k) % 31) as f32 }).collect();
    let frame = random_frame(&mut Random(19), true);
    let ids = FILTERS.map(|filter| {
        let light = Light::new(&Map { filter, ..Map::latlong(48, 24, 1, &texels) });
        light.tree(5, &frame).info.content_id
    });
    assert_eq!(ids.map(|id| format!("{id:016x}")), ["5ae35358106d904b", "c03812cc96aaceeb"]);
}
