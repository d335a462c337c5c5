//! The plots of the page, as SVG: error against time, gains by lobe and samples, distance to the limit.

use super::gains::{self, Against, METRICS, Scale};
use super::losses::most_often;
use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use wis_ffi_tests::measure::{Cell, Row};
use wis_ffi_tests::method::EXTENDED;
use wis_ffi_tests::page::times;
use wis_ffi_tests::paper::range;
use wis_ffi_tests::peers::Peer;
use wis_ffi_tests::statistics::geometric;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = std::result::Result<(), Box<dyn std::error::Error>>;

/// A line's points and how it is drawn.
struct Line {
    points: Vec<(f64, f64)>,
    style: ShapeStyle,
}

/// Methods that plots show, with their colours: the library's are wide.
const METHODS: [(&str, RGBColor, u32); 4] = [
    ("direct", RGBColor(0, 60, 170), 4),
    ("product", RGBColor(0, 150, 200), 3),
    ("MIS balance", RGBColor(220, 120, 0), 2),
    ("MIS compensated", RGBColor(190, 20, 40), 2),
];
/// Colours of the peers that are best most often.
const BEST: [RGBColor; 2] = [RGBColor(60, 150, 60), RGBColor(140, 60, 160)];
/// The lower left border of all peers.
const BORDER: &str = "best of all baselines";

/// Sizes of letters, for which SVG is told 1.24 times less: at least 14 pixels.
const SMALL: u32 = 18;
const LARGE: u32 = 20;

fn style(name: &str) -> ShapeStyle {
    let found = METHODS.iter().find(|method| method.0 == name);
    found.map_or(BLACK.stroke_width(2), |(_, colour, width)| colour.stroke_width(*width))
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

/// Names of lines, four in a row.
fn key(area: &Area, lines: &[(String, ShapeStyle)]) -> Drawn {
    for (i, (name, style)) in lines.iter().enumerate() {
        let (x, y) = (20 + 275 * (i % 4) as i32, 16 + 26 * (i / 4) as i32);
        area.draw(&PathElement::new([(x, y), (x + 30, y)], *style))?;
        area.draw(&Text::new(name.clone(), (x + 38, y - 9), ("sans-serif", SMALL)))?;
    }
    Ok(())
}

/// Lines on axes that are both logarithmic.
fn lines(area: &Area, title: &str, [x, y]: [&str; 2], lines: &[Line]) -> Drawn {
    let area = area.titled(title, ("sans-serif", LARGE))?;
    let all = || lines.iter().flat_map(|line| &line.points);
    let ([left, right], [low, high]) = (range(all().map(|p| p.0)), range(all().map(|p| p.1)));
    if all().next().is_none() {
        return Ok(());
    }
    let mut chart = ChartBuilder::on(&area).margin(6).x_label_area_size(48).y_label_area_size(72).build_cartesian_2d(
        (left * 0.9..right * 1.1).log_scale().with_key_points(ticks(left * 0.9, right * 1.1)),
        (low * 0.9..high * 1.1).log_scale().with_key_points(ticks(low * 0.9, high * 1.1)),
    )?;
    chart
        .configure_mesh()
        .x_desc(x)
        .y_desc(y)
        .x_label_formatter(&|x| short(*x))
        .y_label_formatter(&|y| short(*y))
        .label_style(("sans-serif", SMALL))
        .light_line_style(TRANSPARENT)
        .draw()?;
    // The library's lines last, so that they lie above.
    for line in lines.iter().rev() {
        chart.draw_series(LineSeries::new(line.points.iter().copied(), line.style))?;
        chart.draw_series(line.points.iter().map(|&p| Circle::new(p, 3, line.style.color.filled())))?;
    }
    Ok(())
}

/// 1, 2 and 5 times powers of ten, or the powers alone where there are many.
fn ticks(low: f64, high: f64) -> Vec<f64> {
    let steps: &[f64] = if high / low > 100.0 { &[1.0] } else { &[1.0, 2.0, 5.0] };
    let all = (-6..8).flat_map(|power| steps.iter().map(move |k| k * 10f64.powi(power)));
    all.filter(|tick| (low..high).contains(tick)).collect()
}

/// Peers by how often they are the best of a cell, among the cells and numbers of samples of a plot; those of `METHODS` are left out.
fn best_peers(cells: &[&Cell], scale: Scale) -> Vec<Peer> {
    let of = |cell: &Cell| {
        gains::counts(cell).into_iter().filter_map(|n| gains::best(cell, &EXTENDED, n, scale)).collect::<Vec<_>>()
    };
    let names: Vec<String> = cells.iter().flat_map(|cell| of(cell)).collect();
    let mut peers = most_often(names.iter().map(String::as_str));
    peers.retain(|peer| METHODS.iter().all(|method| method.0 != peer.name()));
    peers
}

/// Points with less error than every faster one.
fn border(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut least = f64::INFINITY;
    points.retain(|point| {
        let kept = point.1 < least;
        least = least.min(point.1);
        kept
    });
    points
}

/// Error against time in a grid: lights from the left, materials downwards.
///
/// # Errors
/// Those of drawing.
pub fn error_against_time(cells: &[&Cell], scale: Scale, lights: &[&str], materials: &[&str]) -> Result<String> {
    let point = |row: &Row| {
        let ns = row.times[scale.caches][scale.model].ns();
        (ns / 1e3, row.mean(|repeat| METRICS[scale.metric].1(&repeat.errors[0])).sqrt())
    };
    let is_drawn = |cell: &&&Cell| lights.contains(&cell.light.as_str()) && materials.contains(&cell.material.as_str());
    let shown: Vec<&Cell> = cells.iter().filter(is_drawn).copied().collect();
    let named = METHODS.iter().map(|method| (method.0.to_string(), style(method.0)));
    let best =
        best_peers(&shown, scale).into_iter().zip(BEST).map(|(peer, colour)| (peer.name(), colour.stroke_width(2)));
    let methods: Vec<(String, ShapeStyle)> = named.chain(best).collect();
    let all_peers = (BORDER.to_string(), style(BORDER));
    let height = 68 + 310 * materials.len() as u32;
    svg((1120, height), |root| {
        let (legend, grid) = root.split_vertically(64);
        key(&legend, &[&methods[..], std::slice::from_ref(&all_peers)].concat())?;
        for (i, area) in grid.split_evenly((materials.len(), lights.len())).iter().enumerate() {
            let (light, material) = (lights[i % lights.len()], materials[i / lights.len()]);
            let Some(cell) = shown.iter().find(|cell| cell.light == light && cell.material == material) else {
                continue;
            };
            let points = |kept: &dyn Fn(&str) -> bool| -> Vec<(f64, f64)> {
                let rows = cell.rows.iter().filter(|row| kept(&row.method));
                rows.map(point).filter(|p| p.0 > 0.0 && p.1 > 0.0).collect()
            };
            let line =
                |(name, style): &(String, ShapeStyle)| Line { points: points(&|method| method == name), style: *style };
            let peers = points(&|method| EXTENDED.each.iter().any(|peer| peer.name() == method));
            let mut all: Vec<Line> = methods.iter().map(line).collect();
            all.push(Line { points: border(peers), style: all_peers.1 });
            let title = format!("{material}, {light}");
            lines(area, &title, ["us per hit", &format!("{} error", METRICS[scale.metric].0)], &all)?;
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
    let (side, left, rows) = (47, 80, materials.len() as i32);
    let height = 84 + rows * side;
    svg((1120, (height * against.len() as i32) as u32), |root| {
        for (panel, against) in root.split_evenly((against.len(), 1)).iter().zip(against) {
            for (i, area) in panel.split_evenly((1, scales.len())).iter().enumerate() {
                area.draw(&Text::new(format!("over {}", against.name()), (4, 4), ("sans-serif", SMALL)))?;
                area.draw(&Text::new(scales[i].name(), (4, 24), ("sans-serif", SMALL)))?;
                let centred = TextStyle::from(("sans-serif", SMALL)).pos(Pos::new(HPos::Center, VPos::Center));
                for (x, count) in counts.iter().enumerate() {
                    let at = (left + side * x as i32 + side / 2, 58);
                    area.draw(&Text::new(format!("N={count}"), at, centred.clone()))?;
                }
                for (y, material) in materials.iter().enumerate() {
                    let top = 70 + side * y as i32;
                    area.draw(&Text::new(material.clone(), (4, top + side / 2 - 9), ("sans-serif", SMALL)))?;
                    for (x, &count) in counts.iter().enumerate() {
                        let of = cells.iter().copied().filter(|cell| cell.material == *material);
                        let gain = against.mean(of, ours, count, scales[i]);
                        let left = left + side * x as i32;
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
    const SHOWN: [&str; 3] = ["direct", "product", "MIS compensated"];
    let Some(first) = cells.first() else { return svg((10, 10), |_| Ok(())) };
    let counts = gains::counts(first);
    svg((1120, 360), |root| {
        let (legend, grid) = root.split_vertically(34);
        key(&legend, &SHOWN.map(|name| (name.to_string(), style(name))))?;
        for (area, material) in grid.split_evenly((1, materials.len())).iter().zip(materials) {
            let line = |name: &'static str| {
                let point = |&count: &usize| {
                    let of = cells.iter().filter(|cell| cell.material == *material);
                    let ratio = of.filter_map(|c| Some(gains::variance(c, name, count, 0)? / gains::limit(c, count)?));
                    (count as f64, geometric(ratio))
                };
                let points = counts.iter().map(point).filter(|p| p.1.is_finite()).collect();
                Line { points, style: style(name) }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_border_has_what_nothing_faster_beats() {
        let points = vec![(3.0, 2.0), (1.0, 4.0), (2.0, 5.0), (4.0, 1.0), (5.0, 1.5)];
        assert_eq!(border(points), [(1.0, 4.0), (3.0, 2.0), (4.0, 1.0)]);
    }

    #[test]
    fn ticks_are_few() {
        assert_eq!(ticks(0.9, 6.0), [1.0, 2.0, 5.0]);
        assert_eq!(ticks(0.9, 600.0), [1.0, 10.0, 100.0]);
    }
}
