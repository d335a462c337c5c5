//! What is rendered: meshes under a tracer, and the shading points that a camera sees.

use crate::embree::Tracer;
use crate::mesh::Mesh;
use anyhow::{Result, bail};
use glam::Vec3;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

/// Rays start this far above the surface; the meshes are of unit size.
const OFFSET: f32 = 1e-4;
/// The G-buffer before it is thinned out.
const WIDTH: u32 = 480;
const HEIGHT: u32 = 270;

/// A pixel's first hit.
#[derive(Clone, Copy, Debug)]
pub struct ShadingPoint {
    /// The pixel: its own scramble of the points comes from it.
    pub pixel: [u32; 2],
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
    pub points: Vec<ShadingPoint>,
}

impl Scene {
    /// A mesh file on a ground plane, with `count` shading points.
    ///
    /// # Errors
    /// The mesh cannot be read, or nothing is seen.
    pub fn from_file(path: &Path, count: usize) -> Result<Scene> {
        let name = path.file_stem().and_then(|n| n.to_str()).unwrap_or("mesh");
        Scene::new(name, &[Mesh::ground(4.0), Mesh::load(path)?], count)
    }

    /// Spheres and blocks on a ground plane, with `count` shading points.
    ///
    /// # Errors
    /// Embree reports an error.
    pub fn procedural(count: usize) -> Result<Scene> {
        let meshes = [
            Mesh::ground(4.0),
            Mesh::sphere(Vec3::new(0.0, 0.0, 0.5), 0.5, 48),
            Mesh::sphere(Vec3::new(0.75, -0.35, 0.25), 0.25, 32),
            Mesh::block(Vec3::new(-0.95, -0.3, 0.0), Vec3::new(-0.65, 0.5, 0.9)),
            Mesh::block(Vec3::new(-0.5, -0.8, 0.0), Vec3::new(-0.2, -0.6, 0.3)),
        ];
        Scene::new("procedural", &meshes, count)
    }

    fn new(name: &str, meshes: &[Mesh], count: usize) -> Result<Scene> {
        let tracer = Tracer::new(meshes)?;
        let eye = Vec3::new(1.1, -2.4, 1.0);
        let seen = first_hits(&tracer, eye, Vec3::new(0.0, 0.0, 0.42));
        if seen.is_empty() || count == 0 {
            bail!("scene {name}: no shading points");
        }
        let points = (0..count.min(seen.len())).map(|i| seen[i * seen.len() / count.min(seen.len())]).collect();
        Ok(Scene { name: name.into(), tracer, points })
    }

    /// Tells scenes apart by their shading points.
    pub fn fingerprint(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        for point in &self.points {
            point.pixel.hash(&mut hasher);
            let vectors = [point.origin, point.normal, point.wo];
            vectors.iter().flat_map(|v| v.to_array()).for_each(|x| x.to_bits().hash(&mut hasher));
        }
        hasher.finish()
    }

    /// Whether light from a direction reaches a point.
    pub fn visible(&self, point: &ShadingPoint, wi: Vec3) -> bool {
        point.normal.dot(wi) > 0.0 && !self.tracer.occluded(point.origin, wi)
    }
}

/// The G-buffer of a pinhole camera.
fn first_hits(tracer: &Tracer, eye: Vec3, target: Vec3) -> Vec<ShadingPoint> {
    let forward = (target - eye).normalize();
    let right = forward.cross(Vec3::Z).normalize();
    let up = right.cross(forward);
    let half_width = 0.42;
    let half_height = half_width * HEIGHT as f32 / WIDTH as f32;
    let pixels = (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| [x, y]));
    let hit = |pixel: [u32; 2]| {
        let x = (pixel[0] as f32 + 0.5) / WIDTH as f32 * 2.0 - 1.0;
        let y = 1.0 - (pixel[1] as f32 + 0.5) / HEIGHT as f32 * 2.0;
        let direction = (forward + right * (x * half_width) + up * (y * half_height)).normalize();
        let hit = tracer.intersect(eye, direction)?;
        let normal = if hit.normal.dot(direction) < 0.0 { hit.normal } else { -hit.normal };
        let origin = eye + direction * hit.distance + normal * OFFSET;
        Some(ShadingPoint { pixel, origin, normal, wo: -direction })
    };
    pixels.filter_map(hit).collect()
}
