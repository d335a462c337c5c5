//! Triangle meshes: read from OBJ and PLY files, or made of spheres, blocks and a ground plane.

use anyhow::{Context, Result, bail};
use glam::{Mat3, Vec3};
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};
use std::path::Path;

/// Triangles by the indices of their vertices, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    pub vertices: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Reads a mesh whose y axis points up, turns it to z up, scales it to the unit height and puts it on z = 0.
    ///
    /// # Errors
    /// A file that cannot be read, is neither `.obj` nor `.ply`, or holds no triangle.
    pub fn load(path: &Path) -> Result<Mesh> {
        let mesh = match path.extension().and_then(|e| e.to_str()) {
            Some("obj") => load_obj(path),
            Some("ply") => load_ply(path),
            _ => bail!("neither .obj nor .ply"),
        };
        let mesh = mesh.with_context(|| format!("mesh {}", path.display()))?;
        if mesh.triangles.is_empty() {
            bail!("mesh {}: no triangle", path.display());
        }
        Ok(mesh.stood_up())
    }

    /// A sphere of `2 * stacks` slices.
    pub fn sphere(centre: Vec3, radius: f32, stacks: u32) -> Mesh {
        let slices = 2 * stacks;
        let vertex = |row: u32, column: u32| {
            let theta = row as f32 / stacks as f32 * std::f32::consts::PI;
            let phi = column as f32 / slices as f32 * std::f32::consts::TAU;
            centre + radius * Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
        };
        let vertices = (0..=stacks).flat_map(|row| (0..slices).map(move |column| vertex(row, column))).collect();
        let index = |row: u32, column: u32| row * slices + column % slices;
        let quads = (0..stacks).flat_map(|row| (0..slices).map(move |column| (row, column)));
        let triangles = quads.flat_map(|(r, c)| {
            let [a, b, below_a, below_b] = [index(r, c), index(r, c + 1), index(r + 1, c), index(r + 1, c + 1)];
            [[a, below_a, below_b], [a, below_b, b]]
        });
        Mesh { vertices, triangles: triangles.collect() }
    }

    /// An axis-parallel block.
    pub fn block(low: Vec3, high: Vec3) -> Mesh {
        let corner = |i: u32| {
            let pick = |bit: u32, low, high| if i >> bit & 1 == 0 { low } else { high };
            Vec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z))
        };
        let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
        Mesh { vertices: (0..8).map(corner).collect(), triangles: triangles.collect() }
    }

    /// Spheres and blocks that stand on z = 0.
    pub fn toys() -> [Mesh; 4] {
        [
            Mesh::sphere(Vec3::new(0.0, 0.0, 0.5), 0.5, 48),
            Mesh::sphere(Vec3::new(0.75, -0.35, 0.25), 0.25, 32),
            Mesh::block(Vec3::new(-0.95, -0.3, 0.0), Vec3::new(-0.65, 0.5, 0.9)),
            Mesh::block(Vec3::new(-0.5, -0.8, 0.0), Vec3::new(-0.2, -0.6, 0.3)),
        ]
    }

    /// The square |x|, |y| <= half at z = 0, seen from above.
    pub fn ground(half: f32) -> Mesh {
        let corners = [(-half, -half), (half, -half), (half, half), (-half, half)];
        let vertices = corners.iter().map(|&(x, y)| Vec3::new(x, y, 0.0)).collect();
        Mesh { vertices, triangles: vec![[0, 1, 2], [0, 2, 3]] }
    }

    /// The same square as `side` x `side` vertices.
    pub fn grid(half: f32, side: u32) -> Mesh {
        let at = |i: u32| half * (2.0 * i as f32 / (side - 1) as f32 - 1.0);
        let vertices = (0..side * side).map(|i| Vec3::new(at(i % side), at(i / side), 0.0)).collect();
        let corners = (0..(side - 1) * (side - 1)).map(|i| i / (side - 1) * side + i % (side - 1));
        let triangles = corners.flat_map(|i| [[i, i + 1, i + side], [i + 1, i + side + 1, i + side]]);
        Mesh { vertices, triangles: triangles.collect() }
    }

    /// The normal at each vertex: the mean of those of its triangles, by area.
    pub fn normals(&self) -> Vec<Vec3> {
        let mut normals = vec![Vec3::ZERO; self.vertices.len()];
        for corners in &self.triangles {
            let [a, b, c] = corners.map(|i| self.vertices[i as usize]);
            corners.iter().for_each(|&i| normals[i as usize] += (b - a).cross(c - a));
        }
        normals.into_iter().map(Vec3::normalize_or_zero).collect()
    }

    /// The low and the high corner of the bounding box.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let start = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        self.vertices.iter().fold(start, |(low, high), &v| (low.min(v), high.max(v)))
    }

    /// Rotated about the z axis by an angle in radians.
    pub fn turned(&self, angle: f32) -> Mesh {
        let turn = Mat3::from_rotation_z(angle);
        Mesh { vertices: self.vertices.iter().map(|&v| turn * v).collect(), triangles: self.triangles.clone() }
    }

    fn stood_up(mut self) -> Mesh {
        for v in &mut self.vertices {
            *v = Vec3::new(v.x, -v.z, v.y);
        }
        let (low, high) = self.bounds();
        let foot = Vec3::new((low.x + high.x) / 2.0, (low.y + high.y) / 2.0, low.z);
        let scale = 1.0 / (high.z - low.z).max(f32::MIN_POSITIVE);
        for v in &mut self.vertices {
            *v = (*v - foot) * scale;
        }
        self
    }
}

fn load_obj(path: &Path) -> Result<Mesh> {
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let (models, _) = tobj::load_obj(path, &options)?;
    let mut mesh = Mesh::default();
    for model in models {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(model.mesh.positions.chunks_exact(3).map(Vec3::from_slice));
        let corners = model.mesh.indices.chunks_exact(3);
        mesh.triangles.extend(corners.map(|c| [first + c[0], first + c[1], first + c[2]]));
    }
    Ok(mesh)
}

fn load_ply(path: &Path) -> Result<Mesh> {
    let mut reader = std::io::BufReader::new(std::fs::File::open(path)?);
    let ply = Parser::<DefaultElement>::new().read_ply(&mut reader)?;
    let vertices = ply.payload.get("vertex").context("no vertices")?.iter().map(ply_position);
    let vertices = vertices.collect::<Option<Vec<Vec3>>>().context("a vertex without x, y, z")?;
    let faces = ply.payload.get("face").context("no faces")?.iter().map(ply_polygon).collect::<Result<Vec<_>>>()?;
    let triangles = faces.iter().flat_map(|f| f.windows(2).skip(1).map(|edge| [f[0], edge[0], edge[1]]));
    Ok(Mesh { triangles: triangles.collect(), vertices })
}

fn ply_position(element: &DefaultElement) -> Option<Vec3> {
    let number = |name: &str| match element.get(name) {
        Some(&Property::Float(x)) => Some(x),
        Some(&Property::Double(x)) => Some(x as f32),
        _ => None,
    };
    Some(Vec3::new(number("x")?, number("y")?, number("z")?))
}

fn ply_polygon(element: &DefaultElement) -> Result<Vec<u32>> {
    match element.get("vertex_indices").or(element.get("vertex_index")) {
        Some(Property::ListInt(indices)) => Ok(indices.iter().map(|&i| i as u32).collect()),
        Some(Property::ListUInt(indices)) => Ok(indices.clone()),
        _ => bail!("a face without vertex indices"),
    }
}
