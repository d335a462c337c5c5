//! The rows of the hard-case page, and the page itself.

use super::laws::Verdict;
use super::peers::Answers;
use std::fmt::Write;

const PREAMBLE: &str = "# Hard cases

Written by `make hardcases` and checked by `make test`, through the C interface of the release library. A row fails if
the answer is not the documented one.

A sample is *legal* if its direction has unit length and its pdf is finite and above 0. `pdf(wi)` and batches have to give
the same bits, and `invert` a u in [0, 1). Each row takes 1193 values of u. Among them are 0, 2^-149, 1 - 2^-24, 1, NaN and
values outside [0, 1).

The last two columns show two common samplers of the light on the same map, with their published formulas in 32-bit floats:

- rows and columns by cumulative sums (pbrt-v3);
- a hierarchical warp with bilinear patches (Clarberg et al. 2005; Mitsuba 3).

They are our own short versions (`ffi-tests/src/hardcases/peers.rs`), not those programs. A dash: not run.

- *Unreachable*: lit texels or patches with a positive pdf to which no u leads.
- *Blind*: lit, with pdf 0.
- *Off*: samples whose pdf differs from that of their direction by more than a thousandth. Most lie on the border of a texel.
- *pdf 0*: no sample though there is light.

";

const LIGHTS: &str = "## The light in tables

`wis_environment`, for a client that interpolates between texel centres and for one that takes the nearest texel. Samples are
legal, and the pdf is above 0 at every corner, edge and half-texel shift of lit texels. Three columns are upper bounds on
w = L / pdf over 32768 samples. A row beyond one of these limits fails:

- *deviation*: the relative standard deviation of w, at most 0.01;
- *maximum*: the largest w over its mean, at most 1.05;
- *mean*: how far the mean of w is from the power of the environment, at most 0.001 of it.

L is the client's look-up in double precision, of texels no darker than 2^-16 of the mean. Where black stays black, only samples
with L > 0 count. Black texels beside lit ones have a pdf, too, because the client's rounding may need it.

";

const WAVELETS: &str = "
## Light in a pyramid, products and calls

The first rows are `wis_wavelet_environment` with its products, on the same kinds of maps.

";

/// A case.
pub struct Row {
    /// What is put in.
    pub case: String,
    /// The documented answer.
    pub expected: String,
    /// The answer, or what is wrong with it.
    pub got: Verdict,
    /// What the peers' formulas answer.
    pub peers: Answers,
    /// The machine is too small for the case.
    pub skipped: bool,
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
}

/// All cases.
#[derive(Default)]
pub struct Table {
    /// The light in tables.
    pub lights: Vec<Light>,
    /// The others, in the order of the page.
    pub rows: Vec<Row>,
}

impl Table {
    /// Adds a case that has no peer.
    pub fn add(&mut self, case: impl Into<String>, expected: impl Into<String>, got: Verdict) {
        self.add_beside(case, expected, got, Answers::default());
    }

    /// Adds a case with what the peers answer.
    pub fn add_beside(&mut self, case: impl Into<String>, expected: impl Into<String>, got: Verdict, peers: Answers) {
        self.rows.push(Row { case: case.into(), expected: expected.into(), got, peers, skipped: false });
    }

    /// Notes a case that this machine is too small for.
    pub fn skip(&mut self, case: impl Into<String>, expected: impl Into<String>) {
        let (case, expected) = (case.into(), expected.into());
        let got = Ok("not run: too little memory".to_string());
        self.rows.push(Row { case, expected, got, peers: Answers::default(), skipped: true });
    }

    /// How many rows answer something else than documented.
    pub fn failures(&self) -> usize {
        let lights = self.lights.iter().map(|light| &light.got);
        self.rows.iter().map(|row| &row.got).chain(lights).filter(|got| got.is_err()).count()
    }

    /// The page as Markdown.
    pub fn page(&self) -> String {
        let mut page = String::from(PREAMBLE);
        page.push_str(LIGHTS);
        page.push_str("| case | client | got | deviation | maximum | mean | cumulative sums | hierarchical warp |\n");
        page.push_str("| --- | --- | --- | --- | --- | --- | --- | --- |\n");
        for light in &self.lights {
            page.push_str(&light.line());
        }
        page.push_str(WAVELETS);
        page.push_str(
            "| case | expected | got | cumulative sums | hierarchical warp |\n| --- | --- | --- | --- | --- |\n",
        );
        for row in &self.rows {
            page.push_str(&row.line());
        }
        let cases = self.lights.len() + self.rows.len();
        let _ = writeln!(page, "\n{cases} cases, {} failures.", self.failures());
        page
    }

    /// Whether a page is what would be written, but for the rows that were skipped here.
    pub fn matches(&self, page: &str) -> bool {
        let skipped = |line: &str| self.rows.iter().any(|row| row.skipped && line.starts_with(&row.start()));
        let kept = |page: &str| page.lines().filter(|line| !skipped(line)).map(str::to_string).collect::<Vec<_>>();
        kept(page) == kept(&self.page())
    }
}

/// The next number above with two digits.
fn bound(x: f64) -> String {
    let scale = 10f64.powi(1 - x.max(1e-6).log10().floor() as i32);
    let rounded = (x * scale).ceil() / scale;
    format!("< {}", (rounded * 1e8).round() / 1e8)
}

impl Light {
    fn line(&self) -> String {
        let Light { case, client, got, accuracy, peers: Answers { sums, warp } } = self;
        let got = match got {
            Ok(got) => got.clone(),
            Err(fault) => format!("**FAIL** {fault}"),
        };
        let columns = accuracy.map_or("- | - | -".into(), |a| {
            format!("{} | < {:.2} | {}", bound(a.deviation), (a.maximum * 100.0).ceil() / 100.0, bound(a.mean))
        });
        format!("| {case} | {client} | {got} | {columns} | {sums} | {warp} |\n")
    }
}

impl Row {
    fn start(&self) -> String {
        format!("| {} |", self.case)
    }

    fn line(&self) -> String {
        let got = match &self.got {
            Ok(got) => got.clone(),
            Err(fault) => format!("**FAIL** {fault}"),
        };
        let Answers { sums, warp } = &self.peers;
        format!("{} {} | {got} | {sums} | {warp} |\n", self.start(), self.expected)
    }
}
