//! Error and time against the number of terms (Ng et al. 2004, Fig. 3): sublinear integrals against sums over pixels.

use crate::domain::{Domain, Lists};
use anyhow::Result;
use glam::Mat3;
use plotters::prelude::{Color, Palette, Palette99, RGBColor, SeriesLabelPosition};
use std::fmt::Write;
use std::hint::black_box;
use std::path::Path;
use wide::f32x8;
use wis_ffi_tests::client::{Tree, raw};
use wis_ffi_tests::data;
use wis_ffi_tests::light::Light;
use wis_ffi_tests::material::{Bsdf, Material};
use wis_ffi_tests::paper::{Paper, columns, range};
use wis_ffi_tests::plot::{self, Chart, Line};
use wis_ffi_tests::processor;
use wis_ffi_tests::scene::{Scene, ShadingPoint, View};

const POINTS: usize = 8;
/// Squares that are kept, as a share of the wavelets: a third of them are all.
const SHARES: [f64; 11] = [0.0001, 0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.03, 0.06, 0.1, 0.3];
const ROUNDS: usize = 7;
/// Levels of a face of the paper's cube.
const DEPTH: u32 = 8;
/// How far from 1 the slope of time against terms may be, both logarithmic, from 0.1 to 10 %: the paper's is read from a plot.
const SLOPE: f64 = 0.15;
/// The error that counts as reasonable, a smaller one, and how much faster wavelets are in the paper.
const REASONABLE: f64 = 0.05;
const FINE: f64 = 0.01;
const FASTER: f64 = 10.0;
/// Writes the section.
pub fn write(page: &mut Paper, light: &Light) -> Result<()> {
    let scene = data::scene("spot.obj", View::Points(POINTS))?;
    page.heading("Error and time against the terms that are kept (Fig. 3)")?;
    writeln!(page.text, "Light: {}, visibility: {} points of {}.", light.name, scene.points.len(), scene.name)?;
    let domain = Domain::cube(DEPTH);
    let pixels = domain.light(light, Mat3::IDENTITY);
    let lit = Lit { domain, trees: domain.trees(&pixels)?, pixels };
    let materials = [Material::lambert(), Material::ggx(0.5), Material::ggx(0.2), Material::mix(0.1)];
    let mut tables = String::new();
    let curves =
        materials.iter().map(|material| curve(&mut tables, &scene, &lit, material)).collect::<Result<Vec<_>>>()?;
    let file = page.pictures.join("terms.svg");
    plot(&curves, &file)?;
    writeln!(page.text, "\n![error and time against terms]({})", page.link("terms.svg"))?;
    writeln!(
        page.text,
        "\n{}\n\n### {} pixels, {} wavelets\n",
        eight_at_a_time(&curves),
        domain.name(),
        domain.wavelets()
    )?;
    claims(page, &curves);
    sums(&mut page.text, &curves, domain)?;
    page.text += &tables;
    Ok(())
}

fn claims(page: &mut Paper, curves: &[Curve]) {
    let rows = curves.iter().flat_map(|curve| &curve.rows).filter(|row| MIDDLE.contains(&row.share));
    let [low, high] = range(rows.map(|row| 1e3 * row.us[0] / row.terms as f64));
    let slopes: Vec<f64> = curves.iter().map(Curve::slope).collect();
    let [flat, steep] = range(slopes.iter().copied());
    let mean = |of: &dyn Fn(&Curve) -> f64| curves.iter().map(of).sum::<f64>() / curves.len() as f64;
    let (scalar, decompressed) = (mean(&|curve| curve.scalar), mean(&|curve| curve.decompressed));
    let pixels = Domain::cube(DEPTH).pixels() as f64;
    let gains = |of: &dyn Fn(&Curve) -> f64| {
        let at = |curve: &Curve, error: f64| curve.within(error).map_or(0.0, |row| of(curve) / row.us[0]);
        let cell = |curve: &Curve| {
            let share = curve.within(REASONABLE).map_or(1.0, |row| row.share);
            let (fair, fine) = (at(curve, REASONABLE), at(curve, FINE));
            format!(
                "{} {fair:.0}x ({:.2} % of the terms; {fine:.1}x at {:.0} % error)",
                curve.name,
                100.0 * share,
                100.0 * FINE
            )
        };
        let least = curves.iter().map(|curve| at(curve, REASONABLE)).fold(f64::INFINITY, f64::min);
        (curves.iter().map(cell).collect::<Vec<_>>().join(", "), least)
    };
    let (simple, least) = gains(&|curve| curve.scalar);
    page.claim("for reasonable error (5", least >= FASTER, &[&simple, &low, &high, &(1e3 * scalar / pixels)]);
    let (unpacked, least) = gains(&|curve| curve.decompressed);
    page.claim("the same against pixels", least >= FASTER, &[&unpacked, &decompressed, &(decompressed / scalar)]);
    let is_linear = slopes.iter().all(|slope| (slope - 1.0).abs() <= SLOPE);
    page.claim("time is linear in", is_linear, &[&flat, &steep, &low, &high]);
}

/// What eight pixels at a time change.
fn eight_at_a_time(curves: &[Curve]) -> String {
    let [least, most] = range(curves.iter().map(|curve| curve.scalar / curve.pixels));
    let ahead = |curve: &Curve| curve.rows.iter().rfind(|row| row.us[0] < curve.pixels).map_or(0.0, |row| row.share);
    let share = curves.iter().map(ahead).fold(1.0, f64::min);
    format!(
        "The paper's factor is one over a loop that adds pixel by pixel. Eight at a time are {least:.1} to {most:.1} times as fast. Wavelets\n\
         are ahead of those up to {:.2} % of the terms, whatever the lobe. They save memory at any speed: a vertex takes kilobytes in\n\
         place of megabytes.",
        100.0 * share
    )
}

/// The shares between which the time is looked at.
const MIDDLE: std::ops::RangeInclusive<f64> = 0.001..=0.1;

/// Error and time against terms.
fn plot(curves: &[Curve], file: &Path) -> Result<()> {
    let most = curves.iter().flat_map(|c| &c.rows).map(|row| row.terms as f64).fold(1.0, f64::max);
    let lines = |of: &dyn Fn(&Row) -> f64, named: bool| -> Vec<Line> {
        let line = |(i, curve): (usize, &Curve)| Line {
            name: if named { curve.name.clone() } else { String::new() },
            points: curve.rows.iter().map(|row| (row.terms as f64, of(row))).collect(),
            style: Palette99::pick(i).stroke_width(2),
        };
        curves.iter().enumerate().map(line).collect()
    };
    let first = &curves[0];
    let levels =
        [("pixels", first.pixels), ("decompressed pixels", first.decompressed), ("linear algorithm", first.linear)];
    let mut times = lines(&|row| row.us[0], false);
    times.extend(levels.into_iter().zip([0, 100, 170]).map(|((name, us), grey)| Line {
        name: name.into(),
        points: vec![(30.0, us), (most, us)],
        style: RGBColor(grey, grey, grey).stroke_width(2),
    }));
    let chart = |title, low: f64, high: f64, key, lines| Chart {
        title,
        x: "terms of 393210",
        ends: [[30.0, most], [low, high]],
        logarithmic: true,
        key,
        lines,
    };
    let errors = lines(&|row| row.error.max(1e-4), true);
    let error = chart("relative L2 error", 1e-4, 1.0, SeriesLabelPosition::LowerLeft, errors);
    plot::save(file, [error, chart("microseconds", 1.0, 2e4, SeriesLabelPosition::LowerRight, times)])
}

/// A light on a domain.
struct Lit {
    domain: Domain,
    pixels: Vec<f32>,
    trees: Vec<Tree>,
}

/// A shading point's BRDF x cosine and visibility.
struct Point {
    brdf: Vec<f32>,
    visible: Vec<f32>,
    brdf_trees: Vec<Tree>,
    visible_trees: Vec<Tree>,
    exact: f64,
}

impl Point {
    fn new(scene: &Scene, point: &ShadingPoint, light: &Lit, material: &Material) -> Result<Point> {
        let (bsdf, domain) = (Bsdf::new(material, point), light.domain);
        let quarters = [[0.25, 0.25], [0.25, 0.75], [0.75, 0.25], [0.75, 0.75]];
        let mean = |i: usize| quarters.iter().map(|&at| bsdf.eval_one(domain.place(i, at).0).0).sum::<f32>() / 4.0;
        let seen = |i: usize| f32::from(u8::from(scene.visible(point, domain.place(i, [0.5, 0.5]).0)));
        let brdf: Vec<f32> = (0..domain.pixels()).map(mean).collect();
        let visible: Vec<f32> = (0..domain.pixels()).map(seen).collect();
        let (brdf_trees, visible_trees) = (domain.trees(&brdf)?, domain.trees(&visible)?);
        let terms = brdf.iter().zip(&light.pixels).zip(&visible);
        let sum = terms.map(|((&b, &l), &v)| f64::from(b) * f64::from(l) * f64::from(v)).sum::<f64>();
        Ok(Point { brdf, visible, brdf_trees, visible_trees, exact: sum / domain.pixels() as f64 })
    }

    /// By the linear algorithm.
    fn linear(&self, light: &Lit) -> Result<f64> {
        let mut sum = 0.0;
        for ((brdf, light), visible) in self.brdf_trees.iter().zip(&light.trees).zip(&self.visible_trees) {
            sum += Tree::triple_integral([brdf, light, visible])?;
        }
        Ok(light.domain.mean(sum))
    }

    /// With the wavelets of the BRDF and of the light that are kept.
    fn sublinear(&self, light: &Lit, brdf: &Lists, kept: &Lists) -> Result<f64> {
        let mut sum = 0.0;
        for (face, tree) in light.trees.iter().enumerate() {
            let brdf = (self.brdf_trees[face].info.average, brdf[face].as_slice());
            sum += tree.sublinear(brdf, &kept[face], &self.visible_trees[face])?;
        }
        Ok(light.domain.mean(sum))
    }
}

/// Bits of a position.
pub const MORTON_BITS: u32 = 24;

/// The pixels of a face in Morton order: what a renderer that stores wavelets pays before it can add up pixels.
fn decompress(depth: u32, average: f64, list: &[raw::wis_wavelets], pixels: &mut [f32]) {
    pixels.fill(average as f32);
    for w in list {
        let quarter = pixels.len() >> (2 * w.level + 2);
        let first = (w.position >> (MORTON_BITS - 2 * depth)) as usize;
        let [a, b, c] = w.detail;
        let parts = [a + b + c, b - a - c, a - b - c, c - a - b];
        for (part, value) in pixels[first..first + 4 * quarter].chunks_exact_mut(quarter).zip(parts) {
            part.iter_mut().for_each(|pixel| *pixel += value);
        }
    }
}

/// The pixels of all faces.
fn decompressed(domain: Domain, trees: &[Tree], lists: &Lists) -> Vec<f32> {
    let mut pixels = vec![0.0; domain.pixels()];
    for ((tree, list), face) in trees.iter().zip(lists).zip(pixels.chunks_mut(1 << (2 * domain.depth))) {
        decompress(domain.depth, tree.info.average, list, face);
    }
    pixels
}

/// The least time of a point in microseconds, mean over all points: point by point, so that its lists are in the caches, and
/// in turns with all others, so that they are not.
fn fastest(points: &[Point], mut each: impl FnMut(usize, &Point) -> Result<f64>) -> Result<[f64; 2]> {
    let mut best = vec![[f64::MAX; 2]; points.len()];
    let mut time = |i: usize| -> Result<f64> {
        let start = processor::seconds();
        black_box(each(i, &points[i])?);
        Ok((processor::seconds() - start) * 1e6)
    };
    for (i, best) in best.iter_mut().enumerate() {
        for _ in 0..ROUNDS {
            best[0] = best[0].min(time(i)?);
        }
    }
    for _ in 0..ROUNDS {
        for (i, best) in best.iter_mut().enumerate() {
            best[1] = best[1].min(time(i)?);
        }
    }
    Ok([0, 1].map(|k| best.iter().map(|best| best[k]).sum::<f64>() / points.len() as f64))
}

/// The mean of the products of pixels, one by one: the paper's simple loop.
fn one_by_one(brdf: &[f32], light: &[f32], visible: &[f32]) -> f64 {
    let terms = brdf.iter().zip(light).zip(visible).map(|((b, l), v)| b * l * v);
    f64::from(terms.sum::<f32>()) / light.len() as f64
}

/// The mean of the products of pixels, eight at a time.
pub fn by_pixels(brdf: &[f32], light: &[f32], visible: &[f32]) -> f64 {
    let eight = |values: &[f32], i: usize| f32x8::from(<[f32; 8]>::try_from(&values[i..i + 8]).expect("eight"));
    let terms = (0..light.len()).step_by(8).map(|i| eight(brdf, i) * eight(light, i) * eight(visible, i));
    f64::from(terms.fold(f32x8::ZERO, |sum, term| sum + term).reduce_add()) / light.len() as f64
}

/// A material's row of Fig. 3.
struct Row {
    share: f64,
    terms: usize,
    error: f64,
    /// Microseconds with warm lists, and in turns.
    us: [f64; 2],
}

/// What Fig. 3 shows of a material.
struct Curve {
    name: String,
    rows: Vec<Row>,
    /// Microseconds of sums over pixels: one by one, eight at a time, and decompressed first; of the linear algorithm.
    scalar: f64,
    pixels: f64,
    decompressed: f64,
    linear: f64,
    /// Of the first two with other points in between.
    turns: [f64; 2],
    /// The relative error of the linear algorithm.
    off: f64,
    /// Squares of visibility without loss.
    squares: f64,
}

impl Curve {
    /// The slope of a line through the logarithms of time against those of the terms.
    fn slope(&self) -> f64 {
        let rows = self.rows.iter().filter(|row| MIDDLE.contains(&row.share));
        let points: Vec<[f64; 2]> = rows.map(|row| [(row.terms as f64).ln(), row.us[0].ln()]).collect();
        let mean = [0, 1].map(|k| points.iter().map(|point| point[k]).sum::<f64>() / points.len() as f64);
        let sum = |k: usize| points.iter().map(|point| (point[0] - mean[0]) * (point[k] - mean[k])).sum::<f64>();
        sum(1) / sum(0)
    }

    /// The fewest terms with at most an error.
    fn within(&self, error: f64) -> Option<&Row> {
        self.rows.iter().find(|row| row.error <= error)
    }
}

fn curve(out: &mut String, scene: &Scene, light: &Lit, material: &Material) -> Result<Curve> {
    let domain = light.domain;
    let points = scene.points.iter().map(|p| Point::new(scene, p, light, material)).collect::<Result<Vec<_>>>()?;
    let norm = points.iter().map(|p| p.exact * p.exact).sum::<f64>().sqrt();
    let off = |values: &[f64]| {
        let squares = values.iter().zip(&points).map(|(v, p)| (v - p.exact).powi(2));
        squares.sum::<f64>().sqrt() / norm
    };
    let exact = points.iter().map(|p| p.linear(light)).collect::<Result<Vec<_>>>()?;
    let [scalar, scalar_in_turns] = fastest(&points, |_, p| Ok(one_by_one(&p.brdf, &light.pixels, &p.visible)))?;
    let [pixels, in_turns] = fastest(&points, |_, p| Ok(by_pixels(&p.brdf, &light.pixels, &p.visible)))?;
    let [linear, _] = fastest(&points, |_, p| p.linear(light))?;
    let decompressed = decompression(&points, light)?;
    let squares: u32 = points.iter().flat_map(|p| p.visible_trees.iter().map(|tree| tree.info.squares)).sum();
    writeln!(out, "\n#### {}\n", material.name)?;
    columns(
        out,
        0,
        "share kept | terms | relative L2 error | us | ns a term | us, in turns | one by one / this | eight at a time / this | decompressed / this",
    )?;
    let mut rows = Vec::new();
    for share in SHARES {
        let terms = domain.terms(share);
        let kept = domain.largest(&light.trees, terms)?;
        let lists = points.iter().map(|p| domain.largest(&p.brdf_trees, terms)).collect::<Result<Vec<Lists>>>()?;
        let value = |i: usize, p: &Point| p.sublinear(light, &lists[i], &kept);
        let values = points.iter().enumerate().map(|(i, p)| value(i, p)).collect::<Result<Vec<f64>>>()?;
        let (us, error) = (fastest(&points, value)?, off(&values));
        writeln!(
            out,
            "| {:.2} % | {terms} | {error:.4} | {:.1} | {:.0} | {:.1} | {:.2} | {:.2} | {:.2} |",
            100.0 * share,
            us[0],
            1e3 * us[0] / terms as f64,
            us[1],
            scalar / us[0],
            pixels / us[0],
            decompressed / us[0]
        )?;
        rows.push(Row { share, terms, error, us });
    }
    Ok(Curve {
        name: material.name.clone(),
        rows,
        scalar,
        pixels,
        decompressed,
        linear,
        turns: [scalar_in_turns, in_turns],
        off: off(&exact),
        squares: f64::from(squares) / points.len() as f64,
    })
}

/// The table of what does not depend on the terms that are kept.
fn sums(out: &mut String, curves: &[Curve], domain: Domain) -> Result<()> {
    writeln!(
        out,
        "Microseconds of sums over all pixels and of the linear algorithm. Decompressed: BRDF and visibility are wavelets that the sum,\n\
         eight at a time, must decompress first. Visibility is without loss, of {} squares.\n",
        domain.wavelets() / 3
    )?;
    columns(
        out,
        1,
        "lobe | one by one | in turns | eight at a time | in turns | decompressed | linear algorithm | its error | squares of visibility",
    )?;
    for Curve { name, scalar, pixels, decompressed, linear, turns, off, squares, .. } in curves {
        writeln!(
            out,
            "| {name} | {scalar:.0} | {:.0} | {pixels:.0} | {:.0} | {decompressed:.0} | {linear:.0} | {off:.1e} | {squares:.0} |",
            turns[0], turns[1]
        )?;
    }
    Ok(())
}

/// The time of the pixel loop if BRDF and visibility must be decompressed for it.
fn decompression(points: &[Point], light: &Lit) -> Result<f64> {
    let domain = light.domain;
    let all = |trees: &[Tree]| domain.all(trees);
    let pixels = decompressed(domain, &light.trees, &all(&light.trees)?);
    let stored =
        points.iter().map(|p| Ok([all(&p.brdf_trees)?, all(&p.visible_trees)?])).collect::<Result<Vec<_>>>()?;
    let [us, _] = fastest(points, |i, p| {
        let [brdf, visible] = &stored[i];
        let brdf = decompressed(domain, &p.brdf_trees, brdf);
        Ok(by_pixels(&brdf, &pixels, &decompressed(domain, &p.visible_trees, visible)))
    })?;
    Ok(us)
}
