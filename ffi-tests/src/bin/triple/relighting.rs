//! Relights all vertices of a mesh: visibility by Embree at every vertex, BRDFs by their normals, a light that turns.

use crate::approximation::by_pixels;
use crate::domain::Domain;
use crate::threads::{THREADS, on_threads};
use anyhow::Result;
use glam::{Mat3, Vec3};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::time::Instant;
use wis_ffi_tests::client::{self, Tree, Visibility, raw};
use wis_ffi_tests::data;
use wis_ffi_tests::embree::Tracer;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::mesh::Mesh;

/// What the Lambert surface reflects.
const ALBEDO: f32 = 0.7;
/// Wavelets of BRDF and light that are kept.
const TERMS: [usize; 5] = [24, 48, 96, 192, 768];
/// Vertices whose error is measured.
const CHECKED: usize = 1000;
/// Vertices that are lit by a product before it is left: it stays in the cache.
const TOGETHER: usize = 2048;
const FRAMES: u8 = 3;

struct Vertex {
    normal: Vec3,
    /// For each face.
    visible: Vec<Visibility>,
}

/// The BRDF x cosine of a normal.
type Pixels = Vec<f32>;

/// Writes the section.
pub fn write(out: &mut String, light: &Light) -> Result<()> {
    visibility_sizes(out)?;
    writeln!(out, "\n## Relighting the vertices of a mesh\n\n{TEXT}")?;
    let (bunny, buddha) = (data::mesh("stanford-bunny.obj")?, data::mesh("buddha.obj")?.subdivided());
    let scenes = [
        ("Stanford bunny on a ground plane", bunny.clone(), Domain::cube(6)),
        ("Buddha on a ground plane", buddha, Domain::cube(6)),
        ("Stanford bunny on a ground plane", bunny, Domain::octahedral(6)),
    ];
    for ((name, mesh, domain), count) in scenes.into_iter().zip([100_000, 300_000, 100_000]) {
        let side = (count.max(mesh.vertices.len() + 16) - mesh.vertices.len()).isqrt();
        let ground = Mesh::grid(2.0, side as u32);
        scene(out, name, &[ground, mesh], domain, light)?;
    }
    Ok(())
}

const TEXT: &str = "Lambert; the light turns from frame to frame, luminance only. The vertices of a mesh and of the ground beneath it
are lit on two threads. Errors are relative L2, over 1000 vertices, of the sum over pixels with the BRDF of the vertex's own
normal. The paper takes 3 to 5 s for 100 to 300 thousand vertices at 6 x 64 x 64.

- *Terms*: the paper's way. A frame is the light's trees and its largest wavelets, and a sublinear integral for every vertex,
  with as many wavelets of the BRDF of the nearest of 32 x 32 normals.
- *Products*: a frame multiplies the light by the BRDF of each normal once, exactly, and `wis_visibility_product_integral`
  sums up what a vertex sees of it. What is off is the normal: the nearest of a grid, or four and their weights.
";

/// The vertices of meshes, their normals and what they see.
fn vertices(meshes: &[Mesh], domain: Domain) -> Result<Vec<Vertex>> {
    let tracer = Tracer::new(meshes)?;
    let directions = domain.directions();
    let places: Vec<(Vec3, Vec3)> =
        meshes.iter().flat_map(|mesh| mesh.vertices.iter().copied().zip(normals(mesh))).collect();
    on_threads(&places, |place| {
        let trees = domain.trees(&seen(&tracer, *place, &directions))?;
        let visible = trees.iter().map(Visibility::new).collect::<Result<Vec<_>, _>>()?;
        Ok(Vertex { normal: place.1, visible })
    })
}

/// Which directions a vertex sees: eight rays at a time, unless all lie below the horizon.
fn seen(tracer: &Tracer, (position, normal): (Vec3, Vec3), directions: &[Vec3]) -> Vec<f32> {
    let origin = position + normal * 1e-3;
    let eight = |wi: &[Vec3]| {
        let wi = <[Vec3; 8]>::try_from(wi).expect("pixels by eights");
        let above = wi.map(|wi| wi.dot(normal) > 0.0);
        let hidden = if above.contains(&true) { tracer.occluded8(origin, &wi) } else { [true; 8] };
        std::array::from_fn::<f32, 8, _>(|i| f32::from(u8::from(above[i] && !hidden[i])))
    };
    directions.chunks(8).flat_map(eight).collect()
}

fn scene(out: &mut String, name: &str, meshes: &[Mesh], domain: Domain, light: &Light) -> Result<()> {
    let start = Instant::now();
    let vertices = vertices(meshes, domain)?;
    let seconds = start.elapsed().as_secs_f64();
    let bytes: usize = vertices.iter().flat_map(|v| v.visible.iter().map(Visibility::bytes)).sum();
    let count = vertices.len();
    writeln!(
        out,
        "\n### {name}, {count} vertices, {}\n\nVisibility: {seconds:.0} s on {THREADS} threads, {:.1} kB a vertex in 8 bits, {:.0} \
         MB. Light: {}.\n",
        domain.name(),
        bytes as f64 / count as f64 / 1e3,
        bytes as f64 / 1e6,
        light.name
    )?;
    let step = (count / CHECKED).max(1);
    let checked: Vec<usize> = (0..count).step_by(step).collect();
    let mut scene = Scene { domain, vertices, frames: Vec::new(), checked, exact: Vec::new() };
    for frame in 0..FRAMES {
        scene.frames.push(domain.light(light, Mat3::from_rotation_z(0.2 * f32::from(frame))));
    }
    scene.exact = scene.by_pixels(meshes)?;
    writeln!(out, "| way | relative L2 error | a frame | of it once for all vertices | us a vertex and thread |")?;
    writeln!(out, "|---|---:|---:|---:|---:|")?;
    for terms in TERMS {
        scene.by_terms(out, terms)?;
    }
    for side in [32, 64] {
        scene.by_nearest(out, side)?;
    }
    scene.by_four(out, 16)
}

struct Scene {
    domain: Domain,
    vertices: Vec<Vertex>,
    /// The light in each frame.
    frames: Vec<Vec<f32>>,
    checked: Vec<usize>,
    /// What the checked vertices receive in the last frame.
    exact: Vec<f64>,
}

impl Scene {
    /// Sums over pixels, with rays of their own.
    fn by_pixels(&self, meshes: &[Mesh]) -> Result<Vec<f64>> {
        let (tracer, directions) = (Tracer::new(meshes)?, self.domain.directions());
        let places: Vec<Vec3> = meshes.iter().flat_map(|mesh| mesh.vertices.iter().copied()).collect();
        let light = self.frames.last().expect("a frame");
        on_threads(&self.checked, |&i| {
            let normal = self.vertices[i].normal;
            let seen = seen(&tracer, (places[i], normal), &directions);
            Ok(by_pixels(&lambert(normal, &directions), light, &seen))
        })
    }

    /// The vertices by the nearest cell of normals.
    fn cells(&self, side: u32) -> Result<BTreeMap<u32, Vec<u32>>> {
        let mut cells = BTreeMap::new();
        for (i, vertex) in (0..).zip(&self.vertices) {
            let (cells_about, weights) = client::grid_cells(side, vertex.normal.to_array())?;
            let nearest = (0..4).max_by(|a: &usize, b: &usize| weights[*a].total_cmp(&weights[*b])).expect("four");
            cells.entry(cells_about[nearest]).or_insert_with(Vec::new).push(i);
        }
        Ok(cells)
    }

    /// The BRDFs of cells of normals.
    fn brdfs(&self, side: u32, cells: &[u32]) -> Result<Vec<Pixels>> {
        let directions = self.domain.directions();
        on_threads(cells, |&cell| Ok(lambert(Vec3::from_array(client::grid_direction(side, cell)?), &directions)))
    }

    /// A row of the table: the fastest of the frames, and the error of the last one.
    fn row(&self, out: &mut String, way: &str, mut frame: impl FnMut(&[f32]) -> Result<(f64, Vec<f64>)>) -> Result<()> {
        let (mut whole, mut once, mut values) = (f64::MAX, 0.0, Vec::new());
        for light in &self.frames {
            let start = Instant::now();
            let shared;
            (shared, values) = frame(light)?;
            let seconds = start.elapsed().as_secs_f64();
            if seconds < whole {
                (whole, once) = (seconds, shared);
            }
        }
        let pairs = self.checked.iter().zip(&self.exact);
        let squares: f64 = pairs.map(|(&i, exact)| (values[i] - exact).powi(2)).sum();
        let norm: f64 = self.exact.iter().map(|exact| exact * exact).sum();
        let us = 1e6 * THREADS as f64 * (whole - once) / self.vertices.len() as f64;
        let error = (squares / norm).sqrt();
        Ok(writeln!(out, "| {way} | {error:.4} | {whole:.3} s | {once:.3} s | {us:.2} |")?)
    }

    fn by_terms(&self, out: &mut String, terms: usize) -> Result<()> {
        const SIDE: u32 = 32;
        let (cells, domain) = (self.cells(SIDE)?, self.domain);
        let numbers: Vec<u32> = cells.keys().copied().collect();
        let brdfs = on_threads(&self.brdfs(SIDE, &numbers)?, |pixels| {
            let trees = domain.trees(pixels)?;
            let lists = domain.largest(&trees, terms)?;
            Ok(trees.iter().map(|tree| tree.info.average).zip(lists).collect::<Vec<(f64, Vec<raw::wis_wavelets>)>>())
        })?;
        let mut of_vertex = vec![0; self.vertices.len()];
        for (number, members) in cells.values().enumerate() {
            members.iter().for_each(|&i| of_vertex[i as usize] = number);
        }
        let vertices: Vec<(&Vertex, usize)> = self.vertices.iter().zip(of_vertex).collect();
        let way = format!("{terms} terms ({:.2} %)", 100.0 * terms as f64 / domain.wavelets() as f64);
        self.row(out, &way, |light| {
            let start = Instant::now();
            let trees = domain.trees(light)?;
            let kept = domain.largest(&trees, terms)?;
            let once = start.elapsed().as_secs_f64();
            let values = on_threads(&vertices, |(vertex, cell)| {
                let mut sum = 0.0;
                for (face, visible) in vertex.visible.iter().enumerate() {
                    let (average, list) = &brdfs[*cell][face];
                    sum += visible.integral((*average, list), &kept[face], &trees[face])?;
                }
                Ok(domain.mean(sum))
            })?;
            Ok((once, values))
        })
    }

    fn by_nearest(&self, out: &mut String, side: u32) -> Result<()> {
        let cells = self.cells(side)?;
        let brdfs = self.brdfs(side, &cells.keys().copied().collect::<Vec<_>>())?;
        let jobs: Vec<(&Pixels, &[u32])> =
            brdfs.iter().zip(cells.values()).flat_map(|(brdf, i)| i.chunks(TOGETHER).map(move |i| (brdf, i))).collect();
        let way = format!("products, nearest of {side} x {side} normals ({} in use)", cells.len());
        let start = Instant::now();
        on_threads(&brdfs, |brdf| self.products(brdf, &self.frames[0]))?;
        let once = start.elapsed().as_secs_f64();
        self.row(out, &way, |light| {
            let answers = on_threads(&jobs, |(brdf, members)| {
                let products = self.products(brdf, light)?;
                members.iter().map(|&i| Ok((i, self.seen_of(&products, i as usize)?))).collect::<Result<Vec<_>>>()
            })?;
            let mut values = vec![0.0; self.vertices.len()];
            answers.into_iter().flatten().for_each(|(i, value)| values[i as usize] = value);
            Ok((once, values))
        })
    }

    fn by_four(&self, out: &mut String, side: u32) -> Result<()> {
        let about = on_threads(&self.vertices, |v| Ok(client::grid_cells(side, v.normal.to_array())?))?;
        let brdfs = self.brdfs(side, &(0..side * side).collect::<Vec<_>>())?;
        // Neighbours on the grid share products.
        let mut numbers: Vec<usize> = (0..self.vertices.len()).collect();
        numbers.sort_by_key(|&i| about[i].0[0]);
        self.row(out, &format!("products, four of {side} x {side} normals"), |light| {
            let start = Instant::now();
            let products = on_threads(&brdfs, |brdf| self.products(brdf, light))?;
            let once = start.elapsed().as_secs_f64();
            let sums = on_threads(&numbers, |&i| {
                let (cells, weights) = about[i];
                let mut sum = 0.0;
                for (cell, weight) in cells.into_iter().zip(weights).filter(|(_, weight)| *weight > 0.0) {
                    sum += f64::from(weight) * self.seen_of(&products[cell as usize], i)?;
                }
                Ok(sum)
            })?;
            let mut values = vec![0.0; numbers.len()];
            numbers.iter().zip(sums).for_each(|(&i, sum)| values[i] = sum);
            Ok((once, values))
        })
    }

    /// Light x BRDF x cosine on each face, if there is any.
    fn products(&self, brdf: &Pixels, light: &[f32]) -> Result<Vec<Option<Tree>>> {
        let face = 1 << (2 * self.domain.depth);
        let pairs = brdf.chunks(face).zip(light.chunks(face));
        let product = |(brdf, light): (&[f32], &[f32])| -> Result<Option<Tree>> {
            if brdf.iter().all(|value| *value == 0.0) {
                return Ok(None);
            }
            let pixels: Vec<f32> = brdf.iter().zip(light).map(|(brdf, light)| brdf * light).collect();
            Ok(Some(Tree::new(self.domain.depth, 0.0, &pixels)?))
        };
        pairs.map(product).collect()
    }

    fn seen_of(&self, products: &[Option<Tree>], vertex: usize) -> Result<f64> {
        let mut sum = 0.0;
        for (product, visible) in products.iter().zip(&self.vertices[vertex].visible) {
            sum += product.as_ref().map_or(Ok(0.0), |product| visible.product_integral(product))?;
        }
        Ok(self.domain.mean(sum))
    }
}

fn lambert(normal: Vec3, directions: &[Vec3]) -> Pixels {
    directions.iter().map(|wi| ALBEDO / std::f32::consts::PI * wi.dot(normal).max(0.0)).collect()
}

/// What visibility takes for the vertices of some meshes (Section 7.1.1).
fn visibility_sizes(out: &mut String) -> Result<()> {
    writeln!(out, "\n## Visibility fields (Sections 7.1.1 and 8.2)\n\n{SIZES}")?;
    writeln!(
        out,
        "| mesh | vertices | pixels | squares | wavelets of all | 8 bits, kB | tree, kB | bits, kB | all, MB |"
    )?;
    writeln!(out, "|---|---:|---:|---:|---:|---:|---:|---:|---:|")?;
    for name in ["stanford-bunny.obj", "buddha.obj", "spot.obj"] {
        let mesh = data::mesh(name)?;
        let (count, normals) = (mesh.vertices.len(), normals(&mesh));
        let places: Vec<(Vec3, Vec3)> =
            mesh.vertices.iter().copied().zip(normals).step_by((count / SAMPLED).max(1)).collect();
        let tracer = Tracer::new(&[Mesh::ground(4.0), mesh])?;
        for domain in [Domain::cube(6), Domain::cube(8), Domain::octahedral(6), Domain::octahedral(7)] {
            let directions = domain.directions();
            let trees = on_threads(&places, |place| domain.trees(&seen(&tracer, *place, &directions)))?;
            let mean = |each: &dyn Fn(&Tree) -> f64| trees.iter().flatten().map(each).sum::<f64>() / trees.len() as f64;
            let wavelets = mean(&|tree| {
                let kept = tree.largest(3 << (2 * domain.depth)).unwrap_or_default();
                kept.iter().map(|w| w.detail.iter().filter(|d| **d != 0.0).count()).sum::<usize>() as f64
            });
            let compact = mean(&|tree| Visibility::new(tree).map_or(0, |v| v.bytes()) as f64) / 1e3;
            writeln!(
                out,
                "| {} | {count} | {} | {:.0} | {:.2} % | {compact:.2} | {:.2} | {:.2} | {:.0} |",
                name.split('.').next().unwrap_or(name),
                domain.name(),
                mean(&|tree| f64::from(tree.info.squares)),
                100.0 * wavelets / domain.wavelets() as f64,
                mean(&|tree| tree.info.bytes as f64) / 1e3,
                (domain.pixels() / 8) as f64 / 1e3,
                compact * count as f64 / 1e3
            )?;
        }
    }
    Ok(())
}

const SIZES: &str = "Means over 400 vertices of each mesh on a ground plane; visibility without loss but for the averages in 8 bits. The paper's
sparsity: 5.4 % and 3.1 % of a chair at 6 x 64 x 64 and 128 x 128 (816 MB and 1.4 GB for 143 thousand vertices), 3.4 % and .8 %
of Buddha at 6 x 64 x 64 and 256 x 256 (250 MB and 1 GB for 93 thousand).
";
/// Vertices that stand for all.
const SAMPLED: usize = 400;

/// Means of the normals of the faces, by area.
fn normals(mesh: &Mesh) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; mesh.vertices.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|i| mesh.vertices[i as usize]);
        let normal = (b - a).cross(c - a);
        triangle.iter().for_each(|&i| normals[i as usize] += normal);
    }
    normals.into_iter().map(|normal| normal.try_normalize().unwrap_or(Vec3::Z)).collect()
}
