//! The environment: integration of input maps in all layouts and formats, storages, and the light alone as a
//! distribution.

use crate::support::maps::{Filter, one_texel, sky};
use crate::support::vector::{V3, unit};
use crate::support::*;
use serde_json::Value;
use std::ffi::c_void;
use std::ptr::{null, null_mut};
use wis::ffi::wavelets::environment::{
    EnvironmentConfig, WIS_FORMAT_F16, WIS_LAYOUT_CUBE, WIS_LAYOUT_LATLONG, WIS_LAYOUT_OCTAHEDRAL, WIS_STORAGE_SPARSE,
    WIS_WAVELET_LIGHT_EXACT_ZERO, WIS_WAVELET_LIGHT_NEAREST, WIS_WAVELET_LIGHT_RGB, WIS_WAVELET_LIGHT_SANITISE,
};
use wis::sphere::{cube_direction, direction_f64};
use wis::status::Status;

const EXACT: u32 = WIS_WAVELET_LIGHT_EXACT_ZERO;

/// The direction of the middle of cell `(i, j)` of `cells` x `cells`.
fn middle(cells: u32, i: u32, j: u32) -> [f32; 3] {
    let at = |k: u32| (f64::from(k) + 0.5) / f64::from(cells);
    direction_f64([at(i), at(j)]).map(|c| c as f32)
}

fn pairs(n: u32) -> impl Iterator<Item = (u32, u32)> {
    (0..n).flat_map(move |i| (0..n).map(move |j| (i, j)))
}

#[test]
fn a_constant_map_is_uniform() {
    for (width, height) in [(1, 1), (3, 5), (64, 32), (31, 17)] {
        for resolution in [1, 2, 16, 64] {
            let environment = Map::latlong(width, height, |_, _| 3.0).build(resolution, 0);
            let uniform = 1.0 / (4.0 * std::f32::consts::PI);
            assert!((environment.info.power / (12.0 * std::f64::consts::PI) - 1.0).abs() < 1e-12);
            let mut random = Random(7);
            for _ in 0..100 {
                let sample = environment.sample(None, [random.f32(), random.f32()]);
                assert!((sample.pdf / uniform - 1.0).abs() < 1e-5, "{width}x{height} at {resolution}: {}", sample.pdf);
            }
        }
    }
}

/// The power of a map is the sum of its texels' radiance times solid angle, whatever the resolution of the tree.
#[test]
fn power_is_exact() {
    let mut random = Random(3);
    for (width, height) in [(1, 1), (2, 1), (1, 7), (5, 3), (37, 19), (128, 64)] {
        let map = Map::latlong(width, height, |_, _| random.f32() * random.f32() * 100.0);
        let sum: f64 = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| {
                let solid_angle = wis::sphere::latlong_solid_angle(width, height, y);
                f64::from(map.pixels[(y * width + x) as usize]) * solid_angle
            })
            .sum();
        for resolution in [1, 4, 64, 256] {
            let power = map.build(resolution, WIS_WAVELET_LIGHT_NEAREST).info.power;
            assert!((power / sum - 1.0).abs() < 1e-12, "{width}x{height} at {resolution}: {power} {sum}");
        }
    }
}

/// Each cell's density is the average of the map over it: the average of many look-ups, cell by cell.
#[test]
fn cells_are_averages_of_the_map() {
    let (width, height) = (23, 11);
    let mut random = Random(11);
    let map = Map::latlong(width, height, |_, _| random.f32() + 0.1);
    let environment = map.build(4, WIS_WAVELET_LIGHT_NEAREST);
    let side = 400;
    for i in 0..4 {
        for j in 0..4 {
            let mut sum = 0.0;
            for k in 0..side * side {
                let at = |cell: u32, k: u32| (f64::from(cell) + (f64::from(k) + 0.5) / f64::from(side)) / 4.0;
                let direction = wis::sphere::direction_f64([at(i, k / side), at(j, k % side)]);
                let [u, v] = wis::sphere::latlong(direction);
                let x = ((u * f64::from(width)) as u32).min(width - 1);
                let y = ((v * f64::from(height)) as u32).min(height - 1);
                sum += f64::from(map.pixels[(y * width + x) as usize]);
            }
            let average = sum / f64::from(side * side);
            let centre = wis::sphere::direction_f64([(f64::from(i) + 0.37) / 4.0, (f64::from(j) + 0.41) / 4.0]);
            let pdf = f64::from(environment.pdf(None, centre.map(|c| c as f32)));
            let expected = average / environment.info.power;
            assert!((pdf / expected - 1.0).abs() < 2e-3, "cell {i} {j}: {pdf} {expected}");
        }
    }
}

/// A sample's pdf is pdf(wi) to the bit, and inversion leads back.
#[test]
fn sample_pdf_invert() {
    let mut random = Random(5);
    let map = Map::latlong(64, 32, |_, _| if random.f32() < 0.05 { 1000.0 * random.f32() } else { random.f32() });
    for environment in [map.build(128, 0), map.build(0, 0), map.build(0, WIS_WAVELET_LIGHT_NEAREST)] {
        for _ in 0..20_000 {
            let u = [random.f32(), random.f32()];
            let sample = environment.sample(None, u);
            assert_eq!(sample.pdf.to_bits(), environment.pdf(None, sample.wi).to_bits());
            let back = environment.invert(None, sample.wi).unwrap();
            for q in 0..2 {
                assert!((back[q] - u[q]).abs() < 1e-3, "{u:?} {back:?}");
            }
        }
    }
}

/// The radiance that a density stands for.
fn radiance(environment: &Environment, wi: [f32; 3]) -> f64 {
    f64::from(environment.pdf(None, wi)) * environment.info.power
}

/// With cells that are texels, a lone texel of an octahedral map spreads to the texels about it by [1 6 1] / 8 per
/// axis; beyond an edge these are the texels of the vectors.
#[test]
fn octahedral_texels_spread_over_the_folded_edges() {
    let vectors: Value = serde_json::from_str(include_str!("vectors/sphere.json")).unwrap();
    let n = vectors["oct_wrap"]["n"].as_u64().unwrap() as u32;
    let rows = vectors["oct_wrap"]["rows"].as_array().unwrap();
    let row = |row: &Value| [0, 1, 2, 3].map(|k| row[k].as_i64().unwrap());
    let wrapped = |i: i64, j: i64| {
        let inside = (0..i64::from(n)).contains(&i) && (0..i64::from(n)).contains(&j);
        let found = rows.iter().map(row).find(|r| r[..2] == [i, j]).map(|r| [r[2], r[3]]);
        if inside { [i, j] } else { found.expect("all texels about the square are listed") }
    };
    for (x, y) in pairs(n) {
        let pixels = pairs(n).map(|(row, column)| if (column, row) == (x, y) { 1.0 } else { 0.0 }).collect();
        let map = Map { width: n, height: n, channels: 1, layout: WIS_LAYOUT_OCTAHEDRAL, pixels };
        let environment = map.build(n, EXACT);
        for (i, j) in pairs(n) {
            let weights = [(-1, 0.125), (0, 0.75), (1, 0.125)];
            let all = weights.iter().flat_map(|a| weights.iter().map(move |b| (a.0, b.0, a.1 * b.1)));
            let reached =
                all.filter(|(di, dj, _)| wrapped(i64::from(i) + di, i64::from(j) + dj) == [x, y].map(i64::from));
            let expected: f64 = reached.map(|(_, _, weight)| weight).sum();
            let found = radiance(&environment, middle(n, i, j));
            assert!((found - expected).abs() < 1e-6, "texel {x} {y} at {i} {j}: {found} {expected}");
        }
    }
}

/// What a texel of a lat-long map spreads, for bilinear look-ups whose rows mirror over the poles and whose azimuth
/// wraps: as if the map had been filtered by [1 6 1] / 8 per axis.
#[test]
fn latlong_texels_spread_over_the_seam_and_the_poles() {
    for (x, y) in [(20, 9), (0, 5), (63, 5), (7, 0), (33, 31)] {
        let map = one_texel(x, y);
        let filtered = Map::latlong(map.width, map.height, |x, y| {
            let weights = [(-1, 0.125), (0, 0.75), (1, 0.125)];
            let all = weights.iter().flat_map(|a| weights.iter().map(move |b| (a.0, b.0, a.1 * b.1)));
            all.map(|(dx, dy, weight)| weight * map.texel(i64::from(x) + dx, i64::from(y) + dy)[0]).sum::<f64>() as f32
        });
        let (spread, expected) = (map.build(64, EXACT), filtered.build(64, EXACT | WIS_WAVELET_LIGHT_NEAREST));
        for (i, j) in pairs(64) {
            let [a, b] = [&spread, &expected].map(|e| radiance(e, middle(64, i, j)));
            assert!((a - b).abs() <= 1e-5 * b, "texel {x} {y} at {i} {j}: {a} {b}");
        }
    }
}

/// Across each edge of a cube map, the texel on the other face is lit too.
#[test]
fn cube_texels_spread_over_the_edges() {
    const N: u32 = 8;
    for face in 0..6 {
        for (column, row) in [(0, 3), (N - 1, 3), (3, 0), (3, N - 1)] {
            let lit = |x, y| (x, y) == (column, face * N + row);
            let pixels = (0..6 * N).flat_map(|y| (0..N).map(move |x| if lit(x, y) { 1.0 } else { 0.0 })).collect();
            let map = Map { width: N, height: 6 * N, channels: 1, layout: WIS_LAYOUT_CUBE, pixels };
            let environment = map.build(64, EXACT);
            let place = |k: u32, beyond: f64| {
                let middle = 2.0 * (f64::from(k) + 0.5) / f64::from(N) - 1.0;
                if k == 0 {
                    middle - beyond
                } else if k == N - 1 {
                    middle + beyond
                } else {
                    middle
                }
            };
            let at = |beyond| cube_direction(face, place(column, beyond), place(row, beyond));
            // The texel is 2 / 8 wide; its neighbour's middle lies one texel further, more than that is black.
            for (beyond, positive) in [(0.0, true), (0.2, true), (0.3, true), (0.9, false)] {
                let found = radiance(&environment, unit(at(beyond)).map(|c| c as f32));
                assert_eq!(found > 0.0, positive, "face {face}, texel {column} {row}, {beyond} further: {found}");
            }
        }
    }
}

/// Light that tells every axis and its sign apart.
fn lopsided(d: V3) -> f64 {
    let lamp = |at: V3, sharpness: f64| {
        let a = unit(at);
        (sharpness * (a[0] * d[0] + a[1] * d[1] + a[2] * d[2] - 1.0)).exp()
    };
    0.2 + lamp([1.0, 0.3, 0.2], 3.0) + 2.0 * lamp([-0.2, 1.0, -0.5], 8.0) + 3.0 * lamp([0.3, -0.6, -0.9], 12.0)
}

/// The lopsided light in each layout.
fn layouts() -> [Map; 3] {
    const N: u32 = 128;
    let latlong = {
        let empty = Map::latlong(4 * N, 2 * N, |_, _| 0.0);
        Map::latlong(4 * N, 2 * N, |x, y| lopsided(empty.direction(f64::from(x) + 0.5, f64::from(y) + 0.5)) as f32)
    };
    let at = |k: u32| 2.0 * (f64::from(k) + 0.5) / f64::from(N) - 1.0;
    let cube = (0..6 * N).flat_map(|y| (0..N).map(move |x| (x, y)));
    let cube = cube.map(|(x, y)| lopsided(unit(cube_direction(y / N, at(x), at(y % N)))) as f32).collect();
    let square = pairs(N).map(|(y, x)| lopsided(direction_f64([x, y].map(|k| 0.5 + 0.5 * at(k)))) as f32).collect();
    [
        latlong,
        Map { width: N, height: 6 * N, channels: 1, layout: WIS_LAYOUT_CUBE, pixels: cube },
        Map { width: N, height: N, channels: 1, layout: WIS_LAYOUT_OCTAHEDRAL, pixels: square },
    ]
}

/// The same light gives the same density, whichever layout it came in.
#[test]
fn layouts_agree() {
    for map in layouts() {
        let environment = map.build(64, 0);
        let mut sum = 0.0;
        for (i, j) in pairs(64) {
            let expected = lopsided(middle(64, i, j).map(f64::from));
            let found = radiance(&environment, middle(64, i, j));
            assert!((found / expected - 1.0).abs() < 0.02, "layout {} at {i} {j}: {found} {expected}", map.layout);
            sum += expected * 4.0 * std::f64::consts::PI / 4096.0;
        }
        assert!((environment.info.power / sum - 1.0).abs() < 1e-3, "layout {}: {}", map.layout, environment.info.power);
    }
}

/// The value of a 16-bit float.
fn half(bits: u16) -> f32 {
    let (sign, exponent, fraction) = (bits >> 15, i32::from(bits >> 10 & 31), f32::from(bits & 1023));
    let magnitude = match exponent {
        0 => fraction * 2f32.powi(-24),
        31 if bits & 1023 == 0 => f32::INFINITY,
        31 => f32::NAN,
        _ => (1024.0 + fraction) * 2f32.powi(exponent - 25),
    };
    if sign == 1 { -magnitude } else { magnitude }
}

fn random_map(width: u32, height: u32, channels: u32) -> Map {
    let mut random = Random(113);
    let pixels = (0..width * height * channels).map(|_| random.f32() * random.f32() * 100.0).collect();
    Map { width, height, channels, layout: WIS_LAYOUT_LATLONG, pixels }
}

#[test]
fn sixteen_bit_floats_are_read_exactly() {
    let mut random = Random(127);
    // Every value that is light, in disorder: zeros, denormals, the largest.
    let mut bits: Vec<u16> = (0..31 << 10).collect();
    (1..bits.len()).rev().for_each(|k| bits.swap(k, random.bits() as usize % (k + 1)));
    let map = Map { width: 256, height: 124, channels: 1, ..random_map(1, 1, 1) };
    let wide = Map { pixels: bits.iter().map(|&b| half(b)).collect(), ..map.clone() };
    let narrow = EnvironmentConfig { format: WIS_FORMAT_F16, pixels: bits.as_ptr().cast(), ..map.config(64, 0) };
    assert!(build(&narrow).unwrap().bytes() == wide.build(64, 0).bytes());
}

unsafe extern "C" fn row_of(user: *mut c_void, y: u32) -> *const c_void {
    // SAFETY: the user pointer is a map, and its rows are asked for.
    let map = unsafe { &*user.cast::<Map>() };
    let row = map.pixels.get(y as usize * (map.width * map.channels) as usize..);
    row.map_or(null(), |row| row.as_ptr().cast())
}

unsafe extern "C" fn no_row(_: *mut c_void, y: u32) -> *const c_void {
    const ROW: [f32; 64] = [1.0; 64];
    if y == 3 { null() } else { ROW.as_ptr().cast() }
}

#[test]
fn rows_come_in_any_order_and_from_callbacks() {
    for channels in [1, 3, 4] {
        let mut map = random_map(30, 20, channels);
        let flags = WIS_WAVELET_LIGHT_RGB;
        let packed = map.build(16, flags);
        let row = (map.width * channels) as usize;

        let called = EnvironmentConfig {
            pixels: null(),
            row: Some(row_of),
            row_user: (&raw mut map).cast(),
            ..map.config(16, flags)
        };
        assert!(build(&called).unwrap().bytes() == packed.bytes());

        // Upside down, with room between the rows.
        let stride = row + 5;
        let mut reversed = vec![f32::NAN; stride * 20];
        map.pixels
            .chunks(row)
            .enumerate()
            .for_each(|(y, from)| reversed[(19 - y) * stride..][..row].copy_from_slice(from));
        let first = reversed[19 * stride..].as_ptr().cast();
        let upward = EnvironmentConfig { pixels: first, row_stride: -4 * stride as isize, ..map.config(16, flags) };
        assert!(build(&upward).unwrap().bytes() == packed.bytes());
    }
    let config =
        EnvironmentConfig { pixels: null(), row: Some(no_row), row_user: null_mut(), ..sky(64, 8).config(8, 0) };
    let (status, diagnostic) = build(&config).err().unwrap();
    assert_eq!((status, diagnostic.y), (Status::CallbackFailed, 3));
}

/// Three channels weigh as luminance; the fourth is ignored.
#[test]
fn colours_weigh_as_luminance() {
    let map = random_map(30, 20, 4);
    let luminance =
        |texel: &[f32]| (0..3).map(|c| [0.2126, 0.7152, 0.0722][c] * f64::from(texel[c])).sum::<f64>() as f32;
    let grey = Map { channels: 1, pixels: map.pixels.chunks(4).map(luminance).collect(), ..map.clone() };
    let [a, b] = [&map, &grey].map(|map| map.build(32, 0));
    assert!((a.info.power / b.info.power - 1.0).abs() < 1e-6);
    for (i, j) in pairs(32) {
        let [a, b] = [&a, &b].map(|e| radiance(e, middle(32, i, j)));
        assert!((a / b - 1.0).abs() < 1e-5, "{a} {b}");
    }
}

const BAD: [(f32, f32); 3] = [(f32::NAN, 0.0), (f32::NEG_INFINITY, 0.0), (f32::INFINITY, 65504.0)];

/// Bad texels count once each, and the map is the one with their replacements: 0, or the largest half float.
#[test]
fn bad_texels_are_replaced_and_counted() {
    let mut map = random_map(30, 20, 1);
    let mut mended = map.clone();
    for (k, (bad, replacement)) in BAD.into_iter().cycle().take(10).enumerate() {
        (map.pixels[37 * k + 5], mended.pixels[37 * k + 5]) = (bad, replacement);
    }
    let environment = map.build(64, WIS_WAVELET_LIGHT_SANITISE);
    assert_eq!(environment.info.sanitised, 10);
    let expected = mended.build(64, WIS_WAVELET_LIGHT_SANITISE);
    assert_eq!((expected.info.sanitised, expected.info.power), (0, environment.info.power));
    for (i, j) in pairs(64) {
        let [a, b] = [&environment, &expected].map(|e| e.pdf(None, middle(64, i, j)));
        assert_eq!(a, b);
    }
    let negative = Map::latlong(4, 2, |x, _| if x == 1 { -1.0 } else { 1.0 }).build(4, 0);
    let black = Map::latlong(4, 2, |x, _| if x == 1 { 0.0 } else { 1.0 }).build(4, 0);
    assert_eq!((negative.info.sanitised, negative.info.power), (2, black.info.power));
}

#[test]
fn bad_texels_are_rejected_with_their_place() {
    for (bad, _) in BAD {
        for channels in [1, 3, 4] {
            let mut map = random_map(30, 20, channels);
            map.pixels[((13 * 30 + 21) * channels) as usize] = bad;
            map.pixels[((17 * 30 + 3) * channels) as usize] = bad;
            let (status, diagnostic) = build(&map.config(16, 0)).err().unwrap();
            assert_eq!(status, Status::InvalidTexel);
            assert_eq!((diagnostic.argument, diagnostic.x, diagnostic.y), (1, 21, 13));
        }
    }
    // Alpha is not light.
    let mut map = random_map(30, 20, 4);
    map.pixels.iter_mut().skip(3).step_by(4).for_each(|alpha| *alpha = f32::NAN);
    assert!(build(&map.config(16, 0)).is_ok());
}

/// Radiance at both ends of f32 is a density like any other.
#[test]
fn extreme_radiance_is_sampled() {
    let mut random = Random(131);
    for scale in [f32::MAX, 1e30, 1e-30, f32::MIN_POSITIVE, f32::from_bits(1)] {
        let map = Map::latlong(16, 8, |x, y| if (x + y) % 3 == 0 { scale } else { 0.0 });
        let environment = map.build(32, EXACT);
        let expected = f64::from(scale)
            * Map::latlong(16, 8, |x, y| if (x + y) % 3 == 0 { 1.0 } else { 0.0 }).build(32, EXACT).info.power;
        assert!((environment.info.power / expected - 1.0).abs() < 1e-6, "{scale}");
        for _ in 0..1000 {
            let sample = environment.sample(None, [random.f32(), random.f32()]);
            assert!(sample.pdf > 0.0 && sample.pdf.is_finite());
            assert!(map.radiance(Filter::Bilinear, sample.wi.map(f64::from))[0] >= 0.0);
        }
    }
}

/// The variance of radiance / pdf, relative to the square of its mean, for a client without filter.
fn relative_variance(map: &Map, environment: &Environment) -> f64 {
    let (mut random, mut mean, mut square) = (Random(31), 0.0, 0.0);
    const COUNT: u32 = 20_000;
    for _ in 0..COUNT {
        let sample = environment.sample(None, [random.f32(), random.f32()]);
        assert_eq!(environment.pdf(None, sample.wi), sample.pdf);
        let radiance = map.radiance(Filter::Nearest, unit(sample.wi.map(f64::from)))[0];
        let weight = radiance / f64::from(sample.pdf);
        mean += weight / f64::from(COUNT);
        square += weight * weight / f64::from(COUNT);
    }
    square / (mean * mean) - 1.0
}

/// A sun of one texel shares no cell with the dark if the resolution is left to the library: sampling it has at most
/// a tenth of the variance that cells of about a texel have. A stated resolution is kept to, and so are flat maps.
#[test]
fn cells_are_refined_where_light_varies() {
    for map in [one_texel(21, 12), one_texel(5, 0), one_texel(63, 16)] {
        let (refined, plain) = (map.build(0, WIS_WAVELET_LIGHT_NEAREST), map.build(64, WIS_WAVELET_LIGHT_NEAREST));
        let [own, other] = [&refined, &plain].map(|environment| relative_variance(&map, environment));
        println!("relative variance {own:.4}, of whole cells {other:.4}");
        assert!(own < 0.1 && own < 0.1 * other, "{own} {other}");
        assert_eq!(plain.info.squares, (64 * 64 - 1) / 3);
        assert!((refined.info.power / plain.info.power - 1.0).abs() < 1e-12);
        assert_eq!(refined.info.resolution, 64);
    }
    let flat = Map::latlong(64, 32, |_, _| 0.7);
    assert_eq!(flat.build(0, 0).bytes(), flat.build(64, 0).bytes());
}

/// Corners of lamps that reach into dark cells are worth no more than 32 times the mean, but for what is stored above it.
#[test]
fn slivers_of_lamps_give_no_fireflies() {
    let (width, height) = (72, 36);
    let lamp = |x: u32, y: u32| (x * 7 + y * 11) % 97 == 0;
    let map = Map::latlong(width, height, |x, y| if lamp(x, y) { 500.0 } else { 0.1 });
    let environment = map.build(0, WIS_WAVELET_LIGHT_NEAREST);
    let mut largest = 0.0f64;
    let lamps = pairs(width.max(height)).filter(|&(x, y)| y < height && lamp(x, y));
    for (x, y) in lamps {
        // Just inside of the borders, and at places between them.
        let places = [1e-4, 1e-3, 0.02, 0.1, 0.5, 0.9, 0.98, 0.999, 0.9999];
        for (dx, dy) in places.iter().flat_map(|dx| places.map(|dy| (dx, dy))) {
            let phi = std::f64::consts::TAU * (f64::from(x) + dx) / f64::from(width);
            let theta = std::f64::consts::PI * (f64::from(y) + dy) / f64::from(height);
            let wi = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
            let radiance = map.radiance(Filter::Nearest, wi)[0];
            assert!(radiance > 400.0);
            let pdf = f64::from(environment.pdf(None, wi.map(|c| c as f32)));
            largest = largest.max(radiance / (pdf * environment.info.power));
        }
    }
    println!("the largest weight is {largest:.1}");
    assert!(largest < 40.0, "{largest}");
}

fn sparse(map: &Map, resolution: u32, error_budget: f32, flags: u32) -> Environment {
    build(&EnvironmentConfig { storage: WIS_STORAGE_SPARSE, error_budget, ..map.config(resolution, flags) }).unwrap()
}

/// The variance of the power estimated from samples of `approximation`, relative to its square: what it is by the
/// cells of the exact pyramid.
fn added_variance(exact: &Environment, approximation: &Environment, cells: u32) -> f64 {
    let share = |(i, j)| {
        let [p, q] = [exact, approximation].map(|e| f64::from(e.pdf(None, middle(cells, i, j))));
        p * p / q
    };
    pairs(cells).map(share).sum::<f64>() * 4.0 * std::f64::consts::PI / f64::from(cells * cells) - 1.0
}

/// A smooth sky takes kilobytes in sparse storage, and costs no more variance than the budget.
#[test]
fn sparse_storage_of_a_smooth_sky_takes_kilobytes() {
    let map = sky(1024, 512);
    let pyramid = map.build(512, 0);
    for (budget, most) in [(1e-2, 1 << 12), (1e-3, 1 << 15), (1e-4, 1 << 18)] {
        let environment = sparse(&map, 512, budget, 0);
        let variance = added_variance(&pyramid, &environment, 512);
        println!(
            "budget {budget}: {} bytes ({} as a pyramid), variance {variance:.2e}, stated {:.2e}",
            environment.info.bytes, pyramid.info.bytes, environment.info.error
        );
        assert!(environment.info.bytes <= most && environment.info.error <= f64::from(budget));
        assert!((variance - environment.info.error).abs() <= 0.02 * environment.info.error + 1e-6);
        assert!((environment.info.power / pyramid.info.power - 1.0).abs() < 1e-12);
    }
}

/// In sparse storage a sample carries its pdf, inversion leads back, and with a budget of 0 the density is that of
/// the pyramid.
#[test]
fn sparse_storage_is_a_distribution_as_well() {
    let mut random = Random(137);
    for map in [sky(128, 64), random_map(128, 64, 3), one_texel(20, 9)] {
        let pyramid = map.build(64, 0);
        for budget in [0.0, 1e-3, 0.03, 1.0] {
            let environment = sparse(&map, 64, budget, 0);
            assert!(environment.info.error <= f64::from(budget));
            for _ in 0..5000 {
                let u = [random.f32(), random.f32()];
                let sample = environment.sample(None, u);
                assert_eq!(sample.pdf.to_bits(), environment.pdf(None, sample.wi).to_bits());
                assert!(sample.pdf > 0.0 && sample.pdf.is_finite());
                let back = environment.invert(None, sample.wi).unwrap();
                assert!((0..2).all(|q| (back[q] - u[q]).abs() < 1e-3), "{u:?} {back:?}");
                let exact = pyramid.pdf(None, sample.wi);
                assert!(budget > 0.0 || sample.pdf == exact, "{} {exact}", sample.pdf);
            }
        }
    }
}
