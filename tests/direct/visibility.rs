//! The visibility cache: no pixel reads its own rays, nothing depends on threads, means stay right, and rays into shadows become
//! rare (rule 27).

use super::client::{self, Client};
use super::light::{Light, TURNED, Thread};
use super::maps;
use crate::support::Map;
use crate::support::maps::Filter;
use crate::support::statistics::{Mean, corrected};
use crate::support::vector::{V3, rotate_back, single};
use std::sync::atomic::Ordering;
use wis::brdf::material::Shape;
use wis::brdf::point::Point;
use wis::direct::Ray;
use wis::direct::sampler::Sequence;
use wis::visibility::{CELLS, Counts, Factors, HALVES, UNKNOWN, VisibilityCache, end_pass, key};

/// The memory of a cache.
struct Memory {
    counts: Vec<Counts>,
    factors: Vec<Factors>,
}

impl Memory {
    fn new(places: usize) -> Memory {
        let counts =
            (0..HALVES * places).map(|_| [const { [const { std::sync::atomic::AtomicU32::new(0) }; 2] }; CELLS]);
        Memory { counts: counts.collect(), factors: vec![UNKNOWN; HALVES * places] }
    }

    fn cache(&self) -> VisibilityCache<'_> {
        VisibilityCache { counts: &self.counts, factors: &self.factors }
    }

    fn end_pass(&mut self) {
        end_pass(&self.counts, &mut self.factors);
    }

    fn traced(&self) -> u32 {
        self.counts.iter().flatten().map(|cell| cell[0].load(Ordering::Relaxed)).sum()
    }
}

const UP: [f32; 3] = [0.0, 0.0, 1.0];

/// Two pixels of different halves.
fn two_halves(cache: &VisibilityCache<'_>) -> [u32; 2] {
    let at = |seed| cache.factors(1, seed).unwrap().as_ptr();
    [0, (1..).find(|&seed| at(seed) != at(0)).unwrap()]
}

#[test]
fn a_pixel_reads_what_the_other_half_saw() {
    let mut memory = Memory::new(1);
    let [a, b] = two_halves(&memory.cache());
    for _ in 0..1000 {
        memory.cache().record(1, a, UP.into(), false);
    }
    assert_eq!(memory.cache().factors(1, b), Some(&UNKNOWN), "not before the end of a pass");
    memory.end_pass();
    assert_eq!(memory.cache().factors(1, a), Some(&UNKNOWN));
    let seen = memory.cache().factors(1, b).unwrap();
    // A tenth is the least, for cells without rays too: all that is known of the place is dark.
    assert_eq!(seen, &[26; CELLS]);
    assert_eq!(memory.traced(), 1000);
}

#[test]
fn factors_are_roots_of_shares() {
    let mut memory = Memory::new(1);
    let [a, b] = two_halves(&memory.cache());
    let directions = [UP, [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]];
    for (quarter, direction) in directions.into_iter().enumerate() {
        for k in 0..40_000 {
            memory.cache().record(1, a, direction.into(), k % 4 < quarter);
        }
    }
    memory.end_pass();
    let mut found: Vec<u8> = memory.cache().factors(1, b).unwrap().to_vec();
    found.sort_unstable();
    found.dedup();
    // Shares of 0 (the least), 1/4, the mean 3/8 in all other cells, 1/2 and 3/4.
    let root = |share: f32| (255.0 * share.sqrt()).round() as u8;
    assert_eq!(found, [26, root(0.25), root(0.375), root(0.5), root(0.75)]);
}

#[test]
fn key_0_is_no_place() {
    let mut memory = Memory::new(4);
    memory.cache().record(0, 1, UP.into(), false);
    memory.end_pass();
    assert_eq!((memory.traced(), memory.cache().factors(0, 1)), (0, None));
    assert!(memory.cache().factors(1, 1).is_some());
}

#[test]
fn keys_tell_cells_and_sides_apart() {
    let here = key([0.3, 0.3, 0.3], UP, 1.0);
    assert_eq!(here, key([0.9, 0.1, 0.6], [0.1, -0.5, 0.8], 1.0));
    for (position, normal) in
        [([1.3, 0.3, 0.3], UP), ([0.3, 0.3, -0.3], UP), ([0.3; 3], [0.0, 0.0, -1.0]), ([0.3; 3], [1.0, 0.0, 0.0])]
    {
        assert_ne!(here, key(position, normal, 1.0));
    }
    for strange in [[f32::NAN; 3], [f32::INFINITY; 3], [-3e38; 3]] {
        for width in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-38] {
            assert_ne!(key(strange, strange, width), 0);
        }
    }
}

/// Counts are sums: the order and the threads that counted change nothing.
#[test]
fn threads_do_not_matter() {
    let rays: Vec<(u32, [f32; 3], bool)> =
        (0..4000u32).map(|k| (k % 17, single(TURNED_DIRECTIONS[k as usize % 3]), k % 5 == 0)).collect();
    let count = |cache: VisibilityCache<'_>, rays: &[(u32, [f32; 3], bool)]| {
        rays.iter().for_each(|&(seed, wi, reached)| cache.record(seed + 1, seed, wi.into(), reached));
    };
    let (mut one, mut many) = (Memory::new(8), Memory::new(8));
    count(one.cache(), &rays);
    std::thread::scope(|scope| {
        for part in rays.rchunks(rays.len() / 4) {
            let cache = many.cache();
            scope.spawn(move || count(cache, part));
        }
    });
    one.end_pass();
    many.end_pass();
    assert_eq!(one.factors, many.factors);
}

/// Where little was seen a ray may come from wherever the library expects next to nothing: the least weight is higher. Candidates of a
/// diffuse point are as many, and a factor that is the same for all changes no share: the least weight alone does; without it the rays would be the same.
#[test]
fn rays_in_the_dark_are_more_even() {
    const DARK: Factors = [26; CELLS];
    let client = Client::new(&[Shape::LAMBERT], client::lambert);
    let mut thread = Thread::new(1);
    for (name, map) in maps() {
        let light = Light::of(&map);
        let [seen, dark] = [&UNKNOWN, &DARK].map(|factors| {
            let point = Point { seen: Some(factors), ..client.point() };
            let rays = (0..4000).flat_map(|seed| {
                thread.direct(&light.environment(), &point, Sequence { seed, sample: 0, bounce: 0 }, 1).to_vec()
            });
            let expected = |ray: &Ray| {
                let wi = ray.wi.map(f64::from);
                client.response(wi) * map.radiance(Filter::Bilinear, rotate_back(&TURNED, wi))[0]
            };
            let expected: Vec<f64> = rays.map(|ray| expected(&ray)).collect();
            let mean = expected.iter().sum::<f64>() / expected.len() as f64;
            expected.iter().filter(|&&bright| bright < 0.1 * mean).count()
        });
        println!("{name}: {seen} and {dark} of 4000");
        assert!(dark > seen + seen / 20, "{name}: {dark} in place of {seen}");
    }
}

const TURNED_DIRECTIONS: [V3; 3] = [[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]];

/// A window, through which about a third of the light comes; the sun shines on its frame.
fn seen(wi: V3) -> f64 {
    if wi[0] + 0.4 * wi[1] > 0.55 || wi[2] < 0.1 || wi[1] < 0.2 { 0.0 } else { 1.0 }
}

const PIXELS: u32 = 16;
const PASSES: u32 = 8;

/// What a group of pixels of one place estimates in each pass, one ray for each pixel; `None` without a cache.
struct Group<'a> {
    client: &'a Client,
    map: &'a Map,
    light: &'a Light,
    /// Each pass has seeds of its own.
    fresh: bool,
    learns: bool,
}

impl Group<'_> {
    fn passes(&self, number: u32, thread: &mut Thread) -> Vec<f64> {
        let mut memory = Memory::new(1);
        (0..PASSES)
            .map(|pass| {
                let sum: f64 = (0..PIXELS)
                    .map(|pixel| {
                        let own = PIXELS * number + pixel;
                        let (seed, sample) = if self.fresh { (own * PASSES + pass, 0) } else { (own, pass) };
                        let cache = memory.cache();
                        let factors = if self.learns { cache.factors(1, seed) } else { None };
                        let point = Point { seen: factors, ..self.client.point() };
                        let at = Sequence { seed, sample, bounce: 0 };
                        let rays = thread.direct(&self.light.environment(), &point, at, 1);
                        let brings = rays.iter().map(|ray| {
                            let wi = ray.wi.map(f64::from);
                            cache.record(1, seed, ray.wi.into(), seen(wi) > 0.0);
                            let radiance = self.map.radiance(Filter::Bilinear, rotate_back(&TURNED, wi))[0];
                            f64::from(ray.weight) * self.client.response(wi) * radiance
                        });
                        brings.sum::<f64>()
                    })
                    .sum();
                memory.end_pass();
                sum / f64::from(PIXELS)
            })
            .collect()
    }
}

/// The mean of all passes is the integral, with seeds of each pass as with one seed for all; each test finds a fault of 2 %.
/// Single passes have less variance once the place is known.
#[test]
fn learnt_visibility_is_unbiased_and_better() {
    let client = Client { factor: seen, ..Client::new(&[Shape::LAMBERT], client::lambert) };
    for (name, map) in maps() {
        let light = Light::of(&map);
        let (integral, error) = client.integral(&map, Filter::Bilinear, 12);
        let mut variances = Vec::new();
        for (fresh, learns) in [(true, false), (true, true), (false, true)] {
            let group = Group { client: &client, map: &map, light: &light, fresh, learns };
            let mut thread = Thread::new(1);
            let (mut all, mut last) = (Mean::default(), Mean::default());
            for number in 0..8_000 {
                let passes = group.passes(number, &mut thread);
                all.add(passes.iter().sum::<f64>() / f64::from(PASSES));
                last.add(passes[PASSES as usize - 1]);
            }
            let (p, fault) = (all.p_value(integral, error), all.smallest_fault(corrected(6)));
            println!(
                "{name}, fresh {fresh}, learns {learns}: {} instead of {integral}, p {p:.1e}, finds {:.2} %",
                all.mean,
                100.0 * fault
            );
            assert!(p > corrected(6), "{name}, fresh {fresh}, learns {learns}: {} instead of {integral}", all.mean);
            assert!(fault < 0.02, "{fault}");
            variances.push(last.standard_error().powi(2));
        }
        let gain = variances[0] / variances[1];
        println!("{name}: {gain:.2} times less variance");
        assert!(gain > 1.3, "{name}: {gain}");
    }
}

/// What four rays of a pixel bring once a place is known, and with nothing known: their variances. `shadow` is what is seen.
fn variances(client: &Client, map: &Map, shadow: &dyn Fn(V3) -> f64) -> [f64; 2] {
    let light = Light::of(map);
    let (mut memory, mut thread) = (Memory::new(1), Thread::new(4));
    let mut pixel = |memory: &Memory, seed: u32, knows: bool| {
        let cache = memory.cache();
        let seen = if knows { cache.factors(1, seed) } else { None };
        let point = Point { seen, ..client.point() };
        let rays = thread.direct(&light.environment(), &point, Sequence { seed, sample: 0, bounce: 0 }, 4);
        let brings = rays.iter().map(|ray| {
            let wi = ray.wi.map(f64::from);
            cache.record(1, seed, ray.wi.into(), shadow(wi) > 0.0);
            let radiance = map.radiance(Filter::Bilinear, rotate_back(&TURNED, wi))[0];
            f64::from(ray.weight) * client.response(wi) * shadow(wi) * radiance
        });
        brings.sum::<f64>()
    };
    for pass in 0..8 {
        (0..64).for_each(|k| _ = pixel(&memory, 64 * pass + k, pass > 0));
        memory.end_pass();
    }
    [true, false].map(|knows| {
        let mut all = Mean::default();
        (1000..21_000).for_each(|seed| all.add(pixel(&memory, seed, knows)));
        all.standard_error().powi(2)
    })
}

/// Lambert, and GGX without reflectance at its normal, outdoors and in a room: the variance of 20,000 pixels is not above that without a cache.
/// Both have the same seeds. In the open a cache changes nothing.
#[test]
fn a_cache_costs_no_variance() {
    let clients = [
        ("Lambert", Client::new(&[Shape::LAMBERT], client::lambert)),
        ("GGX", Client { f0: 0.0, ..Client::new(&[Shape::ggx(0.5, 0.5)], client::mixture) }),
    ];
    let places = [("in the open", (|_| 1.0) as fn(V3) -> f64, 1.0001), ("behind a window", seen, 1.0)];
    for (light, map) in maps() {
        for (name, client) in &clients {
            for (place, shadow, most) in places {
                let [with, without] = variances(client, &map, &shadow);
                println!("{name}, {light}, {place}: {:.4} of the variance without a cache", with / without);
                assert!(with <= most * without, "{name}, {light}, {place}: {with} {without}");
            }
        }
    }
}
