//! Plots of a cell: error against samples and against time, without shadows, and in each region and both metrics, as
//! one SVG.

use crate::measure::{Cell, Errors, REGIONS, Row};
use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::prelude::*;
use std::path::Path;

type Panel<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// A panel's axes: the title of the abscissa, its value for a row, and the metric.
struct Axes {
    title: &'static str,
    abscissa: fn(&Row) -> f64,
    metric: &'static str,
    error: fn(&Errors) -> f64,
}

const COLUMNS: [Axes; 4] = [
    Axes { title: "samples", abscissa: samples, metric: "absolute", error: |e| e.absolute },
    Axes { title: "microseconds", abscissa: microseconds, metric: "absolute", error: |e| e.absolute },
    Axes { title: "samples", abscissa: samples, metric: "relative", error: |e| e.relative },
    Axes { title: "microseconds", abscissa: microseconds, metric: "relative", error: |e| e.relative },
];

/// For all pixels together: without shadows, then with them.
const WHOLE: [Axes; 4] = [
    Axes { title: "samples", abscissa: samples, metric: "unshadowed", error: |e| e.unshadowed },
    Axes { title: "microseconds", abscissa: microseconds, metric: "unshadowed", error: |e| e.unshadowed },
    Axes { title: "samples", abscissa: samples, metric: "absolute", error: |e| e.absolute },
    Axes { title: "microseconds", abscissa: microseconds, metric: "absolute", error: |e| e.absolute },
];

fn samples(row: &Row) -> f64 {
    row.count as f64
}

fn microseconds(row: &Row) -> f64 {
    row.times[0][0].ns() / 1e3
}

/// Writes the plots of a cell.
///
/// # Errors
/// The file cannot be written.
pub fn write(cell: &Cell, file: &Path) -> Result<()> {
    let root = SVGBackend::new(file, (1680, 1482)).into_drawing_area();
    draw(cell, &root).and_then(|()| Ok(root.present()?)).map_err(|error| anyhow!("{}: {error}", file.display()))
}

fn draw(cell: &Cell, root: &Panel) -> Result<(), Box<dyn std::error::Error>> {
    root.fill(&WHITE)?;
    let title = format!("{}, {}, {}: root mean squared error", cell.scene, cell.light, cell.material);
    let root = root.titled(&title, ("sans-serif", 24))?;
    let names = methods(cell);
    let (key, grid) = root.split_vertically(12 + 22 * names.len().div_ceil(IN_A_ROW) as i32);
    draw_key(&key, &names)?;
    let panels = grid.split_evenly((REGIONS.len(), COLUMNS.len()));
    for (i, panel) in panels.iter().enumerate() {
        let (region, column) = (i / COLUMNS.len(), i % COLUMNS.len());
        let axes = if region == 0 { &WHOLE } else { &COLUMNS };
        draw_panel(cell, panel, region, &axes[column])?;
    }
    Ok(())
}

/// The methods of a cell, in the order of its rows.
fn methods(cell: &Cell) -> Vec<&str> {
    let mut names: Vec<&str> = cell.rows.iter().map(|row| row.method.as_str()).collect();
    names.dedup();
    names
}

/// Colours of peers that are told apart on white, also those next to one another in the key.
const COLOURS: [RGBColor; 9] = [
    RGBColor(230, 25, 75),
    RGBColor(60, 180, 75),
    RGBColor(0, 90, 200),
    RGBColor(90, 190, 250),
    RGBColor(245, 130, 48),
    RGBColor(145, 30, 180),
    RGBColor(240, 50, 230),
    RGBColor(128, 100, 0),
    RGBColor(0, 150, 150),
];

/// The library's methods are black and wide, each peer has a colour of its own.
fn style(index: usize, name: &str) -> ShapeStyle {
    match name {
        "wis" => BLACK.stroke_width(3),
        "wis + MIS" => RGBColor(130, 130, 130).stroke_width(3),
        "wis tree pool" => RGBColor(120, 60, 0).stroke_width(3),
        "wis biased" => RGBColor(170, 170, 170).stroke_width(2),
        "wis ratio" => RGBColor(210, 210, 210).stroke_width(2),
        "limit" | "limit, pooled" => RGBColor(255, 190, 0).stroke_width(2),
        _ => COLOURS[index % COLOURS.len()].stroke_width(1),
    }
}

/// Names in a row of the key.
const IN_A_ROW: usize = 9;

fn draw_key(area: &Panel, names: &[&str]) -> Result<(), Box<dyn std::error::Error>> {
    for (i, name) in names.iter().enumerate() {
        let (x, y) = (20 + 180 * (i % IN_A_ROW) as i32, 14 + 22 * (i / IN_A_ROW) as i32);
        area.draw(&PathElement::new([(x, y), (x + 24, y)], style(i, name)))?;
        area.draw(&Text::new(name.to_string(), (x + 30, y - 7), ("sans-serif", 15)))?;
    }
    Ok(())
}

fn draw_panel(cell: &Cell, panel: &Panel, region: usize, axes: &Axes) -> Result<(), Box<dyn std::error::Error>> {
    let point = |row: &Row| ((axes.abscissa)(row), row.median(|r| (axes.error)(&r.errors[region])).sqrt());
    // The limits have no time.
    let shown = |p: &(f64, f64)| p.0 > 0.0 && p.1 > 0.0;
    let points: Vec<(f64, f64)> = cell.rows.iter().map(point).filter(shown).collect();
    let pixels = cell.pixels[region];
    let caption = format!("{}, {}, {pixels} pixels", REGIONS[region], axes.metric);
    let panel = panel.titled(&caption, ("sans-serif", 16))?;
    if points.is_empty() {
        return Ok(());
    }
    let span = |of: fn(&(f64, f64)) -> f64| {
        let values = points.iter().map(of);
        values.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), v| (low.min(v), high.max(v)))
    };
    let ((left, right), (low, high)) = (span(|p| p.0), span(|p| p.1));
    let mut chart = ChartBuilder::on(&panel)
        .margin(6)
        .x_label_area_size(34)
        .y_label_area_size(52)
        .build_cartesian_2d((left * 0.9..right * 1.1).log_scale(), (low * 0.9..high * 1.1).log_scale())?;
    chart
        .configure_mesh()
        .x_desc(axes.title)
        .x_label_formatter(&|x| short(*x))
        .y_label_formatter(&|y| short(*y))
        .light_line_style(TRANSPARENT)
        .draw()?;
    for (i, name) in methods(cell).into_iter().enumerate() {
        let line: Vec<_> = cell.rows.iter().filter(|row| row.method == name).map(point).filter(shown).collect();
        let style = style(i, name);
        chart.draw_series(LineSeries::new(line.iter().copied(), style))?;
        chart.draw_series(line.iter().map(|&p| Circle::new(p, 3, style.color.filled())))?;
    }
    Ok(())
}

/// Three figures, without an exponent.
fn short(x: f64) -> String {
    let digits = (2 - x.abs().log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{x:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}
