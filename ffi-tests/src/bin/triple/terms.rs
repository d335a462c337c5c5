//! Errors of pictures by the number of terms that are kept (Fig. 4).

use crate::approximation::by_pixels;
use crate::domain::{self, Domain, Lists};
use crate::fields::{Material, inputs, materials};
use crate::relighting::seen;
use anyhow::Result;
use glam::{Mat3, Vec3};
use std::collections::HashSet;
use std::fmt::Write;
use wis_ffi_tests::client::{Tree, raw};
use wis_ffi_tests::data;
use wis_ffi_tests::images::displayed_difference;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::paper::{Paper, VISIBLE, columns};
use wis_ffi_tests::scene::{Scene, ShadingPoint, View};
use wis_ffi_tests::threads::on_threads;

/// Columns and rows of pixels between the points, and the part of the picture that is drawn.
const STEP: u32 = 12;
const LOW: [u32; 2] = [132, 24];
const HIGH: [u32; 2] = [348, 258];
/// Shares of the wavelets of BRDF and light.
const SHARES: [f64; 3] = [0.0001, 0.001, 0.01];
const NAMES: [&str; 3] = ["0.01 %", "0.1 %", "1 %"];
/// The levels of a face: the paper's 6 x 256 x 256.
const DEPTH: u32 = 8;
/// Luminance of red, green and blue.
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// The values of a point in a channel: light across, BRDF down, then by pixels.
type Values = [[f64; 3]; SHARES.len() * SHARES.len() + 1];

/// Writes the section: columns of light, rows of BRDF.
pub fn write(page: &mut Paper, light: &Light) -> Result<()> {
    let (table, colours) = inputs()?;
    let materials = &materials(&table)[..2];
    let domain = Domain::cube(DEPTH);
    let mut scene = data::scene("spot.obj", View::Image(STEP))?;
    scene.points.retain(|p| (0..2).all(|k| (LOW[k]..HIGH[k]).contains(&p.pixel[k])));
    let kept = Channel::squares(domain, light)?;
    let channels = colours.iter().map(|colour| Channel::new(domain, colour, &kept)).collect::<Result<Vec<_>>>()?;
    page.heading("Pictures by the number of terms (Fig. 4)")?;
    writeln!(page.text, "{} points, {}.", scene.points.len(), light.name)?;
    let directions = domain.directions();
    let frame = Frame { domain, directions: &directions, scene: &scene, channels: &channels, materials };
    let values = on_threads(&scene.points, |point| frame.values(point))?;
    for (number, material) in materials.iter().enumerate() {
        let luminance = |at: usize| -> Vec<f64> {
            values.iter().map(|v| (0..3).map(|k| LUMINANCE[k] * v[number][at][k]).sum()).collect()
        };
        let exact = luminance(SHARES.len() * SHARES.len());
        let norm = exact.iter().map(|b| b * b).sum::<f64>();
        let errors = |at: usize| {
            let values = luminance(at);
            let squares: f64 = values.iter().zip(&exact).map(|(a, b)| (a - b).powi(2)).sum();
            [(squares / norm).sqrt(), displayed_difference(&exact, &values)]
        };
        writeln!(page.text, "\n### {}\n", material.name)?;
        columns(&mut page.text, 1, &format!("BRDF, light | {}", NAMES.join(" | ")))?;
        for (row, name) in NAMES.iter().enumerate() {
            let cell = |column: usize| {
                let [error, displayed] = errors(row * SHARES.len() + column);
                format!("{error:.3}, {displayed:.4}")
            };
            writeln!(page.text, "| {name} | {} |", [0, 1, 2].map(cell).join(" | "))?;
        }
        let [least, coarse, fine] = [0, 1, 2].map(|k| errors(k * SHARES.len() + k));
        let percent = |[error, displayed]: [f64; 2]| {
            format!("{:.1} % of white (error {:.1} %)", 100.0 * displayed, 100.0 * error)
        };
        // What is required lies between both: the upper end is enough.
        let [coarse, least, shown] = [percent(coarse), percent(least), percent(fine)];
        page.claim("0.1 to 1 %", fine[1] <= VISIBLE, &[&material.name, &coarse, &shown, &least]);
    }
    Ok(())
}

/// Squares of all faces: face, position and level.
type Squares = HashSet<(usize, u32, u32)>;

fn key(face: usize, w: &raw::wis_wavelets) -> (usize, u32, u32) {
    (face, w.position, w.level)
}

/// A channel of the light.
struct Channel {
    pixels: Vec<f32>,
    trees: Vec<Tree>,
    kept: Vec<Lists>,
}

impl Channel {
    /// The squares of a light that each share keeps: face, position and level.
    fn squares(domain: Domain, light: &Light) -> Result<Vec<Squares>> {
        let all = domain.all(&domain.trees(&domain.light(light, Mat3::IDENTITY))?)?;
        let of = |lists: Lists| {
            lists.iter().enumerate().flat_map(|(face, list)| list.iter().map(move |w| key(face, w))).collect()
        };
        Ok(SHARES.map(|share| of(domain::largest(all.clone(), domain.terms(share)))).into())
    }

    fn new(domain: Domain, light: &Light, squares: &[Squares]) -> Result<Channel> {
        let pixels = domain.light(light, Mat3::IDENTITY);
        let trees = domain.trees(&pixels)?;
        let all = domain.all(&trees)?;
        let of = |(face, list): (usize, &Vec<_>), kept: &Squares| {
            list.iter().filter(|w| kept.contains(&key(face, w))).copied().collect()
        };
        let kept = squares.iter().map(|kept| all.iter().enumerate().map(|list| of(list, kept)).collect());
        Ok(Channel { pixels, trees, kept: kept.collect() })
    }
}

struct Frame<'a> {
    domain: Domain,
    directions: &'a [Vec3],
    scene: &'a Scene,
    channels: &'a [Channel],
    materials: &'a [Material<'a>],
}

impl Frame<'_> {
    /// The radiance in each material.
    fn values(&self, point: &ShadingPoint) -> Result<Vec<Values>> {
        let directions = self.directions;
        let seen = seen(&self.scene.tracer, (point.origin, point.normal), directions);
        let visible = self.domain.trees(&seen)?;
        self.materials.iter().map(|material| self.of(&material.at(point, directions), (&seen, &visible))).collect()
    }

    fn of(&self, brdf: &[f32], (seen, visible): (&[f32], &[Tree])) -> Result<Values> {
        let trees = self.domain.trees(brdf)?;
        let all = self.domain.all(&trees)?;
        let mut values = [[0.0; 3]; SHARES.len() * SHARES.len() + 1];
        for (row, share) in SHARES.iter().enumerate() {
            let lists = domain::largest(all.clone(), self.domain.terms(*share));
            for (k, channel) in self.channels.iter().enumerate() {
                for (column, kept) in channel.kept.iter().enumerate() {
                    let mut sum = 0.0;
                    for (face, tree) in channel.trees.iter().enumerate() {
                        let approximate = (trees[face].info.average, lists[face].as_slice());
                        sum += tree.sublinear(approximate, &kept[face], &visible[face])?;
                    }
                    values[row * SHARES.len() + column][k] = self.domain.mean(sum);
                }
            }
        }
        for (k, channel) in self.channels.iter().enumerate() {
            values[SHARES.len() * SHARES.len()][k] = by_pixels(brdf, &channel.pixels, seen);
        }
        Ok(values)
    }
}
