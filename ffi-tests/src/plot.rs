//! Charts of lines, two side by side, as SVG: the plots of the papers' pages.

use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::coord::ranged1d::ValueFormatter;
use plotters::prelude::*;
use std::path::Path;

/// A line; without a name it is not in the key.
pub struct Line {
    pub name: String,
    pub points: Vec<(f64, f64)>,
    pub style: ShapeStyle,
}

/// A chart.
pub struct Chart<'a> {
    pub title: &'a str,
    /// What the horizontal axis is.
    pub x: &'a str,
    /// The ends of the axes, horizontal and vertical.
    pub ends: [[f64; 2]; 2],
    /// Both axes.
    pub logarithmic: bool,
    pub key: SeriesLabelPosition,
    pub lines: Vec<Line>,
}

type Drawn = std::result::Result<(), Box<dyn std::error::Error>>;
type Axes<'a, X, Y> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<X, Y>>;

/// Writes two charts.
///
/// # Errors
/// The file cannot be written.
pub fn save(file: &Path, charts: [Chart; 2]) -> Result<()> {
    let draw = || -> Drawn {
        let root = SVGBackend::new(file, (1120, 450)).into_drawing_area();
        root.fill(&WHITE)?;
        let (left, right) = root.split_horizontally(560);
        [left, right].iter().zip(&charts).try_for_each(|(area, chart)| chart.draw(area))?;
        Ok(root.present()?)
    };
    draw().map_err(|error| anyhow!("{}: {error}", file.display()))
}

impl Chart<'_> {
    fn draw(&self, area: &DrawingArea<SVGBackend, Shift>) -> Drawn {
        let mut on = ChartBuilder::on(area);
        on.margin(8).caption(self.title, ("sans-serif", 18)).x_label_area_size(36).y_label_area_size(60);
        let [x, y] = self.ends.map(|[low, high]| low..high);
        if self.logarithmic {
            self.fill(on.build_cartesian_2d(x.log_scale(), y.log_scale())?)
        } else {
            self.fill(on.build_cartesian_2d(x, y)?)
        }
    }

    fn fill<X, Y>(&self, mut chart: Axes<X, Y>) -> Drawn
    where
        X: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        chart.configure_mesh().x_desc(self.x).light_line_style(TRANSPARENT).draw()?;
        for Line { name, points, style } in &self.lines {
            let (drawn, style) = (chart.draw_series(LineSeries::new(points.iter().copied(), *style))?, *style);
            if !name.is_empty() {
                drawn.label(name).legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], style));
            }
        }
        if self.lines.iter().any(|line| !line.name.is_empty()) {
            let mut key = chart.configure_series_labels();
            key.border_style(BLACK).background_style(WHITE).position(self.key.clone()).draw()?;
        }
        Ok(())
    }
}
