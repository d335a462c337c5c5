//! Tables of BRDFs: which slices a view reads, and the frame that they lie in.

use crate::support::{Random, normalise};
use std::f64::consts::FRAC_PI_2;
use wis::ffi::wavelets::table::{wis_square_direction, wis_square_point, wis_table_view};
use wis::status::Status;

const SLICES: u32 = 16;

/// Slices, weights and frame.
struct View {
    slices: [u32; 2],
    weights: [f64; 2],
    frame: [f32; 9],
}

fn view(normal: [f32; 3], wo: [f32; 3]) -> View {
    let mut view = View { slices: [99; 2], weights: [f64::NAN; 2], frame: [f32::NAN; 9] };
    let View { slices, weights, frame } = &mut view;
    // SAFETY: all pointers are valid.
    assert_eq!(unsafe { wis_table_view(SLICES, &normal, &wo, slices, weights, frame) }, Status::Ok);
    view
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f64 {
    (0..3).map(|k| f64::from(a[k]) * f64::from(b[k])).sum()
}

/// A column of a matrix.
fn column(frame: &[f32; 9], k: usize) -> [f32; 3] {
    [0, 1, 2].map(|row| frame[3 * row + k])
}

/// The third axis is the mirror direction, the first lies in the plane of incidence, and the frame is a rotation.
#[test]
fn the_frame_is_about_the_mirror_direction() {
    let mut random = Random(3);
    for k in 0..2000 {
        let normal = normalise(random.direction());
        let any = random.direction();
        // Some views are steep, or are the normal.
        let share = [0.0, 1e-7, 1e-4, 1.0, 10.0][k % 5];
        let wo = normalise([0, 1, 2].map(|k| f64::from(normal[k]) + share * any[k]));
        let cosine = dot(normal, wo);
        if cosine < 0.0 {
            continue;
        }
        let View { frame, .. } = view(normal, wo);
        let [along, across, mirror] = [0, 1, 2].map(|k| column(&frame, k));
        for (a, b, expected) in [
            (along, along, 1.0),
            (across, across, 1.0),
            (mirror, mirror, 1.0),
            (along, across, 0.0),
            (along, mirror, 0.0),
        ] {
            assert!((dot(a, b) - expected).abs() < 1e-6, "{normal:?} {wo:?}");
        }
        for k in 0..3 {
            let expected = 2.0 * cosine * f64::from(normal[k]) - f64::from(wo[k]);
            assert!((f64::from(mirror[k]) - expected).abs() < 2e-3, "{normal:?} {wo:?}: {mirror:?}");
        }
        assert!(dot(across, normal).abs() < 1e-6 && dot(across, wo).abs() < 1e-3);
        assert!((dot(along, normal) - (1.0 - cosine * cosine).max(0.0).sqrt()).abs() < 1e-3);
    }
}

/// The view of a slice reads that slice alone; others blend the slices beside them by the angle.
#[test]
fn weights_are_linear_in_the_angle() {
    for k in 0..4 * SLICES {
        let angle = (f64::from(k) + 0.5) / f64::from(4 * SLICES) * FRAC_PI_2;
        let View { slices, weights, .. } = view([0.0, 0.0, 1.0], normalise([angle.sin(), 0.0, angle.cos()]));
        let place = (angle / FRAC_PI_2 * f64::from(SLICES) - 0.5).clamp(0.0, f64::from(SLICES - 1));
        assert_eq!(weights[0] + weights[1], 1.0);
        let found = f64::from(slices[0]) * weights[0] + f64::from(slices[1]) * weights[1];
        assert!((found - place).abs() < 1e-4 && slices[1] - slices[0] <= 1, "{angle}: {slices:?} {weights:?}");
    }
    // From below the surface, as along it.
    let View { slices, frame, .. } = view([0.0, 0.0, 1.0], [0.6, 0.0, -0.8]);
    assert_eq!((slices, frame), ([SLICES - 1; 2], view([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]).frame));
}

/// A point of the square leads to a direction and back.
#[test]
fn directions_of_the_square() {
    let mut random = Random(5);
    for _ in 0..1000 {
        let normal = normalise(random.direction());
        let frame = view(normal, normal).frame;
        let point = [random.f32(), random.f32()];
        let (mut wi, mut back) = ([0.0; 3], [0.0; 2]);
        // SAFETY: all pointers are valid.
        unsafe {
            assert_eq!(wis_square_direction(&point, &frame, &mut wi), Status::Ok);
            assert_eq!(wis_square_point(&wi, &frame, &mut back), Status::Ok);
        }
        assert!((dot(wi, wi) - 1.0).abs() < 1e-6);
        assert!((0..2).all(|k| (back[k] - point[k]).abs() < 1e-5), "{point:?} {back:?}");
    }
    let (mut wi, middle) = ([0.0; 3], [0.5; 2]);
    let frame = view([0.0, 0.0, 1.0], [0.6, 0.0, 0.8]).frame;
    // SAFETY: all pointers are valid.
    assert_eq!(unsafe { wis_square_direction(&middle, &frame, &mut wi) }, Status::Ok);
    assert!((wi[0] + 0.6).abs() < 1e-6 && (wi[2] - 0.8).abs() < 1e-6, "{wi:?}");
    for wrong in [[-0.1, 0.5], [0.5, 1.1], [f32::NAN, 0.5]] {
        // SAFETY: all pointers are valid.
        assert_eq!(unsafe { wis_square_direction(&wrong, &frame, &mut wi) }, Status::InvalidArgument);
    }
}

#[test]
fn wrong_views() {
    let up = [0.0, 0.0, 1.0];
    let ask = |count: u32, normal: [f32; 3], wo: [f32; 3]| {
        let (mut slices, mut weights, mut frame) = ([0; 2], [0.0; 2], [0.0; 9]);
        // SAFETY: all pointers are valid.
        unsafe { wis_table_view(count, &normal, &wo, &mut slices, &mut weights, &mut frame) }
    };
    for (count, normal, wo, status) in [
        (0, up, up, Status::InvalidArgument),
        (257, up, up, Status::InvalidArgument),
        (256, [0.0; 3], up, Status::InvalidTransform),
        (256, up, [f32::NAN, 0.0, 1.0], Status::InvalidTransform),
        (256, up, up, Status::Ok),
        (1, up, up, Status::Ok),
    ] {
        assert_eq!(ask(count, normal, wo), status);
    }
}
