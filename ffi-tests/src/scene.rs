//! What is rendered: meshes under a tracer, and the shading points that a camera sees.

use crate::client;
use crate::cost::Cost;
use crate::embree::{Hit, Tracer};
use crate::mesh::Mesh;
use crate::points;
use crate::portal::Portal;
use anyhow::{Result, bail};
use glam::{Mat3, Vec3};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

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
    /// The normal on the side of the camera.
    pub normal: Vec3,
    /// To the camera.
    pub wo: Vec3,
}

impl ShadingPoint {
    /// Whether it is of the ground plane.
    pub fn is_ground(&self) -> bool {
        self.origin.z < 2e-4 && self.normal.z > 0.999
    }

    /// The view reflected about the normal.
    pub fn reflected(&self) -> Vec3 {
        (2.0 * self.normal.dot(self.wo) * self.normal - self.wo).normalize()
    }
}

/// A tracer and the shading points to estimate.
pub struct Scene {
    pub name: String,
    pub tracer: Tracer,
    /// The hits of a pixel stand together.
    pub points: Vec<ShadingPoint>,
    /// Hits of a pixel.
    pub hits: usize,
    /// What light comes through, and whether none comes from elsewhere.
    pub portals: Vec<Portal>,
    pub is_closed: bool,
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
    /// A mesh file on a ground plane, with the geometric normals of its triangles.
    ///
    /// # Errors
    /// The mesh cannot be read, or nothing is seen.
    pub fn from_file(path: &Path, view: View) -> Result<Scene> {
        Scene::of(&name_of(path), &Stage::outdoors(Mesh::load(path)?), view)
    }

    /// The same with normals interpolated between the vertices.
    ///
    /// # Errors
    /// The mesh cannot be read, or nothing is seen.
    pub fn smooth(path: &Path, view: View) -> Result<Scene> {
        let stage = Stage { is_smooth: true, ..Stage::outdoors(Mesh::load(path)?) };
        Scene::of(&format!("smooth {}", name_of(path)), &stage, view)
    }

    /// A mesh in a room with one window: most of the map is blocked.
    ///
    /// # Errors
    /// Nothing is seen.
    pub fn room(mesh: Mesh, view: View) -> Result<Scene> {
        Scene::of("room", &Stage::indoors(mesh, &[WINDOW]), view)
    }

    /// Meshes on a ground plane, turned about the axis that points up.
    ///
    /// # Errors
    /// Nothing is seen.
    pub fn turned(name: &str, mesh: &Mesh, angle: f32, view: View) -> Result<Scene> {
        Scene::of(name, &Stage::outdoors(mesh.turned(angle)), view)
    }

    /// Spheres and blocks on a ground plane.
    ///
    /// # Errors
    /// Embree reports an error.
    pub fn procedural(view: View) -> Result<Scene> {
        let meshes = std::iter::once(Mesh::ground(4.0)).chain(Mesh::toys());
        Scene::of("procedural", &Stage::of(meshes.collect()), view)
    }

    /// What a view shows of a stage.
    ///
    /// # Errors
    /// Nothing is seen, or Embree reports an error.
    pub fn of(name: &str, stage: &Stage, view: View) -> Result<Scene> {
        let tracer = Tracer::new(&stage.meshes)?;
        let normals = stage.is_smooth.then(|| stage.meshes.iter().map(Mesh::normals).collect());
        let walked = if let View::Around(_, angle) = view { angle } else { 0.0 };
        let eye = Mat3::from_rotation_z(walked) * stage.eye;
        let camera = Camera::new(eye, stage.target);
        let surface = Surface { tracer: &tracer, meshes: &stage.meshes, normals };
        let (hits, points) = match view {
            View::Points(count) => (1, thinned(&camera.first_hits(&surface, 1), count)),
            View::Image(step) | View::Around(step, _) => (1, camera.first_hits(&surface, step)),
            View::Hits(count, hits) => {
                let pixels = thinned(&camera.first_hits(&surface, 1), count);
                let within = pixels.iter().map(|pixel| camera.hits_within(&surface, pixel.pixel, hits));
                (hits, within.filter(|within| within.len() == hits).flatten().collect())
            }
        };
        if points.is_empty() {
            bail!("scene {name}: no shading points");
        }
        let name = if hits > 1 { format!("{name}, {hits} hits") } else { name.into() };
        let (portals, is_closed) = (stage.portals.clone(), stage.is_closed);
        Ok(Scene { name, tracer, points, hits, portals, is_closed })
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

/// Meshes, and where the camera stands.
pub struct Stage {
    meshes: Vec<Mesh>,
    /// Whether normals are interpolated between vertices.
    is_smooth: bool,
    eye: Vec3,
    target: Vec3,
    portals: Vec<Portal>,
    is_closed: bool,
}

impl Stage {
    fn of(meshes: Vec<Mesh>) -> Stage {
        let (eye, target) = (Vec3::new(1.1, -2.4, 1.0), Vec3::new(0.0, 0.0, 0.42));
        Stage { meshes, is_smooth: false, eye, target, portals: Vec::new(), is_closed: false }
    }

    /// A mesh on a ground plane.
    pub fn outdoors(mesh: Mesh) -> Stage {
        Stage::of(vec![Mesh::ground(4.0), mesh])
    }

    /// The same with portals, which are not all that light comes through.
    pub fn with_portals(self, portals: Vec<Portal>) -> Stage {
        Stage { portals, is_closed: false, ..self }
    }

    /// The same seen from a share of the distance, with a target of its own.
    pub fn close_up(self, target: Vec3, share: f32) -> Stage {
        Stage { eye: target + (self.eye - self.target) * share, target, ..self }
    }

    /// A mesh in a room of 4 x 4 x 2.4 whose only light comes through `openings`, each of which has a portal.
    pub fn indoors(mesh: Mesh, openings: &[Opening]) -> Stage {
        let block = |low: [f32; 3], high: [f32; 3]| Mesh::block(Vec3::from_array(low), Vec3::from_array(high));
        let mut walls = vec![mesh, Mesh::ground(2.2), block([-2.2, -2.2, 2.4], [2.2, 2.2, 2.6])];
        let mut portals = Vec::new();
        for wall in 0..4 {
            // Walls are made at +x and turned; openings stand from one end to the other.
            let turn = Mat3::from_cols_array(&[0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
            let turned = |v: Vec3| (0..wall).fold(v, |v, _| turn * v);
            let mut add = |low: [f32; 3], high: [f32; 3]| {
                let mut mesh = block(low, high);
                mesh.vertices.iter_mut().for_each(|v| *v = turned(*v));
                walls.push(mesh);
            };
            let mut from = -2.2;
            for &Opening { across: [left, right], up: [sill, lintel], .. } in
                openings.iter().filter(|opening| opening.wall == wall)
            {
                add([2.0, from, 0.0], [2.2, left, 2.4]);
                add([2.0, left, lintel], [2.2, right, 2.4]);
                if sill > 0.0 {
                    add([2.0, left, 0.0], [2.2, right, sill]);
                }
                let edges = [Vec3::Z * (lintel - sill), Vec3::Y * (right - left)].map(turned);
                portals.push(Portal { corner: turned(Vec3::new(2.0, left, sill)), edges });
                from = right;
            }
            add([2.0, from, 0.0], [2.2, 2.2, 2.4]);
        }
        let (eye, target) = (Vec3::new(-0.4, -1.9, 1.2), Vec3::new(0.1, 0.2, 0.55));
        Stage { eye, target, portals, is_closed: true, ..Stage::of(walls) }
    }
}

/// An opening in a wall of a room: of those at +x, +y, -x and -y the first to the fourth, from one end to the other.
#[derive(Clone, Copy)]
pub struct Opening {
    pub wall: usize,
    pub across: [f32; 2],
    pub up: [f32; 2],
}

/// A window of 1.6 x 1.1 to the right of the camera.
pub const WINDOW: Opening = Opening { wall: 0, across: [-0.8, 0.8], up: [0.7, 1.8] };

fn name_of(path: &Path) -> String {
    path.file_stem().and_then(|n| n.to_str()).unwrap_or("mesh").into()
}

/// What rays of the camera meet.
struct Surface<'a> {
    tracer: &'a Tracer,
    meshes: &'a [Mesh],
    /// Those of the vertices of each mesh, where they are interpolated.
    normals: Option<Vec<Vec<Vec3>>>,
}

impl Surface<'_> {
    /// The shading normal of a hit, on the side of the geometric one that faces the camera.
    fn normal(&self, hit: &Hit, geometric: Vec3, wo: Vec3) -> Vec3 {
        let Some(normals) = &self.normals else { return geometric };
        let corners = self.meshes[hit.mesh as usize].triangles[hit.triangle as usize];
        let [a, b, c] = corners.map(|i| normals[hit.mesh as usize][i as usize]);
        let [v, w] = hit.weights;
        let smooth = (a * (1.0 - v - w) + b * v + c * w).normalize_or_zero();
        let smooth = if smooth.dot(geometric) < 0.0 { -smooth } else { smooth };
        // Near silhouettes an interpolated normal may face away: such a point has no view of its own.
        if smooth.dot(wo) > 0.02 { smooth } else { geometric }
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
    fn first_hits(&self, surface: &Surface, step: u32) -> Vec<ShadingPoint> {
        let on = |length: u32| (0..length).step_by(step as usize);
        let pixels = on(HEIGHT).flat_map(|y| on(WIDTH).map(move |x| [x, y]));
        pixels.filter_map(|pixel| self.hit(surface, pixel, 0, [0.5; 2])).collect()
    }

    /// What is seen through random places of a pixel.
    fn hits_within(&self, surface: &Surface, pixel: [u32; 2], hits: usize) -> Vec<ShadingPoint> {
        let places = points::of(client::pixel_seed(pixel, u32::MAX), hits);
        (0..).zip(places).filter_map(|(hit, place)| self.hit(surface, pixel, hit, place)).collect()
    }

    fn hit(&self, surface: &Surface, pixel: [u32; 2], hit: u32, place: [f32; 2]) -> Option<ShadingPoint> {
        let x = (pixel[0] as f32 + place[0]) / WIDTH as f32 * 2.0 - 1.0;
        let y = 1.0 - (pixel[1] as f32 + place[1]) / HEIGHT as f32 * 2.0;
        let direction = (self.forward + self.right * x + self.up * y).normalize();
        let found = surface.tracer.intersect(self.eye, direction)?;
        let geometric = if found.normal.dot(direction) < 0.0 { found.normal } else { -found.normal };
        let origin = self.eye + direction * found.distance + geometric * OFFSET;
        let normal = surface.normal(&found, geometric, -direction);
        Some(ShadingPoint { pixel, hit, origin, normal, wo: -direction })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sphere of few triangles whose normals are interpolated has about those of a sphere; without, it has not.
    #[test]
    fn normals_are_interpolated_where_they_should_be() {
        let centre = Vec3::new(0.0, 0.0, 0.5);
        let worst = |is_smooth: bool| {
            let stage = Stage { is_smooth, ..Stage::outdoors(Mesh::sphere(centre, 0.5, 12)) };
            let scene = Scene::of("sphere", &stage, View::Points(500)).unwrap();
            // Near the outline an interpolated normal is moved to the side of the viewer.
            let radial = |p: &ShadingPoint| (p.origin - centre).normalize();
            let facing = scene.points.iter().filter(|p| p.origin.z > 0.01 && p.wo.dot(radial(p)) > 0.3);
            facing.map(|p| 1.0 - p.normal.dot(radial(p))).fold(0.0, f32::max)
        };
        let [smooth, flat] = [worst(true), worst(false)];
        assert!(smooth < 0.002 && flat > 0.005, "{smooth} {flat}");
    }

    /// Rays from the points of a room leave it through its window and nowhere else.
    #[test]
    fn a_room_is_dark_but_for_its_window() {
        let scene = Scene::room(Mesh::sphere(Vec3::new(0.0, 0.0, 0.4), 0.4, 24), View::Points(200)).unwrap();
        let direction = |u: [f32; 2]| crate::light::octahedral_direction(u[0], u[1]);
        let directions: Vec<Vec3> = points::of(1, 64).into_iter().map(direction).collect();
        let (mut seen, mut through) = (0, 0);
        for (point, wi) in scene.points.iter().flat_map(|p| directions.iter().map(move |wi| (p, *wi))) {
            if scene.visible(point, wi) {
                let at = point.origin + wi * ((2.0 - point.origin.x) / wi.x);
                seen += 1;
                through += usize::from(wi.x > 0.0 && at.y.abs() < 0.81 && (0.69..1.81).contains(&at.z));
            }
        }
        assert!(seen > 0 && seen == through && seen * 8 < scene.points.len() * directions.len(), "{seen} {through}");
    }
}
