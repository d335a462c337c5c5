//! The renderer's own light: the look-up of its map, and samples of it by cumulative tables. Each texel counts by its luminance and solid
//! angle, and the look-up takes the nearest texel. So radiance over density is the same everywhere, and a density costs no look-up.

use crate::material::luminance;
use alloc::vec;
use alloc::vec::Vec;
use core::f32::consts::PI;
use glam::{Mat3, Vec3, vec3};

/// A lat-long map, +z up.
pub struct Map {
    pub width: usize,
    pub height: usize,
    pub texels: Vec<Vec3>,
    /// From map to world.
    pub frame: Mat3,
}

impl Map {
    /// Column and row, in texels.
    fn place(&self, wi: Vec3) -> (f32, f32) {
        let d = self.frame.transpose() * wi;
        let turn = libm::atan2f(d.y, d.x) / (2.0 * PI);
        let polar = libm::acosf(d.z.clamp(-1.0, 1.0)) / PI;
        ((if turn < 0.0 { turn + 1.0 } else { turn }) * self.width as f32, polar * self.height as f32)
    }

    /// The nearest texel.
    pub fn radiance(&self, wi: Vec3) -> Vec3 {
        let (x, y) = self.place(wi);
        self.texels[(y as usize).min(self.height - 1) * self.width + (x as usize).min(self.width - 1)]
    }

    /// Between texels, for the eye: what the camera sees of the map.
    pub fn smooth(&self, wi: Vec3) -> Vec3 {
        let (x, y) = self.place(wi);
        let (x, y) = (x - 0.5 + self.width as f32, (y - 0.5).clamp(0.0, (self.height - 1) as f32));
        let (fx, fy) = (x - libm::floorf(x), y - libm::floorf(y));
        let texel = |dx: usize, dy: usize| {
            let row = (y as usize + dy).min(self.height - 1);
            self.texels[row * self.width + (x as usize + dx) % self.width]
        };
        texel(0, 0).lerp(texel(1, 0), fx).lerp(texel(0, 1).lerp(texel(1, 1), fx), fy)
    }
}

/// A cumulative table, and for equal parts of u where the search begins.
#[derive(Default)]
struct Table {
    below: Vec<f32>,
    guide: Vec<u16>,
}

impl Table {
    /// Normalises weights; their sum.
    fn new(weights: &[f32]) -> (Table, f64) {
        let sum: f64 = weights.iter().map(|w| f64::from(*w)).sum();
        let (mut below, mut guide, mut total) = (vec![0.0], vec![0; weights.len()], 0.0);
        for weight in weights {
            total += f64::from(*weight);
            below.push(if sum > 0.0 { (total / sum) as f32 } else { 1.0 });
        }
        let mut entry = 0;
        for (i, first) in guide.iter_mut().enumerate() {
            while below[entry + 1] <= i as f32 / weights.len() as f32 {
                entry += 1;
            }
            *first = entry as u16;
        }
        (Table { below, guide }, sum)
    }

    /// The entry of u, and where u is in it.
    fn find(&self, u: f32) -> (usize, f32) {
        let mut i = self.guide[((u * self.guide.len() as f32) as usize).min(self.guide.len() - 1)] as usize;
        while i + 1 < self.guide.len() && self.below[i + 1] <= u {
            i += 1;
        }
        let (low, high) = (self.below[i], self.below[i + 1]);
        (i, ((u - low) / (high - low)).clamp(0.0, 1.0))
    }
}

/// Samples of a map in proportion to its luminance, or to what exceeds its mean (MIS compensation, Karlik et al. 2019).
#[derive(Default)]
pub struct Samples {
    rows: Table,
    columns: Vec<Table>,
    /// The cosine of the upper edge of each row.
    edges: Vec<f32>,
    /// The mean, if compensated, else 0.
    excess: f32,
    total: f64,
}

impl Samples {
    pub fn new(map: &Map, compensated: bool) -> Samples {
        let edges: Vec<f32> = (0..=map.height).map(|y| libm::cosf(PI * y as f32 / map.height as f32)).collect();
        let area = |y: usize| (edges[y] - edges[y + 1]) * 2.0 * PI / map.width as f32;
        let mut samples = Samples::default();
        // The mean is known after a first round.
        for round in 0..1 + u32::from(compensated) {
            if round == 1 {
                samples.excess = (samples.total / f64::from(4.0 * PI)) as f32;
            }
            let mut rows = Vec::new();
            samples.columns.clear();
            for (y, row) in map.texels.chunks(map.width).enumerate() {
                let weights: Vec<f32> = row.iter().map(|rgb| samples.weight(*rgb) * area(y)).collect();
                let (table, sum) = Table::new(&weights);
                samples.columns.push(table);
                rows.push(sum as f32);
            }
            (samples.rows, samples.total) = Table::new(&rows);
        }
        samples.edges = edges;
        samples
    }

    fn weight(&self, radiance: Vec3) -> f32 {
        let l = luminance(radiance);
        (l - self.excess).max(l / 64.0)
    }

    /// The density of directions with this radiance, per steradian.
    pub fn pdf(&self, radiance: Vec3) -> f32 {
        self.weight(radiance) / self.total as f32
    }

    pub fn sample(&self, map: &Map, [u, v]: [f32; 2]) -> (Vec3, Vec3) {
        let (y, within_y) = self.rows.find(v);
        let (x, within_x) = self.columns[y].find(u);
        let z = self.edges[y] + (self.edges[y + 1] - self.edges[y]) * within_y;
        let r = libm::sqrtf((1.0 - z * z).max(0.0));
        let (sin, cos) = libm::sincosf(2.0 * PI * (x as f32 + within_x) / map.width as f32);
        (map.frame * vec3(r * cos, r * sin, z), map.texels[y * map.width + x])
    }
}
