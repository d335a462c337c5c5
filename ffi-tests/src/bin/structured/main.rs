//! Goes through the figures and claims of "Structured Importance Sampling" on real maps and meshes, and writes a page with
//! pictures: structured <page> [sections]

mod buddha;
mod flicker;
mod maps;
mod mountain;
mod phong;
mod shadows;
mod teapot;

use anyhow::Result;
use glam::Vec3;
use std::fmt::Write;
use wis_ffi_tests::client::raw;
use wis_ffi_tests::data;
use wis_ffi_tests::images::{Sheet, displayed_difference};
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::paper::{Paper, columns};
use wis_ffi_tests::scene::{Scene, ShadingPoint};
use wis_ffi_tests::structured::{How, Lights, Picture, Raster, Source, coloured, picture};

/// How much larger an error may be that counts as equal.
const EQUAL: f64 = 1.1;
/// Pixels of the paper's pictures of teapot and buddha, in millions.
const MEGAPIXELS: f64 = 0.25;
/// The error over the mean that is drawn in the lightest colour.
const WHITE: f64 = 0.25;

fn main() -> Result<()> {
    let mut page = Paper::from_arguments("structured", include_str!("page.md"))?;
    let (galileo, grace) = (Map::load("galileo_probe.hdr")?, Map::load("grace_latlong.exr")?);
    page.section("visibility", shadows::write)?;
    page.section("maps", |page| {
        maps::allocation(page)?;
        maps::real(page, &[&galileo, &grace])?;
        maps::speed(page, &[&galileo.light, &grace.light])
    })?;
    page.section("teapot", |page| teapot::write(page, &galileo))?;
    page.section("buddha", |page| buddha::write(page, &grace))?;
    page.section("mountain", mountain::write)?;
    page.section("flicker", |page| flicker::write(page, &galileo.light))?;
    page.write()
}

/// A light and its colours, all of them lat-long maps of one size.
pub struct Map {
    pub light: Light,
    pub colours: [Light; 3],
}

impl Map {
    /// A map beside the project, or the project's room.
    pub fn load(name: &str) -> Result<Map> {
        Ok(Map { light: data::light(name)?, colours: data::colours(name)? })
    }
}

/// What a method leaves: errors over the mean on all points and on those of the mesh, shadow rays, and microseconds.
#[derive(Clone, Copy)]
pub struct Measured {
    pub error: f64,
    pub on_mesh: f64,
    pub rays: f64,
    pub us: f64,
    /// The displayed difference from the truth, of white.
    pub displayed: f64,
}

/// A table of methods; returns what was measured.
pub fn table(
    page: &mut Paper,
    scene: &Scene,
    material: &Material,
    truth: &[f64],
    rows: &[(impl std::fmt::Display, How)],
) -> Result<Vec<Measured>> {
    columns(
        &mut page.text,
        1,
        "method | error | on the mesh | displayed | shadow rays a point | us a point | s at 500 x 500",
    )?;
    let on_mesh: Vec<bool> = scene.points.iter().map(|point| !point.is_ground()).collect();
    let of_mesh = |values: &[f64]| -> Vec<f64> {
        values.iter().zip(&on_mesh).filter(|(_, on)| **on).map(|(value, _)| *value).collect()
    };
    let mut all = Vec::with_capacity(rows.len());
    for (name, how) in rows {
        let picture = picture(scene, material, how, 0)?;
        let Picture { rays, us, .. } = picture;
        let there = Picture { values: of_mesh(&picture.values), rays, us };
        let (error, on_mesh) = (picture.error(truth), there.error(&of_mesh(truth)));
        let displayed = displayed_difference(truth, &picture.values);
        writeln!(
            page.text,
            "| {name} | {error:.4} | {on_mesh:.4} | {displayed:.4} | {rays:.1} | {us:.1} | {:.2} |",
            us * MEGAPIXELS
        )?;
        all.push(Measured { error, on_mesh, rays, us, displayed });
    }
    Ok(all)
}

/// A sheet of the reference and of coloured pictures with their errors below, four in a row; returns the values of each.
pub fn compare(
    page: &mut Paper,
    file: &str,
    (scene, material): (&Scene, &Material),
    truth: &[f64],
    map: &Map,
    rows: &[(&str, How)],
) -> Result<Vec<Vec<f64>>> {
    const COLUMNS: u32 = 4;
    let mean = truth.iter().sum::<f64>() / truth.len() as f64;
    let lines = (1 + rows.len() as u32).div_ceil(COLUMNS);
    let mut sheet = Sheet::new(COLUMNS, 2 * lines, mean);
    sheet.picture([0, 0], scene, &reference(scene, material, truth, map)?, "reference");
    sheet.legend([0, 1], "error / mean", ["0", &format!("{:.0} %", 100.0 * WHITE)]);
    let mut all = Vec::with_capacity(rows.len());
    for (i, (name, how)) in (1..).zip(rows) {
        let (values, rgb) = coloured(scene, material, how, &map.colours)?;
        let errors: Vec<f64> = values.iter().zip(truth).map(|(v, t)| (v - t).abs() / mean / WHITE).collect();
        let squares = errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64;
        let [column, line] = [i % COLUMNS, i / COLUMNS];
        sheet.picture([column, 2 * line], scene, &rgb, name);
        sheet.errors([column, 2 * line + 1], scene, &errors, &format!("error {:.3}", WHITE * squares.sqrt()));
        all.push(values);
    }
    page.save(file, &sheet)?;
    let white = 100.0 * WHITE;
    writeln!(
        page.text,
        "\nBelow each picture its error over the mean: black is 0, light yellow {white:.0} % and more. The numbers are over\n\
         all pixels of the picture, those of the table over every few columns and rows. The reference\n\
         takes its hue from MIS of {HUE} samples."
    )?;
    Ok(all)
}

/// Samples that the hue of a reference is taken from.
const HUE: usize = 300;

/// The truth in the hue of a noisy picture.
fn reference(scene: &Scene, material: &Material, truth: &[f64], map: &Map) -> Result<Vec<[f32; 3]>> {
    let raster = Raster::new(&map.light);
    let (values, rgb) = coloured(scene, material, &How::Mis(&raster, HUE), &map.colours)?;
    let scaled = |((value, truth), rgb): ((f64, &f64), [f32; 3])| match value > 0.0 {
        true => rgb.map(|c| c * (truth / value) as f32),
        false => [*truth as f32; 3],
    };
    Ok(values.into_iter().zip(truth).zip(rgb).map(scaled).collect())
}

/// The points of a scene that show every `step`-th column and row, and their values.
pub fn every(step: u32, scene: Scene, values: &[f64]) -> (Scene, Vec<f64>) {
    let kept = |point: &ShadingPoint| point.pixel.iter().all(|c| c % step == 0);
    let pairs = scene.points.iter().zip(values).filter(|(point, _)| kept(point));
    let (points, values): (Vec<ShadingPoint>, Vec<f64>) = pairs.map(|(point, value)| (*point, *value)).unzip();
    (Scene { points, ..scene }, values)
}

/// The strata of a map as lights, in colour.
pub fn strata_lights(map: &Map, count: u32) -> Result<Lights> {
    Ok(Lights::of(&Source::new(&map.light).strata(count)?).tinted(&map.light, &map.colours))
}

/// A panel of a lat-long map in its colours, darkened so that dots stand out.
pub fn draw_map(sheet: &mut Sheet, at: [u32; 2], map: &Map, name: &str) {
    let [width, height] = map.light.size();
    let mean = map.light.mean();
    let colour = |place: [f32; 2]| {
        let [x, y] = [(place[0] * width as f32) as usize, (place[1] * height as f32) as usize];
        let texel = y.min(height - 1) * width + x.min(width - 1);
        map.colours.each_ref().map(|c| 0.6 * (0.5 * f64::from(c.luminance()[texel]) / mean).powf(1.0 / 2.2).min(1.0))
    };
    sheet.map(at, colour, name);
}

/// The place on a lat-long map of a direction.
pub fn place_on(map: &Map, direction: Vec3) -> [f32; 2] {
    let d = map.light.map_from_world() * direction;
    let turn = d.y.atan2(d.x) / std::f32::consts::TAU;
    [turn.rem_euclid(1.0), d.z.clamp(-1.0, 1.0).acos() / std::f32::consts::PI]
}

/// What a config with these exponents and this limit of the solid angle asks for.
pub fn config(count: u32, exponents: &[f32; 2], angle_limit: f32) -> raw::wis_strata_config {
    raw::wis_strata_config { count, angle_limit, exponents: exponents.as_ptr(), ..Default::default() }
}
