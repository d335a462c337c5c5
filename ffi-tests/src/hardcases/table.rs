//! The rows of the hard-case page, and the page itself.

use super::bounds::{Bounded, Figures, LARGEST};
use super::laws::Verdict;
use super::peers::Answers;
use super::scenes::HUGE;
use std::fmt::Write;

const PREAMBLE: &str = "Written by `make hardcases` and checked by `make test`, through the C interface of the release library. A row fails if
the answer is not the documented one, or a figure is out of bounds.

A sample is *legal* if its direction has unit length and its pdf is finite and above 0. `pdf(wi)` and batches have to give
the same bits, and `invert` a u in [0, 1). Each row takes 1193 values of u. Among them are 0, 2^-149, 1 - 2^-24, 1, NaN and
values outside [0, 1).

";

const BOUNDED: &str = "## Products and rays

References are integrals by quadrature, of the client's own BRDFs and look-ups in double precision. They are right to 0.001.

- *integral*: how far apart the integral that a product states and the reference are: the larger over the smaller, less 1. An
  integral of 0 is beyond any limit. It is an approximation, so the limit is the figure when the row was written, and a quarter more.
- *largest*: the largest f L cos / (p I), over 262144 samples and 18000 other directions. Those are directions of the light, at all
  distances of the lobe's peak, and all over the sphere. The limit is 50 (rule 33 of [design.md](../design.md)), and
  150 and 300 in two rows beyond the critical angle. *Not bounded*: no rule speaks of these tables and lobes, and single weights are
  large. There the share of the integral that comes with weights above 50 has a limit. A density of a hundredth in places exceeds it.
- *mean*: how far the mean of the samples is from the reference. The limit is 4.5 standard errors and 0.001, and a fault of 2 % is seen.
- *empty*: samples that bring nothing, as a share.
- *1 ray*, *4 rays*: the same means for calls of `wis_direct`. *Idle*: their rays that bring nothing. The limit is 6 %, because floors of 5 %
  serve clients whose BRDF is another (rules 16 and 24). It is higher where a client's table has holes that its lobes do not
  know, and beyond the critical angle.

Samples also fall where the density says: a chi-square test over parts of the sphere with at most a 64th of them each, p > 1e-6.
`cargo test -p wis-ffi-tests` injects faults: densities or weights that are 2.5 % larger, one of 20 samples elsewhere, a density of
a hundredth in places, a wrong integral, stray rays. Each turns a row red.

";

const LIGHTS: &str = "
## The light in tables

`wis_environment`, for a client that interpolates between texel centres and for one that takes the nearest texel. Samples are
legal, and the pdf is above 0 at every corner, edge and half-texel shift of lit texels. Three columns are upper bounds on
w = L / pdf over 32768 samples. A row beyond one of these limits fails:

- *deviation*: the relative standard deviation of w, at most 0.01;
- *maximum*: the largest w over its mean, at most 1.05;
- *mean*: how far the mean of w is from the power of the environment, at most 0.001 of it.

L is the client's look-up in double precision, of texels no darker than 2^-16 of the mean. Where black stays black, only samples
with L > 0 count. Black texels beside lit ones have a pdf, too, because the client's rounding may need it.

The last two columns show two common samplers of the light on the same map, with their published formulas in 32-bit floats:

- rows and columns by cumulative sums (pbrt-v3);
- a hierarchical warp with bilinear patches (Clarberg et al. 2005; Mitsuba 3).

They are our own short versions (`ffi-tests/src/hardcases/peers.rs`), not those programs. A dash: not run.

- *Unreachable*: lit texels or patches with a positive pdf to which no u leads.
- *Blind*: lit, with pdf 0.
- *Off*: samples whose pdf differs from that of their direction by more than a thousandth. Most lie on the border of a texel.
- *pdf 0*: no sample though there is light.

";

const CALLS: &str = "
## Calls

";

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
    /// What the peers' formulas answer.
    pub peers: Answers,
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

    /// What the rows show, by their own numbers.
    fn conclusion(&self) -> String {
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
        format!(
            "{first} In {} scenes of narrow, grazing or transmitting lobes, suns and
tables with holes:

- means of samples are within {means} of the reference, means of rays within {of_rays} in {rays} of them;
- weights of products of `wis.h` are at most {largest} integrals, but more than {LARGEST} in {beyond} scenes beyond the critical angle.
  Rule 33 of [design.md](../design.md) is not met there;
- the integral that a product states is an approximation. For lobes that the library knows, it is off by a factor of up to {}:
  {worst}.

Radiance over density varies by less than {deviation} on every lit map.

",
            found.len(),
            below(1.0 + off),
        )
    }

    /// The page as Markdown.
    pub fn page(&self) -> String {
        let mut page = format!("# Hard cases\n\n{}{PREAMBLE}{BOUNDED}", self.conclusion());
        page.push_str("| case | integral | largest | mean | empty | 1 ray | 4 rays | idle |\n");
        page.push_str("| --- | --- | --- | --- | --- | --- | --- | --- |\n");
        self.bounded.iter().for_each(|row| page.push_str(&row.line()));
        page.push_str(LIGHTS);
        page.push_str("| case | client | got | deviation | maximum | mean | cumulative sums | hierarchical warp |\n");
        page.push_str("| --- | --- | --- | --- | --- | --- | --- | --- |\n");
        for light in &self.lights {
            page.push_str(&light.line());
        }
        page.push_str(CALLS);
        page.push_str("| case | expected | got |\n| --- | --- | --- |\n");
        for row in &self.rows {
            page.push_str(&row.line());
        }
        let _ = writeln!(page, "\n{} cases, {} failures.", self.cases(), self.failures());
        page
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
    /// A row without accuracy and peers.
    pub fn new(case: impl Into<String>, client: &'static str, got: Verdict) -> Light {
        Light { case: case.into(), client, got, accuracy: None, peers: Answers::default(), skipped: false }
    }

    fn line(&self) -> String {
        let Light { case, client, got, accuracy, peers: Answers { sums, warp }, .. } = self;
        let got = shown(got);
        let columns = accuracy.map_or("- | - | -".into(), |a| {
            format!("{} | < {:.2} | {}", bound(a.deviation), (a.maximum * 100.0).ceil() / 100.0, bound(a.mean))
        });
        format!("| {case} | {client} | {got} | {columns} | {sums} | {warp} |\n")
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
