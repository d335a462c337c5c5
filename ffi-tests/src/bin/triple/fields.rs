//! Material fields: BRDFs tabulated by normal and reflected direction, blended at every pixel, and relit pictures of them
//! under visibility in 8 bits.

use crate::approximation::by_pixels;
use crate::domain::{self, Domain};
use crate::threads::{THREADS, on_threads};
use crate::{DEPTH, SIDE};
use anyhow::Result;
use glam::{Mat3, Vec3};
use std::fmt::Write;
use std::path::Path;
use std::time::Instant;
use wis_ffi_tests::client::{self, Tree, Visibility, raw};
use wis_ffi_tests::data;
use wis_ffi_tests::images::Sheet;
use wis_ffi_tests::light::{Light, octahedral_direction};
use wis_ffi_tests::paper::Paper;
use wis_ffi_tests::processor;
use wis_ffi_tests::scene::{HEIGHT, Scene, ShadingPoint, View, WIDTH};
use wis_ffi_tests::table::Table;

/// Pixels between the pictures' points.
const STEP: u32 = 3;
/// Points whose error is measured.
const CHECKED: usize = 500;
/// The relative L2 error of the cells that pictures are drawn with.
const ERROR: f64 = 0.05;

/// A BRDF x cosine of normal, reflected direction and light.
type Value<'a> = Box<dyn Fn(Vec3, Vec3, &[Vec3]) -> Vec<f32> + Sync + 'a>;

/// A material and how finely it is tabulated: cells along an axis of normals and of reflected directions, 0 where it does
/// not depend on them, and levels of the directions of the light.
pub struct Material<'a> {
    pub name: &'static str,
    normals: u32,
    reflected: u32,
    depth: u32,
    value: Value<'a>,
}

impl Material<'_> {
    /// BRDF x cosine at a point.
    pub fn at(&self, point: &ShadingPoint, wi: &[Vec3]) -> Vec<f32> {
        (self.value)(point.normal, reflected(point), wi)
    }
}

/// The reflected direction.
fn reflected(point: &ShadingPoint) -> Vec3 {
    (2.0 * point.normal.dot(point.wo) * point.normal - point.wo).normalize()
}

pub fn materials(table: &Table) -> Vec<Material<'_>> {
    let phong = |exponent: i32| -> Value<'static> {
        let norm = (exponent as f32 + 1.0) / std::f32::consts::TAU;
        Box::new(move |_, reflected, wi| wi.iter().map(|wi| norm * wi.dot(reflected).max(0.0).powi(exponent)).collect())
    };
    let lambert: Value =
        Box::new(|normal, _, wi| wi.iter().map(|wi| 0.7 / std::f32::consts::PI * wi.dot(normal).max(0.0)).collect());
    let measured: Value = Box::new(|normal, reflected, wi| {
        let wo = (2.0 * normal.dot(reflected) * normal - reflected).normalize();
        let wi: Vec<[f32; 3]> = wi.iter().map(|wi| wi.to_array()).collect();
        let mut f_cos = vec![0.0; wi.len()];
        table.eval(normal, wo, &wi, &mut f_cos).expect("a table");
        f_cos
    });
    vec![
        Material { name: "Lambert", normals: 16, reflected: 0, depth: DEPTH, value: lambert },
        Material { name: "Phong 64", normals: 0, reflected: 32, depth: DEPTH, value: phong(64) },
        Material { name: "Phong 200", normals: 0, reflected: 64, depth: DEPTH, value: phong(200) },
        Material { name: "satin, measured", normals: 16, reflected: 16, depth: 5, value: measured },
    ]
}

/// A row of the paper's table: material, cells along an edge of a cube face, levels of a face of the light, the accuracy, and
/// what the paper needs.
struct Size {
    material: usize,
    normals: u32,
    reflected: u32,
    depth: u32,
    accuracy: f64,
    /// The share of the wavelets, and megabytes.
    share: f64,
    megabytes: f64,
    paper: &'static str,
}

const SIZES: [Size; 5] = [
    Size {
        material: 0,
        normals: 8,
        reflected: 0,
        depth: 6,
        accuracy: 0.99,
        share: 0.0012,
        megabytes: 0.25,
        paper: "250 kB, 25 s",
    },
    Size {
        material: 1,
        normals: 0,
        reflected: 8,
        depth: 7,
        accuracy: 0.99,
        share: 0.0005,
        megabytes: 0.44,
        paper: "440 kB, 3 min",
    },
    Size {
        material: 2,
        normals: 0,
        reflected: 64,
        depth: 7,
        accuracy: 0.99,
        share: 0.005,
        megabytes: 19.0,
        paper: "19 MB, 18 min",
    },
    Size {
        material: 3,
        normals: 3,
        reflected: 8,
        depth: 6,
        accuracy: 0.95,
        share: 0.006,
        megabytes: 16.0,
        paper: "orange: 16 MB, 1 hour",
    },
    Size {
        material: 3,
        normals: 3,
        reflected: 32,
        depth: 6,
        accuracy: 0.95,
        share: 0.006,
        megabytes: 250.0,
        paper: "orange: 250 MB, 16 hours",
    },
];
/// Cells that stand for all of a field.
const SAMPLED: usize = 96;
/// How many times the paper's share of the wavelets, or its size, still counts as the same.
const SAME: f64 = 2.0;

/// The table of the measured material, and the colours of a light.
pub fn inputs(light: &Light) -> Result<(Table, [Light; 3])> {
    let slices = data::measured("satin_rosaline_rgb.bsdf")?.table.map(Table::slices);
    let table = match slices {
        Some(slices) => Table::of(slices.to_vec()),
        None => Table::new(4, 4, 0.0, 1, |_, wi| wi.z.max(0.0))?,
    };
    let path = Path::new(data::FOLDER).join("envmaps/grace_latlong.exr");
    let colours =
        if path.exists() { Light::load_channels(&path)? } else { [light.clone(), light.clone(), light.clone()] };
    Ok((table, colours))
}

/// Writes the sections of fields and their pictures.
pub fn write(page: &mut Paper, light: &Light) -> Result<()> {
    let (table, colours) = inputs(light)?;
    let materials = materials(&table);
    sizes(page, &materials)?;
    relight(page, light, &colours, &materials)
}

/// Wavelets of material fields at the paper's sizes.
fn sizes(page: &mut Paper, materials: &[Material]) -> Result<()> {
    writeln!(page.text, "\n## Material fields at the paper's sizes (Sections 7.1.2 and 8.2)\n\n{TEXT}")?;
    writeln!(
        page.text,
        "| material | normals | reflected | light | accuracy | paper | of the energy: wavelets a cell | of all | MB | s | of the L2 error: of all | MB |\n\
         |---|---:|---:|---:|---:|---|---:|---:|---:|---:|---:|---:|"
    )?;
    for size in &SIZES {
        let (material, domain) = (&materials[size.material], Domain::cube(size.depth));
        let grid = |side: u32| if side == 0 { 1 } else { 6 * side * side };
        let (normals, reflected) = (grid(size.normals), grid(size.reflected));
        let all = normals as usize * reflected as usize;
        let cells: Vec<usize> = (0..SAMPLED.min(all)).map(|i| i * all / SAMPLED.min(all)).collect();
        let directions = domain.directions();
        let each = on_threads(&cells, |&cell| {
            let start = processor::seconds();
            let direction = |side: u32, i: usize| if side == 0 { Vec3::Z } else { cube_cell(side, i) };
            let normal = direction(size.normals, cell / reflected as usize);
            let toward = direction(size.reflected, cell % reflected as usize);
            // The view is above the surface.
            let above = size.normals > 0 && size.reflected > 0;
            let toward = if above && toward.dot(normal) < 0.0 { -toward } else { toward };
            let trees = domain.trees(&(material.value)(normal, toward, &directions))?;
            let lost = 1.0 - size.accuracy;
            let [energy, energy_bytes] = wavelets_within(domain, &trees, lost.sqrt())?;
            let seconds = processor::seconds() - start;
            let [strict, strict_bytes] = wavelets_within(domain, &trees, lost)?;
            let at_the_papers = energy_kept(domain, &trees, size.share)?;
            Ok([energy, energy_bytes, strict, strict_bytes, seconds, at_the_papers])
        })?;
        let mean = |k: usize| each.iter().map(|row| row[k]).sum::<f64>() / each.len() as f64;
        let [energy, strict] = [mean(0), mean(2)].map(|count| count / domain.wavelets() as f64);
        let megabytes = |k: usize| mean(k) * all as f64 / 1e6;
        let edge = |side: u32| if side == 0 { "-".into() } else { format!("6 x {side} x {side}") };
        writeln!(
            page.text,
            "| {} | {} | {} | {} | {:.0} % | {:.2} %, {} | {:.0} | {:.2} % | {:.1} | {:.0} | {:.2} % | {:.1} |",
            material.name,
            edge(size.normals),
            edge(size.reflected),
            domain.name(),
            100.0 * size.accuracy,
            100.0 * size.share,
            size.paper,
            mean(0),
            100.0 * energy,
            megabytes(1),
            mean(4) * all as f64,
            100.0 * strict,
            megabytes(3)
        )?;
        page.claims.add(
            &format!(
                "material field of {}, {} directions: share of the wavelets for {:.0} % accuracy (8.2)",
                material.name,
                edge(size.normals.max(size.reflected)),
                100.0 * size.accuracy
            ),
            &format!("{:.2} %, {}", 100.0 * size.share, size.paper),
            format!(
                "{:.2} % and {:.1} MB for that share of the energy, {:.2} % for an L2 error of {:.0} %",
                100.0 * energy,
                megabytes(1),
                100.0 * strict,
                100.0 * (1.0 - size.accuracy)
            ),
            energy <= SAME * size.share,
            &format!(
                "with the paper's {:.2} % of the wavelets {:.1} % of the energy is kept; what the paper's accuracy measures is not said",
                100.0 * size.share,
                100.0 * mean(5)
            ),
        );
        page.claims.add(
            &format!("its size, material field of {}, {} directions (8.2)", material.name, edge(size.normals.max(size.reflected))),
            &format!("{} MB", size.megabytes),
            format!("{:.1} MB for that share of the energy", megabytes(1)),
            megabytes(1) <= SAME * size.megabytes,
            &format!(
                "a cell takes {:.0} bytes in place of {:.0}: 20 for a square of up to three wavelets, of which it keeps {:.1}",
                mean(1),
                1e6 * size.megabytes / all as f64,
                mean(0) / ((mean(1) - 8.0) / 20.0)
            ),
        );
    }
    Ok(())
}

const TEXT: &str = "Mean over 96 cells of each field on cube maps, times its cells. Accuracy is taken twice: as the share of the energy (99 %
is an L2 error of 10 %), and as the L2 error itself. Bytes: 20 for a square of wavelets. Seconds: one core. The paper's CURET
materials are not at hand; satin, measured, stands in for orange.
";

/// The direction of a cell of a cube with so many along an edge.
fn cube_cell(side: u32, cell: usize) -> Vec3 {
    let (face, i) = (cell / (side * side) as usize, cell as u32 % (side * side));
    let at = |c: u32| (2.0 * c as f32 + 1.0) / side as f32 - 1.0;
    let (s, t, sign) = (at(i % side), at(i / side), if face % 2 == 0 { 1.0 } else { -1.0 });
    [Vec3::new(sign, s, t), Vec3::new(s, sign, t), Vec3::new(s, t, sign)][face / 2].normalize()
}

/// The share of the energy that a share of the wavelets keeps, the largest of all faces.
fn energy_kept(domain: Domain, trees: &[Tree], share: f64) -> Result<f64> {
    let energy = |w: &raw::wis_wavelets| {
        w.detail.map(|d| f64::from(d).powi(2)).iter().sum::<f64>() * 0.25f64.powi(w.level as i32)
    };
    let of = |lists: &domain::Lists| lists.iter().flatten().map(energy).sum::<f64>();
    let means: f64 = trees.iter().map(|tree| tree.info.average.powi(2)).sum();
    let all = domain.all(trees)?;
    let whole = of(&all);
    let kept = domain::largest(all, (share * domain.wavelets() as f64).round() as usize);
    Ok((means + of(&kept)) / (means + whole))
}

/// Wavelets on all faces that a relative L2 error needs, and their bytes.
fn wavelets_within(domain: Domain, trees: &[Tree], error: f64) -> Result<[f64; 2]> {
    let all = domain.all(trees)?;
    let energy = |w: &raw::wis_wavelets, d: f32| f64::from(d).powi(2) * 0.25f64.powi(w.level as i32);
    let details = all.iter().flatten().flat_map(|w| w.detail.map(|d| energy(w, d)));
    let mut energies: Vec<f64> = details.filter(|e| *e > 0.0).collect();
    energies.sort_by(f64::total_cmp);
    let means: f64 = trees.iter().map(|tree| tree.info.average.powi(2)).sum();
    let allowed = error * error * (means + energies.iter().sum::<f64>());
    let mut dropped = 0.0;
    let small = energies.iter().take_while(|e| {
        dropped += **e;
        dropped <= allowed
    });
    let keep = energies.len() - small.count();
    let squares: usize = domain::largest(all, keep).iter().map(Vec::len).sum();
    Ok([keep as f64, (8 + size_of::<raw::wis_wavelets>() * squares) as f64])
}

/// The tabulated material: a list of wavelets for each pair of cells.
struct Field {
    normals: u32,
    reflected: u32,
    cells: Vec<(f64, Vec<raw::wis_wavelets>)>,
}

impl Field {
    /// Keeps in each cell the wavelets that a relative L2 error of `error` needs.
    fn new(material: &Material, error: f64) -> Result<Field> {
        let (normals, reflected) = (material.normals.max(1), material.reflected.max(1));
        let side = 1usize << material.depth;
        let wi: Vec<Vec3> = (0..side * side).map(|i| pixel(i, side)).collect();
        let pairs: Vec<(u32, u32)> = (0..normals * normals * reflected * reflected)
            .map(|pair| (pair / (reflected * reflected), pair % (reflected * reflected)))
            .collect();
        let cells = on_threads(&pairs, |&(n, r)| {
            let normal = Vec3::from_array(client::grid_direction(normals, n)?);
            let direction = Vec3::from_array(client::grid_direction(reflected, r)?);
            // A view from below the surface is never asked for, but its cell may be next to one that is.
            let direction = if material.normals > 0 && material.reflected > 0 {
                (direction + normal * (0.05 - direction.dot(normal)).max(0.0)).normalize()
            } else {
                direction
            };
            let tree = Tree::new(material.depth, 0.0, &(material.value)(normal, direction, &wi))?;
            Ok((tree.info.average, within(&tree, error)?))
        })?;
        Ok(Field { normals: material.normals, reflected: material.reflected, cells })
    }

    /// The blend for a point: its average, and its wavelets in `out`.
    fn at(&self, point: &ShadingPoint, out: &mut Vec<raw::wis_wavelets>) -> Result<f64> {
        let cells = |side: u32, direction: Vec3| -> Result<Vec<(u32, f32)>> {
            if side == 0 {
                return Ok(vec![(0, 1.0)]);
            }
            let (cells, weights) = client::grid_cells(side, direction.to_array())?;
            Ok(cells.into_iter().zip(weights).collect())
        };
        let (normals, directions) = (cells(self.normals, point.normal)?, cells(self.reflected, reflected(point))?);
        let count = self.reflected.max(1).pow(2);
        let pairs = normals.iter().flat_map(|n| directions.iter().map(move |r| (n.0 * count + r.0, n.1 * r.1)));
        let chosen: Vec<_> = pairs.filter(|(_, weight)| *weight > 0.0).collect();
        let cell = |pair: u32| &self.cells[pair as usize];
        let lists: Vec<_> = chosen.iter().map(|&(pair, w)| (cell(pair).1.as_slice(), f64::from(w))).collect();
        client::blend(&lists, out)?;
        Ok(chosen.iter().map(|&(pair, weight)| f64::from(weight) * cell(pair).0).sum())
    }

    fn bytes(&self) -> usize {
        self.cells.iter().map(|(_, list)| 8 + size_of::<raw::wis_wavelets>() * list.len()).sum()
    }
}

/// The direction of a pixel's middle.
fn pixel(i: usize, side: usize) -> Vec3 {
    let at = |c: usize| (c as f32 + 0.5) / side as f32;
    octahedral_direction(at(i % side), at(i / side))
}

/// The largest wavelets of a tree, as many as leave a relative L2 error.
fn within(tree: &Tree, error: f64) -> Result<Vec<raw::wis_wavelets>> {
    let all = tree.largest(3 << (2 * tree.info.depth))?;
    let energy = |w: &raw::wis_wavelets, d: f32| f64::from(d).powi(2) * 0.25f64.powi(w.level as i32);
    let mut energies: Vec<f64> = all.iter().flat_map(|w| w.detail.map(|d| energy(w, d))).filter(|e| *e > 0.0).collect();
    energies.sort_by(f64::total_cmp);
    let total = tree.info.average.powi(2) + energies.iter().sum::<f64>();
    let mut dropped = 0.0;
    let small = energies.iter().take_while(|e| {
        dropped += **e;
        dropped <= error * error * total
    });
    let keep = energies.len() - small.count();
    Ok(tree.largest(keep as u32)?)
}

struct Pixel {
    point: ShadingPoint,
    seen: Vec<f32>,
    visible: Visibility,
}

fn pixels(scene: &Scene) -> Result<Vec<Pixel>> {
    let directions: Vec<Vec3> = (0..SIDE * SIDE).map(|i| pixel(i, SIDE)).collect();
    on_threads(&scene.points, |point| {
        let seen: Vec<f32> = directions.iter().map(|wi| f32::from(u8::from(scene.visible(point, *wi)))).collect();
        let visible = Visibility::new(&Tree::new(DEPTH, 0.0, &seen)?)?;
        Ok(Pixel { point: *point, seen, visible })
    })
}

/// The turn of the light and the walk of the camera in each row of pictures.
const ROWS: [(f32, f32, &str); 3] = [(0.0, 0.0, ""), (2.0, 0.0, ", light rotated"), (0.0, 1.2, ", camera moved")];

/// Relit pictures: rows of lights and views, columns of materials; and what they cost.
fn relight(page: &mut Paper, light: &Light, colours: &[Light; 3], materials: &[Material]) -> Result<()> {
    let fields = materials.iter().map(|material| Field::new(material, ERROR)).collect::<Result<Vec<_>>>()?;
    let mut sheet = Sheet::new(materials.len() as u32, ROWS.len() as u32, 1.0);
    let mut vertices = Vec::new();
    for (row, (turn, walk, name)) in (0..).zip(ROWS) {
        if walk > 0.0 || row == 0 {
            vertices = pixels(&data::scene("spot.obj", View::Around(STEP, walk))?)?;
        }
        let turn = Mat3::from_rotation_z(turn);
        let lit = light.on_octahedron(SIDE, 4, |world| turn * world);
        let tree = Tree::new(DEPTH, 0.0, &lit)?;
        let kept = tree.largest(512)?;
        let channels = colours.each_ref().map(|colour| {
            let tree = Tree::new(DEPTH, 0.0, &colour.on_octahedron(SIDE, 4, |world| turn * world))?;
            let kept = tree.largest(512)?;
            Ok::<_, client::Failure>((tree, kept))
        });
        let channels = channels.into_iter().collect::<client::Result<Vec<_>>>()?;
        if row == 0 {
            let bytes = vertices.iter().map(|pixel| pixel.visible.bytes()).sum::<usize>() as f64;
            head(&mut page.text, light, vertices.len(), bytes / vertices.len() as f64)?;
        }
        for (column, (material, field)) in (0..).zip(materials.iter().zip(&fields)) {
            let start = Instant::now();
            let values = on_threads(&vertices, |pixel| {
                let mut list = Vec::new();
                let average = field.at(&pixel.point, &mut list)?;
                Ok((pixel.visible.integral((average, &list), &kept, &tree)?, list.len()))
            })?;
            let us = start.elapsed().as_secs_f64() * 1e6 * THREADS as f64 / vertices.len() as f64;
            let tones: Vec<f64> = values.iter().map(|value| value.0).collect();
            let mean = tones.iter().sum::<f64>() / tones.len() as f64;
            let rgb = on_threads(&vertices, |pixel| {
                let mut list = Vec::new();
                let average = field.at(&pixel.point, &mut list)?;
                let mut rgb = [0.0; 3];
                for (value, (tree, kept)) in rgb.iter_mut().zip(&channels) {
                    *value = pixel.visible.integral((average, &list), kept, tree)? / mean;
                }
                Ok(rgb)
            })?;
            let mut small = Small::new([WIDTH / STEP, HEIGHT / STEP]);
            vertices.iter().zip(rgb).for_each(|(v, rgb)| small.put(v.point.pixel.map(|c| c / STEP), rgb));
            small.draw(&mut sheet, [column, row], &format!("{}{name}", material.name));
            if row == 0 {
                let length = values.iter().map(|value| value.1 as f64).sum::<f64>() / values.len() as f64;
                let (name, error) = (material.name, error(material, &vertices, &tones, &lit));
                let (all, kilobytes) = (us * 0.1 / THREADS as f64, field.bytes() as f64 / 1e3);
                writeln!(page.text, "| {name} | {kilobytes:.0} | {length:.0} | {error:.3} | {us:.1} | {all:.2} s |")?;
            }
        }
    }
    page.save("materials.png", &sheet)
}

fn head(out: &mut String, light: &Light, count: usize, bytes: f64) -> Result<()> {
    let kilobytes = bytes / 1e3;
    writeln!(
        out,
        "\n### Relit pictures from material fields\n\nEvery third pixel along each axis is a vertex, {count} in all, with colours interpolated between\n\
         them. {SIDE} x {SIDE} octahedral directions of visibility in 8 bits take {kilobytes:.2} kB a vertex. The light is {}; 512\n\
         of its wavelets are kept. Materials keep what an L2 error of {:.0} % in each cell needs. They are interpolated between 4 cells, the\n\
         measured one between 16. Errors are relative L2, over {CHECKED} points, of the sum over pixels with the BRDF itself.\n",
        light.name,
        100.0 * ERROR
    )?;
    writeln!(
        out,
        "| material | field, kB | squares of a blend | relative L2 error | us a vertex and thread, wall time of a shared machine | 100k vertices, two threads |"
    )?;
    Ok(writeln!(out, "|---|---:|---:|---:|---:|---:|")?)
}

/// The relative L2 error of some of the vertices.
fn error(material: &Material, vertices: &[Pixel], values: &[f64], lit: &[f32]) -> f64 {
    let wi: Vec<Vec3> = (0..SIDE * SIDE).map(|i| pixel(i, SIDE)).collect();
    let step = (vertices.len() / CHECKED).max(1);
    let (mut squares, mut norm) = (0.0, 0.0);
    for (vertex, value) in vertices.iter().zip(values).step_by(step) {
        let exact = by_pixels(&material.at(&vertex.point, &wi), lit, &vertex.seen);
        squares += (value - exact).powi(2);
        norm += exact * exact;
    }
    (squares / norm).sqrt()
}

/// A picture of few points, drawn larger with interpolated colours.
pub struct Small {
    size: [u32; 2],
    tones: Vec<[f64; 3]>,
}

impl Small {
    pub fn new(size: [u32; 2]) -> Small {
        Small { size, tones: vec![[0.1; 3]; (size[0] * size[1]) as usize] }
    }

    /// Sets a point to a radiance over the mean, which is drawn at 0.4 and gamma-corrected.
    pub fn put(&mut self, [x, y]: [u32; 2], rgb: [f64; 3]) {
        if let Some(tone) = self.tones.get_mut((y * self.size[0] + x) as usize).filter(|_| x < self.size[0]) {
            *tone = rgb.map(|c| (0.4 * c.max(0.0)).min(1.0).powf(1.0 / 2.2));
        }
    }

    /// Draws it into a panel.
    pub fn draw(&self, sheet: &mut Sheet, at: [u32; 2], name: &str) {
        let colour = |place: [f32; 2]| {
            let axis = |k: usize| {
                let at = (place[k] * self.size[k] as f32 - 0.5).clamp(0.0, self.size[k] as f32 - 1.001);
                (at as u32, f64::from(at.fract()))
            };
            let ((x, u), (y, v)) = (axis(0), axis(1));
            let tone = |dx: u32, dy: u32| {
                let [x, y] = [(x + dx).min(self.size[0] - 1), (y + dy).min(self.size[1] - 1)];
                self.tones[(y * self.size[0] + x) as usize]
            };
            let corners = [tone(0, 0), tone(1, 0), tone(0, 1), tone(1, 1)];
            let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
            // Five bits, as pictures of scenes have.
            let five = |c: f64| (c * 31.0).round() / 31.0;
            std::array::from_fn(|k| five((0..4).map(|i| weights[i] * corners[i][k]).sum()))
        };
        sheet.map(at, colour, name);
    }
}
