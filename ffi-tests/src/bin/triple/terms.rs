//! Pictures by the number of terms that are kept (Fig. 4).

use crate::approximation::by_pixels;
use crate::domain::{self, Domain, Lists};
use crate::fields::{Material, Small, inputs, materials};
use crate::relighting::seen;
use crate::threads::on_threads;
use anyhow::Result;
use glam::{Mat3, Vec3};
use std::fmt::Write;
use wis_ffi_tests::client::Tree;
use wis_ffi_tests::data;
use wis_ffi_tests::images::Sheet;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::paper::Paper;
use wis_ffi_tests::scene::{Scene, ShadingPoint, View};

/// Columns and rows of pixels between the points, and the part of the picture that is drawn.
const STEP: u32 = 6;
const LOW: [u32; 2] = [132, 24];
const HIGH: [u32; 2] = [348, 258];
/// Shares of the wavelets of BRDF and light.
const SHARES: [f64; 3] = [0.0001, 0.001, 0.01];
const NAMES: [&str; 3] = ["0.01 %", "0.1 %", "1 %"];
/// The error that counts as very close to the reference.
const CLOSE: f64 = 0.05;
/// The levels of a face: the paper's 6 x 256 x 256.
const DEPTH: u32 = 8;
/// Luminance of red, green and blue.
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// The values of a point in a channel: light across, BRDF down, then by pixels.
type Values = [[f64; 3]; SHARES.len() * SHARES.len() + 1];

/// Writes the section and its pictures: columns of light, rows of BRDF, and at the right the sum over pixels.
pub fn write(page: &mut Paper, light: &Light) -> Result<()> {
    let (table, colours) = inputs(light)?;
    let materials = &materials(&table)[..2];
    let domain = Domain::cube(DEPTH);
    let mut scene = data::scene("spot.obj", View::Image(STEP))?;
    scene.points.retain(|p| (0..2).all(|k| (LOW[k]..HIGH[k]).contains(&p.pixel[k])));
    let channels = colours.iter().map(|colour| Channel::new(domain, colour)).collect::<Result<Vec<_>>>()?;
    writeln!(
        page.text,
        "\n## Pictures by the number of terms (Fig. 4)\n\n{TEXT}\n{} points, {}.",
        scene.points.len(),
        light.name
    )?;
    let directions = domain.directions();
    let frame = Frame { domain, directions: &directions, scene: &scene, channels: &channels, materials };
    let values = on_threads(&scene.points, |point| frame.values(point))?;
    for (number, material) in materials.iter().enumerate() {
        let luminance = |at: usize| -> Vec<f64> {
            values.iter().map(|v| (0..3).map(|k| LUMINANCE[k] * v[number][at][k]).sum()).collect()
        };
        let exact = luminance(SHARES.len() * SHARES.len());
        let norm = exact.iter().map(|b| b * b).sum::<f64>();
        let mean = exact.iter().sum::<f64>() / exact.len() as f64;
        let error = |at: usize| {
            let squares: f64 = luminance(at).iter().zip(&exact).map(|(a, b)| (a - b).powi(2)).sum();
            (squares / norm).sqrt()
        };
        let size = [(HIGH[0] - LOW[0]) / STEP, (HIGH[1] - LOW[1]) / STEP];
        let mut sheet = Sheet::of_panels([4, 3], [480, 480 * size[1] / size[0]], mean);
        let mut draw = |at: [u32; 2], index: usize, name: &str| {
            let mut small = Small::new(size);
            for (point, values) in scene.points.iter().zip(&values) {
                let place = [0, 1].map(|k| (point.pixel[k] - LOW[k]) / STEP);
                small.put(place, values[number][index].map(|c| c / mean));
            }
            small.draw(&mut sheet, at, name);
        };
        writeln!(
            page.text,
            "\n### {}\n\n| BRDF, light | {} |\n|---|---:|---:|---:|",
            material.name,
            NAMES.join(" | ")
        )?;
        for (row, name) in NAMES.iter().enumerate() {
            let mut errors = Vec::new();
            for (column, light) in NAMES.iter().enumerate() {
                let index = row * SHARES.len() + column;
                errors.push(format!("{:.3}", error(index)));
                draw([column as u32, row as u32], index, &format!("BRDF {name}, light {light}"));
            }
            writeln!(page.text, "| {name} | {} |", errors.join(" | "))?;
        }
        draw([3, 0], SHARES.len() * SHARES.len(), "all pixels");
        page.save(&format!("terms-{}.png", material.name.to_lowercase().replace(' ', "-")), &sheet)?;
        let (coarse, fine) = (error(SHARES.len() + 1), error(2 * SHARES.len() + 2));
        page.claims.add(
            &format!("0.1 to 1 % of BRDF and light are very close to a reference, {} (8.1)", material.name),
            "pictures",
            format!(
                "error {:.1} % with 0.1 %, {:.1} % with 1 %, {:.0} % with 0.01 %",
                100.0 * coarse,
                100.0 * fine,
                100.0 * error(0)
            ),
            coarse <= CLOSE && fine <= CLOSE,
            &ends(coarse, fine),
        );
    }
    Ok(())
}

/// Which of the two ends is close to the reference.
fn ends(coarse: f64, fine: f64) -> String {
    let is = |error: f64| if error <= CLOSE { "is" } else { "is not" };
    format!("within {:.0} %: 0.1 % of the terms {}, 1 % {}", 100.0 * CLOSE, is(coarse), is(fine))
}

const TEXT: &str = "Spot, close up, at the paper's 6 x 256 x 256 pixels. Of the 393210 wavelets of the light so many are kept across, of the
BRDF of each point so many down, of visibility all. Each point has a BRDF of its own. Colours between points are interpolated, as
those of vertices are. Relative L2 errors of the luminance:
";

/// A channel of the light.
struct Channel {
    pixels: Vec<f32>,
    trees: Vec<Tree>,
    kept: Vec<Lists>,
}

impl Channel {
    fn new(domain: Domain, light: &Light) -> Result<Channel> {
        let pixels = domain.light(light, Mat3::IDENTITY);
        let trees = domain.trees(&pixels)?;
        let all = domain.all(&trees)?;
        let kept =
            SHARES.map(|share| domain::largest(all.clone(), (share * domain.wavelets() as f64).round() as usize));
        Ok(Channel { pixels, trees, kept: kept.into() })
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
            let lists = domain::largest(all.clone(), (share * self.domain.wavelets() as f64).round() as usize);
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
