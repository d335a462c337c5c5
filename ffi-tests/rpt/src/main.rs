//! rpt, a path tracer in Rust from crates.io, as a client of wis: its scene, BSDFs, look-up and rays, with rays that wis chooses.
//!
//! rpt samples an environment by BSDF samples only. Writes a section of docs/renderers.md: `wis-rpt FILE`.

#[path = "../../pictures.rs"]
mod pictures;

use anyhow::{Context, Result, anyhow, ensure};
use pictures::{HEIGHT, Pictures, SAMPLES, WIDTH, regions, rows, verdict, with_light};
use rand::{Rng, SeedableRng, rngs::StdRng};
use rpt::glm::{self, DVec3};
use rpt::{
    Camera, Color, Environment, Hdri, HitRecord, Material, Object, Renderer, Scene, SceneAdd, Transformable, plane,
    sphere,
};
use std::f64::consts::PI;
use std::fmt::Write;
use wis::{Cause, Map, Point, Ray, Sequence, Shape};

const PICTURES: u64 = 12;
/// Samples a pixel of rpt's own pictures, the reference of the means.
const REFERENCE: u32 = 256;
/// All z of a run must stay below: a false alarm in 10,000 runs of 5 of them. Bonferroni.
const Z_LIMIT: f64 = 4.3;
/// Keeps rpt's 8-bit pictures from clipping.
const EXPOSURE: f64 = -4.0;

/// Columns and rows of the map, with the last column that rpt wants: it shows what the first one does.
const COLUMNS: u32 = 257;
const ROWS: u32 = 128;

/// A sky over ground with a lamp of about 6 x 6 degrees. rpt clamps what a BSDF sample brings at 100, so the lamp is no sun.
fn map() -> Vec<[f32; 3]> {
    let texel = |row: u32, column: u32| {
        let up = (PI * f64::from(row) / f64::from(ROWS - 1)).cos();
        let around = 2.0 * PI * f64::from(column % (COLUMNS - 1)) / f64::from(COLUMNS - 1);
        if (30..34).contains(&row) && (190..194).contains(&column) {
            [40.0, 36.0, 28.0]
        } else if up > 0.0 {
            [0.3, 0.45, 0.8].map(|c: f64| (c * (0.4 + 0.6 * up + 0.1 * (3.0 * around).sin())) as f32)
        } else {
            [0.12, 0.10, 0.08].map(|c: f64| (c * (1.0 + 0.3 * (5.0 * around).cos())) as f32)
        }
    };
    (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| texel(row, column))).collect()
}

/// rpt looks columns up at azimuth / 2 pi (columns - 1), with azimuth = atan2(z, x) + pi and +y up: a map of one column less
/// whose texel centres are half a texel off. So its frame is rotated by half a texel: 0.5.
fn world_from_map(texels: f64) -> [f32; 9] {
    let (sin, cos) = (PI + 2.0 * PI * texels / f64::from(COLUMNS - 1)).sin_cos();
    [cos, sin, 0.0, 0.0, 0.0, 1.0, -sin, cos, 0.0].map(|x| x as f32)
}

fn materials() -> [(&'static str, Material); 5] {
    [
        ("floor, diffuse", Material::diffuse(glm::vec3(0.5, 0.5, 0.45))),
        ("plastic 0.5", Material::specular(glm::vec3(0.7, 0.2, 0.15), 0.5)),
        ("plastic 0.2", Material::specular(glm::vec3(0.15, 0.3, 0.7), 0.2)),
        ("metal 0.3", Material::metallic(glm::vec3(0.9, 0.7, 0.3), 0.3)),
        ("metal 0.1", Material::metallic(glm::vec3(0.8, 0.8, 0.85), 0.1)),
    ]
}

fn scene(pixels: &[[f32; 3]]) -> Scene {
    let mut scene = Scene::new();
    for (i, (_, material)) in materials().into_iter().enumerate() {
        let object = match i {
            0 => Object::new(plane(glm::vec3(0.0, 1.0, 0.0), -1.0)),
            _ => Object::new(sphere().translate(&glm::vec3(2.2 * (i as f64 - 2.5), 0.0, 0.0))),
        };
        scene.add(object.material(material));
    }
    let buffer = pixels.iter().map(|p| glm::vec3(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]))).collect();
    scene.environment = Environment::Hdri(Hdri::new(COLUMNS, ROWS, buffer));
    scene
}

fn camera() -> Camera {
    Camera::look_at(glm::vec3(0.0, 2.5, 14.0), glm::vec3(0.0, -0.2, 0.0), glm::vec3(0.0, 1.0, 0.0), 0.75)
}

fn closest(scene: &Scene, ray: rpt::Ray, nearest: f64) -> Option<(HitRecord, usize)> {
    let (mut record, mut hit) = (HitRecord::new(), None);
    for (number, object) in scene.objects.iter().enumerate() {
        if object.shape.intersect(&ray, nearest, &mut record) {
            hit = Some(number);
        }
    }
    hit.map(|number| (record, number))
}

/// rpt's luminance of light x BSDF x cosine from a direction, 0 where something is in the way.
fn from(scene: &Scene, at: &Hit, wi: &DVec3) -> f64 {
    let f = at.material.bsdf(&at.normal, &at.wo, wi) * wi.dot(&at.normal).abs();
    if f.sum() <= 0.0 || closest(scene, rpt::Ray { origin: at.position, dir: *wi }, 1e-9).is_some() {
        return 0.0;
    }
    luminance(&f.component_mul(&scene.environment.get_color(wi)))
}

fn luminance(colour: &Color) -> f64 {
    glm::vec3(0.2126, 0.7152, 0.0722).dot(colour)
}

struct Hit {
    position: DVec3,
    normal: DVec3,
    wo: DVec3,
    material: Material,
    number: usize,
}

/// What the camera sees through a place of a pixel, 0 to 1, as rpt's renderer casts it.
fn seen(scene: &Scene, x: u32, y: u32, place: [f64; 2], rng: &mut StdRng) -> Option<Hit> {
    let dim = f64::from(WIDTH.max(HEIGHT));
    let at = |pixel: u32, of: u32, place: f64| (2.0 * (f64::from(pixel) + place) - f64::from(of)) / dim;
    let ray = camera().cast_ray(at(x, WIDTH, place[0]), -at(y, HEIGHT, place[1]), rng);
    let (record, number) = closest(scene, ray, 1e-9)?;
    let wo = -ray.dir.normalize();
    Some(Hit {
        position: ray.at(record.time),
        normal: record.normal,
        wo,
        material: scene.objects[number].material,
        number,
    })
}

fn pixels() -> impl Iterator<Item = (u32, u32)> {
    (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)))
}

/// Lambert with what Fresnel leaves, and GGX with the alpha of rpt's Beckmann distribution.
fn point<'m>(lobes: &'m [wis::Material], hit: &Hit) -> Point<'m> {
    let of = |v: &DVec3| [v.x as f32, v.y as f32, v.z as f32];
    let one = glm::vec3(1.0, 1.0, 1.0);
    let mut point = Point::new(&lobes[hit.number], of(&hit.normal), of(&hit.wo));
    let dielectric = one * ((hit.material.index - 1.0) / (hit.material.index + 1.0)).powi(2);
    let f0 = glm::lerp(&dielectric, &hit.material.color, hit.material.metallic);
    point.weight[0] = of(&(one - f0).component_mul(&hit.material.color));
    point.f0[1] = of(&f0);
    point
}

/// A way to light a hit by one ray; the numbers are pixel and sample.
type Light<'a> = dyn FnMut(&Hit, u32, u32, &mut StdRng) -> Result<f64> + 'a;

/// Luminance pixel by pixel.
fn picture(scene: &Scene, seed: u64, light: &mut Light<'_>) -> Result<Vec<f64>> {
    let mut rng = StdRng::seed_from_u64(seed);
    let picture = (0..).zip(pixels()).map(|(pixel, (x, y))| {
        let mut sum = 0.0;
        for sample in 0..SAMPLES {
            let place = [rng.gen_range(0.0..1.0), rng.gen_range(0.0..1.0)];
            if let Some(hit) = seen(scene, x, y, place, &mut rng) {
                sum += light(&hit, pixel, sample, &mut rng)?;
            }
        }
        Ok(sum / f64::from(SAMPLES))
    });
    picture.collect()
}

/// A picture of rpt's own renderer, decoded from its 8 bits. One bounce: environment light that a BSDF sample meets.
fn own_picture(scene: &Scene) -> Vec<f64> {
    let renderer = Renderer::new(scene, camera()).width(WIDTH).height(HEIGHT).max_bounces(1).exposure_value(EXPOSURE);
    let image = renderer.num_samples(REFERENCE).render();
    let decoded = |byte: u8| ((f64::from(byte) + 0.5) / 255.0).powf(2.2) / EXPOSURE.exp2();
    image.pixels().map(|p| luminance(&glm::vec3(decoded(p[0]), decoded(p[1]), decoded(p[2])))).collect()
}

fn vector(wi: [f32; 3]) -> DVec3 {
    glm::vec3(f64::from(wi[0]), f64::from(wi[1]), f64::from(wi[2])).normalize()
}

/// What `wis_check` calls a light.
fn cause(scene: &Scene, map: &Map<'_>) -> Result<Cause> {
    with_light(map, 1, |environment, sampler| {
        let look_up = |wi: [f32; 3]| {
            let colour = scene.environment.get_color(&vector(wi));
            [colour.x as f32, colour.y as f32, colour.z as f32]
        };
        Ok(sampler.check(environment, look_up)?.cause)
    })
}

/// Rows of the table of tests: lights that are built as rpt looks them up, and not.
fn conventions(scene: &Scene, right: &Map<'_>, texels: &[f32]) -> Result<(String, bool)> {
    let all_columns = Map { width: COLUMNS, pixels: texels, ..*right };
    let lights = [
        ("as rpt has it", *right, Some(Cause::None)),
        ("with +z up", Map { world_from_map: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], ..*right }, None),
        ("without the half texel between rpt's columns", Map { world_from_map: world_from_map(0.0), ..*right }, None),
        ("with rows half a texel beside the poles", Map { rows_at_poles: false, ..*right }, Some(Cause::Rows)),
        // Off by half a texel at most, which is 1.1 % of the light: differences below 2 % have no cause.
        ("with all columns, as the file has them", all_columns, Some(Cause::None)),
    ];
    let (mut text, mut all_hold) = (String::new(), true);
    for (name, map, expected) in lights {
        let found = cause(scene, &map)?;
        let holds = expected.map_or(found != Cause::None, |expected| found == expected);
        all_hold &= holds;
        writeln!(text, "| wis_check: a light built {name} | {found:?} | {} |", verdict(holds))?;
    }
    Ok((text, all_hold))
}

fn main() -> Result<()> {
    let path = std::env::args().nth(1).context("usage: wis-rpt FILE")?;
    let texels = map();
    let scene = scene(&texels);
    // Without the last column, which repeats the first.
    let periodic: Vec<f32> =
        texels.chunks(COLUMNS as usize).flat_map(|row| &row[..COLUMNS as usize - 1]).flatten().copied().collect();
    let light = Map {
        rows_at_poles: true,
        world_from_map: world_from_map(0.5),
        ..Map::latlong(COLUMNS - 1, ROWS, 3, &periodic)
    };
    let (mut tests, mut all_hold) = conventions(&scene, &light, &texels.concat())?;

    let reference = Pictures::take(0..PICTURES, |_| Ok(own_picture(&scene)))?;
    let bsdf = Pictures::take(0..PICTURES, |seed| {
        picture(&scene, seed, &mut |hit, _, _, rng| {
            let sample = hit.material.sample_f(&hit.normal, &hit.wo, rng);
            Ok(sample.map_or(0.0, |(wi, pdf)| if pdf > 0.0 { from(&scene, hit, &wi) / pdf } else { 0.0 }))
        })
    })?;
    let lobes = materials().map(|(_, material)| {
        let alpha = material.roughness as f32;
        wis::Material::new(&[Shape::LAMBERT, Shape::ggx(alpha, alpha)])
    });
    let lobes = lobes.into_iter().collect::<Result<Vec<_>, _>>()?;
    let wis = with_light(&light, 1, |environment, sampler| {
        Pictures::take(0..PICTURES, |seed| {
            picture(&scene, PICTURES + seed, &mut |hit, pixel, sample, _| {
                let at = Sequence { seed: pixel + seed as u32 * WIDTH * HEIGHT, sample, bounce: 0 };
                let mut rays = [Ray::default(); 1];
                let count = sampler.direct(environment, &point(&lobes, hit), at, 1, &mut rays);
                let rays = &rays[..count.map_err(|fault| anyhow!("{fault:?}"))?];
                Ok(rays.iter().map(|ray| from(&scene, hit, &vector(ray.wi)) * f64::from(ray.weight)).sum())
            })
        })
    })?;

    let mut rng = StdRng::seed_from_u64(0);
    let regions = regions(|x, y, place| seen(&scene, x, y, place.map(f64::from), &mut rng).map(|hit| hit.number));
    let truth: Vec<f64> =
        (0..regions.len()).map(|i| reference.of.iter().map(|p| p[i]).sum::<f64>() / PICTURES as f64).collect();
    let names = materials().map(|(name, _)| name.to_string());
    let (gains, worst) = rows(&names, (&regions, &truth), [&wis, &bsdf, &reference], 0)?;
    let agree = worst < Z_LIMIT;
    all_hold &= agree;
    writeln!(
        tests,
        "| means of materials: wis against rpt's own renderer | largest of 5 z: {worst:.1} | {} |",
        verdict(agree)
    )?;
    let text = format!(
        "## A second renderer: rpt\n\n\
        rpt 0.2.1 is a path tracer in Rust (crates.io); `ffi-tests/rpt` calls the crate `wis` for it. rpt lights surfaces from an\n\
        environment by BSDF samples alone. How many times lower the variance is with one ray of `Sampler::direct` than with one BSDF\n\
        sample, under a sky with a lamp, at {SAMPLES} samples a pixel. Above 1x wis is better.\n\n\
        | material | relative, equal rays | absolute, equal rays | relative, equal time | absolute, equal time | mean, against rpt's own | z |\n\
        | --- | --- | --- | --- | --- | --- | --- |\n{gains}\n\
        A picture takes {:.0} ms with BSDF samples and {:.0} ms with wis, on one thread: rays meet five objects at most.\n\n\
        | test | result | verdict |\n| --- | --- | --- |\n{tests}\n\
        rpt looks {COLUMNS} columns up as if the last one were the first one again, with texels at the ends. That is a light of {}\n\
        columns whose frame is rotated by half a texel; `wis_check` finds each part of this that is forgotten.\n",
        1e3 * bsdf.seconds,
        1e3 * wis.seconds,
        COLUMNS - 1
    );
    std::fs::write(&path, &text)?;
    println!("{text}");
    ensure!(all_hold, "a test does not hold");
    Ok(())
}
