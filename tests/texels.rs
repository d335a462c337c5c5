//! The compensated distribution that keeps the texels of a map: its tables, its directions, its densities.

use crate::support;
use crate::support::maps::sky;
use crate::support::scenes::matrices;
use crate::support::vector::{rotate, single};
use crate::support::{Environment, Map, Random, lane_points, normalise};
use std::f64::consts::{PI, TAU};
use wis::ffi::wavelets::environment::{
    WIS_DISTRIBUTION_COMPENSATED, WIS_LAYOUT_CUBE, WIS_LAYOUT_OCTAHEDRAL, WIS_WAVELET_LIGHT_COMPENSATED,
    WIS_WAVELET_LIGHT_EXACT_ZERO, WIS_WAVELET_LIGHT_NEAREST,
};
use wis::points::sobol;
use wis::simd::{Kernel, Lanes, Level, Native, Portable, run};
use wis::sphere::{
    Frame, cube_direction, cube_solid_angle, direction, direction_f64, latlong_direction, latlong_solid_angle, square,
};
use wis::wavelets::descent::{Sample, Sampled};
use wis::wavelets::environment::{Cube, Inverse, LatLong, Octahedral, RowNumbers, Shape, TexelMap};
use wis::wavelets::wide::{InLanes, TOGETHER};

const FLAGS: u32 = WIS_WAVELET_LIGHT_COMPENSATED | WIS_WAVELET_LIGHT_NEAREST;

/// Positions are multiples of 2^-30.
const WHOLE: f64 = (1 << 30) as f64;
const ROWS: u32 = 23;
const COLUMNS: u32 = 37;
const SIZE: [u32; 2] = [ROWS, COLUMNS];

/// The weight of a texel by row and column.
type Weight = fn([u32; 2]) -> f64;

/// Weights as maps have them: smooth, dark in places, one texel or row alone, or spread over many orders of magnitude.
fn weights() -> Vec<(&'static str, Weight)> {
    vec![
        ("constant", |_| 1.0),
        ("smooth", |[i, j]| 1.0 + f64::from(i * j) / 10.0),
        ("a sun", |texel| if texel == [7, 30] { 1e30 } else { 1.0 }),
        ("one texel", |texel| if texel == [ROWS - 1, COLUMNS - 1] { 1e-20 } else { 0.0 }),
        ("one row", |[i, j]| if i == 0 { f64::from(j % 3) } else { 0.0 }),
        ("stripes", |[i, j]| if (i + j) % 2 == 0 { f64::from(1 + j % 4) } else { 0.0 }),
        ("many sizes", |[i, j]| f64::from(sobol(4, i * COLUMNS + j)[0] * 80.0 - 40.0).exp2()),
    ]
}

/// The tables of a distribution.
struct Tables {
    size: [u32; 2],
    starts: Vec<u32>,
    guides: Vec<u16>,
    rows: Vec<RowNumbers>,
    mean: f64,
}

impl Tables {
    fn new<S: Shape>(size: [u32; 2], value: impl Fn([u32; 2]) -> f64) -> Tables {
        let [starts, guides] = Inverse::lengths(size).map(|len| len as usize);
        // Nothing of what stood there before may remain.
        let (mut starts, mut guides) = (vec![u32::MAX; starts], vec![u16::MAX; guides]);
        let mut rows = vec![[f32::NAN; 4]; size[0] as usize];
        let mean = TexelMap::<S>::fill(size, (&mut starts, &mut guides, &mut rows), value);
        Tables { size, starts, guides, rows, mean }
    }

    fn inverse(&self) -> Inverse<'_> {
        Inverse::trusted(self.size, &self.starts, &self.guides)
    }

    fn texels<S: Shape>(&self) -> TexelMap<'_, S> {
        let texels = TexelMap::trusted(self.mean as f32, self.inverse(), &self.rows);
        assert!(texels.is_sound());
        texels
    }
}

/// The probability of a cell is its share of the weight; not below 2^-24 in its row or column, unless it is 0.
#[test]
fn widths_are_shares() {
    for (name, weight) in weights() {
        let tables = Tables::new::<LatLong>(SIZE, weight);
        let (inverse, solid) = (tables.inverse(), |i| latlong_solid_angle(COLUMNS, ROWS, i));
        let row = |i: u32| (0..COLUMNS).map(|j| weight([i, j]) * solid(i)).sum::<f64>();
        let sum: f64 = (0..ROWS).map(row).sum();
        assert!((tables.mean * 4.0 * PI / sum - 1.0).abs() < 1e-6, "{name}");
        let check = |width: u32, share: f64, cells: u32| {
            let raised = if share > 0.0 { share.max(2f64.powi(-24)) } else { 0.0 };
            // Those that are raised take from the others; starts and single weights are rounded.
            let allowed = f64::from(cells) * 2f64.powi(-24) * share + 2.0 / WHOLE + 1e-6 * share;
            assert!((f64::from(width) / WHOLE - raised).abs() <= allowed, "{name}: {share} {width}");
            assert!(width == 0 || width >= 64, "{name}");
        };
        for i in 0..ROWS {
            check(inverse.row(i).width, row(i) / sum, ROWS);
            for j in (0..COLUMNS).filter(|_| row(i) > 0.0) {
                check(inverse.column(i, j).width, weight([i, j]) * solid(i) / row(i), COLUMNS);
            }
        }
    }
}

/// Positions lead to the cell that contains them, wherever in it: also the first and the last of each.
#[test]
fn positions_lead_to_their_cells() {
    for (name, weight) in weights() {
        let tables = Tables::new::<LatLong>(SIZE, weight);
        let inverse = tables.inverse();
        let lit = (0..ROWS).filter(|&i| inverse.row(i).width > 0).map(Some);
        for row in [None].into_iter().chain(lit) {
            let (cells, mut reached) = (if row.is_some() { COLUMNS } else { ROWS }, 0);
            for cell in 0..cells {
                let span = row.map_or(inverse.row(cell), |row| inverse.column(row, cell));
                assert_eq!((span.cell, span.start), (cell, reached), "{name}");
                reached += span.width;
                for offset in [0, 1, span.width / 3, span.width / 2, span.width - span.width.min(1)] {
                    if span.width == 0 {
                        continue;
                    }
                    let position = span.start + offset;
                    let found =
                        row.map_or_else(|| inverse.find_row(position), |row| inverse.find_column(row, position));
                    assert_eq!(found, span, "{name} {row:?}");
                    let inside = found.inside(position);
                    assert!((0.0..1.0).contains(&inside) && (inside - offset as f32 / span.width as f32).abs() < 1e-6);
                    let back = f64::from(found.undo(inside)) * WHOLE - f64::from(position);
                    assert!(back.abs() <= 64.0 + f64::from(span.width) / 8_388_608.0, "{name}: {back}");
                }
            }
            assert_eq!(f64::from(reached), WHOLE);
        }
    }
}

/// Tables with any one number changed are not what is written.
#[test]
fn changed_tables_are_not_sound() {
    let mut tables = Tables::new::<LatLong>([3, 5], |[i, j]| f64::from(i + 2 * j));
    let sound = |t: &Tables| TexelMap::<LatLong>::trusted(t.mean as f32, t.inverse(), &t.rows).is_sound();
    assert!(sound(&tables));
    for i in 0..tables.guides.len() {
        tables.guides[i] ^= 1;
        assert!(!sound(&tables), "guide {i}");
        tables.guides[i] ^= 1;
    }
    for (i, k) in (0..3).flat_map(|i| (0..4).map(move |k| (i, k))) {
        let before = tables.rows[i][k];
        tables.rows[i][k] = before.abs() + 1e-3;
        assert!(!sound(&tables), "row {i}");
        tables.rows[i][k] = before;
    }
    for i in 0..tables.starts.len() {
        let before = tables.starts[i];
        tables.starts[i] = 1 << 31;
        assert!(!sound(&tables), "start {i}");
        tables.starts[i] = before;
    }
    assert!(sound(&tables));
}

/// Every texel has another value, from map to map in other sizes: odd, one row, one column, one texel, and large.
fn varied(width: u32, height: u32) -> Map {
    let mut random = Random(u64::from(width * 7 + height));
    Map::latlong(width, height, |_, _| random.f32().powi(6) * 1e3 + 1e-3)
}

const SIZES: [(u32, u32); 9] = [(1, 1), (1, 5), (7, 1), (2, 2), (3, 2), (5, 3), (37, 23), (64, 32), (1000, 500)];

fn pdf(environment: &Environment, matrix: Option<&[f32; 9]>, wi: [f32; 3]) -> f64 {
    f64::from(environment.pdf(WIS_DISTRIBUTION_COMPENSATED, matrix, wi))
}

/// The density in a texel is max(L - mean, L / 64) over its integral, with L of the map itself, from border to border.
#[test]
fn densities_are_those_of_texels() {
    for (width, height) in SIZES {
        let map = varied(width, height);
        let environment = map.build(0, FLAGS);
        let radiance = |x: u32, y: u32| f64::from(map.pixels[(y * width + x) as usize]);
        let solid = |y: u32| latlong_solid_angle(width, height, y);
        let texels = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let mean = texels().map(|(x, y)| radiance(x, y) * solid(y)).sum::<f64>() / (4.0 * PI);
        let value = |x: u32, y: u32| (radiance(x, y) - mean).max(radiance(x, y) / 64.0);
        let power: f64 = texels().map(|(x, y)| value(x, y) * solid(y)).sum();
        assert!((environment.power(WIS_DISTRIBUTION_COMPENSATED) / power - 1.0).abs() < 1e-5, "{width} x {height}");
        // Rare texels get a little more, so that some u leads to them; others less.
        let allowed = |share: f64| 1e-4 + 2f64.powi(-20) / share.min(1.0);
        for (x, y) in texels().filter(|(x, y)| (width * height < 5000) || (x * 31 + y * 17) % 97 == 0) {
            for (a, b) in [(0.5, 0.5), (0.003, 0.02), (0.997, 0.98)] {
                let place = [(f64::from(x) + a) / f64::from(width), (f64::from(y) + b) / f64::from(height)];
                let found = pdf(&environment, None, single(latlong_direction(place)));
                let expected = value(x, y) / power;
                let share = value(x, y) * solid(y) / power;
                assert!((found / expected - 1.0).abs() < allowed(share), "{x} {y} of {width} x {height}: {found}");
            }
        }
    }
}

/// A cube map with another value in every texel.
fn varied_cube(width: u32) -> Map {
    Map { layout: WIS_LAYOUT_CUBE, ..varied(width, 6 * width) }
}

/// So it is for a cube map, up to the Jacobian of its faces, and integrates to 1.
#[test]
fn densities_are_those_of_texels_of_a_cube() {
    for width in [1, 2, 5, 64] {
        let map = varied_cube(width);
        let environment = map.build(0, FLAGS);
        let edges = |i: u32| [i, i + 1].map(|i| 2.0 * f64::from(i) / f64::from(width) - 1.0);
        let texels = || (0..6 * width).flat_map(|y| (0..width).map(move |x| (x, y)));
        let radiance = |x: u32, y: u32| f64::from(map.pixels[(y * width + x) as usize]);
        let solid = |x: u32, y: u32| cube_solid_angle(edges(x), edges(y % width));
        let mean = texels().map(|(x, y)| radiance(x, y) * solid(x, y)).sum::<f64>() / (4.0 * PI);
        let value = |x: u32, y: u32| (radiance(x, y) - mean).max(radiance(x, y) / 64.0);
        let power: f64 = texels().map(|(x, y)| value(x, y) * solid(x, y)).sum();
        // The mean over cells of the square is that over a cube's texels within 1e-5 or so, times what is above it.
        assert!((environment.power(WIS_DISTRIBUTION_COMPENSATED) / power - 1.0).abs() < 3e-4, "{width}");
        for (x, y) in texels().filter(|(x, y)| width < 9 || (x * 31 + y * 17) % 19 == 0) {
            // Uniform on the plane: 1 over the area of the texel there, times 1 / m^3.
            let share = value(x, y) * solid(x, y) / power;
            let on_plane = share * (f64::from(width) / 2.0).powi(2);
            for (a, b) in [(0.5, 0.5), (0.01, 0.02), (0.99, 0.98)] {
                let [s, t] = [(x, a), (y % width, b)].map(|(i, c)| edges(i)[0] + 2.0 * c / f64::from(width));
                let d = cube_direction(y / width, s, t);
                let expected = on_plane * (1.0 + s * s + t * t).powf(1.5);
                let found = pdf(&environment, None, normalise(d));
                let allowed = 1e-3 + 2f64.powi(-20) / share.min(1.0);
                assert!((found / expected - 1.0).abs() < allowed, "{x} {y} of {width}: {found} {expected}");
            }
        }
    }
}

/// An octahedral map with another value in every texel.
fn varied_square(width: u32) -> Map {
    Map { layout: WIS_LAYOUT_OCTAHEDRAL, ..varied(width, width) }
}

/// So it is for an octahedral map, whose texels all have one solid angle.
#[test]
fn densities_are_those_of_texels_of_the_square() {
    for width in [1, 2, 5, 64, 100] {
        let map = varied_square(width);
        let environment = map.build(0, FLAGS);
        let texels = || (0..width).flat_map(|y| (0..width).map(move |x| (x, y)));
        let radiance = |x: u32, y: u32| f64::from(map.pixels[(y * width + x) as usize]);
        let solid = 4.0 * PI / f64::from(width * width);
        let mean = texels().map(|(x, y)| radiance(x, y) * solid).sum::<f64>() / (4.0 * PI);
        let value = |x: u32, y: u32| (radiance(x, y) - mean).max(radiance(x, y) / 64.0);
        let power: f64 = texels().map(|(x, y)| value(x, y) * solid).sum();
        assert!((environment.power(WIS_DISTRIBUTION_COMPENSATED) / power - 1.0).abs() < 1e-5, "{width}");
        for (x, y) in texels() {
            let expected = value(x, y) / power;
            for (a, b) in [(0.5, 0.5), (0.01, 0.02), (0.99, 0.98)] {
                let place = [f64::from(x) + a, f64::from(y) + b].map(|c| c / f64::from(width));
                let found = pdf(&environment, None, single(direction_f64(place)));
                let allowed = 1e-4 + 2f64.powi(-20) / (expected * solid).min(1.0);
                assert!((found / expected - 1.0).abs() < allowed, "{x} {y} of {width}: {found} {expected}");
            }
        }
    }
}

/// To a client with a filter light varies inside texels: cells of the square, which are smaller, follow it better.
#[test]
fn clients_with_a_filter_get_cells() {
    let map = varied(64, 32);
    let bytes = |flags: u32, resolution: u32| map.build(resolution, flags).info.bytes;
    assert_eq!(bytes(WIS_WAVELET_LIGHT_COMPENSATED, 0), bytes(WIS_WAVELET_LIGHT_COMPENSATED, 64));
}

/// A sample's pdf is that of its direction to the bit, wherever in a texel u leads to: a neighbour has another.
#[test]
fn samples_stay_in_their_texels() {
    let mut random = Random(47);
    let latlong = SIZES.into_iter().chain([(2048, 1024)]).map(|(width, height)| varied(width, height));
    let others = [1, 2, 7, 128].map(varied_cube).into_iter().chain([1, 2, 7, 128, 1000].map(varied_square));
    for map in latlong.chain(others) {
        let (width, height) = (map.width, map.height);
        let environment = map.build(0, FLAGS);
        for matrix in matrices() {
            for _ in 0..if width > 100 { 200_000 } else { 20_000 } {
                let mut u = [random.f32(), random.f32()];
                if random.f32() < 0.5 {
                    // Next to a border, or at it.
                    let place = [0, 1].map(|_| f64::from((random.f32() * 3.0).round() - 1.0) * 1e-8);
                    let texel = [width, height].map(|n| (random.f64() * f64::from(n)).floor() / f64::from(n));
                    let d = if map.layout == WIS_LAYOUT_CUBE {
                        let face = (texel[1] * 6.0) as u32;
                        let [s, t] = [texel[0] * 2.0 - 1.0, texel[1] * 12.0 - f64::from(2 * face) - 1.0];
                        support::vector::unit(cube_direction(face, s + place[0], t + place[1]))
                    } else if map.layout == WIS_LAYOUT_OCTAHEDRAL {
                        direction_f64([0, 1].map(|k| (texel[k] + place[k]).clamp(0.0, 1.0)))
                    } else {
                        latlong_direction([texel[0] + place[0], (texel[1] + place[1]).clamp(0.0, 1.0)])
                    };
                    let wi = single(rotate(&matrix, d));
                    let inverted = environment.invert(WIS_DISTRIBUTION_COMPENSATED, Some(&matrix), wi);
                    u = inverted.expect("every texel is lit");
                }
                let sample = environment.sample(WIS_DISTRIBUTION_COMPENSATED, Some(&matrix), u);
                let asked = environment.pdf(WIS_DISTRIBUTION_COMPENSATED, Some(&matrix), sample.wi);
                assert_eq!(sample.pdf.to_bits(), asked.to_bits(), "{width} x {height}: {u:?} {sample:?}");
                assert!(sample.pdf > 0.0 && sample.pdf < f32::MAX);
            }
        }
    }
}

/// Inversion leads back, within what rounding moves a direction in its texel.
#[test]
fn inversion_leads_back() {
    let (mut random, tables) = (Random(67), Tables::new::<LatLong>(SIZE, |[i, j]| f64::from(i * i + 3 * j + 1)));
    let (texels, inverse) = (tables.texels::<LatLong>(), tables.inverse());
    for matrix in matrices() {
        let frame = Frame::new(&matrix).unwrap();
        for _ in 0..20_000 {
            let u = [random.f32(), random.f32()];
            let back = texels.invert(&frame, texels.sample(&frame, u).wi).unwrap();
            let row = inverse.find_row((f64::from(u[0]) * WHOLE) as u32);
            let column = inverse.find_column(row.cell, (f64::from(u[1]) * WHOLE) as u32);
            let borders = [4e-6 / PI * f64::from(ROWS), f64::from(tables.rows[row.cell as usize][3])];
            for ((back, u), (span, border)) in back.iter().zip(u).zip([row, column].iter().zip(borders)) {
                let allowed = f64::from(span.width) / WHOLE * 2.0 * border + 2.0 / 16_777_216.0;
                assert!(f64::from((back - u).abs()) <= allowed, "{u} {back}");
            }
        }
    }
}

/// Every texel that has weight is reached by the u that inversion gives, under a sun that outshines it by 10^20.
#[test]
fn every_texel_is_reached() {
    let mut map = varied(37, 23);
    map.pixels[5 * 37 + 9] = 1e20;
    let environment = map.build(0, FLAGS | WIS_WAVELET_LIGHT_EXACT_ZERO);
    for (x, y) in (0..23).flat_map(|y| (0..37).map(move |x| (x, y))) {
        let place = [(f64::from(x) + 0.5) / 37.0, (f64::from(y) + 0.5) / 23.0];
        let wi = single(latlong_direction(place));
        let u = environment.invert(WIS_DISTRIBUTION_COMPENSATED, None, wi).expect("the texel is lit");
        let sample = environment.sample(WIS_DISTRIBUTION_COMPENSATED, None, u);
        assert_eq!(sample.pdf, environment.pdf(WIS_DISTRIBUTION_COMPENSATED, None, wi), "{x} {y}");
        let [a, b, c] = sample.wi.map(f64::from);
        // Rounding counts less than a thousandth of a texel.
        let along = (b.atan2(a) / TAU - place[0] + 1.5).rem_euclid(1.0) - 0.5;
        let apart = [along * 37.0, (c.acos() / PI - place[1]) * 23.0];
        assert!(apart.iter().all(|apart| apart.abs() < 0.501), "{x} {y}: {apart:?}");
    }
}

/// Samples of a texel alone are uniform in it, and inversion leads back within what is allowed. `place` tells where in the
/// texel, down and along, a direction lies.
fn assert_uniform<S: Shape>(size: [u32; 2], texel: [u32; 2], allowed: f32, place: impl Fn([f32; 3]) -> [f64; 2]) {
    let tables = Tables::new::<S>(size, |t| if t == texel { 1.0 } else { 0.0 });
    let texels = tables.texels::<S>();
    let (mut mean, mut square, count) = ([0.0; 2], [0.0; 2], 1 << 12);
    for i in 0..count {
        let u = sobol(3, i);
        let wi = texels.sample(&Frame::IDENTITY, u).wi;
        let back = texels.invert(&Frame::IDENTITY, wi).unwrap();
        assert!((0..2).all(|k| (back[k] - u[k]).abs() < allowed), "{texel:?}: {u:?} {back:?}");
        for (k, place) in place(wi).into_iter().enumerate() {
            assert!((-1e-5..1.00001).contains(&place), "{texel:?}: {place}");
            mean[k] += place / f64::from(count);
            square[k] += place * place / f64::from(count);
        }
    }
    for k in [0, 1] {
        assert!((mean[k] - 0.5).abs() < 2e-3 && (square[k] - 1.0 / 3.0).abs() < 2e-3, "{texel:?}: {mean:?}");
    }
}

/// Also at the poles, where inversion knows no azimuth, and across the equator of an odd number of rows.
#[test]
fn directions_are_uniform_in_a_texel() {
    for (texel, height) in [([0, 3], 8), ([7, 1], 8), ([2, 6], 5), ([0, 0], 1)] {
        assert_uniform::<LatLong>([height, 8], texel, 1.0, |wi| {
            let ([row, column], [x, y, z]) = (texel, wi.map(f64::from));
            let edge = |k: u32| (PI * f64::from(k) / f64::from(height)).cos();
            let down = (edge(row) - z) / (edge(row) - edge(row + 1));
            [down, (y.atan2(x) / TAU).rem_euclid(1.0) * 8.0 - f64::from(column)]
        });
    }
}

/// Of a cube map they are uniform on the plane of the face.
#[test]
fn directions_are_uniform_on_a_face() {
    for face in 0..6 {
        // The texel is the middle of the last column, as wide as a third of the face.
        assert_uniform::<Cube>([18, 3], [3 * face + 1, 2], 1e-5, |wi| {
            let (found, [s, t]) = wis::sphere::cube(wi.map(f64::from));
            assert_eq!(found, face);
            [t * 3.0 - 1.0, s * 3.0 - 2.0]
        });
    }
}

/// Of an octahedral map they are uniform on the square, also at its folded edges.
#[test]
fn directions_are_uniform_on_the_square() {
    for texel in [[0, 0], [0, 2], [2, 2], [4, 1], [3, 4]] {
        assert_uniform::<Octahedral>([5, 5], texel, 5e-5, |wi| {
            let [along, down] = square(wi.into()).map(|c| f64::from(c) * 5.0);
            [down - f64::from(texel[0]), along - f64::from(texel[1])]
        });
    }
}

/// A step on the sphere is at most .62 as long on the square: what keeps samples in their texels counts on it.
#[test]
fn the_square_does_not_stretch() {
    let mut random = Random(5);
    for _ in 0..200_000 {
        let s = [random.f32(), random.f32()];
        let turn = TAU * random.f64();
        let moved = [s[0] + 1e-3 * turn.cos() as f32, s[1] + 1e-3 * turn.sin() as f32];
        if moved.iter().all(|c| (0.0..1.0).contains(c)) {
            let step = f64::from(direction(s).distance(direction(moved)));
            let longest = (0..2).map(|k| f64::from(moved[k] - s[k]).abs()).fold(0.0, f64::max);
            assert!(longest < 0.625 * step, "{s:?} {moved:?}: {longest} {step}");
        }
    }
}

/// Black light gives no samples, in lanes or alone.
#[test]
fn black_has_no_samples() {
    let environment = sky(64, 32);
    let black = Map { pixels: vec![0.0; environment.pixels.len()], ..environment };
    let environment = black.build(0, FLAGS | WIS_WAVELET_LIGHT_EXACT_ZERO);
    assert_eq!(environment.sample(WIS_DISTRIBUTION_COMPENSATED, None, [0.3, 0.7]).pdf, 0.0);
    assert_eq!(pdf(&environment, None, [0.0, 0.0, 1.0]), 0.0);
    assert_eq!(environment.invert(WIS_DISTRIBUTION_COMPENSATED, None, [0.0, 0.0, 1.0]), None);
    let tables = Tables::new::<LatLong>(SIZE, |_| 0.0);
    let (mut samples, mut values) = ([Sample { wi: [1.0; 3], pdf: 1.0 }; 9], [1.0; 9]);
    tables.texels::<LatLong>().sample_lanes::<Portable>(&Frame::IDENTITY, &[[0.5; 2]; 9], &mut samples);
    tables.texels::<LatLong>().pdf_lanes::<Portable>(&Frame::IDENTITY, &[[0.0, 0.0, 1.0]; 9], &mut values);
    assert!(samples.iter().all(|sample| *sample == Sample::default()) && values == [0.0; 9]);
}

fn same_in_lanes<F: Lanes, S: Shape>(size: [u32; 2]) {
    let turned = Frame::new(&[0.36, 0.48, -0.8, -0.8, 0.6, 0.0, 0.48, 0.64, 0.6]).unwrap();
    for ((_, weight), frame) in weights().into_iter().flat_map(|w| [(w, Frame::IDENTITY), (w, turned)]) {
        let tables = Tables::new::<S>(size, |[i, j]| weight([i % ROWS, j % COLUMNS]));
        let texels = tables.texels::<S>();
        for first in (0..1 << 14).step_by(TOGETHER) {
            let u = lane_points(first);
            let mut samples = vec![Sample::default(); u.len()];
            texels.sample_lanes::<F>(&frame, &u, &mut samples);
            let expected: Vec<Sample> = u.iter().map(|u| texels.sample(&frame, *u)).collect();
            assert_eq!(samples, expected);
            let random = Random(first.into()).direction();
            let mut wi: Vec<[f32; 3]> = samples.iter().map(|sample| sample.wi).collect();
            (wi[0], *wi.last_mut().unwrap()) = (single(random), [0.5, f32::NAN, 2.0]);
            let expected: Vec<f32> = wi.iter().map(|wi| texels.pdf(&frame, *wi).unwrap_or(0.0)).collect();
            let mut values = vec![1.0; wi.len()];
            texels.pdf_lanes::<F>(&frame, &wi, &mut values);
            assert_eq!(values, expected);
        }
    }
}

struct SameInLanes;

impl Kernel for SameInLanes {
    type Output = ();

    fn run<F: Lanes>(self) {
        same_in_lanes::<F, LatLong>(SIZE);
        same_in_lanes::<F, Cube>([6 * 19, 19]);
        same_in_lanes::<F, Octahedral>([19, 19]);
    }
}

/// Eight lanes give the bits of single calls, on every kind of lanes that this processor has.
#[test]
fn lanes_are_single_calls() {
    SameInLanes.run::<Portable>();
    SameInLanes.run::<Native>();
    run(Level::detect(), SameInLanes);
}
