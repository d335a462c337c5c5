//! threers, a renderer in Rust from crates.io with a CPU path tracer, as a client of wis: its scene, BSDFs, look-up and rays, with rays
//! that wis chooses in place of its own two: one of a mixture of environment and cosine, one of the BSDF, combined by the power heuristic.
//!
//! Writes a section of docs/renderers.md: `wis-threers FILE`.

#[path = "../../pictures.rs"]
mod pictures;

use anyhow::{Context, Result, anyhow, ensure};
use pictures::{HEIGHT, Pictures, SAMPLES, WIDTH, regions, rows, verdict, with_light};
use std::sync::Arc;
use threers::core::{Mesh, Object3D};
use threers::geometries::{PlaneGeometry, SphereGeometry};
use threers::materials::{Material, StandardMaterial};
use threers::math::{Color, Vector3};
use threers::raytrace::{Bsdf, Integrator, RaytraceScene, RaytraceSettings, Rng, Scratch, Surface};
use threers::scene::Scene;
use threers::textures::CubeTexture;
use wis::{Cause, Layout, Map, Point, Ray, Sequence, Shape};

const PICTURES: u64 = 256;
/// threers tells pixels and seeds apart by x ^ seed: seeds of a few bits give the points of one picture to other pixels of the next, and
/// pictures are then not independent.
const SPREAD: u64 = 0x9e37_79b9_7f4a_7c15;
/// As many shadow rays as threers traces at a hit.
const RAYS: usize = 2;
/// All z must stay below: a false alarm in 10,000 runs of 10 of them. Bonferroni.
const Z_LIMIT: f64 = 4.4;
/// The radiance of the sun.
const SUNS: [(&str, f32); 2] = [("a bright sun", 2000.0), ("a dim sun", 5.0)];
/// Texels along the edge of a face.
const FACE: usize = 128;
const EYE: Vector3 = Vector3 { x: 0.0, y: -14.0, z: 2.5 };

/// Colour, roughness and metalness. The floor is the first.
const SURFACES: [(&str, [f32; 3], f32, f32); 5] = [
    ("floor, roughness 1", [0.5, 0.5, 0.45], 1.0, 0.0),
    ("plastic, roughness 0.7", [0.7, 0.2, 0.15], 0.7, 0.0),
    ("plastic, roughness 0.45", [0.15, 0.3, 0.7], 0.45, 0.0),
    ("metal, roughness 0.55", [0.9, 0.7, 0.3], 0.55, 1.0),
    ("metal, roughness 0.35", [0.8, 0.8, 0.85], 0.35, 1.0),
];

/// Six faces as OpenGL has them: a sky over ground, and a sun of 2 degrees.
fn faces(radiance: f32) -> [Vec<f32>; 6] {
    let sun = Vector3::new(0.5, -0.4, 0.6).normalize();
    let texel = |face: usize, s: f32, t: f32| {
        let d = match face {
            0 => Vector3::new(1.0, -t, -s),
            1 => Vector3::new(-1.0, -t, s),
            2 => Vector3::new(s, 1.0, t),
            3 => Vector3::new(s, -1.0, -t),
            4 => Vector3::new(s, -t, 1.0),
            _ => Vector3::new(-s, -t, -1.0),
        }
        .normalize();
        if d.dot(sun) > 1f32.to_radians().cos() {
            [radiance, 0.95 * radiance, 0.8 * radiance, 1.0]
        } else if d.z > 0.0 {
            [0.3 + 0.2 * d.x, 0.45, 0.5 + 0.4 * d.z, 1.0]
        } else {
            [0.12, 0.10, 0.08 + 0.02 * d.y, 1.0]
        }
    };
    let at = |place: usize| 2.0 * (place as f32 + 0.5) / FACE as f32 - 1.0;
    std::array::from_fn(|face| (0..FACE * FACE).flat_map(|i| texel(face, at(i % FACE), at(i / FACE))).collect())
}

fn settings() -> RaytraceSettings {
    RaytraceSettings { max_bounces: 1, clamp_indirect: 0.0, ..RaytraceSettings::default() }
}

fn scene(faces: &[Vec<f32>; 6]) -> RaytraceScene {
    let mut scene = Scene::new();
    scene.environment = Some(Arc::new(CubeTexture::new_f32(FACE as u32, faces.clone())));
    for (i, &(_, [r, g, b], roughness, metalness)) in SURFACES.iter().enumerate() {
        let mut material = StandardMaterial::new(Color { r, g, b });
        (material.roughness, material.metalness) = (roughness, metalness);
        let shape = if i == 0 { PlaneGeometry::new(60.0, 60.0) } else { SphereGeometry::new(1.0, 64, 32) };
        let mut object = Object3D::mesh(Mesh::new(shape, Material::Standard(material)));
        object.position =
            if i == 0 { Vector3::new(0.0, 0.0, -1.0) } else { Vector3::new(2.4 * (i as f32 - 2.5), 0.0, 0.0) };
        scene.add(object);
    }
    RaytraceScene::build(&mut scene, &settings())
}

/// The direction of a camera ray through a place of a pixel, 0 to 1.
fn camera(x: u32, y: u32, [u, v]: [f32; 2]) -> Vector3 {
    let at = |pixel: u32, of: u32, place: f32| (2.0 * (pixel as f32 + place) - of as f32) / WIDTH as f32;
    Vector3::new(0.42 * at(x, WIDTH, u), 1.0, -0.17 - 0.42 * at(y, HEIGHT, v)).normalize()
}

struct Hit {
    position: Vector3,
    normal: Vector3,
    number: usize,
    bsdf: Bsdf,
}

fn closest(scene: &RaytraceScene, dir: Vector3, nearest: f32) -> Option<Hit> {
    let hit = scene.bvh.intersect(&scene.tris, EYE, dir, nearest, f32::INFINITY)?;
    let (of, [a, b, c]) = (&scene.shading[hit.triangle as usize], scene.tris[hit.triangle as usize]);
    let inside = |of: [Vector3; 3]| of[0] * (1.0 - hit.u - hit.v) + of[1] * hit.u + of[2] * hit.v;
    let (normal, face, material) =
        (inside(of.normals).normalize(), (b - a).cross(c - a).normalize(), &scene.materials[of.material as usize]);
    let surface = Surface {
        base_color: material.base_color,
        roughness: material.roughness,
        metallic: material.metallic,
        ior: material.ior,
        specular_tint: material.specular_tint,
        ..Surface::default()
    };
    Some(Hit {
        position: inside([a, b, c]) + face * nearest,
        normal,
        number: of.material as usize,
        bsdf: Bsdf::new(surface, normal, face),
    })
}

fn of(v: Vector3) -> [f32; 3] {
    [v.x, v.y, v.z]
}

fn vector([x, y, z]: [f32; 3]) -> Vector3 {
    Vector3::new(x, y, z)
}

/// Lambert with what Fresnel leaves, and GGX: the metallic workflow as lobes.
fn point<'m>(lobes: &'m [wis::Material], scene: &RaytraceScene, hit: &Hit, wo: Vector3) -> Point<'m> {
    let material = &scene.materials[hit.number];
    let dielectric = ((material.ior - 1.0) / (material.ior + 1.0)).powi(2);
    let mut point = Point::new(&lobes[hit.number], of(hit.normal), of(wo));
    point.weight[0] = of(material.base_color * ((1.0 - material.metallic) * (1.0 - dielectric)));
    point.f0[1] = of(material.base_color * material.metallic + Vector3::ONE * (dielectric * (1.0 - material.metallic)));
    point
}

fn luminance(colour: Vector3) -> f64 {
    f64::from(Vector3::new(0.2126, 0.7152, 0.0722).dot(colour))
}

/// A sample of a pixel, 0 where nothing is hit; the number is that of the pixel.
type Sample<'a> = dyn FnMut(Vector3, u32, u32, &mut Rng) -> Result<f64> + 'a;

/// A picture of a seed.
fn picture(seed: u64, sample: &mut Sample<'_>) -> Result<Vec<f64>> {
    let of_pixel = |pixel: u32| {
        let (x, y, mut sum) = (pixel % WIDTH, pixel / WIDTH, 0.0);
        for number in 0..SAMPLES {
            let mut rng = Rng::for_sample(x, y, number, seed.wrapping_mul(SPREAD));
            rng.set_bounce(0);
            let dir = camera(x, y, rng.next_2d().into());
            sum += sample(dir, pixel + seed as u32 * WIDTH * HEIGHT, number, &mut rng)?;
        }
        Ok(sum / f64::from(SAMPLES))
    };
    (0..WIDTH * HEIGHT).map(of_pixel).collect()
}

/// The table's rows of a sun, the largest z, and the milliseconds of a picture by threers and with wis.
fn compare(name: &str, radiance: f32) -> Result<(String, f64, [f64; 2])> {
    let (faces, settings) = (faces(radiance), settings());
    let scene = scene(&faces);
    let integrator = Integrator::new(&scene, &settings);
    let nearest = integrator.epsilon();

    let pixels: Vec<f32> =
        faces.iter().flat_map(|face| face.chunks(4).flat_map(|texel| [texel[0], texel[1], texel[2]])).collect();
    let map = Map { layout: Layout::Cube, ..Map::latlong(FACE as u32, 6 * FACE as u32, 3, &pixels) };
    // GGX's alpha is the square of the roughness.
    let lobes = SURFACES.map(|(_, _, roughness, _)| {
        wis::Material::new(&[Shape::LAMBERT, Shape::ggx(roughness.powi(2), roughness.powi(2))])
    });
    let lobes = lobes.into_iter().collect::<Result<Vec<_>, _>>()?;
    let mut scratch = Scratch::default();
    let mis = Pictures::take(0..PICTURES, |seed| {
        picture(seed, &mut |dir, _, _, rng| Ok(luminance(integrator.trace(EYE, dir, rng, &mut scratch).radiance)))
    })?;
    // This is all that changes: threers calls its `sample_world` and `Bsdf::sample` where `Sampler::direct` stands here.
    let wis = with_light(&map, RAYS, |environment, sampler| {
        let cause = sampler.check(environment, |wi| of(scene.world.lighting_radiance(vector(wi))))?.cause;
        ensure!(cause == Cause::None, "wis_check finds {cause:?} between the two lights");
        let mut sample = |dir: Vector3, seed, sample, _: &mut Rng| {
            let Some(hit) = closest(&scene, dir, nearest) else { return Ok(0.0) };
            let (wo, mut rays) = (-dir, [Ray::default(); RAYS]);
            let at = Sequence { seed, sample, bounce: 0 };
            let count = sampler.direct(environment, &point(&lobes, &scene, &hit, wo), at, RAYS, &mut rays);
            let rays = &rays[..count.map_err(|fault| anyhow!("{fault:?}"))?];
            let mut sum = Vector3::ZERO;
            for (wi, weight) in rays.iter().map(|ray| (vector(ray.wi), ray.weight)) {
                let (f, _) = hit.bsdf.eval(wo, wi);
                if f.length_sq() > 0.0 && !scene.bvh.occluded(&scene.tris, hit.position, wi, nearest, f32::INFINITY) {
                    let (radiance, scale) = (scene.world.lighting_radiance(wi), wi.dot(hit.normal).abs() * weight);
                    sum = sum + Vector3::new(f.x * radiance.x, f.y * radiance.y, f.z * radiance.z) * scale;
                }
            }
            Ok(luminance(sum))
        };
        Pictures::take(PICTURES..2 * PICTURES, |seed| picture(seed, &mut sample))
    })?;

    let regions = regions(|x, y, place| closest(&scene, camera(x, y, place), nearest).map(|hit| hit.number));
    let mean = |i: usize| mis.of.iter().chain(&wis.of).map(|p| p[i]).sum::<f64>() / (2 * PICTURES) as f64;
    let truth: Vec<f64> = (0..regions.len()).map(mean).collect();
    let names = SURFACES.map(|(surface, ..)| format!("{name}, {surface}"));
    let (gains, worst) = rows(&names, (&regions, &truth), [&wis, &mis, &mis], 1)?;
    Ok((gains, worst, [1e3 * mis.seconds, 1e3 * wis.seconds]))
}

fn main() -> Result<()> {
    let path = std::env::args().nth(1).context("usage: wis-threers FILE")?;
    let (mut gains, mut worst, mut times) = (String::new(), 0.0f64, [0.0; 2]);
    for (name, radiance) in SUNS {
        let (rows, z, milliseconds) = compare(name, radiance)?;
        gains += &rows;
        (worst, times) = (worst.max(z), milliseconds);
    }
    let holds = worst < Z_LIMIT;
    let text = format!(
        "## A third renderer: threers\n\n\
        threers 0.0.8 is a renderer in Rust (crates.io) with a path tracer and an environment sampler of its own: one ray of a mixture of\n\
        environment and cosine, one of the BSDF, by the power heuristic. `ffi-tests/threers` calls the crate `wis` in place of both: 24 lines\n\
        of its code change. How many times lower the variance of a pixel is, at {SAMPLES} samples with {RAYS} shadow rays each, under a sky with\n\
        a sun of 2 degrees.\n\n\
        | light and surface | relative, equal rays | absolute, equal rays | relative, equal time | absolute, equal time | mean, against threers | z |\n\
        | --- | --- | --- | --- | --- | --- | --- |\n{gains}\n\
        A picture takes {:.0} ms of one processor by threers and {:.0} ms with wis. Tests: `wis_check` finds no difference between the lights;\n\
        largest z of {} means: {worst:.1}, at most {Z_LIMIT}: {}.\n",
        times[0],
        times[1],
        SUNS.len() * SURFACES.len(),
        verdict(holds)
    );
    std::fs::write(&path, &text)?;
    println!("{text}");
    ensure!(holds, "a test does not hold");
    Ok(())
}
