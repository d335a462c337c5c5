//! Two HDR maps of the project's own, made by code and the same in every run: a room with lamps, and a field in the sun.
//!
//! They have what photographs have and smooth test maps have not: detail in every texel, edges that lie between texels,
//! colours, and light sources of some texels that outshine the rest a thousand times and more. The file depends on nothing.

use std::f64::consts::{PI, TAU};

/// A lat-long map in linear RGB, row by row; the first row looks along +z, which is up.
pub struct Panorama {
    pub name: &'static str,
    pub width: usize,
    pub height: usize,
    pub rgb: Vec<[f32; 3]>,
}

type V3 = [f64; 3];

/// A grey room of 6 x 5 x 3 m, seen from 1.4 m above its floor: a window, two round lamps on the ceiling and a small one
/// on a table, and boards on the floor.
pub fn room(height: usize) -> Panorama {
    panorama("room", height, |d| {
        const FAR: V3 = [3.4, 2.1, 1.6];
        const NEAR: V3 = [-2.6, -2.9, -1.4];
        // Where the ray leaves the box.
        let reach = |k: usize| if d[k] > 0.0 { FAR[k] / d[k] } else { NEAR[k] / d[k] };
        let wall = (0..3).min_by(|&a, &b| reach(a).total_cmp(&reach(b))).unwrap_or(2);
        let p = d.map(|c| c * reach(wall));
        let corner = (0..3).filter(|&k| k != wall).map(|k| (FAR[k] - p[k]).min(p[k] - NEAR[k])).fold(9.0, f64::min);
        let shade = (0.35 + 0.65 * (corner / 0.8).min(1.0)) * (0.9 + 0.2 * noise(p.map(|c| c * 14.0)));
        let table_lamp = d[0] * -0.77 + d[1] * -0.55 + d[2] * -0.32;
        match (wall, d[wall] > 0.0) {
            _ if table_lamp > 0.9992 => [1800.0, 1300.0, 700.0],
            (2, true) => match [[1.5, 0.6], [-0.9, -1.1]].map(|lamp| (p[0] - lamp[0]).hypot(p[1] - lamp[1])) {
                [a, b] if a.min(b) < 0.14 => [420.0, 400.0, 350.0],
                [a, b] => [0.9, 0.86, 0.8].map(|c| c * shade + 1.4 * (-3.0 * a.min(b)).exp()),
            },
            (2, false) => {
                let board = noise([(p[0] * 7.0).floor(), (p[1] * 1.3 + 0.4 * (p[0] * 7.0).floor()).floor(), 0.5]);
                [0.32, 0.2, 0.11].map(|c| c * shade * (0.5 + board))
            }
            // The window, with its cross.
            (1, true) if (p[0] - 0.4).abs() < 0.8 && (p[2] - 0.3).abs() < 0.7 => {
                let bar = (p[0] - 0.4).abs() < 0.04 || (p[2] - 0.3).abs() < 0.03;
                let sky = 18.0 + 14.0 * noise([p[0] * 3.0, p[2] * 5.0, 7.0]);
                if bar { [0.2; 3] } else { [0.8 * sky, 0.9 * sky, 1.1 * sky] }
            }
            _ => [0.55, 0.5, 0.43].map(|c| c * shade),
        }
    })
}

/// A meadow under a clear sky with some clouds, trees about the horizon, and a sun of half a degree that is not clipped: its
/// radiance is 4 10^4 times that of the sky.
pub fn field(height: usize) -> Panorama {
    let sun = unit([0.55, -0.35, 0.75]);
    panorama("field", height, |d| {
        let from_sun = d[0] * sun[0] + d[1] * sun[1] + d[2] * sun[2];
        let azimuth = d[1].atan2(d[0]);
        let round = [6.0 * azimuth.cos(), 6.0 * azimuth.sin(), 0.0];
        let tree_line = 0.02 + 0.12 * noise(round) * noise([3.0 * round[0], 3.0 * round[1], 4.0]);
        if d[2] < 0.0 {
            // Blades look smaller the farther they are.
            let far = 1.6 / (0.05 - d[2]);
            let blade = noise([d[0] * far * 4.0, d[1] * far * 4.0, 1.0]) * noise([d[0] * far, d[1] * far, 2.0]);
            return [0.22, 0.3, 0.07].map(|c| c * (0.25 + 1.5 * blade));
        }
        if d[2] < tree_line {
            return [0.05, 0.08, 0.03].map(|c| c * (0.3 + 1.4 * noise(d.map(|c| c * 60.0))));
        }
        if from_sun > 0.266f64.to_radians().cos() {
            return [46_000.0, 42_000.0, 36_000.0];
        }
        let glow = 30.0 * (-1200.0 * (1.0 - from_sun)).exp() + 2.0 * (-25.0 * (1.0 - from_sun)).exp();
        let plane = d.map(|c| 2.5 * c / (d[2] + 0.15));
        let billows = 0.6 * noise(plane) + 0.4 * noise(plane.map(|c| 3.1 * c));
        let cloud = ((billows - 0.55) * 4.0).clamp(0.0, 1.0);
        let haze = (1.0 - d[2]).powi(4);
        let mix = |a: V3, b: V3, share: f64| [0, 1, 2].map(|c| a[c] + share * (b[c] - a[c]));
        let sky = mix(mix([0.28, 0.5, 1.0], [0.9, 0.95, 1.0], haze), [1.9, 1.85, 1.8], cloud);
        [0, 1, 2].map(|c| sky[c] + [1.0, 0.95, 0.85][c] * glow)
    })
}

/// Averages radiance over 4 x 4 places of each texel; 16 x 16 where they differ much, so that small lights keep their power.
fn panorama(name: &'static str, height: usize, radiance: impl Fn(V3) -> V3) -> Panorama {
    let width = 2 * height;
    let mean = |x: usize, y: usize, side: usize| {
        let (mut sum, mut least, mut most) = ([0.0; 3], f64::INFINITY, 0.0);
        for k in 0..side * side {
            let at = |cell: usize, part: usize| cell as f64 + (part as f64 + 0.5) / side as f64;
            let theta = PI * at(y, k / side) / height as f64;
            let phi = TAU * at(x, k % side) / width as f64;
            let rgb = radiance([theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()]);
            (least, most) = (rgb[1].min(least), rgb[1].max(most));
            sum = [0, 1, 2].map(|c| sum[c] + rgb[c] / (side * side) as f64);
        }
        (sum.map(|c| c as f32), most > 8.0 * least)
    };
    let texel = |i: usize| match mean(i % width, i / width, 4) {
        (_, true) => mean(i % width, i / width, 16).0,
        (rgb, false) => rgb,
    };
    Panorama { name, width, height, rgb: (0..width * height).map(texel).collect() }
}

fn unit(v: V3) -> V3 {
    let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
    v.map(|c| c / length)
}

/// Smooth noise between 0 and 1, with features of size 1.
fn noise(p: V3) -> f64 {
    let cell = p.map(f64::floor);
    let t = [0, 1, 2].map(|k| p[k] - cell[k]).map(|t| t * t * (3.0 - 2.0 * t));
    (0..8).fold(0.0, |sum, corner| {
        let side = [corner & 1, corner >> 1 & 1, corner >> 2];
        let weight: f64 = (0..3).map(|k| if side[k] == 1 { t[k] } else { 1.0 - t[k] }).product();
        sum + weight * hash([0, 1, 2].map(|k| cell[k] as i64 + side[k]))
    })
}

/// A number in [0, 1) for a cell (SplitMix64's finaliser).
fn hash(cell: [i64; 3]) -> f64 {
    let z = cell.iter().fold(0x9e37_79b9_7f4a_7c15_u64, |z, &c| {
        let z = (z ^ c as u64).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (z ^ z >> 29).wrapping_mul(0x94d0_49bb_1331_11eb)
    });
    ((z ^ z >> 31) >> 11) as f64 / (1u64 << 53) as f64
}
