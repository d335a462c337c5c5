//! Structured importance sampling: the oracle's strata, what every stratification has, and hard maps.

use crate::stored::{cases, doubles, floats, integer, number};
use crate::support;
use crate::support::{Map, Memory};
use std::ptr::{null, null_mut};
use wis::blob::Room;
use wis::ffi::MemorySize;
use wis::ffi::light::{LightConfig, WIS_ENVIRONMENT_ROWS_AT_POLES, WIS_ENVIRONMENT_SANITISE, WIS_LAYOUT_OCTAHEDRAL};
use wis::ffi::lights::{
    Jitter, JitterConfig, WIS_JITTER_ENERGY, WIS_JITTER_UNIFORM, wis_jitter_init, wis_jitter_pdf, wis_jitter_sample,
    wis_jitter_size, wis_strata_order,
};
use wis::ffi::lights::{StrataConfig, wis_strata_lights, wis_strata_size};
use wis::lights::strata::{Config, Light, Strata};
use wis::sample::Sample;
use wis::status::Status;

/// Centres and the label of each texel.
struct Placed {
    centres: Vec<u32>,
    label: Vec<u32>,
}

fn try_run(config: &Config, luminance: &[f32]) -> Result<Placed, Status> {
    // Memory of any content.
    let mut memory = vec![u128::MAX; config.size().unwrap().scratch.div_ceil(size_of::<u128>())];
    let mut strata = Strata::new(config, &mut Room::new(bytemuck::cast_slice_mut(&mut memory)));
    for (out, &l) in strata.luminance.iter_mut().zip(luminance) {
        *out = f64::from(l);
    }
    strata.stratify()?;
    Ok(Placed { centres: strata.centres[..strata.count].to_vec(), label: strata.component.to_vec() })
}

fn run(config: &Config, luminance: &[f32]) -> Placed {
    try_run(config, luminance).unwrap()
}

fn direction(config: &Config, texel: u32) -> [f64; 3] {
    let (x, y) = (texel % config.width, texel / config.width);
    let theta = std::f64::consts::PI * (f64::from(y) + 0.5) / f64::from(config.height);
    let phi = std::f64::consts::TAU * (f64::from(x) + 0.5) / f64::from(config.width);
    [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()]
}

fn chord(config: &Config, a: u32, b: u32) -> f64 {
    let (a, b) = (direction(config, a), direction(config, b));
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn the_oracle_has_the_same_centres_and_strata() {
    for case in cases("sis.json") {
        let (width, height) = (integer(&case["w"]), integer(&case["h"]));
        let config = Config {
            levels: integer(&case["d"]),
            angle_limit: number(&case["dw0"]),
            ..Config::new(width, height, integer(&case["N"]))
        };
        let strata = run(&config, &floats(&case["lum"]));
        let centres: Vec<u32> = doubles(&case["centres"]).iter().map(|&c| c as u32).collect();
        assert_eq!(strata.centres, centres, "{width} x {height}");
        for (texel, (label, expected)) in strata.label.iter().zip(doubles(&case["label"])).enumerate() {
            assert!(expected < 0.0 || f64::from(*label) == expected, "texel {texel}: {label} for {expected}");
        }
    }
}

/// A map with a window, two lamps and a gradient, of any size.
fn room(width: u32, height: u32) -> Vec<f32> {
    let texel = |i: u32| {
        let (u, v) = (f64::from(i % width) / f64::from(width), f64::from(i / width) / f64::from(height));
        let window = !(0.06..=0.95).contains(&u) && (0.3..0.5).contains(&v);
        let lamp = |a: f64, b: f64| (u - a).hypot(v - b) < 0.015;
        let light = if window { 30.0 } else { 0.0 } + if lamp(0.4, 0.2) || lamp(0.7, 0.6) { 200.0 } else { 0.0 };
        (light + 0.3 + 0.5 * (1.0 - v) + 0.1 * (u * 40.0).sin()) as f32
    };
    (0..width * height).map(texel).collect()
}

#[test]
fn labels_are_the_nearest_centres_and_centres_are_distinct() {
    for (width, height, count) in [(96, 48, 60), (40, 31, 9), (64, 32, 300)] {
        let config = Config::new(width, height, count);
        let strata = run(&config, &room(width, height));
        assert!(strata.centres.len() >= count as usize && strata.centres.len() <= config.capacity());
        let mut sorted = strata.centres.clone();
        sorted.sort_unstable();
        sorted.dedup();
        assert_eq!(sorted.len(), strata.centres.len());
        for (texel, &label) in strata.label.iter().enumerate() {
            let to = |number: usize| chord(&config, texel as u32, strata.centres[number]);
            let nearest = (0..strata.centres.len()).map(to).fold(f64::INFINITY, f64::min);
            assert!(to(label as usize) <= nearest + 1e-12);
        }
    }
}

/// In each component the added centres are farthest-first: the naive traversal picks the same. Chords of the larger maps
/// come within 1e-5 of each other, and are still told apart.
#[test]
fn the_darkest_layer_is_traversed_farthest_first() {
    for (width, height, count) in [(48, 24, 40), (101, 53, 300), (160, 81, 200)] {
        traverse_farthest_first(width, height, count);
    }
}

fn traverse_farthest_first(width: u32, height: u32, count: u32) {
    let config = Config { levels: 1, ..Config::new(width, height, count) };
    let luminance = room(width, height);
    let strata = run(&config, &luminance);
    let mut distance = vec![f64::INFINITY; config.texels()];
    for (number, &centre) in strata.centres.iter().enumerate() {
        if number > 0 {
            let largest = distance.iter().copied().fold(0.0, f64::max);
            let first = distance.iter().position(|&d| d >= largest - 1e-9).unwrap();
            assert_eq!(centre as usize, first, "centre {number}");
        }
        for (texel, d) in distance.iter_mut().enumerate() {
            *d = d.min(chord(&config, texel as u32, centre));
        }
    }
}

#[test]
fn scale_and_turns_of_the_map_change_nothing() {
    let (width, height) = (64, 32);
    let config = Config::new(width, height, 50);
    let map = room(width, height);
    let strata = run(&config, &map);
    let scaled: Vec<f32> = map.iter().map(|l| l * 1024.0).collect();
    assert_eq!(run(&config, &scaled).centres, strata.centres);
    // A component that wraps around the azimuth gets what it gets elsewhere.
    let turned: Vec<f32> = (0..width * height).map(|i| map[(i / width * width + (i + 16) % width) as usize]).collect();
    let moved = run(&config, &turned);
    let shares = |strata: &Placed, map: &[f32]| strata.centres.iter().filter(|&&c| map[c as usize] > 20.0).count();
    assert_eq!(moved.centres.len(), strata.centres.len());
    assert_eq!(shares(&moved, &turned), shares(&strata, &map));
}

#[test]
fn hard_maps_have_defined_results() {
    let config = Config::new(16, 8, 10);
    assert!(run(&config, &[0.0; 128]).centres.is_empty());
    assert_eq!(run(&config, &[3.0; 128]).centres.len(), 10);
    let mut one = [0.0; 128];
    one[37] = 5.0;
    let strata = run(&config, &one);
    assert!(strata.centres[0] == 37 && strata.centres.len() >= 10);
    assert_eq!(run(&Config::new(1, 1, 5), &[2.0]).centres, [0]);
    assert!(run(&Config::new(16, 8, 0), &[1.0; 128]).centres.is_empty());
    // More lights than texels: every texel is one.
    assert_eq!(run(&Config::new(4, 2, 1000), &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]).centres.len(), 8);
    for bad in [
        Config { levels: 0, ..config },
        Config { angle_limit: 0.0, ..config },
        Config { angle_exponent: f64::NAN, ..config },
        Config { radiance_exponent: -1.0, ..config },
    ] {
        assert_eq!(try_run(&bad, &[1.0; 128]).err(), Some(Status::InvalidArgument));
    }
    assert_eq!(Strata::new(&config, &mut Room::new(&mut [])).stratify(), Err(Status::InvalidArgument));
}

/// Lights and labels of a map through the C boundary, with its config.
fn lights(map: &LightConfig, config: &StrataConfig) -> Result<(Vec<Light>, Vec<u32>), Status> {
    let mut size = MemorySize::default();
    let mut label = vec![u32::MAX; (map.width * map.height) as usize];
    // SAFETY: all pointers are to live values of the lengths that the header asks for.
    unsafe {
        let status = wis_strata_size(map, config, &mut size, null_mut());
        if status != Status::Ok {
            return Err(status);
        }
        let mut scratch = Memory::filled(size.scratch_bytes, 0x5a);
        let mut lights = vec![Light::default(); size.bytes / size_of::<Light>()];
        let mut count = 0;
        let status = wis_strata_lights(
            map,
            config,
            scratch.pointer(),
            size.scratch_bytes,
            lights.as_mut_ptr(),
            &mut count,
            label.as_mut_ptr(),
            null_mut(),
        );
        lights.truncate(count as usize);
        if status == Status::Ok { Ok((lights, label)) } else { Err(status) }
    }
}

fn strata_config(count: u32) -> StrataConfig {
    StrataConfig { size: size_of::<StrataConfig>() as u32, count, levels: 0, angle_limit: 0.0, exponents: null() }
}

#[test]
fn lights_carry_the_energy_of_their_strata() {
    let map = Map { pixels: room(96, 48), ..Map::latlong(96, 48, |_, _| 0.0) };
    let rows = (0..).zip(map.pixels.chunks_exact(96));
    let of_row = |(y, row): (u32, &[f32])| {
        row.iter().map(|&l| f64::from(l)).sum::<f64>() * wis::sphere::latlong_solid_angle(96, 48, y)
    };
    let power: f64 = rows.map(of_row).sum();
    let matrix = [0.36, 0.48, -0.8, -0.8, 0.6, 0.0, 0.48, 0.64, 0.6f32];
    let still = strata_config(80);
    let turned = LightConfig { world_from_map: matrix.as_ptr(), ..map.light_config(0) };
    let (lights_of_map, label) = lights(&map.light_config(0), &still).unwrap();
    let total: f64 = lights_of_map.iter().map(|l| f64::from(l.luminance)).sum();
    assert!((total / power - 1.0).abs() < 1e-5, "{total} of {power}");
    let angle: f64 = lights_of_map.iter().map(|l| f64::from(l.solid_angle)).sum();
    assert!((angle / (4.0 * std::f64::consts::PI) - 1.0).abs() < 1e-5);
    assert!(label.iter().all(|&l| (l as usize) < lights_of_map.len()));
    let (lights_of_world, same) = lights(&turned, &still).unwrap();
    assert_eq!(same, label);
    for (a, b) in lights_of_map.iter().zip(&lights_of_world) {
        let d = a.direction;
        let length = d.iter().map(|c| c * c).sum::<f32>();
        assert!((length - 1.0).abs() < 1e-6 && a.rgb == [a.luminance; 3] && a.rgb == b.rgb && a.extent >= 0.0);
        for (k, row) in matrix.chunks(3).enumerate() {
            let world = row[0] * d[0] + row[1] * d[1] + row[2] * d[2];
            assert!((world - b.direction[k]).abs() < 1e-6);
        }
    }
}

/// A table of places inside strata.
struct Places {
    handle: *const Jitter,
    /// What the handle points to.
    _memory: Memory,
}

impl Places {
    fn new(map: &LightConfig, count: u32, label: &[u32], distribution: u32) -> Places {
        let (mut size, mut handle) = (MemorySize::default(), null());
        // SAFETY: all pointers are valid.
        unsafe {
            let config = JitterConfig {
                size: size_of::<JitterConfig>() as u32,
                light_count: count,
                distribution,
                reserved: 0,
                label: label.as_ptr(),
            };
            assert_eq!(wis_jitter_size(map, &config, &mut size, null_mut()), Status::Ok);
            let (mut memory, mut scratch) = (Memory::new(size.bytes), Memory::filled(size.scratch_bytes, 0x5a));
            let (place, work) = (memory.pointer(), scratch.pointer());
            let status =
                wis_jitter_init(map, &config, place, size.bytes, work, size.scratch_bytes, &mut handle, null_mut());
            assert_eq!(status, Status::Ok);
            Places { handle, _memory: memory }
        }
    }

    fn sample(&self, light: u32, u: [f32; 2]) -> Sample {
        let mut sample = Sample::default();
        // SAFETY: all pointers are valid.
        assert_eq!(unsafe { wis_jitter_sample(self.handle, light, &u, &mut sample) }, Status::Ok);
        sample
    }

    fn pdf(&self, light: u32, wi: [f32; 3]) -> f32 {
        let mut pdf = f32::NAN;
        // SAFETY: all pointers are valid.
        assert_eq!(unsafe { wis_jitter_pdf(self.handle, light, &wi, &mut pdf) }, Status::Ok);
        pdf
    }
}

const TURNED: [f32; 9] = [0.36, 0.48, -0.8, -0.8, 0.6, 0.0, 0.48, 0.64, 0.6];

/// Places stay in their stratum at every corner of u, come with the pdf of their direction, and the pdf integrates to 1
/// over the stratum and is 0 elsewhere.
#[test]
fn places_are_distributions_over_their_strata() {
    let (width, height) = (48, 24);
    let map = Map { pixels: room(width, height), ..Map::latlong(width, height, |_, _| 0.0) };
    let turned = LightConfig { world_from_map: TURNED.as_ptr(), ..map.light_config(0) };
    let (lights, label) = lights(&turned, &strata_config(30)).unwrap();
    for distribution in [WIS_JITTER_UNIFORM, WIS_JITTER_ENERGY] {
        let places = Places::new(&turned, lights.len() as u32, &label, distribution);
        let corners = [0.0, 1e-7, 0.3, 0.5, 0.999_999, 1.0 - 1.0 / 16_777_216.0, f32::NAN];
        for light in 0..lights.len() as u32 {
            for (u, v) in corners.iter().flat_map(|&u| corners.map(|v| (u, v))) {
                let sample = places.sample(light, [u, v]);
                assert!(sample.pdf > 0.0 && places.pdf(light, sample.wi) == sample.pdf);
                assert_eq!(places.pdf((light + 1) % lights.len() as u32, sample.wi), 0.0);
            }
        }
        let mut integrals = vec![0.0; lights.len()];
        for texel in 0..width * height {
            let sizes = Config::new(width, height, 1);
            let d = direction(&sizes, texel).map(|c| c as f32);
            let world: [f32; 3] = std::array::from_fn(|k| (0..3).map(|i| TURNED[3 * k + i] * d[i]).sum());
            let own = label[texel as usize];
            let angle = wis::sphere::latlong_solid_angle(width, height, texel / width);
            integrals[own as usize] += f64::from(places.pdf(own, world)) * angle;
        }
        assert!(integrals.iter().all(|integral| (integral - 1.0).abs() < 1e-5), "{integrals:?}");
    }
}

/// Energy-proportional places make weight x visibility unbiased; uniform ones do not. Of 60 000 places each, a fault of
/// 2 % of the whole would be 5 standard errors and more (asserted).
#[test]
fn energy_proportional_places_are_unbiased_in_shadow() {
    let (width, height) = (48, 24);
    let map = Map { pixels: room(width, height), ..Map::latlong(width, height, |_, _| 0.0) };
    let (lights, label) = lights(&map.light_config(0), &strata_config(12)).unwrap();
    let visible = |wi: [f64; 3]| 0.7 * wi[0] - 0.5 * wi[1] + 0.3 * wi[2] > 0.07;
    let sizes = Config::new(width, height, 1);
    // The occluder's edge runs through texels: their visible share by 24 x 24 places.
    let fine = Config::new(24 * width, 24 * height, 1);
    let mut exact = 0.0;
    for texel in 0..fine.width * fine.height {
        let (x, y) = (texel % fine.width / 24, texel / fine.width / 24);
        let angle = wis::sphere::latlong_solid_angle(fine.width, fine.height, texel / fine.width);
        let seen = f64::from(u8::from(visible(direction(&fine, texel))));
        exact += f64::from(map.pixels[(y * sizes.width + x) as usize]) * angle * seen;
    }
    let total: f64 = lights.iter().map(|l| f64::from(l.luminance)).sum();
    let estimate = |distribution: u32| {
        let places = Places::new(&map.light_config(0), lights.len() as u32, &label, distribution);
        let (mut sum, mut square) = (0.0, 0.0);
        const COUNT: u32 = 60_000;
        let mut random = support::Random(77);
        for _ in 0..COUNT {
            let seen = |light: u32, u| visible(places.sample(light, u).wi.map(f64::from));
            let value: f64 = (0u32..)
                .zip(&lights)
                .filter(|(number, _)| seen(*number, [random.f32(), random.f32()]))
                .map(|(_, light)| f64::from(light.luminance))
                .sum();
            sum += value / f64::from(COUNT);
            square += value * value / f64::from(COUNT);
        }
        (sum, ((square - sum * sum) / f64::from(COUNT)).sqrt())
    };
    let (mean, error) = estimate(WIS_JITTER_ENERGY);
    println!("energy: {mean} of {exact} +- {error}; all {total}");
    assert!((mean - exact).abs() < 5.0 * error && 7.33 * error < 0.02 * exact);
    let (mean, error) = estimate(WIS_JITTER_UNIFORM);
    println!("uniform: {mean} of {exact} +- {error}");
    assert!((mean - exact).abs() > 5.0 * error);
}

#[test]
fn lights_are_ordered_by_what_they_may_add() {
    let mut random = support::Random(5);
    for count in [0usize, 1, 2, 3, 17, 300, 1000] {
        let contribution: Vec<f32> =
            (0..count).map(|i| if i % 3 == 0 { 0.0 } else { (8.0 * random.f32()).floor() }).collect();
        for threshold in [0.0, 0.02, 0.5, 1.0] {
            let (mut index, mut traced) = (vec![u32::MAX; count], u32::MAX);
            // SAFETY: both arrays have `count` elements.
            let status = unsafe {
                wis_strata_order(count, contribution.as_ptr(), threshold, index.as_mut_ptr(), &mut traced, null_mut())
            };
            assert_eq!(status, Status::Ok);
            let mut expected: Vec<u32> = (0..count as u32).collect();
            expected.sort_by(|&a, &b| contribution[b as usize].total_cmp(&contribution[a as usize]).then(a.cmp(&b)));
            assert_eq!(index[..traced as usize], expected[..traced as usize]);
            let mut all = index.clone();
            all.sort_unstable();
            assert!(all.iter().copied().eq(0..count as u32));
            let sum = |lights: &[u32]| lights.iter().map(|&i| f64::from(contribution[i as usize])).sum::<f64>();
            let (kept, rest) = index.split_at(traced as usize);
            assert!(sum(rest) <= f64::from(threshold) * sum(&index));
            let one_less = kept.split_last().map(|(last, _)| sum(rest) + f64::from(contribution[*last as usize]));
            assert!(one_less.is_none_or(|rest| rest > f64::from(threshold) * sum(&index)));
        }
    }
}

/// Lights of all magnitudes of a float, and thresholds far below what a double tells from 1.
#[test]
fn lights_of_all_magnitudes_are_ordered() {
    for threshold in [1e-3f32, 1e-15, 1e-17, 1e-30, 1e-38, 1e-45] {
        let contribution: Vec<f32> = (0..276).map(|k| 2.0f32.powi(k / 2 - 148 + k % 7)).chain([f32::MAX; 4]).collect();
        let (mut index, mut traced) = (vec![u32::MAX; contribution.len()], u32::MAX);
        let (count, all) = (contribution.len(), contribution.as_ptr());
        // SAFETY: both arrays have `count` elements.
        let status = unsafe { wis_strata_order(count, all, threshold, index.as_mut_ptr(), &mut traced, null_mut()) };
        assert_eq!(status, Status::Ok);
        // The smallest first: sums of few numbers of a like size are exact enough.
        let sum = |lights: &[u32]| lights.iter().rev().map(|&i| f64::from(contribution[i as usize])).sum::<f64>();
        let (kept, rest) = index.split_at(traced as usize);
        let allowed = f64::from(threshold) * sum(&index);
        assert!(sum(rest) <= allowed, "{threshold}: {} for {allowed}", sum(rest));
        let last = f64::from(contribution[kept[kept.len() - 1] as usize]);
        assert!(sum(rest) + last > allowed, "{threshold}: one light less would do");
    }
}

/// Exponents that carry energies out of a double's range change nothing: shares of the energy count. Light that is no float
/// is told.
#[test]
fn lights_of_extreme_maps() {
    let exponents = [8.0f32, 0.25];
    let config = StrataConfig { exponents: exponents.as_ptr(), ..strata_config(20) };
    let at = |scale: f32| {
        let map = Map::latlong(32, 16, |x, y| scale * (1 + x % 5 + y % 3) as f32);
        lights(&map.light_config(0), &config).map(|(lights, label)| (lights.len(), label))
    };
    let expected = at(1.0).unwrap();
    assert!(expected.0 >= 20);
    for scale in [2f32.powi(120), 2f32.powi(-120)] {
        assert_eq!(at(scale).as_ref(), Ok(&expected));
    }
    let map = Map::latlong(32, 16, |_, _| f32::MAX);
    assert_eq!(lights(&map.light_config(0), &strata_config(1)).unwrap_err(), Status::Overflow);
}

/// The kernel's own defaults are those of the C boundary, which are the paper's.
#[test]
fn kernel_and_boundary_have_the_same_defaults() {
    // Lamps small enough that their solid angle counts.
    let (width, height) = (256, 128);
    let map = Map::latlong(width, height, |x, y| if x / 2 % 50 == 9 && y / 2 == 30 { 300.0 } else { 1.0 });
    for count in [60, 100] {
        let (lights, label) = lights(&map.light_config(0), &strata_config(count)).unwrap();
        let strata = run(&Config::new(width, height, count), &map.pixels);
        assert_eq!((strata.centres.len(), strata.label), (lights.len(), label), "{count} lights");
    }
}

/// A small bright square in a wider one on a dark sphere: the paper's Figure 3.
#[test]
fn small_bright_regions_get_fewer_lights_by_the_metric_than_by_light_alone() {
    let inside = |x: u32, y: u32, half: u32| x.abs_diff(128) < half && y.abs_diff(64) < half;
    let map = Map::latlong(256, 128, |x, y| match (x, y) {
        _ if inside(x, y, 6) => 400.0,
        _ if inside(x, y, 30) => 8.0,
        _ => 1.0,
    });
    let in_the_middle = |exponents: [f32; 2], angle_limit: f32| {
        let config = StrataConfig { angle_limit, exponents: exponents.as_ptr(), ..strata_config(200) };
        let (lights, _) = lights(&map.light_config(0), &config).unwrap();
        let azimuth = |l: &Light| l.direction[1].atan2(l.direction[0]).abs();
        let within = |l: &&Light| std::f32::consts::PI - azimuth(l) < 0.15 && l.direction[2].abs() < 0.15;
        lights.iter().filter(within).count()
    };
    let (light, metric, area) =
        (in_the_middle([1.0, 0.0], 0.0), in_the_middle([1.0, 0.25], 0.2), in_the_middle([0.0, 1.0], 12.566));
    assert!(area < metric && metric < light, "{area} {metric} {light}");
    assert!(area <= 3 && light > 100, "{area} {light}");
    let config = strata_config(200);
    let written_out = StrataConfig { exponents: PAPERS.as_ptr(), angle_limit: 0.01, levels: 6, ..config };
    assert_eq!(lights(&map.light_config(0), &written_out).unwrap(), lights(&map.light_config(0), &config).unwrap());
}

static PAPERS: [f32; 2] = [1.0, 0.25];
static NEGATIVE: [f32; 2] = [-0.5, 0.25];
static NOT_A_NUMBER: [f32; 2] = [1.0, f32::NAN];

#[test]
fn bad_maps_and_configs_are_refused() {
    let map = Map::latlong(16, 8, |x, _| x as f32);
    let good = strata_config(5);
    for bad in [
        StrataConfig { levels: 65, ..good },
        StrataConfig { angle_limit: -1.0, ..good },
        StrataConfig { angle_limit: f32::NAN, ..good },
        StrataConfig { exponents: NEGATIVE.as_ptr(), ..good },
        StrataConfig { exponents: NOT_A_NUMBER.as_ptr(), ..good },
    ] {
        assert_eq!(lights(&map.light_config(0), &bad).err(), Some(Status::InvalidArgument));
    }
    let octahedral = Map::latlong(8, 8, |_, _| 1.0);
    let at_poles = map.light_config(WIS_ENVIRONMENT_ROWS_AT_POLES);
    assert_eq!(lights(&at_poles, &good).err(), Some(Status::InvalidArgument));
    let config = LightConfig { layout: WIS_LAYOUT_OCTAHEDRAL, ..octahedral.light_config(0) };
    assert_eq!(lights(&config, &good).err(), Some(Status::InvalidArgument));
    let mut invalid = map.clone();
    invalid.pixels[9] = f32::NAN;
    assert_eq!(lights(&invalid.light_config(0), &good).err(), Some(Status::InvalidTexel));
    invalid.pixels[30] = f32::INFINITY;
    let (sound, _) = lights(&invalid.light_config(WIS_ENVIRONMENT_SANITISE), &good).unwrap();
    assert!(!sound.is_empty() && sound.iter().all(|l| l.luminance.is_finite()));
    let black = Map::latlong(16, 8, |_, _| 0.0);
    assert_eq!(lights(&black.light_config(0), &good).unwrap(), (vec![], vec![0; 128]));
    let nothing = Map::latlong(16, 8, |_, _| f32::NAN);
    assert_eq!(lights(&nothing.light_config(0), &good).err(), Some(Status::InvalidTexel));
    assert_eq!(lights(&nothing.light_config(WIS_ENVIRONMENT_SANITISE), &good).unwrap(), (vec![], vec![0; 128]));
    assert_eq!(lights(&map.light_config(0), &strata_config(0)).unwrap().0, vec![]);
}

/// A texel with light has a density above 0, however small its share of the stratum.
#[test]
fn the_faintest_place_has_a_density() {
    let (width, height) = (8, 4);
    let map = Map::latlong(width, height, |x, y| if (x, y) == (0, 0) { 1e-38 } else { 1e37 });
    let places = Places::new(&map.light_config(0), 1, &vec![0; (width * height) as usize], WIS_JITTER_ENERGY);
    let wi = direction(&Config::new(width, height, 1), 0).map(|c| c as f32);
    assert!(places.pdf(0, wi) > 0.0);
}
