//! Pictures by the number of terms that are kept (Ng et al. 2004, Fig. 4).

use crate::approximation::by_pixels;
use crate::domain::{self, Domain, Lists};
use crate::fields::{Material, draw};
use crate::threads::on_threads;
use anyhow::Result;
use glam::Mat3;
use image::{GrayImage, Luma};
use std::fmt::Write;
use std::path::Path;
use wis_ffi_tests::client::Tree;
use wis_ffi_tests::data;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::scene::{HEIGHT, Scene, ShadingPoint, View, WIDTH};

const STEP: u32 = 4;
/// Shares of the wavelets of BRDF and light.
const SHARES: [f64; 5] = [0.001, 0.003, 0.01, 0.03, 0.1];

/// Writes the section and its picture: rows of materials, columns of terms, and at the right the sum over pixels.
pub fn write(out: &mut String, light: &Light, materials: &[Material], folder: &Path) -> Result<()> {
    let (domain, scene) = (Domain::cube(6), data::scene("spot.obj", View::Image(STEP))?);
    let lit = domain.light(light, Mat3::IDENTITY);
    let trees = domain.trees(&lit)?;
    let all = domain.all(&trees)?;
    let keep = SHARES.map(|share| (share * domain.wavelets() as f64).round() as usize);
    let kept = keep.map(|keep| domain::largest(all.clone(), keep));
    let panel = [WIDTH / STEP + 2, HEIGHT / STEP + 2];
    let mut sheet =
        GrayImage::from_pixel(panel[0] * (SHARES.len() + 1) as u32, panel[1] * materials.len() as u32, Luma([255]));
    writeln!(out, "\n## Pictures by the number of terms (Fig. 4)\n\n{TEXT}")?;
    let heads = SHARES.map(|share| format!("{:.1} %", 100.0 * share)).join(" | ");
    writeln!(out, "| material | {heads} |\n|---|{}", "---:|".repeat(SHARES.len()))?;
    for (row, material) in (0..).zip(materials) {
        let frame = Frame { domain, scene: &scene, material, lit: &lit, trees: &trees, keep, kept: &kept };
        let values = on_threads(&scene.points, |point| frame.values(point))?;
        let mut errors = Vec::new();
        let exact: Vec<f64> = values.iter().map(|values| values[SHARES.len()]).collect();
        for column in 0..=SHARES.len() {
            let tones: Vec<f64> = values.iter().map(|values| values[column]).collect();
            let squares: f64 = tones.iter().zip(&exact).map(|(a, b)| (a - b).powi(2)).sum();
            errors.push((squares / exact.iter().map(|b| b * b).sum::<f64>()).sqrt());
            draw(&mut sheet, [column as u32 * panel[0], row * panel[1]], STEP, scene.points.iter(), &tones);
        }
        let errors: Vec<String> = errors[..SHARES.len()].iter().map(|error| format!("{error:.3}")).collect();
        writeln!(out, "| {} | {} |", material.name, errors.join(" | "))?;
    }
    sheet.save(folder.join("terms.png"))?;
    Ok(writeln!(out, "\n![By terms](triple-2004/terms.png)")?)
}

const TEXT: &str = "Spot under the light of Grace cathedral, 6 x 64 x 64 pixels: so many of the 24570 wavelets of the light and of the BRDF of
each pixel of the picture, visibility in full. From the top as in the table, from the left by terms, and at the right the sum
over pixels. Relative L2 errors of the pictures:
";

struct Frame<'a> {
    domain: Domain,
    scene: &'a Scene,
    material: &'a Material<'a>,
    lit: &'a [f32],
    trees: &'a [Tree],
    keep: [usize; SHARES.len()],
    kept: &'a [Lists; SHARES.len()],
}

impl Frame<'_> {
    /// The radiance by each number of terms, and by pixels.
    fn values(&self, point: &ShadingPoint) -> Result<[f64; SHARES.len() + 1]> {
        let directions = self.domain.directions();
        let seen: Vec<f32> = directions.iter().map(|wi| f32::from(u8::from(self.scene.visible(point, *wi)))).collect();
        let brdf = self.material.at(point, &directions);
        let mut values = [0.0; SHARES.len() + 1];
        values[SHARES.len()] = by_pixels(&brdf, self.lit, &seen);
        let (visible, brdf) = (self.domain.trees(&seen)?, self.domain.trees(&brdf)?);
        let all = self.domain.all(&brdf)?;
        for (value, (keep, kept)) in values.iter_mut().zip(self.keep.iter().zip(self.kept)) {
            let lists = domain::largest(all.clone(), *keep);
            let mut sum = 0.0;
            for (face, tree) in self.trees.iter().enumerate() {
                let approximate = (brdf[face].info.average, lists[face].as_slice());
                sum += tree.sublinear(approximate, &kept[face], &visible[face])?;
            }
            *value = self.domain.mean(sum);
        }
        Ok(values)
    }
}
