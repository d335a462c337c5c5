//! The plots of the page, as SVG: error against time, gains by lobe and samples, distance to the limit.

use crate::gains::{self, Against, METRICS, Scale, geometric_mean};
use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use wis_ffi_tests::measure::{Cell, Row};
use wis_ffi_tests::page::times;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = std::result::Result<(), Box<dyn std::error::Error>>;

/// A line by its name, and its points.
struct Line<'a> {
    name: &'a str,
    points: Vec<(f64, f64)>,
}

/// Methods that plots show, with their colours: the library's are wide.
const METHODS: [(&str, RGBColor, u32); 7] = [
    ("direct", RGBColor(0, 60, 170), 4),
    ("product", RGBColor(0, 150, 200), 3),
    ("wavelet product", RGBColor(175, 175, 175), 2),
    ("MIS balance", RGBColor(220, 120, 0), 2),
    ("MIS compensated", RGBColor(190, 20, 40), 2),
    ("RIS8", RGBColor(60, 150, 60), 2),
    ("P(4) comp.", RGBColor(140, 60, 160), 2),
];

fn style(name: &str) -> ShapeStyle {
    let found = METHODS.iter().find(|method| method.0 == name);
    found.map_or(BLACK.stroke_width(1), |(_, colour, width)| colour.stroke_width(*width))
}

fn svg(size: (u32, u32), draw: impl FnOnce(&Area) -> Drawn) -> Result<String> {
    let mut out = String::new();
    {
        let root = SVGBackend::with_string(&mut out, size).into_drawing_area();
        let drawn = root.fill(&WHITE).map_err(Into::into).and_then(|()| draw(&root));
        drawn.and_then(|()| Ok(root.present()?)).map_err(|error| anyhow!("a plot: {error}"))?;
    }
    Ok(out)
}

fn key(area: &Area, names: &[&str]) -> Drawn {
    for (i, name) in names.iter().enumerate() {
        let (x, y) = (20 + 175 * (i % 6) as i32, 14 + 22 * (i / 6) as i32);
        area.draw(&PathElement::new([(x, y), (x + 26, y)], style(name)))?;
        area.draw(&Text::new(name.to_string(), (x + 32, y - 8), ("sans-serif", 15)))?;
    }
    Ok(())
}

/// Lines on axes that are both logarithmic.
fn lines(area: &Area, title: &str, [x, y]: [&str; 2], lines: &[Line]) -> Drawn {
    let area = area.titled(title, ("sans-serif", 16))?;
    let all = || lines.iter().flat_map(|line| &line.points);
    let span = |of: fn(&(f64, f64)) -> f64| {
        all().map(of).fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), v| (low.min(v), high.max(v)))
    };
    let ((left, right), (low, high)) = (span(|p| p.0), span(|p| p.1));
    if all().next().is_none() {
        return Ok(());
    }
    let mut chart = ChartBuilder::on(&area).margin(6).x_label_area_size(36).y_label_area_size(54).build_cartesian_2d(
        (left * 0.9..right * 1.1).log_scale().with_key_points(ticks(left * 0.9, right * 1.1)),
        (low * 0.9..high * 1.1).log_scale().with_key_points(ticks(low * 0.9, high * 1.1)),
    )?;
    chart
        .configure_mesh()
        .x_desc(x)
        .y_desc(y)
        .x_label_formatter(&|x| short(*x))
        .y_label_formatter(&|y| short(*y))
        .light_line_style(TRANSPARENT)
        .draw()?;
    // The library's lines last, so that they lie above.
    for line in lines.iter().rev() {
        let style = style(line.name);
        chart.draw_series(LineSeries::new(line.points.iter().copied(), style))?;
        chart.draw_series(line.points.iter().map(|&p| Circle::new(p, 3, style.color.filled())))?;
    }
    Ok(())
}

/// 1, 2 and 5 times powers of ten.
fn ticks(low: f64, high: f64) -> Vec<f64> {
    let all = (-6..8).flat_map(|power| [1.0, 2.0, 5.0].map(|k| k * 10f64.powi(power)));
    all.filter(|tick| (low..high).contains(tick)).collect()
}

/// Error against time in a grid: lights from the left, materials downwards.
///
/// # Errors
/// Those of drawing.
pub fn error_against_time(cells: &[&Cell], scale: Scale, lights: &[&str], materials: &[&str]) -> Result<String> {
    let point = |row: &Row| {
        let ns = row.times[usize::from(scale.warm)][scale.model].ns();
        (ns / 1e3, row.median(|repeat| METRICS[scale.metric].1(&repeat.errors[0])).sqrt())
    };
    let height = 40 + 22 + 290 * materials.len() as u32;
    svg((1120, height), |root| {
        let (legend, grid) = root.split_vertically(52);
        key(&legend, &METHODS.map(|method| method.0))?;
        for (i, area) in grid.split_evenly((materials.len(), lights.len())).iter().enumerate() {
            let (light, material) = (lights[i % lights.len()], materials[i / lights.len()]);
            let Some(cell) = cells.iter().find(|cell| cell.light == light && cell.material == material) else {
                continue;
            };
            let line = |name: &'static str| {
                let rows = cell.rows.iter().filter(|row| row.method == name);
                Line { name, points: rows.map(point).filter(|p| p.0 > 0.0 && p.1 > 0.0).collect() }
            };
            let all: Vec<Line> = METHODS.iter().map(|method| line(method.0)).collect();
            lines(
                area,
                &format!("{material}, {light}"),
                ["us per hit", &format!("{} error", METRICS[scale.metric].0)],
                &all,
            )?;
        }
        Ok(())
    })
}

/// Gains as a heat map: lobes downwards, numbers of samples from the left; a panel for each metric and cost model.
///
/// # Errors
/// Those of drawing.
pub fn heat(cells: &[&Cell], ours: &str, against: &[Against], materials: &[String]) -> Result<String> {
    let Some(first) = cells.first() else { return svg((10, 10), |_| Ok(())) };
    let (counts, scales) = (gains::counts(first), Scale::all().collect::<Vec<_>>());
    let (side, rows) = (44, materials.len() as i32);
    let height = 62 + rows * side;
    svg((1120, (height * against.len() as i32) as u32), |root| {
        for (panel, against) in root.split_evenly((against.len(), 1)).iter().zip(against) {
            for (i, area) in panel.split_evenly((1, scales.len())).iter().enumerate() {
                let title = format!("over {}: {}", against.name(), scales[i].name());
                area.draw(&Text::new(title, (4, 4), ("sans-serif", 14)))?;
                let centred = TextStyle::from(("sans-serif", 14)).pos(Pos::new(HPos::Center, VPos::Center));
                for (x, count) in counts.iter().enumerate() {
                    let at = (72 + side * x as i32 + side / 2, 36);
                    area.draw(&Text::new(format!("N={count}"), at, centred.clone()))?;
                }
                for (y, material) in materials.iter().enumerate() {
                    let top = 48 + side * y as i32;
                    area.draw(&Text::new(material.clone(), (4, top + side / 2 - 8), ("sans-serif", 14)))?;
                    for (x, &count) in counts.iter().enumerate() {
                        let of = cells.iter().copied().filter(|cell| cell.material == *material);
                        let gain = against.mean(of, ours, count, scales[i]);
                        let left = 72 + side * x as i32;
                        let corners = [(left, top), (left + side - 2, top + side - 2)];
                        area.draw(&Rectangle::new(corners, heat_colour(gain).filled()))?;
                        let text = times(gain).trim_end_matches('x').to_string();
                        area.draw(&Text::new(text, (left + side / 2 - 1, top + side / 2 - 1), centred.clone()))?;
                    }
                }
            }
        }
        Ok(())
    })
}

/// White at 1, blue where the library is ahead, red where it is behind; full at eight times.
fn heat_colour(gain: f64) -> RGBColor {
    if !gain.is_finite() {
        return RGBColor(230, 230, 230);
    }
    let strength = (gain.log2().abs() / 3.0).min(1.0) * 0.75;
    let full = if gain >= 1.0 { [40.0, 110.0, 210.0] } else { [215.0, 60.0, 40.0] };
    let [r, g, b] = full.map(|c: f64| (255.0 + (c - 255.0) * strength) as u8);
    RGBColor(r, g, b)
}

/// Variance over that of the limit against the number of samples: a panel for each lobe.
///
/// # Errors
/// Those of drawing.
pub fn distance(cells: &[&Cell], materials: &[String]) -> Result<String> {
    const SHOWN: [&str; 4] = ["direct", "product", "wavelet product", "MIS compensated"];
    let Some(first) = cells.first() else { return svg((10, 10), |_| Ok(())) };
    let counts = gains::counts(first);
    svg((1120, 340), |root| {
        let (legend, grid) = root.split_vertically(34);
        key(&legend, &SHOWN)?;
        for (area, material) in grid.split_evenly((1, materials.len())).iter().zip(materials) {
            let line = |name: &'static str| {
                let point = |&count: &usize| {
                    let of = cells.iter().filter(|cell| cell.material == *material);
                    let ratio = of.filter_map(|c| Some(gains::variance(c, name, count, 0)? / gains::limit(c, count)?));
                    (count as f64, geometric_mean(ratio))
                };
                Line { name, points: counts.iter().map(point).filter(|p| p.1.is_finite()).collect() }
            };
            lines(area, material, ["samples", "variance / limit"], &SHOWN.map(line))?;
        }
        Ok(())
    })
}

/// Three figures, without an exponent.
fn short(x: f64) -> String {
    let digits = (2 - x.abs().log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{x:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}
