//! Relights all vertices of a mesh: visibility by Embree at every vertex, BRDFs by their normals or reflected directions, a
//! light that turns.

use crate::approximation::{MORTON_BITS, by_pixels};
use crate::domain::{self, Domain};
use anyhow::Result;
use glam::{Mat3, Vec3};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::time::Instant;
use wide::f32x8;
use wis_ffi_tests::client::{self, Tree, Visibility, raw};
use wis_ffi_tests::data;
use wis_ffi_tests::embree::Tracer;
use wis_ffi_tests::images::displayed_difference;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::mesh::Mesh;
use wis_ffi_tests::paper::{Paper, VISIBLE, Verdict, columns, range};
use wis_ffi_tests::processor;
use wis_ffi_tests::threads::{THREADS, on_threads};

/// What the Lambert surface reflects.
const ALBEDO: f32 = 0.7;
/// Squares of BRDF and light that are kept, as a share of the 24570 wavelets: the second is the paper's setting.
const TERMS: [[f64; 2]; 4] = [[0.001, 0.001], [0.001, 0.005], [0.005, 0.005], [0.01, 0.01]];
const PAPER: usize = 1;
/// Vertices whose error is measured, and whose pixels are summed up for the time of all.
const CHECKED: usize = 1000;
const FRAMES: u8 = 3;
/// Cells along an axis of the directions that BRDFs are tabulated for.
const CELLS: u32 = 64;
/// Vertices of the paper's buddha, and its seconds for a frame.
const VERTICES: usize = 93_000;
/// One in so many of them is lit; times are those of all.
const EVERY: usize = 12;
const SECONDS: f64 = 3.0;
/// Vertices and seconds of this project's own goal.
const MANY: f64 = 300e3;
const GOAL: f64 = 0.8;
/// Cells whose products are kept at a time.
const BLOCK: usize = 64;

struct Vertex {
    normal: Vec3,
    /// The view reflected about the normal.
    reflected: Vec3,
    /// For each face.
    visible: Vec<Visibility>,
    squares: Vec<Square>,
}

/// Of visibility: a square's number and its wavelets, of [`UNIT`]; behind all squares, the averages of the faces.
struct Square {
    number: u16,
    detail: [i16; 3],
}

/// One in 16 bits: neither averages nor wavelets of visibility are larger.
const UNIT: f32 = 32767.0;

/// The BRDF x cosine of a cell.
type Pixels = Vec<f32>;

/// The average and the wavelets of a BRDF x cosine on each face.
type Tabulated = Vec<(f64, Vec<raw::wis_wavelets>)>;

/// What a vertex is made of.
#[derive(Clone, Copy, PartialEq)]
enum Material {
    Lambert,
    /// Phong of exponent 64, which depends on the reflected direction alone.
    Phong,
}

impl Material {
    fn name(self) -> &'static str {
        if self == Material::Lambert { "Lambert" } else { "Phong 64" }
    }

    /// BRDF x cosine about a direction.
    fn pixels(self, about: Vec3, directions: &[Vec3]) -> Pixels {
        let cosines = directions.iter().map(|wi| wi.dot(about).max(0.0));
        match self {
            Material::Lambert => cosines.map(|cosine| ALBEDO / std::f32::consts::PI * cosine).collect(),
            Material::Phong => cosines.map(|cosine| 65.0 / std::f32::consts::TAU * cosine.powi(64)).collect(),
        }
    }
}

/// What a way to light the vertices leaves, and the time of a frame.
struct Way {
    error: f64,
    displayed: f64,
    seconds: f64,
    /// Of a frame for all vertices, and of a vertex and thread.
    once: f64,
    us: f64,
}

impl Way {
    /// The seconds of a frame of so many vertices.
    fn of(&self, vertices: f64) -> f64 {
        self.once + 1e-6 * vertices * self.us / THREADS as f64
    }
}

/// Writes the sections.
pub fn write(page: &mut Paper, light: &Light) -> Result<()> {
    visibility_sizes(page)?;
    page.heading("Relighting the vertices of a mesh (Section 8.2)")?;
    let (domain, mesh) = (Domain::cube(6), data::mesh("buddha.obj")?);
    let side = (VERTICES.max(mesh.vertices.len() + 16) - mesh.vertices.len()).isqrt();
    let meshes = [Mesh::grid(2.0, side as u32), mesh];
    let start = Instant::now();
    let vertices = vertices(&meshes, domain)?;
    let seconds = start.elapsed().as_secs_f64();
    let bytes: usize = vertices.iter().flat_map(|v| v.visible.iter().map(Visibility::bytes)).sum();
    let count = vertices.len();
    writeln!(
        page.text,
        "Buddha on a ground plane, {} vertices of which every {EVERY}th is lit, {}. Times are scaled to all.\n\
         Visibility: {seconds:.0} s on {THREADS} threads, {:.1} kB a vertex in 8 bits, {:.0} MB. Light: {}.",
        EVERY * count,
        domain.name(),
        bytes as f64 / count as f64 / 1e3,
        EVERY as f64 * bytes as f64 / 1e6,
        light.name
    )?;
    let step = (count / CHECKED).max(1);
    let checked: Vec<usize> = (0..count).step_by(step).collect();
    let turned = |frame: u8| domain.light(light, Mat3::from_rotation_z(0.2 * f32::from(frame)));
    let frames = (0..FRAMES).map(turned).collect();
    let mut scene =
        Scene { domain, material: Material::Lambert, vertices, frames, checked, seen: Vec::new(), exact: Vec::new() };
    scene.seen = scene.visibility(&meshes)?;
    for material in [Material::Lambert, Material::Phong] {
        scene.material = material;
        scene.exact = scene.by_pixels()?;
        let out = &mut page.text;
        writeln!(out, "\n### {}\n", material.name())?;
        columns(
            out,
            1,
            "way | relative L2 error | displayed | a frame | of it once for all vertices | us a vertex and thread",
        )?;
        let about = on_threads(&(0..scene.vertices.len()).collect::<Vec<_>>(), |&i| scene.about(i))?;
        let cells = used(&about);
        let most = scene.domain.terms(TERMS[TERMS.len() - 1][0]);
        let tables = scene.tabulated(&cells, most)?;
        let each = |terms| scene.by_terms(out, terms, &about, &cells, &tables);
        let terms = TERMS.into_iter().map(each).collect::<Result<Vec<_>>>()?;
        let lanes = scene.all_pixels(out, true)?;
        let pixels = scene.all_pixels(out, false)?;
        let products = scene.by_products(out, &about, &cells)?;
        let fine = &terms[TERMS.len() - 1];
        writeln!(
            out,
            "\n300 thousand vertices would take {:.2} s by the products of cells, {:.2} s by 1 % of the terms, {:.2} s by pixels eight at a time;\n\
             the goal is {GOAL} s.",
            products.of(MANY),
            fine.of(MANY),
            lanes.of(MANY)
        )?;
        claims(page, material, &terms[PAPER], [&pixels, &lanes]);
    }
    Ok(())
}

/// Time and error of the terms that the paper's images take, beside all pixels with the same BRDFs, one by one and eight at a time.
fn claims(page: &mut Paper, material: Material, paper: &Way, [pixels, lanes]: [&Way; 2]) {
    let name = material.name();
    page.claim("a frame of 93", paper.seconds <= SECONDS, &[&name, &paper.seconds]);
    let percent = |way: &Way| format!("{:.1} % of white (error {:.1} %)", 100.0 * way.displayed, 100.0 * way.error);
    page.claim(
        "these terms produce accurate",
        Verdict::Refuted.unless(paper.displayed <= VISIBLE),
        &[&name, &percent(paper), &percent(pixels), &percent(pixels)],
    );
    page.claim(
        "these terms are faster",
        paper.seconds < pixels.seconds,
        &[&name, &paper.seconds, &pixels.seconds, &lanes.seconds],
    );
}

/// The vertices of meshes, their normals and what they see.
fn vertices(meshes: &[Mesh], domain: Domain) -> Result<Vec<Vertex>> {
    let tracer = Tracer::new(meshes)?;
    let directions = domain.directions();
    let eye = Vec3::new(1.1, -2.4, 1.0);
    let places: Vec<(Vec3, Vec3)> =
        meshes.iter().flat_map(|mesh| mesh.vertices.iter().copied().zip(normals(mesh))).step_by(EVERY).collect();
    on_threads(&places, |place| {
        let trees = domain.trees(&seen(&tracer, *place, &directions))?;
        let visible = trees.iter().map(Visibility::new).collect::<Result<Vec<_>, _>>()?;
        let (position, normal) = *place;
        let wo = (eye - position).normalize();
        let reflected = (2.0 * normal.dot(wo) * normal - wo).normalize();
        Ok(Vertex { normal, reflected, visible, squares: squares(domain, &trees)? })
    })
}

/// Squares below a level of a face.
fn below(level: u32) -> usize {
    ((1 << (2 * level)) - 1) / 3
}

/// The squares of visibility.
fn squares(domain: Domain, trees: &[Tree]) -> Result<Vec<Square>> {
    let each = below(domain.depth);
    let square = |number: usize, detail: [f32; 3]| Square {
        number: number as u16,
        detail: detail.map(|d| (d * UNIT).round() as i16),
    };
    let number = |w: &raw::wis_wavelets| below(w.level) + (w.position >> (MORTON_BITS - 2 * w.level)) as usize;
    let mut all = Vec::new();
    for (face, (tree, list)) in trees.iter().zip(domain.all(trees)?).enumerate() {
        all.extend(list.iter().map(|w| square(face * each + number(w), w.detail)));
        all.push(square(trees.len() * each + face, [tree.info.average as f32, 0.0, 0.0]));
    }
    Ok(all)
}

/// The wavelets of pixels in Morton order, face by face, by the number of the square and times its area, and the averages.
fn transformed(domain: Domain, mut pixels: Vec<f32>) -> Vec<[f32; 3]> {
    let (each, faces) = (below(domain.depth), pixels.len() >> (2 * domain.depth));
    let mut out = vec![[0.0; 3]; faces * each + faces];
    for (face, pixels) in pixels.chunks_mut(1 << (2 * domain.depth)).enumerate() {
        for level in (0..domain.depth).rev() {
            let area = 0.25f32.powi(level as i32 + 1);
            for i in 0..1usize << (2 * level) {
                let [p, q, r, s] = std::array::from_fn(|k| pixels[4 * i + k]);
                out[face * each + below(level) + i] = [p - q + r - s, p + q - r - s, p - q - r + s].map(|d| area * d);
                pixels[i] = 0.25 * (p + q + r + s);
            }
        }
        out[faces * each + face] = [pixels[0], 0.0, 0.0];
    }
    out
}

/// Pixels of rows in Morton order.
fn in_morton_order(domain: Domain, pixels: &[f32]) -> Vec<f32> {
    let (depth, side) = (domain.depth, 1 << domain.depth);
    let of = |code: usize, first: u32| (0..depth).fold(0, |c, bit| c | (code >> (2 * bit + first) & 1) << bit);
    let from = |i: usize| {
        let (face, code) = (i >> (2 * depth), i & ((1 << (2 * depth)) - 1));
        pixels[face * side * side + of(code, 1) * side + of(code, 0)]
    };
    (0..pixels.len()).map(from).collect()
}

/// Which directions a vertex sees: eight rays at a time, unless all lie below the horizon.
pub fn seen(tracer: &Tracer, (position, normal): (Vec3, Vec3), directions: &[Vec3]) -> Vec<f32> {
    let origin = position + normal * 1e-3;
    let eight = |wi: &[Vec3]| {
        let wi = <[Vec3; 8]>::try_from(wi).expect("pixels by eights");
        let above = wi.map(|wi| wi.dot(normal) > 0.0);
        let hidden = if above.contains(&true) { tracer.occluded8(origin, &wi) } else { [true; 8] };
        std::array::from_fn::<f32, 8, _>(|i| f32::from(u8::from(above[i] && !hidden[i])))
    };
    directions.chunks(8).flat_map(eight).collect()
}

struct Scene {
    domain: Domain,
    material: Material,
    vertices: Vec<Vertex>,
    /// The light in each frame.
    frames: Vec<Vec<f32>>,
    checked: Vec<usize>,
    /// What the checked vertices see, a bit a pixel.
    seen: Vec<Vec<u8>>,
    /// What the checked vertices reflect in the last frame.
    exact: Vec<f64>,
}

impl Scene {
    /// The direction that the BRDF depends on.
    fn direction(&self, vertex: &Vertex) -> Vec3 {
        if self.material == Material::Lambert { vertex.normal } else { vertex.reflected }
    }

    /// Rays of the checked vertices.
    fn visibility(&self, meshes: &[Mesh]) -> Result<Vec<Vec<u8>>> {
        let (tracer, directions) = (Tracer::new(meshes)?, self.domain.directions());
        let places: Vec<Vec3> = meshes.iter().flat_map(|mesh| mesh.vertices.iter().copied()).step_by(EVERY).collect();
        on_threads(&self.checked, |&i| {
            let seen = seen(&tracer, (places[i], self.vertices[i].normal), &directions);
            let byte = |eight: &[f32]| (0..).zip(eight).map(|(k, v)| u8::from(*v > 0.0) << k).sum::<u8>();
            Ok(seen.chunks(8).map(byte).collect())
        })
    }

    /// Sums over pixels with the BRDF of the vertex's own direction.
    fn by_pixels(&self) -> Result<Vec<f64>> {
        let directions = self.domain.directions();
        let light = self.frames.last().expect("a frame");
        let pairs: Vec<(usize, &Vec<u8>)> = self.checked.iter().copied().zip(&self.seen).collect();
        on_threads(&pairs, |(i, seen)| {
            let brdf = self.material.pixels(self.direction(&self.vertices[*i]), &directions);
            Ok(by_pixels(&brdf, light, &expanded(seen)))
        })
    }

    /// The cells of directions about a vertex and their weights.
    fn about(&self, vertex: usize) -> Result<[(u32, f32); 4]> {
        let (cells, weights) = client::grid_cells(CELLS, self.direction(&self.vertices[vertex]).to_array())?;
        Ok(std::array::from_fn(|k| (cells[k], weights[k])))
    }

    /// The BRDFs of cells of directions.
    fn brdfs(&self, cells: &[u32]) -> Result<Vec<Pixels>> {
        let directions = self.domain.directions();
        on_threads(cells, |&cell| {
            Ok(self.material.pixels(Vec3::from_array(client::grid_direction(CELLS, cell)?), &directions))
        })
    }

    /// A row of the table: the fastest of the frames, and the error of the last one.
    fn row(
        &self,
        out: &mut String,
        how: &str,
        mut frame: impl FnMut(&[f32]) -> Result<(f64, Vec<f64>)>,
    ) -> Result<Way> {
        let (mut whole, mut once, mut values) = (f64::MAX, 0.0, Vec::new());
        for light in &self.frames {
            let start = now();
            let shared;
            (shared, values) = frame(light)?;
            let seconds = now() - start;
            if seconds < whole {
                (whole, once) = (seconds, shared);
            }
        }
        let values: Vec<f64> = self.checked.iter().map(|&i| values[i]).collect();
        self.add(out, how, &values, (whole, once))
    }

    fn add(&self, out: &mut String, how: &str, values: &[f64], (seconds, once): (f64, f64)) -> Result<Way> {
        let squares: f64 = values.iter().zip(&self.exact).map(|(value, exact)| (value - exact).powi(2)).sum();
        let norm: f64 = self.exact.iter().map(|exact| exact * exact).sum();
        let us = 1e6 * THREADS as f64 * (seconds - once).max(0.0) / self.vertices.len() as f64;
        let error = (squares / norm).sqrt();
        // Of all vertices.
        let seconds = once + EVERY as f64 * (seconds - once).max(0.0);
        let displayed = displayed_difference(&self.exact, values);
        writeln!(out, "| {how} | {error:.4} | {displayed:.4} | {seconds:.3} s | {once:.3} s | {us:.2} |")?;
        Ok(Way { error, displayed, seconds, once, us })
    }

    /// The sum over all pixels, eight at a time or one by one.
    fn all_pixels(&self, out: &mut String, in_lanes: bool) -> Result<Way> {
        let about = self.checked.iter().map(|&i| self.about(i)).collect::<Result<Vec<_>>>()?;
        let numbers = used(&about);
        let brdfs = self.brdfs(&numbers)?;
        let light = self.frames.last().expect("a frame");
        let brdf = |(cell, weight): (u32, f32)| (&brdfs[place(&numbers, cell)], weight);
        let jobs: Vec<_> = about.iter().map(|four| four.map(brdf)).zip(&self.seen).collect();
        let masks: Vec<f32x8> = (0..=u8::MAX).map(mask).collect();
        let (mut best, mut values) = (f64::MAX, Vec::new());
        for _ in 0..3 {
            let start = now();
            values = on_threads(&jobs, |(four, seen)| {
                Ok(if in_lanes { by_bits(four, light, seen, &masks) } else { one_by_one(four, light, seen) })
            })?;
            best = best.min(now() - start);
        }
        let seconds = best * self.vertices.len() as f64 / jobs.len() as f64;
        self.add(out, if in_lanes { "pixels, eight at a time" } else { "pixels, one by one" }, &values, (seconds, 0.0))
    }

    /// The BRDFs of cells on each face: the averages, and the largest squares of all faces.
    fn tabulated(&self, cells: &[u32], keep: usize) -> Result<Vec<Tabulated>> {
        let directions = self.domain.directions();
        on_threads(cells, |&cell| {
            let about = Vec3::from_array(client::grid_direction(CELLS, cell)?);
            let trees = self.domain.trees(&self.material.pixels(about, &directions))?;
            let lists = self.domain.largest(&trees, keep)?;
            Ok(trees.iter().map(|tree| tree.info.average).zip(lists).collect())
        })
    }

    /// With all pixels of light and BRDF and all squares of visibility, cell by cell of the table: the product of light and BRDF is
    /// transformed once for all vertices that take the cell.
    fn by_products(&self, out: &mut String, about: &[[(u32, f32); 4]], cells: &[u32]) -> Result<Way> {
        let domain = self.domain;
        let brdfs: Vec<Pixels> = self.brdfs(cells)?.iter().map(|pixels| in_morton_order(domain, pixels)).collect();
        let mut takers: Vec<Vec<(usize, f32)>> = vec![Vec::new(); cells.len()];
        for (vertex, four) in about.iter().enumerate() {
            for &(cell, weight) in four.iter().filter(|(_, weight)| *weight > 0.0) {
                takers[place(cells, cell)].push((vertex, weight));
            }
        }
        let jobs: Vec<_> = brdfs.iter().zip(&takers).collect();
        self.row(out, "products of light and BRDF, a cell", |light| {
            let light = in_morton_order(domain, light);
            let (mut values, mut once) = (vec![0.0; self.vertices.len()], 0.0);
            // As many at a time as the caches hold.
            for jobs in jobs.chunks(BLOCK) {
                let start = now();
                let products = on_threads(jobs, |(brdf, _)| {
                    Ok(transformed(domain, brdf.iter().zip(&light).map(|(b, l)| b * l).collect()))
                })?;
                once += now() - start;
                let pairs: Vec<_> = products.iter().zip(jobs.iter().map(|job| job.1)).collect();
                let parts = on_threads(&pairs, |(product, takers)| {
                    let sum = |square: &Square| {
                        let of = product[usize::from(square.number)];
                        (0..3).map(|k| of[k] * f32::from(square.detail[k])).sum::<f32>()
                    };
                    let part = |&(vertex, weight): &(usize, f32)| {
                        (vertex, weight / UNIT * self.vertices[vertex].squares.iter().map(sum).sum::<f32>())
                    };
                    Ok(takers.iter().map(part).collect::<Vec<_>>())
                })?;
                parts.into_iter().flatten().for_each(|(vertex, part)| values[vertex] += domain.mean(part.into()));
            }
            Ok((once, values))
        })
    }

    /// With shares of the squares of BRDF and light, from tables of more of them.
    fn by_terms(
        &self,
        out: &mut String,
        shares: [f64; 2],
        about: &[[(u32, f32); 4]],
        cells: &[u32],
        tables: &[Tabulated],
    ) -> Result<Way> {
        let domain = self.domain;
        let [of_brdf, of_light] = shares.map(|share| domain.terms(share));
        let brdfs = on_threads(tables, |table| {
            let (averages, lists): (Vec<f64>, domain::Lists) = table.iter().cloned().unzip();
            Ok(averages.into_iter().zip(domain::largest(lists, of_brdf)).collect::<Tabulated>())
        })?;
        let vertices: Vec<_> = self.vertices.iter().zip(about).collect();
        let how = format!("terms: BRDF {:.1} %, light {:.1} %", 100.0 * shares[0], 100.0 * shares[1]);
        self.row(out, &how, |light| {
            let start = now();
            let trees = domain.trees(light)?;
            let kept = domain.largest(&trees, of_light)?;
            let once = now() - start;
            let values = on_threads(&vertices, |(vertex, about)| {
                let chosen = about.iter().filter(|(_, weight)| *weight > 0.0);
                let chosen: Vec<_> =
                    chosen.map(|&(cell, weight)| (&brdfs[place(cells, cell)], f64::from(weight))).collect();
                let (mut sum, mut blended) = (0.0, Vec::new());
                for (face, visible) in vertex.visible.iter().enumerate() {
                    let average = chosen.iter().map(|(brdf, weight)| weight * brdf[face].0).sum();
                    let lists: Vec<_> =
                        chosen.iter().map(|(brdf, weight)| (brdf[face].1.as_slice(), *weight)).collect();
                    client::blend(&lists, &mut blended)?;
                    sum += visible.integral((average, &blended), &kept[face], &trees[face])?;
                }
                Ok(domain.mean(sum))
            })?;
            Ok((once, values))
        })
    }
}

/// Seconds of the processor, by the number of threads that share the work.
fn now() -> f64 {
    processor::of_all_threads() / THREADS as f64
}

/// The bits of a byte as numbers.
fn mask(byte: u8) -> f32x8 {
    f32x8::from(std::array::from_fn::<f32, 8, _>(|k| f32::from(byte >> k & 1)))
}

fn expanded(bits: &[u8]) -> Vec<f32> {
    bits.iter().flat_map(|byte| mask(*byte).to_array()).collect()
}

/// The cells that have weights, in order.
fn used(about: &[[(u32, f32); 4]]) -> Vec<u32> {
    let cells = about.iter().flatten().filter(|(_, weight)| *weight > 0.0).map(|(cell, _)| *cell);
    cells.collect::<BTreeSet<u32>>().into_iter().collect()
}

/// Where a cell is in a list in order; the first for one without weight.
fn place(cells: &[u32], cell: u32) -> usize {
    cells.binary_search(&cell).unwrap_or(0)
}

/// The mean of the products of pixels, eight at a time, with visibility as bits and the weighted sum of BRDFs.
fn by_bits(brdfs: &[(&Pixels, f32); 4], light: &[f32], bits: &[u8], masks: &[f32x8]) -> f64 {
    let eight = |values: &[f32], i: usize| f32x8::from(<[f32; 8]>::try_from(&values[8 * i..8 * i + 8]).expect("eight"));
    let weighted = brdfs.map(|(pixels, weight)| (pixels, f32x8::splat(weight)));
    let brdf = |i: usize| weighted.iter().fold(f32x8::ZERO, |sum, (pixels, weight)| sum + eight(pixels, i) * *weight);
    let terms = bits.iter().enumerate().filter(|(_, byte)| **byte > 0);
    let sum = terms.fold(f32x8::ZERO, |sum, (i, byte)| sum + brdf(i) * eight(light, i) * masks[usize::from(*byte)]);
    f64::from(sum.reduce_add()) / light.len() as f64
}

/// The same pixel by pixel.
fn one_by_one(brdfs: &[(&Pixels, f32); 4], light: &[f32], bits: &[u8]) -> f64 {
    let seen = (0..light.len()).filter(|i| bits[i / 8] >> (i % 8) & 1 == 1);
    let brdf = |i: usize| brdfs.iter().map(|(pixels, weight)| pixels[i] * weight).sum::<f32>();
    seen.fold(0.0, |sum, i| sum + f64::from(brdf(i) * light[i])) / light.len() as f64
}

/// What visibility takes for the vertices of some meshes (Section 7.1.1).
fn visibility_sizes(page: &mut Paper) -> Result<()> {
    page.heading("Visibility fields (Sections 7.1.1 and 8.2)")?;
    let (out, mut shares) = (&mut page.text, Vec::new());
    columns(
        out,
        1,
        "mesh | vertices | pixels | squares | wavelets of all | 8 bits, kB | tree, kB | bits, kB | all, MB",
    )?;
    for name in ["stanford-bunny.obj", "buddha.obj", "spot.obj"] {
        let mesh = data::mesh(name)?;
        let count = mesh.vertices.len();
        let places: Vec<(Vec3, Vec3)> =
            mesh.vertices.iter().copied().zip(normals(&mesh)).step_by((count / SAMPLED).max(1)).collect();
        let tracer = Tracer::new(&[Mesh::ground(4.0), mesh])?;
        for domain in [Domain::cube(6), Domain::cube(8)] {
            let directions = domain.directions();
            let trees = on_threads(&places, |place| domain.trees(&seen(&tracer, *place, &directions)))?;
            let mean = |each: &dyn Fn(&Tree) -> f64| trees.iter().flatten().map(each).sum::<f64>() / trees.len() as f64;
            let wavelets = mean(&|tree| {
                let kept = tree.largest(3 << (2 * domain.depth)).unwrap_or_default();
                kept.iter().map(|w| w.detail.iter().filter(|d| **d != 0.0).count()).sum::<usize>() as f64
            });
            let share = wavelets / domain.wavelets() as f64;
            shares.push((domain.name(), share));
            let compact = mean(&|tree| Visibility::new(tree).map_or(0, |v| v.bytes()) as f64) / 1e3;
            writeln!(
                out,
                "| {} | {count} | {} | {:.0} | {:.2} % | {compact:.2} | {:.2} | {:.2} | {:.0} |",
                name.split('.').next().unwrap_or(name),
                domain.name(),
                mean(&|tree| f64::from(tree.info.squares)),
                100.0 * share,
                mean(&|tree| tree.info.bytes as f64) / 1e3,
                (domain.pixels() / 8) as f64 / 1e3,
                compact * count as f64 / 1e3
            )?;
        }
    }
    for (domain, paper, high) in [(Domain::cube(6), "3.1 to 6.2 %", 0.062), (Domain::cube(8), "0.8 %", 0.008)] {
        let [least, most] = range(shares.iter().filter(|(name, _)| *name == domain.name()).map(|(_, share)| *share));
        let (name, values) = (domain.name(), [least, most].map(|share| 100.0 * share));
        page.claim("visibility is sparse on", most <= high, &[&name, &paper, &values[0], &values[1]]);
    }
    Ok(())
}

/// Vertices that stand for all.
const SAMPLED: usize = 100;

/// The normals at vertices; those that no triangle has look up.
fn normals(mesh: &Mesh) -> impl Iterator<Item = Vec3> {
    mesh.normals().into_iter().map(|normal| if normal == Vec3::ZERO { Vec3::Z } else { normal })
}
