//! What stands under the light: a disc, two spheres and a smooth knot of 8192 triangles.

use alloc::vec::Vec;
use core::f32::consts::PI;
use glam::{Vec3, vec3};

const ALONG: usize = 256;
const AROUND: usize = 16;
const TRIANGLES: usize = 2 * ALONG * AROUND;
const LEAF: usize = 4;
/// Leaves and inner nodes of a tree that halves the triangles.
const NODES: usize = 2 * TRIANGLES / LEAF - 1;
/// Nearer hits belong to the surface where the ray begins.
const NEAREST: f32 = 1e-3;
const DISC_RADIUS: f32 = 3.2;
const SPHERES: [(Vec3, f32, usize); 2] = [(vec3(-1.2, -0.25, 0.55), 0.55, 1), (vec3(1.2, -0.15, 0.55), 0.55, 2)];

/// The material of the disc, of the knot and the left sphere, and of the right sphere.
pub const MATERIALS: usize = 3;

/// Where a ray ends.
#[derive(Clone, Copy)]
pub struct Hit {
    pub distance: f32,
    pub position: Vec3,
    /// Unit length, on the side where the ray comes from.
    pub normal: Vec3,
    pub material: usize,
}

struct Triangle {
    corner: Vec3,
    edges: [Vec3; 2],
    normals: [Vec3; 3],
}

/// The triangles in the order of the tube, and a tree of their boxes: node n has the children 2n + 1 and 2n + 2.
pub struct Scene {
    triangles: Vec<Triangle>,
    boxes: Vec<[Vec3; 2]>,
}

/// A tube along a trefoil.
fn knot(s: f32, t: f32) -> Vec3 {
    let r = 2.0 + libm::cosf(1.5 * s) + 0.45 * libm::cosf(t);
    let z = r * libm::sinf(s) + 3.45;
    vec3(r * libm::cosf(s), libm::sinf(1.5 * s) + 0.45 * libm::sinf(t), z) * 0.25 + vec3(0.0, 0.35, 0.0)
}

fn vertex(along: usize, around: usize) -> (Vec3, Vec3) {
    let (s, t, step) = (4.0 * PI * along as f32 / ALONG as f32, 2.0 * PI * around as f32 / AROUND as f32, 0.01);
    let (ds, dt) = (knot(s + step, t) - knot(s - step, t), knot(s, t + step) - knot(s, t - step));
    (knot(s, t), dt.cross(ds).normalize())
}

impl Scene {
    pub fn new() -> Scene {
        let triangle = |i: usize| {
            let (s, t) = (i / 2 / AROUND, i / 2 % AROUND);
            let [(a, na), (b, nb), (c, nc)] = [vertex(s, t), vertex(s + 1, t + i % 2), vertex(s + 1 - i % 2, t + 1)];
            Triangle { corner: a, edges: [b - a, c - a], normals: [na, nb, nc] }
        };
        let triangles: Vec<Triangle> = (0..TRIANGLES).map(triangle).collect();
        let mut boxes = alloc::vec![[Vec3::INFINITY, Vec3::NEG_INFINITY]; NODES];
        for (i, Triangle { corner, edges, .. }) in triangles.iter().enumerate() {
            let of_leaf = &mut boxes[NODES / 2 + i / LEAF];
            for point in [*corner, *corner + edges[0], *corner + edges[1]] {
                *of_leaf = [of_leaf[0].min(point), of_leaf[1].max(point)];
            }
        }
        for i in (0..NODES / 2).rev() {
            let [a, b] = [boxes[2 * i + 1], boxes[2 * i + 2]];
            boxes[i] = [a[0].min(b[0]), a[1].max(b[1])];
        }
        Scene { triangles, boxes }
    }

    /// The nearest hit along a ray.
    pub fn trace(&self, o: Vec3, d: Vec3) -> Option<Hit> {
        let mut hit = Hit { distance: f32::INFINITY, position: o, normal: Vec3::ZERO, material: 0 };
        self.simple(o, d, &mut hit);
        self.mesh(o, d, &mut hit, false);
        if hit.distance == f32::INFINITY {
            return None;
        }
        let normal = hit.normal.normalize();
        Some(Hit { position: o + hit.distance * d, normal: if normal.dot(d) > 0.0 { -normal } else { normal }, ..hit })
    }

    /// Whether something stands in the way.
    pub fn blocks(&self, o: Vec3, d: Vec3) -> bool {
        let mut hit = Hit { distance: f32::INFINITY, position: o, normal: Vec3::ZERO, material: 0 };
        self.simple(o, d, &mut hit);
        hit.distance < f32::INFINITY || self.mesh(o, d, &mut hit, true)
    }

    fn simple(&self, o: Vec3, d: Vec3, hit: &mut Hit) {
        let to_floor = -o.z / d.z;
        let floor = o + to_floor * d;
        if floor.x * floor.x + floor.y * floor.y < DISC_RADIUS * DISC_RADIUS {
            offer(hit, to_floor, 0, || Vec3::Z);
        }
        for (centre, radius, material) in SPHERES {
            let to = centre - o;
            let along = to.dot(d);
            let square = along * along - to.dot(to) + radius * radius;
            if square > 0.0 {
                let root = libm::sqrtf(square);
                for distance in [along - root, along + root] {
                    offer(hit, distance, material, || distance * d - to);
                }
            }
        }
    }

    /// The mesh; `any`: the first triangle that is found will do.
    fn mesh(&self, o: Vec3, d: Vec3, hit: &mut Hit, any: bool) -> bool {
        let inverse = d.recip();
        let entry = |node: usize, farthest: f32| {
            let [low, high] = self.boxes[node];
            let (a, b) = ((low - o) * inverse, (high - o) * inverse);
            let (near, far) = (a.min(b).max_element().max(0.0), a.max(b).min_element());
            if near <= far.min(farthest) { near } else { f32::INFINITY }
        };
        let (mut stack, mut height) = ([0usize; 16], 1);
        if entry(0, hit.distance) == f32::INFINITY {
            return false;
        }
        let before = hit.distance;
        while height > 0 {
            height -= 1;
            let node = stack[height];
            if node >= NODES / 2 {
                let first = (node - NODES / 2) * LEAF;
                for triangle in &self.triangles[first..first + LEAF] {
                    triangle.hit(o, d, hit);
                }
                if any && hit.distance < before {
                    return true;
                }
                continue;
            }
            let children = [2 * node + 1, 2 * node + 2];
            let [a, b] = children.map(|child| entry(child, hit.distance));
            let order = if a < b { [(children[1], b), (children[0], a)] } else { [(children[0], a), (children[1], b)] };
            for (child, near) in order {
                if near < f32::INFINITY {
                    stack[height] = child;
                    height += 1;
                }
            }
        }
        hit.distance < before
    }
}

impl Triangle {
    /// Moeller and Trumbore 1997.
    fn hit(&self, o: Vec3, d: Vec3, hit: &mut Hit) {
        let [a, b] = self.edges;
        let (p, s) = (d.cross(b), o - self.corner);
        let inverse = 1.0 / a.dot(p);
        let x = s.dot(p) * inverse;
        if !(0.0..=1.0).contains(&x) {
            return;
        }
        let q = s.cross(a);
        let y = d.dot(q) * inverse;
        if y >= 0.0 && x + y <= 1.0 {
            let [na, nb, nc] = self.normals;
            offer(hit, b.dot(q) * inverse, 1, || (1.0 - x - y) * na + x * nb + y * nc);
        }
    }
}

/// Keeps a hit that is nearer than the one before.
fn offer(hit: &mut Hit, distance: f32, material: usize, normal: impl Fn() -> Vec3) {
    if distance > NEAREST && distance < hit.distance {
        *hit = Hit { distance, normal: normal(), material, ..*hit };
    }
}
