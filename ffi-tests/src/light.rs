//! Environment maps as the renderer knows them: read from files or made here, looked up to the nearest texel or
//! bilinearly, and built into the library's environment.
//!
//! The world's z axis points up. A lat-long map is mirrored on the way, since images show the sphere from inside.

use crate::bilinear::{self, Bilinear};
use crate::client::{Texels, raw};
use crate::environment;
use crate::lanes::{F8, LANES, V8};
use crate::layout::{Layout, Position};
use crate::panorama;
use anyhow::{Context, Result, bail};
use glam::{DVec3, Mat3, Vec3};
use std::f32::consts::{PI, TAU};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

/// A map of luminance.
#[derive(Clone, Debug)]
pub struct Light {
    pub name: String,
    layout: Layout,
    width: usize,
    height: usize,
    luminance: Vec<f32>,
    map_from_world: Mat3,
    /// For a client that interpolates.
    filter: Option<Bilinear>,
}

impl From<panorama::Panorama> for Light {
    fn from(map: panorama::Panorama) -> Light {
        Light::latlong(map.name, map.width, map.height, map.rgb.iter().map(|rgb| luminance(rgb)).collect())
    }
}

impl Light {
    /// Reads a Radiance or OpenEXR map: a lat-long map (about 2:1), a vertical cross (3:4) that is cut into its
    /// faces, or a light probe (1:1, angular map), which becomes a lat-long map.
    ///
    /// # Errors
    /// A file that cannot be read or has another shape.
    pub fn load(path: &Path) -> Result<Light> {
        Light::load_weighed(path, LUMINANCE)
    }

    /// The red, green and blue of such a map, as a light each.
    ///
    /// # Errors
    /// A file that cannot be read or has another shape.
    pub fn load_channels(path: &Path) -> Result<[Light; 3]> {
        let [red, green, blue] =
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|weights| Light::load_weighed(path, weights));
        Ok([red?, green?, blue?])
    }

    fn load_weighed(path: &Path, weights: [f32; 3]) -> Result<Light> {
        let name = path.file_stem().and_then(|n| n.to_str()).unwrap_or("map");
        let image = match path.extension().and_then(|e| e.to_str()) {
            Some("exr") => read_exr(path, weights),
            _ => read_radiance(path, weights),
        };
        let Image { width, height, luminance } = image.with_context(|| format!("map {}", path.display()))?;
        if width == height {
            Ok(Light::probe(name, width, &luminance))
        } else if 2 * width >= 3 * height && width <= 3 * height {
            Ok(Light::latlong(name, width, height, luminance))
        } else if width * 4 == height * 3 && width % 3 == 0 {
            Ok(Light::cube(name, width / 3, cut_cross(width / 3, &luminance)))
        } else {
            bail!(
                "map {}: {width} x {height} is neither a lat-long map, a vertical cross nor a light probe",
                path.display()
            )
        }
    }

    /// A lat-long map with its first row up.
    pub fn latlong(name: &str, width: usize, height: usize, luminance: Vec<f32>) -> Light {
        let map_from_world = Mat3::from_diagonal(Vec3::new(1.0, -1.0, 1.0));
        Light { name: name.into(), layout: Layout::LatLong, width, height, luminance, map_from_world, filter: None }
    }

    /// Six faces in the order of WIS_LAYOUT_CUBE, +y up.
    fn cube(name: &str, side: usize, luminance: Vec<f32>) -> Light {
        let map_from_world = Mat3::from_cols(Vec3::X, Vec3::NEG_Z, Vec3::Y);
        let (width, height) = (side, 6 * side);
        Light { name: name.into(), layout: Layout::Cube, width, height, luminance, map_from_world, filter: None }
    }

    /// A light probe (Debevec's angular map) as a lat-long map of as many rows. The world's +y is in its middle, +z up, and -y on the circle
    /// of radius 1.
    fn probe(name: &str, side: usize, luminance: &[f32]) -> Light {
        Light::resampled(name, side, |wi| {
            let radius = wi.x.hypot(wi.z).atan2(wi.y) / (PI * wi.x.hypot(wi.z).max(1e-30));
            let cell = |c: f32| (((c * radius + 1.0) * 0.5 * side as f32) as usize).min(side - 1);
            luminance[cell(-wi.z) * side + cell(wi.x)]
        })
    }

    /// The same light, looked up bilinearly.
    pub fn bilinear(self) -> Light {
        let filter = Some(Bilinear::new(self.layout, self.size(), &self.luminance));
        Light { filter, ..self }
    }

    /// Whether it is looked up bilinearly.
    pub fn is_bilinear(&self) -> bool {
        self.filter.is_some()
    }

    pub fn layout(&self) -> Layout {
        self.layout
    }

    pub fn map_from_world(&self) -> Mat3 {
        self.map_from_world
    }

    /// A direction of the map's frame in the world's.
    pub fn to_world(&self, d: DVec3) -> DVec3 {
        self.map_from_world.transpose().as_dmat3() * d
    }

    /// A smooth sky with a sun of `side` x `side` texels, 10^5 times as bright, whose first texel stands at a column and a
    /// row.
    pub fn unclipped(name: &str, width: usize, side: usize, [column, row]: [usize; 2]) -> Light {
        let sky = Light::procedural(name, width, |d| if d.z > 0.0 { 0.4 + 0.6 * (1.0 - d.z).powi(3) } else { 0.12 });
        let mut luminance = sky.luminance;
        for (i, j) in (0..side).flat_map(|j| (0..side).map(move |i| (i, j))) {
            luminance[(row + j) * width + (column + i) % width] = 1e5;
        }
        Light { luminance, ..Light::latlong(name, width, width / 2, Vec::new()) }
    }

    /// A sky without a sun that is smooth everywhere.
    pub fn sky(width: usize) -> Light {
        Light::procedural("sky", width, |d| {
            let glow = (-(1.0 - d.dot(direction(0.9, 0.6))) * 4.0).exp();
            0.4 + 0.2 * d.z + 0.3 * (-8.0 * d.z * d.z).exp() + glow
        })
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

    /// The project's own room with lamps.
    pub fn room(width: usize) -> Light {
        Light::from(panorama::room(width / 2))
    }

    /// The project's own field in the sun, which is not clipped.
    pub fn field(width: usize) -> Light {
        Light::from(panorama::field(width / 2))
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

    /// The same light as a lat-long map of `height` rows; a lat-long map as it is.
    pub fn to_latlong(&self, height: usize) -> Light {
        if self.layout == Layout::LatLong {
            return self.clone();
        }
        Light::resampled(&self.name, height, |wi| self.radiance(wi))
    }

    /// A lat-long map of `height` rows, looked up four by four times in a texel.
    fn resampled(name: &str, height: usize, radiance: impl Fn(Vec3) -> f32) -> Light {
        const FINE: usize = 4;
        let width = 2 * height;
        let texel = |i: usize| {
            let at = |j: usize| {
                let x = (i % width) as f32 + ((j % FINE) as f32 + 0.5) / FINE as f32;
                let y = (i / width) as f32 + ((j / FINE) as f32 + 0.5) / FINE as f32;
                let d = direction(y / height as f32 * PI, x / width as f32 * TAU);
                radiance(Vec3::new(d.x, -d.y, d.z))
            };
            (0..FINE * FINE).map(at).sum::<f32>() / (FINE * FINE) as f32
        };
        Light::latlong(name, width, height, (0..width * height).map(texel).collect())
    }

    /// Luminance from a world direction.
    pub fn radiance(&self, wi: Vec3) -> f32 {
        match &self.filter {
            Some(_) => self.interpolated(V8::splat(wi)).map_or(0.0, |l| l.as_array_ref()[0]),
            None => self.luminance[self.texels(V8::splat(wi)).0[0]],
        }
    }

    /// Luminance from world directions, of a light that is looked up bilinearly.
    #[inline]
    pub fn interpolated(&self, wi: V8) -> Option<F8> {
        let filter = self.filter.as_ref()?;
        Some(filter.at(self.layout.position(self.size(), turned(&self.map_from_world, wi))))
    }

    /// Luminance from a world direction, found in double precision.
    pub fn exact(&self, wi: Vec3) -> f64 {
        let d = self.map_from_world.as_dmat3() * wi.as_dvec3();
        if let Some(filter) = &self.filter {
            return filter.exact(d);
        }
        let [x, y] = bilinear::position(self.layout, self.size(), d).map(|c| c as usize);
        f64::from(self.luminance[y.min(self.height - 1) * self.width + x.min(self.width - 1)])
    }

    /// The mean luminance over the sphere.
    pub fn mean(&self) -> f64 {
        let angles = self.solid_angles();
        let texels = self.means();
        let sum: f64 = texels.iter().zip(&angles).map(|(&l, a)| f64::from(l) * a).sum();
        sum / angles.iter().sum::<f64>()
    }

    /// The mean of the look-up over each texel.
    pub fn means(&self) -> Vec<f32> {
        self.filter.as_ref().map_or_else(|| self.luminance.clone(), Bilinear::means)
    }

    /// The texels that world directions look up, and how many of them there are in a unit of solid angle.
    #[inline]
    pub fn texels(&self, wi: V8) -> ([usize; LANES], F8) {
        let d = turned(&self.map_from_world, wi);
        let Position { column, row } = self.layout.position(self.size(), d);
        let [columns, rows] = [column.fast_trunc_int().to_array(), row.fast_trunc_int().to_array()];
        let texel = |i: usize| {
            let [x, y] = [columns[i].max(0) as usize, rows[i].max(0) as usize];
            y.min(self.height - 1) * self.width + x.min(self.width - 1)
        };
        (std::array::from_fn(texel), self.layout.texels_per_solid_angle(self.size(), d))
    }

    /// World directions at positions on the map.
    #[inline]
    pub fn direction(&self, at: Position) -> V8 {
        turned(&self.map_from_world.transpose(), self.layout.direction(self.size(), at))
    }

    /// Columns and rows of texels.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// A light that is looked up bilinearly, as twice as many texels along each axis.
    ///
    /// # Panics
    /// If it is not looked up bilinearly.
    pub fn doubled(&self) -> Light {
        let filter = self.filter.as_ref().expect("a light that is looked up bilinearly");
        let [width, height] = self.size().map(|n| 2 * n);
        let centre = |c: usize| F8::splat((c as f32 + 0.5) / 2.0);
        let at = |i: usize| Position { column: centre(i % width), row: centre(i / width) };
        let luminance = (0..width * height).map(|i| filter.at(at(i)).as_array_ref()[0]).collect();
        Light { width, height, luminance, filter: None, name: self.name.clone(), ..*self }
    }

    /// The texels, row by row.
    pub fn luminance(&self) -> &[f32] {
        &self.luminance
    }

    /// The solid angle of each texel.
    pub fn solid_angles(&self) -> Vec<f64> {
        const FINE: usize = 4;
        let fine = |i: usize| (i as f32 + 0.5) / FINE as f32;
        let texel = |i: usize| {
            let (x, y) = ((i % self.width) as f32, (i / self.width) as f32);
            let mut sum = 0.0;
            for half in 0..FINE * FINE / LANES {
                let part = |k: usize| LANES * half + k;
                let column = F8::new(std::array::from_fn(|k| x + fine(part(k) % FINE)));
                let row = F8::new(std::array::from_fn(|k| y + fine(part(k) / FINE)));
                let d = self.layout.direction(self.size(), Position { column, row });
                let density = self.layout.texels_per_solid_angle(self.size(), d);
                sum += density.as_array_ref().iter().map(|density| 1.0 / f64::from(*density)).sum::<f64>();
            }
            sum / (FINE * FINE) as f64
        };
        (0..self.luminance.len()).map(texel).collect()
    }

    /// Tells lights apart by their texels.
    pub fn fingerprint(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        (self.width, self.height, self.is_bilinear()).hash(&mut hasher);
        self.luminance.iter().for_each(|texel| texel.to_bits().hash(&mut hasher));
        hasher.finish()
    }

    /// Builds the light in small tables, with `WIS_ENVIRONMENT_*` and an error budget, for the client's look-up.
    ///
    /// # Errors
    /// Those of the library.
    pub fn tables(&self, flags: u32, error_budget: f32) -> crate::client::Result<environment::Environment> {
        self.mapped(flags, error_budget, environment::Environment::new)
    }

    /// What `build` makes of the map that [`Light::tables`] builds.
    ///
    /// # Errors
    /// Those of `build`.
    pub fn mapped<T>(
        &self,
        flags: u32,
        error_budget: f32,
        build: impl Fn(&environment::Map) -> crate::client::Result<T>,
    ) -> crate::client::Result<T> {
        let filter = if self.is_bilinear() { raw::WIS_FILTER_BILINEAR } else { raw::WIS_FILTER_NEAREST };
        let world_from_map = Some(self.world_from_map());
        let map = environment::Map { filter, flags, error_budget, world_from_map, ..self.map() };
        match self.layout {
            Layout::LatLong => build(&map),
            Layout::Cube => build(&environment::Map { layout: raw::WIS_LAYOUT_CUBE, ..map }),
        }
    }

    fn map(&self) -> environment::Map<'_> {
        environment::Map::latlong(self.width as u32, self.height as u32, 1, Texels::F32(&self.luminance))
    }

    /// The light on an octahedral square: means of `k` by `k` look-ups in each cell.
    pub fn on_octahedron(&self, side: usize, k: usize) -> Vec<f32> {
        let cell = |i: usize| {
            let fine = |j: usize| {
                let at = |c: usize, j: usize| (c as f32 + (j as f32 + 0.5) / k as f32) / side as f32;
                octahedral_direction(at(i % side, j % k), at(i / side, j / k))
            };
            (0..k * k).map(|j| self.radiance(fine(j))).sum::<f32>() / (k * k) as f32
        };
        (0..side * side).map(cell).collect()
    }

    /// The row-major matrix that the library is given.
    pub fn world_from_map(&self) -> [f32; 9] {
        // The inverse of a rotation is its transpose, and columns of one are rows of the other.
        self.map_from_world.to_cols_array()
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
}

#[inline]
fn turned(matrix: &Mat3, v: V8) -> V8 {
    let column = |c: Vec3, s: F8| V8::splat(c).scale(s);
    column(matrix.x_axis, v.x).plus(column(matrix.y_axis, v.y)).plus(column(matrix.z_axis, v.z))
}

/// The direction of a point of the equal-area octahedral square, the layout WIS_LAYOUT_OCTAHEDRAL.
pub fn octahedral_direction(u: f32, v: f32) -> Vec3 {
    let centred = Vec3::new(2.0 * u - 1.0, 2.0 * v - 1.0, 0.0);
    let (a, b) = (centred.x.abs(), centred.y.abs());
    let south = a + b > 1.0;
    let (a, b) = if south { (1.0 - b, 1.0 - a) } else { (a, b) };
    let radius = a + b;
    let (sin, cos) = (PI / 2.0 * b / radius.max(f32::MIN_POSITIVE)).sin_cos();
    let (z, across) = (1.0 - radius * radius, radius * (2.0 - radius * radius).sqrt());
    let signed = |c: f32, sign: f32| c.copysign(sign);
    Vec3::new(signed(across * cos, centred.x), signed(across * sin, centred.y), if south { -z } else { z })
}

fn direction(theta: f32, phi: f32) -> Vec3 {
    Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
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

const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];

fn luminance(rgb: &[f32]) -> f32 {
    weighed(rgb, LUMINANCE)
}

/// Negative channels are 0, as the library counts them.
fn weighed(rgb: &[f32], weights: [f32; 3]) -> f32 {
    weights[0] * rgb[0].max(0.0) + weights[1] * rgb[1].max(0.0) + weights[2] * rgb[2].max(0.0)
}

fn read_radiance(path: &Path, weights: [f32; 3]) -> Result<Image> {
    let mut reader = image::ImageReader::open(path)?.with_guessed_format()?;
    reader.no_limits();
    let image = reader.decode()?.into_rgb32f();
    let (width, height) = (image.width() as usize, image.height() as usize);
    let luminance = image.as_raw().chunks_exact(3).map(|rgb| weighed(rgb, weights)).collect();
    Ok(Image { width, height, luminance })
}

fn read_exr(path: &Path, weights: [f32; 3]) -> Result<Image> {
    let create = |size: exr::math::Vec2<usize>, _: &_| Image {
        width: size.width(),
        height: size.height(),
        luminance: vec![0.0; size.area()],
    };
    let store = move |image: &mut Image, at: exr::math::Vec2<usize>, (r, g, b, _): (f32, f32, f32, f32)| {
        image.luminance[at.y() * image.width + at.x()] = weighed(&[r, g, b], weights);
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

    /// The logarithms of two lights in all directions: their mean difference, without what a slight turn would move much.
    fn difference([a, b]: [&Light; 2]) -> f64 {
        let u = crate::points::of(3, 1 << 14);
        let log = |light: &Light, u: &[f32; 2]| f64::from(light.radiance(octahedral_direction(u[0], u[1])) + 1e-3).ln();
        u.iter().map(|u| (log(a, u) - log(b, u)).abs()).sum::<f64>() / u.len() as f64
    }

    /// The room as a light probe by the definition of angular maps, and as a cube.
    #[test]
    fn a_light_probe_and_a_cube_of_the_room_agree() {
        let (room, side) = (Light::room(256), 256);
        let probe = |i: usize| {
            let centred = |c: usize| (c as f32 + 0.5) / side as f32 * 2.0 - 1.0;
            let (x, y) = (centred(i % side), -centred(i / side));
            let radius = x.hypot(y).min(1.0);
            let (sine, cosine) = (radius * PI).sin_cos();
            // It looks along the world's +y, with +z up.
            room.radiance(Vec3::new(sine * x / radius, cosine, sine * y / radius))
        };
        let probe = Light::probe("probe", side, &(0..side * side).map(probe).collect::<Vec<f32>>());
        let shape = Light::cube("cube", 64, vec![0.0; 6 * 64 * 64]);
        let texel = |i: usize| {
            let at = |c: usize| F8::splat(c as f32 + 0.5);
            let d = shape.direction(Position { column: at(i % 64), row: at(i / 64) });
            room.radiance(Vec3::new(d.x.as_array_ref()[0], d.y.as_array_ref()[0], d.z.as_array_ref()[0]))
        };
        let cube = Light::cube("cube", 64, (0..6 * 64 * 64).map(texel).collect());
        let [probe, cube] = [difference([&probe, &room]), difference([&cube, &room])];
        assert!(probe < 0.1 && cube < 0.1, "{probe} {cube}");
        assert!(difference([&Light::room(256), &Light::field(256)]) > 0.5);
    }

    #[test]
    fn a_light_probe_and_a_cross_of_one_place_agree() {
        let file = |name: &str| Path::new("../../shared/data/envmaps").join(name);
        let [Ok(probe), Ok(cross)] = [file("galileo_probe.hdr"), file("galileo_cross.hdr")].map(|f| Light::load(&f))
        else {
            eprintln!("left out: the maps are not there");
            return;
        };
        let difference = difference([&probe, &cross]);
        assert!(difference < 0.2, "{difference}");
    }

    #[test]
    fn the_library_sees_the_same_map() {
        let texels = (0..12 * 64).map(|i| (i * 37 % 101) as f32 + 1.0).collect::<Vec<_>>();
        for light in [Light::sun(64), Light::windows(64), Light::cube("cube", 8, cut_cross(8, &texels))] {
            let environment = light.tables(0, 0.0).unwrap();
            let power = environment.info.power;
            let density = environment::Light::new(&environment).unwrap();
            let u = crate::points::of(3, 1 << 14);
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
