//! Measures triple product integrals (Ng et al. 2004) on a real light, real visibility and analytic BRDFs: triple <page>

mod fields;
mod relighting;
mod sampling;
mod spherical;

use anyhow::{Context, Result};
use glam::Vec3;
use std::fmt::Write;
use std::path::Path;
use std::time::Instant;
use wide::f32x8;
use wis_ffi_tests::client::{Tree, raw};
use wis_ffi_tests::data;
use wis_ffi_tests::light::octahedral_direction;
use wis_ffi_tests::material::{Bsdf, Material};
use wis_ffi_tests::scene::{Scene, ShadingPoint, View};

const DEPTH: u32 = 7;
const SIDE: usize = 1 << DEPTH;
const POINTS: usize = 40;
/// Shares of the wavelets that are kept.
const SHARES: [f64; 9] = [0.0005, 0.001, 0.002, 0.005, 0.01, 0.03, 0.1, 0.3, 1.0];
const ROUNDS: usize = 9;

fn main() -> Result<()> {
    let page = std::env::args().nth(1).context("usage: triple <page>")?;
    let scene = data::scene("spot.obj", View::Points(POINTS))?;
    let light = data::light("grace_latlong.exr")?;
    let mut out = String::from(INTRODUCTION);
    counts(&mut out)?;
    let pixels = light.on_octahedron(SIDE, 4, |world| world);
    let tree = Tree::new(DEPTH, 0.0, &pixels)?;
    writeln!(out, "\n## Error and time against the terms that are kept (Fig. 3)\n")?;
    writeln!(
        out,
        "Light: {}, visibility: {} points of {}, {SIDE} x {SIDE} pixels on the octahedral square, so {} wavelets each.\n",
        light.name,
        scene.points.len(),
        scene.name,
        SIDE * SIDE - 1
    )?;
    for material in [Material::lambert(), Material::ggx(0.5), Material::ggx(0.2), Material::mix(0.1)] {
        material_table(&mut out, &scene, (&pixels, &tree), &material)?;
    }
    spherical::write(&mut out)?;
    sampling::write(&mut out, &light)?;
    relighting::write(&mut out, &light)?;
    let beside = Path::new(&page).parent().unwrap_or(Path::new("."));
    fields::write(&mut out, &light, &beside.join("triple-2004"))?;
    print!("{out}");
    Ok(std::fs::write(page, out)?)
}

const INTRODUCTION: &str = "# Triple product wavelet integrals

Written by `make triple`. Ng et al. 2004, \"Triple Product Wavelet Integrals for All-Frequency Relighting\": the
integrals, their coefficients and the sublinear algorithm (`wis_triple_*`, `wis_tripling_coefficient`), and the product as
something to sample (`wis_tree_multiply`). `make relight` turns a light about a scene whose every pixel is a vertex.

| claim | paper | here | holds |
|---|---|---|---|
| wavelets approximate all frequencies, harmonics do not (6.1) | curves | 400 terms: Haar .004 to .29, harmonics .12 to .73, pixels .01 to .91 | yes |
| non-zero tripling coefficients (4) | 2 - N + 3 N log4 N | 8 - 7 N + 9 N log4 N, ordered | O(N log N) does |
| visibility is sparse (7.1.1) | .8 to 6.2 % | see the table | yes |
| .1 to 1 % of BRDF and light suffice (8.1) | pictures | 1 % of a Lambert lobe's error asks for 19 %, of Phong 200 for 1.2 % | for sharp lobes |
| 10 to 30 times faster than pixels at 1 % of error (Fig. 3) | yes | pixels win | no |
| 3 to 5 s a frame, 100 to 300 thousand vertices (8.2) | 2004 | see below | yes |

Open: figures on six cube faces and frames of 100 and 300 thousand vertices there (34834 vertices on the octahedral square are
measured, and scaled), pictures by the number of terms (Fig. 4) and of a view that changes.

What does not hold: 10 to 30 times faster than a sum over pixels at 1 % of error. A term costs about 30 ns, a pixel 0.3 ns
in eight lanes, and 1 % of error takes 3 to 10 % of the terms of these inputs; wavelets are ahead below .5 % of the terms,
where the error is 20 % and more. Against pixels that are stored as wavelets and must be decompressed first (30 us) they win
12 times at 20 % of error, twice at 5 %, and about tie at 1 %. What they save is memory: 2 kB a vertex in place of 64.

Time grows as the .91th power of the terms over three decades (Fig. 3 has slope 1), error falls as the 1.4th.

Operations of the linear algorithm: 12.3 a pixel (a test counts 21 multiplications and 14 additions a square, and area and
sum); the paper says 13, its form takes 16.3 when factored. Averages are stored, which makes the parent sums free.

What the paper does not have: sampling with visibility. A density that believes an estimate of visibility wins 1.4 to 3
times in the penumbra and 5 to 9 times in the umbra, and loses where everything is seen, where there was little to win.

![A frame of make relight](triple-2004/relight.png)
";

/// The counts of non-zero coefficients, beside the paper's.
fn counts(out: &mut String) -> Result<()> {
    writeln!(out, "\n## Tripling coefficients that are not 0 (Section 4.6)\n")?;
    writeln!(out, "Ordered triples of N functions on a square, enumerated (N up to 64: a test does) or by")?;
    writeln!(out, "8 - 7 N + 9 N log4 N; unordered ones; and what Eq. 19 of the paper says, 2 - N + 3 N log4 N.\n")?;
    writeln!(out, "| N | ordered | unordered | paper |\n|---:|---:|---:|---:|")?;
    for depth in 1..=8u64 {
        let n = 1u64 << (2 * depth);
        let (ordered, log) = (8 + 9 * n * depth - 7 * n, depth);
        let unordered = 1 + (n - 1) / 3 + 3 * (1 + n * log - n);
        writeln!(out, "| {n} | {ordered} | {unordered} | {} |", 2 + 3 * n * log - n)?;
    }
    Ok(())
}

/// The direction of a place in a pixel.
fn pixel(i: usize, parts: [f32; 2]) -> Vec3 {
    let at = |c: usize, part: f32| (c as f32 + part) / SIDE as f32;
    octahedral_direction(at(i % SIDE, parts[0]), at(i / SIDE, parts[1]))
}

/// BRDF x cosine, the mean of four places in a pixel.
fn mean_on_pixel(bsdf: &Bsdf, i: usize) -> f32 {
    let quarters = [[0.25, 0.25], [0.25, 0.75], [0.75, 0.25], [0.75, 0.75]];
    quarters.iter().map(|&parts| bsdf.eval_one(pixel(i, parts)).0).sum::<f32>() / 4.0
}

/// A shading point's BRDF x cosine and visibility on the square.
struct Point {
    brdf: Vec<f32>,
    visible: Vec<f32>,
    brdf_tree: Tree,
    visible_tree: Tree,
    exact: f64,
}

impl Point {
    fn new(scene: &Scene, point: &ShadingPoint, light: &[f32], material: &Material) -> Result<Point> {
        let bsdf = Bsdf::new(material, point);
        let brdf: Vec<f32> = (0..SIDE * SIDE).map(|i| mean_on_pixel(&bsdf, i)).collect();
        let seen = |i: usize| f32::from(u8::from(is_seen(scene, point, pixel(i, [0.5, 0.5]))));
        let visible: Vec<f32> = (0..SIDE * SIDE).map(seen).collect();
        let (brdf_tree, visible_tree) = (Tree::new(DEPTH, 0.0, &brdf)?, Tree::new(DEPTH, 0.0, &visible)?);
        let product =
            brdf.iter().zip(light).zip(&visible).map(|((&b, &l), &v)| f64::from(b) * f64::from(l) * f64::from(v));
        let exact = product.sum::<f64>() / (SIDE * SIDE) as f64;
        Ok(Point { brdf, visible, brdf_tree, visible_tree, exact })
    }
}

fn is_seen(scene: &Scene, point: &ShadingPoint, wi: Vec3) -> bool {
    scene.visible(point, wi)
}

/// The pixels of a list of wavelets, in Morton order: what a renderer that stores wavelets pays before it can add up pixels.
fn decompress(average: f64, list: &[raw::wis_wavelets]) -> Vec<f32> {
    const MORTON_BITS: u32 = 24;
    let mut pixels = vec![average as f32; SIDE * SIDE];
    for w in list {
        let quarter = (SIDE * SIDE) >> (2 * w.level + 2);
        let first = (w.position >> (MORTON_BITS - 2 * DEPTH)) as usize;
        let [a, b, c] = w.detail;
        let parts = [a + b + c, b - a - c, a - b - c, c - a - b];
        for (part, value) in pixels[first..first + 4 * quarter].chunks_exact_mut(quarter).zip(parts) {
            part.iter_mut().for_each(|pixel| *pixel += value);
        }
    }
    pixels
}

/// The fastest round over all points, in microseconds for a point.
fn fastest(points: &[Point], mut each: impl FnMut(&Point) -> Result<f64>) -> Result<f64> {
    let mut best = f64::MAX;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        for point in points {
            std::hint::black_box(each(point)?);
        }
        best = best.min(start.elapsed().as_secs_f64() * 1e6 / points.len() as f64);
    }
    Ok(best)
}

/// The sum over pixels, eight at a time.
fn by_pixels(point: &Point, light: &[f32]) -> f64 {
    by_pixels_of(&point.brdf, light, &point.visible)
}

fn by_pixels_of(brdf: &[f32], light: &[f32], visible: &[f32]) -> f64 {
    let eight = |values: &[f32], i: usize| f32x8::from(<[f32; 8]>::try_from(&values[i..i + 8]).expect("eight"));
    let terms = (0..light.len()).step_by(8).map(|i| eight(brdf, i) * eight(light, i) * eight(visible, i));
    f64::from(terms.fold(f32x8::ZERO, |sum, term| sum + term).reduce_add()) / light.len() as f64
}

fn material_table(
    out: &mut String,
    scene: &Scene,
    (pixels, light): (&[f32], &Tree),
    material: &Material,
) -> Result<()> {
    let points = scene.points.iter().map(|p| Point::new(scene, p, pixels, material)).collect::<Result<Vec<_>>>()?;
    let norm = points.iter().map(|p| p.exact * p.exact).sum::<f64>().sqrt();
    let off = |values: &[f64]| {
        let squares = values.iter().zip(&points).map(|(v, p)| (v - p.exact).powi(2));
        squares.sum::<f64>().sqrt() / norm
    };
    let linear = |p: &Point| Ok(Tree::triple_integral([&p.brdf_tree, light, &p.visible_tree])?);
    let exact = points.iter().map(linear).collect::<Result<Vec<_>>>()?;
    let (pixel_us, linear_us) = (fastest(&points, |p| Ok(by_pixels(p, pixels)))?, fastest(&points, linear)?);
    let light_pixels = decompress(light.info.average, &light.largest(3 << (2 * DEPTH))?);
    let all = |tree: &Tree| tree.largest(3 << (2 * DEPTH));
    let stored = points.iter().map(|p| Ok([all(&p.brdf_tree)?, all(&p.visible_tree)?])).collect::<Result<Vec<_>>>()?;
    let mut next = 0;
    let unpacked_us = fastest(&points, |p| {
        let [brdf, visible] = &stored[next % stored.len()];
        next += 1;
        let brdf = decompress(p.brdf_tree.info.average, brdf);
        Ok(by_pixels_of(&brdf, &light_pixels, &decompress(p.visible_tree.info.average, visible)))
    })?;
    let squares = points.iter().map(|p| p.visible_tree.info.squares as f64).sum::<f64>() / points.len() as f64;
    writeln!(
        out,
        "### {}\n\nPixel loop, eight lanes: {pixel_us:.1} us; {unpacked_us:.1} us if BRDF and visibility are wavelets that it must \
         decompress. Linear algorithm: {linear_us:.1} us, off by {:.1e}. Visibility keeps \
         {squares:.0} of {} squares without loss.\n",
        material.name,
        off(&exact),
        (SIDE * SIDE - 1) / 3
    )?;
    writeln!(out, "| share kept | terms | relative L2 error | us | pixel loop / this |\n|---:|---:|---:|---:|---:|")?;
    for share in SHARES {
        let keep = (share * (SIDE * SIDE - 1) as f64).round() as u32;
        let kept = light.largest(keep)?;
        let lists =
            points.iter().map(|p| Ok(p.brdf_tree.largest(keep)?)).collect::<Result<Vec<Vec<raw::wis_wavelets>>>>()?;
        let value = |p: &Point, list: &[raw::wis_wavelets]| {
            Ok(light.sublinear((p.brdf_tree.info.average, list), &kept, &p.visible_tree)?)
        };
        let values = points.iter().zip(&lists).map(|(p, list)| value(p, list)).collect::<Result<Vec<f64>>>()?;
        let mut index = 0;
        let us = fastest(&points, |p| {
            let list = &lists[index % lists.len()];
            index += 1;
            value(p, list)
        })?;
        let percent = 100.0 * share;
        writeln!(out, "| {percent:.2} % | {keep} | {:.4} | {us:.2} | {:.2} |", off(&values), pixel_us / us)?;
    }
    Ok(writeln!(out)?)
}
