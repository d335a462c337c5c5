//! An object that turns (Section 4).

use anyhow::Result;
use std::collections::HashMap;
use std::fmt::Write;
use wis_ffi_tests::client::raw;
use wis_ffi_tests::data;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::paper::{Paper, columns};
use wis_ffi_tests::scene::{Scene, View};
use wis_ffi_tests::structured::{How, Lights, Raster, Source, picture};

const FRAMES: usize = 8;
/// Columns and rows of pixels from one point to the next.
const STEP: u32 = 6;

/// Writes the section.
pub fn write(page: &mut Paper, light: &Light) -> Result<()> {
    let mesh = data::mesh("teapot.obj")?;
    let turned = |frame: usize| Scene::turned("teapot", &mesh, 0.02 * frame as f32, View::Image(STEP));
    let scenes = (0..FRAMES).map(turned).collect::<Result<Vec<_>>>()?;
    let material = Material::lambert();
    let (source, raster) = (Source::new(light), Raster::new(light));
    let strata = [source.strata(100)?, source.strata(300)?];
    let [l100, l300] = strata.each_ref().map(Lights::of);
    let energy = source.jitter(&strata[0], raw::WIS_JITTER_ENERGY)?;
    page.heading("Flicker when the object turns (Section 4)")?;
    columns(&mut page.text, 1, "method | flicker")?;
    let rows = [
        ("structured, 100", How::Lights(&l100)),
        ("structured, 300", How::Lights(&l300)),
        ("structured, 100, jitter by energy", How::Jittered(&l100, &energy)),
        ("stratified importance, 300", How::Importance(&raster, 300)),
    ];
    let mut flicker = Vec::new();
    for (name, how) in &rows {
        let mut frames = Vec::with_capacity(FRAMES);
        for (frame, scene) in (0..).zip(&scenes) {
            frames.push(on_the_ground(scene, &picture(scene, &material, how, frame)?.values));
        }
        flicker.push(second_difference(&frames));
        writeln!(page.text, "| {name} | {:.4} |", flicker[flicker.len() - 1])?;
    }
    page.claim("lights do not flicker", flicker[1] * 4.0 <= flicker[3], &[&flicker[1], &flicker[3]]);
    Ok(())
}

/// The pixels of a picture that show the ground.
fn on_the_ground(scene: &Scene, values: &[f64]) -> HashMap<[u32; 2], f64> {
    scene.points.iter().zip(values).filter(|(p, _)| p.is_ground()).map(|(p, v)| (p.pixel, *v)).collect()
}

/// The root mean squared second difference in time, over sqrt 6 and over the mean.
fn second_difference(frames: &[HashMap<[u32; 2], f64>]) -> f64 {
    let (mut squares, mut sum, mut count) = (0.0, 0.0, 0.0);
    for three in frames.windows(3) {
        for (pixel, middle) in &three[1] {
            if let (Some(before), Some(after)) = (three[0].get(pixel), three[2].get(pixel)) {
                squares += (before - 2.0 * middle + after).powi(2) / 6.0;
                sum += middle;
                count += 1.0;
            }
        }
    }
    (squares / count).sqrt() / (sum / count)
}
