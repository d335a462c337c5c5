//! Relights all vertices of a mesh: visibility by Embree at every vertex, BRDFs by their normals, a light that turns.

use crate::{DEPTH, SIDE, by_pixels_of};
use anyhow::Result;
use glam::{Mat3, Vec3};
use std::collections::HashMap;
use std::fmt::Write;
use std::time::Instant;
use wis_ffi_tests::client::{Tree, Visibility};
use wis_ffi_tests::data;
use wis_ffi_tests::embree::Tracer;
use wis_ffi_tests::light::{Light, octahedral_direction};
use wis_ffi_tests::mesh::Mesh;

/// Squares along an axis of the octahedral square of normals.
const NORMALS: usize = 64;
/// What the Lambert surface reflects.
const ALBEDO: f32 = 0.7;
/// Wavelets of BRDF and light that are kept.
const TERMS: [u32; 6] = [8, 16, 32, 64, 128, 512];
const THREADS: usize = 2;
/// Vertices whose error is measured.
const CHECKED: usize = 2000;

struct Vertex {
    visible: Tree,
    /// The same in 8 bits.
    compact: Visibility,
    /// Its normal's cell.
    normal: usize,
}

/// The BRDF x cosine of a cell of normals.
struct Cell {
    pixels: Vec<f32>,
    tree: Tree,
}

/// Writes the section.
pub fn write(out: &mut String, light: &Light) -> Result<()> {
    visibility_sizes(out)?;
    let mesh = data::mesh("stanford-bunny.obj")?;
    let normals = normals(&mesh);
    let start = Instant::now();
    let vertices = all_vertices(&mesh, &normals)?;
    let seconds = start.elapsed().as_secs_f64();
    let bytes: usize = vertices.iter().map(|v| v.compact.bytes()).sum();
    let (count, start) = (vertices.len(), Instant::now());
    let cells = cells(&vertices)?;
    writeln!(out, "\n## Relighting the vertices of a mesh\n\n{TEXT}")?;
    writeln!(
        out,
        "Stanford bunny on a ground plane, {count} vertices, {SIDE} x {SIDE} pixels. Visibility: {seconds:.0} s on {THREADS} \
         threads, {:.1} kB a vertex in 8 bits ({:.0} squares) in place of {:.1} kB of bits. BRDFs: {} cells of normals in {:.1} s. \
         Light: {}.\n",
        bytes as f64 / count as f64 / 1e3,
        vertices.iter().map(|v| f64::from(v.visible.info.squares)).sum::<f64>() / count as f64,
        (SIDE * SIDE / 8) as f64 / 1e3,
        cells.len(),
        start.elapsed().as_secs_f64(),
        light.name
    )?;
    writeln!(
        out,
        "| wavelets | of all | relative L2 error | us a vertex, one core | a frame | 100k vertices | 300k | light, ms |"
    )?;
    writeln!(out, "|---:|---:|---:|---:|---:|---:|---:|---:|")?;
    for terms in TERMS {
        row(out, &vertices, &cells, light, terms)?;
    }
    let pixels = light.on_octahedron(SIDE, 4, |world| world);
    let few = &vertices[..count.min(200)];
    let visible: Vec<_> = few.iter().map(|v| decompressed(&v.visible)).collect();
    let start = Instant::now();
    let sum = |(v, visible): (&Vertex, &Vec<f32>)| by_pixels_of(&cells[&v.normal].pixels, &pixels, visible);
    std::hint::black_box(few.iter().zip(&visible).map(sum).sum::<f64>());
    let us = start.elapsed().as_secs_f64() * 1e6 / few.len() as f64;
    writeln!(
        out,
        "\nThe sum over pixels in eight lanes takes {us:.1} us a vertex, from {} kB of visibility a vertex, and is exact.",
        SIDE * SIDE * 4 / 1024
    )?;
    Ok(())
}

const TEXT: &str = "Lambert, by 64 x 64 normals; the light turns from frame to frame. A frame is the light's tree and its
largest wavelets, and a sublinear integral for every vertex, on two threads; for other numbers of vertices the time of the
integrals is scaled. Errors are those of the approximations, over 2000 vertices and the exact sum over pixels. The paper
takes 3 to 5 s for 100 to 300 thousand vertices at 6 x 64 x 64.
";

fn row(out: &mut String, vertices: &[Vertex], cells: &HashMap<usize, Cell>, light: &Light, terms: u32) -> Result<()> {
    let mut lists = HashMap::new();
    for (&normal, cell) in cells {
        lists.insert(normal, cell.tree.largest(terms)?);
    }
    let (mut frame, mut preparing, mut alone) = (f64::MAX, f64::MAX, f64::MAX);
    let (mut values, mut pixels) = (Vec::new(), Vec::new());
    for step in 0..3u8 {
        let turn = Mat3::from_rotation_z(0.2 * f32::from(step));
        pixels = light.on_octahedron(SIDE, 4, |world| turn * world);
        let start = Instant::now();
        let tree = Tree::new(DEPTH, 0.0, &pixels)?;
        let kept = tree.largest(terms)?;
        preparing = preparing.min(start.elapsed().as_secs_f64());
        let one = |v: &Vertex| -> Result<f64> {
            let cell = &cells[&v.normal];
            Ok(v.compact.integral((cell.tree.info.average, &lists[&v.normal]), &kept, &tree)?)
        };
        values = on_threads(vertices, one)?;
        frame = frame.min(start.elapsed().as_secs_f64());
        let few = &vertices[..vertices.len().min(CHECKED)];
        let start = Instant::now();
        for vertex in few {
            std::hint::black_box(one(vertex)?);
        }
        alone = alone.min(start.elapsed().as_secs_f64() / few.len() as f64);
    }
    let (mut squares, mut norm) = (0.0, 0.0);
    for (vertex, value) in vertices.iter().zip(&values).take(CHECKED) {
        let exact = exact(vertex, cells, &pixels);
        squares += (value - exact).powi(2);
        norm += exact * exact;
    }
    let scaled = |count: f64| preparing + (frame - preparing) * count / vertices.len() as f64;
    writeln!(
        out,
        "| {terms} | {:.2} % | {:.4} | {:.2} | {frame:.3} s | {:.2} s | {:.2} s | {:.1} |",
        100.0 * f64::from(terms) / (SIDE * SIDE - 1) as f64,
        (squares / norm).sqrt(),
        alone * 1e6,
        scaled(1e5),
        scaled(3e5),
        preparing * 1e3
    )?;
    Ok(())
}

/// The integral as a sum over pixels.
fn exact(vertex: &Vertex, cells: &HashMap<usize, Cell>, light: &[f32]) -> f64 {
    by_pixels_of(&cells[&vertex.normal].pixels, light, &decompressed(&vertex.visible))
}

/// The pixels of a tree of bits.
fn decompressed(tree: &Tree) -> Vec<f32> {
    let at = |c: usize| (c as f32 + 0.5) / SIDE as f32;
    let seen = |i: usize| tree.info.average > 0.0 && tree.pdf([at(i / SIDE), at(i % SIDE)]).is_ok_and(|pdf| pdf > 0.0);
    (0..SIDE * SIDE).map(|i| f32::from(u8::from(seen(i)))).collect()
}

/// Applies a function to all items, in order.
pub fn on_threads<T: Sync, R: Send>(items: &[T], each: impl Fn(&T) -> Result<R> + Sync) -> Result<Vec<R>> {
    let chunks = items.chunks(items.len().div_ceil(THREADS).max(1));
    let each = &each;
    std::thread::scope(|scope| {
        let work = |chunk| scope.spawn(move || <[T]>::iter(chunk).map(each).collect::<Result<Vec<R>>>());
        let threads: Vec<_> = chunks.map(work).collect();
        let mut all = Vec::with_capacity(items.len());
        for thread in threads {
            all.extend(thread.join().expect("a thread that does not panic")?);
        }
        Ok(all)
    })
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
        let normals = normals(&mesh);
        let tracer = Tracer::new(&[Mesh::ground(4.0), mesh.clone()])?;
        let count = mesh.vertices.len();
        let places: Vec<(Vec3, Vec3)> =
            mesh.vertices.iter().copied().zip(normals).step_by((count / SAMPLED).max(1)).collect();
        for depth in [6, 7, 8] {
            let directions = directions(1 << depth);
            let trees = on_threads(&places, |place| seen_tree(&tracer, place, &directions, depth))?;
            let mean = |each: &dyn Fn(&Tree) -> f64| trees.iter().map(each).sum::<f64>() / trees.len() as f64;
            let side = 1usize << depth;
            let wavelets = mean(&|tree| {
                let kept = tree.largest(3 << (2 * depth)).unwrap_or_default();
                kept.iter().map(|w| w.detail.iter().filter(|d| **d != 0.0).count()).sum::<usize>() as f64
            });
            let compact = mean(&|tree| Visibility::new(tree).map_or(0, |v| v.bytes()) as f64) / 1e3;
            writeln!(
                out,
                "| {} | {count} | {side} x {side} | {:.0} | {:.2} % | {compact:.2} | {:.2} | {:.2} | {:.0} |",
                name.split('.').next().unwrap_or(name),
                mean(&|tree| f64::from(tree.info.squares)),
                100.0 * wavelets / (side * side) as f64,
                mean(&|tree| tree.info.bytes as f64) / 1e3,
                (side * side / 8) as f64 / 1e3,
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

fn directions(side: usize) -> Vec<Vec3> {
    let at = |c: usize| (c as f32 + 0.5) / side as f32;
    (0..side * side).map(|i| octahedral_direction(at(i % side), at(i / side))).collect()
}

/// The visibility of a vertex and its normal.
fn seen_tree(tracer: &Tracer, &(position, normal): &(Vec3, Vec3), directions: &[Vec3], depth: u32) -> Result<Tree> {
    let origin = position + normal * 1e-3;
    let seen = |wi: &Vec3| f32::from(u8::from(wi.dot(normal) > 0.0 && !tracer.occluded(origin, *wi)));
    let pixels: Vec<f32> = directions.iter().map(seen).collect();
    Ok(Tree::new(depth, 0.0, &pixels)?)
}

fn all_vertices(mesh: &Mesh, normals: &[Vec3]) -> Result<Vec<Vertex>> {
    let tracer = Tracer::new(&[Mesh::ground(4.0), mesh.clone()])?;
    let directions = directions(SIDE);
    let places: Vec<(Vec3, Vec3)> = mesh.vertices.iter().copied().zip(normals.iter().copied()).collect();
    on_threads(&places, |place| {
        let visible = seen_tree(&tracer, place, &directions, DEPTH)?;
        Ok(Vertex { compact: Visibility::new(&visible)?, visible, normal: normal_cell(place.1) })
    })
}

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

/// The cell of normals whose middle is nearest.
fn normal_cell(normal: Vec3) -> usize {
    let l1 = normal.x.abs() + normal.y.abs();
    // The inverse of `octahedral_direction`: the radius gives the height, the angle the place along the diagonal.
    let radius = (1.0 - normal.z.abs()).max(0.0).sqrt();
    let turn = if l1 > 0.0 { normal.y.abs().atan2(normal.x.abs()) * std::f32::consts::FRAC_2_PI } else { 0.0 };
    let (a, b) = (radius * (1.0 - turn), radius * turn);
    let (a, b) = if normal.z < 0.0 { (1.0 - b, 1.0 - a) } else { (a, b) };
    let cell = |c: f32, sign: f32| (((c.copysign(sign) + 1.0) * 0.5 * NORMALS as f32) as usize).min(NORMALS - 1);
    cell(b, normal.y) * NORMALS + cell(a, normal.x)
}

/// The BRDFs of the normals that the vertices have.
fn cells(vertices: &[Vertex]) -> Result<HashMap<usize, Cell>> {
    let mut cells = HashMap::new();
    for vertex in vertices {
        if cells.contains_key(&vertex.normal) {
            continue;
        }
        let at = |c: usize, count: usize| (c as f32 + 0.5) / count as f32;
        let normal = octahedral_direction(at(vertex.normal % NORMALS, NORMALS), at(vertex.normal / NORMALS, NORMALS));
        let cosine = |i: usize| octahedral_direction(at(i % SIDE, SIDE), at(i / SIDE, SIDE)).dot(normal).max(0.0);
        let pixels: Vec<f32> = (0..SIDE * SIDE).map(|i| ALBEDO / std::f32::consts::PI * cosine(i)).collect();
        let tree = Tree::new(DEPTH, 0.0, &pixels)?;
        cells.insert(vertex.normal, Cell { pixels, tree });
    }
    Ok(cells)
}
