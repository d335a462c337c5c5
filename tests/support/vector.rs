//! Three-vectors in f64.

pub type V3 = [f64; 3];

pub fn add(a: V3, b: V3) -> V3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub fn sub(a: V3, b: V3) -> V3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub fn scale(a: V3, by: f64) -> V3 {
    a.map(|a| a * by)
}

pub fn dot(a: V3, b: V3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn cross(a: V3, b: V3) -> V3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub fn length(a: V3) -> f64 {
    dot(a, a).sqrt()
}

pub fn unit(a: V3) -> V3 {
    scale(a, 1.0 / length(a))
}

/// Rounded to f32.
pub fn single(a: V3) -> [f32; 3] {
    a.map(|a| a as f32)
}

/// The chord between two directions.
pub fn distance(a: V3, b: V3) -> f64 {
    length(sub(a, b))
}

/// Rec. 709.
pub fn luminance(rgb: V3) -> f64 {
    dot(rgb, [0.2126, 0.7152, 0.0722])
}

/// A row-major matrix times a vector.
pub fn rotate(m: &[f32; 9], v: V3) -> V3 {
    let row = |r: usize| [f64::from(m[3 * r]), f64::from(m[3 * r + 1]), f64::from(m[3 * r + 2])];
    [dot(row(0), v), dot(row(1), v), dot(row(2), v)]
}

/// The transpose of a row-major matrix times a vector.
pub fn rotate_back(m: &[f32; 9], v: V3) -> V3 {
    rotate(&[m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]], v)
}
