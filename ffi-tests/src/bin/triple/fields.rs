//! Material fields: BRDFs tabulated by normal and reflected direction.

use crate::domain::{self, Domain};
use crate::threads::on_threads;
use anyhow::Result;
use glam::Vec3;
use std::fmt::Write;
use std::path::Path;
use wis_ffi_tests::client::Tree;
use wis_ffi_tests::data;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::packed::Packed;
use wis_ffi_tests::paper::{Paper, Verdict};
use wis_ffi_tests::processor;
use wis_ffi_tests::scene::ShadingPoint;
use wis_ffi_tests::table::Table;

/// A BRDF x cosine of normal, reflected direction and light.
type Value<'a> = Box<dyn Fn(Vec3, Vec3, &[Vec3]) -> Vec<f32> + Sync + 'a>;

/// A material.
pub struct Material<'a> {
    pub name: &'static str,
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
        Material { name: "Lambert", value: lambert },
        Material { name: "Phong 64", value: phong(64) },
        Material { name: "Phong 200", value: phong(200) },
        Material { name: "satin, measured", value: measured },
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
/// How many times the paper's share of the terms still counts as the same.
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

/// Squares of material fields at the paper's sizes.
pub fn write(page: &mut Paper, light: &Light) -> Result<()> {
    let table = inputs(light)?.0;
    let materials = materials(&table);
    writeln!(page.text, "\n## Material fields at the paper's sizes (Sections 7.1.2 and 8.2)\n\n{TEXT}")?;
    writeln!(
        page.text,
        "| material | normals | reflected | light | accuracy | paper | of the energy: squares a cell | of all | MB | s | of the L2 error: of all | MB |\n\
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
            let all = domain.all(&trees)?;
            let [energy, energy_bytes] = squares_within(&trees, &all, lost)?;
            let seconds = processor::seconds() - start;
            let [strict, strict_bytes] = squares_within(&trees, &all, lost * lost)?;
            Ok([energy, energy_bytes, strict, strict_bytes, seconds])
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
                "material field of {}, {} directions: share of the terms for {:.0} % accuracy (8.2)",
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
            Verdict::Untested.unless(energy <= SAME * size.share),
            "what the paper's accuracy measures is not said",
        );
        page.claims.add(
            &format!(
                "its size, material field of {}, {} directions (8.2)",
                material.name,
                edge(size.normals.max(size.reflected))
            ),
            &format!("{} MB", size.megabytes),
            format!("{:.1} MB for that share of the energy", megabytes(1)),
            megabytes(1) <= size.megabytes,
            &format!("a cell takes {:.0} bytes in place of {:.0}", mean(1), 1e6 * size.megabytes / all as f64),
        );
    }
    Ok(())
}

const TEXT: &str = "Mean over 96 cells of each field on cube maps, times its cells. Accuracy is taken twice: as the share of the energy (99 %
is an L2 error of 10 %), and as the L2 error itself. MB: squares as the papers store coefficients, an index by difference and 16 bits for a
value of one scale a face. Seconds: one core. The paper's CURET materials are not at hand; satin, measured, stands in for orange.
";

/// The direction of a cell of a cube with so many along an edge.
fn cube_cell(side: u32, cell: usize) -> Vec3 {
    let (face, i) = (cell / (side * side) as usize, cell as u32 % (side * side));
    let at = |c: u32| (2.0 * c as f32 + 1.0) / side as f32 - 1.0;
    let (s, t, sign) = (at(i % side), at(i / side), if face % 2 == 0 { 1.0 } else { -1.0 });
    [Vec3::new(sign, s, t), Vec3::new(s, sign, t), Vec3::new(s, t, sign)][face / 2].normalize()
}

/// Squares on all faces that leave a share of the energy, and their bytes.
fn squares_within(trees: &[Tree], all: &domain::Lists, lost: f64) -> Result<[f64; 2]> {
    let mut energies: Vec<f64> = all.iter().flatten().map(domain::energy).filter(|energy| *energy > 0.0).collect();
    energies.sort_by(f64::total_cmp);
    let means: f64 = trees.iter().map(|tree| tree.info.average.powi(2)).sum();
    let allowed = lost * (means + energies.iter().sum::<f64>());
    let mut dropped = 0.0;
    let small = energies.iter().take_while(|energy| {
        dropped += **energy;
        dropped <= allowed
    });
    let keep = energies.len() - small.count();
    let lists = domain::largest(all.clone(), keep);
    let packed = |(tree, list): (&Tree, &Vec<_>)| Ok(Packed::new(tree.info.average, list, 0.0)?.size());
    let bytes = trees.iter().zip(&lists).map(packed).sum::<Result<usize>>()?;
    Ok([keep as f64, bytes as f64])
}
