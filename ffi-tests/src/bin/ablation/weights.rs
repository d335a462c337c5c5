//! The largest weights of a client whose f are the lobes: max f L cos / (p I), rule 33 of the design.

use crate::{Built, Prepared};
use anyhow::Result;
use glam::{DVec3, Vec3};
use std::fmt::Write;
use wis::brdf::surface::Surface;
use wis::light::batch::{Density, Drawn, samples};
use wis::product::prepare::Config;
use wis::{Kind, Material, Point, Shape};
use wis_ffi_tests::light::Light;
use wis_ffi_tests::statistics::splitmix;

/// Angles of the view; the last is printed and has no goal.
const DEGREES: [f64; 7] = [0.0, 45.0, 70.0, 80.0, 85.0, 89.0, 89.5];
/// The goal, and the stretch goal.
const GOAL: [f64; 2] = [50.0, 20.0];
/// Directions that are tried at a point.
const TRIED: usize = 4096;

fn materials() -> Vec<(&'static str, Material)> {
    let of = |shapes: &[Shape]| Material::new(shapes).expect("lobes in range");
    let phong = |exponent: f32| Shape { kind: Kind::Phong, a: exponent, ..Shape::LAMBERT };
    vec![
        ("Lambert", of(&[Shape::LAMBERT])),
        ("GGX 0.2", of(&[Shape::ggx(0.2, 0.2)])),
        ("GGX 0.1", of(&[Shape::ggx(0.1, 0.1)])),
        ("GGX 0.05", of(&[Shape::ggx(0.05, 0.05)])),
        ("GGX 0.02", of(&[Shape::ggx(0.02, 0.02)])),
        ("GGX 0.5 x 0.02", of(&[Shape::ggx(0.5, 0.02)])),
        ("GGX 0.2 x 0.02", of(&[Shape::ggx(0.2, 0.02)])),
        ("GGX 0.3 x 0.05", of(&[Shape::ggx(0.3, 0.05)])),
        ("Phong 500", of(&[phong(500.0)])),
        ("Lambert + GGX 0.02", of(&[Shape::LAMBERT, Shape::ggx(0.02, 0.02)])),
    ]
}

/// White, unclipped suns of a texel at the horizon and high, and lamps.
fn maps() -> Vec<Light> {
    let white = Light::latlong("white", 256, 128, vec![1.0; 256 * 128]);
    let suns = [[80, 60], [50, 20]].map(|at| Light::unclipped("sun", 256, 1, at));
    let mut lamps = vec![0.05; 256 * 128];
    for (column, row) in [(20, 30), (70, 58), (150, 45), (220, 62)] {
        for (i, j) in (0..6).flat_map(|j| (0..6).map(move |i| (i, j))) {
            lamps[(row + j) * 256 + column + i] = 200.0;
        }
    }
    let lamps = Light::latlong("lamps", 256, 128, lamps);
    [vec![white], suns.into(), vec![lamps]].concat().into_iter().map(Light::bilinear).collect()
}

/// Numbers in [0, 1).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        (splitmix(&mut self.0) >> 40) as f32 / (1 << 24) as f32
    }

    fn direction(&mut self) -> Vec3 {
        let (z, phi) = (1.0 - 2.0 * self.next(), std::f32::consts::TAU * self.next());
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    }
}

/// A point whose view is so far from the normal, in a plane that stands `around` about it.
fn view<'a>(material: &'a Material, degrees: f64, around: f64) -> Point<'a> {
    let normal = DVec3::new(0.1, 0.2, 0.9).normalize();
    let tangent = normal.cross(DVec3::X).normalize();
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let across = tangent * around.cos() + normal.cross(tangent) * around.sin();
    let wo = (normal * cosine + across * sine).normalize();
    let mut point = Point::new(material, normal.as_vec3().to_array(), wo.as_vec3().to_array());
    point.tangent = tangent.as_vec3().to_array();
    let mixed = material.lobes().len() > 1;
    for (weight, (f0, shape)) in point.weight.iter_mut().zip(point.f0.iter_mut().zip(material.lobes())) {
        *weight = [if mixed && shape.kind == Kind::Lambert { 0.8 } else { 1.0 }; 3];
        *f0 = [if mixed { 0.05 } else { 0.9 }; 3];
    }
    point
}

/// The largest weight at a point, over directions of the product, of the light, about the mirror direction, and of the sphere.
fn largest(light: &Light, built: &Built, point: &Point<'_>) -> f64 {
    let environment = built.environment();
    let frame = environment.frame();
    let surface = Surface::new(point, &frame).expect("a valid point");
    let prepared = Prepared::new(&environment, point, &Config::default());
    let shaded = prepared.over(&environment);
    let mut random = Random(91);
    let mut u = || (0..TRIED).map(|_| [random.next(), random.next()]).collect::<Vec<_>>();
    let [mut own, mut lit] = [0, 1].map(|_| vec![Drawn::default(); TRIED]);
    samples(&shaded, &frame, &u(), &mut own);
    samples(&environment.light(), &frame, &u(), &mut lit);
    let value = |wi: [f32; 3]| {
        let map = frame.to_map(Vec3::from_array(wi)).to_array();
        f64::from(surface.value(surface.to_local::<f32>(map))) * f64::from(light.radiance(Vec3::from_array(wi)))
    };
    let weight = |wi: [f32; 3], pdf: f32| if pdf > 0.0 { value(wi) / f64::from(pdf) } else { 0.0 };
    let mean = own.iter().map(|drawn| weight(drawn.wi, drawn.pdf)).sum::<f64>() / TRIED as f64;
    if mean <= 0.0 {
        return 0.0;
    }
    let mirror = frame.to_world(Vec3::from_array(surface.mirror()));
    let near = (0..TRIED).map(|i| {
        let spread = [1.0, 0.3, 0.1, 0.03, 0.01][i % 5];
        (mirror + random.direction() * spread).normalize().to_array()
    });
    let near: Vec<[f32; 3]> = near.collect();
    let anywhere: Vec<[f32; 3]> = (0..TRIED).map(|_| random.direction().to_array()).collect();
    let tried = lit.iter().map(|drawn| drawn.wi).chain(near).chain(anywhere);
    let own = own.iter().map(|drawn| weight(drawn.wi, drawn.pdf));
    let others = tried.map(|wi| weight(wi, shaded.pdf::<f32>(&frame, wi)));
    own.chain(others).fold(0.0, f64::max) / mean
}

/// Writes the table and its verdict.
pub fn write(out: &mut String) -> Result<()> {
    let lights: Vec<(Light, Built)> = maps().into_iter().map(|light| (light.clone(), Built::new(&light))).collect();
    let mut rows = Vec::new();
    for (name, material) in materials() {
        let row = DEGREES.map(|degrees| {
            let points = [0.3, 1.9, 3.6].map(|around| view(&material, degrees, around));
            let each = lights.iter().flat_map(|(light, built)| points.iter().map(move |p| largest(light, built, p)));
            each.fold(0.0, f64::max)
        });
        rows.push((name, row));
    }
    let most = rows.iter().flat_map(|(_, row)| &row[..DEGREES.len() - 1]).copied().fold(0.0, f64::max);
    let above = |goal: f64| {
        let is_above = |row: &[f64; DEGREES.len()]| row[..DEGREES.len() - 1].iter().any(|&weight| weight > goal);
        let names: Vec<&str> = rows.iter().filter(|(_, row)| is_above(row)).map(|(name, _)| *name).collect();
        if names.is_empty() { "holds".to_string() } else { format!("**does not hold** for {}", names.join(", ")) }
    };
    writeln!(
        out,
        "\n## Largest weights\n\nf L cos / (p I), the largest of {} directions at three points under a white map, two unclipped suns and lamps. \
         The largest up to 89 degrees is {most:.0}. 89.5 degrees have no goal.\n",
        4 * TRIED
    )?;
    writeln!(out, "- At most {} up to 89 degrees: {}.", GOAL[0], above(GOAL[0]))?;
    writeln!(out, "- At most {}: {}.\n", GOAL[1], above(GOAL[1]))?;
    if most > GOAL[0] {
        writeln!(
            out,
            "Weights are large where a sun stands just below the horizon of the surface, and sky above it in the same cell. Nearly all \
             numbers of that cell lead to the sun, so F is that of the sun there: the least that a leaf holds. Lobes are drawn, too, where \
             that takes many numbers.\n"
        )?;
    }
    let degrees: Vec<String> = DEGREES.iter().map(|degrees| format!("{degrees} degrees")).collect();
    writeln!(out, "| lobes | {} |\n|---|{}", degrees.join(" | "), "---:|".repeat(DEGREES.len()))?;
    for (name, row) in rows {
        let cells: Vec<String> = row.iter().map(|weight| format!("{weight:.1}")).collect();
        writeln!(out, "| {name} | {} |", cells.join(" | "))?;
    }
    Ok(())
}
