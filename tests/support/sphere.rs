//! Layouts of maps in f64, as the formulas stand: what the library is compared with.

use std::f64::consts::PI;

/// The direction for a point `(u, v)` of a lat-long map.
pub fn latlong_direction(uv: [f64; 2]) -> [f64; 3] {
    let (sin_phi, cos_phi) = (2.0 * PI * uv[0]).sin_cos();
    let (sin_theta, cos_theta) = (PI * uv[1]).sin_cos();
    [sin_theta * cos_phi, sin_theta * sin_phi, cos_theta]
}

/// The solid angle of the rectangle [s0, s1] x [t0, t1] of a cube face in [-1, 1]^2.
pub fn cube_solid_angle(s: [f64; 2], t: [f64; 2]) -> f64 {
    let corner = |s: f64, t: f64| (s * t).atan2((1.0 + s * s + t * t).sqrt());
    corner(s[1], t[1]) - corner(s[0], t[1]) - corner(s[1], t[0]) + corner(s[0], t[0])
}

/// The direction in f64 for a point of the octahedral square.
pub fn direction_f64(s: [f64; 2]) -> [f64; 3] {
    let (x, y) = (2.0 * s[0] - 1.0, 2.0 * s[1] - 1.0);
    let (ax, ay) = (x.abs(), y.abs());
    let south = ax + ay > 1.0;
    let (a, b) = if south { (1.0 - ay, 1.0 - ax) } else { (ax, ay) };
    let radius = a + b;
    let angle = if radius > 0.0 { 0.5 * PI * b / radius } else { 0.0 };
    let horizontal = radius * (2.0 - radius * radius).max(0.0).sqrt();
    let z = 1.0 - radius * radius;
    let signed = |negative: bool, v: f64| if negative { -v } else { v };
    [signed(x < 0.0, horizontal * angle.cos()), signed(y < 0.0, horizontal * angle.sin()), signed(south, z)]
}
