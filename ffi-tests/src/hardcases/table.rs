//! The rows of the hard-case page, and the page itself.

use super::bounds::{Bounded, Figures, LARGEST};
use super::laws::Verdict;
use super::scenes::HUGE;
use crate::page::filled;
use std::fmt::Display;

/// What is filled in stands in braces.
const PAGE: &str = include_str!("page.md");

/// A case.
pub struct Row {
    /// What is put in.
    pub case: String,
    /// The documented answer.
    pub expected: String,
    /// The answer, or what is wrong with it.
    pub got: Verdict,
}

/// How far L / pdf is from constant.
#[derive(Clone, Copy, Debug)]
pub struct Accuracy {
    /// The relative standard deviation.
    pub deviation: f64,
    /// The largest over the mean.
    pub maximum: f64,
    /// The mean over the power, less 1.
    pub mean: f64,
}

/// A case of the light in tables.
pub struct Light {
    /// What is put in.
    pub case: String,
    /// Who looks it up.
    pub client: &'static str,
    /// The answer, or what is wrong with it.
    pub got: Verdict,
    /// How well the density fits the light.
    pub accuracy: Option<Accuracy>,
    /// What a common sampler does.
    pub common: String,
    /// The machine is too small for the case.
    pub skipped: bool,
}

/// All cases.
#[derive(Default)]
pub struct Table {
    /// Products and rays.
    pub bounded: Vec<Bounded>,
    /// The light in tables.
    pub lights: Vec<Light>,
    /// The others, in the order of the page.
    pub rows: Vec<Row>,
}

impl Table {
    /// Adds a case.
    pub fn add(&mut self, case: impl Into<String>, expected: impl Into<String>, got: Verdict) {
        self.rows.push(Row { case: case.into(), expected: expected.into(), got });
    }

    /// How many rows answer something else than documented.
    pub fn failures(&self) -> usize {
        let lights = self.lights.iter().filter(|light| !light.skipped && light.got.is_err()).count();
        let bounded = self.bounded.iter().filter(|row| row.got.is_err()).count();
        lights + bounded + self.rows.iter().filter(|row| row.got.is_err()).count()
    }

    fn cases(&self) -> usize {
        self.lights.len() + self.bounded.len() + self.rows.len()
    }

    /// The page with its conclusion: what the rows show, by their own numbers.
    fn concluded(&self) -> String {
        let (cases, failures) = (self.cases(), self.failures());
        let first = match failures {
            0 => format!("**All {cases} cases have the documented answer, within bounds.**"),
            _ => format!("**{failures} of {cases} cases fail.**"),
        };
        let found: Vec<(&str, &Figures)> =
            self.bounded.iter().filter_map(|row| Some((&*row.case, row.got.as_ref().ok()?))).collect();
        let rays = found.iter().filter_map(|(_, figures)| figures.rays).count();
        let most = |of: &dyn Fn(&Figures) -> f64| found.iter().map(|(_, figures)| of(figures)).fold(0.0, f64::max);
        let below = |x: f64| bound(x)[2..].to_string();
        let means = below(most(&|figures| figures.mean));
        let of_rays = below(most(&|figures| figures.rays.map_or(0.0, |[one, four, _]| one.max(four))));
        let deviations = self.lights.iter().filter_map(|light| Some(light.accuracy.as_ref()?.deviation));
        let deviation = below(deviations.fold(0.0, f64::max));
        let sound = found.iter().filter(|(_, figures)| figures.largest <= LARGEST);
        let largest = sound.map(|(_, figures)| figures.largest).fold(0.0, f64::max).ceil();
        let integrals = found.iter().filter_map(|(case, figures)| Some((figures.integral?[0], *case)));
        let (off, worst) = integrals
            .filter(|(_, case)| !case.contains("holes"))
            .fold((0.0, ""), |worst, this| if this.0 > worst.0 { this } else { worst });
        let beyond = found.iter().filter(|(_, figures)| figures.largest > LARGEST).count();
        let (scenes, off) = (found.len(), below(1.0 + off));
        let numbers: [(&str, &dyn Display); 10] = [
            ("first", &first),
            ("scenes", &scenes),
            ("means", &means),
            ("of_rays", &of_rays),
            ("rays", &rays),
            ("largest", &largest),
            ("beyond", &beyond),
            ("off", &off),
            ("worst", &worst),
            ("deviation", &deviation),
        ];
        numbers.iter().fold(PAGE.to_string(), filled)
    }

    /// The page as Markdown.
    pub fn page(&self) -> String {
        let parts: [(&str, &dyn Display); 5] = [
            ("bounded", &self.bounded.iter().map(Bounded::line).collect::<String>()),
            ("lights", &self.lights.iter().map(Light::line).collect::<String>()),
            ("rows", &self.rows.iter().map(Row::line).collect::<String>()),
            ("cases", &self.cases()),
            ("failures", &self.failures()),
        ];
        parts.iter().fold(self.concluded(), filled)
    }

    /// Whether a page is what would be written, but for the rows that were skipped here and what it was made from.
    pub fn matches(&self, page: &str) -> bool {
        let large = self.lights.iter().any(|light| light.skipped).then_some(HUGE);
        let skipped = |line: &str| large.is_some_and(|case| line.contains(case));
        let kept = |page: &str| page.lines().filter(|line| !skipped(line)).map(str::to_string).collect::<Vec<_>>();
        let (written, _made_from) = page.split_once("\nCommit ").unwrap_or((page, ""));
        kept(written) == kept(&self.page())
    }
}

/// The answer, or what is wrong with it.
fn shown(got: &Verdict) -> String {
    got.clone().unwrap_or_else(|fault| format!("**FAIL** {fault}"))
}

/// The next number above with two digits.
fn bound(x: f64) -> String {
    let scale = 10f64.powi(1 - x.max(1e-6).log10().floor() as i32);
    let rounded = (x * scale).ceil() / scale;
    format!("< {}", (rounded * 1e8).round() / 1e8)
}

impl Light {
    /// A row without accuracy and the common sampler.
    pub fn new(case: impl Into<String>, client: &'static str, got: Verdict) -> Light {
        Light { case: case.into(), client, got, accuracy: None, common: "-".into(), skipped: false }
    }

    fn line(&self) -> String {
        let Light { case, client, got, accuracy, common, .. } = self;
        let got = shown(got);
        let columns = accuracy.map_or("- | - | -".into(), |a| {
            format!("{} | < {:.2} | {}", bound(a.deviation), (a.maximum * 100.0).ceil() / 100.0, bound(a.mean))
        });
        format!("| {case} | {client} | {got} | {columns} | {common} |\n")
    }
}

impl Bounded {
    fn line(&self) -> String {
        let Bounded { case, got, .. } = self;
        let f = match got {
            Ok(figures) => figures,
            Err(fault) => return format!("| {case} | **FAIL** {fault} | - | - | - | - | - | - |\n"),
        };
        let share = |share: f64| format!("{:.1} %", 100.0 * share);
        let integral = f.integral.map_or("-".into(), |[off, limit]| format!("{} of {limit}", bound(off)));
        // What the last digits of a platform's sines may change is not shown.
        let mean = |mean: f64| bound(mean.max(1e-4));
        let rays = f.rays.map_or("- | - | -".into(), |[one, four, idle]| {
            format!("{} | {} | {}", mean(one), mean(four), share(idle))
        });
        let samples = f.integral.map_or("- | - | -".into(), |_| {
            format!("< {:.1} | {} | {}", (f.largest * 10.0).ceil() / 10.0, mean(f.mean), share(f.empty))
        });
        format!("| {case} | {integral} | {samples} | {rays} |\n")
    }
}

impl Row {
    fn line(&self) -> String {
        format!("| {} | {} | {} |\n", self.case, self.expected, shown(&self.got))
    }
}
