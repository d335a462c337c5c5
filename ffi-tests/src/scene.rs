//! What is rendered: meshes under a tracer, and the shading points that a camera sees.

use crate::client;
use crate::cost::Cost;
use crate::embree::Tracer;
use crate::mesh::Mesh;
use crate::points;
use anyhow::{Result, bail};
use glam::{Mat3, Vec3};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// Rays start this far above the surface; the meshes are of unit size.
const OFFSET: f32 = 1e-4;
/// The G-buffer before it is thinned out.
pub const WIDTH: u32 = 480;
pub const HEIGHT: u32 = 270;

/// A pixel's first hit.
#[derive(Clone, Copy, Debug)]
pub struct ShadingPoint {
    /// The pixel: its own scramble of the points comes from it.
    pub pixel: [u32; 2],
    /// Which of the pixel's hits it is: its samples are those after the other hits'.
    pub hit: u32,
    /// Where shadow rays start.
    pub origin: Vec3,
    /// The geometric normal on the side of the camera.
    pub normal: Vec3,
    /// To the camera.
    pub wo: Vec3,
}

/// A tracer and the shading points to estimate.
pub struct Scene {
    pub name: String,
    pub tracer: Tracer,
    /// The hits of a pixel stand together.
    pub points: Vec<ShadingPoint>,
    /// For each pixel, hits of other pixels of its tile.
    pub tiles: Vec<Vec<ShadingPoint>>,
    /// Hits of a pixel.
    pub hits: usize,
}

/// How the camera looks at a scene.
#[derive(Clone, Copy, Debug)]
pub enum View {
    /// So many pixels, one hit through the middle of each.
    Points(usize),
    /// So many pixels of as many hits at random places: what a path tracer sees.
    Hits(usize, usize),
    /// All pixels of every so many columns and rows.
    Image(u32),
    /// The same after the camera has walked about the axis that points up, by an angle in radians.
    Around(u32, f32),
}

impl Scene {
    /// A mesh file on a ground plane.
    ///
    /// # Errors
    /// The mesh cannot be read, or nothing is seen.
    pub fn from_file(path: &Path, view: View) -> Result<Scene> {
        let name = path.file_stem().and_then(|n| n.to_str()).unwrap_or("mesh");
        Scene::new(name, &[Mesh::ground(4.0), Mesh::load(path)?], view)
    }

    /// What the report looks at, for each mesh, or spheres and blocks without one: so many pixels of one hit, and unless it is
    /// quick a sixteenth of them with 64 hits, since each of these hits has a reference of its own.
    ///
    /// # Errors
    /// A mesh cannot be read, or nothing is seen.
    pub fn of_report(meshes: &[PathBuf], points: usize, quick: bool) -> Result<Vec<Scene>> {
        let views = [View::Points(points), View::Hits(points.div_ceil(16), 64)];
        let views = &views[..if quick { 1 } else { 2 }];
        if meshes.is_empty() {
            return views.iter().map(|&view| Scene::procedural(view)).collect();
        }
        meshes.iter().flat_map(|path| views.iter().map(|&view| Scene::from_file(path, view))).collect()
    }

    /// Meshes on a ground plane, turned about the axis that points up.
    ///
    /// # Errors
    /// Nothing is seen.
    pub fn turned(name: &str, mesh: &Mesh, angle: f32, view: View) -> Result<Scene> {
        Scene::new(name, &[Mesh::ground(4.0), mesh.turned(angle)], view)
    }

    /// Spheres and blocks on a ground plane.
    ///
    /// # Errors
    /// Embree reports an error.
    pub fn procedural(view: View) -> Result<Scene> {
        let meshes = [
            Mesh::ground(4.0),
            Mesh::sphere(Vec3::new(0.0, 0.0, 0.5), 0.5, 48),
            Mesh::sphere(Vec3::new(0.75, -0.35, 0.25), 0.25, 32),
            Mesh::block(Vec3::new(-0.95, -0.3, 0.0), Vec3::new(-0.65, 0.5, 0.9)),
            Mesh::block(Vec3::new(-0.5, -0.8, 0.0), Vec3::new(-0.2, -0.6, 0.3)),
        ];
        Scene::new("procedural", &meshes, view)
    }

    fn new(name: &str, meshes: &[Mesh], view: View) -> Result<Scene> {
        let tracer = Tracer::new(meshes)?;
        let walked = if let View::Around(_, angle) = view { angle } else { 0.0 };
        let eye = Mat3::from_rotation_z(walked) * Vec3::new(1.1, -2.4, 1.0);
        let camera = Camera::new(eye, Vec3::new(0.0, 0.0, 0.42));
        let seen = |step: u32| camera.first_hits(&tracer, step);
        let (hits, points) = match view {
            View::Points(count) => (1, thinned(&seen(1), count)),
            View::Image(step) | View::Around(step, _) => (1, seen(step)),
            View::Hits(count, hits) => {
                let pixels = thinned(&seen(1), count);
                let within = pixels.iter().map(|pixel| camera.hits_within(&tracer, pixel.pixel, hits));
                (hits, within.filter(|within| within.len() == hits).flatten().collect())
            }
        };
        if points.is_empty() {
            bail!("scene {name}: no shading points");
        }
        let pixels = points.iter().step_by(hits).map(|point| point.pixel);
        let tiles = pixels.map(|pixel| camera.tile_of(&tracer, pixel)).collect();
        let name = if hits > 1 { format!("{name}, {hits} hits") } else { name.into() };
        Ok(Scene { name, tracer, points, tiles, hits })
    }

    /// Tells scenes apart by their shading points.
    pub fn fingerprint(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        for point in &self.points {
            (point.pixel, point.hit).hash(&mut hasher);
            let vectors = [point.origin, point.normal, point.wo];
            vectors.iter().flat_map(|v| v.to_array()).for_each(|x| x.to_bits().hash(&mut hasher));
        }
        hasher.finish()
    }

    /// Whether light from a direction reaches a point.
    pub fn visible(&self, point: &ShadingPoint, wi: Vec3) -> bool {
        self.visible_at(Cost::CHEAP, point, wi)
    }

    /// The same where a ray has a cost. Directions below the surface need no ray.
    pub fn visible_at(&self, cost: Cost, point: &ShadingPoint, wi: Vec3) -> bool {
        let above = point.normal.dot(wi) > 0.0;
        if above {
            cost.trace();
        }
        above && !self.tracer.occluded(point.origin, wi)
    }
}

/// At most `count` elements, evenly spread.
fn thinned(seen: &[ShadingPoint], count: usize) -> Vec<ShadingPoint> {
    let count = count.min(seen.len());
    (0..count).map(|i| seen[i * seen.len() / count]).collect()
}

/// A pinhole camera.
struct Camera {
    eye: Vec3,
    forward: Vec3,
    right: Vec3,
    up: Vec3,
}

impl Camera {
    fn new(eye: Vec3, target: Vec3) -> Camera {
        let half_width = 0.42;
        let forward = (target - eye).normalize();
        let right = forward.cross(Vec3::Z).normalize();
        let up = right.cross(forward) * (half_width * HEIGHT as f32 / WIDTH as f32);
        Camera { eye, forward, right: right * half_width, up }
    }

    /// What is seen through the middles of every `step`-th pixel.
    fn first_hits(&self, tracer: &Tracer, step: u32) -> Vec<ShadingPoint> {
        let on = |length: u32| (0..length).step_by(step as usize);
        let pixels = on(HEIGHT).flat_map(|y| on(WIDTH).map(move |x| [x, y]));
        pixels.filter_map(|pixel| self.hit(tracer, pixel, 0, [0.5; 2])).collect()
    }

    /// What is seen through random places of a pixel.
    fn hits_within(&self, tracer: &Tracer, pixel: [u32; 2], hits: usize) -> Vec<ShadingPoint> {
        let mut places = vec![[0.0; 2]; hits];
        points::sobol(client::pixel_seed(pixel, u32::MAX), 0, &mut places);
        (0..).zip(places).filter_map(|(hit, place)| self.hit(tracer, pixel, hit, place)).collect()
    }

    /// What is seen through sixteen pixels of a pixel's tile of 8 x 8, without that pixel.
    fn tile_of(&self, tracer: &Tracer, pixel: [u32; 2]) -> Vec<ShadingPoint> {
        let [left, top] = pixel.map(|x| x & !7);
        let places = (0..16).map(|i| [left + 2 * (i % 4) + 1, top + 2 * (i / 4) + 1]);
        places.filter(|&place| place != pixel).filter_map(|place| self.hit(tracer, place, 0, [0.5; 2])).collect()
    }

    fn hit(&self, tracer: &Tracer, pixel: [u32; 2], hit: u32, place: [f32; 2]) -> Option<ShadingPoint> {
        let x = (pixel[0] as f32 + place[0]) / WIDTH as f32 * 2.0 - 1.0;
        let y = 1.0 - (pixel[1] as f32 + place[1]) / HEIGHT as f32 * 2.0;
        let direction = (self.forward + self.right * x + self.up * y).normalize();
        let found = tracer.intersect(self.eye, direction)?;
        let normal = if found.normal.dot(direction) < 0.0 { found.normal } else { -found.normal };
        let origin = self.eye + direction * found.distance + normal * OFFSET;
        Some(ShadingPoint { pixel, hit, origin, normal, wo: -direction })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scene for each mesh and view, whether the meshes were named or not.
    #[test]
    fn every_mesh_is_seen_in_every_view() {
        let folder = std::env::temp_dir().join(format!("wis-views-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let file = folder.join("slab.obj");
        std::fs::write(&file, "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv 0 1 0\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n")
            .unwrap();
        let scenes = Scene::of_report(&[file], 64, false).unwrap();
        std::fs::remove_dir_all(&folder).unwrap();
        let hits: Vec<(usize, usize)> =
            scenes.iter().map(|scene| (scene.hits, scene.points.len() / scene.hits)).collect();
        assert_eq!(hits[0], (1, 64));
        assert!(hits.len() == 2 && hits[1].0 == 64 && (1..=4).contains(&hits[1].1), "{hits:?}");
        assert!(scenes[1].name.ends_with("64 hits"));
        assert_eq!(Scene::of_report(&[], 16, true).unwrap().len(), 1);
    }
}
