//! The model of visibility behind the metric (Section 2.1, Fig. 2).

use anyhow::Result;
use plotters::prelude::{BLACK, Color, Palette, Palette99, RGBColor, SeriesLabelPosition};
use std::fmt::Write;
use std::path::Path;
use wis_ffi_tests::data;
use wis_ffi_tests::paper::{Paper, Verdict, columns, range};
use wis_ffi_tests::plot::{self, Chart, Line};
use wis_ffi_tests::points;
use wis_ffi_tests::scene::{Scene, ShadingPoint, View};
use wis_ffi_tests::visibility::{self, Model};

/// How far the constant of Eq. 6 may be off, and the share of 1/4 that counts as reached.
const OFF: f64 = 0.25;
const REACHED: f64 = 0.9;
/// R^2 of a line, in the median of the points: the paper shows one.
const LINE: f64 = 0.9;

/// Writes the section.
pub fn write(page: &mut Paper) -> Result<()> {
    let mut models = Vec::new();
    for file in ["teapot.obj", "stanford-bunny.obj", "spot.obj", "dragon_vrip_res3.ply", "buddha.obj"] {
        let scene = data::scene(file, View::Points(1500))?;
        for point in half_hidden(&scene) {
            models.push((scene.name.clone(), visibility::measure(&scene, &point)));
        }
    }
    let rows: Vec<[f64; 3]> = models.iter().map(|(_, model)| slopes(model)).collect();
    let model = [0.25, 0.5].map(|x| in_the_model(x) / 4.0 / x);
    let tail = in_the_model(0.75);
    page.heading("Visibility (Section 2.1, Fig. 2)")?;
    columns(&mut page.text, 1, "mesh | seen | T | fit, R^2 | variance x T / angle at T/4 | at T/2 | at 3T/4, of 1/4")?;
    let number = |x: f64| if x.is_nan() { "-".into() } else { format!("{x:.2}") };
    for ((name, Model { visible, angle, explained, .. }), row) in models.iter().zip(&rows) {
        let [a, b, c] = row.map(number);
        writeln!(page.text, "| {name} | {visible:.2} | {angle:.2} | {explained:.2} | {a} | {b} | {c} |")?;
    }
    writeln!(page.text, "| the model itself | 0.50 | 1 | 1.00 | {:.2} | {:.2} | {tail:.2} |", model[0], model[1])?;
    let file = page.pictures.join("visibility.svg");
    plot(&models, &file)?;
    writeln!(page.text, "\n![log correlation and variance against angle]({})", page.link("visibility.svg"))?;
    claims(page, &models, &rows, (model[0], tail));
    Ok(())
}

fn claims(page: &mut Paper, models: &[(String, Model)], rows: &[[f64; 3]], (model, tail): (f64, f64)) {
    let [least, most] = range(models.iter().map(|m| m.1.explained));
    let mut fits: Vec<f64> = models.iter().map(|m| m.1.explained).collect();
    fits.sort_by(f64::total_cmp);
    let median = fits[fits.len() / 2];
    let [short, long] = range(models.iter().map(|m| m.1.angle));
    page.claim("correlation of visibility falls", median >= LINE, &[&least, &most, &median, &short, &long]);
    let [low, high] = range(rows.iter().map(|row| row[0]));
    let third = 1.0 / 3.0;
    page.claim(
        "the variance in a",
        Verdict::Refuted.unless(low >= third * (1.0 - OFF) && high <= third * (1.0 + OFF)),
        &[&low, &high, &model],
    );
    let [low, high] = range(rows.iter().map(|row| row[1] / row[0]));
    page.claim("that variance is proportional", low >= 1.0 - OFF && high <= 1.0 + OFF, &[&low, &high]);
    let [low, high] = range(rows.iter().map(|row| row[2]));
    let verdict = Verdict::Refuted.unless(low >= REACHED);
    page.claim("the variance reaches its", verdict, &[&(100.0 * low), &(100.0 * high), &(100.0 * tail)]);
}

/// Variance x T / angle at a quarter and at half of T, and the variance at three quarters, of 1/4.
fn slopes(model: &Model) -> [f64; 3] {
    let at = |share: f64| variance_at(model, share * model.angle);
    [at(0.25), at(0.5) / 2.0, at(0.75)]
}

/// The expected variance, of 1/4, in a disc of so many T where the correlation is exponential: the mean of what it loses
/// between two points of the disc.
fn in_the_model(radius: f64) -> f64 {
    const PAIRS: usize = 4096;
    let (first, second) = (points::of(11, PAIRS), points::of(12, PAIRS));
    let place = |u: &[f32; 2]| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(u[1])).sin_cos();
        let r = radius * f64::from(u[0]).sqrt();
        [r * cos, r * sin]
    };
    let lost = |(a, b): (&[f32; 2], &[f32; 2])| {
        let (a, b) = (place(a), place(b));
        1.0 - (-(a[0] - b[0]).hypot(a[1] - b[1])).exp()
    };
    first.iter().zip(&second).map(lost).sum::<f64>() / PAIRS as f64
}

/// Two points of which about half of the hemisphere is hidden.
fn half_hidden(scene: &Scene) -> Vec<ShadingPoint> {
    let mut points: Vec<_> = scene.points.iter().map(|p| (visibility::visible_share(scene, p), *p)).collect();
    points.sort_by(|a, b| (a.0 - 0.5).abs().total_cmp(&(b.0 - 0.5).abs()));
    let second = points.len() / 16;
    [0, second].iter().filter_map(|&i| points.get(i)).map(|p| p.1).collect()
}

/// The relative variance at a half-angle, between those that were measured.
fn variance_at(model: &Model, angle: f64) -> f64 {
    let pair = model.variance.windows(2).find(|pair| (pair[0].0..pair[1].0).contains(&angle));
    pair.map_or(f64::NAN, |pair| {
        let [(a, low), (b, high)] = [pair[0], pair[1]];
        low + (high - low) * (angle - a) / (b - a)
    })
}

fn plot(models: &[(String, Model)], file: &Path) -> Result<()> {
    let style = |i: usize| Palette99::pick(i / 2).stroke_width(1 + i as u32 % 2);
    let lines = |named: bool, of: &dyn Fn(&Model) -> Vec<(f64, f64)>| -> Vec<Line> {
        let line = |(i, (name, model)): (usize, &(String, Model))| Line {
            name: if named && i % 2 == 0 { name.clone() } else { String::new() },
            points: of(model),
            style: style(i),
        };
        models.iter().enumerate().map(line).collect()
    };
    let logarithms = lines(false, &|model| {
        let line = model.correlation.iter().take_while(|p| p.1 > 0.05).map(|p| (p.0, p.1.ln()));
        std::iter::once((0.0, 0.0)).chain(line).collect()
    });
    let mut variances = lines(true, &|model| {
        let line = model.variance.iter().map(|p| (p.0 / model.angle, p.1 / 4.0));
        line.filter(|p| p.0 <= 2.0).collect()
    });
    let exact = (0..=40).map(|i| f64::from(i) / 20.0).map(|x| (x, in_the_model(x) / 4.0)).collect();
    let others =
        [("Eq. 6", vec![(0.0, 0.0), (0.75, 0.25)], BLACK), ("the model itself", exact, RGBColor(150, 150, 150))];
    variances.extend(others.map(|(name, points, colour)| Line {
        name: name.into(),
        points,
        style: colour.stroke_width(3),
    }));
    let chart = |title, x, ends, lines| Chart {
        title,
        x,
        ends,
        logarithmic: false,
        key: SeriesLabelPosition::LowerRight,
        lines,
    };
    let ends = [[0.0, f64::from(visibility::WIDEST)], [-3.0, 0.0]];
    let left = chart("log correlation of visibility", "angle in radians", ends, logarithms);
    let ends = [[0.0, 2.0], [0.0, 0.27]];
    plot::save(file, [left, chart("variance of visibility in a cone", "half-angle / T", ends, variances)])
}
