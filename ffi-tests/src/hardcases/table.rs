//! The rows of the hard-case page, and the page itself.

use super::laws::Verdict;
use super::peers::Answers;
use std::fmt::Write;

const PREAMBLE: &str = "# Hard cases

Written by `make hardcases` and checked by `make test`, through the C interface of the release library. A row fails if
the answer is not the documented one.

*Legal* samples: 1193 values of u, among them 0, 2^-149, 1 - 2^-24, 1, NaN and values outside [0, 1); each has a
direction of unit length and a finite pdf above 0, `pdf(wi)` and the batches give the very bits, and `invert` answers a
u in [0, 1).

The last two columns are what the formulas of two common samplers of the light do on the same map, in 32-bit floats as
published: rows and columns by cumulative sums (pbrt-v3), and a hierarchical warp with bilinear patches (Clarberg et al.
2005; Mitsuba 3). They are our own short versions (`ffi-tests/src/hardcases/peers.rs`), not those programs; a dash: not
run. *Unreachable*: lit texels (or patches) that no u leads to though their pdf is positive. *Blind*: lit, with pdf 0.
*Off*: samples whose pdf is not that of their direction within a thousandth (mostly points on the border of a texel).
*pdf 0*: no sample though there is light.

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

/// All cases.
#[derive(Default)]
pub struct Table {
    /// In the order of the page.
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

    /// The rows that answer something else than documented.
    pub fn failures(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| row.got.is_err())
    }

    /// The page as Markdown.
    pub fn page(&self) -> String {
        let mut page = String::from(PREAMBLE);
        page.push_str(
            "| case | expected | got | cumulative sums | hierarchical warp |\n| --- | --- | --- | --- | --- |\n",
        );
        for row in &self.rows {
            page.push_str(&row.line());
        }
        let failures = self.failures().count();
        let _ = writeln!(page, "\n{} cases, {failures} failures.", self.rows.len());
        page
    }

    /// Whether a page is what would be written, but for the rows that were skipped here.
    pub fn matches(&self, page: &str) -> bool {
        let skipped = |line: &str| self.rows.iter().any(|row| row.skipped && line.starts_with(&row.start()));
        let kept = |page: &str| page.lines().filter(|line| !skipped(line)).map(str::to_string).collect::<Vec<_>>();
        kept(page) == kept(&self.page())
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
