//! Portals (rule 42): uniform in their solid angle, unbiased wherever light comes from, and what holds for rectangles that are none.

use super::client::{self, Client};
use super::light::{Light, TURNED, Thread, first_hit, mean_of};
use super::maps;
use crate::support::Map;
use crate::support::maps::{Filter, sky};
use crate::support::statistics::{LARGEST_MISSED, Mean, chi_square, chi_square_smallest_fault, corrected};
use crate::support::vector::{V3, add, cross, dot, rotate_back, scale, single, unit};
use wis::brdf::material::{Kind, Shape};
use wis::brdf::point::{Point, Target};
use wis::brdf::portal::Portal;
use wis::direct::Ray;
use wis::direct::group::Group;
use wis::direct::portals::Portals;
use wis::direct::sampler::{Config, Sequence};
use wis::simd::{GROUP, Level};
use wis::sphere::Frame;
use wis::status::Error;

/// Comparisons of all tests of this file, at most.
const TESTS: usize = 150;

const GGX: Shape = Shape { kind: Kind::Ggx, a: 0.3, b: 0.3, eta: 1.0 };

/// A rectangle of a plane at a distance along an axis, between two ends of each of its coordinates.
#[derive(Clone, Copy)]
struct Window {
    axis: V3,
    distance: f64,
    x: [f64; 2],
    y: [f64; 2],
}

impl Window {
    /// Along x, along y and to the plane.
    fn axes(&self) -> [V3; 3] {
        let z = unit(self.axis);
        let x = unit(cross(z, [0.6, -0.64, 0.48]));
        [x, cross(z, x), z]
    }

    fn portal(&self) -> Portal {
        let [x, y, z] = self.axes();
        let corner = add(scale(z, self.distance), add(scale(x, self.x[0]), scale(y, self.y[0])));
        let edges = [scale(y, self.y[1] - self.y[0]), scale(x, self.x[1] - self.x[0])];
        Portal { corner: single(corner), edges: edges.map(single) }
    }

    /// Where a direction goes through its plane; `None` behind.
    fn at(&self, wi: V3) -> Option<[f64; 2]> {
        let [x, y, z] = self.axes().map(|axis| dot(axis, wi));
        (z > 0.0).then(|| [x * self.distance / z, y * self.distance / z])
    }

    fn shows(&self, wi: V3) -> bool {
        let inside = |v: f64, [low, high]: [f64; 2]| (low..=high).contains(&v);
        self.at(wi).is_some_and(|[x, y]| inside(x, self.x) && inside(y, self.y))
    }

    /// The solid angle of a part of the plane (Van Oosterom and Strackee's is another formula than the library's).
    fn solid_angle(&self, x: [f64; 2], y: [f64; 2]) -> f64 {
        let corner = |x: f64, y: f64| unit([x, y, self.distance]);
        let triangle = |a: V3, b: V3, c: V3| 2.0 * dot(a, cross(b, c)).atan2(1.0 + dot(a, b) + dot(b, c) + dot(c, a));
        let [a, b, c, d] = [corner(x[0], y[0]), corner(x[1], y[0]), corner(x[1], y[1]), corner(x[0], y[1])];
        triangle(a, b, c) + triangle(a, c, d)
    }
}

/// A window before the point of [`Client`], and one that shows other light.
fn windows() -> [Window; 2] {
    let client = Client::new(&[], client::lambert);
    let across = cross(client.normal, client.tangent);
    let first = add(client.normal, scale(client.tangent, 0.4));
    let second = add(scale(client.normal, 0.7), scale(across, -0.8));
    [
        Window { axis: first, distance: 2.0, x: [-0.9, 1.1], y: [-0.4, 1.2] },
        Window { axis: second, distance: 3.0, x: [-1.0, -0.2], y: [0.0, 1.0] },
    ]
}

fn prepared(portals: &[Portal]) -> Portals {
    let client = Client::new(&[], client::lambert);
    Portals::new(&Point { portals, ..client.point() }, &Frame::IDENTITY).unwrap()
}

/// What [`Portals`] draws for sample `t`.
fn drawn<const N: usize>(portals: &Portals, t: u32) -> Vec<V3> {
    let mut groups = vec![Group::default(); N / GROUP];
    portals.enter(Sequence { seed: 5, sample: t, bounce: 0 }, &mut groups);
    groups.iter().flat_map(|group| (0..GROUP).map(|i| group.direction.map(|column| f64::from(column[i])))).collect()
}

/// Windows before the eyes, to the side, seen at a grazing angle, far away, and one that the point stands in.
#[test]
fn directions_are_uniform_in_the_solid_angle() {
    const PARTS: usize = 6;
    const CALLS: u32 = 20_000;
    let of = |distance: f64, x: [f64; 2], y: [f64; 2]| Window { axis: [0.3, -0.5, 0.7], distance, x, y };
    let cases = [
        of(1.0, [-1.0, 1.0], [-1.0, 1.0]),
        of(1.0, [0.0, 2.0], [-3.0, 0.0]),
        of(1.0, [1.0, 5.0], [2.0, 3.0]),
        of(0.05, [1.0, 2.0], [-1.0, 1.0]),
        of(1e-4, [-1.0, 2.0], [-3.0, 1.0]),
        of(1000.0, [-1.0, 1.0], [3.0, 4.0]),
        of(1000.0, [500.0, 501.0], [700.0, 700.5]),
        of(1.0, [-1e7, 1e7], [-1e7, 1e7]),
    ];
    for window in cases {
        let portals = prepared(&[window.portal()]);
        let (total, far) = (window.solid_angle(window.x, window.y), 1e6 * window.distance);
        let middle = window.axes()[2];
        let one = |wi: V3| f64::from(portals.density::<f32>(single(wi)));
        let inside = add(
            scale(middle, window.distance),
            window
                .axes()
                .iter()
                .take(2)
                .zip([window.x, window.y])
                .fold([0.0; 3], |sum, (axis, ends)| add(sum, scale(*axis, 0.5 * (ends[0] + ends[1])))),
        );
        assert!((one(unit(inside)) * total - 1.0).abs() < 1e-5, "{} {total}", one(unit(inside)));
        assert_eq!(one(scale(middle, -1.0)), 0.0);
        // Borders at equal steps of the angle.
        let borders = |[low, high]: [f64; 2]| -> Vec<f64> {
            let [low, high] = [low, high].map(|v| (v.clamp(-far, far) / window.distance).atan());
            (0..=PARTS).map(|i| (low + (high - low) * i as f64 / PARTS as f64).tan() * window.distance).collect()
        };
        let (columns, rows) = (borders(window.x), borders(window.y));
        let part = |i: usize, j: usize| window.solid_angle([columns[i], columns[i + 1]], [rows[j], rows[j + 1]]);
        let count = f64::from(CALLS) * 16.0;
        let expected: Vec<f64> = (0..PARTS * PARTS).map(|k| part(k % PARTS, k / PARTS) / total * count).collect();
        let mut observed = vec![0u64; PARTS * PARTS];
        let mut outside = 0u32;
        for wi in (0..CALLS).flat_map(|t| drawn::<16>(&portals, t)) {
            assert!((dot(wi, wi) - 1.0).abs() < 1e-5, "{wi:?}");
            outside += u32::from(one(wi) == 0.0);
            let [x, y] = window.at(wi).unwrap();
            let bin = |v: f64, borders: &[f64]| borders[1..PARTS].iter().filter(|border| **border < v).count();
            observed[bin(x, &columns) + PARTS * bin(y, &rows)] += 1;
        }
        // What rounding carries over an edge.
        assert!(f64::from(outside) < 1e-3 * count, "{outside} outside");
        let chi = chi_square(&observed, &expected);
        let fault = chi_square_smallest_fault(chi.degrees, count, corrected(TESTS));
        println!("{total:.3e} sr: p {:.1e}, finds {fault:.4}, {outside} outside", chi.p_value);
        assert!(chi.p_value > corrected(TESTS), "{:?} {:?}: p {:.1e}", window.x, window.y, chi.p_value);
        assert!(fault < LARGEST_MISSED);
    }
}

/// Each of two portals is drawn by its solid angle; where they lie one over the other, their densities add up.
#[test]
fn overlapping_portals_add_up() {
    let whole = Window { axis: [0.0, 0.0, 1.0], distance: 1.0, x: [-1.0, 1.0], y: [-1.0, 1.0] };
    let half = Window { distance: 1.0, x: [0.0, 1.0], ..whole };
    let portals = prepared(&[whole.portal(), Portal::default(), half.portal()]);
    let total = whole.solid_angle(whole.x, whole.y) + half.solid_angle(half.x, half.y);
    let [x, y, _] = whole.axes();
    let at = |u: f64| single(unit(add([0.0, 0.0, 1.0], add(scale(x, u), scale(y, 0.2)))));
    for (u, times) in [(-0.5, 1.0), (0.5, 2.0), (1.5, 0.0)] {
        let density = f64::from(portals.density::<f32>(at(u)));
        assert!((density * total - times).abs() < 1e-5, "{density}");
    }
    let calls = 4000;
    let right = (0..calls).flat_map(|t| drawn::<16>(&portals, t)).filter(|&wi| half.shows(wi)).count();
    let share = right as f64 / f64::from(16 * calls);
    assert!((share - 2.0 / 3.0).abs() < 2e-3, "{share}");
}

/// What a ray adds to the estimate.
fn brings(client: &Client, map: &Map, ray: &Ray) -> f64 {
    let wi = ray.wi.map(f64::from);
    assert!(ray.weight > 0.0 && ray.weight < f32::INFINITY && (dot(wi, wi) - 1.0).abs() < 1e-5, "{ray:?}");
    f64::from(ray.weight) * client.response(wi) * map.radiance(Filter::Bilinear, rotate_back(&TURNED, wi))[0]
}

/// Compares means of calls for 1, 4 and 16 rays with the integral.
fn check(name: &str, client: &Client, portals: &[Portal], change: fn(Point<'_>) -> Point<'_>) {
    check_under(&maps(), name, client, portals, change);
}

fn check_under(
    maps: &[(&str, Map)],
    name: &str,
    client: &Client,
    portals: &[Portal],
    change: fn(Point<'_>) -> Point<'_>,
) {
    for (light, map) in maps {
        let (integral, error) = client.integral(map, Filter::Bilinear, 16);
        assert!(error < 5e-3 * integral, "{name}, {light}: {integral} is good to {error} only");
        let built = Light::of(map);
        for rays in [1, 4, 16] {
            let mut thread = Thread::new(16);
            let significance = corrected(TESTS);
            let mean = mean_of(significance, |seed| {
                let point = change(Point { portals, ..client.point() });
                let drawn = thread.direct(&built.environment(), &point, first_hit(seed), rays);
                drawn.iter().map(|ray| brings(client, map, ray)).sum()
            });
            let (p, fault) = (mean.p_value(integral, error), mean.smallest_fault(significance));
            let what = format!("{name}, {light}, {rays} rays: {} instead of {integral}, p {p:.1e}", mean.mean);
            println!("{what}, finds {:.2} % with {} calls", 100.0 * fault, mean.count);
            assert!(p > significance, "{what}");
            assert!(fault < LARGEST_MISSED, "{what}: would find {fault} only");
        }
    }
}

fn both() -> [Portal; 2] {
    windows().map(|window| window.portal())
}

fn through(wi: V3) -> f64 {
    f64::from(u8::from(windows().iter().any(|window| window.shows(wi))))
}

/// A third of the light comes from where no portal is.
fn partly(wi: V3) -> f64 {
    if through(wi) > 0.0 { if wi[0] > 0.2 { 1.0 } else { 0.5 } } else { 0.3 }
}

#[test]
fn light_from_elsewhere_is_not_lost() {
    let diffuse = Client { factor: partly, ..Client::new(&[Shape::LAMBERT], client::lambert) };
    check("portals and a wall", &diffuse, &both(), |point| point);
    check("GGX", &Client { factor: partly, ..Client::new(&[GGX], client::ggx_03) }, &both(), |point| point);
    // From where the library expects the most, nothing comes.
    let elsewhere = Client { factor: |wi| 1.0 - through(wi), ..diffuse };
    check_under(&maps()[..1], "only elsewhere", &elsewhere, &both()[..1], |point| point);
}

fn complete(point: Point<'_>) -> Point<'_> {
    Point { portals_complete: true, ..point }
}

#[test]
fn complete_portals_bring_all_of_a_room() {
    let client = Client { factor: through, ..Client::new(&[Shape::LAMBERT, GGX], client::mixture) };
    check("complete", &client, &both(), complete);
    // One over the other.
    let [first, second] = both();
    check("twice", &client, &[first, second, first], complete);
}

/// The client's own BRDF and a clamped share of candidates: nothing but the variance may change.
#[test]
fn targets_and_numbers_of_candidates() {
    #[derive(Debug)]
    struct Half;
    impl Target for Half {
        fn f_cos(&self, wi: &[[f32; 3]], out: &mut [f32]) -> bool {
            out.iter_mut().zip(wi).for_each(|(out, wi)| *out = if wi[0] > 0.0 { 1.0 } else { 0.5 });
            true
        }
    }
    let client = Client { factor: through, ..Client::new(&[Shape::LAMBERT, GGX], client::mixture) };
    check("target", &client, &both(), |point| Point { target: Some(&Half), ..complete(point) });
}

/// Rule 41 in a room: rays bring what exceeds the mean, BSDF rays that leave through a window the rest.
#[test]
fn compensated() {
    let client = Client { factor: through, ..Client::new(&[Shape::LAMBERT], client::lambert) };
    for (light, map) in maps() {
        let built = Light::of(&map);
        let (environment, portals) = (built.environment(), both());
        let above = |wi: V3| {
            let radiance = map.radiance(Filter::Bilinear, rotate_back(&TURNED, wi)).map(|l| l as f32);
            1.0 - f64::from(environment.base(radiance))
        };
        let mut thread = Thread::new(64);
        // Rays without portals tell the integral: many for each, since few of them find the windows.
        let mean = |thread: &mut Thread, portals: &[Portal], rays: usize| {
            mean_of(corrected(TESTS), |seed| {
                let point = Point { compensated: true, portals, portals_complete: true, ..client.point() };
                let rays = thread.direct(&environment, &point, first_hit(seed), rays);
                rays.iter().map(|ray| brings(&client, &map, ray) * above(ray.wi.map(f64::from))).sum()
            })
        };
        let [with, without] = [(&portals[..], 1), (&[], 64)].map(|(portals, rays)| mean(&mut thread, portals, rays));
        let p = with.p_value(without.mean, without.standard_error());
        println!("{light}: {} with portals, {} without, p {p:.1e}", with.mean, without.mean);
        assert!(p > corrected(TESTS));
    }
}

/// The room of the report: a window of 20 x 15 degrees, no sun. The goal is 0.2 for four rays.
#[test]
fn a_window_is_found() {
    let (map, client) = (sky(64, 32), Client::new(&[Shape::LAMBERT], client::lambert));
    let half = |degrees: f64| (0.5 * degrees).to_radians().tan();
    let window =
        Window { axis: windows()[0].axis, distance: 1.0, x: [-half(20.0), half(20.0)], y: [-half(15.0), half(15.0)] };
    let (built, portals) = (Light::of(&map), [window.portal()]);
    let deviation = |portals: &[Portal], portals_complete: bool| {
        let (mut thread, mut mean) = (Thread::new(4), Mean::default());
        for seed in 0..10_000 {
            let point = Point { portals, portals_complete, ..client.point() };
            let rays = thread.direct(&built.environment(), &point, first_hit(seed), 4);
            let seen = rays.iter().filter(|ray| window.shows(ray.wi.map(f64::from)));
            mean.add(seen.map(|ray| brings(&client, &map, ray)).sum());
        }
        mean.standard_error() * mean.count.sqrt() / mean.mean
    };
    let [without, guided, complete] =
        [(&portals[..0], false), (&portals[..], false), (&portals[..], true)].map(|(p, c)| deviation(p, c));
    println!("deviations {without:.2} without, {guided:.3} guided, {complete:.4} complete");
    assert!(without > 2.0 && guided < 0.2 && complete < 0.05, "{without} {guided} {complete}");
}

/// An eighth of the rays looks outside the portals, and none if they are complete.
#[test]
fn few_rays_leave_the_portals() {
    let (client, built) = (Client::new(&[Shape::LAMBERT], client::lambert), Light::of(&sky(64, 32)));
    let portals = [windows()[1].portal()];
    for (portals_complete, share) in [(false, 1.0 / 8.0), (true, 0.0)] {
        let (mut thread, mut outside) = (Thread::new(1), Mean::default());
        for seed in 0..40_000 {
            let point = Point { portals: &portals, portals_complete, ..client.point() };
            let rays = thread.direct(&built.environment(), &point, first_hit(seed), 1);
            assert_eq!(rays.len(), 1);
            outside.add(f64::from(u8::from(!windows()[1].shows(rays[0].wi.map(f64::from)))));
        }
        // Every candidate has a little, wherever it lies.
        assert!((outside.mean - share).abs() < if portals_complete { 1e-3 } else { 0.04 }, "{}", outside.mean);
    }
}

fn bits(rays: &[Ray]) -> Vec<[u32; 4]> {
    rays.iter().map(|Ray { wi: [x, y, z], weight }| [*x, *y, *z, *weight].map(f32::to_bits)).collect()
}

/// Seen from behind, from its plane, without an area or smaller than directions are fine: left out.
#[test]
fn portals_that_are_not_seen() {
    let (client, built) = (Client::new(&[Shape::LAMBERT], client::lambert), Light::of(&sky(64, 32)));
    let window = windows()[0];
    let portal = window.portal();
    let behind = Portal { edges: [portal.edges[1], portal.edges[0]], ..portal };
    let on_plane = Portal { corner: [-0.5, -0.5, 0.0], edges: [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]] };
    let line = Portal { edges: [portal.edges[0], [0.0; 3]], ..portal };
    let tiny = Window { x: [0.0, 1e-5], y: [0.0, 1e-5], ..window }.portal();
    let left_out = [behind, on_plane, line, tiny, Portal::default()];
    let mut thread = Thread::new(4);
    for (seed, portals) in (0..100).flat_map(|seed| [(seed, &left_out[..]), (seed, &left_out[4..])]) {
        let mut rays = |portals: &[Portal], portals_complete: bool| {
            let point = Point { portals, portals_complete, ..client.point() };
            bits(&thread.direct(&built.environment(), &point, first_hit(seed), 4))
        };
        let [none, some, flag] = [rays(&[], false), rays(portals, false), rays(&[], true)];
        assert!(none == some && none == flag, "as without portals");
        assert!(rays(portals, true).is_empty());
        // Beside one that is seen they change nothing.
        let beside = [behind, portal, line];
        assert_eq!(rays(&beside, true), rays(&[portal], true));
    }
}

/// Not finite, or no right angle.
#[test]
fn portals_that_are_none() {
    let (client, built) = (Client::new(&[Shape::LAMBERT], client::lambert), Light::of(&sky(64, 32)));
    let portal = windows()[0].portal();
    let faults = (0..9).flat_map(|k| [f32::NAN, f32::INFINITY, f32::NEG_INFINITY].map(|value| (k, value)));
    let mut bad: Vec<Portal> = faults
        .map(|(k, value)| {
            let mut numbers: [f32; 9] = bytemuck::cast(portal);
            numbers[k] = value;
            bytemuck::cast(numbers)
        })
        .collect();
    let [a, b] = portal.edges;
    let slanted = [0, 1, 2].map(|k| b[k] + 0.01 * a[k]);
    bad.push(Portal { edges: [a, slanted], ..portal });
    let config = Config { rays: 1, candidates_per_ray: 0, hits_per_pixel: 0, reserved: 0 };
    let mut memory = vec![0u64; config.bytes().div_ceil(8)];
    let bytes = bytemuck::cast_slice_mut(&mut memory);
    let mut sampler = wis::Sampler::new(Level::detect(), config, bytes).unwrap();
    for bad in bad {
        let point = Point { portals: &[portal, bad], ..client.point() };
        for rays in [0, 1] {
            let answer = sampler.direct(&built.environment(), &point, first_hit(0), rays, &mut [Ray::default()]);
            assert_eq!(answer, Err(Error::range(c"portals").in_row(1)), "{bad:?}");
        }
    }
}

/// Random rectangles, huge, tiny and near, at every level the same bits; rays are sound.
#[test]
fn every_level_has_the_same_bits() {
    let built = Light::of(&maps()[1].1);
    let mut random = crate::support::Random(17);
    let shapes: [&[Shape]; 3] = [&[Shape::LAMBERT], &[GGX], &[Shape::LAMBERT, Shape::ggx(0.05, 0.05)]];
    for seed in 0..3000 {
        let client = Client::new(shapes[seed as usize % 3], client::lambert);
        let mut portals = [Portal::default(); 8];
        for portal in &mut portals {
            let mut scaled = |least: f64, most: f64| least * (most / least).powf(random.f64());
            let (distance, width, height) = (scaled(1e-6, 1e3), scaled(1e-4, 1e4), scaled(1e-4, 1e4));
            let (axis, x, y) = (random.direction(), random.f64() * 3.0 - 2.0, random.f64() * 3.0 - 2.0);
            let ends = |from: f64, length: f64| [from * length, (from + 1.0) * length];
            *portal = Window { axis, distance, x: ends(x, width), y: ends(y, height) }.portal();
        }
        let portals = &portals[..1 + seed as usize % 8];
        let portals_complete = seed % 3 == 0;
        let rays = [Level::BASELINE, Level::detect()].map(|level| {
            let config = Config { rays: 16, candidates_per_ray: 0, hits_per_pixel: 0, reserved: 0 };
            let point = Point { portals, portals_complete, compensated: seed % 5 == 0, ..client.point() };
            Thread::with(level, config).direct(&built.environment(), &point, first_hit(seed), 1 + seed as usize % 16)
        });
        assert_eq!(bits(&rays[0]), bits(&rays[1]), "{seed}");
        for Ray { wi, weight } in &rays[0] {
            assert!(*weight > 0.0 && weight.is_finite(), "{seed}: {weight}");
            assert!((dot(wi.map(f64::from), wi.map(f64::from)) - 1.0).abs() < 1e-5, "{seed}: {wi:?}");
        }
    }
}
