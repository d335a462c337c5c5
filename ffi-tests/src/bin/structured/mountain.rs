//! A mountain of two million triangles at sunrise, with indirect light (Fig. 8).

use crate::{Map, strata_lights};
use anyhow::Result;
use std::fmt::Write;
use wis_ffi_tests::directions;
use wis_ffi_tests::images::displayed_difference;
use wis_ffi_tests::material::Material;
use wis_ffi_tests::mesh::Mesh;
use wis_ffi_tests::paper::{Paper, VISIBLE, columns};
use wis_ffi_tests::points;
use wis_ffi_tests::processor;
use wis_ffi_tests::scene::{Scene, ShadingPoint, View};
use wis_ffi_tests::structured::{How, Picture, Shader};

/// Vertices along a side of the mountain's square: two million triangles.
const SIDE: u32 = 1001;
/// Columns and rows of pixels from one measured point to the next.
const STEP: u32 = 2;
/// How many times as fast sorting is in the paper.
const FASTER: f64 = 3.0;

/// Ridges of seven octaves: |noise| of a lattice of random slopes, each octave half as high and twice as fine.
fn mountain() -> Mesh {
    let mut mesh = Mesh::grid(1.6, SIDE);
    for v in &mut mesh.vertices {
        let (mut height, mut size) = (0.0, 0.5);
        for octave in 0..7 {
            let at = [v.x / size + 11.3 * octave as f32, v.y / size - 7.7 * octave as f32];
            height += size * (0.5 - noise(at).abs());
            size *= 0.5;
        }
        let foot = (1.0 - 0.4 * v.x.hypot(v.y)).max(0.0);
        v.z = (0.9 * height * foot + 0.6 * foot - 0.45).max(0.0);
    }
    mesh
}

/// Noise of slopes on a lattice, between about -0.7 and 0.7.
fn noise(at: [f32; 2]) -> f32 {
    let cell = at.map(f32::floor);
    let part = [at[0] - cell[0], at[1] - cell[1]];
    let fade = part.map(|t| t * t * t * (t * (6.0 * t - 15.0) + 10.0));
    let corner = |dx: f32, dy: f32| {
        let (x, y) = ((cell[0] + dx) as i32 as u32, (cell[1] + dy) as i32 as u32);
        let mixed = (x.wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0xc2b2_ae35);
        let (sin, cos) = (std::f32::consts::TAU * (mixed >> 8) as f32 / (1 << 24) as f32).sin_cos();
        cos * (part[0] - dx) + sin * (part[1] - dy)
    };
    let along = |dy: f32| corner(0.0, dy) + fade[0] * (corner(1.0, dy) - corner(0.0, dy));
    along(0.0) + fade[1] * (along(1.0) - along(0.0))
}

/// Writes the section.
pub fn write(page: &mut Paper) -> Result<()> {
    let (mesh, map) = (mountain(), Map::load("venice_sunset_1k.hdr")?);
    let scene = Scene::turned("mountain", &mesh, 0.0, View::Image(STEP))?;
    let material = Material::lambert();
    let lights = strata_lights(&map, 300)?;
    page.heading("A mountain with indirect light (Fig. 8)")?;
    writeln!(page.text, "{} triangles. Light: {}.\n", mesh.triangles.len(), map.light.name)?;
    let rows = [
        ("no sorting", How::Lights(&lights), How::Lights(&lights)),
        ("picked at 0.01", How::Picked(&lights, 0.01, None), How::Picked(&lights, 0.01, None)),
        ("picked at 0.01, indirect at 0.1", How::Picked(&lights, 0.01, None), How::Picked(&lights, 0.1, None)),
    ];
    let mut pictures = Vec::new();
    for (_, direct, far) in &rows {
        pictures.push(with_bounce(&scene, &material, direct, far)?);
    }
    let truth = pictures[0].values.clone();
    columns(&mut page.text, 1, "lights | shadow rays a point | us a point | differs by")?;
    for ((name, ..), picture) in rows.iter().zip(&pictures) {
        let Picture { rays, us, .. } = picture;
        writeln!(page.text, "| {name} | {rays:.0} | {us:.0} | {:.3} |", picture.error(&truth))?;
    }
    let [plain, .., sorted] = &pictures[..] else { return Ok(()) };
    let (faster, off) = (plain.us / sorted.us, 100.0 * sorted.error(&truth));
    page.claim(
        "with indirect light, sorting",
        faster >= FASTER && displayed_difference(&truth, &sorted.values) <= VISIBLE,
        &[&faster, &(plain.rays / sorted.rays), &plain.us, &sorted.us, &off, &cause(plain, sorted)],
    );
    Ok(())
}

/// Why sorting is not as fast as it saves rays, if it is not.
fn cause(plain: &Picture, sorted: &Picture) -> String {
    let by_rays = plain.us * sorted.rays / plain.rays;
    if sorted.us <= by_rays {
        return String::new();
    }
    format!(
        "were rays all that counts, it would be {:.1} times; to evaluate 300 lights takes the other {:.0} us a point",
        plain.rays / sorted.rays,
        sorted.us - by_rays
    )
}

/// Direct light and that of one bounce.
fn with_bounce(scene: &Scene, material: &Material, direct: &How, far: &How) -> Result<Picture> {
    let (mut shader, start) = (Shader::default(), processor::seconds());
    let mut values = Vec::with_capacity(scene.points.len());
    for point in &scene.points {
        let near = shader.estimate(scene, point, material, direct, 0)?;
        values.push(near + bounce(&mut shader, scene, material, point, far)?);
    }
    let points = scene.points.len() as f64;
    let us = (processor::seconds() - start) * 1e6 / points;
    Ok(Picture { values, rays: shader.rays as f64 / points, us })
}

/// What reaches a point over one bounce.
fn bounce(shader: &mut Shader, scene: &Scene, material: &Material, point: &ShadingPoint, far: &How) -> Result<f64> {
    const BOUNCES: usize = 16;
    let (mut value, mut u) = (0.0, [[0.0; 2]; BOUNCES]);
    points::sobol(wis_ffi_tests::client::pixel_seed(point.pixel, 1), 0, &mut u);
    for u in u {
        let wi = directions::cosine(point.normal, u);
        let Some(hit) = scene.tracer.intersect(point.origin, wi) else { continue };
        let normal = if hit.normal.dot(wi) < 0.0 { hit.normal } else { -hit.normal };
        let origin = point.origin + wi * hit.distance + normal * 1e-4;
        let there = ShadingPoint { origin, normal, wo: -wi, ..*point };
        value += ALBEDO * shader.estimate(scene, &there, material, far, 2)? / BOUNCES as f64;
    }
    Ok(value)
}

/// What the Lambert surface reflects.
const ALBEDO: f64 = 0.7;
