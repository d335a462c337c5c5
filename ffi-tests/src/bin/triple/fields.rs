//! Material fields: BRDFs tabulated by normal and reflected direction.

use crate::domain::{self, Domain};
use anyhow::Result;
use glam::Vec3;
use std::fmt::Write;
use wis_ffi_tests::client::{Tree, raw};
use wis_ffi_tests::data;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::packed::{Packed, energy};
use wis_ffi_tests::paper::{Paper, Verdict, columns};
use wis_ffi_tests::processor;
use wis_ffi_tests::scene::ShadingPoint;
use wis_ffi_tests::table::Table;
use wis_ffi_tests::threads::on_threads;

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
        (self.value)(point.normal, point.reflected(), wi)
    }
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

/// A row of the paper's table: material, cells along an edge of a cube face for normals and for reflected directions, levels of a face of
/// the light, the accuracy, and what the paper needs: the share of the wavelets, megabytes, and its words.
type Size = (usize, [u32; 2], u32, f64, f64, f64, &'static str);

const SIZES: [Size; 5] = [
    (0, [8, 0], 6, 0.99, 0.0012, 0.25, "250 kB, 25 s"),
    (1, [0, 8], 7, 0.99, 0.0005, 0.44, "440 kB, 3 min"),
    (2, [0, 64], 7, 0.99, 0.005, 19.0, "19 MB, 18 min"),
    (3, [3, 8], 6, 0.95, 0.006, 16.0, "orange: 16 MB, 1 hour"),
    (3, [3, 32], 6, 0.95, 0.006, 250.0, "orange: 250 MB, 16 hours"),
];
/// Cells that stand for all of a field.
const SAMPLED: usize = 96;
/// How many times the paper's share of the terms still counts as the same.
const SAME: f64 = 2.0;

/// The table of the measured material, and the colours of a light.
pub fn inputs() -> Result<(Table, [Light; 3])> {
    let slices = data::measured("satin_rosaline_rgb.bsdf")?.table.map(Table::slices);
    let table = match slices {
        Some(slices) => Table::of(slices.to_vec()),
        None => Table::new(4, 4, 0.0, 1, |_, wi| wi.z.max(0.0))?,
    };
    Ok((table, data::colours("grace_latlong.exr")?))
}

/// Squares of material fields at the paper's sizes.
pub fn write(page: &mut Paper, _: &Light) -> Result<()> {
    let table = inputs()?.0;
    let materials = materials(&table);
    page.heading("Material fields at the paper's sizes (Sections 7.1.2 and 8.2)")?;
    columns(
        &mut page.text,
        1,
        "material | normals | reflected | light | accuracy | paper | of the energy: squares a cell | of all | packed, MB | error | unpack a cell, us | whole squares, MB | error | s | of the L2 error: of all | MB",
    )?;
    for (material, [normal_cells, reflected_cells], depth, accuracy, share, paper_megabytes, words) in SIZES {
        let (material, domain) = (&materials[material], Domain::cube(depth));
        let grid = |side: u32| if side == 0 { 1 } else { 6 * side * side };
        let (normals, reflected) = (grid(normal_cells), grid(reflected_cells));
        let all = normals as usize * reflected as usize;
        let cells: Vec<usize> = (0..SAMPLED.min(all)).map(|i| i * all / SAMPLED.min(all)).collect();
        let directions = domain.directions();
        let each = on_threads(&cells, |&cell| {
            let start = processor::seconds();
            let direction = |side: u32, i: usize| if side == 0 { Vec3::Z } else { cube_cell(side, i) };
            let normal = direction(normal_cells, cell / reflected as usize);
            let toward = direction(reflected_cells, cell % reflected as usize);
            // The view is above the surface.
            let above = normal_cells > 0 && reflected_cells > 0;
            let toward = if above && toward.dot(normal) < 0.0 { -toward } else { toward };
            let trees = domain.trees(&(material.value)(normal, toward, &directions))?;
            let lost = 1.0 - accuracy;
            let all = domain.all(&trees)?;
            let energy = squares_within(&trees, &all, lost)?;
            let seconds = processor::seconds() - start;
            Ok((energy, squares_within(&trees, &all, lost * lost)?, seconds))
        })?;
        let mean = |of: &dyn Fn(&(Kept, Kept, f64)) -> f64| each.iter().map(of).sum::<f64>() / each.len() as f64;
        let squares = mean(&|row| row.0.squares);
        let [energy, strict] = [squares, mean(&|row| row.1.squares)].map(|count| count / domain.wavelets() as f64);
        let field = all as f64 / 1e6;
        let (megabytes, strict_megabytes) = (field * mean(&|row| row.0.bytes), field * mean(&|row| row.1.bytes));
        let edge = |side: u32| if side == 0 { "-".into() } else { format!("6 x {side} x {side}") };
        writeln!(
            page.text,
            "| {} | {} | {} | {} | {:.0} % | {:.2} %, {} | {squares:.0} | {:.2} % | {megabytes:.1} | {:.4} | {:.1} | {:.1} | {:.4} | {:.0} | \
             {:.2} % | {strict_megabytes:.1} |",
            material.name,
            edge(normal_cells),
            edge(reflected_cells),
            domain.name(),
            100.0 * accuracy,
            100.0 * share,
            words,
            100.0 * energy,
            mean(&|row| row.0.errors[1]),
            mean(&|row| row.0.us),
            field * squares * size_of::<raw::wis_wavelets>() as f64,
            mean(&|row| row.0.errors[0]),
            mean(&|row| row.2) * all as f64,
            100.0 * strict
        )?;
        let (name, edge) = (&material.name, edge(normal_cells.max(reflected_cells)));
        let verdict = Verdict::Untested.unless(energy <= SAME * share);
        let [of, share, energy, strict, off] =
            [accuracy, share, energy, strict, 1.0 - accuracy].map(|share| 100.0 * share);
        page.claim(
            "material field of",
            verdict,
            &[name, &edge, &of, &share, &words, &energy, &megabytes, &strict, &off],
        );
        let (bytes, of_paper) = (megabytes / field, 1e6 * paper_megabytes / all as f64);
        page.claim(
            "its size, material field",
            megabytes <= paper_megabytes,
            &[name, &edge, &paper_megabytes, &megabytes, &bytes, &of_paper],
        );
    }
    Ok(())
}

/// The direction of a cell of a cube with so many along an edge.
fn cube_cell(side: u32, cell: usize) -> Vec3 {
    let (face, i) = (cell / (side * side) as usize, cell as u32 % (side * side));
    let at = |c: u32| (2.0 * c as f32 + 1.0) / side as f32 - 1.0;
    let (s, t, sign) = (at(i % side), at(i / side), if face % 2 == 0 { 1.0 } else { -1.0 });
    [Vec3::new(sign, s, t), Vec3::new(s, sign, t), Vec3::new(s, t, sign)][face / 2].normalize()
}

/// Squares of a cell that are kept.
struct Kept {
    squares: f64,
    /// Packed.
    bytes: f64,
    /// Relative L2, as whole squares and packed.
    errors: [f64; 2],
    /// Microseconds to unpack them.
    us: f64,
}

/// Squares on all faces that leave a share of the energy.
fn squares_within(trees: &[Tree], all: &domain::Lists, lost: f64) -> Result<Kept> {
    let mut energies: Vec<f64> = all.iter().flatten().map(energy).filter(|energy| *energy > 0.0).collect();
    energies.sort_by(f64::total_cmp);
    let means: f64 = trees.iter().map(|tree| tree.info.average.powi(2)).sum();
    let whole = means + energies.iter().sum::<f64>();
    let mut dropped = 0.0;
    let small = energies.iter().take_while(|energy| {
        dropped += **energy;
        dropped <= lost * whole
    });
    let keep = energies.len() - small.count();
    let lists = domain::largest(all.clone(), keep);
    let packed = |(tree, list): (&Tree, &Vec<_>)| Ok(Packed::new(tree.info.average, list, 0.0)?);
    let packed = trees.iter().zip(&lists).map(packed).collect::<Result<Vec<_>>>()?;
    let (mut list, start) = (Vec::new(), processor::seconds());
    packed.iter().try_for_each(|face| face.unpack(&mut list).map(|_| ()))?;
    let us = 1e6 * (processor::seconds() - start);
    let lost = packed.iter().zip(all).map(|(face, all)| Ok(face.lost(all)?)).sum::<Result<f64>>()?;
    let left = energies.iter().rev().skip(keep).sum::<f64>();
    let bytes = packed.iter().map(Packed::size).sum::<usize>() as f64;
    Ok(Kept { squares: keep as f64, bytes, errors: [left, lost].map(|lost| (lost / whole).sqrt()), us })
}
