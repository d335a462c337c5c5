//! Maps of the hard cases, in lat-long layout, and where their texels lie.

use crate::client::{Map, Texels};
use std::f64::consts::{FRAC_PI_4, PI, TAU};

/// A lat-long map with its texels.
#[derive(Clone)]
pub struct Image {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Rows from the top.
    pub texels: Vec<f32>,
}

impl Image {
    /// A luminance map.
    pub fn new(width: u32, height: u32, mut luminance: impl FnMut(u32, u32) -> f32) -> Image {
        let positions = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        Image { width, height, texels: positions.map(|(x, y)| luminance(x, y)).collect() }
    }

    /// The map for the library.
    pub fn map(&self) -> Map<'_> {
        Map::latlong(self.width, self.height, 1, Texels::F32(&self.texels))
    }

    /// The direction of the centre of a texel.
    pub fn centre(&self, x: u32, y: u32) -> [f32; 3] {
        let phi = TAU * (f64::from(x) + 0.5) / f64::from(self.width);
        let theta = PI * (f64::from(y) + 0.5) / f64::from(self.height);
        [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()].map(|x| x as f32)
    }

    /// What a client finds in a direction: the texel that holds it, or between texel centres. No texel is darker than `least`;
    /// the first and the last row may lie at the poles.
    pub fn radiance(&self, bilinear: bool, at_poles: bool, least: f64, wi: [f32; 3]) -> f64 {
        let width = i64::from(self.width);
        let texel = |x: i64, y: i64| f64::from(self.texels[(y * width + x) as usize]);
        look_up([self.width, self.height], texel, (bilinear, at_poles), least, wi.map(f64::from))
    }

    /// Directions at the corners, edges and half-texel shifts of lit texels, up to a texel around them.
    pub fn around_lit(&self) -> Vec<[f32; 3]> {
        let texels = self.texels.iter().zip(0u32..).filter(|(l, _)| **l > 0.0).map(|(_, index)| index);
        let shifts = (-2..=4).flat_map(|j| (-2..=4).map(move |i| [f64::from(i) * 0.5, f64::from(j) * 0.5]));
        texels
            .flat_map(|index| {
                let texel = [index % self.width, index / self.width].map(f64::from);
                shifts.clone().map(move |[i, j]| [texel[0] + i, texel[1] + j])
            })
            .filter(|[_, y]| (0.0..=f64::from(self.height)).contains(y))
            .map(|[x, y]| {
                let (phi, theta) = (TAU * x / f64::from(self.width), PI * y / f64::from(self.height));
                [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()].map(|x| x as f32)
            })
            .collect()
    }
}

/// The look-up of [`Image::radiance`] in texels that need not be stored.
pub fn look_up(
    [width, height]: [u32; 2],
    texel: impl Fn(i64, i64) -> f64,
    (bilinear, at_poles): (bool, bool),
    least: f64,
    [x, y, z]: [f64; 3],
) -> f64 {
    let (w, h) = (i64::from(width), i64::from(height));
    let [around, down] = [y.atan2(x).rem_euclid(TAU) / TAU, x.hypot(y).atan2(z) / PI];
    let luminance = |x: i64, y: i64| {
        let texel = |x: i64, y: i64| texel(x.rem_euclid(w), y);
        // Over the pole: half a turn on, between two texels if their number is odd.
        let over = |y: i64| 0.5 * (texel(x + w / 2, y) + texel(x + (w + 1) / 2, y));
        let inside = (0..h).contains(&y);
        (if inside { texel(x, y) } else { over(y.clamp(0, h - 1)) }).max(least)
    };
    let spans = if at_poles { h - 1 } else { h } as f64;
    let (column, row) = (around * w as f64, down * spans + if at_poles { 0.5 } else { 0.0 });
    if !bilinear {
        return luminance((column as i64).min(w - 1), (row as i64).min(h - 1));
    }
    let (column, row) = (column - 0.5, row - 0.5);
    let (s, t) = (column - column.floor(), row - row.floor());
    let (x, y) = (column.floor() as i64, row.floor() as i64);
    let line = |y: i64| luminance(x, y) * (1.0 - s) + luminance(x + 1, y) * s;
    if t == 0.0 { line(y) } else { line(y) * (1.0 - t) + line(y + 1) * t }
}

/// A smooth sky over ground of a fifth of its radiance.
pub fn sky() -> Image {
    Image::new(64, 32, |x, y| if y < 16 { 0.2 + (16 - y) as f32 / 16.0 + 0.1 * (x % 7) as f32 } else { 0.2 })
}

/// One texel of 64 x 32, on a background.
pub fn hot(x: u32, y: u32, value: f32, background: f32) -> Image {
    Image::new(64, 32, |i, j| if (i, j) == (x, y) { value } else { background })
}

/// The direction of a point of the equal-area octahedral square (Clarberg 2008).
pub fn octahedral_direction(s: [f64; 2]) -> [f32; 3] {
    let [u, v] = s.map(|s| 2.0 * s - 1.0);
    let d = 1.0 - u.abs() - v.abs();
    let r = 1.0 - d.abs();
    let phi = if r == 0.0 { 0.0 } else { ((v.abs() - u.abs()) / r + 1.0) * FRAC_PI_4 };
    let sine = r * (2.0 - r * r).sqrt();
    [(sine * phi.cos()).copysign(u), (sine * phi.sin()).copysign(v), (1.0 - r * r).copysign(d)].map(|x| x as f32)
}

/// Bytes that a program may still ask for, where the system says so.
pub fn available_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("MemAvailable:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
}
