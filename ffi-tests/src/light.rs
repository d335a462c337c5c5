//! Environment maps as the renderer knows them: read from files or made here, looked up to the nearest texel, and
//! built into the library's environment.
//!
//! The world's z axis points up. A lat-long map is mirrored on the way, since images show the sphere from inside.

use crate::client::{Environment, Light as Distribution, Map, raw};
use anyhow::{Context, Result, bail};
use glam::{Mat3, Vec3};
use std::f32::consts::{PI, TAU};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Layout {
    LatLong,
    Cube,
}

/// A map of luminance.
#[derive(Clone, Debug)]
pub struct Light {
    pub name: String,
    layout: Layout,
    width: usize,
    height: usize,
    luminance: Vec<f32>,
    map_from_world: Mat3,
}

impl Light {
    /// Reads a Radiance or OpenEXR map: a lat-long map (2:1), or a vertical cross (3:4) that is cut into its faces.
    ///
    /// # Errors
    /// A file that cannot be read or has another shape.
    pub fn load(path: &Path) -> Result<Light> {
        let name = path.file_stem().and_then(|n| n.to_str()).unwrap_or("map");
        let image = match path.extension().and_then(|e| e.to_str()) {
            Some("exr") => read_exr(path),
            _ => read_radiance(path),
        };
        let Image { width, height, luminance } = image.with_context(|| format!("map {}", path.display()))?;
        if width == 2 * height {
            Ok(Light::latlong(name, width, height, luminance))
        } else if width * 4 == height * 3 && width % 3 == 0 {
            Ok(Light::cube(name, width / 3, cut_cross(width / 3, &luminance)))
        } else {
            bail!("map {}: {width} x {height} is neither a lat-long map nor a vertical cross", path.display())
        }
    }

    /// A lat-long map with its first row up.
    pub fn latlong(name: &str, width: usize, height: usize, luminance: Vec<f32>) -> Light {
        let map_from_world = Mat3::from_diagonal(Vec3::new(1.0, -1.0, 1.0));
        Light { name: name.into(), layout: Layout::LatLong, width, height, luminance, map_from_world }
    }

    /// Six faces in the order of WIS_LAYOUT_CUBE, +y up.
    fn cube(name: &str, side: usize, luminance: Vec<f32>) -> Light {
        let map_from_world = Mat3::from_cols(Vec3::X, Vec3::NEG_Z, Vec3::Y);
        let (width, height) = (side, 6 * side);
        Light { name: name.into(), layout: Layout::Cube, width, height, luminance, map_from_world }
    }

    /// A clear sky with a sun of half a degree.
    pub fn sun(width: usize) -> Light {
        let sun = direction(0.9, 0.6);
        Light::procedural("sun", width, |d| {
            let sky = if d.z > 0.0 { 0.2 + 0.8 * (1.0 - d.z).powi(3) } else { 0.12 };
            let glow = 4.0 * (-(1.0 - d.dot(sun)) * 300.0).exp();
            sky + glow + if d.dot(sun) > 0.0093f32.cos() { 4e4 } else { 0.0 }
        })
    }

    /// A dark room with five bright windows.
    pub fn windows(width: usize) -> Light {
        Light::procedural("windows", width, |d| {
            let (azimuth, height) = (d.y.atan2(d.x).rem_euclid(TAU), d.z);
            let pane = (azimuth / TAU * 10.0).fract();
            let in_window = (azimuth / TAU * 10.0) as u32 % 2 == 0 && (0.2..0.7).contains(&height) && pane > 0.3;
            if in_window { 20.0 + 10.0 * pane } else { 0.05 + 0.03 * height }
        })
    }

    fn procedural(name: &str, width: usize, radiance: impl Fn(Vec3) -> f32) -> Light {
        let height = width / 2;
        let texel = |i: usize| {
            let (x, y) = ((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
            let d = direction(y / height as f32 * PI, x / width as f32 * TAU);
            radiance(Vec3::new(d.x, -d.y, d.z))
        };
        Light::latlong(name, width, height, (0..width * height).map(texel).collect())
    }

    /// Luminance from a world direction.
    #[inline]
    pub fn radiance(&self, wi: Vec3) -> f32 {
        let d = self.map_from_world * wi;
        let texel = match self.layout {
            Layout::LatLong => self.latlong_texel(d),
            Layout::Cube => cube_texel(self.width, d),
        };
        self.luminance[texel]
    }

    pub fn texels(&self) -> usize {
        self.luminance.len()
    }

    /// Tells lights apart by their texels.
    pub fn fingerprint(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        (self.width, self.height).hash(&mut hasher);
        self.luminance.iter().for_each(|texel| texel.to_bits().hash(&mut hasher));
        hasher.finish()
    }

    /// Builds the environment with both distributions, for nearest look-up.
    ///
    /// # Errors
    /// Those of the library.
    pub fn environment(&self) -> crate::client::Result<Environment> {
        let layout = match self.layout {
            Layout::LatLong => raw::WIS_LAYOUT_LATLONG,
            Layout::Cube => raw::WIS_LAYOUT_CUBE,
        };
        let flags = raw::WIS_ENVIRONMENT_NEAREST | raw::WIS_ENVIRONMENT_COMPENSATED;
        let map = Map::latlong(self.width as u32, self.height as u32, 1, &self.luminance);
        Environment::new(&Map { layout, flags, ..map })
    }

    /// The row-major matrix that the library is given.
    pub fn world_from_map(&self) -> [f32; 9] {
        // The inverse of a rotation is its transpose, and columns of one are rows of the other.
        self.map_from_world.to_cols_array()
    }

    /// One of the distributions of an environment that was built from this map.
    pub fn distribution<'a>(&self, environment: &'a Environment, distribution: u32) -> Distribution<'a> {
        environment.light(distribution, Some(self.world_from_map()))
    }

    /// The centres of all texels of a lat-long map as world directions, with solid angles, `k` by `k` for each texel.
    pub fn quadrature(&self, k: usize) -> impl Iterator<Item = (Vec3, f64)> + '_ {
        assert!(self.layout == Layout::LatLong, "quadrature is of lat-long maps");
        let (columns, rows) = (self.width * k, self.height * k);
        let step = [std::f64::consts::TAU / columns as f64, std::f64::consts::PI / rows as f64];
        (0..rows).flat_map(move |y| {
            let area = step[0] * ((y as f64 * step[1]).cos() - ((y + 1) as f64 * step[1]).cos());
            let theta = (y as f64 + 0.5) * step[1];
            (0..columns).map(move |x| {
                let phi = (x as f64 + 0.5) * step[0];
                let d = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()].map(|c| c as f32);
                (Vec3::new(d[0], -d[1], d[2]), area)
            })
        })
    }

    #[inline]
    fn latlong_texel(&self, d: Vec3) -> usize {
        let phi = d.y.atan2(d.x);
        let phi = if phi < 0.0 { phi + TAU } else { phi };
        let x = (phi / TAU * self.width as f32) as usize;
        let y = (d.z.clamp(-1.0, 1.0).acos() / PI * self.height as f32) as usize;
        y.min(self.height - 1) * self.width + x.min(self.width - 1)
    }
}

fn direction(theta: f32, phi: f32) -> Vec3 {
    Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

/// The texel of a cube map that a direction meets: the faces of OpenGL, table 8.19 of its specification.
#[inline]
fn cube_texel(side: usize, d: Vec3) -> usize {
    let a = d.abs();
    let (face, major, s, t) = if a.x >= a.y && a.x >= a.z {
        if d.x > 0.0 { (0, a.x, -d.z, -d.y) } else { (1, a.x, d.z, -d.y) }
    } else if a.y >= a.z {
        if d.y > 0.0 { (2, a.y, d.x, d.z) } else { (3, a.y, d.x, -d.z) }
    } else if d.z > 0.0 {
        (4, a.z, d.x, -d.y)
    } else {
        (5, a.z, -d.x, -d.y)
    };
    let cell = |c: f32| (((c / major + 1.0) * 0.5 * side as f32) as usize).min(side - 1);
    (face * side + cell(t)) * side + cell(s)
}

/// For each face +x -x +y -y +z -z: its row and column in a vertical cross, and whether its columns or else its rows
/// run the other way, since a cross shows the cube from inside.
const CROSS: [(usize, usize, bool); 6] =
    [(1, 2, true), (1, 0, true), (0, 1, false), (2, 1, false), (3, 1, false), (1, 1, true)];

fn cut_cross(side: usize, cross: &[f32]) -> Vec<f32> {
    let texels = (0..6 * side * side).map(|i| {
        let (face, y, x) = (i / (side * side), i / side % side, i % side);
        let (row, column, flip_columns) = CROSS[face];
        let (x, y) = if flip_columns { (side - 1 - x, y) } else { (x, side - 1 - y) };
        cross[(row * side + y) * 3 * side + column * side + x]
    });
    texels.collect()
}

struct Image {
    width: usize,
    height: usize,
    luminance: Vec<f32>,
}

fn luminance(rgb: &[f32]) -> f32 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

fn read_radiance(path: &Path) -> Result<Image> {
    let mut reader = image::ImageReader::open(path)?.with_guessed_format()?;
    reader.no_limits();
    let image = reader.decode()?.into_rgb32f();
    let (width, height) = (image.width() as usize, image.height() as usize);
    Ok(Image { width, height, luminance: image.as_raw().chunks_exact(3).map(luminance).collect() })
}

fn read_exr(path: &Path) -> Result<Image> {
    let create = |size: exr::math::Vec2<usize>, _: &_| Image {
        width: size.width(),
        height: size.height(),
        luminance: vec![0.0; size.area()],
    };
    let store = |image: &mut Image, at: exr::math::Vec2<usize>, (r, g, b, _): (f32, f32, f32, f32)| {
        image.luminance[at.y() * image.width + at.x()] = luminance(&[r, g, b]);
    };
    Ok(exr::prelude::read_first_rgba_layer_from_file(path, create, store)?.layer_data.channel_data.pixels)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cross_keeps_the_direction_of_every_texel() {
        let side = 8;
        let cross: Vec<f32> = (0..12 * side * side).map(|i| i as f32).collect();
        let light = Light::cube("cross", side, cut_cross(side, &cross));
        // The faces of a cross by row and column, with u to the right and v downwards.
        type Face = (usize, usize, fn(f32, f32) -> Vec3);
        let faces: [Face; 6] = [
            (0, 1, |u, v| Vec3::new(u, 1.0, -v)),
            (1, 0, |u, v| Vec3::new(-1.0, -v, -u)),
            (1, 1, |u, v| Vec3::new(u, -v, -1.0)),
            (1, 2, |u, v| Vec3::new(1.0, -v, u)),
            (2, 1, |u, v| Vec3::new(u, -1.0, v)),
            (3, 1, |u, v| Vec3::new(u, v, 1.0)),
        ];
        for (row, column, face) in faces {
            for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
                let centre = |c: usize| (c as f32 + 0.5) / side as f32 * 2.0 - 1.0;
                let world = light.map_from_world.transpose() * face(centre(x), centre(y)).normalize();
                let expected = cross[(row * side + y) * 3 * side + column * side + x];
                assert_eq!(light.radiance(world), expected);
            }
        }
    }

    #[test]
    fn the_library_sees_the_same_map() {
        let cross = (0..12 * 64).map(|i| (i * 37 % 101) as f32 + 1.0).collect::<Vec<_>>();
        for light in [Light::sun(64), Light::windows(64), Light::cube("cube", 8, cut_cross(8, &cross))] {
            let environment = light.environment().unwrap();
            let power = environment.power().unwrap();
            let density = light.distribution(&environment, raw::WIS_DISTRIBUTION_PLAIN);
            let mut u = vec![[0.0; 2]; 1 << 14];
            crate::client::sobol(3, 0, &mut u).unwrap();
            let sum: f64 = u
                .iter()
                .map(|&u| {
                    let sample = crate::client::Density::sample(&density, u).unwrap();
                    f64::from(light.radiance(Vec3::from_array(sample.wi)) / sample.pdf)
                })
                .sum();
            let mean = sum / u.len() as f64;
            assert!((mean / power - 1.0).abs() < 0.01, "{}: {mean} {power}", light.name);
        }
    }
}
