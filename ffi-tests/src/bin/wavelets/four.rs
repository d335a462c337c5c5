//! The product of the map and a rotationally symmetric lobe over all directions as one function of four variables, warped
//! once; what a point samples is then looked up (Section 6.2, Fig. 11).

use crate::{Lit, estimate, middle};
use anyhow::Result;
use glam::{Quat, Vec3};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use std::fmt::Write;
use std::num::NonZero;
use wis_ffi_tests::client::{self, Block, Tree};
use wis_ffi_tests::data;
use wis_ffi_tests::images::displayed_difference;
use wis_ffi_tests::light::{Light, octahedral_direction};
use wis_ffi_tests::paper::{Paper, VISIBLE, Verdict, columns};
use wis_ffi_tests::points;
use wis_ffi_tests::processor;
use wis_ffi_tests::product::frame;
use wis_ffi_tests::scene::{Scene, View};

/// Cells along each of the four axes.
const DEPTH: u32 = 6;
const SIDE: usize = 1 << DEPTH;
/// Points that are warped as a pre-process, and the nearest of them that a shading point takes.
const WARPED: usize = 1 << 18;
const SAMPLES: usize = 30;
/// Places along an axis of a cell over which light and lobe are averaged.
const PLACES: usize = 2;
const EXPONENT: f32 = 50.0;
/// Columns and rows of pixels from one point to the next.
const STEP: u32 = 2;
/// Samples of the reference, by the product on the fly.
const MANY: usize = 512;
/// How much larger a difference from it may be that looks the same.
const EQUAL: f64 = 1.1;
/// How many times as fast it is in the paper.
const FASTER: f64 = 2.1;

/// The pre-process: points by their keys, and the integral for each cell of reflected directions.
struct Table {
    /// Of the tree of the product.
    bytes: u64,
    integrals: Vec<f64>,
    /// The reflected direction and that of the light of each point.
    points: Vec<(Vec3, Vec3)>,
    /// The points by the place of the reflected direction on the square.
    keys: ImmutableKdTree<f32, 2>,
}

fn lobe(cosine: f32) -> f32 {
    (EXPONENT + 2.0) / std::f32::consts::TAU * cosine.max(0.0).powf(EXPONENT)
}

impl Table {
    fn new(map: &Light, count: usize) -> Result<Table> {
        let cells = SIDE * SIDE;
        let frames: Vec<_> = (0..cells).map(|a| frame(middle(a, SIDE))).collect();
        // Places in each cell of the direction of the light, which stands first: the lobe has these two axes.
        let places = |b: usize| {
            (0..PLACES * PLACES).map(move |k| {
                let (row, column) = (PLACES * (b / SIDE) + k / PLACES, PLACES * (b % SIDE) + k % PLACES);
                middle(row * PLACES * SIDE + column, PLACES * SIDE)
            })
        };
        let mean = |sum: f32| sum / (PLACES * PLACES) as f32;
        let mut turned = Vec::with_capacity(cells * cells);
        for b in 0..cells {
            let local: Vec<Vec3> = places(b).collect();
            turned.extend(frames.iter().map(|frame| mean(local.iter().map(|wi| map.radiance(*frame * *wi)).sum())));
        }
        let lobes: Vec<f32> = (0..cells).map(|b| mean(places(b).map(|wi| lobe(wi.z)).sum())).collect();
        let light = Tree::of(4, DEPTH, 0.0, &turned)?;
        let product = light.multiply(&Tree::new(DEPTH, 0.0, &lobes)?, None, &mut Block::new(16))?;
        let area = 4.0 * std::f64::consts::PI / cells as f64;
        let integral = |a: usize| (0..cells).map(|b| f64::from(turned[b * cells + a] * lobes[b])).sum::<f64>() * area;
        let integrals = (0..cells).map(integral).collect();
        let (first, second) = (points::of(31, count), points::of(32, count));
        let mut warped: Vec<[f32; 4]> = first.iter().zip(&second).map(|(a, b)| [a[0], a[1], b[0], b[1]]).collect();
        let mut index: Vec<u32> = (0..count as u32).collect();
        product.warp(&mut warped, &mut index)?;
        let keys: Vec<[f32; 2]> = warped.iter().map(|point| [point[2], point[3]]).collect();
        let points = warped.into_iter().map(|[y, x, v, u]| {
            let reflected = octahedral_direction(u, v);
            (reflected, frame(reflected) * octahedral_direction(x, y))
        });
        let keys = ImmutableKdTree::new_from_slice(&keys);
        Ok(Table { bytes: product.info.bytes, integrals, points: points.collect(), keys })
    }

    /// The nearest points' directions, turned to a reflected direction, with Epanechnikov's kernel of their distance as
    /// weights.
    fn near(&self, reflected: Vec3, count: usize, found: &mut Vec<(f32, Vec3)>) -> Result<()> {
        found.clear();
        // `middle` has columns along x.
        let [x, y] = client::square_point(reflected.to_array(), None)?;
        let nearest = self.keys.nearest_n::<SquaredEuclidean>(&[y, x], NonZero::new(count).expect("some"));
        // The one behind the last would have no weight.
        let reach =
            nearest.last().map_or(1.0, |last| last.distance * (1.0 + 1.0 / count as f32)).max(f32::MIN_POSITIVE);
        found.extend(nearest.iter().map(|point| {
            let (from, wi) = self.points[point.item as usize];
            (1.0 - point.distance / reach, Quat::from_rotation_arc(from, reflected) * wi)
        }));
        Ok(())
    }

    /// The integral without occlusion of a reflected direction.
    fn integral(&self, reflected: Vec3) -> Result<f64> {
        // Cells of the grid count along x first, those of `middle` along y.
        let (cells, weights) = client::grid_cells(SIDE as u32, reflected.to_array())?;
        let integral = |cell: u32| self.integrals[cell as usize % SIDE * SIDE + cell as usize / SIDE];
        Ok(cells.iter().zip(weights).map(|(cell, weight)| f64::from(weight) * integral(*cell)).sum())
    }

    /// A picture by the nearest points, and the microseconds of a point.
    fn picture(&self, scene: &Scene) -> Result<(Vec<f64>, f64)> {
        let (mut found, start) = (Vec::new(), processor::seconds());
        let mut values = Vec::with_capacity(scene.points.len());
        for point in &scene.points {
            let mirror = point.reflected();
            self.near(mirror, SAMPLES, &mut found)?;
            let integral = self.integral(mirror)?;
            let seen: f32 = found.iter().filter(|(_, wi)| scene.visible(point, *wi)).map(|found| found.0).sum();
            let all: f32 = found.iter().map(|found| found.0).sum();
            values.push(integral * f64::from(seen / all));
        }
        Ok((values, (processor::seconds() - start) * 1e6 / scene.points.len() as f64))
    }
}

/// Writes the section.
pub fn write(page: &mut Paper, _: &Lit) -> Result<()> {
    page.heading("One product for all directions (Fig. 11)")?;
    let out = &mut page.text;
    let lit = Lit::load("galileo_cross.hdr")?;
    let scene = data::scene("dragon_vrip_res3.ply", View::Image(STEP))?;
    let start = processor::seconds();
    let table = Table::new(&lit.light, WARPED)?;
    let seconds = processor::seconds() - start;
    let on_the_fly = |count: usize, pass: u32| -> Result<(Vec<f64>, f64)> {
        let (mut u, mut seconds, mut values) = (vec![[0.0; 2]; count], 0.0, Vec::new());
        for point in &scene.points {
            let mirror = point.reflected();
            let eval = |wi: &[[f32; 3]], f_cos: &mut [f32]| {
                wi.iter().zip(f_cos).for_each(|(wi, f)| *f = lobe(Vec3::from_array(*wi).dot(mirror)));
            };
            let product = lit.integrated.product(mirror, eval)?;
            points::sobol(client::pixel_seed(point.pixel, pass), 0, &mut u);
            let start = processor::seconds();
            values.push(estimate(&scene, point, &product, &mut u)?);
            seconds += product.seconds + processor::seconds() - start;
        }
        Ok((values, seconds * 1e6 / scene.points.len() as f64))
    };
    let exact = on_the_fly(MANY, 1)?.0;
    let (values, us) = on_the_fly(SAMPLES, 0)?;
    let (looked_up, table_us) = table.picture(&scene)?;
    let off = [&values, &looked_up].map(|values| displayed_difference(&exact, values));
    columns(out, 1, &format!(" | us a point | displayed difference from {MANY} samples"))?;
    writeln!(
        out,
        "| product on the fly, {SAMPLES} samples | {us:.1} | {:.4} |\n\
         | looked up, {SAMPLES} nearest of {WARPED} | {table_us:.1} | {:.4} |",
        off[0], off[1]
    )?;
    let (tree, points) = (table.bytes as f64 / 1e6, size_of_val(table.points.as_slice()) as f64 / 1e6);
    writeln!(
        out,
        "\nThe pre-process: {SIDE}^4 cells, {seconds:.1} s on one thread; the tree takes {tree:.1} MB, the points {points:.1}."
    )?;
    page.claim("4D products as a", us / table_us >= FASTER, &[&(us / table_us)]);
    let verdict = Verdict::Untested.unless(off[1] <= VISIBLE.max(EQUAL * off[0]));
    page.claim("and look the same", verdict, &[&(100.0 * off[1]), &(100.0 * off[0])]);
    Ok(())
}
