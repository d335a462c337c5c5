//! Directions and the square, lat-long and cube layouts: the vectors, round trips, folds, areas.

use crate::support::Random;
use crate::support::scenes::{matrices, rows};
use crate::support::sphere::{cube_solid_angle, direction_f64, latlong_direction};
use crate::support::vector::{self, V3, add, cross, distance, length, rotate, scale, single, sub};
use glam::Vec3;
use serde_json::Value;
use std::f64::consts::PI;
use wis::sphere::{Frame, SPHERE, cube, cube_direction, direction, latlong, latlong_solid_angle, square, unit};
use wis::wavelets::morton;

/// What f32 directions and points may be off: a few roundings.
const TOLERANCE: f64 = 4e-7;

fn vectors() -> Value {
    serde_json::from_str(include_str!("vectors/sphere.json")).unwrap()
}

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    let all: Vec<f64> = value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    all.try_into().unwrap()
}

fn list(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn to_square(d: V3) -> [f32; 2] {
    square(Vec3::from_array(single(d)))
}

fn to_direction(s: [f32; 2]) -> V3 {
    direction(s).to_array().map(f64::from)
}

#[test]
fn octahedral_vectors_both_ways() {
    for case in vectors()["octahedral"].as_array().unwrap() {
        let (s, d) = (numbers::<2>(&case["square"]), numbers::<3>(&case["dir"]));
        assert!(distance(direction_f64(s), d) < 1e-14, "{case}");
        assert!(distance(to_direction(s.map(|s| s as f32)), d) < TOLERANCE, "{case}");
        let back = to_square(d).map(f64::from);
        // The square is folded along its edges: there two points mean one direction.
        assert!(distance(direction_f64(back), d) < TOLERANCE, "{case} {back:?}");
        let inside = s.iter().all(|s| (1e-6..1.0 - 1e-6).contains(s));
        assert!(!inside || (0..2).all(|q| (back[q] - s[q]).abs() < TOLERANCE), "{case} {back:?}");
    }
}

#[test]
fn latlong_vectors_both_ways() {
    for case in vectors()["latlong"].as_array().unwrap() {
        let (uv, d) = (numbers::<2>(&case["uv"]), numbers::<3>(&case["dir"]));
        assert!(distance(latlong_direction(uv), d) < 1e-14, "{case}");
        let back = latlong(d);
        assert!(distance(latlong_direction(back), d) < 1e-14, "{case} {back:?}");
        let off = (back[0] - uv[0] + 0.5).rem_euclid(1.0) - 0.5;
        let pole = (PI * uv[1]).sin() < 1e-12;
        assert!((0.0..=1.0).contains(&back[0]) && (pole || off.abs() < 1e-14), "{case} {back:?}");
        assert!((back[1] - uv[1]).abs() < 1e-14, "{case} {back:?}");
    }
}

#[test]
fn solid_angles_are_those_of_the_vectors_and_cover_the_sphere() {
    let vectors = vectors();
    let case = &vectors["latlong_solid_angles"];
    let (w, h) = (case["w"].as_u64().unwrap() as u32, case["h"].as_u64().unwrap() as u32);
    for (row, expected) in (0..).zip(list(&case["rows"])) {
        assert!((latlong_solid_angle(w, h, row) / expected - 1.0).abs() < 1e-13, "row {row}");
    }
    let total: f64 = (0..512).map(|row| 1024.0 * latlong_solid_angle(1024, 512, row)).sum();
    assert!((total / (4.0 * PI) - 1.0).abs() < 1e-13);

    let case = &vectors["cube_solid_angles"];
    let n = case["n"].as_u64().unwrap() as usize;
    let range = |k: usize| [2.0 * k as f64 / n as f64 - 1.0, 2.0 * (k + 1) as f64 / n as f64 - 1.0];
    for (texel, expected) in list(&case["face"]).into_iter().enumerate() {
        let solid_angle = cube_solid_angle(range(texel % n), range(texel / n));
        assert!((solid_angle / expected - 1.0).abs() < 1e-13, "texel {texel}");
    }
    assert!((6.0 * cube_solid_angle([-1.0, 1.0], [-1.0, 1.0]) / (4.0 * PI) - 1.0).abs() < 1e-13);
}

/// Points whose coordinates are ends and middles of cells at any level, poles, folds and just beside them.
fn delicate_points() -> Vec<[f32; 2]> {
    let mut ends: Vec<f32> = (0..=64).map(|k| k as f32 / 64.0).collect();
    ends.extend((1..=23).map(|level| 1.0 / (1u32 << level) as f32));
    let beside = |s: f32| [f32::from_bits(s.to_bits().saturating_sub(1)), s, f32::from_bits(s.to_bits() + 1)];
    let all: Vec<f32> = ends.iter().flat_map(|&s| [s, 1.0 - s, 0.5 + 0.5 * s]).flat_map(beside).collect();
    all.iter().flat_map(|&x| all.iter().step_by(7).map(move |&y| [x, y])).filter(|s| s[0] < 1.0 && s[1] < 1.0).collect()
}

/// The distance in the square as it is folded: over an edge it goes on at the mirrored place of the same edge.
fn folded_distance(a: [f32; 2], b: [f32; 2]) -> f64 {
    let [a, b] = [a, b].map(|s| s.map(f64::from));
    let images = |[x, y]: [f64; 2]| [[x, y], [-x, 1.0 - y], [2.0 - x, 1.0 - y], [1.0 - x, -y], [1.0 - x, 2.0 - y]];
    // At a corner, two edges are crossed at once.
    let twice = images(b).into_iter().flat_map(images);
    twice.map(|b| (a[0] - b[0]).hypot(a[1] - b[1])).fold(f64::INFINITY, f64::min)
}

#[test]
fn points_come_back_from_the_sphere() {
    let mut random = Random(1);
    let anywhere = (0..1_000_000).map(|_| [random.f32().min(1.0 - f32::EPSILON / 2.0), random.f32() * 0.999_999]);
    for s in delicate_points().into_iter().chain(anywhere) {
        let d = direction(s);
        assert!((d.length() - 1.0).abs() < 3e-7, "{s:?} {d}");
        assert!(distance(to_direction(s), direction_f64(s.map(f64::from))) < TOLERANCE, "{s:?} {d}");
        let back = square(d);
        assert!(back.iter().all(|s| (0.0..1.0).contains(s)), "{s:?} {back:?}");
        assert!(folded_distance(s, back) < TOLERANCE, "{s:?} {back:?}");
    }
}

#[test]
fn directions_come_back_from_the_square() {
    let mut random = Random(2);
    let anywhere = (0..1_000_000).map(|_| random.direction());
    let tiny = [0.0, 1e-45, 1e-30, 1e-20, 1e-10, 1e-7, 1e-4].into_iter();
    let poles = tiny
        .flat_map(|e| [[e, 0.0, 1.0], [0.0, -e, 1.0], [e, e, -1.0], [-e, 0.5 * e, -1.0], [1.0, e, -e], [e, -1.0, e]]);
    for d in poles.chain(anywhere) {
        let s = to_square(d);
        assert!(s.iter().all(|s| (0.0..1.0).contains(s)), "{d:?} {s:?}");
        assert!(distance(to_direction(s), d) < 5e-7, "{d:?} {s:?}");
    }
}

/// A folded edge belongs to the cells of the lower Morton code, whichever of its two points a direction comes from.
#[test]
fn folded_edges_have_one_point() {
    const DEPTH: u32 = 12;
    let cell = |s: [f32; 2]| s.map(|s| ((s * (1u32 << DEPTH) as f32) as u32).min((1 << DEPTH) - 1));
    let code = |s| morton::encode(cell(s), DEPTH);
    // Middles of cells, and every 16th of each.
    for k in 1..16 << DEPTH {
        let t = k as f32 / (16u32 << DEPTH) as f32;
        for edge in [0.0, 1.0] {
            for [a, b] in [[[edge, t], [edge, 1.0 - t]], [[t, edge], [1.0 - t, edge]]] {
                let (s, other) = (square(direction(a)), square(direction(b)));
                assert_eq!(s.map(f32::to_bits), other.map(f32::to_bits), "{a:?} {b:?}");
                assert!(folded_distance(s, a) < TOLERANCE, "{a:?} {s:?}");
                assert!(k % 16 == 0 || code(s) == code(a).min(code(b)), "{a:?} {s:?}");
            }
        }
    }
    let corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]];
    assert!(corners.iter().all(|&corner| square(direction(corner)) == [0.0, 0.0]));
}

#[test]
fn the_sign_of_a_zero_does_not_matter() {
    for signs in 0..8 {
        for d in
            [[0.0, 0.0, 1.0], [0.0, 0.6, 0.8], [1.0, 0.0, 0.0], [0.6, 0.0, -0.8], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]]
        {
            let mut flipped: [f32; 3] = d;
            let zeros = flipped.iter_mut().enumerate().filter(|(q, c)| **c == 0.0 && signs >> q & 1 == 1);
            zeros.for_each(|(_, c)| *c = -0.0);
            let bits = |d: [f32; 3]| square(Vec3::from_array(d)).map(f32::to_bits);
            assert_eq!(bits(d), bits(flipped), "{d:?} {flipped:?}");
        }
    }
}

/// A small area of the square stands for 4 pi times that solid angle, everywhere.
#[test]
fn the_jacobian_is_4_pi() {
    assert_eq!(SPHERE, (4.0 * PI) as f32);
    let mut random = Random(3);
    let step = 1e-7;
    for _ in 0..100_000 {
        let [x, y] = [random.f64(), random.f64()];
        // The derivative jumps at the folds.
        let folds = [x, y, 1.0 - x, 1.0 - y, x - 0.5, y - 0.5, x + y - 0.5, x + y - 1.5, x - y - 0.5, y - x - 0.5];
        if folds.iter().any(|fold| fold.abs() < 3.0 * step) {
            continue;
        }
        let along = |d: [f64; 2]| {
            let ends = [1.0, -1.0].map(|sign| direction_f64([x + sign * step * d[0], y + sign * step * d[1]]));
            scale(sub(ends[0], ends[1]), 0.5 / step)
        };
        let jacobian = length(cross(along([1.0, 0.0]), along([0.0, 1.0])));
        assert!((jacobian / (4.0 * PI) - 1.0).abs() < 1e-6, "{x} {y} {jacobian}");
    }
}

#[test]
fn cubes_have_their_faces_where_opengl_has_them() {
    let axes =
        [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    // Where the columns and the rows of each face run.
    let columns =
        [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]];
    let down =
        [[0.0, -1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0], [0.0, -1.0, 0.0]];
    let mut random = Random(4);
    for face in 0..6 {
        let axis = face as usize;
        for _ in 0..1000 {
            let [s, t] = [0, 1].map(|_| 1.998 * random.f64() - 0.999);
            let d = cube_direction(face, s, t);
            assert_eq!(d, add(axes[axis], add(scale(columns[axis], s), scale(down[axis], t))));
            let (back, uv) = cube(vector::unit(d));
            assert_eq!(back, face);
            for (place, q) in [(s, 0), (t, 1)] {
                assert!((2.0 * uv[q] - 1.0 - place).abs() < 1e-14);
            }
        }
    }
}

#[test]
fn frames_are_rotations_and_reflections() {
    let mut random = Random(5);
    for number in 0..1000 {
        let determinant = if number % 2 == 0 { 1.0 } else { -1.0 };
        let matrix = rows(random.direction(), random.direction(), determinant);
        let frame = Frame::new(&matrix).expect("orthonormal");
        assert_eq!(frame, Frame::from_array(&frame.to_array()));
        let d = random.direction();
        let single = Vec3::from_array(single(d));
        assert!(distance(frame.to_world(single.to_array()).map(f64::from), rotate(&matrix, d)) < TOLERANCE);
        assert!(distance(frame.to_map(frame.to_world(single.to_array())).map(f64::from), d) < TOLERANCE);
        for (element, off) in (0..9).flat_map(|e| [(e, 3e-4), (e, -3e-4), (e, f32::NAN), (e, f32::INFINITY)]) {
            let mut wrong = matrix;
            wrong[element] += off;
            assert_eq!(Frame::new(&wrong).is_some(), is_orthonormal(&wrong), "{wrong:?}");
        }
        let slightly = matrix.map(|m| m * 1.000_02);
        assert!(Frame::new(&slightly).is_some(), "within 1e-4");
    }
    assert!(matrices().iter().all(|m| Frame::new(m).is_some()));
    assert!(Frame::new(&[0.0; 9]).is_none());
}

/// Whether no element of |M^T M - I| is above 1e-4.
fn is_orthonormal(m: &[f32; 9]) -> bool {
    let element = |a: usize, b: usize| {
        let dot: f64 = (0..3).map(|r| f64::from(m[3 * r + a]) * f64::from(m[3 * r + b])).sum();
        dot - if a == b { 1.0 } else { 0.0 }
    };
    (0..9).all(|k| element(k / 3, k % 3).abs() <= 1e-4)
}

#[test]
fn only_unit_vectors_are_directions() {
    let accepted =
        |length: f32| [[0.0, 0.0, 1.0], [0.36, 0.48, -0.8]].iter().all(|d| unit(d.map(|x| length * x)).is_some());
    let (within, beyond) = ([0.999, 0.9995, 1.0, 1.0005, 1.001], [0.0, 0.9989, 1.0011, 1.01, 2.0]);
    assert!(within.into_iter().all(accepted) && !beyond.into_iter().any(accepted));
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert!(unit([bad, 0.0, 1.0]).is_none());
    }
    let normalised = unit([0.6003, 0.0, -0.8]).unwrap();
    assert!((normalised.length() - 1.0).abs() < 1e-6);
}
