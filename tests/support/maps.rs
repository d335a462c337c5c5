//! Maps for tests, procedural and real, and how a client looks them up.

use super::Map;
use super::sphere::latlong_direction;
use super::vector::{V3, add, dot, scale, unit};
use wis::sphere::latlong;

/// How a client filters texels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    Nearest,
    /// Between texel centres; azimuth wraps, rows mirror over the poles.
    Bilinear,
}

impl Map {
    /// The colour of a texel of a lat-long map, which may lie beyond its borders.
    pub fn texel(&self, x: i64, y: i64) -> V3 {
        let (w, h) = (i64::from(self.width), i64::from(self.height));
        let beyond = !(0..h).contains(&y);
        let row = if y < 0 { -1 - y } else { y.min(2 * h - 1 - y) };
        let column = (if beyond { x + w / 2 } else { x }).rem_euclid(w);
        let index = (row * w + column) as usize * self.channels as usize;
        let channel = |c: usize| f64::from(self.pixels[index + if self.channels == 1 { 0 } else { c }]);
        [channel(0), channel(1), channel(2)]
    }

    /// The radiance at a point of the map in units of texels.
    pub fn radiance_at(&self, filter: Filter, x: f64, y: f64) -> V3 {
        if filter == Filter::Nearest {
            return self.texel(x.floor() as i64, (y.floor() as i64).clamp(0, i64::from(self.height) - 1));
        }
        let (x, y) = (x - 0.5, y - 0.5);
        let (column, row) = (x.floor() as i64, y.floor() as i64);
        let (s, t) = (x - x.floor(), y - y.floor());
        let corners = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| self.texel(column + i, row + j));
        let weights = [(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t];
        [0, 1, 2].map(|c| corners.iter().zip(weights).map(|(corner, weight)| corner[c] * weight).sum())
    }

    /// The radiance from a direction of map space.
    pub fn radiance(&self, filter: Filter, direction: V3) -> V3 {
        let [u, v] = latlong(direction);
        self.radiance_at(filter, u * f64::from(self.width), v * f64::from(self.height))
    }

    /// The direction of map space for a point of the map in units of texels.
    pub fn direction(&self, x: f64, y: f64) -> V3 {
        latlong_direction([x / f64::from(self.width), y / f64::from(self.height)])
    }

    /// The map with each `factor` x `factor` texels averaged; the sides must be multiples of it.
    pub fn reduced(&self, factor: u32) -> Map {
        let (width, height) = (self.width / factor, self.height / factor);
        let average = |x: u32, y: u32| {
            let texel = |k: u32| self.texel((x * factor + k % factor).into(), (y * factor + k / factor).into());
            let sum = (0..factor * factor).fold([0.0; 3], |sum, k| add(sum, texel(k)));
            scale(sum, 1.0 / f64::from(factor * factor))
        };
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| average(x, y));
        let channels = self.channels as usize;
        let pixels = texels.flat_map(|texel| texel.into_iter().take(channels)).map(|c| c as f32).collect();
        Map { width, height, channels: self.channels, layout: self.layout, pixels }
    }
}

/// One texel of 64 x 32 in black.
pub fn one_texel(x: u32, y: u32) -> Map {
    Map::latlong(64, 32, |i, j| if (i, j) == (x, y) { 7.0 } else { 0.0 })
}

/// Light from the two rows at the horizon of the map only, in azimuths that alternate.
pub fn horizon() -> Map {
    Map::latlong(64, 32, |x, y| if (y == 15 || y == 16) && x % 4 != 3 { 1.0 + x as f32 } else { 0.0 })
}

/// A smooth sky over dark ground.
pub fn sky(width: u32, height: u32) -> Map {
    Map::latlong(width, height, |x, y| {
        let [u, v] = [(x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32];
        let up = (std::f32::consts::PI * v).cos();
        0.2 + if up > 0.0 { up * (1.0 + 0.3 * (std::f32::consts::TAU * u).sin()) } else { 0.0 }
    })
}

/// A sky with a sun of half a degree and 1e5 times its radiance.
pub fn sun(width: u32, height: u32) -> Map {
    const CENTRE: V3 = [0.48, 0.36, 0.8];
    const SUBSAMPLES: u32 = 8;
    let cosine = 0.25f64.to_radians().cos();
    let mut map = sky(width, height);
    let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    for (texel, (x, y)) in texels.enumerate() {
        let at = |start: u32, k: u32| f64::from(start) + (f64::from(k) + 0.5) / f64::from(SUBSAMPLES);
        if dot(unit(CENTRE), map.direction(f64::from(x) + 0.5, f64::from(y) + 0.5)) > 0.999 {
            let inside = (0..SUBSAMPLES * SUBSAMPLES)
                .filter(|k| dot(unit(CENTRE), map.direction(at(x, k % SUBSAMPLES), at(y, k / SUBSAMPLES))) > cosine)
                .count();
            map.pixels[texel] += 1e5 * inside as f32 / (SUBSAMPLES * SUBSAMPLES) as f32;
        }
    }
    map
}
